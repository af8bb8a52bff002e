//! The settings of a simulation.
//!
//! The name of a field is its key in an input file, and the unit is part of the name (SI
//! throughout, angles in radians). One table, [`crate::model::parameters::PARAMETERS`], has the
//! ranges of all numbers. The crate `bristle-study` reads the file.

mod brush;
mod contact;
mod filament;
mod process;
mod removal;
mod solver;
mod tool;
mod uncertainty;
mod workpiece;

use std::f64::consts::TAU;

pub use brush::{BrushSettings, Ends, Pattern};
pub use contact::ContactSettings;
pub use filament::FilamentSettings;
pub use process::{MAX_STEADY_CHANGE, MAX_TURNS, ProcessSettings, Turns};
pub use removal::{ObservedEdge, RemovalGoal, RemovalSettings};
pub use solver::SolverSettings;
pub use tool::{ToolKind, ToolSettings};
pub use uncertainty::{CalibrationUncertainty, Hold, UncertaintySettings};
pub use workpiece::{
    ChamferSettings, EdgeSettings, PlaneSettings, ProfileSettings, RoundSettings, Side,
    WorkpieceKind, WorkpieceSettings, unit_normal,
};

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
