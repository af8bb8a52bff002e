//! A clamped filament above a workpiece, as a system to integrate: one filament, or one per lane.

use std::f64::consts::PI;
use std::ops::{AddAssign, Range};

use super::error::Obstacle;
use super::form::{FilamentEquations, Form};
use crate::contact::edge::{EdgeContact, NodeMotions, Station};
use crate::contact::{Approach, ContactLaw, node_stiffness_share};
use crate::equations::linear::{add, dot, in_lane, zero};
use crate::equations::{
    Chain, ChainDynamics, ChainState, Clamp, Compiled, Energies, LANES, LaneSet, Lanewise,
    NodeLoads, NodeMotion, NodeTangent, PointDamping, PointLoad, PointTangent, PolarAxis,
    StepWeights, better_chart, find_pole,
};
use crate::integrate::hermite::Knot;
use crate::integrate::{Point, SecondOrderSystem, StageSolution, State};
use crate::tool::ClampMotion;
use crate::workpiece::{Edge, Workpiece};

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

/// Contact of a filament with the workpiece at one place: of a node with a face, or of the
/// centreline with an edge.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// Place on the filament. A node is the outer end of its segment, or the root.
    pub station: Station,
    /// Position in m.
    pub position: [f64; 3],
    /// Filament at that place, relative to the workpiece.
    pub approach: Approach,
    /// Angle from the bisector of an edge in rad ([`Edge::angle`]); `None` on a face.
    pub on_edge: Option<f64>,
}

/// Forces and powers of a contact on a filament, or of several together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactSum {
    /// `F_n` in N.
    pub normal: f64,
    /// Part of `F_n` on edges in N.
    pub on_edges: f64,
    /// Whole force in N.
    pub force: [f64; 3],
    /// Moment of the force about the tool axis in N m.
    pub moment: f64,
    /// Power taken by friction in W.
    pub friction_power: f64,
    /// Power taken by contact damping in W.
    pub damped_power: f64,
    /// `F_n |v_t|` in W.
    pub sliding_power: f64,
    /// Part of it on edges in W, and its first and second moment about their bisectors in W rad and
    /// W rad².
    pub edge_power: [f64; 3],
}

impl AddAssign for ContactSum {
    fn add_assign(&mut self, other: Self) {
        self.normal += other.normal;
        self.on_edges += other.on_edges;
        self.force = add(self.force, other.force);
        self.moment += other.moment;
        self.friction_power += other.friction_power;
        self.damped_power += other.damped_power;
        self.sliding_power += other.sliding_power;
        self.edge_power = add(self.edge_power, other.edge_power);
    }
}

/// Filament: its constants, the motion of its clamp, its contact law, and the workpiece.
#[derive(Clone, Debug)]
pub struct Filament<M, W> {
    /// Constants.
    pub chain: Chain<f64>,
    /// Motion of its clamp.
    pub motion: M,
    /// Contact law.
    pub law: ContactLaw,
    /// Workpiece.
    pub workpiece: W,
}

impl<M: ClampMotion, W: Workpiece> Filament<M, W> {
    /// Returns the outer end of `segment` (from 0) at `position` with `velocity`, relative to the
    /// workpiece at `time`.
    #[inline]
    pub fn approach(
        &self,
        segment: usize,
        position: [f64; 3],
        velocity: [f64; 3],
        time: f64,
    ) -> Approach {
        Approach {
            stiffness_share: node_stiffness_share(segment + 1, self.chain.segments()),
            ..self.law.approach(&self.workpiece, position, velocity, time)
        }
    }

    /// Returns the number of possible contacts: one for each node, and one for each edge of the
    /// workpiece.
    pub fn contacts(&self) -> usize {
        self.chain.segments() + self.workpiece.edges().len()
    }

    /// Returns a possible contact, by index: nodes first, then edges. `nodes` are the filament's
    /// nodes at `time`. The search for the place of a contact with an edge begins at the segment
    /// `start`, or goes over all segments.
    #[inline]
    pub fn touch(
        &self,
        contact: usize,
        nodes: &NodeMotions<'_>,
        start: Option<usize>,
        time: f64,
    ) -> Touch {
        if let Some(edge) = contact.checked_sub(self.chain.segments()) {
            return self.edge_touch(&self.workpiece.edges()[edge], nodes, start, time);
        }
        let [position, velocity] = nodes(contact + 1);
        let station = Station {
            segment: contact,
            fraction: 1.0,
        };
        Touch {
            station,
            position,
            approach: self.approach(contact, position, velocity, time),
            on_edge: None,
        }
    }

