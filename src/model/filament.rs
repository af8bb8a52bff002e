//! The constants of a filament's chain, from its geometry and material.

use std::f64::consts::{PI, TAU};

use crate::equations::{Chain, Link, RelaxedAngle};
use crate::model::settings::FilamentSettings;

/// First root of `cos βL cosh βL = −1`: the first bending mode of a clamped-free beam.
pub const FIRST_CANTILEVER_ROOT: f64 = 1.8751040687;

/// Builds the chain of a filament under the gravitational acceleration `gravity` in m/s².
///
/// MODEL, "Segment chain", "Energies" and "Filaments that are neither straight nor uniform": `h =
/// l_f/n`; segment `k` has `m = ρ A h` and `J = m h²/12` by the diameter at its centre; `c_k = E
/// I((k−1) h)/h`, and `c_1 = 2 E I(h/4)/h` because the clamp joint carries only half a segment's
/// compliance; `d_k = (2 ζ/Ω_1) c_k`; joint `k` is relaxed at `γ_k − γ_{k−1}`.
pub fn chain(filament: &FilamentSettings, gravity: [f64; 3]) -> Chain<f64> {
    let length = filament.length_m / filament.segments as f64;
    let damping_time = 2.0 * filament.damping_ratio / first_natural_frequency(filament);
    let share = |segments: f64| segments / filament.segments as f64;
    let mut inner = 0.0;
    let link = |(k, sine): (usize, f64)| {
        let k = k as f64;
        let centre = diameter_at(filament, share(k + 0.5));
        let mass = filament.density_kg_m3 * cross_section(centre) * length;
        let stiffness = if k == 0.0 {
            2.0 * (bending_stiffness(filament, diameter_at(filament, share(0.25))) / length)
        } else {
            bending_stiffness(filament, diameter_at(filament, share(k))) / length
        };
        let inclination = sine.asin();
        let relaxed_angle = RelaxedAngle::new(inclination - inner);
        inner = inclination;
        Link {
            mass,
            inertia: mass * length * length / 12.0,
            stiffness,
            damping: damping_time * stiffness,
            relaxed_angle,
        }
    };
    Chain {
        length,
        links: sines_of_inclinations(filament)
            .enumerate()
            .map(link)
            .collect(),
        gravity,
    }
}

/// Returns the diameter in m at the `share` of the free length from the root.
pub fn diameter_at(filament: &FilamentSettings, share: f64) -> f64 {
    filament.diameter_m + (filament.tip_diameter_m() - filament.diameter_m) * share
}

/// Returns `A = π d²/4` in m², of the diameter `d` in m.
pub fn cross_section(diameter: f64) -> f64 {
    PI * diameter.powi(2) / 4.0
}

/// Returns `E I = E π d⁴/64` in N m² where the filament has the diameter `d` in m.
pub fn bending_stiffness(filament: &FilamentSettings, diameter: f64) -> f64 {
    filament.youngs_modulus_pa * PI * diameter.powi(4) / 64.0
}

/// Returns the relaxed centreline's distance `y_0(s) = A [sin(2π s/λ + ψ) − sin ψ]` from the clamp
/// direction in m, `+` in the direction of rotation, at the arc length `s` in m.
pub fn relaxed_deflection(filament: &FilamentSettings, arc_length: f64) -> f64 {
    let phase = filament.waviness_phase_rad;
    let wave = (TAU * arc_length / filament.waviness_length_m() + phase).sin() - phase.sin();
    filament.waviness_amplitude_m * wave
}

/// Returns `sin γ_k = (y_0(k h) − y_0((k−1) h))/h` of each segment. A magnitude of one or more has
/// no angle.
pub fn sines_of_inclinations(filament: &FilamentSettings) -> impl Iterator<Item = f64> {
    let length = filament.length_m / filament.segments as f64;
    let deflection = move |nodes: usize| relaxed_deflection(filament, nodes as f64 * length);
    (0..filament.segments).map(move |k| (deflection(k + 1) - deflection(k)) / length)
}

/// Returns `Ω_1` in rad/s: the first bending frequency of the clamped filament as a beam, `1.8751…²
/// √(E I/(ρ A l_f⁴))` if it is uniform.
pub fn first_natural_frequency(filament: &FilamentSettings) -> f64 {
    let diameter = filament.diameter_m;
    let mass_per_length = filament.density_kg_m3 * cross_section(diameter);
    let taper = filament.tip_diameter_m() / diameter;
    let root = if taper == 1.0 {
        FIRST_CANTILEVER_ROOT.powi(2)
    } else {
        first_root_of_taper(taper)
    };
    root * (bending_stiffness(filament, diameter) / mass_per_length).sqrt()
        / filament.length_m.powi(2)
}

/// Intervals of the grid on which the mode of a tapered beam is integrated. The frequency is then
/// accurate to 1e-9.
const INTERVALS: usize = 400;
/// Largest number of iterations; each reduces the error of the frequency by a factor of 20 or more.
const MAX_ITERATIONS: usize = 60;

