//! Arguments of the kernels that are structures: inputs that belong together.

use crate::ir::graph::Graph;
use crate::ir::kernel::{InputGroup, KernelInput};

static SEGMENT_CONSTANTS: InputGroup = InputGroup {
    name: "SegmentConstants",
    doc: "The constants of a segment.",
    fields: &[
        ("length", "Its length, `h` in m."),
        ("mass", "Its mass, `m` in kg."),
        (
            "inertia",
            "Its transverse moment of inertia about its centre, `J` in kg m².",
        ),
    ],
};

static JOINT_CONSTANTS: InputGroup = InputGroup {
    name: "JointConstants",
    doc: "The constants of a joint.",
    fields: &[
        ("stiffness", "Its stiffness, `c` in N m."),
        ("damping", "Its damping, `d` in N m s."),
    ],
};

static STEP_WEIGHTS: InputGroup = InputGroup {
    name: "StepWeights",
    doc: "Change of coordinates and rates with the accelerations in an implicit step: `δq = w_q δq̈`, `δq̇ = w_v δq̈`.",
    fields: &[("coordinates", "`w_q` in s²."), ("rates", "`w_v` in s.")],
};

/// One side of a joint in space.
pub(super) static SIDE: InputGroup = InputGroup {
    name: "Side",
    doc: "One side of a joint.",
    fields: &[
        (
            "angles",
            "`sin φ, cos φ`, and where the function takes four, `sin θ, cos θ`.",
        ),
        (
            "rates",
            "`φ̇, θ̇` in rad/s, less those of a segment that turns rigidly with the body.",
        ),
    ],
};

/// The change of the azimuth at a joint.
pub(super) static AZIMUTH_STEPS: InputGroup = InputGroup {
    name: "AzimuthSteps",
    doc: "Change of the azimuth at a joint, `θ` of the previous segment less `θ'` of the next.",
    fields: &[
        ("plain", "`sin(θ − θ'), cos(θ − θ')`"),
        (
            "unbent",
            "`sin(θ − θ' + κ), cos(θ − θ' + κ)`, with the relaxed angle `κ`.",
        ),
    ],
};

/// A coordinate with its rate.
pub(super) static COORDINATE: InputGroup = InputGroup {
    name: "Coordinate",
    doc: "An azimuth or the variation of a polar angle, with its rate.",
    fields: &[
        ("value", "`θ` in rad, or `η`."),
        ("rate", "`θ̇` in rad/s, or `η̇` in 1/s."),
    ],
};

/// Makes the symbol `name` a field of `argument`.
fn field(
    graph: &Graph,
    name: &str,
    doc: &str,
    group: &'static InputGroup,
    argument: &str,
    field: &'static str,
) -> KernelInput {
    KernelInput::symbols(graph, name, doc, &[name]).in_group(group, argument, field)
}

/// The inputs `h`, `m` and `J`.
pub(super) fn segment_constants(graph: &Graph) -> Vec<KernelInput> {
    let field = |name, doc, place| field(graph, name, doc, &SEGMENT_CONSTANTS, "segment", place);
    vec![
        field("segment_length", "h in m", "length"),
        field("segment_mass", "m in kg", "mass"),
        field("segment_inertia", "J in kg m²", "inertia"),
    ]
}

/// The inputs `c` and `d`.
pub(super) fn joint_constants(graph: &Graph) -> Vec<KernelInput> {
    let field = |name, doc, place| field(graph, name, doc, &JOINT_CONSTANTS, "joint", place);
    vec![
        field("joint_stiffness", "c in N m", "stiffness"),
        field("joint_damping", "d in N m s", "damping"),
    ]
}

/// The inputs `w_q` and `w_v`.
pub(super) fn weights(graph: &Graph) -> Vec<KernelInput> {
    let field = |name, doc, place| field(graph, name, doc, &STEP_WEIGHTS, "weights", place);
    vec![
        field("coordinate_weight", "w_q in s²: δq = w_q δq̈", "coordinates"),
        field("rate_weight", "w_v in s: δq̇ = w_v δq̈", "rates"),
    ]
}
