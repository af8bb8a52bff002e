//! One filament's trajectory through its contact: steps that end on located contact events.

use super::Statistics;
use super::error::IntegrationError;
use super::search::{maximise, root as root_of};
use super::stop::Stop;
use super::system::integral::{CONTACT_DISSIPATION, COUNT};
use super::system::{COORDINATES, Filament, FilamentState, FilamentSystem, Touch};
use crate::equations::linear::{add, dot, scale};
use crate::equations::{Clamp, Compiled, Lanewise, PolarAxis};
use crate::integrate::hermite::{Knot, interpolate};
use crate::integrate::tableau::Tableau;
use crate::integrate::{Effort, Proposal, SecondOrderSystem, StepControl, Stepper, Tolerances};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// An accepted step, as observers see it.
#[derive(Debug)]
pub struct Step<'a> {
    /// Its start.
    pub start: &'a FilamentState,
    /// Its end.
    pub end: &'a FilamentState,
    /// The nodes at its start.
    pub start_nodes: &'a [Knot<3>],
    /// The nodes at its end.
    pub end_nodes: &'a [Knot<3>],
    /// The contacts that are closed throughout: those of nodes, then those with edges ([`Filament::touch`]).
    pub closed: &'a [bool],
    /// The segment at which each contact with an edge was at the start.
    pub starts: &'a [usize],
}

impl Step<'_> {
    /// Length in s.
    pub fn length(&self) -> f64 {
        self.end.time - self.start.time
    }

    /// Time at the fraction `s` of the step.
    pub fn time(&self, s: f64) -> f64 {
        self.start.time + s * self.length()
    }

    /// Position and velocity of `node` at the fraction `s` of the step.
    pub fn node(&self, node: usize, s: f64) -> ([f64; 3], [f64; 3]) {
        interpolate(&self.start_nodes[node], &self.end_nodes[node], self.length(), s)
    }

    /// The nodes of the filament at the fraction `s` of the step, by their number from the root.
    pub fn nodes<M: ClampMotion, W>(&self, filament: &Filament<M, W>, s: f64) -> impl Fn(usize) -> [[f64; 3]; 2] {
        move |index| match index.checked_sub(1) {
            None => root(filament, self.time(s)),
            Some(node) => self.node(node, s).into(),
        }
    }

    /// `contact` at the fraction `s` of the step.
    pub fn touch<M: ClampMotion, W: Workpiece>(&self, filament: &Filament<M, W>, contact: usize, s: f64) -> Touch {
        let start = contact.checked_sub(self.start_nodes.len()).map(|edge| self.starts[edge]);
        filament.touch(contact, &self.nodes(filament, s), start, self.time(s))
    }

    /// The polar axes of the segments' coordinates, the same at the start and at the end.
    pub fn charts(&self) -> &[PolarAxis] {
        &self.start.charts
    }

    /// Coordinates and rates at the fraction `s` of the step, into `q` and `v`, about [`Step::charts`].
    pub fn coordinates(&self, s: f64, q: &mut [[f64; 2]], v: &mut [[f64; 2]]) {
        let knot = |state: &FilamentState, k: usize| Knot {
            value: state.q[k],
            rate: state.v[k],
            acceleration: state.accelerations[k],
        };
        for k in 0..self.start.q.len() {
            (q[k], v[k]) = interpolate(&knot(self.start, k), &knot(self.end, k), self.length(), s);
        }
    }

    /// The integrals at the fraction `s` of the step (cubic Hermite interpolation).
    pub fn integrals(&self, s: f64) -> [f64; COUNT] {
        let (length, start, end) = (self.length(), self.start, self.end);
        std::array::from_fn(|i| {
            let rise = end.integrals[i] - start.integrals[i];
            let (early, late) = (length * start.rates[i], length * end.rates[i]);
            let bend = (1.0 - s) * (early - rise) + s * (rise - late);
            start.integrals[i] + s * rise + s * (1.0 - s) * bend
        })
    }
}

