//! Rows of filaments that pass a workpiece.

use bristle::brush::{BrushResult, BrushRun, Frame, RunOptions, simulate_brush};
use bristle::model::metrics::Metrics;
use bristle::model::settings::{BrushSettings, Ends, Pattern, ProcessSettings, Settings};
use bristle::simulation::simulate;
use serde::Deserialize;

use crate::chains::{cases_of, paper_case, trajectory_rows, worse};
use crate::group::{Extent, Failure};
use crate::trial::{Axis, Curve, Figure, Look, Trial, logarithmic_slope};
use crate::{sources, tolerances};

/// Filaments around of the dense rows.
pub const AROUND: f64 = 682.0;

/// A row of the paper's filaments, with so many of them around and columns.
pub fn row(segments: usize, around: f64, columns: usize) -> Result<Settings, Failure> {
    let mut settings = paper_case(segments, 10.0, 1e-3)?;
    settings.tool.filament_count = around;
    settings.brush = Some(BrushSettings {
        columns: Some(columns),
        rows: Some(1),
        steady: false,
        ..BrushSettings::default()
    });
    Ok(settings)
}

/// The brush with other settings.
pub fn with(settings: &Settings, change: impl FnOnce(&mut BrushSettings)) -> Settings {
    let mut brush = settings.brush_or_default();
    change(&mut brush);
    Settings {
        brush: Some(brush),
        ..settings.clone()
    }
}

/// Contact normal impulses of all filaments in N s.
fn impulses(result: &BrushResult) -> Vec<f64> {
    result
        .filaments
        .iter()
        .map(|filament| filament.metrics.contact_normal_impulse_n_s)
        .collect()
}

/// Largest difference of two series of numbers, over those of the second.
fn largest_change(found: &[f64], expected: &[f64]) -> f64 {
    if found.len() != expected.len() {
        return f64::NAN;
    }
    found
        .iter()
        .zip(expected)
        .fold(0.0, |largest, (a, b)| worse((a / b - 1.0).abs(), largest))
}

/// Runs to the end.
fn run(settings: &Settings, options: RunOptions) -> Result<BrushResult, Failure> {
    let mut run = BrushRun::new(settings, options)?;
    while run.advance()? {}
    Ok(run.finish()?)
}

/// A row by another code.
#[derive(Deserialize)]
struct Reference {
    name: String,
    input: Settings,
    friction_at: Option<String>,
    filaments: Vec<OfFilament>,
    /// Angle of column 0 at time zero, and the pairs of neighbours, where they are stated.
    #[serde(default)]
    start_angle_rad: f64,
    #[serde(default)]
    neighbours: Vec<OfPair>,
}

#[derive(Deserialize)]
struct OfFilament {
    contact_normal_impulse_n_s: f64,
    max_tip_deflection_m: f64,
    friction_work_j: f64,
}

#[derive(Deserialize)]
struct OfPair {
    columns: [usize; 2],
    normal_impulse_n_s: f64,
}

/// An instant of the row of three.
#[derive(Deserialize)]
struct Instant {
    time_s: f64,
    contact_normal_force_n_0: f64,
    contact_normal_force_n_1: f64,
    contact_normal_force_n_2: f64,
    neighbour_normal_force_n_0_1: f64,
    neighbour_normal_force_n_1_2: f64,
}

