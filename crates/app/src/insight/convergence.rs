//! Convergence of a result with the precision of its computation: the number of segments,
//! tolerances, and the stiffness between filaments.
//!
//! A [`Plan`] turns settings into the cases to simulate; [`Plan::conclude`] turns their results
//! into a [`Convergence`], with a series per setting.

use std::io::{self, Write};

use crate::store::results::BuildOrigin;
use bristle::model::metrics::Metrics;
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::record::{Column, Record};
use bristle::model::settings::{Settings, UncertaintySettings};
use bristle_study::grid::uncertainty::check;
use bristle_study::grid::{CaseResult, CaseSummary, Setting, Study};
use serde_json::json;
use thiserror::Error;

/// Relative error of `F_n,w` for which values are chosen.
pub const GOAL: f64 = 0.01;

/// Keys of the judged metrics. The first is the force, for which values are chosen.
const JUDGED: [&str; 6] = [
    "tool_contact_normal_force_n",
    "contact_normal_impulse_n_s",
    "peak_contact_normal_force_n",
    "contact_time_ratio",
    "max_tip_deflection_m",
    "contact_time_s",
];

/// Returns the judged metrics. The first is the force `F_n,w`.
pub fn judged() -> impl Iterator<Item = &'static Column<Metrics>> {
    JUDGED.iter().map(|key| {
        let mut columns = Metrics::COLUMNS.iter();
        columns
            .find(|column| column.key == *key)
            .expect("the table has these metrics")
    })
}

/// Returns the force `F_n,w` among the metrics.
pub fn force() -> &'static Column<Metrics> {
    judged().next().expect("the force is the first one")
}

const SEGMENTS: &str = "filament.segments";
const SOLVER_TOLERANCE: &str = "solver.relative_tolerance";
const BRUSH_TOLERANCE: &str = "brush.tolerance";
const BRUSH_STIFFNESS: &str = "brush.stiffness_n_m2";

/// Numbers of segments, at ratios of about √2.
const SEGMENT_NUMBERS: [f64; 13] = [
    5.0, 8.0, 12.0, 17.0, 25.0, 35.0, 50.0, 70.0, 100.0, 140.0, 200.0, 280.0, 400.0,
];
/// Minimum ratio of the finest number of segments to the stated one; the finest error is then a
/// quarter. A filament alone also has a minimum finest number. A brush takes longer: its coarsest
/// number is at least the stated one over this ratio.
const MIN_REFINEMENT: f64 = 2.0;
const MIN_FINEST_SEGMENTS: f64 = 50.0;
/// Loosest relative tolerance, unless the stated one is looser, and ratio of the finest tolerance
/// to the stated one.
const MAX_TOLERANCE: f64 = 1e-3;
const MIN_TOLERANCE_SHARE: f64 = 1e-2;
/// Tolerances of a brush over the stated one. Beyond [`MAX_TOLERANCE`] steps do not grow.
const BRUSH_TOLERANCES: [f64; 5] = [10.0, 3.0, 1.0, 0.3, 0.1];
/// Stiffnesses over the stated one.
const STIFFNESSES: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];
/// Slack in comparisons of decimal numbers.
const ROUNDING: f64 = 1e-9;

/// Reasons why convergence cannot be judged.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConvergenceError {
    /// Invalid settings.
    #[error("{0}")]
    Settings(Violation),
    /// The stated settings cannot be simulated.
    #[error("the case that the file states cannot be simulated: {0}")]
    Stated(String),
    /// The force is zero.
    #[error(
        "the filaments do not touch the workpiece: F_n,w is 0, and there is nothing to compare"
    )]
    NoContact,
}

