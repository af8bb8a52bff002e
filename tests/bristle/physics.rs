//! Is it physics? Invariants and measured orders of convergence. `crates/validation` has the exact
//! solutions.

use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;

use crate::common::{case, filament, largest, random_state, residual, tolerance};
use bristle::contact::ContactLaw;
use bristle::equations::{LaneSet, StepWeights};
use bristle::integrate::tableau::{ESDIRK43, ESDIRK54, Tableau};
use bristle::integrate::{self, Integrator, Point, SecondOrderSystem, StageSolution, Tolerances};
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::model::settings::ContactSettings;
use bristle::simulation::{FilamentState, FilamentSystem, integral, integrate, simulate};
use bristle::tool::{ClampMotion, FixedClamp};
use bristle::workpiece::Plane;
use bristle_inspect::evaluation::{ChainState, evaluate};
use fastrand::Rng;
use nalgebra::{DMatrix, SymmetricEigen};
use proptest::prelude::*;

/// A clamp at rest, along `x`.
const WALL: FixedClamp = FixedClamp {
    direction: [1.0, 0.0, 0.0],
};

fn mass_matrix(state: &ChainState) -> DMatrix<f64> {
    let rows = evaluate(&filament(1), 0.14, state)
        .expect("the state is regular")
        .mass_matrix;
    DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j])
}

