//! Workpieces: the surface that a filament meets, and where the undeformed tool touches it.
//!
//! [`Part`] is the workpiece of the settings; implement [`Workpiece`] for another, and pass it to
//! [`Pass::with`](crate::simulation::Pass::with).
//!
//! A workpiece has faces and edges. Faces are curved so little that the nodes of a filament meet them. Edges are convex arcs
//! with radii that are not large against a segment, and are met by the centreline.

use std::f64::consts::{PI, TAU};

use crate::equations::linear::dot;

mod outline;
mod part;
mod plane;
mod profile;
mod spline;

pub use outline::Outline;
pub use part::Part;
pub use plane::{Plane, reach, unit_normal};
pub use profile::{Cell, Profile};
pub use spline::{Foot, Spline, SplineError};

/// The point of a workpiece that is nearest to a point of the filament.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Distance along the normal in m; negative means that the node is inside.
    pub gap: f64,
    /// Outward unit normal.
    pub normal: [f64; 3],
    /// Velocity of the workpiece there in m/s.
    pub velocity: [f64; 3],
    /// By how much the normal turns, in the plane of rotation, per length that the point goes across it, in rad/m: `κ/(1 + κ g)`
    /// with the curvature `κ` of the surface, positive where it is convex, and the gap `g`. Zero on a plane.
    pub turn: f64,
    /// How far the point is from where it no longer meets this surface, because the nearest point of the workpiece is on an edge,
    /// in m; negative beyond. Infinite where there is no edge.
    pub margin: f64,
}

impl Surface {
    /// The surface of a plane without edges.
    pub fn flat(gap: f64, normal: [f64; 3], velocity: [f64; 3]) -> Self {
        Self { gap, normal, velocity, turn: 0.0, margin: f64::INFINITY }
    }
}

/// A convex edge of a workpiece: an arc in the plane of rotation, extruded along `z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Centre of the arc at time zero in m.
    pub centre: [f64; 2],
    /// Its radius in m.
    pub radius: f64,
    /// The outward unit normals at its ends. The arc goes from the first to the second in the positive sense, by less than half a
    /// turn. `None` for a whole circle.
    pub ends: Option<[[f64; 2]; 2]>,
    /// Velocity of the workpiece in m/s.
    pub velocity: [f64; 3],
}

impl Edge {
    /// The centre at `time` (s) in m.
    pub fn centre_at(&self, time: f64) -> [f64; 2] {
        let ([x, y], [x_rate, y_rate, _]) = (self.centre, self.velocity);
        [x + time * x_rate, y + time * y_rate]
    }

    /// The angle of the arc in rad.
    pub fn angle(&self) -> f64 {
        self.ends.map_or(TAU, |[first, second]| cross(first, second).atan2(dot(first, second)))
    }

    /// The part of the arc's angle that lies before the unit vector `normal`, from 0 to 1.
    pub fn fraction(&self, [x, y, _]: [f64; 3]) -> f64 {
        let [first, _] = self.ends.unwrap_or([[-1.0, 0.0]; 2]);
        let from_first = cross(first, [x, y]).atan2(dot(first, [x, y]));
        let from_first = if self.ends.is_none() { from_first.rem_euclid(TAU) } else { from_first };
        (from_first / self.angle()).clamp(0.0, 1.0)
    }

    /// How far a point is inside the arc's angle, as the distance from the nearer of its sides, in m; negative outside. `offset`
    /// is its position relative to the centre, in m.
    pub fn margin(&self, offset: [f64; 2]) -> f64 {
        let Some([first, second]) = self.ends else { return f64::INFINITY };
        cross(first, offset).min(cross(offset, second))
    }
}

/// `a × b`: the sine of the angle from `a` to `b`, times their lengths.
fn cross([x, y]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    x * v - y * u
}

/// The geometry and motion of a workpiece.
///
/// The tool turns about the `z` axis of the frame, in the positive direction.
pub trait Workpiece {
    /// The face seen from the node at `position` (m) at `time` (s). The normal should be continuous where filaments touch.
    ///
    /// The gap is a distance: it must not change by more than twice the way that a position goes relative to the workpiece.
    /// Nodes that are too far away to arrive are not looked at in every step.
    fn surface(&self, position: [f64; 3], time: f64) -> Surface;

    /// The edges.
    ///
    /// By default there are none.
    fn edges(&self) -> &[Edge] {
        &[]
    }

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

    /// The outline in the plane of rotation within the distance `reach` (m) of the tool axis, if that is all there is to the
    /// workpiece: a profile extruded along `z`.
    ///
    /// By default there is none, and nothing is known of where on the workpiece the work is done.
    fn profile(&self, _reach: f64) -> Option<Profile> {
        None
    }

    /// The arc length in m of the point of the [profile](Workpiece::profile) that is nearest to `position` (m) at `time` (s).
    fn arc_length(&self, _position: [f64; 3], _time: f64) -> Option<f64> {
        None
    }

    /// The angles of the tool between which its undeformed tips touch the workpiece as it is at time zero; none if they
    /// never touch, or touch all the time. `tip` gives the position of a tip in m by the angle `β` in rad.
    ///
    /// The default searches a full turn (see [`ContactArc::find`]). A workpiece that knows the arc can state it exactly.
    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        ContactArc::find(|angle| self.surface(tip(angle), 0.0).gap)
    }
}

/// How an undeformed filament passes a workpiece as it is at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// The angles of the tool from which the lead angle and the tail angle of a pass count.
    pub window: ContactArc,
    /// The parts of the window in which the filament touches the workpiece: angles from the start of the window, in rad, ascending.
    pub touches: Vec<[f64; 2]>,
}

impl From<ContactArc> for Passage {
    /// That of tips which touch the workpiece throughout the window.
    fn from(window: ContactArc) -> Self {
        Self { window, touches: vec![[0.0, window.angle]] }
    }
}

impl Passage {
    /// The nominal contact angle in rad: that of all touches.
    pub fn contact_angle(&self) -> f64 {
        self.touches.iter().map(|[start, end]| end - start).sum()
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
