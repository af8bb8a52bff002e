//! Rows of filaments that pass a workpiece.

use bristle::brush::{BrushResult, BrushRun, Frame, RunOptions, simulate_brush};
use bristle::model::settings::{BrushSettings, Settings};
use serde::Deserialize;

use crate::chains::{cases_of, paper_case, trajectory_rows};
use crate::trial::{Failure, Outcome, Trial, logarithmic_slope};
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
    filaments: Vec<OfFilament>,
    /// Angle of column 0 at time zero, where it is stated.
    #[serde(default)]
    start_angle_rad: f64,
}

#[derive(Deserialize)]
struct OfFilament {
    contact_normal_impulse_n_s: f64,
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

/// Six filaments of five segments in MuJoCo, with the points of docs/MODEL.md, and with its
/// capsules.
///
/// Capsules touch at one point, which moves force from filament to filament and hardly changes the
/// mean. MuJoCo takes steps of 50 ns and knows `p_n` to 2e-4, with Hertz's stiffness to 5e-3.
pub fn mujoco(trial: &mut Trial) -> Outcome {
    const ROWS: &str = include_str!("../../../../tests/data/reference_row_mujoco.json");
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
            &with(&case.input, |brush| brush.tolerance = 3e-6),
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
    }
    Ok(())
}

/// Forces of a row of three filaments of five segments over time, stated again for the plane.
///
/// CasADi differentiates the energy of their contact, and CVODES integrates at 1e-11. It starts
/// again wherever something begins or ceases to touch.
pub fn cvodes(trial: &mut Trial) -> Outcome {
    const ROWS: &str = include_str!("../../../../tests/data/reference_row.json");
    const INSTANTS: &str =
        include_str!("../../../../derivations/trajectories/row_three_cvodes.csv");
    const FRAMES: usize = 10_000;
    let cases = cases_of::<Reference>(ROWS)?;
    let case = cases
        .iter()
        .find(|case| case.name == "three")
        .ok_or("no row of three at 10 m/s")?;
    let result = run(
        &with(&case.input, |brush| brush.tolerance = 1e-5),
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

/// Energy balance of six filaments over the tolerance, with friction and damping between filaments.
pub fn balance(trial: &mut Trial) -> Outcome {
    let mut faster = rubbing(6)?;
    faster.process.brushing_velocity_m_s = 20.0;
    faster.process.penetration_depth_m = 2e-3;
    let cases = [
        ("friction and damping", rubbing(6)?),
        ("friction and damping, 20 m/s, 2 mm", faster),
        ("neither", row(5, AROUND, 6)?),
    ];
    for (name, settings) in cases {
        let mut course = Vec::new();
        for tolerance in [1e-3, 3e-4, 1e-4, 3e-5, 1e-5] {
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
    }
    Ok(())
}

/// Moment of the workpiece against the power of the clamps, `∫ M dt + W/ω = 0`.
///
/// Strong damping (ζ = 0.5) lets all filaments turn rigidly again at the end. The balance holds
/// only if forces and moments between filaments balance in pairs.
pub fn momentum(trial: &mut Trial) -> Outcome {
    let tolerance = 1e-5;
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
    Ok(())
}
