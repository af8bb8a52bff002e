//! Cuts lines and polygons off at the edges of a frame.

use super::diagram::PixelRectangle;
use super::{CanvasPoint, fine};

/// Returns the point, from 0 to 1, at which the way between two points crosses an edge of the
/// frame. Signed distances from the edge are positive inside.
fn crossing(from: f64, to: f64) -> f64 {
    from / (from - to)
}

fn between(from: [f64; 2], to: [f64; 2], part: f64) -> [f64; 2] {
    [0, 1].map(|k| from[k] + part * (to[k] - from[k]))
}

/// Returns the signed distances of a point (in pixels) from the four edges of a frame, positive
/// inside.
fn distances([x, y]: [f64; 2], frame: PixelRectangle) -> [f64; 4] {
    let [left, top, right, bottom] = frame.map(f64::from);
    [x - left, y - top, right - x, bottom - y]
}

fn on_canvas([x, y]: [f64; 2]) -> CanvasPoint {
    [x, y]
        .map(|pixels| (pixels * f64::from(fine(1))).round() as i32)
        .into()
}

/// Returns the parts within `frame` of a line through points in pixels.
pub fn clip_line(points: &[[f64; 2]], frame: PixelRectangle) -> Vec<Vec<CanvasPoint>> {
    let mut parts: Vec<Vec<CanvasPoint>> = Vec::new();
    let mut goes_on = false;
    for pair in points.windows(2) {
        let (mut start, mut end) = (0.0_f64, 1.0_f64);
        for (from, to) in distances(pair[0], frame)
            .into_iter()
            .zip(distances(pair[1], frame))
        {
            match (from >= 0.0, to >= 0.0) {
                (true, true) => (),
                (false, false) => end = -1.0,
                (false, true) => start = start.max(crossing(from, to)),
                (true, false) => end = end.min(crossing(from, to)),
            }
        }
        if start > end {
            goes_on = false;
            continue;
        }
        let [from, to] = [start, end].map(|part| on_canvas(between(pair[0], pair[1], part)));
        match parts.last_mut().filter(|_| goes_on && start == 0.0) {
            Some(part) if part.last() != Some(&to) => part.push(to),
            Some(_) => (),
            None => parts.push(vec![from, to]),
        }
        goes_on = end == 1.0;
    }
    parts
}

/// Returns the part within `frame` of a polygon with corners in pixels (Sutherland and Hodgman
/// 1974); empty if it lies outside.
pub fn clip_polygon(corners: &[[f64; 2]], frame: PixelRectangle) -> Vec<CanvasPoint> {
    let mut corners = corners.to_vec();
    for edge in 0..4 {
        let distance = |corner: [f64; 2]| distances(corner, frame)[edge];
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (index, &corner) in corners.iter().enumerate() {
            let next = corners[(index + 1) % corners.len()];
            let (here, there) = (distance(corner), distance(next));
            if here >= 0.0 {
                kept.push(corner);
            }
            if (here >= 0.0) != (there >= 0.0) {
                kept.push(between(corner, next, crossing(here, there)));
            }
        }
        corners = kept;
    }
    corners.into_iter().map(on_canvas).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: PixelRectangle = [0, 0, 10, 10];

    #[test]
    fn lines_end_at_the_frame() {
        let inside = [[1.0, 1.0], [2.0, 3.0], [9.0, 9.0]];
        assert_eq!(
            clip_line(&inside, FRAME),
            [vec![(10, 10), (20, 30), (90, 90)]]
        );
        let out_and_in = [[5.0, 5.0], [5.0, -5.0], [7.0, -5.0], [7.0, 5.0]];
        assert_eq!(
            clip_line(&out_and_in, FRAME),
            [vec![(50, 50), (50, 0)], vec![(70, 0), (70, 50)]]
        );
        assert_eq!(
            clip_line(&[[-5.0, 5.0], [15.0, 5.0]], FRAME),
            [vec![(0, 50), (100, 50)]]
        );
        assert!(clip_line(&[[-5.0, 8.0], [2.0, 15.0]], FRAME).is_empty());
        assert!(clip_line(&[[1.0, 1.0]], FRAME).is_empty());
    }

    #[test]
    fn polygons_end_at_the_frame() {
        let square = [[5.0, 5.0], [15.0, 5.0], [15.0, 15.0], [5.0, 15.0]];
        assert_eq!(
            clip_polygon(&square, FRAME),
            [(50, 50), (100, 50), (100, 100), (50, 100)]
        );
        assert!(clip_polygon(&square.map(|[x, y]| [x + 20.0, y]), FRAME).is_empty());
        let around = [[-9.0, -9.0], [19.0, -9.0], [19.0, 19.0], [-9.0, 19.0]];
        assert_eq!(clip_polygon(&around, FRAME).len(), 4);
        assert!(clip_polygon(&[], FRAME).is_empty());
    }
}
