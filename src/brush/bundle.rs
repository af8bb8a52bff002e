//! Filaments in contact with the workpiece and with each other: their equations at one instant, and their solution.
//!
//! Filaments are in groups, one per lane. Everything is done group by group, on as many threads as there are: each group takes the forces
//! of its own points on other filaments, and of the points of others on its own. Sums have an order of their own, so that results do not
//! depend on the number of threads.

use std::ops::AddAssign;

use std::sync::atomic::{AtomicUsize, Ordering};

use super::candidates::{Candidates, Layout};
use super::field::{Changes, Field, GroupField, Lane, Node, Place, wide};
use super::gmres::{self, Coupled, Division, Krylov, Vector};
use super::presses::{Press, PressLaw, PressTangent};
use super::team;
use crate::equations::linear::{add, dot, scale, sub, zero};
use crate::equations::{
    Chain, ChainDynamics, Clamp, LANES, LaneSet, Lanewise, NodeLoads, NodeMotion, NodeTangent, PointTangent, PolarAxis,
    Real, StepWeights,
};
use crate::simulation::{ContactSum, Equations, Filament, Form};
use crate::tool::ClampMotion;
use crate::workpiece::{Part, Workpiece};

/// So much farther behind, filaments have no part in what happens, in rad.
pub const BEHIND: f64 = 0.15;

/// Filaments side by side in lanes. Lanes that are left over repeat the last filament, without loads.
struct Group {
    /// Its number.
    index: usize,
    equations: Equations<Lane>,
    /// When the clamps were last evaluated, in s, and their motion then.
    time: Option<f64>,
    clamp: Clamp<Lane>,
    /// The first filament.
    first: usize,
    /// The number of filaments.
    count: usize,
    /// The weights of the step and the contacts of each filament for which the matrix was factorised.
    factorised: Option<([u64; 2], [u64; LANES])>,
    changes: Changes,
    activity: Activity,
    /// Largest displacement of a node with the last correction, in m/rad of the accelerations' unit.
    largest: f64,
}

/// What a group needs in an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activity {
    /// Its straight filaments have not been touched yet: they turn with the body, and have no equations to solve.
    Rests,
    /// Its filaments have left the workpiece for good, and those behind them, too: they turn with the body in the shape that they have,
    /// and nothing touches them.
    Left,
    /// Its equations are solved for this stage.
    Solved,
    /// Its equations are to be solved by themselves.
    Alone,
    /// The same, together with those of other groups.
    Coupled,
}

/// The loads of a group.
struct GroupLoads<'a> {
    /// By node, from the root.
    forces: &'a [[Lane; 3]],
    /// For a factorisation.
    changes: Option<&'a Changes>,
}

impl NodeLoads<Lane> for GroupLoads<'_> {
    fn loads_points(&self) -> bool {
        self.changes.is_some()
    }

    fn point_tangents(&self, _: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<Lane>)) {
        let none = [zero(); 3];
        for (segment, ends) in self.changes.iter().flat_map(|changes| changes.blocks()) {
            let [[a, b], [c, d]] = ends;
            let at = |position: &[[Lane; 3]; 3]| NodeTangent { position: *position, velocity: none };
            add(PointTangent { segment, ends: [[at(a), at(b)], [at(c), at(d)]] });
        }
    }

    fn force(&self, node: usize, _: [Lane; 3], _: [Lane; 3]) -> Option<[Lane; 3]> {
        Some(self.forces[node + 1])
    }

    fn tangent(&self, _: usize, _: [Lane; 3], _: [Lane; 3]) -> Option<NodeTangent<Lane>> {
        None
    }
}

/// What the filaments of a group meet, where they were placed.
struct Surroundings<'a, M> {
    bristles: &'a [Filament<M, Part>],
    positions: &'a Field,
    velocities: &'a Field,
    presses: &'a [Vec<([usize; 2], Press)>],
    incoming: &'a [Vec<[u32; 2]>],
    candidates: &'a Candidates,
    time: f64,
}

impl<M> Surroundings<'_, M> {
    /// Position and velocity of a node.
    fn node(&self, node: Node) -> [[f64; 3]; 2] {
        [self.positions.at(node), self.velocities.at(node)]
    }
}

/// The force of the workpiece on one filament.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorkpieceLoad {
    /// Of all contacts.
    pub sum: ContactSum,
    /// Power of a moving workpiece in W.
    pub moving_power: f64,
    /// Energy stored in J.
    pub energy: f64,
    /// The deepest penetration of its possible contacts in m; negative where there is none. Not known far from the workpiece: minus
    /// infinity.
    pub pressing: f64,
    /// The deepest penetration of an edge in m.
    pub edge_penetration: f64,
    /// The edge that is worked on most.
    pub worked: Option<WorkedEdge>,
}

impl WorkpieceLoad {
    /// Far from the workpiece.
    pub fn none() -> Self {
        Self { pressing: f64::NEG_INFINITY, ..Self::default() }
    }
}

/// Where and how much an edge is worked on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorkedEdge {
    /// Its index.
    pub edge: usize,
    /// The place on it, from 0 to 1.
    pub place: f64,
    /// `F_n |v_t|` there in W.
    pub power: f64,
}

/// Coordinates, rates and accelerations of all filaments, group by group.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Time in s.
    pub time: f64,
    /// Coordinates in rad.
    pub q: Vector,
    /// Their rates in rad/s.
    pub v: Vector,
    /// Their accelerations in rad/s².
    pub accelerations: Vector,
}

/// How far a filament is from the workpiece.
#[derive(Clone, Copy, Debug)]
struct Clearance {
    /// How fast it can go relative to the workpiece in m/s, if it turns with the body; infinite where a workpiece does not only translate.
    speed: f64,
    /// Velocity of the workpiece in m/s.
    workpiece_velocity: [f64; 3],
    /// Before this time, in s, the filament does not meet the workpiece.
    first_contact: f64,
    /// When it was last looked at, in s.
    time: f64,
    /// How far its nodes had then gone relative to the body, in m.
    way: f64,
    /// The distance of the nearest node in m.
    gap: f64,
}

impl Clearance {
    /// Filaments that are nearer than this to the workpiece are always looked at, in m: when their contact begins is found from how near
    /// they were before.
    const NOTICED: f64 = 1e-3;

