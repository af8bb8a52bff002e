//! Benchmarks of Bristle. `Cargo.toml` has their names, and each file says what it measures.
