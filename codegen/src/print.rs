//! Expressions as readable mathematics, in the notation of the model: as text, as LaTeX, and as Markdown.
//!
//! Enter kernels; leaves a page with a legend of their symbols and a definition of each output. The whole equations
//! for reading are sums of products and stand in closed form. Other expressions can be deep and share much: what is
//! used more than once, or nested too deeply, gets a name, so that the printer never recurses far.

use crate::constant::Constant;
use crate::dimension::DimensionError;
use crate::graph::{Graph, Node, NodeId};
use crate::kernels::{Kernel, Output, Shape};
use crate::unit::Unit;
use notation::{ATOM, Notation, POWER, PRODUCT, QUOTIENT, SUM, Text, Written};
use page::{Definition, Page};

mod latex;
mod legend;
mod notation;
mod page;
mod walkthrough;

pub use page::Form;

/// The equations of motion of a chain of `segments` segments.
///
/// `kernels` are those of [`crate::whole::whole_kernels`] for reading. `again` is the command that makes the page.
pub fn equations(form: Form, segments: usize, kernels: &[Kernel], again: &str) -> String {
    let plural = if segments == 1 { "" } else { "s" };
    let title = format!("Equations of motion of a filament of {segments} rigid segment{plural}");
    let mut page = Page::new(form, &title, again);
    page.prose(&format!(
        "`M(q) q̈ = f(q, q̇, t) + Q`,   `q = (φ1, θ1, …, φn, θn)`,   `n = {segments}`\n\
         from `d/dt(∂L/∂q̇) − ∂L/∂q + ∂D/∂q̇ = Q`,   `L = E_kin − E_spring − E_grav`"
    ));
    page.legend(&legend::rows(kernels.iter().map(|kernel| (&kernel.graph, outputs(kernel)))));
    for kernel in kernels {
        page.prose(&kernel.summary);
        let printer = Printer::closed(&kernel.graph, &outputs(kernel), page.notation());
        let mut definitions = printer.named_definitions();
        definitions.extend(kernel.outputs.iter().flat_map(|output| printer.output(output)));
        page.definitions(&definitions);
    }
    page.finish()
}

/// Any kernels, with a name for each intermediate that is shared or deep.
///
/// `again` is the command that makes the page.
pub fn kernels(form: Form, title: &str, kernels: &[Kernel], again: &str) -> String {
    let mut page = Page::new(form, title, again);
    page.prose(
        "Each kernel is a list of definitions: `t1`, `t2`, … are its intermediates, the others its results.\n\
         Results that are zero, and those that symmetry repeats, are left out.",
    );
    page.legend(&legend::rows(kernels.iter().map(|kernel| (&kernel.graph, outputs(kernel)))));
    for kernel in kernels {
        page.heading(&kernel.name);
        page.prose(&kernel.summary);
        let printer = Printer::shared(kernel, page.notation());
        for input in &kernel.inputs {
            let given = input.elements.iter().filter(|(_, node)| printer.given[node.index()]);
            for (name, _) in given {
                page.item(&format!("`{name}` is given as part of `{}`: {}", input.name, input.doc));
            }
        }
        page.definitions(&printer.named_definitions());
        for output in &kernel.outputs {
            let unit = if output.unit == Unit::ONE { String::new() } else { format!(", in {}", output.unit) };
            page.item(&format!("`{}`: {}{unit}", output.name, output.doc));
            page.definitions(&printer.output(output));
        }
    }
    page.finish()
}

/// The way from the energies to the equations of motion of a chain of `segments` segments, for readers.
///
/// `again` is the command that makes the page.
///
/// # Errors
/// If a term of the derivation makes no physical sense.
///
/// # Panics
/// If `segments` is zero.
pub fn walkthrough(segments: usize, again: &str) -> Result<String, DimensionError> {
    walkthrough::page(segments, again)
}

fn outputs(kernel: &Kernel) -> Vec<NodeId> {
    kernel.outputs.iter().flat_map(|output| output.nodes.iter().copied()).collect()
}

