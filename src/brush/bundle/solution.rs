//! Solution of the equations of a stage by Newton's method, and of its linear equations.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::super::field::{Field, GroupField, wide};
use super::super::gmres::{self, Coupled, Division, Krylov, Vector};
use super::super::group::{Activity, Group, larger};
use super::super::pressing::Pressing;
use super::super::team;
use super::{BrushState, Bundle, Effort, first_coordinate};
use crate::equations::{ChainDynamics, Lanes, Real};
use crate::tool::ClampMotion;

/// Coordinates and rates of a stage as functions of its accelerations.
#[derive(Clone, Copy)]
pub struct Kinematics<'a> {
    /// Coordinates and rates at zero accelerations.
    pub base: [&'a Vector; 2],
    /// Weights of the accelerations in coordinates (s²) and rates (s).
    pub weights: [f64; 2],
    /// First coordinate of a block that changes.
    pub first: usize,
}

impl Kinematics<'_> {
    /// Computes coordinates and rates from the accelerations, from the block `first` on.
    fn follow(
        &self,
        [q, v]: [&mut gmres::GroupPart; 2],
        accelerations: &gmres::GroupPart,
        first: usize,
    ) {
        let [by_position, by_rate] = self.weights;
        let [base_q, base_v] = self.base.map(|base| &base[first..][..accelerations.len()]);
        wide(
            #[inline(always)]
            || {
                for (k, acceleration) in accelerations.iter().enumerate() {
                    for i in self.first..2 {
                        q[k][i] = base_q[k][i] + Lanes::from_f64(by_position) * acceleration[i];
                        v[k][i] = base_v[k][i] + Lanes::from_f64(by_rate) * acceleration[i];
                    }
                }
            },
        );
    }
}

/// Failure of Newton's method to converge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoConvergence;

/// Memory of the linear equations.
pub(super) struct Linear {
    pub(super) residual: Vector,
    pub(super) displacements: Field,
    pub(super) krylov: Krylov,
    /// `true` for groups that are solved together.
    pub(super) coupled: Vec<bool>,
}

impl<M: ClampMotion + Sync> Bundle<M> {
    /// Solves the equations of a stage for `motion.accelerations`.
    ///
    /// A solution is accepted once the last correction of any node's velocity is below `tolerance`
    /// (m/s).
    ///
    /// # Errors
    /// If Newton's method does not converge.
    pub fn solve_stage(
        &mut self,
        motion: &mut BrushState,
        stage: Kinematics<'_>,
        tolerance: f64,
    ) -> Result<Effort, NoConvergence> {
        /// Corrections above half of the one before, after which a shorter step costs less.
        const MAX_STALLED: usize = 4;
        let (n, [by_position, by_rate]) = (self.layout.segments, stage.weights);
        let mut effort = Effort::default();
        self.begin_stage();
        // A solution depends on nothing before its stage.
        self.pressing.forget();
        let (mut stalled, mut last) = (0, f64::INFINITY);
        while stalled < MAX_STALLED {
            effort.newton_iterations += 1;
            self.follow(motion, stage);
            self.find_presses(motion.time, Some(stage.weights));
            if self.has_woken {
                return Err(NoConvergence);
            }
            effort.factorisations += self.linearise(motion, stage.weights);
            effort.krylov_vectors += self.solve_coupled(by_position).ok_or(NoConvergence)?;
            let largest = by_rate * self.correct(motion, by_rate, tolerance);
            if !largest.is_finite() {
                return Err(NoConvergence);
            }
            stalled += usize::from(largest > 0.5 * last);
            last = largest;
            if largest <= tolerance {
                let parts = motion
                    .q
                    .chunks_mut(n)
                    .zip(motion.v.chunks_mut(n))
                    .zip(motion.accelerations.chunks(n));
                for (group, ((q, v), accelerations)) in parts.enumerate() {
                    stage.follow([q, v], accelerations, group * n);
                }
                return Ok(effort);
            }
        }
        Err(NoConvergence)
    }

    /// Places the groups that are not solved yet, from their accelerations.
    fn follow(&mut self, motion: &mut BrushState, stage: Kinematics<'_>) {
        let n = self.layout.segments;
        let Self {
            groups,
            nodes,
            filaments,
            ..
        } = self;
        let BrushState {
            time,
            q,
            v,
            accelerations,
        } = motion;
        let parts = groups
            .iter_mut()
            .zip(q.chunks_mut(n).zip(v.chunks_mut(n)))
            .zip(accelerations.chunks(n))
            .zip(nodes.by_group(n));
        let parts = parts.filter(|(((group, _), _), _)| group.is_open());
        team::for_each(parts, |(((group, (q, v)), accelerations), nodes)| {
            stage.follow([q, v], accelerations, group.index * n);
            group.place(filaments, *time, [q, v], nodes);
        });
    }

