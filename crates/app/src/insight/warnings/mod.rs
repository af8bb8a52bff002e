//! Warnings of results that are not what they seem: what `bristle simulate`, `bristle simulate` and
//! `bristle study` say once they are done.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::Statistics;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::layout::Warning;

mod brush;
mod count;
mod limited_work;
mod packing;
mod pressing;
pub(crate) mod stability;
mod touch;
pub(crate) mod turns;

pub use brush::of_brush;
pub(crate) use packing::is_packed;
pub use pressing::of_force;
pub use stability::is_unstable;

/// The warnings about one contact, at the depth in its settings; about the force with which it was
/// found see [`of_force`].
#[must_use]
pub fn of_contact(settings: &Settings, metrics: &Metrics, statistics: &Statistics) -> Vec<Warning> {
    let single = [
        limited_work::of_contact(statistics),
        packing::of_contact(settings),
        touch::of_contact(settings, metrics),
        touch::of_soft_contact(settings, metrics),
        touch::of_free_contact(settings, metrics),
        stability::of_contact(settings, metrics),
    ];
    single
        .into_iter()
        .flatten()
        .chain(turns::of_contact(settings, metrics))
        .collect()
}

/// The warning about filaments that touch each other, where each is simulated alone.
#[must_use]
pub fn without_interaction(settings: &Settings) -> Option<Warning> {
    is_packed(settings)
        .then(|| packing::of_contact(settings))
        .flatten()
}

/// The warnings about the cases of a study.
#[must_use]
pub fn of_study(study: &Study, results: &[CaseResult]) -> Vec<Warning> {
    let single = [
        limited_work::of_study(results),
        packing::of_study(study, results),
        touch::of_study(study, results),
        touch::of_soft_cases(study, results),
        touch::of_free_cases(study, results),
        stability::of_study(study, results),
    ];
    let several = brush::of_study(study, results)
        .into_iter()
        .chain(pressing::of_study(study, results))
        .chain(turns::of_study(study, results));
    single.into_iter().flatten().chain(several).collect()
}
