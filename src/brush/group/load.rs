//! Forces of the workpiece on the filaments of a group.

use crate::simulation::ContactSum;

/// Force of the workpiece on one filament.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WorkpieceLoad {
    /// Sum of all contacts.
    pub sum: ContactSum,
    /// Power of a moving workpiece in W.
    pub moving_power: f64,
    /// Energy stored in J.
    pub energy: f64,
    /// Deepest penetration of its possible contacts in m; negative without contact. Far from the
    /// workpiece it is not known: minus infinity.
    pub pressing: f64,
    /// Deepest penetration of a contact that presses, in m.
    pub penetration: f64,
    /// Number of outer nodes that include all nodes pressing on a face.
    pub contact_nodes: usize,
    /// Deepest penetration of an edge in m.
    pub edge_penetration: f64,
    /// Edge with the largest sliding power.
    pub worked: Option<WorkedEdge>,
}

impl WorkpieceLoad {
    /// Returns the load far from the workpiece.
    pub fn none() -> Self {
        Self {
            pressing: f64::NEG_INFINITY,
            ..Self::default()
        }
    }
}

/// Place and power of the work on an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WorkedEdge {
    /// Index of the edge.
    pub edge: usize,
    /// Place on the edge, from 0 to 1.
    pub place: f64,
    /// Sliding power `F_n |v_t|` in W.
    pub power: f64,
}
