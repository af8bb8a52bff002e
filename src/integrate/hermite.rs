//! Quintic Hermite interpolation between two points with first and second derivatives.

use crate::equations::linear::{add, scale, sub};

/// Value, first and second derivative of a vector at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot<const N: usize> {
    /// Value.
    pub value: [f64; N],
    /// First derivative.
    pub rate: [f64; N],
    /// Second derivative.
    pub acceleration: [f64; N],
}

/// Value and first derivative at the fraction `s ∈ [0, 1]` of a step of the length `step`.
///
/// The polynomial of degree five that meets both knots; its error is O(step⁶).
pub fn interpolate<const N: usize>(start: &Knot<N>, end: &Knot<N>, step: f64, s: f64) -> ([f64; N], [f64; N]) {
    // In Newton's form around the start: x0 + v0 τ + a0 τ²/2 + s³ (A + B s + C s²), τ = s step.
    let rise =
        sub(sub(sub(end.value, start.value), scale(step, start.rate)), scale(step * step / 2.0, start.acceleration));
    let slope = sub(scale(step, sub(end.rate, start.rate)), scale(step * step, start.acceleration));
    let bend = scale(step * step, sub(end.acceleration, start.acceleration));
    let cubic = add(sub(scale(10.0, rise), scale(4.0, slope)), scale(0.5, bend));
    let quartic = sub(sub(scale(7.0, slope), scale(15.0, rise)), bend);
    let quintic = add(sub(scale(6.0, rise), scale(3.0, slope)), scale(0.5, bend));

    let tau = s * step;
    let smooth = add(start.value, add(scale(tau, start.rate), scale(tau * tau / 2.0, start.acceleration)));
    let higher = scale(s * s * s, add(cubic, add(scale(s, quartic), scale(s * s, quintic))));
    let higher_rate =
        scale(s * s / step, add(scale(3.0, cubic), add(scale(4.0 * s, quartic), scale(5.0 * s * s, quintic))));
    (add(smooth, higher), add(add(start.rate, scale(tau, start.acceleration)), higher_rate))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reproduces_a_quintic() {
        let knot = |t: f64| Knot {
            value: [t.powi(5) - 2.0 * t.powi(3) + t],
            rate: [5.0 * t.powi(4) - 6.0 * t * t + 1.0],
            acceleration: [20.0 * t.powi(3) - 12.0 * t],
        };
        let (start, end) = (knot(0.5), knot(2.0));
        for s in [0.0, 0.3, 0.8, 1.0] {
            let (value, rate) = interpolate(&start, &end, 1.5, s);
            let expected = knot(0.5 + 1.5 * s);
            assert!((value[0] - expected.value[0]).abs() < 1e-12);
            assert!((rate[0] - expected.rate[0]).abs() < 1e-12);
        }
    }
}
