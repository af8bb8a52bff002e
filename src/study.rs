//! A study: one simulation for each point of a grid of settings.
//!
//! Cases are numbered in the grid's order and made from their number when they are needed, so that a large study costs no
//! memory beyond its results.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::time::Instant;
use std::{io, thread};

use serde::{Deserialize, Serialize};
use thiserror::Error;
use tracing::{debug, info, warn};

use crate::metrics::Metrics;
use crate::parameters::{Parameter, Violation};
use crate::settings::Settings;
use crate::simulation::Statistics;
use crate::simulation::{Job, Kind, Pass, Simulation, SimulationError, simulate_side_by_side};
use crate::uncertainty::{ForceScatter, INPUTS, MIN_SAMPLES, MOVING, Scatter};

/// Path of the setting that changes fastest in a study.
pub const VELOCITY: &str = "process.brushing_velocity_m_s";
/// Path of the setting that changes next.
pub const DEPTH: &str = "process.penetration_depth_m";

/// Names in `[study]` that stand for a path.
pub const SHORT_NAMES: [(&str, &str); 2] = [("brushing_velocity_m_s", VELOCITY), ("penetration_depth_m", DEPTH)];

/// The largest number of cases in a study.
pub const MAX_CASES: usize = 1_000_000;
/// The largest number of sampled tools in all cases of a study.
pub const MAX_TOOLS: usize = 10_000_000;

/// One swept setting and its values.
#[derive(Clone, Debug)]
pub struct Axis {
    parameter: &'static Parameter,
    values: Vec<f64>,
}

/// An axis as files state it.
#[derive(PartialEq, Serialize, Deserialize)]
pub(crate) struct Sweep {
    pub setting: String,
    pub values: Vec<f64>,
}

/// The ways in which the values of a sweep can be wrong.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AxisError {
    /// There is no value.
    #[error("a sweep needs at least one value")]
    Empty,
    /// Start, stop or step is NaN or infinite.
    #[error("start, stop and step must be finite numbers")]
    NotFinite,
    /// The step is zero or leads away from the end.
    #[error("a step of {step:?} does not lead from {start:?} to {stop:?}")]
    WrongStep {
        /// First value.
        start: f64,
        /// End of the range.
        stop: f64,
        /// Distance of the values.
        step: f64,
    },
    /// There are more values than a study may have cases.
    #[error("more than {MAX_CASES} values: take a larger step")]
    TooManyValues,
    /// The setting cannot have one of the values.
    #[error("{violation}")]
    Value {
        /// Position of the value, counted from 0.
        index: usize,
        /// What is wrong with it.
        violation: Violation,
    },
}

impl Axis {
    /// A sweep over a list of values.
    pub fn list(parameter: &'static Parameter, values: Vec<f64>) -> Result<Self, AxisError> {
        if values.is_empty() {
            return Err(AxisError::Empty);
        }
        if values.len() > MAX_CASES {
            return Err(AxisError::TooManyValues);
        }
        for (index, &value) in values.iter().enumerate() {
            parameter.check(value).map_err(|violation| AxisError::Value { index, violation })?;
        }
        Ok(Self { parameter, values })
    }

    /// A sweep from `start` in equal steps up to and including `stop`.
    ///
    /// A `stop` that rounding alone keeps out of reach is reached: a step may be short of it by one part in a million.
    pub fn range(parameter: &'static Parameter, start: f64, stop: f64, step: f64) -> Result<Self, AxisError> {
        /// Share of a step by which the last value may pass `stop`, far above rounding and far below any intent.
        const SLACK: f64 = 1e-6;

        let steps = (stop - start) / step;
        if !(start.is_finite() && stop.is_finite() && step.is_finite()) {
            return Err(AxisError::NotFinite);
        }
        if step == 0.0 || steps < -SLACK {
            return Err(AxisError::WrongStep { start, stop, step });
        }
        let last = (steps + SLACK).floor();
        // Also true of an overflow to infinity.
        if last >= MAX_CASES as f64 {
            return Err(AxisError::TooManyValues);
        }
        let last = last as usize;
        let value = |index: usize| match index {
            0 => start,
            _ if index == last && (steps - last as f64).abs() <= SLACK => stop,
            _ => without_rounding_noise(start + index as f64 * step),
        };
        Self::list(parameter, (0..=last).map(value).collect())
    }

