//! Trajectory of one filament through its contact, by steps that end on located contact events.

mod landing;
mod nodes;
mod switching;

use super::crossing::{Crossing, excess};
use super::error::IntegrationError;
use super::filament::Filament;
use super::statistics::Statistics;
use super::step::{Step, at_knots};
use super::stop::Stop;
use super::system::integral::COUNT;
use super::system::{COORDINATES, FilamentState, FilamentSystem};
use crate::equations::{Compiled, Lanewise};
use crate::integrate::hermite::Knot;
use crate::integrate::tableau::Tableau;
use crate::integrate::{
    Proposal, RejectionCause, SecondOrderSystem, StepControl, Stepper, Tolerances, WorkBudget,
};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;
use landing::Landing;
use nodes::NodesAtTime;

/// Returns the work that `segments` segments may take to advance by `duration` (s).
fn effort(segments: usize, duration: f64) -> WorkBudget {
    let iterations = EFFORT / (segments + SEGMENTS_OF_OVERHEAD) as f64;
    WorkBudget {
        iterations: iterations.min(MAX_ITERATIONS) as usize,
        duration,
    }
}

/// Work that a pass, or the free flight after it, may spend, in Newton iterations of one segment:
/// some three seconds of one core. Nearly all passes need a hundredth of it (docs/methods.md).
const EFFORT: f64 = 4e7;
/// Overhead of an iteration, in segments.
const SEGMENTS_OF_OVERHEAD: usize = 2;
/// Largest number of Newton iterations of a pass with few segments: work around the iterations
/// matters, too.
const MAX_ITERATIONS: f64 = 2.5e6;
/// Largest number of times that an earlier event of another contact shortens a step.
const MAX_EARLIER_LANDINGS: usize = 8;
/// Share of the step within which the later of two events counts as simultaneous.
const SIMULTANEOUS_SHARE: f64 = 1e-9;

/// Integrates `system` from `start` to `end_time` (s) and shows each accepted step to `observe`.
///
/// Steps end where a node closes or opens, located to [`Filament::event_tolerance`].
///
/// Between steps, a chain with a segment near a pole may change its chart. A state records its
/// chart ([`FilamentState::chart`]). Nodes and energies do not depend on the chart.
///
/// # Errors
/// If a step cannot be taken.
pub fn integrate<M: ClampMotion, W: Workpiece>(
    system: &mut FilamentSystem<M, W>,
    start: FilamentState,
    end_time: f64,
    tableau: &'static Tableau,
    tolerances: Tolerances,
    mut observe: impl FnMut(&Step<'_>),
) -> Result<(FilamentState, Statistics), IntegrationError> {
    let mut trajectory = Trajectory::new(system, start, end_time, tableau, tolerances);
    let mut stepper = Stepper::new(
        tableau,
        system.filament(0).stage_solution(),
        system.blocks(),
    );
    stepper.set_tolerances(0, tolerances);
    trajectory.finish(system, &mut stepper, &mut observe)?;
    Ok(trajectory.into_end())
}

/// Trajectory of one filament, advanced by steps that the caller attempts.
///
/// [`Trajectory::next_step`] gives the step to attempt from [`Trajectory::start`];
/// [`Trajectory::conclude`] takes its outcome.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Times in s between which it is integrated for now.
    begin_time: f64,
    end_time: f64,
    /// `true` if it ends as soon as no contact is closed.
    while_touching: bool,
    tolerances: Tolerances,
    /// Largest distance past its event at which a node may end a step, in m.
    location: f64,
    /// That distance where the work is limited.
    coarse_location: f64,
    /// Force in N above which its beginning or end is a jump.
    jump: f64,
    /// Time in s and penetration in m of the last contact that opened while it was pressed in.
    released: [f64; 2],
    control: StepControl,
    contact_events: usize,
    has_two_charts: bool,
    chart_changes: usize,
    start: FilamentState,
    end: FilamentState,
    start_nodes: NodesAtTime,
    end_nodes: NodesAtTime,
    closed: Vec<bool>,
    /// Segment of each closed contact with an edge at the start.
    starts: Vec<usize>,
    /// Energy that each closed contact stored when it closed, in J.
    stored: Vec<f64>,
    phase: Phase,
    stop: Option<Stop>,
    must_be_free: bool,
}

/// Purpose of the next attempt.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Advance in time.
    Advance(Proposal),
    /// End on an event.
    Land(Landing),
}

