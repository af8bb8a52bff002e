//! A point mass that hits a surface, or slides to rest on it.

use std::f64::consts::PI;

use spec_math::Gamma;

use super::zero;

/// Restitution `e` of an impact under the law of Hunt and Crossley, for χ times the impact speed:
/// `(1 + e) χv = ln[(1 + χv)/(1 − e χv)]` (MODEL, "Known exact facts"), independent of stiffness,
/// exponent and mass.
pub fn restitution(chi_v: f64) -> f64 {
    let excess = |e: f64| (1.0 + e) * chi_v - (chi_v.ln_1p() - (-e * chi_v).ln_1p());
    // e = 0 is below the root; the pole of the logarithm, or e = 1, is above it.
    zero(excess, 1e-9, (1.0 / chi_v).min(1.0) * (1.0 - 1e-15))
}

/// An impact of a point mass on a surface with the force `stiffness·δ^exponent`.
#[derive(Clone, Copy, Debug)]
pub struct Elastic {
    /// Mass in kg.
    pub mass: f64,
    /// Speed in m/s.
    pub speed: f64,
    /// Stiffness in N/m^p.
    pub stiffness: f64,
    /// Exponent p.
    pub exponent: f64,
}

impl Elastic {
    /// Largest penetration in m, at which the elastic energy `k δ^(p+1)/(p+1)` equals the initial
    /// kinetic energy.
    pub fn depth(&self) -> f64 {
        let power = self.exponent + 1.0;
        (power * self.mass * self.speed * self.speed / (2.0 * self.stiffness)).powf(1.0 / power)
    }

    /// Largest force in N.
    pub fn peak(&self) -> f64 {
        self.stiffness * self.depth().powf(self.exponent)
    }

    /// Duration in s: `2 δ_max/v ∫ dx/√(1 − x^(p+1))` over x from 0 to 1, by the Gamma function. It
    /// is π √(m/k) for p = 1.
    pub fn duration(&self) -> f64 {
        let inverse = 1.0 / (self.exponent + 1.0);
        let integral = PI.sqrt() * Gamma::gamma(&(1.0 + inverse)) / Gamma::gamma(&(0.5 + inverse));
        2.0 * self.depth() / self.speed * integral
    }
}

/// Stopping distance in m from the speed `speed` (m/s) under friction with the deceleration
/// `deceleration` (m/s²), regularised as `v/√(v² + v_reg²)`: `∫ √(v² + v_reg²) dv/a`. It is `v²/2a`
/// for v_reg = 0.
pub fn sliding_distance(speed: f64, deceleration: f64, regularisation: f64) -> f64 {
    let root = speed.hypot(regularisation);
    (speed * root + regularisation.powi(2) * (speed / regularisation).asinh())
        / (2.0 * deceleration)
}

/// Checks of the solution.
pub mod checks {
    use super::*;

    pub fn restitution_has_its_limits() {
        // e = 1 − ⅔ χv + … for slow impacts.
        assert!((restitution(1e-3) - (1.0 - 2e-3 / 3.0)).abs() < 1e-6);
        let e = restitution(2.0);
        assert!(
            ((1.0 + e) * 2.0 - (3.0 / (1.0 - 2.0 * e)).ln()).abs() < 1e-12,
            "{e}"
        );
    }

    pub fn elastic_impacts_match_the_textbook() {
        let linear = Elastic {
            mass: 2.0,
            speed: 0.3,
            stiffness: 5.0,
            exponent: 1.0,
        };
        assert!((linear.duration() - PI * (2.0_f64 / 5.0).sqrt()).abs() < 1e-14);
        assert!((linear.peak() - 0.3 * 10.0_f64.sqrt()).abs() < 1e-14);
        // Johnson 1985, eq. 11.24: 2.94 δ_max/v for Hertz's law.
        let hertz = Elastic {
            exponent: 1.5,
            ..linear
        };
        assert!((hertz.duration() * 0.3 / hertz.depth() - 2.9432751).abs() < 1e-6);
    }
}
