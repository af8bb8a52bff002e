//! Identities between the terms of a sum, and sums and products reduced by them.

use std::collections::BTreeSet;

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::passes::normal_form::sums::{Monomial, Sum, add_term, divide, multiply, times};

/// One identity between two terms of a sum.
pub struct SumRule {
    /// A short name, unique in the table.
    pub name: &'static str,
    /// Effect of the identity, as mathematics; `R` is any common factor.
    pub statement: &'static str,
    /// Its domain.
    pub domain: &'static str,
    /// Finds the partner of a term, and the terms that replace the two.
    apply: fn(&mut Graph, &Sum, &Monomial) -> Option<Rewrite>,
}

impl std::fmt::Debug for SumRule {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}: {}", self.name, self.statement)
    }
}

/// Terms to remove, and terms to add in their place.
struct Rewrite {
    removed: [Monomial; 2],
    added: Vec<(Monomial, Constant)>,
}

/// The identities that [`normalise`](super::normalise) applies to the terms of a sum.
///
/// Each reduces the number of trigonometric factors, so that rewriting ends.
pub const SUM_RULES: &[SumRule] = &[
    SumRule {
        name: "pythagoras",
        statement: "a R sin²x + b R cos²x → b R + (a − b) R sin²x",
        domain: "a and b of one sign",
        apply: pythagoras,
    },
    SumRule {
        name: "cosine-of-difference",
        statement: "a R cos x cos y ± a R sin x sin y → a R cos(x ∓ y)",
        domain: "everywhere",
        apply: cosine_of_difference,
    },
    SumRule {
        name: "sine-of-difference",
        statement: "a R sin x cos y ± a R cos x sin y → a R sin(x ± y)",
        domain: "everywhere",
        apply: sine_of_difference,
    },
];

/// The factors `function(x)` of a monomial with an exponent of at least `least`, each with its
/// argument `x`.
fn factors(
    graph: &Graph,
    monomial: &Monomial,
    least: i32,
    function: fn(NodeId) -> Node,
) -> Vec<(NodeId, NodeId)> {
    let factors = monomial.iter().filter(|&&(_, exponent)| exponent >= least);
    let with_argument = |&(atom, _): &(NodeId, i32)| {
        let argument = graph.node(atom).operands().next()?;
        (graph.node(atom) == function(argument)).then_some((atom, argument))
    };
    factors.filter_map(with_argument).collect()
}

fn pythagoras(graph: &mut Graph, sum: &Sum, term: &Monomial) -> Option<Rewrite> {
    let squares = [
        factors(graph, term, 2, Node::Cos),
        factors(graph, term, 2, Node::Sin),
    ]
    .concat();
    for (function, x) in squares {
        let (sin, cos) = (graph.sin(x), graph.cos(x));
        let rest = divide(term, &[function, function]);
        let (sines, cosines) = (times(&rest, &[sin, sin]), times(&rest, &[cos, cos]));
        let (Some(&a), Some(&b)) = (sum.get(&sines), sum.get(&cosines)) else {
            continue;
        };
        if a.is_negative() != b.is_negative() {
            continue;
        }
        let added = vec![(rest, b), (sines.clone(), a + -b)];
        return Some(Rewrite {
            removed: [sines, cosines],
            added,
        });
    }
    None
}

/// `x − y` or `y − x`, in a fixed order, and `true` for `y − x`.
fn difference(graph: &mut Graph, x: NodeId, y: NodeId) -> (NodeId, bool) {
    if x < y {
        (graph.sub(x, y), false)
    } else {
        (graph.sub(y, x), true)
    }
}

fn cosine_of_difference(graph: &mut Graph, sum: &Sum, term: &Monomial) -> Option<Rewrite> {
    for factors in [
        factors(graph, term, 1, Node::Cos),
        factors(graph, term, 1, Node::Sin),
    ] {
        for (i, &(function_x, x)) in factors.iter().enumerate() {
            for &(function_y, y) in &factors[i + 1..] {
                let rest = divide(term, &[function_x, function_y]);
                let [cos_x, cos_y] = [x, y].map(|angle| graph.cos(angle));
                let [sin_x, sin_y] = [x, y].map(|angle| graph.sin(angle));
                let (cosines, sines) =
                    (times(&rest, &[cos_x, cos_y]), times(&rest, &[sin_x, sin_y]));
                let (Some(&a), Some(&b)) = (sum.get(&cosines), sum.get(&sines)) else {
                    continue;
                };
                let argument = if a == b {
                    difference(graph, x, y).0
                } else if a == -b {
                    graph.add(x, y)
                } else {
                    continue;
                };
                let cos = graph.cos(argument);
                return Some(Rewrite {
                    removed: [cosines, sines],
                    added: vec![(times(&rest, &[cos]), a)],
                });
            }
        }
    }
    None
}

fn sine_of_difference(graph: &mut Graph, sum: &Sum, term: &Monomial) -> Option<Rewrite> {
    for (sin_x, x) in factors(graph, term, 1, Node::Sin) {
        for (cos_y, y) in factors(graph, term, 1, Node::Cos) {
            if x == y {
                continue;
            }
            let rest = divide(term, &[sin_x, cos_y]);
            let (cos_x, sin_y) = (graph.cos(x), graph.sin(y));
            let partner = times(&rest, &[cos_x, sin_y]);
            let (a, Some(&b)) = (sum[term], sum.get(&partner)) else {
                continue;
            };
            let (argument, flipped) = if a == -b {
                difference(graph, x, y)
            } else if a == b {
                (graph.add(x, y), false)
            } else {
                continue;
            };
            let sin = graph.sin(argument);
            let added = vec![(times(&rest, &[sin]), if flipped { -a } else { a })];
            return Some(Rewrite {
                removed: [term.clone(), partner],
                added,
            });
        }
    }
    None
}

