//! Equations of motion of a chain in the plane of rotation, and of its lateral variation.
//!
//! A planar chain has one coordinate a segment, its azimuth `θ`, and nodes in the plane `z = 0`. Its polar angles are `π/2`
//! exactly. In the plane the angle of a joint is the difference of two azimuths, so that a spring takes no more than a product.
//!
//! Beside the motion itself the equations carry its lateral variation: `η = ∂φ/∂τ`, where `τ` is a small tilt of the clamp out of
//! the plane. It obeys linear equations along the planar motion (`codegen/src/model/lateral.rs`).
//!
//! A block of coordinates is `[η, θ]`.

use super::chart::JointConstants;
use super::dispatch::Loop;
use super::dynamics::Task;
use super::linear::{add, in_lane, zero};
use super::recursion::{self, Joint, JointTangent, LoadTangent, Memory, Posture, Root, Segment, SegmentTangent};
use super::{Chain, Clamp, Compiled, Energies, LaneSet, Lanewise, NodeLoads, Real, StepWeights, kernels};

/// Equations of motion of one planar chain, or of one per lane, with the memory for their recursions.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. `q` holds `[η, θ]`, `η` per rad of tilt and `θ` in rad.
/// Neighbouring azimuths differ by less than `π`. Nodes, loads and clamp are in the frame; their components along `z` are zero.
#[derive(Clone, Debug)]
pub struct PlanarDynamics<T> {
    chain: Chain<T>,
    /// `sin θ, cos θ`
    angles: Vec<[T; 2]>,
    memory: Memory<T, 1, 2>,
    lateral: Memory<T, 1, 1>,
}

impl<T: Real> PlanarDynamics<T> {
    /// Memory for `chain`.
    ///
    /// # Panics
    /// If the chain has no segment.
    pub fn new(chain: Chain<T>) -> Self {
        let n = chain.segments;
        assert!(n > 0, "a chain has at least one segment");
        Self { chain, angles: vec![zero(); n], memory: Memory::new(n), lateral: Memory::new(n) }
    }

    /// The constants.
    pub fn chain(&self) -> &Chain<T> {
        &self.chain
    }

    /// Replaces the constants by others with the same number of segments.
    pub(crate) fn set_chain(&mut self, chain: Chain<T>) {
        self.chain = chain;
    }

    /// Position in m and velocity in m/s of the node `r_{k+1}`, for `k = node`, at the state of the last
    /// [`PlanarDynamics::place`], [`PlanarDynamics::track`] or [`PlanarDynamics::residual`].
    pub fn node(&self, node: usize) -> [[T; 3]; 2] {
        [to_frame(self.memory.positions[node]), to_frame(self.memory.velocities[node])]
    }

    /// Force that the clamp exerts on the root in N, from the last [`PlanarDynamics::residual`].
    pub fn root_force(&self) -> [T; 3] {
        to_frame(self.memory.root_force)
    }

    /// Energies, dissipation and clamp power at the state `(q, q̇)`, where the nodes were last placed.
    pub fn energies(&self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) -> Energies<T> {
        let posture = Planar::new(&self.chain, &self.angles, q, v, clamp);
        let Chain { segments: n, length, mass, inertia, gravity, .. } = self.chain;
        let root = posture.clamp_energy();
        let none = T::from_f64(0.0);
        let mut energies = Energies {
            kinetic: none,
            spring: root.spring,
            gravity: none,
            dissipation: root.dissipation,
            clamp_torque_power: root.power,
        };
        let Root { mut position, mut velocity, .. } = posture.root();
        for k in 0..n {
            let gravity = in_plane(gravity);
            let segment = kernels::planar_segment_energy(
                self.angles[k],
                v[k][1],
                position,
                velocity,
                gravity,
                length,
                mass,
                inertia,
            );
            energies.kinetic = energies.kinetic + segment.kinetic;
            energies.gravity = energies.gravity + segment.gravity;
            if k > 0 {
                let joint = posture.joint_energy(k);
                energies.spring = energies.spring + joint.spring;
                energies.dissipation = energies.dissipation + joint.dissipation;
            }
            (position, velocity) = (self.memory.positions[k], self.memory.velocities[k]);
        }
        energies
    }
}

