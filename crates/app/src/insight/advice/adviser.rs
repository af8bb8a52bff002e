//! Sentences of a section: cases with a high force, or those within the limits.

use std::cmp::Ordering;
use std::ops::Range;

use bristle::model::metrics::SWEEPING_RATIO;
use bristle_study::text::number::{counted, short, significant};

use super::cited::{Cited, force, highest};
use super::limits::Limits;
use super::outcome::{Most, OperatingPoint, Outcome};
use super::rank::rank;
use super::section::{Sentence, Topic, about};
use crate::insight::quantity::Readable;
use crate::insight::slices::Slice;

/// Contact time ratios of a maximum along the tier. In the paper's study these maxima lie at 0.43
/// to 0.53. Lower maxima lie at 0.75 and above and, in a finer grid, at 0.24, where filaments
/// strike.
const ALONG_TIER: Range<f64> = 0.3..0.6;

/// Smallest relative fall of the force after a local maximum. The number of segments alone can
/// cause smaller falls.
const LEAST_FALL: f64 = 0.005;

const MOST_RANKED: usize = 5;

/// The data from which the sentences of a section are made.
pub(super) struct Adviser<'a> {
    pub(super) slice: &'a Slice,
    /// `true` if forces are given in place of depths.
    pub(super) is_pressed_on: bool,
    pub(super) forces: &'a Readable,
    pub(super) cells: &'a [Vec<Option<Cited>>],
}

