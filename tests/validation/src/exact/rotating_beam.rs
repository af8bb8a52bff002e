//! Frequencies of a rotating clamped-free beam.

use nalgebra::{DMatrix, SymmetricEigen};

use super::beam::cantilever_root;

/// Number of polynomials in the deflection. More would add rounding, which grows with the eighth
/// power of their number.
const TERMS: usize = 22;
/// Number of quadrature points, exact for products of the polynomials.
const POINTS: usize = 32;

/// A beam of length 1 with `E I = ρ A = 1`, clamped at the distance `hub` from the axis about which
/// it turns.
///
/// Out of the plane of rotation (flap) `w⁗ − (T w′)′ = ω² w` with the tension `T = Ω² (½ (1 − ξ²) +
/// r (1 − ξ))` (Wright, Smith, Thresher and Wang 1982, who solve it by a power series). Here Ritz's
/// method makes the energies of `w = ξ² Σ a_k P_k(2ξ − 1)`, with Legendre polynomials, stationary.
/// It has no cancellation at high speeds.
#[derive(Clone, Copy, Debug)]
pub struct RotatingBeam {
    /// Ω.
    pub speed: f64,
    /// Radius of the hub.
    pub hub: f64,
}

impl RotatingBeam {
    /// Frequencies out of the plane of rotation (flap), ascending.
    pub fn flap(&self) -> Vec<f64> {
        let mut mass = DMatrix::<f64>::zeros(TERMS, TERMS);
        let mut stiffness = mass.clone();
        for (place, weight) in gauss_points() {
            let tension = self.speed.powi(2) * (1.0 - place) * (0.5 * (1.0 + place) + self.hub);
            let shapes = shapes(place);
            for i in 0..TERMS {
                for j in 0..TERMS {
                    let ([w, slope, bend], [other, other_slope, other_bend]) =
                        (shapes[i], shapes[j]);
                    mass[(i, j)] += weight * w * other;
                    stiffness[(i, j)] +=
                        weight * (bend * other_bend + tension * slope * other_slope);
                }
            }
        }
        let factor = mass.cholesky().expect("the shapes are independent").l();
        let inverse = factor.try_inverse().expect("the factor is regular");
        let eigen = SymmetricEigen::new(&inverse * stiffness * inverse.transpose());
        let mut frequencies: Vec<f64> = eigen
            .eigenvalues
            .iter()
            .map(|squared| squared.sqrt())
            .collect();
        frequencies.sort_by(f64::total_cmp);
        frequencies
    }

    /// Frequencies in the plane of rotation (lag): `ω_lag² = ω_flap² − Ω²`, as in that plane the
    /// centrifugal force has a component along the deflection.
    pub fn lag(&self) -> Vec<f64> {
        self.flap()
            .iter()
            .map(|flap| (flap.powi(2) - self.speed.powi(2)).sqrt())
            .collect()
    }
}

/// Southwell's coefficient `K` of the first flap: `ω² ≤ ω_0² + K Ω²`, by Rayleigh's quotient of the
/// tension with the mode of the beam at rest (1.193 + 1.571 r).
pub fn southwell(hub: f64) -> f64 {
    let root = cantilever_root(1);
    let ratio = (root.cosh() + root.cos()) / (root.sinh() + root.sin());
    let (mut tensed, mut moved) = (0.0, 0.0);
    for (place, weight) in gauss_points() {
        let x = root * place;
        let shape = x.cosh() - x.cos() - ratio * (x.sinh() - x.sin());
        let slope = root * (x.sinh() + x.sin() - ratio * (x.cosh() - x.cos()));
        tensed += weight * (1.0 - place) * (0.5 * (1.0 + place) + hub) * slope * slope;
        moved += weight * shape * shape;
    }
    tensed / moved
}

/// Deflection of the tip of a beam over the distance of its clamp from the axis. The beam has length
/// 1 and `E I = ρ A = 1`, and is parallel to the axis about which it turns at `speed`.
///
/// `w⁗ = Ω² (r + w)` with `w(0) = w′(0) = w″(1) = w‴(1) = 0` has `w(1)/r = (cosh Λ + cos Λ)/(1 +
/// cosh Λ cos Λ) − 1`, `Λ² = Ω`: the centrifugal force is across the beam, and does not stiffen it.
pub fn splay(speed: f64) -> f64 {
    let root = speed.sqrt();
    (root.cosh() + root.cos()) / (1.0 + root.cosh() * root.cos()) - 1.0
}

