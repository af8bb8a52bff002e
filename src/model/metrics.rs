//! The metrics of a contact.

use std::f64::consts::PI;

use crate::equations::linear::{add, dot, scale, sub};
use crate::model::passage::{ContactArc, Passage};
use crate::model::record::{
    Combine, Curves, Display, Level, Needs, Prominence, Record, Scale, Scope,
};
use crate::model::settings::Settings;

/// Draws the number in figures whose file names start with `file_name`, in the unit `unit`.
const fn figure(file_name: &'static str, unit: &'static str, factor: f64) -> Display {
    Display {
        prominence: Prominence::Figure,
        file_name,
        unit,
        factor,
        ..Display::DETAIL
    }
}

/// Shows the number in the tables of a terminal too.
const fn headline(display: Display) -> Display {
    Display {
        prominence: Prominence::Headline,
        ..display
    }
}

/// Combines several filaments by the largest value.
const fn largest(display: Display) -> Display {
    Display {
        combine: Combine::Max,
        ..display
    }
}

/// Shows a number that spans decades within a study.
const fn over_decades(display: Display) -> Display {
    Display {
        scale: Scale::Logarithmic,
        ..display
    }
}

/// Leaves the number out of tables and figures where it is zero in all cases: without friction, or
/// without an edge.
const fn optional(display: Display) -> Display {
    Display {
        optional: true,
        ..display
    }
}

/// Assigns the number to the tool.
const fn of_tool(display: Display) -> Display {
    Display {
        scope: Scope::Tool,
        ..display
    }
}

/// Limits the number to results that meet `needs`.
const fn needs(needs: Needs, display: Display) -> Display {
    Display { needs, ..display }
}

/// Draws curves over the depth too.
const fn over_both(display: Display) -> Display {
    Display {
        curves: Curves::OverBoth,
        ..display
    }
}

/// Extends the colours to the whole range of a share.
const fn share(display: Display) -> Display {
    Display {
        range: Some([0.0, 1.0]),
        ..display
    }
}

/// Contact time ratio above which a filament sweeps, and below which it strikes.
pub const SWEEPING_RATIO: f64 = 0.5;

/// Line between sweeping and striking.
pub const BETWEEN_SWEEPING_AND_STRIKING: Level = Level {
    of: "contact_time_ratio",
    value: SWEEPING_RATIO,
    meaning: "line: ε_tc = ½, with sweeping above it and striking below",
    in_curves: "",
};

/// Lateral amplification above which a pass is laterally unstable (MODEL, "Motion that is planar by
/// symmetry").
pub const UNSTABLE_AMPLIFICATION: f64 = 100.0;

/// Line between laterally stable and unstable passes.
const OF_STABILITY: Level = Level {
    of: "lateral_amplification",
    value: UNSTABLE_AMPLIFICATION,
    meaning: "line: 100, above which a pass is laterally unstable",
    in_curves: "laterally unstable above",
};

