//! A clamped filament above a workpiece, as a system to integrate: one filament, or one per lane.

use std::f64::consts::PI;

use super::error::Obstacle;
use super::form::{Equations, Form};
use crate::contact::{Approach, ContactLaw};
use crate::equations::linear::{dot, in_lane, zero};
use crate::equations::{
    Chain, ChainDynamics, Clamp, Compiled, Energies, LaneSet, Lanewise, NodeLoads, NodeTangent, PolarAxis, StepWeights,
    find_pole, near_pole,
};
use crate::integrate::hermite::Knot;
use crate::integrate::{SecondOrderSystem, StageSolution, State};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Quantities integrated along the motion, by index into [`State::integrals`].
pub mod integral {
    /// Contact normal impulse `∫ F_n dt` in N s.
    pub const NORMAL_IMPULSE: usize = 0;
    /// Energy taken by the dampers of the joints in J.
    pub const JOINT_DISSIPATION: usize = 1;
    /// Energy taken by contact damping and friction in J.
    pub const CONTACT_DISSIPATION: usize = 2;
    /// Work put in by the clamp and by a moving workpiece in J.
    pub const WORK: usize = 3;
    /// Natural logarithm of the factor by which the lateral variation of a planar state has been divided, so that it stays
    /// finite. Constant within a step.
    pub const VARIATION_SCALE: usize = 4;
    /// The number of integrals.
    pub const COUNT: usize = 5;
}

use integral::COUNT;

/// Where the lateral variation of a planar state leaves this range, it is divided by [`VARIATION_FACTOR`], or multiplied again.
/// Divided, it stays above [`LARGEST_CONTROLLED_VARIATION`](crate::integrate::LARGEST_CONTROLLED_VARIATION).
const VARIATION_RANGE: std::ops::Range<f64> = 1e32..1e90;
/// See [`VARIATION_RANGE`].
const VARIATION_FACTOR: f64 = 1e50;

/// Entries of a segment's block of coordinates, as its [`Form`] defines them.
pub const COORDINATES: usize = 2;

/// The state of a filament, with the integrals of [`integral`].
///
/// Coordinates are in rad, as their [`Form`] defines them. In space the charts are the polar axes of the segments' coordinates;
/// planar coordinates have no charts.
pub type FilamentState = State<Vec<PolarAxis>, COORDINATES, COUNT>;

impl FilamentState {
    /// Converts coordinates, rates and accelerations of `segment` (by index) to those about `axis`.
    ///
    /// The same motion to rounding, which grows as `1/sin² φ` where `axis` is near the segment's direction.
    ///
    /// # Panics
    /// If there is no such segment.
    pub fn change_chart(&mut self, segment: usize, axis: PolarAxis) {
        if self.charts[segment] == axis {
            return;
        }
        let motion = [self.q[segment], self.v[segment], self.accelerations[segment]];
        [self.q[segment], self.v[segment], self.accelerations[segment]] =
            axis.coordinates(self.charts[segment].direction(motion));
        self.charts[segment] = axis;
    }

    /// Keeps the lateral variation of a planar state finite. Its equations are linear, and where it is divided, the tilt of the
    /// clamp that drives them is far too small to matter.
    pub(super) fn rescale_variation(&mut self) {
        let largest = self.q.iter().fold(0.0_f64, |largest, block| largest.max(block[0].abs()));
        let divided = self.integrals[integral::VARIATION_SCALE] > 0.0;
        let factor = match () {
            () if largest >= VARIATION_RANGE.end => 1.0 / VARIATION_FACTOR,
            () if divided && largest < VARIATION_RANGE.start => VARIATION_FACTOR,
            () => return,
        };
        for block in self.q.iter_mut().chain(&mut self.v).chain(&mut self.accelerations) {
            block[0] *= factor;
        }
        self.integrals[integral::VARIATION_SCALE] -= factor.ln();
    }

    /// Switches segments near a pole of their coordinates to their other chart, and returns their number.
    ///
    /// Call this between steps. A segment that has just switched is far from the poles of its new chart.
    pub fn leave_poles(&mut self) -> usize {
        let mut changes = 0;
        for segment in 0..self.charts.len() {
            if near_pole(self.q[segment][0]) {
                self.change_chart(segment, self.charts[segment].other());
                changes += 1;
            }
        }
        changes
    }
}

/// One filament: its constants, the motion of its clamp, and the workpiece.
#[derive(Clone, Debug)]
pub struct Filament<M, W> {
    /// The constants.
    pub chain: Chain<f64>,
    /// How its clamp moves.
    pub motion: M,
    /// Its contact law.
    pub law: ContactLaw,
    /// The workpiece.
    pub workpiece: W,
}

