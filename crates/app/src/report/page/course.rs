//! The course of a contact over time, as the page draws it: curves and shapes of the filament.
//!
//! A [`CourseRecorder`] collects courses while a study is simulated. Each course is packed at once,
//! with two bytes per number.

use serde_json::{Value, json};

use super::packed::{Packed, rounded};
use super::selection::Selection;
use crate::insight::slices::spread;
use crate::report::drawing::ends;
use crate::report::view::{View, height, is_upright, moved, root, sampled_pass};
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, ProfileCell, Sample, Sampling, Shape, Simulation};
use bristle::workpiece::ProfileCells;
use bristle_study::grid::{PassRecorder, Study};

/// Sampling of a single turn: enough for curves 600 pixels wide and for smooth motion.
const SAMPLING: Sampling = Sampling {
    samples: 301,
    shapes: 141,
    loads: false,
    profile: true,
    alongside: true,
};
/// Sampling of several turns. Contacts are a small part of them; more samples would make the page
/// too large.
const SAMPLING_OF_TURNS: Sampling = Sampling {
    samples: 1201,
    shapes: 281,
    ..SAMPLING
};
/// Maximum number of points of a shape; longer chains are thinned out.
const MAX_POINTS: usize = 26;

/// The course of one case.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseCourse {
    case: usize,
    /// The course as the script reads it, in SI units.
    pub(super) data: Value,
}

/// Returns points along and above the surface (m) for the script.
fn polyline(points: &[[f64; 2]]) -> Value {
    let [along, above] = [0, 1].map(|k| Packed::new(points.iter().map(|point| point[k])));
    json!({ "along": along, "above": above })
}

/// Returns the outline of the workpiece at its stated place, with the material on the right-hand
/// side. A flag is `true` if the outline goes round the material.
pub(super) fn outline(view: &View) -> Value {
    let mut outline = polyline(&view.surface.points);
    outline["solid"] = json!(view.surface.is_filled);
    outline
}

/// Returns a view of the nodes `drawn` of `shapes`, and of the `boundaries` of worked cells.
fn seen(
    view: &View,
    pass: &Pass,
    shapes: &[Shape],
    drawn: &[usize],
    boundaries: &[[f64; 2]],
) -> Value {
    let nodes = |shape: &Shape| {
        drawn
            .iter()
            .map(|&node| view.place(shape.nodes_m[node]))
            .collect::<Vec<_>>()
    };
    let nodes: Vec<[f64; 2]> = shapes.iter().flat_map(nodes).collect();
    let window = [0, 1].map(|k| ends(nodes.iter().chain(&view.nearest).map(|point| point[k])));
    let moved = shapes
        .iter()
        .map(|shape| view.shift(moved(pass, shape.time_s)));
    let work: Option<Vec<[f64; 2]>> = boundaries.iter().map(|&end| view.on_profile(end)).collect();
    let lines =
        |lines: &[Vec<[f64; 2]>]| lines.iter().map(|line| polyline(line)).collect::<Vec<_>>();
    json!({
        "name": view.name,
        // Left, right, lower and upper end of the view.
        "window": window.as_flattened(),
        "outline": outline(view),
        // Outlines of the body and of the undeformed trim.
        "body": lines(&view.body),
        "trim": lines(&view.trim),
        // The ends of the cells of the work; none where they coincide in this view.
        "work": work.as_deref().map(polyline),
        // Points from root to tip, shape by shape, and the displacement of the workpiece at each.
        "nodes": polyline(&nodes),
        "moved": polyline(&moved.collect::<Vec<_>>()),
    })
}

impl CaseCourse {
    /// Number of the case in its study, counted from 0.
    #[must_use]
    pub fn case(&self) -> usize {
        self.case
    }

