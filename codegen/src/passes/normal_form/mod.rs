//! Sums of products over atoms: expanded, reduced by identities between terms, and factored again.

mod rules;
mod sums;

use std::collections::{BTreeMap, BTreeSet};

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::simplify::{scaled, split_coefficient};
pub use rules::{SUM_RULES, SumRule};
use rules::{add_reduced, multiply_reduced};
use sums::{
    Monomial, Sum, common_factor, common_magnitude, constant_sum, divide, exponent_of,
    frequent_factor, multiply, scale, single, unit_of,
};

/// Purpose of the sums of products.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style<'a> {
    /// For readers: every product is multiplied out, and the terms are collected by their powers of
    /// these symbols of the source (the constants of the model) and of `S`.
    Collected(&'a [NodeId]),
    /// For computing: a product is multiplied out only where the reduced sum costs no more
    /// operations, and frequent factors are taken out.
    Cheap,
}

/// Number of terms beyond which [`Style::Cheap`] discards an expanded form.
const MAX_SPECULATIVE_TERMS: usize = 96;

/// A source node as a sum of products, in two forms.
#[derive(Clone)]
struct Sums {
    /// Form with products of sums kept as products of atoms.
    compact: Sum,
    /// Form with products of sums multiplied out, where it differs.
    other: Option<Sum>,
}

impl Sums {
    fn single(sum: Sum) -> Self {
        Self {
            compact: sum,
            other: None,
        }
    }

    fn expanded(&self) -> &Sum {
        self.other.as_ref().unwrap_or(&self.compact)
    }
}

/// The forms of the nodes of a source, each kept until its last use: a sum of many terms has a
/// partial sum for each of them.
struct Forms {
    forms: Vec<Option<Sums>>,
    /// Number of uses to come of each form, by index.
    uses: Vec<usize>,
}

impl Forms {
    /// Creates an empty table for a `source` whose nodes `needed` lead to the `outputs`.
    fn new(source: &Graph, needed: &[NodeId], outputs: &[NodeId]) -> Self {
        let mut uses = vec![0; source.nodes().len()];
        let operands = needed.iter().flat_map(|&id| source.node(id).operands());
        operands
            .chain(outputs.iter().copied())
            .for_each(|id| uses[id.index()] += 1);
        Self {
            forms: vec![None; uses.len()],
            uses,
        }
    }

    fn of(&self, id: NodeId) -> &Sums {
        self.forms[id.index()]
            .as_ref()
            .expect("operands come first")
    }

    /// Counts a use of the form.
    fn release(&mut self, id: NodeId) {
        self.uses[id.index()] -= 1;
        if self.uses[id.index()] == 0 {
            self.forms[id.index()] = None;
        }
    }

    /// Uses the form: moves it out at its last use, otherwise copies it.
    fn take(&mut self, id: NodeId) -> Sums {
        self.uses[id.index()] -= 1;
        let form = &mut self.forms[id.index()];
        if self.uses[id.index()] == 0 {
            form.take()
        } else {
            form.clone()
        }
        .expect("operands come first")
    }
}

/// The result of [`normalise`].
#[derive(Clone, Debug)]
pub struct Normalised {
    /// The graph with the outputs; its symbols and names are those of the source.
    pub graph: Graph,
    /// The outputs, in the order asked for.
    pub outputs: Vec<NodeId>,
}

/// Rewrites `outputs` as sums of products: like terms collected, trigonometric identities applied,
/// common factors taken out.
pub fn normalise(source: &Graph, outputs: &[NodeId], style: Style<'_>) -> Normalised {
    let graph = source.with_same_symbols();
    let collected = match style {
        Style::Cheap => None,
        Style::Collected(symbols) => {
            let names = symbols
                .iter()
                .filter_map(|&symbol| source.symbol_name(symbol));
            Some(names.filter_map(|name| graph.find_symbol(name)).collect())
        }
    };
    let mut normaliser = Normaliser {
        graph,
        collected,
        costs: BTreeMap::new(),
    };
    let needed = source.reachable(outputs);
    let mut forms = Forms::new(source, &needed, outputs);
    let mut named = Vec::new();
    for id in needed {
        let form = normaliser.form(source, source.node(id), &mut forms);
        if let Some(name) = source.name(id) {
            named.push((name, form.compact.clone()));
        }
        forms.forms[id.index()] = Some(form);
    }
    let outputs = outputs
        .iter()
        .map(|&output| normaliser.build(&forms.take(output).compact))
        .collect();
    // Names come last, so that they do not change the order of the nodes.
    for (name, sum) in named {
        let node = normaliser.build(&sum);
        normaliser.graph.set_name(node, name);
    }
    Normalised {
        graph: normaliser.graph,
        outputs,
    }
}

