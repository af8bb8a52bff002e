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
use super::group::{Extent, Failure, Group};
use super::trial::{Axis, Curve, Figure, Look, Trial};
use super::{sources, tolerances};

/// The group.
pub const GROUP: Group = Group {
    title: "Tools of any kind and pose",
    purpose: "Filaments of tilted and conical tools and of cups leave the plane of rotation, start bent by centrifugal forces, and may touch \
        all round.",
    trials: &[passes, splayed, flat],
};

/// Results of `derivations/passes.py poses`.
const POSES: &str = include_str!("../../../tests/data/reference_poses.json");

#[derive(Deserialize)]
struct References {
    cases: Vec<Reference>,
    free_cups: Vec<FreeCup>,
    flat_cups: Vec<FlatCup>,
}

/// The mean filament of a trim.
#[derive(Deserialize)]
struct Reference {
    name: String,
    input: Settings,
    contact_normal_impulse_n_s: f64,
    contact_impulse_x_n_s: f64,
    contact_impulse_z_n_s: f64,
    contact_angular_impulse_n_m_s: f64,
    friction_work_j: f64,
    contact_time_s: f64,
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
    serde_json::from_str(POSES).map_err(Failure::reference)
}

fn passes(_: Extent) -> Result<Trial, Failure> {
    let mut trial = Trial::new(
        "Passes of tilted tools, cones and cups by CasADi and CVODES",
        "Filaments of five segments on tools whose axes are tilted and skewed, with and without friction: radial ones, cones, and cups \
            that strike the workpiece, lean over, or touch it all round. Of two tools the trim counts, by three filaments. The other code \
            states them in the frame of the workpiece, with a clamp that turns about a tilted axis, and integrates with CVODES at 1e-11. \
            It finds where filaments start by minimising V. Bristle works in the frame of the tool, at a tolerance of 1e-9.",
    );
    for case in references()?.cases {
        let mut settings = case.input.clone();
        settings.solver.relative_tolerance = 1e-9;
        let metrics = simulate(&settings)?.metrics;
        let normal = case.contact_normal_impulse_n_s;
        let moment = normal * settings.tool.body_radius_m;
        let over = |computed: f64, expected: f64, scale: f64| (computed - expected) / scale;
        let mut errors = vec![
            (
                "error of p_n",
                over(metrics.contact_normal_impulse_n_s, normal, normal),
            ),
            (
                "error of ∫ F_x dt, over p_n",
                over(
                    metrics.contact_impulse_x_n_s,
                    case.contact_impulse_x_n_s,
                    normal,
                ),
            ),
            (
                "error of ∫ F_z dt, over p_n",
                over(
                    metrics.contact_impulse_z_n_s,
                    case.contact_impulse_z_n_s,
                    normal,
                ),
            ),
            (
                "error of ∫ M dt, over p_n r_g",
                over(
                    metrics.contact_angular_impulse_n_m_s,
                    case.contact_angular_impulse_n_m_s,
                    moment,
                ),
            ),
            (
                "error of t_c",
                over(
                    metrics.contact_time_s,
                    case.contact_time_s,
                    case.contact_time_s,
                ),
            ),
        ];
        if case.friction_work_j > 0.0 {
            errors.push((
                "error of friction work",
                over(
                    metrics.friction_work_j,
                    case.friction_work_j,
                    case.friction_work_j,
                ),
            ));
        }
        for (quantity, error) in errors {
            trial.check(
                &case.name,
                quantity,
                0.0,
                sources::CVODES_POSES,
                error,
                tolerances::POSES,
            );
        }
        let residual = metrics.energy_residual;
        trial.check(
            case.name,
            "energy_residual",
            0.0,
            sources::EXACT,
            residual,
            tolerances::POSES_ENERGY,
        );
    }
    Ok(trial)
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
    for (q, chart) in start.q.iter().zip(&start.charts) {
        let [direction, ..] = chart.direction([*q, none, none]);
        [x, y, z] = [
            x + length * direction[0],
            y + length * direction[1],
            z + length * direction[2],
        ];
    }
    [x.hypot(y), z]
}

fn splayed(_: Extent) -> Result<Trial, Failure> {
    /// Of the clamp from the axis, over l_f: so near that the filament hardly bends.
    const NEAR: f64 = 3e-5;
    const SEGMENTS: [usize; 3] = [25, 50, 100];
    let mut trial = Trial::new(
        "Splay of cups",
        format!(
            "The filaments of a cup, parallel to its axis, splay as it turns. Where they bend little, with Ω in `√(E I/(ρ A l_f⁴))`:\n\n\
            ```text\nw⁗ = Ω² (r_g + w),   w(l_f)/r_g = (cosh Λ + cos Λ)/(1 + cosh Λ cos Λ) − 1,   Λ² = Ω\n```\n\n\
            so that slow ones bend by `Ω² r_g/8`, that is `ρ A ω² r_g l_f⁴/(8 E I)`, and the deflection grows without limit towards the first natural frequency, Λ = 1.875. Chains \
            whose clamp is as near to the axis as {NEAR} l_f are extrapolated from n = {}, {} and {}. Cups of the paper's filaments bend more: \
            by up to 67 mm of 80 mm. Another code minimises their `V = E_spring − ½ ω² Σ ∫ρ² dm` by a trust-region method of SciPy.",
            SEGMENTS[0], SEGMENTS[1], SEGMENTS[2]
        ),
    );
    let mut markers = Vec::new();
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
        markers.push((speed, computed[0]));
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
    let exact = (0..=100)
        .map(|i| 3.3 * f64::from(i) / 100.0)
        .map(|speed| (speed, splay(speed)));
    trial.figures.push(Figure {
        name: "validation_splay",
        title: "Splay of a filament that is parallel to the axis".to_owned(),
        description: "Deflection of the tip over the rotational speed: it grows with its square, and then without limit towards the first \
            natural frequency; the chains lie on the curve.",
        axes: [Axis::linear("rotational speed Ω in √(E I/(ρ A l_f⁴))"), Axis::linear("deflection of the tip over r_g")],
        curves: vec![
            Curve::new("beam", Look::Reference, exact),
            Curve::new("n = 25", Look::Markers, markers),
        ],
    });
    Ok(trial)
}

/// The force in N on a filament of a cup that is pressed flat, without friction.
fn flat_force(settings: &Settings) -> Result<f64, Failure> {
    let mut settings = settings.clone();
    settings.solver.relative_tolerance = 1e-9;
    let metrics = simulate(&settings)?.metrics;
    Ok(metrics.contact_normal_impulse_n_s / metrics.nominal_contact_time_s)
}

fn flat(extent: Extent) -> Result<Trial, Failure> {
    const SEGMENTS: usize = 25;
    /// In m/s.
    const SLOW: f64 = 2.0;
    let mut trial = Trial::new(
        "Cups pressed flat",
        "Without friction, filaments of a cup whose axis points into the workpiece turn rigidly with it, pressed down and splayed: \
            `V` and the energy of the contact, `½ k_c δ²`, are least. Another code finds the minimum by a trust-region method of SciPy. The \
            slower the cup turns, the more its filament is a clamped-free elastica that has buckled, whose force is known: \
            `P/P_cr = (2K/π)²` with `1 − Δ/l_f = 2E/K − 1` and `Δ = a_e − P/k_c`. It is extrapolated from two velocities and two n.",
    );
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
    let depths: &[f64] = extent.choose(&[3e-3], &[1e-3, 3e-3]);
    for &depth in depths {
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
    Ok(trial)
}
