//! Counts of instructions. `main.rs` says what of.
