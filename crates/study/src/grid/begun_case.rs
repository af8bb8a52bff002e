//! A case whose passes are being simulated: the nominal one, a finer one, and sampled tools.

use std::time::Instant;

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::Simulation;

use crate::grid::case::{CaseResult, CaseSummary};
use crate::grid::check::{finer_pass, largest_change};
use crate::grid::uncertainty::Scatter;

/// The role of a pass in its case.
#[derive(Clone, Copy)]
pub(super) enum PassRole {
    Nominal,
    /// Nominal pass at a tenth of the tolerance.
    Finer,
    /// Pass of a sampled tool.
    Tool(usize),
}

/// A case with passes that have been given out.
pub(super) struct BegunCase {
    pub(super) start: Instant,
    settings: Settings,
    /// Runs to begin. The first one is last.
    pub(super) runs: Vec<PassRole>,
    /// Runs without a result yet.
    left: usize,
    nominal: Option<CaseResult>,
    finer: Option<Metrics>,
    scatter: Option<Scatter>,
    /// Impulses of the sampled tools.
    impulses: Vec<Option<f64>>,
}

impl BegunCase {
    pub(super) fn new(settings: Settings, checks: bool) -> Self {
        let scatter = Scatter::of(&settings);
        let tools = scatter.as_ref().map_or(0, Scatter::count);
        let reaches = |tool: &usize| {
            scatter
                .as_ref()
                .is_some_and(|scatter| scatter.settings(*tool).is_some())
        };
        let mut runs: Vec<PassRole> = (0..tools)
            .rev()
            .filter(reaches)
            .map(PassRole::Tool)
            .collect();
        runs.extend(checks.then_some(PassRole::Finer));
        runs.push(PassRole::Nominal);
        // A tool that does not reach the workpiece has no impulse.
        Self {
            start: Instant::now(),
            left: runs.len(),
            nominal: None,
            finer: None,
            impulses: vec![Some(0.0); tools],
            settings,
            runs,
            scatter,
        }
    }

    pub(super) fn settings(&self, run: PassRole) -> Settings {
        let sampled = match (run, &self.scatter) {
            (PassRole::Finer, _) => Some(finer_pass(&self.settings)),
            (PassRole::Tool(tool), Some(scatter)) => scatter.settings(tool),
            _ => None,
        };
        sampled.unwrap_or_else(|| self.settings.clone())
    }

    /// Takes the result of a run. Returns `true` if the case is complete.
    pub(super) fn take(&mut self, run: PassRole, result: &Result<Simulation, String>) -> bool {
        let metrics = result.as_ref().ok().map(|simulation| &simulation.metrics);
        match run {
            PassRole::Nominal => {
                self.nominal =
                    Some(
                        result
                            .as_ref()
                            .map_err(String::clone)
                            .map(|simulation| CaseSummary {
                                metrics: simulation.metrics.clone(),
                                turn_contact_normal_impulses_n_s: simulation
                                    .turn_contact_normal_impulses_n_s
                                    .clone(),
                                statistics: simulation.statistics,
                                ..CaseSummary::default()
                            }),
                    );
            }
            PassRole::Finer => self.finer = metrics.cloned(),
            PassRole::Tool(tool) => {
                self.impulses[tool] = metrics.map(|metrics| metrics.contact_normal_impulse_n_s)
            }
        }
        self.left -= 1;
        if matches!(self.nominal, Some(Err(_))) {
            // A case that failed needs no sampled tools.
            self.runs.clear();
            return true;
        }
        self.left == 0
    }

    pub(super) fn conclude(self) -> CaseResult {
        let mut summary = self
            .nominal
            .expect("the nominal pass is one of those that are done")?;
        summary.scatter = self
            .scatter
            .and_then(|scatter| scatter.reduce(&self.impulses));
        summary.change_when_checked = self
            .finer
            .map(|finer| largest_change(&summary.metrics, &finer));
        Ok(summary)
    }
}