impl<T: Compiled> PlanarDynamics<T> {
    /// Angles, positions and velocities at `(q, q̇)`, without forces.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn place(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) {
        T::run_planar(self, PlanarTask::Motion(Task::Place { clamp, q, v }));
    }

    /// Like [`PlanarDynamics::place`], with the accelerations of the nodes at `q̈`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn track(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) {
        T::run_planar(self, PlanarTask::Motion(Task::Track { clamp, q, v, accelerations }));
    }

    /// The [`Energies::dissipation`] alone in W, at the `q` of the last call that took it.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn dissipation(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) -> T {
        let mut result = T::from_f64(0.0);
        T::run_planar(self, PlanarTask::Motion(Task::Dissipation { clamp, q, v, result: &mut result }));
        result
    }

    /// Moves the nodes to their positions after `correction` is subtracted from the `q̈` of the last
    /// [`PlanarDynamics::residual`]; see [`Dynamics::shift`](super::Dynamics::shift).
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    pub fn shift(&mut self, correction: &[[T; 2]], weights: StepWeights<T>) {
        T::run_planar(self, PlanarTask::Motion(Task::Shift { correction, weights }));
    }

    /// Azimuthal accelerations `θ̈` in rad/s² at the state `(q, q̇)`, into `accelerations`, whose `η̈` stay as they are; see
    /// [`Dynamics::accelerations`](super::Dynamics::accelerations).
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn accelerations(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        T::run_planar(self, PlanarTask::Motion(Task::Accelerations { clamp, q, v, loads, result: accelerations }));
    }

    /// The `η̈` that belong to the `θ̈` in `accelerations`, at the point of the last [`PlanarDynamics::residual`], which must have
    /// been called with the same arguments.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn lateral_accelerations(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        T::run_planar(self, PlanarTask::Lateral { clamp, q, v, loads, result: accelerations });
    }

    /// `M θ̈ − f − Q` in N m at `(q, q̇, q̈)`, into `residual`, whose entries for the variation stay as they are.
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
        let task = Task::Residual { clamp, q, v, accelerations, loads, result: residual };
        T::run_planar(self, PlanarTask::Motion(task));
    }

    /// [`PlanarDynamics::residual`] and [`PlanarDynamics::solve`] in one, with the result in `correction`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn correction(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        correction: &mut [[T; 2]],
    ) {
        let task = Task::Correction { clamp, q, v, accelerations, loads, result: correction };
        T::run_planar(self, PlanarTask::Motion(task));
    }

    /// Solves the factorised equations of the variation, and puts its correction into `correction`, which holds that of `θ̈`.
    ///
    /// The right side is the residual of the variation at the point of the last [`PlanarDynamics::residual`], but with the loads
    /// that the nodes carry after the correction of `θ̈`: in a stiff contact they change by far more than anything else. The
    /// nodes are moved there, as by [`PlanarDynamics::shift`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    #[allow(clippy::too_many_arguments, reason = "a state, its loads, and a step")]
    pub fn solve_variation(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        correction: &mut [[T; 2]],
    ) {
        T::run_planar(self, PlanarTask::Variation { clamp, q, v, accelerations, loads, weights, correction });
    }

    /// Solves the factorised equations of motion for `right_side`, in place. Its entries for the variation stay as they are.
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    pub fn solve(&mut self, right_side: &mut [[T; 2]]) {
        T::run_planar(self, PlanarTask::Motion(Task::Solve { right_side }));
    }

    /// Factorises the matrices of Newton's method at the state of the last [`PlanarDynamics::residual`]; see
    /// [`Dynamics::factorise`](super::Dynamics::factorise). The effect of `θ̈` on the lateral equations is neglected, because
    /// the motion does not depend on its variation.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    #[allow(clippy::too_many_arguments, reason = "a state, its loads, and a step")]
    pub fn factorise(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        lanes: LaneSet,
    ) {
        let task = Task::Factorise { clamp, q, v, accelerations, loads, weights, lanes };
        T::run_planar(self, PlanarTask::Motion(task));
    }
}

impl<T: Lanewise> PlanarDynamics<T> {
    /// Position in m and velocity in m/s of a node in one lane; see [`PlanarDynamics::node`].
    #[inline]
    pub fn node_in_lane(&self, node: usize, lane: usize) -> [[f64; 3]; 2] {
        [in_lane(&self.memory.positions[node], lane), in_lane(&self.memory.velocities[node], lane)]
            .map(|[x, y]| [x, y, 0.0])
    }

