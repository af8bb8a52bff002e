//! Observations of a contact that metrics are computed from.

use crate::equations::linear::{add, dot, scale, sub};
use crate::model::passage::{ContactArc, Passage};

/// Undeformed tool and its passage over the workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalContact {
    /// Undeformed radius `R` in m.
    pub tool_radius: f64,
    /// Brushing velocity `v_b = ω R` in m/s.
    pub brushing_velocity: f64,
    /// Arc in which the undeformed filament passes the workpiece.
    pub window: ContactArc,
    /// Nominal contact angle `Ω_c` in rad: rotation of the tool while the undeformed filament
    /// touches the workpiece.
    pub contact_angle: f64,
}

impl NominalContact {
    /// Creates the contact of a tool with the radius `tool_radius` (m) at the brushing velocity
    /// `brushing_velocity` (m/s).
    pub fn new(tool_radius: f64, brushing_velocity: f64, passage: &Passage) -> Self {
        Self {
            tool_radius,
            brushing_velocity,
            window: passage.window,
            contact_angle: passage.contact_angle(),
        }
    }

    /// Returns the angular velocity of the tool, `ω = v_b/R`, in rad/s.
    pub fn rate(&self) -> f64 {
        self.brushing_velocity / self.tool_radius
    }
}

/// Observations of a contact during an integration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactRecord {
    /// Number of the turn observed last, from 1. The observations are of this turn.
    pub turn: usize,
    /// Residual of the energy balance of all turns, relative to the sum of its terms.
    pub energy_residual: f64,
    /// Deviation of the start from equilibrium: largest angular acceleration of a segment over
    /// `ω²`, seen from the tool.
    pub equilibrium_residual: f64,
    /// Total time with `F_n > 0` in s.
    pub time: f64,
    /// Part of it between nominal entry and exit, in s.
    pub nominal_time: f64,
    /// Number of maximal intervals with `F_n > 0`.
    pub count: usize,
    /// `∫ F_n dt` in N s.
    pub impulse: f64,
    /// `∫ F dt` of the whole contact force on the filament, in N s.
    pub vector_impulse: [f64; 3],
    /// Moment of that impulse about the tool axis, in N m s.
    pub angular_impulse: f64,
    /// Part of `impulse` on edges, in N s.
    pub edge_impulse: f64,
    /// Mean over largest value, among parts of the edges, of `∫ F_n |v_t| dt` per length.
    pub edge_evenness: f64,
    /// Largest penetration in m.
    pub penetration: f64,
    /// Number of outer nodes among which are all that touched a face.
    pub contact_nodes: usize,
    /// Largest penetration of an edge in m.
    pub edge_penetration: f64,
    /// Energy taken by friction in J.
    pub friction_work: f64,
    /// `∫ F_n |v_t| dt` in J.
    pub sliding_work: f64,
    /// Part of `sliding_work` on edges in J, and its first and second moment about the bisectors of
    /// the edges in J rad and J rad².
    pub edge_work: [f64; 3],
    /// Largest `F_n` in N.
    pub peak_force: f64,
    /// Largest tip deflection in m.
    pub max_deflection: f64,
    /// Largest `|∂z_tip/∂τ|/l_f`, with the tilt `τ` of the clamp out of the plane of rotation.
    pub lateral_amplification: f64,
}

impl ContactRecord {
    /// Creates the empty record of a turn, by number.
    pub fn of_turn(turn: usize) -> Self {
        Self {
            turn,
            ..Self::default()
        }
    }

    /// Adds a `time` (s) of contact between `begin` and `end`, in a turn that starts `turned` (s)
    /// after the first. The undeformed filament touches between the times in `touches` of the first
    /// turn.
    pub(crate) fn add_time(
        &mut self,
        time: f64,
        [begin, end]: [f64; 2],
        touches: &[[f64; 2]],
        turned: f64,
    ) {
        self.time += time;
        for touch in touches {
            let [entry, exit] = touch.map(|time| time + turned);
            self.nominal_time += (end.min(exit) - begin.max(entry)).max(0.0);
        }
    }
}

/// Computes the tip deflection `s_n` in m: the shortest distance from `tip` to the undeformed
/// filament, a straight line of length `length` from `root` along the unit vector `direction`.
pub fn tip_deflection(tip: [f64; 3], root: [f64; 3], direction: [f64; 3], length: f64) -> f64 {
    let nearest = add(
        root,
        scale(nearest_on_filament(tip, root, direction, length), direction),
    );
    let distance = sub(tip, nearest);
    dot(distance, distance).sqrt()
}

/// Returns the distance in m from the root to the point of the undeformed filament that is nearest
/// to `tip`; see [`tip_deflection`].
pub fn nearest_on_filament(tip: [f64; 3], root: [f64; 3], direction: [f64; 3], length: f64) -> f64 {
    dot(sub(tip, root), direction).clamp(0.0, length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deflection_is_measured_to_the_straight_piece() {
        let at = |tip| tip_deflection(tip, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 2.0);
        assert_eq!(at([2.0, 0.5, 0.0]), 0.5);
        assert_eq!(at([6.0, 4.0, 0.0]), 5.0);
        assert_eq!(at([0.0, 0.0, 1.0]), 2.0_f64.sqrt());
    }

    #[test]
    fn contact_angle_agrees_with_its_definition() {
        let arc = ContactArc::on_plane([0.0, 1.0, 0.0], 0.18, 0.003);
        assert!((arc.angle - 2.0 * (0.177_f64 / 0.18).acos()).abs() < 1e-14);
    }
}
