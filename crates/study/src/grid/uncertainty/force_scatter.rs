//! The distribution of the tool force of a case.

use serde::{Deserialize, Serialize};

use super::inputs::SHARES;

bristle::record! {
    /// The distribution of the tool force `F_n,w` of one case.
    ///
    /// A first-order Sobol index is the share of the variance that would vanish, on average, if the
    /// input were known.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    pub struct ForceScatter {
        tool_force_mean_n: f64 = ["", "N", "mean of F_n,w over the tools", "mean of the sampled tools"],
        tool_force_std_n: f64 = ["", "N", "standard deviation of F_n,w", "over the sampled tools"],
        tool_force_median_n: f64 = ["", "N", "median of F_n,w", "half of the sampled tools have less"],
        tool_force_lower_95_n: f64 =
            ["", "N", "lower end of the 95 % band of F_n,w", "2.5 % of the sampled tools have less"],
        tool_force_upper_95_n: f64 =
            ["", "N", "upper end of the 95 % band of F_n,w", "2.5 % of the sampled tools have more"],
        sobol_length: f64 =
            ["", "", "share of the length", "first-order Sobol index of l_f in the variance of F_n,w"],
        sobol_diameter: f64 =
            ["", "", "share of the diameter", "first-order Sobol index of d in the variance of F_n,w"],
        sobol_youngs_modulus: f64 =
            ["", "", "share of Young’s modulus", "first-order Sobol index of E in the variance of F_n,w"],
        sobol_damping_ratio: f64 =
            ["", "", "share of the damping ratio", "first-order Sobol index of ζ in the variance of F_n,w"],
        sobol_waviness_amplitude: f64 =
            ["", "", "share of the waviness", "first-order Sobol index of A in the variance of F_n,w"],
        sobol_waviness_phase: f64 =
            ["", "", "share of the phase of the waviness", "first-order Sobol index of ψ in the variance of F_n,w"],
        sobol_friction_coefficient: f64 =
            ["", "", "share of friction", "first-order Sobol index of µ in the variance of F_n,w"],
        sobol_filament_count: f64 =
            ["", "", "share of the number of filaments", "first-order Sobol index of N_f in the variance of F_n,w"],
        sobol_calibration: f64 =
            ["", "", "share of the calibration", "first-order Sobol indices of what is calibrated in the variance of F_n,w"],
        failed_samples: usize =
            ["", "", "failed tools", "sampled tools left out because their simulation failed"],
    }
}

impl ForceScatter {
    /// Returns the distribution of a force that is larger by a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            tool_force_mean_n: factor * self.tool_force_mean_n,
            tool_force_std_n: factor * self.tool_force_std_n,
            tool_force_median_n: factor * self.tool_force_median_n,
            tool_force_lower_95_n: factor * self.tool_force_lower_95_n,
            tool_force_upper_95_n: factor * self.tool_force_upper_95_n,
            ..self
        }
    }

    /// Returns the 95 % band in N.
    #[must_use]
    pub fn band(&self) -> [f64; 2] {
        [self.tool_force_lower_95_n, self.tool_force_upper_95_n]
    }

    /// Returns first-order Sobol indices of [`SHARES`]. The rest up to 1 is due to interactions of
    /// inputs, or missed by the fit.
    #[must_use]
    pub fn sobol_indices(&self) -> [f64; SHARES.len()] {
        [
            self.sobol_length,
            self.sobol_diameter,
            self.sobol_youngs_modulus,
            self.sobol_damping_ratio,
            self.sobol_waviness_amplitude,
            self.sobol_waviness_phase,
            self.sobol_friction_coefficient,
            self.sobol_filament_count,
            self.sobol_calibration,
        ]
    }
}
