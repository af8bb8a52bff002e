//! Equations of motion of a chain in the plane of rotation, and of its lateral variation.
//!
//! A planar chain has one coordinate a segment, its azimuth `θ`, and nodes in the plane `z = 0`.
//! Its polar angles are `π/2` exactly. In the plane the angle of a joint is the difference of two
//! azimuths, so that a spring costs one product.
//!
//! Beside the motion itself the equations carry its lateral variation: `η = ∂φ/∂τ`, where `τ` is a
//! small tilt of the clamp out of the plane. It obeys linear equations along the planar motion
//! (`codegen/src/model/lateral.rs`).
//!
//! A block of coordinates is `[η, θ]`.

use super::chain::Link;
use super::dispatch::{Loop, dispatch};
use super::kernels::{
    self, AzimuthSteps, ClampEnergy, Coordinate, Joint, JointEnergy, JointTangent, LateralSegment,
    Segment, SegmentConstants, SegmentEnergy, SegmentTangent,
};
use super::linear::{add, in_lane, scale, zero};
use super::recursion::{
    self, ChainNodes, Energetic, LoadTangent, LoadedPoint, Memory, Placed, PointChange, Posture,
    RootMotion,
};
use super::tasks::{ChainDynamics, Factorise, Task, TrialAccelerations};
use super::{
    Chain, ChainState, Clamp, Energies, Lanes, Lanewise, NodeLoads, NodeTangent, PointDamping,
    PointLoad, PointTangent, Real, StepWeights,
};

/// Equations of motion of one planar chain, or of one per lane, with the memory for their
/// recursions.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. `q` holds `[η, θ]`, `η` per rad of
/// tilt and `θ` in rad. Neighbouring azimuths differ by less than `π`. The motion does not depend
/// on its variation. The methods of [`ChainDynamics`] act on the motion alone and leave the entries
/// of the variation unchanged. Only [`ChainDynamics::factorise`] factorises the matrices of both.
/// Nodes, loads and clamp are in the frame `(x, y, z)`; their components along `z` are zero.
#[derive(Clone, Debug)]
pub struct PlanarDynamics<T> {
    chain: Chain<T>,
    /// `sin θ, cos θ`
    angles: Vec<[T; 2]>,
    memory: Memory<T, 1, 2>,
    lateral: Memory<T, 1, 1>,
}

impl<T: Real> PlanarDynamics<T> {
    /// Creates the dynamics of `chain`.
    ///
    /// # Panics
    /// If the chain has no segment.
    pub fn new(chain: Chain<T>) -> Self {
        let n = chain.segments();
        assert!(n > 0, "a chain has at least one segment");
        Self {
            chain,
            angles: vec![zero(); n],
            memory: Memory::new(n),
            lateral: Memory::new(n),
        }
    }

    /// Returns the constants.
    pub fn chain(&self) -> &Chain<T> {
        &self.chain
    }

    /// Returns the constants, to be replaced by others with the same number of segments.
    pub(crate) fn chain_mut(&mut self) -> &mut Chain<T> {
        &mut self.chain
    }

    /// Returns position in m and velocity in m/s of the node `r_{k+1}`, for `k = node`, at the
    /// state of the last [`ChainDynamics::place`], [`ChainDynamics::track`] or
    /// [`ChainDynamics::residual`].
    pub fn node(&self, node: usize) -> [[T; 3]; 2] {
        [
            to_frame(self.memory.positions[node]),
            to_frame(self.memory.velocities[node]),
        ]
    }

    /// Returns the force that the clamp exerts on the root in N, from the last
    /// [`ChainDynamics::residual`].
    pub fn root_force(&self) -> [T; 3] {
        to_frame(self.memory.root_force)
    }
}

impl<T: PlanarLoops> ChainDynamics<T> for PlanarDynamics<T> {
    fn run(&mut self, task: Task<'_, T>) {
        T::run_planar(self, PlanarTask::Motion(task));
    }
}

