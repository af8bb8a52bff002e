//! Passes of a filament over the workpiece.

use std::f64::consts::FRAC_PI_2;

use bristle::equations::linear::{add, dot, scale, sub};
use bristle::equations::{ChainDynamics, Dynamics};
use bristle::integrate::SecondOrderSystem;
use bristle::integrate::hermite::Knot;
use bristle::model::metrics::Metrics;
use bristle::model::settings::{ContactSettings, Settings};
use bristle::simulation::{Pass, integral, simulate};
use bristle::tool::ClampMotion;
use serde::Deserialize;

use super::chains::{axial, mechanical_energy, momentum, paper_case, trajectory_rows, worse};
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// The unit vectors normal to the default workpiece and along it.
const NORMAL: [f64; 3] = [0.0, 1.0, 0.0];
const ALONG: [f64; 3] = [1.0, 0.0, 0.0];

/// Brushing velocities (m/s) and penetration depths (m) from sweeping to striking.
const PASSES: [(f64, f64); 6] = [
    (5.0, 3e-3),
    (10.0, 1e-3),
    (10.0, 5e-3),
    (20.0, 2e-3),
    (30.0, 1e-3),
    (30.0, 5e-3),
];

fn name(velocity: f64, depth: f64) -> String {
    format!("v_b = {velocity} m/s, a_e = {} mm", 1e3 * depth)
}

/// Energy balance of passes at the default tolerance.
///
/// The work of clamp and workpiece equals the change of the stored energy and what dampers, contact
/// damping and friction take.
pub fn energy(trial: &mut Trial) -> TrialResult {
    let mut dragging = paper_case(25, 10.0, 1e-3)?;
    dragging.contact.friction_coefficient = 0.3;
    dragging.workpiece.feed_velocity_m_s = 0.5;
    let mut hertzian = paper_case(10, 20.0, 2e-3)?;
    let hertz = ContactSettings {
        stiffness_n_m: 1e7,
        exponent: 1.5,
        damping_s_m: 0.5,
        ..hertzian.contact.clone()
    };
    hertzian.contact = hertz;
    hertzian.process.gravity_m_s2 = [100.0, -50.0, 30.0];
    let mut passes = vec![
        ("µ = 0.3, v_ft = 0.5 m/s, 10 m/s, 1 mm".to_owned(), dragging),
        (
            "p = 1.5, χ = 0.5 s/m, gravity, 20 m/s, 2 mm".to_owned(),
            hertzian,
        ),
    ];
    for (velocity, depth) in PASSES {
        passes.push((name(velocity, depth), paper_case(25, velocity, depth)?));
    }
    for (subject, settings) in passes {
        let imbalance = imbalance(&settings)?;
        trial.check(
            subject,
            "imbalance/W",
            0.0,
            sources::EXACT,
            imbalance,
            tolerances::ENERGY,
        );
    }
    Ok(())
}

/// Imbalance of the energies of a pass, over the work.
fn imbalance(settings: &Settings) -> Result<f64, Failure> {
    let pass = Pass::new(settings);
    let mut system = pass.system(true);
    let start = pass.start(&mut system);
    let before = mechanical_energy(&mut system, &start);
    let (end, _) = pass.integrate(&mut system, start, |_| ())?;
    let stored = mechanical_energy(&mut system, &end) - before;
    let work = end.integrals[integral::WORK];
    let dissipated =
        end.integrals[integral::JOINT_DISSIPATION] + end.integrals[integral::CONTACT_DISSIPATION];
    Ok((work - stored - dissipated).abs() / work.abs())
}

/// Converts blocks of planar coordinates, `[η, θ]`, to those of the spatial equations, `[φ, θ]`,
/// with the same first entry for all.
fn in_space(blocks: &[[f64; 2]], polar: f64) -> Vec<[f64; 2]> {
    blocks.iter().map(|block| [polar, block[1]]).collect()
}

