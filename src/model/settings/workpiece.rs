//! Settings of the workpiece: section `[workpiece]`.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use crate::equations::linear::{dot, scale};

/// The workpiece.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WorkpieceSettings {
    /// Feed velocity `v_ft` of the workpiece, in m/s: along `x`; for another normal `n`, along `n ×
    /// z`.
    pub feed_velocity_m_s: f64,
    /// The kind of workpiece, and what a workpiece of that kind has.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub kind: WorkpieceKind,
}

/// The outward unit normal; NaN if the settings state none.
pub fn unit_normal(settings: &WorkpieceSettings) -> [f64; 3] {
    let normal = settings.kind.normal();
    // Scaled by the largest component first, so that squares neither overflow nor vanish.
    let largest = normal
        .iter()
        .fold(0.0_f64, |largest, component| largest.max(component.abs()));
    let normal = normal.map(|component| component / largest);
    scale(1.0 / dot(normal, normal).sqrt(), normal)
}

/// The kinds of workpiece.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "kind", rename_all = "lowercase")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum WorkpieceKind {
    /// A plane.
    Plane(PlaneSettings),
    /// Two faces that meet in a rounded edge, one of them along `y = 0`.
    Edge(EdgeSettings),
    /// An edge with a chamfer, whose own two edges are rounded.
    Chamfer(ChamferSettings),
    /// A convex cylinder with its top at `x = 0`, `y = 0`.
    Cylinder(RoundSettings),
    /// A bore around the tool, with its bottom at `x = 0`, `y = 0`.
    Bore(RoundSettings),
    /// A B-spline through the plane of rotation, extruded along `z`.
    Profile(ProfileSettings),
}

impl Default for WorkpieceKind {
    fn default() -> Self {
        Self::Plane(PlaneSettings::default())
    }
}

impl WorkpieceKind {
    /// A plane with an outward `normal` of any length.
    #[must_use]
    pub fn plane(normal: [f64; 3]) -> Self {
        Self::Plane(PlaneSettings { normal })
    }

    /// An edge with faces at right angles that filaments leave, rounded with the radius
    /// `edge_radius_m` (m).
    #[must_use]
    pub fn edge(edge_radius_m: f64) -> Self {
        Self::Edge(EdgeSettings {
            edge_radius_m,
            ..EdgeSettings::default()
        })
    }

    /// A cylinder of the radius `radius_m` (m) with its top below the tool axis.
    #[must_use]
    pub fn cylinder(radius_m: f64) -> Self {
        Self::Cylinder(RoundSettings {
            radius_m,
            ..RoundSettings::default()
        })
    }

    /// A bore of the radius `radius_m` (m) with its bottom below the tool axis.
    #[must_use]
    pub fn bore(radius_m: f64) -> Self {
        Self::Bore(RoundSettings {
            radius_m,
            ..RoundSettings::default()
        })
    }

    /// Its name in an input file.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Edge(_) => "edge",
            Self::Chamfer(_) => "chamfer",
            Self::Cylinder(_) => "cylinder",
            Self::Bore(_) => "bore",
            Self::Profile(_) => "profile",
        }
    }

    /// Returns `true` for a plane.
    #[must_use]
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Plane(_))
    }

    /// Its outward normal, of any length.
    #[must_use]
    pub fn normal(&self) -> [f64; 3] {
        if let Self::Plane(plane) = self {
            plane.normal
        } else {
            PlaneSettings::default().normal
        }
    }

    /// The radius of its edges in m; zero if it has no edges.
    #[must_use]
    pub fn edge_radius_m(&self) -> f64 {
        match self {
            Self::Edge(EdgeSettings { edge_radius_m, .. })
            | Self::Chamfer(ChamferSettings { edge_radius_m, .. }) => *edge_radius_m,
            _ => 0.0,
        }
    }

    /// Changes the radius of its edges, in m, if it has edges.
    pub fn set_edge_radius_m(&mut self, radius_m: f64) {
        if let Self::Edge(EdgeSettings { edge_radius_m, .. })
        | Self::Chamfer(ChamferSettings { edge_radius_m, .. }) = self
        {
            *edge_radius_m = radius_m;
        }
    }
}

/// A plane.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlaneSettings {
    /// Outward normal of a plane, of any length, with a component perpendicular to the tool axis
    /// `z`. The penetration depth is measured along it. Other kinds have `[0, 1, 0]`.
    pub normal: [f64; 3],
}

impl Default for PlaneSettings {
    fn default() -> Self {
        Self {
            normal: [0.0, 1.0, 0.0],
        }
    }
}

/// A rounded edge.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EdgeSettings {
    /// Where the workpiece's own `x = 0` lies at time zero, in m. A plane has none.
    pub offset_m: f64,
    /// Angle between the faces of an edge or a chamfered edge, through the material, in rad.
    pub included_angle_rad: f64,
    /// Radius with which the edges of an edge or a chamfer are rounded, in m.
    pub edge_radius_m: f64,
    /// Side from which filaments come to the edge.
    pub side: Side,
}

impl Default for EdgeSettings {
    fn default() -> Self {
        Self {
            offset_m: 0.0,
            included_angle_rad: FRAC_PI_2,
            edge_radius_m: 0.0,
            side: Side::default(),
        }
    }
}

/// An edge with a chamfer.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ChamferSettings {
    /// Where the workpiece's own `x = 0` lies at time zero, in m. A plane has none.
    pub offset_m: f64,
    /// Angle between the faces of an edge or a chamfered edge, through the material, in rad.
    pub included_angle_rad: f64,
    /// Radius with which the edges of an edge or a chamfer are rounded, in m.
    pub edge_radius_m: f64,
    /// Side from which filaments come to the edge.
    pub side: Side,
    /// Width of the face of a chamfer before its edges are rounded, in m.
    pub chamfer_width_m: f64,
    /// Angle of that face to the face along `y = 0`, in rad.
    pub chamfer_angle_rad: f64,
}

impl Default for ChamferSettings {
    fn default() -> Self {
        Self {
            offset_m: 0.0,
            included_angle_rad: FRAC_PI_2,
            edge_radius_m: 0.0,
            side: Side::default(),
            chamfer_width_m: 0.0,
            chamfer_angle_rad: FRAC_PI_4,
        }
    }
}

/// A cylinder or a bore.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RoundSettings {
    /// Where the workpiece's own `x = 0` lies at time zero, in m. A plane has none.
    pub offset_m: f64,
    /// Radius of a cylinder or a bore, in m.
    pub radius_m: f64,
}

/// A profile.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields, default)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProfileSettings {
    /// Where the workpiece's own `x = 0` lies at time zero, in m. A plane has none.
    pub offset_m: f64,
    /// Degree of the B-spline of a profile.
    pub degree: usize,
    /// Its control points `[x, y]`, in m, with the material on the right-hand side of the curve.
    pub control_points_m: Vec<[f64; 2]>,
    /// `true` if the curve of a profile is closed.
    pub closed: bool,
}

impl Default for ProfileSettings {
    fn default() -> Self {
        Self {
            offset_m: 0.0,
            degree: 3,
            control_points_m: Vec::new(),
            closed: false,
        }
    }
}

/// Side from which filaments come to an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Side {
    /// Filaments sweep over the material, at `x ≤ 0`, and off it.
    #[default]
    Leaving,
    /// Filaments come from outside onto the material, at `x ≥ 0`.
    Entering,
}
