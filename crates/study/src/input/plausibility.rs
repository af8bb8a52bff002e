//! Settings that are allowed but unusual, most of them by a slip: millimetres typed as metres, per
//! cent as a ratio.
//!
//! The table of settings has the usual range of each setting. Relations between several follow
//! here.

use bristle::model::parameters::{PARAMETERS, Parameter, Usual};
use bristle::model::settings::Settings;
use bristle::tool::{Place, Pose, Trim, places};
use bristle::workpiece::{Part, unit_normal};

use crate::grid::{DEPTH, Study, Sweep};
use crate::text::layout::Warning;
use crate::text::number::short;

/// Largest share of an area that equal circles can cover: π/√12, of the hexagonal packing.
const MAX_COVERED_SHARE: f64 = 0.906_899_682_117_108_9;

/// Largest depth at which a force is searched for, as a part of the free length (MODEL, "Force
/// instead of depth").
const MAX_DEPTH_SHARE: f64 = 0.5;
/// Smallest share of a trim's width that usually reaches the workpiece, on tilted tools that are
/// pressed on with an edge of their trim.
const MIN_REACHING_SHARE: f64 = 0.1;

/// Returns the share of the trim's width along which undeformed tips reach a plane as the tool
/// turns; one on other workpieces.
fn reaching_share(settings: &Settings) -> f64 {
    if !settings.workpiece.kind.is_plane() || settings.tool.positions == Some(1) {
        return 1.0;
    }
    let [x, y, z] = Pose::of(&settings.tool).to_tool(unit_normal(&settings.workpiece));
    let trim = Trim::of(settings);
    // Along the inward normal; linear in the place on the trim.
    let [one, other] = trim.ends().map(|s| {
        let [radius, height] = trim.tip(s);
        radius * x.hypot(y) - height * z
    });
    (settings.process.penetration_depth_m / (one - other).abs()).min(1.0)
}

/// A setting that is unusual.
#[derive(Clone, Debug, PartialEq)]
pub struct Unusual {
    /// Dotted path.
    pub path: &'static str,
    /// Value, usual values and the likely slip, in a sentence or two.
    pub statement: String,
}

/// Usual values of one setting in view of others.
struct Relation {
    /// Setting at which the warning points.
    path: &'static str,
    /// `true` for a usual value.
    holds: fn(&Settings) -> bool,
    /// Usual values, in words that follow "usually it is".
    usual: fn(&Settings) -> String,
    /// Slip that most likely leads to another value.
    slip: &'static str,
}

