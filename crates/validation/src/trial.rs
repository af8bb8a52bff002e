//! A trial: its formula, the computed numbers with their references, and whether they agree.

use bristle_report::drawing::diagram::Diagram;
pub use bristle_report::drawing::diagram::{Curve, Look};
pub use bristle_report::drawing::scale::Axis;

use super::sources::Source;
use super::tolerances::{Measure, Tolerance};

/// A group of checks against one reference, which is one section of the page. Printed text calls it a case.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Heading.
    pub title: &'static str,
    /// What is computed, the exact formula, and how they are compared; Markdown.
    pub text: String,
    /// The comparisons.
    pub checks: Vec<Check>,
    /// Their diagrams.
    pub figures: Vec<Figure>,
}

/// One computed number and its reference.
#[derive(Clone, Debug)]
pub struct Check {
    /// The parameters it is computed for.
    pub subject: String,
    /// The symbol, with its unit if it has one.
    pub quantity: &'static str,
    /// The reference.
    pub expected: Expected,
    /// The source of the reference.
    pub source: &'static Source,
    /// Bristle's result.
    pub computed: f64,
    /// The allowed error.
    pub tolerance: &'static Tolerance,
}

/// The reference of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// A value, which the number must match within the tolerance.
    Value(f64),
    /// A lower and an upper bound, if no value is known.
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

    /// A number that should lie between `low` and `high`; the tolerance must be zero.
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

    /// A number that should lie between the bounds of a tolerance. It never passes if the tolerance has no bounds.
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

    /// The lowest and the highest passing number.
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

    /// The error, relative or absolute as the tolerance measures it. For bounds, the distance outside them.
    pub fn error(&self) -> f64 {
        match self.expected {
            Expected::Value(value) => {
                let difference = (self.computed - value).abs();
                match self.tolerance.measure {
                    Measure::Relative => difference / value.abs(),
                    Measure::Absolute | Measure::Between(..) => difference,
                }
            }
            // `max` of a number and NaN would be the number.
            Expected::Between(low, high) if [low, high, self.computed].into_iter().any(f64::is_nan) => f64::NAN,
            Expected::Between(low, high) => (low - self.computed).max(self.computed - high).max(0.0),
        }
    }

    /// True if the error is within the tolerance. A number that is not finite never passes.
    pub fn passes(&self) -> bool {
        self.computed.is_finite() && self.error() <= self.tolerance.value
    }
}

/// A diagram of a trial.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of its file, without `.svg`.
    pub name: &'static str,
    /// Heading.
    pub title: String,
    /// Alternative text: what the diagram shows.
    pub description: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, in drawing order.
    pub curves: Vec<Curve>,
}

impl Figure {
    /// The diagram as the text of an SVG file.
    pub fn svg(&self) -> String {
        let Self { title, x, y, curves, .. } = self.clone();
        Diagram { title, subtitle: String::new(), x, y, curves }.draw().svg()
    }
}
