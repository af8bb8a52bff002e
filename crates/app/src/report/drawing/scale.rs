//! Axes: the places of values, and ticks at round numbers.

use std::borrow::Cow;

use super::{ends, fine, labelled, power_of_ten, whole};

/// An axis of a diagram.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity and unit.
    pub label: Cow<'static, str>,
    /// `true` if powers of ten are at equal distances.
    pub logarithmic: bool,
    /// Rule for showing zero.
    pub zero: Zero,
    /// The names of the coordinates 0, 1, 2 and so on; empty if coordinates are numbers.
    pub names: Vec<String>,
    /// `true` if the values are whole numbers.
    pub is_count: bool,
}

/// Rules by which a linear axis shows zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zero {
    /// If it lies between the values.
    Between,
    /// If values come near it: unless all are at least half of the largest.
    Near,
    /// Always.
    Always,
}

/// Minimum length of an axis of [`Zero::Near`], as a share of its largest value. Smaller changes
/// then look small.
const MIN_AXIS_SHARE: f64 = 0.01;

impl Axis {
    /// Creates a linear axis.
    pub fn linear(label: impl Into<Cow<'static, str>>) -> Self {
        Self {
            label: label.into(),
            logarithmic: false,
            zero: Zero::Between,
            names: Vec::new(),
            is_count: false,
        }
    }

    /// Creates a linear axis of whole numbers.
    pub fn count(label: impl Into<Cow<'static, str>>) -> Self {
        Self {
            is_count: true,
            ..Self::linear(label)
        }
    }

    /// Creates a logarithmic axis.
    pub fn logarithmic(label: impl Into<Cow<'static, str>>) -> Self {
        Self {
            logarithmic: true,
            ..Self::linear(label)
        }
    }

    /// Creates an axis with a place for each of some names.
    pub fn named(label: impl Into<Cow<'static, str>>, names: Vec<String>) -> Self {
        Self {
            names,
            ..Self::linear(label)
        }
    }

    /// Creates a linear axis that always shows zero.
    pub fn from_zero(label: impl Into<Cow<'static, str>>) -> Self {
        Self {
            zero: Zero::Always,
            ..Self::linear(label)
        }
    }

    /// Creates a linear axis of an amount. It begins at zero if values come near it, otherwise at
    /// the values.
    pub fn amount(label: impl Into<Cow<'static, str>>) -> Self {
        Self {
            zero: Zero::Near,
            ..Self::linear(label)
        }
    }

    /// Returns the ends of the axis for values from `low` to `high`, without a margin.
    fn ends(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let largest = low.abs().max(high.abs());
        let is_near = low <= 0.5 * high && high >= 0.5 * low || largest == 0.0;
        match self.zero {
            Zero::Between => (low, high),
            _ if self.logarithmic => (low, high),
            Zero::Near if !is_near => {
                let more = (MIN_AXIS_SHARE * largest - (high - low)).max(0.0);
                (low - more / 2.0, high + more / 2.0)
            }
            Zero::Near | Zero::Always => (low.min(0.0), high.max(0.0)),
        }
    }
}

/// An axis with its range and its ticks. Its coordinates are values, or their logarithms on a
/// logarithmic axis.
#[derive(Clone, Debug)]
pub struct AxisScale {
    /// The axis, without its range.
    pub axis: Axis,
    low: f64,
    high: f64,
    /// Coordinates and labels.
    pub ticks: Vec<(f64, String)>,
    /// Factor that the labels leave out; empty if the factor is one.
    pub factor: String,
}

impl AxisScale {
    /// Creates the scale of an axis that shows `values` (coordinates) with a margin.
    pub fn new(axis: Axis, values: impl Iterator<Item = f64>) -> Self {
        if !axis.names.is_empty() {
            let (ticks, high) = (named_ticks(&axis.names), axis.names.len() as f64 - 0.5);
            return Self {
                axis,
                low: -0.5,
                high,
                ticks,
                factor: String::new(),
            };
        }
        let (low, high) = range(values, &axis);
        let margin = 0.04 * (high - low);
        // Amounts are not negative.
        let ends_at_zero = axis.zero != Zero::Between && !axis.logarithmic;
        let (below, above) = (
            if ends_at_zero && low == 0.0 {
                0.0
            } else {
                margin
            },
            if ends_at_zero && high == 0.0 {
                0.0
            } else {
                margin
            },
        );
        let (low, high) = (low - below, high + above);
        let (mut ticks, factor) = if axis.logarithmic {
            logarithmic_ticks(low, high)
        } else {
            linear_ticks(low, high)
        };
        if axis.is_count && factor.is_empty() {
            ticks.retain(|(value, _)| (value - value.round()).abs() < 1e-9);
            ticks
                .iter_mut()
                .for_each(|(value, label)| *label = whole(*value));
        }
        Self {
            axis,
            low,
            high,
            ticks,
            factor,
        }
    }