/// Operations of an [`excerpt`] below this depth are left out, and characters beyond this number.
const EXCERPT_DEPTH: usize = 5;
const EXCERPT_LENGTH: usize = 120;

/// The outer operations of `id` as text, for messages; an ellipsis stands for what is left out.
pub fn excerpt(graph: &Graph, id: NodeId) -> String {
    let mut copy = Graph::raw();
    let top = copy_levels(graph, id, &mut copy, EXCERPT_DEPTH);
    let text = Printer::plain(&copy, &Text).expression(top).text;
    if text.chars().count() <= EXCERPT_LENGTH {
        return text;
    }
    text.chars().take(EXCERPT_LENGTH).chain(['…']).collect()
}

fn copy_levels(graph: &Graph, id: NodeId, copy: &mut Graph, levels: usize) -> NodeId {
    match graph.node(id) {
        Node::Symbol(symbol) => {
            let symbol = &graph.symbols()[symbol.index()];
            copy.symbol(&symbol.name, &symbol.notation, symbol.unit)
        }
        node if levels == 0 && node.operands().next().is_some() => copy.symbol("…", "…", Unit::ONE),
        node => {
            let node = node.map(|operand| copy_levels(graph, operand, copy, levels.saturating_sub(1)));
            copy.intern(node)
        }
    }
}

/// Expressions deeper than this are cut by a name.
const MAX_DEPTH: usize = 6;
/// Expressions of more symbols and numbers than this are cut by a name.
const MAX_LENGTH: usize = 60;

/// Writes the expressions of one graph.
struct Printer<'a> {
    graph: &'a Graph,
    notation: &'a dyn Notation,
    /// Names of nodes, by index; empty for the others.
    names: Vec<String>,
    /// The nodes that get a definition, in the order in which they are defined.
    defined: Vec<NodeId>,
    /// By index: whether the node is an input under its name.
    given: Vec<bool>,
    /// True if rows and columns of all outputs are the coordinates.
    by_coordinates: bool,
}

impl<'a> Printer<'a> {
    /// Without names.
    fn plain(graph: &'a Graph, notation: &'a dyn Notation) -> Self {
        let size = graph.nodes().len();
        let names = vec![String::new(); size];
        Self { graph, notation, names, defined: Vec::new(), given: vec![false; size], by_coordinates: false }
    }

    /// Whole equations in closed form: the arguments of `S` are named, nothing else.
    fn closed(graph: &'a Graph, outputs: &[NodeId], notation: &'a dyn Notation) -> Self {
        let mut printer = Self { by_coordinates: true, ..Self::plain(graph, notation) };
        let mut arguments: Vec<NodeId> = graph
            .reachable(outputs)
            .into_iter()
            .filter_map(|id| match graph.node(id) {
                Node::HalfAngleSquared(_, argument) => Some(argument),
                _ => None,
            })
            .collect();
        // In the order of the joints: the outermost segment that an argument depends on tells the joint.
        arguments.sort_unstable();
        arguments.dedup();
        arguments.sort_by_key(|&argument| {
            let needed = graph.reachable(&[argument]);
            needed.into_iter().filter(|&id| graph.symbol_name(id).is_some()).max()
        });
        for (i, &argument) in arguments.iter().enumerate() {
            printer.names[argument.index()] = notation.symbol(&format!("u{}", i + 1));
        }
        printer.defined = arguments;
        printer
    }

