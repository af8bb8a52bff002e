//! `bristle derive`.

use std::ffi::OsStr;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use bristle_app::report::drawing::format::parse_width;
use bristle_app::store::staged::{StagedFile, directory_of, occupy, prepare_directory};
use bristle_equations::derive::{
    ARTICLE_WIDTH_MM, DeriveFormat, Derived, Equations, Motion, RelaxedShape, derive,
    derive_fragment,
};
use bristle_study::grid::tentative;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use crate::error::CliError;
use crate::input::InputArgs;
use crate::terminal::{commit, print_by, say};
use crate::values::parse_count;

/// Show the equations of motion of a filament
///
/// Shows either the whole equations of N segments, or the kernels of one segment and one joint that
/// the solver loops over. With --planar, the filament moves in the plane of rotation, and each
/// segment has one coordinate instead of two.
///
/// With FILE.toml, they are the whole equations of its filament: with its number of segments, with
/// --planar if its tool, clamp, workpiece and gravity keep it in the plane of rotation, with
/// --uniform if it is a cylinder, and with --straight if it has no waves.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct DeriveArgs {
    #[command(flatten)]
    equations: EquationsArgs,
    /// State a key in place of the file, as in --set filament.segments=5; may be repeated
    #[arg(long, value_name = "KEY=VALUE", conflicts_with_all = ["segments", "kernels"])]
    set: Vec<String>,
    /// For motion in the plane of rotation; with --kernels only those for it and for its lateral
    /// variation, instead of all
    #[arg(long)]
    planar: bool,
    /// For a cylinder, with one mass, inertia, stiffness and damping; for math, latex, markdown and
    /// sympy
    #[arg(long, conflicts_with = "kernels")]
    uniform: bool,
    /// For a straight filament, without relaxed angles; for math, latex, markdown and sympy
    #[arg(long, conflicts_with = "kernels")]
    straight: bool,
    /// Form of the equations; math, latex and markdown are meant for reading and take minutes
    /// beyond 100 segments, see the note before them
    #[arg(long, default_value = DeriveFormat::Math.name(), value_parser = format())]
    format: DeriveFormat,
    /// Equations alone, for a paper: without preamble and sentences, with vectors, matrices and
    /// labels; for latex
    #[arg(long)]
    fragment: bool,
    /// Width of the text of the paper in type of 10pt, as 84mm, 3.3in, 239pt or the column of a
    /// journal, as for --figure-width of `bristle report` [default: 121mm, as in LaTeX's article]
    #[arg(long, value_name = "WIDTH", value_parser = parse_width, requires = "fragment")]
    width: Option<f64>,
    /// File to write instead of stdout; for c and matlab, the directory of their files, which they
    /// require
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
pub struct EquationsArgs {
    /// The whole equations of the filament of an input file; - reads it from stdin
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// The whole equations of N segments, 1 to 400
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "filament.segments"))]
    segments: Option<usize>,
    /// The kernels of the solver: in space, in the plane of rotation, and of its lateral variation
    #[arg(long)]
    kernels: bool,
}

/// The equations that the arguments ask for. clap accepts one of a file, a number of segments, and
/// the kernels.
fn equations(arguments: &DeriveArgs) -> Result<Equations, CliError> {
    let equations = match &arguments.equations {
        EquationsArgs {
            file: Some(file), ..
        } => of_file(file, &arguments.set)?,
        EquationsArgs {
            segments: Some(segments),
            ..
        } => Equations::Whole {
            segments: *segments,
            motion: Motion::Spatial,
            shape: RelaxedShape::default(),
        },
        _ => Equations::Kernels,
    };
    let shape = RelaxedShape {
        is_straight: arguments.straight,
        is_cylinder: arguments.uniform,
    };
    let equations = equations
        .of_shape(shape, arguments.format)
        .map_err(CliError::Derive)?;
    Ok(if arguments.planar {
        equations.in_plane()
    } else {
        equations
    })
}

/// The whole equations of the filament that a file states; of a study, that of the first case.
fn of_file(file: &Path, set: &[String]) -> Result<Equations, CliError> {
    let input = InputArgs {
        file: file.to_owned(),
        set: set.to_vec(),
        strict: false,
    };
    let text = input.read()?;
    let settings = text.document()?.first_settings()?;
    Ok(Equations::of(&tentative(settings)))
}

/// Reads the name of a form.
fn format() -> impl TypedValueParser<Value = DeriveFormat> {
    let names = DeriveFormat::ALL
        .iter()
        .map(|format| PossibleValue::new(format.name()).help(format.help()));
    PossibleValuesParser::new(names)
        .map(|name| DeriveFormat::find(&name).expect("clap accepts these names only"))
}

/// Longer equations are for nobody to read. Those of 17 segments in space have as many.
const MAX_PAGES: usize = 200;

/// Runs the command.
pub fn run(arguments: &DeriveArgs) -> Result<(), CliError> {
    let (equations, format) = (equations(arguments)?, arguments.format);
    if let Some(pages) = equations.pages(format).filter(|pages| *pages > MAX_PAGES) {
        say(format_args!(
            "note: written out, these equations take some {pages} pages, which nobody reads, and grow with the cube of the number of \
             segments\n\
             help: derive fewer segments to read them; rust, json, c, matlab and numpy state them in short, with named intermediates"
        ));
    }
    let width_mm = arguments.width.unwrap_or(ARTICLE_WIDTH_MM);
    let derived = match (arguments.fragment, format) {
        (false, _) => derive(equations, format),
        (true, DeriveFormat::Latex) => derive_fragment(equations, width_mm),
        (true, _) => return Err(CliError::NoFragment),
    }
    .map_err(CliError::Derive)?;
    match (derived, arguments.out.as_deref()) {
        (Derived::Text(text), None) => print_by(|| {
            let mut out = BufWriter::new(io::stdout().lock());
            text.write(&mut out)?;
            out.flush()
        })?,
        (Derived::Text(text), Some(path)) => {
            let name = path.file_name().and_then(OsStr::to_str);
            let _occupied = occupy(
                directory_of(path),
                &[("", &|leftover| Some(leftover) == name)],
            )?;
            commit([StagedFile::write(path.to_owned(), |out| text.write(out))?])?;
        }
        (Derived::Files(files), out) => {
            let directory = out.ok_or(CliError::NoDirectory)?;
            prepare_directory(directory)?;
            let _occupied = occupy(
                directory,
                &[("", &|name| files.iter().any(|file| file.name == name))],
            )?;
            let staged: Result<Vec<StagedFile>, _> = files
                .iter()
                .map(|file| StagedFile::text(directory, &file.name, &file.text))
                .collect();
            commit(staged?)?;
        }
    }
    Ok(())
}
