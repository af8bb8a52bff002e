//! The equations of motion themselves: to read ([`derive`](mod@derive)), to compare with those of another engine
//! ([`comparison`]), and to evaluate at one state ([`evaluation`], [`state`]).

pub mod comparison;
pub mod derive;
pub mod evaluation;
pub mod state;
