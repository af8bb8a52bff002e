//! O(n) dynamics of a chain by recursion over its segments, for any dimension of coordinates and
//! vectors.
//!
//! The chain is a tree without branches. Seen from its inner end `x_{k−1}`, everything outside
//! joint `k` is a body that responds to an acceleration with a force. The recursion carries this
//! response from the tip to the root (the articulated-body recursion of Featherstone 1983). Blocks
//! have the size of a node, because a node only translates. An implicit step also couples
//! neighbours through the joints. This widens the block by the coordinates of the segment inside
//! it.
//!
//! A segment has `D` coordinates, and a node moves in `S` dimensions: 2 and 3 in space, 1 and 2 in
//! the plane of rotation, 1 and 1 for the lateral variation of a planar motion. A [`Posture`] knows
//! the kernels.
//!
//! Coordinates come in blocks of two, of which a posture uses one or both.

use super::kernels::{Joint, JointEnergy, JointTangent, Segment, SegmentEnergy, SegmentTangent};
use super::linear::{
    add, add_matrices, in_lane, invert, mul, mul_transposed, negative, product, scale, select, sub,
    sub_matrices, transposed_product, unrolled, zero, zero_matrix,
};
use super::tasks::{Factorise, Task, TrialAccelerations};
use super::{
    ChainState, Clamp, Energies, LaneSet, Lanewise, NodeLoads, NodeMotion, Real, StepWeights,
};

impl<T: Real, const D: usize> JointTangent<T, D> {
    /// Creates the tangent of the clamp joint, which has no segment inside.
    #[inline(always)]
    pub(super) fn at_clamp(next_next: [[T; D]; D]) -> Self {
        let none = zero_matrix();
        Self {
            previous_previous: none,
            previous_next: none,
            next_previous: none,
            next_next,
        }
    }
}

/// Jacobian of the load on a node with respect to its position and velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoadTangent<T, const S: usize> {
    pub position: [[T; S]; S],
    pub velocity: [[T; S]; S],
}

/// Force at a point of a segment; see [`PointLoad`](super::PointLoad).
#[derive(Clone, Copy, Debug)]
pub(super) struct LoadedPoint<T, const S: usize> {
    pub segment: usize,
    pub fraction: T,
    pub force: [T; S],
}

/// Jacobian of such a force; see [`PointTangent`](super::PointTangent).
#[derive(Clone, Copy, Debug)]
pub(super) struct PointChange<T, const S: usize> {
    pub segment: usize,
    pub ends: [[LoadTangent<T, S>; 2]; 2],
}

/// Position and velocity of the root, and its acceleration minus gravity.
#[derive(Clone, Copy)]
pub(super) struct RootMotion<T, const S: usize> {
    pub position: [T; S],
    pub velocity: [T; S],
    pub acceleration: [T; S],
}

/// Positions and velocities of the nodes of a chain, or of one of them.
pub(super) type ChainNodes<'a, T, const S: usize> = [&'a [[T; S]]; 2];

/// Nodes of a chain in the memory of the recursions, in space or in the plane of rotation.
pub(super) struct Placed<'a, T, const S: usize> {
    pub clamp: &'a Clamp<T>,
    pub nodes: ChainNodes<'a, T, S>,
}

impl<T: Lanewise, const S: usize> NodeMotion for Placed<'_, T, S> {
    fn node(&self, index: usize, lane: usize) -> [[f64; 3]; 2] {
        match index.checked_sub(1) {
            None => [
                in_lane(&self.clamp.position, lane),
                in_lane(&self.clamp.velocity, lane),
            ],
            Some(k) => self.nodes.map(|vectors| {
                let mut node = [0.0; 3];
                node[..S].copy_from_slice(&in_lane(&vectors[k], lane));
                node
            }),
        }
    }
}

impl<T: Real> Clamp<T> {
    /// Returns the root under `gravity`.
    #[inline(always)]
    pub(super) fn root(&self, gravity: [T; 3]) -> RootMotion<T, 3> {
        RootMotion {
            position: self.position,
            velocity: self.velocity,
            acceleration: sub(self.acceleration, gravity),
        }
    }
}

/// Chain at one state. It holds the constants of the whole chain by value, so that the compiler can
/// keep them in registers. It would read constants behind a reference again after every write.
pub(super) trait Posture<T: Real, const D: usize, const S: usize> {
    /// Returns the number of segments.
    fn segments(&self) -> usize;

    /// Returns the mass of segment `k`.
    fn mass(&self, k: usize) -> T;

    /// Returns the inner end of the first segment.
    fn root(&self) -> RootMotion<T, S>;

    /// Takes coordinates, or quantities that belong to them, from a block.
    fn take(block: [T; 2]) -> [T; D];

