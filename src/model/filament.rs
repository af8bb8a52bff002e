//! The constants of a filament's chain, from its geometry and material.

use std::f64::consts::PI;

use crate::equations::{Chain, UniformChain};
use crate::model::settings::FilamentSettings;

/// First root of `cos βL cosh βL = −1`: the first bending mode of a clamped-free beam.
pub const FIRST_CANTILEVER_ROOT: f64 = 1.8751040687;

/// The chain that models a filament, under the gravitational acceleration `gravity` in m/s².
///
/// MODEL, "Segment chain" and "Energies": `h = l_f/n`, `m = ρ A h`, `J = m h²/12`, `c_k = E I/h`, and `c_1 = 2 E I/h`
/// because the clamp joint carries only half a segment's compliance; `d_k = (2 ζ/Ω_1) c_k`.
pub fn chain(filament: &FilamentSettings, gravity: [f64; 3]) -> Chain<f64> {
    let length = filament.length_m / filament.segments as f64;
    let mass = filament.density_kg_m3 * cross_section(filament) * length;
    let joint_stiffness = bending_stiffness(filament) / length;
    let root_stiffness = 2.0 * joint_stiffness;
    let damping_time = 2.0 * filament.damping_ratio / first_natural_frequency(filament);
    Chain::from(UniformChain {
        segments: filament.segments,
        length,
        mass,
        inertia: mass * length * length / 12.0,
        root_stiffness,
        joint_stiffness,
        root_damping: damping_time * root_stiffness,
        joint_damping: damping_time * joint_stiffness,
        gravity,
    })
}

/// `A = π d²/4` in m².
pub fn cross_section(filament: &FilamentSettings) -> f64 {
    PI * filament.diameter_m.powi(2) / 4.0
}

/// `E I = E π d⁴/64` in N m².
pub fn bending_stiffness(filament: &FilamentSettings) -> f64 {
    filament.youngs_modulus_pa * PI * filament.diameter_m.powi(4) / 64.0
}

/// `Ω_1 = 1.8751…² √(E I/(ρ A l_f⁴))` in rad/s: the first bending frequency of the clamped filament as a beam.
pub fn first_natural_frequency(filament: &FilamentSettings) -> f64 {
    let mass_per_length = filament.density_kg_m3 * cross_section(filament);
    FIRST_CANTILEVER_ROOT.powi(2) * (bending_stiffness(filament) / mass_per_length).sqrt() / filament.length_m.powi(2)
}