    /// Unknown.
    fn new<M: ClampMotion>(bristle: &Filament<M, Part>, rate: f64) -> Self {
        let Filament { chain, motion, workpiece, .. } = bristle;
        let [x, y, _] = motion.at(0.0).position;
        let radius = x.hypot(y) + chain.length * chain.segments() as f64;
        let workpiece_velocity = workpiece.surface([0.0; 3], 0.0).velocity;
        let along = dot(workpiece_velocity, workpiece_velocity).sqrt();
        let speed = if workpiece.translates() { radius * rate.abs() + along } else { f64::INFINITY };
        Self {
            speed,
            workpiece_velocity,
            first_contact: f64::NEG_INFINITY,
            time: 0.0,
            way: 0.0,
            gap: f64::NEG_INFINITY,
        }
    }

    /// Whether the filament is surely farther away than [`Clearance::NOTICED`] at `time` (s), where it has gone `way` (m).
    fn is_sure(&self, time: f64, way: f64) -> bool {
        // A gap changes by at most twice the way.
        self.gap - 2.0 * ((way - self.way) + self.speed * (time - self.time).abs()) > Self::NOTICED
    }
}

/// What all filaments have together, and what they exchange with their surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Energy of the filaments and their contacts in J.
    pub energy: f64,
    /// Momentum of the filaments in N s.
    pub momentum: [f64; 3],
    /// What goes in and out.
    pub exchange: Exchange,
}

impl Budget {
    fn add(&mut self, other: &Self) {
        let Exchange { work, taken, force, strength } = other.exchange;
        self.energy += other.energy;
        self.momentum = add(self.momentum, other.momentum);
        let exchange = &mut self.exchange;
        exchange.work += work;
        exchange.taken += taken;
        exchange.force = add(exchange.force, force);
        exchange.strength += strength;
    }
}

/// What filaments exchange with their surroundings at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exchange {
    /// Power of the clamps and of a moving workpiece in W.
    pub work: f64,
    /// Power that joints and contacts take, in W.
    pub taken: f64,
    /// Force of clamps, workpiece and gravity in N. What filaments do to each other is not in it.
    pub force: [f64; 3],
    /// The sum of the magnitudes of the forces of the workpiece in N.
    pub strength: f64,
}

/// The work of a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Iterations of Newton's method.
    pub newton_iterations: usize,
    /// Vectors of the linear solutions.
    pub krylov_vectors: usize,
    /// Factorisations of the matrices of a group.
    pub factorisations: usize,
}

impl AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.newton_iterations += other.newton_iterations;
        self.krylov_vectors += other.krylov_vectors;
        self.factorisations += other.factorisations;
    }
}

/// Filaments that touch each other.
pub struct Bundle<M> {
    bristles: Vec<Filament<M, Part>>,
    groups: Vec<Group>,
    law: PressLaw,
    /// Whether there is friction, whose tangents change from iteration to iteration.
    rubs: bool,
    layout: Layout,
    /// Rate at which the body turns about `z`, in rad/s.
    rate: f64,
    candidates: Candidates,
    positions: Field,
    velocities: Field,
    displacements: Field,
    forces: Field,
    residual: Vector,
    /// Where filaments press on each other, by the group of the point, with both filaments.
    presses: Vec<Vec<([usize; 2], Press)>>,
    /// The same in the evaluation before.
    earlier: Vec<Vec<([usize; 2], Press)>>,
    tangents: Vec<Vec<PressTangent>>,
    /// By group, which presses are on it: the group of the point, and the index there.
    incoming: Vec<Vec<[u32; 2]>>,
    loads: Vec<WorkpieceLoad>,
    budgets: Vec<Budget>,
    clearances: Vec<Clearance>,
    /// From when on, in s, each filament may leave.
    last_contacts: Vec<f64>,
    krylov: Krylov,
    /// Which groups are solved together.
    coupled: Vec<bool>,
    /// Scratch: the charts of a group.
    charts: Vec<PolarAxis>,
}

/// Newton's method did not converge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoConvergence;

impl<M: ClampMotion + Sync> Bundle<M> {
    /// Filaments with equations of the given form, that press on each other under `law`, on a body that turns at `rate` (rad/s) about
    /// `z`. If `at_rest`, they turn rigidly with it as long as nothing touches them.
    ///
    /// # Panics
    /// If there is no filament, or if their numbers of segments differ.
    pub fn new(
        form: Form,
        bristles: Vec<Filament<M, Part>>,
        law: PressLaw,
        layout: Layout,
        rate: f64,
        at_rest: bool,
    ) -> Self {
        let n = layout.segments;
        assert!(!bristles.is_empty() && bristles.iter().all(|bristle| bristle.chain.segments() == n));
        let groups: Vec<Group> = (0..bristles.len())
            .step_by(LANES)
            .enumerate()
            .map(|(index, first)| {
                let count = LANES.min(bristles.len() - first);
                let bristle = |lane: usize| &bristles[first + lane.min(count - 1)];
                Group {
                    index,
                    equations: Equations::new(form, Chain::from_lanes(|lane| &bristle(lane).chain)),
                    time: None,
                    clamp: Clamp::from_lanes(|lane| bristle(lane).motion.at(0.0)),
                    first,
                    count,
                    factorised: None,
                    changes: Changes::new(n),
                    activity: if at_rest { Activity::Rests } else { Activity::Solved },
                    largest: 0.0,
                }
            })
            .collect();
        let field = Field::new(groups.len(), n);
        Self {
            rubs: law.friction > 0.0 || bristles.iter().any(|bristle| bristle.law.friction > 0.0),
            law,
            rate,
            candidates: Candidates::new(layout.clone()),
            positions: field.clone(),
            velocities: field.clone(),
            displacements: field.clone(),
            forces: field,
            residual: vec![[Lane::from_lanes(|_| 0.0); 2]; groups.len() * n],
            presses: vec![Vec::new(); groups.len()],
            earlier: vec![Vec::new(); groups.len()],
            tangents: vec![Vec::new(); groups.len()],
            incoming: vec![Vec::new(); groups.len()],
            loads: vec![WorkpieceLoad::none(); bristles.len()],
            budgets: vec![Budget::default(); groups.len()],
            clearances: bristles.iter().map(|bristle| Clearance::new(bristle, rate)).collect(),
            last_contacts: vec![f64::INFINITY; bristles.len()],
            krylov: Krylov::default(),
            coupled: Vec::with_capacity(groups.len()),
            charts: Vec::with_capacity(n),
            layout,
            groups,
            bristles,
        }
    }

