//! Files of a calibration: `calibration.json` and `residuals.csv`.

use std::io::{self, Write};

use crate::input::measured::Speed;
use serde::Serialize;

use crate::calibrate::words::square_root_words;
use crate::calibrate::{Calibration, Next, SquareRoot, Undetermined};

/// A fitted setting in `calibration.json`.
#[derive(Serialize)]
struct ParameterRecord {
    key: &'static str,
    unit: &'static str,
    /// `null` where the forces do not determine it.
    value: Option<f64>,
    standard_error: Option<f64>,
    interval_95: Option<[f64; 2]>,
    range: [f64; 2],
    /// `lower` or `upper` if the value is at that end of its range.
    at_end: Option<&'static str>,
}

#[derive(Serialize)]
struct UndeterminedRecord {
    keys: Vec<&'static str>,
    statement: String,
    /// Exponents of a determined product of two settings.
    exponents: Option<[f64; 2]>,
    relative_standard_error: Option<f64>,
    /// Joint change of each setting: of its logarithm, or over its range.
    direction: Vec<f64>,
}

#[derive(Default, Serialize)]
struct ResidualRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    tool: Option<String>,
    line: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    brushing_velocity_m_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotational_speed_rpm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    penetration_depth_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turns: Option<f64>,
    quantity: &'static str,
    measured: f64,
    std: f64,
    fitted: f64,
    residual: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    square_root: Option<f64>,
}

/// The fit by the square root of time in `calibration.json`.
#[derive(Serialize)]
struct SquareRootRecord {
    /// `c` of `R² = R_0² + c² t`.
    c_m_per_sqrt_s: f64,
    chi_squared: f64,
    probability: Option<f64>,
    fits: Option<bool>,
    statement: String,
}

#[derive(Serialize)]
struct NextRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    tool: Option<String>,
    brushing_velocity_m_s: f64,
    rotational_speed_rpm: f64,
    penetration_depth_m: f64,
    /// Factor by which the determinant of the covariance becomes smaller.
    determinant_gain: f64,
    /// Standard error of each setting with this point, over that without.
    standard_error_ratios: Vec<f64>,
    statement: String,
}

#[derive(Serialize)]
struct MinimumRecord {
    chi_squared: f64,
    starts: usize,
}

#[derive(Serialize)]
struct CalibrationRecord {
    version: &'static str,
    parameters: Vec<ParameterRecord>,
    correlations: Vec<Vec<f64>>,
    /// Covariance of the values, in the units of their keys.
    covariance: Vec<Vec<f64>>,
    chi_squared: f64,
    degrees_of_freedom: usize,
    probability: Option<f64>,
    standard_deviations_are_stated: bool,
    singular_values: Vec<f64>,
    derivative_error: f64,
    undetermined: Vec<UndeterminedRecord>,
    minima: Vec<MinimumRecord>,
    stopped_starts: usize,
    failed_starts: usize,
    residuals: Vec<ResidualRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    square_root: Option<SquareRootRecord>,
    next_measurement: Vec<NextRecord>,
}

impl Calibration {
    /// Returns the text of `calibration.json`.
    ///
    /// # Panics
    /// Never: all keys are texts.
    #[must_use]
    pub fn json(&self) -> String {
        let count = self.values.len();
        let table = |entry: &dyn Fn(usize, usize) -> f64| {
            (0..count)
                .map(|row| (0..count).map(|column| entry(row, column)).collect())
                .collect()
        };
        let record = CalibrationRecord {
            version: env!("CARGO_PKG_VERSION"),
            parameters: (0..count)
                .map(|setting| self.parameter_record(setting))
                .collect(),
            correlations: table(&|row, column| self.errors.correlation(row, column)),
            covariance: table(&|row, column| {
                self.errors.correlation(row, column)
                    * self.standard_error(row)
                    * self.standard_error(column)
            }),
            chi_squared: self.chi_squared / self.variance,
            degrees_of_freedom: self.degrees_of_freedom(),
            probability: self.probability(),
            standard_deviations_are_stated: self.problem.has_std,
            singular_values: self.errors.singular_values.clone(),
            derivative_error: self.derivative_error,
            undetermined: self
                .undetermined
                .iter()
                .map(|group| self.undetermined_record(group))
                .collect(),
            minima: self
                .minima
                .iter()
                .map(|&(chi_squared, starts)| MinimumRecord {
                    chi_squared,
                    starts,
                })
                .collect(),
            stopped_starts: self.stopped_starts,
            failed_starts: self.failed_starts,
            residuals: (0..self.forces.len())
                .map(|observation| self.residual_record(observation))
                .collect(),
            square_root: self
                .square_root
                .as_ref()
                .map(|root| self.square_root_record(root)),
            next_measurement: self
                .next
                .iter()
                .map(|next| self.next_record(next))
                .collect(),
        };
        serde_json::to_string_pretty(&record).expect("all keys are texts") + "\n"
    }