pub fn cvodes(extent: Extent) -> Result<Trial, Failure> {
    const ROWS: &str = include_str!("../../../../tests/data/reference_row.json");
    let tolerance_of_brush = extent.choose(1e-4, 1e-5);
    let mut trial = Trial::new(
        "Rows of filaments by CasADi and CVODES",
        format!(
            "Rows of one to three filaments of five segments, with three contact points each, 682 around unless they are wide apart, stated again \
            for the plane: CasADi differentiates the energy of their contact, and CVODES integrates at 1e-11, starting again wherever \
            something begins or ceases to touch. Bristle runs at a tolerance of {tolerance_of_brush:e}. The other code knows `p_n` to 1e-9, except with \
            Hertz's stiffness, with which filaments bounce more often."
        ),
    );
    let mut cases = cases_of::<Reference>(ROWS)?;
    // In some, friction acts elsewhere than in Bristle, to show what that matters.
    cases.retain(|case| case.friction_at.as_deref() != Some("centrelines"));
    if extent == Extent::Quick {
        // Each at its first velocity and depth.
        cases.dedup_by(|next, case| next.name == case.name);
        let quick = [
            "two",
            "three",
            "three, Hertz's stiffness",
            "three, close, friction and damped",
        ];
        cases.retain(|case| quick.contains(&case.name.as_str()));
    }
    for case in &cases {
        let result = simulate_brush(
            &with(&case.input, |brush| brush.tolerance = tolerance_of_brush),
            1,
        )?;
        let ProcessSettings {
            brushing_velocity_m_s,
            penetration_depth_m,
            ..
        } = case.input.process;
        let subject = format!(
            "{}, {brushing_velocity_m_s} m/s, {} mm",
            case.name,
            1e3 * penetration_depth_m
        );
        let [tolerance, of_pairs] = if case.name.contains("Hertz") {
            [tolerances::ROW_OF_HERTZ, tolerances::ROW_PAIR_OF_HERTZ]
        } else {
            [tolerances::ROW, tolerances::ROW_PAIR]
        };
        for (filament, expected) in result.filaments.iter().zip(&case.filaments) {
            let subject = format!("{subject}, column {}", filament.column);
            let Metrics {
                contact_normal_impulse_n_s,
                max_tip_deflection_m,
                friction_work_j,
                ..
            } = filament.metrics;
            let mut check = |quantity, expected, computed| {
                trial.check(
                    &subject,
                    quantity,
                    expected,
                    sources::CVODES_ROWS,
                    computed,
                    tolerance,
                );
            };
            check(
                "p_n in N s",
                expected.contact_normal_impulse_n_s,
                contact_normal_impulse_n_s,
            );
            check(
                "s_n,max in m",
                expected.max_tip_deflection_m,
                max_tip_deflection_m,
            );
            if expected.friction_work_j > 0.0 {
                check(
                    "friction work in J",
                    expected.friction_work_j,
                    friction_work_j,
                );
            }
        }
        let total = case
            .neighbours
            .iter()
            .map(|pair| pair.normal_impulse_n_s)
            .sum::<f64>();
        // Filaments that do not touch must not press at all.
        let total = if total > 0.0 {
            total
        } else {
            f64::MIN_POSITIVE
        };
        for pair in &case.neighbours {
            let [a, b] = pair.columns;
            let found = result
                .pairs
                .iter()
                .find(|found| [found.filament[0], found.other[0]] == pair.columns);
            let error =
                (found.map_or(0.0, |found| found.impulse_n_s) - pair.normal_impulse_n_s) / total;
            let subject = format!("{subject}, columns {a} and {b}");
            trial.check(
                subject,
                "error of ∫ F dt, over all",
                0.0,
                sources::CVODES_ROWS,
                error,
                of_pairs,
            );
        }
    }
    check_course(&mut trial, &cases, tolerance_of_brush)?;
    Ok(trial)
}

/// One or two filaments in space by another code.
#[derive(Deserialize)]
struct InSpace {
    name: String,
    input: Settings,
    filaments: Vec<SpatialContact>,
    neighbours: Vec<SpatialPair>,
}

#[derive(Deserialize)]
struct SpatialContact {
    contact_normal_impulse_n_s: f64,
    contact_impulse_x_n_s: f64,
    contact_impulse_z_n_s: f64,
    friction_work_j: f64,
}

#[derive(Deserialize)]
struct SpatialPair {
    normal_impulse_n_s: f64,
    impulse_x_n_s: f64,
    impulse_y_n_s: f64,
    impulse_z_n_s: f64,
    friction_work_j: f64,
}

