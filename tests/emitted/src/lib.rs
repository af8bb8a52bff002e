//! Emitted Rust, compiled: what a user's compiler makes of what the emitter writes.

pub mod catalogue;

/// The functions that the build script has emitted.
#[allow(missing_docs, clippy::all, reason = "random expressions are not what a person would write")]
pub mod emitted {
    use bristle::equations::Real;

    include!(concat!(env!("OUT_DIR"), "/expressions.rs"));
}
