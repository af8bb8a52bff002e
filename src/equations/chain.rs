//! What the dynamics of a chain take and give: constants, motion of the clamp, loads on nodes,
//! energies.

use super::kernels::{AzimuthSteps, JointConstants, SegmentConstants};
use super::linear::{cross, zero};
use super::{LaneSet, Lanewise, Real, StepWeights};

/// The constants of a chain (MODEL's symbols in the descriptions).
#[derive(Clone, Debug, PartialEq)]
pub struct Chain<T> {
    /// Length of every segment, `h` in m.
    pub length: T,
    /// The segments, from the clamp outwards, each with the joint at its inner end.
    pub links: Vec<Link<T>>,
    /// Gravitational acceleration in m/s².
    pub gravity: [T; 3],
}

/// A state of a chain, or of one per lane: how its clamp moves, and coordinates and rates by
/// segment.
#[derive(Clone, Copy, Debug)]
pub struct ChainState<'a, T> {
    /// The motion of the clamp.
    pub clamp: &'a Clamp<T>,
    /// The coordinates.
    pub q: &'a [[T; 2]],
    /// Their rates `q̇`.
    pub v: &'a [[T; 2]],
}

/// The constants of one segment and of the joint at its inner end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link<T> {
    /// Segment mass `m_k` in kg.
    pub mass: T,
    /// Transverse moment of inertia of the segment about its centre, `J_k` in kg m².
    pub inertia: T,
    /// Stiffness of the joint, `c_k` in N m.
    pub stiffness: T,
    /// Damping of the joint, `d_k` in N m s.
    pub damping: T,
    /// The angle about `z` at which the joint is relaxed, `κ_k`.
    pub relaxed_angle: RelaxedAngle<T>,
}

impl<T: Real> Link<T> {
    /// The constants of the segment, which has this `length`.
    #[inline(always)]
    pub(super) fn segment(&self, length: T) -> SegmentConstants<T> {
        SegmentConstants {
            length,
            mass: self.mass,
            inertia: self.inertia,
        }
    }

    /// The constants of the joint.
    #[inline(always)]
    pub(super) fn joint(&self) -> JointConstants<T> {
        JointConstants {
            stiffness: self.stiffness,
            damping: self.damping,
        }
    }

    /// The same link, but its joint has only the damper.
    #[inline(always)]
    pub(super) fn without_spring(&self) -> Self {
        Self {
            stiffness: T::ZERO,
            ..*self
        }
    }
}

/// The angle about `z` from the inner side of a joint to its outer side where its spring is
/// relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxedAngle<T> {
    pub(super) angle: T,
    pub(super) sine: T,
    pub(super) cosine: T,
    /// True if the angle is zero, in every lane.
    pub(super) is_zero: bool,
}

impl RelaxedAngle<f64> {
    /// `angle` in rad.
    pub fn new(angle: f64) -> Self {
        let (sine, cosine) = Real::sin_cos(angle);
        Self {
            angle,
            sine,
            cosine,
            is_zero: angle == 0.0,
        }
    }

    /// In rad.
    pub fn angle(self) -> f64 {
        self.angle
    }
}

impl<T: Real> RelaxedAngle<T> {
    /// That of a straight filament.
    const fn zero(none: T, one: T) -> Self {
        Self {
            angle: none,
            sine: none,
            cosine: one,
            is_zero: true,
        }
    }

    /// The sine and cosine of `x + κ` from those of `x`.
    #[inline(always)]
    pub(super) fn added_to(&self, [sine, cosine]: [T; 2]) -> [T; 2] {
        [
            sine * self.cosine + cosine * self.sine,
            cosine * self.cosine - sine * self.sine,
        ]
    }

    /// How the azimuth changes at the joint between segments with these `sin θ, cos θ`.
    #[inline(always)]
    pub(super) fn azimuth_steps(
        &self,
        [sin, cos]: [T; 2],
        [next_sin, next_cos]: [T; 2],
    ) -> AzimuthSteps<T> {
        let plain = [
            sin * next_cos - cos * next_sin,
            cos * next_cos + sin * next_sin,
        ];
        AzimuthSteps {
            plain,
            unbent: self.added_to(plain),
        }
    }

    /// The sine and cosine of `x − κ` from those of `x`.
    #[inline(always)]
    pub(super) fn taken_from(&self, [sine, cosine]: [T; 2]) -> [T; 2] {
        [
            sine * self.cosine - cosine * self.sine,
            cosine * self.cosine + sine * self.sine,
        ]
    }

    /// The components along `x` and `y` of a vector turned about `z` by the angle.
    #[inline(always)]
    pub(super) fn turn(&self, [x, y]: [T; 2]) -> [T; 2] {
        [
            x * self.cosine - y * self.sine,
            y * self.cosine + x * self.sine,
        ]
    }
}

impl<T> Chain<T> {
    /// Number of segments, `n`.
    pub fn segments(&self) -> usize {
        self.links.len()
    }

    /// `true` if all joints between segments are relaxed straight, in all lanes.
    pub fn is_relaxed_straight(&self) -> bool {
        let mut joints = self.links.iter().skip(1);
        joints.all(|link| link.relaxed_angle.is_zero)
    }
}

