//! Conserved quantities and exact solutions of free motions.

use std::f64::consts::PI;

use bristle::contact::ContactLaw;
use bristle::equations::linear::{add, scale};
use bristle::equations::{Chain, PolarAxis};
use bristle::integrate::Tolerances;
use bristle::integrate::tableau::ESDIRK54;
use bristle::model::settings::ContactSettings;
use bristle::simulation::{FilamentState, FilamentSystem, integrate};
use bristle::tool::FixedClamp;
use bristle::workpiece::Plane;

use super::chains::{WALL, mechanical_energy, momentum, rods, unit_chain, untouched, worse};
use super::exact::pendulum::SphericalPendulum;
use super::group::{Extent, Failure, Group};
use super::trial::{Axis, Curve, Figure, Look, Trial, logarithmic_slope};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Invariants",
    purpose: "Long motions without dampers, most of them without contact: quantities that they must conserve, and pendulums whose \
        motion is known.",
    trials: &[conservation, spherical_pendulum, reversal],
};

/// A system that only its clamp touches, and perhaps a plane.
type System = FilamentSystem<FixedClamp, Plane>;

/// Directions of the segments and their rates, independent of the charts.
fn directions(state: &FilamentState) -> Vec<[[f64; 3]; 2]> {
    let motion = |k: usize| [state.q[k], state.v[k], [0.0; 2]];
    (0..state.q.len())
        .map(|k| state.charts[k].direction(motion(k)))
        .map(|[e, rate, _]| [e, rate])
        .collect()
}

