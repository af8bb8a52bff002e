//! A filament that turns rigidly with its tool: where it first touches, and how deeply.

use std::f64::consts::TAU;

use super::super::equilibrium::RigidShape;
use super::super::filament::Filament;
use crate::contact::Approach;
use crate::equations::linear::{add, scale};
use crate::equations::{Chain, Clamp, PolarAxis, sin_cos};
use crate::tool::{Tool, Turning};
use crate::workpiece::Workpiece;

/// Largest difference in rad of angles of the same touch.
pub(super) const ANGLE_TOLERANCE_RAD: f64 = 1e-9;
/// Smallest step in rad between checked angles of a rigidly turning filament: its step while it
/// touches.
const MIN_ANGLE_STEP_RAD: f64 = 1e-3;

/// Filament that turns rigidly with its tool, above the workpiece as it is at time zero.
pub(super) struct Rigid<'a, T, W> {
    pub(super) filament: &'a Filament<Turning<T>, W>,
    /// Shape of the filament; `None` if it is relaxed.
    pub(super) shape: Option<&'a RigidShape>,
}

impl<T: Tool, W: Workpiece> Rigid<'_, T, W> {
    /// Returns the coordinates of the segments about `z` at the `angle` of the tool (rad), and
    /// their rates.
    pub(super) fn coordinates(&self, angle: f64) -> (Vec<[f64; 2]>, [f64; 2]) {
        let Turning { tool, rate, .. } = &self.filament.motion;
        match self.shape {
            Some(shape) => (shape.at(angle).collect(), [0.0, *rate]),
            None => {
                let [q, v] = tool.undeformed(angle, *rate);
                (self.filament.chain.relaxed(q).collect(), v)
            }
        }
    }

    /// Returns the clearance of nodes and centreline in m at the `angle` of the tool (rad),
    /// negative if they touch. The second value is the largest distance of a node from the axis in
    /// m.
    fn clearance(&self, angle: f64) -> [f64; 2] {
        let Filament { chain, motion, .. } = self.filament;
        let (q, v) = self.coordinates(angle);
        let mut nodes = vec![[motion.tool.clamp(angle, motion.rate).position, [0.0; 3]]];
        let mut farthest = 0.0_f64;
        for (k, q) in q.into_iter().enumerate() {
            let [direction, ..] = PolarAxis::Z.direction([q, v, [0.0; 2]]);
            nodes.push([add(nodes[k][0], scale(chain.length, direction)), [0.0; 3]]);
            let [x, y, _] = nodes[k + 1][0];
            farthest = farthest.max(x.hypot(y));
        }
        let clear = (0..self.filament.contacts()).map(|contact| {
            let touch = self.filament.touch(contact, &|node| nodes[node], None, 0.0);
            let Approach {
                penetration,
                margin,
                ..
            } = touch.approach;
            if margin > 0.0 {
                -penetration
            } else {
                (-penetration).max(0.0)
            }
        });
        [clear.fold(f64::INFINITY, f64::min), farthest]
    }

    /// Returns the angle in rad before `entry` at which the filament first touches the workpiece,
    /// after it was free for the angle `lead`. Returns `None` if there is no such angle up to
    /// `farthest`.
    pub(super) fn early_touch(&self, entry: f64, lead: f64, farthest: f64) -> Option<f64> {
        let clearance = |early: f64| self.clearance(entry - early);
        let (mut early, mut touched) = (0.0, None);
        loop {
            let [clear, radius] = clearance(early);
            if clear < 0.0 {
                touched = Some(early);
                if early > farthest {
                    return None;
                }
            } else if early - touched.unwrap_or(0.0) >= lead {
                break;
            }
            // A gap changes by at most twice the way.
            early +=
                (clear / (2.0 * radius)).clamp(MIN_ANGLE_STEP_RAD, MIN_ANGLE_STEP_RAD.max(lead));
        }
        let Some(touched) = touched else {
            return Some(0.0);
        };
        let (mut low, mut high) = (touched, touched + MIN_ANGLE_STEP_RAD);
        while high - low > ANGLE_TOLERANCE_RAD {
            let middle = (low + high) / 2.0;
            if clearance(middle)[0] < 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
        Some(high)
    }

    /// Returns the largest penetration in a turn, in m; negative if the filament does not touch.
    pub(super) fn depth(&self) -> f64 {
        const CHECKED_ANGLES: usize = 256;
        let clear =
            (0..CHECKED_ANGLES).map(|i| self.clearance(TAU * i as f64 / CHECKED_ANGLES as f64)[0]);
        -clear.fold(f64::INFINITY, f64::min)
    }
}

/// Returns the largest angles about the tool axis, in rad, by which nodes of a relaxed filament are
/// ahead of a straight one and behind it.
pub(super) fn reach_around(clamp: &Clamp<f64>, chain: &Chain<f64>) -> [f64; 2] {
    let ([mut x, mut y, _], [direction_x, direction_y, _]) = (clamp.position, clamp.direction);
    let ([mut straight_x, mut straight_y], mut inclination) = ([x, y], 0.0);
    let [mut ahead, mut behind] = [0.0_f64; 2];
    for link in &chain.links {
        inclination += link.relaxed_angle.angle();
        let (sin, cos) = sin_cos(inclination);
        x += chain.length * (direction_x * cos - direction_y * sin);
        y += chain.length * (direction_y * cos + direction_x * sin);
        straight_x += chain.length * direction_x;
        straight_y += chain.length * direction_y;
        let angle = (straight_x * y - straight_y * x).atan2(straight_x * x + straight_y * y);
        (ahead, behind) = (ahead.max(angle), behind.max(-angle));
    }
    [ahead, behind]
}
