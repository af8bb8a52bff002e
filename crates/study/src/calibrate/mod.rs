//! Calibration: settings of a brush from measured forces (MODEL, "Calibration"), or from the radii
//! of an edge over time ("Removal and wear").
//!
//! A [`Problem`] has brushes, the settings that are [`Fitted`] and the measurements. [`calibrate`]
//! finds the values with the least sum of squares from several starts. The result has standard
//! errors, intervals, correlations, combinations of settings that are not determined, and the best
//! next measurements.

mod calibrated;
mod edge;
mod growth;
mod model;
mod next;
mod parameters;
mod problem;
mod profile;
mod record;
mod refinement;
mod search;
mod simulator;
mod statistics;
mod words;

use std::ops::ControlFlow;

use bristle::model::settings::Settings;
use bristle::simulation::Sampling;
use parking_lot::Mutex;

use crate::grid::check::{finer_brush, finer_pass};
use crate::grid::{CaseResult, Study, simulate_cases};
use spec_math::cephes64::{chdtrc, stdtri};

pub use calibrated::calibrated;
pub use edge::Radii;
pub use growth::{GrownEdge, SquareRoot};
use growth::{by_square_root, grown};
use model::Model;
pub use next::{MeasurementLimits, Next};
pub use parameters::{FitError, Fitted};
pub use problem::{Forces, Observation, Problem, ToolPlace, forces_of};
use refinement::{interacting, precise};
pub use search::STARTS;
use search::Search;
pub use simulator::{CalibrationContext, Interrupted, Observer, SilentObserver};
use simulator::{Precision, Simulator};
pub use statistics::{Errors, Undetermined, undetermined};
pub use words::{estimate, lines, square_root_words, summary};

/// Precision of the descents from the starts: filaments alone, of few segments, just precise enough
/// to find the minima.
const COARSE: Precision = Precision {
    tolerance: 3e-3,
    step: 0.02,
    central: false,
    segments: 8,
    interacts: false,
    arrival: 0.1,
};
/// Precision near the minimum, for intervals and next measurements: forces to 1e-4 of their values.
const MIDDLE: Precision = Precision {
    tolerance: 1e-3,
    step: 0.01,
    segments: usize::MAX,
    arrival: 1e-2,
    ..COARSE
};
/// Precision of the minimum itself: errors of the derivatives are below 1e-4.
const FINE: Precision = Precision {
    tolerance: 1e-6,
    step: 1e-3,
    arrival: 1e-4,
    ..MIDDLE
};
/// Probability below which residuals are more than noise, and slope of residuals over its standard
/// error from which on they have a trend.
const MIN_PROBABILITY: f64 = 0.01;
const MIN_TREND: f64 = 3.0;
/// Two-sided probability of an interval.
const CONFIDENCE: f64 = 0.95;

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Fitted settings and measurements.
    pub problem: Problem,
    /// Value of each fitted setting.
    pub values: Vec<f64>,
    /// Simulated force of each observation.
    pub forces: Vec<f64>,
    /// Standard error that the calibration leaves each force.
    pub force_errors: Vec<f64>,
    /// Errors of the coordinates: of logarithms of positive settings, and of shares of the range of
    /// others.
    pub errors: Errors,
    /// Ends of the 95 % interval of each value, by the profile of the sum of squares; none if the
    /// value is not determined.
    pub intervals: Vec<Option<[f64; 2]>>,
    /// Sum of squared residuals over their standard deviations.
    pub chi_squared: f64,
    /// Variance of residuals without a misfit: 1 if standard deviations are stated.
    pub variance: f64,
    /// Settings that are not determined.
    pub undetermined: Vec<Undetermined>,
    /// Sum of squares and the number of starts of each minimum that the starts found, the least
    /// first, at a coarse precision.
    pub minima: Vec<(f64, usize)>,
    /// Number of starts that were stopped far above the least minimum.
    pub stopped_starts: usize,
    /// Number of starts that could not be simulated.
    pub failed_starts: usize,
    /// Largest relative error of the derivatives, before extrapolation.
    pub derivative_error: f64,
    /// Best points to measure at next; none for radii.
    pub next: Vec<Next>,
    /// Square root of time, fitted to the same radii; none for forces.
    pub square_root: Option<SquareRoot>,
    /// Growth over time, for radii.
    pub growth: Vec<GrownEdge>,
}

