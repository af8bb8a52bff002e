//! Figures of where on the workpiece the work of a contact is done.

use super::{PROFILE_DRAWN, PROFILE_UNROLLED, Picture, contact_title};
use crate::drawing::clip::{clip_line, clip_polygon};
use crate::drawing::diagram::{Frame, draw_axes, left_of};
use crate::drawing::format::Format;
use crate::drawing::heading::Heading;
use crate::drawing::scale::{Axis, Scale};
use crate::drawing::{BLUE, Canvas, Color, FAINT, GREY, INK, Point, VERMILION, fine, stroke, text};
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, ProfileCell, Shape};
use bristle::workpiece::Workpiece;
use bristle_text::number::{short, significant};

/// Number of shapes of the filament that are drawn.
const DRAWN_SHAPES: usize = 13;
/// Width of the figures on a screen, and the space above and below panels, in pixels.
const WIDTH: i32 = 760;
const ABOVE: i32 = 10;
const BETWEEN: i32 = 30;
const BOTTOM: i32 = 50;
/// Height of a panel of the unrolled profile on a screen and at least; width of the column of edges, and of its panel at least.
const PANEL: i32 = 180;
const MIN_PANEL: i32 = 150;
const EDGES: i32 = 276;
const MIN_EDGES: i32 = 100;
/// Height of the drawn contact on a screen, and the width of the part around edges.
const DRAWN: i32 = 380;
const AROUND: i32 = 330;
/// How far edges and worked cells are shown beyond their ends, as a part of their length.
const MARGIN: f64 = 0.06;
/// How thick the workpiece is drawn below its surface, and how long the longest bar of work is, in pixels.
const THICKNESS: f64 = 14.0;
const LONGEST_BAR: f64 = 46.0;

/// How far the drawn outline may be off, in m.
const OUTLINE_ERROR: f64 = 1e-6;

/// The material of a workpiece, and the background of edges.
const MATERIAL: Color = Color(222, 218, 208);
const EDGE: Color = Color(236, 238, 241);

/// Some shapes of a filament from the time `from` (s) on, evenly spread over the time in which it touches, with the last before and
/// the first after it: those that figures show. Without a contact they are spread over all times. `shapes` have loads.
#[must_use]
pub fn drawn_shapes(shapes: &[Shape], from: f64) -> Vec<Shape> {
    let shapes = &shapes[shapes.partition_point(|shape| shape.time_s < from)..];
    let touches = |shape: &Shape| shape.forces.iter().any(|force| force.normal > 0.0);
    let first = shapes.iter().position(touches).map_or(0, |first| first.saturating_sub(1));
    let last = shapes.iter().rposition(touches).map_or(shapes.len(), |last| (last + 2).min(shapes.len()));
    let shown = &shapes[first..last];
    bristle_insight::slices::spread(shown.len(), DRAWN_SHAPES).into_iter().map(|index| shown[index].clone()).collect()
}

/// The stretch of arc lengths that figures show: the cells with work, and edges with work or next to it. None without work.
fn stretch(profile: &[ProfileCell]) -> Option<[f64; 2]> {
    let worked = hull(profile.iter().filter(|cell| cell.normal_impulse_n_s_m > 0.0))?;
    let near = (worked[1] - worked[0]) / 4.0;
    let edges = profile
        .iter()
        .filter(|cell| cell.on_edge && cell.arc_length_m > worked[0] - near && cell.arc_length_m < worked[1] + near);
    Some(hull(edges).map_or(worked, |edges| [worked[0].min(edges[0]), worked[1].max(edges[1])]))
}

/// The arc lengths from the start of the first cell to the end of the last.
fn hull<'a>(cells: impl Iterator<Item = &'a ProfileCell>) -> Option<[f64; 2]> {
    cells.map(ends).reduce(|[start, end], [from, to]| [start.min(from), end.max(to)])
}

/// The arc lengths at the ends of a cell.
fn ends(cell: &ProfileCell) -> [f64; 2] {
    [-0.5, 0.5].map(|part| cell.arc_length_m + part * cell.length_m)
}

/// A stretch with a margin at its ends.
fn widened([start, end]: [f64; 2], margin: f64) -> [f64; 2] {
    [start - margin * (end - start), end + margin * (end - start)]
}

