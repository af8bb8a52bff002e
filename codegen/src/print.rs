//! Expressions as readable mathematics, in the notation of the model.

use std::collections::{BTreeMap, BTreeSet};

use crate::constant::Constant;
use crate::graph::{Graph, Node, NodeId};
use crate::kernels::{Kernel, Output, Shape};
use crate::unit::{Unit, superscript};

/// Lines are broken before they are longer than this, where a sum allows it.
const LINE_WIDTH: usize = 110;

const LEGEND: &str = "\
Symbols (SI units, angles in rad)
  φk, θk        polar angle from +z and azimuth about z of segment k = 1 … n; a dot is a time derivative
  r0, e0        root and unit vector of the clamp, with their rates: the motion that the tool prescribes
  h, m, J       length, mass, and transverse moment of inertia about the centre of a segment
  c1, c         stiffness of the clamp joint and of the other joints, N m
  d1, d         damping of the clamp joint and of the other joints, N m s
  g             gravitational acceleration
  S(u)          ½ arccos²(1 − u) = ½ α² for u = 1 − cos α, α the angle between two segments; S′ its derivative";

/// The equations of motion of a chain of `segments` segments, as text.
///
/// `kernels` are those of [`crate::whole::whole_kernels`].
pub fn equations(segments: usize, kernels: &[Kernel]) -> String {
    let plural = if segments == 1 { "" } else { "s" };
    let mut text = format!(
        "Equations of motion of a filament of {segments} rigid segment{plural}\n\n\
         M(q) q̈ = f(q, q̇, t) + Q,   q = (φ1, θ1, …, φn, θn),   n = {segments}\n\
         from d/dt(∂L/∂q̇) − ∂L/∂q + ∂D/∂q̇ = Q,   L = E_kin − E_spring − E_grav\n\n{LEGEND}\n"
    );
    for kernel in kernels {
        text.push('\n');
        text.push_str(&kernel.summary.replace('`', ""));
        text.push('\n');
        text.push_str(&definitions(kernel));
    }
    text
}

/// The outputs of a kernel, a definition each; zeros and the lower triangle of a symmetric matrix are left out.
fn definitions(kernel: &Kernel) -> String {
    let printer = Printer::new(kernel);
    let mut text = String::new();
    let mut arguments: Vec<_> = printer.arguments.iter().collect();
    arguments.sort_by_key(|(_, name)| (name.len(), name.as_str()));
    for (node, name) in arguments {
        text.push_str(&wrapped(&format!("  {name} = "), &printer.operation(*node, 0)));
    }
    for output in &kernel.outputs {
        for (label, node) in elements(output) {
            if !kernel.graph.is_zero(node) {
                text.push_str(&wrapped(&format!("  {label} = "), &printer.expression(node, 0)));
            }
        }
    }
    text
}

fn elements(output: &Output) -> Vec<(String, NodeId)> {
    let coordinate = |i: usize| format!("{}{}", ["φ", "θ"][i % 2], i / 2 + 1);
    let symbol = match output.name.as_str() {
        "mass_matrix" => "M",
        "force" => "f",
        "kinetic" => "E_kin",
        "spring" => "E_spring",
        "gravity" => "E_grav",
        "dissipation" => "D",
        name => name,
    };
    let indexed = output.nodes.iter().copied().enumerate();
    match output.shape {
        Shape::Scalar => vec![(symbol.into(), output.nodes[0])],
        Shape::Vector(_) => indexed.map(|(i, node)| (format!("{symbol}[{}]", coordinate(i)), node)).collect(),
        Shape::Matrix(_, columns) => indexed
            .map(|(i, node)| (i / columns, i % columns, node))
            .filter(|(row, column, _)| row <= column)
            .map(|(row, column, node)| (format!("{symbol}[{}, {}]", coordinate(row), coordinate(column)), node))
            .collect(),
    }
}

