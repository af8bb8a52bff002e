//! Several real numbers side by side, for the vector units of a machine.
//!
//! [`Lanes`] is a [`Real`] like `f64`: kernels and loops written once serve one chain and [`LANES`]
//! chains. Each operation is a loop over the lanes, which the compiler turns into the vector
//! instructions of the function into which it is inlined. All operations are therefore always
//! inlined, into the functions of [`super::dispatch`].
//!
//! A lane's value depends neither on its neighbours nor on the instructions: each product and each
//! sum is rounded (no fused operations), and where branches differ, every lane takes its own
//! branch.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::series::SERIES_LIMIT;

use super::elementary::{self, TRIGONOMETRIC_LIMIT};
use super::real::larger;
use super::{LaneSet, Lanewise, Real};

/// Number of chains that are computed together.
///
/// Eight numbers fill one AVX-512 register, two AVX2 registers, or four NEON registers.
pub const LANES: usize = 8;

/// [`LANES`] real numbers. In each lane, each operation gives the result of `f64` to the bit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(align(64))]
pub struct Lanes(pub [f64; LANES]);

/// Does `$body` for each `$lane`. The condition stands at the end of the loop: LLVM would have to
/// move it there, which is slow in functions of thousands of operations.
macro_rules! for_each {
    ($lane:ident, $body:expr) => {
        let mut $lane = 0;
        loop {
            $body;
            $lane += 1;
            if $lane >= LANES {
                break;
            }
        }
    };
}

/// Makes [`Lanes`] with `$value` in each `$lane`.
macro_rules! each {
    ($lane:ident, $value:expr) => {{
        // A constant, as `[0.0; LANES]` would be another loop.
        let mut result = Lanes::ZERO;
        for_each!($lane, result.0[$lane] = $value);
        result
    }};
}

impl Lanes {
    /// Returns `true` if all lanes are within `±limit`.
    #[inline(always)]
    fn all_within(self, limit: f64) -> bool {
        let mut within = true;
        for_each!(lane, within &= self.0[lane].abs() <= limit);
        within
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        each!(lane, self.0[lane] + other.0[lane])
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        each!(lane, self.0[lane] - other.0[lane])
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        each!(lane, self.0[lane] * other.0[lane])
    }
}

impl Div for Lanes {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        each!(lane, self.0[lane] / other.0[lane])
    }
}

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        each!(lane, -self.0[lane])
    }
}

/// Computes sine and cosine where a lane is beyond [`TRIGONOMETRIC_LIMIT`]. It is not inlined,
/// because results that are written lane by lane stay in memory and would slow down other cases
/// too.
#[cold]
#[inline(never)]
fn far_sin_cos(angles: Lanes) -> (Lanes, Lanes) {
    let (mut sin, mut cos) = (Lanes::ZERO, Lanes::ZERO);
    for_each!(
        lane,
        (sin.0[lane], cos.0[lane]) = elementary::sin_cos(angles.0[lane])
    );
    (sin, cos)
}

impl Real for Lanes {
    const ZERO: Self = Self([0.0; LANES]);

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        each!(_lane, value)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(lane, self.0[lane].sqrt())
    }

    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }

    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        if !self.all_within(TRIGONOMETRIC_LIMIT) {
            return far_sin_cos(self);
        }
        let (mut sin, mut cos) = (Self::ZERO, Self::ZERO);
        for_each!(
            lane,
            (sin.0[lane], cos.0[lane]) = elementary::near_sin_cos(self.0[lane])
        );
        (sin, cos)
    }

    #[inline(always)]
    fn asin(self) -> Self {
        each!(lane, self.0[lane].asin())
    }

    #[inline(always)]
    fn exp(self) -> Self {
        each!(lane, self.0[lane].exp())
    }

    #[inline(always)]
    fn ln(self) -> Self {
        each!(lane, self.0[lane].ln())
    }

    #[inline(always)]
    fn tanh(self) -> Self {
        each!(lane, self.0[lane].tanh())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        each!(lane, self.0[lane].abs())
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        each!(lane, self.0[lane].atan2(x.0[lane]))
    }

    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        each!(lane, self.0[lane].powf(exponent.0[lane]))
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> Self {
        each!(lane, f64::from(u8::from(self.0[lane] < other.0[lane])))
    }

    #[inline(always)]
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self {
        // Joints of a filament of many segments bend little: mostly no lane needs the closed form.
        if u.all_within(SERIES_LIMIT) {
            return each!(lane, elementary::half_angle_series::<ORDER>(u.0[lane]));
        }
        each!(lane, {
            let u = u.0[lane];
            let (series, closed) = (
                elementary::half_angle_series::<ORDER>(u),
                elementary::half_angle_closed::<ORDER>(u),
            );
            if u.abs() <= SERIES_LIMIT {
                series
            } else {
                closed
            }
        })
    }
}

