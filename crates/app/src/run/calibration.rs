//! The files of a calibration.

use std::path::{Path, PathBuf};

use crate::report::page::calibration_page;
use crate::store::journal_file::JOURNAL;
use crate::store::staged::{FileError, StagedFile, read_document, remove};
use bristle_study::calibrate::{Calibration, calibrated};
use bristle_study::grid::uncertainty::check;

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

/// Writes the files of a calibration to its directory, which must be occupied, and returns their
/// paths. `calibrated` is the input file with the fitted values; without one, that of an earlier
/// calibration goes. `name` is that of the input file.
///
/// # Errors
/// If a file cannot be written.
pub fn write_calibration(
    directory: &Path,
    name: &str,
    calibration: &Calibration,
    calibrated: Option<&str>,
) -> Result<Vec<PathBuf>, FileError> {
    let mut staged = vec![
        StagedFile::text(directory, CALIBRATION, &calibration.json())?,
        StagedFile::write(directory.join(RESIDUALS), |out| {
            calibration.write_residuals(out)
        })?,
        StagedFile::text(
            directory,
            CALIBRATION_PAGE,
            &calibration_page(name, calibration),
        )?,
    ];
    match calibrated {
        Some(text) => staged.insert(0, StagedFile::text(directory, CALIBRATED, text)?),
        None => remove(&directory.join(CALIBRATED))?,
    }
    staged.into_iter().map(StagedFile::commit).collect()
}

/// The text of `calibrated.toml` in a directory: the input file `text` with the `options` of
/// `--set` and the fitted values. `moved` turns a path in the file into the same from the
/// directory.
///
/// # Errors The part that cannot be restated, in words.
pub fn calibrated_text(
    directory: &Path,
    text: &str,
    calibration: &Calibration,
    options: &[String],
    moved: &dyn Fn(&str) -> String,
) -> Result<String, String> {
    let text = calibrated(text, calibration, options, moved)?;
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
