//! Commands of Bristle, once for the program and for Python.
//!
//! [`run`] goes from settings to files. [`store`] keeps results, journals and checkpoints;
//! [`insight`] judges results; [`report`] shows them as tables, figures and pages. Each uses only
//! those before it in the order `store`, `insight`, `report`, `run`.

pub mod insight;
pub mod report;
pub mod run;
pub mod store;

/// Input files of tests, included by path because a test module is not part of a library.
#[cfg(test)]
#[path = "../../study/src/input/testing.rs"]
mod testing;