    #[inline(never)]
    fn edge_touch(
        &self,
        edge: &Edge,
        nodes: &NodeMotions<'_>,
        start: Option<usize>,
        time: f64,
    ) -> Touch {
        let EdgeContact {
            station,
            position,
            approach,
        } = self.edge_contact(edge, nodes, start, time);
        Touch {
            station,
            position,
            approach,
            on_edge: Some(edge.angle(position, time)),
        }
    }

    /// Returns forces and powers of a contact by the smooth law, even where it pulls: stages of a
    /// step that ends on an opening can lie past it.
    pub fn sum(
        &self,
        Touch {
            position: [x, y, _],
            approach,
            on_edge,
            ..
        }: &Touch,
    ) -> ContactSum {
        let force = self.law.force(approach);
        let total = force.total(approach);
        let sliding_power = force.normal * dot(approach.sliding, approach.sliding).sqrt();
        ContactSum {
            normal: force.normal,
            on_edges: if on_edge.is_some() { force.normal } else { 0.0 },
            force: total,
            moment: x * total[1] - y * total[0],
            friction_power: -dot(force.tangential, approach.sliding),
            damped_power: self.law.damped_power(approach),
            sliding_power,
            edge_power: on_edge.map_or([0.0; 3], |angle| {
                [1.0, angle, angle * angle].map(|moment| sliding_power * moment)
            }),
        }
    }

    /// Calls `take` with each contact that presses, by index. Returns the largest
    /// [`ContactLaw::pressing`] of all contacts, and their smallest distance from the workpiece in
    /// m, negative for a penetration.
    pub fn for_each_pressing(
        &self,
        nodes: impl Fn(usize) -> [[f64; 3]; 2],
        time: f64,
        mut take: impl FnMut(usize, &Touch),
    ) -> [f64; 2] {
        let (mut largest, mut nearest) = (f64::NEG_INFINITY, f64::INFINITY);
        for contact in 0..self.contacts() {
            if contact < self.chain.segments() {
                // Most nodes are far away.
                let [position, velocity] = nodes(contact + 1);
                let [pressing, distance] =
                    self.law
                        .node_pressing(&self.workpiece, position, velocity, time);
                (largest, nearest) = (largest.max(pressing), nearest.min(distance));
                if pressing <= 0.0 {
                    continue;
                }
            }
            let touch = self.touch(contact, &nodes, None, time);
            let pressing = self.law.pressing(&touch.approach);
            (largest, nearest) = (
                largest.max(pressing),
                nearest.min(touch.approach.distance()),
            );
            if pressing <= 0.0 {
                continue;
            }
            take(contact, &touch);
        }
        [largest, nearest]
    }

    fn edge_contact(
        &self,
        edge: &Edge,
        nodes: &NodeMotions<'_>,
        start: Option<usize>,
        time: f64,
    ) -> EdgeContact {
        let station = Station::nearest_to(edge, start, self.chain.segments(), nodes, time);
        EdgeContact::new(&self.law, edge, station, nodes, time)
    }

    /// Returns the method for the stages of its steps.
    ///
    /// A single correction leaves a little energy in each stage. Any damping of the filament
    /// removes that energy. Without dampers it accumulates: over twenty swings of a chain, to sixty
    /// times the error of converged stages. With friction a single correction suffices only if it
    /// is small. With friction and contact damping, the force is so steep where nodes come off that
    /// only converged stages keep the energy balance.
    pub fn stage_solution(&self) -> StageSolution {
        let damped = self.chain.links.iter().any(|link| link.damping > 0.0);
        match (damped, self.law.friction > 0.0) {
            (false, _) => StageSolution::Converged,
            (true, true) if self.law.damping > 0.0 => StageSolution::Converged,
            (true, true) => StageSolution::Cautious,
            (true, false) => StageSolution::Predicted,
        }
    }

    /// Returns the largest distance past its event at which a node may end a step, in m: `1e-4 ×
    /// relative tolerance × l_f`, or less if the contact is so stiff that this depth would cause a
    /// force above `relative tolerance × E I/l_f²`.
    pub fn event_tolerance(&self, relative: f64, time: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let force = chain.bending_stiffness() / (length * length);
        let by_force = (relative * force / self.law.stiffness).powf(1.0 / self.law.exponent);
        let [x, y, z] = self.motion.at(time).position;
        let rounding = 4.0 * f64::EPSILON * (length + x.hypot(y).hypot(z));
        (1e-4 * relative * length).min(by_force).max(rounding)
    }

