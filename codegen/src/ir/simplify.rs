//! Simplification of single operations: rewriting rules with names and side conditions.
//!
//! The constructors of a [`Graph`] apply [`RULES`] to each operation and its operands, so that no
//! trivial operation enters it. A graph itself knows no rules: it carries the table of its
//! constructor.

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, MAX_EXPONENT, Node, NodeId, RewriteRule};

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// An empty graph whose constructors simplify by [`RULES`].
    pub fn new() -> Self {
        Self::with_rules(RULES)
    }
}

/// The rules that a graph's constructors apply, in this order.
///
/// Each has a name, its effect and its domain. A rule makes the expression smaller or brings it
/// closer to a canonical order, so that rewriting ends.
pub const RULES: &[RewriteRule] = &[
    rule(
        "fold-constants",
        "operation on constants → its value",
        "finite results",
        fold_constants,
    ),
    rule(
        "add-zero",
        "a + 0 → a, a − 0 → a, 0 − a → −a, a − a → 0",
        "everywhere",
        add_zero,
    ),
    rule(
        "mul-unit",
        "0 a → 0, 1 a → a, −1 a → −a, a/1 → a, 0/a → 0",
        "a finite, a ≠ 0 as a divisor",
        mul_unit,
    ),
    rule(
        "power-unit",
        "a^0 → 1, a^1 → a, (a^j)^k → a^(jk)",
        "a ≠ 0 where j < 0 < k or k = 0",
        power_unit,
    ),
    rule(
        "pull-sign",
        "−(−a) → a, −(a − b) → b − a, (−a) b → −(a b), a + (−b) → a − b, a − (−b) → a + b",
        "everywhere",
        pull_sign,
    ),
    rule(
        "pull-constant",
        "a c → c a, c (d a) → (c d) a, (c a) b → c (a b), −(c a) → (−c) a",
        "c, d constant",
        pull_constant,
    ),
    rule(
        "like-terms",
        "c a + d a → (c + d) a",
        "c, d constant",
        like_terms,
    ),
    rule(
        "same-base",
        "a^j a^k → a^(j+k)",
        "a ≠ 0 where j k < 0",
        same_base,
    ),
    rule(
        "parity",
        "sin(−a) → −sin a, cos(−a) → cos a, |−a| → |a|; asin, tanh and atan2 as sin",
        "everywhere",
        parity,
    ),
    rule(
        "magnitude",
        "||a|| → |a|, |c a| → |c| |a|, |a|^(2k) → a^(2k)",
        "c constant",
        magnitude,
    ),
    rule(
        "inverse-function",
        "ln(exp a) → a, exp(ln a) → a",
        "a > 0 in ln a",
        inverse_function,
    ),
    rule(
        "real-power",
        "a^b → a^k for an integer b = k, a^½ → √a, (a^b)^c → a^(b c)",
        "a > 0",
        real_power,
    ),
    rule(
        "order-operands",
        "b + a → a + b, b a → a b",
        "a created before b",
        order_operands,
    ),
];

const fn rule(
    name: &'static str,
    statement: &'static str,
    domain: &'static str,
    apply: fn(&mut Graph, Node) -> Option<NodeId>,
) -> RewriteRule {
    RewriteRule {
        name,
        statement,
        domain,
        apply,
    }
}

fn fold_constants(graph: &mut Graph, node: Node) -> Option<NodeId> {
    let value = |id| graph.as_constant(id);
    let result = match node {
        Node::Add(a, b) => value(a)? + value(b)?,
        Node::Sub(a, b) => value(a)? + -value(b)?,
        Node::Mul(a, b) => value(a)? * value(b)?,
        Node::Div(a, b) => value(a)? * value(b)?.recip()?,
        Node::Neg(a) => -value(a)?,
        Node::Powi(a, exponent) => value(a)?.powi(exponent)?,
        Node::LessThan(a, b) => Constant::from(i64::from(value(a)?.value() < value(b)?.value())),
        Node::Sin(a) | Node::Asin(a) | Node::Tanh(a) if graph.is_zero(a) => Constant::from(0),
        Node::Cos(a) | Node::Exp(a) if graph.is_zero(a) => Constant::from(1),
        Node::Ln(a) if value(a)?.is_one() => Constant::from(0),
        Node::Pow(a, _) if value(a)?.is_one() => Constant::from(1),
        Node::Atan2(a, b) if graph.is_zero(a) && value(b)?.value() > 0.0 => Constant::from(0),
        Node::Abs(a) => value(a)?.abs(),
        _ => return None,
    };
    result.value().is_finite().then(|| graph.constant(result))
}

