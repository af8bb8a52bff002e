//! Is it right? Rows of filaments that touch, compared with independent codes: `derivations/reference_row.py` states them again in the
//! plane, differentiates the energy of their contact, and integrates them with CVODES; `benches/peers/trajectories.py` builds them of
//! rigid bodies and contacts in MuJoCo.

use std::f64::consts::TAU;

use bristle::brush::{PressLaw, RowError, RowResult, RowSettings, simulate_row};
use bristle::model::metrics::Metrics;
use bristle::model::settings::{ContactSettings, FilamentSettings, ProcessSettings, Settings, ToolSettings, Turns};
use bristle::simulation::{Pass, simulate};
use serde::Deserialize;

use crate::common::data;

/// A case of `tests/data/reference_row.json`.
#[derive(Deserialize)]
struct Reference {
    name: String,
    input: Input,
    friction_at: Option<String>,
    filaments: Vec<Filament>,
}

#[derive(Deserialize)]
struct Input {
    tool: ToolSettings,
    filament: FilamentSettings,
    contact: ContactSettings,
    brush: Brush,
    process: ProcessSettings,
}

#[derive(Deserialize)]
struct Brush {
    columns: usize,
    stiffness_n_m2: f64,
    contact_points: usize,
    damping_s_m: f64,
    friction_coefficient: f64,
}

#[derive(Deserialize)]
struct Filament {
    contact_normal_impulse_n_s: f64,
    contact_impulse_x_n_s: f64,
    friction_work_j: f64,
    contact_time_s: f64,
    max_tip_deflection_m: f64,
}

#[derive(Deserialize)]
struct References {
    cases: Vec<Reference>,
}

impl Input {
    fn settings(&self) -> Settings {
        let settings = Settings::new(self.tool.clone(), self.filament.clone(), self.process.clone());
        Settings { contact: self.contact.clone(), ..settings }
    }

    /// The row, in steps in which the tips go `step` (m).
    fn simulate(&self, step: f64, newton_tolerance: f64) -> RowResult {
        let settings = self.settings();
        let law = PressLaw {
            stiffness: self.brush.stiffness_n_m2,
            damping: self.brush.damping_s_m,
            friction: self.brush.friction_coefficient,
            ..PressLaw::of(&settings)
        };
        let row = RowSettings {
            columns: self.brush.columns,
            pitch: TAU / self.tool.filament_count,
            law,
            points: self.brush.contact_points,
            step,
            newton_tolerance,
        };
        simulate_row(&Pass::new(&settings), &row).expect("a row that can be simulated")
    }
}

impl Filament {
    /// The errors of `metrics`, relative to a scale that fits each.
    fn errors(&self, metrics: &Metrics) -> [f64; 5] {
        let impulse = self.contact_normal_impulse_n_s;
        let relative = |value: f64, expected: f64, scale: f64| ((value - expected) / scale).abs();
        [
            relative(metrics.contact_normal_impulse_n_s, impulse, impulse),
            relative(metrics.contact_impulse_x_n_s, self.contact_impulse_x_n_s, impulse),
            relative(metrics.friction_work_j, self.friction_work_j, impulse * 10.0),
            relative(metrics.max_tip_deflection_m, self.max_tip_deflection_m, 0.04),
            0.1 * relative(metrics.contact_time_s, self.contact_time_s, self.contact_time_s),
        ]
    }
}

fn references_of(file: &str) -> Vec<Reference> {
    let References { cases } = serde_json::from_str(&data(file)).expect("cases");
    cases
}

fn references() -> Vec<Reference> {
    let cases = references_of("reference_row.json");
    assert!(cases.len() >= 18);
    cases
}

#[test]
fn rows_are_those_of_an_independent_code() {
    // Other columns bounce so often that the reference itself is known to 1e-6 only, and short steps do not resolve each impact.
    let tolerance = |case: &Reference| if case.name.contains("Hertz") { 5e-3 } else { 1e-3 };
    for case in references().iter().filter(|case| case.friction_at.as_deref() != Some("centrelines")) {
        let result = case.input.simulate(1e-5, 1e-6);
        for (column, (metrics, expected)) in result.metrics.iter().zip(&case.filaments).enumerate() {
            let errors = expected.errors(metrics);
            let name = (&case.name, case.input.process.brushing_velocity_m_s, column);
            assert!(errors.iter().all(|error| *error < tolerance(case)), "{name:?}: {errors:?}");
        }
    }
}

