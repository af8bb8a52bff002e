//! Inputs and outputs of the dynamics of a chain: constants, motion of the clamp, loads on nodes,
//! energies.

use super::kernels::{AzimuthSteps, JointConstants, SegmentConstants};
use super::linear::{cross, zero};
use super::{LaneSet, Lanewise, Real, StepWeights};

/// Constants of a chain (MODEL's symbols in the descriptions).
#[derive(Clone, Debug, PartialEq)]
pub struct Chain<T> {
    /// Length of every segment, `h` in m.
    pub length: T,
    /// Segments, from the clamp outwards, each with the joint at its inner end.
    pub links: Vec<Link<T>>,
    /// Gravitational acceleration in m/s².
    pub gravity: [T; 3],
}

/// State of a chain, or of one per lane: motion of the clamp, and coordinates and rates by segment.
#[derive(Clone, Copy, Debug)]
pub struct ChainState<'a, T> {
    /// Motion of the clamp.
    pub clamp: &'a Clamp<T>,
    /// Coordinates.
    pub q: &'a [[T; 2]],
    /// Their rates `q̇`.
    pub v: &'a [[T; 2]],
}

/// Constants of one segment and of the joint at its inner end.
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
    /// Angle about `z` at which the joint is relaxed, `κ_k`.
    pub relaxed_angle: RelaxedAngle<T>,
}

impl<T: Real> Link<T> {
    /// Returns the constants of the segment, which has this `length`.
    #[inline(always)]
    pub(super) fn segment(&self, length: T) -> SegmentConstants<T> {
        SegmentConstants {
            length,
            mass: self.mass,
            inertia: self.inertia,
        }
    }

    /// Returns the constants of the joint.
    #[inline(always)]
    pub(super) fn joint(&self) -> JointConstants<T> {
        JointConstants {
            stiffness: self.stiffness,
            damping: self.damping,
        }
    }

    /// Returns the link with only the damper in its joint.
    #[inline(always)]
    pub(super) fn without_spring(&self) -> Self {
        Self {
            stiffness: T::ZERO,
            ..*self
        }
    }
}

/// Angle about `z` from the inner to the outer side of a joint whose spring is relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxedAngle<T> {
    pub(super) angle: T,
    pub(super) sine: T,
    pub(super) cosine: T,
    /// `true` if the angle is zero, in every lane.
    pub(super) is_zero: bool,
}

impl RelaxedAngle<f64> {
    /// Creates the relaxed `angle` in rad.
    pub fn new(angle: f64) -> Self {
        let (sine, cosine) = Real::sin_cos(angle);
        Self {
            angle,
            sine,
            cosine,
            is_zero: angle == 0.0,
        }
    }

    /// Returns the angle in rad.
    pub fn angle(self) -> f64 {
        self.angle
    }
}

impl<T: Real> RelaxedAngle<T> {
    /// Creates the angle of a straight filament.
    const fn zero(none: T, one: T) -> Self {
        Self {
            angle: none,
            sine: none,
            cosine: one,
            is_zero: true,
        }
    }

    /// Returns sine and cosine of `x + κ` from those of `x`.
    #[inline(always)]
    pub(super) fn added_to(&self, [sine, cosine]: [T; 2]) -> [T; 2] {
        [
            sine * self.cosine + cosine * self.sine,
            cosine * self.cosine - sine * self.sine,
        ]
    }

    /// Returns the change of the azimuth at the joint between segments with these `sin θ, cos θ`.
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

    /// Returns sine and cosine of `x − κ` from those of `x`.
    #[inline(always)]
    pub(super) fn taken_from(&self, [sine, cosine]: [T; 2]) -> [T; 2] {
        [
            sine * self.cosine - cosine * self.sine,
            cosine * self.cosine + sine * self.sine,
        ]
    }

    /// Turns the components of a vector along `x` and `y` about `z` by the angle.
    #[inline(always)]
    pub(super) fn turn(&self, [x, y]: [T; 2]) -> [T; 2] {
        [
            x * self.cosine - y * self.sine,
            y * self.cosine + x * self.sine,
        ]
    }
}

impl<T> Chain<T> {
    /// Returns the number of segments, `n`.
    pub fn segments(&self) -> usize {
        self.links.len()
    }

    /// Returns `true` if all joints between segments are relaxed straight, in all lanes.
    pub fn is_relaxed_straight(&self) -> bool {
        let mut joints = self.links.iter().skip(1);
        joints.all(|link| link.relaxed_angle.is_zero)
    }
}

impl Chain<f64> {
    /// Returns `E I = c_k h` in N m² at the second joint: the clamp joint carries half a segment's
    /// compliance only.
    pub fn bending_stiffness(&self) -> f64 {
        let joint = self
            .links
            .get(1)
            .map_or(self.links[0].stiffness / 2.0, |link| link.stiffness);
        joint * self.length
    }
}

/// Constants of a chain of equal segments, straight where its springs are relaxed.
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
    /// Returns the coordinates of the relaxed chain in rad, by segment, for a clamp at `[φ, θ]`.
    ///
    /// Each segment is turned about `z` from its inner neighbour, so its polar angle is that of the
    /// clamp.
    pub fn relaxed(&self, [polar, mut azimuth]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        self.links.iter().map(move |link| {
            azimuth += link.relaxed_angle.angle();
            [polar, azimuth]
        })
    }
}

