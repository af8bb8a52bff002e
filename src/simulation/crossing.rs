//! Events in a step: openings and closings of a contact.
//!
//! No event is missed: a part of a step is skipped only where a bound excludes events.
//!
//! - *Way.* Within a step a node follows a quintic with the Bézier points `P_0 … P_5`. Its
//!   derivatives by the fraction `s` of the step are at most `5 max |P_{i+1} − P_i|` and `20 max
//!   |P_{i+2} − 2 P_{i+1} + P_i|`. A gap changes by no more than [`GAP_RATE`] times the way
//!   ([`Workpiece::surface`]). The distance of the filament from the centre of an edge changes by
//!   no more than the way of the fastest node.
//! - *Bend.* A gap also deviates from its chord by no more than a parabola with its largest second
//!   derivative. That derivative comes from the path and from the largest curvature of the surface
//!   ([`Workpiece::largest_curvatures`],
//!   [`Edge::largest_curvatures`](crate::workpiece::Edge::largest_curvatures)). Past convex
//!   material a gap turns up by no more than this. Where another point becomes the nearest one, it
//!   turns down. If the curvature is unknown, the parabola holds over a way of less than a quarter
//!   of a segment, or of a stretch of a spline. Its second derivative is then twice the value that
//!   the local curvature, or values and slopes at both ends, show (MODEL, "Workpieces other than a
//!   plane").
//! - *Border.* The margin at an arc is the distance from a straight line. A parabola bounds it,
//!   too, over ways shorter than from one border to the next. Without this bound, a step in which a
//!   point presses near a border would have hundreds of parts.
//! - *Jump.* Far above a hollow the nearest point of the workpiece jumps from side to side, and the
//!   margin jumps with it. There the bound on its change does not hold. Where a gap jumps, another
//!   point of the filament has become the nearest one.
//! - A contact stays open while its penetration is negative, the nearest point is elsewhere, or its
//!   damping would pull. It stays closed while none of these holds.
//!
//! A part for which no bound holds is halved, until its way is below the tolerance of the event's
//! location. An event that is then missed is no deeper than that.

use super::filament::{Filament, Touch};
use super::search::root as root_of;
use super::step::{Step, at_knots};
use crate::contact::Approach;
use crate::contact::edge::Station;
use crate::equations::linear::{add, dot, scale, sub};
use crate::integrate::hermite::Knot;
use crate::tool::ClampMotion;
use crate::workpiece::{Workpiece, border_spacing};

/// Largest change of a gap over the distance that a point travels.
pub(super) const GAP_RATE: f64 = 2.0;
/// Safety factor on estimated second derivatives.
const INFLATION: f64 = 2.0;
/// Share of a segment, or of a stretch of a spline, over which the parabola holds.
const SMOOTH_SHARE: f64 = 0.25;
/// Largest number of evaluations of a contact in one step. A step that needs more is rejected.
const MAX_POINTS: usize = 1000;
/// Number of halvings of a step down to rounding.
const MAX_HALVINGS: usize = 60;
/// Largest number of crossings that turn out not to be the first.
const MAX_CROSSINGS: usize = 64;

/// Closing or opening of a contact inside a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub contact: usize,
    /// Estimated time after the start of the step in s; zero if it lies before.
    pub after: f64,
    /// Time after the start at which the contact is past the event, in s.
    pub past: f64,
    /// `true` if the contact is past the event at the end of the step. Between the ends only the
    /// interpolant shows the event.
    pub at_end: bool,
}

/// Error of a step that is too long to find a contact's events.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooLong;

/// Returns the distance of a contact past its event, in m: pressing while open, or pulling while
/// closed, by more than `location`.
///
/// The two thresholds differ by twice `location`, so that a contact that has just switched does not
/// switch back.
pub(super) fn excess(closed: bool, pressing: f64, location: f64) -> f64 {
    (if closed { -pressing } else { pressing }) - location
}

