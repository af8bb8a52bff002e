//! The scalar that the generated equations compute with.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use bristle_codegen::special;

/// A real number, or several side by side.
///
/// The generated kernels and the loops over them are generic over this trait, so that one source serves one
/// simulation and many.
pub trait Real:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The constant `value`.
    fn from_f64(value: f64) -> Self;

    /// The square root.
    fn sqrt(self) -> Self;

    /// The sine, argument in rad.
    fn sin(self) -> Self;

    /// The cosine, argument in rad.
    fn cos(self) -> Self;

    /// Sine and cosine, argument in rad.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }

    /// The arc sine, in rad.
    fn asin(self) -> Self;

    /// 1 where `self < other`, else 0.
    fn less_than(self, other: Self) -> Self;

    /// The derivative of order `ORDER` (0 to 3) of `S(u) = ½ arccos²(1 − u)` at `u`, see
    /// [`bristle_codegen::special`].
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self;
}

impl Real for f64 {
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
        self.sin()
    }

    #[inline(always)]
    fn cos(self) -> Self {
        self.cos()
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
        special::half_angle_squared(ORDER, u)
    }
}
