//! Settings of a filament: section `[filament]`.

use std::f64::consts::FRAC_PI_4;

/// One filament of the tool.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FilamentSettings {
    /// Number `n` of rigid segments that model the filament.
    #[cfg_attr(feature = "serde", serde(default = "default_segments"))]
    pub segments: usize,
    /// Free length `l_f`, in m.
    pub length_m: f64,
    /// Diameter `d`, in m; of a tapered filament at its root.
    pub diameter_m: f64,
    /// Diameter at the tip, to which it goes linearly, in m: from a thousandth to a thousand times
    /// `diameter_m`. Without it the filament is uniform.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub tip_diameter_m: Option<f64>,
    /// Amplitude `A` of the waves of the relaxed filament in the plane of rotation, in m. A
    /// negative one is that of the mirror image.
    #[cfg_attr(feature = "serde", serde(default))]
    pub waviness_amplitude_m: f64,
    /// Length `λ` of the waves, in m. Without it one wave is as long as the filament.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub waviness_length_m: Option<f64>,
    /// Phase `ψ` of the waves at the root, in rad.
    #[cfg_attr(feature = "serde", serde(default))]
    pub waviness_phase_rad: f64,
    /// Density `ρ`, in kg/m³.
    #[cfg_attr(feature = "serde", serde(default = "default_density_kg_m3"))]
    pub density_kg_m3: f64,
    /// Young's modulus `E`, in Pa.
    #[cfg_attr(feature = "serde", serde(default = "default_youngs_modulus_pa"))]
    pub youngs_modulus_pa: f64,
    /// Tilt `τ` of the clamp out of the plane of rotation, towards `+z`, in rad. With a tilt the
    /// motion is spatial.
    #[cfg_attr(feature = "serde", serde(default))]
    pub lateral_tilt_rad: f64,
    /// Damping ratio `ζ` of the first bending mode of the clamped filament.
    #[cfg_attr(feature = "serde", serde(default = "default_damping_ratio"))]
    pub damping_ratio: f64,
}

impl FilamentSettings {
    /// A PA 6.12 filament with this free length `l_f` and diameter `d`, both in m, in 25 segments.
    #[must_use]
    pub fn new(length_m: f64, diameter_m: f64) -> Self {
        Self {
            segments: default_segments(),
            length_m,
            diameter_m,
            tip_diameter_m: None,
            waviness_amplitude_m: 0.0,
            waviness_length_m: None,
            waviness_phase_rad: 0.0,
            density_kg_m3: default_density_kg_m3(),
            youngs_modulus_pa: default_youngs_modulus_pa(),
            lateral_tilt_rad: 0.0,
            damping_ratio: default_damping_ratio(),
        }
    }

    /// Area of the cross-section at the root in m².
    #[must_use]
    pub fn root_area_m2(&self) -> f64 {
        FRAC_PI_4 * self.diameter_m * self.diameter_m
    }

    /// Diameter at the tip in m.
    #[must_use]
    pub fn tip_diameter_m(&self) -> f64 {
        self.tip_diameter_m.unwrap_or(self.diameter_m)
    }

    /// Length `λ` of the waves in m.
    #[must_use]
    pub fn waviness_length_m(&self) -> f64 {
        self.waviness_length_m.unwrap_or(self.length_m)
    }
}

fn default_segments() -> usize {
    25
}

fn default_density_kg_m3() -> f64 {
    1110.0
}

fn default_youngs_modulus_pa() -> f64 {
    3.0e9
}

fn default_damping_ratio() -> f64 {
    0.05
}
