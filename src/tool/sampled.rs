//! A tool by samples of the motion of its clamp.

use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::{self, Display, Formatter};

use super::Tool;
use crate::equations::Clamp;
use crate::equations::linear::{add, dot, scale, sub};

/// Largest size of terms of a Fourier series that are rounding errors, over the largest term.
const NOISE_SHARE: f64 = 1e-14;

/// Largest share of their size by which rigidly turning samples differ from the first one, turned
/// with the body. It is above the rounding of single precision. The rates of a motion so nearly
/// rigid do not matter.
const RIGIDITY_TOLERANCE: f64 = 1e-6;

/// Least number of samples of a turn: two do not tell an angle from the same one backwards.
const MIN_SAMPLES: usize = 3;

/// A vector over a turn, `Σ a_m cos mβ + b_m sin mβ`: `[a_m, b_m]` by `m`.
type FourierSeries = Vec<[[f64; 3]; 2]>;

/// A tool that turns about `z` by the motion of one clamp, sampled at equal angles over a turn.
///
/// Between the samples the clamp goes along the Fourier series through them. It has all
/// derivatives, so that a smooth motion is followed to rounding; a motion with kinks needs samples
/// that are close to each other.
///
/// Where position and direction turn rigidly about `z`, so does the body from which the dampers see
/// the filament. Otherwise only the turn of the direction is known: the body is assumed not to turn
/// about the filament ([`Clamp::without_spin`]).
///
/// ```
/// use bristle::tool::{RotaryTool, SampledTool, Tool};
///
/// let round = RotaryTool::radial(0.14);
/// let clamps: Vec<_> = (0..8).map(|k| round.clamp(std::f64::consts::TAU * k as f64 / 8.0, 0.0)).collect();
/// let [positions, directions] =
///     [clamps.iter().map(|clamp| clamp.position).collect(), clamps.iter().map(|clamp| clamp.direction).collect::<Vec<_>>()];
/// let sampled = SampledTool::new(&positions, &directions)?;
/// let difference = sampled.clamp(0.3, 50.0).acceleration[1] - round.clamp(0.3, 50.0).acceleration[1];
/// assert!(difference.abs() < 1e-10 && (sampled.radius(0.04) - 0.18).abs() < 1e-15);
/// # Ok::<(), bristle::tool::SamplesError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SampledTool {
    /// Position in m and direction, of unit length, at the sampled angles.
    samples: Vec<[[f64; 3]; 2]>,
    position: FourierSeries,
    direction: FourierSeries,
    /// `true` if the clamp turns rigidly about `z`.
    is_rigid: bool,
}

/// Samples that do not define a tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplesError {
    /// There are fewer than three samples.
    TooFew {
        /// Number of samples.
        count: usize,
    },
    /// There are not as many positions as directions.
    Unlike {
        /// Number of positions.
        positions: usize,
        /// Number of directions.
        directions: usize,
    },
    /// A number is not finite.
    NotFinite {
        /// Sample, counted from 0.
        sample: usize,
    },
    /// A direction is zero.
    NoDirection {
        /// Sample, counted from 0.
        sample: usize,
    },
}

impl Display for SamplesError {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFew { count } => write!(
                formatter,
                "a turn needs at least {MIN_SAMPLES} samples, not {count}"
            ),
            Self::Unlike {
                positions,
                directions,
            } => {
                write!(
                    formatter,
                    "there are {positions} positions, but {directions} directions"
                )
            }
            Self::NotFinite { sample } => write!(formatter, "sample {sample} is not finite"),
            Self::NoDirection { sample } => {
                write!(formatter, "the direction of sample {sample} is zero")
            }
        }
    }
}

impl Error for SamplesError {}

