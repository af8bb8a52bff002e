//! Implicit integration of second-order systems with an O(n) linear solve.
//!
//! [`Integrator`] advances `M(q) q̈ = f(q, q̇, t)` by one error-controlled step of an ESDIRK method (see
//! [`tableau`]); each stage is solved for `q̈` by Newton's method with the system's own factorised tangent. Events,
//! and with them changes of the system, lie between steps and are the caller's.

use serde::Serialize;

mod esdirk;
pub mod hermite;
pub mod tableau;

pub use esdirk::{Integrator, State};

use crate::equations::{PolarAxis, StepWeights};

/// A second-order system in pairs of coordinates, with quantities to integrate beside it.
pub trait SecondOrderSystem<const Q: usize> {
    /// Number of coordinate pairs.
    fn pairs(&self) -> usize;

    /// `q̈` at `(t, q, q̇)`.
    fn accelerations(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &mut [[f64; 2]]);

    /// `M q̈ − f` at `(t, q, q̇, q̈)`.
    fn residual(
        &mut self,
        time: f64,
        q: &[[f64; 2]],
        v: &[[f64; 2]],
        accelerations: &[[f64; 2]],
        residual: &mut [[f64; 2]],
    );

    /// Prepares [`SecondOrderSystem::solve`] at the point of the last residual, for steps of the given weights.
    fn factorise(&mut self, time: f64, v: &[[f64; 2]], accelerations: &[[f64; 2]], weights: StepWeights<f64>);

    /// Solves the factorised system in place.
    fn solve(&mut self, right_side: &mut [[f64; 2]]);

    /// Rates of the quantities that are integrated beside the motion.
    fn rates(&mut self, time: f64, q: &[[f64; 2]], v: &[[f64; 2]], accelerations: &[[f64; 2]]) -> [f64; Q];

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

/// Work done by an integration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: usize,
    /// Steps repeated because the error estimate was too large, or the step met a pole of a segment's coordinates.
    pub rejected_steps: usize,
    /// Newton iterations, each one residual and one linear solve.
    pub newton_iterations: usize,
    /// Steps repeated because Newton's method did not converge, or met values that are not finite.
    pub newton_failures: usize,
    /// Factorisations of the step matrix.
    pub factorisations: usize,
    /// Located openings and closings of the contact.
    pub contact_events: usize,
    /// Segments turned over to their other chart. Not written to files: it tells of the coordinates, not of the work.
    #[serde(skip)]
    pub chart_changes: usize,
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
