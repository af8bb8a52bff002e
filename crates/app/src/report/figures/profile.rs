//! Figures of the work of a contact along the workpiece.

use super::panes::{posed_panes, upright_panes};
use super::picture::{Picture, contact_title, with_brush};
use super::worked::{Worked, ends, stretch, worked_edges};
use crate::report::drawing::clip::{clip_line, clip_polygon};
use crate::report::drawing::diagram::{PixelRectangle, draw_axes, left_of};
use crate::report::drawing::format::Format;
use crate::report::drawing::heading::Heading;
use crate::report::drawing::pens::pen;
use crate::report::drawing::scale::{Axis, AxisScale};
use crate::report::drawing::{
    BLUE, Canvas, CanvasPoint, Color, FAINT, GREY, INK, Pen, VERMILION, fine, stroke, text,
};
use crate::report::view::is_upright;
use bristle::model::settings::Settings;
use bristle::simulation::{ProfileCell, Shape};
use bristle::tool::places;
use bristle_study::text::number::{short, significant};

/// Names of the figures: the profile unrolled, and the filament on the workpiece.
pub(super) const PROFILE_UNROLLED: &str = "profile_unrolled";
pub(super) const PROFILE_DRAWN: &str = "profile_drawn";
/// Number of shapes of the filament that are drawn.
const DRAWN_SHAPES: usize = 13;
/// Width of the figures on a screen, and the space above and below panels, in pixels.
const WIDTH: i32 = 760;
const ABOVE: i32 = 10;
const BETWEEN: i32 = 30;
const BOTTOM: i32 = 50;
/// Height of a panel of the unrolled profile on a screen and at least; width of the column of
/// edges, and of its panel at least.
const PANEL: i32 = 180;
const MIN_PANEL: i32 = 150;
const EDGES: i32 = 276;
const MIN_EDGES: i32 = 100;
/// Height of the drawn contact on a screen, and the width of the part around edges.
const DRAWN: i32 = 380;
const AROUND: i32 = 330;
/// Margin beyond the ends of edges and worked cells, as a share of their length.
const MARGIN: f64 = 0.06;
/// Thickness of the drawn workpiece below its surface, and length of the longest bar of work, in
/// pixels.
const THICKNESS: f64 = 14.0;
const LONGEST_BAR: f64 = 46.0;

/// The material of a workpiece, and the background of edges.
const MATERIAL: Color = Color(222, 218, 208);
const EDGE: Color = Color(236, 238, 241);

/// Returns the shapes of a filament that figures show, from the time `from` (s) on. They are evenly
/// spread over the contact, with the last shape before and the first after it. Without a contact
/// they are spread over all times. `shapes` have loads.
#[must_use]
pub fn drawn_shapes(shapes: &[Shape], from: f64) -> Vec<Shape> {
    let shapes = &shapes[shapes.partition_point(|shape| shape.time_s < from)..];
    let touches = |shape: &Shape| shape.forces.iter().any(|force| force.normal > 0.0);
    let first = shapes
        .iter()
        .position(touches)
        .map_or(0, |first| first.saturating_sub(1));
    let last = shapes
        .iter()
        .rposition(touches)
        .map_or(shapes.len(), |last| (last + 2).min(shapes.len()));
    let shown = &shapes[first..last];
    crate::insight::slices::spread(shown.len(), DRAWN_SHAPES)
        .into_iter()
        .map(|index| shown[index].clone())
        .collect()
}

/// Returns a stretch with a margin at its ends.
fn widened([start, end]: [f64; 2], margin: f64) -> [f64; 2] {
    [start - margin * (end - start), end + margin * (end - start)]
}

/// A quantity of the cells, as a figure shows it.
struct CellQuantity {
    label: &'static str,
    color: Color,
    value: fn(&ProfileCell) -> f64,
}

const IMPULSE: CellQuantity = CellQuantity {
    label: "normal impulse in N s/m",
    color: BLUE,
    value: |cell| cell.normal_impulse_n_s_m,
};
const WORK: CellQuantity = CellQuantity {
    label: "friction work in mJ/mm",
    color: VERMILION,
    value: |cell| cell.friction_work_j_m,
};

