//! The rules that judge cases: a table, the limits, and the physics behind them.

use std::f64::consts::TAU;
use std::fmt::{self, Display, Formatter};

use bristle::model::filament::first_natural_frequency;
use bristle::model::metrics::UNSTABLE_AMPLIFICATION;
use bristle::model::settings::{BrushSettings, Ends, MAX_STEADY_CHANGE, Settings, Turns};
use bristle::simulation::Pass;
use bristle::tool::{LEAN, Trim};
use bristle::workpiece::{Edge, Part, Workpiece};
use bristle_study::input::packing::{PACKED, tip_spacing};
use bristle_study::text::number::{short, spanning};

use crate::insight::findings::JudgedCase;

/// Test of a case, with its message.
pub struct Rule {
    /// Its number.
    pub id: &'static str,
    /// The column or the setting that it judges.
    pub quantity: &'static str,
    /// Meaning and remedy, for `bristle explain`.
    pub meaning: &'static str,
    pub(super) judge: fn(&JudgedCase<'_>) -> Option<Judgement>,
    /// The statement about a value and its limit.
    pub(super) statement: fn(f64, f64) -> String,
    /// Remedy for the worst case; the last argument is `true` in a study.
    pub(super) help: fn(&JudgedCase<'_>, Judgement, bool) -> Option<String>,
}

impl Display for Rule {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} ({}): {}",
            self.id, self.quantity, self.meaning
        )
    }
}

/// A value beyond its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judgement {
    pub value: f64,
    pub limit: f64,
    /// Ratio of value and limit, or its inverse: larger where the value is worse.
    pub excess: f64,
}

/// Judges a value that must not exceed a limit; `None` if it does not.
fn above(value: f64, limit: f64) -> Option<Judgement> {
    let excess = value / limit;
    (value > limit).then_some(Judgement {
        value,
        limit,
        excess,
    })
}

/// Judges a value that must not fall below a limit; `None` if it does not.
fn below(value: f64, limit: f64) -> Option<Judgement> {
    let excess = limit / value;
    (value < limit).then_some(Judgement {
        value,
        limit,
        excess,
    })
}

/// Largest penetration for which the contact law is meant, as a share of an edge's radius.
const DEEPEST_SHARE: f64 = 0.5;
/// Shares of `a_e` and of `d` up to which a contact is stiff (MODEL, "Contact that converges with
/// the number of segments").
const STIFF_DEPTH_SHARE: f64 = 1.0 / 20.0;
const STIFF_DIAMETER_SHARE: f64 = 1.0 / 4.0;
/// Share of the vibration that may be left when a filament comes back.
const VIBRATING_SHARE: f64 = 0.05;
/// Limits on the error estimate of the impulse and on the energy residual of a brush, in
/// tolerances. The step-size control keeps the estimate below the former.
const ERROR_TOLERANCES: f64 = 3.0;
const ENERGY_TOLERANCES: f64 = 10.0;
/// Roundness of a real brush in m: at a smaller depth its filaments do not touch alike (MODEL,
/// "Force instead of depth").
const ROUNDNESS_M: f64 = 1e-4;
/// Relative difference from the stated force above which no depth gives a closer force.
const JUMP: f64 = 2e-3;
/// Spacing of tips in diameters, and length of the contact in first periods. Below the former and
/// above the latter, filaments press those before them onto the workpiece (docs/notes.md). Other
/// filaments keep each other off the workpiece.
const CROWDED: f64 = 1.4;
const PRESSED_PERIODS: f64 = 0.75;

/// The setting that makes a filament imperfect.
pub(super) const TILT: &str = "filament.lateral_tilt_rad";

/// Returns the spacing of tips that touch each other, where each filament is simulated alone.
fn packed_alone(case: &JudgedCase<'_>) -> Option<Judgement> {
    let is_alone = case.settings.brush.is_none();
    is_alone
        .then(|| below(tip_spacing(case.settings), PACKED))
        .flatten()
}

/// Rule on settings that were fitted with filaments alone, although they touch.
pub(super) const BIAS: Rule = Rule {
    id: "B015",
    quantity: "tool.filament_count",
    meaning: "Filaments touch each other, but settings were fitted with each simulated alone. The fitted friction and modulus take \
              the effect of neighbours, and are biased by more than their standard errors. Of one brush µ was 0.378 ± 0.019 alone, \
              0.282 ± 0.008 with [brush]. Such settings serve the conditions of the measurement only.",
    judge: packed_alone,
    statement: |value, _| {
        format!(
            "fitted settings are biased: filaments touch (tips {} diameters apart), but each is simulated alone",
            short(value)
        )
    },
    help: |case, _, _| {
        missing_brush(case.settings)
            .map(|_| "add [brush]; friction is fitted with interaction then".to_owned())
    },
};