/// Applies [`SUM_RULES`] until none applies to a term of `pending`.
///
/// The rules find a pair from either of its terms, so terms without a new partner need no visit.
fn reduce(graph: &mut Graph, mut sum: Sum, mut pending: BTreeSet<Monomial>) -> Sum {
    while let Some(term) = pending.pop_first() {
        if !sum.contains_key(&term) {
            continue;
        }
        let rewrite = SUM_RULES
            .iter()
            .find_map(|rule| (rule.apply)(graph, &sum, &term));
        let Some(Rewrite { removed, added }) = rewrite else {
            continue;
        };
        for monomial in removed {
            sum.remove(&monomial);
        }
        for (monomial, coefficient) in added {
            add_term(&mut sum, monomial.clone(), coefficient);
            pending.insert(monomial);
        }
    }
    sum
}

/// `a + factor × b` of two reduced sums, reduced.
///
/// The shorter sum is added to the longer one in place, so that a chain of additions costs no more
/// than the terms that it adds.
pub(super) fn add_reduced(graph: &mut Graph, a: Sum, factor: i64, mut b: Sum) -> Sum {
    let factor = Constant::from(factor);
    b.values_mut()
        .for_each(|coefficient| *coefficient = *coefficient * factor);
    let (mut sum, small) = if a.len() < b.len() { (b, a) } else { (a, b) };
    let pending = small.keys().cloned().collect();
    for (monomial, coefficient) in small {
        add_term(&mut sum, monomial, coefficient);
    }
    reduce(graph, sum, pending)
}

/// `a b`, reduced.
pub(super) fn multiply_reduced(graph: &mut Graph, a: &Sum, b: &Sum) -> Sum {
    let mut product = Sum::new();
    for (x, &c) in a {
        for (y, &d) in b {
            add_term(&mut product, multiply(x, y), c * d);
        }
    }
    let pending = product.keys().cloned().collect();
    reduce(graph, product, pending)
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;
    use crate::ir::unit::Unit;

    fn value(graph: &Graph, sum: &Sum, point: &[f64]) -> f64 {
        let values = graph.evaluate(point);
        let term = |(monomial, coefficient): (&Monomial, &Constant)| {
            let factors = monomial
                .iter()
                .map(|&(atom, exponent)| values[atom.index()].powi(exponent));
            coefficient.value() * factors.product::<f64>()
        };
        sum.iter().map(term).sum()
    }

    /// Applies each identity to sums with other terms among them, at random values.
    #[test]
    fn every_sum_rule_fires_and_keeps_the_value() {
        let mut rng = Rng::with_seed(5);
        for rule in SUM_RULES {
            let mut graph = Graph::new();
            let g = &mut graph;
            let [x, y, r] = ["x", "y", "r"].map(|name| g.symbol(name, name, Unit::ONE));
            let ([sin_x, sin_y], [cos_x, cos_y]) =
                ([x, y].map(|a| g.sin(a)), [x, y].map(|a| g.cos(a)));
            let product = |factors: &[NodeId]| times(&vec![(r, 2)], factors);
            let (a, b) = (Constant::ratio(3, 2), Constant::ratio(1, 2));
            let pairs = [
                ([sin_x, sin_x], a, [cos_x, cos_x], b),
                ([sin_x, sin_x], -b, [cos_x, cos_x], -a),
                ([cos_x, cos_y], a, [sin_x, sin_y], a),
                ([cos_x, cos_y], a, [sin_x, sin_y], -a),
                ([sin_x, cos_y], b, [cos_x, sin_y], -b),
                ([sin_x, cos_y], b, [cos_x, sin_y], b),
                ([sin_y, cos_x], -b, [cos_y, sin_x], b),
            ];
            let mut fired = 0;
            for (first, a, second, b) in pairs {
                let sum = Sum::from([
                    (product(&first), a),
                    (product(&second), b),
                    (product(&[sin_x]), a),
                ]);
                for term in sum.keys() {
                    let Some(Rewrite { removed, added }) = (rule.apply)(&mut graph, &sum, term)
                    else {
                        continue;
                    };
                    fired += 1;
                    let mut rewritten = sum.clone();
                    for monomial in removed {
                        assert!(
                            rewritten.remove(&monomial).is_some(),
                            "{rule:?} removes what is there"
                        );
                    }
                    for (monomial, coefficient) in added {
                        add_term(&mut rewritten, monomial, coefficient);
                    }
                    for _ in 0..100 {
                        let point = [0; 3].map(|_| 6.0 * rng.f64() - 3.0);
                        let (expected, result) = (
                            value(&graph, &sum, &point),
                            value(&graph, &rewritten, &point),
                        );
                        assert!(
                            (expected - result).abs() < 1e-13,
                            "{rule:?} at {point:?}: {expected} {result}"
                        );
                    }
                }
            }
            assert!(fired > 0, "{rule:?} never applies");
        }
    }
}
