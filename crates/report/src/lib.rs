//! Results of Bristle in the forms that people and programs read.
//!
//! [`parquet`] writes tables, [`vtk`] the filament's motion for ParaView, [`tables`] text for a terminal,
//! [`figures`] pictures (drawn by [`drawing`]), [`page`] a study as one page to look through in a browser. All return text or
//! bytes; files are the program's.

pub mod drawing;
pub mod figures;
pub mod page;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod tables;
pub mod vtk;

/// The input files of tests, those of the study crate: a test module is no part of a library.
#[cfg(test)]
#[path = "../../study/src/testing.rs"]
mod testing;
