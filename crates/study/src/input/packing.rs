//! How densely the trim of a brush is filled.

use std::f64::consts::TAU;

use bristle::model::settings::Settings;

/// Filaments whose tips are closer than so many diameters touch each other to an effect: beyond
/// that, the impulse of a planar row is that of a filament alone within 5 %, from 2 to 30 m/s and
/// from 0.5 to 3 mm (docs/notes.md, "Where it matters").
pub const PACKED: f64 = 3.5;

/// The mean distance of the tips over their diameter: the fill of the trim where it works.
#[must_use]
pub fn tip_spacing(settings: &Settings) -> f64 {
    let (tool, filament) = (&settings.tool, &settings.filament);
    let pitch = (TAU * settings.tool_radius_m() * tool.width_m / tool.filament_count).sqrt();
    pitch / filament.diameter_m.max(filament.tip_diameter_m())
}
