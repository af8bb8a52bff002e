//! Definitions of a page: selection of the intermediates with a name, and names of the elements of
//! outputs.

use std::collections::HashSet;

use crate::print::page::Definition;
use bristle_codegen::ir::graph::{Graph, Node, NodeId};
use bristle_codegen::ir::kernel::{Kernel, Output, OutputShape};
use bristle_codegen::ir::notation::{Notation, Text};
use bristle_codegen::ir::writer::Writer;
use bristle_codegen::model::chain::Motion;

/// Layout of a page, besides the notation of its expressions.
pub(super) trait PageLayout: Notation {
    /// An element of a vector or matrix.
    fn element(&self, array: &str, indices: &[String]) -> String;
    /// The width of a piece, in the unit of the notation.
    fn width(&self, text: &str) -> usize;
}

impl PageLayout for Text {
    fn element(&self, array: &str, indices: &[String]) -> String {
        format!("{array}[{}]", indices.join(", "))
    }

    fn width(&self, text: &str) -> usize {
        text.chars().count()
    }
}

/// Maximum depth of an expression; a name cuts deeper ones.
const MAX_DEPTH: usize = 6;
/// Maximum number of symbols and numbers in an expression; a name cuts longer ones.
const MAX_LENGTH: usize = 60;

/// Writes the expressions of one graph.
pub(super) struct Printer<'a> {
    graph: &'a Graph,
    notation: &'a dyn PageLayout,
    writer: Writer<'a>,
    /// The nodes that get a definition, in the order in which they are defined.
    defined: Vec<NodeId>,
    /// `true` if the node is an input under its name, by index.
    given: Vec<bool>,
    /// The motion whose coordinates are the rows and columns of all outputs, if they are.
    motion: Option<Motion>,
}

impl<'a> Printer<'a> {
    /// A printer without names.
    fn plain(graph: &'a Graph, notation: &'a dyn PageLayout) -> Self {
        let (writer, given) = (
            Writer::new(graph, notation),
            vec![false; graph.nodes().len()],
        );
        Self {
            graph,
            notation,
            writer,
            defined: Vec::new(),
            given,
            motion: None,
        }
    }

    /// Creates a printer of whole equations of `motion` in closed form: only the arguments of `S`
    /// are named.
    pub fn closed(
        graph: &'a Graph,
        outputs: &[NodeId],
        motion: Motion,
        notation: &'a dyn PageLayout,
    ) -> Self {
        let mut printer = Self {
            motion: Some(motion),
            ..Self::plain(graph, notation)
        };
        let mut arguments: Vec<NodeId> = graph
            .reachable(outputs)
            .into_iter()
            .filter_map(|id| match graph.node(id) {
                Node::HalfAngleSquared(_, argument) => Some(argument),
                _ => None,
            })
            .collect();
        // The order is that of the joints: the outermost segment of an argument identifies its
        // joint.
        arguments.sort_unstable();
        arguments.dedup();
        arguments.sort_by_key(|&argument| {
            let needed = graph.reachable(&[argument]);
            needed
                .into_iter()
                .filter(|&id| graph.symbol_name(id).is_some())
                .max()
        });
        for (i, &argument) in arguments.iter().enumerate() {
            printer
                .writer
                .set_name(argument, notation.symbol(&format!("u{}", i + 1)));
        }
        printer.defined = arguments;
        printer
    }

    /// Creates a printer with a name for each operation that is used more than once, or that cuts a
    /// deep or long expression.
    pub fn shared(kernel: &'a Kernel, notation: &'a dyn PageLayout) -> Self {
        let graph = &kernel.graph;
        let mut printer = Self::plain(graph, notation);
        let size = graph.nodes().len();
        // An input that is not a simple function of symbols is shown under its name.
        let mut is_input = vec![false; size];
        for (name, node) in kernel.inputs.iter().flat_map(|input| &input.elements) {
            is_input[node.index()] = true;
            if !printer.is_simple(*node, 4) {
                printer.given[node.index()] = true;
                printer.writer.set_name(*node, notation.symbol(name));
            }
        }
        let outputs = kernel.output_nodes();
        let order = graph.reachable_until(&outputs, |id| printer.is_given(id));
        let mut uses = vec![0_u32; size];
        let operands = order
            .iter()
            .filter(|id| !printer.given[id.index()])
            .flat_map(|&id| graph.node(id).operands());
        for operand in operands.chain(outputs) {
            uses[operand.index()] += 1;
        }
        let symbols = graph
            .symbols()
            .iter()
            .map(|symbol| symbol.notation.as_str());
        let elements = kernel.inputs.iter().flat_map(|input| &input.elements);
        let taken: HashSet<String> = symbols
            .chain(elements.map(|(name, _)| name.as_str()))
            .chain(kernel.outputs.iter().map(symbol))
            .map(|name| notation.symbol(name))
            .collect();
        let mut names = (1..)
            .map(|number| notation.symbol(&format!("t{number}")))
            .filter(|name| !taken.contains(name));
        let (mut depths, mut lengths) = (vec![0_usize; size], vec![1_usize; size]);
        for &id in &order {
            if printer.given[id.index()] {
                continue;
            }
            let node = graph.node(id);
            let is_sum = |node: Node| matches!(node, Node::Add(..) | Node::Sub(..));
            for operand in node.operands() {
                // The terms of a sum are on one level, however its additions are nested.
                let same_level = is_sum(node) && is_sum(graph.node(operand));
                let depth = depths[operand.index()] + usize::from(!same_level);
                depths[id.index()] = depths[id.index()].max(depth);
            }
            lengths[id.index()] = node
                .operands()
                .map(|operand| lengths[operand.index()])
                .sum::<usize>()
                .max(1);
            let shared = uses[id.index()] > 1
                && !printer.is_simple(id, if is_input[id.index()] { 4 } else { 2 });
            if shared || depths[id.index()] > MAX_DEPTH || lengths[id.index()] > MAX_LENGTH {
                printer.defined.push(id);
                let name = names.next().expect("there are more names than nodes");
                printer.writer.set_name(id, name);
                (depths[id.index()], lengths[id.index()]) = (0, 1);
            }
        }
        printer
    }

