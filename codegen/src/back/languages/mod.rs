//! Rust and other languages from expressions: one function per kernel, one named intermediate per
//! shared operation.
//!
//! All languages write sums, products and parentheses alike, so that one writer serves them; a
//! [`Dialect`] has the rest. Powers are products, and operations have the order of the graph. The
//! same kernels give the same bytes in each language. Values of different languages agree up to the
//! last bits of sines and cosines.
//!
//! Names of kernels, inputs, elements and outputs are written as they are. A name that the language
//! or the emitted source needs for itself is an error; intermediates take none of them.

use std::collections::{BTreeMap, HashSet};

use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output, OutputShape, computed_operands};
use crate::ir::naming::{camel_case, is_identifier};
use crate::ir::notation::{ATOM, Notation, POWER, PRODUCT, QUOTIENT, SUM, Written};
use crate::ir::writer::Writer;

pub mod rust;

/// Notation that differs between languages.
pub trait Dialect {
    /// A number: in double precision, with a decimal point or an exponent.
    fn number(&self, value: Constant) -> String {
        format!("{:?}", value.value())
    }

    /// Words that cannot be names: keywords, and identifiers of the emitted source.
    const RESERVED: &'static str;

    /// The name of a function, given as in the exchange format.
    fn name(function: &str) -> &str {
        function
    }

    /// Binding strength that the operands of a comparison need.
    const COMPARED: u8 = QUOTIENT;