    /// With a name for each operation that is used more than once, or at which a deep or long expression is cut.
    fn shared(kernel: &'a Kernel, notation: &'a dyn Notation) -> Self {
        let graph = &kernel.graph;
        let mut printer = Self::plain(graph, notation);
        let size = graph.nodes().len();
        // An input that is no simple function of symbols is not taken apart.
        let mut is_input = vec![false; size];
        for (name, node) in kernel.inputs.iter().flat_map(|input| &input.elements) {
            is_input[node.index()] = true;
            if !printer.is_simple(*node, 4) {
                printer.given[node.index()] = true;
                printer.names[node.index()] = notation.symbol(name);
            }
        }
        let order = printer.needed(&outputs(kernel));
        let mut uses = vec![0_u32; size];
        let operands = order.iter().filter(|id| !printer.given[id.index()]).flat_map(|&id| graph.node(id).operands());
        for operand in operands.chain(outputs(kernel)) {
            uses[operand.index()] += 1;
        }
        let (mut depths, mut lengths) = (vec![0_usize; size], vec![1_usize; size]);
        for &id in &order {
            if printer.given[id.index()] {
                continue;
            }
            let node = graph.node(id);
            let is_sum = |node: Node| matches!(node, Node::Add(..) | Node::Sub(..));
            for operand in node.operands() {
                // The terms of a sum stand side by side, however its additions are nested.
                let same_level = is_sum(node) && is_sum(graph.node(operand));
                let depth = depths[operand.index()] + usize::from(!same_level);
                depths[id.index()] = depths[id.index()].max(depth);
            }
            lengths[id.index()] = node.operands().map(|operand| lengths[operand.index()]).sum::<usize>().max(1);
            let shared = uses[id.index()] > 1 && !printer.is_simple(id, if is_input[id.index()] { 4 } else { 2 });
            if shared || depths[id.index()] > MAX_DEPTH || lengths[id.index()] > MAX_LENGTH {
                printer.defined.push(id);
                printer.names[id.index()] = notation.symbol(&format!("t{}", printer.defined.len()));
                (depths[id.index()], lengths[id.index()]) = (0, 1);
            }
        }
        printer
    }

    /// What `outputs` need, operands before users, without looking behind given nodes.
    fn needed(&self, outputs: &[NodeId]) -> Vec<NodeId> {
        let mut live = vec![false; self.graph.nodes().len()];
        for output in outputs {
            live[output.index()] = true;
        }
        for id in self.graph.ids().collect::<Vec<_>>().into_iter().rev() {
            if live[id.index()] && !self.given[id.index()] {
                self.graph.node(id).operands().for_each(|operand| live[operand.index()] = true);
            }
        }
        self.graph.ids().filter(|id| live[id.index()]).collect()
    }

    /// True for a symbol, its sine, a power of these, and with more `levels` the sine of a difference: what is as
    /// good as a name.
    fn is_simple(&self, id: NodeId, levels: u8) -> bool {
        let below = |operand| levels > 0 && self.is_simple(operand, levels - 1);
        match self.graph.node(id) {
            Node::Constant(_) | Node::Symbol(_) => true,
            Node::Sin(a) | Node::Cos(a) | Node::Powi(a, _) => below(a),
            Node::Add(a, b) | Node::Sub(a, b) => levels > 2 && below(a) && below(b),
            _ => false,
        }
    }

    fn is_named(&self, id: NodeId) -> bool {
        !self.names[id.index()].is_empty()
    }

    fn named_definitions(&self) -> Vec<Definition> {
        let definition =
            |&id: &NodeId| Definition { head: self.names[id.index()].clone(), body: self.operation(id).within(0) };
        self.defined.iter().map(definition).collect()
    }

    /// A definition for each element; zeros and what symmetry repeats are left out.
    fn output(&self, output: &Output) -> Vec<Definition> {
        let coordinates = self.by_coordinates || matches!(output.name.as_str(), "mass_matrix" | "force");
        let symbol = match output.name.as_str() {
            "mass_matrix" => "M",
            "force" => "f",
            "kinetic" => "E_kin",
            "spring" => "E_spring",
            "gravity" => "E_grav",
            "dissipation" => "D",
            name => name,
        };
        let index = |i: usize| if coordinates { coordinate(i) } else { (i + 1).to_string() };
        let head = |indices: &[usize]| {
            let indices: Vec<String> = indices.iter().map(|&i| index(i)).collect();
            self.notation.element(symbol, &indices)
        };
        let elements: Vec<(String, NodeId)> = match output.shape {
            Shape::Scalar => vec![(self.notation.symbol(symbol), output.nodes[0])],
            Shape::Vector(_) => output.nodes.iter().enumerate().map(|(i, &node)| (head(&[i]), node)).collect(),
            Shape::Matrix(rows, columns) => (0..rows * columns)
                .map(|i| (i / columns, i % columns, output.nodes[i]))
                .filter(|&(row, column, node)| {
                    rows != columns || row <= column || output.nodes[column * columns + row] != node
                })
                .map(|(row, column, node)| (head(&[row, column]), node))
                .collect(),
        };
        let define = |(head, node)| Definition { head, body: self.expression(node).text };
        let filled = elements.iter().filter(|(_, node)| !self.graph.is_zero(*node)).cloned();
        let definitions: Vec<Definition> = filled.map(define).collect();
        if definitions.is_empty() {
            return vec![Definition { head: self.notation.symbol(symbol), body: "0".into() }];
        }
        definitions
    }

