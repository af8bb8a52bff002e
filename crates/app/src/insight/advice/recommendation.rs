//! The recommendation: one velocity and depth for the wanted force, its strengths and weaknesses.

use bristle::model::metrics::SWEEPING_RATIO;
use bristle::model::settings::Settings;
use bristle_study::grid::{DEPTH, Study, VELOCITY};
use bristle_study::text::layout::wrap;
use bristle_study::text::number::{short, significant, uncertain};
use serde::Serialize;

use super::cited::force;
use super::limits::Limits;
use super::outcome::{OperatingPoint, Outcome};
use super::rank::{NEAR, coarse_rank, rank};
use super::section::Section;
use super::verification::Verified;
use crate::insight::slices::Varied;

/// Largest distance of the ends of a narrow band from the force, as a share of the force.
const NARROW: f64 = 0.25;

/// Recommended settings.
#[derive(Clone, Debug, Serialize)]
pub struct Recommendation {
    /// Row of the case in `runs.csv`, or the rows between which the recommendation lies.
    pub rows: Vec<usize>,
    /// Velocity and depth.
    #[serde(flatten)]
    pub place: OperatingPoint,
    /// The expected outcome; after the verification, the simulated one.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// Strengths.
    pub strengths: Vec<String>,
    /// Weaknesses.
    pub weaknesses: Vec<String>,
    /// Result of the verification.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verified: Option<Verified>,
    #[serde(skip)]
    pub(super) settings: Settings,
    /// The further settings that distinguish it, as text.
    #[serde(skip)]
    condition: String,
    /// The path of the setting that is changed to reach the force.
    #[serde(skip)]
    pub(super) changed: &'static str,
    #[serde(skip)]
    is_end: bool,
    /// The cases that are within the limits.
    #[serde(skip)]
    considered: Considered,
}

/// Ranges of the cases within the limits.
#[derive(Clone, Copy, Debug)]
struct Considered {
    speed_rpm: [f64; 2],
    depth_m: [f64; 2],
    force_n: [f64; 2],
}

impl Considered {
    const NONE: Self = Self {
        speed_rpm: [f64::INFINITY, f64::NEG_INFINITY],
        depth_m: [f64::INFINITY, f64::NEG_INFINITY],
        force_n: [f64::INFINITY, f64::NEG_INFINITY],
    };

    /// Includes a case.
    fn with(self, place: &OperatingPoint, outcome: &Outcome) -> Self {
        let widened = |[least, most]: [f64; 2], value: f64| [least.min(value), most.max(value)];
        Self {
            speed_rpm: widened(self.speed_rpm, place.rotational_speed_rpm),
            depth_m: widened(self.depth_m, place.penetration_depth_m),
            force_n: widened(self.force_n, outcome.central_n()),
        }
    }

    /// Returns the sentence that all cases miss a force in N to the same side, if they do.
    fn miss(&self, target_n: f64) -> Option<String> {
        let [least_n, most_n] = self.force_n;
        let target = short(target_n);
        let [slowest, fastest] = self.speed_rpm.map(short);
        let [shallowest, deepest] = self.depth_m.map(|depth| short(1e3 * depth));
        if most_n < (1.0 - NEAR) * target_n {
            return Some(format!(
                "No setting up to {fastest} rpm and {deepest} mm reaches {target} N; the most is {} N",
                significant(most_n)
            ));
        }
        (least_n > (1.0 + NEAR) * target_n).then(|| {
            format!(
                "All settings from {slowest} rpm and {shallowest} mm exceed {target} N; the least is {} N",
                significant(least_n)
            )
        })
    }
}