/// All rules, in the order of the output.
pub const RULES: &[Rule] = &[
    Rule {
        id: "B001",
        quantity: "unresolved_steps",
        meaning: "The work of a pass is limited. Steps that miss the relative tolerance leave the impulse good to about 1 %. \
                  Contact times and peak forces are then good to some ten per cent, and the lateral amplification has no meaning.",
        judge: |case| above(case.outcome?.statistics?.unresolved_steps as f64, 0.0),
        statement: |value, _| {
            format!("{value} steps of the pass miss the tolerance, since its work is limited")
        },
        help: |_, _, _| Some("some damping (filament.damping_ratio) avoids it".to_owned()),
    },
    Rule {
        id: "B002",
        quantity: "tool.filament_count",
        meaning: "Filaments whose tips are closer than 3.5 diameters touch each other, but each is simulated alone. Neighbours \
                  keep each other off the workpiece, so that the force is lower. In dense trims with long contacts they press each \
                  other onto it. A section [brush] simulates them together, on radial trims. See docs/notes.md, \"Where it \
                  matters\".",
        judge: packed_alone,
        statement: |value, _| {
            format!(
                "filaments touch each other (tips {} diameters apart), but each is simulated alone",
                short(value)
            )
        },
        help: |case, _, _| {
            let ends = match missing_brush(case.settings)?.ends {
                Ends::Free => " with ends = \"free\"",
                Ends::Periodic => "",
            };
            Some(format!(
                "add [brush]{ends}; the force is likely {} then",
                effect_of_neighbours(case.settings)
            ))
        },
    },
    Rule {
        id: "B003",
        quantity: "max_penetration_m",
        meaning: "Nodes penetrate the workpiece by more than a twentieth of a_e or a quarter of d. The contact is softer than the \
                  workpiece can be, and results depend on contact.stiffness_n_m.",
        judge: |case| {
            let (settings, metrics) = (case.settings, case.outcome?.metrics);
            // The depth of a case that states a force is that which was found.
            let depth = if metrics.penetration_depth_m > 0.0 {
                metrics.penetration_depth_m
            } else {
                settings.process.penetration_depth_m
            };
            let stiff = (STIFF_DEPTH_SHARE * depth)
                .min(STIFF_DIAMETER_SHARE * settings.filament.diameter_m);
            above(metrics.max_penetration_m, stiff).filter(|_| deep_edge(case).is_none())
        },
        statement: |value, limit| {
            format!(
                "nodes penetrate the workpiece by {} mm, more than {} mm: the contact is soft",
                short(1e3 * value),
                short(1e3 * limit)
            )
        },
        help: |case, judgement, _| {
            // A contact that stores the same energy has it.
            let contact = &case.settings.contact;
            let needed = contact.stiffness_n_m * judgement.excess.powf(contact.exponent + 1.0);
            let digit = 10.0_f64.powf(needed.log10().floor() - 1.0);
            Some(format!(
                "under [contact]: stiffness_n_m = {:.1e}",
                (needed / digit).ceil() * digit
            ))
        },
    },
    Rule {
        id: "B004",
        quantity: "max_edge_penetration_m",
        meaning: "The filament penetrates an edge of the workpiece by more than half of its radius. The force then depends on the contact \
                  stiffness.",
        judge: deep_edge,
        statement: |value, limit| {
            format!(
                "the filament penetrates an edge by {} mm, more than {} mm, half of its radius",
                short(1e3 * value),
                short(1e3 * limit)
            )
        },
        help: |_, _, _| Some("a larger contact.stiffness_n_m penetrates less".to_owned()),
    },
    Rule {
        id: "B005",
        quantity: "contact_count",
        meaning: "Centrifugal forces splay the filaments of a cup or a cone. Their tips then lie less deep than at rest.",
        judge: |case| {
            let metrics = case.outcome?.metrics;
            let is_free = !Trim::of(case.settings).is_radial()
                && metrics.contact_angle_rad > 0.0
                && metrics.contact_count == 0;
            is_free.then(|| below(0.0, 1.0)).flatten()
        },
        statement: |_, _| {
            "the turning tool never touches the workpiece, as its filaments splay".to_owned()
        },
        help: |_, _, _| Some("press it deeper, or turn it slower".to_owned()),
    },
    Rule {
        id: "B006",
        quantity: "lateral_amplification",
        meaning: "A pass that amplifies a lateral imperfection more than a hundred times is laterally unstable. A small tilt of \
                  the filament can then change the force.",
        judge: |case| {
            let metrics = case.outcome?.metrics;
            metrics
                .laterally_unstable
                .then(|| above(metrics.lateral_amplification, UNSTABLE_AMPLIFICATION))
                .flatten()
        },
        statement: |value, limit| {
            format!(
                "laterally unstable (amplification {}, above {limit}): a small tilt can change the force",
                spanning(value)
            )
        },
        help: |_, _, of_study| {
            Some(if of_study {
                format!("under [study]: \"{TILT}\" = [0.0, 1e-4, 1e-3, 1e-2]")
            } else {
                "under [filament]: lateral_tilt_rad = 1e-3".to_owned()
            })
        },
    },
    Rule {
        id: "B007",
        quantity: "impulse_standard_error",
        meaning: "The impulse of a filament still changes from turn to turn after 50 turns. Metrics are means over the last 25 turns, and \
                  impulse_standard_error is the standard error of p_n. A filament that returns bent can strike again and again, or miss \
                  the workpiece for a turn. More damping (filament.damping_ratio) calms it.",
        judge: |case| {
            let metrics = &case.outcome?.metrics;
            let error = metrics.impulse_standard_error;
            metrics.unsteady_turns.then_some(Judgement {
                value: error,
                limit: MAX_STEADY_CHANGE,
                excess: error / MAX_STEADY_CHANGE,
            })
        },
        statement: |value, _| {
            format!(
                "turns do not become steady: F_n,w is a mean over the last ones, ± {:.1} %",
                100.0 * value
            )
        },
        help: |_, _, _| Some("more damping, if the filaments have it".to_owned()),
    },
    Rule {
        id: "B008",
        quantity: "process.turns",
        meaning: "A pass begins with a straight filament at rest. A filament of a fast brush comes back still vibrating. Its \
                  impulse then differs from that of its first pass (MODEL, \"Turns\").",
        judge: |case| {
            case.outcome?;
            left_out(case.settings)
        },
        statement: |value, _| {
            format!(
                "the filament comes back with {:.0} % of its vibration, which one pass leaves out",
                100.0 * value
            )
        },
        help: |_, _, _| Some("under [process]: turns = \"steady\"".to_owned()),
    },
    Rule {
        id: "B009",
        quantity: "impulse_error_estimate",
        meaning: "The mean impulse of a brush is known to its error estimate only. More brush.columns help where filaments differ, a \
                  smaller brush.tolerance elsewhere.",
        judge: |case| {
            let estimate = case.outcome?.interaction?.impulse_error_estimate;
            above(
                estimate,
                ERROR_TOLERANCES * case.settings.brush_or_default().tolerance,
            )
        },
        statement: |value, _| format!("p_n of the brush is known to ± {:.2} % only", 100.0 * value),
        help: |_, _, _| Some("more brush.columns, or a smaller brush.tolerance".to_owned()),
    },
    Rule {
        id: "B010",
        quantity: "energy_residual",
        meaning: "The energy of a brush does not balance: impacts are not resolved.",
        judge: |case| {
            let residual = case.outcome?.interaction?.energy_residual;
            above(
                residual,
                ENERGY_TOLERANCES * case.settings.brush_or_default().tolerance,
            )
        },
        statement: |value, _| format!("the energy of the brush balances to {value:.1e} only"),
        help: |_, _, _| Some("a smaller brush.tolerance".to_owned()),
    },
    Rule {
        id: "B011",
        quantity: "penetration_depth_m",
        meaning: "The depth of the force is far below the roundness of a brush. Only some of its filaments touch there, and the force of a \
                  real brush differs.",
        judge: |case| {
            case.asked_n?;
            below(case.outcome?.metrics.penetration_depth_m, ROUNDNESS_M)
        },
        statement: |value, limit| {
            format!(
                "the depth of this force, {} mm, is below {} mm, the roundness of a brush",
                short(1e3 * value),
                short(1e3 * limit)
            )
        },
        help: |_, _, _| None,
    },
    Rule {
        id: "B012",
        quantity: "tool_contact_normal_force_n",
        meaning: "The force jumps past the stated one: contact sets in or ends at this depth, or the turns do not become steady. A \
                  slightly different force or speed may have a depth.",
        judge: |case| {
            let (asked_n, force_n) = (
                case.asked_n?,
                case.outcome?.metrics.tool_contact_normal_force_n,
            );
            let excess = (force_n / asked_n - 1.0).abs();
            (excess > JUMP).then_some(Judgement {
                value: force_n,
                limit: asked_n,
                excess,
            })
        },
        statement: |value, limit| {
            format!(
                "F_n,w jumps past process.tool_force_n = {} N: it is {} N",
                short(limit),
                short(value)
            )
        },
        help: |_, _, _| Some("a slightly different force or speed may have a depth".to_owned()),
    },
    Rule {
        id: "B014",
        quantity: "contact.friction_coefficient",
        meaning: "In a bore narrower than the brush a straight filament is pressed along its own axis. Without friction it would \
                  buckle to either side. The pass starts with a lean of 0.001 rad against the rotation, which decides the side. \
                  Real filaments rub, and trail.",
        judge: |case| {
            case.outcome?;
            case.settings.starts_leaning().then_some(Judgement {
                value: 0.0,
                limit: 0.0,
                excess: 1.0,
            })
        },
        statement: |_, _| {
            format!(
                "frictionless filaments buckle: they start leaning {LEAN} rad against the rotation"
            )
        },
        help: |_, _, _| Some("under [contact]: friction_coefficient = 0.3".to_owned()),
    },
];

