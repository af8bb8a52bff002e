//! Motion of a chain in the plane of rotation, as the recursions see it.

use super::super::chain::Link;
use super::super::kernels::{
    self, ClampEnergy, Coordinate, Joint, JointEnergy, JointTangent, Segment, SegmentConstants,
    SegmentEnergy, SegmentTangent,
};
use super::super::linear::zero;
use super::super::posture::{
    ChainNodes, Energetic, LoadTangent, LoadedPoint, Placed, PointChange, Posture, RootMotion,
};
use super::super::{
    Chain, ChainState, Clamp, Lanewise, NodeLoads, NodeTangent, PointLoad, PointTangent, Real,
    StepWeights,
};

/// Chain in the plane of rotation at one state.
pub(super) struct Planar<'a, T> {
    pub(super) length: T,
    pub(super) gravity: [T; 3],
    pub(super) links: &'a [Link<T>],
    pub(super) angles: &'a [[T; 2]],
    pub(super) q: &'a [[T; 2]],
    pub(super) v: &'a [[T; 2]],
    pub(super) clamp: &'a Clamp<T>,
}

impl<'a, T: Real> Planar<'a, T> {
    #[inline(always)]
    pub(super) fn new(
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
    pub(super) fn relaxed_clamp(&self) -> [T; 2] {
        self.links[0]
            .relaxed_angle
            .turn(in_plane(self.clamp.direction))
    }

    /// Returns `Ω`, which is along `z`.
    #[inline(always)]
    pub(super) fn body_rate(&self) -> T {
        let [_, _, rate] = self.clamp.angular_velocity;
        rate
    }

    /// Returns `θ̇` of segment `k` relative to the body.
    #[inline(always)]
    pub(super) fn rate_in_body(&self, k: usize) -> T {
        self.v[k][1] - self.body_rate()
    }

    /// Returns the constants of segment `k`.
    #[inline(always)]
    pub(super) fn constants(&self, k: usize) -> SegmentConstants<T> {
        self.links[k].segment(self.length)
    }

    /// Returns `θ` and `θ̇` of segment `k`.
    #[inline(always)]
    pub(super) fn azimuth(&self, k: usize) -> Coordinate<T> {
        Coordinate {
            value: self.q[k][1],
            rate: self.v[k][1],
        }
    }

    /// Returns `η` and `η̇` of segment `k`.
    #[inline(always)]
    pub(super) fn variation(&self, k: usize) -> Coordinate<T> {
        Coordinate {
            value: self.q[k][0],
            rate: self.v[k][0],
        }
    }

    #[inline(always)]
    pub(super) fn clamp_torque(&self, link: &Link<T>) -> [T; 1] {
        kernels::planar_clamp(
            self.relaxed_clamp(),
            self.angles[0],
            self.rate_in_body(0),
            link.joint(),
        )
        .next
    }

    #[inline(always)]
    pub(super) fn clamp_energy(&self) -> ClampEnergy<T> {
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

    /// Returns [`Energies::clamp_torque_power`](super::super::Energies::clamp_torque_power). In the
    /// plane only the damper of the clamp joint depends on the rotation of the body.
    pub(super) fn clamp_torque_power(&self) -> T {
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

/// Returns the components in the plane of rotation.
#[inline(always)]
pub(super) fn in_plane<T: Real>([x, y, _]: [T; 3]) -> [T; 2] {
    [x, y]
}

#[inline(always)]
pub(super) fn to_frame<T: Real>([x, y]: [T; 2]) -> [T; 3] {
    [x, y, T::ZERO]
}
