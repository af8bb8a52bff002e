//! Allowed differences between two simulations, with reasons.
//!
//! A simulation at a tolerance is exact for settings that are off by as little. Two results may
//! therefore differ by the tolerance, and by the change of exact results when depth, speed,
//! stiffness and tilt change by the tolerance. This change is computed only where the tolerance
//! does not suffice: where filaments bounce often or just graze the workpiece, or where the motion
//! is laterally unstable. Where results change so much that the comparison says nothing, the pair
//! is counted as too sensitive.

use std::fmt::{self, Display, Formatter};

use bristle::model::metrics::{Metrics, UNSTABLE_AMPLIFICATION};
use bristle::model::settings::{Settings, Turns};

use crate::pairs::{Pair, Run};
use crate::simulate::{Result, SimulationOutcome, outcomes};

/// Tolerance of the simulations that measure the sensitivity of results.
const EXACT_TOLERANCE: f64 = 1e-9;
/// Relative change of a result above which it is too sensitive to compare.
const MAX_CHANGE: f64 = 0.02;
/// Relative change of one result from which chance decides about all.
const MIN_CHAOTIC: f64 = 1.0;
/// Allowed difference of steady turns, which end when the impulse changes by less than 1e-3 from
/// turn to turn. The rest of a change that shrinks by a third or more is half of that; each of the
/// two may end a turn earlier.
const STEADY_SLACK: f64 = 3e-3;

/// Allowed difference of the impulse on edges, a sum over the interpolants of steps.
const EDGE_SLACK: f64 = 2e-3;

/// Verdict on a pair.
#[derive(Clone, Debug)]
pub enum Verdict {
    Same,
    /// At least one of the two cannot be simulated.
    Refused(String),
    /// Exact results change by more than [`MAX_CHANGE`] when the settings change by the tolerance.
    Sensitive(String),
    /// Both differ by more than the tolerance and the settings explain.
    Differs(String),
}

impl Display for Verdict {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Same => formatter.write_str("same"),
            Self::Refused(message) => write!(formatter, "refused: {message}"),
            Self::Sensitive(message) => write!(formatter, "too sensitive: {message}"),
            Self::Differs(message) => write!(formatter, "DIFFERS: {message}"),
        }
    }
}

/// A number of a result, and the scale of its differences.
#[derive(Clone, Copy, Debug)]
struct ComparedNumber {
    name: &'static str,
    value: f64,
    scale: f64,
    /// Allowed difference beyond the tolerance, relative to the scale.
    slack: f64,
}

/// Judges a pair with these two results.
pub fn judge(pair: &Pair, results: &[Result]) -> Verdict {
    let [one, other] = results else {
        unreachable!("two results of a pair")
    };
    let (one, other) = match (one, other) {
        (Ok(one), Ok(other)) => (one, other),
        (Err(message), _) | (_, Err(message)) => return Verdict::Refused(message.clone()),
    };
    let is_planar_and_in_space = matches!(pair.runs, [_, Run::InSpace(_)]);
    if is_planar_and_in_space && one.metrics.lateral_amplification > UNSTABLE_AMPLIFICATION {
        return Verdict::Sensitive("laterally unstable".to_owned());
    }
    let excess = excess(pair, one, other, |_| 0.0);
    let Some(first) = excess else {
        return Verdict::Same;
    };
    let Some(spread) = spread(pair) else {
        return Verdict::Differs(first);
    };
    let largest = spread
        .iter()
        .fold(0.0_f64, |largest, (_, share)| largest.max(*share));
    // All turns have one name; the most sensitive one is among them.
    let share = |name: &'static str| {
        let of_name = spread.iter().filter(|(other, _)| *other == name);
        of_name.fold(0.0_f64, |largest, (_, share)| largest.max(*share))
    };
    match self::excess(pair, one, other, share) {
        Some(message) if largest < MIN_CHAOTIC => {
            Verdict::Differs(format!("{message}, sensitivity {largest:.1e}"))
        }
        _ if largest > MAX_CHANGE => {
            Verdict::Sensitive(format!("{first}, sensitivity {largest:.1e}"))
        }
        _ => Verdict::Same,
    }
}

/// Describes the number that exceeds its allowed difference most. `share` is the allowed difference
/// beyond the tolerance.
fn excess(
    pair: &Pair,
    one: &SimulationOutcome,
    other: &SimulationOutcome,
    share: impl Fn(&'static str) -> f64,
) -> Option<String> {
    let settings = pair.settings();
    let is_steady = settings.process.turns() == Turns::Steady;
    if !is_steady
        && one.turns.len() != other.turns.len()
        && one.metrics.turns == other.metrics.turns
    {
        return Some(format!(
            "{} and {} turns are listed",
            one.turns.len(),
            other.turns.len()
        ));
    }
    let image = image(pair, &other.metrics);
    let numbers = numbers(pair, one, &one.metrics, other)
        .into_iter()
        .zip(self::numbers(pair, other, &image, one));
    let excesses = numbers.filter_map(|(a, b)| {
        let difference = (a.value - b.value).abs() / a.scale.max(b.scale);
        // The stated error differs in the last digits from that of another pass.
        let stated = 1.1 * one.stated_error.max(other.stated_error);
        let allowed = pair.tolerance.max(stated) + a.slack + share(a.name);
        // Numbers that are not finite differ, too.
        let is_within = difference <= allowed || a.value == b.value;
        (!is_within).then(|| {
            let ComparedNumber { name, value, .. } = a;
            (
                difference / allowed,
                format!(
                    "{name} is {value:e} and {:e}: by {difference:.1e}, allowed {allowed:.1e}",
                    b.value
                ),
            )
        })
    });
    excesses
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, message)| message)
}

