//! A Python module of functions that return SymPy matrices.

use bristle_codegen::back::languages::{Dialect, FunctionBody, check_names};
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::constant::Constant;
use bristle_codegen::ir::kernel::{Kernel, Output, OutputShape};

use super::{docstring, header_in, uses_half_angle_squared};

const RESERVED: &str = reserved_in_python!(
    "Abs Dummy Float Integer Matrix Piecewise Pow Rational Symbol acos asin atan2 cos diff exp log tanh factorial hyper rf sin \
     sqrt closed_form"
);

struct SymPy;

impl Dialect for SymPy {
    const RESERVED: &'static str = RESERVED;

    fn name(function: &str) -> &str {
        match function {
            "ln" => "log",
            "abs" => "Abs",
            "pow" => "Pow",
            other => other,
        }
    }

    /// Writes exactly, so that SymPy can simplify.
    fn number(&self, value: Constant) -> String {
        match value {
            _ if value.value().is_sign_negative() => format!("-{}", self.number(-value)),
            Constant::Rational(value) if value.is_integer() => format!("Integer({value})"),
            Constant::Rational(value) => format!("Rational({}, {})", value.numer(), value.denom()),
            Constant::Float(value) => format!("Float({value:?})"),
        }
    }

    fn less_than(&self, a: &str, b: &str) -> String {
        format!("Piecewise((Integer(1), {a} < {b}), (Integer(0), True))")
    }

    fn half_angle_squared(&self, order: u8, u: &str) -> String {
        format!("_half_angle_squared({order}, {u}, closed_form)")
    }

    fn assignment(&self, name: &str, value: &str) -> String {
        format!("    {name} = {value}\n")
    }
}

/// `S⁽ᵏ⁾` for `k ≥ 1` is `2F1(k, k; k + ½; u/2)` times its value at 0, and `S` is `u 3F2(1, 1, 1;
/// 3/2, 2; u/2)`: functions that SymPy differentiates and evaluates, also at the straight joint.
const HALF_ANGLE_SQUARED: &str = r#"

def _half_angle_squared(order, u, closed_form):
    """The derivative of the given order of S(u) = acos(1 - u)**2 / 2.

    As a hypergeometric function, or in closed form, which has no value at u = 0, the straight joint.
    """
    if closed_form:
        x = Dummy()
        return diff(acos(1 - x) ** 2 / 2, x, order).subs(x, u)
    if order == 0:
        return u * hyper([1, 1, 1], [Rational(3, 2), 2], u / 2)
    k = Integer(order)
    at_zero = factorial(k - 1) ** 2 / (2 ** (k - 1) * rf(Rational(3, 2), k - 1))
    return at_zero * hyper([k, k], [k + Rational(1, 2)], u / 2)
"#;

/// Writes the Python source of `kernels`: one module.
///
/// Each kernel is a function without required arguments that returns matrices in symbols with the
/// names of the inputs' elements.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    check_names(kernels, RESERVED)?;
    let mut text = header_in("Python, as matrices of SymPy", kernels, origin, "#")?;
    text += "\nfrom sympy import (Abs, Dummy, Float, Integer, Matrix, Piecewise, Pow, Rational, Symbol, acos, asin, atan2, cos,\n    \
             diff, exp, factorial, hyper, log, rf, sin, sqrt, tanh)\n";
    text += "\n\ndef _symbols(*names):\n    return [Symbol(name, real=True) for name in names]\n";
    if uses_half_angle_squared(kernels) {
        text += HALF_ANGLE_SQUARED;
    }
    for kernel in kernels {
        let body = FunctionBody::new(kernel, &SymPy)?;
        let parameter = if uses_half_angle_squared(std::slice::from_ref(kernel)) {
            "closed_form=False"
        } else {
            ""
        };
        let symbols: String = kernel
            .inputs
            .iter()
            .filter(|input| !body.unused.contains(&input.name))
            .map(|input| {
                let names: Vec<String> = input
                    .elements
                    .iter()
                    .map(|(name, _)| format!("\"{name}\""))
                    .collect();
                let [open, close] = if names.len() == 1 {
                    ["[", "]"]
                } else {
                    ["", ""]
                };
                format!(
                    "    {open}{}{close} = _symbols({})\n",
                    input.name,
                    names.join(", ")
                )
            })
            .collect();
        text += &format!(
            "\n\ndef {}({parameter}):\n{}{symbols}{}    return {}\n",
            kernel.name,
            docstring(kernel),
            body.statements,
            result(kernel, &body),
        );
    }
    Ok(text)
}

fn result(kernel: &Kernel, body: &FunctionBody) -> String {
    let value = |output: &Output| {
        let values = body.values(output);
        match output.shape {
            OutputShape::Scalar => values.concat(),
            OutputShape::Vector(_) => format!("Matrix([{}])", values.join(", ")),
            OutputShape::Matrix(rows, columns) => {
                format!("Matrix({rows}, {columns}, [{}])", values.join(", "))
            }
        }
    };
    if let [output] = &kernel.outputs[..] {
        return value(output);
    }
    let fields = kernel
        .outputs
        .iter()
        .map(|output| format!("        \"{}\": {},\n", output.name, value(output)));
    format!("{{\n{}    }}", fields.collect::<String>())
}
