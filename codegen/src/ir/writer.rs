//! Expressions as text, one at a time, in a given [`Notation`].

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::notation::{ATOM, Notation, POWER, PRODUCT, QUOTIENT, SUM, Text, Written};
use crate::ir::unit::Unit;

/// Writes the expressions of one graph.
///
/// Sums and products of any length are written without recursion. Other operations recurse once per
/// level, so that callers must cut deep expressions by names.
pub struct Writer<'a> {
    graph: &'a Graph,
    notation: &'a dyn Notation,
    /// Names of nodes, by index; empty for the others.
    names: Vec<String>,
}

impl<'a> Writer<'a> {
    /// A writer without names.
    pub fn new(graph: &'a Graph, notation: &'a dyn Notation) -> Self {
        Self {
            graph,
            notation,
            names: vec![String::new(); graph.nodes().len()],
        }
    }

    /// Writes `id` as `name` from now on.
    pub fn set_name(&mut self, id: NodeId, name: String) {
        self.names[id.index()] = name;
    }

    /// The name of `id`; empty if it has none.
    pub fn name(&self, id: NodeId) -> &str {
        &self.names[id.index()]
    }

    fn is_named(&self, id: NodeId) -> bool {
        !self.names[id.index()].is_empty()
    }

    /// The expression at `id`: its name, or else its operation.
    pub fn expression(&self, id: NodeId) -> Written {
        match self.is_named(id) {
            true => Written::new(self.names[id.index()].clone(), ATOM),
            false => self.operation(id),
        }
    }

    /// The operation at `id`, with or without a name.
    pub fn operation(&self, id: NodeId) -> Written {
        let of = |id, context| self.expression(id).within(context);
        let minus = self.notation.minus();
        match self.graph.node(id) {
            Node::Constant(value) => self.notation.constant(value),
            Node::Symbol(symbol) => Written::new(
                self.notation
                    .symbol(&self.graph.symbols()[symbol.index()].notation),
                ATOM,
            ),
            Node::Add(..) | Node::Sub(..) => Written::new(self.sum(id), SUM),
            Node::Neg(a) => Written::new(format!("{minus}{}", of(a, QUOTIENT)), SUM),
            Node::Mul(a, b) => match self.graph.as_constant(a) {
                Some(factor) if factor.is_negative() && self.notation.is_mathematics() => {
                    let rest = match factor.is_minus_one() {
                        true => String::new(),
                        false => format!("{} ", self.notation.number(-factor)),
                    };
                    Written::new(format!("{minus}{rest}{}", of(b, PRODUCT)), SUM)
                }
                _ => Written::new(self.product(id), PRODUCT),
            },
            Node::Div(a, b) => self
                .notation
                .quotient(self.expression(a), self.expression(b)),
            // The base may not be computed.
            Node::Powi(_, 0) if !self.notation.is_mathematics() => {
                self.notation.constant(Constant::from(1))
            }
            Node::Powi(a, exponent) => self.power(a, exponent),
            Node::Sqrt(a) => Written::new(self.notation.root(&of(a, 0)), POWER),
            Node::Sin(a) => self.function("sin", 1, a),
            Node::Cos(a) => self.function("cos", 1, a),
            Node::Asin(a) => self.function("asin", 1, a),
            Node::Exp(a) => self.function("exp", 1, a),
            Node::Ln(a) => self.function("ln", 1, a),
            Node::Tanh(a) => self.function("tanh", 1, a),
            Node::Abs(a) => Written::new(self.notation.magnitude(self.expression(a)), POWER),
            Node::Atan2(a, b) => {
                let arguments = Written::new(format!("{}, {}", of(a, 0), of(b, 0)), SUM);
                Written::new(self.notation.function("atan2", 1, arguments), POWER)
            }
            Node::Pow(a, b) => {
                let (base, exponent) = (self.expression(a), self.expression(b));
                Written::new(self.notation.real_power(base, exponent), POWER)
            }
            Node::LessThan(a, b) => {
                let (a, b) = (self.expression(a), self.expression(b));
                Written::new(self.notation.less_than(a, b), POWER)
            }
            Node::HalfAngleSquared(order, a) => {
                Written::new(self.notation.half_angle_squared(order, &of(a, 0)), POWER)
            }
        }
    }

    /// `true` for an operand that is written as a part of the sum or product `top`.
    fn continues(&self, top: NodeId, id: NodeId) -> bool {
        id == top || (self.notation.is_mathematics() && !self.is_named(id))
    }

