//! Kernels as JSON, written and read: the format in which engines exchange derivations.
//!
//! A file holds one or more kernels. A kernel is a list of operations in single assignment,
//! operands before users; a number in an operand's place is the index of an earlier operation.
//! `docs/library.md ("Exchange format")` has every field.
//!
//! A file may be broken or hostile. Everything is checked before it is used, and a fault is an
//! error that names the kernel and the operation. Nothing recurses over the expressions.

mod format;
mod read;
mod write;

pub use crate::back::json::format::{
    FORMAT, MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, MAX_EXPONENT, MAX_FIELDS, MAX_KERNELS, MAX_NAME,
    MAX_OPERATIONS, MAX_TEXT, VERSION, operators,
};
pub use crate::back::json::read::{GraphFile, from_json};
pub use crate::back::json::write::{fingerprint, to_json};
