//! The outputs of the engine: kernels in programming languages, as JSON, and as mathematics for
//! people to read.

pub mod json;
pub mod languages;
pub(crate) mod latex;
pub mod print;
pub mod source;
