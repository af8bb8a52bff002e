//! Calibration: settings of a brush from measured forces (MODEL, "Calibration"), or from the radii
//! of an edge over time ("Removal and wear").
//!
//! A [`Problem`] has brushes, the settings that are [`Fitted`] and the measurements. [`calibrate`]
//! finds the values with the least sum of squares from several starts. The result has standard
//! errors, intervals, correlations, combinations of settings that are not determined, and the best
//! next measurements.

mod calibrated;
mod edge;
mod model;
mod next;
mod parameters;
mod problem;
mod profile;
mod record;
mod search;
mod simulator;
mod statistics;
mod words;

use std::ops::ControlFlow;

use bristle::model::settings::Settings;
use bristle::simulation::Sampling;
use nalgebra::DVector;
use parking_lot::Mutex;

use crate::grid::check::{finer_brush, finer_pass};
use crate::grid::{CaseResult, Study, simulate_cases};
use spec_math::cephes64::{chdtrc, stdtri};

pub use calibrated::calibrated;
pub use edge::Radii;
use model::Model;
pub use next::{MeasurementLimits, Next};
pub use parameters::{FitError, Fitted};
pub use problem::{Forces, Observation, Problem, ToolPlace, forces_of};
pub use search::STARTS;
use search::{Minimum, Search};
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
/// Precision with interaction. Brushes keep their own tolerance, by default 1e-3 of the impulse.
const OF_BRUSHES: Precision = Precision {
    step: 0.05,
    interacts: true,
    arrival: 1e-2,
    ..FINE
};
/// Largest number of rounds in which the effect of interaction follows the settings.
const MAX_INTERACTION_ROUNDS: usize = 4;
/// Change of a coordinate below which these rounds end.
const SETTLED_CHANGE: f64 = 2e-3;
/// Relative error of derivatives from which on a kink of a force is nearby, and the step of
/// derivatives that look past kinks.
const MIN_KINK_ERROR: f64 = 5e-3;
const STEP_PAST_KINKS: f64 = 0.03;
/// Distance of the minimum from the point of the derivatives, over the standard error, beyond which
/// they are computed anew. The second number limits how often.
const MAX_JACOBIAN_DISTANCE: f64 = 0.5;
const MAX_JACOBIAN_ROUNDS: usize = 5;
/// Probability below which residuals are more than noise, and slope of residuals over its standard
/// error from which on they have a trend.
const MIN_PROBABILITY: f64 = 0.01;
const MIN_TREND: f64 = 3.0;
/// Intervals between the reported times of the growth of an edge.
const GROWTH_INTERVALS: usize = 100;
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

/// Square root of time `R² = R_0² + c² t`, fitted to the same radii in place of the simulated
/// growth.
#[derive(Clone, Debug, PartialEq)]
pub struct SquareRoot {
    /// `c` in m/√s.
    pub c_m_per_sqrt_s: f64,
    /// Sum of squared residuals over their standard deviations.
    pub chi_squared: f64,
    /// Radius in m by this law at each observation.
    pub radii: Vec<f64>,
    /// Slope of measured less these radii, in standard deviations over the logarithm of time,
    /// divided by its standard error.
    pub trend: f64,
}

/// An edge at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrownEdge {
    /// The time in s.
    pub time_s: f64,
    /// Radius in m by the fit.
    pub radius_m: f64,
    /// Standard error in m that the calibration leaves the radius.
    pub error_m: f64,
    /// Radius in m by the square root of time.
    pub square_root_m: f64,
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

/// Fits the square root of time to the radii. Returns it with its problem and its values of the
/// fitted settings.
fn by_square_root(
    problem: &Problem,
    radii: &Radii,
    means: CalibrationContext<'_>,
) -> Result<Option<(SquareRoot, Problem, Vec<f64>)>, Interrupted> {
    let problem = Problem {
        radii: Some(radii.by_square_root()),
        ..problem.clone()
    };
    let model = Model::new(Simulator::new(&problem, means));
    let Some(best) = search::minima(&model, FINE)?.minima.into_iter().next() else {
        return Ok(None);
    };
    let values = model.values(&best.x);
    let residuals = -model.residuals(&best.forces);
    let later: Vec<(f64, f64)> = radii
        .turns
        .iter()
        .zip(&residuals)
        .filter(|(turns, _)| **turns > 0.0)
        .map(|(turns, own)| (turns.ln(), *own))
        .collect();
    let root = SquareRoot {
        c_m_per_sqrt_s: problem
            .radii
            .as_ref()
            .map_or(0.0, |radii| radii.speed_of_root(&problem.fitted, &values)),
        chi_squared: best.squares,
        radii: best.forces,
        trend: trend(&later),
    };
    Ok(Some((root, problem, values)))
}

/// Returns the slope of points over its standard error, by least squares; zero for fewer than
/// three.
fn trend(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    let (xx, xy) = (
        mean(&|point| (point.0 - x).powi(2)),
        mean(&|point| (point.0 - x) * (point.1 - y)),
    );
    let rest = mean(&|point| (point.1 - y - xy / xx * (point.0 - x)).powi(2));
    if points.len() < 3 || rest == 0.0 {
        0.0
    } else {
        xy / xx / (rest / (count - 2.0) / xx).sqrt()
    }
}

