//! Advice of a study: cases with a high tool force, with their velocity, depth and contact time
//! ratio.
//!
//! Advice is a list of sentences made from the results of a study. Each sentence cites its cases by
//! their rows in `runs.csv`, so that it can be checked. Every case that a sentence cites has been
//! simulated. If a force is asked for, there are also interpolated [`Suggestion`]s, marked as such.
//! With limits or a target, one [`Recommendation`] comes first, which is simulated.

mod answer;
mod cited;
pub mod edges;
mod headline;
mod limits;
mod outcome;
mod rank;
mod recommendation;
mod section;
mod suggestion;
mod table;

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::ops::Range;

use bristle::model::metrics::SWEEPING_RATIO;
use bristle::simulation::Stop;
use serde::Serialize;
use serde_json::Value;

use crate::insight::findings::vibrating_note;
use crate::insight::quantity::{CaseQuantity, Readable};
use crate::insight::slices::{Slice, Varied, process_slices};
use bristle_study::grid::{CaseResult, FORCE, FRICTION, Study, StudyTool, TOOL};
use bristle_study::text::layout::wrap;
use bristle_study::text::number::{counted, short, significant, spanning};

pub use answer::Answer;
pub use cited::Cited;
pub use headline::headline;
pub use limits::{AdviceError, Limits};
pub use outcome::{Most, OperatingPoint, Outcome};
pub use recommendation::{InSpace, Recommendation, Verified};
pub use section::{Section, Sentence, Topic};
pub use suggestion::Suggestion;

use cited::{cells, force, highest};
use edges::{EdgeAdvice, advise_on_edges};
use rank::rank;
use recommendation::recommend;
use suggestion::suggestions;
use table::{TableLine, write_table};

/// Contact time ratios of a maximum along the tier. In the paper's study these maxima lie at 0.43
/// to 0.53. Lower maxima lie at 0.75 and above and, in a finer grid, at 0.24, where filaments
/// strike.
const ALONG_TIER: Range<f64> = 0.3..0.6;

/// Smallest relative fall of the force after a local maximum. The number of segments alone can
/// cause smaller falls.
const LEAST_FALL: f64 = 0.005;

const MOST_RANKED: usize = 5;

/// The note where no suggestion is interpolated.
const NOTHING_BETWEEN: &str = "Nothing is interpolated: nowhere between neighbouring cases within the limits, along depth or speed, does the force pass what is asked for.";

/// The note where forces are given in place of depths.
const FORCES_ARE_GIVEN: &str = "Nothing is interpolated, as the depths follow from the forces of this study: for others, state or sweep process.tool_force_n.";

/// Advice from a study.
#[derive(Clone, Debug, Serialize)]
pub struct Advice {
    /// The limits requested.
    pub limits: Limits,
    /// Recommended settings, if there are limits or a target, and cases within them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recommendation: Option<Recommendation>,
    /// The best case of each named tool, ranked. A tool without a case within the limits is left
    /// out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tools: Vec<ToolAdvice>,
    /// The names of the tools that are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tools_without_case: Vec<String>,
    /// One section for each combination of the settings swept in addition to velocity and depth.
    pub sections: Vec<Section>,
    /// Advice on edges, if a filament touches one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edges: Option<EdgeAdvice>,
    /// The cases that were repeated more precisely, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checked: Option<Checked>,
    #[serde(skip)]
    forces: Readable,
    /// Loads on drive and workpiece.
    #[serde(skip)]
    machine: Vec<Readable>,
}

/// The cases that were repeated more precisely: passes at a tenth of the tolerance, brushes in
/// steps of half the length.
#[derive(Clone, Debug, Serialize)]
pub struct Checked {
    /// Their rows in `runs.csv`, counted below the heading.
    pub rows: Vec<usize>,
    /// The largest relative change of a headline metric.
    pub largest_change: f64,
    /// The row of the case in which that was.
    pub row: usize,
    /// The number of all cases.
    #[serde(skip)]
    total: usize,
}

impl Checked {
    fn of(results: &[CaseResult]) -> Option<Self> {
        let change = |(case, result): (usize, &CaseResult)| {
            Some((case + 1, result.as_ref().ok()?.change_when_checked?))
        };
        let changes: Vec<(usize, f64)> = results.iter().enumerate().filter_map(change).collect();
        let &(row, largest_change) = changes.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let rows = changes.iter().map(|(row, _)| *row).collect();
        Some(Self {
            rows,
            largest_change,
            row,
            total: results.len(),
        })
    }

    /// In a sentence.
    fn text(&self) -> String {
        let spans = self
            .rows
            .chunk_by(|a, b| a + 1 == *b)
            .map(|span| match span {
                [row] => row.to_string(),
                [first, .., last] => format!("{first} to {last}"),
                [] => String::new(),
            });
        let which = match self.rows.len() {
            count if count == self.total => "All cases were".to_owned(),
            1 => format!("Of {} cases, that of row {} was", self.total, self.row),
            _ => format!(
                "Of {} cases, those of rows {} were",
                self.total,
                spans.collect::<Vec<_>>().join(", ")
            ),
        };
        let (change, row) = (100.0 * self.largest_change, self.row);
        format!(
            "{which} checked (`study --check`); no metric changed by more than {change:.2} % (row {row})."
        )
    }
}

/// The best case of a named tool.
#[derive(Clone, Debug, Serialize)]
pub struct ToolAdvice {
    /// Path and value of each further swept setting, and the name of the tool under `tool`.
    pub settings: BTreeMap<&'static str, Value>,
    /// The advice.
    #[serde(flatten)]
    pub advice: Sentence,
    #[serde(skip)]
    slice: Slice,
}

