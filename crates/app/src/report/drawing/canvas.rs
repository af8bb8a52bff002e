//! A figure as a list of shapes and texts, which can be written as SVG or as a bitmap.
//!
//! Coordinates are whole numbers ([`fine`] converts pixels), so both forms are equal on every
//! machine.

use super::color::{Color, WHITE};
use super::format::Format;
use super::typeset::typeset;

/// Coordinates per pixel. More than one keeps curves smooth although coordinates are whole numbers.
pub(super) const FINE: i32 = 10;

/// A point on a canvas: coordinates to the right of and below the upper left corner.
pub type CanvasPoint = (i32, i32);

/// Converts pixels to coordinates.
pub const fn fine(pixels: i32) -> i32 {
    pixels * FINE
}

/// A figure on a white background.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    /// Width and height in pixels.
    size: (i32, i32),
    /// Size on paper, and font.
    format: Format,
    /// Shapes in drawing order: the last one is on top.
    shapes: Vec<CanvasShape>,
}

/// A part of a figure.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CanvasShape {
    /// From the upper left to the lower right corner.
    Rectangle {
        corners: [CanvasPoint; 2],
        fill: Color,
    },
    Polygon {
        points: Vec<CanvasPoint>,
        fill: Color,
        opacity: f64,
    },
    Line {
        points: Vec<CanvasPoint>,
        stroke: Stroke,
    },
    Text {
        text: String,
        style: TextStyle,
        at: CanvasPoint,
    },
}

/// The style of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Colour of the line.
    pub color: Color,
    /// Width in coordinates.
    pub width: i32,
}

/// Creates a line style with a width in tenths of a pixel.
pub const fn stroke(color: Color, tenths: i32) -> Stroke {
    Stroke {
        color,
        width: fine(tenths) / 10,
    }
}

/// Part of a text at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Part of a text that is level with its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VerticalAlignment {
    Top,
    Middle,
}

/// The style of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle {
    /// Font size in coordinates.
    pub(super) size: i32,
    pub(super) color: Color,
    pub(super) anchor: Anchor,
    pub(super) level: VerticalAlignment,
    /// `true` if the text reads upwards.
    pub(super) upwards: bool,
}

/// Creates a text style with a font size in pixels. The text is to the right of its point and below
/// it.
pub const fn text(size: i32, color: Color) -> TextStyle {
    TextStyle {
        size: fine(size),
        color,
        anchor: Anchor::Start,
        level: VerticalAlignment::Top,
        upwards: false,
    }
}

impl TextStyle {
    /// Centres the text on its point.
    pub const fn centred(self) -> Self {
        Self {
            anchor: Anchor::Middle,
            level: VerticalAlignment::Middle,
            ..self
        }
    }

    /// Puts the text to the right of its point, level with the point.
    pub const fn right(self) -> Self {
        Self {
            anchor: Anchor::Start,
            level: VerticalAlignment::Middle,
            ..self
        }
    }

    /// Puts the text to the left of its point, level with the point.
    pub const fn left(self) -> Self {
        Self {
            anchor: Anchor::End,
            level: VerticalAlignment::Middle,
            ..self
        }
    }

    /// Puts the text below its point, centred.
    pub const fn below(self) -> Self {
        Self {
            anchor: Anchor::Middle,
            level: VerticalAlignment::Top,
            ..self
        }
    }

    /// Turns the text by 90° to read upwards.
    pub const fn upwards(self) -> Self {
        Self {
            upwards: true,
            ..self
        }
    }
}

impl Canvas {
    /// Creates an empty canvas of a format. Width and height are pixels of its layout.
    pub(crate) fn on(format: &Format, (width, height): (i32, i32)) -> Self {
        let mut canvas = Self {
            size: (width, height),
            format: format.clone(),
            shapes: Vec::new(),
        };
        canvas.rectangle([(0, 0), (fine(width), fine(height))], WHITE);
        canvas
    }

    /// Returns the format.
    pub(super) fn format(&self) -> &Format {
        &self.format
    }

    /// Returns width and height in pixels.
    pub(super) fn size(&self) -> (i32, i32) {
        self.size
    }

    /// Returns the shapes, from the lowest to the highest.
    pub(super) fn shapes(&self) -> &[CanvasShape] {
        &self.shapes
    }

