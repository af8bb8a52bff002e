//! Brushes whose mean impulse is not known to their tolerance.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle_study::grid::{CaseResult, Interaction, Study};
use bristle_study::text::layout::Warning;

use super::touch;

/// Error estimate of the impulse and residual of the energy that are worth a warning, in tolerances.
/// The steps of a brush are chosen such that its estimate is below the former.
const ERROR_TOLERANCES: f64 = 3.0;
const ENERGY_TOLERANCES: f64 = 10.0;

/// Returns the warnings about one brush.
#[must_use]
pub fn of_brush(settings: &Settings, metrics: &Metrics, interaction: &Interaction) -> Vec<Warning> {
    let is_uncertain = is_uncertain(settings, interaction).then(|| {
        Warning::new(format!(
            "p_n of the brush is known to ± {:.1} % only (`impulse_error_estimate`): more \
             `brush.columns` help where filaments differ, a smaller `brush.tolerance` elsewhere.",
            100.0 * interaction.impulse_error_estimate
        ))
    });
    let is_unbalanced = is_unbalanced(settings, interaction).then(|| {
        Warning::new(format!(
            "the energy of the brush balances to {:.1e} only (`energy_residual`): impacts are not \
             resolved. Choose a smaller `brush.tolerance`.",
            interaction.energy_residual
        ))
    });
    let is_soft = touch::of_soft_contact(settings, metrics);
    [is_uncertain, is_unbalanced, is_soft]
        .into_iter()
        .flatten()
        .collect()
}

/// Whether the error estimate of a brush is larger than its steps allow.
fn is_uncertain(settings: &Settings, interaction: &Interaction) -> bool {
    interaction.impulse_error_estimate > ERROR_TOLERANCES * settings.brush_or_default().tolerance
}

/// Whether the energy of a brush does not balance.
fn is_unbalanced(settings: &Settings, interaction: &Interaction) -> bool {
    interaction.energy_residual > ENERGY_TOLERANCES * settings.brush_or_default().tolerance
}

/// Returns the warnings about the brushes of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Vec<Warning> {
    let brushes: Vec<(usize, &Interaction)> = results
        .iter()
        .enumerate()
        .filter_map(|(case, result)| Some((case, result.as_ref().ok()?.brush.as_ref()?)))
        .collect();
    // The row of the largest of equal values is the first one.
    let worst = |is_bad: fn(&Settings, &Interaction) -> bool, of: fn(&Interaction) -> f64| {
        let bad: Vec<(usize, f64)> = brushes
            .iter()
            .filter(|(case, brush)| is_bad(&study.settings(*case), brush))
            .map(|(case, brush)| (case + 1, of(brush)))
            .collect();
        let (row, value) = bad.iter().rev().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((bad.len(), *row, *value))
    };
    let of_error = worst(is_uncertain, |brush| brush.impulse_error_estimate);
    let of_energy = worst(is_unbalanced, |brush| brush.energy_residual);
    let count = results.len();
    let uncertain = of_error.map(|(bad, row, error)| {
        format!(
            "p_n of {bad} of {count} brushes is known to ± {:.1} % only (`impulse_error_estimate`, row {row} of \
             runs.csv): more `brush.columns` help where filaments differ, a smaller `brush.tolerance` elsewhere.",
            100.0 * error
        )
    });
    let unbalanced = of_energy.map(|(bad, row, residual)| {
        format!(
            "the energy of {bad} of {count} brushes balances to {residual:.1e} only (`energy_residual`, row {row} of \
             runs.csv): impacts are not resolved. Choose a smaller `brush.tolerance`."
        )
    });
    uncertain
        .into_iter()
        .chain(unbalanced)
        .map(Warning::new)
        .collect()
}
