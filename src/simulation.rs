//! One filament's pass over the workpiece: integration through located contact events.

use serde::Serialize;

use crate::contact::{Approach, Contact, ContactLaw};
use crate::equations::linear::{add, dot, scale};
use crate::equations::{Chain, Dynamics, Energies, PolarAxis, StepWeights, find_pole, near_pole};
use crate::filament;
use crate::integrate::hermite::{Knot, interpolate};
use crate::integrate::tableau::{ESDIRK43, Tableau};
use crate::integrate::{
    IntegrationError, Integrator, RejectionCause, SecondOrderSystem, State, Statistics, Tolerances,
};
use crate::metrics::{ContactRecord, Metrics, NominalContact, tip_deflection};
use crate::settings::Settings;
use crate::tool::{ClampMotion, RoundTool};
use crate::workpiece::{Plane, Workpiece};

/// What is integrated beside the motion, by index into [`State::integrals`].
pub mod integral {
    /// Contact normal impulse `∫ F_n dt` in N s.
    pub const NORMAL_IMPULSE: usize = 0;
    /// Energy taken by the dampers of the joints in J.
    pub const JOINT_DISSIPATION: usize = 1;
    /// Energy taken by contact damping and friction in J.
    pub const CONTACT_DISSIPATION: usize = 2;
    /// Work put in by the clamp and by a moving workpiece in J.
    pub const WORK: usize = 3;
    /// How many there are.
    pub const COUNT: usize = 4;
}

use integral::COUNT;

/// The state of a filament, with the integrals of [`integral`].
pub type FilamentState = State<COUNT>;

/// A filament in contact: its equations, the motion of its clamp, and which of its nodes are closed.
#[derive(Clone, Debug)]
pub struct FilamentSystem<M, W> {
    dynamics: Dynamics<f64>,
    motion: M,
    contact: Contact<W>,
    tracks_energy: bool,
    scratch: Vec<[f64; 2]>,
}

impl<M: ClampMotion, W: Workpiece> FilamentSystem<M, W> {
    /// The filament `chain`, clamped to `motion`, that meets `workpiece` under `law`.
    ///
    /// With `tracks_energy` all of [`integral`] is integrated, else only the impulse.
    pub fn new(chain: Chain<f64>, motion: M, law: ContactLaw, workpiece: W, tracks_energy: bool) -> Self {
        let n = chain.segments;
        Self {
            dynamics: Dynamics::new(chain),
            motion,
            contact: Contact::new(law, workpiece, n),
            tracks_energy,
            scratch: vec![[0.0; 2]; n],
        }
    }

    /// The state at `time` with the coordinates `q` about `z` and the rates `v`; nodes that press on the workpiece
    /// there are closed.
    ///
    /// Segments near the poles of `z` are turned over to their other chart, and stand in it in what is returned. At a
    /// pole itself `θ` tells the plane in which `φ` moves, and `θ̇` has no meaning.
    pub fn state(&mut self, time: f64, mut q: Vec<[f64; 2]>, mut v: Vec<[f64; 2]>) -> FilamentState {
        let mut charts = vec![PolarAxis::Z; q.len()];
        for (axis, (q, v)) in charts.iter_mut().zip(q.iter_mut().zip(&mut v)) {
            if near_pole(q[0]) {
                let direction = axis.direction([*q, *v, [0.0; 2]]);
                *axis = axis.other();
                [*q, *v, _] = axis.coordinates(direction);
            }
        }
        self.dynamics.set_charts(&charts);
        self.dynamics.place(&self.motion.at(time), &q, &v);
        let nodes = self.dynamics.positions().iter().zip(self.dynamics.velocities());
        let pressing = nodes.map(|(&position, &velocity)| {
            let approach = self.contact.approach(position, velocity, time);
            self.contact.law.pressing(&approach) > 0.0
        });
        self.contact.closed = pressing.collect();
        State::new(self, time, q, v)
    }

    /// Energies at a state.
    pub fn energies(&mut self, state: &FilamentState) -> Energies<f64> {
        let clamp = self.motion.at(state.time);
        self.dynamics.set_charts(&state.charts);
        self.dynamics.place(&clamp, &state.q, &state.v);
        self.dynamics.energies(&clamp, &state.v)
    }