    fn new(case: usize, settings: &Settings, simulation: &Simulation) -> Self {
        let pass = sampled_pass(settings);
        let [entry, exit] = pass.nominal_times();
        let Simulation {
            history,
            shapes,
            profile,
            ..
        } = simulation;
        let points = shapes.first().map_or(0, |shape| shape.nodes_m.len());
        let drawn = spread(points, MAX_POINTS);
        let curve = |value: &dyn Fn(&Sample) -> f64| Packed::new(history.iter().map(value));
        let above = |point, sample: &Sample| height(settings, &pass, point, sample.time_s);
        let tip = |sample: &Sample| above([sample.tip_x_m, sample.tip_y_m, sample.tip_z_m], sample);
        let root = |sample: &Sample| above(root(&pass, sample.base_angle_rad), sample);
        let is_posed = !is_upright(settings);
        let [first, last] = worked(profile);
        let cells = pass.profile().unwrap_or_default().cells;
        let cells = ProfileCells {
            cells: cells.get(first..last).unwrap_or_default().to_vec(),
            period: None,
        };
        let work = profile.get(first..last).unwrap_or_default();
        let by_cell = |value: fn(&ProfileCell) -> f64| Packed::new(work.iter().map(value));
        let views = View::all(settings, &pass);
        let impulses = simulation.turn_contact_normal_impulses_n_s.iter();
        let data = json!({
            // Duration of the pass, and times of nominal entry and exit in the first turn.
            "end": simulation.end_time_s,
            "entry": entry,
            "exit": exit,
            // Duration of a turn, and `p_n` of each turn.
            "turn": pass.turn_time(),
            "turn_impulses": impulses.copied().map(rounded).collect::<Vec<_>>(),
            // The work by cells of the profile: their number; their arc lengths, one more than
            // cells; 1 on an edge; normal impulse and friction work per length.
            "work": {
                "cells": cells.cells.len(),
                "arc_length": Packed::new(cells.boundaries()),
                "on_edge": by_cell(|cell| f64::from(u8::from(cell.on_edge))),
                "impulse": by_cell(|cell| cell.normal_impulse_n_s_m),
                "friction": by_cell(|cell| cell.friction_work_j_m),
            },
            "samples": history.len(),
            // The mean and the largest of `F_n` between two samples.
            "mean_force": Packed::new(mean_forces(history)),
            "peak_force": curve(&|sample| sample.peak_contact_normal_force_n),
            "deflection": curve(&|sample| sample.tip_deflection_m),
            "kinetic": curve(&|sample| sample.kinetic_energy_j),
            "potential": curve(&|sample| sample.potential_energy_j),
            "dissipated": curve(&|sample| sample.dissipated_energy_j),
            // Heights above the workpiece, unless the tool is an upright radial one.
            "tip_height": is_posed.then(|| curve(&tip)),
            "root_height": is_posed.then(|| curve(&root)),
            // Number of shapes, and of points in each.
            "shapes": shapes.len(),
            "points": drawn.len(),
            "views": views.iter().map(|view| seen(view, &pass, shapes, &drawn, &cells.points())).collect::<Vec<_>>(),
        });
        Self { case, data }
    }
}

/// Returns the range of the cells of `profile` with work: the first, and the one after the last.
fn worked(profile: &[ProfileCell]) -> [usize; 2] {
    let has_work = |cell: &ProfileCell| cell.normal_impulse_n_s_m > 0.0;
    let first = profile.iter().position(has_work).unwrap_or(0);
    [
        first,
        profile
            .iter()
            .rposition(has_work)
            .map_or(0, |last| last + 1),
    ]
}

/// Returns the mean of `F_n` in N since the previous sample. Unlike values at the samples, it
/// misses no impact, and its integral is `p_n`.
fn mean_forces(history: &[Sample]) -> Vec<f64> {
    let mean = |pair: &[Sample]| {
        let rise = pair[1].contact_normal_impulse_n_s - pair[0].contact_normal_impulse_n_s;
        (rise / (pair[1].time_s - pair[0].time_s)).max(0.0)
    };
    std::iter::once(0.0)
        .chain(history.windows(2).map(mean))
        .collect()
}

/// Records the courses of the cases that the page of a study shows in motion.
pub type CourseRecorder<'a> = PassRecorder<'a, CaseCourse>;