impl<T: PlanarLoops> PlanarDynamics<T> {
    /// Computes the `η̈` that belong to the `θ̈` in `accelerations`, at the point of the last
    /// [`ChainDynamics::residual`]. That call must have had the same arguments.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn lateral_accelerations(
        &mut self,
        at: ChainState<'_, T>,
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        T::run_planar(self, PlanarTask::Lateral(at, loads, accelerations));
    }

    /// Solves the factorised equations of the variation. Puts its correction into `correction`,
    /// which holds the correction of `θ̈`.
    ///
    /// The right side is the residual of the variation at the point of the last
    /// [`ChainDynamics::residual`], but with the loads after the correction of `θ̈`: in a stiff
    /// contact loads change by far more than anything else. The nodes are moved there, as by
    /// [`ChainDynamics::shift`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn solve_variation(
        &mut self,
        at: ChainState<'_, T>,
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        correction: &mut [[T; 2]],
    ) {
        T::run_planar(
            self,
            PlanarTask::Variation(
                TrialAccelerations {
                    at,
                    accelerations,
                    loads,
                },
                weights,
                correction,
            ),
        );
    }
}

impl<T: Lanewise> PlanarDynamics<T> {
    /// Returns energies, dissipation and clamp power at the state `(q, q̇)`, where the nodes were
    /// last placed.
    pub fn energies(&self, at: ChainState<'_, T>) -> Energies<T> {
        let posture = Planar::new(&self.chain, &self.angles, at);
        recursion::energies(&self.memory, &posture, posture.clamp_torque_power())
    }

    /// Returns position in m and velocity in m/s of a node in one lane; see
    /// [`PlanarDynamics::node`].
    #[inline]
    pub fn node_in_lane(&self, node: usize, lane: usize) -> [[f64; 3]; 2] {
        [
            in_lane(&self.memory.positions[node], lane),
            in_lane(&self.memory.velocities[node], lane),
        ]
        .map(|[x, y]| [x, y, 0.0])
    }

    /// Returns position, velocity and acceleration of a node in one lane, after
    /// [`ChainDynamics::track`] or [`ChainDynamics::residual`].
    #[inline]
    pub fn node_motion(&self, node: usize, lane: usize) -> [[f64; 3]; 3] {
        let base = in_lane(&self.memory.base_accelerations[node + 1], lane);
        let acceleration = add(base, in_lane(&in_plane(self.chain.gravity), lane));
        [
            in_lane(&self.memory.positions[node], lane),
            in_lane(&self.memory.velocities[node], lane),
            acceleration,
        ]
        .map(|[x, y]| [x, y, 0.0])
    }
}

/// Returns the components in the plane of rotation.
#[inline(always)]
fn in_plane<T: Real>([x, y, _]: [T; 3]) -> [T; 2] {
    [x, y]
}

#[inline(always)]
fn to_frame<T: Real>([x, y]: [T; 2]) -> [T; 3] {
    [x, y, T::ZERO]
}

/// Chain in the plane of rotation at one state.
struct Planar<'a, T> {
    length: T,
    gravity: [T; 3],
    links: &'a [Link<T>],
    angles: &'a [[T; 2]],
    q: &'a [[T; 2]],
    v: &'a [[T; 2]],
    clamp: &'a Clamp<T>,
}

impl<'a, T: Real> Planar<'a, T> {
    #[inline(always)]
    fn new(
        chain: &'a Chain<T>,
        angles: &'a [[T; 2]],
        ChainState { clamp, q, v }: ChainState<'a, T>,
    ) -> Self {
        let n = chain.segments();
        let Chain {
            length, gravity, ..
        } = *chain;
        Self {
            length,
            gravity,
            links: &chain.links[..n],
            angles: &angles[..n],
            q: &q[..n],
            v: &v[..n],
            clamp,
        }
    }

    /// Returns `ē_0`: `e_0` turned by the relaxed angle of the clamp joint.
    #[inline(always)]
    fn relaxed_clamp(&self) -> [T; 2] {
        self.links[0]
            .relaxed_angle
            .turn(in_plane(self.clamp.direction))
    }

    /// Returns `Ω`, which is along `z`.
    #[inline(always)]
    fn body_rate(&self) -> T {
        let [_, _, rate] = self.clamp.angular_velocity;
        rate
    }

    /// Returns `θ̇` of segment `k` relative to the body.
    #[inline(always)]
    fn rate_in_body(&self, k: usize) -> T {
        self.v[k][1] - self.body_rate()
    }

    /// Returns the constants of segment `k`.
    #[inline(always)]
    fn constants(&self, k: usize) -> SegmentConstants<T> {
        self.links[k].segment(self.length)
    }

    /// Returns `θ` and `θ̇` of segment `k`.
    #[inline(always)]
    fn azimuth(&self, k: usize) -> Coordinate<T> {
        Coordinate {
            value: self.q[k][1],
            rate: self.v[k][1],
        }
    }

