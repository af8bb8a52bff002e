//! Conserved quantities and exact solutions of free motions.

use std::f64::consts::PI;

use bristle::equations::linear::{add, scale};
use bristle::equations::{Chain, PolarAxis};
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::simulation::{FilamentState, FilamentSystem, integrate};
use bristle::tool::FixedClamp;
use bristle::workpiece::Plane;

use super::chains::{WALL, mechanical_energy, momentum, rods, unit_chain, untouched, worse};
use super::exact::pendulum::SphericalPendulum;
use super::trial::{Trial, TrialResult, logarithmic_slope};
use super::{sources, tolerances};

/// A system that only its clamp touches.
type ClampedSystem = FilamentSystem<FixedClamp, Plane>;

/// Directions of the segments and their rates, independent of the charts.
fn directions(state: &FilamentState) -> Vec<[[f64; 3]; 2]> {
    let motion = |k: usize| [state.q[k], state.v[k], [0.0; 2]];
    (0..state.q.len())
        .map(|k| state.chart.direction(motion(k)))
        .map(|[e, rate, _]| [e, rate])
        .collect()
}

/// The state at time zero with these directions and rates.
fn state_of(system: &mut ClampedSystem, directions: &[[[f64; 3]; 2]]) -> FilamentState {
    let coordinates = directions
        .iter()
        .map(|[e, rate]| PolarAxis::Z.coordinates([*e, *rate, [0.0; 3]]));
    let (q, v) = coordinates.map(|[q, v, _]| (q, v)).unzip();
    system.state(0.0, q, v)
}

/// Angular momentum about `z` through the origin, where the root is at rest.
fn axial_momentum(chain: &Chain<f64>, state: &FilamentState) -> f64 {
    let root = [[0.0; 3]; 2];
    let nodes = directions(state).into_iter().scan(root, |node, [e, rate]| {
        *node = [
            add(node[0], scale(chain.length, e)),
            add(node[1], scale(chain.length, rate)),
        ];
        Some(*node)
    });
    momentum(chain, root, nodes).1
}

/// Four segments that swing in space about a ball joint, under gravity along `−z`, bent and
/// whirling; with the period of a straight rod.
fn swinging() -> (Chain<f64>, Vec<[[f64; 3]; 2]>, f64) {
    let mut chain = Chain {
        gravity: [0.0, 0.0, -1.0],
        ..unit_chain(4)
    };
    for (k, link) in chain.links.iter_mut().enumerate() {
        link.stiffness *= if k == 0 { 0.0 } else { 0.02 };
    }
    let start = (0..4).map(|k| {
        let (polar, azimuth) = (PI - 0.9 - 0.15 * f64::from(k), 0.2 * f64::from(k));
        let [e, rate, _] =
            PolarAxis::Z.direction([[polar, azimuth], [0.3, 0.8 - 0.2 * f64::from(k)], [0.0; 2]]);
        [e, rate]
    });
    // For a straight rod, from m g L/2 over m L²/3.
    (chain, start.collect(), 2.0 * PI * (2.0_f64 / 3.0).sqrt())
}

/// Energy and `L_z = Σ m (c × ċ)_z + J (e × ė)_z` of four segments that swing and whirl about a
/// ball joint under gravity.
///
/// The method is L-stable and loses energy in each step, nearly in proportion to the tolerance. The
/// drift is therefore relative to the number of steps and to the tolerance of a step.
pub fn conservation(trial: &mut Trial) -> TrialResult {
    const PARTS: usize = 100;
    const NUMBER: usize = 1000;
    let mut drifts = Vec::new();
    for relative in [1e-7, 1e-8, 1e-9, 1e-10] {
        let (chain, start, period) = swinging();
        let mut system = untouched(chain.clone(), WALL);
        let mut state = state_of(&mut system, &start);
        let (energy, momentum) = (
            mechanical_energy(&mut system, &state),
            axial_momentum(&chain, &state),
        );
        let kinetic = system.energies(&state).kinetic;
        let tolerances = Tolerances::of_motion(relative, 1.0, 1.0);
        let (mut energy_drift, mut momentum_drift) = (0.0, 0.0);
        let mut steps = 0;
        for part in 1..=PARTS {
            let periods = (part * NUMBER / PARTS) as f64;
            let (end, work) = integrate(
                &mut system,
                state,
                periods * period,
                &ESDIRK54,
                tolerances,
                |_| (),
            )?;
            state = end;
            steps += work.steps;
            let drift = (mechanical_energy(&mut system, &state) - energy).abs() / kinetic;
            energy_drift = worse(drift, energy_drift);
            momentum_drift = worse(
                (axial_momentum(&chain, &state) / momentum - 1.0).abs(),
                momentum_drift,
            );
        }
        for (quantity, drift, tolerance) in [
            ("ΔE/E_kin", energy_drift, tolerances::DRIFT),
            ("ΔL_z/L_z", momentum_drift, tolerances::DRIFT_MOMENTUM),
        ] {
            let subject = format!(
                "{NUMBER} periods at a tolerance of {relative:e}, change per step / tolerance"
            );
            trial.check(
                subject,
                quantity,
                0.0,
                sources::EXACT,
                drift / relative / steps as f64,
                tolerance,
            );
        }
        drifts.push((relative, energy_drift));
    }
    trial.check_within(
        format!("slope over the tolerance, {NUMBER} periods"),
        "order of ΔE",
        sources::CONTROL,
        logarithmic_slope(&drifts),
        tolerances::SLOPE,
    );
    Ok(())
}

/// Spherical pendulum (n = 1, no spring): largest errors of height and azimuth in twenty periods.
pub fn spherical_pendulum(trial: &mut Trial) -> TrialResult {
    const GRAVITY: f64 = 9.81;
    const PERIODS: f64 = 20.0;
    for (lowest, rate) in [(-0.9, 6.0), (-0.5, 9.0), (-0.99, 12.0)] {
        // a = m g s/I = 3g/(2L) of a rod.
        let pendulum = SphericalPendulum::new(1.5 * GRAVITY, lowest, rate);
        let mut system = untouched(rods(1, 1.0, 1.0 / 12.0, [0.0, 0.0, -GRAVITY]), WALL);
        let [e, e_rate, _] =
            PolarAxis::Z.direction([[f64::acos(lowest), 0.0], [0.0, rate], [0.0; 2]]);
        let start = state_of(&mut system, &[[e, e_rate]]);
        let tolerances = Tolerances::of_motion(1e-11, 1.0, 1.0);
        let (mut height, mut azimuth, mut turns, mut last) = (0.0, 0.0, 0.0, 0.0);
        integrate(
            &mut system,
            start,
            PERIODS * pendulum.period(),
            &ESDIRK54,
            tolerances,
            |step| {
                let [x, y, z] = step.end_nodes[0].value;
                let angle = y.atan2(x);
                if angle < last - PI {
                    turns += 2.0 * PI;
                }
                last = angle;
                height = worse((z - pendulum.height(step.end.time)).abs(), height);
                azimuth = worse(
                    (angle + turns - pendulum.azimuth(step.end.time)).abs(),
                    azimuth,
                );
            },
        )?;
        for (quantity, error) in [("error of cos φ", height), ("error of θ in rad", azimuth)] {
            let subject = format!("cos φ_1 = {lowest}, θ̇_1 = {rate} 1/s");
            trial.check(
                subject,
                quantity,
                0.0,
                sources::WHITTAKER,
                error,
                tolerances::TRAJECTORY,
            );
        }
    }
    Ok(())
}
