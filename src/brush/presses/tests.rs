//! Unit tests of the forces between filaments.

use super::super::field::{Changes, Field};
use super::*;
use crate::equations::Lanewise;

const LAW: PressLaw = PressLaw {
    stiffness: 6e7,
    damping: 0.1,
    friction: 0.2,
    regularisation: 1e-3,
};
const REACH: f64 = 1.2e-3;
/// Two segments that cross, and the velocities of their ends.
const POSITIONS: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [2e-3, 1e-4, 0.0],
    [8e-4, -9e-4, 1e-3],
    [1.1e-3, 9e-4, 1.2e-3],
];
const VELOCITIES: [[f64; 3]; 4] = [
    [1.0, 0.2, 0.3],
    [0.8, -0.4, 0.7],
    [0.1, 0.5, -0.2],
    [-0.3, 0.2, 0.4],
];

/// Returns the ends of the first segment and of the second, which are of two filaments.
fn nodes() -> [NodeIndex; 4] {
    [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(filament, k)| NodeIndex::new(filament, k, 1))
}

fn field(vectors: &[[f64; 3]; 4]) -> Field {
    let mut field = Field::new(1, 1);
    for (node, vector) in nodes().into_iter().zip(vectors) {
        field.set(node, *vector);
    }
    field
}

fn press(law: &PressLaw, positions: &[[f64; 3]; 4], velocities: &[[f64; 3]; 4]) -> Press {
    let (positions, velocities) = (field(positions), field(velocities));
    let [first, _, second, _] = nodes();
    let near = Near::on_segment(
        FilamentPoint {
            segment: first,
            fraction: 0.4,
        },
        second,
        &positions,
        REACH,
    );
    assert!(near.is_inside && near.square() < REACH * REACH);
    Press::new(
        law,
        &near,
        4e-4,
        &Nodes {
            positions,
            velocities,
        },
    )
}

