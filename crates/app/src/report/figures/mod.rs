//! Figures of results: metrics of a study over its settings, comparisons with measured forces, one
//! contact over time.
//!
//! Results in, named figures out. They correspond to figures 3 to 7 of Uhlmann and Hoyer (2021).

use crate::insight::measured::{points_of, relative_uncertainty};
use crate::insight::quantity::shown_metrics;
use crate::insight::slices::spread;
use crate::insight::slices::{
    Slice, Varied, offset_slices, process_slices, telling_slices, tool_slices,
};
use crate::report::drawing::diagram::{Curve, Diagram, Look, draw_axes, left_of};
use crate::report::drawing::format::Format;
use crate::report::drawing::heading::Heading;
use crate::report::drawing::map::{self, Contour, Map};
use crate::report::drawing::pens::pen;
use crate::report::drawing::scale::{Axis, AxisScale};
use crate::report::drawing::{
    BLUE, Canvas, CanvasPoint, Color, GREY, INK, Pen, VERMILION, ends, fine, stroke, text,
};
use crate::report::view::{height, is_all_round, is_upright, root, sampled_pass};
use bristle::model::metrics::Metrics;
use bristle::model::record::{self, Column, Curves, Level, Prominence, Record, Scope};
use bristle::model::settings::{MAX_TURNS, Settings};
use bristle::simulation::{Pass, ProfileCell, Sample, Shape};
use bristle::tool::places;
use bristle_study::grid::{
    CaseResult, CaseSummary, DEPTH, FORCE, Interaction, SPEED, Study, VELOCITY,
};
use bristle_study::input::measured::Measurement;
use bristle_study::text::capitalised;
use bristle_study::text::number::{short, significant};

mod brush;
mod calibration;
mod convergence;
mod force;
mod picture;
mod profile;
mod removal;

pub use brush::{Brush, brush_figures, is_of_brush};
pub use calibration::{calibration_figures, is_of_calibration};
pub use convergence::{convergence_figures, is_of_convergence};
pub use picture::Picture;
pub use profile::drawn_shapes;
pub use removal::{corner_outline, is_of_removal, removal_figures, unit_of_time};

use picture::{brush_line, contact_title, of_process, with_brush};
use profile::{PROFILE_DRAWN, PROFILE_UNROLLED};

/// Maximum number of values of the further sweeps for which figures are drawn.
const MAX_SLICES: usize = 4;
/// Maximum number of curves in a family.
const MAX_CURVES: usize = 7;
/// Maximum number of cells along a side of a map; more could not be told apart.
const MAX_CELLS: usize = 200;

/// Maximum number of figures unless all are requested.
const MAIN: usize = 5;
/// Preferred figures of a study in order, each by the beginning of its name and a later part.
/// Measured forces come first, then effects of interaction and of varying filaments, tools side by
/// side, and work on edges. Force, contact time ratio, impulse and power over the settings follow.
const PREFERRED: [[&str; 2]; 22] = [
    ["measured_over_", ""],
    ["interaction_over_", ""],
    ["interaction_factor_map", ""],
    ["scatter_over_", ""],
    ["sobol_over_", ""],
    ["tool_force_over_", "_by_tool"],
    ["contact_time_ratio_over_", "_by_tool"],
    ["impulse_over_", "_by_tool"],
    ["tool_power_over_", "_by_tool"],
    ["tool_torque_over_", "_by_tool"],
    ["edge_share_over_offset", ""],
    ["edge_evenness_over_offset", ""],
    ["tool_force_map", ""],
    ["contact_time_ratio_map", ""],
    ["impulse_map", ""],
    ["tool_power_map", ""],
    ["penetration_depth_", ""],
    ["tool_force_over_", ""],
    ["contact_time_ratio_over_", ""],
    ["impulse_over_", ""],
    ["tool_power_over_", ""],
    ["tool_torque_over_", ""],
];

/// Returns the five most important figures in their order: one of each preferred kind, filled up
/// with the first ones.
#[must_use]
pub fn main_figures(pictures: Vec<Picture>) -> Vec<Picture> {
    let mut chosen: Vec<usize> = Vec::new();
    let of_kind = |[start, part]: [&str; 2]| {
        pictures.iter().position(|Picture { name, .. }| {
            name.strip_prefix(start)
                .is_some_and(|rest| rest.contains(part))
        })
    };
    for index in PREFERRED
        .into_iter()
        .filter_map(of_kind)
        .chain(0..pictures.len())
    {
        if chosen.len() < MAIN && !chosen.contains(&index) {
            chosen.push(index);
        }
    }
    let kept = pictures
        .into_iter()
        .enumerate()
        .filter(|(index, _)| chosen.contains(index));
    kept.map(|(_, picture)| picture).collect()
}

/// The figures of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Pictures {
    /// In the order of the paper.
    pub pictures: Vec<Picture>,
    /// Omitted figures, with reasons; empty without any.
    pub note: String,
}

/// A family of curves that goes with a map.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Family {
    OverX,
    OverY,
}

