//! Functions from expressions to expressions, and a check of them. They know nothing of filaments.

pub mod calculus;
pub mod dimension;
pub mod normal_form;
