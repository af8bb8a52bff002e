//! The chart of a chain: the axis of the polar angles of all segments.
//!
//! Spherical coordinates about one axis are singular along it. A chain therefore takes coordinates
//! about `z` or about `x` ([`PolarAxis`]). It changes its chart between steps where the other is
//! better for all segments. About `x` the same kernels hold with the axes permuted. Joints that are
//! relaxed at an angle about `z` have coordinates about `z` only.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::fmt;

use super::chain::{Clamp, Link, RelaxedAngle, turned};
use super::kernels::{self, AzimuthSteps, Joint, JointEnergy, JointTangent, Segment};
use super::linear::{dot, product, scale, sub, sub_matrices};
use super::{Lanewise, Real, StepWeights};

/// `|sin φ|` below which a segment is at a pole of its coordinates, where its azimuth has no
/// meaning.
///
/// The condition number of `M` grows as `1/sin² φ` towards a pole. There it is some 1e12 times its
/// value at the equator, and an acceleration has lost twelve of its sixteen digits.
pub const POLE: f64 = 1e-6;

/// `|sin φ|` of a segment below which its chain takes the other chart, if it is better.
const NEAR_POLE: f64 = 0.3;

/// Axis from which the polar angles `φ` of a chain are measured; it names the chart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PolarAxis {
    /// `e = (sin φ cos θ, sin φ sin θ, cos φ)`, as MODEL states it.
    #[default]
    Z,
    /// `e = (cos φ, sin φ cos θ, sin φ sin θ)`.
    X,
}

impl PolarAxis {
    /// Returns the other axis.
    pub fn other(self) -> Self {
        match self {
            Self::Z => Self::X,
            Self::X => Self::Z,
        }
    }

    /// Converts components along `(x, y, z)` to the chart's order: the polar axis last.
    #[inline(always)]
    pub fn from_frame<V>(self, [x, y, z]: [V; 3]) -> [V; 3] {
        match self {
            Self::Z => [x, y, z],
            Self::X => [y, z, x],
        }
    }

    /// Converts components in the chart's order to components along `(x, y, z)`.
    #[inline(always)]
    pub fn to_frame<V>(self, [first, second, polar]: [V; 3]) -> [V; 3] {
        match self {
            Self::Z => [first, second, polar],
            Self::X => [polar, first, second],
        }
    }

    /// Returns `e`, `ė` and `ë` of a segment with the coordinates `[φ, θ]` about this axis, their
    /// rates and accelerations.
    ///
    /// They are regular at the poles too.
    pub fn direction(self, [q, v, acceleration]: [[f64; 2]; 3]) -> [[f64; 3]; 3] {
        let (angles, [v_phi, v_theta], [a_phi, a_theta]) = (trigonometry(q), v, acceleration);
        let [sin, cos, ..] = angles;
        let basis = Basis::at(angles);
        // ë along e, e_φ and e_θ; the acceleration towards the polar axis is split between the
        // first two.
        let towards_axis = v_theta * v_theta * sin;
        let along = [
            -v_phi * v_phi - towards_axis * sin,
            a_phi - towards_axis * cos,
        ];
        let across = a_theta * sin + 2.0 * v_phi * v_theta * cos;
        let bend = std::array::from_fn(|i| {
            along[0] * basis.direction[i] + along[1] * basis.polar[i] + across * basis.azimuthal[i]
        });
        [basis.direction, direction_rate(angles, v), bend].map(|vector| self.to_frame(vector))
    }