/// Returns `Ω_1 √(ρ A l_f⁴/(E I))` of a clamped beam whose diameter goes linearly to `taper` times
/// that at the root. `A` and `I` are those at the root.
///
/// This is the method of Stodola and Vianello: the deflection under the inertia forces of an
/// estimated mode is closer to the mode. The error of Schwarz's quotient of the two is the square
/// of the mode's error.
fn first_root_of_taper(taper: f64) -> f64 {
    let step = 1.0 / INTERVALS as f64;
    let diameters: Vec<f64> = (0..=INTERVALS)
        .map(|i| 1.0 + (taper - 1.0) * i as f64 * step)
        .collect();
    let masses: Vec<f64> = diameters.iter().map(|diameter| diameter.powi(2)).collect();
    let mut mode: Vec<f64> = (0..=INTERVALS).map(|i| (i as f64 * step).powi(2)).collect();
    let mut square = 0.0;
    for _ in 0..MAX_ITERATIONS {
        let inertia: Vec<f64> = mode
            .iter()
            .zip(&masses)
            .map(|(deflection, mass)| deflection * mass)
            .collect();
        let moment = integral_to_tip(&integral_to_tip(&inertia, step), step);
        let curvature: Vec<f64> = moment
            .iter()
            .zip(&diameters)
            .map(|(moment, d)| moment / d.powi(4))
            .collect();
        let next = integral_from_root(&integral_from_root(&curvature, step), step);
        let work = |deflection: &[f64]| {
            let products: Vec<f64> = inertia
                .iter()
                .zip(deflection)
                .map(|(force, deflection)| force * deflection)
                .collect();
            integral_from_root(&products, step)[INTERVALS]
        };
        let before = square;
        square = work(&mode) / work(&next);
        let tip = next[INTERVALS];
        mode = next
            .into_iter()
            .map(|deflection| deflection / tip)
            .collect();
        if (square - before).abs() <= 4.0 * f64::EPSILON * square {
            break;
        }
    }
    square.sqrt()
}

/// Integrates `values` on a grid of this step, from the first point to each, by cubics through four
/// points.
fn integral_from_root(values: &[f64], step: f64) -> Vec<f64> {
    let last = values.len() - 1;
    let mut sum = 0.0;
    let mut integral = vec![0.0];
    for i in 0..last {
        let cubic = if i == 0 {
            9.0 * values[0] + 19.0 * values[1] - 5.0 * values[2] + values[3]
        } else if i + 1 == last {
            9.0 * values[last] + 19.0 * values[last - 1] - 5.0 * values[last - 2] + values[last - 3]
        } else {
            13.0 * (values[i] + values[i + 1]) - values[i - 1] - values[i + 2]
        };
        sum += step / 24.0 * cubic;
        integral.push(sum);
    }
    integral
}

/// Integrates `values` from each point to the last, as [`integral_from_root`] does.
fn integral_to_tip(values: &[f64], step: f64) -> Vec<f64> {
    let reversed: Vec<f64> = values.iter().rev().copied().collect();
    let mut integral = integral_from_root(&reversed, step);
    integral.reverse();
    integral
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::settings::Settings;

    /// Truncated cones, from the exact solution of Naguleswaran (1994): with `x` from the apex in
    /// units of its distance from the root, modes are sums of `Z₂(2p√x)/x`, `Z` each of `J, Y, I,
    /// K`. The numbers are roots of their 4 × 4 determinant, which mpmath found with 20 digits.
    #[test]
    fn the_first_frequency_of_a_taper_is_that_of_the_beam() {
        for (taper, expected) in [
            (0.1, 7.20487164865),
            (0.3, 5.509260799758),
            (0.5, 4.625150252432),
            (0.8, 3.855116795037),
            (1.5, 2.95257002124),
        ] {
            let found = first_root_of_taper(taper);
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{taper}: {found}, not {expected}"
            );
        }
    }

    #[test]
    fn a_chain_has_the_constants_of_the_model() {
        let mut filament = Settings::paper(10.0, 1e-3).filament;
        filament.segments = 4;
        filament.tip_diameter_m = Some(0.5 * filament.diameter_m);
        (filament.waviness_amplitude_m, filament.waviness_phase_rad) = (0.5e-3, 0.3);
        let chain = chain(&filament, [0.0; 3]);
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
        let (d, h) = (filament.diameter_m, 0.01);
        let stiffness = |d: f64| 3e9 * PI * d.powi(4) / 64.0 / h;
        close(
            chain.links[0].stiffness,
            2.0 * stiffness(d * (1.0 - 0.5 / 16.0)),
        );
        close(chain.links[3].stiffness, stiffness(d * (1.0 - 0.5 * 0.75)));
        close(
            chain.links[2].mass,
            1110.0 * PI / 4.0 * (d * (1.0 - 0.5 * 0.625)).powi(2) * h,
        );
        let wave = |s: f64| 0.5e-3 * ((TAU * s / 0.04 + 0.3).sin() - 0.3_f64.sin());
        let angles: Vec<f64> = (0..4)
            .map(|k| ((wave(h * f64::from(k + 1)) - wave(h * f64::from(k))) / h).asin())
            .collect();
        close(chain.links[0].relaxed_angle.angle(), angles[0]);
        close(chain.links[2].relaxed_angle.angle(), angles[2] - angles[1]);
        close(
            chain.links[1].damping / chain.links[1].stiffness,
            chain.links[3].damping / chain.links[3].stiffness,
        );
    }
}
