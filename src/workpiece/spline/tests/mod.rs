//! Unit tests of splines.

mod refusals;

use std::f64::consts::{PI, TAU};

use fastrand::Rng;

use super::*;

/// Returns the curve at `t` by the recursion of Cox and de Boor, independent of the pieces: `t`
/// runs over the spans, from 0.
fn de_boor(points: &[ProfilePoint], degree: usize, closed: bool, t: f64) -> ProfilePoint {
    let (count, shift) = (points.len(), (degree - 1) / 2);
    let spans = if closed { count } else { count - degree };
    let all: Vec<ProfilePoint> = if closed {
        (0..count + degree)
            .map(|i| points[(i + count - shift) % count])
            .collect()
    } else {
        points.to_vec()
    };
    let knot = |i: usize| {
        let uniform = i as f64 - degree as f64;
        if closed {
            uniform
        } else {
            uniform.clamp(0.0, spans as f64)
        }
    };
    let span = (t.floor().max(0.0) as usize).min(spans - 1) + degree;
    let mut row: Vec<ProfilePoint> = (0..=degree).map(|j| all[span - degree + j]).collect();
    for round in 1..=degree {
        for j in (round..=degree).rev() {
            let i = span - degree + j;
            let share = (t - knot(i)) / (knot(i + 1 + degree - round) - knot(i));
            row[j] = add(scale(1.0 - share, row[j - 1]), scale(share, row[j]));
        }
    }
    row[degree]
}

/// A curve, and the samples of it for brute force.
struct Sampled {
    spline: Spline,
    curve: Box<dyn Fn(f64) -> ProfilePoint>,
    samples: Vec<ProfilePoint>,
    step: f64,
    closed: bool,
}

impl Sampled {
    fn new(points: Vec<ProfilePoint>, degree: usize, closed: bool) -> Self {
        let spline = Spline::new(&points, degree, closed)
            .unwrap_or_else(|error| panic!("degree {degree}: {error}"));
        let spans = if closed {
            points.len()
        } else {
            points.len() - degree
        };
        let intervals = 2000_usize.div_ceil(spans) * spans;
        let step = spans as f64 / intervals as f64;
        let curve = move |t: f64| de_boor(&points, degree, closed, t);
        let samples = (0..=intervals).map(|i| curve(i as f64 * step)).collect();
        Self {
            spline,
            curve: Box::new(curve),
            samples,
            step,
            closed,
        }
    }

    /// Returns the distance from `point` by trying all samples, refined about the nearest of them.
    /// Continuations count.
    fn distance(&self, point: ProfilePoint) -> f64 {
        let distance = |q: ProfilePoint| (q[0] - point[0]).hypot(q[1] - point[1]);
        let square = |i: &usize| dot(sub(self.samples[*i], point), sub(self.samples[*i], point));
        let best = (0..self.samples.len())
            .min_by(|a, b| square(a).total_cmp(&square(b)))
            .expect("there are samples");
        let last = (self.samples.len() - 1) as f64;
        let (mut low, mut high) = ((best as f64 - 1.0).max(0.0), (best as f64 + 1.0).min(last));
        for _ in 0..30 {
            let (a, b) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
            let [at_a, at_b] = [a, b].map(|i| distance((self.curve)(i * self.step)));
            (low, high) = if at_a < at_b { (low, b) } else { (a, high) };
        }
        let on_curve = distance((self.curve)((low + high) / 2.0 * self.step))
            .min(distance(self.samples[best]));
        let rays = self.spline.ends.iter().flatten().map(|ray| {
            let way = dot(sub(point, ray.end), ray.outwards).max(0.0);
            distance(add(ray.end, scale(way, ray.outwards)))
        });
        rays.fold(on_curve, f64::min)
    }