    /// The swept setting.
    #[must_use]
    pub fn parameter(&self) -> &'static Parameter {
        self.parameter
    }

    /// Its values, at least one.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Position in the order of sweeps: 0 is the outermost.
    fn rank(&self) -> usize {
        match self.parameter.path {
            VELOCITY => 2,
            DEPTH => 1,
            _ => 0,
        }
    }
}

/// Rounds to 12 significant digits, so that the third step of 0.1 is 0.3 and not 0.30000000000000004.
fn without_rounding_noise(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// The ways in which sweeps do not make a study.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StudyError {
    /// Two sweeps name the same setting.
    #[error("`{path}` is swept twice")]
    SweptTwice {
        /// Dotted path of the setting.
        path: &'static str,
    },
    /// The grid has too many points.
    #[error("the study has more than {MAX_CASES} cases")]
    TooManyCases,
    /// The cases have too many sampled tools.
    #[error("the study has more than {MAX_TOOLS} sampled tools: take fewer cases or uncertainty.samples")]
    TooManyTools,
    /// The settings of one case do not go together.
    #[error("case {} of the study: {violation}", .case + 1)]
    Case {
        /// Number of the case, counted from 0.
        case: usize,
        /// What is wrong with it.
        violation: Violation,
    },
}

/// A grid of settings.
#[derive(Clone, Debug)]
pub struct Study {
    base: Settings,
    /// From the slowest to the fastest.
    axes: Vec<Axis>,
    case_count: usize,
}

impl Study {
    /// Makes a study of all combinations of the swept values, and checks each case.
    ///
    /// The velocity changes fastest, then the depth, then the other sweeps, of which the first changes slowest.
    pub fn new(base: Settings, mut axes: Vec<Axis>) -> Result<Self, StudyError> {
        axes.sort_by_key(Axis::rank);
        let mut case_count = 1_usize;
        for (index, axis) in axes.iter().enumerate() {
            let path = axis.parameter.path;
            if axes[..index].iter().any(|other| other.parameter.path == path) {
                return Err(StudyError::SweptTwice { path });
            }
            case_count = case_count
                .checked_mul(axis.values.len())
                .filter(|&count| count <= MAX_CASES)
                .ok_or(StudyError::TooManyCases)?;
        }
        let study = Self { base, axes, case_count };
        if study.scatters() {
            let samples = |case| study.settings(case).uncertainty.samples;
            if (0..case_count).map(samples).sum::<usize>() > MAX_TOOLS {
                return Err(StudyError::TooManyTools);
            }
        }
        for case in 0..case_count {
            study.settings(case).check().map_err(|violation| StudyError::Case { case, violation })?;
        }
        Ok(study)
    }

    /// The settings that all cases share. Those that are swept have some value here, usually their first.
    #[must_use]
    pub fn base(&self) -> &Settings {
        &self.base
    }

    /// The swept settings, from the slowest to the fastest.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The same as files state them.
    pub(crate) fn sweeps(&self) -> Vec<Sweep> {
        let sweep = |axis: &Axis| Sweep { setting: axis.parameter().path.to_owned(), values: axis.values().to_owned() };
        self.axes.iter().map(sweep).collect()
    }

    /// The number of cases, at least one.
    #[must_use]
    pub fn case_count(&self) -> usize {
        self.case_count
    }