    /// Computes the residual, and factorises the matrices of groups whose factorisation does not
    /// hold. Solves the equations of groups that are alone. Returns the number of factorisations.
    fn linearise(&mut self, motion: &BrushState, weights: [f64; 2]) -> usize {
        let n = self.layout.segments;
        let (groups, around, forces, linear) = self.parts(motion.time);
        let factorisations = AtomicUsize::new(0);
        let parts = groups
            .iter_mut()
            .zip(motion.by_group(n))
            .zip(forces.0.chunks_mut(n + 1))
            .zip(linear.residual.chunks_mut(n));
        let parts = parts.filter(|(((group, _), _), _)| group.is_open());
        team::for_each(parts, |(((group, state), forces), residual)| {
            let mut forces = GroupField::new(group.index, n, forces);
            if group.linearise(&around, state, weights, &mut forces, residual) {
                factorisations.fetch_add(1, Ordering::Relaxed);
            }
        });
        factorisations.into_inner()
    }

    /// Solves the equations of the coupled groups for the residual, in place. Returns the number of
    /// vectors; `None` on failure.
    fn solve_coupled(&mut self, by_position: f64) -> Option<usize> {
        /// Share of the residual that the solution may leave. Buckling filaments amplify it: with a
        /// larger share, mirror images differ.
        const FORCING: f64 = 0.02;
        let Self {
            groups,
            layout,
            forces,
            pressing,
            linear,
            ..
        } = self;
        let Linear {
            residual,
            displacements,
            krylov,
            coupled,
        } = linear;
        let first = first_coordinate(groups);
        coupled.clear();
        coupled.extend(
            groups
                .iter()
                .map(|group| group.activity == Activity::Coupled),
        );
        if !coupled.contains(&true) {
            return Some(0);
        }
        let (n, factor) = (layout.segments, Lanes::from_f64(-by_position));
        let mut coupling = CoupledGroups {
            groups,
            displacements,
            forces,
            pressing,
            segments: n,
            factor,
        };
        gmres::solve(
            &mut coupling,
            residual,
            FORCING,
            krylov,
            Division {
                blocks: n,
                coupled,
                first,
            },
        )
    }

    /// Corrects the accelerations. Returns the largest correction of a node's acceleration in m/s².
    /// Groups that are alone are solved if their nodes' velocities change by less than `tolerance`
    /// (m/s).
    fn correct(&mut self, motion: &mut BrushState, by_rate: f64, tolerance: f64) -> f64 {
        let n = self.layout.segments;
        let Self {
            groups,
            linear:
                Linear {
                    residual,
                    displacements,
                    ..
                },
            ..
        } = self;
        let parts = groups
            .iter_mut()
            .zip(residual.chunks(n))
            .zip(displacements.0.chunks_mut(n + 1))
            .zip(motion.accelerations.chunks_mut(n));
        team::for_each(
            parts,
            |(((group, corrections), displacements), accelerations)| {
                group.correct(
                    corrections,
                    accelerations,
                    displacements,
                    [by_rate, tolerance],
                );
            },
        );
        groups.iter().map(|group| group.largest).fold(0.0, larger)
    }
}

/// Groups that are solved together.
struct CoupledGroups<'a> {
    /// All groups.
    groups: &'a mut [Group],
    displacements: &'a mut Field,
    forces: &'a mut Field,
    pressing: &'a Pressing,
    segments: usize,
    /// Negative weight of the positions in the tangents.
    factor: Lanes,
}

impl Coupled for CoupledGroups<'_> {
    fn precondition(
        &mut self,
        x: &mut Vector,
        y: &mut Vector,
        prepare: impl Fn(usize, &mut gmres::GroupPart, &mut gmres::GroupPart) + Sync,
    ) {
        let vectors = x.chunks_mut(self.segments).zip(y.chunks_mut(self.segments));
        let parts = self
            .groups
            .iter_mut()
            .zip(vectors)
            .zip(self.displacements.0.chunks_mut(self.segments + 1));
        let parts = parts.filter(|((group, _), _)| group.activity == Activity::Coupled);
        team::for_each(parts, |((group, (x, y)), displacements)| {
            prepare(group.index, x, y);
            group.equations.solve(x);
            group.displace(x, displacements);
        });
    }

    fn couple(
        &mut self,
        image: &mut Vector,
        sums: &mut [Vec<f64>],
        combine: impl Fn(usize, &mut gmres::GroupPart, &mut Vec<f64>) + Sync,
    ) {
        let Self {
            groups,
            displacements,
            forces,
            pressing,
            segments,
            factor,
        } = self;
        let vectors = image.chunks_mut(*segments).zip(sums);
        let parts = groups
            .iter_mut()
            .zip(vectors)
            .zip(forces.0.chunks_mut(*segments + 1));
        let parts = parts.filter(|((group, _), _)| group.activity == Activity::Coupled);
        team::for_each(parts, |((group, (image, sums)), forces)| {
            let mut forces = GroupField::new(group.index, *segments, forces);
            forces.clear();
            pressing.couple(group.index, displacements, &mut forces);
            group.equations.torques(&forces.vectors()[1..], image);
            wide(
                #[inline(always)]
                || {
                    for block in &mut *image {
                        *block = [block[0] * *factor, block[1] * *factor];
                    }
                },
            );
            combine(group.index, image, sums);
        });
    }
}
