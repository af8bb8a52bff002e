//! Workpieces whose profile is a spline.

use std::sync::Arc;

use super::cells::MIN_ARC_CELLS;
use super::outline::{passage, touches};
use super::{ContactArc, Edge, Foot, Passage, ProfileCells, Spline, Surface, Workpiece, bisect};
use crate::equations::linear::{add, dot, scale, sub};

/// Sampled points of a profile in search of where it comes within reach.
const POINTS: usize = 4096;

/// Sampled points of a piece of the spline, which hardly turns, in search of touches.
const POINTS_OF_PIECE: usize = 16;

/// A workpiece with a spline as profile that moves without turning.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    spline: Arc<Spline>,
    /// Origin of the spline at time zero in m.
    origin: [f64; 2],
    /// Arc lengths in m of the ends of its tightest convex stretches, in order.
    stretches: Vec<[f64; 2]>,
    /// These stretches.
    edges: Vec<Edge>,
    velocity: [f64; 3],
}

/// A convex stretch of a spline that is curved too tightly for a face.
#[derive(Clone, Debug, PartialEq)]
pub struct TightStretch {
    spline: Arc<Spline>,
    /// Origin of the spline at time zero in m.
    origin: [f64; 2],
    /// Arc lengths of its ends in m.
    from: f64,
    to: f64,
    /// Smallest radius of curvature in m.
    radius: f64,
    /// Point half-way along it in m.
    middle: [f64; 2],
}

impl TightStretch {
    /// Returns the smallest radius of curvature in m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the curvatures of the whole spline ([`Spline::largest_curvatures`]).
    pub(super) fn largest_curvatures(&self) -> [f64; 2] {
        self.spline.largest_curvatures()
    }

    /// Returns its middle in m.
    pub(super) fn middle(&self) -> [f64; 2] {
        self.middle
    }

    /// Returns its length in m.
    pub(super) fn length(&self) -> f64 {
        self.to - self.from
    }

    /// Returns the length before the foot of `point` (m), in m; not clamped to its ends.
    pub(super) fn before(&self, point: [f64; 2]) -> f64 {
        self.spline.nearest(sub(point, self.origin)).arc_length - self.from
    }

    /// Returns the foot of `point` (m) as the workpiece has it at time zero, and its distance
    /// inside the stretch in m, as in [`Edge::surface`].
    pub(super) fn foot(&self, point: [f64; 2]) -> (Foot, f64) {
        let foot = self.spline.nearest(sub(point, self.origin));
        // A point at some distance from the profile moves farther than its foot.
        let inside = (foot.arc_length - self.from).min(self.to - foot.arc_length);
        (foot, inside * (1.0 + foot.curvature * foot.gap).max(0.0))
    }

    /// Returns the sum of the outward unit normals at its ends.
    pub(super) fn bisector(&self) -> [f64; 2] {
        let [first, second] =
            [self.from, self.to].map(|along| self.spline.nearest(self.spline.at(along).0).normal);
        add(first, second)
    }

    /// Returns the centre of curvature where the stretch is nearest to `point` (m), or half-way
    /// along it.
    pub(super) fn centre(&self, point: Option<[f64; 2]>) -> [f64; 2] {
        let along = match point {
            Some(point) => self
                .spline
                .nearest(sub(point, self.origin))
                .arc_length
                .clamp(self.from, self.to),
            None => (self.from + self.to) / 2.0,
        };
        let Foot {
            point,
            normal,
            curvature,
            ..
        } = self.spline.nearest(self.spline.at(along).0);
        add(self.origin, sub(point, scale(1.0 / curvature, normal)))
    }
}

impl Profile {
    /// Creates a profile of `spline` with its origin at `origin` (m), moving at `velocity` (m/s).
    /// Convex stretches with radii of curvature below `face_radius` (m) are edges.
    pub(super) fn new(
        spline: Arc<Spline>,
        origin: [f64; 2],
        face_radius: f64,
        velocity: [f64; 3],
    ) -> Self {
        let stretches = stretches(&spline, 1.0 / face_radius);
        let edges = stretches
            .iter()
            .map(|&[from, to]| {
                let sharpest = (0..=100).map(|i| {
                    let (point, _) = spline.at(from + (to - from) * f64::from(i) / 100.0);
                    spline.nearest(point).curvature
                });
                let radius = 1.0 / sharpest.fold(1.0 / face_radius, f64::max);
                let middle = add(origin, spline.at((from + to) / 2.0).0);
                Edge::of_stretch(
                    TightStretch {
                        spline: Arc::clone(&spline),
                        origin,
                        from,
                        to,
                        radius,
                        middle,
                    },
                    velocity,
                )
            })
            .collect();
        Self {
            spline,
            origin,
            stretches,
            edges,
            velocity,
        }
    }

    /// Returns the spline, in its own coordinates.
    pub fn spline(&self) -> &Spline {
        &self.spline
    }

