//! O(n) dynamics of a chain by recursion over its segments.
//!
//! The chain is a tree without branches. Seen from its inner end `x_{k−1}`, everything outside joint `k` is a
//! body that answers an acceleration with a force; that answer is carried from the tip to the root (the
//! articulated-body recursion of Featherstone 1983, with 3 × 3 blocks because a node only translates). An
//! implicit step couples neighbours through the joints as well, which widens the block to five: the three
//! components of the node and the two coordinates of the segment inside it.

use super::chart::{self, JointConstants, PolarAxis, PoleError, Side, find_pole};
use super::linear::{
    add, add_matrices, invert, mul, mul_transposed, product, scale, sub, sub_matrices, transposed_product, zero,
    zero_matrix,
};
use super::{Real, kernels};

/// The constants of a chain (MODEL's symbols in the descriptions).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<T> {
    /// Number of segments, `n`.
    pub segments: usize,
    /// Segment length `h` in m.
    pub length: T,
    /// Segment mass `m` in kg.
    pub mass: T,
    /// Transverse moment of inertia of a segment about its centre, `J` in kg m².
    pub inertia: T,
    /// Stiffness of the clamp joint, `c_1` in N m.
    pub root_stiffness: T,
    /// Stiffness of every other joint, `c_k` in N m.
    pub joint_stiffness: T,
    /// Damping of the clamp joint, `d_1` in N m s.
    pub root_damping: T,
    /// Damping of every other joint, `d_k` in N m s.
    pub joint_damping: T,
    /// Gravitational acceleration in m/s².
    pub gravity: [T; 3],
}

impl<T: Real> Chain<T> {
    fn root_joint(&self) -> JointConstants<T> {
        JointConstants { stiffness: self.root_stiffness, damping: self.root_damping }
    }

    fn joint(&self) -> JointConstants<T> {
        JointConstants { stiffness: self.joint_stiffness, damping: self.joint_damping }
    }
}

/// The prescribed motion of the clamp at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamp<T> {
    /// Position of the root, `r_0` in m.
    pub position: [T; 3],
    /// Velocity of the root, `ṙ_0` in m/s.
    pub velocity: [T; 3],
    /// Acceleration of the root, `r̈_0` in m/s².
    pub acceleration: [T; 3],
    /// Unit vector of the clamp, `e_0`.
    pub direction: [T; 3],
    /// Its rate, `ė_0` in 1/s.
    pub direction_rate: [T; 3],
}

impl<T: Real> Clamp<T> {
    /// `e_0` and `ė_0` in the order of a chart.
    #[inline(always)]
    fn about(&self, axis: PolarAxis) -> ([T; 3], [T; 3]) {
        (axis.from_frame(self.direction), axis.from_frame(self.direction_rate))
    }
}

/// How the load on a node changes with its position and velocity.
#[derive(Clone, Copy, Debug)]
pub struct NodeTangent<T> {
    /// `∂F/∂x` in N/m.
    pub position: [[T; 3]; 3],
    /// `∂F/∂ẋ` in N s/m.
    pub velocity: [[T; 3]; 3],
}

/// External forces on the nodes `r_1 … r_n` of a chain (index 0 is `r_1`).
pub trait NodeLoads<T> {
    /// The force on a node in N, or none.
    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]>;

    /// Its derivatives; none where [`NodeLoads::force`] is none.
    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>>;
}

/// A chain that nothing touches.
#[derive(Clone, Copy, Debug)]
pub struct NoLoads;

impl<T> NodeLoads<T> for NoLoads {
    fn force(&self, _: usize, _: [T; 3], _: [T; 3]) -> Option<[T; 3]> {
        None
    }

    fn tangent(&self, _: usize, _: [T; 3], _: [T; 3]) -> Option<NodeTangent<T>> {
        None
    }
}

/// How an implicit step moves coordinates and rates with the accelerations: `δq = w_q δq̈`, `δq̇ = w_v δq̈`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepWeights<T> {
    /// `w_q` in s².
    pub coordinates: T,
    /// `w_v` in s.
    pub rates: T,
}

