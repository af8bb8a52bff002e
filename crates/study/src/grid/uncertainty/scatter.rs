//! The sampled tools of a case, and the reduction of their impulses to a [`ForceScatter`].

use bristle::model::metrics::tool_force;
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{CalibrationUncertainty, Hold, Settings};
use spec_math::cephes64::ndtri;

use super::force_scatter::ForceScatter;
use super::indices::{first_order, mean_and_variance};
use super::inputs::{INPUT_COUNT, INPUTS, MOVING, get, parameter};
use super::{BAND, calibration, quantile, scatters};

/// The sampled tools of a case.
#[derive(Clone, Debug)]
pub struct Scatter {
    settings: Settings,
    /// Inputs as settings, with their means and standard deviations.
    inputs: [&'static Parameter; INPUT_COUNT],
    means: [f64; INPUT_COUNT],
    stds: [f64; INPUT_COUNT],
    /// Standard normal numbers for each tool, one per input.
    points: Vec<[f64; INPUT_COUNT]>,
    /// For each tool with calibrated settings: their normal numbers, and the means of the inputs.
    calibrated: Vec<(Vec<f64>, [f64; INPUT_COUNT])>,
    /// The factor by which the force of each tool differs from a fitted one; empty where nothing is
    /// calibrated.
    misfits: Vec<f64>,
}

impl Scatter {
    /// Samples the tools of the case that `settings` state. `None` if no property of the filaments
    /// scatters, or filaments touch.
    #[must_use]
    pub fn of(settings: &Settings) -> Option<Self> {
        if settings.brush.is_some() || !scatters(settings) {
            return None;
        }
        let seed = settings.uncertainty.seed;
        let point = |index| INPUTS.map(|input| standard_normal(index, input.dimension, seed));
        let tools = 0..settings.uncertainty.samples as u32;
        let calibrated = settings.uncertainty.calibration.iter().flat_map(|own| {
            tools.clone().map(move |index| {
                let number =
                    |dimension| standard_normal(index, (INPUT_COUNT + dimension) as u32, seed);
                let numbers: Vec<f64> = (0..own.settings.len()).map(number).collect();
                let means = calibrated_means(settings, own, &numbers);
                (numbers, means)
            })
        });
        let misfits = settings.uncertainty.calibration.iter().flat_map(|own| {
            let dimension = (INPUT_COUNT + own.settings.len()) as u32;
            let factor = move |index| 1.0 + own.misfit * standard_normal(index, dimension, seed);
            tools.clone().map(factor)
        });
        Some(Self {
            calibrated: calibrated.collect(),
            misfits: misfits.collect(),
            settings: settings.clone(),
            inputs: INPUTS.map(|input| parameter(input.mean)),
            means: INPUTS.map(|input| get(input.mean, settings)),
            stds: INPUTS.map(|input| get(input.std, settings)),
            points: tools.map(point).collect(),
        })
    }

    /// Returns the number of tools.
    #[must_use]
    pub fn count(&self) -> usize {
        self.points.len()
    }

    /// Returns the number of filaments of a tool, counted from 0.
    #[must_use]
    pub fn filament_count(&self, tool: usize) -> f64 {
        self.value(tool, MOVING)
    }

    /// Returns the settings of a tool, counted from 0, with the nominal number of filaments. `None`
    /// if the tool does not reach the workpiece.
    #[must_use]
    pub fn settings(&self, tool: usize) -> Option<Settings> {
        self.settings_but(tool, None)
    }

    /// Returns the settings of a tool, with one input at its mean.
    fn settings_but(&self, tool: usize, at_mean: Option<usize>) -> Option<Settings> {
        let mut settings = self.settings.clone();
        if let (Some(own), Some((numbers, _))) = (
            &self.settings.uncertainty.calibration,
            self.calibrated.get(tool),
        ) {
            calibration::sample(own, &mut settings, numbers);
        }
        for input in (0..MOVING).filter(|input| at_mean != Some(*input)) {
            self.inputs[input].set(&mut settings, self.value(tool, input));
        }
        // A thicker filament has the same taper.
        let nominal = &self.settings.filament;
        settings.filament.tip_diameter_m = settings
            .filament
            .tip_diameter_m
            .map(|tip| tip * (settings.filament.diameter_m / nominal.diameter_m));
        if settings.uncertainty.hold == Hold::Machine {
            settings.process.brushing_velocity_m_s =
                self.settings.angular_velocity_rad_s() * settings.tool_radius_m();
            settings.process.penetration_depth_m += settings.reach_m() - self.settings.reach_m();
        }
        (settings.process.penetration_depth_m > 0.0).then_some(settings)
    }