    /// Position, velocity and acceleration of a node in one lane, after [`PlanarDynamics::track`] or
    /// [`PlanarDynamics::residual`].
    #[inline]
    pub fn node_motion(&self, node: usize, lane: usize) -> [[f64; 3]; 3] {
        let base = in_lane(&self.memory.base_accelerations[node + 1], lane);
        let acceleration = add(base, in_lane(&in_plane(self.chain.gravity), lane));
        [in_lane(&self.memory.positions[node], lane), in_lane(&self.memory.velocities[node], lane), acceleration]
            .map(|[x, y]| [x, y, 0.0])
    }
}

/// The components in the plane of rotation.
#[inline(always)]
fn in_plane<T: Real>([x, y, _]: [T; 3]) -> [T; 2] {
    [x, y]
}

#[inline(always)]
fn to_frame<T: Real>([x, y]: [T; 2]) -> [T; 3] {
    [x, y, T::from_f64(0.0)]
}

/// A chain in the plane of rotation at one state.
struct Planar<'a, T> {
    chain: Chain<T>,
    angles: &'a [[T; 2]],
    q: &'a [[T; 2]],
    v: &'a [[T; 2]],
    clamp: &'a Clamp<T>,
}

impl<'a, T: Real> Planar<'a, T> {
    #[inline(always)]
    fn new(chain: &Chain<T>, angles: &'a [[T; 2]], q: &'a [[T; 2]], v: &'a [[T; 2]], clamp: &'a Clamp<T>) -> Self {
        let n = chain.segments;
        Self { chain: *chain, angles: &angles[..n], q: &q[..n], v: &v[..n], clamp }
    }

    #[inline(always)]
    fn root(&self) -> Root<T, 2> {
        let Root { position, velocity, acceleration } = self.clamp.root(self.chain.gravity);
        Root { position: in_plane(position), velocity: in_plane(velocity), acceleration: in_plane(acceleration) }
    }

    /// `e_0` and `ė_0`.
    #[inline(always)]
    fn clamp(&self) -> ([T; 2], [T; 2]) {
        (in_plane(self.clamp.direction), in_plane(self.clamp.direction_rate))
    }

    #[inline(always)]
    fn clamp_energy(&self) -> kernels::PlanarClampEnergy<T> {
        let JointConstants { stiffness, damping } = self.chain.root_joint();
        let (direction, direction_rate) = self.clamp();
        kernels::planar_clamp_energy(direction, direction_rate, self.angles[0], self.v[0][1], stiffness, damping)
    }

    /// Energy and dissipation of the joint at the inner end of segment `k`, which is not the first.
    #[inline(always)]
    fn joint_energy(&self, k: usize) -> kernels::PlanarJointEnergy<T> {
        let JointConstants { stiffness, damping } = self.chain.joint();
        let ([_, inner], [_, outer]) = (self.q[k - 1], self.q[k]);
        kernels::planar_joint_energy(inner, outer, self.v[k - 1][1], self.v[k][1], stiffness, damping)
    }

    /// The dissipation function of the whole chain in W.
    #[inline(always)]
    fn dissipation(&self) -> T {
        let mut sum = self.clamp_energy().dissipation;
        for k in 1..self.chain.segments {
            sum = sum + self.joint_energy(k).dissipation;
        }
        sum
    }
}

