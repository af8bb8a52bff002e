//! Filaments in contact with the workpiece and with each other: their equations at one instant, and their solution.

use std::ops::AddAssign;

use super::candidates::{Candidates, Layout};
use super::field::{Changes, Field, Lane, Node, Place};
use super::gmres::{self, Coupled, Krylov, Vector};
use super::presses::{Press, PressLaw, PressTangent};
use crate::contact::ContactForce;
use crate::equations::linear::{add, dot, scale, zero};
use crate::equations::{
    Chain, ChainDynamics, Clamp, LANES, LaneSet, Lanewise, NodeLoads, NodeMotion, NodeTangent, PointTangent,
    StepWeights,
};
use crate::simulation::{Equations, Filament, Form};
use crate::tool::{ClampMotion, RoundTool, Turning};
use crate::workpiece::Part;

/// A filament of a brush.
pub type Bristle = Filament<Turning<RoundTool>, Part>;

/// Filaments side by side in lanes. Lanes that are left over repeat the last filament, without loads.
struct Group {
    equations: Equations<Lane>,
    clamp: Clamp<Lane>,
    /// The first filament.
    first: usize,
    /// The number of filaments.
    count: usize,
    /// The weights of the step and the contacts of each filament for which the matrix was factorised.
    factorised: Option<([u64; 2], [u64; LANES])>,
}

/// The loads of a group.
struct GroupLoads<'a> {
    /// By node, from the root.
    forces: &'a [[Lane; 3]],
    /// By segment; for a factorisation.
    changes: &'a [[[[[Lane; 3]; 3]; 2]; 2]],
}

impl NodeLoads<Lane> for GroupLoads<'_> {
    fn loads_points(&self) -> bool {
        !self.changes.is_empty()
    }

    fn point_tangents(&self, _: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<Lane>)) {
        let none = [zero(); 3];
        for (segment, ends) in self.changes.iter().enumerate() {
            let ends = ends.map(|ends| ends.map(|position| NodeTangent { position, velocity: none }));
            add(PointTangent { segment, ends });
        }
    }

    fn force(&self, node: usize, _: [Lane; 3], _: [Lane; 3]) -> Option<[Lane; 3]> {
        Some(self.forces[node + 1])
    }

    fn tangent(&self, _: usize, _: [Lane; 3], _: [Lane; 3]) -> Option<NodeTangent<Lane>> {
        None
    }
}

/// The force of the workpiece on one filament.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorkpieceLoad {
    /// `F_n` in N.
    pub normal: f64,
    /// The whole force in N.
    pub force: [f64; 3],
    /// Its moment about the tool axis in N m.
    pub moment: f64,
    /// The part of `F_n` on edges in N.
    pub on_edges: f64,
    /// Power taken by friction in W.
    pub friction_power: f64,
    /// The deepest penetration of its possible contacts in m; negative where there is none.
    pub pressing: f64,
    /// The deepest penetration of an edge in m.
    pub edge_penetration: f64,
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

/// The work of a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Iterations of Newton's method.
    pub newton_iterations: usize,
    /// Vectors of the linear solutions.
    pub krylov_vectors: usize,
}

impl AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.newton_iterations += other.newton_iterations;
        self.krylov_vectors += other.krylov_vectors;
    }
}

/// Filaments that touch each other.
pub struct Row {
    bristles: Vec<Bristle>,
    groups: Vec<Group>,
    law: PressLaw,
    layout: Layout,
    candidates: Candidates,
    positions: Field,
    velocities: Field,
    forces: Field,
    /// How the forces change along a step with the accelerations of the nodes.
    changes: Changes,
    /// Where filaments press on each other.
    presses: Vec<Press>,
    tangents: Vec<PressTangent>,
    /// Weight of the positions in the tangents.
    by_position: f64,
    loads: Vec<WorkpieceLoad>,
    /// The contacts of each filament, as a number that tells them apart.
    contacts: Vec<u64>,
    krylov: Krylov,
    displacements: Field,
}

/// Newton's method did not converge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoConvergence;

