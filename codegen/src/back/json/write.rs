//! Writes a file of kernels.

use serde::ser::Error as _;

use crate::back::json::format::{
    FORMAT, InputEntry, OutputEntry, UnitCode, VERSION, name_and_parameter,
};
use crate::fingerprint::digest;
use crate::ir::constant::Constant;
use crate::ir::graph::{Graph, Node, NodeId};
use crate::ir::kernel::Kernel;

/// Writes a file with one operation per line. The same kernels give the same bytes.
///
/// `generator` names the maker in one line.
///
/// # Errors
/// If a constant is not finite.
pub fn to_json(kernels: &[Kernel], generator: &str) -> serde_json::Result<String> {
    let generator = serde_json::to_string(generator)?;
    let mut text = format!(
        "{{\"format\":\"{FORMAT}\",\"version\":{VERSION},\n\"generator\":{generator},\n\"kernels\":["
    );
    for (i, kernel) in kernels.iter().enumerate() {
        text.push_str(if i == 0 { "\n" } else { ",\n" });
        write_kernel(&mut text, kernel)?;
    }
    text.push_str("\n]}\n");
    Ok(text)
}

fn write_kernel(text: &mut String, kernel: &Kernel) -> serde_json::Result<()> {
    let roots = kernel
        .outputs
        .iter()
        .flat_map(|output| output.nodes.iter().copied());
    let arguments = kernel
        .inputs
        .iter()
        .flat_map(|input| input.elements.iter().map(|(_, node)| *node));
    let live = kernel
        .graph
        .reachable(&roots.chain(arguments).collect::<Vec<_>>());
    let mut positions = vec![0; live.last().map_or(0, |id| id.index() + 1)];
    for (position, id) in live.iter().enumerate() {
        positions[id.index()] = position;
    }
    let position = |id: NodeId| positions[id.index()];
    let inputs: Vec<InputEntry> = kernel
        .inputs
        .iter()
        .map(|input| InputEntry {
            name: input.name.clone(),
            doc: input.doc.clone(),
            elements: input
                .elements
                .iter()
                .map(|(name, node)| (name.clone(), position(*node)))
                .collect(),
        })
        .collect();
    let outputs: Vec<OutputEntry> = kernel
        .outputs
        .iter()
        .map(|output| OutputEntry {
            name: output.name.clone(),
            doc: output.doc.clone(),
            unit: UnitCode(output.unit),
            shape: output.shape.sizes(),
            operations: output.nodes.iter().copied().map(position).collect(),
        })
        .collect();
    let (name, summary) = (
        serde_json::to_string(&kernel.name)?,
        serde_json::to_string(&kernel.summary)?,
    );
    let inputs = serde_json::to_string(&inputs)?;
    text.push_str(&format!(
        "{{\"name\":{name},\"summary\":{summary},\n\"inputs\":{inputs},\n\"operations\":[\n"
    ));
    for (i, &id) in live.iter().enumerate() {
        text.push_str(if i == 0 { "" } else { ",\n" });
        text.push_str(&operation(&kernel.graph, id, position)?);
    }
    let outputs = serde_json::to_string(&outputs)?;
    text.push_str(&format!("\n],\n\"outputs\":{outputs}}}"));
    Ok(())
}

fn operation(
    graph: &Graph,
    id: NodeId,
    position: impl Fn(NodeId) -> usize,
) -> serde_json::Result<String> {
    let node = graph.node(id);
    let (name, parameter) = name_and_parameter(node);
    match node {
        Node::Constant(Constant::Rational(value)) => {
            serde_json::to_string(&(name, value.numer(), value.denom()))
        }
        Node::Constant(Constant::Float(value)) => {
            if !value.is_finite() {
                return Err(serde_json::Error::custom(format!(
                    "the constant {value} is not finite"
                )));
            }
            serde_json::to_string(&(name, value))
        }
        Node::Symbol(symbol) => {
            let symbol = &graph.symbols()[symbol.index()];
            serde_json::to_string(&(name, &symbol.name, &symbol.notation, symbol.unit.code()))
        }
        _ => {
            let mut text = format!("[\"{name}\"");
            for integer in node
                .operands()
                .map(|operand| position(operand) as i64)
                .chain(parameter)
            {
                text.push_str(&format!(",{integer}"));
            }
            text.push(']');
            Ok(text)
        }
    }
}

/// SHA-256 of the kernels in this format with an empty generator, in hexadecimal digits: it
/// identifies the expressions, whatever made them.
///
/// # Errors
/// If a constant is not finite.
pub fn fingerprint(kernels: &[Kernel]) -> serde_json::Result<String> {
    Ok(digest(to_json(kernels, "")?.as_bytes()))
}
