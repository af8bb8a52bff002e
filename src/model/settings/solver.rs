//! Settings of the numerical solution: section `[solver]`.

/// The numerical solution and its output.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SolverSettings {
    /// Relative tolerance of the integration.
    pub relative_tolerance: f64,
    /// Number of equally spaced samples in `history.csv`. No metric depends on it.
    pub samples: usize,
}

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            relative_tolerance: 1.0e-6,
            samples: 2000,
        }
    }
}
