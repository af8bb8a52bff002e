//! Filaments in contact with the workpiece and with each other: their equations at one instant, and
//! their solution.
//!
//! Filaments are in groups, one per lane. All work is done group by group, on all threads. Each
//! group takes the forces of its own points on other filaments, and of the points of others on its
//! own. Sums have a fixed order, so that results do not depend on the number of threads.

mod solution;

use std::ops::AddAssign;

use super::candidates::{Candidates, Layout};
use super::field::{Field, FilamentPoint, GroupField, NodeIndex, Nodes};
use super::gmres::{self, Krylov, Vector};
use super::group::{Activity, Budget, BundleMember, Group, Surroundings, WorkpieceLoad};
use super::presses::PressLaw;
use super::pressing::{FilamentPress, Pressing};
use super::shortcuts::Shortcuts;
use super::team;
use crate::equations::{LANES, LaneSet, Lanes, Lanewise, PolarAxis, Real, better_chart};
use crate::simulation::{ContactSum, Filament, Form};
use crate::tool::ClampMotion;
use crate::workpiece::Part;
use solution::Linear;
pub use solution::{Kinematics, NoConvergence};

/// Coordinates, rates and accelerations of all filaments, group by group.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BrushState {
    /// Time in s.
    pub time: f64,
    /// Coordinates in rad.
    pub q: Vector,
    /// Rates in rad/s.
    pub v: Vector,
    /// Accelerations in rad/s².
    pub accelerations: Vector,
}

impl BrushState {
    /// Returns coordinates, rates and accelerations of each group of filaments of `n` segments.
    fn by_group(&self, n: usize) -> impl Iterator<Item = [&gmres::GroupPart; 3]> {
        self.q
            .chunks(n)
            .zip(self.v.chunks(n))
            .zip(self.accelerations.chunks(n))
            .map(|((q, v), a)| [q, v, a])
    }
}

/// Work of a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Effort {
    /// Iterations of Newton's method.
    pub newton_iterations: usize,
    /// Krylov vectors of the linear solutions.
    pub krylov_vectors: usize,
    /// Factorisations of the matrices of a group.
    pub factorisations: usize,
}

impl AddAssign for Effort {
    fn add_assign(&mut self, other: Self) {
        self.newton_iterations += other.newton_iterations;
        self.krylov_vectors += other.krylov_vectors;
        self.factorisations += other.factorisations;
    }
}

/// Filaments that touch each other.
pub struct Bundle<M> {
    filaments: Vec<Filament<M, Part>>,
    groups: Vec<Group>,
    layout: Layout,
    /// Rate at which the body turns about `z`, in rad/s.
    rate: f64,
    /// `true` if there is friction.
    has_friction: bool,
    candidates: Candidates,
    nodes: Nodes,
    pressing: Pressing,
    forces: Field,
    linear: Linear,
    /// `true` once a sleeping group was touched, which voids all results since the last step.
    has_woken: bool,
    shortcuts: Shortcuts,
}

/// State of a group, apart from its motion.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GroupState {
    chart: PolarAxis,
    activity: Activity,
}

/// Budget, rates of momentum and loads of a bundle at one instant.
pub struct BundleEvaluation<'a> {
    groups: &'a [Group],
    /// Budget of the awake filaments.
    pub budget: Budget,
}

impl BundleEvaluation<'_> {
    /// Takes the rates of the momentum of all filaments, in N, by group: zero for sleeping ones,
    /// which turn with the body.
    pub fn take_momentum_rates(&self, rates: &mut Vec<[Lanes; 3]>) {
        rates.clear();
        rates.extend(self.groups.iter().map(|group| {
            let is_present = LaneSet::first(group.count);
            group.momentum_rate.map(|rate| {
                if group.is_asleep() {
                    Lanes::ZERO
                } else {
                    rate.select(is_present, Lanes::ZERO)
                }
            })
        }));
    }

    /// Takes the forces of the workpiece on each filament, except for sleeping ones.
    pub fn take_loads(&self, loads: &mut Vec<WorkpieceLoad>) {
        for group in self.groups {
            let Group {
                first, loads: new, ..
            } = group;
            if loads.len() == *first {
                loads.extend_from_slice(new);
            } else if !group.is_asleep() {
                loads[*first..][..new.len()].copy_from_slice(new);
            }
        }
    }
}

