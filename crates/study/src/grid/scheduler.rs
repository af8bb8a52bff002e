//! Simulates the cases of a study in lanes and threads.

use std::fmt::Display;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::time::Instant;
use std::{io, thread};

use bristle::brush::{BrushError, BrushRun, RunOptions};
use bristle::model::settings::Settings;
use bristle::simulation::{
    Found, IntegrationError, Job, Pass, Sampling, Simulation, SimulationError, Stop, Unreachable,
    press_on, sample_side_by_side, simulate_places,
};
use bristle::tool::Tool;
use bristle::workpiece::Workpiece;
use parking_lot::Mutex;
use tracing::{debug, info, warn};

use super::begun_case::BegunCase;
use super::queue::{complete_cases, in_order_of_work};
use super::study::Study;
use crate::grid::case::{CaseResult, CaseSummary, tentative};
use crate::grid::check::{finer_brush, largest_change};
use crate::grid::interaction::{Interaction, statistics, turn_impulses};
use crate::grid::sampled_brush::{SampledBrush, coarse_brush};

/// Threads and memory that a study may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resources {
    /// Number of threads; `None` for as many as cores.
    pub threads: Option<NonZeroUsize>,
    /// Bytes of memory for brushes; `None` if there is no limit.
    pub memory: Option<u64>,
}

impl From<Option<NonZeroUsize>> for Resources {
    fn from(threads: Option<NonZeroUsize>) -> Self {
        Self {
            threads,
            memory: None,
        }
    }
}

/// Simulates all cases and returns their results in the order of the grid, whatever the number of
/// threads.
///
/// Where filaments scatter, the passes of the sampled tools are part of a case. One thread
/// simulates a case of a brush, or an equal share of the threads if these outnumber the cases. If
/// `threads` is `None`, there are as many threads as cores. Each simulates
/// [`LANES`](bristle::equations::LANES) passes at a time. `on_case_done` is called after each case,
/// from any thread. An error of a simulation ends only its case.
///
/// # Errors
/// If the threads cannot be started.
pub fn run_study(
    study: &Study,
    threads: Option<NonZeroUsize>,
    on_case_done: impl Fn() + Sync,
) -> io::Result<Vec<CaseResult>> {
    let cases: Vec<usize> = (0..study.case_count()).collect();
    let results = Mutex::new(vec![None; cases.len()]);
    let done = |case: usize, result| {
        results.lock()[case] = Some(result);
        on_case_done();
        ControlFlow::Continue(())
    };
    simulate_cases(
        study,
        &cases,
        threads,
        &Stop::default(),
        Sampling::default(),
        |_, _| {},
        done,
    )?;
    let results = results.into_inner();
    Ok(results
        .into_iter()
        .map(|result| result.expect("every case is done"))
        .collect())
}

/// Returns the cases without a result, counted from 0.
///
/// # Panics
/// If there are not as many `results` as cases.
#[must_use]
pub fn without_result(study: &Study, results: &[Option<CaseResult>]) -> Vec<usize> {
    assert_eq!(
        results.len(),
        study.case_count(),
        "a result, or none, for each case"
    );
    (0..results.len())
        .filter(|&case| results[case].is_none())
        .collect()
}

/// Simulates some `cases`, counted from 0, like [`run_study`], with the samples that `sampling`
/// requests of each pass, until `stop` is requested.
///
/// The result of a case does not depend on the other cases, to the bit; nor on samples if
/// `sampling` is [`alongside`](Sampling::alongside). `on_case_done` receives the case and its
/// result. If it breaks, no further pass is started, and passes under way are finished. Incomplete
/// cases have no result, nor have cases that a stop ends at their next step.
///
/// `on_pass` receives the pass of each case and the case's number before `on_case_done` is called
/// for that case. It receives neither the passes of sampled tools, nor those of a brush, nor passes
/// that failed.
///
/// # Errors
/// If the threads cannot be started. Some cases may have been simulated by then.
///
/// # Panics
/// If the study has no such case.
pub fn simulate_cases(
    study: &Study,
    cases: &[usize],
    resources: impl Into<Resources>,
    stop: &Stop,
    sampling: Sampling,
    on_pass: impl Fn(usize, &Simulation) + Sync,
    on_case_done: impl Fn(usize, CaseResult) -> ControlFlow<()> + Sync,
) -> io::Result<()> {
    let Resources { threads, memory } = resources.into();
    if study.has_brush() {
        let spare = memory.map(|memory| spare_memory(study, cases, threads, memory));
        let threads_of_each = (thread_count(threads) / cases.len().max(1)).max(1);
        let options = RunOptions {
            threads: threads_of_each,
            ..RunOptions::default()
        };
        return complete_one_by_one(study, cases, threads, on_case_done, |case| {
            simulate_brush(study, case, spare, options, stop)
        });
    }
    complete_cases(
        study,
        cases,
        threads,
        on_pass,
        on_case_done,
        |take, done| {
            let take = |kind| {
                let Job { number, pass } = if stop.is_requested() {
                    None
                } else {
                    take(kind)
                }?;
                Some(Job {
                    number,
                    pass: pass.until(stop),
                })
            };
            sample_side_by_side(sampling, take, |number, result| {
                if !matches!(
                    result,
                    Err(SimulationError::Integration(IntegrationError::Stopped))
                ) {
                    done(number, result);
                }
            });
        },
    )
}

