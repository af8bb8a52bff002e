//! A calibration from its measurements to the files of its result, once for the program and for
//! Python.

use std::path::{Path, PathBuf, absolute};

use bristle::simulation::Stop;
use bristle_study::calibrate::{
    Calibration, CalibrationContext, FitError, Fitted, Interrupted, MeasurementLimits, Observer,
    Problem, STARTS, calibrate, calibrated,
};
use bristle_study::grid::Resources;
use bristle_study::grid::uncertainty::check;
use bristle_study::input::document::Document;
use bristle_study::input::input_error::InputError;
use bristle_study::input::measured::{TableFormat, read_points, read_radii};
use bristle_study::input::table::DataError;
use thiserror::Error;

use crate::insight::findings::{Finding, bias_of_fit};
use crate::report::page::calibration_page;
use crate::run::forces::{ForceJournal, JournaledForces};
use crate::store::journal_file::{JOURNAL, JournalFileError};
use crate::store::staged::{FileError, StagedFile, read_document, relative_to, remove};

/// The input file with the fitted values.
pub const CALIBRATED: &str = "calibrated.toml";
/// All numbers of a calibration.
pub const CALIBRATION: &str = "calibration.json";
/// Measured and fitted forces.
pub const RESIDUALS: &str = "residuals.csv";
/// The page.
pub const CALIBRATION_PAGE: &str = "calibration.html";
/// All files that a calibration writes.
pub const OF_CALIBRATION: [&str; 5] = [
    CALIBRATED,
    CALIBRATION,
    RESIDUALS,
    CALIBRATION_PAGE,
    JOURNAL,
];

/// Resources, cancellation and files of a calibration.
pub struct CalibrationOptions<'a> {
    /// Largest speed and depth at which can be measured next.
    pub reach: MeasurementLimits,
    /// Threads and memory.
    pub resources: Resources,
    /// Ends it at the next step of each simulation.
    pub stop: &'a Stop,
    /// `true` if the fitted values are simulated with more precision, too.
    pub check: bool,
    /// Occupied directory of the files; `None` if none are written.
    pub directory: Option<&'a Path>,
    /// `true` if forces of an earlier call are discarded.
    pub restart: bool,
    /// Path of the input file, where its own paths start; may be empty.
    pub file: &'a Path,
    /// Name of the input file, for titles.
    pub name: &'a str,
    /// Text of the input file.
    pub text: &'a str,
    /// Options of `--set`.
    pub set: &'a [String],
}

