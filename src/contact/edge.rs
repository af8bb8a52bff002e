//! Contact of the centreline with an edge: at the point of the filament's polyline that is nearest
//! to the centre of its arc.
//!
//! The point lies at a fraction `ξ` of a segment. A force `F` there acts on both ends of the
//! segment, with `(1 − ξ) F` and `ξ F`: the virtual displacement of a point of a rigid segment is
//! this mean of those of its ends.

use super::{Approach, ContactLaw};
use crate::equations::NodeTangent;
use crate::equations::linear::{add, dot, mul, scale, sub};
use crate::workpiece::Edge;

/// Position in m and velocity in m/s of the filament's nodes by their number `0 … n`; `0` is the
/// root.
pub type NodeMotions<'a> = dyn Fn(usize) -> [[f64; 3]; 2] + 'a;

/// Positions of the nodes in the plane of the profile.
type InProfile<'a> = dyn Fn(usize) -> [f64; 2] + 'a;

/// A point of the filament's polyline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Index of the segment, from 0. Its ends are the nodes `segment` and `segment + 1`.
    pub segment: usize,
    /// Fraction `ξ` of the segment, from its inner end.
    pub fraction: f64,
}

impl Station {
    /// Finds the point of the polyline of `segments` segments that is nearest to the line of
    /// `centre` along the extrusion.
    fn nearest(segments: usize, nodes: &InProfile<'_>, centre: [f64; 2]) -> Self {
        let square = |&station: &Self| Projection::at(station.segment, nodes, centre).square;
        let all = (0..segments).map(|segment| Projection::at(segment, nodes, centre).station);
        all.min_by(|a, b| square(a).total_cmp(&square(b)))
            .expect("a filament has a segment")
    }

    /// Finds the point from a segment nearby: it is nearer than all others on its own and the
    /// adjacent segments.
    fn nearest_from(
        start: usize,
        segments: usize,
        nodes: &InProfile<'_>,
        centre: [f64; 2],
    ) -> Self {
        let mut here = Projection::at(start, nodes, centre);
        loop {
            let Self { segment, fraction } = here.station;
            let next = match fraction {
                1.0 if segment + 1 < segments => segment + 1,
                0.0 if segment > 0 => segment - 1,
                _ => return here.station,
            };
            let next = Projection::at(next, nodes, centre);
            if next.square >= here.square {
                return here.station;
            }
            here = next;
        }
    }

    /// Finds the point of the polyline that is nearest to `edge` at `time` (s). The search begins
    /// at the segment `start`, or goes over all.
    pub fn nearest_to(
        edge: &Edge,
        start: Option<usize>,
        segments: usize,
        nodes: &NodeMotions<'_>,
        time: f64,
    ) -> Self {
        /// Alternations between the nearest points of curve and polyline, which converge
        /// quadratically.
        const MAX_ALTERNATIONS: usize = 12;
        let in_profile = |index: usize| edge.in_profile(nodes(index)[0], time);
        let at = |centre| match start {
            Some(start) => Self::nearest_from(start, segments, &in_profile, centre),
            None => Self::nearest(segments, &in_profile, centre),
        };
        let mut here = at(edge.centre(None, time));
        if edge.is_arc() {
            return here;
        }
        // Beside a stretch of a spline, this may go from one bump to the next.
        let away = |station: &Self| {
            let [position, _] = station.motion(nodes);
            let surface = edge.surface(position, time);
            surface.gap.max(-surface.margin)
        };
        let tip = Self {
            segment: segments - 1,
            fraction: 1.0,
        };
        for _ in 0..MAX_ALTERNATIONS {
            let [position, _] = here.motion(nodes);
            let next = at(edge.centre(Some(edge.in_profile(position, time)), time));
            let moved = next.segment != here.segment
                || (next.fraction - here.fraction).abs() > 4.0 * f64::EPSILON;
            here = next;
            if !moved {
                break;
            }
        }
        if start.is_none() && away(&tip) < away(&here) {
            tip
        } else {
            here
        }
    }

