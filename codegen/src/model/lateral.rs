//! The linearised equations of a filament's motion out of the plane of rotation.
//!
//! Along a motion in the plane, `φ_k = π/2`, let the clamp be tilted out of it by a small angle
//! `τ`. To first order in `τ` the azimuths do not change, and `φ_k = π/2 + η_k τ`. The lateral
//! variation `η_k = ∂φ_k/∂τ` obeys linear equations whose coefficients follow the planar motion.
//! They are derived here from the spatial equations: the derivative of the torque on `φ` and of the
//! forces along `z`, at `φ = π/2`, `φ̇ = 0`.
//!
//! The variations form a chain of the same structure as that of `kernels`, with one coordinate `η`
//! a segment and one component `z` a node:
//!
//! ```text
//! p_z = m z̈ + C η̈ + F_z,   τ_φ = C z̈ + I η̈ + τ_0 + G F_z,   z̈' = z̈ + G η̈,
//! ```
//!
//! where `z`, `p_z`, `F_z` and `τ_φ` are variations too: derivatives with respect to the tilt `τ`.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output};
use crate::ir::unit::Unit;
use crate::model::arguments::{COORDINATE, joint_constants, segment_constants, weights};
use crate::model::chain::{ANGULAR_RATE, INERTIA, Motion, Segment, VELOCITY, in_plane};
use crate::model::elements::{
    Derivation, FreeSegment, InverseDynamics, MASS_LENGTH, TORQUE, azimuth_steps, clamp_inputs,
    labelled, rates, rates_in_body, step_weights, trigonometry, vector_input,
};
use crate::model::joint::{BLOCKS, Joint, Tangent, tangent, tangent_kernel};
use crate::passes::calculus::directional_derivative;
use crate::passes::normal_form::Style;
use crate::passes::specialise::substitute;

/// Domain of the lateral kernels.
const WHERE: &str = "Lateral variation of a motion in the plane of rotation: `q = η = ∂φ/∂τ`, where `τ` is the tilt of the clamp.";

/// The kernels of the lateral variation, in the order in which the solver uses them.
pub(super) fn kernels() -> Result<Vec<Kernel>, String> {
    [
        segment,
        segment_tangent,
        joint,
        joint_tangent,
        clamp,
        clamp_tangent,
    ]
    .into_iter()
    .map(|derive| derive())
    .collect()
}

/// `η` and `η̇` of a segment, as symbols.
#[derive(Clone, Copy)]
struct Variation {
    polar: NodeId,
    polar_rate: NodeId,
}

impl Variation {
    /// The symbols of the segment `label`.
    fn new(graph: &mut Graph, label: &str) -> Self {
        let names = Self::names(label);
        Self {
            polar: graph.symbol(&names[0], &format!("η{label}"), Unit::RADIAN),
            polar_rate: graph.symbol(&names[1], &format!("η̇{label}"), ANGULAR_RATE),
        }
    }

    fn names(label: &str) -> [String; 2] {
        ["phi_variation", "phi_variation_rate"].map(|name| labelled(name, label))
    }

    /// The variations of the coordinates and rates of `segment`.
    fn direction(&self, segment: &Segment) -> BTreeMap<NodeId, NodeId> {
        BTreeMap::from([
            (segment.phi, self.polar),
            (segment.phi_rate, self.polar_rate),
        ])
    }

    fn inputs(graph: &Graph, label: &str) -> Vec<KernelInput> {
        let [polar, rate] = Self::names(label);
        let argument = match label {
            "" => "variation".into(),
            _ => format!("{label}_variation"),
        };
        vec![
            KernelInput::symbols(graph, &polar, "η", &[&polar]).in_group(
                &COORDINATE,
                &argument,
                "value",
            ),
            KernelInput::symbols(graph, &rate, "η̇ in 1/s", &[&rate]).in_group(
                &COORDINATE,
                &argument,
                "rate",
            ),
        ]
    }
}

/// The derivative of `outputs` along `direction` at the planar motion of `segments`.
fn variation<const N: usize>(
    graph: &mut Graph,
    outputs: [NodeId; N],
    direction: &BTreeMap<NodeId, NodeId>,
    segments: &[Segment],
) -> [NodeId; N] {
    let slopes = directional_derivative(graph, &outputs, direction);
    let mut values = in_plane(graph, segments);
    if let Some(acceleration) = graph.find_symbol("phi_acceleration") {
        values.insert(acceleration, graph.integer(0));
    }
    substitute(graph, &slopes, &values)
        .try_into()
        .expect("each output has a variation")
}

/// The variation of a segment's inverse dynamics.
struct LateralSegment {
    graph: Graph,
    /// Variation of `[τ_φ, p_z, z̈' − z̈]` with `η` and `η̇`, for `η̈ = 0`.
    bias: [NodeId; 3],
    /// Their variation with `η̈`.
    slope: [NodeId; 3],
    /// Variation of the outer end less the inner one along `z`, and of its rate.
    reach: [NodeId; 2],
    polar: Variation,
}