impl Lanewise for Lanes {
    const LANES: usize = LANES;

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.0[lane]
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.0[lane] = value;
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        each!(lane, larger(self.0[lane], other.0[lane]))
    }

    #[inline(always)]
    fn select(self, lanes: LaneSet, other: Self) -> Self {
        each!(
            lane,
            if lanes.contains(lane) {
                self.0[lane]
            } else {
                other.0[lane]
            }
        )
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    /// Operation of a lane on single numbers.
    type Scalar = fn(f64, f64) -> f64;

    /// Draws numbers of any sign and size, arguments of sines, and some that are not numbers.
    fn arguments(rng: &mut Rng) -> [f64; 8] {
        std::array::from_fn(|_| match rng.u32(..8) {
            0 => f64::from_bits(rng.u64(..)),
            1 => [0.0, -0.0, f64::INFINITY, f64::NAN, TRIGONOMETRIC_LIMIT][rng.usize(..5)],
            2 => 2.0 * rng.f64(),
            3 => 1e8 * rng.f64(),
            _ => 20.0 * rng.f64() - 10.0,
        })
    }

    #[test]
    fn each_lane_has_the_bits_of_f64() {
        let mut rng = Rng::with_seed(3);
        for _ in 0..20_000 {
            let (a, b) = (arguments(&mut rng), arguments(&mut rng));
            let (x, y) = (Lanes(a), Lanes(b));
            let results: [(Lanes, Scalar); 19] = [
                (x + y, |a, b| a + b),
                (x - y, |a, b| a - b),
                (x * y, |a, b| a * b),
                (x / y, |a, b| a / b),
                (-x, |a, _| -a),
                (x.sin(), |a, _| Real::sin(a)),
                (x.cos(), |a, _| Real::cos(a)),
                (x.sqrt(), |a, _| Real::sqrt(a)),
                (x.asin(), |a, _| Real::asin(a)),
                (x.exp(), |a, _| Real::exp(a)),
                (x.ln(), |a, _| Real::ln(a)),
                (x.tanh(), |a, _| Real::tanh(a)),
                (x.abs(), |a, _| Real::abs(a)),
                (x.atan2(y), |a, b| Real::atan2(a, b)),
                (x.powf(y), |a, b| Real::powf(a, b)),
                (x.less_than(y), |a, b| a.less_than(b)),
                (Lanes::half_angle_squared::<1>(x), |a, _| {
                    f64::half_angle_squared::<1>(a)
                }),
                (Lanes::half_angle_squared::<2>(x), |a, _| {
                    f64::half_angle_squared::<2>(a)
                }),
                (Lanewise::max(x, y), |a, b| Lanewise::max(a, b)),
            ];
            for (operation, (Lanes(values), scalar)) in results.into_iter().enumerate() {
                for lane in 0..8 {
                    let expected = scalar(a[lane], b[lane]);
                    let same = values[lane].to_bits() == expected.to_bits();
                    let none = values[lane].is_nan() && expected.is_nan();
                    assert!(
                        same || none,
                        "operation {operation} of {} and {}",
                        a[lane],
                        b[lane]
                    );
                }
            }
        }
    }

    #[test]
    fn a_set_selects_its_lanes() {
        let mut set = LaneSet::first(4);
        set.remove(1);
        set.insert(6);
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 2, 3, 6]);
        let (one, two) = (Lanes([1.0; 8]), Lanes([2.0; 8]));
        assert_eq!(
            one.select(set, two),
            Lanes([1.0, 2.0, 1.0, 1.0, 2.0, 2.0, 1.0, 2.0])
        );
        assert_eq!(
            (
                1.0_f64.select(set, 2.0),
                1.0_f64.select(LaneSet::default(), 2.0)
            ),
            (1.0, 2.0)
        );
        assert!(LaneSet::default().is_empty() && !set.is_empty());
        assert_eq!(LaneSet::first(64).iter().count(), 64);
    }
}
