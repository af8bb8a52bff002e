//! Empty: the benchmarks and `peers/` use the other crates.
