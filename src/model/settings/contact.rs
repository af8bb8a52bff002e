//! Settings of the contact with the workpiece: section `[contact]`.

/// The contact law between filament and workpiece.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ContactSettings {
    /// Contact stiffness `k_c`, in N/m^p (N/m at exponent 1).
    pub stiffness_n_m: f64,
    /// Exponent `p` of the penetration.
    pub exponent: f64,
    /// Contact damping `χ` (Hunt and Crossley), in s/m.
    pub damping_s_m: f64,
    /// Contact radius of a node, subtracted from the gap, in m. Less than the length of the
    /// filament.
    pub radius_m: f64,
    /// Coefficient of friction `µ`.
    pub friction_coefficient: f64,
    /// Sliding speed `v_reg` over which friction is regularised, in m/s.
    pub friction_regularisation_m_s: f64,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            stiffness_n_m: 1.0e5,
            exponent: 1.0,
            damping_s_m: 0.0,
            radius_m: 0.0,
            friction_coefficient: 0.0,
            friction_regularisation_m_s: 1.0e-3,
        }
    }
}

impl ContactSettings {
    /// Returns the contact stiffness in N/m that follows from `E d` of a filament, as that of bodies
    /// in contact does: 1e5 N/m for the paper's brush.
    #[must_use]
    pub fn stiffness_of(youngs_modulus_pa: f64, diameter_m: f64) -> f64 {
        const PAPER_MODULUS_PA: f64 = 3.0e9;
        const PAPER_DIAMETER_M: f64 = 1.18e-3;
        1.0e5 * (youngs_modulus_pa * diameter_m / (PAPER_MODULUS_PA * PAPER_DIAMETER_M))
    }
}
