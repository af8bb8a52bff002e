//! Advice of a study: cases with a high tool force, with their velocity, depth and contact time
//! ratio.
//!
//! Advice is a list of sentences made from the results of a study. Each sentence cites its cases by
//! their rows in `runs.csv`, so that it can be checked. Every case that a sentence cites has been
//! simulated. If a force is asked for, there are also interpolated [`Suggestion`]s, marked as such.
//! With limits or a target, one [`Recommendation`] comes first, which is simulated.

mod adviser;
mod answer;
mod checked;
mod cited;
pub mod edges;
mod headline;
mod limits;
mod notes;
mod outcome;
mod rank;
mod recommendation;
mod section;
mod suggestion;
mod table;
#[cfg(test)]
mod tests;
mod text;
mod tools;
mod verification;

use std::io;
use std::num::NonZeroUsize;

use bristle::simulation::Stop;
use serde::Serialize;

use crate::insight::findings::vibrating_note;
use crate::insight::quantity::{CaseQuantity, Readable};
use crate::insight::slices::{Slice, process_slices};
use bristle_study::grid::{CaseResult, Study, TOOL};

pub use answer::Answer;
pub use checked::Checked;
pub use cited::Cited;
pub use headline::headline;
pub use limits::{AdviceError, Limits};
pub use outcome::{Most, OperatingPoint, Outcome};
pub use recommendation::Recommendation;
pub use section::{Section, Sentence, Topic};
pub use suggestion::Suggestion;
pub use tools::ToolAdvice;
pub use verification::{InSpace, Verified};

use adviser::Adviser;
use cited::{cells, force};
use edges::{EdgeAdvice, advise_on_edges};
use notes::{friction_note, wear_note};
use recommendation::recommend;
use suggestion::suggestions;
use tools::best_of_tools;

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
}
