//! Saved studies joined into one that compares their tools, at the settings that they share.
//!
//! Each study is a named tool of the joined study, or several if it compares tools itself. No case
//! is simulated or interpolated: each comes from one of the studies.

use std::cmp::Ordering;

use bristle::model::parameters::Parameter;
use bristle_study::text::shown;
use thiserror::Error;

use crate::insight::joined_tool::{JoinedTool, SharedAxis, Values};
use crate::store::results::{BuildOrigin, SavedStudy};
use bristle_study::grid::{CaseResult, DEPTH, Setting, Study, StudyError, Sweep, VELOCITY};
use bristle_study::input::measured::Measurement;

/// Maximum length of a study's name in a message, in characters.
pub(super) const MAX_NAME_CHARS: usize = 60;

/// A saved study, its results, and its name in the joined study.
#[derive(Clone, Debug)]
pub struct NamedStudy {
    /// Name of the study.
    pub name: String,
    /// The study.
    pub saved: SavedStudy,
    /// Results, one per case.
    pub results: Vec<CaseResult>,
    /// Measured forces that the study was compared with.
    pub measured: Vec<Measurement>,
}

/// Several studies joined into one.
#[derive(Clone, Debug)]
pub struct Joined {
    /// The joined study, over named tools.
    pub study: Study,
    /// Results of the joined study.
    pub results: Vec<CaseResult>,
    /// Measured forces of all studies, with the kind of speed of the first.
    pub measured: Vec<Measurement>,
    /// Values that are left out of each study, in sentences.
    pub notes: Vec<String>,
    /// The builds that simulated the studies.
    pub origin: BuildOrigin,
}

/// Reason in words why studies cannot be compared.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct JoinError(String);

impl From<StudyError> for JoinError {
    fn from(error: StudyError) -> Self {
        let help = match error {
            StudyError::ToolName(_) | StudyError::ToolsAlike { .. } => {
                "\n   = help: give a name, as in fine=results/3"
            }
            _ => "",
        };
        Self(format!("{error}{help}"))
    }
}

