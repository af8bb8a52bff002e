//! Sine, cosine and the spring's function `S`, without branches, for one number and for lanes of
//! them.
//!
//! This is our own code for two reasons. A chain has the same digits alone and in a lane, on every
//! processor. And the compiler can vectorise a loop over these functions, which it cannot do with
//! functions of a library.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use super::series::{SERIES, SERIES_LIMIT, TERMS};

/// Largest `|x|` (2²⁰ rad) whose sine and cosine come from this module; beyond, they come from the
/// standard library.
pub const TRIGONOMETRIC_LIMIT: f64 = 1_048_576.0;

/// Computes sine and cosine of `x` in rad: within 1 ulp below [`TRIGONOMETRIC_LIMIT`], from the
/// standard library beyond.
#[inline(always)]
pub fn sin_cos(x: f64) -> (f64, f64) {
    // Not `<`, so that NaN also takes the other branch.
    if x.abs() <= TRIGONOMETRIC_LIMIT {
        near_sin_cos(x)
    } else {
        far_sin_cos(x)
    }
}

#[cold]
#[inline(never)]
fn far_sin_cos(x: f64) -> (f64, f64) {
    x.sin_cos()
}

/// Sums the power series of the derivative of order `ORDER` of `S`, for `|u| ≤` [`SERIES_LIMIT`].
///
/// Terms are summed in pairs, and pairs of pairs (Estrin). This takes a third of the time of
/// Horner's form, whose operations depend on each other.
#[inline(always)]
pub fn half_angle_series<const ORDER: u8>(u: f64) -> f64 {
    let c = &SERIES[ORDER as usize];
    let u2 = u * u;
    let u4 = u2 * u2;
    let pair = |i: usize| c[i] + c[i + 1] * u;
    let four = |i: usize| pair(i) + pair(i + 2) * u2;
    (four(0) + four(4) * u4) + (four(8) + pair(12) * u4) * (u4 * u4)
}

const _: () = assert!(TERMS == 14, "the series is written out for its terms");

/// Computes the derivative of order `ORDER` of `S(u) = ½ arccos²(1 − u)`, as precise as in
/// `bristle_codegen::ir::special`.
#[inline(always)]
pub fn half_angle_squared<const ORDER: u8>(u: f64) -> f64 {
    if u.abs() <= SERIES_LIMIT {
        half_angle_series::<ORDER>(u)
    } else {
        half_angle_closed::<ORDER>(u)
    }
}

/// π/2 in parts of 33 bits and a remainder. Products of the parts with integers up to 2²⁰ are
/// exact.
#[allow(
    clippy::excessive_precision,
    reason = "FDLIBM's digits, to be found again"
)]
const HALF_PI: [f64; 4] = [
    1.57079632673412561417e+00,
    6.07710050630396597660e-11,
    2.02226624871116645580e-21,
    8.47842766036889956997e-32,
];

/// Summand that rounds a small number to an integer in the last bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Computes sine and cosine for `|x| ≤` [`TRIGONOMETRIC_LIMIT`], without branches.
///
/// The multiple of π/2 is subtracted with an error of about 2⁻⁸⁰ (Cody and Waite). The polynomials
/// of the rest, at most π/4, are those of FDLIBM's `__kernel_sin` and `__kernel_cos`.
#[allow(
    clippy::excessive_precision,
    reason = "FDLIBM's digits, to be found again"
)]
#[inline(always)]
pub fn near_sin_cos(angle: f64) -> (f64, f64) {
    let shifted = angle * FRAC_2_PI + ROUNDER;
    let multiple = shifted - ROUNDER;
    let quadrant = shifted.to_bits();
    let (rest, error) = two_sum(angle - multiple * HALF_PI[0], -(multiple * HALF_PI[1]));
    let (rest, next_error) = two_sum(rest, -(multiple * HALF_PI[2]));
    // Subtracted, not added, so that −0 stays −0.
    let excess = multiple * HALF_PI[3] - (error + next_error);
    let x = rest - excess;
    let tail = (rest - x) - excess;

    let z = x * x;
    let (w, v) = (z * z, z * x);
    let odd = 8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
        + z * w * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
    let sin = x - ((z * (0.5 * tail - v * odd) - tail) + v * 1.66666666666666324348e-01);
    let even = z
        * (4.16666666666666019037e-02
            + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05))
        + w * w
            * (-2.75573143513906633035e-07
                + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11));
    let half = 0.5 * z;
    let one_less = 1.0 - half;
    let cos = one_less + (((1.0 - one_less) - half) + (z * even - x * tail));

    // Odd quadrants swap the two; the second bit of the quadrant, or of the next one, is the sign.
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swapped = (sin ^ cos) & (quadrant & 1).wrapping_neg();
    let sign = |quadrant: u64| (quadrant & 2) << 62;
    (
        f64::from_bits(sin ^ swapped ^ sign(quadrant)),
        f64::from_bits(cos ^ swapped ^ sign(quadrant.wrapping_add(1))),
    )
}

/// Returns `a + b` and its rounding error.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let from_b = sum - a;
    (sum, (a - (sum - from_b)) + (b - from_b))
}

