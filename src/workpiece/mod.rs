//! Workpieces: the surface that a filament meets, and where the undeformed tool touches it.
//!
//! [`Plane`] is the workpiece of the settings; implement [`Workpiece`] for another, and pass it to
//! [`Pass::with`](crate::simulation::Pass::with).

use std::f64::consts::{PI, TAU};

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
///
/// The tool turns about the `z` axis of the frame, in the positive direction.
pub trait Workpiece {
    /// The surface seen from `position` (m) at `time` (s). The normal should be continuous where filaments touch.
    ///
    /// The gap is a distance: it must not change by more than twice the way that a position goes relative to the workpiece.
    /// Nodes that are too far away to arrive are not looked at in every step.
    fn surface(&self, position: [f64; 3], time: f64) -> Surface;

    /// True if nothing about the surface depends on `z`: neither gap nor normal, and normal and velocity have no component along
    /// it. The filaments of a [planar tool](crate::tool::Tool::is_planar) are then simulated in the plane of rotation.
    ///
    /// The default is false, which is always right.
    fn is_planar(&self) -> bool {
        false
    }

    /// True if the workpiece moves without turning or deforming: [`Surface::velocity`] is the same everywhere. The search for
    /// contact events then leaves out nodes that are far away.
    ///
    /// The default is false, which is always right.
    fn translates(&self) -> bool {
        false
    }

    /// The angles of the tool between which its undeformed tips touch the workpiece as it is at time zero; none if they
    /// never touch, or touch all the time. `tip` gives the position of a tip in m by the angle `β` in rad.
    ///
    /// The default searches a full turn (see [`ContactArc::find`]). A workpiece that knows the arc can state it exactly.
    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        ContactArc::find(|angle| self.surface(tip(angle), 0.0).gap)
    }
}

/// The angles `β` of a tool between nominal entry and nominal exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactArc {
    /// Half-way between entry and exit, in rad. For a plane the tips are deepest there.
    pub middle: f64,
    /// The nominal contact angle `Ω_c`, from entry to exit, in rad.
    pub angle: f64,
}

impl ContactArc {
    /// The arc of the tips of a round tool on a plane: `Ω_c = 2 arccos((R − a_e)/R)`, opposite to the normal.
    ///
    /// `reach` is the radius of the tips as the normal sees it, and `penetration_depth` is `a_e`, both in m. Computed as
    /// `4 arcsin √(a_e/(2R))`, which keeps its digits at small depths.
    pub fn on_plane(normal: [f64; 3], reach: f64, penetration_depth: f64) -> Self {
        let [x, y, _] = normal;
        Self { middle: (-y).atan2(-x), angle: 4.0 * (penetration_depth / (2.0 * reach)).sqrt().asin() }
    }

    /// The arc from the first angle at which `gap` (m, by the angle in rad) becomes negative to the last at which it
    /// becomes positive again, in the turn that starts where it is largest. None if it never changes sign.
    ///
    /// Contacts of less than a thousandth of a turn can be missed.
    pub fn find(gap: impl Fn(f64) -> f64) -> Option<Self> {
        const POINTS: usize = 2000;
        let gaps: Vec<f64> = (0..POINTS).map(|i| gap(TAU * i as f64 / POINTS as f64)).collect();
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
        Some(Self { middle: (middle + PI).rem_euclid(TAU) - PI, angle: exit - entry })
    }
}

