//! Factorisation of `∂(residual)/∂q̈` along a step, and its solution.

use super::inner_forces::{Loaded, point_blocks};
use super::linear::{
    add, add_matrices, invert, mul, mul_transposed, negative, product, scale, sub, sub_matrices,
    transposed_product, unrolled, zero, zero_matrix,
};
use super::memory::{Elimination, Memory};
use super::posture::Posture;
use super::tasks::{Factorise, TrialAccelerations};
use super::{LaneSet, Lanewise, Real};

/// Factorises `∂(residual)/∂q̈` along a step, in `lanes`, at the point of the last
/// [`residual`](super::recursion::residual).
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
pub(super) struct Reduction<T, const D: usize, const S: usize> {
    force: [T; S],
    torque: [T; D],
}

impl<T: Real, const D: usize, const S: usize> Reduction<T, D, S> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            force: zero(),
            torque: zero(),
        }
    }

    /// Returns `δq̈` of the next segment inwards for its `right_side`, with its inner node and its
    /// inner neighbour at rest.
    #[inline(always)]
    pub(super) fn reduce(
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
pub(super) fn substitute<T: Real, P: Posture<T, D, S>, const D: usize, const S: usize>(
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