    /// The filaments.
    pub fn bristles(&self) -> &[Filament<M, Part>] {
        &self.bristles
    }

    /// Whether all filaments move in their planes.
    fn is_planar(&self) -> bool {
        self.groups[0].equations.form() == Form::Planar
    }

    /// The number of segments of a filament.
    pub fn segments(&self) -> usize {
        self.layout.segments
    }

    /// Sets when each filament may meet the workpiece for the first time, in s.
    pub fn set_first_contacts(&mut self, times: Vec<f64>) {
        for (clearance, time) in self.clearances.iter_mut().zip(times) {
            clearance.first_contact = time;
        }
    }

    /// Sets from when on, in s, the contact of each filament with the workpiece no longer counts, so that it may be
    /// [left out](Self::leave_out). Without, all of them stay.
    pub fn set_last_contacts(&mut self, times: Vec<f64>) {
        self.last_contacts = times;
    }

    /// Leaves out the groups that no longer have a part in what counts: they turn with the body from now on. Returns whether there are
    /// new ones.
    ///
    /// A filament reaches no farther than its length, so that one whose root is farther from the workpiece does not touch it, whatever
    /// its shape. It is left out once the body has turned on by [`BEHIND`], so that those behind it, on which it might press, do not touch it
    /// either. Whether it is left out depends on the time alone, and so does a run that is resumed.
    pub fn leave_out(&mut self, motion: &mut Motion) -> bool {
        let n = self.layout.segments;
        let Self { groups, bristles, candidates, last_contacts, rate, .. } = self;
        let now = motion.time;
        let times = [now, now - BEHIND / rate.abs()];
        let is_out_of_reach = |filament: usize| {
            let Filament { chain, motion, law, workpiece } = &bristles[filament];
            let reach = chain.length * chain.segments() as f64 + law.radius;
            now >= last_contacts[filament]
                && times.iter().all(|time| workpiece.surface(motion.at(*time).position, *time).gap > reach)
        };
        let mut any = false;
        for group in groups.iter_mut() {
            let mut filaments = group.first..group.first + group.count;
            let turns = group.equations.charts().iter().all(|chart| *chart == PolarAxis::Z);
            let stays = matches!(group.activity, Activity::Left | Activity::Rests) || !turns;
            if stays || !filaments.all(is_out_of_reach) {
                continue;
            }
            any = true;
            group.activity = Activity::Left;
            let blocks = group.index * n..(group.index + 1) * n;
            motion.v[blocks.clone()].fill([zero_lane(), Lane::from_f64(*rate)]);
            motion.accelerations[blocks].fill([zero_lane(); 2]);
            candidates.leave_out(group.index);
        }
        any
    }

    /// Position of a node in m, where it was last evaluated; 0 is the root.
    pub fn node(&self, filament: usize, k: usize) -> [f64; 3] {
        self.positions.at(Node::new(filament, k, self.layout.segments))
    }

    /// The forces of the workpiece on each filament, in the last evaluation.
    pub fn loads(&self) -> &[WorkpieceLoad] {
        &self.loads
    }

    /// Where filaments press on each other, in the last evaluation: both filaments, that of the point first.
    pub fn presses(&self) -> impl Iterator<Item = &([usize; 2], Press)> {
        self.presses.iter().flatten()
    }

    /// The distance of a point from the root of its filament in m.
    pub fn arc_length(&self, place: &Place) -> f64 {
        let n = self.layout.segments;
        let length = self.layout.lengths[place.segment.filament(n)];
        (place.segment.index(n) as f64 + place.fraction) * length
    }

    /// Forgets factorisations, so that what follows does not depend on where they were made. Neither does it depend on anything else that
    /// is kept: how far filaments may go before they touch only saves work.
    pub fn forget(&mut self) {
        for group in &mut self.groups {
            group.factorised = None;
        }
    }

    /// Lets all groups sleep that nothing touches yet: they turn with the body, and nothing is computed of them until they are woken.
    pub fn fall_asleep(&mut self) {
        for Group { index, activity, .. } in &self.groups {
            let meets_none = self.presses[*index].is_empty() && self.incoming[*index].is_empty();
            if *activity == Activity::Rests && meets_none {
                self.candidates.set_asleep(*index, true);
            }
        }
    }

    /// Wakes the groups that may meet the workpiece until `time` (s), or that others may come near. Returns whether there are any.
    pub fn wake(&mut self, time: f64) -> bool {
        let Self { groups, clearances, candidates, .. } = self;
        let mut any = candidates.wake_wanted();
        for group in groups.iter().filter(|group| group.activity == Activity::Rests) {
            let mut clearances = clearances[group.first..group.first + group.count].iter();
            if candidates.is_asleep(group.index) && clearances.any(|clearance| clearance.first_contact <= time) {
                candidates.set_asleep(group.index, false);
                any = true;
            }
        }
        any
    }

    /// Whether a group sleeps that others may come near.
    pub fn must_wake(&self) -> bool {
        self.candidates.is_any_wanted()
    }

    /// Whether a group sleeps.
    pub fn is_asleep(&self, group: usize) -> bool {
        self.candidates.is_asleep(group)
    }

    /// Places the groups that sleep, too.
    pub fn place_all(&mut self, motion: &Motion) {
        let n = self.layout.segments;
        let Self { groups, positions, velocities, bristles, candidates, .. } = self;
        for group in groups.iter_mut().filter(|group| candidates.is_asleep(group.index)) {
            let (at, nodes) = (group.index * n, group.index * (n + 1));
            let vectors = [&mut positions.0[nodes..][..=n], &mut velocities.0[nodes..][..=n]];
            group.place(bristles, motion.time, [&motion.q[at..][..n], &motion.v[at..][..n]], vectors);
        }
    }

    /// What each group does, as a number, to be [restored](Self::set_states).
    pub fn states(&self) -> Vec<usize> {
        let state = |group: &Group| match group.activity {
            Activity::Left => 3,
            Activity::Rests if self.is_asleep(group.index) => 2,
            Activity::Rests => 1,
            _ => 0,
        };
        self.groups.iter().map(state).collect()
    }

