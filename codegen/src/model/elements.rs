//! One segment of a chain, and the parts that kernels of segments and joints share.
//!
//! [`super::joint`] has the joints. [`super::kernels`] names the kernels of motion in space and in the plane, [`super::lateral`]
//! those of the lateral variation.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output, output_nodes, set_output_nodes};
use crate::ir::unit::Unit;
use crate::model::arguments::{AZIMUTH_STEPS, SIDE, joint_constants};
use crate::model::chain::{
    self, ACCELERATION, ANGULAR_RATE, Body, Hinge, Motion, Segment, VELOCITY, Vec3, vector_symbol,
};
use crate::passes::calculus::{directional_derivative, gradient, jacobian};
use crate::passes::dimension;
use crate::passes::normal_form::{Style, normalise};

/// Unit of a joint's torque.
pub(super) const TORQUE: Unit = Unit::NEWTON.times(Unit::METRE);

/// Unit of the derivative of a force with respect to an angular acceleration.
pub(super) const MASS_LENGTH: Unit = Unit::KILOGRAM.times(Unit::METRE);

/// Derived expressions with their names, before simplification.
pub(super) struct Derivation {
    pub graph: Graph,
    pub outputs: Vec<Output>,
}

impl Derivation {
    /// Simplifies the outputs and binds the inputs that `inputs` lists.
    pub fn kernel(
        self,
        name: &str,
        summary: &str,
        style: Option<Style<'_>>,
        inputs: impl FnOnce(&mut Graph) -> Vec<KernelInput>,
    ) -> Result<Kernel, String> {
        let Self {
            mut graph,
            mut outputs,
        } = self;
        dimension::check(&graph, &outputs)?;
        if let Some(style) = style {
            let normalised = normalise(&graph, &output_nodes(&outputs), style);
            graph = normalised.graph;
            set_output_nodes(&mut outputs, normalised.outputs);
            dimension::check(&graph, &outputs)?;
        }
        let inputs = inputs(&mut graph);
        Ok(Kernel {
            name: name.into(),
            summary: summary.into(),
            graph,
            inputs,
            outputs,
        })
    }

    /// Derives the kernel for `motion`, which the name and the summary state.
    pub fn kernel_for(
        self,
        motion: Motion,
        name: &str,
        summary: &str,
        style: Option<Style<'_>>,
        inputs: impl FnOnce(&mut Graph) -> Vec<KernelInput>,
    ) -> Result<Kernel, String> {
        let place = match motion {
            Motion::Spatial => "",
            Motion::Planar => "\nFor motion in the plane of rotation, where `φ = π/2` and `q = θ`.",
        };
        self.kernel(
            &motion.name_for(name),
            &format!("{summary}{place}"),
            style,
            inputs,
        )
    }
}

/// `name`, or `name_label` if there is a label.
pub(super) fn labelled(name: &str, label: &str) -> String {
    if label.is_empty() {
        name.into()
    } else {
        format!("{name}_{label}")
    }
}

/// Sines and cosines of a segment's angles.
pub(super) fn trigonometry(
    graph: &mut Graph,
    motion: Motion,
    name: &str,
    label: &str,
) -> KernelInput {
    let Segment { phi, theta, .. } = Segment::new(graph, label);
    let mut of = |angle: &str, node: NodeId| sine_and_cosine(graph, &labelled(angle, label), node);
    match motion {
        Motion::Spatial => KernelInput::new(
            name,
            "sin φ, cos φ, sin θ, cos θ",
            [of("phi", phi), of("theta", theta)].concat(),
        ),
        Motion::Planar => KernelInput::new(name, "sin θ, cos θ", of("theta", theta)),
    }
}

/// The angles of the segment on a side of a joint in space; the side has the name of the segment.
pub(super) fn side(graph: &mut Graph, name: &str) -> KernelInput {
    trigonometry(graph, Motion::Spatial, name, name).in_group(&SIDE, name, "angles")
}

/// The elements of an input: sine and cosine of an `angle` with this name.
pub(super) fn sine_and_cosine(
    graph: &mut Graph,
    name: &str,
    angle: NodeId,
) -> Vec<(String, NodeId)> {
    vec![
        (format!("sin_{name}"), graph.sin(angle)),
        (format!("cos_{name}"), graph.cos(angle)),
    ]
}

/// The rates of a segment: in space as one argument, `name`; in the plane `θ̇` under its own name.
pub(super) fn rates(graph: &Graph, motion: Motion, name: &str, label: &str) -> KernelInput {
    let theta_rate = labelled("theta_rate", label);
    match motion {
        Motion::Spatial => KernelInput::symbols(
            graph,
            name,
            "φ̇, θ̇ in rad/s",
            &[&labelled("phi_rate", label), &theta_rate],
        ),
        Motion::Planar => KernelInput::symbols(graph, &theta_rate, "θ̇ in rad/s", &[&theta_rate]),
    }
}

