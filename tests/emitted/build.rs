//! Emits the expressions of `src/catalogue.rs` to `OUT_DIR/expressions.rs`, with tables of the functions.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use bristle_codegen::back::rust::{Origin, emit};

#[path = "src/catalogue.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod catalogue;
use catalogue::{COVERAGE, FORMS, RANDOM};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/catalogue.rs");
    println!("cargo::rerun-if-changed=../../codegen/tests/codegen/expressions.rs");
    let mut source = emit(
        &catalogue::kernels(),
        Origin { title: "Random expressions, and every operator.", maker: "src/catalogue.rs", again: "cargo test" },
    )?;
    let forms = FORMS.len();
    write!(
        source,
        "\n/// Each random expression in all forms.\npub const RANDOM: [[fn([f64; 3]) -> f64; {forms}]; {RANDOM}] = ["
    )?;
    for i in 0..RANDOM {
        let functions = FORMS.map(|form| format!("|[x, y, z]| random_{i}_{form}(x, y, z).value"));
        writeln!(source, "    [{}],", functions.join(", "))?;
    }
    write!(
        source,
        "];\n\n/// Value and derivatives of each operator.\npub const COVERED: [fn(f64, f64) -> [f64; 3]; {}] = [",
        COVERAGE.len()
    )?;
    for covered in COVERAGE {
        writeln!(source, "    |a, b| covered_{}(a, b).value,", covered.name)?;
    }
    source.push_str("];\n");
    std::fs::write(Path::new(&std::env::var("OUT_DIR")?).join("expressions.rs"), source)?;
    Ok(())
}