pub fn space(extent: Extent) -> Result<Trial, Failure> {
    const SPACE: &str = include_str!("../../../../tests/data/reference_space.json");
    let tolerance_of_brush = extent.choose(1e-4, 1e-5);
    let cases: Vec<InSpace> = cases_of(SPACE)?;
    let mut trial = Trial::new(
        "Two filaments in space by CasADi and CVODES",
        format!(
            "One and two filaments of five segments, tilted or in rows so near to each other that they push each other aside, with friction \
            on the workpiece (µ = 0.25) and between them (µ = 0.2), stated again in space, with dampers that see rates relative to the \
            turning body. CVODES integrates at 1e-11, and starts again wherever something begins or ceases to touch. Bristle runs at a \
            tolerance of {tolerance_of_brush:e}."
        ),
    );
    for case in cases {
        let ProcessSettings {
            brushing_velocity_m_s,
            penetration_depth_m,
            ..
        } = case.input.process;
        if extent != Extent::Full && brushing_velocity_m_s != 10.0 {
            continue;
        }
        let result = simulate_brush(
            &with(&case.input, |brush| brush.tolerance = tolerance_of_brush),
            1,
        )?;
        let subject = format!(
            "{}, {brushing_velocity_m_s} m/s, {} mm",
            case.name,
            1e3 * penetration_depth_m
        );
        let mut check = |subject: String, quantity, error, tolerance| {
            trial.check(
                subject,
                quantity,
                0.0,
                sources::CVODES_SPACE,
                error,
                tolerance,
            );
        };
        for (i, (filament, expected)) in result.filaments.iter().zip(&case.filaments).enumerate() {
            let Metrics {
                contact_normal_impulse_n_s,
                contact_impulse_x_n_s,
                contact_impulse_z_n_s,
                friction_work_j,
                ..
            } = filament.metrics;
            let normal = expected.contact_normal_impulse_n_s;
            for (quantity, error) in [
                ("error of p_n", contact_normal_impulse_n_s / normal - 1.0),
                (
                    "error of ∫ F_x dt, over p_n",
                    (contact_impulse_x_n_s - expected.contact_impulse_x_n_s) / normal,
                ),
                (
                    "error of ∫ F_z dt, over p_n",
                    (contact_impulse_z_n_s - expected.contact_impulse_z_n_s) / normal,
                ),
                (
                    "error of friction work",
                    friction_work_j / expected.friction_work_j - 1.0,
                ),
            ] {
                check(
                    format!("{subject}, filament {i}"),
                    quantity,
                    error,
                    tolerances::SPACE,
                );
            }
        }
        for (i, expected) in case.neighbours.iter().enumerate() {
            let normal = expected.normal_impulse_n_s;
            let expected_impulse = [
                expected.impulse_x_n_s,
                expected.impulse_y_n_s,
                expected.impulse_z_n_s,
            ];
            // Those that press on each other in one code only have no error that is a number.
            let errors = result.pairs.get(i).map_or([f64::NAN; 3], |pair| {
                let apart = pair.vector_impulse_n_s.iter().zip(expected_impulse);
                let apart = apart
                    .map(|(found, expected)| (found - expected).powi(2))
                    .sum::<f64>()
                    .sqrt();
                [
                    pair.impulse_n_s / normal - 1.0,
                    apart / normal,
                    pair.dissipated_j / expected.friction_work_j - 1.0,
                ]
            });
            let quantities = [
                "error of ∫ F dt",
                "distance of ∫ F⃗ dt, over ∫ F dt",
                "error of friction work",
            ];
            for (quantity, error) in quantities.into_iter().zip(errors) {
                check(
                    format!("{subject}, between them"),
                    quantity,
                    error,
                    tolerances::SPACE_PAIR,
                );
            }
        }
    }
    Ok(trial)
}