impl<M: ClampMotion, W: Workpiece> Filament<M, W> {
    /// A node at `position` with `velocity`, relative to the workpiece at `time`.
    pub fn approach(&self, position: [f64; 3], velocity: [f64; 3], time: f64) -> Approach {
        self.law.approach(&self.workpiece, position, velocity, time)
    }

    /// How to solve the stages of its steps.
    ///
    /// A single correction leaves a little energy in each stage. Any damping of the filament removes it. Without
    /// dampers it accumulates: over twenty swings of a chain, to sixty times the error of converged stages.
    pub fn stage_solution(&self) -> StageSolution {
        let damped = self.chain.links.iter().any(|link| link.damping > 0.0);
        if damped && self.law.friction == 0.0 { StageSolution::Predicted } else { StageSolution::Converged }
    }

    /// How deep a node may be past its event at the end of a step, in m: `1e-4 × relative tolerance × l_f`, or less if
    /// the contact is so stiff that this depth would cause a force above `relative tolerance × E I/l_f²`.
    pub fn event_tolerance(&self, relative: f64, time: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let force = chain.bending_stiffness() / (length * length);
        let by_force = (relative * force / self.law.stiffness).powf(1.0 / self.law.exponent);
        let [x, y, z] = self.motion.at(time).position;
        let rounding = 4.0 * f64::EPSILON * (length + x.hypot(y).hypot(z));
        (1e-4 * relative * length).min(by_force).max(rounding)
    }

    /// The same in m for a pass whose work is limited: `1e-2 × relative tolerance × l_f`, or less if the contact would store more
    /// energy there than `1e-2 × relative tolerance × E I/l_f`, because switching gains or loses that energy.
    pub fn coarse_event_tolerance(&self, relative: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let share = 1e-2 * relative;
        // A penetration δ stores k δ^(p+1)/(p+1).
        let energy = share * chain.bending_stiffness() / length;
        let power = self.law.exponent + 1.0;
        (share * length).min((power * energy / self.law.stiffness).powf(1.0 / power))
    }
}

/// The equations of a filament in contact, or of one per lane of `T`, and the state of its nodes: open or closed.
#[derive(Clone, Debug)]
pub struct FilamentSystem<M, W, T = f64> {
    equations: Equations<T>,
    /// One per lane.
    filaments: Vec<Filament<M, W>>,
    /// The lanes in which each node is closed.
    closed: Vec<LaneSet>,
    tracks_energy: bool,
    tracks_dissipation: bool,
    /// The time for which the clamps were last evaluated, and their motion there.
    clamp: (T, Clamp<T>),
    scratch: Vec<[T; 2]>,
}

impl<M: ClampMotion, W: Workpiece> FilamentSystem<M, W> {
    /// The filament `chain`, clamped to `motion`, that meets `workpiece` under `law`.
    ///
    /// With `tracks_energy` all quantities of [`integral`] are integrated, otherwise only the impulse.
    pub fn new(chain: Chain<f64>, motion: M, law: ContactLaw, workpiece: W, tracks_energy: bool) -> Self {
        Self::side_by_side(Form::Spatial, vec![Filament { chain, motion, law, workpiece }], tracks_energy)
    }

    /// The state at `time` with the coordinates `q` and the rates `v`: in space those about `z`. Nodes that press on the
    /// workpiece in this state are closed.
    ///
    /// Segments near the poles of `z` are switched to their other chart, as stated in the returned state. At a pole itself,
    /// `θ` is that of the plane in which `φ` moves, and `θ̇` is meaningless.
    pub fn state(&mut self, time: f64, mut q: Vec<[f64; 2]>, mut v: Vec<[f64; 2]>) -> FilamentState {
        let mut charts = vec![PolarAxis::Z; self.equations.charts().len()];
        for (axis, (q, v)) in charts.iter_mut().zip(q.iter_mut().zip(&mut v)) {
            if near_pole(q[0]) {
                let direction = axis.direction([*q, *v, [0.0; 2]]);
                *axis = axis.other();
                [*q, *v, _] = axis.coordinates(direction);
            }
        }
        self.equations.set_charts(&charts);
        let (equations, clamp, _) = self.parts(time);
        equations.place(clamp, &q, &v);
        for node in 0..q.len() {
            let [position, velocity] = self.equations.node(node, 0);
            let approach = self.filaments[0].approach(position, velocity, time);
            self.set_closed(0, node, self.filaments[0].law.pressing(&approach) > 0.0);
        }
        State::new(self, time, q, v)
    }

