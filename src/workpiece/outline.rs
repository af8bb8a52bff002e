//! Outlines of straight faces and arcs.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::cells::MIN_ARC_CELLS;
use super::outline_curve::{OutlineCurve, Seen, left, turned};
use super::{ContactArc, Edge, Passage, ProfileCells, Surface, Workpiece, bisect, cross};
use crate::equations::linear::{dot, scale, sub};

/// Returns the angles at the tool's axis of the points of a curve within the distance `reach` (m)
/// of it, as intervals in rad. `at` is point and direction of the curve by arc length, sampled at
/// `points` intervals from `start` to `end`.
pub(super) fn touches(
    at: impl Fn(f64) -> [[f64; 2]; 2],
    [start, end]: [f64; 2],
    points: usize,
    reach: f64,
) -> Vec<[f64; 2]> {
    /// Pieces of a curve at least, which may go round the axis.
    const PIECES: usize = 8;
    if start >= end {
        return Vec::new();
    }
    let place = |i: usize| start + (end - start) * i as f64 / points as f64;
    // The angle is monotonic between the points where the curve runs towards the axis.
    let sides = |length: f64| {
        let [point, direction] = at(length);
        [
            dot(point, point) > reach * reach,
            cross(point, direction) > 0.0,
        ]
    };
    // A piece must be seen from the axis under less than half a turn: below, its angles are joined.
    let mut cuts: Vec<f64> = (0..PIECES).map(|i| place(i * points / PIECES)).collect();
    let mut before = sides(start);
    for i in 0..points {
        let after = sides(place(i + 1));
        for side in 0..2 {
            if after[side] != before[side] {
                cuts.push(bisect(
                    |length| sides(length)[side] != before[side],
                    place(i),
                    place(i + 1),
                ));
            }
        }
        before = after;
    }
    cuts.push(end);
    cuts.sort_by(f64::total_cmp);
    let touching = cuts.windows(2).filter(|pair| {
        let [is_outside, _] = sides((pair[0] + pair[1]) / 2.0);
        !is_outside
    });
    let angles = touching.map(|pair| {
        let [a, b] = [pair[0], pair[1]].map(|length| below(at(length)[0]));
        // An interval that passes straight above the axis would go all the way round.
        let b = b + TAU * ((a - b) / TAU).round();
        [a.min(b), a.max(b)]
    });
    angles.collect()
}

/// Returns the angle of a point at the tool's axis, in the turn about straight downwards, in rad.
fn below([x, y]: [f64; 2]) -> f64 {
    x.atan2(-y) - FRAC_PI_2
}

/// A workpiece of straight faces and arcs that moves without turning.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Curves in their order along the outline, with the material on the right-hand side.
    curves: Vec<OutlineCurve>,
    /// Differences of the outline's arc length from the own one of each curve, in m.
    shifts: Vec<f64>,
    /// `true` for curves that are edges.
    are_edges: Vec<bool>,
    /// Curves that nodes meet.
    faces: Vec<OutlineCurve>,
    edges: Vec<Edge>,
    velocity: [f64; 3],
}

/// A corner of an outline that is still sharp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Position in m.
    pub point: [f64; 2],
    /// Turn of the outline there, in the negative sense, in rad.
    pub turn: f64,
}

impl Corner {
    /// Returns the distance in m from the corner to its rounding with `radius` (m).
    pub fn rounding(&self, radius: f64) -> f64 {
        radius * (self.turn / 2.0).tan()
    }
}

