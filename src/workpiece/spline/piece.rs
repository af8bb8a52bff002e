//! A piece of the curve that turns so little that its chord serves as an axis.

use std::array;
use std::f64::consts::PI;

use super::bezier::{
    ProfilePoint, binomial, bounds, cross, derivative, halves, left, product_range, unit,
};
use super::grid::Extent;
use crate::equations::linear::{add, dot, scale, sub};

/// Largest degree of a spline.
pub(super) const MAX_DEGREE: usize = 10;

/// Tangent of the largest angle between a piece and its chord.
const LARGEST_SLOPE: f64 = 0.2;

/// Largest ratio of the speeds at two places of a piece, by its parameter.
const LARGEST_SPEED_RATIO: f64 = 1.7;

/// Terms of the series for arc length, which leave an error below 1e-9 of the piece.
const LENGTH_TERMS: usize = 10;

/// Part of the curve, in a frame of its own: origin in the middle of its chord, first axis along
/// the chord.
///
/// Its parameter `u` runs from −1 to 1, and `c(u)` is a polynomial.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    /// Middle of the chord, in m.
    origin: ProfilePoint,
    /// Unit vector along the chord.
    axis: ProfilePoint,
    /// Half the length of the chord, in m.
    half: f64,
    /// Range of heights over the chord, in m.
    heights: [f64; 2],
    /// Bound of `|c'|` across the chord over that along it.
    slope: f64,
    /// `c'` at both ends.
    end_velocities: [ProfilePoint; 2],
    /// Bounds of `|c'|² + c · c''`.
    bend: [f64; 2],
    /// Corners of the box about `c''`.
    accelerations: [ProfilePoint; 2],
    /// Bounds of `|3 c' · c'' + c · c'''|` and `|c'''|`.
    jerk: [f64; 2],
    degree: usize,
    /// Coefficients of the powers of `u` in `c`.
    coefficients: [ProfilePoint; MAX_DEGREE + 1],
    /// Arc length of the curve up to the start of this piece, in m.
    pub start: f64,
    /// Coefficients of the powers of `u` in the arc length from the start of this piece.
    lengths: [f64; LENGTH_TERMS + 1],
}

impl Piece {
    /// Creates the piece with the control polygon `polygon`, as the first of the curve; `None` if
    /// it turns too much to be one piece.
    pub fn new(polygon: &[ProfilePoint]) -> Option<Self> {
        let degree = polygon.len() - 1;
        let (first, last) = (polygon[0], polygon[degree]);
        let axis = unit(sub(last, first));
        let origin = scale(0.5, add(first, last));
        let local: Vec<ProfilePoint> = polygon
            .iter()
            .map(|&point| into_frame(axis, sub(point, origin)))
            .collect();
        let velocity = derivative(&local, 2.0);
        let [lowest, highest] = bounds(&velocity);
        let slope = lowest[1].abs().max(highest[1].abs()) / lowest[0];
        if !(lowest[0] > 0.0
            && slope <= LARGEST_SLOPE
            && highest[0] <= LARGEST_SPEED_RATIO * lowest[0])
        {
            return None;
        }
        let acceleration = derivative(&velocity, 2.0);
        let third = derivative(&acceleration, 2.0);
        let (squared_speed, outwards) = (
            product_range(&velocity, &velocity),
            product_range(&local, &acceleration),
        );
        let (mixed, skew) = (
            product_range(&velocity, &acceleration),
            product_range(&local, &third),
        );
        let largest = |[low, high]: [f64; 2]| low.abs().max(high.abs());
        let [low, high] = bounds(&local);
        let mut piece = Self {
            origin,
            axis,
            half: local[degree][0],
            heights: [low[1], high[1]],
            slope,
            end_velocities: [velocity[0], velocity[velocity.len() - 1]],
            bend: [
                squared_speed[0] + outwards[0],
                squared_speed[1] + outwards[1],
            ],
            accelerations: bounds(&acceleration),
            jerk: [
                3.0 * largest(mixed) + largest(skew),
                largest(product_range(&third, &third)).sqrt(),
            ],
            degree,
            coefficients: taylor(&local),
            start: 0.0,
            lengths: [0.0; LENGTH_TERMS + 1],
        };
        piece.lengths = piece.integrate_speed();
        Some(piece)
    }

