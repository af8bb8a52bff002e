//! Joint uncertainty of the settings that a calibration has fitted (MODEL, "Calibration").

use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{CalibrationUncertainty, Settings};

/// Path of the section.
pub const PATH: &str = "uncertainty.calibration";
/// Sections whose settings can be fitted.
const SECTIONS: [&str; 4] = ["tool", "filament", "contact", "brush"];
/// Largest negative pivot of a correlation matrix, from the rounding of its entries.
const MAX_NEGATIVE_PIVOT: f64 = 1e-4;

/// Checks that the uncertainty is one of settings that can be fitted.
///
/// # Errors
/// The first violation.
pub fn check(calibration: &CalibrationUncertainty) -> Result<(), Violation> {
    let wrong = |value: String, allowed: &str| {
        Err(Violation {
            path: PATH,
            value,
            allowed: allowed.to_owned(),
        })
    };
    let count = calibration.settings.len();
    for (position, path) in calibration.settings.iter().enumerate() {
        let is_it = |parameter: &&Parameter| {
            SECTIONS.contains(&parameter.section()) && !parameter.range.whole
        };
        if Parameter::find(path).filter(is_it).is_none()
            || calibration.settings[..position].contains(path)
        {
            return wrong(
                format!("of `{path}`"),
                "of scalar settings of [tool], [filament], [contact] and [brush], each once",
            );
        }
    }
    if calibration.standard_errors.len() != count
        || !calibration
            .standard_errors
            .iter()
            .all(|error| error.is_finite() && *error >= 0.0)
    {
        return wrong(
            format!("{:?}", calibration.standard_errors),
            "one standard error of at least 0 for each setting",
        );
    }
    if !(0.0..1.0).contains(&calibration.misfit) {
        return wrong(
            format!("with `misfit = {:?}`", calibration.misfit),
            "such that `misfit` is at least 0 and below 1",
        );
    }
    let is_correlation = |row: usize, column: usize| {
        let own = calibration.correlations[row][column];
        own.abs() <= 1.0
            && (row != column || own == 1.0)
            && own == calibration.correlations[column][row]
    };
    let is_square = calibration.correlations.len() == count
        && calibration
            .correlations
            .iter()
            .all(|row| row.len() == count);
    if !is_square || !(0..count).all(|row| (0..count).all(|column| is_correlation(row, column))) {
        return wrong(
            "a matrix that is none of correlations".to_owned(),
            "such that `correlations` has a row and a column for each setting, is symmetric, and has ones on its diagonal",
        );
    }
    if factor(calibration).is_none() {
        return wrong(
            "a matrix that is not positive".to_owned(),
            "such that `correlations` can be those of random numbers",
        );
    }
    Ok(())
}

/// Returns the Cholesky factor of the correlations, a lower triangle; `None` if there is none.
fn factor(calibration: &CalibrationUncertainty) -> Option<Vec<Vec<f64>>> {
    let count = calibration.settings.len();
    let mut factor = vec![vec![0.0; count]; count];
    for row in 0..count {
        for column in 0..=row {
            let known: f64 = (0..column)
                .map(|k| factor[row][k] * factor[column][k])
                .sum();
            let rest = calibration.correlations[row][column] - known;
            factor[row][column] = if row != column {
                if factor[column][column] > 0.0 {
                    rest / factor[column][column]
                } else {
                    0.0
                }
            } else if rest >= -MAX_NEGATIVE_PIVOT {
                rest.max(0.0).sqrt()
            } else {
                return None;
            };
        }
    }
    Some(factor)
}

/// Changes the fitted settings to those of a sample, by as many independent standard normal
/// numbers. Without a section `[brush]` in `settings`, values of that section are left out.
pub fn sample(calibration: &CalibrationUncertainty, settings: &mut Settings, numbers: &[f64]) {
    let factor = factor(calibration).unwrap_or_default();
    for ((path, error), row) in calibration
        .settings
        .iter()
        .zip(&calibration.standard_errors)
        .zip(&factor)
    {
        let Some(parameter) = Parameter::find(path) else {
            continue;
        };
        if parameter.section() == "brush" && settings.brush.is_none() {
            continue;
        }
        let deviation: f64 = row
            .iter()
            .zip(numbers)
            .map(|(factor, number)| factor * number)
            .sum();
        let mean = parameter.get(settings);
        let is_positive = mean > 0.0 && parameter.usual.is_some_and(|usual| usual.least > 0.0);
        let value = if is_positive {
            mean * (deviation * error / mean).exp()
        } else {
            mean + deviation * error
        };
        parameter.set(settings, parameter.range.nearest(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uncertainty(correlation: f64) -> CalibrationUncertainty {
        CalibrationUncertainty {
            settings: ["filament.youngs_modulus_pa", "contact.friction_coefficient"]
                .map(str::to_owned)
                .into(),
            standard_errors: vec![0.3e9, 0.1],
            correlations: vec![vec![1.0, correlation], vec![correlation, 1.0]],
            misfit: 0.0,
        }
    }

    #[test]
    fn samples_have_the_errors_and_the_correlation() {
        let uncertainty = uncertainty(0.6);
        let sampled = |numbers: [f64; 2]| {
            let mut settings = Settings::paper(10.0, 1e-3);
            settings.contact.friction_coefficient = 0.3;
            sample(&uncertainty, &mut settings, &numbers);
            (
                settings.filament.youngs_modulus_pa,
                settings.contact.friction_coefficient,
            )
        };
        assert_eq!(check(&uncertainty), Ok(()));
        assert_eq!(sampled([0.0, 0.0]), (3e9, 0.3));
        let (modulus, friction) = sampled([1.0, 0.0]);
        assert!((modulus / (3e9 * 0.1_f64.exp()) - 1.0).abs() < 1e-14);
        assert!((friction - 0.36).abs() < 1e-14);
        assert!((sampled([0.0, 1.0]).1 - 0.38).abs() < 1e-14);
        // Friction is not negative.
        assert_eq!(sampled([0.0, -5.0]).1, 0.0);
    }

    #[test]
    fn what_is_no_uncertainty_is_refused() {
        let refused = |change: &dyn Fn(&mut CalibrationUncertainty)| {
            let mut changed = uncertainty(0.6);
            change(&mut changed);
            check(&changed).expect_err("refused").to_string()
        };
        assert!(
            refused(&|own| own.settings[0] = "filament.segments".to_owned())
                .contains("`filament.segments`")
        );
        assert!(refused(&|own| own.settings[1] = own.settings[0].clone()).contains("each once"));
        assert!(refused(&|own| own.standard_errors[0] = -1.0).contains("standard error"));
        assert!(refused(&|own| own.misfit = 1.0).contains("misfit"));
        assert!(refused(&|own| own.correlations[0][1] = 0.5).contains("symmetric"));
        assert!(refused(&|own| own.correlations.truncate(1)).contains("a row and a column"));
        let three = |correlation: f64| CalibrationUncertainty {
            settings: [
                "tool.filament_count",
                "filament.length_m",
                "filament.diameter_m",
            ]
            .map(str::to_owned)
            .into(),
            standard_errors: vec![1.0; 3],
            correlations: vec![
                vec![1.0, 0.9, correlation],
                vec![0.9, 1.0, 0.9],
                vec![correlation, 0.9, 1.0],
            ],
            misfit: 0.0,
        };
        assert!(check(&three(0.8)).is_ok() && check(&three(-0.8)).is_err());
    }
}