/// A record whose numbers are drawn over the settings of a study.
trait Drawn: Record {
    /// Returns the record of a case, if it has one.
    fn of(summary: &CaseSummary) -> Option<&Self>;
}

impl Drawn for Metrics {
    fn of(summary: &CaseSummary) -> Option<&Self> {
        Some(&summary.metrics)
    }
}

impl Drawn for Interaction {
    fn of(summary: &CaseSummary) -> Option<&Self> {
        summary.brush.as_ref()
    }
}

/// Returns the columns that figures may show: among the metrics those of the paper's figures 4a,
/// 4b, 5, 6a and 6b.
fn drawn<R: Drawn>() -> impl Iterator<Item = &'static Column<R>> {
    R::COLUMNS
        .iter()
        .filter(|column| column.display.prominence <= Prominence::Figure)
}

/// Returns the families of curves that go with a map of a metric.
fn families<R>(metric: &Column<R>) -> &'static [Family] {
    match metric.display.curves {
        Curves::None => &[],
        Curves::OverVelocity => &[Family::OverX],
        Curves::OverBoth => &[Family::OverX, Family::OverY],
    }
}

/// Returns the name of a metric as a title, with its symbol and unit.
fn title<R>(metric: &Column<R>) -> String {
    format!(
        "{} {}",
        capitalised(metric.name),
        with_unit(metric, metric.symbol)
    )
    .trim_end()
    .to_owned()
}

/// Returns symbol and unit of a metric; its name if it has no symbol.
fn label<R>(metric: &Column<R>) -> String {
    with_unit(
        metric,
        if metric.symbol.is_empty() {
            metric.name
        } else {
            metric.symbol
        },
    )
}

/// Returns a text with the unit in which figures show the metric.
fn with_unit<R>(metric: &Column<R>, text: &str) -> String {
    let unit = metric.display.unit;
    if unit.is_empty() {
        text.to_owned()
    } else {
        format!("{text} in {unit}")
    }
}

/// Largest value below which a number that can span decades is on a linear axis.
const MAX_LINEAR_VALUE: f64 = 10.0;

/// Returns the axis of a metric with these values.
fn axis_of<'a, R>(
    metric: &Column<R>,
    values: impl Iterator<Item = &'a Option<f64>>,
    linear: impl FnOnce(String) -> Axis,
) -> Axis {
    let range = ends(values.flatten().copied());
    let is_linear = match metric.display.scale {
        record::Scale::Linear => true,
        record::Scale::Logarithmic => range[1] < MAX_LINEAR_VALUE,
        record::Scale::Fitting => !span_decades(range),
    };
    if is_linear {
        linear(label(metric))
    } else {
        Axis::logarithmic(label(metric))
    }
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

/// The side along which a figure runs, and the side with one curve per value.
struct Sides<'a> {
    family: Family,
    over: &'a Varied,
    of: &'a Varied,
}

/// A slice and the results in it.
struct SliceView<'a> {
    study: &'a Study,
    results: &'a [CaseResult],
    slice: &'a Slice,
    format: &'a Format,
}

