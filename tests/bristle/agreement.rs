//! Is it right? The whole equations agree with the O(n) recursions, and every tangent with finite
//! differences.

use crate::common::{RandomState, largest, random_pairs, random_state, residual, tolerance};
use bristle::contact::{Approach, ContactLaw};
use bristle::equations::kernels::{self, AzimuthSteps, JointConstants, SegmentConstants, Side};
use bristle::equations::linear::add;
use bristle::equations::{
    ChainDynamics, Dynamics, LaneSet, NoLoads, NodeLoads, PolarAxis, StepWeights,
};
use bristle::simulation::FilamentSystem;
use bristle::tool::{RotaryTool, Turning};
use bristle::workpiece::{Plane, Workpiece};
use bristle_codegen::ir::graph::NodeId;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::lagrange::whole_equations;
use bristle_inspect::evaluation::symbol_values;
use fastrand::Rng;

/// The tool, which every system has; the loads do not depend on it.
const TOOL: Turning<RotaryTool> = Turning {
    tool: RotaryTool::radial(0.14),
    rate: 0.0,
    initial_angle: 0.0,
};

/// `M` and `f` of the whole equations at a state.
fn whole(state: &RandomState) -> (Vec<Vec<f64>>, Vec<f64>) {
    let whole = whole_equations(state.q.len(), Motion::Spatial);
    let values = whole.graph.evaluate(&symbol_values(
        &whole,
        &state.chain,
        &state.clamp,
        &state.q,
        &state.v,
    ));
    let at = |node: &NodeId| values[node.index()];
    (
        whole
            .mass_matrix
            .iter()
            .map(|row| row.iter().map(at).collect())
            .collect(),
        whole.force.iter().map(at).collect(),
    )
}

#[test]
fn accelerations_solve_the_whole_equations() {
    let mut rng = Rng::with_seed(1);
    for segments in 1..=30 {
        let state = random_state(&mut rng, segments);
        let (mass_matrix, force) = whole(&state);
        let accelerations = state.accelerations(&state.charts());
        let accelerations = accelerations.as_flattened();
        for (row, force) in mass_matrix.iter().zip(&force) {
            // Rounding in the terms of the row limits the agreement.
            let terms: Vec<f64> = row.iter().zip(accelerations).map(|(m, a)| m * a).collect();
            let scale = largest(&terms).max(force.abs());
            let error = (terms.iter().sum::<f64>() - force).abs() / scale;
            assert!(error < tolerance::AGREEMENT, "n = {segments}: {error:.1e}");
        }
    }
}

#[test]
fn residual_matches_the_whole_equations() {
    let mut rng = Rng::with_seed(2);
    for segments in 1..=30 {
        let state = random_state(&mut rng, segments);
        let (mass_matrix, force) = whole(&state);
        let accelerations = random_pairs(&mut rng, segments, 1e5);
        let residual = residual(&state, &accelerations);
        let accelerations = accelerations.as_flattened();
        for ((row, force), residual) in mass_matrix.iter().zip(&force).zip(residual.as_flattened())
        {
            let terms: Vec<f64> = row.iter().zip(accelerations).map(|(m, a)| m * a).collect();
            let expected = terms.iter().sum::<f64>() - force;
            let error = (expected - residual).abs() / largest(&terms).max(force.abs());
            assert!(error < tolerance::AGREEMENT, "n = {segments}: {error:.1e}");
        }
    }
}

#[test]
fn energies_match_the_whole_equations() {
    let mut rng = Rng::with_seed(3);
    for segments in [1, 2, 5, 25] {
        let state = random_state(&mut rng, segments);
        let whole = whole_equations(segments, Motion::Spatial);
        let values = whole.graph.evaluate(&symbol_values(
            &whole,
            &state.chain,
            &state.clamp,
            &state.q,
            &state.v,
        ));
        let mut dynamics = Dynamics::new(state.chain.clone());
        dynamics.place(state.clamp.holding(&state.q, &state.v));
        let energies = dynamics.energies(state.clamp.holding(&state.q, &state.v));
        let pairs = [
            (energies.kinetic, whole.kinetic_energy),
            (energies.spring, whole.spring_energy),
            (energies.gravity, whole.gravity_energy),
            (energies.dissipation, whole.dissipation),
        ];
        for (value, node) in pairs {
            let expected = values[node.index()];
            assert!(
                (value - expected).abs() <= tolerance::AGREEMENT * expected.abs(),
                "{value} {expected}"
            );
        }
        for (value, node) in dynamics.positions()[segments - 1]
            .into_iter()
            .zip(whole.tip)
        {
            assert!((value - values[node.index()]).abs() < 1e-15);
        }
    }
}

