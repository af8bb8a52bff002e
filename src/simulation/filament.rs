//! A filament with its clamp, contact law and workpiece, and its contacts.

use std::ops::AddAssign;

use crate::contact::edge::{EdgeContact, NodeMotions, Station};
use crate::contact::{Approach, ContactLaw, node_stiffness_share};
use crate::equations::Chain;
use crate::equations::linear::{add, dot};
use crate::integrate::StageSolution;
use crate::tool::ClampMotion;
use crate::workpiece::{Edge, Workpiece};

/// Contact of a filament with the workpiece at one place: of a node with a face, or of the
/// centreline with an edge.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// Place on the filament. A node is the outer end of its segment, or the root.
    pub station: Station,
    /// Position in m.
    pub position: [f64; 3],
    /// Filament at that place, relative to the workpiece.
    pub approach: Approach,
    /// Angle from the bisector of an edge in rad ([`Edge::angle`]); `None` on a face.
    pub on_edge: Option<f64>,
}

/// Forces and powers of a contact on a filament, or of several together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactSum {
    /// `F_n` in N.
    pub normal: f64,
    /// Part of `F_n` on edges in N.
    pub on_edges: f64,
    /// Whole force in N.
    pub force: [f64; 3],
    /// Moment of the force about the tool axis in N m.
    pub moment: f64,
    /// Power taken by friction in W.
    pub friction_power: f64,
    /// Power taken by contact damping in W.
    pub damped_power: f64,
    /// `F_n |v_t|` in W.
    pub sliding_power: f64,
    /// Part of it on edges in W, and its first and second moment about their bisectors in W rad and
    /// W rad².
    pub edge_power: [f64; 3],
}

impl AddAssign for ContactSum {
    fn add_assign(&mut self, other: Self) {
        self.normal += other.normal;
        self.on_edges += other.on_edges;
        self.force = add(self.force, other.force);
        self.moment += other.moment;
        self.friction_power += other.friction_power;
        self.damped_power += other.damped_power;
        self.sliding_power += other.sliding_power;
        self.edge_power = add(self.edge_power, other.edge_power);
    }
}

/// Filament: its constants, the motion of its clamp, its contact law, and the workpiece.
#[derive(Clone, Debug)]
pub struct Filament<M, W> {
    /// Constants.
    pub chain: Chain<f64>,
    /// Motion of its clamp.
    pub motion: M,
    /// Contact law.
    pub law: ContactLaw,
    /// Workpiece.
    pub workpiece: W,
}

impl<M: ClampMotion, W: Workpiece> Filament<M, W> {
    /// Returns the outer end of `segment` (from 0) at `position` with `velocity`, relative to the
    /// workpiece at `time`.
    #[inline]
    pub fn approach(
        &self,
        segment: usize,
        position: [f64; 3],
        velocity: [f64; 3],
        time: f64,
    ) -> Approach {
        Approach {
            stiffness_share: node_stiffness_share(segment + 1, self.chain.segments()),
            ..self.law.approach(&self.workpiece, position, velocity, time)
        }
    }

    /// Returns the number of possible contacts: one for each node, and one for each edge of the
    /// workpiece.
    pub fn contacts(&self) -> usize {
        self.chain.segments() + self.workpiece.edges().len()
    }

    /// Returns a possible contact, by index: nodes first, then edges. `nodes` are the filament's
    /// nodes at `time`. The search for the place of a contact with an edge begins at the segment
    /// `start`, or goes over all segments.
    #[inline]
    pub fn touch(
        &self,
        contact: usize,
        nodes: &NodeMotions<'_>,
        start: Option<usize>,
        time: f64,
    ) -> Touch {
        if let Some(edge) = contact.checked_sub(self.chain.segments()) {
            return self.edge_touch(&self.workpiece.edges()[edge], nodes, start, time);
        }
        let [position, velocity] = nodes(contact + 1);
        let station = Station {
            segment: contact,
            fraction: 1.0,
        };
        Touch {
            station,
            position,
            approach: self.approach(contact, position, velocity, time),
            on_edge: None,
        }
    }

    #[inline(never)]
    fn edge_touch(
        &self,
        edge: &Edge,
        nodes: &NodeMotions<'_>,
        start: Option<usize>,
        time: f64,
    ) -> Touch {
        let EdgeContact {
            station,
            position,
            approach,
        } = self.edge_contact(edge, nodes, start, time);
        Touch {
            station,
            position,
            approach,
            on_edge: Some(edge.angle(position, time)),
        }
    }

