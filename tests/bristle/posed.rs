//! Is it right? Filaments of tools of any kind and pose, with and without friction, compared with an independent code:
//! `derivations/reference_poses.py` states them again in the frame of the workpiece, and integrates them with CVODES.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::simulate;
use serde::Deserialize;

use crate::common::cases;

/// Largest difference of an impulse over `p_n`, of an angular impulse over `p_n r_g`, of work and times relative to themselves, beyond the
/// error that the reference states. The solver runs at 1e-9, and they agree to 2e-7.
const TOLERANCE: f64 = 1e-6;

/// A case of `tests/data/reference_poses.json`.
#[derive(Deserialize)]
struct Reference {
    name: String,
    input: Settings,
    contact_normal_impulse_n_s: f64,
    contact_impulse_x_n_s: f64,
    contact_impulse_y_n_s: f64,
    contact_impulse_z_n_s: f64,
    contact_angular_impulse_n_m_s: f64,
    friction_work_j: f64,
    nominal_contact_time_s: f64,
    contact_time_s: f64,
    own_error: f64,
}

impl Reference {
    fn differences(&self, metrics: &Metrics) -> [(&'static str, f64); 8] {
        let normal = self.contact_normal_impulse_n_s;
        let moment = normal * self.input.tool.body_radius_m;
        // Without friction there is none.
        let work = self.friction_work_j.max(f64::MIN_POSITIVE);
        let over = |value: f64, expected: f64, scale: f64| ((value - expected) / scale).abs();
        [
            ("p_n", over(metrics.contact_normal_impulse_n_s, normal, normal)),
            ("∫ F_x dt", over(metrics.contact_impulse_x_n_s, self.contact_impulse_x_n_s, normal)),
            ("∫ F_y dt", over(metrics.contact_impulse_y_n_s, self.contact_impulse_y_n_s, normal)),
            ("∫ F_z dt", over(metrics.contact_impulse_z_n_s, self.contact_impulse_z_n_s, normal)),
            ("∫ M dt", over(metrics.contact_angular_impulse_n_m_s, self.contact_angular_impulse_n_m_s, moment)),
            ("friction work", over(metrics.friction_work_j, self.friction_work_j, work)),
            ("t_d", over(metrics.nominal_contact_time_s, self.nominal_contact_time_s, self.nominal_contact_time_s)),
            ("t_c", over(metrics.contact_time_s, self.contact_time_s, self.contact_time_s)),
        ]
    }
}

#[test]
fn tools_of_any_pose_agree_with_casadi_and_cvodes() {
    let (mut failures, references) = (Vec::new(), cases::<Reference>("reference_poses.json"));
    assert_eq!(references.len(), 16);
    for case in references {
        let mut settings = case.input.clone();
        settings.solver.relative_tolerance = 1e-9;
        let metrics = simulate(&settings).unwrap_or_else(|error| panic!("{}: {error}", case.name)).metrics;
        let tolerance = TOLERANCE + case.own_error;
        for (name, difference) in case.differences(&metrics) {
            if difference.is_nan() || difference > tolerance {
                failures.push(format!("{}: {name} {difference:.1e} > {tolerance:.1e}", case.name));
            }
        }
        if metrics.energy_residual > 1e-9 {
            failures.push(format!("{}: energy_residual {:.1e}", case.name, metrics.energy_residual));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
