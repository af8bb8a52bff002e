//! Bristle simulates the contact of an abrasive brush filament with a workpiece.
//!
//! The filament is a chain of rigid segments joined by rotational springs and dampers (Uhlmann and
//! Hoyer, *Modeling of Contact Forces for Brushing Tools*, Ceramics 2021). This crate is the core:
//! settings in, metrics out. It reads and writes no files and draws nothing. Modules in the order
//! of the data flow:
//!
//! 1. [`model`]: the settings, their ranges, and the metrics of a contact;
//! 2. [`tool`], [`workpiece`], [`contact`]: the physics of the parts;
//! 3. [`equations`]: kernels that the build step has derived and emitted, and the O(n) loops over
//!    them;
//! 4. [`integrate`]: implicit, error-controlled steps;
//! 5. [`simulation`]: one pass over the workpiece, through located contact events;
//! 6. [`brush`]: filaments that touch each other.

pub mod brush;
mod check;
pub mod contact;
pub mod equations;
pub mod integrate;
pub mod model;
pub mod simulation;
pub mod tool;
pub mod workpiece;
