//! Inextensible beams with large deflections.

use std::f64::consts::FRAC_PI_2;

use spec_math::Ellip;

use super::zero;

/// A clamped beam under a dead transverse load at its tip (Bisshopp and Drucker 1945).
#[derive(Clone, Copy, Debug)]
pub struct TipLoad {
    /// Deflection along the load, over L.
    pub deflection: f64,
    /// Displacement of the tip towards the clamp, along the undeformed beam, over L.
    pub shortening: f64,
    /// Angle of the tip in rad.
    pub angle: f64,
}

impl TipLoad {
    /// The beam under `α = P L²/(E I)`.
    ///
    /// With `m = (1 + sin φ)/2` and `sin ϑ = 1/√(2m)`, φ being the angle of the tip: `√α = K(m) −
    /// F(ϑ, m)`, `w/L = 1 − 2/√α (E(m) − E(ϑ, m))`, `Δ/L = 1 − √(2 sin φ/α)`.
    pub fn new(alpha: f64) -> Self {
        let amplitude = |m: f64| (0.5 / m).sqrt().asin();
        let load = |m: f64| m.ellip_k() - m.ellip_k_inc(amplitude(m));
        let m = zero(|m| load(m) - alpha.sqrt(), 0.5 + 1e-15, 1.0 - 1e-15);
        let sine = 2.0 * m - 1.0;
        let bent = m.ellip_e() - m.ellip_e_inc(amplitude(m));
        Self {
            deflection: 1.0 - 2.0 * bent / alpha.sqrt(),
            shortening: 1.0 - (2.0 * sine / alpha).sqrt(),
            angle: sine.asin(),
        }
    }
}

/// Force `P/P_cr` on a buckled clamped-free beam, `P_cr = π² E I/(4 L²)`, whose tip rests on a
/// spring of `stiffness` (in `P_cr/L`). The shortening Δ of the beam and the compression of the
/// spring add up to `shortening` L.
///
/// `P/P_cr = (2K/π)²` with `1 − Δ/L = 2E/K − 1`.
pub fn buckled_force(shortening: f64, stiffness: f64) -> f64 {
    let force = |m: f64| (m.ellip_k() / FRAC_PI_2).powi(2);
    let of_beam = |m: f64| 2.0 - 2.0 * m.ellip_e() / m.ellip_k();
    let m = zero(
        |m| of_beam(m) + force(m) / stiffness - shortening,
        0.0,
        0.999,
    );
    force(m)
}

/// Position of the tip of a beam of length 1 that an end moment has bent by `turn` rad in total:
/// along and across the undeformed beam.
pub fn arc(turn: f64) -> [f64; 2] {
    [turn.sin() / turn, (1.0 - turn.cos()) / turn]
}

/// Terms of a Taylor series, and the arc length that it covers.
const TERMS: usize = 24;
const STEP: f64 = 1.0 / 32.0;

/// Position of the tip of a beam of length 1, clamped horizontally, that hangs under its own
/// weight: along and below the undeformed beam. For κ up to 50.
///
/// With the slope ψ, the arc length σ from the tip and `κ = ρ A g L³/(E I)`: `ψ″ = −κ σ cos ψ`,
/// `ψ′(0) = 0`, `ψ(1) = 0`. Consecutive Taylor series run from the tip to the clamp. The slope of
/// the tip is found for which they end at zero.
pub fn hanging_tip(kappa: f64) -> [f64; 2] {
    let slope = zero(|slope| heavy_beam(kappa, slope)[0], 0.0, FRAC_PI_2);
    let [_, along, below] = heavy_beam(kappa, slope);
    [along, below]
}