/// Relations, in the order in which they are reported.
const RELATIONS: &[Relation] = &[
    Relation {
        path: "tool.filament_count",
        holds: |settings| settings.fill_factor() <= MAX_COVERED_SHARE,
        usual: |settings| {
            let most =
                MAX_COVERED_SHARE * settings.tool.surface_m2() / settings.filament.root_area_m2();
            format!(
                "at most {}, as no more filaments of this diameter fit on the body",
                short(most.floor())
            )
        },
        slip: "filaments of another diameter, or a wrong radius or width of the body",
    },
    Relation {
        path: "tool.filament_count_uncertainty",
        holds: |settings| {
            settings.tool.filament_count_uncertainty <= 0.5 * settings.tool.filament_count
        },
        usual: |settings| {
            format!(
                "less than half of tool.filament_count = {}",
                short(settings.tool.filament_count)
            )
        },
        slip: "the number itself in the place of its uncertainty",
    },
    Relation {
        path: "filament.diameter_m",
        holds: |settings| 10.0 * settings.filament.diameter_m <= settings.filament.length_m,
        usual: |settings| {
            format!(
                "less than a tenth of filament.length_m = {}",
                short(settings.filament.length_m)
            )
        },
        slip: "a wrong length: a filament this thick is not slender, and its bending is another",
    },
    Relation {
        path: "process.penetration_depth_m",
        holds: |settings| settings.process.penetration_depth_m <= 0.4 * settings.filament.length_m,
        usual: |settings| {
            format!(
                "far below filament.length_m = {}",
                short(settings.filament.length_m)
            )
        },
        slip: "a wrong unit, or the distance of the tool instead of the depth",
    },
    Relation {
        path: "tool.tilt_rad",
        holds: |settings| reaching_share(settings) >= MIN_REACHING_SHARE,
        usual: |settings| {
            format!(
                "such that more of the trim reaches the workpiece; here {} % of its width does",
                short(100.0 * reaching_share(settings))
            )
        },
        slip: "degrees typed as radians, an angle to the workpiece in the place of that from the upright tool, or a depth that is too small",
    },
    Relation {
        path: "workpiece.offset_m",
        holds: |settings| {
            let touches = |place: &Place| {
                Part::at(settings, place.s).is_ok_and(|(_, passage)| passage.contact_angle() > 0.0)
            };
            places(settings).iter().any(touches)
        },
        usual: |_| {
            "such that undeformed filaments reach it; here they never touch the workpiece"
                .to_owned()
        },
        slip: "a workpiece next to or below the reach of the tool, by its offset, its kind or the penetration depth",
    },
    Relation {
        path: "uncertainty.length_std_m",
        holds: |settings| settings.uncertainty.length_std_m <= 0.3 * settings.filament.length_m,
        usual: |settings| {
            format!(
                "a small part of filament.length_m = {}",
                short(settings.filament.length_m)
            )
        },
        slip: "per cent, or a wrong unit",
    },
    Relation {
        path: "uncertainty.diameter_std_m",
        holds: |settings| settings.uncertainty.diameter_std_m <= 0.3 * settings.filament.diameter_m,
        usual: |settings| {
            format!(
                "a small part of filament.diameter_m = {}",
                short(settings.filament.diameter_m)
            )
        },
        slip: "per cent, or a wrong unit",
    },
    Relation {
        path: "uncertainty.youngs_modulus_std_pa",
        holds: |settings| {
            settings.uncertainty.youngs_modulus_std_pa <= 0.5 * settings.filament.youngs_modulus_pa
        },
        usual: |settings| {
            format!(
                "a small part of filament.youngs_modulus_pa = {}",
                short(settings.filament.youngs_modulus_pa)
            )
        },
        slip: "per cent, or a wrong unit",
    },
];

impl Unusual {
    /// States a value of a setting, usual values in words that follow "usually it is", and the
    /// likely slip.
    fn new(parameter: &Parameter, value: f64, usual: &str, slip: &str) -> Self {
        let value = format!("{} {}", short(value), parameter.unit);
        let path = parameter.path;
        let statement = format!(
            "`{path}` is {}; usually it is {usual}. A likely slip: {slip}.",
            value.trim_end()
        );
        Self { path, statement }
    }
}

/// Checks one value of a setting. `None` if it is usual.
#[must_use]
pub fn unusual_value(parameter: &Parameter, value: f64) -> Option<Unusual> {
    let Usual {
        least,
        largest,
        slip,
    } = parameter
        .usual
        .filter(|usual| !(usual.least..=usual.largest).contains(&value))?;
    let usual = format!(
        "from {} to {} {}",
        short(least),
        short(largest),
        parameter.unit
    );
    Some(Unusual::new(parameter, value, usual.trim_end(), slip))
}

/// Finds unusual settings.
#[must_use]
pub fn unusual(settings: &Settings) -> Vec<Unusual> {
    // A depth that is to be found for a force is any up to the largest of the search.
    let is_found = settings.process.tool_force_n.is_some();
    let at_depth = is_found.then(|| {
        settings.at_depth(
            settings
                .clearance_m()
                .min(MAX_DEPTH_SHARE * settings.filament.length_m),
        )
    });
    let settings = at_depth.as_ref().unwrap_or(settings);
    let is_known = |path: &str| !is_found || path != DEPTH;
    let parameters = PARAMETERS
        .iter()
        .filter(|parameter| is_known(parameter.path));
    let of_values =
        parameters.filter_map(|parameter| unusual_value(parameter, parameter.read(settings)?));
    let relations = RELATIONS
        .iter()
        .filter(|relation| is_known(relation.path) && !(relation.holds)(settings));
    let of_relations = relations.filter_map(|relation| {
        let parameter = Parameter::find(relation.path)?;
        Some(Unusual::new(
            parameter,
            parameter.get(settings),
            &(relation.usual)(settings),
            relation.slip,
        ))
    });
    let mut found: Vec<Unusual> = Vec::new();
    for unusual in of_values.chain(of_relations) {
        // An alias is not reported again.
        let is_same = |told: &Unusual| {
            Parameter::find(unusual.path)
                .is_some_and(|parameter| parameter.group().any(|same| same.path == told.path))
        };
        if !found.iter().any(is_same) {
            found.push(unusual);
        }
    }
    found
}

