//! Passes that are not what their settings mean: edges that are penetrated too deeply, and
//! filaments that are splayed clear of the workpiece.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::tool::Trim;
use bristle::workpiece::{Edge, Part, Workpiece};

use super::count::{cases, of_rows, rows};
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::layout::Warning;
use bristle_study::text::number::short;

/// The share of an edge's radius down to which the contact law is meant for it.
const DEEPEST_SHARE: f64 = 0.5;

/// What a deep penetration means for results, and what avoids it.
const DEEP: &str = "The force then depends on the contact stiffness: a larger `contact.stiffness_n_m` penetrates less.";

/// Shares of `a_e` and of `d` up to which a contact is stiff (MODEL, "Contact that converges with
/// the number of segments").
const STIFF_DEPTH_SHARE: f64 = 1.0 / 20.0;
const STIFF_DIAMETER_SHARE: f64 = 1.0 / 4.0;

/// The consequence of a large penetration.
const SOFT: &str = "more than a twentieth of a_e or a quarter of d: the contact is softer than the workpiece can be.";

/// A tool without contact, what clears the workpiece, and what avoids it.
const FREE: &str = "the turning tool never touches the workpiece.";
const SPLAYED: &str = "Centrifugal forces splay its filaments, whose tips then lie less deep than those of the tool at rest. Press it deeper, or turn it slower.";

/// Whether a tool whose filaments splay never touches.
fn is_free(settings: &Settings, metrics: &Metrics) -> bool {
    !Trim::of(settings).is_radial() && metrics.contact_angle_rad > 0.0 && metrics.contact_count == 0
}

/// The warning about one tool that never touches the workpiece.
pub(super) fn of_free_contact(settings: &Settings, metrics: &Metrics) -> Option<Warning> {
    is_free(settings, metrics).then(|| Warning::new(format!("{FREE} {SPLAYED}")))
}

/// The warning about the cases of a study in which the tool never touches the workpiece.
pub(super) fn of_free_cases(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let free = rows(study, results, is_free);
    of_rows(&free, results.len(), &format!("{FREE} {SPLAYED}"))
}

/// The contact stiffness in N/m^p at which a face is penetrated as little as it should be; `None`
/// if it is. A contact that stores the same energy has it.
fn stiffness_needed(settings: &Settings, metrics: &Metrics) -> Option<f64> {
    // The depth of a case that states a force is that which was found.
    let depth = if metrics.penetration_depth_m > 0.0 {
        metrics.penetration_depth_m
    } else {
        settings.process.penetration_depth_m
    };
    let diameter = settings.filament.diameter_m;
    let stiff = (STIFF_DEPTH_SHARE * depth).min(STIFF_DIAMETER_SHARE * diameter);
    let ratio = metrics.max_penetration_m / stiff;
    let contact = &settings.contact;
    (ratio > 1.0 && !is_deep(settings, metrics))
        .then(|| contact.stiffness_n_m * ratio.powf(contact.exponent + 1.0))
}

/// Advises a stiffness, rounded up to two digits.
fn stiffness_advice(stiffness: f64) -> String {
    let digit = 10.0_f64.powf(stiffness.log10().floor() - 1.0);
    format!(
        "`contact.stiffness_n_m = {:.1e}` would not be.",
        (stiffness / digit).ceil() * digit
    )
}

/// The warning about one contact that is too soft.
pub(super) fn of_soft_contact(settings: &Settings, metrics: &Metrics) -> Option<Warning> {
    let stiffness = stiffness_needed(settings, metrics)?;
    Some(Warning::new(format!(
        "nodes penetrate the workpiece by {} mm, {SOFT} {}",
        short(1e3 * metrics.max_penetration_m),
        stiffness_advice(stiffness)
    )))
}

/// The warning about the cases of a study whose contact is too soft.
pub(super) fn of_soft_cases(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let soft = rows(study, results, |settings, metrics| {
        stiffness_needed(settings, metrics).is_some()
    });
    let needed = soft.iter().filter_map(|row| {
        let metrics = &results[row - 1].as_ref().ok()?.metrics;
        stiffness_needed(&study.settings(row - 1), metrics)
    });
    let advice = stiffness_advice(needed.fold(0.0, f64::max));
    of_rows(
        &soft,
        results.len(),
        &format!("nodes penetrate the workpiece (max_penetration_m) by {SOFT} {advice}"),
    )
}

/// The warning about one contact.
pub(super) fn of_contact(settings: &Settings, metrics: &Metrics) -> Option<Warning> {
    is_deep(settings, metrics).then(|| {
        Warning::new(format!(
            "the filament penetrates an edge by {} mm, more than half of its radius of {} mm. {DEEP}",
            short(1e3 * metrics.max_edge_penetration_m),
            short(1e3 * edge_radius(settings))
        ))
    })
}

