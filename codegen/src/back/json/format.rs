//! Contents of a file: its limits, its operators, and the entries that are both read and written.

use std::fmt::{self, Formatter};
use std::marker::PhantomData;

use crate::text::shortened;
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::ir::constant::Constant;
pub use crate::ir::graph::MAX_EXPONENT;
use crate::ir::graph::{Node, NodeId};
use crate::ir::special;
use crate::ir::unit::Unit;

/// The name of the format, as files state it.
pub const FORMAT: &str = "bristle-graph";
/// The version of the format that is written and read.
pub const VERSION: u32 = 3;

/// Maximum size of a file, in bytes.
pub const MAX_BYTES: usize = 256 << 20;
/// Maximum number of kernels in a file.
pub const MAX_KERNELS: usize = 1000;
/// Maximum number of operations in a kernel, and of multiplications that its powers amount to.
pub const MAX_OPERATIONS: usize = 8_000_000;
/// Maximum number of inputs, and of outputs, of a kernel.
pub const MAX_FIELDS: usize = 1000;
/// Maximum number of elements of an input or output.
pub const MAX_ELEMENTS: usize = 1_000_000;
/// Maximum length of a chain of operations that use each other.
pub const MAX_DEPTH: u32 = 1_000_000;
/// Maximum length of a name, in characters.
pub const MAX_NAME: usize = 64;
/// Maximum length of any other text, in characters.
pub const MAX_TEXT: usize = 4000;

/// A named operation of the format.
pub(super) struct Operator {
    pub name: &'static str,
    pub operands: usize,
    /// Range of the integer after the operands, if there is one.
    pub parameter: Option<(i32, i32)>,
    pub node: fn([NodeId; 2], i32) -> Node,
}

const fn operator(
    name: &'static str,
    operands: usize,
    node: fn([NodeId; 2], i32) -> Node,
) -> Operator {
    Operator {
        name,
        operands,
        parameter: None,
        node,
    }
}

pub(super) const OPERATORS: [Operator; 18] = [
    operator("add", 2, |[a, b], _| Node::Add(a, b)),
    operator("sub", 2, |[a, b], _| Node::Sub(a, b)),
    operator("mul", 2, |[a, b], _| Node::Mul(a, b)),
    operator("div", 2, |[a, b], _| Node::Div(a, b)),
    operator("neg", 1, |[a, _], _| Node::Neg(a)),
    operator("sqrt", 1, |[a, _], _| Node::Sqrt(a)),
    operator("sin", 1, |[a, _], _| Node::Sin(a)),
    operator("cos", 1, |[a, _], _| Node::Cos(a)),
    operator("asin", 1, |[a, _], _| Node::Asin(a)),
    operator("exp", 1, |[a, _], _| Node::Exp(a)),
    operator("ln", 1, |[a, _], _| Node::Ln(a)),
    operator("tanh", 1, |[a, _], _| Node::Tanh(a)),
    operator("abs", 1, |[a, _], _| Node::Abs(a)),
    operator("atan2", 2, |[a, b], _| Node::Atan2(a, b)),
    operator("pow", 2, |[a, b], _| Node::Pow(a, b)),
    operator("less_than", 2, |[a, b], _| Node::LessThan(a, b)),
    Operator {
        name: "powi",
        operands: 1,
        parameter: Some((-MAX_EXPONENT, MAX_EXPONENT)),
        node: |[a, _], exponent| Node::Powi(a, exponent),
    },
    Operator {
        name: "half_angle_squared",
        operands: 1,
        parameter: Some((0, special::MAX_ORDER as i32)),
        node: |[a, _], order| Node::HalfAngleSquared(order as u8, a),
    },
];

/// The operators of the format: name, number of operands, and range of the integer after them.
pub fn operators() -> impl Iterator<Item = (&'static str, usize, Option<(i32, i32)>)> {
    OPERATORS
        .iter()
        .map(|operator| (operator.name, operator.operands, operator.parameter))
}

