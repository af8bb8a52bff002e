//! The filaments of a brush, each with its own constants.

use crate::contact::ContactLaw;
use crate::model::filament;
use crate::model::settings::{FilamentSettings, Settings};
use crate::simulation::{Filament, Pass};
use crate::tool::{RotaryTool, Turning};
use crate::workpiece::Part;

use super::arrangement::{Root, random_of};

/// A filament of a brush.
pub type ToolFilament = Filament<Turning<RotaryTool>, Part>;

/// Returns `true` if the filaments of a brush differ from each other.
pub fn differ(settings: &Settings) -> bool {
    settings.brush_or_default().lateral_tilt_std_rad > 0.0
        || settings.uncertainty.scatters_within_brush()
}

/// Returns the settings of one filament of a brush: those of all, with its own deviations.
/// Impossible filaments are drawn again.
pub fn settings_of(settings: &Settings, root: &Root) -> Settings {
    /// Draws before the mean is taken.
    const MAX_DRAWS: usize = 1000;
    let brush = settings.brush_or_default();
    let [
        length,
        diameter,
        modulus,
        damping,
        amplitude,
        phase,
        friction,
    ] = settings.uncertainty.deviations_within_brush();
    let mut normal = random_of(brush.seed, [root.column, root.row]);
    let mut own = settings.clone();
    own.filament.lateral_tilt_rad += brush.lateral_tilt_std_rad * normal();
    if !differ(settings) {
        return own;
    }
    let tilt = own.filament.lateral_tilt_rad;
    for _ in 0..MAX_DRAWS {
        let filament = &mut own.filament;
        *filament = FilamentSettings {
            lateral_tilt_rad: tilt,
            ..settings.filament.clone()
        };
        filament.length_m += length * normal();
        let thicker = diameter * normal();
        filament.diameter_m += thicker;
        filament.tip_diameter_m = filament.tip_diameter_m.map(|tip| tip + thicker);
        filament.youngs_modulus_pa += modulus * normal();
        filament.damping_ratio = (filament.damping_ratio + damping * normal()).max(0.0);
        filament.waviness_amplitude_m += amplitude * normal();
        filament.waviness_phase_rad += phase * normal();
        own.contact.friction_coefficient =
            (settings.contact.friction_coefficient + friction * normal()).max(0.0);
        if own.check().is_ok() {
            return own;
        }
    }
    Settings {
        brush: own.brush,
        ..settings.clone()
    }
}

/// Creates the filament that its `own` settings state. It turns as `pass`, behind it by the angle
/// of its root.
pub fn filament(own: &Settings, pass: &Pass, root: &Root) -> ToolFilament {
    let Turning {
        tool,
        rate,
        initial_angle,
    } = *pass.tool();
    let tool = RotaryTool {
        lateral_tilt: own.filament.lateral_tilt_rad,
        height: root.z,
        ..tool
    };
    Filament {
        chain: filament::chain(&own.filament, own.process.gravity_m_s2),
        motion: Turning {
            tool,
            rate,
            initial_angle: initial_angle - root.angle,
        },
        law: ContactLaw::from(&own.contact),
        workpiece: pass.workpiece().clone(),
    }
}

/// Returns `true` if an untouched filament turns rigidly with the body: a straight one in its
/// plane, without gravity.
pub fn rest(own: &Settings) -> bool {
    own.filament.waviness_amplitude_m == 0.0
        && own.filament.lateral_tilt_rad == 0.0
        && own.process.gravity_m_s2 == [0.0; 3]
}

/// Returns the radii of the segments of a filament in m, at their centres.
pub fn radii(filament: &FilamentSettings) -> impl Iterator<Item = f64> {
    let count = filament.segments as f64;
    (0..filament.segments)
        .map(move |k| 0.5 * filament::diameter_at(filament, (k as f64 + 0.5) / count))
}
