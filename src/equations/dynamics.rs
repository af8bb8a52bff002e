//! O(n) dynamics of a chain by recursion over its segments.
//!
//! The chain is a tree without branches. Seen from its inner end `x_{k−1}`, everything outside joint `k` is a
//! body that responds to an acceleration with a force. The recursion carries this response from the tip to the root (the
//! articulated-body recursion of Featherstone 1983, with 3 × 3 blocks because a node only translates). An
//! implicit step also couples neighbours through the joints. This widens the block to five: the three
//! components of the node and the two coordinates of the segment inside it.
//!
//! The methods of [`Dynamics`] run the recursions with the machine's widest instructions ([`super::dispatch`]).

use super::chart::{self, JointConstants, PolarAxis, PoleError, Side, find_pole};
use super::dispatch::{Loop, dispatch};
use super::linear::{
    add, add_matrices, invert, mul, mul_transposed, negative, product, scale, select, sub, sub_matrices,
    transposed_product, unrolled, zero, zero_matrix,
};
use super::{LANES, LaneSet, Lanes, Lanewise, Real, kernels};

/// The constants of a chain (MODEL's symbols in the descriptions).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<T> {
    /// Number of segments, `n`.
    pub segments: usize,
    /// Segment length `h` in m.
    pub length: T,
    /// Segment mass `m` in kg.
    pub mass: T,
    /// Transverse moment of inertia of a segment about its centre, `J` in kg m².
    pub inertia: T,
    /// Stiffness of the clamp joint, `c_1` in N m.
    pub root_stiffness: T,
    /// Stiffness of every other joint, `c_k` in N m.
    pub joint_stiffness: T,
    /// Damping of the clamp joint, `d_1` in N m s.
    pub root_damping: T,
    /// Damping of every other joint, `d_k` in N m s.
    pub joint_damping: T,
    /// Gravitational acceleration in m/s².
    pub gravity: [T; 3],
}

impl<T: Real> Chain<T> {
    fn root_joint(&self) -> JointConstants<T> {
        JointConstants { stiffness: self.root_stiffness, damping: self.root_damping }
    }

    fn joint(&self) -> JointConstants<T> {
        JointConstants { stiffness: self.joint_stiffness, damping: self.joint_damping }
    }
}

impl<T: Lanewise> Chain<T> {
    /// The constants of several chains with the same number of segments, one chain per lane.
    ///
    /// # Panics
    /// If their numbers of segments differ.
    pub fn from_lanes<'a>(chain: impl Fn(usize) -> &'a Chain<f64>) -> Self {
        let segments = chain(0).segments;
        assert!((0..T::LANES).all(|lane| chain(lane).segments == segments), "all lanes have one number of segments");
        let lanes = |value: fn(&Chain<f64>) -> f64| T::from_lanes(|lane| value(chain(lane)));
        Self {
            segments,
            length: lanes(|chain| chain.length),
            mass: lanes(|chain| chain.mass),
            inertia: lanes(|chain| chain.inertia),
            root_stiffness: lanes(|chain| chain.root_stiffness),
            joint_stiffness: lanes(|chain| chain.joint_stiffness),
            root_damping: lanes(|chain| chain.root_damping),
            joint_damping: lanes(|chain| chain.joint_damping),
            gravity: std::array::from_fn(|i| T::from_lanes(|lane| chain(lane).gravity[i])),
        }
    }
}

/// The prescribed motion of the clamp at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamp<T> {
    /// Position of the root, `r_0` in m.
    pub position: [T; 3],
    /// Velocity of the root, `ṙ_0` in m/s.
    pub velocity: [T; 3],
    /// Acceleration of the root, `r̈_0` in m/s².
    pub acceleration: [T; 3],
    /// Unit vector of the clamp, `e_0`.
    pub direction: [T; 3],
    /// Its rate, `ė_0` in 1/s.
    pub direction_rate: [T; 3],
}

impl<T: Real> Clamp<T> {
    /// `e_0` and `ė_0` in the order of a chart.
    #[inline(always)]
    fn about(&self, axis: PolarAxis) -> ([T; 3], [T; 3]) {
        (axis.from_frame(self.direction), axis.from_frame(self.direction_rate))
    }
}

impl<T: Lanewise> Clamp<T> {
    /// The motion of several clamps, one per lane.
    pub fn from_lanes(clamp: impl Fn(usize) -> Clamp<f64>) -> Self {
        let none = zero();
        let mut result =
            Self { position: none, velocity: none, acceleration: none, direction: none, direction_rate: none };
        for lane in 0..T::LANES {
            let clamp = clamp(lane);
            for i in 0..3 {
                result.position[i].set_lane(lane, clamp.position[i]);
                result.velocity[i].set_lane(lane, clamp.velocity[i]);
                result.acceleration[i].set_lane(lane, clamp.acceleration[i]);
                result.direction[i].set_lane(lane, clamp.direction[i]);
                result.direction_rate[i].set_lane(lane, clamp.direction_rate[i]);
            }
        }
        result
    }
}