/// The cases to simulate.
pub struct Plan {
    /// The first case has the stated settings.
    cases: Vec<Settings>,
    /// Settings with their values from coarse to fine, and the case of each value.
    series: Vec<(&'static Parameter, Vec<(f64, usize)>)>,
}

impl Plan {
    /// Creates the cases in which one setting after the other differs from `settings`, which state
    /// a depth. Tools are not sampled; only filaments within a brush vary.
    ///
    /// # Errors
    /// If the settings are wrong.
    pub fn new(settings: &Settings) -> Result<Self, ConvergenceError> {
        let mut stated = settings.clone();
        if stated.brush.is_none() {
            stated.uncertainty = UncertaintySettings::default();
        }
        check(&stated).map_err(ConvergenceError::Settings)?;
        let paths: &[&str] = match stated.brush {
            Some(_) => &[SEGMENTS, BRUSH_TOLERANCE, BRUSH_STIFFNESS],
            None => &[SEGMENTS, SOLVER_TOLERANCE],
        };
        let mut plan = Self {
            cases: vec![stated],
            series: Vec::new(),
        };
        for path in paths {
            let parameter = Parameter::find(path).expect("the table has these settings");
            let values = values(parameter, &plan.cases[0]);
            let cases = values
                .into_iter()
                .filter_map(|value| Some((value, plan.case(parameter, value)?)))
                .collect();
            plan.series.push((parameter, cases));
        }
        Ok(plan)
    }

    /// Returns the number of the case with a value; none if the settings cannot have it.
    fn case(&mut self, parameter: &Parameter, value: f64) -> Option<usize> {
        let stated = &self.cases[0];
        if parameter.get(stated) == value {
            return Some(0);
        }
        let mut settings = stated.clone();
        parameter.set(&mut settings, value);
        check(&settings).ok()?;
        self.cases.push(settings);
        Some(self.cases.len() - 1)
    }

    /// Returns the cases, for simulation in any order.
    #[must_use]
    pub fn study(&self) -> Study {
        Study::of_cases(self.cases.clone())
    }

    /// Judges the convergence from the results of all cases.
    ///
    /// # Errors
    /// If the stated settings have no force.
    ///
    /// # Panics
    /// If the number of results is not the number of cases.
    pub fn conclude(self, results: &[CaseResult]) -> Result<Convergence, ConvergenceError> {
        assert_eq!(results.len(), self.cases.len(), "a result for each case");
        match &results[0] {
            Err(error) => return Err(ConvergenceError::Stated(error.clone())),
            Ok(stated) if stated.metrics.tool_contact_normal_force_n == 0.0 => {
                return Err(ConvergenceError::NoContact);
            }
            Ok(_) => {}
        }
        let stated = &self.cases[0];
        let series = self.series.into_iter().map(|(parameter, cases)| Series {
            parameter,
            stated: parameter.get(stated),
            values: cases.iter().map(|(value, _)| *value).collect(),
            results: cases
                .iter()
                .map(|(_, case)| results[*case].clone())
                .collect(),
        });
        Ok(Convergence {
            settings: stated.clone(),
            series: series.collect(),
        })
    }
}

/// Simulates the cases for the stated settings by `simulate`, and returns their convergence. With a
/// force (N) in place of a depth, first finds the depth that reaches it. All cases have this depth;
/// `at_depth` receives the force, and the settings at this depth.
///
/// # Errors
/// Errors of `simulate`, and `refused` if convergence cannot be judged.
pub fn converge<E>(
    stated: Settings,
    mut simulate: impl FnMut(Study) -> Result<Vec<CaseResult>, E>,
    at_depth: impl FnOnce(f64, &Settings),
    refused: impl Fn(ConvergenceError) -> E,
) -> Result<Convergence, E> {
    let mut settings = stated;
    if let Some(force) = settings.process.tool_force_n {
        let study = Study::of_cases(vec![settings]);
        let results = simulate(study.clone())?;
        if let Err(error) = &results[0] {
            return Err(refused(ConvergenceError::Stated(error.clone())));
        }
        settings = study.settings_found(0, &results[0]);
        at_depth(force, &settings);
    }
    let plan = Plan::new(&settings).map_err(&refused)?;
    let results = simulate(plan.study())?;
    plan.conclude(&results).map_err(refused)
}

/// Returns the compared values of a setting, from coarse to fine.
fn values(parameter: &Parameter, settings: &Settings) -> Vec<f64> {
    let stated = parameter.get(settings);
    let mut values: Vec<f64> = match parameter.path {
        SEGMENTS => {
            let is_brush = settings.brush.is_some();
            let finest = if is_brush {
                MIN_REFINEMENT * stated
            } else {
                MIN_FINEST_SEGMENTS.max(MIN_REFINEMENT * stated)
            };
            let end = SEGMENT_NUMBERS
                .iter()
                .position(|&number| number >= finest)
                .unwrap_or(SEGMENT_NUMBERS.len() - 1);
            let coarsest = if is_brush {
                stated / MIN_REFINEMENT
            } else {
                0.0
            };
            SEGMENT_NUMBERS[..=end]
                .iter()
                .copied()
                .filter(|&number| number >= coarsest)
                .collect()
        }
        SOLVER_TOLERANCE => {
            let (loosest, finest) = (
                MAX_TOLERANCE.max(stated),
                MIN_TOLERANCE_SHARE * stated * (1.0 - ROUNDING),
            );
            let powers = (2..=10).map(|power| format!("1e-{power}").parse().expect("a number"));
            powers
                .filter(|tolerance| (finest..=loosest).contains(tolerance))
                .collect()
        }
        BRUSH_TOLERANCE => {
            let loosest = MAX_TOLERANCE.max(stated) * (1.0 + ROUNDING);
            times(stated, BRUSH_TOLERANCES)
                .filter(|&tolerance| tolerance <= loosest)
                .collect()
        }
        _ => times(stated, STIFFNESSES).collect(),
    };
    values.push(stated);
    values.sort_by(f64::total_cmp);
    values.dedup();
    if is_finer_below(parameter) {
        values.reverse();
    }
    values
}

/// Returns a value times some factors, without digits from rounding.
fn times(value: f64, factors: [f64; 5]) -> impl Iterator<Item = f64> {
    factors.into_iter().map(move |factor| {
        if factor == 1.0 {
            value
        } else {
            rounded(factor * value)
        }
    })
}

fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().expect("a number")
}

