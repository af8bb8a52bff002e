//! Physics of the model: the energies of a chain of rigid segments, and nothing else.
//!
//! A filament is `n` rigid segments of length `h`, mass `m` and transverse moment of inertia `J`
//! about their centres, joined by rotational springs and dampers (Uhlmann and Hoyer 2021, section
//! 2). The springs of a wavy filament are relaxed at an angle `κ` about `z`; mass, inertia,
//! stiffness and damping of a tapered one change along it. Segment `k` points along
//! `e_k = (sin φ_k cos θ_k, sin φ_k sin θ_k, cos φ_k)`; the first is clamped at `r_0(t)` along
//! `e_0(t)`. Each energy is a sum over segments or joints and is stated here once. The whole
//! equations of a chain and the kernels of one segment or joint are derived from the same
//! functions.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::unit::Unit;
use crate::passes::calculus::directional_derivative;
use crate::passes::specialise::{angles_of_springs, substitute};

/// Unit of a joint's stiffness.
pub const STIFFNESS: Unit = Unit::NEWTON.times(Unit::METRE);
/// Unit of a joint's damping.
pub const DAMPING: Unit = STIFFNESS.times(Unit::SECOND);
/// Unit of the velocity of a point.
pub const VELOCITY: Unit = Unit::METRE.per(Unit::SECOND);
/// Unit of the acceleration of a point.
pub const ACCELERATION: Unit = VELOCITY.per(Unit::SECOND);
/// Unit of the rate of an angle.
pub const ANGULAR_RATE: Unit = Unit::RADIAN.per(Unit::SECOND);
/// Unit of a moment of inertia.
pub const INERTIA: Unit = Unit::KILOGRAM.times(Unit::METRE.powi(2));

/// A vector in the inertial frame.
pub type Vec3 = [NodeId; 3];

/// Motion of a filament, which decides its coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// In space: `φ` and `θ` of each segment.
    Spatial,
    /// In the plane of rotation, where every `φ = π/2`: only `θ` of each segment.
    Planar,
}

impl Motion {
    /// The name for this motion of a function whose name in space is `name`.
    pub fn name_for(self, name: &str) -> String {
        match self {
            Self::Spatial => name.into(),
            Self::Planar => format!("planar_{name}"),
        }
    }

    /// The number of components of a vector.
    pub fn axes(self) -> usize {
        match self {
            Self::Spatial => 3,
            Self::Planar => 2,
        }
    }

    /// The number of coordinates of a segment.
    pub fn coordinates_per_segment(self) -> usize {
        match self {
            Self::Spatial => 2,
            Self::Planar => 1,
        }
    }

    /// The coordinates of all `segments`, and their rates.
    pub fn variables(self, segments: &[Segment]) -> [Vec<NodeId>; 2] {
        match self {
            Self::Spatial => [
                segments.iter().flat_map(Segment::coordinates).collect(),
                segments.iter().flat_map(Segment::rates).collect(),
            ],
            Self::Planar => [
                segments.iter().map(|segment| segment.theta).collect(),
                segments.iter().map(|segment| segment.theta_rate).collect(),
            ],
        }
    }

    /// Specialises `energies` of `segments` to this motion. In the plane `φ = π/2` and `φ̇ = 0`,
    /// nothing moves or pulls along `z`, and the angle of a joint is the difference of two
    /// azimuths.
    pub fn specialise<const N: usize>(
        self,
        graph: &mut Graph,
        segments: &[Segment],
        energies: [NodeId; N],
    ) -> [NodeId; N] {
        if self == Self::Spatial {
            return energies;
        }
        let values = in_plane(graph, segments);
        let planar = substitute(graph, &energies, &values);
        angles_of_springs(graph, &planar)
            .try_into()
            .expect("each energy has an image")
    }
}

