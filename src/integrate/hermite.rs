//! Quintic Hermite interpolation between two points with first and second derivatives.

use std::array::from_fn;

use crate::equations::linear::{add, sub};

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

/// Weights of the knots at the ends of a step in the value and the first derivative at one place in
/// it.
///
/// They belong to the polynomial of degree five through both knots, whose error is O(step⁶).
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Weights of the rise of the value, the two rates and the two accelerations.
    value: [f64; 5],
    rate: [f64; 5],
}

impl Weights {
    /// Computes the weights at the fraction `s ∈ [0, 1]` of a step of the length `step`.
    pub fn new(step: f64, s: f64) -> Self {
        let left = 1.0 - s;
        let [square, left_square] = [s * s, left * left];
        let value = [
            square * s * (10.0 - 15.0 * s + 6.0 * square),
            step * s * left * left_square * (1.0 + 3.0 * s),
            -step * square * s * left * (4.0 - 3.0 * s),
            step * step / 2.0 * square * left * left_square,
            step * step / 2.0 * square * s * left_square,
        ];
        let rate = [
            30.0 / step * square * left_square,
            left_square * (1.0 + 2.0 * s - 15.0 * square),
            -square * (12.0 - 28.0 * s + 15.0 * square),
            step * s * left_square * (1.0 - 2.5 * s),
            step * square * left * (1.5 - 2.5 * s),
        ];
        Self { value, rate }
    }

    /// Returns value and first derivative between two knots.
    pub fn interpolate<const N: usize>(
        &self,
        start: &Knot<N>,
        end: &Knot<N>,
    ) -> ([f64; N], [f64; N]) {
        let rise = sub(end.value, start.value);
        let sum = |[a, b, c, d, e]: [f64; 5]| -> [f64; N] {
            from_fn(|i| {
                a * rise[i]
                    + (b * start.rate[i] + c * end.rate[i])
                    + (d * start.acceleration[i] + e * end.acceleration[i])
            })
        };
        (add(start.value, sum(self.value)), sum(self.rate))
    }
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
            let (value, rate) = Weights::new(1.5, s).interpolate(&start, &end);
            let expected = knot(0.5 + 1.5 * s);
            assert!((value[0] - expected.value[0]).abs() < 1e-12);
            assert!((rate[0] - expected.rate[0]).abs() < 1e-12);
        }
    }
}
