//! Loads of closed contacts on the nodes and segments of filaments, one per lane.

use super::filament::Filament;
use crate::contact::Approach;
use crate::contact::ContactLaw;
use crate::contact::edge::EdgeContact;
use crate::equations::linear::{in_lane, zero};
use crate::equations::{
    LANES, LaneSet, Lanewise, NodeLoads, NodeMotion, NodeTangent, PointDamping, PointLoad,
    PointTangent,
};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Loads of closed contacts, at one instant per lane.
#[derive(Clone, Copy, Debug)]
pub struct ContactLoads<'a, M, W, T> {
    filaments: &'a [Filament<M, W>],
    /// Lanes in which each node is closed.
    closed: &'a [LaneSet],
    /// Lanes in which the contact with each edge is closed.
    on_edges: &'a [LaneSet],
    /// Segments of [`FilamentSystem::set_start`](super::FilamentSystem::set_start).
    starts: &'a [Vec<usize>],
    /// `true` if nothing is closed in any lane.
    empty: bool,
    /// `true` if there is friction in any lane.
    frictional: bool,
    time: T,
}

impl<'a, M: ClampMotion, W: Workpiece, T: Lanewise> ContactLoads<'a, M, W, T> {
    pub(super) fn new(
        filaments: &'a [Filament<M, W>],
        closed: &'a [LaneSet],
        starts: &'a [Vec<usize>],
        time: T,
    ) -> Self {
        let frictional = filaments
            .iter()
            .any(|filament| filament.law.friction != 0.0);
        let empty = closed.iter().all(|lanes| lanes.is_empty());
        let (closed, on_edges) = closed.split_at(filaments[0].chain.segments());
        Self {
            filaments,
            closed,
            on_edges,
            starts,
            empty,
            frictional,
            time,
        }
    }

    /// Calls `take` with each segment that touches an edge, and its closed contacts with that edge
    /// by lane.
    fn for_each_segment(
        &self,
        nodes: &dyn NodeMotion,
        mut take: impl FnMut(usize, &Edges<'_, M, W>),
    ) {
        for (edge, lanes) in self.on_edges.iter().enumerate() {
            let mut group = Edges {
                edge,
                contacts: [const { None }; LANES],
            };
            for lane in lanes.iter() {
                let (filament, time) = (&self.filaments[lane], self.time.lane(lane));
                let (edge, start) = (&filament.workpiece.edges()[edge], self.starts[edge][lane]);
                let contact = filament.edge_contact(
                    edge,
                    &|index| nodes.node(index, lane),
                    Some(start),
                    time,
                );
                group.contacts[lane] = Some((filament, contact));
            }
            while let Some(segment) = group
                .contacts
                .iter()
                .flatten()
                .map(|(_, contact)| contact.station.segment)
                .next()
            {
                let rest = group.leave(segment);
                take(segment, &group);
                group = rest;
            }
        }
    }

    /// Applies `set` to `none` for each lane in which a node is closed. Returns `None` if it is
    /// closed in no lane.
    #[inline(always)]
    fn of_node<R>(
        &self,
        node: usize,
        [position, velocity]: [[T; 3]; 2],
        none: R,
        set: impl Fn(&mut R, usize, &ContactLaw, &Approach),
    ) -> Option<R> {
        if self.closed[node].is_empty() {
            return None;
        }
        let mut result = none;
        for lane in self.closed[node].iter() {
            let (filament, position, velocity) = (
                &self.filaments[lane],
                in_lane(&position, lane),
                in_lane(&velocity, lane),
            );
            set(
                &mut result,
                lane,
                &filament.law,
                &filament.approach(node, position, velocity, self.time.lane(lane)),
            );
        }
        Some(result)
    }
}

/// Closed contacts with one edge by lane, on one segment or on several.
struct Edges<'a, M, W> {
    edge: usize,
    contacts: [Option<(&'a Filament<M, W>, EdgeContact)>; LANES],
}

impl<M, W> Edges<'_, M, W> {
    /// Keeps the contacts on `segment`, and returns the others.
    fn leave(&mut self, segment: usize) -> Self {
        let mut rest = Self {
            edge: self.edge,
            contacts: [const { None }; LANES],
        };
        for (here, there) in self.contacts.iter_mut().zip(&mut rest.contacts) {
            if here
                .as_ref()
                .is_some_and(|(_, contact)| contact.station.segment != segment)
            {
                std::mem::swap(here, there);
            }
        }
        rest
    }

    fn iter(&self) -> impl Iterator<Item = (usize, &Filament<M, W>, &EdgeContact)> {
        let lanes = self.contacts.iter().enumerate();
        lanes.filter_map(|(lane, contact)| {
            contact
                .as_ref()
                .map(|(filament, contact)| (lane, *filament, contact))
        })
    }
}

impl<M: ClampMotion, W: Workpiece, T: Lanewise> NodeLoads<T> for ContactLoads<'_, M, W, T> {
    fn is_empty(&self) -> bool {
        self.empty
    }