pub fn mujoco(extent: Extent) -> Result<Trial, Failure> {
    const ROWS: &str = include_str!("../../../../tests/data/reference_row_mujoco.json");
    let tolerance_of_brush = extent.choose(1e-4, 3e-6);
    let mut trial = Trial::new(
        "A row of filaments by MuJoCo",
        "Six filaments of five segments, with seven contact points each, 682 around, in MuJoCo: once with the points of docs/MODEL.md, \
            and once with MuJoCo's own capsules, two of which touch at one point. That moves force from filament to filament, and hardly \
            changes the mean. MuJoCo takes steps of 50 ns and knows `p_n` to 2e-4, with Hertz's stiffness, with which filaments bounce off \
            each other most, to 5e-3.",
    );
    let mut curves = Vec::new();
    for case in cases_of::<Reference>(ROWS)? {
        let of_hertz = case.name.contains("Hertz");
        let has_capsules = case.name == "capsules";
        let [of_each, of_mean] = if has_capsules {
            [tolerances::CAPSULES, tolerances::CAPSULES_MEAN]
        } else if of_hertz {
            [tolerances::BOUNCES, tolerances::ROW]
        } else {
            [tolerances::ROW; 2]
        };
        let computed = impulses(&simulate_brush(
            &with(&case.input, |brush| brush.tolerance = tolerance_of_brush),
            1,
        )?);
        let expected: Vec<f64> = case
            .filaments
            .iter()
            .map(|filament| filament.contact_normal_impulse_n_s)
            .collect();
        let mut check = |subject: String, expected: f64, computed: f64, tolerance| {
            trial.check(
                subject,
                "p_n in N s",
                expected,
                sources::MUJOCO_ROW,
                computed,
                tolerance,
            );
        };
        for (column, (computed, expected)) in computed.iter().zip(&expected).enumerate() {
            check(
                format!("{}, column {column}", case.name),
                *expected,
                *computed,
                of_each,
            );
        }
        let mean = |impulses: &[f64]| impulses.iter().sum::<f64>() / impulses.len() as f64;
        check(
            format!("{}, mean", case.name),
            mean(&expected),
            mean(&computed),
            of_mean,
        );
        if !of_hertz {
            let points = |impulses: &[f64]| {
                (0..)
                    .map(f64::from)
                    .zip(impulses.iter().map(|p| 1e3 * p))
                    .collect::<Vec<_>>()
            };
            if !has_capsules {
                curves.push(Curve::new("Bristle", Look::Line, points(&computed)));
            }
            curves.push(Curve::new(
                format!("MuJoCo, {}", case.name),
                Look::Markers,
                points(&expected),
            ));
        }
    }
    trial.figures.push(Figure {
        name: "validation_row_mujoco",
        title: "Impulses of a row of six filaments".to_owned(),
        description: "Contact normal impulse over the column: it falls from 3.4 to 0.9 mN s along the first four filaments; \
            MuJoCo's points coincide with Bristle, and its capsules deviate by some percent.",
        axes: [Axis::linear("column"), Axis::linear("p_n in mN s")],
        curves,
    });
    Ok(trial)
}

