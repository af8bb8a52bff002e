//! Lists of the pieces of a curve that can hold the nearest point, by region of the plane.

use super::bezier::ProfilePoint;
use crate::equations::linear::{add, dot, scale, sub};

/// Extent of a piece of the curve: a disc that holds all of it, and points on it.
pub(super) struct Extent {
    pub centre: ProfilePoint,
    pub radius: f64,
    pub points: [ProfilePoint; 2],
}

/// Largest length of a list whose block of cells is not divided.
const MAX_UNDIVIDED_LIST: usize = 2;

/// Squares about the curve, each twice as wide as the one inside it, each cut into cells. A cell
/// lists every piece that is nearest to some point of the cell. Cells grow with the distance, as do
/// the regions over which the nearest pieces stay the same.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    centre: ProfilePoint,
    /// Half the width of the inmost square, in m.
    half: f64,
    /// Cells along a side of the inmost square.
    fine: usize,
    /// Start and end of the list of each cell. Cells share lists.
    ranges: Vec<[u32; 2]>,
    lists: Vec<u32>,
    /// All pieces, for points outside all squares.
    all: Vec<u32>,
}

impl Grid {
    /// The outmost square is 128 times as wide as the inmost.
    const SQUARES: usize = 8;

    /// Cells along a side of the other squares.
    const COARSE: usize = 32;

    /// Creates the grid of the pieces in the box from `low` to `high`.
    pub fn new(pieces: &[Extent], [low, high]: [ProfilePoint; 2]) -> Self {
        let centre = scale(0.5, add(low, high));
        // Filaments come from outside the box.
        let half = 0.625 * (high[0] - low[0]).max(high[1] - low[1]);
        let fine = pieces.len().next_power_of_two().clamp(Self::COARSE, 256);
        let all: Vec<u32> = (0..pieces.len() as u32).collect();
        let ranges = vec![[0, 0]; fine * fine + (Self::SQUARES - 1) * Self::COARSE * Self::COARSE];
        let mut grid = Self {
            centre,
            half,
            fine,
            ranges,
            lists: Vec::new(),
            all: all.clone(),
        };
        for square in 0..Self::SQUARES {
            let (_, cells) = grid.layout(square);
            let width = 2.0 * half * f64::from(1 << square);
            let corner = sub(centre, [width / 2.0; 2]);
            let block = Block {
                square,
                index: [0, 0],
                count: cells,
                corner,
                cell: width / cells as f64,
            };
            grid.fill(&block, &all, pieces);
        }
        grid
    }

    /// Returns the pieces of which one is nearest to `point`, in ascending order; never none.
    #[inline]
    pub fn candidates(&self, point: ProfilePoint) -> &[u32] {
        let [x, y] = scale(1.0 / self.half, sub(point, self.centre));
        let distance = x.abs().max(y.abs());
        // The exponent of a float says between which powers of two it lies.
        let square = if distance < 1.0 {
            0
        } else {
            (distance.to_bits() >> 52) as usize - 1022
        };
        if square >= Self::SQUARES {
            return &self.all;
        }
        let (first, cells) = self.layout(square);
        let shrink = 1.0 / f64::from(1 << square);
        let index = |coordinate: f64| {
            ((0.5 * (coordinate * shrink + 1.0) * cells as f64) as usize).min(cells - 1)
        };
        let [start, end] = self.ranges[first + index(y) * cells + index(x)];
        &self.lists[start as usize..end as usize]
    }

    /// Returns the number of the first cell of a square, and its cells along a side.
    #[inline]
    fn layout(&self, square: usize) -> (usize, usize) {
        match square {
            0 => (0, self.fine),
            _ => (
                self.fine * self.fine + (square - 1) * Self::COARSE * Self::COARSE,
                Self::COARSE,
            ),
        }
    }

    /// Writes the lists of the cells of `block`, whose nearest pieces are all in `candidates`.
    fn fill(&mut self, block: &Block, candidates: &[u32], pieces: &[Extent]) {
        let [column, row] = block.index;
        let low = add(
            block.corner,
            [block.cell * column as f64, block.cell * row as f64],
        );
        let kept = visible(low, block.cell * block.count as f64, candidates, pieces);
        if block.count > 1 && kept.len() > MAX_UNDIVIDED_LIST {
            let count = block.count / 2;
            for index in [
                [column, row],
                [column + count, row],
                [column, row + count],
                [column + count, row + count],
            ] {
                self.fill(
                    &Block {
                        index,
                        count,
                        ..*block
                    },
                    &kept,
                    pieces,
                );
            }
            return;
        }
        let start = self.lists.len() as u32;
        self.lists.extend(kept);
        let range = [start, self.lists.len() as u32];
        let (first, cells) = self.layout(block.square);
        for row in row..row + block.count {
            let cell = first + row * cells + column;
            self.ranges[cell..cell + block.count].fill(range);
        }
    }
}

/// A square block of cells.
struct Block {
    /// Number of the square, from the inmost.
    square: usize,
    /// Column and row of its first cell.
    index: [usize; 2],
    /// Cells along a side.
    count: usize,
    /// Lower corner of the first cell of the square, in m.
    corner: ProfilePoint,
    /// Width of a cell in m.
    cell: f64,
}

/// Returns those `candidates` that can be nearest to a point of the square from `low`, `width` (m)
/// wide.
///
/// A point `q` of the curve is nearer to `p` than the disc of radius `r` about `c` if `|p − c| ≥ |p
/// − q| + r`. Such points `p` are inside a branch of a hyperbola. That region is convex: it holds a
/// square if it holds its corners.
fn visible(low: ProfilePoint, width: f64, candidates: &[u32], pieces: &[Extent]) -> Vec<u32> {
    let square = |point: ProfilePoint, from: ProfilePoint| {
        let offset = sub(point, from);
        dot(offset, offset)
    };
    let centre = add(low, [width / 2.0; 2]);
    let points = candidates
        .iter()
        .flat_map(|&candidate| pieces[candidate as usize].points);
    let nearest = points
        .min_by(|&a, &b| square(a, centre).total_cmp(&square(b, centre)))
        .unwrap_or(centre);
    let corners = [
        low,
        add(low, [width, 0.0]),
        add(low, [0.0, width]),
        add(low, [width, width]),
    ];
    let distances = corners.map(|corner| square(corner, nearest).sqrt());
    let seen = |candidate: &u32| {
        let Extent { centre, radius, .. } = pieces[*candidate as usize];
        // A little more than the distance, so that rounding drops nothing: the cells are open to
        // points on their sides.
        corners.iter().zip(distances).any(|(&corner, distance)| {
            square(corner, centre).sqrt() < distance * (1.0 + 1e-12) + radius * (1.0 + 1e-9)
        })
    };
    candidates
        .iter()
        .copied()
        .filter(|candidate| seen(candidate))
        .collect()
}
