//! Tool force of a brush whose filaments are not known exactly.
//!
//! Brushes for all sampled tools would cost a hundred times as much as one. The forces are therefore
//! those of filaments alone, times the effect of interaction. Where filaments sweep, the effect is
//! nearly that at the stated values. Elsewhere two more brushes, at the ends of the band, say how it
//! changes with what is uncertain (docs/trust.md, "Interval of the tool force").

use std::fmt::Display;
use std::iter;
use std::num::NonZeroUsize;

use bristle::model::metrics::Metrics;
use bristle::model::settings::{Settings, UncertaintySettings};

use crate::grid::scheduler::run_study;
use crate::grid::study::Study;
use crate::grid::uncertainty::{ForceScatter, Scatter, check, sampled, scatters};

/// Contact time ratio of a brush from which on filaments sweep for most of their way
/// (docs/speed-and-depth.md).
const CLEARLY_SWEEPING: f64 = 0.6;
/// Least tolerance of the brushes at the ends of the band. It is far below the width of the band,
/// and takes less time than the default.
const END_TOLERANCE: f64 = 1e-2;

/// Sampled tools of a brush.
pub(super) struct SampledBrush<'a> {
    settings: &'a Settings,
    /// Metrics of the brush at the stated values.
    tool: &'a Metrics,
    scatter: Scatter,
    /// Impulses of the sampled tools in N s, without interaction.
    impulses: Vec<Option<f64>>,
    /// Force with interaction over that without.
    effect: f64,
}

impl<'a> SampledBrush<'a> {
    /// Samples the tools about a brush with the metrics `tool`. `None` if nothing scatters from tool
    /// to tool, or a filament alone has no force.
    ///
    /// # Errors
    /// If filaments alone cannot be simulated, in words.
    pub fn of(settings: &'a Settings, tool: &'a Metrics) -> Result<Option<Self>, String> {
        if !scatters(settings) {
            return Ok(None);
        }
        let alone = sampled(settings);
        check(&alone).map_err(|error| without_interval(&error))?;
        let Some(scatter) = Scatter::of(&alone) else {
            return Ok(None);
        };
        let (nominal, impulses) =
            simulate_tools(&alone, &scatter).map_err(|error| without_interval(&error))?;
        let effect = tool.tool_contact_normal_force_n / nominal.tool_contact_normal_force_n;
        Ok(effect.is_finite().then_some(Self {
            settings,
            tool,
            scatter,
            impulses,
            effect,
        }))
    }

    /// Corrects the impulses by the effect of interaction on the brushes at the ends of the band,
    /// which `effect_of` simulates, unless filaments sweep. The logarithm of the effect is linear
    /// between either end and the stated values.
    ///
    /// # Errors
    /// If a brush at an end cannot be simulated, in words.
    pub fn corrected<E: Display>(
        mut self,
        mut effect_of: impl FnMut(&Settings) -> Result<f64, E>,
    ) -> Result<Self, String> {
        if self.tool.contact_time_ratio >= CLEARLY_SWEEPING {
            return Ok(self);
        }
        let Some((ends, positions)) = self.scatter.ends(&self.impulses) else {
            return Ok(self);
        };
        let mut log_changes = [0.0; 2];
        for (end, log_change) in log_changes.iter_mut().enumerate() {
            // A tool that does not reach the workpiece has no force to correct.
            let Some(alone) = ends.settings(end) else {
                continue;
            };
            let brush = Settings {
                brush: self.settings.brush.clone(),
                uncertainty: self.settings.uncertainty.clone(),
                ..alone
            };
            brush.check().map_err(|error| without_interval(&error))?;
            let effect = effect_of(&brush).map_err(|error| without_interval(&error))?;
            *log_change = (effect / self.effect).ln();
        }
        if !log_changes.iter().all(|change| change.is_finite()) {
            return Err(without_interval(
                &"filaments of one of its brushes do not touch",
            ));
        }
        for (impulse, position) in self.impulses.iter_mut().zip(positions) {
            let change = log_changes[usize::from(position > 0.0)] * position.abs();
            *impulse = impulse.map(|impulse| impulse * change.exp());
        }
        Ok(self)
    }

    /// Returns the distribution of the tool force. `None` if most of the sampled tools failed.
    pub fn distribution(&self) -> Option<ForceScatter> {
        let scatter = self.scatter.reduce(&self.impulses)?;
        Some(scatter.times(self.effect))
    }
}

/// Returns the settings of a brush that is simulated with less precision, in as many columns as it
/// takes.
pub(super) fn coarse_brush(settings: &Settings) -> Settings {
    let mut brush = settings.brush_or_default();
    brush.tolerance = brush.tolerance.max(END_TOLERANCE);
    if brush.steady {
        brush.columns = None;
    }
    Settings {
        brush: Some(brush),
        ..settings.clone()
    }
}

/// Returns the part of the distribution of a brush's force that a calibration leaves open: that of
/// filaments alone, times the effect of interaction on the brush with the metrics `tool`.
///
/// # Errors
/// If filaments alone cannot be simulated, in words.
pub fn calibration_band(
    settings: &Settings,
    tool: &Metrics,
) -> Result<Option<ForceScatter>, String> {
    let calibrated = Settings {
        uncertainty: UncertaintySettings {
            samples: settings.uncertainty.samples,
            seed: settings.uncertainty.seed,
            calibration: settings.uncertainty.calibration.clone(),
            ..UncertaintySettings::default()
        },
        ..settings.clone()
    };
    let sampled = SampledBrush::of(&calibrated, tool)?;
    Ok(sampled.and_then(|sampled| sampled.distribution()))
}