    /// Energy stored in the closed contacts at a state, in J.
    pub fn contact_energy(&mut self, state: &FilamentState) -> f64 {
        self.dynamics.set_charts(&state.charts);
        self.dynamics.place(&self.motion.at(state.time), &state.q, &state.v);
        self.approaches(state.time).map(|(_, approach)| self.contact.law.stored_energy(&approach)).sum()
    }

    /// Position and approach of the closed nodes, where the dynamics were last placed.
    fn approaches(&self, time: f64) -> impl Iterator<Item = ([f64; 3], Approach)> {
        let loads = self.contact.loads(time);
        let nodes = self.dynamics.positions().iter().zip(self.dynamics.velocities()).enumerate();
        nodes.filter_map(move |(node, (&position, &velocity))| {
            Some((position, loads.approach(node, position, velocity)?))
        })
    }

    /// How deep a node may be past its event where a step ends, in m.
    fn event_tolerance(&self, relative: f64, state: &FilamentState) -> f64 {
        let chain = self.dynamics.chain();
        let length = chain.length * chain.segments as f64;
        // c h = E I
        let force = chain.joint_stiffness * chain.length / (length * length);
        let by_force = (relative * force / self.contact.law.stiffness).powf(1.0 / self.contact.law.exponent);
        let [x, y, z] = self.motion.at(state.time).position;
        let rounding = 4.0 * f64::EPSILON * (length + x.hypot(y).hypot(z));
        (1e-4 * relative * length).min(by_force).max(rounding)
    }

    /// Position, velocity and acceleration of every node at a state.
    fn track(&mut self, state: &FilamentState, knots: &mut [Knot<3>]) {
        let mut scratch = std::mem::take(&mut self.scratch);
        self.dynamics.set_charts(&state.charts);
        self.residual(state.time, &state.q, &state.v, &state.accelerations, &mut scratch);
        self.scratch = scratch;
        for (node, knot) in knots.iter_mut().enumerate() {
            *knot = Knot {
                value: self.dynamics.positions()[node],
                rate: self.dynamics.velocities()[node],
                acceleration: self.dynamics.node_acceleration(node, &state.accelerations),
            };
        }
    }
}

impl<M: ClampMotion, W: Workpiece> SecondOrderSystem<COUNT> for FilamentSystem<M, W> {
    fn pairs(&self) -> usize {
        self.dynamics.chain().segments
    }

    fn accelerations(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &mut [[f64; 2]]) {
        let loads = self.contact.loads(time);
        self.dynamics.accelerations(&self.motion.at(time), q, v, &loads, accelerations);
    }

    fn residual(
        &mut self,
        time: f64,
        q: &[[f64; 2]],
        v: &[[f64; 2]],
        accelerations: &[[f64; 2]],
        residual: &mut [[f64; 2]],
    ) {
        let loads = self.contact.loads(time);
        self.dynamics.residual(&self.motion.at(time), q, v, accelerations, &loads, residual);
    }

    fn factorise(&mut self, time: f64, v: &[[f64; 2]], accelerations: &[[f64; 2]], weights: StepWeights<f64>) {
        let loads = self.contact.loads(time);
        self.dynamics.factorise(&self.motion.at(time), v, accelerations, &loads, weights);
    }

    fn solve(&mut self, right_side: &mut [[f64; 2]]) {
        self.dynamics.solve(right_side);
    }

    fn rates(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &[[f64; 2]]) -> [f64; COUNT] {
        let mut rates = [0.0; COUNT];
        let in_contact = self.contact.closed.contains(&true);
        let clamp = self.motion.at(time);
        if self.tracks_energy {
            let mut scratch = std::mem::take(&mut self.scratch);
            self.residual(time, q, v, accelerations, &mut scratch);
            self.scratch = scratch;
            let energies = self.dynamics.energies(&clamp, v);
            rates[integral::JOINT_DISSIPATION] = 2.0 * energies.dissipation;
            rates[integral::WORK] = dot(self.dynamics.root_force(), clamp.velocity) + energies.clamp_torque_power;
        } else if in_contact {
            self.dynamics.place(&clamp, q, v);
        }
        for (position, approach) in self.approaches(time) {
            // The smooth law, also where it pulls: stages of a step that ends on an opening can lie past it.
            let force = self.contact.law.force(&approach);
            rates[integral::NORMAL_IMPULSE] += force.normal;
            if self.tracks_energy {
                let surface = self.contact.workpiece.surface(position, time);
                rates[integral::CONTACT_DISSIPATION] += self.contact.law.dissipated_power(&approach);
                rates[integral::WORK] += dot(force.total(&approach), surface.velocity);
            }
        }
        rates
    }