    /// Puts such quantities into a block.
    fn put(block: &mut [T; 2], values: [T; D]);

    /// Returns a vector in the frame.
    fn in_frame(vector: [T; S]) -> [T; 3];

    /// Returns the components of a vector in the frame.
    fn components(vector: [T; 3]) -> [T; S];

    /// Returns kinematics and inertia of segment `k`.
    fn segment(&self, k: usize) -> Segment<T, D, S>;

    /// Returns the torques of the spring and the damper at the inner end of segment `k`.
    fn inner_joint(&self, k: usize) -> Joint<T, D>;

    /// Returns `false` if no node carries a load.
    fn is_loaded(&self, loads: &dyn NodeLoads<T>) -> bool {
        !loads.is_empty()
    }

    /// Returns the load on node `k`, which has a position and a velocity.
    fn load(&self, loads: &dyn NodeLoads<T>, k: usize, node: [[T; S]; 2]) -> Option<[T; S]>;

    /// Returns the Jacobian of `segment(k)` with respect to the accelerations of a step.
    fn segment_tangent(
        &self,
        k: usize,
        accelerations: [T; D],
        base_acceleration: [T; S],
        outer_force: [T; S],
        weights: StepWeights<T>,
    ) -> SegmentTangent<T, D, S>;

    /// Returns the Jacobian of the torques of `inner_joint(k)` with respect to these accelerations.
    fn inner_joint_tangent(&self, k: usize, weights: StepWeights<T>) -> JointTangent<T, D>;

    /// Returns the Jacobian of the load on node `k`.
    fn load_tangent(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        node: [[T; S]; 2],
    ) -> Option<LoadTangent<T, S>>;

    /// Calls `apply` with the loads at points of segments.
    fn points(
        &self,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, S>,
        apply: &mut dyn FnMut(LoadedPoint<T, S>),
    );

    /// Calls `apply` with the Jacobians of these loads.
    fn point_changes(
        &self,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, S>,
        apply: &mut dyn FnMut(PointChange<T, S>),
    );
}

/// Chain whose energies are known.
pub(super) trait Energetic<T: Real, const D: usize, const S: usize>:
    Posture<T, D, S>
{
    /// Returns kinetic energy and energy of gravity of segment `k`, whose inner end is at
    /// `position` and moves at `velocity`.
    fn segment_energy(&self, k: usize, position: [T; S], velocity: [T; S]) -> SegmentEnergy<T>;

    /// Returns energy of the spring and dissipation function of the damper at the inner end of
    /// segment `k`.
    fn inner_joint_energy(&self, k: usize) -> JointEnergy<T>;
}

/// One segment's share of the factorised step matrix.
#[derive(Clone, Copy, Debug)]
struct Elimination<T, const D: usize, const S: usize> {
    /// Inverse of the pivot.
    pivot: [[T; D]; D],
    /// Effect of the segment's own `δq̈` on the force at its inner node and the torque on its inner
    /// neighbour.
    force: [[T; D]; S],
    torque: [[T; D]; D],
    /// Effect of the inner node's `δẍ` and the inner neighbour's `δq̈` on the segment's own `δq̈`,
    /// with the pivot applied.
    from_node: [[T; S]; D],
    from_neighbour: [[T; D]; D],
    /// `∂ẍ'/∂q̈` along the step.
    outer: [[T; D]; S],
}

impl<T: Lanewise, const D: usize, const S: usize> Elimination<T, D, S> {
    /// Returns `self` in `lanes`, `other` elsewhere.
    #[inline(always)]
    fn select(&self, lanes: LaneSet, other: &Self) -> Self {
        Self {
            pivot: select(lanes, &self.pivot, &other.pivot),
            force: select(lanes, &self.force, &other.force),
            torque: select(lanes, &self.torque, &other.torque),
            from_node: select(lanes, &self.from_node, &other.from_node),
            from_neighbour: select(lanes, &self.from_neighbour, &other.from_neighbour),
            outer: select(lanes, &self.outer, &other.outer),
        }
    }
}

/// Result of the elimination for one segment, from which the accelerations follow.
#[derive(Clone, Copy, Debug)]
struct Response<T, const D: usize, const S: usize> {
    /// `q̈` with the inner node at rest.
    own: [T; D],
    /// Effect of the inner node's acceleration on `q̈`.
    from_node: [[T; S]; D],
    /// `G` and `b` of the segment.
    jacobian: [[T; D]; S],
    bias: [T; S],
}

