//! Step-size control by the error estimate, and the work done.

use super::stepper::AttemptError;
use super::tableau::Tableau;
use super::{RejectionCause, StepControlError, Work};

/// Limit on the decrease of the step, and the margin below the step that would just be accepted.
const MIN_FACTOR: f64 = 0.2;
const SAFETY: f64 = 0.9;
/// Shortest step that advances the time, in roundings of the time.
const MIN_STEP_ROUNDINGS: f64 = 8.0;
/// Share of the remaining time that replaces the time near zero, where roundings vanish.
const MIN_STEP_SHARE: f64 = 1e-3;

/// Limits on the change of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepChange {
    /// Largest growth from step to step.
    pub growth: f64,
    /// Largest growth after a rejected step, over the first accepted one.
    pub growth_after_rejection: f64,
    /// Factor on a step whose stages could not be solved.
    pub failure: f64,
    /// Largest growth after such a failure.
    pub growth_after_failure: f64,
    /// Number of accepted steps with this limit.
    pub steps_after_failure: u32,
}

impl StepChange {
    /// Limits for a single filament, whose contacts begin and end at the ends of steps.
    const OF_PASS: Self = Self {
        growth: 5.0,
        growth_after_rejection: 5.0,
        failure: 0.3,
        growth_after_failure: 5.0,
        steps_after_failure: 0,
    };
}

/// State of the step-size control between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pace {
    /// Step to try next in s.
    pub step: f64,
    /// Error of the last accepted step, in tolerances.
    pub previous_error: f64,
    /// Largest growth of the next accepted steps, and their number.
    pub cautious: (f64, u32),
}

/// Next step to attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// Length in s.
    pub step: f64,
    /// `true` if the step reaches the end: take the end time itself, not a sum.
    pub limited: bool,
    /// Time left at the start of the step, in s.
    pub remaining: f64,
}

/// Work that an integration may spend to keep its tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkBudget {
    /// Newton iterations.
    pub iterations: usize,
    /// Duration of the integration in s.
    pub duration: f64,
}

/// Share of the effort that is free at the start, when a filament meets the workpiece.
const FREE_SHARE: f64 = 0.2;
/// Power of the work over its share with which the floor rises. It is steep: the floor stays far
/// below any step while the work is a fraction of its share.
const FLOOR_POWER: i32 = 4;
/// Ratio of the work to its share above which the floor rises no further: Newton's method would
/// fail at longer steps.
const HIGHEST_OVERDRAFT: f64 = 1.5;
/// Factor above the slowly changing floor up to which a step counts as one at the floor.
const FLOOR_MARGIN: f64 = 1.25;

/// Largest growth towards the floor of a step that misses the tolerance: at the floor itself
/// Newton's method may have failed.
const FLOOR_GROWTH: f64 = 2.0;

/// Work, over its limit, at which an integration has failed: its steps are abandoned, however long
/// they may be.
const EXHAUSTION: f64 = 3.5;

/// Chooses the steps of one integration.
#[derive(Clone, Debug)]
pub struct StepControl {
    order: f64,
    pace: Pace,
    /// Longest and shortest step in s.
    longest: f64,
    shortest: f64,
    change: StepChange,
    allowed_error: f64,
    effort: Option<WorkBudget>,
    work: Work,
    /// Work before the effort began to count.
    earlier: Work,
}

impl StepControl {
    /// Starts with `step` (s).
    pub fn new(tableau: &Tableau, step: f64) -> Self {
        let order = f64::from(tableau.order);
        Self {
            order,
            pace: Pace {
                step,
                previous_error: 1.0,
                cautious: (1.0, 0),
            },
            longest: f64::INFINITY,
            shortest: 0.0,
            change: StepChange::OF_PASS,
            allowed_error: 1.0,
            effort: None,
            work: Work::default(),
            earlier: Work::default(),
        }
    }

