//! What the dynamics of a chain take and give: constants, motion of the clamp, loads on nodes, energies.

use super::chart::{JointConstants, PolarAxis};
use super::linear::{sub, zero};
use super::recursion::Root;
use super::{LaneSet, Lanewise, Real};

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
    pub(super) fn root_joint(&self) -> JointConstants<T> {
        JointConstants { stiffness: self.root_stiffness, damping: self.root_damping }
    }

    pub(super) fn joint(&self) -> JointConstants<T> {
        JointConstants { stiffness: self.joint_stiffness, damping: self.joint_damping }
    }
}

impl<T: Lanewise> Chain<T> {
    /// The constants of several chains with the same number of segments, one chain per lane.
    ///
    /// # Panics
    /// If their numbers of segments differ.
    pub fn from_lanes<'a>(chain: impl Fn(usize) -> &'a Chain<f64>) -> Self {
        let segments = chain(0).segments;
        assert!((0..T::LANES).all(|lane| chain(lane).segments == segments), "all lanes have one number of segments");
        let lanes = |value: fn(&Chain<f64>) -> f64| T::from_lanes(|lane| value(chain(lane)));
        Self {
            segments,
            length: lanes(|chain| chain.length),
            mass: lanes(|chain| chain.mass),
            inertia: lanes(|chain| chain.inertia),
            root_stiffness: lanes(|chain| chain.root_stiffness),
            joint_stiffness: lanes(|chain| chain.joint_stiffness),
            root_damping: lanes(|chain| chain.root_damping),
            joint_damping: lanes(|chain| chain.joint_damping),
            gravity: std::array::from_fn(|i| T::from_lanes(|lane| chain(lane).gravity[i])),
        }
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
    pub(super) fn about(&self, axis: PolarAxis) -> ([T; 3], [T; 3]) {
        (axis.from_frame(self.direction), axis.from_frame(self.direction_rate))
    }

    /// The root under `gravity`.
    #[inline(always)]
    pub(super) fn root(&self, gravity: [T; 3]) -> Root<T, 3> {
        Root { position: self.position, velocity: self.velocity, acceleration: sub(self.acceleration, gravity) }
    }
}

impl<T: Lanewise> Clamp<T> {
    /// The motion of several clamps, one per lane.
    pub fn from_lanes(clamp: impl Fn(usize) -> Clamp<f64>) -> Self {
        let none = zero();
        let mut result =
            Self { position: none, velocity: none, acceleration: none, direction: none, direction_rate: none };
        for lane in 0..T::LANES {
            let clamp = clamp(lane);
            for i in 0..3 {
                result.position[i].set_lane(lane, clamp.position[i]);
                result.velocity[i].set_lane(lane, clamp.velocity[i]);
                result.acceleration[i].set_lane(lane, clamp.acceleration[i]);
                result.direction[i].set_lane(lane, clamp.direction[i]);
                result.direction_rate[i].set_lane(lane, clamp.direction_rate[i]);
            }
        }
        result
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

/// A force at a point of a segment.
///
/// It acts on the ends of the segment, in proportion to their share of the point's virtual displacement: with `1 − ξ` of it on
/// the inner end and `ξ` on the outer.
#[derive(Clone, Copy, Debug)]
pub struct PointLoad<T> {
    /// The segment, by index.
    pub segment: usize,
    /// The fraction `ξ` of the segment at which the point lies, from its inner end.
    pub fraction: T,
    /// In N; zero in lanes without a load on this segment.
    pub force: [T; 3],
}

/// How the forces of a [`PointLoad`] on both ends of its segment change with the motion of these ends: `[force][motion]`, inner
/// end first.
#[derive(Clone, Copy, Debug)]
pub struct PointTangent<T> {
    /// The segment, by index.
    pub segment: usize,
    /// The derivatives.
    pub ends: [[NodeTangent<T>; 2]; 2],
}

/// Where the motion is planar: how a load at a point of a segment resists a motion out of the plane.
#[derive(Clone, Copy, Debug)]
pub struct PointDamping<T> {
    /// The segment, by index.
    pub segment: usize,
    /// See [`PointLoad::fraction`].
    pub fraction: T,
    /// `∂F_z/∂ż` in N s/m.
    pub damping: T,
}

/// The nodes of a chain as loads see them.
pub trait NodeMotion {
    /// Position in m and velocity in m/s of `r_k` in one lane, for `k = index`; `r_0` is the root.
    fn node(&self, index: usize, lane: usize) -> [[f64; 3]; 2];
}

/// External forces on a chain: on its nodes `r_1 … r_n` (index 0 is `r_1`), and at points of its segments.
pub trait NodeLoads<T> {
    /// True if there is no load.
    fn is_empty(&self) -> bool {
        false
    }

    /// The lanes in which each node carries a load, if that is known: the other nodes are then not asked for their loads.
    fn lanes(&self) -> Option<&[LaneSet]> {
        None
    }

    /// True if there may be loads at points of segments.
    fn loads_points(&self) -> bool {
        false
    }

    /// Adds the loads at points of segments.
    fn point_loads(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointLoad<T>)) {
        let _ = (nodes, add);
    }

    /// Adds their derivatives.
    fn point_tangents(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<T>)) {
        let _ = (nodes, add);
    }

    /// Where the motion is planar: adds how the loads at points of segments resist a motion out of the plane.
    fn point_dampings(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointDamping<T>)) {
        let _ = (nodes, add);
    }

    /// Where the motion is planar: false if no load resists a motion out of the plane.
    fn resists_lateral_motion(&self) -> bool {
        true
    }

    /// The force on a node in N; `None` if there is none.
    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]>;

    /// Its derivatives; `None` where [`NodeLoads::force`] is `None`.
    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>>;

    /// Where the motion is planar: `∂F_z/∂ż` in N s/m, how the load resists a motion of the node out of the plane. `None` if it
    /// does not.
    fn lateral_damping(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<T>
    where
        T: Copy,
    {
        self.tangent(node, position, velocity).map(|tangent| tangent.velocity[2][2])
    }
}

/// A chain without loads.
#[derive(Clone, Copy, Debug)]
pub struct NoLoads;

impl<T> NodeLoads<T> for NoLoads {
    fn is_empty(&self) -> bool {
        true
    }

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
