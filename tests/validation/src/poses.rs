//! Rotary tools of any kind and pose.

use std::f64::consts::PI;

use bristle::model::filament::{bending_stiffness, first_natural_frequency};
use bristle::model::settings::{Settings, ToolKind};
use bristle::simulation::{Pass, simulate};
use serde::Deserialize;

use super::chains::{extrapolated, extrapolated_twice, paper_case};
use super::exact::beam::cantilever_root;
use super::exact::elastica::buckled_force;
use super::exact::rotating_beam::splay;
use super::trial::{Failure, Trial, TrialResult};
use super::{sources, tolerances};

/// Results of `derivations/passes.py poses`.
const POSES: &str = include_str!("../../../tests/data/reference_poses.json");

#[derive(Deserialize)]
struct References {
    free_cups: Vec<FreeCup>,
    flat_cups: Vec<FlatCup>,
}

/// The tip of a filament that touches nothing.
#[derive(Deserialize)]
struct FreeCup {
    length_m: f64,
    brushing_velocity_m_s: f64,
    segments: usize,
    radius_m: f64,
    height_m: f64,
}

/// The force on a filament of a cup that is pressed flat.
#[derive(Deserialize)]
struct FlatCup {
    brushing_velocity_m_s: f64,
    penetration_depth_m: f64,
    segments: usize,
    force_n: f64,
}

fn references() -> Result<References, Failure> {
    Ok(serde_json::from_str(POSES)?)
}

/// A cup that is pressed flat, of filaments of the paper's.
fn cup(segments: usize, velocity: f64, depth: f64) -> Result<Settings, Failure> {
    let mut settings = paper_case(segments, velocity, depth)?;
    (settings.tool.kind, settings.tool.positions) = (ToolKind::Cup, Some(1));
    Ok(settings)
}

/// Distance from the axis and height over its root of the tip of a filament that touches nothing,
/// in m.
fn tip(settings: &Settings) -> [f64; 2] {
    let pass = Pass::new(settings);
    let mut system = pass.system(false);
    let start = pass.start(&mut system);
    let length = settings.filament.length_m / settings.filament.segments as f64;
    let (sin, cos) = pass.tool().initial_angle.sin_cos();
    let none = [0.0; 2];
    let [mut x, mut y, mut z] = [
        settings.tool.body_radius_m * cos,
        settings.tool.body_radius_m * sin,
        0.0,
    ];
    for q in &start.q {
        let [direction, ..] = start.chart.direction([*q, none, none]);
        [x, y, z] = [
            x + length * direction[0],
            y + length * direction[1],
            z + length * direction[2],
        ];
    }
    [x.hypot(y), z]
}

/// Splay of cups, whose filaments are parallel to the axis: `w⁗ = Ω² (r_g + w)` where they bend
/// little.
///
/// Cups of the paper's filaments bend by up to 67 mm of 80 mm. SciPy minimises their `V`.
pub fn splayed(trial: &mut Trial) -> TrialResult {
    /// Distance of the clamp from the axis, over l_f: so near that the filament hardly bends.
    const NEAR: f64 = 3e-5;
    const SEGMENTS: [usize; 3] = [25, 50, 100];
    let paper = paper_case(25, 10.0, 1e-3)?;
    let unit = first_natural_frequency(&paper.filament) / cantilever_root(1).powi(2);
    let near = NEAR * paper.filament.length_m;
    for speed in [0.25, 1.0, 2.25, 3.24] {
        let mut computed = [0.0; 3];
        for (computed, segments) in computed.iter_mut().zip(SEGMENTS) {
            let mut settings = cup(segments, speed * unit * near, 1e-3)?;
            (settings.tool.body_radius_m, settings.tool.width_m) = (near, near);
            *computed = tip(&settings)[0] / near - 1.0;
        }
        let exact = splay(speed);
        let subject = format!("Ω = {speed}, r_g = {NEAR} l_f");
        let (source, tolerance) = (sources::BEAM, tolerances::SPLAY);
        trial.check(
            format!("{subject}, n → ∞"),
            "w/r_g",
            exact,
            source,
            extrapolated_twice(computed),
            tolerance,
        );
        let subject = format!("{subject}, n = {}, {}", SEGMENTS[0], SEGMENTS[1]);
        trial.check_order(subject, "order of w", [computed[0], computed[1]], exact);
    }
    for case in references()?.free_cups {
        let mut settings = cup(case.segments, case.brushing_velocity_m_s, 1e-3)?;
        settings.filament.length_m = case.length_m;
        let [radius, height] = tip(&settings);
        let subject = format!(
            "l_f = {} mm, {} m/s, n = {}",
            1e3 * case.length_m,
            case.brushing_velocity_m_s,
            case.segments
        );
        let expected = [
            (
                "distance of the tip from the axis, over l_f",
                radius - case.radius_m,
            ),
            ("height of the tip, over l_f", height - case.height_m),
        ];
        for (quantity, error) in expected {
            let tolerance = tolerances::MINIMUM;
            trial.check(
                &subject,
                quantity,
                0.0,
                sources::SCIPY_POSES,
                error / case.length_m,
                tolerance,
            );
        }
    }
    Ok(())
}

/// The force in N on a filament of a cup that is pressed flat, without friction.
fn flat_force(settings: &Settings) -> Result<f64, Failure> {
    let mut settings = settings.clone();
    settings.solver.relative_tolerance = 1e-9;
    let metrics = simulate(&settings)?.metrics;
    Ok(metrics.contact_normal_impulse_n_s / metrics.nominal_contact_time_s)
}

/// Force on a cup that is pressed flat without friction, which turns rigidly with its filaments.
///
/// SciPy finds the minimum of `V + ½ k_c δ²`. The slower the cup turns, the more its filament is a
/// clamped-free elastica that has buckled.
pub fn flat(trial: &mut Trial) -> TrialResult {
    const SEGMENTS: usize = 25;
    /// Velocity in m/s.
    const SLOW: f64 = 2.0;
    for case in references()?.flat_cups {
        let settings = cup(
            case.segments,
            case.brushing_velocity_m_s,
            case.penetration_depth_m,
        )?;
        let subject = format!(
            "{} m/s, {} mm, n = {}",
            case.brushing_velocity_m_s,
            1e3 * case.penetration_depth_m,
            case.segments
        );
        trial.check(
            subject,
            "F_n in N",
            case.force_n,
            sources::SCIPY_POSES,
            flat_force(&settings)?,
            tolerances::FLAT,
        );
    }
    for depth in [1e-3, 3e-3] {
        // From two velocities to rest, as forces of inertia grow with their square, and from two n.
        let at = |segments: usize| -> Result<f64, Failure> {
            let [slow, fast] = [SLOW, 2.0 * SLOW]
                .map(|velocity| cup(segments, velocity, depth).and_then(|cup| flat_force(&cup)));
            Ok(extrapolated(fast?, slow?))
        };
        let computed = extrapolated(at(SEGMENTS)?, at(2 * SEGMENTS)?);
        let settings = cup(SEGMENTS, SLOW, depth)?;
        let length = settings.filament.length_m;
        let bending = bending_stiffness(&settings.filament, settings.filament.diameter_m);
        let critical = PI.powi(2) * bending / (4.0 * length.powi(2));
        let exact = buckled_force(
            depth / length,
            settings.contact.stiffness_n_m * length / critical,
        );
        let subject = format!("v_b → 0, {} mm, n → ∞", 1e3 * depth);
        trial.check(
            subject,
            "F_n/P_cr",
            exact,
            sources::TIMOSHENKO,
            computed / critical,
            tolerances::QUASI_STATICS,
        );
    }
    Ok(())
}