/// Results of the recursions for each segment and node. Arrays are indexed by segment.
#[derive(Clone, Debug)]
pub(super) struct Memory<T, const D: usize, const S: usize> {
    /// `G` of the segment.
    jacobians: Vec<[[T; D]; S]>,
    pub positions: Vec<[T; S]>,
    pub velocities: Vec<[T; S]>,
    /// Acceleration of the inner node of each segment and of the tip, minus gravity.
    pub base_accelerations: Vec<[T; S]>,
    /// Force that each segment alone requires at its inner node.
    base_forces: Vec<[T; S]>,
    /// Force that the chain outside each segment's outer node requires there.
    pub outer_forces: Vec<[T; S]>,
    pub root_force: [T; S],
    eliminations: Vec<Elimination<T, D, S>>,
    /// Scratch of [`solve`]: `δq̈` with the inner node and the inner neighbour at rest.
    partial: Vec<[T; D]>,
    /// Scratch of [`accelerations`].
    responses: Vec<Response<T, D, S>>,
    /// Shares of the ends of the segments in the loads at points of segments, from the root to the
    /// tip.
    point_forces: Vec<[T; S]>,
    /// `true` if `base_forces` include them.
    carries_points: bool,
    /// Jacobians of these shares along a step, by segment.
    point_blocks: Vec<EndTangents<T, S>>,
}

/// Jacobian along a step of the forces of loads on both ends of a segment, with respect to the
/// accelerations of these ends.
type EndTangents<T, const S: usize> = [[[[T; S]; S]; 2]; 2];

impl<T: Real, const D: usize, const S: usize> Memory<T, D, S> {
    /// Creates the memory for `n` segments.
    pub fn new(n: usize) -> Self {
        let elimination = Elimination {
            pivot: zero_matrix(),
            force: zero_matrix(),
            torque: zero_matrix(),
            from_node: zero_matrix(),
            from_neighbour: zero_matrix(),
            outer: zero_matrix(),
        };
        let response = Response {
            own: zero(),
            from_node: zero_matrix(),
            jacobian: zero_matrix(),
            bias: zero(),
        };
        Self {
            jacobians: vec![zero_matrix(); n],
            positions: vec![zero(); n],
            velocities: vec![zero(); n],
            base_accelerations: vec![zero(); n + 1],
            base_forces: vec![zero(); n],
            outer_forces: vec![zero(); n],
            root_force: zero(),
            eliminations: vec![elimination; n],
            partial: vec![zero(); n],
            responses: vec![response; n],
            point_forces: vec![zero(); n + 1],
            carries_points: false,
            point_blocks: vec![[[zero_matrix(); 2]; 2]; n],
        }
    }
}

/// Carries out `task` on a chain of `n` segments, whose sines and cosines belong to the task.
/// `posture` makes the posture at a given state.
#[inline(always)]
pub(super) fn perform<'a, T: Lanewise, P: Energetic<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    n: usize,
    posture: impl FnOnce(ChainState<'a, T>) -> P,
    task: Task<'a, T>,
) {
    match task {
        Task::Place(at) => place(memory, &posture(at)),
        Task::Track(at, accelerations) => track(memory, &posture(at), accelerations),
        Task::Accelerations(at, loads, result) => {
            let posture = posture(at);
            if !loads.is_empty() {
                place(memory, &posture);
            }
            accelerations(memory, &posture, loads, result);
        }
        Task::Residual(trial, result) => residual(memory, &posture(trial.at), trial, result),
        Task::Correction(trial, result) => correction(memory, &posture(trial.at), trial, result),
        Task::Factorise(_) => unreachable!("a factorisation has a function of its own"),
        Task::Solve(right_side) => solve::<T, P, D, S>(memory, n, right_side),
        Task::Shift(correction, weights) => shift::<T, P, D, S>(memory, n, correction, weights),
        Task::Displacements(change, result) => {
            displacements::<T, P, D, S>(memory, n, change, result)
        }
        Task::Torques(forces, result) => torques::<T, P, D, S>(memory, n, forces, result),
        Task::Dissipation(at, result) => *result = dissipation(&posture(at)),
    }
}

/// Returns the dissipation function of the whole chain in W.
#[inline(always)]
fn dissipation<T: Real, P: Energetic<T, D, S>, const D: usize, const S: usize>(posture: &P) -> T {
    let mut sum = posture.inner_joint_energy(0).dissipation;
    for k in 1..posture.segments() {
        sum = sum + posture.inner_joint_energy(k).dissipation;
    }
    sum
}

