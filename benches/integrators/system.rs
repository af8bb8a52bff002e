//! One pass of a filament as a problem for the methods, with counted work.

use std::convert::Infallible;

use bristle::contact::ContactLaw;
use bristle::equations::linear::dot;
use bristle::equations::{LaneSet, StepWeights};
use bristle::integrate::hermite::{Knot, interpolate};
use bristle::integrate::{SecondOrderSystem, State, Tolerances};
use bristle::model::filament;
use bristle::model::settings::Settings;
use bristle::simulation::{FilamentSystem, Pass, integral};
use bristle::tool::{RoundTool, Turning};
use bristle::workpiece::Plane;

/// A state with the contact normal impulse in N s as its only integral.
pub type Point = State<(), 2, 1>;

/// What the methods integrate.
pub type System = dyn SecondOrderSystem<f64, 2, 1, Charts = (), Refusal = Infallible>;

/// Calls of the library's O(n) loops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Accepted steps.
    pub steps: usize,
    /// Steps rejected because of their error.
    pub rejected: usize,
    /// Steps rejected because Newton's method failed.
    pub failed: usize,
    /// Contact events.
    pub events: usize,
    /// Steps repeated to land on an event, or states evaluated for it.
    pub landings: usize,
    pub residuals: usize,
    pub factorisations: usize,
    pub solves: usize,
    pub accelerations: usize,
    /// Evaluations of positions and velocities without forces.
    pub placements: usize,
}

/// Cost in µs of one call at n = 25, as measured by `--costs`, rounded.
pub const COSTS: [(&str, f64); 5] =
    [("residual", 1.5), ("factorisation", 3.0), ("solve", 0.4), ("accelerations", 1.9), ("placement", 0.8)];

impl Work {
    /// Adds the work of another pass.
    pub fn add(&mut self, other: &Self) {
        let Self { steps, rejected, failed, events, landings, residuals, factorisations, solves, .. } = other;
        self.steps += steps;
        self.rejected += rejected;
        self.failed += failed;
        self.events += events;
        self.landings += landings;
        self.residuals += residuals;
        self.factorisations += factorisations;
        self.solves += solves;
        self.accelerations += other.accelerations;
        self.placements += other.placements;
    }

    /// Weighted sum of the calls in µs.
    pub fn cost(&self) -> f64 {
        let calls = [self.residuals, self.factorisations, self.solves, self.accelerations, self.placements];
        calls.iter().zip(COSTS).map(|(&calls, (_, cost))| calls as f64 * cost).sum()
    }
}

/// A filament in contact, from the library.
pub struct Filament {
    pub inner: FilamentSystem<Turning<RoundTool>, Plane>,
    pub work: Work,
    scratch: Vec<[f64; 2]>,
}

impl Filament {
    /// The nodes at `state`.
    pub fn track(&mut self, state: &Point, knots: &mut [Knot<3>]) {
        let mut scratch = std::mem::take(&mut self.scratch);
        self.residual(state.time, &state.q, &state.v, &state.accelerations, &mut scratch);
        self.scratch = scratch;
        self.inner.nodes(0, knots);
    }

    /// True if a node is closed.
    pub fn is_in_contact(&self) -> bool {
        (0..self.inner.filament(0).chain.segments()).any(|node| self.inner.is_closed(0, node))
    }

    /// The normal force at the fraction `s` of a step in N.
    pub fn normal_force(&self, step: &StepView<'_>, s: f64) -> f64 {
        let mut normal = 0.0;
        for node in (0..step.start_nodes.len()).filter(|&node| self.inner.is_closed(0, node)) {
            let (position, velocity) = step.node(node, s);
            let filament = self.inner.filament(0);
            normal += filament.law.normal_force(&filament.approach(position, velocity, step.time(s)));
        }
        normal
    }
}

impl SecondOrderSystem<f64, 2, 1> for Filament {
    type Charts = ();
    type Refusal = Infallible;

    fn blocks(&self) -> usize {
        self.inner.blocks()
    }

