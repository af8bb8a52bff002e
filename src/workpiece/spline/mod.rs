//! B-spline profiles: control points in, signed distances, normals and curvatures out.
//!
//! Every span of the B-spline is a polynomial. It is cut into [pieces](piece) that turn by little,
//! and a [grid] of the plane lists the pieces that can be nearest to the points of each cell. A
//! query searches these alone.

mod bezier;
mod crossing;
mod error;
mod grid;
mod piece;
#[cfg(test)]
mod tests;

use std::f64::consts::PI;

use bezier::{ProfilePoint, angle, bounds, cross, left, unit};
pub use error::SplineError;
use grid::Grid;
use piece::{MAX_DEGREE, Piece};

use crate::equations::linear::{add, dot, scale, sub};

/// Largest coordinate of a control point in m.
const MAX_COORDINATE: f64 = 1e3;

/// Size of parts of the curve, over its own size, at which parts that cannot be told apart count as
/// crossing.
const CROSSING_SHARE: f64 = 1e-6;

/// Smallest angle that makes a corner, in rad. Joints of smooth spans turn by rounding errors.
const MIN_CORNER_ANGLE: f64 = 1e-8;

/// A B-spline curve in the x-y plane with material on its right-hand side.
///
/// An open curve has clamped, uniform knots: it starts at its first control point, ends at its last
/// one, and goes on straight beyond both as two rays. A closed one has periodic, uniform knots.
/// Passed clockwise it bounds a solid inside it, passed counterclockwise a hole with all material
/// outside.
///
/// As many coinciding control points as the degree make a corner, and at degree 1 every control
/// point is one.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    pieces: Vec<Piece>,
    /// Corner at the start of each piece, then at the end of the curve: `None` if open.
    corners: Vec<Option<CurveCorner>>,
    /// `None` if the curve is closed.
    ends: Option<[Ray; 2]>,
    length: f64,
    largest_curvatures: [f64; 2],
    grid: Grid,
}

/// Point of a profile that is nearest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Position in m.
    pub point: [f64; 2],
    /// Outward unit normal: the gradient of the gap. To the left of the direction of travel, except
    /// at a corner, where it is parallel to the line between both points.
    pub normal: [f64; 2],
    /// Signed distance in m; negative inside the material.
    pub gap: f64,
    /// Curvature in 1/m, positive where the material is convex. Infinite at corners: positive at
    /// convex ones, negative at concave ones. The curve of equal gap through the given point has
    /// the curvature `1/(1/curvature + gap)`.
    pub curvature: f64,
    /// Arc length in m from the start of the curve. Negative or larger than its length on the
    /// straight continuations of an open curve.
    pub arc_length: f64,
}

/// A joint at which the curve turns.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CurveCorner {
    /// Sum of the normals on both sides. Its sign seen from a point whose nearest point is the
    /// corner says whether that point is outside (Bærentzen and Aanæs 2005, "Signed distance
    /// computation using the angle weighted pseudonormal").
    normal: ProfilePoint,
    /// `true` if the curve turns to the right.
    convex: bool,
}

/// Straight continuation of an open curve.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ray {
    end: ProfilePoint,
    /// Unit vector away from the curve.
    outwards: ProfilePoint,
    /// Unit normal to the left of the direction of travel.
    normal: ProfilePoint,
    /// Arc length at the end, in m.
    arc_length: f64,
    /// Change of the arc length over the way outwards: −1 before the start, 1 behind the end.
    sense: f64,
}

/// A place on the profile.
#[derive(Clone, Copy, Debug)]
enum CurvePlace {
    /// Number of the end, and way from it outwards in m.
    Ray(usize, f64),
    /// Number of the piece and its parameter.
    Piece(usize, f64),
}

