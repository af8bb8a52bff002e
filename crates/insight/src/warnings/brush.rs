//! Brushes whose steps are too long.

use bristle::model::settings::Settings;
use bristle_grid::{CaseResult, Interaction, Study};
use bristle_text::layout::Warning;

/// The warning about one brush.
#[must_use]
pub fn of_brush(settings: &Settings, interaction: &Interaction) -> Option<Warning> {
    is_coarse(settings, interaction).then(|| {
        Warning::new(format!(
            "the steps do not resolve p_n to `brush.tolerance` = {:e}: it is expected to be off by {:.1e} (`step_error`). Forces of the brush \
             may be off by as much or more.",
            settings.brush_or_default().tolerance,
            interaction.step_error
        ))
    })
}

/// Whether the steps of a brush miss its tolerance.
fn is_coarse(settings: &Settings, interaction: &Interaction) -> bool {
    interaction.step_error > settings.brush_or_default().tolerance
}

/// The warning about the brushes of a study, if there is something to warn of.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let error = |(case, result): (usize, &CaseResult)| {
        let interaction = result.as_ref().ok()?.brush.as_ref()?;
        is_coarse(&study.settings(case), interaction).then_some((case + 1, interaction.step_error))
    };
    let coarse: Vec<(usize, f64)> = results.iter().enumerate().filter_map(error).collect();
    // Of equal ones the first.
    let (row, error) = coarse.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Warning::new(format!(
        "in {} of {} brushes the steps do not resolve p_n to `brush.tolerance`: it is expected to be off by up to {error:.1e} \
         (`step_error`, row {row} of runs.csv).",
        coarse.len(),
        results.len()
    )))
}
