//! First-order Sobol indices from samples that serve the band too.
//!
//! The index of an input is the share of the variance that its main effect has, the mean of the output over all other inputs:
//! `S_i = Var(E[y | x_i])/Var(y)` (Sobol 1993). Main effects are fitted as polynomials in the standard normal inputs, all at once by least
//! squares (after Sudret 2008), of the degree that predicts samples best which were left out of the fit. The variances are
//! those over the samples. What the effects leave over adds to that of an effect, on average, a share for each of its
//! coefficients, which is taken off.
//!
//! Pairs of samples that share one input (Saltelli 2010) need no polynomials, but six times the simulations for the same number of samples,
//! and are the less accurate for it: ARCHITECTURE.md has numbers.

use nalgebra::{DMatrix, DVector};

use super::mean_and_variance;

/// Highest degree of main effects.
const MAX_DEGREE: usize = 8;

/// The first-order indices of the inputs for `outputs` at `points`, in units of their variance. Zero if the outputs are all
/// the same.
pub(super) fn first_order(points: &[Vec<f64>], outputs: &[f64]) -> Vec<f64> {
    let inputs = points.first().map_or(0, Vec::len);
    let (mean, variance) = mean_and_variance(outputs);
    if variance == 0.0 {
        return vec![0.0; inputs];
    }
    if inputs == 1 {
        return vec![1.0];
    }
    let normed = DVector::from_iterator(outputs.len(), outputs.iter().map(|y| (y - mean) / variance.sqrt()));
    // At least two samples for each coefficient.
    let degrees = (1..=MAX_DEGREE).take_while(|degree| 2 * (1 + inputs * degree) <= points.len());
    let fits = degrees.filter_map(|degree| Fit::new(points, &normed, degree));
    let best = fits.min_by(|a, b| a.error.total_cmp(&b.error));
    // Samples of a sequence that fills space never make all fits singular.
    best.map_or_else(|| vec![0.0; inputs], |fit| fit.indices())
}

/// Main effects of one degree.
struct Fit {
    /// Variances of the effects, without what is left over has in them.
    variances: Vec<f64>,
    /// Variance that the effects leave over.
    left_over: f64,
    /// Mean square error of samples that are left out of the fit one by one.
    error: f64,
}

impl Fit {
    /// None if the samples do not tell the coefficients apart.
    fn new(points: &[Vec<f64>], outputs: &DVector<f64>, degree: usize) -> Option<Self> {
        let terms = 1 + points[0].len() * degree;
        let mut basis = DMatrix::zeros(points.len(), terms);
        for (row, point) in points.iter().enumerate() {
            basis[(row, 0)] = 1.0;
            for (input, &x) in point.iter().enumerate() {
                for (order, value) in hermite(x).into_iter().take(degree).enumerate() {
                    basis[(row, 1 + input * degree + order)] = value;
                }
            }
        }
        let qr = basis.clone().qr();
        let (orthogonal, upper) = (qr.q(), qr.r());
        let projected = orthogonal.tr_mul(outputs);
        let coefficients = upper.solve_upper_triangular(&projected)?;
        let residuals = outputs - &orthogonal * &projected;
        let left_out = |row: usize| residuals[row] / (1.0 - orthogonal.row(row).norm_squared());
        let squares: f64 = (0..points.len()).map(|row| left_out(row).powi(2)).sum();
        let left_over = residuals.norm_squared() / (points.len() - terms) as f64;
        let noise = left_over * degree as f64 / points.len() as f64;
        let variance = |input: usize| {
            let first = 1 + input * degree;
            let effect = basis.columns(first, degree) * coefficients.rows(first, degree);
            (mean_and_variance(effect.as_slice()).1 - noise).max(0.0)
        };
        let variances = (0..points[0].len()).map(variance).collect();
        Some(Self { variances, left_over, error: squares / points.len() as f64 })
    }

    /// The variances of the effects over that of all.
    fn indices(&self) -> Vec<f64> {
        let all = self.variances.iter().sum::<f64>() + self.left_over;
        self.variances.iter().map(|variance| variance / all).collect()
    }
}