impl SliceView<'_> {
    /// Returns a metric in its unit at positions on the sides of the slice; `None` if the case
    /// failed.
    fn value<R: Drawn>(&self, metric: &Column<R>, x: usize, y: usize) -> Option<f64> {
        let summary = self.results[self.slice.case(x, y)].as_ref().ok()?;
        Some(metric.display.factor * metric.get(R::of(summary)?))
    }

    /// Returns the sides of the slice as a family of curves uses them.
    fn sides(&self, family: Family) -> Sides<'_> {
        let Slice { x, y, .. } = self.slice;
        match family {
            Family::OverX => Sides {
                family,
                over: x,
                of: y,
            },
            Family::OverY => Sides {
                family,
                over: y,
                of: x,
            },
        }
    }

    /// Joins the parts of a subtitle after those that all figures of the slice share. Adds a line
    /// with friction and brush.
    fn subtitle(&self, parts: impl IntoIterator<Item = String>) -> String {
        let all = std::iter::once(self.slice.condition()).chain(parts);
        let parts = all.filter(|part| !part.is_empty()).collect::<Vec<_>>();
        let Slice { x, y, fixed, .. } = self.slice;
        // Each setting depends on one side at most.
        let along_x = (0..x.values.len()).map(|at| self.slice.case(at, 0));
        let along_y = (0..y.values.len()).map(|at| self.slice.case(0, at));
        let cases: Vec<Settings> = along_x
            .chain(along_y)
            .map(|case| self.study.settings(case))
            .collect();
        let is_in_condition = |path: &str| fixed.iter().any(|(setting, _)| setting.path() == path);
        let lines = [parts.join("; "), brush_line(&cases, is_in_condition)];
        lines.join("\n")
    }

    /// Returns `N_f` with its uncertainty, if it applies to all values.
    fn uncertainty<R>(&self, metric: &Column<R>) -> String {
        let case = self.slice.case(0, 0);
        let relative = relative_uncertainty(&self.study.settings(case));
        let varies = [&self.slice.x, &self.slice.y]
            .iter()
            .any(|side| side.setting.section() == "tool");
        if metric.display.scope != Scope::Tool || relative == 0.0 || varies {
            return String::new();
        }
        let tool = self.study.settings(case).tool;
        let spread = short(tool.filament_count_uncertainty);
        format!("N_f ± {spread}: all values ± {:.1} %", 100.0 * relative)
    }

    /// Returns `true` if the case at positions on the sides of the slice is laterally unstable.
    fn is_unstable(&self, x: usize, y: usize) -> bool {
        self.results[self.slice.case(x, y)]
            .as_ref()
            .is_ok_and(|summary| summary.metrics.laterally_unstable)
    }

    /// Returns a note if some of the `shown` values are missing.
    fn failures(&self, shown: impl Iterator<Item = Option<f64>>, mark: &str) -> String {
        match shown.filter(Option::is_none).count() {
            0 => String::new(),
            1 => format!("{mark}: one simulation failed"),
            failed => format!("{mark}: {failed} simulations failed"),
        }
    }

    /// Draws a map of a metric; `kind` is part of its name.
    fn map<R: Drawn>(&self, metric: &Column<R>, kind: &str) -> Picture {
        let Slice { x, y, .. } = self.slice;
        let [columns, rows] = [x, y].map(|side| spread(side.values.len(), MAX_CELLS));
        let side = |side: &Varied, shown: &[usize]| {
            let all = side.shown();
            let values: Vec<f64> = shown.iter().map(|&position| all[position]).collect();
            let labels = side
                .setting
                .labels(shown.iter().map(|&position| side.values[position]));
            map::CellAxis {
                label: side.setting.label(),
                labels,
                values,
            }
        };
        let shown = || {
            rows.iter()
                .flat_map(|&row| columns.iter().map(move |&column| (column, row)))
        };
        let values: Vec<Option<f64>> = shown()
            .map(|(column, row)| self.value(metric, column, row))
            .collect();
        let marked: Vec<bool> = shown()
            .map(|(column, row)| self.is_unstable(column, row))
            .collect();
        let all = x.values.len() * y.values.len();
        let selection = selection(values.len(), all, "cases");
        let crosses = |level: &Level, values: &[Option<f64>]| {
            let is_below = |value: &f64| *value < level.value;
            values.iter().flatten().any(is_below) && !values.iter().flatten().all(is_below)
        };
        let of_another = |level: &Level| {
            let other = Metrics::COLUMNS
                .iter()
                .find(|column| column.key == level.of && level.of != metric.key)?;
            Some(
                shown()
                    .map(|(column, row)| self.value(other, column, row))
                    .collect::<Vec<Option<f64>>>(),
            )
        };
        let line = metric
            .display
            .level
            .map(|level| (level, of_another(&level)));
        let line = line.filter(|(level, other)| crosses(level, other.as_ref().unwrap_or(&values)));
        let meaning = line
            .as_ref()
            .map_or_else(String::new, |(level, _)| level.meaning.to_owned());
        let failures = self.failures(values.iter().copied(), "hatched");
        let instabilities = if marked.contains(&true) {
            "corner: laterally unstable"
        } else {
            ""
        };
        let parts = [
            meaning,
            instabilities.to_owned(),
            self.uncertainty(metric),
            selection,
            failures,
        ];
        let subtitle = self.subtitle(parts);
        let map = Map {
            title: title(metric),
            subtitle,
            x: side(x, &columns),
            y: side(y, &rows),
            colours: axis_of(metric, values.iter(), Axis::linear),
            values,
            marked,
            range: metric.display.range,
            line: line.map(|(level, other)| Contour {
                level: level.value,
                other,
            }),
        };
        Picture {
            name: format!("{}_{kind}{}", metric.display.file_name, self.slice.suffix()),
            canvas: map.draw_in(self.format),
        }
    }

    fn curves<R: Drawn>(&self, metric: &Column<R>, family: Family) -> Picture {
        let Sides { over, of, .. } = self.sides(family);
        let value = |along: usize, member: usize| match family {
            Family::OverX => self.value(metric, along, member),
            Family::OverY => self.value(metric, member, along),
        };
        let members = spread(of.values.len(), MAX_CURVES);
        let shown = over.shown();
        let family: Vec<Vec<Option<f64>>> = members
            .iter()
            .map(|&member| (0..shown.len()).map(|along| value(along, member)).collect())
            .collect();
        // Tools are compared by their levels.
        let are_numbers = [over, of].iter().all(|side| side.setting.names().is_none());
        let is_linear = metric.display.scale != record::Scale::Logarithmic;
        let means = means_of_flat(&family).filter(|_| is_linear && are_numbers);
        let curve = |(position, values): (usize, &Vec<Option<f64>>)| {
            let name = of.setting.legend(of.values[members[position]]);
            let (name, on_axis): (_, Box<dyn Fn(f64) -> f64>) = match &means {
                Some(means) => {
                    let mean = means[position];
                    let name =
                        format!("{name}: mean {} {}", significant(mean), metric.display.unit);
                    (
                        name.trim_end().to_owned(),
                        Box::new(move |value| 100.0 * (value / mean - 1.0)),
                    )
                }
                None => (name, Box::new(|value| value)),
            };
            let points = shown
                .iter()
                .zip(values)
                .map(|(&at, value)| (at, value.map_or(f64::NAN, &on_axis)));
            Curve::new(name, joined(over), points)
        };
        let mut curves: Vec<Curve> = family.iter().enumerate().map(curve).collect();
        if let Some(Level {
            value,
            in_curves: name,
            ..
        }) = metric.display.level
            && !name.is_empty()
            && curves
                .iter()
                .flat_map(|curve| &curve.points)
                .any(|(_, shown)| *shown > value)
        {
            let ends = [shown[0], shown[shown.len() - 1]];
            curves.push(Curve::new(
                name,
                Look::Reference,
                ends.map(|end| (end, value)),
            ));
        }
        let selection = selection(members.len(), of.values.len(), &values_of(of));
        let axis = axis_of(metric, family.iter().flatten(), Axis::amount);
        let failures = self.failures(family.into_iter().flatten(), "gaps");
        let diagram = Diagram::new(
            title(metric),
            self.subtitle([self.uncertainty(metric), selection, failures]),
            [
                axis_along(over),
                match means {
                    Some(_) => Axis::linear("deviation from the mean in %"),
                    None => axis,
                },
            ],
            curves,
        );
        let by = if of.setting.names().is_some() {
            "_by_tool"
        } else {
            ""
        };
        let name = format!(
            "{}_over_{}{by}{}",
            metric.display.file_name,
            over.setting.word(),
            self.slice.suffix()
        );
        Picture::of(name, self.format, &diagram)
    }
}