/// Balance of the momentum of a filament in a pass: `(Δp − ∫ F_root dt)/p_n` along the workpiece's
/// normal, which should be 1, and along the workpiece, which should be 0; and the imbalance of the
/// angular momentum about the tool's axis, over `p_n R`.
///
/// The root force is that of the spatial equations.
fn momentum_balance(settings: &Settings) -> Result<[f64; 3], Failure> {
    /// Gauss points and weights on a step.
    const POINTS: [(f64, f64); 3] = [
        (0.112_701_665_379_258_31, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.887_298_334_620_741_7, 5.0 / 18.0),
    ];
    let pass = Pass::new(settings);
    let mut system = pass.system(false);
    let start = pass.start(&mut system);
    let mut watching = pass.system(false);
    let chain = watching.filament(0).chain.clone();
    let mut dynamics = Dynamics::new(chain.clone());
    let (mut q, mut v) = (start.q.clone(), start.v.clone());
    let (mut accelerations, mut rest) = (start.accelerations.clone(), start.q.clone());
    let momentum_at = |time: f64, nodes: &[Knot<3>]| {
        let clamp = pass.tool().at(time);
        momentum(
            &chain,
            [clamp.position, clamp.velocity],
            nodes.iter().map(|knot| [knot.value, knot.rate]),
        )
    };
    let (mut before, mut after) = (None, ([0.0; 3], 0.0));
    let (mut root_impulse, mut turned) = ([0.0; 3], 0.0);
    let (end, _) = pass.integrate(&mut system, start, |step| {
        for (node, &closed) in step.closed.iter().enumerate() {
            watching.set_closed(0, node, closed);
        }
        for (s, weight) in POINTS {
            let time = step.time(s);
            step.coordinates(s, &mut q, &mut v);
            watching.accelerations(time, &q, &v, &mut accelerations);
            let clamp = pass.tool().at(time);
            let [q, v, accelerations] = [(&q, FRAC_PI_2), (&v, 0.0), (&accelerations, 0.0)]
                .map(|(blocks, polar)| in_space(blocks, polar));
            dynamics.residual(
                clamp.holding(&q, &v),
                &accelerations,
                &watching.loads(time),
                &mut rest,
            );
            let weight = weight * step.length();
            root_impulse = add(root_impulse, scale(weight, dynamics.root_force()));
            // The clamp's torque from the law of its joint, not from the equations of motion.
            let tool = pass.tool();
            let (bend, bend_rate) = (q[0][1] - tool.angle(time), v[0][1] - tool.rate);
            let mut torque = axial(clamp.position, dynamics.root_force());
            torque -= chain.links[0].stiffness * bend + chain.links[0].damping * bend_rate;
            let filament = watching.filament(0);
            for node in (0..step.closed.len()).filter(|&node| step.closed[node]) {
                let position = dynamics.positions()[node];
                let approach = filament.approach(node, position, dynamics.velocities()[node], time);
                torque += axial(position, filament.law.force(&approach).total(&approach));
            }
            turned += weight * torque;
        }
        before.get_or_insert_with(|| momentum_at(step.start.time, step.start_nodes));
        after = momentum_at(step.end.time, step.end_nodes);
    })?;
    let whole = end.integrals[integral::NORMAL_IMPULSE];
    let before = before.unwrap_or(after);
    let left = sub(sub(after.0, before.0), root_impulse);
    let radius = settings.tool.body_radius_m + settings.filament.length_m;
    let torque = (after.1 - before.1 - turned) / (whole * radius);
    Ok([dot(left, NORMAL) / whole, dot(left, ALONG) / whole, torque])
}

/// Impulse of the contact against the change of momentum, `Δp − ∫ F_root dt = p_n n⃗`.
///
/// This checks inertia, contact and integration. The springs enter the angular momentum about the
/// axis, in which the torque of the clamp follows from the law of its joint.
pub fn impulse(trial: &mut Trial) -> TrialResult {
    for (velocity, depth) in PASSES {
        let [normal, along, torque] = momentum_balance(&paper_case(25, velocity, depth)?)?;
        for (quantity, exact, computed) in [
            ("along n⃗, over p_n", 1.0, normal),
            ("across n⃗, over p_n", 0.0, along),
            ("about the axis, over p_n R", 0.0, torque),
        ] {
            trial.check(
                name(velocity, depth),
                quantity,
                exact,
                sources::EXACT,
                computed,
                tolerances::MOMENTUM,
            );
        }
    }
    Ok(())
}