fn add_zero(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Add(a, b) if graph.is_zero(a) => Some(b),
        Node::Add(a, b) | Node::Sub(a, b) if graph.is_zero(b) => Some(a),
        Node::Sub(a, b) if graph.is_zero(a) => Some(graph.neg(b)),
        Node::Sub(a, b) if a == b => Some(graph.integer(0)),
        _ => None,
    }
}

fn mul_unit(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Mul(a, b) => [(a, b), (b, a)].into_iter().find_map(|(factor, other)| {
            let factor = graph.as_constant(factor)?;
            if factor.is_zero() {
                Some(graph.integer(0))
            } else if factor.is_one() {
                Some(other)
            } else {
                factor.is_minus_one().then(|| graph.neg(other))
            }
        }),
        Node::Div(a, _) if graph.is_zero(a) => Some(a),
        Node::Div(a, b) => {
            let inverse = graph.as_constant(b)?.recip()?;
            let inverse = graph.constant(inverse);
            Some(graph.mul(inverse, a))
        }
        _ => None,
    }
}

fn power_unit(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Powi(_, 0) => Some(graph.integer(1)),
        Node::Powi(a, 1) => Some(a),
        Node::Powi(a, outer) => match graph.node(a) {
            Node::Powi(base, inner) => Some(graph.powi(base, inner.checked_mul(outer)?)),
            _ => None,
        },
        _ => None,
    }
}

fn negated(graph: &Graph, id: NodeId) -> Option<NodeId> {
    match graph.node(id) {
        Node::Neg(a) => Some(a),
        _ => None,
    }
}

fn pull_sign(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Neg(a) => match graph.node(a) {
            Node::Neg(b) => Some(b),
            Node::Sub(b, c) => Some(graph.sub(c, b)),
            _ => None,
        },
        Node::Mul(a, b) | Node::Div(a, b) => match (negated(graph, a), negated(graph, b)) {
            (None, None) => None,
            (Some(a), Some(b)) => Some(remake(graph, node, a, b)),
            (positive_a, positive_b) => {
                let positive = remake(
                    graph,
                    node,
                    positive_a.unwrap_or(a),
                    positive_b.unwrap_or(b),
                );
                Some(graph.neg(positive))
            }
        },
        Node::Add(a, b) => match (negated(graph, a), negated(graph, b)) {
            (_, Some(b)) => Some(graph.sub(a, b)),
            (Some(a), None) => Some(graph.sub(b, a)),
            (None, None) => None,
        },
        Node::Sub(a, b) => negated(graph, b).map(|b| graph.add(a, b)),
        Node::Powi(a, exponent) => {
            let power = graph.powi(negated(graph, a)?, exponent);
            Some(if exponent % 2 == 0 {
                power
            } else {
                graph.neg(power)
            })
        }
        _ => None,
    }
}

/// Applies the operation `like` to the operands `a` and `b`.
fn remake(graph: &mut Graph, like: Node, a: NodeId, b: NodeId) -> NodeId {
    let mut operands = [a, b].into_iter();
    graph.make(like.map(|_| {
        operands
            .next()
            .expect("a binary operation has two operands")
    }))
}

/// Splits `id` into `coefficient × body`, where the coefficient is an explicit constant factor.
pub(crate) fn split_coefficient(graph: &Graph, id: NodeId) -> (Constant, NodeId) {
    match graph.node(id) {
        Node::Neg(a) => (Constant::from(-1), a),
        Node::Mul(a, b) => graph
            .as_constant(a)
            .map_or((Constant::from(1), id), |factor| (factor, b)),
        _ => (Constant::from(1), id),
    }
}

/// Builds `coefficient × body` through the graph's rules.
pub(crate) fn scaled(graph: &mut Graph, coefficient: Constant, body: NodeId) -> NodeId {
    let coefficient = graph.constant(coefficient);
    graph.mul(coefficient, body)
}