/// Largest angle in rad by which the body turns in a step. Between the knots of its interpolant, a
/// node that turns by `θ` at a radius `R` is off by `R θ⁶/46080`. The limit keeps the interpolated
/// shape of free filaments, whose steps would be longer.
const MAX_STEP_TURN_RAD: f64 = 0.25;

impl Trajectory {
    /// Creates a trajectory from `start` to `end_time` (s). The contacts closed in `system` are
    /// closed at its start.
    pub fn new<M: ClampMotion, W: Workpiece>(
        system: &mut FilamentSystem<M, W>,
        mut start: FilamentState,
        end_time: f64,
        tableau: &Tableau,
        tolerances: Tolerances,
    ) -> Self {
        let (n, contacts) = (system.blocks(), system.filament(0).contacts());
        let duration = end_time - start.time;
        let [.., rate] = system.filament(0).motion.at(start.time).angular_velocity;
        let control = StepControl::new(tableau, 1e-3 * duration)
            .within(effort(n, duration))
            .up_to(MAX_STEP_TURN_RAD / rate.abs());
        let has_two_charts = system.has_two_charts();
        let chart_changes = usize::from(has_two_charts && start.leave_pole());
        let none = Knot {
            value: [0.0; 3],
            rate: [0.0; 3],
            acceleration: [0.0; 3],
        };
        let mut start_nodes = NodesAtTime::new(vec![none; n], contacts);
        system.track(&start, &mut start_nodes.knots);
        start_nodes.measure();
        let location = system
            .filament(0)
            .event_tolerance(tolerances.relative, start.time);
        let coarse_location = system
            .filament(0)
            .coarse_event_tolerance(tolerances.relative)
            .max(location);
        let mut trajectory = Self {
            begin_time: start.time,
            end_time,
            while_touching: false,
            tolerances,
            location,
            coarse_location,
            jump: system
                .filament(0)
                .largest_jump(location.max(coarse_location)),
            released: [f64::NEG_INFINITY, 0.0],
            phase: Phase::Advance(control.propose(start.time, end_time)),
            control,
            contact_events: 0,
            has_two_charts,
            chart_changes,
            end: start.clone(),
            start,
            end_nodes: start_nodes.clone(),
            start_nodes,
            closed: (0..contacts)
                .map(|contact| system.is_closed(0, contact))
                .collect(),
            starts: vec![0; contacts - n],
            stored: vec![0.0; contacts],
            stop: None,
            must_be_free: false,
        };
        trajectory.locate(system.filament(0));
        trajectory
    }

    /// Lets the trajectory end with [`IntegrationError::Stopped`] once `stop` is requested.
    #[must_use]
    pub fn until(self, stop: Option<Stop>) -> Self {
        Self { stop, ..self }
    }

    /// Refuses a trajectory with [`IntegrationError::NotFree`] if a contact is closed at its start.
    #[must_use]
    pub(super) fn must_be_free(self) -> Self {
        Self {
            must_be_free: true,
            ..self
        }
    }

    /// Continues to `end_time` (s) or, with `while_touching`, only until no contact is closed.
    /// Renews the limit of the work.
    pub fn go_on(&mut self, end_time: f64, while_touching: bool) {
        self.begin_time = self.start.time;
        self.end_time = end_time;
        self.while_touching = while_touching;
        let duration = end_time - self.start.time;
        if duration > 0.0 {
            self.control
                .renew(effort(self.start_nodes.knots.len(), duration));
        }
    }

    /// Returns `true` if a contact is closed.
    pub fn is_touching(&self) -> bool {
        self.closed.contains(&true)
    }