    /// Energies at a state.
    pub fn energies(&mut self, state: &FilamentState) -> Energies<f64> {
        self.place(state);
        let (equations, clamp, _) = self.parts(state.time);
        equations.energies(clamp, &state.q, &state.v)
    }

    /// Energy stored in the closed contacts at a state, in J.
    pub fn contact_energy(&mut self, state: &FilamentState) -> f64 {
        self.place(state);
        let filament = &self.filaments[0];
        let closed = (0..self.closed.len()).filter(|&node| self.is_closed(0, node));
        let energies = closed.map(|node| {
            let [position, velocity] = self.equations.node(node, 0);
            filament.law.stored_energy(&filament.approach(position, velocity, state.time))
        });
        energies.sum()
    }

    fn place(&mut self, state: &FilamentState) {
        self.equations.set_charts(&state.charts);
        let (equations, clamp, _) = self.parts(state.time);
        equations.place(clamp, &state.q, &state.v);
    }

    /// Position, velocity and acceleration of every node at a state.
    pub(super) fn track(&mut self, state: &FilamentState, knots: &mut [Knot<3>]) {
        self.equations.set_charts(&state.charts);
        let (equations, clamp, _) = self.parts(state.time);
        equations.track(clamp, &state.q, &state.v, &state.accelerations);
        self.nodes(0, knots);
    }
}

impl<M: ClampMotion, W: Workpiece, T: Compiled> FilamentSystem<M, W, T> {
    /// Filaments with the same number of segments, one per lane, with equations of the given form; see
    /// [`FilamentSystem::new`]. The planar form requires that [`Pass::form`](super::Pass::form) would choose it.
    ///
    /// # Panics
    /// If their number differs from that of the lanes, or if their numbers of segments differ.
    pub fn side_by_side(form: Form, filaments: Vec<Filament<M, W>>, tracks_energy: bool) -> Self {
        assert_eq!(filaments.len(), T::LANES, "each lane has a filament");
        let n = filaments[0].chain.segments();
        let clamp = (T::from_f64(f64::NAN), Clamp::from_lanes(|lane| filaments[lane].motion.at(0.0)));
        Self {
            equations: Equations::new(form, Chain::from_lanes(|lane| &filaments[lane].chain)),
            filaments,
            closed: vec![LaneSet::default(); n],
            tracks_energy,
            tracks_dissipation: tracks_energy,
            clamp,
            scratch: vec![zero(); n],
        }
    }

    /// Also integrates the dissipated energies, if requested, and leaves the impulse unchanged to the bit. For these energies,
    /// stages count with the angles before their last correction. That correction is far below the tolerance.
    #[must_use]
    pub(super) fn tracking_dissipation(self, tracks_dissipation: bool) -> Self {
        Self { tracks_dissipation: self.tracks_energy || tracks_dissipation, ..self }
    }

    /// Puts another filament into `lane`, with all nodes open.
    ///
    /// # Panics
    /// If its number of segments differs from that of the others.
    pub fn set_filament(&mut self, lane: usize, filament: Filament<M, W>) {
        self.filaments[lane] = filament;
        self.equations.chain_mut().set_lanes(|lane| &self.filaments[lane].chain);
        self.clamp.0.set_lane(lane, f64::NAN);
        self.open_all(lane);
    }

    /// Opens all nodes in `lane`.
    pub fn open_all(&mut self, lane: usize) {
        for closed in &mut self.closed {
            closed.remove(lane);
        }
    }

    /// The filament of a lane.
    pub fn filament(&self, lane: usize) -> &Filament<M, W> {
        &self.filaments[lane]
    }

    /// True if `node` is closed in `lane`.
    pub fn is_closed(&self, lane: usize, node: usize) -> bool {
        self.closed[node].contains(lane)
    }

    /// Closes or opens `node` in `lane`.
    pub fn set_closed(&mut self, lane: usize, node: usize, closed: bool) {
        if closed {
            self.closed[node].insert(lane);
        } else {
            self.closed[node].remove(lane);
        }
    }

    /// Position, velocity and acceleration of every node of `lane`, at the end of the last step.
    pub fn nodes(&self, lane: usize, knots: &mut [Knot<3>]) {
        self.equations.nodes(lane, knots);
    }

    /// The clamps at `time`.
    fn clamp(&mut self, time: T) -> &Clamp<T> {
        // NaN means that they must be evaluated again: it does not equal any time.
        if (0..T::LANES).any(|lane| self.clamp.0.lane(lane) != time.lane(lane)) {
            self.clamp = (time, M::in_lanes(|lane| &self.filaments[lane].motion, time));
        }
        &self.clamp.1
    }

