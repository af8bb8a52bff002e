//! Implicit integration of systems of second order with an O(n) linear solve.
//!
//! [`Stepper`] attempts steps of an ESDIRK method (see [`tableau`]) for `M(q) q̈ = f(q, q̇, t)`, of
//! one system or of several side by side; each stage is solved for `q̈` with the system's own
//! factorised tangent. [`StepControl`] chooses the steps of one integration.
//!
//! Coordinates come in blocks of `D`, as in the elimination of a chain. A state can also record the
//! chart of its coordinates; only the system knows their meaning. Events, and with them changes of
//! the system, lie between steps. The caller handles them.

use std::error::Error;
use std::fmt;

mod control;
pub mod hermite;
mod newton;
mod stage_loops;
mod stepper;
pub mod tableau;

pub use control::{Pace, Proposal, StepChange, StepControl, WorkBudget};
pub use newton::StageSolution;
pub use stepper::{AttemptError, Stepper};

use crate::equations::{LaneSet, Lanewise, StepWeights};

/// Relative tolerance of a linear variation, unless the motion's tolerance is looser
/// ([`SecondOrderSystem::carries_variation`]).
pub const VARIATION_TOLERANCE: f64 = 1e-3;

/// Size above which errors of a linear variation are no longer controlled, because its exact size
/// means nothing.
pub const LARGEST_CONTROLLED_VARIATION: f64 = 1e30;

/// `(t, q, q̇, q̈)`, in one lane or in several.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a, T, const D: usize> {
    /// Time in s.
    pub time: T,
    /// Coordinates.
    pub q: &'a [[T; D]],
    /// Their rates, per second.
    pub v: &'a [[T; D]],
    /// Their accelerations, per second squared.
    pub accelerations: &'a [[T; D]],
}

/// A system of second order in blocks of `D` coordinates, with `Q` quantities to integrate along
/// its motion; or one system per lane of `T`.
pub trait SecondOrderSystem<T, const D: usize, const Q: usize> {
    /// Chart that gives a state's coordinates their meaning; `()` if there is only one.
    type Chart: Copy + Default;

    /// Reason why a step cannot start or end at a state; [`Infallible`](std::convert::Infallible)
    /// if there is none.
    type Refusal;

    /// Returns the number of blocks.
    fn blocks(&self) -> usize;

    /// Computes `q̈` at `(t, q, q̇)`.
    fn accelerations(&mut self, time: T, q: &[[T; D]], v: &[[T; D]], accelerations: &mut [[T; D]]);