impl Spline {
    /// Creates the curve of `degree` with `control_points` (m). A closed one does not repeat the
    /// first at the end.
    ///
    /// Arc length counts from the first control point of an open curve. A closed curve of odd
    /// degree starts near its first control point, and one of even degree half-way between two.
    ///
    /// # Errors
    /// Points that are not finite or beyond a kilometre, a degree that is not from 1 to 10, fewer
    /// points than `degree + 1` (and than 3 if closed), a curve that has no direction somewhere,
    /// turns back on itself, or crosses itself, where the continuations of an open curve count.
    pub fn new(
        control_points: &[[f64; 2]],
        degree: usize,
        closed: bool,
    ) -> Result<Self, SplineError> {
        check(control_points, degree, closed)?;
        let nearest = |position| nearest_of(control_points, position);
        let [low, high] = bounds(control_points);
        let size = (high[0] - low[0]).max(high[1] - low[1]);
        let rounding = 4.0
            * f64::EPSILON
            * control_points
                .as_flattened()
                .iter()
                .fold(0.0, |m: f64, x| m.max(x.abs()));
        let (mut chain, mut pieces) = (Vec::new(), Vec::new());
        for span in bezier::spans(control_points, degree, closed) {
            let span = if is_straight(&span, rounding) {
                vec![span[0], span[degree]]
            } else {
                span
            };
            cut(span, CROSSING_SHARE * size, &mut chain, &mut pieces).map_err(|position| {
                SplineError::Stops {
                    position,
                    point: nearest(position),
                }
            })?;
        }
        let mut length = 0.0;
        for piece in &mut pieces {
            piece.start = length;
            length += piece.length();
        }
        let corners = corners(&pieces, closed).map_err(|piece| SplineError::TurnsBack {
            position: chain[piece][0],
            point: nearest(chain[piece][0]),
        })?;
        let ends = if closed {
            None
        } else {
            Some(rays(&pieces, length))
        };
        check_crossing(chain, ends.as_ref(), size)?;
        let largest_curvatures =
            [1.0, -1.0].map(|sense| largest_curvature(&pieces, &corners, sense));
        let extents: Vec<_> = pieces.iter().map(Piece::extent).collect();
        let grid = Grid::new(&extents, [low, high]);
        Ok(Self {
            pieces,
            corners,
            ends,
            length,
            largest_curvatures,
            grid,
        })
    }

    /// Returns the point of the profile nearest to `point` (m), continuations of an open curve
    /// included. If several are equally near, it is always the same one.
    pub fn nearest(&self, point: [f64; 2]) -> Foot {
        let mut best = (CurvePlace::Piece(0, -1.0), f64::INFINITY);
        for (number, ray) in self.ends.iter().flatten().enumerate() {
            let offset = sub(point, ray.end);
            let (way, distance) = (dot(offset, ray.outwards), dot(offset, ray.normal));
            if way > 0.0 && distance * distance < best.1 {
                best = (CurvePlace::Ray(number, way), distance * distance);
            }
        }
        let candidates = self.grid.candidates(point);
        let bound = |number: u32| {
            let piece = &self.pieces[number as usize];
            piece.squared_distance_bound(piece.local(point))
        };
        // The piece that looks nearest goes first: it excludes most others.
        let mut first = (u32::MAX, best.1);
        for &number in candidates {
            let bound = bound(number);
            if bound < first.1 {
                first = (number, bound);
            }
        }
        let mut look_at = |number: u32| {
            let piece = &self.pieces[number as usize];
            let (u, squared) = piece.nearest(piece.local(point), best.1);
            if squared < best.1 {
                best = (CurvePlace::Piece(number as usize, u), squared);
            }
            best.1
        };
        if first.0 != u32::MAX {
            let mut least = look_at(first.0);
            for &number in candidates {
                if number != first.0 && bound(number) < least {
                    least = look_at(number);
                }
            }
        }
        self.foot(best.0, point)
    }

