//! Settings of the tool: section `[tool]`.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// The brushing tool.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ToolSettings {
    /// Kind of tool: it sets the defaults of `filament_angle_rad` and `tilt_rad`, and has no other
    /// effect.
    #[cfg_attr(feature = "serde", serde(default))]
    pub kind: ToolKind,
    /// Radius `r_g` of the brush body, at which the filaments are clamped, in m; in the middle of
    /// the trim.
    pub body_radius_m: f64,
    /// Width `b` of the trim, across its filaments, in m: of a round brush that along its axis.
    pub width_m: f64,
    /// Angle `γ` of the filaments to the axis, in rad: π/2 for radial ones, 0 for those of a cup.
    /// Without it that of the kind; a cone states it.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub filament_angle_rad: Option<f64>,
    /// Tilt `τ` of the tool's axis about `x`, in rad: π/2 points it into the workpiece. Without it
    /// that of the kind: 0 of a round brush, π/2 of a cup, π/2 − γ of a cone.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub tilt_rad: Option<f64>,
    /// Skew `σ` of the tool's axis about `y`, after its tilt, in rad.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub skew_rad: f64,
    /// Number of filaments along the trim that are simulated where they differ: on a tilted or
    /// conical tool. One is that in the middle, and the penetration depth is then its own. Without
    /// it 5, or 33 where part of the trim lifts off the workpiece.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "usize"))]
    pub positions: Option<usize>,
    /// Number `N_f` of filaments on the tool. A file may give `filaments_per_m2` or `fill_factor`
    /// instead. As an estimate, it need not be a whole number.
    pub filament_count: f64,
    /// Uncertainty of the number of filaments: its standard deviation.
    #[cfg_attr(feature = "serde", serde(default))]
    pub filament_count_uncertainty: f64,
}

/// The kinds of tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum ToolKind {
    /// A round brush with radial filaments.
    #[default]
    Round,
    /// A cup, end or disc brush with axial filaments, its axis at right angles to the workpiece.
    Cup,
    /// A cone, whose filaments meet the workpiece at right angles.
    Cone,
}

impl ToolSettings {
    /// A round brush with this body radius `r_g` and width, both in m, and exactly this number of
    /// filaments.
    #[must_use]
    pub fn new(body_radius_m: f64, width_m: f64, filament_count: f64) -> Self {
        Self {
            kind: ToolKind::default(),
            body_radius_m,
            width_m,
            filament_angle_rad: None,
            tilt_rad: None,
            skew_rad: 0.0,
            positions: None,
            filament_count,
            filament_count_uncertainty: 0.0,
        }
    }

    /// Angle `γ` of the filaments to the axis in rad. A cone has to state it, and has π/4 where it
    /// does not.
    #[must_use]
    pub fn filament_angle_rad(&self) -> f64 {
        self.filament_angle_rad.unwrap_or(match self.kind {
            ToolKind::Round => FRAC_PI_2,
            ToolKind::Cup => 0.0,
            ToolKind::Cone => FRAC_PI_4,
        })
    }

    /// Number of filaments along a trim that touches the workpiece all along.
    #[must_use]
    pub fn positions(&self) -> usize {
        self.positions.unwrap_or(5)
    }

    /// Tilt `τ` of the axis in rad.
    #[must_use]
    pub fn tilt_rad(&self) -> f64 {
        self.tilt_rad.unwrap_or(match self.kind {
            ToolKind::Round => 0.0,
            ToolKind::Cup => FRAC_PI_2,
            ToolKind::Cone => FRAC_PI_2 - self.filament_angle_rad(),
        })
    }

    /// Area of the body's surface that carries the filaments, `2π r_g` times the width, in m².
    #[must_use]
    pub fn surface_m2(&self) -> f64 {
        TAU * self.body_radius_m * self.width_m
    }
}

#[cfg(feature = "serde")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
