//! The expression graph: interned nodes with typed ids, operands before users.
//!
//! Interning makes equal expressions one node. Common subexpressions cost nothing, and equality is a
//! comparison of ids. Differentiation and dead-node removal are single sweeps over the arena.

use std::collections::{BTreeMap, HashMap};

use crate::ir::constant::Constant;
pub use crate::ir::node::{Node, NodeId, Symbol, SymbolId};
use crate::ir::special;
use crate::ir::unit::Unit;

/// Maximum magnitude of the exponent of a [`Node::Powi`] that is read or that a rule makes: a power
/// is emitted as that many multiplications.
pub const MAX_EXPONENT: i32 = 64;

/// One rewriting rule on an operation.
pub struct RewriteRule {
    /// A short name, unique in the table.
    pub name: &'static str,
    /// Effect of the rule, as mathematics.
    pub statement: &'static str,
    /// Its domain.
    pub domain: &'static str,
    /// Returns the result, if the rule applies to this operation.
    pub apply: fn(&mut Graph, Node) -> Option<NodeId>,
}

impl std::fmt::Debug for RewriteRule {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}: {}", self.name, self.statement)
    }
}

/// An expression graph.
///
/// Invariants, checked by [`Graph::validate`]:
/// - operands precede their users;
/// - no two nodes are equal;
/// - constants are finite; symbols have unique names that are Rust identifiers.
///
/// The constructors (`add`, `mul`, …) first apply the rules of the graph. [`Graph::new`] takes
/// those of [`crate::ir::simplify`], [`Graph::raw`] takes none.
#[derive(Clone, Debug)]
pub struct Graph {
    nodes: Vec<Node>,
    interned: HashMap<Node, NodeId>,
    symbols: Vec<Symbol>,
    by_name: BTreeMap<String, NodeId>,
    names: BTreeMap<NodeId, String>,
    rules: &'static [RewriteRule],
}

impl Graph {
    /// An empty graph whose constructors keep every operation as it is written.
    pub fn raw() -> Self {
        Self::with_rules(&[])
    }

    /// An empty graph whose constructors apply `rules`, in this order.
    pub(crate) fn with_rules(rules: &'static [RewriteRule]) -> Self {
        Self {
            nodes: Vec::new(),
            interned: HashMap::new(),
            symbols: Vec::new(),
            by_name: BTreeMap::new(),
            names: BTreeMap::new(),
            rules,
        }
    }

    /// The operation at `id`.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// All nodes, operands before users.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All ids, in order.
    pub fn ids(&self) -> impl Iterator<Item = NodeId> + use<> {
        (0..self.nodes.len() as u32).map(NodeId)
    }

