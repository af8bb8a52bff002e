//! Derives the equations of motion, whole or as the kernels of the solver, in a form for people or
//! for other programs.

use std::io::{self, Write};

use crate::languages::{self, SourceFile};
use crate::print::{self, PageForm, Walkthrough};
use bristle_codegen::MAKER;
use bristle_codegen::back::json::to_json;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::model::kernels::{kernels, planar_kernels};
use bristle_codegen::model::whole::{Purpose, whole_kernels};

pub use bristle_codegen::model::chain::{Motion, Shape};

/// The generator stated in an exported graph.
const GENERATOR: &str = concat!("bristle-codegen ", env!("CARGO_PKG_VERSION"));

/// Pages of LaTeX that the whole equations take, over the cube of the number of segments: measured
/// at 25 segments, with 45 lines a page.
const PAGES_PER_CUBE: f64 = 0.043;
const PLANAR_PAGES_PER_CUBE: f64 = 0.0053;

/// The equations to derive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equations {
    /// The whole equations of a chain with this number of segments.
    Whole {
        /// Number of segments.
        segments: usize,
        /// How the chain moves.
        motion: Motion,
        /// What the equations for people need not state. Those for programs take the constants of
        /// any filament.
        shape: Shape,
    },
    /// All kernels of one segment and one joint, which the solver loops over: for motion in space,
    /// for motion in the plane of rotation, and for the lateral variation of a planar motion.
    Kernels,
    /// Those kernels without the ones for motion in space.
    PlanarKernels,
}

impl Equations {
    /// The command that derives them.
    fn command(self, format: DeriveFormat) -> String {
        let equations = match self {
            Self::Whole { shape, .. } if shape != Shape::default() => "FILE.toml".into(),
            Self::Whole {
                segments,
                motion: Motion::Spatial,
                ..
            } => format!("--segments {segments}"),
            Self::Whole {
                segments,
                motion: Motion::Planar,
                ..
            } => format!("--segments {segments} --planar"),
            Self::Kernels => "--kernels".into(),
            Self::PlanarKernels => "--kernels --planar".into(),
        };
        format!("bristle derive {equations} --format {}", format.name())
    }

    /// Their title.
    fn title(self) -> String {
        match self {
            Self::Whole {
                segments, motion, ..
            } => print::title(segments, motion),
            Self::Kernels => "Kernels of the solver".into(),
            Self::PlanarKernels => {
                "Kernels of the solver for motion in the plane of rotation".into()
            }
        }
    }

    /// About how many pages they take in a `format` that writes them out for people; none for the
    /// others, and for kernels.
    ///
    /// The whole equations are sums over the masses and over pairs of the segments inside each, so
    /// that their length grows with the cube of the number of segments. The estimate is that of
    /// LaTeX.
    #[must_use]
    pub fn pages(self, format: DeriveFormat) -> Option<usize> {
        let Self::Whole {
            segments, motion, ..
        } = self
        else {
            return None;
        };
        let share = match motion {
            Motion::Spatial => PAGES_PER_CUBE,
            Motion::Planar => PLANAR_PAGES_PER_CUBE,
        };
        let is_read = matches!(
            format,
            DeriveFormat::Math | DeriveFormat::Latex | DeriveFormat::Markdown
        );
        is_read.then(|| (share * (segments as f64).powi(3)).ceil() as usize)
    }

    /// Derives them.
    ///
    /// # Errors
    /// If a term of the derivation makes no physical sense.
    pub(crate) fn derived(self, purpose: Purpose) -> Result<Vec<Kernel>, String> {
        match self {
            Self::Whole {
                segments, motion, ..
            } => whole_kernels(segments, motion, purpose),
            Self::Kernels => kernels(),
            Self::PlanarKernels => planar_kernels(),
        }
    }
}

/// Declares the forms of equations and their list.
macro_rules! formats {
    ($($format:ident = $name:literal: $help:literal,)*) => {
        /// The form of the equations.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum DeriveFormat {
            $(#[doc = $help] $format,)*
        }

        impl DeriveFormat {
            /// All forms.
            pub const ALL: &[Self] = &[$(Self::$format),*];

            /// The name on the command line, and what it stands for.
            fn words(self) -> [&'static str; 2] {
                match self {
                    $(Self::$format => [$name, $help],)*
                }
            }
        }
    };
}

formats! {
    Math = "math": "Readable mathematics, as text",
    Latex = "latex": "A LaTeX document",
    Markdown = "markdown": "A page with formulas; for whole equations, the derivation from the energies",
    Rust = "rust": "Rust source, generic over the scalar type",
    RustF64 = "rust-f64": "A Rust module on f64, without dependencies",
    Json = "json": "The expression graph",
    C = "c": "C11, a header and a source file",
    Matlab = "matlab": "Function files for MATLAB and GNU Octave; with --segments also one_pass.m, which integrates a contact",
    Numpy = "numpy": "A Python module on NumPy arrays",
    Sympy = "sympy": "A Python module that makes SymPy matrices; takes minutes beyond 100 segments",
}

impl DeriveFormat {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.words()[0]
    }

    /// What it is, for the help.
    #[must_use]
    pub fn help(self) -> &'static str {
        self.words()[1]
    }

    /// The form of this name.
    #[must_use]
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .copied()
            .find(|format| format.name() == name)
    }
}