impl Chain<f64> {
    /// `E I = c_k h` in N m², at the first joint outside the clamp joint, which carries half a
    /// segment's compliance only.
    pub fn bending_stiffness(&self) -> f64 {
        let joint = self
            .links
            .get(1)
            .map_or(self.links[0].stiffness / 2.0, |link| link.stiffness);
        joint * self.length
    }
}

/// The constants of a chain of equal segments, straight where its springs are relaxed.
///
/// ```
/// use bristle::equations::{Chain, UniformChain};
///
/// let uniform = UniformChain {
///     segments: 2,
///     length: 0.02,
///     mass: 2.4e-5,
///     inertia: 8.1e-10,
///     root_stiffness: 0.03,
///     joint_stiffness: 0.015,
///     root_damping: 3e-5,
///     joint_damping: 1.5e-5,
///     gravity: [0.0; 3],
/// };
/// let chain = Chain::from(uniform);
/// assert_eq!([chain.links[0].stiffness, chain.links[1].stiffness], [0.03, 0.015]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformChain {
    /// Number of segments, `n`.
    pub segments: usize,
    /// Segment length `h` in m.
    pub length: f64,
    /// Segment mass `m` in kg.
    pub mass: f64,
    /// Transverse moment of inertia of a segment about its centre, `J` in kg m².
    pub inertia: f64,
    /// Stiffness of the clamp joint, `c_1` in N m.
    pub root_stiffness: f64,
    /// Stiffness of every other joint, `c_k` in N m.
    pub joint_stiffness: f64,
    /// Damping of the clamp joint, `d_1` in N m s.
    pub root_damping: f64,
    /// Damping of every other joint, `d_k` in N m s.
    pub joint_damping: f64,
    /// Gravitational acceleration in m/s².
    pub gravity: [f64; 3],
}

impl From<UniformChain> for Chain<f64> {
    fn from(uniform: UniformChain) -> Self {
        let UniformChain {
            segments,
            length,
            mass,
            inertia,
            gravity,
            ..
        } = uniform;
        let link = |k: usize| {
            let (stiffness, damping) = match k {
                0 => (uniform.root_stiffness, uniform.root_damping),
                _ => (uniform.joint_stiffness, uniform.joint_damping),
            };
            Link {
                mass,
                inertia,
                stiffness,
                damping,
                relaxed_angle: RelaxedAngle::new(0.0),
            }
        };
        Self {
            length,
            links: (0..segments).map(link).collect(),
            gravity,
        }
    }
}

impl Chain<f64> {
    /// The coordinates of the relaxed chain in rad, by segment, where those of the clamp are `[φ,
    /// θ]`.
    ///
    /// Each segment is turned about `z` from the one before it, by which its polar angle stays that
    /// of the clamp.
    pub fn relaxed(&self, [polar, mut azimuth]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        self.links.iter().map(move |link| {
            azimuth += link.relaxed_angle.angle();
            [polar, azimuth]
        })
    }
}

impl<T: Lanewise> Chain<T> {
    /// The constants of several chains with the same number of segments, one chain per lane.
    ///
    /// # Panics
    /// If their numbers of segments differ.
    pub fn from_lanes<'a>(chain: impl Fn(usize) -> &'a Chain<f64>) -> Self {
        let (none, one) = (T::ZERO, T::from_f64(1.0));
        let relaxed_angle = RelaxedAngle::zero(none, one);
        let link = Link {
            mass: none,
            inertia: none,
            stiffness: none,
            damping: none,
            relaxed_angle,
        };
        let mut result = Self {
            length: none,
            links: vec![link; chain(0).segments()],
            gravity: zero(),
        };
        result.set_lanes(chain);
        result
    }

    /// Replaces the constants of all lanes, without allocating memory.
    ///
    /// # Panics
    /// If the numbers of segments differ.
    pub fn set_lanes<'a>(&mut self, chain: impl Fn(usize) -> &'a Chain<f64>) {
        let segments = self.segments();
        assert!(
            (0..T::LANES).all(|lane| chain(lane).segments() == segments),
            "all lanes have one number of segments"
        );
        let lanes = |value: &dyn Fn(&Chain<f64>) -> f64| T::from_lanes(|lane| value(chain(lane)));
        self.length = lanes(&|chain| chain.length);
        self.gravity = std::array::from_fn(|i| lanes(&|chain| chain.gravity[i]));
        for (k, link) in self.links.iter_mut().enumerate() {
            let lanes =
                |value: fn(&Link<f64>) -> f64| T::from_lanes(|lane| value(&chain(lane).links[k]));
            *link = Link {
                mass: lanes(|link| link.mass),
                inertia: lanes(|link| link.inertia),
                stiffness: lanes(|link| link.stiffness),
                damping: lanes(|link| link.damping),
                relaxed_angle: RelaxedAngle {
                    angle: lanes(|link| link.relaxed_angle.angle),
                    sine: lanes(|link| link.relaxed_angle.sine),
                    cosine: lanes(|link| link.relaxed_angle.cosine),
                    is_zero: (0..T::LANES).all(|lane| chain(lane).links[k].relaxed_angle.is_zero),
                },
            };
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
    /// Angular velocity of the brush body, `Ω` in rad/s: dampers see the filament from the body.
    /// The clamp is at rest in it, that is, `ė_0 = Ω × e_0`; [`Clamp::without_spin`] is for those
    /// who know no more than that.
    pub angular_velocity: [T; 3],
}

impl<T> Clamp<T> {
    /// The state of a chain that it holds.
    #[inline(always)]
    pub fn holding<'a>(&'a self, q: &'a [[T; 2]], v: &'a [[T; 2]]) -> ChainState<'a, T> {
        ChainState { clamp: self, q, v }
    }
}

