//! Equations of motion of a chain in the plane of rotation, and of its lateral variation.
//!
//! A planar chain has one coordinate a segment, its azimuth `θ`, and nodes in the plane `z = 0`.
//! Its polar angles are `π/2` exactly. In the plane the angle of a joint is the difference of two
//! azimuths, so that a spring costs one product.
//!
//! Beside the motion itself the equations carry its lateral variation: `η = ∂φ/∂τ`, where `τ` is a
//! small tilt of the clamp out of the plane. It obeys linear equations along the planar motion
//! (`codegen/src/model/lateral.rs`).
//!
//! A block of coordinates is `[η, θ]`.

mod lateral;
mod motion;

use super::dispatch::{Loop, dispatch};
use super::linear::{add, in_lane, zero};
use super::memory::Memory;
use super::recursion;
use super::step_matrix;
use super::tasks::{ChainDynamics, Factorise, Task, TrialAccelerations};
use super::{Chain, ChainState, Energies, Lanes, Lanewise, NodeLoads, Real, StepWeights};
use lateral::Lateral;
use motion::{Planar, in_plane, to_frame};

/// Equations of motion of one planar chain, or of one per lane, with the memory for their
/// recursions.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. `q` holds `[η, θ]`, `η` per rad of
/// tilt and `θ` in rad. Neighbouring azimuths differ by less than `π`. The motion does not depend
/// on its variation. The methods of [`ChainDynamics`] act on the motion alone and leave the entries
/// of the variation unchanged. Only [`ChainDynamics::factorise`] factorises the matrices of both.
/// Nodes, loads and clamp are in the frame `(x, y, z)`; their components along `z` are zero.
#[derive(Clone, Debug)]
pub struct PlanarDynamics<T> {
    chain: Chain<T>,
    /// `sin θ, cos θ`
    angles: Vec<[T; 2]>,
    memory: Memory<T, 1, 2>,
    lateral: Memory<T, 1, 1>,
}

impl<T: Real> PlanarDynamics<T> {
    /// Creates the dynamics of `chain`.
    ///
    /// # Panics
    /// If the chain has no segment.
    pub fn new(chain: Chain<T>) -> Self {
        let n = chain.segments();
        assert!(n > 0, "a chain has at least one segment");
        Self {
            chain,
            angles: vec![zero(); n],
            memory: Memory::new(n),
            lateral: Memory::new(n),
        }
    }

    /// Returns the constants.
    pub fn chain(&self) -> &Chain<T> {
        &self.chain
    }

    /// Returns the constants, to be replaced by others with the same number of segments.
    pub(crate) fn chain_mut(&mut self) -> &mut Chain<T> {
        &mut self.chain
    }

    /// Returns position in m and velocity in m/s of the node `r_{k+1}`, for `k = node`, at the
    /// state of the last [`ChainDynamics::place`], [`ChainDynamics::track`] or
    /// [`ChainDynamics::residual`].
    pub fn node(&self, node: usize) -> [[T; 3]; 2] {
        [
            to_frame(self.memory.positions[node]),
            to_frame(self.memory.velocities[node]),
        ]
    }

    /// Returns the force that the clamp exerts on the root in N, from the last
    /// [`ChainDynamics::residual`].
    pub fn root_force(&self) -> [T; 3] {
        to_frame(self.memory.root_force)
    }
}

impl<T: PlanarLoops> ChainDynamics<T> for PlanarDynamics<T> {
    fn run(&mut self, task: Task<'_, T>) {
        T::run_planar(self, PlanarTask::Motion(task));
    }
}

impl<T: PlanarLoops> PlanarDynamics<T> {
    /// Computes the `η̈` that belong to the `θ̈` in `accelerations`, at the point of the last
    /// [`ChainDynamics::residual`]. That call must have had the same arguments.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn lateral_accelerations(
        &mut self,
        at: ChainState<'_, T>,
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        T::run_planar(self, PlanarTask::Lateral(at, loads, accelerations));
    }

    /// Solves the factorised equations of the variation. Puts its correction into `correction`,
    /// which holds the correction of `θ̈`.
    ///
    /// The right side is the residual of the variation at the point of the last
    /// [`ChainDynamics::residual`], but with the loads after the correction of `θ̈`: in a stiff
    /// contact loads change by far more than anything else. The nodes are moved there, as by
    /// [`ChainDynamics::shift`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn solve_variation(
        &mut self,
        at: ChainState<'_, T>,
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        correction: &mut [[T; 2]],
    ) {
        T::run_planar(
            self,
            PlanarTask::Variation(
                TrialAccelerations {
                    at,
                    accelerations,
                    loads,
                },
                weights,
                correction,
            ),
        );
    }
}

impl<T: Lanewise> PlanarDynamics<T> {
    /// Returns energies, dissipation and clamp power at the state `(q, q̇)`, where the nodes were
    /// last placed.
    pub fn energies(&self, at: ChainState<'_, T>) -> Energies<T> {
        let posture = Planar::new(&self.chain, &self.angles, at);
        recursion::energies(&self.memory, &posture, posture.clamp_torque_power())
    }

