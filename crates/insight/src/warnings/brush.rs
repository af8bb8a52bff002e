//! Brushes whose steps are too long, or whose filaments overlap before they move.

use bristle::model::settings::Settings;
use bristle_grid::brush::Interaction;
use bristle_grid::{CaseResult, Study};
use bristle_text::layout::Warning;

/// The warnings about one brush.
#[must_use]
pub fn of_brush(settings: &Settings, interaction: &Interaction) -> Vec<Warning> {
    let tolerance = settings.brush_or_default().tolerance;
    let Interaction { step_error, overlap_at_start_m: overlap, .. } = *interaction;
    let mut warnings = Vec::new();
    if is_coarse(settings, interaction) {
        warnings.push(Warning::new(format!(
            "the steps are too long: with them, p_n of one filament by itself is off by {step_error:.1e}, more than `brush.tolerance` = \
             {tolerance:e}. Forces of the brush may be off by as much or more."
        )));
    }
    if overlap > 0.0 {
        warnings.push(Warning::new(format!(
            "filaments overlap by up to {:.2} µm before they move, because of their tilts or shapes, and are pushed apart. Filaments \
             farther apart, or smaller tilts (`brush.lateral_tilt_std_rad`), avoid that.",
            1e6 * overlap
        )));
    }
    warnings
}

/// Whether the steps of a brush miss its tolerance.
fn is_coarse(settings: &Settings, interaction: &Interaction) -> bool {
    interaction.step_error > settings.brush_or_default().tolerance
}

/// The warnings about the brushes of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Vec<Warning> {
    let interactions = || {
        let of_case = |(case, result): (usize, &CaseResult)| Some((case, result.as_ref().ok()?.brush.clone()?));
        results.iter().enumerate().filter_map(of_case)
    };
    let largest = |of: &dyn Fn(&Interaction) -> f64, is_one: &dyn Fn(usize, &Interaction) -> bool| {
        let cases: Vec<(usize, f64)> =
            interactions().filter(|(case, each)| is_one(*case, each)).map(|(case, each)| (case, of(&each))).collect();
        // Of equal ones the first.
        let worst = cases.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1)).copied();
        worst.map(|(case, value)| (cases.len(), case + 1, value))
    };
    let coarse = largest(&|each| each.step_error, &|case, each| is_coarse(&study.settings(case), each));
    let overlapping = largest(&|each| each.overlap_at_start_m, &|_, each| each.overlap_at_start_m > 0.0);
    let total = results.len();
    let coarse = coarse.map(|(count, row, error)| {
        Warning::new(format!(
            "in {count} of {total} brushes the steps are too long for `brush.tolerance`: p_n of one filament by itself is off by up to \
             {error:.1e} (row {row} of runs.csv)."
        ))
    });
    let overlapping = overlapping.map(|(count, row, overlap)| {
        Warning::new(format!(
            "in {count} of {total} brushes filaments overlap before they move, by up to {:.2} µm (row {row} of runs.csv), and are pushed \
             apart.",
            1e6 * overlap
        ))
    });
    coarse.into_iter().chain(overlapping).collect()
}
