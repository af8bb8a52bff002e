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

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Input, Kernel, Output, output_nodes, set_output_nodes};
use crate::ir::unit::Unit;
use crate::model::chain::{
    self, ACCELERATION, ANGULAR_RATE, Clamp, DAMPING, INERTIA, Parameters, STIFFNESS, Segment, VELOCITY, Vec3, to_vec3,
    vector_symbol,
};
use crate::passes::calculus::{directional_derivative, gradient, jacobian};
use crate::passes::dimension::{self, DimensionError};
use crate::passes::normal_form::{Style, normalise};

/// Unit of a joint's torque.
const TORQUE: Unit = Unit::NEWTON.times(Unit::METRE);
/// Unit of the derivative of a torque with respect to an angular acceleration.
const TORQUE_SLOPE: Unit = TORQUE.times(Unit::SECOND.powi(2));
/// Unit of the derivative of a force with respect to an angular acceleration.
const MASS_LENGTH: Unit = Unit::KILOGRAM.times(Unit::METRE);

/// All kernels, in the order in which the solver uses them.
///
/// # Errors
/// If a term of the derivation makes no physical sense.
pub fn kernels() -> Result<Vec<Kernel>, DimensionError> {
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
        crossed_joint,
        crossed_joint_tangent,
    ];
    derivations.into_iter().map(|derive| derive()).collect()
}

/// Derived expressions with their names, before simplification.
struct Derivation {
    graph: Graph,
    outputs: Vec<Output>,
}

