//! Derives the equations of motion, whole or as the kernels of the solver, in a form for people or
//! for other programs.

use std::io::{self, Write};
use std::ops::RangeInclusive;

use crate::languages::{self, SourceFile};
use crate::print::{self, PageForm, Walkthrough};
use bristle::equations::VERSION;
use bristle::model::settings::Settings;
use bristle::simulation::{Form, Pass};
use bristle_codegen::MAKER;
use bristle_codegen::back::json::to_json;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::ir::unit::Unit;
use bristle_codegen::model::kernels::{kernels, planar_kernels};
use bristle_codegen::model::lagrange::{WholeEquations, whole_equations_with};
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::specialise::substitute;

pub use bristle_codegen::model::chain::{Motion, RelaxedShape};

/// Name of the engine in an exported graph.
const GENERATOR: &str = concat!("bristle-codegen ", env!("CARGO_PKG_VERSION"));

/// Number of LaTeX pages of the whole equations, over the cube of the number of segments: measured
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
        /// Motion of the chain.
        motion: Motion,
        /// Shape of the filament, whose constants the forms for reading state. The forms for
        /// programs take the constants of any filament.
        shape: RelaxedShape,
    },
    /// All kernels of one segment and one joint, which the solver loops over: for motion in space,
    /// for motion in the plane of rotation, and for the lateral variation of a planar motion.
    Kernels,
    /// Those kernels without the ones for motion in space.
    PlanarKernels,
}

impl Equations {
    /// Returns the whole equations of the filament of `settings`, in the plane of rotation if its
    /// tool, clamp, workpiece and gravity keep it there.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let motion = match Pass::new(settings).form() {
            Form::Planar => Motion::Planar,
            Form::Spatial => Motion::Spatial,
        };
        let filament = &settings.filament;
        Self::Whole {
            segments: filament.segments,
            motion,
            shape: RelaxedShape {
                is_straight: filament.waviness_amplitude_m == 0.0,
                is_cylinder: filament.tip_diameter_m() == filament.diameter_m,
            },
        }
    }

    /// Returns the equations for motion in the plane of rotation.
    #[must_use]
    pub fn in_plane(self) -> Self {
        match self {
            Self::Whole {
                segments, shape, ..
            } => Self::Whole {
                segments,
                motion: Motion::Planar,
                shape,
            },
            Self::Kernels | Self::PlanarKernels => Self::PlanarKernels,
        }
    }

    /// Returns the equations for filaments of `required`, in addition to their own shape.
    ///
    /// # Errors
    /// If the shape is required of kernels, or of a `format` for programs, which both take the
    /// constants of any filament.
    pub fn of_shape(self, required: RelaxedShape, format: DeriveFormat) -> Result<Self, String> {
        match self {
            _ if required == RelaxedShape::default() => Ok(self),
            Self::Whole {
                segments,
                motion,
                shape,
            } if format.is_for_reading() => Ok(Self::Whole {
                segments,
                motion,
                shape: RelaxedShape {
                    is_straight: shape.is_straight || required.is_straight,
                    is_cylinder: shape.is_cylinder || required.is_cylinder,
                },
            }),
            Self::Whole { .. } => Err(format!(
                "{} takes the constants of any filament: leave out uniform and straight, or choose another format",
                format.name()
            )),
            Self::Kernels | Self::PlanarKernels => {
                Err("the kernels are those of any filament: leave out uniform and straight".into())
            }
        }
    }

    /// The command that derives the equations: the same for a file and for its number of segments,
    /// motion and shape.
    fn command(self, format: DeriveFormat) -> String {
        let mut command = "bristle derive".to_owned();
        let (is_planar, shape) = match self {
            Self::Whole {
                segments,
                motion,
                shape,
            } => {
                command += &format!(" --segments {segments}");
                (motion == Motion::Planar, shape)
            }
            Self::Kernels | Self::PlanarKernels => {
                command += " --kernels";
                (self == Self::PlanarKernels, RelaxedShape::default())
            }
        };
        let is_read = format.is_for_reading();
        let switches = [
            (is_planar, "--planar"),
            (is_read && shape.is_cylinder, "--uniform"),
            (is_read && shape.is_straight, "--straight"),
        ];
        for (_, switch) in switches.iter().filter(|(is_on, _)| *is_on) {
            command += &format!(" {switch}");
        }
        command += &format!(" --format {}", format.name());
        if format.has_files() {
            command += " --out .";
        }
        command
    }

    /// Title of the equations.
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

    /// Estimates the number of pages in a `format` that writes the equations out for people; `None`
    /// for others, and for kernels.
    ///
    /// The whole equations are sums over the masses and over pairs of the segments inside each.
    /// Their length grows with the cube of the number of segments. The estimate is that of LaTeX.
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
        let is_page = format.is_for_reading() && format != DeriveFormat::Sympy;
        is_page.then(|| (share * (segments as f64).powi(3)).ceil() as usize)
    }

    /// Derives the equations of any filament with shared structure, for programs.
    ///
    /// # Errors
    /// If a term of the derivation makes no physical sense.
    pub(crate) fn for_computing(self) -> Result<Vec<Kernel>, String> {
        self.derived(|_| Purpose::Computing)
    }

    /// Derives the equations of this shape as sums of products.
    fn for_reading(self) -> Result<Vec<Kernel>, String> {
        self.derived(Purpose::ReadingOf)
    }

    /// Derives them as [`Self::for_reading`]. In the plane the angle of the clamp's joint is that
    /// between two directions, by `atan2`: NumPy has no hypergeometric function.
    fn for_sympy(self) -> Result<Vec<Kernel>, String> {
        let Self::Whole {
            segments,
            motion: Motion::Planar,
            shape,
        } = self
        else {
            return self.for_reading();
        };
        planar_equations(segments, shape).kernels(Purpose::ReadingOf(shape))
    }

    fn derived(self, purpose: impl Fn(RelaxedShape) -> Purpose) -> Result<Vec<Kernel>, String> {
        match self {
            Self::Whole {
                segments,
                motion,
                shape,
            } => whole_kernels(segments, motion, purpose(shape)),
            Self::Kernels => kernels(),
            Self::PlanarKernels => planar_kernels(),
        }
    }
}

