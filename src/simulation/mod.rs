//! One filament's pass over the workpiece: integration through located contact events.
//!
//! [`simulate`] computes metrics from settings. It integrates a [`Pass`]: [`Pass::new`] takes the
//! tool and the workpiece from the settings, [`Pass::with`] takes any [`Tool`](crate::tool::Tool)
//! and any [`Workpiece`](crate::workpiece::Workpiece). [`simulate_side_by_side`] simulates many
//! passes of settings in the lanes of the machine's vector units, [`sample_any_side_by_side`]
//! passes of any tool and workpiece.

use crate::model::metrics::Metrics;
use crate::model::settings::Settings;
use crate::model::trim::{self, Place};

mod balance;
mod batches;
mod crossing;
mod equilibrium;
mod error;
mod filament;
mod force;
mod form;
mod kind;
mod loads;
mod observers;
mod pass;
mod profile;
mod result;
mod search;
mod side_by_side;
mod statistics;
mod step;
mod stop;
mod system;
mod trajectory;
mod turns;

pub(crate) use batches::Batches;
pub use error::{IntegrationError, NoContactArc, Obstacle, SimulationError};
pub(crate) use filament::ContactSum;
pub use filament::Filament;
pub use force::{DepthSearch, Found, Unreachable, press_on};
pub(crate) use form::FilamentEquations;
pub use form::Form;
pub use kind::Kind;
pub use loads::ContactLoads;
pub use observers::{ContactObserver, NodeForce, Sample, Sampling, Shape};
pub use pass::Pass;
pub(crate) use profile::EdgeWork;
pub use profile::ProfileCell;
pub use result::{AtPlace, Simulation};
pub use side_by_side::{Job, sample_any_side_by_side, sample_side_by_side, simulate_side_by_side};
pub use statistics::Statistics;
pub use step::Step;
pub use stop::Stop;
pub use system::{COORDINATES, FilamentState, FilamentSystem, integral};
pub use trajectory::{Trajectory, integrate};
pub(crate) use turns::{CompletedTurns, are_steady, standard_error_of_turns};

/// SHA-256 of all code between settings and metrics, in hexadecimal digits. Builds with different
/// hashes may differ in results.
pub const SOLVER_FINGERPRINT: &str = env!("BRISTLE_SOLVER");

/// Simulates one pass and reduces it to its metrics.
///
/// # Errors
/// If the integration cannot continue. All numbers returned are finite.
pub fn simulate(settings: &Settings) -> Result<Simulation, SimulationError> {
    simulate_with(settings, Sampling::default())
}

/// Simulates one pass and samples it at `samples` equally spaced times, including the first and the
/// last instant.
///
/// The metrics are those of [`simulate`], to the tolerance. The samples are interpolated within
/// steps and do not affect the integration.
///
/// # Errors
/// As for [`simulate`].
pub fn simulate_with_history(
    settings: &Settings,
    samples: usize,
) -> Result<Simulation, SimulationError> {
    simulate_with(
        settings,
        Sampling {
            samples,
            ..Sampling::default()
        },
    )
}

/// Simulates one pass and takes the samples that `sampling` requests; see
/// [`simulate_with_history`].
///
/// # Errors
/// As for [`simulate`].
pub fn simulate_with(
    settings: &Settings,
    sampling: Sampling,
) -> Result<Simulation, SimulationError> {
    simulate_places(settings, sampling, &Stop::default(), &mut |_| ())
}

