//! The settings of a simulation.
//!
//! The name of a field is its key in an input file, and the unit is part of the name (SI
//! throughout, angles in radians). One table, [`crate::model::parameters::PARAMETERS`], has the
//! ranges of all numbers. The crate `bristle-study` reads the file.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use crate::equations::linear::{dot, scale};
use crate::model::record::Scalar;

/// Everything that one simulation depends on.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Settings {
    /// The brushing tool.
    pub tool: ToolSettings,
    /// One filament of the tool.
    pub filament: FilamentSettings,
    /// The contact law between filament and workpiece.
    #[cfg_attr(feature = "serde", serde(default))]
    pub contact: ContactSettings,
    /// The workpiece.
    #[cfg_attr(feature = "serde", serde(default))]
    pub workpiece: WorkpieceSettings,
    /// Motion of the tool over the workpiece.
    pub process: ProcessSettings,
    /// The numerical solution and its output.
    #[cfg_attr(feature = "serde", serde(default))]
    pub solver: SolverSettings,
    /// Uncertainty of the filaments, for `bristle study`.
    #[cfg_attr(feature = "serde", serde(default))]
    pub uncertainty: UncertaintySettings,
    /// The filaments that touch each other. Without this section, a case of a study is one filament
    /// alone.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "BrushSettings"))]
    pub brush: Option<BrushSettings>,
    /// Removal from the workpiece and wear of the filaments. Without this section only the work of
    /// the contact is known.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "RemovalSettings"))]
    pub removal: Option<RemovalSettings>,
}

impl Settings {
    /// Settings with these parts and defaults for everything else: a plane, no friction, the
    /// paper's contact law.
    #[must_use]
    pub fn new(tool: ToolSettings, filament: FilamentSettings, process: ProcessSettings) -> Self {
        Self {
            tool,
            filament,
            contact: ContactSettings::default(),
            workpiece: WorkpieceSettings::default(),
            process,
            solver: SolverSettings::default(),
            uncertainty: UncertaintySettings::default(),
            brush: None,
            removal: None,
        }
    }

    /// Returns the brush of Uhlmann and Hoyer (2021) on a plane, at the brushing velocity `v_b`
    /// (m/s) and the penetration depth `a_e` (m). Settings that the paper does not state have their
    /// defaults.
    ///
    /// Frictionless, as in the paper: forces are upper bounds.
    ///
    /// ```
    /// let mut settings = bristle::model::settings::Settings::paper(10.0, 1e-3);
    /// settings.filament.segments = 10;
    /// settings.contact.friction_coefficient = 0.3;
    /// assert_eq!(settings.check(), Ok(()));
    /// ```
    #[must_use]
    pub fn paper(brushing_velocity_m_s: f64, penetration_depth_m: f64) -> Self {
        let process = ProcessSettings::new(brushing_velocity_m_s, penetration_depth_m);
        let tool = ToolSettings {
            filament_count_uncertainty: 600.0,
            ..ToolSettings::new(0.140, 0.020, 10_500.0)
        };
        Self::new(tool, FilamentSettings::new(0.040, 1.18e-3), process)
    }

    /// The force with which the tool is pressed on, in N; zero if the penetration depth is given.
    #[must_use]
    pub fn tool_force_n(&self) -> f64 {
        self.process.tool_force_n.unwrap_or(0.0)
    }

    /// States the force with which the tool is pressed on (N) in place of the penetration depth.
    pub fn set_tool_force_n(&mut self, force_n: f64) {
        (self.process.tool_force_n, self.process.penetration_depth_m) = (Some(force_n), 0.0);
    }

    /// Returns the settings with the penetration depth `depth_m` (m) and without a force.
    #[must_use]
    pub fn at_depth(&self, depth_m: f64) -> Self {
        let mut settings = self.clone();
        (
            settings.process.tool_force_n,
            settings.process.penetration_depth_m,
        ) = (None, depth_m);
        settings
    }

    /// Number of filaments per area of the body's surface in 1/m².
    #[must_use]
    pub fn filaments_per_m2(&self) -> f64 {
        self.tool.filament_count / self.tool.surface_m2()
    }

    /// Changes the number of filaments to this one per area of the body's surface in 1/m².
    pub fn set_filaments_per_m2(&mut self, filaments_per_m2: f64) {
        self.tool.filament_count = filaments_per_m2 * self.tool.surface_m2();
    }

    /// Share of the body's surface that is covered by the cross-sections of the filaments at their
    /// roots.
    #[must_use]
    pub fn fill_factor(&self) -> f64 {
        self.filaments_per_m2() * self.filament.root_area_m2()
    }

    /// Changes the number of filaments to that which covers this share of the body's surface.
    pub fn set_fill_factor(&mut self, fill_factor: f64) {
        self.set_filaments_per_m2(fill_factor / self.filament.root_area_m2());
    }

    /// The section `[brush]`, or its defaults if there is none.
    #[must_use]
    pub fn brush_or_default(&self) -> BrushSettings {
        self.brush.clone().unwrap_or_default()
    }

    /// The section `[removal]`, or its defaults if there is none.
    #[must_use]
    pub fn removal_or_default(&self) -> RemovalSettings {
        self.removal.clone().unwrap_or_default()
    }

    /// Number of rows of filaments along the axis: that which the settings state, or else that of a
    /// pitch as equal both ways as it can be.
    #[must_use]
    pub fn brush_rows(&self) -> usize {
        let tool = &self.tool;
        // Without a filament there is one row, and no column.
        let pitch = (TAU * tool.body_radius_m * tool.width_m / tool.filament_count).sqrt();
        let stated = self.brush.as_ref().and_then(|brush| brush.rows);
        stated.unwrap_or_else(|| ((tool.width_m / pitch).round() as usize).max(1))
    }
}

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

