//! Places on a workpiece: its profile in the plane of rotation, cut into cells along its arc
//! length.
//!
//! Arc length grows with the material on the right-hand side: below the tool in the direction in
//! which filaments sweep. Its origin is the workpiece's own `x = 0` on a plane, a cylinder (the
//! top) and a bore (the bottom), and the middle of the rounded part of an edge or a chamfer. It
//! moves with the workpiece.

use super::cross;
use crate::equations::linear::{dot, sub};

/// Least number of cells of an arc.
pub(super) const MIN_ARC_CELLS: f64 = 24.0;
/// Largest number of cells of a curve. Curves that would have more have longer cells.
const MAX_CELLS: f64 = 10_000.0;

/// Directions from a point in which straight lines pass near enough to some others: from the right
/// one round to the left one, or all before the first such point. The cone is empty if the right
/// one is to the left of the left one.
#[derive(Clone, Copy, Debug, Default)]
struct Cone(Option<[[f64; 2]; 2]>);

impl Cone {
    /// Narrows the cone to the directions that pass a point at `to` within `error` (m): those
    /// between the tangents of the circle around it.
    fn narrow(&mut self, to @ [x, y]: [f64; 2], error: f64) {
        let square = dot(to, to);
        if square <= error * error {
            return;
        }
        let along = (square - error * error).sqrt();
        let tangent = |across: f64| [along * x - across * y, across * x + along * y];
        let [mut right, mut left] = [tangent(-error), tangent(error)];
        if let Some([earlier_right, earlier_left]) = self.0 {
            if cross(right, earlier_right) > 0.0 {
                right = earlier_right;
            }
            if cross(left, earlier_left) < 0.0 {
                left = earlier_left;
            }
        }
        self.0 = Some([right, left]);
    }

    fn contains(&self, direction: [f64; 2]) -> bool {
        self.0.is_none_or(|[right, left]| {
            cross(right, direction) >= 0.0 && cross(direction, left) >= 0.0
        })
    }
}

/// A part of the profile of a workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Arc lengths at its start and end in m.
    pub arc_length: [f64; 2],
    /// Points there in m, as the workpiece lies at time zero.
    pub ends: [[f64; 2]; 2],
    /// `true` if it belongs to an edge.
    pub on_edge: bool,
}

/// Outline of a workpiece in the plane of rotation, within some distance of the tool axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfileCells {
    /// Cells in order, each from the end of the one before.
    pub cells: Vec<Cell>,
    /// Length of a closed outline in m, if the cells go all the way round.
    pub period: Option<f64>,
}

impl ProfileCells {
    /// Adds cells for the arc lengths from `start` to `end` (m) of a curve with the point `at` (m)
    /// by arc length: at least `least`, none longer than `longest` (m).
    pub fn extend(
        &mut self,
        [start, end]: [f64; 2],
        [least, longest]: [f64; 2],
        on_edge: bool,
        at: impl Fn(f64) -> [f64; 2],
    ) {
        let length = end - start;
        if length <= 0.0 {
            return;
        }
        let count = (length / longest).ceil().min(MAX_CELLS).max(least) as usize;
        let place = |index: usize| {
            if index == count {
                end
            } else {
                start + length * index as f64 / count as f64
            }
        };
        let cell = |index: usize| {
            let arc_length = [place(index), place(index + 1)];
            Cell {
                arc_length,
                ends: arc_length.map(&at),
                on_edge,
            }
        };
        self.cells.extend((0..count).map(cell));
    }

    /// Returns the arc lengths between cells in m, ascending: one more than there are cells, or
    /// none.
    pub fn boundaries(&self) -> Vec<f64> {
        let first = self.cells.first().map(|cell| cell.arc_length[0]);
        first
            .into_iter()
            .chain(self.cells.iter().map(|cell| cell.arc_length[1]))
            .collect()
    }

    /// Returns the points between cells in m, as the workpiece lies at time zero; see
    /// [`ProfileCells::boundaries`].
    pub fn points(&self) -> Vec<[f64; 2]> {
        let first = self.cells.first().map(|cell| cell.ends[0]);
        first
            .into_iter()
            .chain(self.cells.iter().map(|cell| cell.ends[1]))
            .collect()
    }

    /// Returns the [`points`](ProfileCells::points) without those that straight lines between the
    /// others pass within `error` (m).
    pub fn simplified(&self, error: f64) -> Vec<[f64; 2]> {
        let points = self.points();
        let mut kept: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
        let mut start = 0;
        let mut cone = Cone::default();
        for end in 2..points.len() {
            let from_start = |index: usize| sub(points[index], points[start]);
            cone.narrow(from_start(end - 1), error);
            if !cone.contains(from_start(end)) {
                start = end - 1;
                kept.push(points[start]);
                cone = Cone::default();
            }
        }
        kept.extend(points.last().filter(|_| points.len() > 1));
        kept
    }

    /// Returns `true` if it goes round the material: it is closed, and turns in the negative sense.
    pub fn is_solid(&self) -> bool {
        let area: f64 = self
            .cells
            .iter()
            .map(
                |Cell {
                     ends: [start, end], ..
                 }| cross(*start, *end),
            )
            .sum();
        self.period.is_some() && area < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simplified_outline_stays_within_its_error_and_keeps_corners() {
        const ERROR: f64 = 1e-5;
        const LONGEST: f64 = 0.25e-3;
        let mut outline = ProfileCells::default();
        outline.extend([0.0, 1.0], [1.0, LONGEST], false, |s| [s, 0.0]);
        outline.extend([1.0, 1.3], [100.0, LONGEST], true, |s| {
            [1.0 + (s - 1.0).sin(), 1.0 - (s - 1.0).cos()]
        });
        let [x, y] = [1.0 + 0.3_f64.sin(), 1.0 - 0.3_f64.cos()];
        // Back by nearly the same way.
        outline.extend([1.3, 1.6], [1.0, LONGEST], false, |s| {
            [x - (s - 1.3), y + 0.1 * (s - 1.3)]
        });
        let points = outline.points();
        let kept = outline.simplified(ERROR);
        assert!(
            kept.len() < points.len() / 20,
            "{} of {}",
            kept.len(),
            points.len()
        );
        let is_corner = |[a, b]: &[f64; 2]| (a - x).hypot(b - y) < 1e-12;
        assert!(kept.iter().any(is_corner), "{kept:?}");
        let distance = |point: [f64; 2], [from, to]: [[f64; 2]; 2]| {
            let (along, offset) = (sub(to, from), sub(point, from));
            let part = (dot(along, offset) / dot(along, along)).clamp(0.0, 1.0);
            let [a, b] = [0, 1].map(|i| offset[i] - part * along[i]);
            a.hypot(b)
        };
        for point in points {
            let nearest = kept
                .windows(2)
                .map(|ends| distance(point, [ends[0], ends[1]]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest <= 1.001 * ERROR, "{point:?}: {nearest}");
        }
    }
}