/// How the load on a node changes with its position and velocity.
#[derive(Clone, Copy, Debug)]
pub struct NodeTangent<T> {
    /// `∂F/∂x` in N/m.
    pub position: [[T; 3]; 3],
    /// `∂F/∂ẋ` in N s/m.
    pub velocity: [[T; 3]; 3],
}

/// External forces on the nodes `r_1 … r_n` of a chain (index 0 is `r_1`).
pub trait NodeLoads<T> {
    /// True if no node carries a load.
    fn is_empty(&self) -> bool {
        false
    }

    /// The force on a node in N; `None` if there is none.
    fn force(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<[T; 3]>;

    /// Its derivatives; `None` where [`NodeLoads::force`] is `None`.
    fn tangent(&self, node: usize, position: [T; 3], velocity: [T; 3]) -> Option<NodeTangent<T>>;
}

/// A chain without loads.
#[derive(Clone, Copy, Debug)]
pub struct NoLoads;

impl<T> NodeLoads<T> for NoLoads {
    fn is_empty(&self) -> bool {
        true
    }

    fn force(&self, _: usize, _: [T; 3], _: [T; 3]) -> Option<[T; 3]> {
        None
    }

    fn tangent(&self, _: usize, _: [T; 3], _: [T; 3]) -> Option<NodeTangent<T>> {
        None
    }
}

/// How an implicit step moves coordinates and rates with the accelerations: `δq = w_q δq̈`, `δq̇ = w_v δq̈`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepWeights<T> {
    /// `w_q` in s².
    pub coordinates: T,
    /// `w_v` in s.
    pub rates: T,
}

/// Energies of a chain, and the powers that change them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies<T> {
    /// `E_kin` in J.
    pub kinetic: T,
    /// `E_spring` in J.
    pub spring: T,
    /// `E_grav` in J.
    pub gravity: T,
    /// The dissipation function `D` in W; the dampers take `2 D`.
    pub dissipation: T,
    /// Power of the torque at the clamp in W: `(∂E_spring/∂e_0 + ∂D/∂ė_0)·ė_0`.
    pub clamp_torque_power: T,
}

/// One segment's share of the factorised step matrix.
#[derive(Clone, Copy, Debug)]
struct Elimination<T> {
    /// Inverse of the 2 × 2 pivot.
    pivot: [[T; 2]; 2],
    /// Effect of the segment's own `δq̈` on the force at its inner node and the torque on its inner neighbour.
    force: [[T; 2]; 3],
    torque: [[T; 2]; 2],
    /// Effect of the inner node's `δẍ` and the inner neighbour's `δq̈` on the segment's own `δq̈`, with the pivot applied.
    from_node: [[T; 3]; 2],
    from_neighbour: [[T; 2]; 2],
    /// `∂ẍ'/∂q̈` along the step.
    outer: [[T; 2]; 3],
}

impl<T: Lanewise> Elimination<T> {
    /// `self` in `lanes`, `other` elsewhere.
    #[inline(always)]
    fn select(&self, lanes: LaneSet, other: &Self) -> Self {
        Self {
            pivot: select(lanes, &self.pivot, &other.pivot),
            force: select(lanes, &self.force, &other.force),
            torque: select(lanes, &self.torque, &other.torque),
            from_node: select(lanes, &self.from_node, &other.from_node),
            from_neighbour: select(lanes, &self.from_neighbour, &other.from_neighbour),
            outer: select(lanes, &self.outer, &other.outer),
        }
    }
}

/// The elimination's result for one segment, from which the accelerations follow.
#[derive(Clone, Copy, Debug)]
struct Response<T> {
    /// `q̈` with the inner node at rest.
    own: [T; 2],
    /// Effect of the inner node's acceleration on `q̈`.
    from_node: [[T; 3]; 2],
    /// `G` and `b` of [`kernels::segment`].
    jacobian: [[T; 2]; 3],
    bias: [T; 3],
}

/// Equations of motion of one chain, or of one chain per lane, with the memory for their recursions.
///
/// Arrays are indexed by segment; `0` is the one at the clamp. `q` holds `[φ, θ]` in rad, about the polar axis
/// that [`Dynamics::charts`] has for the segment (in all lanes). Nodes, loads and clamp are in the frame in the public
/// interface.
#[derive(Clone, Debug)]
pub struct Dynamics<T> {
    chain: Chain<T>,
    charts: Vec<PolarAxis>,
    angles: Vec<[T; 4]>,
    /// `G` of [`kernels::segment`].
    jacobians: Vec<[[T; 2]; 3]>,
    positions: Vec<[T; 3]>,
    velocities: Vec<[T; 3]>,
    /// Acceleration of the inner node of each segment and of the tip, minus gravity.
    base_accelerations: Vec<[T; 3]>,
    /// The force that each segment alone requires at its inner node.
    base_forces: Vec<[T; 3]>,
    /// The force that the chain outside each segment's outer node requires there.
    outer_forces: Vec<[T; 3]>,
    root_force: [T; 3],
    eliminations: Vec<Elimination<T>>,
    /// Scratch of [`Dynamics::solve`]: `δq̈` with the inner node and the inner neighbour at rest.
    partial: Vec<[T; 2]>,
    /// Scratch of [`Dynamics::accelerations`].
    responses: Vec<Response<T>>,
}

