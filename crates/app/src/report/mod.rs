//! Results of Bristle in formats for people and programs.
//!
//! `parquet` writes tables and `vtk` the filament's motion for ParaView, with the features of these
//! names. [`tables`] has text for a terminal. [`figures`] has figures, which [`drawing`] draws.
//! [`page`] makes a study one page to explore in a browser. All return text or bytes. The program
//! handles the files.

pub mod convergence;
pub mod drawing;
pub mod figures;
pub mod page;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod removal;
mod scatter;
pub mod tables;
pub mod view;
#[cfg(feature = "vtk")]
pub mod vtk;
