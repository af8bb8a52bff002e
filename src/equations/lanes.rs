//! Several real numbers side by side, for the vector units of a machine.
//!
//! [`Lanes`] is a [`Real`] like `f64`, so that kernels and loops written once serve one chain and `N` of them. Each
//! operation is a loop over the lanes that the compiler turns into vector instructions, those of the function into
//! which it is inlined: all of them are therefore inlined always, and [`super::batch`] has the function.
//!
//! A lane's value does not depend on its neighbours, nor on the instructions: products and sums are rounded each
//! (no fused operations), and where lanes take different ways, every lane takes its own.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};
use std::ops::{Add, Div, Mul, Neg, Sub};

use bristle_codegen::special::{self, SERIES_LIMIT};

use super::Real;

/// Below this `|x|` (2²⁰ rad) [`Lanes`] have their own sine and cosine; a lane beyond takes those of `f64`.
pub const TRIGONOMETRIC_LIMIT: f64 = 1_048_576.0;

/// `N` real numbers.
///
/// Sine and cosine are within 1 ulp below [`TRIGONOMETRIC_LIMIT`] and those of `f64` beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn map(self, operation: impl Fn(f64) -> f64) -> Self {
        let mut result = [0.0; N];
        for lane in 0..N {
            result[lane] = operation(self.0[lane]);
        }
        Self(result)
    }

    #[inline(always)]
    fn zip(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        let mut result = [0.0; N];
        for lane in 0..N {
            result[lane] = operation(self.0[lane], other.0[lane]);
        }
        Self(result)
    }

    /// True if all lanes are within `±limit`; counted rather than searched, which needs no branches.
    #[inline(always)]
    fn all_within(self, limit: f64) -> bool {
        let mut beyond = 0.0;
        for lane in 0..N {
            beyond += if self.0[lane].abs() <= limit { 0.0 } else { 1.0 };
        }
        beyond == 0.0
    }
}

impl<const N: usize> Add for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const N: usize> Div for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize> Real for Lanes<N> {
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
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
        let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            (sin[lane], cos[lane]) = near_sin_cos(self.0[lane]);
        }
        (Self(sin), Self(cos))
    }

    #[inline(always)]
    fn asin(self) -> Self {
        self.map(f64::asin)
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> Self {
        self.zip(other, |a, b| f64::from(u8::from(a < b)))
    }

    /// As precise as that of `f64`; the series is the same to the bit.
    #[inline(always)]
    fn half_angle_squared<const ORDER: u8>(u: Self) -> Self {
        let mut series = Self::from_f64(0.0);
        for coefficient in special::SERIES[ORDER as usize].iter().rev() {
            series = series * u + Self::from_f64(*coefficient);
        }
        // Joints of a filament of many segments bend little: mostly no lane needs the closed form.
        if u.all_within(SERIES_LIMIT) {
            return series;
        }
        let closed = u.map(closed_half_angle_squared::<ORDER>);
        let mut result = [0.0; N];
        for lane in 0..N {
            result[lane] = if u.0[lane].abs() <= SERIES_LIMIT { series.0[lane] } else { closed.0[lane] };
        }
        Self(result)
    }
}

/// π/2 in parts of 33 bits, whose products with integers up to 2²⁰ are exact, and the rest.
#[allow(clippy::excessive_precision, reason = "FDLIBM's digits, to be found again")]
const HALF_PI: [f64; 4] =
    [1.57079632673412561417e+00, 6.07710050630396597660e-11, 2.02226624871116645580e-21, 8.47842766036889956997e-32];