/// How much work `segments` segments may take to advance by `duration` (s).
fn effort(segments: usize, duration: f64) -> Effort {
    let iterations = EFFORT / (segments + SEGMENTS_OF_OVERHEAD) as f64;
    Effort { iterations: iterations.min(MAX_ITERATIONS) as usize, duration }
}

/// Position and velocity of the root at `time`.
fn root<M: ClampMotion, W>(filament: &Filament<M, W>, time: f64) -> [[f64; 3]; 2] {
    let Clamp { position, velocity, .. } = filament.motion.at(time);
    [position, velocity]
}

/// The work that a pass may spend, and the free flight after it, in Newton iterations of one segment: some three seconds of one core. Nearly all passes end with
/// a hundredth of it (docs/integrators.md).
const EFFORT: f64 = 4e7;
/// The overhead of an iteration, expressed in segments.
const SEGMENTS_OF_OVERHEAD: usize = 2;
/// Newton iterations of a pass with few segments: the work around them matters too.
const MAX_ITERATIONS: f64 = 2.5e6;
/// Largest number of repetitions of a step until its end lies on an event: first by Newton's method, then by bisection to
/// rounding.
const MAX_NEWTON_LANDINGS: usize = 12;
const MAX_LANDINGS: usize = 60;
/// Points inside a step at which a contact that may close and open again is checked.
const INNER_POINTS: usize = 8;
/// The largest number of such points where a filament may pass an edge, which is a small target.
const MAX_INNER_POINTS: usize = 512;

/// Integrates `system` from `start` to `end_time` (s) and shows each accepted step to `observe`.
///
/// Steps end where a node closes or opens, located to [`Filament::event_tolerance`].
///
/// Between steps, segments near a pole of their coordinates switch to their other chart. A state records its charts
/// ([`FilamentState::charts`]). Nodes and energies do not depend on them.
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
    let mut stepper = Stepper::new(tableau, system.filament(0).stage_solution(), system.blocks());
    stepper.set_tolerances(0, tolerances);
    trajectory.finish(system, &mut stepper, &mut observe)?;
    Ok(trajectory.into_end())
}

/// The trajectory of one filament, advanced by steps that the caller attempts.
///
/// [`Trajectory::next_step`] gives the step to attempt from [`Trajectory::start`]; [`Trajectory::conclude`] takes its
/// outcome.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// The times in s between which it is followed for now.
    begin_time: f64,
    end_time: f64,
    /// Whether it ends earlier: as soon as no contact is closed.
    while_touching: bool,
    tolerances: Tolerances,
    /// How deep a node may be past its event at the end of a step, in m.
    location: f64,
    /// The same where the work is limited.
    coarse_location: f64,
    control: StepControl,
    contact_events: usize,
    chart_changes: usize,
    start: FilamentState,
    end: FilamentState,
    start_nodes: Nodes,
    end_nodes: Nodes,
    closed: Vec<bool>,
    /// The segment at which each contact with an edge is at the start, if it is closed.
    starts: Vec<usize>,
    /// The energy that each closed contact stored when it closed, in J.
    stored: Vec<f64>,
    phase: Phase,
    stop: Option<Stop>,
}

/// The nodes at one time.
#[derive(Clone, Debug)]
struct Nodes {
    knots: Vec<Knot<3>>,
    /// Upper bound on their speeds relative to the workpiece, in m/s.
    speed: f64,
    /// Lower bounds on how far the contacts are from their events, in m; zero where nothing is known.
    distances: Vec<f64>,
}

impl Nodes {
    /// The nodes in `knots`, without speed and without the distances of `contacts` contacts.
    fn new(knots: Vec<Knot<3>>, contacts: usize) -> Self {
        Self { knots, speed: f64::INFINITY, distances: vec![0.0; contacts] }
    }

