//! The equations of a pass: in space, or in the plane of rotation.

use crate::equations::{
    Chain, ChainDynamics, ChainState, Compiled, Dynamics, Energies, NodeLoads, PlanarDynamics,
    PolarAxis, StepWeights, Task,
};
use crate::integrate::hermite::Knot;

/// Form of the equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Form {
    /// Each segment has a polar angle and an azimuth. A block of coordinates is `[φ, θ]`.
    Spatial,
    /// Each segment has an azimuth; its polar angle is `π/2`. A block of coordinates is `[η, θ]`,
    /// where `η = ∂φ/∂τ` is the lateral variation: the change of the polar angle with a small tilt
    /// `τ` of the clamp, out of the plane and towards `+z`.
    Planar,
}

/// Equations of one chain, or of one per lane.
#[allow(clippy::large_enum_variant, reason = "a pass has one")]
#[derive(Clone, Debug)]
pub(crate) enum FilamentEquations<T> {
    Spatial(Dynamics<T>),
    Planar(PlanarDynamics<T>),
}

/// Evaluates an expression for either form.
macro_rules! each {
    ($equations:expr, $dynamics:ident => $result:expr) => {
        match $equations {
            FilamentEquations::Spatial($dynamics) => $result,
            FilamentEquations::Planar($dynamics) => $result,
        }
    };
}

impl<T: Compiled> ChainDynamics<T> for FilamentEquations<T> {
    fn run(&mut self, task: Task<'_, T>) {
        each!(self, dynamics => dynamics.run(task));
    }
}

impl<T: Compiled> FilamentEquations<T> {
    pub fn new(form: Form, chain: Chain<T>) -> Self {
        match form {
            Form::Spatial => Self::Spatial(Dynamics::new(chain)),
            Form::Planar => Self::Planar(PlanarDynamics::new(chain)),
        }
    }

    pub fn form(&self) -> Form {
        match self {
            Self::Spatial(_) => Form::Spatial,
            Self::Planar(_) => Form::Planar,
        }
    }

    pub fn segments(&self) -> usize {
        each!(self, dynamics => dynamics.chain().segments())
    }

    /// Returns the constants.
    pub fn chain(&self) -> &Chain<T> {
        each!(self, dynamics => dynamics.chain())
    }

    /// Returns the constants, to be replaced by others with the same number of segments.
    pub fn chain_mut(&mut self) -> &mut Chain<T> {
        each!(self, dynamics => dynamics.chain_mut())
    }

    /// Returns the chart of the coordinates, the default for planar ones.
    pub fn chart(&self) -> PolarAxis {
        match self {
            Self::Spatial(dynamics) => dynamics.chart(),
            Self::Planar(_) => PolarAxis::default(),
        }
    }

    pub fn set_chart(&mut self, chart: PolarAxis) {
        if let Self::Spatial(dynamics) = self {
            dynamics.set_chart(chart);
        }
    }

    /// Returns position in m and velocity in m/s of a node in one lane, where the nodes were last
    /// placed.
    pub fn node(&self, node: usize, lane: usize) -> [[f64; 3]; 2] {
        each!(self, dynamics => dynamics.node_in_lane(node, lane))
    }

    /// Writes position, velocity and acceleration of every node in one lane, after
    /// [`ChainDynamics::track`] or [`ChainDynamics::residual`].
    pub fn nodes(&self, lane: usize, knots: &mut [Knot<3>]) {
        each!(self, dynamics => for (node, knot) in knots.iter_mut().enumerate() {
            let [value, rate, acceleration] = dynamics.node_motion(node, lane);
            *knot = Knot { value, rate, acceleration };
        });
    }

    /// Writes positions in m and velocities in m/s of all nodes but the root, where they were last
    /// placed.
    pub fn nodes_in_lanes(&self, positions: &mut [[T; 3]], velocities: &mut [[T; 3]]) {
        each!(self, dynamics => for (k, (position, velocity)) in positions.iter_mut().zip(velocities).enumerate() {
            [*position, *velocity] = dynamics.node(k);
        });
    }

    pub fn root_force(&self) -> [T; 3] {
        each!(self, dynamics => dynamics.root_force())
    }

    /// Returns the energies at the state where the nodes were last placed.
    pub fn energies(&self, at: ChainState<'_, T>) -> Energies<T> {
        each!(self, dynamics => dynamics.energies(at))
    }

    /// Computes `q̈` of the motion and of its variation at a state, with `scratch` for one entry
    /// per segment.
    pub fn all_accelerations(
        &mut self,
        at: ChainState<'_, T>,
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
        scratch: &mut [[T; 2]],
    ) {
        match self {
            Self::Spatial(dynamics) => dynamics.accelerations(at, loads, accelerations),
            Self::Planar(dynamics) => {
                dynamics.accelerations(at, loads, accelerations);
                dynamics.residual(at, accelerations, loads, scratch);
                dynamics.lateral_accelerations(at, loads, accelerations);
            }
        }
    }

    /// Solves for the variation; only for planar equations.
    pub fn solve_variation(
        &mut self,
        at: ChainState<'_, T>,
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        correction: &mut [[T; 2]],
    ) {
        if let Self::Planar(dynamics) = self {
            dynamics.solve_variation(at, accelerations, loads, weights, correction);
        }
    }
}
