//! Queries of the equations of motion of a chain, whatever its coordinates.

use super::{ChainState, LaneSet, Lanewise, NodeLoads, StepWeights};

/// Equations of motion of one chain, or of one per lane: [`Dynamics`](super::Dynamics) in space,
/// [`PlanarDynamics`](super::PlanarDynamics) in the plane of rotation.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. The equations define the contents of
/// a block of coordinates.
pub trait ChainDynamics<T: Lanewise> {
    #[doc(hidden)]
    fn run(&mut self, task: Task<'_, T>);

    /// Computes angles, positions and velocities at `(q, q̇)`, without forces.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn place(&mut self, at: ChainState<'_, T>) {
        self.run(Task::Place(at));
    }

    /// Extends [`ChainDynamics::place`] by the accelerations of the nodes at `q̈`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn track(&mut self, at: ChainState<'_, T>, accelerations: &[[T; 2]]) {
        self.run(Task::Track(at, accelerations));
    }

    /// Returns [`Energies::dissipation`](super::Energies::dissipation) alone in W, at the `q` of
    /// the last call that took it.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn dissipation(&mut self, at: ChainState<'_, T>) -> T {
        let mut result = T::ZERO;
        self.run(Task::Dissipation(at, &mut result));
        result
    }

    /// Moves the nodes for a `correction` (rad/s²) that is subtracted from the `q̈` of the last
    /// [`ChainDynamics::residual`]; its products with `weights` are subtracted from `q̇` and `q`.
    ///
    /// This is first order in the correction. In the velocities, `w_v |q̇|` is neglected compared
    /// with one.
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    fn shift(&mut self, correction: &[[T; 2]], weights: StepWeights<T>) {
        self.run(Task::Shift(correction, weights));
    }

    /// Writes the displacements of the nodes (m) for a small `change` of the coordinates (rad), at
    /// the state of the last [`ChainDynamics::residual`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn displacements(&mut self, change: &[[T; 2]], displacements: &mut [[T; 3]]) {
        self.run(Task::Displacements(change, displacements));
    }

    /// Writes the generalised forces of `forces` (N) on the nodes into `torques` (N m), at the
    /// state of the last [`ChainDynamics::residual`]: the transpose of
    /// [`ChainDynamics::displacements`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn torques(&mut self, forces: &[[T; 3]], torques: &mut [[T; 2]]) {
        self.run(Task::Torques(forces, torques));
    }

    /// Computes `q̈` in rad/s² at the state `(q, q̇)`.
    ///
    /// The result is exact up to rounding: `M q̈ = f + Q` is solved by elimination from the tip to
    /// the root, without forming `M`. Joint torques are exact to one rounding of `c`. Small
    /// components in a nearly straight filament therefore have an error of some 1e-16 of the torque
    /// at a bend of one radian.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn accelerations(
        &mut self,
        at: ChainState<'_, T>,
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        self.run(Task::Accelerations(at, loads, accelerations));
    }

    /// Computes the residual `M q̈ − f − Q` in N m at `(q, q̇, q̈)`, without forming `M`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn residual(
        &mut self,
        at: ChainState<'_, T>,
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        residual: &mut [[T; 2]],
    ) {
        self.run(Task::Residual(
            TrialAccelerations {
                at,
                accelerations,
                loads,
            },
            residual,
        ));
    }

    /// Computes [`ChainDynamics::residual`] and [`ChainDynamics::solve`] in one: `correction` is
    /// the change of `q̈` (rad/s²) that Newton's method subtracts, with the matrix of the last
    /// [`ChainDynamics::factorise`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn correction(
        &mut self,
        at: ChainState<'_, T>,
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        correction: &mut [[T; 2]],
    ) {
        self.run(Task::Correction(
            TrialAccelerations {
                at,
                accelerations,
                loads,
            },
            correction,
        ));
    }

    /// Solves the factorised system for `right_side` (N m), which becomes the change of `q̈`
    /// (rad/s²).
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    fn solve(&mut self, right_side: &mut [[T; 2]]) {
        self.run(Task::Solve(right_side));
    }

    /// Factorises the Jacobian of Newton's method, `∂(residual)/∂q̈` along a step of the given
    /// weights, at the state of the last [`ChainDynamics::residual`]. That call must have had the
    /// same arguments.
    ///
    /// Lanes outside `lanes` keep their matrix.
    ///
    /// The matrix is exact except for one approximation: a loaded node is assumed to move by `w_q
    /// δẍ`, and at `w_v δẍ`. This neglects `2 w_v |q̇|` compared with one. Newton's method
    /// converges to the same solution.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn factorise(
        &mut self,
        at: ChainState<'_, T>,
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        lanes: LaneSet,
    ) {
        self.run(Task::Factorise(Factorise {
            trial: TrialAccelerations {
                at,
                accelerations,
                loads,
            },
            weights,
            lanes,
        }));
    }
}

/// Task for [`ChainDynamics`]: method of the same name, with its arguments; the last one takes the
/// result.
pub enum Task<'a, T> {
    Place(ChainState<'a, T>),
    Track(ChainState<'a, T>, &'a [[T; 2]]),
    Accelerations(ChainState<'a, T>, &'a dyn NodeLoads<T>, &'a mut [[T; 2]]),
    Residual(TrialAccelerations<'a, T>, &'a mut [[T; 2]]),
    Correction(TrialAccelerations<'a, T>, &'a mut [[T; 2]]),
    Factorise(Factorise<'a, T>),
    Solve(&'a mut [[T; 2]]),
    Shift(&'a [[T; 2]], StepWeights<T>),
    Displacements(&'a [[T; 2]], &'a mut [[T; 3]]),
    Torques(&'a [[T; 3]], &'a mut [[T; 2]]),
    Dissipation(ChainState<'a, T>, &'a mut T),
}

/// Trial accelerations at a state, under loads.
#[derive(Clone, Copy)]
pub struct TrialAccelerations<'a, T> {
    pub at: ChainState<'a, T>,
    pub accelerations: &'a [[T; 2]],
    pub loads: &'a dyn NodeLoads<T>,
}

/// Arguments of [`ChainDynamics::factorise`].
pub struct Factorise<'a, T> {
    pub trial: TrialAccelerations<'a, T>,
    pub weights: StepWeights<T>,
    pub lanes: LaneSet,
}

impl<'a, T> Task<'a, T> {
    /// Returns the coordinates of a task at a new point; other tasks are at the point of an earlier
    /// one.
    pub(super) fn new_coordinates(&self) -> Option<&'a [[T; 2]]> {
        match self {
            Self::Place(at) | Self::Track(at, _) | Self::Accelerations(at, ..) => Some(at.q),
            Self::Residual(trial, _) | Self::Correction(trial, _) => Some(trial.at.q),
            _ => None,
        }
    }
}
