//! Natural frequencies of beams and hanging ropes.

use std::f64::consts::PI;

use spec_math::Bessel;

use super::zero;

/// `β_k L` of the clamped-free beam, the `mode`-th root (from 1) of `cos x cosh x = −1`.
pub fn cantilever_root(mode: usize) -> f64 {
    let near = (mode as f64 - 0.5) * PI;
    zero(|x| x.cos() + 1.0 / x.cosh(), near - 0.4, near + 0.4)
}

/// `ω_k √(L/g)` of a rope that hangs from one end, half the `mode`-th zero (from 1) of the Bessel
/// function J_0.
pub fn hanging_rope(mode: usize) -> f64 {
    let near = (mode as f64 - 0.25) * PI;
    zero(|x: f64| x.bessel_j0(), near - 0.5, near + 0.5) / 2.0
}

/// Checks of the solution.
pub mod checks {
    use super::*;

    pub fn roots_match_the_tables() {
        // Roots from MODEL, and zeros of J_0 from Abramowitz and Stegun, table 9.5.
        for (mode, root) in [
            (1, 1.875104069),
            (2, 4.694091133),
            (3, 7.854757438),
            (5, 14.13716839),
        ] {
            assert!((cantilever_root(mode) - root).abs() < 1e-8, "{mode}");
        }
        for (mode, root) in [(1, 2.4048255577), (2, 5.5200781103), (3, 8.6537279129)] {
            assert!((hanging_rope(mode) - root / 2.0).abs() < 1e-9, "{mode}");
        }
    }
}
