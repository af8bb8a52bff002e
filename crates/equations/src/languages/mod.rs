//! C, MATLAB, NumPy, SymPy and Rust on `f64`, written as the kernels are.

use bristle_codegen::back::source::{Origin, header};
use bristle_codegen::ir::graph::Node;
use bristle_codegen::ir::kernel::{Kernel, KernelInput, Output, OutputShape};
use bristle_codegen::ir::special;

/// Keywords of Python, and the `words` that a module uses.
macro_rules! reserved_in_python {
    ($words:literal) => {
        concat!(
            "False None True and as assert async await break class continue def del elif else \
             except finally for from global if import in is lambda nonlocal not or pass raise \
             return try while with yield ",
            $words
        )
    };
}

pub mod c;
pub mod matlab;
pub mod numpy;
pub mod rust;
pub mod sympy;

/// A file of source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Its name, without a directory.
    pub name: String,
    /// Its content.
    pub text: String,
}

/// Describes an output with its shape and its unit.
fn describe(output: &Output) -> String {
    let shape = match output.shape {
        OutputShape::Scalar | OutputShape::Matrix(..) => String::new(),
        OutputShape::Vector(length) => format!(", {length} values"),
    };
    format!("{}{shape}{}", output.doc, output.in_unit())
}

/// Describes an input with its size.
fn describe_input(input: &KernelInput) -> String {
    match input.elements.len() {
        1 => input.doc.clone(),
        size => format!("{}, {size} values", input.doc),
    }
}

/// The text of a kernel for people: purpose, inputs and results.
fn documentation(kernel: &Kernel) -> String {
    let mut text = kernel.summary.clone() + "\n\n";
    for input in &kernel.inputs {
        text += &format!("{}: {}\n", input.name, describe_input(input));
    }
    text += match &kernel.outputs[..] {
        [_] => "\nResult:\n",
        _ => "\nResult, by the names of its fields:\n",
    };
    for output in &kernel.outputs {
        text += &format!("{}: {}\n", output.name, describe(output));
    }
    text
}

/// `true` if a kernel needs `S`.
fn uses_half_angle_squared(kernels: &[Kernel]) -> bool {
    let is_it = |kernel: &Kernel, id| matches!(kernel.graph.node(id), Node::HalfAngleSquared(..));
    kernels
        .iter()
        .any(|kernel| kernel.computed().into_iter().any(|id| is_it(kernel, id)))
}

/// The coefficients of the power series of `S` and its derivatives, lowest power first, each row
/// between `open` and `close`.
fn series_rows(open: &str, close: &str, after: &str) -> String {
    let row = |coefficients: &[f64]| {
        let numbers: Vec<String> = coefficients
            .iter()
            .map(|value| format!("{value:?}"))
            .collect();
        format!("    {open}{}{close}", numbers.join(", "))
    };
    special::SERIES
        .iter()
        .map(|coefficients| row(coefficients))
        .collect::<Vec<_>>()
        .join(after)
}

/// Fills the numbers of its power series into a template of `S` and its derivatives.
fn series_filled(template: &str, open: &str, close: &str, after: &str) -> String {
    template
        .replace("@ROWS@", &series_rows(open, close, after))
        .replace("@MAX_ORDER@", &special::MAX_ORDER.to_string())
        .replace("@LIMIT@", &format!("{:?}", special::SERIES_LIMIT))
}

/// The header of a file, whose title names the language. Each line is a comment after `mark`.
fn header_in(
    language: &str,
    kernels: &[Kernel],
    origin: Origin<'_>,
    mark: &str,
) -> Result<String, String> {
    let title = format!("{} In {language}.", origin.title);
    header(
        kernels,
        Origin {
            title: &title,
            ..origin
        },
        mark,
    )
}

/// A Python docstring with the [`documentation`] of a kernel, indented as the body of its function.
/// Empty lines hold no blanks.
fn docstring(kernel: &Kernel) -> String {
    let text = documentation(kernel);
    let mut lines = text.trim_end().lines();
    let first = lines.next().unwrap_or_default();
    let rest = lines.map(|line| {
        if line.is_empty() {
            "\n".to_owned()
        } else {
            format!("\n    {line}")
        }
    });
    format!(
        "    \"\"\"{first}{}\n    \"\"\"\n",
        rest.collect::<String>()
    )
}
