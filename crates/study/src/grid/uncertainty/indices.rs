//! First-order Sobol indices from the samples that also give the band.
//!
//! The main effect of an input is the mean of the output over all other inputs. The index of the
//! input is the share of the variance that its main effect has: `S_i = Var(E[y | x_i])/Var(y)`
//! (Sobol 1993). All main effects are fitted together by least squares. Each is a polynomial in the
//! standard normal input, or piecewise linear where the output has kinks or steps, for example
//! where some tools do not reach the workpiece. Each input takes the form that best predicts
//! samples left out of the fit. On average, the residuals increase the variance of an effect by a
//! share for each of its coefficients. This bias is subtracted.
//!
//! Pairs of samples that share one input (Saltelli 2010) need no fit. They take six times the
//! simulations for the same number of samples, and are less accurate at equal cost: docs/trust.md
//! has numbers.

use nalgebra::{DMatrix, DVector};
use spec_math::cephes64::ndtri;

/// Forms of a main effect, from stiff to flexible.
const FORMS: [MainEffectBasis; 6] = [
    MainEffectBasis::Polynomial(1),
    MainEffectBasis::Polynomial(2),
    MainEffectBasis::Polynomial(3),
    MainEffectBasis::Pieces(5),
    MainEffectBasis::Pieces(9),
    MainEffectBasis::Pieces(17),
];
/// Number of times that each input chooses its form: first given the choices of the inputs before
/// it, then given those of all inputs.
const SELECTION_ROUNDS: usize = 2;

/// Returns the first-order indices of the inputs for `outputs` at `points`, in units of their
/// variance. Zero if all outputs are equal.
pub(super) fn first_order(points: &[Vec<f64>], outputs: &[f64]) -> Vec<f64> {
    let inputs = points.first().map_or(0, Vec::len);
    let (mean, variance) = mean_and_variance(outputs);
    if variance == 0.0 {
        return vec![0.0; inputs];
    }
    if inputs == 1 {
        return vec![1.0];
    }
    let normed = DVector::from_iterator(
        outputs.len(),
        outputs.iter().map(|y| (y - mean) / variance.sqrt()),
    );
    let mut forms = vec![FORMS[0]; inputs];
    let mut best = Fit::new(points, &normed, &forms);
    for input in (0..SELECTION_ROUNDS).flat_map(|_| 0..inputs) {
        for form in FORMS {
            let mut others = forms.clone();
            others[input] = form;
            let fit = Fit::new(points, &normed, &others);
            let is_better = |fit: &Fit| best.as_ref().is_none_or(|best| fit.error < best.error);
            if fit.as_ref().is_some_and(is_better) {
                (forms, best) = (others, fit);
            }
        }
    }
    // Samples of a space-filling sequence always determine straight lines.
    best.map_or_else(|| vec![0.0; inputs], |fit| fit.indices())
}

/// Returns mean and variance (with n − 1) of at least two numbers.
pub(super) fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / (count - 1.0);
    (mean, variance)
}

/// The functions of an input that, with a constant, make up a main effect.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MainEffectBasis {
    /// Polynomials up to a degree.
    Polynomial(usize),
    /// Piecewise linear function whose pieces hold equal numbers of samples.
    Pieces(usize),
}

impl MainEffectBasis {
    /// Returns the functions at `x`.
    fn values(self, x: f64) -> impl Iterator<Item = f64> {
        (0..self.terms()).map(move |term| match self {
            Self::Polynomial(_) => x.powi(term as i32 + 1),
            Self::Pieces(_) if term == 0 => x,
            Self::Pieces(pieces) => (x - ndtri(term as f64 / pieces as f64)).max(0.0),
        })
    }

    /// Returns the number of functions.
    fn terms(self) -> usize {
        match self {
            Self::Polynomial(terms) | Self::Pieces(terms) => terms,
        }
    }
}

/// Main effects of some forms.
struct Fit {
    /// Variances of the effects, corrected for the residuals.
    variances: Vec<f64>,
    /// Variance of the residuals.
    left_over: f64,
    /// Mean square error of samples left out of the fit one by one.
    error: f64,
}

