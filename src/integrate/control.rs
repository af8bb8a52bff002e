//! Step lengths chosen by the estimated error, and the work done.

use super::stepper::AttemptError;
use super::tableau::Tableau;
use super::{IntegrationError, RejectionCause, Work};

/// Limits on the change of the step, and the margin below the step that would just be accepted.
const MIN_FACTOR: f64 = 0.2;
const MAX_FACTOR: f64 = 5.0;
const SAFETY: f64 = 0.9;
/// The step factor after an attempt without a state.
const FAILURE_FACTOR: f64 = 0.3;
/// A step below this many roundings of the time cannot advance it.
const MIN_STEP_ROUNDINGS: f64 = 8.0;
/// Near time zero, where roundings vanish, this share of the remaining time replaces the time.
const MIN_STEP_SHARE: f64 = 1e-3;

/// The length of the next step, and whether it is cut short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// In s.
    pub step: f64,
    /// The step reaches the end: take the end time itself, not a sum.
    pub limited: bool,
    /// The time left before it, in s.
    pub remaining: f64,
}

/// Chooses the steps of one integration.
#[derive(Clone, Debug)]
pub struct StepControl {
    order: f64,
    /// The step to try next in s.
    step: f64,
    previous_error: f64,
    work: Work,
}

impl StepControl {
    /// Starts with `step` (s).
    pub fn new(tableau: &Tableau, step: f64) -> Self {
        let order = f64::from(tableau.order);
        Self { order, step, previous_error: 1.0, work: Work::default() }
    }

    /// Work so far.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// The step that will be tried next in s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Counts the work of an attempt, see [`Stepper::work`](super::Stepper::work).
    pub fn count_attempt(&mut self, (iterations, factorisations): (usize, usize)) {
        self.work.newton_iterations += iterations;
        self.work.factorisations += factorisations;
    }

    /// The step to take from `time`, not past `last_time`.
    pub fn propose(&self, time: f64, last_time: f64) -> Proposal {
        let remaining = last_time - time;
        let limited = self.step >= remaining;
        // Two equal steps are better than a whole one and a very short one.
        let step = match () {
            () if limited => remaining,
            () if 2.0 * self.step > remaining => remaining / 2.0,
            () => self.step,
        };
        Proposal { step, limited, remaining }
    }

    /// Takes the outcome of an attempt at `proposal` from `time`. Returns true if the step is accepted.
    ///
    /// # Errors
    /// If the next step would be too short to advance the time.
    pub fn judge<R>(
        &mut self,
        time: f64,
        proposal: Proposal,
        outcome: Result<f64, RejectionCause<R>>,
    ) -> Result<bool, IntegrationError<R>> {
        let Proposal { step, limited, remaining } = proposal;
        let cause = match outcome {
            Ok(error) if error <= 1.0 => {
                self.work.steps += 1;
                let proposed = step * self.factor(error);
                // A step cut short by the end is not evidence against a longer one.
                self.step = if limited { self.step.max(proposed) } else { proposed };
                self.previous_error = error.max(1e-4);
                return Ok(true);
            }
            Ok(error) => {
                self.step = step * self.factor(error).min(1.0);
                RejectionCause::Error
            }
            Err(cause) => {
                self.step = step * FAILURE_FACTOR;
                cause
            }
        };
        self.count_failure(&cause);
        self.check_step(time, remaining, cause)?;
        Ok(false)
    }

    /// Discards a step of the length `step` (s) from `time` whose repetition failed. The next step is shorter.
    ///
    /// # Errors
    /// If the next step would be too short to advance the time.
    pub fn retreat<R>(&mut self, time: f64, step: f64, cause: RejectionCause<R>) -> Result<(), IntegrationError<R>> {
        self.count_failure(&cause);
        self.step = FAILURE_FACTOR * step;
        self.check_step(time, step, cause)
    }

    /// Refuses a next step that cannot advance the time.
    fn check_step<R>(&self, time: f64, remaining: f64, cause: RejectionCause<R>) -> Result<(), IntegrationError<R>> {
        let resolution = f64::EPSILON * time.abs().max(MIN_STEP_SHARE * remaining);
        if self.step < MIN_STEP_ROUNDINGS * resolution {
            return Err(IntegrationError::StepTooSmall { time, step: self.step, cause });
        }
        Ok(())
    }

    fn count_failure<R>(&mut self, cause: &RejectionCause<R>) {
        match cause {
            RejectionCause::Error | RejectionCause::Refused(_) => self.work.rejected_steps += 1,
            RejectionCause::Newton | RejectionCause::NotFinite => self.work.newton_failures += 1,
        }
    }

    /// Step factor of a PI controller (Hairer and Wanner II, section IV.2).
    fn factor(&self, error: f64) -> f64 {
        let factor = SAFETY * error.max(1e-10).powf(-0.7 / self.order) * self.previous_error.powf(0.3 / self.order);
        factor.clamp(MIN_FACTOR, MAX_FACTOR)
    }
}

impl<R> From<AttemptError> for RejectionCause<R> {
    fn from(error: AttemptError) -> Self {
        match error {
            AttemptError::Newton => Self::Newton,
            AttemptError::NotFinite => Self::NotFinite,
        }
    }
}