/// Energies of a chain, and the powers that change them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies<T> {
    /// `E_kin` in J.
    pub kinetic: T,
    /// `E_spring` in J.
    pub spring: T,
    /// `E_grav` in J.
    pub gravity: T,
    /// The dissipation function `D` in W; the dampers take `2 D`.
    pub dissipation: T,
    /// Power of the torque at the clamp in W: `(∂E_spring/∂e_0 + ∂D/∂ė_0)·ė_0`.
    pub clamp_torque_power: T,
}

/// One segment's share of the factorised step matrix.
#[derive(Clone, Copy, Debug)]
struct Elimination<T> {
    /// Inverse of the 2 × 2 pivot.
    pivot: [[T; 2]; 2],
    /// What the segment's own `δq̈` does to the force at its inner node and the torque on its inner neighbour.
    force: [[T; 2]; 3],
    torque: [[T; 2]; 2],
    /// What the inner node's `δẍ` and the inner neighbour's `δq̈` do to the segment's own, pivot applied.
    from_node: [[T; 3]; 2],
    from_neighbour: [[T; 2]; 2],
    /// `∂ẍ'/∂q̈` along the step.
    outer: [[T; 2]; 3],
}

/// Equations of motion of one chain, with the memory that their recursions need.
///
/// Arrays are indexed by segment, `0` being the one at the clamp; `q` holds `[φ, θ]` in rad, about the polar axis
/// that [`Dynamics::charts`] has for the segment. What the outside sees of nodes, loads and clamp is in the frame.
#[derive(Clone, Debug)]
pub struct Dynamics<T> {
    chain: Chain<T>,
    charts: Vec<PolarAxis>,
    angles: Vec<[T; 4]>,
    segments: Vec<kernels::Segment<T>>,
    torques: Vec<[T; 2]>,
    positions: Vec<[T; 3]>,
    velocities: Vec<[T; 3]>,
    /// Of the inner node of each segment, less gravity.
    base_accelerations: Vec<[T; 3]>,
    /// What the chain outside each segment's outer node needs there.
    outer_forces: Vec<[T; 3]>,
    root_force: [T; 3],
    eliminations: Vec<Elimination<T>>,
    /// Scratch of the solves: the segment's own part of `q̈` (or `δq̈`).
    partial: Vec<[T; 2]>,
    /// Scratch of [`Dynamics::accelerations`]: what the inner node's acceleration does to `q̈`.
    from_node: Vec<[[T; 3]; 2]>,
}

impl<T: Real> Dynamics<T> {
    /// Memory for `chain`, with all coordinates about `z`.
    ///
    /// # Panics
    /// If the chain has no segment.
    pub fn new(chain: Chain<T>) -> Self {
        let n = chain.segments;
        assert!(n > 0, "a chain has at least one segment");
        let none = T::from_f64(0.0);
        let segment = kernels::segment([none; 4], [none; 2], none, none, none);
        let elimination = Elimination {
            pivot: zero_matrix(),
            force: zero_matrix(),
            torque: zero_matrix(),
            from_node: zero_matrix(),
            from_neighbour: zero_matrix(),
            outer: zero_matrix(),
        };
        Self {
            chain,
            charts: vec![PolarAxis::default(); n],
            angles: vec![[none; 4]; n],
            segments: vec![segment; n],
            torques: vec![zero(); n],
            positions: vec![zero(); n],
            velocities: vec![zero(); n],
            base_accelerations: vec![zero(); n],
            outer_forces: vec![zero(); n],
            root_force: zero(),
            eliminations: vec![elimination; n],
            partial: vec![zero(); n],
            from_node: vec![zero_matrix(); n],
        }
    }

    /// The constants.
    pub fn chain(&self) -> &Chain<T> {
        &self.chain
    }

    /// Other constants from now on, of as many segments.
    pub(super) fn set_chain(&mut self, chain: Chain<T>) {
        self.chain = chain;
    }

