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

use serde::{Deserialize, Serialize};
use spec_math::cephes64::{ndtr, ndtri};

use bristle::model::metrics::tool_force;
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{CalibrationUncertainty, Hold, Settings, UncertaintySettings};

mod calibration;
#[cfg(test)]
mod coverage;
mod indices;

use indices::{first_order, mean_and_variance};

/// Number of inputs.
pub const INPUT_COUNT: usize = 8;
/// Number of the first inputs that affect a filament's motion. The remaining input is the number of
/// filaments.
pub const MOVING: usize = 7;

/// Ends of the band, as shares of the tools.
pub(crate) const BAND: [f64; 2] = [0.025, 0.975];

/// Quantity that scatters.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// MODEL's symbol.
    pub symbol: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// Path of its mean.
    pub mean: &'static str,
    /// Path of its standard deviation.
    pub std: &'static str,
    /// Dimension in the sequence of samples. It is fixed, so that a further input does not change
    /// the samples of the others.
    dimension: u32,
    distribution: Distribution,
}

/// The distribution of an input, by its mean `m` and its standard deviation `s`.
#[derive(Clone, Copy, Debug)]
enum Distribution {
    /// Normal distribution.
    Normal,
    /// Normal distribution without its part below zero, scaled up. Its mean is above `m`, and its
    /// standard deviation below `s`, unless `s` is small against `m`.
    CutAtZero,
}

impl Distribution {
    /// Returns the value at the probability that `z` has in the standard normal distribution `Φ`.
    fn value(self, mean: f64, std: f64, z: f64) -> f64 {
        match self {
            Self::Normal => mean + z * std,
            _ if std == 0.0 => mean,
            // Values above zero have the share Φ(m/s); Φ(−z) of these are above the returned value.
            Self::CutAtZero => (mean - std * ndtri(ndtr(-z) * ndtr(mean / std))).max(0.0),
        }
    }
}

/// All inputs, in the order of [`SHARES`].
pub const INPUTS: [Input; INPUT_COUNT] = [
    input(
        0,
        [
            "l_f",
            "length",
            "filament.length_m",
            "uncertainty.length_std_m",
        ],
    ),
    input(
        1,
        [
            "d",
            "diameter",
            "filament.diameter_m",
            "uncertainty.diameter_std_m",
        ],
    ),
    input(
        2,
        [
            "E",
            "Young’s modulus",
            "filament.youngs_modulus_pa",
            "uncertainty.youngs_modulus_std_pa",
        ],
    ),
    input(
        3,
        [
            "ζ",
            "damping ratio",
            "filament.damping_ratio",
            "uncertainty.damping_ratio_std",
        ],
    ),
    input(
        5,
        [
            "A",
            "waviness",
            "filament.waviness_amplitude_m",
            "uncertainty.waviness_amplitude_std_m",
        ],
    ),
    input(
        6,
        [
            "ψ",
            "phase of the waviness",
            "filament.waviness_phase_rad",
            "uncertainty.waviness_phase_std_rad",
        ],
    ),
    Input {
        distribution: Distribution::CutAtZero,
        ..input(
            7,
            [
                "µ",
                "friction",
                "contact.friction_coefficient",
                "uncertainty.friction_coefficient_std",
            ],
        )
    },
    input(
        4,
        [
            "N_f",
            "number of filaments",
            "tool.filament_count",
            "tool.filament_count_uncertainty",
        ],
    ),
];

/// Symbols and names of the shares in the scatter: all inputs, and the uncertainty of a
/// calibration.
pub const SHARES: [[&str; 2]; INPUT_COUNT + 1] = {
    let mut shares = [["", "calibration"]; INPUT_COUNT + 1];
    let mut input = 0;
    while input < INPUT_COUNT {
        shares[input] = [INPUTS[input].symbol, INPUTS[input].name];
        input += 1;
    }
    shares
};