/// Advice from the results of a study. Of equal forces, the one at the lowest depth counts, then at
/// the lowest velocity.
///
/// # Errors
/// If the study has only one velocity and one depth, or the limits contradict each other.
pub fn advise(
    study: &Study,
    results: &[CaseResult],
    limits: Limits,
) -> Result<Advice, AdviceError> {
    limits.check()?;
    let mut slices = process_slices(study, usize::MAX).chosen;
    let edges = advise_on_edges(study, results, &limits);
    if slices
        .iter()
        .all(|slice| !slice.x.varies() && !slice.y.varies())
    {
        if edges.is_none() {
            let words = "the study has only one brushing velocity and one penetration depth, so there are no forces to compare\n   \
                         = help: sweep one of them under [study]";
            return Err(AdviceError(words.to_owned()));
        }
        slices.clear();
    }
    let forces = Readable::tool_forces(results);
    let section = |slice: Slice| {
        let cells = cells(study, results, &slice);
        let interpolated = suggestions(study, results, &slice, &cells, &limits);
        let is_pressed_on = study.is_pressed_on();
        let adviser = Adviser {
            slice: &slice,
            is_pressed_on,
            forces: &forces,
            cells: &cells,
        };
        let (advice, mut notes) = adviser.advise(limits, interpolated.len());
        if interpolated.is_empty() && limits.wanted_n().is_some() && !advice.is_empty() {
            let note = if is_pressed_on {
                FORCES_ARE_GIVEN
            } else {
                NOTHING_BETWEEN
            };
            notes.push(note.to_owned());
        }
        notes.extend(
            advice
                .first()
                .and_then(|top| friction_note(study, &forces, top)),
        );
        let touching = cells
            .iter()
            .flatten()
            .flatten()
            .filter(|cell| force(cell) > 0.0);
        let cases = touching.map(|cell| cell.row - 1);
        notes.extend(vibrating_note(study, results, &cases.collect::<Vec<_>>()));
        notes.extend(wear_note(results));
        let settings = slice
            .fixed
            .iter()
            .map(|(setting, value)| (setting.path(), setting.json(*value)))
            .collect();
        Section {
            settings,
            advice,
            interpolated,
            notes,
            slice,
            cells,
        }
    };
    let sections: Vec<Section> = slices.into_iter().map(section).collect();
    let recommendation = recommend(study, &sections, &limits);
    let machine = CaseQuantity::machine(results)
        .map(|quantity| Readable::new(quantity, results))
        .collect();
    let tools = best_of_tools(study, &sections, &limits);
    let is_advised = |name: &str| {
        tools
            .iter()
            .any(|tool| tool.settings.get(TOOL).is_some_and(|own| own == name))
    };
    let names = study.tools().iter().map(|tool| tool.name.clone());
    let tools_without_case = names.filter(|name| !is_advised(name)).collect();
    let checked = Checked::of(results);
    Ok(Advice {
        limits,
        recommendation,
        tools,
        tools_without_case,
        sections,
        edges,
        checked,
        forces,
        machine,
    })
}

/// Returns a note on the wear of filaments, which does not distinguish the cases of a study. `None`
/// if the wear is unknown.
fn wear_note(results: &[CaseResult]) -> Option<String> {
    let ratio = results
        .iter()
        .flatten()
        .map(|summary| summary.metrics.wear_ratio)
        .find(|ratio| *ratio > 0.0)?;
    Some(format!(
        "The wear ratio is {} in every case: removal and wear both go with the sliding work.",
        significant(ratio)
    ))
}

/// The best case of each named tool, ranked as the cases of a section are.
fn best_of_tools(study: &Study, sections: &[Section], limits: &Limits) -> Vec<ToolAdvice> {
    // The first that is within the limits, if there are any.
    let is_best = |sentence: &&Sentence| match sentence.topic {
        Topic::Highest => *limits == Limits::default(),
        topic => [Topic::WithinLimits, Topic::NearTarget].contains(&topic),
    };
    let best = |tool: &StudyTool| {
        let is_own = |section: &&Section| {
            section
                .settings
                .get(TOOL)
                .is_some_and(|name| *name == tool.name)
        };
        let of_tool = sections.iter().filter(is_own);
        let cells = of_tool
            .filter_map(|section| Some((section, &section.advice.iter().find(is_best)?.cell)));
        let (section, cell) =
            cells.min_by(|(_, a), (_, b)| rank(limits, &a.outcome, &b.outcome))?;
        let sentence = format!("Tool {}; it {}.", tool.name, cell.outcome.motion());
        let advice = about(Topic::OfTool, cell, sentence, &[]);
        Some(ToolAdvice {
            settings: section.settings.clone(),
            advice,
            slice: section.slice.clone(),
        })
    };
    let mut tools: Vec<ToolAdvice> = study.tools().iter().filter_map(best).collect();
    tools.sort_by(|a, b| rank(limits, &a.advice.cell.outcome, &b.advice.cell.outcome));
    if *limits != Limits::default()
        && let [reference, others @ ..] = &mut tools[..]
    {
        for other in others {
            compare_with(reference, other, sections, limits);
        }
    }
    tools
}

/// Replaces the best case of a tool by a case at the speed of the `reference`, as the same force
/// takes another power at another speed. The case is within the limits, and its force is nearest to
/// that of the `reference`.
fn compare_with(
    reference: &ToolAdvice,
    tool: &mut ToolAdvice,
    sections: &[Section],
    limits: &Limits,
) {
    let Some(section) = sections
        .iter()
        .find(|section| section.settings == tool.settings)
    else {
        return;
    };
    let at = &reference.advice.cell;
    let wanted_n = at.outcome.central_n();
    let [x, _] = at.position;
    let column: Vec<&Cited> = section
        .cells
        .iter()
        .filter_map(|row| row[x].as_ref())
        .collect();
    let off = |cell: &Cited| (cell.outcome.central_n() - wanted_n).abs();
    let within = column
        .iter()
        .filter(|cell| limits.allow(&cell.place, &cell.outcome) && force(cell) > 0.0);
    let Some(cell) = within.min_by(|a, b| off(a).total_cmp(&off(b))) else {
        return;
    };
    let name = tool.settings.get(TOOL).and_then(Value::as_str);
    let mut sentence = format!(
        "Tool {}; it {}.",
        name.unwrap_or_default(),
        cell.outcome.motion()
    );
    let is_passed = |pair: &&[&Cited]| {
        let [from, to] = [pair[0], pair[1]].map(|cell| cell.outcome.central_n() - wanted_n);
        from * to < 0.0
    };
    if let Some(&[a, b]) = column.windows(2).find(is_passed) {
        let [from, to] = [a, b].map(|cell| cell.outcome.central_n());
        let share = (wanted_n - from) / (to - from);
        let between = |value: fn(&Cited) -> f64| value(a) + share * (value(b) - value(a));
        sentence.push_str(&format!(
            " For {} N, interpolated: {} mm and {} W.",
            significant(wanted_n),
            significant(1e3 * between(|cell| cell.place.penetration_depth_m)),
            significant(between(|cell| cell.outcome.tool_power_w))
        ));
    }
    tool.advice = about(Topic::ToolAlongside, cell, sentence, &[]);
}