/// `head` and `body`, broken before signs that stand outside all brackets or in the outermost pair, and continued
/// below the body.
fn wrapped(head: &str, body: &str) -> String {
    let indent = head.chars().count();
    let mut text = head.to_string();
    let mut width = indent;
    for piece in split_terms(body) {
        let length = piece.chars().count();
        let piece = if width + length > LINE_WIDTH && width > indent {
            text.push('\n');
            text.push_str(&" ".repeat(indent));
            width = indent;
            piece.trim_start()
        } else {
            &piece
        };
        text.push_str(piece);
        width += piece.chars().count();
    }
    text.push('\n');
    text
}

/// The terms of `body`, each but the first with its sign and the space before it.
fn split_terms(body: &str) -> Vec<String> {
    let mut pieces = vec![String::new()];
    let mut depth = 0;
    let mut characters = body.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ' ' if depth <= 1 && matches!(characters.peek(), Some('+' | '−')) => pieces.push(String::new()),
            _ => {}
        }
        pieces.last_mut().expect("there is a first piece").push(character);
    }
    pieces
}

/// Operations of an [`excerpt`] below this depth are left out, and characters beyond this number.
const EXCERPT_DEPTH: usize = 5;
const EXCERPT_LENGTH: usize = 120;

/// The outer operations of `id` as text, for messages; an ellipsis stands for what is left out.
pub fn excerpt(graph: &Graph, id: NodeId) -> String {
    let mut copy = Graph::raw();
    let top = copy_levels(graph, id, &mut copy, EXCERPT_DEPTH);
    let text = Printer { graph: &copy, arguments: BTreeMap::new() }.expression(top, 0);
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

/// Binding strengths.
const SUM: u8 = 1;
const PRODUCT: u8 = 2;
const POWER: u8 = 3;

struct Printer<'a> {
    graph: &'a Graph,
    /// Arguments of `S`, which get a name each.
    arguments: BTreeMap<NodeId, String>,
}

impl<'a> Printer<'a> {
    fn new(kernel: &'a Kernel) -> Self {
        let outputs: Vec<NodeId> = kernel.outputs.iter().flat_map(|output| output.nodes.iter().copied()).collect();
        let arguments: BTreeSet<NodeId> = kernel
            .graph
            .reachable(&outputs)
            .into_iter()
            .filter_map(|id| match kernel.graph.node(id) {
                Node::HalfAngleSquared(_, argument) => Some(argument),
                _ => None,
            })
            .collect();
        // In the order of the joints: the outermost segment that an argument depends on tells the joint.
        let mut arguments: Vec<NodeId> = arguments.into_iter().collect();
        arguments.sort_by_key(|&argument| {
            let needed = kernel.graph.reachable(&[argument]);
            needed.into_iter().filter(|&id| kernel.graph.symbol_name(id).is_some()).max()
        });
        let names = (1..).map(|joint| format!("u{joint}"));
        Self { graph: &kernel.graph, arguments: arguments.into_iter().zip(names).collect() }
    }

    /// `id` as text, in parentheses if it binds less than `context`.
    fn expression(&self, id: NodeId, context: u8) -> String {
        match self.arguments.get(&id) {
            Some(name) => name.clone(),
            None => self.operation(id, context),
        }
    }

    fn operation(&self, id: NodeId, context: u8) -> String {
        let of = |id, context| self.expression(id, context);
        let (text, strength) = match self.graph.node(id) {
            Node::Constant(value) => {
                let strength = if value.is_negative() { SUM } else { PRODUCT };
                (number(value), strength)
            }
            Node::Symbol(symbol) => return self.graph.symbols()[symbol.index()].notation.clone(),
            Node::Add(..) | Node::Sub(..) => (self.sum(id), SUM),
            Node::Neg(a) => (format!("−{}", of(a, PRODUCT)), SUM),
            Node::Mul(a, b) => match self.graph.as_constant(a) {
                Some(factor) if factor.is_negative() => {
                    let rest = if factor.is_minus_one() { String::new() } else { format!("{} ", number(-factor)) };
                    (format!("−{rest}{}", of(b, PRODUCT)), SUM)
                }
                _ => (self.product(id), PRODUCT),
            },
            Node::Div(a, b) => (format!("{}/{}", of(a, PRODUCT), of(b, POWER)), PRODUCT),
            Node::Powi(a, exponent) => return self.power(a, exponent),
            Node::Sqrt(a) => (format!("√({})", of(a, 0)), POWER),
            Node::Sin(a) => (self.function("sin", a), POWER),
            Node::Cos(a) => (self.function("cos", a), POWER),
            Node::Asin(a) => (self.function("asin", a), POWER),
            Node::LessThan(a, b) => (format!("[{} < {}]", of(a, 0), of(b, 0)), POWER),
            Node::HalfAngleSquared(order, a) => {
                let primes = "′".repeat(order.into());
                (format!("S{primes}({})", of(a, 0)), POWER)
            }
        };
        if strength < context { format!("({text})") } else { text }
    }

