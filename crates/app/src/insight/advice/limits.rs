//! Limits on the cases that advice considers.

use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use thiserror::Error;

use super::outcome::{Most, OperatingPoint, Outcome};
use bristle_study::text::number::short;

/// Relative rounding noise of a setting that is at its limit.
const NOISE: f64 = 1e-9;

/// Limits on the cases that advice considers, and the wanted force. JSON has the given ones only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Highest brushing velocity `v_b` in m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_velocity_m_s: Option<f64>,
    /// Highest rotational speed `n_w` in revolutions per minute.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_rotational_speed_rpm: Option<f64>,
    /// Largest penetration depth `a_e` in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_depth_m: Option<f64>,
    /// Highest force `F_n,w` in N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_force_n: Option<f64>,
    /// Highest power `P_w` in W.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_power_w: Option<f64>,
    /// Lowest contact time ratio `ε_tc`, for filaments that sweep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_ratio: Option<f64>,
    /// Highest contact time ratio `ε_tc`, for filaments that strike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_ratio: Option<f64>,
    /// The force `F_n,w` in N that is wanted. It excludes no case, but the nearest are ranked
    /// first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_force_n: Option<f64>,
    /// Quantity to be maximised; it excludes no case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most: Option<Most>,
}

/// Why there is no advice, in words.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct AdviceError(pub(super) String);

impl Limits {
    /// Reads the limits in `[goal]` of an input file.
    ///
    /// # Errors
    /// If it has keys or values that `[goal]` does not have.
    pub fn of(goal: &Map<String, Value>) -> Result<Self, AdviceError> {
        serde_json::from_value(Value::Object(goal.clone()))
            .map_err(|error| AdviceError(format!("the goal cannot be read: {error}")))
    }

    /// Returns `true` if nothing is asked for.
    #[must_use]
    pub fn asks_nothing(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the quantity to be maximised where no force is wanted.
    #[must_use]
    pub fn most(&self) -> Most {
        self.most.unwrap_or_default()
    }

    /// Returns the question.
    #[must_use]
    pub fn question(&self) -> String {
        let asked = match (self.target_force_n, self.most()) {
            (Some(target), _) => format!("give F_n,w = {} N", short(target)),
            (None, Most::Force) => "give the highest force F_n,w".to_owned(),
            (None, Most::Edge) => "remove most from edges".to_owned(),
            (None, Most::Removal) => "remove most".to_owned(),
        };
        let within = if self.are_none() {
            String::new()
        } else {
            format!(" with {self}")
        };
        format!("Which speed and depth {asked}{within}?")
    }

    /// # Errors
    /// If no case can satisfy all limits, or have the wanted force.
    pub(super) fn check(&self) -> Result<(), AdviceError> {
        match *self {
            Self {
                min_ratio: Some(least),
                max_ratio: Some(most),
                ..
            } if least > most => Err(AdviceError(format!(
                "no contact time ratio is at least {least} and at most {most}"
            ))),
            Self {
                max_force_n: Some(most),
                target_force_n: Some(target),
                ..
            } if target > most => Err(AdviceError(format!(
                "the target of {target} N is above the highest force of {most} N"
            ))),
            _ => Ok(()),
        }
    }

    /// Returns `true` if velocity and depth are within the limits.
    pub(super) fn allow_point(&self, place: &OperatingPoint) -> bool {
        let is_at_most = |value: f64, limit: Option<f64>| {
            limit.is_none_or(|limit| value <= limit * (1.0 + NOISE))
        };
        is_at_most(place.brushing_velocity_m_s, self.max_velocity_m_s)
            && is_at_most(place.rotational_speed_rpm, self.max_rotational_speed_rpm)
            && is_at_most(place.penetration_depth_m, self.max_depth_m)
    }

    /// Returns `true` if a case is within the limits.
    pub(crate) fn allow(&self, place: &OperatingPoint, outcome: &Outcome) -> bool {
        let is_at_most = |value: f64, limit: Option<f64>| limit.is_none_or(|limit| value <= limit);
        self.allow_point(place)
            && is_at_most(outcome.central_n(), self.max_force_n)
            && is_at_most(outcome.tool_power_w, self.max_power_w)
            && self
                .min_ratio
                .is_none_or(|limit| outcome.contact_time_ratio >= limit)
            && is_at_most(outcome.contact_time_ratio, self.max_ratio)
    }

    /// Returns `true` if there is no limit. A target is not a limit.
    pub(super) fn are_none(&self) -> bool {
        Self {
            target_force_n: None,
            most: None,
            ..*self
        } == Self::default()
    }

    /// The force in N that suggestions are made for: the target, or else the limit.
    pub(super) fn wanted_n(&self) -> Option<f64> {
        self.target_force_n.or(self.max_force_n)
    }

    /// Returns `true` if the force is within its limit with its whole uncertainty.
    pub(super) fn hold_with_band(&self, outcome: &Outcome) -> bool {
        self.max_force_n
            .is_none_or(|limit| outcome.ends()[1] <= limit)
    }
}

impl Display for Limits {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let parts = [
            self.max_velocity_m_s
                .map(|limit| format!("v_b ≤ {limit} m/s")),
            self.max_rotational_speed_rpm
                .map(|limit| format!("n_w ≤ {limit} rpm")),
            self.max_depth_m
                .map(|limit| format!("a_e ≤ {} mm", short(1e3 * limit))),
            self.max_force_n.map(|limit| format!("F_n,w ≤ {limit} N")),
            self.max_power_w.map(|limit| format!("P_w ≤ {limit} W")),
            self.min_ratio.map(|limit| format!("ε_tc ≥ {limit}")),
            self.max_ratio.map(|limit| format!("ε_tc ≤ {limit}")),
        ];
        formatter.write_str(
            &parts
                .into_iter()
                .flatten()
                .collect::<Vec<_>>()
                .join(" and "),
        )
    }
}