    /// Returns the number of pieces, none of which turns by more than some 20°.
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Returns the arc length in m, without the continuations of an open curve.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Returns point (m) and unit direction of travel at `arc_length` (m) from the start. Beyond
    /// the ends of an open curve these are on its straight continuations; a closed curve is passed
    /// again.
    pub fn at(&self, arc_length: f64) -> ([f64; 2], [f64; 2]) {
        let arc_length = match &self.ends {
            None => arc_length.rem_euclid(self.length),
            Some(_) => arc_length,
        };
        for ray in self.ends.iter().flatten() {
            let way = (arc_length - ray.arc_length) * ray.sense;
            if way > 0.0 {
                return (
                    add(ray.end, scale(way, ray.outwards)),
                    scale(ray.sense, ray.outwards),
                );
            }
        }
        let behind = self
            .pieces
            .partition_point(|piece| piece.start <= arc_length);
        let piece = &self.pieces[behind.saturating_sub(1)];
        let [value, velocity, _] = piece.evaluate(piece.parameter_at(arc_length - piece.start));
        (piece.global(value), unit(piece.global_direction(velocity)))
    }

    /// Returns point (m) and unit direction of travel by a parameter from 0 to the number of
    /// pieces, which rises with the arc length and costs less.
    pub fn along_pieces(&self, parameter: f64) -> ([f64; 2], [f64; 2]) {
        let number = (parameter as usize).min(self.pieces.len() - 1);
        let piece = &self.pieces[number];
        let [value, velocity, _] = piece.evaluate(2.0 * (parameter - number as f64) - 1.0);
        (piece.global(value), unit(piece.global_direction(velocity)))
    }

    /// Returns `true` if the curve ends where it starts.
    pub fn is_closed(&self) -> bool {
        self.ends.is_none()
    }

    /// Returns the smallest radius of curvature in m where the material is convex: 0 at a corner,
    /// infinite if it is nowhere convex.
    pub fn smallest_convex_radius(&self) -> f64 {
        1.0 / self.largest_curvatures[0]
    }

    /// Returns arc lengths in m, in ascending order, between which the curvature is monotonic: points of
    /// each piece, and those of its largest and smallest curvature.
    pub(super) fn curvature_places(&self) -> Vec<f64> {
        let of_piece = |piece: &Piece| {
            let extremes = [1.0, -1.0].map(|sense| argmax(|u| sense * piece.curvature(u)));
            let mut places: Vec<f64> = (0..=INTERVALS).map(parameter).chain(extremes).collect();
            places.sort_by(f64::total_cmp);
            let along = |u: f64| (piece.start + piece.arc_length(u)).clamp(0.0, self.length);
            places.into_iter().map(along).collect::<Vec<f64>>()
        };
        self.pieces.iter().flat_map(of_piece).collect()
    }

    /// Returns the largest curvature in 1/m where the material is convex, and where it is concave;
    /// infinite at a corner.
    pub fn largest_curvatures(&self) -> [f64; 2] {
        self.largest_curvatures
    }

    /// Returns the foot at `place`, seen from `point`.
    #[inline]
    fn foot(&self, place: CurvePlace, point: ProfilePoint) -> Foot {
        match place {
            CurvePlace::Ray(number, way) => {
                let ray = &self.ends.as_ref().expect("a ray continues an open curve")[number];
                Foot {
                    point: add(ray.end, scale(way, ray.outwards)),
                    normal: ray.normal,
                    gap: dot(sub(point, ray.end), ray.normal),
                    curvature: 0.0,
                    arc_length: ray.arc_length + ray.sense * way,
                }
            }
            CurvePlace::Piece(number, u) => {
                let piece = &self.pieces[number];
                let [value, velocity, acceleration] = piece.evaluate(u);
                let speed = dot(velocity, velocity).sqrt();
                let normal = scale(1.0 / speed, left(velocity));
                let smooth = Foot {
                    point: piece.global(value),
                    normal: piece.global_direction(normal),
                    gap: dot(sub(piece.local(point), value), normal),
                    curvature: -cross(velocity, acceleration) / (speed * speed * speed),
                    arc_length: piece.start + piece.arc_length(u),
                };
                if u.abs() < 1.0 {
                    return smooth;
                }
                match self.corners[number + usize::from(u > 0.0)] {
                    Some(corner) => corner.foot(smooth, point),
                    None => smooth,
                }
            }
        }
    }
}

