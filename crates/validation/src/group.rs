//! Groups of trials, how far they go, and what comes out of them.

use std::fmt::Display;

use bristle::brush::{BrushError, StepError};
use bristle::simulation::{IntegrationError, SimulationError};
use thiserror::Error;

use super::trial::{Check, Figure, Trial};

/// The extent of a validation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Checks that take seconds.
    Quick,
    /// The quick checks and convergence studies.
    Full,
}

impl Extent {
    /// One of two values, as far as the validation goes.
    pub(super) fn choose<T>(self, quick: T, full: T) -> T {
        if self == Self::Quick { quick } else { full }
    }
}

/// Why a trial could not be computed. It then counts as failed.
#[derive(Clone, Debug, Error)]
pub enum Failure {
    /// A trajectory ended early.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// A pass ended early.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A brush cannot be simulated.
    #[error(transparent)]
    Brush(#[from] BrushError),
    /// Filaments of an assembly could not go on.
    #[error(transparent)]
    Step(#[from] StepError),
    /// Newton's method found no equilibrium.
    #[error("no equilibrium was found")]
    NoEquilibrium,
    /// The trial panicked.
    #[error("the case ended with: {0}")]
    Panic(String),
    /// A reference cannot be read.
    #[error("{0}")]
    Reference(String),
}

impl Failure {
    /// A reference that cannot be used, because of an error.
    pub(super) fn reference(error: impl Display) -> Self {
        Self::Reference(error.to_string())
    }
}

/// A function that computes a trial.
pub type Compute = fn(Extent) -> Result<Trial, Failure>;

/// Trials of one kind.
pub struct Group {
    /// Heading.
    pub title: &'static str,
    /// The purpose of the trials; Markdown.
    pub purpose: &'static str,
    pub(super) trials: &'static [Compute],
}

/// The results of a group.
pub struct Outcome {
    /// The group.
    pub group: &'static Group,
    /// Its trials, or why they could not be computed.
    pub trials: Vec<Result<Trial, Failure>>,
}

impl Outcome {
    /// All comparisons of the group.
    pub fn checks(&self) -> impl Iterator<Item = &Check> {
        self.trials.iter().flatten().flat_map(|trial| &trial.checks)
    }

    /// All diagrams of the group.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.trials
            .iter()
            .flatten()
            .flat_map(|trial| &trial.figures)
    }
}