    /// The value of each axis in one case, counted from 0.
    pub fn values(&self, case: usize) -> impl Iterator<Item = f64> + '_ {
        let mut stride = self.case_count;
        self.axes.iter().map(move |axis| {
            stride /= axis.values.len();
            axis.values[case / stride % axis.values.len()]
        })
    }

    /// Whether filaments scatter in some case.
    #[must_use]
    pub fn scatters(&self) -> bool {
        let swept = |path| self.axes.iter().find(|axis| axis.parameter.path == path);
        INPUTS[..MOVING].iter().any(|input| match swept(input.std) {
            Some(axis) => axis.values.iter().any(|&value| value > 0.0),
            None => input.scatters(&self.base),
        })
    }

    /// All settings of one case, counted from 0.
    #[must_use]
    pub fn settings(&self, case: usize) -> Settings {
        let mut settings = self.base.clone();
        for (axis, value) in self.axes.iter().zip(self.values(case)) {
            axis.parameter.set(&mut settings, value);
        }
        settings
    }
}

/// What is kept of a simulated case.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseSummary {
    /// The contact metrics.
    pub metrics: Metrics,
    /// What the solver did for them.
    pub statistics: Statistics,
    /// The distribution of the tool force, where filaments scatter; none if most of the sampled tools failed.
    pub scatter: Option<ForceScatter>,
}

/// A case's summary, or the text of the error that ended it.
pub type CaseResult = Result<CaseSummary, String>;

/// Simulates all cases and returns their results in the grid's order, whatever the number of threads.
///
/// Where filaments scatter, the passes of the sampled tools are part of a case. Without a number, there are as many threads
/// as cores; each simulates [`LANES`](crate::equations::LANES) passes at a time. `on_case_done` is called after each case, from
/// any thread. A simulation's error ends its case only.
///
/// # Errors
/// If the threads cannot be started.
pub fn run_study(
    study: &Study,
    threads: Option<NonZeroUsize>,
    on_case_done: impl Fn() + Sync,
) -> io::Result<Vec<CaseResult>> {
    let mut results = vec![None; study.case_count];
    complete_study(study, threads, &mut results, |_, _| {
        on_case_done();
        ControlFlow::Continue(())
    })?;
    Ok(results.into_iter().map(|result| result.expect("every case is done")).collect())
}

/// [`run_study`] for those cases that have no result in `results` yet.
///
/// A case's result is the same to the bit, whichever others are simulated with it. `on_case_done` is told the case, counted
/// from 0, and its result; if it breaks, no further pass is started, those on their way come to their ends, and cases that
/// are not complete stay without a result.
///
/// # Errors
/// If the threads cannot be started; cases may have been simulated then.
///
/// # Panics
/// If `results` has another length than the study has cases.
pub fn complete_study(
    study: &Study,
    threads: Option<NonZeroUsize>,
    results: &mut [Option<CaseResult>],
    on_case_done: impl Fn(usize, &CaseResult) -> ControlFlow<()> + Sync,
) -> io::Result<()> {
    complete_cases(study, threads, results, on_case_done, simulate_taken)
}

/// [`simulate_side_by_side`], compiled here once, and not again for whoever calls this module.
fn simulate_taken(
    take: &dyn Fn(Option<Kind>) -> Option<Job>,
    done: &dyn Fn(usize, Result<Simulation, SimulationError>),
) {
    simulate_side_by_side(take, done);
}

/// The passes that are still to be simulated, and those that are.
struct Queue {
    /// The cases to begin; the first one last.
    waiting: Vec<(Kind, usize)>,
    /// The case begun last, with its kind, as long as it has passes that have not been given out.
    current: Option<(Kind, usize)>,
    begun: BTreeMap<usize, BegunCase>,
    /// Case and run of each pass that is being simulated, by the number that it was given out under.
    running: BTreeMap<usize, (usize, Run)>,
    /// How many passes of sampled tools have been given out.
    tools: usize,
}

/// What a pass is to its case.
#[derive(Clone, Copy)]
enum Run {
    Nominal,
    /// That of a sampled tool.
    Tool(usize),
}

/// A case some of whose passes have been given out.
struct BegunCase {
    start: Instant,
    settings: Settings,
    /// The passes to give out; the first one last.
    runs: Vec<Run>,
    /// Passes without a result yet.
    left: usize,
    nominal: Option<CaseResult>,
    scatter: Option<Scatter>,
    /// Impulses of the sampled tools.
    impulses: Vec<Option<f64>>,
}