    /// Returns position in m and velocity in m/s of a node in one lane; see
    /// [`PlanarDynamics::node`].
    #[inline]
    pub fn node_in_lane(&self, node: usize, lane: usize) -> [[f64; 3]; 2] {
        [
            in_lane(&self.memory.positions[node], lane),
            in_lane(&self.memory.velocities[node], lane),
        ]
        .map(|[x, y]| [x, y, 0.0])
    }

    /// Returns position, velocity and acceleration of a node in one lane, after
    /// [`ChainDynamics::track`] or [`ChainDynamics::residual`].
    #[inline]
    pub fn node_motion(&self, node: usize, lane: usize) -> [[f64; 3]; 3] {
        let base = in_lane(&self.memory.base_accelerations[node + 1], lane);
        let acceleration = add(base, in_lane(&in_plane(self.chain.gravity), lane));
        [
            in_lane(&self.memory.positions[node], lane),
            in_lane(&self.memory.velocities[node], lane),
            acceleration,
        ]
        .map(|[x, y]| [x, y, 0.0])
    }
}

/// Task for [`PlanarDynamics`].
pub enum PlanarTask<'a, T> {
    /// Task of the motion and, for a factorisation, of its variation.
    Motion(Task<'a, T>),
    /// [`PlanarDynamics::lateral_accelerations`]
    Lateral(ChainState<'a, T>, &'a dyn NodeLoads<T>, &'a mut [[T; 2]]),
    /// [`PlanarDynamics::solve_variation`]
    Variation(TrialAccelerations<'a, T>, StepWeights<T>, &'a mut [[T; 2]]),
}

/// Numbers for which the loops over a planar chain are compiled.
pub trait PlanarLoops: Lanewise {
    #[doc(hidden)]
    fn run_planar(dynamics: &mut PlanarDynamics<Self>, task: PlanarTask<'_, Self>);
}

impl PlanarLoops for f64 {
    fn run_planar(dynamics: &mut PlanarDynamics<Self>, task: PlanarTask<'_, Self>) {
        run_planar(dynamics, task);
    }
}

impl PlanarLoops for Lanes {
    fn run_planar(dynamics: &mut PlanarDynamics<Self>, task: PlanarTask<'_, Self>) {
        run_planar(dynamics, task);
    }
}

fn run_planar<T: Lanewise>(dynamics: &mut PlanarDynamics<T>, task: PlanarTask<'_, T>) {
    match task {
        PlanarTask::Motion(Task::Factorise(step)) if step.trial.loads.loads_points() => {
            dispatch(PlanarFactorisation::<_, true> { dynamics, step });
        }
        PlanarTask::Motion(Task::Factorise(step)) => {
            dispatch(PlanarFactorisation::<_, false> { dynamics, step })
        }
        task => dispatch(PlanarRecursion { dynamics, task }),
    }
}

/// Factorisation of the matrices of a motion and of its variation, for a chain with or without
/// loads at points of its segments.
struct PlanarFactorisation<'a, T, const POINTS: bool> {
    dynamics: &'a mut PlanarDynamics<T>,
    step: Factorise<'a, T>,
}

impl<T: Lanewise, const POINTS: bool> Loop for PlanarFactorisation<'_, T, POINTS> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let Self { dynamics, step } = self;
        let posture = Planar::new(&dynamics.chain, &dynamics.angles, step.trial.at);
        step_matrix::factorise::<T, _, 1, 2, POINTS>(&mut dynamics.memory, &posture, &step);
        let posture = Lateral {
            planar: posture,
            motion: &dynamics.memory,
        };
        step_matrix::factorise::<T, _, 1, 1, POINTS>(&mut dynamics.lateral, &posture, &step);
    }
}

/// Task with its chain.
struct PlanarRecursion<'a, T> {
    dynamics: &'a mut PlanarDynamics<T>,
    task: PlanarTask<'a, T>,
}

impl<T: Lanewise> Loop for PlanarRecursion<'_, T> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let PlanarDynamics {
            chain,
            angles,
            memory,
            lateral,
        } = self.dynamics;
        let (chain, n) = (&*chain, chain.segments());
        match self.task {
            PlanarTask::Motion(task) => {
                if let Some(q) = task.new_coordinates() {
                    T::azimuthal_sines_and_cosines(&q[..n], &mut angles[..n]);
                }
                recursion::perform(memory, n, |at| Planar::new(chain, angles, at), task);
            }
            PlanarTask::Lateral(at, loads, result) => {
                let posture = Lateral {
                    planar: Planar::new(chain, angles, at),
                    motion: memory,
                };
                recursion::accelerations(lateral, &posture, loads, result);
            }
            PlanarTask::Variation(trial, weights, correction) => {
                let posture = Planar::new(chain, angles, trial.at);
                if !trial.loads.is_empty() {
                    recursion::shift::<T, Planar<'_, T>, 1, 2>(memory, n, correction, weights);
                    recursion::load(memory, &posture, trial.loads);
                }
                let posture = Lateral {
                    planar: posture,
                    motion: memory,
                };
                recursion::correction(lateral, &posture, trial, correction);
            }
        }
    }
}
