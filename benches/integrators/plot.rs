//! The diagram of work and precision.

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, ShapeStyle};

use crate::Row;

/// Coordinates in the file are whole numbers, this many per pixel.
const FINE: f64 = 10.0;
const SIZE: (f64, f64) = (1000.0, 440.0);
/// Left edges of the panels, their width, top and bottom.
const PANELS: [f64; 2] = [64.0, 418.0];
const WIDTH: f64 = 300.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 388.0;
const LEGEND: f64 = 746.0;
/// Ranges of the axes: work in ms, relative error.
const WORK: (f64, f64) = (0.8, 60.0);
const ERROR: (f64, f64) = (1e-8, 1.0);

const INK: RGBColor = RGBColor(40, 44, 52);
const FAINT: RGBColor = RGBColor(222, 225, 229);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Colour (Okabe and Ito), width, dashes and marker. Each of the last three distinguishes the curves in grey.
struct Look {
    color: RGBColor,
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
    Look { color: RGBColor(86, 180, 233), width: 1.5, dashes: &[2.0, 3.0], marker: marker(3, 0.0, false) },
    Look { color: RGBColor(120, 124, 130), width: 1.5, dashes: &[8.0, 3.0], marker: marker(4, 0.125, false) },
    Look { color: RGBColor(0, 114, 178), width: 1.5, dashes: &[], marker: marker(4, 0.125, true) },
    Look { color: RGBColor(213, 94, 0), width: 2.6, dashes: &[], marker: marker(24, 0.0, true) },
    Look { color: RGBColor(0, 158, 115), width: 1.5, dashes: &[5.0, 2.0, 1.0, 2.0], marker: marker(4, 0.0, false) },
    Look { color: RGBColor(204, 121, 167), width: 1.5, dashes: &[4.0, 4.0], marker: marker(3, 0.5, true) },
    Look { color: RGBColor(180, 140, 0), width: 1.5, dashes: &[1.5, 1.5], marker: marker(24, 0.0, false) },
    Look {
        color: INK,
        width: 1.2,
        dashes: &[10.0, 2.0, 2.0, 2.0],
        marker: Marker { corners: 4, turn: 0.125, filled: false, star: true },
    },
];

fn fine(pixels: f64) -> i32 {
    (pixels * FINE).round() as i32
}

fn text(size: f64) -> TextStyle<'static> {
    // The backend writes a font size of 1/1.24 of what it is given.
    let size = size * FINE * 1.24;
    TextStyle { color: INK.to_backend_color(), ..TextStyle::from(("Helvetica, Arial, sans-serif", size).into_font()) }
}

fn anchored(size: f64, across: HPos, down: VPos) -> TextStyle<'static> {
    text(size).pos(Pos::new(across, down))
}

fn stroke(color: RGBColor, width: f64) -> ShapeStyle {
    color.stroke_width(fine(width) as u32)
}

/// Position of `value` in `range` on a logarithmic scale, from 0 to 1.
fn share(value: f64, (low, high): (f64, f64)) -> f64 {
    (value / low).ln() / (high / low).ln()
}

