//! Filaments side by side in the lanes of one set of equations, and their contacts.

mod budget;
mod clearance;
mod load;

use super::candidates::Candidates;
use super::field::{Changes, FilamentPoint, GroupField, NodeIndex, Nodes, wide};
use super::gmres;
use super::pressing::Pressing;
use crate::equations::linear::{add, dot, scale, sub, zero};
use crate::equations::{
    Chain, ChainDynamics, Clamp, LANES, LaneSet, Lanes, Lanewise, NodeLoads, NodeMotion,
    NodeTangent, PointTangent, Real, StepWeights,
};
use crate::simulation::{ContactSum, Filament, FilamentEquations, Form};
use crate::tool::ClampMotion;
use crate::workpiece::{Part, Workpiece};
pub use budget::{Budget, Exchange};
use clearance::Clearance;
pub use load::{WorkedEdge, WorkpieceLoad};

/// A filament that becomes part of a bundle.
pub struct BundleMember<M> {
    /// Filament.
    pub filament: Filament<M, Part>,
    /// Times in s between which its contact counts. Before the first one it does not meet the
    /// workpiece: around a ring, the last filaments begin where the first ones pass. From the
    /// second one on it may be left out.
    pub contacts: [f64; 2],
    /// Coordinates about `z` and rates at the beginning, in rad and rad/s.
    pub start: [Vec<[f64; 2]>; 2],
}

/// Filaments side by side in lanes. Unused lanes repeat the last filament, without loads.
pub struct Group {
    /// Number of the group.
    pub index: usize,
    pub equations: FilamentEquations<Lanes>,
    /// Time of the last evaluation of the clamps in s.
    time: Option<f64>,
    clamp: Clamp<Lanes>,
    /// First filament.
    pub first: usize,
    /// Number of filaments.
    pub count: usize,
    /// Forces of the workpiece, by filament.
    pub loads: Vec<WorkpieceLoad>,
    clearances: Vec<Clearance>,
    /// Contacts of its filaments.
    met: Vec<Meeting>,
    /// Weights of the step and contacts for which the matrix was factorised.
    factorised: Option<([f64; 2], Vec<Meeting>)>,
    changes: Changes,
    pub activity: Activity,
    /// Largest change of a node's acceleration by the last correction, in m/s².
    pub largest: f64,
    /// Rate of the momentum of each filament in N, in the last evaluation.
    pub momentum_rate: [Lanes; 3],
}

/// Contact of a filament. The matrix depends on the active set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Meeting {
    /// Contact with the workpiece: the filament, the number of the contact, and its segment.
    Workpiece([usize; 3]),
    /// Contact with another filament: the point, and the segment that it presses on.
    Filament((i16, (NodeIndex, u64)), NodeIndex),
}

/// Work that a group needs in an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Activity {
    /// Its straight filaments turn rigidly with the body, which solves their equations until
    /// something touches them.
    Sleeping,
    /// Its filaments, and those behind them, have left the workpiece for good. They turn with the
    /// body in their present shape, and nothing touches them.
    Left,
    /// Its equations are solved for this stage.
    Solved,
    /// Its equations are to be solved by themselves.
    Alone,
    /// Its equations are to be solved together with those of other groups.
    Coupled,
}

/// Loads of a group.
struct GroupLoads<'a> {
    /// Forces in N by node, from the root.
    forces: &'a [[Lanes; 3]],
    /// Tangents for a factorisation.
    changes: Option<&'a Changes>,
}

impl NodeLoads<Lanes> for GroupLoads<'_> {
    fn loads_points(&self) -> bool {
        self.changes.is_some()
    }

    fn point_tangents(&self, _: &dyn NodeMotion, add: &mut dyn FnMut(PointTangent<Lanes>)) {
        let none = [zero(); 3];
        for (segment, ends) in self.changes.iter().flat_map(|changes| changes.blocks()) {
            let [[a, b], [c, d]] = ends;
            let at = |position: &[[Lanes; 3]; 3]| NodeTangent {
                position: *position,
                velocity: none,
            };
            add(PointTangent {
                segment,
                ends: [[at(a), at(b)], [at(c), at(d)]],
            });
        }
    }

    fn force(&self, node: usize, _: [Lanes; 3], _: [Lanes; 3]) -> Option<[Lanes; 3]> {
        Some(self.forces[node + 1])
    }

    fn tangent(&self, _: usize, _: [Lanes; 3], _: [Lanes; 3]) -> Option<NodeTangent<Lanes>> {
        None
    }
}