impl<T: Real> Posture<T, 1, 2> for Planar<'_, T> {
    #[inline(always)]
    fn segments(&self) -> usize {
        self.chain.segments
    }

    #[inline(always)]
    fn mass(&self) -> T {
        self.chain.mass
    }

    #[inline(always)]
    fn take([_, azimuth]: [T; 2]) -> [T; 1] {
        [azimuth]
    }

    #[inline(always)]
    fn put(block: &mut [T; 2], [azimuth]: [T; 1]) {
        block[1] = azimuth;
    }

    #[inline(always)]
    fn segment(&self, k: usize) -> Segment<T, 1, 2> {
        let Chain { length, mass, inertia, .. } = self.chain;
        let kernels::PlanarSegment {
            inertia,
            coupling,
            bias,
            base_bias,
            reach,
            reach_rate,
            reach_jacobian,
            reach_bias,
        } = kernels::planar_segment(self.angles[k], self.v[k][1], length, mass, inertia);
        Segment { inertia, coupling, bias, base_bias, reach, reach_rate, reach_jacobian, reach_bias }
    }

    #[inline(always)]
    fn inner_joint(&self, k: usize) -> Joint<T, 1> {
        if k > 0 {
            let JointConstants { stiffness, damping } = self.chain.joint();
            let ([_, inner], [_, outer]) = (self.q[k - 1], self.q[k]);
            let kernels::PlanarJoint { previous, next } =
                kernels::planar_joint(inner, outer, self.v[k - 1][1], self.v[k][1], stiffness, damping);
            return Joint { previous, next };
        }
        let JointConstants { stiffness, damping } = self.chain.root_joint();
        let (direction, direction_rate) = self.clamp();
        let clamp = kernels::planar_clamp(direction, direction_rate, self.angles[0], self.v[0][1], stiffness, damping);
        Joint { previous: zero(), next: clamp.next }
    }

    #[inline(always)]
    fn load(&self, loads: &dyn NodeLoads<T>, k: usize, position: [T; 2], velocity: [T; 2]) -> Option<[T; 2]> {
        loads.force(k, to_frame(position), to_frame(velocity)).map(in_plane)
    }

    #[inline(always)]
    fn segment_tangent(
        &self,
        k: usize,
        [acceleration]: [T; 1],
        base_acceleration: [T; 2],
        outer_force: [T; 2],
        weights: StepWeights<T>,
    ) -> SegmentTangent<T, 1, 2> {
        let Chain { length, mass, inertia, .. } = self.chain;
        let kernels::PlanarSegmentTangent { torque, base_force, outer_acceleration } = kernels::planar_segment_tangent(
            self.angles[k],
            self.v[k][1],
            acceleration,
            base_acceleration,
            outer_force,
            length,
            mass,
            inertia,
            weights.coordinates,
            weights.rates,
        );
        SegmentTangent { torque, base_force, outer_acceleration }
    }

    #[inline(always)]
    fn inner_joint_tangent(&self, k: usize, weights: StepWeights<T>) -> JointTangent<T, 1> {
        if k > 0 {
            let JointConstants { stiffness, damping } = self.chain.joint();
            let kernels::PlanarJointTangent { previous_previous, previous_next, next_previous, next_next } =
                kernels::planar_joint_tangent(stiffness, damping, weights.coordinates, weights.rates);
            return JointTangent { previous_previous, previous_next, next_previous, next_next };
        }
        let JointConstants { stiffness, damping } = self.chain.root_joint();
        let (direction, direction_rate) = self.clamp();
        let clamp = kernels::planar_clamp_tangent(
            direction,
            direction_rate,
            self.angles[0],
            self.v[0][1],
            stiffness,
            damping,
            weights.coordinates,
            weights.rates,
        );
        JointTangent::at_clamp(clamp.next_next)
    }

    #[inline(always)]
    fn load_tangent(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        position: [T; 2],
        velocity: [T; 2],
    ) -> Option<LoadTangent<T, 2>> {
        let tangent = loads.tangent(k, to_frame(position), to_frame(velocity))?;
        let block = |[x, y, _]: [[T; 3]; 3]| [in_plane(x), in_plane(y)];
        Some(LoadTangent { position: block(tangent.position), velocity: block(tangent.velocity) })
    }
}

/// The lateral variation of a planar chain, along the motion whose inverse dynamics are in `motion`.
struct Lateral<'a, T> {
    planar: Planar<'a, T>,
    motion: &'a Memory<T, 1, 2>,
}

impl<T: Real> Lateral<'_, T> {
    /// `sin(θ − θ'), cos(θ − θ')` of the segments inside and outside joint `k`.
    #[inline(always)]
    fn azimuth_step(&self, k: usize) -> [T; 2] {
        let ([sin, cos], [next_sin, next_cos]) = (self.planar.angles[k - 1], self.planar.angles[k]);
        [sin * next_cos - cos * next_sin, cos * next_cos + sin * next_sin]
    }

    /// The resistance of the loads on node `k` to a lateral motion, `−∂F_z/∂ż` in N s/m.
    #[inline(always)]
    fn damping(&self, loads: &dyn NodeLoads<T>, k: usize) -> Option<T> {
        let (position, velocity) = (to_frame(self.motion.positions[k]), to_frame(self.motion.velocities[k]));
        loads.lateral_damping(k, position, velocity)
    }

    /// The root stays where it is when the clamp is tilted.
    #[inline(always)]
    fn root() -> Root<T, 1> {
        Root { position: zero(), velocity: zero(), acceleration: zero() }
    }
}

