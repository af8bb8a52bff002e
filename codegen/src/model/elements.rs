//! The elements of a chain: one segment and one joint, with what their kernels have in common.
//!
//! From here the kernels are named: those of motion in space and in the plane in [`super::kernels`], those of the lateral
//! variation in [`super::lateral`].

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, output_nodes, set_output_nodes};
use crate::ir::unit::Unit;
use crate::model::chain::{
    self, ACCELERATION, ANGULAR_RATE, Clamp, DAMPING, Motion, Parameters, STIFFNESS, Segment, VELOCITY, Vec3,
    vector_symbol,
};
use crate::passes::calculus::{directional_derivative, gradient, jacobian};
use crate::passes::dimension::{self, DimensionError};
use crate::passes::normal_form::{Style, normalise};

/// Unit of a joint's torque.
pub(super) const TORQUE: Unit = Unit::NEWTON.times(Unit::METRE);

/// Unit of the derivative of a torque with respect to an angular acceleration.
pub(super) const TORQUE_SLOPE: Unit = TORQUE.times(Unit::SECOND.powi(2));

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
        inputs: impl FnOnce(&mut Graph) -> Vec<Input>,
    ) -> Result<Kernel, DimensionError> {
        let Self { mut graph, mut outputs } = self;
        dimension::check(&graph, &outputs)?;
        if let Some(style) = style {
            let normalised = normalise(&graph, &output_nodes(&outputs), style);
            graph = normalised.graph;
            set_output_nodes(&mut outputs, normalised.outputs);
            dimension::check(&graph, &outputs)?;
        }
        let inputs = inputs(&mut graph);
        Ok(Kernel { name: name.into(), summary: summary.into(), graph, inputs, outputs })
    }
}

/// `name`, or `name_label` if there is a label.
fn labelled(name: &str, label: &str) -> String {
    if label.is_empty() { name.into() } else { format!("{name}_{label}") }
}

/// Sines and cosines of a segment's angles.
pub(super) fn trigonometry(graph: &mut Graph, motion: Motion, name: &str, label: &str) -> Input {
    let segment = Segment::new(graph, label);
    let mut elements = Vec::new();
    if motion == Motion::Spatial {
        elements.push((labelled("sin_phi", label), graph.sin(segment.phi)));
        elements.push((labelled("cos_phi", label), graph.cos(segment.phi)));
    }
    elements.push((labelled("sin_theta", label), graph.sin(segment.theta)));
    elements.push((labelled("cos_theta", label), graph.cos(segment.theta)));
    let doc = match motion {
        Motion::Spatial => "sin φ, cos φ, sin θ, cos θ",
        Motion::Planar => "sin θ, cos θ",
    };
    Input { name: name.into(), doc: doc.into(), elements }
}

/// The rates of a segment: in space as one argument, `name`; in the plane `θ̇` under its own name.
pub(super) fn rates(graph: &Graph, motion: Motion, name: &str, label: &str) -> Input {
    let theta_rate = labelled("theta_rate", label);
    match motion {
        Motion::Spatial => Input::symbols(graph, name, "φ̇, θ̇ in rad/s", &[&labelled("phi_rate", label), &theta_rate]),
        Motion::Planar => Input::symbols(graph, &theta_rate, "θ̇ in rad/s", &[&theta_rate]),
    }
}

pub(super) fn segment_constants(graph: &Graph) -> Vec<Input> {
    vec![
        Input::symbols(graph, "segment_length", "h in m", &["segment_length"]),
        Input::symbols(graph, "segment_mass", "m in kg", &["segment_mass"]),
        Input::symbols(graph, "segment_inertia", "J in kg m²", &["segment_inertia"]),
    ]
}

/// The symbols `w_q` and `w_v`.
pub(super) fn step_weights(graph: &mut Graph) -> (NodeId, NodeId) {
    let coordinates = graph.symbol("coordinate_weight", "w_q", Unit::SECOND.powi(2));
    (coordinates, graph.symbol("rate_weight", "w_v", Unit::SECOND))
}

pub(super) fn weights(graph: &Graph) -> Vec<Input> {
    vec![
        Input::symbols(graph, "coordinate_weight", "w_q in s²: δq = w_q δq̈", &["coordinate_weight"]),
        Input::symbols(graph, "rate_weight", "w_v in s: δq̇ = w_v δq̈", &["rate_weight"]),
    ]
}