/// Legendre's polynomials at `x`, with their first and second derivatives.
fn legendre<const N: usize>(x: f64) -> [[f64; 3]; N] {
    let mut values = [[0.0; 3]; N];
    values[0] = [1.0, 0.0, 0.0];
    values[1] = [x, 1.0, 0.0];
    for k in 1..N - 1 {
        // (k+1) P_{k+1} = (2k+1) x P_k − k P_{k−1}, and its derivatives.
        let (n, [p, d, e], before) = (k as f64, values[k], values[k - 1]);
        let products = [x * p, p + x * d, 2.0 * d + x * e];
        values[k + 1] =
            std::array::from_fn(|i| ((2.0 * n + 1.0) * products[i] - n * before[i]) / (n + 1.0));
    }
    values
}

/// `ξ² P_k(2ξ − 1)`, with first and second derivatives by ξ.
fn shapes(place: f64) -> [[f64; 3]; TERMS] {
    legendre::<TERMS>(2.0 * place - 1.0).map(|[p, d, e]| {
        let (slope, bend) = (2.0 * d, 4.0 * e);
        let square = place * place;
        [
            square * p,
            2.0 * place * p + square * slope,
            2.0 * p + 4.0 * place * slope + square * bend,
        ]
    })
}

/// Gauss's points between 0 and 1 and their weights, by Newton's method on Legendre's polynomial.
fn gauss_points() -> [(f64, f64); POINTS] {
    std::array::from_fn(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (POINTS as f64 + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..20 {
            let [value, rate, _] = legendre::<{ POINTS + 1 }>(x)[POINTS];
            x -= value / rate;
            slope = rate;
        }
        ((1.0 + x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// Checks of the solution.
pub mod checks {
    use super::*;

    pub fn frequencies_match_wright() {
        // Wright et al. 1982, table for a hub radius of 0.
        for (speed, first, second) in [
            (0.0, 3.5160, 22.0345),
            (1.0, 3.6817, 22.1810),
            (4.0, 5.5850, 24.2733),
            (12.0, 13.1702, 37.6031),
        ] {
            let flap = RotatingBeam { speed, hub: 0.0 }.flap();
            assert!((flap[0] - first).abs() < 6e-5, "{speed}: {}", flap[0]);
            assert!((flap[1] - second).abs() < 6e-5, "{speed}: {}", flap[1]);
        }
    }

    pub fn a_beam_at_rest_is_a_cantilever() {
        let flap = RotatingBeam {
            speed: 0.0,
            hub: 3.5,
        }
        .flap();
        for mode in 1..=5 {
            let error = flap[mode - 1] / cantilever_root(mode).powi(2) - 1.0;
            assert!(error.abs() < 5e-9, "mode {mode}: {error:.1e}");
        }
    }

    pub fn southwells_coefficient_is_known() {
        assert!((southwell(0.0) - 1.193).abs() < 1e-3, "{}", southwell(0.0));
        assert!(
            (southwell(1.0) - southwell(0.0) - 1.571).abs() < 1e-3,
            "{}",
            southwell(1.0)
        );
    }

    pub fn splay_solves_its_boundary_value_problem() {
        // y[0, -1] of scipy.integrate.solve_bvp(lambda x, y: [y[1], y[2], y[3], speed**2 * (1 +
        // y[0])], …, tol=1e-12), SciPy 1.17.1.
        let solved = [
            (0.25, 0.00785271532126589),
            (1.0, 0.13614485891093978),
            (2.25, 1.0774527157446163),
            (3.24, 8.797654047599794),
        ];
        for (speed, tip) in solved {
            assert!(
                (splay(speed) / tip - 1.0).abs() < 1e-12,
                "{speed}: {}",
                splay(speed)
            );
        }
        // A slow beam is a cantilever under a uniform load.
        assert!(
            (splay(1e-3) / (1e-6 / 8.0) - 1.0).abs() < 1e-6,
            "{}",
            splay(1e-3)
        );
    }

    pub fn a_fast_beam_is_a_rope() {
        // Without stiffness and with hub 0, the first flap turns the rope as a whole at ω = Ω.
        let beam = RotatingBeam {
            speed: 50.0,
            hub: 0.0,
        };
        assert!(
            (beam.flap()[0] / 50.0 - 1.0).abs() < 3e-2,
            "{}",
            beam.flap()[0]
        );
    }
}
