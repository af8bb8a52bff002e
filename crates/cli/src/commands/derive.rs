//! `bristle derive`.

use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::ExitCode;

use bristle_files::staged::{StagedFile, directory_of, occupy};
use bristle_inspect::derive::{DeriveFormat, Equations, Motion, derive};
use clap::{Args, ValueEnum};

use crate::error::CliError;
use crate::terminal::{print, say_written};
use crate::values::parse_count;

/// Show the equations of motion of a filament
///
/// Shows either the whole equations of N segments, or the kernels of one segment and one joint that the solver loops over.
/// With --planar, the filament moves in the plane of rotation, and each segment has one coordinate instead of two.
#[derive(Args)]
pub struct DeriveArgs {
    #[command(flatten)]
    equations: EquationsArgs,
    /// For motion in the plane of rotation; with --kernels only those for it and for its lateral variation, instead of all
    #[arg(long)]
    planar: bool,
    /// Form of the equations; math, latex and markdown are meant for reading and take minutes beyond 100 segments
    #[arg(long, value_enum, default_value_t = Format::Math)]
    format: Format,
    /// File to write instead of stdout
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
pub struct EquationsArgs {
    /// The whole equations of N segments, 1 to 400
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "filament.segments"))]
    segments: Option<usize>,
    /// The kernels of the solver: in space, in the plane of rotation, and of its lateral variation
    #[arg(long)]
    kernels: bool,
}

impl From<&DeriveArgs> for Equations {
    fn from(arguments: &DeriveArgs) -> Self {
        let motion = if arguments.planar { Motion::Planar } else { Motion::Spatial };
        // clap accepts either a number of segments or the kernels.
        match arguments.equations.segments {
            Some(segments) => Self::Whole { segments, motion },
            None if arguments.planar => Self::PlanarKernels,
            None => Self::Kernels,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Format {
    /// Readable mathematics, as text
    Math,
    /// A LaTeX document
    Latex,
    /// A page with formulas; for whole equations, the derivation from the energies
    Markdown,
    /// Rust source
    Rust,
    /// The expression graph
    Json,
}

impl From<Format> for DeriveFormat {
    fn from(format: Format) -> Self {
        match format {
            Format::Math => Self::Math,
            Format::Latex => Self::Latex,
            Format::Markdown => Self::Markdown,
            Format::Rust => Self::Rust,
            Format::Json => Self::Json,
        }
    }
}

/// Runs the command.
pub fn run(arguments: &DeriveArgs) -> Result<ExitCode, CliError> {
    let equations = derive(arguments.into(), arguments.format.into())?;
    match &arguments.out {
        None => print(&equations)?,
        Some(path) => {
            let name = path.file_name().and_then(OsStr::to_str);
            let _occupied = occupy(directory_of(path), &[("", &|leftover| Some(leftover) == name)])?;
            let file = StagedFile::write(path.clone(), |out| out.write_all(equations.as_bytes()))?;
            say_written(&file.commit()?);
        }
    }
    Ok(ExitCode::SUCCESS)
}
