//! The cases of a study that a warning is about.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::layout::Warning;

/// A number of cases, as in `of 3 cases`.
pub(super) fn cases(count: usize) -> String {
    format!("{count} {}", if count == 1 { "case" } else { "cases" })
}

/// The warning about cases in `rows` of `runs.csv`, of which there are `total`; none without a row.
pub(super) fn of_rows(rows: &[usize], total: usize, statement: &str) -> Option<Warning> {
    let first = rows.first()?;
    Some(Warning::new(format!(
        "in {} of {}, first in row {first} of runs.csv, {statement}",
        rows.len(),
        cases(total)
    )))
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