/// `q + w_q δ`, `v + w_v δ`, `a + δ`, for `δ = size × direction`.
fn along_step(
    state: &RandomState,
    accelerations: &[[f64; 2]],
    weights: StepWeights<f64>,
    direction: &[[f64; 2]],
    size: f64,
) -> (RandomState, Vec<[f64; 2]>) {
    let shifted = |values: &[[f64; 2]], weight: f64| -> Vec<[f64; 2]> {
        let pairs = values.iter().zip(direction);
        pairs
            .map(|(value, delta)| add(*value, delta.map(|delta| weight * size * delta)))
            .collect()
    };
    let moved = RandomState {
        chain: state.chain.clone(),
        clamp: state.clamp,
        q: shifted(&state.q, weights.coordinates),
        v: shifted(&state.v, weights.rates),
    };
    (moved, shifted(accelerations, 1.0))
}

/// Solving the factorised system for the change of the residual along a step gives back the step.
pub fn check_solve(
    state: &RandomState,
    charts: &[PolarAxis],
    accelerations: &[[f64; 2]],
    loads: &impl NodeLoads<f64>,
    rng: &mut Rng,
) {
    let segments = state.q.len();
    let mut dynamics = Dynamics::new(state.chain.clone());
    dynamics.set_charts(charts);
    for weights in [
        StepWeights {
            coordinates: 1e-12,
            rates: 1e-6,
        },
        StepWeights {
            coordinates: 1e-9,
            rates: 3e-5,
        },
        StepWeights {
            coordinates: 1e-6,
            rates: 1e-3,
        },
    ] {
        let direction = random_pairs(rng, segments, 1.0);
        // The finite differences move coordinates by at most 1e-6 rad, and rates by little compared
        // with the speed over which friction is regularised.
        let size = f64::min(1e-6 / weights.coordinates, 2e-3 / weights.rates);
        let mut at = |size: f64| {
            let (moved, accelerations) =
                along_step(state, accelerations, weights, &direction, size);
            let mut residual = vec![[0.0; 2]; segments];
            dynamics.residual(
                moved.clamp.holding(&moved.q, &moved.v),
                &accelerations,
                loads,
                &mut residual,
            );
            residual
        };
        let (above, below) = (at(size), at(-size));
        at(0.0);
        let mut solution: Vec<[f64; 2]> = above
            .iter()
            .zip(&below)
            .map(|(above, below)| [0, 1].map(|i| (above[i] - below[i]) / (2.0 * size)))
            .collect();
        dynamics.factorise(
            state.clamp.holding(&state.q, &state.v),
            accelerations,
            loads,
            weights,
            LaneSet::first(1),
        );
        dynamics.solve(&mut solution);
        for (solution, expected) in solution.as_flattened().iter().zip(direction.as_flattened()) {
            let error = (solution - expected).abs();
            assert!(
                error < tolerance::DIFFERENCES,
                "n = {segments}, {weights:?}: {error:.1e}"
            );
        }
    }
}

#[test]
fn factorised_step_matrix_matches_differences() {
    let mut rng = Rng::with_seed(4);
    for segments in [1, 2, 3, 7, 25] {
        let state = random_state(&mut rng, segments);
        let accelerations = random_pairs(&mut rng, segments, 1e4);
        check_solve(&state, &state.charts(), &accelerations, &NoLoads, &mut rng);
    }
}

fn law() -> ContactLaw {
    ContactLaw {
        stiffness: 3e6,
        exponent: 1.5,
        damping: 0.3,
        radius: 1e-3,
        friction: 0.4,
        regularisation: 0.05,
    }
}

