//! Results of a pass.

use super::observers::{Sample, Shape};
use super::profile::ProfileCell;
use super::statistics::Statistics;
use crate::model::metrics::Metrics;
use crate::model::trim::Place;

/// Result of a pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// Metrics of the contact in the last turn.
    pub metrics: Metrics,
    /// Contact normal impulse `p_n` of each turn in N s.
    pub turn_contact_normal_impulses_n_s: Vec<f64>,
    /// End of the last turn in s.
    pub end_time_s: f64,
    /// Work done in all turns.
    pub statistics: Statistics,
    /// Equally spaced samples, if requested.
    pub history: Vec<Sample>,
    /// Shapes of the filament at equally spaced times, if requested.
    pub shapes: Vec<Shape>,
    /// Work along the profile of the workpiece, by arc length, if requested: all cells within the
    /// tool's reach.
    pub profile: Vec<ProfileCell>,
    /// Filaments along the trim, where they differ; otherwise empty.
    pub positions: Vec<AtPlace>,
}

/// Filament of a trim on which filaments differ.
#[derive(Clone, Debug, PartialEq)]
pub struct AtPlace {
    /// Place on the trim, and the share of the filaments for which it stands.
    pub place: Place,
    /// Metrics, as if all filaments of the tool were like this one.
    pub metrics: Metrics,
}