    /// `true` if `id` is an input that the page shows under its own name.
    pub fn is_given(&self, id: NodeId) -> bool {
        self.given[id.index()]
    }

    /// `true` for a node as short as a name: a symbol, its sine, a power of these, and with more
    /// `levels` the sine of a difference.
    fn is_simple(&self, id: NodeId, levels: u8) -> bool {
        let below = |operand| levels > 0 && self.is_simple(operand, levels - 1);
        match self.graph.node(id) {
            Node::Constant(_) | Node::Symbol(_) => true,
            Node::Sin(a) | Node::Cos(a) | Node::Powi(a, _) => below(a),
            Node::Add(a, b) | Node::Sub(a, b) => levels > 2 && below(a) && below(b),
            _ => false,
        }
    }

    /// The definitions of the named intermediates.
    pub fn named_definitions(&self) -> impl Iterator<Item = Definition> {
        let definition = move |&id: &NodeId| Definition {
            head: self.writer.name(id).to_owned(),
            body: self.writer.operation(id).within(0),
        };
        self.defined.iter().map(definition)
    }

    /// Width of the widest name at the start of a definition of an intermediate or an element.
    pub fn head_width(&self, outputs: &[Output]) -> usize {
        let width = |text: &str| self.notation.width(text);
        let widest = |count: usize| {
            let of_index = |&i: &usize| width(&self.notation.symbol(&self.index(i)));
            (0..count).max_by_key(of_index).unwrap_or(0)
        };
        let of_output = |output: &Output| {
            let indices: Vec<usize> = output.shape.sizes().into_iter().map(widest).collect();
            width(&self.head(output, &indices))
        };
        let named = self.defined.iter().map(|&id| width(self.writer.name(id)));
        named
            .chain(outputs.iter().map(of_output))
            .max()
            .unwrap_or(0)
    }

    /// A vector or a matrix by its elements, as [`Printer::output`] names them; `None` if it is a
    /// scalar, zero, or wider than `width`. Dots replace all but the first and last rows or columns
    /// where amsmath has too few, or where the matrix is too wide.
    pub fn whole(&self, output: &Output, width: usize) -> Option<Definition> {
        /// The largest number of columns in amsmath's matrices.
        const MAX_COLUMNS: usize = 10;
        /// Numbers of leading rows and columns before dots.
        const LEADING: [usize; 2] = [2, 1];
        let (rows, columns) = match output.shape {
            OutputShape::Scalar => return None,
            OutputShape::Vector(rows) => (rows, 1),
            OutputShape::Matrix(rows, columns) => (rows, columns),
        };
        if output.nodes.iter().all(|&node| self.graph.is_zero(node)) {
            return None;
        }
        let table = |leading: usize| {
            let [rows, columns] = [rows, columns].map(|count| shown(count, leading));
            self.table(output, &rows, &columns)
        };
        let head = self.notation.symbol(symbol(output));
        let room = width.saturating_sub(self.notation.width(&head));
        let size = rows.max(columns);
        let whole = (size <= MAX_COLUMNS).then_some(size);
        let table = whole
            .into_iter()
            .chain(LEADING)
            .map(table)
            .find(|table| self.table_width(table) <= room)?;
        let lines: Vec<String> = table.iter().map(|line| line.join(" & ")).collect();
        let body = format!(
            "\\begin{{bmatrix}} {} \\end{{bmatrix}}",
            lines.join(" \\\\ ")
        );
        Some(Definition { head, body })
    }