/// Returns `true` if filaments touch each other to an effect, although each is simulated alone.
fn is_packed(settings: &Settings) -> bool {
    settings.brush.is_none() && tip_spacing(settings) < PACKED
}

/// Returns the section that simulates packed filaments together; `None` if they are not packed, or
/// only simulated alone: those of cups, of cones and in tubes.
pub(super) fn missing_brush(settings: &Settings) -> Option<BrushSettings> {
    let is_possible = Trim::of(settings).is_radial() && settings.tube().is_none();
    (is_possible && is_packed(settings)).then(|| BrushSettings {
        ends: if is_posed(settings) {
            Ends::Free
        } else {
            Ends::Periodic
        },
        ..BrushSettings::default()
    })
}

/// Returns `true` if rows of the tool differ, since it is tilted.
fn is_posed(settings: &Settings) -> bool {
    settings.tool.tilt_rad() != 0.0 || settings.tool.skew_rad != 0.0
}

/// Returns the expected effect of contact between filaments on the force.
fn effect_of_neighbours(settings: &Settings) -> &'static str {
    let pass = Pass::new(settings);
    let [entry, exit] = pass.nominal_times();
    let periods = (exit - entry) * first_natural_frequency(&settings.filament) / TAU;
    if periods > PRESSED_PERIODS && tip_spacing(settings) < CROWDED {
        "higher"
    } else {
        "lower"
    }
}