    fn charts(&self) -> &[PolarAxis] {
        self.dynamics.charts()
    }

    fn set_charts(&mut self, charts: &[PolarAxis]) {
        self.dynamics.set_charts(charts);
    }

    fn pole(&self, q: &[[f64; 2]]) -> Option<usize> {
        find_pole(q)
    }
}

/// An accepted step, for whoever watches the integration.
#[derive(Debug)]
pub struct Step<'a> {
    /// Where it starts.
    pub start: &'a FilamentState,
    /// Where it ends.
    pub end: &'a FilamentState,
    /// The nodes at its start.
    pub start_nodes: &'a [Knot<3>],
    /// The nodes at its end.
    pub end_nodes: &'a [Knot<3>],
    /// Which nodes are closed throughout.
    pub closed: &'a [bool],
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

/// More steps than this in one pass are taken for a failure.
const MAX_STEPS: usize = 300_000;
/// Repetitions of a step until its end lies on an event: some by Newton's method, then by bisection to rounding.
const MAX_NEWTON_LANDINGS: usize = 12;
const MAX_LANDINGS: usize = 60;
/// Points inside a step at which a node that may touch and leave again is looked at.
const INNER_POINTS: usize = 8;

/// Integrates `system` from `start` to `end_time` (s) and shows each accepted step to `observe`.
///
/// Steps end where a node closes or opens, located to a penetration of `1e-4 × relative tolerance × filament length`,
/// or to less where the contact is so stiff that this would be a force above `relative tolerance × E I/l_f²`.
///
/// Between steps, segments that come near a pole of their coordinates are turned over to their other chart: the states
/// that are shown and returned say which one they are in ([`State::charts`]). Nodes and energies do not depend on it.
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
    let n = system.pairs();
    let location = system.event_tolerance(tolerances.relative, &start);
    let mut integrator = Integrator::new(tableau, tolerances, n, 1e-3 * (end_time - start.time));
    let none = Knot { value: [0.0; 3], rate: [0.0; 3], acceleration: [0.0; 3] };
    let (mut start_nodes, mut end_nodes) = (vec![none; n], vec![none; n]);
    let mut start = start;
    integrator.count_chart_changes(start.leave_poles());
    let mut end = start.clone();
    system.track(&start, &mut start_nodes);
    while start.time < end_time {
        let steps = integrator.statistics().steps;
        if steps >= MAX_STEPS {
            return Err(IntegrationError::TooManySteps { steps, time: start.time, step: integrator.step() });
        }
        integrator.advance(system, &start, &mut end, end_time)?;
        system.track(&end, &mut end_nodes);
        let step = Step {
            start: &start,
            end: &end,
            start_nodes: &start_nodes,
            end_nodes: &end_nodes,
            closed: &system.contact.closed,
        };
        let crossing = first_crossing(system, &step, location);
        // A node that is past its event already, because another one ended the last step, switches on the spot.
        let on_the_spot = crossing.is_some_and(|crossing| crossing.after == 0.0);
        if let Some(crossing) = crossing
            && !on_the_spot
            && let Err(cause) = land(&mut integrator, system, &start, &mut end, &mut end_nodes, crossing, location)
        {
            integrator.retreat(start.time, crossing.after, cause)?;
            continue;
        }
        if !on_the_spot {
            observe(&Step {
                start: &start,
                end: &end,
                start_nodes: &start_nodes,
                end_nodes: &end_nodes,
                closed: &system.contact.closed,
            });
            std::mem::swap(&mut start, &mut end);
            std::mem::swap(&mut start_nodes, &mut end_nodes);
            integrator.count_chart_changes(start.leave_poles());
        }
        if let Some(Crossing { node, .. }) = crossing {
            let closed = &mut system.contact.closed[node];
            *closed = !*closed;
            integrator.count_event();
        }
    }
    Ok((start, *integrator.statistics()))
}