/// Hermite polynomials of the degrees from 1 on, of variance 1 for a standard normal argument.
fn hermite(x: f64) -> [f64; MAX_DEGREE] {
    let mut polynomials = [0.0; MAX_DEGREE];
    let (mut before, mut last) = (0.0, 1.0);
    for (n, polynomial) in polynomials.iter_mut().enumerate() {
        let n = n as f64;
        (before, last) = (last, (x * last - n.sqrt() * before) / (n + 1.0).sqrt());
        *polynomial = last;
    }
    polynomials
}

#[cfg(test)]
mod tests {
    use super::super::standard_normal;
    use super::*;

    fn points(count: u32, inputs: u32, seed: u32) -> Vec<Vec<f64>> {
        (0..count).map(|index| (0..inputs).map(|input| standard_normal(index, input, seed)).collect()).collect()
    }

    #[test]
    fn polynomials_are_orthonormal() {
        // Gauss-Hermite quadrature would be exact; the trapezoidal rule is nearly so for what falls off as this does.
        let step = 1e-2;
        for i in 0..MAX_DEGREE {
            for j in 0..MAX_DEGREE {
                let at = |x: f64| hermite(x)[i] * hermite(x)[j] * (-0.5 * x * x).exp();
                let sum: f64 = (-1500..=1500).map(|k| at(f64::from(k) * step)).sum();
                let product = sum * step / std::f64::consts::TAU.sqrt();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product - expected).abs() < 1e-10, "{i} {j}: {product}");
            }
        }
    }

    /// Indices of `3 x₁ + 2 exp(x₂/2) + x₁x₂ + 2 x₁x₃`, of which the variances of all effects are known.
    #[test]
    fn indices_are_those_computed_by_hand() {
        let output = |x: &Vec<f64>| 3.0 * x[0] + 2.0 * (0.5 * x[1]).exp() + x[0] * x[1] + 2.0 * x[0] * x[2];
        // Var exp(x/2) = e^(1/2) − e^(1/4), and the two products have the variances 1 and 4.
        let exponential = 4.0 * (0.5_f64.exp() - 0.25_f64.exp());
        let variance = 9.0 + exponential + 1.0 + 4.0;
        let expected = [9.0 / variance, exponential / variance, 0.0, 0.0];
        for (count, tolerance) in [(128, 0.08), (1024, 0.02), (1 << 14, 0.005)] {
            for seed in 0..8 {
                let points = points(count, 4, seed);
                let outputs: Vec<f64> = points.iter().map(output).collect();
                let found = first_order(&points, &outputs);
                for (found, expected) in found.iter().zip(expected) {
                    assert!(
                        (found - expected).abs() < tolerance,
                        "{count} samples, seed {seed}: {found}, not {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn an_additive_output_needs_few_samples() {
        let points = points(64, 3, 5);
        let outputs: Vec<f64> = points.iter().map(|x| 1e9 + 2.0 * x[0] - x[1]).collect();
        let found = first_order(&points, &outputs);
        // What is left is the sampling error of the variances themselves.
        for (found, expected) in found.iter().zip([0.8, 0.2, 0.0]) {
            assert!((found - expected).abs() < 0.05, "{found}, not {expected}");
        }
    }

    /// Only what the inputs do together is left over, if the effects are no polynomials either.
    #[test]
    fn kinks_are_attributed_to_their_input() {
        let (points, mean, second) = (points(1024, 2, 3), 1.0 / std::f64::consts::TAU.sqrt(), 0.5);
        let outputs: Vec<f64> = points.iter().map(|x| x[0].max(0.0) + 0.2 * x[1]).collect();
        let kink = second - mean * mean;
        let found = first_order(&points, &outputs);
        for (found, variance) in found.iter().zip([kink, 0.04]) {
            let expected = variance / (kink + 0.04);
            assert!((found - expected).abs() < 0.02, "{found}, not {expected}");
        }
    }

    #[test]
    fn one_input_has_all_of_the_variance() {
        let points = points(64, 1, 0);
        let outputs: Vec<f64> = points.iter().map(|x| if x[0] > 1.0 { 1.0 } else { 0.0 }).collect();
        assert_eq!(first_order(&points, &outputs), [1.0]);
    }

    #[test]
    fn what_does_not_vary_has_no_indices() {
        assert_eq!(first_order(&points(64, 2, 0), &[3.0; 64]), [0.0, 0.0]);
    }
}
