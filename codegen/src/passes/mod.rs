//! Transformations and checks of expressions, which know nothing about filaments.

pub mod calculus;
pub mod dimension;
pub mod normal_form;
pub mod specialise;
