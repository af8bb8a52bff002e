//! Lagrange's equations: from the energies of a chain to `M(q) q̈ = f(q, q̇, t) + Q`.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::unit::Unit;
use crate::model::chain::{self, ClampSymbols, Motion, Parameters, RelaxedShape, Segment, Vec3};
use crate::passes::calculus::{directional_derivative, gradient, jacobian};

/// The terms of a chain of `n` segments, stated in space, from which Lagrange's equations follow.
///
/// User-defined terms are pushed to the lists. They may depend on all symbols of the chain and on
/// user-defined constants.
#[derive(Clone, Debug)]
pub struct ChainTerms {
    /// The graph that holds the expressions.
    pub graph: Graph,
    /// The constants.
    pub parameters: Parameters,
    /// The motion of the clamp.
    pub clamp: ClampSymbols,
    /// The coordinates and rates of each segment.
    pub segments: Vec<Segment>,
    /// The root `r_0` and the outer ends `r_1, …, r_n` in m.
    pub positions: Vec<Vec3>,
    /// Their velocities in m/s.
    pub velocities: Vec<Vec3>,
    /// Kinetic energies in J.
    pub kinetic: Vec<NodeId>,
    /// Energies of springs in J.
    pub spring: Vec<NodeId>,
    /// Energies of weights in J.
    pub gravity: Vec<NodeId>,
    /// Dissipation functions in W. Torques are minus their derivatives by the rates.
    pub dissipation: Vec<NodeId>,
    /// Other potential energies in J, all user-defined.
    pub other: Vec<NodeId>,
    /// Names and descriptions of the user-defined constants.
    constants: Vec<(String, String)>,
}

impl ChainTerms {
    fn new(segments: usize, shape: RelaxedShape) -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let parameters = Parameters::new(g, segments, shape);
        let clamp = ClampSymbols::new(g);
        let segments: Vec<Segment> = (1..=segments)
            .map(|k| Segment::new(g, &k.to_string()))
            .collect();
        let (mut kinetic, mut spring, mut gravity, mut dissipation) =
            (vec![], vec![], vec![], vec![]);
        let (mut position, mut velocity) = (clamp.position, clamp.velocity);
        let (mut positions, mut velocities) = (vec![position], vec![velocity]);
        let (mut previous, mut previous_in_body) = (clamp.direction, None);
        for ((segment, body), hinge) in segments
            .iter()
            .zip(&parameters.bodies)
            .zip(&parameters.hinges)
        {
            let (direction, rate) = (segment.direction(g), segment.direction_rate(g));
            let unbent = segment.unbent_direction(g, hinge);
            kinetic.push(chain::kinetic_energy(g, body, velocity, rate));
            gravity.push(chain::gravity_energy(
                g,
                body,
                parameters.gravity,
                position,
                direction,
            ));
            spring.push(chain::spring_energy(g, hinge.stiffness, previous, unbent));
            let rate_in_body = chain::rate_in_body(g, clamp.angular_velocity, direction, rate);
            let of_segment = (segment.theta, "theta");
            let in_body = (
                direction,
                chain::name_vector(g, "rate_in_body", of_segment, rate_in_body),
            );
            dissipation.push(chain::dissipation(
                g,
                hinge.damping,
                previous_in_body,
                in_body,
            ));
            position = chain::outer_end(g, body, position, direction);
            velocity = chain::outer_end(g, body, velocity, rate);
            chain::name_vector(g, "outer_end", of_segment, position);
            chain::name_vector(g, "outer_end_velocity", of_segment, velocity);
            positions.push(position);
            velocities.push(velocity);
            (previous, previous_in_body) = (direction, Some(in_body));
        }
        Self {
            graph,
            parameters,
            clamp,
            segments,
            positions,
            velocities,
            kinetic,
            spring,
            gravity,
            dissipation,
            other: Vec::new(),
            constants: Vec::new(),
        }
    }

    /// Adds a user-defined constant: the symbol `name`, written `notation`, in `unit`. It becomes
    /// an argument of the functions, after those of the chain.
    ///
    /// A name that ends in `_z` is a component along `z`, which vanishes in the plane.
    pub fn constant(&mut self, name: &str, notation: &str, unit: Unit) -> NodeId {
        let doc = format!("{notation} in {unit}");
        self.constants.push((name.into(), doc));
        self.graph.symbol(name, notation, unit)
    }
}