/// The planar equations, in which the spring of the clamp stores `½ c α²`, where `α = atan2(e0 × e,
/// e0·e)`.
fn planar_equations(segments: usize, shape: RelaxedShape) -> WholeEquations {
    // α is the difference of two azimuths, of which that of `e0` is a symbol until all derivatives
    // are taken. Its sine and cosine are smooth, but not its azimuth.
    let mut angle = None;
    let mut equations = whole_equations_with(segments, Motion::Planar, shape, |terms| {
        let (segment, hinge) = (terms.segments[0], terms.parameters.hinges[0]);
        let g = &mut terms.graph;
        let azimuth = g.sub(segment.theta, hinge.relaxed_angle);
        let of_clamp = g.symbol("clamp_azimuth", "θ0", Unit::RADIAN);
        let difference = g.sub(azimuth, of_clamp);
        let (half, square) = (g.ratio(1, 2), g.powi(difference, 2));
        let energy = g.mul(hinge.stiffness, square);
        terms.spring[0] = g.mul(half, energy);
        let [cosine, sine] = [g.cos(azimuth), g.sin(azimuth)];
        let [x, y, _] = terms.clamp.direction;
        let (a, b) = (g.mul(x, sine), g.mul(y, cosine));
        let across = g.sub(a, b);
        let along = g.dot(&[x, y], &[cosine, sine]);
        angle = Some((difference, g.atan2(across, along)));
    });
    let values = angle.into_iter().collect();
    let energy = [equations.spring_energy];
    let g = &mut equations.graph;
    equations.spring_energy = substitute(g, &energy, &values)[0];
    equations.force = substitute(g, &equations.force, &values);
    equations
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

            /// The name on the command line, and its meaning.
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

    /// The description in the help.
    #[must_use]
    pub fn help(self) -> &'static str {
        self.words()[1]
    }

    /// `true` for the forms with sums of products of the constants: those for people, and that of
    /// SymPy.
    #[must_use]
    pub fn is_for_reading(self) -> bool {
        matches!(
            self,
            Self::Math | Self::Latex | Self::Markdown | Self::Sympy
        )
    }

    /// `true` for the forms of several files.
    fn has_files(self) -> bool {
        matches!(self, Self::C | Self::Matlab)
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
    Text(DerivedText),
    /// Several files that belong together.
    Files(Vec<SourceFile>),
}

/// A text that is made while it is written: texts for people can be much longer than their source.
pub struct DerivedText(Content);

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

