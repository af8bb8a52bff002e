//! Filaments that press on each other with a force per length (docs/MODEL.md, "Filaments that
//! touch").
//!
//! Straight filaments that cross at the angle α with the overlap δ come as near as `g = d − δ`, and
//! overlap over the half width `w = √(d² − g²)`. Both press with
//!
//! ```text
//! F = k_l ∫ (d − √(g² + s²)) g/√(g² + s²) ds/sin α = k_l g [2 d asinh(w/g) − 2 w]/sin α
//! ```
//!
//! with the limit `(4/3) k_l √(2 d) δ^(3/2)/sin α` for δ ≪ d.

use super::zero;

/// The law of contact of two filaments.
#[derive(Clone, Copy, Debug)]
pub struct FilamentContactLaw {
    /// `k_l` in N/m².
    pub stiffness: f64,
    /// `d`, the sum of both radii, in m.
    pub reach: f64,
}

impl FilamentContactLaw {
    /// Hertz's coefficient of filaments that cross at a right angle, in N/m^(3/2).
    fn coefficient(self) -> f64 {
        4.0 / 3.0 * self.stiffness * (2.0 * self.reach).sqrt()
    }

    /// Hertz's force in N of filaments that cross at `angle` (rad) with the overlap `overlap` (m).
    pub fn hertz(self, overlap: f64, angle: f64) -> f64 {
        self.coefficient() * overlap.powf(1.5) / angle.sin()
    }

    /// The overlap in m at which filaments that cross at a right angle press with `force` (N), by
    /// Hertz's law.
    pub fn overlap(self, force: f64) -> f64 {
        (force / self.coefficient()).powf(2.0 / 3.0)
    }

    /// [`FilamentContactLaw::hertz`] without the limit of a small overlap.
    pub fn crossed(self, overlap: f64, angle: f64) -> f64 {
        let least = self.reach - overlap;
        let half_width = (overlap * (self.reach + least)).sqrt();
        let integral = 2.0 * self.reach * (half_width / least).asinh() - 2.0 * half_width;
        self.stiffness * least * integral / angle.sin()
    }

    /// Force in N of two filaments in one plane, one of which leans away by `angle` (rad) from the
    /// overlap `overlap` (m) at its root.
    ///
    /// Each presses over the length along which it is nearer to the other's line than `d`: `½ k_l ∫
    /// ⟨δ⟩ ds` of both.
    pub fn wedge(self, overlap: f64, angle: f64) -> f64 {
        let gap = self.reach - overlap;
        // The distances from points of the leaning filament to the other's line are vertical; the
        // others are inclined by the angle.
        let seen_from_other = self.reach - gap * angle.cos();
        0.25 * self.stiffness
            * (overlap * overlap + seen_from_other * seen_from_other * angle.cos())
            / angle.sin()
    }

    /// Force in N between two cantilevers that cross at a right angle and would overlap by
    /// `approach` (m) if they did not bend. Both together yield by `compliance` (m/N):
    /// `P = δ_0/(a_1³/(3 E I_1) + a_2³/(3 E I_2) + 1/k)` with `k = P/δ(P)`.
    pub fn cantilevers(self, compliance: f64, approach: f64) -> f64 {
        zero(
            |force| force * compliance + self.overlap(force) - approach,
            0.0,
            approach / compliance,
        )
    }
}

/// Checks of the solution.
pub mod checks {
    use super::*;

    const PRESSING: FilamentContactLaw = FilamentContactLaw {
        stiffness: 6e7,
        reach: 1.18e-3,
    };

    pub fn the_integral_tends_to_the_law_of_hertz() {
        let ratio = |overlap: f64| PRESSING.crossed(overlap, 0.5) / PRESSING.hertz(overlap, 0.5);
        assert!((ratio(1e-5) - 1.0).abs() < 5e-3 && (ratio(1e-7) - 1.0).abs() < 1e-4);
    }

    pub fn forces_are_the_integrals() {
        let (overlap, parts) = (1e-5, 2_000_000);
        let part = 2e-3 / f64::from(parts);
        let least = PRESSING.reach - overlap;
        let press = |s: f64| {
            let distance = least.hypot(s);
            PRESSING.stiffness * (PRESSING.reach - distance).max(0.0) * least / distance
        };
        let sum: f64 = (0..parts)
            .map(|i| press((f64::from(i) + 0.5) * part - 1e-3))
            .sum();
        assert!(
            (sum * part / PRESSING.crossed(overlap, 0.5 * std::f64::consts::PI) - 1.0).abs() < 1e-6
        );
        let wedge = PRESSING.wedge(overlap, 1e-3);
        assert!(
            (wedge / (0.5 * PRESSING.stiffness * overlap * overlap / 1e-3) - 1.0).abs() < 1e-3,
            "{wedge}"
        );
    }

    pub fn cantilevers_are_in_equilibrium() {
        let (compliance, approach) = (1e-4, 2e-5);
        let force = PRESSING.cantilevers(compliance, approach);
        let overlap = approach - force * compliance;
        assert!(
            (PRESSING.hertz(overlap, 0.5 * std::f64::consts::PI) / force - 1.0).abs() < 1e-9,
            "{force}"
        );
    }
}