/// Returns upper bounds in m on the first and second derivative of a node's path by the fraction of
/// a step of the length `length` (s).
fn path_bounds(start: &Knot<3>, end: &Knot<3>, length: f64) -> [f64; 2] {
    let (early, late) = (
        scale(length / 5.0, start.rate),
        scale(length / 5.0, end.rate),
    );
    let square = length * length / 20.0;
    let second = add(
        start.value,
        add(scale(2.0, early), scale(square, start.acceleration)),
    );
    let third = add(
        sub(end.value, scale(2.0, late)),
        scale(square, end.acceleration),
    );
    let points = [
        start.value,
        add(start.value, early),
        second,
        third,
        sub(end.value, late),
        end.value,
    ];
    let largest = |square: f64, vector: [f64; 3]| square.max(dot(vector, vector));
    let first = points
        .windows(2)
        .map(|pair| sub(pair[1], pair[0]))
        .fold(0.0, largest);
    let bends = points
        .windows(3)
        .map(|three| sub(add(three[0], three[2]), scale(2.0, three[1])));
    [5.0 * first.sqrt(), 20.0 * bends.fold(0.0, largest).sqrt()]
}

/// Contact at one instant of a step.
#[derive(Clone, Copy, Debug)]
struct ContactInstant {
    /// Fraction of the step.
    s: f64,
    /// Penetration in m, and its derivative by the fraction.
    penetration: f64,
    slope: f64,
    /// Values of [`Approach`].
    turn: f64,
    margin: f64,
    /// Place on the filament: a node or the inside of a segment, numbered from the root.
    place: usize,
    /// `1 + χ δ̇`
    factor: f64,
    /// Distance past the event, in m.
    excess: f64,
}

/// Search for the events of one contact in a step by evaluations at instants.
struct EventSearch {
    closed: bool,
    location: f64,
    /// Upper bounds by the fraction of the step, in m: on the change of the gap, on the change of
    /// the margin, and on the second derivatives of the path and of the distance from a border.
    way: f64,
    margin_way: f64,
    bend: f64,
    border_bend: f64,
    /// Largest sum of way and penetration, in m, up to which the margin is the distance from one
    /// border.
    border_spacing: f64,
    /// Upper bound on the way of the point relative to the workpiece, in m.
    path: f64,
    /// Way over which gaps are smooth, in m.
    near: f64,
    /// Upper bound on the curvature, in 1/m, with which the gap can turn towards the event;
    /// infinite if unknown.
    curvature: f64,
    /// `χ` over the length of the step, in 1/m.
    damping: f64,
    /// Upper bound on the rounding of differences of positions, in m.
    rounding: f64,
    /// Gap in m up to which the nearest point of the workpiece does not jump.
    unique: f64,
}

impl EventSearch {
    /// Returns an upper bound on the second derivative of the penetration between two instants.
    fn bend_between(&self, a: &ContactInstant, b: &ContactInstant) -> f64 {
        if self.curvature.is_finite() {
            return self.bend + self.curvature * self.path * self.path;
        }
        let width = b.s - a.s;
        let chord = (b.penetration - a.penetration) / width;
        let seen = (b.slope - a.slope)
            .abs()
            .max(2.0 * (chord - a.slope).abs())
            .max(2.0 * (b.slope - chord).abs());
        let seen = (seen - self.rounding / width).max(0.0);
        INFLATION
            * (self.bend + a.turn.abs().max(b.turn.abs()) * self.path * self.path).max(seen / width)
    }

    /// Returns `true` if the contact has no event between two instants before its event.
    fn is_free(&self, a: &ContactInstant, b: &ContactInstant) -> bool {
        let width = b.s - a.s;
        let bend = self.bend_between(a, b);
        let is_near = self.curvature.is_finite() || self.path * width <= self.near;
        // Arguments: distances from the event at both ends in m, and bounds on their derivatives.
        let holds = |[a, b]: [f64; 2], way: f64, bend: f64| {
            a >= 0.0
                && b >= 0.0
                && (a + b >= way * width || a.sqrt() + b.sqrt() >= (bend / 2.0).sqrt() * width)
        };
        let unbounded = f64::INFINITY;
        let sign = if self.closed { 1.0 } else { -1.0 };
        let slack = 2.0 * self.location;
        let missing =
            |value: fn(&ContactInstant) -> f64| [a, b].map(|look| sign * value(look) + slack);
        let jumps = (b.penetration - a.penetration).abs() > self.way * width + slack;
        let by_penetration = match (jumps, missing(|look| look.penetration)) {
            (false, missing) => holds(missing, self.way, if is_near { bend } else { unbounded }),
            (true, [a, b]) => a.min(b) >= self.way * width,
        };
        let farthest = self.way * width / 2.0 - a.penetration.min(b.penetration);
        let at_one_border = a.place == b.place
            && self.way * width + a.penetration.max(b.penetration).max(0.0) <= self.border_spacing;
        let border_bend = if at_one_border {
            self.border_bend
        } else {
            unbounded
        };
        let by_margin = farthest <= self.unique
            && holds(missing(|look| look.margin), self.margin_way, border_bend);
        let by_damping = || {
            let deepest = a.penetration.abs().max(b.penetration.abs()) + self.way * width;
            let missing = [a, b].map(|look| sign * look.factor + slack / deepest);
            holds(missing, self.damping * bend, unbounded)
        };
        if self.closed {
            by_penetration && by_margin && (self.damping == 0.0 || by_damping())
        } else {
            by_penetration || by_margin || (self.damping != 0.0 && by_damping())
        }
    }