    /// Bounds the speeds of the nodes at `time`, if the workpiece moves at one velocity everywhere.
    fn bound_speed<M: ClampMotion, W: Workpiece>(&mut self, filament: &Filament<M, W>, time: f64) {
        if !filament.workpiece.translates() {
            return;
        }
        let square = self.knots.iter().map(|knot| dot(knot.rate, knot.rate)).fold(0.0, f64::max);
        let tip = self.knots[self.knots.len() - 1].value;
        let surface = filament.workpiece.surface(tip, time).velocity;
        self.speed = square.sqrt() + dot(surface, surface).sqrt();
    }
}

/// The purpose of the next attempt.
#[derive(Clone, Copy, Debug)]
enum Phase {
    /// To advance.
    Advance(Proposal),
    /// To end on an event.
    Land(Landing),
}

/// The search for the step that ends on an event: within half of the tolerance or, if rounding prevents that, at the first
/// instant after the event.
#[derive(Clone, Copy, Debug)]
struct Landing {
    crossing: Crossing,
    /// Lengths of steps that end before and after the event, in s.
    low: f64,
    high: f64,
    /// The length to try next.
    length: f64,
    attempts: usize,
}

impl Trajectory {
    /// A trajectory from `start` to `end_time` (s). The nodes closed in `system` are closed at its start.
    pub fn new<M: ClampMotion, W: Workpiece>(
        system: &mut FilamentSystem<M, W>,
        mut start: FilamentState,
        end_time: f64,
        tableau: &Tableau,
        tolerances: Tolerances,
    ) -> Self {
        let (n, contacts) = (system.blocks(), system.filament(0).contacts());
        let duration = end_time - start.time;
        let control = StepControl::new(tableau, 1e-3 * duration).within(effort(n, duration));
        let chart_changes = start.leave_poles();
        let none = Knot { value: [0.0; 3], rate: [0.0; 3], acceleration: [0.0; 3] };
        let mut start_nodes = Nodes::new(vec![none; n], contacts);
        system.track(&start, &mut start_nodes.knots);
        start_nodes.bound_speed(system.filament(0), start.time);
        let location = system.filament(0).event_tolerance(tolerances.relative, start.time);
        let mut trajectory = Self {
            begin_time: start.time,
            end_time,
            while_touching: false,
            tolerances,
            location,
            coarse_location: system.filament(0).coarse_event_tolerance(tolerances.relative).max(location),
            phase: Phase::Advance(control.propose(start.time, end_time)),
            control,
            contact_events: 0,
            chart_changes,
            end: start.clone(),
            start,
            end_nodes: start_nodes.clone(),
            start_nodes,
            closed: (0..contacts).map(|contact| system.is_closed(0, contact)).collect(),
            starts: vec![0; contacts - n],
            stored: vec![0.0; contacts],
            stop: None,
        };
        trajectory.locate(system.filament(0));
        trajectory
    }

    /// The same, which ends with [`IntegrationError::Stopped`] once `stop` is requested.
    #[must_use]
    pub fn until(self, stop: Option<Stop>) -> Self {
        Self { stop, ..self }
    }

    /// Goes on to `end_time` (s) or, `while_touching`, only until no contact is closed. The work is limited anew.
    pub fn go_on(&mut self, end_time: f64, while_touching: bool) {
        self.begin_time = self.start.time;
        self.end_time = end_time;
        self.while_touching = while_touching;
        let duration = end_time - self.start.time;
        if duration > 0.0 {
            self.control.renew(effort(self.start_nodes.knots.len(), duration));
        }
    }

    /// Whether a contact is closed.
    pub fn is_touching(&self) -> bool {
        self.closed.contains(&true)
    }

