//! Trajectory of one filament through its contact, by steps that end on located contact events.

use super::crossing::{Crossing, GAP_RATE, TooLong, crossing as crossing_of, excess};
use super::error::IntegrationError;
use super::filament::Filament;
use super::statistics::Statistics;
use super::step::{Step, at_knots};
use super::stop::Stop;
use super::system::integral::{CONTACT_DISSIPATION, COUNT};
use super::system::{COORDINATES, FilamentState, FilamentSystem};
use crate::contact::Approach;
use crate::equations::linear::{dot, sub};
use crate::equations::{Compiled, Lanewise};
use crate::integrate::hermite::Knot;
use crate::integrate::tableau::Tableau;
use crate::integrate::{
    Proposal, RejectionCause, SecondOrderSystem, StepControl, Stepper, Tolerances, WorkBudget,
};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

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
/// Largest number of repetitions of a step until its end lies on an event: first by Newton's
/// method, then by bisection to rounding.
const MAX_NEWTON_LANDINGS: usize = 12;
const MAX_LANDINGS: usize = 60;
/// Largest penetration of a contact that takes over from another, over that of the deepest closed
/// contact.
const MAX_TAKEOVER_RATIO: f64 = 2.0;
/// Largest share of the kinetic energy of the outermost segment that a contact may store when it
/// closes. The energy balance tells whether that matters.
const MAX_UNNOTICED_SHARE: f64 = 0.1;
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

/// Nodes at one time.
#[derive(Clone, Debug)]
struct NodesAtTime {
    knots: Vec<Knot<3>>,
    /// Their largest speed in m/s and acceleration in m/s².
    speed: f64,
    acceleration: f64,
    /// Lower bounds on the distances of the contacts from their events, in m; zero where nothing is
    /// known.
    distances: Vec<f64>,
}

impl NodesAtTime {
    /// Creates the nodes in `knots`, without speed and without the distances of `contacts`
    /// contacts.
    fn new(knots: Vec<Knot<3>>, contacts: usize) -> Self {
        Self {
            knots,
            speed: f64::INFINITY,
            acceleration: f64::INFINITY,
            distances: vec![0.0; contacts],
        }
    }

    /// Finds the largest speed and acceleration.
    fn measure(&mut self) {
        let largest = |of: fn(&Knot<3>) -> [f64; 3]| {
            self.knots
                .iter()
                .map(of)
                .map(|vector| dot(vector, vector))
                .fold(0.0, f64::max)
                .sqrt()
        };
        (self.speed, self.acceleration) =
            (largest(|knot| knot.rate), largest(|knot| knot.acceleration));
    }

    /// Returns an upper bound in m on the way of a node from here in a step of the length `length`
    /// (s) to `end`. Within the step the node stays in the hull of its Bézier points (see
    /// [`crossing`](super::crossing)).
    fn way_to(&self, end: &Self, length: f64) -> f64 {
        let square = |(start, end): (&Knot<3>, &Knot<3>)| {
            let way = sub(end.value, start.value);
            dot(way, way)
        };
        let straight = self
            .knots
            .iter()
            .zip(&end.knots)
            .map(square)
            .fold(0.0, f64::max)
            .sqrt();
        let hull = |nodes: &Self| length * (0.4 * nodes.speed + 0.05 * length * nodes.acceleration);
        hull(self).max(straight + hull(end))
    }
}

/// Purpose of the next attempt.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Advance in time.
    Advance(Proposal),
    /// End on an event.
    Land(Landing),
}

/// Search for the step that ends on an event: within half of the tolerance or, if rounding prevents
/// that, at the first instant after the event.
#[derive(Clone, Copy, Debug)]
struct Landing {
    crossing: Crossing,
    /// Lengths of steps that end before and after the event, in s.
    low: f64,
    high: f64,
    /// Length to try next.
    length: f64,
    attempts: usize,
    /// Number of events that were replaced by an earlier one.
    earlier: usize,
}

impl Landing {
    /// Starts the search for `crossing`, which replaces `earlier` later events of the same step.
    fn on(crossing: Crossing, earlier: usize) -> Self {
        let Crossing {
            after,
            past,
            at_end,
            ..
        } = crossing;
        // An event that only the interpolant shows is checked first.
        let length = if at_end { after } else { past };
        Self {
            crossing,
            low: 0.0,
            high: past,
            length,
            attempts: 0,
            earlier,
        }
    }
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

    /// Returns the deepest penetration of a closed contact at the start, in m.
    fn deepest<M: ClampMotion, W: Workpiece>(&self, filament: &Filament<M, W>) -> f64 {
        let closed = (0..self.closed.len()).filter(|&contact| self.closed[contact]);
        closed
            .map(|contact| self.approach(contact, filament).penetration)
            .fold(0.0, f64::max)
    }

