//! Tests of the core through its public interface, in one program: each further one would be linked on its own.

mod common;

mod agreement;
mod allocations;
mod batch;
mod fingerprint;
mod open_core;
mod physics;
mod poles;
mod reference;
mod work;
