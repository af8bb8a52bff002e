//! Workpieces: the surface that a filament meets, and where the undeformed tool touches it.
//!
//! [`Part`] is the workpiece of the settings; implement [`Workpiece`] for another, and pass it to
//! [`Pass::with`](crate::simulation::Pass::with).
//!
//! A workpiece has faces and edges. Faces are curved so little that the nodes of a filament meet
//! them. Edges are convex curves whose radii are not large against a segment, and are met by the
//! centreline.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::equations::linear::{add, dot, scale, sub};
use crate::model::passage::bisect;
pub use crate::model::passage::{ContactArc, Passage};
pub use crate::model::settings::unit_normal;

mod cells;
mod outline;
mod outline_curve;
mod part;
mod plane;
mod posed;
mod profile;
mod spline;

pub use cells::{Cell, ProfileCells};
pub use outline::Outline;
pub use part::Part;
pub use plane::Plane;
pub use posed::{Placement, Posed, Ramp, Way};
pub use profile::{Profile, TightStretch};
pub use spline::{Foot, Spline, SplineError};

/// Point of a workpiece that is nearest to a point of the filament.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Distance along the normal in m; negative means that the node is inside.
    pub gap: f64,
    /// Outward unit normal.
    pub normal: [f64; 3],
    /// Velocity of the workpiece there in m/s.
    pub velocity: [f64; 3],
    /// Tangent across the normal in the plane of the workpiece's profile: the way of the normal's
    /// end as it turns in the positive sense. Without meaning on a plane.
    pub across: [f64; 3],
    /// Turn of the normal in that plane per path of the point across it, in rad/m: `κ/(1 + κ g)`
    /// with the curvature `κ` of the surface, positive where it is convex, and the gap `g`. Zero on
    /// a plane.
    pub turn: f64,
    /// Distance of the point in m from where the nearest point of the workpiece is on an edge, and
    /// it no longer meets this surface; negative beyond. Infinite without an edge.
    pub margin: f64,
}

impl Surface {
    /// Returns the surface of a plane without edges.
    pub fn flat(gap: f64, normal: [f64; 3], velocity: [f64; 3]) -> Self {
        Self {
            gap,
            normal,
            velocity,
            across: [0.0; 3],
            turn: 0.0,
            margin: f64::INFINITY,
        }
    }

    /// Returns the surface of a profile extruded along `z`, with the outward unit normal `[x, y]`.
    fn of_profile(gap: f64, [x, y]: [f64; 2], velocity: [f64; 3], turn: f64, margin: f64) -> Self {
        Self {
            gap,
            normal: [x, y, 0.0],
            velocity,
            across: [-y, x, 0.0],
            turn,
            margin,
        }
    }
}

/// A convex edge of a workpiece, extruded along `z`.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    curve: EdgeCurve,
    /// Velocity of the workpiece in m/s, in its own frame.
    velocity: [f64; 3],
    /// Placement of the workpiece in the frame of the tool; `None` if both have the same frame.
    placement: Option<Arc<Placement>>,
}

/// Curve of an edge at time zero.
#[derive(Clone, Debug, PartialEq)]
enum EdgeCurve {
    /// Arc between two outward unit normals, from one to the other in the positive sense, by less
    /// than half a turn. `None` for a whole circle.
    Arc {
        centre: [f64; 2],
        radius: f64,
        ends: Option<[[f64; 2]; 2]>,
    },
    Stretch(TightStretch),
}

impl Edge {
    /// Creates an arc about `centre` (m) of the radius `radius` (m). It goes from the first outward
    /// unit normal of `ends` to the second in the positive sense, by less than half a turn, or all
    /// the way round. The workpiece moves at `velocity` (m/s).
    pub fn arc(
        centre: [f64; 2],
        radius: f64,
        ends: Option<[[f64; 2]; 2]>,
        velocity: [f64; 3],
    ) -> Self {
        Self {
            curve: EdgeCurve::Arc {
                centre,
                radius,
                ends,
            },
            velocity,
            placement: None,
        }
    }