impl BegunCase {
    fn new(settings: Settings) -> Self {
        let scatter = Scatter::of(&settings);
        let tools = scatter.as_ref().map_or(0, Scatter::count);
        let reaches = |tool: &usize| scatter.as_ref().is_some_and(|scatter| scatter.settings(*tool).is_some());
        let mut runs: Vec<Run> = (0..tools).rev().filter(reaches).map(Run::Tool).collect();
        runs.push(Run::Nominal);
        // What does not reach the workpiece has no impulse.
        Self {
            start: Instant::now(),
            left: runs.len(),
            nominal: None,
            impulses: vec![Some(0.0); tools],
            settings,
            runs,
            scatter,
        }
    }

    fn settings(&self, run: Run) -> Settings {
        let sampled = match (run, &self.scatter) {
            (Run::Tool(tool), Some(scatter)) => scatter.settings(tool),
            _ => None,
        };
        sampled.unwrap_or_else(|| self.settings.clone())
    }

    /// Takes the result of a pass; true if it was the last.
    fn take<E: Display>(&mut self, run: Run, result: Result<Simulation, E>) -> bool {
        match run {
            Run::Nominal => {
                self.nominal = Some(
                    result
                        .map(|Simulation { metrics, statistics, .. }| CaseSummary {
                            metrics,
                            statistics,
                            scatter: None,
                        })
                        .map_err(|error| error.to_string()),
                );
            }
            Run::Tool(tool) => {
                self.impulses[tool] = result.ok().map(|simulation| simulation.metrics.contact_normal_impulse_n_s);
            }
        }
        self.left -= 1;
        if matches!(self.nominal, Some(Err(_))) {
            // A case that has failed needs no tools.
            self.left -= self.runs.len();
            self.runs.clear();
        }
        self.left == 0
    }

    fn conclude(self) -> CaseResult {
        let mut summary = self.nominal.expect("the nominal pass is one of those that are done")?;
        summary.scatter = self.scatter.and_then(|scatter| scatter.reduce(&self.impulses));
        Ok(summary)
    }
}

impl Queue {
    /// The next pass of this kind, or of any.
    fn give_out(&mut self, study: &Study, kind: Option<Kind>) -> Option<Job> {
        if self.current.is_none() {
            let &(next, case) = self.waiting.last()?;
            if kind.is_some_and(|kind| kind != next) {
                return None;
            }
            self.waiting.pop();
            self.current = Some((next, case));
            self.begun.insert(case, BegunCase::new(study.settings(case)));
        }
        let (of_current, case) = self.current?;
        // Sampled tools are of the kind of the nominal one: neither dampers nor friction come or go with what scatters.
        if kind.is_some_and(|kind| kind != of_current) {
            return None;
        }
        let begun = self.begun.get_mut(&case)?;
        let run = begun.runs.pop()?;
        if begun.runs.is_empty() {
            self.current = None;
        }
        // Those of sampled tools come after all cases.
        let number = match run {
            Run::Nominal => case,
            Run::Tool(_) => study.case_count + self.tools,
        };
        self.tools += usize::from(matches!(run, Run::Tool(_)));
        self.running.insert(number, (case, run));
        Some(Job::new(number, &begun.settings(run)))
    }

    /// Takes the result of a pass, and returns its case if that is complete.
    fn take<E: Display>(&mut self, number: usize, result: Result<Simulation, E>) -> Option<(usize, BegunCase)> {
        let (case, run) = self.running.remove(&number)?;
        let begun = self.begun.get_mut(&case)?;
        let is_complete = begun.take(run, result);
        if begun.runs.is_empty() && self.current.is_some_and(|(_, current)| current == case) {
            self.current = None;
        }
        is_complete.then(|| self.begun.remove(&case).map(|begun| (case, begun))).flatten()
    }
}