/// Returns the energies where the nodes were last placed, with the power of the clamp's torque.
pub(super) fn energies<T: Real, P: Energetic<T, D, S>, const D: usize, const S: usize>(
    memory: &Memory<T, D, S>,
    posture: &P,
    clamp_torque_power: T,
) -> Energies<T> {
    let none = T::ZERO;
    let mut energies = Energies {
        kinetic: none,
        spring: none,
        gravity: none,
        dissipation: none,
        clamp_torque_power,
    };
    let RootMotion {
        mut position,
        mut velocity,
        ..
    } = posture.root();
    for k in 0..posture.segments() {
        let (segment, joint) = (
            posture.segment_energy(k, position, velocity),
            posture.inner_joint_energy(k),
        );
        energies.kinetic = energies.kinetic + segment.kinetic;
        energies.gravity = energies.gravity + segment.gravity;
        energies.spring = energies.spring + joint.spring;
        energies.dissipation = energies.dissipation + joint.dissipation;
        (position, velocity) = (memory.positions[k], memory.velocities[k]);
    }
    energies
}

/// Computes positions and velocities of the nodes.
#[inline(always)]
pub(super) fn place<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
) {
    let n = posture.segments();
    let (positions, velocities) = (&mut memory.positions[..n], &mut memory.velocities[..n]);
    let RootMotion {
        mut position,
        mut velocity,
        ..
    } = posture.root();
    for k in 0..n {
        let segment = posture.segment(k);
        position = add(position, segment.reach);
        velocity = add(velocity, segment.reach_rate);
        (positions[k], velocities[k]) = (position, velocity);
    }
}

/// Extends [`place`] by the accelerations of the nodes at the `q̈` in `accelerations`.
#[inline(always)]
pub(super) fn track<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    accelerations: &[[T; 2]],
) {
    let n = posture.segments();
    let accelerations = &accelerations[..n];
    let (positions, velocities) = (&mut memory.positions[..n], &mut memory.velocities[..n]);
    let base_accelerations = &mut memory.base_accelerations[..n + 1];
    let RootMotion {
        mut position,
        mut velocity,
        acceleration: mut base,
    } = posture.root();
    for k in 0..n {
        let segment = posture.segment(k);
        position = add(position, segment.reach);
        velocity = add(velocity, segment.reach_rate);
        (positions[k], velocities[k]) = (position, velocity);
        base_accelerations[k] = base;
        base = add(
            base,
            add(
                mul(&segment.reach_jacobian, P::take(accelerations[k])),
                segment.reach_bias,
            ),
        );
    }
    base_accelerations[n] = base;
}

/// Solves `M q̈ = f + Q` for `q̈`, into `accelerations`. With loads, the nodes must have been
/// placed.
#[inline(always)]
pub(super) fn accelerations<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    loads: &dyn NodeLoads<T>,
    accelerations: &mut [[T; 2]],
) {
    let n = posture.segments();
    let accelerations = &mut accelerations[..n];
    let loaded = Loaded::new(posture, loads);
    let (positions, velocities) = (&memory.positions[..n], &memory.velocities[..n]);
    let point_forces = loaded.point_forces(
        posture,
        loads,
        [positions, velocities],
        &mut memory.point_forces,
    );
    let responses = &mut memory.responses[..n];
    // The outer chain responds to ẍ at its inner node with A ẍ + b. A is symmetric.
    let (mut a, mut b) = (zero_matrix::<T, S, S>(), zero::<T, S>());
    let mut torque_from_outside = zero();
    for k in (0..n).rev() {
        if loaded.at(k)
            && let Some(force) = posture.load(loads, k, [positions[k], velocities[k]])
        {
            b = sub(b, force);
        }
        if loaded.points {
            b = sub(b, point_forces[k + 1]);
        }
        let segment = posture.segment(k);
        let joint = posture.inner_joint(k);
        let torque = add(joint.next, torque_from_outside);
        torque_from_outside = joint.previous;
        let jacobian = &segment.reach_jacobian;
        let outer = add(mul(&a, segment.reach_bias), b);
        let spread = product(&a, jacobian);
        let coupling = add_matrices(&segment.coupling, &spread);
        let pivot = invert(&add_matrices(
            &segment.inertia,
            &transposed_product(jacobian, &spread),
        ));
        let torque = sub(sub(torque, segment.bias), mul_transposed(jacobian, outer));
        // Uᵀ premultiplied by the pivot, which is symmetric here.
        let mut from_node = zero_matrix::<T, D, S>();
        unrolled!(row < D, {
            from_node[row] = mul(&coupling, pivot[row]);
        });
        let own = mul(&pivot, torque);
        let correction = product(&coupling, &from_node);
        // Compute one half and mirror it.
        unrolled!(row < S, {
            unrolled!(column < S, {
                if row <= column {
                    let entry = a[row][column] - correction[row][column];
                    a[row][column] = entry;
                    a[column][row] = entry;
                }
            });
            a[row][row] = posture.mass(k) + a[row][row];
        });
        b = add(add(segment.base_bias, outer), mul(&coupling, own));
        responses[k] = Response {
            own,
            from_node,
            jacobian: *jacobian,
            bias: segment.reach_bias,
        };
    }

    let mut base = posture.root().acceleration;
    for k in 0..n {
        let Response {
            own,
            from_node,
            jacobian,
            bias,
        } = &responses[k];
        let acceleration = sub(*own, mul(from_node, base));
        base = add(base, add(mul(jacobian, acceleration), *bias));
        P::put(&mut accelerations[k], acceleration);
    }
}