    /// Returns `true` if `point` is on the left-hand side, by the angle under which the curve
    /// passes it.
    fn is_outside(&self, point: ProfilePoint) -> bool {
        let far = self
            .spline
            .ends
            .iter()
            .flatten()
            .map(|ray| add(ray.end, scale(1e6, ray.outwards)));
        let far: Vec<ProfilePoint> = far.collect();
        let chain: Vec<ProfilePoint> = match far[..] {
            [before, behind] => [&[before], &self.samples[..], &[behind]].concat(),
            _ => self.samples.clone(),
        };
        let seen: f64 = chain
            .windows(2)
            .map(|pair| angle(sub(pair[0], point), sub(pair[1], point)))
            .sum();
        if self.closed {
            let area: f64 = self
                .samples
                .windows(2)
                .map(|pair| cross(pair[0], pair[1]))
                .sum();
            if area > 0.0 { seen > PI } else { seen > -PI }
        } else {
            seen > 0.0
        }
    }
}

/// Returns waves along x whose crests and troughs are far tighter than the distances from which
/// they are seen.
fn wavy(rng: &mut Rng, count: usize) -> Vec<ProfilePoint> {
    (0..count)
        .map(|i| {
            [
                0.004 * i as f64,
                0.003 * (1.9 * i as f64).sin() + 0.003 * rng.f64(),
            ]
        })
        .collect()
}

