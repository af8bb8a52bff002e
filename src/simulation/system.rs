//! A clamped filament above a workpiece, as a system to integrate: one filament, or one per lane.

use std::f64::consts::PI;
use std::ops::Range;

use super::error::Obstacle;
use super::filament::{ContactSum, Filament, Touch};
use super::form::{FilamentEquations, Form};
use super::loads::ContactLoads;
use crate::contact::ContactLaw;
use crate::equations::linear::{dot, in_lane, zero};
use crate::equations::{
    Chain, ChainDynamics, ChainState, Clamp, Compiled, Energies, LaneSet, PolarAxis, StepWeights,
    better_chart, find_pole,
};
use crate::integrate::hermite::Knot;
use crate::integrate::{Point, SecondOrderSystem, State};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Quantities integrated along the motion, by index into [`State::integrals`].
pub mod integral {
    /// Contact normal impulse `∫ F_n dt` in N s.
    pub const NORMAL_IMPULSE: usize = 0;
    /// Impulse `∫ F dt` of the contact force on the filament in N s: the first of three components.
    pub const IMPULSE: usize = 1;
    /// Angular impulse of the contact force about the tool axis `z` in N m s.
    pub const ANGULAR_IMPULSE: usize = 4;
    /// Part of the normal impulse on edges in N s.
    pub const EDGE_IMPULSE: usize = 5;
    /// Energy taken by friction in J.
    pub const FRICTION_WORK: usize = 6;
    /// Energy taken by the dampers of the joints in J.
    pub const JOINT_DISSIPATION: usize = 7;
    /// Energy taken by contact damping and friction in J.
    pub const CONTACT_DISSIPATION: usize = 8;
    /// Work of the clamp and of a moving workpiece in J. Unless all energies are tracked, it is
    /// only that of a workpiece that does not just translate.
    pub const WORK: usize = 9;
    /// Natural logarithm of the factor by which the lateral variation of a planar state has been
    /// divided, so that it stays finite. Constant within a step.
    pub const VARIATION_SCALE: usize = 10;
    /// Sliding work `∫ F_n |v_t| dt` in J.
    pub const SLIDING_WORK: usize = 11;
    /// Part of the sliding work on edges in J, then its first and second moment about their
    /// bisectors in J rad and J rad².
    pub const EDGE_WORK: usize = 12;
    /// Number of integrals.
    pub const COUNT: usize = 15;
}

use integral::COUNT;

/// Range of the lateral variation of a planar state. Above it, the variation is divided by
/// [`VARIATION_FACTOR`]; below it, multiplied again. A divided variation stays above
/// [`LARGEST_CONTROLLED_VARIATION`](crate::integrate::LARGEST_CONTROLLED_VARIATION).
const VARIATION_RANGE: Range<f64> = 1e32..1e90;
/// Factor of a rescaled variation, see [`VARIATION_RANGE`].
const VARIATION_FACTOR: f64 = 1e50;

/// Entries of a segment's block of coordinates, as its [`Form`] defines them.
pub const COORDINATES: usize = 2;

/// State of a filament, with the integrals of [`integral`].
///
/// Coordinates are in rad, as their [`Form`] defines them. In space the chart is the polar axis of
/// the coordinates; planar ones have no chart.
pub type FilamentState = State<PolarAxis, COORDINATES, COUNT>;

impl FilamentState {
    /// Keeps the lateral variation of a planar state finite. Its equations are linear. Where it is
    /// divided, the tilt of the clamp that drives them is far too small to matter.
    pub(super) fn rescale_variation(&mut self) {
        let largest = self
            .q
            .iter()
            .fold(0.0_f64, |largest, block| largest.max(block[0].abs()));
        let divided = self.integrals[integral::VARIATION_SCALE] > 0.0;
        let factor = match () {
            () if largest >= VARIATION_RANGE.end => 1.0 / VARIATION_FACTOR,
            () if divided && largest < VARIATION_RANGE.start => VARIATION_FACTOR,
            () => return,
        };
        for block in self
            .q
            .iter_mut()
            .chain(&mut self.v)
            .chain(&mut self.accelerations)
        {
            block[0] *= factor;
        }
        self.integrals[integral::VARIATION_SCALE] -= factor.ln();
    }

