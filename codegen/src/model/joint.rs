//! A joint between two segments, or between the clamp and the first one, and its tangent.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, NodeId};
use crate::ir::kernel::{Kernel, KernelInput, Output};
use crate::ir::unit::Unit;
use crate::model::arguments::weights;
use crate::model::chain::{self, Hinge, Motion, Segment, Vec3, vector_symbol};
use crate::model::elements::{Derivation, TORQUE, step_weights, transpose};
use crate::passes::calculus::{directional_derivative, gradient};
use crate::passes::normal_form::Style;

/// Unit of the derivative of a torque with respect to an angular acceleration.
const TORQUE_SLOPE: Unit = TORQUE.times(Unit::SECOND.powi(2));

/// A joint between two directions, and the segments whose coordinates it acts on.
///
/// The rates of these segments are those in the body, `q̇ − q̇_r`, with the rates `q̇_r` of a
/// segment that turns rigidly with it ([`RigidRates`](crate::model::elements::RigidRates)). They give the rate of a direction in the
/// body. Since `q̇_r` does not depend on `q̇`, `∂D/∂q̇` is the derivative with respect to them.
/// Neither `Ω` nor, between segments, an azimuth itself enters a joint.
pub(super) struct Joint {
    pub graph: Graph,
    pub motion: Motion,
    pub segments: Vec<Segment>,
    pub clamp: RelaxedClamp,
    pub spring_energy: NodeId,
    pub dissipation: NodeId,
}

/// The direction of the clamp turned about `z` by the relaxed angle of the clamp joint, as symbols.
#[derive(Clone, Copy)]
pub(super) struct RelaxedClamp {
    /// `ē0`, the direction of the first segment where its spring is relaxed.
    pub direction: Vec3,
    /// Its rate.
    pub direction_rate: Vec3,
}

impl RelaxedClamp {
    fn new(graph: &mut Graph) -> Self {
        let per_second = Unit::SECOND.powi(-1);
        Self {
            direction: vector_symbol(graph, "relaxed_direction", "ē0", Unit::ONE),
            direction_rate: vector_symbol(graph, "relaxed_direction_rate", "ē̇0", per_second),
        }
    }
}

/// One side of a joint: the direction at the spring, and the motion of the damper, which the clamp
/// does not have.
struct Neighbour {
    to_spring: Vec3,
    /// Direction and its rate in the body.
    to_damper: Option<(Vec3, Vec3)>,
}

impl Joint {
    pub fn between_segments(motion: Motion) -> Self {
        Self::new(motion, &["previous", "next"], |graph, hinge, segments| {
            let [previous, next] =
                [segments[0], segments[1]].map(|segment| Neighbour::of(graph, segment));
            let turned = segments[1].unbent_direction(graph, hinge);
            [
                previous,
                Neighbour {
                    to_spring: turned,
                    ..next
                },
            ]
        })
    }

    /// The joint between the clamp and the first segment. The inner side is turned to the spring,
    /// whatever the polar axis of the segment is.
    pub fn at_clamp(motion: Motion) -> Self {
        Self::new(motion, &["next"], |graph, _, segments| {
            let clamp = RelaxedClamp::new(graph);
            [
                Neighbour {
                    to_spring: clamp.direction,
                    to_damper: None,
                },
                Neighbour::of(graph, segments[0]),
            ]
        })
    }

    /// Creates the joint between the `sides` that belong to the segments with these labels.
    fn new(
        motion: Motion,
        labels: &[&str],
        sides: impl FnOnce(&mut Graph, &Hinge, &[Segment]) -> [Neighbour; 2],
    ) -> Self {
        let mut graph = Graph::new();
        let g = &mut graph;
        let hinge = Hinge::new(g, "");
        let clamp = RelaxedClamp::new(g);
        let segments: Vec<Segment> = labels.iter().map(|label| Segment::new(g, label)).collect();
        let [inner, outer] = sides(g, &hinge, &segments);
        let spring_energy =
            chain::spring_energy(g, hinge.stiffness, inner.to_spring, outer.to_spring);
        let outer_in_body = outer
            .to_damper
            .expect("only the clamp is at rest in the body");
        let dissipation = chain::dissipation(g, hinge.damping, inner.to_damper, outer_in_body);
        let [spring_energy, dissipation] =
            motion.specialise(g, &segments, [spring_energy, dissipation]);
        Self {
            graph,
            motion,
            segments,
            clamp,
            spring_energy,
            dissipation,
        }
    }