impl<T: Lanewise> Chain<T> {
    /// Joins several chains with the same number of segments, one per lane.
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

/// Prescribed motion of the clamp at one instant.
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
    /// Rate of `e_0`, `ė_0` in 1/s.
    pub direction_rate: [T; 3],
    /// Angular velocity of the brush body, `Ω` in rad/s: dampers act on motion relative to the
    /// body. The clamp is at rest in the body: `ė_0 = Ω × e_0`. [`Clamp::without_spin`] is for
    /// callers who know no more.
    pub angular_velocity: [T; 3],
}

impl<T> Clamp<T> {
    /// Returns the state of a chain that the clamp holds.
    #[inline(always)]
    pub fn holding<'a>(&'a self, q: &'a [[T; 2]], v: &'a [[T; 2]]) -> ChainState<'a, T> {
        ChainState { clamp: self, q, v }
    }
}

impl<T: Real> Clamp<T> {
    /// Sets `Ω = e_0 × ė_0`, of a body that does not turn about the filament.
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

/// Returns the vector turned about `z` by `angle`.
#[inline(always)]
pub(super) fn turned<T: Real>([x, y, z]: [T; 3], angle: &RelaxedAngle<T>) -> [T; 3] {
    let [x, y] = angle.turn([x, y]);
    [x, y, z]
}

impl<T: Lanewise> Clamp<T> {
    /// Joins the motion of several clamps, one per lane.
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

/// Jacobian of the load on a node with respect to its position and velocity.
#[derive(Clone, Copy, Debug)]
pub struct NodeTangent<T> {
    /// `∂F/∂x` in N/m.
    pub position: [[T; 3]; 3],
    /// `∂F/∂ẋ` in N s/m.
    pub velocity: [[T; 3]; 3],
}

/// Force at a point of a segment.
///
/// It acts on the ends of the segment in proportion to their shares of the point's virtual
/// displacement: `1 − ξ` on the inner end and `ξ` on the outer.
#[derive(Clone, Copy, Debug)]
pub struct PointLoad<T> {
    /// Segment, by index.
    pub segment: usize,
    /// Fraction `ξ` of the segment at which the point lies, from its inner end.
    pub fraction: T,
    /// Force in N; zero in lanes without a load on this segment.
    pub force: [T; 3],
}

/// Jacobian of the forces of a [`PointLoad`] on both ends of its segment with respect to the motion
/// of these ends: `[force][motion]`, inner end first.
#[derive(Clone, Copy, Debug)]
pub struct PointTangent<T> {
    /// Segment, by index.
    pub segment: usize,
    /// Derivatives.
    pub ends: [[NodeTangent<T>; 2]; 2],
}

/// Resistance of a load at a point of a segment to a motion out of the plane, for planar motion.
#[derive(Clone, Copy, Debug)]
pub struct PointDamping<T> {
    /// Segment, by index.
    pub segment: usize,
    /// Fraction `ξ`, see [`PointLoad::fraction`].
    pub fraction: T,
    /// `∂F_z/∂ż` in N s/m.
    pub damping: T,
}

/// Motion of the nodes of a chain, for loads.
pub trait NodeMotion {
    /// Returns position in m and velocity in m/s of `r_k` in one lane, for `k = index`; `r_0` is
    /// the root.
    fn node(&self, index: usize, lane: usize) -> [[f64; 3]; 2];
}

/// External forces on a chain: on its nodes `r_1 … r_n` (index 0 is `r_1`), and at points of its
/// segments.
pub trait NodeLoads<T> {
    /// Returns `true` if there is no load.
    fn is_empty(&self) -> bool {
        false
    }

    /// Returns the lanes in which each node carries a load, if known: loads of other nodes are then
    /// not evaluated.
    fn lanes(&self) -> Option<&[LaneSet]> {
        None
    }

    /// Returns `true` if there may be loads at points of segments.
    fn loads_points(&self) -> bool {
        false
    }

    /// Adds the loads at points of segments.
    fn point_loads(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointLoad<T>)) {
        let _ = (nodes, add);
    }

    /// Adds the derivatives of the loads at points of segments.
    fn point_tangents(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<T>)) {
        let _ = (nodes, add);
    }

    /// Adds the resistance of the loads at points of segments to a motion out of the plane, for
    /// planar motion.
    fn point_dampings(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointDamping<T>)) {
        let _ = (nodes, add);
    }

    /// Returns `false` if no load resists a motion out of the plane, for planar motion.
    fn resists_lateral_motion(&self) -> bool {
        true
    }

    /// Returns the force on a node in N; `None` if there is none.
    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]>;

    /// Returns the derivatives of the force; `None` where [`NodeLoads::force`] is `None`.
    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>>;

    /// Returns `∂F_z/∂ż` in N s/m, the resistance of the load to a motion of the node out of the
    /// plane, for planar motion. `None` if there is none.
    fn lateral_damping(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<T>
    where
        T: Copy,
    {
        self.tangent(node, position, velocity)
            .map(|tangent| tangent.velocity[2][2])
    }
}

/// Loads of a chain without loads.
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
    /// Returns the weights with which a tangent is the derivative with respect to the rates.
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
    /// Dissipation function `D` in W; the dampers take `2 D`.
    pub dissipation: T,
    /// Power of the torque at the clamp in W: `∂E_spring/∂e_0·ė_0 + Ω·∂D/∂Ω`. The second part is
    /// the power `2 D` that the dampers take in the body, plus their power on the segments.
    pub clamp_torque_power: T,
}