    /// Returns `contact` at the start. A closed contact that has just left its face or edge is
    /// evaluated a little earlier: beyond, another face or edge is the nearest.
    fn approach<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
    ) -> Approach {
        /// Way back, in tolerances of the location of events.
        const LOOKBACK_TOLERANCES: f64 = 8.0;
        let at = |back: f64| {
            let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, back);
            filament
                .touch(contact, &nodes, None, self.start.time - back)
                .approach
        };
        let here = at(0.0);
        let has_left = self.closed[contact] && here.margin < 0.0;
        if has_left {
            at(LOOKBACK_TOLERANCES * self.location / self.start_nodes.speed)
        } else {
            here
        }
    }

    /// Returns the penetration of the contact that opened just before the start, in m; zero if
    /// there is none. Where one contact takes over from another, each event is located to the
    /// tolerance by itself.
    fn just_released(&self) -> f64 {
        /// Largest way of a node between both events, in tolerances of their location.
        const MAX_HANDOVER_TOLERANCES: f64 = 100.0;
        let [time, depth] = self.released;
        let way = (self.start.time - time) * self.start_nodes.speed;
        if way <= MAX_HANDOVER_TOLERANCES * self.location {
            depth
        } else {
            0.0
        }
    }

    /// Closes or opens `contact` at the start of the next step. `deepest` is the penetration of the
    /// deepest contact that was closed, in m.
    ///
    /// The energy of a contact that closes or opens while it is pressed in is accounted for. It
    /// opens so if it recedes so fast that its damping would pull, or if the filament moves to
    /// another face or edge. Its elastic energy then does no more work. A contact that closes again
    /// before it has come out, or takes over from another one, gets that energy back.
    ///
    /// # Errors
    /// If the force begins or ends with a jump: the event was missed.
    fn switch<M: ClampMotion, W: Workpiece, T: Compiled>(
        &mut self,
        contact: usize,
        deepest: f64,
        lane: usize,
        system: &mut FilamentSystem<M, W, T>,
    ) -> Result<(), IntegrationError> {
        let filament = system.filament(lane);
        if !self.closed[contact] {
            self.check_normal(contact, filament)?;
        }
        let approach = self.approach(contact, filament);
        let force = filament.law.normal_force(&approach);
        let takes_over = approach.penetration <= MAX_TAKEOVER_RATIO * deepest;
        let stored = if approach.penetration > 0.0 {
            filament.law.stored_energy(&approach)
        } else {
            0.0
        };
        // Where a node passes the border of a face and its surface at once, one event delays the
        // other. The stored energy is then below this.
        let noticed = MAX_UNNOTICED_SHARE
            * 0.5
            * filament.chain.links[self.end.q.len() - 1].mass
            * self.start_nodes.speed.powi(2);
        let jumps = match self.closed[contact] {
            true => force < -self.jump,
            false => force > self.jump && stored > noticed && !takes_over,
        };
        if jumps {
            return Err(IntegrationError::Jump {
                time: self.start.time,
                force,
            });
        }
        if self.closed[contact] {
            self.released = [self.start.time, approach.penetration];
            self.start.integrals[CONTACT_DISSIPATION] += stored - self.stored[contact];
        } else {
            self.stored[contact] = if takes_over || filament.law.damping > 0.0 {
                stored
            } else {
                0.0
            };
        }
        self.closed[contact] = !self.closed[contact];
        self.start_nodes.distances[contact] = 0.0;
        system.set_closed(lane, contact, self.closed[contact]);
        self.contact_events += 1;
        Ok(())
    }

    /// Checks that the normal of the workpiece at the node of `contact` is a unit vector.
    fn check_normal<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
    ) -> Result<(), IntegrationError> {
        /// Largest deviation of the length of a unit vector.
        const ROUNDING: f64 = 1e-6;
        let (time, node) = (self.start.time, self.start_nodes.knots.get(contact));
        let length = node.map_or(1.0, |node| {
            let normal = filament.workpiece.surface(node.value, time).normal;
            dot(normal, normal).sqrt()
        });
        if (length - 1.0).abs() <= ROUNDING {
            Ok(())
        } else {
            Err(IntegrationError::Normal { time, length })
        }
    }

    /// Returns `true` if `contact` presses at the start although it is open, or vice versa.
    fn is_past<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
    ) -> bool {
        let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, 0.0);
        self.excess(contact, filament, &nodes, self.start.time) > -self.location
    }

    /// Returns `true` if the contact of `landing` is past its event at the end of the step.
    fn is_past_at_end<M: ClampMotion, W: Workpiece>(
        &self,
        landing: Landing,
        filament: &Filament<M, W>,
    ) -> bool {
        let nodes = at_knots(filament, &self.end_nodes.knots, self.end.time, 0.0);
        self.excess(landing.crossing.contact, filament, &nodes, self.end.time) > 0.0
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

    /// Finds the earliest event of the step, except events of the contact `except`, at whose event
    /// the step ends. Updates the distances of the contacts from their events at its end.
    fn first_crossing<M: ClampMotion, W: Workpiece>(
        &mut self,
        filament: &Filament<M, W>,
        except: Option<usize>,
    ) -> Result<Option<Crossing>, TooLong> {
        let mut distances = std::mem::take(&mut self.end_nodes.distances);
        let step = self.step();
        let drift = step.length() * surface_speed(filament, &step);
        let way = self.start_nodes.way_to(&self.end_nodes, step.length());
        // If the workpiece does not just translate, every contact is checked.
        let reach = if filament.workpiece.translates() {
            GAP_RATE * (way + drift)
        } else {
            f64::INFINITY
        };
        let mut first: Result<Option<Crossing>, TooLong> = Ok(None);
        for (contact, end) in distances.iter_mut().enumerate() {
            let start = self.start_nodes.distances[contact];
            if except == Some(contact) {
                *end = 0.0;
                continue;
            }
            if start > reach {
                *end = start - reach;
                continue;
            }
            match crossing_of(filament, &step, contact, self.location, drift) {
                Ok((distance, crossing)) => {
                    *end = distance;
                    if let (Ok(earliest), Some(crossing)) = (&first, crossing)
                        && earliest.is_none_or(|first| crossing.after < first.after)
                    {
                        first = Ok(Some(crossing));
                    }
                }
                Err(TooLong) => {
                    *end = 0.0;
                    first = Err(TooLong);
                }
            }
        }
        self.end_nodes.distances = distances;
        first
    }

    /// Returns the next landing after the attempt of `landing`; `None` if that was close enough to
    /// the event.
    fn correct<M: ClampMotion, W: Workpiece>(
        &self,
        landing: Landing,
        filament: &Filament<M, W>,
    ) -> Option<Landing> {
        let Landing {
            crossing,
            mut low,
            mut high,
            length,
            attempts,
            ..
        } = landing;
        let location = self.location;
        // Excess a time `back` before the end.
        let excess = |back: f64| {
            let nodes = at_knots(filament, &self.end_nodes.knots, self.end.time, back);
            self.excess(crossing.contact, filament, &nodes, self.end.time - back)
        };
        let here = excess(0.0);
        // Where work is limited, a step may end past the event by `depth`, but not before it: the
        // node would switch back.
        let limited = self
            .control
            .is_at_floor(crossing.past, self.end_time - self.start.time);
        let depth = if limited { self.coarse_location } else { 0.0 };
        let resolved = high - low <= 4.0 * f64::EPSILON * (self.start.time.abs() + high);
        let near = here.abs() <= location / 2.0 || (0.0..=depth).contains(&here);
        if near || (resolved && here > 0.0) || attempts + 1 >= MAX_LANDINGS {
            return None;
        }
        if here > 0.0 {
            high = length
        } else {
            low = length
        }
        // Newton's method inside the bracket, with the slope over a small part of the step.
        let back = 1e-4 * length;
        let slope = (here - excess(back)) / back;
        let next = length - (here - depth / 2.0) / slope;
        let inside = next > low && next < high && attempts < MAX_NEWTON_LANDINGS;
        let length = match () {
            () if resolved => high,
            () if inside => next,
            () => (low + high) / 2.0,
        };
        Some(Landing {
            low,
            high,
            length,
            attempts: attempts + 1,
            ..landing
        })
    }
}

/// Returns the speed of the surface of the workpiece at the tip in m/s: the larger value of both
/// ends of a step.
fn surface_speed<M: ClampMotion, W: Workpiece>(filament: &Filament<M, W>, step: &Step<'_>) -> f64 {
    let tip = step.start_nodes.len() - 1;
    let speed = |knot: &Knot<3>, time: f64| {
        let velocity = filament.workpiece.surface(knot.value, time).velocity;
        dot(velocity, velocity).sqrt()
    };
    let start = speed(&step.start_nodes[tip], step.start.time);
    if filament.workpiece.translates() {
        start
    } else {
        start.max(speed(&step.end_nodes[tip], step.end.time))
    }
}