impl<T: Real> Dynamics<T> {
    /// Memory for `chain`, with all coordinates about `z`.
    ///
    /// # Panics
    /// If the chain has no segment.
    pub fn new(chain: Chain<T>) -> Self {
        let n = chain.segments;
        assert!(n > 0, "a chain has at least one segment");
        let none = T::from_f64(0.0);
        let elimination = Elimination {
            pivot: zero_matrix(),
            force: zero_matrix(),
            torque: zero_matrix(),
            from_node: zero_matrix(),
            from_neighbour: zero_matrix(),
            outer: zero_matrix(),
        };
        let response = Response { own: zero(), from_node: zero_matrix(), jacobian: zero_matrix(), bias: zero() };
        Self {
            chain,
            charts: vec![PolarAxis::default(); n],
            angles: vec![[none; 4]; n],
            jacobians: vec![zero_matrix(); n],
            positions: vec![zero(); n],
            velocities: vec![zero(); n],
            base_accelerations: vec![zero(); n + 1],
            base_forces: vec![zero(); n],
            outer_forces: vec![zero(); n],
            root_force: zero(),
            eliminations: vec![elimination; n],
            partial: vec![zero(); n],
            responses: vec![response; n],
        }
    }

    /// The constants.
    pub fn chain(&self) -> &Chain<T> {
        &self.chain
    }

    /// Replaces the constants by others with the same number of segments.
    pub(crate) fn set_chain(&mut self, chain: Chain<T>) {
        self.chain = chain;
    }

    /// The polar axis of each segment's coordinates.
    pub fn charts(&self) -> &[PolarAxis] {
        &self.charts
    }

    /// Takes coordinates about `charts` from now on. The caller converts them ([`PolarAxis::coordinates`]).
    ///
    /// # Panics
    /// If the numbers of charts and segments differ.
    pub fn set_charts(&mut self, charts: &[PolarAxis]) {
        self.charts.copy_from_slice(charts);
    }

    /// Positions of the nodes `r_1 … r_n` in m, at the state of the last [`Dynamics::place`], [`Dynamics::track`] or
    /// [`Dynamics::residual`].
    pub fn positions(&self) -> &[[T; 3]] {
        &self.positions
    }

    /// Velocities of the nodes in m/s, at the same state.
    pub fn velocities(&self) -> &[[T; 3]] {
        &self.velocities
    }

    /// Force that the clamp exerts on the root in N, from the last [`Dynamics::residual`].
    pub fn root_force(&self) -> [T; 3] {
        self.root_force
    }

    /// Acceleration of the node `r_{k+1}` in m/s², for `k = node`, at the `q̈` of the last [`Dynamics::track`] or
    /// [`Dynamics::residual`].
    pub fn node_acceleration(&self, node: usize) -> [T; 3] {
        add(self.base_accelerations[node + 1], self.chain.gravity)
    }

    /// Energies, dissipation and clamp power at the state of the last call that took `(q, q̇)`.
    pub fn energies(&self, clamp: &Clamp<T>, v: &[[T; 2]]) -> Energies<T> {
        let posture = Posture::new(&self.chain, &self.charts, &self.angles);
        let Chain { segments: n, length, mass, inertia, gravity, .. } = self.chain;
        let (root, constants) = (self.chain.root_joint(), self.chain.joint());
        let (direction, direction_rate) = clamp.about(self.charts[0]);
        let root = kernels::clamp_energy(direction, direction_rate, self.angles[0], v[0], root.stiffness, root.damping);
        let none = T::from_f64(0.0);
        let mut energies = Energies {
            kinetic: none,
            spring: root.spring,
            gravity: none,
            dissipation: root.dissipation,
            clamp_torque_power: root.power,
        };
        let (mut position, mut velocity) = (clamp.position, clamp.velocity);
        for k in 0..n {
            let Side { angles, rates, axis } = posture.side(k, v);
            let [x, x_rate, g] = [position, velocity, gravity].map(|vector| axis.from_frame(vector));
            let segment = kernels::segment_energy(*angles, *rates, x, x_rate, g, length, mass, inertia);
            energies.kinetic = energies.kinetic + segment.kinetic;
            energies.gravity = energies.gravity + segment.gravity;
            if k > 0 {
                let joint = chart::joint_energy(posture.side(k - 1, v), posture.side(k, v), constants);
                energies.spring = energies.spring + joint.spring;
                energies.dissipation = energies.dissipation + joint.dissipation;
            }
            (position, velocity) = (self.positions[k], self.velocities[k]);
        }
        energies
    }
}