/// Least ratio of the values of a setting that are drawn on a logarithmic axis.
const DECADES: f64 = 100.0;
/// Largest change along a flat curve next to curves at other levels, as a share of its mean.
const FLAT: f64 = 0.1;

/// Returns `true` if values from the least to the largest span decades.
fn span_decades([least, largest]: [f64; 2]) -> bool {
    least > 0.0 && largest >= DECADES * least
}

/// Returns the axis along a side: logarithmic if its values span decades.
fn axis_along(side: &Varied) -> Axis {
    let label = side.setting.label();
    let (least, largest) = (side.values[0], side.values[side.values.len() - 1]);
    match side.setting.names() {
        Some(names) => Axis::named(label, names.to_vec()),
        None if span_decades([least, largest]) => Axis::logarithmic(label),
        None => Axis::linear(label),
    }
}

/// Returns the means of several curves that each look flat, because their levels differ by more
/// than each of them changes. `None` for other curves.
fn means_of_flat(curves: &[Vec<Option<f64>>]) -> Option<Vec<f64>> {
    let range = |values: &[f64]| ends(values.iter().copied());
    let known: Vec<Vec<f64>> = curves
        .iter()
        .map(|values| values.iter().copied().flatten().collect())
        .collect();
    let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let means: Vec<f64> = known.iter().map(mean).collect();
    let changes = |values: &Vec<f64>| {
        let [least, largest] = range(values);
        largest - least
    };
    let [lowest, highest] = range(&means);
    let is_flat = |values: &Vec<f64>| {
        values.len() > 1
            && changes(values) < FLAT * mean(values).abs()
            && changes(values) < FLAT * (highest - lowest)
    };
    (known.len() > 1 && known.iter().all(is_flat) && lowest > 0.0).then_some(means)
}

/// Returns the style of points along a side. Tools are not joined, as nothing lies between them.
fn joined(side: &Varied) -> Look {
    if side.setting.names().is_some() {
        Look::Markers
    } else {
        Look::Joined
    }
}

/// Returns the name of the values of a side.
fn values_of(side: &Varied) -> String {
    if side.setting.names().is_some() {
        "tools".to_owned()
    } else {
        format!("values of {}", side.setting.symbol())
    }
}

/// Returns the number of shown values in words; empty if all are shown.
fn selection(shown: usize, total: usize, what: &str) -> String {
    if shown < total {
        format!("{shown} of {total} {what}")
    } else {
        String::new()
    }
}

/// Name of the figure of one contact over time.
const HISTORY_FIGURE: &str = "history";

/// Draws the figures of one contact. `history` has force and tip deflection over time. `turns` has
/// the `impulses` of its turns in N s, if there are several. `profile_unrolled` has impulse and
/// friction work along the profile of the workpiece. `profile_drawn` has the filament in `shapes`
/// ([`drawn_shapes`]) on the workpiece, with the work. Both need a contact.
#[must_use]
pub fn contact_figures(
    settings: &Settings,
    history: &[Sample],
    impulses: &[f64],
    profile: &[ProfileCell],
    shapes: &[Shape],
    format: &Format,
) -> Vec<Picture> {
    let drawn = [
        turns_figure(settings, impulses, format),
        profile::unrolled(settings, profile, format),
        profile::drawn(settings, profile, shapes, format),
    ];
    std::iter::once(history_figure(settings, history, format))
        .chain(drawn.into_iter().flatten())
        .collect()
}

