//! Expressions, and kernels made of them: the types that every other layer works on.
//!
//! [`graph`] holds expressions, [`simplify`] the rules that its constructors apply, and [`kernel`]
//! a function with named inputs and outputs. [`constant`], [`mod@unit`] and [`special`] are the
//! parts of expressions.

pub mod constant;
pub mod graph;
pub mod kernel;
pub mod naming;
mod node;
pub mod notation;
pub mod simplify;
pub mod special;
pub mod unit;
pub mod writer;