/// The state at time zero with these directions, and with their rates multiplied by `factor`.
fn state_of(system: &mut System, directions: &[[[f64; 3]; 2]], factor: f64) -> FilamentState {
    let coordinates = directions
        .iter()
        .map(|[e, rate]| PolarAxis::Z.coordinates([*e, scale(factor, *rate), [0.0; 3]]));
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

fn conservation(extent: Extent) -> Result<Trial, Failure> {
    const PARTS: usize = 100;
    let (number, relatives): (usize, &[f64]) =
        extent.choose((200, &[1e-8]), (1000, &[1e-7, 1e-8, 1e-9, 1e-10]));
    let mut trial = Trial::new(
        "Energy and axial angular momentum of a free spatial motion",
        format!(
            "Four segments with springs between them swing and whirl about a ball joint, under gravity along −z. This conserves \
            `E = E_kin + E_spring + E_grav` and the angular momentum `L_z = Σ m (c × ċ)_z + J (e × ė)_z`. The motion lasts \
            {number} periods of a rigid rod of the same length. The method is L-stable and \
            loses energy in each step, nearly in proportion to the tolerance, so the drift is stated relative to the tolerance."
        ),
    );
    let (mut curves, mut drifts) = (Vec::new(), Vec::new());
    for &relative in relatives {
        let (chain, start, period) = swinging();
        let mut system = untouched(chain.clone(), WALL);
        let mut state = state_of(&mut system, &start, 1.0);
        let (energy, momentum) = (
            mechanical_energy(&mut system, &state),
            axial_momentum(&chain, &state),
        );
        let kinetic = system.energies(&state).kinetic;
        let tolerances = Tolerances::of_motion(relative, 1.0, 1.0);
        let (mut energy_drift, mut momentum_drift, mut course) = (0.0, 0.0, Vec::new());
        for part in 1..=PARTS {
            let periods = (part * number / PARTS) as f64;
            (state, _) = integrate(
                &mut system,
                state,
                periods * period,
                &ESDIRK54,
                tolerances,
                |_| (),
            )?;
            let drift = (mechanical_energy(&mut system, &state) - energy).abs() / kinetic;
            energy_drift = worse(drift, energy_drift);
            momentum_drift = worse(
                (axial_momentum(&chain, &state) / momentum - 1.0).abs(),
                momentum_drift,
            );
            course.push((periods, drift));
        }
        for (quantity, drift, tolerance) in [
            ("ΔE/E_kin", energy_drift, tolerances::DRIFT),
            ("ΔL_z/L_z", momentum_drift, tolerances::DRIFT_MOMENTUM),
        ] {
            let subject =
                format!("{number} periods at a tolerance of {relative:e}, change / tolerance");
            trial.check(
                subject,
                quantity,
                0.0,
                sources::EXACT,
                drift / relative,
                tolerance,
            );
        }
        drifts.push((relative, energy_drift));
        curves.push(Curve::new(
            format!("tolerance {relative:e}"),
            Look::Line,
            course,
        ));
    }
    if drifts.len() > 1 {
        let subject = format!("slope over the tolerance, {number} periods");
        trial.check_within(
            subject,
            "order of ΔE",
            sources::CONTROL,
            logarithmic_slope(&drifts),
            tolerances::SLOPE,
        );
    }
    trial.figures.push(Figure {
        name: "validation_energy",
        title: format!("Energy lost in {number} periods of a free spatial motion"),
        description: "Change of the energy over the kinetic energy at the start, over the number of periods: it grows with time and \
            falls with the tolerance, to one ten-millionth at 1e-10.",
        axes: [Axis::linear("periods"), Axis::logarithmic("ΔE/E_kin")],
        curves,
    });
    Ok(trial)
}

fn spherical_pendulum(_: Extent) -> Result<Trial, Failure> {
    const GRAVITY: f64 = 9.81;
    const PERIODS: f64 = 20.0;
    let mut trial = Trial::new(
        "Spherical pendulum",
        "A rod about a ball joint (n = 1, no spring), started at its lowest point `cos φ_1` with the azimuthal rate `θ̇_1`. \
            With `a = 3g/(2L)` and the zeros `u_1 < u_2 < u_3` of the cubic that its energy and angular momentum make:\n\n\
            ```text\ncos φ = u_1 + (u_2 − u_1) sn²(√(a (u_3 − u_1)/2) t, m),   m = (u_2 − u_1)/(u_3 − u_1)\n```\n\n\
            θ follows from elliptic integrals of the third kind. The errors are the largest at all steps of twenty periods, at a \
            relative tolerance of 1e-11.",
    );
    let mut curves = Vec::new();
    for (lowest, rate) in [(-0.9, 6.0), (-0.5, 9.0), (-0.99, 12.0)] {
        // a = m g s/I = 3g/(2L) of a rod.
        let pendulum = SphericalPendulum::new(1.5 * GRAVITY, lowest, rate);
        let mut system = untouched(rods(1, 1.0, 1.0 / 12.0, [0.0, 0.0, -GRAVITY]), WALL);
        let [e, e_rate, _] =
            PolarAxis::Z.direction([[f64::acos(lowest), 0.0], [0.0, rate], [0.0; 2]]);
        let start = state_of(&mut system, &[[e, e_rate]], 1.0);
        let tolerances = Tolerances::of_motion(1e-11, 1.0, 1.0);
        let (mut height, mut azimuth, mut turns, mut last) = (0.0, 0.0, 0.0, 0.0);
        let mut course = Vec::new();
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
                course.push((step.end.time, z));
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
        const SHOWN: f64 = 2.0;
        let exact = (0..=400)
            .map(|i| SHOWN * f64::from(i) / 400.0)
            .map(|time| (time, pendulum.height(time)));
        curves.push(Curve::new(
            format!("sn², cos φ_1 = {lowest}"),
            Look::Reference,
            exact,
        ));
        let shown = course
            .into_iter()
            .take_while(|(time, _)| *time <= SHOWN)
            .step_by(12);
        curves.push(Curve::new(
            format!("Bristle, cos φ_1 = {lowest}"),
            Look::Markers,
            shown,
        ));
    }
    trial.figures.push(Figure {
        name: "validation_spherical_pendulum",
        title: "Height of three spherical pendulums".to_owned(),
        description: "cos φ over two seconds: periodic curves between a lowest and a highest value; the steps coincide with them.",
        axes: [Axis::linear("time t in s"), Axis::linear("cos φ")],
        curves,
    });
    Ok(trial)
}

/// The largest difference of the directions' components.
fn distance(a: &[[[f64; 3]; 2]], b: &[[[f64; 3]; 2]]) -> f64 {
    let differences = a
        .iter()
        .zip(b)
        .flat_map(|([a, _], [b, _])| (0..3).map(|i| (a[i] - b[i]).abs()));
    differences.fold(0.0, worse)
}

fn reversal(_: Extent) -> Result<Trial, Failure> {
    const TOLERANCES: [f64; 3] = [1e-8, 1e-9, 1e-10];
    let (chain, start, period) = swinging();
    // A floor that is never reached, and one that is hit some ten times per period.
    let law = ContactLaw {
        stiffness: 1e3,
        ..ContactLaw::from(&ContactSettings::default())
    };
    let mut trial = Trial::new(
        "Time reversal",
        "The motion of the first case, reversed after some time. Without dampers it must return to its start. It runs once \
            freely, and once with its two outer nodes bouncing on an elastic floor, where each event is located twice, once from \
            each side. The return error falls in proportion to the tolerance.",
    );
    let mut courses = Vec::new();
    for (depth, periods, name) in [(1e6, 10.0, "free"), (0.7, 1.0, "bouncing on a floor")] {
        let floor = Plane::new([0.0, 0.0, -depth], [0.0, 0.0, 1.0], [0.0; 3]);
        let mut course = Vec::new();
        for relative in TOLERANCES {
            let tolerances = Tolerances::of_motion(relative, 1.0, 1.0);
            let mut state = state_of(
                &mut FilamentSystem::new(chain.clone(), WALL, law, floor, true),
                &start,
                1.0,
            );
            for _ in 0..2 {
                let mut system = FilamentSystem::new(chain.clone(), WALL, law, floor, true);
                let (end, _) = integrate(
                    &mut system,
                    state,
                    periods * period,
                    &ESDIRK54,
                    tolerances,
                    |_| (),
                )?;
                state = state_of(&mut system, &directions(&end), -1.0);
            }
            course.push((relative, distance(&directions(&state), &start)));
        }
        if let Some((relative, error)) = course.last() {
            let subject = format!("{name}, tolerance {relative:e}");
            trial.check(
                subject,
                "error of e",
                0.0,
                sources::EXACT,
                *error,
                tolerances::REVERSAL,
            );
        }
        courses.push((name.to_owned(), course));
    }
    let title = "Return error of a reversed motion";
    trial.study_tolerance("validation_reversal", title, courses, 0.0);
    Ok(trial)
}