    /// The terms with their signs. Without recursion: a sum can have more terms than the stack has room for.
    fn sum(&self, id: NodeId) -> String {
        let mut text = String::new();
        let mut pending = vec![(id, false)];
        while let Some((id, negative)) = pending.pop() {
            match self.graph.node(id) {
                Node::Add(a, b) if !self.arguments.contains_key(&id) || text.is_empty() => {
                    pending.extend([(b, negative), (a, negative)]);
                }
                Node::Sub(a, b) if !self.arguments.contains_key(&id) || text.is_empty() => {
                    pending.extend([(b, !negative), (a, negative)]);
                }
                _ => {
                    let first = text.is_empty() && !negative;
                    let term = self.expression(id, if first { SUM } else { PRODUCT });
                    text.push_str(match (text.is_empty(), negative) {
                        (true, false) => "",
                        (true, true) => "−",
                        (false, false) => " + ",
                        (false, true) => " − ",
                    });
                    text.push_str(&term);
                }
            }
        }
        text
    }

    /// The factors in the customary order: numbers, symbols, functions, sums.
    fn product(&self, id: NodeId) -> String {
        let mut factors = Vec::new();
        let mut pending = vec![id];
        while let Some(id) = pending.pop() {
            match self.graph.node(id) {
                Node::Mul(a, b) if !self.arguments.contains_key(&id) => pending.extend([b, a]),
                _ => factors.push(id),
            }
        }
        factors.sort_by_key(|&factor| self.rank(factor));
        factors.into_iter().map(|factor| self.expression(factor, PRODUCT)).collect::<Vec<_>>().join(" ")
    }

    fn rank(&self, factor: NodeId) -> (u8, NodeId) {
        let rank = match self.graph.node(factor) {
            Node::Constant(_) => 0,
            Node::Symbol(_) => 1,
            Node::Powi(base, _) => return (self.rank(base).0, base),
            Node::HalfAngleSquared(..) => 2,
            Node::Sin(_) | Node::Cos(_) | Node::Asin(_) | Node::Sqrt(_) | Node::LessThan(..) => 3,
            _ => 4,
        };
        (rank, factor)
    }

    fn function(&self, name: &str, argument: NodeId) -> String {
        match self.graph.node(argument) {
            Node::Symbol(_) => format!("{name} {}", self.expression(argument, 0)),
            _ => format!("{name}({})", self.expression(argument, 0)),
        }
    }

    fn power(&self, base: NodeId, exponent: i32) -> String {
        let digits = superscript(exponent);
        match self.graph.node(base) {
            Node::Sin(argument) => self.function(&format!("sin{digits}"), argument),
            Node::Cos(argument) => self.function(&format!("cos{digits}"), argument),
            Node::Symbol(_) => format!("{}{digits}", self.expression(base, 0)),
            _ => format!("({}){digits}", self.expression(base, 0)),
        }
    }
}

/// Common fractions as one character.
fn number(value: Constant) -> String {
    const FRACTIONS: [((i64, i64), &str); 8] = [
        ((1, 2), "½"),
        ((1, 3), "⅓"),
        ((2, 3), "⅔"),
        ((1, 4), "¼"),
        ((3, 4), "¾"),
        ((1, 8), "⅛"),
        ((3, 8), "⅜"),
        ((5, 8), "⅝"),
    ];
    let fraction =
        FRACTIONS.iter().find(|((numerator, denominator), _)| value == Constant::ratio(*numerator, *denominator));
    fraction.map_or_else(|| value.to_string(), |(_, text)| text.to_string())
}