crate::record! {
    /// The metrics of one contact, as MODEL's table defines them (Uhlmann and Hoyer 2021, Eqs. 2 to
    /// 5).
    #[derive(Clone, Debug, Default, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub struct Metrics {
        penetration_depth_m: f64 = ["a_e", "m", "penetration depth", "as stated, or found for the force with which the tool is pressed on"]
            => needs(
                Needs::GivenForce,
                over_both(Display { scale: Scale::Fitting, ..largest(figure("penetration_depth", "mm", 1e3)) })
            ),
        force_stiffness_n_m: f64 = [
            "", "N/m", "stiffness of the force",
            "dF_n,w/da_e of a tool that is pressed on with a given force; zero where the depth is given"
        ] => needs(Needs::GivenForce, optional(of_tool(Display::DETAIL))),
        contact_angle_rad: f64 =
            ["Ω_c", "rad", "nominal contact angle", "by how much the tool turns while the undeformed filament touches; 2 arccos((R − a_e)/R) on a plane"],
        nominal_contact_length_m: f64 = ["l_d", "m", "nominal contact length", "R Ω_c"],
        nominal_contact_time_s: f64 = ["t_d", "s", "nominal contact time", "Ω_c/ω"],
        contact_time_s: f64 = ["t_c", "s", "contact time", "total time with F_n > 0"]
            => figure("contact_time", "ms", 1e3),
        contact_length_m: f64 = ["l_c", "m", "contact length", "v_b t_c"],
        contact_time_ratio: f64 = [
            "ε_tc", "", "contact time ratio",
            "fraction of t_d with F_n > 0: near 0 the filament strikes, near 1 it sweeps"
        ] => share(Display {
            level: Some(BETWEEN_SWEEPING_AND_STRIKING),
            curves: Curves::None,
            ..headline(figure("contact_time_ratio", "", 1.0))
        }),
        contact_count: usize = ["", "", "number of contacts", "number of intervals with F_n > 0"] => largest(Display::DETAIL),
        contact_normal_impulse_n_s: f64 =
            ["p_n", "N s", "contact normal impulse of a filament", "∫ F_n dt of one filament, one pass"]
            => headline(over_both(figure("impulse", "mN s", 1e3))),
        equivalent_contact_normal_force_n: f64 =
            ["F̄_n", "N", "equivalent contact normal force", "p_n/t_c, zero without contact"],
        peak_contact_normal_force_n: f64 =
            ["max F_n", "N", "peak contact normal force", "largest force of all nodes together"]
            => largest(Display::DETAIL),
        max_penetration_m: f64 = [
            "", "m", "largest penetration",
            "largest penetration of a node or an edge; the contact is stiff as long as this is small against a_e and d"
        ] => largest(Display::DETAIL),
        contact_nodes: usize = [
            "", "", "nodes in contact",
            "number of outer nodes among which are all that touched a face: 1 if only the tip did"
        ] => largest(Display::DETAIL),
        max_tip_deflection_m: f64 = [
            "s_n,max", "m", "largest tip deflection",
            "largest distance of the tip from the undeformed filament"
        ] => largest(figure("tip_deflection", "mm", 1e3)),
        tool_contact_normal_force_n: f64 = [
            "F_n,w", "N", "contact normal force of the tool",
            "p_n N_f ω/(2π): each filament passes once per turn"
        ] => headline(of_tool(over_both(Display {
            level: Some(BETWEEN_SWEEPING_AND_STRIKING),
            ..figure("tool_force", "N", 1.0)
        }))),
        contact_impulse_x_n_s: f64 = ["", "N s", "contact impulse along x", "∫ of the contact force on the filament"],
        contact_impulse_y_n_s: f64 = ["", "N s", "contact impulse along y", "∫ of the contact force on the filament"],
        contact_impulse_z_n_s: f64 = ["", "N s", "contact impulse along z", "∫ of the contact force on the filament"],
        edge_contact_normal_impulse_n_s: f64 =
            ["", "N s", "contact normal impulse on edges", "the share of p_n on edges of the workpiece"]
            => needs(Needs::Edge, optional(figure("edge_impulse", "mN s", 1e3))),
        edge_share: f64 = [
            "", "", "share of the impulse on edges",
            "contact normal impulse on edges over p_n, zero without contact"
        ] => needs(Needs::Edge, optional(share(figure("edge_share", "", 1.0)))),
        edge_evenness: f64 = [
            "", "", "evenness of the work around edges",
            "mean over largest value of ∫ F_n |v_t| dt per length, the friction work over µ, among 24 parts of each edge: 1 if the \
             filament works everywhere alike, near 0 if in one place; zero if it touches no edge"
        ] => needs(Needs::Edge, optional(figure("edge_evenness", "", 1.0))),
        max_edge_penetration_m: f64 = [
            "", "m", "largest penetration of an edge",
            "the force on an edge is that of a rigid one as long as this is small against its radius"
        ] => needs(Needs::Edge, largest(Display::DETAIL)),
        friction_work_j: f64 = ["", "J", "friction work", "energy taken by friction in one pass of one filament"]
            => optional(figure("friction_work", "mJ", 1e3)),
        sliding_work_j: f64 = [
            "W_s", "J", "sliding work", "∫ F_n |v_t| dt of one filament, one pass, by which it removes material and wears"
        ],
        edge_sliding_work_j: f64 = ["W_e", "J", "sliding work on edges", "the share of W_s on edges of the workpiece"]
            => needs(Needs::Edge, optional(figure("edge_sliding_work", "mJ", 1e3))),
        edge_work_angle_rad: f64 = [
            "", "rad", "angle of the edge's work",
            "mean angle of W_e from the bisector of the edge, positive towards the face that filaments meet last; zero without such work"
        ] => needs(Needs::Edge, optional(Display::DETAIL)),
        edge_work_angle_std_rad: f64 =
            ["", "rad", "deviation of the angle of the edge's work", "standard deviation of W_e around the edge"]
            => needs(Needs::Edge, optional(Display::DETAIL)),
        contact_angular_impulse_n_m_s: f64 =
            ["", "N m s", "contact angular impulse", "∫ of the moment of the contact force about the tool axis"],
        tool_tangential_force_n: f64 = [
            "F_t,w", "N", "tangential force of the tool",
            "−∫ F_x dt N_f ω/(2π): positive where the tool drags the workpiece along x"
        ] => headline(optional(of_tool(figure("tool_tangential_force", "N", 1.0)))),
        tool_lateral_force_n: f64 = [
            "F_l,w", "N", "lateral force of the tool",
            "−∫ F_z dt N_f ω/(2π): positive where the tool drags the workpiece along z"
        ] => optional(of_tool(figure("tool_lateral_force", "N", 1.0))),
        tool_torque_n_m: f64 = [
            "M_w", "N m", "torque of the tool",
            "−contact angular impulse N_f ω/(2π): what the drive must supply"
        ] => headline(of_tool(figure("tool_torque", "N m", 1.0))),
        tool_power_w: f64 = ["P_w", "W", "power of the tool", "M_w ω: what the contact takes from the drive"]
            => headline(of_tool(figure("tool_power", "W", 1.0))),
        removal_rate_m3_s: f64 =
            ["", "m³/s", "removal rate of the tool", "k_P W_s N_f ω/(2π) (Preston)"]
            => needs(Needs::Removal, optional(of_tool(figure("removal_rate", "mm³/s", 1e9)))),
        recession_per_pass_m: f64 = [
            "", "m", "recession per pass",
            "k_P W_s N_f ω/(2π b v_f): by how much a plane recedes under a brush of the width b that is fed over it once"
        ] => needs(Needs::RemovalFromPlane, optional(of_tool(figure("recession", "µm", 1e6)))),
        wear_ratio: f64 =
            ["", "", "wear ratio", "volume removed from the workpiece over volume lost by the filaments, k_P/k_w"]
            => needs(Needs::RemovalAndWear, optional(Display::DETAIL)),
        lateral_amplification: f64 = [
            "", "", "lateral amplification",
            "largest |∂z_tip/∂τ|/l_f of the pass, τ the tilt of the clamp out of the plane of rotation; above 100 the pass \
             is laterally unstable, and 1e30 stands for anything larger. In a spatial pass |z_tip|/(l_f sin τ), 0 without a tilt"
        ] => needs(Needs::OneFilament, headline(optional(largest(over_decades(Display {
            level: Some(OF_STABILITY),
            ..figure("lateral_amplification", "", 1.0)
        }))))),
        laterally_unstable: bool = ["", "", "laterally unstable", "1 if the lateral amplification is above 100, else 0"]
            => needs(Needs::OneFilament, largest(Display::DETAIL)),
        turns: usize = [
            "", "", "turns",
            "turns of the tool that were simulated; metrics are those of the last one, or means over the last 25 of 50 that do not become steady"
        ] => largest(Display::DETAIL),
        unsteady_turns: bool = [
            "", "", "unsteady turns",
            "1 if p_n still changes from turn to turn after 50 turns with turns = \"steady\", else 0"
        ] => largest(Display::DETAIL),
        impulse_standard_error: f64 = [
            "", "", "standard error of p_n",
            "standard error of p_n over p_n, where turns do not become steady and p_n is a mean over the last ones; else 0"
        ] => optional(largest(Display::DETAIL)),
        equilibrium_residual: f64 = [
            "", "", "residual of the start",
            "largest angular acceleration of a segment at the start over ω², seen from the tool: filaments that are not radial start in equilibrium"
        ] => optional(largest(over_decades(Display::DETAIL))),
        energy_residual: f64 = [
            "", "", "energy residual",
            "what is missing in the balance of work, energies and losses over all turns, relative to the sum of its terms; above 1e-3, or ten \
             tolerances, the pass is refused"
        ] => needs(Needs::OneFilament, largest(over_decades(Display::DETAIL))),
    }
}

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