/// The forces of the row of three over time.
fn check_course(trial: &mut Trial, cases: &[Reference], tolerance: f64) -> Result<(), Failure> {
    const INSTANTS: &str =
        include_str!("../../../../derivations/trajectories/row_three_cvodes.csv");
    const FRAMES: usize = 10_000;
    let missing = || Failure::Reference("no row of three at 10 m/s".to_owned());
    let case = cases
        .iter()
        .find(|case| case.name == "three")
        .ok_or_else(missing)?;
    let result = run(
        &with(&case.input, |brush| brush.tolerance = tolerance),
        RunOptions {
            frames: FRAMES,
            ..RunOptions::default()
        },
    )?;
    let instants: Vec<Instant> = trajectory_rows(INSTANTS)?;
    let tool = &case.input.tool;
    let rate = case.input.process.brushing_velocity_m_s
        / (tool.body_radius_m + case.input.filament.length_m);
    let time = |angle: f64| (angle - case.start_angle_rad) / rate;
    let computed = |force: &dyn Fn(&Frame) -> f32| -> Vec<(f64, f64)> {
        result
            .frames
            .iter()
            .map(|frame| (time(frame.tool_angle_rad), f64::from(force(frame))))
            .collect()
    };
    let expected = |force: fn(&Instant) -> f64| -> Vec<(f64, f64)> {
        instants
            .iter()
            .map(|instant| (instant.time_s, force(instant)))
            .collect()
    };
    let mut curves = Vec::new();
    let of_instants: [fn(&Instant) -> f64; 3] = [
        |instant| instant.contact_normal_force_n_0,
        |instant| instant.contact_normal_force_n_1,
        |instant| instant.contact_normal_force_n_2,
    ];
    for (column, of_instant) in of_instants.into_iter().enumerate() {
        let (computed, expected) = (
            computed(&|frame| frame.contact_normal_force_n[column]),
            expected(of_instant),
        );
        let subject = format!("three, 10 m/s, 1 mm, column {column}");
        let error = distance(&computed, &expected);
        trial.check(
            subject,
            "F_n, rms over rms",
            0.0,
            sources::CVODES_ROWS,
            error,
            tolerances::ROW_COURSE,
        );
        let shown = |points: &[(f64, f64)], stride: usize| {
            points
                .iter()
                .step_by(stride)
                .map(|(time, force)| (1e3 * time, *force))
                .collect::<Vec<_>>()
        };
        curves.push(Curve::new(
            format!("Bristle, column {column}"),
            Look::Line,
            shown(&computed, 1),
        ));
        curves.push(Curve::new(
            format!("CVODES, column {column}"),
            Look::Markers,
            shown(&expected, 8),
        ));
    }
    let expected = expected(|instant| {
        instant.neighbour_normal_force_n_0_1 + instant.neighbour_normal_force_n_1_2
    });
    let error = distance(&computed(&|frame| frame.press_force_n[1]), &expected);
    let subject = "three, 10 m/s, 1 mm, both neighbours on column 1";
    trial.check(
        subject,
        "F, rms over rms",
        0.0,
        sources::CVODES_ROWS,
        error,
        tolerances::ROW_PRESSES,
    );
    trial.figures.push(Figure {
        name: "validation_row",
        title: "Contact normal forces of a row of three filaments".to_owned(),
        description: "Forces of three filaments on the workpiece over time: each strikes, bounces and sweeps after the one before it; \
            the curves of both codes coincide.",
        axes: [Axis::linear("time t in ms"), Axis::linear("F_n in N")],
        curves,
    });
    Ok(())
}

/// Root mean square of the difference of two courses at the instants of the second, over that of
/// the second.
fn distance(computed: &[(f64, f64)], expected: &[(f64, f64)]) -> f64 {
    let (mut sum, mut difference, mut covered) = (0.0, 0.0, 0);
    for (time, force) in expected {
        let after = computed.partition_point(|(other, _)| other < time);
        let (Some(before), Some(next)) = (
            after.checked_sub(1).map(|index| computed[index]),
            computed.get(after),
        ) else {
            continue;
        };
        let value = before.1 + (next.1 - before.1) * (time - before.0) / (next.0 - before.0);
        sum += force * force;
        difference += (value - force).powi(2);
        covered += 1;
    }
    if 10 * covered < 9 * expected.len() {
        f64::NAN
    } else {
        f64::sqrt(difference / sum)
    }
}

/// A row with friction everywhere and damping between filaments.
fn rubbing(columns: usize) -> Result<Settings, Failure> {
    let mut settings = with(&row(5, AROUND, columns)?, |brush| {
        (brush.damping_s_m, brush.friction_coefficient) = (0.5, 0.3);
    });
    settings.contact.friction_coefficient = 0.3;
    Ok(settings)
}