    /// Moves the edge to the frame of a tool.
    fn placed(self, placement: Arc<Placement>) -> Self {
        Self {
            placement: Some(placement),
            ..self
        }
    }

    /// Maps a point (m) of the frame of the tool to the plane of the profile at `time` (s).
    #[inline]
    pub fn in_profile(&self, position: [f64; 3], time: f64) -> [f64; 2] {
        let [x, y, _] = self
            .placement
            .as_ref()
            .map_or(position, |placement| placement.local(position, time));
        [x, y]
    }

    /// Returns the part of a vector across the extrusion of the edge.
    pub fn across_extrusion(&self, vector: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = vector;
        match &self.placement {
            None => [x, y, 0.0],
            Some(placement) => {
                let along = placement.extrusion();
                sub([x, y, z], scale(dot(along, vector), along))
            }
        }
    }

    fn of_stretch(stretch: TightStretch, velocity: [f64; 3]) -> Self {
        Self {
            curve: EdgeCurve::Stretch(stretch),
            velocity,
            placement: None,
        }
    }

    /// Returns the smallest radius of curvature in m.
    pub fn radius(&self) -> f64 {
        match &self.curve {
            EdgeCurve::Arc { radius, .. } => *radius,
            EdgeCurve::Stretch(stretch) => stretch.radius(),
        }
    }

    /// Returns the largest curvatures of the surface to which its gap is the distance, as
    /// [`Workpiece::largest_curvatures`].
    pub fn largest_curvatures(&self) -> [f64; 2] {
        match (&self.curve, &self.placement) {
            (_, Some(placement)) if placement.has_ramp() => [f64::INFINITY; 2],
            (EdgeCurve::Arc { radius, .. }, _) => [1.0 / radius, 0.0],
            (EdgeCurve::Stretch(stretch), _) => stretch.largest_curvatures(),
        }
    }

    /// Returns the centre of an arc at `time` (s) in m, in the plane of the profile.
    ///
    /// A stretch of a spline has the centre of curvature where it is nearest to `point`, or
    /// half-way along it: the point of a filament that is nearest to an edge is found by
    /// alternating with its centre.
    pub fn centre(&self, point: Option<[f64; 2]>, time: f64) -> [f64; 2] {
        let moved = self.moved(time);
        match &self.curve {
            EdgeCurve::Arc { centre, .. } => add(*centre, moved),
            EdgeCurve::Stretch(stretch) => {
                add(stretch.centre(point.map(|point| sub(point, moved))), moved)
            }
        }
    }

    /// Returns `true` if the centre is the same wherever a filament touches.
    pub fn is_arc(&self) -> bool {
        matches!(self.curve, EdgeCurve::Arc { .. })
    }

    /// Returns the point half-way along a stretch of a spline at `time` (s) in m; `None` for an
    /// arc.
    pub fn middle(&self, time: f64) -> Option<[f64; 2]> {
        match &self.curve {
            EdgeCurve::Arc { .. } => None,
            EdgeCurve::Stretch(stretch) => Some(add(stretch.middle(), self.moved(time))),
        }
    }

    /// Returns the distance in m of a point (m), at time zero, from the nearer side of the edge's
    /// angle; negative outside.
    fn inside(&self, point: [f64; 2]) -> f64 {
        match &self.curve {
            EdgeCurve::Arc { ends: None, .. } => f64::INFINITY,
            EdgeCurve::Arc {
                centre,
                ends: Some([first, second]),
                ..
            } => {
                let offset = sub(point, *centre);
                cross(*first, offset).min(cross(offset, *second))
            }
            EdgeCurve::Stretch(stretch) => stretch.foot(point).1,
        }
    }

    /// Returns its length in m.
    pub fn length(&self) -> f64 {
        match &self.curve {
            EdgeCurve::Arc {
                radius, ends: None, ..
            } => TAU * radius,
            EdgeCurve::Arc {
                radius,
                ends: Some([first, second]),
                ..
            } => radius * cross(*first, *second).atan2(dot(*first, *second)),
            EdgeCurve::Stretch(stretch) => stretch.length(),
        }
    }

