//! Passes of a filament over the workpiece.

use std::f64::consts::FRAC_PI_2;
use std::num::NonZeroUsize;

use bristle::equations::linear::{add, dot, scale, sub};
use bristle::equations::{ChainDynamics, Dynamics};
use bristle::integrate::SecondOrderSystem;
use bristle::integrate::hermite::Knot;
use bristle::model::metrics::Metrics;
use bristle::model::settings::{ContactSettings, Settings};
use bristle::simulation::{FilamentState, Pass, Sample, integral, simulate, simulate_with_history};
use bristle::tool::ClampMotion;
use bristle_grid::run_study;
use serde::Deserialize;

use super::chains::{
    axial, mechanical_energy, momentum, paper_case, paper_study, trajectory_rows, worse,
};
use super::group::{Extent, Failure, Group};
use super::trial::{Axis, Curve, Figure, Look, Trial};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Contact of a filament",
    purpose: "Whole passes, as users simulate them: balances that must hold, settings that must not matter, and how errors fall.",
    trials: &[
        energy,
        impulse,
        independence,
        segments,
        tolerance,
        stiffness,
    ],
};

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

fn energy(_: Extent) -> Result<Trial, Failure> {
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
    let mut trial = Trial::new(
        "Energy balance of a pass",
        "The work W of the clamp and of the moving workpiece equals the change of the energy stored in the filament and the \
            contact, plus the energy taken by the dampers, contact damping and friction:\n\n```text\nW = ΔE_kin + ΔE_spring + ΔE_grav + ΔE_contact + ∫ 2D dt + ∫ P_contact dt\n```\n\n\
            The solver runs at its default tolerance of 1e-6, and the method that takes the steps also takes the integrals.",
    );
    for (subject, settings) in passes {
        let (imbalance, _) = imbalance(&settings)?;
        trial.check(
            subject,
            "imbalance/W",
            0.0,
            sources::EXACT,
            imbalance,
            tolerances::ENERGY,
        );
    }
    let history = simulate_with_history(&paper_case(25, 10.0, 1e-3)?, 601)?.history;
    let rotating = history
        .first()
        .map_or(0.0, |sample| sample.kinetic_energy_j);
    let course = |name: &str, energy: &dyn Fn(&Sample) -> f64| {
        let points = history
            .iter()
            .map(|sample| (1e3 * sample.time_s, 1e3 * energy(sample)));
        Curve::new(name, Look::Line, points)
    };
    trial.figures.push(Figure {
        name: "validation_balance",
        title: "Energies of a pass at 10 m/s and 1 mm".to_owned(),
        description: "Kinetic energy less that of the rigid rotation, energy of the springs, and energy taken by the dampers, over \
            time: the first two exchange energy after each impact; the third rises to the total loss of the pass.",
        axes: [Axis::linear("time t in ms"), Axis::linear("energy in mJ")],
        curves: vec![
            course("E_kin less that of the rotation", &|sample| sample.kinetic_energy_j - rotating),
            course("E_spring", &|sample| sample.potential_energy_j),
            course("taken by the dampers", &|sample| sample.dissipated_energy_j),
        ],
    });
    Ok(trial)
}

/// What is missing in the energy balance of a pass, over the work, and the end of the pass.
pub fn imbalance(settings: &Settings) -> Result<(f64, FilamentState), Failure> {
    let pass = Pass::new(settings);
    let mut system = pass.system(true);
    let start = pass.start(&mut system);
    let before = mechanical_energy(&mut system, &start);
    let (end, _) = pass.integrate(&mut system, start, |_| ())?;
    let stored = mechanical_energy(&mut system, &end) - before;
    let work = end.integrals[integral::WORK];
    let dissipated =
        end.integrals[integral::JOINT_DISSIPATION] + end.integrals[integral::CONTACT_DISSIPATION];
    Ok(((work - stored - dissipated).abs() / work.abs(), end))
}

/// The balance of the momentum of a filament in a pass.
struct Balance {
    /// `(Δp − ∫ F_root dt)/p_n` along the workpiece's normal, which should be 1, and along the
    /// workpiece, which should be 0; and the imbalance of the angular momentum about the tool's
    /// axis, over `p_n R`.
    result: [f64; 3],
    /// The normal impulse of the contact over time, in N s, and the impulse from the balance.
    impulse: Vec<(f64, f64)>,
    balanced: Vec<(f64, f64)>,
}

/// Blocks of planar coordinates, `[η, θ]`, as those of the spatial equations, `[φ, θ]`, with the
/// same first entry for all.
fn in_space(blocks: &[[f64; 2]], polar: f64) -> Vec<[f64; 2]> {
    blocks.iter().map(|block| [polar, block[1]]).collect()
}