pub fn balance(extent: Extent) -> Result<Trial, Failure> {
    let mut faster = rubbing(6)?;
    faster.process.brushing_velocity_m_s = 20.0;
    faster.process.penetration_depth_m = 2e-3;
    let mut cases = vec![
        ("friction and damping", rubbing(6)?),
        ("friction and damping, 20 m/s, 2 mm", faster),
    ];
    let tolerances: &[f64] = match extent {
        Extent::Quick => &[1e-3, 1e-4, 1e-5],
        Extent::Full => {
            cases.push(("neither", row(5, AROUND, 6)?));
            &[1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6]
        }
    };
    let mut trial = Trial::new(
        "Energy balance of a row",
        "Six filaments of five segments pass: the work W of the clamps equals the change of the energy stored in filaments and \
            contacts, plus the energy taken by the dampers of the joints, by the damping between filaments (χ = 0.5 s/m), and by \
            friction on the workpiece and between filaments (µ = 0.3). The work done is integrated by the weights of the \
            method's stages. Steps are fixed and impacts begin within them, so that errors fall unevenly with the tolerance.",
    );
    let mut curves = Vec::new();
    for (name, settings) in cases {
        let mut course = Vec::new();
        for &tolerance in tolerances {
            let settings = with(&settings, |brush| brush.tolerance = tolerance);
            let options = RunOptions::default();
            let balance = run(&settings, options)?.energies;
            let missing = balance.gain_j - balance.work_j + balance.dissipated_j;
            course.push((tolerance, (missing / balance.work_j).abs()));
        }
        if let Some((tolerance, imbalance)) = course.last() {
            let subject = format!("{name}, tolerance {tolerance:e}");
            trial.check(
                subject,
                "imbalance/W",
                0.0,
                sources::EXACT,
                *imbalance,
                tolerances::ROW_ENERGY,
            );
        }
        let subject = format!("slope over the tolerance, {name}");
        trial.check_within(
            subject,
            "order",
            sources::CONTROL,
            logarithmic_slope(&course),
            tolerances::ROW_SLOPE,
        );
        curves.push(Curve::new(name, Look::Joined, course));
    }
    trial.figures.push(Figure {
        name: "validation_row_energy",
        title: "Balance of the energies of a row of six filaments".to_owned(),
        description: "What is missing over the work, over the tolerance of the brush, both logarithmic: it falls with the tolerance.",
        axes: [Axis::logarithmic("tolerance of the brush"), Axis::logarithmic("imbalance over W")],
        curves,
    });
    Ok(trial)
}

pub fn momentum(extent: Extent) -> Result<Trial, Failure> {
    let tolerance = extent.choose(1e-4, 1e-5);
    let mut trial = Trial::new(
        "Angular momentum of a row",
        "The same six filaments, so strongly damped (ζ = 0.5) that they turn rigidly with the body again at the end. Their \
            angular momentum about the tool axis is then what it was at the start, so that the workpiece and the clamps together have \
            exerted no moment. The clamps turn at the constant rate ω, and their moment is their power over ω:\n\n\
            ```text\n∫ M_workpiece dt + W/ω = 0\n```\n\n\
            This holds only if forces between filaments balance in pairs, and so do their moments, friction included.",
    );
    for (name, settings) in [
        ("friction and damping", rubbing(6)?),
        ("neither", row(5, AROUND, 6)?),
    ] {
        let mut settings = with(&settings, |brush| brush.tolerance = tolerance);
        // At the end all filaments turn with the body again.
        settings.filament.damping_ratio = 0.5;
        settings.process.tail_angle_rad = 1.5;
        let options = RunOptions::default();
        let result = run(&settings, options)?;
        let work = result.energies.work_j;
        let of_workpiece: f64 = result
            .filaments
            .iter()
            .map(|filament| filament.metrics.contact_angular_impulse_n_m_s)
            .sum();
        let rate = settings.process.brushing_velocity_m_s / settings.tool_radius_m();
        let imbalance = 1.0 + work / (rate * of_workpiece);
        let subject = format!("{name}, tolerance {tolerance:e}");
        trial.check(
            subject,
            "imbalance of ∫ M dt",
            0.0,
            sources::EXACT,
            imbalance,
            tolerances::ROW_MOMENTUM,
        );
    }
    Ok(trial)
}

