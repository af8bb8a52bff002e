//! `bristle derive`.

use std::ffi::OsStr;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use bristle::simulation::{Form, Pass};
use bristle_grid::tentative;
use bristle_inspect::derive::{
    DeriveFormat, Derived, Equations, Motion, Shape, derive, derive_fragment,
};
use bristle_store::staged::{StagedFile, directory_of, occupy, prepare_directory};
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
/// With FILE.toml, they are the whole equations of its filament: with its number of segments, and
/// in the plane of rotation if its tool, clamp, workpiece and gravity keep it there. Those for
/// reading (math, latex) have no relaxed angles if it is straight, and one mass, inertia, stiffness
/// and damping if it is a cylinder.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct DeriveArgs {
    #[command(flatten)]
    equations: EquationsArgs,
    /// For motion in the plane of rotation; with --kernels only those for it and for its lateral
    /// variation, instead of all
    #[arg(long)]
    planar: bool,
    /// Form of the equations; math, latex and markdown are meant for reading and take minutes
    /// beyond 100 segments, see the note before them
    #[arg(long, default_value = DeriveFormat::Math.name(), value_parser = format())]
    format: DeriveFormat,
    /// Equations alone, for a paper: without preamble and sentences, with vectors, matrices and
    /// labels; for latex
    #[arg(long)]
    fragment: bool,
    /// File to write instead of stdout; for c and matlab, the directory of their files, which they
    /// require
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
pub struct EquationsArgs {
    /// The whole equations of the filament of an input file
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// The whole equations of N segments, 1 to 400
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "filament.segments"))]
    segments: Option<usize>,
    /// The kernels of the solver: in space, in the plane of rotation, and of its lateral variation
    #[arg(long)]
    kernels: bool,
}

/// What the arguments ask for. clap accepts one of a file, a number of segments, and the kernels.
fn equations(arguments: &DeriveArgs) -> Result<Equations, CliError> {
    let motion = if arguments.planar {
        Motion::Planar
    } else {
        Motion::Spatial
    };
    match &arguments.equations {
        EquationsArgs {
            file: Some(file), ..
        } => of_file(file, arguments.planar),
        EquationsArgs {
            segments: Some(segments),
            ..
        } => Ok(Equations::Whole {
            segments: *segments,
            motion,
            shape: Shape::default(),
        }),
        _ if arguments.planar => Ok(Equations::PlanarKernels),
        _ => Ok(Equations::Kernels),
    }
}

/// The whole equations of the filament that a file states; of a study, that of the first case.
fn of_file(file: &Path, planar: bool) -> Result<Equations, CliError> {
    let input = InputArgs {
        file: file.to_owned(),
        set: Vec::new(),
        strict: false,
    };
    let text = input.read()?;
    let document = text.document()?;
    let settings = match document.study() {
        Ok(study) => study.settings(0),
        Err(_) => document.settings()?,
    };
    let is_planar = planar || Pass::new(&tentative(settings.clone())).form() == Form::Planar;
    let motion = if is_planar {
        Motion::Planar
    } else {
        Motion::Spatial
    };
    let filament = &settings.filament;
    let shape = Shape {
        is_straight: filament.waviness_amplitude_m == 0.0,
        is_cylinder: filament.tip_diameter_m() == filament.diameter_m,
    };
    Ok(Equations::Whole {
        segments: filament.segments,
        motion,
        shape,
    })
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
const MOST_PAGES: usize = 200;

/// Runs the command.
pub fn run(arguments: &DeriveArgs) -> Result<(), CliError> {
    let (equations, format) = (equations(arguments)?, arguments.format);
    if let Some(pages) = equations.pages(format).filter(|pages| *pages > MOST_PAGES) {
        say(format_args!(
            "note: written out, these equations take some {pages} pages, which nobody reads, and grow with the cube of the number of \
             segments\n\
             help: derive fewer segments to read them; rust, json, c, matlab and numpy state them in short, with named intermediates"
        ));
    }
    let derived = match (arguments.fragment, format) {
        (false, _) => derive(equations, format),
        (true, DeriveFormat::Latex) => derive_fragment(equations),
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