    /// Returns the first two instants found from `from` to `to` of which the second is past the
    /// event. At both ends the contact is before the event.
    fn first_past(
        &self,
        look: &impl Fn(f64) -> ContactInstant,
        [from, to]: [ContactInstant; 2],
        points: &mut usize,
    ) -> Result<Option<[ContactInstant; 2]>, TooLong> {
        if self.is_free(&from, &to) {
            return Ok(None);
        }
        let mut rights = [to; MAX_HALVINGS + 1];
        let (mut left, mut count) = (from, 1);
        while count > 0 {
            let right = rights[count - 1];
            let width = right.s - left.s;
            if self.is_free(&left, &right)
                || self.way * width <= self.location / 2.0
                || count > MAX_HALVINGS
            {
                (left, count) = (right, count - 1);
                continue;
            }
            *points += 1;
            if *points > MAX_POINTS {
                return Err(TooLong);
            }
            let middle = look((left.s + right.s) / 2.0);
            if middle.excess > 0.0 {
                return Ok(Some([left, middle]));
            }
            rights[count] = middle;
            count += 1;
        }
        Ok(None)
    }

    /// Returns the fractions of the step at the first event and at an instant when the contact is
    /// past it. `start` and `end` are the contact at both ends.
    fn first(
        &self,
        look: impl Fn(f64) -> ContactInstant,
        [start, end]: [ContactInstant; 2],
    ) -> Result<Option<[f64; 2]>, TooLong> {
        if start.excess > 0.0 {
            return Ok(Some([0.0; 2]));
        }
        let (mut before, mut found, mut points) = (start, None, 0);
        let mut to = end;
        for _ in 0..MAX_CROSSINGS {
            if to.excess > 0.0 {
                let crossing = root_of(|s| look(s).excess, before.s, to.s);
                found = Some([crossing, to.s]);
                to = ContactInstant {
                    excess: 0.0,
                    ..look(crossing)
                };
            }
            match self.first_past(&look, [before, to], &mut points)? {
                Some([left, past]) => (before, to) = (left, past),
                None => return Ok(found),
            }
        }
        Err(TooLong)
    }
}