    /// Sets what each group does.
    pub fn set_states(&mut self, states: &[usize]) {
        for (group, state) in self.groups.iter_mut().zip(states) {
            self.candidates.set_asleep(group.index, *state > 1);
            group.activity = match state {
                1 | 2 => Activity::Rests,
                3 => Activity::Left,
                _ => Activity::Solved,
            };
            if *state == 3 {
                self.candidates.leave_out(group.index);
            }
        }
    }

    /// The charts of the coordinates, group by group.
    pub fn charts(&self) -> Vec<PolarAxis> {
        self.groups.iter().flat_map(|group| group.equations.charts().iter().copied()).collect()
    }

    /// Takes coordinates about `charts` from now on.
    pub fn set_charts(&mut self, charts: &[PolarAxis]) {
        for (group, charts) in self.groups.iter_mut().zip(charts.chunks(self.layout.segments)) {
            group.equations.set_charts(charts);
        }
    }

    /// The motion at `time` (s), where each filament has the given coordinates about `z` and rates.
    pub fn start(&mut self, time: f64, coordinates: impl Fn(usize) -> [Vec<[f64; 2]>; 2]) -> Motion {
        let (n, groups) = (self.layout.segments, self.groups.len());
        let none = vec![[Lane::from_lanes(|_| 0.0); 2]; groups * n];
        let mut motion = Motion { time, q: none.clone(), v: none.clone(), accelerations: none };
        for (index, group) in self.groups.iter().enumerate() {
            for lane in 0..LANES {
                let [q, v] = coordinates(group.first + lane.min(group.count - 1));
                for k in 0..n {
                    for i in 0..2 {
                        motion.q[index * n + k][i].set_lane(lane, q[k][i]);
                        motion.v[index * n + k][i].set_lane(lane, v[k][i]);
                    }
                }
            }
        }
        self.leave_poles(&mut motion);
        self.evaluate(&motion);
        let Self { groups, forces, .. } = self;
        for (index, group) in groups.iter_mut().enumerate() {
            let at = index * n..(index + 1) * n;
            let loads = GroupLoads { forces: &forces.0[index * (n + 1)..][..=n], changes: None };
            let (q, v, accelerations) = (&motion.q[at.clone()], &motion.v[at.clone()], &mut motion.accelerations[at]);
            if group.activity != Activity::Rests {
                group.equations.accelerations(group.clamp.holding(q, v), &loads, accelerations);
            }
        }
        motion
    }

    /// Puts the lanes that are left over where the filament is that they repeat: nothing is solved for them, so that they would leave it.
    pub fn fill_lanes(&self, motion: &mut Motion) {
        let n = self.layout.segments;
        for (index, group) in self.groups.iter().enumerate().filter(|(_, group)| group.count < LANES) {
            for vector in [&mut motion.q, &mut motion.v, &mut motion.accelerations] {
                for value in vector[index * n..][..n].iter_mut().flatten() {
                    let last = value.lane(group.count - 1);
                    (group.count..LANES).for_each(|lane| value.set_lane(lane, last));
                }
            }
        }
    }

    /// Switches segments near a pole of their coordinates to their other chart, all those of a group together, where that is better for
    /// the one that is nearest to a pole.
    pub fn leave_poles(&mut self, motion: &mut Motion) {
        /// By how much the least sine must be larger in the other chart.
        const BETTER: f64 = 2.0;
        /// Above this least sine, a chart is good enough.
        const GOOD: f64 = 0.3;
        let n = self.layout.segments;
        let Self { groups, charts, candidates, .. } = self;
        for (index, group) in groups.iter_mut().enumerate() {
            if group.equations.form() == Form::Planar || candidates.is_asleep(index) {
                continue;
            }
            charts.clear();
            charts.extend_from_slice(group.equations.charts());
            let mut has_changed = false;
            for (k, chart) in charts.iter_mut().enumerate() {
                let at = index * n + k;
                let sine = |lane: usize| motion.q[at][0].lane(lane).sin().abs();
                let least = (0..LANES).map(sine).fold(f64::INFINITY, f64::min);
                if least > GOOD {
                    continue;
                }
                let turned: [_; LANES] = std::array::from_fn(|lane| {
                    let block = |vector: &Vector| vector[at].map(|value| value.lane(lane));
                    let blocks = [block(&motion.q), block(&motion.v), block(&motion.accelerations)];
                    chart.other().coordinates(chart.direction(blocks))
                });
                let other = turned.iter().map(|[q, ..]| q[0].sin().abs()).fold(f64::INFINITY, f64::min);
                if other < BETTER * least {
                    continue;
                }
                for (lane, blocks) in turned.iter().enumerate() {
                    for (vector, block) in
                        [&mut motion.q, &mut motion.v, &mut motion.accelerations].into_iter().zip(blocks)
                    {
                        for (value, turned) in vector[at].iter_mut().zip(block) {
                            value.set_lane(lane, *turned);
                        }
                    }
                }
                *chart = chart.other();
                has_changed = true;
            }
            if has_changed {
                group.equations.set_charts(charts);
                group.factorised = None;
            }
        }
    }

    /// Places all filaments, and evaluates all contacts.
    pub fn evaluate(&mut self, motion: &Motion) {
        self.begin_stage();
        self.place(motion);
        self.find_presses(motion.time, None, true);
        self.add_loads(motion.time);
    }

    fn begin_stage(&mut self) {
        for group in &mut self.groups {
            if !matches!(group.activity, Activity::Rests | Activity::Left) {
                group.activity = Activity::Alone;
            }
        }
    }

    fn place(&mut self, motion: &Motion) {
        let n = self.layout.segments;
        let Self { groups, positions, velocities, bristles, candidates, .. } = self;
        let Motion { q, v, time, .. } = motion;
        let parts = groups
            .iter_mut()
            .zip(q.chunks(n))
            .zip(v.chunks(n))
            .zip(positions.0.chunks_mut(n + 1))
            .zip(velocities.0.chunks_mut(n + 1));
        team::for_each(parts.enumerate(), |((((group, q), v), positions), velocities)| {
            if group.activity != Activity::Solved && !candidates.is_asleep(group.index) {
                group.place(bristles, *time, [q, v], [positions, velocities]);
            }
        });
    }