    /// Changes to the other chart if a segment is near a pole of this one and the other is better
    /// for all segments. Returns `true` if it does.
    ///
    /// Call this between steps, in space, with joints that are relaxed straight.
    pub fn leave_pole(&mut self) -> bool {
        let segments = self.q.iter().zip(&self.v).zip(&self.accelerations);
        let motions = segments.map(|((q, v), acceleration)| [*q, *v, *acceleration]);
        let Some((chart, motions)) = better_chart(self.chart, motions) else {
            return false;
        };
        self.chart = chart;
        for (k, [q, v, acceleration]) in motions.into_iter().enumerate() {
            (self.q[k], self.v[k], self.accelerations[k]) = (q, v, acceleration);
        }
        true
    }
}

/// Equations of a filament in contact, or of one per lane of `T`, and the active set: its closed
/// contacts.
#[derive(Clone, Debug)]
pub struct FilamentSystem<M, W, T = f64> {
    equations: FilamentEquations<T>,
    /// Filament of each lane.
    filaments: Vec<Filament<M, W>>,
    /// Lanes in which each contact is closed: contacts of nodes, then contacts with edges.
    closed: Vec<LaneSet>,
    /// Segment at which the search for the contact with an edge begins, by edge and lane.
    starts: Vec<Vec<usize>>,
    tracks_energy: bool,
    /// Time for which the clamps were last evaluated, and their motion there.
    clamp: (T, Clamp<T>),
    scratch: Vec<[T; 2]>,
}

impl<M: ClampMotion, W: Workpiece> FilamentSystem<M, W> {
    /// Creates the system of a filament `chain`, clamped to `motion`, that meets `workpiece` under
    /// `law`.
    ///
    /// With `tracks_energy` all quantities of [`integral`] are integrated, otherwise all but the
    /// work of the clamp and of a workpiece that translates.
    pub fn new(
        chain: Chain<f64>,
        motion: M,
        law: ContactLaw,
        workpiece: W,
        tracks_energy: bool,
    ) -> Self {
        Self::side_by_side(
            Form::Spatial,
            vec![Filament {
                chain,
                motion,
                law,
                workpiece,
            }],
            tracks_energy,
        )
    }

    /// Creates the state at `time` with the coordinates `q` and the rates `v`, in space about `z`.
    /// Closes the contacts that press in this state.
    ///
    /// If a segment is near a pole of `z`, the returned state has the chart about `x` where that is
    /// better. At a pole itself, `θ` is that of the plane in which `φ` moves, and `θ̇` is
    /// meaningless.
    pub fn state(&mut self, time: f64, q: Vec<[f64; 2]>, v: Vec<[f64; 2]>) -> FilamentState {
        self.state_about(PolarAxis::Z, time, q, v)
    }

    /// Creates that state with coordinates converted to those about `preferred`.
    pub(super) fn state_about(
        &mut self,
        preferred: PolarAxis,
        time: f64,
        mut q: Vec<[f64; 2]>,
        mut v: Vec<[f64; 2]>,
    ) -> FilamentState {
        let motions = q.iter().zip(&v).map(|(q, v)| [*q, *v, [0.0; 2]]);
        let converted = if preferred != PolarAxis::Z {
            let motions = motions.map(|motion| PolarAxis::Z.direction(motion));
            let motions = motions.map(|motion| preferred.coordinates(motion));
            Some((preferred, motions.collect()))
        } else if self.has_two_charts() {
            better_chart(PolarAxis::Z, motions)
        } else {
            None
        };
        let (chart, motions) = converted.unwrap_or_default();
        for (k, [of_q, of_v, _]) in motions.into_iter().enumerate() {
            (q[k], v[k]) = (of_q, of_v);
        }
        self.equations.set_chart(chart);
        let (equations, at, _) = self.parts(time, &q, &v);
        equations.place(at);
        for contact in 0..self.closed.len() {
            let filament = &self.filaments[0];
            let Touch {
                station, approach, ..
            } = filament.touch(contact, &self.lane(0), None, time);
            let pressing = filament.law.pressing(&approach) > 0.0;
            self.set_closed(0, contact, pressing);
            self.set_start(0, contact, station.segment);
        }
        State::new(self, time, q, v)
    }

    /// Returns the energies at a state.
    pub fn energies(&mut self, state: &FilamentState) -> Energies<f64> {
        self.place(state);
        let (equations, at, _) = self.parts(state.time, &state.q, &state.v);
        equations.energies(at)
    }