/// Follows the momentum through a planar pass, with the root force of the spatial equations.
fn momentum_balance(settings: &Settings) -> Result<Balance, Failure> {
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
    let (mut impulse, mut balanced) = (Vec::new(), Vec::new());
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
                let approach = filament.approach(position, dynamics.velocities()[node], time);
                torque += axial(position, filament.law.force(&approach).total(&approach));
            }
            turned += weight * torque;
        }
        let (linear, _) =
            *before.get_or_insert_with(|| momentum_at(step.start.time, step.start_nodes));
        after = momentum_at(step.end.time, step.end_nodes);
        let left = sub(sub(after.0, linear), root_impulse);
        impulse.push((step.end.time, step.end.integrals[integral::NORMAL_IMPULSE]));
        balanced.push((step.end.time, dot(left, NORMAL)));
    })?;
    let whole = end.integrals[integral::NORMAL_IMPULSE];
    let before = before.unwrap_or(after);
    let left = sub(sub(after.0, before.0), root_impulse);
    let radius = settings.tool.body_radius_m + settings.filament.length_m;
    let torque = (after.1 - before.1 - turned) / (whole * radius);
    Ok(Balance {
        result: [dot(left, NORMAL) / whole, dot(left, ALONG) / whole, torque],
        impulse,
        balanced,
    })
}

fn impulse(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Impulse against the change of momentum",
        "Without friction, the change of the filament's momentum less the impulse of the clamp is the impulse of the \
            contact:\n\n\
            ```text\nΣ m ċ_k |end − Σ m ċ_k |start − ∫ F_root dt = p_n n⃗\n```\n\n\
            The reaction `F_root` of the clamp comes from the equations of motion, at three points of each step. This checks inertia, \
            contact and integration, but not the springs. They enter the balance of the angular momentum about the tool's axis, in \
            which the clamp's torque follows from the law of its joint:\n\n\
            ```text\nΔL_z = ∫ [(r_0 × F_root)_z − c_1 (θ_1 − β) − d_1 (θ̇_1 − ω) + Σ (r_k × F_k)_z] dt\n```",
    );
    let mut curves = Vec::new();
    for (velocity, depth) in PASSES {
        let balance = momentum_balance(&paper_case(25, velocity, depth)?)?;
        let [normal, along, torque] = balance.result;
        if (velocity, depth) == PASSES[1] {
            let scaled = |points: Vec<(f64, f64)>| {
                points
                    .into_iter()
                    .map(|(time, impulse)| (1e3 * time, 1e3 * impulse))
            };
            curves.push(Curve::new("∫ F_n dt", Look::Line, scaled(balance.impulse)));
            let balanced = scaled(balance.balanced).step_by(6);
            curves.push(Curve::new("Δp − ∫ F_root dt", Look::Markers, balanced));
        }
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
    trial.figures.push(Figure {
        name: "validation_momentum",
        title: "Impulse of a pass at 10 m/s and 1 mm".to_owned(),
        description: "Impulse over time: it rises steeply in each impact and steadily while the tip sweeps; the change of momentum less \
            the clamp's impulse lies on it.",
        axes: [Axis::linear("time t in ms"), Axis::linear("impulse along n⃗ in mN s")],
        curves,
    });
    Ok(trial)
}

/// How many metrics of two passes differ, in any bit.
fn differences(a: &Metrics, b: &Metrics) -> f64 {
    let differ = values(a)
        .into_iter()
        .zip(values(b))
        .filter(|(a, b)| a.to_bits() != b.to_bits())
        .count();
    (differ + usize::from(a.contact_count != b.contact_count)) as f64
}