impl<M: ClampMotion + Sync> Bundle<M> {
    /// Creates filaments with equations of the given form, and their motion at `time` (s). They
    /// press on each other under `law`, on a body that turns at `rate` (rad/s) about `z`. Only
    /// filaments that turn rigidly with the body until something touches them may sleep.
    ///
    /// # Panics
    /// If there is no filament, or if their numbers of segments differ.
    pub fn new(
        form: Form,
        members: Vec<BundleMember<M>>,
        law: PressLaw,
        layout: Layout,
        [time, rate]: [f64; 2],
        shortcuts: Shortcuts,
    ) -> (Self, BrushState) {
        let n = layout.segments;
        assert!(
            !members.is_empty()
                && members
                    .iter()
                    .all(|member| member.filament.chain.segments() == n)
        );
        let activity = if shortcuts.sleep {
            Activity::Sleeping
        } else {
            Activity::Solved
        };
        let parts = members.chunks(LANES).enumerate();
        let groups: Vec<Group> = parts
            .map(|(index, members)| Group::new(index, form, members, rate, activity))
            .collect();
        let field = Field::new(groups.len(), n);
        let none = vec![[Lanes::ZERO; 2]; groups.len() * n];
        let mut motion = BrushState {
            time,
            q: none.clone(),
            v: none.clone(),
            accelerations: none.clone(),
        };
        for group in &groups {
            for lane in 0..LANES {
                let [q, v] = &members[group.first + lane.min(group.count - 1)].start;
                for k in 0..n {
                    for i in 0..2 {
                        motion.q[group.index * n + k][i].set_lane(lane, q[k][i]);
                        motion.v[group.index * n + k][i].set_lane(lane, v[k][i]);
                    }
                }
            }
        }
        let filaments: Vec<_> = members.into_iter().map(|member| member.filament).collect();
        let mut bundle = Self {
            has_friction: law.friction > 0.0
                || filaments.iter().any(|filament| filament.law.friction > 0.0),
            candidates: Candidates::new(layout.clone(), shortcuts.broad_phase),
            nodes: Nodes {
                positions: field.clone(),
                velocities: field.clone(),
            },
            pressing: Pressing::new(law, &layout, form == Form::Planar),
            linear: Linear {
                residual: none,
                displacements: field.clone(),
                krylov: Krylov::default(),
                coupled: Vec::with_capacity(groups.len()),
            },
            forces: field,
            rate,
            layout,
            groups,
            filaments,
            has_woken: false,
            shortcuts,
        };
        bundle.leave_poles(&mut motion);
        bundle.place_sleeping(&motion);
        bundle.meet(&motion);
        let Self { groups, forces, .. } = &mut bundle;
        let parts = forces
            .0
            .chunks(n + 1)
            .zip(motion.q.chunks(n).zip(motion.v.chunks(n)));
        for (group, ((forces, (q, v)), a)) in groups
            .iter_mut()
            .zip(parts.zip(motion.accelerations.chunks_mut(n)))
        {
            if !group.is_asleep() {
                group.accelerations([q, v], forces, a);
            }
        }
        (bundle, motion)
    }

    /// Returns the filaments.
    pub fn filaments(&self) -> &[Filament<M, Part>] {
        &self.filaments
    }

    /// Returns the first coordinate of a block that changes.
    pub fn first_coordinate(&self) -> usize {
        first_coordinate(&self.groups)
    }

    /// Returns the number of segments of a filament.
    pub fn segments(&self) -> usize {
        self.layout.segments
    }

    /// Returns the position of a node in m, where it was last placed; 0 is the root.
    pub fn node(&self, filament: usize, k: usize) -> [f64; 3] {
        self.nodes
            .positions
            .at(NodeIndex::new(filament, k, self.layout.segments))
    }