/// Creates a normally distributed input with its symbol, its name, and the paths of its mean and
/// its standard deviation.
const fn input(dimension: u32, [symbol, name, mean, std]: [&'static str; 4]) -> Input {
    Input {
        symbol,
        name,
        mean,
        std,
        dimension,
        distribution: Distribution::Normal,
    }
}

impl Input {
    /// Returns `true` if the standard deviation is above zero.
    #[must_use]
    pub fn scatters(&self, settings: &Settings) -> bool {
        get(self.std, settings) > 0.0
    }
}

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

bristle::record! {
    /// The distribution of the tool force `F_n,w` of one case.
    ///
    /// A first-order Sobol index is the share of the variance that would vanish, on average, if the
    /// input were known.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    pub struct ForceScatter {
        tool_force_mean_n: f64 = ["", "N", "mean of F_n,w over the tools", "mean of the sampled tools"],
        tool_force_std_n: f64 = ["", "N", "standard deviation of F_n,w", "over the sampled tools"],
        tool_force_median_n: f64 = ["", "N", "median of F_n,w", "half of the sampled tools have less"],
        tool_force_lower_95_n: f64 =
            ["", "N", "lower end of the 95 % band of F_n,w", "2.5 % of the sampled tools have less"],
        tool_force_upper_95_n: f64 =
            ["", "N", "upper end of the 95 % band of F_n,w", "2.5 % of the sampled tools have more"],
        sobol_length: f64 =
            ["", "", "share of the length", "first-order Sobol index of l_f in the variance of F_n,w"],
        sobol_diameter: f64 =
            ["", "", "share of the diameter", "first-order Sobol index of d in the variance of F_n,w"],
        sobol_youngs_modulus: f64 =
            ["", "", "share of Young’s modulus", "first-order Sobol index of E in the variance of F_n,w"],
        sobol_damping_ratio: f64 =
            ["", "", "share of the damping ratio", "first-order Sobol index of ζ in the variance of F_n,w"],
        sobol_waviness_amplitude: f64 =
            ["", "", "share of the waviness", "first-order Sobol index of A in the variance of F_n,w"],
        sobol_waviness_phase: f64 =
            ["", "", "share of the phase of the waviness", "first-order Sobol index of ψ in the variance of F_n,w"],
        sobol_friction_coefficient: f64 =
            ["", "", "share of friction", "first-order Sobol index of µ in the variance of F_n,w"],
        sobol_filament_count: f64 =
            ["", "", "share of the number of filaments", "first-order Sobol index of N_f in the variance of F_n,w"],
        sobol_calibration: f64 =
            ["", "", "share of the calibration", "first-order Sobol indices of what is calibrated in the variance of F_n,w"],
        failed_samples: usize =
            ["", "", "failed tools", "sampled tools left out because their simulation failed"],
    }
}

impl ForceScatter {
    /// Returns the distribution of a force that is larger by a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            tool_force_mean_n: factor * self.tool_force_mean_n,
            tool_force_std_n: factor * self.tool_force_std_n,
            tool_force_median_n: factor * self.tool_force_median_n,
            tool_force_lower_95_n: factor * self.tool_force_lower_95_n,
            tool_force_upper_95_n: factor * self.tool_force_upper_95_n,
            ..self
        }
    }

    /// Returns the 95 % band in N.
    #[must_use]
    pub fn band(&self) -> [f64; 2] {
        [self.tool_force_lower_95_n, self.tool_force_upper_95_n]
    }

    /// Returns first-order Sobol indices of [`SHARES`]. The rest up to 1 is due to interactions of
    /// inputs, or missed by the fit.
    #[must_use]
    pub fn sobol_indices(&self) -> [f64; SHARES.len()] {
        [
            self.sobol_length,
            self.sobol_diameter,
            self.sobol_youngs_modulus,
            self.sobol_damping_ratio,
            self.sobol_waviness_amplitude,
            self.sobol_waviness_phase,
            self.sobol_friction_coefficient,
            self.sobol_filament_count,
            self.sobol_calibration,
        ]
    }
}

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

