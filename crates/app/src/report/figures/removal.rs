//! Figures of an edge that a brush rounds over time.

use std::f64::consts::PI;

use bristle::model::settings::Settings;
use bristle_study::grid::removal::{Removal, RemovalRow};
use bristle_study::text::number::significant;

use super::picture::{Picture, TOOL_RADIUS, brush_line, of_process};
use crate::report::drawing::clip::clip_line;
use crate::report::drawing::diagram::{Curve, Diagram, Look, PixelRectangle, draw_axes, left_of};
use crate::report::drawing::format::Format;
use crate::report::drawing::heading::Heading;
use crate::report::drawing::pens::pen;
use crate::report::drawing::scale::{Axis, AxisScale};
use crate::report::drawing::{Canvas, INK, fine, text};

const RADIUS: &str = "edge_radius";
const FORCE: &str = "worn_force";
const LENGTH: &str = "worn_length";
const SHAPE: &str = "edge_shape";
const WORK: &str = "edge_work";

/// Times at which the edge is drawn.
const TIMES: usize = 5;
/// Points of its arc.
const ARC: usize = 60;
/// Width, height of the diagram, and space around it, in pixels.
const WIDTH: i32 = 680;
const HEIGHT: i32 = 340;
const BOTTOM: i32 = 50;
const RIGHT: i32 = 110;
const MIN_HEIGHT: i32 = 170;
/// Length of the drawn faces beyond the roundest arc, over its tangent length.
const FACES: f64 = 1.6;

/// Returns a readable unit of time for `seconds` (s), and its length in s.
#[must_use]
pub fn unit_of_time(seconds: f64) -> (&'static str, f64) {
    match seconds {
        _ if seconds >= 3.0 * 86_400.0 => ("d", 86_400.0),
        _ if seconds >= 3.0 * 3600.0 => ("h", 3600.0),
        _ if seconds >= 180.0 => ("min", 60.0),
        _ => ("s", 1.0),
    }
}

/// Draws the figures of a removal: the radius over time, with the simulated radii; the work on the
/// edge over its radius; the edge at five times; and, if filaments wear, force and length over
/// time.
#[must_use]
pub fn removal_figures(settings: &Settings, removal: &Removal, format: &Format) -> Vec<Picture> {
    let last = removal.rows.last().map_or(0.0, |row| row.time_s);
    let (unit, second) = unit_of_time(last);
    let over_time = |name: &str, title: &str, y: Axis, curves: Vec<Curve>| {
        let x = Axis::from_zero(format!("time in {unit}"));
        let diagram = Diagram::new(title, subtitle(settings, removal), [x, y], curves);
        Picture::of(name, format, &diagram)
    };
    let of = |value: &dyn Fn(&RemovalRow) -> f64| -> Vec<(f64, f64)> {
        removal
            .rows
            .iter()
            .map(|row| (row.time_s / second, value(row)))
            .collect()
    };
    let is_chamfer = removal.angles_rad.len() > 1;
    let name = if is_chamfer {
        "edge that filaments meet first"
    } else {
        ""
    };
    let mut radius = vec![Curve::new(
        name,
        Look::Line,
        of(&|row| 1e3 * row.edge_radius_m),
    )];
    if is_chamfer {
        radius.push(Curve::new(
            "other edge",
            Look::Line,
            of(&|row| 1e3 * row.second_edge_radius_m),
        ));
    }
    if removal.has_band {
        let (upper, mut lower) = (
            of(&|row| 1e3 * row.edge_radius_upper_95_m),
            of(&|row| 1e3 * row.edge_radius_lower_95_m),
        );
        lower.reverse();
        radius.insert(
            0,
            Curve::new("95 % of the tools", Look::Band, [upper, lower].concat()),
        );
    }
    let simulated = removal.simulated.iter().filter_map(|edge| {
        let after = removal
            .rows
            .iter()
            .find(|row| row.edge_radius_m >= edge.edge_radius_m * (1.0 - 1e-9))?;
        Some((after.time_s / second, 1e3 * after.edge_radius_m))
    });
    let mut simulated: Vec<(f64, f64)> = simulated.collect();
    simulated.dedup();
    radius.push(Curve::new("simulated radii", Look::Markers, simulated).with_pen(1));
    let new = removal
        .simulated
        .iter()
        .filter(|edge| edge.filament_length_loss_m == 0.0);
    let work = new.map(|edge| (1e3 * edge.edge_radius_m, 1e3 * edge.edge_sliding_work_j));
    let of_work = [
        Axis::logarithmic("radius R of the edge in mm"),
        Axis::from_zero("sliding work W_e on the edge in mJ"),
    ];
    let curves = vec![Curve::new("", Look::Joined, work)];
    let conditions = "new filaments, one pass of one of them";
    let work = Diagram::new(
        "Work on the edge over its radius",
        conditions,
        of_work,
        curves,
    );
    let mut pictures = vec![
        over_time(
            RADIUS,
            "Radius of the edge over time",
            Axis::from_zero("radius R of the edge in mm"),
            radius,
        ),
        shape(settings, removal, format),
        Picture::of(WORK, format, &work),
    ];
    if settings.removal_or_default().filament_wear_m2_n.is_some() {
        let line = |value: &dyn Fn(&RemovalRow) -> f64| vec![Curve::new("", Look::Line, of(value))];
        let y = Axis::amount("contact normal force F_n,w in N");
        let force = line(&|row| row.tool_contact_normal_force_n);
        pictures.push(over_time(FORCE, "Force as the filaments wear", y, force));
        let y = Axis::amount("length l_f of the filaments in mm");
        let length = line(&|row| 1e3 * row.filament_length_m);
        pictures.push(over_time(LENGTH, "Length of the filaments", y, length));
    }
    pictures
}

