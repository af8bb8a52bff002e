//! The driver of passes: many side by side, in the lanes of the machine's vector units, or one.

use super::error::SimulationError;
use super::kind::Kind;
use super::observers::{ContactObserver, Sampler, Sampling};
use super::pass::{METHOD, Pass};
use super::result::Simulation;
use super::system::{COORDINATES, FilamentSystem};
use super::trajectory::Trajectory;
use super::turns::Itinerary;
use crate::equations::{Compiled, Lanes, PolarAxis, lanes_are_compiled};
use crate::integrate::{SecondOrderSystem, Stepper};
use crate::model::settings::Settings;
use crate::tool::{RotaryTool, Tool, Turning};
use crate::workpiece::{Part, Workpiece};

/// A pass to simulate, with the number under which it is reported.
#[derive(Clone, Debug)]
pub struct Job<T = RotaryTool, W = Part> {
    /// The number.
    pub number: usize,
    /// The pass.
    pub pass: Pass<T, W>,
}

impl Job {
    /// The pass that `settings` state, under `number`.
    pub fn new(number: usize, settings: &Settings) -> Self {
        Self {
            number,
            pass: Pass::new(settings),
        }
    }
}

/// Simulates the jobs that `take` returns, [`LANES`](crate::equations::LANES) at a time, and reports each to `done`.
///
/// Whenever a lane is free, `take` is called for a job of the given kind, or of any kind. Each lane
/// goes at its own pace. A job of another kind than the given one is simulated alone. A result
/// equals that of [`Pass::simulate`] to the bit, whatever the other lanes hold.
pub fn simulate_side_by_side(
    take: impl FnMut(Option<Kind>) -> Option<Job>,
    done: impl FnMut(usize, Result<Simulation, SimulationError>),
) {
    sample_side_by_side(Sampling::default(), take, done);
}

/// [`simulate_side_by_side`], with the samples that `sampling` requests.
pub fn sample_side_by_side(
    sampling: Sampling,
    mut take: impl FnMut(Option<Kind>) -> Option<Job>,
    mut done: impl FnMut(usize, Result<Simulation, SimulationError>),
) {
    sample_jobs(sampling, &mut take, &mut done);
}

/// [`sample_any_side_by_side`], compiled and optimised once here rather than again for each caller
/// in each crate.
fn sample_jobs(
    sampling: Sampling,
    take: &mut dyn FnMut(Option<Kind>) -> Option<Job>,
    done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
) {
    sample_any_side_by_side(sampling, take, done);
}

/// [`sample_side_by_side`] for passes of any tool over any workpiece.
pub fn sample_any_side_by_side<T: Tool + Clone, W: Workpiece + Clone>(
    sampling: Sampling,
    mut take: impl FnMut(Option<Kind>) -> Option<Job<T, W>>,
    mut done: impl FnMut(usize, Result<Simulation, SimulationError>),
) {
    while let Some(first) = take(None) {
        if !lanes_are_compiled() {
            done(first.number, first.pass.simulate(sampling));
            continue;
        }
        let kind = first.pass.kind();
        let mut batch = Batch::<T, W, Lanes>::new(&first.pass, sampling);
        let mut first = Some(first);
        batch.run(
            || first.take().or_else(|| take(Some(kind))),
            &mut done,
            &mut |_| (),
        );
    }
}

/// Simulates one pass, and calls `tell` after each step with the share that is done, from 0 to 1.
pub(super) fn simulate_one<T: Tool + Clone, W: Workpiece + Clone>(
    pass: Pass<T, W>,
    sampling: Sampling,
    tell: &mut dyn FnMut(f64),
) -> Result<Simulation, SimulationError> {
    let mut batch = Batch::<T, W, f64>::new(&pass, sampling);
    let (mut job, mut result) = (Some(Job { number: 0, pass }), None);
    batch.run(|| job.take(), &mut |_, one| result = Some(one), tell);
    result.expect("the job is reported")
}

/// A job being simulated.
struct Run<T, W> {
    number: usize,
    pass: Pass<T, W>,
    observer: ContactObserver<Turning<T>, W>,
    sampler: Sampler,
    trajectory: Trajectory,
    itinerary: Itinerary,
    /// The expected end in s.
    duration: f64,
}

impl<T: Tool + Clone, W: Workpiece + Clone> Run<T, W> {
    /// Reports a job whose pass has ended. If its samples need another end, the job is to be
    /// repeated with that one (s).
    fn report(
        self,
        done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
    ) -> Option<(Job<T, W>, f64)> {
        let Self {
            number,
            pass,
            observer,
            sampler,
            trajectory,
            itinerary,
            ..
        } = self;
        let end_time = trajectory.start().time;
        if !sampler.covers(end_time) {
            return Some((Job { number, pass }, end_time));
        }
        done(
            number,
            pass.conclude(&observer, &trajectory, itinerary, sampler),
        );
        None
    }
}

/// Lanes for passes of the same kind, or one for any pass.
struct Batch<T, W, L: Compiled> {
    kind: Kind,
    system: FilamentSystem<Turning<T>, W, L>,
    stepper: Stepper<L, COORDINATES, { super::integral::COUNT }>,
    /// One per lane.
    runs: Vec<Option<Run<T, W>>>,
    steps: L,
    sampling: Sampling,
    /// The polar axis of all coordinates.
    axis: PolarAxis,
}