    /// Finds where filaments press on each other, where they were placed; with `weights` also how their forces change along a step.
    /// All groups were placed if these `are_all`, otherwise those that are being solved.
    fn find_presses(&mut self, time: f64, weights: Option<[f64; 2]>, are_all: bool) {
        let n = self.layout.segments;
        let Self {
            candidates, positions, velocities, presses, earlier, tangents, incoming, groups, law, layout, ..
        } = self;
        let moved = |group: usize| are_all || matches!(groups[group].activity, Activity::Alone | Activity::Coupled);
        candidates.update(positions, self.rate * time, moved);
        // By the motion of the positions: solutions multiply by its weight.
        let relative = weights.map(|[by_position, by_rate]| [1.0, by_rate / by_position]);
        std::mem::swap(presses, earlier);
        let parts = candidates.by_group().zip(&mut *presses).zip(&*earlier).zip(&mut *tangents);
        team::for_each(parts.enumerate(), |(((watched, presses), earlier), tangents)| {
            presses.clear();
            let mut earlier = earlier.iter().peekable();
            watched.for_each_near(|filaments, near| {
                let mut press = Press::new(law, near, layout.part_length(filaments[0]), [positions, velocities]);
                let key = (filaments, near.point.key());
                while earlier.next_if(|(filaments, before)| (*filaments, before.near.point.key()) < key).is_some() {}
                let before = earlier.next_if(|(filaments, before)| (*filaments, before.near.point.key()) == key);
                before.into_iter().for_each(|(_, before)| press.follow(before));
                presses.push((filaments, press));
            });
            tangents.clear();
            if let Some(relative) = relative {
                tangents.extend(presses.iter().map(|(_, press)| press.tangent(law, relative)));
            }
        });
        incoming.iter_mut().for_each(Vec::clear);
        for group in groups.iter_mut().filter(|group| group.activity == Activity::Coupled) {
            group.activity = Activity::Alone;
        }
        for (own, presses) in presses.iter().enumerate() {
            for (index, (_, press)) in presses.iter().enumerate() {
                let other = press.near.nearest.segment.group(n);
                incoming[other].push([own as u32, index as u32]);
                groups[other].activity = Activity::Coupled;
            }
            if !presses.is_empty() {
                groups[own].activity = Activity::Coupled;
            }
        }
    }

    /// Adds up the forces on all filaments.
    fn add_loads(&mut self, time: f64) {
        let n = self.layout.segments;
        let Self {
            groups,
            forces,
            loads,
            clearances,
            positions,
            velocities,
            bristles,
            presses,
            incoming,
            candidates,
            ..
        } = self;
        let around = Surroundings { bristles, positions, velocities, presses, incoming, candidates, time };
        let parts = forces.0.chunks_mut(n + 1).zip(loads.chunks_mut(LANES)).zip(clearances.chunks_mut(LANES));
        let parts = groups.iter().zip(parts).filter(|(group, _)| !candidates.is_asleep(group.index));
        team::for_each(parts.map(|part| (part.0.index, part)), |(group, ((forces, loads), clearances))| {
            group.meet(&around, loads, clearances, &mut GroupField::new(group.index, n, forces));
        });
    }

    /// What the filaments have that do not sleep, and what they exchange with their surroundings.
    pub fn budget(&mut self, motion: &Motion) -> Budget {
        let n = self.layout.segments;
        self.evaluate(motion);
        let Self { groups, forces, residual, bristles, velocities, loads, budgets, presses, candidates, .. } = self;
        let Motion { q, v, accelerations, .. } = motion;
        let (velocities, loads, presses) = (&*velocities, &*loads, &*presses);
        let parts = groups
            .iter_mut()
            .zip(q.chunks(n).zip(v.chunks(n)).zip(accelerations.chunks(n)))
            .zip(forces.0.chunks(n + 1).zip(residual.chunks_mut(n)))
            .zip(&mut *budgets);
        team::for_each(parts.enumerate(), |(((group, ((q, v), accelerations)), (forces, residual)), budget)| {
            *budget = Budget::default();
            if !candidates.is_asleep(group.index) {
                group.residual([q, v, accelerations], forces, residual);
                group.add_budget(bristles, [q, v], velocities, forces[0], loads, budget);
                for (_, press) in &presses[group.index] {
                    budget.energy += press.energy();
                    budget.exchange.taken += press.dissipated;
                }
            }
        });
        budgets.iter().fold(Budget::default(), |mut sum, budget| {
            sum.add(budget);
            sum
        })
    }

    /// Solves the equations of a stage for `motion.accelerations`: `q` and `v` are `base` and their products with `weights`.
    ///
    /// The solution is good enough once the last correction of any node's velocity is below `tolerance` (m/s).
    ///
    /// # Errors
    /// If Newton's method does not converge.
    pub fn solve_stage(
        &mut self,
        motion: &mut Motion,
        [base_q, base_v]: [&Vector; 2],
        weights: [f64; 2],
        tolerance: f64,
    ) -> Result<Effort, NoConvergence> {
        /// Iterations after which a step had better be shorter.
        const MOST: usize = 14;
        let mut effort = Effort::default();
        self.begin_stage();
        self.candidates.drift(f64::INFINITY);
        // A solution depends on nothing before its stage.
        self.presses.iter_mut().for_each(Vec::clear);
        while effort.newton_iterations < MOST {
            effort.newton_iterations += 1;
            let is_first = effort.newton_iterations == 1;
            self.follow(motion, [base_q, base_v], weights, is_first);
            self.find_presses(motion.time, Some(weights), is_first);
            if self.must_wake() {
                return Err(NoConvergence);
            }
            effort.factorisations += self.linearise(motion, weights, is_first);
            effort.krylov_vectors += self.solve_coupled(weights[0]).ok_or(NoConvergence)?;
            let correction = self.correct(motion, weights[1], tolerance);
            // Twice what the linearised motion is.
            self.candidates.drift(2.0 * weights[0] * correction);
            let largest = weights[1] * correction;
            if !largest.is_finite() {
                return Err(NoConvergence);
            }
            if largest <= tolerance {
                wide(
                    #[inline(always)]
                    || {
                        for (k, acceleration) in motion.accelerations.iter().enumerate() {
                            follow(&mut motion.q[k], &base_q[k], weights[0], acceleration);
                            follow(&mut motion.v[k], &base_v[k], weights[1], acceleration);
                        }
                    },
                );
                return Ok(effort);
            }
        }
        Err(NoConvergence)
    }