/// Computes `S` and its derivatives in closed form, without branches.
///
/// The angle is `2 arcsin √(u/2)`, with FDLIBM's rational approximation of the arc sine.
#[allow(
    clippy::excessive_precision,
    reason = "FDLIBM's digits, to be found again"
)]
#[inline(always)]
pub fn half_angle_closed<const ORDER: u8>(u: f64) -> f64 {
    let square = 0.5 * u;
    let half_sin = square.sqrt();
    let obtuse = half_sin >= 0.5;
    // Above 1/2: arcsin x = π/2 − 2 arcsin √((1 − x)/2), with 1 − x = (1 − x²)/(1 + x) as 1 − x² is
    // exact.
    let z = if obtuse {
        0.5 * (1.0 - square) / (1.0 + half_sin)
    } else {
        square
    };
    let x = z.sqrt();
    let numerator = z
        * (1.66666666666666657415e-01
            + z * (-3.25565818622400915405e-01
                + z * (2.01212532134862925881e-01
                    + z * (-4.00555345006794114027e-02
                        + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)))));
    let denominator = 1.0
        + z * (-2.40339491173441421878e+00
            + z * (2.02094576023350569471e+00
                + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)));
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
    use bristle_codegen::ir::special;
    use fastrand::Rng;

    use super::*;

    /// Value and its remainder, some 106 bits.
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

    /// Computes sine and cosine by power series in doubled precision, of `x` minus a multiple of
    /// π/2 with 159 bits.
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

    /// Returns the error of `value` in units in the last place of `expected`.
    fn error_in_ulp(value: f64, expected: Double) -> f64 {
        let magnitude = expected.0.abs();
        ((value - expected.0) - expected.1).abs() / (magnitude.next_up() - magnitude)
    }

    #[test]
    fn sine_and_cosine_are_within_one_ulp() {
        let mut rng = Rng::with_seed(1);
        let mut points = vec![
            0.0,
            f64::MIN_POSITIVE,
            5e-324,
            1e-310,
            1e-8,
            TRIGONOMETRIC_LIMIT,
        ];
        for _ in 0..40_000 {
            points.push(10.0 * rng.f64());
            points.push(TRIGONOMETRIC_LIMIT * rng.f64());
            // All exponents equally often, down to the smallest denormal.
            points.push(f64::from_bits(rng.u64(..TRIGONOMETRIC_LIMIT.to_bits())));
        }
        // Next to multiples of π/2, where the reduction cancels, and between two, where the
        // quadrant changes.
        for i in 0..40_000 {
            let multiple = if i < 1000 { i } else { rng.u32(..667_544) };
            for quarter in [0.0, 0.5] {
                let near = (f64::from(multiple) + quarter) * FRAC_PI_2;
                points.extend([near.next_down(), near, near.next_up()]);
            }
        }
        let mut worst = 0.0_f64;
        for x in points
            .into_iter()
            .filter(|x| (0.0..=TRIGONOMETRIC_LIMIT).contains(x))
        {
            let ((sine, cosine), (sine_of_negative, cosine_of_negative)) =
                (sin_cos(x), sin_cos(-x));
            let [sin, cos] = reference(x);
            let error = error_in_ulp(sine, sin).max(error_in_ulp(cosine, cos));
            assert!(error < 1.0, "{error} ulp at {x:e}");
            worst = worst.max(error);
            assert_eq!(
                (sine.to_bits(), cosine),
                ((-sine_of_negative).to_bits(), cosine_of_negative),
                "at {x:e}"
            );
        }
        // The polynomials alone have an error of some 0.6 ulp, and the result is rounded. Less
        // would mean that nothing is measured.
        assert!(worst > 0.5, "{worst}");
        println!("largest error: {worst} ulp");
    }

    #[test]
    fn beyond_the_limit_they_are_those_of_the_standard_library() {
        for x in [TRIGONOMETRIC_LIMIT.next_up(), -3e6, 1e22, f64::MAX] {
            assert_eq!(sin_cos(x), x.sin_cos());
        }
        for x in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            let (sin, cos) = sin_cos(x);
            assert!(sin.is_nan() && cos.is_nan());
        }
        assert!(sin_cos(-0.0).0.is_sign_negative());
    }

    fn half_angle_squared_agrees<const ORDER: u8>(tolerance: f64) {
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
            let value = half_angle_squared::<ORDER>(u);
            assert!(
                (value / expected - 1.0).abs() < tolerance || value == expected,
                "{u}: {value} {expected}"
            );
            if u.abs() <= SERIES_LIMIT {
                assert!(
                    (value / expected - 1.0).abs() < 4.0 * f64::EPSILON,
                    "{u}: {value} {expected}"
                );
            }
        }
        for u in [
            SERIES_LIMIT,
            SERIES_LIMIT.next_up(),
            0.5,
            0.5_f64.next_down(),
            1.0,
        ] {
            let value = half_angle_squared::<ORDER>(u);
            assert!(
                (value / special::half_angle_squared(ORDER, u) - 1.0).abs() < tolerance,
                "{u}"
            );
        }
        for u in [2.1, -0.1, f64::NAN, f64::INFINITY] {
            let value = half_angle_squared::<ORDER>(u);
            assert!(value.is_nan(), "{u}: {value}");
        }
    }

    #[test]
    fn half_angle_squared_is_as_precise_as_that_of_the_engine() {
        // Twice the bounds stated there: both sides have such an error.
        half_angle_squared_agrees::<0>(8e-15);
        half_angle_squared_agrees::<1>(8e-15);
        half_angle_squared_agrees::<2>(8e-15);
        half_angle_squared_agrees::<3>(4e-13);
        assert_eq!(half_angle_squared::<1>(2.0), f64::INFINITY);
    }
}
