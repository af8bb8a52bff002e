//! Rust and other languages from expressions: one function per kernel, one named intermediate per
//! shared operation.
//!
//! The languages agree in how sums, products and parentheses are written, so that one writer serves
//! them all; a [`Dialect`] has the rest. Powers are products, and the order of all operations is that
//! of the graph: the same kernels give the same bytes in each language, and up to the last bits of
//! sines and cosines the same values.

use std::collections::{BTreeMap, BTreeSet};

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, computed_operands};

pub mod rust;

/// How strongly an expression holds together: sums, products, what needs no parentheses.
pub type Strength = u8;
/// The strength of a sum.
pub const SUM: Strength = 0;
/// The strength of a product.
pub const PRODUCT: Strength = 1;
const ATOM: Strength = 2;

/// An expression and its strength.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    text: String,
    strength: Strength,
}

impl Piece {
    fn atom(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            strength: ATOM,
        }
    }

    /// The text where operands of at least `strength` stand.
    fn within(&self, strength: Strength) -> String {
        if self.strength < strength {
            format!("({})", self.text)
        } else {
            self.text.clone()
        }
    }
}

/// What languages write differently.
pub trait Dialect {
    /// A number: in double precision, with a decimal point or an exponent.
    fn number(&self, value: Constant) -> String {
        format!("{:?}", value.value())
    }

    /// What stands before the names of functions.
    const LIBRARY: &'static str = "";

    /// The name of a function, given as in the exchange format.
    fn name(function: &'static str) -> &'static str {
        function
    }

    /// How strongly the operands of a comparison must hold together.
    const COMPARED: Strength = PRODUCT;

    /// 1 where `a < b`, else 0.
    fn less_than(&self, a: &str, b: &str) -> String;

    /// The derivative of the order `order` of `S` at `u`, see [`special`](crate::ir::special).
    fn half_angle_squared(&self, order: u8, u: &str) -> String {
        format!("half_angle_squared({order}, {u})")
    }

    /// The statement that gives the name its value, with its line break.
    fn assignment(&self, name: &str, value: &str) -> String;

    /// The expression that stands for an input.
    fn argument(&self, input: &Input) -> String {
        input.name.clone()
    }

    /// Element `index` of an input, counted from 0.
    fn element(&self, input: &str, index: usize) -> String {
        format!("{input}[{index}]")
    }
}

struct Writer<'a, D> {
    dialect: &'a D,
    statements: String,
}

impl<D: Dialect> Writer<'_, D> {
    fn constant(&self, constant: Constant) -> Piece {
        let text = self.dialect.number(constant);
        Piece {
            strength: if text.starts_with('-') { SUM } else { ATOM },
            text,
        }
    }

    /// An operation on operands that `of` returns. It is neither a constant nor a symbol, and no
    /// power of zero.
    fn operation<'a>(&self, node: Node, of: &dyn Fn(NodeId) -> &'a Piece) -> Piece {
        let binary = |a: NodeId, operator: &str, b: NodeId, strength: Strength| Piece {
            text: format!(
                "{} {operator} {}",
                of(a).within(strength),
                of(b).within(strength + 1)
            ),
            strength,
        };
        let named = |name: &'static str, arguments: &[NodeId]| {
            let arguments: Vec<&str> = arguments.iter().map(|&a| of(a).text.as_str()).collect();
            let arguments = arguments.join(", ");
            Piece::atom(format!("{}{}({arguments})", D::LIBRARY, D::name(name)))
        };
        match node {
            Node::Constant(_) | Node::Symbol(_) => {
                unreachable!("constants and symbols are no operations")
            }
            Node::Add(a, b) => binary(a, "+", b, SUM),
            Node::Sub(a, b) => binary(a, "-", b, SUM),
            Node::Mul(a, b) => binary(a, "*", b, PRODUCT),
            Node::Div(a, b) => binary(a, "/", b, PRODUCT),
            Node::Neg(a) => Piece {
                text: format!("-{}", of(a).within(ATOM)),
                strength: SUM,
            },
            Node::Powi(a, exponent) => {
                let base = of(a).within(ATOM);
                let product = vec![base; exponent.unsigned_abs() as usize].join(" * ");
                let one = self.constant(Constant::from(1)).text;
                match exponent {
                    1 => Piece::atom(product),
                    2.. => Piece {
                        text: product,
                        strength: PRODUCT,
                    },
                    -1 => Piece {
                        text: format!("{one} / {product}"),
                        strength: PRODUCT,
                    },
                    _ => Piece {
                        text: format!("{one} / ({product})"),
                        strength: PRODUCT,
                    },
                }
            }
            Node::Sqrt(a) => named("sqrt", &[a]),
            Node::Sin(a) => named("sin", &[a]),
            Node::Cos(a) => named("cos", &[a]),
            Node::Asin(a) => named("asin", &[a]),
            Node::Exp(a) => named("exp", &[a]),
            Node::Ln(a) => named("ln", &[a]),
            Node::Tanh(a) => named("tanh", &[a]),
            Node::Abs(a) => named("abs", &[a]),
            Node::Atan2(a, b) => named("atan2", &[a, b]),
            Node::Pow(a, b) => named("pow", &[a, b]),
            Node::LessThan(a, b) => Piece::atom(
                self.dialect
                    .less_than(&of(a).within(D::COMPARED), &of(b).within(D::COMPARED)),
            ),
            Node::HalfAngleSquared(order, a) => {
                Piece::atom(self.dialect.half_angle_squared(order, &of(a).text))
            }
        }
    }

    /// Writes the statement that gives an intermediate its value, and returns what stands for it.
    fn intermediate(&mut self, number: usize, value: Piece) -> Piece {
        let name = format!("t{number}");
        self.statements += &self.dialect.assignment(&name, &value.text);
        Piece::atom(name)
    }
}

