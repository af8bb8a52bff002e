//! Tests of the core through its public interface. They form one program, because each further one
//! would have to be linked.

mod common;
mod energy;

mod agreement;
mod allocations;
mod batch;
#[cfg(feature = "serde")]
mod brush;
mod damping;
#[cfg(feature = "serde")]
mod edges;
mod fingerprint;
mod lateral;
mod lone;
mod open_core;
mod physics;
mod planar;
mod poles;
#[cfg(feature = "serde")]
mod posed;
mod poses;
mod profile;
mod reference;
mod resolved;
mod segments;
mod shape;
mod shortcuts;
mod slow;
#[cfg(feature = "serde")]
mod space;
mod tubes;
mod turns;
mod work;
mod workpieces;