/// The diagram as SVG.
pub fn draw(rows: &[Row]) -> Result<String> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (fine(SIZE.0) as u32, fine(SIZE.1) as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        let median: fn(&Row) -> f64 = |row| row.median;
        let worst: fn(&Row) -> f64 = |row| row.worst;
        for (left, (which, error)) in PANELS.into_iter().zip([("median", median), ("worst", worst)]) {
            frame(&root, left, &format!("Error of the impulse, {which} of the contacts"))?;
            for (label, look) in labels(rows).into_iter().zip(&LOOKS) {
                let points: Vec<(f64, f64)> = rows
                    .iter()
                    .filter(|row| row.label == Some(label))
                    .map(|row| (share(row.work * 1e-3, WORK), share(error(row), ERROR)))
                    .filter(|(x, y)| (0.0..=1.0).contains(x) && (0.0..=1.0).contains(y))
                    .map(|(x, y)| (left + x * WIDTH, BOTTOM - y * (BOTTOM - TOP)))
                    .collect();
                curve(&root, &points, look)?;
            }
        }
        root.draw_text(
            "relative error",
            &anchored(12.0, HPos::Center, VPos::Center).transform(FontTransform::Rotate270),
            (fine(12.0), fine((TOP + BOTTOM) / 2.0)),
        )?;
        for (line, (label, look)) in labels(rows).into_iter().zip(&LOOKS).enumerate() {
            let y = TOP + 14.0 + 32.0 * line as f64;
            curve(&root, &[(LEGEND, y), (LEGEND + 20.0, y), (LEGEND + 40.0, y)], look)?;
            let style = anchored(11.0, HPos::Left, VPos::Center);
            // A long label takes two lines.
            let lines: Vec<&str> = label.split_inclusive(", ").collect();
            for (i, part) in lines.iter().enumerate() {
                let shift = 13.0 * (i as f64 - (lines.len() as f64 - 1.0) / 2.0);
                root.draw_text(part.trim_end(), &style, (fine(LEGEND + 50.0), fine(y + shift)))?;
            }
        }
        root.present()?;
    }
    let [fine_size, size] =
        [FINE, 1.0].map(|factor| format!("<svg width=\"{}\" height=\"{}\"", SIZE.0 * factor, SIZE.1 * factor));
    Ok(svg.replacen(&fine_size, &size, 1) + "\n")
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

fn frame(root: &Area<'_>, left: f64, title: &str) -> Result<()> {
    root.draw_text(title, &text(13.0), (fine(left), fine(14.0)))?;
    let line = |from: (f64, f64), to: (f64, f64), style: ShapeStyle| {
        root.draw(&PathElement::new([(fine(from.0), fine(from.1)), (fine(to.0), fine(to.1))], style))
    };
    for work in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0] {
        let x = left + WIDTH * share(work, WORK);
        line((x, TOP), (x, BOTTOM), stroke(FAINT, 1.0))?;
        let style = anchored(11.0, HPos::Center, VPos::Top);
        root.draw_text(&format!("{work}"), &style, (fine(x), fine(BOTTOM + 7.0)))?;
    }
    for exponent in -8..=0 {
        let y = BOTTOM - (BOTTOM - TOP) * share(10_f64.powi(exponent), ERROR);
        line((left, y), (left + WIDTH, y), stroke(FAINT, 1.0))?;
        let label = format!("1e{exponent}").replace('-', "−");
        root.draw_text(&label, &anchored(11.0, HPos::Right, VPos::Center), (fine(left - 6.0), fine(y)))?;
    }
    line((left, TOP), (left, BOTTOM), stroke(INK, 1.0))?;
    line((left, BOTTOM), (left + WIDTH, BOTTOM), stroke(INK, 1.0))?;
    let style = anchored(12.0, HPos::Center, VPos::Center);
    let name = "work per contact in ms";
    root.draw_text(name, &style, (fine(left + WIDTH / 2.0), fine(BOTTOM + 38.0)))?;
    Ok(())
}

/// A line through `points` (pixels) with its markers.
fn curve(root: &Area<'_>, points: &[(f64, f64)], look: &Look) -> Result<()> {
    let style = stroke(look.color, look.width);
    for dash in dashed(points, look.dashes) {
        let dash: Vec<_> = dash.into_iter().map(|(x, y)| (fine(x), fine(y))).collect();
        root.draw(&PathElement::new(dash, style))?;
    }
    let Marker { corners, turn, filled, star } = look.marker;
    for &(x, y) in points {
        let outline: Vec<(i32, i32)> = (0..corners)
            .map(|i| std::f64::consts::TAU * (turn + i as f64 / corners as f64))
            .map(|angle| (fine(x + 5.0 * angle.sin()), fine(y - 5.0 * angle.cos())))
            .collect();
        if star {
            // A cross has no interior.
            for &corner in &outline {
                root.draw(&PathElement::new([(fine(x), fine(y)), corner], stroke(look.color, 1.6)))?;
            }
            continue;
        }
        let inside = if filled { look.color } else { WHITE };
        root.draw(&Polygon::new(outline.clone(), inside.filled()))?;
        let closed: Vec<_> = outline.iter().chain(&outline[..1]).copied().collect();
        root.draw(&PathElement::new(closed, stroke(look.color, 1.6)))?;
    }
    Ok(())
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