    /// The loads at `time` on closed nodes.
    pub fn loads(&self, time: T) -> ContactLoads<'_, M, W, T> {
        ContactLoads::new(&self.filaments, &self.closed, time)
    }

    /// The equations, the clamps and the loads at `time`.
    fn parts(&mut self, time: T) -> (&mut Equations<T>, &Clamp<T>, ContactLoads<'_, M, W, T>) {
        self.clamp(time);
        (&mut self.equations, &self.clamp.1, ContactLoads::new(&self.filaments, &self.closed, time))
    }

    /// Rates of the contact's integrals, where the dynamics were last placed.
    fn add_contact_rates(&self, time: T, rates: &mut [T; COUNT]) {
        for (node, &lanes) in self.closed.iter().enumerate() {
            for lane in lanes.iter() {
                let (filament, time) = (&self.filaments[lane], time.lane(lane));
                let [position, velocity] = self.equations.node(node, lane);
                let approach = filament.approach(position, velocity, time);
                let mut add = |integral: usize, rate: f64| {
                    rates[integral].set_lane(lane, rates[integral].lane(lane) + rate);
                };
                // Use the smooth law even where it pulls: stages of a step that ends on an opening can lie past it.
                add(integral::NORMAL_IMPULSE, filament.law.normal_force(&approach));
                if self.tracks_dissipation {
                    add(integral::CONTACT_DISSIPATION, filament.law.dissipated_power(&approach));
                }
                if self.tracks_energy {
                    let surface = filament.workpiece.surface(position, time);
                    add(integral::WORK, dot(filament.law.force(&approach).total(&approach), surface.velocity));
                }
            }
        }
    }

    /// Adds the rate of the joints' dissipation, with the angles as they were last placed.
    fn add_joint_dissipation(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], rates: &mut [T; COUNT]) {
        let clamp = *self.clamp(time);
        let dissipation = self.equations.dissipation(&clamp, q, v);
        rates[integral::JOINT_DISSIPATION] = dissipation + dissipation;
    }

    /// Rates of the other integrals. Afterwards the dynamics are placed, with the accelerations of the nodes.
    fn energy_rates(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) -> [T; COUNT] {
        let mut scratch = std::mem::take(&mut self.scratch);
        self.residual(time, q, v, accelerations, &mut scratch);
        self.scratch = scratch;
        let clamp = *self.clamp(time);
        let energies = self.equations.energies(&clamp, q, v);
        let mut rates = zero();
        rates[integral::JOINT_DISSIPATION] = energies.dissipation + energies.dissipation;
        rates[integral::WORK] = dot(self.equations.root_force(), clamp.velocity) + energies.clamp_torque_power;
        rates
    }
}

impl<M: ClampMotion, W: Workpiece, T: Compiled> SecondOrderSystem<T, COORDINATES, COUNT> for FilamentSystem<M, W, T> {
    type Charts = Vec<PolarAxis>;
    type Refusal = Obstacle;

    fn blocks(&self) -> usize {
        self.equations.segments()
    }

    fn accelerations(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &mut [[T; 2]]) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let (equations, clamp, loads) = self.parts(time);
        equations.all_accelerations(clamp, q, v, &loads, accelerations, &mut scratch);
        self.scratch = scratch;
    }

    fn residual(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]], residual: &mut [[T; 2]]) {
        let (equations, clamp, loads) = self.parts(time);
        equations.residual(clamp, q, v, accelerations, &loads, residual);
    }

    fn factorise(
        &mut self,
        time: T,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        weights: StepWeights<T>,
        lanes: LaneSet,
    ) {
        let (equations, clamp, loads) = self.parts(time);
        equations.factorise(clamp, q, v, accelerations, &loads, weights, lanes);
    }

    fn solve(&mut self, right_side: &mut [[T; 2]]) {
        self.equations.solve(right_side);
    }

    fn correction(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]], correction: &mut [[T; 2]]) {
        let (equations, clamp, loads) = self.parts(time);
        equations.correction(clamp, q, v, accelerations, &loads, correction);
    }

    fn rates(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) -> [T; COUNT] {
        let mut rates = zero();
        if self.tracks_energy {
            rates = self.energy_rates(time, q, v, accelerations);
        } else {
            let (equations, clamp, _) = self.parts(time);
            equations.track(clamp, q, v, accelerations);
            if self.tracks_dissipation {
                self.add_joint_dissipation(time, q, v, &mut rates);
            }
        }
        self.add_contact_rates(time, &mut rates);
        rates
    }

    fn stage_rates(
        &mut self,
        time: T,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        correction: &[[T; 2]],
        weights: StepWeights<T>,
    ) -> [T; COUNT] {
        if self.tracks_energy {
            return self.rates(time, q, v, accelerations);
        }
        let mut rates = zero();
        if self.tracks_dissipation {
            self.add_joint_dissipation(time, q, v, &mut rates);
        }
        if self.closed.iter().any(|lanes| !lanes.is_empty()) {
            if !self.carries_variation() {
                // With a variation its solution has moved the nodes.
                self.equations.shift(correction, weights);
            }
            self.add_contact_rates(time, &mut rates);
        }
        rates
    }

    fn charts(&self) -> Vec<PolarAxis> {
        self.equations.charts().to_vec()
    }

    fn set_charts(&mut self, charts: &Vec<PolarAxis>) {
        self.equations.set_charts(charts);
    }

    fn carries_variation(&self) -> bool {
        self.equations.form() == Form::Planar
    }

    fn solve_variation(
        &mut self,
        time: T,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        weights: StepWeights<T>,
        correction: &mut [[T; 2]],
    ) {
        let (equations, clamp, loads) = self.parts(time);
        equations.solve_variation(clamp, q, v, accelerations, &loads, weights, correction);
    }

    fn refuse(&self, q: &[[f64; 2]]) -> Option<Obstacle> {
        match self.equations.form() {
            Form::Spatial => find_pole(q).map(|k| Obstacle::Pole { segment: k + 1 }),
            Form::Planar => {
                let folded = q.windows(2).position(|pair| (pair[1][1] - pair[0][1]).abs() >= PI)?;
                Some(Obstacle::Fold { segment: folded + 2 })
            }
        }
    }
}