/// A chain at one state. The recursions hold the constants by value, so that the compiler can keep them in registers. It would
/// read constants behind a reference again after every write.
#[derive(Clone, Copy)]
struct Posture<'a, T> {
    chain: Chain<T>,
    charts: &'a [PolarAxis],
    angles: &'a [[T; 4]],
}

impl<'a, T: Real> Posture<'a, T> {
    #[inline(always)]
    fn new(chain: &Chain<T>, charts: &'a [PolarAxis], angles: &'a [[T; 4]]) -> Self {
        Self { chain: *chain, charts: &charts[..chain.segments], angles: &angles[..chain.segments] }
    }

    /// Kinematics and inertia of segment `k`, in the frame.
    #[inline(always)]
    fn segment(&self, k: usize, rates: [T; 2]) -> kernels::Segment<T> {
        let Chain { length, mass, inertia, .. } = self.chain;
        let segment = kernels::segment(self.angles[k], rates, length, mass, inertia);
        match self.charts[k] {
            PolarAxis::Z => segment,
            axis => chart::segment_to_frame(axis, segment),
        }
    }

    /// One side of a joint, by segment.
    #[inline(always)]
    fn side<'b>(&'b self, k: usize, v: &'b [[T; 2]]) -> Side<'b, T> {
        Side { angles: &self.angles[k], rates: &v[k], axis: self.charts[k] }
    }

    /// Torques of the spring and the damper at the inner end of segment `k`.
    #[inline(always)]
    fn inner_joint(&self, k: usize, clamp: &Clamp<T>, v: &[[T; 2]]) -> kernels::Joint<T> {
        if k > 0 {
            return chart::joint(self.side(k - 1, v), self.side(k, v), self.chain.joint());
        }
        let JointConstants { stiffness, damping } = self.chain.root_joint();
        let (direction, direction_rate) = clamp.about(self.charts[0]);
        let next = kernels::clamp(direction, direction_rate, self.angles[0], v[0], stiffness, damping).next;
        kernels::Joint { previous: zero(), next }
    }

    /// Derivatives of these torques with respect to the accelerations of a step.
    #[inline(always)]
    fn inner_joint_tangent(
        &self,
        k: usize,
        clamp: &Clamp<T>,
        v: &[[T; 2]],
        weights: StepWeights<T>,
    ) -> kernels::JointTangent<T> {
        if k > 0 {
            return chart::joint_tangent(self.side(k - 1, v), self.side(k, v), self.chain.joint(), weights);
        }
        let JointConstants { stiffness, damping } = self.chain.root_joint();
        let (direction, direction_rate) = clamp.about(self.charts[0]);
        let clamp = kernels::clamp_tangent(
            direction,
            direction_rate,
            self.angles[0],
            v[0],
            stiffness,
            damping,
            weights.coordinates,
            weights.rates,
        );
        kernels::JointTangent {
            previous_previous: zero_matrix(),
            previous_next: zero_matrix(),
            next_previous: zero_matrix(),
            next_next: clamp.next_next,
        }
    }
}

impl<T: Compiled> Dynamics<T> {
    /// Angles, positions and velocities at `(q, q̇)`, without forces.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn place(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) {
        T::run(self, Task::Place { clamp, q, v });
    }

    /// Like [`Dynamics::place`], with the accelerations of the nodes at `q̈`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn track(&mut self, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) {
        T::run(self, Task::Track { clamp, q, v, accelerations });
    }

    /// The [`Energies::dissipation`] alone in W, with the angles of the last call that took `q`.
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    pub fn dissipation(&mut self, clamp: &Clamp<T>, v: &[[T; 2]]) -> T {
        let mut result = T::from_f64(0.0);
        T::run(self, Task::Dissipation { clamp, v, result: &mut result });
        result
    }

    /// Moves the nodes to their positions after `correction` (rad/s²) is subtracted from the `q̈` of the last
    /// [`Dynamics::residual`], and its products with `weights` from `q̇` and `q`.
    ///
    /// This is first order in the correction. In the velocities, `w_v |q̇|` is neglected compared with one.
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    pub fn shift(&mut self, correction: &[[T; 2]], weights: StepWeights<T>) {
        T::run(self, Task::Shift { correction, weights });
    }

    /// Accelerations `q̈` in rad/s² at the state `(q, q̇)`, into `accelerations`.
    ///
    /// Exact up to rounding: solves `M q̈ = f + Q` by elimination from the tip to the root, without
    /// forming `M`. Joint torques are exact to one rounding of `c`. In a nearly straight filament, small
    /// components are therefore known to some 1e-16 of the torque at a bend of one radian.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn accelerations(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        accelerations: &mut [[T; 2]],
    ) {
        T::run(self, Task::Accelerations { clamp, q, v, loads, result: accelerations });
    }

    /// `M q̈ − f − Q` in N m at `(q, q̇, q̈)`, into `residual`, without forming `M`.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn residual(
        &mut self,
        clamp: &Clamp<T>,
        q: &[[T; 2]],
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        residual: &mut [[T; 2]],
    ) {
        T::run(self, Task::Residual { clamp, q, v, accelerations, loads, result: residual });
    }

    /// Solves the factorised system for `right_side` (N m), which becomes the change of `q̈` (rad/s²).
    ///
    /// # Panics
    /// If the slice is shorter than the chain.
    pub fn solve(&mut self, right_side: &mut [[T; 2]]) {
        T::run(self, Task::Solve { right_side });
    }

    /// Factorises the matrix of Newton's method, `∂(residual)/∂q̈` along a step of the given weights, at the
    /// state of the last [`Dynamics::residual`], which must have been called with the same arguments.
    ///
    /// Only in `lanes`: the others keep their matrix.
    ///
    /// The matrix is exact except for one approximation: a loaded node is assumed to move by `w_q δẍ` (and at
    /// `w_v δẍ`). This neglects `2 w_v |q̇|` compared with one. Newton's method converges to the same solution.
    ///
    /// # Panics
    /// If a slice is shorter than the chain.
    pub fn factorise(
        &mut self,
        clamp: &Clamp<T>,
        v: &[[T; 2]],
        accelerations: &[[T; 2]],
        loads: &impl NodeLoads<T>,
        weights: StepWeights<T>,
        lanes: LaneSet,
    ) {
        T::run(self, Task::Factorise { clamp, v, accelerations, loads, weights, lanes });
    }
}