impl Outline {
    /// Creates straight faces that meet in `corners`, rounded with `radius` (m). The first face
    /// goes along `direction`; the workpiece moves at `velocity` (m/s). Arcs of at least
    /// `face_radius` (m) are faces, others edges.
    pub(super) fn of_corners(
        corners: &[Corner],
        direction: [f64; 2],
        radius: f64,
        face_radius: f64,
        velocity: [f64; 3],
    ) -> Self {
        let mut curves = Vec::new();
        let mut direction = direction;
        let (mut point, mut from) = (corners[0].point, f64::NEG_INFINITY);
        for corner in corners {
            let rounding = corner.rounding(radius);
            let to = dot(sub(corner.point, point), direction) - rounding;
            curves.push(OutlineCurve::Line {
                point,
                direction,
                from,
                to,
            });
            let normal = left(direction);
            let centre = sub(
                sub(corner.point, scale(rounding, direction)),
                scale(radius, normal),
            );
            direction = turned(direction, corner.turn);
            curves.push(OutlineCurve::Arc {
                centre,
                radius,
                first: normal,
                second: left(direction),
            });
            (point, from) = (corner.point, rounding);
        }
        curves.push(OutlineCurve::Line {
            point,
            direction,
            from,
            to: f64::INFINITY,
        });
        Self::new(curves, face_radius, velocity)
    }

    /// Creates a circle about `centre` with `radius` (m): a cylinder if it is convex, else a bore.
    pub(super) fn circle(
        centre: [f64; 2],
        radius: f64,
        convex: bool,
        face_radius: f64,
        velocity: [f64; 3],
    ) -> Self {
        Self::new(
            vec![OutlineCurve::Circle {
                centre,
                radius,
                convex,
            }],
            face_radius,
            velocity,
        )
    }

    fn new(curves: Vec<OutlineCurve>, face_radius: f64, velocity: [f64; 3]) -> Self {
        let edge = |curve: &OutlineCurve| match *curve {
            OutlineCurve::Arc {
                centre,
                radius,
                first,
                second,
            } if radius < face_radius => {
                Some(Edge::arc(centre, radius, Some([second, first]), velocity))
            }
            OutlineCurve::Circle {
                centre,
                radius,
                convex: true,
            } if radius < face_radius => Some(Edge::arc(centre, radius, None, velocity)),
            _ => None,
        };
        let edges = curves.iter().filter_map(edge).collect();
        let are_edges: Vec<bool> = curves.iter().map(|curve| edge(curve).is_some()).collect();
        let faces = curves
            .iter()
            .filter(|curve| edge(curve).is_none())
            .copied()
            .collect();
        Self {
            shifts: shifts(&curves),
            are_edges,
            curves,
            faces,
            edges,
            velocity,
        }
    }

    /// Returns the passage of the undeformed filament, with tips at `reach` (m) from the axis. The
    /// window also has the angles of `plane`. `None` if the filament touches all the way round.
    pub(super) fn passage(&self, reach: f64, plane: ContactArc) -> Option<Passage> {
        const POINTS: usize = 512;
        let of_curve = |curve: &OutlineCurve| {
            touches(|length| curve.at(length), curve.range(reach), POINTS, reach)
        };
        passage(self.curves.iter().flat_map(of_curve).collect(), plane)
    }

    /// Returns the face that a node at `position` meets: the nearest, or where an edge is nearest,
    /// the one whose end it is least past.
    fn face(&self, position: [f64; 2]) -> Option<Seen> {
        let seen = self.faces.iter().map(|face| face.see(position));
        seen.reduce(|best, next| {
            let better = match (best.past <= 0.0, next.past <= 0.0) {
                (true, true) => next.gap > best.gap,
                (false, false) => next.past < best.past,
                (here, _) => !here,
            };
            if better { next } else { best }
        })
    }
}

/// Returns the differences of the outline's arc length from the own one of each curve, in m. The
/// middle of the rounded part is at zero.
fn shifts(curves: &[OutlineCurve]) -> Vec<f64> {
    let mut end = 0.0;
    let shift = |curve: &OutlineCurve| match *curve {
        OutlineCurve::Line { from, to, .. } if from.is_infinite() => end - to,
        OutlineCurve::Circle { .. } => 0.0,
        _ => {
            let [from, to] = curve.range(f64::INFINITY);
            let shift = end - from;
            // The last face goes on for ever.
            end = if to.is_finite() { shift + to } else { end };
            shift
        }
    };
    let shifts: Vec<f64> = curves.iter().map(shift).collect();
    shifts
        .into_iter()
        .map(|shift| if end > 0.0 { shift - end / 2.0 } else { shift })
        .collect()
}