    /// Returns the energy stored in the closed contacts at a state, in J.
    pub fn contact_energy(&mut self, state: &FilamentState) -> f64 {
        self.place(state);
        let filament = &self.filaments[0];
        let closed = (0..self.closed.len()).filter(|&contact| self.is_closed(0, contact));
        let energies = closed.map(|contact| {
            filament.law.stored_energy(
                &filament
                    .touch(contact, &self.lane(0), None, state.time)
                    .approach,
            )
        });
        energies.sum()
    }

    fn place(&mut self, state: &FilamentState) {
        self.equations.set_chart(state.chart);
        let (equations, at, _) = self.parts(state.time, &state.q, &state.v);
        equations.place(at);
    }

    /// Writes position, velocity and acceleration of every node at a state.
    pub(super) fn track(&mut self, state: &FilamentState, knots: &mut [Knot<3>]) {
        self.equations.set_chart(state.chart);
        let (equations, at, _) = self.parts(state.time, &state.q, &state.v);
        equations.track(at, &state.accelerations);
        self.nodes(0, knots);
    }
}

impl<M: ClampMotion, W: Workpiece, T: Compiled> FilamentSystem<M, W, T> {
    /// Creates the system of filaments with the same number of segments, one per lane, with
    /// equations of the given form; see [`FilamentSystem::new`]. The planar form requires that
    /// [`Pass::form`](super::Pass::form) would choose it.
    ///
    /// # Panics
    /// If their number differs from that of the lanes, or if their numbers of segments differ.
    pub fn side_by_side(form: Form, filaments: Vec<Filament<M, W>>, tracks_energy: bool) -> Self {
        assert_eq!(filaments.len(), T::LANES, "each lane has a filament");
        let (n, contacts) = (filaments[0].chain.segments(), filaments[0].contacts());
        assert!(
            filaments
                .iter()
                .all(|filament| filament.contacts() == contacts),
            "all lanes have one number of edges"
        );
        let clamp = (
            T::from_f64(f64::NAN),
            Clamp::from_lanes(|lane| filaments[lane].motion.at(0.0)),
        );
        Self {
            equations: FilamentEquations::new(
                form,
                Chain::from_lanes(|lane| &filaments[lane].chain),
            ),
            filaments,
            closed: vec![LaneSet::default(); contacts],
            starts: vec![vec![0; T::LANES]; contacts - n],
            tracks_energy,
            clamp,
            scratch: vec![zero(); n],
        }
    }

    /// Puts another filament into `lane`, with all contacts open.
    ///
    /// # Panics
    /// If its number of segments or of edges differs from that of the others.
    pub fn set_filament(&mut self, lane: usize, filament: Filament<M, W>) {
        assert_eq!(
            filament.contacts(),
            self.closed.len(),
            "all lanes have one number of contacts"
        );
        self.filaments[lane] = filament;
        self.equations
            .chain_mut()
            .set_lanes(|lane| &self.filaments[lane].chain);
        self.clamp.0.set_lane(lane, f64::NAN);
        self.open_all(lane);
    }

    /// Opens all contacts in `lane`.
    pub fn open_all(&mut self, lane: usize) {
        for closed in &mut self.closed {
            closed.remove(lane);
        }
    }

    /// Returns `true` if a motion may change its chart: in space, with joints that are relaxed
    /// straight.
    pub fn has_two_charts(&self) -> bool {
        self.equations.form() == Form::Spatial && self.equations.chain().is_relaxed_straight()
    }

    /// Returns the filament of a lane.
    pub fn filament(&self, lane: usize) -> &Filament<M, W> {
        &self.filaments[lane]
    }

    /// Returns `true` if `contact`, of a node or with an edge, is closed in `lane`
    /// ([`Filament::touch`]).
    pub fn is_closed(&self, lane: usize, contact: usize) -> bool {
        self.closed[contact].contains(lane)
    }

    /// Closes or opens `contact` in `lane`.
    pub fn set_closed(&mut self, lane: usize, contact: usize, closed: bool) {
        if closed {
            self.closed[contact].insert(lane);
        } else {
            self.closed[contact].remove(lane);
        }
    }

    /// Lets the search for the place of `contact` in `lane` begin at `segment`. It has no effect on
    /// nodes.
    pub fn set_start(&mut self, lane: usize, contact: usize, segment: usize) {
        if let Some(edge) = contact.checked_sub(self.equations.segments()) {
            self.starts[edge][lane] = segment;
        }
    }

