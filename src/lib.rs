//! Bristle simulates the contact of an abrasive brush filament with a workpiece.
//!
//! The filament is a chain of rigid segments joined by rotational springs and dampers (Uhlmann and Hoyer, *Modeling
//! of Contact Forces for Brushing Tools*, Ceramics 2021). The modules, in the order in which the data passes them:
//!
//! 1. [`settings`], [`document`], [`study`]: what the user asks for, read from a TOML file and checked;
//! 2. [`filament`], [`tool`], [`workpiece`], [`contact`]: the physics of the parts;
//! 3. [`equations`]: kernels that the build step has derived and emitted, and the O(n) loops over them;
//! 4. [`integrate`]: implicit, error-controlled steps;
//! 5. [`simulation`]: one pass over the workpiece, through located contact events;
//! 6. [`metrics`]: the figures that the contact is reduced to;
//! 7. [`journal`]: results as they come, so that a study that was stopped goes on;
//! 8. [`report`], [`tables`], [`figures`], [`drawing`], [`page`], [`vtk`]: results as files, as text, as pictures, as a page to
//!    look through and for ParaView;
//! 9. [`results`], [`measured`]: saved results read back, and forces that were measured beside them;
//! 10. [`advice`]: where the force is high, by the results of a study.
//!
//! [`evaluation`] and [`derive`](mod@derive) show the equations themselves.

pub mod advice;
pub mod comparison;
pub mod contact;
pub mod derive;
pub mod document;
pub mod drawing;
pub mod equations;
pub mod evaluation;
pub mod figures;
pub mod filament;
mod grid;
pub mod input_error;
pub mod integrate;
pub mod journal;
pub mod measured;
pub mod metrics;
pub mod page;
pub mod parameters;
pub mod report;
pub mod results;
pub mod schema;
pub mod settings;
pub mod simulation;
pub mod state;
pub mod study;
pub mod tables;
#[cfg(test)]
mod testing;
pub mod tool;
pub mod uncertainty;
pub mod vtk;
pub mod workpiece;

/// Compiles and runs the code of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