impl Derivation {
    /// Simplifies the outputs and binds the inputs that `inputs` lists.
    fn kernel(
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

/// Sines and cosines of a segment's angles.
fn trigonometry(graph: &mut Graph, name: &str, label: &str) -> Input {
    let segment = Segment::new(graph, label);
    let suffix = if label.is_empty() { String::new() } else { format!("_{label}") };
    let elements = vec![
        (format!("sin_phi{suffix}"), graph.sin(segment.phi)),
        (format!("cos_phi{suffix}"), graph.cos(segment.phi)),
        (format!("sin_theta{suffix}"), graph.sin(segment.theta)),
        (format!("cos_theta{suffix}"), graph.cos(segment.theta)),
    ];
    Input { name: name.into(), doc: "sin φ, cos φ, sin θ, cos θ".into(), elements }
}

fn rates(graph: &Graph, name: &str, label: &str) -> Input {
    let suffix = if label.is_empty() { String::new() } else { format!("_{label}") };
    let names = [format!("phi_rate{suffix}"), format!("theta_rate{suffix}")];
    Input::symbols(graph, name, "φ̇, θ̇ in rad/s", &names.each_ref().map(String::as_str))
}

fn segment_constants(graph: &Graph) -> Vec<Input> {
    vec![
        Input::symbols(graph, "segment_length", "h in m", &["segment_length"]),
        Input::symbols(graph, "segment_mass", "m in kg", &["segment_mass"]),
        Input::symbols(graph, "segment_inertia", "J in kg m²", &["segment_inertia"]),
    ]
}

/// The symbols `w_q` and `w_v`.
fn step_weights(graph: &mut Graph) -> (NodeId, NodeId) {
    let coordinates = graph.symbol("coordinate_weight", "w_q", Unit::SECOND.powi(2));
    (coordinates, graph.symbol("rate_weight", "w_v", Unit::SECOND))
}

fn weights(graph: &Graph) -> Vec<Input> {
    vec![
        Input::symbols(graph, "coordinate_weight", "w_q in s²: δq = w_q δq̈", &["coordinate_weight"]),
        Input::symbols(graph, "rate_weight", "w_v in s: δq̇ = w_v δq̈", &["rate_weight"]),
    ]
}

fn vector_input(graph: &Graph, name: &str, doc: &str) -> Input {
    let names = ["x", "y", "z"].map(|axis| format!("{name}_{axis}"));
    Input::symbols(graph, name, doc, &names.each_ref().map(String::as_str))
}

/// One segment with a free inner end.
struct FreeSegment {
    graph: Graph,
    parameters: Parameters,
    segment: Segment,
    base_velocity: Vec3,
    kinetic_energy: NodeId,
    /// The outer end relative to the inner one, `h e`, and its rate.
    reach: Vec3,
    reach_rate: Vec3,
}

impl FreeSegment {
    fn new() -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let parameters = Parameters::new(g);
        let segment = Segment::new(g, "");
        let base_velocity = vector_symbol(g, "base_velocity", "ẋ", VELOCITY);
        let (direction, rate) = (segment.direction(g), segment.direction_rate(g));
        let kinetic_energy = chain::kinetic_energy(g, &parameters, base_velocity, rate);
        let origin = [g.integer(0); 3];
        let reach = chain::outer_end(g, &parameters, origin, direction);
        let reach_rate = chain::outer_end(g, &parameters, origin, rate);
        Self { graph, parameters, segment, base_velocity, kinetic_energy, reach, reach_rate }
    }

    /// `q → q̇`
    fn motion(&self) -> BTreeMap<NodeId, NodeId> {
        self.segment.coordinates().into_iter().zip(self.segment.rates()).collect()
    }
}

fn segment() -> Result<Kernel, DimensionError> {
    let mut free = FreeSegment::new();
    let motion = free.motion();
    let (coordinates, rates_of) = (free.segment.coordinates(), free.segment.rates());
    let g = &mut free.graph;
    let base_momentum = gradient(g, free.kinetic_energy, &free.base_velocity);
    let momentum = gradient(g, free.kinetic_energy, &rates_of);
    let coupling = jacobian(g, &base_momentum, &rates_of);
    let inertia = jacobian(g, &momentum, &rates_of);
    let base_bias = directional_derivative(g, &base_momentum, &motion);
    let momentum_rate = directional_derivative(g, &momentum, &motion);
    let kinetic_gradient = gradient(g, free.kinetic_energy, &coordinates);
    let bias = (0..2).map(|i| g.sub(momentum_rate[i], kinetic_gradient[i])).collect();
    let reach_jacobian = jacobian(g, &free.reach, &coordinates);
    let reach_bias = directional_derivative(g, &free.reach_rate, &motion);
    let outputs = vec![
        Output::matrix("inertia", "`I = ∂²E_kin/∂q̇²`, 2 × 2", INERTIA, inertia),
        Output::matrix("coupling", "`C = ∂²E_kin/∂ẋ∂q̇`, 3 × 2", MASS_LENGTH, coupling),
        Output::vector("bias", "`τ_0 = d/dt(∂E_kin/∂q̇) − ∂E_kin/∂q` for `ẍ = 0`, `q̈ = 0`", TORQUE, bias),
        Output::vector("base_bias", "`p_0 = d/dt(∂E_kin/∂ẋ)` for `ẍ = 0`, `q̈ = 0`", Unit::NEWTON, base_bias),
        Output::vector("reach", "`h e`, outer end less inner end", Unit::METRE, free.reach.to_vec()),
        Output::vector("reach_rate", "`h ė`", VELOCITY, free.reach_rate.to_vec()),
        Output::matrix("reach_jacobian", "`G = ∂(h e)/∂q`, 3 × 2", Unit::METRE, reach_jacobian),
        Output::vector("reach_bias", "`b = h ë` for `q̈ = 0`", ACCELERATION, reach_bias),
    ];
    let derivation = Derivation { graph: free.graph, outputs };
    let summary = "Kinematics and inertia of one segment, seen from its inner end `x`:\n\
                   `p = m ẍ + C q̈ + p_0 + F`, `τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F`, `ẍ' = ẍ + G q̈ + b`,\n\
                   from `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²`.";
    derivation.kernel("segment", summary, Some(Style::Cheap), |graph| {
        let mut inputs = vec![trigonometry(graph, "angles", ""), rates(graph, "rates", "")];
        inputs.extend(segment_constants(graph));
        inputs
    })
}

fn segment_tangent() -> Result<Kernel, DimensionError> {
    let mut free = FreeSegment::new();
    let mut motion = free.motion();
    let (coordinates, rates_of) = (free.segment.coordinates(), free.segment.rates());
    let g = &mut free.graph;
    let base_acceleration = vector_symbol(g, "base_acceleration", "ẍ", ACCELERATION);
    let accelerations = [("phi_acceleration", "φ̈"), ("theta_acceleration", "θ̈")]
        .map(|(name, notation)| g.symbol(name, notation, ANGULAR_RATE.per(Unit::SECOND)));
    let outer_force = vector_symbol(g, "outer_force", "F", Unit::NEWTON);
    let (coordinate_weight, rate_weight) = step_weights(g);
    motion.extend(rates_of.into_iter().zip(accelerations));
    motion.extend(free.base_velocity.into_iter().zip(base_acceleration));

    let base_momentum = gradient(g, free.kinetic_energy, &free.base_velocity);
    let momentum = gradient(g, free.kinetic_energy, &rates_of);
    let base_force = directional_derivative(g, &base_momentum, &motion);
    let momentum_rate = directional_derivative(g, &momentum, &motion);
    let kinetic_gradient = gradient(g, free.kinetic_energy, &coordinates);
    let reach_jacobian = jacobian(g, &free.reach, &coordinates);
    let torque: Vec<NodeId> = (0..2)
        .map(|i| {
            let inertial = g.sub(momentum_rate[i], kinetic_gradient[i]);
            let column: Vec<NodeId> = reach_jacobian.iter().map(|row| row[i]).collect();
            let outer = g.dot(&column, &outer_force);
            g.add(inertial, outer)
        })
        .collect();
    let reach_acceleration = directional_derivative(g, &free.reach_rate, &motion);

    let one = g.integer(1);
    let mut along_step = |outputs: &[NodeId]| {
        let mut columns = Vec::new();
        for i in 0..2 {
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
        Output::matrix("torque", "`∂τ/∂q̈`, 2 × 2", INERTIA, along_step(&torque)),
        Output::matrix("base_force", "`∂p/∂q̈`, 3 × 2", MASS_LENGTH, along_step(&base_force)),
        Output::matrix("outer_acceleration", "`∂ẍ'/∂q̈`, 3 × 2", Unit::METRE, along_step(&reach_acceleration)),
    ];
    let derivation = Derivation { graph: free.graph, outputs };
    let summary = "Tangent of one segment: how `τ`, `p` and `ẍ'` of [`segment`] change with its own `q̈` when\n\
                   `δq = w_q δq̈` and `δq̇ = w_v δq̈`, for fixed `ẍ` and `F`.";
    derivation.kernel("segment_tangent", summary, Some(Style::Cheap), |graph| {
        let mut inputs = vec![
            trigonometry(graph, "angles", ""),
            rates(graph, "rates", ""),
            Input::symbols(graph, "accelerations", "φ̈, θ̈ in rad/s²", &["phi_acceleration", "theta_acceleration"]),
            vector_input(graph, "base_acceleration", "ẍ in m/s²"),
            vector_input(graph, "outer_force", "F in N"),
        ];
        inputs.extend(segment_constants(graph));
        inputs.extend(weights(graph));
        inputs
    })
}

fn segment_energy() -> Result<Kernel, DimensionError> {
    let free = FreeSegment::new();
    let mut graph = free.graph;
    let base = vector_symbol(&mut graph, "base_position", "x", Unit::METRE);
    let direction = free.segment.direction(&mut graph);
    let gravity = chain::gravity_energy(&mut graph, &free.parameters, base, direction);
    let outputs = vec![
        Output::scalar("kinetic", "`E_kin`", Unit::JOULE, free.kinetic_energy),
        Output::scalar("gravity", "`E_grav`", Unit::JOULE, gravity),
    ];
    let summary = "Energies of one segment: `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²` and `E_grav = −m g·(x + ½ h e)`.";
    Derivation { graph, outputs }.kernel("segment_energy", summary, None, |graph| {
        let mut inputs = vec![
            trigonometry(graph, "angles", ""),
            rates(graph, "rates", ""),
            vector_input(graph, "base_position", "x in m"),
            vector_input(graph, "base_velocity", "ẋ in m/s"),
            vector_input(graph, "gravity", "g in m/s²"),
        ];
        inputs.extend(segment_constants(graph));
        inputs
    })
}

/// Rotates a vector from the polar axis `z`, for which [`Segment`] states it, to the polar axis of the segment.
type Turn = fn(Vec3) -> Vec3;

/// A joint between two directions and the segments whose coordinates it acts on.
struct Joint {
    graph: Graph,
    segments: Vec<Segment>,
    clamp: Clamp,
    spring_energy: NodeId,
    dissipation: NodeId,
}

impl Joint {
    fn between_segments() -> Self {
        Self::new(&[("previous", along_z), ("next", along_z)])
    }

    /// Between a segment whose polar axis is `z` and one whose polar axis is `x`, in either order: the energies are
    /// the same from both sides.
    fn crossed() -> Self {
        Self::new(&[("z", along_z), ("x", along_x)])
    }

    fn at_clamp() -> Self {
        Self::new(&[("next", along_z)])
    }

    /// The labels of the segments, each with the rotation of its vectors to its polar axis.
    fn new(labels: &[(&str, Turn)]) -> Self {
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
        Self { graph, segments, clamp, spring_energy, dissipation }
    }

    /// `−∂E_spring/∂q − ∂D/∂q̇`
    fn torques(&mut self) -> Vec<NodeId> {
        let coordinates: Vec<NodeId> = self.segments.iter().flat_map(Segment::coordinates).collect();
        let rates: Vec<NodeId> = self.segments.iter().flat_map(Segment::rates).collect();
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
        let g = &mut self.graph;
        let resistance: Vec<NodeId> = torques.into_iter().map(|torque| g.neg(torque)).collect();
        let (coordinate_weight, rate_weight) = step_weights(g);
        let pairs = self.segments.iter().flat_map(|segment| segment.coordinates().into_iter().zip(segment.rates()));
        let columns: Vec<Vec<NodeId>> = pairs
            .map(|(coordinate, rate)| {
                let direction = BTreeMap::from([(coordinate, coordinate_weight), (rate, rate_weight)]);
                directional_derivative(g, &resistance, &direction)
            })
            .collect();
        transpose(&columns)
    }
}

/// A vector of a segment whose polar axis is `z`, as [`Segment`] states it.
fn along_z(vector: Vec3) -> Vec3 {
    vector
}

/// The vector of a segment whose polar axis is `x`: `e = (cos φ, sin φ cos θ, sin φ sin θ)`.
fn along_x([x, y, z]: Vec3) -> Vec3 {
    [z, x, y]
}

/// The 2 × 2 blocks of the 4 × 4 tangent of a joint, row by row, with their names and descriptions.
fn tangent_blocks(rows: &[Vec<NodeId>], blocks: [(&str, &str); 4]) -> Vec<Output> {
    let block = |(i, (name, doc)): (usize, (&str, &str))| {
        let (row, column) = (2 * (i / 2), 2 * (i % 2));
        let block = rows[row..row + 2].iter().map(|row| row[column..column + 2].to_vec()).collect();
        Output::matrix(name, doc, TORQUE_SLOPE, block)
    };
    blocks.into_iter().enumerate().map(block).collect()
}

fn joint_constants(graph: &Graph) -> Vec<Input> {
    vec![
        Input::symbols(graph, "stiffness", "c in N m", &["stiffness"]),
        Input::symbols(graph, "damping", "d in N m s", &["damping"]),
    ]
}

/// Inputs of a joint between two segments. Only the difference of the azimuths enters, because the energies do not
/// change when both sides turn about `z`.
fn joint_inputs(graph: &mut Graph) -> Vec<Input> {
    let (previous, next) = (Segment::new(graph, "previous"), Segment::new(graph, "next"));
    let azimuth_step = graph.sub(previous.theta, next.theta);
    let polar = |graph: &mut Graph, name: &str, segment: Segment| Input {
        name: name.into(),
        doc: "sin φ, cos φ".into(),
        elements: vec![
            (format!("sin_phi_{name}"), graph.sin(segment.phi)),
            (format!("cos_phi_{name}"), graph.cos(segment.phi)),
        ],
    };
    let mut inputs = vec![
        polar(graph, "previous", previous),
        polar(graph, "next", next),
        Input {
            name: "azimuth_step".into(),
            doc: "sin(θ − θ'), cos(θ − θ'), with θ' of the next segment".into(),
            elements: vec![
                ("sin_azimuth_step".into(), graph.sin(azimuth_step)),
                ("cos_azimuth_step".into(), graph.cos(azimuth_step)),
            ],
        },
        rates(graph, "previous_rates", "previous"),
        rates(graph, "next_rates", "next"),
    ];
    inputs.extend(joint_constants(graph));
    inputs
}

fn joint() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::between_segments();
    let torques = joint.torques();
    let outputs = vec![
        Output::vector("previous", "torques on `(φ, θ)` of the previous segment", TORQUE, torques[..2].to_vec()),
        Output::vector("next", "torques on `(φ, θ)` of the next segment", TORQUE, torques[2..].to_vec()),
    ];
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Torques of a joint, `−∂E_spring/∂q − ∂D/∂q̇`, on the two segments that it connects, from\n\
                   `E_spring = c S(u)`, `u = ½|e' − e|² = 1 − cos α`, `S = ½α²`, and `D = ½ d |ω' − ω|²`, `ω = e × ė`.";
    derivation.kernel("joint", summary, Some(Style::Cheap), joint_inputs)
}

fn joint_tangent() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::between_segments();
    let rows = joint.tangent();
    let outputs = tangent_blocks(
        &rows,
        [
            ("previous_previous", "torques on the previous segment along its `q̈`"),
            ("previous_next", "torques on the previous segment along the next one's `q̈`"),
            ("next_previous", "torques on the next segment along the previous one's `q̈`"),
            ("next_next", "torques on the next segment along its `q̈`"),
        ],
    );
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Tangent of a joint: minus the derivative of the torques of [`joint`] along `q̈`, when\n\
                   `δq = w_q δq̈` and `δq̇ = w_v δq̈`. Each block is 2 × 2.";
    derivation.kernel("joint_tangent", summary, Some(Style::Cheap), |graph| {
        let mut inputs = joint_inputs(graph);
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

fn joint_energy() -> Result<Kernel, DimensionError> {
    let joint = Joint::between_segments();
    let derivation = Derivation { outputs: energies(&joint), graph: joint.graph };
    let summary = "Energy and dissipation function of a joint: `E_spring = c S(½|e' − e|²)` and `D = ½ d |ω' − ω|²`, `ω = e × ė`.";
    derivation.kernel("joint_energy", summary, None, |graph| {
        let mut inputs = vec![
            trigonometry(graph, "previous", "previous"),
            trigonometry(graph, "next", "next"),
            rates(graph, "previous_rates", "previous"),
            rates(graph, "next_rates", "next"),
        ];
        inputs.extend(joint_constants(graph));
        inputs
    })
}

fn crossed_joint_inputs(graph: &mut Graph) -> Vec<Input> {
    let mut inputs = vec![
        trigonometry(graph, "z_angles", "z"),
        trigonometry(graph, "x_angles", "x"),
        rates(graph, "z_rates", "z"),
        rates(graph, "x_rates", "x"),
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

fn clamp_inputs(graph: &mut Graph) -> Vec<Input> {
    let mut inputs = vec![
        vector_input(graph, "clamp_direction", "e0"),
        vector_input(graph, "clamp_direction_rate", "ė0 in 1/s"),
        trigonometry(graph, "next", "next"),
        rates(graph, "next_rates", "next"),
    ];
    inputs.extend(joint_constants(graph));
    inputs
}

fn clamp() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::at_clamp();
    let torques = joint.torques();
    let outputs = vec![Output::vector("next", "torques on `(φ, θ)` of the first segment", TORQUE, torques)];
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Torques of the clamp joint on the first segment, `−∂E_spring/∂q − ∂D/∂q̇`, as in [`joint`], with\n\
                   the clamp's `e0` and `ω0 = e0 × ė0` on the inner side.";
    derivation.kernel("clamp", summary, Some(Style::Cheap), clamp_inputs)
}

fn clamp_tangent() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::at_clamp();
    let outputs =
        vec![Output::matrix("next_next", "torques on the first segment along its `q̈`", TORQUE_SLOPE, joint.tangent())];
    let derivation = Derivation { graph: joint.graph, outputs };
    let summary = "Tangent of the clamp joint: minus the derivative of the torques of [`clamp`] along `q̈`, when\n\
                   `δq = w_q δq̈` and `δq̇ = w_v δq̈`.";
    derivation.kernel("clamp_tangent", summary, Some(Style::Cheap), |graph| {
        let mut inputs = clamp_inputs(graph);
        inputs.extend(weights(graph));
        inputs
    })
}

fn clamp_energy() -> Result<Kernel, DimensionError> {
    let mut joint = Joint::at_clamp();
    let g = &mut joint.graph;
    let elastic = to_vec3(gradient(g, joint.spring_energy, &joint.clamp.direction));
    let viscous = to_vec3(gradient(g, joint.dissipation, &joint.clamp.direction_rate));
    let reaction: Vec3 = std::array::from_fn(|i| g.add(elastic[i], viscous[i]));
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
    derivation.kernel("clamp_energy", summary, None, clamp_inputs)
}

fn transpose(columns: &[Vec<NodeId>]) -> Vec<Vec<NodeId>> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows).map(|row| columns.iter().map(|column| column[row]).collect()).collect()
}
