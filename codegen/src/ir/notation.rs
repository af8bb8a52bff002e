//! How the parts of an expression are written, and how they are written as plain text.

use crate::ir::constant::Constant;
use crate::ir::unit::superscript;

/// Binding strengths.
pub const SUM: u8 = 1;
/// A fraction with a slash: next to another factor, its denominator would be ambiguous.
pub const QUOTIENT: u8 = 2;
/// See [`SUM`].
pub const PRODUCT: u8 = 3;
/// See [`SUM`].
pub const POWER: u8 = 4;
/// See [`SUM`].
pub const ATOM: u8 = 5;

/// A written expression and how strongly it binds.
#[derive(Clone, Debug)]
pub struct Written {
    /// The expression.
    pub text: String,
    /// How strongly it holds together.
    pub strength: u8,
}

impl Written {
    /// Creates an expression of the given strength.
    pub fn new(text: impl Into<String>, strength: u8) -> Self {
        Self {
            text: text.into(),
            strength,
        }
    }

    /// In parentheses if it binds less than `context`.
    pub fn within(self, context: u8) -> String {
        if self.strength < context {
            format!("({})", self.text)
        } else {
            self.text
        }
    }
}

/// A way of writing mathematics. The writer builds sums, products and parentheses from these parts.
///
/// A sign between terms has a space on each side, where lines can be broken.
pub trait Notation {
    /// The sign of a difference.
    fn minus(&self) -> char;
    /// A constant that is not negative.
    fn number(&self, value: Constant) -> String;
    /// A name, in the notation of the model.
    fn symbol(&self, notation: &str) -> String;
    /// An element of a vector or matrix.
    fn element(&self, array: &str, indices: &[String]) -> String;
    /// A quotient with a horizontal line, if there is one that fits.
    fn fraction(&self, above: &Written, below: &Written) -> Option<String>;
    /// A power of a base that is an atom or in parentheses.
    fn raised(&self, base: &str, exponent: i32) -> String;
    /// A real power of a base that is an atom or in parentheses.
    fn real_power(&self, base: &str, exponent: Written) -> String;
    /// The magnitude.
    fn magnitude(&self, argument: &str) -> String;
    /// The square root.
    fn root(&self, argument: &str) -> String;
    /// The name of a function, to a power other than one.
    fn function(&self, name: &str, exponent: i32) -> String;
    /// The name of `S` or of one of its derivatives.
    fn half_angle_squared(&self, order: u8) -> String;
    /// The width of a piece, in the unit of the notation.
    fn width(&self, text: &str) -> usize;
}

/// Plain text.
pub struct Text;

/// From this size on, and below its inverse, a float is written with a power of ten.
const LARGE: f64 = 1e7;

/// Mantissa and exponent of a float that is written with a power of ten; none for the others.
pub fn scientific(value: f64) -> Option<(String, String)> {
    let plain = value == 0.0 || !value.is_finite() || (1.0 / LARGE..LARGE).contains(&value.abs());
    let (mantissa, exponent) = (!plain)
        .then(|| format!("{value:e}"))?
        .split_once('e')
        .map(|(m, e)| (m.into(), e.into()))?;
    Some((mantissa, exponent))
}

impl Notation for Text {
    fn minus(&self) -> char {
        '−'
    }

    /// Common fractions as one character.
    fn number(&self, value: Constant) -> String {
        const FRACTIONS: [((i64, i64), &str); 8] = [
            ((1, 2), "½"),
            ((1, 3), "⅓"),
            ((2, 3), "⅔"),
            ((1, 4), "¼"),
            ((3, 4), "¾"),
            ((1, 8), "⅛"),
            ((3, 8), "⅜"),
            ((5, 8), "⅝"),
        ];
        if let Constant::Float(float) = value
            && let Some((mantissa, exponent)) = scientific(float)
        {
            return format!("{mantissa}e{exponent}");
        }
        let fraction = FRACTIONS.iter().find(|((numerator, denominator), _)| {
            value == Constant::ratio(*numerator, *denominator)
        });
        fraction.map_or_else(|| value.to_string(), |(_, text)| text.to_string())
    }

    fn symbol(&self, notation: &str) -> String {
        notation.into()
    }

    fn element(&self, array: &str, indices: &[String]) -> String {
        format!("{array}[{}]", indices.join(", "))
    }

    fn fraction(&self, _: &Written, _: &Written) -> Option<String> {
        None
    }

    fn raised(&self, base: &str, exponent: i32) -> String {
        format!("{base}{}", superscript(exponent))
    }

    fn real_power(&self, base: &str, exponent: Written) -> String {
        format!("{base}^{}", exponent.within(ATOM))
    }

    fn magnitude(&self, argument: &str) -> String {
        format!("|{argument}|")
    }

    fn root(&self, argument: &str) -> String {
        format!("√({argument})")
    }

    fn function(&self, name: &str, exponent: i32) -> String {
        if exponent == 1 {
            name.into()
        } else {
            self.raised(name, exponent)
        }
    }

    fn half_angle_squared(&self, order: u8) -> String {
        const PRIMES: [&str; 4] = ["", "′", "″", "‴"];
        PRIMES
            .get(usize::from(order))
            .map_or_else(|| format!("S^({order})"), |primes| format!("S{primes}"))
    }

    fn width(&self, text: &str) -> usize {
        text.chars().count()
    }
}
