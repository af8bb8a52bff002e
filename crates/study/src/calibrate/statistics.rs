//! Uncertainty of the settings at a minimum: covariance, correlations, singular values, and
//! settings that are not determined.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::calibrate::parameters::Fitted;
use crate::calibrate::problem::Problem;
use crate::text::number::percent;

/// Relative standard error above which a value is not determined.
const MAX_RELATIVE_ERROR: f64 = 0.5;
/// Share of its range that replaces a smaller value of a setting that may be zero.
const MIN_SIZE_SHARE: f64 = 0.05;
/// Correlation above which two settings are not determined one by one.
const MAX_CORRELATION: f64 = 0.99;
/// Least singular value over the largest: below it derivatives are rounding errors.
const MIN_SINGULAR_RATIO: f64 = 1e-8;
/// Distance from a whole number up to which an exponent is printed as one.
const WHOLE_TOLERANCE: f64 = 0.06;

/// Errors at a minimum by the linear theory, in coordinates.
#[derive(Clone, Debug)]
pub struct Errors {
    /// Covariance of the coordinates, before it is scaled by the residuals: `(JᵀJ)⁻¹`.
    pub unscaled: DMatrix<f64>,
    /// Factor of the covariance from the residuals: at least 1 if standard deviations are stated.
    pub scale: f64,
    /// Singular values of the Jacobian of the residuals over the coordinates, the largest first.
    pub singular_values: Vec<f64>,
}

impl Errors {
    /// Computes the errors from a Jacobian.
    #[must_use]
    pub fn of(jacobian: &DMatrix<f64>, scale: f64) -> Self {
        let decomposed = jacobian.clone().svd(false, true);
        let right = decomposed.v_t.expect("it was asked for").transpose();
        let values = decomposed.singular_values;
        let least = MIN_SINGULAR_RATIO * values.max();
        let inverse = values.map(|value| {
            if value > 0.0 {
                value.max(least).powi(-2)
            } else {
                least.max(f64::MIN_POSITIVE).powi(-2)
            }
        });
        let unscaled = &right * DMatrix::from_diagonal(&inverse) * right.transpose();
        let mut singular_values: Vec<f64> = values.iter().copied().collect();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        Self {
            unscaled,
            scale,
            singular_values,
        }
    }

    /// Returns the covariance of the coordinates.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        &self.unscaled * self.scale
    }

    /// Returns the standard error of a coordinate.
    #[must_use]
    pub fn standard_error(&self, column: usize) -> f64 {
        (self.unscaled[(column, column)] * self.scale).sqrt()
    }

    /// Returns the correlation of two coordinates.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> f64 {
        if a == b {
            return 1.0;
        }
        // The inverse is symmetric up to rounding only.
        let (a, b) = (a.min(b), a.max(b));
        self.unscaled[(a, b)] / (self.unscaled[(a, a)] * self.unscaled[(b, b)]).sqrt()
    }
}

/// Settings that the forces do not determine.
#[derive(Clone, Debug, PartialEq)]
pub struct Undetermined {
    /// Positions among the fitted settings.
    pub settings: Vec<usize>,
    /// Joint change of the coordinates while forces hardly change, the largest 1.
    pub direction: Vec<f64>,
    /// Exponents of a determined product of two positive settings, the first 1, and its relative
    /// standard error.
    pub product: Option<([f64; 2], f64)>,
    /// Statement in words.
    pub statement: String,
}

