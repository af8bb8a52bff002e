//! Segments at and near the poles of their coordinates: the motion is the same in both charts.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::agreement::{STEPS, check_solve};
use crate::common::{RandomState, filament, largest, random_pairs, random_state, tolerance};
use bristle::contact::ContactLaw;
use bristle::equations::linear::sub;
use bristle::equations::{
    Chain, ChainDynamics, Dynamics, Energies, NoLoads, POLE, PolarAxis, RelaxedAngle, UniformChain,
};
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::model::settings::{ContactSettings, FilamentSettings};
use bristle::simulation::{
    FilamentState, FilamentSystem, Sample, Statistics, integrate, simulate_with_history,
};
use bristle::tool::FixedClamp;
use bristle::workpiece::Plane;
use bristle_equations::evaluation::{EvaluationError, RoundToolState, evaluate};
use fastrand::Rng;

/// Coordinates, rates and accelerations.
type ChainMotion = [Vec<[f64; 2]>; 3];

/// Converts a motion to coordinates about `axis`.
fn converted(axis: PolarAxis, state: &RandomState, accelerations: &[[f64; 2]]) -> ChainMotion {
    let mut motion = [state.q.clone(), state.v.clone(), accelerations.to_vec()];
    for k in 0..state.q.len() {
        let direction = PolarAxis::Z.direction([0, 1, 2].map(|i| motion[i][k]));
        if axis != PolarAxis::Z {
            let blocks = axis.coordinates(direction);
            (0..3).for_each(|i| motion[i][k] = blocks[i]);
        }
    }
    motion
}

/// A random state whose segments are away from the poles of both charts, and relaxed straight.
fn regular_state(rng: &mut Rng, segments: usize) -> RandomState {
    loop {
        let mut state = random_state(rng, segments);
        for link in &mut state.chain.links[1..] {
            link.relaxed_angle = RelaxedAngle::new(0.0);
        }
        let along_x = |q: &[f64; 2]| (q[0].sin() * q[1].cos()).abs();
        if state
            .q
            .iter()
            .all(|q| along_x(q) < 0.9 && q[0].cos().abs() < 0.9)
        {
            return state;
        }
    }
}

#[test]
fn accelerations_do_not_depend_on_the_charts() {
    let mut rng = Rng::with_seed(21);
    for segments in [1, 2, 3, 5, 8, 13, 25] {
        let state = regular_state(&mut rng, segments);
        let accelerations = state.accelerations(PolarAxis::Z);
        let bends = |axis: PolarAxis, q: &[[f64; 2]], v: &[[f64; 2]], a: &[[f64; 2]]| -> Vec<f64> {
            (0..segments)
                .flat_map(|k| axis.direction([q[k], v[k], a[k]])[2])
                .collect()
        };
        let expected = bends(PolarAxis::Z, &state.q, &state.v, &accelerations);
        let [q, v, _] = converted(PolarAxis::X, &state, &accelerations);
        let there = RandomState {
            q,
            v,
            chain: state.chain.clone(),
            clamp: state.clamp,
        };
        let about_x = there.accelerations(PolarAxis::X);
        let bends = bends(PolarAxis::X, &there.q, &there.v, &about_x);
        let differences = bends.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        let error = differences.fold(0.0, f64::max) / largest(&expected);
        assert!(error < tolerance::AGREEMENT, "n = {segments}: {error:.1e}");
    }
}

#[test]
fn energies_nodes_and_the_root_do_not_depend_on_the_charts() {
    let mut rng = Rng::with_seed(22);
    for segments in [1, 2, 6, 25] {
        let state = regular_state(&mut rng, segments);
        let accelerations = random_pairs(&mut rng, segments, 1e4);
        let results = |axis: PolarAxis| {
            let [q, v, a] = converted(axis, &state, &accelerations);
            let mut dynamics = Dynamics::new(state.chain.clone());
            dynamics.set_chart(axis);
            dynamics.residual(
                state.clamp.holding(&q, &v),
                &a,
                &NoLoads,
                &mut vec![[0.0; 2]; segments],
            );
            let energies = dynamics.energies(state.clamp.holding(&q, &v));
            let nodes: Vec<f64> = (0..segments)
                .flat_map(|k| {
                    let acceleration = dynamics.node_acceleration(k);
                    [
                        dynamics.positions()[k],
                        dynamics.velocities()[k],
                        acceleration,
                    ]
                    .concat()
                })
                .collect();
            let Energies {
                kinetic,
                spring,
                gravity,
                dissipation,
                clamp_torque_power,
            } = energies;
            let energies = [kinetic, spring, gravity, dissipation, clamp_torque_power];
            [&energies[..], &dynamics.root_force(), &nodes].concat()
        };
        let expected = results(PolarAxis::Z);
        for (value, expected) in results(PolarAxis::X).iter().zip(&expected) {
            let error = (value - expected).abs();
            // The error is absolute where sums of a component cancel.
            assert!(
                error <= tolerance::AGREEMENT * expected.abs().max(1.0),
                "n = {segments}: {value} {expected}"
            );
        }
    }
}

