//! Work done by a pass.

use crate::integrate::Work;
use crate::model::record::Record;

crate::record! {
    /// Work done by a pass.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    pub struct Statistics {
        steps: usize = ["", "", "accepted steps", "those that became part of the motion"],
        unresolved_steps: usize = [
            "", "", "unresolved steps",
            "accepted steps that miss the tolerance, because the pass had spent its effort"
        ],
        rejected_steps: usize = [
            "", "", "rejected steps",
            "repeated because the error estimate was too large, or the step met a pole of a segment's coordinates"
        ],
        newton_iterations: usize = ["", "", "Newton iterations", "each one residual and one linear solve"],
        newton_failures: usize = [
            "", "", "steps without convergence",
            "repeated because Newton's method did not converge, or met values that are not finite"
        ],
        factorisations: usize = ["", "", "factorisations", "those of the step matrix"],
        contact_events: usize = ["", "", "contact events located", "openings and closings of the contact"],
    }
    with {
        /// Changes of the chain's chart. Not written to files: it describes the coordinates, not
        /// the work.
        #[cfg_attr(feature = "serde", serde(skip))]
        pub chart_changes: usize,
    }
}

impl Statistics {
    /// Adds two works.
    pub(super) fn and(self, other: &Self) -> Self {
        let mut sum = Self {
            chart_changes: self.chart_changes + other.chart_changes,
            ..self
        };
        for column in Self::COLUMNS {
            column.set(&mut sum, column.get(&self) + column.get(other));
        }
        sum
    }

    /// Joins the `work` of the integrator and the counts of the simulation.
    pub(super) fn new(work: &Work, contact_events: usize, chart_changes: usize) -> Self {
        let Work {
            steps,
            unresolved_steps,
            rejected_steps,
            newton_iterations,
            newton_failures,
            factorisations,
        } = *work;
        Self {
            steps,
            unresolved_steps,
            rejected_steps,
            newton_iterations,
            newton_failures,
            factorisations,
            contact_events,
            chart_changes,
        }
    }
}
