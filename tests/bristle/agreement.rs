//! Is it right? The whole equations agree with the O(n) recursions, and every tangent with finite
//! differences.

use crate::common::{RandomState, largest, random_pairs, random_state, residual, tolerance};
use bristle::contact::{Approach, ContactLaw};
use bristle::equations::linear::{add, scale, sub};
use bristle::equations::{
    ChainDynamics, Dynamics, LaneSet, NoLoads, NodeLoads, PolarAxis, StepWeights,
};
use bristle::simulation::FilamentSystem;
use bristle::tool::{RotaryTool, Turning};
use bristle::workpiece::{Plane, Workpiece};
use bristle_codegen::ir::graph::NodeId;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::lagrange::whole_equations;
use bristle_equations::evaluation::symbol_values;
use fastrand::Rng;

/// The tool, which every system needs; the loads do not depend on it.
const TOOL: Turning<RotaryTool> = Turning {
    tool: RotaryTool::radial(0.14),
    rate: 0.0,
    initial_angle: 0.0,
};

/// Evaluates `M` and `f` of the whole equations at a state.
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
fn residual_and_accelerations_match_the_whole_equations() {
    let [mut rng, mut of_pairs] = [1, 2].map(Rng::with_seed);
    for segments in 1..=30 {
        let state = random_state(&mut rng, segments);
        let (mass_matrix, force) = whole(&state);
        let random = random_pairs(&mut of_pairs, segments, 1e5);
        let of_random = residual(&state, &random);
        // The accelerations of the motion leave no residual.
        let moving = (state.accelerations(PolarAxis::Z), vec![[0.0; 2]; segments]);
        for (accelerations, residual) in [moving, (random, of_random)] {
            let accelerations = accelerations.as_flattened();
            let rows = mass_matrix.iter().zip(&force).zip(residual.as_flattened());
            for ((row, force), residual) in rows {
                // The agreement is limited by rounding in the terms of the row.
                let terms: Vec<f64> = row.iter().zip(accelerations).map(|(m, a)| m * a).collect();
                let expected = terms.iter().sum::<f64>() - force;
                let error = (expected - residual).abs() / largest(&terms).max(force.abs());
                assert!(error < tolerance::AGREEMENT, "n = {segments}: {error:.1e}");
            }
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

/// Weights of short and long steps.
pub const STEPS: [StepWeights<f64>; 3] = [
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
];

/// Checks that solving the factorised system for the change of the residual along a step of each
/// of `steps` gives back the step. Coordinates that a direction leaves out are not compared.
pub fn check_solve(
    dynamics: &mut impl ChainDynamics<f64>,
    state: &RandomState,
    accelerations: &[[f64; 2]],
    loads: &impl NodeLoads<f64>,
    steps: &[StepWeights<f64>],
    mut draw_direction: impl FnMut() -> Vec<[f64; 2]>,
) {
    let segments = state.q.len();
    for &weights in steps {
        let direction = draw_direction();
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
            .map(|(above, below)| scale(0.5 / size, sub(*above, *below)))
            .collect();
        dynamics.factorise(
            state.clamp.holding(&state.q, &state.v),
            accelerations,
            loads,
            weights,
            LaneSet::first(1),
        );
        dynamics.solve(&mut solution);
        let pairs = solution.as_flattened().iter().zip(direction.as_flattened());
        for (solution, expected) in pairs.filter(|(_, expected)| **expected != 0.0) {
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
        let mut dynamics = Dynamics::new(state.chain.clone());
        let direction = || random_pairs(&mut rng, segments, 1.0);
        check_solve(
            &mut dynamics,
            &state,
            &accelerations,
            &NoLoads,
            &STEPS,
            direction,
        );
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
        // It passes through the outermost node, half a radius above it.
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
        let at_rest = vec![[0.0; 2]; segments];
        let direction = || random_pairs(&mut rng, segments, 1.0);
        check_solve(&mut dynamics, &state, &at_rest, &loads, &STEPS, direction);
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
        stiffness_share: 1.0,
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