#[test]
fn factorised_step_matrix_about_x_matches_differences() {
    let mut rng = Rng::with_seed(23);
    for segments in [1, 2, 3, 7, 25] {
        let state = regular_state(&mut rng, segments);
        let accelerations = random_pairs(&mut rng, segments, 1e4);
        let [q, v, a] = converted(PolarAxis::X, &state, &accelerations);
        let state = RandomState {
            q,
            v,
            chain: state.chain.clone(),
            clamp: state.clamp,
        };
        let mut dynamics = Dynamics::new(state.chain.clone());
        dynamics.set_chart(PolarAxis::X);
        let direction = || random_pairs(&mut rng, segments, 1.0);
        check_solve(&mut dynamics, &state, &a, &NoLoads, &STEPS, direction);
    }
}

type PoleSystem = FilamentSystem<FixedClamp, Plane>;

/// Rotates the frame by 90° about `x`: `z` becomes `−y`. The rotation does not permute the axes of
/// the charts cyclically.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -z, y]
}

fn turned_back([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, z, -y]
}

/// A motion of a clamped filament: its chain, the clamp's direction, and `e` and `ė` of each
/// segment at the start.
#[derive(Clone)]
struct Clamped {
    chain: Chain<f64>,
    clamp: [f64; 3],
    start: Vec<[[f64; 3]; 2]>,
    duration: f64,
    rate_scale: f64,
}

/// Observations of an integrated motion.
struct ObservedMotion {
    /// The nodes at the end.
    nodes: Vec<[f64; 3]>,
    statistics: Statistics,
    /// Largest change of the total energy, relative to the largest kinetic energy.
    energy_error: f64,
    /// Number of times that a segment passed within 17° of the axis `z`, summed over the segments.
    visits: usize,
}

impl Clamped {
    fn turned(&self) -> Self {
        Self {
            chain: Chain {
                gravity: turned(self.chain.gravity),
                ..self.chain.clone()
            },
            clamp: turned(self.clamp),
            start: self.start.iter().map(|motion| motion.map(turned)).collect(),
            ..self.clone()
        }
    }

    fn system(&self) -> PoleSystem {
        let law = ContactLaw::from(&ContactSettings::default());
        let far = Plane::new([0.0, -1e3, 0.0], [0.0, 1.0, 0.0], [0.0; 3]);
        FilamentSystem::new(
            self.chain.clone(),
            FixedClamp {
                direction: self.clamp,
            },
            law,
            far,
            false,
        )
    }

    fn state(&self, system: &mut PoleSystem) -> FilamentState {
        let coordinates = self
            .start
            .iter()
            .map(|[e, rate]| PolarAxis::Z.coordinates([*e, *rate, [0.0; 3]]));
        let (q, v) = coordinates.map(|[q, v, _]| (q, v)).unzip();
        system.state(0.0, q, v)
    }

    fn integrate(&self) -> ObservedMotion {
        let mut system = self.system();
        let start = self.state(&mut system);
        let tolerances = Tolerances::of_motion(TOLERANCE, 1.0, self.rate_scale);
        let energies = |system: &mut PoleSystem, state: &FilamentState| {
            let energies = system.energies(state);
            (
                energies.kinetic,
                energies.kinetic + energies.spring + energies.gravity,
            )
        };
        let mut observing = self.system();
        let (mut kinetic, total) = energies(&mut observing, &start);
        let (mut change, mut visits, mut nodes) = (0.0_f64, 0, Vec::new());
        let mut near = vec![false; self.chain.segments()];
        let observe = |step: &bristle::simulation::Step<'_>| {
            let here = energies(&mut observing, step.end);
            kinetic = kinetic.max(here.0);
            change = change.max((here.1 - total).abs());
            nodes = step.end_nodes.iter().map(|knot| knot.value).collect();
            for (k, near) in near.iter_mut().enumerate() {
                let motion = [step.end.q[k], step.end.v[k], [0.0; 2]];
                let is_near =
                    step.end.chart.direction(motion)[0][2].abs() > 17.0_f64.to_radians().cos();
                visits += usize::from(is_near && !*near);
                *near = is_near;
            }
        };
        let (_, statistics) = integrate(
            &mut system,
            start,
            self.duration,
            &ESDIRK54,
            tolerances,
            observe,
        )
        .unwrap_or_else(|error| panic!("{error}"));
        ObservedMotion {
            nodes,
            statistics,
            energy_error: change / kinetic,
            visits,
        }
    }
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| largest(&sub(*a, *b)))
        .fold(0.0, f64::max)
}