    /// Returns the presses between filaments in the last evaluation or iteration.
    pub fn presses(&self) -> impl Iterator<Item = &FilamentPress> {
        self.pressing.iter()
    }

    /// Returns the distance of a point from the root of its filament in m.
    pub fn arc_length(&self, place: &FilamentPoint) -> f64 {
        let n = self.layout.segments;
        let length = self.layout.lengths[place.segment.filament(n)];
        (place.segment.index(n) as f64 + place.fraction) * length
    }

    /// Forgets factorisations, so that later results do not depend on where they were made. Nor do
    /// they depend on other kept data: bounds of the distance from contact only save work.
    pub fn forget(&mut self) {
        self.groups.iter_mut().for_each(Group::forget);
    }

    /// Prepares the next step from `motion`. Returns `true` if more groups are left out than
    /// before.
    pub fn begin_step(&mut self, motion: &mut BrushState) -> bool {
        self.fill_lanes(motion);
        self.leave_poles(motion);
        self.shortcuts.leave_out && self.leave_out(motion)
    }

    /// Leaves out the groups that no longer influence results: they turn with the body from now on.
    /// Returns `true` if there are new ones.
    ///
    /// A filament whose root is farther away than its length does not touch the workpiece, whatever
    /// its shape. It is left out once the body has turned on by this length: filaments behind it,
    /// on which it might press, then do not touch the workpiece either. The decision depends on the
    /// time alone, and is the same in a resumed run.
    fn leave_out(&mut self, motion: &mut BrushState) -> bool {
        let n = self.layout.segments;
        let Self {
            groups,
            filaments,
            candidates,
            rate,
            ..
        } = self;
        let mut any = false;
        for group in groups.iter_mut().filter(|group| !group.is_asleep()) {
            let turns = group.equations.chart() == PolarAxis::Z;
            if !turns || !group.is_past(filaments, motion.time, *rate) {
                continue;
            }
            any = true;
            group.activity = Activity::Left;
            let blocks = group.index * n..(group.index + 1) * n;
            motion.v[blocks.clone()].fill([Lanes::ZERO, Lanes::from_f64(*rate)]);
            motion.accelerations[blocks].fill([Lanes::ZERO; 2]);
            candidates.leave_out(group.index);
        }
        any
    }

    /// Wakes the sleeping groups that may meet the workpiece in a step of `h` (s) from `motion`, or
    /// in a second one: the first step with a contact needs the distance at its beginning. Returns
    /// `true` if a group has woken since the last step, also because others touched it.
    pub fn wake(&mut self, motion: &BrushState, h: f64) -> bool {
        let (end, mut any) = (motion.time + 2.0 * h, std::mem::take(&mut self.has_woken));
        for index in 0..self.groups.len() {
            let is_due = |bundle: &Self| {
                let group = &bundle.groups[index];
                group.activity == Activity::Sleeping && !group.is_clear(&bundle.candidates, end)
            };
            if !is_due(self) {
                continue;
            }
            // The bound may start from an old distance.
            self.place(motion, |group| group.index == index);
            let n = self.layout.segments;
            let (groups, around, forces, _) = self.parts(motion.time);
            let forces = &mut forces.0[index * (n + 1)..][..=n];
            groups[index].meet_workpiece(&around, &mut GroupField::new(index, n, forces));
            if is_due(self) {
                self.groups[index].activity = Activity::Solved;
                any = true;
            }
        }
        any
    }

    /// Returns `true` if a sleeping group was touched since the last step.
    pub fn has_woken(&self) -> bool {
        self.has_woken
    }

    /// Returns `true` if a group sleeps.
    pub fn is_asleep(&self, group: usize) -> bool {
        self.groups[group].is_asleep()
    }

    /// Places the sleeping groups.
    fn place_sleeping(&mut self, motion: &BrushState) {
        self.place(motion, Group::is_asleep);
    }