/// The metrics whose errors are checked.
const SYMBOLS: [&str; 5] = ["p_n", "s_n,max", "max F_n", "t_c", "ε_tc"];
const ORDERS: [&str; 5] = [
    "order of p_n",
    "order of s_n,max",
    "order of max F_n",
    "order of t_c",
    "order of ε_tc",
];

/// Values of these metrics.
fn values(metrics: &Metrics) -> [f64; 5] {
    [
        metrics.contact_normal_impulse_n_s,
        metrics.max_tip_deflection_m,
        metrics.peak_contact_normal_force_n,
        metrics.contact_time_s,
        metrics.contact_time_ratio,
    ]
}

/// Order of convergence in n of all metrics, from n = 50, 100 and 200.
pub fn segments(trial: &mut Trial) -> TrialResult {
    const FINEST: usize = 200;
    for (velocity, depth) in PASSES {
        let at = |segments: usize| -> Result<Metrics, Failure> {
            let mut settings = paper_case(segments, velocity, depth)?;
            settings.solver.relative_tolerance = 1e-9;
            Ok(simulate(&settings)?.metrics)
        };
        let metrics = [at(FINEST / 4)?, at(FINEST / 2)?, at(FINEST)?];
        let [coarse, middle, fine] = metrics.each_ref().map(values);
        for (i, quantity) in ORDERS.into_iter().enumerate() {
            let order = ((coarse[i] - middle[i]) / (middle[i] - fine[i]))
                .abs()
                .log2();
            let subject = format!("{}, n = {} to {FINEST}", name(velocity, depth), FINEST / 4);
            let tolerance = if SYMBOLS[i] == "max F_n" {
                tolerances::PEAK_ORDER
            } else {
                tolerances::ORDER
            };
            trial.check(subject, quantity, 2.0, sources::CHAIN, order, tolerance);
        }
    }
    Ok(())
}

/// A row of `tests/data/reference_contacts_cvodes.csv`.
#[derive(Deserialize)]
struct ReferenceContact {
    brushing_velocity_m_s: f64,
    penetration_depth_m: f64,
    contact_time_s: f64,
    contact_time_ratio: f64,
    contact_count: usize,
    contact_normal_impulse_n_s: f64,
    peak_contact_normal_force_n: f64,
    max_tip_deflection_m: f64,
}

impl ReferenceContact {
    /// The relative errors of `metrics`, in the order of [`values`].
    fn errors(&self, metrics: &Metrics) -> [f64; 5] {
        let expected = [
            self.contact_normal_impulse_n_s,
            self.max_tip_deflection_m,
            self.peak_contact_normal_force_n,
            self.contact_time_s,
            self.contact_time_ratio,
        ];
        let computed = values(metrics);
        std::array::from_fn(|i| (computed[i] / expected[i] - 1.0).abs())
    }
}

