//! Empty: `main.rs` counts instructions.