impl Fit {
    /// Fits the effects. `None` for fewer than two samples per coefficient, or samples that do not
    /// determine the coefficients.
    fn new(points: &[Vec<f64>], outputs: &DVector<f64>, forms: &[MainEffectBasis]) -> Option<Self> {
        let terms = 1 + forms.iter().map(|form| form.terms()).sum::<usize>();
        if 2 * terms > points.len() {
            return None;
        }
        let row = |point: &Vec<f64>| {
            let effects = point
                .iter()
                .zip(forms)
                .flat_map(|(&x, form)| form.values(x));
            std::iter::once(1.0).chain(effects).collect::<Vec<_>>()
        };
        let basis = DMatrix::from_row_iterator(points.len(), terms, points.iter().flat_map(row));
        let qr = basis.clone().qr();
        let (orthogonal, upper) = (qr.q(), qr.r());
        let projected = orthogonal.tr_mul(outputs);
        let coefficients = upper.solve_upper_triangular(&projected)?;
        let residuals = outputs - &orthogonal * &projected;
        let left_out = |row: usize| residuals[row] / (1.0 - orthogonal.row(row).norm_squared());
        let squares: f64 = (0..points.len()).map(|row| left_out(row).powi(2)).sum();
        let left_over = residuals.norm_squared() / (points.len() - terms) as f64;
        let mut first = 1;
        let variance = |form: &MainEffectBasis| {
            let effect =
                basis.columns(first, form.terms()) * coefficients.rows(first, form.terms());
            first += form.terms();
            let noise = left_over * form.terms() as f64 / points.len() as f64;
            (mean_and_variance(effect.as_slice()).1 - noise).max(0.0)
        };
        let variances = forms.iter().map(variance).collect();
        Some(Self {
            variances,
            left_over,
            error: squares / points.len() as f64,
        })
    }

    /// Returns the variances of the effects divided by the total variance.
    fn indices(&self) -> Vec<f64> {
        let all = self.variances.iter().sum::<f64>() + self.left_over;
        self.variances
            .iter()
            .map(|variance| variance / all)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::scatter::standard_normal;
    use super::*;

    fn points(count: u32, inputs: u32, seed: u32) -> Vec<Vec<f64>> {
        (0..count)
            .map(|index| {
                (0..inputs)
                    .map(|input| standard_normal(index, input, seed))
                    .collect()
            })
            .collect()
    }

    /// Indices of `3 x₁ + 2 exp(x₂/2) + x₁x₂ + 2 x₁x₃`. The variances of all its effects are known.
    #[test]
    fn indices_are_those_computed_by_hand() {
        let output =
            |x: &Vec<f64>| 3.0 * x[0] + 2.0 * (0.5 * x[1]).exp() + x[0] * x[1] + 2.0 * x[0] * x[2];
        // Var exp(x/2) = e^(1/2) − e^(1/4), and the two products have the variances 1 and 4.
        let exponential = 4.0 * (0.5_f64.exp() - 0.25_f64.exp());
        let variance = 9.0 + exponential + 1.0 + 4.0;
        let expected = [9.0 / variance, exponential / variance, 0.0, 0.0];
        for (count, tolerance, seeds) in [(128, 0.08, 8), (1024, 0.02, 8), (1 << 14, 0.005, 2)] {
            for seed in 0..seeds {
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
        // The remaining error is the sampling error of the variances themselves.
        for (found, expected) in found.iter().zip([0.8, 0.2, 0.0]) {
            assert!((found - expected).abs() < 0.05, "{found}, not {expected}");
        }
    }

    /// Only interactions of the inputs are left over, even if the effects are not polynomials.
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
        let outputs: Vec<f64> = points
            .iter()
            .map(|x| if x[0] > 1.0 { 1.0 } else { 0.0 })
            .collect();
        assert_eq!(first_order(&points, &outputs), [1.0]);
    }

    #[test]
    fn what_does_not_vary_has_no_indices() {
        assert_eq!(first_order(&points(64, 2, 0), &[3.0; 64]), [0.0, 0.0]);
    }
}
