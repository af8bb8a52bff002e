//! Emits the expressions of `src/catalogue.rs` to `OUT_DIR/expressions.rs`, with tables of the
//! functions, and the chains of `src/chains.rs` to `OUT_DIR/whole.rs`.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::{Kernel, OutputShape};

#[path = "src/catalogue.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod catalogue;
use catalogue::{COVERAGE, FORMS, RANDOM};
#[path = "src/chains.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod chains;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/catalogue.rs");
    println!("cargo::rerun-if-changed=src/chains.rs");
    println!("cargo::rerun-if-changed=src/expressions.rs");
    let mut source = emit(
        &catalogue::kernels(),
        Origin {
            title: "Random expressions, and every operator.",
            maker: "src/catalogue.rs",
            again: "cargo test",
        },
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
    let directory = std::env::var("OUT_DIR")?;
    std::fs::write(Path::new(&directory).join("expressions.rs"), source)?;
    std::fs::write(Path::new(&directory).join("whole.rs"), whole()?)?;
    Ok(())
}

/// Writes a module for each chain, whose `values` calls all functions with the elements of their
/// inputs and returns those of their outputs.
fn whole() -> Result<String, Box<dyn Error>> {
    let mut source = String::new();
    let mut table = String::new();
    for (name, segments, motion) in chains::CHAINS {
        let kernels = chains::kernels(segments, motion);
        let emitted = emit(
            &kernels,
            Origin {
                title: name,
                maker: "src/chains.rs",
                again: "cargo test",
            },
        )?;
        let calls: String = kernels.iter().map(call).collect();
        writeln!(
            source,
            "pub mod {name} {{\nuse bristle::equations::Real;\n{emitted}\n\
             pub fn values(x: &[f64]) -> Vec<f64> {{\nlet mut values = Vec::new();\n{calls}values\n}}\n}}"
        )?;
        writeln!(table, "    {name}::values,")?;
    }
    let count = chains::CHAINS.len();
    write!(
        source,
        "\n/// Functions in the order of the chains.\npub const VALUES: [fn(&[f64]) -> Vec<f64>; {count}] = [\n{table}];\n"
    )?;
    Ok(source)
}

/// Writes the statements that call the function of `kernel` and append its outputs.
fn call(kernel: &Kernel) -> String {
    let mut arguments = Vec::new();
    let mut start = 0;
    for input in &kernel.inputs {
        let length = input.elements.len();
        arguments.push(match length {
            1 => format!("x[{start}]"),
            _ => format!("std::array::from_fn(|i| x[{start} + i])"),
        });
        start += length;
    }
    let appended = kernel.outputs.iter().map(|output| {
        let name = &output.name;
        match output.shape {
            OutputShape::Scalar => format!("values.push(result.{name});\n"),
            OutputShape::Vector(_) => format!("values.extend(result.{name});\n"),
            OutputShape::Matrix(..) => format!("values.extend(result.{name}.as_flattened());\n"),
        }
    });
    format!(
        "let result = {}({});\n{}",
        kernel.name,
        arguments.join(", "),
        appended.collect::<String>()
    )
}
