//! Is it right? One and two filaments in space that touch the workpiece and each other, with friction, compared with an independent
//! code: `derivations/reference_space.py` states them again, and integrates them with CVODES.

use bristle::brush::simulate_brush;
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::simulate;
use serde::Deserialize;

use crate::common::{cases, with};

/// Of a brush, which takes fixed steps that impacts do not cut, at the tolerance of [`BRUSH_TOLERANCE`]; impulses over `p_n`, or over the
/// impulse between the filaments, work relative to itself.
const BRUSH: f64 = 1e-3;
const BRUSH_TOLERANCE: f64 = 1e-4;
/// Of a single pass at 1e-9, beyond the error that the reference states.
const PASS: f64 = 5e-6;

/// A case of `tests/data/reference_space.json`.
#[derive(Deserialize)]
struct Reference {
    name: String,
    input: Settings,
    filaments: Vec<OfFilament>,
    neighbours: Vec<OfPair>,
    own_errors: OwnErrors,
}

#[derive(Deserialize)]
struct OwnErrors {
    filaments: f64,
    neighbours: f64,
}

#[derive(Deserialize)]
struct OfFilament {
    contact_normal_impulse_n_s: f64,
    contact_impulse_x_n_s: f64,
    contact_impulse_y_n_s: f64,
    contact_impulse_z_n_s: f64,
    friction_work_j: f64,
}

#[derive(Deserialize)]
struct OfPair {
    normal_impulse_n_s: f64,
    impulse_x_n_s: f64,
    impulse_y_n_s: f64,
    impulse_z_n_s: f64,
    friction_work_j: f64,
}

impl Reference {
    fn subject(&self) -> String {
        format!("{}, {} m/s", self.name, self.input.process.brushing_velocity_m_s)
    }
}

impl OfFilament {
    /// The differences of a filament's contact with the workpiece from this.
    fn differences(&self, metrics: &Metrics) -> [(&'static str, f64); 5] {
        let (normal, work) = (self.contact_normal_impulse_n_s, self.friction_work_j);
        let over = |value: f64, expected: f64, scale: f64| ((value - expected) / scale).abs();
        [
            ("p_n", over(metrics.contact_normal_impulse_n_s, normal, normal)),
            ("∫ F_x dt", over(metrics.contact_impulse_x_n_s, self.contact_impulse_x_n_s, normal)),
            ("∫ F_y dt", over(metrics.contact_impulse_y_n_s, self.contact_impulse_y_n_s, normal)),
            ("∫ F_z dt", over(metrics.contact_impulse_z_n_s, self.contact_impulse_z_n_s, normal)),
            ("friction work", over(metrics.friction_work_j, work, work)),
        ]
    }
}

fn references() -> Vec<Reference> {
    let cases = cases("reference_space.json");
    assert_eq!(cases.len(), 10);
    cases
}

/// Reports the differences that exceed the tolerance.
fn check(failures: &mut Vec<String>, subject: &str, differences: &[(&'static str, f64)], tolerance: f64) {
    let exceeding = differences.iter().filter(|(_, difference)| difference.is_nan() || *difference > tolerance);
    failures
        .extend(exceeding.map(|(name, difference)| format!("{subject}: {name} {difference:.1e} > {tolerance:.1e}")));
}

#[test]
fn two_filaments_in_space_agree_with_casadi_and_cvodes() {
    let mut failures = Vec::new();
    for case in references() {
        let result = simulate_brush(&with(&case.input, |brush| brush.tolerance = BRUSH_TOLERANCE), 1)
            .expect("the settings are valid");
        let name = case.subject();
        let mut found: Vec<_> = result.filaments.iter().collect();
        found.sort_by_key(|filament| (filament.column, filament.row));
        assert_eq!(found.len(), case.filaments.len());
        for (i, (filament, expected)) in found.iter().zip(&case.filaments).enumerate() {
            let tolerance = BRUSH + case.own_errors.filaments;
            check(&mut failures, &format!("{name}, filament {i}"), &expected.differences(&filament.metrics), tolerance);
        }
        assert_eq!(result.pairs.len(), case.neighbours.len());
        for (pair, expected) in result.pairs.iter().zip(&case.neighbours) {
            assert_eq!(pair.filament, [0, 0], "the forces are those on the filament that is ahead");
            let normal = expected.normal_impulse_n_s;
            let [x, y, z] = pair.vector_impulse_n_s;
            let differences = [
                ("∫ F dt", pair.impulse_n_s / normal - 1.0),
                ("x", (x - expected.impulse_x_n_s) / normal),
                ("y", (y - expected.impulse_y_n_s) / normal),
                ("z", (z - expected.impulse_z_n_s) / normal),
                ("friction work", pair.dissipated_j / expected.friction_work_j - 1.0),
            ];
            let sizes = differences.map(|(name, difference)| (name, difference.abs()));
            check(&mut failures, &format!("{name}, between them"), &sizes, 10.0 * BRUSH + case.own_errors.neighbours);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_tilted_filament_agrees_with_casadi_and_cvodes() {
    let mut failures = Vec::new();
    for case in references().iter().filter(|case| case.neighbours.is_empty()) {
        let mut settings = Settings { brush: None, ..case.input.clone() };
        settings.solver.relative_tolerance = 1e-9;
        let result = simulate(&settings).expect("the settings are valid");
        let differences = case.filaments[0].differences(&result.metrics);
        check(&mut failures, &case.subject(), &differences, PASS + 10.0 * case.own_errors.filaments);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
