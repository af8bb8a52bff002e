//! Units of symbols and outputs, and their SI dimensions.

use std::fmt::{self, Display, Formatter};

/// The base units, in the order in which they are written.
const NAMES: [&str; 7] = ["kg", "N", "J", "W", "m", "rad", "s"];

/// Mass, length and time exponents of each of [`NAMES`]; a radian is a number.
const DIMENSIONS: [[i32; 3]; 7] = [
    [1, 0, 0],
    [1, 1, -2],
    [1, 2, -2],
    [1, 2, -3],
    [0, 1, 0],
    [0, 0, 0],
    [0, 0, 1],
];

/// Largest magnitude of an exponent in a unit that is read.
const MAX_EXPONENT: i8 = 9;

/// A unit: a product of powers of kg, N, J, W, m, rad and s.
///
/// `Display` writes it as in print (`kg m²`, `rad/s`); [`Unit::code`] writes the form of files
/// (`rad s^-1`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit([i8; 7]);

impl Unit {
    /// The unit of a number.
    pub const ONE: Self = Self([0; 7]);
    /// kg
    pub const KILOGRAM: Self = Self([1, 0, 0, 0, 0, 0, 0]);
    /// N
    pub const NEWTON: Self = Self([0, 1, 0, 0, 0, 0, 0]);
    /// J
    pub const JOULE: Self = Self([0, 0, 1, 0, 0, 0, 0]);
    /// W
    pub const WATT: Self = Self([0, 0, 0, 1, 0, 0, 0]);
    /// m
    pub const METRE: Self = Self([0, 0, 0, 0, 1, 0, 0]);
    /// rad
    pub const RADIAN: Self = Self([0, 0, 0, 0, 0, 1, 0]);
    /// s
    pub const SECOND: Self = Self([0, 0, 0, 0, 0, 0, 1]);

    /// The product of two units.
    pub const fn times(self, other: Self) -> Self {
        let mut exponents = self.0;
        let mut i = 0;
        while i < exponents.len() {
            exponents[i] += other.0[i];
            i += 1;
        }
        Self(exponents)
    }

    /// The integer power of a unit.
    pub const fn powi(self, exponent: i8) -> Self {
        let mut exponents = self.0;
        let mut i = 0;
        while i < exponents.len() {
            exponents[i] *= exponent;
            i += 1;
        }
        Self(exponents)
    }

    /// The quotient of two units.
    pub const fn per(self, other: Self) -> Self {
        self.times(other.powi(-1))
    }

    /// The dimension of the unit.
    pub fn dimension(self) -> Dimension {
        let mut exponents = [0; 3];
        for (power, dimension) in self.0.into_iter().zip(DIMENSIONS) {
            for (exponent, part) in exponents.iter_mut().zip(dimension) {
                *exponent += i32::from(power) * part;
            }
        }
        Dimension(exponents)
    }

    /// The factors with their exponents, in the order of printing.
    pub fn factors(self) -> impl Iterator<Item = (&'static str, i8)> {
        NAMES
            .into_iter()
            .zip(self.0)
            .filter(|&(_, exponent)| exponent != 0)
    }

    /// The form in files: factors with `^` and the exponent, `1` for a number.
    pub fn code(self) -> String {
        let factor = |(name, exponent): (&str, i8)| match exponent {
            1 => name.to_string(),
            _ => format!("{name}^{exponent}"),
        };
        let factors: Vec<String> = self.factors().map(factor).collect();
        if factors.is_empty() {
            "1".into()
        } else {
            factors.join(" ")
        }
    }

    /// Reads the form that [`Unit::code`] writes; the factors may come in any order.
    pub fn parse(text: &str) -> Option<Self> {
        if text == "1" {
            return Some(Self::ONE);
        }
        let mut exponents = [0; 7];
        for factor in text.split(' ') {
            let (name, exponent) = factor.split_once('^').unwrap_or((factor, "1"));
            if exponent.starts_with(['+', '0']) || exponent.starts_with("-0") {
                return None;
            }
            let exponent: i8 = exponent.parse().ok()?;
            let entry = &mut exponents[NAMES.iter().position(|&known| known == name)?];
            let allowed =
                exponent != 0 && (-MAX_EXPONENT..=MAX_EXPONENT).contains(&exponent) && *entry == 0;
            *entry = allowed.then_some(exponent)?;
        }
        Some(Self(exponents))
    }
}

