//! The scalar type of the generated equations.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Real number, or several side by side.
///
/// The generated kernels and the loops over them are generic over this trait, so that one source
/// serves one simulation and many.
pub trait Real:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Zero.
    const ZERO: Self;

    /// Returns the constant `value`.
    fn from_f64(value: f64) -> Self;

    /// Returns the square root.
    fn sqrt(self) -> Self;

    /// Returns the sine, argument in rad.
    fn sin(self) -> Self;

    /// Returns the cosine, argument in rad.
    fn cos(self) -> Self;

    /// Returns sine and cosine, argument in rad.
    fn sin_cos(self) -> (Self, Self);

    /// Computes `sin φ, cos φ, sin θ, cos θ` of the segments that both slices have.
    #[inline(always)]
    fn sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 4]]) {
        for (q, angles) in q.iter().zip(angles) {
            let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = (q[0].sin_cos(), q[1].sin_cos());
            *angles = [sin_phi, cos_phi, sin_theta, cos_theta];
        }
    }

    /// Computes `sin θ, cos θ` of the segments that both slices have, from blocks whose second
    /// entry is `θ`.
    #[inline(always)]
    fn azimuthal_sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 2]]) {
        for (q, angles) in q.iter().zip(angles) {
            let (sin, cos) = q[1].sin_cos();
            *angles = [sin, cos];
        }
    }

    /// Returns the arc sine, in rad.
    fn asin(self) -> Self;

    /// Returns the exponential.
    fn exp(self) -> Self;

    /// Returns the natural logarithm.
    fn ln(self) -> Self;

    /// Returns the hyperbolic tangent.
    fn tanh(self) -> Self;

    /// Returns the magnitude.
    fn abs(self) -> Self;

    /// Returns the angle of the point `(x, self)`, in rad.
    fn atan2(self, x: Self) -> Self;

    /// Returns the real power.
    fn powf(self, exponent: Self) -> Self;

    /// Returns 1 where `self < other`, else 0.
    fn less_than(self, other: Self) -> Self;

    /// Returns the derivative of order `ORDER` (0 to 3) of `S(u) = ½ arccos²(1 − u)` at `u`, see
    /// `bristle_codegen::ir::special`.
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self;
}

/// [`Real`] whose lanes can be accessed individually and may take different branches.
pub trait Lanewise: Real {
    /// Number of lanes.
    const LANES: usize;

    /// Returns the number in one lane.
    fn lane(self, lane: usize) -> f64;

    /// Changes the number in one lane.
    fn set_lane(&mut self, lane: usize, value: f64);

    /// Returns the larger number; `self` if `other` is NaN.
    fn max(self, other: Self) -> Self;

    /// Returns `self` in `lanes`, `other` elsewhere.
    fn select(self, lanes: LaneSet, other: Self) -> Self;

    /// Returns the results of `value` for each lane.
    #[inline(always)]
    fn from_lanes(value: impl Fn(usize) -> f64) -> Self {
        let mut result = Self::ZERO;
        for lane in 0..Self::LANES {
            result.set_lane(lane, value(lane));
        }
        result
    }
}

/// Returns the larger number by a single comparison, as in a vector unit. `f64::max` also has a
/// rule for NaN on either side.
#[inline(always)]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Set of lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneSet(u64);

impl LaneSet {
    /// Returns the first `count` lanes.
    pub fn first(count: usize) -> Self {
        Self(if count >= 64 {
            u64::MAX
        } else {
            (1 << count) - 1
        })
    }

    /// Returns `true` if the set is empty.
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns `true` if the set contains `lane`.
    #[inline(always)]
    pub fn contains(self, lane: usize) -> bool {
        self.0 >> lane & 1 == 1
    }

    /// Adds `lane`.
    pub fn insert(&mut self, lane: usize) {
        self.0 |= 1 << lane;
    }

    /// Removes `lane`.
    pub fn remove(&mut self, lane: usize) {
        self.0 &= !(1 << lane);
    }

    /// Returns the lanes, in order.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest.wrapping_sub(1);
            (lane < 64).then_some(lane)
        })
    }
}
