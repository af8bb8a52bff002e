//! Figures of a study.

use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Prominence};
use bristle_study::grid::{CaseResult, DEPTH, FORCE, Interaction, SPEED, Study, VELOCITY};
use bristle_study::input::measured::Measurement;

use super::metric::{drawn, families};
use super::picture::Picture;
use super::slice_view::{Family, SliceView};
use crate::insight::measured::points_of;
use crate::insight::quantity::shown_metrics;
use crate::insight::slices::{Slice, offset_slices, process_slices, telling_slices, tool_slices};
use crate::report::drawing::format::Format;

/// Maximum number of values of the further sweeps for which figures are drawn.
const MAX_SLICES: usize = 4;
/// Maximum number of curves in a family.
pub(super) const MAX_CURVES: usize = 7;
/// Maximum number of cells along a side of a map; more could not be told apart.
pub(super) const MAX_CELLS: usize = 200;

/// The figures of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Pictures {
    /// In the order of the paper.
    pub pictures: Vec<Picture>,
    /// Omitted figures, with reasons; empty without any.
    pub note: String,
}

/// Draws the figures of a study.
///
/// Studies of velocity and depth have `tip_deflection_map`, `tip_deflection_over_velocity`,
/// `contact_time_map`, `contact_time_over_velocity`, `contact_time_ratio_map`, `impulse_map`,
/// `impulse_over_velocity`, `impulse_over_depth`, `tool_force_map`, `tool_force_over_velocity` and
/// `tool_force_over_depth`. Each other drawn metric has a map and curves over the velocity.
/// Optional metrics that are zero in all cases are left out, and lateral amplifications that never
/// exceed 100. Other studies have each metric over the swept setting, as in
/// `impulse_over_segments`. Measured points add `measured_over_velocity` and `measured_over_depth`.
/// Filaments that scatter add `scatter_over_velocity`, `scatter_over_depth` and
/// `sobol_over_velocity`. Brushes add `interaction_over_velocity`, `interaction_over_depth` and
/// `interaction_factor_map`. Further sweeps and named tools have figures for each of their values,
/// at most four, with the value at the end of the name. Named tools also share diagrams with one
/// curve each, as in `tool_force_over_velocity_by_tool_penetration_depth_m_0.001`. Studies of the
/// rotational speed have `speed` instead of `velocity` in the names.
pub fn study_figures(
    study: &Study,
    results: &[CaseResult],
    measured: &[Measurement],
    format: &Format,
) -> Pictures {
    let slices = telling_slices(study, MAX_SLICES);
    let [of_tools, offsets, process] =
        [tool_slices, offset_slices, process_slices].map(|slices| slices(study, MAX_SLICES));
    let [views, of_tools, of_offsets, of_process] =
        [&slices, &of_tools, &offsets, &process].map(|slices| {
            slices
                .chosen
                .iter()
                .map(|slice| SliceView {
                    study,
                    results,
                    slice,
                    format,
                })
                .collect::<Vec<_>>()
        });
    let mut pictures = Vec::new();
    for view in &views {
        let is_map = is_map(view.slice);
        // The force of a tool that is pressed on is the one that the file states.
        let is_given = |metric: &&Column<Metrics>| {
            study.is_pressed_on() && metric.key == "tool_contact_normal_force_n"
        };
        for metric in shown_metrics(Prominence::Figure, results).filter(|metric| !is_given(metric))
        {
            if is_map {
                pictures.push(view.map(metric, "map"));
            }
            let families = if is_map {
                families(metric)
            } else {
                &[Family::OverX]
            };
            for family in families {
                pictures.push(view.curves(metric, *family));
            }
        }
    }
    for view in &of_tools {
        let metrics = shown_metrics(Prominence::Headline, results);
        pictures.extend(metrics.map(|metric| view.curves(metric, Family::OverX)));
    }
    if results
        .iter()
        .flatten()
        .any(|summary| summary.metrics.edge_share > 0.0)
    {
        for view in &of_offsets {
            let of_edges = drawn::<Metrics>()
                .filter(|metric| ["edge_share", "edge_evenness"].contains(&metric.key));
            pictures.extend(of_edges.map(|metric| view.map(metric, "over_offset_and_depth")));
        }
    }
    if study.has_brush() {
        for view in &views {
            pictures.extend(
                [Family::OverX, Family::OverY]
                    .into_iter()
                    .filter_map(|family| view.interaction(family)),
            );
            if is_map(view.slice) {
                pictures.extend(drawn::<Interaction>().map(|column| view.map(column, "map")));
            }
        }
    }
    if study.scatters() {
        for view in &views {
            pictures.extend(view.scatter(Family::OverX));
            pictures.extend(view.scatter(Family::OverY));
            pictures.extend(view.sobol());
        }
    }
    let mut note = String::new();
    if slices.total == 0 {
        note = "one case alone has no figures; `bristle simulate` draws its course over time"
            .to_owned();
    } else if slices.chosen.len() < slices.total {
        note = format!(
            "for {} of {} values of the further sweeps",
            slices.chosen.len(),
            slices.total
        );
    }
    if !measured.is_empty() {
        for view in &of_process {
            let own: Vec<Measurement> = points_of(study, view.slice, measured).collect();
            for family in [Family::OverX, Family::OverY] {
                pictures.extend(view.measured(&own, family));
            }
        }
    }
    Pictures { pictures, note }
}

/// Returns `true` if a slice is over velocity, or rotational speed, and depth or the force in its
/// place.
fn is_map(slice: &Slice) -> bool {
    let is_pressing = [DEPTH, FORCE].contains(&slice.y.setting.path());
    [VELOCITY, SPEED].contains(&slice.x.setting.path()) && is_pressing && slice.y.varies()
}

/// Returns `true` if [`study_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_study(name: &str) -> bool {
    let rest = |beginning: &str| name.strip_prefix(beginning);
    let of_metric = |rest: &str| rest.starts_with("_map") || rest.starts_with("_over_");
    let beginnings = [
        "measured_over_",
        "scatter_over_",
        "sobol_over_",
        "interaction_over_",
    ];
    beginnings.iter().any(|beginning| rest(beginning).is_some())
        || drawn::<Metrics>().any(|metric| rest(metric.display.file_name).is_some_and(of_metric))
        || drawn::<Interaction>()
            .any(|column| rest(column.display.file_name).is_some_and(of_metric))
}