impl SampledTool {
    /// Creates the tool whose filament is clamped at `positions` (m) along `directions` (of any
    /// length) while its body is at the angles 0, 2π/k, … 2π (k - 1)/k.
    ///
    /// # Errors
    /// If these do not define a tool.
    pub fn new(positions: &[[f64; 3]], directions: &[[f64; 3]]) -> Result<Self, SamplesError> {
        let (count, finite) = (positions.len(), |vector: &[f64; 3]| {
            vector.iter().all(|value| value.is_finite())
        });
        if count != directions.len() {
            return Err(SamplesError::Unlike {
                positions: count,
                directions: directions.len(),
            });
        }
        if count < MIN_SAMPLES {
            return Err(SamplesError::TooFew { count });
        }
        let sample = |(sample, (position, direction)): (usize, (&[f64; 3], &[f64; 3]))| {
            let length = dot(*direction, *direction).sqrt();
            if !(finite(position) && length.is_finite()) {
                return Err(SamplesError::NotFinite { sample });
            }
            if length == 0.0 {
                return Err(SamplesError::NoDirection { sample });
            }
            Ok([*position, scale(1.0 / length, *direction)])
        };
        let samples: Vec<_> = positions
            .iter()
            .zip(directions)
            .enumerate()
            .map(sample)
            .collect::<Result<_, _>>()?;
        let [position, direction] =
            [0, 1].map(|part| series(samples.iter().map(|sample| sample[part])));
        let is_rigid = turns_rigidly(&samples);
        Ok(Self {
            samples,
            position,
            direction,
            is_rigid,
        })
    }
}

/// Returns `true` if all samples are the first one, turned about `z` to their angles.
fn turns_rigidly(samples: &[[[f64; 3]; 2]]) -> bool {
    let count = samples.len();
    samples.iter().enumerate().all(|(k, sample)| {
        let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
        sample.iter().zip(&samples[0]).all(|(vector, &[x, y, z])| {
            let apart = sub(*vector, [cos * x - sin * y, sin * x + cos * y, z]);
            dot(apart, apart).sqrt() <= RIGIDITY_TOLERANCE * dot(*vector, *vector).sqrt()
        })
    })
}

/// Returns the Fourier series through vectors at equal angles of a turn, up to the last term above
/// rounding errors.
fn series(vectors: impl ExactSizeIterator<Item = [f64; 3]> + Clone) -> FourierSeries {
    let count = vectors.len();
    let turns: Vec<(f64, f64)> = (0..count)
        .map(|k| (TAU * k as f64 / count as f64).sin_cos())
        .collect();
    let term = |order: usize| {
        let mut term = [[0.0; 3]; 2];
        for (k, vector) in vectors.clone().enumerate() {
            let (sin, cos) = turns[order * k % count];
            term = [
                add(term[0], scale(cos, vector)),
                add(term[1], scale(sin, vector)),
            ];
        }
        // The mean, and the highest order of an even number of samples, stand for one term of the
        // transform, all others for two.
        let of_both = if order == 0 || 2 * order == count {
            1.0
        } else {
            2.0
        };
        term.map(|part| scale(of_both / count as f64, part))
    };
    let mut series: FourierSeries = (0..=count / 2).map(term).collect();
    let size = |term: &[[f64; 3]; 2]| {
        term.as_flattened()
            .iter()
            .fold(0.0_f64, |largest, value| largest.max(value.abs()))
    };
    let largest = series.iter().map(size).fold(0.0, f64::max);
    let kept = series
        .iter()
        .rposition(|term| size(term) > NOISE_SHARE * largest)
        .map_or(0, |last| last + 1);
    series.truncate(kept);
    series
}

/// Returns the value of a series at an angle (rad), and its first two derivatives by this angle.
fn at(series: &FourierSeries, angle: f64) -> [[f64; 3]; 3] {
    let mut values = [[0.0; 3]; 3];
    for (order, [cosine, sine]) in series.iter().enumerate() {
        let order = order as f64;
        let (sin, cos) = (order * angle).sin_cos();
        let value = add(scale(cos, *cosine), scale(sin, *sine));
        let slope = scale(order, sub(scale(cos, *sine), scale(sin, *cosine)));
        values[0] = add(values[0], value);
        values[1] = add(values[1], slope);
        values[2] = sub(values[2], scale(order * order, value));
    }
    values
}

impl Tool for SampledTool {
    fn clamp(&self, angle: f64, rate: f64) -> Clamp<f64> {
        let [position, slope, bend] = at(&self.position, angle);
        let [along, turn, _] = at(&self.direction, angle);
        // Between samples the series is not of unit length.
        let length = dot(along, along).sqrt();
        let direction = scale(1.0 / length, along);
        let across = scale(
            1.0 / length,
            sub(turn, scale(dot(direction, turn), direction)),
        );
        let clamp = Clamp {
            position,
            velocity: scale(rate, slope),
            acceleration: scale(rate * rate, bend),
            direction,
            direction_rate: scale(rate, across),
            angular_velocity: [0.0, 0.0, rate],
        };
        if self.is_rigid {
            clamp
        } else {
            clamp.without_spin()
        }
    }