impl Display for Unit {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let (above, below): (Vec<_>, Vec<_>) =
            self.factors().partition(|&(_, exponent)| exponent > 0);
        let join = |factors: Vec<(&str, i8)>| {
            let factor = |(name, exponent): (&str, i8)| match exponent.unsigned_abs() {
                1 => name.to_string(),
                size => format!("{name}{}", superscript(size.into())),
            };
            factors
                .into_iter()
                .map(factor)
                .collect::<Vec<_>>()
                .join(" ")
        };
        let numerator = if above.is_empty() {
            "1".into()
        } else {
            join(above)
        };
        match below.len() {
            0 => formatter.write_str(&numerator),
            1 => write!(formatter, "{numerator}/{}", join(below)),
            _ => write!(formatter, "{numerator}/({})", join(below)),
        }
    }
}

/// A product of powers of mass, length and time. Angles are numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension([i32; 3]);

impl Dimension {
    /// The dimension of a number.
    pub const NONE: Self = Self([0; 3]);

    /// The dimension of a product; none if an exponent overflows `i32`.
    pub fn times(self, other: Self) -> Option<Self> {
        self.combine(other, i32::checked_add)
    }

    /// The dimension of a quotient; none if an exponent overflows `i32`.
    pub fn per(self, other: Self) -> Option<Self> {
        self.combine(other, i32::checked_sub)
    }

    /// The dimension of a power; none if an exponent overflows `i32`.
    pub fn powi(self, exponent: i32) -> Option<Self> {
        self.combine(Self([exponent; 3]), i32::checked_mul)
    }

    /// The dimension of a root; none if an exponent is not a multiple of `degree`.
    pub fn root(self, degree: i32) -> Option<Self> {
        self.0
            .iter()
            .all(|exponent| exponent % degree == 0)
            .then(|| Self(self.0.map(|exponent| exponent / degree)))
    }

    fn combine(self, other: Self, operation: fn(i32, i32) -> Option<i32>) -> Option<Self> {
        let mut exponents = self.0;
        for (exponent, other) in exponents.iter_mut().zip(other.0) {
            *exponent = operation(*exponent, other)?;
        }
        Some(Self(exponents))
    }
}

impl Display for Dimension {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        if *self == Self::NONE {
            return formatter.write_str("a number");
        }
        let factor = |(name, exponent): (&str, i32)| match exponent {
            1 => name.to_string(),
            _ => format!("{name}{}", superscript(exponent)),
        };
        let factors = ["kg", "m", "s"]
            .into_iter()
            .zip(self.0)
            .filter(|&(_, exponent)| exponent != 0);
        formatter.write_str(&factors.map(factor).collect::<Vec<_>>().join(" "))
    }
}

/// `number` in superscript digits.
pub fn superscript(number: i32) -> String {
    let digit = |character| match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        other => char::from_u32('⁰' as u32 + other as u32 - '0' as u32).unwrap_or(other),
    };
    number.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_and_read() {
        let acceleration = Unit::METRE.per(Unit::SECOND.powi(2));
        let damping = Unit::NEWTON.times(Unit::METRE).times(Unit::SECOND);
        for (unit, code, text) in [
            (Unit::ONE, "1", "1"),
            (acceleration, "m s^-2", "m/s²"),
            (damping, "N m s", "N m s"),
            (Unit::SECOND.powi(-1), "s^-1", "1/s"),
            (
                Unit::NEWTON.per(Unit::METRE.times(Unit::SECOND)),
                "N m^-1 s^-1",
                "N/(m s)",
            ),
        ] {
            assert_eq!(
                (unit.code().as_str(), unit.to_string().as_str()),
                (code, text)
            );
            assert_eq!(Unit::parse(code), Some(unit));
        }
        for bad in [
            "", "m^0", "m m", "kg^10", "m  s", "ft", "m^", "m^x", "m s^-2 ", "1 m", "m^1000",
            "m^+2", "m^02", "m^-02", "m^-", "m^2^2",
        ] {
            assert_eq!(Unit::parse(bad), None, "{bad}");
        }
    }

    #[test]
    fn dimensions_follow_from_units() {
        assert_eq!(
            Unit::JOULE.dimension(),
            Unit::NEWTON.times(Unit::METRE).dimension()
        );
        assert_eq!(
            Unit::WATT.times(Unit::SECOND).dimension(),
            Unit::JOULE.dimension()
        );
        assert_eq!(Unit::RADIAN.dimension(), Dimension::NONE);
        assert_eq!(
            Unit::METRE.powi(2).dimension().root(2),
            Some(Unit::METRE.dimension())
        );
        assert_eq!(Unit::METRE.dimension().root(2), None);
        assert_eq!(
            Unit::METRE
                .dimension()
                .powi(i32::MAX)
                .and_then(|d| d.powi(2)),
            None
        );
        assert_eq!(Unit::NEWTON.dimension().to_string(), "kg m s⁻²");
    }
}