/// Added to a small number it rounds that to an integer, which then stands in the last bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Sine and cosine for `|x| ≤` [`TRIGONOMETRIC_LIMIT`], without branches.
///
/// The multiple of π/2 is taken off exactly but for 2⁻⁸⁰ or so (Cody and Waite); the polynomials of the rest, at most
/// π/4, are those of FDLIBM's `__kernel_sin` and `__kernel_cos`.
#[allow(clippy::excessive_precision, reason = "FDLIBM's digits, to be found again")]
#[inline(always)]
fn near_sin_cos(angle: f64) -> (f64, f64) {
    let shifted = angle * FRAC_2_PI + ROUNDER;
    let multiple = shifted - ROUNDER;
    let quadrant = shifted.to_bits();
    let (rest, error) = two_sum(angle - multiple * HALF_PI[0], -(multiple * HALF_PI[1]));
    let (rest, next_error) = two_sum(rest, -(multiple * HALF_PI[2]));
    // Subtracted, not added, so that −0 stays what it is.
    let excess = multiple * HALF_PI[3] - (error + next_error);
    let x = rest - excess;
    let tail = (rest - x) - excess;

    let z = x * x;
    let (w, v) = (z * z, z * x);
    let odd = 8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
        + z * w * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
    let sin = x - ((z * (0.5 * tail - v * odd) - tail) + v * 1.66666666666666324348e-01);
    let even = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05))
        + w * w * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11));
    let half = 0.5 * z;
    let one_less = 1.0 - half;
    let cos = one_less + (((1.0 - one_less) - half) + (z * even - x * tail));

    // Odd quadrants swap the two; the second bit of the quadrant, or of the next one, is the sign.
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swapped = (sin ^ cos) & (quadrant & 1).wrapping_neg();
    let sign = |quadrant: u64| (quadrant & 2) << 62;
    (f64::from_bits(sin ^ swapped ^ sign(quadrant)), f64::from_bits(cos ^ swapped ^ sign(quadrant.wrapping_add(1))))
}

/// Sines and cosines where some lane is beyond [`TRIGONOMETRIC_LIMIT`], or not finite.
#[cold]
#[inline(never)]
fn far_sin_cos<const N: usize>(angles: Lanes<N>) -> (Lanes<N>, Lanes<N>) {
    let both =
        angles.0.map(|x| if x.abs() <= TRIGONOMETRIC_LIMIT { near_sin_cos(x) } else { (f64::sin(x), f64::cos(x)) });
    (Lanes(both.map(|(sin, _)| sin)), Lanes(both.map(|(_, cos)| cos)))
}

/// `a + b` and its rounding error.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let from_b = sum - a;
    (sum, (a - (sum - from_b)) + (b - from_b))
}