/// A rigid pendulum of length 1 m under gravity along `−z`, from `e` and `ė`.
fn pendulum(e: [f64; 3], rate: [f64; 3], duration: f64) -> Clamped {
    let chain = Chain::from(UniformChain {
        segments: 1,
        length: 1.0,
        mass: 1.0,
        inertia: 1.0 / 12.0,
        root_stiffness: 0.0,
        joint_stiffness: 0.0,
        root_damping: 0.0,
        joint_damping: 0.0,
        gravity: [0.0, 0.0, -9.81],
    });
    Clamped {
        chain,
        clamp: [0.0, 1.0, 0.0],
        start: vec![[e, rate]],
        duration,
        rate_scale: 1.0,
    }
}

/// Tolerance of the integration, per step.
const TOLERANCE: f64 = 1e-8;
/// Largest error of the energy, relative to the largest kinetic energy: the errors of up to 1e5
/// steps mostly cancel.
const MAX_ENERGY_ERROR: f64 = 1e-6;
/// Largest difference of two integrations, relative to the length: the steps are the same, but
/// their errors depend on the coordinates.
const MAX_DIFFERENCE: f64 = 1e-5;

/// Checks that a motion conserves its energy, and is the same in rotated axes, where it meets no
/// pole.
fn check_motion(motion: &Clamped) -> ObservedMotion {
    let seen = motion.integrate();
    let turned = motion.turned().integrate();
    assert_eq!(
        turned.statistics.chart_changes, 0,
        "it meets a pole in rotated axes"
    );
    let nodes: Vec<[f64; 3]> = turned.nodes.iter().map(|node| turned_back(*node)).collect();
    let length = motion.chain.length * motion.chain.segments() as f64;
    let difference = distance(&seen.nodes, &nodes) / length;
    assert!(
        seen.energy_error < MAX_ENERGY_ERROR,
        "{:.1e}",
        seen.energy_error
    );
    assert!(difference < MAX_DIFFERENCE, "{difference:.1e}");
    seen
}

#[test]
fn a_spherical_pendulum_swings_and_tumbles_through_the_poles() {
    // The motion goes through z exactly, or misses it closely; 20 s are some 12 periods.
    let (sin, cos) = 0.5_f64.sin_cos();
    for lateral in [0.0, 1e-9, 1e-6, 1e-3, 0.3] {
        let motion = pendulum([sin, 0.0, -cos], [0.0, lateral, 0.0], 20.0);
        let seen = check_motion(&motion);
        assert!(seen.visits > 20, "{}", seen.visits);
        assert!(seen.statistics.chart_changes > 0);
    }
    for lateral in [0.0, 1e-7, 1e-2] {
        let motion = pendulum([0.8, 0.0, -0.6], [6.0, lateral, 8.0], 10.0);
        let seen = check_motion(&motion);
        // Four changes per turn: near z, x, −z and −x.
        assert!(seen.statistics.chart_changes > 40, "{:?}", seen.statistics);
    }
}

/// The undamped `filament`, clamped along `clamp` (`±z`), bent towards `x` by up to `bend` (rad)
/// and released with a velocity along `y`, for `periods` periods of its first bending mode.
fn released(
    filament: &FilamentSettings,
    gravity: [f64; 3],
    clamp: f64,
    bend: f64,
    periods: f64,
) -> Clamped {
    let filament = FilamentSettings {
        damping_ratio: 0.0,
        ..filament.clone()
    };
    let frequency = first_natural_frequency(&filament);
    let start = (0..filament.segments).map(|k| {
        let share = (FRAC_PI_2 * (k as f64 + 0.5) / filament.segments as f64).sin();
        let (sin, cos) = (bend * share).sin_cos();
        [
            [sin, 0.0, clamp * cos],
            [0.0, 0.2 * bend * share * frequency, 0.0],
        ]
    });
    Clamped {
        chain: chain(&filament, gravity),
        clamp: [0.0, 0.0, clamp],
        start: start.collect(),
        duration: periods * 2.0 * PI / frequency,
        rate_scale: frequency,
    }
}

