//! Tests of the core through its public interface. They form one program, as each further one would have to be linked.

mod common;
mod energy;

mod agreement;
mod allocations;
mod batch;
#[cfg(feature = "serde")]
mod brush;
#[cfg(feature = "serde")]
mod edges;
mod fingerprint;
mod lateral;
mod open_core;
mod physics;
mod planar;
mod poles;
mod profile;
mod reference;
mod shape;
mod slow;
mod turns;
mod work;
mod workpieces;
