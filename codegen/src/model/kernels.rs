//! The derivatives of one segment and of one joint, over which the solver loops in O(n).
//!
//! A segment is seen from its inner end `x`: its coordinates are `(x, φ, θ)`, and Lagrange's equations for them
//! give the force `p` that must act at `x` and the torques `τ` that must act on `(φ, θ)`:
//!
//! ```text
//! p = m ẍ + C q̈ + p_0 + F,   τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F,   ẍ' = ẍ + G q̈ + b,
//! ```
//!
//! where `F` is what the outer part of the chain needs at the segment's outer end `x'`. A joint adds torques
//! to the two segments that it connects. Tangents are derivatives along `q̈`, with the coordinates and rates
//! following it as an implicit step does: `δq = w_q δq̈`, `δq̇ = w_v δq̈`.
//!
//! The sines and cosines of the coordinates are inputs of the kernels, so that the solver computes each once per segment.
//!
//! In the plane of rotation a segment has the one coordinate `θ`, and vectors have two components. The same functions derive
//! these kernels from the energies for `φ = π/2`; their names begin with `planar_`. [`super::lateral`] adds the linearised
//! equations of the motion out of that plane.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, output_nodes, set_output_nodes};
use crate::ir::unit::Unit;
use crate::model::chain::{
    self, ACCELERATION, ANGULAR_RATE, Clamp, DAMPING, INERTIA, Motion, Parameters, STIFFNESS, Segment, VELOCITY, Vec3,
    vector_symbol,
};
use crate::model::lateral;
use crate::passes::calculus::{directional_derivative, gradient, jacobian};
use crate::passes::dimension::{self, DimensionError};
use crate::passes::normal_form::{Style, normalise};

/// Unit of a joint's torque.
pub(super) const TORQUE: Unit = Unit::NEWTON.times(Unit::METRE);
/// Unit of the derivative of a torque with respect to an angular acceleration.
pub(super) const TORQUE_SLOPE: Unit = TORQUE.times(Unit::SECOND.powi(2));
/// Unit of the derivative of a force with respect to an angular acceleration.
pub(super) const MASS_LENGTH: Unit = Unit::KILOGRAM.times(Unit::METRE);

/// Kernels for motion in space, in the order in which the solver uses them.
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn spatial_kernels() -> Result<Vec<Kernel>, DimensionError> {
    let mut kernels = of_motion(Motion::Spatial)?;
    kernels.extend([crossed_joint()?, crossed_joint_tangent()?]);
    Ok(kernels)
}

/// Kernels for motion in the plane of rotation, then those of its lateral variation ([`super::lateral`]).
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn planar_kernels() -> Result<Vec<Kernel>, DimensionError> {
    let mut kernels = of_motion(Motion::Planar)?;
    kernels.extend(lateral::kernels()?);
    Ok(kernels)
}

/// All kernels of the solver: [`spatial_kernels`], then [`planar_kernels`].
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn kernels() -> Result<Vec<Kernel>, DimensionError> {
    let mut kernels = spatial_kernels()?;
    kernels.extend(planar_kernels()?);
    Ok(kernels)
}

fn of_motion(motion: Motion) -> Result<Vec<Kernel>, DimensionError> {
    let derivations = [
        segment,
        segment_tangent,
        segment_energy,
        joint,
        joint_tangent,
        joint_energy,
        clamp,
        clamp_tangent,
        clamp_energy,
    ];
    derivations.into_iter().map(|derive| derive(motion)).collect()
}

/// The name of a kernel for `motion`, whose name in space is `name`.
fn name_for(motion: Motion, name: &str) -> String {
    match motion {
        Motion::Spatial => name.into(),
        Motion::Planar => format!("planar_{name}"),
    }
}

