//! Unit tests of the search for candidate pairs.

use std::f64::consts::TAU;

use fastrand::Rng;

use super::*;
use crate::equations::linear::{add, scale};

const REACH: f64 = 1.2e-3;

/// Returns a number between −1 and 1.
fn about_zero(random: &mut Rng) -> f64 {
    2.0 * random.f64() - 1.0
}

/// Filaments on a body, by their roots in its frame.
struct Scene {
    layout: Layout,
    roots: Vec<[f64; 3]>,
    /// Bend and tilt of each, in rad.
    shapes: Vec<[f64; 2]>,
}

impl Scene {
    /// Creates two rows of filaments on a body of `radius` (m), `pitch` (m) apart.
    fn new(radius: f64, pitch: f64, segments: usize, period: Option<f64>) -> Self {
        let (filaments, length) = (21, 6.0 * REACH / segments as f64);
        let radii = vec![0.5 * REACH; filaments * segments];
        let root = |filament: usize| {
            let (sin, cos) = sin_cos(pitch / radius * (filament / 2) as f64);
            [radius * cos, radius * sin, pitch * (filament % 2) as f64]
        };
        Self {
            layout: Layout::new(vec![length; filaments], radii, 2, period),
            roots: (0..filaments).map(root).collect(),
            shapes: vec![[0.0; 2]; filaments],
        }
    }

    /// Places the nodes of a filament, bent to a circle, in the frame from which the body has
    /// turned by `angle` (rad).
    fn place(&self, filament: usize, angle: f64, positions: &mut Field) {
        let Layout {
            segments, lengths, ..
        } = &self.layout;
        let (root, [bend, tilt]) = (self.roots[filament], self.shapes[filament]);
        let (sin, cos) = sin_cos(angle);
        let mut position = root;
        for k in 0..=*segments {
            let [x, y, z] = position;
            positions.set(
                NodeIndex::new(filament, k, *segments),
                [cos * x - sin * y, sin * x + cos * y, z],
            );
            let around = root[1].atan2(root[0]) + bend * (k as f64 + 0.5) / *segments as f64;
            let direction = [
                tilt.cos() * around.cos(),
                tilt.cos() * around.sin(),
                tilt.sin(),
            ];
            position = add(position, scale(lengths[filament], direction));
        }
    }
}

/// Returns all points within reach, in the order of the search.
fn found(candidates: &mut Candidates) -> Vec<([usize; 2], Near)> {
    let mut found = Vec::new();
    for watched in candidates.by_group() {
        watched.for_each_near(|filaments, near| found.push((filaments, *near)));
    }
    found
}

/// Moves a scene at random, and compares the search with the one without bounds. Groups wake
/// one after the other, move by a little or a lot, and the first one is left out in the end.
/// Returns the numbers of points within reach, and of lists of pairs that were built.
fn compare(mut scene: Scene, seed: u64) -> [usize; 2] {
    let mut random = Rng::with_seed(seed);
    let Layout {
        filaments,
        segments,
        ..
    } = scene.layout;
    let [mut bounded, mut exhaustive] =
        [true, false].map(|bounds| Candidates::new(scene.layout.clone(), bounds));
    let mut positions = Field::new(scene.layout.groups(), segments);
    (0..filaments).for_each(|filament| scene.place(filament, 0.0, &mut positions));
    let (mut met, mut built, mut before) = (0, 0, Vec::new());
    for step in 0..100 {
        let angle = 0.02 * f64::from(step);
        let is_awake = |group: usize| group < 1 + step as usize / 25 && !(group == 0 && step > 75);
        if step == 76 {
            bounded.leave_out(0);
            exhaustive.leave_out(0);
        }
        // Some groups have not moved relative to the body, as those whose equations are solved.
        let moving: Vec<bool> = (0..scene.layout.groups())
            .map(|group| is_awake(group) && random.u8(..4) > 0)
            .collect();
        let amplitude = random.choice([1e-4, 1e-2, 0.3]).expect("three amplitudes");
        for filament in (0..filaments).filter(|filament| is_awake(filament / LANES)) {
            if moving[filament / LANES] {
                for angle in &mut scene.shapes[filament] {
                    *angle = (*angle + amplitude * about_zero(&mut random)).clamp(-1.5, 1.5);
                }
            }
            scene.place(filament, angle, &mut positions);
        }
        for candidates in [&mut bounded, &mut exhaustive] {
            candidates.update(&positions, angle, |group| moving[group]);
        }
        let expected = found(&mut exhaustive);
        assert!(
            found(&mut bounded) == expected,
            "step {step} of seed {seed}"
        );
        met += expected.len();
        built += usize::from(bounded.listed_at != before);
        before.clone_from(&bounded.listed_at);
    }
    [met, built]
}

