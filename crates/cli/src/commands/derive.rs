//! `bristle derive`.

use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::ExitCode;

use bristle_inspect::derive::{DeriveFormat, Equations, derive};
use clap::{Args, ValueEnum};

use crate::error::CliError;
use crate::files::{StagedFile, directory_of, occupy};
use crate::terminal::{print, say_written};
use crate::values::parse_count;

/// Show the equations of motion of a filament
///
/// Shows either the whole equations of N segments, or the kernels of one segment and one joint that the solver loops over.
#[derive(Args)]
pub struct DeriveArgs {
    #[command(flatten)]
    equations: EquationsArgs,
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
    /// The kernels of the solver
    #[arg(long)]
    kernels: bool,
}

impl From<&EquationsArgs> for Equations {
    fn from(arguments: &EquationsArgs) -> Self {
        // clap accepts exactly one of the two.
        arguments.segments.map_or(Self::Kernels, Self::Whole)
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
    let equations = derive((&arguments.equations).into(), arguments.format.into())?;
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
