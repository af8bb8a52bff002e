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

/// Pass to simulate, with the number under which it is reported.
#[derive(Clone, Debug)]
pub struct Job<T = RotaryTool, W = Part> {
    /// Number under which the pass is reported.
    pub number: usize,
    /// Pass to simulate.
    pub pass: Pass<T, W>,
}

impl Job {
    /// Creates the job of the pass that `settings` state, under `number`.
    pub fn new(number: usize, settings: &Settings) -> Self {
        Self {
            number,
            pass: Pass::new(settings),
        }
    }
}

/// Simulates the jobs that `take` returns, [`LANES`](crate::equations::LANES) at a time. Reports
/// each to `done`.
///
/// Whenever a lane is free, `take` is called for a job of the given kind, or of any kind. Each lane
/// has its own step size. A job of another kind than the given one is simulated alone. A result
/// equals that of [`Pass::simulate`] to the bit, whatever the other lanes hold.
pub fn simulate_side_by_side(
    take: impl FnMut(Option<Kind>) -> Option<Job>,
    done: impl FnMut(usize, Result<Simulation, SimulationError>),
) {
    sample_side_by_side(Sampling::default(), take, done);
}

/// Simulates as [`simulate_side_by_side`] does, with the samples that `sampling` requests.
pub fn sample_side_by_side(
    sampling: Sampling,
    mut take: impl FnMut(Option<Kind>) -> Option<Job>,
    mut done: impl FnMut(usize, Result<Simulation, SimulationError>),
) {
    sample_jobs(sampling, &mut take, &mut done);
}

/// Calls [`sample_any_side_by_side`]. It is compiled and optimised once here, not for each caller
/// in each crate.
fn sample_jobs(
    sampling: Sampling,
    take: &mut dyn FnMut(Option<Kind>) -> Option<Job>,
    done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
) {
    sample_any_side_by_side(sampling, take, done);
}

/// Extends [`sample_side_by_side`] to passes of any tool over any workpiece.
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
        let mut batch = PassBatch::<T, W, Lanes>::new(&first.pass, sampling);
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
    let mut batch = PassBatch::<T, W, f64>::new(&pass, sampling);
    let (mut job, mut result) = (Some(Job { number: 0, pass }), None);
    batch.run(|| job.take(), &mut |_, one| result = Some(one), tell);
    result.expect("the job is reported")
}

/// Job that is being simulated.
struct RunningPass<T, W> {
    number: usize,
    pass: Pass<T, W>,
    observer: ContactObserver<Turning<T>, W>,
    sampler: Sampler,
    trajectory: Trajectory,
    itinerary: Itinerary,
    /// Expected end in s.
    duration: f64,
}

impl<T: Tool + Clone, W: Workpiece + Clone> RunningPass<T, W> {
    /// Concludes a pass that has ended with `outcome`. The job is to be repeated if its samples
    /// need another end, or if shorter steps may mend its error.
    fn end(self, outcome: Result<(), SimulationError>) -> EndedPass<T, W> {
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
        if outcome.is_ok() && !sampler.covers(end_time) {
            return EndedPass::Again(Job { number, pass }, Some(end_time));
        }
        let result =
            outcome.and_then(|()| pass.conclude(&observer, &trajectory, itinerary, sampler));
        let refined = result.as_ref().err().and_then(|error| pass.refined(error));
        match refined {
            Some(pass) => {
                let end_time = pass.expected_end();
                EndedPass::Again(Job { number, pass }, end_time)
            }
            None => EndedPass::Done(number, result),
        }
    }
}

/// Outcome of a pass that has ended.
enum EndedPass<T, W> {
    /// The result of the job with this number.
    Done(usize, Result<Simulation, SimulationError>),
    /// A job to simulate, with samples up to an end in s.
    Again(Job<T, W>, Option<f64>),
}

/// Lanes for passes of the same kind, or one for any pass.
struct PassBatch<T, W, L: Compiled> {
    kind: Kind,
    system: FilamentSystem<Turning<T>, W, L>,
    stepper: Stepper<L, COORDINATES, { super::integral::COUNT }>,
    /// Run of each lane, if it has one.
    runs: Vec<Option<RunningPass<T, W>>>,
    steps: L,
    sampling: Sampling,
    /// Polar axis of all coordinates.
    axis: PolarAxis,
}

impl<T: Tool + Clone, W: Workpiece + Clone, L: Compiled> PassBatch<T, W, L> {
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

    /// Simulates the jobs in lanes and the jobs that `take` returns, until there are no more. Calls
    /// `tell` after each step with the share of its pass that is done.
    fn run(
        &mut self,
        mut take: impl FnMut() -> Option<Job<T, W>>,
        done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
        tell: &mut dyn FnMut(f64),
    ) {
        loop {
            // Other jobs may follow one that has ended.
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
                    let run = self.runs[lane].take().expect("the lane has a job");
                    self.settle(lane, run.end(Err(error.into())), done);
                }
            }
        }
    }

    /// Reports the result of a pass, or starts its job again in the free `lane`. Returns `true` if
    /// the lane is busy then.
    fn settle(
        &mut self,
        lane: usize,
        ended: EndedPass<T, W>,
        done: &mut dyn FnMut(usize, Result<Simulation, SimulationError>),
    ) -> bool {
        match ended {
            EndedPass::Done(number, result) => {
                done(number, result);
                false
            }
            EndedPass::Again(job, end_time) => {
                self.start(lane, job, end_time);
                true
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
            RunningPass {
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

    /// Puts a job into a free lane, in whatever state it is.
    fn enter(&mut self, lane: usize, run: RunningPass<T, W>) {
        self.system.set_filament(lane, run.pass.filament().clone());
        run.trajectory.enter(lane, &mut self.system);
        self.stepper
            .set_tolerances(lane, run.trajectory.tolerances());
        self.runs[lane] = Some(run);
    }

    /// Prepares the next step of a lane. Returns `false` if the lane is free, or its pass has just
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
            let mut alone = PassBatch::<T, W, f64>::new(&run.pass, self.sampling);
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
        let ended = run.end(result.map_err(SimulationError::from));
        self.settle(lane, ended, done) && self.prepare(lane, done)
    }

    /// Keeps a lane without a job at rest in the state of a busy one, with all contacts open. Its
    /// numbers then stay finite.
    fn idle(&mut self, lane: usize, busy: usize) {
        let run = self.runs[busy].as_ref().expect("the lane has a job");
        self.system.open_all(lane);
        self.stepper.set_start(lane, run.trajectory.start());
        self.steps.set_lane(lane, 0.0);
    }
}