impl<T: Lanewise> Dynamics<T> {
    /// Position, velocity and acceleration of a node in one lane, when [`Dynamics::node_acceleration`] is valid.
    pub fn node_motion(&self, node: usize, lane: usize) -> [[f64; 3]; 3] {
        let gravity = self.chain.gravity.map(|component| component.lane(lane));
        let vectors = [self.positions[node], self.velocities[node], self.base_accelerations[node + 1]];
        let [position, velocity, base] = vectors.map(|vector| vector.map(|component| component.lane(lane)));
        [position, velocity, add(base, gravity)]
    }
}

impl Dynamics<f64> {
    /// Refuses coordinates at a pole of their chart, within `|sin φ| <` [`POLE`](super::POLE).
    ///
    /// The accelerations at a pole are not finite, or have no correct digit. Callers that accept a state from outside
    /// check it here first.
    ///
    /// # Errors
    /// The first segment at a pole.
    pub fn check_poles(&self, q: &[[f64; 2]]) -> Result<(), PoleError> {
        match find_pole(q) {
            Some(k) => Err(PoleError { segment: k + 1, polar_angle: q[k][0], axis: self.charts[k] }),
            None => Ok(()),
        }
    }
}

/// A scalar for which the recursions of [`Dynamics`] are compiled, once, in this crate.
pub trait Compiled: Lanewise {
    #[doc(hidden)]
    fn run(dynamics: &mut Dynamics<Self>, task: Task<'_, Self>);
}

impl Compiled for f64 {
    fn run(dynamics: &mut Dynamics<Self>, task: Task<'_, Self>) {
        dispatch(Recursion { dynamics, task });
    }
}

impl Compiled for Lanes<LANES> {
    fn run(dynamics: &mut Dynamics<Self>, task: Task<'_, Self>) {
        dispatch(Recursion { dynamics, task });
    }
}

/// A task for [`Dynamics`]: a method of the same name, with its arguments.
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
    Factorise {
        clamp: &'a Clamp<T>,
        v: &'a [[T; 2]],
        accelerations: &'a [[T; 2]],
        loads: &'a dyn NodeLoads<T>,
        weights: StepWeights<T>,
        lanes: LaneSet,
    },
    Solve {
        right_side: &'a mut [[T; 2]],
    },
    Shift {
        correction: &'a [[T; 2]],
        weights: StepWeights<T>,
    },
    Dissipation {
        clamp: &'a Clamp<T>,
        v: &'a [[T; 2]],
        result: &'a mut T,
    },
}

/// A task with its chain.
struct Recursion<'a, T> {
    dynamics: &'a mut Dynamics<T>,
    task: Task<'a, T>,
}

impl<T: Lanewise> Loop for Recursion<'_, T> {
    type Output = ();

    const LANES: usize = T::LANES;

    /// The functions below take references as arguments, which tells the compiler that they do not overlap. It cannot know
    /// this of fields.
    #[inline(always)]
    fn run(self) {
        let dynamics = self.dynamics;
        match self.task {
            Task::Place { clamp, q, v } => place(dynamics, clamp, q, v),
            Task::Track { clamp, q, v, accelerations } => track(dynamics, clamp, q, v, accelerations),
            Task::Accelerations { clamp, q, v, loads, result } => accelerations(dynamics, clamp, q, v, loads, result),
            Task::Residual { clamp, q, v, accelerations, loads, result } => {
                residual(dynamics, clamp, q, v, accelerations, loads, result);
            }
            Task::Factorise { clamp, v, accelerations, loads, weights, lanes } => {
                factorise(dynamics, clamp, v, accelerations, loads, weights, lanes);
            }
            Task::Solve { right_side } => solve(dynamics, right_side),
            Task::Shift { correction, weights } => shift(dynamics, correction, weights),
            Task::Dissipation { clamp, v, result } => dissipation(dynamics, clamp, v, result),
        }
    }
}

