//! Is it right? Passes over edges, cylinders and bores, compared with an independent code: `derivations/reference_edges.py` states
//! the chain in the plane again, and integrates it with CVODES.

use bristle::model::metrics::Metrics;
use bristle::model::settings::{Settings, WorkpieceSettings};
use bristle::simulation::{Sample, simulate_with_history};
use serde::Deserialize;

use crate::common::{case, data};

/// Largest difference of an impulse over `p_n`, and of the others relative to themselves. The reference has errors of up to 3e-6
/// where it is stated; the solver runs at 1e-9.
const TOLERANCE: f64 = 1e-5;

/// A case of `tests/data/reference_edges.json`.
#[derive(Deserialize)]
struct Reference {
    name: String,
    filament: Filament,
    workpiece: WorkpieceSettings,
    brushing_velocity_m_s: f64,
    penetration_depth_m: f64,
    friction_coefficient: f64,
    turns: usize,
    end_s: f64,
    contact_time_s: f64,
    contact_normal_impulse_n_s: f64,
    contact_impulse_x_n_s: f64,
    contact_impulse_y_n_s: f64,
    edge_contact_normal_impulse_n_s: f64,
    friction_work_j: f64,
    contact_angular_impulse_n_m_s: f64,
    final_tip_m: [f64; 2],
    largest_edge_penetration_m: f64,
    own_error: f64,
}

#[derive(Deserialize)]
struct Filament {
    segments: usize,
    tip_diameter_m: f64,
    waviness_amplitude_m: f64,
}

#[derive(Deserialize)]
struct References {
    cases: Vec<Reference>,
}

impl Reference {
    /// One pass of a straight, uniform filament.
    fn is_plain(&self) -> bool {
        self.turns == 1 && self.filament.tip_diameter_m == 1.18e-3 && self.filament.waviness_amplitude_m == 0.0
    }

    fn settings(&self) -> Settings {
        let mut settings = case(self.filament.segments, self.brushing_velocity_m_s, self.penetration_depth_m);
        settings.contact.friction_coefficient = self.friction_coefficient;
        settings.workpiece = self.workpiece.clone();
        settings.solver.relative_tolerance = 1e-9;
        settings
    }

    /// The differences of a pass from this, each over its scale.
    fn differences(&self, metrics: &Metrics, end: &Sample) -> Vec<(&'static str, f64)> {
        let (normal, radius) = (self.contact_normal_impulse_n_s, 0.18);
        let work = self.friction_work_j.max(1e-6);
        let [x, y] = self.final_tip_m;
        let numbers = [
            ("end_s", end.time_s, self.end_s, self.end_s),
            ("contact_time_s", metrics.contact_time_s, self.contact_time_s, self.contact_time_s),
            ("contact_normal_impulse_n_s", metrics.contact_normal_impulse_n_s, normal, normal),
            ("contact_impulse_x_n_s", metrics.contact_impulse_x_n_s, self.contact_impulse_x_n_s, normal),
            ("contact_impulse_y_n_s", metrics.contact_impulse_y_n_s, self.contact_impulse_y_n_s, normal),
            (
                "edge_contact_normal_impulse_n_s",
                metrics.edge_contact_normal_impulse_n_s,
                self.edge_contact_normal_impulse_n_s,
                normal,
            ),
            ("friction_work_j", metrics.friction_work_j, self.friction_work_j, work),
            (
                "contact_angular_impulse_n_m_s",
                metrics.contact_angular_impulse_n_m_s,
                self.contact_angular_impulse_n_m_s,
                normal * radius,
            ),
            (
                "max_edge_penetration_m",
                metrics.max_edge_penetration_m,
                self.largest_edge_penetration_m,
                1e-2 * self.workpiece.edge_radius_m.max(1e-4),
            ),
            ("tip_x_m", end.tip_x_m, x, 0.04),
            ("tip_y_m", end.tip_y_m, y, 0.04),
        ];
        numbers.into_iter().map(|(name, value, expected, scale)| (name, (value - expected).abs() / scale)).collect()
    }
}

#[test]
fn passes_agree_with_casadi_and_cvodes() {
    let References { cases } = serde_json::from_str(&data("reference_edges.json")).expect("the file is JSON");
    let plain: Vec<&Reference> = cases.iter().filter(|case| case.is_plain()).collect();
    assert!(plain.len() > 100, "{}", plain.len());
    let mut failures = Vec::new();
    for case in plain {
        let pass = simulate_with_history(&case.settings(), 2).expect("the settings are valid");
        let end = pass.history.last().expect("there are two samples");
        for (name, difference) in case.differences(&pass.metrics, end) {
            if difference.is_nan() || difference > TOLERANCE + 10.0 * case.own_error {
                failures.push(format!(
                    "{}, {} m/s, {} m, µ = {}: {name} {difference:.1e}",
                    case.name, case.brushing_velocity_m_s, case.penetration_depth_m, case.friction_coefficient
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