/// The summary of a kernel for `motion`.
fn summary_for(motion: Motion, summary: &str) -> String {
    match motion {
        Motion::Spatial => summary.into(),
        Motion::Planar => format!("{summary}\nIn the plane of rotation: `φ = π/2`, `q = θ`."),
    }
}

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
    fn variables(&self) -> [Vec<NodeId>; 2] {
        [self.motion.coordinates(&self.segment), self.motion.rates(&self.segment)]
    }

    /// `q → q̇`
    fn rates_of_coordinates(&self) -> BTreeMap<NodeId, NodeId> {
        let [coordinates, rates] = self.variables();
        coordinates.into_iter().zip(rates).collect()
    }
}

fn segment(motion: Motion) -> Result<Kernel, DimensionError> {
    let mut free = FreeSegment::new(motion);
    let moving = free.rates_of_coordinates();
    let [coordinates, rates_of] = free.variables();
    let (d, s) = (coordinates.len(), motion.axes());
    let g = &mut free.graph;
    let base_momentum = gradient(g, free.kinetic_energy, &free.base_velocity);
    let momentum = gradient(g, free.kinetic_energy, &rates_of);
    let coupling = jacobian(g, &base_momentum, &rates_of);
    let inertia = jacobian(g, &momentum, &rates_of);
    let base_bias = directional_derivative(g, &base_momentum, &moving);
    let momentum_rate = directional_derivative(g, &momentum, &moving);
    let kinetic_gradient = gradient(g, free.kinetic_energy, &coordinates);
    let bias = (0..d).map(|i| g.sub(momentum_rate[i], kinetic_gradient[i])).collect();
    let reach_jacobian = jacobian(g, &free.reach, &coordinates);
    let reach_bias = directional_derivative(g, &free.reach_rate, &moving);
    let outputs = vec![
        Output::matrix("inertia", &format!("`I = ∂²E_kin/∂q̇²`, {d} × {d}"), INERTIA, inertia),
        Output::matrix("coupling", &format!("`C = ∂²E_kin/∂ẋ∂q̇`, {s} × {d}"), MASS_LENGTH, coupling),
        Output::vector("bias", "`τ_0 = d/dt(∂E_kin/∂q̇) − ∂E_kin/∂q` for `ẍ = 0`, `q̈ = 0`", TORQUE, bias),
        Output::vector("base_bias", "`p_0 = d/dt(∂E_kin/∂ẋ)` for `ẍ = 0`, `q̈ = 0`", Unit::NEWTON, base_bias),
        Output::vector("reach", "`h e`, outer end less inner end", Unit::METRE, free.reach),
        Output::vector("reach_rate", "`h ė`", VELOCITY, free.reach_rate),
        Output::matrix("reach_jacobian", &format!("`G = ∂(h e)/∂q`, {s} × {d}"), Unit::METRE, reach_jacobian),
        Output::vector("reach_bias", "`b = h ë` for `q̈ = 0`", ACCELERATION, reach_bias),
    ];
    let derivation = Derivation { graph: free.graph, outputs };
    let summary = "Kinematics and inertia of one segment, seen from its inner end `x`:\n\
                   `p = m ẍ + C q̈ + p_0 + F`, `τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F`, `ẍ' = ẍ + G q̈ + b`,\n\
                   from `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²`.";
    let (name, summary) = (name_for(motion, "segment"), summary_for(motion, summary));
    derivation.kernel(&name, &summary, Some(Style::Cheap), |graph| {
        let mut inputs = vec![trigonometry(graph, motion, "angles", ""), rates(graph, motion, "rates", "")];
        inputs.extend(segment_constants(graph));
        inputs
    })
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

fn segment_tangent(motion: Motion) -> Result<Kernel, DimensionError> {
    let InverseDynamics { mut free, accelerations, torque, base_force, reach_acceleration } =
        InverseDynamics::new(motion);
    let [coordinates, rates_of] = free.variables();
    let g = &mut free.graph;
    let (coordinate_weight, rate_weight) = step_weights(g);
    let (d, s) = (coordinates.len(), motion.axes());
    let one = g.integer(1);
    let mut along_step = |outputs: &[NodeId]| {
        let mut columns = Vec::new();
        for i in 0..d {
            let direction = BTreeMap::from([
                (coordinates[i], coordinate_weight),
                (rates_of[i], rate_weight),
                (accelerations[i], one),
            ]);
            columns.push(directional_derivative(g, outputs, &direction));
        }
        transpose(&columns)
    };
    let outputs = vec![
        Output::matrix("torque", &format!("`∂τ/∂q̈`, {d} × {d}"), INERTIA, along_step(&torque)),
        Output::matrix("base_force", &format!("`∂p/∂q̈`, {s} × {d}"), MASS_LENGTH, along_step(&base_force)),
        Output::matrix(
            "outer_acceleration",
            &format!("`∂ẍ'/∂q̈`, {s} × {d}"),
            Unit::METRE,
            along_step(&reach_acceleration),
        ),
    ];
    let derivation = Derivation { graph: free.graph, outputs };
    let (name, plain) = (name_for(motion, "segment_tangent"), name_for(motion, "segment"));
    let summary = format!(
        "Tangent of one segment: how `τ`, `p` and `ẍ'` of [`{plain}`] change with its own `q̈` when\n\
         `δq = w_q δq̈` and `δq̇ = w_v δq̈`, for fixed `ẍ` and `F`."
    );
    derivation.kernel(&name, &summary_for(motion, &summary), Some(Style::Cheap), |graph| {
        let mut inputs = vec![trigonometry(graph, motion, "angles", ""), rates(graph, motion, "rates", "")];
        inputs.push(match motion {
            Motion::Spatial => {
                Input::symbols(graph, "accelerations", "φ̈, θ̈ in rad/s²", &["phi_acceleration", "theta_acceleration"])
            }
            Motion::Planar => Input::symbols(graph, "theta_acceleration", "θ̈ in rad/s²", &["theta_acceleration"]),
        });
        inputs.push(vector_input(graph, motion, "base_acceleration", "ẍ in m/s²"));
        inputs.push(vector_input(graph, motion, "outer_force", "F in N"));
        inputs.extend(segment_constants(graph));
        inputs.extend(weights(graph));
        inputs
    })
}

fn segment_energy(motion: Motion) -> Result<Kernel, DimensionError> {
    let free = FreeSegment::new(motion);
    let mut graph = free.graph;
    let base = vector_symbol(&mut graph, "base_position", "x", Unit::METRE);
    let direction = free.segment.direction(&mut graph);
    let gravity = chain::gravity_energy(&mut graph, &free.parameters, base, direction);
    let [gravity] = motion.specialise(&mut graph, &[free.segment], [gravity]);
    let outputs = vec![
        Output::scalar("kinetic", "`E_kin`", Unit::JOULE, free.kinetic_energy),
        Output::scalar("gravity", "`E_grav`", Unit::JOULE, gravity),
    ];
    let summary = "Energies of one segment: `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²` and `E_grav = −m g·(x + ½ h e)`.";
    let (name, summary) = (name_for(motion, "segment_energy"), summary_for(motion, summary));
    Derivation { graph, outputs }.kernel(&name, &summary, None, |graph| {
        let mut inputs = vec![
            trigonometry(graph, motion, "angles", ""),
            rates(graph, motion, "rates", ""),
            vector_input(graph, motion, "base_position", "x in m"),
            vector_input(graph, motion, "base_velocity", "ẋ in m/s"),
            vector_input(graph, motion, "gravity", "g in m/s²"),
        ];
        inputs.extend(segment_constants(graph));
        inputs
    })
}

/// Rotates a vector from the polar axis `z`, for which [`Segment`] states it, to the polar axis of the segment.
type Turn = fn(Vec3) -> Vec3;

/// A joint between two directions and the segments whose coordinates it acts on.
pub(super) struct Joint {
    pub graph: Graph,
    pub motion: Motion,
    pub segments: Vec<Segment>,
    pub clamp: Clamp,
    spring_energy: NodeId,
    dissipation: NodeId,
}

impl Joint {
    pub fn between_segments(motion: Motion) -> Self {
        Self::new(motion, &[("previous", along_z), ("next", along_z)])
    }

    /// Between a segment whose polar axis is `z` and one whose polar axis is `x`, in either order: the energies are
    /// the same from both sides.
    fn crossed() -> Self {
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
    fn variables(&self) -> [Vec<NodeId>; 2] {
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
    fn tangent(&mut self) -> Vec<Vec<NodeId>> {
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

/// The four blocks of the tangent of a joint, row by row, with their names and descriptions.
pub(super) fn tangent_blocks(rows: &[Vec<NodeId>], blocks: [(&str, &str); 4]) -> Vec<Output> {
    let size = rows.len() / 2;
    let block = |(i, (name, doc)): (usize, (&str, &str))| {
        let (row, column) = (size * (i / 2), size * (i % 2));
        let block = rows[row..row + size].iter().map(|row| row[column..column + size].to_vec()).collect();
        Output::matrix(name, doc, TORQUE_SLOPE, block)
    };
    blocks.into_iter().enumerate().map(block).collect()
}

/// The blocks of the tangent of a joint between two segments.
pub(super) const BLOCKS: [(&str, &str); 4] = [
    ("previous_previous", "torques on the previous segment along its `q̈`"),
    ("previous_next", "torques on the previous segment along the next one's `q̈`"),
    ("next_previous", "torques on the next segment along the previous one's `q̈`"),
    ("next_next", "torques on the next segment along its `q̈`"),
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

/// Inputs of a joint between two segments. Only the difference of the azimuths enters, because the energies do not
/// change when both sides turn about `z`.
fn joint_inputs(graph: &mut Graph, motion: Motion) -> Vec<Input> {
    let mut inputs = match motion {
        Motion::Spatial => {
            let polar = |graph: &mut Graph, name: &str| {
                let segment = Segment::new(graph, name);
                Input {
                    name: name.into(),
                    doc: "sin φ, cos φ".into(),
                    elements: vec![
                        (format!("sin_phi_{name}"), graph.sin(segment.phi)),
                        (format!("cos_phi_{name}"), graph.cos(segment.phi)),
                    ],
                }
            };
            vec![polar(graph, "previous"), polar(graph, "next"), azimuth_step(graph)]
        }
        Motion::Planar => vec![
            Input::symbols(graph, "theta_previous", "θ in rad", &["theta_previous"]),
            Input::symbols(graph, "theta_next", "θ' in rad, less than π from θ", &["theta_next"]),
        ],
    };
    inputs.push(rates(graph, motion, "previous_rates", "previous"));
    inputs.push(rates(graph, motion, "next_rates", "next"));
    inputs.extend(joint_constants(graph));
    inputs
}

/// The coordinates of a segment, for descriptions.
fn coordinates_in_words(motion: Motion) -> &'static str {
    match motion {
        Motion::Spatial => "`(φ, θ)`",
        Motion::Planar => "`θ`",
    }
}

fn joint(motion: Motion) -> Result<Kernel, DimensionError> {
    let mut joint = Joint::between_segments(motion);
    let torques = joint.torques();
    let (previous, next) = torques.split_at(torques.len() / 2);
    let on = |which: &str| format!("torques on {} of the {which} segment", coordinates_in_words(motion));
    let outputs = vec![
        Output::vector("previous", &on("previous"), TORQUE, previous.to_vec()),
        Output::vector("next", &on("next"), TORQUE, next.to_vec()),
    ];
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Torques of a joint, `−∂E_spring/∂q − ∂D/∂q̇`, on the two segments that it connects, from\n\
                   `E_spring = c S(u)`, `u = ½|e' − e|² = 1 − cos α`, `S = ½α²`, and `D = ½ d |ω' − ω|²`, `ω = e × ė`.";
    let (name, summary) = (name_for(motion, "joint"), summary_for(motion, summary));
    derivation.kernel(&name, &summary, Some(Style::Cheap), |graph| joint_inputs(graph, motion))
}

fn joint_tangent(motion: Motion) -> Result<Kernel, DimensionError> {
    let mut joint = Joint::between_segments(motion);
    let rows = joint.tangent();
    let size = rows.len() / 2;
    let derivation = Derivation { outputs: tangent_blocks(&rows, BLOCKS), graph: joint.graph };
    let (name, plain) = (name_for(motion, "joint_tangent"), name_for(motion, "joint"));
    let summary = format!(
        "Tangent of a joint: minus the derivative of the torques of [`{plain}`] along `q̈`, when\n\
         `δq = w_q δq̈` and `δq̇ = w_v δq̈`. Each block is {size} × {size}."
    );
    derivation.kernel(&name, &summary_for(motion, &summary), Some(Style::Cheap), |graph| {
        // In the plane the torques are linear, so that the state does not enter.
        let mut inputs = match motion {
            Motion::Spatial => joint_inputs(graph, motion),
            Motion::Planar => joint_constants(graph),
        };
        inputs.extend(weights(graph));
        inputs
    })
}

fn energies(joint: &Joint) -> Vec<Output> {
    vec![
        Output::scalar("spring", "`E_spring`", Unit::JOULE, joint.spring_energy),
        Output::scalar("dissipation", "`D`", Unit::WATT, joint.dissipation),
    ]
}

fn joint_energy(motion: Motion) -> Result<Kernel, DimensionError> {
    let joint = Joint::between_segments(motion);
    let derivation = Derivation { outputs: energies(&joint), graph: joint.graph };
    let summary = "Energy and dissipation function of a joint: `E_spring = c S(½|e' − e|²)` and `D = ½ d |ω' − ω|²`, `ω = e × ė`.";
    let (name, summary) = (name_for(motion, "joint_energy"), summary_for(motion, summary));
    match motion {
        Motion::Spatial => derivation.kernel(&name, &summary, None, |graph| {
            let mut inputs = vec![
                trigonometry(graph, motion, "previous", "previous"),
                trigonometry(graph, motion, "next", "next"),
                rates(graph, motion, "previous_rates", "previous"),
                rates(graph, motion, "next_rates", "next"),
            ];
            inputs.extend(joint_constants(graph));
            inputs
        }),
        Motion::Planar => derivation.kernel(&name, &summary, Some(Style::Cheap), |graph| joint_inputs(graph, motion)),
    }
}

fn crossed_joint_inputs(graph: &mut Graph) -> Vec<Input> {
    let mut inputs = vec![
        trigonometry(graph, Motion::Spatial, "z_angles", "z"),
        trigonometry(graph, Motion::Spatial, "x_angles", "x"),
        rates(graph, Motion::Spatial, "z_rates", "z"),
        rates(graph, Motion::Spatial, "x_rates", "x"),
    ];
    inputs.extend(joint_constants(graph));
    inputs
}

fn crossed_joint() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::crossed();
    let torques = joint.torques();
    let outputs = vec![
        Output::vector("z", "torques on `(φ, θ)` of the segment with polar axis z", TORQUE, torques[..2].to_vec()),
        Output::vector("x", "torques on `(φ, θ)` of the segment with polar axis x", TORQUE, torques[2..].to_vec()),
    ];
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Torques of a joint as in [`joint`], between a segment with `e = (sin φ cos θ, sin φ sin θ, cos φ)`\n\
                   (polar axis z) and one with `e = (cos φ, sin φ cos θ, sin φ sin θ)` (polar axis x), in either order.";
    derivation.kernel("crossed_joint", summary, Some(Style::Cheap), crossed_joint_inputs)
}

fn crossed_joint_tangent() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::crossed();
    let rows = joint.tangent();
    let outputs = tangent_blocks(
        &rows,
        [
            ("z_z", "torques on the segment with polar axis z along its `q̈`"),
            ("z_x", "torques on the segment with polar axis z along the other's `q̈`"),
            ("x_z", "torques on the segment with polar axis x along the other's `q̈`"),
            ("x_x", "torques on the segment with polar axis x along its `q̈`"),
        ],
    );
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Tangent of a joint between polar axes: minus the derivative of the torques of [`crossed_joint`]\n\
                   along `q̈`, when `δq = w_q δq̈` and `δq̇ = w_v δq̈`. Each block is 2 × 2.";
    derivation.kernel("crossed_joint_tangent", summary, Some(Style::Cheap), |graph| {
        let mut inputs = crossed_joint_inputs(graph);
        inputs.extend(weights(graph));
        inputs
    })
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

fn clamp(motion: Motion) -> Result<Kernel, DimensionError> {
    let mut joint = Joint::at_clamp(motion);
    let torques = joint.torques();
    let doc = format!("torques on {} of the first segment", coordinates_in_words(motion));
    let outputs = vec![Output::vector("next", &doc, TORQUE, torques)];
    let derivation = Derivation { graph: joint.graph, outputs };
    let (name, plain) = (name_for(motion, "clamp"), name_for(motion, "joint"));
    let summary = format!(
        "Torques of the clamp joint on the first segment, `−∂E_spring/∂q − ∂D/∂q̇`, as in [`{plain}`], with\n\
         the clamp's `e0` and `ω0 = e0 × ė0` on the inner side."
    );
    derivation.kernel(&name, &summary_for(motion, &summary), Some(Style::Cheap), |graph| clamp_inputs(graph, motion))
}

fn clamp_tangent(motion: Motion) -> Result<Kernel, DimensionError> {
    let mut joint = Joint::at_clamp(motion);
    let outputs =
        vec![Output::matrix("next_next", "torques on the first segment along its `q̈`", TORQUE_SLOPE, joint.tangent())];
    let derivation = Derivation { graph: joint.graph, outputs };
    let (name, plain) = (name_for(motion, "clamp_tangent"), name_for(motion, "clamp"));
    let summary = format!(
        "Tangent of the clamp joint: minus the derivative of the torques of [`{plain}`] along `q̈`, when\n\
         `δq = w_q δq̈` and `δq̇ = w_v δq̈`."
    );
    derivation.kernel(&name, &summary_for(motion, &summary), Some(Style::Cheap), |graph| {
        let mut inputs = clamp_inputs(graph, motion);
        inputs.extend(weights(graph));
        inputs
    })
}

fn clamp_energy(motion: Motion) -> Result<Kernel, DimensionError> {
    let mut joint = Joint::at_clamp(motion);
    let g = &mut joint.graph;
    let axes = motion.axes();
    let elastic = gradient(g, joint.spring_energy, &joint.clamp.direction[..axes]);
    let viscous = gradient(g, joint.dissipation, &joint.clamp.direction_rate[..axes]);
    let reaction: Vec<NodeId> = elastic.into_iter().zip(viscous).map(|(a, b)| g.add(a, b)).collect();
    let power = g.dot(&reaction, &joint.clamp.direction_rate);
    let mut outputs = energies(&joint);
    outputs.push(Output::scalar(
        "power",
        "`(∂E_spring/∂e0 + ∂D/∂ė0)·ė0`, what the turning clamp puts in",
        Unit::WATT,
        power,
    ));
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Energy and dissipation function of the clamp joint, `c S(½|e' − e0|²)` and `½ d |ω' − ω0|²`, and the power of\n\
                   its turning, `(∂E_spring/∂e0 + ∂D/∂ė0)·ė0`.";
    let (name, summary) = (name_for(motion, "clamp_energy"), summary_for(motion, summary));
    derivation.kernel(&name, &summary, None, |graph| clamp_inputs(graph, motion))
}

fn transpose(columns: &[Vec<NodeId>]) -> Vec<Vec<NodeId>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}