impl Row {
    /// Filaments with equations of the given form, that press on each other under `law`.
    ///
    /// # Panics
    /// If there is no filament, or if their numbers of segments differ.
    pub fn new(form: Form, bristles: Vec<Bristle>, law: PressLaw, layout: Layout) -> Self {
        let n = layout.segments;
        assert!(!bristles.is_empty() && bristles.iter().all(|bristle| bristle.chain.segments() == n));
        let groups = (0..bristles.len()).step_by(LANES).map(|first| {
            let count = LANES.min(bristles.len() - first);
            let bristle = |lane: usize| &bristles[first + lane.min(count - 1)];
            Group {
                equations: Equations::new(form, Chain::from_lanes(|lane| &bristle(lane).chain)),
                clamp: Clamp::from_lanes(|lane| bristle(lane).motion.at(0.0)),
                first,
                count,
                factorised: None,
            }
        });
        let groups: Vec<Group> = groups.collect();
        let field = Field::new(groups.len(), n);
        Self {
            law,
            layout,
            candidates: Candidates::new(layout),
            positions: field.clone(),
            velocities: field.clone(),
            forces: field.clone(),
            changes: Changes::new(groups.len(), n),
            presses: Vec::new(),
            tangents: Vec::new(),
            by_position: 0.0,
            loads: vec![WorkpieceLoad::default(); bristles.len()],
            contacts: vec![0; bristles.len()],
            krylov: Krylov::default(),
            displacements: field,
            groups,
            bristles,
        }
    }

    /// The filaments.
    pub fn bristles(&self) -> &[Bristle] {
        &self.bristles
    }

    /// Position of a filament's tip in m, where it was last evaluated.
    pub fn tip(&self, filament: usize) -> [f64; 3] {
        let n = self.layout.segments;
        self.positions.at(Node::new(filament, n, n))
    }

    /// The forces of the workpiece on each filament, in the last evaluation.
    pub fn loads(&self) -> &[WorkpieceLoad] {
        &self.loads
    }

    /// The relaxed filaments at time zero, turning rigidly with the body.
    pub fn start(&mut self, undeformed: impl Fn(usize) -> [Vec<[f64; 2]>; 2]) -> Motion {
        let (n, groups) = (self.layout.segments, self.groups.len());
        let none = vec![[Lane::from_lanes(|_| 0.0); 2]; groups * n];
        let mut motion = Motion { time: 0.0, q: none.clone(), v: none.clone(), accelerations: none };
        for (index, group) in self.groups.iter().enumerate() {
            for lane in 0..LANES {
                let [q, v] = undeformed(group.first + lane.min(group.count - 1));
                for k in 0..n {
                    for i in 0..2 {
                        motion.q[index * n + k][i].set_lane(lane, q[k][i]);
                        motion.v[index * n + k][i].set_lane(lane, v[k][i]);
                    }
                }
            }
        }
        self.evaluate(&motion);
        for (index, group) in self.groups.iter_mut().enumerate() {
            let at = index * n..(index + 1) * n;
            let loads = GroupLoads { forces: self.forces.group(index, n), changes: &[] };
            let (q, v, accelerations) = (&motion.q[at.clone()], &motion.v[at.clone()], &mut motion.accelerations[at]);
            group.equations.accelerations(&group.clamp, q, v, &loads, accelerations);
        }
        motion
    }

    /// Places all filaments, and evaluates all contacts.
    pub fn evaluate(&mut self, motion: &Motion) {
        self.place(motion);
        self.find_contacts(motion.time, None);
    }

    fn place(&mut self, motion: &Motion) {
        let n = self.layout.segments;
        for (index, group) in self.groups.iter_mut().enumerate() {
            let filament = |lane: usize| &self.bristles[group.first + lane.min(group.count - 1)];
            group.clamp = Turning::in_lanes(|lane| &filament(lane).motion, Lane::from_lanes(|_| motion.time));
            let blocks = index * n..(index + 1) * n;
            group.equations.place(&group.clamp, &motion.q[blocks.clone()], &motion.v[blocks]);
            let positions = self.positions.group_mut(index, n);
            let velocities = self.velocities.group_mut(index, n);
            (positions[0], velocities[0]) = (group.clamp.position, group.clamp.velocity);
            group.equations.nodes_in_lanes(&mut positions[1..], &mut velocities[1..]);
        }
    }

    /// Evaluates all contacts where the filaments were placed; with `weights` also how their forces change along a step.
    fn find_contacts(&mut self, time: f64, weights: Option<[f64; 2]>) {
        self.forces.clear();
        self.meet_workpiece(time);
        let Self { candidates, positions, velocities, presses, law, forces, contacts, layout, .. } = self;
        let motion = &self.bristles[0].motion;
        candidates.update(positions, motion.angle(time));
        let length = candidates.length();
        presses.clear();
        candidates.for_each_near(positions, |near| {
            let press = Press::new(law, near, length, [positions, velocities]);
            press.load(forces);
            for place in [near.point, near.nearest] {
                let others =
                    [near.point.segment.number(), near.nearest.segment.number(), near.point.fraction.to_bits()];
                mix(&mut contacts[layout.filament(place.segment)], others);
            }
            presses.push(press);
        });
        let Some(weights) = weights else { return };
        self.tangents.clear();
        // By the motion of the positions: solutions multiply by its weight.
        let [by_position, by_rate] = weights;
        self.by_position = by_position;
        let relative = [1.0, by_rate / by_position];
        self.tangents.extend(self.presses.iter().map(|press| press.tangent(&self.law, relative)));
    }