    /// Returns `η` and `η̇` of segment `k`.
    #[inline(always)]
    fn variation(&self, k: usize) -> Coordinate<T> {
        Coordinate {
            value: self.q[k][0],
            rate: self.v[k][0],
        }
    }

    #[inline(always)]
    fn clamp_torque(&self, link: &Link<T>) -> [T; 1] {
        kernels::planar_clamp(
            self.relaxed_clamp(),
            self.angles[0],
            self.rate_in_body(0),
            link.joint(),
        )
        .next
    }

    #[inline(always)]
    fn clamp_energy(&self) -> ClampEnergy<T> {
        let (link, angles, rate) = (&self.links[0], self.angles[0], self.rate_in_body(0));
        let relaxed_rate = link.relaxed_angle.turn(in_plane(self.clamp.direction_rate));
        kernels::planar_clamp_energy(
            self.relaxed_clamp(),
            angles,
            rate,
            link.joint(),
            relaxed_rate,
        )
    }

    /// Returns [`Energies::clamp_torque_power`]. In the plane only the damper of the clamp joint
    /// depends on the rotation of the body.
    fn clamp_torque_power(&self) -> T {
        let [damper] = self.clamp_torque(&self.links[0].without_spring());
        self.clamp_energy().power + self.body_rate() * damper
    }
}

impl<T: Lanewise> Energetic<T, 1, 2> for Planar<'_, T> {
    #[inline(always)]
    fn segment_energy(&self, k: usize, position: [T; 2], velocity: [T; 2]) -> SegmentEnergy<T> {
        let (angles, rate, g) = (self.angles[k], self.v[k][1], in_plane(self.gravity));
        kernels::planar_segment_energy(angles, rate, position, velocity, g, self.constants(k))
    }

    #[inline(always)]
    fn inner_joint_energy(&self, k: usize) -> JointEnergy<T> {
        if k > 0 {
            let link = &self.links[k];
            let (previous, next) = (self.azimuth(k - 1), self.azimuth(k));
            return kernels::planar_joint_energy(
                previous,
                next,
                link.relaxed_angle.angle,
                link.joint(),
            );
        }
        let ClampEnergy {
            spring,
            dissipation,
            ..
        } = self.clamp_energy();
        JointEnergy {
            spring,
            dissipation,
        }
    }
}

impl<T: Lanewise> Posture<T, 1, 2> for Planar<'_, T> {
    #[inline(always)]
    fn segments(&self) -> usize {
        self.links.len()
    }

    #[inline(always)]
    fn mass(&self, k: usize) -> T {
        self.links[k].mass
    }

    #[inline(always)]
    fn root(&self) -> RootMotion<T, 2> {
        let RootMotion {
            position,
            velocity,
            acceleration,
        } = self.clamp.root(self.gravity);
        RootMotion {
            position: in_plane(position),
            velocity: in_plane(velocity),
            acceleration: in_plane(acceleration),
        }
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
    fn in_frame(vector: [T; 2]) -> [T; 3] {
        to_frame(vector)
    }

    #[inline(always)]
    fn components(vector: [T; 3]) -> [T; 2] {
        in_plane(vector)
    }

    #[inline(always)]
    fn segment(&self, k: usize) -> Segment<T, 1, 2> {
        kernels::planar_segment(self.angles[k], self.v[k][1], self.constants(k))
    }

    #[inline(always)]
    fn inner_joint(&self, k: usize) -> Joint<T, 1> {
        if k > 0 {
            let link = &self.links[k];
            let (previous, next) = (self.azimuth(k - 1), self.azimuth(k));
            return kernels::planar_joint(previous, next, link.relaxed_angle.angle, link.joint());
        }
        Joint {
            previous: zero(),
            next: self.clamp_torque(&self.links[0]),
        }
    }

    #[inline(always)]
    fn load(&self, loads: &dyn NodeLoads<T>, k: usize, node: [[T; 2]; 2]) -> Option<[T; 2]> {
        let [position, velocity] = node.map(to_frame);
        loads.force(k, position, velocity).map(in_plane)
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
        let (angles, rate, constants) = (self.angles[k], self.v[k][1], self.constants(k));
        kernels::planar_segment_tangent(
            angles,
            rate,
            acceleration,
            base_acceleration,
            outer_force,
            constants,
            weights,
        )
    }

    #[inline(always)]
    fn inner_joint_tangent(&self, k: usize, weights: StepWeights<T>) -> JointTangent<T, 1> {
        if k > 0 {
            return kernels::planar_joint_tangent(self.links[k].joint(), weights);
        }
        let (relaxed, angles, rate) = (self.relaxed_clamp(), self.angles[0], self.rate_in_body(0));
        let clamp =
            kernels::planar_clamp_tangent(relaxed, angles, rate, self.links[0].joint(), weights);
        JointTangent::at_clamp(clamp.next_next)
    }

    #[inline(always)]
    fn load_tangent(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        node: [[T; 2]; 2],
    ) -> Option<LoadTangent<T, 2>> {
        let [position, velocity] = node.map(to_frame);
        loads.tangent(k, position, velocity).map(tangent_in_plane)
    }

    #[inline(never)]
    fn points(
        &self,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, 2>,
        apply: &mut dyn FnMut(LoadedPoint<T, 2>),
    ) {
        let nodes = Placed {
            clamp: self.clamp,
            nodes,
        };
        loads.point_loads(&nodes, &mut |PointLoad {
                                            segment,
                                            fraction,
                                            force,
                                        }| {
            apply(LoadedPoint {
                segment,
                fraction,
                force: in_plane(force),
            });
        });
    }

    #[inline(never)]
    fn point_changes(
        &self,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, 2>,
        apply: &mut dyn FnMut(PointChange<T, 2>),
    ) {
        let nodes = Placed {
            clamp: self.clamp,
            nodes,
        };
        loads.point_tangents(&nodes, &mut |PointTangent { segment, ends }| {
            apply(PointChange {
                segment,
                ends: ends.map(|ends| ends.map(tangent_in_plane)),
            });
        });
    }
}

