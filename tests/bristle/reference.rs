//! Is it right? Values from independent codes. `derivations/README.md` lists the codes, and how to
//! regenerate the values.

use bristle::model::settings::FilamentSettings;
use bristle_equations::evaluation::{Evaluation, RoundToolState, evaluate};
use serde::Deserialize;
use serde::de::DeserializeOwned;

fn states<T: DeserializeOwned>(name: &str) -> Vec<T> {
    #[derive(Deserialize)]
    struct ReferenceStates<T> {
        states: Vec<T>,
    }

    let file: ReferenceStates<T> =
        serde_json::from_str(&crate::common::data(name)).expect("the file is JSON");
    file.states
}

/// A state and its accelerations by another code.
#[derive(Deserialize)]
struct ReferenceState {
    kind: String,
    youngs_modulus_pa: f64,
    base_angle: f64,
    base_rate: f64,
    base_acceleration: f64,
    gravity: [f64; 3],
    q: Vec<f64>,
    v: Vec<f64>,
    accelerations: Vec<f64>,
}

impl ReferenceState {
    fn case(&self) -> String {
        format!("{}, n = {}", self.kind, self.q.len() / 2)
    }

    fn evaluate(&self) -> Evaluation {
        let state = RoundToolState {
            base_angle: self.base_angle,
            base_rate: self.base_rate,
            base_acceleration: self.base_acceleration,
            gravity: self.gravity,
            q: self.q.clone(),
            v: self.v.clone(),
        };
        let segments = self.q.len() / 2;
        let filament = FilamentSettings {
            youngs_modulus_pa: self.youngs_modulus_pa,
            ..crate::common::filament(segments)
        };
        evaluate(&filament, 0.14, &state).expect("the state is regular")
    }

    fn assert_accelerations(&self, result: &Evaluation) {
        // At n = 25 the file itself has errors of up to 2e-12, as 40-digit arithmetic showed.
        // A torque that should vanish is known to one rounding of c, which divided by J is 1e-6
        // rad/s² at n = 25.
        let bound = 1e-11 * crate::common::largest(&self.accelerations) + 1e-5;
        assert_eq!(result.accelerations.len(), self.accelerations.len());
        for (value, expected) in result.accelerations.iter().zip(&self.accelerations) {
            assert!(
                (value - expected).abs() < bound,
                "{}: {value} {expected}",
                self.case()
            );
        }
    }
}

/// Rigid bodies in spherical joints, solved by Pinocchio's articulated-body algorithm.
///
/// Body `k` has the orientation `R_k = R_z(θ_k) R_y(φ_k)`, which maps its own z axis to `e_k`. The
/// quaternion of the joint is that of `R_{k−1}ᵀ R_k`, its velocity is `R_kᵀ (ω_k − ω_{k−1})` with
/// `ω_k = e_k × ė_k`, without spin about the body's own axis. The axes of the first joint move with
/// the root and do not turn; gravity there is `g − r̈_0`. Pinocchio's angular accelerations `a_k`
/// give `ë_k = a_k × e_k + ω_k × (ω_k × e_k)`, and thus `φ̈_k` and `θ̈_k`.
#[test]
fn accelerations_agree_with_articulated_rigid_bodies() {
    let reference: Vec<ReferenceState> = states("reference_aba.json");
    for segments in [2, 7, 25] {
        assert!(
            reference.iter().any(|state| state.q.len() == 2 * segments),
            "n = {segments}"
        );
    }
    for expected in reference {
        expected.assert_accelerations(&expected.evaluate());
    }
}
