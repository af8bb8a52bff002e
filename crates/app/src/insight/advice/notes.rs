//! Notes on friction and wear below the sentences of a section.

use bristle_study::grid::{CaseResult, FRICTION, Study};
use bristle_study::text::number::{short, significant};

use super::section::Sentence;
use crate::insight::quantity::Readable;

/// Returns a note on the wear of filaments, which does not distinguish the cases of a study. `None`
/// if the wear is unknown.
pub(super) fn wear_note(results: &[CaseResult]) -> Option<String> {
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

/// Returns a note on the effect of friction on the forces of a section, whose highest is that of
/// `top`. `None` if the study cannot tell.
pub(super) fn friction_note(study: &Study, forces: &Readable, top: &Sentence) -> Option<String> {
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
