//! Why an edge cannot be followed.

use std::io;

use thiserror::Error;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RemovalError {
    /// There is no edge.
    #[error("`workpiece.kind` has no edge that grows round: choose \"edge\" or \"chamfer\"")]
    NoEdge,
    /// Chamfers need the work along the profile.
    #[error(
        "the work of filaments that touch is not divided between the two edges of a chamfer: leave [brush] out, or choose `workpiece.kind = \"edge\"`"
    )]
    ChamferOfBrush,
    /// The coefficient is unknown.
    #[error(
        "state `removal.preston_m2_n`, or what one trial showed: `removal.observed = {{ edge_radius_m = …, time_s = … }}`"
    )]
    NoCoefficient,
    /// There is no goal.
    #[error(
        "state when to end: `removal.until = {{ edge_radius_m = … }}`, or `turns`, or `time_s`; or `removal.edge_feed_velocity_m_s`, for one pass along the edge"
    )]
    NoGoal,
    /// The edge is rounder than it is to become.
    #[error(
        "`{path}` is {goal:e} m, but the edge has a radius of {radius:e} m at the start, by `workpiece.edge_radius_m`: choose a larger one"
    )]
    Backwards {
        /// The setting.
        path: &'static str,
        /// Its value in m.
        goal: f64,
        /// The radius at the start in m.
        radius: f64,
    },
    /// A radius is not reached.
    #[error("an edge radius of {goal:e} m is never reached; the largest is {largest:.3e} m: {why}")]
    Unreached {
        /// The radius that is asked for in m.
        goal: f64,
        /// The largest radius that is reached in m.
        largest: f64,
        /// Why the work on the edge ends.
        why: String,
    },
    /// A pass cannot be simulated.
    #[error("over an edge with a radius of {radius:.3e} m, with filaments that have lost {loss:.3e} m: {error}")]
    Case {
        /// The radius in m.
        radius: f64,
        /// The loss of length in m.
        loss: f64,
        /// What is wrong.
        error: String,
    },
    /// A setting is wrong.
    #[error("{0}")]
    Settings(String),
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