    /// Returns `point` (m) in the frame of this piece.
    #[inline]
    pub fn local(&self, point: ProfilePoint) -> ProfilePoint {
        into_frame(self.axis, sub(point, self.origin))
    }

    /// Maps a vector of the frame of this piece to that of the profile.
    #[inline]
    pub fn global_direction(&self, [along, across]: ProfilePoint) -> ProfilePoint {
        add(scale(along, self.axis), scale(across, left(self.axis)))
    }

    /// Maps a point of the frame of this piece to that of the profile, in m.
    #[inline]
    pub fn global(&self, local: ProfilePoint) -> ProfilePoint {
        add(self.origin, self.global_direction(local))
    }

    /// Returns `c`, `c'` and `c''` at `u`.
    #[inline]
    pub fn evaluate(&self, u: f64) -> [ProfilePoint; 3] {
        let (mut value, mut first, mut half_second) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for &coefficient in self.coefficients[..=self.degree].iter().rev() {
            half_second = add(scale(u, half_second), first);
            first = add(scale(u, first), value);
            value = add(scale(u, value), coefficient);
        }
        [value, first, scale(2.0, half_second)]
    }

    /// Returns the curvature at `u` in 1/m, positive where the curve turns to the right.
    #[inline]
    pub fn curvature(&self, u: f64) -> f64 {
        let [_, velocity, acceleration] = self.evaluate(u);
        let squared_speed = dot(velocity, velocity);
        -cross(velocity, acceleration) / (squared_speed * squared_speed.sqrt())
    }

    /// Returns the arc length in m from the start of this piece to `u`.
    #[inline]
    pub fn arc_length(&self, u: f64) -> f64 {
        self.lengths
            .iter()
            .rev()
            .fold(0.0, |sum, coefficient| sum * u + coefficient)
    }

    /// Returns the arc length of the whole piece in m.
    pub fn length(&self) -> f64 {
        self.arc_length(1.0)
    }

    /// Returns the parameter at `arc_length` (m) from the start of this piece.
    pub fn parameter_at(&self, arc_length: f64) -> f64 {
        let mut u = 2.0 * arc_length / self.length() - 1.0;
        // The speed varies little, so that Newton's method converges from everywhere.
        for _ in 0..8 {
            let [_, velocity, _] = self.evaluate(u);
            let step = (self.arc_length(u) - arc_length) / dot(velocity, velocity).sqrt();
            u -= step;
            if step.abs() <= 2.0 * f64::EPSILON {
                break;
            }
        }
        u.clamp(-1.0, 1.0)
    }

    /// Returns the unit vectors along the curve at the start and at the end.
    pub fn end_directions(&self) -> [ProfilePoint; 2] {
        self.end_velocities
            .map(|velocity| unit(self.global_direction(velocity)))
    }

    /// Returns the extent of the piece.
    pub fn extent(&self) -> Extent {
        let [low, high] = self.heights;
        Extent {
            centre: self.global([0.0, (low + high) / 2.0]),
            radius: self.half.hypot((high - low) / 2.0),
            points: [
                self.global([-self.half, 0.0]),
                self.global([self.half, 0.0]),
            ],
        }
    }

    /// Returns a lower bound of the squared distance from `point` (of this frame, in m) to the
    /// piece: that to the box about it.
    #[inline]
    pub fn squared_distance_bound(&self, [along, height]: ProfilePoint) -> f64 {
        let beyond = (along.abs() - self.half).max(0.0);
        let off = (height - self.heights[1])
            .max(self.heights[0] - height)
            .max(0.0);
        beyond * beyond + off * off
    }

