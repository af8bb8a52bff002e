//! Reduction of observations to metrics, and combination of the metrics of several filaments.

use std::f64::consts::PI;

use super::{ContactRecord, Metrics, NominalContact, UNSTABLE_AMPLIFICATION};
use crate::model::record::{Combine, Record};
use crate::model::settings::Settings;

/// Coefficients of removal and of wear of the filaments, as far as they are known (MODEL, "Removal
/// and wear").
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RemovalLaw {
    /// Preston coefficient `k_P` in m²/N.
    pub preston: Option<f64>,
    /// Wear coefficient `k_w` in m²/N.
    pub wear: Option<f64>,
    /// `b |v_f|` in m²/s: area over which a brush is fed per time; `None` if it is not fed over a
    /// plane.
    pub area_rate: Option<f64>,
}

impl RemovalLaw {
    /// Returns the coefficients that `settings` state.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let Settings {
            removal,
            workpiece,
            tool,
            ..
        } = settings;
        let is_fed = workpiece.kind.is_plane() && workpiece.feed_velocity_m_s != 0.0;
        Self {
            preston: removal.as_ref().and_then(|removal| removal.preston_m2_n),
            wear: removal
                .as_ref()
                .and_then(|removal| removal.filament_wear_m2_n),
            area_rate: is_fed.then(|| tool.width_m * workpiece.feed_velocity_m_s.abs()),
        }
    }
}

impl Metrics {
    /// Reduces observations to metrics.
    pub fn new(
        nominal: &NominalContact,
        record: &ContactRecord,
        filament_count: f64,
        removal: &RemovalLaw,
    ) -> Self {
        let contact_angle = nominal.contact_angle;
        let nominal_time = contact_angle / nominal.rate();
        let of_tool = |impulse| tool_force(impulse, filament_count, nominal.rate());
        // Subtracted from zero, so that nothing becomes a negative zero.
        let torque = of_tool(0.0 - record.angular_impulse);
        let [impulse_x, impulse_y, impulse_z] = record.vector_impulse;
        // Work on edges can fall below zero by rounding.
        let edge_work = record.edge_work[0].max(0.0);
        let [angle, deviation] =
            angle_of_work([edge_work, record.edge_work[1], record.edge_work[2]]);
        let removal_rate = removal.preston.map_or(0.0, |preston| {
            preston * of_tool(record.sliding_work.max(0.0))
        });
        Self {
            penetration_depth_m: 0.0,
            force_stiffness_n_m: 0.0,
            contact_angle_rad: contact_angle,
            nominal_contact_length_m: nominal.tool_radius * contact_angle,
            nominal_contact_time_s: nominal_time,
            contact_time_s: record.time,
            contact_length_m: nominal.brushing_velocity * record.time,
            // A sum of steps can exceed the total by rounding.
            contact_time_ratio: if nominal_time > 0.0 {
                (record.nominal_time / nominal_time).min(1.0)
            } else {
                0.0
            },
            contact_count: record.count,
            contact_normal_impulse_n_s: record.impulse,
            equivalent_contact_normal_force_n: if record.time > 0.0 {
                record.impulse / record.time
            } else {
                0.0
            },
            peak_contact_normal_force_n: record.peak_force,
            max_penetration_m: record.penetration,
            contact_nodes: record.contact_nodes,
            max_tip_deflection_m: record.max_deflection,
            tool_contact_normal_force_n: of_tool(record.impulse),
            contact_impulse_x_n_s: impulse_x,
            contact_impulse_y_n_s: impulse_y,
            contact_impulse_z_n_s: impulse_z,
            edge_contact_normal_impulse_n_s: record.edge_impulse,
            // The integral over edges can exceed the whole, or fall below zero, by rounding.
            edge_share: if record.impulse > 0.0 {
                (record.edge_impulse / record.impulse).clamp(0.0, 1.0)
            } else {
                0.0
            },
            edge_evenness: record.edge_evenness,
            max_edge_penetration_m: record.edge_penetration,
            friction_work_j: record.friction_work,
            sliding_work_j: record.sliding_work.max(0.0),
            edge_sliding_work_j: edge_work,
            edge_work_angle_rad: angle,
            edge_work_angle_std_rad: deviation,
            contact_angular_impulse_n_m_s: record.angular_impulse,
            tool_tangential_force_n: of_tool(0.0 - impulse_x),
            tool_lateral_force_n: of_tool(0.0 - impulse_z),
            tool_torque_n_m: torque,
            tool_power_w: torque * nominal.rate(),
            removal_rate_m3_s: removal_rate,
            recession_per_pass_m: removal.area_rate.map_or(0.0, |rate| removal_rate / rate),
            wear_ratio: removal
                .preston
                .zip(removal.wear)
                .map_or(0.0, |(preston, wear)| preston / wear),
            lateral_amplification: record.lateral_amplification,
            laterally_unstable: record.lateral_amplification > UNSTABLE_AMPLIFICATION,
            turns: record.turn,
            unsteady_turns: false,
            impulse_standard_error: 0.0,
            equilibrium_residual: record.equilibrium_residual,
            energy_residual: record.energy_residual,
        }
    }

