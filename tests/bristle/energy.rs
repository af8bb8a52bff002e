//! Is it physics? The energy balance in a history.

use bristle::model::settings::Settings;
use bristle::simulation::{Sample, simulate, simulate_with_history};

use crate::common::case;

fn history(settings: &Settings) -> Vec<Sample> {
    simulate_with_history(settings, 400)
        .expect("the pass ends")
        .history
}

/// Contacts that dissipate in all ways, each at two velocities: stiffness, exponent, damping and
/// friction. With strong damping nodes come off while they are pressed in.
const CONTACTS: [[f64; 4]; 6] = [
    [1e4, 1.0, 0.0, 0.0],
    [1e9, 1.0, 0.0, 0.4],
    [1e6, 1.5, 0.5, 0.0],
    [1e8, 2.6, 1.8, 0.2],
    [3e4, 1.2, 2.0, 0.0],
    [3e7, 1.8, 1.1, 0.5],
];

fn settings([stiffness, exponent, damping, friction]: [f64; 4], velocity: f64) -> Settings {
    let mut settings = case(7, velocity, 1e-3);
    let contact = &mut settings.contact;
    (contact.stiffness_n_m, contact.exponent) = (stiffness, exponent);
    (contact.damping_s_m, contact.friction_coefficient) = (damping, friction);
    settings
}

#[test]
fn the_dissipated_energy_rises_and_is_as_good_as_the_tolerance() {
    let all = CONTACTS.map(|contact| [4.0, 25.0].map(|velocity| settings(contact, velocity)));
    for mut settings in all.into_iter().flatten() {
        let default = history(&settings);
        for pair in default.windows(2) {
            assert!(
                pair[1].dissipated_energy_j >= pair[0].dissipated_energy_j,
                "{settings:?}"
            );
        }
        settings.solver.relative_tolerance = 1e-9;
        let tight = history(&settings);
        let energy = |sample: &Sample| sample.kinetic_energy_j + sample.potential_energy_j;
        let largest = tight.iter().map(energy).fold(0.0, f64::max);
        let [default, tight] = [default, tight].map(|history| {
            history
                .last()
                .expect("there are samples")
                .dissipated_energy_j
        });
        assert!(
            (default - tight).abs() < 1e-6 * largest,
            "{default:e} {tight:e} of {largest:e}: {settings:?}"
        );
    }
}

#[test]
fn what_contact_damping_takes_is_as_good_as_the_tolerance() {
    let mut settings = settings([3.2e4, 1.74, 0.57, 0.0], 30.0);
    settings.process.penetration_depth_m = 0.7e-3;
    for tolerance in [1e-5, 1e-7, 1e-9] {
        settings.solver.relative_tolerance = tolerance;
        let residual = simulate(&settings)
            .expect("the pass ends")
            .metrics
            .energy_residual;
        assert!(residual < 100.0 * tolerance, "{tolerance:e}: {residual:e}");
    }
}