impl DerivedText {
    /// Writes the text.
    ///
    /// # Errors
    /// If `out` cannot be written to.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let maker = maker();
        match &self.0 {
            Content::Text(text) => out.write_all(text.as_bytes()),
            Content::Page {
                form,
                equations,
                kernels,
                again,
            } => {
                let origin = Origin {
                    title: &equations.title(),
                    maker: &maker,
                    again,
                };
                match *equations {
                    Equations::Whole {
                        segments,
                        motion,
                        shape,
                    } => print::equations(out, *form, segments, motion, shape, kernels, origin),
                    _ => print::kernels(out, *form, kernels, origin),
                }
            }
            Content::Walkthrough { walkthrough, again } => walkthrough.write(out, &maker, again),
        }
    }
}

/// The engine that derives the equations, and the program with the derivation that built it.
fn maker() -> String {
    format!("{MAKER}, in bristle {VERSION}")
}

const NO_SEGMENTS: &str = "a filament must have at least one segment";

/// Derives `equations` and writes them in `format`.
///
/// # Errors
/// If there are no segments, or a form cannot be written.
pub fn derive(equations: Equations, format: DeriveFormat) -> Result<Derived, String> {
    let again = equations.command(format);
    let title = format!("{}.", equations.title());
    let maker = maker();
    let origin = Origin {
        title: &title,
        maker: &maker,
        again: &again,
    };
    check(equations)?;
    let computing = || equations.for_computing();
    Ok(match format {
        DeriveFormat::Math => for_people(equations, PageForm::Text, again)?,
        DeriveFormat::Latex => for_people(equations, PageForm::Latex, again)?,
        DeriveFormat::Markdown => for_people(equations, PageForm::Markdown, again)?,
        DeriveFormat::Json => text(
            to_json(&computing()?, &format!("{GENERATOR}, in bristle {VERSION}"))
                .map_err(|error| format!("cannot write the graph as JSON: {error}"))?,
        ),
        DeriveFormat::Rust => text(languages::rust::emit_generic(&computing()?, origin)?),
        DeriveFormat::RustF64 => text(languages::rust::emit(&computing()?, origin)?),
        DeriveFormat::Numpy => text(languages::numpy::emit(&computing()?, origin)?),
        DeriveFormat::Sympy => text(languages::sympy::emit(&equations.for_sympy()?, origin)?),
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

/// Widths of the text that equations for a paper can have, in mm.
pub const FRAGMENT_WIDTHS_MM: RangeInclusive<f64> = 65.0..=300.0;
/// Width of the text of LaTeX's class `article`, in mm.
pub const ARTICLE_WIDTH_MM: f64 = 121.0;
/// An em of type of 10 pt, in mm.
const EM_MM: f64 = 10.0 * 25.4 / 72.27;

/// Derives `equations` as LaTeX for a paper: without a preamble or sentences, with vectors,
/// matrices and labels, on lines of at most `width_mm` in type of 10 pt.
///
/// # Errors
/// If there are no segments, or the width is not one of [`FRAGMENT_WIDTHS_MM`].
pub fn derive_fragment(equations: Equations, width_mm: f64) -> Result<Derived, String> {
    if !FRAGMENT_WIDTHS_MM.contains(&width_mm) {
        let [least, most] = [FRAGMENT_WIDTHS_MM.start(), FRAGMENT_WIDTHS_MM.end()];
        return Err(format!(
            "the width of a fragment must be {least} mm to {most} mm"
        ));
    }
    check(equations)?;
    // The command states the width in few digits.
    let width_mm = (width_mm * 1e2).round() / 1e2;
    let mut again = format!("{} --fragment", equations.command(DeriveFormat::Latex));
    if width_mm != ARTICLE_WIDTH_MM {
        again += &format!(" --width {width_mm}mm");
    }
    let width = (width_mm / EM_MM * 1e3) as usize;
    for_people(equations, PageForm::Fragment { width }, again)
}

fn check(equations: Equations) -> Result<(), String> {
    match equations {
        Equations::Whole { segments: 0, .. } => Err(NO_SEGMENTS.into()),
        _ => Ok(()),
    }
}

fn text(text: String) -> Derived {
    Derived::Text(DerivedText(Content::Text(text)))
}

fn for_people(equations: Equations, form: PageForm, again: String) -> Result<Derived, String> {
    Ok(Derived::Text(DerivedText(match equations {
        Equations::Whole {
            segments,
            motion,
            shape,
        } if form == PageForm::Markdown => Content::Walkthrough {
            walkthrough: Box::new(Walkthrough::new(segments, motion, shape)?),
            again,
        },
        _ => Content::Page {
            form,
            equations,
            kernels: equations.for_reading()?,
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
