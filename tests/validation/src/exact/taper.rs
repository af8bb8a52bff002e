//! Tapered beams: the first frequency in Bessel functions, and the shape under an end moment.

use nalgebra::Matrix4;
use spec_math::Bessel;

use super::zero;

/// `Ω_1 √(ρ A L⁴/(E I))`, with `A` and `I` at the root, of a clamped beam whose diameter falls
/// linearly to `taper` (below 1) times that at the root.
///
/// With `x` from the apex in units of its distance from the root, modes are sums of `Z₂(2p√x)/x`,
/// where `Z` is each of `J, Y, I, K` and `p² = Ω/(1 − taper)²` (Naguleswaran 1994). `d/dx x^(−ν/2)
/// Z_ν(2p√x) = ∓p x^(−(ν+1)/2) Z_(ν+1)(2p√x)`, with `+` for `I`. The frequency is where such a sum
/// has neither deflection nor slope at the root, and neither moment nor shear at the tip.
pub fn first_frequency(taper: f64) -> f64 {
    let determinant = |frequency: f64| {
        let p = frequency.sqrt() / (1.0 - taper);
        let (root, tip) = (2.0 * p, 2.0 * p * taper.sqrt());
        let column = |function: fn(f64, isize) -> f64, sign: f64, scale: f64| {
            let at = |x: f64, order: isize| function(x, order) / scale;
            [
                at(root, 2),
                sign * at(root, 3),
                at(tip, 4),
                sign * at(tip, 5),
            ]
        };
        let growing: fn(f64, isize) -> f64 = modified_bessel;
        let decaying: fn(f64, isize) -> f64 = |x, order| x.bessel_kn(order);
        Matrix4::from_columns(&[
            column(|x, order| x.bessel_jv(order as f64), -1.0, 1.0).into(),
            column(|x, order| x.bessel_yn(order), -1.0, 1.0).into(),
            column(growing, 1.0, growing(root, 2)).into(),
            column(decaying, -1.0, decaying(tip, 2)).into(),
        ])
        .determinant()
    };
    // Between the uniform beam and the cone, whose second frequency is 21.1.
    zero(determinant, 3.4, 8.8)
}

/// The modified Bessel function `I_n(x) = Σ (x/2)^(2k+n)/(k! (k+n)!)`, whose terms are all
/// positive.
fn modified_bessel(x: f64, order: isize) -> f64 {
    let half = x / 2.0;
    let mut term = (1..=order).fold(1.0, |term, i| term * half / i as f64);
    let (mut sum, mut k) = (0.0, 0.0);
    while term > f64::EPSILON * sum {
        sum += term;
        k += 1.0;
        term *= half * half / (k * (k + order as f64));
    }
    sum
}

/// The turn of each point of a tapered beam by the moment `turn` (in units of `E I/L` at the root),
/// at the `share` of its length.
pub fn turn_by_moment(taper: f64, turn: f64, share: f64) -> f64 {
    let slope = taper - 1.0;
    turn * (1.0 - (1.0 + slope * share).powi(-3)) / (3.0 * slope)
}

/// Checks of the solution.
pub mod checks {
    use super::*;

    pub fn frequencies_match_those_with_more_digits() {
        // Roots of the same determinant with 20 digits, by mpmath.
        for (taper, frequency) in [
            (0.1, 7.20487164865),
            (0.3, 5.509260799758),
            (0.5, 4.625150252432),
            (0.8, 3.855116795037),
        ] {
            let found = first_frequency(taper);
            assert!((found / frequency - 1.0).abs() < 1e-9, "{taper}: {found}");
        }
    }

    pub fn the_modified_bessel_function_matches_the_table() {
        // Abramowitz and Stegun, table 9.11.
        assert!((modified_bessel(2.0, 2) - 0.688_948_447_698_738).abs() < 1e-13);
        assert!((modified_bessel(1.0, 3) - 0.022_168_424_924_331_9).abs() < 1e-15);
    }

    pub fn a_slight_taper_turns_as_a_uniform_beam() {
        assert!((turn_by_moment(1.0 + 1e-6, 2.0, 0.7) - 1.4).abs() < 1e-5);
    }
}