/// Motion of the tool over the workpiece.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProcessSettings {
    /// Brushing velocity `v_b = ω R`, the speed of the undeformed tip, in m/s. A file may give
    /// `rotational_speed_rpm` instead. May be left out if `[study]` sweeps it.
    pub brushing_velocity_m_s: f64,
    /// Penetration depth `a_e` of the undeformed tool into the workpiece, in m. May be left out if
    /// `[study]` sweeps it, or in a bore narrower than the brush, which is then concentric.
    pub penetration_depth_m: f64,
    /// Force `F_n,w` with which the tool is pressed on, in N, in place of the penetration depth,
    /// which is then found; none if the depth is given.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub tool_force_n: Option<f64>,
    /// Gravitational acceleration, in m/s².
    #[cfg_attr(feature = "serde", serde(default))]
    pub gravity_m_s2: [f64; 3],
    /// Angle before nominal entry at which the simulation starts, in rad.
    #[cfg_attr(feature = "serde", serde(default = "default_lead_angle_rad"))]
    pub lead_angle_rad: f64,
    /// Angle past nominal exit at which the simulation ends, in rad.
    #[cfg_attr(feature = "serde", serde(default = "default_tail_angle_rad"))]
    pub tail_angle_rad: f64,
    /// Number of turns of the tool, or "steady": until the impulse no longer changes, at most 50.
    /// The metrics are those of the last turn. A single turn ends at the tail angle, several are
    /// whole. Without it one, or "steady" where filaments touch during the whole turn.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "Turns"))]
    pub turns: Option<Turns>,
}

impl ProcessSettings {
    /// The turns of a filament that comes free of the workpiece in each of them.
    #[must_use]
    pub fn turns(&self) -> Turns {
        self.turns.unwrap_or_default()
    }
}

/// The largest number of turns of a pass.
pub const MAX_TURNS: usize = 50;

/// Relative change of the impulse from turn to turn below which turns are steady.
pub const MAX_STEADY_CHANGE: f64 = 1e-3;

/// For how many turns of the tool a filament is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turns {
    /// This number.
    Count(usize),
    /// Until the contact normal impulses of two successive turns differ by less than 0.1 %, but for
    /// at most [`MAX_TURNS`].
    Steady,
}

impl Turns {
    /// The word for [`Turns::Steady`] in files.
    pub const STEADY: &'static str = "steady";

    /// The largest number of turns that this can be.
    #[must_use]
    pub fn at_most(self) -> usize {
        match self {
            Self::Count(count) => count,
            Self::Steady => MAX_TURNS,
        }
    }
}

/// A single pass.
impl Default for Turns {
    fn default() -> Self {
        Self::Count(1)
    }
}

/// The largest number of turns. Numbers of turns are counts.
impl Scalar for Turns {
    const WHOLE: bool = true;

    fn into_f64(self) -> f64 {
        self.at_most() as f64
    }

    fn from_f64(value: f64) -> Self {
        Self::Count(value as usize)
    }
}

/// A number, or the word.
#[cfg(feature = "serde")]
impl serde::Serialize for Turns {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Count(count) => serializer.serialize_u64(*count as u64),
            Self::Steady => serializer.serialize_str(Self::STEADY),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Turns {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TurnsVisitor)
    }
}

#[cfg(feature = "serde")]
struct TurnsVisitor;

#[cfg(feature = "serde")]
impl serde::de::Visitor<'_> for TurnsVisitor {
    type Value = Turns;

    fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "a whole number from 1 to {MAX_TURNS} or \"{}\"",
            Turns::STEADY
        )
    }

    fn visit_u64<E: serde::de::Error>(self, count: u64) -> Result<Turns, E> {
        let found = serde::de::Unexpected::Unsigned(count);
        let count = usize::try_from(count)
            .ok()
            .filter(|count| (1..=MAX_TURNS).contains(count));
        count
            .map(Turns::Count)
            .ok_or_else(|| E::invalid_value(found, &self))
    }

    fn visit_i64<E: serde::de::Error>(self, count: i64) -> Result<Turns, E> {
        match u64::try_from(count) {
            Ok(count) => self.visit_u64(count),
            Err(_) => Err(E::invalid_value(
                serde::de::Unexpected::Signed(count),
                &self,
            )),
        }
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Turns, E> {
        let is_known = word == Turns::STEADY;
        is_known
            .then_some(Turns::Steady)
            .ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(word), &self))
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Turns {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Turns".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "anyOf": [{ "type": "integer", "minimum": 1, "maximum": MAX_TURNS }, { "const": Self::STEADY }],
        })
    }
}

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

impl ProcessSettings {
    /// This brushing velocity `v_b` in m/s and penetration depth `a_e` in m, without gravity.
    #[must_use]
    pub fn new(brushing_velocity_m_s: f64, penetration_depth_m: f64) -> Self {
        Self {
            brushing_velocity_m_s,
            penetration_depth_m,
            tool_force_n: None,
            gravity_m_s2: [0.0; 3],
            lead_angle_rad: default_lead_angle_rad(),
            tail_angle_rad: default_tail_angle_rad(),
            turns: None,
        }
    }
}

#[cfg(feature = "serde")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
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

fn default_lead_angle_rad() -> f64 {
    0.005
}

fn default_tail_angle_rad() -> f64 {
    0.15
}
