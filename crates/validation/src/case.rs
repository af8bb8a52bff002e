//! What a case of the validation says: its formula, what was computed beside it, and whether that is near enough.

use bristle_report::drawing::diagram::Diagram;
pub use bristle_report::drawing::diagram::{Curve, Look};
pub use bristle_report::drawing::scale::Axis;

use super::sources::Source;
use super::tolerances::{Measure, Tolerance};

/// A case: one paragraph of the page.
#[derive(Clone, Debug)]
pub struct Case {
    /// Heading.
    pub title: &'static str,
    /// What is computed, the exact formula and how they are compared; Markdown.
    pub text: String,
    /// The comparisons.
    pub checks: Vec<Check>,
    /// What they look like.
    pub figures: Vec<Figure>,
}

/// One number beside what it should be.
#[derive(Clone, Debug)]
pub struct Check {
    /// For which parameters.
    pub subject: String,
    /// The symbol, with its unit if it has one.
    pub quantity: &'static str,
    /// What it should be.
    pub expected: Expected,
    /// Who says so.
    pub source: &'static Source,
    /// What Bristle gives.
    pub computed: f64,
    /// How far it may be off.
    pub tolerance: &'static Tolerance,
}

/// What a number should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// This, within the tolerance.
    Value(f64),
    /// Between these, where only bounds are known.
    Between(f64, f64),
}

impl Check {
    /// A number that should be `expected`.
    pub fn value(
        subject: String,
        quantity: &'static str,
        expected: f64,
        source: &'static Source,
        computed: f64,
        tolerance: &'static Tolerance,
    ) -> Self {
        Self { subject, quantity, expected: Expected::Value(expected), source, computed, tolerance }
    }

    /// A number that should lie between `low` and `high`, for a tolerance that is zero.
    pub fn between(
        subject: String,
        quantity: &'static str,
        [low, high]: [f64; 2],
        source: &'static Source,
        computed: f64,
        tolerance: &'static Tolerance,
    ) -> Self {
        Self { subject, quantity, expected: Expected::Between(low, high), source, computed, tolerance }
    }

    /// A number that should lie between the bounds of a tolerance; none of another kind lets it pass.
    pub fn within(
        subject: String,
        quantity: &'static str,
        source: &'static Source,
        computed: f64,
        tolerance: &'static Tolerance,
    ) -> Self {
        let bounds = match tolerance.measure {
            Measure::Between(low, high) => [low, high],
            Measure::Relative | Measure::Absolute => [f64::NAN; 2],
        };
        Self::between(subject, quantity, bounds, source, computed, tolerance)
    }

    /// The lowest and the highest number that pass.
    pub fn limits(&self) -> [f64; 2] {
        match self.expected {
            Expected::Value(value) => {
                let margin = match self.tolerance.measure {
                    Measure::Relative => self.tolerance.value * value.abs(),
                    Measure::Absolute | Measure::Between(..) => self.tolerance.value,
                };
                [value - margin, value + margin]
            }
            Expected::Between(low, high) => [low, high],
        }
    }

    /// How far the number is off, as the tolerance measures it; from bounds, how far outside.
    pub fn error(&self) -> f64 {
        match self.expected {
            Expected::Value(value) => {
                let difference = (self.computed - value).abs();
                match self.tolerance.measure {
                    Measure::Relative => difference / value.abs(),
                    Measure::Absolute | Measure::Between(..) => difference,
                }
            }
            // The larger of a number and NaN would be the number.
            Expected::Between(low, high) if [low, high, self.computed].into_iter().any(f64::is_nan) => f64::NAN,
            Expected::Between(low, high) => (low - self.computed).max(self.computed - high).max(0.0),
        }
    }

    /// True if the number is near enough; one that is not finite never is.
    pub fn passes(&self) -> bool {
        self.computed.is_finite() && self.error() <= self.tolerance.value
    }
}

/// A diagram of a case.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of its file, without `.svg`.
    pub name: &'static str,
    /// Heading.
    pub title: String,
    /// What it shows, for those who do not see it.
    pub description: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// What is drawn, in this order.
    pub curves: Vec<Curve>,
}

impl Figure {
    /// The diagram as the text of an SVG file.
    pub fn svg(&self) -> String {
        let Self { title, x, y, curves, .. } = self.clone();
        Diagram { title, subtitle: String::new(), x, y, curves }.draw().svg()
    }
}
