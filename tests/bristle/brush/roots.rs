//! Places of roots, and deviations of single filaments.

use std::f64::consts::TAU;

use bristle::brush::{BrushRun, FilamentResult, RunOptions};
use bristle::model::settings::{Hold, Pattern, Settings, ToolSettings};

use super::{impulses, row, simulated};
use crate::common::with;

#[test]
fn roots_are_shifted_where_there_is_room() {
    let shifted = |rows: usize| {
        let settings = with(&row(2, 500.0 * rows as f64, 6), |brush| {
            (brush.rows, brush.root_std_m) = (Some(rows), 0.2e-3);
        });
        let settings = Settings {
            tool: ToolSettings {
                width_m: 1.5e-3 * rows as f64,
                ..settings.tool.clone()
            },
            ..settings
        };
        (simulated(&settings), settings)
    };
    for rows in [1, 3] {
        let (result, settings) = shifted(rows);
        let place = |filament: &FilamentResult| {
            [
                settings.tool.body_radius_m * filament.root_angle_rad,
                filament.root_z_m,
            ]
        };
        let places: Vec<[f64; 2]> = result.filaments.iter().map(place).collect();
        let diameter = settings.filament.diameter_m;
        let is_apart = |a: usize, b: usize| {
            (places[a][0] - places[b][0]).hypot(places[a][1] - places[b][1]) >= diameter
        };
        assert!(
            (0..places.len()).all(|a| (0..a).all(|b| is_apart(a, b))),
            "{places:?}"
        );
        let pitch = TAU * settings.tool.body_radius_m / 500.0;
        let is_shifted = |filament: &FilamentResult| {
            (place(filament)[0] / pitch - filament.column as f64).rem_euclid(0.5) > 0.01
        };
        assert!(result.filaments.iter().any(is_shifted));
        assert_eq!(places.iter().all(|[_, z]| *z == 0.0), rows == 1);
    }
}

#[test]
fn each_filament_has_its_own_deviations() {
    let mut settings = row(5, 300.0, 12);
    settings.uncertainty.length_std_m = 2e-4;
    // From brush to brush, the filaments of one are alike.
    let [alike, stated] = [&settings, &row(5, 300.0, 12)].map(simulated);
    assert_eq!(impulses(&alike), impulses(&stated));
    settings.uncertainty.hold = Hold::Machine;
    let result = simulated(&settings);
    let impulses = impulses(&result);
    let mean = impulses.iter().sum::<f64>() / 12.0;
    let deviation = (impulses
        .iter()
        .map(|impulse| (impulse - mean).powi(2))
        .sum::<f64>()
        / 11.0)
        .sqrt();
    assert!(
        deviation > 0.03 * mean && deviation < 0.5 * mean,
        "{impulses:?}"
    );
    // Filaments are the same whatever the number of columns. Steps are halved where any filament
    // needs it.
    let fewer = simulated(&with(&settings, |brush| brush.columns = Some(4)));
    let [a, b] = [fewer, result].map(|result| result.filaments[1].metrics.max_tip_deflection_m);
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
}

#[test]
fn random_roots_keep_their_distance() {
    let settings = with(&row(2, 10_500.0, 2), |brush| {
        (brush.rows, brush.pattern) = (None, Pattern::Random);
        brush.tolerance = 1e-2;
    });
    let result = simulated(&settings);
    assert_eq!((result.columns, result.rows), (2, 15));
    let (mut least, mut regular) = (f64::INFINITY, 0);
    for (index, a) in result.filaments.iter().enumerate() {
        for b in &result.filaments[..index] {
            let chord = 0.28 * (0.5 * (a.root_angle_rad - b.root_angle_rad)).sin();
            for shift in [-0.02, 0.0, 0.02] {
                least = least.min(chord.hypot(a.root_z_m - b.root_z_m + shift));
            }
        }
        let angle = a.root_angle_rad * 700.0 / TAU;
        regular += usize::from((angle - angle.round()).abs() < 0.05);
    }
    assert!((1.18e-3..1.25e-3).contains(&least), "{least}");
    // All regular roots would be; a tenth of random ones is.
    assert!(regular < 10, "{regular} of 30");
    let again = simulated(&settings);
    assert_eq!(again, result);
    let other = with(&settings, |brush| brush.seed = 2);
    assert!(simulated(&other).filaments[0].root_z_m != result.filaments[0].root_z_m);
}

/// Cells in which random roots are looked for are as many as roots, however thin these are.
#[test]
fn very_thin_random_filaments_are_no_memory_hogs() {
    let mut settings = row(5, 682.0, 4);
    settings.filament.diameter_m = 1e-9;
    let settings = with(&settings, |brush| {
        (brush.rows, brush.pattern, brush.contact_points) = (Some(2), Pattern::Random, Some(1));
    });
    let options = RunOptions {
        memory: Some(1 << 30),
        ..RunOptions::default()
    };
    assert!(BrushRun::new(&settings, options).is_ok());
}