/// Judges an edge whose penetration is not small against its radius.
fn deep_edge(case: &JudgedCase<'_>) -> Option<Judgement> {
    let penetration = case.outcome?.metrics.max_edge_penetration_m;
    if penetration == 0.0 {
        return None;
    }
    let (part, _) = Part::of(case.settings).ok()?;
    let radii = part.edges().iter().map(Edge::radius);
    above(
        penetration,
        DEEPEST_SHARE * radii.fold(f64::INFINITY, f64::min),
    )
}

/// Returns the share of a filament's vibration that is left at its next contact: `e^(−ζ Ω_1 T)`,
/// with the time `T` from nominal exit to the next nominal entry (MODEL, "Turns"). If the mode is
/// overdamped, the slower of its two rates counts.
fn residual_vibration(settings: &Settings) -> f64 {
    let ratio = settings.filament.damping_ratio;
    let decay = if ratio > 1.0 {
        1.0 / (ratio + (ratio * ratio - 1.0).sqrt())
    } else {
        ratio
    };
    let pass = Pass::new(settings);
    let [entry, exit] = pass.nominal_times();
    (-decay * first_natural_frequency(&settings.filament) * (pass.turn_time() - (exit - entry)))
        .exp()
}

/// Judges the vibration that a single pass leaves out. In a packed brush neighbours decide how
/// filaments arrive, so that turns hardly matter (docs/notes.md, "Turn after turn").
pub(super) fn left_out(settings: &Settings) -> Option<Judgement> {
    let is_single = settings.brush.is_none()
        && !is_packed(settings)
        && Pass::new(settings).turns() == Turns::Count(1);
    is_single
        .then(|| above(residual_vibration(settings), VIBRATING_SHARE))
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_brush_keeps_its_vibration_at_high_speed() {
        // MODEL, "Turns"
        for (velocity, expected) in [(10.0, 0.003), (30.0, 0.14)] {
            let residual = residual_vibration(&Settings::paper(velocity, 1e-3));
            assert!((residual / expected - 1.0).abs() < 0.05, "{residual}");
        }
        let overdamped = |ratio: f64| {
            let mut settings = Settings::paper(30.0, 1e-3);
            settings.filament.damping_ratio = ratio;
            residual_vibration(&settings)
        };
        assert!(
            overdamped(10.0) > overdamped(1.0)
                && overdamped(0.5) > overdamped(1.0)
                && overdamped(0.0) == 1.0
        );
    }
}