/// Returns a lower bound in m on the distance of `contact` from its event at the end of a step, and
/// its first event in the interpolated step. Points of the workpiece move by no more than `drift`
/// (m).
pub(super) fn crossing<M: ClampMotion, W: Workpiece>(
    filament: &Filament<M, W>,
    step: &Step<'_>,
    contact: usize,
    location: f64,
    drift: f64,
) -> Result<(f64, Option<Crossing>), TooLong> {
    let (length, closed) = (step.length(), step.closed[contact]);
    let look = |s: f64, place: usize, approach: &Approach| ContactInstant {
        s,
        penetration: approach.penetration,
        slope: approach.penetration_rate * length,
        turn: approach.turn,
        margin: approach.margin,
        place,
        factor: 1.0 + filament.law.damping * approach.penetration_rate,
        excess: excess(closed, filament.law.pressing(approach), location),
    };
    let border_spacing = border_spacing(filament.workpiece.edges());
    let tip = step.end_nodes[filament.chain.segments() - 1].value;
    let rounding = 16.0 * f64::EPSILON * dot(tip, tip).sqrt();
    let search = |[path, bend]: [f64; 2],
                  [margin_way, border_bend]: [f64; 2],
                  [curvature, concave]: [f64; 2],
                  smooth: f64| EventSearch {
        closed,
        location,
        way: GAP_RATE * (path + drift),
        margin_way,
        bend,
        border_bend,
        border_spacing,
        path: path + drift,
        near: SMOOTH_SHARE * smooth,
        curvature,
        damping: filament.law.damping / length,
        rounding,
        unique: if concave.is_finite() {
            0.5 / concave
        } else {
            f64::INFINITY
        },
    };
    let found = if let Some(edge) = contact.checked_sub(step.start_nodes.len()) {
        let ends = [
            (step.start_nodes, step.start.time, 0.0),
            (step.end_nodes, step.end.time, 1.0),
        ];
        let on_edge = |s,
                       Touch {
                           station, approach, ..
                       }: &Touch| {
            let outwards = if station.fraction >= 1.0 {
                2
            } else {
                usize::from(station.fraction > 0.0)
            };
            look(s, 2 * station.segment + outwards, approach)
        };
        let [start, end] = ends.map(|(knots, time, s)| {
            on_edge(
                s,
                &filament.touch(contact, &at_knots(filament, knots, time, 0.0), None, time),
            )
        });
        let edge = &filament.workpiece.edges()[edge];
        // An open contact is at least its gap away from its event. Beside a stretch of a spline the
        // point that was found may not be the nearest one. No point of the stretch is farther from
        // its middle than half its length.
        let distance = if closed {
            0.0
        } else {
            let gap = edge
                .middle(step.end.time)
                .map_or(-end.penetration, |middle| {
                    let nodes = at_knots(filament, step.end_nodes, step.end.time, 0.0);
                    let away = Station::distance_from(
                        middle,
                        edge,
                        step.end_nodes.len(),
                        &nodes,
                        step.end.time,
                    );
                    away - edge.length() / 2.0 - filament.law.radius
                });
            (location + gap).max(0.0)
        };
        let knots = step.start_nodes.iter().zip(step.end_nodes);
        let bounds = knots.fold([0.0_f64; 2], |[way, bend], (start, end)| {
            let [path, path_bend] = path_bounds(start, end, length);
            [way.max(path), bend.max(path_bend)]
        });
        // The point is not fixed to the material: it moves round the centre as the segment turns,
        // by up to twice the way over its length.
        let (round, segment) = (
            edge.radius() + filament.law.radius + bounds[0],
            filament.chain.length,
        );
        let margin_way = GAP_RATE * (bounds[0] + drift) * (1.0 + 2.0 * round / segment);
        // Bound for the foot of the centre on a rigid segment. The factor also covers points that
        // leave a node and come back.
        let border_bend = INFLATION
            * 16.0
            * (1.0 + round / segment)
            * (bounds[1] + (bounds[0] + drift).powi(2) / segment);
        let at = |s: f64| {
            on_edge(
                s,
                &filament.touch(contact, &step.nodes(filament, s), None, step.time(s)),
            )
        };
        // The point that presses may change, and the penetration then turns up.
        let [convex, concave] = edge.largest_curvatures();
        let curvatures = [if closed { f64::INFINITY } else { convex }, concave];
        let smooth = if edge.is_arc() {
            filament.chain.length
        } else {
            filament.chain.length.min(edge.length())
        };
        (
            distance,
            search(bounds, [margin_way, border_bend], curvatures, smooth)
                .first(at, [start, end])?,
        )
    } else {
        let (start, end) = (&step.start_nodes[contact], &step.end_nodes[contact]);
        let near = |s, knot: &Knot<3>, time| {
            look(
                s,
                contact,
                &filament.approach(contact, knot.value, knot.rate, time),
            )
        };
        let ends = [
            near(0.0, start, step.start.time),
            near(1.0, end, step.end.time),
        ];
        let distance = match closed {
            false => location - ends[1].penetration,
            true if filament.law.damping == 0.0 => {
                ends[1].penetration.min(ends[1].margin) + location
            }
            true => 0.0,
        };
        let bounds = path_bounds(start, end, length);
        let at = |s: f64| {
            let (position, velocity) = step.node(contact, s);
            look(
                s,
                contact,
                &filament.approach(contact, position, velocity, step.time(s)),
            )
        };
        let margin_way = GAP_RATE * (bounds[0] + drift);
        let [convex, concave] = filament.workpiece.largest_curvatures();
        // The offset surface of a thick node is more curved where it is concave.
        let thick = 1.0 - concave * filament.law.radius;
        let curvature = match closed {
            false => convex,
            true if thick > 0.0 => concave / thick,
            true => f64::INFINITY,
        };
        let margin_bounds = [margin_way, bounds[1]];
        (
            distance.max(0.0),
            search(
                bounds,
                margin_bounds,
                [curvature, concave],
                filament.chain.length,
            )
            .first(at, ends)?,
        )
    };
    let (distance, fractions) = found;
    let crossing = fractions.map(|[after, past]| Crossing {
        contact,
        after: after * length,
        past: past * length,
        at_end: past == 1.0,
    });
    Ok((distance, crossing))
}
