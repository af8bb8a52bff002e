//! Results of Bristle in formats for people and programs.
//!
//! `parquet` writes tables (with the feature of that name), [`vtk`] the filament's motion for
//! ParaView, and [`tables`] text for a terminal. [`figures`] has figures, which [`drawing`] draws.
//! [`page`] makes a study one page to explore in a browser. All return text or bytes. The program
//! handles the files.

pub mod convergence;
pub mod drawing;
pub mod figures;
pub mod page;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod removal;
pub mod tables;
pub mod view;
pub mod vtk;