impl CurveCorner {
    /// Corrects `smooth`, the foot at this corner as one of its sides sees it.
    fn foot(&self, smooth: Foot, point: ProfilePoint) -> Foot {
        let offset = sub(point, smooth.point);
        let distance = dot(offset, offset).sqrt();
        let gap = distance.copysign(dot(offset, self.normal));
        let normal = if distance > 0.0 {
            scale(1.0 / gap, offset)
        } else {
            unit(self.normal)
        };
        let curvature = if self.convex {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        };
        Foot {
            normal,
            gap,
            curvature,
            ..smooth
        }
    }
}

/// Checks the arguments before any curve is made.
fn check(control_points: &[ProfilePoint], degree: usize, closed: bool) -> Result<(), SplineError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(SplineError::Degree { degree });
    }
    let is_bad = |point: &ProfilePoint| !point.iter().all(|x| x.abs() <= MAX_COORDINATE);
    if let Some(index) = control_points.iter().position(is_bad) {
        return Err(SplineError::NotFinite { point: index + 1 });
    }
    let needed = if closed {
        (degree + 1).max(3)
    } else {
        degree + 1
    };
    if control_points.len() < needed {
        return Err(SplineError::TooFewPoints {
            given: control_points.len(),
            needed,
            degree,
            closed,
        });
    }
    Ok(())
}

/// Returns the number of the control point nearest to `position`, from 1.
fn nearest_of(control_points: &[ProfilePoint], position: ProfilePoint) -> usize {
    let square = |index: &usize| {
        let offset = sub(control_points[*index], position);
        dot(offset, offset)
    };
    let nearest = (0..control_points.len()).min_by(|a, b| square(a).total_cmp(&square(b)));
    nearest.map_or(0, |index| index + 1)
}

/// Returns `true` if a span goes straight ahead, to within `rounding` (m). Beside coinciding
/// control points it then has no speed at its end, but its chord has.
fn is_straight(span: &[ProfilePoint], rounding: f64) -> bool {
    let chord = sub(span[span.len() - 1], span[0]);
    let axis = unit(chord);
    let ahead = span
        .windows(2)
        .all(|pair| dot(axis, sub(pair[1], pair[0])) >= -rounding);
    ahead
        && span
            .iter()
            .all(|&point| cross(axis, sub(point, span[0])).abs() <= rounding)
}

/// Halves `span` until each part is a piece, and adds the parts to `chain` and `pieces`. The error
/// is the position of a part much shorter than `shortest` (m) that is none: the curve stops there.
fn cut(
    span: Vec<ProfilePoint>,
    shortest: f64,
    chain: &mut Vec<Vec<ProfilePoint>>,
    pieces: &mut Vec<Piece>,
) -> Result<(), ProfilePoint> {
    if let Some(piece) = Piece::new(&span) {
        pieces.push(piece);
        chain.push(span);
        return Ok(());
    }
    let [low, high] = bounds(&span);
    if (high[0] - low[0]).max(high[1] - low[1]) <= 1e-3 * shortest {
        return Err(span[0]);
    }
    bezier::halves(&span)
        .into_iter()
        .try_for_each(|half| cut(half, shortest, chain, pieces))
}