/// Known values of a motion in the plane: `sin φ`, `cos φ` and `φ̇` of each segment, and each
/// component along `z`. The angular velocity of the body has no component but that along `z`.
pub fn in_plane(graph: &mut Graph, segments: &[Segment]) -> BTreeMap<NodeId, NodeId> {
    let (zero, one) = (graph.integer(0), graph.integer(1));
    let along_z = graph
        .symbols()
        .iter()
        .filter(|symbol| symbol.name.ends_with("_z"))
        .map(|symbol| symbol.name.clone());
    let names: Vec<String> = along_z
        .filter(|name| *name != angular_velocity_name("z"))
        .collect();
    let symbols = names.iter().filter_map(|name| graph.find_symbol(name));
    let across = ["x", "y"].map(|axis| graph.find_symbol(&angular_velocity_name(axis)));
    let mut values: BTreeMap<NodeId, NodeId> = symbols
        .chain(across.into_iter().flatten())
        .map(|symbol| (symbol, zero))
        .collect();
    for segment in segments {
        values.insert(graph.sin(segment.phi), one);
        values.insert(graph.cos(segment.phi), zero);
        values.insert(segment.phi_rate, zero);
    }
    values
}

/// `_label`, or nothing without a label.
fn ending(label: &str) -> String {
    if label.is_empty() {
        String::new()
    } else {
        format!("_{label}")
    }
}

/// The constants of one segment, as symbols.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Length `h` in m, which all segments of a chain share.
    pub length: NodeId,
    /// Mass `m` in kg.
    pub mass: NodeId,
    /// Transverse moment of inertia about the centre, `J` in kg m².
    pub inertia: NodeId,
}

impl Body {
    /// The symbols of the segment `label` (its number, or nothing) in `graph`.
    pub fn new(graph: &mut Graph, label: &str) -> Self {
        let end = ending(label);
        Self {
            length: graph.symbol("segment_length", "h", Unit::METRE),
            mass: graph.symbol(
                &format!("segment_mass{end}"),
                &format!("m{label}"),
                Unit::KILOGRAM,
            ),
            inertia: graph.symbol(
                &format!("segment_inertia{end}"),
                &format!("J{label}"),
                INERTIA,
            ),
        }
    }
}

/// The constants of one joint, as symbols.
#[derive(Clone, Copy, Debug)]
pub struct Hinge {
    /// Stiffness `c` in N m.
    pub stiffness: NodeId,
    /// Damping `d` in N m s.
    pub damping: NodeId,
    /// Relaxed angle `κ` in rad: the outer side of a relaxed spring is the inner one turned about
    /// `z` by `κ`.
    pub relaxed_angle: NodeId,
}

impl Hinge {
    /// The symbols of the joint at the inner end of the segment `label` (its number, or nothing) in
    /// `graph`.
    pub fn new(graph: &mut Graph, label: &str) -> Self {
        let end = ending(label);
        Self {
            stiffness: graph.symbol(
                &format!("joint_stiffness{end}"),
                &format!("c{label}"),
                STIFFNESS,
            ),
            damping: graph.symbol(
                &format!("joint_damping{end}"),
                &format!("d{label}"),
                DAMPING,
            ),
            relaxed_angle: graph.symbol(
                &format!("relaxed_angle{end}"),
                &format!("κ{label}"),
                Unit::RADIAN,
            ),
        }
    }
}

/// Known properties of a relaxed filament, which save constants in its equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RelaxedShape {
    /// `true` if every relaxed angle is zero.
    pub is_straight: bool,
    /// `true` if the filament is a cylinder: all segments have the same mass and inertia, and all
    /// joints the same stiffness and damping. The joint of the clamp is twice as stiff, because it
    /// bends only half the length (MODEL, "Energies").
    pub is_cylinder: bool,
}

/// The constants of a chain, as symbols. Those that the [`RelaxedShape`] determines are other
/// expressions.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// Constants of each segment, from the clamp outwards.
    pub bodies: Vec<Body>,
    /// Constants of the joint at the inner end of each segment.
    pub hinges: Vec<Hinge>,
    /// Gravitational acceleration in m/s².
    pub gravity: Vec3,
}