/// Finds unusual settings in the cases of a study, each once, with the number of cases and the
/// first of them.
#[must_use]
pub fn unusual_in_study(study: &Study) -> Vec<Unusual> {
    let mut found: Vec<(Unusual, usize, usize)> = Vec::new();
    let total = study.case_count();
    for case in 0..total {
        for unusual in unusual(&study.settings(case)) {
            match found
                .iter_mut()
                .find(|(told, ..)| told.path == unusual.path)
            {
                Some((_, count, _)) => *count += 1,
                None => found.push((unusual, 1, case + 1)),
            }
        }
    }
    let with_cases = |(mut unusual, count, row): (Unusual, usize, usize)| {
        if count < total {
            unusual.statement.push_str(&format!(
                " This is so in {count} of {total} cases, first in row {row}."
            ));
        }
        unusual
    };
    let repeated = study.sweeps().iter().filter_map(repeated);
    repeated.chain(found.into_iter().map(with_cases)).collect()
}

/// Finds equal values of a sweep.
fn repeated(sweep: &Sweep) -> Option<Unusual> {
    let mut values = sweep.values().to_vec();
    values.sort_by(f64::total_cmp);
    let twice = values.windows(2).find(|pair| pair[0] == pair[1])?[0];
    let statement = format!(
        "`{}` is swept with {} more than once: equal cases are simulated again. A likely slip: a value typed twice.",
        sweep.path(),
        sweep.setting().text(twice)
    );
    Some(Unusual {
        path: sweep.path(),
        statement,
    })
}

/// Formats the warnings about unusual settings, each for a terminal 80 columns wide.
#[must_use]
pub fn warnings(found: &[Unusual]) -> Vec<String> {
    found
        .iter()
        .map(|unusual| Warning::new(&unusual.statement).to_string())
        .collect()
}

#[cfg(test)]
mod tests {
    use bristle::model::settings::{RoundSettings, ToolKind, WorkpieceKind};

    use super::*;