    /// The names of elements of a vector or a matrix, with dots for the rows and columns `None`.
    fn table(
        &self,
        output: &Output,
        rows: &[Option<usize>],
        columns: &[Option<usize>],
    ) -> Vec<Vec<String>> {
        let element = |row: usize, column: usize| {
            let (node, indices) = match output.shape {
                OutputShape::Matrix(rows, columns) => {
                    let node = output.nodes[row * columns + column];
                    let repeats = rows == columns
                        && row > column
                        && output.nodes[column * columns + row] == node;
                    let indices = if repeats {
                        vec![column, row]
                    } else {
                        vec![row, column]
                    };
                    (node, indices)
                }
                OutputShape::Vector(_) | OutputShape::Scalar => (output.nodes[row], vec![row]),
            };
            if self.graph.is_zero(node) {
                "0".to_owned()
            } else {
                self.head(output, &indices)
            }
        };
        let cell = |row: &Option<usize>, column: &Option<usize>| match (row, column) {
            (Some(row), Some(column)) => element(*row, *column),
            (Some(_), None) => "\\cdots".into(),
            (None, Some(_)) => "\\vdots".into(),
            (None, None) => "\\ddots".into(),
        };
        rows.iter()
            .map(|row| columns.iter().map(|column| cell(row, column)).collect())
            .collect()
    }

    /// Width of a matrix with its brackets.
    fn table_width(&self, table: &[Vec<String>]) -> usize {
        /// Width between columns.
        const GAP: usize = 1000;
        /// Width of both brackets.
        const BRACKETS: usize = 1500;
        let columns = table.first().map_or(0, Vec::len);
        let widest = |column: usize| {
            let widths = table.iter().map(|row| self.notation.width(&row[column]));
            widths.max().unwrap_or(0)
        };
        let elements: usize = (0..columns).map(widest).sum();
        elements + columns.saturating_sub(1) * GAP + BRACKETS
    }

    /// The name of an element.
    fn head(&self, output: &Output, indices: &[usize]) -> String {
        if indices.is_empty() {
            return self.notation.symbol(symbol(output));
        }
        let indices: Vec<String> = indices.iter().map(|&i| self.index(i)).collect();
        self.notation.element(symbol(output), &indices)
    }

    /// The index at position `i` of a vector.
    fn index(&self, i: usize) -> String {
        self.motion
            .map_or_else(|| (i + 1).to_string(), |motion| coordinate(motion, i))
    }

    /// A definition for each element, without zeros and without repetitions by symmetry.
    pub fn output(&self, output: &Output) -> impl Iterator<Item = Definition> {
        let symbol = symbol(output);
        let head = |indices: &[usize]| self.head(output, indices);
        let elements: Vec<(String, NodeId)> = match output.shape {
            OutputShape::Scalar => vec![(head(&[]), output.nodes[0])],
            OutputShape::Vector(_) => output
                .nodes
                .iter()
                .enumerate()
                .map(|(i, &node)| (head(&[i]), node))
                .collect(),
            OutputShape::Matrix(rows, columns) => (0..rows * columns)
                .map(|i| (i / columns, i % columns, output.nodes[i]))
                .filter(|&(row, column, node)| {
                    rows != columns || row <= column || output.nodes[column * columns + row] != node
                })
                .map(|(row, column, node)| (head(&[row, column]), node))
                .collect(),
        };
        let filled: Vec<_> = elements
            .into_iter()
            .filter(|(_, node)| !self.graph.is_zero(*node))
            .collect();
        let nothing = filled.is_empty().then(|| Definition {
            head: self.notation.symbol(symbol),
            body: "0".into(),
        });
        let define = |(head, node)| Definition {
            head,
            body: self.writer.expression(node).text,
        };
        nothing.into_iter().chain(filled.into_iter().map(define))
    }
}

/// Positions in a list of `count` that are shown: the first `leading` and the last, with `None` for
/// those between.
fn shown(count: usize, leading: usize) -> Vec<Option<usize>> {
    if count <= leading + 1 {
        return (0..count).map(Some).collect();
    }
    let first = (0..leading).map(Some);
    first.chain([None, Some(count - 1)]).collect()
}

/// The symbol of a result.
fn symbol(output: &Output) -> &str {
    match output.name.as_str() {
        "mass_matrix" => "M",
        "force" => "f",
        "kinetic" => "E_kin",
        "spring" => "E_spring",
        "gravity" => "E_grav",
        "dissipation" => "D",
        name => name,
    }
}

/// The coordinate at position `i` of `q`.
pub(super) fn coordinate(motion: Motion, i: usize) -> String {
    match motion {
        Motion::Spatial => format!("{}{}", ["φ", "θ"][i % 2], i / 2 + 1),
        Motion::Planar => format!("θ{}", i + 1),
    }
}
