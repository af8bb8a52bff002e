//! Equations of motion of a chain in space.
//!
//! The methods of [`Dynamics`] run the recursions with the machine's widest instructions
//! ([`super::dispatch`]).

use super::chain::{Link, turned};
use super::chart::{self, BodyRotation, JointSide, PolarAxis, PoleError, find_pole};
use super::dispatch::{Loop, dispatch};
use super::kernels::{
    self, ClampEnergy, Joint, JointEnergy, JointTangent, Segment, SegmentEnergy, SegmentTangent,
};
use super::linear::{add, in_lane, product, sub_matrices, zero};
use super::memory::Memory;
use super::posture::{
    ChainNodes, Energetic, LoadTangent, LoadedPoint, Placed, PointChange, Posture, RootMotion,
};
use super::recursion;
use super::step_matrix;
use super::tasks::{ChainDynamics, Factorise, Task};
use super::{
    Chain, ChainState, Clamp, Energies, Lanes, Lanewise, NodeLoads, NodeTangent, PointLoad,
    PointTangent, Real, StepWeights,
};

/// Equations of motion of one chain, or of one chain per lane, with the memory for their
/// recursions.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. `q` holds `[φ, θ]` in rad, about the
/// polar axis [`Dynamics::chart`] in all lanes. Nodes, loads and clamp are in the frame `(x, y, z)`
/// in the public interface.
#[derive(Clone, Debug)]
pub struct Dynamics<T> {
    chain: Chain<T>,
    chart: PolarAxis,
    angles: Vec<[T; 4]>,
    memory: Memory<T, 2, 3>,
}

impl<T: Real> Dynamics<T> {
    /// Creates the dynamics of `chain`, with all coordinates about `z`.
    ///
    /// # Panics
    /// If the chain has no segment.
    pub fn new(chain: Chain<T>) -> Self {
        let n = chain.segments();
        assert!(n > 0, "a chain has at least one segment");
        let angles = vec![[T::ZERO; 4]; n];
        Self {
            chain,
            chart: PolarAxis::default(),
            angles,
            memory: Memory::new(n),
        }
    }

    /// Returns the constants.
    pub fn chain(&self) -> &Chain<T> {
        &self.chain
    }

    /// Returns the constants, to be replaced by others with the same number of segments.
    pub fn chain_mut(&mut self) -> &mut Chain<T> {
        &mut self.chain
    }

    /// Returns the polar axis of the coordinates.
    pub fn chart(&self) -> PolarAxis {
        self.chart
    }

    /// Takes coordinates about `chart` from now on. The caller converts them
    /// ([`PolarAxis::coordinates`]).
    ///
    /// # Panics
    /// If joints of the chain are relaxed at an angle, and `chart` is not about `z`.
    pub fn set_chart(&mut self, chart: PolarAxis) {
        if chart != self.chart {
            assert!(
                chart == PolarAxis::Z || self.chain.is_relaxed_straight(),
                "bent filaments have coordinates about z"
            );
            self.chart = chart;
        }
    }

    /// Returns the positions of the nodes `r_1 … r_n` in m, at the state of the last
    /// [`ChainDynamics::place`], [`ChainDynamics::track`] or [`ChainDynamics::residual`].
    pub fn positions(&self) -> &[[T; 3]] {
        &self.memory.positions
    }

    /// Returns position in m and velocity in m/s of the node `r_{k+1}`, for `k = node`, at the same
    /// state.
    pub fn node(&self, node: usize) -> [[T; 3]; 2] {
        [self.memory.positions[node], self.memory.velocities[node]]
    }

    /// Returns the velocities of the nodes in m/s, at the same state.
    pub fn velocities(&self) -> &[[T; 3]] {
        &self.memory.velocities
    }

    /// Returns the force that the clamp exerts on the root in N, from the last
    /// [`ChainDynamics::residual`].
    pub fn root_force(&self) -> [T; 3] {
        self.memory.root_force
    }

    /// Returns the acceleration of the node `r_{k+1}` in m/s², for `k = node`, at the `q̈` of the
    /// last [`ChainDynamics::track`] or [`ChainDynamics::residual`].
    pub fn node_acceleration(&self, node: usize) -> [T; 3] {
        add(self.memory.base_accelerations[node + 1], self.chain.gravity)
    }
}

/// Chain in space at one state.
struct Spatial<'a, T> {
    length: T,
    gravity: [T; 3],
    links: &'a [Link<T>],
    axis: PolarAxis,
    angles: &'a [[T; 4]],
    v: &'a [[T; 2]],
    clamp: &'a Clamp<T>,
    body: BodyRotation<T>,
}

