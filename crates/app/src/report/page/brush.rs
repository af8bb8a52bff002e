//! `brush.html`: a brush as one self-contained page, with its sector in motion.

use std::collections::BTreeSet;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use bristle::brush::{BrushResult, BrushStatistics, Frame};
use bristle::equations;
use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Record};
use bristle::simulation::Pass;
use bristle_study::grid::Interaction;
use bristle_study::grid::brush::{Having, metric_columns};
use bristle_study::text::shown;
use serde::Serialize;
use serde_json::{Value, json};

use super::course::outline;
use super::packed::{Packed, rounded};
use super::{LONGEST_NAME, Notes, Page, fill, place_on_page, settings};
use crate::insight::slices::spread;
use crate::report::drawing::format::Format;
use crate::report::figures::{Brush, Picture, brush_figures};
use crate::report::view::View;
use crate::store::method::method_of_case;

const SECTIONS: &str = include_str!("brush.html");
const SCRIPT: &str = concat!(
    include_str!("format.js"),
    include_str!("settings.js"),
    include_str!("player.js"),
    include_str!("brush.js")
);

/// Maximum number of coordinates in a page, which keeps it below 10 MB. A larger brush leaves out
/// points of the filaments, then frames.
const MAX_COORDINATES: usize = 3_000_000;
/// Largest and least number of points of a filament.
const MAX_POINTS: usize = 26;
const MIN_POINTS: usize = 5;

/// The sector in motion.
#[derive(Serialize)]
struct Frames {
    /// Times in s.
    times: Vec<f64>,
    /// Angles of column 0 in rad.
    tool_angles: Vec<f64>,
    /// Numbers of the drawn filaments, and the number of points in each.
    filaments: Vec<usize>,
    points: usize,
    /// Coordinates of the points from root to tip, filament by filament, frame by frame: along the
    /// surface, above it, and along the axis, in m. The last ones are left out if every filament
    /// stays in its plane of rotation.
    along: Packed,
    above: Packed,
    axial: Option<Packed>,
    /// Forces by filament and frame, in N.
    contact_force: Packed,
    press_force: Packed,
}

impl Frames {
    /// Packs the motion in `frames`; `None` if there are fewer than two, as nothing moves in them.
    fn new(frames: &[Frame], view: &View) -> Option<Self> {
        let nodes = frames
            .first()
            .and_then(|frame| frame.nodes_m.first())
            .map_or(0, Vec::len);
        if frames.len() < 2 || nodes == 0 {
            return None;
        }
        let all = frames[0].nodes_m.len();
        let is_planar = (0..all).all(|filament| stays_in_its_plane(frames, filament));
        let filaments = if is_planar {
            different(frames)
        } else {
            (0..all).collect()
        };
        let dimensions = if is_planar { 2 } else { 3 };
        let of_points = dimensions * filaments.len() * frames.len();
        let points = (MAX_COORDINATES / of_points)
            .clamp(MIN_POINTS, MAX_POINTS)
            .min(nodes);
        let shown =
            (MAX_COORDINATES / (dimensions * filaments.len() * points)).clamp(2, frames.len());
        let frames = spread(frames.len(), shown)
            .into_iter()
            .map(|index| &frames[index]);
        let frames: Vec<&Frame> = frames.collect();
        let drawn = spread(nodes, points);
        let coordinates = |coordinate: &dyn Fn([f64; 3]) -> f64| {
            let shapes = frames
                .iter()
                .flat_map(|frame| filaments.iter().map(|&own| &frame.nodes_m[own]));
            let of_shape = |nodes: &Vec<[f32; 3]>| {
                drawn
                    .iter()
                    .map(|&node| coordinate(nodes[node].map(f64::from)))
                    .collect::<Vec<_>>()
            };
            Packed::new(shapes.flat_map(of_shape))
        };
        let forces = |force: fn(&Frame) -> &Vec<f32>| {
            let of_frame = |frame: &&Frame| {
                filaments
                    .iter()
                    .map(|&own| f64::from(force(frame)[own]))
                    .collect::<Vec<_>>()
            };
            Packed::new(frames.iter().flat_map(of_frame))
        };
        Some(Self {
            along: coordinates(&|point| view.place(point)[0]),
            above: coordinates(&|point| view.place(point)[1]),
            axial: (!is_planar).then(|| coordinates(&|[_, _, z]| z)),
            contact_force: forces(|frame| &frame.contact_normal_force_n),
            press_force: forces(|frame| &frame.press_force_n),
            times: frames.iter().map(|frame| rounded(frame.time_s)).collect(),
            tool_angles: frames.iter().map(|frame| frame.tool_angle_rad).collect(),
            filaments,
            points,
        })
    }
}