    /// Computes `M q̈ − f` at a point.
    fn residual(&mut self, at: &Point<'_, T, D>, residual: &mut [[T; D]]);

    /// Prepares [`SecondOrderSystem::solve`] in `lanes` at the point of the last residual, for
    /// steps of the given weights. The other lanes keep their factorisation.
    fn factorise(&mut self, at: &Point<'_, T, D>, weights: StepWeights<T>, lanes: LaneSet);

    /// Solves the factorised system in place.
    fn solve(&mut self, right_side: &mut [[T; D]]);

    /// Computes Newton's correction at a point: [`SecondOrderSystem::residual`], then
    /// [`SecondOrderSystem::solve`].
    fn correction(&mut self, at: &Point<'_, T, D>, correction: &mut [[T; D]]) {
        self.residual(at, correction);
        self.solve(correction);
    }

    /// Returns the rates of the integrated quantities at a point. A step may start or end there:
    /// the caller may next query the system at that point.
    fn rates(&mut self, at: &Point<'_, T, D>) -> [T; Q];

    /// Returns these rates at a stage inside a step. `correction` with `weights` has moved the
    /// stage from the point of the last residual. First order in it suffices, because the stage
    /// itself is solved to first order.
    fn stage_rates(
        &mut self,
        at: &Point<'_, T, D>,
        correction: &[[T; D]],
        weights: StepWeights<T>,
    ) -> [T; Q] {
        let _ = (correction, weights);
        self.rates(at)
    }

    /// Returns `true` if the first coordinate of every block is a linear variation along the motion
    /// of the others.
    ///
    /// Its size means nothing, because its equations are linear: errors are relative to its largest
    /// entry. It need not be more accurate than [`VARIATION_TOLERANCE`], nor accurate at all above
    /// [`LARGEST_CONTROLLED_VARIATION`].
    fn carries_variation(&self) -> bool {
        false
    }

    /// Returns the integrals whose errors are controlled, by index, each with the index of its
    /// scale in [`Tolerances::integral_scales`]. Errors of coordinates and rates miss a force that
    /// does not change the motion, such as one along a rigid segment.
    fn controlled_integrals(&self) -> &'static [[usize; 2]] {
        &[]
    }

    /// Solves the factorised equations of the variation for its part of `correction`. Their right
    /// side belongs to the point of the last residual less the motion's part of `correction`.
    fn solve_variation(
        &mut self,
        at: &Point<'_, T, D>,
        weights: StepWeights<T>,
        correction: &mut [[T; D]],
    ) {
        let _ = (at, weights, correction);
    }

    /// Returns the chart in which the system takes coordinates.
    fn chart(&self) -> Self::Chart {
        Self::Chart::default()
    }

    /// Takes coordinates in `chart` from now on.
    fn set_chart(&mut self, chart: Self::Chart) {
        let _ = chart;
    }

    /// Returns the reason why no step can start or end at the coordinates `q`, if there is one.
    fn refuse(&self, q: &[[f64; D]]) -> Option<Self::Refusal> {
        let _ = q;
        None
    }
}

/// A point of a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct State<C, const D: usize, const Q: usize> {
    /// Time in s.
    pub time: f64,
    /// The chart of the coordinates.
    pub chart: C,
    /// Coordinates.
    pub q: Vec<[f64; D]>,
    /// Their rates, per second.
    pub v: Vec<[f64; D]>,
    /// Their accelerations, per second squared.
    pub accelerations: Vec<[f64; D]>,
    /// Quantities integrated along the motion.
    pub integrals: [f64; Q],
    /// Their rates.
    pub rates: [f64; Q],
}

impl<C: Copy + Default, const D: usize, const Q: usize> State<C, D, Q> {
    /// Creates the state `(q, v)` at `time`, with the chart, accelerations and rates of `system`.
    pub fn new(
        system: &mut impl SecondOrderSystem<f64, D, Q, Chart = C>,
        time: f64,
        q: Vec<[f64; D]>,
        v: Vec<[f64; D]>,
    ) -> Self {
        let mut accelerations = vec![[0.0; D]; q.len()];
        system.accelerations(time, &q, &v, &mut accelerations);
        let rates = system.rates(&Point {
            time,
            q: &q,
            v: &v,
            accelerations: &accelerations,
        });
        Self {
            time,
            chart: system.chart(),
            q,
            v,
            accelerations,
            integrals: [0.0; Q],
            rates,
        }
    }

    /// Refuses a state from which no step can start.
    ///
    /// # Errors
    /// If the system refuses it, or its accelerations are not finite.
    pub fn check<T, S: SecondOrderSystem<T, D, Q, Chart = C>>(
        &self,
        system: &S,
    ) -> Result<(), StepControlError<S::Refusal>> {
        if let Some(reason) = system.refuse(&self.q) {
            return Err(StepControlError::Refused {
                time: self.time,
                reason,
            });
        }
        if !self
            .accelerations
            .as_flattened()
            .iter()
            .all(|value| value.is_finite())
        {
            return Err(StepControlError::NotFinite { time: self.time });
        }
        Ok(())
    }

