//! Sensitivity of the tool force of one contact to single settings.

use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use bristle::simulation::simulate;

/// Share by which a setting is changed.
const CHANGE: f64 = 0.1;
/// Value that a setting is changed to if it is zero.
const INSTEAD_OF_ZERO: f64 = 0.1;

/// Change of the tool force with one setting.
#[derive(Clone, Debug)]
pub struct ForceSensitivity {
    /// The setting.
    pub parameter: &'static Parameter,
    /// Its value.
    pub value: f64,
    /// The value that it is changed to.
    pub changed: f64,
    /// Share by which the tool force changes then. `None` if a pass failed, or there is no force to
    /// change.
    pub force_change: Option<f64>,
}

/// Changes each of some settings of one contact alone, of a filament alone, and simulates it.
#[must_use]
pub fn force_sensitivities(
    settings: &Settings,
    parameters: &[&'static Parameter],
) -> Vec<ForceSensitivity> {
    let alone = Settings {
        brush: None,
        ..settings.clone()
    };
    let force =
        |settings: &Settings| Some(simulate(settings).ok()?.metrics.tool_contact_normal_force_n);
    let nominal = (!parameters.is_empty())
        .then(|| force(&alone))
        .flatten()
        .filter(|force| *force > 0.0);
    let sensitivity = |&parameter: &&'static Parameter| {
        let value = parameter.get(settings);
        let changed = if value == 0.0 {
            INSTEAD_OF_ZERO
        } else {
            (1.0 + CHANGE) * value
        };
        let mut other = alone.clone();
        parameter.set(&mut other, changed);
        let force_change = nominal.and_then(|nominal| Some(force(&other)? / nominal - 1.0));
        ForceSensitivity {
            parameter,
            value,
            changed,
            force_change,
        }
    };
    parameters.iter().map(sensitivity).collect()
}
