//! The outputs of the engine: kernels as Rust, in other languages, as JSON, and as mathematics for people to read.

pub mod json;
pub mod languages;
pub(crate) mod latex;
pub mod print;
pub mod rust;
pub mod source;