    /// Places the awake groups. Returns the forces of the workpiece on each filament, with its
    /// deepest penetration in m.
    pub fn contacts(&mut self, motion: &BrushState) -> Vec<(ContactSum, f64)> {
        self.place(motion, |group| !group.is_asleep());
        let (groups, around, ..) = self.parts(motion.time);
        let contacts = groups.iter().flat_map(|group| group.contacts(&around));
        contacts.collect()
    }

    /// Places all groups.
    pub fn place_all(&mut self, motion: &BrushState) {
        self.place(motion, |_| true);
    }

    /// Returns the chart of the coordinates of a group.
    pub fn chart(&self, group: usize) -> PolarAxis {
        self.groups[group].equations.chart()
    }

    /// Returns the state of each group, for [`Bundle::restore`].
    pub fn states(&self) -> Vec<GroupState> {
        let state = |group: &Group| GroupState {
            chart: group.equations.chart(),
            activity: if group.is_asleep() {
                group.activity
            } else {
                Activity::Solved
            },
        };
        self.groups.iter().map(state).collect()
    }

    /// Restores the state of each group. Returns `None` if the states do not fit this bundle.
    pub fn restore(&mut self, states: Vec<GroupState>) -> Option<()> {
        let fits = |(group, state): (&Group, &GroupState)| {
            state.chart == PolarAxis::Z || group.equations.chain().is_relaxed_straight()
        };
        if states.len() != self.groups.len() || !self.groups.iter().zip(&states).all(fits) {
            return None;
        }
        for (group, GroupState { chart, activity }) in self.groups.iter_mut().zip(states) {
            group.equations.set_chart(chart);
            group.activity = activity;
            if activity == Activity::Left {
                self.candidates.leave_out(group.index);
            }
        }
        Some(())
    }

    /// Copies the last filament of a group to its unused lanes: nothing is solved for them, so that
    /// they would drift away.
    fn fill_lanes(&self, motion: &mut BrushState) {
        let n = self.layout.segments;
        for (index, group) in self
            .groups
            .iter()
            .enumerate()
            .filter(|(_, group)| group.count < LANES)
        {
            for vector in [&mut motion.q, &mut motion.v, &mut motion.accelerations] {
                for value in vector[index * n..][..n].iter_mut().flatten() {
                    let last = value.lane(group.count - 1);
                    (group.count..LANES).for_each(|lane| value.set_lane(lane, last));
                }
            }
        }
    }

    /// Switches groups with a segment near a pole to the other chart, if it suits all their
    /// segments better.
    fn leave_poles(&mut self, motion: &mut BrushState) {
        let n = self.layout.segments;
        for (index, group) in self.groups.iter_mut().enumerate() {
            let is_asleep = group.is_asleep();
            let equations = &mut group.equations;
            let has_two_charts =
                equations.form() == Form::Spatial && equations.chain().is_relaxed_straight();
            if !has_two_charts || is_asleep {
                continue;
            }
            let block = |vector: &Vector, (at, lane): (usize, usize)| {
                vector[at].map(|value| value.lane(lane))
            };
            let places = || {
                (index * n..(index + 1) * n).flat_map(|at| (0..LANES).map(move |lane| (at, lane)))
            };
            let motions = places().map(|place| {
                [&motion.q, &motion.v, &motion.accelerations].map(|vector| block(vector, place))
            });
            let Some((chart, motions)) = better_chart(equations.chart(), motions) else {
                continue;
            };
            for ((at, lane), blocks) in places().zip(motions) {
                let vectors = [&mut motion.q, &mut motion.v, &mut motion.accelerations];
                for (vector, block) in vectors.into_iter().zip(blocks) {
                    for (value, component) in vector[at].iter_mut().zip(block) {
                        value.set_lane(lane, component);
                    }
                }
            }
            equations.set_chart(chart);
            group.forget();
        }
    }

