//! Rust: on `f64` without dependencies, or generic over the scalar type.

use bristle_codegen::back::languages::rust::{RustScalar, items};
use bristle_codegen::back::source::{Origin, header};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::ir::special;

use super::{header_in, series_filled, uses_half_angle_squared};

/// Writes the Rust source of `kernels` for users of the solver, generic over its trait `Real`: one
/// module.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit_generic(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    let items = items(kernels, RustScalar::Generic)?;
    Ok(header(kernels, origin, "//")? + "\nuse bristle::equations::Real;\n" + &items)
}

/// Writes the Rust source of `kernels` on `f64`: one module.
///
/// # Errors
/// The kernel that cannot be written, and why.
pub fn emit(kernels: &[Kernel], origin: Origin<'_>) -> Result<String, String> {
    let items = items(kernels, RustScalar::Double)?;
    let mut text = header_in("Rust, on f64", kernels, origin, "//")?;
    if uses_half_angle_squared(kernels) {
        text += &half_angle_squared();
    }
    Ok(text + &items)
}

fn half_angle_squared() -> String {
    series_filled(include_str!("half_angle_squared.rs"), "[", "]", ",\n")
        .replace("@ORDERS@", &special::SERIES.len().to_string())
        .replace("@TERMS@", &special::TERMS.to_string())
}