    /// Creates the scale of an axis from the smallest to the largest of `values` (coordinates).
    pub fn exact(axis: Axis, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = range(values, &axis);
        // Rounding must not remove a tick at an end.
        let slack = 1e-9 * (high - low);
        let ticks = if axis.logarithmic {
            logarithmic_ticks
        } else {
            linear_ticks
        };
        let (ticks, factor) = ticks(low - slack, high + slack);
        Self {
            axis,
            low,
            high,
            ticks,
            factor,
        }
    }

    /// Returns the part of the range that lies below a coordinate.
    pub fn part(&self, at: f64) -> f64 {
        (at - self.low) / (self.high - self.low)
    }

    /// Maps a coordinate to a place between the pixels `low` and `high`, in coordinates of the
    /// canvas.
    pub fn place(&self, at: f64, low: i32, high: i32) -> i32 {
        fine(low) + (self.part(at) * f64::from(fine(high - low))).round() as i32
    }
}

/// Returns the ends of an axis for `values`, with some room if they are equal.
fn range(values: impl Iterator<Item = f64>, axis: &Axis) -> (f64, f64) {
    let [low, high] = ends(values);
    if low > high {
        return (0.0, 1.0);
    }
    let (low, high) = axis.ends((low, high));
    let largest = low.abs().max(high.abs());
    if high - low > 1e-9 * largest && largest >= 1e-290 {
        return (low, high);
    }
    if axis.zero != Zero::Between && largest == 0.0 && !axis.logarithmic {
        return (0.0, 1.0);
    }
    // Labels could not distinguish the ends.
    let half = match axis.logarithmic {
        true => 0.5,
        false if largest < 1e-290 => 1.0,
        false => 0.1 * largest,
    };
    (low - half, high + half)
}

/// Returns the coordinate of a value on an axis; none if it cannot be shown.
pub fn coordinate(axis: &Axis, value: f64) -> Option<f64> {
    let shown = value.abs() < 1e300 && (value > 0.0 || !axis.logarithmic);
    shown.then(|| {
        if axis.logarithmic {
            value.log10()
        } else {
            value
        }
    })
}

/// Returns names at their places, cut if they are too long to stand side by side.
fn named_ticks(names: &[String]) -> Vec<(f64, String)> {
    /// Maximum characters along an axis.
    const MAX_AXIS_CHARS: usize = 80;
    let longest = (MAX_AXIS_CHARS / names.len()).max(4);
    let cut = |name: &String| match name.chars().count() {
        length if length <= longest => name.clone(),
        _ => name.chars().take(longest - 1).chain(['…']).collect(),
    };
    labelled((0..names.len()).map(|place| place as f64), |place| {
        cut(&names[place as usize])
    })
}

/// Returns multiples of 1, 2 or 5 times a power of ten, with their labels and the factor that the
/// labels leave out.
pub fn linear_ticks(low: f64, high: f64) -> (Vec<(f64, String)>, String) {
    let least = (high - low) / 7.0;
    let power = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * power);
    let largest = low.abs().max(high.abs());
    let exponent = if (1e-2..1e5).contains(&largest) {
        0.0
    } else {
        3.0 * (largest.log10() / 3.0).floor()
    };
    let unit = 10_f64.powf(exponent);
    // Slightly more than a step, so that rounding of the logarithm does not add a decimal.
    let decimals = (-(1.1 * step / unit).log10().floor()).clamp(0.0, 15.0) as usize;
    let values = ((low / step).ceil() as i64..=(high / step).floor() as i64)
        .map(|count| count as f64 * step);
    let ticks = labelled(values, |value| {
        format!("{:.decimals$}", value / unit).replace('-', "−")
    });
    let factor = if exponent == 0.0 {
        String::new()
    } else {
        format!("× {}", power_of_ten(exponent))
    };
    (ticks, factor)
}

/// Returns ticks between two powers of ten, given by their exponents. They are at powers of ten; in
/// a narrow range at 1, 2 and 5 times them; in a still narrower one as on a linear axis.
fn logarithmic_ticks(low: f64, high: f64) -> (Vec<(f64, String)>, String) {
    let powers: Vec<f64> = (low.ceil() as i32..=high.floor() as i32)
        .map(f64::from)
        .collect();
    if powers.len() > 2 {
        let every = powers.len().div_ceil(9) as f64;
        let plain = powers.iter().all(|power| (0.0..5.0).contains(power));
        let powers = powers.into_iter().filter(|power| power % every == 0.0);
        let label = |power: f64| {
            if plain {
                whole(10_f64.powf(power))
            } else {
                power_of_ten(power)
            }
        };
        return (labelled(powers, label), String::new());
    }
    let digits = (low.floor() as i32..=high.floor() as i32)
        .flat_map(|power| [1, 2, 5].map(|digit| (digit, power)));
    let digits = digits.map(|(digit, power)| {
        (
            f64::from(digit).log10() + f64::from(power),
            digit_label(digit, power),
        )
    });
    let digits: Vec<_> = digits.filter(|(at, _)| (low..=high).contains(at)).collect();
    if digits.len() > 2 {
        return (digits, String::new());
    }
    let (ticks, factor) = linear_ticks(10_f64.powf(low), 10_f64.powf(high));
    (
        ticks
            .into_iter()
            .filter(|(value, _)| *value > 0.0)
            .map(|(value, label)| (value.log10(), label))
            .collect(),
        factor,
    )
}

