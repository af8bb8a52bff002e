//! What the filament meets.

use crate::equations::linear::{dot, scale, sub};
use crate::model::settings::WorkpieceSettings;

/// The point of a workpiece that is nearest to a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Distance along the normal in m; negative means that the node is inside.
    pub gap: f64,
    /// Outward unit normal.
    pub normal: [f64; 3],
    /// Velocity of the workpiece there in m/s.
    pub velocity: [f64; 3],
}

/// The geometry and motion of a workpiece.
pub trait Workpiece {
    /// The surface seen from `position` (m) at `time` (s).
    fn surface(&self, position: [f64; 3], time: f64) -> Surface;
}

/// The outward unit normal; NaN if the settings state none.
pub fn unit_normal(settings: &WorkpieceSettings) -> [f64; 3] {
    // Scaled by the largest component first, so that squares neither overflow nor vanish.
    let largest = settings.normal.iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
    let normal = settings.normal.map(|component| component / largest);
    scale(1.0 / dot(normal, normal).sqrt(), normal)
}

/// A plane that moves without turning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    point: [f64; 3],
    normal: [f64; 3],
    velocity: [f64; 3],
}

impl Plane {
    /// The plane through `point` (m, at time zero) with the outward `normal` (of any length), moving at `velocity`
    /// (m/s).
    pub fn new(point: [f64; 3], normal: [f64; 3], velocity: [f64; 3]) -> Self {
        Self { point, normal: scale(1.0 / dot(normal, normal).sqrt(), normal), velocity }
    }

    /// The plane of `settings` that a tool of radius `R` (m) enters by `a_e` (m).
    ///
    /// MODEL, "Contact": `y = −(R − a_e)`, moving along `x`. For a general normal `n`, the undeformed tips come as
    /// deep as `a_e` below the plane, measured along `n`, and the feed is along `n × z`.
    pub fn of(settings: &WorkpieceSettings, tool_radius: f64, penetration_depth: f64) -> Self {
        let normal = unit_normal(settings);
        let [x, y, _] = normal;
        let across = x.hypot(y);
        let reach = tool_radius * across;
        let feed = scale(settings.feed_velocity_m_s / across, [y, -x, 0.0]);
        Self::new(scale(-(reach - penetration_depth), normal), normal, feed)
    }
}

impl Workpiece for Plane {
    #[inline]
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let offset = sub(position, self.point);
        let gap = dot(self.normal, offset) - time * dot(self.normal, self.velocity);
        Surface { gap, normal: self.normal, velocity: self.velocity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_plane_is_the_models() {
        let plane = Plane::of(&WorkpieceSettings { feed_velocity_m_s: 0.25, ..Default::default() }, 0.18, 0.001);
        let surface = plane.surface([0.3, -0.1795, -0.2], 7.0);
        assert!((surface.gap + 0.0005).abs() < 1e-16, "{surface:?}");
        assert_eq!(surface.normal, [0.0, 1.0, 0.0]);
        assert_eq!(surface.velocity, [0.25, 0.0, 0.0]);
    }

    #[test]
    fn tips_reach_the_depth_below_a_tilted_plane() {
        let settings = WorkpieceSettings { normal: [3.0, 4.0, 2.0], ..Default::default() };
        let plane = Plane::of(&settings, 0.18, 0.002);
        let deepest = (0..100_000)
            .map(|i| f64::from(i) * 1e-4)
            .map(|angle| plane.surface([0.18 * angle.cos(), 0.18 * angle.sin(), 0.0], 0.0).gap);
        assert!((deepest.fold(f64::INFINITY, f64::min) + 0.002).abs() < 1e-9);
    }
}
