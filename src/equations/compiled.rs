//! The numbers for which all loops are compiled.

use super::Lanes;
use super::dynamics::SpatialLoops;
use super::planar::PlanarLoops;

/// Scalar for which the recursions of [`Dynamics`](super::Dynamics) are compiled, once, in this
/// crate.
pub trait Compiled: SpatialLoops + PlanarLoops {}

impl Compiled for f64 {}

impl Compiled for Lanes {}