    fn expression(&self, id: NodeId) -> Written {
        match self.is_named(id) {
            true => Written::new(self.names[id.index()].clone(), ATOM),
            false => self.operation(id),
        }
    }

    /// The operation at `id`, whether it has a name or not.
    fn operation(&self, id: NodeId) -> Written {
        let of = |id, context| self.expression(id).within(context);
        let minus = self.notation.minus();
        match self.graph.node(id) {
            Node::Constant(value) if value.is_negative() => {
                Written::new(format!("{minus}{}", self.notation.number(-value)), SUM)
            }
            Node::Constant(value) => Written::new(self.notation.number(value), PRODUCT),
            Node::Symbol(symbol) => {
                Written::new(self.notation.symbol(&self.graph.symbols()[symbol.index()].notation), ATOM)
            }
            Node::Add(..) | Node::Sub(..) => Written::new(self.sum(id), SUM),
            Node::Neg(a) => Written::new(format!("{minus}{}", of(a, QUOTIENT)), SUM),
            Node::Mul(a, b) => match self.graph.as_constant(a) {
                Some(factor) if factor.is_negative() => {
                    let rest = match factor.is_minus_one() {
                        true => String::new(),
                        false => format!("{} ", self.notation.number(-factor)),
                    };
                    Written::new(format!("{minus}{rest}{}", of(b, PRODUCT)), SUM)
                }
                _ => Written::new(self.product(id), PRODUCT),
            },
            Node::Div(a, b) => {
                let (above, below) = (self.expression(a), self.expression(b));
                match self.notation.fraction(&above, &below) {
                    Some(fraction) => Written::new(fraction, PRODUCT),
                    None => Written::new(format!("{}/{}", above.within(PRODUCT), below.within(POWER)), QUOTIENT),
                }
            }
            Node::Powi(a, exponent) => Written::new(self.power(a, exponent), POWER),
            Node::Sqrt(a) => Written::new(self.notation.root(&of(a, 0)), POWER),
            Node::Sin(a) => Written::new(self.function("sin", 1, a), POWER),
            Node::Cos(a) => Written::new(self.function("cos", 1, a), POWER),
            Node::Asin(a) => Written::new(self.function("asin", 1, a), POWER),
            Node::LessThan(a, b) => Written::new(format!("[{} < {}]", of(a, 0), of(b, 0)), POWER),
            Node::HalfAngleSquared(order, a) => {
                Written::new(format!("{}({})", self.notation.half_angle_squared(order), of(a, 0)), POWER)
            }
        }
    }

    /// The terms with their signs. Without recursion: a sum can have more terms than the stack has room for.
    fn sum(&self, top: NodeId) -> String {
        let mut text = String::new();
        let mut pending = vec![(top, false)];
        while let Some((id, negative)) = pending.pop() {
            match self.graph.node(id) {
                Node::Add(a, b) if id == top || !self.is_named(id) => pending.extend([(b, negative), (a, negative)]),
                Node::Sub(a, b) if id == top || !self.is_named(id) => pending.extend([(b, !negative), (a, negative)]),
                _ => {
                    let minus = self.notation.minus();
                    let first = text.is_empty() && !negative;
                    let term = self.expression(id).within(if first { SUM } else { QUOTIENT });
                    match (text.is_empty(), negative) {
                        (true, false) => {}
                        (true, true) => text.push(minus),
                        (false, false) => text.push_str(" + "),
                        (false, true) => text.extend([' ', minus, ' ']),
                    }
                    text.push_str(&term);
                }
            }
        }
        text
    }

