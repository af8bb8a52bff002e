//! Function files for MATLAB and GNU Octave.

use bristle_codegen::back::languages::{Dialect, FunctionBody, check_names};
use bristle_codegen::back::source::{Origin, comment};
use bristle_codegen::ir::kernel::{Kernel, Output, OutputShape};

use super::{SourceFile, documentation, header_in, series_filled, uses_half_angle_squared};

/// Keywords of MATLAB and Octave, and names that the functions use.
const RESERVED: &str = "\
    arguments break case catch classdef continue do else elseif end end_try_catch \
    end_unwind_protect endfor endfunction endif endparfor endswitch endwhile \
    for function global if otherwise parfor persistent return spmd switch try \
    until unwind_protect unwind_protect_cleanup while result zeros double sqrt sin cos asin exp \
    log tanh abs atan2 power half_angle_squared";

struct Matlab;

impl Dialect for Matlab {
    const RESERVED: &'static str = RESERVED;

    fn name(function: &str) -> &str {
        match function {
            "ln" => "log",
            "pow" => "power",
            other => other,
        }
    }

    fn less_than(&self, a: &str, b: &str) -> String {
        format!("double({a} < {b})")
    }

    fn assignment(&self, name: &str, value: &str) -> String {
        format!("  {name} = {value};\n")
    }

    fn element(&self, input: &str, index: usize) -> String {
        format!("{input}({})", index + 1)
    }
}

/// Writes the MATLAB source of `kernels`: a file with the name of each kernel, and
/// `half_angle_squared.m` if they need it.
///
/// A function returns its one output, or a structure of its outputs. Vectors are columns.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<Vec<SourceFile>, String> {
    check_names(kernels, RESERVED)?;
    let mut files = Vec::new();
    for kernel in kernels {
        let body = FunctionBody::new(kernel, &Matlab)?;
        let parameters: Vec<&str> = kernel
            .inputs
            .iter()
            .map(|input| input.name.as_str())
            .collect();
        let results: String = kernel
            .outputs
            .iter()
            .map(|output| assignments(kernel, output, &body))
            .collect();
        let text = format!(
            "function result = {}({})\n{}\n{}{}{results}end\n",
            kernel.name,
            parameters.join(", "),
            comment(&documentation(kernel), "%"),
            header_in(
                "MATLAB and GNU Octave",
                std::slice::from_ref(kernel),
                origin,
                "%"
            )?,
            body.statements,
        );
        files.push(SourceFile {
            name: format!("{}.m", kernel.name),
            text,
        });
    }
    if uses_half_angle_squared(kernels) {
        files.push(SourceFile {
            name: "half_angle_squared.m".into(),
            text: half_angle_squared(),
        });
    }
    Ok(files)
}

/// The statements that write an output.
fn assignments(kernel: &Kernel, output: &Output, body: &FunctionBody) -> String {
    let place = if kernel.outputs.len() == 1 {
        "result".into()
    } else {
        format!("result.{}", output.name)
    };
    let values = body.values(output);
    let elements = |index: &dyn Fn(usize) -> String| -> String {
        values
            .iter()
            .enumerate()
            .map(|(k, value)| format!("  {place}({}) = {value};\n", index(k)))
            .collect()
    };
    match output.shape {
        OutputShape::Scalar => format!("  {place} = {};\n", values[0]),
        OutputShape::Vector(length) => format!(
            "  {place} = zeros({length}, 1);\n{}",
            elements(&|k| (k + 1).to_string())
        ),
        OutputShape::Matrix(rows, columns) => {
            let index = |k: usize| format!("{}, {}", k / columns + 1, k % columns + 1);
            format!(
                "  {place} = zeros({rows}, {columns});\n{}",
                elements(&index)
            )
        }
    }
}

fn half_angle_squared() -> String {
    series_filled(include_str!("half_angle_squared.m"), "", "", "; ...\n")
}