/// The closed form of `S` and its derivatives, as in [`special::half_angle_squared`] but without branches.
///
/// The angle is `2 arcsin √(u/2)`, with FDLIBM's rational approximation of the arc sine.
#[allow(clippy::excessive_precision, reason = "FDLIBM's digits, to be found again")]
#[inline(always)]
fn closed_half_angle_squared<const ORDER: u8>(u: f64) -> f64 {
    let square = 0.5 * u;
    let half_sin = square.sqrt();
    let obtuse = half_sin >= 0.5;
    // Above 1/2: arcsin x = π/2 − 2 arcsin √((1 − x)/2), with 1 − x = (1 − x²)/(1 + x) as 1 − x² is exact.
    let z = if obtuse { 0.5 * (1.0 - square) / (1.0 + half_sin) } else { square };
    let x = z.sqrt();
    let numerator = z
        * (1.66666666666666657415e-01
            + z * (-3.25565818622400915405e-01
                + z * (2.01212532134862925881e-01
                    + z * (-4.00555345006794114027e-02
                        + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)))));
    let denominator = 1.0
        + z * (-2.40339491173441421878e+00
            + z * (2.02094576023350569471e+00 + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)));
    let arc = x + x * (numerator / denominator);
    let angle = 2.0 * if obtuse { FRAC_PI_2 - 2.0 * arc } else { arc };
    if ORDER == 0 {
        return 0.5 * angle * angle;
    }
    let cos = 1.0 - u;
    let sin_squared = u * (2.0 - u);
    let first = angle / sin_squared.sqrt();
    let second = (1.0 - cos * first) / sin_squared;
    match ORDER {
        1 => first,
        2 => second,
        _ => (first - 3.0 * cos * second) / sin_squared,
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    /// A value and what is left of it, some 106 bits.
    #[derive(Clone, Copy)]
    struct Double(f64, f64);

    impl Double {
        fn plus(self, value: f64) -> Self {
            let (sum, error) = two_sum(self.0, value);
            let (high, low) = two_sum(sum, error + self.1);
            Self(high, low)
        }

        fn times(self, other: Self) -> Self {
            let high = self.0 * other.0;
            let error = self.0.mul_add(other.0, -high);
            let (high, low) = two_sum(high, error + (self.0 * other.1 + self.1 * other.0));
            Self(high, low)
        }

        fn over(self, divisor: f64) -> Self {
            let high = self.0 / divisor;
            let rest = (-high).mul_add(divisor, self.0);
            let (high, low) = two_sum(high, (rest + self.1) / divisor);
            Self(high, low)
        }
    }

    /// Sine and cosine by power series in doubled precision, of `x` less a multiple of π/2 with 159 bits.
    fn reference(x: f64) -> [Double; 2] {
        const PARTS: [f64; 3] = [FRAC_PI_2, 6.123233995736766e-17, -1.4973849048591833e-33];
        let multiple = (x * FRAC_2_PI).round();
        let mut rest = Double(x, 0.0);
        for part in PARTS {
            let product = multiple * part;
            rest = rest.plus(-product).plus(-multiple.mul_add(part, -product));
        }
        let square = rest.times(rest);
        let series = |first: Double, start: u32| {
            let (mut sum, mut term) = (first, first);
            for i in 0..14 {
                let next = f64::from(start + 2 * i);
                term = term.times(square).over(-next * (next + 1.0));
                sum = sum.plus(term.0).plus(term.1);
            }
            sum
        };
        let (sin, cos) = (series(rest, 2), series(Double(1.0, 0.0), 1));
        let minus = |Double(high, low)| Double(-high, -low);
        match multiple.rem_euclid(4.0) as u8 {
            0 => [sin, cos],
            1 => [cos, minus(sin)],
            2 => [minus(sin), minus(cos)],
            _ => [minus(cos), sin],
        }
    }

    /// Of the value nearest to `x`, in the last place of `x`.
    fn error_in_ulp(value: f64, expected: Double) -> f64 {
        let magnitude = expected.0.abs();
        ((value - expected.0) - expected.1).abs() / (magnitude.next_up() - magnitude)
    }

    #[test]
    fn sine_and_cosine_are_within_one_ulp() {
        let mut rng = Rng::with_seed(1);
        let mut points = vec![0.0, f64::MIN_POSITIVE, 5e-324, 1e-310, 1e-8, TRIGONOMETRIC_LIMIT];
        for _ in 0..40_000 {
            points.push(10.0 * rng.f64());
            points.push(TRIGONOMETRIC_LIMIT * rng.f64());
            // All exponents alike, down to the smallest denormal.
            points.push(f64::from_bits(rng.u64(..TRIGONOMETRIC_LIMIT.to_bits())));
        }
        // Next to multiples of π/2, where the reduction cancels, and between two, where the quadrant changes.
        for i in 0..40_000 {
            let multiple = if i < 1000 { i } else { rng.u32(..667_544) };
            for quarter in [0.0, 0.5] {
                let near = (f64::from(multiple) + quarter) * FRAC_PI_2;
                points.extend([near.next_down(), near, near.next_up()]);
            }
        }
        let mut worst = 0.0_f64;
        for x in points.into_iter().filter(|x| (0.0..=TRIGONOMETRIC_LIMIT).contains(x)) {
            let Lanes(sines) = Lanes([x, -x]).sin();
            let Lanes(cosines) = Lanes([x, -x]).cos();
            let [sin, cos] = reference(x);
            let error = error_in_ulp(sines[0], sin).max(error_in_ulp(cosines[0], cos));
            assert!(error < 1.0, "{error} ulp at {x:e}");
            worst = worst.max(error);
            assert_eq!((sines[0].to_bits(), cosines[0]), ((-sines[1]).to_bits(), cosines[1]), "symmetry at {x:e}");
        }
        // The polynomials alone have some 0.6 ulp, and the result is rounded; less would mean that nothing is measured.
        assert!(worst > 0.5, "{worst}");
        println!("largest error: {worst} ulp");
    }

    #[test]
    fn a_lane_beyond_the_limit_takes_the_sine_of_f64() {
        let far = [TRIGONOMETRIC_LIMIT.next_up(), -3e6, 1e22, f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        for x in far {
            let (Lanes(sin), Lanes(cos)) = Lanes([x, 0.3, -0.0, 5.0]).sin_cos();
            let (Lanes(near_sin), Lanes(near_cos)) = Lanes([0.3, 0.3, -0.0, 5.0]).sin_cos();
            assert_eq!((sin[0].is_nan(), cos[0].is_nan()), (!x.is_finite(), !x.is_finite()));
            if x.is_finite() {
                assert_eq!((sin[0], cos[0]), (x.sin(), x.cos()));
            }
            assert_eq!((&sin[1..], &cos[1..]), (&near_sin[1..], &near_cos[1..]), "neighbours do not matter");
            assert!(sin[2] == 0.0 && sin[2].is_sign_negative());
        }
    }

    fn half_angle_squared<const ORDER: u8>(tolerance: f64) {
        let mut rng = Rng::with_seed(2);
        for i in 0..20_000 {
            let u = match i % 4 {
                0 => SERIES_LIMIT * (2.0 * rng.f64() - 1.0),
                1 => 2.0 * rng.f64(),
                // Towards the straight and the folded joint.
                2 => 10.0_f64.powf(-12.0 * rng.f64()),
                _ => 2.0 - 10.0_f64.powf(-10.0 * rng.f64()),
            };
            let expected = special::half_angle_squared(ORDER, u);
            let Lanes([straight, value, bent]) = Lanes::half_angle_squared::<ORDER>(Lanes([0.0, u, 0.5]));
            assert!((value / expected - 1.0).abs() < tolerance || value == expected, "{u}: {value} {expected}");
            assert_eq!(Lanes([straight]), Lanes::half_angle_squared::<ORDER>(Lanes([0.0])));
            assert_eq!(Lanes([bent]), Lanes::half_angle_squared::<ORDER>(Lanes([0.5])));
            if u.abs() <= SERIES_LIMIT {
                assert_eq!(value.to_bits(), expected.to_bits());
            }
        }
        for u in [SERIES_LIMIT, SERIES_LIMIT.next_up(), 0.5, 0.5_f64.next_down(), 1.0] {
            let Lanes([value]) = Lanes::half_angle_squared::<ORDER>(Lanes([u]));
            assert!((value / special::half_angle_squared(ORDER, u) - 1.0).abs() < tolerance, "{u}");
        }
        for u in [2.1, -0.1, f64::NAN, f64::INFINITY] {
            let Lanes([value]) = Lanes::half_angle_squared::<ORDER>(Lanes([u]));
            assert!(value.is_nan(), "{u}: {value}");
        }
    }

    #[test]
    fn half_angle_squared_is_as_precise_as_that_of_f64() {
        // Twice the bounds stated there: both sides have such an error.
        half_angle_squared::<0>(8e-15);
        half_angle_squared::<1>(8e-15);
        half_angle_squared::<2>(8e-15);
        half_angle_squared::<3>(4e-13);
        assert_eq!(Lanes::half_angle_squared::<1>(Lanes([2.0])), Lanes([f64::INFINITY]));
    }
}
