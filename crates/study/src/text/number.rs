//! Numbers for people, with few digits.

use std::ops::RangeInclusive;

/// Formats swept values with equal numbers of decimals.
pub fn labels(values: impl Iterator<Item = f64>) -> Vec<String> {
    let labels: Vec<String> = values.map(short).collect();
    let decimals = |label: &String| match label.split_once('.') {
        Some((_, decimals)) if !label.contains('e') => decimals.len(),
        _ => 0,
    };
    let most = labels.iter().map(decimals).max().unwrap_or(0);
    let with_decimals = |label: String| match label.parse::<f64>() {
        Ok(value) if !label.contains('e') => format!("{value:.most$}"),
        _ => label,
    };
    labels.into_iter().map(with_decimals).collect()
}

/// Rounds a number to so many significant digits.
#[must_use]
pub fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// Formats a swept value with at most four significant digits.
pub fn short(value: f64) -> String {
    let rounded = rounded(value, 4);
    if (1e-3..1e5).contains(&rounded.abs()) || rounded == 0.0 {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// Formats a number without an exponent, if its exponent is one of `exponents`.
fn written_out(value: f64, digits: usize, exponents: RangeInclusive<i32>) -> Option<String> {
    let scientific = format!("{value:.*e}", digits - 1);
    let exponent = scientific
        .split_once('e')?
        .1
        .parse()
        .ok()
        .filter(|exponent| exponents.contains(exponent))?;
    match digits as i32 - 1 - exponent {
        decimals @ 1.. => Some(format!("{value:.*}", decimals as usize)),
        _ => Some(scientific.parse::<f64>().ok()?.to_string()),
    }
}

/// Formats a result with three significant digits.
#[must_use]
pub fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    written_out(value, 3, -4..=5).unwrap_or_else(|| format!("{value:.2e}"))
}

/// Formats a result and, unless it is zero, its uncertainty with two digits.
#[must_use]
pub fn uncertain(value: f64, uncertainty: f64) -> String {
    if uncertainty == 0.0 {
        return significant(value);
    }
    let digits =
        written_out(uncertainty, 2, -4..=5).unwrap_or_else(|| format!("{uncertainty:.1e}"));
    format!("{} ± {digits}", significant(value))
}

/// Formats a value and its error, which has one digit, or two if the first is a 1 or a 2.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if !(error.is_finite() && error > 0.0 && value.is_finite()) {
        return short(value);
    }
    let exponent = error.log10().floor();
    let digits = if error / 10_f64.powf(exponent) < 2.95 {
        1.0
    } else {
        0.0
    };
    let decimals = digits - exponent;
    if decimals > 8.0 && value != 0.0 {
        let power = value.abs().log10().floor();
        let unit = 10_f64.powf(power);
        return format!("({})e{power}", with_error(value / unit, error / unit));
    }
    if !(0.0..=8.0).contains(&decimals) {
        return format!("{} ± {}", short(value), short(error));
    }
    format!(
        "{value:.*} ± {error:.*}",
        decimals as usize, decimals as usize
    )
}

/// Formats a relative error in per cent.
pub(crate) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.95 {
        format!("{percent:.1} %")
    } else {
        format!("{percent:.0} %")
    }
}

/// Formats a number of a quantity that spans decades: three significant digits from 0.01 to 10⁴,
/// elsewhere two with an exponent.
pub fn spanning(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    written_out(value, 3, -2..=3).unwrap_or_else(|| format!("{value:.1e}"))
}

/// Formats a number of cases in words.
#[must_use]
pub fn counted(cases: usize) -> String {
    if cases == 1 {
        "one case".to_owned()
    } else {
        format!("{cases} cases")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_equally_many_decimals() {
        let values = [2.5, 5.0, 0.5e-3 * 1e3, 1.0 / 3.0];
        assert_eq!(
            labels(values.into_iter()),
            ["2.5000", "5.0000", "0.5000", "0.3333"]
        );
        assert_eq!(labels([10.0, 1e300].into_iter()), ["10", "1e300"]);
    }

    #[test]
    fn results_have_three_digits() {
        let values = [
            0.0, -0.0, 1.234e-5, 1.2345e-4, 0.0, 0.95, 0.9996, 9.999, 54.321, 99.96, 312.4, 1234.0,
            -31_250.0, 1e6,
        ];
        let texts = [
            "0", "0", "1.23e-5", "0.000123", "0", "0.950", "1.00", "10.0", "54.3", "100", "312",
            "1230", "-31200", "1.00e6",
        ];
        assert_eq!(values.map(significant), texts);
        let uncertain = [
            (312.4, 17.86),
            (54.321, 5.0),
            (1.0, 0.123),
            (2500.0, 137.0),
            (3.0, 0.0),
        ]
        .map(|(value, uncertainty)| uncertain(value, uncertainty));
        assert_eq!(
            uncertain,
            [
                "312 ± 18",
                "54.3 ± 5.0",
                "1.00 ± 0.12",
                "2500 ± 140",
                "3.00"
            ]
        );
    }

    #[test]
    fn numbers_over_decades_have_two_or_three_digits() {
        let values = [
            0.0, 1.2e-9, 0.01234, 3.2765, 9.996, 95.379, 534.57, 5786.9, 9996.0, 624_390.9, 1e300,
        ];
        let texts = [
            "0", "1.2e-9", "0.0123", "3.28", "10.0", "95.4", "535", "5790", "1.0e4", "6.2e5",
            "1.0e300",
        ];
        assert_eq!(values.map(spanning), texts);
    }
}
