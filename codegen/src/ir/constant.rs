//! Constants of the expression graph: exact rationals where they fit, `f64` where they do not.

use num_rational::Ratio;
use num_traits::{CheckedAdd, CheckedMul, One, ToPrimitive, Zero};

/// An exact rational number, or an `f64`.
///
/// Arithmetic between rationals is exact; where a numerator or denominator would overflow `i64`, or
/// an operand is a float, the result is a float. A float is never turned into a rational.
#[derive(Clone, Copy, Debug)]
pub enum Constant {
    /// An exact value; in a valid graph its numerator is not `i64::MIN`, which has no negative.
    Rational(Ratio<i64>),
    /// A value in double precision; finite in a valid graph.
    Float(f64),
}

// Identity is by bits, so that constants can be interned: 0.0 and -0.0 differ, and a NaN equals
// itself.
impl PartialEq for Constant {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Rational(a), Self::Rational(b)) => a == b,
            (Self::Float(a), Self::Float(b)) => a.to_bits() == b.to_bits(),
            _ => false,
        }
    }
}

impl Eq for Constant {}

impl std::hash::Hash for Constant {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        match self {
            Self::Rational(value) => value.hash(state),
            Self::Float(value) => value.to_bits().hash(state),
        }
    }
}

impl From<i64> for Constant {
    fn from(value: i64) -> Self {
        Self::exact(Ratio::from_integer(value)).unwrap_or(Self::Float(value as f64))
    }
}

impl Constant {
    /// The rational `numerator / denominator`.
    ///
    /// # Panics
    /// If `denominator` is zero.
    pub fn ratio(numerator: i64, denominator: i64) -> Self {
        Self::Rational(Ratio::new(numerator, denominator))
    }

    /// A rational whose negative and inverse are rational too.
    fn exact(value: Ratio<i64>) -> Option<Self> {
        (*value.numer() != i64::MIN).then_some(Self::Rational(value))
    }

    /// The nearest `f64`.
    pub fn value(self) -> f64 {
        match self {
            Self::Rational(value) => value.to_f64().unwrap_or(f64::NAN),
            Self::Float(value) => value,
        }
    }

    /// `true` for an exact or floating zero.
    pub fn is_zero(self) -> bool {
        match self {
            Self::Rational(value) => value.is_zero(),
            Self::Float(value) => value == 0.0,
        }
    }

    /// `true` for an exact one.
    pub fn is_one(self) -> bool {
        matches!(self, Self::Rational(value) if value.is_one())
    }

    /// `true` for an exact minus one.
    pub fn is_minus_one(self) -> bool {
        (-self).is_one()
    }

    /// `true` for a value below zero.
    pub fn is_negative(self) -> bool {
        self.value() < 0.0
    }

    /// The magnitude.
    pub fn abs(self) -> Self {
        if self.value().is_sign_negative() {
            -self
        } else {
            self
        }
    }

    /// The exact integer; `None` for other values.
    pub fn integer(self) -> Option<i32> {
        match self {
            Self::Rational(value) if value.is_integer() => value.to_i32(),
            _ => None,
        }
    }

    /// The inverse; none for zero.
    pub fn recip(self) -> Option<Self> {
        match self {
            _ if self.is_zero() => None,
            Self::Rational(value) => Some(Self::Rational(value.recip())),
            Self::Float(value) => Some(Self::Float(value.recip())),
        }
    }

    /// The integer power; none for a negative power of zero.
    pub fn powi(self, exponent: i32) -> Option<Self> {
        let base = if exponent < 0 { self.recip()? } else { self };
        Some((0..exponent.unsigned_abs()).fold(Self::from(1), |product, _| product * base))
    }
}

impl std::fmt::Display for Constant {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rational(value) => write!(formatter, "{value}"),
            Self::Float(value) => write!(formatter, "{value}"),
        }
    }
}

impl std::ops::Add for Constant {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        if let (Self::Rational(a), Self::Rational(b)) = (self, other)
            && let Some(sum) = a.checked_add(&b).and_then(Self::exact)
        {
            return sum;
        }
        Self::Float(self.value() + other.value())
    }
}

impl std::ops::Mul for Constant {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        if let (Self::Rational(a), Self::Rational(b)) = (self, other)
            && let Some(product) = a.checked_mul(&b).and_then(Self::exact)
        {
            return product;
        }
        Self::Float(self.value() * other.value())
    }
}

impl std::ops::Neg for Constant {
    type Output = Self;
    fn neg(self) -> Self {
        self * Self::from(-1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rationals_stay_exact_and_overflow_becomes_float() {
        assert_eq!(
            Constant::ratio(1, 3) + Constant::ratio(1, 6),
            Constant::ratio(1, 2)
        );
        assert_eq!(Constant::ratio(2, 3).powi(-2), Some(Constant::ratio(9, 4)));
        assert_eq!(Constant::from(0).powi(-1), None);
        let product = Constant::from(i64::MAX) * Constant::from(2);
        assert_eq!(product, Constant::Float(i64::MAX as f64 * 2.0));
        // The least integer fits but has no negative.
        let least = Constant::from(-(1 << 62)) * Constant::from(2);
        assert_eq!(least, Constant::Float(i64::MIN as f64));
        assert_eq!(Constant::from(i64::MIN), least);
        assert_eq!(least.recip(), Some(Constant::Float(1.0 / i64::MIN as f64)));
    }
}
