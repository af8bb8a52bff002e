//! The whole equations of motion, in a form to read or to pass on.

use bristle_codegen::MAKER;
use bristle_codegen::dimension::DimensionError;
use bristle_codegen::emit::{EmitError, Origin, emit};
use bristle_codegen::exchange::to_json;
use bristle_codegen::print::equations;
use bristle_codegen::whole::{Purpose, whole_kernels};

/// What an exchanged graph says made it.
const GENERATOR: &str = concat!("bristle-codegen ", env!("CARGO_PKG_VERSION"));

/// The form of the equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeriveFormat {
    /// Readable mathematics.
    Math,
    /// Rust source.
    Rust,
    /// The expression graph.
    Json,
}

/// Why the equations cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum DeriveError {
    /// There is no chain without segments.
    #[error("a filament has at least one segment")]
    NoSegments,
    /// A term of the derivation makes no physical sense.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// The Rust form cannot be written.
    #[error(transparent)]
    Emit(#[from] EmitError),
    /// The JSON form cannot be written.
    #[error("cannot write the graph as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Derives the whole equations of a chain of `segments` segments and writes them in `format`.
///
/// # Errors
/// If there are no segments.
pub fn derive(segments: usize, format: DeriveFormat) -> Result<String, DeriveError> {
    if segments == 0 {
        return Err(DeriveError::NoSegments);
    }
    match format {
        DeriveFormat::Math => Ok(equations(segments, &whole_kernels(segments, Purpose::Reading)?)),
        DeriveFormat::Json => Ok(to_json(&whole_kernels(segments, Purpose::Computing)?, GENERATOR)?),
        DeriveFormat::Rust => {
            let plural = if segments == 1 { "" } else { "s" };
            let origin = Origin {
                title: &format!("Equations of motion of a filament of {segments} segment{plural}."),
                maker: MAKER,
                again: &format!("bristle derive --segments {segments} --format rust"),
            };
            let source = emit(&whole_kernels(segments, Purpose::Computing)?, origin)?;
            // Below the header, which ends at the first empty line.
            Ok(source.replacen("\n\n", "\n\nuse bristle::equations::Real;\n\n", 1))
        }
    }
}
