//! The metrics of a contact.

mod observed;
mod reduction;

use crate::model::record::{Combine, Curves, Display, Level, Needs, Prominence, Scale, Scope};
pub use observed::{ContactRecord, NominalContact, nearest_on_filament, tip_deflection};
pub use reduction::{RemovalLaw, tool_force};

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