    /// Returns the contact normal force of the tool in N and its relative standard error, for the
    /// search for a depth.
    pub fn estimated_force(&self) -> [f64; 2] {
        [
            self.tool_contact_normal_force_n,
            self.impulse_standard_error,
        ]
    }

    /// Combines the metrics of several filaments, or of several passes of one: the mean, or the
    /// largest value for extremes.
    ///
    /// Returns `None` if `all` is empty.
    #[must_use]
    pub fn combined(all: &[Self]) -> Option<Self> {
        // All weights are equal: the sum is divided once.
        Self::merged(all, |values| values.iter().sum::<f64>() / all.len() as f64)
    }

    /// Combines metrics as [`Metrics::combined`] does, with weights whose sum is one.
    #[must_use]
    pub fn weighted(all: &[(f64, &Self)]) -> Option<Self> {
        Self::merged(all.iter().map(|(_, metrics)| *metrics), |values| {
            all.iter()
                .zip(values)
                .map(|((weight, _), value)| weight * value)
                .sum()
        })
    }

    fn merged<'a>(
        all: impl IntoIterator<Item = &'a Self>,
        mean: impl Fn(&[f64]) -> f64,
    ) -> Option<Self> {
        let all: Vec<&Self> = all.into_iter().collect();
        if all.is_empty() {
            return None;
        }
        let mut combined = Self::default();
        for column in Self::COLUMNS {
            let values: Vec<f64> = all.iter().map(|metrics| column.get(metrics)).collect();
            let value = match column.display.combine {
                Combine::Mean => mean(&values),
                Combine::Max => values.into_iter().fold(f64::NEG_INFINITY, f64::max),
            };
            column.set(&mut combined, value);
        }
        // Angles are weighted by the work.
        let moment = |order: usize| {
            let values: Vec<f64> = all
                .iter()
                .map(|one| {
                    let Self {
                        edge_sliding_work_j: work,
                        edge_work_angle_rad: angle,
                        edge_work_angle_std_rad: deviation,
                        ..
                    } = one;
                    let of_angle = [1.0, *angle, angle * angle + deviation * deviation];
                    work * of_angle[order]
                })
                .collect();
            mean(&values)
        };
        [
            combined.edge_work_angle_rad,
            combined.edge_work_angle_std_rad,
        ] = angle_of_work([0, 1, 2].map(moment));
        Some(combined)
    }
}

/// Returns mean and standard deviation in rad of the angle of work with these moments of the orders
/// 0, 1 and 2 (J, J rad, J rad²); zero without work.
fn angle_of_work([work, first, second]: [f64; 3]) -> [f64; 2] {
    if work <= 0.0 {
        return [0.0; 2];
    }
    let mean = first / work;
    [mean, (second / work - mean * mean).max(0.0).sqrt()]
}

/// Computes the tool contact normal force `F_n,w = p_n N_f ω/(2π)` in N (paper, Eq. 5): every
/// filament passes once per turn.
///
/// `impulse` in N s, `rate` in rad/s. For an angular impulse in N m s the result is the tool's
/// torque in N m.
pub fn tool_force(impulse: f64, filament_count: f64, rate: f64) -> f64 {
    impulse * filament_count * rate / (2.0 * PI)
}
