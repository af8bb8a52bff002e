//! Integrates the chain of `derivation.rs`, and prints its energy balance.

use nalgebra::{Matrix3, SVector, Vector3};

#[cfg(test)]
#[allow(dead_code, reason = "the build script uses the rest")]
mod derivation;

/// The emitted functions.
#[allow(dead_code, clippy::all, reason = "generated")]
mod equations {
    use bristle::equations::Real;
    include!(concat!(env!("OUT_DIR"), "/equations.rs"));
}

/// Three coordinates in rad, their rates in rad/s, and the dissipated energy in J.
type OwnState = SVector<f64, 7>;

/// Calls a function of the chain: a filament of 30 mm at rest along `x`, 1 mm above the plane.
#[rustfmt::skip]
macro_rules! at {
    ($state:expr, $function:ident) => {
        equations::$function(
            [$state[0], $state[1], $state[2]], [$state[3], $state[4], $state[5]],
            [0.0, 1e-3], [0.0; 2], [0.0; 2], // position, velocity and acceleration of the root
            [1.0, 0.0], 0.0, [0.0, -9.81],   // clamp, rate of its rotation, gravity
            0.01, [1e-4; 3], [1e-9; 3],      // length, masses and inertias of the segments
            [1e-2; 3], [2e-6; 3], [0.0; 3],  // stiffness, damping and relaxed angle of the joints
            1e-4, 1e-3, 2e-3, 1e-2,          // W, λ, F, v_s
        )
    };
}

fn rate(state: OwnState) -> OwnState {
    let mass_matrix = Matrix3::from(at!(state, planar_mass_matrix).mass_matrix);
    let force = Vector3::from(at!(state, planar_force).force);
    let a = mass_matrix.lu().solve(&force).expect("it is regular");
    let power = at!(state, observed).power;
    OwnState::from([state[3], state[4], state[5], a[0], a[1], a[2], power])
}

/// Takes a step of the classical Runge-Kutta method.
fn step(state: OwnState, h: f64) -> OwnState {
    let a = rate(state);
    let b = rate(state + h / 2.0 * a);
    let c = rate(state + h / 2.0 * b);
    let d = rate(state + h * c);
    state + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
}

/// The state 1 ms later.
fn advanced(state: OwnState) -> OwnState {
    (0..500).fold(state, |state, _| step(state, 2e-6))
}

/// Energy of the chain and the energy dissipated so far, in J.
fn energy(state: OwnState) -> f64 {
    let energies = at!(state, planar_energies);
    energies.kinetic + energies.spring + energies.gravity + energies.other + state[6]
}

fn main() {
    println!("t in ms   y in mm   lost in µJ   imbalance in J");
    let mut state = OwnState::zeros();
    for time in 0..=20 {
        let (height, lost) = (1e3 * at!(state, observed).height, 1e6 * state[6]);
        let imbalance = energy(state) - energy(OwnState::zeros());
        println!("{time:7} {height:9.4} {lost:12.3} {imbalance:16.1e}");
        state = advanced(state);
    }
}

#[test]
fn what_the_dampers_take_is_what_the_chain_loses() {
    let end = (0..20).fold(OwnState::zeros(), |state, _| advanced(state));
    // The tip has fallen into the potential and dissipated a part of its depth of 100 µJ.
    assert!(at!(end, observed).height < 0.5e-3 && end[6] > 5e-6);
    // The method has order 4.
    assert!((energy(end) - energy(OwnState::zeros())).abs() < 1e-9 * end[6]);
}

#[test]
fn the_torque_of_adhesion_is_the_derivative_of_its_energy() {
    insta::assert_snapshot!(
        derivation::torque_of_adhesion(),
        @"2 (exp(−(h/λ) (sin θ3 + sin θ1 + sin θ2) − r0y/λ) − 1) (h W cos θ3 exp(−(h/λ) (sin θ3 + sin θ1 + sin θ2) − r0y/λ)/λ)"
    );
}