/// Returns the forces that `load` adds.
fn in_group(load: impl FnOnce(&mut GroupField<'_>)) -> [[f64; 3]; 4] {
    let mut field = Field::new(1, 1);
    load(&mut GroupField::new(0, 1, &mut field.0));
    nodes().map(|node| field.at(node))
}

fn forces(law: &PressLaw, positions: &[[f64; 3]; 4], velocities: &[[f64; 3]; 4]) -> [[f64; 3]; 4] {
    let press = press(law, positions, velocities);
    in_group(|forces| {
        press.load_point(forces);
        press.load_nearest(forces);
    })
}

#[test]
fn forces_are_the_gradient_of_the_energy() {
    let law = PressLaw {
        damping: 0.0,
        friction: 0.0,
        ..LAW
    };
    let forces = forces(&law, &POSITIONS, &VELOCITIES);
    let step = 1e-8;
    for end in 0..4 {
        for component in 0..3 {
            let energy = |by: f64| {
                let mut positions = POSITIONS;
                positions[end][component] += by;
                press(&law, &positions, &VELOCITIES).energy()
            };
            let slope = (energy(step) - energy(-step)) / (2.0 * step);
            assert!((forces[end][component] + slope).abs() < 1e-6, "{forces:?}");
        }
    }
}

#[test]
fn forces_and_moments_balance() {
    let in_plane = |vectors: [[f64; 3]; 4]| vectors.map(|[x, y, _]| [x, y, 0.0]);
    let beside = [
        [0.0, 0.0, 0.0],
        [2e-3, 1e-4, 0.0],
        [1e-4, 1e-3, 0.0],
        [2.1e-3, 1.2e-3, 0.0],
    ];
    // A segment takes no torque about itself, so that friction in space lacks the moment that
    // twists it.
    let smooth = PressLaw {
        friction: 0.0,
        ..LAW
    };
    for (law, positions, velocities) in [
        (smooth, POSITIONS, VELOCITIES),
        (LAW, beside, in_plane(VELOCITIES)),
    ] {
        let forces = forces(&law, &positions, &velocities);
        let force = forces.iter().fold([0.0; 3], |sum, force| add(sum, *force));
        let moment =
            forces
                .iter()
                .zip(positions)
                .fold([0.0; 3], |sum, ([fx, fy, fz], [x, y, z])| {
                    add(sum, [y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
                });
        assert!(
            dot(force, force).sqrt() < 1e-15 && dot(moment, moment).sqrt() < 1e-17,
            "{force:?} {moment:?}"
        );
    }
}

#[test]
fn a_rigid_rotation_does_not_rub() {
    let spin = [3.0, -2.0, 5.0];
    let turning = POSITIONS.map(|[x, y, z]| {
        [
            spin[1] * z - spin[2] * y,
            spin[2] * x - spin[0] * z,
            spin[0] * y - spin[1] * x,
        ]
    });
    // A segment does not turn about itself: across it, the rotation is that of its ends.
    let planar = POSITIONS.map(|[x, y, _]| [x, y, 0.0]);
    let planar = [
        planar[0],
        planar[1],
        add(planar[0], [2e-4, 1.1e-3, 0.0]),
        add(planar[1], [-2e-4, 1.1e-3, 0.0]),
    ];
    let about_z = planar.map(|[x, y, _]| [-5.0 * y, 5.0 * x, 0.0]);
    assert!(press(&LAW, &planar, &about_z).dissipated.abs() < 1e-15);
    assert!(
        press(
            &PressLaw {
                friction: 0.0,
                ..LAW
            },
            &POSITIONS,
            &turning
        )
        .dissipated
        .abs()
            < 1e-12
    );
}

#[test]
fn tangents_are_derivatives_of_the_forces() {
    let elastic = PressLaw {
        damping: 0.0,
        friction: 0.0,
        ..LAW
    };
    let damped = PressLaw {
        friction: 0.0,
        ..LAW
    };
    // A step by velocities alone leaves out the turn of the surfaces with the positions, as the
    // tangent does.
    for (law, weights) in [
        (elastic, [1.0, 0.0]),
        (damped, [0.0, 1.0]),
        (LAW, [0.0, 1.0]),
    ] {
        let tangent = press(&law, &POSITIONS, &VELOCITIES).tangent(&law, weights);
        let mut own = Changes::new(1);
        own.clear(0);
        let couplings = [0, 1].map(|side| {
            tangent.add_changes::<3>(side, &mut own);
            let mut coupling =
                Coupling::<3>::new([tangent.segments[side], tangent.segments[1 - side]]);
            coupling.add(&tangent, side);
            coupling
        });
        let step = 1e-7;
        for end in 0..4 {
            for component in 0..3 {
                let at = |by: f64| {
                    let (mut positions, mut velocities) = (POSITIONS, VELOCITIES);
                    positions[end][component] += weights[0] * by;
                    velocities[end][component] += weights[1] * by;
                    forces(&law, &positions, &velocities)
                };
                let (above, below) = (at(step), at(-step));
                let mut moved = [[0.0; 3]; 4];
                moved[end][component] = 1.0;
                let mut change = in_group(|forces| {
                    couplings
                        .iter()
                        .for_each(|coupling| coupling.apply(&field(&moved), forces))
                });
                let (first, side) = (end / 2 * 2, end % 2);
                for force in 0..2 {
                    let (_, blocks) = own.blocks().next().expect("a segment");
                    let block =
                        blocks[force][side].map(|row| row.map(|value| value.lane(first / 2)));
                    change[first + force] = add(change[first + force], mul(&block, moved[end]));
                }
                for (node, change) in change.iter().enumerate() {
                    for i in 0..3 {
                        let slope = (above[node][i] - below[node][i]) / (2.0 * step);
                        let scale = law.stiffness * 4e-4 * weights[0] + 1e3 * weights[1];
                        assert!(
                            (slope - change[i]).abs() < 1e-6 * scale,
                            "{slope} {change:?}"
                        );
                    }
                }
            }
        }
    }
}
