//! Is it physics? The account of the energies in a history.

use bristle::model::settings::Settings;
use bristle::simulation::{Sample, integral, simulate, simulate_with_history};
use fastrand::Rng;

use crate::common::balance;

fn history(settings: &Settings) -> Vec<Sample> {
    simulate_with_history(settings, 400)
        .expect("the pass ends")
        .history
}

/// Contacts that dissipate in all ways: stiff ones, of high exponents, with damping so strong that
/// nodes come off while they are pressed in, with friction.
fn draw(rng: &mut Rng) -> Settings {
    let mut settings = Settings::paper(
        2.0 * 15.0_f64.powf(rng.f64()),
        0.5e-3 * 8.0_f64.powf(rng.f64()),
    );
    settings.filament.segments = rng.usize(4..12);
    settings.contact.stiffness_n_m = 1e4 * 1e5_f64.powf(rng.f64());
    settings.contact.exponent = 1.0 + 1.8 * rng.f64();
    if rng.bool() {
        settings.contact.damping_s_m = 2.0 * rng.f64();
    }
    if rng.u32(..3) == 0 {
        settings.contact.friction_coefficient = 0.5 * rng.f64();
    }
    settings
}

#[test]
fn the_dissipated_energy_rises_and_is_as_good_as_the_tolerance() {
    let mut rng = Rng::with_seed(6);
    for _ in 0..40 {
        let mut settings = draw(&mut rng);
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
    let mut settings = Settings::paper(30.0, 0.7e-3);
    settings.filament.segments = 7;
    let contact = &mut settings.contact;
    (contact.stiffness_n_m, contact.exponent, contact.damping_s_m) = (3.2e4, 1.74, 0.57);
    for tolerance in [1e-5, 1e-7, 1e-9] {
        settings.solver.relative_tolerance = tolerance;
        let residual = simulate(&settings)
            .expect("the pass ends")
            .metrics
            .energy_residual;
        assert!(residual < 100.0 * tolerance, "{tolerance:e}: {residual:e}");
    }
}

#[test]
fn a_contact_that_comes_off_while_pressed_in_loses_what_it_stored() {
    // Without dampers in the joints, friction or feed, the contact alone dissipates; work is done
    // by the tool alone.
    let mut settings = Settings::paper(25.0, 1e-3);
    settings.filament.segments = 6;
    settings.filament.damping_ratio = 0.0;
    settings.contact.damping_s_m = 2.0;
    settings.solver.relative_tolerance = 1e-8;
    let (rise, end) = balance(&settings);
    let (lost, dissipated) = (
        end.integrals[integral::WORK] - rise,
        end.integrals[integral::CONTACT_DISSIPATION],
    );
    assert!(
        lost > 1e-4 && (dissipated / lost - 1.0).abs() < 1e-4,
        "{dissipated:e} {lost:e}"
    );
}
