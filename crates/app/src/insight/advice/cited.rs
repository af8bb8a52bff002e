//! The cases of a study as advice cites them.

use serde::Serialize;

use super::outcome::{OperatingPoint, Outcome};
use crate::insight::slices::Slice;
use bristle_study::grid::{CaseResult, Study};

/// A case that advice cites.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cited {
    /// Row of `runs.csv`, counted from 1 below the heading.
    pub row: usize,
    /// Velocity and depth.
    #[serde(flatten)]
    pub place: OperatingPoint,
    /// The result.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// Velocity or rotational speed, as the study states it.
    #[serde(skip)]
    pub(super) speed: String,
    /// Positions of velocity and depth along the sides of the slice.
    #[serde(skip)]
    pub(super) position: [usize; 2],
}

/// Returns the tool force of a case in N.
pub(super) fn force(cell: &Cited) -> f64 {
    cell.outcome.tool_contact_normal_force_n
}

/// The cases of a slice, by depth and then by velocity. A case that failed is `None`.
pub(super) fn cells(
    study: &Study,
    results: &[CaseResult],
    slice: &Slice,
) -> Vec<Vec<Option<Cited>>> {
    let cell = |x: usize, y: usize| {
        let case = slice.case(x, y);
        let summary = results[case].as_ref().ok()?;
        let settings = study.settings_found(case, &results[case]);
        Some(Cited {
            row: case + 1,
            place: OperatingPoint::of(&settings),
            outcome: Outcome::new(&settings, summary),
            speed: slice.x.setting.text(slice.x.values[x]),
            position: [x, y],
        })
    };
    (0..slice.y.values.len())
        .map(|y| (0..slice.x.values.len()).map(|x| cell(x, y)).collect())
        .collect()
}

/// The first of the cells with the highest value.
pub(super) fn highest<'a>(cells: &[&'a Cited], value: impl Fn(&Cited) -> f64) -> Option<&'a Cited> {
    cells
        .iter()
        .copied()
        .rev()
        .max_by(|a, b| value(a).total_cmp(&value(b)))
}