/// Expressions deeper than this are cut by an intermediate, for the reader and for the parser's
/// stack.
const MAX_DEPTH: usize = 6;

/// How often each node is an operand or an output of `kernel`.
fn uses(kernel: &Kernel) -> BTreeMap<NodeId, usize> {
    let mut uses: BTreeMap<NodeId, usize> = BTreeMap::new();
    let operands = kernel
        .computed()
        .into_iter()
        .flat_map(|id| computed_operands(kernel.graph.node(id)));
    for operand in operands.chain(kernel.output_nodes()) {
        *uses.entry(operand).or_default() += 1;
    }
    uses
}

/// Writes the intermediates of `kernel`, whose nodes have these [`uses`], and returns the
/// expressions of its outputs by their nodes.
///
/// What is used more than once gets a name, and so does the base of a power, which a product
/// repeats. A constant is as short as a name.
///
/// # Errors
/// If an output needs a symbol that no input provides, or a constant is not finite.
fn write_body<D: Dialect>(
    kernel: &Kernel,
    uses: &BTreeMap<NodeId, usize>,
    writer: &mut Writer<'_, D>,
) -> Result<BTreeMap<NodeId, Piece>, String> {
    if let Some(symbol) = kernel.unbound_symbol() {
        return Err(format!(
            "kernel `{}` uses `{symbol}`, which is not one of its inputs",
            kernel.name
        ));
    }
    let mut uses_left = uses.clone();
    let mut depths: BTreeMap<NodeId, usize> = BTreeMap::new();
    let elements = kernel.inputs.iter().flat_map(|input| &input.elements);
    let mut expressions: BTreeMap<NodeId, Piece> = elements
        .map(|(name, node)| (*node, Piece::atom(name)))
        .collect();
    let order = kernel.computed();
    let bases: BTreeSet<NodeId> = order
        .iter()
        .filter_map(|&id| base_of_power(&kernel.graph, id))
        .collect();
    let mut names = 0;
    for id in order {
        let node = kernel.graph.node(id);
        let expression = match node {
            Node::Constant(constant) if !constant.value().is_finite() => {
                return Err(format!(
                    "kernel `{}` holds the constant {}, which is not finite",
                    kernel.name,
                    constant.value()
                ));
            }
            Node::Constant(constant) => writer.constant(constant),
            Node::Powi(_, 0) => writer.constant(Constant::from(1)),
            Node::Symbol(_) => unreachable!("the symbols of a kernel are given"),
            _ => writer.operation(node, &|operand| &expressions[&operand]),
        };
        for operand in computed_operands(node) {
            // Expressions are dropped after their last use.
            let left = uses_left
                .get_mut(&operand)
                .expect("every operand is counted");
            *left -= 1;
            if *left == 0 {
                expressions.remove(&operand);
            }
        }
        let depth = 1 + computed_operands(node)
            .filter_map(|operand| depths.get(&operand))
            .max()
            .unwrap_or(&0);
        let shared = uses[&id] > 1 || depth > MAX_DEPTH || bases.contains(&id);
        if shared && !matches!(node, Node::Constant(_)) {
            expressions.insert(id, writer.intermediate(names, expression));
            names += 1;
        } else {
            expressions.insert(id, expression);
            depths.insert(id, depth);
        }
    }
    Ok(expressions)
}

fn base_of_power(graph: &Graph, id: NodeId) -> Option<NodeId> {
    match graph.node(id) {
        Node::Powi(base, exponent) => (exponent != 0).then_some(base),
        _ => None,
    }
}

/// The body of a function up to its result.
pub struct FunctionBody {
    /// The statements that take the elements that are used out of the inputs, and compute the
    /// intermediates.
    pub statements: String,
    /// The inputs of which nothing is used.
    pub unused: Vec<String>,
    expressions: BTreeMap<NodeId, Piece>,
}

impl FunctionBody {
    /// Writes the body of `kernel`.
    ///
    /// # Errors
    /// If an output needs a symbol that no input provides, or a constant is not finite.
    pub fn new(kernel: &Kernel, dialect: &impl Dialect) -> Result<Self, String> {
        let uses = uses(kernel);
        let mut writer = Writer {
            dialect,
            statements: String::new(),
        };
        let mut unused = Vec::new();
        for input in &kernel.inputs {
            let Input { name, elements, .. } = input;
            if !elements.iter().any(|(_, node)| uses.contains_key(node)) {
                unused.push(name.clone());
            }
            let argument = dialect.argument(input);
            for (index, (element, node)) in elements.iter().enumerate() {
                // A single element is the argument itself, whose name may differ from it.
                let source = if elements.len() == 1 {
                    argument.clone()
                } else {
                    dialect.element(&argument, index)
                };
                if uses.contains_key(node) && source != *element {
                    writer.statements += &dialect.assignment(element, &source);
                }
            }
        }
        let expressions = write_body(kernel, &uses, &mut writer)?;
        Ok(Self {
            statements: writer.statements,
            unused,
            expressions,
        })
    }

    /// The elements of an output, row by row.
    pub fn values(&self, output: &Output) -> Vec<&str> {
        output
            .nodes
            .iter()
            .map(|node| self.expressions[node].text.as_str())
            .collect()
    }
}
