//! Differentiation: gradients by one reverse sweep, Jacobians and time derivatives by forward
//! sweeps.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, Node, NodeId};

/// The derivatives of node `id` with respect to its operands, in their order.
fn local_derivatives(graph: &mut Graph, id: NodeId) -> Vec<NodeId> {
    let one = graph.integer(1);
    match graph.node(id) {
        Node::Constant(_) | Node::Symbol(_) => Vec::new(),
        Node::Add(..) => vec![one, one],
        Node::Sub(..) => vec![one, graph.integer(-1)],
        Node::Mul(a, b) => vec![b, a],
        Node::Div(_, b) => {
            let inverse = graph.div(one, b);
            let slope = graph.div(id, b);
            vec![inverse, graph.neg(slope)]
        }
        Node::Neg(_) => vec![graph.integer(-1)],
        Node::Powi(a, exponent) => {
            let factor = graph.integer(exponent.into());
            let power = graph.powi(a, exponent - 1);
            vec![graph.mul(factor, power)]
        }
        Node::Sqrt(_) => {
            let half = graph.ratio(1, 2);
            vec![graph.div(half, id)]
        }
        Node::Sin(a) => vec![graph.cos(a)],
        Node::Cos(a) => {
            let sin = graph.sin(a);
            vec![graph.neg(sin)]
        }
        Node::Asin(a) => {
            let square = graph.powi(a, 2);
            let rest = graph.sub(one, square);
            let root = graph.sqrt(rest);
            vec![graph.div(one, root)]
        }
        Node::Exp(_) => vec![id],
        Node::Ln(a) => vec![graph.div(one, a)],
        Node::Tanh(_) => {
            let square = graph.powi(id, 2);
            vec![graph.sub(one, square)]
        }
        // Zero at the kink.
        Node::Abs(a) => {
            let zero = graph.integer(0);
            let (positive, negative) = (graph.less_than(zero, a), graph.less_than(a, zero));
            vec![graph.sub(positive, negative)]
        }
        Node::Atan2(a, b) => {
            let square = graph.dot(&[a, b], &[a, b]);
            let slope = graph.div(a, square);
            vec![graph.div(b, square), graph.neg(slope)]
        }
        Node::Pow(a, b) => {
            let lower = graph.sub(b, one);
            let power = graph.pow(a, lower);
            let logarithm = graph.ln(a);
            vec![graph.mul(b, power), graph.mul(id, logarithm)]
        }
        Node::LessThan(..) => {
            let zero = graph.integer(0);
            vec![zero, zero]
        }
        Node::HalfAngleSquared(order, a) => vec![graph.make(Node::HalfAngleSquared(order + 1, a))],
    }
}

/// The gradient of `function` with respect to `variables`.
///
/// One reverse sweep: the number of new nodes is a small multiple of those that `function` needs,
/// whatever the number of variables.
pub fn gradient(graph: &mut Graph, function: NodeId, variables: &[NodeId]) -> Vec<NodeId> {
    let needed = graph.reachable(&[function]);
    let depends = dependence(graph, &needed, variables);
    let mut adjoints: Vec<Option<NodeId>> = vec![None; depends.len()];
    if depends[function.index()] {
        adjoints[function.index()] = Some(graph.integer(1));
    }
    for &id in needed.iter().rev() {
        let Some(adjoint) = adjoints[id.index()] else {
            continue;
        };
        let slopes = local_derivatives(graph, id);
        for (operand, slope) in graph.node(id).operands().zip(slopes) {
            if depends[operand.index()] {
                let contribution = graph.mul(adjoint, slope);
                accumulate(graph, &mut adjoints[operand.index()], contribution);
            }
        }
    }
    let zero = graph.integer(0);
    variables
        .iter()
        .map(|variable| {
            adjoints
                .get(variable.index())
                .copied()
                .flatten()
                .unwrap_or(zero)
        })
        .collect()
}

fn accumulate(graph: &mut Graph, sum: &mut Option<NodeId>, term: NodeId) {
    *sum = Some(match *sum {
        None => term,
        Some(sum) => graph.add(sum, term),
    });
}

/// For each node, up to the last of the `needed` ones: `true` if it depends on one of `variables`.
fn dependence(graph: &Graph, needed: &[NodeId], variables: &[NodeId]) -> Vec<bool> {
    let mut depends = vec![false; needed.last().map_or(0, |last| last.index() + 1)];
    for variable in variables {
        if let Some(entry) = depends.get_mut(variable.index()) {
            *entry = true;
        }
    }
    for &id in needed {
        if graph
            .node(id)
            .operands()
            .any(|operand| depends[operand.index()])
        {
            depends[id.index()] = true;
        }
    }
    depends
}

/// The derivative of `outputs` along a direction: each key of `rates` changes at the rate of its
/// value.
pub fn directional_derivative(
    graph: &mut Graph,
    outputs: &[NodeId],
    rates: &BTreeMap<NodeId, NodeId>,
) -> Vec<NodeId> {
    let needed = graph.reachable(outputs);
    push_forward(graph, &needed, outputs, rates)
}