/// The edges within a stretch that have work.
fn worked_edges(profile: &[ProfileCell], [start, end]: [f64; 2]) -> Option<[f64; 2]> {
    let within = |cell: &&ProfileCell| cell.on_edge && cell.arc_length_m >= start && cell.arc_length_m <= end;
    let edges = || profile.iter().filter(within);
    edges().any(|cell| cell.normal_impulse_n_s_m > 0.0).then(|| hull(edges())).flatten()
}

/// A quantity of the cells, as a figure shows it.
struct Quantity {
    label: &'static str,
    color: Color,
    value: fn(&ProfileCell) -> f64,
}

const IMPULSE: Quantity =
    Quantity { label: "normal impulse in N s/m", color: BLUE, value: |cell| cell.normal_impulse_n_s_m };
const WORK: Quantity =
    Quantity { label: "friction work in mJ/mm", color: VERMILION, value: |cell| cell.friction_work_j_m };

/// Impulse and friction work per length over the arc length of the profile; a second column shows edges on a larger scale. None if
/// the filament touches nothing.
pub(super) fn unrolled(settings: &Settings, profile: &[ProfileCell], format: &Format) -> Option<Picture> {
    let whole = stretch(profile)?;
    let edges = worked_edges(profile, whole);
    let has_work = profile.iter().any(|cell| cell.friction_work_j_m > 0.0);
    let rows: &[Quantity] = if has_work { &[IMPULSE, WORK] } else { &[IMPULSE] };
    let scales: Vec<Scale> = rows
        .iter()
        .map(|row| Scale::new(Axis::from_zero(row.label), profile.iter().map(|cell| (row.value)(cell))))
        .collect();
    let left = scales.iter().map(|scale| left_of(format, scale)).max().unwrap_or(0);
    let page = format.width(WIDTH);
    let panel = format.height(PANEL, WIDTH, MIN_PANEL);
    let beside = if edges.is_some() { (EDGES * page / WIDTH).max(left + MIN_EDGES) } else { 0 };
    let split = page - 24 - beside;
    let mut columns = vec![(widened(whole, MARGIN), [left, split], "arc length in mm")];
    if let Some(edges) = edges {
        columns.push((widened(edges, 0.5), [split + left, page - 24], "at the edge, in mm"));
    }
    let mut subtitle = "per length of the profile, for one filament in one pass".to_owned();
    if edges.is_some() {
        subtitle.push_str("; shaded: edges");
    }
    let heading = Heading::new(format, &contact_title("Work along the profile", settings), &subtitle, [left, page]);
    let first = heading.height() + ABOVE;
    let height = first + rows.len() as i32 * (panel + BETWEEN) - BETWEEN + BOTTOM;
    let mut canvas = Canvas::on(format, (page, height));
    heading.draw(&mut canvas);
    for (row, (quantity, y)) in (0..).zip(rows.iter().zip(&scales)) {
        let top = first + row * (panel + BETWEEN);
        for (column, &(shown, [left, right], label)) in columns.iter().enumerate() {
            let frame = [left, top, right, top + panel];
            let mut x = Scale::exact(Axis::linear(label), shown.into_iter().map(|length| 1e3 * length));
            if row + 1 < rows.len() as i32 {
                x.axis.label = "".into();
                x.ticks.iter_mut().for_each(|(_, label)| label.clear());
            }
            let mut y = y.clone();
            if column > 0 {
                y.axis.label = "".into();
            }
            let place = |length: f64| x.place(1e3 * length.clamp(shown[0], shown[1]), left, right);
            let within = |cell: &&ProfileCell| ends(cell)[1] > shown[0] && ends(cell)[0] < shown[1];
            let cells = || profile.iter().filter(within);
            for cell in cells().filter(|cell| cell.on_edge) {
                let [from, to] = ends(cell).map(place);
                canvas.rectangle([(from, fine(top)), (to, fine(top + panel))], EDGE);
            }
            draw_axes(&mut canvas, [&x, &y], frame);
            let level = |value: f64| y.place(value, top + panel, top);
            let mut outline: Vec<Point> = Vec::new();
            for cell in cells() {
                let at = level((quantity.value)(cell));
                outline.extend(ends(cell).map(|length| (place(length), at)));
            }
            outline.dedup();
            if let (Some(&(first, _)), Some(&(last, _))) = (outline.first(), outline.last()) {
                let base = level(0.0);
                let area = [vec![(first, base)], outline.clone(), vec![(last, base)]].concat();
                canvas.area(area, quantity.color, 0.2);
                canvas.line(outline, stroke(quantity.color, 14));
            }
        }
    }
    Some(Picture { name: PROFILE_UNROLLED.to_owned(), canvas })
}

