//! The equations of motion of a chain: generated kernels, and the O(n) loops over them.
//!
//! [`kernels`] comes from the build step: the derivatives of the energies of one segment and one
//! joint. [`Dynamics`] joins them to whole chains: accelerations, the residual of the equations,
//! and the linear solve of an implicit step, each in time proportional to the number of segments.
//! [`PlanarDynamics`] is their counterpart in the plane of rotation. [`PolarAxis`] names the two
//! charts of a chain, between which it changes so that no segment stays near its poles.

mod chain;
mod chart;
mod compiled;
pub(crate) mod dispatch;
mod dynamics;
mod elementary;
mod inner_forces;
mod lanes;
pub mod linear;
mod memory;
mod planar;
mod posture;
mod real;
mod recursion;
mod single;
mod step_matrix;
mod tasks;

pub use chain::{
    Chain, ChainState, Clamp, Energies, Link, NoLoads, NodeLoads, NodeMotion, NodeTangent,
    PointDamping, PointLoad, PointTangent, RelaxedAngle, UniformChain,
};
pub(crate) use chart::better_chart;
pub use chart::{POLE, PolarAxis, PoleError, find_pole};
pub use compiled::Compiled;
pub use dispatch::lanes_are_compiled;
pub use dynamics::Dynamics;
pub use elementary::{TRIGONOMETRIC_LIMIT, sin_cos};
pub use kernels::StepWeights;
pub use lanes::{LANES, Lanes};
pub use planar::PlanarDynamics;
pub use real::{LaneSet, Lanewise, Real};
pub use tasks::ChainDynamics;
pub(crate) use tasks::Task;

/// SHA-256 of the expressions of [`kernels`], in hexadecimal digits, as in the header of their
/// source.
pub const FINGERPRINT: &str = env!("BRISTLE_FINGERPRINT");

/// Generator of [`kernels`] and its source.
pub const MAKER: &str = env!("BRISTLE_MAKER");

/// Version of this build, with the derivation of its [`kernels`]: `1.2.3 (built-in derivation)` or
/// `1.2.3 (CasADi derivation)`.
pub const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    " (",
    env!("BRISTLE_ENGINE"),
    " derivation)"
);

/// Kernels of one segment and one joint, derived and emitted by the build step.
pub mod kernels {
    use super::Real;

    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}

/// Power series of `S(u) = ½ arccos²(1 − u)`, the energy of a spring, and of its derivatives,
/// written by the build step.
mod series {
    include!(concat!(env!("OUT_DIR"), "/series.rs"));
}
