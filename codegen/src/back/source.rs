//! Origin and operation count of emitted source, alike in all languages.

use crate::back::json::fingerprint;
use crate::ir::graph::Node;
use crate::ir::kernel::Kernel;

/// Number of operations of a kernel; a shared one counts once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperationCount {
    /// Additions, subtractions and changes of sign.
    pub additions: usize,
    /// Multiplications, squares included.
    pub multiplications: usize,
    /// Divisions.
    pub divisions: usize,
    /// Functions such as square roots and sines, real powers, comparisons, and evaluations of `S`
    /// and its derivatives.
    pub functions: usize,
}

impl OperationCount {
    /// All operations.
    pub fn total(&self) -> usize {
        self.additions + self.multiplications + self.divisions + self.functions
    }
}

impl std::fmt::Display for OperationCount {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            additions,
            multiplications,
            divisions,
            functions,
        } = self;
        write!(
            formatter,
            "{additions} additions, {multiplications} multiplications, {divisions} divisions, {functions} functions"
        )
    }
}

/// Counts the operations of a kernel.
pub fn count_operations(kernel: &Kernel) -> OperationCount {
    let mut count = OperationCount::default();
    for id in kernel.computed() {
        match kernel.graph.node(id) {
            Node::Constant(_) | Node::Symbol(_) => {}
            Node::Add(..) | Node::Sub(..) | Node::Neg(_) => count.additions += 1,
            Node::Mul(..) => count.multiplications += 1,
            Node::Div(..) => count.divisions += 1,
            Node::Powi(_, exponent) => {
                count.multiplications += exponent.unsigned_abs().saturating_sub(1) as usize;
                count.divisions += usize::from(exponent < 0);
            }
            Node::Sqrt(_)
            | Node::Sin(_)
            | Node::Cos(_)
            | Node::Asin(_)
            | Node::Exp(_)
            | Node::Ln(_)
            | Node::Tanh(_)
            | Node::Abs(_)
            | Node::Atan2(..)
            | Node::Pow(..)
            | Node::LessThan(..)
            | Node::HalfAngleSquared(..) => count.functions += 1,
        }
    }
    count
}

/// Origin of emitted source, stated in its header.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// Subject of the source, in one line.
    pub title: &'a str,
    /// Maker of the expressions: an engine with its version, and the input of its derivation.
    pub maker: &'a str,
    /// The command that makes the source again.
    pub again: &'a str,
}

/// The header: origin, fingerprint of the expressions, and operations. Each line is a comment after
/// `mark`.
pub fn header(kernels: &[Kernel], origin: Origin<'_>, mark: &str) -> Result<String, String> {
    let fingerprint = fingerprint(kernels)
        .map_err(|error| format!("the expressions have no fingerprint: {error}"))?;
    let operations: usize = kernels
        .iter()
        .map(|kernel| count_operations(kernel).total())
        .sum();
    let Origin {
        title,
        maker,
        again,
    } = origin;
    let lines = format!(
        "{title}\nMade by {maker}; do not edit.\nSHA-256 of the expressions: {fingerprint}\n\
         To make it again: {again}\nOperations: {operations}."
    );
    Ok(comment(&lines, mark))
}

/// `text` as comment lines after `mark`.
pub fn comment(text: &str, mark: &str) -> String {
    text.lines()
        .map(|line| format!("{mark} {line}").trim_end().to_string() + "\n")
        .collect()
}