#[test]
fn rows_are_those_of_mujoco() {
    let cases = references_of("reference_row_mujoco.json");
    assert_eq!(cases.len(), 3);
    for case in &cases {
        let result = case.input.simulate(1e-5, 1e-6);
        let pairs: Vec<_> = result.metrics.iter().zip(&case.filaments).collect();
        let sum = |of: &dyn Fn(&(&Metrics, &Filament)) -> f64| pairs.iter().map(of).sum::<f64>();
        let computed = sum(&|(metrics, _)| metrics.contact_normal_impulse_n_s);
        let expected = sum(&|(_, filament)| filament.contact_normal_impulse_n_s);
        let errors: Vec<_> = pairs.iter().map(|(metrics, expected)| expected.errors(metrics)).collect();
        let largest = errors.iter().flatten().copied().fold(0.0, f64::max);
        // Capsules touch at one point, where lines press on each other: that moves force from filament to filament, and hardly changes
        // the mean.
        let [mean_tolerance, tolerance] = match case.name.as_str() {
            "points" => [5e-4, 5e-4],
            "capsules" => [2e-2, 0.1],
            _ => [1e-3, 5e-3],
        };
        let mean = (computed / expected - 1.0).abs();
        assert!(mean < mean_tolerance && largest < tolerance, "{}: {mean}, {errors:?}", case.name);
    }
}

#[test]
fn rows_converge_with_the_step() {
    let cases = references();
    let case = cases.iter().find(|case| case.name == "three").expect("a row of three");
    let error = |step: f64| {
        let result = case.input.simulate(step, 1e-7);
        let errors = result.metrics.iter().zip(&case.filaments).map(|(metrics, expected)| {
            (metrics.contact_normal_impulse_n_s / expected.contact_normal_impulse_n_s - 1.0).abs()
        });
        errors.fold(0.0, f64::max)
    };
    let errors = [2e-4, 2e-5, 2e-6].map(error);
    let [coarse, fine, finest] = errors;
    // Impacts begin and end within steps, so that the error falls unevenly.
    assert!(coarse < 2e-3 && fine < coarse && finest < 5e-5, "{errors:?}");
}

#[test]
fn filaments_too_far_apart_to_touch_are_those_of_single_passes() {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 10;
    let alone = simulate(&settings).expect("a pass").metrics;
    let row = RowSettings {
        columns: 3,
        pitch: TAU / 150.0,
        law: PressLaw::of(&settings),
        points: 4,
        step: 2e-5,
        newton_tolerance: 1e-6,
    };
    let result = simulate_row(&Pass::new(&settings), &row).expect("a row");
    for metrics in &result.metrics {
        let ratio = metrics.contact_normal_impulse_n_s / alone.contact_normal_impulse_n_s;
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
        assert_eq!(metrics.contact_count, alone.contact_count);
    }
    assert_eq!(result.effort.krylov_vectors, 0);
}

#[test]
fn the_work_of_a_row_has_not_changed() {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 10;
    let row = RowSettings {
        columns: 12,
        pitch: TAU / 682.0,
        law: PressLaw::of(&settings),
        points: 4,
        step: 2e-4,
        newton_tolerance: 3e-4,
    };
    let result = simulate_row(&Pass::new(&settings), &row).expect("a row");
    assert_eq!(result.halved_steps, 0);
    let per_stage = result.effort.newton_iterations as f64 / (2 * result.steps) as f64;
    let vectors = result.effort.krylov_vectors as f64 / result.effort.newton_iterations as f64;
    assert!(per_stage > 1.5 && per_stage < 4.0, "{per_stage} iterations a stage");
    assert!(vectors > 0.2 && vectors < 5.0, "{vectors} vectors an iteration");
}

#[test]
fn rows_that_cannot_be_simulated_are_refused() {
    let row = |settings: &Settings, columns: f64| {
        let row = RowSettings {
            columns: 2,
            pitch: TAU / columns,
            law: PressLaw::of(settings),
            points: 2,
            step: 2e-4,
            newton_tolerance: 3e-4,
        };
        simulate_row(&Pass::new(settings), &row).expect_err("it is refused")
    };
    let settings = Settings::paper(10.0, 1e-3);
    let error = row(&settings, 800.0);
    assert!(matches!(error, RowError::Overlap { .. }) && error.to_string().contains("apart"), "{error}");
    let mut tilted = settings.clone();
    tilted.filament.lateral_tilt_rad = 1e-3;
    assert_eq!(row(&tilted, 682.0), RowError::NotPlanar);
    let mut turning = settings;
    turning.process.turns = Turns::Count(2);
    assert_eq!(row(&turning, 682.0), RowError::Turns);
}