    /// Finds the segments that touch edges at the start.
    fn locate<M: ClampMotion, W: Workpiece>(&mut self, filament: &Filament<M, W>) {
        for edge in 0..self.starts.len() {
            let contact = self.start_nodes.knots.len() + edge;
            if self.closed[contact] {
                let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, 0.0);
                self.starts[edge] = filament.touch(contact, &nodes, None, self.start.time).station.segment;
            }
        }
    }

    /// The state from which the next step starts.
    pub fn start(&self) -> &FilamentState {
        &self.start
    }

    /// Prepares the next step in `lane` of `stepper`.
    pub fn prepare<T: Lanewise>(&self, lane: usize, stepper: &mut Stepper<T, COORDINATES, COUNT>) {
        stepper.set_start(lane, &self.start);
        stepper.set_allowed_error(lane, self.control.allowed_error());
    }

    /// Closes in `lane` of `system` the contacts that are closed in this trajectory.
    pub fn enter<M: ClampMotion, W: Workpiece, T: Compiled>(&self, lane: usize, system: &mut FilamentSystem<M, W, T>) {
        for (contact, &closed) in self.closed.iter().enumerate() {
            system.set_closed(lane, contact, closed);
        }
        for (edge, &start) in self.starts.iter().enumerate() {
            system.set_start(lane, self.start_nodes.knots.len() + edge, start);
        }
    }

    /// The scales against which errors are measured.
    pub fn tolerances(&self) -> Tolerances {
        self.tolerances
    }

    /// The final state, and the work done.
    pub fn into_end(self) -> (FilamentState, Statistics) {
        let statistics = self.statistics();
        (self.start, statistics)
    }

    /// The work done so far.
    pub fn statistics(&self) -> Statistics {
        Statistics::new(self.control.work(), self.contact_events, self.chart_changes)
    }

    /// The length in s of the step to attempt next; `None` at the end.
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
        if self.control.is_exhausted() {
            let steps = self.control.work().steps;
            let share = (time - self.begin_time) / (self.end_time - self.begin_time);
            return Err(IntegrationError::TooManySteps { steps, share, step: self.control.step() });
        }
        self.start.check(system)?;
        let proposal = self.control.propose(time, self.end_time);
        self.phase = Phase::Advance(proposal);
        Ok(Some(proposal.step))
    }

    /// Takes the outcome of the attempt that [`Trajectory::next_step`] asked for, made in `lane` of `stepper` and
    /// `system`. Accepted steps are shown to `observe`.
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
                self.end_nodes.bound_speed(filament, self.end.time);
                let crossing = self.first_crossing(filament);
                if let Some(crossing) = crossing
                    && crossing.after > 0.0
                {
                    let Crossing { after, past, .. } = crossing;
                    self.phase = Phase::Land(Landing { crossing, low: 0.0, high: past, length: after, attempts: 0 });
                    return Ok(());
                }
                crossing
            }
            Phase::Land(landing) => {
                // Whatever the result of the landing, the next proposal starts anew.
                if let Err(cause) = outcome {
                    self.phase = Phase::Advance(self.control.propose(self.start.time, self.end_time));
                    self.control.retreat(self.start.time, landing.crossing.after, cause)?;
                    return Ok(());
                }
                system.nodes(lane, &mut self.end_nodes.knots);
                self.end_nodes.bound_speed(system.filament(lane), self.end.time);
                self.end_nodes.distances.fill(0.0);
                if let Some(next) = self.correct(landing, system.filament(lane)) {
                    self.phase = Phase::Land(next);
                    return Ok(());
                }
                Some(landing.crossing)
            }
        };
        self.phase = Phase::Advance(self.control.propose(self.start.time, self.end_time));
        // A node that is already past its event, because another event ended the last step, switches immediately.
        if crossing.is_none_or(|crossing| crossing.after > 0.0) {
            observe(&self.step());
            std::mem::swap(&mut self.start, &mut self.end);
            std::mem::swap(&mut self.start_nodes, &mut self.end_nodes);
            self.chart_changes += self.start.leave_poles();
            if system.carries_variation() {
                self.start.rescale_variation();
            }
        }
        if let Some(Crossing { contact, .. }) = crossing {
            self.switch(contact, lane, system);
            for other in 0..self.closed.len() {
                // Where a node leaves a face, an edge takes over, and the other way round.
                if other != contact && !self.starts.is_empty() && self.is_past(other, system.filament(lane)) {
                    self.switch(other, lane, system);
                }
            }
        }
        if !self.starts.is_empty() {
            self.locate(system.filament(lane));
            self.enter(lane, system);
        }
        Ok(())
    }

    /// Closes or opens `contact` at the start of the next step.
    fn switch<M: ClampMotion, W: Workpiece, T: Compiled>(
        &mut self,
        contact: usize,
        lane: usize,
        system: &mut FilamentSystem<M, W, T>,
    ) {
        self.keep_account(contact, system.filament(lane));
        self.closed[contact] = !self.closed[contact];
        self.start_nodes.distances[contact] = 0.0;
        system.set_closed(lane, contact, self.closed[contact]);
        self.contact_events += 1;
    }

    /// Whether `contact` presses at the start although it is open, or the other way round.
    fn is_past<M: ClampMotion, W: Workpiece>(&self, contact: usize, filament: &Filament<M, W>) -> bool {
        let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, 0.0);
        self.excess(contact, filament, &nodes, self.start.time) > -self.location
    }

    /// How far `contact` is past its event, in m; see [`excess`]. `nodes` are those of the filament at `time`.
    fn excess<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
        nodes: &dyn Fn(usize) -> [[f64; 3]; 2],
        time: f64,
    ) -> f64 {
        let pressing = filament.law.pressing(&filament.touch(contact, nodes, None, time).approach);
        excess(self.closed[contact], pressing, self.location)
    }

    /// Integrates alone to the end, or to where [`Trajectory::go_on`] has sent it. `stepper` has its [tolerances](Self::tolerances).
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
            system.set_charts(&self.start.charts);
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

    /// Adds what is lost when `contact` opens while it is still pressed in, because it recedes so fast that its damping
    /// would pull: its elastic energy does no more work. When such a contact closes again before it has come out, it gets that
    /// energy back.
    fn keep_account<M: ClampMotion, W: Workpiece>(&mut self, contact: usize, filament: &Filament<M, W>) {
        let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, 0.0);
        let Touch { approach, .. } = filament.touch(contact, &nodes, None, self.start.time);
        let stored = if approach.penetration > 0.0 { filament.law.stored_energy(&approach) } else { 0.0 };
        if self.closed[contact] {
            self.start.integrals[CONTACT_DISSIPATION] += stored - self.stored[contact];
        } else {
            self.stored[contact] = stored;
        }
    }

    /// The earliest event of the step. Finds out how far the contacts are from their events at its end.
    fn first_crossing<M: ClampMotion, W: Workpiece>(&mut self, filament: &Filament<M, W>) -> Option<Crossing> {
        let mut distances = std::mem::take(&mut self.end_nodes.distances);
        let step = self.step();
        // With contact damping a node's speed alone can make it cross.
        let undamped = filament.law.damping == 0.0;
        let reach = 2.0 * step.length() * (self.start_nodes.speed + self.end_nodes.speed);
        let mut first: Option<Crossing> = None;
        for (contact, end) in distances.iter_mut().enumerate() {
            let start = self.start_nodes.distances[contact];
            if undamped && start > reach {
                *end = start - reach;
                continue;
            }
            let (distance, crossing) = if contact < self.start_nodes.knots.len() {
                node_crossing(filament, &step, contact, self.location)
            } else {
                edge_crossing(filament, &step, contact, self.location, reach)
            };
            *end = distance;
            if let Some(crossing) = crossing
                && first.is_none_or(|first| crossing.after < first.after)
            {
                first = Some(crossing);
            }
        }
        self.end_nodes.distances = distances;
        first
    }

    /// The next landing after the attempt of `landing`; `None` if that was close enough to the event.
    fn correct<M: ClampMotion, W: Workpiece>(&self, landing: Landing, filament: &Filament<M, W>) -> Option<Landing> {
        let Landing { crossing, mut low, mut high, length, attempts } = landing;
        let location = self.location;
        // A little before the end.
        let excess = |back: f64| {
            let nodes = at_knots(filament, &self.end_nodes.knots, self.end.time, back);
            self.excess(crossing.contact, filament, &nodes, self.end.time - back)
        };
        let here = excess(0.0);
        // Where work is limited, the end of a step may lie some depth past the event, but not before it: the node would
        // switch back.
        let limited = self.control.is_at_floor(crossing.past, self.end_time - self.start.time);
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
        Some(Landing { crossing, low, high, length, attempts: attempts + 1 })
    }
}