    /// The polar axis of each segment's coordinates.
    pub fn charts(&self) -> &[PolarAxis] {
        &self.charts
    }

    /// Takes coordinates about `charts` from now on; their conversion is the caller's ([`PolarAxis::coordinates`]).
    ///
    /// # Panics
    /// If there are not as many as segments.
    pub fn set_charts(&mut self, charts: &[PolarAxis]) {
        self.charts.copy_from_slice(charts);
    }

    /// Positions of the nodes `r_1 … r_n` in m, at the state of the last call.
    pub fn positions(&self) -> &[[T; 3]] {
        &self.positions
    }

    /// Velocities of the nodes in m/s, at the state of the last call.
    pub fn velocities(&self) -> &[[T; 3]] {
        &self.velocities
    }

    /// Force that the clamp exerts on the root in N, from the last [`Dynamics::residual`].
    pub fn root_force(&self) -> [T; 3] {
        self.root_force
    }

    /// Acceleration of the node `r_{k+1}` in m/s², for `k = node`, at the `q̈` of the last [`Dynamics::residual`].
    pub fn node_acceleration(&self, node: usize, accelerations: &[[T; 2]]) -> [T; 3] {
        let segment = &self.segments[node];
        let relative = add(mul(&segment.reach_jacobian, accelerations[node]), segment.reach_bias);
        add(add(self.base_accelerations[node], self.chain.gravity), relative)
    }

    /// Angles, positions and velocities, root to tip.
    #[inline(always)]
    fn kinematics(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) {
        let n = self.chain.segments;
        let Chain { length, mass, inertia, .. } = self.chain;
        let (mut position, mut velocity) = (clamp.position, clamp.velocity);
        let arrays = self.angles[..n].iter_mut().zip(&mut self.segments[..n]).zip(&self.charts[..n]);
        let nodes = self.positions[..n].iter_mut().zip(&mut self.velocities[..n]);
        for ((((angles, segment), axis), nodes), (q, v)) in arrays.zip(nodes).zip(q[..n].iter().zip(&v[..n])) {
            let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = (q[0].sin_cos(), q[1].sin_cos());
            *angles = [sin_phi, cos_phi, sin_theta, cos_theta];
            *segment = kernels::segment(*angles, *v, length, mass, inertia);
            if *axis != PolarAxis::Z {
                *segment = chart::segment_to_frame(*axis, *segment);
            }
            position = add(position, segment.reach);
            velocity = add(velocity, segment.reach_rate);
            (*nodes.0, *nodes.1) = (position, velocity);
        }
    }

    /// Torques of springs and dampers on each segment.
    #[inline(always)]
    fn joint_torques(&mut self, clamp: &Clamp<T>, v: &[[T; 2]]) {
        let n = self.chain.segments;
        let (angles, torques, v) = (&self.angles[..n], &mut self.torques[..n], &v[..n]);
        let charts = &self.charts[..n];
        let side = |k: usize| Side { angles: angles[k], rates: v[k], axis: charts[k] };
        let root = self.chain.root_joint();
        let (direction, direction_rate) = clamp.about(charts[0]);
        torques[0] = kernels::clamp(direction, direction_rate, angles[0], v[0], root.stiffness, root.damping).next;
        let constants = self.chain.joint();
        for k in 1..n {
            let joint = chart::joint(side(k - 1), side(k), constants);
            torques[k - 1] = add(torques[k - 1], joint.previous);
            torques[k] = joint.next;
        }
    }