impl Calibration {
    /// Returns the number of observations less that of settings.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        self.problem.observations.len() - self.values.len()
    }

    /// Returns the probability that noise alone makes the sum of squares as large, if standard
    /// deviations are stated.
    #[must_use]
    pub fn probability(&self) -> Option<f64> {
        self.probability_of(self.chi_squared)
    }

    /// Returns this probability for another sum of squares.
    pub(crate) fn probability_of(&self, chi_squared: f64) -> Option<f64> {
        let freedom = self.degrees_of_freedom();
        (self.problem.has_std && freedom > 0).then(|| chdtrc(freedom as f64, chi_squared))
    }

    /// Returns `true` if the square root of time fits the radii: noise alone makes such residuals
    /// or, without standard deviations, they have no trend. `None` if there are as many settings as
    /// radii.
    #[must_use]
    pub fn square_root_fits(&self, root: &SquareRoot) -> Option<bool> {
        match self.probability_of(root.chi_squared) {
            Some(probability) => Some(probability >= MIN_PROBABILITY),
            None => (self.degrees_of_freedom() > 0).then_some(root.trend.abs() < MIN_TREND),
        }
    }

    /// Returns `true` if the forces determine a setting.
    #[must_use]
    pub fn is_determined(&self, setting: usize) -> bool {
        !self
            .undetermined
            .iter()
            .any(|group| group.settings.contains(&setting))
    }

    /// Returns the standard error of a value.
    #[must_use]
    pub fn standard_error(&self, setting: usize) -> f64 {
        self.errors.standard_error(setting)
            * self.problem.fitted[setting].slope(self.values[setting])
    }

    /// Returns the largest relative change of a force or a radius that is simulated more precisely
    /// at the fitted values: passes at a tenth of their tolerance, brushes at a quarter.
    ///
    /// # Errors
    /// If it is interrupted, or a point cannot be simulated.
    pub fn change_when_checked(&self, means: CalibrationContext<'_>) -> Result<f64, Interrupted> {
        let Self {
            problem,
            values,
            forces,
            ..
        } = self;
        let finer = |settings: Settings| {
            if settings.brush.is_some() {
                finer_brush(&settings)
            } else {
                finer_pass(&settings)
            }
        };
        let checked: Vec<f64> = if let Some(radii) = &problem.radii {
            let mut radii = radii.clone();
            let settings = finer(problem.brushes[0].settings.clone());
            let tell = |done: usize, of: usize| means.observer.done(done as f64 / of as f64);
            radii.follow(
                &settings,
                &problem.fitted,
                means.resources,
                means.stop,
                &tell,
            )?;
            radii.after(&problem.fitted, values, &radii.turns)
        } else {
            let settings = |point| {
                let settings = problem.settings(&ToolPlace::of(point), values);
                settings
                    .map(finer)
                    .map_err(|error| Interrupted::Failed(error.to_string()))
            };
            let settings = problem
                .points
                .iter()
                .map(settings)
                .collect::<Result<Vec<_>, _>>()?;
            let study = Study::of_cases(settings);
            let all: Vec<usize> = (0..study.case_count()).collect();
            let results = Mutex::new(vec![None; all.len()]);
            let done = |case: usize, result: CaseResult| {
                results.lock()[case] = Some(result);
                ControlFlow::Continue(())
            };
            simulate_cases(
                &study,
                &all,
                means.resources,
                means.stop,
                Sampling::default(),
                |_, _| {},
                done,
            )?;
            let results = results.into_inner();
            let of_point = |own: &Observation| match &results[own.point] {
                Some(Ok(summary)) => Ok(forces_of(&summary.metrics)[own.force]),
                Some(Err(error)) => Err(Interrupted::Failed(error.clone())),
                None => Err(Interrupted::Stopped),
            };
            problem
                .observations
                .iter()
                .map(of_point)
                .collect::<Result<_, _>>()?
        };
        let changes = forces.iter().zip(&checked);
        Ok(changes
            .map(|(force, checked)| (force / checked - 1.0).abs())
            .fold(0.0, f64::max))
    }

    /// Returns the relative standard deviation of what was measured about what was fitted; zero if
    /// there are as many settings as observations.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        let observations = self.problem.observations.iter().zip(&self.forces);
        let squares: f64 = observations
            .map(|(own, fitted)| (fitted / own.value - 1.0).powi(2))
            .sum();
        match self.degrees_of_freedom() {
            0 => 0.0,
            freedom => (squares / freedom as f64).sqrt(),
        }
    }

    /// Returns the residual of an observation over its standard deviation, or over that of the
    /// residuals if none is stated.
    #[must_use]
    pub fn residual(&self, observation: usize) -> f64 {
        let Observation { value, std, .. } = self.problem.observations[observation];
        (self.forces[observation] - value) / (std * self.variance.sqrt())
    }
}

