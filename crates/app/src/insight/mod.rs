//! What Bristle concludes from results.
//!
//! [`advice`], also on [`edges`]; [`measured`] forces to compare with; several studies as one
//! ([`joined`]), and the [`slices`] and [`differences`] of a study; what was
//! [assumed](assumptions); how far a result depends on the precision of its computation
//! ([`convergence`]); and [`findings`] where a result is not what it seems. [`quantity`] has numbers
//! as people read them.

pub mod advice;
pub mod assumptions;
pub mod convergence;
pub mod differences;
pub mod findings;
pub mod joined;
pub mod measured;
pub mod quantity;
pub mod slices;
#[cfg(test)]
mod testing;

pub use advice::edges;
