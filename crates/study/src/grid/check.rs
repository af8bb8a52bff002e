//! Change of a result that is computed more precisely: a pass at a tenth of its tolerance, a brush
//! at a quarter.
//!
//! The numerical error of a metric is not known, but is mostly much smaller than this change.

use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Prominence, Record};
use bristle::model::settings::Settings;
use serde::Serialize;

/// Shares of their tolerances at which a pass and a brush are repeated.
const PASS_TOLERANCE_SHARE: f64 = 0.1;
const BRUSH_TOLERANCE_SHARE: f64 = 0.25;

/// Shares of the tolerances, in words.
pub const FINER_PASS: &str = "tenth of the tolerance";
/// See [`FINER_PASS`].
pub const FINER_BRUSH: &str = "quarter of the tolerance";

/// Values of a metric as computed first and more precisely.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Value as computed first.
    pub value: f64,
    /// Value as computed more precisely.
    pub checked: f64,
    /// Difference over the larger magnitude; zero if there is none.
    pub relative_change: f64,
}

impl Change {
    /// Returns the change of a metric.
    #[must_use]
    pub fn of(column: &Column<Metrics>, metrics: &Metrics, checked: &Metrics) -> Self {
        let [value, checked] = [metrics, checked].map(|metrics| column.get(metrics));
        let larger = value.abs().max(checked.abs());
        let relative_change = if value == checked {
            0.0
        } else {
            (checked - value).abs() / larger
        };
        Self {
            value,
            checked,
            relative_change,
        }
    }
}

/// Returns the largest relative change of the metrics that tables show.
#[must_use]
pub fn largest_change(metrics: &Metrics, checked: &Metrics) -> f64 {
    let shown = Metrics::COLUMNS
        .iter()
        .filter(|column| column.display.prominence == Prominence::Headline);
    shown
        .map(|column| Change::of(column, metrics, checked).relative_change)
        .fold(0.0, f64::max)
}

/// Returns the settings with which a pass is repeated.
#[must_use]
pub fn finer_pass(settings: &Settings) -> Settings {
    let mut finer = settings.clone();
    finer.solver.relative_tolerance *= PASS_TOLERANCE_SHARE;
    finer
}

/// Returns the settings with which a brush is repeated.
#[must_use]
pub fn finer_brush(settings: &Settings) -> Settings {
    let mut brush = settings.brush_or_default();
    brush.tolerance *= BRUSH_TOLERANCE_SHARE;
    Settings {
        brush: Some(brush),
        ..settings.clone()
    }
}

/// Returns the text of `check.json`: the changes of all metrics, and a description of the
/// repetition (`again`).
#[must_use]
pub fn check_text(again: &str, metrics: &Metrics, checked: &Metrics) -> String {
    let change = |column: &Column<Metrics>| {
        let change =
            serde_json::to_value(Change::of(column, metrics, checked)).expect("metrics are finite");
        (column.key.to_owned(), change)
    };
    let changes: serde_json::Map<_, _> = Metrics::COLUMNS.iter().map(change).collect();
    format!(
        "{:#}\n",
        serde_json::json!({ "repeated": again, "metrics": changes })
    )
}
