//! Convergence test of Newton's method for the equations of a stage.

/// Error at which Newton's method stops, over the error allowed for a step.
pub(super) const NEWTON_TOLERANCE: f64 = 0.02;
/// Largest error at which Newton's method stops where a step may miss the tolerance, relative to
/// the scales of the tolerances.
pub(super) const LOOSEST_NEWTON_TOLERANCE: f64 = 1e-5;
/// Size of a first correction, in tolerances, below which Newton's method stops, unless stages are
/// [`StageSolution::Converged`].
///
/// Measured on contacts (docs/methods.md): a smaller limit costs work and gains no accuracy,
/// because the error estimate includes the unsolved part of a stage.
const TRUSTED_CORRECTION: f64 = 1000.0;
/// Relative tolerance below which the trusted correction falls with the tolerance; otherwise the
/// unsolved part would be the largest error. With [`StageSolution::Cautious`] it also falls above,
/// with the square: in such long steps a point may stick in one stage and slide in the next, which
/// one iteration misses.
const TRUSTED_TOLERANCE: f64 = 1e-6;
/// Share of the corrected value above which a first correction that is not trusted fails a step of
/// [`StageSolution::Predicted`]: it is too long for the prediction and would be rejected later.
/// Between the two, at tight tolerances, Newton's method continues.
const HOPEFUL_CORRECTION: f64 = 0.1;
pub(super) const MAX_NEWTON_ITERATIONS: usize = 8;
/// Ratio of successive corrections above which the matrix is computed again, or the step fails.
const MAX_CONTRACTION: f64 = 0.5;
/// Smallest factor by which the estimated contraction falls at a time, as in CVODE. With a new
/// matrix one ratio of corrections can be near zero, although the stages that share the matrix
/// converge much more slowly.
const SLOWEST_DECLINE: f64 = 0.3;

/// Use of Newton's method for the equations of a stage (docs/methods.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StageSolution {
    /// One iteration from an extrapolation of earlier stages. For smooth systems, where more
    /// iterations gain nothing.
    Predicted,
    /// One iteration from an extrapolation if its correction is small; otherwise more follow, to a
    /// small part of the tolerance. For equations as sharp as those of dry friction, in systems
    /// with damping.
    Cautious,
    /// Iterations from `q̈` of the previous stage, to a small part of the tolerance. For systems
    /// that must not gain energy.
    Converged,
}

impl StageSolution {
    /// Returns the size of a first correction, in tolerances, below which no other follows.
    fn trusted_correction(self, relative: f64) -> f64 {
        let tolerance = relative / TRUSTED_TOLERANCE;
        match self {
            Self::Predicted => TRUSTED_CORRECTION * tolerance.min(1.0),
            Self::Cautious => TRUSTED_CORRECTION * tolerance.min(1.0 / (tolerance * tolerance)),
            Self::Converged => 0.0,
        }
    }
}

/// Newton's method in one lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Newton {
    /// Estimated error, in tolerances, at which the method ends.
    pub(super) tolerance: f64,
    /// Contraction of the last iterations, the estimate for the next stage.
    pub(super) contraction: f64,
    pub(super) previous_norm: Option<f64>,
    /// Work of the last attempt.
    pub(super) iterations: usize,
    pub(super) factorisations: usize,
    pub(super) failed: bool,
}

/// Verdict of [`Newton::judge`].
pub(super) enum NewtonVerdict {
    Converged,
    Continues,
    /// Continue with a matrix from the present point.
    NeedsMatrix,
    Failed,
}

impl Newton {
    pub(super) fn new() -> Self {
        Self {
            tolerance: NEWTON_TOLERANCE,
            contraction: 1.0,
            previous_norm: None,
            iterations: 0,
            factorisations: 0,
            failed: false,
        }
    }

    /// Judges an `iteration` by the size of its correction, in tolerances; `fresh` if it made the
    /// matrix.
    pub(super) fn judge(
        &mut self,
        solution: StageSolution,
        iteration: usize,
        norm: f64,
        fresh: bool,
        relative: f64,
    ) -> NewtonVerdict {
        if !norm.is_finite() {
            return NewtonVerdict::Failed;
        }
        if iteration == 0 {
            if norm < solution.trusted_correction(relative) {
                return NewtonVerdict::Converged;
            }
            if solution == StageSolution::Predicted && norm * relative > HOPEFUL_CORRECTION {
                return NewtonVerdict::Failed;
            }
        }
        if let Some(previous) = self.previous_norm {
            let contraction = norm / previous;
            if contraction > MAX_CONTRACTION && norm > self.tolerance {
                self.previous_norm = None;
                return if fresh {
                    NewtonVerdict::Failed
                } else {
                    NewtonVerdict::NeedsMatrix
                };
            }
            self.contraction = contraction.max(SLOWEST_DECLINE * self.contraction);
        } else if iteration == 0 {
            // Hairer and Wanner II, section IV.8: trust the last contraction, but not entirely.
            self.contraction = self.contraction.max(f64::EPSILON).powf(0.8);
        }
        self.previous_norm = Some(norm);
        let remaining = if self.contraction < 1.0 {
            self.contraction / (1.0 - self.contraction) * norm
        } else {
            norm
        };
        // Corrections of a few roundings are noise, and their contraction means nothing.
        if remaining <= self.tolerance || norm * relative <= 8.0 * f64::EPSILON {
            NewtonVerdict::Converged
        } else {
            NewtonVerdict::Continues
        }
    }
}