#[test]
fn factorised_step_matrix_with_contact_matches_differences() {
    let mut rng = Rng::with_seed(5);
    for segments in [1, 2, 6] {
        let mut state = random_state(&mut rng, segments);
        // The only approximation in the matrix is proportional to the rates, so they are zero here.
        state.v.fill([0.0; 2]);
        state.clamp.velocity = [0.3, -0.2, 0.1];
        state.clamp.direction_rate = [0.0; 3];
        let workpiece = Plane::new([0.0; 3], [0.3, 1.0, -0.2], [0.1, 0.0, 0.05]);
        let mut dynamics = Dynamics::new(state.chain.clone());
        dynamics.place(state.clamp.holding(&state.q, &state.v));
        // Through the outermost node, half a radius above it.
        let tip = dynamics.positions()[segments - 1];
        let gap = workpiece.surface(tip, 0.0).gap;
        let normal = workpiece.surface(tip, 0.0).normal;
        let point = normal.map(|component| (gap - 5e-4) * component);
        let workpiece = Plane::new(point, normal, [0.1, 0.0, 0.05]);
        let mut system = FilamentSystem::new(state.chain.clone(), TOOL, law(), workpiece, false);
        system.set_closed(0, segments - 1, true);
        let loads = system.loads(0.0);
        assert!(
            loads
                .force(segments - 1, tip, state.clamp.velocity)
                .is_some()
        );
        check_solve(
            &state,
            &state.charts(),
            &vec![[0.0; 2]; segments],
            &loads,
            &mut rng,
        );
    }
}

#[test]
fn contact_tangents_match_differences() {
    let mut rng = Rng::with_seed(6);
    let workpiece = Plane::new([0.0; 3], [0.3, 1.0, -0.2], [0.1, 0.0, 0.05]);
    let mut system = FilamentSystem::new(
        random_state(&mut rng, 1).chain,
        TOOL,
        law(),
        workpiece,
        false,
    );
    system.set_closed(0, 0, true);
    let loads = system.loads(0.1);
    for _ in 0..20 {
        let mut random = |size: f64| [0; 3].map(|_| size * (2.0 * rng.f64() - 1.0));
        let (position, velocity) = (random(2e-4), random(0.3));
        let tangent = loads
            .tangent(0, position, velocity)
            .expect("the node is closed");
        for column in 0..3 {
            let unit = |size: f64| std::array::from_fn(|i| if i == column { size } else { 0.0 });
            let force = |dx: f64, dv: f64| {
                loads
                    .force(0, add(position, unit(dx)), add(velocity, unit(dv)))
                    .expect("the node is closed")
            };
            let (step, rate_step) = (1e-8, 1e-6);
            for row in 0..3 {
                let by_position = (force(step, 0.0)[row] - force(-step, 0.0)[row]) / (2.0 * step);
                let by_velocity =
                    (force(0.0, rate_step)[row] - force(0.0, -rate_step)[row]) / (2.0 * rate_step);
                let (position_scale, velocity_scale) = (law().stiffness * 0.03, 1000.0);
                assert!(
                    (tangent.position[row][column] - by_position).abs() < 1e-6 * position_scale
                );
                assert!(
                    (tangent.velocity[row][column] - by_velocity).abs() < 1e-6 * velocity_scale
                );
            }
        }
    }
}

/// The columns of the Jacobian of `f` at zero, by central differences.
fn jacobian_columns<const N: usize, const M: usize>(
    f: impl Fn([f64; N]) -> [f64; M],
) -> [[f64; M]; N] {
    let size = 1e-5;
    std::array::from_fn(|column| {
        let unit = |size: f64| std::array::from_fn(|i| if i == column { size } else { 0.0 });
        let (above, below) = (f(unit(size)), f(unit(-size)));
        std::array::from_fn(|row| (above[row] - below[row]) / (2.0 * size))
    })
}

/// Coordinates and rates, each alone, so that neither hides the other.
pub const WEIGHTS: [StepWeights<f64>; 2] = [
    StepWeights {
        coordinates: 1.0,
        rates: 0.0,
    },
    StepWeights {
        coordinates: 0.0,
        rates: 1.0,
    },
];

/// Coordinates and rates of one side of a joint.
pub type Coordinates = [[f64; 2]; 2];

