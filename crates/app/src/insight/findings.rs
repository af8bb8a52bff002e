//! Findings: statements about results that are not resolved or misleading, as values.
//!
//! A [`Rule`] judges one case. Its result for a contact, a brush or the cases of a study is a
//! [`Finding`]. The terminal, files and Python show the same finding. `bristle explain B003`
//! explains an `id`, `--ignore B003` silences it.

use std::f64::consts::TAU;
use std::fmt::{self, Display, Formatter};

use bristle::model::filament::first_natural_frequency;
use bristle::model::metrics::{Metrics, UNSTABLE_AMPLIFICATION};
use bristle::model::parameters::Parameter;
use bristle::model::settings::{BrushSettings, Ends, MAX_STEADY_CHANGE, Settings, Turns};
use bristle::simulation::{Pass, Statistics};
use bristle::tool::{LEAN, Trim};
use bristle::workpiece::{Edge, Part, Workpiece};
use bristle_study::grid::{
    CaseResult, DEPTH, FORCE, Interaction, Study, TURNS, VELOCITY, equation,
};
use bristle_study::input::packing::{PACKED, tip_spacing};
use bristle_study::text::layout::Warning;
use bristle_study::text::number::{short, spanning};
use serde::Serialize;

/// One case as rules see it.
#[derive(Clone, Copy)]
pub struct JudgedCase<'a> {
    /// Its settings, at the depth that was found if they state a force.
    pub settings: &'a Settings,
    /// The force in N that the settings state in place of a depth.
    pub asked_n: Option<f64>,
    /// Its result; `None` if it failed.
    pub outcome: Option<JudgedResult<'a>>,
}

/// The result of a case.
#[derive(Clone, Copy)]
pub struct JudgedResult<'a> {
    /// Its metrics.
    pub metrics: &'a Metrics,
    /// Statistics of its pass; `None` for a brush that is not a case of a study.
    pub statistics: Option<&'a Statistics>,
    /// Results of a brush beyond its metrics.
    pub interaction: Option<&'a Interaction>,
}