/// Returns the settings that may be axes of the joined study: velocity and depth always, then those
/// that some part sweeps. Each comes with the ways in which the parts state it.
fn candidates(parts: &[JoinedTool<'_>]) -> Vec<Vec<&'static Parameter>> {
    let process = [VELOCITY, DEPTH].into_iter().filter_map(Parameter::find);
    let swept = parts
        .iter()
        .flat_map(JoinedTool::axes)
        .filter_map(|(sweep, _)| sweep.setting().parameter());
    let swept: Vec<&'static Parameter> = swept.collect();
    let mut groups: Vec<Vec<&'static Parameter>> = Vec::new();
    for parameter in process.chain(swept.iter().copied()) {
        let is_same =
            |other: &&'static Parameter| parameter.group().any(|same| same.path == other.path);
        if groups.iter().flatten().any(is_same) {
            continue;
        }
        let mut ways: Vec<&'static Parameter> = Vec::new();
        for way in swept.iter().copied().filter(is_same) {
            if ways.iter().all(|other| other.path != way.path) {
                ways.push(way);
            }
        }
        groups.push(if ways.is_empty() {
            vec![parameter]
        } else {
            ways
        });
    }
    groups
}

/// Returns the axis that the parts share in one of the `ways` to state it. `None` if the setting is
/// a property of each tool.
fn shared_axis(
    parts: &[JoinedTool<'_>],
    ways: &[&'static Parameter],
) -> Result<Option<SharedAxis>, JoinError> {
    let is_process = ways.iter().any(|way| {
        way.group()
            .any(|same| [VELOCITY, DEPTH].contains(&same.path))
    });
    let mut refusal = None;
    for &parameter in ways {
        let of_parts: Result<Vec<Values>, &JoinedTool<'_>> = parts
            .iter()
            .map(|part| part.values(parameter).ok_or(part))
            .collect();
        let of_parts = match of_parts {
            Ok(of_parts) => of_parts,
            Err(part) => {
                refusal.get_or_insert(JoinError(format!(
                    "`{}` of {} is another in each case, because it follows from other swept settings: the studies have no common \
                     axis\n   = help: state the speed, or the number of filaments, alike in all studies",
                    parameter.path,
                    shown(&part.name, MAX_NAME_CHARS)
                )));
                continue;
            }
        };
        let is_everywhere =
            |value: &f64| of_parts.iter().all(|part| part.position(*value).is_some());
        let values: Vec<f64> = of_parts[0]
            .values
            .iter()
            .copied()
            .filter(is_everywhere)
            .collect();
        if !values.is_empty() {
            return Ok(Some(SharedAxis {
                parameter,
                values,
                of_parts,
            }));
        }
        let ranges = parts
            .iter()
            .zip(&of_parts)
            .map(|(part, own)| part.range(parameter, &own.values));
        refusal.get_or_insert(JoinError(format!(
            "the studies have no {} in common: {}\n   = help: simulate cases that all of them have, by the same values of `{}` under \
             [study]",
            parameter.name,
            ranges.collect::<Vec<_>>().join(", "),
            parameter.path
        )));
    }
    // A setting that no part sweeps over several values is a property of each tool.
    let is_of_group = |sweep: &Sweep| ways.iter().any(|way| way.path == sweep.path());
    let is_swept = parts
        .iter()
        .flat_map(JoinedTool::axes)
        .any(|(sweep, _)| sweep.values().len() > 1 && is_of_group(sweep));
    refusal
        .filter(|_| is_process || is_swept)
        .map_or(Ok(None), Err)
}

/// Returns a sentence about the values of a part that are left out; `None` without any.
fn left_out(part: &JoinedTool<'_>, number: usize, shared: &[SharedAxis]) -> Option<String> {
    let of_axis = |axis: &SharedAxis| {
        let (own, kept) = (axis.of_parts[number].values.len(), axis.values.len());
        let symbol = Setting::Number(axis.parameter).symbol();
        match own.cmp(&kept) {
            Ordering::Greater => Some(format!("{kept} of {own} values of {symbol}")),
            _ => None,
        }
    };
    let axes: Vec<String> = shared.iter().filter_map(of_axis).collect();
    (!axes.is_empty()).then(|| {
        format!(
            "of {}, {} are compared",
            shown(&part.name, MAX_NAME_CHARS),
            axes.join(" and ")
        )
    })
}

/// Joins studies, at the values that they share.
///
/// # Errors
/// If there is no common value of a swept setting, of velocity or of depth, or the names cannot be
/// names of tools.
pub fn join(studies: &[NamedStudy]) -> Result<Joined, JoinError> {
    let parts: Vec<JoinedTool<'_>> = studies.iter().flat_map(JoinedTool::all).collect();
    if studies.len() < 2 {
        return Err(JoinError(
            "one study alone cannot be compared: name at least two".to_owned(),
        ));
    }
    let axes = candidates(&parts)
        .into_iter()
        .map(|ways| shared_axis(&parts, &ways));
    let axes: Vec<SharedAxis> = axes
        .filter_map(Result::transpose)
        .collect::<Result<_, _>>()?;
    // A setting that no study sweeps is a setting like others.
    let is_swept = |axis: &SharedAxis| {
        parts
            .iter()
            .flat_map(JoinedTool::axes)
            .any(|(sweep, _)| sweep.path() == axis.parameter.path)
    };
    let shared: Vec<SharedAxis> = axes.into_iter().filter(is_swept).collect();
    let tools = parts.iter().map(|part| part.tool(&shared)).collect();
    let sweep = |axis: &SharedAxis| {
        Sweep::list(axis.parameter, axis.values.clone())
            .map_err(|error| JoinError(error.to_string()))
    };
    let study = Study::of_tools(tools, shared.iter().map(sweep).collect::<Result<_, _>>()?)?;
    let of_tool = study.case_count() / parts.len();
    let result = |case: usize| {
        let number = case / of_tool;
        let part = &parts[number];
        let step = |(sweep, value): (&Sweep, f64)| {
            let axis = shared
                .iter()
                .find(|axis| axis.parameter.path == sweep.path())?;
            let own = &axis.of_parts[number];
            Some(own.stride * own.position(value)?)
        };
        let steps: usize = study
            .sweeps()
            .iter()
            .zip(study.values(case))
            .filter_map(step)
            .sum();
        part.results[part.first + steps].clone()
    };
    let results = (0..study.case_count()).map(result).collect();
    let kind = parts
        .iter()
        .flat_map(|part| part.measured)
        .map(|point| point.speed.quantity())
        .next();
    let measured = kind.map(|kind| {
        parts
            .iter()
            .enumerate()
            .flat_map(move |(number, part)| part.measured(number, kind))
    });
    let measured = measured.into_iter().flatten().collect();
    let notes = parts
        .iter()
        .enumerate()
        .filter_map(|(number, part)| left_out(part, number, &shared))
        .collect();
    let origins = studies.iter().map(|study| &study.saved.origin);
    let origin = origins
        .clone()
        .skip(1)
        .fold(studies[0].saved.origin.clone(), BuildOrigin::and);
    Ok(Joined {
        results,
        measured,
        notes,
        origin,
        study,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{self, brush, with_force};
    use crate::store::results::{read_study, study_text};
    use bristle_study::grid::SPEED;
    use bristle_study::input::measured::Speed;

    const HEAD: &str = brush!(4);

    /// Returns a study whose case numbers, counted from `first`, are its forces.
    fn named(name: &str, text: &str, first: usize) -> NamedStudy {
        let study = testing::study(text);
        let result = |case| with_force((first + case) as f64, 0.0);
        let results = (0..study.case_count()).map(result).collect();
        let saved = read_study(&study_text(&study, b"", false), name).expect("a study");
        NamedStudy {
            name: name.to_owned(),
            saved,
            results,
            measured: Vec::new(),
        }
    }

    fn forces(joined: &Joined) -> Vec<f64> {
        let force = |result: &CaseResult| {
            result
                .as_ref()
                .expect("it is solved")
                .metrics
                .tool_contact_normal_force_n
        };
        joined.results.iter().map(force).collect()
    }

    #[test]
    fn cases_are_those_of_the_studies_whatever_their_order() {
        let (old, new) = (
            "[study]\npenetration_depth_m = [1e-3, 2e-3]\nrotational_speed_rpm = [600, 900, 1200]\n",
            "[study]\nrotational_speed_rpm = [1200, 600]\npenetration_depth_m = [3e-3, 2e-3, 1e-3]\n\"contact.friction_coefficient\" = [0.1, 0.0]\n",
        );
        let studies = [
            named("old", &format!("{HEAD}{old}"), 0),
            named("new", &format!("{HEAD}{new}"), 100),
        ];
        let joined = join(&studies).expect("they share values");
        let study = &joined.study;
        let paths: Vec<&str> = study.sweeps().iter().map(Sweep::path).collect();
        assert_eq!(
            paths,
            ["tool", "contact.friction_coefficient", DEPTH, SPEED]
        );
        assert_eq!(
            forces(&joined),
            [0.0, 2.0, 3.0, 5.0, 111.0, 110.0, 109.0, 108.0]
        );
        for (case, result) in joined.results.iter().enumerate() {
            let own = &studies[study.tool_of(case)];
            let number = own
                .results
                .iter()
                .position(|other| other == result)
                .expect("a case of the study");
            assert_eq!(study.settings(case), own.saved.study.settings(number));
        }
        assert_eq!(joined.notes[0], "of old, 2 of 3 values of n_w are compared");
        assert_eq!(
            joined.notes[1],
            "of new, 2 of 3 values of a_e and 1 of 2 values of µ are compared"
        );
    }

    #[test]
    fn what_follows_from_a_tool_does_so_in_each_case() {
        let filled = HEAD.replace(
            "filament_count = 10500\nfilament_count_uncertainty = 600",
            "fill_factor = 0.5",
        );
        let sweeps = "[study]\nbrushing_velocity_m_s = [5.0, 10.0]\npenetration_depth_m = [1e-3]\n\"filament.diameter_m\" = [1e-3, 2e-3]\n";
        let studies = [
            named("counted", &format!("{HEAD}{sweeps}"), 0),
            named("filled", &format!("{filled}{sweeps}"), 10),
        ];
        let joined = join(&studies).expect("they share values");
        assert_eq!(
            forces(&joined),
            [0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 12.0, 13.0]
        );
        let count = |case: usize| joined.study.settings(case).tool.filament_count;
        assert_eq!([count(0), count(2)], [10500.0; 2]);
        assert!(
            (count(4) / count(6) - 4.0).abs() < 1e-12,
            "a quarter of the filaments fit"
        );
        let held: Vec<&str> = joined.study.tools()[1]
            .held
            .iter()
            .map(|(held, _)| held.path)
            .collect();
        assert_eq!(held, ["tool.fill_factor"]);
    }

    #[test]
    fn what_is_not_shared_is_refused_with_its_values() {
        let study =
            |name: &str, sweeps: &str| named(name, &format!("{HEAD}[study]\n{sweeps}\n"), 0);
        let depth = "penetration_depth_m = [1e-3]\n";
        let speed = "brushing_velocity_m_s = [10.0]\npenetration_depth_m =";
        for (a, b, told) in [
            (
                format!("{depth}rotational_speed_rpm = [600, 900]"),
                format!("{depth}rotational_speed_rpm = [1200]"),
                "no rotational speed in common: a has 2 values from 600 rpm to 900 rpm, b has 1200 rpm",
            ),
            (
                format!("{speed} [1e-3]"),
                format!("{speed} [2e-3]"),
                "no penetration depth in common: a has 1 mm, b has 2 mm",
            ),
            (
                format!("{depth}rotational_speed_rpm = [600, 900]"),
                format!(
                    "{depth}brushing_velocity_m_s = [10.0, 11.0]\n\"filament.length_m\" = [0.04, 0.05]"
                ),
                "`process.rotational_speed_rpm` of b is another in each case",
            ),
            (
                format!("{depth}rotational_speed_rpm = [600]"),
                format!("{depth}rotational_speed_rpm = [600]\n[brush]"),
                "the filaments of the tool `b` touch each other, those of `a` do not",
            ),
        ] {
            let error = join(&[study("a", &a), study("b", &b)]).expect_err("nothing is shared");
            assert!(error.to_string().contains(told), "{error}");
        }
        let one = study("a", &format!("{depth}rotational_speed_rpm = [600]"));
        let error = join(&[one]).expect_err("one alone");
        let told = "one study alone cannot be compared: name at least two";
        assert_eq!(error.to_string(), told);
    }

    #[test]
    fn measured_forces_belong_to_their_tools() {
        let mut studies = ["a", "b"].map(|name| {
            let text = format!(
                "{HEAD}[study]\nrotational_speed_rpm = [600, 900]\npenetration_depth_m = [1e-3]\n"
            );
            named(name, &text, 0)
        });
        let point = |speed| Measurement {
            speed,
            second_speed_rpm: None,
            penetration_depth_m: 1e-3,
            force_n: 1.0,
            std_n: None,
            tool: None,
        };
        studies[0].measured = vec![point(Speed::Rotational(600.0))];
        studies[1].measured = vec![point(Speed::Velocity(10.0))];
        let measured = join(&studies).expect("they share values").measured;
        assert_eq!(
            measured.iter().map(|point| point.tool).collect::<Vec<_>>(),
            [Some(0), Some(1)]
        );
        let speed = measured[1].speed.value();
        assert!(
            (speed - 10.0 / 0.18 * 60.0 / std::f64::consts::TAU).abs() < 1e-9,
            "{speed}"
        );
        assert!(matches!(measured[1].speed, Speed::Rotational(_)));
    }
}