    /// The symbols, in the order of their creation.
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// Returns the node that holds `node`, new or known, without rewriting.
    ///
    /// # Panics
    /// If an operand is not of this graph, or the graph outgrows `u32`.
    pub fn intern(&mut self, node: Node) -> NodeId {
        let next = NodeId(
            u32::try_from(self.nodes.len()).expect("an expression graph holds at most 2^32 nodes"),
        );
        assert!(
            node.operands().all(|operand| operand < next),
            "an operand is not of this graph"
        );
        *self.interned.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            next
        })
    }

    /// Interns `node` after the graph's rules.
    pub fn make(&mut self, node: Node) -> NodeId {
        for rule in self.rules {
            if let Some(result) = (rule.apply)(self, node) {
                return result;
            }
        }
        self.intern(node)
    }

    /// The symbol `name`, written `notation`, in `unit`; the existing one if the name is known.
    ///
    /// # Panics
    /// If the existing one has another unit.
    #[track_caller]
    pub fn symbol(&mut self, name: &str, notation: &str, unit: Unit) -> NodeId {
        if let Some(&id) = self.by_name.get(name) {
            let Node::Symbol(known) = self.node(id) else {
                unreachable!("names belong to symbols")
            };
            let known = self.symbols[known.index()].unit;
            assert!(
                known == unit,
                "the symbol `{name}` is in {known} already and cannot be in {unit}"
            );
            return id;
        }
        let symbol = SymbolId(self.symbols.len() as u32);
        self.symbols.push(Symbol {
            name: name.into(),
            notation: notation.into(),
            unit,
        });
        let id = self.intern(Node::Symbol(symbol));
        self.by_name.insert(name.into(), id);
        id
    }

    /// The symbol `name`, if there is one.
    pub fn find_symbol(&self, name: &str) -> Option<NodeId> {
        self.by_name.get(name).copied()
    }

    /// The name of a symbol node.
    pub fn symbol_name(&self, id: NodeId) -> Option<&str> {
        match self.node(id) {
            Node::Symbol(symbol) => Some(&self.symbols[symbol.index()].name),
            _ => None,
        }
    }

    /// Gives the operation at `id` the name of its variable in a program. A node keeps its first
    /// name; constants and symbols need none.
    pub fn set_name(&mut self, id: NodeId, name: &str) {
        if !matches!(self.node(id), Node::Constant(_) | Node::Symbol(_)) {
            self.names.entry(id).or_insert_with(|| name.to_owned());
        }
    }

    /// The name of an operation, if it has one.
    pub fn name(&self, id: NodeId) -> Option<&str> {
        self.names.get(&id).map(String::as_str)
    }

    /// An empty graph with the symbols of this one, in the same order.
    pub fn with_same_symbols(&self) -> Self {
        let mut graph = Self::with_rules(self.rules);
        for symbol in &self.symbols {
            graph.symbol(&symbol.name, &symbol.notation, symbol.unit);
        }
        graph
    }

    /// Copies the part that `outputs` need, with all symbols and names; also returns the outputs in
    /// the copy.
    pub fn extract(&self, outputs: &[NodeId]) -> (Self, Vec<NodeId>) {
        let mut graph = self.with_same_symbols();
        let mut ids: HashMap<NodeId, NodeId> = HashMap::new();
        for id in self.reachable(outputs) {
            let copy = match self.node(id) {
                // The arena may hold symbols in another order.
                Node::Symbol(symbol) => graph.by_name[&self.symbols[symbol.index()].name],
                node => graph.intern(node.map(|operand| ids[&operand])),
            };
            ids.insert(id, copy);
            if let Some(name) = self.name(id) {
                graph.set_name(copy, name);
            }
        }
        let outputs = outputs.iter().map(|output| ids[output]).collect();
        (graph, outputs)
    }

    /// The constant `value`.
    pub fn constant(&mut self, value: Constant) -> NodeId {
        self.intern(Node::Constant(value))
    }

    /// The integer `value`.
    pub fn integer(&mut self, value: i64) -> NodeId {
        self.constant(value.into())
    }

    /// The exact rational `numerator / denominator`.
    pub fn ratio(&mut self, numerator: i64, denominator: i64) -> NodeId {
        self.constant(Constant::ratio(numerator, denominator))
    }

    /// The value of a constant node.
    pub fn as_constant(&self, id: NodeId) -> Option<Constant> {
        match self.node(id) {
            Node::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// `true` if `id` is the constant zero.
    pub fn is_zero(&self, id: NodeId) -> bool {
        self.as_constant(id).is_some_and(Constant::is_zero)
    }

    /// `a + b`
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.make(Node::Add(a, b))
    }

    /// `a − b`
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.make(Node::Sub(a, b))
    }

    /// `a b`
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.make(Node::Mul(a, b))
    }

    /// `a / b`
    pub fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.make(Node::Div(a, b))
    }

    /// `−a`
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Neg(a))
    }

    /// `a^exponent`
    pub fn powi(&mut self, a: NodeId, exponent: i32) -> NodeId {
        self.make(Node::Powi(a, exponent))
    }

    /// `√a`
    pub fn sqrt(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Sqrt(a))
    }

    /// `sin a`
    pub fn sin(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Sin(a))
    }

    /// `cos a`
    pub fn cos(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Cos(a))
    }

    /// `asin a`
    pub fn asin(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Asin(a))
    }

    /// `eᵃ`
    pub fn exp(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Exp(a))
    }

    /// The natural logarithm `ln a`, for `a > 0`
    pub fn ln(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Ln(a))
    }

    /// `tanh a`
    pub fn tanh(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Tanh(a))
    }

    /// `|a|`
    pub fn abs(&mut self, a: NodeId) -> NodeId {
        self.make(Node::Abs(a))
    }

    /// The angle of the point `(x, y)`, `atan2(y, x)`, away from the origin
    pub fn atan2(&mut self, y: NodeId, x: NodeId) -> NodeId {
        self.make(Node::Atan2(y, x))
    }

    /// `a^exponent` for `a > 0` and any real exponent
    pub fn pow(&mut self, a: NodeId, exponent: NodeId) -> NodeId {
        self.make(Node::Pow(a, exponent))
    }

    /// 1 where `a < b`, else 0
    pub fn less_than(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.make(Node::LessThan(a, b))
    }

    /// `S(u) = ½ arccos²(1 − u)`, see [`crate::ir::special`].
    pub fn half_angle_squared(&mut self, u: NodeId) -> NodeId {
        self.make(Node::HalfAngleSquared(0, u))
    }

    /// The sum of `terms`, zero if there are none.
    pub fn sum(&mut self, terms: impl IntoIterator<Item = NodeId>) -> NodeId {
        let mut terms = terms.into_iter();
        match terms.next() {
            None => self.integer(0),
            Some(first) => terms.fold(first, |sum, term| self.add(sum, term)),
        }
    }

    /// The inner product `Σ a_i b_i`.
    pub fn dot(&mut self, a: &[NodeId], b: &[NodeId]) -> NodeId {
        let products: Vec<_> = a.iter().zip(b).map(|(&a, &b)| self.mul(a, b)).collect();
        self.sum(products)
    }

    /// The nodes that `outputs` need, including `outputs`, operands before users.
    pub fn reachable(&self, outputs: &[NodeId]) -> Vec<NodeId> {
        self.reachable_until(outputs, |_| false)
    }

    /// Like [`Graph::reachable`], but without nodes that only those with `is_given` need.
    pub fn reachable_until(
        &self,
        outputs: &[NodeId],
        is_given: impl Fn(NodeId) -> bool,
    ) -> Vec<NodeId> {
        let end = outputs
            .iter()
            .map(|output| output.index() + 1)
            .max()
            .unwrap_or(0);
        let mut live = vec![false; end];
        for output in outputs {
            live[output.index()] = true;
        }
        for (index, node) in self.nodes[..end].iter().enumerate().rev() {
            if live[index] && !is_given(NodeId(index as u32)) {
                node.operands()
                    .for_each(|operand| live[operand.index()] = true);
            }
        }
        self.ids().take(end).filter(|id| live[id.index()]).collect()
    }

    /// Checks the invariants.
    ///
    /// # Errors
    /// The first invariant that does not hold.
    pub fn validate(&self) -> Result<(), String> {
        let mut seen = HashMap::new();
        for id in self.ids() {
            let node = self.node(id);
            if let Some(operand) = node.operands().find(|&operand| operand >= id) {
                let (user, operand) = (id.index(), operand.index());
                return Err(format!(
                    "node {user} uses node {operand}, which does not come before it"
                ));
            }
            if let Some(first) = seen.insert(node, id) {
                let (first, second) = (first.index(), id.index());
                return Err(format!(
                    "nodes {first} and {second} are equal but not shared"
                ));
            }
            match node {
                Node::Constant(value) if !value.value().is_finite() => {
                    return Err(format!(
                        "node {} is the constant {value:?}, which is not finite",
                        id.index()
                    ));
                }
                Node::Symbol(symbol) => self.validate_symbol(symbol, id)?,
                Node::HalfAngleSquared(order, _) if order > special::MAX_ORDER => {
                    return Err(format!(
                        "node {} asks for derivative {order} of S; the highest defined is {}",
                        id.index(),
                        special::MAX_ORDER
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn validate_symbol(&self, symbol: SymbolId, id: NodeId) -> Result<(), String> {
        let name = self
            .symbols
            .get(symbol.index())
            .map_or("", |symbol| &symbol.name);
        let registered = self.by_name.get(name) == Some(&id);
        if registered && syn::parse_str::<syn::Ident>(name).is_ok() {
            return Ok(());
        }
        Err(format!(
            "symbol {} ({name:?}) is missing, duplicated, or not an identifier",
            symbol.index()
        ))
    }

    /// Values of all nodes, for the given values of the symbols (by symbol index).
    ///
    /// A node that is undefined for these values (a division by zero) is NaN or infinite.
    ///
    /// # Panics
    /// If `symbols` does not have one value per symbol.
    pub fn evaluate(&self, symbols: &[f64]) -> Vec<f64> {
        assert_eq!(
            symbols.len(),
            self.symbols.len(),
            "one value for each symbol"
        );
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let at = |id: NodeId| values[id.index()];
            values.push(match *node {
                Node::Constant(value) => value.value(),
                Node::Symbol(symbol) => symbols[symbol.index()],
                Node::Add(a, b) => at(a) + at(b),
                Node::Sub(a, b) => at(a) - at(b),
                Node::Mul(a, b) => at(a) * at(b),
                Node::Div(a, b) => at(a) / at(b),
                Node::Neg(a) => -at(a),
                Node::Powi(a, exponent) => at(a).powi(exponent),
                Node::Sqrt(a) => at(a).sqrt(),
                Node::Sin(a) => at(a).sin(),
                Node::Cos(a) => at(a).cos(),
                Node::Asin(a) => at(a).asin(),
                Node::Exp(a) => at(a).exp(),
                Node::Ln(a) => at(a).ln(),
                Node::Tanh(a) => at(a).tanh(),
                Node::Abs(a) => at(a).abs(),
                Node::Atan2(a, b) => at(a).atan2(at(b)),
                Node::Pow(a, b) => at(a).powf(at(b)),
                Node::LessThan(a, b) => f64::from(u8::from(at(a) < at(b))),
                Node::HalfAngleSquared(order, a) => special::half_angle_squared(order, at(a)),
            });
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_expressions_are_one_node() {
        let mut graph = Graph::raw();
        let (x, y) = (
            graph.symbol("x", "x", Unit::ONE),
            graph.symbol("y", "y", Unit::ONE),
        );
        let (a, b) = (graph.mul(x, y), graph.mul(x, y));
        assert_eq!(a, b);
        assert_eq!(graph.symbol("x", "x", Unit::ONE), x);
        assert_eq!(graph.validate(), Ok(()));
    }

    #[test]
    #[should_panic(expected = "the symbol `x` is in m already and cannot be in s")]
    fn a_symbol_has_one_unit() {
        let mut graph = Graph::raw();
        graph.symbol("x", "x", Unit::METRE);
        graph.symbol("x", "x", Unit::SECOND);
    }

    #[test]
    fn validate_names_what_is_broken() {
        let mut graph = Graph::raw();
        let x = graph.symbol("x", "x", Unit::ONE);
        let mut nameless = Graph::raw();
        nameless.symbol("not an identifier", "x", Unit::ONE);
        assert_eq!(
            nameless.validate().expect_err("the name has spaces"),
            "symbol 0 (\"not an identifier\") is missing, duplicated, or not an identifier"
        );
        for (node, expected) in [
            (
                Node::Symbol(SymbolId(0)),
                "nodes 0 and 1 are equal but not shared",
            ),
            (
                Node::Neg(NodeId(1)),
                "node 1 uses node 1, which does not come before it",
            ),
            (
                Node::Constant(Constant::Float(f64::INFINITY)),
                "node 1 is the constant Float(inf), which is not finite",
            ),
            (
                Node::HalfAngleSquared(9, x),
                "node 1 asks for derivative 9 of S; the highest defined is 3",
            ),
        ] {
            graph.nodes.truncate(1);
            graph.nodes.push(node);
            assert_eq!(graph.validate().expect_err("it is broken"), expected);
        }
    }
}
