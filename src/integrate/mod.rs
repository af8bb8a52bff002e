//! Implicit integration of second-order systems with an O(n) linear solve.
//!
//! [`Stepper`] attempts steps of an ESDIRK method (see [`tableau`]) for `M(q) q̈ = f(q, q̇, t)`, of one system or of
//! several side by side; each stage is solved for `q̈` with the system's own factorised tangent. [`StepControl`] chooses
//! the steps of one integration, and [`Integrator`] joins the two. Events, and with them changes of the system, lie
//! between steps and are the caller's.

mod control;
pub mod hermite;
mod single;
mod stepper;
pub mod tableau;

pub use control::{Proposal, StepControl};
pub use single::Integrator;
pub use stepper::{AttemptError, StageSolution, Stepper};

use crate::equations::{LaneSet, Lanewise, PolarAxis, StepWeights, near_pole};

/// A second-order system in pairs of coordinates, with quantities to integrate beside it; or one a lane of `T`.
pub trait SecondOrderSystem<T, const Q: usize> {
    /// Number of coordinate pairs.
    fn pairs(&self) -> usize;

    /// `q̈` at `(t, q, q̇)`.
    fn accelerations(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &mut [[T; 2]]);

    /// `M q̈ − f` at `(t, q, q̇, q̈)`.
    fn residual(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]], residual: &mut [[T; 2]]);

    /// Prepares [`SecondOrderSystem::solve`] at the point of the last residual, for steps of the given weights; in
    /// `lanes`, the others keep what they have.
    fn factorise(&mut self, time: T, v: &[[T; 2]], accelerations: &[[T; 2]], weights: StepWeights<T>, lanes: LaneSet);

    /// Solves the factorised system in place.
    fn solve(&mut self, right_side: &mut [[T; 2]]);

    /// Rates of the quantities that are integrated beside the motion, at `(t, q, q̇, q̈)`. A step may start or end there:
    /// what the system has to say of that point is asked for next.
    fn rates(&mut self, time: T, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) -> [T; Q];

    /// The same at a stage inside a step, which `correction`, by `weights`, has moved from the point of the last
    /// residual. To first order in that is enough, as the stage itself is solved to.
    fn stage_rates(
        &mut self,
        time: T,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        correction: &[[T; 2]],
        weights: StepWeights<T>,
    ) -> [T; Q] {
        let _ = (correction, weights);
        self.rates(time, q, v, accelerations)
    }

    /// The charts that the coordinates are in; none if the system has one chart only.
    fn charts(&self) -> &[PolarAxis] {
        &[]
    }

    /// Takes coordinates in `charts` from now on: as many as [`SecondOrderSystem::charts`] gives.
    fn set_charts(&mut self, charts: &[PolarAxis]) {
        let _ = charts;
    }

    /// The index of a pair whose coordinates are singular at `q`. A step does not start or end there.
    fn pole(&self, q: &[[f64; 2]]) -> Option<usize> {
        let _ = q;
        None
    }
}

/// A point of a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct State<const Q: usize> {
    /// Time in s.
    pub time: f64,
    /// The charts that the coordinates are in; none if the system has one chart only.
    pub charts: Vec<PolarAxis>,
    /// Coordinates in rad.
    pub q: Vec<[f64; 2]>,
    /// Rates in rad/s.
    pub v: Vec<[f64; 2]>,
    /// Accelerations in rad/s².
    pub accelerations: Vec<[f64; 2]>,
    /// Quantities integrated beside the motion.
    pub integrals: [f64; Q],
    /// Their rates.
    pub rates: [f64; Q],
}

impl<const Q: usize> State<Q> {
    /// The state `(q, v)` at `time`, in the charts of `system`, with the accelerations and rates that it gives there.
    pub fn new(system: &mut impl SecondOrderSystem<f64, Q>, time: f64, q: Vec<[f64; 2]>, v: Vec<[f64; 2]>) -> Self {
        let mut accelerations = vec![[0.0; 2]; q.len()];
        system.accelerations(time, &q, &v, &mut accelerations);
        let rates = system.rates(time, &q, &v, &accelerations);
        let charts = system.charts().to_vec();
        Self { time, charts, q, v, accelerations, integrals: [0.0; Q], rates }
    }

    /// Refuses a state from which no step can start.
    ///
    /// # Errors
    /// If it stands at a pole, or its accelerations are not finite.
    pub fn check<T>(&self, system: &impl SecondOrderSystem<T, Q>) -> Result<(), IntegrationError> {
        if let Some(pair) = system.pole(&self.q) {
            return Err(IntegrationError::Pole { segment: pair + 1, time: self.time });
        }
        if !self.accelerations.as_flattened().iter().all(|value| value.is_finite()) {
            return Err(IntegrationError::NotFinite { time: self.time });
        }
        Ok(())
    }