    fn meet_workpiece(&mut self, time: f64) {
        let n = self.layout.segments;
        for (index, bristle) in self.bristles.iter().enumerate() {
            let node = |k: usize| Node::new(index, k, n);
            let nodes = |k: usize| [self.positions.at(node(k)), self.velocities.at(node(k))];
            let met = &mut self.contacts[index];
            *met = 0;
            let mut load = WorkpieceLoad { pressing: f64::NEG_INFINITY, ..WorkpieceLoad::default() };
            for contact in 0..bristle.contacts() {
                if contact < n {
                    // Most nodes are far away.
                    let [position, velocity] = nodes(contact + 1);
                    let pressing = bristle.law.node_pressing(&bristle.workpiece, position, velocity, time);
                    load.pressing = load.pressing.max(pressing);
                    if pressing <= 0.0 {
                        continue;
                    }
                }
                let touch = bristle.touch(contact, &nodes, None, time);
                let pressing = bristle.law.pressing(&touch.approach);
                load.pressing = load.pressing.max(pressing);
                if pressing <= 0.0 {
                    continue;
                }
                let ContactForce { normal, tangential } = bristle.law.force(&touch.approach);
                let force = add(scale(normal, touch.approach.normal), tangential);
                load.normal += normal;
                load.force = add(load.force, force);
                load.moment += touch.position[0] * force[1] - touch.position[1] * force[0];
                load.friction_power -= dot(tangential, touch.approach.sliding);
                if touch.on_edge {
                    load.on_edges += normal;
                    load.edge_penetration = load.edge_penetration.max(touch.approach.penetration);
                }
                let place = Place { segment: node(touch.station.segment), fraction: touch.station.fraction };
                place.load(force, &mut self.forces);
                mix(met, [contact as u64, touch.station.segment as u64, 0]);
            }
            self.loads[index] = load;
        }
    }

    /// Factorises the matrices of the groups whose filaments have other contacts than those for which it was done before, where the
    /// residual was last computed.
    fn factorise(&mut self, motion: &Motion, weights: [f64; 2], step: StepWeights<Lane>) {
        let n = self.layout.segments;
        let contacts = |group: &Group| -> [u64; LANES] {
            std::array::from_fn(|lane| self.contacts[group.first + lane.min(group.count - 1)])
        };
        let changed = |group: &Group| group.factorised != Some((weights.map(f64::to_bits), contacts(group)));
        let stale: Vec<usize> = (0..self.groups.len()).filter(|&index| changed(&self.groups[index])).collect();
        if stale.is_empty() {
            return;
        }
        let known: Vec<_> = self.groups.iter().map(contacts).collect();
        self.changes.clear();
        for &index in &stale {
            self.add_workpiece_changes(index, motion.time, weights);
        }
        for tangent in &self.tangents {
            tangent.add_own(&mut self.changes);
        }
        for index in stale {
            let group = &mut self.groups[index];
            let at = index * n..(index + 1) * n;
            let (q, v) = (&motion.q[at.clone()], &motion.v[at.clone()]);
            let loads = GroupLoads { forces: self.forces.group(index, n), changes: self.changes.group(index, n) };
            let (accelerations, all) = (&motion.accelerations[at], LaneSet::first(LANES));
            group.equations.factorise(&group.clamp, q, v, accelerations, &loads, step, all);
            group.factorised = Some((weights.map(f64::to_bits), known[index]));
        }
    }

