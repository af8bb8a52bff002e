//! Kernels as JSON: what another program needs to evaluate, compare or draw the expressions.
//!
//! A file holds one or more kernels. A kernel is a list of operations in single assignment, operands before users;
//! a number in an operand's place is the index of an earlier operation. The format carries a version.

use serde::Serialize;

use crate::constant::Constant;
use crate::graph::{Graph, Node, NodeId};
use crate::kernels::{Kernel, Shape};

/// The version of the format that [`to_json`] writes.
pub const VERSION: u32 = 1;

#[derive(Serialize)]
struct File<'a> {
    format: &'static str,
    version: u32,
    kernels: Vec<KernelEntry<'a>>,
}

#[derive(Serialize)]
struct KernelEntry<'a> {
    name: &'a str,
    summary: &'a str,
    inputs: Vec<InputEntry<'a>>,
    operations: Vec<Operation<'a>>,
    outputs: Vec<OutputEntry<'a>>,
}

#[derive(Serialize)]
struct InputEntry<'a> {
    name: &'a str,
    doc: &'a str,
    elements: Vec<(&'a str, usize)>,
}

#[derive(Serialize)]
struct OutputEntry<'a> {
    name: &'a str,
    doc: &'a str,
    shape: Vec<usize>,
    operations: Vec<usize>,
}

/// One operation; `["add", 3, 4]` is the sum of operations 3 and 4.
#[derive(Serialize)]
#[serde(untagged)]
enum Operation<'a> {
    Symbol(&'static str, &'a str, &'a str),
    Rational(&'static str, i64, i64),
    Float(&'static str, f64),
    Unary(&'static str, usize),
    Binary(&'static str, usize, usize),
    Power(&'static str, usize, i32),
    Derivative(&'static str, usize, u8),
}

/// The kernels as JSON, an operation a line. The same kernels give the same bytes.
pub fn to_json(kernels: &[Kernel]) -> serde_json::Result<String> {
    let file = File { format: "bristle-graph", version: VERSION, kernels: kernels.iter().map(entry).collect() };
    let mut text = serde_json::to_string(&file)?;
    text.push('\n');
    Ok(text)
}

fn entry(kernel: &Kernel) -> KernelEntry<'_> {
    let roots = kernel.outputs.iter().flat_map(|output| output.nodes.iter().copied());
    let arguments = kernel.inputs.iter().flat_map(|input| input.elements.iter().map(|(_, node)| *node));
    let live = kernel.graph.reachable(&roots.chain(arguments).collect::<Vec<_>>());
    let mut positions = vec![0; live.last().map_or(0, |id| id.index() + 1)];
    for (position, id) in live.iter().enumerate() {
        positions[id.index()] = position;
    }
    let position = |id: NodeId| positions[id.index()];
    let inputs = kernel.inputs.iter().map(|input| InputEntry {
        name: &input.name,
        doc: &input.doc,
        elements: input.elements.iter().map(|(name, node)| (name.as_str(), position(*node))).collect(),
    });
    let outputs = kernel.outputs.iter().map(|output| OutputEntry {
        name: &output.name,
        doc: &output.doc,
        shape: match output.shape {
            Shape::Scalar => vec![],
            Shape::Vector(length) => vec![length],
            Shape::Matrix(rows, columns) => vec![rows, columns],
        },
        operations: output.nodes.iter().copied().map(position).collect(),
    });
    KernelEntry {
        name: &kernel.name,
        summary: &kernel.summary,
        inputs: inputs.collect(),
        operations: live.iter().map(|&id| operation(&kernel.graph, id, position)).collect(),
        outputs: outputs.collect(),
    }
}

fn operation(graph: &Graph, id: NodeId, position: impl Fn(NodeId) -> usize) -> Operation<'_> {
    match graph.node(id) {
        Node::Constant(Constant::Rational(value)) => Operation::Rational("rational", *value.numer(), *value.denom()),
        Node::Constant(Constant::Float(value)) => Operation::Float("float", value),
        Node::Symbol(symbol) => {
            let symbol = &graph.symbols()[symbol.index()];
            Operation::Symbol("symbol", &symbol.name, &symbol.notation)
        }
        Node::Add(a, b) => Operation::Binary("add", position(a), position(b)),
        Node::Sub(a, b) => Operation::Binary("sub", position(a), position(b)),
        Node::Mul(a, b) => Operation::Binary("mul", position(a), position(b)),
        Node::Div(a, b) => Operation::Binary("div", position(a), position(b)),
        Node::Neg(a) => Operation::Unary("neg", position(a)),
        Node::Powi(a, exponent) => Operation::Power("powi", position(a), exponent),
        Node::Sqrt(a) => Operation::Unary("sqrt", position(a)),
        Node::Sin(a) => Operation::Unary("sin", position(a)),
        Node::Cos(a) => Operation::Unary("cos", position(a)),
        Node::HalfAngleSquared(order, a) => Operation::Derivative("half_angle_squared", position(a), order),
    }
}