    /// Returns the largest radius at a sampled angle.
    fn radius(&self, filament_length: f64) -> f64 {
        let tip = |[position, direction]: &[[f64; 3]; 2]| {
            add(*position, scale(filament_length, *direction))
        };
        self.samples
            .iter()
            .map(tip)
            .fold(0.0, |largest: f64, [x, y, _]| largest.max(x.hypot(y)))
    }

    fn is_planar(&self) -> bool {
        self.samples
            .as_flattened()
            .iter()
            .all(|[_, _, z]| *z == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool::RotaryTool;

    /// Returns a round tool, tilted so that its motion is not planar, and `count` samples.
    fn sampled(count: usize) -> (RotaryTool, SampledTool) {
        let round = RotaryTool {
            lateral_tilt: 0.2,
            leans_from: None,
            ..RotaryTool::radial(0.14)
        };
        let clamps = (0..count).map(|k| round.clamp(TAU * k as f64 / count as f64, 0.0));
        let (positions, directions): (Vec<_>, Vec<_>) = clamps
            .map(|clamp| (clamp.position, scale(7.0, clamp.direction)))
            .unzip();
        (
            round,
            SampledTool::new(&positions, &directions).expect("a tool"),
        )
    }

    #[test]
    fn a_smooth_motion_is_followed_to_rounding() {
        for count in [3, 4, 5, 64, 101] {
            let (round, sampled) = sampled(count);
            assert_eq!((sampled.position.len(), sampled.direction.len()), (2, 2));
            for angle in [-1.6, 0.0, 0.3, 3.0, 100.0] {
                let (exact, clamp) = (round.clamp(angle, 50.0), sampled.clamp(angle, 50.0));
                let parts = |clamp: &Clamp<f64>| {
                    [
                        clamp.position,
                        clamp.direction,
                        scale(0.02, clamp.velocity),
                        scale(4e-4, clamp.acceleration),
                    ]
                };
                for (exact, found) in parts(&exact)
                    .as_flattened()
                    .iter()
                    .zip(parts(&clamp).as_flattened())
                {
                    assert!(
                        (exact - found).abs() < 1e-13,
                        "{count} samples: {exact} {found}"
                    );
                }
                let rates = sub(clamp.direction_rate, exact.direction_rate);
                assert!(dot(rates, rates).sqrt() < 1e-11);
                assert_eq!(clamp.angular_velocity, exact.angular_velocity);
            }
            assert!((sampled.radius(0.04) - (0.14 + 0.04 * 0.2_f64.cos())).abs() < 1e-14);
            assert!(!sampled.is_planar());
        }
    }

    #[test]
    fn samples_between_which_the_clamp_turns_back_have_all_orders() {
        let positions: Vec<[f64; 3]> = (0..6).map(|k| [f64::from(k % 2), 0.0, 0.0]).collect();
        let tool = SampledTool::new(&positions, &[[0.0, 1.0, 0.0]; 6]).expect("a tool");
        for (k, position) in positions.iter().enumerate() {
            let found = tool.clamp(TAU * k as f64 / 6.0, 1.0);
            assert!(
                (found.position[0] - position[0]).abs() < 1e-15
                    && found.direction == [0.0, 1.0, 0.0]
            );
            assert_eq!(found.angular_velocity, [0.0; 3]);
        }
        assert!(tool.is_planar());
    }

    #[test]
    fn what_is_no_tool_is_refused() {
        let (up, along) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let refused = |positions: &[[f64; 3]], directions: &[[f64; 3]]| {
            SampledTool::new(positions, directions)
                .expect_err("no tool")
                .to_string()
        };
        assert_eq!(
            refused(&[along; 2], &[up; 2]),
            "a turn needs at least 3 samples, not 2"
        );
        assert_eq!(
            refused(&[along; 3], &[up; 2]),
            "there are 3 positions, but 2 directions"
        );
        assert_eq!(
            refused(&[along; 3], &[up, [0.0; 3], up]),
            "the direction of sample 1 is zero"
        );
        assert_eq!(
            refused(&[along, along, [f64::NAN; 3]], &[up; 3]),
            "sample 2 is not finite"
        );
    }
}