    /// Limits the work to about `effort`: steps shorter than a floor are accepted whatever their
    /// error.
    ///
    /// The floor vanishes while the work is far below its share. It rises to the step with which
    /// the effort lasts to the end. The methods are L-stable: they damp vibrations that are too
    /// fast for the floor, and follow slower ones as before.
    #[must_use]
    pub fn within(self, effort: WorkBudget) -> Self {
        Self {
            effort: Some(effort),
            ..self
        }
    }

    /// Limits steps to `longest` (s).
    #[must_use]
    pub fn up_to(self, longest: f64) -> Self {
        Self { longest, ..self }
    }

    /// Accepts steps of `shortest` (s) whatever their error, and tries none that are shorter.
    #[must_use]
    pub fn down_to(self, shortest: f64) -> Self {
        Self { shortest, ..self }
    }

    /// Limits how fast steps change.
    #[must_use]
    pub fn changing_by(self, change: StepChange) -> Self {
        Self { change, ..self }
    }

    /// Returns the state between two steps.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// Continues from a state. Returns `false` if this control cannot have it.
    pub fn restore(&mut self, pace: Pace) -> bool {
        let Pace {
            step,
            previous_error,
            cautious: (growth, _),
        } = pace;
        let fits = step >= self.shortest
            && step.is_finite()
            && previous_error > 0.0
            && previous_error <= 1.0
            && growth >= 1.0
            && growth <= self.change.growth;
        if fits {
            self.pace = pace;
        }
        fits
    }

    /// Limits the work from here on to about `effort`, whatever was spent before; see
    /// [`StepControl::within`].
    pub fn renew(&mut self, effort: WorkBudget) {
        self.effort = Some(effort);
        self.earlier = self.work;
    }

    /// Returns the Newton iterations since the effort began to count.
    fn iterations(&self) -> usize {
        self.work.newton_iterations - self.earlier.newton_iterations
    }

    /// Returns the length in s of a step that is accepted whatever its error.
    fn floor(&self, remaining: f64) -> f64 {
        let steps = self.work.steps - self.earlier.steps;
        let (
            Some(WorkBudget {
                iterations,
                duration,
            }),
            1..,
        ) = (self.effort, steps)
        else {
            return self.shortest;
        };
        let spent = self.iterations() as f64 / iterations as f64;
        let share = FREE_SHARE + (1.0 - FREE_SHARE) * (1.0 - remaining / duration);
        duration * spent / steps as f64 * (spent / share).min(HIGHEST_OVERDRAFT).powi(FLOOR_POWER)
    }

    /// Returns the error, in tolerances, with which the next step is expected to be accepted: 1, or
    /// more where work is limited.
    pub fn allowed_error(&self) -> f64 {
        self.allowed_error
    }

    /// Returns the work so far.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// Returns the step to try next in s.
    pub fn step(&self) -> f64 {
        self.pace.step
    }

    /// Counts the work of an attempt, see [`Stepper::work`](super::Stepper::work).
    pub fn count_attempt(&mut self, (iterations, factorisations): (usize, usize)) {
        self.work.newton_iterations += iterations;
        self.work.factorisations += factorisations;
    }

    /// Returns the step to take from `time`, not past `last_time`.
    pub fn propose(&self, time: f64, last_time: f64) -> Proposal {
        let (remaining, step) = (last_time - time, self.pace.step.min(self.longest));
        let limited = step >= remaining;
        // Two equal steps are better than a whole one and a very short one.
        let step = match () {
            () if limited => remaining,
            () if 2.0 * step > remaining => remaining / 2.0,
            () => step,
        };
        Proposal {
            step,
            limited,
            remaining,
        }
    }

    /// Returns `true` if the work allows no shorter step than `step` (s), with `remaining` (s) left
    /// at its start. Such a step need not meet the tolerance ([`StepControl::within`]).
    pub fn is_at_floor(&self, step: f64, remaining: f64) -> bool {
        step <= FLOOR_MARGIN * self.floor(remaining)
    }

