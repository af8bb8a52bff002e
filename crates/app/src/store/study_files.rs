//! The results of a study in its directory.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::store::previous::Previous;
use crate::store::results::{BuildOrigin, read_study, study_text_from, write_runs};
use bristle_study::grid::{CaseResult, Study};
use bristle_study::input::measured::{Measurement, measured_text};
use bristle_study::input::statement::Statement;

use crate::store::journal_file::JOURNAL;
use crate::store::staged::{
    FileError, Occupied, StagedFile, WrittenFiles, occupy, prepare_directory, read_results,
};

/// The settings of the study.
pub const STUDY: &str = "study.json";
/// The table of all cases.
pub const RUNS: &str = "runs.csv";
/// The table of all cases as Parquet, if the program was built with it.
pub const RUNS_PARQUET: &str = "runs.parquet";
/// The page.
pub const REPORT: &str = "report.html";
/// The measured forces of the study.
pub const MEASURED: &str = "measured.csv";
/// Deviations of simulated from measured forces.
pub const COMPARISON: &str = "measured_comparison.csv";

/// Result files of a study besides its journal.
const RESULTS: [&str; 6] = [RUNS, RUNS_PARQUET, STUDY, REPORT, MEASURED, COMPARISON];

/// Prepares a directory for the results of a study, and announces that this process writes to it
/// and to its `subdirectories`.
///
/// # Errors
/// As for [`prepare_directory`] and [`occupy`].
pub fn occupy_results(
    directory: &Path,
    subdirectories: &[WrittenFiles<'_>],
) -> Result<Occupied, FileError> {
    prepare_directory(directory)?;
    let is_result = |name: &str| RESULTS.contains(&name) || name == JOURNAL;
    let mut written: Vec<WrittenFiles<'_>> = vec![("", &is_result)];
    written.extend_from_slice(subdirectories);
    occupy(directory, &written)
}

/// Moves the results of another study than `study` to `previous`, and the `subdirectories` with
/// them.
///
/// # Errors
/// If they cannot be moved.
pub fn keep_others(
    directory: &Path,
    study: &Study,
    subdirectories: &[WrittenFiles<'_>],
    previous: &mut Previous,
) -> Result<(), FileError> {
    let path = directory.join(STUDY);
    if !path.exists() {
        return Ok(());
    }
    let text = read_results(&path)?;
    let is_same = read_study(&text, STUDY).is_ok_and(|saved| saved.study.has_cases_of(study));
    if is_same {
        return Ok(());
    }
    let subdirectories = subdirectories.iter().map(|(name, _)| *name);
    RESULTS
        .into_iter()
        .chain(subdirectories)
        .try_for_each(|name| previous.keep(name))
}

/// Writes the files of a shard besides its journal: `study.json` without results, and measured
/// forces.
///
/// # Errors
/// If a file cannot be written.
pub fn write_shard(
    directory: &Path,
    study: &Study,
    statement: &Statement,
    measured: &[Measurement],
) -> Result<(), FileError> {
    let has_measured = !measured.is_empty();
    let text = study_text_from(
        study,
        &BuildOrigin::here(),
        statement,
        &[],
        None,
        has_measured,
    );
    let mut staged = vec![StagedFile::text(directory, STUDY, &text)?];
    if has_measured {
        let text = measured_text(measured, &study.tool_names());
        staged.push(StagedFile::text(directory, MEASURED, &text)?);
    }
    staged
        .into_iter()
        .try_for_each(|file| file.commit().map(drop))
}

/// Writes `runs.csv`, `further` files made from the text of `study.json`, that text and the page.
/// No file appears unless each can be written. Returns the paths. `origin` is the build that
/// simulated the study, `statement` the rest of its input file. `findings` concern the results.
/// `has_measured` is `true` if one of the further files has measured forces.
///
/// # Errors
/// If a file cannot be written.
pub fn write_study(
    directory: &Path,
    (study, origin, statement, findings): (&Study, &BuildOrigin, &Statement, &[Value]),
    results: &[CaseResult],
    page: &str,
    has_measured: bool,
    further: impl FnOnce(&str) -> Result<Vec<StagedFile>, FileError>,
) -> Result<Vec<PathBuf>, FileError> {
    let mut runs = Vec::new();
    write_runs(&mut runs, study, results).expect("memory takes what is written to it");
    let settings = study_text_from(
        study,
        origin,
        statement,
        findings,
        Some(&runs),
        has_measured,
    );
    let mut staged = vec![StagedFile::write(directory.join(RUNS), |out| {
        out.write_all(&runs)
    })?];
    staged.extend(further(&settings)?);
    staged.push(StagedFile::text(directory, STUDY, &settings)?);
    staged.push(StagedFile::text(directory, REPORT, page)?);
    staged.into_iter().map(StagedFile::commit).collect()
}
