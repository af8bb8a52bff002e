//! Memory of the recursions: results for each segment and node.

use super::linear::{select, zero, zero_matrix};
use super::{LaneSet, Lanewise, Real};

/// Results of the recursions for each segment and node. Arrays are indexed by segment.
#[derive(Clone, Debug)]
pub(super) struct Memory<T, const D: usize, const S: usize> {
    /// `G` of the segment.
    pub(super) jacobians: Vec<[[T; D]; S]>,
    pub positions: Vec<[T; S]>,
    pub velocities: Vec<[T; S]>,
    /// Acceleration of the inner node of each segment and of the tip, minus gravity.
    pub base_accelerations: Vec<[T; S]>,
    /// Force that each segment alone requires at its inner node.
    pub(super) base_forces: Vec<[T; S]>,
    /// Force that the chain outside each segment's outer node requires there.
    pub outer_forces: Vec<[T; S]>,
    pub root_force: [T; S],
    pub(super) eliminations: Vec<Elimination<T, D, S>>,
    /// Scratch of [`solve`](super::step_matrix::solve): `δq̈` with the inner node and the inner
    /// neighbour at rest.
    pub(super) partial: Vec<[T; D]>,
    /// Scratch of [`accelerations`](super::recursion::accelerations).
    pub(super) responses: Vec<Response<T, D, S>>,
    /// Shares of the ends of the segments in the loads at points of segments, from the root to the
    /// tip.
    pub(super) point_forces: Vec<[T; S]>,
    /// `true` if `base_forces` include them.
    pub(super) carries_points: bool,
    /// Jacobians of these shares along a step, by segment.
    pub(super) point_blocks: Vec<EndTangents<T, S>>,
}

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

/// Jacobian along a step of the forces of loads on both ends of a segment, with respect to the
/// accelerations of these ends.
pub(super) type EndTangents<T, const S: usize> = [[[[T; S]; S]; 2]; 2];

/// Result of the elimination for one segment, from which the accelerations follow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response<T, const D: usize, const S: usize> {
    /// `q̈` with the inner node at rest.
    pub(super) own: [T; D],
    /// Effect of the inner node's acceleration on `q̈`.
    pub(super) from_node: [[T; S]; D],
    /// `G` and `b` of the segment.
    pub(super) jacobian: [[T; D]; S],
    pub(super) bias: [T; S],
}

/// One segment's share of the factorised step matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elimination<T, const D: usize, const S: usize> {
    /// Inverse of the pivot.
    pub(super) pivot: [[T; D]; D],
    /// Effect of the segment's own `δq̈` on the force at its inner node and the torque on its inner
    /// neighbour.
    pub(super) force: [[T; D]; S],
    pub(super) torque: [[T; D]; D],
    /// Effect of the inner node's `δẍ` and the inner neighbour's `δq̈` on the segment's own `δq̈`,
    /// with the pivot applied.
    pub(super) from_node: [[T; S]; D],
    pub(super) from_neighbour: [[T; D]; D],
    /// `∂ẍ'/∂q̈` along the step.
    pub(super) outer: [[T; D]; S],
}

impl<T: Lanewise, const D: usize, const S: usize> Elimination<T, D, S> {
    /// Returns `self` in `lanes`, `other` elsewhere.
    #[inline(always)]
    pub(super) fn select(&self, lanes: LaneSet, other: &Self) -> Self {
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