impl<'a, T: Lanewise> Spatial<'a, T> {
    #[inline(always)]
    fn new(
        chain: &'a Chain<T>,
        axis: PolarAxis,
        angles: &'a [[T; 4]],
        ChainState { clamp, v, .. }: ChainState<'a, T>,
    ) -> Self {
        let n = chain.segments();
        Self {
            length: chain.length,
            gravity: chain.gravity,
            links: &chain.links[..n],
            axis,
            angles: &angles[..n],
            v: &v[..n],
            clamp,
            body: BodyRotation::new(clamp.angular_velocity, axis),
        }
    }

    /// Returns the side of a joint on segment `k`.
    #[inline(always)]
    fn side(&self, k: usize) -> JointSide<'a, T> {
        let angles = &self.angles[k];
        JointSide {
            angles,
            rates: self.body.seen_from(angles, self.v[k]),
        }
    }

    /// Returns `ē_0` in the chart.
    #[inline(always)]
    fn relaxed_clamp(&self) -> [T; 3] {
        self.clamp.relaxed(self.axis, &self.links[0].relaxed_angle)
    }

    #[inline(always)]
    fn clamp_torque(&self, link: &Link<T>) -> [T; 2] {
        kernels::clamp(self.relaxed_clamp(), self.side(0).whole(), link.joint()).next
    }

    #[inline(always)]
    fn clamp_energy(&self) -> ClampEnergy<T> {
        let (side, link) = (self.side(0), &self.links[0]);
        let relaxed_rate = self
            .axis
            .from_frame(turned(self.clamp.direction_rate, &link.relaxed_angle));
        kernels::clamp_energy(
            self.relaxed_clamp(),
            side.whole(),
            link.joint(),
            relaxed_rate,
        )
    }

    /// Returns [`Energies::clamp_torque_power`]. As `D` depends on the rates in the body only,
    /// `Ω·∂D/∂Ω` is the power of the dampers on segments that turn rigidly with the body.
    fn clamp_torque_power(&self) -> T {
        let rigid = |k: usize, torque: [T; 2]| {
            let rates = self.body.rigid_rates(&self.angles[k]);
            rates[0] * torque[0] + rates[1] * torque[1]
        };
        let mut power = self.clamp_energy().power
            + rigid(0, self.clamp_torque(&self.links[0].without_spring()));
        for k in 1..self.links.len() {
            let Joint { previous, next } =
                chart::damper_torques(self.side(k - 1), self.side(k), &self.links[k]);
            power = power + rigid(k - 1, previous) + rigid(k, next);
        }
        power
    }
}

impl<T: Lanewise> Energetic<T, 2, 3> for Spatial<'_, T> {
    #[inline(always)]
    fn segment_energy(&self, k: usize, position: [T; 3], velocity: [T; 3]) -> SegmentEnergy<T> {
        let axis = self.axis;
        let [x, x_rate, g] =
            [position, velocity, self.gravity].map(|vector| axis.from_frame(vector));
        kernels::segment_energy(
            self.angles[k],
            self.v[k],
            x,
            x_rate,
            g,
            self.links[k].segment(self.length),
        )
    }

    #[inline(always)]
    fn inner_joint_energy(&self, k: usize) -> JointEnergy<T> {
        if k > 0 {
            return chart::joint_energy(self.side(k - 1), self.side(k), &self.links[k]);
        }
        let ClampEnergy {
            spring,
            dissipation,
            ..
        } = self.clamp_energy();
        JointEnergy {
            spring,
            dissipation,
        }
    }
}

