//! Studies with Bristle: many passes and brushes, from an input file to results.
//!
//! [`input`] reads files and tables, [`grid`] simulates the cases of a study, and [`calibrate`]
//! finds settings from measurements. [`text`] formats numbers and lines for people. Each uses only
//! those before it in the order `text`, `grid`, `input`, `calibrate`.
//!
//! Nothing here touches a file or a terminal: the interface is text.

pub mod calibrate;
pub mod grid;
pub mod input;
pub mod text;