impl LateralSegment {
    fn new() -> Self {
        let InverseDynamics {
            free,
            accelerations,
            torque,
            base_force,
            reach_acceleration,
            ..
        } = InverseDynamics::new(Motion::Spatial);
        let FreeSegment {
            mut graph,
            segment,
            reach,
            reach_rate,
            ..
        } = free;
        let g = &mut graph;
        let polar = Variation::new(g, "");
        let (outputs, one) = (
            [torque[0], base_force[2], reach_acceleration[2]],
            g.integer(1),
        );
        let bias = variation(g, outputs, &polar.direction(&segment), &[segment]);
        let slope = variation(
            g,
            outputs,
            &BTreeMap::from([(accelerations[0], one)]),
            &[segment],
        );
        let reach = variation(
            g,
            [reach[2], reach_rate[2]],
            &polar.direction(&segment),
            &[segment],
        );
        Self {
            graph,
            bias,
            slope,
            reach,
            polar,
        }
    }

    fn inputs(graph: &mut Graph) -> Vec<KernelInput> {
        vec![
            trigonometry(graph, Motion::Planar, "angles", ""),
            rates(graph, Motion::Planar, "", ""),
            vector_input(
                graph,
                Motion::Planar,
                "base_acceleration",
                "ẍ in m/s², along x and y",
            ),
            vector_input(
                graph,
                Motion::Planar,
                "outer_force",
                "F in N, along x and y",
            ),
        ]
    }
}

fn segment() -> Result<Kernel, String> {
    let LateralSegment {
        mut graph,
        bias,
        slope,
        reach: [reach, reach_rate],
        ..
    } = LateralSegment::new();
    let g = &mut graph;
    let [inertia, coupling, jacobian] = slope;
    let [bias, base_bias, reach_bias] = bias;
    debug_assert!(
        g.is_zero(base_bias) && g.is_zero(reach_bias),
        "neither p_z nor z̈' has a bias"
    );
    let outputs = vec![
        Output::matrix("inertia", "`I = ∂τ_φ/∂η̈`", INERTIA, vec![vec![inertia]]),
        Output::matrix(
            "coupling",
            "`C = ∂p_z/∂η̈ = ∂τ_φ/∂z̈`",
            MASS_LENGTH,
            vec![vec![coupling]],
        ),
        Output::vector(
            "bias",
            "`τ_0`: `τ_φ` for `z̈ = 0`, `η̈ = 0`, `F_z = 0`",
            TORQUE,
            vec![bias],
        ),
        Output::vector(
            "reach",
            "`z' − z`, outer end less inner end",
            Unit::METRE,
            vec![reach],
        ),
        Output::vector("reach_rate", "`ż' − ż`", VELOCITY, vec![reach_rate]),
        Output::matrix(
            "reach_jacobian",
            "`G = ∂z̈'/∂η̈`",
            Unit::METRE,
            vec![vec![jacobian]],
        ),
    ];
    let summary = format!(
        "Kinematics and inertia of one segment, seen from its inner end:\n\
         `p_z = m z̈ + C η̈ + F_z`, `τ_φ = C z̈ + I η̈ + τ_0 + G F_z`, `z̈' = z̈ + G η̈`.\n{WHERE}"
    );
    Derivation { graph, outputs }.kernel("lateral_segment", &summary, Some(Style::Cheap), |graph| {
        [
            LateralSegment::inputs(graph),
            Variation::inputs(graph, ""),
            segment_constants(graph),
        ]
        .concat()
    })
}

fn segment_tangent() -> Result<Kernel, String> {
    let LateralSegment {
        mut graph,
        bias,
        slope,
        polar,
        ..
    } = LateralSegment::new();
    let g = &mut graph;
    let (coordinate_weight, rate_weight) = step_weights(g);
    let direction = BTreeMap::from([
        (polar.polar, coordinate_weight),
        (polar.polar_rate, rate_weight),
    ]);
    let follow = directional_derivative(g, &bias, &direction);
    let total: Vec<NodeId> = slope
        .into_iter()
        .zip(follow)
        .map(|(slope, follow)| g.add(slope, follow))
        .collect();
    let outputs = vec![
        Output::matrix("torque", "`∂τ_φ/∂η̈`", INERTIA, vec![vec![total[0]]]),
        Output::matrix("base_force", "`∂p_z/∂η̈`", MASS_LENGTH, vec![vec![total[1]]]),
        Output::matrix(
            "outer_acceleration",
            "`∂z̈'/∂η̈`",
            Unit::METRE,
            vec![vec![total[2]]],
        ),
    ];
    let summary = format!(
        "Tangent of one segment: how `τ_φ`, `p_z` and `z̈'` of [`lateral_segment`] change with its own `η̈` when\n\
         `δη = w_q δη̈` and `δη̇ = w_v δη̈`, for fixed `z̈` and `F_z`.\n{WHERE}"
    );
    Derivation { graph, outputs }.kernel(
        "lateral_segment_tangent",
        &summary,
        Some(Style::Cheap),
        |graph| {
            [
                LateralSegment::inputs(graph),
                segment_constants(graph),
                weights(graph),
            ]
            .concat()
        },
    )
}