/// Surroundings of the filaments of a group, where they were placed.
pub struct Surroundings<'a, M> {
    pub filaments: &'a [Filament<M, Part>],
    pub nodes: &'a Nodes,
    pub pressing: &'a Pressing,
    pub candidates: &'a Candidates,
    pub time: f64,
    /// `true` if there is friction, whose tangents change from iteration to iteration.
    pub has_friction: bool,
    /// `true` if filaments that are surely clear of the workpiece are not compared with it.
    pub has_bounds: bool,
}

impl Group {
    /// Creates the group of the number `index`, on a body that turns at `rate` (rad/s).
    pub fn new<M: ClampMotion>(
        index: usize,
        form: Form,
        members: &[BundleMember<M>],
        rate: f64,
        activity: Activity,
    ) -> Self {
        let (first, count) = (index * LANES, members.len());
        let filament = |lane: usize| &members[lane.min(count - 1)].filament;
        Self {
            index,
            equations: FilamentEquations::new(
                form,
                Chain::from_lanes(|lane| &filament(lane).chain),
            ),
            time: None,
            clamp: Clamp::from_lanes(|lane| filament(lane).motion.at(0.0)),
            first,
            count,
            loads: vec![WorkpieceLoad::none(); count],
            clearances: members
                .iter()
                .map(|member| Clearance::new(member, rate))
                .collect(),
            met: Vec::new(),
            factorised: None,
            changes: Changes::new(filament(0).chain.segments()),
            activity,
            largest: 0.0,
            momentum_rate: zero(),
        }
    }

    /// Forgets the factorisation.
    pub fn forget(&mut self) {
        self.factorised = None;
    }

    /// Returns `true` if its motion is not computed: it turns with the body.
    pub fn is_asleep(&self) -> bool {
        matches!(self.activity, Activity::Sleeping | Activity::Left)
    }

    /// Returns `true` if its equations are still to be solved for this stage.
    pub fn is_open(&self) -> bool {
        matches!(self.activity, Activity::Alone | Activity::Coupled)
    }

    /// Returns `true` if all its filaments, which turn with the body, stay clear of the workpiece
    /// until `time` (s).
    pub fn is_clear(&self, candidates: &Candidates, time: f64) -> bool {
        let mut clearances = self.clearances.iter().enumerate();
        clearances.all(|(lane, clearance)| {
            clearance.is_early(time)
                || clearance.bound(time, candidates.path(self.first + lane)) > 0.0
        })
    }

    /// Returns `true` if its contacts no longer count at `time` (s), and no filament reaches the
    /// workpiece. Nor may one have done so a filament's length earlier, on a body at `rate`
    /// (rad/s): filaments farther behind then do not touch it.
    pub fn is_past<M: ClampMotion>(
        &self,
        filaments: &[Filament<M, Part>],
        time: f64,
        rate: f64,
    ) -> bool {
        filaments[self.first..]
            .iter()
            .zip(&self.clearances)
            .all(|(filament, clearance)| {
                let Filament {
                    chain,
                    motion,
                    law,
                    workpiece,
                } = filament;
                let reach = chain.length * chain.segments() as f64 + law.radius;
                let [x, y, _] = motion.at(time).position;
                let behind = reach / (x.hypot(y) + reach) / rate.abs();
                let is_away =
                    |time: f64| workpiece.surface(motion.at(time).position, time).gap > reach;
                time >= clearance.contacts[1] && is_away(time) && is_away(time - behind)
            })
    }

    /// Places its nodes by the coordinates.
    pub fn place<M: ClampMotion>(
        &mut self,
        filaments: &[Filament<M, Part>],
        time: f64,
        [q, v]: [&gmres::GroupPart; 2],
        [positions, velocities]: [&mut [[Lanes; 3]]; 2],
    ) {
        if self.time != Some(time) {
            let filament = |lane: usize| &filaments[self.first + lane.min(self.count - 1)];
            self.clamp = M::in_lanes(|lane| &filament(lane).motion, Lanes::from_f64(time));
            self.time = Some(time);
        }
        self.equations.place(self.clamp.holding(q, v));
        (positions[0], velocities[0]) = (self.clamp.position, self.clamp.velocity);
        self.equations
            .nodes_in_lanes(&mut positions[1..], &mut velocities[1..]);
        if self.equations.form() == Form::Planar {
            // Each filament moves in its own plane.
            for position in &mut positions[1..] {
                position[2] = self.clamp.position[2];
            }
        }
    }

