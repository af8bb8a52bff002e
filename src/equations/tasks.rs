//! What the equations of motion of a chain can be asked for, whatever its coordinates are.

use super::{Clamp, Compiled, LaneSet, NodeLoads, StepWeights};

/// Equations of motion of one chain, or of one per lane: [`Dynamics`](super::Dynamics) in space,
/// [`PlanarDynamics`](super::PlanarDynamics) in the plane of rotation.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. What a block of coordinates holds is for the equations to say.
pub trait ChainDynamics<T: Compiled> {
    #[doc(hidden)]
    fn run(&mut self, task: Task<'_, T>);

    /// Angles, positions and velocities at `(q, q̇)`, without forces.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn place(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) {
        self.run(Task::Place { clamp, q, v });
    }

    /// Like [`ChainDynamics::place`], with the accelerations of the nodes at `q̈`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn track(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) {
        self.run(Task::Track { clamp, q, v, accelerations });
    }

    /// The [`Energies::dissipation`](super::Energies::dissipation) alone in W, at the `q` of the last call that took it.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn dissipation(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) -> T {
        let mut result = T::from_f64(0.0);
        self.run(Task::Dissipation { clamp, q, v, result: &mut result });
        result
    }

    /// Moves the nodes to their positions after `correction` (rad/s²) is subtracted from the `q̈` of the last
    /// [`ChainDynamics::residual`], and its products with `weights` from `q̇` and `q`.
    ///
    /// This is first order in the correction. In the velocities, `w_v |q̇|` is neglected compared with one.
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    fn shift(&mut self, correction: &[[T; 2]], weights: StepWeights<T>) {
        self.run(Task::Shift { correction, weights });
    }

    /// How the nodes move with a small `change` of the coordinates (rad), into `displacements` (m), at the state of the last
    /// [`ChainDynamics::residual`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn displacements(&mut self, change: &[[T; 2]], displacements: &mut [[T; 3]]) {
        self.run(Task::Displacements { change, result: displacements });
    }

    /// The generalised forces of `forces` (N) on the nodes, into `torques` (N m), at the state of the last
    /// [`ChainDynamics::residual`]: the transpose of [`ChainDynamics::displacements`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn torques(&mut self, forces: &[[T; 3]], torques: &mut [[T; 2]]) {
        self.run(Task::Torques { forces, result: torques });
    }

    /// Accelerations `q̈` in rad/s² at the state `(q, q̇)`, into `accelerations`.
    ///
    /// Exact up to rounding: solves `M q̈ = f + Q` by elimination from the tip to the root, without
    /// forming `M`. Joint torques are exact to one rounding of `c`. In a nearly straight filament, small
    /// components are therefore known to some 1e-16 of the torque at a bend of one radian.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn accelerations(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        self.run(Task::Accelerations { clamp, q, v, loads, result: accelerations });
    }

    /// `M q̈ − f − Q` in N m at `(q, q̇, q̈)`, into `residual`, without forming `M`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn residual(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        residual: &mut [[T; 2]],
    ) {
        self.run(Task::Residual { clamp, q, v, accelerations, loads, result: residual });
    }

    /// [`ChainDynamics::residual`] and [`ChainDynamics::solve`] in one: into `correction` the change of `q̈` (rad/s²) that Newton's method
    /// subtracts, with the matrix of the last [`ChainDynamics::factorise`].
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    fn correction(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        correction: &mut [[T; 2]],
    ) {
        self.run(Task::Correction { clamp, q, v, accelerations, loads, result: correction });
    }

    /// Solves the factorised system for `right_side` (N m), which becomes the change of `q̈` (rad/s²).
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    fn solve(&mut self, right_side: &mut [[T; 2]]) {
        self.run(Task::Solve { right_side });
    }

    /// Factorises the matrix of Newton's method, `∂(residual)/∂q̈` along a step of the given weights, at the
    /// state of the last [`ChainDynamics::residual`], which must have been called with the same arguments.
    ///
    /// Only in `lanes`: the others keep their matrix.
    ///
    /// The matrix is exact except for one approximation: a loaded node is assumed to move by `w_q δẍ` (and at
    /// `w_v δẍ`). This neglects `2 w_v |q̇|` compared with one. Newton's method converges to the same solution.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    #[allow(clippy::too_many_arguments, reason = "a state, its loads, and a step")]
    fn factorise(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        lanes: LaneSet,
    ) {
        self.run(Task::Factorise(Factorise { clamp, q, v, accelerations, loads, weights, lanes }));
    }
}

/// A task for [`ChainDynamics`]: a method of the same name, with its arguments.
pub enum Task<'a, T> {
    Place {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
    },
    Track {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        accelerations: &'a [[T; 2]],
    },
    Accelerations {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        loads: &'a dyn NodeLoads<T>,
        result: &'a mut [[T; 2]],
    },
    Residual {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        accelerations: &'a [[T; 2]],
        loads: &'a dyn NodeLoads<T>,
        result: &'a mut [[T; 2]],
    },
    Correction {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        accelerations: &'a [[T; 2]],
        loads: &'a dyn NodeLoads<T>,
        result: &'a mut [[T; 2]],
    },
    Factorise(Factorise<'a, T>),
    Solve {
        right_side: &'a mut [[T; 2]],
    },
    Shift {
        correction: &'a [[T; 2]],
        weights: StepWeights<T>,
    },
    Displacements {
        change: &'a [[T; 2]],
        result: &'a mut [[T; 3]],
    },
    Torques {
        forces: &'a [[T; 3]],
        result: &'a mut [[T; 2]],
    },
    Dissipation {
        clamp: &'a Clamp<T>,
        q: &'a [[T; 2]],
        v: &'a [[T; 2]],
        result: &'a mut T,
    },
}

/// The arguments of [`ChainDynamics::factorise`].
pub struct Factorise<'a, T> {
    pub clamp: &'a Clamp<T>,
    pub q: &'a [[T; 2]],
    pub v: &'a [[T; 2]],
    pub accelerations: &'a [[T; 2]],
    pub loads: &'a dyn NodeLoads<T>,
    pub weights: StepWeights<T>,
    pub lanes: LaneSet,
}

impl<'a, T> Task<'a, T> {
    /// The coordinates of a task at a new point. The others are about the point of an earlier task.
    pub(super) fn new_coordinates(&self) -> Option<&'a [[T; 2]]> {
        match self {
            Self::Place { q, .. }
            | Self::Track { q, .. }
            | Self::Accelerations { q, .. }
            | Self::Residual { q, .. }
            | Self::Correction { q, .. } => Some(q),
            Self::Factorise(_)
            | Self::Solve { .. }
            | Self::Shift { .. }
            | Self::Displacements { .. }
            | Self::Torques { .. }
            | Self::Dissipation { .. } => None,
        }
    }
}
