//! What a simulation is asked for and what it answers: settings, their limits, and metrics.

pub mod filament;
pub mod metrics;
pub mod parameters;
pub mod record;
pub mod settings;
