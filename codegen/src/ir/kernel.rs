//! A function to emit: expressions under names, with named inputs and outputs.

use std::collections::{BTreeSet, HashSet};

use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::unit::Unit;

/// A function to emit: named inputs, expressions, named outputs.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Name of the function; in camel case, the type of its result.
    pub name: String,
    /// Description of the function, in the words and symbols of the model. May have several lines.
    pub summary: String,
    /// The graph that holds the expressions.
    pub graph: Graph,
    /// The arguments, in order.
    pub inputs: Vec<KernelInput>,
    /// The fields of the result, in order.
    pub outputs: Vec<Output>,
}

impl Kernel {
    /// The elements of all outputs, in order.
    pub fn output_nodes(&self) -> Vec<NodeId> {
        output_nodes(&self.outputs)
    }

    /// The nodes that the outputs need and the inputs do not give, operands before users.
    pub fn computed(&self) -> Vec<NodeId> {
        let elements = self.inputs.iter().flat_map(|input| &input.elements);
        let given: HashSet<NodeId> = elements.map(|&(_, node)| node).collect();
        let mut live: BTreeSet<NodeId> = BTreeSet::new();
        let mut pending = self.output_nodes();
        while let Some(id) = pending.pop() {
            if !given.contains(&id) && live.insert(id) {
                pending.extend(computed_operands(self.graph.node(id)));
            }
        }
        live.into_iter().collect()
    }

    /// A symbol that the outputs need and no input gives.
    pub fn unbound_symbol(&self) -> Option<&str> {
        self.computed()
            .into_iter()
            .find_map(|id| self.graph.symbol_name(id))
    }
}

/// The operands whose values an operation needs: all except the base of a zeroth power.
pub fn computed_operands(node: Node) -> impl Iterator<Item = NodeId> {
    node.operands()
        .filter(move |_| !matches!(node, Node::Powi(_, 0)))
}

/// An argument of a [`Kernel`]: a scalar, or an array of scalars.
#[derive(Clone, Debug)]
pub struct KernelInput {
    /// Name of the argument.
    pub name: String,
    /// Description with unit.
    pub doc: String,
    /// Its elements: a local name and a node each. One element makes a scalar.
    pub elements: Vec<(String, NodeId)>,
    /// Its place in a structure, in languages whose arguments are structures.
    pub place: Option<GroupPlace>,
}

/// A structure of inputs that belong together.
#[derive(Debug, PartialEq, Eq)]
pub struct InputGroup {
    /// Name of the type.
    pub name: &'static str,
    /// Description, for its documentation.
    pub doc: &'static str,
    /// Its fields, with their descriptions.
    pub fields: &'static [(&'static str, &'static str)],
}

/// The place of a [`KernelInput`] in an [`InputGroup`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GroupPlace {
    /// The structure.
    pub group: &'static InputGroup,
    /// Name of the argument that is this structure.
    pub argument: String,
    /// Name of the field.
    pub field: &'static str,
}

impl KernelInput {
    /// Creates an input from named elements, as an argument of its own.
    pub fn new(name: &str, doc: &str, elements: Vec<(String, NodeId)>) -> Self {
        Self {
            name: name.into(),
            doc: doc.into(),
            elements,
            place: None,
        }
    }

    /// Makes the input a field of `argument`.
    pub fn in_group(self, group: &'static InputGroup, argument: &str, field: &'static str) -> Self {
        Self {
            place: Some(GroupPlace {
                group,
                argument: argument.into(),
                field,
            }),
            ..self
        }
    }

    /// Creates an argument from the symbols `names` of `graph`.
    ///
    /// # Panics
    /// If the graph has no such symbol.
    pub fn symbols(graph: &Graph, name: &str, doc: &str, names: &[&str]) -> Self {
        let find = |symbol: &&str| {
            let node = graph
                .find_symbol(symbol)
                .unwrap_or_else(|| panic!("`{symbol}` is a symbol of the graph"));
            (symbol.to_string(), node)
        };
        Self::new(name, doc, names.iter().map(find).collect())
    }
}

/// The shape of an [`Output`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputShape {
    /// One value.
    Scalar,
    /// This many values.
    Vector(usize),
    /// Rows, columns; stored by rows.
    Matrix(usize, usize),
}

impl OutputShape {
    /// Numbers of rows and columns, as far as the shape has them.
    pub fn sizes(self) -> Vec<usize> {
        match self {
            Self::Scalar => Vec::new(),
            Self::Vector(length) => vec![length],
            Self::Matrix(rows, columns) => vec![rows, columns],
        }
    }
}

/// A field of a kernel's result.
#[derive(Clone, Debug)]
pub struct Output {
    /// Name of the field.
    pub name: String,
    /// Description.
    pub doc: String,
    /// Unit of its elements.
    pub unit: Unit,
    /// Its shape.
    pub shape: OutputShape,
    /// Its elements, row by row.
    pub nodes: Vec<NodeId>,
}

impl Output {
    /// Creates a scalar output.
    pub fn scalar(name: &str, doc: &str, unit: Unit, node: NodeId) -> Self {
        Self {
            name: name.into(),
            doc: doc.into(),
            unit,
            shape: OutputShape::Scalar,
            nodes: vec![node],
        }
    }

    /// Creates an output of several values.
    pub fn vector(name: &str, doc: &str, unit: Unit, nodes: Vec<NodeId>) -> Self {
        Self {
            name: name.into(),
            doc: doc.into(),
            unit,
            shape: OutputShape::Vector(nodes.len()),
            nodes,
        }
    }

    /// Creates an output of rows of values.
    pub fn matrix(name: &str, doc: &str, unit: Unit, rows: Vec<Vec<NodeId>>) -> Self {
        let shape = OutputShape::Matrix(rows.len(), rows.first().map_or(0, Vec::len));
        Self {
            name: name.into(),
            doc: doc.into(),
            unit,
            shape,
            nodes: rows.concat(),
        }
    }

    /// The unit, as it follows the description.
    pub fn in_unit(&self) -> String {
        if self.unit == Unit::ONE {
            String::new()
        } else {
            format!(", in {}", self.unit)
        }
    }
}

/// The elements of `outputs`, in order.
pub fn output_nodes(outputs: &[Output]) -> Vec<NodeId> {
    outputs
        .iter()
        .flat_map(|output| output.nodes.iter().copied())
        .collect()
}

/// Replaces the nodes of `outputs`, in the order of [`output_nodes`].
pub fn set_output_nodes(outputs: &mut [Output], nodes: Vec<NodeId>) {
    let mut nodes = nodes.into_iter();
    for output in outputs {
        output.nodes = nodes.by_ref().take(output.nodes.len()).collect();
    }
}