/// A value beyond its limit.
#[derive(Clone, Copy, Debug)]
struct Judgement {
    value: f64,
    limit: f64,
    /// Ratio of value and limit, or its inverse: larger where the value is worse.
    excess: f64,
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

/// Test of a case, with its message.
pub struct Rule {
    /// Its number.
    pub id: &'static str,
    /// The column or the setting that it judges.
    pub quantity: &'static str,
    /// Meaning and remedy, for `bristle explain`.
    pub meaning: &'static str,
    judge: fn(&JudgedCase<'_>) -> Option<Judgement>,
    /// The statement about a value and its limit.
    statement: fn(f64, f64) -> String,
    /// Remedy for the worst case; the last argument is `true` in a study.
    help: fn(&JudgedCase<'_>, Judgement, bool) -> Option<String>,
}

/// A rule that has found something.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The number of the rule.
    pub id: &'static str,
    /// Severity: all findings are warnings.
    pub severity: &'static str,
    /// The column or the setting that was judged.
    pub quantity: &'static str,
    /// Its value in the case that is worst.
    pub value: f64,
    /// The limit there.
    pub limit: f64,
    /// Rows of `runs.csv` with this finding; empty for one contact or brush.
    pub rows: Vec<usize>,
    /// The finding in a sentence.
    pub statement: String,
    /// Remedy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
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
const TILT: &str = "filament.lateral_tilt_rad";

/// Returns the spacing of tips that touch each other, where each filament is simulated alone.
fn packed_alone(case: &JudgedCase<'_>) -> Option<Judgement> {
    let is_alone = case.settings.brush.is_none();
    is_alone
        .then(|| below(tip_spacing(case.settings), PACKED))
        .flatten()
}

/// Rule on settings that were fitted with filaments alone, although they touch.
const BIAS: Rule = Rule {
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

/// Returns the rule with an id; the case of its letter does not matter.
#[must_use]
pub fn rule(id: &str) -> Option<&'static Rule> {
    RULES
        .iter()
        .chain([&BIAS])
        .find(|rule| rule.id.eq_ignore_ascii_case(id))
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

impl Finding {
    /// Returns the finding as a warning.
    #[must_use]
    pub fn warning(&self) -> Warning {
        let warning = Warning::new(self.statement.clone()).with_id(self.id);
        match &self.help {
            Some(help) => warning.with_help(help.clone(), ""),
            None => warning,
        }
    }
}

/// Applies the rules to one contact or brush.
#[must_use]
pub fn judge_case(case: &JudgedCase<'_>) -> Vec<Finding> {
    let of_rule = |rule: &Rule| {
        let judgement = (rule.judge)(case)?;
        Some(found(rule, case, judgement, Vec::new(), String::new()))
    };
    RULES.iter().filter_map(of_rule).collect()
}

/// Applies the rules to the cases of a study. The worst case of each rule stands for all; the first
/// one among equals.
#[must_use]
pub fn judge_study(study: &Study, results: &[CaseResult]) -> Vec<Finding> {
    let settings: Vec<Settings> = results
        .iter()
        .enumerate()
        .map(|(case, result)| study.settings_found(case, result))
        .collect();
    let cases: Vec<JudgedCase<'_>> = settings
        .iter()
        .zip(results)
        .enumerate()
        .map(|(case, (settings, result))| JudgedCase {
            settings,
            asked_n: study.settings(case).process.tool_force_n,
            outcome: result.as_ref().ok().map(|summary| JudgedResult {
                metrics: &summary.metrics,
                statistics: Some(&summary.statistics),
                interaction: summary.brush.as_ref(),
            }),
        })
        .collect();
    let of_rule = |rule: &Rule| {
        let judged: Vec<(usize, Judgement)> = cases
            .iter()
            .enumerate()
            .filter_map(|(case, each)| Some((case, (rule.judge)(each)?)))
            .collect();
        let &(worst, judgement) = judged.iter().reduce(|worst, next| {
            if next.1.excess > worst.1.excess {
                next
            } else {
                worst
            }
        })?;
        let rows: Vec<usize> = judged.iter().map(|(case, _)| case + 1).collect();
        let cases_in_words = if results.len() == 1 {
            String::new()
        } else {
            let most = if rows.len() == 1 { "in" } else { "most in" };
            format!(
                "; {} of {} cases, {most} row {}",
                rows.len(),
                results.len(),
                worst + 1
            )
        };
        let mut finding = found(rule, &cases[worst], judgement, rows, cases_in_words);
        // A study that sweeps the tilt shows what it does.
        if rule.id == "B006" && study.sweep(TILT).is_some() {
            finding.help = None;
        }
        Some(finding)
    };
    RULES.iter().filter_map(of_rule).collect()
}

fn found(
    rule: &Rule,
    case: &JudgedCase<'_>,
    judgement: Judgement,
    rows: Vec<usize>,
    in_words: String,
) -> Finding {
    let Judgement { value, limit, .. } = judgement;
    Finding {
        id: rule.id,
        severity: "warning",
        quantity: rule.quantity,
        value,
        limit,
        statement: (rule.statement)(value, limit) + &in_words,
        help: (rule.help)(case, judgement, !rows.is_empty()),
        rows,
    }
}

/// Returns the finding about settings that were fitted with filaments alone, although they touch.
#[must_use]
pub fn bias_of_fit(settings: &Settings) -> Option<Finding> {
    let case = JudgedCase {
        settings,
        asked_n: None,
        outcome: None,
    };
    let judgement = (BIAS.judge)(&case)?;
    Some(found(&BIAS, &case, judgement, Vec::new(), String::new()))
}

/// Returns `true` if filaments touch each other to an effect, although each is simulated alone.
fn is_packed(settings: &Settings) -> bool {
    settings.brush.is_none() && tip_spacing(settings) < PACKED
}

/// Returns the section that simulates packed filaments together; `None` if they are not packed, or
/// only simulated alone: those of cups, of cones and in tubes.
pub(crate) fn missing_brush(settings: &Settings) -> Option<BrushSettings> {
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

/// Returns `true` if a case is laterally unstable; `false` for a failed one.
#[must_use]
pub fn is_unstable(result: &CaseResult) -> bool {
    result
        .as_ref()
        .is_ok_and(|summary| summary.metrics.laterally_unstable)
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
#[must_use]
pub fn residual_vibration(settings: &Settings) -> f64 {
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
fn left_out(settings: &Settings) -> Option<Judgement> {
    let is_single = settings.brush.is_none()
        && !is_packed(settings)
        && Pass::new(settings).turns() == Turns::Count(1);
    is_single
        .then(|| above(residual_vibration(settings), VIBRATING_SHARE))
        .flatten()
}

/// Returns the note of advice on cases in which a single pass leaves out much vibration. `told` has
/// the numbers of the cited cases, counted from 0.
pub(crate) fn vibrating_note(
    study: &Study,
    results: &[CaseResult],
    told: &[usize],
) -> Option<String> {
    let all: Vec<(usize, Judgement)> = told
        .iter()
        .filter_map(|&case| {
            let settings = study.settings_found(case, &results[case]);
            Some((case, left_out(&settings)?))
        })
        .collect();
    let (worst, judgement) = all.iter().reduce(|worst, next| {
        if next.1.value > worst.1.value {
            next
        } else {
            worst
        }
    })?;
    let cases = if told.len() == 1 { "case" } else { "cases" };
    Some(format!(
        "In {} of {} {cases} the filament comes back still vibrating, with up to {:.0} % of its vibration (row {}). Simulate \
         turn after turn with {TURNS} = \"{}\".",
        all.len(),
        told.len(),
        100.0 * judgement.value,
        worst + 1,
        Turns::STEADY
    ))
}

/// Returns velocity and depth of a case in words, or the force in place of the depth.
pub(crate) fn place(settings: &Settings) -> String {
    let shown =
        |path| Parameter::find(path).map(|parameter| equation(parameter, parameter.get(settings)));
    let second = if settings.process.tool_force_n.is_some() {
        FORCE
    } else {
        DEPTH
    };
    [VELOCITY, second]
        .into_iter()
        .filter_map(shown)
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{brush, result};
    use bristle::model::settings::{ToolKind, WorkpieceKind};
    use bristle_study::grid::Sweep;
    use bristle_study::input::document::Document;
    use bristle_study::text::columns;

    const FILE: &str = concat!(
        brush!(8),
        "
        [workpiece]
        kind = \"edge\"
        edge_radius_m = 0.2e-3
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        brushing_velocity_m_s = [5.0, 10.0, 15.0]
        "
    );

    /// Largest number of words in a sentence of a message or of its explanation.
    const MAX_WORDS: usize = 25;

    /// Returns the paper's brush with so few filaments that they do not touch each other.
    fn sparse(velocity: f64) -> Settings {
        let mut settings = Settings::paper(velocity, 1e-3);
        settings.tool.filament_count = 1000.0;
        settings
    }

    fn told(settings: &Settings, asked_n: Option<f64>, metrics: &Metrics) -> Vec<Finding> {
        judge_case(&JudgedCase {
            settings,
            asked_n,
            outcome: Some(JudgedResult {
                metrics,
                statistics: None,
                interaction: None,
            }),
        })
    }

    fn ids(findings: &[Finding]) -> Vec<&str> {
        findings.iter().map(|finding| finding.id).collect()
    }

    #[test]
    fn rules_are_numbered_and_their_words_are_short() {
        assert!(RULES.is_sorted_by(|before, rule| before.id < rule.id));
        for rule in RULES.iter().chain([&BIAS]) {
            assert_short_sentences(rule.meaning);
        }
        assert!(rule("b003").is_some() && rule("b015").is_some() && rule("B999").is_none());
    }

    fn assert_short_sentences(text: &str) {
        for sentence in text.split_inclusive(". ") {
            let words = sentence.split_whitespace().count();
            assert!(words <= MAX_WORDS, "{words} words: {sentence}");
        }
    }

    /// Each value is just beyond, and just within, its limit.
    #[test]
    fn each_rule_finds_what_is_beyond_its_limit() {
        let edge = Document::parse(FILE, "case.toml")
            .and_then(|document| document.settings())
            .map(|mut settings| {
                settings.tool.filament_count = 1000.0;
                settings
            })
            .expect("settings");
        let mut cup = sparse(10.0);
        cup.tool.kind = ToolKind::Cup;
        let metrics = |change: fn(&mut Metrics)| {
            let mut metrics = Metrics {
                penetration_depth_m: 1e-3,
                ..Metrics::default()
            };
            change(&mut metrics);
            metrics
        };
        for (settings, asked_n, metrics, expected) in [
            (
                &edge,
                None,
                metrics(|own| own.max_edge_penetration_m = 0.11e-3),
                &["B004"][..],
            ),
            (
                &edge,
                None,
                metrics(|own| own.max_edge_penetration_m = 0.1e-3),
                &[],
            ),
            (
                &edge,
                None,
                metrics(|own| own.max_penetration_m = 0.06e-3),
                &["B003"],
            ),
            (
                &edge,
                None,
                metrics(|own| own.max_penetration_m = 0.05e-3),
                &[],
            ),
            (
                &cup,
                None,
                metrics(|own| own.contact_angle_rad = 1.0),
                &["B005"],
            ),
            (&edge, None, metrics(|own| own.contact_angle_rad = 1.0), &[]),
            (
                &edge,
                None,
                metrics(|own| own.unsteady_turns = true),
                &["B007"],
            ),
            (
                &edge,
                None,
                metrics(|own| {
                    (own.laterally_unstable, own.lateral_amplification) = (true, 101.0);
                }),
                &["B006"],
            ),
            (
                &edge,
                Some(166.0),
                metrics(|own| own.tool_contact_normal_force_n = 166.1),
                &[],
            ),
            (
                &edge,
                Some(10.0),
                metrics(|own| own.tool_contact_normal_force_n = 14.9),
                &["B012"],
            ),
            (
                &edge,
                Some(10.0),
                metrics(|own| {
                    own.penetration_depth_m = 0.9e-4;
                    own.tool_contact_normal_force_n = 10.0;
                }),
                &["B011"],
            ),
        ] {
            assert_eq!(ids(&told(settings, asked_n, &metrics)), expected);
        }
        let quiet = Metrics::default();
        assert_eq!(
            ids(&told(&Settings::paper(10.0, 1e-3), None, &quiet)),
            ["B002"]
        );
        assert_eq!(ids(&told(&sparse(30.0), None, &quiet)), ["B008"]);
        assert_eq!(ids(&told(&sparse(10.0), None, &quiet)), [""; 0]);
        let mut two = sparse(30.0);
        two.process.turns = Some(Turns::Count(2));
        assert_eq!(ids(&told(&two, None, &quiet)), [""; 0]);
    }

    /// `[brush]` is advised only where the checks accept it.
    #[test]
    fn a_brush_is_advised_where_it_can_be_simulated() {
        let packed = Settings::paper(10.0, 1e-3);
        let help = |settings: &Settings| {
            let [finding] = &told(settings, None, &Metrics::default())[..] else {
                panic!("one finding");
            };
            assert_eq!(finding.id, "B002");
            let brush = missing_brush(settings);
            assert!(finding.help.is_some() == brush.is_some());
            let bias = bias_of_fit(settings).expect("they touch");
            assert!(bias.help.is_some() == brush.is_some());
            let together = Settings {
                brush,
                ..settings.clone()
            };
            together.check().expect("settings");
            together.brush.map(|brush| brush.ends)
        };
        assert_eq!(help(&packed), Some(Ends::Periodic));
        let mut tilted = packed.clone();
        tilted.tool.tilt_rad = Some(0.05);
        assert_eq!(help(&tilted), Some(Ends::Free));
        let mut cup = packed.clone();
        cup.tool.kind = ToolKind::Cup;
        assert_eq!(help(&cup), None);
    }

    #[test]
    fn work_and_brushes_are_judged_too() {
        let settings = Settings {
            brush: Some(BrushSettings::default()),
            ..Settings::paper(10.0, 1e-3)
        };
        let statistics = Statistics {
            unresolved_steps: 7,
            ..Statistics::default()
        };
        let tolerance = settings.brush_or_default().tolerance;
        let interaction = Interaction {
            impulse_error_estimate: 3.1 * tolerance,
            energy_residual: 11.0 * tolerance,
            ..Interaction::default()
        };
        let found = judge_case(&JudgedCase {
            settings: &settings,
            asked_n: None,
            outcome: Some(JudgedResult {
                metrics: &Metrics::default(),
                statistics: Some(&statistics),
                interaction: Some(&interaction),
            }),
        });
        assert_eq!(ids(&found), ["B001", "B009", "B010"]);
    }

    #[test]
    fn a_soft_contact_is_told_with_a_stiffness_that_is_enough() {
        let metrics = Metrics {
            max_penetration_m: 0.1e-3,
            ..Metrics::default()
        };
        let found = told(&sparse(10.0), None, &metrics);
        let help = found[0].help.as_deref();
        assert_eq!(help, Some("under [contact]: stiffness_n_m = 4.0e5"));
    }

    #[test]
    fn a_study_tells_how_many_cases_and_the_worst() {
        let velocities = Parameter::find(VELOCITY).expect("it exists");
        let velocities = Sweep::list(velocities, vec![10.0, 30.0, 25.0, 20.0]).expect("right");
        let study = Study::new(sparse(10.0), vec![velocities]).expect("right");
        let failed = vec![Err("failed".to_owned()); 4];
        assert_eq!(judge_study(&study, &failed), []);
        let results = [Metrics::default(), Metrics::default(), Metrics::default()].map(result);
        let results = [results.as_slice(), &failed[..1]].concat();
        let found = judge_study(&study, &results);
        assert_eq!((ids(&found), &found[0].rows), (vec!["B008"], &vec![2, 3]));
        assert!(
            found[0]
                .statement
                .ends_with("leaves out; 2 of 4 cases, most in row 2"),
            "{}",
            found[0].statement
        );
        let note = vibrating_note(&study, &results, &[0, 1, 2, 3]).expect("they vibrate");
        assert!(
            note.starts_with("In 3 of 4 cases")
                && note.contains("up to 14 % of its vibration (row 2)"),
            "{note}"
        );
        assert_eq!(vibrating_note(&study, &results, &[0]), None);
    }

    #[test]
    fn only_frictionless_tubes_say_that_filaments_lean() {
        let mut tube = sparse(10.0);
        tube.workpiece.kind = WorkpieceKind::bore(0.175);
        let found = |tube: &Settings| {
            let tube = tube.at_depth(0.18 - 0.175);
            told(&tube, None, &Metrics::default())
        };
        assert_eq!(ids(&found(&tube)), ["B014"]);
        tube.contact.friction_coefficient = 0.3;
        assert_eq!(ids(&found(&tube)), [""; 0]);
    }

    /// Messages have at most three lines of 80 columns, and short sentences.
    #[test]
    fn findings_are_short() {
        let mut settings = Settings::paper(30.0, 1e-3);
        settings.tool.tilt_rad = Some(0.05);
        let of_study = |rule| (rule, "; 1000 of 1000 cases, most in row 1000");
        for (rule, in_words) in RULES.iter().map(of_study).chain([(&BIAS, "")]) {
            let judgement = Judgement {
                value: 0.123_456,
                limit: 0.111_111,
                excess: 1.1,
            };
            let case = JudgedCase {
                settings: &settings,
                asked_n: None,
                outcome: None,
            };
            let finding = found(rule, &case, judgement, vec![1], in_words.to_owned());
            assert_short_sentences(&finding.statement);
            assert_short_sentences(finding.help.as_deref().unwrap_or_default());
            let text = finding.warning().to_string();
            assert!(text.lines().count() <= 3, "{text}");
            assert!(text.lines().all(|line| columns(line) <= 80), "{text}");
        }
    }

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