    fn loads_points(&self) -> bool {
        self.on_edges.iter().any(|lanes| !lanes.is_empty())
    }

    fn point_loads(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointLoad<T>)) {
        self.for_each_segment(nodes, |segment, group| {
            let mut load = PointLoad {
                segment,
                fraction: T::ZERO,
                force: zero(),
            };
            for (
                lane,
                filament,
                EdgeContact {
                    station, approach, ..
                },
            ) in group.iter()
            {
                load.fraction.set_lane(lane, station.fraction);
                set_vector(
                    &mut load.force,
                    lane,
                    filament.law.force(approach).total(approach),
                );
            }
            add(load);
        });
    }

    fn point_tangents(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<T>)) {
        self.for_each_segment(nodes, |segment, group| {
            let none = NodeTangent {
                position: [zero(); 3],
                velocity: [zero(); 3],
            };
            let mut tangent = PointTangent {
                segment,
                ends: [[none; 2]; 2],
            };
            for (lane, filament, contact) in group.iter() {
                let edge = &filament.workpiece.edges()[group.edge];
                let change = contact.tangent(&filament.law, edge, &|index| nodes.node(index, lane));
                for (ends, change) in tangent.ends.iter_mut().zip(&change) {
                    for (end, change) in ends.iter_mut().zip(change) {
                        set_tangent(end, lane, change);
                    }
                }
            }
            add(tangent);
        });
    }

    fn point_dampings(&self, nodes: &dyn NodeMotion, add: &mut dyn FnMut(PointDamping<T>)) {
        self.for_each_segment(nodes, |segment, group| {
            let none = T::ZERO;
            let mut load = PointDamping {
                segment,
                fraction: none,
                damping: none,
            };
            for (
                lane,
                filament,
                EdgeContact {
                    station, approach, ..
                },
            ) in group.iter()
            {
                load.fraction.set_lane(lane, station.fraction);
                load.damping
                    .set_lane(lane, filament.law.lateral_damping(approach));
            }
            add(load);
        });
    }

    fn lanes(&self) -> Option<&[LaneSet]> {
        Some(self.closed)
    }

    fn resists_lateral_motion(&self) -> bool {
        self.frictional
    }

    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]> {
        self.of_node(
            node,
            [position, velocity],
            zero(),
            |force, lane, law, approach| {
                set_vector(force, lane, law.force(approach).total(approach));
            },
        )
    }

    fn lateral_damping(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<T> {
        if !self.frictional {
            return None;
        }
        self.of_node(
            node,
            [position, velocity],
            T::ZERO,
            |damping, lane, law, approach| {
                damping.set_lane(lane, law.lateral_damping(approach));
            },
        )
    }

    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>> {
        let none = NodeTangent {
            position: [zero(); 3],
            velocity: [zero(); 3],
        };
        self.of_node(
            node,
            [position, velocity],
            none,
            |tangent, lane, law, approach| {
                set_tangent(tangent, lane, &law.tangent(approach));
            },
        )
    }
}

fn set_vector<T: Lanewise>(vector: &mut [T; 3], lane: usize, values: [f64; 3]) {
    for (component, value) in vector.iter_mut().zip(values) {
        component.set_lane(lane, value);
    }
}

fn set_tangent<T: Lanewise>(tangent: &mut NodeTangent<T>, lane: usize, values: &NodeTangent<f64>) {
    for row in 0..3 {
        set_vector(&mut tangent.position[row], lane, values.position[row]);
        set_vector(&mut tangent.velocity[row], lane, values.velocity[row]);
    }
}
