//! Laterally unstable cases: how many there are, and how to see what an imperfect filament does in
//! them.

use bristle::model::metrics::{Metrics, UNSTABLE_AMPLIFICATION};
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;

use super::count::cases;
use bristle_study::grid::{CaseResult, DEPTH, FORCE, Study, VELOCITY, equation};
use bristle_study::text::layout::Warning;
use bristle_study::text::number::spanning;

/// The setting that makes a filament imperfect.
const TILT: &str = "filament.lateral_tilt_rad";

/// Whether a case is laterally unstable. One that failed is not known to be.
pub fn is_unstable(result: &CaseResult) -> bool {
    result
        .as_ref()
        .is_ok_and(|summary| summary.metrics.laterally_unstable)
}

/// The warning about the laterally unstable cases of a study, if there are any.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let amplification = |case: &usize| {
        results[*case]
            .as_ref()
            .map_or(0.0, |summary| summary.metrics.lateral_amplification)
    };
    let unstable: Vec<usize> = (0..results.len())
        .filter(|&case| is_unstable(&results[case]))
        .collect();
    // Of equal ones the first.
    let worst = unstable
        .iter()
        .copied()
        .rev()
        .max_by(|a, b| amplification(a).total_cmp(&amplification(b)))?;
    let settings = study.settings(worst);
    let are = if unstable.len() == 1 { "is" } else { "are" };
    let warning = Warning::new(format!(
        "{} of {} {are} laterally unstable (amplification above {UNSTABLE_AMPLIFICATION}): a small \
         imperfection of the filament can change the force. The largest amplification is {} at {} (row {} of runs.csv).",
        unstable.len(),
        cases(results.len()),
        spanning(amplification(&worst)),
        place_in(study, worst),
        worst + 1
    ));
    // A study that sweeps the tilt shows it already.
    if study.sweep(TILT).is_none() {
        let line = format!("\"{TILT}\" = [0.0, 1e-4, 1e-3, 1e-2]");
        let how = "compare tilts of the clamp, by this line under [study]:";
        return Some(with_help(warning, &settings, how, line));
    }
    Some(warning)
}

/// The warning about one contact that is laterally unstable.
pub(super) fn of_contact(settings: &Settings, metrics: &Metrics) -> Option<Warning> {
    if !metrics.laterally_unstable {
        return None;
    }
    let warning = Warning::new(format!(
        "this contact is laterally unstable (amplification {}, above {UNSTABLE_AMPLIFICATION}): a small imperfection \
         of the filament can change the force.",
        spanning(metrics.lateral_amplification)
    ));
    let key = TILT.split_once('.').map_or(TILT, |(_, key)| key);
    let line = format!("{key} = 1e-3");
    let how = "simulate it with a tilted clamp, by this line under [filament]:";
    Some(with_help(warning, settings, how, line))
}

/// The warning with how to see what an imperfect filament does. If the clamp is tilted already,
/// other tilts tell more.
fn with_help(warning: Warning, settings: &Settings, how: &str, line: String) -> Warning {
    let is_tilted = settings.filament.lateral_tilt_rad != 0.0;
    let aim = if is_tilted {
        "to see how the tilt matters"
    } else {
        "to see what an imperfect filament does"
    };
    warning.with_help(format!("{aim}, {how}"), line)
}

/// Tool, velocity and depth of a case of a study, counted from 0.
pub(crate) fn place_in(study: &Study, case: usize) -> String {
    let tool = study
        .tool(case)
        .map(|tool| format!("tool {}, ", tool.name))
        .unwrap_or_default();
    tool + &place(&study.settings(case))
}

/// Velocity and depth of a case, or the force in place of the depth.
pub(crate) fn place(settings: &Settings) -> String {
    let shown =
        |path| Parameter::find(path).map(|parameter| equation(parameter, parameter.get(settings)));
    [
        VELOCITY,
        if settings.process.tool_force_n.is_some() {
            FORCE
        } else {
            DEPTH
        },
    ]
    .into_iter()
    .filter_map(shown)
    .collect::<Vec<_>>()
    .join(", ")
}