/// A metric, by the name that the page has for it.
type Quantity = (&'static str, fn(&Metrics) -> f64);

pub fn alone(extent: Extent) -> Result<Trial, Failure> {
    /// So few filaments around that they never touch.
    const WIDE: f64 = 120.0;
    let cases: &[(f64, f64, f64)] = extent.choose(
        &[(10.0, 1e-3, 3e-6)],
        &[(10.0, 1e-3, 1e-6), (30.0, 2e-3, 1e-6)],
    );
    let mut trial = Trial::new(
        "Filaments that do not touch",
        "A brush of one filament, and one whose filaments are too far apart to touch, have the metrics of a single pass by \
            `simulate`, which has its own equations, method and step control. Friction on the workpiece is µ = 0.2, n = 10. The \
            pass runs at its default tolerance of 1e-6.",
    );
    for &(velocity, depth, tolerance) in cases {
        let with_process = |columns: usize| -> Result<Settings, Failure> {
            let mut settings = with(&row(10, WIDE, columns)?, |brush| {
                brush.tolerance = tolerance
            });
            settings.process.brushing_velocity_m_s = velocity;
            settings.process.penetration_depth_m = depth;
            settings.contact.friction_coefficient = 0.2;
            Ok(settings)
        };
        let settings = with_process(1)?;
        let expected = simulate(&settings)?.metrics;
        let name = format!(
            "{velocity} m/s, {} mm, tolerance {tolerance:e}",
            1e3 * depth
        );
        let subject = format!("{name}, one filament");
        let quantities: [Quantity; 5] = [
            ("p_n in N s", |metrics| metrics.contact_normal_impulse_n_s),
            ("s_n,max in m", |metrics| metrics.max_tip_deflection_m),
            ("max F_n in N", |metrics| {
                metrics.peak_contact_normal_force_n
            }),
            ("t_c in s", |metrics| metrics.contact_time_s),
            ("friction work in J", |metrics| metrics.friction_work_j),
        ];
        let single = simulate_brush(&settings, 1)?;
        for (quantity, of) in quantities {
            let tolerance = if quantity == "p_n in N s" {
                tolerances::ROW_ALONE
            } else {
                tolerances::ROW_DETAIL
            };
            trial.check(
                &subject,
                quantity,
                of(&expected),
                sources::PASS,
                of(&single.tool),
                tolerance,
            );
        }
        let several = simulate_brush(&with_process(3)?, 1)?;
        let subject = format!("{name}, three filaments wide apart");
        let change = largest_change(
            &impulses(&several),
            &[expected.contact_normal_impulse_n_s; 3],
        );
        let (source, tolerance) = (sources::PASS, tolerances::ROW_ALONE);
        trial.check(
            &subject,
            "largest change of p_n",
            0.0,
            source,
            change,
            tolerances::ROW_ALONE_ABSOLUTE,
        );
        trial.check(
            &subject,
            "interaction factor",
            1.0,
            source,
            several.interaction_factor,
            tolerance,
        );
        trial.check(
            subject,
            "pairs that touch",
            0.0,
            sources::EXACT,
            several.pairs.len() as f64,
            tolerances::SAME,
        );
    }
    Ok(trial)
}

pub fn symmetries(extent: Extent) -> Result<Trial, Failure> {
    let (columns, equal_columns, numbers): (usize, usize, &[usize]) =
        extent.choose((3, 3, &[2]), (8, 6, &[2, 3, 5]));
    // At looser ones the mean is right, but an impulse of a single filament is not.
    let tolerance = 1e-4;
    let mut trial = Trial::new(
        "Symmetries of a sector",
        "What must not change the impulses of the filaments: the number of threads, and a stop with a checkpoint, to the bit; a \
            reflection in the plane of rotation, and a shift along the axis to other places in memory, to within what is left by Newton's \
            method, which stops at other residuals there, and what bounces make of it.",
    );
    let mut check = |subject: &str, change: f64, tolerance| {
        trial.check(
            subject,
            "largest change of p_n",
            0.0,
            sources::SYMMETRY,
            change,
            tolerance,
        );
    };
    // Three rows of their own, tilted at random, with friction between filaments.
    let mut tilted = with(&row(5, 3.0 * AROUND, columns)?, |brush| {
        brush.rows = Some(3);
        brush.lateral_tilt_std_rad = 2e-3;
        brush.friction_coefficient = 0.2;
    });
    tilted.tool.width_m = 3.6e-3;
    let expected = simulate_brush(&tilted, 1)?;
    for &threads in numbers {
        let change = largest_change(
            &impulses(&simulate_brush(&tilted, threads)?),
            &impulses(&expected),
        );
        check(
            &format!("{threads} threads instead of one, three tilted rows with friction"),
            change,
            tolerances::SAME,
        );
    }
    let options = RunOptions::default();
    let mut stopped = BrushRun::new(&tilted, options)?;
    while stopped.done() < 0.5 && stopped.advance()? {}
    let mut resumed = BrushRun::resume(&tilted, options, stopped.checkpoint())?;
    while resumed.advance()? {}
    let change = largest_change(&impulses(&resumed.finish()?), &impulses(&expected));
    check("stopped half way and resumed", change, tolerances::SAME);

    // Three rows with ends, all filaments tilted by the same angle, or by the opposite one.
    let leaning = |tilt: f64| -> Result<BrushResult, Failure> {
        let mut settings = with(&row(5, 3.0 * AROUND, equal_columns)?, |brush| {
            (brush.rows, brush.ends, brush.tolerance) = (Some(3), Ends::Free, tolerance);
        });
        settings.tool.width_m = 3.9e-3;
        settings.filament.lateral_tilt_rad = tilt;
        Ok(simulate_brush(&settings, 1)?)
    };
    let (one, mirrored) = (leaning(0.02)?, impulses(&leaning(-0.02)?));
    let images: Vec<f64> = one
        .filaments
        .iter()
        .map(|filament| mirrored[3 * filament.column + 2 - filament.row])
        .collect();
    check(
        "mirrored, three rows with ends, tilted by ±0.02",
        largest_change(&images, &impulses(&one)),
        tolerances::ROW_IMAGE,
    );

    // Equal rows, solved together in space, at other heights and in other places of memory.
    let single = simulate_brush(
        &with(&row(5, AROUND, equal_columns)?, |brush| {
            brush.tolerance = tolerance
        }),
        1,
    )?;
    let mut equal = with(&row(5, 3.0 * AROUND, equal_columns)?, |brush| {
        (brush.rows, brush.pattern, brush.tolerance) = (Some(3), Pattern::Aligned, tolerance);
    });
    let planar = impulses(&simulate_brush(&equal, 1)?);
    // So little that it only asks for equations in space.
    equal.process.gravity_m_s2 = [0.0, 0.0, 1e-9];
    let spatial = impulses(&simulate_brush(&equal, 1)?);
    let thrice: Vec<f64> = impulses(&single)
        .iter()
        .flat_map(|impulse| [*impulse; 3])
        .collect();
    check(
        "three equal rows in the plane, and one",
        largest_change(&planar, &thrice),
        tolerances::SAME,
    );
    check(
        "three equal rows in space, and one in the plane",
        largest_change(&spatial, &thrice),
        tolerances::ROW_IMAGE,
    );
    Ok(trial)
}
