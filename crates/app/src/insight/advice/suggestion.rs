//! Settings between simulated cases, at which interpolation expects the force that is asked for.
//!
//! Metrics are interpolated linearly between two neighbouring cases. These differ in depth, or in
//! velocity if the force is not passed along the depth. An interpolated suggestion is therefore no
//! result. The first one is simulated if it is recommended.

use bristle::model::record::Record;
use bristle::model::settings::Settings;
use serde::Serialize;

use super::cited::{Cited, force};
use super::limits::Limits;
use super::outcome::{OperatingPoint, Outcome};
use super::rank::rank;
use crate::insight::slices::{Slice, Varied};
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{CaseResult, CaseSummary, DEPTH, Study, VELOCITY};
use bristle_study::text::number::short;

/// Largest number of suggestions for a section.
const MOST: usize = 2;

/// Settings that have not been simulated by the study.
#[derive(Clone, Debug, Serialize)]
pub struct Suggestion {
    /// Rows of `runs.csv` between which it lies.
    pub between_rows: [usize; 2],
    /// Velocity and depth.
    #[serde(flatten)]
    pub place: OperatingPoint,
    /// The interpolated outcome.
    pub interpolated: Outcome,
    /// Path of the setting that is interpolated.
    #[serde(skip)]
    pub(super) changed: &'static str,
    #[serde(skip)]
    pub(super) settings: Settings,
    #[serde(skip)]
    pub(super) summary: CaseSummary,
}

impl Suggestion {
    /// The value of a side in the unit of its label.
    pub(super) fn shown(&self, side: &Varied) -> String {
        let value = side
            .setting
            .parameter()
            .map_or(0.0, |parameter| parameter.get(&self.settings));
        short(side.setting.factor() * value)
    }
}

/// Suggestions within the limits, at the target force or else at the highest force whose
/// uncertainty is within the limit, by their [`rank`].
pub(super) fn suggestions(
    study: &Study,
    results: &[CaseResult],
    slice: &Slice,
    cells: &[Vec<Option<Cited>>],
    limits: &Limits,
) -> Vec<Suggestion> {
    // Forces that are given differ by what the search leaves.
    let Some(wanted) = limits.wanted_n().filter(|_| !study.is_pressed_on()) else {
        return Vec::new();
    };
    let [x, y] = [slice.x.values.len(), slice.y.values.len()];
    let along_depth: Vec<[[usize; 2]; 2]> = (0..x)
        .flat_map(|x| (1..y).map(move |y| [[x, y - 1], [x, y]]))
        .collect();
    let along_speed: Vec<[[usize; 2]; 2]> = (0..y)
        .flat_map(|y| (1..x).map(move |x| [[x - 1, y], [x, y]]))
        .collect();
    let suggestion = |axis: usize, step: [[usize; 2]; 2]| {
        let (side, changed) = [(&slice.x, VELOCITY), (&slice.y, DEPTH)][axis];
        let [Some(a), Some(b)] = step.map(|[x, y]| cells[y][x].as_ref()) else {
            return None;
        };
        let reaches = |cell: &Cited| match limits.target_force_n {
            Some(_) => cell.outcome.central_n(),
            None => cell.outcome.ends()[1],
        };
        let [from, to] = [a, b].map(reaches);
        if force(a) <= 0.0 || force(b) <= 0.0 || (from - wanted) * (to - wanted) >= 0.0 {
            return None;
        }
        let ends = [a, b].map(|cell| side.values[cell.position[axis]]);
        let rounding = match limits.target_force_n {
            Some(_) => f64::round,
            None if from < to => f64::floor,
            None => f64::ceil,
        };
        let value = rounded(
            ends[0] + (wanted - from) / (to - from) * (ends[1] - ends[0]),
            rounding,
        );
        let share = (value - ends[0]) / (ends[1] - ends[0]);
        if share <= 0.0 || share >= 1.0 {
            return None;
        }
        let [first, second] = [a, b].map(|cell| results[cell.row - 1].as_ref().ok());
        let summary = between(first?, second?, share);
        let mut settings = study.settings(a.row - 1);
        side.setting.parameter()?.set(&mut settings, value);
        let (place, outcome) = (
            OperatingPoint::of(&settings),
            Outcome::new(&settings, &summary),
        );
        limits.allow(&place, &outcome).then_some(Suggestion {
            between_rows: [a.row, b.row],
            place,
            interpolated: outcome,
            changed,
            settings,
            summary,
        })
    };
    let all = |axis: usize, steps: &[[[usize; 2]; 2]]| -> Vec<Suggestion> {
        let steps = steps.iter().copied();
        steps.filter_map(|step| suggestion(axis, step)).collect()
    };
    let mut suggestions = all(1, &along_depth);
    if suggestions.is_empty() {
        suggestions = all(0, &along_speed);
    }
    suggestions.sort_by(|a, b| rank(limits, &a.interpolated, &b.interpolated));
    suggestions.truncate(MOST);
    suggestions
}

/// A setting with three significant digits, which is as finely as machines are set.
pub(super) fn rounded(value: f64, rounding: fn(f64) -> f64) -> f64 {
    let exponent = value.abs().log10().floor() as i32 - 2;
    let digits = rounding(value / 10_f64.powi(exponent));
    // By way of its decimal digits, so that it is the number that people write.
    format!("{digits}e{exponent}").parse().unwrap_or(value)
}

/// Interpolates linearly at a share of the way from one case to another.
fn between(a: &CaseSummary, b: &CaseSummary, share: f64) -> CaseSummary {
    let scatter = a.scatter.as_ref().zip(b.scatter.as_ref());
    CaseSummary {
        metrics: mixed(&a.metrics, &b.metrics, share),
        scatter: scatter.map(|(a, b): (&ForceScatter, &ForceScatter)| mixed(a, b, share)),
        ..CaseSummary::default()
    }
}

/// Interpolates the numbers of two records.
fn mixed<R: Record>(a: &R, b: &R, share: f64) -> R {
    let mut mixed = R::default();
    for column in R::COLUMNS {
        let [a, b] = [a, b].map(|record| column.get(record));
        column.set(&mut mixed, (1.0 - share) * a + share * b);
    }
    mixed
}
