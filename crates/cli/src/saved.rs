//! Reads saved results from the directory that a command has written them to.

use std::path::{Path, PathBuf};

use bristle::equations::FINGERPRINT;
use bristle::model::settings::Settings;
use bristle::simulation::Sample;
use bristle_study::results::{DataError, SavedStudy, read_case, read_history, read_runs, read_study};
use bristle_study::study::CaseResult;
use thiserror::Error;

use crate::files::{FileError, read_results};
use crate::terminal::say;

/// Names of the files.
pub const STUDY: &str = "study.json";
pub const CASE: &str = "case.json";
pub const RUNS: &str = "runs.csv";
pub const RUNS_PARQUET: &str = "runs.parquet";
pub const HISTORY: &str = "history.csv";
pub const HISTORY_PARQUET: &str = "history.parquet";

/// Why saved results cannot be used.
#[derive(Debug, Error)]
pub enum SavedError {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file does not hold what it should.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A directory has no results.
    #[error(
        "`{}` has neither {STUDY} nor {CASE}\n   = help: name a directory that `bristle study` or `bristle simulate` \
         has written to; if an older version wrote it, run the command again",
        .0.display()
    )]
    NoResults(PathBuf),
    /// A directory has no results of a study.
    #[error(
        "`{}` has no {STUDY}\n   = help: advice compares the cases of a study; name a directory that `bristle study` has \
         written to; if an older version wrote it, run the command again",
        .0.display()
    )]
    NoStudy(PathBuf),
}

/// The study in a directory, with its results; `None` if there is no study.
pub fn saved_study(directory: &Path) -> Result<Option<(SavedStudy, Vec<CaseResult>)>, SavedError> {
    if !directory.join(STUDY).exists() {
        return Ok(None);
    }
    let (text, name) = read(directory, STUDY)?;
    let saved = read_study(&text, &name)?;
    let (text, name) = read(directory, RUNS)?;
    let results = read_runs(&text, &name, &saved)?;
    if saved.version != env!("CARGO_PKG_VERSION") || saved.equations != FINGERPRINT {
        let version = &saved.version;
        say(format_args!("note: `{name}` was simulated by another build of Bristle, version {version}"));
    }
    Ok(Some((saved, results)))
}

/// The contact over time in a directory; `None` if there is no contact.
pub fn saved_case(directory: &Path) -> Result<Option<(Settings, Vec<Sample>)>, SavedError> {
    if !directory.join(CASE).exists() {
        return Ok(None);
    }
    let (text, name) = read(directory, CASE)?;
    let settings = read_case(&text, &name)?;
    let (text, name) = read(directory, HISTORY)?;
    Ok(Some((settings, read_history(&text, &name)?)))
}

/// The text of a file, and its name for error messages.
fn read(directory: &Path, name: &str) -> Result<(String, String), FileError> {
    let path = directory.join(name);
    Ok((read_results(&path)?, path.to_string_lossy().into_owned()))
}
