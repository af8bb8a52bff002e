//! Hashes this crate's sources, because they affect results too: sampled tools, their bands, and what a case consists of.

use std::io;
use std::path::Path;

use bristle_codegen::fingerprint::{digest, locked, sources};

const LOCK: &str = "../../Cargo.lock";
/// The packages whose versions affect results.
const NUMERICAL_PACKAGES: [&str; 3] = ["nalgebra", "sobol_burley", "spec_math"];

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=src");
    if Path::new(LOCK).exists() {
        println!("cargo::rerun-if-changed={LOCK}");
    }
    let packages = locked(Path::new(LOCK), &NUMERICAL_PACKAGES)?;
    println!("cargo::rustc-env=BRISTLE_GRID_SOURCES={}", digest((packages + &sources(&["src"])?).as_bytes()));
    Ok(())
}
