//! Convergence of the mean impulse of a steady stretch.

use bristle::brush::{BrushResult, simulate_brush};
use bristle::model::metrics::tool_force;
use bristle::model::settings::{BrushSettings, Settings};

use super::rows::{AROUND, row, with};
use crate::trial::{Failure, Trial, TrialResult};
use crate::{sources, tolerances};

/// Filaments of the paper's brush.
const PAPER_COUNT: f64 = 10_500.0;

/// A row long enough for a steady stretch, at 10 m/s.
fn steady_row(segments: usize, depth: f64) -> Result<Settings, Failure> {
    let mut settings = with(&row(segments, AROUND, 1)?, |brush| {
        (brush.columns, brush.steady) = (None, true)
    });
    settings.process.penetration_depth_m = depth;
    Ok(settings)
}

/// Force of the paper's brush in N if each filament had the impulse `impulse` (N s).
fn force(settings: &Settings, impulse: f64) -> f64 {
    tool_force(
        impulse,
        PAPER_COUNT,
        settings.process.brushing_velocity_m_s / settings.tool_radius_m(),
    )
}

/// Mean impulse of the stretch in N s.
fn mean(settings: &Settings) -> Result<f64, Failure> {
    Ok(simulate_brush(settings, 1)?.tool.contact_normal_impulse_n_s)
}

/// Number of segments of the rows whose forces are known.
const SEGMENTS: usize = 8;
/// The depth in m at which settings are changed.
const DEPTH: f64 = 1e-3;

/// Mean impulse of a steady stretch of 682 filaments around, and its dependence on settings.
///
/// docs/MODEL.md states the forces, from a prototype, another code. One setting is changed at a
/// time. Brushes of several rows are staggered and tilted at random by 1e-3 rad.
pub fn steady(trial: &mut Trial) -> TrialResult {
    let base = steady_row(SEGMENTS, DEPTH)?;
    let of_base = simulate_brush(&base, 1)?;
    // Depth in m, and the forces in N of the row and of a filament alone that docs/MODEL.md states.
    for (depth, of_row, of_one) in [(DEPTH, 148.0, 165.0), (3e-3, 320.0, 290.0)] {
        let settings = steady_row(SEGMENTS, depth)?;
        let result = if settings == base {
            of_base.clone()
        } else {
            simulate_brush(&settings, 1)?
        };
        let subject = format!("a_e = {} mm, n = {SEGMENTS}", 1e3 * depth);
        for (quantity, known, impulse) in [
            ("F_n,w in N", of_row, result.tool.contact_normal_impulse_n_s),
            (
                "F_n,w in N, alone",
                of_one,
                result.alone.contact_normal_impulse_n_s,
            ),
        ] {
            let tolerance = tolerances::KNOWN_ROW;
            trial.check(
                &subject,
                quantity,
                known,
                sources::KNOWN_ROW,
                force(&settings, impulse),
                tolerance,
            );
        }
    }
    changes(trial, &base, &of_base)
}

/// A staggered brush of `rows` rows, as dense around as the row, whose filaments are tilted at
/// random out of their planes.
fn tilted(row: &Settings, rows: usize) -> Settings {
    const PITCH_M: f64 = 1.3e-3;
    let mut settings = with(row, |brush| {
        (brush.rows, brush.lateral_tilt_std_rad) = (Some(rows), 1e-3)
    });
    settings.tool.filament_count = AROUND * rows as f64;
    settings.tool.width_m = PITCH_M * rows as f64;
    settings
}

/// Compares the mean of `base`, whose result is given, with that of changed settings.
fn changes(trial: &mut Trial, base: &Settings, of_base: &BrushResult) -> TrialResult {
    const MAX_SEGMENTS: usize = 24;
    const MAX_ROWS: usize = 8;
    const MIN_TOLERANCE: f64 = 1e-5;
    let (columns, reference) = (of_base.columns, of_base.tool.contact_normal_impulse_n_s);
    let mean = |settings: &Settings| {
        if settings == base {
            Ok(reference)
        } else {
            mean(settings)
        }
    };
    let mut compare = |subject: String, mean: f64, reference: f64, tolerance| {
        let (quantity, change) = ("change of p̄_n", mean / reference - 1.0);
        trial.check(
            subject,
            quantity,
            0.0,
            sources::CONVERGENCE,
            change,
            tolerance,
        );
    };
    let other = |change: &dyn Fn(&mut BrushSettings)| mean(&with(base, change));
    for points in [3, 10, 20] {
        let changed = other(&|brush| brush.contact_points = Some(points))?;
        let subject = format!("N_q = {points} instead of the default");
        compare(subject, changed, reference, tolerances::STEADY);
    }
    // The time step is finer, because stiffer impacts are shorter.
    for stiffness in [2e8, 9e8] {
        let changed = other(&|brush| (brush.stiffness_n_m2, brush.tolerance) = (stiffness, 3e-4))?;
        let subject = format!("k_l = {stiffness:e} N/m² instead of 6e7");
        compare(subject, changed, reference, tolerances::STIFFER_ROW);
    }
    for more in [3 * columns / 2, 2 * columns] {
        let changed = other(&|brush| brush.columns = Some(more))?;
        let subject = format!("{more} columns instead of {columns}");
        compare(subject, changed, reference, tolerances::STEADY);
    }
    let of_segments = |segments: usize| mean(&steady_row(segments, DEPTH)?);
    let fine = of_segments(MAX_SEGMENTS)?;
    for segments in [8, 12, 16] {
        let subject = format!("n = {segments} instead of {MAX_SEGMENTS}");
        compare(
            subject,
            of_segments(segments)?,
            fine,
            tolerances::STEADY_COARSE,
        );
    }
    let many = mean(&tilted(base, MAX_ROWS))?;
    for rows in [2, 4] {
        let subject = format!("{rows} rows of tilted filaments instead of {MAX_ROWS}");
        compare(
            subject,
            mean(&tilted(base, rows))?,
            many,
            tolerances::STEADY_COARSE,
        );
    }
    let limit = other(&|brush| brush.tolerance = MIN_TOLERANCE)?;
    for tolerance in [3e-3, 1e-3, 3e-4, 1e-4, 3e-5] {
        let change = other(&|brush| brush.tolerance = tolerance)? / limit - 1.0;
        trial.check(
            format!("tolerance {tolerance:e} instead of {MIN_TOLERANCE:e}"),
            "change of p̄_n / tolerance",
            0.0,
            sources::CONTROL,
            change / tolerance,
            tolerances::STEADY_TOLERANCE,
        );
    }
    Ok(())
}
