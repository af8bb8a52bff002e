//! Rust and other languages from expressions: one function per kernel, one named intermediate per
//! shared operation.
//!
//! The languages agree in how sums, products and parentheses are written, so that one writer serves
//! them all; a [`Dialect`] has the rest. Powers are products, and the order of all operations is that
//! of the graph: the same kernels give the same bytes in each language, and up to the last bits of
//! sines and cosines the same values.
//!
//! Names of kernels, inputs, elements and outputs are written as they are. A name that the language
//! or the emitted source needs for itself is an error; intermediates take none of them.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, Shape, computed_operands};
use crate::ir::naming::{camel_case, is_identifier};

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

    /// Words that are no names: keywords, and what the emitted source uses itself.
    const RESERVED: &'static str;

    /// The name of the arc sine.
    const ARC_SINE: &'static str = "asin";

    /// How strongly the operands of a comparison must hold together.
    const COMPARED: Strength = PRODUCT;

    /// What stands before the names of `sqrt`, `sin` and `cos`.
    fn library(&self) -> &'static str {
        ""
    }

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

/// Checks the names in `kernels`: each is an identifier and none of the `reserved` words; functions
/// and types differ from each other, and variables of one function too.
///
/// # Errors
/// The first name that cannot be written.
pub fn check_names(kernels: &[Kernel], reserved: &str) -> Result<(), String> {
    let reserved: HashSet<&str> = reserved.split_whitespace().collect();
    let check = |name: &str, what: &str, kernel: &Kernel| {
        let problem = match name {
            _ if !is_identifier(name) => "is no identifier: use letters, digits and `_`",
            _ if reserved.contains(name) => "is reserved in this language",
            _ => return Ok(()),
        };
        Err(format!(
            "kernel `{}`: {what} `{name}` {problem}",
            kernel.name
        ))
    };
    let taken = |name: &str, what: &str, kernel: &Kernel| {
        format!("kernel `{}`: {what} `{name}` is taken", kernel.name)
    };
    let places = || kernels.iter().flat_map(|kernel| &kernel.inputs);
    let mut types: HashSet<String> = places()
        .filter_map(|input| Some(input.place.as_ref()?.group.name.to_owned()))
        .collect();
    for kernel in kernels {
        let result = camel_case(&kernel.name);
        check(&kernel.name, "the name", kernel)?;
        check(&result, "the type of the result", kernel)?;
        if !types.insert(result.clone()) {
            return Err(taken(&result, "the type of the result", kernel));
        }
    }
    let mut functions = HashSet::new();
    for kernel in kernels {
        if types.contains(&kernel.name) || !functions.insert(&kernel.name) {
            return Err(taken(&kernel.name, "the name", kernel));
        }
        let mut variables = HashSet::new();
        for (name, what) in variables_of(kernel) {
            check(name, what, kernel)?;
            if types.contains(name) || !variables.insert(name) {
                return Err(taken(name, what, kernel));
            }
        }
        let mut fields = HashSet::new();
        for Output { name, .. } in &kernel.outputs {
            check(name, "the output", kernel)?;
            if !fields.insert(name) {
                return Err(taken(name, "the output", kernel));
            }
        }
    }
    Ok(())
}

/// The names that can be variables of the function of `kernel`: arguments that are structures, the
/// inputs that are none of these, and elements. One element may be called like its input.
fn variables_of(kernel: &Kernel) -> impl Iterator<Item = (&str, &'static str)> {
    let mut structures: Vec<(&str, &str)> = Vec::new();
    for place in kernel
        .inputs
        .iter()
        .filter_map(|input| input.place.as_ref())
    {
        let structure = (place.argument.as_str(), place.group.name);
        if !structures.contains(&structure) {
            structures.push(structure);
        }
    }
    let is_in_structure = move |input: &Input, name: &str| {
        input
            .place
            .as_ref()
            .is_some_and(|place| place.argument == name)
    };
    let inputs = kernel.inputs.iter().flat_map(move |input| {
        let is_element = matches!(&input.elements[..], [(element, _)] if *element == input.name);
        let own = (!is_element && !is_in_structure(input, &input.name)).then_some(&input.name);
        let elements = input.elements.iter().map(|(name, _)| name.as_str());
        own.map(|name| (name.as_str(), "the input"))
            .into_iter()
            .chain(elements.map(|name| (name, "the element")))
    });
    let structures = structures
        .into_iter()
        .map(|(name, _)| (name, "the argument"));
    structures.chain(inputs)
}

/// The names of intermediates: those that the graph has, those of outputs with their indices, and
/// `t0`, `t1`, … for the others. None of them is taken twice.
struct Intermediates<'a> {
    graph: &'a Graph,
    outputs: BTreeMap<NodeId, String>,
    taken: HashSet<String>,
    numbers: std::ops::RangeFrom<usize>,
}

impl<'a> Intermediates<'a> {
    fn new(kernel: &'a Kernel, reserved: &str) -> Self {
        let mut outputs = BTreeMap::new();
        for output in &kernel.outputs {
            for (k, &node) in output.nodes.iter().enumerate() {
                let name = match output.shape {
                    Shape::Scalar => output.name.clone(),
                    Shape::Vector(_) => format!("{}_{k}", output.name),
                    Shape::Matrix(_, columns) => {
                        format!("{}_{}_{}", output.name, k / columns, k % columns)
                    }
                };
                outputs.entry(node).or_insert(name);
            }
        }
        let variables = variables_of(kernel).map(|(name, _)| name);
        // An input in a structure is a variable in languages without structures.
        let inputs = kernel.inputs.iter().map(|input| input.name.as_str());
        let taken = variables.chain(inputs).chain(reserved.split_whitespace());
        let result = camel_case(&kernel.name);
        Self {
            graph: &kernel.graph,
            outputs,
            taken: taken.map(str::to_owned).chain([result]).collect(),
            numbers: 0..,
        }
    }

    /// The name of the intermediate that holds `id`.
    fn name(&mut self, id: NodeId) -> String {
        let output = self.outputs.get(&id).map(String::as_str);
        let given = self
            .graph
            .name(id)
            .or(output)
            .filter(|name| is_identifier(name));
        let numbers = self.numbers.by_ref().map(|number| format!("t{number}"));
        given
            .map(str::to_owned)
            .into_iter()
            .chain(numbers)
            .find(|name| self.taken.insert(name.clone()))
            .expect("there are more names than nodes")
    }
}

struct Writer<'a, D> {
    dialect: &'a D,
    statements: String,
    intermediates: Intermediates<'a>,
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
        let library = self.dialect.library();
        let named = |name: &str, a: NodeId| Piece::atom(format!("{library}{name}({})", of(a).text));
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
            Node::Sqrt(a) => named("sqrt", a),
            Node::Sin(a) => named("sin", a),
            Node::Cos(a) => named("cos", a),
            Node::Asin(a) => named(D::ARC_SINE, a),
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
    fn intermediate(&mut self, id: NodeId, value: Piece) -> Piece {
        let name = self.intermediates.name(id);
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
            expressions.insert(id, writer.intermediate(id, expression));
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
    pub fn new<D: Dialect>(kernel: &Kernel, dialect: &D) -> Result<Self, String> {
        let uses = uses(kernel);
        let mut writer = Writer {
            dialect,
            statements: String::new(),
            intermediates: Intermediates::new(kernel, D::RESERVED),
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
