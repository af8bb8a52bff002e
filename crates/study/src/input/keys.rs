//! Names of sections and keys that several files know.

/// Section that states the sweeps and the named tools. Its other keys are short names and paths of
/// settings.
pub(crate) const STUDY: &str = "study";
/// Key of the named tools in `[study]`.
pub(crate) const TOOLS: &str = "tools";
/// Sections whose keys a tool may state.
pub(crate) const SECTIONS: [&str; 5] = ["tool", "filament", "contact", "uncertainty", "brush"];

/// Section of the filament, with its key for a material.
pub(crate) const FILAMENT: &str = "filament";
pub(crate) const MATERIAL_KEY: &str = "material";

/// Section of the workpiece, and the path of the control points of a profile.
pub(crate) const WORKPIECE: &str = "workpiece";
pub(crate) const CONTROL_POINTS: &str = "workpiece.control_points_m";