    /// Returns the coordinates `[φ, θ]` about this axis, their rates and accelerations, of a
    /// segment with `e`, `ė` and `ë`: the inverse of [`PolarAxis::direction`], with `0 ≤ φ ≤ π`.
    ///
    /// They are not finite at a pole.
    pub fn coordinates(self, direction: [[f64; 3]; 3]) -> [[f64; 2]; 3] {
        let [direction, rate, bend] = direction.map(|vector| self.from_frame(vector));
        let [first, second, polar] = direction;
        let q = [first.hypot(second).atan2(polar), second.atan2(first)];
        let angles = trigonometry(q);
        let [sin, cos, ..] = angles;
        let basis = Basis::at(angles);
        let v = [dot(rate, basis.polar), dot(rate, basis.azimuthal) / sin];
        let acceleration = [
            dot(bend, basis.polar) + v[1] * v[1] * sin * cos,
            (dot(bend, basis.azimuthal) - 2.0 * v[0] * v[1] * cos) / sin,
        ];
        [q, v, acceleration]
    }
}

impl fmt::Display for PolarAxis {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Z => "z",
            Self::X => "x",
        })
    }
}

/// Segment at a pole of its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoleError {
    /// Number of the segment, counted from 1.
    pub segment: usize,
    /// Polar angle in rad.
    pub polar_angle: f64,
    /// Axis from which the polar angle is measured.
    pub axis: PolarAxis,
}

impl fmt::Display for PoleError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            segment,
            polar_angle,
            axis,
        } = self;
        write!(
            formatter,
            "segment {segment} with φ = {polar_angle:?} stands at a pole (sin φ = 0) of its coordinates about {axis}, \
             where its azimuth has no meaning"
        )
    }
}

impl Error for PoleError {}

/// Returns the first segment with `|sin φ| <` [`POLE`], by index. The chart does not matter: a
/// segment's own `φ` decides.
pub fn find_pole(q: &[[f64; 2]]) -> Option<usize> {
    q.iter()
        .position(|[polar_angle, _]| sine_is_below(POLE, *polar_angle))
}

/// Returns `true` if a segment with this `φ` is near a pole of its chart: `|sin φ| <`
/// [`NEAR_POLE`].
fn near_pole(polar_angle: f64) -> bool {
    sine_is_below(NEAR_POLE, polar_angle)
}

/// Coordinates `[φ, θ]` of a segment, their rates and accelerations.
pub type SegmentMotion = [[f64; 2]; 3];

/// Converts `motions` of segments from the chart about `axis` to the other. Returns `None` unless a
/// segment is near a pole and the smallest `|sin φ|` is larger in the other chart.
pub fn better_chart(
    axis: PolarAxis,
    motions: impl Iterator<Item = SegmentMotion> + Clone,
) -> Option<(PolarAxis, Vec<SegmentMotion>)> {
    if !motions.clone().any(|[q, ..]| near_pole(q[0])) {
        return None;
    }
    let least_sine = |least: f64, [q, ..]: &SegmentMotion| least.min(q[0].sin().abs());
    let other = axis.other();
    let converted: Vec<SegmentMotion> = motions
        .clone()
        .map(|motion| other.coordinates(axis.direction(motion)))
        .collect();
    let here = motions.fold(1.0, |least, motion| least_sine(least, &motion));
    let there = converted.iter().fold(1.0, least_sine);
    (there > here).then_some((other, converted))
}

/// Returns `|sin φ| < limit`, for limits below `cos 1`. Within one radian of the equator the sine
/// need not be computed.
fn sine_is_below(limit: f64, polar_angle: f64) -> bool {
    (polar_angle - FRAC_PI_2).abs() > 1.0 && polar_angle.sin().abs() < limit
}

fn trigonometry([phi, theta]: [f64; 2]) -> [f64; 4] {
    [phi.sin(), phi.cos(), theta.sin(), theta.cos()]
}

/// Unit vectors in the chart's order: `e`, and its directions of motion with `φ` and with `θ`.
struct Basis {
    direction: [f64; 3],
    polar: [f64; 3],
    azimuthal: [f64; 3],
}

impl Basis {
    fn at(angles: [f64; 4]) -> Self {
        let [sin, cos, sin_theta, cos_theta] = angles;
        Self {
            direction: direction(angles),
            polar: [cos * cos_theta, cos * sin_theta, -sin],
            azimuthal: [-sin_theta, cos_theta, 0.0],
        }
    }
}