/// A part of the plane of rotation on the canvas, in true scale.
struct View {
    frame: Frame,
    /// The point in the middle in m.
    middle: [f64; 2],
    /// Pixels per m.
    scale: f64,
}

impl View {
    /// The box between two opposite corners in m, as large as the frame allows.
    fn new(frame: Frame, [low, high]: [[f64; 2]; 2]) -> Self {
        let [left, top, right, bottom] = frame;
        let (wide, tall) = (f64::from(right - left), f64::from(bottom - top));
        let scale = (wide / (high[0] - low[0])).min(tall / (high[1] - low[1]));
        Self { frame, middle: [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0], scale }
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, top, right, bottom] = self.frame.map(f64::from);
        [
            (left + right) / 2.0 + self.scale * (x - self.middle[0]),
            (top + bottom) / 2.0 - self.scale * (y - self.middle[1]),
        ]
    }

    fn line(&self, canvas: &mut Canvas, points: &[[f64; 2]], color: Color, tenths: i32) {
        let points: Vec<[f64; 2]> = points.iter().map(|&point| self.place(point)).collect();
        for part in clip_line(&points, self.frame) {
            canvas.line(part, stroke(color, tenths));
        }
    }

    fn polygon(&self, canvas: &mut Canvas, points: &[[f64; 2]], color: Color, opacity: f64) {
        let points: Vec<[f64; 2]> = points.iter().map(|&point| self.place(point)).collect();
        let clipped = clip_polygon(&points, self.frame);
        if clipped.len() > 2 {
            canvas.area(clipped, color, opacity);
        }
    }
}

/// The box around points, with a margin that is a part of its larger side; none without points.
fn around(points: impl Iterator<Item = [f64; 2]>, margin: f64) -> Option<[[f64; 2]; 2]> {
    let boxes = points.map(|point| [point; 2]);
    let [low, high] = boxes.reduce(|[low, high], [point, _]| {
        [[0, 1].map(|k| f64::min(low[k], point[k])), [0, 1].map(|k| f64::max(high[k], point[k]))]
    })?;
    let margin = margin * (high[0] - low[0]).max(high[1] - low[1]);
    Some([low.map(|low| low - margin), high.map(|high| high + margin)])
}

/// Draws a bar of a round length, about a sixth of the frame's width, below the frame.
fn scale_bar(canvas: &mut Canvas, view: &View) {
    let [_, _, right, bottom] = view.frame;
    let longest = 1e3 * f64::from(view.frame[2] - view.frame[0]) / 4.0 / view.scale;
    let power = 10_f64.powf(longest.log10().floor());
    let length =
        [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|length| *length <= longest).unwrap_or(power);
    let (end, level) = (fine(right), fine(bottom + 22));
    let start = end - (length * view.scale / 1e3 * f64::from(fine(1))).round() as i32;
    let up = level - fine(4);
    canvas.line([(start, up), (start, level), (end, level), (end, up)], stroke(INK, 10));
    canvas.text(&format!("{} mm", short(length)), text(11, INK).left(), (start - fine(6), level));
}

/// The quadrilateral between the ends of a stretch of the outline and the same points moved outwards by `length` (m).
fn raised([[x, y], [x_end, y_end]]: [[f64; 2]; 2], length: f64) -> [[f64; 2]; 4] {
    let factor = length / (x_end - x).hypot(y_end - y);
    let (u, v) = (-factor * (y_end - y), factor * (x_end - x));
    [[x, y], [x_end, y_end], [x_end + u, y_end + v], [x + u, y + v]]
}