    /// Returns the tools at both ends of the band, which are not among the sampled ones, and the
    /// position of each sampled tool between them: −1 at the lower end, 1 at the upper one. `None`
    /// if the `impulses`, those of [`Scatter::reduce`], do not depend on the inputs.
    ///
    /// They are the most probable tools with forces at these ends, were the force linear in the
    /// inputs. Few tools then suffice to correct forces of a simpler model (advanced mean value
    /// method; Wu, Millwater and Cruse, AIAA Journal 28, 1990).
    pub(crate) fn ends(&self, impulses: &[Option<f64>]) -> Option<(Self, Vec<f64>)> {
        let known = self.per_filament(impulses);
        let forces: Vec<f64> = known.iter().map(|(_, force)| *force).collect();
        let (mean, _) = mean_and_variance(&forces);
        let scattering = self.scattering();
        // Inputs are independent: the covariance is the slope of the force.
        let mut direction = vec![0.0; self.numbers(0).count()];
        for &(tool, force) in &known {
            for (slope, number) in direction.iter_mut().zip(self.numbers(tool)) {
                *slope += (force - mean) * number;
            }
        }
        let norm = direction
            .iter()
            .map(|slope| slope * slope)
            .sum::<f64>()
            .sqrt();
        if norm == 0.0 {
            return None;
        }
        direction.iter_mut().for_each(|slope| *slope /= norm);
        let distance = ndtri(BAND[1]);
        let numbers = BAND.map(|share| {
            direction
                .iter()
                .map(|slope| ndtri(share) * slope)
                .collect::<Vec<f64>>()
        });
        let point = |numbers: &Vec<f64>| {
            let mut point = [0.0; INPUT_COUNT];
            for (&input, number) in scattering.iter().zip(numbers) {
                point[input] = *number;
            }
            point
        };
        let calibrated = self
            .settings
            .uncertainty
            .calibration
            .iter()
            .flat_map(|own| {
                numbers.iter().map(|numbers| {
                    let numbers = numbers[scattering.len()..].to_vec();
                    let means = calibrated_means(&self.settings, own, &numbers);
                    (numbers, means)
                })
            });
        let ends = Self {
            points: numbers.iter().map(point).collect(),
            calibrated: calibrated.collect(),
            misfits: Vec::new(),
            ..self.clone()
        };
        let position = |tool| {
            let along: f64 = self.numbers(tool).zip(&direction).map(|(a, b)| a * b).sum();
            along / distance
        };
        Some((ends, (0..self.count()).map(position).collect()))
    }

    /// Checks that each tool can be simulated.
    ///
    /// # Errors
    /// The first tool that cannot be simulated, as a violation by the standard deviation that
    /// causes it.
    pub fn check(&self) -> Result<(), Violation> {
        for tool in 0..self.count() {
            let moving = self.check_moving(tool, None);
            let count = self.inputs[MOVING].check(self.value(tool, MOVING));
            moving
                .and(count)
                .map_err(|violation| self.to_blame(tool, violation))?;
        }
        Ok(())
    }

    /// Checks the settings that affect the motion of a tool's filaments, with one input at its
    /// mean.
    fn check_moving(&self, tool: usize, at_mean: Option<usize>) -> Result<(), Violation> {
        // A tool that does not reach the workpiece is not simulated.
        let Some(settings) = self.settings_but(tool, at_mean) else {
            return Ok(());
        };
        self.inputs
            .iter()
            .take(MOVING)
            .try_for_each(|input| input.check(input.get(&settings)))?;
        settings.check_relations()
    }