    /// Accelerations `q̈` in rad/s² at the state `(q, q̇)`, into `accelerations`.
    ///
    /// Exact up to rounding: the solution of `M q̈ = f + Q` by elimination from the tip to the root, without
    /// forming `M`. Joint torques are exact to one rounding of `c`, so that in a nearly straight filament small
    /// components are known to some 1e-16 of what a bend of one radian would give.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    // Inlined, as all that it calls, into the function that has the instructions for its lanes (`batch.rs`).
    #[inline(always)]
    pub fn accelerations(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        let n = self.chain.segments;
        self.kinematics(clamp, q, v);
        self.joint_torques(clamp, v);
        let mass = self.chain.mass;
        let (segments, torques) = (&self.segments[..n], &self.torques[..n]);
        let (partial, from_node) = (&mut self.partial[..n], &mut self.from_node[..n]);

        // The outer chain answers ẍ at its inner node with A ẍ + b; A is symmetric.
        let (mut a, mut b) = (zero_matrix(), zero());
        for k in (0..n).rev() {
            if let Some(force) = loads.force(k, self.positions[k], self.velocities[k]) {
                b = sub(b, force);
            }
            let segment = &segments[k];
            let jacobian = &segment.reach_jacobian;
            let outer = add(mul(&a, segment.reach_bias), b);
            let spread = product(&a, jacobian);
            let coupling = add_matrices(&segment.coupling, &spread);
            let pivot = invert(&add_matrices(&segment.inertia, &transposed_product(jacobian, &spread)));
            let torque = sub(sub(torques[k], segment.bias), mul_transposed(jacobian, outer));
            // (Uᵀ premultiplied by the pivot, which is symmetric here.)
            let mut response = zero_matrix::<T, 2, 3>();
            for row in 0..2 {
                response[row] = mul(&coupling, pivot[row]);
            }
            let own = mul(&pivot, torque);
            let correction = product(&coupling, &response);
            // One half is computed and mirrored.
            for row in 0..3 {
                for column in row..3 {
                    let entry = a[row][column] - correction[row][column];
                    a[row][column] = entry;
                    a[column][row] = entry;
                }
                a[row][row] = mass + a[row][row];
            }
            b = add(add(segment.base_bias, outer), mul(&coupling, own));
            partial[k] = own;
            from_node[k] = response;
        }

        let mut base = sub(clamp.acceleration, self.chain.gravity);
        for k in 0..n {
            let segment = &segments[k];
            let acceleration = sub(partial[k], mul(&from_node[k], base));
            base = add(base, add(mul(&segment.reach_jacobian, acceleration), segment.reach_bias));
            accelerations[k] = acceleration;
        }
    }

