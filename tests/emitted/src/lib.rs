//! Emitted Rust, compiled as a user would compile it.

pub mod catalogue;
pub mod chains;

/// The functions emitted by the build script.
#[allow(
    missing_docs,
    clippy::all,
    reason = "no person would write random expressions"
)]
pub mod emitted {
    use bristle::equations::Real;

    include!(concat!(env!("OUT_DIR"), "/expressions.rs"));
}

/// The whole equations of chains, emitted by the build script.
#[allow(missing_docs, clippy::all, reason = "generated")]
pub mod whole {
    include!(concat!(env!("OUT_DIR"), "/whole.rs"));
}