/// Packed and sparse filaments on large and small bodies, of few and many segments, alone and
/// periodic.
#[test]
fn bounds_exclude_no_contact() {
    let mut seed = 0;
    for radius in [2e-3, 0.14] {
        for pitch in [1.05, 1.6, 4.0] {
            for segments in [3, 20] {
                for period in [None, Some(2.0 * pitch * REACH)] {
                    seed += 1;
                    let scene = Scene::new(radius, pitch * REACH, segments, period);
                    let [met, built] = compare(scene, seed);
                    let is_out_of_reach = pitch > 3.0 && radius > 0.1;
                    assert!(
                        met > 100 || is_out_of_reach,
                        "{radius}, {pitch}, {segments}: {met} within reach"
                    );
                    // On the small body, all filaments are always near each other by their
                    // angles.
                    assert!(
                        (1..150).contains(&built),
                        "{radius}, {pitch}, {segments}: built {built} times"
                    );
                }
            }
        }
    }
}

/// Compares the search without bounds with the definition: for each point, the nearest segment
/// of each other filament and image.
#[test]
fn the_search_without_bounds_follows_the_definition() {
    let mut random = Rng::with_seed(1);
    let period = 2.1 * REACH;
    let mut scene = Scene::new(0.05, 1.05 * REACH, 7, Some(period));
    scene
        .shapes
        .iter_mut()
        .for_each(|shape| *shape = [0, 1].map(|_| 0.8 * about_zero(&mut random)));
    let Layout {
        filaments,
        segments,
        points,
        ..
    } = scene.layout;
    let mut placed = Field::new(scene.layout.groups(), segments);
    (0..filaments).for_each(|filament| scene.place(filament, 0.0, &mut placed));
    let mut expected = Vec::new();
    for (own, other) in (0..filaments).flat_map(|own| (0..filaments).map(move |other| (own, other)))
    {
        for (segment, part) in (0..segments).flat_map(|k| (0..points).map(move |part| (k, part))) {
            let segment = NodeIndex::new(own, segment, segments);
            let point = FilamentPoint {
                segment,
                fraction: (part as f64 + 0.5) / points as f64,
            };
            for image in (-5..=5).filter(|image| own != other || *image != 0) {
                let shift = [0.0, 0.0, f64::from(image) * period];
                let end = |k: usize| add(placed.at(NodeIndex::new(other, k, segments)), shift);
                let on = |k: usize| {
                    let (x, ends) = (point.of(&placed), [end(k), end(k + 1)]);
                    Near {
                        image,
                        ..Near::between(point, x, NodeIndex::new(other, k, segments), ends, REACH)
                    }
                };
                let nearest = (0..segments)
                    .map(on)
                    .min_by(|a, b| a.square().total_cmp(&b.square()));
                let nearest = nearest.expect("segments");
                if nearest.is_within_reach() {
                    expected.push(([own, other], nearest));
                }
            }
        }
    }
    let mut candidates = Candidates::new(scene.layout.clone(), false);
    candidates.update(&placed, 0.0, |_| true);
    let mut found = found(&mut candidates);
    for list in [&mut found, &mut expected] {
        list.sort_by(|(a, first), (b, second)| {
            let key = |near: &Near| (near.point.segment, near.nearest.segment);
            let fractions = first.point.fraction.total_cmp(&second.point.fraction);
            let offsets = first.offset[2].total_cmp(&second.offset[2]);
            a.cmp(b)
                .then(key(first).cmp(&key(second)))
                .then(fractions)
                .then(offsets)
        });
    }
    assert!(expected.len() > 100);
    assert_eq!(found, expected);
}

#[test]
fn a_ring_closes() {
    let around = |filament: usize, start: f64, width: f64| Bounds {
        filament,
        start,
        width,
        axial: [0.0; 2],
    };
    let mut pairs = Vec::new();
    let mut bounds = [
        around(0, TAU - 0.1, 0.2),
        around(1, 0.05, 0.15),
        around(2, TAU - 0.15, 0.1),
        around(3, 3.0, 0.1),
    ];
    for_each_close(&mut bounds, |a, b| {
        if a.filament != b.filament {
            pairs.push([a.filament, b.filament]);
        }
    });
    pairs.iter_mut().for_each(|pair| pair.sort_unstable());
    pairs.sort_unstable();
    assert_eq!(pairs, [[0, 1], [0, 2]]);
}
