//! Studies and results of the unit tests.

use bristle::model::metrics::Metrics;
use bristle_study::grid::{CaseResult, CaseSummary, Study};
use bristle_study::input::document::Document;

pub(crate) use crate::testing::brush;

/// Returns the study of an input file.
pub(crate) fn study(text: &str) -> Study {
    Document::parse(text, "case.toml")
        .and_then(|document| document.study())
        .expect("a study")
}

/// Returns a result with these metrics.
pub(crate) fn result(metrics: Metrics) -> CaseResult {
    Ok(CaseSummary {
        metrics,
        ..CaseSummary::default()
    })
}

/// Returns a result with this force of the tool in N and this contact time ratio.
pub(crate) fn with_force(tool_contact_normal_force_n: f64, contact_time_ratio: f64) -> CaseResult {
    result(Metrics {
        tool_contact_normal_force_n,
        contact_time_ratio,
        ..Metrics::default()
    })
}

/// Returns the metrics of a case that did not fail.
pub(crate) fn metrics_of(result: &mut CaseResult) -> &mut Metrics {
    &mut result.as_mut().expect("a result").metrics
}