fn pull_constant(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Mul(a, b) if graph.as_constant(b).is_some() => Some(graph.mul(b, a)),
        Node::Mul(a, b) => {
            let ((c, x), (d, y)) = (split_coefficient(graph, a), split_coefficient(graph, b));
            if let Some(factor) = graph.as_constant(a) {
                return (!d.is_one()).then(|| scaled(graph, factor * d, y));
            }
            if c.is_one() && d.is_one() {
                return None;
            }
            let product = graph.mul(x, y);
            Some(scaled(graph, c * d, product))
        }
        Node::Neg(a) => {
            let (c, x) = split_coefficient(graph, a);
            (!c.is_one()).then(|| scaled(graph, -c, x))
        }
        _ => None,
    }
}

fn like_terms(graph: &mut Graph, node: Node) -> Option<NodeId> {
    let (a, b, sign) = match node {
        Node::Add(a, b) => (a, b, Constant::from(1)),
        Node::Sub(a, b) => (a, b, Constant::from(-1)),
        _ => return None,
    };
    let ((c, x), (d, y)) = (split_coefficient(graph, a), split_coefficient(graph, b));
    (x == y).then(|| scaled(graph, c + sign * d, x))
}

fn same_base(graph: &mut Graph, node: Node) -> Option<NodeId> {
    let Node::Mul(a, b) = node else { return None };
    let power = |id| match graph.node(id) {
        Node::Powi(base, exponent) => (base, exponent),
        _ => (id, 1),
    };
    let ((x, j), (y, k)) = (power(a), power(b));
    if x != y {
        return None;
    }
    Some(graph.powi(x, j.checked_add(k)?))
}

fn parity(graph: &mut Graph, node: Node) -> Option<NodeId> {
    let value = match node {
        Node::Atan2(a, b) => {
            let positive = negated(graph, a)?;
            graph.atan2(positive, b)
        }
        Node::Sin(a) | Node::Cos(a) | Node::Asin(a) | Node::Tanh(a) | Node::Abs(a) => {
            let positive = negated(graph, a)?;
            graph.make(node.map(|_| positive))
        }
        _ => return None,
    };
    Some(if let Node::Cos(_) | Node::Abs(_) = node {
        value
    } else {
        graph.neg(value)
    })
}

fn magnitude(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Abs(a) if matches!(graph.node(a), Node::Abs(_)) => Some(a),
        Node::Abs(a) => {
            let (factor, body) = split_coefficient(graph, a);
            let rest = (body != a).then(|| graph.abs(body))?;
            Some(scaled(graph, factor.abs(), rest))
        }
        Node::Powi(a, exponent) if exponent % 2 == 0 => match graph.node(a) {
            Node::Abs(base) => Some(graph.powi(base, exponent)),
            _ => None,
        },
        _ => None,
    }
}

fn inverse_function(graph: &mut Graph, node: Node) -> Option<NodeId> {
    let (Node::Ln(outer) | Node::Exp(outer)) = node else {
        return None;
    };
    match (node, graph.node(outer)) {
        (Node::Ln(_), Node::Exp(a)) | (Node::Exp(_), Node::Ln(a)) => Some(a),
        _ => None,
    }
}

fn real_power(graph: &mut Graph, node: Node) -> Option<NodeId> {
    let (base, outer) = match node {
        Node::Pow(base, outer) => (base, outer),
        Node::Powi(base, exponent) if matches!(graph.node(base), Node::Pow(..)) => {
            (base, graph.integer(exponent.into()))
        }
        _ => return None,
    };
    if let Node::Pow(base, inner) = graph.node(base) {
        let exponent = graph.mul(inner, outer);
        return Some(graph.pow(base, exponent));
    }
    let exponent = graph.as_constant(outer)?;
    if exponent == Constant::ratio(1, 2) {
        return Some(graph.sqrt(base));
    }
    let exponent = exponent.integer().filter(|k| k.abs() <= MAX_EXPONENT)?;
    Some(graph.powi(base, exponent))
}

fn order_operands(graph: &mut Graph, node: Node) -> Option<NodeId> {
    match node {
        Node::Add(a, b) if b < a => Some(graph.add(b, a)),
        // A constant stays in front, see `pull-constant`.
        Node::Mul(a, b) if b < a && graph.as_constant(a).is_none() => Some(graph.mul(b, a)),
        _ => None,
    }
}
