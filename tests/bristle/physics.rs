//! Is it physics? Slow and stiff contacts, and singular points. `tests/validation` has the exact
//! solutions.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::{case, filament, metrics, random_state, residual};
use bristle::simulation::simulate;
use bristle_equations::evaluation::{RoundToolState, evaluate};
use fastrand::Rng;

#[test]
fn slow_and_stiff_contacts_end() {
    // Here events lie in long steps, or are as sharp as double precision allows.
    for (velocity, depth, stiffness) in [
        (1e-3, 2e-3, 1e5),
        (1e-3, 5e-3, 1e5),
        (0.01, 5e-3, 1e9),
        (0.1, 5e-3, 1e10),
    ] {
        let mut settings = case(25, velocity, depth);
        settings.contact.stiffness_n_m = stiffness;
        settings.solver.relative_tolerance = 1e-5;
        let metrics = simulate(&settings).expect("the pass ends").metrics;
        // Quasi-static: the filament stays on the surface between nominal entry and exit, or nearly
        // so.
        assert!(
            metrics.contact_time_ratio > 0.95,
            "{velocity} m/s, {stiffness} N/m: {metrics:?}"
        );
    }
}

#[test]
fn contact_time_ratio_does_not_exceed_one() {
    // The node is so thick that it touches from start to end.
    let mut settings = case(5, 10.0, 1e-3);
    settings.contact.radius_m = 0.02;
    settings.contact.stiffness_n_m = 10.0;
    let metrics = simulate(&settings).expect("the pass ends").metrics;
    assert_eq!(metrics.contact_time_ratio, 1.0);
    assert_eq!(metrics.contact_count, 1);
}

#[test]
fn folded_joints_and_poles_are_finite() {
    // The declared singular points: a joint folded back on itself, and the azimuth at a pole.
    let state = RoundToolState {
        base_angle: 0.0,
        base_rate: 0.0,
        base_acceleration: 0.0,
        gravity: [0.0; 3],
        q: vec![FRAC_PI_2, 0.0, FRAC_PI_2, PI],
        v: vec![0.0; 4],
    };
    let folded = evaluate(&filament(2), 0.14, &state);
    // sin π is not zero in double precision, so the fold may be regular, but must never be silently
    // wrong.
    if let Ok(evaluation) = folded {
        assert!(
            evaluation
                .accelerations
                .iter()
                .all(|acceleration| acceleration.is_finite())
        );
    }
    let mut rng = Rng::with_seed(1);
    let mut random = random_state(&mut rng, 3);
    random.q[1][0] = 0.0;
    // At a pole the rates of a segment that turns about another axis are not finite.
    random.clamp.angular_velocity = [0.0, 0.0, 100.0];
    let accelerations = vec![[0.0; 2]; 3];
    assert!(
        residual(&random, &accelerations)
            .as_flattened()
            .iter()
            .all(|value| value.is_finite())
    );
}

/// A contact so soft that it does not bend a stiff filament: the impulse is the integral of the
/// force on the undeformed nodes, which a step must resolve although nothing else happens.
#[test]
fn the_impulse_of_a_very_soft_contact_is_resolved() {
    const STEPS: usize = 100_000;
    let mut settings = case(3, 1.0, 1e-3);
    settings.filament.youngs_modulus_pa = 1e13;
    settings.filament.damping_ratio = 1.0;
    settings.contact.stiffness_n_m = 1e-4;
    settings.contact.exponent = 3.0;
    let radius = settings.tool_radius_m();
    let half = (1.0 - 1e-3 / radius).acos();
    let force = |angle: f64| 1e-4 * (radius * angle.cos() - (radius - 1e-3)).max(0.0).powi(3);
    let step = 2.0 * half / STEPS as f64;
    let sum: f64 = (0..STEPS)
        .map(|k| force((k as f64 + 0.5) * step - half))
        .sum();
    let expected = sum * step / settings.angular_velocity_rad_s();
    let found = metrics(&settings).contact_normal_impulse_n_s;
    assert!(
        (found / expected - 1.0).abs() < 1e-4,
        "{found:e} {expected:e}"
    );
}