    /// Returns that distance in m for a pass whose work is limited: `1e-2 × relative tolerance ×
    /// l_f`, or less if the contact would store more energy there than `1e-2 × relative tolerance ×
    /// E I/l_f`. Switching gains or loses that energy.
    pub fn coarse_event_tolerance(&self, relative: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let share = 1e-2 * relative;
        // A penetration δ stores k δ^(p+1)/(p+1).
        let energy = share * chain.bending_stiffness() / length;
        let power = self.law.exponent + 1.0;
        (share * length).min((power * energy / self.law.stiffness).powf(1.0 / power))
    }

    /// Returns the largest force in N with which a contact may begin or end if its events are
    /// located to `location` (m). It is ten times the force at this depth, or a thousandth of `E
    /// I/l_f²`, on which no result depends.
    pub fn largest_jump(&self, location: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let force = self.law.stiffness * location.powf(self.law.exponent);
        (10.0 * force).max(1e-3 * chain.bending_stiffness() / (length * length))
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

/// Loads of closed contacts, at one instant per lane.
#[derive(Clone, Copy, Debug)]
pub struct ContactLoads<'a, M, W, T> {
    filaments: &'a [Filament<M, W>],
    /// Lanes in which each node is closed.
    closed: &'a [LaneSet],
    /// Lanes in which the contact with each edge is closed.
    on_edges: &'a [LaneSet],
    /// Segments of [`FilamentSystem::set_start`].
    starts: &'a [Vec<usize>],
    /// `true` if nothing is closed in any lane.
    empty: bool,
    /// `true` if there is friction in any lane.
    frictional: bool,
    time: T,
}

impl<'a, M: ClampMotion, W: Workpiece, T: Lanewise> ContactLoads<'a, M, W, T> {
    fn new(
        filaments: &'a [Filament<M, W>],
        closed: &'a [LaneSet],
        starts: &'a [Vec<usize>],
        time: T,
    ) -> Self {
        let frictional = filaments
            .iter()
            .any(|filament| filament.law.friction != 0.0);
        let empty = closed.iter().all(|lanes| lanes.is_empty());
        let (closed, on_edges) = closed.split_at(filaments[0].chain.segments());
        Self {
            filaments,
            closed,
            on_edges,
            starts,
            empty,
            frictional,
            time,
        }
    }

    /// Calls `take` with each segment that touches an edge, and its closed contacts with that edge
    /// by lane.
    fn for_each_segment(
        &self,
        nodes: &dyn NodeMotion,
        mut take: impl FnMut(usize, &Edges<'_, M, W>),
    ) {
        for (edge, lanes) in self.on_edges.iter().enumerate() {
            let mut group = Edges {
                edge,
                contacts: [const { None }; LANES],
            };
            for lane in lanes.iter() {
                let (filament, time) = (&self.filaments[lane], self.time.lane(lane));
                let (edge, start) = (&filament.workpiece.edges()[edge], self.starts[edge][lane]);
                let contact = filament.edge_contact(
                    edge,
                    &|index| nodes.node(index, lane),
                    Some(start),
                    time,
                );
                group.contacts[lane] = Some((filament, contact));
            }
            while let Some(segment) = group
                .contacts
                .iter()
                .flatten()
                .map(|(_, contact)| contact.station.segment)
                .next()
            {
                let rest = group.leave(segment);
                take(segment, &group);
                group = rest;
            }
        }
    }

    /// Applies `set` to `none` for each lane in which a node is closed. Returns `None` if it is
    /// closed in no lane.
    #[inline(always)]
    fn of_node<R>(
        &self,
        node: usize,
        [position, velocity]: [[T; 3]; 2],
        none: R,
        set: impl Fn(&mut R, usize, &ContactLaw, &Approach),
    ) -> Option<R> {
        if self.closed[node].is_empty() {
            return None;
        }
        let mut result = none;
        for lane in self.closed[node].iter() {
            let (filament, position, velocity) = (
                &self.filaments[lane],
                in_lane(&position, lane),
                in_lane(&velocity, lane),
            );
            set(
                &mut result,
                lane,
                &filament.law,
                &filament.approach(node, position, velocity, self.time.lane(lane)),
            );
        }
        Some(result)
    }
}

/// Closed contacts with one edge by lane, on one segment or on several.
struct Edges<'a, M, W> {
    edge: usize,
    contacts: [Option<(&'a Filament<M, W>, EdgeContact)>; LANES],
}

impl<M, W> Edges<'_, M, W> {
    /// Keeps the contacts on `segment`, and returns the others.
    fn leave(&mut self, segment: usize) -> Self {
        let mut rest = Self {
            edge: self.edge,
            contacts: [const { None }; LANES],
        };
        for (here, there) in self.contacts.iter_mut().zip(&mut rest.contacts) {
            if here
                .as_ref()
                .is_some_and(|(_, contact)| contact.station.segment != segment)
            {
                std::mem::swap(here, there);
            }
        }
        rest
    }

    fn iter(&self) -> impl Iterator<Item = (usize, &Filament<M, W>, &EdgeContact)> {
        let lanes = self.contacts.iter().enumerate();
        lanes.filter_map(|(lane, contact)| {
            contact
                .as_ref()
                .map(|(filament, contact)| (lane, *filament, contact))
        })
    }
}

impl<M: ClampMotion, W: Workpiece, T: Lanewise> NodeLoads<T> for ContactLoads<'_, M, W, T> {
    fn is_empty(&self) -> bool {
        self.empty
    }