    /// The factors in the customary order: numbers, symbols, functions, sums.
    fn product(&self, top: NodeId) -> String {
        let mut factors = Vec::new();
        let mut pending = vec![top];
        while let Some(id) = pending.pop() {
            match self.graph.node(id) {
                Node::Mul(a, b) if id == top || !self.is_named(id) => pending.extend([b, a]),
                _ => factors.push(id),
            }
        }
        let is_one = |factor: NodeId| self.graph.as_constant(factor).is_some_and(Constant::is_one);
        if !factors.iter().all(|&factor| is_one(factor)) {
            factors.retain(|&factor| !is_one(factor));
        }
        factors.sort_by_key(|&factor| self.rank(factor));
        let several = factors.len() > 1;
        let write = |equal: &[NodeId]| match equal {
            [factor] if several => self.expression(*factor).within(PRODUCT),
            [factor] => self.expression(*factor).within(QUOTIENT),
            _ => self.power(equal[0], equal.len() as i32),
        };
        factors.chunk_by(|a, b| a == b).map(write).collect::<Vec<_>>().join(" ")
    }

    fn rank(&self, factor: NodeId) -> (u8, NodeId) {
        let rank = match self.graph.node(factor) {
            _ if self.is_named(factor) => 1,
            Node::Constant(_) => 0,
            Node::Symbol(_) => 1,
            Node::Powi(base, _) => return (self.rank(base).0, base),
            Node::HalfAngleSquared(..) => 2,
            Node::Sin(_) | Node::Cos(_) | Node::Asin(_) | Node::Sqrt(_) | Node::LessThan(..) => 3,
            _ => 4,
        };
        (rank, factor)
    }

    fn function(&self, name: &str, exponent: i32, argument: NodeId) -> String {
        let name = self.notation.function(name, exponent);
        let argument = self.expression(argument);
        match argument.strength {
            ATOM => format!("{name} {}", argument.text),
            _ => format!("{name}({})", argument.text),
        }
    }

    /// A positive power of a sine or cosine has its exponent at the name; `sin⁻¹` would be read as an arc sine.
    fn power(&self, base: NodeId, exponent: i32) -> String {
        match self.graph.node(base) {
            Node::Sin(argument) if exponent > 0 && !self.is_named(base) => self.function("sin", exponent, argument),
            Node::Cos(argument) if exponent > 0 && !self.is_named(base) => self.function("cos", exponent, argument),
            _ => self.notation.raised(&self.expression(base).within(ATOM), exponent),
        }
    }
}

