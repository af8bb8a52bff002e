//! The only special function of the model: `S(u) = ½α²` of `u = 1 − cos α`.
//!
//! A bending spring stores `½ c α²`, where `α ∈ [0, π)` is the angle between two directions.
//! Through `α = arccos(e·e')` its derivatives are singular at the straight joint, although the
//! energy is analytic there. Written in `u = 1 − cos α = ½|e − e'|²` it is
//!
//! ```text
//! S(u) = ½ arccos²(1 − u) = Σ_{j≥1} 2^j u^j / (j² C(2j, j)) = u + u²/6 + 2u³/45 + …,   |u| < 2,
//! ```
//!
//! and every derivative is finite and exact at `u = 0`. The function obeys `u(2−u) S″ + (1−u) S′ =
//! 1`; differentiated `k` times this gives each derivative from the two below it,
//!
//! ```text
//! u(2−u) S^(k+2) = [k = 0] + k² S^(k) − (2k+1)(1−u) S^(k+1).
//! ```
//!
//! Near `u = 0` that recurrence cancels, so the power series replaces it there.

/// Largest `u` for which the series is summed (`α < 0.355`); the closed form is accurate above.
pub const SERIES_LIMIT: f64 = 1.0 / 16.0;

/// Order of the highest derivative of `S` that is defined.
pub const MAX_ORDER: u8 = 3;

/// Number of terms that bring the truncated series below one rounding error for
/// `|u| ≤ SERIES_LIMIT` and every order.
pub const TERMS: usize = 14;

const fn series(order: usize) -> [f64; TERMS] {
    // a_{j+1} = a_j j² / ((j+1)(2j+1)), a_1 = 1; the derivative multiplies by j (j−1) ….
    let mut result = [0.0; TERMS];
    let mut coefficient = 1.0;
    let mut j = 1;
    while j < TERMS + order {
        if j >= order {
            let mut factor = 1.0;
            let mut k = 0;
            while k < order {
                factor *= (j - k) as f64;
                k += 1;
            }
            result[j - order] = coefficient * factor;
        }
        coefficient *= (j * j) as f64 / ((j + 1) * (2 * j + 1)) as f64;
        j += 1;
    }
    result
}

/// Power series of `S`, `S′`, `S″`, `S‴`, lowest power first.
pub const SERIES: [[f64; TERMS]; MAX_ORDER as usize + 1] =
    [series(0), series(1), series(2), series(3)];

/// The `order`-th derivative of `S(u) = ½ arccos²(1 − u)`, for `u < 2`.
///
/// The relative error is below 4e-15 up to the second derivative and 2e-13 for the third. For `u ≥
/// 2` (a joint that is folded back on itself, `α = π`) the value is infinite or NaN: `S′` has a
/// pole there.
///
/// # Panics
/// If `order` exceeds [`MAX_ORDER`].
#[inline]
pub fn half_angle_squared(order: u8, u: f64) -> f64 {
    if u.abs() <= SERIES_LIMIT {
        let coefficients = &SERIES[order as usize];
        return coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, coefficient| sum * u + coefficient);
    }
    let cos = 1.0 - u;
    let sin_squared = u * (2.0 - u);
    let sin = sin_squared.sqrt();
    let angle = sin.atan2(cos);
    if order == 0 {
        return 0.5 * angle * angle;
    }
    let first = angle / sin;
    if order == 1 {
        return first;
    }
    let second = (1.0 - cos * first) / sin_squared;
    if order == 2 {
        return second;
    }
    assert!(
        order == 3,
        "half_angle_squared: order {order} is not defined"
    );
    (first - 3.0 * cos * second) / sin_squared
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_the_angle_and_its_known_derivatives() {
        for i in 1..310 {
            let angle = f64::from(i) * 0.01;
            let u = 2.0 * (angle / 2.0).sin().powi(2);
            let expected = [
                angle * angle / 2.0,
                angle / angle.sin(),
                (angle.sin() - angle * angle.cos()) / angle.sin().powi(3),
            ];
            // The closed forms above cancel at small angles, and S′ is ill-conditioned near the
            // fold.
            let tolerance =
                1e-13 / angle.powi(3).min(1.0) / (std::f64::consts::PI - angle).min(1.0);
            for (order, expected) in expected.into_iter().enumerate() {
                let value = half_angle_squared(order as u8, u);
                assert!(
                    (value / expected - 1.0).abs() < tolerance,
                    "order {order}, α = {angle}: {value} {expected}"
                );
            }
        }
    }

    #[test]
    fn is_exact_at_the_straight_joint() {
        let values = [0, 1, 2, 3].map(|order| half_angle_squared(order, 0.0));
        for (value, expected) in values.into_iter().zip([0.0, 1.0, 1.0 / 3.0, 4.0 / 15.0]) {
            assert!(
                (value - expected).abs() <= f64::EPSILON,
                "{value} {expected}"
            );
        }
    }

    #[test]
    fn series_and_closed_form_meet() {
        for order in 0..=MAX_ORDER {
            let (below, above) = (SERIES_LIMIT, SERIES_LIMIT * (1.0 + f64::EPSILON));
            let (series, closed) = (
                half_angle_squared(order, below),
                half_angle_squared(order, above),
            );
            let tolerance = if order < 3 { 4e-15 } else { 2e-13 };
            assert!(
                (series / closed - 1.0).abs() < tolerance,
                "order {order}: {series} {closed}"
            );
        }
    }
}
