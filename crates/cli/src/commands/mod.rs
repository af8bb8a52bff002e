//! The commands, one file per command.

pub mod advise;
pub mod brush;
pub mod calibrate;
pub mod compare;
pub mod compare_studies;
pub mod completions;
pub mod converge;
pub mod derive;
pub mod evaluate;
pub mod explain;
pub mod merge;
pub mod new;
pub mod plot;
pub mod remove;
pub mod simulate;
pub mod study;