    /// Returns the parameter of the point nearest to `point` (of this frame, in m), and the squared
    /// distance to it. Any result serves if that is above `limit`.
    ///
    /// Half the squared distance has the derivatives `f = (c − p) · c'` and `f' = |c'|² + (c − p) ·
    /// c''`. Where the bounds of `f'` say that `f` rises, the signs of `f` at the ends say whether
    /// its root lies between them.
    #[inline]
    pub fn nearest(&self, point: ProfilePoint, limit: f64) -> (f64, f64) {
        let [along, height] = point;
        let [start, end] = [[-self.half - along, -height], [self.half - along, -height]];
        let [low, high] = self.accelerations;
        let from = |sign: f64, i: usize| if sign > 0.0 { high[i] } else { low[i] };
        let least = self.bend[0] - along * from(along, 0) - height * from(height, 1);
        let steep = self.slope * (height.abs() + self.heights[1] - self.heights[0]);
        if least > 0.0 {
            let [at_start, at_end] = [
                dot(start, self.end_velocities[0]),
                dot(end, self.end_velocities[1]),
            ];
            if at_start < 0.0 && at_end > 0.0 {
                return self.root(point, [-1.0, 1.0], [at_start, at_end]);
            }
        } else if along.abs() - self.half <= steep {
            // Else the distance rises all along the piece.
            let most = self.bend[1] - along * from(-along, 0) - height * from(-height, 1);
            if most >= 0.0 {
                return self.search(point, limit);
            }
        }
        let squares = [dot(start, start), dot(end, end)];
        if squares[0] <= squares[1] {
            (-1.0, squares[0])
        } else {
            (1.0, squares[1])
        }
    }

    /// Returns the root of a rising `f` between `low` and `high`, and the squared distance there.
    /// Newton's method is kept between the bounds found so far. `at_low ≤ 0 ≤ at_high` are the
    /// values of `f`.
    #[inline]
    fn root(
        &self,
        point: ProfilePoint,
        [mut low, mut high]: [f64; 2],
        [at_low, at_high]: [f64; 2],
    ) -> (f64, f64) {
        let mut u = (low * at_high - high * at_low) / (at_high - at_low);
        let mut squared = f64::INFINITY;
        for _ in 0..100 {
            let [value, velocity, acceleration] = self.evaluate(u);
            let offset = sub(value, point);
            let (f, slope) = (
                dot(offset, velocity),
                dot(velocity, velocity) + dot(offset, acceleration),
            );
            if f > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let newton = u - f / slope;
            let next = if newton >= low && newton <= high {
                newton
            } else {
                (low + high) / 2.0
            };
            let step = next - u;
            squared = dot(offset, offset) + f * step;
            u = next;
            // The error of the next iterate is of the order of the square of this step.
            if step.abs() <= 1e-10 {
                break;
            }
        }
        (u, squared)
    }

