//! The errors that end a command early, and their exit statuses.

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bristle::brush::BrushError;
use bristle::simulation::SimulationError;
use bristle_app::insight::convergence::ConvergenceError;
use bristle_app::insight::joined::JoinError;
use bristle_app::report::drawing::format::FormatError;
use bristle_app::run::RunError;
use bristle_app::run::brush::UnusableCheckpoint;
use bristle_app::run::calibration::CalibrationError;
use bristle_app::store::journal_file::JournalFileError;
use bristle_app::store::staged::{DocumentError, FileError};
use bristle_app::store::study_files::STUDY;
use bristle_equations::evaluation::EvaluationError;
use bristle_study::input::explain::UnknownKey;
use bristle_study::input::input_error::InputError;
use bristle_study::input::table::DataError;
use bristle_study::text::shown_path;

/// Exit status if the input or the call is wrong.
const BAD_INPUT: u8 = 2;
/// Exit status if a simulation failed.
pub const SIMULATION_FAILED: u8 = 3;

/// An error that ends a command early.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Document(#[from] DocumentError),
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Data(#[from] DataError),
    /// An error in a file, or in the settings that it states.
    #[error("{}: {error}", shown_path(path))]
    In {
        path: PathBuf,
        error: Box<dyn Error>,
    },
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// The equations cannot be shown.
    #[error("{0}")]
    Derive(String),
    #[error("--fragment is a part of a LaTeX document: add --format latex")]
    NoFragment,
    #[error("this form of the equations is several files; name their directory by --out DIR")]
    NoDirectory,
    #[error("the simulation failed: {0}")]
    Simulation(#[from] SimulationError),
    #[error("the simulation failed: {0}")]
    BrushFailed(Box<BrushError>),
    /// Nothing can be said of the precision that a contact needs.
    #[error("{}: {error}", shown_path(path))]
    Convergence {
        path: PathBuf,
        error: ConvergenceError,
    },
    /// The checkpoint in the directory of a brush does not belong to this simulation.
    #[error(transparent)]
    Checkpoint(#[from] UnusableCheckpoint),
    /// Figures cannot have the size or the font.
    #[error(transparent)]
    Format(#[from] FormatError),
    #[error(
        "`{}` has neither {STUDY} nor case.json nor brush.json\n   = help: name a directory that `bristle study` or \
         `bristle simulate` has written to; if an older version wrote it, run the command again",
        shown_path(.0)
    )]
    NoResults(PathBuf),
    #[error(
        "`{}` has no {STUDY}\n   = help: name a directory that `bristle study` has written to; if an older version wrote it, run the command \
         again",
        shown_path(.0)
    )]
    NoStudy(PathBuf),
    #[error(
        "`{}` has one shard of a study\n   = help: `bristle report` makes results of all shards",
        shown_path(.0)
    )]
    Shard(PathBuf),
    #[error("name the directory for the study by --out DIR")]
    NoOut,
    #[error(
        "some of the directories are shards of a study, and others have results\n   = help: name all shards of one study to \
         join them, or finished studies to compare them"
    )]
    NotAllShards,
    #[error("`{}` is a shard of another study than the first directory", shown_path(.0))]
    OtherShard(PathBuf),
    /// Studies that cannot be compared.
    #[error(transparent)]
    Join(#[from] Box<JoinError>),
    #[error("`{}` holds a study of its own: choose another directory for the comparison", shown_path(.0))]
    OfAStudy(PathBuf),
    #[error("cannot start threads: {0}")]
    Threads(io::Error),
    #[error(transparent)]
    Journal(#[from] JournalFileError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    #[error(
        "{missing} of {total} cases are in none of the shards; those that are, are in `{}`\n   = help: simulate the missing shards \
         and join them again, or simulate the missing cases by `bristle study` with the same --out",
        shown_path(path)
    )]
    Incomplete {
        path: PathBuf,
        missing: usize,
        total: usize,
    },
    #[error(transparent)]
    UnknownKey(#[from] UnknownKey),
    #[error("`{}` exists already: choose another name, or remove it", shown_path(.0))]
    Exists(PathBuf),
    #[error("without a terminal to ask at, state {0}")]
    Unanswered(String),
    #[error(
        "--vtk: this program was built without VTK\n   = help: build it with `--features vtk`, as docs/results.md says"
    )]
    NoVtk,
    /// An option that does not apply to this input file.
    #[error("{option} is for {remedy}")]
    Option {
        option: &'static str,
        remedy: &'static str,
    },
    /// An answer to a question that the setting cannot have.
    #[error("{0}")]
    Answer(String),
    /// The arguments are wrong. Its text begins with `error:` and shows how to call the program.
    #[error("{}", .0.render())]
    Call(clap::Error),
    #[error("cannot write to stdout: {0}")]
    Stdout(#[from] io::Error),
}

impl From<BrushError> for CliError {
    fn from(error: BrushError) -> Self {
        Self::BrushFailed(Box::new(error))
    }
}

impl CliError {
    /// Creates an error in the file at `path`, or in the settings that it states.
    pub fn of(path: &Path, error: impl Into<Box<dyn Error>>) -> Self {
        Self::In {
            path: path.to_owned(),
            error: error.into(),
        }
    }

    /// Returns the message for the user.
    pub fn message(&self) -> String {
        match self {
            Self::Call(_) => self.to_string().trim_end().to_owned(),
            _ => format!("error: {self}"),
        }
    }

    /// Creates the error that ended the evaluation of a brush. Without a steady stretch of columns
    /// the settings are wrong.
    pub fn after(path: &Path, error: BrushError) -> Self {
        match error {
            BrushError::TooFewColumns { .. } => Self::of(path, error),
            _ => error.into(),
        }
    }

    /// Returns the exit status of a command that ends with this error.
    pub fn status(&self) -> ExitCode {
        match self {
            Self::Simulation(_)
            | Self::BrushFailed(_)
            | Self::Convergence {
                error: ConvergenceError::Stated(_),
                ..
            } => SIMULATION_FAILED.into(),
            _ => BAD_INPUT.into(),
        }
    }
}
