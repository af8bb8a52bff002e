//! The commands, one file per command.

pub mod advise;
pub mod calibrate;
pub mod compare;
pub mod completions;
pub mod derive;
pub mod evaluate;
pub mod explain;
pub mod new;
pub mod report;
pub mod simulate;
pub mod study;
pub mod wear;
