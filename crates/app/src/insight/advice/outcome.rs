//! Velocity and depth of a case, and the part of its result that advice considers.

use bristle::model::metrics::{Metrics, SWEEPING_RATIO, tool_force};
use bristle::model::settings::Settings;
use serde::{Deserialize, Serialize};

use crate::insight::measured::relative_uncertainty;
use bristle_study::grid::CaseSummary;
use bristle_study::grid::uncertainty::share_below;
use bristle_study::text::number::significant;

/// Quantity to be maximised within the limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Most {
    /// The force of the tool.
    #[default]
    Force,
    /// Removal from edges per time.
    Edge,
    /// Removal in all per time.
    Removal,
}

impl Most {
    /// Returns the key of the metric.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Force => "tool_contact_normal_force_n",
            Self::Edge => "edge_sliding_work_j",
            Self::Removal => "sliding_work_j",
        }
    }
}

/// Velocity and depth of a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// `v_b` in m/s.
    pub brushing_velocity_m_s: f64,
    /// `n_w` in revolutions per minute.
    pub rotational_speed_rpm: f64,
    /// `a_e` in m.
    pub penetration_depth_m: f64,
}

impl OperatingPoint {
    /// Returns velocity and depth of the settings.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        Self {
            brushing_velocity_m_s: settings.process.brushing_velocity_m_s,
            rotational_speed_rpm: settings.rotational_speed_rpm(),
            penetration_depth_m: settings.process.penetration_depth_m,
        }
    }
}

/// The part of a result that advice considers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// `F_n,w` in N.
    pub tool_contact_normal_force_n: f64,
    /// `F_t,w` in N.
    pub tool_tangential_force_n: f64,
    /// `M_w` in N m.
    pub tool_torque_n_m: f64,
    /// `P_w` in W.
    pub tool_power_w: f64,
    /// Uncertainty of `F_n,w` in N, from that of the number of filaments.
    pub uncertainty_n: f64,
    /// Median of `F_n,w` in N over the sampled tools, where filaments scatter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_force_median_n: Option<f64>,
    /// Lower end of the band of `F_n,w` in N that contains 95 % of the sampled tools, where
    /// filaments scatter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_force_lower_95_n: Option<f64>,
    /// Upper end of the band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tool_force_upper_95_n: Option<f64>,
    /// `ε_tc`.
    pub contact_time_ratio: f64,
    /// Growth of a lateral imperfection; see [`Metrics`].
    pub lateral_amplification: f64,
    /// `true` if the pass is laterally unstable. An imperfection of the filament can then change
    /// the force.
    pub laterally_unstable: bool,
    /// Removal from the workpiece, in a study with `[removal]`.
    #[serde(skip)]
    removal: Option<RemovalOutcome>,
}

/// Removal as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RemovalOutcome {
    /// Sliding work of the tool per time in W: on the whole workpiece, and on edges.
    powers_w: [f64; 2],
    /// Preston coefficient in m²/N.
    preston: Option<f64>,
}

impl RemovalOutcome {
    fn of(settings: &Settings, metrics: &Metrics) -> Option<Self> {
        let removal = settings.removal.as_ref()?;
        let (count, rate) = (
            settings.tool.filament_count,
            settings.angular_velocity_rad_s(),
        );
        let powers_w = [metrics.sliding_work_j, metrics.edge_sliding_work_j]
            .map(|work| tool_force(work, count, rate));
        Some(Self {
            powers_w,
            preston: removal.preston_m2_n,
        })
    }
}

