//! Sums of products over atoms: expanded, reduced by identities between terms, and factored again.

use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::simplify::{scaled, split_coefficient};

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

/// A product of powers of atoms, sorted by atom.
type Monomial = Vec<(NodeId, i32)>;

/// A sum of monomials with constant coefficients; the empty sum is zero.
type Sum = BTreeMap<Monomial, Constant>;

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

/// The identities that [`normalise`] applies to the terms of a sum.
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

fn multiply(a: &Monomial, b: &Monomial) -> Monomial {
    let mut product = Monomial::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    // Both are sorted by atom, and merging keeps the order.
    while let (Some(&x), Some(&y)) = (a.peek(), b.peek()) {
        let factor = match x.0.cmp(&y.0) {
            Ordering::Less => a.next(),
            Ordering::Greater => b.next(),
            Ordering::Equal => a
                .next()
                .zip(b.next())
                .map(|((atom, j), (_, k))| (atom, j + k)),
        };
        product.extend(factor.filter(|&(_, exponent)| exponent != 0));
    }
    product.extend(a);
    product.extend(b);
    product
}

fn divide(monomial: &Monomial, atoms: &[NodeId]) -> Monomial {
    let divisor = atoms.iter().fold(Monomial::new(), |product, &atom| {
        multiply(&product, &vec![(atom, -1)])
    });
    multiply(monomial, &divisor)
}

fn times(monomial: &Monomial, atoms: &[NodeId]) -> Monomial {
    atoms.iter().fold(monomial.clone(), |product, &atom| {
        multiply(&product, &vec![(atom, 1)])
    })
}

fn add_term(sum: &mut Sum, monomial: Monomial, coefficient: Constant) {
    let total = sum.get(&monomial).copied().unwrap_or(Constant::from(0)) + coefficient;
    if total.is_zero() {
        sum.remove(&monomial);
    } else {
        sum.insert(monomial, total);
    }
}

fn constant_sum(value: Constant) -> Sum {
    let mut sum = Sum::new();
    add_term(&mut sum, Monomial::new(), value);
    sum
}

fn scale(sum: &Sum, factor: Constant) -> Sum {
    sum.iter()
        .map(|(monomial, &coefficient)| (monomial.clone(), coefficient * factor))
        .collect()
}

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
fn add_reduced(graph: &mut Graph, a: Sum, factor: i64, mut b: Sum) -> Sum {
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
fn multiply_reduced(graph: &mut Graph, a: &Sum, b: &Sum) -> Sum {
    let mut product = Sum::new();
    for (x, &c) in a {
        for (y, &d) in b {
            add_term(&mut product, multiply(x, y), c * d);
        }
    }
    let pending = product.keys().cloned().collect();
    reduce(graph, product, pending)
}

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

fn single(sum: &Sum) -> Option<(&Monomial, Constant)> {
    match sum.len() {
        1 => sum
            .iter()
            .next()
            .map(|(monomial, &coefficient)| (monomial, coefficient)),
        _ => None,
    }
}

fn exponent_of(monomial: &Monomial, atom: NodeId) -> i32 {
    monomial
        .iter()
        .find(|&&(other, _)| other == atom)
        .map_or(0, |&(_, exponent)| exponent)
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

/// The factor that all terms share.
fn common_factor(sum: &Sum) -> Monomial {
    let mut terms = sum.keys();
    let first = terms.next().cloned().unwrap_or_default();
    let shared = terms.fold(first, |shared, monomial| {
        let kept = shared
            .into_iter()
            .map(|(atom, exponent)| (atom, exponent.min(exponent_of(monomial, atom))));
        kept.filter(|&(_, exponent)| exponent > 0).collect()
    });
    shared
        .into_iter()
        .filter(|&(_, exponent)| exponent > 0)
        .collect()
}

/// The coefficient by which a sum is divided, so that all its multiples are one sum.
///
/// Its magnitude is the most frequent one, because those terms then need no multiplication; among
/// equals that of the term with the fewest factors. Its sign is that of the term with the most
/// factors, which makes the kernels shortest. It is rational, because other numbers would round.
fn unit_of(sum: &Sum) -> Constant {
    let mut counts: HashMap<Constant, usize> = HashMap::new();
    for coefficient in sum.values() {
        *counts.entry(coefficient.abs()).or_default() += 1;
    }
    let factors = |monomial: &Monomial| -> u32 {
        let exponents = monomial.iter().map(|(_, exponent)| exponent.unsigned_abs());
        exponents.sum()
    };
    let rarity = |(monomial, coefficient): &(&Monomial, &Constant)| {
        (Reverse(counts[&coefficient.abs()]), factors(monomial))
    };
    let (_, frequent) = sum.iter().min_by_key(rarity).expect("a sum has terms");
    let length = |(monomial, _): &(&Monomial, &Constant)| Reverse(factors(monomial));
    let (_, longest) = sum.iter().min_by_key(length).expect("a sum has terms");
    let magnitude = match frequent {
        Constant::Rational(_) => frequent.abs(),
        Constant::Float(_) => Constant::from(1),
    };
    match longest.is_negative() {
        true => -magnitude,
        false => magnitude,
    }
}

/// The magnitude that all coefficients share, if it is not one.
fn common_magnitude(sum: &Sum) -> Option<Constant> {
    let mut magnitudes = sum.values().map(|coefficient| coefficient.abs());
    let first = magnitudes.next()?;
    (!first.is_one() && magnitudes.all(|other| other == first)).then_some(first)
}

/// The atom that occurs in most terms, if it occurs in more than one; the oldest among equals.
fn frequent_factor(sum: &Sum) -> Option<NodeId> {
    let mut counts: BTreeMap<NodeId, usize> = BTreeMap::new();
    for monomial in sum.keys() {
        for &(atom, _) in monomial.iter().filter(|&&(_, exponent)| exponent > 0) {
            *counts.entry(atom).or_default() += 1;
        }
    }
    let most = counts.values().copied().max().filter(|&count| count > 1)?;
    counts
        .into_iter()
        .find(|&(_, count)| count == most)
        .map(|(atom, _)| atom)
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
