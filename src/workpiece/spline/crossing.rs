//! Crossings of a chain of curves with itself.

use super::bezier::{ProfilePoint, angle, bounds, cross, derivative, halves, left};
use crate::equations::linear::{add, dot, scale, sub};

/// Returns the first crossing of two links of a chain: the numbers of the links, and the position.
///
/// Each link is a polygon of a curve that turns by less than a quarter turn, and starts where the
/// one before it ends; a chain that is `closed` starts where it ends. Parts that cannot be told
/// apart when they are shorter than `tolerance` (m) count as crossing, except at the joints.
pub(super) fn find(
    links: &[Vec<ProfilePoint>],
    closed: bool,
    tolerance: f64,
) -> Option<(usize, usize, ProfilePoint)> {
    let boxes: Vec<[ProfilePoint; 2]> = links.iter().map(|link| bounds(link)).collect();
    (0..links.len())
        .flat_map(|i| (i + 1..links.len()).map(move |j| (i, j)))
        .find_map(|(i, j)| {
            if !overlap(&boxes[i], &boxes[j]) {
                return None;
            }
            let position = if j == i + 1 {
                between_neighbours(&links[i], &links[j], tolerance)
            } else if closed && i == 0 && j + 1 == links.len() {
                between_neighbours(&links[j], &links[i], tolerance)
            } else {
                between(&links[i], &links[j], tolerance)
            };
            position.map(|position| (i, j, position))
        })
}

/// Returns the crossing of two rays, each given by its end and direction.
pub(super) fn of_rays(
    [a, along_a]: [ProfilePoint; 2],
    [b, along_b]: [ProfilePoint; 2],
) -> Option<ProfilePoint> {
    let determinant = cross(along_a, along_b);
    let (on_a, on_b) = (
        cross(sub(b, a), along_b) / determinant,
        cross(sub(b, a), along_a) / determinant,
    );
    (on_a.is_finite() && on_b.is_finite() && on_a >= 0.0 && on_b >= 0.0)
        .then(|| add(a, scale(on_a, along_a)))
}

fn between(a: &[ProfilePoint], b: &[ProfilePoint], tolerance: f64) -> Option<ProfilePoint> {
    let (box_a, box_b) = (bounds(a), bounds(b));
    if !overlap(&box_a, &box_b) {
        return None;
    }
    if size(&box_a).max(size(&box_b)) < tolerance {
        return Some(a[0]);
    }
    let (larger, other) = if size(&box_a) < size(&box_b) {
        (b, a)
    } else {
        (a, b)
    };
    // Boxes along the axes of the plane hardly tell parallel parts from touching ones.
    let across = left(sub(larger[larger.len() - 1], larger[0]));
    let [[low, high], [low_other, high_other]] = [larger, other].map(|polygon| {
        let heights = polygon
            .iter()
            .map(|&point| dot(across, sub(point, larger[0])));
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], height| {
            [low.min(height), high.max(height)]
        })
    });
    if low > high_other || low_other > high {
        return None;
    }
    halves(larger)
        .iter()
        .find_map(|half| between(half, other, tolerance))
}

/// Works as [`between`], where `b` starts at the end of `a`.
fn between_neighbours(
    a: &[ProfilePoint],
    b: &[ProfilePoint],
    tolerance: f64,
) -> Option<ProfilePoint> {
    // Seen from the joint, each curve lies within the angle of its directions: they meet only there
    // if these are apart.
    let (chord_a, chord_b) = (sub(a[0], a[a.len() - 1]), sub(b[b.len() - 1], b[0]));
    if angle(chord_a, chord_b).abs() > spread(a, scale(-1.0, chord_a)) + spread(b, chord_b) {
        return None;
    }
    if size(&bounds(a)).max(size(&bounds(b))) < tolerance {
        return Some(b[0]);
    }
    let ([far_a, near_a], [near_b, far_b]) = (halves(a), halves(b));
    between(&far_a, &near_b, tolerance)
        .or_else(|| between(&far_a, &far_b, tolerance))
        .or_else(|| between(&near_a, &far_b, tolerance))
        .or_else(|| between_neighbours(&near_a, &near_b, tolerance))
}

/// Returns the largest angle between a curve's direction and its chord, in rad.
fn spread(polygon: &[ProfilePoint], chord: ProfilePoint) -> f64 {
    derivative(polygon, 1.0)
        .into_iter()
        .map(|direction| angle(chord, direction).abs())
        .fold(0.0, f64::max)
}

fn overlap([low_a, high_a]: &[ProfilePoint; 2], [low_b, high_b]: &[ProfilePoint; 2]) -> bool {
    (0..2).all(|i| low_a[i] <= high_b[i] && low_b[i] <= high_a[i])
}

fn size([low, high]: &[ProfilePoint; 2]) -> f64 {
    (high[0] - low[0]).max(high[1] - low[1])
}
