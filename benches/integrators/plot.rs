//! The diagram of work and precision.

use bristle_report::drawing::{Canvas, Color, INK, Point, Stroke, WHITE, fine, text};

use crate::Row;

/// Size in pixels.
const SIZE: (i32, i32) = (1000, 440);
/// Left edges of the panels, their width, top and bottom.
const PANELS: [f64; 2] = [64.0, 418.0];
const WIDTH: f64 = 300.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 388.0;
const LEGEND: f64 = 746.0;
/// Ranges of the axes: work in ms, relative error.
const WORK: (f64, f64) = (0.8, 60.0);
const ERROR: (f64, f64) = (1e-8, 1.0);

const FAINT: Color = Color(222, 225, 229);

/// Colour (Okabe and Ito), width, dashes and marker. Each of the last three distinguishes the curves in grey.
struct Look {
    color: Color,
    width: f64,
    dashes: &'static [f64],
    marker: Marker,
}

#[derive(Clone, Copy)]
struct Marker {
    /// Corners around the middle; a circle has many.
    corners: usize,
    /// Position of the first corner, in turns from the top.
    turn: f64,
    filled: bool,
    /// Only spokes to the corners.
    star: bool,
}

const fn marker(corners: usize, turn: f64, filled: bool) -> Marker {
    Marker { corners, turn, filled, star: false }
}

const LOOKS: [Look; 8] = [
    Look { color: Color(86, 180, 233), width: 1.5, dashes: &[2.0, 3.0], marker: marker(3, 0.0, false) },
    Look { color: Color(120, 124, 130), width: 1.5, dashes: &[8.0, 3.0], marker: marker(4, 0.125, false) },
    Look { color: Color(0, 114, 178), width: 1.5, dashes: &[], marker: marker(4, 0.125, true) },
    Look { color: Color(213, 94, 0), width: 2.6, dashes: &[], marker: marker(24, 0.0, true) },
    Look { color: Color(0, 158, 115), width: 1.5, dashes: &[5.0, 2.0, 1.0, 2.0], marker: marker(4, 0.0, false) },
    Look { color: Color(204, 121, 167), width: 1.5, dashes: &[4.0, 4.0], marker: marker(3, 0.5, true) },
    Look { color: Color(180, 140, 0), width: 1.5, dashes: &[1.5, 1.5], marker: marker(24, 0.0, false) },
    Look {
        color: INK,
        width: 1.2,
        dashes: &[10.0, 2.0, 2.0, 2.0],
        marker: Marker { corners: 4, turn: 0.125, filled: false, star: true },
    },
];

/// Pixels in coordinates of the canvas.
fn at(x: f64, y: f64) -> Point {
    let coordinate = |pixels: f64| (pixels * f64::from(fine(1))).round() as i32;
    (coordinate(x), coordinate(y))
}

/// A line of a width in pixels.
fn stroke(color: Color, width: f64) -> Stroke {
    Stroke { color, width: at(width, 0.0).0 }
}

/// Position of `value` in `range` on a logarithmic scale, from 0 to 1.
fn share(value: f64, (low, high): (f64, f64)) -> f64 {
    (value / low).ln() / (high / low).ln()
}

/// The diagram as SVG.
pub fn draw(rows: &[Row]) -> String {
    let mut canvas = Canvas::new(SIZE);
    let median: fn(&Row) -> f64 = |row| row.median;
    let worst: fn(&Row) -> f64 = |row| row.worst;
    for (left, (which, error)) in PANELS.into_iter().zip([("median", median), ("worst", worst)]) {
        frame(&mut canvas, left, &format!("Error of the impulse, {which} of the contacts"));
        for (label, look) in labels(rows).into_iter().zip(&LOOKS) {
            let points: Vec<(f64, f64)> = rows
                .iter()
                .filter(|row| row.label == Some(label))
                .map(|row| (share(row.work * 1e-3, WORK), share(error(row), ERROR)))
                .filter(|(x, y)| (0.0..=1.0).contains(x) && (0.0..=1.0).contains(y))
                .map(|(x, y)| (left + x * WIDTH, BOTTOM - y * (BOTTOM - TOP)))
                .collect();
            curve(&mut canvas, &points, look);
        }
    }
    canvas.text("relative error", text(12, INK).centred().upwards(), at(12.0, (TOP + BOTTOM) / 2.0));
    for (line, (label, look)) in labels(rows).into_iter().zip(&LOOKS).enumerate() {
        let y = TOP + 14.0 + 32.0 * line as f64;
        curve(&mut canvas, &[(LEGEND, y), (LEGEND + 20.0, y), (LEGEND + 40.0, y)], look);
        // A long label takes two lines.
        let lines: Vec<&str> = label.split_inclusive(", ").collect();
        for (i, part) in lines.iter().enumerate() {
            let shift = 13.0 * (i as f64 - (lines.len() as f64 - 1.0) / 2.0);
            canvas.text(part.trim_end(), text(11, INK).right(), at(LEGEND + 50.0, y + shift));
        }
    }
    canvas.svg()
}