impl Adviser<'_> {
    /// Returns the sentences and the notes; `interpolated` is the number of suggestions.
    pub(super) fn advise(
        &self,
        limits: Limits,
        interpolated: usize,
    ) -> (Vec<Sentence>, Vec<String>) {
        let cells: Vec<&Cited> = self.cells.iter().flatten().flatten().collect();
        let (mut advice, mut notes) = (Vec::new(), Vec::new());
        let failures = self.cells.iter().map(Vec::len).sum::<usize>() - cells.len();
        if cells.is_empty() {
            notes.push(format!("All {} failed.", counted(failures)));
            return (advice, notes);
        }
        if failures > 0 {
            let are = if failures == 1 { "is" } else { "are" };
            notes.push(format!(
                "{failures} of {} cases failed and {are} left out.",
                failures + cells.len()
            ));
        }
        let Some(top) = highest(&cells, force).filter(|cell| force(cell) > 0.0) else {
            notes.push("No case has a contact normal force.".to_owned());
            return (advice, notes);
        };
        if limits != Limits::default() {
            let is_within = |cell: &&Cited| limits.allow(&cell.place, &cell.outcome);
            let within: Vec<&Cited> = cells.iter().copied().filter(is_within).collect();
            if within.is_empty() {
                notes.push(format!("No case has {limits}."));
            } else if within.iter().all(|cell| cell.outcome.laterally_unstable) {
                notes.push("None of these cases is laterally stable.".to_owned());
            }
            return (
                self.ranked(&within, &limits, MOST_RANKED - interpolated),
                notes,
            );
        }
        if self.is_pressed_on {
            for (row, asked_n) in self.cells.iter().zip(&self.slice.y.values) {
                let cells: Vec<&Cited> = row.iter().flatten().collect();
                let Some(least) = highest(&cells, |cell| -cell.outcome.tool_power_w) else {
                    continue;
                };
                let (count, motion) = (counted(cells.len()), least.outcome.motion());
                let sentence = format!(
                    "The least power of {count} with {} N; it {motion}.",
                    short(*asked_n)
                );
                advice.push(about(Topic::LeastPower, least, sentence, &[]));
            }
            return (advice, notes);
        }
        let highest_of = |topic: Topic, cells: &[&Cited], top: &Cited| {
            let sentence = format!(
                "The highest of {}; it {}.",
                counted(cells.len()),
                top.outcome.motion()
            );
            about(topic, top, sentence, &[])
        };
        advice.push(highest_of(Topic::Highest, &cells, top));
        if top.outcome.laterally_unstable {
            let stable: Vec<&Cited> = cells
                .iter()
                .copied()
                .filter(|cell| !cell.outcome.laterally_unstable)
                .collect();
            match highest(&stable, force) {
                Some(top) => advice.push(highest_of(Topic::Stable, &stable, top)),
                None => notes.push("None of these cases is laterally stable.".to_owned()),
            }
        }
        let (velocities, depths) = (self.slice.x.varies(), self.slice.y.varies());
        if velocities && depths {
            let column = |x: usize| {
                self.cells
                    .iter()
                    .filter_map(|row| row[x].as_ref())
                    .collect::<Vec<_>>()
            };
            let columns = (0..self.slice.x.values.len()).map(column);
            advice.extend(columns.filter_map(|cells| self.best(Topic::AtVelocity, &cells)));
            let rows = self
                .cells
                .iter()
                .map(|row| row.iter().flatten().collect::<Vec<_>>());
            advice.extend(rows.filter_map(|cells| self.best(Topic::AtDepth, &cells)));
        }
        type Side = fn(&OperatingPoint) -> f64;
        let sides: [(bool, Topic, Side, &str); 2] = [
            (
                velocities,
                Topic::PerVelocity,
                |place| place.brushing_velocity_m_s,
                "m/s of v_b",
            ),
            (
                depths,
                Topic::PerDepth,
                |place| 1e3 * place.penetration_depth_m,
                "mm of a_e",
            ),
        ];
        for (varies, topic, side, unit) in sides {
            let ratio = |cell: &Cited| force(cell) / side(&cell.place);
            if varies && let Some(top) = highest(&cells, ratio) {
                let share = short(self.forces.factor() * force(top) / side(&top.place));
                let newtons = self.forces.unit();
                let sentence =
                    format!("{share} {newtons} per {unit}, the highest ratio of all cases.");
                advice.push(about(topic, top, sentence, &[]));
            }
        }
        self.advise_on_removal(&cells, &mut advice);
        if velocities {
            let mut without = Vec::new();
            for (row, &at) in self.cells.iter().zip(&self.slice.y.values) {
                match self.along_tier(row) {
                    Some(sentence) => advice.push(sentence),
                    None => without.push(short(1e3 * at)),
                }
            }
            if !without.is_empty() {
                let Range { start, end } = ALONG_TIER;
                let depths = without.join(", ");
                notes.push(format!(
                    "At a_e = {depths} mm no local maximum lies along the line between sweeping and striking, from ε_tc = {start} to {end}."
                ));
            }
        }
        (advice, notes)
    }

    /// The most removal per time, from edges and per power, in a study with `[removal]`.
    fn advise_on_removal(&self, cells: &[&Cited], advice: &mut Vec<Sentence>) {
        let power = |of: Most| move |cell: &Cited| cell.outcome.removal_power_w(of).unwrap_or(0.0);
        let most =
            |value: &dyn Fn(&Cited) -> f64| highest(cells, value).filter(|cell| value(cell) > 0.0);
        for (topic, of) in [
            (Topic::MostRemoval, Most::Removal),
            (Topic::MostOfEdge, Most::Edge),
        ] {
            let Some((cell, what)) =
                most(&power(of)).and_then(|cell| Some((cell, cell.outcome.removed(of)?)))
            else {
                continue;
            };
            let sentence = format!(
                "{what}, the most of {}; it {}.",
                counted(cells.len()),
                cell.outcome.motion()
            );
            advice.push(about(topic, cell, sentence, &[]));
        }
        let per_power = |cell: &Cited| power(Most::Removal)(cell) / cell.outcome.tool_power_w;
        if let Some(cell) = most(&per_power).filter(|cell| cell.outcome.tool_power_w > 0.0) {
            let share = significant(per_power(cell));
            let sentence = format!(
                "Slides with {share} W per W of the drive, the most; it {}.",
                cell.outcome.motion()
            );
            advice.push(about(Topic::RemovalPerPower, cell, sentence, &[]));
        }
    }

    /// Returns at most `most` of the best cases `within` the limits, ranked.
    fn ranked(&self, within: &[&Cited], limits: &Limits, most: usize) -> Vec<Sentence> {
        let mut ranked = within.to_vec();
        ranked.sort_by(|a, b| rank(limits, &a.outcome, &b.outcome));
        let count = counted(within.len());
        let with = if limits.are_none() {
            String::new()
        } else {
            format!(" with {limits}")
        };
        let holds = |cell: &Cited| limits.hold_with_band(&cell.outcome);
        let sure = within.iter().filter(|cell| holds(cell)).count();
        let sentence = |(rank, cell): (usize, &&Cited)| {
            let motion = cell.outcome.motion();
            let Some(target) = limits.target_force_n else {
                let what = match rank {
                    0 if sure > 0 && sure < within.len() => {
                        format!(
                            "The best of {sure} entirely within the limit, of {count}{with}; it"
                        )
                    }
                    0 => format!("The best of {count}{with}; it"),
                    _ => "It".to_owned(),
                };
                let beyond = if holds(cell) {
                    String::new()
                } else {
                    beyond(self.forces, &cell.outcome)
                };
                return about(
                    Topic::WithinLimits,
                    cell,
                    format!("{what} {motion}.{beyond}"),
                    &[],
                );
            };
            let what = if rank == 0 {
                format!("The best of {count}{with}. ")
            } else {
                String::new()
            };
            let [lower, upper] = cell.outcome.ends();
            let band = if lower < target && target < upper {
                " The target is within the uncertainty."
            } else {
                ""
            };
            let sentence = format!(
                "{what}{}; it {motion}.{band}",
                off_target(cell.outcome.central_n(), target)
            );
            about(Topic::NearTarget, cell, sentence, &[])
        };
        ranked.iter().take(most).enumerate().map(sentence).collect()
    }

    /// Compares the highest force of some cases with the lowest. `None` if there is nothing to
    /// compare, or no force.
    fn best(&self, topic: Topic, cells: &[&Cited]) -> Option<Sentence> {
        let top = highest(cells, force).filter(|cell| cells.len() > 1 && force(cell) > 0.0)?;
        let least = highest(cells, |cell| -force(cell))?;
        if force(least) == force(top) {
            let sentence = format!(
                "It {}; all others have the same force.",
                top.outcome.motion()
            );
            return Some(about(topic, top, sentence, &[]));
        }
        let place = if topic == Topic::AtVelocity {
            depth(least)
        } else {
            least.speed.clone()
        };
        let sentence = format!(
            "It {}; the lowest is {} at {place} (row {}).",
            top.outcome.motion(),
            self.newtons(least),
            least.row
        );
        Some(about(topic, top, sentence, &[least]))
    }

    /// The local maximum of the force over the velocity along the tier. If there are several, the
    /// one nearest to the tier.
    fn along_tier(&self, row: &[Option<Cited>]) -> Option<Sentence> {
        let distance = |cell: &Cited| (cell.outcome.contact_time_ratio - SWEEPING_RATIO).abs();
        let peaks = row.windows(3).filter_map(|cells| match cells {
            [Some(before), Some(peak), Some(after)] => {
                let falls = force(after) < (1.0 - LEAST_FALL) * force(peak);
                (force(peak) > force(before) && falls).then_some(peak)
            }
            _ => None,
        });
        let along = peaks.filter(|peak| ALONG_TIER.contains(&peak.outcome.contact_time_ratio));
        let peak = along.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let faster = &row[peak.position[0] + 1..];
        let solved: Vec<&Cited> = faster.iter().flatten().collect();
        let below = solved
            .iter()
            .position(|cell| force(cell) > force(peak))
            .unwrap_or(solved.len());
        let least = highest(&solved[..below], |cell| -force(cell))?;
        let falls = format!(
            "Above this {} it falls to {} at {} (row {})",
            self.slice.x.setting.word(),
            self.newtons(least),
            least.speed,
            least.row
        );
        let (end, others) = match solved.get(below) {
            Some(more) => {
                let end = format!(
                    ", then exceeds the maximum at {} (row {})",
                    more.speed, more.row
                );
                (end, vec![least, *more])
            }
            None if solved.len() < faster.len() => (String::new(), vec![least]),
            None => (
                "; no faster case exceeds the maximum".to_owned(),
                vec![least],
            ),
        };
        Some(about(Topic::Tier, peak, format!("{falls}{end}."), &others))
    }

    /// The force of a case, as the tables show it.
    fn newtons(&self, cell: &Cited) -> String {
        format!("{} {}", self.forces.text(cell.row - 1), self.forces.unit())
    }
}

/// Returns the words for a force whose uncertainty exceeds its limit.
fn beyond(forces: &Readable, outcome: &Outcome) -> String {
    format!(
        " Its uncertainty reaches {} {}, beyond the limit.",
        short(forces.factor() * outcome.ends()[1]),
        forces.unit()
    )
}

/// Returns the distance of a force from the target, in N, as text.
fn off_target(force_n: f64, target_n: f64) -> String {
    let off = short((force_n - target_n).abs());
    match force_n.total_cmp(&target_n) {
        Ordering::Less => format!("{off} N below {target_n} N"),
        Ordering::Equal => format!("exactly {target_n} N"),
        Ordering::Greater => format!("{off} N above {target_n} N"),
    }
}

fn depth(cell: &Cited) -> String {
    format!("{} mm", short(1e3 * cell.place.penetration_depth_m))
}
