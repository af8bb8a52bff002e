//! Is it right? Filaments of tools of any kind and pose, with and without friction, compared with
//! an independent code: `derivations/passes.py poses` states them again in the frame of the
//! workpiece, and integrates them with CVODES.

use bristle::model::settings::Settings;
use serde::Deserialize;

use crate::common::{
    Stated, cases, difference, exceeding, impulse_differences, metrics, normal_impulse, number,
};

/// Largest difference beyond the error that the reference states: of an impulse over `p_n`, of an
/// angular impulse over `p_n r_g`, of work and times relative to themselves. The solver runs at
/// 1e-9, and both agree to 2e-7.
const TOLERANCE: f64 = 1e-6;

/// A case of `tests/data/reference_poses.json`.
#[derive(Deserialize)]
struct PoseReference {
    name: String,
    input: Settings,
    own_error: f64,
    #[serde(flatten)]
    stated: Stated,
}

#[test]
fn tools_of_any_pose_agree_with_casadi_and_cvodes() {
    let (mut failures, references) = (Vec::new(), cases::<PoseReference>("reference_poses.json"));
    assert_eq!(references.len(), 16);
    for case in references {
        let mut settings = case.input.clone();
        settings.solver.relative_tolerance = 1e-9;
        let (metrics, stated) = (metrics(&settings), &case.stated);
        let moment = normal_impulse(stated) * settings.tool.body_radius_m;
        // There is no friction work without friction.
        let work = number(stated, "friction_work_j").max(f64::MIN_POSITIVE);
        let others = [
            ("contact_angular_impulse_n_m_s", moment),
            ("friction_work_j", work),
            (
                "nominal_contact_time_s",
                number(stated, "nominal_contact_time_s"),
            ),
            ("contact_time_s", number(stated, "contact_time_s")),
        ]
        .map(|(key, scale)| difference(&metrics, stated, key, scale));
        let differences = [&impulse_differences(&metrics, stated)[..], &others].concat();
        let tolerance = TOLERANCE + case.own_error;
        failures.extend(exceeding(&case.name, &differences, tolerance));
        let balance = [("energy_residual", metrics.energy_residual)];
        failures.extend(exceeding(&case.name, &balance, 1e-9));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
