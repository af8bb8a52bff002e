//! Checks of SI dimensions: the terms of a sum have the same dimension, a function takes a number,
//! an output has its unit.
//!
//! The symbols of the graph carry units. The result is the first inconsistent term, if any.

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Output, output_nodes};
use crate::ir::unit::Dimension;
use crate::ir::writer::excerpt;

/// Checks everything that `outputs` need, and their units.
///
/// # Errors
/// The first inconsistent term, operands before users.
pub fn check(graph: &Graph, outputs: &[Output]) -> Result<(), String> {
    let needed = graph.reachable(&output_nodes(outputs));
    let mut dimensions: Vec<Option<Dimension>> =
        vec![None; needed.last().map_or(0, |last| last.index() + 1)];
    for id in needed {
        dimensions[id.index()] = dimension(graph, id, &dimensions)?;
    }
    for output in outputs {
        for &node in &output.nodes {
            if let Some(dimension) = dimensions[node.index()]
                && dimension != output.unit.dimension()
            {
                return Err(format!(
                    "output `{}` is stated in {} but is {dimension}: `{}`",
                    output.name,
                    output.unit,
                    excerpt(graph, node)
                ));
            }
        }
    }
    Ok(())
}

/// The dimension of a node; `None` for zero, which has every dimension.
fn dimension(
    graph: &Graph,
    id: NodeId,
    dimensions: &[Option<Dimension>],
) -> Result<Option<Dimension>, String> {
    let of = |operand: NodeId| dimensions[operand.index()];
    let number = |argument: NodeId| match of(argument) {
        None | Some(Dimension::NONE) => Ok(Some(Dimension::NONE)),
        Some(dimension) => {
            let [term, argument] = [id, argument].map(|node| excerpt(graph, node));
            Err(format!(
                "`{argument}` is {dimension}, but `{term}` is defined for numbers only"
            ))
        }
    };
    let whole = |result: Option<Dimension>, operand: Dimension| {
        result.ok_or_else(|| {
            let term = excerpt(graph, id);
            format!("`{term}` has no dimension with whole exponents: its operand is {operand}")
        })
    };
    match graph.node(id) {
        Node::Constant(value) => Ok((!value.is_zero()).then_some(Dimension::NONE)),
        Node::Symbol(symbol) => Ok(Some(graph.symbols()[symbol.index()].unit.dimension())),
        Node::Add(a, b) | Node::Sub(a, b) | Node::Atan2(a, b) | Node::LessThan(a, b) => {
            if let (Some(left), Some(right)) = (of(a), of(b))
                && left != right
            {
                let [term, left_term, right_term] = [id, a, b].map(|node| excerpt(graph, node));
                return Err(format!(
                    "`{left_term}` is {left} and `{right_term}` is {right}: they cannot be \
                     combined in `{term}`"
                ));
            }
            Ok(match graph.node(id) {
                Node::Atan2(..) | Node::LessThan(..) => Some(Dimension::NONE),
                _ => of(a).or(of(b)),
            })
        }
        Node::Mul(a, b) => of(a)
            .zip(of(b))
            .map(|(left, right)| whole(left.times(right), left))
            .transpose(),
        Node::Div(a, b) => of(a)
            .zip(of(b))
            .map(|(above, below)| whole(above.per(below), above))
            .transpose(),
        Node::Neg(a) => Ok(of(a)),
        Node::Powi(_, 0) => Ok(Some(Dimension::NONE)),
        Node::Powi(a, exponent) => of(a)
            .map(|base| whole(base.powi(exponent), base))
            .transpose(),
        Node::Sqrt(a) => of(a)
            .map(|square| whole(square.root(2), square))
            .transpose(),
        Node::Abs(a) => Ok(of(a)),
        Node::Sin(a)
        | Node::Cos(a)
        | Node::Asin(a)
        | Node::Exp(a)
        | Node::Ln(a)
        | Node::Tanh(a)
        | Node::HalfAngleSquared(_, a) => number(a),
        Node::Pow(a, b) => {
            number(b)?;
            match (of(a), graph.as_constant(b)) {
                (Some(base), Some(Constant::Rational(exponent))) if base != Dimension::NONE => {
                    let [power, degree] = [*exponent.numer(), *exponent.denom()].map(i32::try_from);
                    let root = power.ok().zip(degree.ok()).and_then(|(power, degree)| {
                        base.powi(power).and_then(|power| power.root(degree))
                    });
                    whole(root, base).map(Some)
                }
                _ => number(a),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::unit::Unit;

    fn message(build: impl FnOnce(&mut Graph, NodeId, NodeId) -> NodeId) -> String {
        let mut graph = Graph::raw();
        let length = graph.symbol("segment_length", "h", Unit::METRE);
        let angle = graph.symbol("phi_1", "φ1", Unit::RADIAN);
        let node = build(&mut graph, length, angle);
        let output = Output::scalar("force", "", Unit::NEWTON, node);
        check(&graph, &[output]).expect_err("the term makes no sense")
    }

    #[test]
    fn a_length_added_to_an_angle_is_shown() {
        let text = message(|graph, length, angle| {
            let sine = graph.sin(angle);
            let sum = graph.add(length, angle);
            graph.mul(sine, sum)
        });
        assert_eq!(
            text,
            "`h` is m and `φ1` is a number: they cannot be combined in `h + φ1`"
        );
    }

    #[test]
    fn arguments_roots_and_outputs_are_checked() {
        let text = message(|graph, length, _| graph.sin(length));
        assert_eq!(text, "`h` is m, but `sin h` is defined for numbers only");
        let text = message(|graph, length, _| graph.sqrt(length));
        assert_eq!(
            text,
            "`√(h)` has no dimension with whole exponents: its operand is m"
        );
        let text = message(|graph, length, angle| graph.pow(length, angle));
        assert_eq!(text, "`h` is m, but `h^φ1` is defined for numbers only");
        let text = message(|graph, length, _| {
            let exponent = graph.ratio(2, 3);
            graph.pow(length, exponent)
        });
        assert!(text.contains("whole exponents"), "{text}");
        let text = message(|graph, length, _| {
            let (cube, exponent) = (graph.powi(length, 3), graph.ratio(2, 3));
            graph.pow(cube, exponent)
        });
        assert_eq!(text, "output `force` is stated in N but is m²: `(h³)^(⅔)`");
        let text = message(|graph, length, angle| graph.atan2(length, angle));
        assert!(text.contains("cannot be combined"), "{text}");
        let text =
            message(|graph, length, _| (0..40).fold(length, |power, _| graph.powi(power, 8)));
        assert!(text.contains("whole exponents"), "{text}");
        let text = message(|graph, length, angle| graph.mul(length, angle));
        assert_eq!(text, "output `force` is stated in N but is m: `h φ1`");
    }

    #[test]
    fn zero_has_any_dimension_and_deep_terms_are_cut() {
        let text = message(|graph, length, _| {
            let zero = graph.integer(0);
            graph.add(zero, length)
        });
        assert!(text.contains("`0 + h`"), "{text}");
        let text = message(|graph, length, angle| {
            let deep = (0..100_000).fold(angle, |term, _| graph.sin(term));
            graph.sub(deep, length)
        });
        assert!(text.len() < 300 && text.contains('…'), "{text}");
    }
}