/// Returns symmetric lobes, clockwise around the origin: points on their axes have several nearest
/// points.
fn lobes(count: usize) -> Vec<ProfilePoint> {
    (0..count)
        .map(|i| {
            let angle = -TAU * i as f64 / count as f64;
            let radius = 0.03 * (1.0 + 0.35 * (4.0 * angle).cos());
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect()
}

/// Returns the centre of curvature at a share of the length; a point of the curve where it is
/// straight.
fn centre_of_curvature(spline: &Spline, share: f64) -> ProfilePoint {
    let (point, direction) = spline.at(share * spline.length());
    let curvature = spline.nearest(point).curvature;
    let radius = if curvature.abs() > 1.0 {
        1.0 / curvature
    } else {
        0.0
    };
    sub(point, scale(radius, left(direction)))
}

fn parabola() -> Spline {
    // y = x²/0.1 from x = −0.1 to 0.1: with x = 0.1 a and y = 0.1 b, b = a².
    Spline::new(&[[-0.1, 0.1], [0.0, -0.1], [0.1, 0.1]], 2, false).expect("it is a parabola")
}

#[test]
fn nearest_is_that_of_brute_force() {
    let mut rng = Rng::with_seed(15);
    let mut points = 0;
    for degree in [1, 2, 3, 5, 10] {
        let around = lobes(24);
        let curves = [
            Sampled::new(wavy(&mut rng, 25), degree, false),
            Sampled::new(around.clone(), degree, true),
            Sampled::new(around.into_iter().rev().collect(), degree, true),
            Sampled::new(wavy(&mut rng, degree + 1), degree, false),
        ];
        for curve in curves {
            let [low, high] = bounds(&curve.samples);
            let size = (high[0] - low[0]).max(high[1] - low[1]);
            let centre = scale(0.5, add(low, high));
            for i in 0..5000 {
                let spread = match i % 4 {
                    0 => 0.6,
                    1 => 1.5,
                    2 => 40.0,
                    _ => 0.0,
                } * size;
                let offset = [
                    spread * (2.0 * rng.f64() - 1.0),
                    spread * (2.0 * rng.f64() - 1.0),
                ];
                // A quarter lies close to the curve; some are exactly between two lobes, or see a
                // stretch at one distance.
                let near = curve.samples[rng.usize(..curve.samples.len())];
                let point = match i % 4 {
                    3 => add(near, [1e-4 * (rng.f64() - 0.5), 1e-4 * (rng.f64() - 0.5)]),
                    0 if i % 20 == 0 => add(centre, [0.0, offset[1]]),
                    0 if i % 20 == 4 => centre_of_curvature(&curve.spline, rng.f64()),
                    _ => add(centre, offset),
                };
                let foot = curve.spline.nearest(point);
                let expected = curve.distance(point);
                let what = format!("degree {degree}, {point:?}: {foot:?}, {expected}");
                let distance = (foot.point[0] - point[0]).hypot(foot.point[1] - point[1]);
                // Brute force may stop short of the minimum, not below it.
                assert!(distance <= expected + 1e-15 * (1.0 + expected), "{what}");
                assert!(
                    (foot.gap.abs() - distance).abs() <= 1e-15 + 1e-14 * distance,
                    "{what}"
                );
                let (on_curve, direction) = curve.spline.at(foot.arc_length);
                assert!(
                    dot(sub(on_curve, foot.point), sub(on_curve, foot.point)).sqrt()
                        < 1e-11 * (1.0 + expected),
                    "{what}"
                );
                if foot.curvature.is_finite() {
                    assert!(
                        dot(
                            sub(foot.normal, left(direction)),
                            sub(foot.normal, left(direction))
                        ) < 1e-12,
                        "{what}"
                    );
                }
                if i % 16 < 4 && expected > 1e-6 {
                    assert_eq!(foot.gap > 0.0, curve.is_outside(point), "{what}");
                }
                points += 1;
            }
        }
    }
    assert_eq!(points, 100_000);
}

#[test]
fn the_gradient_of_the_gap_is_the_normal() {
    let mut rng = Rng::with_seed(16);
    for degree in [2, 3, 5, 10] {
        let spline = Spline::new(&lobes(24), degree, true).expect("it is closed");
        for _ in 0..2000 {
            let (on_curve, direction) = spline.at(spline.length() * rng.f64());
            // Within the reach of every trough, the foot is the point that one starts from.
            let gap = 0.002 * (rng.f64() - 0.5);
            let point = add(on_curve, scale(gap, left(direction)));
            let foot = spline.nearest(point);
            assert!(
                (foot.gap - gap).abs() < 1e-16 && foot.gap.signum() == gap.signum(),
                "{foot:?}"
            );
            assert!(
                dot(sub(foot.point, on_curve), sub(foot.point, on_curve)).sqrt() < 1e-15,
                "{foot:?}"
            );
            let ahead = spline.nearest(add(point, scale(1e-6, foot.normal)));
            assert!((ahead.gap - foot.gap - 1e-6).abs() < 1e-16);
            // Along the curve of equal gap, the normal turns with the curvature 1/(1/κ + gap).
            let beside = spline.nearest(add(point, scale(1e-7, direction)));
            let turn = -cross(beside.normal, foot.normal) / 1e-7;
            let expected = -1.0 / (1.0 / foot.curvature + foot.gap);
            assert!(
                (turn - expected).abs() < 0.02 * (1.0 + expected.abs()),
                "{turn} {expected}"
            );
        }
    }
}

#[test]
fn lines_of_all_degrees_are_lines() {
    for degree in 1..=10 {
        let points: Vec<ProfilePoint> = (0..14)
            .map(|i| [0.03 * i as f64, 0.04 * i as f64])
            .collect();
        let spline = Spline::new(&points, degree, false).expect("it is a line");
        assert!((spline.length() - 0.65).abs() < 1e-14 && !spline.is_closed());
        assert_eq!(spline.smallest_convex_radius(), f64::INFINITY);
        for along in [-3.0, -0.01, 0.0, 0.2, 0.65, 0.7, 90.0] {
            for gap in [-0.3, 0.0, 1e-9, 4.0] {
                let foot = spline.nearest([0.6 * along - 0.8 * gap, 0.8 * along + 0.6 * gap]);
                let tolerance = 1e-15 * (1.0 + f64::abs(along));
                assert!(
                    (foot.gap - gap).abs() < tolerance
                        && (foot.arc_length - along).abs() < 4.0 * tolerance,
                    "{foot:?}"
                );
                assert!(
                    (foot.normal[0] + 0.8).abs() < 1e-14 && (foot.normal[1] - 0.6).abs() < 1e-14,
                    "{foot:?}"
                );
                assert!(foot.curvature.abs() < 1e-10, "{foot:?}");
                let (point, direction) = spline.at(along);
                assert!(
                    (point[0] - 0.6 * along).abs() < tolerance
                        && (direction[1] - 0.8).abs() < 1e-14
                );
            }
        }
    }
}

#[test]
fn a_parabola_is_one() {
    let spline = parabola();
    // Twice 0.1 [½ √5 + ¼ asinh 2].
    let length = 0.2 * (0.5 * 5.0_f64.sqrt() + 0.25 * 2.0_f64.asinh());
    assert!(
        (spline.length() - length).abs() < 1e-12,
        "{}",
        spline.length() - length
    );
    assert_eq!(spline.smallest_convex_radius(), f64::INFINITY);
    for i in 0..=200 {
        let a = -1.0 + 0.01 * f64::from(i);
        // Above the bottom, up to its centre of curvature at 0.05, no other point is nearer.
        for gap in [-0.2, -1e-3, 0.0, 1e-9, 0.049] {
            let speed = (1.0 + 4.0 * a * a).sqrt();
            let normal = [-2.0 * a / speed, 1.0 / speed];
            let foot = spline.nearest([0.1 * a + gap * normal[0], 0.1 * a * a + gap * normal[1]]);
            assert!((foot.gap - gap).abs() < 2e-16, "{a} {gap}: {foot:?}");
            assert!(
                (foot.point[0] - 0.1 * a).abs() < 1e-14,
                "{a} {gap}: {foot:?}"
            );
            assert!(
                (foot.normal[0] - normal[0]).abs() < 1e-13
                    && (foot.normal[1] - normal[1]).abs() < 1e-13
            );
            if a.abs() < 1.0 {
                assert!(
                    (foot.curvature + 20.0 / speed.powi(3)).abs() < 1e-11,
                    "{foot:?}"
                );
                let arc = length / 2.0 + 0.1 * (0.5 * a * speed + 0.25 * (2.0 * a).asinh());
                assert!(
                    (foot.arc_length - arc).abs() < 1e-12,
                    "{} {arc}",
                    foot.arc_length
                );
            }
        }
    }
    // From the axis beyond that centre, two points are equally near: y² + (x − h)² is least at x =
    // h − 0.05.
    let foot = spline.nearest([0.0, 0.09]);
    assert!(
        (foot.gap - (0.04_f64 * 0.1 + 0.05 * 0.05).sqrt()).abs() < 1e-15,
        "{foot:?}"
    );
}

#[test]
fn a_closed_cubic_is_close_to_a_circle() {
    for clockwise in [true, false] {
        let sense = if clockwise { -1.0 } else { 1.0 };
        let at = |i: i32| (sense * TAU / 64.0 * f64::from(i)).sin_cos();
        let points: Vec<ProfilePoint> = (0..64)
            .map(at)
            .map(|(sin, cos)| [2.0 + 0.05 * cos, 0.05 * sin])
            .collect();
        let spline = Spline::new(&points, 3, true).expect("it is a circle");
        let radius = 0.05 * (2.0 + (TAU / 64.0).cos()) / 3.0;
        assert!(spline.is_closed() && (spline.length() / (TAU * radius) - 1.0).abs() < 1e-6);
        let outwards = -sense;
        for (distance, angle) in [
            (0.0, 0.0),
            (1e-7, 2.0),
            (0.02, 1.0),
            (0.051, 6.0),
            (30.0, 4.0),
        ] {
            let foot =
                spline.nearest([2.0 + distance * f64::cos(angle), distance * f64::sin(angle)]);
            assert!(
                (foot.gap - outwards * (distance - radius)).abs() < 1e-6 * radius,
                "{foot:?}"
            );
            assert!(
                (foot.curvature * radius * outwards - 1.0).abs() < 2e-3,
                "{foot:?}"
            );
        }
        let convex = if clockwise { radius } else { f64::INFINITY };
        assert!(
            spline.smallest_convex_radius() == convex
                || (spline.smallest_convex_radius() / convex - 1.0).abs() < 2e-3
        );
        let (point, direction) = spline.at(-0.25 * spline.length());
        assert!(
            (point[1] + sense * radius).abs() < 1e-15 && (direction[0] - 1.0).abs() < 1e-12,
            "{point:?} {direction:?}"
        );
    }
}

#[test]
fn corners_are_nearest_from_their_sectors() {
    // An edge: along x, then down. Once by degree 1, once by three equal points at degree 3.
    let polygon = [[-0.1, 0.0], [0.0, 0.0], [0.0, -0.1]];
    let cubic = [
        [-0.1, 0.0],
        [-0.05, 0.0],
        [0.0, 0.0],
        [0.0, 0.0],
        [0.0, 0.0],
        [0.0, -0.05],
        [0.0, -0.1],
    ];
    for spline in [
        Spline::new(&polygon, 1, false),
        Spline::new(&cubic, 3, false),
    ] {
        let spline = spline.expect("it is an edge");
        assert!(spline.smallest_convex_radius() == 0.0 && (spline.length() - 0.2).abs() < 1e-15);
        let foot = spline.nearest([0.003, 0.004]);
        assert!(
            foot.gap == 0.005
                && foot.curvature == f64::INFINITY
                && (foot.arc_length - 0.1).abs() < 1e-15,
            "{foot:?}"
        );
        assert!(
            (foot.normal[0] - 0.6).abs() < 1e-15 && (foot.normal[1] - 0.8).abs() < 1e-15,
            "{foot:?}"
        );
        assert!((spline.nearest([-0.001, -0.003]).gap + 0.001).abs() < 1e-17);
        let at_corner = spline.nearest([0.0, 0.0]);
        assert!(
            at_corner.gap == 0.0 && (at_corner.normal[0] - 0.5_f64.sqrt()).abs() < 1e-15,
            "{at_corner:?}"
        );
    }
    let groove =
        Spline::new(&[[-0.1, 0.1], [0.0, 0.0], [0.1, 0.1]], 1, false).expect("it is a groove");
    assert_eq!(groove.smallest_convex_radius(), f64::INFINITY);
    let foot = groove.nearest([0.0, -0.02]);
    assert!(
        (foot.gap + 0.02).abs() < 1e-16 && (foot.normal[1] - 1.0).abs() < 1e-15,
        "{foot:?}"
    );
    assert_eq!(foot.curvature, f64::NEG_INFINITY);
    assert!((groove.nearest([0.0, 0.02]).gap - 0.02 * 0.5_f64.sqrt()).abs() < 1e-17);
}

#[test]
fn the_smallest_convex_radius_is_that_of_the_crest() {
    // Passed to the left, the material of the parabola is above it: convex, with radius 0.05 at the
    // bottom.
    let spline =
        Spline::new(&[[0.1, 0.1], [0.0, -0.1], [-0.1, 0.1]], 2, false).expect("it is a parabola");
    assert!((spline.smallest_convex_radius() - 0.05).abs() < 1e-15);
    assert!(spline.nearest([0.01, 0.0]).gap > 0.0 && spline.nearest([0.0, 0.01]).gap < 0.0);
}

#[test]
fn queries_far_away_or_without_a_number_end() {
    let spline = parabola();
    assert!((spline.nearest([0.0, -1e9]).gap + 1e9).abs() < 1.0);
    for point in [
        [f64::NAN, 0.0],
        [0.0, f64::INFINITY],
        [1e300, -1e300],
        [f64::NAN; 2],
    ] {
        let _ = spline.nearest(point);
    }
}

#[test]
fn queries_allocate_nothing() {
    let spline = Spline::new(&lobes(24), 5, true).expect("it is closed");
    let mut rng = Rng::with_seed(17);
    let allocations = allocation_counter::measure(|| {
        for _ in 0..1000 {
            // Some of these are beyond centres of curvature, some outside the grid.
            let point = [0.1, 10.0].map(|spread| spread * (rng.f64() - 0.5));
            assert!(spline.nearest(point).gap.is_finite());
        }
    });
    assert_eq!(allocations.count_total, 0);
}