pub(super) fn vector_input(graph: &Graph, motion: Motion, name: &str, doc: &str) -> Input {
    let names: Vec<String> = ["x", "y", "z"][..motion.axes()].iter().map(|axis| format!("{name}_{axis}")).collect();
    Input::symbols(graph, name, doc, &names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// One segment with a free inner end.
pub(super) struct FreeSegment {
    pub graph: Graph,
    pub motion: Motion,
    pub parameters: Parameters,
    pub segment: Segment,
    pub base_velocity: Vec<NodeId>,
    pub kinetic_energy: NodeId,
    /// The outer end relative to the inner one, `h e`, and its rate.
    pub reach: Vec<NodeId>,
    pub reach_rate: Vec<NodeId>,
}

impl FreeSegment {
    pub fn new(motion: Motion) -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let parameters = Parameters::new(g);
        let segment = Segment::new(g, "");
        let base_velocity = vector_symbol(g, "base_velocity", "ẋ", VELOCITY);
        let (direction, rate) = (segment.direction(g), segment.direction_rate(g));
        let kinetic_energy = chain::kinetic_energy(g, &parameters, base_velocity, rate);
        let origin = [g.integer(0); 3];
        let [x, y, z] = chain::outer_end(g, &parameters, origin, direction);
        let [x_rate, y_rate, z_rate] = chain::outer_end(g, &parameters, origin, rate);
        let [kinetic_energy, x, y, z, x_rate, y_rate, z_rate] =
            motion.specialise(g, &[segment], [kinetic_energy, x, y, z, x_rate, y_rate, z_rate]);
        let components = |vector: [NodeId; 3]| vector[..motion.axes()].to_vec();
        Self {
            graph,
            motion,
            parameters,
            segment,
            base_velocity: components(base_velocity),
            kinetic_energy,
            reach: components([x, y, z]),
            reach_rate: components([x_rate, y_rate, z_rate]),
        }
    }

    /// The coordinates and their rates.
    pub fn variables(&self) -> [Vec<NodeId>; 2] {
        [self.motion.coordinates(&self.segment), self.motion.rates(&self.segment)]
    }

    /// `q → q̇`
    pub fn rates_of_coordinates(&self) -> BTreeMap<NodeId, NodeId> {
        let [coordinates, rates] = self.variables();
        coordinates.into_iter().zip(rates).collect()
    }
}

/// What a segment needs at its inner end for given accelerations and a given outer force.
pub(super) struct InverseDynamics {
    pub free: FreeSegment,
    /// The symbols of `q̈`.
    pub accelerations: Vec<NodeId>,
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
        Self { free, accelerations, torque, base_force, reach_acceleration }
    }
}

/// Rotates a vector from the polar axis `z`, for which [`Segment`] states it, to the polar axis of the segment.
type Turn = fn(Vec3) -> Vec3;

/// A joint between two directions and the segments whose coordinates it acts on.
pub(super) struct Joint {
    pub graph: Graph,
    pub motion: Motion,
    pub segments: Vec<Segment>,
    pub clamp: Clamp,
    pub spring_energy: NodeId,
    pub dissipation: NodeId,
}

impl Joint {
    pub fn between_segments(motion: Motion) -> Self {
        Self::new(motion, &[("previous", along_z), ("next", along_z)])
    }

    /// Between a segment whose polar axis is `z` and one whose polar axis is `x`, in either order: the energies are
    /// the same from both sides.
    pub fn crossed() -> Self {
        Self::new(Motion::Spatial, &[("z", along_z), ("x", along_x)])
    }

    pub fn at_clamp(motion: Motion) -> Self {
        Self::new(motion, &[("next", along_z)])
    }

    /// The labels of the segments, each with the rotation of its vectors to its polar axis.
    fn new(motion: Motion, labels: &[(&str, Turn)]) -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let (stiffness, damping) = (g.symbol("stiffness", "c", STIFFNESS), g.symbol("damping", "d", DAMPING));
        let clamp = Clamp::new(g);
        let segments: Vec<Segment> = labels.iter().map(|(label, _)| Segment::new(g, label)).collect();
        let mut sides = vec![(clamp.direction, clamp.direction_rate)];
        for (segment, (_, turn)) in segments.iter().zip(labels) {
            sides.push((turn(segment.direction(g)), turn(segment.direction_rate(g))));
        }
        let [.., previous, next] = sides[..] else { unreachable!("the clamp and at least one segment") };
        let spring_energy = chain::spring_energy(g, stiffness, previous.0, next.0);
        let dissipation = chain::dissipation(g, damping, previous, next);
        let [spring_energy, dissipation] = motion.specialise(g, &segments, [spring_energy, dissipation]);
        Self { graph, motion, segments, clamp, spring_energy, dissipation }
    }

    /// The coordinates of all segments, and their rates.
    pub fn variables(&self) -> [Vec<NodeId>; 2] {
        let motion = self.motion;
        [
            self.segments.iter().flat_map(|segment| motion.coordinates(segment)).collect(),
            self.segments.iter().flat_map(|segment| motion.rates(segment)).collect(),
        ]
    }

    /// `−∂E_spring/∂q − ∂D/∂q̇`
    pub fn torques(&mut self) -> Vec<NodeId> {
        let [coordinates, rates] = self.variables();
        let g = &mut self.graph;
        let elastic = gradient(g, self.spring_energy, &coordinates);
        let viscous = gradient(g, self.dissipation, &rates);
        let total = elastic.into_iter().zip(viscous).map(|(elastic, viscous)| {
            let sum = g.add(elastic, viscous);
            g.neg(sum)
        });
        total.collect()
    }

    /// Minus the derivative of the torques along a step; rows are torques, columns coordinates.
    pub fn tangent(&mut self) -> Vec<Vec<NodeId>> {
        let torques = self.torques();
        let [coordinates, rates] = self.variables();
        resistance(&mut self.graph, &torques, &coordinates, &rates)
    }
}