/// [`complete_study`] with a function that simulates the cases that it takes until there is none.
fn complete_cases<E: Display>(
    study: &Study,
    threads: Option<NonZeroUsize>,
    results: &mut [Option<CaseResult>],
    on_case_done: impl Fn(usize, &CaseResult) -> ControlFlow<()> + Sync,
    simulate: impl Fn(&dyn Fn(Option<Kind>) -> Option<Job>, &dyn Fn(usize, Result<Simulation, E>)) + Sync,
) -> io::Result<()> {
    assert_eq!(results.len(), study.case_count, "a result, or none, for each case");
    let mut waiting = in_order_of_work(study);
    waiting.retain(|&(_, number)| results[number].is_none());
    let threads = match threads {
        Some(threads) => threads.get(),
        None => thread::available_parallelism().map_or(1, NonZeroUsize::get),
    };
    // A case alone has passes for all threads where tools are sampled.
    let passes = if study.scatters() { waiting.len().saturating_mul(MIN_SAMPLES) } else { waiting.len() };
    let threads = threads.min(passes);
    info!(cases = study.case_count, to_simulate = waiting.len(), threads, "study started");
    let start = Instant::now();

    let queue = Queue { waiting, current: None, begun: BTreeMap::new(), running: BTreeMap::new(), tools: 0 };
    let queue = Mutex::new(queue);
    let results = Mutex::new(results);
    let queued = || queue.lock().expect("nothing panics with the queue in hand");
    let take = |kind: Option<Kind>| queued().give_out(study, kind);
    let done = |number: usize, result: Result<Simulation, E>| {
        let complete = queued().take(number, result);
        let Some((case, begun)) = complete else { return };
        let start = begun.start;
        let result = begun.conclude();
        trace_case(case, &result, start);
        let flow = on_case_done(case, &result);
        results.lock().expect("nothing panics with the results in hand")[case] = Some(result);
        if flow.is_break() {
            let mut queue = queued();
            queue.waiting.clear();
            queue.current = None;
        }
    };
    thread::scope(|scope| {
        for _ in 1..threads {
            thread::Builder::new().spawn_scoped(scope, || simulate(&take, &done))?;
        }
        simulate(&take, &done);
        Ok::<_, io::Error>(())
    })?;
    info!(seconds = start.elapsed().as_secs_f64(), "study ended");
    Ok(())
}

/// Tells the log of a case. The seconds are those since it was begun, which it has shared with others.
fn trace_case(number: usize, result: &CaseResult, begun: Instant) {
    let case = number + 1;
    let seconds = begun.elapsed().as_secs_f64();
    match result {
        Ok(CaseSummary { statistics, .. }) => {
            debug!(case, seconds, steps = statistics.steps, rejected = statistics.rejected_steps, "case done");
        }
        Err(error) => warn!(case, seconds, error, "case failed"),
    }
}