    /// The coordinates of all segments, and their rates.
    pub fn variables(&self) -> [Vec<NodeId>; 2] {
        self.motion.variables(&self.segments)
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

    /// Minus the derivative of the torques along a step.
    pub fn tangent(mut self) -> Tangent {
        let torques = self.torques();
        let [coordinates, rates] = self.variables();
        tangent(self.graph, &torques, &coordinates, &rates)
    }
}

/// A graph with the tangent of a joint: rows are torques, columns coordinates.
pub(super) type Tangent = (Graph, Vec<Vec<NodeId>>);

/// Returns minus the derivative of `torques` for `δq = w_q δq̈` and `δq̇ = w_v δq̈`.
pub(super) fn tangent(
    mut graph: Graph,
    torques: &[NodeId],
    coordinates: &[NodeId],
    rates: &[NodeId],
) -> Tangent {
    let resistance: Vec<NodeId> = torques.iter().map(|&torque| graph.neg(torque)).collect();
    let (coordinate_weight, rate_weight) = step_weights(&mut graph);
    let columns: Vec<Vec<NodeId>> = coordinates
        .iter()
        .zip(rates)
        .map(|(&coordinate, &rate)| {
            let direction = BTreeMap::from([(coordinate, coordinate_weight), (rate, rate_weight)]);
            directional_derivative(&mut graph, &resistance, &direction)
        })
        .collect();
    (graph, transpose(&columns))
}

impl Neighbour {
    /// The side of `segment` without a turn. Its rates are those in the body.
    fn of(graph: &mut Graph, segment: Segment) -> Self {
        let direction = segment.direction(graph);
        Self {
            to_spring: direction,
            to_damper: Some((direction, segment.direction_rate(graph))),
        }
    }
}

/// The blocks of the tangent of a joint, row by row, with their names and their segments. The
/// weights of the step come after `inputs`.
pub(super) fn tangent_kernel(
    motion: Motion,
    name: &str,
    summary: &str,
    (graph, rows): Tangent,
    blocks: &[(&str, &str)],
    inputs: impl FnOnce(&mut Graph) -> Vec<KernelInput>,
) -> Result<Kernel, String> {
    let sides = blocks.len().isqrt();
    let size = rows.len() / sides;
    let torques = if size == 1 { "torque" } else { "torques" };
    let block = |(i, (name, where_to)): (usize, &(&str, &str))| {
        let (row, column) = (size * (i / sides), size * (i % sides));
        let block = rows[row..row + size]
            .iter()
            .map(|row| row[column..column + size].to_vec())
            .collect();
        Output::matrix(
            name,
            &format!("{torques} on {where_to}"),
            TORQUE_SLOPE,
            block,
        )
    };
    let outputs = blocks.iter().enumerate().map(block).collect();
    let inputs = |graph: &mut Graph| [inputs(graph), weights(graph)].concat();
    Derivation { graph, outputs }.kernel_for(motion, name, summary, Some(Style::Cheap), inputs)
}

/// The blocks of the tangent of a joint between two segments.
pub(super) const BLOCKS: [(&str, &str); 4] = [
    ("previous_previous", "the previous segment along its `q̈`"),
    (
        "previous_next",
        "the previous segment along the next one's `q̈`",
    ),
    (
        "next_previous",
        "the next segment along the previous one's `q̈`",
    ),
    ("next_next", "the next segment along its `q̈`"),
];