/// Returns `true` if [`contact_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_contact(name: &str) -> bool {
    [
        HISTORY_FIGURE,
        TURNS_FIGURE,
        PROFILE_UNROLLED,
        PROFILE_DRAWN,
    ]
    .contains(&name)
}

/// Width of the figure of a history; height of its panels on a screen, of more than two panels, and
/// at least, in pixels.
const HISTORY: i32 = 760;
const PANEL: i32 = 190;
const LOW_PANEL: i32 = 130;
const MIN_PANEL: i32 = 120;
/// Pixels between the heading and the panels, between them, and below them.
const ABOVE: i32 = 10;
const BETWEEN: i32 = 26;
const BELOW: i32 = 54;
/// Background of times in contact.
const CONTACT: Color = Color(225, 232, 240);

/// A quantity over time.
struct Panel {
    label: &'static str,
    color: Color,
    points: Vec<(f64, f64)>,
    /// `true` if its axis begins at zero.
    from_zero: bool,
}

/// Returns force and tip deflection over the `times` of a history (ms). Tools that are not upright
/// radial ones also have the heights of tip and root.
fn panels(settings: &Settings, pass: &Pass, history: &[Sample], times: &[f64]) -> Vec<Panel> {
    let panel = |label, color, from_zero, value: &dyn Fn(&Sample) -> f64| Panel {
        label,
        color,
        points: times
            .iter()
            .copied()
            .zip(history.iter().map(value))
            .collect(),
        from_zero,
    };
    let mut panels = vec![
        panel("F_n in N", VERMILION, true, &|sample| {
            sample.contact_normal_force_n
        }),
        panel("s_n in mm", BLUE, true, &|sample| {
            1e3 * sample.tip_deflection_m
        }),
    ];
    if !is_upright(settings) {
        let above = |point, sample: &Sample| 1e3 * height(settings, pass, point, sample.time_s);
        let tip = |sample: &Sample| above([sample.tip_x_m, sample.tip_y_m, sample.tip_z_m], sample);
        let root = |sample: &Sample| above(root(pass, sample.base_angle_rad), sample);
        panels.extend([
            panel("tip in mm", INK, false, &tip),
            panel("root in mm", INK, false, &root),
        ]);
    }
    panels
}

/// Draws one contact over time, with force and tip deflection (Fig. 3 of the paper).
fn history_figure(settings: &Settings, history: &[Sample], format: &Format) -> Picture {
    let milliseconds = |time: f64| 1e3 * time;
    let pass = sampled_pass(settings);
    let all_round = is_all_round(&pass);
    let touches = !pass.touches().is_empty();
    let [entry, exit] = pass.nominal_times();
    let last_time = history.last().map_or(0.0, |sample| sample.time_s);
    let begun = (0..MAX_TURNS)
        .map(|turn| turn as f64 * pass.turn_time())
        .take_while(|&begun| begun < last_time);
    let nominal: Vec<(f64, &str)> = begun
        .filter(|_| touches || is_upright(settings))
        // One turn ends where the next begins if the filament touches all round.
        .flat_map(|begun| {
            [(begun + entry, "entry"), (begun + exit, "exit")]
                .into_iter()
                .take(if all_round { 1 } else { 2 })
        })
        .map(|(time, name)| (milliseconds(time), name))
        .collect();
    // Those of several turns would hide each other.
    let are_named = nominal.len() == 2 && !all_round;
    let times: Vec<f64> = history
        .iter()
        .map(|sample| milliseconds(sample.time_s))
        .collect();
    let x = AxisScale::exact(Axis::linear("time t in ms"), times.iter().copied());
    let panels = panels(settings, &pass, history, &times);
    let forces = panels[0].points.clone();
    let panels: Vec<(AxisScale, Panel)> = panels
        .into_iter()
        .map(|panel| {
            let axis = if panel.from_zero {
                Axis::from_zero
            } else {
                Axis::linear
            };
            (
                AxisScale::new(axis(panel.label), panel.points.iter().map(|(_, y)| *y)),
                panel,
            )
        })
        .collect();
    let left = panels
        .iter()
        .map(|(scale, ..)| left_of(format, scale))
        .max()
        .unwrap_or(0);
    let page = format.width(HISTORY);
    let right = page - 24;
    let title = contact_title("One contact", settings);
    let mut subtitle = match all_round {
        false => "shaded: in contact; dashed: nominal entry and exit of the undeformed filament",
        true => "shaded: in contact; dashed: the beginnings of the turns, before which the workpiece comes up",
    }
    .to_owned();
    if panels.len() > 2 {
        subtitle.push_str("; tip and root: their heights above the workpiece");
    }
    if places(settings).len() > 1 {
        subtitle.push_str("; all of the filament in the middle of the trim");
    }
    let subtitle = with_brush(&subtitle, settings);
    let heading = Heading::new(format, &title, &subtitle, [left, page]);
    let panel = if panels.len() > 2 { LOW_PANEL } else { PANEL };
    let panel = format.height(panel, HISTORY, MIN_PANEL);
    let first = heading.height() + ABOVE;
    let count = panels.len() as i32;
    let mut canvas = Canvas::on(
        format,
        (page, first + count * panel + (count - 1) * BETWEEN + BELOW),
    );
    heading.draw(&mut canvas);
    for (row, (scale, Panel { points, color, .. })) in (0..).zip(&panels) {
        let top = first + row * (panel + BETWEEN);
        let frame = [left, top, right, top + panel];
        draw_contact(&mut canvas, &x, &forces, frame);
        let last = row + 1 == count;
        let mut x = x.clone();
        if !last {
            x.axis.label = "".into();
            x.ticks.iter_mut().for_each(|(_, label)| label.clear());
        }
        draw_axes(&mut canvas, [&x, scale], frame);
        for &(time, name) in &nominal {
            if (0.0..=1.0).contains(&x.part(time)) {
                let at = x.place(time, left, right);
                let line = Pen {
                    color: GREY,
                    tenths: 10,
                    dash: (5, 4),
                    ..pen(0)
                };
                line.line(&mut canvas, &[(at, fine(top)), (at, fine(top + panel))]);
                if row == 0 && are_named {
                    canvas.text(name, text(11, GREY).centred(), (at, fine(top - 8)));
                }
            }
        }
        let places = points
            .iter()
            .map(|&(time, y)| (x.place(time, left, right), scale.place(y, top + panel, top)));
        let mut line: Vec<CanvasPoint> = places.collect();
        line.dedup();
        canvas.line(line, stroke(*color, 14));
    }
    Picture {
        name: HISTORY_FIGURE.to_owned(),
        canvas,
    }
}