/// Returns `e` in the chart's order.
fn direction<T: Real>([sin_phi, cos_phi, sin_theta, cos_theta]: [T; 4]) -> [T; 3] {
    [sin_phi * cos_theta, sin_phi * sin_theta, cos_phi]
}

/// Returns `ė` in the chart's order.
fn direction_rate<T: Real>(
    [sin_phi, cos_phi, sin_theta, cos_theta]: [T; 4],
    [v_phi, v_theta]: [T; 2],
) -> [T; 3] {
    let (polar, azimuthal) = (v_phi * cos_phi, v_theta * sin_phi);
    [
        polar * cos_theta - azimuthal * sin_theta,
        polar * sin_theta + azimuthal * cos_theta,
        -(v_phi * sin_phi),
    ]
}

/// Side of a joint: sines and cosines of the segment's angles, and their rates in the body.
#[derive(Clone, Copy, Debug)]
pub struct JointSide<'a, T> {
    /// `sin φ, cos φ, sin θ, cos θ`
    pub angles: &'a [T; 4],
    /// `φ̇, θ̇` in rad/s, less the rates of a segment that turns rigidly with the body.
    pub rates: [T; 2],
}

impl<T: Real> JointSide<'_, T> {
    /// Returns the side for the kernels.
    #[inline(always)]
    pub fn whole(&self) -> kernels::Side<T, 4> {
        kernels::Side {
            angles: *self.angles,
            rates: self.rates,
        }
    }

    /// Returns the side for the kernels in which only the difference of the azimuths enters.
    #[inline(always)]
    fn polar(&self) -> kernels::Side<T, 2> {
        kernels::Side {
            angles: [self.angles[0], self.angles[1]],
            rates: self.rates,
        }
    }

    /// Returns `sin θ, cos θ`.
    #[inline(always)]
    fn azimuth(&self) -> [T; 2] {
        [self.angles[2], self.angles[3]]
    }
}

/// Rotation of the brush body, relative to which dampers act, in the order of a chart.
#[derive(Clone, Copy, Debug)]
pub struct BodyRotation<T> {
    /// `Ω` in rad/s, the component along the polar axis last.
    angular_velocity: [T; 3],
    /// `true` if `Ω` is along the polar axis in every lane. Segments that turn with the body then
    /// have the rates `(0, Ω)` everywhere.
    is_about_axis: bool,
}

impl<T: Lanewise> BodyRotation<T> {
    /// Converts the `angular_velocity` along `(x, y, z)` in rad/s to the chart about `axis`.
    #[inline(always)]
    pub fn new(angular_velocity: [T; 3], axis: PolarAxis) -> Self {
        let angular_velocity = axis.from_frame(angular_velocity);
        let [first, second, _] = angular_velocity;
        let is_zero = |value: T| (0..T::LANES).all(|lane| value.lane(lane) == 0.0);
        Self {
            angular_velocity,
            is_about_axis: is_zero(first) && is_zero(second),
        }
    }
}

impl<T: Real> BodyRotation<T> {
    /// Returns the rates relative to the body.
    #[inline(always)]
    pub fn seen_from(&self, angles: &[T; 4], [phi, theta]: [T; 2]) -> [T; 2] {
        if self.is_about_axis {
            return [phi, theta - self.angular_velocity[2]];
        }
        sub([phi, theta], self.kernel(angles).rates)
    }

    /// Returns the rates of a segment that turns rigidly with the body.
    #[inline(always)]
    pub fn rigid_rates(&self, angles: &[T; 4]) -> [T; 2] {
        if self.is_about_axis {
            return [T::ZERO, self.angular_velocity[2]];
        }
        self.kernel(angles).rates
    }

