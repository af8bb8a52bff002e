//! What a pass results in.

use super::observers::{Sample, Shape};
use super::profile::ProfileCell;
use super::statistics::Statistics;
use crate::model::metrics::Metrics;
use crate::model::trim::Place;

/// The result of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// The metrics of the contact in the last turn.
    pub metrics: Metrics,
    /// The contact normal impulse `p_n` of each turn in N s.
    pub turn_contact_normal_impulses_n_s: Vec<f64>,
    /// The time at which the last turn ended, in s.
    pub end_time_s: f64,
    /// Work done in all turns.
    pub statistics: Statistics,
    /// Equally spaced samples, if requested.
    pub history: Vec<Sample>,
    /// The filament at equally spaced times, if requested.
    pub shapes: Vec<Shape>,
    /// Where along the profile of the workpiece the work is done, by arc length, if requested: all
    /// cells within the tool's reach.
    pub profile: Vec<ProfileCell>,
    /// The filaments along the trim, where they differ; otherwise empty.
    pub positions: Vec<AtPlace>,
}

/// A filament of a trim on which filaments differ.
#[derive(Clone, Debug, PartialEq)]
pub struct AtPlace {
    /// Where it is, and the share of the filaments that it stands for.
    pub place: Place,
    /// Its metrics, as if all filaments of the tool were like it.
    pub metrics: Metrics,
}
