//! The input and the output of a simulation: settings with their ranges, and metrics.

pub mod filament;
pub mod metrics;
pub mod parameters;
pub mod passage;
pub mod pose;
pub mod record;
pub mod settings;
pub mod trim;
pub mod tube;
