//! Contour lines: pieces between values on a grid, and the lines that they make on the canvas.

use super::diagram::PixelRectangle;
use super::{CanvasPoint, fine};
use std::collections::BTreeMap;

/// Maximum extension of a line to the frame, over half the largest outermost cell.
const MAX_EXTENSION: i32 = 2;

/// Returns the pieces of the contour line at this level of a quantity given row by row, linear
/// between neighbours.
///
/// Four neighbours with an unknown value have no piece between them.
pub(super) fn contour(
    [xs, ys]: [&[f64]; 2],
    values: &[Option<f64>],
    level: f64,
) -> Vec<[(f64, f64); 2]> {
    let mut pieces = Vec::new();
    for (row, y) in ys.windows(2).enumerate() {
        for (column, x) in xs.windows(2).enumerate() {
            let at =
                |column: usize, row: usize| values.get(row * xs.len() + column).copied().flatten();
            let around = [
                at(column, row),
                at(column + 1, row),
                at(column + 1, row + 1),
                at(column, row + 1),
            ];
            let [Some(a), Some(b), Some(c), Some(d)] = around else {
                continue;
            };
            let corners = [
                (x[0], y[0], a),
                (x[1], y[0], b),
                (x[1], y[1], c),
                (x[0], y[1], d),
            ];
            let crossing = |from: usize| {
                // A fixed order, so that neighbours have the same point.
                let (a, b) = (corners[from], corners[(from + 1) % 4]);
                let ((x0, y0, v0), (x1, y1, v1)) = if (a.0, a.1) <= (b.0, b.1) {
                    (a, b)
                } else {
                    (b, a)
                };
                let part = (level - v0) / (v1 - v0);
                ((v0 < level) != (v1 < level))
                    .then_some((x0 + part * (x1 - x0), y0 + part * (y1 - y0)))
            };
            let crossings: Vec<(f64, f64)> = (0..4).filter_map(crossing).collect();
            match crossings[..] {
                [from, to] => pieces.push([from, to]),
                [below, right, above, left] => {
                    // A saddle: the value in the middle decides which corners belong together.
                    let joined = ((a + b + c + d) / 4.0 < level) == (a < level);
                    let pairs = if joined {
                        [[below, right], [above, left]]
                    } else {
                        [[below, left], [right, above]]
                    };
                    pieces.extend(pairs);
                }
                _ => {}
            }
        }
    }
    pieces
}

/// Joins pieces with common ends to lines.
pub(super) fn joined(pieces: &[[CanvasPoint; 2]]) -> Vec<Vec<CanvasPoint>> {
    let mut at: BTreeMap<CanvasPoint, Vec<usize>> = BTreeMap::new();
    for (index, piece) in pieces.iter().enumerate() {
        piece
            .iter()
            .for_each(|end| at.entry(*end).or_default().push(index));
    }
    let mut is_used = vec![false; pieces.len()];
    let mut lines = Vec::new();
    for index in 0..pieces.len() {
        if std::mem::replace(&mut is_used[index], true) {
            continue;
        }
        let mut line = pieces[index].to_vec();
        // First beyond its end, then beyond its start.
        for _ in 0..2 {
            while let Some(&next) = line
                .last()
                .and_then(|end| at[end].iter().find(|next| !is_used[**next]))
            {
                is_used[next] = true;
                let [from, to] = pieces[next];
                line.push(if line.last() == Some(&from) { to } else { from });
            }
            line.reverse();
        }
        lines.push(line);
    }
    lines
}

/// Returns the point where a line, extended beyond its end, meets the frame. None unless the line
/// ends on a side of the rectangle of the outermost middles, going outwards. None also if the
/// extension would go along the frame.
pub(super) fn on_to_the_frame(
    [before, end]: [CanvasPoint; 2],
    [left, top, right, bottom]: [i32; 4],
    frame: PixelRectangle,
) -> Option<CanvasPoint> {
    let (across, down) = (end.0 - before.0, end.1 - before.1);
    let [low_x, low_y, high_x, high_y] = frame.map(fine);
    let is_outwards = (end.0 == left && across < 0)
        || (end.0 == right && across > 0)
        || (end.1 == top && down < 0)
        || (end.1 == bottom && down > 0);
    // Number of lengths of the last piece between the end and a side that it approaches.
    let part = |from: i32, rate: i32, [low, high]: [i32; 2]| match rate.signum() {
        0 => f64::INFINITY,
        sign => f64::from(if sign < 0 { low - from } else { high - from }) / f64::from(rate),
    };
    let part = part(end.0, across, [low_x, high_x]).min(part(end.1, down, [low_y, high_y]));
    let [more_x, more_y] = [across, down].map(|rate| (part * f64::from(rate)).round() as i32);
    let is_near =
        |more: i32, beyond: [i32; 2]| more.abs() <= MAX_EXTENSION * beyond[0].max(beyond[1]);
    let is_short = is_near(more_x, [left - low_x, high_x - right])
        && is_near(more_y, [top - low_y, high_y - bottom]);
    (is_outwards && is_short).then_some((end.0 + more_x, end.1 + more_y))
}

/// Returns points of a line that are at most a pixel apart.
pub(super) fn sampled(line: &[CanvasPoint]) -> impl Iterator<Item = CanvasPoint> {
    line.windows(2).flat_map(|ends| {
        let [(x, y), (to_x, to_y)] = [ends[0], ends[1]];
        let steps = ((to_x - x).abs().max((to_y - y).abs()) / fine(1)).max(1);
        (0..=steps).map(move |step| (x + (to_x - x) * step / steps, y + (to_y - y) * step / steps))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_level_is_interpolated() {
        let [xs, ys] = [[0.0, 1.0, 3.0], [0.0, 2.0, 3.0]];
        let plane: Vec<_> = ys.iter().flat_map(|y| xs.map(|x| Some(x + y))).collect();
        let pieces = contour([&xs, &ys], &plane, 1.5);
        assert!(!pieces.is_empty());
        for (x, y) in pieces.into_iter().flatten() {
            assert!((x + y - 1.5_f64).abs() < 1e-12, "{x} {y}");
        }
        let saddle = [1.0, 0.0, 0.0, 1.0].map(Some);
        assert_eq!(contour([&xs[..2], &ys[..2]], &saddle, 0.5).len(), 2);
        let gap = [Some(1.0), None, Some(0.0), Some(1.0)];
        assert!(contour([&xs[..2], &ys[..2]], &gap, 0.5).is_empty());
    }
}