    /// Becomes the state that the last attempt of `stepper` reached from `start` in `lane`, with
    /// the step `step` (s). Returns the embedded error estimate, in tolerances.
    ///
    /// # Errors
    /// If the attempt gave no state, or one that the system refuses.
    pub fn outcome<T: Lanewise, S: SecondOrderSystem<T, D, Q, Chart = C>>(
        &mut self,
        lane: usize,
        stepper: &Stepper<T, D, Q>,
        system: &S,
        start: &Self,
        step: f64,
    ) -> Result<f64, RejectionCause<S::Refusal>> {
        self.time = start.time + step;
        self.chart = start.chart;
        let outcome = stepper.outcome(lane, self);
        match system.refuse(&self.q) {
            Some(reason) => Err(RejectionCause::Refused(reason)),
            None => outcome.map_err(RejectionCause::from),
        }
    }
}

/// Work done by an integration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted steps.
    pub steps: usize,
    /// Accepted steps whose error is above the tolerance, because the integration had spent its
    /// [`WorkBudget`].
    pub unresolved_steps: usize,
    /// Rejected steps: the error estimate was too large, or the system refused the final state.
    pub rejected_steps: usize,
    /// Newton iterations, each one residual and one linear solve.
    pub newton_iterations: usize,
    /// Steps repeated because Newton's method did not converge, or met values that are not finite.
    pub newton_failures: usize,
    /// Factorisations of the step matrix.
    pub factorisations: usize,
}

/// Scales against which errors in the solution are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Relative tolerance.
    pub relative: f64,
    /// Size below which a coordinate is not resolved relatively.
    pub coordinate_scale: f64,
    /// Size per second below which a rate is not resolved relatively.
    pub rate_scale: f64,
    /// Sizes against which errors of [`SecondOrderSystem::controlled_integrals`] are measured.
    pub integral_scales: [f64; 2],
}

impl Tolerances {
    /// Returns the tolerances of a motion without controlled integrals.
    #[must_use]
    pub fn of_motion(relative: f64, coordinate_scale: f64, rate_scale: f64) -> Self {
        Self {
            relative,
            coordinate_scale,
            rate_scale,
            integral_scales: [f64::INFINITY; 2],
        }
    }
}

/// Reason why a step was rejected; `R` is the system's reason to refuse a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RejectionCause<R> {
    /// The error estimate exceeds the tolerance.
    Error,
    /// Newton's method does not converge.
    Newton,
    /// The residual is infinite or not a number.
    NotFinite,
    /// The system refuses the state at which the step ends.
    Refused(R),
}

impl<R: fmt::Display> fmt::Display for RejectionCause<R> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error => formatter.write_str("the error estimate stays above the tolerance"),
            Self::Newton => formatter.write_str("Newton's method does not converge"),
            Self::NotFinite => formatter.write_str("the equations are not finite"),
            Self::Refused(reason) => reason.fmt(formatter),
        }
    }
}

/// Reason why an integration cannot continue; `R` is the system's reason to refuse a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepControlError<R> {
    /// The step became too small to advance the time.
    StepTooSmall {
        /// Time in s.
        time: f64,
        /// Step in s.
        step: f64,
        /// Reason why the step was rejected.
        cause: RejectionCause<R>,
    },
    /// The state at the start of a step has no finite accelerations.
    NotFinite {
        /// Time in s.
        time: f64,
    },
    /// The system refuses the state at the start of a step.
    Refused {
        /// Time in s.
        time: f64,
        /// Reason of the system.
        reason: R,
    },
}

impl<R: fmt::Display> fmt::Display for StepControlError<R> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StepTooSmall { time, step, cause } => {
                write!(
                    formatter,
                    "no step is accepted at t = {time:.9e} s, down to {step:.3e} s: {cause}"
                )
            }
            Self::NotFinite { time } => write!(
                formatter,
                "the accelerations at t = {time:.9e} s are not finite"
            ),
            Self::Refused { time, reason } => {
                write!(formatter, "no step can start at t = {time:.9e} s: {reason}")
            }
        }
    }
}

impl<R: fmt::Debug + fmt::Display> Error for StepControlError<R> {}