/// Lists the inputs that scatter in a case with relative standard deviations:
/// `d ± 2.5 %, E ± 10 %, N_f ± 5.7 %`. Those of waves, which may have any sign, and about a mean of
/// zero are absolute: `µ ± 0.1`.
#[must_use]
pub fn scatter_text(settings: &Settings) -> String {
    let input = |input: &Input| {
        let (mean, std) = (get(input.mean, settings), get(input.std, settings));
        let spread = || {
            if mean == 0.0 || parameter(input.mean).range.contains(-1.0) {
                return format!("{} {}", two_digits(std), parameter(input.mean).unit)
                    .trim_end()
                    .to_owned();
            }
            format!("{} %", two_digits(100.0 * std / mean))
        };
        input
            .scatters(settings)
            .then(|| format!("{} ± {}", input.symbol, spread()))
    };
    let calibrated = settings
        .uncertainty
        .calibration
        .as_ref()
        .map(|_| "calibration".to_owned());
    INPUTS
        .iter()
        .filter_map(input)
        .chain(calibrated)
        .collect::<Vec<_>>()
        .join(", ")
}

fn two_digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    rounded.to_string()
}

fn parameter(path: &str) -> &'static Parameter {
    Parameter::find(path).expect("the table has all inputs")
}

fn get(path: &str, settings: &Settings) -> f64 {
    parameter(path).get(settings)
}

