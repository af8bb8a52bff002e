//! The tests of the engine, one module per question, in one program that is linked once.

mod agreement;
mod budgets;
mod damping;
mod exchange;
mod expressions;
mod golden;
mod planar;
mod rules;