/// Simulates as [`simulate_with`] does, but ends early once `stop` is requested. Tells after each
/// step the share of the pass that is done ([`Pass::simulate_telling`]).
///
/// Where filaments along the trim differ ([`trim::places`]), samples are taken of the one nearest
/// to its middle.
///
/// # Errors
/// As for [`simulate`].
pub fn simulate_places(
    settings: &Settings,
    sampling: Sampling,
    stop: &Stop,
    tell: &mut dyn FnMut(f64),
) -> Result<Simulation, SimulationError> {
    /// Typical number of simulations of a search for a depth, for its progress.
    const TYPICAL_SIMULATIONS: f64 = 9.0;
    let mut count = 0.0;
    let found = press_on(settings, None, |at_depth| {
        let mut tell =
            |share: f64| tell((count + share) / (TYPICAL_SIMULATIONS + 1.0_f64).max(count + 1.0));
        let simulation = simulate_places(at_depth, Sampling::default(), stop, &mut tell)?;
        count += 1.0;
        Ok::<_, SimulationError>((simulation.metrics.estimated_force(), simulation))
    })?;
    if let Some(Found {
        depth,
        stiffness,
        result,
    }) = found
    {
        let mut result = match sampling == Sampling::default() {
            true => result,
            false => simulate_places(&settings.at_depth(depth), sampling, stop, &mut |_| ())?,
        };
        result.metrics.force_stiffness_n_m = stiffness;
        return Ok(result);
    }
    let places = trim::places(settings);
    let middle = places.len() / 2;
    let at = |place: usize| Pass::at(settings, places[place].s).until(stop);
    let sampled = at(middle).simulate_telling(sampling, tell)?;
    let mut results: Vec<Option<Result<Simulation, SimulationError>>> = vec![None; places.len()];
    results[middle] = Some(Ok(sampled));
    let mut waiting: Vec<Job> = (0..places.len())
        .rev()
        .filter(|&place| place != middle)
        .map(|number| Job {
            number,
            pass: at(number),
        })
        .collect();
    let others = Sampling {
        profile: sampling.profile,
        alongside: sampling.alongside,
        ..Sampling::default()
    };
    let take =
        |kind: Option<Kind>| waiting.pop_if(|job| kind.is_none_or(|kind| job.pass.kind() == kind));
    sample_side_by_side(others, take, |number, result| {
        results[number] = Some(result)
    });
    let all = results
        .into_iter()
        .flatten()
        .collect::<Result<Vec<_>, _>>()?;
    Ok(of_trim(&places, all))
}

/// Combines the simulations of the filaments at the `places` of a trim, in this order. Metrics and
/// impulses of turns are weighted sums, or the largest of extremes. Samples are those of the middle
/// filament.
///
/// # Panics
/// If the numbers of places and simulations differ, or are zero.
pub fn of_trim(places: &[Place], mut all: Vec<Simulation>) -> Simulation {
    assert_eq!(places.len(), all.len(), "a simulation for each place");
    if let [_] = places {
        return all.remove(0);
    }
    let weighted: Vec<(f64, &Metrics)> = places
        .iter()
        .map(|place| place.weight)
        .zip(all.iter().map(|one| &one.metrics))
        .collect();
    let metrics = Metrics::weighted(&weighted).expect("there are places");
    let turns = all
        .iter()
        .map(|one| one.turn_contact_normal_impulses_n_s.len())
        .max()
        .unwrap_or(0);
    // A filament that has become steady keeps its last impulse.
    let in_turn = |one: &Simulation, turn: usize| {
        let impulses = &one.turn_contact_normal_impulses_n_s;
        impulses
            .get(turn)
            .or(impulses.last())
            .copied()
            .unwrap_or(0.0)
    };
    let impulses = (0..turns)
        .map(|turn| {
            places
                .iter()
                .zip(&all)
                .map(|(place, one)| place.weight * in_turn(one, turn))
                .sum()
        })
        .collect();
    let statistics = all
        .iter()
        .fold(Statistics::default(), |sum, one| sum.and(&one.statistics));
    let along_trim = places.iter().zip(&all);
    let positions = along_trim
        .map(|(&place, one)| AtPlace {
            place,
            metrics: one.metrics.clone(),
        })
        .collect();
    let profile = profile::weighted(
        places
            .iter()
            .zip(&all)
            .map(|(place, one)| (place.weight, &one.profile[..])),
    );
    let end_time_s = all.iter().map(|one| one.end_time_s).fold(0.0, f64::max);
    let sampled = all.swap_remove(places.len() / 2);
    Simulation {
        metrics,
        turn_contact_normal_impulses_n_s: impulses,
        end_time_s: if sampled.history.is_empty() {
            end_time_s
        } else {
            sampled.end_time_s
        },
        statistics,
        positions,
        profile,
        ..sampled
    }
}