struct Normaliser {
    graph: Graph,
    /// The symbols to collect by, in the form for readers.
    collected: Option<BTreeSet<NodeId>>,
    /// Number of operations of each atom that represents a sum.
    costs: BTreeMap<NodeId, usize>,
}

impl Normaliser {
    fn form(&mut self, source: &Graph, node: Node, forms: &mut Forms) -> Sums {
        if let Node::Add(a, b) | Node::Sub(a, b) = node {
            let (a, b) = (forms.take(a), forms.take(b));
            return self.combine(a, if matches!(node, Node::Add(..)) { 1 } else { -1 }, b);
        }
        let form = self.form_of_operation(source, node, forms);
        node.operands().for_each(|operand| forms.release(operand));
        form
    }

    /// The form of any node but a sum or difference.
    fn form_of_operation(&mut self, source: &Graph, node: Node, forms: &Forms) -> Sums {
        let of = |id: NodeId| forms.of(id);
        match node {
            Node::Constant(value) => Sums::single(constant_sum(value)),
            Node::Symbol(symbol) => {
                let symbol = &source.symbols()[symbol.index()];
                let atom = self
                    .graph
                    .symbol(&symbol.name, &symbol.notation, symbol.unit);
                self.atom(atom)
            }
            Node::Add(..) | Node::Sub(..) => unreachable!("sums take the forms of their terms"),
            Node::Neg(a) => {
                let minus = Constant::from(-1);
                let Sums { compact, other } = of(a);
                Sums {
                    compact: scale(compact, minus),
                    other: other.as_ref().map(|sum| scale(sum, minus)),
                }
            }
            Node::Mul(a, b) => self.product(of(a), of(b)),
            Node::Div(a, b) => {
                let inverse = self.inverse_power(of(b), 1);
                self.product(of(a), &inverse)
            }
            Node::Powi(a, exponent) if exponent < 0 => self.inverse_power(of(a), -exponent),
            Node::Powi(a, exponent) => {
                let mut power = Sums::single(constant_sum(Constant::from(1)));
                for _ in 0..exponent {
                    power = self.product(&power, of(a));
                }
                power
            }
            Node::Sqrt(_)
            | Node::Sin(_)
            | Node::Cos(_)
            | Node::Asin(_)
            | Node::Exp(_)
            | Node::Ln(_)
            | Node::Tanh(_)
            | Node::Abs(_)
            | Node::Atan2(..)
            | Node::Pow(..)
            | Node::LessThan(..)
            | Node::HalfAngleSquared(..) => {
                let function = node.map(|operand| self.build(&of(operand).compact));
                let atom = self.graph.make(function);
                self.atom(atom)
            }
        }
    }

    fn atom(&mut self, atom: NodeId) -> Sums {
        // A constructor may have folded a function into a constant or pulled out a factor.
        if let Some(value) = self.graph.as_constant(atom) {
            return Sums::single(constant_sum(value));
        }
        let (factor, atom) = split_coefficient(&self.graph, atom);
        Sums::single(Sum::from([(vec![(atom, 1)], factor)]))
    }

    fn inverse_power(&mut self, base: &Sums, exponent: i32) -> Sums {
        if let Some((monomial, coefficient)) = single(&base.compact)
            && let Some(inverse) = coefficient.powi(-exponent)
        {
            let monomial = monomial
                .iter()
                .map(|&(atom, power)| (atom, -power * exponent))
                .collect();
            return Sums::single(Sum::from([(monomial, inverse)]));
        }
        let atom = self.build(&base.compact);
        Sums::single(Sum::from([(vec![(atom, -exponent)], Constant::from(1))]))
    }