#[inline(always)]
fn place<T: Real>(dynamics: &mut Dynamics<T>, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]]) {
    let n = dynamics.chain.segments;
    let (q, v) = (&q[..n], &v[..n]);
    T::sines_and_cosines(q, &mut dynamics.angles[..n]);
    let posture = Posture::new(&dynamics.chain, &dynamics.charts, &dynamics.angles);
    let (positions, velocities) = (&mut dynamics.positions[..n], &mut dynamics.velocities[..n]);
    let (mut position, mut velocity) = (clamp.position, clamp.velocity);
    for k in 0..n {
        let segment = posture.segment(k, v[k]);
        position = add(position, segment.reach);
        velocity = add(velocity, segment.reach_rate);
        (positions[k], velocities[k]) = (position, velocity);
    }
}

#[inline(always)]
fn track<T: Real>(dynamics: &mut Dynamics<T>, clamp: &Clamp<T>, q: &[[T; 2]], v: &[[T; 2]], accelerations: &[[T; 2]]) {
    let n = dynamics.chain.segments;
    let (q, v, accelerations) = (&q[..n], &v[..n], &accelerations[..n]);
    T::sines_and_cosines(q, &mut dynamics.angles[..n]);
    let posture = Posture::new(&dynamics.chain, &dynamics.charts, &dynamics.angles);
    let (positions, velocities) = (&mut dynamics.positions[..n], &mut dynamics.velocities[..n]);
    let base_accelerations = &mut dynamics.base_accelerations[..n + 1];
    let (mut position, mut velocity) = (clamp.position, clamp.velocity);
    let mut base = sub(clamp.acceleration, dynamics.chain.gravity);
    for k in 0..n {
        let segment = posture.segment(k, v[k]);
        position = add(position, segment.reach);
        velocity = add(velocity, segment.reach_rate);
        (positions[k], velocities[k]) = (position, velocity);
        base_accelerations[k] = base;
        base = add(base, add(mul(&segment.reach_jacobian, accelerations[k]), segment.reach_bias));
    }
    base_accelerations[n] = base;
}

#[inline(always)]
fn accelerations<T: Real>(
    dynamics: &mut Dynamics<T>,
    clamp: &Clamp<T>,
    q: &[[T; 2]],
    v: &[[T; 2]],
    loads: &dyn NodeLoads<T>,
    accelerations: &mut [[T; 2]],
) {
    let n = dynamics.chain.segments;
    let (q, v, accelerations) = (&q[..n], &v[..n], &mut accelerations[..n]);
    let loaded = !loads.is_empty();
    if loaded {
        place(dynamics, clamp, q, v);
    } else {
        T::sines_and_cosines(q, &mut dynamics.angles[..n]);
    }
    let posture = Posture::new(&dynamics.chain, &dynamics.charts, &dynamics.angles);
    let (positions, velocities) = (&dynamics.positions[..n], &dynamics.velocities[..n]);
    let responses = &mut dynamics.responses[..n];
    let mass = posture.chain.mass;
    // The outer chain responds to ẍ at its inner node with A ẍ + b. A is symmetric.
    let (mut a, mut b) = (zero_matrix(), zero());
    let mut torque_from_outside = zero();
    for k in (0..n).rev() {
        if loaded && let Some(force) = loads.force(k, positions[k], velocities[k]) {
            b = sub(b, force);
        }
        let segment = posture.segment(k, v[k]);
        let joint = posture.inner_joint(k, clamp, v);
        let torque = add(joint.next, torque_from_outside);
        torque_from_outside = joint.previous;
        let jacobian = &segment.reach_jacobian;
        let outer = add(mul(&a, segment.reach_bias), b);
        let spread = product(&a, jacobian);
        let coupling = add_matrices(&segment.coupling, &spread);
        let pivot = invert(&add_matrices(&segment.inertia, &transposed_product(jacobian, &spread)));
        let torque = sub(sub(torque, segment.bias), mul_transposed(jacobian, outer));
        // (Uᵀ premultiplied by the pivot, which is symmetric here.)
        let mut from_node = zero_matrix::<T, 2, 3>();
        unrolled!(row < 2, {
            from_node[row] = mul(&coupling, pivot[row]);
        });
        let own = mul(&pivot, torque);
        let correction = product(&coupling, &from_node);
        // Compute one half and mirror it.
        unrolled!(row < 3, {
            unrolled!(column < 3, {
                if row <= column {
                    let entry = a[row][column] - correction[row][column];
                    a[row][column] = entry;
                    a[column][row] = entry;
                }
            });
            a[row][row] = mass + a[row][row];
        });
        b = add(add(segment.base_bias, outer), mul(&coupling, own));
        responses[k] = Response { own, from_node, jacobian: *jacobian, bias: segment.reach_bias };
    }

    let mut base = sub(clamp.acceleration, posture.chain.gravity);
    for k in 0..n {
        let Response { own, from_node, jacobian, bias } = &responses[k];
        let acceleration = sub(*own, mul(from_node, base));
        base = add(base, add(mul(jacobian, acceleration), *bias));
        accelerations[k] = acceleration;
    }
}