/// Returns the recorder of a study's courses: at most [`MAX_COURSES`](super::MAX_COURSES), evenly
/// spread over the grid. Brushes have none.
#[must_use]
pub fn course_recorder(study: &Study) -> CourseRecorder<'_> {
    let cases = if study.has_brush() {
        Vec::new()
    } else {
        Selection::with_course(study).cases
    };
    let sampling = if study.takes_turns() {
        SAMPLING_OF_TURNS
    } else {
        SAMPLING
    };
    PassRecorder::new(study, cases, sampling, CaseCourse::new)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use bristle::model::parameters::Parameter;
    use bristle::model::settings::WorkpieceKind;
    use bristle::simulation::{Stop, simulate, simulate_with};
    use bristle_study::grid::{CaseResult, Sweep, VELOCITY, run_study, simulate_cases};
    use bristle_study::input::document::Document;

    fn settings() -> Settings {
        let text = include_str!("../../../../../examples/zirconia.toml");
        Document::parse(text, "zirconia.toml")
            .and_then(|document| document.settings())
            .expect("the example is right")
    }

    #[test]
    fn shapes_lie_above_the_workpiece() {
        let mut settings = settings();
        settings.workpiece.kind = WorkpieceKind::plane([1.0, 2.0, 0.5]);
        let simulation = simulate_with(&settings, SAMPLING).expect("the pass ends");
        let course = CaseCourse::new(0, &settings, &simulation);
        let [shapes, points] = ["shapes", "points"].map(|key| course.data[key].as_u64());
        assert_eq!((shapes, points), (Some(SAMPLING.shapes as u64), Some(26)));
        // Except for the penetration of the contact, and a step of packing.
        let least = &course.data["views"][0]["nodes"]["above"]["least"];
        assert!(
            least
                .as_f64()
                .is_some_and(|least| least > -1e-3 && least < 1e-4),
            "{least}"
        );
    }

    /// Sampling must not change results. A course must be that of the pass alone, whether it was
    /// recorded in the study or made later.
    #[test]
    fn courses_are_those_of_the_passes_alone_and_change_nothing() {
        let velocities = Sweep::list(
            Parameter::find(VELOCITY).expect("it exists"),
            vec![10.0, 30.0, 20.0],
        );
        let study = Study::new(settings(), vec![velocities.expect("the values are right")])
            .expect("the study is right");
        let recorder = course_recorder(&study);
        let results = run_study(&study, None, || {}).expect("the threads start");
        let take = |case, pass: &Simulation| recorder.take(case, pass);
        let same = |case: usize, result: CaseResult| {
            assert!(
                result == results[case],
                "metrics and statistics have the same bits"
            );
            ControlFlow::Continue(())
        };
        // As after a resume: the first case is not simulated, so its course has to be made later.
        let sampling = recorder.sampling();
        simulate_cases(
            &study,
            &[1, 2],
            None,
            &Stop::default(),
            sampling,
            take,
            same,
        )
        .expect("the threads start");
        let courses = recorder.finish(&results, None).expect("the threads start");
        let alone = (0..3).map(|case| {
            let settings = study.settings(case);
            let simulation = simulate_with(&settings, SAMPLING).expect("the pass ends");
            CaseCourse::new(case, &settings, &simulation)
        });
        assert!(courses == alone.collect::<Vec<_>>());
    }

    /// The dissipated energy that courses integrate less exactly cannot be told from the exact one
    /// in a drawing.
    #[test]
    fn energies_alongside_are_those_of_a_history() {
        let settings = settings();
        let exact = simulate_with(
            &settings,
            Sampling {
                alongside: false,
                ..SAMPLING
            },
        )
        .expect("the pass ends");
        let alongside = simulate_with(&settings, SAMPLING).expect("the pass ends");
        let taken = |simulation: &Simulation| {
            simulation
                .history
                .last()
                .expect("samples")
                .dissipated_energy_j
        };
        for (exact_sample, sample) in exact.history.iter().zip(&alongside.history) {
            let difference = (exact_sample.dissipated_energy_j - sample.dissipated_energy_j).abs();
            assert!(
                difference < 1e-5 * taken(&exact),
                "{difference} J at {} s",
                sample.time_s
            );
        }
        assert_eq!(
            alongside.metrics,
            simulate(&settings).expect("the pass ends").metrics
        );
    }
}