/// The whole equations of a chain of `n` segments, as expressions.
///
/// `M q̈ = f + Q` is `d/dt(∂L/∂q̇) − ∂L/∂q + ∂D/∂q̇ = Q`, `L = E_kin − E_spring − E_grav − E_other`
/// (Uhlmann and Hoyer 2021, Eq. 1, where `E_other = 0`), with the terms in `q̈` on the left.
/// Coordinates are in the order `φ1, θ1, …, φn, θn`; in the plane of rotation, where every
/// `φ = π/2`, in the order `θ1, …, θn`. Below, `N` is their number.
#[derive(Clone, Debug)]
pub struct WholeEquations {
    /// Motion of the chain.
    pub motion: Motion,
    /// Known properties of its shape.
    pub shape: RelaxedShape,
    /// The graph that holds the expressions.
    pub graph: Graph,
    /// The constants.
    pub parameters: Parameters,
    /// The motion of the clamp.
    pub clamp: ClampSymbols,
    /// The coordinates and rates of each segment.
    pub segments: Vec<Segment>,
    /// `M`, N × N, in kg m² (rows and columns are angles).
    pub mass_matrix: Vec<Vec<NodeId>>,
    /// `f`, N elements in N m: all but the terms in `q̈` and the contact.
    pub force: Vec<NodeId>,
    /// `E_kin` in J.
    pub kinetic_energy: NodeId,
    /// `E_spring` in J.
    pub spring_energy: NodeId,
    /// `E_grav` in J.
    pub gravity_energy: NodeId,
    /// `D` in W.
    pub dissipation: NodeId,
    /// `E_other` in J: zero, or the user-defined potential energies.
    pub other_energy: NodeId,
    /// The tip `r_n` in m.
    pub tip: Vec3,
    /// Names and descriptions of the user-defined constants.
    pub(super) constants: Vec<(String, String)>,
}

/// Derives the whole equations of `motion` for `segments` segments of any shape.
///
/// The expressions share their subexpressions: `M` takes O(n²) nodes and `f` takes O(n).
///
/// # Panics
/// If `segments` is zero.
pub fn whole_equations(segments: usize, motion: Motion) -> WholeEquations {
    whole_equations_of(segments, motion, RelaxedShape::default())
}

/// Derives the whole equations of one shape.
///
/// # Panics
/// If `segments` is zero.
pub fn whole_equations_of(segments: usize, motion: Motion, shape: RelaxedShape) -> WholeEquations {
    whole_equations_with(segments, motion, shape, |_| ())
}

