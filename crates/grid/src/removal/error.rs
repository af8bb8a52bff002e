//! Why an edge cannot be followed.

use std::io;

use thiserror::Error;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RemovalError {
    /// The settings do not let an edge be followed to the goal, in words.
    #[error("{0}")]
    Settings(String),
    /// A pass cannot be simulated.
    #[error(
        "over an edge with a radius of {radius:.3e} m, with filaments that have lost {loss:.3e} m: {error}"
    )]
    Case {
        /// The radius in m.
        radius: f64,
        /// The loss of length in m.
        loss: f64,
        /// What is wrong.
        error: String,
    },
    /// Threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(String),
    /// It was asked to stop.
    #[error("stopped")]
    Stopped,
}

impl From<io::Error> for RemovalError {
    fn from(error: io::Error) -> Self {
        Self::Threads(error.to_string())
    }
}
