//! Brushes that must have the results of others: in other units, mirrored, shifted, resumed, on more
//! threads, or so far apart that they are single filaments.

use bristle::brush::{BrushError, BrushRun, RunOptions, simulate_brush};
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::{Ends, Pattern, ProcessSettings, Settings, Side, ToolSettings};
use bristle::simulation::simulate;

use super::{finished, impulses, leaning, row, rubbing, simulated};
use crate::common::{edge, metric, with};

/// Scales lengths and times by 2^k, masses by 8^k: nothing in the solver is an absolute number.
#[test]
fn a_brush_in_other_units_has_the_same_bits() {
    let scaled = |settings: &Settings, k: i32| {
        let (mut settings, factor) = (settings.clone(), 2.0_f64.powi(k));
        let Settings {
            tool,
            filament,
            contact,
            process,
            ..
        } = &mut settings;
        for length in [
            &mut tool.body_radius_m,
            &mut tool.width_m,
            &mut filament.length_m,
            &mut filament.diameter_m,
            &mut process.penetration_depth_m,
            &mut contact.stiffness_n_m,
        ] {
            *length *= factor;
        }
        settings
    };
    for settings in [rubbing(), leaning()] {
        let found = [0, 4, -4, 9].map(|k| {
            let result = simulated(&scaled(&settings, k));
            let unit = 8.0_f64.powi(k);
            let impulses: Vec<f64> = impulses(&result).iter().map(|of| of / unit).collect();
            (impulses, result.statistics, result.impulse_error_estimate)
        });
        assert!(found.iter().all(|of| *of == found[0]), "{found:?}");
    }
}

/// Compares a row whose filaments lean so far that they touch their periodic images with three
/// equal rows. Damping keeps the rows from swaying apart.
#[test]
fn a_filament_meets_its_own_periodic_image() {
    let [one, three] = [1, 3].map(|rows| {
        let mut settings = with(&row(5, 300.0 * rows as f64, 2), |brush| {
            (brush.rows, brush.pattern) = (Some(rows), Pattern::Aligned);
            brush.tolerance = 1e-3;
        });
        settings.tool.width_m = 1.205e-3 * rows as f64;
        (
            settings.filament.lateral_tilt_rad,
            settings.filament.damping_ratio,
        ) = (0.2, 0.5);
        settings.process = ProcessSettings::new(20.0, 9e-4);
        simulated(&settings)
    });
    for (found, expected) in one.filaments.iter().zip(three.filaments.iter().step_by(3)) {
        let impulses = [found, expected].map(|of| of.metrics.contact_normal_impulse_n_s);
        let presses = [found, expected].map(|of| of.press_impulse_n_s);
        assert!(presses[0] > 10.0 * impulses[0]);
        for [found, expected] in [impulses, presses] {
            assert!((found / expected - 1.0).abs() < 2e-4, "{found} {expected}");
        }
    }
}

#[test]
fn filaments_too_far_apart_to_touch_are_those_of_single_passes() {
    let mut settings = with(&row(10, 150.0, 3), |brush| brush.tolerance = 3e-5);
    settings.contact.friction_coefficient = 0.2;
    let alone = simulate(&settings).expect("a pass").metrics;
    let result = simulated(&settings);
    for filament in &result.filaments {
        for key in [
            "max_tip_deflection_m",
            "peak_contact_normal_force_n",
            "contact_time_s",
            "friction_work_j",
        ] {
            let ratio = metric(&filament.metrics, key) / metric(&alone, key);
            assert!((ratio - 1.0).abs() < 1e-3, "{key}: {ratio}");
        }
        let ratio = filament.metrics.contact_normal_impulse_n_s / alone.contact_normal_impulse_n_s;
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
        assert_eq!(filament.metrics.contact_count, alone.contact_count);
    }
    assert_eq!(result.statistics.effort.krylov_vectors, 0);
    assert!(result.pairs.is_empty() && (result.interaction_factor - 1.0).abs() < 1e-4);
}

#[test]
fn one_filament_on_an_edge_has_the_metrics_of_a_pass() {
    let mut settings = with(&row(6, 682.0, 1), |brush| brush.tolerance = 1e-4);
    settings.contact.friction_coefficient = 0.3;
    settings.workpiece.kind = edge(Side::Entering, 0.0, 1e-3);
    let alone = simulate(&settings).expect("a pass").metrics;
    let result = simulated(&settings);
    assert!(alone.edge_share > 0.2 && alone.edge_evenness > 0.1);
    for column in Metrics::COLUMNS {
        // A brush does not have these metrics.
        let tolerance = match column.key {
            "lateral_amplification" | "laterally_unstable" | "energy_residual" => continue,
            "edge_evenness" | "max_edge_penetration_m" | "peak_contact_normal_force_n" => 3e-2,
            _ => 2e-3,
        };
        let [found, expected] = [&result.tool, &alone].map(|metrics| column.get(metrics));
        assert!(
            (found - expected).abs() <= tolerance * expected.abs(),
            "{}: {found} {expected}",
            column.key
        );
    }
}