/// Equations in some form.
pub enum Derived {
    /// One text.
    Text(Document),
    /// Several files that belong together.
    Files(Vec<SourceFile>),
}

/// A text that is made as it is written: those for people can be much longer than what they are
/// made from.
pub struct Document(Content);

enum Content {
    Text(String),
    Page {
        form: PageForm,
        equations: Equations,
        kernels: Vec<Kernel>,
        again: String,
    },
    Walkthrough {
        walkthrough: Box<Walkthrough>,
        again: String,
    },
}

impl Document {
    /// Writes the text.
    ///
    /// # Errors
    /// If `out` cannot be written to.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        match &self.0 {
            Content::Text(text) => out.write_all(text.as_bytes()),
            Content::Page {
                form,
                equations:
                    Equations::Whole {
                        segments,
                        motion,
                        shape,
                    },
                kernels,
                again,
            } => print::equations(out, *form, *segments, *motion, *shape, kernels, again),
            Content::Page {
                form,
                equations,
                kernels,
                again,
            } => print::kernels(out, *form, &equations.title(), kernels, again),
            Content::Walkthrough { walkthrough, again } => walkthrough.write(out, again),
        }
    }
}

const NO_SEGMENTS: &str = "a filament must have at least one segment";

/// Derives `equations` and writes them in `format`.
///
/// # Errors
/// If there are no segments, or a form cannot be written.
pub fn derive(equations: Equations, format: DeriveFormat) -> Result<Derived, String> {
    if matches!(equations, Equations::Whole { segments: 0, .. }) {
        return Err(NO_SEGMENTS.to_owned());
    }
    let again = equations.command(format);
    let title = format!("{}.", equations.title());
    let origin = Origin {
        title: &title,
        maker: MAKER,
        again: &again,
    };
    let computing = || equations.derived(Purpose::Computing);
    Ok(match format {
        DeriveFormat::Math => for_people(equations, PageForm::Text, again.clone())?,
        DeriveFormat::Latex => for_people(equations, PageForm::Latex, again.clone())?,
        DeriveFormat::Markdown => for_people(equations, PageForm::Markdown, again.clone())?,
        DeriveFormat::Json => text(
            to_json(&computing()?, GENERATOR)
                .map_err(|error| format!("cannot write the graph as JSON: {error}"))?,
        ),
        DeriveFormat::Rust => text(languages::rust::emit_generic(&computing()?, origin)?),
        DeriveFormat::RustF64 => text(languages::rust::emit(&computing()?, origin)?),
        DeriveFormat::Numpy => text(languages::numpy::emit(&computing()?, origin)?),
        DeriveFormat::Sympy => text(languages::sympy::emit(
            &equations.derived(Purpose::Reading)?,
            origin,
        )?),
        DeriveFormat::C => Derived::Files(languages::c::emit(&computing()?, origin)?),
        DeriveFormat::Matlab => {
            let mut files = languages::matlab::emit(&computing()?, origin)?;
            if let Equations::Whole {
                segments, motion, ..
            } = equations
            {
                files.push(one_pass(segments, motion));
            }
            Derived::Files(files)
        }
    })
}

/// Derives `equations` as LaTeX for a paper: without a preamble or sentences, with vectors,
/// matrices and labels.
///
/// # Errors
/// If there are no segments.
pub fn derive_fragment(equations: Equations) -> Result<Derived, String> {
    if matches!(equations, Equations::Whole { segments: 0, .. }) {
        return Err(NO_SEGMENTS.to_owned());
    }
    let again = format!("{} --fragment", equations.command(DeriveFormat::Latex));
    for_people(equations, PageForm::Fragment, again)
}

fn text(text: String) -> Derived {
    Derived::Text(Document(Content::Text(text)))
}

fn for_people(equations: Equations, form: PageForm, again: String) -> Result<Derived, String> {
    Ok(Derived::Text(Document(match equations {
        Equations::Whole {
            segments, motion, ..
        } if form == PageForm::Markdown => Content::Walkthrough {
            walkthrough: Box::new(Walkthrough::new(segments, motion)?),
            again,
        },
        Equations::Whole { shape, .. } => Content::Page {
            form,
            equations,
            kernels: equations.derived(Purpose::ReadingOf(shape))?,
            again,
        },
        _ => Content::Page {
            form,
            equations,
            kernels: equations.derived(Purpose::Reading)?,
            again,
        },
    })))
}

/// A MATLAB function that integrates one pass with the whole equations, MODEL "One contact".
fn one_pass(segments: usize, motion: Motion) -> SourceFile {
    let [start, clamp, nodes, loads] = match motion {
        Motion::Planar => [
            "  start = [tool.start_angle * ones(n, 1); tool.rate * ones(n, 1); 0];",
            "  radial = [cos(beta); sin(beta)];\n  across = [-sin(beta); cos(beta)];\n  clamp.angular_velocity = tool.rate;",
            "  heights = clamp.position(2) + chain.h * cumsum(sin(q));",
            "  Q = chain.h * cos(q) .* outer;",
        ],
        Motion::Spatial => [
            "  start = [repmat([pi/2; tool.start_angle], n, 1); repmat([0; tool.rate], n, 1); 0];",
            "  radial = [cos(beta); sin(beta); 0];\n  across = [-sin(beta); cos(beta); 0];\n  clamp.angular_velocity = [0; 0; tool.rate];",
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
    SourceFile {
        name: "one_pass.m".into(),
        text,
    }
}