/// Returns a digit times a power of ten, as a label.
fn digit_label(digit: i32, power: i32) -> String {
    match (digit, power) {
        (_, -3..=4) => format!(
            "{:.*}",
            (-power).max(0) as usize,
            f64::from(digit) * 10_f64.powi(power)
        ),
        (1, _) => power_of_ten(f64::from(power)),
        _ => format!("{digit}·{}", power_of_ten(f64::from(power))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels((ticks, factor): (Vec<(f64, String)>, String)) -> (String, String) {
        (
            ticks
                .into_iter()
                .map(|(_, label)| label)
                .collect::<Vec<_>>()
                .join(" "),
            factor,
        )
    }

    #[test]
    fn ticks_are_round_numbers() {
        let linear = |low, high| labels(linear_ticks(low, high));
        assert_eq!(
            linear(-0.04, 1.04),
            ("0.0 0.2 0.4 0.6 0.8 1.0".into(), String::new())
        );
        assert_eq!(linear(-30.0, 30.0).0, "−30 −20 −10 0 10 20 30");
        assert_eq!(linear(0.0, 7.0).0, "0 1 2 3 4 5 6 7");
        assert_eq!(
            linear(0.0, 7.1e-4),
            ("0 200 400 600".into(), "× 10⁻⁶".into())
        );
        assert_eq!(
            linear(0.0, 2.5e7),
            ("0 5 10 15 20 25".into(), "× 10⁶".into())
        );
        assert_eq!(
            linear(1.000001, 1.000006).0,
            "1.000001 1.000002 1.000003 1.000004 1.000005 1.000006"
        );
        let logarithmic =
            |low: f64, high: f64| labels(logarithmic_ticks(low.log10(), high.log10()));
        assert_eq!(logarithmic(4.3, 230.0).0, "5 10 20 50 100 200");
        assert_eq!(logarithmic(0.5, 2e4).0, "1 10 100 1000 10000");
        assert_eq!(logarithmic(2e-9, 5e-5).0, "10⁻⁸ 10⁻⁷ 10⁻⁶ 10⁻⁵");
        assert_eq!(logarithmic(2e-17, 5e2).0, "10⁻¹⁵ 10⁻¹² 10⁻⁹ 10⁻⁶ 10⁻³ 10⁰");
        assert_eq!(logarithmic(1.5e-7, 1.2e-6).0, "2·10⁻⁷ 5·10⁻⁷ 10⁻⁶");
        assert_eq!(logarithmic(1.1, 1.5).0, "1.1 1.2 1.3 1.4 1.5");
    }

    #[test]
    fn counts_have_whole_numbers_only() {
        let labels = |high: f64| {
            let ticks = AxisScale::new(Axis::count(""), [1.0, high].into_iter()).ticks;
            ticks
                .into_iter()
                .map(|(_, label)| label)
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert_eq!(
            [labels(2.0), labels(4.0), labels(50.0)],
            ["1 2", "1 2 3 4", "0 10 20 30 40 50"]
        );
    }

    #[test]
    fn zero_is_shown_where_it_is_asked_for() {
        let labels = |axis| {
            labels((
                AxisScale::new(axis, [200.0, 400.0].into_iter()).ticks,
                String::new(),
            ))
            .0
        };
        assert_eq!(labels(Axis::linear("")), "200 250 300 350 400");
        assert_eq!(labels(Axis::from_zero("")), "0 100 200 300 400");
        assert_eq!(
            AxisScale::new(Axis::from_zero(""), [0.0, 400.0].into_iter()).part(0.0),
            0.0
        );
    }

    #[test]
    fn an_axis_of_an_amount_begins_where_the_values_are() {
        let cases = [
            ([200.0, 400.0], "0 100 200 300 400"),
            ([-1.0, 400.0], "0 100 200 300 400"),
            ([-400.0, -300.0], "−400 −380 −360 −340 −320 −300"),
            ([300.0, 400.0], "300 320 340 360 380 400"),
            // At least a hundredth of the values.
            ([400.0, 400.001], "398 399 400 401 402"),
            ([400.0, 400.0], "398 399 400 401 402"),
            ([0.0, 0.0], "0.0 0.2 0.4 0.6 0.8 1.0"),
        ];
        for (values, expected) in cases {
            let ticks = AxisScale::new(Axis::amount(""), values.into_iter()).ticks;
            assert_eq!(
                ticks
                    .into_iter()
                    .map(|(_, label)| label)
                    .collect::<Vec<_>>()
                    .join(" "),
                expected,
                "{values:?}"
            );
        }
    }
}
