//! Readers of input files, and of tables of numbers.
//!
//! [`document`] reads and checks an input file, with errors that state the place ([`input_error`]).
//! [`schema`] describes such files, [`explain`] single settings. [`units`] has the rule of keys in
//! other units, [`statement`] the contents besides settings. [`plausibility`] finds unusual
//! settings. [`materials`] has the constants of materials, [`mixture`] those of polymers with
//! grains, [`friction`] coefficients of pairings, and [`packing`] the fill of a trim.
//! [`first_file`] writes a first input file. [`table`] and [`cells`] read tables as laboratories
//! and spreadsheets write them: [`measured`] forces, and the [`control_points`] of splines.
//!
//! Nothing here touches a file or a terminal: the interface is text.

pub mod cells;
mod columns;
pub mod control_points;
pub mod document;
pub mod explain;
pub mod first_file;
pub mod friction;
mod goal;
mod headings;
pub mod input_error;
mod keys;
pub mod materials;
pub mod measured;
mod mistakes;
pub mod mixture;
mod options;
pub mod packing;
pub mod plausibility;
pub mod schema;
pub mod statement;
pub mod table;
#[cfg(test)]
mod testing;
pub mod units;
