//! The pose of a tool: the directions of its axes.

use crate::equations::linear::dot;
use crate::equations::sin_cos;
use crate::model::settings::ToolSettings;

/// Pose of a tool: rotation from its own frame, in which it turns about `z`, to the frame of the
/// workpiece (MODEL, "Rotary tools of any kind and pose").
///
/// The solver works in the tool's own frame, in which a tilted tool has the equations of an upright
/// one and the workpiece is tilted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// `R = R_y(σ) R_x(τ)`, by rows.
    rotation: [[f64; 3]; 3],
}

impl Pose {
    /// Pose of a tool whose axis is `z`.
    pub const UPRIGHT: Self = Self {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };

    /// Creates the pose with the tilt `τ` about `x` and the skew `σ` about `y` (rad).
    pub fn new(tilt: f64, skew: f64) -> Self {
        // Turned by whole quarters, a tool has its axis exactly along one of the workpiece's.
        let exact = |(sin, cos): (f64, f64)| {
            let rounded = |part: f64| if part.abs() < f64::EPSILON { 0.0 } else { part };
            (rounded(sin), rounded(cos))
        };
        let ((sin, cos), (sin_skew, cos_skew)) = (exact(sin_cos(tilt)), exact(sin_cos(skew)));
        Self {
            rotation: [
                [cos_skew, sin_skew * sin, sin_skew * cos],
                [0.0, cos, -sin],
                [-sin_skew, cos_skew * sin, cos_skew * cos],
            ],
        }
    }

    /// Returns the pose that settings state.
    pub fn of(tool: &ToolSettings) -> Self {
        let (tilt, skew) = (tool.tilt_rad(), tool.skew_rad);
        if tilt == 0.0 && skew == 0.0 {
            Self::UPRIGHT
        } else {
            Self::new(tilt, skew)
        }
    }

    /// Rotates a vector from the tool's frame to the frame of the workpiece.
    #[inline]
    pub fn from_tool(&self, vector: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| dot(row, vector))
    }

    /// Rotates a vector from the frame of the workpiece to the tool's frame.
    #[inline]
    pub fn to_tool(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [first, second, third] = self.rotation;
        std::array::from_fn(|i| first[i] * x + second[i] * y + third[i] * z)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_tilt_of_a_quarter_turn_points_the_axis_into_the_workpiece() {
        let [x, y, z] = Pose::new(FRAC_PI_2, 0.0).from_tool([0.0, 0.0, 1.0]);
        assert!(x == 0.0 && (y + 1.0).abs() < 1e-15 && z.abs() < 1e-15);
        // R_y(σ) turns z towards x.
        let [x, y, z] = Pose::new(0.0, 0.3).from_tool([0.0, 0.0, 1.0]);
        assert!((x - 0.3_f64.sin()).abs() < 1e-15 && y == 0.0 && (z - 0.3_f64.cos()).abs() < 1e-15);
    }

    #[test]
    fn both_ways_are_inverse() {
        let (pose, vector) = (Pose::new(0.4, -1.1), [0.3, -2.0, 0.7]);
        let back = pose.to_tool(pose.from_tool(vector));
        assert!(
            back.iter()
                .zip(vector)
                .all(|(back, there)| (back - there).abs() < 1e-15),
            "{back:?}"
        );
    }
}
