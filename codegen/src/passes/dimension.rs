//! Checks of SI dimensions: the terms of a sum have the same dimension, a function takes a number,
//! an output has its unit.
//!
//! The symbols of the graph carry units. The result is nothing, or the first inconsistent term.

use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Output, output_nodes};
use crate::ir::unit::Dimension;
use crate::ir::writer::excerpt;

/// A term with inconsistent dimensions.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DimensionError {
    /// Terms of different dimensions are added, subtracted or compared.
    #[error(
        "`{left_term}` is {left} and `{right_term}` is {right}: they cannot be combined in `{term}`"
    )]
    Mismatch {
        /// The sum.
        term: String,
        /// Its left side.
        left_term: String,
        /// Dimension of the left side.
        left: Dimension,
        /// Its right side.
        right_term: String,
        /// Dimension of the right side.
        right: Dimension,
    },
    /// A function of numbers takes something else.
    #[error("`{argument}` is {dimension}, but `{term}` is defined for numbers only")]
    Argument {
        /// The function with its argument.
        term: String,
        /// The argument.
        argument: String,
        /// Dimension of the argument.
        dimension: Dimension,
    },
    /// A power or root has no dimension with whole exponents.
    #[error("`{term}` has no dimension with whole exponents: its operand is {dimension}")]
    Power {
        /// The term.
        term: String,
        /// Dimension of its operand.
        dimension: Dimension,
    },
    /// An output does not have the dimension of its unit.
    #[error("output `{output}` is stated in {unit} but is {dimension}: `{term}`")]
    Output {
        /// Name of the output.
        output: String,
        /// The unit that it is stated in.
        unit: String,
        /// The dimension that it has.
        dimension: Dimension,
        /// The expression.
        term: String,
    },
}

/// Checks everything that `outputs` need, and their units.
///
/// # Errors
/// The first inconsistent term, operands before users.
pub fn check(graph: &Graph, outputs: &[Output]) -> Result<(), DimensionError> {
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
                let term = excerpt(graph, node);
                let (output, unit) = (output.name.clone(), output.unit.to_string());
                return Err(DimensionError::Output {
                    output,
                    unit,
                    dimension,
                    term,
                });
            }
        }
    }
    Ok(())
}

/// The dimension of a node; none for zero, which has every dimension.
fn dimension(
    graph: &Graph,
    id: NodeId,
    dimensions: &[Option<Dimension>],
) -> Result<Option<Dimension>, DimensionError> {
    let of = |operand: NodeId| dimensions[operand.index()];
    let number = |argument: NodeId| match of(argument) {
        None | Some(Dimension::NONE) => Ok(Some(Dimension::NONE)),
        Some(dimension) => {
            let (term, argument) = (excerpt(graph, id), excerpt(graph, argument));
            Err(DimensionError::Argument {
                term,
                argument,
                dimension,
            })
        }
    };
    let whole = |result: Option<Dimension>, operand: Dimension| {
        result.ok_or_else(|| DimensionError::Power {
            term: excerpt(graph, id),
            dimension: operand,
        })
    };
    match graph.node(id) {
        Node::Constant(value) => Ok((!value.is_zero()).then_some(Dimension::NONE)),
        Node::Symbol(symbol) => Ok(Some(graph.symbols()[symbol.index()].unit.dimension())),
        Node::Add(a, b) | Node::Sub(a, b) | Node::LessThan(a, b) => {
            if let (Some(left), Some(right)) = (of(a), of(b))
                && left != right
            {
                let [term, left_term, right_term] = [id, a, b].map(|node| excerpt(graph, node));
                return Err(DimensionError::Mismatch {
                    term,
                    left_term,
                    left,
                    right_term,
                    right,
                });
            }
            let compared = matches!(graph.node(id), Node::LessThan(..));
            Ok(if compared {
                Some(Dimension::NONE)
            } else {
                of(a).or(of(b))
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
        Node::Sqrt(a) => of(a).map(|square| whole(square.sqrt(), square)).transpose(),
        Node::Sin(a) | Node::Cos(a) | Node::Asin(a) | Node::HalfAngleSquared(_, a) => number(a),
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
        check(&graph, &[output])
            .expect_err("the term makes no sense")
            .to_string()
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