/// Name of the figure of the turns of one contact.
const TURNS_FIGURE: &str = "turns";

/// Draws the contact normal impulses of all turns of one contact in N s; the figure is named
/// [`TURNS_FIGURE`]. `None` for a single turn.
fn turns_figure(settings: &Settings, impulses: &[f64], format: &Format) -> Option<Picture> {
    if impulses.len() < 2 {
        return None;
    }
    let points = (1..)
        .zip(impulses)
        .map(|(turn, impulse)| (f64::from(turn), 1e3 * impulse));
    let diagram = Diagram::new(
        "Contact normal impulse turn by turn",
        with_brush(&of_process(settings), settings),
        [Axis::count("turn"), Axis::amount("p_n in mN s")],
        vec![Curve::new("", Look::Joined, points)],
    );
    Some(Picture::of(TURNS_FIGURE, format, &diagram))
}

/// Shades the times in contact.
fn draw_contact(
    canvas: &mut Canvas,
    x: &AxisScale,
    forces: &[(f64, f64)],
    [left, top, right, bottom]: [i32; 4],
) {
    let mut marked: Vec<(i32, i32)> = Vec::new();
    for pair in forces
        .windows(2)
        .filter(|pair| pair.iter().any(|(_, force)| *force > 0.0))
    {
        let [from, to] = [pair[0].0, pair[1].0].map(|time| x.place(time, left, right));
        match marked.last_mut() {
            // Gaps below half a pixel are shaded too.
            Some((_, end)) if from - *end <= fine(1) / 2 => *end = to,
            _ => marked.push((from, to)),
        }
    }
    for (from, to) in marked {
        canvas.rectangle([(from, fine(top)), (to, fine(bottom))], CONTACT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bristle::simulation::simulate_with_history;
    use bristle_study::grid::run_study;
    use bristle_study::input::document::Document;
    use bristle_study::input::measured::Speed;

    fn study(sweeps: &str) -> (Study, Vec<CaseResult>) {
        let text = format!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\nfilament_count_uncertainty = 600\n[filament]\nsegments = 2\nlength_m = 0.040\n\
             diameter_m = 1.18e-3\n[solver]\nrelative_tolerance = 1e-2\n[process]\nbrushing_velocity_m_s = 10.0\n\
             penetration_depth_m = 1.0e-3\n[study]\n{sweeps}"
        );
        let study = Document::parse(&text, "case.toml")
            .and_then(|document| document.study())
            .expect("a study");
        let results = run_study(&study, None, || {}).expect("threads");
        (study, results)
    }

    fn names(pictures: &Pictures) -> Vec<&str> {
        pictures
            .pictures
            .iter()
            .map(|picture| picture.name.as_str())
            .collect()
    }

    #[test]
    fn odd_grids_are_drawn_without_what_is_no_number() {
        let sweeps = [
            "brushing_velocity_m_s = [10.0]",
            "brushing_velocity_m_s = [10.0, 10.0]\npenetration_depth_m = [1e-3]",
            "brushing_velocity_m_s = [20.0, 10.0, 11.0]\npenetration_depth_m = [3e-3, 1e-3]",
            "penetration_depth_m = [1e-3, 2e-3]\n\"filament.segments\" = [1, 2, 3]",
            "\"tool.filament_count\" = [0.0, 10.0]\n\"filament.segments\" = [1, 2]\n\"contact.exponent\" = [1.0, 1.5]",
        ];
        let point = |velocity: f64, depth: f64| Measurement {
            speed: Speed::Velocity(velocity),
            second_speed_rpm: None,
            penetration_depth_m: depth,
            force_n: -1.0,
            std_n: Some(0.0),
            tool: None,
        };
        let measured = [point(10.0, 1e-3), point(10.5, 1.5e-3), point(1e9, 1e-9)];
        for sweeps in sweeps {
            let (study, mut results) = study(sweeps);
            // As simulated, with one failed case, and with failed cases only.
            for failed in [0, 1, results.len()] {
                results
                    .iter_mut()
                    .take(failed)
                    .for_each(|result| *result = Err("failed".to_owned()));
                let pictures = study_figures(&study, &results, &measured, &Format::default());
                for Picture { name, canvas } in &pictures.pictures {
                    let svg = canvas.svg();
                    assert!(is_of_study(name), "{name}");
                    assert!(
                        svg.trim_end().ends_with("</svg>")
                            && !svg.contains("NaN")
                            && !svg.contains("inf"),
                        "{name}"
                    );
                }
                let mut names = names(&pictures);
                names.sort_unstable();
                names.dedup();
                assert_eq!(names.len(), pictures.pictures.len());
            }
        }
    }

    #[test]
    fn five_figures_matter_most() {
        let main = |names: &[&str]| {
            let picture = |name: &&str| Picture {
                name: (*name).to_owned(),
                canvas: Canvas::on(&Format::default(), (1, 1)),
            };
            main_figures(names.iter().map(picture).collect())
                .into_iter()
                .map(|picture| picture.name)
                .collect::<Vec<_>>()
        };
        let (study, results) =
            study("brushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]");
        let all = study_figures(&study, &results, &[], &Format::default());
        let mut expected = [
            "contact_time_ratio_map",
            "impulse_map",
            "tool_force_map",
            "tool_power_map",
            "tool_force_over_velocity",
        ];
        let mut chosen = main(&names(&all));
        expected.sort_unstable();
        chosen.sort_unstable();
        assert_eq!(chosen, expected);
        let more = [&["measured_over_depth"][..], &names(&all)].concat();
        let chosen = main(&more);
        assert!(
            chosen.len() == MAIN && chosen[0] == "measured_over_depth",
            "{chosen:?}"
        );
        assert!(!chosen.contains(&"tool_force_over_velocity".to_owned()));
        let by_tool = "impulse_over_speed_by_tool_penetration_depth_m_0.001";
        assert_eq!(
            main(&["a", "b", "c", "d", "e", "impulse_map", by_tool]),
            ["a", "b", "c", "impulse_map", by_tool]
        );
        assert_eq!(main(&["history", "turns"]), ["history", "turns"]);
    }

    #[test]
    fn one_case_has_no_picture() {
        let (study, results) = study("brushing_velocity_m_s = [10.0]");
        let pictures = study_figures(&study, &results, &[], &Format::default());
        assert!(pictures.pictures.is_empty() && !pictures.note.is_empty());
    }

    #[test]
    fn flat_curves_at_different_levels_show_their_changes() {
        let known = |curves: &[&[f64]]| {
            curves
                .iter()
                .map(|values| values.iter().copied().map(Some).collect())
                .collect()
        };
        let means = |curves: Vec<Vec<Option<f64>>>| means_of_flat(&curves);
        assert_eq!(
            means(known(&[&[10.0, 10.1], &[20.0, 20.1]])),
            Some(vec![10.05, 20.05])
        );
        assert_eq!(
            means(vec![
                vec![Some(10.0), None, Some(10.1)],
                vec![Some(20.0), Some(20.1), None]
            ]),
            Some(vec![10.05, 20.05])
        );
        // One curve, curves that change, that lie together, without values, or below zero, are
        // drawn as they are.
        for curves in [
            &[&[10.0, 10.1][..]][..],
            &[&[10.0, 12.0], &[20.0, 20.1]],
            &[&[10.0, 10.1], &[10.2, 10.3]],
            &[&[], &[]],
            &[&[-1.0, -1.0], &[1.0, 1.0]],
        ] {
            assert_eq!(means(known(curves)), None, "{curves:?}");
        }

        let (study, mut results) =
            study("\"filament.segments\" = [1, 2]\n\"solver.relative_tolerance\" = [1e-5, 1e-3]");
        for (case, result) in results.iter_mut().enumerate() {
            let force = [100.0, 100.1, 200.0, 200.4][case];
            result
                .as_mut()
                .expect("a result")
                .metrics
                .tool_contact_normal_force_n = force;
        }
        let pictures = study_figures(&study, &results, &[], &Format::default()).pictures;
        let picture = pictures
            .iter()
            .find(|picture| picture.name == "tool_force_over_relative_tolerance");
        let svg = picture.expect("a figure").canvas.svg();
        for text in [
            "deviation from the mean in %",
            "segments = 2: mean 200 N",
            "10⁻⁵",
        ] {
            assert!(svg.contains(text), "{text}");
        }
    }

    #[test]
    fn on_paper_all_text_has_its_size() {
        let (study, results) =
            study("brushing_velocity_m_s = [10.0, 15.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]");
        let settings = study.settings(0);
        let simulation = simulate_with_history(&settings, 100).expect("a pass");
        for (width_mm, points) in [(84.0, 8.0), (90.0, 10.0), (174.0, 7.0), (300.0, 24.0)] {
            let format = Format::new(Some(width_mm), Some(points), Some("STIX".to_owned()))
                .expect("a format");
            let mut pictures = study_figures(&study, &results, &[], &format).pictures;
            pictures.extend(contact_figures(
                &settings,
                &simulation.history,
                &[1e-3, 2e-3],
                &[],
                &[],
                &format,
            ));
            assert!(pictures.len() > 10);
            for Picture { name, canvas } in pictures {
                let svg = canvas.svg();
                let after = |text: &str| {
                    svg.split_once(text)
                        .map(|(_, rest)| rest)
                        .expect("an attribute")
                };
                let number = |text: &str| {
                    text.split(['"', ' ', 'm'])
                        .next()
                        .and_then(|number| number.parse::<f64>().ok())
                };
                assert_eq!(number(after("<svg width=\"")), Some(width_mm), "{name}");
                let of_view_box = number(after("viewBox=\"0 0 ")).expect("a width");
                // A part in a thousand, as the layout has whole pixels.
                for size in svg
                    .split("sans-serif\" font-size=\"")
                    .skip(1)
                    .filter_map(number)
                {
                    let in_points = size / of_view_box * width_mm * 72.27 / 25.4;
                    assert!(
                        (in_points / points - 1.0).abs() < 2e-3,
                        "{name}: {in_points} pt"
                    );
                }
                assert!(svg.contains("font-family=\"'STIX', Helvetica"));
            }
        }
        let format = Format::new(Some(84.0), Some(8.0), None).expect("a format");
        let png = history_figure(&settings, &simulation.history, &format)
            .canvas
            .png();
        let [width, per_metre] =
            [16, 41].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")));
        assert!(
            width.abs_diff(1984) <= 1 && per_metre == 23_622,
            "{width} {per_metre}"
        );
    }

    #[test]
    fn what_is_left_out_is_said() {
        let velocities: Vec<String> = (1..=9)
            .map(|velocity| format!("{}.0", 10 * velocity))
            .collect();
        let sweeps = format!(
            "brushing_velocity_m_s = [{}]\npenetration_depth_m = [1e-3, 2e-3]",
            velocities.join(", ")
        );
        let (study, results) = study(&sweeps);
        let pictures = study_figures(&study, &results, &[], &Format::default());
        assert_eq!(pictures.pictures.len(), 15);
        let find = |name: &str| {
            let picture = pictures
                .pictures
                .iter()
                .find(|picture| picture.name == name);
            picture.expect(name).canvas.svg()
        };
        assert!(find("impulse_over_depth").contains("7 of 9 values of v<tspan"));
        assert!(!find("impulse_over_velocity").contains("values of"));
        let map = find("tool_force_map");
        assert!(map.contains("> ± 600: all values ± 5.7 %"));
        assert!(map.contains("µ = 0,") && map.contains("R = 180"));
    }

    #[test]
    fn only_pictures_of_studies_are_taken_for_them() {
        let is_own = [
            "impulse_map_segments_3",
            "measured_over_depth",
            "history",
            "impulse",
            "my_impulse_map",
        ]
        .map(is_of_study);
        assert_eq!(is_own, [true, true, false, false, false]);
    }

    #[test]
    fn histories_of_any_length_are_drawn() {
        let (study, _) = study("brushing_velocity_m_s = [10.0]");
        let settings = study.settings(0);
        let drawn = |history: &[Sample]| {
            history_figure(&settings, history, &Format::default())
                .canvas
                .svg()
        };
        for samples in [2, 3, 300] {
            let svg = drawn(
                &simulate_with_history(&settings, samples)
                    .expect("a pass")
                    .history,
            );
            assert!(!svg.contains("NaN") && svg.contains("> in N") && svg.contains("> in mm"));
        }
        assert!(drawn(&[]).contains("One contact"));
    }

    #[test]
    fn several_turns_are_drawn() {
        let (study, _) = study("brushing_velocity_m_s = [30.0]\n\"process.turns\" = [3]");
        let settings = study.settings(0);
        let simulation = simulate_with_history(&settings, 300).expect("a pass");
        let svg = history_figure(&settings, &simulation.history, &Format::default())
            .canvas
            .svg();
        assert!(!svg.contains(">entry<") && !svg.contains("NaN"));
        let turns = |impulses: &[f64]| {
            let turns = turns_figure(&settings, impulses, &Format::default())?;
            Some(turns.canvas.svg())
        };
        let three = turns(&simulation.turn_contact_normal_impulses_n_s);
        assert!(three.is_some_and(|svg| svg.contains("turn by turn")));
        assert_eq!(turns(&[1e-3]), None);
        assert!(turns(&[0.0, 0.0]).is_some_and(|svg| !svg.contains("NaN")));
    }
}