/// Returns `true` if a filament stays in one plane of rotation.
fn stays_in_its_plane(frames: &[Frame], filament: usize) -> bool {
    let mut places = frames
        .iter()
        .flat_map(|frame| &frame.nodes_m[filament])
        .map(|&[_, _, z]| z);
    let first = places.next();
    places.all(|z| Some(z) == first)
}

/// Returns the filaments without those that move like an earlier one, each in its own plane of
/// rotation. The view along the axis shows only one of them.
fn different(frames: &[Frame]) -> Vec<usize> {
    let mut seen = BTreeSet::new();
    let motion = |filament: usize| -> Vec<[u32; 2]> {
        let nodes = frames.iter().flat_map(|frame| &frame.nodes_m[filament]);
        nodes.map(|&[x, y, _]| [x, y].map(f32::to_bits)).collect()
    };
    (0..frames[0].nodes_m.len())
        .filter(|&filament| seen.insert(motion(filament)))
        .collect()
}

/// Returns the page of a brush. `name` is its name, such as that of its input file; `brush` was
/// made from `result`.
#[must_use]
pub fn brush_page(name: &str, brush: &Brush, result: &BrushResult, notes: Notes<'_>) -> String {
    let name = &shown(name, LONGEST_NAME);
    let figures = drawings(&brush_figures(brush, &Format::default()));
    let page = Page {
        title: &format!("{name}: brush"),
        subject: "filaments of a brush that touch each other and a workpiece",
        without_scripts: "This page draws the sector with JavaScript, which is switched off. Its numbers are in \
                          <code>metrics.json</code> and <code>filaments.csv</code> in the same directory.",
        sections: &fill(SECTIONS, &[("figures", &figures)]),
        notes,
        method: &method_of_case(&brush.settings),
        data: data(name, brush, result),
        script: SCRIPT,
    };
    page.framed()
}

/// Returns figures as images, to which the style of the page does not apply.
pub(super) fn drawings(pictures: &[Picture]) -> String {
    let figure = |Picture { name, canvas }: &Picture| {
        let image = STANDARD.encode(canvas.svg());
        let name = name.replace('_', " ");
        format!("<figure><img alt=\"{name}\" src=\"data:image/svg+xml;base64,{image}\"></figure>\n")
    };
    pictures.iter().map(figure).collect()
}

fn data(name: &str, brush: &Brush, result: &BrushResult) -> Value {
    let view = View::along_axis(&brush.settings, &Pass::new(&brush.settings));
    let mut metrics: Vec<&Column<Metrics>> = metric_columns(Having {
        force: false,
        ..Having::of(&brush.settings)
    })
    .collect();
    metrics.sort_by_key(|column| place_on_page(column));
    let metrics: Vec<Value> = metrics
        .into_iter()
        .map(|column| {
            let mut entry = entry(column, &result.tool);
            entry["alone"] = json!(rounded(column.get(&result.alone)));
            entry
        })
        .collect();
    let interaction = &brush.interaction;
    let sector: Vec<Value> = Interaction::COLUMNS
        .iter()
        .map(|column| entry(column, interaction))
        .collect();
    let BrushStatistics {
        steps,
        rejected_steps,
        newton_failures,
        effort,
    } = result.statistics;
    json!({
        "name": name,
        "version": env!("CARGO_PKG_VERSION"),
        "equations": { "sha256": equations::FINGERPRINT, "maker": equations::MAKER },
        "settings": settings(&brush.settings, |_| false),
        "metrics": metrics,
        "sector": sector,
        "work": [
            ["steps", steps],
            ["steps repeated because their error was too large", rejected_steps],
            ["steps repeated because Newton's method failed", newton_failures],
            ["Newton iterations", effort.newton_iterations],
        ],
        "counted": result.filaments.iter().map(|filament| filament.is_counted).collect::<Vec<bool>>(),
        "columns": result.columns,
        "rows": result.rows,
        "length": brush.settings.filament.length_m,
        "diameter": brush.settings.filament.diameter_m,
        "body_radius": brush.settings.tool.body_radius_m,
        "tool_radius": brush.settings.tool_radius_m(),
        "axis_height": view.place([0.0; 3])[1],
        "feed": brush.settings.workpiece.feed_velocity_m_s,
        "outline": outline(&view),
        "motion": Frames::new(&result.frames, &view),
    })
}

/// Returns a number of a record with its description on the page.
fn entry<R: Record>(column: &Column<R>, record: &R) -> Value {
    let &Column {
        key,
        symbol,
        unit,
        name,
        meaning,
        ..
    } = column;
    let value = rounded(column.get(record));
    json!({ "key": key, "symbol": symbol, "unit": unit, "name": name, "meaning": meaning, "value": value })
}
