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

use super::inner_forces::{InnerForces, Loaded};
use super::linear::{
    add, add_matrices, invert, mul, mul_transposed, product, scale, sub, transposed_product,
    unrolled, zero, zero_matrix,
};
use super::memory::{Memory, Response};
use super::posture::{Energetic, Posture, RootMotion};
use super::step_matrix::{Reduction, solve, substitute};
use super::tasks::{Task, TrialAccelerations};
use super::{ChainState, Energies, Lanewise, NodeLoads, Real, StepWeights};

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
