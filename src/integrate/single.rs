//! One system on its own, step by step.

use super::control::StepControl;
use super::stepper::{StageSolution, Stepper};
use super::tableau::Tableau;
use super::{IntegrationError, RejectionCause, SecondOrderSystem, State, Tolerances, Work};

/// Advances a system by steps of a [`Tableau`], without events.
///
/// The error of a step is the largest component of the difference to the embedded solution, each
/// measured against `relative × max(scale, |value|)` for a rate and `relative × scale` for a
/// coordinate, whose origin is arbitrary.
#[derive(Clone, Debug)]
pub struct Integrator<const D: usize, const Q: usize> {
    stepper: Stepper<f64, D, Q>,
    control: StepControl,
}

impl<const D: usize, const Q: usize> Integrator<D, Q> {
    /// An integrator for systems of `blocks` blocks of coordinates. Its first step is `step` (s).
    pub fn new(
        tableau: &'static Tableau,
        solution: StageSolution,
        tolerances: Tolerances,
        blocks: usize,
        step: f64,
    ) -> Self {
        let mut stepper = Stepper::new(tableau, solution, blocks);
        stepper.set_tolerances(0, tolerances);
        Self {
            stepper,
            control: StepControl::new(tableau, step),
        }
    }

    /// Work so far.
    pub fn work(&self) -> &Work {
        self.control.work()
    }

    /// Advances from `start` to `end` by the step that the error control chooses, but not past
    /// `last_time`.
    ///
    /// # Errors
    /// If no step is accepted.
    pub fn advance<S: SecondOrderSystem<f64, D, Q>>(
        &mut self,
        system: &mut S,
        start: &State<S::Charts, D, Q>,
        end: &mut State<S::Charts, D, Q>,
        last_time: f64,
    ) -> Result<(), IntegrationError<S::Refusal>> {
        start.check(system)?;
        loop {
            let proposal = self.control.propose(start.time, last_time);
            let outcome = self.step(system, start, end, proposal.step);
            if proposal.limited {
                end.time = last_time;
            }
            if self.control.judge(start.time, proposal, outcome)? {
                return Ok(());
            }
        }
    }

    /// Takes one step of the length `step` (s), regardless of its error. Returns that error, in
    /// tolerances.
    ///
    /// # Errors
    /// If the step gives no state, or one that the system refuses.
    pub fn step<S: SecondOrderSystem<f64, D, Q>>(
        &mut self,
        system: &mut S,
        start: &State<S::Charts, D, Q>,
        end: &mut State<S::Charts, D, Q>,
        step: f64,
    ) -> Result<f64, RejectionCause<S::Refusal>> {
        system.set_charts(&start.charts);
        self.stepper.set_start(0, start);
        self.stepper.attempt(system, step);
        self.control.count_attempt(self.stepper.work(0));
        end.outcome(0, &self.stepper, system, start, step)
    }
}