    /// Becomes what the last attempt of `stepper` made of `start` in `lane`, with the step `step` (s); the estimated
    /// error, in tolerances.
    ///
    /// # Errors
    /// If the attempt gave no state, or one at a pole.
    pub fn outcome<T: Lanewise>(
        &mut self,
        lane: usize,
        stepper: &Stepper<T, Q>,
        system: &impl SecondOrderSystem<T, Q>,
        start: &Self,
        step: f64,
    ) -> Result<f64, RejectionCause> {
        self.time = start.time + step;
        self.charts.copy_from_slice(&start.charts);
        let outcome = stepper.outcome(lane, self);
        match system.pole(&self.q) {
            Some(pair) => Err(RejectionCause::Pole { segment: pair + 1 }),
            None => outcome.map_err(RejectionCause::from),
        }
    }

    /// Converts coordinates, rates and accelerations of `segment` (by index) to those about `axis`.
    ///
    /// The same motion to rounding, which grows as `1/sin² φ` where `axis` is near the segment's direction.
    ///
    /// # Panics
    /// If there is no such segment, or the system has one chart only.
    pub fn change_chart(&mut self, segment: usize, axis: PolarAxis) {
        if self.charts[segment] == axis {
            return;
        }
        let motion = [self.q[segment], self.v[segment], self.accelerations[segment]];
        [self.q[segment], self.v[segment], self.accelerations[segment]] =
            axis.coordinates(self.charts[segment].direction(motion));
        self.charts[segment] = axis;
    }

    /// Turns the segments that are near a pole of their coordinates over to their other chart; how many.
    ///
    /// For between steps. A segment that has just changed is far from the poles of its new chart.
    pub fn leave_poles(&mut self) -> usize {
        let mut changes = 0;
        for segment in 0..self.charts.len() {
            if near_pole(self.q[segment][0]) {
                self.change_chart(segment, self.charts[segment].other());
                changes += 1;
            }
        }
        changes
    }
}

crate::record! {
    /// Work done by an integration.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub struct Statistics {
        steps: usize = ["", "", "accepted steps", ""],
        rejected_steps: usize = [
            "", "", "rejected steps",
            "repeated because the error estimate was too large, or the step met a pole of a segment's coordinates"
        ],
        newton_iterations: usize =
            ["", "", "Newton iterations", "each one residual and one linear solve"],
        newton_failures: usize = [
            "", "", "steps without convergence",
            "repeated because Newton's method did not converge, or met values that are not finite"
        ],
        factorisations: usize = ["", "", "factorisations", "of the step matrix"],
        contact_events: usize = ["", "", "contact events located", "openings and closings"],
    }
    with {
        /// Segments turned over to their other chart. Not written to files: it tells of the coordinates, not of the work.
        #[cfg_attr(feature = "serde", serde(skip))]
        pub chart_changes: usize,
    }
}

/// What an error in the solution is measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Relative tolerance.
    pub relative: f64,
    /// Size in rad below which an angle is not resolved relatively.
    pub angle_scale: f64,
    /// Size in rad/s below which a rate is not resolved relatively.
    pub rate_scale: f64,
}

/// Why an integration cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IntegrationError {
    /// The step became too small to advance the time.
    #[error(
        "no step is accepted at t = {time:.9e} s, down to {step:.3e} s: {cause}; try a softer contact, more damping, or another relative tolerance"
    )]
    StepTooSmall {
        /// Time in s.
        time: f64,
        /// Step in s.
        step: f64,
        /// What kept the step from being accepted.
        cause: RejectionCause,
    },
    /// More steps than any sensible case takes.
    #[error(
        "{steps} steps reached only t = {time:.9e} s, with steps of {step:.3e} s at last; try more damping, a larger friction regularisation, or a looser relative tolerance"
    )]
    TooManySteps {
        /// Steps taken.
        steps: usize,
        /// Time in s.
        time: f64,
        /// Step in s.
        step: f64,
    },
    /// The state at the start of a step has no finite accelerations.
    #[error(
        "the accelerations at t = {time:.9e} s are not finite: a setting of extreme size, or a joint folded back on itself"
    )]
    NotFinite {
        /// Time in s.
        time: f64,
    },
    /// A segment stands at a pole of its coordinates at the start of a step.
    #[error(
        "segment {segment} stands at a pole of its coordinates at t = {time:.9e} s, where its azimuth has no meaning"
    )]
    Pole {
        /// Number of the segment, counted from 1.
        segment: usize,
        /// Time in s.
        time: f64,
    },
}

/// Why a step was not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RejectionCause {
    /// The error estimate exceeds the tolerance.
    Error,
    /// Newton's method does not converge.
    Newton,
    /// The residual is infinite or not a number.
    NotFinite,
    /// The step meets a pole of the coordinates of a segment.
    Pole {
        /// Number of the segment, counted from 1.
        segment: usize,
    },
}

impl std::fmt::Display for RejectionCause {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Error => "the error estimate stays above the tolerance",
            Self::Newton => "Newton's method does not converge",
            Self::NotFinite => {
                "the equations are not finite, for a setting of extreme size, or a joint folded back on itself"
            }
            Self::Pole { segment } => {
                return write!(formatter, "segment {segment} meets a pole of its coordinates");
            }
        })
    }
}