fn labels(rows: &[Row]) -> Vec<&'static str> {
    let mut labels = Vec::new();
    for label in rows.iter().filter_map(|row| row.label) {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
}

fn frame(canvas: &mut Canvas, left: f64, title: &str) {
    canvas.text(title, text(13, INK), at(left, 14.0));
    for work in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0] {
        let x = left + WIDTH * share(work, WORK);
        canvas.line([at(x, TOP), at(x, BOTTOM)], stroke(FAINT, 1.0));
        canvas.text(&format!("{work}"), text(11, INK).below(), at(x, BOTTOM + 7.0));
    }
    for exponent in -8..=0 {
        let y = BOTTOM - (BOTTOM - TOP) * share(10_f64.powi(exponent), ERROR);
        canvas.line([at(left, y), at(left + WIDTH, y)], stroke(FAINT, 1.0));
        let label = format!("1e{exponent}").replace('-', "−");
        canvas.text(&label, text(11, INK).left(), at(left - 6.0, y));
    }
    canvas.line([at(left, TOP), at(left, BOTTOM)], stroke(INK, 1.0));
    canvas.line([at(left, BOTTOM), at(left + WIDTH, BOTTOM)], stroke(INK, 1.0));
    canvas.text("work per contact in ms", text(12, INK).centred(), at(left + WIDTH / 2.0, BOTTOM + 38.0));
}

/// Draws a line through `points` (pixels) with its markers.
fn curve(canvas: &mut Canvas, points: &[(f64, f64)], look: &Look) {
    let style = stroke(look.color, look.width);
    for dash in dashed(points, look.dashes) {
        canvas.line(dash.into_iter().map(|(x, y)| at(x, y)).collect::<Vec<_>>(), style);
    }
    let Marker { corners, turn, filled, star } = look.marker;
    for &(x, y) in points {
        let outline: Vec<Point> = (0..corners)
            .map(|i| std::f64::consts::TAU * (turn + i as f64 / corners as f64))
            .map(|angle| at(x + 5.0 * angle.sin(), y - 5.0 * angle.cos()))
            .collect();
        if star {
            // A cross has no interior.
            for &corner in &outline {
                canvas.line([at(x, y), corner], stroke(look.color, 1.6));
            }
            continue;
        }
        let closed: Vec<Point> = outline.iter().chain(&outline[..1]).copied().collect();
        canvas.polygon(outline, if filled { look.color } else { WHITE });
        canvas.line(closed, stroke(look.color, 1.6));
    }
}

/// Pieces of a line, alternately drawn and left out, with the lengths `pattern` in pixels; the whole line if it is empty.
fn dashed(points: &[(f64, f64)], pattern: &[f64]) -> Vec<Vec<(f64, f64)>> {
    if pattern.is_empty() {
        return vec![points.to_vec()];
    }
    let (mut pieces, mut phase, mut left) = (Vec::new(), 0, pattern[0]);
    let mut piece: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let ((mut x, mut y), (to_x, to_y)) = (pair[0], pair[1]);
        loop {
            let rest = (to_x - x).hypot(to_y - y);
            if rest < left {
                left -= rest;
                piece.push((to_x, to_y));
                break;
            }
            (x, y) = (x + (to_x - x) * left / rest, y + (to_y - y) * left / rest);
            piece.push((x, y));
            if phase % 2 == 0 {
                pieces.push(std::mem::take(&mut piece));
            }
            phase = (phase + 1) % pattern.len();
            left = pattern[phase];
            piece = vec![(x, y)];
        }
    }
    if phase % 2 == 0 {
        pieces.push(piece);
    }
    pieces
}
