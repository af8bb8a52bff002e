//! A trial: its formula, the computed numbers with their references, and whether they agree.

use bristle_report::drawing::diagram::Diagram;
pub use bristle_report::drawing::diagram::{Curve, Look};
pub use bristle_report::drawing::scale::Axis;

use super::sources::{self, Source};
use super::tolerances::{self, Measure, Tolerance};

/// A group of checks against one reference, which is one section of the page. Printed text calls it
/// a case.
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

impl Trial {
    /// A trial that compares nothing yet.
    pub fn new(title: &'static str, text: impl Into<String>) -> Self {
        Self {
            title,
            text: text.into(),
            checks: Vec::new(),
            figures: Vec::new(),
        }
    }

    /// Compares a number with what it should be: a value, or between two bounds, for which the
    /// tolerance must be zero.
    pub fn check(
        &mut self,
        subject: impl Into<String>,
        quantity: &'static str,
        expected: impl Into<Expected>,
        source: &'static Source,
        computed: f64,
        tolerance: &'static Tolerance,
    ) {
        let (subject, expected) = (subject.into(), expected.into());
        self.checks.push(Check {
            subject,
            quantity,
            expected,
            source,
            computed,
            tolerance,
        });
    }

    /// Compares the order of convergence from n to 2n, whose solutions are `coarse` and `fine`,
    /// with that of the chain.
    pub fn check_order(
        &mut self,
        subject: String,
        quantity: &'static str,
        [coarse, fine]: [f64; 2],
        exact: f64,
    ) {
        let order = ((coarse - exact) / (fine - exact)).abs().log2();
        self.check(
            subject,
            quantity,
            2.0,
            sources::CHAIN,
            order,
            tolerances::ORDER,
        );
    }

    /// Compares a number that should lie between the bounds of a tolerance. It never passes if the
    /// tolerance has no bounds.
    pub fn check_within(
        &mut self,
        subject: impl Into<String>,
        quantity: &'static str,
        source: &'static Source,
        computed: f64,
        tolerance: &'static Tolerance,
    ) {
        let bounds = match tolerance.measure {
            Measure::Between(low, high) => [low, high],
            Measure::Relative | Measure::Absolute => [f64::NAN; 2],
        };
        self.check(subject, quantity, bounds, source, computed, tolerance);
    }

    /// Adds the diagram of some errors over the solver's tolerance, and checks that the slope of
    /// each curve is one. Slopes use only errors above `known`, the error of the reference.
    pub fn study_tolerance(
        &mut self,
        name: &'static str,
        title: &str,
        courses: Vec<(String, Vec<(f64, f64)>)>,
        known: f64,
    ) {
        let mut curves = Vec::new();
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for (label, course) in courses {
            let above: Vec<(f64, f64)> = course
                .iter()
                .copied()
                .filter(|(_, error)| *error > known)
                .collect();
            let (subject, slope) = (
                format!("slope over the tolerance, {label}"),
                logarithmic_slope(&above),
            );
            self.check_within(subject, "order", sources::CONTROL, slope, tolerances::SLOPE);
            for (tolerance, _) in &course {
                (low, high) = (low.min(*tolerance), high.max(*tolerance));
            }
            curves.push(Curve::new(label, Look::Joined, course));
        }
        curves.push(Curve::new(
            "error = tolerance",
            Look::Reference,
            vec![(low, low), (high, high)],
        ));
        self.figures.push(Figure {
            name,
            title: title.to_owned(),
            description: "Errors over the solver's tolerance, both logarithmic: they fall in proportion to it, down to the accuracy of \
                the reference.",
            axes: [Axis::logarithmic("relative tolerance of the solver"), Axis::logarithmic("error")],
            curves,
        });
    }
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

impl From<f64> for Expected {
    fn from(value: f64) -> Self {
        Self::Value(value)
    }
}

impl From<[f64; 2]> for Expected {
    fn from([low, high]: [f64; 2]) -> Self {
        Self::Between(low, high)
    }
}

impl Check {
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

    /// The error, relative or absolute as the tolerance measures it. For bounds, the distance
    /// outside them.
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
            Expected::Between(low, high)
                if [low, high, self.computed].into_iter().any(f64::is_nan) =>
            {
                f64::NAN
            }
            Expected::Between(low, high) => {
                (low - self.computed).max(self.computed - high).max(0.0)
            }
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
    pub description: &'static str,
    /// The horizontal and the vertical axis.
    pub axes: [Axis; 2],
    /// The curves, in drawing order.
    pub curves: Vec<Curve>,
}

impl Figure {
    /// The diagram as the text of an SVG file.
    pub fn svg(&self) -> String {
        let Self {
            title,
            axes: [x, y],
            curves,
            ..
        } = self.clone();
        Diagram {
            title,
            subtitle: String::new(),
            x,
            y,
            curves,
        }
        .draw()
        .svg()
    }
}

/// Slope of the least-squares line through points in logarithmic coordinates.
pub fn logarithmic_slope(points: &[(f64, f64)]) -> f64 {
    let points: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.log10(), y.log10())).collect();
    let mean =
        |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    points
        .iter()
        .map(|point| (point.0 - x) * (point.1 - y))
        .sum::<f64>()
        / points
            .iter()
            .map(|point| (point.0 - x).powi(2))
            .sum::<f64>()
}