/// The nodes of a filament a time `back` (s) before they are at `knots` at `time`, by their number from the root.
fn at_knots<M: ClampMotion, W>(
    filament: &Filament<M, W>,
    knots: &[Knot<3>],
    time: f64,
    back: f64,
) -> impl Fn(usize) -> [[f64; 3]; 2] {
    move |index| match index.checked_sub(1) {
        None => root(filament, time - back),
        Some(node) => {
            let Knot { value, rate, acceleration } = knots[node];
            [add(value, scale(-back, rate)), add(rate, scale(-back, acceleration))]
        }
    }
}

/// A contact's closing or opening inside a step.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    contact: usize,
    /// Estimated time after the start of the step in s; zero if it lies before.
    after: f64,
    /// A time after the start at which the contact is past the event, in s.
    past: f64,
}

impl Crossing {
    /// That of a contact whose excess goes from `before` to `after` in a step of the length `length` (s), and is `at` inside it. If
    /// neither is past the event, `touch` gives the fraction of the step at which it is.
    fn of(
        contact: usize,
        [before, after]: [f64; 2],
        length: f64,
        at: &impl Fn(f64) -> f64,
        touch: impl FnOnce() -> Option<f64>,
    ) -> Option<Self> {
        let past = match () {
            () if before > 0.0 => 0.0,
            () if after > 0.0 => 1.0,
            () => touch()?,
        };
        let crossing = if past == 0.0 { 0.0 } else { root_of(at, 0.0, past) };
        Some(Self { contact, after: crossing * length, past: past * length })
    }
}