/// The rates of a segment as seen from the body, like [`rates`]. In space they belong to a side of
/// the joint.
pub(super) fn rates_in_body(graph: &Graph, motion: Motion, name: &str, label: &str) -> KernelInput {
    let rates = rates(graph, motion, name, label);
    let rates = KernelInput {
        doc: format!("{}, {IN_BODY}", rates.doc),
        ..rates
    };
    match motion {
        Motion::Spatial => rates.in_group(&SIDE, label, "rates"),
        Motion::Planar => rates,
    }
}

/// Reference of the rates of joints.
const IN_BODY: &str = "less those of a segment that turns rigidly with the body";

/// The symbols `w_q` and `w_v`.
pub(super) fn step_weights(graph: &mut Graph) -> (NodeId, NodeId) {
    let coordinates = graph.symbol("coordinate_weight", "w_q", Unit::SECOND.powi(2));
    (
        coordinates,
        graph.symbol("rate_weight", "w_v", Unit::SECOND),
    )
}

pub(super) fn vector_input(graph: &Graph, motion: Motion, name: &str, doc: &str) -> KernelInput {
    let names: Vec<String> = ["x", "y", "z"][..motion.axes()]
        .iter()
        .map(|axis| format!("{name}_{axis}"))
        .collect();
    KernelInput::symbols(
        graph,
        name,
        doc,
        &names.iter().map(String::as_str).collect::<Vec<_>>(),
    )
}

/// One segment with a free inner end.
pub(super) struct FreeSegment {
    pub graph: Graph,
    pub motion: Motion,
    pub body: Body,
    pub segment: Segment,
    pub base_velocity: Vec<NodeId>,
    pub kinetic_energy: NodeId,
    /// Position of the outer end relative to the inner one, `h e`, and its rate.
    pub reach: Vec<NodeId>,
    pub reach_rate: Vec<NodeId>,
}

impl FreeSegment {
    pub fn new(motion: Motion) -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let body = Body::new(g, "");
        let segment = Segment::new(g, "");
        let base_velocity = vector_symbol(g, "base_velocity", "ẋ", VELOCITY);
        let (direction, rate) = (segment.direction(g), segment.direction_rate(g));
        let kinetic_energy = chain::kinetic_energy(g, &body, base_velocity, rate);
        let origin = [g.integer(0); 3];
        let [x, y, z] = chain::outer_end(g, &body, origin, direction);
        let [x_rate, y_rate, z_rate] = chain::outer_end(g, &body, origin, rate);
        let [kinetic_energy, x, y, z, x_rate, y_rate, z_rate] = motion.specialise(
            g,
            &[segment],
            [kinetic_energy, x, y, z, x_rate, y_rate, z_rate],
        );
        let components = |vector: [NodeId; 3]| vector[..motion.axes()].to_vec();
        Self {
            graph,
            motion,
            body,
            segment,
            base_velocity: components(base_velocity),
            kinetic_energy,
            reach: components([x, y, z]),
            reach_rate: components([x_rate, y_rate, z_rate]),
        }
    }

    /// The coordinates and their rates.
    pub fn variables(&self) -> [Vec<NodeId>; 2] {
        self.motion.variables(&[self.segment])
    }

    /// The map `q → q̇`.
    pub fn rates_of_coordinates(&self) -> BTreeMap<NodeId, NodeId> {
        let [coordinates, rates] = self.variables();
        coordinates.into_iter().zip(rates).collect()
    }
}

/// Load of a segment at its inner end for given accelerations and a given outer force.
pub(super) struct InverseDynamics {
    pub free: FreeSegment,
    /// The symbols of `ẍ`.
    pub base_acceleration: Vec3,
    /// The symbols of `q̈`.
    pub accelerations: Vec<NodeId>,
    /// The symbols of `F`.
    pub outer_force: Vec3,
    /// `τ`, one component per coordinate.
    pub torque: Vec<NodeId>,
    /// `p` in N.
    pub base_force: Vec<NodeId>,
    /// `ẍ' − ẍ` in m/s².
    pub reach_acceleration: Vec<NodeId>,
}