impl<T: Real> Clamp<T> {
    /// The clamp on a body with `Ω = e_0 × ė_0`, which does not turn about the filament.
    ///
    /// ```
    /// use bristle::equations::Clamp;
    ///
    /// let at_rest = [0.0; 3];
    /// let (direction, direction_rate) = ([1.0, 0.0, 0.0], [0.0, 50.0, 0.0]);
    /// let clamp = Clamp {
    ///     position: at_rest,
    ///     velocity: at_rest,
    ///     acceleration: at_rest,
    ///     direction,
    ///     direction_rate,
    ///     angular_velocity: at_rest,
    /// };
    /// assert_eq!(clamp.without_spin().angular_velocity, [0.0, 0.0, 50.0]);
    /// ```
    pub fn without_spin(self) -> Self {
        Self {
            angular_velocity: cross(self.direction, self.direction_rate),
            ..self
        }
    }
}

/// The `vector` turned about `z` by `angle`.
#[inline(always)]
pub(super) fn turned<T: Real>([x, y, z]: [T; 3], angle: &RelaxedAngle<T>) -> [T; 3] {
    let [x, y] = angle.turn([x, y]);
    [x, y, z]
}

impl<T: Lanewise> Clamp<T> {
    /// The motion of several clamps, one per lane.
    pub fn from_lanes(clamp: impl Fn(usize) -> Clamp<f64>) -> Self {
        let none = zero();
        let mut result = Self {
            position: none,
            velocity: none,
            acceleration: none,
            direction: none,
            direction_rate: none,
            angular_velocity: none,
        };
        for lane in 0..T::LANES {
            let clamp = clamp(lane);
            for i in 0..3 {
                result.position[i].set_lane(lane, clamp.position[i]);
                result.velocity[i].set_lane(lane, clamp.velocity[i]);
                result.acceleration[i].set_lane(lane, clamp.acceleration[i]);
                result.direction[i].set_lane(lane, clamp.direction[i]);
                result.direction_rate[i].set_lane(lane, clamp.direction_rate[i]);
                result.angular_velocity[i].set_lane(lane, clamp.angular_velocity[i]);
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
/// It acts on the ends of the segment, in proportion to their share of the point's virtual
/// displacement: with `1 − ξ` of it on the inner end and `ξ` on the outer.
#[derive(Clone, Copy, Debug)]
pub struct PointLoad<T> {
    /// The segment, by index.
    pub segment: usize,
    /// The fraction `ξ` of the segment at which the point lies, from its inner end.
    pub fraction: T,
    /// In N; zero in lanes without a load on this segment.
    pub force: [T; 3],
}

/// How the forces of a [`PointLoad`] on both ends of its segment change with the motion of these
/// ends: `[force][motion]`, inner end first.
#[derive(Clone, Copy, Debug)]
pub struct PointTangent<T> {
    /// The segment, by index.
    pub segment: usize,
    /// The derivatives.
    pub ends: [[NodeTangent<T>; 2]; 2],
}

/// Where the motion is planar: how a load at a point of a segment resists a motion out of the
/// plane.
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

/// External forces on a chain: on its nodes `r_1 … r_n` (index 0 is `r_1`), and at points of its
/// segments.
pub trait NodeLoads<T> {
    /// True if there is no load.
    fn is_empty(&self) -> bool {
        false
    }

    /// The lanes in which each node carries a load, if that is known: the other nodes are then not
    /// asked for their loads.
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

    /// Where the motion is planar: adds how the loads at points of segments resist a motion out of
    /// the plane.
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

    /// Where the motion is planar: `∂F_z/∂ż` in N s/m, how the load resists a motion of the node
    /// out of the plane. `None` if it does not.
    fn lateral_damping(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<T>
    where
        T: Copy,
    {
        self.tangent(node, position, velocity)
            .map(|tangent| tangent.velocity[2][2])
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

impl<T: Real> StepWeights<T> {
    /// With which a tangent is the derivative with respect to the rates.
    pub(super) fn of_rates() -> Self {
        Self {
            coordinates: T::ZERO,
            rates: T::from_f64(1.0),
        }
    }
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
    /// Power of the torque at the clamp in W: `∂E_spring/∂e_0·ė_0 + Ω·∂D/∂Ω`. The second part is
    /// what the dampers take in the body, `2 D`, and what they do on the segments.
    pub clamp_torque_power: T,
}