/// Computes the residual `M q̈ − f − Q` at the trial `q̈`.
#[inline(always)]
pub(super) fn residual<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    TrialAccelerations {
        accelerations,
        loads,
        ..
    }: TrialAccelerations<'_, T>,
    residual: &mut [[T; 2]],
) {
    sum_outwards(memory, posture, accelerations, residual);
    let (mut forces, ..) = InnerForces::new(memory, posture, loads);
    for k in (0..posture.segments()).rev() {
        let own = forces.residual(k, P::take(residual[k]));
        P::put(&mut residual[k], own);
    }
    memory.root_force = forces.force;
}

/// Computes [`residual`] and [`solve`] in one: `correction` is the `δq̈` that Newton's method
/// subtracts from `q̈`. The elimination runs inwards beside the forces, so that neither waits for
/// the other.
#[inline(always)]
pub(super) fn correction<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    TrialAccelerations {
        accelerations,
        loads,
        ..
    }: TrialAccelerations<'_, T>,
    correction: &mut [[T; 2]],
) {
    let n = posture.segments();
    sum_outwards(memory, posture, accelerations, correction);
    let mut reduction = Reduction::new();
    let (mut forces, eliminations, partial) = InnerForces::new(memory, posture, loads);
    for k in (0..n).rev() {
        let own = forces.residual(k, P::take(correction[k]));
        partial[k] = reduction.reduce(&eliminations[k], &forces.jacobians[k], own);
    }
    memory.root_force = forces.force;
    substitute::<T, P, D, S>(memory, n, correction);
}

/// Sums positions, velocities and accelerations from the root to the tip. The part that needs no
/// force at the outer node goes into `residual`.
#[inline(always)]
fn sum_outwards<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    accelerations: &[[T; 2]],
    residual: &mut [[T; 2]],
) {
    let n = posture.segments();
    let (accelerations, residual) = (&accelerations[..n], &mut residual[..n]);
    let (positions, velocities) = (&mut memory.positions[..n], &mut memory.velocities[..n]);
    let (jacobians, base_accelerations) = (
        &mut memory.jacobians[..n],
        &mut memory.base_accelerations[..n + 1],
    );
    let base_forces = &mut memory.base_forces[..n];

    let RootMotion {
        mut position,
        mut velocity,
        acceleration: mut base,
    } = posture.root();
    // Residual of the segment before, which still lacks the torque of its outer joint.
    let mut pending = zero();
    for k in 0..n {
        let segment = posture.segment(k);
        let joint = posture.inner_joint(k);
        let acceleration = P::take(accelerations[k]);
        if k > 0 {
            P::put(&mut residual[k - 1], sub(pending, joint.previous));
        }
        let inertial = add(mul(&segment.inertia, acceleration), segment.bias);
        pending = sub(
            add(inertial, mul_transposed(&segment.coupling, base)),
            joint.next,
        );
        let own = add(mul(&segment.coupling, acceleration), segment.base_bias);
        base_forces[k] = add(scale(posture.mass(k), base), own);
        base_accelerations[k] = base;
        base = add(
            base,
            add(
                mul(&segment.reach_jacobian, acceleration),
                segment.reach_bias,
            ),
        );
        position = add(position, segment.reach);
        velocity = add(velocity, segment.reach_rate);
        (positions[k], velocities[k]) = (position, velocity);
        jacobians[k] = segment.reach_jacobian;
    }
    P::put(&mut residual[n - 1], pending);
    base_accelerations[n] = base;
}

/// Nodes that may carry loads.
#[derive(Clone, Copy)]
struct Loaded<'a> {
    any: bool,
    lanes: Option<&'a [LaneSet]>,
    /// `true` if there may be loads at points of segments.
    points: bool,
}

