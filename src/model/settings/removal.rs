//! Settings of removal and wear: section `[removal]`.

/// Removal from the workpiece and wear of the filaments (MODEL, "Removal and wear").
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RemovalSettings {
    /// Preston coefficient `k_P` of the workpiece: volume removed per sliding work, in m²/N.
    /// Without it, and without `observed`, it is not known.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub preston_m2_n: Option<f64>,
    /// Wear coefficient `k_w` of the filaments: volume that a filament loses per sliding work, in
    /// m²/N. Without it filaments do not wear.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub filament_wear_m2_n: Option<f64>,
    /// `true` if the tool follows as its filaments become shorter, which keeps the penetration
    /// depth.
    pub compensate: bool,
    /// `true` if half of the turns go in the other direction.
    pub alternate: bool,
    /// Relative loss of force at which a worn brush is to be changed.
    pub force_loss: f64,
    /// Velocity of the feed along the edge, in m/s: a point of the edge is under a brush of the
    /// width `b` for `ω b/(2π v_f)` turns.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub edge_feed_velocity_m_s: Option<f64>,
    /// When `bristle wear` ends: at this radius of the edge, or after these turns or this time.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "RemovalGoal"))]
    pub until: Option<RemovalGoal>,
    /// Result of one trial, in place of `preston_m2_n`.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(with = "ObservedEdge"))]
    pub observed: Option<ObservedEdge>,
}

impl Default for RemovalSettings {
    fn default() -> Self {
        Self {
            preston_m2_n: None,
            filament_wear_m2_n: None,
            compensate: false,
            alternate: false,
            force_loss: 0.2,
            edge_feed_velocity_m_s: None,
            until: None,
            observed: None,
        }
    }
}

/// When the removal ends: one of the three.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum RemovalGoal {
    /// At this radius of the edge, in m.
    EdgeRadiusM(f64),
    /// After so many turns of the tool.
    Turns(f64),
    /// After this time in s.
    TimeS(f64),
}

/// The radius of an edge that was measured after a time of brushing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ObservedEdge {
    /// The radius in m.
    pub edge_radius_m: f64,
    /// Standard deviation of the radius in m; `None` if it is not known.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub edge_radius_std_m: Option<f64>,
    /// The time for which the edge was brushed, in s.
    pub time_s: f64,
}
