//! Calibration: settings of a brush from measured forces (MODEL, "Calibration").
//!
//! A [`Problem`] has brushes, the settings that are [`Fitted`] and what was measured. [`calibrate`] finds the values with the least sum of
//! squares from several starts, and tells how well the forces determine them: standard errors, intervals, correlations, what is not
//! determined, and where to measure next.

mod calibrated;
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

use nalgebra::DMatrix;
use spec_math::cephes64::{chdtrc, stdtri};

pub use calibrated::{Frame, calibrated};
use model::Model;
pub use next::{Next, Reach};
pub use parameters::{FitError, Fitted};
pub use problem::{Forces, Observation, Place, Problem, ProblemError, forces_of};
use search::Minimum;
pub use search::STARTS;
pub use simulator::{Interrupted, Means, Observer, Unwatched};
use simulator::{Precision, Simulator};
pub use statistics::{Errors, Undetermined, undetermined};
pub use words::{estimate, lines, summary};

/// The starts go downhill with filaments alone, of few segments, and as precisely as it takes to find the minima.
const COARSE: Precision =
    Precision { tolerance: 1e-3, step: 0.01, central: false, segments: 8, interacts: false, arrival: 3e-3 };
/// The minimum itself: errors of the derivatives are below 1e-4 (docs/calibration.md).
const FINE: Precision =
    Precision { tolerance: 1e-6, step: 1e-3, central: true, segments: usize::MAX, interacts: false, arrival: 3e-4 };
/// Intervals, and points to measure at next.
const MIDDLE: Precision = Precision { tolerance: 1e-4, step: 5e-3, ..FINE };
/// Brushes keep their own tolerance, 1e-3 of the impulse unless a file states another.
const OF_BRUSHES: Precision = Precision { step: 0.05, interacts: true, arrival: 1e-2, ..FINE };
/// Minima are refined whose sum of squares is at most so many times the least, or so large.
const REFINED: f64 = 4.0;
/// The most rounds in which the effect of interaction follows the settings.
const INTERACTION_ROUNDS: usize = 4;
/// Change of a coordinate at which it does no longer.
const SETTLED: f64 = 2e-3;
/// Relative error of derivatives next to a force that bends, how often a minimum moves away from there, and the step of derivatives that look past
/// bends.
const BENT: f64 = 5e-3;
const BENDS: usize = 4;
const WIDE: f64 = 0.03;
/// Two-sided probability of an interval.
const CONFIDENCE: f64 = 0.95;

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// What was fitted to what.
    pub problem: Problem,
    /// The value of each fitted setting.
    pub values: Vec<f64>,
    /// The simulated force of each observation.
    pub forces: Vec<f64>,
    /// The standard error that the calibration leaves each of them.
    pub force_errors: Vec<f64>,
    /// The errors of the coordinates: of logarithms of positive settings, and of shares of their range of others.
    pub errors: Errors,
    /// The ends of the 95 % interval of each value, by the profile of the sum of squares; none if it is not determined.
    pub intervals: Vec<Option<[f64; 2]>>,
    /// The sum of squared residuals over their standard deviations.
    pub chi_squared: f64,
    /// What is not determined.
    pub undetermined: Vec<Undetermined>,
    /// The sum of squares and the number of starts of each minimum that the starts found, the least first, at a coarse precision.
    pub minima: Vec<(f64, usize)>,
    /// The starts that could not be simulated.
    pub failed_starts: usize,
    /// The largest relative error of the derivatives, before they were extrapolated.
    pub derivative_error: f64,
    /// The best points to measure at next.
    pub next: Vec<Next>,
}

impl Calibration {
    /// The number of observations less that of settings.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        self.problem.observations.len() - self.values.len()
    }

    /// The probability that noise alone makes the sum of squares as large, if standard deviations are stated.
    #[must_use]
    pub fn probability(&self) -> Option<f64> {
        let freedom = self.degrees_of_freedom();
        (self.problem.has_std && freedom > 0).then(|| chdtrc(freedom as f64, self.chi_squared))
    }

    /// Whether the forces determine a setting.
    #[must_use]
    pub fn is_determined(&self, setting: usize) -> bool {
        !self.undetermined.iter().any(|group| group.settings.contains(&setting))
    }

    /// The standard error of a value.
    #[must_use]
    pub fn standard_error(&self, setting: usize) -> f64 {
        self.errors.standard_error(setting) * self.problem.fitted[setting].slope(self.values[setting])
    }

    /// The residual of an observation over its standard deviation, which is that of the residuals if none is stated.
    #[must_use]
    pub fn residual(&self, observation: usize) -> f64 {
        let Observation { value, std, .. } = self.problem.observations[observation];
        (self.forces[observation] - value) / (std * self.errors.scale.sqrt())
    }
}