/// Where a node closes or opens inside a step.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    node: usize,
    /// Estimated time after the start of the step in s; zero if it lies before.
    after: f64,
    /// A time after the start at which the node is past the event, in s.
    past: f64,
}

/// How far a node is past its event, in m: pressing while open, or pulling while closed, by more than `location`.
///
/// The two thresholds differ by twice `location`, so that a node that has just switched does not switch back.
fn excess<M, W: Workpiece>(
    system: &FilamentSystem<M, W>,
    node: usize,
    position: [f64; 3],
    velocity: [f64; 3],
    time: f64,
    location: f64,
) -> f64 {
    let approach = system.contact.approach(position, velocity, time);
    let pressing = system.contact.law.pressing(&approach);
    (if system.contact.closed[node] { -pressing } else { pressing }) - location
}

/// The earliest event of a step, by its interpolant.
fn first_crossing<M, W: Workpiece>(system: &FilamentSystem<M, W>, step: &Step<'_>, location: f64) -> Option<Crossing> {
    let mut first: Option<Crossing> = None;
    for node in 0..step.closed.len() {
        let at = |s: f64| {
            let (position, velocity) = step.node(node, s);
            excess(system, node, position, velocity, step.time(s), location)
        };
        let (before, after) = (at(0.0), at(1.0));
        let past = if before > 0.0 {
            0.0
        } else if after > 0.0 {
            1.0
        } else {
            // The node may cross and come back: only worth a look if it moves that far within the step. (With contact
            // damping its speed alone can make it cross.)
            let speed = |knots: &[Knot<3>]| dot(knots[node].rate, knots[node].rate).sqrt();
            let reach = step.length() * (speed(step.start_nodes) + speed(step.end_nodes));
            if system.contact.law.damping == 0.0 && before.max(after) < -reach {
                continue;
            }
            let inner = (1..INNER_POINTS).map(|i| i as f64 / INNER_POINTS as f64);
            let best = inner.max_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap_or(0.5);
            let spacing = 1.0 / INNER_POINTS as f64;
            let peak = maximise(at, best - spacing, best + spacing);
            if at(peak) <= 0.0 {
                continue;
            }
            peak
        };
        let crossing = if past == 0.0 { 0.0 } else { root(at, 0.0, past) };
        let after = crossing * step.length();
        if first.is_none_or(|first| after < first.after) {
            first = Some(Crossing { node, after, past: past * step.length() });
        }
    }
    first
}

/// Repeats the step until it ends on the event, to within half of `location`; where rounding does not allow that, on
/// the first instant after it.
fn land<M: ClampMotion, W: Workpiece>(
    integrator: &mut Integrator<COUNT>,
    system: &mut FilamentSystem<M, W>,
    start: &FilamentState,
    end: &mut FilamentState,
    end_nodes: &mut [Knot<3>],
    crossing: Crossing,
    location: f64,
) -> Result<(), RejectionCause> {
    let Crossing { node, after, past } = crossing;
    let (mut low, mut high, mut length) = (0.0, past, after);
    for landing in 0..MAX_LANDINGS {
        integrator.repeat(system, start, end, length)?;
        system.track(end, end_nodes);
        let Knot { value, rate, acceleration } = end_nodes[node];
        let here = excess(system, node, value, rate, end.time, location);
        let resolved = high - low <= 4.0 * f64::EPSILON * (start.time.abs() + high);
        if here.abs() <= location / 2.0 || (resolved && here > 0.0) {
            break;
        }
        if here > 0.0 {
            high = length
        } else {
            low = length
        }
        // Newton's method inside the bracket, with the slope over a small part of the step.
        let back = 1e-4 * length;
        let earlier = add(value, scale(-back, rate));
        let slower = add(rate, scale(-back, acceleration));
        let slope = (here - excess(system, node, earlier, slower, end.time - back, location)) / back;
        let next = length - here / slope;
        let inside = next > low && next < high && landing < MAX_NEWTON_LANDINGS;
        length = match () {
            () if resolved => high,
            () if inside => next,
            () => (low + high) / 2.0,
        };
    }
    Ok(())
}