#[inline(always)]
fn residual<T: Real>(
    dynamics: &mut Dynamics<T>,
    clamp: &Clamp<T>,
    q: &[[T; 2]],
    v: &[[T; 2]],
    accelerations: &[[T; 2]],
    loads: &dyn NodeLoads<T>,
    residual: &mut [[T; 2]],
) {
    let n = dynamics.chain.segments;
    let (q, v, accelerations, residual) = (&q[..n], &v[..n], &accelerations[..n], &mut residual[..n]);
    T::sines_and_cosines(q, &mut dynamics.angles[..n]);
    let posture = Posture::new(&dynamics.chain, &dynamics.charts, &dynamics.angles);
    let (positions, velocities) = (&mut dynamics.positions[..n], &mut dynamics.velocities[..n]);
    let (jacobians, base_accelerations) = (&mut dynamics.jacobians[..n], &mut dynamics.base_accelerations[..n + 1]);
    let (base_forces, outer_forces) = (&mut dynamics.base_forces[..n], &mut dynamics.outer_forces[..n]);
    let mass = posture.chain.mass;

    let (mut position, mut velocity) = (clamp.position, clamp.velocity);
    let mut base = sub(clamp.acceleration, posture.chain.gravity);
    // For the segment before, which still lacks the torque of its outer joint.
    let mut pending = zero();
    for k in 0..n {
        let segment = posture.segment(k, v[k]);
        let joint = posture.inner_joint(k, clamp, v);
        let acceleration = accelerations[k];
        if k > 0 {
            residual[k - 1] = sub(pending, joint.previous);
        }
        let inertial = add(mul(&segment.inertia, acceleration), segment.bias);
        pending = sub(add(inertial, mul_transposed(&segment.coupling, base)), joint.next);
        let own = add(mul(&segment.coupling, acceleration), segment.base_bias);
        base_forces[k] = add(scale(mass, base), own);
        base_accelerations[k] = base;
        base = add(base, add(mul(&segment.reach_jacobian, acceleration), segment.reach_bias));
        position = add(position, segment.reach);
        velocity = add(velocity, segment.reach_rate);
        (positions[k], velocities[k]) = (position, velocity);
        jacobians[k] = segment.reach_jacobian;
    }
    residual[n - 1] = pending;
    base_accelerations[n] = base;

    let loaded = !loads.is_empty();
    let mut force = zero();
    for k in (0..n).rev() {
        if loaded && let Some(load) = loads.force(k, positions[k], velocities[k]) {
            force = sub(force, load);
        }
        outer_forces[k] = force;
        residual[k] = add(residual[k], mul_transposed(&jacobians[k], force));
        force = add(force, base_forces[k]);
    }
    dynamics.root_force = force;
}

