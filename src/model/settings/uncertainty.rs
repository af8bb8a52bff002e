//! Settings of the uncertainty of filaments: section `[uncertainty]`.

/// Uncertainty of the filaments: standard deviations of normal distributions about the settings in
/// `[filament]`, and that of friction.
///
/// If one is above zero, a study repeats each case with sampled tools, and reports the distribution
/// of the tool force. All filaments of a sampled tool are alike.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct UncertaintySettings {
    /// Standard deviation of the free length `l_f`, in m.
    pub length_std_m: f64,
    /// Standard deviation of the diameter `d`, in m.
    pub diameter_std_m: f64,
    /// Standard deviation of Young's modulus `E`, in Pa.
    pub youngs_modulus_std_pa: f64,
    /// Standard deviation of the damping ratio `ζ`.
    pub damping_ratio_std: f64,
    /// Standard deviation of the amplitude `A` of the waviness, in m. A negative sample is the
    /// mirror image.
    pub waviness_amplitude_std_m: f64,
    /// Standard deviation of the phase `ψ` of the waviness, in rad.
    pub waviness_phase_std_rad: f64,
    /// Standard deviation of the coefficient of friction `µ`, whose distribution is cut at zero.
    pub friction_coefficient_std: f64,
    /// Number of sampled tools. Powers of two cover the space of the inputs most evenly.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u32,
    /// Settings that stay the same if the filaments have another length.
    pub hold: Hold,
    /// Uncertainty that a calibration leaves. Other deviations add to it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "CalibrationUncertainty"))]
    pub calibration: Option<CalibrationUncertainty>,
}

impl UncertaintySettings {
    /// The standard deviations of length (m), diameter (m), Young's modulus (Pa), damping ratio,
    /// amplitude (m) and phase (rad) of the waviness, and friction, in this order.
    #[must_use]
    pub fn deviations(&self) -> [f64; 7] {
        let Self {
            length_std_m,
            diameter_std_m,
            youngs_modulus_std_pa,
            damping_ratio_std,
            waviness_amplitude_std_m,
            waviness_phase_std_rad,
            friction_coefficient_std,
            samples: _,
            seed: _,
            hold: _,
            calibration: _,
        } = *self;
        [
            length_std_m,
            diameter_std_m,
            youngs_modulus_std_pa,
            damping_ratio_std,
            waviness_amplitude_std_m,
            waviness_phase_std_rad,
            friction_coefficient_std,
        ]
    }

    /// The [deviations](Self::deviations) from filament to filament of one brush: zero unless the
    /// machine holds the axis that these filaments share.
    #[must_use]
    pub fn deviations_within_brush(&self) -> [f64; 7] {
        match self.hold {
            Hold::Process => [0.0; 7],
            Hold::Machine => self.deviations(),
        }
    }

    /// Returns `true` if some property of the filaments, or their friction, scatters.
    #[must_use]
    pub fn scatters(&self) -> bool {
        self.deviations().iter().any(|&deviation| deviation > 0.0)
    }

    /// Returns `true` if filaments of one brush differ from each other.
    #[must_use]
    pub fn scatters_within_brush(&self) -> bool {
        self.deviations_within_brush()
            .iter()
            .any(|&deviation| deviation > 0.0)
    }
}

/// The standard errors of settings that a calibration has fitted, and their correlations: all
/// filaments of a tool have the same error.
///
/// Settings that are positive, as their usual range says, have a logarithmic normal distribution,
/// others a normal one.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CalibrationUncertainty {
    /// Dotted paths of the settings, of `[tool]`, `[filament]`, `[contact]` or `[brush]`.
    pub settings: Vec<String>,
    /// Standard error of each, in its unit.
    pub standard_errors: Vec<f64>,
    /// Correlation of each with each.
    pub correlations: Vec<Vec<f64>>,
    /// Relative standard deviation of measured forces about those that were fitted.
    #[cfg_attr(feature = "serde", serde(default))]
    pub misfit: f64,
}

/// Settings that stay the same on tools whose filaments have another length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Hold {
    /// Brushing velocity and penetration depth: each tool is set up anew, by its own radius. The
    /// filaments of one tool are alike, also within a brush.
    #[default]
    Process,
    /// Rotational speed, and distance of the axis from the workpiece: the machine knows the nominal
    /// radius only. Filaments of a brush differ from each other.
    Machine,
}

impl Default for UncertaintySettings {
    fn default() -> Self {
        Self {
            length_std_m: 0.0,
            diameter_std_m: 0.0,
            youngs_modulus_std_pa: 0.0,
            damping_ratio_std: 0.0,
            waviness_amplitude_std_m: 0.0,
            waviness_phase_std_rad: 0.0,
            friction_coefficient_std: 0.0,
            samples: 128,
            seed: 1,
            hold: Hold::Process,
            calibration: None,
        }
    }
}