impl<T: Real> Posture<T, 1, 1> for Lateral<'_, T> {
    #[inline(always)]
    fn segments(&self) -> usize {
        self.planar.segments()
    }

    #[inline(always)]
    fn mass(&self) -> T {
        self.planar.mass()
    }

    #[inline(always)]
    fn take([variation, _]: [T; 2]) -> [T; 1] {
        [variation]
    }

    #[inline(always)]
    fn put(block: &mut [T; 2], [variation]: [T; 1]) {
        block[0] = variation;
    }

    #[inline(always)]
    fn segment(&self, k: usize) -> Segment<T, 1, 1> {
        let Planar { chain: Chain { length, mass, inertia, .. }, angles, q, v, .. } = self.planar;
        let kernels::LateralSegment { inertia, coupling, bias, reach, reach_rate, reach_jacobian } =
            kernels::lateral_segment(
                angles[k],
                v[k][1],
                self.motion.base_accelerations[k],
                self.motion.outer_forces[k],
                q[k][0],
                v[k][0],
                length,
                mass,
                inertia,
            );
        // Adding −0 changes no number, so that the compiler leaves it out.
        let none = [T::from_f64(-0.0)];
        Segment { inertia, coupling, bias, base_bias: none, reach, reach_rate, reach_jacobian, reach_bias: none }
    }

    #[inline(always)]
    fn inner_joint(&self, k: usize) -> Joint<T, 1> {
        let Planar { q, v, .. } = self.planar;
        if k > 0 {
            let JointConstants { stiffness, damping } = self.planar.chain.joint();
            let kernels::LateralJoint { previous, next } = kernels::lateral_joint(
                self.azimuth_step(k),
                v[k - 1][1],
                v[k][1],
                q[k - 1][0],
                v[k - 1][0],
                q[k][0],
                v[k][0],
                stiffness,
                damping,
            );
            return Joint { previous, next };
        }
        let JointConstants { stiffness, damping } = self.planar.chain.root_joint();
        let (direction, direction_rate) = self.planar.clamp();
        let angles = self.planar.angles[0];
        let clamp =
            kernels::lateral_clamp(direction, direction_rate, angles, v[0][1], stiffness, damping, q[0][0], v[0][0]);
        Joint { previous: zero(), next: clamp.next }
    }

    #[inline(always)]
    fn is_loaded(&self, loads: &dyn NodeLoads<T>) -> bool {
        !loads.is_empty() && loads.resists_lateral_motion()
    }

    #[inline(always)]
    fn load(&self, loads: &dyn NodeLoads<T>, k: usize, _: [T; 1], [velocity]: [T; 1]) -> Option<[T; 1]> {
        self.damping(loads, k).map(|damping| [damping * velocity])
    }

    #[inline(always)]
    fn segment_tangent(
        &self,
        k: usize,
        _: [T; 1],
        _: [T; 1],
        _: [T; 1],
        weights: StepWeights<T>,
    ) -> SegmentTangent<T, 1, 1> {
        let Planar { chain: Chain { length, mass, inertia, .. }, angles, v, .. } = self.planar;
        let kernels::LateralSegmentTangent { torque, base_force, outer_acceleration } =
            kernels::lateral_segment_tangent(
                angles[k],
                v[k][1],
                self.motion.base_accelerations[k],
                self.motion.outer_forces[k],
                length,
                mass,
                inertia,
                weights.coordinates,
                weights.rates,
            );
        SegmentTangent { torque, base_force, outer_acceleration }
    }

    #[inline(always)]
    fn inner_joint_tangent(&self, k: usize, weights: StepWeights<T>) -> JointTangent<T, 1> {
        let v = self.planar.v;
        if k > 0 {
            let JointConstants { stiffness, damping } = self.planar.chain.joint();
            let kernels::LateralJointTangent { previous_previous, previous_next, next_previous, next_next } =
                kernels::lateral_joint_tangent(
                    self.azimuth_step(k),
                    v[k - 1][1],
                    v[k][1],
                    stiffness,
                    damping,
                    weights.coordinates,
                    weights.rates,
                );
            return JointTangent { previous_previous, previous_next, next_previous, next_next };
        }
        let JointConstants { stiffness, damping } = self.planar.chain.root_joint();
        let (direction, direction_rate) = self.planar.clamp();
        let clamp = kernels::lateral_clamp_tangent(
            direction,
            direction_rate,
            self.planar.angles[0],
            v[0][1],
            stiffness,
            damping,
            weights.coordinates,
            weights.rates,
        );
        JointTangent::at_clamp(clamp.next_next)
    }

    #[inline(always)]
    fn load_tangent(&self, loads: &dyn NodeLoads<T>, k: usize, _: [T; 1], _: [T; 1]) -> Option<LoadTangent<T, 1>> {
        self.damping(loads, k).map(|damping| LoadTangent { position: [zero()], velocity: [[damping]] })
    }
}

