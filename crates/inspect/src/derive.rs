//! Derives the equations of motion, whole or as the kernels of the solver, in a form for people or for other programs.

use bristle_codegen::MAKER;
use bristle_codegen::back::json::to_json;
use bristle_codegen::back::languages::{self, SourceFile};
use bristle_codegen::back::print::{self, Form};
use bristle_codegen::back::rust::emit;
use bristle_codegen::back::source::{EmitError, Origin};
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
    /// C11: a header and a source file.
    C,
    /// Function files for MATLAB and GNU Octave; for whole equations also a script of one pass.
    Matlab,
    /// A Python module of functions on NumPy arrays.
    Numpy,
    /// A Python module of functions that return SymPy matrices.
    Sympy,
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
            Self::C => "c",
            Self::Matlab => "matlab",
            Self::Numpy => "numpy",
            Self::Sympy => "sympy",
        }
    }
}

/// Equations in some form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Derived {
    /// One text.
    Text(String),
    /// Several files that belong together.
    Files(Vec<SourceFile>),
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
pub fn derive(equations: Equations, format: DeriveFormat) -> Result<Derived, DeriveError> {
    if matches!(equations, Equations::Whole { segments: 0, .. }) {
        return Err(DeriveError::NoSegments);
    }
    let again = equations.command(format);
    let title = format!("{}.", equations.title());
    let origin = Origin { title: &title, maker: MAKER, again: &again };
    let computing = || equations.derived(Purpose::Computing);
    Ok(match format {
        DeriveFormat::Math => Derived::Text(written_for_people(equations, Form::Text, &again)?),
        DeriveFormat::Latex => Derived::Text(written_for_people(equations, Form::Latex, &again)?),
        DeriveFormat::Markdown => Derived::Text(written_for_people(equations, Form::Markdown, &again)?),
        DeriveFormat::Json => Derived::Text(to_json(&computing()?, GENERATOR)?),
        DeriveFormat::Rust => {
            let source = emit(&computing()?, origin)?;
            // The import goes below the header, which ends at the first empty line.
            Derived::Text(source.replacen("\n\n", "\n\nuse bristle::equations::Real;\n\n", 1))
        }
        DeriveFormat::Numpy => Derived::Text(languages::numpy::emit(&computing()?, origin)?),
        DeriveFormat::Sympy => Derived::Text(languages::sympy::emit(&equations.derived(Purpose::Reading)?, origin)?),
        DeriveFormat::C => Derived::Files(languages::c::emit(&computing()?, origin)?),
        DeriveFormat::Matlab => {
            let mut files = languages::matlab::emit(&computing()?, origin)?;
            if let Equations::Whole { segments, motion } = equations {
                files.push(one_pass(segments, motion));
            }
            Derived::Files(files)
        }
    })
}

fn written_for_people(equations: Equations, form: Form, again: &str) -> Result<String, DeriveError> {
    Ok(match equations {
        Equations::Kernels | Equations::PlanarKernels => {
            print::kernels(form, &equations.title(), &equations.derived(Purpose::Reading)?, again)
        }
        Equations::Whole { segments, motion } if form == Form::Markdown => print::walkthrough(segments, motion, again)?,
        Equations::Whole { segments, motion } => {
            print::equations(form, segments, motion, &equations.derived(Purpose::Reading)?, again)
        }
    })
}

/// A MATLAB function that integrates one pass with the whole equations, MODEL "One contact".
fn one_pass(segments: usize, motion: Motion) -> SourceFile {
    let [start, clamp, nodes, loads] = match motion {
        Motion::Planar => [
            "  start = [tool.start_angle * ones(n, 1); tool.rate * ones(n, 1); 0];",
            "  radial = [cos(beta); sin(beta)];\n  across = [-sin(beta); cos(beta)];",
            "  heights = clamp.position(2) + chain.h * cumsum(sin(q));",
            "  Q = chain.h * cos(q) .* outer;",
        ],
        Motion::Spatial => [
            "  start = [repmat([pi/2; tool.start_angle], n, 1); repmat([0; tool.rate], n, 1); 0];",
            "  radial = [cos(beta); sin(beta); 0];\n  across = [-sin(beta); cos(beta); 0];",
            "  phi = q(1:2:end);\n  theta = q(2:2:end);\n  heights = clamp.position(2) + chain.h * cumsum(sin(phi) .* sin(theta));",
            "  Q = chain.h * reshape([cos(phi) .* sin(theta) .* outer, sin(phi) .* cos(theta) .* outer]', [], 1);",
        ],
    };
    let text = include_str!("one_pass.m")
        .replace("@SEGMENTS@", &segments.to_string())
        .replace("@AXES@", &motion.axes().to_string())
        .replace("@PREFIX@", &motion.name_for(""))
        .replace("@START@", start)
        .replace("@CLAMP@", clamp)
        .replace("@NODES@", nodes)
        .replace("@LOADS@", loads);
    SourceFile { name: "one_pass.m".into(), text }
}