/// Returns the corners at the starts of the pieces and at the end of the last. The error is the
/// number of a piece that turns back from the one before it.
fn corners(pieces: &[Piece], closed: bool) -> Result<Vec<Option<CurveCorner>>, usize> {
    let count = pieces.len();
    let mut corners = vec![None; count + 1];
    for start in usize::from(!closed)..count {
        let [_, before] = pieces[(start + count - 1) % count].end_directions();
        let [after, _] = pieces[start].end_directions();
        let turn = angle(before, after);
        if turn.abs() > PI - 1e-6 {
            return Err(start);
        }
        if turn.abs() > MIN_CORNER_ANGLE {
            corners[start] = Some(CurveCorner {
                normal: add(left(before), left(after)),
                convex: turn < 0.0,
            });
        }
    }
    if closed {
        corners[count] = corners[0];
    }
    Ok(corners)
}

/// Returns the straight continuations of an open curve.
fn rays(pieces: &[Piece], length: f64) -> [Ray; 2] {
    let (first, last) = (&pieces[0], &pieces[pieces.len() - 1]);
    let ([start, _], [_, end]) = (first.end_directions(), last.end_directions());
    let ray = |end, direction, arc_length, sense| Ray {
        end,
        outwards: scale(sense, direction),
        normal: left(direction),
        arc_length,
        sense,
    };
    [
        ray(first.extent().points[0], start, 0.0, -1.0),
        ray(last.extent().points[1], end, length, 1.0),
    ]
}

/// Fails if the curve through `chain`, of `size` (m), crosses itself or its continuations.
fn check_crossing(
    mut chain: Vec<Vec<ProfilePoint>>,
    ends: Option<&[Ray; 2]>,
    size: f64,
) -> Result<(), SplineError> {
    if let Some([before, behind]) = ends {
        if let Some(position) =
            crossing::of_rays([before.end, before.outwards], [behind.end, behind.outwards])
        {
            return Err(SplineError::EndsCross { position });
        }
        // Beyond its size, no ray meets the curve.
        let far = |ray: &Ray| add(ray.end, scale(4.0 * size, ray.outwards));
        chain.insert(0, vec![far(before), before.end]);
        chain.push(vec![behind.end, far(behind)]);
    }
    match crossing::find(&chain, ends.is_none(), CROSSING_SHARE * size) {
        None => Ok(()),
        Some((i, j, position)) if ends.is_some() && (i == 0 || j + 1 == chain.len()) => {
            Err(SplineError::EndsCross { position })
        }
        Some((_, _, position)) => Err(SplineError::Crosses { position }),
    }
}

/// Returns the largest curvature ([`Spline::largest_curvatures`]) where the material is convex
/// (`sense` 1) or concave (−1).
fn largest_curvature(pieces: &[Piece], corners: &[Option<CurveCorner>], sense: f64) -> f64 {
    if corners
        .iter()
        .flatten()
        .any(|corner| corner.convex == (sense > 0.0))
    {
        return f64::INFINITY;
    }
    pieces
        .iter()
        .map(|piece| sense * piece.curvature(argmax(|u| sense * piece.curvature(u))))
        .fold(0.0, f64::max)
}

/// Equal parts of a piece in which its curvature is looked at.
const INTERVALS: i32 = 64;

/// Returns the parameter of a piece, from −1 to 1, at the end of some of its parts.
fn parameter(parts: i32) -> f64 {
    f64::from(2 * parts - INTERVALS) / f64::from(INTERVALS)
}

/// Returns the parameter of the largest `curvature` of a piece: the best of many, refined by thirds.
fn argmax(curvature: impl Fn(f64) -> f64) -> f64 {
    let at = parameter;
    let largest = (0..=INTERVALS).max_by(|&a, &b| curvature(at(a)).total_cmp(&curvature(at(b))));
    let step = largest.unwrap_or(0);
    let (mut low, mut high) = (at((step - 1).max(0)), at((step + 1).min(INTERVALS)));
    for _ in 0..60 {
        let (a, b) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
        if curvature(a) < curvature(b) {
            low = a;
        } else {
            high = b;
        }
    }
    let refined = (low + high) / 2.0;
    if curvature(refined) > curvature(at(step)) {
        refined
    } else {
        at(step)
    }
}