/// Returns the growth from the start to the last radius, with its standard error.
fn grown(
    model: &Model<'_>,
    radii: &Radii,
    best: &Minimum,
    errors: &Errors,
    (_, rooted, values_of_root): &(SquareRoot, Problem, Vec<f64>),
) -> Vec<GrownEdge> {
    let fitted = &model.problem().fitted;
    let last = radii.turns.last().copied().unwrap_or_default();
    let turns: Vec<f64> = (0..=GROWTH_INTERVALS)
        .map(|i| last * (i as f64 / GROWTH_INTERVALS as f64).powi(2))
        .collect();
    let here = radii.after(fitted, &model.values(&best.x), &turns);
    let stencil = model.stencil(
        &best.x,
        Precision {
            central: true,
            ..FINE
        },
    );
    let around: Vec<Vec<f64>> = stencil
        .points
        .iter()
        .map(|x| radii.after(fitted, &model.values(x), &turns))
        .collect();
    let of_root = rooted.radii.as_ref().map_or_else(Vec::new, |radii| {
        radii.after(fitted, values_of_root, &turns)
    });
    let covariance = errors.covariance();
    let edge = |(i, turns): (usize, &f64)| {
        let slopes = DVector::from_fn(fitted.len(), |column, _| {
            stencil.derivative(column, here[i], |point| around[point][i])
        });
        GrownEdge {
            time_s: turns * radii.second_per_turn,
            radius_m: here[i],
            error_m: (&covariance * &slopes).dot(&slopes).max(0.0).sqrt(),
            square_root_m: of_root[i],
        }
    };
    turns.iter().enumerate().map(edge).collect()
}

/// Refines the minimum of filaments alone, and returns it with its Jacobian and the error of this.
/// Where the error shows that a contact begins or ends nearby, a lower minimum beyond takes its
/// place, if there is one.
fn precise(model: &Model<'_>, mut best: Minimum) -> Result<Option<(Minimum, f64)>, Interrupted> {
    let mut found = None;
    for _ in 0..MAX_JACOBIAN_ROUNDS {
        let Some(at) = search::evaluated(model, vec![best.x], FINE)?
            .pop()
            .filter(|at| at.squares.is_finite())
        else {
            return Ok(found);
        };
        if found
            .as_ref()
            .is_some_and(|(lowest, _): &(Minimum, f64)| at.squares >= lowest.squares)
        {
            break;
        }
        let Some((end, error, moved)) = exact(model, at, FINE)? else {
            break;
        };
        found = Some((end.clone(), error));
        best = end;
        if moved > MAX_JACOBIAN_DISTANCE {
            continue;
        }
        if error < MIN_KINK_ERROR {
            break;
        }
        let wide = model.jacobians(
            &[(&best.x, &best.forces)],
            Precision {
                step: STEP_PAST_KINKS,
                central: true,
                ..MIDDLE
            },
        )?;
        let Some(lower) = search::lower(model, &best, &wide[0], MIDDLE)? else {
            break;
        };
        best = lower;
    }
    Ok(found)
}

/// Computes a precise Jacobian at a point near a minimum, and descends with it. Returns the
/// minimum, the error of the Jacobian, and the distance over the standard error in its direction.
/// `None` if points around this one cannot be simulated.
fn exact(
    model: &Model<'_>,
    at: Minimum,
    precision: Precision,
) -> Result<Option<(Minimum, f64, f64)>, Interrupted> {
    let (jacobian, error) = model.precise_jacobian(&at.x, &at.forces, precision)?;
    if !jacobian.iter().all(|derivative| derivative.is_finite()) {
        return Ok(None);
    }
    let end = search::descended(
        model,
        vec![Minimum {
            jacobian,
            ..at.clone()
        }],
        precision,
    )?
    .pop();
    let end = end.expect("it begins where it can be simulated");
    let step = DVector::from_iterator(
        at.x.len(),
        end.x.iter().zip(&at.x).map(|(end, at)| end - at),
    );
    let moved = (&end.jacobian * step).norm() / model.unit(end.squares).sqrt();
    Ok(Some((end, error, moved)))
}

/// Finds the minimum with filaments that touch from that of filaments alone, with the Jacobian
/// there and its error. Forces of filaments alone, times the effect of interaction at the last
/// estimate, lead near it. Descents with interaction follow.
fn interacting(model: &mut Model<'_>, mut minimum: Minimum) -> Result<(Minimum, f64), Interrupted> {
    for _ in 0..MAX_INTERACTION_ROUNDS {
        follow_interaction(model, &minimum.x)?;
        let Some(next) = search::refined(model, vec![minimum.clone()], MIDDLE)?.pop() else {
            break;
        };
        let moved = next
            .x
            .iter()
            .zip(&minimum.x)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        minimum = next;
        if moved < SETTLED_CHANGE {
            break;
        }
    }
    let near = search::refined(model, vec![minimum], OF_BRUSHES)?
        .pop()
        .ok_or_else(|| model.simulator.failure())?;
    let (minimum, error, _) =
        exact(model, near, OF_BRUSHES)?.ok_or_else(|| model.simulator.failure())?;
    follow_interaction(model, &minimum.x)?;
    Ok((minimum, error))
}

/// Updates the effect of interaction at `x`.
fn follow_interaction(model: &mut Model<'_>, x: &[f64]) -> Result<(), Interrupted> {
    model.factors.fill(1.0);
    let points = [x.to_vec()];
    let with = model.forces(&points, OF_BRUSHES)?;
    if with[0].iter().any(|force| !force.is_finite()) {
        return Err(model.simulator.failure());
    }
    let without = model.forces(&points, MIDDLE)?;
    for ((factor, with), without) in model.factors.iter_mut().zip(&with[0]).zip(&without[0]) {
        *factor = if *without != 0.0 && (with / without).is_finite() {
            with / without
        } else {
            1.0
        };
    }
    Ok(())
}
