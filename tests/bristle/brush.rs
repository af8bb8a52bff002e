//! Is it right? Rows of filaments that touch, compared with an independent code:
//! `derivations/passes.py row` states them again in the plane, differentiates the energy of
//! their contact, and integrates them with CVODES. `tests/validation` compares them with
//! MuJoCo, too.

use std::f64::consts::TAU;

use bristle::brush::{
    BrushError, BrushResult, BrushRun, BrushStatistics, FilamentResult, RunOptions, Stretch,
    simulate_brush,
};
use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::{
    BrushSettings, Ends, FilamentSettings, Hold, Pattern, ProcessSettings, RoundSettings, Settings,
    Side, ToolSettings, Turns, WorkpieceKind,
};
use bristle::simulation::simulate;
use serde::Deserialize;

use crate::common::{Stated, cases, difference, edge, metric, number, with};

/// A case of `tests/data/reference_row.json`.
#[derive(Deserialize)]
struct RowReference {
    name: String,
    input: Settings,
    friction_at: Option<String>,
    /// Metrics of each filament.
    filaments: Vec<Stated>,
    /// Pairs of columns with the impulse between them.
    #[serde(default)]
    neighbours: Vec<Neighbours>,
}

#[derive(Deserialize)]
struct Neighbours {
    columns: [usize; 2],
    normal_impulse_n_s: f64,
}

/// The errors of the metrics of a filament, relative to a scale that fits each.
fn errors(metrics: &Metrics, stated: &Stated) -> [f64; 5] {
    let impulse = number(stated, "contact_normal_impulse_n_s");
    [
        ("contact_normal_impulse_n_s", impulse),
        ("contact_impulse_x_n_s", impulse),
        // There is no friction work without friction.
        (
            "friction_work_j",
            number(stated, "friction_work_j").max(f64::MIN_POSITIVE),
        ),
        (
            "max_tip_deflection_m",
            number(stated, "max_tip_deflection_m"),
        ),
        ("contact_time_s", 10.0 * number(stated, "contact_time_s")),
    ]
    .map(|(key, scale)| difference(metrics, stated, key, scale).1)
}

/// The result of a brush, on one thread.
fn simulated(settings: &Settings) -> BrushResult {
    simulate_brush(settings, 1).expect("a brush")
}

/// Advances a run to its end and returns the result.
fn finished(mut run: BrushRun) -> BrushResult {
    while run.advance().expect("a step") {}
    run.finish().expect("a result")
}

fn references() -> Vec<RowReference> {
    let cases = cases("reference_row.json");
    assert!(cases.len() >= 18);
    cases
}

/// A row of `columns` columns of the paper's brush with `around` filaments around.
fn row(segments: usize, around: f64, columns: usize) -> Settings {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = segments;
    settings.tool.filament_count = around;
    let brush = BrushSettings {
        columns: Some(columns),
        rows: Some(1),
        steady: false,
        ..BrushSettings::default()
    };
    Settings {
        brush: Some(brush),
        ..settings
    }
}

fn impulses(result: &BrushResult) -> Vec<f64> {
    result
        .filaments
        .iter()
        .map(|filament| filament.metrics.contact_normal_impulse_n_s)
        .collect()
}

#[test]
fn rows_are_those_of_an_independent_code() {
    // Some columns bounce so often that the reference itself is known to 1e-6 only, and short steps
    // do not resolve each impact. Rounding and step decide about some bounces: one bounce less
    // changes the impulse between two filaments by 6e-3 of the whole.
    let tolerances = |case: &RowReference| {
        if case.name.contains("Hertz") {
            [5e-3, 1e-2]
        } else {
            [1e-3; 2]
        }
    };
    for case in references()
        .iter()
        .filter(|case| case.friction_at.as_deref() != Some("centrelines"))
    {
        let [of_filament, of_pair] = tolerances(case);
        let result = simulated(&with(&case.input, |brush| brush.tolerance = 1e-4));
        for (column, (filament, expected)) in
            result.filaments.iter().zip(&case.filaments).enumerate()
        {
            let errors = errors(&filament.metrics, expected);
            let name = (&case.name, case.input.process.brushing_velocity_m_s, column);
            assert!(
                errors.iter().all(|error| *error < of_filament),
                "{name:?}: {errors:?}"
            );
        }
        let whole: f64 = case
            .neighbours
            .iter()
            .map(|pair| pair.normal_impulse_n_s)
            .sum();
        for pair in &case.neighbours {
            let found = result
                .pairs
                .iter()
                .find(|found| [found.filament[0], found.other[0]] == pair.columns)
                .map_or(0.0, |found| found.impulse_n_s);
            let error = (found - pair.normal_impulse_n_s).abs();
            // Filaments that do not touch must not press at all.
            assert!(
                error <= of_pair * whole,
                "{}, {:?}: {found}",
                case.name,
                pair.columns
            );
        }
    }
}

