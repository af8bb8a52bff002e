//! Brushes whose filaments do not touch have the results of passes. `tests/agreement` compares
//! random brushes of one filament with their passes.

use bristle::brush::{BrushResult, simulate_brush};
use bristle::model::metrics::Metrics;
use bristle::model::settings::{BrushSettings, Ends, Pattern, Settings};
use bristle::simulation::{Pass, Sampling, Simulation, simulate};
use serde_json::{Value, json};

use crate::common::metric;

/// Filaments of a tilted brush, whose rows meet the workpiece at different depths, pass as they do
/// alone if they are far apart.
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

/// The results of a brush of so many filaments far apart, on a body of this radius (m), and of the
/// pass of one.
fn brush_and_pass(
    columns: usize,
    body_radius_m: f64,
    mut others: Value,
) -> (BrushResult, Simulation) {
    others["tool"] = json!({
        "kind": "round", "body_radius_m": body_radius_m, "width_m": 0.02, "filament_count": 8,
    });
    others["brush"] = json!({"columns": columns, "rows": 1, "steady": false});
    let settings: Settings = serde_json::from_value(others).expect("settings");
    let brush = simulate_brush(&settings, 1).expect("a brush");
    (brush, simulate(&settings).expect("a pass"))
}

/// The relative difference of the impulses of both.
fn impulse_difference(brush: &BrushResult, pass: &Simulation) -> f64 {
    let [here, there] =
        [&brush.tool, &pass.metrics].map(|metrics| metrics.contact_normal_impulse_n_s);
    (here / there - 1.0).abs()
}

/// A filament of wire swings ahead on an edge with a chamfer, and still presses when its turn ends:
/// each turn takes its part of the contact.
#[test]
fn a_contact_that_spans_two_turns_is_split_where_the_turn_ends() {
    let (brush, pass) = brush_and_pass(
        1,
        0.03,
        json!({
            "filament": {
                "segments": 4, "length_m": 0.014_62, "diameter_m": 0.000_118, "density_kg_m3": 8500,
                "youngs_modulus_pa": 1e11, "damping_ratio": 0.133,
            },
            "contact": {"stiffness_n_m": 22_290},
            "workpiece": {
                "kind": "chamfer", "side": "leaving", "offset_m": 0.000_618,
                "included_angle_rad": 1.5592, "edge_radius_m": 0.000_683,
                "chamfer_width_m": 0.003_079, "chamfer_angle_rad": 1.005,
            },
            "process": {
                "brushing_velocity_m_s": 37.8, "penetration_depth_m": 0.000_567, "turns": 2,
            },
        }),
    );
    let turns = brush.turn_contact_normal_impulses_n_s.iter();
    for (here, there) in turns.zip(&pass.turn_contact_normal_impulses_n_s) {
        assert!((here / there - 1.0).abs() < 3e-4, "{here} {there}");
    }
    assert_eq!(
        (brush.tool.contact_count, pass.metrics.contact_count),
        (2, 2)
    );
    let peaks = [&brush.tool, &pass.metrics].map(|metrics| metrics.peak_contact_normal_force_n);
    assert!((peaks[0] / peaks[1] - 1.0).abs() < 1e-3, "{peaks:?}");
}

/// The centreline of the filament passes the edge, its rounded tip grazes it.
#[test]
fn a_tip_that_grazes_the_workpiece_without_nominal_contact_is_simulated() {
    let (brush, pass) = brush_and_pass(
        1,
        0.03,
        json!({
            "filament": {
                "segments": 1, "length_m": 0.0459, "diameter_m": 0.001_09, "density_kg_m3": 1815,
                "youngs_modulus_pa": 7.84e9, "damping_ratio": 0.3,
            },
            "contact": {"stiffness_n_m": 11_335, "radius_m": 0.000_094},
            "workpiece": {
                "kind": "edge", "side": "entering", "offset_m": 0.011_854,
                "included_angle_rad": 2.191, "edge_radius_m": 0.001_193,
            },
            "process": {"brushing_velocity_m_s": 34.4, "penetration_depth_m": 0.001},
        }),
    );
    assert!(pass.metrics.nominal_contact_time_s == 0.0 && pass.metrics.contact_count == 1);
    let difference = impulse_difference(&brush, &pass);
    assert!(difference < 3e-3, "{difference}");
}

/// Filaments touch as their passes end, and bounce once more soon after, which no longer counts.
#[test]
fn each_filament_ends_with_the_contact_that_prolongs_its_pass() {
    let (brush, pass) = brush_and_pass(
        2,
        0.024_029_17,
        json!({
            "filament": {
                "segments": 2, "length_m": 0.060_290_41,
                "diameter_m": 0.001_158_369,
                "tip_diameter_m": 0.001_065_023,
                "density_kg_m3": 1_745.008,
                "youngs_modulus_pa": 2.611_092e9,
                "damping_ratio": 0.034_781_44,
            },
            "contact": {"stiffness_n_m": 368_597.6},
            "workpiece": {
                "kind": "edge", "side": "entering", "offset_m": 0.014_048_73,
                "included_angle_rad": 1.750_421,
                "edge_radius_m": 0.000_187_320_2,
            },
            "process": {
                "brushing_velocity_m_s": 1.866_676,
                "penetration_depth_m": 0.003_751_047,
            },
        }),
    );
    let expected = &pass.metrics;
    for filament in &brush.filaments {
        let Metrics {
            contact_normal_impulse_n_s,
            contact_count,
            ..
        } = filament.metrics;
        let difference = contact_normal_impulse_n_s / expected.contact_normal_impulse_n_s - 1.0;
        assert!(difference.abs() < 1e-3, "{difference}");
        assert_eq!((contact_count, expected.contact_count), (13, 13));
    }
}

/// Steps for the impulse pass over the second bending mode of a steel wire that bounces 28 times.
/// Its error estimate includes the difference from the pass.
#[test]
fn the_error_estimate_of_filaments_apart_covers_their_difference_from_passes() {
    let (brush, pass) = brush_and_pass(
        1,
        0.038_677_34,
        json!({
            "filament": {
                "segments": 2, "length_m": 0.029_384_65, "diameter_m": 0.000_271_080_4,
                "tip_diameter_m": 0.000_239_491_8, "waviness_amplitude_m": -0.000_512_985_1,
                "waviness_length_m": 0.041_351_65, "waviness_phase_rad": 5.104_673,
                "density_kg_m3": 7850, "youngs_modulus_pa": 2.1e11,
                "damping_ratio": 0.013_778_66,
            },
            "contact": {"stiffness_n_m": 738_810.1},
            "process": {
                "brushing_velocity_m_s": 2.815_132, "penetration_depth_m": 0.000_765_455_7,
                "gravity_m_s2": [-9.196_664, -9.81, 0.0],
            },
        }),
    );
    let (difference, estimate) = (
        impulse_difference(&brush, &pass),
        brush.impulse_error_estimate,
    );
    assert!(difference <= 1.01 * estimate, "{difference} {estimate}");
}