    /// Returns the derivative of these rates along a step with the weight `w_q`; `None` if they do
    /// not depend on the coordinates.
    #[inline(always)]
    pub fn slopes(&self, side: &JointSide<'_, T>, coordinate_weight: T) -> Option<[[T; 2]; 2]> {
        if self.is_about_axis {
            return None;
        }
        Some(
            self.kernel(side.angles)
                .slopes
                .map(|row| scale(coordinate_weight, row)),
        )
    }

    #[cold]
    #[inline(never)]
    fn kernel(&self, angles: &[T; 4]) -> kernels::RigidRates<T> {
        kernels::rigid_rates(*angles, self.angular_velocity)
    }
}

/// Converts [`kernels::segment`] from the chart about `axis` to the frame.
#[inline(always)]
pub fn segment_to_frame<T: Real>(axis: PolarAxis, segment: Segment<T, 2, 3>) -> Segment<T, 2, 3> {
    Segment {
        coupling: axis.to_frame(segment.coupling),
        base_bias: axis.to_frame(segment.base_bias),
        reach: axis.to_frame(segment.reach),
        reach_rate: axis.to_frame(segment.reach_rate),
        reach_jacobian: axis.to_frame(segment.reach_jacobian),
        reach_bias: axis.to_frame(segment.reach_bias),
        ..segment
    }
}

/// Calls [`kernels::joint`] between two segments.
#[inline(always)]
pub fn joint<T: Real>(
    previous: JointSide<'_, T>,
    next: JointSide<'_, T>,
    link: &Link<T>,
) -> Joint<T, 2> {
    kernels::joint(
        previous.polar(),
        next.polar(),
        azimuth_steps(&previous, &next, link),
        link.joint(),
    )
}

/// Returns the torques of the damper alone.
pub fn damper_torques<T: Real>(
    previous: JointSide<'_, T>,
    next: JointSide<'_, T>,
    link: &Link<T>,
) -> Joint<T, 2> {
    joint(previous, next, &link.without_spring())
}

/// Extends [`kernels::joint_tangent`] to a body that turns in any way.
#[inline(always)]
pub fn joint_tangent<T: Real>(
    previous: JointSide<'_, T>,
    next: JointSide<'_, T>,
    link: &Link<T>,
    body: &BodyRotation<T>,
    weights: StepWeights<T>,
) -> JointTangent<T, 2> {
    let tangent = joint_tangent_at_rest(previous, next, link, weights);
    if body.is_about_axis {
        return tangent;
    }
    joint_tangent_on_body(tangent, previous, next, link, body, weights)
}

/// Subtracts from the `tangent` of a joint the effect of the rigid rates, which depend on the
/// coordinates.
#[cold]
#[inline(never)]
fn joint_tangent_on_body<T: Real>(
    mut tangent: JointTangent<T, 2>,
    previous: JointSide<'_, T>,
    next: JointSide<'_, T>,
    link: &Link<T>,
    body: &BodyRotation<T>,
    weights: StepWeights<T>,
) -> JointTangent<T, 2> {
    let by_rates = joint_tangent_at_rest(previous, next, link, StepWeights::of_rates());
    if let Some(slopes) = body.slopes(&previous, weights.coordinates) {
        let less = |block: &mut [[T; 2]; 2], by_rates| {
            *block = sub_matrices(block, &product(by_rates, &slopes))
        };
        less(&mut tangent.previous_previous, &by_rates.previous_previous);
        less(&mut tangent.next_previous, &by_rates.next_previous);
    }
    if let Some(slopes) = body.slopes(&next, weights.coordinates) {
        let less = |block: &mut [[T; 2]; 2], by_rates| {
            *block = sub_matrices(block, &product(by_rates, &slopes))
        };
        less(&mut tangent.previous_next, &by_rates.previous_next);
        less(&mut tangent.next_next, &by_rates.next_next);
    }
    tangent
}