impl Parameters {
    /// The constants of a chain of `segments` segments in `graph`.
    pub fn new(graph: &mut Graph, segments: usize, shape: RelaxedShape) -> Self {
        let label = |k: usize| {
            if shape.is_cylinder {
                String::new()
            } else {
                k.to_string()
            }
        };
        Self {
            bodies: (1..=segments)
                .map(|k| Body::new(graph, &label(k)))
                .collect(),
            hinges: (1..=segments)
                .map(|k| {
                    let mut hinge = Hinge::new(graph, &label(k));
                    if shape.is_cylinder && k == 1 {
                        let two = graph.integer(2);
                        [hinge.stiffness, hinge.damping] = [hinge.stiffness, hinge.damping]
                            .map(|constant| graph.mul(two, constant));
                    }
                    hinge.relaxed_angle = match shape {
                        RelaxedShape {
                            is_straight: true, ..
                        } => graph.integer(0),
                        // Each joint of a wavy cylinder has a relaxed angle of its own, too.
                        RelaxedShape {
                            is_cylinder: true, ..
                        } => Hinge::new(graph, &k.to_string()).relaxed_angle,
                        _ => hinge.relaxed_angle,
                    };
                    hinge
                })
                .collect(),
            gravity: gravity(graph),
        }
    }

    /// The scalar constants, by which the terms of the equations are collected.
    pub fn constants(&self) -> Vec<NodeId> {
        let bodies = self
            .bodies
            .iter()
            .flat_map(|body| [body.length, body.mass, body.inertia]);
        bodies
            .chain(
                self.hinges
                    .iter()
                    .flat_map(|hinge| [hinge.stiffness, hinge.damping]),
            )
            .collect()
    }
}

/// The symbols of the gravitational acceleration in `graph`.
pub fn gravity(graph: &mut Graph) -> Vec3 {
    vector_symbol(graph, "gravity", "g", ACCELERATION)
}

/// The prescribed motion of the clamp, as symbols.
#[derive(Clone, Copy, Debug)]
pub struct ClampSymbols {
    /// Position of the root, `r_0` in m.
    pub position: Vec3,
    /// Velocity of the root, `ṙ_0` in m/s.
    pub velocity: Vec3,
    /// Acceleration of the root, `r̈_0` in m/s².
    pub acceleration: Vec3,
    /// Unit vector along which the filament is clamped, `e_0`.
    pub direction: Vec3,
    /// Its rate, `ė_0` in 1/s.
    pub direction_rate: Vec3,
    /// Angular velocity of the brush body, `Ω` in rad/s.
    pub angular_velocity: Vec3,
}

impl ClampSymbols {
    /// The symbols in `graph`.
    pub fn new(graph: &mut Graph) -> Self {
        Self {
            position: vector_symbol(graph, "root_position", "r0", Unit::METRE),
            velocity: vector_symbol(graph, "root_velocity", "ṙ0", VELOCITY),
            acceleration: vector_symbol(graph, "root_acceleration", "r̈0", ACCELERATION),
            direction: vector_symbol(graph, "clamp_direction", "e0", Unit::ONE),
            direction_rate: vector_symbol(
                graph,
                "clamp_direction_rate",
                "ė0",
                Unit::SECOND.powi(-1),
            ),
            angular_velocity: angular_velocity(graph),
        }
    }
}

/// The symbols of the angular velocity of the brush body, `Ω`, in `graph`.
pub fn angular_velocity(graph: &mut Graph) -> Vec3 {
    ["x", "y", "z"].map(|axis| {
        graph.symbol(
            &angular_velocity_name(axis),
            &format!("Ω{axis}"),
            ANGULAR_RATE,
        )
    })
}

/// The name of the component of `Ω` along `axis`.
pub fn angular_velocity_name(axis: &str) -> String {
    format!("angular_velocity_{axis}")
}

/// The minimal coordinates of one segment and their rates, as symbols.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Polar angle `φ` from `+z` in rad.
    pub phi: NodeId,
    /// Azimuth `θ` about `z` in rad.
    pub theta: NodeId,
    /// `φ̇` in rad/s.
    pub phi_rate: NodeId,
    /// `θ̇` in rad/s.
    pub theta_rate: NodeId,
}

impl Segment {
    /// The symbols of the segment `label` (its number, or a name like `next`) in `graph`.
    pub fn new(graph: &mut Graph, label: &str) -> Self {
        let end = ending(label);
        let mut symbol = |name: &str, notation: &str, unit: Unit| {
            graph.symbol(&format!("{name}{end}"), &format!("{notation}{label}"), unit)
        };
        Self {
            phi: symbol("phi", "φ", Unit::RADIAN),
            theta: symbol("theta", "θ", Unit::RADIAN),
            phi_rate: symbol("phi_rate", "φ̇", ANGULAR_RATE),
            theta_rate: symbol("theta_rate", "θ̇", ANGULAR_RATE),
        }
    }