/// A zero of `f` between `low`, where it is negative, and `high`, where it is positive (Illinois method).
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut below, mut above) = (f(low), f(high));
    let mut middle = high;
    let mut last_side = 0;
    for _ in 0..60 {
        middle = (low * above - high * below) / (above - below);
        if !(middle > low && middle < high) {
            return if middle.is_finite() { middle.clamp(low, high) } else { high };
        }
        let value = f(middle);
        if value > 0.0 {
            (high, above) = (middle, value);
            if last_side == 1 {
                below /= 2.0;
            }
            last_side = 1;
        } else {
            (low, below) = (middle, value);
            if last_side == -1 {
                above /= 2.0;
            }
            last_side = -1;
        }
        if high - low < 1e-14 {
            break;
        }
    }
    middle
}

/// Where `f` is largest between `low` and `high` (golden-section search).
fn maximise(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    while high - low > 1e-6 {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - golden * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + golden * (high - low);
            at_right = f(right);
        }
    }
    (low + high) / 2.0
}

/// The largest value of a smooth `f` on a step, if it may exceed `least`.
fn maximum_in_step(f: impl Fn(f64) -> f64, least: f64) -> f64 {
    let samples: [f64; 5] = std::array::from_fn(|i| f(i as f64 / 4.0));
    let (best, &value) = samples.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("there are samples");
    let smallest = samples.iter().copied().fold(f64::INFINITY, f64::min);
    // Between samples a parabola rises by no more than the samples differ.
    if value + (value - smallest) <= least {
        return least;
    }
    let centre = best as f64 / 4.0;
    let peak = maximise(&f, (centre - 0.25).max(0.0), (centre + 0.25).min(1.0));
    least.max(value).max(f(peak))
}

/// Reduces the steps of a pass to what the metrics need.
struct ContactObserver<'a, M, W> {
    motion: &'a M,
    law: &'a ContactLaw,
    workpiece: &'a W,
    filament_length: f64,
    nominal_entry: f64,
    nominal_exit: f64,
    record: ContactRecord,
    was_closed: bool,
}

impl<M: ClampMotion, W: Workpiece> ContactObserver<'_, M, W> {
    fn observe(&mut self, step: &Step<'_>) {
        let closed = step.closed.contains(&true);
        if closed {
            self.record.time += step.length();
            let nominal = step.end.time.min(self.nominal_exit) - step.start.time.max(self.nominal_entry);
            self.record.nominal_time += nominal.max(0.0);
            self.record.count += usize::from(!self.was_closed);
            self.record.peak_force = maximum_in_step(|s| self.normal_force(step, s), self.record.peak_force);
        }
        self.was_closed = closed;
        // A touch whose force underflows can leave less than zero.
        self.record.impulse = step.end.integrals[integral::NORMAL_IMPULSE].max(0.0);
        self.record.max_deflection = maximum_in_step(|s| self.deflection(step, s), self.record.max_deflection);
    }

    fn normal_force(&self, step: &Step<'_>, s: f64) -> f64 {
        self.forces(step, s).0
    }

    /// Sums over the nodes of the normal and of the tangential force, in N.
    fn forces(&self, step: &Step<'_>, s: f64) -> (f64, f64) {
        let mut normal = 0.0;
        let mut tangential = [0.0; 3];
        for node in (0..step.closed.len()).filter(|&node| step.closed[node]) {
            let (position, velocity) = step.node(node, s);
            let approach = self.law.approach(self.workpiece, position, velocity, step.time(s));
            let force = self.law.pressing_force(&approach);
            normal += force.normal;
            tangential = add(tangential, force.tangential);
        }
        (normal, dot(tangential, tangential).sqrt())
    }

    fn deflection(&self, step: &Step<'_>, s: f64) -> f64 {
        let clamp = self.motion.at(step.time(s));
        let (tip, _) = step.node(step.closed.len() - 1, s);
        tip_deflection(tip, clamp.position, clamp.direction, self.filament_length)
    }
}

/// One row of a time history.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Time in s; zero at the start of the pass.
    pub time_s: f64,
    /// Angle `β` of the brush body in rad.
    pub base_angle_rad: f64,
    /// `F_n`, the sum over the nodes, in N.
    pub contact_normal_force_n: f64,
    /// Friction, the magnitude of the sum over the nodes, in N.
    pub contact_tangential_force_n: f64,
    /// Tip deflection `s_n` in m.
    pub tip_deflection_m: f64,
    /// Tip position in m.
    pub tip_x_m: f64,
    /// Tip position in m.
    pub tip_y_m: f64,
    /// Tip position in m.
    pub tip_z_m: f64,
    /// `E_kin` in J.
    pub kinetic_energy_j: f64,
    /// `E_spring + E_grav` in J.
    pub potential_energy_j: f64,
    /// Energy taken so far by joint dampers, contact damping and friction, in J.
    pub dissipated_energy_j: f64,
}