    /// Fills the rectangle between two opposite corners.
    pub fn rectangle(&mut self, [(x, y), (to_x, to_y)]: [CanvasPoint; 2], fill: Color) {
        let corners = [(x.min(to_x), y.min(to_y)), (x.max(to_x), y.max(to_y))];
        self.shapes.push(CanvasShape::Rectangle { corners, fill });
    }

    /// Fills a polygon.
    pub fn polygon(&mut self, points: impl Into<Vec<CanvasPoint>>, fill: Color) {
        self.area(points, fill, 1.0);
    }

    /// Fills a polygon with an opacity from 0 to 1.
    pub fn area(&mut self, points: impl Into<Vec<CanvasPoint>>, fill: Color, opacity: f64) {
        self.shapes.push(CanvasShape::Polygon {
            points: points.into(),
            fill,
            opacity,
        });
    }

    /// Draws straight lines through points.
    pub fn line(&mut self, points: impl Into<Vec<CanvasPoint>>, stroke: Stroke) {
        self.shapes.push(CanvasShape::Line {
            points: points.into(),
            stroke,
        });
    }

    /// Outlines the rectangle between two opposite corners.
    pub fn frame(&mut self, [(x, y), (to_x, to_y)]: [CanvasPoint; 2], stroke: Stroke) {
        self.line([(x, y), (to_x, y), (to_x, to_y), (x, to_y), (x, y)], stroke);
    }

    /// Draws a dashed line through points; lengths of dashes and gaps are in coordinates.
    pub fn dashed(&mut self, points: &[CanvasPoint], [dash, gap]: [i32; 2], stroke: Stroke) {
        for dash in dashes(points, [dash, gap].map(|length| length as f32)) {
            self.line(dash, stroke);
        }
    }

    /// Writes a text. Symbols such as `F_n,w` are typeset with subscripts, numbers with minus signs
    /// and powers of ten.
    pub fn text(&mut self, text: &str, style: TextStyle, at: CanvasPoint) {
        let style = TextStyle {
            size: fine(self.format.font_size(style.size / fine(1))),
            ..style
        };
        self.shapes.push(CanvasShape::Text {
            text: typeset(text),
            style,
            at,
        });
    }
}

/// Cuts a line into dashes, which continue around corners.
fn dashes(points: &[CanvasPoint], [dash, gap]: [f32; 2]) -> Vec<Vec<CanvasPoint>> {
    let rounded = |(x, y): (f32, f32)| (x.round() as i32, y.round() as i32);
    let mut dashes = Vec::new();
    let Some((&(x, y), rest)) = points.split_first() else {
        return dashes;
    };
    let mut at = (x as f32, y as f32);
    let mut current = vec![rounded(at)];
    let (mut is_dash, mut done) = (true, 0.0);
    for &(x, y) in rest {
        let end = (x as f32, y as f32);
        while at != end {
            let (dx, dy) = (end.0 - at.0, end.1 - at.1);
            let (distance, length) = (dx.hypot(dy), if is_dash { dash } else { gap });
            let left = length - done;
            if left < distance {
                let part = left / distance;
                at = (at.0 + dx * part, at.1 + dy * part);
                done += left;
            } else {
                at = end;
                done += distance;
            }
            if is_dash {
                current.push(rounded(at));
            }
            if length <= done {
                if is_dash {
                    dashes.push(std::mem::take(&mut current));
                } else {
                    current.push(rounded(at));
                }
                (is_dash, done) = (!is_dash, 0.0);
            }
        }
    }
    if current.len() > 1 {
        dashes.push(current);
    }
    dashes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_and_gaps_have_their_lengths_around_corners() {
        let corner = [(0, 0), (30, 0), (30, 30)];
        let expected = [
            vec![(0, 0), (25, 0)],
            vec![(27, 0), (30, 0), (30, 22)],
            vec![(30, 24), (30, 30)],
        ];
        assert_eq!(dashes(&corner, [25.0, 2.0]), expected);
        assert!(
            dashes(&[], [2.0, 1.0]).is_empty() && dashes(&[(1, 1), (1, 1)], [2.0, 1.0]).is_empty()
        );
    }

    #[test]
    fn corners_of_a_rectangle_are_put_in_order() {
        let mut canvas = Canvas::on(&Format::default(), (1, 1));
        canvas.rectangle([(5, 0), (0, 7)], WHITE);
        assert_eq!(
            canvas.shapes[1],
            CanvasShape::Rectangle {
                corners: [(0, 0), (5, 7)],
                fill: WHITE
            }
        );
    }
}
