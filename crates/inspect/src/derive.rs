//! Derives the equations of motion, whole or as the kernels of the solver, in a form for people or for other programs.

use bristle_codegen::MAKER;
use bristle_codegen::back::json::to_json;
use bristle_codegen::back::print::{self, Form};
use bristle_codegen::back::rust::{EmitError, Origin, emit};
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::dimension::DimensionError;

/// The generator stated in an exported graph.
const GENERATOR: &str = concat!("bristle-codegen ", env!("CARGO_PKG_VERSION"));

/// Title of the kernels.
const KERNELS: &str = "Kernels of the solver";

/// The equations to derive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equations {
    /// The whole equations of a chain with this number of segments.
    Whole(usize),
    /// The kernels of one segment and one joint, which the solver loops over.
    Kernels,
}

impl Equations {
    /// The command that derives them.
    fn command(self, format: DeriveFormat) -> String {
        let format = format.name();
        match self {
            Self::Whole(segments) => format!("bristle derive --segments {segments} --format {format}"),
            Self::Kernels => format!("bristle derive --kernels --format {format}"),
        }
    }
}

/// The form of the equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeriveFormat {
    /// Readable mathematics, as text.
    Math,
    /// A LaTeX document.
    Latex,
    /// Markdown with formulas; for whole equations, their derivation step by step.
    Markdown,
    /// Rust source.
    Rust,
    /// The expression graph.
    Json,
}

impl DeriveFormat {
    /// The name on the command line.
    fn name(self) -> &'static str {
        match self {
            Self::Math => "math",
            Self::Latex => "latex",
            Self::Markdown => "markdown",
            Self::Rust => "rust",
            Self::Json => "json",
        }
    }
}

/// Why the equations cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum DeriveError {
    /// A chain needs at least one segment.
    #[error("a filament must have at least one segment")]
    NoSegments,
    /// The dimensions of a term in the derivation are inconsistent.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// The Rust form cannot be written.
    #[error(transparent)]
    Emit(#[from] EmitError),
    /// The JSON form cannot be written.
    #[error("cannot write the graph as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Derives `equations` and writes them in `format`.
///
/// # Errors
/// If there are no segments, or a form cannot be written.
pub fn derive(equations: Equations, format: DeriveFormat) -> Result<String, DeriveError> {
    if equations == Equations::Whole(0) {
        return Err(DeriveError::NoSegments);
    }
    let again = equations.command(format);
    let form = match format {
        DeriveFormat::Math => Form::Text,
        DeriveFormat::Latex => Form::Latex,
        DeriveFormat::Markdown => Form::Markdown,
        DeriveFormat::Rust | DeriveFormat::Json => return written_for_programs(equations, format, &again),
    };
    Ok(match equations {
        Equations::Kernels => print::kernels(form, KERNELS, &kernels()?, &again),
        Equations::Whole(segments) if form == Form::Markdown => print::walkthrough(segments, &again)?,
        Equations::Whole(segments) => {
            print::equations(form, segments, &whole_kernels(segments, Purpose::Reading)?, &again)
        }
    })
}

fn written_for_programs(equations: Equations, format: DeriveFormat, again: &str) -> Result<String, DeriveError> {
    let (title, kernels) = match equations {
        Equations::Whole(segments) => {
            let plural = if segments == 1 { "" } else { "s" };
            let title = format!("Equations of motion of a filament of {segments} segment{plural}.");
            (title, whole_kernels(segments, Purpose::Computing)?)
        }
        Equations::Kernels => (format!("{KERNELS}."), kernels()?),
    };
    if format == DeriveFormat::Json {
        return Ok(to_json(&kernels, GENERATOR)?);
    }
    let source = emit(&kernels, Origin { title: &title, maker: MAKER, again })?;
    // The import goes below the header, which ends at the first empty line.
    Ok(source.replacen("\n\n", "\n\nuse bristle::equations::Real;\n\n", 1))
}