    /// Returns the nodes of one lane, where they were last placed.
    fn lane(&self, lane: usize) -> impl Fn(usize) -> [[f64; 3]; 2] {
        let (equations, clamp) = (&self.equations, &self.clamp.1);
        move |index| match index.checked_sub(1) {
            None => [
                in_lane(&clamp.position, lane),
                in_lane(&clamp.velocity, lane),
            ],
            Some(node) => equations.node(node, lane),
        }
    }

    /// Writes position, velocity and acceleration of every node of `lane`, at the end of the last
    /// step.
    pub fn nodes(&self, lane: usize, knots: &mut [Knot<3>]) {
        self.equations.nodes(lane, knots);
    }

    /// Returns the loads of closed contacts at `time`.
    pub fn loads(&self, time: T) -> ContactLoads<'_, M, W, T> {
        ContactLoads::new(&self.filaments, &self.closed, &self.starts, time)
    }

    /// Evaluates the clamps at `time`.
    fn set_time(&mut self, time: T) {
        // NaN equals no time: the clamps are then evaluated again.
        if (0..T::LANES).any(|lane| self.clamp.0.lane(lane) != time.lane(lane)) {
            self.clamp = (time, M::in_lanes(|lane| &self.filaments[lane].motion, time));
        }
    }

    /// Returns the equations, the state of the chains, and the loads at `time`.
    fn parts<'a>(
        &'a mut self,
        time: T,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
    ) -> (
        &'a mut FilamentEquations<T>,
        ChainState<'a, T>,
        ContactLoads<'a, M, W, T>,
    ) {
        self.set_time(time);
        let loads = ContactLoads::new(&self.filaments, &self.closed, &self.starts, time);
        (&mut self.equations, self.clamp.1.holding(q, v), loads)
    }

    /// Adds the rates of the contact's integrals, where the dynamics were last placed.
    fn add_contact_rates(&self, time: T, rates: &mut [T; COUNT]) {
        let segments = self.equations.segments();
        for (contact, &lanes) in self.closed.iter().enumerate() {
            for lane in lanes.iter() {
                let (filament, time) = (&self.filaments[lane], time.lane(lane));
                let start = contact
                    .checked_sub(segments)
                    .map(|edge| self.starts[edge][lane]);
                let touch = filament.touch(contact, &self.lane(lane), start, time);
                let mut add = |integral: usize, rate: f64| {
                    rates[integral].set_lane(lane, rates[integral].lane(lane) + rate);
                };
                let ContactSum {
                    normal,
                    on_edges,
                    force,
                    moment,
                    friction_power,
                    damped_power,
                    sliding_power,
                    edge_power,
                } = filament.sum(&touch);
                add(integral::NORMAL_IMPULSE, normal);
                for (i, component) in force.into_iter().enumerate() {
                    add(integral::IMPULSE + i, component);
                }
                add(integral::ANGULAR_IMPULSE, moment);
                add(integral::EDGE_IMPULSE, on_edges);
                add(integral::FRICTION_WORK, friction_power);
                add(integral::CONTACT_DISSIPATION, damped_power + friction_power);
                add(integral::SLIDING_WORK, sliding_power);
                if touch.on_edge.is_some() {
                    for (order, moment) in edge_power.into_iter().enumerate() {
                        add(integral::EDGE_WORK + order, moment);
                    }
                }
                if self.tracks_energy || !filament.workpiece.translates() {
                    let velocity = match contact.checked_sub(segments) {
                        None => filament.workpiece.surface(touch.position, time).velocity,
                        Some(edge) => {
                            filament.workpiece.edges()[edge]
                                .surface(touch.position, time)
                                .velocity
                        }
                    };
                    add(integral::WORK, dot(force, velocity));
                }
            }
        }
    }

    /// Adds the rate of the joints' dissipation, with the angles as they were last placed.
    fn add_joint_dissipation(&mut self, at: &Point<'_, T, 2>, rates: &mut [T; COUNT]) {
        self.set_time(at.time);
        let dissipation = self.equations.dissipation(self.clamp.1.holding(at.q, at.v));
        rates[integral::JOINT_DISSIPATION] = dissipation + dissipation;
    }

    /// Returns the rates of the other integrals. Afterwards the dynamics are placed, with the
    /// accelerations of the nodes.
    fn energy_rates(&mut self, at: &Point<'_, T, 2>) -> [T; COUNT] {
        let mut scratch = std::mem::take(&mut self.scratch);
        self.residual(at, &mut scratch);
        self.scratch = scratch;
        let (equations, state, _) = self.parts(at.time, at.q, at.v);
        let energies = equations.energies(state);
        let mut rates = zero();
        rates[integral::JOINT_DISSIPATION] = energies.dissipation + energies.dissipation;
        rates[integral::WORK] =
            dot(equations.root_force(), state.clamp.velocity) + energies.clamp_torque_power;
        rates
    }
}