    /// How the forces of the workpiece on the filaments of a group change with their motion.
    fn add_workpiece_changes(&mut self, index: usize, time: f64, [by_position, by_rate]: [f64; 2]) {
        let n = self.layout.segments;
        let group = &self.groups[index];
        for filament in group.first..group.first + group.count {
            let bristle = &self.bristles[filament];
            let node = |k: usize| Node::new(filament, k, n);
            let nodes = |k: usize| [self.positions.at(node(k)), self.velocities.at(node(k))];
            for contact in 0..bristle.contacts() {
                let touch = bristle.touch(contact, &nodes, None, time);
                if bristle.law.pressing(&touch.approach) <= 0.0 {
                    continue;
                }
                let NodeTangent { position, velocity } = bristle.law.tangent(&touch.approach);
                // The recursion multiplies by the weight of the positions.
                let change = std::array::from_fn(|row| add(position[row], scale(by_rate / by_position, velocity[row])));
                self.changes.add_at(node(touch.station.segment), touch.station.shares(), &change);
            }
        }
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
        /// Share of the residual that the linear solution may leave.
        const FORCING: f64 = 0.02;
        let n = self.layout.segments;
        let lanes = weights.map(|weight| Lane::from_lanes(|_| weight));
        let step = StepWeights { coordinates: lanes[0], rates: lanes[1] };
        let mut effort = Effort::default();
        let mut residual: Vector = motion.accelerations.clone();
        while effort.newton_iterations < MOST {
            effort.newton_iterations += 1;
            follow(&mut motion.q, base_q, lanes[0], &motion.accelerations);
            follow(&mut motion.v, base_v, lanes[1], &motion.accelerations);
            self.place(motion);
            self.find_contacts(motion.time, Some(weights));
            for (index, group) in self.groups.iter_mut().enumerate() {
                let at = index * n..(index + 1) * n;
                let (q, v) = (&motion.q[at.clone()], &motion.v[at.clone()]);
                let accelerations = &motion.accelerations[at.clone()];
                let loads = GroupLoads { forces: self.forces.group(index, n), changes: &[] };
                let result = &mut residual[at];
                group.equations.residual(&group.clamp, q, v, accelerations, &loads, result);
                for block in result {
                    if group.equations.form() == Form::Planar {
                        block[0] = Lane::from_lanes(|_| 0.0);
                    }
                    for lane in group.count..LANES {
                        block.iter_mut().for_each(|value| value.set_lane(lane, 0.0));
                    }
                }
            }
            self.factorise(motion, weights, step);
            let mut krylov = std::mem::take(&mut self.krylov);
            let vectors = if self.presses.is_empty() {
                self.precondition(&mut residual);
                Some(0)
            } else {
                gmres::solve(self, &mut residual, FORCING, &mut krylov)
            };
            self.krylov = krylov;
            effort.krylov_vectors += vectors.ok_or(NoConvergence)?;
            for (acceleration, correction) in motion.accelerations.iter_mut().zip(&residual) {
                for (value, correction) in acceleration.iter_mut().zip(correction) {
                    *value = *value - *correction;
                }
            }
            let largest = weights[1] * self.largest_displacement(&residual);
            if !largest.is_finite() {
                return Err(NoConvergence);
            }
            if largest <= tolerance {
                follow(&mut motion.q, base_q, lanes[0], &motion.accelerations);
                follow(&mut motion.v, base_v, lanes[1], &motion.accelerations);
                return Ok(effort);
            }
        }
        Err(NoConvergence)
    }

    /// The largest displacement of a node with a change of the coordinates, in m/rad of it.
    fn largest_displacement(&mut self, change: &Vector) -> f64 {
        self.displace(change);
        let squares = self.displacements.0.iter().map(|displacement| dot(*displacement, *displacement));
        let largest = squares.fold(Lane::from_lanes(|_| 0.0), Lane::max);
        // A number that is not finite must come through.
        let of_lanes = (0..LANES).map(|lane| largest.lane(lane));
        of_lanes.fold(0.0, |largest: f64, square| if square <= largest { largest } else { square }).sqrt()
    }

    /// Displacements of all nodes with a change of the coordinates.
    fn displace(&mut self, change: &Vector) {
        let n = self.layout.segments;
        for (index, group) in self.groups.iter_mut().enumerate() {
            let displacements = &mut self.displacements.group_mut(index, n)[1..];
            group.equations.displacements(&change[index * n..(index + 1) * n], displacements);
        }
    }
}

impl Coupled for Row {
    fn precondition(&mut self, x: &mut Vector) {
        let n = self.layout.segments;
        for (group, blocks) in self.groups.iter_mut().zip(x.chunks_mut(n)) {
            group.equations.solve(blocks);
        }
    }

    fn couple(&mut self, x: &Vector, result: &mut Vector) {
        let factor = Lane::from_lanes(|_| -self.by_position);
        self.displace(x);
        self.forces.clear();
        for tangent in &self.tangents {
            tangent.add_coupling(&self.displacements, &mut self.forces);
        }
        let n = self.layout.segments;
        for (index, (group, blocks)) in self.groups.iter_mut().zip(result.chunks_mut(n)).enumerate() {
            group.equations.torques(&self.forces.group(index, n)[1..], blocks);
            for block in blocks {
                *block = block.map(|value| value * factor);
            }
        }
    }
}

/// `base + weight · accelerations`
fn follow(vector: &mut Vector, base: &Vector, weight: Lane, accelerations: &Vector) {
    for ((block, base), acceleration) in vector.iter_mut().zip(base).zip(accelerations) {
        for i in 0..2 {
            block[i] = base[i] + weight * acceleration[i];
        }
    }
}

/// Adds to a number that tells sets of contacts apart.
fn mix(number: &mut u64, values: [u64; 3]) {
    for value in values {
        *number = (number.rotate_left(5) ^ value).wrapping_mul(0x517c_c1b7_2722_0a95);
    }
}
