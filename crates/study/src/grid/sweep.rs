//! One axis of a study: a setting and its values.

use bristle::model::parameters::Parameter;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::setting::{DEPTH, SPEED, Setting, TOOL, VELOCITY};

/// Short names in `[study]`, and the paths that they abbreviate.
pub const SHORT_NAMES: [(&str, &str); 3] = [
    ("brushing_velocity_m_s", VELOCITY),
    ("rotational_speed_rpm", SPEED),
    ("penetration_depth_m", DEPTH),
];

/// Largest number of cases in a study.
pub const MAX_CASES: usize = 1_000_000;
/// Largest number of sampled tools in all cases of a study.
pub const MAX_TOOLS: usize = 10_000_000;

/// One axis of a study: a setting and its values.
#[derive(Clone, Debug)]
pub struct Sweep {
    setting: Setting,
    values: Vec<f64>,
}

/// A sweep in the form used in files.
#[derive(PartialEq, Serialize, Deserialize)]
pub struct SweepText {
    /// Dotted path of the setting.
    pub setting: String,
    /// Values of the setting.
    pub values: Vec<f64>,
}

/// Reason why values form no sweep.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{problem}")]
pub struct SweepError {
    problem: String,
    /// Position of the value that the setting cannot have, counted from 0.
    pub index: Option<usize>,
}

impl From<String> for SweepError {
    fn from(problem: String) -> Self {
        Self {
            problem,
            index: None,
        }
    }
}

fn too_many_values() -> SweepError {
    format!("more than {MAX_CASES} values: take a larger step").into()
}

impl Sweep {
    /// Creates a sweep over a list of values.
    pub fn list(parameter: &'static Parameter, values: Vec<f64>) -> Result<Self, SweepError> {
        if values.is_empty() {
            return Err("a sweep needs at least one value".to_owned().into());
        }
        if values.len() > MAX_CASES {
            return Err(too_many_values());
        }
        for (index, &value) in values.iter().enumerate() {
            parameter.check(value).map_err(|violation| SweepError {
                problem: violation.to_string(),
                index: Some(index),
            })?;
        }
        Ok(Self {
            setting: Setting::Number(parameter),
            values,
        })
    }

    /// Creates a sweep from `start` in equal steps up to and including `stop`.
    ///
    /// Rounding does not exclude `stop`: the last step may miss it by one millionth of a step.
    pub fn range(
        parameter: &'static Parameter,
        start: f64,
        stop: f64,
        step: f64,
    ) -> Result<Self, SweepError> {
        /// Fraction of a step by which the last value may miss `stop`: far above rounding and far
        /// below any intended gap.
        const STOP_TOLERANCE: f64 = 1e-6;

        let steps = (stop - start) / step;
        if !(start.is_finite() && stop.is_finite() && step.is_finite()) {
            return Err("start, stop and step must be finite numbers"
                .to_owned()
                .into());
        }
        if step == 0.0 || steps < -STOP_TOLERANCE {
            let problem = format!("a step of {step:?} does not lead from {start:?} to {stop:?}");
            return Err(problem.into());
        }
        let last = (steps + STOP_TOLERANCE).floor();
        // This also catches an overflow to infinity.
        if last >= MAX_CASES as f64 {
            return Err(too_many_values());
        }
        let last = last as usize;
        let value = |index: usize| match index {
            0 => start,
            _ if index == last && (steps - last as f64).abs() <= STOP_TOLERANCE => stop,
            _ => without_rounding_noise(start + index as f64 * step),
        };
        Self::list(parameter, (0..=last).map(value).collect())
    }

    /// Creates the axis of named tools.
    pub(super) fn tools(names: Vec<String>) -> Self {
        let values = (0..names.len()).map(|position| position as f64).collect();
        Self {
            setting: Setting::Tool(names.into()),
            values,
        }
    }

    /// Returns the setting that differs along the axis.
    #[must_use]
    pub fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Returns the path of this setting.
    #[must_use]
    pub fn path(&self) -> &'static str {
        self.setting.path()
    }

    /// Returns the values, at least one.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the position in the order of sweeps: 0 is the outermost.
    pub(super) fn rank(&self) -> usize {
        match self.path() {
            VELOCITY | SPEED => 3,
            DEPTH => 2,
            TOOL => 0,
            _ => 1,
        }
    }
}

/// Rounds to 12 significant digits, so that three steps of 0.1 give 0.3 and not
/// 0.30000000000000004.
pub fn without_rounding_noise(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}
