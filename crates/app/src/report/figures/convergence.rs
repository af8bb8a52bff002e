//! The figure of a convergence.

use crate::insight::convergence::{Convergence, GOAL, Series, force};

use super::picture::{Picture, with_brush};
use crate::report::drawing::diagram::{PixelRectangle, draw_axes, left_of};
use crate::report::drawing::format::Format;
use crate::report::drawing::heading::Heading;
use crate::report::drawing::pens::{pen, reference_pen};
use crate::report::drawing::scale::{Axis, AxisScale, coordinate};
use crate::report::drawing::{Canvas, CanvasPoint, GREY, fine, text};

const NAME: &str = "converge";
/// Sizes in pixels: width of the figure, height of a diagram, its least height on paper, space
/// below it, and space to its right.
const WIDTH: i32 = 680;
const HEIGHT: i32 = 190;
const MIN_HEIGHT: i32 = 110;
const BOTTOM: i32 = 58;
const RIGHT: i32 = 24;
const TITLE: &str = "Error of the force over the precision of its computation";

/// Draws the figure of a convergence: a diagram for each setting, with the error of the tool force
/// in per cent over its values. The stated value has a marker of its own.
#[must_use]
pub fn convergence_figures(convergence: &Convergence, format: &Format) -> Vec<Picture> {
    let scales: Vec<[AxisScale; 2]> = convergence.series.iter().map(scales).collect();
    let left = scales
        .iter()
        .map(|[_, y]| left_of(format, y))
        .max()
        .unwrap_or(0);
    let width = format.width(WIDTH);
    let subtitle = "error of F_n,w, against the finest value or what it tends to; square: as stated; dashed: 1 %";
    let subtitle = with_brush(subtitle, &convergence.settings);
    let heading = Heading::new(format, TITLE, &subtitle, [left, width]);
    let (top, height) = (heading.height(), format.height(HEIGHT, WIDTH, MIN_HEIGHT));
    let count = convergence.series.len() as i32;
    let mut canvas = Canvas::on(format, (width, top + count * (height + BOTTOM)));
    heading.draw(&mut canvas);
    for (row, (series, scales)) in (0..).zip(convergence.series.iter().zip(&scales)) {
        let top = top + row * (height + BOTTOM);
        draw_series(
            &mut canvas,
            series,
            scales,
            [left, top, width - RIGHT, top + height],
        );
    }
    vec![Picture {
        name: NAME.to_owned(),
        canvas,
    }]
}

/// Returns `true` if [`convergence_figures`] can make a figure of this name.
#[must_use]
pub fn is_of_convergence(name: &str) -> bool {
    name == NAME
}

/// Returns the values with an error that can be shown, and these errors in per cent.
fn errors(series: &Series) -> Vec<(f64, f64)> {
    let all = (0..series.values.len())
        .filter_map(|index| Some((series.values[index], 100.0 * series.error(force(), index)?)));
    all.filter(|(_, error)| *error > 0.0).collect()
}

fn scales(series: &Series) -> [AxisScale; 2] {
    let errors = errors(series);
    let [x, y] = [
        Axis::logarithmic(series.setting().label()),
        Axis::logarithmic("error in %"),
    ];
    let goal = coordinate(&y, 100.0 * GOAL);
    let levels: Vec<f64> = errors
        .iter()
        .filter_map(|(_, error)| coordinate(&y, *error))
        .chain(goal)
        .collect();
    let values: Vec<f64> = series
        .values
        .iter()
        .filter_map(|value| coordinate(&x, *value))
        .collect();
    [
        AxisScale::new(x, values.into_iter()),
        AxisScale::new(y, levels.into_iter()),
    ]
}

fn draw_series(
    canvas: &mut Canvas,
    series: &Series,
    [x, y]: &[AxisScale; 2],
    frame: PixelRectangle,
) {
    let [left, top, right, bottom] = frame;
    draw_axes(canvas, [x, y], frame);
    let place = |(value, error): (f64, f64)| -> Option<CanvasPoint> {
        let (across, up) = (coordinate(&x.axis, value)?, coordinate(&y.axis, error)?);
        Some((x.place(across, left, right), y.place(up, bottom, top)))
    };
    if let Some((_, level)) = place((series.stated, 100.0 * GOAL)) {
        reference_pen(1).line(canvas, &[(fine(left), level), (fine(right), level)]);
    }
    let errors = errors(series);
    let points: Vec<CanvasPoint> = errors.iter().filter_map(|&point| place(point)).collect();
    pen(0).line(canvas, &points);
    let (stated, others): (Vec<_>, Vec<_>) = errors
        .into_iter()
        .partition(|(value, _)| *value == series.stated);
    for (index, own) in [(0, others), (1, stated)] {
        let own: Vec<CanvasPoint> = own.into_iter().filter_map(place).collect();
        pen(index).markers(canvas, &own, false);
    }
    if let Some(order) = series.limit(force()).order {
        let at = (fine(left + 8), fine(bottom - 14));
        canvas.text(&format!("order {order:.1}"), text(12, GREY).right(), at);
    }
}