#[test]
fn axial_and_hanging_filaments_swing_through_the_axis() {
    // Its weight, not its stiffness, restores a filament this soft.
    let soft = FilamentSettings {
        youngs_modulus_pa: 1e6,
        ..filament(5)
    };
    // As in a cup brush, every segment passes the axis twice per period.
    for (motion, visits) in [
        (released(&filament(5), [0.0; 3], 1.0, 0.8, 2.0), 5),
        (released(&filament(25), [0.0; 3], 1.0, 0.8, 1.0), 25),
        (released(&soft, [0.0, 0.0, -9.81], -1.0, 1.3, 3.0), 15),
    ] {
        // Segments start about x, and stay.
        let seen = check_motion(&motion);
        assert!(seen.visits > visits, "{}", seen.visits);
    }
}

#[test]
fn history_of_a_pass_continues_across_chart_changes() {
    // A load along the tool's axis that bends the filament to it.
    let mut settings = crate::common::case(10, 10.0, 1e-3);
    settings.process.gravity_m_s2 = [0.0, 0.0, 2e5];
    let simulation = simulate_with_history(&settings, 2001).expect("the pass ends");
    assert!(
        simulation.statistics.chart_changes > 0,
        "{:?}",
        simulation.statistics
    );
    let of_energy: [fn(&Sample) -> f64; 2] = [
        |sample| sample.kinetic_energy_j,
        |sample| sample.potential_energy_j,
    ];
    for of_energy in of_energy {
        let energies: Vec<f64> = simulation.history.iter().map(of_energy).collect();
        let jumps: Vec<f64> = energies.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // Coordinates read in the wrong chart would give a completely different shape.
        assert!(largest(&jumps) < 0.05 * largest(&energies));
    }
}

#[test]
fn states_at_a_pole_are_refused_by_name() {
    let mut state = RoundToolState {
        base_angle: 0.0,
        base_rate: 0.0,
        base_acceleration: 0.0,
        gravity: [0.0; 3],
        q: vec![FRAC_PI_2, 0.0, 0.9 * POLE, 0.3],
        v: vec![0.0; 4],
    };
    for polar_angle in [0.0, 0.9 * POLE, PI, PI - 0.9 * POLE, -0.9 * POLE] {
        state.q[2] = polar_angle;
        match evaluate(&filament(2), 0.14, &state) {
            Err(EvaluationError::Pole(error)) => {
                assert_eq!((error.segment, error.axis), (2, PolarAxis::Z))
            }
            other => panic!("{other:?}"),
        }
    }
    state.q[2] = 1.1 * POLE;
    assert!(evaluate(&filament(2), 0.14, &state).is_ok());
    let mut dynamics = Dynamics::new(chain(&filament(2), [0.0; 3]));
    dynamics.set_chart(PolarAxis::X);
    let message = dynamics
        .check_poles(&[[1.0, 0.0], [PI, 0.0]])
        .expect_err("at a pole of x")
        .to_string();
    assert!(
        message.starts_with("segment 2 with φ = 3.14") && message.contains("about x"),
        "{message}"
    );
}

#[test]
fn a_state_at_a_pole_starts_in_the_other_chart() {
    // At the pole θ determines the direction in which φ moves, and θ̇ has no meaning.
    for (polar_angle, z) in [(0.0, 1.0), (PI, -1.0)] {
        let mut system = pendulum([0.0, 0.0, 1.0], [0.0; 3], 1.0).system();
        let state = system.state(0.0, vec![[polar_angle, 0.3]], vec![[2.0, 5.0]]);
        assert_eq!(state.chart, PolarAxis::X);
        let [e, rate, _] = PolarAxis::X.direction([state.q[0], state.v[0], state.accelerations[0]]);
        assert!(largest(&sub(e, [0.0, 0.0, z])) < 1e-15, "{e:?}");
        assert!(
            largest(&sub(
                rate,
                [2.0 * z * 0.3_f64.cos(), 2.0 * z * 0.3_f64.sin(), 0.0]
            )) < 1e-15,
            "{rate:?}"
        );
        assert!(
            state
                .accelerations
                .as_flattened()
                .iter()
                .all(|a| a.is_finite())
        );
    }
}
