//! Tool force where filaments are not known exactly: sampled tools, the band of their forces, and
//! the shares of the inputs.
//!
//! From the settings of a case, [`Scatter`] makes the settings of sampled tools. Each tool is
//! simulated like any case, and [`Scatter`] reduces the impulses to a [`ForceScatter`]. Length,
//! diameter, Young's modulus, damping ratio and waviness of the filaments are normally distributed
//! about the settings, and so is the number of filaments. The coefficient of friction has a normal
//! distribution that is cut at zero. All filaments of a tool are alike: the result is the scatter
//! of the force from tool to tool. If instead the filaments of one tool differ, they share one axis
//! (`hold = "machine"`). Their forces then add up to the mean, and only the number of filaments
//! scatters.
//!
//! Samples are a scrambled Sobol sequence (Owen 1995, Burley 2020), the same in all cases with the
//! same seed. Bands are therefore as smooth over the process as the forces are.

use spec_math::cephes64::{ndtr, ndtri};

use bristle::model::parameters::Violation;
use bristle::model::settings::{Hold, Settings, UncertaintySettings};

mod calibration;
#[cfg(test)]
mod coverage;
mod force_scatter;
mod indices;
mod inputs;
mod scatter;
#[cfg(test)]
mod tests;

pub use force_scatter::ForceScatter;
pub use inputs::{INPUT_COUNT, INPUTS, Input, MOVING, SHARES, scatter_text};
pub use scatter::Scatter;

/// Ends of the band, as shares of the tools.
pub(crate) const BAND: [f64; 2] = [0.025, 0.975];

/// Checks settings, and those of the tools sampled about them.
///
/// # Errors
/// The first setting outside its range.
pub fn check(settings: &Settings) -> Result<(), Violation> {
    settings.check()?;
    settings
        .uncertainty
        .calibration
        .as_ref()
        .map_or(Ok(()), calibration::check)?;
    Scatter::of(&sampled(settings)).map_or(Ok(()), |scatter| scatter.check())
}

/// Returns `true` if some property of the filaments scatters from tool to tool. Deviations from
/// filament to filament of a brush do not.
#[must_use]
pub fn scatters(settings: &Settings) -> bool {
    let uncertainty = &settings.uncertainty;
    let is_within = settings.brush.is_some() && uncertainty.hold == Hold::Machine;
    uncertainty.calibration.is_some() || (uncertainty.scatters() && !is_within)
}

/// Returns the settings about which tools are sampled: those of filaments alone, with the
/// deviations from tool to tool.
#[must_use]
pub fn sampled(settings: &Settings) -> Settings {
    let mut alone = Settings {
        brush: None,
        ..settings.clone()
    };
    if settings.brush.is_some() && settings.uncertainty.hold == Hold::Machine {
        let UncertaintySettings {
            samples,
            seed,
            calibration,
            ..
        } = settings.uncertainty.clone();
        alone.uncertainty = UncertaintySettings {
            samples,
            seed,
            calibration,
            ..UncertaintySettings::default()
        };
    }
    alone
}

/// Returns the share of tools whose force is at most `force_n`, from the lower end, the median and
/// the upper end of their 95 % interval in N: a normal distribution on each side of the median.
#[must_use]
pub fn share_below(force_n: f64, [lower, median, upper]: [f64; 3]) -> f64 {
    let end = if force_n < median { lower } else { upper };
    let std = (end - median).abs() / ndtri(BAND[1]);
    let distance = force_n - median;
    if distance == 0.0 {
        0.5
    } else {
        ndtr(distance / std)
    }
}

/// Returns the quantile of sorted values: the value below which `share` of them lies. Value `k` is
/// the quantile at `(k − ½)/n`, with linear interpolation between values (Hyndman and Fan 1996, no.
/// 5).
pub(crate) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = (share * sorted.len() as f64 - 0.5).clamp(0.0, (sorted.len() - 1) as f64);
    let below = sorted[place.floor() as usize];
    let above = sorted[place.ceil() as usize];
    below + place.fract() * (above - below)
}
