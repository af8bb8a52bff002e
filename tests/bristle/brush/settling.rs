//! Tilted filaments that lean on each other before they meet the workpiece.

use std::f64::consts::TAU;

use bristle::brush::{BrushRun, RunOptions};
use bristle::model::settings::{Ends, Pattern, Settings, ToolSettings};

use super::{finished, row, simulated};
use crate::common::with;

/// Simulates the paper's brush with tilts that put undeformed filaments far into each other: they
/// settle, and results converge.
#[test]
fn filaments_with_large_tilts_lean_on_each_other() {
    let tilted = |std: f64, tolerance: f64| {
        let settings = with(&row(5, 682.0 * 3.0, 2), |brush| {
            (brush.rows, brush.lateral_tilt_std_rad, brush.tolerance) = (Some(3), std, tolerance);
        });
        let settings = Settings {
            tool: ToolSettings {
                width_m: 3.6e-3,
                ..settings.tool.clone()
            },
            ..settings
        };
        simulated(&settings)
    };
    // Rows are 0.02 mm apart; a deviation of 50 mrad moves the tips by 2 mm.
    let [coarse, fine] = [1e-3, 1e-4].map(|tolerance| tilted(0.05, tolerance));
    assert!(
        coarse.history[0].press_force_n > 0.1,
        "they lean on each other before they meet the workpiece"
    );
    assert!(
        fine.residuals.momentum < 1e-5,
        "the clamps hold what presses on the roots: {:?}",
        fine.residuals
    );
    let [a, b] = [&coarse, &fine].map(|result| result.history[0].press_force_n);
    assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
    let [a, b] = [&coarse, &fine].map(|result| result.tool.contact_normal_impulse_n_s);
    assert!((a / b - 1.0).abs() < 1e-2, "{a} {b}");
}

/// Two filaments side by side, so far apart that only the tips can meet. Their clamps are tilted by
/// a standard deviation of 30 mrad. The brush is slow: centrifugal forces hardly stiffen it.
fn two(seed: u32) -> Settings {
    let mut settings = with(&row(25, 2.0 * 600.0, 1), |brush| {
        (brush.rows, brush.pattern, brush.ends) = (Some(2), Pattern::Aligned, Ends::Free);
        (brush.lateral_tilt_std_rad, brush.seed) = (0.03, seed);
    });
    settings.process.brushing_velocity_m_s = 0.5;
    settings.tool.width_m = 4e-3;
    settings
}

/// Overlap of the undeformed tips in m, from the tilts of the same filaments placed too far apart
/// to touch.
fn depth(settings: &Settings) -> f64 {
    let mut apart = settings.clone();
    apart.tool.width_m *= 10.0;
    apart.filament.segments = 2;
    let run = BrushRun::new(
        &apart,
        RunOptions {
            frames: 100,
            ..RunOptions::default()
        },
    )
    .expect("a brush");
    let first = &finished(run).frames[0];
    assert_eq!(first.contact_normal_force_n, [0.0; 2]);
    let [a, b] = [0, 1].map(|filament| {
        let [root, next] = [0, 1].map(|node| first.nodes_m[filament][node].map(f64::from));
        let [x, y, z] = [0, 1, 2].map(|i| next[i] - root[i]);
        z.atan2(x.hypot(y))
    });
    (a - b) * settings.filament.length_m
        - (0.5 * settings.tool.width_m - settings.filament.diameter_m)
}

/// Cantilevers whose tips hold each other apart press with `3 E I/l³` times half of their overlap.
#[test]
fn tilted_filaments_lean_on_each_other_as_cantilevers_do() {
    for seed in [23, 26, 65] {
        let settings = two(seed);
        let depth = depth(&settings);
        assert!((5e-4..7e-4).contains(&depth), "{seed}: {depth}");
        let filament = &settings.filament;
        let stiffness =
            3.0 * filament.youngs_modulus_pa * TAU / 128.0 * filament.diameter_m.powi(4);
        let expected = 0.5 * depth * stiffness / filament.length_m.powi(3);
        let result = simulated(&settings);
        let before = result
            .history
            .iter()
            .take_while(|sample| sample.touching_filaments == 0);
        let ratios: Vec<f64> = before
            .map(|sample| sample.press_force_n / expected)
            .collect();
        assert!(ratios.len() > 1, "it begins before it touches");
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((mean - 1.0).abs() < 0.02, "{seed}: {mean}");
        // The filaments vibrate about the mean with a speed that counts as rest.
        assert!(
            ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.15),
            "{seed}: {ratios:?}"
        );
    }
}

#[test]
fn filaments_that_are_apart_do_not_settle_and_others_resume_while_they_do() {
    let [apart, settings] = [two(1), two(5)];
    assert!(depth(&apart) < 0.0 && depth(&settings) > 2e-4);
    let apart = BrushRun::new(&apart, RunOptions::default()).expect("a brush");
    assert_eq!(apart.done(), 0.0);
    let mut run = BrushRun::new(&settings, RunOptions::default()).expect("a brush");
    for _ in 0..3 {
        assert!(run.advance().expect("a rung"));
    }
    assert!(run.done() > 0.0);
    let again = BrushRun::resume(&settings, RunOptions::default(), run.checkpoint())
        .expect("the state is its own");
    assert_eq!(again.done(), run.done());
    assert!(finished(run) == finished(again));
}