/// Returns the settings with `values` that are not determined, in groups that each have a
/// direction.
#[must_use]
pub fn undetermined(problem: &Problem, values: &[f64], errors: &Errors) -> Vec<Undetermined> {
    let count = values.len();
    let is_meaningless = |column: usize| {
        let fitted = &problem.fitted[column];
        let [low, high] = fitted.bounds;
        let error = errors.standard_error(column) * fitted.slope(values[column]);
        let size = if fitted.is_logarithmic() {
            values[column]
        } else {
            values[column].abs().max(MIN_SIZE_SHARE * (high - low))
        };
        error > MAX_RELATIVE_ERROR * size
    };
    let is_alike = |a: usize, b: usize| errors.correlation(a, b).abs() > MAX_CORRELATION;
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for column in 0..count {
        let partners = (0..count).any(|other| other != column && is_alike(column, other));
        if !partners && !is_meaningless(column) {
            continue;
        }
        match groups
            .iter_mut()
            .find(|group| group.iter().any(|&other| is_alike(column, other)))
        {
            Some(group) => group.push(column),
            None => groups.push(vec![column]),
        }
    }
    groups
        .into_iter()
        .map(|settings| described(problem, values, errors, settings))
        .collect()
}

/// Describes a group of settings that change together.
fn described(
    problem: &Problem,
    values: &[f64],
    errors: &Errors,
    settings: Vec<usize>,
) -> Undetermined {
    let block = DMatrix::from_fn(settings.len(), settings.len(), |row, column| {
        errors.unscaled[(settings[row], settings[column])] * errors.scale
    });
    let eigen = SymmetricEigen::new(block.clone());
    let weakest = eigen.eigenvalues.imax();
    let vector = eigen.eigenvectors.column(weakest).clone_owned();
    let direction: Vec<f64> = (&vector / vector[vector.iamax()]).iter().copied().collect();
    let fitted: Vec<&Fitted> = settings
        .iter()
        .map(|&column| &problem.fitted[column])
        .collect();
    let symbol = |fitted: &Fitted| fitted.setting().symbol().into_owned();
    let mut product = None;
    let mut statement = match &fitted[..] {
        [only] => {
            let [low, high] = only.bounds.map(|bound| only.setting().text(bound));
            format!(
                "{} is not determined: it could be anywhere between {low} and {high}",
                symbol(only)
            )
        }
        _ => {
            let change = |(fitted, direction): (&&Fitted, &f64)| match fitted.is_logarithmic() {
                true => format!(
                    "{} by {:+.0} %",
                    symbol(fitted),
                    100.0 * ((0.1 * direction).exp() - 1.0)
                ),
                false => format!(
                    "{} by {:+.3}",
                    symbol(fitted),
                    0.1 * direction * fitted.slope(0.0)
                ),
            };
            let changes: Vec<String> = fitted.iter().zip(&direction).map(change).collect();
            let symbols: Vec<String> = fitted.iter().map(|fitted| symbol(fitted)).collect();
            format!(
                "{} are not determined one by one: {} stay the same if one changes {}",
                symbols.join(" and "),
                problem.measured(),
                changes.join(" and ")
            )
        }
    };
    if let ([a, b], [change_a, change_b]) = (&fitted[..], &direction[..])
        && a.is_logarithmic()
        && b.is_logarithmic()
        && change_b.abs() > 1e-6
    {
        let exponent = -change_a / change_b;
        let weights = DVector::from_vec(vec![1.0, exponent]);
        let error = (weights.transpose() * &block * &weights)[(0, 0)]
            .max(0.0)
            .sqrt();
        let value = values[settings[0]] * values[settings[1]].powf(exponent);
        product = Some(([1.0, exponent], error)).filter(|_| value.is_finite());
        let [a, b] = [a, b].map(|fitted| symbol(fitted));
        statement = format!(
            "{a} and {b}: only {a} {b}{} (known to {})",
            power(exponent),
            percent(error)
        );
    }
    Undetermined {
        settings,
        direction,
        product,
        statement,
    }
}

/// Formats an exponent behind a symbol: superscript digits for a whole number.
fn power(exponent: f64) -> String {
    let whole = exponent.round();
    if (exponent - whole).abs() > WHOLE_TOLERANCE * whole.abs().max(1.0) {
        return format!("^{exponent:.2}");
    }
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |letter: char| {
        letter
            .to_digit(10)
            .map_or('⁻', |digit| DIGITS[digit as usize])
    };
    if whole == 1.0 {
        String::new()
    } else {
        format!("{whole:.0}").chars().map(digit).collect()
    }
}
