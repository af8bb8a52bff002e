//! Hashes this crate's sources, because they affect results too: sampled tools, their bands, and what a case consists of.

use std::io;

use bristle_codegen::fingerprint::sources;

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=src");
    println!("cargo::rustc-env=BRISTLE_STUDY_SOURCES={}", sources(&["src"])?);
    Ok(())
}