impl Sample {
    /// True if every value is a finite number.
    fn is_finite(&self) -> bool {
        let energies = [self.kinetic_energy_j, self.potential_energy_j, self.dissipated_energy_j];
        let tip = [self.tip_x_m, self.tip_y_m, self.tip_z_m, self.tip_deflection_m];
        let forces = [self.contact_normal_force_n, self.contact_tangential_force_n];
        energies.iter().chain(&tip).chain(&forces).all(|value| value.is_finite())
    }
}

/// The result of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// The metrics of the contact.
    pub metrics: Metrics,
    /// Work done.
    pub statistics: Statistics,
    /// Equally spaced samples, if they were asked for.
    pub history: Vec<Sample>,
}

/// Why a pass could not be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The integration stopped.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// A metric or a sample is infinite or not a number.
    #[error("the results of the pass are not finite; are the settings of extreme size?")]
    NotFinite,
}

/// Simulates one pass and reduces it to its metrics.
///
/// # Errors
/// If the integration cannot go on; nothing is returned that is not finite.
pub fn simulate(settings: &Settings) -> Result<Simulation, SimulationError> {
    Pass::new(settings).run(0)
}

/// Simulates one pass and samples it at `samples` equally spaced times, the first and the last instant included.
///
/// The metrics are those of [`simulate`], to the tolerance: the samples are interpolated between steps and change
/// nothing.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_with_history(settings: &Settings, samples: usize) -> Result<Simulation, SimulationError> {
    Pass::new(settings).run(samples)
}

/// One pass of the filament of a round tool over a plane: what [`simulate`] integrates.
#[derive(Clone, Debug)]
pub struct Pass {
    chain: Chain<f64>,
    tool: RoundTool,
    law: ContactLaw,
    plane: Plane,
    nominal: NominalContact,
    filament_length: f64,
    filament_count: f64,
    tolerances: Tolerances,
    lead_angle: f64,
    tail_angle: f64,
}

impl Pass {
    /// The pass that `settings` state.
    pub fn new(settings: &Settings) -> Self {
        let Settings { tool, filament, contact, workpiece, process, solver } = settings;
        let nominal = NominalContact::of(settings);
        let [x, y, _] = workpiece.normal;
        // The tips are deepest opposite to the normal; for the default plane that is β = −π/2.
        let deepest = (-y).atan2(-x);
        // A rate that is small for a vibrating filament, so that a slow tool does not ask for absurd digits.
        let slow_rate = 0.01 * filament::first_natural_frequency(filament);
        Self {
            chain: filament::chain(filament, process.gravity_m_s2),
            tool: RoundTool {
                body_radius: tool.body_radius_m,
                rate: nominal.rate(),
                initial_angle: deepest - nominal.contact_angle() / 2.0 - process.lead_angle_rad,
            },
            law: ContactLaw::from(contact),
            plane: Plane::of(workpiece, nominal.tool_radius, process.penetration_depth_m),
            nominal,
            filament_length: filament.length_m,
            filament_count: tool.filament_count,
            tolerances: Tolerances {
                relative: solver.relative_tolerance,
                angle_scale: 1.0,
                rate_scale: (nominal.brushing_velocity / filament.length_m).max(slow_rate),
            },
            lead_angle: process.lead_angle_rad,
            tail_angle: process.tail_angle_rad,
        }
    }

    /// The motion of the tool.
    pub fn tool(&self) -> &RoundTool {
        &self.tool
    }

    /// The filament and what it meets; see [`FilamentSystem::new`].
    pub fn system(&self, tracks_energy: bool) -> FilamentSystem<RoundTool, Plane> {
        FilamentSystem::new(self.chain, self.tool, self.law, self.plane, tracks_energy)
    }

