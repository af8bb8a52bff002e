//! Simulations and their numbers.

use std::panic::{AssertUnwindSafe, catch_unwind};

use bristle::brush::{BrushError, BrushResult, BrushRun, RunOptions, Shortcuts};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{Job, Kind, Pass, Sampling, simulate_side_by_side};

use crate::pairs::Run;

/// Error that a brush whose filaments do not touch each other may state, in tolerances: above it,
/// users are warned.
const MAX_SPARSE_ERROR: f64 = 3.0;

/// The result of a simulation.
#[derive(Clone, Debug)]
pub struct SimulationOutcome {
    pub metrics: Metrics,
    /// The impulse of each turn in N s.
    pub turns: Vec<f64>,
    /// Energy that joints of a settled filament dissipate, relative to that of its springs.
    pub settled: f64,
    /// The error of its steps that a brush states; above the tolerance, users are warned.
    pub stated_error: f64,
}

/// A result, or the reason for its absence.
pub type Result = std::result::Result<SimulationOutcome, String>;

/// The results of some simulations. Passes are simulated side by side.
pub fn outcomes(runs: &[&Run]) -> Vec<Result> {
    let mut results: Vec<Option<Result>> = runs.iter().map(|run| single(run)).collect();
    let is_pass = |(number, run): (usize, &&Run)| {
        Some(Job {
            number,
            pass: pass(run)?,
        })
    };
    let mut jobs: Vec<Job> = runs.iter().enumerate().filter_map(is_pass).collect();
    let take = |kind: Option<Kind>| {
        let fits = |job: &Job| kind.is_none_or(|kind| job.pass.kind() == kind);
        let position = jobs.iter().rposition(fits)?;
        Some(jobs.swap_remove(position))
    };
    simulate_side_by_side(take, |number, result| {
        let result = result
            .map_err(|error| error.to_string())
            .map(|result| SimulationOutcome {
                metrics: result.metrics,
                turns: result.turn_contact_normal_impulses_n_s,
                settled: 0.0,
                stated_error: 0.0,
            });
        results[number] = Some(result);
    });
    results
        .into_iter()
        .map(|result| result.expect("each run is simulated"))
        .collect()
}

/// The pass of a run that can be simulated side by side with others.
fn pass(run: &Run) -> Option<Pass> {
    match run {
        Run::Alone(settings) => Some(Pass::new(settings)),
        Run::InSpace(settings) => Some(Pass::new(settings).in_space()),
        Run::Brush(_) | Run::Exhaustive(_) | Run::Settled(_) | Run::AtRest => None,
    }
}

/// The result of any other run.
fn single(run: &Run) -> Option<Result> {
    match run {
        Run::Alone(_) | Run::InSpace(_) => None,
        Run::Brush(settings) | Run::Exhaustive(settings) => {
            let is_exhaustive = matches!(run, Run::Exhaustive(_));
            let brush = catch_unwind(AssertUnwindSafe(|| brush(settings, is_exhaustive)));
            Some(match brush {
                Ok(Ok(result)) => {
                    let mut turns = result.turn_contact_normal_impulses_n_s;
                    if turns.is_empty() {
                        turns.push(result.tool.contact_normal_impulse_n_s);
                    }
                    // Where no filament touches another, a brush states its difference from passes,
                    // which would excuse any.
                    let limit = if result.pairs.is_empty() {
                        MAX_SPARSE_ERROR * settings.brush_or_default().tolerance
                    } else {
                        f64::INFINITY
                    };
                    let stated_error = result.impulse_error_estimate.min(limit);
                    Ok(SimulationOutcome {
                        metrics: result.tool,
                        turns,
                        settled: 0.0,
                        stated_error,
                    })
                }
                Ok(Err(error)) => Err(error.to_string()),
                Err(_) => panic!("a brush panics: {run}"),
            })
        }
        Run::Settled(settings) => Some(settled(settings)),
        Run::AtRest => Some(Ok(SimulationOutcome {
            metrics: Metrics::default(),
            turns: Vec::new(),
            settled: 0.0,
            stated_error: 0.0,
        })),
    }
}

/// The result of a brush, without shortcuts if the search `is_exhaustive`.
fn brush(settings: &Settings, is_exhaustive: bool) -> std::result::Result<BrushResult, BrushError> {
    let none = Shortcuts {
        sleep: false,
        leave_out: false,
        clearance: false,
        broad_phase: false,
    };
    let shortcuts = if is_exhaustive { none } else { Shortcuts::ALL };
    let mut run = BrushRun::new(
        settings,
        RunOptions {
            shortcuts,
            ..RunOptions::default()
        },
    )?;
    while run.advance()? {}
    run.finish()
}

/// The energy that joints dissipate in the last fifth of the time before the filament touches,
/// relative to that of its springs.
fn settled(settings: &Settings) -> Result {
    let pass = Pass::new(settings);
    let sampling = Sampling {
        samples: 1000,
        ..Sampling::default()
    };
    let result = pass.simulate(sampling).map_err(|error| error.to_string())?;
    let free: Vec<_> = result
        .history
        .iter()
        .take_while(|sample| sample.contact_normal_impulse_n_s == 0.0)
        .collect();
    let [from, to] = [free.len() * 4 / 5, free.len() - 2];
    let settled = (free[to].dissipated_energy_j - free[from].dissipated_energy_j)
        / free[to].potential_energy_j;
    Ok(SimulationOutcome {
        metrics: Metrics::default(),
        turns: Vec::new(),
        settled,
        stated_error: 0.0,
    })
}
