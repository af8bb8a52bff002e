//! Forces inside a chain, from its inertia and the loads on its nodes and segments.

use super::linear::{add, mul_transposed, scale, sub, zero, zero_matrix};
use super::memory::{Elimination, EndTangents, Memory};
use super::posture::{ChainNodes, LoadTangent, LoadedPoint, PointChange, Posture};
use super::{LaneSet, NodeLoads, Real, StepWeights};

/// Forces inside a chain, summed inwards from the tip.
pub(super) struct InnerForces<'a, T, P, const D: usize, const S: usize> {
    posture: &'a P,
    loads: &'a dyn NodeLoads<T>,
    loaded: Loaded<'a>,
    pub(super) jacobians: &'a [[[T; D]; S]],
    positions: &'a [[T; S]],
    velocities: &'a [[T; S]],
    base_forces: &'a [[T; S]],
    outer_forces: &'a mut [[T; S]],
    /// Force on the inner node of the segment that was summed last.
    pub(super) force: [T; S],
}

impl<'a, T: Real, P: Posture<T, D, S>, const D: usize, const S: usize> InnerForces<'a, T, P, D, S> {
    /// Creates the forces before the first sum, with the factorised matrix and the scratch of its
    /// solution.
    #[inline(always)]
    pub(super) fn new(
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
    pub(super) fn add(&mut self, k: usize) -> [T; S] {
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
    pub(super) fn residual(&mut self, k: usize, inertial: [T; D]) -> [T; D] {
        let force = self.add(k);
        add(inertial, mul_transposed(&self.jacobians[k], force))
    }
}

/// Nodes that may carry loads.
#[derive(Clone, Copy)]
pub(super) struct Loaded<'a> {
    any: bool,
    lanes: Option<&'a [LaneSet]>,
    /// `true` if there may be loads at points of segments.
    pub(super) points: bool,
}

impl<'a> Loaded<'a> {
    #[inline(always)]
    pub(super) fn new<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
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
    pub(super) fn point_forces<'f, T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
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
    pub(super) fn at(self, node: usize) -> bool {
        self.any && self.lanes.is_none_or(|lanes| !lanes[node].is_empty())
    }
}

/// Computes the Jacobians along a step of the shares of the segments' ends in the loads at points.
#[inline(always)]
pub(super) fn point_blocks<'b, T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
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
