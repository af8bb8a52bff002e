//! Figures in one style: axes, curves and maps in, SVG, PNG and PDF out.
//!
//! `diagram` and `map` lay a figure out on a [`Canvas`], a list of shapes and texts. The canvas
//! writes itself as SVG with text, as a bitmap with glyphs of the embedded font, and as PDF with
//! both.

mod canvas;
mod cell_number;
pub(crate) mod clip;
mod color;
mod contour;
pub(crate) mod diagram;
mod font;
pub mod format;
pub(crate) mod heading;
mod legend;
pub(crate) mod map;
mod pdf;
pub(crate) mod pens;
mod raster;
pub(crate) mod scale;
mod svg;
mod symbols;
mod typeset;

use std::f64::consts::TAU;

pub use canvas::Canvas;
pub(crate) use canvas::{CanvasPoint, fine, stroke, text};
pub(crate) use color::{BLUE, Color, FAINT, GREY, GRID, INK, VERMILION, WHITE, viridis};
pub(crate) use typeset::{power_of_ten, typeset};

use symbols::runs;

/// Returns the estimated width of a text in pixels. An SVG viewer may use another font.
pub(crate) fn width(text: &str, size: i32) -> i32 {
    let characters = |run: &symbols::TextRun<'_>| run.text.chars().count() as i32;
    runs(&typeset(text))
        .iter()
        .map(|run| characters(run) * run.size(size * 55) / 100)
        .sum()
}

/// Returns the smallest and the largest of some values; infinite without any.
pub(crate) fn ends(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values
        .into_iter()
        .fold(none, |[low, high], value| [low.min(value), high.max(value)])
}

/// Pairs the values of an axis with their labels.
pub(crate) fn labelled(
    values: impl IntoIterator<Item = f64>,
    label: impl Fn(f64) -> String,
) -> Vec<(f64, String)> {
    values
        .into_iter()
        .map(|value| (value, label(value)))
        .collect()
}

/// Draws `ticks`, pairs of values and labels, at the points that `at` returns, and the name of the
/// axis at a place in pixels.
pub(crate) fn axis(
    canvas: &mut Canvas,
    (name, place): (&str, (i32, i32)),
    ticks: &[(f64, String)],
    vertical: bool,
    at: impl Fn(f64) -> CanvasPoint,
) {
    for (value, label) in ticks {
        let (x, y) = at(*value);
        let mark = if vertical {
            (x - fine(4), y)
        } else {
            (x, y + fine(4))
        };
        canvas.line([(x, y), mark], stroke(INK, 10));
        let (style, at) = if vertical {
            (text(11, INK).left(), (x - fine(7), y))
        } else {
            (text(11, INK).below(), (x, y + fine(7)))
        };
        canvas.text(label, style, at);
    }
    let style = text(12, INK).centred();
    let style = if vertical { style.upwards() } else { style };
    canvas.text(name, style, (fine(place.0), fine(place.1)));
}

/// Returns a value as a label, rounded to a whole number.
pub(crate) fn whole(value: f64) -> String {
    format!("{value:.0}").replace('-', "−")
}

/// A marker: a regular polygon around a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Marker {
    /// Number of corners; a large number makes a circle.
    pub corners: u32,
    /// Angle of the first corner in rad, clockwise from the right.
    pub turn: f64,
    /// Distance between corners and centre in pixels.
    pub radius: i32,
}

/// The style of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pen {
    /// Colour of line and markers.
    pub color: Color,
    /// Width of the line and of outlines in tenths of a pixel.
    pub tenths: i32,
    /// Lengths of dashes and gaps in pixels; a gap of zero makes a solid line.
    pub dash: (i32, i32),
    /// Marker of the points.
    pub marker: Marker,
}

impl Pen {
    /// Draws a line through points.
    pub fn line(&self, canvas: &mut Canvas, points: &[CanvasPoint]) {
        let (dash, gap) = self.dash;
        let style = stroke(self.color, self.tenths);
        if gap == 0 {
            canvas.line(points, style);
        } else {
            canvas.dashed(points, [dash, gap].map(fine), style);
        }
    }

    /// Draws markers at points. White filling hides the line below them, filling in their colour
    /// makes them prominent.
    pub fn markers(&self, canvas: &mut Canvas, points: &[CanvasPoint], filled: bool) {
        let (fill, rim) = if filled {
            (self.color, WHITE)
        } else {
            (WHITE, self.color)
        };
        let Marker {
            corners,
            turn,
            radius,
        } = self.marker;
        for &(x, y) in points {
            let corner = |k: u32| {
                let (sine, cosine) = (turn + TAU * f64::from(k) / f64::from(corners)).sin_cos();
                let radius = f64::from(fine(radius + i32::from(filled)));
                (
                    x + (radius * cosine).round() as i32,
                    y + (radius * sine).round() as i32,
                )
            };
            // One corner more than the first again, so that the outline is closed there.
            let outline: Vec<CanvasPoint> = (0..=corners + 1).map(corner).collect();
            canvas.polygon(&outline[..=corners as usize], fill);
            canvas.line(outline, stroke(rim, self.tenths));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_not_longer_than_their_width() {
        let names = [
            "a_e = 0.5 mm",
            "v_b = 12.5 m/s",
            "simulated, a_e = 0.5 mm",
            "measured, v_b = 30 m/s",
            "not attributed",
        ];
        let labels = ["0.25", "10500", "−30", "10⁻⁶", "1.000001"];
        for (texts, size) in [(&names, 12), (&labels, 11)] {
            for text in texts {
                let length = font::length(text, size);
                assert!(width(text, size) as f32 + 1.0 >= length, "{text}: {length}");
            }
        }
        // A subscript takes less room than a letter.
        assert!(width("F_n", 12) < width("Fn", 12));
    }
}
