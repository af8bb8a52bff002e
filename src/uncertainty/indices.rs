//! First-order Sobol indices from samples that serve the band too.
//!
//! The index of an input is the share of the variance that its main effect has, the mean of the output over all other inputs:
//! `S_i = Var(E[y | x_i])/Var(y)` (Sobol 1993). Main effects are fitted as polynomials in the standard normal inputs, all at once by least
//! squares; in orthonormal (Hermite) polynomials the variance of an effect is the sum of its squared coefficients (Sudret
//! 2008). What the effects leave over, interactions, adds to the squares on average the variance of the coefficients, which
//! is taken off.
//!
//! Pairs of samples that share one input (Saltelli 2010) need no polynomials, but six times the simulations for the same number of samples,
//! and are the less accurate for it: ARCHITECTURE.md has numbers.

use nalgebra::{DMatrix, DVector};

use super::mean_and_variance;

/// Degree of the main effects.
const DEGREE: usize = 3;

/// The first-order indices of the inputs for `outputs` at `points`, in units of their variance. Zero if the outputs are all
/// the same.
pub(super) fn first_order(points: &[Vec<f64>], outputs: &[f64]) -> Vec<f64> {
    let inputs = points.first().map_or(0, Vec::len);
    let (mean, variance) = mean_and_variance(outputs);
    if variance == 0.0 {
        return vec![0.0; inputs];
    }
    let normed = DVector::from_iterator(outputs.len(), outputs.iter().map(|y| (y - mean) / variance.sqrt()));
    let terms = 1 + inputs * DEGREE;
    let basis = DMatrix::from_fn(points.len(), terms, |row, column| match column.checked_sub(1) {
        None => 1.0,
        Some(term) => hermite(1 + term % DEGREE, points[row][term / DEGREE]),
    });
    let qr = basis.clone().qr();
    let mut projected = normed.clone();
    qr.q_tr_mul(&mut projected);
    let upper = qr.r();
    let solved = upper.solve_upper_triangular(&projected.rows(0, terms)).zip(inverse(&upper));
    // Samples of a sequence that fills space never make the basis singular.
    let Some((coefficients, inverse)) = solved else { return vec![0.0; inputs] };
    // The rest of the rotated outputs is what the fit leaves over.
    let left_over = projected.rows(terms, points.len() - terms).norm_squared() / (points.len() - terms) as f64;
    let share = |input: usize| {
        let own = 1 + input * DEGREE..1 + (input + 1) * DEGREE;
        let squares: f64 = own.clone().map(|term| coefficients[term].powi(2)).sum();
        let noise: f64 = own.map(|term| inverse.row(term).norm_squared()).sum();
        (squares - left_over * noise).clamp(0.0, 1.0)
    };
    (0..inputs).map(share).collect()
}

/// The inverse of an upper triangular matrix, none if it is singular.
fn inverse(upper: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    upper.solve_upper_triangular(&DMatrix::identity(upper.nrows(), upper.ncols()))
}

/// Hermite polynomial of degree 1 to 3, of variance 1 for a standard normal argument.
fn hermite(degree: usize, x: f64) -> f64 {
    match degree {
        1 => x,
        2 => (x * x - 1.0) / 2.0_f64.sqrt(),
        _ => x * (x * x - 3.0) / 6.0_f64.sqrt(),
    }
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
        let points = points(1 << 14, 1, 0);
        for i in 1..=DEGREE {
            for j in 1..=DEGREE {
                let product: f64 = points.iter().map(|x| hermite(i, x[0]) * hermite(j, x[0])).sum::<f64>();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product / points.len() as f64 - expected).abs() < 0.02, "{i} {j}: {product}");
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

    #[test]
    fn what_does_not_vary_has_no_indices() {
        assert_eq!(first_order(&points(64, 2, 0), &[3.0; 64]), [0.0, 0.0]);
    }
}
