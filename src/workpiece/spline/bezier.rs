//! Control polygons of Bézier curves: the spans of a B-spline, and bounds by their polygons.

use crate::equations::linear::{add, dot, scale, sub};
pub(super) use crate::workpiece::cross;

/// A point or vector in the plane of the profile.
pub(super) type ProfilePoint = [f64; 2];

/// Returns `a` turned by a quarter turn to the left.
#[inline(always)]
pub(super) fn left(a: ProfilePoint) -> ProfilePoint {
    [-a[1], a[0]]
}

/// Returns the unit vector along `a`.
#[inline(always)]
pub(super) fn unit(a: ProfilePoint) -> ProfilePoint {
    scale(1.0 / dot(a, a).sqrt(), a)
}

/// Returns the angle from `a` to `b`, positive to the left, in rad.
pub(super) fn angle(a: ProfilePoint, b: ProfilePoint) -> f64 {
    cross(a, b).atan2(dot(a, b))
}

/// Returns the control polygons of all spans of a uniform B-spline: clamped at its ends if it is
/// open, else periodic.
///
/// The control points of a span are values of the polar form (Ramshaw, "Blossoms are polar forms",
/// 1989): the `j`-th has `j` of its arguments at the end of the span and the others at the start.
pub(super) fn spans(
    points: &[ProfilePoint],
    degree: usize,
    closed: bool,
) -> Vec<Vec<ProfilePoint>> {
    let count = points.len();
    // Open curves have every knot before the start at the start, and every knot behind the end at
    // the end.
    let last = if closed { count } else { count - degree };
    let knot = |index: isize| {
        if closed {
            index as f64
        } else {
            index.clamp(0, last as isize) as f64
        }
    };
    // A closed curve starts at its first point if the degree is odd.
    let shift = if closed {
        count - (degree - 1) / 2 % count
    } else {
        0
    };
    (0..last)
        .map(|span| {
            let controls: Vec<ProfilePoint> = (0..=degree)
                .map(|i| points[(span + i + shift) % count])
                .collect();
            (0..=degree)
                .map(|end_arguments| {
                    let mut polar = controls.clone();
                    for round in 1..=degree {
                        let argument = (span + usize::from(round <= end_arguments)) as f64;
                        for i in 0..=degree - round {
                            // The control point `i` of this span lies over the knots from `span + i
                            // + 1 − degree` on.
                            let first = knot((span + i + round) as isize - degree as isize);
                            let behind = knot((span + i + 1) as isize);
                            let share = (argument - first) / (behind - first);
                            polar[i] =
                                add(scale(1.0 - share, polar[i]), scale(share, polar[i + 1]));
                        }
                    }
                    polar[0]
                })
                .collect()
        })
        .collect()
}

/// Returns the polygons of both halves (de Casteljau).
pub(super) fn halves(polygon: &[ProfilePoint]) -> [Vec<ProfilePoint>; 2] {
    let mut row = polygon.to_vec();
    let (mut first, mut second) = (vec![row[0]], vec![row[row.len() - 1]]);
    while row.len() > 1 {
        row = row
            .windows(2)
            .map(|pair| scale(0.5, add(pair[0], pair[1])))
            .collect();
        first.push(row[0]);
        second.push(row[row.len() - 1]);
    }
    second.reverse();
    [first, second]
}

/// Returns the polygon of the derivative by a parameter that runs over `range`; that of the zero
/// curve for a single point.
pub(super) fn derivative(polygon: &[ProfilePoint], range: f64) -> Vec<ProfilePoint> {
    if polygon.len() == 1 {
        return vec![[0.0; 2]];
    }
    let degree = (polygon.len() - 1) as f64;
    polygon
        .windows(2)
        .map(|pair| scale(degree / range, sub(pair[1], pair[0])))
        .collect()
}

/// Returns bounds of the dot product of two curves over their common range of the parameter: the
/// extremes of its coefficients.
pub(super) fn product_range(a: &[ProfilePoint], b: &[ProfilePoint]) -> [f64; 2] {
    let (m, n) = (a.len() - 1, b.len() - 1);
    (0..=m + n)
        .map(|k| {
            let terms = (k.saturating_sub(n)..=k.min(m))
                .map(|i| binomial(m, i) * binomial(n, k - i) * dot(a[i], b[k - i]));
            terms.sum::<f64>() / binomial(m + n, k)
        })
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
}

/// Returns the number of ways to choose `k` of `n`.
pub(super) fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
}

/// Returns the lower and upper corners of the box about `points`.
pub(super) fn bounds(points: &[ProfilePoint]) -> [ProfilePoint; 2] {
    points.iter().fold(
        [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
        |[low, high], point| {
            [
                [low[0].min(point[0]), low[1].min(point[1])],
                [high[0].max(point[0]), high[1].max(point[1])],
            ]
        },
    )
}