/// Returns the passage of a filament that touches at the angles `touches` (rad, in any order).
pub(super) fn passage(mut touches: Vec<[f64; 2]>, plane: ContactArc) -> Option<Passage> {
    touches.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for [start, end] in touches {
        // Neighbouring curves end where the next begins, to rounding.
        match joined.last_mut() {
            Some(last) if start <= last[1] + 1e-9 => last[1] = last[1].max(end),
            _ => joined.push([start, end]),
        }
    }
    let entry = joined
        .first()
        .map_or(f64::INFINITY, |first| first[0])
        .min(plane.middle - plane.angle / 2.0);
    let exit = joined
        .iter()
        .fold(plane.middle + plane.angle / 2.0, |exit, touch| {
            exit.max(touch[1])
        });
    let window = ContactArc {
        middle: (entry + exit) / 2.0,
        angle: exit - entry,
    };
    let touches = joined
        .iter()
        .map(|touch| touch.map(|angle| angle - entry))
        .collect();
    (window.angle < TAU).then_some(Passage {
        window,
        touches,
        all_round: false,
    })
}

impl Workpiece for Outline {
    fn surface(&self, [x, y, _]: [f64; 3], time: f64) -> Surface {
        let [x_rate, y_rate, _] = self.velocity;
        let position = [x - time * x_rate, y - time * y_rate];
        let Some(Seen {
            gap,
            normal,
            curvature,
            ..
        }) = self.face(position)
        else {
            return Surface::flat(f64::INFINITY, [0.0, 1.0, 0.0], self.velocity);
        };
        let margin = |edge: &Edge| -edge.inside(position);
        let margin = self.edges.iter().map(margin).fold(f64::INFINITY, f64::min);
        Surface::of_profile(
            gap,
            normal,
            self.velocity,
            curvature / (1.0 + curvature * gap),
            margin,
        )
    }

    fn edges(&self) -> &[Edge] {
        &self.edges
    }

    fn is_planar(&self) -> bool {
        true
    }

    fn translates(&self) -> bool {
        true
    }

    fn profile(&self, reach: f64, longest: f64) -> Option<ProfileCells> {
        let stretches: Vec<Option<[f64; 2]>> = self
            .curves
            .iter()
            .map(|curve| curve.stretch(reach))
            .collect();
        let mut profile = ProfileCells::default();
        let (Some(first), Some(last)) = (
            stretches.iter().position(Option::is_some),
            stretches.iter().rposition(Option::is_some),
        ) else {
            return Some(profile);
        };
        for index in first..=last {
            let (curve, shift) = (&self.curves[index], self.shifts[index]);
            // Without gaps: only the first and the last curve are cut off.
            let [mut start, mut end] = curve.range(f64::INFINITY);
            if let Some([from, to]) = stretches[index] {
                start = if index == first { from } else { start };
                end = if index == last { to } else { end };
            }
            let least = if matches!(curve, OutlineCurve::Line { .. }) {
                1.0
            } else {
                MIN_ARC_CELLS
            };
            let stretch = [start, end].map(|length| length + shift);
            profile.extend(stretch, [least, longest], self.are_edges[index], |length| {
                curve.at(length - shift)[0]
            });
        }
        if let ([curve @ OutlineCurve::Circle { radius, .. }], Some(stretch)) =
            (&self.curves[..], stretches[0])
            && stretch == curve.range(reach)
        {
            profile.period = Some(TAU * radius);
        }
        Some(profile)
    }

    fn arc_length(&self, [x, y, _]: [f64; 3], time: f64) -> Option<f64> {
        let [x_rate, y_rate, _] = self.velocity;
        let position = [x - time * x_rate, y - time * y_rate];
        let places = self.curves.iter().zip(&self.shifts).map(|(curve, shift)| {
            let (length, square) = curve.nearest(position);
            (length + shift, square)
        });
        places
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(length, _)| length)
    }
}
