//! A chain at one state as the recursions see it: its kernels, loads and root.

use super::kernels::{Joint, JointEnergy, JointTangent, Segment, SegmentEnergy, SegmentTangent};
use super::linear::{in_lane, sub, zero_matrix};
use super::{Clamp, Lanewise, NodeLoads, NodeMotion, Real, StepWeights};

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