    /// Returns the part of its length, from 0 to 1, that lies before the point nearest to
    /// `position` (m) at `time` (s).
    pub fn part_before(&self, position: [f64; 3], time: f64) -> f64 {
        let point = sub(self.in_profile(position, time), self.moved(time));
        let before = match &self.curve {
            EdgeCurve::Arc {
                centre,
                radius,
                ends,
            } => {
                let [first, _] = ends.unwrap_or([[-1.0, 0.0]; 2]);
                let offset = sub(point, *centre);
                let angle = cross(first, offset).atan2(dot(first, offset));
                radius
                    * if ends.is_none() {
                        angle.rem_euclid(TAU)
                    } else {
                        angle
                    }
            }
            EdgeCurve::Stretch(stretch) => stretch.before(point),
        };
        (before / self.length()).clamp(0.0, 1.0)
    }

    /// Returns the angle in rad from the edge's bisector of the normal nearest to `position` (m) at
    /// `time` (s). It is positive towards the face that filaments meet last, of a tool that turns
    /// in the positive sense above the edge. On a whole circle it counts from `+y`.
    pub fn angle(&self, position: [f64; 3], time: f64) -> f64 {
        let point = sub(self.in_profile(position, time), self.moved(time));
        let (normal, bisector) = match &self.curve {
            EdgeCurve::Arc { centre, ends, .. } => (
                sub(point, *centre),
                ends.map_or([0.0, 1.0], |[first, second]| add(first, second)),
            ),
            EdgeCurve::Stretch(stretch) => {
                let (foot, _) = stretch.foot(point);
                (foot.normal, stretch.bisector())
            }
        };
        // Filaments go towards +x, unless the tool's axis points to the other side: normals turn in
        // the negative sense.
        let goes_back = self
            .placement
            .as_ref()
            .is_some_and(|placement| placement.axis()[2] < 0.0);
        let angle = cross(normal, bisector).atan2(dot(normal, bisector));
        if goes_back { -angle } else { angle }
    }

    /// Returns the surface of the edge, as the point of a filament at `position` (m) sees it at
    /// `time` (s).
    pub fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let point = sub(self.in_profile(position, time), self.moved(time));
        let (gap, normal, turn, margin) = match &self.curve {
            EdgeCurve::Arc { centre, radius, .. } => {
                let offset = sub(point, *centre);
                let distance = dot(offset, offset).sqrt();
                (
                    distance - radius,
                    scale(1.0 / distance, offset),
                    1.0 / distance,
                    self.inside(point),
                )
            }
            EdgeCurve::Stretch(stretch) => {
                let (
                    Foot {
                        normal,
                        gap,
                        curvature,
                        ..
                    },
                    inside,
                ) = stretch.foot(point);
                (gap, normal, 1.0 / (1.0 / curvature + gap), inside)
            }
        };
        let surface = Surface::of_profile(gap, normal, self.velocity, turn, margin);
        self.placement
            .as_ref()
            .map_or(surface, |placement| placement.seen(&surface, time))
    }

    /// Returns the points in m, at time zero, where an arc passes into faces; `None` if there are
    /// none, or if the edge is no arc that moves evenly.
    fn borders(&self) -> Option<[[f64; 2]; 2]> {
        match (&self.curve, &self.placement) {
            (_, Some(placement)) if placement.has_ramp() => None,
            (
                EdgeCurve::Arc {
                    centre,
                    radius,
                    ends: Some(ends),
                },
                _,
            ) => Some(ends.map(|normal| add(*centre, scale(*radius, normal)))),
            _ => None,
        }
    }

    /// Returns the displacement of the workpiece at `time` (s) in m.
    fn moved(&self, time: f64) -> [f64; 2] {
        let [x_rate, y_rate, _] = self.velocity;
        [time * x_rate, time * y_rate]
    }
}

