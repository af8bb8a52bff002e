//! The cases of a study that a warning is about.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle_grid::{CaseResult, Study};

/// A number of cases, as in `of 3 cases`.
pub(super) fn cases(count: usize) -> String {
    format!("{count} {}", if count == 1 { "case" } else { "cases" })
}

/// The rows of `runs.csv` of the cases that did not fail and are like this.
pub(super) fn rows(
    study: &Study,
    results: &[CaseResult],
    is_so: impl Fn(&Settings, &Metrics) -> bool,
) -> Vec<usize> {
    let row = |(case, result): (usize, &CaseResult)| {
        let metrics = &result.as_ref().ok()?.metrics;
        is_so(&study.settings(case), metrics).then_some(case + 1)
    };
    results.iter().enumerate().filter_map(row).collect()
}