/// A task for [`PlanarDynamics`].
pub enum PlanarTask<'a, T> {
    /// Of the motion and, where it has a part in it, of its variation.
    Motion(Task<'a, T>),
    /// [`PlanarDynamics::lateral_accelerations`]
    Lateral {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        loads: &'a dyn NodeLoads<T>,
        result: &'a mut [[T; 2]],
    },
    /// [`PlanarDynamics::solve_variation`]
    Variation {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        accelerations: &'a [[T; 2]],
        loads: &'a dyn NodeLoads<T>,
        weights: StepWeights<T>,
        correction: &'a mut [[T; 2]],
    },
}

/// A task with its chain.
pub(super) struct PlanarRecursion<'a, T> {
    pub dynamics: &'a mut PlanarDynamics<T>,
    pub task: PlanarTask<'a, T>,
}

impl<T: Lanewise> Loop for PlanarRecursion<'_, T> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let PlanarDynamics { chain, angles, memory, lateral } = self.dynamics;
        let n = chain.segments;
        let task = match self.task {
            PlanarTask::Motion(task) => task,
            PlanarTask::Lateral { clamp, q, v, loads, result } => {
                let posture = Lateral { planar: Planar::new(chain, angles, q, v, clamp), motion: memory };
                recursion::accelerations(lateral, &posture, Lateral::root(), loads, result);
                return;
            }
            PlanarTask::Variation { clamp, q, v, accelerations, loads, weights, correction } => {
                let posture = Planar::new(chain, angles, q, v, clamp);
                if !loads.is_empty() {
                    recursion::shift::<T, Planar<'_, T>, 1, 2>(memory, n, correction, weights);
                    recursion::load(memory, &posture, loads);
                }
                let posture = Lateral { planar: posture, motion: memory };
                recursion::correction(lateral, &posture, Lateral::root(), accelerations, loads, correction);
                return;
            }
        };
        match task {
            Task::Place { clamp, q, v } => {
                T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                let posture = Planar::new(chain, angles, q, v, clamp);
                recursion::place(memory, &posture, posture.root());
            }
            Task::Track { clamp, q, v, accelerations } => {
                T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                let posture = Planar::new(chain, angles, q, v, clamp);
                recursion::track(memory, &posture, posture.root(), accelerations);
            }
            Task::Accelerations { clamp, q, v, loads, result } => {
                T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                let posture = Planar::new(chain, angles, q, v, clamp);
                if !loads.is_empty() {
                    recursion::place(memory, &posture, posture.root());
                }
                recursion::accelerations(memory, &posture, posture.root(), loads, result);
            }
            Task::Residual { clamp, q, v, accelerations, loads, result } => {
                T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                let posture = Planar::new(chain, angles, q, v, clamp);
                recursion::residual(memory, &posture, posture.root(), accelerations, loads, result);
            }
            Task::Correction { clamp, q, v, accelerations, loads, result } => {
                T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                let posture = Planar::new(chain, angles, q, v, clamp);
                recursion::correction(memory, &posture, posture.root(), accelerations, loads, result);
            }
            Task::Factorise { clamp, q, v, accelerations, loads, weights, lanes } => {
                let posture = Planar::new(chain, angles, q, v, clamp);
                recursion::factorise(memory, &posture, accelerations, loads, weights, lanes);
                let posture = Lateral { planar: posture, motion: memory };
                recursion::factorise(lateral, &posture, accelerations, loads, weights, lanes);
            }
            Task::Solve { right_side } => {
                recursion::solve::<T, Planar<'_, T>, 1, 2>(memory, n, right_side);
            }
            Task::Shift { correction, weights } => {
                recursion::shift::<T, Planar<'_, T>, 1, 2>(memory, n, correction, weights);
            }
            Task::Dissipation { clamp, q, v, result } => {
                *result = Planar::new(chain, angles, q, v, clamp).dissipation()
            }
        }
    }
}
