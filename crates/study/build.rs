//! Hashes the sources of `grid`, because they affect results too: sampled tools, their bands, and
//! what a case consists of.

use std::io;

use bristle_codegen::fingerprint::{code, digest};

/// Packages whose versions affect results.
const NUMERICAL_PACKAGES: [&str; 3] = ["nalgebra", "sobol_burley", "spec_math"];

fn main() -> io::Result<()> {
    let code = code("src/grid", "../../Cargo.lock", &NUMERICAL_PACKAGES)?;
    println!(
        "cargo::rustc-env=BRISTLE_GRID_SOURCES={}",
        digest(code.as_bytes())
    );
    Ok(())
}