/// Simulates cases like [`simulate_cases`], with passes of another tool or workpiece, which
/// `pass_of` makes. Each thread simulates one case at a time. A case whose pass cannot be made has
/// that error as its result.
///
/// # Errors
/// If the threads cannot be started.
///
/// # Panics
/// If the study has no such case.
pub fn simulate_cases_with<T, W, E>(
    study: &Study,
    cases: &[usize],
    threads: Option<NonZeroUsize>,
    stop: &Stop,
    pass_of: impl Fn(&Settings) -> Result<Pass<T, W>, E> + Sync,
    on_case_done: impl Fn(usize, CaseResult) -> ControlFlow<()> + Sync,
) -> io::Result<()>
where
    T: Tool + Clone,
    W: Workpiece + Clone,
    E: Display,
{
    complete_one_by_one(study, cases, threads, on_case_done, |case| {
        let mut case = BegunCase::new(study.settings(case), study.checks());
        while let Some(run) = case.runs.pop() {
            let result = match pass_of(&case.settings(run)) {
                Ok(pass) => match pass.until(stop).simulate(Sampling::default()) {
                    Err(SimulationError::Integration(IntegrationError::Stopped)) => return None,
                    result => result.map_err(|error| error.to_string()),
                },
                Err(error) => Err(error.to_string()),
            };
            case.take(run, &result);
        }
        Some(case.conclude())
    })
}

/// Returns some `cases` in the order of simulation, for callers that divide a study: kind by kind,
/// and within a kind those with the most work first.
///
/// # Panics
/// If the study has no such case.
#[must_use]
pub fn by_work(study: &Study, cases: &[usize]) -> Vec<usize> {
    let mut ordered = if study.has_brush() {
        each_in_order_of_work(study, cases)
    } else {
        let ordered = in_order_of_work(study, cases).into_iter();
        ordered.map(|(_, case)| case).collect()
    };
    ordered.reverse();
    ordered
}

/// Returns the work of a case, counted from 0, relative to others. Steps are in proportion to the
/// ways of the tips, the memory of a brush to its segments.
#[must_use]
pub fn work(study: &Study, case: usize) -> f64 {
    let settings = study.settings(case);
    let size = match settings.brush {
        Some(_) => study.brush_memory(case).map_or(0.0, |bytes| bytes as f64),
        None => settings.filament.segments as f64,
    };
    let settings = tentative(settings);
    size * Pass::new(&settings).end_time() * settings.process.brushing_velocity_m_s
}

/// Returns the bytes that a brush may need beyond those at its beginning, when it takes more
/// columns. Brushes that are simulated at once have equal shares.
fn spare_memory(study: &Study, cases: &[usize], threads: Option<NonZeroUsize>, memory: u64) -> u64 {
    let mut needs: Vec<u64> = cases
        .iter()
        .filter_map(|&case| study.brush_memory(case).ok())
        .collect();
    needs.sort_unstable();
    let at_once = thread_count(threads).min(needs.len()).max(1);
    let needed = needs
        .iter()
        .rev()
        .take(at_once)
        .fold(0, |sum: u64, needed| sum.saturating_add(*needed));
    memory.saturating_sub(needed) / at_once as u64
}

/// Simulates the brush of a case, which may come to need `spare` more bytes of memory, and repeats
/// it if the study checks its cases. `None` if it was asked to stop.
fn simulate_brush(
    study: &Study,
    case: usize,
    spare: Option<u64>,
    options: RunOptions,
    stop: &Stop,
) -> Option<CaseResult> {
    let settings = study.settings(case);
    let simulate = |settings: &Settings, options: RunOptions| {
        let needed = study.brush_memory(case)?;
        let memory = spare.map(|spare| needed.saturating_add(spare));
        let mut run = BrushRun::new(settings, RunOptions { memory, ..options })?.until(stop);
        while run.advance()? {}
        run.finish()
    };
    let pressed = press_brush(&settings, stop, |settings| {
        let result = simulate(settings, options)?;
        Ok::<_, BrushError>((result.tool.tool_contact_normal_force_n, result))
    });
    let (settings, mut result, stiffness) = match pressed {
        Err(BrushError::Stopped) => return None,
        Err(error) => return Some(Err(error.to_string())),
        Ok(pressed) => pressed,
    };
    result.tool.force_stiffness_n_m = stiffness;
    let effect_of = |settings: &Settings| {
        let result = simulate(&coarse_brush(settings), options)?;
        Ok::<_, BrushError>(result.interaction_factor)
    };
    let scatter = SampledBrush::of(&settings, &result.tool)
        .and_then(|sampled| sampled.map(|own| own.corrected(effect_of)).transpose());
    if scatter.is_err() && stop.is_requested() {
        return None;
    }
    let checked = match study
        .checks()
        .then(|| simulate(&finer_brush(&settings), options))
    {
        Some(Err(BrushError::Stopped)) => return None,
        checked => checked.and_then(Result::ok),
    };
    Some(Ok(CaseSummary {
        turn_contact_normal_impulses_n_s: turn_impulses(&result),
        statistics: statistics(&result.statistics),
        scatter: scatter.map_or_else(
            |error| {
                warn!(case = case + 1, error);
                None
            },
            |sampled| sampled?.distribution(),
        ),
        brush: Some(Interaction::of(&result)),
        change_when_checked: checked.map(|checked| largest_change(&result.tool, &checked.tool)),
        metrics: result.tool,
    }))
}

