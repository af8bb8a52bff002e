//! C11: a header and a source file without dependencies beyond `math.h`.

use bristle_codegen::back::languages::{Dialect, FunctionBody, check_names};
use bristle_codegen::back::source::{Origin, comment};
use bristle_codegen::ir::kernel::{Kernel, Output, OutputShape};
use bristle_codegen::ir::special;

use super::{
    SourceFile, describe, documentation, header_in, series_filled, uses_half_angle_squared,
};

/// Name of both files, without their extensions, and prefix of the names of functions.
const NAME: &str = "bristle_chain";
const PREFIX: &str = "bristle_";

/// Keywords of C and, because the header serves it too, of C++; macros; names in the functions.
const RESERVED: &str = "\
    auto break case char const continue default do double else enum extern float for goto if \
    inline int long register restrict return short signed sizeof static struct switch typedef \
    union unsigned void volatile while alignas alignof and and_eq asm bitand bitor bool catch \
    char16_t char32_t char8_t class co_await co_return co_yield compl concept const_cast \
    consteval constexpr constinit decltype delete dynamic_cast explicit export false friend \
    mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public \
    reinterpret_cast requires static_assert static_cast template this thread_local throw true \
    try typeid typename typeof typeof_unqual using virtual wchar_t xor xor_eq result sqrt sin \
    cos asin exp log tanh fabs atan2 pow half_angle_squared BRISTLE_CHAIN_H HUGE_VAL INFINITY NAN linux unix";

struct C;

impl Dialect for C {
    const RESERVED: &'static str = RESERVED;

    fn name(function: &str) -> &str {
        match function {
            "ln" => "log",
            "abs" => "fabs",
            other => other,
        }
    }

    fn less_than(&self, a: &str, b: &str) -> String {
        format!("({a} < {b} ? 1.0 : 0.0)")
    }

    fn assignment(&self, name: &str, value: &str) -> String {
        format!("    const double {name} = {value};\n")
    }
}

/// Writes the C source of `kernels`: `bristle_chain.h` and `bristle_chain.c`.
///
/// Each kernel is a function that writes its one output, or the fields of a structure, through its
/// last argument.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<Vec<SourceFile>, String> {
    check_names(kernels, RESERVED)?;
    let head = header_in("C11", kernels, origin, "//")?;
    let mut declarations = format!(
        "{head}\n#ifndef BRISTLE_CHAIN_H\n#define BRISTLE_CHAIN_H\n\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n"
    );
    let mut source = format!("{head}\n#include \"{NAME}.h\"\n\n#include <math.h>\n");
    if uses_half_angle_squared(kernels) {
        source += &half_angle_squared();
    }
    for kernel in kernels {
        let declaration = declaration(kernel);
        let comment = comment(&documentation(kernel), "//");
        declarations += &format!("\n{comment}{}{declaration};\n", structure(kernel));
        let body = FunctionBody::new(kernel, &C)?;
        let ignored: String = body
            .unused
            .iter()
            .map(|name| format!("    (void){name};\n"))
            .collect();
        let results: String = kernel
            .outputs
            .iter()
            .map(|output| assignments(kernel, output, &body))
            .collect();
        source += &format!(
            "\n{declaration} {{\n{ignored}{}{results}}}\n",
            body.statements
        );
    }
    declarations += "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n";
    let file = |extension: &str, text| SourceFile {
        name: format!("{NAME}.{extension}"),
        text,
    };
    Ok(vec![file("h", declarations), file("c", source)])
}

/// The dimensions of an array in brackets.
fn dimensions(shape: OutputShape) -> String {
    shape
        .sizes()
        .into_iter()
        .map(|size| format!("[{size}]"))
        .collect()
}

/// The structure of several outputs; empty for a single one.
fn structure(kernel: &Kernel) -> String {
    if kernel.outputs.len() == 1 {
        return String::new();
    }
    let field = |output: &Output| {
        format!(
            "    // {}\n    double {}{};\n",
            describe(output),
            output.name,
            dimensions(output.shape)
        )
    };
    let fields: String = kernel.outputs.iter().map(field).collect();
    format!("struct {PREFIX}{} {{\n{fields}}};\n", kernel.name)
}

fn declaration(kernel: &Kernel) -> String {
    let mut arguments: Vec<String> = Vec::new();
    for input in &kernel.inputs {
        arguments.push(match input.elements.len() {
            1 => format!("double {}", input.name),
            length => format!("const double {}[{length}]", input.name),
        });
    }
    arguments.push(match &kernel.outputs[..] {
        [
            Output {
                shape: OutputShape::Scalar,
                ..
            },
        ] => "double *result".into(),
        [output] => format!("double result{}", dimensions(output.shape)),
        _ => format!("struct {PREFIX}{} *result", kernel.name),
    });
    format!(
        "void {PREFIX}{}(\n    {})",
        kernel.name,
        arguments.join(",\n    ")
    )
}

/// The statements that write an output.
fn assignments(kernel: &Kernel, output: &Output, body: &FunctionBody) -> String {
    let place = match (&kernel.outputs[..], output.shape) {
        ([_], OutputShape::Scalar) => "*result".into(),
        ([_], _) => "result".into(),
        _ => format!("result->{}", output.name),
    };
    let index = |k: usize| match output.shape {
        OutputShape::Scalar => String::new(),
        OutputShape::Vector(_) => format!("[{k}]"),
        OutputShape::Matrix(_, columns) => format!("[{}][{}]", k / columns, k % columns),
    };
    let values = body.values(output);
    values
        .iter()
        .enumerate()
        .map(|(k, value)| format!("    {place}{} = {value};\n", index(k)))
        .collect()
}

fn half_angle_squared() -> String {
    let orders = special::SERIES.len().to_string();
    series_filled(include_str!("half_angle_squared.c"), "{", "}", ",\n")
        .replace("@ORDERS@", &orders)
        .replace("@TERMS@", &special::TERMS.to_string())
        .replace("@LAST@", &(special::TERMS - 1).to_string())
}