impl<T: Tool + Clone, W: Workpiece + Clone, L: Compiled> Batch<T, W, L> {
    fn new(example: &Pass<T, W>, sampling: Sampling) -> Self {
        let (kind, filament) = (example.kind(), example.filament());
        let filaments = vec![filament.clone(); L::LANES];
        let energy = example.tracks_energy(sampling);
        let mut system = FilamentSystem::side_by_side(example.form(), filaments, energy);
        let axis = kind.axis();
        system.set_chart(axis);
        Self {
            kind,
            system,
            stepper: Stepper::new(METHOD, filament.stage_solution(), filament.chain.segments()),
            runs: (0..L::LANES).map(|_| None).collect(),
            steps: L::ZERO,
            sampling,
            axis,
        }
    }

    /// Simulates the jobs that `take` returns, until there are no more, and those that are in
    /// lanes. Calls `tell` after each step with the share of its pass that is done.
    fn run(
        &mut self,
        mut take: impl FnMut() -> Option<Job<T, W>>,
        done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
        tell: &mut dyn FnMut(f64),
    ) {
        loop {
            // A job that has ended may be followed by others.
            let mut exhausted = false;
            for lane in 0..L::LANES {
                while !self.prepare(lane, done) && !exhausted {
                    match take() {
                        Some(Job { number, pass }) if pass.kind() != self.kind => {
                            done(number, pass.simulate(self.sampling))
                        }
                        Some(job) => {
                            let end_time = job.pass.expected_end();
                            self.start(lane, job, end_time);
                        }
                        None => exhausted = true,
                    }
                }
            }
            let Some(busy) = self.runs.iter().position(Option::is_some) else {
                return;
            };
            for lane in 0..L::LANES {
                if self.runs[lane].is_none() {
                    self.idle(lane, busy);
                }
            }
            self.stepper.attempt(&mut self.system, self.steps);
            for lane in 0..L::LANES {
                let Some(run) = &mut self.runs[lane] else {
                    continue;
                };
                let (observer, sampler) = (&mut run.observer, &mut run.sampler);
                let outcome =
                    run.trajectory
                        .conclude(lane, &self.stepper, &mut self.system, |step| {
                            observer.observe(step);
                            sampler.observe(step, observer);
                            tell((step.end.time / run.duration).min(1.0));
                        });
                if let Err(error) = outcome {
                    done(run.number, Err(error.into()));
                    self.runs[lane] = None;
                }
            }
        }
    }

    /// Starts a job in a free lane. Samples are those of a pass that ends at `end_time` (s).
    fn start(&mut self, lane: usize, job: Job<T, W>, end_time: Option<f64>) {
        let Job { number, pass } = job;
        let trajectory = pass.trajectory(&mut pass.system_for(self.sampling));
        let (observer, sampler, itinerary) = (
            pass.observer(),
            pass.sampler(self.sampling, end_time),
            pass.itinerary(),
        );
        let duration = end_time.unwrap_or(pass.end_time());
        self.enter(
            lane,
            Run {
                number,
                pass,
                observer,
                sampler,
                trajectory,
                itinerary,
                duration,
            },
        );
    }

    /// Puts a job into a free lane, wherever it is on its way.
    fn enter(&mut self, lane: usize, run: Run<T, W>) {
        self.system.set_filament(lane, run.pass.filament().clone());
        run.trajectory.enter(lane, &mut self.system);
        self.stepper
            .set_tolerances(lane, run.trajectory.tolerances());
        self.runs[lane] = Some(run);
    }

    /// Prepares the next step of a lane. Returns false if the lane is free, or its pass has just
    /// ended.
    fn prepare(
        &mut self,
        lane: usize,
        done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
    ) -> bool {
        let Some(run) = &mut self.runs[lane] else {
            return false;
        };
        let axis = run.trajectory.start().chart;
        if axis != self.axis && L::LANES > 1 {
            // All lanes share their chart: a filament that leaves it continues alone.
            let run = self.runs[lane].take().expect("the lane has a job");
            let mut alone = Batch::<T, W, f64>::new(&run.pass, self.sampling);
            alone.enter(0, run);
            alone.run(|| None, done, &mut |_| ());
            return false;
        }
        if axis != self.axis {
            self.system.set_chart(axis);
            self.axis = axis;
        }
        let result = loop {
            match run.trajectory.next_step(&self.system) {
                Ok(Some(step)) => {
                    self.steps.set_lane(lane, step);
                    run.trajectory.prepare(lane, &mut self.stepper);
                    return true;
                }
                Ok(None) if run.itinerary.proceed(&mut run.trajectory) => {}
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            }
        };
        let run = self.runs[lane].take().expect("the lane has a job");
        match result {
            Ok(()) => {
                if let Some((job, end_time)) = run.report(done) {
                    self.start(lane, job, Some(end_time));
                    return self.prepare(lane, done);
                }
            }
            Err(error) => done(run.number, Err(error.into())),
        }
        false
    }

    /// Keeps a lane without a job at rest in the state of a busy one, with all contacts open, so
    /// that its numbers stay finite.
    fn idle(&mut self, lane: usize, busy: usize) {
        let run = self.runs[busy].as_ref().expect("the lane has a job");
        self.system.open_all(lane);
        self.stepper.set_start(lane, run.trajectory.start());
        self.steps.set_lane(lane, 0.0);
    }
}