    /// Works as [`nearest`](Self::nearest), where `f` may fall: for points near the centre of
    /// curvature and beyond it.
    ///
    /// Halves intervals until they can hold no nearer point, no root of `f`, no minimum, or one
    /// root of a rising `f`.
    #[cold]
    fn search(&self, point: ProfilePoint, limit: f64) -> (f64, f64) {
        let jerk = self.jerk[0] + self.jerk[1] * dot(point, point).sqrt();
        let squares = [-self.half, self.half].map(|along| {
            let offset = sub([along, 0.0], point);
            dot(offset, offset)
        });
        let mut best = if squares[0] <= squares[1] {
            (-1.0, squares[0])
        } else {
            (1.0, squares[1])
        };
        // Middles and half widths. Each halving leaves one interval behind.
        let mut intervals = [(0.0, 1.0); 48];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (middle, half) = intervals[count];
            let [value, velocity, acceleration] = self.evaluate(middle);
            let offset = sub(value, point);
            let (squared, f) = (dot(offset, offset), dot(offset, velocity));
            let slope = dot(velocity, velocity) + dot(offset, acceleration);
            if squared < best.1 {
                best = (middle, squared);
            }
            // Taylor's theorem with the bound of `f''`.
            let drift = jerk * half;
            let least = squared - half * (2.0 * f.abs() + half * ((-slope).max(0.0) + drift / 3.0));
            let may_be_nearer = least < best.1.min(limit) * (1.0 - 4.0 * f64::EPSILON);
            let has_root = f.abs() <= half * (slope.abs() + drift / 2.0);
            if !may_be_nearer || !has_root || slope < -drift {
                continue;
            }
            let [low, high] = [middle - half, middle + half];
            if slope > drift {
                let [at_low, at_high] = [low, high].map(|u| {
                    let [value, velocity, _] = self.evaluate(u);
                    dot(sub(value, point), velocity)
                });
                if at_low <= 0.0 && at_high >= 0.0 {
                    let found = self.root(point, [low, high], [at_low, at_high]);
                    best = if found.1 < best.1 { found } else { best };
                }
            } else if count + 2 <= intervals.len() {
                for side in [-1.0, 1.0] {
                    intervals[count] = (middle + side * half / 2.0, half / 2.0);
                    count += 1;
                }
            }
        }
        best
    }

    /// Returns the coefficients of [`arc_length`](Self::arc_length): the integral of the Chebyshev
    /// series of the speed.
    fn integrate_speed(&self) -> [f64; LENGTH_TERMS + 1] {
        let angles: [f64; LENGTH_TERMS] =
            array::from_fn(|i| PI * (i as f64 + 0.5) / LENGTH_TERMS as f64);
        let speeds = angles.map(|angle| {
            let [_, velocity, _] = self.evaluate(angle.cos());
            dot(velocity, velocity).sqrt()
        });
        let series: [f64; LENGTH_TERMS] = array::from_fn(|k| {
            let sum: f64 = angles
                .iter()
                .zip(speeds)
                .map(|(angle, speed)| speed * (k as f64 * angle).cos())
                .sum();
            sum * if k == 0 { 1.0 } else { 2.0 } / LENGTH_TERMS as f64
        });
        // Powers of `u` in the speed, by the recursion of the Chebyshev polynomials.
        let mut polynomial = [0.0; LENGTH_TERMS];
        let (mut before, mut current) = ([0.0; LENGTH_TERMS], [0.0; LENGTH_TERMS]);
        current[0] = 1.0;
        for (k, coefficient) in series.into_iter().enumerate() {
            let factor = if k == 0 { 1.0 } else { 2.0 };
            polynomial = array::from_fn(|i| polynomial[i] + coefficient * current[i]);
            let next = array::from_fn(|i| {
                if i == 0 {
                    -before[0]
                } else {
                    factor * current[i - 1] - before[i]
                }
            });
            (before, current) = (current, next);
        }
        let mut lengths = [0.0; LENGTH_TERMS + 1];
        for (k, coefficient) in polynomial.into_iter().enumerate() {
            lengths[k + 1] = coefficient / (k + 1) as f64;
            lengths[0] += if k % 2 == 0 {
                lengths[k + 1]
            } else {
                -lengths[k + 1]
            };
        }
        lengths
    }
}

/// Returns the components of `vector` along `axis` and to the left of it.
#[inline(always)]
fn into_frame(axis: ProfilePoint, vector: ProfilePoint) -> ProfilePoint {
    [dot(axis, vector), cross(axis, vector)]
}

/// Returns the coefficients of the powers of `u`, from −1 to 1, of the curve with the control
/// polygon `polygon`.
fn taylor(polygon: &[ProfilePoint]) -> [ProfilePoint; MAX_DEGREE + 1] {
    // The parameter of the second half is `u` itself.
    let [_, mut differences] = halves(polygon);
    let degree = polygon.len() - 1;
    let mut coefficients = [[0.0; 2]; MAX_DEGREE + 1];
    for k in 0..=degree {
        coefficients[k] = scale(binomial(degree, k), differences[0]);
        differences = differences
            .windows(2)
            .map(|pair| sub(pair[1], pair[0]))
            .collect();
    }
    coefficients
}
