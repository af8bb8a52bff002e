//! Bounding volumes of filaments, and their sort and sweep.

use std::f64::consts::{PI, TAU};

use crate::equations::linear::{add, dot, scale};

/// Bounding volume of a filament and its vicinity: an interval of angles about `z`, and one of `z`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) filament: usize,
    /// Start of the angles in rad, within a turn.
    pub(super) start: f64,
    /// Width of the angles in rad; a turn near the axis.
    pub(super) width: f64,
    /// Interval of `z` in m.
    pub(super) axial: [f64; 2],
}

impl Bounds {
    /// Widens the angles to a whole turn.
    pub(super) fn all_around(self) -> Self {
        Self {
            start: 0.0,
            width: TAU,
            ..self
        }
    }

    /// Returns the bounds of a filament. Two filaments can only be nearer to each other than `near`
    /// (m) if their bounds overlap.
    pub(super) fn of(
        filament: usize,
        nodes: impl Iterator<Item = [f64; 3]> + Clone,
        near: f64,
    ) -> Self {
        let axial = nodes.clone().fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[low, high], [_, _, z]| [low.min(z), high.max(z)],
        );
        let mut nodes_around = nodes.clone();
        let [x, y, _] = nodes_around.next().expect("a filament has nodes");
        let (start, mut angle, mut before) = (y.atan2(x), [0.0_f64; 2], [x, y]);
        let (mut turned, mut least) = (0.0, x.hypot(y));
        for [x, y, _] in nodes_around {
            // The axis may be nearest to the inside of a segment.
            let along = [x - before[0], y - before[1]];
            let fraction = -dot(before, along) / dot(along, along);
            let [x_near, y_near] = add(before, scale(fraction.clamp(0.0, 1.0), along));
            least = least.min(x_near.hypot(y_near));
            turned += (before[0] * y - before[1] * x).atan2(before[0] * x + before[1] * y);
            angle = [angle[0].min(turned), angle[1].max(turned)];
            before = [x, y];
        }
        // If two points are nearer than `near`, the sine of the angle between them is below its
        // share of the smaller radius. The NaN of a vertical segment drops out of the minimum.
        let share = near / least;
        let pad = 0.5 * share.asin();
        let bounds = Self {
            filament,
            start: (start + angle[0] - pad).rem_euclid(TAU),
            width: angle[1] - angle[0] + 2.0 * pad,
            axial: [axial[0] - 0.5 * near, axial[1] + 0.5 * near],
        };
        if share < 0.9 && angle[1] - angle[0] < PI {
            bounds
        } else {
            bounds.all_around()
        }
    }

    /// Returns the periodic images of `other` that overlap along `z`. A filament meets its own
    /// images, but not itself.
    pub(super) fn images(&self, other: &Self, period: Option<f64>) -> impl Iterator<Item = i16> {
        let [first, last] = [
            self.axial[0] - other.axial[1],
            self.axial[1] - other.axial[0],
        ];
        let images = match period {
            Some(period) => (first / period).ceil() as i16..(last / period + 1.0).floor() as i16,
            None => 0..i16::from(first <= 0.0 && last >= 0.0),
        };
        let is_own = self.filament == other.filament;
        images.filter(move |image| !is_own || *image != 0)
    }
}

/// Calls `take` once with each pair whose angles overlap, also of a filament with itself.
pub(super) fn for_each_close(bounds: &mut [Bounds], mut take: impl FnMut(&Bounds, &Bounds)) {
    bounds.sort_unstable_by(|a, b| a.start.total_cmp(&b.start));
    let count = bounds.len();
    for (index, own) in bounds.iter().enumerate() {
        take(own, own);
        for ahead in 1..count {
            let other = &bounds[(index + ahead) % count];
            let turn = if index + ahead < count { 0.0 } else { TAU };
            let between = other.start + turn - own.start;
            if between > own.width {
                break;
            }
            // Around the circle a pair may be met from both sides.
            let is_met_again = TAU - between <= other.width && other.filament < own.filament;
            if !is_met_again {
                take(own, other);
            }
        }
    }
}