#[test]
fn rows_converge_with_the_tolerance() {
    let cases = references();
    let case = cases
        .iter()
        .find(|case| case.name == "three")
        .expect("a row of three");
    let error = |tolerance: f64| {
        let result = simulated(&with(&case.input, |brush| brush.tolerance = tolerance));
        let errors = impulses(&result).into_iter().zip(&case.filaments);
        errors
            .map(|(found, case)| (found / number(case, "contact_normal_impulse_n_s") - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let errors = [1e-3, 3e-5, 1e-6].map(error);
    let [coarse, fine, finest] = errors;
    // Impacts begin and end within steps, so that the error falls unevenly.
    assert!(
        coarse < 2e-3 && fine < coarse && finest < 5e-5,
        "{errors:?}"
    );
}

/// Three wavy wires that throw each other about.
fn wavy_wires() -> Settings {
    let mut settings = row(2, 1045.0, 3);
    settings.tool = ToolSettings::new(0.0356, 0.000214, 1045.0);
    settings.filament = FilamentSettings {
        segments: 2,
        waviness_amplitude_m: -0.00032,
        waviness_length_m: Some(0.0174),
        waviness_phase_rad: 1.78,
        density_kg_m3: 8500.0,
        youngs_modulus_pa: 1e11,
        damping_ratio: 0.0178,
        ..FilamentSettings::new(0.01646, 0.000153)
    };
    settings.contact.stiffness_n_m = 9.15e5;
    settings.workpiece.kind = WorkpieceKind::Cylinder(RoundSettings {
        offset_m: 0.000458,
        radius_m: 0.458,
    });
    settings.process = ProcessSettings::new(3.79, 0.000132);
    settings
}

/// A row with friction on itself and on the workpiece.
fn rubbing() -> Settings {
    let mut settings = with(&row(8, 300.0, 16), |brush| brush.friction_coefficient = 0.2);
    settings.process = ProcessSettings::new(4.594, 5.152e-4);
    settings.contact.friction_coefficient = 0.1;
    settings
}

/// Filaments that lean on their periodic images and on each other.
fn leaning() -> Settings {
    let mut settings = with(&row(6, 680.0, 4), |brush| brush.lateral_tilt_std_rad = 2e-3);
    settings.tool.width_m = 1.3e-3;
    settings.process = ProcessSettings::new(5.0, 2e-3);
    settings
}

#[test]
fn error_estimates_cover_true_errors() {
    for settings in [row(8, 682.0, 12), rubbing(), wavy_wires(), leaning()] {
        let result = simulated(&settings);
        let exact = simulated(&with(&settings, |brush| brush.tolerance *= 1e-2));
        let [found, expected] = [&result, &exact].map(|of| of.tool.contact_normal_impulse_n_s);
        let (error, stretch) = ((found / expected - 1.0).abs(), result.stretch);
        let estimate = result.impulse_error_estimate;
        let of_steps = (estimate.powi(2) - stretch.standard_error.powi(2)).sqrt();
        assert!(
            error < 1e-3 && error <= 2.0 * of_steps,
            "{error} {of_steps}"
        );
        // Estimates are bounds, which the tolerance limits.
        let tolerance = settings.brush_or_default().tolerance;
        assert!(of_steps <= 3.0 * tolerance, "{of_steps}");
    }
}

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
fn the_work_of_a_row_has_not_changed() {
    let result = simulated(&row(10, 682.0, 12));
    let BrushStatistics {
        steps,
        rejected_steps,
        newton_failures,
        ..
    } = result.statistics;
    assert!(
        rejected_steps < steps / 3 && newton_failures < steps / 50,
        "{rejected_steps} and {newton_failures} of {steps} steps are repeated"
    );
    let effort = result.statistics.effort;
    let per_stage = effort.newton_iterations as f64 / (2 * result.statistics.steps) as f64;
    let vectors = effort.krylov_vectors as f64 / effort.newton_iterations as f64;
    assert!(
        per_stage > 1.5 && per_stage < 4.0,
        "{per_stage} iterations a stage"
    );
    assert!(
        vectors > 0.2 && vectors < 5.0,
        "{vectors} vectors an iteration"
    );
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
fn energies_balance_and_neighbours_oppose_each_other() {
    let mut settings = with(&row(5, 682.0, 6), |brush| {
        brush.tolerance = 3e-6;
        (brush.damping_s_m, brush.friction_coefficient) = (0.5, 0.3);
    });
    settings.contact.friction_coefficient = 0.3;
    let result = simulated(&settings);
    let balance = result.energies;
    let defect = balance.gain_j - balance.work_j + balance.dissipated_j;
    assert!(
        defect.abs() < 1e-4 * balance.work_j.abs().max(balance.dissipated_j),
        "{balance:?}"
    );
    assert!(
        result.residuals.energy < 1e-4 && result.residuals.momentum < 1e-5,
        "{:?}",
        result.residuals
    );
    let pair = result
        .pairs
        .iter()
        .find(|pair| (pair.filament, pair.other) == ([0, 0], [1, 0]))
        .expect("a pair");
    assert!(pair.vector_impulse_n_s[0].abs() > 0.1 * pair.impulse_n_s && pair.dissipated_j > 0.0);
}

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
fn a_brush_is_compared_with_its_own_filaments_alone() {
    let mut settings = with(&row(6, 120.0, 6), |brush| brush.lateral_tilt_std_rad = 0.05);
    settings.uncertainty.length_std_m = 3e-4;
    settings.uncertainty.hold = Hold::Machine;
    // Filaments too far apart to touch are alone in the brush, too.
    let result = simulated(&settings);
    assert!(
        result.pairs.is_empty() && (result.interaction_factor - 1.0).abs() < 2e-3,
        "{}",
        result.interaction_factor
    );
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

#[test]
fn a_whole_row_is_a_ring() {
    let result = simulated(&with(&row(2, 40.0, 40), |brush| brush.tolerance = 1e-4));
    let impulses = impulses(&result);
    for impulse in &impulses {
        assert!((impulse / impulses[0] - 1.0).abs() < 2e-2, "{impulses:?}");
    }
}

#[test]
fn steady_turns_of_a_brush_go_on_until_they_are() {
    let mut settings = with(&row(10, 600.0, 1), |brush| brush.tolerance = 3e-4);
    settings.process.brushing_velocity_m_s = 30.0;
    settings.process.turns = Some(Turns::Steady);
    let brush = simulated(&settings);
    let impulses = &brush.turn_contact_normal_impulses_n_s;
    // MODEL, "Turns".
    for (found, expected) in impulses.iter().zip([1.64e-3, 3.04e-3, 3.58e-3, 3.69e-3]) {
        assert!((found - expected).abs() < 6e-6, "{impulses:?}");
    }
    let [.., before, last] = impulses[..] else {
        panic!("{impulses:?}")
    };
    assert!(impulses.len() > 4 && (last / before - 1.0).abs() < 1e-3 && !brush.tool.unsteady_turns);
    assert_eq!(
        (brush.tool.turns, brush.tool.contact_normal_impulse_n_s),
        (impulses.len(), last)
    );
    assert!(
        (brush.interaction_factor - 1.0).abs() < 1e-3,
        "{}",
        brush.interaction_factor
    );
}

#[test]
fn the_steady_stretch_is_where_impulses_no_longer_change() {
    let settings = with(&row(5, 682.0, 20), |brush| brush.steady = true);
    let error = simulate_brush(&settings, 1).expect_err("too few columns");
    let BrushError::TooFewColumns {
        columns: 20,
        needed,
        ..
    } = error
    else {
        panic!("{error}")
    };
    assert!(
        error
            .to_string()
            .contains(&format!("`brush.columns` to {needed}")),
        "{error}"
    );
    // Where no stretch could be long enough, nothing is simulated.
    let error = simulate_brush(&with(&settings, |brush| brush.columns = Some(1)), 1)
        .expect_err("too few columns");
    assert!(
        matches!(
            error,
            BrushError::TooFewColumns {
                columns: 1,
                change: None,
                ..
            }
        ),
        "{error}"
    );
    // The stated number of columns is enough, and so is the default number.
    let stated = simulated(&with(&settings, |brush| brush.columns = Some(needed)));
    let default = simulated(&with(&settings, |brush| brush.columns = None));
    let longer = simulated(&with(&settings, |brush| brush.columns = Some(2 * needed)));
    for result in [stated, default] {
        let [a, b] = [&result, &longer].map(|result| result.tool.contact_normal_impulse_n_s);
        assert!(
            (a / b - 1.0).abs() < 3e-3,
            "{a} {b} {:?} {:?}",
            result.stretch,
            longer.stretch
        );
        assert!(result.stretch.standard_error < 2e-3 && result.stretch.first > 3);
    }
}

#[test]
fn a_row_ends_once_its_stretch_has_settled() {
    let settings = with(&row(5, 682.0, 0), |brush| {
        (brush.columns, brush.steady) = (None, true)
    });
    let options = RunOptions {
        frames: 20,
        ..RunOptions::default()
    };
    let mut run = BrushRun::new(&settings, options).expect("a row");
    let laid_out = run.columns();
    let mut states = vec![run.checkpoint()];
    while run.advance().expect("steps") {
        states.push(run.checkpoint());
    }
    let result = run.finish().expect("results");
    let Stretch {
        first,
        last,
        standard_error,
    } = result.stretch;
    assert!(
        result.columns < laid_out && last < result.columns - 1 && last + 1 - first >= 16,
        "{:?}",
        result.stretch
    );
    assert!(standard_error <= 5e-4 && result.impulse_error_estimate < 5e-3);
    assert_eq!(result.filaments.len(), result.columns);
    assert!(
        result
            .frames
            .iter()
            .all(|frame| frame.nodes_m.len() == result.columns)
    );
    // All that has touched is there, also behind the stretch.
    for frame in &result.frames {
        let sample = result
            .history
            .iter()
            .find(|sample| sample.time_s == frame.time_s)
            .expect("a sample of each frame");
        let sum = |forces: &[f32]| forces.iter().map(|force| f64::from(*force)).sum::<f64>();
        let (contact, press) = (
            sum(&frame.contact_normal_force_n),
            0.5 * sum(&frame.press_force_n),
        );
        assert!(
            (contact - sample.contact_normal_force_n).abs() <= 1e-6 * sample.contact_normal_force_n,
            "{sample:?}"
        );
        assert!(
            (press - sample.press_force_n).abs() <= 1e-6 * sample.press_force_n,
            "{sample:?}"
        );
    }
    assert!(
        result
            .pairs
            .iter()
            .all(|pair| pair.filament[0].max(pair.other[0]) < result.columns)
    );
    // The tolerance is that of the mean impulse.
    let longer = simulated(&with(&settings, |brush| brush.columns = Some(200)));
    let [a, b] = [&result, &longer].map(|result| result.tool.contact_normal_impulse_n_s);
    assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
    // A run resumes from any state, also from a settled one with columns that still sleep.
    for state in [
        &states[1],
        &states[states.len() / 2],
        &states[states.len() - 1],
    ] {
        let resumed = BrushRun::resume(&settings, options, state.clone()).expect("a state");
        assert_eq!(finished(resumed), result);
    }
}

#[test]
fn brushes_that_cannot_be_simulated_are_refused() {
    let refused = |settings: &Settings| simulate_brush(settings, 1).expect_err("it is refused");
    let error = refused(&row(5, 800.0, 2));
    assert!(
        matches!(error, BrushError::Overlap { .. }) && error.to_string().contains("overlap"),
        "{error}"
    );
    let error = refused(&row(5, 600.0, 601));
    assert_eq!(
        error,
        BrushError::TooManyColumns {
            columns: 601,
            around: 600
        }
    );
    let options = RunOptions {
        memory: Some(1 << 20),
        ..RunOptions::default()
    };
    let error = BrushRun::new(&row(400, 682.0, 600), options)
        .err()
        .expect("it is refused");
    assert!(
        matches!(error, BrushError::Memory { filaments: 600, .. }),
        "{error}"
    );
    assert_eq!(
        refused(&row(5, 0.0, 1)),
        BrushError::TooManyColumns {
            columns: 1,
            around: 0
        }
    );
    // This contact is so soft that filaments go through each other.
    let error = refused(&with(&row(8, 682.0, 20), |brush| {
        brush.stiffness_n_m2 = 1e2
    }));
    assert!(matches!(error, BrushError::Crossing { .. }), "{error}");
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

/// Filaments that touch wherever they begin are refused, as a filament alone is.
#[test]
fn a_brush_inside_the_workpiece_is_refused() {
    let mut settings = row(5, 682.0, 4);
    settings.contact.radius_m = 0.4;
    let error = BrushRun::new(&settings, RunOptions::default()).err();
    let message = error.map(|error| error.to_string()).unwrap_or_default();
    assert!(message.contains("start inside the workpiece"), "{message}");
}