    /// The coordinates `(φ, θ)`.
    pub fn coordinates(&self) -> [NodeId; 2] {
        [self.phi, self.theta]
    }

    /// The rates `(φ̇, θ̇)`.
    pub fn rates(&self) -> [NodeId; 2] {
        [self.phi_rate, self.theta_rate]
    }

    /// The unit vector `e` along the segment.
    pub fn direction(&self, graph: &mut Graph) -> Vec3 {
        let direction = self.direction_at(graph, self.theta);
        name_vector(graph, "direction", (self.theta, "theta"), direction)
    }

    /// `e` turned back about `z` by the relaxed angle of the joint at its inner end. Where the
    /// spring is relaxed, it equals the direction of the inner side.
    pub fn unbent_direction(&self, graph: &mut Graph, hinge: &Hinge) -> Vec3 {
        let azimuth = graph.sub(self.theta, hinge.relaxed_angle);
        let direction = self.direction_at(graph, azimuth);
        name_vector(graph, "unbent_direction", (self.theta, "theta"), direction)
    }

    fn direction_at(&self, graph: &mut Graph, azimuth: NodeId) -> Vec3 {
        let (sin_phi, cos_phi) = (graph.sin(self.phi), graph.cos(self.phi));
        let (sin_theta, cos_theta) = (graph.sin(azimuth), graph.cos(azimuth));
        [
            graph.mul(sin_phi, cos_theta),
            graph.mul(sin_phi, sin_theta),
            cos_phi,
        ]
    }

    /// The rate `ė` of the direction.
    pub fn direction_rate(&self, graph: &mut Graph) -> Vec3 {
        let direction = self.direction(graph);
        let rates = BTreeMap::from([(self.phi, self.phi_rate), (self.theta, self.theta_rate)]);
        let rate = to_vec3(directional_derivative(graph, &direction, &rates));
        name_vector(graph, "direction_rate", (self.theta, "theta"), rate)
    }
}

/// `½ m |ċ|² + ½ J |ė|²` of a segment whose inner end moves at `base_velocity`; its centre moves at
/// `ċ = ẋ + (h/2) ė`.
pub fn kinetic_energy(
    graph: &mut Graph,
    body: &Body,
    base_velocity: Vec3,
    direction_rate: Vec3,
) -> NodeId {
    let velocity = along(graph, base_velocity, body.length, (1, 2), direction_rate);
    let velocity = name_vector(
        graph,
        "centre_velocity",
        (body.mass, "segment_mass"),
        velocity,
    );
    let translation = half_square(graph, body.mass, velocity);
    let rotation = half_square(graph, body.inertia, direction_rate);
    graph.add(translation, rotation)
}

/// `−m g·c` of a segment whose inner end is at `base_position`; its centre is at `c = x + (h/2) e`.
pub fn gravity_energy(
    graph: &mut Graph,
    body: &Body,
    gravity: Vec3,
    base_position: Vec3,
    direction: Vec3,
) -> NodeId {
    let centre = along(graph, base_position, body.length, (1, 2), direction);
    let centre = name_vector(graph, "centre", (body.mass, "segment_mass"), centre);
    let height = graph.dot(&gravity, &centre);
    let energy = graph.mul(body.mass, height);
    graph.neg(energy)
}

/// `½ c α² = c S(u)` of a joint between the directions `previous` and `next`, with
/// `u = ½|e' − e|² = 1 − cos α`. One of the two is turned about `z` by the relaxed angle of the
/// joint ([`Segment::unbent_direction`]), so that `α = 0` where the spring is relaxed.
///
/// The chord form of `u` is never negative and keeps its relative precision at the straight joint,
/// where `S` is analytic (see [`crate::ir::special`]).
pub fn spring_energy(graph: &mut Graph, stiffness: NodeId, previous: Vec3, next: Vec3) -> NodeId {
    let chord = difference(graph, next, previous);
    let one = graph.integer(1);
    let u = half_square(graph, one, chord);
    let end = ending_of(graph, stiffness, "joint_stiffness");
    graph.set_name(u, &format!("u{end}"));
    let half_angle_squared = graph.half_angle_squared(u);
    graph.mul(stiffness, half_angle_squared)
}

