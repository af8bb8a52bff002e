//! Hashes the sources of `grid`, because they affect results too: sampled tools, their bands, and
//! what a case consists of.

use std::io;
use std::path::Path;

use bristle_codegen::fingerprint::{code, digest};

/// Packages whose versions affect results.
const NUMERICAL_PACKAGES: [&str; 3] = ["nalgebra", "sobol_burley", "spec_math"];

/// The lock file that tells their versions.
///
/// In the repository it is the workspace's. A package, as Cargo makes it, has no workspace above it
/// but a lock file of its own. The program follows that file with `cargo install --locked`. Below a
/// program of somebody else, other versions may be chosen, which Cargo tells no build script.
fn lock_file() -> &'static str {
    const OF_PACKAGE: &str = "Cargo.lock";
    if Path::new(OF_PACKAGE).exists() {
        OF_PACKAGE
    } else {
        "../../Cargo.lock"
    }
}

fn main() -> io::Result<()> {
    let code = code("src/grid", lock_file(), &NUMERICAL_PACKAGES)?;
    println!(
        "cargo::rustc-env=BRISTLE_GRID_SOURCES={}",
        digest(code.as_bytes())
    );
    Ok(())
}