/// Where `after` becomes true between `low`, where it is false, and `high`, where it is true; to rounding.
fn bisect(after: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = (low + high) / 2.0;
        if middle <= low || middle >= high {
            return high;
        }
        if after(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
}

/// The outward unit normal; NaN if the settings state none.
pub fn unit_normal(settings: &WorkpieceSettings) -> [f64; 3] {
    // Scaled by the largest component first, so that squares neither overflow nor vanish.
    let largest = settings.normal.iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
    let normal = settings.normal.map(|component| component / largest);
    scale(1.0 / dot(normal, normal).sqrt(), normal)
}

/// Radius in m of the undeformed tips of a tool of the radius `tool_radius` (m) as the normal of the workpiece sees it:
/// `R` for a normal across the axis.
pub fn reach(settings: &WorkpieceSettings, tool_radius: f64) -> f64 {
    let [x, y, _] = unit_normal(settings);
    tool_radius * x.hypot(y)
}

/// A plane that moves without turning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    point: [f64; 3],
    normal: [f64; 3],
    velocity: [f64; 3],
    /// Where the tips of the tool that it was made for touch it.
    arc: Option<ContactArc>,
}

impl Plane {
    /// The plane through `point` (m, at time zero) with the outward `normal` (of any length), moving at `velocity`
    /// (m/s).
    pub fn new(point: [f64; 3], normal: [f64; 3], velocity: [f64; 3]) -> Self {
        Self { point, normal: scale(1.0 / dot(normal, normal).sqrt(), normal), velocity, arc: None }
    }

    /// The plane of `settings` that a round tool of the radius `tool_radius` (m) enters by `penetration_depth` (m).
    ///
    /// MODEL, "Contact": `y = −(R − a_e)`, moving along `x`. For a general normal `n`, the undeformed tips come as
    /// deep as `a_e` below the plane, measured along `n`, and the feed is along `n × z`.
    pub fn of(settings: &WorkpieceSettings, tool_radius: f64, penetration_depth: f64) -> Self {
        let normal = unit_normal(settings);
        let [x, y, _] = normal;
        let across = x.hypot(y);
        let reach = reach(settings, tool_radius);
        let feed = scale(settings.feed_velocity_m_s / across, [y, -x, 0.0]);
        let plane = Self::new(scale(-(reach - penetration_depth), normal), normal, feed);
        Self { arc: Some(ContactArc::on_plane(settings.normal, reach, penetration_depth)), ..plane }
    }
}

impl Workpiece for Plane {
    #[inline]
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let offset = sub(position, self.point);
        let gap = dot(self.normal, offset) - time * dot(self.normal, self.velocity);
        Surface { gap, normal: self.normal, velocity: self.velocity }
    }

    fn is_planar(&self) -> bool {
        self.normal[2] == 0.0 && self.velocity[2] == 0.0
    }

    fn translates(&self) -> bool {
        true
    }

    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        self.arc.or_else(|| ContactArc::find(|angle| self.surface(tip(angle), 0.0).gap))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_3;

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

    #[test]
    fn arcs_are_found_as_they_are_stated() {
        for (normal, depth) in [([0.0, 1.0, 0.0], 0.001), ([1.0, 2.0, 0.0], 0.005), ([-3.0, -0.1, 1.0], 1e-4)] {
            let settings = WorkpieceSettings { normal, ..Default::default() };
            let plane = Plane::of(&settings, 0.18, depth);
            let tip = |angle: f64| [0.18 * angle.cos(), 0.18 * angle.sin(), 0.0];
            let stated = plane.contact_arc(&tip).expect("the tips touch");
            let found = Plane { arc: None, ..plane }.contact_arc(&tip).expect("the tips touch");
            assert!(
                (stated.angle - found.angle).abs() < 1e-11 && (stated.middle - found.middle).abs() < 1e-11,
                "{found:?}"
            );
        }
    }

    #[test]
    fn an_arc_goes_from_the_first_touch_to_the_last() {
        let two = |angle: f64| (0.5 - (angle - 3.0).cos()).max(0.2 - (4.0 * (angle - 3.0)).cos().abs());
        let arc = ContactArc::find(two).expect("it touches");
        assert!((arc.middle - 3.0).abs() < 1e-9 && (arc.angle - 2.0 * FRAC_PI_3).abs() < 1e-6, "{arc:?}");
        assert_eq!(ContactArc::find(|_| 1.0), None);
        assert_eq!(ContactArc::find(|_| -1.0), None);
    }
}
