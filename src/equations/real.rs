//! The scalar type of the generated equations.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Lanes, elementary};

/// A real number, or several side by side.
///
/// The generated kernels and the loops over them are generic over this trait, so that one source serves one
/// simulation and many.
pub trait Real:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Zero.
    const ZERO: Self;

    /// The constant `value`.
    fn from_f64(value: f64) -> Self;

    /// The square root.
    fn sqrt(self) -> Self;

    /// The sine, argument in rad.
    fn sin(self) -> Self;

    /// The cosine, argument in rad.
    fn cos(self) -> Self;

    /// Sine and cosine, argument in rad.
    fn sin_cos(self) -> (Self, Self);

    /// `sin φ, cos φ, sin θ, cos θ` of the segments that both slices have.
    #[inline(always)]
    fn sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 4]]) {
        for (q, angles) in q.iter().zip(angles) {
            let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = (q[0].sin_cos(), q[1].sin_cos());
            *angles = [sin_phi, cos_phi, sin_theta, cos_theta];
        }
    }

    /// `sin θ, cos θ` of the segments that both slices have, from blocks whose second entry is `θ`.
    #[inline(always)]
    fn azimuthal_sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 2]]) {
        for (q, angles) in q.iter().zip(angles) {
            let (sin, cos) = q[1].sin_cos();
            *angles = [sin, cos];
        }
    }

    /// The arc sine, in rad.
    fn asin(self) -> Self;

    /// 1 where `self < other`, else 0.
    fn less_than(self, other: Self) -> Self;

    /// The derivative of order `ORDER` (0 to 3) of `S(u) = ½ arccos²(1 − u)` at `u`, see
    /// `bristle_codegen::ir::special`.
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self;
}

impl Real for f64 {
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn sin(self) -> Self {
        elementary::sin_cos(self).0
    }

    #[inline(always)]
    fn cos(self) -> Self {
        elementary::sin_cos(self).1
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }

    /// Four segments at a time, which the compiler computes in vectors.
    #[inline(always)]
    fn sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 4]]) {
        for (q, angles) in q.chunks(4).zip(angles.chunks_mut(4)) {
            let mut block = [0.0; 8];
            block[..2 * q.len()].copy_from_slice(q.as_flattened());
            let (Lanes(sines), Lanes(cosines)) = Lanes(block).sin_cos();
            for (k, angles) in angles.iter_mut().enumerate() {
                *angles = [sines[2 * k], cosines[2 * k], sines[2 * k + 1], cosines[2 * k + 1]];
            }
        }
    }

    /// Eight segments at a time.
    #[inline(always)]
    fn azimuthal_sines_and_cosines(q: &[[Self; 2]], angles: &mut [[Self; 2]]) {
        for (q, angles) in q.chunks(8).zip(angles.chunks_mut(8)) {
            let mut block = [0.0; 8];
            for (entry, [_, azimuth]) in block.iter_mut().zip(q) {
                *entry = *azimuth;
            }
            let (Lanes(sines), Lanes(cosines)) = Lanes(block).sin_cos();
            for (k, angles) in angles.iter_mut().enumerate() {
                *angles = [sines[k], cosines[k]];
            }
        }
    }

    #[inline(always)]
    fn asin(self) -> Self {
        self.asin()
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> Self {
        Self::from(u8::from(self < other))
    }

    #[inline(always)]
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self {
        elementary::half_angle_squared::<ORDER>(u)
    }
}

/// A [`Real`] whose lanes can be accessed individually and may take different branches.
pub trait Lanewise: Real {
    /// The number of lanes.
    const LANES: usize;

    /// The number in one lane.
    fn lane(self, lane: usize) -> f64;

    /// Changes the number in one lane.
    fn set_lane(&mut self, lane: usize, value: f64);

    /// The magnitude.
    fn abs(self) -> Self;

    /// The larger one; `self` if `other` is NaN.
    fn max(self, other: Self) -> Self;

    /// `self` in `lanes`, `other` elsewhere.
    fn select(self, lanes: LaneSet, other: Self) -> Self;

    /// The results of `value` for each lane.
    #[inline(always)]
    fn from_lanes(value: impl Fn(usize) -> f64) -> Self {
        let mut result = Self::ZERO;
        for lane in 0..Self::LANES {
            result.set_lane(lane, value(lane));
        }
        result
    }
}

impl Lanewise for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn set_lane(&mut self, _: usize, value: f64) {
        *self = value;
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        larger(self, other)
    }

    #[inline(always)]
    fn select(self, lanes: LaneSet, other: Self) -> Self {
        if lanes.contains(0) { self } else { other }
    }
}

/// A single comparison, as in a vector unit. `f64::max` also has a rule for NaN on either side.
#[inline(always)]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// A set of lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneSet(u64);

impl LaneSet {
    /// The first `count` lanes.
    pub fn first(count: usize) -> Self {
        Self(if count >= 64 { u64::MAX } else { (1 << count) - 1 })
    }

    /// True if the set is empty.
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if the set contains `lane`.
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

    /// The lanes, in order.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest.wrapping_sub(1);
            (lane < 64).then_some(lane)
        })
    }
}