/// [`directional_derivative`], for outputs whose `needed` nodes are known.
fn push_forward(
    graph: &mut Graph,
    needed: &[NodeId],
    outputs: &[NodeId],
    rates: &BTreeMap<NodeId, NodeId>,
) -> Vec<NodeId> {
    let mut tangents: Vec<Option<NodeId>> =
        vec![None; needed.last().map_or(0, |last| last.index() + 1)];
    for (variable, &rate) in rates {
        if let Some(tangent) = tangents.get_mut(variable.index()) {
            *tangent = Some(rate);
        }
    }
    for &id in needed {
        let node = graph.node(id);
        if rates.contains_key(&id)
            || !node
                .operands()
                .any(|operand| tangents[operand.index()].is_some())
        {
            continue;
        }
        let slopes = local_derivatives(graph, id);
        let mut sum = None;
        for (operand, slope) in node.operands().zip(slopes) {
            if let Some(tangent) = tangents[operand.index()] {
                let contribution = graph.mul(slope, tangent);
                accumulate(graph, &mut sum, contribution);
            }
        }
        tangents[id.index()] = sum.filter(|&sum| !graph.is_zero(sum));
    }
    let zero = graph.integer(0);
    outputs
        .iter()
        .map(|output| tangents[output.index()].unwrap_or(zero))
        .collect()
}

/// The Jacobian of `outputs` (rows) with respect to `variables` (columns).
pub fn jacobian(graph: &mut Graph, outputs: &[NodeId], variables: &[NodeId]) -> Vec<Vec<NodeId>> {
    let needed = graph.reachable(outputs);
    let mut rows = vec![Vec::with_capacity(variables.len()); outputs.len()];
    let one = graph.integer(1);
    for &variable in variables {
        let column = push_forward(graph, &needed, outputs, &BTreeMap::from([(variable, one)]));
        for (row, entry) in rows.iter_mut().zip(column) {
            row.push(entry);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::unit::Unit;

    /// `f(x, y) = sin(x y)/(y² + cos(x y)) − √(x + S(y/4)) + |x − y|^tanh(x) atan2(exp y, ln x)`;
    /// `tests/emitted` tests every operator alone.
    fn example(graph: &mut Graph) -> (NodeId, [NodeId; 2]) {
        let (x, y) = (
            graph.symbol("x", "x", Unit::ONE),
            graph.symbol("y", "y", Unit::ONE),
        );
        let product = graph.mul(x, y);
        let sin = graph.sin(product);
        let cos = graph.cos(product);
        let square = graph.powi(y, 2);
        let denominator = graph.add(square, cos);
        let ratio = graph.div(sin, denominator);
        let quarter = graph.ratio(1, 4);
        let argument = graph.mul(quarter, y);
        let special = graph.half_angle_squared(argument);
        let under_root = graph.add(x, special);
        let root = graph.sqrt(under_root);
        let negative = graph.neg(root);
        let (difference, tanh) = (graph.sub(x, y), graph.tanh(x));
        let distance = graph.abs(difference);
        let (exp, ln) = (graph.exp(y), graph.ln(x));
        let (power, angle) = (graph.pow(distance, tanh), graph.atan2(exp, ln));
        let product = graph.mul(power, angle);
        let function = graph.sum([ratio, negative, product]);
        (function, [x, y])
    }

    /// Checks the table in docs/library.md of the points at which functions are singular.
    #[test]
    fn singular_points_are_as_declared() {
        let mut graph = Graph::new();
        let g = &mut graph;
        let [a, b] = ["a", "b"].map(|name| g.symbol(name, name, Unit::ONE));
        let third = g.ratio(1, 3);
        let functions = [g.abs(a), g.ln(a), g.pow(a, third), g.atan2(a, b)];
        let slopes = functions.map(|function| gradient(g, function, &[a])[0]);
        let at = |a: f64, b: f64| {
            let values = graph.evaluate(&[a, b]);
            [functions, slopes].map(|nodes| nodes.map(|node| values[node.index()]))
        };
        let [functions, slopes] = at(0.0, 0.0);
        assert_eq!(functions, [0.0, f64::NEG_INFINITY, 0.0, 0.0]);
        assert_eq!(slopes[..3], [0.0, f64::INFINITY, f64::INFINITY]);
        assert!(slopes[3].is_nan());
        let [functions, slopes] = at(-1.0, -1.0);
        assert_eq!([functions[0], slopes[0]], [1.0, -1.0]);
        assert!(functions[1].is_nan() && functions[2].is_nan());
        assert_eq!(slopes[3], -0.5);
        let [[.., above], [.., below]] = [1e-9, -1e-9].map(|a| at(a, -1.0)[0]);
        assert!((above - below - 2.0 * std::f64::consts::PI).abs() < 1e-8);
    }

    #[test]
    fn gradient_jacobian_and_differences_agree() {
        for mut graph in [Graph::new(), Graph::raw()] {
            let (function, variables) = example(&mut graph);
            let reverse = gradient(&mut graph, function, &variables);
            let forward = jacobian(&mut graph, &[function], &variables);
            assert_eq!(graph.validate(), Ok(()));
            let point = [0.7, 1.3];
            let values = graph.evaluate(&point);
            for (i, (&reverse, &forward)) in reverse.iter().zip(&forward[0]).enumerate() {
                let step = 1e-5;
                let at = |offset: f64| {
                    let mut shifted = point;
                    shifted[i] += offset;
                    graph.evaluate(&shifted)[function.index()]
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                assert!((values[reverse.index()] - difference).abs() < 1e-9);
                assert!((values[reverse.index()] - values[forward.index()]).abs() < 1e-14);
            }
        }
    }
}