/// Checks the tangent of a joint against differences of its torques. Its blocks are those of the
/// first side and the second.
pub fn check_joint_tangent(
    blocks: [[[[f64; 2]; 2]; 2]; 2],
    torques: impl Fn([Coordinates; 2]) -> [[f64; 2]; 2],
    sides: [Coordinates; 2],
    weights: StepWeights<f64>,
) {
    let shifted = |shift: [f64; 4]| -> [f64; 4] {
        let mut sides = sides;
        for (i, shift) in shift.into_iter().enumerate() {
            sides[i / 2][0][i % 2] += weights.coordinates * shift;
            sides[i / 2][1][i % 2] += weights.rates * shift;
        }
        let [first, second] = torques(sides);
        [first[0], first[1], second[0], second[1]]
    };
    for (column, slopes) in jacobian_columns(shifted).into_iter().enumerate() {
        for (row, slope) in slopes.into_iter().enumerate() {
            let entry = blocks[row / 2][column / 2][row % 2][column % 2];
            assert!(
                (entry + slope).abs() < 1e-9,
                "({row}, {column}): {entry} {}",
                -slope
            );
        }
    }
}

/// At a bent joint and at a relaxed one.
#[test]
fn joint_tangents_match_differences() {
    /// Relaxed angle of the joint in rad.
    const RELAXED: f64 = 0.2;
    let mut rng = Rng::with_seed(7);
    for straight in [false, true] {
        for weights in WEIGHTS {
            let mut random = || rng.f64();
            let angles = [1.1 + random(), 0.3 + random()];
            let next = if straight {
                [angles[0], angles[1] + RELAXED]
            } else {
                [1.2 + random(), 0.1 + random()]
            };
            let sides = [[angles, [random(), random()]], [next, [random(), random()]]];
            let constants = JointConstants {
                stiffness: 0.7,
                damping: 0.3,
            };
            let side = |[q, rates]: Coordinates| Side {
                angles: [q[0].sin(), q[0].cos()],
                rates,
            };
            let steps = |[previous, next]: [Coordinates; 2]| {
                let step = previous[0][1] - next[0][1];
                let unbent = step + RELAXED;
                AzimuthSteps {
                    plain: [step.sin(), step.cos()],
                    unbent: [unbent.sin(), unbent.cos()],
                }
            };
            let torques = |sides: [Coordinates; 2]| {
                let joint = kernels::joint(side(sides[0]), side(sides[1]), steps(sides), constants);
                [joint.previous, joint.next]
            };
            let tangent = kernels::joint_tangent(
                side(sides[0]),
                side(sides[1]),
                steps(sides),
                constants,
                weights,
            );
            let blocks = [
                [tangent.previous_previous, tangent.previous_next],
                [tangent.next_previous, tangent.next_next],
            ];
            check_joint_tangent(blocks, torques, sides, weights);
        }
    }
}