/// The loads of a contact on its closed nodes, at one instant per lane.
#[derive(Clone, Copy, Debug)]
pub struct ContactLoads<'a, M, W, T> {
    filaments: &'a [Filament<M, W>],
    closed: &'a [LaneSet],
    /// Whether no node is closed in any lane.
    empty: bool,
    /// Whether there is friction in any lane.
    frictional: bool,
    time: T,
}

impl<'a, M: ClampMotion, W: Workpiece, T: Lanewise> ContactLoads<'a, M, W, T> {
    fn new(filaments: &'a [Filament<M, W>], closed: &'a [LaneSet], time: T) -> Self {
        let frictional = filaments.iter().any(|filament| filament.law.friction != 0.0);
        Self { filaments, closed, empty: closed.iter().all(|lanes| lanes.is_empty()), frictional, time }
    }

    /// The filament of `lane`, and the approach of its node at `position` with `velocity`.
    fn approach(&self, lane: usize, position: &[T; 3], velocity: &[T; 3]) -> (&Filament<M, W>, Approach) {
        let filament = &self.filaments[lane];
        let (position, velocity) = (in_lane(position, lane), in_lane(velocity, lane));
        (filament, filament.approach(position, velocity, self.time.lane(lane)))
    }
}

impl<M: ClampMotion, W: Workpiece, T: Lanewise> NodeLoads<T> for ContactLoads<'_, M, W, T> {
    fn is_empty(&self) -> bool {
        self.empty
    }

    fn lanes(&self) -> Option<&[LaneSet]> {
        Some(self.closed)
    }

    fn resists_lateral_motion(&self) -> bool {
        self.frictional
    }

    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]> {
        if self.closed[node].is_empty() {
            return None;
        }
        let mut result = zero::<T, 3>();
        for lane in self.closed[node].iter() {
            let (filament, approach) = self.approach(lane, &position, &velocity);
            let force = filament.law.force(&approach).total(&approach);
            for (result, component) in result.iter_mut().zip(force) {
                result.set_lane(lane, component);
            }
        }
        Some(result)
    }

    fn lateral_damping(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<T> {
        if self.closed[node].is_empty() || !self.frictional {
            return None;
        }
        let mut result = T::from_f64(0.0);
        for lane in self.closed[node].iter() {
            let (filament, approach) = self.approach(lane, &position, &velocity);
            result.set_lane(lane, filament.law.lateral_damping(&approach));
        }
        Some(result)
    }

    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>> {
        if self.closed[node].is_empty() {
            return None;
        }
        let mut result = NodeTangent::<T> { position: [zero(); 3], velocity: [zero(); 3] };
        for lane in self.closed[node].iter() {
            let (filament, approach) = self.approach(lane, &position, &velocity);
            let tangent = filament.law.tangent(&approach);
            for row in 0..3 {
                for column in 0..3 {
                    result.position[row][column].set_lane(lane, tangent.position[row][column]);
                    result.velocity[row][column].set_lane(lane, tangent.velocity[row][column]);
                }
            }
        }
        Some(result)
    }
}
