//! Results for several values of one setting, and the limits of their metrics.

use bristle::model::metrics::Metrics;
use bristle::model::parameters::Parameter;
use bristle::model::record::Column;
use bristle_study::grid::{CaseResult, CaseSummary, Setting};

use super::force;
use super::plan::SEGMENTS;

/// Results for several values of one setting, with all others as stated.
pub struct Series {
    /// The varied setting.
    pub parameter: &'static Parameter,
    /// Its value in the file.
    pub stated: f64,
    /// Its values, from coarse to fine.
    pub values: Vec<f64>,
    /// Result of each value.
    pub results: Vec<CaseResult>,
}

/// Limit of a metric as the values of a setting become finer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Limit in the metric's unit.
    pub value: f64,
    /// Power of the length of a segment with which the error falls, if the metric is extrapolated.
    /// None if the limit is the metric of the finest value.
    pub order: Option<f64>,
}

impl Series {
    /// Returns the setting for display.
    #[must_use]
    pub fn setting(&self) -> Setting {
        Setting::Number(self.parameter)
    }

    /// Returns the result of the value at a position; none if the simulation failed.
    #[must_use]
    pub fn summary(&self, index: usize) -> Option<&CaseSummary> {
        self.results[index].as_ref().ok()
    }

    /// Returns the metric of the value at a position; none if the simulation failed.
    #[must_use]
    pub fn value(&self, metric: &Column<Metrics>, index: usize) -> Option<f64> {
        self.summary(index)
            .map(|summary| metric.get(&summary.metrics))
    }

    /// Returns the position of the finest value with a result.
    #[must_use]
    pub fn finest(&self) -> usize {
        (0..self.values.len())
            .rev()
            .find(|&index| self.results[index].is_ok())
            .expect("the stated value has a result")
    }

    /// Returns the position of the stated value.
    #[must_use]
    pub fn stated(&self) -> usize {
        let mut values = self.values.iter();
        values
            .position(|value| *value == self.stated)
            .expect("the stated value is among them")
    }

    /// Returns the relative change of the force at a position against that of the finest value;
    /// none if the simulation failed.
    #[must_use]
    pub fn change(&self, index: usize) -> Option<f64> {
        let finest = self.value(force(), self.finest())?;
        Some((self.value(force(), index)? - finest) / finest)
    }

    /// Returns the numbers of contacting outer nodes, if they differ among the finest four numbers
    /// of segments. The contact itself then changes, and no limit is extrapolated.
    #[must_use]
    pub fn changing_nodes(&self) -> Option<Vec<usize>> {
        let finest = self.finest();
        let known = (0..=finest).filter_map(|index| self.summary(index));
        let nodes: Vec<usize> = known.map(|summary| summary.metrics.contact_nodes).collect();
        let last = nodes[nodes.len().saturating_sub(4)..].to_vec();
        let changes = last.iter().any(|count| *count != last[0]);
        (self.parameter.path == SEGMENTS && changes).then_some(last)
    }

    /// Returns the limit of a metric.
    ///
    /// The limit is extrapolated (Richardson) over the number of segments alone, where the error is
    /// known to fall with a power of their length. The finest four results must agree on this power
    /// and on the number of contacting nodes.
    #[must_use]
    pub fn limit(&self, metric: &Column<Metrics>) -> Limit {
        /// Maximum difference between powers, and minimum relative change that exceeds the effect
        /// of the tolerance.
        const MAX_ORDER_DIFFERENCE: f64 = 0.25;
        const MIN_RELATIVE_CHANGE: f64 = 1e-5;
        let finest = self.finest();
        let value = self.value(metric, finest).expect("it has a result");
        let unknown = Limit { value, order: None };
        let known: Vec<(f64, f64)> = (0..=finest)
            .filter_map(|index| Some((1.0 / self.values[index], self.value(metric, index)?)))
            .collect();
        if self.parameter.path != SEGMENTS || known.len() < 4 || self.changing_nodes().is_some() {
            return unknown;
        }
        let last = &known[known.len() - 4..];
        let changes = last.windows(2).map(|pair| pair[1].1 - pair[0].1);
        if changes
            .clone()
            .any(|change| change.abs() < MIN_RELATIVE_CHANGE * value.abs())
        {
            return unknown;
        }
        let (Some(before), Some(order)) = (order(&last[..3]), order(&last[1..])) else {
            return unknown;
        };
        if (before - order).abs() > MAX_ORDER_DIFFERENCE {
            return unknown;
        }
        let [(coarse, at_coarse), (fine, at_fine)] = [last[2], last[3]];
        let share = fine.powf(order) / (coarse.powf(order) - fine.powf(order));
        Limit {
            value: at_fine + share * (at_fine - at_coarse),
            order: Some(order),
        }
    }

    /// Returns the relative error of a metric at a position against [`Series::limit`]. None if the
    /// simulation failed, or for the finest value if the limit is not extrapolated.
    #[must_use]
    pub fn error(&self, metric: &Column<Metrics>, index: usize) -> Option<f64> {
        let limit = self.limit(metric);
        if limit.order.is_none() && index >= self.finest() {
            return None;
        }
        let value = self.value(metric, index)?;
        Some(if value == limit.value {
            0.0
        } else {
            (value / limit.value - 1.0).abs()
        })
    }

    /// Returns the relative error of a metric at the stated value.
    #[must_use]
    pub fn stated_error(&self, metric: &Column<Metrics>) -> Option<f64> {
        self.error(metric, self.stated())
    }

    /// Returns the coarsest value from which on all relative errors of the force are at most
    /// `goal`.
    #[must_use]
    pub fn enough(&self, goal: f64) -> Option<f64> {
        let known = (0..=self.finest())
            .rev()
            .skip_while(|&index| self.error(force(), index).is_none());
        let good = known.take_while(|&index| {
            self.error(force(), index)
                .is_some_and(|error| error <= goal)
        });
        good.last().map(|index| self.values[index])
    }
}

/// Returns the power `p` with which differences between values at three lengths fall:
/// `(f_1 − f_2)/(f_2 − f_3) = (x_1^p − x_2^p)/(x_2^p − x_3^p)`. Points are `(length, value)`, from
/// coarse to fine. None if there is no power between ½ and 4.
fn order(points: &[(f64, f64)]) -> Option<f64> {
    const ORDER_RANGE: [f64; 2] = [0.5, 4.0];
    let &[(x1, f1), (x2, f2), (x3, f3)] = points else {
        return None;
    };
    let ratio = (f1 - f2) / (f2 - f3);
    let excess = |p: f64| (x1.powf(p) - x2.powf(p)) / (x2.powf(p) - x3.powf(p)) - ratio;
    let [mut low, mut high] = ORDER_RANGE;
    // The ratio of the differences between powers grows with the power.
    if !(excess(low) < 0.0 && excess(high) > 0.0) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    Some(low)
}