    /// Finds the segments that touch edges at the start.
    fn locate<M: ClampMotion, W: Workpiece>(&mut self, filament: &Filament<M, W>) {
        for edge in 0..self.starts.len() {
            let contact = self.start_nodes.knots.len() + edge;
            if self.closed[contact] {
                let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, 0.0);
                self.starts[edge] = filament
                    .touch(contact, &nodes, None, self.start.time)
                    .station
                    .segment;
            }
        }
    }

    /// Returns the state from which the next step starts.
    pub fn start(&self) -> &FilamentState {
        &self.start
    }

    /// Returns the nodes at that state.
    pub(super) fn nodes(&self) -> &[Knot<3>] {
        &self.start_nodes.knots
    }

    /// Returns the energy in J that closed contacts have taken over from others.
    pub(super) fn taken_over(&self) -> f64 {
        self.closed
            .iter()
            .zip(&self.stored)
            .filter(|(closed, _)| **closed)
            .map(|(_, stored)| stored)
            .sum()
    }

    /// Prepares the next step in `lane` of `stepper`.
    pub fn prepare<T: Lanewise>(&self, lane: usize, stepper: &mut Stepper<T, COORDINATES, COUNT>) {
        stepper.set_start(lane, &self.start);
        stepper.set_allowed_error(lane, self.control.allowed_error());
    }

    /// Closes in `lane` of `system` the contacts that are closed in this trajectory.
    pub fn enter<M: ClampMotion, W: Workpiece, T: Compiled>(
        &self,
        lane: usize,
        system: &mut FilamentSystem<M, W, T>,
    ) {
        for (contact, &closed) in self.closed.iter().enumerate() {
            system.set_closed(lane, contact, closed);
        }
        for (edge, &start) in self.starts.iter().enumerate() {
            system.set_start(lane, self.start_nodes.knots.len() + edge, start);
        }
    }

    /// Returns the scales against which errors are measured.
    pub fn tolerances(&self) -> Tolerances {
        self.tolerances
    }

    /// Returns the final state and the work done.
    pub fn into_end(self) -> (FilamentState, Statistics) {
        let statistics = self.statistics();
        (self.start, statistics)
    }

    /// Returns the work done so far.
    pub fn statistics(&self) -> Statistics {
        Statistics::new(self.control.work(), self.contact_events, self.chart_changes)
    }

    /// Returns the length in s of the step to attempt next; `None` at the end.
    ///
    /// # Errors
    /// If no further step is possible.
    pub fn next_step<M: ClampMotion, W: Workpiece, T: Compiled>(
        &mut self,
        system: &FilamentSystem<M, W, T>,
    ) -> Result<Option<f64>, IntegrationError> {
        if let Phase::Land(landing) = &self.phase {
            return Ok(Some(landing.length));
        }
        if self.stop.as_ref().is_some_and(Stop::is_requested) {
            return Err(IntegrationError::Stopped);
        }
        let time = self.start.time;
        if time >= self.end_time || (self.while_touching && !self.is_touching()) {
            return Ok(None);
        }
        if self.must_be_free && self.control.work().steps == 0 && self.is_touching() {
            return Err(IntegrationError::NotFree);
        }
        if self.control.is_exhausted() {
            let steps = self.control.work().steps;
            let share = (time - self.begin_time) / (self.end_time - self.begin_time);
            return Err(IntegrationError::TooManySteps {
                steps,
                share,
                step: self.control.step(),
            });
        }
        self.start.check(system)?;
        let proposal = self.control.propose(time, self.end_time);
        self.phase = Phase::Advance(proposal);
        Ok(Some(proposal.step))
    }

    /// Takes the outcome of the attempt of [`Trajectory::next_step`] in `lane` of `stepper` and
    /// `system`. Calls `observe` with accepted steps.
    ///
    /// # Errors
    /// If the integration cannot continue.
    pub fn conclude<M: ClampMotion, W: Workpiece, T: Compiled>(
        &mut self,
        lane: usize,
        stepper: &Stepper<T, COORDINATES, COUNT>,
        system: &mut FilamentSystem<M, W, T>,
        mut observe: impl FnMut(&Step<'_>),
    ) -> Result<(), IntegrationError> {
        self.control.count_attempt(stepper.work(lane));
        let length = match self.phase {
            Phase::Advance(proposal) => proposal.step,
            Phase::Land(landing) => landing.length,
        };
        let outcome = self.end.outcome(lane, stepper, system, &self.start, length);
        let crossing = match self.phase {
            Phase::Advance(proposal) => {
                if proposal.limited {
                    self.end.time = self.end_time;
                }
                if !self.control.judge(self.start.time, proposal, outcome)? {
                    return Ok(());
                }
                let filament = system.filament(lane);
                system.nodes(lane, &mut self.end_nodes.knots);
                self.end_nodes.measure();
                let Ok(crossing) = self.first_crossing(filament, None) else {
                    return self.shorten(proposal.step);
                };
                if let Some(crossing) = crossing
                    && crossing.after > 0.0
                {
                    self.phase = Phase::Land(Landing::on(crossing, 0));
                    return Ok(());
                }
                crossing
            }
            Phase::Land(landing) => {
                // Even if the landing fails, the next proposal starts anew.
                if let Err(cause) = outcome {
                    self.phase =
                        Phase::Advance(self.control.propose(self.start.time, self.end_time));
                    self.control
                        .retreat(self.start.time, landing.crossing.after, cause)?;
                    return Ok(());
                }
                system.nodes(lane, &mut self.end_nodes.knots);
                self.end_nodes.measure();
                let filament = system.filament(lane);
                let is_there = landing.crossing.at_end
                    || landing.attempts > 0
                    || self.is_past_at_end(landing, filament);
                if is_there && let Some(next) = self.correct(landing, filament) {
                    self.phase = Phase::Land(next);
                    return Ok(());
                }
                let Ok(other) = self.first_crossing(filament, Some(landing.crossing.contact))
                else {
                    return self.shorten(landing.length);
                };
                // The repeated step differs from the one in which the event was found.
                if let Some(other) = other
                    && other.after > 0.0
                    && other.after < (1.0 - SIMULTANEOUS_SHARE) * landing.length
                    && landing.earlier < MAX_EARLIER_LANDINGS
                {
                    self.phase = Phase::Land(Landing::on(other, landing.earlier + 1));
                    return Ok(());
                }
                is_there.then_some(landing.crossing)
            }
        };
        self.phase = Phase::Advance(self.control.propose(self.start.time, self.end_time));
        // A node that is already past its event, because another event ended the last step,
        // switches immediately.
        if crossing.is_none_or(|crossing| crossing.after > 0.0) {
            observe(&self.step());
            std::mem::swap(&mut self.start, &mut self.end);
            std::mem::swap(&mut self.start_nodes, &mut self.end_nodes);
            self.chart_changes += usize::from(self.has_two_charts && self.start.leave_pole());
            if system.carries_variation() {
                self.start.rescale_variation();
            }
        }
        if let Some(Crossing { contact, .. }) = crossing {
            let deepest = self
                .deepest(system.filament(lane))
                .max(self.just_released());
            self.switch(contact, deepest, lane, system)?;
            for other in 0..self.closed.len() {
                // Where a node leaves a face, an edge takes over, and vice versa.
                if other != contact
                    && !self.starts.is_empty()
                    && self.is_past(other, system.filament(lane))
                {
                    self.switch(other, deepest, lane, system)?;
                }
            }
        }
        if !self.starts.is_empty() {
            self.locate(system.filament(lane));
            self.enter(lane, system);
        }
        Ok(())
    }

    /// Rejects a step of the length `step` (s) that is too long to find the events of a contact.
    fn shorten(&mut self, step: f64) -> Result<(), IntegrationError> {
        self.phase = Phase::Advance(self.control.propose(self.start.time, self.end_time));
        Ok(self
            .control
            .retreat(self.start.time, step, RejectionCause::Error)?)
    }

    /// Returns the distance of `contact` past its event, in m; see [`excess`]. `nodes` are those of
    /// the filament at `time`.
    fn excess<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
        nodes: &dyn Fn(usize) -> [[f64; 3]; 2],
        time: f64,
    ) -> f64 {
        let pressing = filament
            .law
            .pressing(&filament.touch(contact, nodes, None, time).approach);
        excess(self.closed[contact], pressing, self.location)
    }

    /// Integrates alone to the end, which [`Trajectory::go_on`] may have moved. `stepper` has the
    /// trajectory's [tolerances](Self::tolerances).
    ///
    /// # Errors
    /// If a step cannot be taken.
    pub fn finish<M: ClampMotion, W: Workpiece>(
        &mut self,
        system: &mut FilamentSystem<M, W>,
        stepper: &mut Stepper<f64, COORDINATES, COUNT>,
        mut observe: impl FnMut(&Step<'_>),
    ) -> Result<(), IntegrationError> {
        while let Some(step) = self.next_step(system)? {
            system.set_chart(self.start.chart);
            self.prepare(0, stepper);
            stepper.attempt(system, step);
            self.conclude(0, stepper, system, &mut observe)?;
        }
        Ok(())
    }

    fn step(&self) -> Step<'_> {
        Step {
            start: &self.start,
            end: &self.end,
            start_nodes: &self.start_nodes.knots,
            end_nodes: &self.end_nodes.knots,
            closed: &self.closed,
            starts: &self.starts,
        }
    }
}