/// Returns `true` if [`removal_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_removal(name: &str) -> bool {
    [RADIUS, FORCE, LENGTH, SHAPE, WORK].contains(&name)
}

fn subtitle(settings: &Settings, removal: &Removal) -> String {
    // R is the radius of the edge here, and filaments that wear have no one length.
    let wears = removal
        .rows
        .last()
        .is_some_and(|row| row.filament_length_m != settings.filament.length_m);
    let brush = brush_line(std::slice::from_ref(settings), |path| {
        path == TOOL_RADIUS || wears && path == "filament.length_m"
    });
    format!(
        "{}, k_P = {} m²/N\n{brush}",
        of_process(settings),
        significant(removal.preston_m2_n),
    )
}

/// Returns the outline in m of a rounded corner, up to `reach` (m) along its faces. It has the
/// included angle `angle` (rad) and the radius `radius` (m). Its bisector points upwards; the sharp
/// corner is at the origin.
#[must_use]
pub fn corner_outline(angle: f64, radius: f64, reach: f64) -> Vec<[f64; 2]> {
    let half = angle / 2.0;
    let tangent = radius / half.tan();
    let centre = -radius / half.sin();
    let along = |distance: f64, side: f64| [side * distance * half.sin(), -distance * half.cos()];
    let turn = (PI - angle) / 2.0;
    let arc = (0..=ARC).map(|i| {
        let at = turn * (2.0 * i as f64 / ARC as f64 - 1.0);
        [radius * at.sin(), centre + radius * at.cos()]
    });
    [along(reach.max(tangent), -1.0)]
        .into_iter()
        .chain(arc)
        .chain([along(reach.max(tangent), 1.0)])
        .collect()
}

/// Draws the edge at some times, to scale.
fn shape(settings: &Settings, removal: &Removal, format: &Format) -> Picture {
    let angle = removal.angles_rad[0];
    let rows: Vec<&RemovalRow> = (0..TIMES)
        .map(|i| &removal.rows[i * (removal.rows.len() - 1) / (TIMES - 1)])
        .collect();
    let largest = rows.last().map_or(0.0, |row| row.edge_radius_m);
    let reach = FACES * largest / (angle / 2.0).tan();
    let width = format.width(WIDTH);
    let diagram = format.height(HEIGHT, WIDTH, MIN_HEIGHT);
    let depth = reach * (angle / 2.0).cos();
    let label = Axis::linear("height in mm");
    let y = AxisScale::exact(label, [-1.05e3 * depth, 0.05e3 * depth].into_iter());
    let left = left_of(format, &y);
    let heading = Heading::new(
        format,
        "The edge at five times",
        &subtitle(settings, removal),
        [left, width - left],
    );
    let (top, right) = (heading.height(), width - RIGHT);
    // One millimetre is as long both ways.
    let half = 1.1e3 * depth * f64::from(right - left) / f64::from(diagram) / 2.0;
    let x = AxisScale::exact(
        Axis::linear("across the bisector in mm"),
        [-half, half].into_iter(),
    );
    let mut canvas = Canvas::on(format, (width, top + diagram + BOTTOM));
    heading.draw(&mut canvas);
    let frame: PixelRectangle = [left, top, right, top + diagram];
    draw_axes(&mut canvas, [&x, &y], frame);
    let far = half.max(1e3 * reach) / 1e3 / (angle / 2.0).sin();
    let (unit, second) = unit_of_time(rows.last().map_or(0.0, |row| row.time_s));
    for (i, row) in rows.iter().enumerate() {
        let place = |[across, up]: [f64; 2]| {
            let place = |scale: &AxisScale, at: f64, low: i32, high: i32| {
                f64::from(low) + scale.part(at) * f64::from(high - low)
            };
            [
                place(&x, 1e3 * across, left, right),
                place(&y, 1e3 * up, top + diagram, top),
            ]
        };
        let points: Vec<[f64; 2]> = corner_outline(angle, row.edge_radius_m, far)
            .into_iter()
            .map(place)
            .collect();
        let pen = pen(i);
        for piece in clip_line(&points, frame) {
            pen.line(&mut canvas, &piece);
        }
        let name = format!("{} {unit}", significant(row.time_s / second));
        let at = (fine(right + 34), fine(top + 16 + 20 * i as i32));
        pen.line(
            &mut canvas,
            &[
                (fine(right + 8), at.1 - fine(4)),
                (fine(right + 28), at.1 - fine(4)),
            ],
        );
        canvas.text(&name, text(12, INK), (at.0, at.1 - fine(10)));
    }
    Picture {
        name: SHAPE.to_owned(),
        canvas,
    }
}