impl Outcome {
    /// Extracts the outcome from the summary of a case with these settings.
    pub(crate) fn new(settings: &Settings, summary: &CaseSummary) -> Self {
        let CaseSummary {
            metrics, scatter, ..
        } = summary;
        Self {
            tool_contact_normal_force_n: metrics.tool_contact_normal_force_n,
            tool_tangential_force_n: metrics.tool_tangential_force_n,
            tool_torque_n_m: metrics.tool_torque_n_m,
            tool_power_w: metrics.tool_power_w,
            uncertainty_n: relative_uncertainty(settings) * metrics.tool_contact_normal_force_n,
            tool_force_median_n: scatter.as_ref().map(|scatter| scatter.tool_force_median_n),
            tool_force_lower_95_n: scatter
                .as_ref()
                .map(|scatter| scatter.tool_force_lower_95_n),
            tool_force_upper_95_n: scatter
                .as_ref()
                .map(|scatter| scatter.tool_force_upper_95_n),
            contact_time_ratio: metrics.contact_time_ratio,
            lateral_amplification: metrics.lateral_amplification,
            laterally_unstable: metrics.laterally_unstable,
            removal: RemovalOutcome::of(settings, metrics),
        }
    }

    /// Returns the outcome of a simulation of the same point, or of one near it. If only `self` has
    /// a band, the new band is the same share of the force.
    pub(super) fn simulated_as(&self, settings: &Settings, summary: &CaseSummary) -> Self {
        let new = Self::new(settings, summary);
        let growth = new.tool_contact_normal_force_n / self.tool_contact_normal_force_n;
        let [median, lower, upper] = [
            self.tool_force_median_n,
            self.tool_force_lower_95_n,
            self.tool_force_upper_95_n,
        ]
        .map(|quantile| Some(growth * quantile?));
        Self {
            tool_force_median_n: new.tool_force_median_n.or(median),
            tool_force_lower_95_n: new.tool_force_lower_95_n.or(lower),
            tool_force_upper_95_n: new.tool_force_upper_95_n.or(upper),
            ..new
        }
    }

    /// Returns the force in N that tools have in the middle: the median where filaments scatter.
    pub(super) fn central_n(&self) -> f64 {
        self.tool_force_median_n
            .unwrap_or(self.tool_contact_normal_force_n)
    }

    /// Returns the share of tools whose force is at most a limit in N, where filaments scatter.
    pub(super) fn share_within(&self, limit_n: f64) -> Option<f64> {
        let [lower, upper] = self.band()?;
        Some(share_below(limit_n, [lower, self.central_n(), upper]))
    }

    /// The band of the force, where filaments scatter.
    pub(super) fn band(&self) -> Option<[f64; 2]> {
        self.tool_force_lower_95_n
            .zip(self.tool_force_upper_95_n)
            .map(<[f64; 2]>::from)
    }

    /// The ends of the band, or else of the uncertainty from the number of filaments, in N.
    pub(super) fn ends(&self) -> [f64; 2] {
        let [force, uncertainty] = [self.tool_contact_normal_force_n, self.uncertainty_n];
        self.band()
            .unwrap_or([force - uncertainty, force + uncertainty])
    }

    /// Returns the sliding power to be maximised, in W. `None` if the force is to be maximised, or
    /// the power is unknown.
    pub(super) fn removal_power_w(&self, most: Most) -> Option<f64> {
        let position = match most {
            Most::Force => return None,
            Most::Removal => 0,
            Most::Edge => 1,
        };
        self.removal.map(|removal| removal.powers_w[position])
    }

    /// Returns the sliding power as text, or the removal rate if the coefficient is known.
    pub(super) fn removed(&self, most: Most) -> Option<String> {
        let power_w = self.removal_power_w(most)?;
        let text = match self.removal?.preston {
            Some(preston) => format!("Removes {} mm³/min", significant(60e9 * preston * power_w)),
            None => format!(
                "Slides with {} W, in proportion to which it removes material",
                significant(power_w)
            ),
        };
        Some(
            text + if most == Most::Edge {
                " on the edge"
            } else {
                ""
            },
        )
    }

    pub(super) fn motion(&self) -> &'static str {
        if self.contact_time_ratio > SWEEPING_RATIO {
            "sweeps"
        } else {
            "strikes"
        }
    }
}