/// Why a calibration has no result.
#[derive(Debug, Error)]
pub enum CalibrationError {
    /// The input file states something wrong.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The measured table has something wrong.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The settings cannot be fitted.
    #[error(transparent)]
    Refused(#[from] FitError),
    /// It was stopped, or failed.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The journal of forces cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalFileError),
}

/// A calibration with its files.
pub struct CalibrationOutcome {
    /// The fitted settings.
    pub calibration: Calibration,
    /// The files that were written.
    pub files: Vec<PathBuf>,
    /// Findings about the result.
    pub findings: Vec<Finding>,
    /// Largest relative change with more precision, if that was asked for.
    pub change: Option<Result<f64, Interrupted>>,
}

/// Reads a calibration of the settings that `fit` names, some with ranges, by a measured table and
/// its name.
///
/// # Errors
/// If a setting cannot be fitted, or the document or the table has something wrong.
pub fn calibration_problem(
    document: &Document<'_>,
    fit: &[String],
    [table, name]: [&str; 2],
    format: &TableFormat,
) -> Result<Problem, CalibrationError> {
    let fitted = fit.iter().map(|option| Fitted::parse(option));
    let fitted = fitted.collect::<Result<Vec<_>, _>>()?;
    let problem = if fitted.iter().any(Fitted::is_of_edges) {
        let settings = document.settings()?;
        Problem::of_radii(settings, fitted, read_radii(table, name, format)?)
    } else {
        let brushes = document.brushes()?;
        Problem::new(brushes, fitted, read_points(table, name, format)?)
    };
    Ok(problem?)
}

/// Fits the settings and writes the files. The journal keeps forces of brushes: a calibration that
/// was stopped goes on from there. `opened` sees it, `tell` takes the share that is done.
///
/// # Errors
/// If it cannot be simulated, is stopped, or a file cannot be written.
pub fn run_calibration(
    problem: Problem,
    options: &CalibrationOptions<'_>,
    opened: impl FnOnce(&ForceJournal),
    tell: &(dyn Fn(f64) + Sync),
) -> Result<CalibrationOutcome, CalibrationError> {
    let journal = options.directory.filter(|_| problem.has_brush());
    let journal = journal.map(|directory| ForceJournal::open(directory, options.restart));
    let journal = journal.transpose()?;
    journal.as_ref().map(opened);
    let share = if options.check { 0.5 } else { 1.0 };
    let mut forces = JournaledForces {
        journal,
        tell: &|done| tell(share * done),
    };
    let fitted = calibrate(problem, options.reach, options.means(&forces, STARTS));
    if let Some(journal) = &mut forces.journal {
        journal.settle()?;
    }
    let none = "none of the starts can be simulated: narrow the ranges of what is fitted";
    let calibration = fitted?.ok_or_else(|| Interrupted::Failed(none.to_owned()))?;
    let files = match options.directory {
        Some(directory) => write_calibration(directory, options, &calibration)?,
        None => Vec::new(),
    };
    let forces = JournaledForces {
        journal: None,
        tell: &|done| tell(share + share * done),
    };
    let check = || calibration.change_when_checked(options.means(&forces, 0));
    let brushes = calibration.problem.brushes.iter();
    let findings = brushes.filter_map(|brush| bias_of_fit(&brush.settings));
    Ok(CalibrationOutcome {
        findings: findings.collect(),
        files,
        change: options.check.then(check),
        calibration,
    })
}

impl<'a> CalibrationOptions<'a> {
    fn means(&self, observer: &'a dyn Observer, starts: usize) -> CalibrationContext<'a> {
        CalibrationContext {
            resources: self.resources,
            stop: self.stop,
            observer,
            starts,
        }
    }
}

/// Writes the files and returns their paths. If a setting is not determined, the input file of an
/// earlier calibration goes.
fn write_calibration(
    directory: &Path,
    options: &CalibrationOptions<'_>,
    calibration: &Calibration,
) -> Result<Vec<PathBuf>, CalibrationError> {
    let is_whole = calibration.undetermined.is_empty();
    let restated = is_whole.then(|| restated(directory, options, calibration));
    let restated = restated.transpose().map_err(Interrupted::Failed)?;
    let mut staged = vec![
        StagedFile::text(directory, CALIBRATION, &calibration.json())?,
        StagedFile::write(directory.join(RESIDUALS), |out| {
            calibration.write_residuals(out)
        })?,
        StagedFile::text(
            directory,
            CALIBRATION_PAGE,
            &calibration_page(options.name, calibration),
        )?,
    ];
    match restated {
        Some(text) => staged.insert(0, StagedFile::text(directory, CALIBRATED, &text)?),
        None => remove(&directory.join(CALIBRATED))?,
    }
    let files = staged.into_iter().map(StagedFile::commit);
    Ok(files.collect::<Result<_, _>>()?)
}

/// Returns the input file with the fitted values.
fn restated(
    directory: &Path,
    options: &CalibrationOptions<'_>,
    calibration: &Calibration,
) -> Result<String, String> {
    let moved = |path: &str| from_directory(&relative_to(options.file, path), directory);
    let text = calibrated(options.text, calibration, options.set, &moved)?;
    // What cannot be read again, or states something else, would be worse than no file.
    let path = directory.join(CALIBRATED);
    let document =
        read_document(&path, &text, CALIBRATED, &[]).map_err(|error| error.to_string())?;
    for brush in document.brushes().map_err(|error| error.to_string())? {
        check(&brush.settings).map_err(|violation| violation.to_string())?;
        for (fitted, value) in calibration.problem.fitted.iter().zip(&calibration.values) {
            let stated = fitted.parameter.get(&brush.settings);
            if (stated / value - 1.0).abs() > 1e-2 && (stated - value).abs() > 1e-9 {
                let path = fitted.parameter.path;
                return Err(format!(
                    "`{path}` of a tool cannot be restated: state it in its own section, not under the tool"
                ));
            }
        }
    }
    Ok(text)
}

/// Returns a path as seen from a directory, with forward slashes.
fn from_directory(path: &Path, directory: &Path) -> String {
    let [path, directory] = [path, directory].map(|path| {
        path.canonicalize()
            .or_else(|_| absolute(path))
            .unwrap_or_else(|_| path.to_owned())
    });
    let common = path
        .components()
        .zip(directory.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = directory.components().skip(common).map(|_| "..".to_owned());
    let down = path
        .components()
        .skip(common)
        .map(|part| part.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}
