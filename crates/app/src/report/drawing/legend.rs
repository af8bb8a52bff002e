//! Legends of diagrams. A legend is in a free corner, to the right of the diagram or, on paper,
//! below it. It never covers a point.

use super::diagram::{Look, PixelRectangle, Styled, places};
use super::format::Format;
use super::scale::AxisScale;
use super::{Canvas, INK, WHITE, fine, text, width};

/// Minimum width of a diagram, in pixels.
const MIN_WIDTH: i32 = 400;
/// Maximum number of curves with a legend inside the diagram. A longer legend is to its right.
const MAX_IN_CORNER: usize = 5;
/// Height of a legend row, left end of its text, and margin around the legend, in pixels.
const ROW: i32 = 18;
const TEXT: i32 = 58;
const MARGIN: i32 = 8;

/// Place of the legend of a figure.
pub(super) struct Legend {
    /// Frame of the diagram beside the legend, in pixels.
    pub frame: PixelRectangle,
    /// Upper left corner of the legend in pixels.
    place: (i32, i32),
    /// Number of rows; further entries follow to the right.
    rows: usize,
    /// Width of a column of entries in pixels.
    wide: i32,
    /// Size of the figure in pixels.
    pub size: (i32, i32),
}

/// Returns the height of a legend with this number of rows, in pixels.
fn high(rows: usize) -> i32 {
    ROW * rows as i32 + MARGIN
}

impl Legend {
    /// Chooses the place of the legend of `entries`. `within` is the frame of the diagram if no
    /// legend is to its right, `(page, height)` the size of the figure without a legend.
    pub fn new(
        format: &Format,
        entries: &[&Styled<'_>],
        curves: &[Styled<'_>],
        scales: [&AxisScale; 2],
        within @ [left, top, _, bottom]: PixelRectangle,
        (page, height): (i32, i32),
    ) -> Self {
        let names = entries
            .iter()
            .map(|entry| width(&entry.curve.name, 12))
            .max()
            .unwrap_or(0);
        let wide = TEXT + names + MARGIN;
        let corner = free_corner(curves, scales, within, (wide, high(entries.len())));
        match corner {
            Some(place) if entries.len() <= MAX_IN_CORNER => Legend {
                frame: within,
                place,
                rows: entries.len(),
                wide,
                size: (page, height),
            },
            _ if format.is_on_paper() => {
                let columns = ((page - left) / wide).max(1) as usize;
                let rows = entries.len().div_ceil(columns);
                Legend {
                    frame: within,
                    place: (left, height),
                    rows,
                    wide,
                    size: (page, height + high(rows)),
                }
            }
            _ => {
                let right = (page - wide - MARGIN).max(left + MIN_WIDTH);
                let (frame, high) = ([left, top, right, bottom], high(entries.len()));
                let size = (right + MARGIN + wide, height.max(top + high));
                Legend {
                    frame,
                    place: (right + MARGIN, top),
                    rows: entries.len(),
                    wide,
                    size,
                }
            }
        }
    }

    /// Draws the legend.
    pub fn draw(&self, canvas: &mut Canvas, entries: &[&Styled<'_>]) {
        let Self {
            place: (across, down),
            rows,
            wide,
            ..
        } = *self;
        for (index, column) in entries.chunks(rows.max(1)).enumerate() {
            let across = across + wide * index as i32;
            canvas.rectangle(
                [
                    (fine(across), fine(down)),
                    (fine(across + wide), fine(down + high(rows))),
                ],
                WHITE,
            );
            for (row, entry) in (0..).zip(column) {
                let level = fine(down + MARGIN / 2 + ROW / 2 + ROW * row);
                let line = [MARGIN, 29, 50].map(|x| (fine(across + x), level));
                entry.draw(canvas, &line, &line[1..2]);
                canvas.text(
                    &entry.curve.name,
                    text(12, INK).right(),
                    (fine(across + TEXT), level),
                );
            }
        }
    }
}

/// Returns the corner of the frame in which a legend of this size is farthest from the curves; none
/// if it would cover one.
fn free_corner(
    curves: &[Styled<'_>],
    scales: [&AxisScale; 2],
    frame: PixelRectangle,
    (wide, high): (i32, i32),
) -> Option<(i32, i32)> {
    let covered: Vec<_> = curves
        .iter()
        .map(|styled| (styled.curve.look, places(styled.curve, scales, frame)))
        .collect();
    let [left, top, right, bottom] = frame;
    let (far, low) = (right - wide - 2, bottom - high - 2);
    let corners = [
        (far, top + 2),
        (left + 2, top + 2),
        (far, low),
        (left + 2, low),
    ];
    let distance = |(x, y): (i32, i32)| {
        let legend = [x, y, x + wide, y + high];
        covered
            .iter()
            .map(|(look, parts)| distance(legend, *look, parts))
            .min()
            .unwrap_or(i32::MAX)
    };
    // The first of several equal ones.
    let best = corners
        .into_iter()
        .rev()
        .max_by_key(|&corner| distance(corner))?;
    (wide <= right - left && distance(best) > fine(6)).then_some(best)
}

/// Returns the distance between a rectangle (in pixels) and a curve, in coordinates of the canvas.
fn distance(
    [left, top, right, bottom]: PixelRectangle,
    look: Look,
    parts: &[Vec<(i32, i32)>],
) -> i32 {
    let beside = |at: i32, low: i32, high: i32| (fine(low) - at).max(at - fine(high)).max(0);
    let from = |(x, y): (i32, i32)| beside(x, left, right).max(beside(y, top, bottom));
    let points = parts.iter().flatten().map(|&at| from(at));
    let lines = parts
        .iter()
        .filter(|_| ![Look::Markers, Look::Filled].contains(&look))
        .flat_map(|part| part.windows(2))
        .flat_map(|ends| {
            let [(x, y), (to_x, to_y)] = [ends[0], ends[1]];
            let steps = (to_x - x).abs().max((to_y - y).abs()) / fine(3) + 1;
            (0..steps)
                .map(move |step| (x + (to_x - x) * step / steps, y + (to_y - y) * step / steps))
        });
    points.chain(lines.map(from)).min().unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::super::diagram::{Curve, Diagram, styled};
    use super::super::scale::Axis;
    use super::*;

    #[test]
    fn a_legend_covers_no_point() {
        let rising = vec![Curve::new(
            "a name",
            Look::Line,
            vec![(0.0, 0.0), (0.6, 0.1), (1.0, 1.0)],
        )];
        let scale = AxisScale::new(Axis::linear(""), [0.0, 1.0].into_iter());
        let frame = [0, 0, 600, 300];
        let corner = free_corner(&styled(&rising), [&scale, &scale], frame, (100, 50));
        assert_eq!(corner, Some((2, 2)), "top left");
        let crossing = vec![
            (0.0, 0.0),
            (1.0, 1.0),
            (f64::NAN, 0.0),
            (0.0, 1.0),
            (1.0, 0.0),
        ];
        let crossing = vec![Curve::new("a name", Look::Line, crossing)];
        assert_eq!(
            free_corner(&styled(&crossing), [&scale, &scale], frame, (100, 50)),
            None
        );
        assert!(
            Diagram::new(
                "Title",
                "Subtitle",
                ["abscissa", "ordinate"].map(Axis::linear),
                crossing,
            )
            .draw_in(&Format::default())
            .svg()
            .contains("a name")
        );
    }
}