    /// Returns forces and powers of a contact by the smooth law, even where it pulls: stages of a
    /// step that ends on an opening can lie past it.
    pub fn sum(
        &self,
        Touch {
            position: [x, y, _],
            approach,
            on_edge,
            ..
        }: &Touch,
    ) -> ContactSum {
        let force = self.law.force(approach);
        let total = force.total(approach);
        let sliding_power = force.normal * dot(approach.sliding, approach.sliding).sqrt();
        ContactSum {
            normal: force.normal,
            on_edges: if on_edge.is_some() { force.normal } else { 0.0 },
            force: total,
            moment: x * total[1] - y * total[0],
            friction_power: -dot(force.tangential, approach.sliding),
            damped_power: self.law.damped_power(approach),
            sliding_power,
            edge_power: on_edge.map_or([0.0; 3], |angle| {
                [1.0, angle, angle * angle].map(|moment| sliding_power * moment)
            }),
        }
    }

    /// Calls `take` with each contact that presses, by index. Returns the largest
    /// [`ContactLaw::pressing`] of all contacts, and their smallest distance from the workpiece in
    /// m, negative for a penetration.
    pub fn for_each_pressing(
        &self,
        nodes: impl Fn(usize) -> [[f64; 3]; 2],
        time: f64,
        mut take: impl FnMut(usize, &Touch),
    ) -> [f64; 2] {
        let (mut largest, mut nearest) = (f64::NEG_INFINITY, f64::INFINITY);
        for contact in 0..self.contacts() {
            if contact < self.chain.segments() {
                // Most nodes are far away.
                let [position, velocity] = nodes(contact + 1);
                let [pressing, distance] =
                    self.law
                        .node_pressing(&self.workpiece, position, velocity, time);
                (largest, nearest) = (largest.max(pressing), nearest.min(distance));
                if pressing <= 0.0 {
                    continue;
                }
            }
            let touch = self.touch(contact, &nodes, None, time);
            let pressing = self.law.pressing(&touch.approach);
            (largest, nearest) = (
                largest.max(pressing),
                nearest.min(touch.approach.distance()),
            );
            if pressing <= 0.0 {
                continue;
            }
            take(contact, &touch);
        }
        [largest, nearest]
    }

    pub(super) fn edge_contact(
        &self,
        edge: &Edge,
        nodes: &NodeMotions<'_>,
        start: Option<usize>,
        time: f64,
    ) -> EdgeContact {
        let station = Station::nearest_to(edge, start, self.chain.segments(), nodes, time);
        EdgeContact::new(&self.law, edge, station, nodes, time)
    }

    /// Returns the method for the stages of its steps.
    ///
    /// A single correction leaves a little energy in each stage. Any damping of the filament
    /// removes that energy. Without dampers it accumulates: over twenty swings of a chain, to sixty
    /// times the error of converged stages. With friction a single correction suffices only if it
    /// is small. With friction and contact damping, the force is so steep where nodes come off that
    /// only converged stages keep the energy balance.
    pub fn stage_solution(&self) -> StageSolution {
        let damped = self.chain.links.iter().any(|link| link.damping > 0.0);
        match (damped, self.law.friction > 0.0) {
            (false, _) => StageSolution::Converged,
            (true, true) if self.law.damping > 0.0 => StageSolution::Converged,
            (true, true) => StageSolution::Cautious,
            (true, false) => StageSolution::Predicted,
        }
    }

    /// Returns the largest distance past its event at which a node may end a step, in m: `1e-4 ×
    /// relative tolerance × l_f`, or less if the contact is so stiff that this depth would cause a
    /// force above `relative tolerance × E I/l_f²`.
    pub fn event_tolerance(&self, relative: f64, time: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let force = chain.bending_stiffness() / (length * length);
        let by_force = (relative * force / self.law.stiffness).powf(1.0 / self.law.exponent);
        let [x, y, z] = self.motion.at(time).position;
        let rounding = 4.0 * f64::EPSILON * (length + x.hypot(y).hypot(z));
        (1e-4 * relative * length).min(by_force).max(rounding)
    }

    /// Returns that distance in m for a pass whose work is limited: `1e-2 × relative tolerance ×
    /// l_f`, or less if the contact would store more energy there than `1e-2 × relative tolerance ×
    /// E I/l_f`. Switching gains or loses that energy.
    pub fn coarse_event_tolerance(&self, relative: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let share = 1e-2 * relative;
        // A penetration δ stores k δ^(p+1)/(p+1).
        let energy = share * chain.bending_stiffness() / length;
        let power = self.law.exponent + 1.0;
        (share * length).min((power * energy / self.law.stiffness).powf(1.0 / power))
    }

    /// Returns the largest force in N with which a contact may begin or end if its events are
    /// located to `location` (m). It is ten times the force at this depth, or a thousandth of `E
    /// I/l_f²`, on which no result depends.
    pub fn largest_jump(&self, location: f64) -> f64 {
        let chain = &self.chain;
        let length = chain.length * chain.segments() as f64;
        let force = self.law.stiffness * location.powf(self.law.exponent);
        (10.0 * force).max(1e-3 * chain.bending_stiffness() / (length * length))
    }
}