/// The numbers of a result to compare.
fn numbers(
    pair: &Pair,
    outcome: &SimulationOutcome,
    metrics: &Metrics,
    partner: &SimulationOutcome,
) -> Vec<ComparedNumber> {
    let settings = pair.settings();
    let number = |name, value, scale| ComparedNumber {
        name,
        value,
        scale,
        slack: 0.0,
    };
    if let [Run::Settled(_), _] = pair.runs {
        return vec![number("energy taken at rest", outcome.settled, 1.0)];
    }
    // The tolerance holds for velocities relative to the brushing velocity, and so for impulses
    // relative to a filament's momentum.
    let filament = &settings.filament;
    let mass = filament.density_kg_m3 * filament.root_area_m2() * filament.length_m;
    let momentum = 0.1 * mass * settings.process.brushing_velocity_m_s;
    let impulse = metrics.contact_normal_impulse_n_s.max(momentum);
    let turns = outcome
        .turns
        .iter()
        .zip(&partner.turns)
        .map(|(turn, _)| number("p_n of a turn", *turn, turn.max(momentum)));
    if outcome.metrics.turns != partner.metrics.turns && settings.process.turns() != Turns::Steady {
        return turns.collect();
    }
    let is_steady = settings.process.turns() == Turns::Steady;
    let slack = if is_steady { STEADY_SLACK } else { 0.0 };
    let mut numbers = vec![ComparedNumber {
        slack,
        ..number("p_n", metrics.contact_normal_impulse_n_s, impulse)
    }];
    // The tolerance of a brush is that of the impulse.
    if !pair.is_of_brush() && !is_steady {
        let reach = settings.tool_radius_m();
        let work = impulse
            * settings.process.brushing_velocity_m_s
            * settings.contact.friction_coefficient;
        numbers.extend([
            number("impulse along x", metrics.contact_impulse_x_n_s, impulse),
            number("impulse along y", metrics.contact_impulse_y_n_s, impulse),
            number("impulse along z", metrics.contact_impulse_z_n_s, impulse),
            number(
                "angular impulse",
                metrics.contact_angular_impulse_n_m_s,
                reach * impulse,
            ),
            ComparedNumber {
                slack: EDGE_SLACK,
                ..number(
                    "impulse on edges",
                    metrics.edge_contact_normal_impulse_n_s,
                    impulse,
                )
            },
            number(
                "friction work",
                metrics.friction_work_j,
                metrics.friction_work_j.max(work),
            ),
            number(
                "tip deflection",
                metrics.max_tip_deflection_m,
                0.1 * filament.length_m,
            ),
        ]);
    }
    // Results may have more turns than others: all else comes first.
    numbers.extend(turns);
    numbers
}

/// The metrics of the second set-up in the frame of the first one.
fn image(pair: &Pair, metrics: &Metrics) -> Metrics {
    let Metrics {
        contact_impulse_x_n_s: x,
        contact_impulse_y_n_s: y,
        contact_impulse_z_n_s: z,
        ..
    } = *metrics;
    let (sin, cos) = pair.turned_by.sin_cos();
    Metrics {
        contact_impulse_x_n_s: cos * x + sin * y,
        contact_impulse_y_n_s: cos * y - sin * x,
        contact_impulse_z_n_s: if pair.is_mirrored { -z } else { z },
        ..metrics.clone()
    }
}

/// Change of each number, as a share of its scale, if settings change by the tolerance of the pair.
fn spread(pair: &Pair) -> Option<Vec<(&'static str, f64)>> {
    let [_, reference] = &pair.runs;
    reference.settings()?;
    let off = if pair.is_of_brush() {
        1e-4
    } else {
        pair.tolerance
    };
    let changes: &[fn(&mut Settings, f64)] = &[
        |_, _| (),
        |settings, factor| settings.process.penetration_depth_m *= factor,
        |settings, factor| settings.process.brushing_velocity_m_s *= factor,
        |settings, factor| settings.filament.youngs_modulus_pa *= factor,
        |settings, factor| settings.filament.lateral_tilt_rad *= factor,
        |settings, factor| settings.contact.friction_coefficient *= factor,
    ];
    let results_at = |tolerance: Option<f64>| -> Vec<SimulationOutcome> {
        let factors = changes
            .iter()
            .flat_map(|change| [1.0 - off, 1.0 + off].map(|factor| (change, factor)));
        let variants: Vec<Run> = factors
            .map(|(change, factor)| {
                reference.with(|settings| {
                    let solver = &mut settings.solver;
                    solver.relative_tolerance = tolerance.unwrap_or(solver.relative_tolerance);
                    change(settings, factor);
                })
            })
            .collect();
        let results = outcomes(&variants.iter().collect::<Vec<_>>());
        results
            .into_iter()
            .filter_map(std::result::Result::ok)
            .collect()
    };
    let mut results = results_at(Some(EXACT_TOLERANCE));
    if results.is_empty() {
        // Rounding can exceed so tight a tolerance after many turns.
        results = results_at(None);
    }
    let longest = results.iter().max_by_key(|outcome| outcome.turns.len())?;
    let of = |outcome| numbers(pair, outcome, &outcome.metrics, longest);
    let all: Vec<Vec<ComparedNumber>> = results.iter().map(of).collect();
    let names = of(longest).into_iter().enumerate().map(|(index, first)| {
        let values = || {
            all.iter()
                .filter_map(|numbers| numbers.get(index))
                .map(|number| number.value)
        };
        let [least, most] = [
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ];
        (first.name, (most - least) / first.scale)
    });
    Some(names.collect())
}
