//! Emits the equations of `src/derivation.rs` as Rust to `OUT_DIR/equations.rs`.

use bristle_codegen::back::{languages::rust::emit, source::Origin};

#[path = "src/derivation.rs"]
mod derivation;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let origin = Origin {
        title: "A chain whose tip adheres.",
        maker: "codegen/examples/own_energy",
        again: "cargo build -p bristle-own-energy",
    };
    let source = emit(&derivation::kernels()?, origin)?;
    let path = std::env::var("OUT_DIR")? + "/equations.rs";
    Ok(std::fs::write(path, source)?)
}