    /// Returns the distance in m of the polyline from a `point` (m) in the plane of the profile of
    /// `edge`, at `time` (s).
    pub fn distance_from(
        point: [f64; 2],
        edge: &Edge,
        segments: usize,
        nodes: &NodeMotions<'_>,
        time: f64,
    ) -> f64 {
        let in_profile = |index: usize| edge.in_profile(nodes(index)[0], time);
        let squares =
            (0..segments).map(|segment| Projection::at(segment, &in_profile, point).square);
        squares.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Returns the shares `1 − ξ` and `ξ` of a force at this point on the ends of the segment.
    pub fn shares(&self) -> [f64; 2] {
        [1.0 - self.fraction, self.fraction]
    }

    /// Returns position (m) and velocity (m/s) of the filament's material there.
    pub fn motion(&self, nodes: &NodeMotions<'_>) -> [[f64; 3]; 2] {
        let ([inner, inner_rate], [outer, outer_rate]) =
            (nodes(self.segment), nodes(self.segment + 1));
        let [a, b] = self.shares();
        [
            add(scale(a, inner), scale(b, outer)),
            add(scale(a, inner_rate), scale(b, outer_rate)),
        ]
    }
}

/// Point of one segment that is nearest to a centre.
struct Projection {
    station: Station,
    /// Square of its distance in m².
    square: f64,
}

impl Projection {
    fn at(segment: usize, nodes: &InProfile<'_>, [x, y]: [f64; 2]) -> Self {
        let ([x_a, y_a], [x_b, y_b]) = (nodes(segment), nodes(segment + 1));
        let (along, from) = ([x_b - x_a, y_b - y_a], [x - x_a, y - y_a]);
        let fraction = (dot(along, from) / dot(along, along)).clamp(0.0, 1.0);
        let offset = sub(from, scale(fraction, along));
        Self {
            station: Station { segment, fraction },
            square: dot(offset, offset),
        }
    }
}

/// Contact of a filament with an edge.
#[derive(Clone, Copy, Debug)]
pub struct EdgeContact {
    /// Place on the filament.
    pub station: Station,
    /// Position in m.
    pub position: [f64; 3],
    /// Approach of the filament to the edge there.
    pub approach: Approach,
}

impl EdgeContact {
    /// Computes the contact at `time` (s) of the filament's point at `station` with `edge`, under
    /// `law`.
    pub fn new(
        law: &ContactLaw,
        edge: &Edge,
        station: Station,
        nodes: &NodeMotions<'_>,
        time: f64,
    ) -> Self {
        let [position, velocity] = station.motion(nodes);
        let approach = Approach::new(&edge.surface(position, time), velocity, law.radius);
        Self {
            station,
            position,
            approach,
        }
    }

