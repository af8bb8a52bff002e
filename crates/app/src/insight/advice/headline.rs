//! The answer of a study in two sentences.

use bristle::model::metrics::SWEEPING_RATIO;

use super::cited::{Cited, cells, force, highest};
use super::limits::Limits;
use crate::insight::quantity::Readable;
use crate::insight::slices::{Slice, Varied, process_slices};
use bristle_study::grid::{CaseResult, DEPTH, Study};
use bristle_study::text::number::{counted, short, significant, uncertain};

/// Returns two sentences: the case with the highest tool force of a study, and the one with the
/// highest among laterally stable cases whose filaments sweep. They hold for every study, also for
/// a single case, without a force, and if cases failed.
#[must_use]
pub fn headline(study: &Study, results: &[CaseResult]) -> String {
    let slices = process_slices(study, usize::MAX).chosen;
    let in_slice = |slice| {
        cells(study, results, slice)
            .into_iter()
            .flatten()
            .flatten()
            .map(move |cell| CaseInSlice { slice, cell })
    };
    let places: Vec<CaseInSlice<'_>> = slices.iter().flat_map(in_slice).collect();
    let solved = match (places.len(), results.len()) {
        (0, 1) => return "The case failed. Its error stands below.".to_owned(),
        (0, total) => return format!("All {} failed. Their errors stand below.", counted(total)),
        (solved, total) if solved == total => counted(total),
        (solved, total) => format!("the {solved} of {} that did not fail", counted(total)),
    };
    let forces = Readable::tool_forces(results);
    let highest_of = |cells: &[&Cited]| {
        highest(cells, force)
            .filter(|cell| force(cell) > 0.0)
            .map(|cell| cell.row)
    };
    let find = |row: usize| places.iter().find(|place| place.cell.row == row);
    let all: Vec<&Cited> = places.iter().map(|place| &place.cell).collect();
    let Some(top) = highest_of(&all).and_then(find) else {
        return format!(
            "There is no contact normal force in {solved}. The filaments do not touch the workpiece."
        );
    };
    let CaseInSlice { cell, .. } = top;
    let ratio = significant(cell.outcome.contact_time_ratio);
    let motion = if cell.outcome.contact_time_ratio > SWEEPING_RATIO {
        "sweep"
    } else {
        "strike"
    };
    if results.len() == 1 {
        let lateral = if cell.outcome.laterally_unstable {
            "unstable, so that an imperfection of the filament can change the force"
        } else {
            "stable"
        };
        return format!(
            "At {}, the tool presses with F_n,w = {}, and its filaments {motion} (ε_tc = {ratio}). The pass is laterally {lateral}.",
            top.settings(),
            cell.force_text(&forces)
        );
    }
    if study.is_pressed_on() {
        let by = |value: fn(&Cited) -> f64| {
            highest(&all, value)
                .and_then(|cell| find(cell.row))
                .unwrap_or(top)
        };
        let (deepest, shallowest) = (
            by(|cell| cell.place.penetration_depth_m),
            by(|cell| -cell.place.penetration_depth_m),
        );
        let least = by(|cell| -cell.outcome.tool_power_w);
        return format!(
            "The depths at which the tool presses with the forces of {solved} reach from {} to {}. The least power is {} W, at {} (row {}).",
            shallowest.depth(),
            deepest.depth(),
            significant(least.cell.outcome.tool_power_w),
            least.settings(),
            least.cell.row
        );
    }
    let unstable = if cell.outcome.laterally_unstable {
        ", and the pass is laterally unstable"
    } else {
        ""
    };
    let first = format!(
        "The highest tool force of {solved} is F_n,w = {}, where the filaments {motion} (ε_tc = {ratio}){unstable}.",
        top.text(&forces)
    );
    let limits = Limits {
        min_ratio: Some(SWEEPING_RATIO),
        ..Limits::default()
    };
    let is_safe = |cell: &&Cited| {
        limits.allow(&cell.place, &cell.outcome) && !cell.outcome.laterally_unstable
    };
    let safe: Vec<&Cited> = all.iter().copied().filter(is_safe).collect();
    let second = match highest_of(&safe).and_then(find) {
        None => "In no laterally stable case do the filaments sweep (ε_tc ≥ ½).".to_owned(),
        Some(best) if best.cell.row == cell.row => {
            match highest(&all, |cell| -force(cell)).and_then(|least| find(least.row)) {
                Some(least) if force(&least.cell) < force(cell) => {
                    format!("The lowest is {}.", least.text(&forces))
                }
                _ => "All cases have the same force.".to_owned(),
            }
        }
        Some(best) => format!(
            "Where the filaments sweep (ε_tc ≥ ½) in a laterally stable pass, the highest is {}.",
            best.text(&forces)
        ),
    };
    format!("{first} {second}")
}

/// A case and the slice that it is in.
struct CaseInSlice<'a> {
    slice: &'a Slice,
    cell: Cited,
}

impl CaseInSlice<'_> {
    /// Its velocity, or rotational speed, its depth if that is stated, and further swept settings.
    fn settings(&self) -> String {
        let Slice { x, y, .. } = self.slice;
        let [across, up] = self.cell.position;
        let is_stated =
            |(side, at): &(&Varied, usize)| side.setting.path() != DEPTH || side.values[*at] > 0.0;
        let sides = [(x, across), (y, up)].into_iter().filter(is_stated);
        sides
            .map(|(side, at)| side.setting.equation(side.values[at]))
            .chain([self.slice.condition()])
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Its depth and row.
    fn depth(&self) -> String {
        format!(
            "{} mm (row {})",
            short(1e3 * self.cell.place.penetration_depth_m),
            self.cell.row
        )
    }

    /// Its force, settings and row.
    fn text(&self, forces: &Readable) -> String {
        format!(
            "{} at {} (row {})",
            self.cell.force_text(forces),
            self.settings(),
            self.cell.row
        )
    }
}

impl Cited {
    /// The force with its uncertainty or its band, for a sentence.
    fn force_text(&self, forces: &Readable) -> String {
        let (factor, unit) = (forces.factor(), forces.unit());
        let value = factor * force(self);
        match self.outcome.band() {
            Some(band) => {
                let [lower, upper] = band.map(|end| significant(factor * end));
                format!("{} {unit} [{lower} … {upper}]", significant(value))
            }
            None => format!(
                "{} {unit}",
                uncertain(value, factor * self.outcome.uncertainty_n)
            ),
        }
    }
}
