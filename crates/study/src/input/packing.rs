//! Fill of the trim of a brush.

use std::f64::consts::TAU;

use bristle::model::settings::Settings;

/// Distance of the tips, in diameters, below which filaments touch each other to an effect. Beyond
/// it, the impulse of a planar row is that of a filament alone within 5 %. This holds from 2 to 30
/// m/s and from 0.5 to 3 mm (docs/notes.md, "Where it matters").
pub const PACKED: f64 = 3.5;

/// Returns the mean distance of the tips over the larger diameter of a filament.
#[must_use]
pub fn tip_spacing(settings: &Settings) -> f64 {
    let (tool, filament) = (&settings.tool, &settings.filament);
    let pitch = (TAU * settings.tool_radius_m() * tool.width_m / tool.filament_count).sqrt();
    pitch / filament.diameter_m.max(filament.tip_diameter_m())
}