    /// Places the awake filaments, and sums the forces of all contacts.
    fn meet(&mut self, motion: &BrushState) {
        self.begin_stage();
        self.place(motion, Group::is_open);
        self.find_presses(motion.time, None);
        let n = self.layout.segments;
        let (groups, around, forces, _) = self.parts(motion.time);
        let parts = groups.iter_mut().zip(forces.0.chunks_mut(n + 1));
        let parts = parts.filter(|(group, _)| !group.is_asleep());
        team::for_each(parts, |(group, forces)| {
            group.meet(&around, &mut GroupField::new(group.index, n, forces));
        });
    }

    /// Returns groups, surroundings at `time` (s), forces and linear equations.
    fn parts(&mut self, time: f64) -> (&mut [Group], Surroundings<'_, M>, &mut Field, &mut Linear) {
        let Self {
            filaments,
            groups,
            has_friction,
            candidates,
            nodes,
            pressing,
            forces,
            linear,
            shortcuts,
            ..
        } = self;
        let (has_friction, has_bounds) = (*has_friction, shortcuts.clearance);
        (
            groups,
            Surroundings {
                filaments,
                nodes,
                pressing,
                candidates,
                time,
                has_friction,
                has_bounds,
            },
            forces,
            linear,
        )
    }

    fn begin_stage(&mut self) {
        self.groups
            .iter_mut()
            .filter(|group| !group.is_asleep())
            .for_each(|group| group.activity = Activity::Alone);
    }

    fn place(&mut self, motion: &BrushState, which: impl Fn(&Group) -> bool) {
        let n = self.layout.segments;
        let Self {
            groups,
            nodes,
            filaments,
            ..
        } = self;
        let parts = groups
            .iter_mut()
            .zip(motion.by_group(n))
            .zip(nodes.by_group(n));
        let parts = parts.filter(|((group, _), _)| which(group));
        team::for_each(parts, |((group, [q, v, _]), nodes)| {
            group.place(filaments, motion.time, [q, v], nodes);
        });
    }

    /// Finds the presses between filaments where they were placed; with `weights` also the tangents
    /// of their forces along a step. Wakes sleeping groups that something presses on.
    fn find_presses(&mut self, time: f64, weights: Option<[f64; 2]>) {
        let Self {
            candidates,
            nodes,
            pressing,
            groups,
            layout,
            ..
        } = self;
        candidates.update(&nodes.positions, self.rate * time, |group: usize| {
            groups[group].is_open()
        });
        // Tangents are over the weight of the positions, by which solutions multiply.
        pressing.find(
            candidates,
            nodes,
            layout,
            weights.map(|[by_position, by_rate]| [1.0, by_rate / by_position]),
        );
        for group in groups {
            self.has_woken |= group.activity == Activity::Sleeping && pressing.is_any(group.index);
            group.activity = match group.activity {
                _ if pressing.is_any(group.index) => Activity::Coupled,
                Activity::Coupled => Activity::Alone,
                activity => activity,
            };
        }
    }

    /// Evaluates all contacts, and the budget of the awake filaments.
    pub fn evaluate(&mut self, motion: &BrushState) -> BundleEvaluation<'_> {
        let n = self.layout.segments;
        self.meet(motion);
        let mut budgets = vec![Budget::default(); self.groups.len()];
        let (groups, around, forces, linear) = self.parts(motion.time);
        let parts = groups
            .iter_mut()
            .zip(motion.by_group(n))
            .zip(forces.0.chunks(n + 1).zip(linear.residual.chunks_mut(n)))
            .zip(&mut budgets);
        let parts = parts.filter(|(((group, _), _), _)| !group.is_asleep());
        team::for_each(parts, |(((group, state), (forces, residual)), budget)| {
            group.residual(state, forces, residual);
            let [q, v, _] = state;
            *budget = group.budget(&around, [q, v], forces);
        });
        let mut budget = Budget::default();
        budgets.iter().for_each(|of_group| budget.add(of_group));
        BundleEvaluation {
            groups: &self.groups,
            budget,
        }
    }
}

/// Returns the first coordinate of a block that changes: in the plane, the other one is constant.
fn first_coordinate(groups: &[Group]) -> usize {
    usize::from(groups[0].equations.form() == Form::Planar)
}