impl<M: ClampMotion, W: Workpiece, T: Compiled> SecondOrderSystem<T, COORDINATES, COUNT>
    for FilamentSystem<M, W, T>
{
    type Chart = PolarAxis;
    type Refusal = Obstacle;

    fn blocks(&self) -> usize {
        self.equations.segments()
    }

    fn accelerations(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &mut [[T; 2]]) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let (equations, at, loads) = self.parts(time, q, v);
        equations.all_accelerations(at, &loads, accelerations, &mut scratch);
        self.scratch = scratch;
    }

    fn residual(&mut self, at: &Point<'_, T, 2>, residual: &mut [[T; 2]]) {
        let (equations, state, loads) = self.parts(at.time, at.q, at.v);
        equations.residual(state, at.accelerations, &loads, residual);
    }

    fn factorise(&mut self, at: &Point<'_, T, 2>, weights: StepWeights<T>, lanes: LaneSet) {
        let (equations, state, loads) = self.parts(at.time, at.q, at.v);
        equations.factorise(state, at.accelerations, &loads, weights, lanes);
    }

    fn solve(&mut self, right_side: &mut [[T; 2]]) {
        self.equations.solve(right_side);
    }

    fn correction(&mut self, at: &Point<'_, T, 2>, correction: &mut [[T; 2]]) {
        let (equations, state, loads) = self.parts(at.time, at.q, at.v);
        equations.correction(state, at.accelerations, &loads, correction);
    }

    fn rates(&mut self, at: &Point<'_, T, 2>) -> [T; COUNT] {
        let mut rates = zero();
        if self.tracks_energy {
            rates = self.energy_rates(at);
        } else {
            let (equations, state, _) = self.parts(at.time, at.q, at.v);
            equations.track(state, at.accelerations);
            self.add_joint_dissipation(at, &mut rates);
        }
        self.add_contact_rates(at.time, &mut rates);
        rates
    }

    fn stage_rates(
        &mut self,
        at: &Point<'_, T, 2>,
        correction: &[[T; 2]],
        weights: StepWeights<T>,
    ) -> [T; COUNT] {
        if self.tracks_energy {
            return self.rates(at);
        }
        let mut rates = zero();
        // The angles precede the last correction of the stage, which is far below the tolerance.
        self.add_joint_dissipation(at, &mut rates);
        if self.closed.iter().any(|lanes| !lanes.is_empty()) {
            if !self.carries_variation() {
                // The solution of a variation has already moved the nodes.
                self.equations.shift(correction, weights);
            }
            self.add_contact_rates(at.time, &mut rates);
        }
        rates
    }

    fn chart(&self) -> PolarAxis {
        self.equations.chart()
    }

    fn set_chart(&mut self, chart: PolarAxis) {
        self.equations.set_chart(chart);
    }

    fn controlled_integrals(&self) -> &'static [[usize; 2]] {
        &[
            [integral::IMPULSE, 0],
            [integral::IMPULSE + 1, 0],
            [integral::IMPULSE + 2, 0],
            [integral::CONTACT_DISSIPATION, 1],
        ]
    }

    fn carries_variation(&self) -> bool {
        self.equations.form() == Form::Planar
    }

    fn solve_variation(
        &mut self,
        at: &Point<'_, T, 2>,
        weights: StepWeights<T>,
        correction: &mut [[T; 2]],
    ) {
        let (equations, state, loads) = self.parts(at.time, at.q, at.v);
        equations.solve_variation(state, at.accelerations, &loads, weights, correction);
    }

    fn refuse(&self, q: &[[f64; 2]]) -> Option<Obstacle> {
        match self.equations.form() {
            Form::Spatial => find_pole(q).map(|k| Obstacle::Pole { segment: k + 1 }),
            Form::Planar => {
                let folded = q
                    .windows(2)
                    .position(|pair| (pair[1][1] - pair[0][1]).abs() >= PI)?;
                Some(Obstacle::Fold {
                    segment: folded + 2,
                })
            }
        }
    }
}
