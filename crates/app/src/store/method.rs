//! The method of a result: a paragraph to copy into a report.

use std::collections::BTreeSet;

use bristle::model::settings::Settings;
use bristle::simulation::{Form, Pass};
use bristle_study::grid::Study;
use bristle_study::text::number::short;

/// The article that the model comes from, as CITATION.cff states it.
const ARTICLE: &str = "E. Uhlmann and A. Hoyer, Modeling of Contact Forces for Brushing Tools, Ceramics 4 (3), 2021, \
                       doi:10.3390/ceramics4030029";

/// Returns the method of one contact or brush, computed by this build.
#[must_use]
pub fn method_of_case(settings: &Settings) -> String {
    method(std::slice::from_ref(settings), env!("CARGO_PKG_VERSION"))
}

/// Returns the method of a study, computed by a `version` of Bristle.
#[must_use]
pub fn method_of_study(study: &Study, version: &str) -> String {
    let cases: Vec<Settings> = (0..study.case_count())
        .map(|case| study.settings(case))
        .collect();
    method(&cases, version)
}

/// Equations, integrator, tolerance, contact law and citation of the `cases`.
fn method(cases: &[Settings], version: &str) -> String {
    let values = |value: &dyn Fn(&Settings) -> f64| range(cases.iter().map(value));
    let segments = values(&|case| case.filament.segments as f64);
    let is_brush = cases.iter().any(|case| case.brush.is_some());
    let motion = if is_brush {
        "in space, or in the plane of rotation where symmetry keeps all filaments there"
    } else {
        motion_of_passes(cases)
    };
    let integrator = if is_brush {
        let tolerance = values(&|case| case.brush_or_default().tolerance);
        format!(
            "All filaments that touch are integrated as one motion by TR-BDF2 (Bank et al., IEEE Transactions on Electron Devices \
             32, 1985; embedded weights: Hosea and Shampine, Applied Numerical Mathematics 20, 1996). The relative tolerance of \
             the mean impulse is {tolerance}."
        )
    } else {
        let tolerance = values(&|case| case.solver.relative_tolerance);
        format!(
            "Each pass of a filament is integrated by ESDIRK5(4)7L[2]SA2 (Kennedy and Carpenter, Applied Numerical Mathematics \
             146, 2019). The relative tolerance is {tolerance}."
        )
    };
    let contact = [
        ("k_c", values(&|case| case.contact.stiffness_n_m), " N/m^p"),
        ("p", values(&|case| case.contact.exponent), ""),
        ("χ", values(&|case| case.contact.damping_s_m), " s/m"),
        ("µ", values(&|case| case.contact.friction_coefficient), ""),
        (
            "v_reg",
            values(&|case| case.contact.friction_regularisation_m_s),
            " m/s",
        ),
    ]
    .map(|(symbol, value, unit)| format!("{symbol} = {value}{unit}"))
    .join(", ");
    let between = if is_brush {
        let stiffness = values(&|case| case.brush_or_default().stiffness_n_m2);
        let friction = values(&|case| case.brush_or_default().friction_coefficient);
        format!(
            " Filaments are capsules that press on each other with k_l = {stiffness} N/m²; their coefficient of friction is \
             {friction}."
        )
    } else {
        String::new()
    };
    format!(
        "A filament is a chain of rigid segments with springs and dampers in its joints (Uhlmann and Hoyer 2021), here with n = \
         {segments} segments. The equations of motion are derived symbolically from Lagrange's equations and solved {motion}. \
         {integrator} Nodes that penetrate the workpiece by δ feel F_n = k_c δ^p (1 + χ δ̇) (Hunt and Crossley 1975) and the \
         friction −µ F_n v_t/√(v_t² + v_reg²), with {contact}.{between} Cite: The Bristle authors, Bristle {version}; {ARTICLE}."
    )
}

/// The form of the equations of contacts whose filaments are alone.
fn motion_of_passes(cases: &[Settings]) -> &'static str {
    let forms: BTreeSet<Form> = cases.iter().map(|case| Pass::new(case).form()).collect();
    match (
        forms.contains(&Form::Planar),
        forms.contains(&Form::Spatial),
    ) {
        (true, true) => "in the plane of rotation, or in space where the motion leaves it",
        (true, false) => "in the plane of rotation",
        _ => "in space",
    }
}

/// A value, or the least and the largest of several.
fn range(values: impl Iterator<Item = f64>) -> String {
    let [least, largest] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    if least == largest {
        short(least)
    } else {
        format!("{} to {}", short(least), short(largest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bristle::model::parameters::Parameter;
    use bristle::model::settings::BrushSettings;
    use bristle_study::grid::Sweep;

    #[test]
    fn a_method_names_equations_integrator_and_constants() {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.contact.friction_coefficient = 0.2;
        let planar = method_of_case(&settings);
        settings.filament.lateral_tilt_rad = 1e-3;
        let spatial = method_of_case(&settings);
        settings.brush = Some(BrushSettings::default());
        let brush = method_of_case(&settings);
        for (text, parts) in [
            (
                &planar,
                [
                    "with n = 25 segments",
                    "solved in the plane of rotation. ",
                    "ESDIRK5(4)7L[2]SA2 (Kennedy",
                    "The relative tolerance is 1e-6.",
                    "k_c = 1e5 N/m^p, p = 1, χ = 0 s/m, µ = 0.2, v_reg = 0.001 m/s.",
                ],
            ),
            (
                &spatial,
                ["solved in space. ", "ESDIRK", "µ = 0.2", "Lagrange", "Cite"],
            ),
            (
                &brush,
                [
                    "TR-BDF2",
                    "tolerance of the mean impulse is 0.003",
                    "k_l = 6e7 N/m²",
                    "Lagrange",
                    "Cite",
                ],
            ),
        ] {
            parts
                .iter()
                .for_each(|part| assert!(text.contains(part), "{part}: {text}"));
        }
    }

    #[test]
    fn swept_settings_have_a_range() {
        let friction = Parameter::find("contact.friction_coefficient").expect("it exists");
        let sweep = Sweep::list(friction, vec![0.3, 0.0, 0.1]).expect("the values are right");
        let study = Study::new(Settings::paper(10.0, 1e-3), vec![sweep]).expect("a study");
        let text = method_of_study(&study, "0.1");
        assert!(
            text.contains("µ = 0 to 0.3, v_reg") && text.contains("Bristle 0.1; "),
            "{text}"
        );
    }

    #[test]
    fn the_citation_is_that_of_the_repository() {
        let file = include_str!("../../../../CITATION.cff");
        let stated = |key: &str| {
            let values = file
                .lines()
                .filter_map(|line| line.trim_start_matches(['-', ' ']).split_once(": "));
            let own = values.filter(|(name, _)| *name == key);
            own.map(|(_, value)| value).collect::<Vec<_>>()
        };
        let text = method_of_case(&Settings::paper(10.0, 1e-3));
        for key in [
            "title",
            "version",
            "family-names",
            "journal",
            "volume",
            "issue",
            "year",
            "doi",
            "name",
        ] {
            let values = stated(key);
            assert!(!values.is_empty(), "{key}");
            for value in values {
                assert!(text.contains(value), "{key}: {value}");
            }
        }
    }
}