/// The cases with their kinds, the first to simulate last: kind by kind, and of each the longest passes first, so that
/// threads and lanes end at the same time.
fn in_order_of_work(study: &Study) -> Vec<(Kind, usize)> {
    let mut cases: Vec<(Kind, f64, usize)> = (0..study.case_count)
        .map(|number| {
            let settings = study.settings(number);
            let [_, _, duration] = Pass::new(&settings).times();
            (Kind::of(&settings), duration, number)
        })
        .collect();
    cases.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(b.2.cmp(&a.2)));
    cases.into_iter().map(|(kind, _, number)| (kind, number)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::document::Document;
    use crate::testing::brush;

    const FILE: &str = concat!(
        brush!(25),
        "
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        "
    );

    fn base() -> Settings {
        Document::parse(FILE, "base").and_then(|document| document.settings()).expect("the file is right")
    }

    fn parameter(path: &str) -> &'static Parameter {
        Parameter::find(path).expect("the setting exists")
    }

    fn list(path: &str, values: &[f64]) -> Axis {
        Axis::list(parameter(path), values.to_vec()).expect("the values are right")
    }

    #[test]
    fn a_range_includes_its_end_and_has_clean_values() {
        let axis = Axis::range(parameter(DEPTH), 0.5e-3, 5.0e-3, 0.5e-3).expect("the range is right");
        assert_eq!(axis.values(), [0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.003, 0.0035, 0.004, 0.0045, 0.005]);
        let axis = Axis::range(parameter(VELOCITY), 1.0, 0.1, -0.3).expect("the range is right");
        assert_eq!(axis.values(), [1.0, 0.7, 0.4, 0.1]);
        let axis = Axis::range(parameter(VELOCITY), 1.0, 2.0, 0.3).expect("the range is right");
        assert_eq!(axis.values(), [1.0, 1.3, 1.6, 1.9]);
        let axis = Axis::range(parameter(VELOCITY), 1.0, 1.0, 5.0).expect("the range is right");
        assert_eq!(axis.values(), [1.0]);
    }

    #[test]
    fn wrong_ranges_are_refused() {
        let range = |start, stop, step| Axis::range(parameter(VELOCITY), start, stop, step).map(|_| ());
        let wrong_step = |start, stop, step| Err(AxisError::WrongStep { start, stop, step });
        assert_eq!(range(1.0, 2.0, 0.0), wrong_step(1.0, 2.0, 0.0));
        assert_eq!(range(1.0, 1.0, 0.0), wrong_step(1.0, 1.0, 0.0));
        assert_eq!(range(1.0, 2.0, -1.0), wrong_step(1.0, 2.0, -1.0));
        assert_eq!(range(1.0, f64::NAN, 1.0), Err(AxisError::NotFinite));
        assert_eq!(range(1.0, 2.0, f64::INFINITY), Err(AxisError::NotFinite));
        assert_eq!(range(1.0, 2.0, 1e-6), Err(AxisError::TooManyValues));
        assert_eq!(range(1.0, 1e300, 1e-300), Err(AxisError::TooManyValues));
        let segments = Axis::range(parameter("filament.segments"), 1.0, 10.0, 1.5);
        assert!(matches!(segments, Err(AxisError::Value { index: 1, .. })));
    }

    #[test]
    fn velocity_changes_fastest_and_further_sweeps_slowest() {
        let study = Study::new(
            base(),
            vec![
                list(VELOCITY, &[5.0, 10.0]),
                list("contact.exponent", &[1.0, 1.5]),
                list(DEPTH, &[1e-3, 2e-3]),
                list("filament.segments", &[3.0, 4.0]),
            ],
        )
        .expect("the study is right");
        let cases: Vec<Vec<f64>> = (0..study.case_count()).map(|case| study.values(case).collect()).collect();
        assert_eq!(cases.len(), 16);
        assert_eq!(cases[0], [1.0, 3.0, 1e-3, 5.0]);
        assert_eq!(cases[1], [1.0, 3.0, 1e-3, 10.0]);
        assert_eq!(cases[2], [1.0, 3.0, 2e-3, 5.0]);
        assert_eq!(cases[4], [1.0, 4.0, 1e-3, 5.0]);
        assert_eq!(cases[15], [1.5, 4.0, 2e-3, 10.0]);
        let settings = study.settings(14);
        assert_eq!(settings.filament.segments, 4);
        assert_eq!(settings.process.brushing_velocity_m_s, 5.0);
    }

    #[test]
    fn studies_that_make_no_sense_are_refused() {
        let depth = list(DEPTH, &[1e-3, 0.05]);
        let error = Study::new(base(), vec![depth]).expect_err("deeper than the filament is long");
        assert!(matches!(error, StudyError::Case { case: 1, .. }));
        let twice = vec![list(DEPTH, &[1e-3]), list(DEPTH, &[2e-3])];
        let error = Study::new(base(), twice).expect_err("swept twice");
        assert_eq!(error, StudyError::SweptTwice { path: DEPTH });
        let thousand = |path| Axis::range(parameter(path), 1.0, 1001.0, 1.0).expect("a long range");
        let many = vec![thousand(VELOCITY), thousand("contact.exponent")];
        let error = Study::new(base(), many).expect_err("too many cases");
        assert_eq!(error, StudyError::TooManyCases);
    }

    #[test]
    fn a_failed_case_does_not_stop_the_others() {
        let velocities: Vec<f64> = (1..=20).map(f64::from).collect();
        let study = Study::new(base(), vec![list(VELOCITY, &velocities)]).expect("the study is right");
        let done = AtomicUsize::new(0);
        let simulate = |take: &dyn Fn(Option<Kind>) -> Option<Job>,
                        report: &dyn Fn(usize, Result<Simulation, &'static str>)| {
            while let Some(Job { number, pass }) = take(None) {
                let velocity = pass.nominal().brushing_velocity;
                report(number, if velocity == 7.0 { Err("seven") } else { Ok(simulation(velocity)) });
            }
        };
        let on_case_done = |number: usize, result: &CaseResult| {
            assert_eq!(result.is_err(), number == 6);
            done.fetch_add(1, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        let mut results = vec![None; 20];
        complete_cases(&study, NonZeroUsize::new(3), &mut results, on_case_done, simulate).expect("the threads start");
        assert_eq!(done.into_inner(), 20);
        for (velocity, result) in velocities.into_iter().zip(results) {
            match result.expect("every case is done") {
                Ok(summary) => assert_eq!(summary.metrics.contact_time_s, velocity),
                Err(message) => assert_eq!((velocity, message.as_str()), (7.0, "seven")),
            }
        }
    }

    #[test]
    fn only_what_is_missing_is_simulated_and_a_break_starts_no_further_case() {
        let velocities: Vec<f64> = (1..=20).map(f64::from).collect();
        let study = Study::new(base(), vec![list(VELOCITY, &velocities)]).expect("the study is right");
        let simulate = |take: &dyn Fn(Option<Kind>) -> Option<Job>,
                        report: &dyn Fn(usize, Result<Simulation, &'static str>)| {
            while let Some(Job { number, pass }) = take(None) {
                assert!(number >= 5, "the first five have results");
                report(number, Ok(simulation(pass.nominal().brushing_velocity)));
            }
        };
        let mut results = vec![None; 20];
        results[..5].fill(Some(Err("earlier".to_owned())));
        let done = AtomicUsize::new(0);
        let three = |_: usize, _: &CaseResult| {
            if done.fetch_add(1, Ordering::Relaxed) < 2 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        complete_cases(&study, NonZeroUsize::new(1), &mut results, three, simulate).expect("there is one thread");
        assert_eq!(results.iter().flatten().count(), 8);
        assert!(results[..5].iter().all(|result| *result == Some(Err("earlier".to_owned()))));

        let all = |_: usize, _: &CaseResult| ControlFlow::Continue(());
        complete_cases(&study, NonZeroUsize::new(2), &mut results, all, simulate).expect("the threads start");
        assert!(results.iter().all(Option::is_some));
        complete_cases(&study, None, &mut results, |_, _| unreachable!("nothing is left"), simulate)
            .expect("nothing is to be done");
    }

    #[test]
    fn cases_of_one_kind_are_taken_together_and_the_longest_first() {
        let axes = || {
            let segments = list("filament.segments", &[3.0, 4.0]);
            let friction = list("contact.friction_coefficient", &[0.0, 0.2]);
            vec![segments, friction, list(VELOCITY, &[5.0, 20.0, 10.0])]
        };
        let study = Study::new(base(), axes()).expect("the study is right");
        let mut order = in_order_of_work(&study);
        order.reverse();
        let settings: Vec<Settings> = order.iter().map(|&(_, number)| study.settings(number)).collect();
        for group in settings.chunks(3) {
            assert!(group.iter().all(|settings| Kind::of(settings) == Kind::of(&group[0])));
            let velocities = group.iter().map(|settings| settings.process.brushing_velocity_m_s);
            assert_eq!(velocities.collect::<Vec<_>>(), [5.0, 10.0, 20.0]);
        }
        let mut numbers: Vec<usize> = order.iter().map(|&(_, number)| number).collect();
        numbers.sort_unstable();
        assert_eq!(numbers, (0..12).collect::<Vec<_>>());
    }

    fn simulation(contact_time_s: f64) -> Simulation {
        Simulation {
            metrics: Metrics { contact_time_s, ..Metrics::default() },
            statistics: Statistics::default(),
            history: Vec::new(),
            shapes: Vec::new(),
        }
    }
}