    /// Attributes the violation by a tool's settings to a standard deviation: that of the wrong
    /// setting itself, or the one without which the tool would be valid.
    fn to_blame(&self, tool: usize, violation: Violation) -> Violation {
        let own = INPUTS
            .iter()
            .position(|input| input.mean == violation.path)
            .filter(|&input| self.stds[input] > 0.0);
        let cure = || {
            (0..MOVING).find(|&input| {
                self.stds[input] > 0.0 && self.check_moving(tool, Some(input)).is_ok()
            })
        };
        let any = || (0..INPUT_COUNT).find(|&input| self.stds[input] > 0.0);
        let (path, value, degree) = match own.or_else(cure).or_else(any) {
            Some(input) => (
                INPUTS[input].std,
                format!("{:?}", self.stds[input]),
                "so small",
            ),
            None => (calibration::PATH, "of errors so large".to_owned(), "such"),
        };
        let Violation {
            path: wrong,
            value: found,
            allowed,
        } = violation;
        let allowed = format!(
            "{degree} that each sampled tool is possible: `{wrong}` of one tool is {found}, not {allowed}"
        );
        Violation {
            path,
            value,
            allowed,
        }
    }

    /// Returns an input of a tool.
    fn value(&self, tool: usize, input: usize) -> f64 {
        let mean = self
            .calibrated
            .get(tool)
            .map_or(self.means[input], |(_, means)| means[input]);
        INPUTS[input]
            .distribution
            .value(mean, self.stds[input], self.points[tool][input])
    }

    /// Returns the calibrated number of filaments over the nominal one.
    fn calibrated_count(&self, tool: usize) -> f64 {
        self.calibrated
            .get(tool)
            .map_or(1.0, |(_, means)| means[MOVING] / self.means[MOVING])
    }

    /// The relative standard deviation of measured forces about fitted ones; zero where nothing is
    /// calibrated.
    fn misfit_std(&self) -> f64 {
        let calibration = &self.settings.uncertainty.calibration;
        calibration.as_ref().map_or(0.0, |own| own.misfit)
    }

    /// The factor by which the force of a tool differs from a fitted one.
    fn misfit(&self, tool: usize) -> f64 {
        self.misfits.get(tool).copied().unwrap_or(1.0)
    }

    /// Reduces the impulses `p_n` in N s of one filament of each tool to the distribution of the
    /// tool force. The impulse of a simulation that failed is `None`. Returns `None` if more than
    /// half of the simulations failed.
    ///
    /// `F_n,w = N_f φ` with the force `φ = p_n ω/(2π)` that one filament adds. Because `N_f` and
    /// `φ` are independent, the mean, variance and indices of the product follow from those of the
    /// factors. The band consists of quantiles of the sampled products.
    ///
    /// # Panics
    /// If the numbers of impulses and tools differ.
    #[must_use]
    pub fn reduce(&self, impulses: &[Option<f64>]) -> Option<ForceScatter> {
        assert_eq!(
            impulses.len(),
            self.count(),
            "an impulse, or none, for each tool"
        );
        let known = self.per_filament(impulses);
        if 2 * known.len() < self.count() {
            return None;
        }
        let per_filament: Vec<f64> = known.iter().map(|(_, force)| *force).collect();
        let count_of = |tool: usize| self.value(tool, MOVING) / self.calibrated_count(tool);
        let mut forces: Vec<f64> = known
            .iter()
            .map(|&(tool, force)| force * count_of(tool) * self.misfit(tool))
            .collect();
        forces.sort_by(f64::total_cmp);
        let [lower, upper] = BAND.map(|share| quantile(&forces, share));
        let median = quantile(&forces, 0.5);

        let (mean, variance) = mean_and_variance(&per_filament);
        let (count, count_std) = (self.means[MOVING], self.stds[MOVING]);
        let variance_of_misfit = (mean * count * self.misfit_std()).powi(2);
        let variance_of_force = variance * count.powi(2)
            + (mean * count_std).powi(2)
            + variance * count_std.powi(2)
            + variance_of_misfit;
        let scattering = self.scattering();
        let points: Vec<Vec<f64>> = known
            .iter()
            .map(|&(tool, _)| self.numbers(tool).collect())
            .collect();
        let (mut shares, mut sobol_calibration) = ([0.0; INPUT_COUNT], 0.0);
        if variance_of_force > 0.0 {
            for (position, index) in first_order(&points, &per_filament).into_iter().enumerate() {
                let share = index * variance * count.powi(2) / variance_of_force;
                match scattering.get(position) {
                    Some(&input) => shares[input] = share,
                    None => sobol_calibration += share,
                }
            }
            shares[MOVING] = (mean * count_std).powi(2) / variance_of_force;
            sobol_calibration += variance_of_misfit / variance_of_force;
        }
        let [
            sobol_length,
            sobol_diameter,
            sobol_youngs_modulus,
            sobol_damping_ratio,
            sobol_waviness_amplitude,
            sobol_waviness_phase,
            sobol_friction_coefficient,
            sobol_filament_count,
        ] = shares;
        Some(ForceScatter {
            tool_force_mean_n: mean * count,
            tool_force_std_n: variance_of_force.sqrt(),
            tool_force_median_n: median,
            tool_force_lower_95_n: lower,
            tool_force_upper_95_n: upper,
            sobol_length,
            sobol_diameter,
            sobol_youngs_modulus,
            sobol_damping_ratio,
            sobol_waviness_amplitude,
            sobol_waviness_phase,
            sobol_friction_coefficient,
            sobol_filament_count,
            sobol_calibration,
            failed_samples: self.count() - known.len(),
        })
    }