/// Minus the derivative of `torques` when `δq = w_q δq̈` and `δq̇ = w_v δq̈`; rows are torques, columns coordinates.
pub(super) fn resistance(
    graph: &mut Graph,
    torques: &[NodeId],
    coordinates: &[NodeId],
    rates: &[NodeId],
) -> Vec<Vec<NodeId>> {
    let resistance: Vec<NodeId> = torques.iter().map(|&torque| graph.neg(torque)).collect();
    let (coordinate_weight, rate_weight) = step_weights(graph);
    let columns: Vec<Vec<NodeId>> = coordinates
        .iter()
        .zip(rates)
        .map(|(&coordinate, &rate)| {
            let direction = BTreeMap::from([(coordinate, coordinate_weight), (rate, rate_weight)]);
            directional_derivative(graph, &resistance, &direction)
        })
        .collect();
    transpose(&columns)
}

/// A vector of a segment whose polar axis is `z`, as [`Segment`] states it.
fn along_z(vector: Vec3) -> Vec3 {
    vector
}

/// The vector of a segment whose polar axis is `x`: `e = (cos φ, sin φ cos θ, sin φ sin θ)`.
fn along_x([x, y, z]: Vec3) -> Vec3 {
    [z, x, y]
}

/// The four blocks of the tangent of a joint, row by row, with their names and the segments that they concern.
pub(super) fn tangent_blocks(rows: &[Vec<NodeId>], blocks: [(&str, &str); 4]) -> Vec<Output> {
    let size = rows.len() / 2;
    let torques = if size == 1 { "torque" } else { "torques" };
    let block = |(i, (name, where_to)): (usize, (&str, &str))| {
        let (row, column) = (size * (i / 2), size * (i % 2));
        let block = rows[row..row + size].iter().map(|row| row[column..column + size].to_vec()).collect();
        Output::matrix(name, &format!("{torques} on {where_to}"), TORQUE_SLOPE, block)
    };
    blocks.into_iter().enumerate().map(block).collect()
}

/// The blocks of the tangent of a joint between two segments.
pub(super) const BLOCKS: [(&str, &str); 4] = [
    ("previous_previous", "the previous segment along its `q̈`"),
    ("previous_next", "the previous segment along the next one's `q̈`"),
    ("next_previous", "the next segment along the previous one's `q̈`"),
    ("next_next", "the next segment along its `q̈`"),
];

pub(super) fn joint_constants(graph: &Graph) -> Vec<Input> {
    vec![
        Input::symbols(graph, "stiffness", "c in N m", &["stiffness"]),
        Input::symbols(graph, "damping", "d in N m s", &["damping"]),
    ]
}

/// The azimuth of the next segment less that of the previous one enters by its sine and cosine.
pub(super) fn azimuth_step(graph: &mut Graph) -> Input {
    let (previous, next) = (Segment::new(graph, "previous"), Segment::new(graph, "next"));
    let azimuth_step = graph.sub(previous.theta, next.theta);
    Input {
        name: "azimuth_step".into(),
        doc: "sin(θ − θ'), cos(θ − θ'), with θ' of the next segment".into(),
        elements: vec![
            ("sin_azimuth_step".into(), graph.sin(azimuth_step)),
            ("cos_azimuth_step".into(), graph.cos(azimuth_step)),
        ],
    }
}

pub(super) fn clamp_inputs(graph: &mut Graph, motion: Motion) -> Vec<Input> {
    let mut inputs = vec![
        vector_input(graph, motion, "clamp_direction", "e0"),
        vector_input(graph, motion, "clamp_direction_rate", "ė0 in 1/s"),
        trigonometry(graph, motion, "next", "next"),
        rates(graph, motion, "next_rates", "next"),
    ];
    inputs.extend(joint_constants(graph));
    inputs
}

pub(super) fn transpose(columns: &[Vec<NodeId>]) -> Vec<Vec<NodeId>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}