    /// Places the groups that are not solved yet by their accelerations; those at rest only in the first iteration.
    fn follow(&mut self, motion: &mut Motion, [base_q, base_v]: [&Vector; 2], weights: [f64; 2], is_first: bool) {
        let n = self.layout.segments;
        let Self { groups, positions, velocities, bristles, candidates, .. } = self;
        let Motion { time, q, v, accelerations } = motion;
        let parts = groups
            .iter_mut()
            .zip(q.chunks_mut(n).zip(base_q.chunks(n)))
            .zip(v.chunks_mut(n).zip(base_v.chunks(n)))
            .zip(accelerations.chunks(n))
            .zip(positions.0.chunks_mut(n + 1))
            .zip(velocities.0.chunks_mut(n + 1));
        team::for_each(
            parts.enumerate(),
            |(((((group, (q, base_q)), (v, base_v)), accelerations), positions), velocities)| {
                let still_rests = group.activity == Activity::Rests && !is_first;
                if group.activity == Activity::Solved || still_rests || candidates.is_asleep(group.index) {
                    return;
                }
                wide(
                    #[inline(always)]
                    || {
                        for (k, acceleration) in accelerations.iter().enumerate() {
                            follow(&mut q[k], &base_q[k], weights[0], acceleration);
                            follow(&mut v[k], &base_v[k], weights[1], acceleration);
                        }
                    },
                );
                group.place(bristles, *time, [q, v], [positions, velocities]);
            },
        );
    }

    /// Computes the residual, and factorises the matrices of the groups whose filaments have other contacts than those for which it was
    /// done before. Solves the equations of those that are alone. Returns the number of factorisations.
    fn linearise(&mut self, motion: &Motion, weights: [f64; 2], is_first: bool) -> usize {
        let n = self.layout.segments;
        let Self {
            groups,
            forces,
            loads,
            clearances,
            positions,
            velocities,
            bristles,
            presses,
            tangents,
            incoming,
            residual,
            candidates,
            rubs,
            ..
        } = self;
        let &mut rubs = rubs;
        let Motion { time, q, v, accelerations } = motion;
        let around = Surroundings { bristles, positions, velocities, presses, incoming, candidates, time: *time };
        let factorisations = AtomicUsize::new(0);
        let parts = groups
            .iter_mut()
            .zip(q.chunks(n).zip(v.chunks(n)).zip(accelerations.chunks(n)))
            .zip(forces.0.chunks_mut(n + 1))
            .zip(loads.chunks_mut(LANES).zip(clearances.chunks_mut(LANES)))
            .zip(residual.chunks_mut(n));
        team::for_each(
            parts.enumerate(),
            |((((group, ((q, v), accelerations)), forces), (loads, clearances)), residual)| {
                let meets_none = presses[group.index].is_empty() && incoming[group.index].is_empty();
                let still_rests = group.activity == Activity::Rests && !is_first && meets_none;
                let sleeps = candidates.is_asleep(group.index);
                if group.activity == Activity::Solved || still_rests || sleeps {
                    return;
                }
                let mut forces = GroupField::new(group.index, n, forces);
                let met = group.meet(&around, loads, clearances, &mut forces);
                if group.activity == Activity::Rests {
                    if met == [0; LANES] {
                        return;
                    }
                    group.activity = Activity::Alone;
                }
                let state = [q, v, accelerations];
                group.residual(state, forces.vectors(), residual);
                let key = (weights.map(f64::to_bits), met);
                let is_stale = group.factorised != Some(key) || (rubs && met != [0; LANES]);
                if is_stale {
                    group.changes.clear(group.index);
                    group.add_workpiece_changes(&around, weights, loads);
                    for tangent in &tangents[group.index] {
                        tangent.add_of_point(&mut group.changes);
                    }
                    for &[from, index] in &incoming[group.index] {
                        tangents[from as usize][index as usize].add_of_nearest(&mut group.changes);
                    }
                    group.factorise(state, forces.vectors(), weights);
                    group.factorised = Some(key);
                    factorisations.fetch_add(1, Ordering::Relaxed);
                }
                if group.activity == Activity::Alone {
                    group.equations.solve(residual);
                }
            },
        );
        factorisations.into_inner()
    }

    /// Solves the equations of the coupled groups for the residual, in place. Returns the number of vectors.
    fn solve_coupled(&mut self, by_position: f64) -> Option<usize> {
        /// Share of the residual that the solution may leave, in the plane and in space, where filaments that buckle amplify it: mirror images
        /// would differ.
        const FORCING: [f64; 2] = [0.1, 0.02];
        let n = self.layout.segments;
        let (forcing, first) = if self.is_planar() { (FORCING[0], 1) } else { (FORCING[1], 0) };
        let Self { groups, displacements, forces, tangents, incoming, residual, krylov, coupled, .. } = self;
        coupled.clear();
        coupled.extend(groups.iter().map(|group| group.activity == Activity::Coupled));
        if !coupled.contains(&true) {
            return Some(0);
        }
        let factor = Lane::from_lanes(|_| -by_position);
        let mut coupling = Coupling { groups, displacements, forces, tangents, incoming, segments: n, factor };
        gmres::solve(&mut coupling, residual, forcing, krylov, Division { blocks: n, coupled, first })
    }

    /// Corrects the accelerations. Returns the largest displacement of a node with it, in m/rad of the accelerations' unit. Groups by
    /// themselves whose nodes' velocities change by less than `tolerance` (m/s) are solved.
    fn correct(&mut self, motion: &mut Motion, by_rate: f64, tolerance: f64) -> f64 {
        let n = self.layout.segments;
        let Self { groups, residual, displacements, .. } = self;
        let parts = groups
            .iter_mut()
            .zip(residual.chunks(n))
            .zip(displacements.0.chunks_mut(n + 1))
            .zip(motion.accelerations.chunks_mut(n));
        team::for_each(parts.enumerate(), |(((group, corrections), displacements), accelerations)| {
            group.largest = 0.0;
            if matches!(group.activity, Activity::Solved | Activity::Rests | Activity::Left) {
                return;
            }
            group.displace(corrections, displacements);
            let squares = wide(
                #[inline(always)]
                || {
                    for (acceleration, correction) in accelerations.iter_mut().zip(corrections) {
                        *acceleration = sub(*acceleration, *correction);
                    }
                    let mut most = Lane::from_f64(0.0);
                    for displacement in &displacements[1..] {
                        most = most.max(dot(*displacement, *displacement));
                    }
                    most
                },
            );
            let of_lanes = (0..LANES).map(|lane| squares.lane(lane));
            group.largest = of_lanes.fold(0.0, larger).sqrt();
            if group.activity == Activity::Alone && by_rate * group.largest <= tolerance {
                group.activity = Activity::Solved;
            }
        });
        groups.iter().map(|group| group.largest).fold(0.0, larger)
    }
}