    /// The start: straight, turning rigidly with the body, at time zero.
    pub fn start(&self, system: &mut FilamentSystem<RoundTool, Plane>) -> FilamentState {
        let n = self.chain.segments;
        let q = vec![[std::f64::consts::FRAC_PI_2, self.tool.initial_angle]; n];
        system.state(0.0, q, vec![[0.0, self.tool.rate]; n])
    }

    /// Time of nominal entry, of nominal exit, and of the end, in s.
    pub fn times(&self) -> [f64; 3] {
        let exit = self.lead_angle + self.nominal.contact_angle();
        [self.lead_angle, exit, exit + self.tail_angle].map(|angle| angle / self.tool.rate)
    }

    /// Integrates the pass in `system` from `start` to its end; see [`integrate`].
    ///
    /// # Errors
    /// If a step cannot be taken.
    pub fn integrate(
        &self,
        system: &mut FilamentSystem<RoundTool, Plane>,
        start: FilamentState,
        observe: impl FnMut(&Step<'_>),
    ) -> Result<(FilamentState, Statistics), IntegrationError> {
        let [_, _, end_time] = self.times();
        integrate(system, start, end_time, &ESDIRK43, self.tolerances, observe)
    }

    fn run(&self, samples: usize) -> Result<Simulation, SimulationError> {
        let [nominal_entry, nominal_exit, end_time] = self.times();
        let mut system = self.system(samples > 0);
        let start = self.start(&mut system);
        let mut observer = ContactObserver {
            motion: &self.tool,
            law: &self.law,
            workpiece: &self.plane,
            filament_length: self.filament_length,
            nominal_entry,
            nominal_exit,
            record: ContactRecord::default(),
            was_closed: false,
        };
        let mut sampler = Sampler::new(self.chain, samples, end_time);
        let (_, statistics) = self.integrate(&mut system, start, |step| {
            observer.observe(step);
            sampler.observe(step, &observer);
        })?;
        let metrics = Metrics::new(&self.nominal, &observer.record, self.filament_count);
        if !(metrics.is_finite() && sampler.history.iter().all(Sample::is_finite)) {
            return Err(SimulationError::NotFinite);
        }
        Ok(Simulation { metrics, statistics, history: sampler.history })
    }
}

/// Collects equally spaced samples from the steps of a pass.
struct Sampler {
    dynamics: Dynamics<f64>,
    samples: usize,
    end_time: f64,
    history: Vec<Sample>,
    q: Vec<[f64; 2]>,
    v: Vec<[f64; 2]>,
}

impl Sampler {
    fn new(chain: Chain<f64>, samples: usize, end_time: f64) -> Self {
        let zeros = vec![[0.0; 2]; chain.segments];
        let history = Vec::with_capacity(samples);
        Self { dynamics: Dynamics::new(chain), samples, end_time, history, q: zeros.clone(), v: zeros }
    }

    fn observe<W: Workpiece>(&mut self, step: &Step<'_>, observer: &ContactObserver<'_, RoundTool, W>) {
        while self.history.len() < self.samples {
            let intervals = self.samples.saturating_sub(1).max(1);
            // The fraction is exactly one at the last sample, which must not fall behind the end.
            let time = self.end_time * (self.history.len() as f64 / intervals as f64);
            if time > step.end.time {
                return;
            }
            let s = (time - step.start.time) / step.length();
            let clamp = observer.motion.at(time);
            step.coordinates(s, &mut self.q, &mut self.v);
            self.dynamics.set_charts(step.charts());
            self.dynamics.place(&clamp, &self.q, &self.v);
            let energies = self.dynamics.energies(&clamp, &self.v);
            let integrals = step.integrals(s);
            let ([tip_x_m, tip_y_m, tip_z_m], _) = step.node(step.closed.len() - 1, s);
            let (normal, tangential) = observer.forces(step, s);
            self.history.push(Sample {
                time_s: time,
                base_angle_rad: observer.motion.angle(time),
                contact_normal_force_n: normal,
                contact_tangential_force_n: tangential,
                tip_deflection_m: observer.deflection(step, s),
                tip_x_m,
                tip_y_m,
                tip_z_m,
                kinetic_energy_j: energies.kinetic,
                potential_energy_j: energies.spring + energies.gravity,
                dissipated_energy_j: integrals[integral::JOINT_DISSIPATION] + integrals[integral::CONTACT_DISSIPATION],
            });
        }
    }
}
