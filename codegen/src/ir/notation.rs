//! Notation of the parts of an expression, and plain text as one notation.

use crate::ir::constant::Constant;
use crate::ir::unit::superscript;

/// Binding strength; larger values bind more.
pub const SUM: u8 = 1;
/// See [`SUM`]. Next to another factor, the denominator of a fraction with a slash would be
/// ambiguous.
pub const QUOTIENT: u8 = 2;
/// See [`SUM`].
pub const PRODUCT: u8 = 3;
/// See [`SUM`].
pub const POWER: u8 = 4;
/// See [`SUM`].
pub const ATOM: u8 = 5;

/// A written expression and its binding strength.
#[derive(Clone, Debug)]
pub struct Written {
    /// The expression.
    pub text: String,
    /// Its binding strength.
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

    /// Adds parentheses if it binds less than `context`.
    pub fn within(self, context: u8) -> String {
        if self.strength < context {
            format!("({})", self.text)
        } else {
            self.text
        }
    }
}

/// A way of writing expressions, as mathematics or in a programming language. The writer builds
/// sums, products and parentheses from these parts.
///
/// A sign between terms has a space on each side, where lines can be broken.
pub trait Notation {
    /// `true` for mathematics, which has terms and factors in the customary order. A program keeps
    /// the operations and the order of the graph.
    fn is_mathematics(&self) -> bool {
        true
    }
    /// The sign of a difference.
    fn minus(&self) -> char;
    /// A constant that is not negative.
    fn number(&self, value: Constant) -> String;
    /// A constant.
    fn constant(&self, value: Constant) -> Written {
        match value.is_negative() {
            true => Written::new(format!("{}{}", self.minus(), self.number(-value)), SUM),
            false => Written::new(self.number(value), PRODUCT),
        }
    }
    /// A name, in the notation of the model.
    fn symbol(&self, notation: &str) -> String;
    /// A quotient.
    fn quotient(&self, above: Written, below: Written) -> Written {
        let text = format!("{}/{}", above.within(PRODUCT), below.within(POWER));
        Written::new(text, QUOTIENT)
    }
    /// A power of a base that is an atom or in parentheses.
    fn raised(&self, base: &str, exponent: i32) -> Written;
    /// A real power.
    fn real_power(&self, base: Written, exponent: Written) -> String;
    /// The magnitude.
    fn magnitude(&self, argument: Written) -> String;
    /// The square root.
    fn root(&self, argument: &str) -> String;
    /// A function such as `sin`, to a power.
    fn function(&self, name: &str, exponent: i32, argument: Written) -> String;
    /// 1 where `a < b`, else 0.
    fn less_than(&self, a: Written, b: Written) -> String {
        format!("[{} < {}]", a.text, b.text)
    }
    /// `S` or one of its derivatives.
    fn half_angle_squared(&self, order: u8, argument: &str) -> String;
}

/// A function by its name, with parentheses unless the argument is an atom.
pub fn applied(name: &str, argument: &Written) -> String {
    match argument.strength {
        ATOM => format!("{name} {}", argument.text),
        _ => format!("{name}({})", argument.text),
    }
}

/// Plain text.
pub struct Text;

/// Magnitude from which a float has a power of ten, as it has below the inverse.
const MIN_SCIENTIFIC: f64 = 1e7;

/// Mantissa and exponent of a float that is written with a power of ten; `None` for others.
pub fn scientific(value: f64) -> Option<(String, String)> {
    let plain = value == 0.0
        || !value.is_finite()
        || (1.0 / MIN_SCIENTIFIC..MIN_SCIENTIFIC).contains(&value.abs());
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

    /// Writes common fractions as one character.
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

    fn raised(&self, base: &str, exponent: i32) -> Written {
        Written::new(format!("{base}{}", superscript(exponent)), POWER)
    }

    fn real_power(&self, base: Written, exponent: Written) -> String {
        format!("{}^{}", base.within(ATOM), exponent.within(ATOM))
    }

    fn magnitude(&self, argument: Written) -> String {
        format!("|{}|", argument.text)
    }

    fn root(&self, argument: &str) -> String {
        format!("√({argument})")
    }

    fn function(&self, name: &str, exponent: i32, argument: Written) -> String {
        match exponent {
            1 => applied(name, &argument),
            _ => applied(&self.raised(name, exponent).text, &argument),
        }
    }

    fn half_angle_squared(&self, order: u8, argument: &str) -> String {
        const PRIMES: [&str; 4] = ["", "′", "″", "‴"];
        match PRIMES.get(usize::from(order)) {
            Some(primes) => format!("S{primes}({argument})"),
            None => format!("S^({order})({argument})"),
        }
    }
}