    /// Computes `q̈` under the `forces` on the nodes.
    pub fn accelerations(
        &mut self,
        [q, v]: [&gmres::GroupPart; 2],
        forces: &[[Lanes; 3]],
        accelerations: &mut gmres::GroupPart,
    ) {
        let loads = GroupLoads {
            forces,
            changes: None,
        };
        self.equations
            .accelerations(self.clamp.holding(q, v), &loads, accelerations);
    }

    /// Sums the forces on the filaments.
    pub fn meet<M: ClampMotion>(
        &mut self,
        around: &Surroundings<'_, M>,
        forces: &mut GroupField<'_>,
    ) {
        forces.clear();
        self.met.clear();
        self.meet_workpiece(around, forces);
        around.pressing.load(self.index, forces, |near| {
            self.met
                .push(Meeting::Filament(near.key(), near.nearest.segment));
        });
    }

    /// Adds the forces of the workpiece.
    pub fn meet_workpiece<M: ClampMotion>(
        &mut self,
        around: &Surroundings<'_, M>,
        forces: &mut GroupField<'_>,
    ) {
        let Self {
            first,
            loads,
            clearances,
            met,
            ..
        } = self;
        for ((number, load), clearance) in (*first..).zip(loads).zip(clearances) {
            let filament = &around.filaments[number];
            *load = WorkpieceLoad::none();
            let (n, time, way) = (
                filament.chain.segments(),
                around.time,
                around.candidates.path(number),
            );
            let is_far = || clearance.bound(time, way) > clearance.noticed;
            if clearance.is_early(time) || (around.has_bounds && is_far()) {
                continue;
            }
            let node = |k: usize| NodeIndex::new(number, k, n);
            let [pressing, gap] = filament.for_each_pressing(
                |k| around.nodes.at(node(k)),
                time,
                |contact, touch| {
                    let sum = filament.sum(touch);
                    load.sum += sum;
                    load.energy += filament.law.stored_energy(&touch.approach);
                    load.moving_power += dot(sum.force, clearance.workpiece_velocity);
                    load.penetration = load.penetration.max(touch.approach.penetration);
                    load.contact_nodes = load.contact_nodes.max(n.saturating_sub(contact));
                    if touch.on_edge.is_some() {
                        load.edge_penetration =
                            load.edge_penetration.max(touch.approach.penetration);
                        let power = sum.sliding_power;
                        if load.worked.is_none_or(|worked| power > worked.power) {
                            let edge = contact - n;
                            let place =
                                filament.workpiece.edges()[edge].part_before(touch.position, time);
                            load.worked = Some(WorkedEdge { edge, place, power });
                        }
                    }
                    let place = FilamentPoint {
                        segment: node(touch.station.segment),
                        fraction: touch.station.fraction,
                    };
                    place.load(sum.force, forces);
                    met.push(Meeting::Workpiece([number, contact, touch.station.segment]));
                },
            );
            load.pressing = pressing;
            *clearance = Clearance {
                time,
                way,
                gap,
                ..*clearance
            };
        }
    }

    /// Returns the forces of the workpiece on each placed filament, and its deepest penetration in
    /// m.
    pub fn contacts<M: ClampMotion>(
        &self,
        around: &Surroundings<'_, M>,
    ) -> impl Iterator<Item = (ContactSum, f64)> {
        let filaments = (self.first..).zip(&self.clearances);
        filaments.map(|(number, clearance)| {
            let (filament, time) = (&around.filaments[number], around.time);
            let mut sum = ContactSum::default();
            if self.is_asleep() || clearance.is_early(time) {
                return (sum, f64::NEG_INFINITY);
            }
            let n = filament.chain.segments();
            let node = |k: usize| around.nodes.at(NodeIndex::new(number, k, n));
            let [pressing, _] =
                filament.for_each_pressing(node, time, |_, touch| sum += filament.sum(touch));
            (sum, pressing)
        })
    }

    /// Computes the residual. Factorises the matrix if the active set or the weights have changed,
    /// or if contacts have friction. Solves the equations of a group that is alone. Returns `true`
    /// if it factorised.
    pub fn linearise<M: ClampMotion>(
        &mut self,
        around: &Surroundings<'_, M>,
        state: [&gmres::GroupPart; 3],
        weights: [f64; 2],
        forces: &mut GroupField<'_>,
        residual: &mut gmres::GroupPart,
    ) -> bool {
        self.meet(around, forces);
        self.residual(state, forces.vectors(), residual);
        let is_known = self
            .factorised
            .as_ref()
            .is_some_and(|(of, met)| *of == weights && *met == self.met);
        let is_stale = !is_known || (around.has_friction && !self.met.is_empty());
        if is_stale {
            self.factorise(around, state, weights, forces.vectors());
        }
        if self.activity == Activity::Alone {
            self.equations.solve(residual);
        }
        is_stale
    }