/// Returns `true` if smaller values are more precise.
fn is_finer_below(parameter: &Parameter) -> bool {
    [SOLVER_TOLERANCE, BRUSH_TOLERANCE].contains(&parameter.path)
}

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

/// Convergence of the results with all varied settings.
pub struct Convergence {
    /// The stated settings, at their depth.
    pub settings: Settings,
    /// One series per setting.
    pub series: Vec<Series>,
}

impl Convergence {
    /// Returns the largest relative error that each setting may have for [`GOAL`].
    #[must_use]
    pub fn goal_of_each(&self) -> f64 {
        GOAL / self.series.len() as f64
    }

    /// Returns for each setting the coarsest value that reaches [`GOAL`] together with the others.
    pub fn choices(&self) -> impl Iterator<Item = Option<f64>> {
        self.series
            .iter()
            .map(|series| series.enough(self.goal_of_each()))
    }

    /// Returns the sum of the relative errors of a metric at all stated values; none if one is
    /// unknown.
    #[must_use]
    pub fn stated_error(&self, metric: &Column<Metrics>) -> Option<f64> {
        let errors = self.series.iter().map(|series| series.stated_error(metric));
        errors.sum()
    }

    /// Returns the text of `converge.json`: version, settings, and for each setting its values with
    /// the metrics, their limits and the errors as stated.
    #[must_use]
    pub fn json(&self) -> String {
        let of_metric = |series: &Series, metric: &Column<Metrics>| {
            let Limit { value, order } = series.limit(metric);
            let values = (0..series.values.len()).map(|index| series.value(metric, index));
            let numbers = json!({
                "values": values.collect::<Vec<_>>(),
                "limit": value,
                "order": order,
                "error": series.stated_error(metric),
            });
            (metric.key.to_owned(), numbers)
        };
        let of_series = |series: &Series| {
            let of_each = |of: fn(&CaseSummary) -> usize| -> Vec<Option<usize>> {
                let all = 0..series.values.len();
                all.map(|index| series.summary(index).map(of)).collect()
            };
            let metrics: serde_json::Map<_, _> =
                judged().map(|metric| of_metric(series, metric)).collect();
            json!({
                "setting": series.parameter.path,
                "stated": series.stated,
                "values": series.values,
                "steps": of_each(|summary| summary.statistics.steps),
                "contact_nodes": of_each(|summary| summary.metrics.contact_nodes),
                "metrics": metrics,
            })
        };
        let BuildOrigin { version, equations } = BuildOrigin::here();
        let whole = json!({
            "version": version,
            "equations": equations,
            "settings": self.settings,
            "series": self.series.iter().map(of_series).collect::<Vec<_>>(),
        });
        format!("{whole:#}\n")
    }
}