impl<'a> Loaded<'a> {
    #[inline(always)]
    fn new<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
        posture: &P,
        loads: &'a dyn NodeLoads<T>,
    ) -> Self {
        let any = posture.is_loaded(loads);
        Self {
            any,
            lanes: loads.lanes(),
            points: any && loads.loads_points(),
        }
    }

    /// Returns the shares of the ends of the segments in the loads at points of segments, from the
    /// root to the tip.
    #[inline(always)]
    fn point_forces<'f, T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
        self,
        posture: &P,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, S>,
        forces: &'f mut [[T; S]],
    ) -> &'f [[T; S]] {
        if self.points {
            forces.fill(zero());
            posture.points(
                loads,
                nodes,
                &mut |LoadedPoint {
                          segment,
                          fraction,
                          force,
                      }| {
                    forces[segment] =
                        add(forces[segment], scale(T::from_f64(1.0) - fraction, force));
                    forces[segment + 1] = add(forces[segment + 1], scale(fraction, force));
                },
            );
        }
        &forces[..=posture.segments()]
    }

    #[inline(always)]
    fn at(self, node: usize) -> bool {
        self.any && self.lanes.is_none_or(|lanes| !lanes[node].is_empty())
    }
}

/// Computes the Jacobians along a step of the shares of the segments' ends in the loads at points.
#[inline(always)]
fn point_blocks<'b, T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    posture: &P,
    loads: &dyn NodeLoads<T>,
    nodes: ChainNodes<'_, T, S>,
    weights: StepWeights<T>,
    blocks: &'b mut [EndTangents<T, S>],
) -> &'b [EndTangents<T, S>] {
    blocks.fill([[zero_matrix(); 2]; 2]);
    posture.point_changes(loads, nodes, &mut |PointChange { segment, ends }| {
        let blocks = blocks[segment].as_flattened_mut().iter_mut();
        for (block, LoadTangent { position, velocity }) in blocks.zip(ends.as_flattened()) {
            for row in 0..S {
                let elastic = scale(weights.coordinates, position[row]);
                block[row] = add(
                    block[row],
                    add(elastic, scale(weights.rates, velocity[row])),
                );
            }
        }
    });
    &blocks[..posture.segments()]
}

/// Forces inside a chain, summed inwards from the tip.
struct InnerForces<'a, T, P, const D: usize, const S: usize> {
    posture: &'a P,
    loads: &'a dyn NodeLoads<T>,
    loaded: Loaded<'a>,
    jacobians: &'a [[[T; D]; S]],
    positions: &'a [[T; S]],
    velocities: &'a [[T; S]],
    base_forces: &'a [[T; S]],
    outer_forces: &'a mut [[T; S]],
    /// Force on the inner node of the segment that was summed last.
    force: [T; S],
}

impl<'a, T: Real, P: Posture<T, D, S>, const D: usize, const S: usize> InnerForces<'a, T, P, D, S> {
    /// Creates the forces before the first sum, with the factorised matrix and the scratch of its
    /// solution.
    #[inline(always)]
    fn new(
        memory: &'a mut Memory<T, D, S>,
        posture: &'a P,
        loads: &'a dyn NodeLoads<T>,
    ) -> (Self, &'a [Elimination<T, D, S>], &'a mut [[T; D]]) {
        let n = posture.segments();
        let (positions, velocities) = (&memory.positions[..n], &memory.velocities[..n]);
        let loaded = Loaded::new(posture, loads);
        let mut force = zero();
        if loaded.points {
            let points = loaded.point_forces(
                posture,
                loads,
                [positions, velocities],
                &mut memory.point_forces,
            );
            for (base, point) in memory.base_forces.iter_mut().zip(points) {
                *base = sub(*base, *point);
            }
            force = sub(zero(), points[n]);
        }
        memory.carries_points = loaded.points;
        let forces = Self {
            posture,
            loads,
            loaded,
            jacobians: &memory.jacobians[..n],
            positions,
            velocities,
            base_forces: &memory.base_forces[..n],
            outer_forces: &mut memory.outer_forces[..n],
            force,
        };
        (forces, &memory.eliminations[..n], &mut memory.partial[..n])
    }

    /// Adds the forces on segment `k`, the next one inwards. Returns the force at its outer node.
    #[inline(always)]
    fn add(&mut self, k: usize) -> [T; S] {
        let mut force = self.force;
        if self.loaded.at(k)
            && let Some(load) =
                self.posture
                    .load(self.loads, k, [self.positions[k], self.velocities[k]])
        {
            force = sub(force, load);
        }
        self.outer_forces[k] = force;
        self.force = add(force, self.base_forces[k]);
        force
    }

    /// Calls [`InnerForces::add`] and returns the residual of segment `k`. Its part `inertial` needs no
    /// force at the outer node.
    #[inline(always)]
    fn residual(&mut self, k: usize, inertial: [T; D]) -> [T; D] {
        let force = self.add(k);
        add(inertial, mul_transposed(&self.jacobians[k], force))
    }
}