/// Draws impulse and friction work per length over the arc length of the profile. A second column
/// shows edges on a larger scale. `None` without a contact.
pub(super) fn unrolled(
    settings: &Settings,
    profile: &[ProfileCell],
    format: &Format,
) -> Option<Picture> {
    let whole = stretch(profile)?;
    let edges = worked_edges(profile, whole);
    let has_work = profile.iter().any(|cell| cell.friction_work_j_m > 0.0);
    let rows: &[CellQuantity] = if has_work {
        &[IMPULSE, WORK]
    } else {
        &[IMPULSE]
    };
    let scales: Vec<AxisScale> = rows
        .iter()
        .map(|row| {
            AxisScale::new(
                Axis::from_zero(row.label),
                profile.iter().map(|cell| (row.value)(cell)),
            )
        })
        .collect();
    let left = scales
        .iter()
        .map(|scale| left_of(format, scale))
        .max()
        .unwrap_or(0);
    let page = format.width(WIDTH);
    let panel = format.height(PANEL, WIDTH, MIN_PANEL);
    let beside = if edges.is_some() {
        (EDGES * page / WIDTH).max(left + MIN_EDGES)
    } else {
        0
    };
    let split = page - 24 - beside;
    let mut columns = vec![(widened(whole, MARGIN), [left, split], "arc length in mm")];
    if let Some(edges) = edges {
        columns.push((
            widened(edges, 0.5),
            [split + left, page - 24],
            "at the edge, in mm",
        ));
    }
    let mut subtitle = "per length of the profile, for one filament in one pass".to_owned();
    if edges.is_some() {
        subtitle.push_str("; shaded: edges");
    }
    let heading = Heading::new(
        format,
        &contact_title("Work along the profile", settings),
        &with_brush(&subtitle, settings),
        [left, page],
    );
    let first = heading.height() + ABOVE;
    let height = first + rows.len() as i32 * (panel + BETWEEN) - BETWEEN + BOTTOM;
    let mut canvas = Canvas::on(format, (page, height));
    heading.draw(&mut canvas);
    for (row, (quantity, y)) in (0..).zip(rows.iter().zip(&scales)) {
        let top = first + row * (panel + BETWEEN);
        for (column, &(shown, [left, right], label)) in columns.iter().enumerate() {
            let frame = [left, top, right, top + panel];
            let mut x = AxisScale::exact(
                Axis::linear(label),
                shown.into_iter().map(|length| 1e3 * length),
            );
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
            let mut outline: Vec<CanvasPoint> = Vec::new();
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
    Some(Picture {
        name: PROFILE_UNROLLED.to_owned(),
        canvas,
    })
}

/// A part of the plane of rotation on the canvas, in true scale.
struct PlaneView {
    frame: PixelRectangle,
    /// The point in the middle in m.
    middle: [f64; 2],
    /// Pixels per m.
    scale: f64,
}

impl PlaneView {
    /// Fits the box between two opposite corners (m) into a frame.
    fn new(frame: PixelRectangle, [low, high]: [[f64; 2]; 2]) -> Self {
        let [left, top, right, bottom] = frame;
        let (wide, tall) = (f64::from(right - left), f64::from(bottom - top));
        let scale = (wide / (high[0] - low[0])).min(tall / (high[1] - low[1]));
        Self {
            frame,
            middle: [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0],
            scale,
        }
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, top, right, bottom] = self.frame.map(f64::from);
        [
            (left + right) / 2.0 + self.scale * (x - self.middle[0]),
            (top + bottom) / 2.0 - self.scale * (y - self.middle[1]),
        ]
    }

    fn places(&self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        points.iter().map(|&point| self.place(point)).collect()
    }

    fn line(&self, canvas: &mut Canvas, points: &[[f64; 2]], pen: Pen) {
        for part in clip_line(&self.places(points), self.frame) {
            pen.line(canvas, &part);
        }
    }

    fn polygon(&self, canvas: &mut Canvas, points: &[[f64; 2]], color: Color, opacity: f64) {
        let clipped = clip_polygon(&self.places(points), self.frame);
        if clipped.len() > 2 {
            canvas.area(clipped, color, opacity);
        }
    }
}

/// Returns the pen of a line without dashes.
fn solid(color: Color, tenths: i32) -> Pen {
    Pen {
        color,
        tenths,
        dash: (1, 0),
        ..pen(0)
    }
}

/// Draws a bar of a round length, about a sixth of the frame's width, below the frame.
fn scale_bar(canvas: &mut Canvas, view: &PlaneView) {
    let [_, _, right, bottom] = view.frame;
    let longest = 1e3 * f64::from(view.frame[2] - view.frame[0]) / 4.0 / view.scale;
    let power = 10_f64.powf(longest.log10().floor());
    let length = [5.0, 2.0, 1.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|length| *length <= longest)
        .unwrap_or(power);
    let (end, level) = (fine(right), fine(bottom + 22));
    let start = end - (length * view.scale / 1e3 * f64::from(fine(1))).round() as i32;
    let up = level - fine(4);
    canvas.line(
        [(start, up), (start, level), (end, level), (end, up)],
        stroke(INK, 10),
    );
    canvas.text(
        &format!("{} mm", short(length)),
        text(11, INK).left(),
        (start - fine(6), level),
    );
}

/// Returns the quadrilateral between the ends of a stretch of the outline and the same points moved
/// outwards by `length` (m).
fn raised([[x, y], [x_end, y_end]]: [[f64; 2]; 2], length: f64) -> [[f64; 2]; 4] {
    let factor = length / (x_end - x).hypot(y_end - y);
    let (u, v) = (-factor * (y_end - y), factor * (x_end - x));
    [
        [x, y],
        [x_end, y_end],
        [x_end + u, y_end + v],
        [x + u, y + v],
    ]
}

/// Draws the filament at some times on the profile in true scale, with the work as bars across the
/// surface. Another panel shows edges on a larger scale. Tools that are not upright radial ones are
/// shown along their axis and from the side.
pub(super) fn drawn(
    settings: &Settings,
    profile: &[ProfileCell],
    shapes: &[Shape],
    format: &Format,
) -> Option<Picture> {
    let worked = Worked::of(profile)?;
    let is_upright = is_upright(settings);
    let panes = if is_upright {
        upright_panes
    } else {
        posed_panes
    }(settings, profile, &worked, shapes)?;
    let quantity = if profile.iter().any(|cell| cell.friction_work_j_m > 0.0) {
        &WORK
    } else {
        &IMPULSE
    };
    let largest = profile.iter().map(quantity.value).fold(0.0, f64::max);
    let name = quantity.label.split(" in ").next().unwrap_or_default();
    let unit = quantity.label.split(" in ").nth(1).unwrap_or_default();
    let mut bars = format!(
        "bars: {name} per length, at most {} {unit}; the filament from light to dark",
        significant(largest)
    );
    if !is_upright {
        bars.push_str("; dashed: undeformed trim");
    }
    if places(settings).len() > 1 {
        bars.push_str("; the filament is that in the middle of the trim, the work that of all");
    }
    let page = format.width(WIDTH);
    let heading = Heading::new(
        format,
        &contact_title("Filament on the workpiece", settings),
        &with_brush(&bars, settings),
        [24, page],
    );
    let top = heading.height() + ABOVE;
    let bottom = top + format.height(DRAWN, WIDTH, 0);
    let frames: Vec<PixelRectangle> = if is_upright {
        let split = if panes.len() > 1 {
            page - 24 - AROUND * page / WIDTH
        } else {
            page
        };
        vec![
            [24, top, split - 24, bottom],
            [split, top, page - 24, bottom],
        ]
    } else {
        let count = panes.len() as i32;
        let place = |k: i32| 24 + (page - 24) * k / count;
        (0..count)
            .map(|k| [place(k), top, place(k + 1) - 24, bottom])
            .collect()
    };
    let mut canvas = Canvas::on(format, (page, bottom + 40));
    heading.draw(&mut canvas);
    for (pane, &frame) in panes.iter().zip(&frames) {
        let view = PlaneView::new(frame, pane.corners);
        if pane.is_filled {
            view.polygon(&mut canvas, &pane.surface, MATERIAL, 1.0);
        } else {
            for ends in pane.surface.windows(2) {
                view.polygon(
                    &mut canvas,
                    &raised([ends[0], ends[1]], -THICKNESS / view.scale),
                    MATERIAL,
                    1.0,
                );
            }
        }
        for (worked, cell) in profile.iter().zip(&pane.cells) {
            let length = LONGEST_BAR * (quantity.value)(worked) / largest / view.scale;
            if let Some(ends) = cell
                && length * view.scale > 0.05
            {
                view.polygon(&mut canvas, &raised(*ends, length), quantity.color, 0.55);
            }
        }
        for body in &pane.body {
            view.line(&mut canvas, body, solid(FAINT, 14));
        }
        for trim in &pane.trim {
            view.line(
                &mut canvas,
                trim,
                Pen {
                    dash: (5, 4),
                    ..solid(GREY, 8)
                },
            );
        }
        for (index, filament) in pane.filaments.iter().enumerate() {
            // From light to dark as time passes.
            let shade = |light: u8, dark: u8| {
                let part = (index + 1) as f64 / pane.filaments.len() as f64;
                (f64::from(light) + part * (f64::from(dark) - f64::from(light))).round() as u8
            };
            let color = Color(shade(190, 40), shade(200, 44), shade(212, 52));
            view.line(&mut canvas, filament, solid(color, 12));
        }
        view.line(&mut canvas, &pane.surface, solid(INK, 14));
        scale_bar(&mut canvas, &view);
    }
    for (pane, &[left, top, right, bottom]) in panes
        .iter()
        .zip(&frames)
        .filter(|(pane, _)| !pane.name.is_empty())
    {
        canvas.frame(
            [(fine(left), fine(top)), (fine(right), fine(bottom))],
            stroke(FAINT, 8),
        );
        canvas.text(
            pane.name,
            text(11, GREY).right(),
            (fine(left + 6), fine(top + 12)),
        );
    }
    Some(Picture {
        name: PROFILE_DRAWN.to_owned(),
        canvas,
    })
}