/// Returns the best case of all sections by [`rank`]. `None` without a goal, or without a case
/// within the limits.
pub(super) fn recommend(
    study: &Study,
    sections: &[Section],
    limits: &Limits,
) -> Option<Recommendation> {
    if *limits == Limits::default() {
        return None;
    }
    let of_section = |section: &Section| {
        let sides = [&section.slice.x, &section.slice.y];
        let new = |rows: Vec<usize>,
                   place: OperatingPoint,
                   outcome: &Outcome,
                   settings: Settings,
                   changed: &'static str,
                   is_end: bool| {
            Recommendation {
                rows,
                place,
                outcome: outcome.clone(),
                strengths: Vec::new(),
                weaknesses: Vec::new(),
                verified: None,
                settings,
                condition: section.slice.condition(),
                changed,
                is_end,
                considered: Considered::NONE,
            }
        };
        let cells = section.cells.iter().flatten().flatten();
        let within =
            cells.filter(|cell| limits.allow(&cell.place, &cell.outcome) && force(cell) > 0.0);
        let simulated = within.map(|cell| {
            let is_end = |(side, at): (&&Varied, usize)| {
                side.varies() && (at == 0 || at + 1 == side.values.len())
            };
            let is_end = sides.iter().zip(cell.position).any(is_end);
            let settings = study
                .settings(cell.row - 1)
                .at_depth(cell.place.penetration_depth_m);
            let changed = if sides[1].varies() || study.is_pressed_on() {
                DEPTH
            } else {
                VELOCITY
            };
            new(
                vec![cell.row],
                cell.place,
                &cell.outcome,
                settings,
                changed,
                is_end,
            )
        });
        let between = section.interpolated.iter();
        let between = between.map(|each| {
            new(
                each.between_rows.to_vec(),
                each.place,
                &each.interpolated,
                each.settings.clone(),
                each.changed,
                false,
            )
        });
        simulated.chain(between).collect::<Vec<_>>()
    };
    let candidates: Vec<Recommendation> = sections.iter().flat_map(of_section).collect();
    let considered = candidates.iter().fold(Considered::NONE, |all, candidate| {
        all.with(&candidate.place, &candidate.outcome)
    });
    let better = |a: &Recommendation, b: &Recommendation| {
        let coarse = coarse_rank(limits, &a.outcome, &b.outcome);
        coarse
            .then(a.is_end.cmp(&b.is_end))
            .then_with(|| rank(limits, &a.outcome, &b.outcome))
    };
    let mut best = candidates.into_iter().min_by(better)?;
    best.considered = considered;
    best.weigh(limits);
    Some(best)
}

impl Recommendation {
    /// Fills in strengths and weaknesses.
    pub(super) fn weigh(&mut self, limits: &Limits) {
        let (force, ratio) = (self.outcome.central_n(), self.outcome.contact_time_ratio);
        let ends = self.outcome.ends();
        let is_narrow = ends
            .into_iter()
            .all(|end| (end - force).abs() <= NARROW * force);
        let shown = format!("ε_tc = {ratio:.2}");
        let of_band = (is_narrow, "narrow band".to_owned(), "wide band".to_owned());
        let reasons = [
            Some((
                ratio > SWEEPING_RATIO,
                format!("filaments sweep ({shown})"),
                format!("filaments strike ({shown})"),
            )),
            Some((
                !self.outcome.laterally_unstable,
                "laterally stable".to_owned(),
                "laterally unstable".to_owned(),
            )),
            // Without a stated uncertainty nothing is known of it.
            (ends[0] < ends[1]).then_some(of_band),
            Some((
                !self.is_end,
                "inside the grid".to_owned(),
                "at an end of the grid".to_owned(),
            )),
        ];
        (self.strengths, self.weaknesses) = (Vec::new(), Vec::new());
        for (speaks_for, strength, weakness) in reasons.into_iter().flatten() {
            if speaks_for {
                self.strengths.push(strength)
            } else {
                self.weaknesses.push(weakness)
            }
        }
        let off = limits
            .target_force_n
            .map_or(0.0, |target| force / target - 1.0);
        if off.abs() > NEAR {
            self.weaknesses
                .push(format!("{:+.0} % off the target", 100.0 * off));
        }
    }

    /// Writes the recommendation in lines of at most `width` columns.
    pub(super) fn write(&self, text: &mut String, limits: &Limits, width: usize) {
        write_lines(text, &self.lines(limits), width);
        text.push('\n');
    }