/// The warning about the cases of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let deep = rows(study, results, is_deep);
    deep.first().map(|first| {
        Warning::new(format!(
            "in {} of {} the filament penetrates an edge by more than half of its radius, first in row {first} of runs.csv (column \
             max_edge_penetration_m). {DEEP}",
            deep.len(),
            cases(results.len())
        ))
    })
}

/// Whether the penetration of an edge is not small against its radius.
fn is_deep(settings: &Settings, metrics: &Metrics) -> bool {
    metrics.max_edge_penetration_m > 0.0
        && metrics.max_edge_penetration_m > DEEPEST_SHARE * edge_radius(settings)
}

/// The smallest radius of the workpiece's edges, in m; infinite without edges.
fn edge_radius(settings: &Settings) -> f64 {
    Part::of(settings).map_or(f64::INFINITY, |(part, _)| {
        let radii = part.edges().iter().map(Edge::radius);
        radii.fold(f64::INFINITY, f64::min)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{brush, result};
    use bristle::model::settings::ToolKind;
    use bristle_study::input::document::Document;

    const FILE: &str = concat!(
        brush!(8),
        "
        [workpiece]
        kind = \"edge\"
        edge_radius_m = 0.2e-3
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        brushing_velocity_m_s = [5.0, 10.0, 15.0]
        "
    );

    fn metrics(max_edge_penetration_m: f64) -> Metrics {
        Metrics {
            max_edge_penetration_m,
            ..Metrics::default()
        }
    }

    #[test]
    fn deep_edges_are_told() {
        let document = Document::parse(FILE, "case.toml").expect("a document");
        let settings = document.settings().expect("settings");
        // Half of the radius is not too deep.
        assert_eq!(of_contact(&settings, &metrics(0.1e-3)), None);
        let deep = of_contact(&settings, &metrics(0.123456e-3)).expect("a warning");
        let statement =
            "the filament penetrates an edge by 0.1235 mm, more than half of its radius of 0.2 mm.";
        assert_eq!(deep.plain(), format!("{statement} {DEEP}"));

        let study = document.study().expect("a study");
        let results = [
            result(metrics(0.0)),
            Err("failed".to_owned()),
            result(metrics(1e-3)),
        ];
        let told = of_study(&study, &results).expect("a warning").plain();
        let start = "in 1 of 3 cases the filament penetrates an edge by more";
        assert!(
            told.starts_with(start) && told.contains("first in row 3"),
            "{told}"
        );
        assert_eq!(of_study(&study, &results[..2]), None);
    }

    #[test]
    fn soft_contacts_are_told_with_a_stiffness_that_is_enough() {
        let document = Document::parse(FILE, "case.toml").expect("a document");
        let settings = document.settings().expect("settings");
        let soft = |max_penetration_m: f64| Metrics {
            max_penetration_m,
            ..Metrics::default()
        };
        // A twentieth of 1 mm.
        assert_eq!(of_soft_contact(&settings, &soft(0.05e-3)), None);
        let told = of_soft_contact(&settings, &soft(0.1e-3)).expect("a warning");
        let statement = "nodes penetrate the workpiece by 0.1 mm, ";
        let advice = "`contact.stiffness_n_m = 4.0e5` would not be.";
        assert_eq!(told.plain(), format!("{statement}{SOFT} {advice}"));
        let study = document.study().expect("a study");
        let results = [soft(0.0), soft(0.1e-3), soft(0.2e-3)].map(result);
        let told = of_soft_cases(&study, &results).expect("a warning").plain();
        assert!(
            told.starts_with("in 2 of 3 cases, first in row 2"),
            "{told}"
        );
        assert!(
            told.ends_with("`contact.stiffness_n_m = 1.6e6` would not be."),
            "{told}"
        );
    }

    #[test]
    fn cups_that_splay_clear_of_the_workpiece_are_told() {
        let document = Document::parse(FILE, "case.toml").expect("a document");
        let mut settings = document.settings().expect("settings");
        let free = Metrics {
            contact_angle_rad: 1.0,
            ..Metrics::default()
        };
        // Radial filaments do not splay.
        assert_eq!(of_free_contact(&settings, &free), None);
        settings.tool.kind = ToolKind::Cup;
        let told = of_free_contact(&settings, &free).expect("a warning");
        assert_eq!(told.plain(), format!("{FREE} {SPLAYED}"));
        let touching = Metrics {
            contact_count: 1,
            ..free.clone()
        };
        assert_eq!(of_free_contact(&settings, &touching), None);
        let study = Study::new(settings, Vec::new()).expect("a study");
        let told = of_free_cases(&study, &[result(free)])
            .expect("a warning")
            .plain();
        let start = "in 1 of 1 case, first in row 1 of runs.csv, the turning tool never";
        assert!(told.starts_with(start), "{told}");
    }
}