/// The coordinate at position `i` of `q`.
fn coordinate(i: usize) -> String {
    format!("{}{}", ["φ", "θ"][i % 2], i / 2 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::{from_json, to_json};
    use crate::kernels::Input;

    fn kernel(graph: Graph, node: NodeId) -> Kernel {
        let symbols: Vec<String> = graph.symbols().iter().map(|symbol| symbol.name.clone()).collect();
        let inputs = symbols.iter().map(|name| Input::symbols(&graph, name, "", &[name])).collect();
        let outputs = vec![Output::scalar("value", "the value", Unit::ONE, node)];
        Kernel { name: "example".into(), summary: "An example.".into(), graph, inputs, outputs }
    }

    fn written(build: impl FnOnce(&mut Graph, [NodeId; 2]) -> NodeId) -> [String; 2] {
        let mut graph = Graph::raw();
        let symbols = ["a", "b"].map(|name| graph.symbol(name, name, Unit::ONE));
        let node = build(&mut graph, symbols);
        let notations: [&dyn Notation; 2] = [&Text, &notation::Latex];
        notations.map(|notation| Printer::plain(&graph, notation).expression(node).text)
    }

    #[test]
    fn operators_keep_their_meaning_in_both_notations() {
        let quotients = written(|g, [a, b]| {
            let (first, second) = (g.div(a, b), g.div(b, a));
            let product = g.mul(first, second);
            g.sub(product, first)
        });
        assert_eq!(quotients, ["(a/b) (b/a) − a/b", "\\frac{a}{b} \\frac{b}{a} - \\frac{a}{b}"]);
        let functions = written(|g, [a, b]| {
            let (less, angle, root) = (g.less_than(a, b), g.asin(a), g.sqrt(b));
            let product = g.mul(less, angle);
            g.div(product, root)
        });
        assert_eq!(functions, ["[a < b] asin a/√(b)", "\\frac{[a < b] \\arcsin a}{\\sqrt{b}}"]);
        let powers = written(|g, [a, b]| {
            let (sin, root, sum) = (g.sin(a), g.sqrt(b), g.add(a, b));
            let powers = [g.powi(sin, 2), g.powi(sin, -1), g.powi(root, 2), g.powi(sum, 3)];
            let constant = g.constant(Constant::Float(-2.5e-9));
            let sum = g.sum(powers);
            g.add(constant, sum)
        });
        let latex = "-2.5 \\cdot 10^{-9} + \\sin^{2} a + (\\sin a)^{-1} + (\\sqrt{b})^{2} + (a + b)^{3}";
        assert_eq!(powers, ["−2.5e-9 + sin² a + (sin a)⁻¹ + (√(b))² + (a + b)³", latex]);
        let derivative = written(|g, [a, _]| g.intern(Node::HalfAngleSquared(2, a)));
        assert_eq!(derivative, ["S″(a)", "S''(a)"]);
    }

    #[test]
    fn a_chain_of_a_million_operations_is_printed() {
        const LENGTH: usize = 1_000_000;
        let mut graph = Graph::raw();
        let (a, b) = (graph.symbol("a", "a", Unit::ONE), graph.symbol("b", "b", Unit::ONE));
        let mut node = a;
        for i in 0..LENGTH {
            node = match i % 6 {
                0 => graph.intern(Node::Sin(node)),
                1 => graph.intern(Node::Neg(node)),
                2 => graph.intern(Node::Add(b, node)),
                3 => graph.intern(Node::Div(b, node)),
                4 => graph.intern(Node::Mul(node, b)),
                _ => graph.intern(Node::Sub(b, node)),
            };
        }
        // What the printer is given has passed the reader.
        let file = to_json(&[kernel(graph, node)], "a test").expect("the chain can be written");
        let kernels = from_json(&file).expect("the chain can be read").kernels;
        for form in [Form::Text, Form::Latex, Form::Markdown] {
            let page = kernels_page(form, &kernels);
            assert!(page.contains("value = ") || page.contains("\\mathrm{value} &= "));
            let longest = page.lines().map(str::len).max();
            assert!(longest < Some(400), "{longest:?}");
        }
    }

    fn kernels_page(form: Form, kernels: &[Kernel]) -> String {
        super::kernels(form, "A graph", kernels, "bristle")
    }

    #[test]
    fn sums_of_one_kind_are_cut_too() {
        let mut graph = Graph::raw();
        let a = graph.symbol("a", "a", Unit::ONE);
        let sum = (0..100_000).fold(a, |sum, _| graph.intern(Node::Add(a, sum)));
        let page = kernels_page(Form::Text, &[kernel(graph, sum)]);
        assert!(page.contains("t2 = a + a") && page.lines().all(|line| line.chars().count() <= 110));
    }

    #[test]
    fn what_comes_from_a_file_is_escaped() {
        let mut graph = Graph::raw();
        let hostile = graph.symbol("hostile", "}\\input{/etc/passwd}$_^#&%~<b>|漢\u{202e}", Unit::ONE);
        let mut kernel = kernel(graph, hostile);
        kernel.summary = "\\end{document} $ % & # _ ^ ~ <script> `\\def\\x{` [`a`] 漢 --> *b* |".into();
        let latex = kernels_page(Form::Latex, std::slice::from_ref(&kernel));
        assert!(latex.is_ascii());
        for command in ["\\input{", "\\def", "\\end{document} "] {
            assert!(!latex.contains(command), "{command}");
        }
        let markdown = kernels_page(Form::Markdown, &[kernel]);
        assert!(!markdown.contains("<script>") && !markdown.contains("<b>"), "{markdown}");
    }
}
