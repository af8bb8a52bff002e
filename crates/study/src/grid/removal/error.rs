//! Errors in following an edge.

use std::fmt::Display;
use std::io;

use thiserror::Error;

/// Reason why there is no result.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RemovalError {
    /// Description of the failure to follow an edge to the goal.
    #[error("{0}")]
    Failed(String),
    /// Stop on request.
    #[error("stopped")]
    Stopped,
}

impl RemovalError {
    /// Returns the error of a pass over an edge with a `radius` in m, by filaments with a `loss` of
    /// length in m.
    pub(super) fn of_pass(radius: f64, loss: f64, error: impl Display) -> Self {
        Self::Failed(format!(
            "over an edge with a radius of {radius:.3e} m, with filaments that have lost \
             {loss:.3e} m: {error}"
        ))
    }
}

impl From<io::Error> for RemovalError {
    fn from(error: io::Error) -> Self {
        Self::Failed(format!("cannot start threads: {error}"))
    }
}