/// ψ(1), and the integrals of cos ψ and sin ψ, for the slope ψ(0) of the tip.
fn heavy_beam(kappa: f64, slope: f64) -> [f64; 3] {
    let (mut psi, mut rate, mut along, mut below) = (slope, 0.0, 0.0, 0.0);
    for step in 0..(1.0 / STEP) as usize {
        let start = step as f64 * STEP;
        let (mut slopes, mut cosines, mut sines) = ([0.0; TERMS + 2], [0.0; TERMS], [0.0; TERMS]);
        [slopes[0], slopes[1]] = [psi, rate];
        for k in 0..TERMS {
            if k == 0 {
                (sines[0], cosines[0]) = psi.sin_cos();
            } else {
                // k s_k = Σ j ψ_j c_{k−j} and k c_k = −Σ j ψ_j s_{k−j}, from the derivatives of sin
                // ψ and cos ψ.
                let sum = |other: &[f64; TERMS]| -> f64 {
                    (1..=k).map(|j| j as f64 * slopes[j] * other[k - j]).sum()
                };
                let (sine, cosine) = (sum(&cosines), sum(&sines));
                (sines[k], cosines[k]) = (sine / k as f64, -cosine / k as f64);
            }
            let before = if k == 0 { 0.0 } else { cosines[k - 1] };
            slopes[k + 2] = -kappa * (start * cosines[k] + before) / ((k + 1) * (k + 2)) as f64;
        }
        let value = |terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| sum * STEP + term);
        let integral = |terms: &[f64]| {
            (0..terms.len())
                .rev()
                .fold(0.0, |sum, k| (sum + terms[k] / (k + 1) as f64) * STEP)
        };
        let slope = |(k, term): (usize, &f64)| k as f64 * term;
        let rates: Vec<f64> = slopes.iter().enumerate().skip(1).map(slope).collect();
        along += integral(&cosines);
        below += integral(&sines);
        (psi, rate) = (value(&slopes), value(&rates));
    }
    [psi, along, below]
}

/// Checks of the solution.
pub mod checks {
    use std::f64::consts::PI;

    use super::*;

    pub fn tip_load_matches_the_literature() {
        // Bisshopp and Drucker 1945, as cited in MODEL.
        for (alpha, deflection) in [(1.0, 0.30172), (2.0, 0.49346)] {
            assert!((TipLoad::new(alpha).deflection - deflection).abs() < 5e-6);
        }
        // Small loads: w/L = α/3, φ = α/2, Δ/L = α²/15.
        let small = TipLoad::new(1e-3);
        assert!(
            (small.deflection / (1e-3 / 3.0) - 1.0).abs() < 1e-5,
            "{small:?}"
        );
        assert!((small.angle / 0.5e-3 - 1.0).abs() < 1e-5, "{small:?}");
    }

    pub fn buckled_force_starts_at_eulers_load() {
        assert!((buckled_force(1e-9, f64::INFINITY) - 1.0).abs() < 1e-8);
        // python -c "from mpmath import *; mp.dps = 20 m = findroot(lambda m: 2*ellipe(m)/ellipk(m)
        // - 1 - 0.9, 0.1); print((2*ellipk(m)/pi)**2)"
        assert!((buckled_force(0.1, f64::INFINITY) - 1.052986880319323).abs() < 1e-13);
        // A spring that is compressed by 0.05 L at the critical force.
        let soft = buckled_force(0.1, 20.0);
        assert!((buckled_force(0.1 - soft / 20.0, f64::INFINITY) - soft).abs() < 1e-14);
    }

    pub fn light_beams_follow_linear_theory() {
        let [along, below] = hanging_tip(1e-3);
        assert!((below / (1e-3 / 8.0) - 1.0).abs() < 1e-6 && (1.0 - along) < 1e-7);
        // A heavy beam hangs straight down beyond its bend at the clamp.
        let [along, below] = hanging_tip(50.0);
        assert!(along < 0.25 && below > 0.9, "{along} {below}");
    }

    pub fn a_whole_turn_is_a_circle() {
        assert!(
            arc(2.0 * PI)
                .into_iter()
                .all(|component| component.abs() < 1e-15)
        );
        assert!((arc(PI)[1] - 2.0 / PI).abs() < 1e-15);
    }
}