/// Returns a note on the effect of friction on the forces of a section, whose highest is that of
/// `top`. `None` if the study cannot tell.
fn friction_note(study: &Study, forces: &Readable, top: &Sentence) -> Option<String> {
    let case = top.cell.row - 1;
    if study.settings(case).contact.friction_coefficient == 0.0 {
        return Some(format!(
            "These forces are without friction, which lowers them: take them as upper bounds. The brush of Uhlmann and Hoyer \
             (2021) at v_b = 10 m/s and a_e = 1 mm has 165, 109, 65 and 46 N with µ = 0, 0.1, 0.3 and 0.5. State {FRICTION}, or \
             sweep it."
        ));
    }
    let at = study
        .sweeps()
        .iter()
        .position(|sweep| sweep.path() == FRICTION)?;
    let stride: usize = study.sweeps()[at + 1..]
        .iter()
        .map(|sweep| sweep.values().len())
        .product();
    let values = study.sweeps()[at].values();
    let here = case / stride % values.len();
    let least = (0..values.len())
        .min_by(|&a, &b| values[a].total_cmp(&values[b]))
        .filter(|&least| least != here)?;
    let other = case - here * stride + least * stride;
    Some(format!(
        "With µ = {} instead of {}, velocity and depth of the highest force give {} {} (row {}).",
        short(values[least]),
        short(values[here]),
        forces.text(other),
        forces.unit(),
        other + 1
    ))
}

/// The data from which the sentences of a section are made.
struct Adviser<'a> {
    slice: &'a Slice,
    /// `true` if forces are given in place of depths.
    is_pressed_on: bool,
    forces: &'a Readable,
    cells: &'a [Vec<Option<Cited>>],
}

