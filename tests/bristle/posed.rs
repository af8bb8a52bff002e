//! Is it right? Filaments of tools of any kind and pose, with and without friction, compared with
//! an independent code: `derivations/passes.py poses` states them again in the frame of the
//! workpiece, and integrates them with CVODES.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::simulate;
use serde::Deserialize;

use crate::common::{Stated, cases, difference, number};

/// Largest difference of an impulse over `p_n`, of an angular impulse over `p_n r_g`, of work and
/// times relative to themselves, beyond the error that the reference states. The solver runs at
/// 1e-9, and they agree to 2e-7.
const TOLERANCE: f64 = 1e-6;

/// A case of `tests/data/reference_poses.json`.
#[derive(Deserialize)]
struct Reference {
    name: String,
    input: Settings,
    own_error: f64,
    #[serde(flatten)]
    stated: Stated,
}

impl Reference {
    fn differences(&self, metrics: &Metrics) -> [(&'static str, f64); 8] {
        let stated = |key: &str| number(&self.stated, key);
        let normal = stated("contact_normal_impulse_n_s");
        [
            ("contact_normal_impulse_n_s", normal),
            ("contact_impulse_x_n_s", normal),
            ("contact_impulse_y_n_s", normal),
            ("contact_impulse_z_n_s", normal),
            (
                "contact_angular_impulse_n_m_s",
                normal * self.input.tool.body_radius_m,
            ),
            // Without friction there is none.
            (
                "friction_work_j",
                stated("friction_work_j").max(f64::MIN_POSITIVE),
            ),
            ("nominal_contact_time_s", stated("nominal_contact_time_s")),
            ("contact_time_s", stated("contact_time_s")),
        ]
        .map(|(key, scale)| difference(metrics, &self.stated, key, scale))
    }
}

#[test]
fn tools_of_any_pose_agree_with_casadi_and_cvodes() {
    let (mut failures, references) = (Vec::new(), cases::<Reference>("reference_poses.json"));
    assert_eq!(references.len(), 16);
    for case in references {
        let mut settings = case.input.clone();
        settings.solver.relative_tolerance = 1e-9;
        let metrics = simulate(&settings)
            .unwrap_or_else(|error| panic!("{}: {error}", case.name))
            .metrics;
        let tolerance = TOLERANCE + case.own_error;
        for (name, difference) in case.differences(&metrics) {
            if difference.is_nan() || difference > tolerance {
                failures.push(format!(
                    "{}: {name} {difference:.1e} > {tolerance:.1e}",
                    case.name
                ));
            }
        }
        if metrics.energy_residual > 1e-9 {
            failures.push(format!(
                "{}: energy_residual {:.1e}",
                case.name, metrics.energy_residual
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
