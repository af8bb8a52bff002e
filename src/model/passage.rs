//! The angles of the tool between which an undeformed filament touches the workpiece.

use std::f64::consts::{PI, TAU};

/// Passage of an undeformed filament over a workpiece as it is at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// Angles of the tool from which the lead angle and the tail angle of a pass count.
    pub window: ContactArc,
    /// Parts of the window in which the filament touches the workpiece: angles from the start of
    /// the window, in rad, ascending.
    pub touches: Vec<[f64; 2]>,
    /// `true` if the filament touches during the whole turn. The window is then one turn.
    pub all_round: bool,
}

impl From<ContactArc> for Passage {
    /// Creates the passage of tips that touch the workpiece throughout the window.
    fn from(window: ContactArc) -> Self {
        Self {
            window,
            touches: vec![[0.0, window.angle]],
            all_round: false,
        }
    }
}

impl Passage {
    /// Creates the passage of a filament that touches during the whole turn, from the angle `start`
    /// (rad) on.
    pub(crate) fn all_round(start: f64) -> Self {
        let window = ContactArc {
            middle: start + PI,
            angle: TAU,
        };
        Self {
            window,
            touches: vec![[0.0, TAU]],
            all_round: true,
        }
    }

    /// Returns the nominal contact angle of all touches in rad.
    pub fn contact_angle(&self) -> f64 {
        self.touches.iter().map(|[start, end]| end - start).sum()
    }
}

/// Angles `β` of a tool between nominal entry and nominal exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactArc {
    /// Half-way between entry and exit, in rad. For a plane the tips are deepest there.
    pub middle: f64,
    /// Nominal contact angle `Ω_c`, from entry to exit, in rad.
    pub angle: f64,
}

impl ContactArc {
    /// Computes the arc of the tips of a round tool on a plane: `Ω_c = 2 arccos((R − a_e)/R)`,
    /// opposite to the normal.
    ///
    /// `reach` is the radius of the tips projected on the normal, and `penetration_depth` is `a_e`,
    /// both in m. The formula is `4 arcsin √(a_e/(2R))`, which keeps its digits at small depths.
    pub fn on_plane(normal: [f64; 3], reach: f64, penetration_depth: f64) -> Self {
        let [x, y, _] = normal;
        Self {
            middle: (-y).atan2(-x),
            angle: 4.0 * (penetration_depth / (2.0 * reach)).sqrt().asin(),
        }
    }

    /// Finds the arc between the first angle at which `gap` (m, by the angle in rad) becomes
    /// negative and the last at which it becomes positive. The turn starts where `gap` is largest.
    /// Returns `None` if `gap` never changes sign.
    ///
    /// Contacts of less than a thousandth of a turn can be missed.
    pub fn find(gap: impl Fn(f64) -> f64) -> Option<Self> {
        const POINTS: usize = 2000;
        let gaps: Vec<f64> = (0..POINTS)
            .map(|i| gap(TAU * i as f64 / POINTS as f64))
            .collect();
        let farthest = (0..POINTS).max_by(|&i, &j| gaps[i].total_cmp(&gaps[j]))?;
        let angle = |step: usize| TAU * (farthest + step) as f64 / POINTS as f64;
        let inside = |step: &usize| gaps[(farthest + step) % POINTS] < 0.0;
        let (first, last) = ((0..POINTS).find(inside)?, (0..POINTS).rfind(inside)?);
        if first == 0 {
            return None;
        }
        let entry = bisect(|angle| gap(angle) < 0.0, angle(first - 1), angle(first));
        let exit = bisect(|angle| gap(angle) >= 0.0, angle(last), angle(last + 1));
        let middle = (entry + exit) / 2.0;
        Some(Self {
            middle: (middle + PI).rem_euclid(TAU) - PI,
            angle: exit - entry,
        })
    }
}

/// Returns the place, to rounding, at which `after` becomes `true` between `low` (`false`) and
/// `high` (`true`).
pub(crate) fn bisect(after: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = (low + high) / 2.0;
        // Also for limits that are not numbers.
        if !(low < middle && middle < high) {
            return high;
        }
        if after(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
}

/// Returns the part of a ramp that is left at the part `u` of its duration, and its derivative.
pub(crate) fn part_left(u: f64) -> [f64; 2] {
    if u >= 1.0 {
        return [0.0; 2];
    }
    // 1 − u³ (10 − 15 u + 6 u²)
    let v = 1.0 - u;
    [
        v * v * v * (1.0 + 3.0 * u + 6.0 * u * u),
        -30.0 * u * u * v * v,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bisection_ends_for_limits_that_are_not_numbers() {
        for high in [f64::NAN, f64::INFINITY] {
            bisect(|_| false, 0.0, high);
        }
        assert!((bisect(|x| x > 0.3, 0.0, 1.0) - 0.3).abs() < 1e-15);
    }
}