/// The variation of a joint's torques on the polar angles of its segments.
struct LateralJoint<const N: usize> {
    graph: Graph,
    torques: [NodeId; N],
    polar: [Variation; N],
}

impl<const N: usize> LateralJoint<N> {
    /// Takes the variations of the segments, by their labels, and of the clamp if
    /// `clamp_is_tilted`.
    fn new(mut joint: Joint, labels: [&str; N], clamp_is_tilted: bool) -> Self {
        // The torque on φ comes before that on θ.
        let torques = joint.torques();
        let torques: [NodeId; N] = std::array::from_fn(|k| torques[2 * k]);
        let Joint {
            mut graph,
            segments,
            clamp,
            ..
        } = joint;
        let g = &mut graph;
        let polar = labels.map(|label| Variation::new(g, label));
        let mut direction = BTreeMap::new();
        for (variation, segment) in polar.iter().zip(&segments) {
            direction.extend(variation.direction(segment));
        }
        if clamp_is_tilted {
            // e_0 = (cos τ …, sin τ); a turn about z does not change its z component.
            direction.insert(clamp.direction[2], g.integer(1));
        }
        let torques = variation(g, torques, &direction, &segments);
        Self {
            graph,
            torques,
            polar,
        }
    }

    fn tangent(self) -> Tangent {
        let coordinates = self.polar.map(|variation| variation.polar);
        let rates = self.polar.map(|variation| variation.polar_rate);
        tangent(self.graph, &self.torques, &coordinates, &rates)
    }
}

fn between_segments() -> LateralJoint<2> {
    LateralJoint::new(
        Joint::between_segments(Motion::Spatial),
        ["previous", "next"],
        false,
    )
}

fn at_clamp() -> LateralJoint<1> {
    LateralJoint::new(Joint::at_clamp(Motion::Spatial), ["next"], true)
}

/// Inputs of a joint from the planar motion.
fn planar_joint_inputs(graph: &mut Graph) -> Vec<KernelInput> {
    let rates = ["previous", "next"].map(|label| rates_in_body(graph, Motion::Planar, "", label));
    [azimuth_steps(graph), rates].concat()
}

fn joint() -> Result<Kernel, String> {
    let LateralJoint { graph, torques, .. } = between_segments();
    let outputs = vec![
        Output::vector(
            "previous",
            "torque on `φ` of the previous segment",
            TORQUE,
            vec![torques[0]],
        ),
        Output::vector(
            "next",
            "torque on `φ` of the next segment",
            TORQUE,
            vec![torques[1]],
        ),
    ];
    let summary = format!(
        "Torques of a joint on the polar angles of the two segments that it connects.\n{WHERE}"
    );
    Derivation { graph, outputs }.kernel("lateral_joint", &summary, Some(Style::Cheap), |graph| {
        let [previous, next] = ["previous", "next"].map(|label| Variation::inputs(graph, label));
        [
            planar_joint_inputs(graph),
            previous,
            next,
            joint_constants(graph),
        ]
        .concat()
    })
}

fn joint_tangent() -> Result<Kernel, String> {
    let summary = format!(
        "Tangent of a joint: minus the derivative of the torques of [`lateral_joint`] along `η̈`, when\n\
         `δη = w_q δη̈` and `δη̇ = w_v δη̈`.\n{WHERE}"
    );
    tangent_kernel(
        Motion::Spatial,
        "lateral_joint_tangent",
        &summary,
        between_segments().tangent(),
        &BLOCKS,
        |graph| [planar_joint_inputs(graph), joint_constants(graph)].concat(),
    )
}

fn clamp() -> Result<Kernel, String> {
    let LateralJoint { graph, torques, .. } = at_clamp();
    let outputs = vec![Output::vector(
        "next",
        "torque on `φ` of the first segment",
        TORQUE,
        torques.to_vec(),
    )];
    let summary = format!(
        "Torque of the clamp joint on the polar angle of the first segment. The clamp itself varies by `∂e0z/∂τ = 1`.\n{WHERE}"
    );
    Derivation { graph, outputs }.kernel("lateral_clamp", &summary, Some(Style::Cheap), |graph| {
        [
            clamp_inputs(graph, Motion::Planar),
            Variation::inputs(graph, "next"),
        ]
        .concat()
    })
}

fn clamp_tangent() -> Result<Kernel, String> {
    let blocks = [("next_next", "the first segment along its `η̈`")];
    let summary = format!(
        "Tangent of the clamp joint: minus the derivative of the torque of [`lateral_clamp`] along `η̈`, when\n\
         `δη = w_q δη̈` and `δη̇ = w_v δη̈`.\n{WHERE}"
    );
    tangent_kernel(
        Motion::Spatial,
        "lateral_clamp_tangent",
        &summary,
        at_clamp().tangent(),
        &blocks,
        |graph| clamp_inputs(graph, Motion::Planar),
    )
}