/// Recomputes the forces inside the chain at the point of the last [`residual`], but with the loads
/// at the present positions of the nodes.
#[inline(always)]
pub(super) fn load<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    loads: &dyn NodeLoads<T>,
) {
    if memory.carries_points {
        for (base, point) in memory.base_forces.iter_mut().zip(&memory.point_forces) {
            *base = add(*base, *point);
        }
    }
    let (mut forces, ..) = InnerForces::new(memory, posture, loads);
    for k in (0..posture.segments()).rev() {
        forces.add(k);
    }
}

/// Factorises `∂(residual)/∂q̈` along a step, in `lanes`, at the point of the last [`residual`].
///
/// With `POINTS` there may be loads at points of segments: their code slows the loop even without
/// such loads.
#[inline(always)]
pub(super) fn factorise<
    T: Lanewise,
    P: Posture<T, D, S>,
    const D: usize,
    const S: usize,
    const POINTS: bool,
>(
    memory: &mut Memory<T, D, S>,
    posture: &P,
    &Factorise {
        trial:
            TrialAccelerations {
                accelerations,
                loads,
                ..
            },
        weights,
        lanes,
    }: &Factorise<'_, T>,
) {
    let n = posture.segments();
    let accelerations = &accelerations[..n];
    let (positions, velocities) = (&memory.positions[..n], &memory.velocities[..n]);
    let (base_accelerations, outer_forces) =
        (&memory.base_accelerations[..n], &memory.outer_forces[..n]);
    let eliminations = &mut memory.eliminations[..n];
    let (loaded, whole) = (
        Loaded::new(posture, loads),
        lanes == LaneSet::first(T::LANES),
    );
    let blocks = &mut memory.point_blocks;
    let point_blocks = if POINTS {
        point_blocks(posture, loads, [positions, velocities], weights, blocks)
    } else {
        &[]
    };

    // The outer chain responds to δẍ at its inner node and δq̈ of the segment inside it. The
    // response is the force A δẍ + B δq̈ and the torque C δẍ + D δq̈.
    let (mut a, mut b) = (zero_matrix::<T, S, S>(), zero_matrix::<T, S, D>());
    let (mut c, mut d) = (zero_matrix::<T, D, S>(), zero_matrix::<T, D, D>());
    for k in (0..n).rev() {
        if loaded.at(k)
            && let Some(tangent) = posture.load_tangent(loads, k, [positions[k], velocities[k]])
        {
            unrolled!(row < S, {
                let elastic = scale(weights.coordinates, tangent.position[row]);
                let viscous = scale(weights.rates, tangent.velocity[row]);
                a[row] = sub(sub(a[row], elastic), viscous);
            });
        }
        if POINTS {
            let [_, [_, outer_outer]] = &point_blocks[k];
            a = sub_matrices(&a, outer_outer);
        }
        let segment = posture.segment(k);
        let jacobian = &segment.reach_jacobian;
        let acceleration = P::take(accelerations[k]);
        let tangent = posture.segment_tangent(
            k,
            acceleration,
            base_accelerations[k],
            outer_forces[k],
            weights,
        );
        let joint = posture.inner_joint_tangent(k, weights);
        let outer = &tangent.outer_acceleration;
        let spread = add_matrices(&product(&a, outer), &b);
        let mut pivot = add_matrices(&tangent.torque, &transposed_product(jacobian, &spread));
        pivot = add_matrices(&pivot, &add_matrices(&product(&c, outer), &d));
        let pivot = invert(&add_matrices(&pivot, &joint.next_next));
        let mut coupling = add_matrices(&transposed_product(jacobian, &a), &c);
        unrolled!(row < D, {
            unrolled!(column < S, {
                coupling[row][column] = segment.coupling[column][row] + coupling[row][column];
            });
        });
        let mut force = add_matrices(&tangent.base_force, &spread);
        if POINTS {
            // The force on the outer end changes with the inner end, and that on the inner end with
            // both.
            let [[inner_inner, inner_outer], [outer_inner, _]] = &point_blocks[k];
            coupling = sub_matrices(&coupling, &transposed_product(jacobian, outer_inner));
            force = sub_matrices(&force, &product(inner_outer, outer));
            a = sub_matrices(
                &a,
                &add_matrices(outer_inner, &add_matrices(inner_outer, inner_inner)),
            );
        }
        let from_node = product(&pivot, &coupling);
        let from_neighbour = product(&pivot, &joint.next_previous);
        let torque = joint.previous_next;

        a = sub_matrices(&a, &product(&force, &from_node));
        unrolled!(i < S, {
            a[i][i] = a[i][i] + posture.mass(k);
        });
        b = negative(&product(&force, &from_neighbour));
        c = negative(&product(&torque, &from_node));
        d = sub_matrices(&joint.previous_previous, &product(&torque, &from_neighbour));
        let elimination = Elimination {
            pivot,
            force,
            torque,
            from_node,
            from_neighbour,
            outer: *outer,
        };
        eliminations[k] = if whole {
            elimination
        } else {
            elimination.select(lanes, &eliminations[k])
        };
    }
}

