//! The files of a calibration.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use bristle_calibrate::{Calibration, Frame, calibrated};
use bristle_grid::uncertainty::check;
use bristle_report::page::calibration_page;
use bristle_store::force_journal::FORCE_JOURNAL;
use bristle_store::staged::{FileError, StagedFile, read_document, remove};

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
    FORCE_JOURNAL,
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
/// # Errors
/// What cannot be restated, in words.
pub fn calibrated_text(
    directory: &Path,
    text: &str,
    calibration: &Calibration,
    options: &[String],
    moved: &dyn Fn(&str) -> String,
) -> Result<String, String> {
    let frame = Frame {
        date: &today(),
        options,
        moved,
    };
    let text = calibrated(text, calibration, &frame)?;
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

/// The date in Greenwich, as 2026-11-24.
fn today() -> String {
    let seconds = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0, |since| since.as_secs());
    date(seconds / 86_400)
}

/// The date so many days after 1 January 1970, by the Gregorian calendar.
fn date(days: u64) -> String {
    // Years begin in March, so that the day that some of them have more is their last; 400 of them
    // have 146 097 days.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * month + 2) / 5 + 1;
    let (month, later) = if month < 10 {
        (month + 3, 0)
    } else {
        (month - 9, 1)
    };
    format!("{:04}-{month:02}-{of_month:02}", 400 * era + year + later)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        let expected = [
            (0, "1970-01-01"),
            (11_016, "2000-02-29"),
            (11_017, "2000-03-01"),
            (20_781, "2026-11-24"),
            (47_540, "2100-02-28"),
            (47_541, "2100-03-01"),
        ];
        assert_eq!(
            expected.map(|(days, _)| date(days)),
            expected.map(|(_, text)| text.to_owned())
        );
    }
}
