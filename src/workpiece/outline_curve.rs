//! Straight faces, arcs and circles of which outlines consist.

use std::f64::consts::{FRAC_PI_2, PI};

use super::cross;
use crate::equations::linear::{add, dot, scale, sub};

/// One curve of an outline. Lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OutlineCurve {
    /// Line from `point` along the unit vector `direction`, between two arc lengths, which can be
    /// infinite.
    Line {
        point: [f64; 2],
        direction: [f64; 2],
        from: f64,
        to: f64,
    },
    /// Convex arc, from the outward normal `first` to `second` in the negative sense, by less than
    /// half a turn.
    Arc {
        centre: [f64; 2],
        radius: f64,
        first: [f64; 2],
        second: [f64; 2],
    },
    /// Whole circle around `centre`; the material is inside it where it is convex, else outside.
    Circle {
        centre: [f64; 2],
        radius: f64,
        convex: bool,
    },
}

/// Face of a curve as a point sees it.
pub(super) struct Seen {
    pub(super) gap: f64,
    pub(super) normal: [f64; 2],
    pub(super) curvature: f64,
    /// Distance of the point past the curve's ends in m; negative between them.
    pub(super) past: f64,
}

impl OutlineCurve {
    pub(super) fn see(&self, position: [f64; 2]) -> Seen {
        match *self {
            Self::Line {
                point,
                direction,
                from,
                to,
            } => {
                let normal = left(direction);
                let offset = sub(position, point);
                let along = dot(direction, offset);
                Seen {
                    gap: dot(normal, offset),
                    normal,
                    curvature: 0.0,
                    past: (from - along).max(along - to),
                }
            }
            Self::Arc {
                centre,
                radius,
                first,
                second,
            } => {
                let offset = sub(position, centre);
                let distance = dot(offset, offset).sqrt();
                let past = -cross(second, offset).min(cross(offset, first));
                Seen {
                    gap: distance - radius,
                    normal: scale(1.0 / distance, offset),
                    curvature: 1.0 / radius,
                    past,
                }
            }
            Self::Circle {
                centre,
                radius,
                convex,
            } => {
                let offset = sub(position, centre);
                let distance = dot(offset, offset).sqrt();
                let sign = if convex { 1.0 } else { -1.0 };
                // At the centre every direction is one.
                let normal = match distance > 0.0 {
                    true => scale(sign / distance, offset),
                    false => [0.0, 1.0],
                };
                Seen {
                    gap: sign * (distance - radius),
                    normal,
                    curvature: sign / radius,
                    past: f64::NEG_INFINITY,
                }
            }
        }
    }

    /// Returns the arc lengths of the curve within the distance `reach` (m) of the origin, from its
    /// own start.
    pub(super) fn range(&self, reach: f64) -> [f64; 2] {
        match *self {
            Self::Line {
                point,
                direction,
                from,
                to,
            } => {
                let nearest = -dot(point, direction);
                [from.max(nearest - reach), to.min(nearest + reach)]
            }
            Self::Arc {
                radius,
                first,
                second,
                ..
            } => [0.0, radius * cross(second, first).atan2(dot(first, second))],
            Self::Circle { radius, .. } => [-PI * radius, PI * radius],
        }
    }

    /// Returns point and direction at an arc length. A circle starts where it is nearest to the
    /// tool.
    pub(super) fn at(&self, length: f64) -> [[f64; 2]; 2] {
        let on_circle = |centre, radius, angle: f64, turn: f64| {
            let (sin, cos) = angle.sin_cos();
            [
                add(centre, [radius * cos, radius * sin]),
                [-turn * sin, turn * cos],
            ]
        };
        match *self {
            Self::Line {
                point, direction, ..
            } => [add(point, scale(length, direction)), direction],
            Self::Arc {
                centre,
                radius,
                first: [x, y],
                ..
            } => on_circle(centre, radius, y.atan2(x) - length / radius, -1.0),
            // The material is on the right-hand side: a convex circle is gone round in the negative
            // sense.
            Self::Circle {
                centre,
                radius,
                convex: true,
            } => on_circle(centre, radius, FRAC_PI_2 - length / radius, -1.0),
            Self::Circle {
                centre,
                radius,
                convex: false,
            } => on_circle(centre, radius, length / radius - FRAC_PI_2, 1.0),
        }
    }

    /// Returns the own arc lengths between which the curve is within the distance `reach` (m) of
    /// the tool axis; the whole circle if across its end; `None` if nowhere.
    pub(super) fn stretch(&self, reach: f64) -> Option<[f64; 2]> {
        let (nearest, square) = self.nearest([0.0; 2]);
        if square >= reach * reach {
            return None;
        }
        match *self {
            Self::Line {
                point,
                direction,
                from,
                to,
            } => {
                let (foot, away) = (-dot(point, direction), dot(left(direction), point));
                let half = (reach * reach - away * away).max(0.0).sqrt();
                Some([from.max(foot - half), to.min(foot + half)])
            }
            Self::Arc { .. } => Some(self.range(reach)),
            Self::Circle { centre, radius, .. } => {
                // |c + r e|² = reach²
                let away = dot(centre, centre);
                let cos = (away + radius * radius - reach * reach) / (2.0 * away.sqrt() * radius);
                let half = radius * cos.clamp(-1.0, 1.0).acos();
                let stretch = [nearest - half, nearest + half];
                let whole = self.range(reach);
                let inside = stretch[0] > whole[0] && stretch[1] < whole[1];
                Some(if inside { stretch } else { whole })
            }
        }
    }

    /// Returns the own arc length of the point nearest to `position`, and its squared distance in
    /// m².
    pub(super) fn nearest(&self, position: [f64; 2]) -> (f64, f64) {
        let length = match *self {
            Self::Line {
                point,
                direction,
                from,
                to,
            } => dot(direction, sub(position, point)).clamp(from, to),
            Self::Arc {
                centre,
                radius,
                first,
                second,
            } => {
                let offset = sub(position, centre);
                let angle = |from: [f64; 2], to: [f64; 2]| cross(to, from).atan2(dot(from, to));
                let whole = angle(first, second);
                // Beyond the arc, the nearer of its ends: half a turn goes from the middle of the
                // arc to the opposite side.
                let middle = turned(first, whole / 2.0);
                radius * (whole / 2.0 + angle(middle, offset)).clamp(0.0, whole)
            }
            Self::Circle {
                centre,
                radius,
                convex,
            } => {
                let [x, y] = sub(position, centre);
                if convex {
                    radius * x.atan2(y)
                } else {
                    radius * x.atan2(-y)
                }
            }
        };
        let offset = sub(position, self.at(length)[0]);
        (length, dot(offset, offset))
    }
}

pub(super) fn left([x, y]: [f64; 2]) -> [f64; 2] {
    [-y, x]
}

/// Returns a direction turned in the negative sense by an angle in rad.
pub(super) fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}