    /// `M q̈ − f − Q` in N m at `(q, q̇, q̈)`, into `residual`, without forming `M`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn residual(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        residual: &mut [[T; 2]],
    ) {
        let n = self.chain.segments;
        self.kinematics(clamp, q, v);
        self.joint_torques(clamp, v);
        let (segments, torques) = (&self.segments[..n], &self.torques[..n]);
        let (bases, outer_forces) = (&mut self.base_accelerations[..n], &mut self.outer_forces[..n]);
        let (accelerations, residual) = (&accelerations[..n], &mut residual[..n]);

        let mut base = sub(clamp.acceleration, self.chain.gravity);
        for k in 0..n {
            bases[k] = base;
            let segment = &segments[k];
            base = add(base, add(mul(&segment.reach_jacobian, accelerations[k]), segment.reach_bias));
        }
        let mut force = zero();
        for k in (0..n).rev() {
            if let Some(load) = loads.force(k, self.positions[k], self.velocities[k]) {
                force = sub(force, load);
            }
            outer_forces[k] = force;
            let segment = &segments[k];
            let inertial = add(mul(&segment.inertia, accelerations[k]), segment.bias);
            let carried =
                add(mul_transposed(&segment.coupling, bases[k]), mul_transposed(&segment.reach_jacobian, force));
            residual[k] = sub(add(inertial, carried), torques[k]);
            let own = add(mul(&segment.coupling, accelerations[k]), segment.base_bias);
            force = add(force, add(scale(self.chain.mass, bases[k]), own));
        }
        self.root_force = force;
    }

    /// Factorises the matrix of Newton's method, `∂(residual)/∂q̈` along a step of the given weights, at the
    /// state of the last [`Dynamics::residual`], which must have been called with the same arguments.
    ///
    /// The matrix is exact but for one approximation: a loaded node is taken to move by `w_q δẍ` (and at
    /// `w_v δẍ`), which neglects `2 w_v |q̇|` against one. Newton's method converges to the same solution.
    pub fn factorise(
        &mut self,
        clamp: &Clamp<T>,
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
    ) {
        let n = self.chain.segments;
        let Chain { length, mass, inertia, .. } = self.chain;
        let (root, constants) = (self.chain.root_joint(), self.chain.joint());
        let charts = &self.charts[..n];
        let (angles, segments, v) = (&self.angles[..n], &self.segments[..n], &v[..n]);
        let (bases, outer_forces) = (&self.base_accelerations[..n], &self.outer_forces[..n]);
        let eliminations = &mut self.eliminations[..n];

        // The outer chain answers δẍ at its inner node and δq̈ of the segment inside it with the force
        // A δẍ + B δq̈ and the torque C δẍ + D δq̈.
        let (mut a, mut b, mut c, mut d) = (zero_matrix(), zero_matrix(), zero_matrix(), zero_matrix());
        for k in (0..n).rev() {
            if let Some(tangent) = loads.tangent(k, self.positions[k], self.velocities[k]) {
                for row in 0..3 {
                    let elastic = scale(weights.coordinates, tangent.position[row]);
                    let viscous = scale(weights.rates, tangent.velocity[row]);
                    a[row] = sub(sub(a[row], elastic), viscous);
                }
            }
            let segment = &segments[k];
            let jacobian = &segment.reach_jacobian;
            let axis = charts[k];
            let mut tangent = kernels::segment_tangent(
                angles[k],
                v[k],
                accelerations[k],
                axis.from_frame(bases[k]),
                axis.from_frame(outer_forces[k]),
                length,
                mass,
                inertia,
                weights.coordinates,
                weights.rates,
            );
            if axis != PolarAxis::Z {
                tangent.base_force = axis.to_frame(tangent.base_force);
                tangent.outer_acceleration = axis.to_frame(tangent.outer_acceleration);
            }
            let joint = if k == 0 {
                let (direction, direction_rate) = clamp.about(axis);
                let clamp = kernels::clamp_tangent(
                    direction,
                    direction_rate,
                    angles[0],
                    v[0],
                    root.stiffness,
                    root.damping,
                    weights.coordinates,
                    weights.rates,
                );
                kernels::JointTangent {
                    previous_previous: zero_matrix(),
                    previous_next: zero_matrix(),
                    next_previous: zero_matrix(),
                    next_next: clamp.next_next,
                }
            } else {
                let side = |k: usize| Side { angles: angles[k], rates: v[k], axis: charts[k] };
                chart::joint_tangent(side(k - 1), side(k), constants, weights)
            };
            let outer = &tangent.outer_acceleration;
            let spread = add_matrices(&product(&a, outer), &b);
            let mut pivot = add_matrices(&tangent.torque, &transposed_product(jacobian, &spread));
            pivot = add_matrices(&pivot, &add_matrices(&product(&c, outer), &d));
            let pivot = invert(&add_matrices(&pivot, &joint.next_next));
            let coupling: [[T; 3]; 2] = {
                let through_outer = add_matrices(&transposed_product(jacobian, &a), &c);
                std::array::from_fn(|row| {
                    std::array::from_fn(|column| segment.coupling[column][row] + through_outer[row][column])
                })
            };
            let from_node = product(&pivot, &coupling);
            let from_neighbour = product(&pivot, &joint.next_previous);
            let force = add_matrices(&tangent.base_force, &spread);
            let torque = joint.previous_next;

            a = sub_matrices(&a, &product(&force, &from_node));
            for i in 0..3 {
                a[i][i] = a[i][i] + mass;
            }
            b = product(&force, &from_neighbour).map(|row| row.map(|entry| -entry));
            c = product(&torque, &from_node).map(|row| row.map(|entry| -entry));
            d = sub_matrices(&joint.previous_previous, &product(&torque, &from_neighbour));
            eliminations[k] = Elimination { pivot, force, torque, from_node, from_neighbour, outer: *outer };
        }
    }

    /// Solves the factorised system for `right_side` (N m), which becomes the change of `q̈` (rad/s²).
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    pub fn solve(&mut self, right_side: &mut [[T; 2]]) {
        let n = self.chain.segments;
        let (eliminations, segments) = (&self.eliminations[..n], &self.segments[..n]);
        let (partial, right_side) = (&mut self.partial[..n], &mut right_side[..n]);
        let (mut force, mut torque) = (zero::<T, 3>(), zero::<T, 2>());
        for k in (0..n).rev() {
            let elimination = &eliminations[k];
            let own = sub(sub(right_side[k], mul_transposed(&segments[k].reach_jacobian, force)), torque);
            let own = mul(&elimination.pivot, own);
            force = add(force, mul(&elimination.force, own));
            torque = mul(&elimination.torque, own);
            partial[k] = own;
        }
        let (mut base, mut neighbour) = (zero::<T, 3>(), zero::<T, 2>());
        for k in 0..n {
            let elimination = &eliminations[k];
            let inner = add(mul(&elimination.from_node, base), mul(&elimination.from_neighbour, neighbour));
            neighbour = sub(partial[k], inner);
            base = add(base, mul(&elimination.outer, neighbour));
            right_side[k] = neighbour;
        }
    }

    /// Energies, dissipation and clamp power at the state of the last call that took `(q, q̇)`.
    pub fn energies(&self, clamp: &Clamp<T>, v: &[[T; 2]]) -> Energies<T> {
        let n = self.chain.segments;
        let Chain { length, mass, inertia, gravity, .. } = self.chain;
        let (root, constants) = (self.chain.root_joint(), self.chain.joint());
        let (direction, direction_rate) = clamp.about(self.charts[0]);
        let root = kernels::clamp_energy(direction, direction_rate, self.angles[0], v[0], root.stiffness, root.damping);
        let none = T::from_f64(0.0);
        let mut energies = Energies {
            kinetic: none,
            spring: root.spring,
            gravity: none,
            dissipation: root.dissipation,
            clamp_torque_power: root.power,
        };
        let (mut position, mut velocity) = (clamp.position, clamp.velocity);
        let side = |k: usize| Side { angles: self.angles[k], rates: v[k], axis: self.charts[k] };
        for k in 0..n {
            let Side { angles, rates, axis } = side(k);
            let [x, x_rate, g] = [position, velocity, gravity].map(|vector| axis.from_frame(vector));
            let segment = kernels::segment_energy(angles, rates, x, x_rate, g, length, mass, inertia);
            energies.kinetic = energies.kinetic + segment.kinetic;
            energies.gravity = energies.gravity + segment.gravity;
            if k > 0 {
                let joint = chart::joint_energy(side(k - 1), side(k), constants);
                energies.spring = energies.spring + joint.spring;
                energies.dissipation = energies.dissipation + joint.dissipation;
            }
            (position, velocity) = (self.positions[k], self.velocities[k]);
        }
        energies
    }

    /// Positions, velocities and angles at `(q, q̇)`, without forces.
    pub fn place(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) {
        self.kinematics(clamp, q, v);
    }
}

impl Dynamics<f64> {
    /// Refuses coordinates at a pole of their chart, within `|sin φ| <` [`POLE`](super::POLE).
    ///
    /// The accelerations at a pole are not finite, or have no digit that is right: callers that take a state from
    /// outside ask here first.
    ///
    /// # Errors
    /// With the first segment that stands there.
    pub fn check_poles(&self, q: &[[f64; 2]]) -> Result<(), PoleError> {
        match find_pole(q) {
            Some(k) => Err(PoleError { segment: k + 1, polar_angle: q[k][0], axis: self.charts[k] }),
            None => Ok(()),
        }
    }
}