impl Adviser<'_> {
    /// Returns the sentences and the notes; `interpolated` is the number of suggestions.
    fn advise(&self, limits: Limits, interpolated: usize) -> (Vec<Sentence>, Vec<String>) {
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

/// A sentence about a case. It ends with a warning if the case is laterally unstable.
fn about(topic: Topic, cell: &Cited, mut sentence: String, others: &[&Cited]) -> Sentence {
    warn_of_instability(&mut sentence, &cell.outcome);
    Sentence {
        topic,
        cell: cell.clone(),
        sentence,
        other_rows: others.iter().map(|cell| cell.row).collect(),
    }
}

/// Adds a warning to a sentence about a laterally unstable case.
fn warn_of_instability(sentence: &mut String, outcome: &Outcome) {
    if outcome.laterally_unstable {
        sentence.push_str(&format!(
            " Laterally unstable: {}-fold.",
            spanning(outcome.lateral_amplification)
        ));
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

impl Advice {
    /// Simulates the recommendation, changes its depth until it keeps the target or the limits, and
    /// simulates it in space if filaments touch.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn verify(&mut self, threads: Option<NonZeroUsize>, stop: &Stop) -> io::Result<()> {
        let limits = self.limits;
        self.recommendation
            .as_mut()
            .map_or(Ok(()), |recommendation| {
                recommendation.verify(&limits, threads, stop)
            })
    }

    /// The advice in lines of at most `width` columns: a table with one sentence per row.
    #[must_use]
    pub fn text(&self, width: usize) -> String {
        let mut text = String::new();
        if let Some(recommendation) = &self.recommendation {
            recommendation.write(&mut text, &self.limits, width);
        }
        if let Some(best) = self.tools.first() {
            let lines: Vec<TableLine> = self
                .tools
                .iter()
                .map(|tool| self.line(&tool.slice, &tool.advice))
                .collect();
            self.write_lines(&mut text, &best.slice, &lines, width);
        }
        if !self.tools_without_case.is_empty() {
            wrap(
                width,
                &mut text,
                "",
                &format!(
                    "Tools without such a case: {}",
                    self.tools_without_case.join("; ")
                ),
            );
        }
        if !self.tools.is_empty() || !self.tools_without_case.is_empty() {
            text.push('\n');
        }
        for section in &self.sections {
            self.write_section(&mut text, section, width);
            text.push('\n');
        }
        if let Some(edges) = &self.edges {
            edges.write(&mut text, width);
        }
        let cells = || {
            self.sections
                .iter()
                .flat_map(|section| &section.advice)
                .map(|sentence| &sentence.cell)
        };
        let mut legend = "Rows of runs.csv are counted below its heading.".to_owned();
        if cells().any(|cell| cell.outcome.band().is_none() && cell.outcome.uncertainty_n > 0.0) {
            legend.push_str(" ± is the uncertainty from the number of filaments, which scales all forces alike.");
        }
        if cells().any(|cell| cell.outcome.band().is_some()) {
            legend.push_str(" Brackets give the band that contains 95 % of the sampled tools.");
        }
        if cells().any(|cell| cell.outcome.laterally_unstable) {
            legend.push_str(
                " In a laterally unstable case, an imperfection of the filament grows by the factor given and can change \
                 the force: sweep filament.lateral_tilt_rad to see how much.",
            );
        }
        if self
            .sections
            .iter()
            .any(|section| !section.interpolated.is_empty())
        {
            legend.push_str(" ≈ marks a force interpolated between the cases of two rows.");
        }
        legend.push_str(
            " * marks an end of the study, beyond which the force may be higher. A filament sweeps where ε_tc is above ½ \
             and strikes elsewhere.",
        );
        if let Some(checked) = &self.checked {
            legend.push(' ');
            legend.push_str(&checked.text());
        }
        wrap(width, &mut text, "", &legend);
        text
    }

    fn write_section(&self, text: &mut String, section: &Section, width: usize) {
        let Section {
            slice,
            advice,
            interpolated,
            notes,
            ..
        } = section;
        let condition = slice.condition();
        if !condition.is_empty() {
            wrap(width, text, "", &format!("With {condition}"));
        }
        // Suggestions follow what they are an alternative to.
        let (ranking, others) =
            advice.split_at(advice.partition_point(|sentence| sentence.topic.is_ranking()));
        let cited = |sentences: &[Sentence]| {
            sentences
                .iter()
                .map(|each| self.line(slice, each))
                .collect::<Vec<_>>()
        };
        let suggested = interpolated
            .iter()
            .map(|each| self.line_of_suggestion(slice, each))
            .collect();
        self.write_lines(
            text,
            slice,
            &[cited(ranking), suggested, cited(others)]
                .into_iter()
                .flatten()
                .collect::<Vec<_>>(),
            width,
        );
        notes.iter().for_each(|note| wrap(width, text, "", note));
    }

    /// Writes lines about cases of a slice, below the headings of their cells.
    fn write_lines(&self, text: &mut String, slice: &Slice, lines: &[TableLine], width: usize) {
        let [speed, unit] =
            [&slice.x.setting.symbol(), slice.x.setting.unit()].map(|text| format!("{text} "));
        let machine =
            |text: fn(&Readable) -> &str| self.machine.iter().map(text).collect::<Vec<_>>();
        let symbols = machine(|each| each.quantity.symbol);
        let headings = [
            [&["row", &speed, "a_e ", "F_n,w"][..], &symbols, &["ε_tc"]],
            [
                &["", &unit, "mm ", self.forces.unit()],
                &machine(Readable::unit),
                &[""],
            ],
        ]
        .map(|heading| heading.concat().into_iter().map(str::to_owned).collect());
        write_table(text, headings, lines, width);
    }

    fn line(
        &self,
        slice: &Slice,
        Sentence {
            topic,
            cell,
            sentence,
            ..
        }: &Sentence,
    ) -> TableLine {
        let sides = [&slice.x, &slice.y];
        let [velocity, depth] = [0, 1].map(|side| {
            let at = cell.position[side];
            let is_free =
                *topic != Topic::Tier && *topic != [Topic::AtVelocity, Topic::AtDepth][side];
            let is_end = at == 0 || at + 1 == sides[side].values.len();
            let Varied {
                setting, values, ..
            } = sides[side];
            let label = match setting.path() {
                // The depth that was found for it.
                FORCE => short(1e3 * cell.place.penetration_depth_m),
                _ => setting.labels(values.iter().copied()).swap_remove(at),
            };
            format!(
                "{label}{}",
                if is_free && is_end && sides[side].varies() && setting.path() != FORCE {
                    '*'
                } else {
                    ' '
                }
            )
        });
        // The study states the velocity or the rotational speed.
        let heading = match topic {
            Topic::AtVelocity => topic
                .heading()
                .replace("brushing velocity", slice.x.setting.name()),
            _ => topic.heading().to_owned(),
        };
        let place = [cell.row.to_string(), velocity, depth];
        let cells = self.cells(place, &cell.outcome, |each| each.text(cell.row - 1));
        TableLine {
            heading,
            cells,
            sentence: sentence.clone(),
        }
    }

    /// The cells of a line: place, force, what the machine feels, and contact time ratio.
    fn cells(
        &self,
        place: [String; 3],
        outcome: &Outcome,
        machine: impl Fn(&Readable) -> String,
    ) -> Vec<String> {
        let ratio = format!("{:.3}", outcome.contact_time_ratio);
        place
            .into_iter()
            .chain([self.force(outcome)])
            .chain(self.machine.iter().map(machine))
            .chain([ratio])
            .collect()
    }

    fn line_of_suggestion(&self, slice: &Slice, suggestion: &Suggestion) -> TableLine {
        let [velocity, depth] =
            [&slice.x, &slice.y].map(|side| format!("{} ", suggestion.shown(side)));
        let rows = suggestion.between_rows.map(|row| row.to_string()).join("–");
        let expected = &suggestion.interpolated;
        let mut cells = self.cells([rows, velocity, depth], expected, |each| {
            each.text_of(&suggestion.summary)
        });
        cells[3].insert_str(0, "≈ ");
        let mut sentence = format!("Not simulated; it {}.", expected.motion());
        warn_of_instability(&mut sentence, expected);
        TableLine {
            heading: "Interpolated".to_owned(),
            cells,
            sentence,
        }
    }

    /// The force with its band, or else with its uncertainty.
    fn force(&self, outcome: &Outcome) -> String {
        let force = outcome.tool_contact_normal_force_n;
        match outcome.band() {
            Some(band) => self.forces.text_with_band(force, band),
            None => self
                .forces
                .text_with_uncertainty(force, outcome.uncertainty_n),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::{self, metrics_of, with_force};
    use bristle_study::grid::uncertainty::ForceScatter;
    use bristle_study::text::layout::WIDTH;

    fn study(sweeps: &str) -> Study {
        testing::study(&format!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\nfilament_count_uncertainty = 100\n\
             [filament]\nlength_m = 0.040\ndiameter_m = 1.18e-3\n[process]\nbrushing_velocity_m_s = 10.0\n\
             penetration_depth_m = 1e-3\n[contact]\nfriction_coefficient = 0.3\n[study]\n{sweeps}"
        ))
    }

    /// Force in N and contact time ratio of a case; `None` if it failed.
    type Case = Option<(f64, f64)>;

    fn results(cases: &[Case]) -> Vec<CaseResult> {
        let result =
            |case: &Case| case.map_or(Err("failed".to_owned()), |(n, ratio)| with_force(n, ratio));
        cases.iter().map(result).collect()
    }

    /// Two depths and four velocities, neither in ascending order. There is a maximum along the
    /// tier at 1 mm and 10 m/s.
    const SWEEPS: &str =
        "brushing_velocity_m_s = [20.0, 5.0, 15.0, 10.0]\npenetration_depth_m = [2e-3, 1e-3]\n";
    const CASES: [Case; 8] = [
        Some((290.0, 0.7)),
        Some((240.0, 0.95)),
        Some((235.0, 0.8)),
        Some((230.0, 0.9)),
        Some((300.0, 0.25)),
        Some((150.0, 0.9)),
        Some((160.0, 0.3)),
        Some((200.0, 0.52)),
    ];
    const NONE: Limits = Limits {
        max_velocity_m_s: None,
        max_rotational_speed_rpm: None,
        max_depth_m: None,
        max_force_n: None,
        max_power_w: None,
        min_ratio: None,
        max_ratio: None,
        target_force_n: None,
        most: None,
    };

    fn target(force_n: f64) -> Limits {
        Limits {
            target_force_n: Some(force_n),
            ..NONE
        }
    }

    fn advice(study: &Study, cases: &[Case], limits: Limits) -> Advice {
        assert_eq!(cases.len(), study.case_count());
        advise(study, &results(cases), limits).expect("advice")
    }

    fn section(sweeps: &str, cases: &[Case], limits: Limits) -> Section {
        advice(&study(sweeps), cases, limits).sections.remove(0)
    }

    fn error(sweeps: &str, cases: &[Case], limits: Limits) -> String {
        let advice = advise(&study(sweeps), &results(cases), limits);
        advice.expect_err("nothing to advise").to_string()
    }

    fn rows(section: &Section, topic: Topic) -> Vec<usize> {
        let own = section.advice.iter().filter(|about| about.topic == topic);
        own.map(|about| about.cell.row).collect()
    }

    #[test]
    fn the_right_cases_are_cited() {
        let all = section(SWEEPS, &CASES, NONE);
        for (topic, expected) in [
            (Topic::Highest, &[5][..]),
            (Topic::AtVelocity, &[2, 4, 3, 5]),
            (Topic::AtDepth, &[5, 1]),
            // 48 N for each m/s, 300 N for each mm.
            (Topic::PerVelocity, &[2]),
            (Topic::PerDepth, &[5]),
            (Topic::Tier, &[8]),
            (Topic::WithinLimits, &[]),
        ] {
            assert_eq!(rows(&all, topic), expected, "{topic:?}");
        }
        let notes = [
            "At a_e = 2 mm no local maximum lies along the line between sweeping and striking, from ε_tc = 0.3 to 0.6.",
            "In 2 of 8 cases the filament comes back still vibrating, with up to 6 % of its vibration (row 1). Simulate \
             turn after turn with process.turns = \"steady\".",
        ];
        assert_eq!(all.notes, notes);
        let Cited { place, outcome, .. } = &all.advice[0].cell;
        assert_eq!(
            (place.brushing_velocity_m_s, place.penetration_depth_m),
            (20.0, 1e-3)
        );
        // A tenth, like that of the filaments.
        assert!((outcome.uncertainty_n - 30.0).abs() < 1e-12);

        // Of equal forces the first, at 5 m/s and 1 mm.
        let level = section(SWEEPS, &[Some((100.0, 0.9)); 8], NONE);
        assert_eq!(rows(&level, Topic::Highest), [6]);
        assert_eq!(rows(&level, Topic::AtVelocity), [6, 8, 7, 5]);
        assert_eq!(rows(&level, Topic::AtDepth), [6, 2]);

        // Cases that failed or have no force are no advice.
        let mut cases = CASES;
        (cases[4], cases[1], cases[5]) = (None, Some((0.0, 0.0)), Some((0.0, 0.0)));
        let some = section(SWEEPS, &cases, NONE);
        assert_eq!(rows(&some, Topic::Highest), [1]);
        // Nothing at 5 m/s, nothing to compare at 20 m/s.
        assert_eq!(rows(&some, Topic::AtVelocity), [4, 3]);
        assert_eq!(some.notes[0], "1 of 8 cases failed and is left out.");
        for (case, note) in [
            (Some((0.0, 0.0)), "No case has a contact normal force."),
            (None, "All 8 cases failed."),
        ] {
            let Section { advice, notes, .. } = section(SWEEPS, &[case; 8], NONE);
            assert_eq!((advice, notes), (vec![], vec![note.to_owned()]));
        }
    }

    #[test]
    fn a_headline_is_true_of_any_study() {
        let strikes = "F_n,w = 300 ± 30 N at v_b = 20 m/s, a_e = 1 mm (row 5), where the filaments strike (ε_tc = 0.250)";
        let sweeps = |force: &str| {
            format!(
                "Where the filaments sweep (ε_tc ≥ ½) in a laterally stable pass, the highest is {force}."
            )
        };
        let lowest = "The lowest is 150 ± 15 N at v_b = 5 m/s, a_e = 1 mm (row 6).";
        let mut some = CASES;
        some[4] = None;
        let one = "brushing_velocity_m_s = [10.0]";
        let segments = "\"filament.segments\" = [5, 10]";
        let table: [(&str, &[Case], &[usize], String); 12] = [
            (SWEEPS, &CASES, &[], format!("The highest tool force of 8 cases is {strikes}. {}", sweeps("290 ± 29 N at v_b = 20 m/s, a_e = 2 mm (row 1)"))),
            (SWEEPS, &CASES, &[5, 1], format!("The highest tool force of 8 cases is {strikes}, and the pass is laterally unstable. {}", sweeps("240 ± 24 N at v_b = 5 m/s, a_e = 2 mm (row 2)"))),
            (SWEEPS, &CASES, &[1, 2, 3, 4, 6, 8], format!("The highest tool force of 8 cases is {strikes}. In no laterally stable case do the filaments sweep (ε_tc ≥ ½).")),
            (SWEEPS, &some, &[], format!("The highest tool force of the 7 of 8 cases that did not fail is F_n,w = 290 ± 29 N at v_b = 20 m/s, a_e = 2 mm (row 1), where the filaments sweep (ε_tc = 0.700). {lowest}")),
            (SWEEPS, &[None; 8], &[], "All 8 cases failed. Their errors stand below.".to_owned()),
            (SWEEPS, &[Some((0.0, 0.0)); 8], &[], "There is no contact normal force in 8 cases. The filaments do not touch the workpiece.".to_owned()),
            (one, &[Some((54.321, 0.75))], &[], "At v_b = 10 m/s, a_e = 1 mm, the tool presses with F_n,w = 54.3 ± 5.4 N, and its filaments sweep (ε_tc = 0.750). The pass is laterally stable.".to_owned()),
            (one, &[Some((54.321, 0.25))], &[1], "At v_b = 10 m/s, a_e = 1 mm, the tool presses with F_n,w = 54.3 ± 5.4 N, and its filaments strike (ε_tc = 0.250). The pass is laterally unstable, so that an imperfection of the filament can change the force.".to_owned()),
            (one, &[Some((0.0, 0.0))], &[], "There is no contact normal force in one case. The filaments do not touch the workpiece.".to_owned()),
            (one, &[None], &[], "The case failed. Its error stands below.".to_owned()),
            (segments, &[Some((60.0, 0.75)), Some((50.0, 0.75))], &[], "The highest tool force of 2 cases is F_n,w = 60.0 ± 6.0 N at v_b = 10 m/s, a_e = 1 mm, segments = 5 (row 1), where the filaments sweep (ε_tc = 0.750). The lowest is 50.0 ± 5.0 N at v_b = 10 m/s, a_e = 1 mm, segments = 10 (row 2).".to_owned()),
            (segments, &[Some((60.0, 0.75)); 2], &[], "The highest tool force of 2 cases is F_n,w = 60.0 ± 6.0 N at v_b = 10 m/s, a_e = 1 mm, segments = 5 (row 1), where the filaments sweep (ε_tc = 0.750). All cases have the same force.".to_owned()),
        ];
        for (sweeps, cases, unstable, expected) in table {
            let mut results = results(cases);
            for &row in unstable {
                metrics_of(&mut results[row - 1]).laterally_unstable = true;
            }
            assert_eq!(headline(&study(sweeps), &results), expected);
        }
    }

    #[test]
    fn limits_are_kept_to() {
        let max_velocity_m_s = Some(15.0);
        // 10 m/s at the tips are 530.5 rpm. Those that sweep come first, the highest to 5 %, and no
        // more than five; a limit itself is within.
        let table: [(Limits, &[usize]); 6] = [
            (
                Limits {
                    max_velocity_m_s,
                    ..NONE
                },
                &[2, 4, 3, 8, 6],
            ),
            (
                Limits {
                    min_ratio: Some(0.7),
                    ..NONE
                },
                &[1, 2, 4, 3, 6],
            ),
            (
                Limits {
                    max_velocity_m_s,
                    max_ratio: Some(0.5),
                    ..NONE
                },
                &[7],
            ),
            (
                Limits {
                    max_depth_m: Some(1e-3),
                    ..NONE
                },
                &[8, 6, 5, 7],
            ),
            (
                Limits {
                    max_rotational_speed_rpm: Some(531.0),
                    ..NONE
                },
                &[2, 4, 8, 6],
            ),
            (
                Limits {
                    max_rotational_speed_rpm: Some(530.0),
                    ..NONE
                },
                &[2, 6],
            ),
        ];
        for (limits, expected) in table {
            let within = section(SWEEPS, &CASES, limits);
            assert_eq!(rows(&within, Topic::WithinLimits), expected, "{limits}");
        }
        let limits = Limits {
            max_velocity_m_s: Some(4.0),
            min_ratio: Some(0.5),
            max_ratio: Some(0.6),
            ..NONE
        };
        let unmet = section(SWEEPS, &CASES, limits);
        assert_eq!(unmet.advice, []);
        let note = "No case has v_b ≤ 4 m/s and ε_tc ≥ 0.5 and ε_tc ≤ 0.6.";
        assert_eq!(unmet.notes[0], note);
    }

    /// The rows between which suggestions lie, and their depths in m.
    fn interpolated(section: &Section) -> Vec<([usize; 2], f64)> {
        let suggestions = section.interpolated.iter();
        suggestions
            .map(|each| (each.between_rows, each.place.penetration_depth_m))
            .collect()
    }

    #[test]
    fn a_highest_force_ranks_first_what_is_within_it_with_its_uncertainty() {
        let limits = Limits {
            max_force_n: Some(250.0),
            ..NONE
        };
        let section = section(SWEEPS, &CASES, limits);
        assert_eq!(rows(&section, Topic::WithinLimits), [8, 6, 7]);
        let ranked: Vec<&str> = section
            .advice
            .iter()
            .map(|ranked| &*ranked.sentence)
            .collect();
        let best =
            "The best of 3 entirely within the limit, of 6 cases with F_n,w ≤ 250 N; it sweeps.";
        assert_eq!([ranked[0], ranked[2]], [best, "It strikes."]);
        // The upper end of the uncertainty reaches 250 N a little deeper.
        assert_eq!(
            interpolated(&section),
            [([6, 2], 1.85e-3), ([8, 4], 1.9e-3)]
        );
        let outcome = &section.interpolated[0].interpolated;
        let values = [
            (outcome.tool_contact_normal_force_n, 226.5),
            (outcome.uncertainty_n, 22.65),
            (outcome.contact_time_ratio, 0.9425),
        ];
        assert!(
            values
                .iter()
                .all(|(value, expected)| (value - expected).abs() < 1e-9),
            "{values:?}"
        );
    }

    #[test]
    fn a_target_ranks_the_nearest_first() {
        let near = section(SWEEPS, &CASES, target(220.0));
        assert_eq!(rows(&near, Topic::NearTarget), [4, 3, 2]);
        let sure = "it sweeps. The target is within the uncertainty.";
        assert_eq!(
            near.advice[0].sentence,
            format!("The best of 8 cases. 10 N above 220 N; {sure}")
        );
        assert_eq!(near.advice[2].sentence, format!("20 N above 220 N; {sure}"));
        assert_eq!(interpolated(&near), [([6, 2], 1.78e-3), ([8, 4], 1.67e-3)]);
        // What is interpolated is within the other limits, too.
        let within = |max_depth_m: f64| Limits {
            max_depth_m: Some(max_depth_m),
            ..target(220.0)
        };
        let shallow = section(SWEEPS, &CASES, within(1.7e-3));
        assert_eq!(interpolated(&shallow), [([8, 4], 1.67e-3)]);
        // No depth up to there gives the force, but a velocity does, unless it is too high.
        let faster = section(SWEEPS, &CASES, within(1.6e-3));
        assert_eq!(interpolated(&faster), [([7, 5], 1e-3)]);
        let slow = Limits {
            max_velocity_m_s: Some(16.0),
            ..within(1.6e-3)
        };
        let none = section(SWEEPS, &CASES, slow);
        assert_eq!(interpolated(&none), []);
        assert!(none.notes.iter().any(|note| note == NOTHING_BETWEEN));
        // Nothing is interpolated next to cases that failed or have no force.
        let mut cases = CASES;
        (cases[1], cases[3]) = (None, Some((0.0, 0.0)));
        assert_eq!(
            interpolated(&section(SWEEPS, &cases, target(220.0))),
            [([7, 3], 1.8e-3)]
        );

        let cases = [(100.0, 0.9), (200.0, 0.6)].map(Some);
        let one_depth = section("brushing_velocity_m_s = [5.0, 10.0]", &cases, target(150.0));
        assert_eq!(one_depth.interpolated[0].place.brushing_velocity_m_s, 7.5);
    }

    /// A wide band, a striking filament, or an unstable one counts for more than a few newtons.
    #[test]
    fn what_is_recommended_is_robust() {
        let study = study("brushing_velocity_m_s = [5.0, 10.0, 15.0, 20.0]");
        let recommended = |change: &dyn Fn(&mut [CaseResult])| {
            let cases = [(81.0, 0.9), (80.0, 0.7), (80.0, 0.3), (40.0, 0.9)].map(Some);
            let mut results = results(&cases);
            change(&mut results);
            let advice = advise(&study, &results, target(80.0)).expect("advice");
            advice.recommendation.expect("a recommendation")
        };
        let with_bands = |results: &mut [CaseResult]| {
            for (result, band) in results.iter_mut().zip([[51.0, 300.0], [49.0, 139.0]]) {
                let [tool_force_lower_95_n, tool_force_upper_95_n] = band;
                let scatter = ForceScatter {
                    tool_force_median_n: 80.0,
                    tool_force_lower_95_n,
                    tool_force_upper_95_n,
                    ..ForceScatter::default()
                };
                result.as_mut().expect("a result").scatter = Some(scatter);
            }
        };
        assert_eq!(recommended(&|_| ()).rows, [2], "inside the grid");
        let narrow = recommended(&with_bands);
        assert_eq!(
            (narrow.rows, narrow.weaknesses),
            (vec![2], vec!["wide band".to_owned()])
        );
        let unstable = |results: &mut [CaseResult]| {
            for result in &mut results[..2] {
                metrics_of(result).laterally_unstable = true;
            }
        };
        assert_eq!(
            recommended(&unstable).rows,
            [3],
            "it strikes, but it is stable"
        );
    }

    /// A target that no case reaches is named first, as is one that all cases exceed.
    #[test]
    fn a_target_that_no_setting_reaches_is_named_first() {
        let study = study("rotational_speed_rpm = [400, 800]\npenetration_depth_m = [1e-3, 2e-3]");
        let cases = [10.0, 20.0, 15.0, 30.6].map(|force| Some((force, 0.9)));
        for (target_n, expected) in [
            (
                60.0,
                "No setting up to 800 rpm and 2 mm reaches 60 N; the most is 30.6 N\n  nearest to 60 N: 800 rpm",
            ),
            (
                5.0,
                "All settings from 400 rpm and 1 mm exceed 5 N; the least is 10.0 N\n  nearest to 5 N: 400 rpm",
            ),
            (31.0, "Recommended for 31 N: 800 rpm"),
        ] {
            let text = advice(&study, &cases, target(target_n)).text(WIDTH);
            assert!(text.starts_with(expected), "{text}");
        }
    }

    #[test]
    fn a_force_that_is_passed_along_the_speed_is_found() {
        let sweeps = "rotational_speed_rpm = [2500, 3000]\npenetration_depth_m = [2e-3, 3e-3]";
        let cases = [40.0, 61.0, 59.6, 74.4].map(|force| Some((force, 0.9)));
        let section = section(sweeps, &cases, target(60.0));
        let mut found = section.interpolated.iter();
        let deep = found
            .find(|suggestion| suggestion.between_rows == [3, 4])
            .expect("a suggestion at 3 mm");
        assert_eq!(deep.place.penetration_depth_m, 3e-3);
        // 59.6 N at 2500 rpm, 74.4 N at 3000 rpm.
        let speed = deep.place.rotational_speed_rpm;
        assert!(
            (speed - (2500.0 + 500.0 * 0.4 / 14.8)).abs() < 10.0,
            "{speed}"
        );
        assert!(section.interpolated.len() == 2, "and one at 2 mm");
    }

    /// A limit is kept with a likelihood, and of a force without an uncertainty nothing is known.
    #[test]
    fn a_recommendation_says_how_likely_a_limit_is_kept() {
        let study = study("penetration_depth_m = [1e-3, 2e-3]");
        let limits = Limits {
            max_force_n: Some(100.0),
            ..NONE
        };
        let mut uncertain = results(&[Some((50.0, 0.9)), Some((120.0, 0.9))]);
        uncertain[0].as_mut().expect("a result").scatter = Some(ForceScatter {
            tool_force_median_n: 60.0,
            tool_force_lower_95_n: 40.0,
            tool_force_upper_95_n: 100.0,
            ..ForceScatter::default()
        });
        let text = advise(&study, &uncertain, limits)
            .expect("advice")
            .text(WIDTH);
        let kept = " % of such brushes keep F_n,w ≤ 100 N; 60 N is the median";
        let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains(kept) && said.contains("wide band"), "{text}");

        let exact = testing::study(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\n[filament]\nlength_m = 0.040\n\
             diameter_m = 1.18e-3\n[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n\
             [study]\npenetration_depth_m = [1e-3, 2e-3]",
        );
        let text = advice(&exact, &[Some((50.0, 0.9)), Some((60.0, 0.9))], limits).text(WIDTH);
        assert!(!text.contains("band"), "{text}");
    }

    #[test]
    fn tools_are_compared_at_the_same_speed() {
        let study = study(
            "rotational_speed_rpm = [500, 3000]\npenetration_depth_m = [1e-3, 2e-3]\n\
             [study.tools.coarse]\n[study.tools.fine]\nfilament.diameter_m = 0.8e-3",
        );
        // At 500 rpm coarse has the force, fine at 3000 rpm; at 500 rpm fine has less and more.
        let mut results = results(
            &[30.0, 70.0, 60.0, 90.0, 40.0, 60.0, 70.0, 80.0].map(|force| Some((force, 0.9))),
        );
        for (result, power) in results
            .iter_mut()
            .zip([70.0, 800.0, 138.0, 900.0, 100.0, 791.0, 160.0, 990.0])
        {
            metrics_of(result).tool_power_w = power;
        }
        let advice = advise(&study, &results, target(60.0)).expect("advice");
        let compared: Vec<(usize, Topic)> = advice
            .tools
            .iter()
            .map(|tool| (tool.advice.cell.row, tool.advice.topic))
            .collect();
        assert_eq!(compared, [(3, Topic::OfTool), (7, Topic::ToolAlongside)]);
        let sentence = &advice.tools[1].advice.sentence;
        assert!(
            sentence.ends_with("For 60.0 N, interpolated: 1.67 mm and 140 W."),
            "{sentence}"
        );
    }

    /// The force of the recommendation is that of its own simulation, in which the depth is changed
    /// until it is the target.
    #[test]
    fn a_recommendation_is_simulated_at_the_force_that_is_asked_for() {
        let study = study("penetration_depth_m = [1e-3, 2e-3]");
        let mut advice = advice(&study, &[(3.0, 0.9), (30.0, 0.9)].map(Some), target(10.0));
        advice.verify(None, &Stop::default()).expect("threads");
        let recommendation = advice.recommendation.as_ref().expect("a recommendation");
        let verified = recommendation.verified.as_ref().expect("it was simulated");
        assert!(
            !verified.with_interaction && verified.error.is_none() && verified.in_space.is_none()
        );
        let force = recommendation.outcome.tool_contact_normal_force_n;
        assert!((force / 10.0 - 1.0).abs() < 0.01, "{force}");
        let settings = study
            .settings(0)
            .at_depth(recommendation.place.penetration_depth_m);
        let again = bristle::simulation::simulate(&settings)
            .expect("a contact")
            .metrics;
        assert!((again.tool_contact_normal_force_n / force - 1.0).abs() < 1e-9);
        let text = advice.text(WIDTH);
        assert!(
            text.starts_with("Recommended for 10 N: ")
                && text.contains("  simulated (rows 1 and 2: "),
            "{text}"
        );
    }

    /// Filaments of a packed cup are simulated alone, as `[brush]` is refused there.
    #[test]
    fn a_packed_cup_is_recommended_without_a_brush() {
        let study = testing::study(
            "[tool]\nkind = \"cup\"\nbody_radius_m = 0.030\nwidth_m = 0.010\nfilament_count = 1500\n\
             [filament]\nlength_m = 0.025\ndiameter_m = 0.5e-3\nsegments = 4\n[solver]\nrelative_tolerance = 1e-3\n\
             [process]\nbrushing_velocity_m_s = 5.0\npenetration_depth_m = 1e-3\n\
             [contact]\nfriction_coefficient = 0.3\n[study]\npenetration_depth_m = [0.5e-3, 1e-3]",
        );
        let mut advice = advice(&study, &[(3.0, 0.9), (30.0, 0.9)].map(Some), target(10.0));
        advice.verify(None, &Stop::default()).expect("threads");
        let recommendation = advice.recommendation.expect("a recommendation");
        let verified = recommendation.verified.expect("it was simulated");
        assert_eq!((verified.with_interaction, verified.error), (false, None));
    }

    /// The advice along the tier at one depth: velocity, sentence, and rows of the other cases.
    fn tier(cases: &[Case]) -> Option<(f64, String, Vec<usize>)> {
        let velocities: Vec<usize> = (1..=cases.len()).collect();
        let sweeps = format!("brushing_velocity_m_s = {velocities:?}");
        let Section { advice, notes, .. } = section(&sweeps, cases, NONE);
        let about = advice.into_iter().find(|about| about.topic == Topic::Tier);
        assert_eq!(
            about.is_none(),
            notes.iter().any(|note| note.starts_with("At a_e = "))
        );
        about.map(
            |Sentence {
                 cell,
                 sentence,
                 other_rows,
                 ..
             }| { (cell.place.brushing_velocity_m_s, sentence, other_rows) },
        )
    }

    #[test]
    fn a_maximum_along_the_tier_says_what_is_gained_by_more_velocity() {
        let slow = [(100.0, 0.9), (110.0, 0.8), (105.0, 0.7), (150.0, 0.55)];
        let row = |fast: &[(f64, f64)]| {
            [&slow, fast]
                .concat()
                .into_iter()
                .map(Some)
                .collect::<Vec<_>>()
        };
        let falls = "Above this velocity it falls to 130.0 N at 6 m/s (row 6), then exceeds the maximum at 7 m/s (row 7).";
        assert_eq!(
            tier(&row(&[(140.0, 0.4), (130.0, 0.3), (180.0, 0.3)])),
            Some((4.0, falls.to_owned(), vec![6, 7]))
        );
        let falls = "Above this velocity it falls to 140.0 N at 5 m/s (row 5); no faster case exceeds the maximum.";
        assert_eq!(
            tier(&row(&[(140.0, 0.4), (145.0, 0.3)])),
            Some((4.0, falls.to_owned(), vec![5]))
        );
        // Of two maxima, the one nearer to the line counts, although the other is higher.
        let two = tier(&row(&[(140.0, 0.4), (160.0, 0.35), (155.0, 0.3)])).expect("a maximum");
        assert_eq!(two.0, 4.0);
        // There is none far from the line, at an end, or where the force is level.
        assert_eq!(tier(&row(&[])), None);
        assert_eq!(tier(&row(&[(150.0, 0.4), (120.0, 0.3)])), None);
        // Next to a case that failed, a maximum cannot be told.
        let mut failed = row(&[(140.0, 0.4), (130.0, 0.3)]);
        failed[4] = None;
        assert_eq!(tier(&failed), None);
    }

    #[test]
    fn advice_is_on_what_varies() {
        for (sweeps, topic) in [
            ("brushing_velocity_m_s = [5.0, 10.0]", Topic::PerVelocity),
            ("penetration_depth_m = [1e-3, 2e-3]", Topic::PerDepth),
        ] {
            let advice = section(sweeps, &[(100.0, 0.9), (110.0, 0.9)].map(Some), NONE).advice;
            let topics: Vec<Topic> = advice.iter().map(|about| about.topic).collect();
            assert_eq!(topics, [Topic::Highest, topic]);
        }
        let sweeps = "\"filament.segments\" = [3, 4]\nbrushing_velocity_m_s = [5.0]";
        let error = error(sweeps, &[Some((1.0, 1.0)); 2], NONE);
        let start = "the study has only one brushing velocity and one penetration depth";
        assert!(error.starts_with(start), "{error}");
    }

    #[test]
    fn friction_is_said_to_lower_the_force() {
        let sweeps =
            "brushing_velocity_m_s = [5.0, 10.0]\n\"contact.friction_coefficient\" = [0.3, 0.0]";
        let cases = [60.0, 65.0, 160.0, 165.0].map(|force| Some((force, 0.9)));
        let sections = advice(&study(sweeps), &cases, NONE).sections;
        let note = |section: &Section| section.notes.last().cloned().unwrap_or_default();
        let without = "With µ = 0 instead of 0.3, velocity and depth of the highest force give 165.0 N (row 4).";
        assert_eq!(note(&sections[1]), without);
        assert!(note(&sections[0]).starts_with("These forces are without friction"));
    }

    #[test]
    fn each_further_setting_has_its_section_and_its_uncertainty() {
        let study =
            study("\"tool.filament_count\" = [1000, 2000]\nbrushing_velocity_m_s = [5.0, 10.0]");
        let cases = [10.0, 20.0, 40.0, 20.0].map(|force| Some((force, 0.9)));
        let advice = advice(&study, &cases, NONE);
        let top = |section: &Section| {
            let Cited { row, outcome, .. } = &section.advice[0].cell;
            (
                *row,
                outcome.uncertainty_n,
                section.settings["tool.filament_count"].as_f64(),
            )
        };
        let tops: Vec<_> = advice.sections.iter().map(top).collect();
        assert_eq!(tops, [(2, 2.0, Some(1000.0)), (3, 2.0, Some(2000.0))]);
        let text = advice.text(WIDTH);
        assert!(
            text.contains("With N_f = 1000\n") && text.contains("With N_f = 2000\n"),
            "{text}"
        );
    }
}