/// How far a contact is past its event, in m: pressing while open, or pulling while closed, by more than `location`.
///
/// The two thresholds differ by twice `location`, so that a contact that has just switched does not switch back.
fn excess(closed: bool, pressing: f64, location: f64) -> f64 {
    (if closed { -pressing } else { pressing }) - location
}

/// Upper bound on a node's motion along the normal of the workpiece in a step of the length `length` (s), in m, from its
/// motion at `knot`. `None` where the normal may change.
fn normal_reach<M: ClampMotion, W: Workpiece>(
    filament: &Filament<M, W>,
    knot: &Knot<3>,
    time: f64,
    length: f64,
) -> Option<f64> {
    let approach = filament.approach(knot.value, knot.rate, time);
    let bend = dot(knot.acceleration, approach.normal).abs();
    let flat = approach.turn == 0.0 && approach.margin == f64::INFINITY;
    flat.then(|| length * (approach.penetration_rate.abs() + length * bend))
}

/// How far the contact of `node` is from its event at the end of a step, in m, and its event within the step, by the interpolant.
fn node_crossing<M: ClampMotion, W: Workpiece>(
    filament: &Filament<M, W>,
    step: &Step<'_>,
    node: usize,
    location: f64,
) -> (f64, Option<Crossing>) {
    let excess = |position, velocity, time| {
        let pressing = filament.law.node_pressing(&filament.workpiece, position, velocity, time);
        excess(step.closed[node], pressing, location)
    };
    let at = |s: f64| {
        let (position, velocity) = step.node(node, s);
        excess(position, velocity, step.time(s))
    };
    let (start, end) = (&step.start_nodes[node], &step.end_nodes[node]);
    let before = excess(start.value, start.rate, step.start.time);
    let after = excess(end.value, end.rate, step.end.time);
    let touch = || touch(filament, step, [start, end], -before.max(after), &at);
    (-after, Crossing::of(node, [before, after], step.length(), &at, touch))
}

