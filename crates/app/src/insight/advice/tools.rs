//! Named tools compared by their best cases.

use std::collections::BTreeMap;

use bristle_study::grid::{Study, StudyTool, TOOL};
use bristle_study::text::number::significant;
use serde::Serialize;
use serde_json::Value;

use super::cited::{Cited, force};
use super::limits::Limits;
use super::rank::rank;
use super::section::{Section, Sentence, Topic, about};
use crate::insight::slices::Slice;

/// The best case of a named tool.
#[derive(Clone, Debug, Serialize)]
pub struct ToolAdvice {
    /// Path and value of each further swept setting, and the name of the tool under `tool`.
    pub settings: BTreeMap<&'static str, Value>,
    /// The advice.
    #[serde(flatten)]
    pub advice: Sentence,
    #[serde(skip)]
    pub(super) slice: Slice,
}

/// The best case of each named tool, ranked as the cases of a section are.
pub(super) fn best_of_tools(
    study: &Study,
    sections: &[Section],
    limits: &Limits,
) -> Vec<ToolAdvice> {
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
