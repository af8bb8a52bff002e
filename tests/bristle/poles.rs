//! Segments at and near the poles of their coordinates: the motion is the same in both charts.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::agreement::{Coordinates, WEIGHTS, check_joint_tangent, check_solve};
use crate::common::{RandomState, filament, largest, random_pairs, random_state, tolerance};
use bristle::contact::ContactLaw;
use bristle::equations::kernels::{self, JointConstants, Side};
use bristle::equations::linear::sub;
use bristle::equations::{
    Chain, ChainDynamics, Dynamics, Energies, NoLoads, POLE, PolarAxis, UniformChain,
};
use bristle::integrate::tableau::ESDIRK54;
use bristle::integrate::{IntegrationError, Integrator, RejectionCause, StageSolution, Tolerances};
use bristle::model::filament::{chain, first_natural_frequency};
use bristle::model::settings::{ContactSettings, FilamentSettings};
use bristle::simulation::{
    FilamentState, FilamentSystem, Obstacle, Sample, Statistics, integrate, simulate_with_history,
};
use bristle::tool::{ClampMotion, FixedClamp};
use bristle::workpiece::Plane;
use bristle_inspect::evaluation::{ChainState, EvaluationError, evaluate};
use fastrand::Rng;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Charts, coordinates, rates and accelerations.
type Charted = (Vec<PolarAxis>, Vec<[f64; 2]>, Vec<[f64; 2]>, Vec<[f64; 2]>);

/// The same motion, with each segment about its axis of `charts`.
fn converted(charts: Vec<PolarAxis>, state: &RandomState, accelerations: &[[f64; 2]]) -> Charted {
    let (mut q, mut v, mut a) = (state.q.clone(), state.v.clone(), accelerations.to_vec());
    for (k, axis) in charts.iter().enumerate() {
        if *axis != PolarAxis::Z {
            [q[k], v[k], a[k]] = axis.coordinates(PolarAxis::Z.direction([q[k], v[k], a[k]]));
        }
    }
    (charts, q, v, a)
}

fn random_charts(rng: &mut Rng, segments: usize) -> Vec<PolarAxis> {
    (0..segments)
        .map(|_| {
            if rng.bool() {
                PolarAxis::Z
            } else {
                PolarAxis::X
            }
        })
        .collect()
}

/// A random state whose segments are away from the poles of both charts.
fn regular_state(rng: &mut Rng, segments: usize) -> RandomState {
    loop {
        let state = random_state(rng, segments);
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
        let accelerations = state.accelerations(&state.charts());
        let bends =
            |charts: &[PolarAxis], q: &[[f64; 2]], v: &[[f64; 2]], a: &[[f64; 2]]| -> Vec<f64> {
                (0..segments)
                    .flat_map(|k| charts[k].direction([q[k], v[k], a[k]])[2])
                    .collect()
            };
        let expected = bends(
            &vec![PolarAxis::Z; segments],
            &state.q,
            &state.v,
            &accelerations,
        );
        for charts in [
            vec![PolarAxis::X; segments],
            random_charts(&mut rng, segments),
        ] {
            let (charts, q, v, _) = converted(charts, &state, &accelerations);
            let there = RandomState {
                q,
                v,
                chain: state.chain.clone(),
                clamp: state.clamp,
            };
            let bends = bends(&charts, &there.q, &there.v, &there.accelerations(&charts));
            let error = bends
                .iter()
                .zip(&expected)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
                / largest(&expected);
            assert!(
                error < tolerance::AGREEMENT,
                "n = {segments}, {charts:?}: {error:.1e}"
            );
        }
    }
}