    /// Returns each tool whose simulation did not fail, and the force that one filament adds in N.
    fn per_filament(&self, impulses: &[Option<f64>]) -> Vec<(usize, f64)> {
        let force = |(tool, impulse): (usize, &Option<f64>)| {
            // A calibrated number of filaments enters here, because it is correlated with the other
            // calibrated settings.
            let force = tool_force((*impulse)?, self.calibrated_count(tool), self.rate(tool));
            Some((tool, force))
        };
        impulses.iter().enumerate().filter_map(force).collect()
    }

    /// Returns the inputs of the motion that scatter.
    fn scattering(&self) -> Vec<usize> {
        (0..MOVING)
            .filter(|&input| self.stds[input] > 0.0)
            .collect()
    }

    /// Returns the standard normal numbers that make up the motion of a tool: those of the inputs
    /// that scatter, then those of the calibrated settings.
    fn numbers(&self, tool: usize) -> impl Iterator<Item = f64> + '_ {
        let inputs = self.scattering().into_iter();
        let calibrated = self.calibrated.get(tool).map(|(numbers, _)| numbers);
        inputs
            .map(move |input| self.points[tool][input])
            .chain(calibrated.into_iter().flatten().copied())
    }

    /// Returns the rate `ω` of a tool in rad/s.
    fn rate(&self, tool: usize) -> f64 {
        // A tool that does not reach the workpiece adds no force at any rate.
        self.settings(tool)
            .map_or(0.0, |settings| settings.angular_velocity_rad_s())
    }
}

/// Returns the means of the inputs where calibrated settings are those of a sample.
fn calibrated_means(
    settings: &Settings,
    own: &CalibrationUncertainty,
    numbers: &[f64],
) -> [f64; INPUT_COUNT] {
    let mut sampled = settings.clone();
    calibration::sample(own, &mut sampled, numbers);
    INPUTS.map(|input| get(input.mean, &sampled))
}

/// Returns a number of the sequence, transformed to a standard normal distribution.
pub(super) fn standard_normal(index: u32, dimension: u32, seed: u32) -> f64 {
    /// Half the spacing of the numbers, which are multiples of 2⁻²⁴ from 0 on. The midpoints
    /// between them are neither 0 nor 1.
    const HALF: f64 = 1.0 / (1 << 25) as f64;
    ndtri(f64::from(sobol_burley::sample(index, dimension, seed)) + HALF)
}
