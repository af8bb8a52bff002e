//! Is it right? One and two filaments in space that touch the workpiece and each other, with
//! friction, compared with an independent code: `derivations/passes.py space` states them again,
//! and integrates them with CVODES.

use bristle::brush::simulate_brush;
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use serde::Deserialize;

use crate::common::{
    Stated, cases, difference, exceeding, impulse_differences, metrics, number, with,
};

/// Largest difference of a brush, which takes fixed steps that impacts do not cut, at
/// [`BRUSH_TOLERANCE`]: of impulses over `p_n` or the impulse between the filaments, of work
/// relative to itself.
const MAX_BRUSH_ERROR: f64 = 1e-3;
const BRUSH_TOLERANCE: f64 = 1e-4;
/// Largest difference of a pass at 1e-9, beyond the error that the reference states.
const MAX_PASS_ERROR: f64 = 5e-6;

/// A case of `tests/data/reference_space.json`.
#[derive(Deserialize)]
struct SpaceReference {
    name: String,
    input: Settings,
    /// Metrics of each filament.
    filaments: Vec<Stated>,
    neighbours: Vec<Stated>,
    own_errors: OwnErrors,
}

#[derive(Deserialize)]
struct OwnErrors {
    filaments: f64,
    neighbours: f64,
}

impl SpaceReference {
    fn subject(&self) -> String {
        format!(
            "{}, {} m/s",
            self.name, self.input.process.brushing_velocity_m_s
        )
    }
}

/// The differences of a filament's contact with the workpiece from the stated one.
fn differences(metrics: &Metrics, stated: &Stated) -> Vec<(&'static str, f64)> {
    let work = difference(
        metrics,
        stated,
        "friction_work_j",
        number(stated, "friction_work_j"),
    );
    [&impulse_differences(metrics, stated)[..], &[work]].concat()
}

fn references() -> Vec<SpaceReference> {
    let cases = cases("reference_space.json");
    assert_eq!(cases.len(), 10);
    cases
}

#[test]
fn two_filaments_in_space_agree_with_casadi_and_cvodes() {
    let mut failures = Vec::new();
    for case in references() {
        let result = simulate_brush(
            &with(&case.input, |brush| brush.tolerance = BRUSH_TOLERANCE),
            1,
        )
        .expect("the settings are valid");
        let name = case.subject();
        let mut found: Vec<_> = result.filaments.iter().collect();
        found.sort_by_key(|filament| (filament.column, filament.row));
        assert_eq!(found.len(), case.filaments.len());
        for (i, (filament, expected)) in found.iter().zip(&case.filaments).enumerate() {
            let tolerance = MAX_BRUSH_ERROR + case.own_errors.filaments;
            let differences = differences(&filament.metrics, expected);
            failures.extend(exceeding(
                &format!("{name}, filament {i}"),
                &differences,
                tolerance,
            ));
        }
        assert_eq!(result.pairs.len(), case.neighbours.len());
        for (pair, expected) in result.pairs.iter().zip(&case.neighbours) {
            assert_eq!(
                pair.filament,
                [0, 0],
                "the forces are those on the filament that is ahead"
            );
            let [normal, work] =
                ["normal_impulse_n_s", "friction_work_j"].map(|key| number(expected, key));
            let [x, y, z] = pair.vector_impulse_n_s;
            let sizes = [
                ("normal_impulse_n_s", pair.impulse_n_s, normal),
                ("impulse_x_n_s", x, normal),
                ("impulse_y_n_s", y, normal),
                ("impulse_z_n_s", z, normal),
                ("friction_work_j", pair.dissipated_j, work),
            ]
            .map(|(key, value, scale)| (key, ((value - number(expected, key)) / scale).abs()));
            let tolerance = 10.0 * MAX_BRUSH_ERROR + case.own_errors.neighbours;
            failures.extend(exceeding(
                &format!("{name}, between them"),
                &sizes,
                tolerance,
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_tilted_filament_agrees_with_casadi_and_cvodes() {
    let mut failures = Vec::new();
    for case in references()
        .iter()
        .filter(|case| case.neighbours.is_empty())
    {
        let mut settings = Settings {
            brush: None,
            ..case.input.clone()
        };
        settings.solver.relative_tolerance = 1e-9;
        let differences = differences(&metrics(&settings), &case.filaments[0]);
        let tolerance = MAX_PASS_ERROR + 10.0 * case.own_errors.filaments;
        failures.extend(exceeding(&case.subject(), &differences, tolerance));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