#[inline(always)]
fn factorise<T: Lanewise>(
    dynamics: &mut Dynamics<T>,
    clamp: &Clamp<T>,
    v: &[[T; 2]],
    accelerations: &[[T; 2]],
    loads: &dyn NodeLoads<T>,
    weights: StepWeights<T>,
    lanes: LaneSet,
) {
    let n = dynamics.chain.segments;
    let (v, accelerations) = (&v[..n], &accelerations[..n]);
    let posture = Posture::new(&dynamics.chain, &dynamics.charts, &dynamics.angles);
    let (positions, velocities) = (&dynamics.positions[..n], &dynamics.velocities[..n]);
    let (base_accelerations, outer_forces) = (&dynamics.base_accelerations[..n], &dynamics.outer_forces[..n]);
    let eliminations = &mut dynamics.eliminations[..n];
    let Chain { length, mass, inertia, .. } = posture.chain;
    let (loaded, whole) = (!loads.is_empty(), lanes == LaneSet::first(T::LANES));

    // The outer chain responds to δẍ at its inner node and δq̈ of the segment inside it with the force
    // A δẍ + B δq̈ and the torque C δẍ + D δq̈.
    let (mut a, mut b, mut c, mut d) = (zero_matrix(), zero_matrix(), zero_matrix(), zero_matrix());
    for k in (0..n).rev() {
        if loaded && let Some(tangent) = loads.tangent(k, positions[k], velocities[k]) {
            unrolled!(row < 3, {
                let elastic = scale(weights.coordinates, tangent.position[row]);
                let viscous = scale(weights.rates, tangent.velocity[row]);
                a[row] = sub(sub(a[row], elastic), viscous);
            });
        }
        let segment = posture.segment(k, v[k]);
        let jacobian = &segment.reach_jacobian;
        let axis = posture.charts[k];
        let mut tangent = kernels::segment_tangent(
            posture.angles[k],
            v[k],
            accelerations[k],
            axis.from_frame(base_accelerations[k]),
            axis.from_frame(outer_forces[k]),
            length,
            mass,
            inertia,
            weights.coordinates,
            weights.rates,
        );
        if axis != PolarAxis::Z {
            tangent.base_force = axis.to_frame(tangent.base_force);
            tangent.outer_acceleration = axis.to_frame(tangent.outer_acceleration);
        }
        let joint = posture.inner_joint_tangent(k, clamp, v, weights);
        let outer = &tangent.outer_acceleration;
        let spread = add_matrices(&product(&a, outer), &b);
        let mut pivot = add_matrices(&tangent.torque, &transposed_product(jacobian, &spread));
        pivot = add_matrices(&pivot, &add_matrices(&product(&c, outer), &d));
        let pivot = invert(&add_matrices(&pivot, &joint.next_next));
        let mut coupling = add_matrices(&transposed_product(jacobian, &a), &c);
        unrolled!(row < 2, {
            unrolled!(column < 3, {
                coupling[row][column] = segment.coupling[column][row] + coupling[row][column];
            });
        });
        let from_node = product(&pivot, &coupling);
        let from_neighbour = product(&pivot, &joint.next_previous);
        let force = add_matrices(&tangent.base_force, &spread);
        let torque = joint.previous_next;

        a = sub_matrices(&a, &product(&force, &from_node));
        unrolled!(i < 3, {
            a[i][i] = a[i][i] + mass;
        });
        b = negative(&product(&force, &from_neighbour));
        c = negative(&product(&torque, &from_node));
        d = sub_matrices(&joint.previous_previous, &product(&torque, &from_neighbour));
        let elimination = Elimination { pivot, force, torque, from_node, from_neighbour, outer: *outer };
        eliminations[k] = if whole { elimination } else { elimination.select(lanes, &eliminations[k]) };
    }
}

#[inline(always)]
fn solve<T: Real>(dynamics: &mut Dynamics<T>, right_side: &mut [[T; 2]]) {
    let n = dynamics.chain.segments;
    let (eliminations, jacobians) = (&dynamics.eliminations[..n], &dynamics.jacobians[..n]);
    let (partial, right_side) = (&mut dynamics.partial[..n], &mut right_side[..n]);
    let (mut force, mut torque) = (zero::<T, 3>(), zero::<T, 2>());
    for k in (0..n).rev() {
        let elimination = &eliminations[k];
        let own = sub(sub(right_side[k], mul_transposed(&jacobians[k], force)), torque);
        let own = mul(&elimination.pivot, own);
        force = add(force, mul(&elimination.force, own));
        torque = mul(&elimination.torque, own);
        partial[k] = own;
    }
    let (mut base, mut neighbour) = (zero::<T, 3>(), zero::<T, 2>());
    for k in 0..n {
        let elimination = &eliminations[k];
        let inner = add(mul(&elimination.from_node, base), mul(&elimination.from_neighbour, neighbour));
        neighbour = sub(partial[k], inner);
        base = add(base, mul(&elimination.outer, neighbour));
        right_side[k] = neighbour;
    }
}

#[inline(always)]
fn shift<T: Real>(dynamics: &mut Dynamics<T>, correction: &[[T; 2]], weights: StepWeights<T>) {
    let n = dynamics.chain.segments;
    let (jacobians, correction) = (&dynamics.jacobians[..n], &correction[..n]);
    let (positions, velocities) = (&mut dynamics.positions[..n], &mut dynamics.velocities[..n]);
    let mut change = zero();
    for k in 0..n {
        change = add(change, mul(&jacobians[k], correction[k]));
        positions[k] = sub(positions[k], scale(weights.coordinates, change));
        velocities[k] = sub(velocities[k], scale(weights.rates, change));
    }
}

#[inline(always)]
fn dissipation<T: Real>(dynamics: &mut Dynamics<T>, clamp: &Clamp<T>, v: &[[T; 2]], result: &mut T) {
    let (root, constants) = (dynamics.chain.root_joint(), dynamics.chain.joint());
    let (direction, direction_rate) = clamp.about(dynamics.charts[0]);
    let angles = dynamics.angles[0];
    let root = kernels::clamp_energy(direction, direction_rate, angles, v[0], root.stiffness, root.damping);
    *result = root.dissipation;
    let posture = Posture::new(&dynamics.chain, &dynamics.charts, &dynamics.angles);
    for k in 1..dynamics.chain.segments {
        let joint = chart::joint_energy(posture.side(k - 1, v), posture.side(k, v), constants);
        *result = *result + joint.dissipation;
    }
}