/// Derives the whole equations with user-defined terms, which `state` adds to those of the chain.
///
/// Terms are stated in space; those of a planar chain are specialised like all others.
///
/// # Panics
/// If `segments` is zero.
pub fn whole_equations_with(
    segments: usize,
    motion: Motion,
    shape: RelaxedShape,
    state: impl FnOnce(&mut ChainTerms),
) -> WholeEquations {
    assert!(segments > 0, "a chain has at least one segment");
    let mut terms = ChainTerms::new(segments, shape);
    state(&mut terms);
    let ChainTerms {
        mut graph,
        parameters,
        clamp,
        segments,
        positions,
        constants,
        ..
    } = terms;
    let g = &mut graph;
    let lists = [
        terms.kinetic,
        terms.spring,
        terms.gravity,
        terms.dissipation,
        terms.other,
    ];
    let [kinetic, spring, gravity, dissipation, other] = lists.map(|terms| g.sum(terms));
    let [x, y, z] = positions[segments.len()];
    let [
        kinetic_energy,
        spring_energy,
        gravity_energy,
        dissipation,
        other_energy,
        x,
        y,
        z,
    ] = motion.specialise(
        g,
        &segments,
        [kinetic, spring, gravity, dissipation, other, x, y, z],
    );

    let [coordinates, rates] = motion.variables(&segments);
    let momenta = gradient(g, kinetic_energy, &rates);
    let mass_matrix = jacobian(g, &momenta, &rates);
    let momentum_rates =
        directional_derivative(g, &momenta, &free_motion(&coordinates, &rates, &clamp));
    let kinetic_gradient = gradient(g, kinetic_energy, &coordinates);
    let potential = g.sum([spring_energy, gravity_energy, other_energy]);
    let potential_gradient = gradient(g, potential, &coordinates);
    let damping_torques = gradient(g, dissipation, &rates);
    let force = (0..coordinates.len()).map(|i| {
        let inertial = g.sub(kinetic_gradient[i], momentum_rates[i]);
        let elastic = g.sub(inertial, potential_gradient[i]);
        g.sub(elastic, damping_torques[i])
    });
    let force = force.collect();
    WholeEquations {
        motion,
        shape,
        graph,
        parameters,
        clamp,
        segments,
        mass_matrix,
        force,
        kinetic_energy,
        spring_energy,
        gravity_energy,
        dissipation,
        other_energy,
        tip: [x, y, z],
        constants,
    }
}

/// The rates of all that varies for `q̈ = 0`: the rest of `d/dt` depends on `q`, `q̇` and the
/// motion of the clamp.
fn free_motion(
    coordinates: &[NodeId],
    rates: &[NodeId],
    clamp: &ClampSymbols,
) -> BTreeMap<NodeId, NodeId> {
    let mut motion: BTreeMap<NodeId, NodeId> = coordinates
        .iter()
        .copied()
        .zip(rates.iter().copied())
        .collect();
    motion.extend(clamp.velocity.into_iter().zip(clamp.acceleration));
    motion
}

/// The momenta and the parts of `f`, each in the order of the coordinates.
#[derive(Clone, Debug)]
pub struct Parts {
    /// `∂E_kin/∂q̇`
    pub momenta: Vec<NodeId>,
    /// `∂E_kin/∂q − d/dt(∂E_kin/∂q̇)` for `q̈ = 0`
    pub inertial: Vec<NodeId>,
    /// `−∂E_spring/∂q`
    pub spring: Vec<NodeId>,
    /// `−∂E_grav/∂q`
    pub gravity: Vec<NodeId>,
    /// `−∂D/∂q̇`
    pub damping: Vec<NodeId>,
    /// `−∂E_other/∂q`
    pub other: Vec<NodeId>,
}

impl WholeEquations {
    /// The coordinates, and their rates, in the order of the rows of `M`.
    pub fn variables(&self) -> [Vec<NodeId>; 2] {
        self.motion.variables(&self.segments)
    }

