//! Tests of the core through its public interface. They form one program, as each further one would have to be linked.

mod common;

mod agreement;
mod allocations;
mod batch;
mod fingerprint;
mod open_core;
mod physics;
mod poles;
mod reference;
mod slow;
mod work;