/// Solves the factorised system for `right_side`, in place.
#[inline(always)]
pub(super) fn solve<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    n: usize,
    right_side: &mut [[T; 2]],
) {
    let (eliminations, jacobians) = (&memory.eliminations[..n], &memory.jacobians[..n]);
    let partial = &mut memory.partial[..n];
    let mut reduction = Reduction::new();
    for k in (0..n).rev() {
        partial[k] = reduction.reduce(&eliminations[k], &jacobians[k], P::take(right_side[k]));
    }
    substitute::<T, P, D, S>(memory, n, right_side);
}

/// Inward half of a solution: reaction of the segments outside the present one on the segments
/// inside it.
struct Reduction<T, const D: usize, const S: usize> {
    force: [T; S],
    torque: [T; D],
}

impl<T: Real, const D: usize, const S: usize> Reduction<T, D, S> {
    #[inline(always)]
    fn new() -> Self {
        Self {
            force: zero(),
            torque: zero(),
        }
    }

    /// Returns `δq̈` of the next segment inwards for its `right_side`, with its inner node and its
    /// inner neighbour at rest.
    #[inline(always)]
    fn reduce(
        &mut self,
        elimination: &Elimination<T, D, S>,
        jacobian: &[[T; D]; S],
        right_side: [T; D],
    ) -> [T; D] {
        let own = sub(
            sub(right_side, mul_transposed(jacobian, self.force)),
            self.torque,
        );
        let own = mul(&elimination.pivot, own);
        self.force = add(self.force, mul(&elimination.force, own));
        self.torque = mul(&elimination.torque, own);
        own
    }
}

/// Completes the outward half of a solution.
#[inline(always)]
fn substitute<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &Memory<T, D, S>,
    n: usize,
    solution: &mut [[T; 2]],
) {
    let (eliminations, partial, solution) = (
        &memory.eliminations[..n],
        &memory.partial[..n],
        &mut solution[..n],
    );
    let (mut base, mut neighbour) = (zero::<T, S>(), zero::<T, D>());
    for k in 0..n {
        let elimination = &eliminations[k];
        let inner = add(
            mul(&elimination.from_node, base),
            mul(&elimination.from_neighbour, neighbour),
        );
        neighbour = sub(partial[k], inner);
        base = add(base, mul(&elimination.outer, neighbour));
        P::put(&mut solution[k], neighbour);
    }
}

/// Writes the displacements of the nodes for a `change` of the coordinates, to first order, into
/// `result`.
#[inline(always)]
fn displacements<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &Memory<T, D, S>,
    n: usize,
    change: &[[T; 2]],
    result: &mut [[T; 3]],
) {
    let (jacobians, change, result) = (&memory.jacobians[..n], &change[..n], &mut result[..n]);
    let mut displacement = zero();
    for k in 0..n {
        displacement = add(displacement, mul(&jacobians[k], P::take(change[k])));
        result[k] = P::in_frame(displacement);
    }
}

/// Writes the generalised forces of `forces` on the nodes into `result`.
#[inline(always)]
fn torques<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &Memory<T, D, S>,
    n: usize,
    forces: &[[T; 3]],
    result: &mut [[T; 2]],
) {
    let (jacobians, forces, result) = (&memory.jacobians[..n], &forces[..n], &mut result[..n]);
    let mut force = zero();
    for k in (0..n).rev() {
        force = add(force, P::components(forces[k]));
        P::put(&mut result[k], mul_transposed(&jacobians[k], force));
    }
}

/// Moves the nodes for a `correction` that is subtracted from `q̈` within a step, to first order.
#[inline(always)]
pub(super) fn shift<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
    memory: &mut Memory<T, D, S>,
    n: usize,
    correction: &[[T; 2]],
    weights: StepWeights<T>,
) {
    let (jacobians, correction) = (&memory.jacobians[..n], &correction[..n]);
    let (positions, velocities) = (&mut memory.positions[..n], &mut memory.velocities[..n]);
    let mut change = zero();
    for k in 0..n {
        change = add(change, mul(&jacobians[k], P::take(correction[k])));
        positions[k] = sub(positions[k], scale(weights.coordinates, change));
        velocities[k] = sub(velocities[k], scale(weights.rates, change));
    }
}
