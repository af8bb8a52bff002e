//! A trial: computed numbers with their references and tolerances.

use std::error::Error;

use crate::sources::{self, ReferenceSource};
use crate::tolerances::{self, Measure, Tolerance};

/// The reason why a trial cannot be computed. It then fails.
pub type Failure = Box<dyn Error + Send + Sync>;

/// The end of a trial.
pub type TrialResult = Result<(), Failure>;

/// Comparisons with one reference.
#[derive(Default)]
pub struct Trial {
    /// The comparisons, in the order of the record.
    pub checks: Vec<Check>,
}

impl Trial {
    /// Compares a number with its reference: a value, or two bounds, for which the tolerance must
    /// be zero.
    pub fn check(
        &mut self,
        subject: impl Into<String>,
        quantity: &'static str,
        expected: impl Into<Expected>,
        source: &'static ReferenceSource,
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
        source: &'static ReferenceSource,
        computed: f64,
        tolerance: &'static Tolerance,
    ) {
        let bounds = match tolerance.measure {
            Measure::Between(low, high) => [low, high],
            Measure::Relative | Measure::Absolute => [f64::NAN; 2],
        };
        self.check(subject, quantity, bounds, source, computed, tolerance);
    }

    /// Compares the slopes of errors over the solver's tolerance with one. Slopes use only errors
    /// above `known`, the error of the reference.
    pub fn check_slopes(&mut self, courses: Vec<(String, Vec<(f64, f64)>)>, known: f64) {
        for (label, mut course) in courses {
            course.retain(|(_, error)| *error > known);
            let subject = format!("slope over the tolerance, {label}");
            let slope = logarithmic_slope(&course);
            self.check_within(subject, "order", sources::CONTROL, slope, tolerances::SLOPE);
        }
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
    pub source: &'static ReferenceSource,
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

    /// `true` if the error is within the tolerance. A number that is not finite never passes.
    pub fn passes(&self) -> bool {
        self.computed.is_finite() && self.error() <= self.tolerance.value
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

/// Check that a wrong number fails, and a right one passes.
pub const CHECK: (&str, fn()) = ("wrong numbers fail", || {
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let passes = |expected: Expected, computed: f64, tolerance| {
        let mut trial = Trial::default();
        let source = sources::EXACT;
        match expected {
            Expected::Value(value) => trial.check("", "", value, source, computed, tolerance),
            Expected::Between(low, high) => {
                trial.check("", "", [low, high], source, computed, tolerance)
            }
        }
        trial.checks[0].passes()
    };
    let (relative, same) = (tolerances::STATICS, tolerances::SAME);
    assert!(passes(Expected::Value(0.1 + 0.2), 0.3, relative));
    assert!(passes(Expected::Between(0.5, infinite), 0.5, same));
    for (expected, computed) in [
        (0.3, 0.3001),
        (0.3, nan),
        (0.3, infinite),
        (nan, 0.3),
        (0.0, 1e-300),
    ] {
        assert!(
            !passes(Expected::Value(expected), computed, relative),
            "{expected} {computed}"
        );
    }
    for (low, high, computed) in [
        (0.5, infinite, 0.4999),
        (0.5, infinite, nan),
        (0.5, infinite, infinite),
        (nan, 1.0, 0.5),
        (nan, nan, 0.5),
        (1.0, 0.0, 0.5),
    ] {
        assert!(
            !passes(Expected::Between(low, high), computed, same),
            "{low} {high} {computed}"
        );
    }
});