#[inline(always)]
fn tangent_in_plane<T: Real>(tangent: NodeTangent<T>) -> LoadTangent<T, 2> {
    let block = |[x, y, _]: [[T; 3]; 3]| [in_plane(x), in_plane(y)];
    LoadTangent {
        position: block(tangent.position),
        velocity: block(tangent.velocity),
    }
}

/// Lateral variation of a planar chain, along the motion whose inverse dynamics are in `motion`.
struct Lateral<'a, T> {
    planar: Planar<'a, T>,
    motion: &'a Memory<T, 1, 2>,
}

impl<T: Real> Lateral<'_, T> {
    /// Returns the change of the azimuth at joint `k`.
    #[inline(always)]
    fn azimuth_steps(&self, k: usize) -> AzimuthSteps<T> {
        let Planar { links, angles, .. } = self.planar;
        links[k]
            .relaxed_angle
            .azimuth_steps(angles[k - 1], angles[k])
    }

    /// Returns the nodes of the planar motion.
    fn nodes(&self) -> Placed<'_, T, 2> {
        let Memory {
            positions,
            velocities,
            ..
        } = self.motion;
        Placed {
            clamp: self.planar.clamp,
            nodes: [positions, velocities],
        }
    }

    /// Returns the resistance of the loads on node `k` to a lateral motion, `∂F_z/∂ż` in N s/m.
    #[inline(always)]
    fn damping(&self, loads: &dyn NodeLoads<T>, k: usize) -> Option<T> {
        let (position, velocity) = (
            to_frame(self.motion.positions[k]),
            to_frame(self.motion.velocities[k]),
        );
        loads.lateral_damping(k, position, velocity)
    }
}