    fn accelerations(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &mut [[f64; 2]]) {
        self.work.accelerations += 1;
        self.inner.accelerations(time, q, v, accelerations);
    }

    fn residual(
        &mut self,
        time: f64,
        q: &[[f64; 2]],
        v: &[[f64; 2]],
        accelerations: &[[f64; 2]],
        residual: &mut [[f64; 2]],
    ) {
        self.work.residuals += 1;
        self.inner.residual(time, q, v, accelerations, residual);
    }

    fn factorise(
        &mut self,
        time: f64,
        q: &[[f64; 2]],
        v: &[[f64; 2]],
        accelerations: &[[f64; 2]],
        weights: StepWeights<f64>,
        lanes: LaneSet,
    ) {
        self.work.factorisations += 1;
        self.inner.factorise(time, q, v, accelerations, weights, lanes);
    }

    fn solve(&mut self, right_side: &mut [[f64; 2]]) {
        self.work.solves += 1;
        self.inner.solve(right_side);
    }

    fn rates(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &[[f64; 2]]) -> [f64; 1] {
        if !self.is_in_contact() {
            return [0.0];
        }
        self.work.placements += 1;
        [self.inner.rates(time, q, v, accelerations)[integral::NORMAL_IMPULSE]]
    }
}

/// An accepted step.
pub struct StepView<'a> {
    pub start: &'a Point,
    pub end: &'a Point,
    pub start_nodes: &'a [Knot<3>],
    pub end_nodes: &'a [Knot<3>],
}

impl StepView<'_> {
    pub fn length(&self) -> f64 {
        self.end.time - self.start.time
    }

    pub fn time(&self, s: f64) -> f64 {
        self.start.time + s * self.length()
    }

    pub fn node(&self, node: usize, s: f64) -> ([f64; 3], [f64; 3]) {
        interpolate(&self.start_nodes[node], &self.end_nodes[node], self.length(), s)
    }

    /// Speed of `node` at the ends.
    pub fn speeds(&self, node: usize) -> f64 {
        [self.start_nodes, self.end_nodes].map(|knots| dot(knots[node].rate, knots[node].rate).sqrt()).iter().sum()
    }
}

/// The initial value problem of a pass.
pub struct Problem {
    pub settings: Settings,
    pub end_time: f64,
    pub tolerances: Tolerances,
}

impl Problem {
    /// The pass of `settings` at the relative tolerance `relative`.
    pub fn new(settings: &Settings, relative: f64) -> Self {
        let pass = Pass::new(settings);
        let process = &settings.process;
        let slow_rate = 0.01 * filament::first_natural_frequency(&settings.filament);
        Self {
            settings: settings.clone(),
            end_time: pass.end_time(),
            tolerances: Tolerances {
                relative,
                coordinate_scale: 1.0,
                rate_scale: (process.brushing_velocity_m_s / settings.filament.length_m).max(slow_rate),
            },
        }
    }

    /// Number of pairs of coordinates.
    pub fn pairs(&self) -> usize {
        self.settings.filament.segments
    }

    /// Times of nominal entry and exit in s.
    pub fn nominal_times(&self) -> (f64, f64) {
        Pass::new(&self.settings).nominal_times().into()
    }

    /// The filament and the initial state: straight, turning rigidly with the body.
    pub fn start(&self) -> (Filament, Point) {
        let Settings { filament, contact, workpiece, process, .. } = &self.settings;
        let motion = *Pass::new(&self.settings).tool();
        let n = filament.segments;
        let plane = Plane::of(workpiece, self.settings.tool_radius_m(), process.penetration_depth_m);
        let chain = filament::chain(filament, process.gravity_m_s2);
        let inner = FilamentSystem::new(chain, motion, ContactLaw::from(contact), plane, false);
        let mut system = Filament { inner, work: Work::default(), scratch: vec![[0.0; 2]; filament.segments] };
        let q = vec![[std::f64::consts::FRAC_PI_2, motion.initial_angle]; n];
        let start = State::new(&mut system, 0.0, q, vec![[0.0, motion.rate]; n]);
        (system, start)
    }
}