impl<T: Lanewise> Posture<T, 2, 3> for Spatial<'_, T> {
    #[inline(always)]
    fn segments(&self) -> usize {
        self.links.len()
    }

    #[inline(always)]
    fn mass(&self, k: usize) -> T {
        self.links[k].mass
    }

    #[inline(always)]
    fn root(&self) -> RootMotion<T, 3> {
        self.clamp.root(self.gravity)
    }

    #[inline(always)]
    fn take(block: [T; 2]) -> [T; 2] {
        block
    }

    #[inline(always)]
    fn put(block: &mut [T; 2], values: [T; 2]) {
        *block = values;
    }

    #[inline(always)]
    fn in_frame(vector: [T; 3]) -> [T; 3] {
        vector
    }

    #[inline(always)]
    fn components(vector: [T; 3]) -> [T; 3] {
        vector
    }

    #[inline(always)]
    fn segment(&self, k: usize) -> Segment<T, 2, 3> {
        let segment = kernels::segment(
            self.angles[k],
            self.v[k],
            self.links[k].segment(self.length),
        );
        match self.axis {
            PolarAxis::Z => segment,
            axis => chart::segment_to_frame(axis, segment),
        }
    }

    #[inline(always)]
    fn inner_joint(&self, k: usize) -> Joint<T, 2> {
        if k > 0 {
            return chart::joint(self.side(k - 1), self.side(k), &self.links[k]);
        }
        Joint {
            previous: zero(),
            next: self.clamp_torque(&self.links[0]),
        }
    }

    #[inline(always)]
    fn load(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        [position, velocity]: [[T; 3]; 2],
    ) -> Option<[T; 3]> {
        loads.force(k, position, velocity)
    }

    #[inline(always)]
    fn segment_tangent(
        &self,
        k: usize,
        accelerations: [T; 2],
        base_acceleration: [T; 3],
        outer_force: [T; 3],
        weights: StepWeights<T>,
    ) -> SegmentTangent<T, 2, 3> {
        let axis = self.axis;
        let mut tangent = kernels::segment_tangent(
            self.angles[k],
            self.v[k],
            accelerations,
            axis.from_frame(base_acceleration),
            axis.from_frame(outer_force),
            self.links[k].segment(self.length),
            weights,
        );
        if axis != PolarAxis::Z {
            tangent.base_force = axis.to_frame(tangent.base_force);
            tangent.outer_acceleration = axis.to_frame(tangent.outer_acceleration);
        }
        tangent
    }

    #[inline(always)]
    fn inner_joint_tangent(&self, k: usize, weights: StepWeights<T>) -> JointTangent<T, 2> {
        if k > 0 {
            return chart::joint_tangent(
                self.side(k - 1),
                self.side(k),
                &self.links[k],
                &self.body,
                weights,
            );
        }
        let (relaxed, side, link) = (self.relaxed_clamp(), self.side(0), &self.links[0]);
        let tangent = |link: &Link<T>, weights: StepWeights<T>| {
            kernels::clamp_tangent(relaxed, side.whole(), link.joint(), weights).next_next
        };
        let next_next = tangent(link, weights);
        JointTangent::at_clamp(match self.body.slopes(&side, weights.coordinates) {
            None => next_next,
            Some(slopes) => {
                let by_rates = tangent(&link.without_spring(), StepWeights::of_rates());
                sub_matrices(&next_next, &product(&by_rates, &slopes))
            }
        })
    }

    #[inline(always)]
    fn load_tangent(
        &self,
        loads: &dyn NodeLoads<T>,
        k: usize,
        node: [[T; 3]; 2],
    ) -> Option<LoadTangent<T, 3>> {
        let [position, velocity] = node;
        loads.tangent(k, position, velocity).map(LoadTangent::from)
    }

    #[inline(never)]
    fn points(
        &self,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, 3>,
        apply: &mut dyn FnMut(LoadedPoint<T, 3>),
    ) {
        let nodes = Placed {
            clamp: self.clamp,
            nodes,
        };
        loads.point_loads(&nodes, &mut |PointLoad {
                                            segment,
                                            fraction,
                                            force,
                                        }| {
            apply(LoadedPoint {
                segment,
                fraction,
                force,
            });
        });
    }

    #[inline(never)]
    fn point_changes(
        &self,
        loads: &dyn NodeLoads<T>,
        nodes: ChainNodes<'_, T, 3>,
        apply: &mut dyn FnMut(PointChange<T, 3>),
    ) {
        let nodes = Placed {
            clamp: self.clamp,
            nodes,
        };
        loads.point_tangents(&nodes, &mut |PointTangent { segment, ends }| {
            apply(PointChange {
                segment,
                ends: ends.map(|ends| ends.map(LoadTangent::from)),
            });
        });
    }
}

impl<T> From<NodeTangent<T>> for LoadTangent<T, 3> {
    #[inline(always)]
    fn from(NodeTangent { position, velocity }: NodeTangent<T>) -> Self {
        Self { position, velocity }
    }
}

impl<T: SpatialLoops> ChainDynamics<T> for Dynamics<T> {
    fn run(&mut self, task: Task<'_, T>) {
        T::run(self, task);
    }
}