/// The rate of a direction `e` that turns rigidly with the body, `Ω × e`.
pub fn rigid_rate(graph: &mut Graph, angular_velocity: Vec3, direction: Vec3) -> Vec3 {
    cross(graph, angular_velocity, direction)
}

/// The rate of a direction `e` as seen from the body, `ė − Ω × e`.
pub fn rate_in_body(
    graph: &mut Graph,
    angular_velocity: Vec3,
    direction: Vec3,
    direction_rate: Vec3,
) -> Vec3 {
    let rigid = rigid_rate(graph, angular_velocity, direction);
    difference(graph, direction_rate, rigid)
}

/// `½ d |ω' − ω|²` of a joint, with the angular velocity `ω = e × (ė − Ω × e)` of each side as seen
/// from the body. A side is its direction and [`rate_in_body`]; the clamp has none, because it is
/// at rest in the body.
///
/// A filament that turns rigidly with the body therefore dissipates nothing, whatever its shape and
/// direction.
pub fn dissipation(
    graph: &mut Graph,
    damping: NodeId,
    previous: Option<(Vec3, Vec3)>,
    next: (Vec3, Vec3),
) -> NodeId {
    let next = cross(graph, next.0, next.1);
    let relative = match previous {
        Some((direction, rate)) => {
            let previous = cross(graph, direction, rate);
            difference(graph, next, previous)
        }
        None => next,
    };
    half_square(graph, damping, relative)
}

/// Position (or velocity) of the outer end of a segment: `x + h e` (or `ẋ + h ė`).
pub fn outer_end(graph: &mut Graph, body: &Body, base: Vec3, direction: Vec3) -> Vec3 {
    along(graph, base, body.length, (1, 1), direction)
}

/// Names the components of `vector` `name_x` and so on; `name_1_x` if it belongs to `symbol`, which
/// is `family_1`.
pub(super) fn name_vector(
    graph: &mut Graph,
    name: &str,
    (symbol, family): (NodeId, &str),
    vector: Vec3,
) -> Vec3 {
    let end = ending_of(graph, symbol, family);
    for (axis, component) in ["x", "y", "z"].into_iter().zip(vector) {
        graph.set_name(component, &format!("{name}{end}_{axis}"));
    }
    vector
}

/// Suffix of the name of `symbol` after `family`; empty if it is no symbol of this family.
fn ending_of(graph: &Graph, symbol: NodeId, family: &str) -> String {
    let name = graph.symbol_name(symbol).unwrap_or_default();
    name.strip_prefix(family).unwrap_or_default().into()
}

/// Three symbols, `name_x` and so on, in `unit`.
pub fn vector_symbol(graph: &mut Graph, name: &str, notation: &str, unit: Unit) -> Vec3 {
    ["x", "y", "z"].map(|axis| {
        graph.symbol(
            &format!("{name}_{axis}"),
            &format!("{notation}{axis}"),
            unit,
        )
    })
}

/// Converts three nodes to a vector.
///
/// # Panics
/// If there are not three.
pub fn to_vec3(nodes: Vec<NodeId>) -> Vec3 {
    nodes.try_into().expect("a vector has three components")
}

/// `base + share × length × direction`
fn along(
    graph: &mut Graph,
    base: Vec3,
    length: NodeId,
    share: (i64, i64),
    direction: Vec3,
) -> Vec3 {
    let share = graph.ratio(share.0, share.1);
    let reach = graph.mul(share, length);
    std::array::from_fn(|i| {
        let offset = graph.mul(reach, direction[i]);
        graph.add(base[i], offset)
    })
}

/// `½ factor |vector|²`
fn half_square(graph: &mut Graph, factor: NodeId, vector: Vec3) -> NodeId {
    let half = graph.ratio(1, 2);
    let square = graph.dot(&vector, &vector);
    let product = graph.mul(factor, square);
    graph.mul(half, product)
}

fn difference(graph: &mut Graph, a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| graph.sub(a[i], b[i]))
}

fn cross(graph: &mut Graph, a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let left = graph.mul(a[j], b[k]);
        let right = graph.mul(a[k], b[j]);
        graph.sub(left, right)
    })
}