    /// Writes the terms with their signs. There is no recursion, because a sum can have more terms
    /// than fit on the stack.
    fn sum(&self, top: NodeId) -> String {
        let mut text = String::new();
        let mut pending = vec![(top, false)];
        while let Some((id, negative)) = pending.pop() {
            match self.graph.node(id) {
                Node::Add(a, b) if self.continues(top, id) => {
                    pending.extend([(b, negative), (a, negative)])
                }
                Node::Sub(a, b) if self.continues(top, id) => {
                    pending.extend([(b, !negative), (a, negative)])
                }
                _ => {
                    let minus = self.notation.minus();
                    let first = text.is_empty() && !negative;
                    let term = self
                        .expression(id)
                        .within(if first { SUM } else { QUOTIENT });
                    match (text.is_empty(), negative) {
                        (true, false) => {}
                        (true, true) => text.push(minus),
                        (false, false) => text.push_str(" + "),
                        (false, true) => text.extend([' ', minus, ' ']),
                    }
                    text.push_str(&term);
                }
            }
        }
        text
    }

    /// Writes the factors in the customary order: numbers, symbols, functions, sums.
    fn product(&self, top: NodeId) -> String {
        let mut factors = Vec::new();
        let mut pending = vec![top];
        while let Some(id) = pending.pop() {
            match self.graph.node(id) {
                Node::Mul(a, b) if self.continues(top, id) => pending.extend([b, a]),
                _ => factors.push(id),
            }
        }
        if let ([a, b], false) = (&factors[..], self.notation.is_mathematics()) {
            let (a, b) = (self.expression(*a), self.expression(*b));
            return format!("{} * {}", a.within(PRODUCT), b.within(POWER));
        }
        let is_one = |factor: NodeId| self.graph.as_constant(factor).is_some_and(Constant::is_one);
        if !factors.iter().all(|&factor| is_one(factor)) {
            factors.retain(|&factor| !is_one(factor));
        }
        factors.sort_by_key(|&factor| self.rank(factor));
        let several = factors.len() > 1;
        let write = |equal: &[NodeId]| match equal {
            [factor] if several => self.expression(*factor).within(PRODUCT),
            [factor] => self.expression(*factor).within(QUOTIENT),
            _ => self.power(equal[0], equal.len() as i32).text,
        };
        factors
            .chunk_by(|a, b| a == b)
            .map(write)
            .collect::<Vec<_>>()
            .join(" ")
    }

    fn rank(&self, factor: NodeId) -> (u8, NodeId) {
        let rank = match self.graph.node(factor) {
            _ if self.is_named(factor) => 1,
            Node::Constant(_) => 0,
            Node::Symbol(_) => 1,
            Node::Powi(base, _) => return (self.rank(base).0, base),
            Node::HalfAngleSquared(..) => 2,
            Node::Add(..) | Node::Sub(..) | Node::Neg(_) | Node::Mul(..) | Node::Div(..) => 4,
            _ => 3,
        };
        (rank, factor)
    }

    fn function(&self, name: &str, exponent: i32, argument: NodeId) -> Written {
        let argument = self.expression(argument);
        Written::new(self.notation.function(name, exponent, argument), POWER)
    }

    /// Writes the positive exponent of a sine, cosine or hyperbolic tangent after its name; `sin⁻¹`
    /// would be read as an arc sine.
    fn power(&self, base: NodeId, exponent: i32) -> Written {
        match self.graph.node(base) {
            Node::Sin(argument) if exponent > 0 && !self.is_named(base) => {
                self.function("sin", exponent, argument)
            }
            Node::Cos(argument) if exponent > 0 && !self.is_named(base) => {
                self.function("cos", exponent, argument)
            }
            Node::Tanh(argument) if exponent > 0 && !self.is_named(base) => {
                self.function("tanh", exponent, argument)
            }
            _ => self
                .notation
                .raised(&self.expression(base).within(ATOM), exponent),
        }
    }
}

/// Maximum depth of the operations of an [`excerpt`], and maximum number of its characters.
const EXCERPT_DEPTH: usize = 5;
const EXCERPT_LENGTH: usize = 120;

/// Writes the outer operations of `id` as text, for messages; an ellipsis marks an omission.
pub fn excerpt(graph: &Graph, id: NodeId) -> String {
    let mut copy = Graph::raw();
    let top = copy_levels(graph, id, &mut copy, EXCERPT_DEPTH);
    let text = Writer::new(&copy, &Text).expression(top).text;
    if text.chars().count() <= EXCERPT_LENGTH {
        return text;
    }
    text.chars().take(EXCERPT_LENGTH).chain(['…']).collect()
}

fn copy_levels(graph: &Graph, id: NodeId, copy: &mut Graph, levels: usize) -> NodeId {
    match graph.node(id) {
        Node::Symbol(symbol) => {
            let symbol = &graph.symbols()[symbol.index()];
            copy.symbol(&symbol.name, &symbol.notation, symbol.unit)
        }
        node if levels == 0 && node.operands().next().is_some() => copy.symbol("…", "…", Unit::ONE),
        node => {
            let node =
                node.map(|operand| copy_levels(graph, operand, copy, levels.saturating_sub(1)));
            copy.intern(node)
        }
    }
}