/// Simulates filaments alone as `settings` state, and those of the sampled tools. Returns the
/// metrics of the former, and the impulses for [`Scatter::reduce`].
///
/// # Errors
/// If the former cannot be simulated, in words.
fn simulate_tools(
    settings: &Settings,
    scatter: &Scatter,
) -> Result<(Metrics, Vec<Option<f64>>), String> {
    let tools: Vec<Option<Settings>> = (0..scatter.count())
        .map(|tool| scatter.settings(tool))
        .collect();
    let without_uncertainty = |settings: &Settings| Settings {
        uncertainty: UncertaintySettings::default(),
        ..settings.clone()
    };
    let cases = iter::once(settings)
        .chain(tools.iter().flatten())
        .map(without_uncertainty);
    let study = Study::of_cases(cases.collect());
    let results =
        run_study(&study, NonZeroUsize::new(1), || ()).map_err(|error| error.to_string())?;
    let mut results = results.into_iter();
    let mut next = || results.next().expect("one result for each case");
    let nominal = next()?;
    let impulse = |tool: &Option<Settings>| match tool {
        Some(_) => Some(next().ok()?.metrics.contact_normal_impulse_n_s),
        // A tool that does not reach the workpiece has no impulse.
        None => Some(0.0),
    };
    Ok((nominal.metrics, tools.iter().map(impulse).collect()))
}

fn without_interval(error: &dyn Display) -> String {
    format!("no interval of the force: {error}")
}

#[cfg(test)]
mod tests {
    use spec_math::cephes64::ndtri;

    use super::*;
    use crate::grid::CaseResult;

    /// A sector near the line between sweeping and striking, which takes a tenth of a second.
    const SECTOR: &str = "\
[tool]
body_radius_m = 0.060
width_m = 0.0025
filament_count = 330
[filament]
segments = 4
length_m = 0.035
diameter_m = 1.0e-3
youngs_modulus_pa = 4.31e9
density_kg_m3 = 1327
[contact]
friction_coefficient = 0.4
[process]
brushing_velocity_m_s = 19.9
penetration_depth_m = 1.5e-3
[brush]
rows = 1
columns = 12
steady = false
tolerance = 0.03
";
    const FRICTION_STD: f64 = 0.1;
    const MODULUS_STD: f64 = 9.482e8;

    fn sector() -> Settings {
        toml::from_str(SECTOR).unwrap_or_else(|error| panic!("{error}"))
    }

    fn results(cases: Vec<Settings>) -> Vec<CaseResult> {
        run_study(&Study::of_cases(cases), None, || ()).expect("threads")
    }

    fn uncertain_sector() -> Settings {
        let mut stated = sector();
        stated.uncertainty.friction_coefficient_std = FRICTION_STD;
        stated.uncertainty.youngs_modulus_std_pa = MODULUS_STD;
        stated
    }

    #[test]
    fn only_bands_near_striking_take_more_brushes() {
        let settings = uncertain_sector();
        let corrected = |contact_time_ratio| {
            let tool = Metrics {
                contact_time_ratio,
                tool_contact_normal_force_n: 1.0,
                ..Metrics::default()
            };
            let sampled = SampledBrush::of(&settings, &tool)?.expect("a force that scatters");
            let corrected = sampled.corrected(|_| Err("it overlaps"))?;
            Ok::<_, String>(corrected.distribution().expect("most tools are simulated"))
        };
        assert!(corrected(CLEARLY_SWEEPING).is_ok());
        let error = corrected(0.99 * CLEARLY_SWEEPING).expect_err("a brush is simulated");
        assert_eq!(error, "no interval of the force: it overlaps");
    }

    /// True brushes have friction and moduli in the middles of seven equally probable ranges. With
    /// the effect of interaction at the stated values, 42 of 49 lie in the band.
    #[test]
    fn bands_near_striking_contain_90_to_99_percent_of_true_forces() {
        const RANGES: usize = 7;
        let scatter = results(vec![uncertain_sector()])[0]
            .as_ref()
            .expect("a case")
            .scatter
            .clone();
        let [lower, upper] = scatter.expect("a band").band();
        let deviation = |range: usize| ndtri((range as f64 + 0.5) / RANGES as f64);
        let truth = |number: usize| {
            let mut brush = sector();
            brush.contact.friction_coefficient += FRICTION_STD * deviation(number / RANGES);
            brush.filament.youngs_modulus_pa += MODULUS_STD * deviation(number % RANGES);
            brush
        };
        let inside = results((0..RANGES * RANGES).map(truth).collect())
            .iter()
            .map(|result| {
                let metrics = &result.as_ref().expect("a true brush").metrics;
                metrics.tool_contact_normal_force_n
            })
            .filter(|force| (lower..=upper).contains(force))
            .count();
        let share = inside as f64 / (RANGES * RANGES) as f64;
        assert!(
            (0.90..=0.99).contains(&share),
            "{inside} are in {lower} to {upper} N"
        );
    }
}
