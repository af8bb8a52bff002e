//! Benchmarks of Bristle: see `Cargo.toml` for their names, and each for what it measures.