#[test]
fn energies_nodes_and_the_root_do_not_depend_on_the_charts() {
    let mut rng = Rng::with_seed(22);
    for segments in [1, 2, 6, 25] {
        let state = regular_state(&mut rng, segments);
        let accelerations = random_pairs(&mut rng, segments, 1e4);
        let results = |charts: Vec<PolarAxis>| {
            let (charts, q, v, a) = converted(charts, &state, &accelerations);
            let mut dynamics = Dynamics::new(state.chain.clone());
            dynamics.set_charts(&charts);
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
        let expected = results(vec![PolarAxis::Z; segments]);
        for charts in [
            vec![PolarAxis::X; segments],
            random_charts(&mut rng, segments),
        ] {
            for (value, expected) in results(charts).iter().zip(&expected) {
                let error = (value - expected).abs();
                // Absolute where sums of a component cancel.
                assert!(
                    error <= tolerance::AGREEMENT * expected.abs().max(1.0),
                    "n = {segments}: {value} {expected}"
                );
            }
        }
    }
}

#[test]
fn factorised_step_matrix_with_two_charts_matches_differences() {
    let mut rng = Rng::with_seed(23);
    for segments in [1, 2, 3, 7, 25] {
        let state = regular_state(&mut rng, segments);
        let accelerations = random_pairs(&mut rng, segments, 1e4);
        for charts in [
            vec![PolarAxis::X; segments],
            random_charts(&mut rng, segments),
        ] {
            let (charts, q, v, a) = converted(charts, &state, &accelerations);
            let state = RandomState {
                q,
                v,
                chain: state.chain.clone(),
                clamp: state.clamp,
            };
            check_solve(&state, &charts, &a, &NoLoads, &mut rng);
        }
    }
}

fn trigonometry([phi, theta]: [f64; 2]) -> [f64; 4] {
    [phi.sin(), phi.cos(), theta.sin(), theta.cos()]
}

/// Relaxed angle of the joints in rad.
const RELAXED: f64 = 0.2;

/// Sine and cosine of the azimuth of the outer side of a crossed joint, less the relaxed angle.
fn unbent([_, theta]: [f64; 2]) -> [f64; 2] {
    [(theta - RELAXED).sin(), (theta - RELAXED).cos()]
}

/// The vector turned about `z` by the relaxed angle.
fn relaxed([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = RELAXED.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// The energy and dissipation of a joint from the directions alone, by the axes of its sides.
fn energies(inner: (PolarAxis, Coordinates), outer: (PolarAxis, Coordinates)) -> [f64; 2] {
    let [[e, e_rate], [next, next_rate]] = [inner, outer].map(|(axis, side)| {
        let [direction, rate, _] = axis.direction([side[0], side[1], [0.0; 2]]);
        [direction, rate]
    });
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        })
    };
    let square = |a: [f64; 3]| a.iter().map(|a| a * a).sum::<f64>();
    let angle = 2.0 * (square(sub(next, relaxed(e))).sqrt() / 2.0).asin();
    [
        0.5 * angle * angle,
        0.5 * square(sub(cross(next, next_rate), cross(e, e_rate))),
    ]
}

/// A side of a joint as the kernels take it.
fn side([q, rates]: Coordinates) -> Side<f64, 4> {
    Side {
        angles: trigonometry(q),
        rates,
    }
}

/// The outer side of a joint, about z, and inner sides, about x: bent, and relaxed and turning as a
/// whole.
fn crossed_sides() -> [(Coordinates, Coordinates); 2] {
    let z = [[1.1, 0.7], [0.4, -0.9]];
    let [theta, rest] = [z[0][1] - RELAXED, 0.0];
    let inner = PolarAxis::X.coordinates(PolarAxis::Z.direction([
        [z[0][0], theta],
        [rest, z[1][1]],
        [0.0; 2],
    ]));
    [
        (z, [[0.8, 1.3], [0.6, 0.3]]),
        ([z[0], [rest, z[1][1]]], [inner[0], inner[1]]),
    ]
}

/// Checks the torques of a joint, one per coordinate of its inner and its outer side, against the
/// slopes of its energies.
fn check_slopes(
    torques: &[f64],
    inner: (PolarAxis, Coordinates),
    outer: (PolarAxis, Coordinates),
    constants: JointConstants<f64>,
) {
    let size = 1e-5;
    for (i, torque) in torques.iter().enumerate() {
        let slope = |order: usize| {
            let at = |size: f64| {
                let mut sides = [inner, outer];
                sides[i / 2].1[order][i % 2] += size;
                energies(sides[0], sides[1])[order]
            };
            (at(size) - at(-size)) / (2.0 * size)
        };
        let expected = -constants.stiffness * slope(0) - constants.damping * slope(1);
        assert!((torque - expected).abs() < 1e-9, "{i}: {torque} {expected}");
    }
}

