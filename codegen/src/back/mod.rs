//! The outputs of the engine: kernels as Rust, as JSON, and as mathematics for people to read.

pub mod json;
pub(crate) mod latex;
pub mod print;
pub mod rust;