/// Fits the settings of a problem to its forces. `None` if none of the starts can be simulated.
///
/// # Errors
/// If it is interrupted.
pub fn calibrate(problem: Problem, reach: Reach, means: Means<'_>) -> Result<Option<Calibration>, Interrupted> {
    let mut model = Model::new(Simulator::new(&problem, means));
    let (minima, failed_starts) = search::minima(&model, COARSE)?;
    let mut best: Option<Minimum> = None;
    let is_near =
        |minimum: &&Minimum| minimum.squares <= REFINED * minima[0].squares.max(problem.observations.len() as f64);
    for minimum in minima.iter().filter(is_near) {
        let refined = search::refined(&model, minimum, FINE)?;
        best = refined.into_iter().chain(best).min_by(|a, b| a.squares.total_cmp(&b.squares));
    }
    let Some(mut best) = best else { return Ok(None) };
    model.simulator.tell(0.8);
    let (jacobian, derivative_error) = if problem.has_brush() {
        best = interacting(&mut model, best)?;
        let (jacobian, error) = model.precise_jacobian(&best.x, OF_BRUSHES)?;
        if !error.is_finite() {
            return Err(model.simulator.failure());
        }
        (jacobian, error)
    } else {
        away_from_bends(&model, &mut best)?
    };
    let chi_squared = model.residuals(&best.forces).norm_squared();
    let freedom = problem.observations.len() - problem.fitted.len();
    let scale = if problem.has_std { 1.0 } else { chi_squared / freedom as f64 };
    let errors = Errors::of(&jacobian, scale);
    let values = model.values(&best.x);
    let spread = &jacobian * errors.covariance() * jacobian.transpose();
    let observations = problem.observations.iter().enumerate();
    let force_errors = observations.map(|(row, own)| own.std * spread[(row, row)].max(0.0).sqrt()).collect();
    let undetermined = undetermined(&problem, &values, &errors);
    let determined: Vec<usize> = (0..values.len())
        .filter(|setting| !undetermined.iter().any(|group| group.settings.contains(setting)))
        .collect();
    let share = 0.5 + 0.5 * CONFIDENCE;
    let quantile = if problem.has_std { spec_math::cephes64::ndtri(share) } else { stdtri(freedom as isize, share) };
    let found = profile::intervals(&model, &best, &jacobian, &errors, quantile.powi(2) * scale, &determined, MIDDLE)?;
    let mut intervals = vec![None; values.len()];
    for (&setting, ends) in determined.iter().zip(&found) {
        intervals[setting] = Some(ends.map(|end| problem.fitted[setting].value(end)));
    }
    model.simulator.tell(0.9);
    let next = next::next(&model, &best, &errors, reach, MIDDLE)?;
    let minima = minima.iter().map(|minimum| (minimum.squares, minimum.starts)).collect();
    let forces = best.forces;
    Ok(Some(Calibration {
        values,
        forces,
        force_errors,
        errors,
        intervals,
        chi_squared,
        undetermined,
        minima,
        failed_starts,
        derivative_error,
        next,
        problem,
    }))
}

/// The derivatives at a minimum of filaments alone. Where they tell that a contact begins or ends nearby, the minimum moves to a lower one, if
/// there is one beyond.
fn away_from_bends(model: &Model<'_>, best: &mut Minimum) -> Result<(DMatrix<f64>, f64), Interrupted> {
    for _ in 0..BENDS {
        let found = model.precise_jacobian(&best.x, FINE)?;
        if found.1 < BENT {
            return Ok(found);
        }
        let wide = model.jacobian(&best.x, &[], Precision { step: WIDE, ..MIDDLE })?;
        let Some(lower) = search::lower(model, best, &Errors::of(&wide, 1.0), MIDDLE)? else { return Ok(found) };
        let Some(refined) = search::refined(model, &lower, FINE)? else { return Ok(found) };
        if refined.squares >= best.squares {
            return Ok(found);
        }
        *best = refined;
    }
    model.precise_jacobian(&best.x, FINE)
}

/// The minimum with filaments that touch, from that of filaments alone. The forces of filaments alone, times the effect of interaction at
/// the last estimate, lead near it; then descents with interaction itself.
fn interacting(model: &mut Model<'_>, mut minimum: Minimum) -> Result<Minimum, Interrupted> {
    for _ in 0..INTERACTION_ROUNDS {
        follow_interaction(model, &minimum.x)?;
        let Some(next) = search::refined(model, &minimum, MIDDLE)? else { break };
        let moved = next.x.iter().zip(&minimum.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        minimum = next;
        if moved < SETTLED {
            break;
        }
    }
    minimum = search::refined(model, &minimum, OF_BRUSHES)?.ok_or_else(|| model.simulator.failure())?;
    follow_interaction(model, &minimum.x)?;
    Ok(minimum)
}

/// Takes the effect of interaction at `x`.
fn follow_interaction(model: &mut Model<'_>, x: &[f64]) -> Result<(), Interrupted> {
    model.factors.fill(1.0);
    let points = [x.to_vec()];
    let with = model.forces(&points, OF_BRUSHES)?;
    if with[0].iter().any(|force| !force.is_finite()) {
        return Err(model.simulator.failure());
    }
    let without = model.forces(&points, MIDDLE)?;
    for ((factor, with), without) in model.factors.iter_mut().zip(&with[0]).zip(&without[0]) {
        *factor = if *without != 0.0 && (with / without).is_finite() { with / without } else { 1.0 };
    }
    Ok(())
}
