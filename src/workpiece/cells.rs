//! Where on a workpiece: its profile in the plane of rotation, cut into cells along its arc length.
//!
//! Arc length grows with the material on the right-hand side: below the tool in the direction in which filaments sweep. Its origin
//! is the workpiece's own `x = 0` on a plane, a cylinder (the top) and a bore (the bottom), and the middle of the rounded part of an
//! edge or a chamfer. It moves with the workpiece.

/// Longest cell in m.
const LONGEST_CELL: f64 = 0.25e-3;
/// Least number of cells of an arc.
pub(super) const CELLS_OF_ARC: usize = 24;
/// Largest number of cells of a curve. Cells of curves that would have more are longer.
const MAX_CELLS: f64 = 10_000.0;

/// A part of the profile of a workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The arc lengths at its start and end in m.
    pub arc_length: [f64; 2],
    /// The points there in m, as the workpiece lies at time zero.
    pub ends: [[f64; 2]; 2],
    /// Whether it belongs to an edge.
    pub on_edge: bool,
}

/// The outline of a workpiece in the plane of rotation, within some distance of the tool axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfileCells {
    /// In order, each from the end of the one before.
    pub cells: Vec<Cell>,
    /// The length of a closed outline in m, if the cells go all the way round.
    pub period: Option<f64>,
}

impl ProfileCells {
    /// Adds cells for the arc lengths from `start` to `end` (m) of a curve with the point `at` (m) by arc length: at least `least`.
    pub fn extend(&mut self, [start, end]: [f64; 2], least: usize, on_edge: bool, at: impl Fn(f64) -> [f64; 2]) {
        let length = end - start;
        if length <= 0.0 {
            return;
        }
        let count = (length / LONGEST_CELL).ceil().min(MAX_CELLS).max(least as f64) as usize;
        let place = |index: usize| if index == count { end } else { start + length * index as f64 / count as f64 };
        let cell = |index: usize| {
            let arc_length = [place(index), place(index + 1)];
            Cell { arc_length, ends: arc_length.map(&at), on_edge }
        };
        self.cells.extend((0..count).map(cell));
    }

    /// The arc lengths between cells in m, ascending: one more than there are cells, or none.
    pub fn boundaries(&self) -> Vec<f64> {
        let first = self.cells.first().map(|cell| cell.arc_length[0]);
        first.into_iter().chain(self.cells.iter().map(|cell| cell.arc_length[1])).collect()
    }

    /// The points between cells in m, as the workpiece lies at time zero; see [`ProfileCells::boundaries`].
    pub fn points(&self) -> Vec<[f64; 2]> {
        let first = self.cells.first().map(|cell| cell.ends[0]);
        first.into_iter().chain(self.cells.iter().map(|cell| cell.ends[1])).collect()
    }

    /// Some of the [`points`](ProfileCells::points): without those that straight lines between the others pass within `error` (m).
    pub fn simplified(&self, error: f64) -> Vec<[f64; 2]> {
        let points = self.points();
        let mut kept: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
        let mut start = 0;
        for end in 2..points.len() {
            let [[x, y], [x_end, y_end]] = [points[start], points[end]];
            let (u, v) = (x_end - x, y_end - y);
            let is_off = |&[x_at, y_at]: &[f64; 2]| ((x_at - x) * v - (y_at - y) * u).abs() > error * u.hypot(v);
            if points[start + 1..end].iter().any(is_off) {
                start = end - 1;
                kept.push(points[start]);
            }
        }
        kept.extend(points.last().filter(|_| points.len() > 1));
        kept
    }

    /// Whether it goes round the material: it is closed, and turns in the negative sense.
    pub fn is_solid(&self) -> bool {
        let area: f64 = self.cells.iter().map(|Cell { ends: [[x, y], [u, v]], .. }| x * v - y * u).sum();
        self.period.is_some() && area < 0.0
    }
}
