//! A tool whose clamp has been sampled over a turn.

use bristle::equations::Clamp;
use bristle::equations::linear::{add, dot, scale, sub};
use bristle::tool::Tool;
use pyo3::prelude::*;

use crate::error::of_value;

/// Coefficients of a Fourier series that are smaller than this share of the largest are rounding errors of the transform.
const NOISE: f64 = 1e-14;

/// A position or a direction over a turn, as a Fourier series: `Σ a_m cos mβ + b_m sin mβ`, by `m`.
type Series = Vec<[[f64; 3]; 2]>;

/// The clamp of a filament over a turn, through samples at equal angles. The series has all derivatives, so that a smooth motion is
/// followed to rounding.
#[derive(Clone, Debug)]
#[pyclass(frozen, module = "bristle._bristle", name = "SampledTool")]
pub struct SampledTool {
    position: Series,
    direction: Series,
    radius: f64,
    is_planar: bool,
}

#[pymethods]
impl SampledTool {
    /// The tool with these coefficients of `position` (m) and `direction`, whose tips are at most `radius` (m) from the axis.
    #[new]
    fn new(position: Series, direction: Series, radius: f64) -> PyResult<Self> {
        let mut numbers = position.iter().chain(&direction).flatten().flatten();
        if !(numbers.all(|number| number.is_finite()) && radius > 0.0 && radius.is_finite()) {
            return Err(of_value("positions and directions must be finite, and the tips away from the axis"));
        }
        let is_planar = position.iter().chain(&direction).flatten().all(|[_, _, z]| *z == 0.0);
        Ok(Self { position: without_noise(position), direction: without_noise(direction), radius, is_planar })
    }
}

/// A series as far as its terms are more than rounding errors.
fn without_noise(mut series: Series) -> Series {
    let size = |term: &[[f64; 3]; 2]| term.iter().flatten().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let largest = series.iter().map(size).fold(0.0, f64::max);
    let count = series.iter().rposition(|term| size(term) > NOISE * largest).map_or(0, |last| last + 1);
    series.truncate(count);
    series
}

/// The value of a series at an angle (rad), and its first two derivatives with respect to it.
fn at(series: &Series, angle: f64) -> [[f64; 3]; 3] {
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
        let across = scale(1.0 / length, sub(turn, scale(dot(direction, turn), direction)));
        Clamp {
            position,
            velocity: scale(rate, slope),
            acceleration: scale(rate * rate, bend),
            direction,
            direction_rate: scale(rate, across),
        }
    }

    fn radius(&self, _: f64) -> f64 {
        self.radius
    }

    fn is_planar(&self) -> bool {
        self.is_planar
    }
}
