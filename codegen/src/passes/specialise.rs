//! Specialisation: expressions with known values for some of their parts.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, Node, NodeId};
use crate::passes::normal_form::{Style, normalise};

/// Replaces each key of `values` by its value in `outputs`. The constructors of the graph simplify
/// the result.
pub fn substitute(
    graph: &mut Graph,
    outputs: &[NodeId],
    values: &BTreeMap<NodeId, NodeId>,
) -> Vec<NodeId> {
    rewrite(graph, outputs, |graph, id, node| {
        values.get(&id).copied().unwrap_or_else(|| graph.make(node))
    })
}

/// Replaces `S(1 − cos a)`, the energy of a spring with a known angle `a`, by `½ a²` in `outputs`.
///
/// Holds for `−π < a < π`. The argument of `S` need not have this form, but its normal form must.
pub fn angles_of_springs(graph: &mut Graph, outputs: &[NodeId]) -> Vec<NodeId> {
    rewrite(graph, outputs, |graph, _, node| {
        let Node::HalfAngleSquared(0, u) = node else {
            return graph.make(node);
        };
        let Some(angle) = angle_of_cosine(graph, u) else {
            return graph.make(node);
        };
        let (half, square) = (graph.ratio(1, 2), graph.powi(angle, 2));
        graph.mul(half, square)
    })
}

/// Returns the `a` of an expression that equals `1 − cos a`, if its normal form shows it.
fn angle_of_cosine(graph: &mut Graph, u: NodeId) -> Option<NodeId> {
    let normal = normalise(graph, &[u], Style::Cheap);
    let Node::Sub(one, cosine) = normal.graph.node(normal.outputs[0]) else {
        return None;
    };
    let Node::Cos(angle) = normal.graph.node(cosine) else {
        return None;
    };
    normal
        .graph
        .as_constant(one)?
        .is_one()
        .then(|| import(graph, &normal.graph, angle))
}

/// Copies a node of another graph, with the symbols of this one that have the same names.
fn import(graph: &mut Graph, source: &Graph, node: NodeId) -> NodeId {
    let mut images = BTreeMap::new();
    for id in source.reachable(&[node]) {
        let image = match source.node(id) {
            Node::Symbol(symbol) => {
                let symbol = &source.symbols()[symbol.index()];
                graph.symbol(&symbol.name, &symbol.notation, symbol.unit)
            }
            operation => graph.make(operation.map(|operand| images[&operand])),
        };
        images.insert(id, image);
    }
    images[&node]
}

/// Builds the `outputs` again, operands before users, under the names of the nodes that they
/// replace. `image` gives a node's image, from its own id and from the node with the images of its
/// operands.
fn rewrite(
    graph: &mut Graph,
    outputs: &[NodeId],
    mut image: impl FnMut(&mut Graph, NodeId, Node) -> NodeId,
) -> Vec<NodeId> {
    let mut images = BTreeMap::new();
    for id in graph.reachable(outputs) {
        let node = graph.node(id).map(|operand| images[&operand]);
        let result = image(graph, id, node);
        if let Some(name) = graph.name(id).map(str::to_owned) {
            graph.set_name(result, &name);
        }
        images.insert(id, result);
    }
    outputs.iter().map(|output| images[output]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::unit::Unit;

    #[test]
    fn parts_with_known_values_vanish() {
        let mut graph = Graph::new();
        let g = &mut graph;
        let [x, y] = ["x", "y"].map(|name| g.symbol(name, name, Unit::ONE));
        let (sin, cos) = (g.sin(x), g.cos(x));
        let (zero, one) = (g.integer(0), g.integer(1));
        let (left, right) = (g.mul(sin, y), g.mul(cos, y));
        let sum = g.add(left, right);
        assert_eq!(
            substitute(g, &[sum, x], &BTreeMap::from([(sin, one), (cos, zero)])),
            [y, x]
        );
    }

    #[test]
    fn the_chord_of_two_directions_in_a_plane_gives_their_angle() {
        let mut graph = Graph::new();
        let g = &mut graph;
        let [a, b] = ["a", "b"].map(|name| g.symbol(name, name, Unit::RADIAN));
        let direction = |g: &mut Graph, angle| [g.cos(angle), g.sin(angle)];
        let (from, to) = (direction(g, a), direction(g, b));
        let chord: Vec<NodeId> = (0..2).map(|i| g.sub(to[i], from[i])).collect();
        let (half, square) = (g.ratio(1, 2), g.dot(&chord, &chord));
        let u = g.mul(half, square);
        let energy = g.half_angle_squared(u);
        let [rewritten] = angles_of_springs(g, &[energy])[..] else {
            panic!("one output gives one")
        };
        for [angle, other] in [[0.3, 0.3], [0.1, 1.9], [-2.0, 1.1], [1.0, -2.1]] {
            let values = graph.evaluate(&[angle, other]);
            assert!((values[rewritten.index()] - 0.5 * (other - angle).powi(2)).abs() < 1e-15);
            // Towards the fold at π the energy depends more and more on the last digits of `u`.
            let fold = (0.5 * (other - angle)).cos();
            assert!((values[rewritten.index()] - values[energy.index()]).abs() < 4e-15 / fold);
        }
    }

    #[test]
    fn other_springs_keep_their_form() {
        let mut graph = Graph::new();
        let x = graph.symbol("x", "x", Unit::ONE);
        let energy = graph.half_angle_squared(x);
        assert_eq!(angles_of_springs(&mut graph, &[energy]), [energy]);
    }
}