    fn combine(&mut self, a: Sums, factor: i64, b: Sums) -> Sums {
        if a.other.is_none() && b.other.is_none() {
            return Sums::single(add_reduced(&mut self.graph, a.compact, factor, b.compact));
        }
        let [a_expanded, b_expanded] = [&a, &b].map(|form| form.expanded().clone());
        let compact = add_reduced(&mut self.graph, a.compact, factor, b.compact);
        let expanded = add_reduced(&mut self.graph, a_expanded, factor, b_expanded);
        self.cheaper(compact, expanded)
    }

    fn product(&mut self, a: &Sums, b: &Sums) -> Sums {
        let expanded = multiply_reduced(&mut self.graph, a.expanded(), b.expanded());
        if self.collected.is_some() {
            return Sums::single(expanded);
        }
        let (a, b) = (self.as_factor(&a.compact), self.as_factor(&b.compact));
        let compact = multiply_reduced(&mut self.graph, &a, &b);
        self.cheaper(compact, expanded)
    }

    /// Makes a sum of several terms one atom, so that it is not multiplied out.
    fn as_factor(&mut self, sum: &Sum) -> Sum {
        if sum.len() < 2 {
            return sum.clone();
        }
        let cost = self.cost(sum);
        let node = self.build(sum);
        let (coefficient, atom) = split_coefficient(&self.graph, node);
        self.costs.insert(atom, cost);
        Sum::from([(vec![(atom, 1)], coefficient)])
    }

    fn cheaper(&mut self, compact: Sum, expanded: Sum) -> Sums {
        if expanded == compact || self.cost(&expanded) <= self.cost(&compact) {
            return Sums::single(expanded);
        }
        if expanded.len() > MAX_SPECULATIVE_TERMS {
            return Sums::single(compact);
        }
        Sums {
            compact,
            other: Some(expanded),
        }
    }

    /// Number of additions and multiplications; each atom that represents a sum counts once.
    fn cost(&self, sum: &Sum) -> usize {
        let mut atoms = BTreeSet::new();
        let mut operations = sum.len().saturating_sub(1);
        for (monomial, coefficient) in sum {
            let factors: usize = monomial
                .iter()
                .map(|&(_, exponent)| exponent.unsigned_abs() as usize)
                .sum();
            let scaled = usize::from(!coefficient.is_one() && !coefficient.is_minus_one());
            operations += (factors + scaled).saturating_sub(1);
            atoms.extend(monomial.iter().map(|&(atom, _)| atom));
        }
        operations
            + atoms
                .iter()
                .filter_map(|atom| self.costs.get(atom))
                .sum::<usize>()
    }

    /// Builds the node of a sum, with common factors taken out.
    fn build(&mut self, sum: &Sum) -> NodeId {
        if sum.len() < 2 {
            return match single(sum) {
                None => self.graph.integer(0),
                Some((monomial, coefficient)) => {
                    let product = self.build_monomial(monomial);
                    scaled(&mut self.graph, coefficient, product)
                }
            };
        }
        if let Some(symbols) = &self.collected {
            let groups = collect(&self.graph, symbols, sum);
            return self.build_groups(groups);
        }
        let unit = unit_of(sum);
        if !unit.is_one() {
            let primitive = scale(sum, unit.recip().expect("coefficients are not zero"));
            let rest = self.build(&primitive);
            return scaled(&mut self.graph, unit, rest);
        }
        let Some(factor) = frequent_factor(sum) else {
            return self.build_terms(sum);
        };
        let (with, without): (Sum, Sum) = sum
            .iter()
            .map(|(m, &c)| (m.clone(), c))
            .partition(|(monomial, _)| exponent_of(monomial, factor) > 0);
        let quotient = with
            .iter()
            .map(|(monomial, &c)| (divide(monomial, &[factor]), c))
            .collect();
        let quotient = self.build(&quotient);
        let grouped = self.graph.mul(factor, quotient);
        if without.is_empty() {
            return grouped;
        }
        let rest = self.build(&without);
        self.graph.add(grouped, rest)
    }