/// Fits the settings of a problem to the measurements. `None` if none of the starts can be
/// simulated.
///
/// # Errors
/// If it is interrupted.
pub fn calibrate(
    mut problem: Problem,
    reach: MeasurementLimits,
    means: CalibrationContext<'_>,
) -> Result<Option<Calibration>, Interrupted> {
    // The start of the growth of an edge is known, and the fit has one minimum.
    let starts = if problem.radii.is_some() {
        0
    } else {
        means.starts
    };
    let means = CalibrationContext { starts, ..means };
    if let Some(radii) = &mut problem.radii {
        let tell = |done: usize, of: usize| means.observer.done(0.9 * done as f64 / of as f64);
        radii.follow(
            &problem.brushes[0].settings,
            &problem.fitted,
            means.resources,
            means.stop,
            &tell,
        )?;
    }
    let mut model = Model::new(Simulator::new(&problem, means));
    let Search {
        minima,
        stopped,
        failed,
    } = search::minima(&model, COARSE)?;
    let Some(lowest) = minima.first().map(|minimum| minimum.squares) else {
        return Ok(None);
    };
    let highest = model.highest(lowest);
    let near = minima
        .iter()
        .filter(|minimum| minimum.squares <= highest)
        .cloned()
        .collect();
    let refined = search::refined(&model, near, MIDDLE)?;
    let Some(best) = refined
        .into_iter()
        .min_by(|a, b| a.squares.total_cmp(&b.squares))
    else {
        return Ok(None);
    };
    model.simulator.tell(0.6);
    let (best, derivative_error) = if problem.has_brush() {
        interacting(&mut model, best)?
    } else {
        let Some(found) = precise(&model, best)? else {
            return Ok(None);
        };
        found
    };
    let jacobian = &best.jacobian;
    let chi_squared = model.residuals(&best.forces).norm_squared();
    let freedom = problem.observations.len() - problem.fitted.len();
    let per_freedom = chi_squared / freedom as f64;
    let variance = if problem.has_std { 1.0 } else { per_freedom };
    // Residuals larger than the stated deviations are a misfit of the model (Birge ratio).
    let scale = if freedom > 0 {
        variance.max(per_freedom)
    } else {
        variance
    };
    let is_misfit = scale > variance;
    let errors = Errors::of(jacobian, scale);
    let values = model.values(&best.x);
    let spread = jacobian * errors.covariance() * jacobian.transpose();
    let observations = problem.observations.iter().enumerate();
    let force_errors = observations
        .map(|(row, own)| own.std * spread[(row, row)].max(0.0).sqrt())
        .collect();
    let undetermined = undetermined(&problem, &values, &errors);
    let determined: Vec<usize> = (0..values.len())
        .filter(|setting| {
            !undetermined
                .iter()
                .any(|group| group.settings.contains(setting))
        })
        .collect();
    let share = 0.5 + 0.5 * CONFIDENCE;
    let quantile = if problem.has_std && !is_misfit {
        spec_math::cephes64::ndtri(share)
    } else {
        stdtri(freedom as isize, share)
    };
    let found = profile::intervals(
        &model,
        &best,
        jacobian,
        &errors,
        quantile.powi(2) * scale,
        &determined,
        MIDDLE,
    )?;
    let mut intervals = vec![None; values.len()];
    for (&setting, ends) in determined.iter().zip(&found) {
        intervals[setting] = Some(ends.map(|end| problem.fitted[setting].value(end)));
    }
    model.simulator.tell(0.9);
    let (square_root, growth, next) = match &problem.radii {
        Some(radii) => {
            let Some(rooted) = by_square_root(&problem, radii, means)? else {
                return Ok(None);
            };
            let growth = grown(&model, radii, &best, &errors, &rooted);
            (Some(rooted.0), growth, Vec::new())
        }
        None => (
            None,
            Vec::new(),
            next::next(
                &model,
                &best,
                &errors,
                reach,
                Precision {
                    central: true,
                    ..MIDDLE
                },
            )?,
        ),
    };
    let minima = minima
        .iter()
        .map(|minimum| (minimum.squares, minimum.starts))
        .collect();
    let forces = best.forces;
    Ok(Some(Calibration {
        values,
        forces,
        force_errors,
        errors,
        intervals,
        chi_squared,
        variance,
        undetermined,
        minima,
        stopped_starts: stopped,
        failed_starts: failed,
        derivative_error,
        next,
        square_root,
        growth,
        problem,
    }))
}
