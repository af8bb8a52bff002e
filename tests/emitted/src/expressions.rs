//! Random expressions.

use bristle_codegen::ir::graph::{Graph, NodeId};
use bristle_codegen::ir::unit::Unit;

/// An instruction of a random expression; operands are taken modulo the number of nodes that exist.
///
/// A function that is not defined everywhere gets an argument from its domain.
#[derive(Clone, Debug)]
pub enum Instruction {
    /// A rational number.
    Constant(i64, i64),
    /// `a + b`
    Add(usize, usize),
    /// `a − b`
    Sub(usize, usize),
    /// `a b`
    Mul(usize, usize),
    /// `a / (1 + b²)`
    Div(usize, usize),
    /// `−a`
    Neg(usize),
    /// `a^k`
    Powi(usize, i32),
    /// `(1 + a²)^−k`
    InversePower(usize, i32),
    /// `√(1 + a²)`
    Sqrt(usize),
    /// `sin a`
    Sin(usize),
    /// `cos a`
    Cos(usize),
    /// `asin(½ sin a)`
    Asin(usize),
    /// `exp(sin a)`
    Exp(usize),
    /// `ln(1 + a²)`
    Ln(usize),
    /// `tanh a`
    Tanh(usize),
    /// `|a|`
    Abs(usize),
    /// `atan2(a, 1 + b²)`
    Atan2(usize, usize),
    /// `(1 + a²)^(cos b)`
    Pow(usize, usize),
    /// `[a < b + 1/7]`; the offset keeps the sides from being equal up to rounding
    LessThan(usize, usize),
    /// `S(sin²a)`
    HalfAngleSquared(usize),
}

/// Names of the variables of a random expression, and the ranges in which it is evaluated.
pub const VARIABLES: [(&str, std::ops::Range<f64>); 3] =
    [("x", 0.1..2.0), ("y", -2.0..-0.1), ("z", 0.3..1.7)];

/// The variables as symbols of `graph`.
pub fn variables(graph: &mut Graph) -> Vec<NodeId> {
    VARIABLES
        .iter()
        .map(|(name, _)| graph.symbol(name, name, Unit::ONE))
        .collect()
}

/// Builds the expression; the last node is its result.
pub fn build(graph: &mut Graph, program: &[Instruction]) -> NodeId {
    let mut nodes = variables(graph);
    for instruction in program {
        let at = |index: usize| nodes[index % nodes.len()];
        let node = match *instruction {
            Instruction::Constant(a, b) => graph.ratio(a, b),
            Instruction::Add(a, b) => graph.add(at(a), at(b)),
            Instruction::Sub(a, b) => graph.sub(at(a), at(b)),
            Instruction::Mul(a, b) => graph.mul(at(a), at(b)),
            Instruction::Div(a, b) => {
                let denominator = one_and_square(graph, at(b));
                graph.div(at(a), denominator)
            }
            Instruction::Neg(a) => graph.neg(at(a)),
            Instruction::Powi(a, k) => graph.powi(at(a), k),
            Instruction::InversePower(a, k) => {
                let base = one_and_square(graph, at(a));
                graph.powi(base, -k)
            }
            Instruction::Sqrt(a) => {
                let square = one_and_square(graph, at(a));
                graph.sqrt(square)
            }
            Instruction::Sin(a) => graph.sin(at(a)),
            Instruction::Cos(a) => graph.cos(at(a)),
            Instruction::Asin(a) => {
                let (half, sin) = (graph.ratio(1, 2), graph.sin(at(a)));
                let argument = graph.mul(half, sin);
                graph.asin(argument)
            }
            Instruction::Exp(a) => {
                let sin = graph.sin(at(a));
                graph.exp(sin)
            }
            Instruction::Ln(a) => {
                let argument = one_and_square(graph, at(a));
                graph.ln(argument)
            }
            Instruction::Tanh(a) => graph.tanh(at(a)),
            Instruction::Abs(a) => graph.abs(at(a)),
            Instruction::Atan2(a, b) => {
                let x = one_and_square(graph, at(b));
                graph.atan2(at(a), x)
            }
            Instruction::Pow(a, b) => {
                let (base, exponent) = (one_and_square(graph, at(a)), graph.cos(at(b)));
                graph.pow(base, exponent)
            }
            Instruction::LessThan(a, b) => {
                let offset = graph.ratio(1, 7);
                let right = graph.add(at(b), offset);
                graph.less_than(at(a), right)
            }
            Instruction::HalfAngleSquared(a) => {
                let sin = graph.sin(at(a));
                let u = graph.powi(sin, 2);
                graph.half_angle_squared(u)
            }
        };
        nodes.push(node);
    }
    nodes[nodes.len() - 1]
}

fn one_and_square(graph: &mut Graph, a: NodeId) -> NodeId {
    let (one, square) = (graph.integer(1), graph.powi(a, 2));
    graph.add(one, square)
}

/// The value of an expression, and the largest of its intermediates, whose rounding it carries.
pub fn value(graph: &Graph, node: NodeId, point: &[f64]) -> (f64, f64) {
    let values = graph.evaluate(point);
    let needed = graph.reachable(&[node]);
    let largest = needed
        .iter()
        .map(|id| values[id.index()].abs())
        .fold(1.0, f64::max);
    (values[node.index()], largest)
}
