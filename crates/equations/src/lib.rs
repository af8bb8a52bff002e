//! Tools for the equations of motion: show them ([`derive`](mod@derive)), compare them with those
//! of another engine ([`comparison`]), and evaluate them at one state ([`evaluation`], [`state`])
//! or at many ([`batch`]). [`languages`] and [`print`](mod@print) write them for other programs and
//! for people.

pub mod batch;
pub mod comparison;
pub mod derive;
pub mod evaluation;
pub mod languages;
pub mod print;
pub mod state;
