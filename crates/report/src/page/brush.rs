//! `brush.html`: a brush as one self-contained page, with its sector in motion.

use bristle::brush::{BrushResult, BrushStatistics, Frame};
use bristle::equations;
use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Record};
use bristle::simulation::Pass;
use bristle_study::brush::Interaction;
use bristle_text::shown;
use serde::Serialize;
use serde_json::{Value, json};

use super::course::{Outline, SideView};
use super::packed::Packed;
use super::{LONGEST_NAME, STYLE, escape_html, escape_script, fill, place_on_page, rounded, settings, spread};
use crate::figures::{Brush, brush_figures};

const TEMPLATE: &str = include_str!("brush.html");
const SCRIPT: &str = concat!(include_str!("format.js"), include_str!("settings.js"), include_str!("brush.js"));

/// Largest number of coordinates in a page, so that it stays below 10 MB. Beyond it, points of the filaments are left out, then frames.
const MAX_COORDINATES: usize = 3_000_000;
/// Largest and least number of points of a filament.
const MAX_POINTS: usize = 26;
const MIN_POINTS: usize = 5;

/// The sector in motion.
#[derive(Serialize)]
struct Motion {
    /// Times in s.
    times: Vec<f64>,
    /// Angles of column 0 in rad.
    tool_angles: Vec<f64>,
    /// Number of filaments, and of points in each.
    filaments: usize,
    points: usize,
    /// Points from root to tip, filament by filament, frame by frame: along the surface, above it, and along the axis, in m. Empty
    /// along the axis if all filaments move in one plane.
    along: Packed,
    above: Packed,
    axial: Option<Packed>,
    /// By filament and frame, in N.
    contact_force: Packed,
    press_force: Packed,
}

impl Motion {
    /// The motion in `frames`; none if there are fewer than two, as nothing moves in them.
    fn new(frames: &[Frame], view: &SideView, is_planar: bool) -> Option<Self> {
        let nodes = frames.first().and_then(|frame| frame.nodes_m.first()).map_or(0, Vec::len);
        let filaments = frames.first().map_or(0, |frame| frame.nodes_m.len());
        if frames.len() < 2 || nodes == 0 {
            return None;
        }
        let dimensions = if is_planar { 2 } else { 3 };
        let of_points = dimensions * filaments * frames.len();
        let points = (MAX_COORDINATES / of_points).clamp(MIN_POINTS, MAX_POINTS).min(nodes);
        let shown = (MAX_COORDINATES / (dimensions * filaments * points)).clamp(2, frames.len());
        let frames: Vec<&Frame> = spread(frames.len(), shown).map(|index| &frames[index]).collect();
        let drawn: Vec<usize> = spread(nodes, points).collect();
        let coordinates = |coordinate: &dyn Fn([f64; 3]) -> f64| {
            let all = frames.iter().flat_map(|frame| &frame.nodes_m);
            let drawn = &drawn;
            let values = all.flat_map(|nodes| drawn.iter().map(|&node| coordinate(nodes[node].map(f64::from))));
            Packed::new(&values.collect::<Vec<f64>>())
        };
        let forces = |force: fn(&Frame) -> &Vec<f32>| {
            let forces = frames.iter().flat_map(|&frame| force(frame));
            Packed::new(&forces.map(|&force| f64::from(force)).collect::<Vec<f64>>())
        };
        Some(Self {
            times: frames.iter().map(|frame| rounded(frame.time_s)).collect(),
            tool_angles: frames.iter().map(|frame| frame.tool_angle_rad).collect(),
            filaments,
            points,
            along: coordinates(&|point| view.along(point)),
            above: coordinates(&|point| view.above(point)),
            axial: (!is_planar).then(|| coordinates(&|[_, _, z]| z)),
            contact_force: forces(|frame| &frame.contact_normal_force_n),
            press_force: forces(|frame| &frame.press_force_n),
        })
    }
}

/// The page of a brush. `name` is its name, such as that of its input file; `frames` are those of `result`, which `brush` was made from.
#[must_use]
pub fn brush_page(name: &str, brush: &Brush, result: &BrushResult) -> String {
    let name = &shown(name, LONGEST_NAME);
    let data = data(name, brush, result).to_string();
    // Texts of figures are escaped already.
    let figures: String =
        brush_figures(brush).iter().map(|picture| format!("<figure>{}</figure>\n", picture.canvas.svg())).collect();
    fill(
        TEMPLATE,
        &[
            ("title", &escape_html(&format!("{name}: brush"))),
            ("style", STYLE),
            ("figures", &figures),
            ("data", &escape_script(&data)),
            ("script", SCRIPT),
        ],
    )
}

fn data(name: &str, brush: &Brush, result: &BrushResult) -> Value {
    let view = SideView::new(&brush.settings);
    let pass = Pass::new(&brush.settings);
    let mut metrics: Vec<&Column<Metrics>> = Metrics::COLUMNS.iter().collect();
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
    let sector: Vec<Value> = Interaction::COLUMNS.iter().map(|column| entry(column, interaction)).collect();
    let BrushStatistics { steps, halved_steps, effort } = result.statistics;
    // One plane holds all filaments of a single row whose points have the same place along the axis.
    let mut places = result.frames.iter().flat_map(|frame| frame.nodes_m.iter().flatten()).map(|&[_, _, z]| z);
    let first = places.next();
    let is_planar = places.all(|z| Some(z) == first);
    json!({
        "name": name,
        "version": env!("CARGO_PKG_VERSION"),
        "equations": { "sha256": equations::FINGERPRINT, "maker": equations::MAKER },
        "settings": settings(&brush.settings, |_| false),
        "metrics": metrics,
        "sector": sector,
        "work": [
            ["steps", steps],
            ["steps repeated with half their length", halved_steps],
            ["Newton iterations", effort.newton_iterations],
        ],
        "counted": result.filaments.iter().map(|filament| filament.is_counted).collect::<Vec<bool>>(),
        "columns": result.columns,
        "rows": result.rows,
        "length": brush.settings.filament.length_m,
        "diameter": brush.settings.filament.diameter_m,
        "body_radius": brush.settings.tool.body_radius_m,
        "tool_radius": brush.settings.tool_radius_m(),
        "axis_height": view.axis_height,
        "feed": brush.settings.workpiece.feed_velocity_m_s,
        "outline": Outline::new(&pass, &brush.settings, &view),
        "motion": Motion::new(&result.frames, &view, is_planar),
    })
}

/// A number of a record with what the page says of it.
fn entry<R: Record>(column: &Column<R>, record: &R) -> Value {
    let &Column { key, symbol, unit, name, meaning, .. } = column;
    let value = rounded(column.get(record));
    json!({ "key": key, "symbol": symbol, "unit": unit, "name": name, "meaning": meaning, "value": value })
}
