//! Studies: many simulations of Bristle over a grid of settings, read from an input file and run to saved results.
//!
//! The modules, in the order of the data flow:
//!
//! 1. [`document`], [`schema`], [`control_points`], [`input_error`]: an input file, read and checked;
//! 2. [`study`]: the grid of cases, and the scheduler that simulates them in lanes and threads;
//! 3. [`brush`]: what a case with filaments that touch has beyond its metrics; [`uncertainty`]: sampled tools of a case, and the band of their forces;
//!    [`check`]: the change of a result that is computed more precisely;
//! 4. [`journal`]: results as they arrive, from which a stopped study resumes; [`checkpoint`]: the state of a stopped brush;
//! 5. [`results`], [`joined`], [`measured`]: saved results read back, several of them as one study, and measured forces to compare with them;
//! 6. [`slices`], [`differences`], [`limited_work`], [`stability`], [`touch`], [`advice`]: what a study shows, warns about and advises.
//!
//! Nothing here touches a file or a terminal: the interface is text.

pub mod advice;
pub mod assumptions;
pub mod brush;
mod cells;
pub mod check;
pub mod checkpoint;
pub mod control_points;
pub mod differences;
pub mod digest;
pub mod document;
pub mod edges;
pub mod explain;
pub mod first_file;
pub mod input_error;
pub mod joined;
pub mod journal;
pub mod limited_work;
pub mod materials;
pub mod measured;
mod mistakes;
mod options;
mod origin;
pub mod plausibility;
pub mod results;
pub mod schema;
pub mod slices;
pub mod stability;
pub mod study;
#[cfg(test)]
mod testing;
pub mod text;
pub mod touch;
pub mod turns;
pub mod uncertainty;

/// Compiles the code examples of the library's page.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/library.md")]
struct Library;
