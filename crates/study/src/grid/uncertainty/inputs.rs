//! Inputs that scatter: their means, standard deviations and distributions.

use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use spec_math::cephes64::{ndtr, ndtri};

use crate::text::number::rounded;

/// Number of inputs.
pub const INPUT_COUNT: usize = 8;
/// Number of the first inputs that affect a filament's motion. The remaining input is the number of
/// filaments.
pub const MOVING: usize = 7;

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
    pub(super) dimension: u32,
    pub(super) distribution: Distribution,
}

/// The distribution of an input, by its mean `m` and its standard deviation `s`.
#[derive(Clone, Copy, Debug)]
pub(super) enum Distribution {
    /// Normal distribution.
    Normal,
    /// Normal distribution without its part below zero, scaled up. Its mean is above `m`, and its
    /// standard deviation below `s`, unless `s` is small against `m`.
    CutAtZero,
}

impl Distribution {
    /// Returns the value at the probability that `z` has in the standard normal distribution `Φ`.
    pub(super) fn value(self, mean: f64, std: f64, z: f64) -> f64 {
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

/// Lists the inputs that scatter in a case with relative standard deviations:
/// `d ± 2.5 %, E ± 10 %, N_f ± 5.7 %`. Those of waves, which may have any sign, and about a mean of
/// zero are absolute: `µ ± 0.1`.
#[must_use]
pub fn scatter_text(settings: &Settings) -> String {
    let input = |input: &Input| {
        let (mean, std) = (get(input.mean, settings), get(input.std, settings));
        let spread = || {
            if mean == 0.0 || parameter(input.mean).range.contains(-1.0) {
                return format!("{} {}", rounded(std, 2), parameter(input.mean).unit)
                    .trim_end()
                    .to_owned();
            }
            format!("{} %", rounded(100.0 * std / mean, 2))
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

pub(super) fn parameter(path: &str) -> &'static Parameter {
    Parameter::find(path).expect("the table has all inputs")
}

pub(super) fn get(path: &str, settings: &Settings) -> f64 {
    parameter(path).get(settings)
}
