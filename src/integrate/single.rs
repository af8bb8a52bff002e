//! One system on its own, step by step.

use super::control::StepControl;
use super::stepper::{StageSolution, Stepper};
use super::tableau::Tableau;
use super::{IntegrationError, RejectionCause, SecondOrderSystem, State, Statistics, Tolerances};

/// Advances a system by steps of a [`Tableau`], without events.
///
/// The error of a step is the largest component of the difference to the embedded solution, each measured against
/// `relative × max(scale, |value|)` for a rate and `relative × scale` for an angle, whose origin is arbitrary.
#[derive(Clone, Debug)]
pub struct Integrator<const Q: usize> {
    stepper: Stepper<f64, Q>,
    control: StepControl,
}

impl<const Q: usize> Integrator<Q> {
    /// An integrator for systems of `pairs` pairs of coordinates that starts with `step` (s).
    pub fn new(
        tableau: &'static Tableau,
        solution: StageSolution,
        tolerances: Tolerances,
        pairs: usize,
        step: f64,
    ) -> Self {
        let mut stepper = Stepper::new(tableau, solution, pairs);
        stepper.set_tolerances(0, tolerances);
        Self { stepper, control: StepControl::new(tableau, step) }
    }

    /// Work so far.
    pub fn statistics(&self) -> &Statistics {
        self.control.statistics()
    }

    /// Advances from `start` to `end`, by the step that the error control chooses but not past `last_time`.
    ///
    /// # Errors
    /// If no step is accepted.
    pub fn advance(
        &mut self,
        system: &mut impl SecondOrderSystem<f64, Q>,
        start: &State<Q>,
        end: &mut State<Q>,
        last_time: f64,
    ) -> Result<(), IntegrationError> {
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

    /// Takes one step of the length `step` (s), whatever its error; that error, in tolerances.
    ///
    /// # Errors
    /// If the step gives no state.
    pub fn step(
        &mut self,
        system: &mut impl SecondOrderSystem<f64, Q>,
        start: &State<Q>,
        end: &mut State<Q>,
        step: f64,
    ) -> Result<f64, RejectionCause> {
        system.set_charts(&start.charts);
        self.stepper.set_start(0, start);
        self.stepper.attempt(system, step);
        self.control.count_attempt(self.stepper.work(0));
        end.outcome(0, &self.stepper, system, start, step)
    }
}
