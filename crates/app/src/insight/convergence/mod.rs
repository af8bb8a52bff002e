//! Convergence of a result with the precision of its computation: the number of segments,
//! tolerances, and the stiffness between filaments.
//!
//! A [`Plan`] turns settings into the cases to simulate; [`Plan::conclude`] turns their results
//! into a [`Convergence`], with a series per setting.

mod plan;
mod series;
#[cfg(test)]
mod tests;

use std::io::{self, Write};

use crate::store::results::BuildOrigin;
use bristle::model::metrics::Metrics;
use bristle::model::parameters::Violation;
use bristle::model::record::{Column, Record};
use bristle::model::settings::Settings;
use bristle_study::grid::{CaseResult, CaseSummary, Study};
use serde_json::json;
use thiserror::Error;

pub use plan::Plan;
pub use series::{Limit, Series};

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