/// States of 1 to 6 segments away from the poles.
fn states() -> impl Strategy<Value = ChainState> {
    (1..=6_usize).prop_flat_map(|segments| {
        let q = prop::collection::vec([0.3..2.8_f64, -3.0..3.0_f64], segments);
        let v = prop::collection::vec(-300.0..300.0_f64, 2 * segments);
        (q, v, -3.0..3.0_f64, -200.0..200.0_f64).prop_map(|(q, v, base_angle, base_rate)| {
            ChainState {
                base_angle,
                base_rate,
                base_acceleration: 0.0,
                gravity: [0.0; 3],
                q: q.concat(),
                v,
            }
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mass_matrix_is_symmetric_and_positive_definite(state in states()) {
        let matrix = mass_matrix(&state);
        let asymmetry = (&matrix - matrix.transpose()).amax();
        prop_assert!(asymmetry <= 1e-15 * matrix.amax());
        prop_assert!(SymmetricEigen::new(matrix).eigenvalues.min() > 0.0);
    }

    #[test]
    fn energies_are_not_negative(state in states()) {
        // A joint folded back on itself (α = π) is a declared singular point of the spring.
        if let Ok(evaluation) = evaluate(&filament(1), 0.14, &state) {
            prop_assert!(evaluation.kinetic_energy_j >= 0.0);
            prop_assert!(evaluation.potential_energy_j >= 0.0);
            prop_assert!(evaluation.dissipation_w >= 0.0);
        }
    }

    #[test]
    fn energies_do_not_change_when_all_turns_about_z(state in states(), turn in -3.0..3.0_f64) {
        let mut turned = state.clone();
        turned.base_angle += turn;
        turned.q.iter_mut().skip(1).step_by(2).for_each(|theta| *theta += turn);
        if let (Ok(before), Ok(after)) = (evaluate(&filament(1), 0.14, &state), evaluate(&filament(1), 0.14, &turned)) {
            let pairs = [
                (before.kinetic_energy_j, after.kinetic_energy_j),
                (before.potential_energy_j, after.potential_energy_j),
                (before.dissipation_w, after.dissipation_w),
            ];
            for (before, after) in pairs {
                // Near the fold the slope of the spring grows without bound, and amplifies
                // rounding.
                prop_assert!((before - after).abs() <= 1e-11 * before.abs(), "{before} {after}");
            }
        }
    }
}

#[test]
fn straight_filament_is_exact() {
    // Rigid rotation in the plane: no spring energy, no dissipation; the chain only pulls along
    // itself.
    let segments = 25;
    let state = ChainState {
        base_angle: -1.2,
        base_rate: 100.0,
        base_acceleration: 0.0,
        gravity: [0.0; 3],
        q: [FRAC_PI_2, -1.2].repeat(segments),
        v: [0.0, 100.0].repeat(segments),
    };
    let evaluation = evaluate(&filament(segments), 0.14, &state).expect("the state is regular");
    assert!(evaluation.potential_energy_j < 1e-30);
    assert!(evaluation.dissipation_w < 1e-28);
    // The torques of 25 joints vanish to one rounding of c ≈ 0.2 N m. Divided by J ≈ 1e-12 kg m²,
    // it shows here.
    assert!(largest(&evaluation.accelerations) < 1e-3);
}

fn no_contact() -> (ContactLaw, Plane) {
    (
        ContactLaw::from(&ContactSettings::default()),
        Plane::new([0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]),
    )
}

/// `E_kin + E_pot` in J.
fn mechanical_energy<M: ClampMotion>(
    system: &mut FilamentSystem<M, Plane>,
    state: &FilamentState,
) -> f64 {
    let energies = system.energies(state);
    energies.kinetic + energies.spring + energies.gravity + system.contact_energy(state)
}

#[test]
fn free_vibration_loses_the_energy_that_its_dampers_take() {
    let segments = 10;
    let filament = filament(segments);
    let (law, plane) = no_contact();
    let chain = chain(&filament, [0.0, -9.81, 3.0]);
    let mut system = FilamentSystem::new(chain, WALL, law, plane, true);
    // Bent in space and released.
    let q = (1..=segments)
        .map(|k| [FRAC_PI_2 - 0.03 * k as f64, 0.05 * k as f64])
        .collect();
    let start = system.state(0.0, q, vec![[0.0; 2]; segments]);
    let before = mechanical_energy(&mut system, &start);
    let tolerances = Tolerances::of_motion(1e-6, 1.0, 1000.0);
    let period = 2.0 * std::f64::consts::PI / first_natural_frequency(&filament);
    let (end, _) = integrate(
        &mut system,
        start,
        3.0 * period,
        &ESDIRK54,
        tolerances,
        |_| (),
    )
    .expect("nothing is in the way");
    let after = mechanical_energy(&mut system, &end);
    let dissipated = end.integrals[integral::JOINT_DISSIPATION];
    assert!(
        dissipated > 0.5 * before,
        "the test could not detect the dampers"
    );
    assert!(
        end.integrals[integral::WORK].abs() < 1e-30,
        "a clamp at rest does no work"
    );
    let imbalance = (before - after - dissipated).abs() / before;
    assert!(imbalance < tolerance::ENERGY_BALANCE, "{imbalance:.1e}");
}

#[test]
fn metrics_at_the_default_tolerance_agree_with_tighter_ones() {
    for (velocity, depth) in [
        (2.5, 5e-3),
        (10.0, 1e-3),
        (15.0, 2.5e-3),
        (25.0, 2.5e-3),
        (30.0, 0.5e-3),
    ] {
        let at = |relative_tolerance| {
            let mut settings = case(25, velocity, depth);
            settings.solver.relative_tolerance = relative_tolerance;
            simulate(&settings).expect("the pass ends").metrics
        };
        let (default, tight) = (at(1e-6), at(1e-8));
        let relative = |a: f64, b: f64| (a / b - 1.0).abs();
        assert!(
            relative(
                default.contact_normal_impulse_n_s,
                tight.contact_normal_impulse_n_s
            ) < 1e-3
        );
        assert!(
            relative(
                default.tool_contact_normal_force_n,
                tight.tool_contact_normal_force_n
            ) < 1e-3
        );
        assert!(relative(default.max_tip_deflection_m, tight.max_tip_deflection_m) < 1e-3);
        assert!((default.contact_time_ratio - tight.contact_time_ratio).abs() < 0.002);
        assert!(relative(default.contact_time_s, tight.contact_time_s) < 5e-3);
        assert!(
            relative(
                default.peak_contact_normal_force_n,
                tight.peak_contact_normal_force_n
            ) < 5e-3
        );
    }
}

#[test]
fn slow_and_stiff_contacts_end() {
    // Here events lie in long steps, or are as sharp as double precision allows.
    for (velocity, depth, stiffness) in [
        (1e-3, 2e-3, 1e5),
        (1e-3, 5e-3, 1e5),
        (0.01, 5e-3, 1e9),
        (0.1, 5e-3, 1e10),
    ] {
        let mut settings = case(25, velocity, depth);
        settings.contact.stiffness_n_m = stiffness;
        settings.solver.relative_tolerance = 1e-5;
        let metrics = simulate(&settings).expect("the pass ends").metrics;
        // Quasi-static: the filament stays on the surface between nominal entry and exit, or nearly
        // so.
        assert!(
            metrics.contact_time_ratio > 0.95,
            "{velocity} m/s, {stiffness} N/m: {metrics:?}"
        );
    }
}

#[test]
fn contact_time_ratio_does_not_exceed_one() {
    // A node so thick that it touches from start to end.
    let mut settings = case(5, 10.0, 1e-3);
    settings.contact.radius_m = 0.02;
    settings.contact.stiffness_n_m = 10.0;
    let metrics = simulate(&settings).expect("the pass ends").metrics;
    assert_eq!(metrics.contact_time_ratio, 1.0);
    assert_eq!(metrics.contact_count, 1);
}

/// A pendulum pair: `φ̈ = −sin φ`, `θ̈ = −k θ − d θ̇`, the second stiff if `d` is large; its
/// integral is `∫ φ̇² dt`.
struct Pendulum {
    stiffness: f64,
    damping: f64,
    /// `∂(sin φ)/∂φ` at the last residual.
    slope: f64,
    pivots: [f64; 2],
}

impl Pendulum {
    fn new(stiffness: f64, damping: f64) -> Self {
        Self {
            stiffness,
            damping,
            slope: 0.0,
            pivots: [0.0; 2],
        }
    }

    fn force(&self, q: [f64; 2], v: [f64; 2]) -> [f64; 2] {
        [-q[0].sin(), -self.stiffness * q[1] - self.damping * v[1]]
    }
}

impl SecondOrderSystem<f64, 2, 1> for Pendulum {
    type Charts = ();
    type Refusal = Infallible;

    fn blocks(&self) -> usize {
        1
    }

    fn accelerations(
        &mut self,
        _: f64,
        q: &[[f64; 2]],
        v: &[[f64; 2]],
        accelerations: &mut [[f64; 2]],
    ) {
        accelerations[0] = self.force(q[0], v[0]);
    }

    fn residual(&mut self, at: &Point<'_, f64, 2>, residual: &mut [[f64; 2]]) {
        let force = self.force(at.q[0], at.v[0]);
        residual[0] = [
            at.accelerations[0][0] - force[0],
            at.accelerations[0][1] - force[1],
        ];
        self.slope = at.q[0][0].cos();
    }

    fn factorise(&mut self, _: &Point<'_, f64, 2>, weights: StepWeights<f64>, _: LaneSet) {
        let StepWeights { coordinates, rates } = weights;
        self.pivots = [
            1.0 + coordinates * self.slope,
            1.0 + coordinates * self.stiffness + rates * self.damping,
        ];
    }

    fn solve(&mut self, right_side: &mut [[f64; 2]]) {
        right_side[0] = [
            right_side[0][0] / self.pivots[0],
            right_side[0][1] / self.pivots[1],
        ];
    }

    fn rates(&mut self, at: &Point<'_, f64, 2>) -> [f64; 1] {
        [at.v[0][0] * at.v[0][0]]
    }
}

/// State and integral at `t = 2` after `steps` equal steps.
fn swing(tableau: &'static Tableau, solution: StageSolution, steps: usize) -> [f64; 3] {
    let mut system = Pendulum::new(4.0, 0.1);
    let tolerances = Tolerances::of_motion(1e-13, 1.0, 1.0);
    let mut integrator = Integrator::new(tableau, solution, tolerances, 1, 1.0);
    let mut start = integrate::State::new(&mut system, 0.0, vec![[1.0, 1.0]], vec![[0.0, 0.5]]);
    let mut end = start.clone();
    for _ in 0..steps {
        integrator
            .step(&mut system, &start, &mut end, 2.0 / steps as f64)
            .expect("the step is regular");
        std::mem::swap(&mut start, &mut end);
    }
    [start.q[0][0], start.q[0][1], start.integrals[0]]
}

#[test]
fn integrator_has_its_order() {
    for (tableau, solution) in [
        (&ESDIRK43, StageSolution::Converged),
        (&ESDIRK54, StageSolution::Converged),
        (&ESDIRK54, StageSolution::Predicted),
    ] {
        let exact = swing(&ESDIRK54, StageSolution::Converged, 2000);
        let error = |steps| {
            let end = swing(tableau, solution, steps);
            end.iter()
                .zip(exact)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
        };
        let order = (error(20) / error(80)).log(4.0);
        assert!(
            (order - f64::from(tableau.order)).abs() < 0.25,
            "{} {solution:?}: order {order}",
            tableau.name
        );
    }
}

#[test]
fn stiff_components_do_not_limit_the_step() {
    let mut system = Pendulum::new(1e12, 1e8);
    let tolerances = Tolerances::of_motion(1e-8, 1.0, 1.0);
    let mut integrator = Integrator::new(&ESDIRK54, StageSolution::Predicted, tolerances, 1, 1e-3);
    // θ decays within 1/k d = 1e-4 s, and the transient of θ̇ within 1/d = 1e-8 s.
    let mut start = integrate::State::new(&mut system, 0.0, vec![[1.0, 0.1]], vec![[0.0, 1.0]]);
    let mut end = start.clone();
    while start.time < 10.0 {
        integrator
            .advance(&mut system, &start, &mut end, 10.0)
            .expect("the step is regular");
        std::mem::swap(&mut start, &mut end);
    }
    let energy = start.v[0][0].powi(2) / 2.0 - start.q[0][0].cos();
    assert!((energy + 1.0_f64.cos()).abs() < 1e-5, "{energy}");
    assert!(start.q[0][1].abs() < 1e-8, "{:?}", start.q);
    // An explicit method would need 10 s × 1e8/s steps.
    assert!(integrator.work().steps < 2000, "{:?}", integrator.work());
}

#[test]
fn folded_joints_and_poles_are_reported() {
    // The declared singular points: the azimuth at a pole, and a joint folded back on itself.
    let mut state = ChainState {
        base_angle: 0.0,
        base_rate: 0.0,
        base_acceleration: 0.0,
        gravity: [0.0; 3],
        q: vec![FRAC_PI_2, 0.0, 0.0, 0.0],
        v: vec![0.0; 4],
    };
    let at_pole = evaluate(&filament(2), 0.14, &state)
        .expect_err("a segment at the pole")
        .to_string();
    assert!(
        at_pole.starts_with("segment 2 with φ = 0.0 stands at a pole"),
        "{at_pole}"
    );
    state.q = vec![FRAC_PI_2, 0.0, FRAC_PI_2, std::f64::consts::PI];
    let folded = evaluate(&filament(2), 0.14, &state);
    // sin π is not zero in double precision, so the fold may be regular, but must never be silently
    // wrong.
    if let Ok(evaluation) = folded {
        assert!(
            evaluation
                .accelerations
                .iter()
                .all(|acceleration| acceleration.is_finite())
        );
    }
    let mut rng = Rng::with_seed(1);
    let mut random = random_state(&mut rng, 3);
    random.q[1][0] = 0.0;
    // At a pole the rates of a segment that turns about another axis are not finite.
    random.clamp.angular_velocity = [0.0, 0.0, 100.0];
    let accelerations = vec![[0.0; 2]; 3];
    assert!(
        residual(&random, &accelerations)
            .as_flattened()
            .iter()
            .all(|value| value.is_finite())
    );
}