    /// Derives the momenta and the parts whose sum is [`WholeEquations::force`].
    pub fn parts(&mut self) -> Parts {
        let [coordinates, rates] = self.variables();
        let motion = free_motion(&coordinates, &rates, &self.clamp);
        let g = &mut self.graph;
        let momenta = gradient(g, self.kinetic_energy, &rates);
        let momentum_rates = directional_derivative(g, &momenta, &motion);
        let kinetic_gradient = gradient(g, self.kinetic_energy, &coordinates);
        let inertial = kinetic_gradient
            .into_iter()
            .zip(momentum_rates)
            .map(|(a, b)| g.sub(a, b))
            .collect();
        let mut negative_gradient = |energy, variables: &[NodeId]| -> Vec<NodeId> {
            let gradient = gradient(g, energy, variables);
            gradient.into_iter().map(|slope| g.neg(slope)).collect()
        };
        let spring = negative_gradient(self.spring_energy, &coordinates);
        let gravity = negative_gradient(self.gravity_energy, &coordinates);
        let damping = negative_gradient(self.dissipation, &rates);
        let other = negative_gradient(self.other_energy, &coordinates);
        Parts {
            momenta,
            inertial,
            spring,
            gravity,
            damping,
            other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares a cylinder with any filament at the same constants, with twice those of a joint at
    /// the clamp.
    #[test]
    fn shapes_have_the_equations_of_any_filament_at_their_constants() {
        // The sums have some tens of terms of order one.
        const TOLERANCE: f64 = 1e-12;
        let cylinder = RelaxedShape {
            is_straight: false,
            is_cylinder: true,
        };
        for (shape, motion) in [
            (cylinder, Motion::Spatial),
            (
                RelaxedShape {
                    is_straight: true,
                    ..cylinder
                },
                Motion::Planar,
            ),
        ] {
            let at = |whole: &WholeEquations| {
                let value = |name: &str| match name.trim_end_matches(['_', '1', '2', '3']) {
                    "segment_mass" => 0.7,
                    "segment_inertia" => 0.3,
                    "joint_stiffness" | "joint_damping" if name.ends_with('1') => 2.2,
                    "joint_stiffness" | "joint_damping" => 1.1,
                    "relaxed_angle" if shape.is_straight => 0.0,
                    _ => 0.3 + 0.1 * name.bytes().map(f64::from).sum::<f64>().sin(),
                };
                let point: Vec<f64> = whole
                    .graph
                    .symbols()
                    .iter()
                    .map(|symbol| value(&symbol.name))
                    .collect();
                let values = whole.graph.evaluate(&point);
                let outputs = whole.mass_matrix.iter().flatten().chain(&whole.force);
                let energies = [
                    whole.kinetic_energy,
                    whole.spring_energy,
                    whole.gravity_energy,
                    whole.dissipation,
                ];
                outputs
                    .copied()
                    .chain(energies)
                    .map(|node| values[node.index()])
                    .collect::<Vec<_>>()
            };
            let (any, shaped) = (
                at(&whole_equations(3, motion)),
                at(&whole_equations_of(3, motion, shape)),
            );
            for (i, (any, shaped)) in any.iter().zip(&shaped).enumerate() {
                assert!(
                    (any - shaped).abs() < TOLERANCE,
                    "{motion:?}, {i}: {any} {shaped}"
                );
            }
        }
    }

    #[test]
    fn the_parts_sum_to_the_force() {
        // The sums have some tens of terms of order one.
        const TOLERANCE: f64 = 1e-12;
        for motion in [Motion::Spatial, Motion::Planar] {
            let mut whole = whole_equations_with(3, motion, RelaxedShape::default(), |chain| {
                let weight = chain.constant("tip_weight", "W", Unit::NEWTON);
                let energy = chain.graph.mul(weight, chain.positions[3][1]);
                chain.other.push(energy);
            });
            let parts = whole.parts();
            let point: Vec<f64> = (0..whole.graph.symbols().len())
                .map(|i| 0.3 + 0.1 * (i as f64).sin())
                .collect();
            let values = whole.graph.evaluate(&point);
            let at = |node: NodeId| values[node.index()];
            for (i, &force) in whole.force.iter().enumerate() {
                let parts = [
                    &parts.inertial,
                    &parts.spring,
                    &parts.gravity,
                    &parts.damping,
                    &parts.other,
                ];
                let sum: f64 = parts.map(|part| at(part[i])).iter().sum();
                assert!(
                    (sum - at(force)).abs() < TOLERANCE,
                    "{motion:?}, {i}: {sum} {}",
                    at(force)
                );
            }
        }
    }
}
