//! The filament: its energies, and the equations of motion that follow from them.

mod arguments;
pub mod chain;
mod elements;
mod joint;
pub mod kernels;
pub mod lagrange;
pub mod lateral;
pub mod whole;