impl<T: Lanewise> Posture<T, 1, 1> for Lateral<'_, T> {
    #[inline(always)]
    fn segments(&self) -> usize {
        self.planar.segments()
    }

    #[inline(always)]
    fn mass(&self, k: usize) -> T {
        self.planar.mass(k)
    }

    /// Returns the root at rest: a tilt of the clamp does not move it.
    #[inline(always)]
    fn root(&self) -> RootMotion<T, 1> {
        RootMotion {
            position: zero(),
            velocity: zero(),
            acceleration: zero(),
        }
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
    fn in_frame([z]: [T; 1]) -> [T; 3] {
        [T::ZERO, T::ZERO, z]
    }

    #[inline(always)]
    fn components([_, _, z]: [T; 3]) -> [T; 1] {
        [z]
    }

    #[inline(always)]
    fn segment(&self, k: usize) -> Segment<T, 1, 1> {
        let Self { planar, motion } = self;
        let LateralSegment {
            inertia,
            coupling,
            bias,
            reach,
            reach_rate,
            reach_jacobian,
        } = kernels::lateral_segment(
            planar.angles[k],
            planar.v[k][1],
            motion.base_accelerations[k],
            motion.outer_forces[k],
            planar.variation(k),
            planar.constants(k),
        );
        // Adding −0 changes no number, so that the compiler leaves it out.
        let none = [T::from_f64(-0.0)];
        Segment {
            inertia,
            coupling,
            bias,
            base_bias: none,
            reach,
            reach_rate,
            reach_jacobian,
            reach_bias: none,
        }
    }

    #[inline(always)]
    fn inner_joint(&self, k: usize) -> Joint<T, 1> {
        let planar = &self.planar;
        if k > 0 {
            return kernels::lateral_joint(
                self.azimuth_steps(k),
                planar.rate_in_body(k - 1),
                planar.rate_in_body(k),
                planar.variation(k - 1),
                planar.variation(k),
                planar.links[k].joint(),
            );
        }
        let (relaxed, angles, rate) = (
            planar.relaxed_clamp(),
            planar.angles[0],
            planar.rate_in_body(0),
        );
        let clamp = kernels::lateral_clamp(
            relaxed,
            angles,
            rate,
            planar.links[0].joint(),
            planar.variation(0),
        );
        Joint {
            previous: zero(),
            next: clamp.next,
        }
    }

    #[inline(always)]
    fn is_loaded(&self, loads: &dyn NodeLoads<T>) -> bool {
        !loads.is_empty() && loads.resists_lateral_motion()
    }

    #[inline(always)]
    fn load(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        [_, [velocity]]: [[T; 1]; 2],
    ) -> Option<[T; 1]> {
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
        let Self { planar, motion } = self;
        let (angles, rate, constants) = (planar.angles[k], planar.v[k][1], planar.constants(k));
        let (base_acceleration, outer_force) =
            (motion.base_accelerations[k], motion.outer_forces[k]);
        kernels::lateral_segment_tangent(
            angles,
            rate,
            base_acceleration,
            outer_force,
            constants,
            weights,
        )
    }

    #[inline(always)]
    fn inner_joint_tangent(&self, k: usize, weights: StepWeights<T>) -> JointTangent<T, 1> {
        let planar = &self.planar;
        if k > 0 {
            return kernels::lateral_joint_tangent(
                self.azimuth_steps(k),
                planar.rate_in_body(k - 1),
                planar.rate_in_body(k),
                planar.links[k].joint(),
                weights,
            );
        }
        let (relaxed, angles, rate) = (
            planar.relaxed_clamp(),
            planar.angles[0],
            planar.rate_in_body(0),
        );
        let clamp =
            kernels::lateral_clamp_tangent(relaxed, angles, rate, planar.links[0].joint(), weights);
        JointTangent::at_clamp(clamp.next_next)
    }

    #[inline(always)]
    fn load_tangent(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        _: [[T; 1]; 2],
    ) -> Option<LoadTangent<T, 1>> {
        self.damping(loads, k).map(|damping| LoadTangent {
            position: [zero()],
            velocity: [[damping]],
        })
    }

    #[inline(never)]
    fn points(
        &self,
        loads: &dyn NodeLoads<T>,
        [_, velocities]: ChainNodes<'_, T, 1>,
        apply: &mut dyn FnMut(LoadedPoint<T, 1>),
    ) {
        let one = T::from_f64(1.0);
        loads.point_dampings(
            &self.nodes(),
            &mut |PointDamping {
                      segment,
                      fraction,
                      damping,
                  }| {
                // The root does not move.
                let inner = if segment > 0 {
                    velocities[segment - 1]
                } else {
                    zero()
                };
                let rate = add(
                    scale(one - fraction, inner),
                    scale(fraction, velocities[segment]),
                );
                apply(LoadedPoint {
                    segment,
                    fraction,
                    force: scale(damping, rate),
                });
            },
        );
    }

    #[inline(never)]
    fn point_changes(
        &self,
        loads: &dyn NodeLoads<T>,
        _: ChainNodes<'_, T, 1>,
        apply: &mut dyn FnMut(PointChange<T, 1>),
    ) {
        loads.point_dampings(
            &self.nodes(),
            &mut |PointDamping {
                      segment,
                      fraction,
                      damping,
                  }| {
                let shares = [T::from_f64(1.0) - fraction, fraction];
                let change = |force: T, motion: T| LoadTangent {
                    position: [zero()],
                    velocity: [[force * motion * damping]],
                };
                apply(PointChange {
                    segment,
                    ends: shares.map(|force| shares.map(|motion| change(force, motion))),
                });
            },
        );
    }
}

