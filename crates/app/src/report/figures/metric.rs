//! Metrics as figures show them: families of curves, titles, labels and axes.

use bristle::model::metrics::Metrics;
use bristle::model::record::{self, Column, Curves, Prominence, Record};
use bristle_study::grid::{CaseSummary, Interaction};
use bristle_study::text::capitalised;

use super::slice_view::{Family, span_decades};
use crate::report::drawing::ends;
use crate::report::drawing::scale::Axis;

/// A record whose numbers are drawn over the settings of a study.
pub(super) trait Drawn: Record {
    /// Returns the record of a case, if it has one.
    fn of(summary: &CaseSummary) -> Option<&Self>;
}

impl Drawn for Metrics {
    fn of(summary: &CaseSummary) -> Option<&Self> {
        Some(&summary.metrics)
    }
}

impl Drawn for Interaction {
    fn of(summary: &CaseSummary) -> Option<&Self> {
        summary.brush.as_ref()
    }
}

/// Returns the columns that figures may show: among the metrics those of the paper's figures 4a,
/// 4b, 5, 6a and 6b.
pub(super) fn drawn<R: Drawn>() -> impl Iterator<Item = &'static Column<R>> {
    R::COLUMNS
        .iter()
        .filter(|column| column.display.prominence <= Prominence::Figure)
}

/// Returns the families of curves that go with a map of a metric.
pub(super) fn families<R>(metric: &Column<R>) -> &'static [Family] {
    match metric.display.curves {
        Curves::None => &[],
        Curves::OverVelocity => &[Family::OverX],
        Curves::OverBoth => &[Family::OverX, Family::OverY],
    }
}

/// Returns the name of a metric as a title, with its symbol and unit.
pub(super) fn title<R>(metric: &Column<R>) -> String {
    format!(
        "{} {}",
        capitalised(metric.name),
        with_unit(metric, metric.symbol)
    )
    .trim_end()
    .to_owned()
}

/// Returns symbol and unit of a metric; its name if it has no symbol.
pub(super) fn label<R>(metric: &Column<R>) -> String {
    with_unit(
        metric,
        if metric.symbol.is_empty() {
            metric.name
        } else {
            metric.symbol
        },
    )
}

/// Returns a text with the unit in which figures show the metric.
fn with_unit<R>(metric: &Column<R>, text: &str) -> String {
    let unit = metric.display.unit;
    if unit.is_empty() {
        text.to_owned()
    } else {
        format!("{text} in {unit}")
    }
}

/// Largest value below which a number that can span decades is on a linear axis.
const MAX_LINEAR_VALUE: f64 = 10.0;

/// Returns the axis of a metric with these values.
pub(super) fn axis_of<'a, R>(
    metric: &Column<R>,
    values: impl Iterator<Item = &'a Option<f64>>,
    linear: impl FnOnce(String) -> Axis,
) -> Axis {
    let range = ends(values.flatten().copied());
    let is_linear = match metric.display.scale {
        record::Scale::Linear => true,
        record::Scale::Logarithmic => range[1] < MAX_LINEAR_VALUE,
        record::Scale::Fitting => !span_decades(range),
    };
    if is_linear {
        linear(label(metric))
    } else {
        Axis::logarithmic(label(metric))
    }
}