    /// Returns the tangents of the forces on both ends of the segment by the motion of these ends:
    /// `[force][motion]`, inner end first.
    pub fn tangent(
        &self,
        law: &ContactLaw,
        edge: &Edge,
        nodes: &NodeMotions<'_>,
    ) -> [[NodeTangent<f64>; 2]; 2] {
        let Self {
            station, approach, ..
        } = self;
        let force = law.force(approach).total(approach);
        let at_point = law.tangent_without_turn(approach);
        let turned = law.turned(approach);
        let ([inner, inner_rate], [outer_end, outer_rate]) =
            (nodes(station.segment), nodes(station.segment + 1));
        let along = edge.across_extrusion(sub(outer_end, inner));
        let shares = station.shares();
        // Derivatives of the normal's angle and the fraction by the positions of the ends.
        let (angles, fractions) = if station.fraction > 0.0 && station.fraction < 1.0 {
            let square = dot(along, along);
            let from_centre = scale(1.0 / approach.turn, approach.normal);
            let turn = scale(-dot(approach.across, along) / square, approach.normal);
            let slip = |share: f64, sign: f64| {
                scale(
                    -1.0 / square,
                    add(scale(share, along), scale(sign, from_centre)),
                )
            };
            (
                [scale(-1.0, turn), turn],
                [slip(shares[0], -1.0), slip(shares[1], 1.0)],
            )
        } else {
            // The nearest point is a node.
            let turn = scale(approach.turn, approach.across);
            (
                [scale(shares[0], turn), scale(shares[1], turn)],
                [[0.0; 3]; 2],
            )
        };
        // The material at the point changes with the fraction.
        let by_fraction = mul(&at_point.velocity, sub(outer_rate, inner_rate));
        let mut tangent = [[NodeTangent {
            position: [[0.0; 3]; 3],
            velocity: [[0.0; 3]; 3],
        }; 2]; 2];
        for end in 0..2 {
            let of_force = add_outer(
                at_point.position.map(|row| scale(shares[end], row)),
                [(by_fraction, fractions[end]), (turned, angles[end])],
            );
            for (target, (share, sign)) in [(shares[0], -1.0), (shares[1], 1.0)]
                .into_iter()
                .enumerate()
            {
                let scaled = of_force.map(|row| scale(share, row));
                tangent[target][end] = NodeTangent {
                    position: add_outer(scaled, [(scale(sign, force), fractions[end])]),
                    velocity: at_point.velocity.map(|row| scale(share * shares[end], row)),
                };
            }
        }
        tangent
    }
}

/// Adds products of a column and a row to a matrix.
fn add_outer<const N: usize>(
    matrix: [[f64; 3]; 3],
    products: [([f64; 3], [f64; 3]); N],
) -> [[f64; 3]; 3] {
    products.iter().fold(matrix, |sum, &(column, row)| {
        std::array::from_fn(|i| add(sum[i], scale(column[i], row)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns three nodes, with component `number` moved by `step`: coordinates first, then
    /// velocities.
    fn moved(number: usize, step: f64) -> impl Fn(usize) -> [[f64; 3]; 2] {
        move |index| {
            let mut node = [
                [[0.0, 0.0, 0.0], [0.4, -0.3, 0.2]],
                [[0.003, 0.001, 0.0005], [1.4, -0.1, -0.3]],
                [[0.0061, 0.0011, 0.0007], [2.0, 0.5, -0.1]],
            ][index];
            if index > 0 && number / 6 == index - 1 {
                node[number % 6 / 3][number % 3] += step;
            }
            node
        }
    }

    #[test]
    fn tangents_are_the_derivatives_of_the_forces() {
        let law = ContactLaw {
            stiffness: 2e5,
            exponent: 1.3,
            damping: 0.2,
            radius: 1e-4,
            friction: 0.4,
            regularisation: 0.3,
        };
        // Inside the second segment, and at the node between both.
        for (centre, inside) in [([0.0045, 0.0005], true), ([0.0029, 0.0016], false)] {
            let edge = Edge::arc(centre, 1e-3, None, [0.1, 0.2, 0.0]);
            let forces = |number: usize, step: f64| {
                let nodes = moved(number, step);
                let station = Station::nearest_to(&edge, Some(1), 2, &nodes, 0.0);
                let EdgeContact { approach, .. } =
                    EdgeContact::new(&law, &edge, station, &nodes, 0.0);
                assert!(
                    approach.penetration > 0.0
                        && (station.fraction > 0.0) == inside
                        && station.segment == 1
                );
                station
                    .shares()
                    .map(|share| scale(share, law.force(&approach).total(&approach)))
            };
            let nodes = moved(0, 0.0);
            let station = Station::nearest_to(&edge, Some(1), 2, &nodes, 0.0);
            let tangent =
                EdgeContact::new(&law, &edge, station, &nodes, 0.0).tangent(&law, &edge, &nodes);
            for number in 0..12 {
                let step = if number % 6 < 3 { 1e-9 } else { 1e-5 };
                let (above, below) = (forces(number, step), forces(number, -step));
                for force in 0..2 {
                    let NodeTangent { position, velocity } = &tangent[force][number / 6];
                    let (matrix, size) = if number % 6 < 3 {
                        (position, 1e5)
                    } else {
                        (velocity, 10.0)
                    };
                    for row in 0..3 {
                        let difference = (above[force][row] - below[force][row]) / (2.0 * step);
                        let error = (matrix[row][number % 3] - difference).abs();
                        assert!(
                            error < 1e-6 * size,
                            "{inside} {force} {number} {row}: {matrix:?} {difference}"
                        );
                    }
                }
            }
        }
    }
}