impl InverseDynamics {
    pub fn new(motion: Motion) -> Self {
        let mut free = FreeSegment::new(motion);
        let mut moving = free.rates_of_coordinates();
        let [coordinates, rates_of] = free.variables();
        let g = &mut free.graph;
        let base_acceleration = vector_symbol(g, "base_acceleration", "ẍ", ACCELERATION);
        let [phi, theta] = [("phi_acceleration", "φ̈"), ("theta_acceleration", "θ̈")]
            .map(|(name, notation)| g.symbol(name, notation, ANGULAR_RATE.per(Unit::SECOND)));
        let accelerations = match motion {
            Motion::Spatial => vec![phi, theta],
            Motion::Planar => vec![theta],
        };
        let outer_force = vector_symbol(g, "outer_force", "F", Unit::NEWTON);
        moving.extend(rates_of.iter().copied().zip(accelerations.iter().copied()));
        moving.extend(free.base_velocity.iter().copied().zip(base_acceleration));

        let base_momentum = gradient(g, free.kinetic_energy, &free.base_velocity);
        let momentum = gradient(g, free.kinetic_energy, &rates_of);
        let base_force = directional_derivative(g, &base_momentum, &moving);
        let momentum_rate = directional_derivative(g, &momentum, &moving);
        let kinetic_gradient = gradient(g, free.kinetic_energy, &coordinates);
        let reach_jacobian = jacobian(g, &free.reach, &coordinates);
        let torque = (0..coordinates.len()).map(|i| {
            let inertial = g.sub(momentum_rate[i], kinetic_gradient[i]);
            let column: Vec<NodeId> = reach_jacobian.iter().map(|row| row[i]).collect();
            let outer = g.dot(&column, &outer_force);
            g.add(inertial, outer)
        });
        let torque = torque.collect();
        let reach_acceleration = directional_derivative(g, &free.reach_rate, &moving);
        Self {
            free,
            base_acceleration,
            accelerations,
            outer_force,
            torque,
            base_force,
            reach_acceleration,
        }
    }
}

/// The rates `q̇_r` of a segment that turns rigidly with the body: `Ω × e = (∂e/∂q) q̇_r`.
pub(super) struct RigidRates {
    pub graph: Graph,
    pub rates: Vec<NodeId>,
    /// Rows are rates, columns coordinates.
    pub slopes: Vec<Vec<NodeId>>,
}

impl RigidRates {
    pub fn new() -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let (segment, turning) = (Segment::new(g, ""), chain::angular_velocity(g));
        let direction = segment.direction(g);
        let velocity = chain::rigid_rate(g, turning, direction);
        // ∂e/∂φ and ∂e/∂θ are perpendicular, and of the lengths 1 and sin φ.
        let sine = g.sin(segment.phi);
        let widths = [g.integer(1), g.mul(sine, sine)];
        let slopes = jacobian(g, &direction, &segment.coordinates());
        let rates = (0..2).map(|i| {
            let column: Vec<NodeId> = slopes.iter().map(|row| row[i]).collect();
            let along = g.dot(&column, &velocity);
            g.div(along, widths[i])
        });
        let rates: Vec<NodeId> = rates.collect();
        let slopes = jacobian(g, &rates, &segment.coordinates());
        Self {
            graph,
            rates,
            slopes,
        }
    }
}

/// The azimuth of the next segment relative to the previous one, by sine and cosine: as it is, and
/// less the relaxed angle.
pub(super) fn azimuth_steps(graph: &mut Graph) -> [KernelInput; 2] {
    let (previous, next) = (Segment::new(graph, "previous"), Segment::new(graph, "next"));
    let relaxed_angle = Hinge::new(graph, "").relaxed_angle;
    let unbent = graph.sub(next.theta, relaxed_angle);
    let mut step = |name: &str, doc: &str, field, next: NodeId| {
        let step = graph.sub(previous.theta, next);
        KernelInput::new(name, doc, sine_and_cosine(graph, name, step)).in_group(
            &AZIMUTH_STEPS,
            "steps",
            field,
        )
    };
    [
        step(
            "azimuth_step",
            "sin(θ − θ'), cos(θ − θ'), with θ' of the next segment",
            "plain",
            next.theta,
        ),
        step(
            "unbent_step",
            "sin(θ − θ' + κ), cos(θ − θ' + κ), with the relaxed angle κ",
            "unbent",
            unbent,
        ),
    ]
}

/// Sine and cosine of the azimuth of the segment `label` less the relaxed angle of the joint at its
/// inner end.
pub(super) fn unbent_azimuth(graph: &mut Graph, label: &str) -> KernelInput {
    let (segment, relaxed_angle) = (
        Segment::new(graph, label),
        Hinge::new(graph, "").relaxed_angle,
    );
    let azimuth = graph.sub(segment.theta, relaxed_angle);
    let name = format!("unbent_{label}");
    let elements = sine_and_cosine(graph, &name, azimuth);
    KernelInput::new(
        &name,
        "sin(θ − κ), cos(θ − κ), with the relaxed angle κ",
        elements,
    )
}

pub(super) fn clamp_inputs(graph: &mut Graph, motion: Motion) -> Vec<KernelInput> {
    let next = match motion {
        Motion::Spatial => side(graph, "next"),
        Motion::Planar => trigonometry(graph, motion, "next", "next"),
    };
    let inputs = vec![
        vector_input(
            graph,
            motion,
            "relaxed_direction",
            "ē0, which is e0 turned about z by the relaxed angle",
        ),
        next,
        rates_in_body(graph, motion, "next_rates", "next"),
    ];
    [inputs, joint_constants(graph)].concat()
}

pub(super) fn transpose(columns: &[Vec<NodeId>]) -> Vec<Vec<NodeId>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .map(|row| columns.iter().map(|column| column[row]).collect())
        .collect()
}