/// The larger one, or one that is not a number.
fn larger(a: f64, b: f64) -> f64 {
    if b <= a { a } else { b }
}

impl Group {
    fn place<M: ClampMotion>(
        &mut self,
        bristles: &[Filament<M, Part>],
        time: f64,
        [q, v]: [&[[Lane; 2]]; 2],
        [positions, velocities]: [&mut [[Lane; 3]]; 2],
    ) {
        if self.time != Some(time) {
            let filament = |lane: usize| &bristles[self.first + lane.min(self.count - 1)];
            self.clamp = M::in_lanes(|lane| &filament(lane).motion, Lane::from_lanes(|_| time));
            self.time = Some(time);
        }
        self.equations.place(self.clamp.holding(q, v));
        (positions[0], velocities[0]) = (self.clamp.position, self.clamp.velocity);
        self.equations.nodes_in_lanes(&mut positions[1..], &mut velocities[1..]);
        if self.equations.form() == Form::Planar {
            // Each filament moves in its own plane.
            for position in &mut positions[1..] {
                position[2] = self.clamp.position[2];
            }
        }
    }

    /// Sums the forces on the filaments. Returns a number for each that tells sets of contacts apart; 0 if it touches nothing.
    fn meet<M: ClampMotion>(
        &self,
        around: &Surroundings<'_, M>,
        loads: &mut [WorkpieceLoad],
        clearances: &mut [Clearance],
        forces: &mut GroupField<'_>,
    ) -> [u64; LANES] {
        forces.clear();
        let mut met = [0; LANES];
        self.meet_workpiece(around, loads, clearances, forces, &mut met);
        self.meet_others(around, forces, &mut met);
        met
    }

    /// Adds the forces of the workpiece, and what touches it to the numbers that tell sets of contacts apart.
    fn meet_workpiece<M: ClampMotion>(
        &self,
        around: &Surroundings<'_, M>,
        loads: &mut [WorkpieceLoad],
        clearances: &mut [Clearance],
        forces: &mut GroupField<'_>,
        met: &mut [u64; LANES],
    ) {
        let (n, time) = (self.equations.segments(), around.time);
        for (lane, (load, clearance)) in loads.iter_mut().zip(clearances).enumerate() {
            let filament = self.first + lane;
            let bristle = &around.bristles[filament];
            *load = WorkpieceLoad::none();
            let way = around.candidates.way(filament);
            if time < clearance.first_contact || clearance.is_sure(time, way) {
                continue;
            }
            let node = |k: usize| Node::new(filament, k, n);
            load.pressing = bristle.for_each_pressing(
                |k| around.node(node(k)),
                time,
                |contact, touch| {
                    let sum = bristle.sum(touch);
                    load.sum += sum;
                    load.energy += bristle.law.stored_energy(&touch.approach);
                    load.moving_power += dot(sum.force, clearance.workpiece_velocity);
                    if touch.on_edge {
                        load.edge_penetration = load.edge_penetration.max(touch.approach.penetration);
                        let power = sum.normal * dot(touch.approach.sliding, touch.approach.sliding).sqrt();
                        if load.worked.is_none_or(|worked| power > worked.power) {
                            let edge = contact - n;
                            let place = bristle.workpiece.edges()[edge].part_before(touch.position, time);
                            load.worked = Some(WorkedEdge { edge, place, power });
                        }
                    }
                    let place = Place { segment: node(touch.station.segment), fraction: touch.station.fraction };
                    place.load(sum.force, forces);
                    mix(&mut met[lane], [contact as u64, touch.station.segment as u64, 0]);
                },
            );
            *clearance = Clearance { time, way, gap: -load.pressing, ..*clearance };
        }
    }

    /// Adds the forces of other filaments, likewise.
    fn meet_others<M>(&self, around: &Surroundings<'_, M>, forces: &mut GroupField<'_>, met: &mut [u64; LANES]) {
        let segments = self.equations.segments();
        let Surroundings { presses, incoming, .. } = around;
        let mut meet = |own: &Place, press: &Press| {
            let near = &press.near;
            let numbers = [near.point.segment.number(), near.nearest.segment.number(), near.point.fraction.to_bits()];
            mix(&mut met[own.segment.filament(segments) % LANES], numbers);
        };
        for (_, press) in &presses[self.index] {
            press.load_point(forces);
            meet(&press.near.point, press);
        }
        for &[from, index] in &incoming[self.index] {
            let (_, press) = &presses[from as usize][index as usize];
            press.load_nearest(forces);
            meet(&press.near.nearest, press);
        }
    }

    fn residual(&mut self, [q, v, accelerations]: [&[[Lane; 2]]; 3], forces: &[[Lane; 3]], residual: &mut [[Lane; 2]]) {
        let loads = GroupLoads { forces, changes: None };
        let at = self.clamp.holding(q, v);
        self.equations.residual(at, accelerations, &loads, residual);
        let is_planar = self.equations.form() == Form::Planar;
        let present = LaneSet::first(self.count);
        wide(
            #[inline(always)]
            || {
                for block in residual {
                    if is_planar {
                        block[0] = zero_lane();
                    }
                    if self.count < LANES {
                        *block = [block[0].select(present, zero_lane()), block[1].select(present, zero_lane())];
                    }
                }
            },
        );
    }