/// Calls [`kernels::joint_tangent`] on a body at rest.
#[inline(always)]
fn joint_tangent_at_rest<T: Real>(
    previous: JointSide<'_, T>,
    next: JointSide<'_, T>,
    link: &Link<T>,
    weights: StepWeights<T>,
) -> JointTangent<T, 2> {
    let steps = azimuth_steps(&previous, &next, link);
    kernels::joint_tangent(previous.polar(), next.polar(), steps, link.joint(), weights)
}

/// Calls [`kernels::joint_energy`] between two segments.
#[inline(always)]
pub fn joint_energy<T: Real>(
    previous: JointSide<'_, T>,
    next: JointSide<'_, T>,
    link: &Link<T>,
) -> JointEnergy<T> {
    let unbent = link.relaxed_angle.taken_from(next.azimuth());
    kernels::joint_energy(previous.whole(), next.whole(), unbent, link.joint())
}

/// Returns the change of the azimuth from `previous` to `next`.
#[inline(always)]
fn azimuth_steps<T: Real>(
    previous: &JointSide<'_, T>,
    next: &JointSide<'_, T>,
    link: &Link<T>,
) -> AzimuthSteps<T> {
    link.relaxed_angle
        .azimuth_steps(previous.azimuth(), next.azimuth())
}

impl<T: Real> Clamp<T> {
    /// Returns `ē_0`, which is `e_0` turned by the relaxed angle of the clamp joint, in the order
    /// of a chart.
    #[inline(always)]
    pub(super) fn relaxed(&self, axis: PolarAxis, relaxed_angle: &RelaxedAngle<T>) -> [T; 3] {
        axis.from_frame(turned(self.direction, relaxed_angle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_come_back_from_the_direction() {
        for axis in [PolarAxis::Z, PolarAxis::X] {
            for q in [[0.4, -2.0], [1.5, 0.3], [2.9, 3.0]] {
                let motion = [q, [3.0, -40.0], [500.0, 7.0]];
                let back = axis.coordinates(axis.direction(motion));
                for (value, expected) in back.as_flattened().iter().zip(motion.as_flattened()) {
                    // The two differ by products of the squared rate and 1/sin φ.
                    assert!(
                        (value - expected).abs() < 1e-12 * (1.0 + expected.abs() + 1e3),
                        "{back:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn rates_of_the_direction_are_its_derivatives() {
        let size = 1e-5;
        let at = |t: f64| {
            PolarAxis::X.direction([
                [1.0 + 0.3 * t + t * t, 2.0 - 0.7 * t + 0.5 * t * t],
                [0.3 + 2.0 * t, -0.7 + t],
                [2.0, 1.0],
            ])
        };
        let (before, middle, after) = (at(-size), at(0.0), at(size));
        for order in 0..2 {
            for i in 0..3 {
                let slope = (after[order][i] - before[order][i]) / (2.0 * size);
                assert!((middle[order + 1][i] - slope).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn poles_are_found_by_their_own_angle() {
        assert_eq!(
            find_pole(&[[1.0, 0.0], [std::f64::consts::PI, 0.0]]),
            Some(1)
        );
        assert_eq!(find_pole(&[[0.9e-6, 0.0]]), Some(0));
        assert_eq!(
            find_pole(&[[1.1e-6, 0.0], [-0.2, 0.0], [f64::NAN, 0.0]]),
            None
        );
        assert!(near_pole(0.3) && near_pole(3.0) && near_pole(-3.0) && near_pole(6.1));
        assert!(
            !near_pole(0.31)
                && !near_pole(-1.5)
                && !near_pole(FRAC_PI_2)
                && !near_pole(1.5 * std::f64::consts::PI)
        );
    }

    #[test]
    fn the_other_chart_is_far_from_its_pole() {
        for theta in [0.0, 1.0, 2.5, -1.2] {
            let near = [[NEAR_POLE.asin(), theta], [0.0; 2], [0.0; 2]];
            let [[phi, _], ..] = PolarAxis::X.coordinates(PolarAxis::Z.direction(near));
            assert!(phi.sin() > 0.95, "{phi}");
        }
    }
}