#[test]
fn crossed_joint_is_the_slope_of_its_energies() {
    let constants = JointConstants {
        stiffness: 0.7,
        damping: 0.3,
    };
    let [(z, x), straight] = crossed_sides();
    let crossed = |z: Coordinates, x: Coordinates| {
        kernels::crossed_joint(side(z), side(x), unbent(z[0]), constants)
    };
    let joint = crossed(z, x);
    let torques = [joint.x, joint.z].concat();
    check_slopes(&torques, (PolarAxis::X, x), (PolarAxis::Z, z), constants);
    // A relaxed joint has no elastic torque.
    let (z, x) = straight;
    let joint = crossed([z[0], [0.0; 2]], [x[0], [0.0; 2]]);
    assert!(largest(&[joint.z, joint.x].concat()) < 1e-15, "{joint:?}");
}

#[test]
fn joint_about_x_is_the_slope_of_its_energies_and_its_tangents_match_differences() {
    let constants = JointConstants {
        stiffness: 0.7,
        damping: 0.3,
    };
    let sides: [Coordinates; 2] = [[[0.8, 1.3], [0.6, 0.3]], [[1.2, 0.9], [-0.2, 0.5]]];
    let turn = [RELAXED.sin(), RELAXED.cos()];
    let step = |[previous, next]: [Coordinates; 2]| {
        let step = previous[0][1] - next[0][1];
        [step.sin(), step.cos()]
    };
    let joint = |sides: [Coordinates; 2]| {
        let joint =
            kernels::joint_about_x(side(sides[0]), side(sides[1]), step(sides), turn, constants);
        [joint.previous, joint.next]
    };
    check_slopes(
        &joint(sides).concat(),
        (PolarAxis::X, sides[0]),
        (PolarAxis::X, sides[1]),
        constants,
    );
    for weights in WEIGHTS {
        let [previous, next] = sides.map(side);
        let tangent =
            kernels::joint_about_x_tangent(previous, next, step(sides), turn, constants, weights);
        let blocks = [
            [tangent.previous_previous, tangent.previous_next],
            [tangent.next_previous, tangent.next_next],
        ];
        check_joint_tangent(blocks, joint, sides, weights);
    }
}

#[test]
fn crossed_joint_tangents_match_differences() {
    let constants = JointConstants {
        stiffness: 0.7,
        damping: 0.3,
    };
    for (z, x) in crossed_sides() {
        for weights in WEIGHTS {
            let tangent =
                kernels::crossed_joint_tangent(side(z), side(x), unbent(z[0]), constants, weights);
            let blocks = [[tangent.z_z, tangent.z_x], [tangent.x_z, tangent.x_x]];
            let torques = |[z, x]: [Coordinates; 2]| {
                let joint = kernels::crossed_joint(side(z), side(x), unbent(z[0]), constants);
                [joint.z, joint.x]
            };
            check_joint_tangent(blocks, torques, [z, x], weights);
        }
    }
}

type System = FilamentSystem<FixedClamp, Plane>;

/// Rotates the frame by 90° about `x`: `z` becomes `−y`. It does not permute the axes of the charts
/// cyclically.
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
struct Seen {
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