    /// Builds the sum of `coefficient × rest` over all groups; groups of negative terms only are
    /// subtracted.
    fn build_groups(&mut self, groups: BTreeMap<Monomial, Sum>) -> NodeId {
        let mut total = None;
        let (negative, positive): (Vec<_>, Vec<_>) = groups
            .into_iter()
            .partition(|(_, rest)| rest.values().all(|coefficient| coefficient.is_negative()));
        let negative = negative
            .into_iter()
            .map(|(key, rest)| (key, scale(&rest, Constant::from(-1)), true));
        for (key, rest, subtract) in positive
            .into_iter()
            .map(|(key, rest)| (key, rest, false))
            .chain(negative)
        {
            let magnitude = common_magnitude(&rest).unwrap_or(Constant::from(1));
            let shared = common_factor(&rest);
            let inverse: Monomial = shared
                .iter()
                .map(|&(atom, exponent)| (atom, -exponent))
                .collect();
            let scale_back = magnitude.recip().expect("coefficients are not zero");
            let rest = rest
                .iter()
                .map(|(monomial, &c)| (multiply(monomial, &inverse), c * scale_back))
                .collect();
            let (front, rest) = (
                self.build_monomial(&multiply(&key, &shared)),
                self.build_terms(&rest),
            );
            let product = self.graph.mul(front, rest);
            let term = scaled(&mut self.graph, magnitude, product);
            total = Some(match (total, subtract) {
                (None, false) => term,
                (None, true) => self.graph.neg(term),
                (Some(total), false) => self.graph.add(total, term),
                (Some(total), true) => self.graph.sub(total, term),
            });
        }
        total.unwrap_or_else(|| self.graph.integer(0))
    }

    fn build_terms(&mut self, sum: &Sum) -> NodeId {
        // Positive terms come first, so that a sum does not start with a sign.
        let (negative, positive): (Vec<_>, Vec<_>) = sum
            .iter()
            .partition(|(_, coefficient)| coefficient.is_negative());
        let mut total = None;
        for (monomial, &coefficient) in positive.into_iter().chain(negative) {
            let product = self.build_monomial(monomial);
            total = Some(match total {
                Some(total) if coefficient.is_negative() => {
                    let term = scaled(&mut self.graph, -coefficient, product);
                    self.graph.sub(total, term)
                }
                Some(total) => {
                    let term = scaled(&mut self.graph, coefficient, product);
                    self.graph.add(total, term)
                }
                None => scaled(&mut self.graph, coefficient, product),
            });
        }
        total.unwrap_or_else(|| self.graph.integer(0))
    }

    fn build_monomial(&mut self, monomial: &Monomial) -> NodeId {
        let (below, above): (Vec<_>, Vec<_>) =
            monomial.iter().partition(|&&(_, exponent)| exponent < 0);
        let product = |graph: &mut Graph, factors: Vec<&(NodeId, i32)>| {
            let powers = factors
                .into_iter()
                .map(|&(atom, exponent)| (atom, exponent.abs()));
            powers.fold(None, |product: Option<NodeId>, (atom, exponent)| {
                let power = graph.powi(atom, exponent);
                Some(product.map_or(power, |product| graph.mul(product, power)))
            })
        };
        let numerator = product(&mut self.graph, above).unwrap_or_else(|| self.graph.integer(1));
        match product(&mut self.graph, below) {
            None => numerator,
            Some(denominator) => self.graph.div(numerator, denominator),
        }
    }
}

/// Groups the terms by their powers of `symbols` and of `S`.
fn collect(graph: &Graph, symbols: &BTreeSet<NodeId>, sum: &Sum) -> BTreeMap<Monomial, Sum> {
    let collected = |atom: NodeId| {
        symbols.contains(&atom) || matches!(graph.node(atom), Node::HalfAngleSquared(..))
    };
    let mut groups: BTreeMap<Monomial, Sum> = BTreeMap::new();
    for (monomial, &coefficient) in sum {
        let (key, rest) = monomial.iter().partition(|&&(atom, _)| collected(atom));
        groups.entry(key).or_default().insert(rest, coefficient);
    }
    groups
}