    /// Returns `true` if the work exceeds its limit so far that longer steps cannot help.
    pub fn is_exhausted(&self) -> bool {
        self.effort
            .is_some_and(|effort| self.iterations() as f64 > EXHAUSTION * effort.iterations as f64)
    }

    /// Takes the outcome of an attempt at `proposal` from `time`. Returns `true` if the step is
    /// accepted.
    ///
    /// # Errors
    /// If the next step would be too short to advance the time.
    pub fn judge<R>(
        &mut self,
        time: f64,
        proposal: Proposal,
        outcome: Result<f64, RejectionCause<R>>,
    ) -> Result<bool, StepControlError<R>> {
        let Proposal {
            step,
            limited,
            remaining,
        } = proposal;
        let (floor, short) = (self.floor(remaining), self.is_at_floor(step, remaining));
        let cause = match outcome {
            Ok(error) if error <= 1.0 || short => {
                self.work.steps += 1;
                self.work.unresolved_steps += usize::from(error > 1.0);
                let growth = match &mut self.pace.cautious {
                    (_, 0) => self.change.growth,
                    (growth, left) => {
                        *left -= 1;
                        *growth
                    }
                };
                let proposed =
                    (step * self.factor(error).min(growth)).max(floor.min(FLOOR_GROWTH * step));
                // A step cut short by the end is not evidence against a longer one.
                self.pace.step = if limited {
                    self.pace.step.max(proposed)
                } else {
                    proposed
                };
                self.pace.previous_error = error.clamp(1e-4, 1.0);
                self.allowed_error = error.max(1.0);
                return Ok(true);
            }
            Ok(error) => {
                self.pace.step = (step * self.factor(error).min(1.0)).max(floor);
                self.pace.cautious = (self.change.growth_after_rejection, 1);
                RejectionCause::Error
            }
            Err(cause) => {
                self.pace.step = step * self.change.failure;
                self.pace.cautious = (
                    self.change.growth_after_failure,
                    self.change.steps_after_failure,
                );
                cause
            }
        };
        self.count_failure(&cause);
        self.check_step(time, remaining, cause)?;
        Ok(false)
    }

    /// Discards a step of the length `step` (s) from `time` whose repetition failed. The next step
    /// is shorter.
    ///
    /// # Errors
    /// If the next step would be too short to advance the time.
    pub fn retreat<R>(
        &mut self,
        time: f64,
        step: f64,
        cause: RejectionCause<R>,
    ) -> Result<(), StepControlError<R>> {
        self.count_failure(&cause);
        self.pace.step = self.change.failure * step;
        self.check_step(time, step, cause)
    }

    /// Refuses a next step that cannot advance the time.
    fn check_step<R>(
        &self,
        time: f64,
        remaining: f64,
        cause: RejectionCause<R>,
    ) -> Result<(), StepControlError<R>> {
        let resolution = f64::EPSILON * time.abs().max(MIN_STEP_SHARE * remaining);
        if self.pace.step < (MIN_STEP_ROUNDINGS * resolution).max(self.shortest) {
            return Err(StepControlError::StepTooSmall {
                time,
                step: self.pace.step,
                cause,
            });
        }
        Ok(())
    }

    fn count_failure<R>(&mut self, cause: &RejectionCause<R>) {
        match cause {
            RejectionCause::Error | RejectionCause::Refused(_) => self.work.rejected_steps += 1,
            RejectionCause::Newton | RejectionCause::NotFinite => self.work.newton_failures += 1,
        }
    }

    /// Returns the step factor of a PI controller (Hairer and Wanner II, section IV.2).
    fn factor(&self, error: f64) -> f64 {
        let factor = SAFETY
            * error.max(1e-10).powf(-0.7 / self.order)
            * self.pace.previous_error.powf(0.3 / self.order);
        factor.clamp(MIN_FACTOR, self.change.growth)
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
