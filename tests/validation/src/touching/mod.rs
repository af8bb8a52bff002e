//! Filaments that touch each other: pairs at rest, then sectors that pass a workpiece.

pub mod convergence;
pub mod pairs;
pub mod rows;