    #[test]
    fn each_slip_is_told_once_by_its_key() {
        /// Setting that is reported, and a slip.
        type Slip = (&'static str, fn(&mut Settings));
        let slips: [Slip; 22] = [
            ("filament.length_m", |settings| {
                settings.filament.length_m = 30.0
            }),
            ("tool.body_radius_m", |settings| {
                settings.tool.body_radius_m = 140.0
            }),
            ("tool.width_m", |settings| settings.tool.width_m = 20.0),
            ("filament.youngs_modulus_pa", |settings| {
                settings.filament.youngs_modulus_pa = 3e3
            }),
            ("tool.filament_count", |settings| {
                settings.tool.filament_count = 0.0
            }),
            ("tool.filament_count", |settings| {
                settings.tool.filament_count = 1e7
            }),
            ("tool.filament_count", |settings| {
                settings.tool.filament_count = 16_000.0
            }),
            ("tool.filament_count_uncertainty", |settings| {
                settings.tool.filament_count_uncertainty = 10_500.0
            }),
            ("filament.damping_ratio", |settings| {
                settings.filament.damping_ratio = 5.0
            }),
            ("contact.friction_coefficient", |settings| {
                settings.contact.friction_coefficient = 30.0
            }),
            ("filament.segments", |settings| {
                settings.filament.segments = 1
            }),
            ("filament.diameter_m", |settings| {
                settings.filament.diameter_m = 8e-3
            }),
            ("filament.diameter_m", |settings| {
                settings.filament.length_m = 8e-3
            }),
            ("process.penetration_depth_m", |settings| {
                settings.process.penetration_depth_m = 0.035
            }),
            ("filament.density_kg_m3", |settings| {
                settings.filament.density_kg_m3 = 1.11
            }),
            ("process.brushing_velocity_m_s", |settings| {
                settings.process.brushing_velocity_m_s = 600.0
            }),
            ("filament.lateral_tilt_rad", |settings| {
                settings.filament.lateral_tilt_rad = 0.9
            }),
            ("workpiece.feed_velocity_m_s", |settings| {
                settings.workpiece.feed_velocity_m_s = 50.0
            }),
            ("contact.stiffness_n_m", |settings| {
                settings.contact.stiffness_n_m = 100.0
            }),
            ("solver.relative_tolerance", |settings| {
                settings.solver.relative_tolerance = 1e-2
            }),
            ("uncertainty.length_std_m", |settings| {
                settings.uncertainty.length_std_m = 0.03
            }),
            ("filament.waviness_amplitude_m", |settings| {
                settings.filament.waviness_amplitude_m = 1.0
            }),
        ];
        assert_eq!(unusual(&Settings::paper(10.0, 1e-3)), []);
        for (path, slip) in slips {
            let mut settings = Settings::paper(10.0, 1e-3);
            slip(&mut settings);
            let found = unusual(&settings);
            assert_eq!(
                found.iter().filter(|unusual| unusual.path == path).count(),
                1,
                "{path}: {found:?}"
            );
            let statement = &found
                .iter()
                .find(|unusual| unusual.path == path)
                .expect("it was counted")
                .statement;
            assert!(
                statement.contains("usually it is") && statement.contains("A likely slip: "),
                "{statement}"
            );
            assert!(
                warnings(&found)
                    .iter()
                    .flat_map(|text| text.lines())
                    .all(|line| line.chars().count() <= 80)
            );
        }
    }

    /// Returns a shaft beyond the reach of a brush.
    fn far() -> WorkpieceKind {
        WorkpieceKind::Cylinder(RoundSettings {
            radius_m: 0.02,
            offset_m: 0.5,
        })
    }

    #[test]
    fn trims_that_miss_the_workpiece_are_told() {
        let paths = |settings: &Settings| {
            unusual(settings)
                .iter()
                .map(|unusual| unusual.path)
                .collect::<Vec<_>>()
        };
        let mut tilted = Settings::paper(10.0, 1e-3);
        // It lifts the far end of the trim by 20 mm · sin τ.
        tilted.tool.tilt_rad = Some(0.3);
        assert_eq!(paths(&tilted), [""; 0], "a sixth of the trim reaches it");
        tilted.tool.tilt_rad = Some(0.7);
        let told = unusual(&tilted);
        assert!(
            told[0].path == "tool.tilt_rad"
                && told[0].statement.contains("here 7.761 % of its width does"),
            "{told:?}"
        );
        tilted.tool.positions = Some(1);
        assert_eq!(
            paths(&tilted),
            [""; 0],
            "the depth is that of the only filament"
        );
        // A cone whose axis is held like that of a round brush, and one that is far from a shaft.
        let mut cone = Settings::paper(10.0, 1e-3);
        (cone.tool.kind, cone.tool.filament_angle_rad) = (ToolKind::Cone, Some(0.5));
        assert_eq!(paths(&cone), [""; 0]);
        cone.tool.tilt_rad = Some(0.0);
        assert_eq!(paths(&cone), ["tool.tilt_rad"]);
        cone.tool.tilt_rad = None;
        cone.workpiece.kind = far();
        assert_eq!(paths(&cone), ["workpiece.offset_m"]);
        // Only an end of the trim of a tilted cup touches, not its middle.
        let mut cup = Settings::paper(10.0, 1e-3);
        (cup.tool.kind, cup.tool.tilt_rad) = (ToolKind::Cup, Some(1.4));
        assert_eq!(paths(&cup), [""; 0]);
    }

    #[test]
    fn a_depth_that_is_to_be_found_is_not_unusual() {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.set_tool_force_n(50.0);
        assert_eq!(unusual(&settings), []);
        settings.workpiece.kind = far();
        assert_eq!(
            unusual(&settings)
                .iter()
                .map(|unusual| unusual.path)
                .collect::<Vec<_>>(),
            ["workpiece.offset_m"]
        );
    }

    #[test]
    fn usual_ranges_are_within_the_allowed_ones() {
        for parameter in PARAMETERS {
            if let Some(Usual { least, largest, .. }) = parameter.usual {
                assert!(least < largest, "{}", parameter.path);
                assert!(parameter.range.contains(largest), "{}", parameter.path);
            }
        }
        for Relation { path, .. } in RELATIONS {
            assert!(Parameter::find(path).is_some(), "{path}");
        }
    }
}