/// Returns a quarter of the least distance in m between two borders of arcs with faces. Over a
/// shorter path, the [margin](Surface::margin) of a point no deeper in the workpiece than this
/// depends on one border. Zero if an edge is not such an arc; infinite without edges.
pub(crate) fn border_spacing(edges: &[Edge]) -> f64 {
    let mut least = f64::INFINITY;
    for (index, edge) in edges.iter().enumerate() {
        let Some([first, second]) = edge.borders() else {
            return 0.0;
        };
        let others = edges[..index].iter().filter_map(Edge::borders).flatten();
        let pairs = others
            .flat_map(|other| [[first, other], [second, other]])
            .chain([[first, second]]);
        least = pairs
            .map(|[a, b]| sub(a, b))
            .map(|way| dot(way, way).sqrt())
            .fold(least, f64::min);
    }
    least / 4.0
}

/// Returns `a × b`: the sine of the angle from `a` to `b`, times their lengths.
#[inline(always)]
fn cross([x, y]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    x * v - y * u
}

/// Geometry and motion of a workpiece.
///
/// The tool turns about the `z` axis of the frame, in the positive direction. [`Posed`] is a
/// workpiece in the frame of a tool whose axis is tilted against its own `z`.
pub trait Workpiece {
    /// Returns the face seen from the node at `position` (m) at `time` (s). The normal should be
    /// continuous where filaments touch.
    ///
    /// The gap is a distance: it must not change by more than twice the path of a position relative
    /// to the workpiece. Nodes that are too far away to arrive are not checked in every step.
    fn surface(&self, position: [f64; 3], time: f64) -> Surface;

    /// Returns the edges; none by default.
    fn edges(&self) -> &[Edge] {
        &[]
    }

    /// Returns `true` if nothing about the surface depends on `z`: neither gap nor normal, and
    /// normal and velocity have no component along it. The filaments of a [planar
    /// tool](crate::tool::Tool::is_planar) are then simulated in the plane of rotation.
    ///
    /// The default is `false`, which is always right.
    fn is_planar(&self) -> bool {
        false
    }

    /// Returns `true` if the workpiece moves without turning or deforming: [`Surface::velocity`] is
    /// the same everywhere. The search for contact events then leaves out nodes that are far away.
    ///
    /// The default is `false`, which is always right.
    fn translates(&self) -> bool {
        false
    }

    /// Returns the largest curvature of the surface in 1/m, where it is convex and where it is
    /// concave, if the gap is the distance from it and the workpiece moves at a constant velocity.
    /// The search for contact events then passes over no feature, however small.
    ///
    /// The default is infinite, as unknown: features smaller than a segment can be passed over.
    fn largest_curvatures(&self) -> [f64; 2] {
        [f64::INFINITY; 2]
    }

    /// Returns the outline in the plane of rotation within the distance `reach` (m) of the tool
    /// axis, if the workpiece is a profile extruded along `z`. No cell is longer than `longest` (m).
    ///
    /// The default is `None`: the place of the work on the workpiece is not known.
    fn profile(&self, _reach: f64, _longest: f64) -> Option<ProfileCells> {
        None
    }

    /// Returns the arc length in m of the point of the [profile](Workpiece::profile) that is
    /// nearest to `position` (m) at `time` (s).
    fn arc_length(&self, _position: [f64; 3], _time: f64) -> Option<f64> {
        None
    }

    /// Returns the angles of the tool between which its undeformed tips touch the workpiece as it
    /// is at time zero; `None` if they never or always touch. `tip` gives the position of a tip in
    /// m by the angle `β` in rad.
    ///
    /// The default searches a full turn (see [`ContactArc::find`]). A workpiece that knows the arc
    /// can state it exactly.
    fn contact_arc(&self, tip: &dyn Fn(f64) -> [f64; 3]) -> Option<ContactArc> {
        ContactArc::find(|angle| self.surface(tip(angle), 0.0).gap)
    }
}