    /// Adds what its filaments have and exchange, once the residual was computed, with forces on the `roots`, which the clamps hold.
    fn add_budget<M>(
        &mut self,
        bristles: &[Filament<M, Part>],
        [q, v]: [&[[Lane; 2]]; 2],
        velocities: &Field,
        roots: [Lane; 3],
        loads: &[WorkpieceLoad],
        budget: &mut Budget,
    ) {
        let n = self.equations.segments();
        let energies = self.equations.energies(self.clamp.holding(q, v));
        let root_force = sub(self.equations.root_force(), roots);
        let power = dot(root_force, self.clamp.velocity) + energies.clamp_torque_power;
        let energy = energies.kinetic + energies.spring + energies.gravity;
        let Budget { energy: sum, momentum, exchange: Exchange { work, taken, force, strength } } = budget;
        for lane in 0..self.count {
            let filament = self.first + lane;
            let load = &loads[filament];
            *sum += energy.lane(lane) + load.energy;
            *work += power.lane(lane) + load.moving_power;
            *taken += 2.0 * energies.dissipation.lane(lane) + load.sum.friction_power + load.sum.damped_power;
            let chain = &bristles[filament].chain;
            let mut mass = 0.0;
            for (k, link) in chain.links.iter().enumerate() {
                let ends = [k, k + 1].map(|k| velocities.at(Node::new(filament, k, n)));
                *momentum = add(*momentum, scale(0.5 * link.mass, add(ends[0], ends[1])));
                mass += link.mass;
            }
            let root = root_force.map(|component| component.lane(lane));
            let outside = add(load.sum.force, scale(mass, chain.gravity));
            *force = add(*force, add(root, outside));
            *strength += dot(load.sum.force, load.sum.force).sqrt();
        }
    }

    fn factorise(&mut self, [q, v, accelerations]: [&[[Lane; 2]]; 3], forces: &[[Lane; 3]], weights: [f64; 2]) {
        let [coordinates, rates] = weights.map(|weight| Lane::from_lanes(|_| weight));
        let step = StepWeights { coordinates, rates };
        let loads = GroupLoads { forces, changes: Some(&self.changes) };
        let at = self.clamp.holding(q, v);
        self.equations.factorise(at, accelerations, &loads, step, LaneSet::first(LANES));
    }

    /// Displacements of all nodes with a change of the coordinates.
    fn displace(&mut self, change: &[[Lane; 2]], displacements: &mut [[Lane; 3]]) {
        self.equations.displacements(change, &mut displacements[1..]);
    }

    /// How the forces of the workpiece on the filaments change with their motion.
    fn add_workpiece_changes<M: ClampMotion>(
        &mut self,
        around: &Surroundings<'_, M>,
        [by_position, by_rate]: [f64; 2],
        loads: &[WorkpieceLoad],
    ) {
        let (segments, time) = (self.equations.segments(), around.time);
        for (filament, load) in (self.first..self.first + self.count).zip(loads) {
            if load.pressing <= 0.0 {
                continue;
            }
            let bristle = &around.bristles[filament];
            let node = |k: usize| Node::new(filament, k, segments);
            bristle.for_each_pressing(
                |k| around.node(node(k)),
                time,
                |_, touch| {
                    let NodeTangent { position, velocity } = bristle.law.tangent(&touch.approach);
                    // The recursion multiplies by the weight of the positions.
                    let change =
                        std::array::from_fn(|row| add(position[row], scale(by_rate / by_position, velocity[row])));
                    self.changes.add_at(node(touch.station.segment), touch.station.shares(), &change);
                },
            );
        }
    }
}

/// The groups that are solved together.
struct Coupling<'a> {
    /// All groups.
    groups: &'a mut [Group],
    displacements: &'a mut Field,
    forces: &'a mut Field,
    tangents: &'a [Vec<PressTangent>],
    incoming: &'a [Vec<[u32; 2]>],
    segments: usize,
    /// The negative weight of the positions in the tangents.
    factor: Lane,
}

impl Coupled for Coupling<'_> {
    fn precondition(
        &mut self,
        x: &mut Vector,
        y: &mut Vector,
        prepare: impl Fn(usize, &mut gmres::Part, &mut gmres::Part) + Sync,
    ) {
        let vectors = x.chunks_mut(self.segments).zip(y.chunks_mut(self.segments));
        let parts = self.groups.iter_mut().zip(vectors).zip(self.displacements.0.chunks_mut(self.segments + 1));
        let parts = parts.filter(|((group, _), _)| group.activity == Activity::Coupled);
        team::for_each(parts.map(|part| (part.0.0.index, part)), |((group, (x, y)), displacements)| {
            prepare(group.index, x, y);
            group.equations.solve(x);
            group.displace(x, displacements);
        });
    }

    fn couple(
        &mut self,
        image: &mut Vector,
        sums: &mut [Vec<f64>],
        combine: impl Fn(usize, &mut gmres::Part, &mut Vec<f64>) + Sync,
    ) {
        let Self { groups, displacements, forces, tangents, incoming, segments, factor } = self;
        let vectors = image.chunks_mut(*segments).zip(sums);
        let parts = groups.iter_mut().zip(vectors).zip(forces.0.chunks_mut(*segments + 1));
        let parts = parts.filter(|((group, _), _)| group.activity == Activity::Coupled);
        team::for_each(parts.map(|part| (part.0.0.index, part)), |((group, (image, sums)), forces)| {
            let mut forces = GroupField::new(group.index, *segments, forces);
            forces.clear();
            for tangent in &tangents[group.index] {
                tangent.couple_point(displacements, &mut forces);
            }
            for &[from, index] in &incoming[group.index] {
                tangents[from as usize][index as usize].couple_nearest(displacements, &mut forces);
            }
            group.equations.torques(&forces.vectors()[1..], image);
            wide(
                #[inline(always)]
                || {
                    for block in &mut *image {
                        *block = [block[0] * *factor, block[1] * *factor];
                    }
                },
            );
            combine(group.index, image, sums);
        });
    }
}

/// `base + weight · acceleration`
#[inline(always)]
fn follow(block: &mut [Lane; 2], base: &[Lane; 2], weight: f64, acceleration: &[Lane; 2]) {
    let weight = Lane::from_f64(weight);
    *block = [base[0] + weight * acceleration[0], base[1] + weight * acceleration[1]];
}

#[inline(always)]
fn zero_lane() -> Lane {
    Lane::from_f64(0.0)
}

/// Adds to a number that tells sets of contacts apart. Values count from 1: the first contact on the first segment must not leave the
/// number at zero, which means that nothing is touched.
fn mix(number: &mut u64, values: [u64; 3]) {
    for value in values {
        *number = (number.rotate_left(5) ^ value.wrapping_add(1)).wrapping_mul(0x517c_c1b7_2722_0a95);
    }
}
