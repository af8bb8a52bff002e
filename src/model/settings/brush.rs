//! Settings of filaments that touch each other: section `[brush]`.

/// A sector of the brush, whose filaments touch each other (MODEL, "Filaments that touch").
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BrushSettings {
    /// Number of columns of the sector, one behind the other around the tool. Without it there are
    /// as many as a steady stretch needs.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "usize"))]
    pub columns: Option<usize>,
    /// Number of rows along the axis, over the width of the brush. Without it the pitch is as equal
    /// both ways as it can be. One row is planar.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "usize"))]
    pub rows: Option<usize>,
    /// Where the roots are.
    pub pattern: Pattern,
    /// Surroundings beyond the first and the last row.
    pub ends: Ends,
    /// Contact stiffness `k_l` between filaments, in N/m².
    pub stiffness_n_m2: f64,
    /// Number `N_q` of contact points of a segment. Without it the least whose distance is at most
    /// the diameter.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "usize"))]
    pub contact_points: Option<usize>,
    /// Contact damping `χ` (Hunt and Crossley) between filaments, in s/m.
    pub damping_s_m: f64,
    /// Coefficient of friction between filaments.
    pub friction_coefficient: f64,
    /// Standard deviation of the tilt of each filament's clamp out of the plane of rotation, in
    /// rad.
    pub lateral_tilt_std_rad: f64,
    /// Standard deviation of the shift of each root, around the body and along the axis, in m.
    /// Roots of a single row stay in its plane.
    pub root_std_m: f64,
    /// `true` if the metrics are those of a steady stretch of columns, which must exist; `false`
    /// for those of all columns.
    pub steady: bool,
    /// Seed of random roots, tilts and filaments.
    pub seed: u32,
    /// Relative tolerance of the mean impulse. It chooses the time step.
    pub tolerance: f64,
}

/// Arrangements of the roots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Pattern {
    /// Every other row is half a pitch behind.
    #[default]
    Staggered,
    /// All rows are alike.
    Aligned,
    /// Uniformly random, no two closer than a diameter.
    Random,
}

/// Surroundings beyond the first and the last row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Ends {
    /// The brush goes on: rows repeat along the axis.
    #[default]
    Periodic,
    /// Nothing.
    Free,
}

impl Default for BrushSettings {
    fn default() -> Self {
        Self {
            columns: None,
            rows: None,
            pattern: Pattern::default(),
            ends: Ends::default(),
            stiffness_n_m2: 6e7,
            contact_points: None,
            damping_s_m: 0.0,
            friction_coefficient: 0.0,
            lateral_tilt_std_rad: 0.0,
            root_std_m: 0.0,
            steady: true,
            seed: 1,
            tolerance: 3e-3,
        }
    }
}
