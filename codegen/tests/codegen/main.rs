//! The tests of the engine, one module for each question; the answers share one program, which is linked once.

mod agreement;
mod budgets;
mod exchange;
mod expressions;
mod golden;
mod layers;
mod rules;
