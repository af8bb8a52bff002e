//! Lateral variation of a planar chain, as the recursions see it.

use super::super::kernels::{
    self, AzimuthSteps, Joint, JointTangent, LateralSegment, Segment, SegmentTangent,
};
use super::super::linear::{add, scale, zero};
use super::super::memory::Memory;
use super::super::posture::{
    ChainNodes, LoadTangent, LoadedPoint, Placed, PointChange, Posture, RootMotion,
};
use super::super::{Lanewise, NodeLoads, PointDamping, Real, StepWeights};
use super::motion::{Planar, to_frame};

/// Lateral variation of a planar chain, along the motion whose inverse dynamics are in `motion`.
pub(super) struct Lateral<'a, T> {
    pub(super) planar: Planar<'a, T>,
    pub(super) motion: &'a Memory<T, 1, 2>,
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
