//! Conclusions from results.
//!
//! [`advice`] recommends settings, also for [`edges`]. [`measured`] compares results with measured
//! forces. [`joined`] makes one study of several; [`slices`] and [`differences`] are parts of a
//! study. [`assumptions`] lists settings that the input file does not state. [`convergence`] shows
//! the effect of the precision on a result. [`findings`] names results that are not resolved or
//! misleading, as [`rules`] judge them. [`quantity`] has numbers as people read them.

pub mod advice;
pub mod assumptions;
pub mod convergence;
pub mod differences;
pub mod findings;
pub mod joined;
mod joined_tool;
pub mod measured;
pub mod quantity;
pub mod rules;
pub mod slices;
#[cfg(test)]
mod testing;

pub use advice::edges;