    /// Computes the residual with the `forces` on the nodes.
    pub fn residual(
        &mut self,
        [q, v, accelerations]: [&gmres::GroupPart; 3],
        forces: &[[Lanes; 3]],
        residual: &mut gmres::GroupPart,
    ) {
        let loads = GroupLoads {
            forces,
            changes: None,
        };
        let at = self.clamp.holding(q, v);
        self.equations.residual(at, accelerations, &loads, residual);
        let is_planar = self.equations.form() == Form::Planar;
        let present = LaneSet::first(self.count);
        wide(
            #[inline(always)]
            || {
                for block in residual {
                    if is_planar {
                        block[0] = Lanes::ZERO;
                    }
                    if self.count < LANES {
                        *block = [
                            block[0].select(present, Lanes::ZERO),
                            block[1].select(present, Lanes::ZERO),
                        ];
                    }
                }
            },
        );
    }

    fn factorise<M: ClampMotion>(
        &mut self,
        around: &Surroundings<'_, M>,
        [q, v, accelerations]: [&gmres::GroupPart; 3],
        weights: [f64; 2],
        forces: &[[Lanes; 3]],
    ) {
        self.changes.clear(self.index);
        self.add_workpiece_changes(around, weights);
        around.pressing.add_changes(self.index, &mut self.changes);
        let [coordinates, rates] = weights.map(Lanes::from_f64);
        let loads = GroupLoads {
            forces,
            changes: Some(&self.changes),
        };
        let (at, step) = (self.clamp.holding(q, v), StepWeights { coordinates, rates });
        self.equations
            .factorise(at, accelerations, &loads, step, LaneSet::first(LANES));
        let (of, met) = self.factorised.get_or_insert_default();
        *of = weights;
        met.clone_from(&self.met);
    }

    /// Adds the tangents of the forces of the workpiece on the filaments.
    fn add_workpiece_changes<M: ClampMotion>(
        &mut self,
        around: &Surroundings<'_, M>,
        [by_position, by_rate]: [f64; 2],
    ) {
        let Self {
            first,
            loads,
            changes,
            ..
        } = self;
        for (number, load) in (*first..).zip(loads) {
            if load.pressing <= 0.0 {
                continue;
            }
            let filament = &around.filaments[number];
            let node = |k: usize| NodeIndex::new(number, k, filament.chain.segments());
            filament.for_each_pressing(
                |k| around.nodes.at(node(k)),
                around.time,
                |_, touch| {
                    let NodeTangent { position, velocity } = filament.law.tangent(&touch.approach);
                    // The recursion multiplies by the weight of the positions.
                    let change = std::array::from_fn(|row| {
                        add(position[row], scale(by_rate / by_position, velocity[row]))
                    });
                    changes.add_at(node(touch.station.segment), touch.station.shares(), &change);
                },
            );
        }
    }

    /// Computes the displacements of all nodes by a change of the coordinates.
    pub fn displace(&mut self, change: &gmres::GroupPart, displacements: &mut [[Lanes; 3]]) {
        self.equations
            .displacements(change, &mut displacements[1..]);
    }

    /// Subtracts the corrections from the accelerations. A group that is alone is solved if they
    /// change the velocities of its nodes by at most `tolerance` (m/s).
    pub fn correct(
        &mut self,
        corrections: &gmres::GroupPart,
        accelerations: &mut gmres::GroupPart,
        displacements: &mut [[Lanes; 3]],
        [by_rate, tolerance]: [f64; 2],
    ) {
        self.largest = 0.0;
        if !self.is_open() {
            return;
        }
        self.displace(corrections, displacements);
        let squares = wide(
            #[inline(always)]
            || {
                for (acceleration, correction) in accelerations.iter_mut().zip(corrections) {
                    *acceleration = sub(*acceleration, *correction);
                }
                let mut most = Lanes::ZERO;
                for displacement in &displacements[1..] {
                    most = most.max(dot(*displacement, *displacement));
                }
                most
            },
        );
        let of_lanes = (0..LANES).map(|lane| squares.lane(lane));
        self.largest = of_lanes.fold(0.0, larger).sqrt();
        if self.activity == Activity::Alone && by_rate * self.largest <= tolerance {
            self.activity = Activity::Solved;
        }
    }
}

/// Returns the maximum, which is NaN if either is.
pub fn larger(a: f64, b: f64) -> f64 {
    if b <= a || a.is_nan() { a } else { b }
}
