//! What the forms for programs share: origin, errors, operations, and which expressions get a name.

use std::collections::{BTreeMap, BTreeSet};

use crate::back::json::fingerprint;
use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Kernel, computed_operands};

/// Why a kernel cannot be emitted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmitError {
    /// An output needs a symbol that no input provides.
    #[error("kernel `{kernel}` uses `{symbol}`, which is not one of its inputs")]
    UnboundSymbol {
        /// Name of the kernel.
        kernel: String,
        /// Name of the symbol.
        symbol: String,
    },
    /// A constant is infinite or not a number.
    #[error("kernel `{kernel}` holds the constant {value}, which is not finite")]
    NonFiniteConstant {
        /// Name of the kernel.
        kernel: String,
        /// The constant.
        value: String,
    },
    /// The expressions cannot be written as JSON, on which their fingerprint is based.
    #[error("the expressions have no fingerprint: {0}")]
    Fingerprint(String),
    /// The tokens are not valid Rust: a defect of the emitter.
    #[error("the emitted code does not parse: {0}")]
    Syntax(String),
}

/// How many operations a kernel takes; a shared one counts once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperationCount {
    /// Additions, subtractions and changes of sign.
    pub additions: usize,
    /// Multiplications, squares included.
    pub multiplications: usize,
    /// Divisions.
    pub divisions: usize,
    /// Square roots, sines, cosines, arc sines, comparisons, and evaluations of `S` and its derivatives.
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
        let Self { additions, multiplications, divisions, functions } = self;
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
            | Node::LessThan(..)
            | Node::HalfAngleSquared(..) => count.functions += 1,
        }
    }
    count
}

/// What the header of emitted source says about its origin.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// What the source computes, in one line.
    pub title: &'a str,
    /// What made the expressions: an engine with its version, and what it derived them from.
    pub maker: &'a str,
    /// The command that makes the source again.
    pub again: &'a str,
}

/// The header: origin, fingerprint of the expressions, and operations. Each line is a comment after `mark`.
pub(crate) fn header(kernels: &[Kernel], origin: Origin<'_>, mark: &str) -> Result<String, EmitError> {
    let fingerprint = fingerprint(kernels).map_err(|error| EmitError::Fingerprint(error.to_string()))?;
    let operations: usize = kernels.iter().map(|kernel| count_operations(kernel).total()).sum();
    let Origin { title, maker, again } = origin;
    let lines = format!(
        "{title}\nMade by {maker}; do not edit.\nSHA-256 of the expressions: {fingerprint}\n\
         To make it again: {again}\nOperations: {operations}."
    );
    Ok(comment(&lines, mark))
}

/// `text` as comment lines after `mark`.
pub(crate) fn comment(text: &str, mark: &str) -> String {
    text.lines().map(|line| format!("{mark} {line}").trim_end().to_string() + "\n").collect()
}

/// How expressions are written in a language.
pub(crate) trait Language {
    /// A piece of source that stands for a value.
    type Expression: Clone + 'static;

    /// An element of an input, by its local name.
    fn given(&self, name: &str) -> Self::Expression;

    /// A finite constant.
    fn constant(&self, constant: Constant) -> Self::Expression;

    /// An operation on operands that `of` returns. It is neither a constant nor a symbol, and no power of zero.
    fn operation<'a>(&self, node: Node, of: &dyn Fn(NodeId) -> &'a Self::Expression) -> Self::Expression;

    /// Writes the statement that gives an intermediate its value, and returns what stands for it.
    fn intermediate(&mut self, number: usize, value: Self::Expression) -> Result<Self::Expression, EmitError>;
}

/// Expressions deeper than this are cut by an intermediate, for the reader and for the parser's stack.
const MAX_DEPTH: usize = 6;

/// How often each node is an operand or an output of `kernel`.
pub(crate) fn uses(kernel: &Kernel) -> BTreeMap<NodeId, usize> {
    let mut uses: BTreeMap<NodeId, usize> = BTreeMap::new();
    let operands = kernel.computed().into_iter().flat_map(|id| computed_operands(kernel.graph.node(id)));
    for operand in operands.chain(kernel.output_nodes()) {
        *uses.entry(operand).or_default() += 1;
    }
    uses
}

/// Writes the intermediates of `kernel`, whose nodes have these [`uses`], in a language, and returns the expressions of its outputs by their nodes.
///
/// What is used more than once gets a name, and so does the base of a power, which a product repeats. A constant is as short as a name.
///
/// # Errors
/// If an output needs a symbol that no input provides, or a constant is not finite.
pub(crate) fn write_body<L: Language>(
    kernel: &Kernel,
    uses: &BTreeMap<NodeId, usize>,
    language: &mut L,
) -> Result<BTreeMap<NodeId, L::Expression>, EmitError> {
    if let Some(symbol) = kernel.unbound_symbol() {
        return Err(EmitError::UnboundSymbol { kernel: kernel.name.clone(), symbol: symbol.into() });
    }
    let mut uses_left = uses.clone();
    let mut depths: BTreeMap<NodeId, usize> = BTreeMap::new();
    let elements = kernel.inputs.iter().flat_map(|input| &input.elements);
    let mut expressions: BTreeMap<NodeId, L::Expression> =
        elements.map(|(name, node)| (*node, language.given(name))).collect();
    let order = kernel.computed();
    let bases: BTreeSet<NodeId> = order.iter().filter_map(|&id| base_of_power(&kernel.graph, id)).collect();
    let mut names = 0;
    for id in order {
        let node = kernel.graph.node(id);
        let expression = match node {
            Node::Constant(constant) if !constant.value().is_finite() => {
                let value = constant.value().to_string();
                return Err(EmitError::NonFiniteConstant { kernel: kernel.name.clone(), value });
            }
            Node::Constant(constant) => language.constant(constant),
            Node::Powi(_, 0) => language.constant(Constant::from(1)),
            Node::Symbol(_) => unreachable!("the symbols of a kernel are given"),
            _ => language.operation(node, &|operand| &expressions[&operand]),
        };
        for operand in computed_operands(node) {
            // Expressions are dropped after their last use.
            let left = uses_left.get_mut(&operand).expect("every operand is counted");
            *left -= 1;
            if *left == 0 {
                expressions.remove(&operand);
            }
        }
        let depth = 1 + computed_operands(node).filter_map(|operand| depths.get(&operand)).max().unwrap_or(&0);
        let shared = uses[&id] > 1 || depth > MAX_DEPTH || bases.contains(&id);
        if shared && !matches!(node, Node::Constant(_)) {
            expressions.insert(id, language.intermediate(names, expression)?);
            names += 1;
        } else {
            expressions.insert(id, expression);
            depths.insert(id, depth);
        }
    }
    Ok(expressions)
}

fn base_of_power(graph: &Graph, id: NodeId) -> Option<NodeId> {
    match graph.node(id) {
        Node::Powi(base, exponent) => (exponent != 0).then_some(base),
        _ => None,
    }
}
