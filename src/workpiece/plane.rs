//! A plane that moves without turning.

use super::{ProfileCells, Surface, Workpiece};
use crate::equations::linear::{add, dot, scale, sub};
use crate::model::settings::{WorkpieceSettings, unit_normal};

/// A plane that moves without turning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    point: [f64; 3],
    normal: [f64; 3],
    velocity: [f64; 3],
}

impl Plane {
    /// Creates the plane through `point` (m, at time zero) with the outward `normal` (of any
    /// length), moving at `velocity` (m/s).
    pub fn new(point: [f64; 3], normal: [f64; 3], velocity: [f64; 3]) -> Self {
        Self {
            point,
            normal: scale(1.0 / dot(normal, normal).sqrt(), normal),
            velocity,
        }
    }

    /// Creates the plane of `settings` at the distance `distance` (m) from the origin.
    ///
    /// MODEL, "Contact": `y = −(R − a_e)`, moving along `x`. For a general normal `n`, the distance
    /// is measured along `n`, and the feed is along `n × z`, or along `x` where `n` is along `z`.
    pub fn of(settings: &WorkpieceSettings, distance: f64) -> Self {
        let normal = unit_normal(settings);
        let [x, y, _] = normal;
        let across = x.hypot(y);
        let along = if across > 0.0 {
            [y, -x, 0.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        let feed = scale(
            settings.feed_velocity_m_s / if across > 0.0 { across } else { 1.0 },
            along,
        );
        Self::new(scale(-distance, normal), normal, feed)
    }
}

impl Plane {
    /// Returns its line at `z = 0`, at time zero: the point nearest to the axis, and the direction
    /// with the material on the right-hand side. `None` for a plane across the axis.
    fn line(&self) -> Option<[[f64; 2]; 2]> {
        let [x, y, _] = self.normal;
        let across = x.hypot(y);
        let foot = dot(self.normal, self.point) / (across * across);
        (across > 0.0).then(|| [[foot * x, foot * y], [y / across, -x / across]])
    }
}

impl Workpiece for Plane {
    #[inline]
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let offset = sub(position, self.point);
        let gap = dot(self.normal, offset) - time * dot(self.normal, self.velocity);
        Surface::flat(gap, self.normal, self.velocity)
    }

    fn is_planar(&self) -> bool {
        self.normal[2] == 0.0 && self.velocity[2] == 0.0
    }

    fn translates(&self) -> bool {
        true
    }

    fn largest_curvatures(&self) -> [f64; 2] {
        [0.0; 2]
    }

    fn profile(&self, reach: f64, longest: f64) -> Option<ProfileCells> {
        let [foot, direction] = self.line()?;
        let half = (reach * reach - dot(foot, foot)).max(0.0).sqrt();
        let mut profile = ProfileCells::default();
        profile.extend([-half, half], [1.0, longest], false, |length| {
            add(foot, scale(length, direction))
        });
        Some(profile)
    }

    fn arc_length(&self, position: [f64; 3], time: f64) -> Option<f64> {
        let [_, direction] = self.line()?;
        let [x, y, _] = sub(position, scale(time, self.velocity));
        Some(dot(direction, [x, y]))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_3;

    use super::*;
    use crate::model::settings::WorkpieceKind;
    use crate::workpiece::ContactArc;

    #[test]
    fn default_plane_is_the_models() {
        let plane = Plane::of(
            &WorkpieceSettings {
                feed_velocity_m_s: 0.25,
                ..Default::default()
            },
            0.18 - 0.001,
        );
        let surface = plane.surface([0.3, -0.1795, -0.2], 7.0);
        assert!((surface.gap + 0.0005).abs() < 1e-16, "{surface:?}");
        assert_eq!(surface.normal, [0.0, 1.0, 0.0]);
        assert_eq!(surface.velocity, [0.25, 0.0, 0.0]);
    }

    #[test]
    fn tips_reach_the_depth_below_a_tilted_plane() {
        let kind = WorkpieceKind::plane([3.0, 4.0, 2.0]);
        let settings = WorkpieceSettings {
            kind,
            ..Default::default()
        };
        let plane = Plane::of(&settings, 0.18 * (25.0_f64 / 29.0).sqrt() - 0.002);
        let deepest = (0..100_000).map(|i| f64::from(i) * 1e-4).map(|angle| {
            plane
                .surface([0.18 * angle.cos(), 0.18 * angle.sin(), 0.0], 0.0)
                .gap
        });
        assert!((deepest.fold(f64::INFINITY, f64::min) + 0.002).abs() < 1e-9);
    }

    #[test]
    fn arcs_are_found_as_they_are_stated() {
        for (normal, depth) in [
            ([0.0, 1.0, 0.0], 0.001),
            ([1.0, 2.0, 0.0], 0.005),
            ([-3.0, -0.1, 1.0], 1e-4),
        ] {
            let settings = WorkpieceSettings {
                kind: WorkpieceKind::plane(normal),
                ..Default::default()
            };
            let [x, y, _] = unit_normal(&settings);
            let reach = 0.18 * x.hypot(y);
            let plane = Plane::of(&settings, reach - depth);
            let tip = |angle: f64| [0.18 * angle.cos(), 0.18 * angle.sin(), 0.0];
            let stated = ContactArc::on_plane(normal, reach, depth);
            let found = plane.contact_arc(&tip).expect("the tips touch");
            assert!(
                (stated.angle - found.angle).abs() < 1e-11
                    && (stated.middle - found.middle).abs() < 1e-11,
                "{found:?}"
            );
        }
    }

    #[test]
    fn an_arc_goes_from_the_first_touch_to_the_last() {
        let two =
            |angle: f64| (0.5 - (angle - 3.0).cos()).max(0.2 - (4.0 * (angle - 3.0)).cos().abs());
        let arc = ContactArc::find(two).expect("it touches");
        assert!(
            (arc.middle - 3.0).abs() < 1e-9 && (arc.angle - 2.0 * FRAC_PI_3).abs() < 1e-6,
            "{arc:?}"
        );
        assert_eq!(ContactArc::find(|_| 1.0), None);
        assert_eq!(ContactArc::find(|_| -1.0), None);
    }
}
