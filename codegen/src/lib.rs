//! Bristle's symbolic engine: from the energies of a filament to Rust that computes its motion.
//!
//! The passes, in order, each a function from one plain type to the next:
//!
//! 1. [`chain`] states the energies of a segment and of a joint as expressions in a [`graph::Graph`];
//! 2. [`calculus`] differentiates them, [`simplify`] reduces what comes out;
//! 3. [`lagrange::whole_equations`] forms the dense equations `M q̈ = f` for any number of segments: the form
//!    that people read, snapshot and compare ([`whole`] puts names to it);
//! 4. [`kernels::kernels`] forms the derivatives of one segment and one joint, from which the solver's loops
//!    compute accelerations and implicit steps in O(n);
//! 5. [`emit`] writes either form as Rust, [`print`](mod@print) as text, LaTeX or Markdown, [`exchange`] as JSON.

/// What this engine is called where its derivations say what made them.
pub const MAKER: &str =
    concat!("bristle-codegen ", env!("CARGO_PKG_VERSION"), " from the energies in codegen/src/chain.rs");

pub mod calculus;
pub mod chain;
pub mod compare;
pub mod constant;
pub mod dimension;
pub mod emit;
pub mod exchange;
pub mod graph;
pub mod kernels;
pub mod lagrange;
pub mod print;
pub mod simplify;
pub mod special;
pub mod unit;
pub mod whole;