#[test]
fn clamp_tangents_match_differences() {
    let mut rng = Rng::with_seed(8);
    for weights in WEIGHTS {
        let relaxed = [0.8, -0.6, 0.0];
        let angles = [1.3 + 0.2 * rng.f64(), -0.9 + 0.2 * rng.f64()];
        let rates = [rng.f64(), rng.f64()];
        let trigonometry = |q: [f64; 2]| [q[0].sin(), q[0].cos(), q[1].sin(), q[1].cos()];
        let constants = JointConstants {
            stiffness: 0.7,
            damping: 0.3,
        };
        let side = |shift: [f64; 2]| Side {
            angles: trigonometry([0, 1].map(|i| angles[i] + weights.coordinates * shift[i])),
            rates: [0, 1].map(|i| rates[i] + weights.rates * shift[i]),
        };
        let torques = |shift: [f64; 2]| kernels::clamp(relaxed, side(shift), constants).next;
        let tangent = kernels::clamp_tangent(relaxed, side([0.0; 2]), constants, weights);
        for (column, differences) in jacobian_columns(torques).into_iter().enumerate() {
            for (row, slope) in differences.into_iter().enumerate() {
                assert!((tangent.next_next[row][column] + slope).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn segment_tangents_match_differences() {
    let mut rng = Rng::with_seed(9);
    let constants = SegmentConstants {
        length: 0.7,
        mass: 1.3,
        inertia: 0.2,
    };
    let mut random = |size: f64| size * (2.0 * rng.f64() - 1.0);
    let (angles, rates) = ([1.2, random(3.0)], [random(2.0), random(2.0)]);
    let accelerations = [random(3.0), random(3.0)];
    let base: [f64; 3] = std::array::from_fn(|_| random(2.0));
    let force: [f64; 3] = std::array::from_fn(|_| random(2.0));
    let trigonometry = |q: [f64; 2]| [q[0].sin(), q[0].cos(), q[1].sin(), q[1].cos()];
    for weights in [
        &[StepWeights {
            coordinates: 0.0,
            rates: 0.0,
        }][..],
        &WEIGHTS,
    ]
    .concat()
    {
        // Torque, base force and outer acceleration of the segment, as one vector.
        let values = |shift: [f64; 2]| -> [f64; 8] {
            let q = [0, 1].map(|i| angles[i] + weights.coordinates * shift[i]);
            let v = [0, 1].map(|i| rates[i] + weights.rates * shift[i]);
            let a = [0, 1].map(|i| accelerations[i] + shift[i]);
            let segment = kernels::segment(trigonometry(q), v, constants);
            std::array::from_fn(|i| match i {
                0 | 1 => {
                    let inertial: f64 = (0..2).map(|j| segment.inertia[i][j] * a[j]).sum();
                    let carried: f64 = (0..3)
                        .map(|j| {
                            segment.coupling[j][i] * base[j]
                                + segment.reach_jacobian[j][i] * force[j]
                        })
                        .sum();
                    inertial + segment.bias[i] + carried
                }
                2..5 => {
                    let row = i - 2;
                    let own: f64 = (0..2).map(|j| segment.coupling[row][j] * a[j]).sum();
                    constants.mass * base[row] + own + segment.base_bias[row] + force[row]
                }
                _ => {
                    let row = i - 5;
                    let own: f64 = (0..2).map(|j| segment.reach_jacobian[row][j] * a[j]).sum();
                    base[row] + own + segment.reach_bias[row]
                }
            })
        };
        let tangent = kernels::segment_tangent(
            trigonometry(angles),
            rates,
            accelerations,
            base,
            force,
            constants,
            weights,
        );
        for (column, differences) in jacobian_columns(values).into_iter().enumerate() {
            for (row, difference) in differences.into_iter().enumerate() {
                let entry = match row {
                    0 | 1 => tangent.torque[row][column],
                    2..5 => tangent.base_force[row - 2][column],
                    _ => tangent.outer_acceleration[row - 5][column],
                };
                assert!(
                    (entry - difference).abs() < 1e-8,
                    "({row}, {column}): {entry} {difference}"
                );
            }
        }
    }
}

#[test]
fn contact_law_at_its_singular_points() {
    let approach = |penetration: f64, rate: f64, sliding: f64| Approach {
        penetration,
        penetration_rate: rate,
        normal: [0.0, 1.0, 0.0],
        sliding: [sliding, 0.0, 0.0],
        across: [-1.0, 0.0, 0.0],
        turn: 0.0,
        margin: f64::INFINITY,
    };
    // Zero gap: no force, from either side. Zero sliding speed: no friction, and a finite slope.
    let at_rest = law().force(&approach(1e-4, 0.0, 0.0));
    assert_eq!(law().force(&approach(0.0, 1.0, 1.0)).normal, 0.0);
    assert_eq!(at_rest.tangential, [0.0; 3]);
    assert!(law().tangent(&approach(1e-4, 0.0, 0.0)).velocity[0][0].is_finite());
    // Coulomb's limit: all of µ F_n opposes the sliding.
    let sliding = law().force(&approach(1e-4, 0.0, 1e6));
    assert!((sliding.tangential[0] + 0.4 * sliding.normal).abs() < 1e-9 * sliding.normal);
    // Hunt and Crossley: no adhesion if the node leaves faster than 1/χ.
    assert!(law().pressing(&approach(1e-4, -4.0, 0.0)) < 0.0);
    assert!(law().pressing(&approach(1e-4, -3.0, 0.0)) > 0.0);
    assert!(law().pressing(&approach(-1e-4, 3.0, 0.0)) < 0.0);
}