impl<T: Lanewise> Dynamics<T> {
    /// Returns energies, dissipation and clamp power at the state of the last call that took `(q,
    /// q̇)`.
    pub fn energies(&self, at: ChainState<'_, T>) -> Energies<T> {
        let posture = Spatial::new(&self.chain, self.chart, &self.angles, at);
        recursion::energies(&self.memory, &posture, posture.clamp_torque_power())
    }

    /// Returns position in m and velocity in m/s of a node in one lane; see [`Dynamics::node`].
    #[inline]
    pub fn node_in_lane(&self, node: usize, lane: usize) -> [[f64; 3]; 2] {
        [
            in_lane(&self.memory.positions[node], lane),
            in_lane(&self.memory.velocities[node], lane),
        ]
    }

    /// Returns position, velocity and acceleration of a node in one lane, when
    /// [`Dynamics::node_acceleration`] is valid.
    #[inline]
    pub fn node_motion(&self, node: usize, lane: usize) -> [[f64; 3]; 3] {
        let base = in_lane(&self.memory.base_accelerations[node + 1], lane);
        let acceleration = add(base, in_lane(&self.chain.gravity, lane));
        [
            in_lane(&self.memory.positions[node], lane),
            in_lane(&self.memory.velocities[node], lane),
            acceleration,
        ]
    }
}

impl Dynamics<f64> {
    /// Refuses coordinates at a pole of their chart, within `|sin φ| <` [`POLE`](super::POLE).
    ///
    /// The accelerations at a pole are not finite, or have no correct digit. Callers that accept a
    /// state from outside check it here first.
    ///
    /// # Errors
    /// The first segment at a pole.
    pub fn check_poles(&self, q: &[[f64; 2]]) -> Result<(), PoleError> {
        match find_pole(q) {
            Some(k) => Err(PoleError {
                segment: k + 1,
                polar_angle: q[k][0],
                axis: self.chart,
            }),
            None => Ok(()),
        }
    }
}

/// Numbers for which the loops over a chain in space are compiled.
pub trait SpatialLoops: Lanewise {
    #[doc(hidden)]
    fn run(dynamics: &mut Dynamics<Self>, task: Task<'_, Self>);
}

impl SpatialLoops for f64 {
    fn run(dynamics: &mut Dynamics<Self>, task: Task<'_, Self>) {
        run(dynamics, task);
    }
}

impl SpatialLoops for Lanes {
    fn run(dynamics: &mut Dynamics<Self>, task: Task<'_, Self>) {
        run(dynamics, task);
    }
}

/// Runs a task. The largest loops have functions of their own: a single one for all would take the
/// compiler several times as long.
fn run<T: Lanewise>(dynamics: &mut Dynamics<T>, task: Task<'_, T>) {
    match task {
        Task::Factorise(step) if step.trial.loads.loads_points() => {
            dispatch(Factorisation::<_, true> { dynamics, step })
        }
        Task::Factorise(step) => dispatch(Factorisation::<_, false> { dynamics, step }),
        task => dispatch(Recursion { dynamics, task }),
    }
}

/// Factorisation of a chain with or without loads at points of its segments.
struct Factorisation<'a, T, const POINTS: bool> {
    dynamics: &'a mut Dynamics<T>,
    step: Factorise<'a, T>,
}

impl<T: Lanewise, const POINTS: bool> Loop for Factorisation<'_, T, POINTS> {
    type Output = ();

    const LANES: usize = T::LANES;

    #[inline(always)]
    fn run(self) {
        let Self { dynamics, step } = self;
        let posture = Spatial::new(
            &dynamics.chain,
            dynamics.chart,
            &dynamics.angles,
            step.trial.at,
        );
        step_matrix::factorise::<T, _, 2, 3, POINTS>(&mut dynamics.memory, &posture, &step);
    }
}

/// Task with its chain.
struct Recursion<'a, T> {
    dynamics: &'a mut Dynamics<T>,
    task: Task<'a, T>,
}

impl<T: Lanewise> Loop for Recursion<'_, T> {
    type Output = ();

    const LANES: usize = T::LANES;

    /// Passes references to the functions of [`recursion`], as they tell the compiler that
    /// arguments do not overlap. It cannot know this of fields.
    #[inline(always)]
    fn run(self) {
        let Dynamics {
            chain,
            chart,
            angles,
            memory,
        } = self.dynamics;
        let (n, axis) = (chain.segments(), *chart);
        if let Some(q) = self.task.new_coordinates() {
            T::sines_and_cosines(&q[..n], &mut angles[..n]);
        }
        recursion::perform(
            memory,
            n,
            |at| Spatial::new(&*chain, axis, angles, at),
            self.task,
        );
    }
}