/// Returns a number of the sequence, transformed to a standard normal distribution.
fn standard_normal(index: u32, dimension: u32, seed: u32) -> f64 {
    /// Half the spacing of the numbers, which are multiples of 2⁻²⁴ from 0 on. The midpoints
    /// between them are neither 0 nor 1.
    const HALF: f64 = 1.0 / (1 << 25) as f64;
    ndtri(f64::from(sobol_burley::sample(index, dimension, seed)) + HALF)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(uncertainty: &str) -> Settings {
        let text = format!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\nfilament_count_uncertainty = 50\n\
             [filament]\nlength_m = 0.040\ndiameter_m = 1.0e-3\n[process]\nbrushing_velocity_m_s = 18.0\n\
             penetration_depth_m = 1.0e-3\n[uncertainty]\n{uncertainty}"
        );
        toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn without_scattering_filaments_there_are_no_tools() {
        assert!(Scatter::of(&settings("samples = 64")).is_none());
        assert!(Scatter::of(&settings("damping_ratio_std = 1e-3")).is_some());
    }

    #[test]
    fn inputs_have_their_means_and_deviations_and_are_independent() {
        let stds = "length_std_m = 1e-4\ndiameter_std_m = 2e-5\nyoungs_modulus_std_pa = 3e8\ndamping_ratio_std = 5e-3\n\
                    waviness_amplitude_std_m = 2e-4\nwaviness_phase_std_rad = 0.5\n";
        let scatter =
            Scatter::of(&settings(&format!("{stds}samples = 4096\nseed = 9"))).expect("tools");
        let tools: Vec<Settings> = (0..scatter.count())
            .map(|tool| scatter.settings(tool).expect("a tool"))
            .collect();
        let column = |input: &Input| {
            tools
                .iter()
                .map(|tool| get(input.mean, tool))
                .collect::<Vec<_>>()
        };
        let columns: Vec<Vec<f64>> = INPUTS[..MOVING].iter().map(column).collect();
        let expected = [
            (0.04, 1e-4),
            (1e-3, 2e-5),
            (3e9, 3e8),
            (0.05, 5e-3),
            (0.0, 2e-4),
            (0.0, 0.5),
        ];
        for (values, (mean, std)) in columns.iter().zip(expected) {
            let (found_mean, variance) = mean_and_variance(values);
            assert!((found_mean - mean).abs() < 0.002 * std, "{found_mean}");
            assert!(
                (variance.sqrt() / std - 1.0).abs() < 0.005,
                "{}",
                variance.sqrt()
            );
        }
        for (a, (mean_a, std_a)) in columns.iter().zip(expected) {
            for (b, (mean_b, std_b)) in columns
                .iter()
                .zip(expected)
                .filter(|(b, _)| !std::ptr::eq(*b, a))
            {
                let products = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b));
                let correlation = products.sum::<f64>() / (a.len() as f64 * std_a * std_b);
                assert!(correlation.abs() < 0.01, "{correlation}");
            }
        }
        // Settings that are not sampled keep their values.
        assert!(
            tools
                .iter()
                .all(|tool| tool.tool == settings("").tool && tool.process == settings("").process)
        );
    }

    /// The moments of a normal distribution without its part below zero are known (Johnson, Kotz
    /// and Balakrishnan 1994).
    #[test]
    fn friction_is_cut_at_zero() {
        for (mean, std) in [(0.3_f64, 0.05), (0.1, 0.1), (0.0, 0.2)] {
            let text = format!(
                "friction_coefficient_std = {std}\nsamples = 16384\n[contact]\nfriction_coefficient = {mean}"
            );
            let scatter = Scatter::of(&settings(&text)).expect("tools");
            let friction = |tool| {
                scatter
                    .settings(tool)
                    .expect("a tool")
                    .contact
                    .friction_coefficient
            };
            let values: Vec<f64> = (0..scatter.count()).map(friction).collect();
            assert!(values.iter().all(|&value| value >= 0.0));
            let ratio = mean / std;
            let hazard = (-0.5 * ratio * ratio).exp() / std::f64::consts::TAU.sqrt() / ndtr(ratio);
            let (found, variance) = mean_and_variance(&values);
            assert!(
                (found - (mean + std * hazard)).abs() < 1e-3 * std,
                "{found}"
            );
            let expected = std * std * (1.0 - ratio * hazard - hazard * hazard);
            assert!(
                (variance / expected - 1.0).abs() < 2e-3,
                "{variance}, not {expected}"
            );
        }
        let text = |contact: &str| {
            scatter_text(&settings(&format!(
                "friction_coefficient_std = 0.1\n[contact]\n{contact}"
            )))
        };
        for (contact, beginning) in [
            ("friction_coefficient = 0.4", "µ ± 25 %, N_f"),
            ("", "µ ± 0.1, N_f"),
        ] {
            assert!(text(contact).starts_with(beginning), "{}", text(contact));
        }
    }

    #[test]
    fn a_sampled_filament_keeps_its_taper() {
        let mut settings = settings("diameter_std_m = 2e-5");
        settings.filament.tip_diameter_m = Some(0.6e-3);
        let scatter = Scatter::of(&settings).expect("tools");
        for tool in 0..scatter.count() {
            let filament = scatter.settings(tool).expect("a tool").filament;
            assert!((filament.tip_diameter_m() / filament.diameter_m - 0.6).abs() < 1e-15);
        }
        assert_eq!(scatter_text(&settings), "d ± 2 %, N_f ± 5 %");
        settings.uncertainty.waviness_amplitude_std_m = 2e-4;
        assert_eq!(scatter_text(&settings), "d ± 2 %, A ± 0.0002 m, N_f ± 5 %");
    }

    #[test]
    fn what_is_held_is_process_or_machine() {
        let tools = |hold: &str| {
            let scatter = Scatter::of(&settings(&format!(
                "length_std_m = 5e-4\nhold = \"{hold}\""
            )))
            .expect("tools");
            (0..scatter.count())
                .map(|tool| scatter.settings(tool))
                .collect::<Vec<_>>()
        };
        let (process, machine) = (tools("process"), tools("machine"));
        for (process, machine) in process.iter().zip(&machine) {
            let process = process
                .as_ref()
                .expect("each tool is set up to reach the workpiece");
            assert_eq!(process.process.penetration_depth_m, 1e-3);
            let longer = process.filament.length_m - 0.040;
            // Two standard deviations equal the depth.
            assert_eq!(machine.is_some(), longer > -1e-3);
            let Some(machine) = machine else { continue };
            assert!((machine.process.penetration_depth_m - 1e-3 - longer).abs() < 1e-15);
            assert!(
                (machine.process.brushing_velocity_m_s / 18.0 - 1.0 - longer / 0.18).abs() < 1e-14
            );
        }
        assert!(machine.iter().any(Option::is_none));
    }

    /// A force per filament of `1 N · (1 + z/10)`, times 1000 ± 50 filaments.
    #[test]
    fn a_product_is_reduced_to_its_moments() {
        let scatter =
            Scatter::of(&settings("diameter_std_m = 2e-5\nsamples = 16384")).expect("tools");
        let rate = settings("").angular_velocity_rad_s();
        let impulse = |tool: usize| {
            let diameter = scatter.settings(tool).expect("a tool").filament.diameter_m;
            std::f64::consts::TAU / rate * (1.0 + 0.1 * (diameter - 1e-3) / 2e-5)
        };
        let mut impulses: Vec<Option<f64>> = (0..scatter.count())
            .map(|tool| Some(impulse(tool)))
            .collect();
        let reduced = scatter.reduce(&impulses).expect("no simulation failed");
        let variance = 0.01_f64 * 1e6 + 2500.0 + 0.01 * 2500.0;
        let near = |found: f64, expected: f64, tolerance: f64| {
            assert!(
                (found / expected - 1.0).abs() < tolerance,
                "{found}, not {expected}"
            );
        };
        near(reduced.tool_force_mean_n, 1000.0, 1e-4);
        near(reduced.tool_force_std_n, variance.sqrt(), 1e-3);
        near(reduced.sobol_diameter, 1e4 / variance, 1e-3);
        near(reduced.sobol_filament_count, 2500.0 / variance, 1e-3);
        assert_eq!(
            [
                reduced.sobol_length,
                reduced.sobol_youngs_modulus,
                reduced.sobol_damping_ratio
            ],
            [0.0; 3]
        );
        // The distribution is nearly normal, because the product of the deviations is small.
        near(
            reduced.tool_force_lower_95_n,
            1000.0 - 1.96 * variance.sqrt(),
            0.01,
        );
        near(
            reduced.tool_force_upper_95_n,
            1000.0 + 1.96 * variance.sqrt(),
            0.01,
        );

        impulses
            .iter_mut()
            .step_by(3)
            .for_each(|impulse| *impulse = None);
        let with_failures = scatter.reduce(&impulses).expect("most are there");
        assert_eq!(with_failures.failed_samples, 16384_usize.div_ceil(3));
        near(with_failures.tool_force_std_n, variance.sqrt(), 0.03);
        impulses
            .iter_mut()
            .skip(1)
            .step_by(3)
            .for_each(|impulse| *impulse = None);
        assert_eq!(scatter.reduce(&impulses), None);
    }

    /// The gradient of a force of `1 N · (1 + 3 z/100 + 4 z'/100)` leads to both ends.
    #[test]
    fn ends_of_the_band_are_the_most_probable_tools_there() {
        let stds = "diameter_std_m = 2e-5\nyoungs_modulus_std_pa = 3e8\ndamping_ratio_std = 5e-3";
        let scatter = Scatter::of(&settings(&format!("{stds}\nsamples = 16384"))).expect("tools");
        let deviations = |scatter: &Scatter, tool| {
            let filament = scatter.settings(tool).expect("a tool").filament;
            let [diameter, modulus] = [filament.diameter_m, filament.youngs_modulus_pa];
            [(diameter - 1e-3) / 2e-5, (modulus - 3e9) / 3e8]
        };
        let impulses: Vec<Option<f64>> = (0..scatter.count())
            .map(|tool| {
                let [diameter, modulus] = deviations(&scatter, tool);
                Some(1.0 + 0.03 * diameter + 0.04 * modulus)
            })
            .collect();
        let (ends, positions) = scatter.ends(&impulses).expect("a force that varies");
        let distance = ndtri(0.975);
        for (end, sign) in [-1.0, 1.0].into_iter().enumerate() {
            for (found, share) in deviations(&ends, end).into_iter().zip([0.6, 0.8]) {
                // The samples are uncorrelated to 0.002, as above.
                assert!((found - sign * share * distance).abs() < 0.01, "{found}");
            }
        }
        for (tool, position) in positions.into_iter().enumerate() {
            let [diameter, modulus] = deviations(&scatter, tool);
            let expected = (0.6 * diameter + 0.8 * modulus) / distance;
            assert!((position - expected).abs() < 0.02, "{position}");
        }
        assert!(scatter.ends(&vec![Some(0.0); scatter.count()]).is_none());
    }

    #[test]
    fn no_force_has_no_scatter() {
        let scatter = Scatter::of(&settings("diameter_std_m = 2e-5")).expect("tools");
        assert_eq!(
            scatter.reduce(&[Some(0.0); 128]),
            Some(ForceScatter::default())
        );
    }

    #[test]
    fn quantiles_are_interpolated() {
        let found = [0.0, 0.125, 0.25, 0.5, 0.625, 0.875, 1.0]
            .map(|share| quantile(&[1.0, 2.0, 4.0, 8.0], share));
        assert_eq!(found, [1.0, 1.0, 1.5, 3.0, 4.0, 8.0, 8.0]);
    }
}
