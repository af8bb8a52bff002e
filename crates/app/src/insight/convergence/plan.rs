//! Cases to simulate: the compared values of each setting.

use bristle::model::parameters::Parameter;
use bristle::model::settings::{Settings, UncertaintySettings};
use bristle_study::grid::uncertainty::check;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::number::rounded;

use super::series::Series;
use super::{Convergence, ConvergenceError};

pub(super) const SEGMENTS: &str = "filament.segments";
pub(super) const SOLVER_TOLERANCE: &str = "solver.relative_tolerance";
pub(super) const BRUSH_TOLERANCE: &str = "brush.tolerance";
pub(super) const BRUSH_STIFFNESS: &str = "brush.stiffness_n_m2";

/// Numbers of segments, at ratios of about √2.
const SEGMENT_NUMBERS: [f64; 13] = [
    5.0, 8.0, 12.0, 17.0, 25.0, 35.0, 50.0, 70.0, 100.0, 140.0, 200.0, 280.0, 400.0,
];

/// Minimum ratio of the finest number of segments to the stated one; the finest error is then a
/// quarter. A filament alone also has a minimum finest number. A brush takes longer: its coarsest
/// number is at least the stated one over this ratio.
const MIN_REFINEMENT: f64 = 2.0;
const MIN_FINEST_SEGMENTS: f64 = 50.0;

/// Loosest relative tolerance, unless the stated one is looser, and ratio of the finest tolerance
/// to the stated one.
const MAX_TOLERANCE: f64 = 1e-3;
const MIN_TOLERANCE_SHARE: f64 = 1e-2;

/// Tolerances of a brush over the stated one. Beyond [`MAX_TOLERANCE`] steps do not grow.
const BRUSH_TOLERANCES: [f64; 5] = [10.0, 3.0, 1.0, 0.3, 0.1];

/// Stiffnesses over the stated one.
const STIFFNESSES: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];

/// Slack in comparisons of decimal numbers.
const ROUNDING: f64 = 1e-9;

/// The cases to simulate.
pub struct Plan {
    /// The first case has the stated settings.
    cases: Vec<Settings>,
    /// Settings with their values from coarse to fine, and the case of each value.
    series: Vec<(&'static Parameter, Vec<(f64, usize)>)>,
}

impl Plan {
    /// Creates the cases in which one setting after the other differs from `settings`, which state
    /// a depth. Tools are not sampled; only filaments within a brush vary.
    ///
    /// # Errors
    /// If the settings are wrong.
    pub fn new(settings: &Settings) -> Result<Self, ConvergenceError> {
        let mut stated = settings.clone();
        if stated.brush.is_none() {
            stated.uncertainty = UncertaintySettings::default();
        }
        check(&stated).map_err(ConvergenceError::Settings)?;
        let paths: &[&str] = match stated.brush {
            Some(_) => &[SEGMENTS, BRUSH_TOLERANCE, BRUSH_STIFFNESS],
            None => &[SEGMENTS, SOLVER_TOLERANCE],
        };
        let mut plan = Self {
            cases: vec![stated],
            series: Vec::new(),
        };
        for path in paths {
            let parameter = Parameter::find(path).expect("the table has these settings");
            let values = values(parameter, &plan.cases[0]);
            let cases = values
                .into_iter()
                .filter_map(|value| Some((value, plan.case(parameter, value)?)))
                .collect();
            plan.series.push((parameter, cases));
        }
        Ok(plan)
    }

    /// Returns the number of the case with a value; none if the settings cannot have it.
    fn case(&mut self, parameter: &Parameter, value: f64) -> Option<usize> {
        let stated = &self.cases[0];
        if parameter.get(stated) == value {
            return Some(0);
        }
        let mut settings = stated.clone();
        parameter.set(&mut settings, value);
        check(&settings).ok()?;
        self.cases.push(settings);
        Some(self.cases.len() - 1)
    }

    /// Returns the cases, for simulation in any order.
    #[must_use]
    pub fn study(&self) -> Study {
        Study::of_cases(self.cases.clone())
    }

    /// Judges the convergence from the results of all cases.
    ///
    /// # Errors
    /// If the stated settings have no force.
    ///
    /// # Panics
    /// If the number of results is not the number of cases.
    pub fn conclude(self, results: &[CaseResult]) -> Result<Convergence, ConvergenceError> {
        assert_eq!(results.len(), self.cases.len(), "a result for each case");
        match &results[0] {
            Err(error) => return Err(ConvergenceError::Stated(error.clone())),
            Ok(stated) if stated.metrics.tool_contact_normal_force_n == 0.0 => {
                return Err(ConvergenceError::NoContact);
            }
            Ok(_) => {}
        }
        let stated = &self.cases[0];
        let series = self.series.into_iter().map(|(parameter, cases)| Series {
            parameter,
            stated: parameter.get(stated),
            values: cases.iter().map(|(value, _)| *value).collect(),
            results: cases
                .iter()
                .map(|(_, case)| results[*case].clone())
                .collect(),
        });
        Ok(Convergence {
            settings: stated.clone(),
            series: series.collect(),
        })
    }
}

/// Returns the compared values of a setting, from coarse to fine.
pub(super) fn values(parameter: &Parameter, settings: &Settings) -> Vec<f64> {
    let stated = parameter.get(settings);
    let mut values: Vec<f64> = match parameter.path {
        SEGMENTS => {
            let is_brush = settings.brush.is_some();
            let finest = if is_brush {
                MIN_REFINEMENT * stated
            } else {
                MIN_FINEST_SEGMENTS.max(MIN_REFINEMENT * stated)
            };
            let end = SEGMENT_NUMBERS
                .iter()
                .position(|&number| number >= finest)
                .unwrap_or(SEGMENT_NUMBERS.len() - 1);
            let coarsest = if is_brush {
                stated / MIN_REFINEMENT
            } else {
                0.0
            };
            SEGMENT_NUMBERS[..=end]
                .iter()
                .copied()
                .filter(|&number| number >= coarsest)
                .collect()
        }
        SOLVER_TOLERANCE => {
            let (loosest, finest) = (
                MAX_TOLERANCE.max(stated),
                MIN_TOLERANCE_SHARE * stated * (1.0 - ROUNDING),
            );
            let powers = (2..=10).map(|power| format!("1e-{power}").parse().expect("a number"));
            powers
                .filter(|tolerance| (finest..=loosest).contains(tolerance))
                .collect()
        }
        BRUSH_TOLERANCE => {
            let loosest = MAX_TOLERANCE.max(stated) * (1.0 + ROUNDING);
            times(stated, BRUSH_TOLERANCES)
                .filter(|&tolerance| tolerance <= loosest)
                .collect()
        }
        _ => times(stated, STIFFNESSES).collect(),
    };
    values.push(stated);
    values.sort_by(f64::total_cmp);
    values.dedup();
    if is_finer_below(parameter) {
        values.reverse();
    }
    values
}

/// Returns a value times some factors, without digits from rounding.
fn times(value: f64, factors: [f64; 5]) -> impl Iterator<Item = f64> {
    factors.into_iter().map(move |factor| {
        if factor == 1.0 {
            value
        } else {
            rounded(factor * value, 4)
        }
    })
}

/// Returns `true` if smaller values are more precise.
fn is_finer_below(parameter: &Parameter) -> bool {
    [SOLVER_TOLERANCE, BRUSH_TOLERANCE].contains(&parameter.path)
}
