//! Points with the same tool, speed and depth, found in constant time.

use std::collections::HashMap;

use super::points::{MeasuredPoint, same};

/// The points of a table by tool, speed and depth, to find equal ones in constant time.
///
/// Points are kept in cells somewhat wider than the tolerance of [`same`]. A point equals only
/// those in its own cell and the eight around it, and few different points have room in a cell.
#[derive(Default)]
pub(super) struct Places(pub(super) HashMap<(Option<usize>, [u64; 2]), Vec<usize>>);

impl Places {
    /// Adds the next point, whose position is the number of `points`. Returns the position of the
    /// first of these with the same tool, speed and depth, if there is one.
    pub(super) fn take(&mut self, points: &[MeasuredPoint], point: MeasuredPoint) -> Option<usize> {
        let at = |point: &MeasuredPoint| [point.speed.value(), point.penetration_depth_m];
        let [speed, depth] = at(&point).map(cell);
        let same = |&position: &usize| {
            at(&points[position])
                .iter()
                .zip(at(&point))
                .all(|(a, b)| same(*a, b))
        };
        let around = (speed - 1..=speed + 1)
            .flat_map(|speed| (depth - 1..=depth + 1).map(move |depth| [speed, depth]));
        let first = around
            .filter_map(|key| self.0.get(&(point.tool, key)))
            .flatten()
            .copied()
            .filter(same)
            .min();
        self.0
            .entry((point.tool, [speed, depth]))
            .or_default()
            .push(points.len());
        first
    }
}

/// Returns the number of the cell of a positive number that is not subnormal. The bits of such
/// numbers ascend with the numbers. Leaving out the last 24 of 52 makes cells of 2⁻²⁸ of a power of
/// two.
fn cell(number: f64) -> u64 {
    number.to_bits() >> 24
}
