//! The results of a study in its directory.

use std::path::{Path, PathBuf};

use crate::store::results::{Origin, study_text_from, write_runs};
use bristle_study::grid::{CaseResult, Study};

use crate::store::journal_file::JOURNAL;
use crate::store::staged::{FileError, Occupied, StagedFile, Written, occupy, prepare_directory};

/// Names of the files.
pub const STUDY: &str = "study.json";
/// The table of all cases.
pub const RUNS: &str = "runs.csv";
/// The same as Parquet, if the program was built so.
pub const RUNS_PARQUET: &str = "runs.parquet";
/// The page.
pub const REPORT: &str = "report.html";
/// The forces that the study is compared with.
pub const MEASURED: &str = "measured.csv";
/// How far they deviate.
pub const COMPARISON: &str = "measured_comparison.csv";

/// Prepares a directory for the results of a study, and announces that this process writes to it,
/// and what else to `subdirectories`.
///
/// # Errors
/// As for [`prepare_directory`] and [`occupy`].
pub fn occupy_results(
    directory: &Path,
    subdirectories: &[Written<'_>],
) -> Result<Occupied, FileError> {
    prepare_directory(directory)?;
    let names = [
        RUNS,
        RUNS_PARQUET,
        STUDY,
        REPORT,
        MEASURED,
        COMPARISON,
        JOURNAL,
    ];
    let is_result = |name: &str| names.contains(&name);
    let mut written: Vec<Written<'_>> = vec![("", &is_result)];
    written.extend_from_slice(subdirectories);
    occupy(directory, &written)
}

/// Writes `runs.csv`, `further` files made from the text of `study.json`, that text and the page:
/// all of them, once each can be written. Returns the paths. `origin` is the build that simulated
/// the study; `has_measured` says whether one of the further files has measured forces.
///
/// # Errors
/// If a file cannot be written.
pub fn write_study(
    directory: &Path,
    (study, origin): (&Study, &Origin),
    results: &[CaseResult],
    page: &str,
    has_measured: bool,
    further: impl FnOnce(&str) -> Result<Vec<StagedFile>, FileError>,
) -> Result<Vec<PathBuf>, FileError> {
    let mut runs = Vec::new();
    write_runs(&mut runs, study, results).expect("memory takes what is written to it");
    let settings = study_text_from(study, origin, &runs, has_measured);
    let mut staged = vec![StagedFile::write(directory.join(RUNS), |out| {
        out.write_all(&runs)
    })?];
    staged.extend(further(&settings)?);
    staged.push(StagedFile::text(directory, STUDY, &settings)?);
    staged.push(StagedFile::text(directory, REPORT, page)?);
    staged.into_iter().map(StagedFile::commit).collect()
}