/// Errors of six passes over the tolerance of the solver, against CVODES.
///
/// Slopes use only errors above the accuracy of the references. Times suffer most: at 1 m/s, an
/// error of 1e-6 `l_f` of the tip is 4e-5 of a contact of 1 ms.
pub fn tolerance(trial: &mut Trial) -> TrialResult {
    const DATA: &str = include_str!("../../../tests/data/reference_contacts_cvodes.csv");
    const EXPONENTS: std::ops::RangeInclusive<i32> = 3..=8;
    let contacts: Vec<ReferenceContact> = trajectory_rows(DATA)?;
    let mut courses = vec![Vec::new(); SYMBOLS.len()];
    let mut wrong_counts = 0.0;
    for exponent in EXPONENTS {
        let relative = 10_f64.powi(-exponent);
        let mut worst = [0.0; 5];
        for contact in &contacts {
            let mut settings = paper_case(
                25,
                contact.brushing_velocity_m_s,
                contact.penetration_depth_m,
            )?;
            settings.solver.relative_tolerance = relative;
            let metrics = simulate(&settings)?.metrics;
            wrong_counts += f64::from(u8::from(metrics.contact_count != contact.contact_count));
            let errors = contact.errors(&metrics);
            worst = std::array::from_fn(|i| worse(errors[i], worst[i]));
        }
        for (course, error) in courses.iter_mut().zip(worst) {
            course.push((relative, error));
        }
    }
    for (symbol, course) in SYMBOLS.into_iter().zip(&courses) {
        for &(relative, error) in course {
            let subject = format!(
                "tolerance {relative:e}, worst of {} passes, error / tolerance",
                contacts.len()
            );
            trial.check(
                subject,
                symbol,
                0.0,
                sources::CVODES,
                error / relative,
                tolerances::PROPORTIONAL,
            );
        }
    }
    let subject = format!("all tolerances, {} passes", contacts.len());
    trial.check(
        subject,
        "wrong numbers of contacts",
        0.0,
        sources::CVODES,
        wrong_counts,
        tolerances::SAME,
    );
    let courses = SYMBOLS
        .into_iter()
        .map(str::to_owned)
        .zip(courses)
        .collect();
    trial.check_slopes(courses, tolerances::REFERENCES.value);
    Ok(())
}

/// Dependence on the contact stiffness `k_c`, which approximates a rigid workpiece.
///
/// A steady tip is `F_n/k_c` too deep: order 1. The end of a damped beam `E I (1 + τ ∂/∂t)` that
/// moves at the rate s has a stiffness that grows as `s^(7/4)`, so that peaks grow as `k_c^(3/7)`.
/// The impulse of passes that sweep after an impact converges with an order between ½ and 1.
pub fn stiffness(trial: &mut Trial) -> TrialResult {
    const STIFFNESSES: [f64; 5] = [1e4, 1e5, 1e6, 1e7, 1e8];
    // The first two sweep, except for an impact at their entry.
    const STIFFNESS_PASSES: [(f64, f64); 5] = [
        (5.0, 3e-3),
        (10.0, 5e-3),
        (10.0, 1e-3),
        (20.0, 2e-3),
        (30.0, 5e-3),
    ];
    for (velocity, depth) in STIFFNESS_PASSES {
        let mut metrics = Vec::new();
        for stiffness in STIFFNESSES {
            let mut settings = paper_case(25, velocity, depth)?;
            settings.contact.stiffness_n_m = stiffness;
            settings.solver.relative_tolerance = 1e-7;
            metrics.push(simulate(&settings)?.metrics);
        }
        let values = |value: fn(&Metrics) -> f64| metrics.iter().map(value).collect::<Vec<f64>>();
        let (impulses, deflections) = (
            values(|metrics| metrics.contact_normal_impulse_n_s),
            values(|metrics| metrics.max_tip_deflection_m),
        );
        let peaks = values(|metrics| metrics.peak_contact_normal_force_n);
        let decades = |coarse: f64, fine: f64| (coarse / fine).abs().log10();
        let subject = format!("{}, k_c = 1e7, 1e8 N/m", name(velocity, depth));
        let growth = decades(peaks[4], peaks[3]);
        trial.check(
            subject,
            "order of max F_n",
            3.0 / 7.0,
            sources::DAMPED_BEAM,
            growth,
            tolerances::PEAK_GROWTH,
        );
        let subject = format!("{}, k_c = 1e6 to 1e8 N/m", name(velocity, depth));
        if (velocity, depth) == STIFFNESS_PASSES[0] {
            let order = decades(
                deflections[3] - deflections[2],
                deflections[4] - deflections[3],
            );
            trial.check(
                &subject,
                "order of s_n,max",
                1.0,
                sources::PENALTY,
                order,
                tolerances::ORDER,
            );
        }
        if STIFFNESS_PASSES[..2].contains(&(velocity, depth)) {
            let order = decades(impulses[3] - impulses[2], impulses[4] - impulses[3]);
            trial.check_within(
                subject,
                "order of p_n",
                sources::PENALTY,
                order,
                tolerances::RIGID_LIMIT,
            );
        }
    }
    Ok(())
}