/// The name of an operation in the format, and the integer after its operands.
pub(super) fn name_and_parameter(node: Node) -> (&'static str, Option<i64>) {
    match node {
        Node::Constant(Constant::Rational(_)) => ("rational", None),
        Node::Constant(Constant::Float(_)) => ("float", None),
        Node::Symbol(_) => ("symbol", None),
        Node::Add(..) => ("add", None),
        Node::Sub(..) => ("sub", None),
        Node::Mul(..) => ("mul", None),
        Node::Div(..) => ("div", None),
        Node::Neg(_) => ("neg", None),
        Node::Powi(_, exponent) => ("powi", Some(exponent.into())),
        Node::Sqrt(_) => ("sqrt", None),
        Node::Sin(_) => ("sin", None),
        Node::Cos(_) => ("cos", None),
        Node::Asin(_) => ("asin", None),
        Node::Exp(_) => ("exp", None),
        Node::Ln(_) => ("ln", None),
        Node::Tanh(_) => ("tanh", None),
        Node::Abs(_) => ("abs", None),
        Node::Atan2(..) => ("atan2", None),
        Node::Pow(..) => ("pow", None),
        Node::LessThan(..) => ("less_than", None),
        Node::HalfAngleSquared(order, _) => ("half_angle_squared", Some(order.into())),
    }
}

/// Reads a list; refuses it as soon as it exceeds `MAX_ENTRIES` entries.
pub(super) fn limited<'de, const MAX_ENTRIES: usize, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Vec<T>, D::Error> {
    struct List<const MAX_ENTRIES: usize, T>(PhantomData<T>);

    impl<'de, const MAX_ENTRIES: usize, T: Deserialize<'de>> Visitor<'de> for List<MAX_ENTRIES, T> {
        type Value = Vec<T>;

        fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
            formatter.write_str("a list")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Vec<T>, A::Error> {
            let mut list = Vec::new();
            while let Some(item) = items.next_element()? {
                if list.len() == MAX_ENTRIES {
                    return Err(de::Error::custom(format!(
                        "this list has at most {MAX_ENTRIES} entries"
                    )));
                }
                list.push(item);
            }
            Ok(list)
        }
    }

    deserializer.deserialize_seq(List::<MAX_ENTRIES, T>(PhantomData))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputEntry {
    pub name: String,
    pub doc: String,
    #[serde(deserialize_with = "limited::<MAX_ELEMENTS, _, _>")]
    pub elements: Vec<(String, usize)>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OutputEntry {
    pub name: String,
    pub doc: String,
    pub unit: UnitCode,
    #[serde(deserialize_with = "limited::<2, _, _>")]
    pub shape: Vec<usize>,
    #[serde(deserialize_with = "limited::<MAX_ELEMENTS, _, _>")]
    pub operations: Vec<usize>,
}

pub(super) struct UnitCode(pub Unit);

impl Serialize for UnitCode {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0.code())
    }
}

impl<'de> Deserialize<'de> for UnitCode {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Unit::parse(&text).map(UnitCode).ok_or_else(|| {
            let shown = shortened(&text);
            de::Error::custom(format!(
                "`{shown}` is not a unit; units are products like `kg m^2` or `rad s^-1`, or `1`"
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::graph::Graph;

    #[test]
    fn every_operator_is_read_as_it_is_written() {
        let mut graph = Graph::raw();
        let (a, b) = (
            graph.symbol("a", "a", Unit::ONE),
            graph.symbol("b", "b", Unit::ONE),
        );
        for operator in &OPERATORS {
            let parameter = operator.parameter.map_or(0, |(least, _)| least);
            let node = (operator.node)([a, b], parameter);
            let written = operator.parameter.map(|_| i64::from(parameter));
            assert_eq!(name_and_parameter(node), (operator.name, written));
            assert_eq!(node.operands().count(), operator.operands);
        }
    }
}
