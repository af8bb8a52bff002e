//! Is it right? Rows of filaments that touch, compared with an independent code:
//! `derivations/passes.py row` states them again in the plane, differentiates the energy of
//! their contact, and integrates them with CVODES. `tests/validation` compares them with
//! MuJoCo, too.

mod invariance;
mod roots;
mod settling;
mod steadiness;

use bristle::brush::{
    BrushError, BrushResult, BrushRun, BrushStatistics, RunOptions, simulate_brush,
};
use bristle::model::metrics::Metrics;
use bristle::model::settings::{
    BrushSettings, FilamentSettings, Hold, ProcessSettings, RoundSettings, Settings, ToolSettings,
    WorkpieceKind,
};
use serde::Deserialize;

use crate::common::{Stated, cases, difference, number, with};

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

/// Filaments that touch wherever they begin are refused, as a filament alone is.
#[test]
fn a_brush_inside_the_workpiece_is_refused() {
    let mut settings = row(5, 682.0, 4);
    settings.contact.radius_m = 0.4;
    let error = BrushRun::new(&settings, RunOptions::default()).err();
    let message = error.map(|error| error.to_string()).unwrap_or_default();
    assert!(message.contains("start inside the workpiece"), "{message}");
}
