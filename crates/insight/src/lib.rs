//! What Bristle concludes from results.
//!
//! [`advice`], also on [`edges`]; [`measured`] forces to compare with; several studies as one ([`joined`]), and the [`slices`] and
//! [`differences`] of a study; what was [assumed](assumptions); and warnings where a result is not
//! what it seems: [`limited_work`], [`stability`], [`touch`], [`turns`]. [`quantity`] has numbers as people read them.

pub mod advice;
pub mod assumptions;
pub mod differences;
pub mod edges;
pub mod joined;
pub mod limited_work;
pub mod measured;
pub mod quantity;
pub mod slices;
pub mod stability;
#[cfg(test)]
#[path = "../../input/src/testing.rs"]
mod testing;
pub mod touch;
pub mod turns;
