//! Centreline of a filament, and distances of points from it.

use std::ops::Range;

use super::super::field::NodeIndex;
use crate::equations::linear::{add, dot, scale, sub, zero};
use crate::equations::{LANES, Lanes, Lanewise, Real};

/// Centreline of one filament.
#[derive(Clone, Copy)]
pub(super) struct Centreline<'a> {
    pub(super) root: NodeIndex,
    /// Nodes of its group in m.
    pub(super) nodes: &'a [[Lanes; 3]],
    pub(super) lane: usize,
    /// Distance along `z` by which it is moved, in m.
    pub(super) shift: f64,
    /// Radii of its segments in m.
    pub(super) radii: &'a [f64],
}

impl Centreline<'_> {
    #[inline(always)]
    pub(super) fn node(&self, k: usize) -> [f64; 3] {
        let [x, y, z] = at_lane(self.nodes[k], self.lane);
        [x, y, z + self.shift]
    }

    /// Returns all nodes, from the root.
    pub(super) fn all(&self) -> impl Iterator<Item = [f64; 3]> + Clone {
        (0..self.nodes.len()).map(|k| self.node(k))
    }

    /// Returns in each lane the node `steps` outwards from the inner end of one of `segments`.
    #[inline(always)]
    pub(super) fn nodes(&self, segments: &[usize; LANES], steps: usize) -> [Lanes; 3] {
        let mut nodes: [Lanes; 3] = zero();
        for lane in 0..LANES {
            let [x, y, z] = self.node(segments[lane] + steps);
            nodes[0].0[lane] = x;
            nodes[1].0[lane] = y;
            nodes[2].0[lane] = z;
        }
        nodes
    }

    /// Returns the points of a block in m.
    #[inline(always)]
    pub(super) fn points(&self, stations: &Stations) -> [Lanes; 3] {
        let inner = self.nodes(&stations.segments, 0);
        let outer = self.nodes(&stations.segments, 1);
        let outer_share = stations.fractions;
        let inner_share = Lanes::from_f64(1.0) - outer_share;
        // As `FilamentPoint::of` computes it.
        add(scale(inner_share, inner), scale(outer_share, outer))
    }

    /// Returns the squares of the distances of points from a segment in m².
    #[inline(always)]
    pub(super) fn squares(&self, x: [Lanes; 3], segment: usize) -> Lanes {
        let splat =
            |[x, y, z]: [f64; 3]| [Lanes::from_f64(x), Lanes::from_f64(y), Lanes::from_f64(z)];
        let (inner, outer) = (self.node(segment), self.node(segment + 1));
        let along = sub(outer, inner);
        let share = Lanes::from_f64(1.0 / dot(along, along));
        let (along, from) = (splat(along), sub(x, splat(inner)));
        let fraction = min(
            (dot(along, from) * share).max(Lanes::ZERO),
            Lanes::from_f64(1.0),
        );
        let offset = sub(from, scale(fraction, along));
        dot(offset, offset)
    }

    /// Returns the squares of the distances of points from the nearest of some segments in m², and
    /// its number.
    #[inline(always)]
    pub(super) fn nearest(&self, x: [Lanes; 3], segments: Range<usize>) -> (Lanes, Lanes) {
        let at = |k: usize| Lanes::from_f64(k as f64);
        let (mut least, mut nearest) = (Lanes::from_f64(f64::INFINITY), at(0));
        for k in segments {
            let squares = self.squares(x, k);
            // Numbers of segments are whole, so that this chooses exactly.
            nearest = nearest + squares.less_than(least) * (at(k) - nearest);
            least = min(least, squares);
        }
        (least, nearest)
    }
}

/// Points of a block, as places on a filament. Lanes that are left over repeat the last point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stations {
    pub(super) segments: [usize; LANES],
    pub(super) fractions: Lanes,
}

impl Stations {
    /// Returns the stations of all blocks.
    pub(super) fn all(segments: usize, points: usize) -> Vec<Self> {
        let count = segments * points;
        let block = |first: usize| {
            let at = |lane: usize| (first + lane).min(count - 1);
            Self {
                segments: std::array::from_fn(|lane| at(lane) / points),
                fractions: Lanes::from_lanes(|lane| {
                    ((at(lane) % points) as f64 + 0.5) / points as f64
                }),
            }
        };
        (0..count).step_by(LANES).map(block).collect()
    }
}

#[inline(always)]
pub(super) fn at_lane([x, y, z]: [Lanes; 3], lane: usize) -> [f64; 3] {
    [x.lane(lane), y.lane(lane), z.lane(lane)]
}

#[inline(always)]
pub(super) fn min(a: Lanes, b: Lanes) -> Lanes {
    -(-a).max(-b)
}

#[inline(always)]
pub(super) fn is_any_less(a: Lanes, b: Lanes) -> bool {
    (0..LANES).fold(false, |any, lane| any | (a.lane(lane) < b.lane(lane)))
}
