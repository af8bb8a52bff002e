//! The outputs of the engine: kernels as Rust, and as JSON. `bristle-equations` writes them in other
//! languages, and as mathematics for people to read.

pub mod json;
pub mod languages;
pub mod source;