    fn system(&self) -> System {
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

    fn state(&self, system: &mut System) -> FilamentState {
        let coordinates = self
            .start
            .iter()
            .map(|[e, rate]| PolarAxis::Z.coordinates([*e, *rate, [0.0; 3]]));
        let (q, v) = coordinates.map(|[q, v, _]| (q, v)).unzip();
        system.state(0.0, q, v)
    }

    fn integrate(&self, relative: f64) -> Seen {
        let mut system = self.system();
        let start = self.state(&mut system);
        let tolerances = Tolerances::of_motion(relative, 1.0, self.rate_scale);
        let energies = |system: &mut System, state: &FilamentState| {
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
                    step.end.charts[k].direction(motion)[0][2].abs() > 17.0_f64.to_radians().cos();
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
        Seen {
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
/// Energy over a whole motion, relative to the largest kinetic energy: up to 1e5 steps, whose
/// errors mostly cancel.
const ENERGY: f64 = 1e-6;
/// Two integrations of one motion, relative to its length: the steps are the same, but their errors
/// depend on the coordinates.
const SAME_MOTION: f64 = 1e-5;

/// Checks a motion: its energy is conserved, and in rotated axes, where it meets no pole, it is the
/// same motion.
fn check_motion(motion: &Clamped, relative: f64) -> Seen {
    let seen = motion.integrate(relative);
    let turned = motion.turned().integrate(relative);
    assert_eq!(
        turned.statistics.chart_changes, 0,
        "it meets a pole in rotated axes"
    );
    let nodes: Vec<[f64; 3]> = turned.nodes.iter().map(|node| turned_back(*node)).collect();
    let length = motion.chain.length * motion.chain.segments() as f64;
    let difference = distance(&seen.nodes, &nodes) / length;
    assert!(seen.energy_error < ENERGY, "{:.1e}", seen.energy_error);
    assert!(difference < SAME_MOTION, "{difference:.1e}");
    assert!(seen.statistics.chart_changes > 0);
    seen
}

#[test]
fn spherical_pendulum_swings_through_the_pole() {
    // In a plane through z exactly, and near misses; 20 s are some 12 periods.
    let (sin, cos) = 0.5_f64.sin_cos();
    for lateral in [0.0, 1e-9, 1e-6, 1e-3, 0.3] {
        let motion = pendulum([sin, 0.0, -cos], [0.0, lateral, 0.0], 20.0);
        let seen = check_motion(&motion, TOLERANCE);
        assert!(seen.visits > 20, "{}", seen.visits);
    }
}

#[test]
fn spherical_pendulum_tumbles_through_the_poles_of_both_charts() {
    for lateral in [0.0, 1e-7, 1e-2] {
        let motion = pendulum([0.8, 0.0, -0.6], [6.0, lateral, 8.0], 10.0);
        let seen = check_motion(&motion, TOLERANCE);
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
fn axial_filament_swings_through_the_axis() {
    // As in a cup brush, every segment passes the axis twice per period.
    for (segments, periods) in [(5, 2.0), (25, 1.0)] {
        let motion = released(&filament(segments), [0.0; 3], 1.0, 0.8, periods);
        let seen = check_motion(&motion, TOLERANCE);
        assert!(seen.visits > segments, "{}", seen.visits);
        assert!(
            seen.statistics.chart_changes > segments / 2,
            "{:?}",
            seen.statistics
        );
    }
}

#[test]
fn hanging_filament_swings_through_the_vertical() {
    // So soft that its weight, not its stiffness, restores it.
    let soft = FilamentSettings {
        youngs_modulus_pa: 1e6,
        ..filament(5)
    };
    let motion = released(&soft, [0.0, 0.0, -9.81], -1.0, 1.3, 3.0);
    let seen = check_motion(&motion, TOLERANCE);
    assert!(seen.visits > 15, "{}", seen.visits);
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
    let mut state = ChainState {
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
    dynamics.set_charts(&[PolarAxis::Z, PolarAxis::X]);
    let message = dynamics
        .check_poles(&[[1.0, 0.0], [PI, 0.0]])
        .expect_err("at a pole of x")
        .to_string();
    assert!(
        message.starts_with("segment 2 with φ = 3.14") && message.contains("about x"),
        "{message}"
    );
}

/// A free rotation at 1 rad/s that reaches a pole of `z` at 0.35 s.
fn rotation() -> Clamped {
    let motion = pendulum(
        [0.35_f64.sin(), 0.0, 0.35_f64.cos()],
        [-0.35_f64.cos(), 0.0, 0.35_f64.sin()],
        0.35,
    );
    Clamped {
        chain: Chain {
            gravity: [0.0; 3],
            ..motion.chain
        },
        ..motion
    }
}

#[test]
fn steps_that_end_at_a_pole_are_rejected_by_name() {
    // If nothing changes the chart of the segment, an integrator gets as close to the pole as
    // allowed.
    let motion = rotation();
    let mut system = motion.system();
    let mut start = motion.state(&mut system);
    assert_eq!(start.charts, [PolarAxis::Z]);
    let mut end = start.clone();
    let tolerances = Tolerances::of_motion(1e-6, 1.0, 1.0);
    let mut integrator = Integrator::new(&ESDIRK54, StageSolution::Predicted, tolerances, 1, 0.1);
    let error = loop {
        match integrator.advance(&mut system, &start, &mut end, motion.duration) {
            Ok(()) => std::mem::swap(&mut start, &mut end),
            Err(error) => break error,
        }
    };
    let IntegrationError::StepTooSmall { cause, time, .. } = error else {
        panic!("{error:?}")
    };
    assert_eq!(
        cause,
        RejectionCause::Refused(Obstacle::Pole { segment: 1 })
    );
    assert!((time - (0.35 - POLE)).abs() < 1e-9, "{time}");
    assert!(
        error.to_string().contains("segment 1 is at a pole"),
        "{error}"
    );

    // Nor can a step start there.
    start.q[0][0] = 0.0;
    let error = integrator
        .advance(&mut system, &start, &mut end, 1.0)
        .expect_err("a pole");
    assert!(
        matches!(
            error,
            IntegrationError::Refused {
                reason: Obstacle::Pole { segment: 1 },
                ..
            }
        ),
        "{error:?}"
    );
    assert!(error.to_string().contains("segment 1"), "{error}");

    // If charts change, the same motion reaches its end.
    let seen = motion.integrate(1e-6);
    assert!(seen.statistics.chart_changes == 1);
    assert!(distance(&seen.nodes, &[[0.0, 0.0, 1.0]]) < 1e-6);
}

#[test]
fn a_state_at_a_pole_starts_in_the_other_chart() {
    // At the pole θ determines the direction in which φ moves, and θ̇ has no meaning.
    for (polar_angle, z) in [(0.0, 1.0), (PI, -1.0)] {
        let mut system = rotation().system();
        let state = system.state(0.0, vec![[polar_angle, 0.3]], vec![[2.0, 5.0]]);
        assert_eq!(state.charts, [PolarAxis::X]);
        let [e, rate, _] = PolarAxis::X.direction([state.q[0], state.v[0], state.accelerations[0]]);
        assert!(largest(&sub(e, [0.0, 0.0, z])) < 1e-15, "{e:?}");
        assert!(
            largest(&sub(
                rate,
                [2.0 * z * 0.3_f64.cos(), 2.0 * z * 0.3_f64.sin(), 0.0]
            )) < 1e-15,
            "{rate:?}"
        );
        // No force acts, so the angular velocity stays the same.
        assert!(
            state
                .accelerations
                .as_flattened()
                .iter()
                .all(|a| a.is_finite())
        );
    }
}

/// The condition number of `M` for a straight filament of `segments` segments, with the middle one
/// at `sin φ = sine` and the others at the equator.
fn condition(segments: usize, sine: f64) -> f64 {
    let size = 2 * segments;
    let mut q = vec![[FRAC_PI_2, 0.0]; segments];
    q[segments / 2][0] = sine.asin();
    let rest = vec![[0.0; 2]; segments];
    let mut chain = chain(&filament(segments), [0.0; 3]);
    for link in &mut chain.links {
        link.stiffness = 0.0;
    }
    let mut dynamics = Dynamics::new(chain);
    let clamp = FixedClamp {
        direction: [1.0, 0.0, 0.0],
    }
    .at(0.0);
    let mut mass = DMatrix::zeros(size, size);
    for i in 0..size {
        let (mut accelerations, mut residual) = (rest.clone(), rest.clone());
        accelerations.as_flattened_mut()[i] = 1.0;
        dynamics.residual(
            clamp.holding(&q, &rest),
            &accelerations,
            &NoLoads,
            &mut residual,
        );
        mass.set_column(i, &DVector::from_column_slice(residual.as_flattened()));
    }
    let eigenvalues = SymmetricEigen::new(mass).eigenvalues;
    eigenvalues.max() / eigenvalues.min()
}

#[test]
fn condition_of_the_mass_matrix_grows_as_the_inverse_square_of_the_sine() {
    for segments in [1, 5, 25] {
        let conditions = [1.0, 0.3, 1e-1, 1e-2, 1e-3].map(|sine| condition(segments, sine));
        let order = (conditions[4] / conditions[3]).log10();
        assert!((order - 2.0).abs() < 0.01, "n = {segments}: {order}");
    }
}
