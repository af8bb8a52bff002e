//! Rows of filaments that pass a workpiece.

use bristle::brush::{BrushResult, simulate_brush};
use bristle::model::settings::{BrushSettings, Settings};
use serde::Deserialize;

use crate::chains::{cases_of, paper_case};
use crate::trial::{Failure, Trial, TrialResult};
use crate::{sources, tolerances};

/// Filaments around of the dense rows.
pub const AROUND: f64 = 682.0;

/// A row of `columns` columns of the paper's filaments, with `around` of them around.
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

/// Returns the settings with a changed brush.
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

/// A row by another code.
#[derive(Deserialize)]
struct OtherRow {
    name: String,
    input: Settings,
    filaments: Vec<OfFilament>,
}

#[derive(Deserialize)]
struct OfFilament {
    contact_normal_impulse_n_s: f64,
}

/// Six filaments of five segments in MuJoCo, with the points of docs/MODEL.md, and with its
/// capsules.
///
/// Capsules touch at one point, which moves force from filament to filament and hardly changes the
/// mean. MuJoCo takes steps of 50 ns and knows `p_n` to 2e-4, with Hertz's stiffness to 5e-3.
pub fn mujoco(trial: &mut Trial) -> TrialResult {
    const ROWS: &str = include_str!("../../../../tests/data/reference_row_mujoco.json");
    for case in cases_of::<OtherRow>(ROWS)? {
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

/// A row with friction everywhere and damping between filaments.
fn rubbing(columns: usize) -> Result<Settings, Failure> {
    let mut settings = with(&row(5, AROUND, columns)?, |brush| {
        (brush.damping_s_m, brush.friction_coefficient) = (0.5, 0.3);
    });
    settings.contact.friction_coefficient = 0.3;
    Ok(settings)
}

/// Moment of the workpiece against the power of the clamps, `∫ M dt + W/ω = 0`.
///
/// Strong damping (ζ = 0.5) lets all filaments turn rigidly again at the end. The balance holds
/// only if forces and moments between filaments balance in pairs.
pub fn momentum(trial: &mut Trial) -> TrialResult {
    let tolerance = 1e-5;
    for (name, settings) in [
        ("friction and damping", rubbing(6)?),
        ("neither", row(5, AROUND, 6)?),
    ] {
        let mut settings = with(&settings, |brush| brush.tolerance = tolerance);
        // At the end all filaments turn with the body again.
        settings.filament.damping_ratio = 0.5;
        settings.process.tail_angle_rad = 1.5;
        let result = simulate_brush(&settings, 1)?;
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
