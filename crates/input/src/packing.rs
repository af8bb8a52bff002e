//! How densely the trim of a brush is filled.

use std::f64::consts::TAU;

use bristle::model::settings::Settings;

/// Filaments whose tips are closer than so many diameters touch each other to an effect: the impulse of a row is then that of a filament
/// alone to 5 % by chance only (docs/interaction.md, "Where it matters").
pub const PACKED: f64 = 2.0;

/// The mean distance of the tips over their diameter: the fill of the trim where it works.
#[must_use]
pub fn tip_spacing(settings: &Settings) -> f64 {
    let (tool, filament) = (&settings.tool, &settings.filament);
    let pitch = (TAU * settings.tool_radius_m() * tool.width_m / tool.filament_count).sqrt();
    pitch / filament.diameter_m.max(filament.tip_diameter_m())
}