    /// Path of the functions, before their names.
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
    fn argument(&self, input: &KernelInput) -> String {
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

/// The names that can be variables of the function of `kernel`: structures, inputs outside of them,
/// and elements. A single element may have the name of its input.
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
    let is_in_structure = move |input: &KernelInput, name: &str| {
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

/// Unique names of intermediates: those in the graph, outputs with their indices, and `t0`, `t1`, …
/// for the others.
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
                    OutputShape::Scalar => output.name.clone(),
                    OutputShape::Vector(_) => format!("{}_{k}", output.name),
                    OutputShape::Matrix(_, columns) => {
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

/// The notation of a program.
struct ProgramNotation<'a, D>(&'a D);

impl<D: Dialect> Notation for ProgramNotation<'_, D> {
    fn is_mathematics(&self) -> bool {
        false
    }

    fn minus(&self) -> char {
        '-'
    }

    fn number(&self, value: Constant) -> String {
        self.0.number(value)
    }

    fn constant(&self, value: Constant) -> Written {
        let text = self.number(value);
        let strength = if text.starts_with('-') { SUM } else { ATOM };
        Written::new(text, strength)
    }

    fn symbol(&self, notation: &str) -> String {
        unreachable!("the symbol {notation} of a kernel is given by an input")
    }

    fn quotient(&self, above: Written, below: Written) -> Written {
        let text = format!("{} / {}", above.within(PRODUCT), below.within(POWER));
        Written::new(text, PRODUCT)
    }

    /// Writes a product.
    fn raised(&self, base: &str, exponent: i32) -> Written {
        let product = vec![base; exponent.unsigned_abs() as usize].join(" * ");
        let one = self.number(Constant::from(1));
        match exponent {
            1 => Written::new(product, ATOM),
            2.. => Written::new(product, PRODUCT),
            -1 => Written::new(format!("{one} / {product}"), PRODUCT),
            _ => Written::new(format!("{one} / ({product})"), PRODUCT),
        }
    }

    fn real_power(&self, base: Written, exponent: Written) -> String {
        let arguments = format!("{}, {}", base.text, exponent.text);
        self.function("pow", 1, Written::new(arguments, SUM))
    }

    fn magnitude(&self, argument: Written) -> String {
        self.function("abs", 1, argument)
    }

    fn root(&self, argument: &str) -> String {
        format!("{}sqrt({argument})", self.0.library())
    }

    fn function(&self, name: &str, _: i32, argument: Written) -> String {
        format!("{}{}({})", self.0.library(), D::name(name), argument.text)
    }

    fn less_than(&self, a: Written, b: Written) -> String {
        self.0
            .less_than(&a.within(D::COMPARED), &b.within(D::COMPARED))
    }

    fn half_angle_squared(&self, order: u8, argument: &str) -> String {
        self.0.half_angle_squared(order, argument)
    }
}

/// Maximum depth of an expression. An intermediate cuts deeper ones, for the reader and for the
/// parser's stack.
const MAX_DEPTH: usize = 6;

/// Counts how often each node is an operand or an output of `kernel`, by index.
fn uses(kernel: &Kernel, order: &[NodeId]) -> Vec<usize> {
    let mut uses = vec![0; kernel.graph.nodes().len()];
    let operands = order
        .iter()
        .flat_map(|&id| computed_operands(kernel.graph.node(id)));
    for operand in operands.chain(kernel.output_nodes()) {
        uses[operand.index()] += 1;
    }
    uses
}

/// Checks that `kernel`, whose nodes are computed in this `order`, can be written.
fn check_nodes(kernel: &Kernel, order: &[NodeId]) -> Result<(), String> {
    if let Some(symbol) = kernel.unbound_symbol() {
        return Err(format!(
            "kernel `{}` uses `{symbol}`, which is not one of its inputs",
            kernel.name
        ));
    }
    let constants = order.iter().filter_map(|&id| kernel.graph.as_constant(id));
    let mut values = constants.map(Constant::value);
    if let Some(value) = values.find(|value| !value.is_finite()) {
        return Err(format!(
            "kernel `{}` holds the constant {value}, which is not finite",
            kernel.name
        ));
    }
    Ok(())
}

/// The nodes that get a variable, operands before users: nodes used more than once, bases of
/// powers, which products repeat, and cuts of deep expressions. A constant is as short as a name.
fn intermediates(kernel: &Kernel, order: &[NodeId], uses: &[usize]) -> Vec<NodeId> {
    let graph = &kernel.graph;
    let mut is_base = vec![false; uses.len()];
    for &id in order {
        if let Node::Powi(base, exponent) = graph.node(id) {
            is_base[base.index()] |= exponent != 0;
        }
    }
    let mut depths = vec![0; uses.len()];
    let mut chosen = Vec::new();
    for &id in order {
        let operands = computed_operands(graph.node(id)).map(|operand| depths[operand.index()]);
        let depth = 1 + operands.max().unwrap_or(0);
        let is_needed = uses[id.index()] > 1 || depth > MAX_DEPTH || is_base[id.index()];
        if is_needed && !matches!(graph.node(id), Node::Constant(_)) {
            chosen.push(id);
        } else {
            depths[id.index()] = depth;
        }
    }
    chosen
}

/// The body of a function up to its result.
pub struct FunctionBody {
    /// Statements that read the used elements of the inputs and compute the intermediates.
    pub statements: String,
    /// Inputs without a used element.
    pub unused: Vec<String>,
    /// The expressions of the outputs, by their nodes.
    results: BTreeMap<NodeId, String>,
}

impl FunctionBody {
    /// Writes the body of `kernel`.
    ///
    /// # Errors
    /// If an output needs a symbol that no input provides, or a constant is not finite.
    pub fn new<D: Dialect>(kernel: &Kernel, dialect: &D) -> Result<Self, String> {
        let order = kernel.computed();
        check_nodes(kernel, &order)?;
        let uses = uses(kernel, &order);
        let notation = ProgramNotation(dialect);
        let mut writer = Writer::new(&kernel.graph, &notation);
        let (mut statements, mut unused) = (String::new(), Vec::new());
        for input in &kernel.inputs {
            let KernelInput { name, elements, .. } = input;
            let is_used = |node: NodeId| uses[node.index()] > 0;
            if !elements.iter().any(|&(_, node)| is_used(node)) {
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
                if is_used(*node) && source != *element {
                    statements += &dialect.assignment(element, &source);
                }
                writer.set_name(*node, element.clone());
            }
        }
        let mut names = Intermediates::new(kernel, D::RESERVED);
        for id in intermediates(kernel, &order, &uses) {
            let name = names.name(id);
            statements += &dialect.assignment(&name, &writer.operation(id).text);
            writer.set_name(id, name);
        }
        let nodes = kernel.output_nodes().into_iter();
        let results = nodes.map(|node| (node, writer.expression(node).text));
        Ok(Self {
            statements,
            unused,
            results: results.collect(),
        })
    }

    /// The elements of an output, row by row.
    pub fn values(&self, output: &Output) -> Vec<&str> {
        output
            .nodes
            .iter()
            .map(|node| self.results[node].as_str())
            .collect()
    }
}