    /// Writes `residuals.csv`: a heading, then one row for each force or radius.
    ///
    /// # Errors
    /// If `out` cannot be written to.
    pub fn write_residuals(&self, out: impl Write) -> io::Result<()> {
        let mut writer = csv::Writer::from_writer(out);
        let records: Vec<ResidualRecord> = (0..self.forces.len())
            .map(|observation| self.residual_record(observation))
            .collect();
        let is_stated = |has: fn(&ResidualRecord) -> bool| records.iter().any(has);
        // Place of the measurement: speed and depth, or the time.
        let place: &[&str] = match (
            self.problem.radii.is_some(),
            is_stated(|own| own.brushing_velocity_m_s.is_some()),
        ) {
            (true, _) => &["time_s", "turns"],
            (false, true) => &["brushing_velocity_m_s", "penetration_depth_m"],
            (false, false) => &["rotational_speed_rpm", "penetration_depth_m"],
        };
        let tool = is_stated(|own| own.tool.is_some()).then_some("tool");
        let root = self.square_root.as_ref().map(|_| "square_root");
        let values = ["quantity", "measured", "std", "fitted", "residual"];
        writer.write_record(
            tool.iter()
                .chain(place)
                .chain(&values)
                .chain(&root)
                .chain(&["line"]),
        )?;
        for own in records {
            let number = |number: f64| format!("{number:?}");
            let place = match self.problem.radii {
                Some(_) => [own.time_s, own.turns],
                None => [
                    own.brushing_velocity_m_s.or(own.rotational_speed_rpm),
                    own.penetration_depth_m,
                ],
            };
            let place = place.map(|place| place.map_or_else(String::new, number));
            let values = [own.measured, own.std, own.fitted, own.residual].map(number);
            let row = own
                .tool
                .into_iter()
                .chain(place)
                .chain([own.quantity.to_owned()])
                .chain(values);
            writer.write_record(
                row.chain(own.square_root.map(number))
                    .chain([own.line.to_string()]),
            )?;
        }
        writer.flush()
    }

    fn parameter_record(&self, setting: usize) -> ParameterRecord {
        let fitted = &self.problem.fitted[setting];
        let determined = self.is_determined(setting);
        ParameterRecord {
            key: fitted.parameter.path,
            unit: fitted.parameter.unit,
            value: determined.then_some(self.values[setting]),
            standard_error: determined.then(|| self.standard_error(setting)),
            interval_95: self.intervals[setting],
            range: fitted.bounds,
            at_end: fitted.end(self.values[setting]),
        }
    }

    fn undetermined_record(&self, group: &Undetermined) -> UndeterminedRecord {
        UndeterminedRecord {
            keys: group
                .settings
                .iter()
                .map(|&setting| self.problem.fitted[setting].parameter.path)
                .collect(),
            statement: group.statement.clone(),
            exponents: group.product.map(|(exponents, _)| exponents),
            relative_standard_error: group.product.map(|(_, error)| error),
            direction: group.direction.clone(),
        }
    }

    fn residual_record(&self, observation: usize) -> ResidualRecord {
        let own = self.problem.observations[observation];
        let record = ResidualRecord {
            quantity: own.quantity().key(),
            measured: own.value,
            std: own.std * self.variance.sqrt(),
            fitted: self.forces[observation],
            residual: self.residual(observation),
            square_root: self
                .square_root
                .as_ref()
                .map(|root| root.radii[observation]),
            ..ResidualRecord::default()
        };
        if let Some(radii) = &self.problem.radii {
            let (line, turns) = (radii.points[own.point].line, Some(radii.turns[own.point]));
            return ResidualRecord {
                line,
                time_s: Some(radii.time_s(own.point)),
                turns,
                ..record
            };
        }
        let point = self.problem.points[own.point];
        let (brushing_velocity_m_s, rotational_speed_rpm) = match point.speed {
            Speed::Velocity(velocity) => (Some(velocity), None),
            Speed::Rotational(speed) => (None, Some(speed)),
        };
        ResidualRecord {
            tool: self.tool_name(point.tool.unwrap_or(0)),
            line: point.line,
            brushing_velocity_m_s,
            rotational_speed_rpm,
            penetration_depth_m: Some(point.penetration_depth_m),
            ..record
        }
    }

    fn square_root_record(&self, root: &SquareRoot) -> SquareRootRecord {
        SquareRootRecord {
            c_m_per_sqrt_s: root.c_m_per_sqrt_s,
            chi_squared: root.chi_squared / self.variance,
            probability: self.probability_of(root.chi_squared),
            fits: self.square_root_fits(root),
            statement: square_root_words(self, root),
        }
    }

    fn next_record(&self, next: &Next) -> NextRecord {
        NextRecord {
            tool: self.tool_name(next.place.tool),
            brushing_velocity_m_s: next.speeds[0],
            rotational_speed_rpm: next.speeds[1],
            penetration_depth_m: next.place.penetration_depth_m,
            determinant_gain: next.gain,
            standard_error_ratios: next.shrinks.clone(),
            statement: self.next_words(next),
        }
    }

    /// Returns the name of a tool; none if there is only one.
    #[must_use]
    pub fn tool_name(&self, tool: usize) -> Option<String> {
        (self.problem.brushes.len() > 1).then(|| self.problem.brushes[tool].name.clone())
    }
}
