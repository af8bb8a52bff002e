//! A Python module of functions on NumPy arrays.

use bristle_codegen::back::languages::{Dialect, FunctionBody, check_names};
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::{Kernel, KernelInput, Output, OutputShape};
use bristle_codegen::ir::naming::camel_case;
use bristle_codegen::ir::special;

use super::{docstring, header_in, series_rows, uses_half_angle_squared};

const RESERVED: &str = reserved_in_python!("np NamedTuple");

struct NumPy;

impl Dialect for NumPy {
    const RESERVED: &'static str = RESERVED;

    fn name(function: &str) -> &str {
        match function {
            "asin" => "arcsin",
            "ln" => "log",
            "atan2" => "arctan2",
            "pow" => "power",
            other => other,
        }
    }

    fn library(&self) -> &'static str {
        "np."
    }

    fn less_than(&self, a: &str, b: &str) -> String {
        format!("np.where({a} < {b}, 1.0, 0.0)")
    }

    fn half_angle_squared(&self, order: u8, u: &str) -> String {
        format!("_half_angle_squared({order}, {u})")
    }

    fn assignment(&self, name: &str, value: &str) -> String {
        format!("    {name} = {value}\n")
    }

    fn element(&self, input: &str, index: usize) -> String {
        format!("{input}[..., {index}]")
    }
}

const STACK: &str = "\n\ndef _array(shape, elements):\n    \
                     \"\"\"The elements, row by row, as the last axes of an array.\"\"\"\n    \
                     stacked = np.stack(np.broadcast_arrays(*elements), axis=-1)\n    \
                     return stacked.reshape(stacked.shape[:-1] + shape)\n";

/// Writes the Python source of `kernels`: one module.
///
/// Arrays may have any leading axes, over which the functions broadcast: one call evaluates a batch
/// of states.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    check_names(kernels, RESERVED)?;
    let mut text = header_in(
        "Python, on NumPy arrays with any leading axes",
        kernels,
        origin,
        "#",
    )?;
    text += "\nfrom typing import NamedTuple\n\nimport numpy as np\n";
    text += STACK;
    if uses_half_angle_squared(kernels) {
        text += &half_angle_squared();
    }
    for kernel in kernels {
        let body = FunctionBody::new(kernel, &NumPy)?;
        let parameters: Vec<&str> = kernel
            .inputs
            .iter()
            .map(|input| input.name.as_str())
            .collect();
        let used = kernel
            .inputs
            .iter()
            .filter(|input| !body.unused.contains(&input.name));
        let arrays: String = used
            .map(|KernelInput { name, .. }| format!("    {name} = np.asarray({name})\n"))
            .collect();
        let (class, result) = result(kernel, &body);
        text += &format!(
            "{class}\n\ndef {}({}):\n{}{arrays}{}    return {result}\n",
            kernel.name,
            parameters.join(", "),
            docstring(kernel),
            body.statements,
        );
    }
    Ok(text)
}

/// The class of a result with several fields, and the expression of the result.
fn result(kernel: &Kernel, body: &FunctionBody) -> (String, String) {
    let value = |output: &Output| {
        let elements = body.values(output).join(", ");
        match output.shape {
            OutputShape::Scalar => elements,
            OutputShape::Vector(length) => format!("_array(({length},), [{elements}])"),
            OutputShape::Matrix(rows, columns) => {
                format!("_array(({rows}, {columns}), [{elements}])")
            }
        }
    };
    if let [output] = &kernel.outputs[..] {
        return (String::new(), value(output));
    }
    let class = camel_case(&kernel.name);
    let fields: String = kernel
        .outputs
        .iter()
        .map(|output| format!("    {}: np.ndarray\n", output.name))
        .collect();
    let values: Vec<String> = kernel
        .outputs
        .iter()
        .map(|output| format!("        {}={},\n", output.name, value(output)))
        .collect();
    (
        format!(
            "\n\nclass {class}(NamedTuple):\n    \"\"\"Result of `{}`.\"\"\"\n\n{fields}",
            kernel.name
        ),
        format!("{class}(\n{}    )", values.concat()),
    )
}

fn half_angle_squared() -> String {
    format!(
        "\n\n# Power series of S and its derivatives, lowest power first.\n\
         _SERIES = np.array([\n{rows},\n])\n\n\n\
         def _half_angle_squared(order, u):\n\
         \x20   \"\"\"The derivative of order 0 to {max} of S(u) = acos(1 - u)**2 / 2, for u < 2.\"\"\"\n\
         \x20   u = np.asarray(u)\n\
         \x20   is_small = np.abs(u) <= {limit:?}\n\
         \x20   series = np.polynomial.polynomial.polyval(np.where(is_small, u, 0.0), _SERIES[order])\n\
         \x20   # Where the series is used, the closed form is taken where it is harmless.\n\
         \x20   u = np.where(is_small, 1.0, u)\n\
         \x20   cosine = 1.0 - u\n\
         \x20   sine_squared = u * (2.0 - u)\n\
         \x20   sine = np.sqrt(sine_squared)\n\
         \x20   angle = np.arctan2(sine, cosine)\n\
         \x20   if order == 0:\n\
         \x20       return np.where(is_small, series, 0.5 * angle * angle)\n\
         \x20   first = angle / sine\n\
         \x20   if order == 1:\n\
         \x20       return np.where(is_small, series, first)\n\
         \x20   second = (1.0 - cosine * first) / sine_squared\n\
         \x20   if order == 2:\n\
         \x20       return np.where(is_small, series, second)\n\
         \x20   return np.where(is_small, series, (first - 3.0 * cosine * second) / sine_squared)\n",
        rows = series_rows("[", "]", ",\n"),
        max = special::MAX_ORDER,
        limit = special::SERIES_LIMIT,
    )
}
