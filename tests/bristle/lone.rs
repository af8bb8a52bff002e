//! A brush of one filament is the pass of that filament: seeded random settings of all that a brush
//! can have.

use bristle::brush::simulate_brush;
use bristle::model::settings::{
    BrushSettings, ChamferSettings, EdgeSettings, Ends, Pattern, ProfileSettings, Settings, Side,
    Turns, WorkpieceKind,
};
use bristle::simulation::{Pass, Sampling, simulate};
use fastrand::Rng;

use crate::common::metric;

/// Settings that `cargo test` tries. `BRISTLE_LONE` states another number (CONTRIBUTING.md).
const COUNT: usize = 8;

/// Seeded sane settings; none where a workpiece without edges would have a side.
fn settings_of(seed: u64) -> Option<Settings> {
    let mut random = Rng::with_seed(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
    let velocity = 2.5 * (30.0_f64 / 2.5).powf(between(0.0, 1.0));
    let mut settings = Settings::paper(velocity, between(3e-4, 3e-3));
    settings.tool.filament_count = 600.0;
    settings.filament.segments = between(1.0, 26.0) as usize;
    settings.filament.length_m = between(0.03, 0.05);
    settings.filament.diameter_m = between(4e-4, 1.5e-3);
    settings.filament.damping_ratio = between(0.02, 0.2);
    if between(0.0, 1.0) < 0.3 {
        settings.filament.tip_diameter_m = Some(between(0.6, 1.0) * settings.filament.diameter_m);
    }
    if between(0.0, 1.0) < 0.3 {
        settings.filament.waviness_amplitude_m = between(0.0, 4e-4);
        settings.filament.waviness_length_m = Some(between(0.01, 0.03));
        settings.filament.waviness_phase_rad = between(0.0, 6.0);
    }
    if between(0.0, 1.0) < 0.4 {
        settings.contact.friction_coefficient = between(0.0, 0.5);
    }
    if between(0.0, 1.0) < 0.3 {
        settings.contact.damping_s_m = between(0.0, 1.0);
    }
    if between(0.0, 1.0) < 0.3 {
        settings.filament.lateral_tilt_rad = between(0.005, 0.05);
    }
    let kind =
        ["plane", "edge", "chamfer", "cylinder", "bore", "profile"][between(0.0, 6.0) as usize];
    let side = if between(0.0, 1.0) < 0.5 {
        Side::Entering
    } else {
        Side::Leaving
    };
    settings.workpiece.kind = match kind {
        "edge" => WorkpieceKind::Edge(EdgeSettings {
            side,
            edge_radius_m: between(3e-4, 2e-3),
            offset_m: between(-5e-3, 5e-3),
            ..EdgeSettings::default()
        }),
        "chamfer" => WorkpieceKind::Chamfer(ChamferSettings {
            side,
            edge_radius_m: between(3e-4, 2e-3),
            offset_m: between(-5e-3, 5e-3),
            chamfer_width_m: between(3e-3, 6e-3),
            ..ChamferSettings::default()
        }),
        _ if side == Side::Entering => return None,
        "cylinder" => WorkpieceKind::cylinder(between(0.05, 0.3)),
        "bore" => WorkpieceKind::bore(between(0.3, 0.6)),
        "profile" => {
            let height = between(0.0, 2e-3);
            let points = [-0.2, -0.1, -0.03, 0.0, 0.03, 0.1, 0.2];
            let control_points_m = points
                .map(|x: f64| [x, -height * (30.0 * x).sin().powi(2)])
                .to_vec();
            WorkpieceKind::Profile(ProfileSettings {
                control_points_m,
                ..ProfileSettings::default()
            })
        }
        _ => WorkpieceKind::default(),
    };
    settings.process.turns = Some(match between(0.0, 1.0) {
        share if share < 0.7 => Turns::Count(1),
        share if share < 0.9 => Turns::Count(between(2.0, 4.0) as usize),
        _ => Turns::Steady,
    });
    let tolerance = if between(0.0, 1.0) < 0.7 { 1e-3 } else { 1e-4 };
    let brush = BrushSettings {
        columns: Some(1),
        rows: Some(1),
        steady: false,
        tolerance,
        ..BrushSettings::default()
    };
    Some(Settings {
        brush: Some(brush),
        ..settings
    })
}

#[test]
fn a_brush_of_one_filament_is_its_pass() {
    let count = std::env::var("BRISTLE_LONE")
        .map_or(COUNT, |text| text.parse().expect("a number of settings"));
    let (mut compared, mut warned, mut wrong) = (0, 0, Vec::new());
    for seed in 0..count as u64 {
        let Some(mut settings) = settings_of(seed) else {
            continue;
        };
        if count == COUNT {
            // Several turns take minutes.
            settings.process.turns = Some(Turns::Count(1));
        }
        // What cannot be stated, or simulated, is tried elsewhere.
        if settings.check().is_err() {
            continue;
        }
        let Ok(alone) = simulate(&settings) else {
            continue;
        };
        let brush = match simulate_brush(&settings, 1) {
            Ok(brush) => brush,
            Err(error) => {
                wrong.push(format!("seed {seed}: {error}"));
                continue;
            }
        };
        let tolerance = settings.brush_or_default().tolerance;
        let impulses = match &brush.turn_contact_normal_impulses_n_s[..] {
            [] => vec![brush.tool.contact_normal_impulse_n_s],
            impulses => impulses.to_vec(),
        };
        let expected = &alone.turn_contact_normal_impulses_n_s;
        compared += 1;
        if brush.step_error > tolerance {
            warned += 1;
            continue;
        }
        let largest = expected.iter().copied().fold(0.0, f64::max);
        let errors = impulses.iter().zip(expected).map(|(found, expected)| {
            let scale = if *expected > 0.0 { *expected } else { largest };
            if found == expected {
                0.0
            } else {
                (found - expected).abs() / scale
            }
        });
        let error = errors.fold(0.0, f64::max);
        // The passes have errors of their own, of their tolerance.
        if impulses.len() != expected.len() || error > 1.1 * tolerance {
            wrong.push(format!(
                "seed {seed}: {error:e} at {tolerance:e}, {impulses:?} {expected:?}"
            ));
        }
    }
    println!("{compared} compared, {warned} warned");
    assert!(
        wrong.is_empty(),
        "{} of {compared}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert!(
        2 * compared >= count && 10 * warned <= compared,
        "{compared} compared, {warned} warned"
    );
}

#[test]
fn a_brush_of_one_filament_and_one_segment_moves() {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 1;
    settings.brush = Some(BrushSettings {
        columns: Some(1),
        rows: Some(1),
        steady: false,
        ..BrushSettings::default()
    });
    settings.tool.filament_count = 600.0;
    let alone = simulate(&settings)
        .expect("a pass")
        .metrics
        .contact_normal_impulse_n_s;
    let brush = simulate_brush(&settings, 1)
        .expect("a brush")
        .tool
        .contact_normal_impulse_n_s;
    assert!((brush / alone - 1.0).abs() < 1e-3, "{brush} {alone}");
}

/// Rows of a tilted brush meet the workpiece at depths of their own: far apart, each filament
/// passes as it does alone at its place.
#[test]
fn filaments_of_a_tilted_brush_are_those_along_its_trim() {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 6;
    settings.contact.friction_coefficient = 0.2;
    (
        settings.tool.tilt_rad,
        settings.tool.skew_rad,
        settings.tool.filament_count,
    ) = (Some(0.03), 0.1, 300.0);
    let brush = BrushSettings {
        columns: Some(1),
        rows: Some(3),
        steady: false,
        ends: Ends::Free,
        pattern: Pattern::Aligned,
        ..BrushSettings::default()
    };
    settings.brush = Some(brush);
    let found = simulate_brush(&settings, 1).expect("a brush");
    assert_eq!(found.filaments.len(), 3);
    let largest = found
        .filaments
        .iter()
        .map(|each| each.metrics.contact_normal_impulse_n_s)
        .fold(0.0, f64::max);
    for filament in &found.filaments {
        let alone = Pass::at(&settings, filament.root_z_m)
            .simulate(Sampling::default())
            .expect("a pass")
            .metrics;
        for key in [
            "contact_normal_impulse_n_s",
            "contact_impulse_x_n_s",
            "contact_impulse_z_n_s",
        ] {
            let [here, there] = [&filament.metrics, &alone].map(|metrics| metric(metrics, key));
            assert!(
                (here - there).abs() <= 1e-3 * largest,
                "{key} at {}: {here} {there}",
                filament.root_z_m
            );
        }
    }
    // On a tilted trim rows do not repeat.
    settings.brush = Some(BrushSettings {
        ends: Ends::Periodic,
        ..settings.brush_or_default()
    });
    assert_eq!(
        settings.check().expect_err("periodic rows").path,
        "brush.ends"
    );
}
