//! The tests of the engine, one module per question, in one program that is linked once.

mod agreement;
mod budgets;
mod exchange;
mod golden;
mod rules;