/// The same of the `contact` with an edge. Points of the filament go no farther than `reach` (m) in the step.
fn edge_crossing<M: ClampMotion, W: Workpiece>(
    filament: &Filament<M, W>,
    step: &Step<'_>,
    contact: usize,
    location: f64,
    reach: f64,
) -> (f64, Option<Crossing>) {
    let closed = step.closed[contact];
    let of = |touch: &Touch| excess(closed, filament.law.pressing(&touch.approach), location);
    let ends = [(step.start_nodes, step.start.time), (step.end_nodes, step.end.time)];
    let [start, end] =
        ends.map(|(knots, time)| filament.touch(contact, &at_knots(filament, knots, time, 0.0), None, time));
    // While it is open, what separates it from its event is at least its gap.
    let distance = |touch: &Touch| if closed { 0.0 } else { (location - touch.approach.penetration).max(0.0) };
    let nearest = start.station.segment;
    let at = |s: f64| of(&filament.touch(contact, &step.nodes(filament, s), Some(nearest), step.time(s)));
    let touch = || {
        if filament.law.damping == 0.0 && distance(&start).max(distance(&end)) > reach {
            return None;
        }
        let radius = filament.workpiece.edges()[contact - step.start_nodes.len()].radius();
        let points = (2.0 * reach / radius).clamp(INNER_POINTS as f64, MAX_INNER_POINTS as f64) as usize;
        highest_inside(&at, points, (filament.law.damping == 0.0).then_some(reach))
    };
    (distance(&end), Crossing::of(contact, [of(&start), of(&end)], step.length(), &at, touch))
}

/// The fraction of a step at which `at` is highest, if it is positive there, from `points` points inside the step. In the whole step
/// it rises by no more than `reach`, if that is known.
fn highest_inside(at: &impl Fn(f64) -> f64, points: usize, reach: Option<f64>) -> Option<f64> {
    let spacing = 1.0 / points as f64;
    let inner = (1..points).map(|i| i as f64 * spacing).map(|s| (s, at(s)));
    let (best, highest) = inner.max_by(|a, b| a.1.total_cmp(&b.1)).expect("there are inner points");
    if reach.is_some_and(|reach| -highest > spacing * reach) {
        return None;
    }
    let (peak, highest) = maximise(at, best - spacing, best + spacing);
    (highest > 0.0).then_some(peak)
}

/// The fraction of a step at which a node that is before its event at the `ends`, by at least `gap` (m), is past it; `at` is
/// its excess by the fraction.
fn touch<M: ClampMotion, W: Workpiece>(
    filament: &Filament<M, W>,
    step: &Step<'_>,
    ends: [&Knot<3>; 2],
    gap: f64,
    at: &impl Fn(f64) -> f64,
) -> Option<f64> {
    // Search for this only if the node can move that far within the step: check first by its speed, then by the component
    // along the normal. (With contact damping its speed alone can make it cross.)
    let (length, undamped) = (step.length(), filament.law.damping == 0.0);
    let speed = |knot: &Knot<3>| dot(knot.rate, knot.rate).sqrt();
    let [start, end] = ends;
    if undamped && gap > length * (speed(start) + speed(end)) {
        return None;
    }
    let reach = normal_reach(filament, start, step.start.time, length)
        .zip(normal_reach(filament, end, step.end.time, length))
        .map(|(start, end)| start + end);
    if undamped && reach.is_some_and(|reach| gap > reach) {
        return None;
    }
    highest_inside(at, INNER_POINTS, reach.filter(|_| undamped))
}