/// Simulates the brush that `settings` state by `simulate`, which returns force and result. Returns
/// the settings, the result, and the stiffness of the force in N/m. If `settings` state a force,
/// the returned ones have the depth for it. The search begins at the depth for filaments alone. If
/// `settings` state a depth, the stiffness is zero.
///
/// # Errors
/// If no depth reaches the force, or the first error of `simulate`.
pub fn press_brush<R, E: From<BrushError> + From<Unreachable>>(
    settings: &Settings,
    stop: &Stop,
    mut simulate: impl FnMut(&Settings) -> Result<(f64, R), E>,
) -> Result<(Settings, R, f64), E> {
    let Some(force) = settings.process.tool_force_n else {
        let (_, result) = simulate(settings)?;
        return Ok((settings.clone(), result, 0.0));
    };
    let alone = Settings {
        brush: None,
        ..settings.clone()
    };
    let first = match simulate_places(&alone, Sampling::default(), stop, &mut |_| ()) {
        Err(SimulationError::Force(unreachable)) => unreachable
            .depth
            .min(unreachable.deepest * unreachable.largest / force),
        Err(error) => return Err(BrushError::from(error).into()),
        Ok(alone) => alone.metrics.penetration_depth_m,
    };
    let Found {
        depth,
        stiffness,
        result,
    } = press_on(settings, Some(first), |at_depth| {
        let (force, result) = simulate(at_depth)?;
        Ok::<_, E>(([force, 0.0], result))
    })?
    .expect("the settings state a force");
    Ok((settings.at_depth(depth), result, stiffness))
}

/// Simulates cases like [`simulate_cases`], but each thread one case at a time, those with the most
/// work first, until `simulate` returns none.
fn complete_one_by_one(
    study: &Study,
    cases: &[usize],
    threads: Option<NonZeroUsize>,
    on_case_done: impl Fn(usize, CaseResult) -> ControlFlow<()> + Sync,
    simulate: impl Fn(usize) -> Option<CaseResult> + Sync,
) -> io::Result<()> {
    let waiting = each_in_order_of_work(study, cases);
    let threads = thread_count(threads).min(waiting.len());
    let waiting = Mutex::new(waiting);
    let queued = || waiting.lock();
    let work = || {
        loop {
            let next = queued().pop();
            let Some(case) = next else { return };
            let begun = Instant::now();
            let Some(result) = simulate(case) else { return };
            trace_case(case, &result, begun);
            if on_case_done(case, result).is_break() {
                queued().clear();
            }
        }
    };
    in_threads(study, cases.len(), threads, work)
}

/// Simulates `to_simulate` cases of a study by `work` in each of some `threads`, this one included.
pub(super) fn in_threads(
    study: &Study,
    to_simulate: usize,
    threads: usize,
    work: impl Fn() + Sync,
) -> io::Result<()> {
    info!(
        cases = study.case_count(),
        to_simulate, threads, "study started"
    );
    let start = Instant::now();
    thread::scope(|scope| {
        for _ in 1..threads {
            thread::Builder::new().spawn_scoped(scope, &work)?;
        }
        work();
        Ok::<_, io::Error>(())
    })?;
    info!(seconds = start.elapsed().as_secs_f64(), "study ended");
    Ok(())
}

/// Returns cases that are simulated one by one, in reverse order of simulation: those with the most
/// work are last.
fn each_in_order_of_work(study: &Study, cases: &[usize]) -> Vec<usize> {
    let mut waiting: Vec<(f64, usize)> = cases
        .iter()
        .map(|&case| (work(study, case), case))
        .collect();
    waiting.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    waiting.into_iter().map(|(_, case)| case).collect()
}

/// Returns the number of threads: `asked`, or one per core.
#[must_use]
pub fn thread_count(asked: Option<NonZeroUsize>) -> usize {
    asked
        .or_else(|| thread::available_parallelism().ok())
        .map_or(1, NonZeroUsize::get)
}

/// Logs a case. The seconds are counted from its start and include time shared with other cases.
pub(super) fn trace_case(number: usize, result: &CaseResult, begun: Instant) {
    let case = number + 1;
    let seconds = begun.elapsed().as_secs_f64();
    match result {
        Ok(CaseSummary { statistics, .. }) => {
            debug!(
                case,
                seconds,
                steps = statistics.steps,
                rejected = statistics.rejected_steps,
                "case done"
            );
        }
        Err(error) => warn!(case, seconds, error, "case failed"),
    }
}