/// The filament at some times on the profile in true scale, with the work as bars across the surface; a second panel shows edges on a
/// larger scale.
pub(super) fn drawn(
    settings: &Settings,
    profile: &[ProfileCell],
    shapes: &[Shape],
    format: &Format,
) -> Option<Picture> {
    let whole = stretch(profile)?;
    let edges = worked_edges(profile, whole);
    let pass = Pass::new(settings);
    // As far as the picture may go.
    let outline = pass.workpiece().profile(1.5 * settings.tool_radius_m())?;
    let surface = outline.simplified(OUTLINE_ERROR);
    let cells = pass.profile()?.cells;
    let worked = profile.iter().filter(|cell| cell.arc_length_m > whole[0] && cell.arc_length_m < whole[1]);
    // As they are seen from the workpiece, which may move.
    let [x_rate, y_rate, _] = pass.workpiece().surface([0.0; 3], 0.0).velocity;
    let seen = |shape: &Shape| {
        let time = shape.time_s;
        shape.nodes_m.iter().map(|&[x, y, _]| [x - time * x_rate, y - time * y_rate]).collect::<Vec<_>>()
    };
    let filaments: Vec<Vec<[f64; 2]>> = shapes.iter().map(seen).collect();
    let nodes = filaments.iter().flatten().copied();
    let quantity = if profile.iter().any(|cell| cell.friction_work_j_m > 0.0) { &WORK } else { &IMPULSE };
    let largest = profile.iter().map(quantity.value).fold(0.0, f64::max);
    let name = quantity.label.split(" in ").next().unwrap_or_default();
    let unit = quantity.label.split(" in ").nth(1).unwrap_or_default();
    let bars =
        format!("bars: {name} per length, at most {} {unit}; the filament from light to dark", significant(largest));
    let page = format.width(WIDTH);
    let heading = Heading::new(format, &contact_title("Filament on the workpiece", settings), &bars, [24, page]);
    let top = heading.height() + ABOVE;
    let bottom = top + format.height(DRAWN, WIDTH, 0);
    let split = if edges.is_some() { page - 24 - AROUND * page / WIDTH } else { page };
    let frames = [[24, top, split - 24, bottom], [split, top, page - 24, bottom]];
    let mut views = vec![View::new(frames[0], around(worked.map(|cell| [cell.x_m, cell.y_m]).chain(nodes), 0.04)?)];
    if let Some([from, to]) = edges {
        let on_edges = profile.iter().filter(|cell| cell.on_edge && cell.arc_length_m > from && cell.arc_length_m < to);
        views.push(View::new(frames[1], around(on_edges.map(|cell| [cell.x_m, cell.y_m]), 0.8)?));
    }
    let mut canvas = Canvas::on(format, (page, bottom + 40));
    heading.draw(&mut canvas);
    for view in &views {
        if outline.is_solid() {
            view.polygon(&mut canvas, &surface, MATERIAL, 1.0);
        } else {
            for ends in surface.windows(2) {
                view.polygon(&mut canvas, &raised([ends[0], ends[1]], -THICKNESS / view.scale), MATERIAL, 1.0);
            }
        }
        for (worked, cell) in profile.iter().zip(&cells) {
            let length = LONGEST_BAR * (quantity.value)(worked) / largest / view.scale;
            if length * view.scale > 0.05 {
                view.polygon(&mut canvas, &raised(cell.ends, length), quantity.color, 0.55);
            }
        }
        let body = (0..=720).map(|k| {
            let (sin, cos) = (f64::from(k) / 2.0).to_radians().sin_cos();
            [cos, sin].map(|part| part * settings.tool.body_radius_m)
        });
        view.line(&mut canvas, &body.collect::<Vec<_>>(), FAINT, 14);
        for (index, filament) in filaments.iter().enumerate() {
            // From light to dark as time passes.
            let shade = |light: u8, dark: u8| {
                let part = (index + 1) as f64 / filaments.len() as f64;
                (f64::from(light) + part * (f64::from(dark) - f64::from(light))).round() as u8
            };
            let color = Color(shade(190, 40), shade(200, 44), shade(212, 52));
            view.line(&mut canvas, filament, color, 12);
        }
        view.line(&mut canvas, &surface, INK, 14);
        scale_bar(&mut canvas, view);
    }
    if let [_, view] = &views[..] {
        let [left, top, right, bottom] = view.frame;
        canvas.frame([(fine(left), fine(top)), (fine(right), fine(bottom))], stroke(FAINT, 8));
        canvas.text("at the edge", text(11, GREY).right(), (fine(left + 6), fine(top + 12)));
    }
    Some(Picture { name: PROFILE_DRAWN.to_owned(), canvas })
}