/// Task for [`PlanarDynamics`].
pub enum PlanarTask<'a, T> {
    /// Task of the motion and, for a factorisation, of its variation.
    Motion(Task<'a, T>),
    /// [`PlanarDynamics::lateral_accelerations`]
    Lateral(ChainState<'a, T>, &'a dyn NodeLoads<T>, &'a mut [[T; 2]]),
    /// [`PlanarDynamics::solve_variation`]
    Variation(TrialAccelerations<'a, T>, StepWeights<T>, &'a mut [[T; 2]]),
}

/// Numbers for which the loops over a planar chain are compiled.
pub trait PlanarLoops: Lanewise {
    #[doc(hidden)]
    fn run_planar(dynamics: &mut PlanarDynamics<Self>, task: PlanarTask<'_, Self>);
}

impl PlanarLoops for f64 {
    fn run_planar(dynamics: &mut PlanarDynamics<Self>, task: PlanarTask<'_, Self>) {
        run_planar(dynamics, task);
    }
}

impl PlanarLoops for Lanes {
    fn run_planar(dynamics: &mut PlanarDynamics<Self>, task: PlanarTask<'_, Self>) {
        run_planar(dynamics, task);
    }
}

fn run_planar<T: Lanewise>(dynamics: &mut PlanarDynamics<T>, task: PlanarTask<'_, T>) {
    match task {
        PlanarTask::Motion(Task::Factorise(step)) if step.trial.loads.loads_points() => {
            dispatch(PlanarFactorisation::<_, true> { dynamics, step });
        }
        PlanarTask::Motion(Task::Factorise(step)) => {
            dispatch(PlanarFactorisation::<_, false> { dynamics, step })
        }
        task => dispatch(PlanarRecursion { dynamics, task }),
    }
}

/// Factorisation of the matrices of a motion and of its variation, for a chain with or without
/// loads at points of its segments.
struct PlanarFactorisation<'a, T, const POINTS: bool> {
    dynamics: &'a mut PlanarDynamics<T>,
    step: Factorise<'a, T>,
}

impl<T: Lanewise, const POINTS: bool> Loop for PlanarFactorisation<'_, T, POINTS> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let PlanarDynamics {
            chain,
            angles,
            memory,
            lateral,
        } = self.dynamics;
        let posture = Planar::new(&*chain, angles, self.step.trial.at);
        recursion::factorise::<T, _, 1, 2, POINTS>(memory, &posture, &self.step);
        let posture = Lateral {
            planar: posture,
            motion: memory,
        };
        recursion::factorise::<T, _, 1, 1, POINTS>(lateral, &posture, &self.step);
    }
}

/// Task with its chain.
struct PlanarRecursion<'a, T> {
    dynamics: &'a mut PlanarDynamics<T>,
    task: PlanarTask<'a, T>,
}

impl<T: Lanewise> Loop for PlanarRecursion<'_, T> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let PlanarDynamics {
            chain,
            angles,
            memory,
            lateral,
        } = self.dynamics;
        let (chain, n) = (&*chain, chain.segments());
        match self.task {
            PlanarTask::Motion(task) => {
                if let Some(q) = task.new_coordinates() {
                    T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                }
                recursion::perform(memory, n, |at| Planar::new(chain, angles, at), task);
            }
            PlanarTask::Lateral(at, loads, result) => {
                let posture = Lateral {
                    planar: Planar::new(chain, angles, at),
                    motion: memory,
                };
                recursion::accelerations(lateral, &posture, loads, result);
            }
            PlanarTask::Variation(trial, weights, correction) => {
                let posture = Planar::new(chain, angles, trial.at);
                if !trial.loads.is_empty() {
                    recursion::shift::<T, Planar<'_, T>, 1, 2>(memory, n, correction, weights);
                    recursion::load(memory, &posture, trial.loads);
                }
                let posture = Lateral {
                    planar: posture,
                    motion: memory,
                };
                recursion::correction(lateral, &posture, trial, correction);
            }
        }
    }
}
