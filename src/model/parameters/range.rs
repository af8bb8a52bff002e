//! Ranges of settings, in numbers and in words.

use std::f64::consts::PI;
use std::fmt::{self, Display};
use std::ops::{Bound, RangeBounds};

use super::MIN_SCIENTIFIC;

/// Finite numbers between two bounds, or only the whole numbers among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// `true` if the range contains only whole numbers.
    pub whole: bool,
    /// Lower bound.
    pub lower: Bound<f64>,
    /// Upper bound.
    pub upper: Bound<f64>,
}

impl Range {
    pub(super) const POSITIVE: Self = Self::real(Bound::Excluded(0.0), Bound::Unbounded);
    pub(super) const NOT_NEGATIVE: Self = Self::at_least(0.0);
    pub(super) const ANGLE: Self =
        Self::real(Bound::Included(0.0), Bound::Excluded(std::f64::consts::TAU));

    pub(super) const fn real(lower: Bound<f64>, upper: Bound<f64>) -> Self {
        Self {
            whole: false,
            lower,
            upper,
        }
    }

    pub(super) const fn at_least(lower: f64) -> Self {
        Self::real(Bound::Included(lower), Bound::Unbounded)
    }

    pub(super) const fn between(lower: f64, upper: f64) -> Self {
        Self::real(Bound::Included(lower), Bound::Included(upper))
    }

    pub(super) const fn whole(lower: f64, upper: f64) -> Self {
        Self {
            whole: true,
            ..Self::between(lower, upper)
        }
    }

    /// Returns the value of the range that is nearest to a number; the number itself next to an
    /// excluded bound.
    #[must_use]
    pub fn nearest(&self, value: f64) -> f64 {
        let least = if let Bound::Included(lower) = self.lower {
            lower
        } else {
            f64::NEG_INFINITY
        };
        let largest = if let Bound::Included(upper) = self.upper {
            upper
        } else {
            f64::INFINITY
        };
        value.clamp(least, largest)
    }

    /// Returns `true` if the value is finite, within the bounds, and whole if it must be.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        value.is_finite()
            && (self.lower, self.upper).contains(&value)
            && (!self.whole || value.fract() == 0.0)
    }
}

impl Display for Range {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if self.whole {
            "a whole number"
        } else {
            "a finite number"
        })?;
        if let (Bound::Included(lower), Bound::Included(upper)) = (self.lower, self.upper) {
            return write!(formatter, " from {} to {}", plain(lower), plain(upper));
        }
        let lower = bound_in_words(self.lower, "of at least", "greater than");
        let upper = bound_in_words(self.upper, "of at most", "less than");
        let bounds: Vec<String> = lower.into_iter().chain(upper).collect();
        if !bounds.is_empty() {
            write!(formatter, " {}", bounds.join(" and "))?;
        }
        Ok(())
    }
}

fn bound_in_words(bound: Bound<f64>, included: &str, excluded: &str) -> Option<String> {
    match bound {
        Bound::Included(number) => Some(format!("{included} {}", plain(number))),
        Bound::Excluded(number) => Some(format!("{excluded} {}", plain(number))),
        Bound::Unbounded => None,
    }
}

/// Formats a number without a trailing `.0`, or as π; a large one as a power of ten if that is much
/// shorter.
fn plain(number: f64) -> String {
    if number.abs() == PI {
        return if number < 0.0 { "-π" } else { "π" }.to_owned();
    }
    let (text, scientific) = (format!("{number:?}"), format!("{number:e}"));
    if number.abs() >= MIN_SCIENTIFIC && scientific.len() + 4 < text.len() {
        return scientific;
    }
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_contain_finite_numbers_only() {
        let finite = Range::real(Bound::Unbounded, Bound::Unbounded);
        for range in [finite, Range::POSITIVE, Range::whole(1.0, 400.0)] {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!range.contains(value), "{range} contains {value}");
            }
        }
    }

    #[test]
    fn ranges_keep_their_bounds() {
        assert!(!Range::POSITIVE.contains(0.0));
        assert!(Range::NOT_NEGATIVE.contains(0.0));
        assert!(Range::whole(1.0, 400.0).contains(400.0));
        assert!(!Range::whole(1.0, 400.0).contains(1.5));
    }

    #[test]
    fn ranges_read_as_sentences() {
        assert_eq!(
            Range::POSITIVE.to_string(),
            "a finite number greater than 0"
        );
        assert_eq!(
            Range::at_least(1.0).to_string(),
            "a finite number of at least 1"
        );
        assert_eq!(
            Range::whole(1.0, 400.0).to_string(),
            "a whole number from 1 to 400"
        );
        assert_eq!(
            Range::between(1e-10, 1e-2).to_string(),
            "a finite number from 1e-10 to 0.01"
        );
        assert_eq!(
            Range::between(-PI, PI).to_string(),
            "a finite number from -π to π"
        );
    }
}