/// Writes `converge.csv`: a heading, then one row per value of each setting.
///
/// # Errors
/// If `out` cannot be written to.
pub fn write_convergence(out: impl Write, convergence: &Convergence) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    let metrics: Vec<&Column<Metrics>> = judged().collect();
    let keys = metrics.iter().map(|metric| metric.key);
    let others = ["contact_nodes", "change", "steps", "status"];
    let heading = ["setting", "value"].into_iter().chain(keys).chain(others);
    writer.write_record(heading)?;
    for series in &convergence.series {
        for (index, (value, result)) in series.values.iter().zip(&series.results).enumerate() {
            let mut cells = vec![series.parameter.path.to_owned(), value.to_string()];
            match result {
                Ok(summary) => {
                    let numbers = metrics.iter().map(|metric| metric.get(&summary.metrics));
                    cells.extend(numbers.map(|number| number.to_string()));
                    cells.extend([
                        summary.metrics.contact_nodes.to_string(),
                        series.change(index).unwrap_or(0.0).to_string(),
                        summary.statistics.steps.to_string(),
                        "ok".to_owned(),
                    ]);
                }
                Err(message) => {
                    cells.extend(vec![String::new(); metrics.len() + others.len() - 1]);
                    cells.push(message.clone());
                }
            }
            writer.write_record(cells)?;
        }
    }
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{metrics_of, with_force};

    /// Returns a series whose force is a function of the value.
    fn series(path: &str, stated: f64, force: impl Fn(f64) -> f64) -> Series {
        let parameter = Parameter::find(path).expect(path);
        let mut settings = Settings::paper(10.0, 1e-3);
        parameter.set(&mut settings, stated);
        let values = values(parameter, &settings);
        let results = values
            .iter()
            .map(|&value| with_force(force(value), 0.0))
            .collect();
        Series {
            parameter,
            stated,
            values,
            results,
        }
    }

    #[test]
    fn values_go_beyond_the_stated_one() {
        let of = |path: &str, stated: f64| series(path, stated, |_| 1.0).values;
        assert_eq!(of(SEGMENTS, 25.0), [5.0, 8.0, 12.0, 17.0, 25.0, 35.0, 50.0]);
        assert_eq!(of(SEGMENTS, 30.0)[4..], [25.0, 30.0, 35.0, 50.0, 70.0]);
        assert_eq!(of(SEGMENTS, 400.0)[12..], [400.0]);
        assert_eq!(
            of(SOLVER_TOLERANCE, 1e-6),
            [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]
        );
        assert_eq!(of(SOLVER_TOLERANCE, 1e-2), [1e-2, 1e-3, 1e-4]);
        assert_eq!(of(SOLVER_TOLERANCE, 1e-10).last(), Some(&1e-10));
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.filament.segments = 12;
        settings.brush = Some(settings.brush_or_default());
        let of = |path: &str| values(Parameter::find(path).expect(path), &settings);
        assert_eq!(of(SEGMENTS), [8.0, 12.0, 17.0, 25.0]);
        assert_eq!(of(BRUSH_TOLERANCE), [3e-3, 9e-4, 3e-4]);
        assert_eq!(of(BRUSH_STIFFNESS), [6e6, 1.8e7, 6e7, 1.8e8, 6e8]);
    }

    #[test]
    fn an_order_is_stated_where_the_finest_values_agree_on_it() {
        let regular = series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 3.0 / (n * n)));
        let near = |found: Option<f64>, expected: f64, tolerance: f64| {
            assert!(
                found.is_some_and(|found| (found - expected).abs() < tolerance),
                "{found:?}"
            );
        };
        let limit = regular.limit(force());
        near(limit.order, 2.0, 1e-6);
        near(Some(limit.value), 100.0, 1e-6);
        near(regular.stated_error(force()), 3.0 / 625.0, 1e-8);
        // 3/17² is just above one per cent, 3/25² half of it.
        assert_eq!(
            [0.01, 0.001, 0.02].map(|goal| regular.enough(goal)),
            [Some(25.0), None, Some(17.0)]
        );
        assert_eq!(
            series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 1.0 / (n * n))).enough(0.0005),
            Some(50.0)
        );
        // Oscillation or noise has no order: the finest value is the reference, and its own error
        // is unknown.
        for irregular in [
            series(SEGMENTS, 25.0, |n| {
                100.0 + if n % 2.0 == 0.0 { 1.0 } else { 0.0 }
            }),
            series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 1e-5 / (n * n))),
            series(SOLVER_TOLERANCE, 1e-6, |tolerance| {
                100.0 * (1.0 + tolerance)
            }),
        ] {
            let finest = irregular.finest();
            assert_eq!(
                (
                    irregular.limit(force()).order,
                    irregular.error(force(), finest)
                ),
                (None, None)
            );
        }
        let by_tolerance = series(SOLVER_TOLERANCE, 1e-6, |tolerance| {
            100.0 * (1.0 + 30.0 * tolerance)
        });
        assert_eq!(
            [0.01, 1e-5].map(|goal| by_tolerance.enough(goal)),
            [Some(1e-4), Some(1e-7)]
        );
    }

    #[test]
    fn nothing_is_extrapolated_while_the_number_of_nodes_in_contact_changes() {
        let mut series = series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 3.0 / (n * n)));
        let last = series.values.len() - 1;
        metrics_of(&mut series.results[last]).contact_nodes = 2;
        assert_eq!(series.changing_nodes(), Some(vec![0, 0, 0, 2]));
        assert_eq!(series.limit(force()).order, None);
    }

    #[test]
    fn values_that_fail_are_left_out() {
        let mut series = series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 3.0 / (n * n)));
        let last = series.values.len() - 1;
        (series.results[0], series.results[last]) =
            (Err("failed".to_owned()), Err("failed, too".to_owned()));
        assert_eq!(
            (
                series.finest(),
                series.change(last),
                series.change(last - 1)
            ),
            (last - 1, None, Some(0.0))
        );
        assert!(
            series
                .limit(force())
                .order
                .is_some_and(|order| (order - 2.0).abs() < 1e-6)
        );
        let mut text = Vec::new();
        write_convergence(
            &mut text,
            &Convergence {
                settings: Settings::paper(10.0, 1e-3),
                series: vec![series],
            },
        )
        .expect("a table");
        let text = String::from_utf8(text).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "filament.segments,5,,,,,,,,,,failed");
        assert!(
            lines[6].starts_with("filament.segments,35,100.2") && lines[6].ends_with(",0,0,ok"),
            "{text}"
        );
        assert_eq!(lines[7], "filament.segments,50,,,,,,,,,,\"failed, too\"");
    }

    #[test]
    fn each_case_differs_in_one_setting() {
        let settings = Settings::paper(10.0, 1e-3);
        let plan = Plan::new(&settings).expect("a plan");
        assert_eq!(plan.study().case_count(), 1 + 6 + 5);
        let fails = plan.conclude(&vec![Err("no".to_owned()); 12]).err();
        assert_eq!(fails, Some(ConvergenceError::Stated("no".to_owned())));
        let none = Plan::new(&settings)
            .expect("a plan")
            .conclude(&vec![with_force(0.0, 0.0); 12])
            .err();
        assert_eq!(none, Some(ConvergenceError::NoContact));
    }
}