    /// Returns the passage of the undeformed filament; see [`Outline`](super::Outline).
    pub(super) fn passage(&self, reach: f64, plane: ContactArc) -> Option<Passage> {
        let length = self.spline.length();
        let placed =
            |(point, direction): ([f64; 2], [f64; 2])| [add(self.origin, point), direction];
        let (pieces, at) = (self.spline.pieces(), |along: f64| {
            placed(self.spline.at(along))
        });
        let mut found = touches(
            |part| placed(self.spline.along_pieces(part)),
            [0.0, pieces as f64],
            POINTS_OF_PIECE * pieces,
            reach,
        );
        if !self.spline.is_closed() {
            for end in [0.0, length] {
                let [point, _] = at(end);
                let way = reach + dot(point, point).sqrt();
                let ray = if end == 0.0 {
                    [-way, 0.0]
                } else {
                    [length, length + way]
                };
                found.extend(touches(at, ray, POINTS_OF_PIECE, reach));
            }
        }
        passage(found, plane)
    }
}

impl Profile {
    /// Returns the arc lengths in m between which the profile comes within the distance `reach` (m)
    /// of the tool axis, without gaps: all of a closed one. `None` if it does not.
    fn within(&self, reach: f64) -> Option<[f64; 2]> {
        let length = self.spline.length();
        let away = |along: f64| {
            let point = add(self.origin, self.spline.at(along).0);
            dot(point, point).sqrt()
        };
        let range = if self.spline.is_closed() {
            [0.0, length]
        } else {
            [-reach - away(0.0), length + reach + away(length)]
        };
        let place = |i: usize| range[0] + (range[1] - range[0]) * i as f64 / POINTS as f64;
        let inside = |i: &usize| away(place(*i)) < reach;
        let (first, last) = ((0..=POINTS).find(inside)?, (0..=POINTS).rfind(inside)?);
        if self.spline.is_closed() {
            return Some(range);
        }
        let start = if first == 0 {
            range[0]
        } else {
            bisect(|along| away(along) < reach, place(first - 1), place(first))
        };
        let end = if last == POINTS {
            range[1]
        } else {
            bisect(|along| away(along) >= reach, place(last), place(last + 1))
        };
        Some([start, end])
    }
}

/// Returns the stretches, by arc length, on which the curvature is above `limit` (1/m).
fn stretches(spline: &Spline, limit: f64) -> Vec<[f64; 2]> {
    if spline.smallest_convex_radius() * limit >= 1.0 {
        return Vec::new();
    }
    let tight = |along: f64| spline.nearest(spline.at(along).0).curvature > limit;
    let mut found: Vec<[f64; 2]> = Vec::new();
    let mut start = tight(0.0).then_some(0.0);
    for places in spline.curvature_places().windows(2) {
        let [here, next] = [places[0], places[1]];
        match (start, tight(next)) {
            (None, true) => start = Some(bisect(tight, here, next)),
            (Some(from), false) => {
                found.push([from, bisect(|along| !tight(along), here, next)]);
                start = None;
            }
            _ => {}
        }
    }
    found.extend(start.map(|from| [from, spline.length()]));
    found
}

impl Workpiece for Profile {
    fn surface(&self, [x, y, _]: [f64; 3], time: f64) -> Surface {
        let [x_rate, y_rate, _] = self.velocity;
        let position = [x - time * x_rate, y - time * y_rate];
        let Foot {
            normal,
            gap,
            curvature,
            ..
        } = self.spline.nearest(sub(position, self.origin));
        let margin = self
            .edges
            .iter()
            .map(|edge| -edge.inside(position))
            .fold(f64::INFINITY, f64::min);
        Surface::of_profile(
            gap,
            normal,
            self.velocity,
            1.0 / (1.0 / curvature + gap),
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

    fn largest_curvatures(&self) -> [f64; 2] {
        self.spline.largest_curvatures()
    }

    fn profile(&self, reach: f64, longest: f64) -> Option<ProfileCells> {
        let (at, length) = (
            |along: f64| add(self.origin, self.spline.at(along).0),
            self.spline.length(),
        );
        let mut cells = ProfileCells::default();
        let Some([start, end]) = self.within(reach) else {
            return Some(cells);
        };
        let ends = self
            .stretches
            .iter()
            .flatten()
            .chain([&0.0, &length])
            .copied();
        let mut cuts: Vec<f64> = ends
            .filter(|cut| *cut > start && *cut < end)
            .chain([start, end])
            .collect();
        cuts.sort_by(f64::total_cmp);
        for pair in cuts.windows(2) {
            let middle = (pair[0] + pair[1]) / 2.0;
            let on_edge = self
                .stretches
                .iter()
                .any(|[from, to]| (from..=to).contains(&&middle));
            let least = if on_edge { MIN_ARC_CELLS } else { 1.0 };
            cells.extend([pair[0], pair[1]], [least, longest], on_edge, at);
        }
        cells.period = self.spline.is_closed().then_some(length);
        Some(cells)
    }

    fn arc_length(&self, [x, y, _]: [f64; 3], time: f64) -> Option<f64> {
        let [x_rate, y_rate, _] = self.velocity;
        let position = [x - time * x_rate, y - time * y_rate];
        Some(self.spline.nearest(sub(position, self.origin)).arc_length)
    }
}
