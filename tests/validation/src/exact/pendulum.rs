//! The spherical pendulum, by elliptic functions.

use std::f64::consts::{FRAC_PI_2, PI};

use spec_math::Ellip;

/// A rigid pendulum about a fixed point. Its polar angle is measured from the upward vertical, and
/// its azimuth about it.
///
/// With `u = cos φ`, `a = m g s/I` (s: distance of the centre of mass) and the constants of motion
/// `E` and `l`, both over I: `u̇² = (1 − u²)·2(E − a u) − l²`, a cubic with zeros `u_1 < u_2 <
/// u_3`. Starting at the lowest point, `u = u_1 + (u_2 − u_1) sn²(√(a (u_3 − u_1)/2) t, m)` with `m
/// = (u_2 − u_1)/(u_3 − u_1)` (Whittaker 1937, article 55).
#[derive(Clone, Copy, Debug)]
pub struct SphericalPendulum {
    /// `l`: angular momentum about the vertical, over I, in 1/s.
    momentum: f64,
    lowest: f64,
    range: f64,
    rate: f64,
    parameter: f64,
}

impl SphericalPendulum {
    /// Starts at the lowest point `cos φ = lowest` with the azimuthal rate `rate` (rad/s).
    pub fn new(a: f64, lowest: f64, rate: f64) -> Self {
        let momentum = (1.0 - lowest * lowest) * rate;
        let energy = momentum * rate / 2.0 + a * lowest;
        // (1 − u²) 2 (E − a u) − l² = 2a (u − u_1)(u² + b u + c), with b and c by comparison of
        // coefficients.
        let b = lowest - energy / a;
        let c = lowest * b - 1.0;
        let root = (b * b / 4.0 - c).sqrt();
        let (middle, highest) = (-b / 2.0 - root, -b / 2.0 + root);
        Self {
            momentum,
            lowest,
            range: middle - lowest,
            rate: (a * (highest - lowest) / 2.0).sqrt(),
            parameter: (middle - lowest) / (highest - lowest),
        }
    }

    /// Time in s from one lowest point to the next.
    pub fn period(&self) -> f64 {
        2.0 * self.parameter.ellip_k() / self.rate
    }

    /// `cos φ` at the time `time` (s).
    pub fn height(&self, time: f64) -> f64 {
        let sine = (self.rate * time).ellip_j(self.parameter).sn;
        self.lowest + self.range * sine * sine
    }

    /// Azimuth in rad travelled in the time `time` (s): the integral of `l/(1 − u²)`, by elliptic
    /// integrals of the third kind.
    pub fn azimuth(&self, time: f64) -> f64 {
        let amplitude = (self.rate * time).ellip_j(self.parameter).phi;
        let part = |pole: f64, direction: f64| {
            let distance = (pole - self.lowest).abs();
            third_kind(amplitude, self.parameter, direction * self.range / distance) / distance
        };
        self.momentum / (2.0 * self.rate) * (part(1.0, 1.0) + part(-1.0, -1.0))
    }
}

/// Incomplete elliptic integral of the third kind, at any amplitude.
fn third_kind(amplitude: f64, m: f64, n: f64) -> f64 {
    let halves = (amplitude / PI).round();
    2.0 * halves * m.ellip_pi_inc(FRAC_PI_2, n) + m.ellip_pi_inc(amplitude - halves * PI, n)
}

/// Checks of the solution.
pub mod checks {
    use super::*;

    pub fn a_cone_is_a_conical_pendulum() {
        // θ̇² = −a/cos φ keeps the height.
        let (a, height) = (9.0, -0.8);
        let pendulum = SphericalPendulum::new(a, height, (-a / height).sqrt());
        assert!((pendulum.height(0.37) - height).abs() < 1e-15);
        assert!((pendulum.azimuth(1.0) - (a / 0.8_f64).sqrt()).abs() < 1e-13);
        // Nearly planar and small: the time between two lowest points is half the period of a
        // pendulum, 2π/√a.
        let small = SphericalPendulum::new(a, -1.0 + 1e-8, 2e-2);
        assert!(
            (small.period() - PI / 3.0).abs() < 1e-3,
            "{}",
            small.period()
        );
    }

    pub fn azimuth_is_the_integral_of_its_rate() {
        let pendulum = SphericalPendulum::new(9.0, -0.9, 4.0);
        let (time, pieces) = (3.3 * pendulum.period(), 4000);
        let rate = |i: usize| {
            pendulum.momentum / (1.0 - pendulum.height(time * i as f64 / pieces as f64).powi(2))
        };
        let simpson: f64 = (0..pieces / 2)
            .map(|i| rate(2 * i) + 4.0 * rate(2 * i + 1) + rate(2 * i + 2))
            .sum();
        let integral = simpson * time / (3.0 * pieces as f64);
        assert!(
            (pendulum.azimuth(time) - integral).abs() < 1e-9,
            "{} {integral}",
            pendulum.azimuth(time)
        );
    }
}