#[test]
fn results_depend_neither_on_threads_nor_on_where_a_run_was_stopped() {
    let settings = with(&row(4, 682.0 * 3.0, 9), |brush| {
        brush.rows = Some(3);
        brush.lateral_tilt_std_rad = 2e-3;
        brush.friction_coefficient = 0.2;
        // Equal bits need no short steps.
        brush.tolerance = 1e-2;
    });
    let settings = Settings {
        tool: ToolSettings {
            width_m: 3.6e-3,
            ..settings.tool.clone()
        },
        ..settings
    };
    let expected = simulated(&settings);
    assert_eq!(simulate_brush(&settings, 3).expect("a brush"), expected);
    let options = RunOptions {
        frames: 4,
        ..RunOptions::default()
    };
    let mut run = BrushRun::new(&settings, options).expect("a brush");
    while run.done() < 0.6 {
        assert!(run.advance().expect("steps"));
    }
    let state = run.checkpoint();
    let resumed = BrushRun::resume(&settings, options, state.clone()).expect("a state");
    let [whole, resumed] = [run, resumed].map(finished);
    assert!(whole.frames.len() > 2 && whole.pairs.len() > 15);
    assert_eq!(resumed, whole);
    assert_eq!(impulses(&whole), impulses(&expected));
    let other = row(5, 682.0, 9);
    let error = BrushRun::resume(&other, options, state).err();
    assert_eq!(error, Some(BrushError::Checkpoint));
}

#[test]
fn mirrored_and_shifted_sectors_are_the_same() {
    // Eight columns throw each other about until the error of Newton's method shows in single
    // filaments.
    let base = with(&row(5, 682.0 * 3.0, 3), |brush| {
        brush.rows = Some(3);
        brush.ends = Ends::Free;
        brush.tolerance = 1e-4;
    });
    let tilted = |tilt: f64| {
        let mut settings = base.clone();
        settings.tool.width_m = 3.9e-3;
        settings.filament.lateral_tilt_rad = tilt;
        simulated(&settings)
    };
    let (one, mirrored) = (tilted(0.02), tilted(-0.02));
    for filament in &one.filaments {
        let image = mirrored
            .filaments
            .iter()
            .find(|other| (other.column, other.row) == (filament.column, 2 - filament.row));
        let image = image.expect("the same filament on the other side");
        let [a, b] = [filament, image].map(|filament| filament.metrics.contact_normal_impulse_n_s);
        assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
    }
    let [a, b] = [one, mirrored].map(|result| result.tool.contact_normal_impulse_n_s);
    assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
}

#[test]
fn rows_that_are_far_apart_are_single_rows() {
    let single = simulated(&with(&row(5, 682.0, 6), |brush| brush.tolerance = 1e-3));
    let three = with(&row(5, 682.0 * 3.0, 6), |brush| {
        (brush.rows, brush.pattern) = (Some(3), Pattern::Aligned);
        brush.tolerance = 1e-3;
    });
    let planar = simulated(&three);
    // Rows of equal filaments are simulated once.
    assert_eq!(planar.statistics, single.statistics);
    let spatial = Settings {
        process: ProcessSettings {
            gravity_m_s2: [0.0, 0.0, 1e-9],
            ..three.process.clone()
        },
        ..three
    };
    let spatial = simulated(&spatial);
    for (column, impulse) in impulses(&single).into_iter().enumerate() {
        for row in 0..3 {
            assert_eq!(impulses(&planar)[3 * column + row], impulse);
            let ratio = impulses(&spatial)[3 * column + row] / impulse;
            assert!((ratio - 1.0).abs() < 2e-3, "column {column}: {ratio}");
        }
    }
}

#[test]
fn a_whole_row_is_a_ring() {
    let result = simulated(&with(&row(2, 40.0, 40), |brush| brush.tolerance = 1e-4));
    let impulses = impulses(&result);
    for impulse in &impulses {
        assert!((impulse / impulses[0] - 1.0).abs() < 2e-2, "{impulses:?}");
    }
}
