//! Derives the equations of motion, whole or as the kernels of the solver, in a form for people or for other programs.

use bristle_codegen::MAKER;
use bristle_codegen::back::json::to_json;
use bristle_codegen::back::print::{self, Form};
use bristle_codegen::back::rust::{EmitError, Origin, emit};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::model::kernels::{kernels, planar_kernels};
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::dimension::DimensionError;

pub use bristle_codegen::model::chain::Motion;

/// The generator stated in an exported graph.
const GENERATOR: &str = concat!("bristle-codegen ", env!("CARGO_PKG_VERSION"));

/// The equations to derive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equations {
    /// The whole equations of a chain with this number of segments.
    Whole {
        /// Number of segments.
        segments: usize,
        /// How the chain moves.
        motion: Motion,
    },
    /// All kernels of one segment and one joint, which the solver loops over: for motion in space, for motion in the plane of
    /// rotation, and for the lateral variation of a planar motion.
    Kernels,
    /// Those kernels without the ones for motion in space.
    PlanarKernels,
}

impl Equations {
    /// The command that derives them.
    fn command(self, format: DeriveFormat) -> String {
        let equations = match self {
            Self::Whole { segments, motion: Motion::Spatial } => format!("--segments {segments}"),
            Self::Whole { segments, motion: Motion::Planar } => format!("--segments {segments} --planar"),
            Self::Kernels => "--kernels".into(),
            Self::PlanarKernels => "--kernels --planar".into(),
        };
        format!("bristle derive {equations} --format {}", format.name())
    }

    /// Their title.
    fn title(self) -> String {
        match self {
            Self::Whole { segments, motion } => print::title(segments, motion),
            Self::Kernels => "Kernels of the solver".into(),
            Self::PlanarKernels => "Kernels of the solver for motion in the plane of rotation".into(),
        }
    }

    /// Derives them.
    ///
    /// # Errors
    /// If a term of the derivation makes no physical sense.
    pub(crate) fn derived(self, purpose: Purpose) -> Result<Vec<Kernel>, DimensionError> {
        match self {
            Self::Whole { segments, motion } => whole_kernels(segments, motion, purpose),
            Self::Kernels => kernels(),
            Self::PlanarKernels => planar_kernels(),
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
    if matches!(equations, Equations::Whole { segments: 0, .. }) {
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
        Equations::Kernels | Equations::PlanarKernels => {
            print::kernels(form, &equations.title(), &equations.derived(Purpose::Reading)?, &again)
        }
        Equations::Whole { segments, motion } if form == Form::Markdown => {
            print::walkthrough(segments, motion, &again)?
        }
        Equations::Whole { segments, motion } => {
            print::equations(form, segments, motion, &equations.derived(Purpose::Reading)?, &again)
        }
    })
}

fn written_for_programs(equations: Equations, format: DeriveFormat, again: &str) -> Result<String, DeriveError> {
    let kernels = equations.derived(Purpose::Computing)?;
    if format == DeriveFormat::Json {
        return Ok(to_json(&kernels, GENERATOR)?);
    }
    let title = format!("{}.", equations.title());
    let source = emit(&kernels, Origin { title: &title, maker: MAKER, again })?;
    // The import goes below the header, which ends at the first empty line.
    Ok(source.replacen("\n\n", "\n\nuse bristle::equations::Real;\n\n", 1))
}