fn independence(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Samples, lanes and threads",
        "Metrics do not come from samples. A pass has the same bits alone and in lanes with seven others, on any number of \
            threads. With samples the solver also integrates the energies and evaluates the forces again at each stage, which changes \
            the metrics by far less than the tolerance of 1e-6.",
    );
    for (velocity, depth) in PASSES {
        let settings = paper_case(25, velocity, depth)?;
        let at =
            |samples: usize| simulate_with_history(&settings, samples).map(|pass| pass.metrics);
        let (few, many, none) = (at(2)?, at(7919)?, at(0)?);
        let subject = format!("2 and 7919 samples, {}", name(velocity, depth));
        trial.check(
            subject,
            "metrics that differ",
            0.0,
            sources::EXACT,
            differences(&few, &many),
            tolerances::SAME,
        );
        let subject = format!("0 and 7919 samples, {}", name(velocity, depth));
        let changes = values(&none)
            .into_iter()
            .zip(values(&many))
            .map(|(none, many)| (none / many - 1.0).abs());
        let quantity = "largest change of a metric";
        trial.check(
            subject,
            quantity,
            0.0,
            sources::EXACT,
            changes.fold(0.0, worse),
            tolerances::SAMPLES,
        );
    }
    let study = paper_study()?;
    let run = |threads: usize| {
        run_study(&study, NonZeroUsize::new(threads), || ()).map_err(Failure::reference)
    };
    let (one, two, three) = (run(1)?, run(2)?, run(3)?);
    let metrics = |results: &[bristle_grid::CaseResult], case: usize| {
        let summary = results[case]
            .as_ref()
            .map_err(|error| Failure::Reference(error.clone()))?;
        Ok::<_, Failure>(summary.metrics.clone())
    };
    let (mut by_threads, mut by_lanes) = (0.0, 0.0);
    for case in 0..study.case_count() {
        let here = metrics(&one, case)?;
        by_threads +=
            differences(&here, &metrics(&two, case)?) + differences(&here, &metrics(&three, case)?);
        if case % 7 == 0 {
            by_lanes += differences(&here, &simulate(&study.settings(case))?.metrics);
        }
    }
    for (subject, count) in [
        ("1, 2 and 3 threads, 120 passes", by_threads),
        (
            "eight in lanes and one alone, every seventh of 120 passes",
            by_lanes,
        ),
    ] {
        trial.check(
            subject,
            "metrics that differ",
            0.0,
            sources::EXACT,
            count,
            tolerances::SAME,
        );
    }
    Ok(trial)
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

/// Their values.
fn values(metrics: &Metrics) -> [f64; 5] {
    [
        metrics.contact_normal_impulse_n_s,
        metrics.max_tip_deflection_m,
        metrics.peak_contact_normal_force_n,
        metrics.contact_time_s,
        metrics.contact_time_ratio,
    ]
}

fn segments(extent: Extent) -> Result<Trial, Failure> {
    let (passes, finest) = extent.choose((&PASSES[1..2], 100), (&PASSES[..], 200));
    let mut trial = Trial::new(
        "Convergence in n",
        format!(
            "The chain's error falls as n⁻² in all metrics of sweeping and of striking passes, including impacts. The observed order \
            is `log₂` of the ratio of successive changes, at a relative tolerance of 1e-9. The diagram shows errors relative to the \
            value extrapolated from n = {} and {finest}.",
            finest / 2
        ),
    );
    let mut curves = Vec::new();
    for &(velocity, depth) in passes {
        let at = |segments: usize| -> Result<Metrics, Failure> {
            let mut settings = paper_case(segments, velocity, depth)?;
            settings.solver.relative_tolerance = 1e-9;
            Ok(simulate(&settings)?.metrics)
        };
        let metrics = [at(finest / 4)?, at(finest / 2)?, at(finest)?];
        let [coarse, middle, fine] = metrics.each_ref().map(values);
        for (i, quantity) in ORDERS.into_iter().enumerate() {
            let order = ((coarse[i] - middle[i]) / (middle[i] - fine[i]))
                .abs()
                .log2();
            let subject = format!("{}, n = {} to {finest}", name(velocity, depth), finest / 4);
            let tolerance = if SYMBOLS[i] == "max F_n" {
                tolerances::PEAK_ORDER
            } else {
                tolerances::ORDER
            };
            trial.check(subject, quantity, 2.0, sources::CHAIN, order, tolerance);
        }
        let impulse = |metrics: &Metrics| metrics.contact_normal_impulse_n_s;
        let limit = impulse(&metrics[2]) + (impulse(&metrics[2]) - impulse(&metrics[1])) / 3.0;
        let mut points = Vec::new();
        for segments in [5, 10, 15, 25, 50, 100] {
            let error = (impulse(&at(segments)?) / limit - 1.0).abs();
            points.push((segments as f64, error));
        }
        curves.push(Curve::new(name(velocity, depth), Look::Joined, points));
    }
    trial.figures.push(Figure {
        name: "validation_segments",
        title: "Convergence of the impulse p_n in n".to_owned(),
        description: "Relative error of the impulse over the number of segments: from n = 15 on it falls by a factor of four for \
            twice as many.",
        axes: [Axis::logarithmic("number of segments n"), Axis::logarithmic("relative error of p_n")],
        curves,
    });
    Ok(trial)
}

