//! Errors of control points that do not make a profile.

use std::error::Error;
use std::fmt;

/// Error of a [`Spline`](super::Spline) that cannot be made. Control points count from 1, positions
/// are in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SplineError {
    /// A control point is not a number, or too far away to be computed with.
    NotFinite {
        /// Number of the control point.
        point: usize,
    },
    /// The degree is not from 1 to 10.
    Degree {
        /// Degree that was asked for.
        degree: usize,
    },
    /// The degree takes more control points.
    TooFewPoints {
        /// Control points given.
        given: usize,
        /// Control points needed.
        needed: usize,
        /// Degree of the spline.
        degree: usize,
        /// `true` if it is closed.
        closed: bool,
    },
    /// The curve has no direction somewhere, because control points coincide.
    Stops {
        /// Position.
        position: [f64; 2],
        /// Number of the nearest control point.
        point: usize,
    },
    /// The curve turns by half a turn at a corner, back onto itself.
    TurnsBack {
        /// Corner.
        position: [f64; 2],
        /// Number of the nearest control point.
        point: usize,
    },
    /// The curve crosses or touches itself.
    Crosses {
        /// Position.
        position: [f64; 2],
    },
    /// An end of an open curve, continued straight, meets the curve or the other end.
    EndsCross {
        /// Position.
        position: [f64; 2],
    },
}

impl fmt::Display for SplineError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { point } => write!(
                formatter,
                "control point {point} of the spline is not finite or farther than {:e} m from the origin; correct it",
                super::MAX_COORDINATE
            ),
            Self::Degree { degree } => {
                write!(
                    formatter,
                    "a spline of degree {degree} is not supported; choose a degree from 1 to 10"
                )
            }
            Self::TooFewPoints {
                given,
                needed,
                degree,
                closed,
            } => write!(
                formatter,
                "{} spline of degree {degree} needs at least {needed} control points, not {given}; add points, or lower the \
                 degree",
                if closed { "a closed" } else { "an open" }
            ),
            Self::Stops {
                position: [x, y],
                point,
            } => write!(
                formatter,
                "the spline stops at ({x} m, {y} m), near control point {point}, and has no direction there; remove \
                 repeated points, or move the points nearby apart"
            ),
            Self::TurnsBack {
                position: [x, y],
                point,
            } => write!(
                formatter,
                "the spline turns back onto itself at ({x} m, {y} m), near control point {point}; move the points nearby \
                 apart"
            ),
            Self::Crosses { position: [x, y] } => write!(
                formatter,
                "the spline crosses or touches itself near ({x} m, {y} m); move the control points nearby, or put them in \
                 the order in which the curve passes them"
            ),
            Self::EndsCross { position: [x, y] } => write!(
                formatter,
                "the profile is open, and its ends, continued straight, cross it near ({x} m, {y} m); close it, or move \
                 the ends"
            ),
        }
    }
}

impl Error for SplineError {}
