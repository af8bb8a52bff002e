//! Density and Young's modulus of a polymer with abrasive grains, from those of its parts and the
//! mass fraction of the grains.
//!
//! With the mass fraction `w`, the densities `ρ_m` and `ρ_g` of matrix and grains, and bulk and
//! shear moduli `K` and `G` of each:
//!
//! - volume fraction `φ = (w/ρ_g) / (w/ρ_g + (1 − w)/ρ_m)` and density `ρ = φ ρ_g + (1 − φ) ρ_m`,
//!   which is exact without pores;
//! - bounds of any mixture: in series `1/E = φ/E_g + (1 − φ)/E_m` (Reuss 1929), in parallel `E = φ
//!   E_g + (1 − φ) E_m` (Voigt 1889);
//! - the lower bound of any isotropic mixture, which spheres of all sizes in shells of the polymer
//!   have in compression (Z. Hashin and S. Shtrikman, A variational approach to the theory of the
//!   elastic behaviour of multiphase materials, J. Mech. Phys. Solids 11 (1963) 127): `K = K_m + φ
//!   / (1/(K_g − K_m) + 3 (1 − φ)/(3 K_m + 4 G_m))`, `G = G_m + φ / (1/(G_g − G_m) + 6 (1 − φ)(K_m
//!   + 2 G_m)/(5 G_m (3 K_m + 4 G_m)))`, and `E = 9 K G/(3 K + G)`.
//!
//! The lower bound is the value taken: grains lie apart in the polymer, which carries the load from
//! one to the next. Grains that have come loose stiffen less, and the filament may then be softer
//! than any of these bounds.

/// Abrasive grains.
#[derive(Debug)]
pub struct Grain {
    /// Density, in kg/m³.
    pub density_kg_m3: f64,
    /// Young's modulus, in Pa. It is a hundred times that of the polymer, and hardly matters: 20 %
    /// more or less changes the modulus of the filament by 0.2 %.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Source of the values.
    pub source: &'static str,
}

/// Silicon carbide.
pub const SILICON_CARBIDE: Grain = Grain {
    density_kg_m3: 3210.0,
    youngs_modulus_pa: 430e9,
    poisson_ratio: 0.17,
    source: "3210 kg/m³ (Sanhui Abrasives, α-SiC), 430 GPa (MakeItFrom: 370 to 490)",
};

/// Aluminium oxide.
pub const ALUMINIUM_OXIDE: Grain = Grain {
    density_kg_m3: 3984.0,
    youngs_modulus_pa: 416e9,
    poisson_ratio: 0.23,
    source: "3984 kg/m³, 416 GPa (NIST Standard Reference Database 150, α-Al2O3)",
};

/// Poisson's ratio of the polymer. No sheet states it; a sintered PA12 has 0.41 (Rapid Prototyping
/// Journal 14 (2008) 260). With 0.35 and 0.45 the modulus of the filament changes by less than 2 %.
const POLYMER_POISSON_RATIO: f64 = 0.4;

/// A polymer with grains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    /// Share of the grains in the volume.
    pub volume_fraction: f64,
    /// Density, in kg/m³, rounded to 1 kg/m³.
    pub density_kg_m3: f64,
    /// Young's modulus by the lower bound of Hashin and Shtrikman, in Pa, rounded to 10 MPa.
    pub youngs_modulus_pa: f64,
    /// Bounds of Reuss and Voigt, in Pa.
    pub bounds_pa: [f64; 2],
}

/// Returns bulk and shear modulus of an isotropic material, in the unit of its Young's modulus.
const fn moduli(young: f64, poisson: f64) -> (f64, f64) {
    (
        young / (3.0 * (1.0 - 2.0 * poisson)),
        young / (2.0 * (1.0 + poisson)),
    )
}

/// Rounds a positive value to the nearest multiple of a step.
const fn rounded(value: f64, step: f64) -> f64 {
    (value / step + 0.5) as u64 as f64 * step
}

impl Mixture {
    /// Mixes a polymer of density `ρ_m` in kg/m³ and modulus `E_m` in Pa with a share `w` of its
    /// mass in grains.
    #[must_use]
    pub const fn new(
        polymer_density: f64,
        polymer_modulus: f64,
        grain: &Grain,
        mass_fraction: f64,
    ) -> Self {
        let grain_volume = mass_fraction / grain.density_kg_m3;
        let share = grain_volume / (grain_volume + (1.0 - mass_fraction) / polymer_density);
        let rest = 1.0 - share;
        let (bulk, shear) = moduli(polymer_modulus, POLYMER_POISSON_RATIO);
        let (grain_bulk, grain_shear) = moduli(grain.youngs_modulus_pa, grain.poisson_ratio);
        let sum = 3.0 * bulk + 4.0 * shear;
        let mixed_bulk = bulk + share / (1.0 / (grain_bulk - bulk) + 3.0 * rest / sum);
        let softening = 6.0 * rest * (bulk + 2.0 * shear) / (5.0 * shear * sum);
        let mixed_shear = shear + share / (1.0 / (grain_shear - shear) + softening);
        let young = 9.0 * mixed_bulk * mixed_shear / (3.0 * mixed_bulk + mixed_shear);
        let reuss = 1.0 / (share / grain.youngs_modulus_pa + rest / polymer_modulus);
        let voigt = share * grain.youngs_modulus_pa + rest * polymer_modulus;
        Self {
            volume_fraction: share,
            density_kg_m3: rounded(share * grain.density_kg_m3 + rest * polymer_density, 1.0),
            youngs_modulus_pa: rounded(young, 1e7),
            bounds_pa: [reuss, voigt],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A third of the volume, with round moduli in GPa: matrix E = 3, ν = 0.4, so that K = 5 and G
    /// = 15/14; grains E = 300, ν = 0.25, so that K = 200 and G = 120; 3 K_m + 4 G_m = 135/7. By
    /// hand: K = 5 + (1/3)/(1/195 + 14/135) = 8.063, G = 15/14 + (1/3)/(14/1665 + 0.27654) = 2.241,
    /// E = 9 K G/(3 K + G) = 6.15; in series 1/E = 1/900 + 2/9, in parallel E = 100 + 2.
    #[test]
    fn a_mixture_is_as_computed_by_hand() {
        const GRAIN: Grain = Grain {
            density_kg_m3: 4000.0,
            youngs_modulus_pa: 300e9,
            poisson_ratio: 0.25,
            source: "",
        };
        // A third of the volume of grains with four times the density is two thirds of the mass.
        let mixture = Mixture::new(1000.0, 3e9, &GRAIN, 2.0 / 3.0);
        assert!((mixture.volume_fraction - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(
            (mixture.density_kg_m3, mixture.youngs_modulus_pa),
            (2000.0, 6.15e9)
        );
        let [reuss, voigt] = mixture.bounds_pa;
        assert!(
            (reuss - 900e9 / 201.0).abs() < 1.0 && (voigt - 102e9).abs() < 1.0,
            "{reuss}, {voigt}"
        );
        let none = Mixture::new(1060.0, 3.31e9, &SILICON_CARBIDE, 0.0);
        assert_eq!(
            (
                none.density_kg_m3,
                none.youngs_modulus_pa,
                none.volume_fraction
            ),
            (1060.0, 3.31e9, 0.0)
        );
    }
}