    /// Returns the recommendation and its properties, line by line.
    #[must_use]
    pub fn lines(&self, limits: &Limits) -> Vec<String> {
        let Self {
            place,
            outcome,
            strengths,
            weaknesses,
            verified,
            condition,
            ..
        } = self;
        let target = limits
            .target_force_n
            .map_or_else(String::new, |target| format!(" for {target} N"));
        let condition = if condition.is_empty() {
            String::new()
        } else {
            format!(", {condition}")
        };
        let setting = format!(
            "{} rpm (v_b = {} m/s), a_e = {} mm{condition}",
            short(place.rotational_speed_rpm),
            short(place.brushing_velocity_m_s),
            short(1e3 * place.penetration_depth_m)
        );
        let missed = limits.target_force_n.and_then(|target| {
            let all = self.considered.with(place, outcome);
            Some((target, all.miss(target)?))
        });
        let mut lines = match missed {
            Some((target, missed)) => vec![missed, format!("nearest to {target} N: {setting}")],
            None => vec![format!("Recommended{target}: {setting}")],
        };
        let mut line = |words: String| lines.push(words);
        let force = outcome.central_n();
        let band = match outcome.band() {
            Some([lower, upper]) => {
                format!("{} [{} … {}]", short(force), short(lower), short(upper))
            }
            None => uncertain(force, outcome.uncertainty_n),
        };
        let machine = [outcome.tool_torque_n_m, outcome.tool_power_w].map(short);
        line(format!(
            "F_n,w = {band} N, M_w = {} N m, P_w = {} W",
            machine[0], machine[1]
        ));
        let kept = limits
            .max_force_n
            .and_then(|limit| Some((limit, outcome.share_within(limit)?)));
        if let Some((limit, share)) = kept {
            line(format!(
                "{} of such brushes keep F_n,w ≤ {limit} N; {} N is the median",
                likely(share),
                short(force)
            ));
        }
        if let Some(removed) = outcome.removed(limits.most()) {
            line(removed);
        }
        let sides =
            [("for it", strengths), ("against it", weaknesses)].map(
                |(side, reasons)| match &reasons[..] {
                    [] => String::new(),
                    reasons => format!("{side}: {}", reasons.join(", ")),
                },
            );
        line(
            sides
                .into_iter()
                .filter(|side| !side.is_empty())
                .collect::<Vec<_>>()
                .join("; "),
        );
        let rows = match self.rows[..] {
            [a, b] => format!("rows {a} and {b}"),
            _ => format!("row {}", self.rows[0]),
        };
        line(match verified {
            None => format!("not simulated: taken from {rows}"),
            Some(Verified {
                error: Some(error), ..
            }) => format!("not verified, as its simulation failed: {error}"),
            Some(Verified {
                expected_force_n,
                with_interaction,
                ..
            }) => {
                let how = if *with_interaction {
                    " with filaments that touch"
                } else {
                    ""
                };
                format!("simulated{how} ({rows}: {} N)", short(*expected_force_n))
            }
        });
        match verified {
            Some(Verified {
                in_space: Some(space),
                ..
            }) => {
                let guess = if space.is_assumed {
                    " (a guess: docs/trust.md)"
                } else {
                    ""
                };
                line(format!(
                    "in space, tilts of {} mrad{guess}: {} N (standard error of this mean: {} N)",
                    short(1e3 * space.lateral_tilt_std_rad),
                    significant(space.tool_contact_normal_force_n),
                    short(space.standard_error_n)
                ));
            }
            Some(Verified {
                in_space_error: Some(error),
                ..
            }) => line(format!("in space: {error}")),
            _ => {}
        }
        lines
    }
}

/// Returns a share of brushes in whole per cent.
fn likely(share: f64) -> String {
    match 100.0 * share {
        percent if percent > 99.0 => "more than 99 %".to_owned(),
        percent if percent < 1.0 => "less than 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

/// Writes the recommendation, with its properties indented.
pub(super) fn write_lines(text: &mut String, lines: &[String], width: usize) {
    for (number, line) in lines.iter().enumerate() {
        wrap(width, text, if number == 0 { "" } else { "  " }, line);
    }
}