    fn loads_points(&self) -> bool {
        self.on_edges.iter().any(|lanes| !lanes.is_empty())
    }

    fn point_loads(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointLoad<T>)) {
        self.for_each_segment(nodes, |segment, group| {
            let mut load = PointLoad {
                segment,
                fraction: T::ZERO,
                force: zero(),
            };
            for (
                lane,
                filament,
                EdgeContact {
                    station, approach, ..
                },
            ) in group.iter()
            {
                load.fraction.set_lane(lane, station.fraction);
                set_vector(
                    &mut load.force,
                    lane,
                    filament.law.force(approach).total(approach),
                );
            }
            add(load);
        });
    }

    fn point_tangents(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<T>)) {
        self.for_each_segment(nodes, |segment, group| {
            let none = NodeTangent {
                position: [zero(); 3],
                velocity: [zero(); 3],
            };
            let mut tangent = PointTangent {
                segment,
                ends: [[none; 2]; 2],
            };
            for (lane, filament, contact) in group.iter() {
                let edge = &filament.workpiece.edges()[group.edge];
                let change = contact.tangent(&filament.law, edge, &|index| nodes.node(index, lane));
                for (ends, change) in tangent.ends.iter_mut().zip(&change) {
                    for (end, change) in ends.iter_mut().zip(change) {
                        set_tangent(end, lane, change);
                    }
                }
            }
            add(tangent);
        });
    }

    fn point_dampings(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointDamping<T>)) {
        self.for_each_segment(nodes, |segment, group| {
            let none = T::ZERO;
            let mut load = PointDamping {
                segment,
                fraction: none,
                damping: none,
            };
            for (
                lane,
                filament,
                EdgeContact {
                    station, approach, ..
                },
            ) in group.iter()
            {
                load.fraction.set_lane(lane, station.fraction);
                load.damping
                    .set_lane(lane, filament.law.lateral_damping(approach));
            }
            add(load);
        });
    }

    fn lanes(&self) -> Option<&[LaneSet]> {
        Some(self.closed)
    }

    fn resists_lateral_motion(&self) -> bool {
        self.frictional
    }

    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]> {
        self.of_node(
            node,
            [position, velocity],
            zero(),
            |force, lane, law, approach| {
                set_vector(force, lane, law.force(approach).total(approach));
            },
        )
    }

    fn lateral_damping(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<T> {
        if !self.frictional {
            return None;
        }
        self.of_node(
            node,
            [position, velocity],
            T::ZERO,
            |damping, lane, law, approach| {
                damping.set_lane(lane, law.lateral_damping(approach));
            },
        )
    }

    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>> {
        let none = NodeTangent {
            position: [zero(); 3],
            velocity: [zero(); 3],
        };
        self.of_node(
            node,
            [position, velocity],
            none,
            |tangent, lane, law, approach| {
                set_tangent(tangent, lane, &law.tangent(approach));
            },
        )
    }
}

fn set_vector<T: Lanewise>(vector: &mut [T; 3], lane: usize, values: [f64; 3]) {
    for (component, value) in vector.iter_mut().zip(values) {
        component.set_lane(lane, value);
    }
}

fn set_tangent<T: Lanewise>(tangent: &mut NodeTangent<T>, lane: usize, values: &NodeTangent<f64>) {
    for row in 0..3 {
        set_vector(&mut tangent.position[row], lane, values.position[row]);
        set_vector(&mut tangent.velocity[row], lane, values.velocity[row]);
    }
}