/// A row of `tests/data/reference_contacts*.csv`.
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
    /// Its metrics, in the order of [`values`].
    fn values(&self) -> [f64; 5] {
        [
            self.contact_normal_impulse_n_s,
            self.max_tip_deflection_m,
            self.peak_contact_normal_force_n,
            self.contact_time_s,
            self.contact_time_ratio,
        ]
    }

    /// The relative errors of `others`.
    fn errors(&self, others: [f64; 5]) -> [f64; 5] {
        let expected = self.values();
        std::array::from_fn(|i| (others[i] / expected[i] - 1.0).abs())
    }
}

fn tolerance(_: Extent) -> Result<Trial, Failure> {
    const DATA: &str = include_str!("../../../tests/data/reference_contacts_cvodes.csv");
    const RADAU: &str = include_str!("../../../tests/data/reference_contacts.csv");
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
            let errors = contact.errors(values(&metrics));
            worst = std::array::from_fn(|i| worse(errors[i], worst[i]));
        }
        for (course, error) in courses.iter_mut().zip(worst) {
            course.push((relative, error));
        }
    }
    let mut trial = Trial::new(
        "Convergence in the tolerance",
        "An independent planar code has computed the metrics of six passes with CVODES at a tolerance of 1e-11, accurate to \
            1e-9 (`derivations/passes.py`), and again with Radau. The difference of the two shows their accuracy; slopes \
            use only errors above it. The step control should make errors proportional to the tolerance, which is order 1. Times \
            suffer most: if the tip leaves the workpiece at 1 m/s, an error of 1e-6 of the filament's length in its position is an \
            error of 4e-5 of a contact of 1 ms.",
    );
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
    let mut apart = [0.0; 5];
    let radau: Vec<ReferenceContact> = trajectory_rows(RADAU)?;
    let case =
        |contact: &ReferenceContact| (contact.brushing_velocity_m_s, contact.penetration_depth_m);
    if !contacts.iter().map(case).eq(radau.iter().map(case)) {
        return Err(Failure::Reference(
            "the two references have different passes".to_owned(),
        ));
    }
    for (contact, radau) in contacts.iter().zip(&radau) {
        let distances = contact.errors(radau.values());
        apart = std::array::from_fn(|i| worse(distances[i], apart[i]));
    }
    for (symbol, distance) in SYMBOLS.into_iter().zip(apart) {
        let subject = "CVODES against Radau, largest difference".to_owned();
        trial.check(
            subject,
            symbol,
            0.0,
            sources::RADAU,
            distance,
            tolerances::REFERENCES,
        );
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
    let title = "Largest relative errors of six passes, against CVODES";
    trial.study_tolerance(
        "validation_tolerance",
        title,
        courses,
        tolerances::REFERENCES.value,
    );
    Ok(trial)
}

fn stiffness(_: Extent) -> Result<Trial, Failure> {
    const STIFFNESSES: [f64; 5] = [1e4, 1e5, 1e6, 1e7, 1e8];
    let mut trial = Trial::new(
        "Dependence on the contact stiffness",
        "The contact stiffness k_c approximates a rigid workpiece. A sweeping tip is `F_n/k_c` too deep, so its deflection \
            converges with order 1. Impacts become shorter and harder without limit. The end of a damped beam, \
            `E I (1 + τ ∂/∂t)`, moved at the rate s, responds with `E I τ s κ³`, `κ⁴ = ρ A s/(E I τ)`, and thus with a stiffness that \
            grows as `s^(7/4)`. Equating it to k_c gives durations that fall as `k_c^(−4/7)` and peak forces that grow as \
            `k_c^(3/7)`, as long as the waves are longer than a segment: the peak force is not a property of the filament alone. \
            In the two passes that sweep after an impact at their entry, the impulse converges with an order between ½ and 1. Only \
            the slower one shows the order of the deflection; in the other, its change is less than 1e-5. In passes that strike \
            several times, a stiffer contact shifts the times of the later impacts, and no order appears in four decades.",
    );
    let mut curves = Vec::new();
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
        let points = STIFFNESSES
            .into_iter()
            .zip(&impulses)
            .map(|(stiffness, impulse)| (stiffness, impulse / impulses[1]));
        curves.push(Curve::new(name(velocity, depth), Look::Joined, points));
    }
    trial.figures.push(Figure {
        name: "validation_stiffness",
        title: "Impulse over the contact stiffness".to_owned(),
        description: "Impulse over that at the default stiffness of 1e5 N/m, for stiffnesses from 1e4 to 1e8 N/m: above 1e5 N/m it \
            changes by 0.3 % in the two passes that sweep, and by up to 3.4 % in those that strike more than once; a contact of \
            1e4 N/m is too soft, with up to 15 %.",
        axes: [Axis::logarithmic("contact stiffness k_c in N/m"), Axis::linear("p_n over p_n at 1e5 N/m")],
        curves,
    });
    Ok(trial)
}
