//! Nodes of an expression graph: their ids, symbols and operations.

use crate::ir::constant::Constant;
use crate::ir::unit::Unit;

/// A node of one [`Graph`](crate::ir::graph::Graph). Ids grow in the order of creation, and operands have smaller ids than
/// their users.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub(super) u32);

impl NodeId {
    /// The position in [`Graph::nodes`](crate::ir::graph::Graph::nodes).
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A free variable of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SymbolId(pub(super) u32);

impl SymbolId {
    /// The position in [`Graph::symbols`](crate::ir::graph::Graph::symbols).
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A named variable with its unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// A Rust identifier, unique in the graph: `phi_rate_2`.
    pub name: String,
    /// The field's notation: `φ̇2`.
    pub notation: String,
    /// The unit of its values.
    pub unit: Unit,
}

/// One operation, with its operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A number.
    Constant(Constant),
    /// A free variable.
    Symbol(SymbolId),
    /// `a + b`
    Add(NodeId, NodeId),
    /// `a − b`
    Sub(NodeId, NodeId),
    /// `a b`
    Mul(NodeId, NodeId),
    /// `a / b`
    Div(NodeId, NodeId),
    /// `−a`
    Neg(NodeId),
    /// `a^k` for an integer `k`
    Powi(NodeId, i32),
    /// `√a`
    Sqrt(NodeId),
    /// `sin a`
    Sin(NodeId),
    /// `cos a`
    Cos(NodeId),
    /// `asin a`
    Asin(NodeId),
    /// `eᵃ`
    Exp(NodeId),
    /// `ln a`, singular at `a = 0` and undefined below
    Ln(NodeId),
    /// `tanh a`
    Tanh(NodeId),
    /// `|a|`; its derivative at the kink `a = 0` is taken as zero
    Abs(NodeId),
    /// `atan2(a, b)`, the angle from the positive `b` axis to the point `(b, a)`, in `[−π, π]`;
    /// singular at the origin, and it jumps across the negative `b` axis
    Atan2(NodeId, NodeId),
    /// `aᵇ` for a real `b`, defined for `a > 0`; [`Node::Powi`] has the integers
    Pow(NodeId, NodeId),
    /// 1 where `a < b`, else 0
    LessThan(NodeId, NodeId),
    /// The k-th derivative of `S(u) = ½ arccos²(1 − u)`, see [`crate::ir::special`].
    HalfAngleSquared(u8, NodeId),
}

impl Node {
    /// The operands, in order.
    pub fn operands(&self) -> impl Iterator<Item = NodeId> + use<> {
        let (first, second) = match *self {
            Self::Constant(_) | Self::Symbol(_) => (None, None),
            Self::Add(a, b)
            | Self::Sub(a, b)
            | Self::Mul(a, b)
            | Self::Div(a, b)
            | Self::Atan2(a, b)
            | Self::Pow(a, b)
            | Self::LessThan(a, b) => (Some(a), Some(b)),
            Self::Neg(a)
            | Self::Powi(a, _)
            | Self::Sqrt(a)
            | Self::Sin(a)
            | Self::Cos(a)
            | Self::Asin(a)
            | Self::Exp(a)
            | Self::Ln(a)
            | Self::Tanh(a)
            | Self::Abs(a)
            | Self::HalfAngleSquared(_, a) => (Some(a), None),
        };
        first.into_iter().chain(second)
    }

    /// Applies the operation to other operands.
    pub fn map(self, mut operand: impl FnMut(NodeId) -> NodeId) -> Self {
        match self {
            Self::Constant(_) | Self::Symbol(_) => self,
            Self::Add(a, b) => Self::Add(operand(a), operand(b)),
            Self::Sub(a, b) => Self::Sub(operand(a), operand(b)),
            Self::Mul(a, b) => Self::Mul(operand(a), operand(b)),
            Self::Div(a, b) => Self::Div(operand(a), operand(b)),
            Self::Neg(a) => Self::Neg(operand(a)),
            Self::Powi(a, k) => Self::Powi(operand(a), k),
            Self::Sqrt(a) => Self::Sqrt(operand(a)),
            Self::Sin(a) => Self::Sin(operand(a)),
            Self::Cos(a) => Self::Cos(operand(a)),
            Self::Asin(a) => Self::Asin(operand(a)),
            Self::Exp(a) => Self::Exp(operand(a)),
            Self::Ln(a) => Self::Ln(operand(a)),
            Self::Tanh(a) => Self::Tanh(operand(a)),
            Self::Abs(a) => Self::Abs(operand(a)),
            Self::Atan2(a, b) => Self::Atan2(operand(a), operand(b)),
            Self::Pow(a, b) => Self::Pow(operand(a), operand(b)),
            Self::LessThan(a, b) => Self::LessThan(operand(a), operand(b)),
            Self::HalfAngleSquared(order, a) => Self::HalfAngleSquared(order, operand(a)),
        }
    }
}
