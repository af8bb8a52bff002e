//! Saved results that describe themselves: `study.json` beside `runs.csv`, `case.json` beside `history.csv`.
//!
//! Studies and settings become text here, and text becomes what was written: the same numbers to the bit, or an error that says
//! where the text is wrong. Files are the program's matter.

use bristle_codegen::exchange::digest;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::equations::FINGERPRINT;
use crate::metrics::Metrics;
use crate::parameters::Parameter;
use crate::report::{Columns, FIXED_COLUMNS, OK};
use crate::settings::Settings;
use crate::simulation::Sample;
use crate::simulation::Statistics;
use crate::study::{Axis, CaseResult, CaseSummary, Study, Sweep};
use crate::uncertainty::ForceScatter;

/// Number of the form of `study.json` and `case.json`; another form has another number.
const FORMAT: u32 = 2;

/// What to do about results that do not belong together.
const AGAIN: &str = "run the command that made the results again";

/// Saved results that cannot be read back.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{file}:{line}{}: {problem}\n   = help: {advice}", column_text(.column))]
pub struct DataError {
    /// Name of the file.
    pub file: String,
    /// Line, counted from 1.
    pub line: u64,
    /// Name of a table's column, or number of a character in the line.
    pub column: Option<String>,
    /// What is wrong.
    pub problem: String,
    /// What to do.
    pub advice: &'static str,
}

fn column_text(column: &Option<String>) -> String {
    column.as_ref().map_or_else(String::new, |column| format!(", column {column}"))
}

/// A study as it stands in `study.json`.
#[derive(Clone, Debug)]
pub struct SavedStudy {
    /// The grid of settings.
    pub study: Study,
    /// Version of Bristle that simulated it.
    pub version: String,
    /// SHA-256 of the equations that it was simulated by.
    pub equations: String,
    /// Whether measured forces lie beside it.
    pub measured: bool,
    /// SHA-256 of its `runs.csv`.
    runs: String,
}

/// The text of `study.json`. Keys that are not known are skipped on reading.
#[derive(Serialize, Deserialize)]
struct StudyFile {
    format: u32,
    bristle_version: String,
    /// [`FINGERPRINT`] of the build.
    equations_sha256: String,
    /// Of `runs.csv`, which gets its name before this file does: after a crash between the two they do not fit.
    runs_sha256: String,
    /// Whether `measured.csv` belongs to the results.
    measured: bool,
    settings: Settings,
    axes: Vec<Sweep>,
}

/// The text of `case.json`.
#[derive(Serialize, Deserialize)]
struct CaseFile {
    format: u32,
    bristle_version: String,
    settings: Settings,
}

/// A file's name and text.
pub(crate) struct Source<'t> {
    pub name: &'t str,
    pub text: &'t str,
}

impl Source<'_> {
    pub fn error(
        &self,
        line: u64,
        column: Option<String>,
        problem: impl Into<String>,
        advice: &'static str,
    ) -> DataError {
        DataError { file: self.name.to_owned(), line, column, problem: problem.into(), advice }
    }

    /// The error about a text that is no JSON, or JSON of something else.
    fn json(&self, error: &serde_json::Error) -> DataError {
        let column = (error.column() > 0).then(|| error.column().to_string());
        self.error(error.line() as u64, column, error.to_string(), AGAIN)
    }

    /// Reads a JSON object, of which the number of its form comes first.
    fn object<T: serde::de::DeserializeOwned>(&self) -> Result<T, DataError> {
        #[derive(Deserialize)]
        struct Form {
            format: u32,
        }
        let Form { format } = serde_json::from_str(self.text).map_err(|error| self.json(&error))?;
        if format != FORMAT {
            let problem = format!("the form of the file is {format}, and this program reads {FORMAT}");
            return Err(self.error(1, None, problem, "use the version of Bristle that wrote it, or simulate again"));
        }
        serde_json::from_str(self.text).map_err(|error| self.json(&error))
    }

    /// The text as a table with a heading; `advice` is what to do about one that is wrong.
    pub fn table(&self, advice: &'static str) -> Result<Table<'_>, DataError> {
        let mut builder = csv::ReaderBuilder::new();
        let mut reader = builder.has_headers(false).trim(csv::Trim::All).from_reader(self.text.as_bytes());
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| {
                let line = error.position().map_or(1, csv::Position::line);
                let problem = match error.kind() {
                    csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                        format!("{len} cells where the heading has {expected_len}")
                    }
                    _ => error.to_string(),
                };
                self.error(line, None, problem, advice)
            })?;
            rows.push(record);
        }
        if rows.is_empty() {
            return Err(self.error(1, None, "the file is empty", advice));
        }
        let heading = rows.remove(0);
        Ok(Table { source: self, heading, rows, advice })
    }
}

/// A table as text.
pub(crate) struct Table<'t> {
    source: &'t Source<'t>,
    heading: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
    advice: &'static str,
}

impl Table<'_> {
    /// The rows below the heading.
    pub fn rows(&self) -> &[csv::StringRecord] {
        &self.rows
    }

    /// Where a column stands.
    fn column(&self, name: &str) -> Result<usize, DataError> {
        self.heading
            .iter()
            .position(|heading| heading == name)
            .ok_or_else(|| self.source.error(1, None, format!("there is no column `{name}`"), self.advice))
    }

    /// Where columns stand.
    pub fn columns(&self, names: &[&str]) -> Result<Vec<usize>, DataError> {
        names.iter().map(|name| self.column(name)).collect()
    }

    /// The line that a row begins in.
    pub fn line(&self, row: &csv::StringRecord) -> u64 {
        row.position().map_or(1, csv::Position::line)
    }

    /// The error about a cell.
    pub fn wrong(&self, row: &csv::StringRecord, column: usize, problem: impl Into<String>) -> DataError {
        self.source.error(self.line(row), self.heading.get(column).map(str::to_owned), problem, self.advice)
    }

    /// Reads a structure from the cells at `columns`.
    fn read<T: Columns>(&self, row: &csv::StringRecord, columns: &[usize]) -> Result<T, DataError> {
        T::parse(|position| row.get(columns[position]).unwrap_or_default()).map_err(|position| {
            let column = columns[position];
            let cell = row.get(column).unwrap_or_default();
            self.wrong(row, column, format!("`{cell}` is not a number that can stand here"))
        })
    }
}

/// The text of `study.json` beside the `runs.csv` of the text `runs`; `measured` says whether measured forces belong to the results.
#[must_use]
pub fn study_text(study: &Study, runs: &[u8], measured: bool) -> String {
    pretty(&StudyFile {
        format: FORMAT,
        bristle_version: env!("CARGO_PKG_VERSION").to_owned(),
        equations_sha256: FINGERPRINT.to_owned(),
        runs_sha256: digest(runs),
        measured,
        settings: study.base().clone(),
        axes: study.sweeps(),
    })
}

/// The text of `case.json`.
#[must_use]
pub fn case_text(settings: &Settings) -> String {
    let bristle_version = env!("CARGO_PKG_VERSION").to_owned();
    pretty(&CaseFile { format: FORMAT, bristle_version, settings: settings.clone() })
}

fn pretty(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("checked settings have a form in JSON") + "\n"
}

/// Reads `study.json`; `name` is what errors call it.
///
/// # Errors
/// If the text is not what [`study_text`] writes, or states settings that no study can have.
pub fn read_study(text: &str, name: &str) -> Result<SavedStudy, DataError> {
    let source = Source { name, text };
    let file: StudyFile = source.object()?;
    let mut axes = Vec::new();
    for Sweep { setting, values } in file.axes {
        let place = || text.lines().position(|line| line.contains(&setting)).map_or(1, |line| line as u64 + 1);
        let parameter = Parameter::find(&setting)
            .ok_or_else(|| source.error(place(), None, format!("there is no setting `{setting}`"), AGAIN))?;
        axes.push(
            Axis::list(parameter, values)
                .map_err(|error| source.error(place(), None, format!("`{setting}`: {error}"), AGAIN))?,
        );
    }
    let study = Study::new(file.settings, axes).map_err(|error| source.error(1, None, error.to_string(), AGAIN))?;
    Ok(SavedStudy {
        study,
        version: file.bristle_version,
        equations: file.equations_sha256,
        measured: file.measured,
        runs: file.runs_sha256,
    })
}

/// Reads `case.json`; `name` is what errors call it.
///
/// # Errors
/// If the text is not what [`case_text`] writes, or states settings that no simulation can have.
pub fn read_case(text: &str, name: &str) -> Result<Settings, DataError> {
    let source = Source { name, text };
    let file: CaseFile = source.object()?;
    file.settings.check().map_err(|violation| source.error(1, None, violation.to_string(), AGAIN))?;
    Ok(file.settings)
}

/// Reads `runs.csv` of a study, in the grid's order; `name` is what errors call it.
///
/// # Errors
/// If the text is not what [`write_runs`](crate::report::write_runs) has written for this study.
pub fn read_runs(text: &str, name: &str, saved: &SavedStudy) -> Result<Vec<CaseResult>, DataError> {
    let study = &saved.study;
    let source = Source { name, text };
    let table = source.table(AGAIN)?;
    let mut settings = Vec::new();
    for (position, axis) in study.axes().iter().enumerate() {
        let path = axis.parameter().path;
        let fixed = FIXED_COLUMNS.iter().find(|(_, of)| *of == path);
        settings.push((position, axis.parameter(), table.column(fixed.map_or(path, |(name, _)| name))?));
    }
    let metrics = table.columns(Metrics::NAMES)?;
    let scatter = if study.scatters() { Some(table.columns(ForceScatter::NAMES)?) } else { None };
    let statistics = table.columns(Statistics::NAMES)?;
    let status = table.column("status")?;
    if table.rows.len() != study.case_count() {
        let problem = format!("{} rows, but study.json has {} cases", table.rows.len(), study.case_count());
        return Err(source.error(1, None, problem, AGAIN));
    }
    let mut results = Vec::with_capacity(table.rows.len());
    for (case, row) in table.rows.iter().enumerate() {
        let values: Vec<f64> = study.values(case).collect();
        for &(position, parameter, column) in &settings {
            let expected = parameter.format(values[position]);
            if row.get(column) != Some(expected.as_str()) {
                let found = row.get(column).unwrap_or_default();
                return Err(table.wrong(row, column, format!("`{found}` where study.json has {expected}")));
            }
        }
        results.push(match row.get(status) {
            Some(OK) => Ok(CaseSummary {
                metrics: table.read::<Metrics>(row, &metrics)?,
                statistics: table.read::<Statistics>(row, &statistics)?,
                scatter: match &scatter {
                    Some(columns) if row.get(columns[0]) != Some("") => Some(table.read::<ForceScatter>(row, columns)?),
                    _ => None,
                },
            }),
            message => Err(message.unwrap_or_default().to_owned()),
        });
    }
    // Last, as all above can say where it is wrong.
    if digest(text.as_bytes()) != saved.runs {
        return Err(source.error(1, None, "these are not the results that study.json belongs to", AGAIN));
    }
    Ok(results)
}

/// Reads `history.csv`; `name` is what errors call it.
///
/// # Errors
/// If the text is not what [`write_history`](crate::report::write_history) writes.
pub fn read_history(text: &str, name: &str) -> Result<Vec<Sample>, DataError> {
    let source = Source { name, text };
    let table = source.table(AGAIN)?;
    let columns = table.columns(Sample::NAMES)?;
    table.rows.iter().map(|row| table.read::<Sample>(row, &columns)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::report::{write_history, write_runs};
    use crate::simulation::simulate_with_history;
    use crate::study::run_study;
    use crate::testing::brush;

    const FILE: &str = concat!(
        brush!(3),
        "
        [solver]
        relative_tolerance = 1e-3
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        \"contact.stiffness_n_m\" = [1e300, 1e5]
        penetration_depth_m = [3e-3, 0.1e-2]
        brushing_velocity_m_s = { start = 10.1, stop = 10.4, step = 0.1 }
        "
    );

    fn texts(file: &str) -> (Study, Vec<CaseResult>, String, String) {
        let study = Document::parse(file, "case.toml").and_then(|document| document.study()).expect("a study");
        let results = run_study(&study, None, || {}).expect("threads");
        let mut runs = Vec::new();
        write_runs(&mut runs, &study, &results).expect("a table");
        let runs = String::from_utf8(runs).expect("text");
        let saved = study_text(&study, runs.as_bytes(), false);
        (study, results, saved, runs)
    }

    #[test]
    fn what_was_written_is_read_to_the_bit() {
        let (study, mut results, saved, runs) = texts(FILE);
        let read = read_study(&saved, "study.json").expect("a study");
        assert_eq!(study_text(&read.study, runs.as_bytes(), read.measured), saved);
        assert_eq!((read.version.as_str(), read.equations.as_str()), (env!("CARGO_PKG_VERSION"), FINGERPRINT));
        for case in 0..study.case_count() {
            assert_eq!(read.study.settings(case), study.settings(case));
        }
        assert!(results[..8].iter().all(Result::is_err) && results[8..].iter().all(Result::is_ok));
        // Not written, see there.
        results.iter_mut().flatten().for_each(|summary| summary.statistics.chart_changes = 0);
        assert_eq!(read_runs(&runs, "runs.csv", &read), Ok(results));
    }

    /// As the same values are swept, no row tells; a crash between writing the two files leaves such a pair.
    #[test]
    fn rows_of_other_settings_are_refused() {
        let (_, _, saved, _) = texts(FILE);
        let (_, _, _, runs) = texts(&FILE.replace("length_m = 0.040", "length_m = 0.041"));
        let study = read_study(&saved, "study.json").expect("a study");
        let error = read_runs(&runs, "runs.csv", &study).expect_err("rows of another study").to_string();
        let expected = "runs.csv:1: these are not the results that study.json belongs to\n   = help: ";
        assert_eq!(error, format!("{expected}{AGAIN}"));
    }

    #[test]
    fn a_history_is_read_to_the_bit() {
        let settings = Document::parse(FILE, "case.toml").and_then(|document| document.settings()).expect("settings");
        let history = simulate_with_history(&settings, 50).expect("a pass").history;
        let mut text = Vec::new();
        write_history(&mut text, &history).expect("a table");
        let text = String::from_utf8(text).expect("text");
        assert_eq!(read_history(&text, "history.csv"), Ok(history));
        assert_eq!(read_case(&case_text(&settings), "case.json"), Ok(settings));
        let error = read_history(&text.replacen(",0.0,", ",none,", 1), "history.csv").expect_err("no number");
        assert_eq!((error.line, error.column.is_some()), (2, true), "{error}");
    }

    #[test]
    fn damaged_results_are_refused_with_their_place() {
        let (_, _, saved, runs) = texts(FILE);
        let study_error = |old: &str, new: &str| {
            assert!(saved.contains(old), "{old}");
            read_study(&saved.replacen(old, new, 1), "study.json").expect_err(new).to_string()
        };
        assert!(study_error("\"format\": 2", "\"format\": 1").contains("use the version"));
        assert!(study_error("\"format\": 2", "\"format\": two").starts_with("study.json:2, column"));
        assert!(study_error("contact.stiffness_n_m", "contact.stifness_n_m").contains("no setting"));
        assert!(study_error("0.04,", "-0.04,").contains("filament.length_m"));
        assert!(study_error("\"axes\"", "\"exes\"").contains("axes"));
        assert!(study_error("\"runs_sha256\"", "\"runs\"").contains("runs_sha256"));

        let study = read_study(&saved, "study.json").expect("a study");
        let error = |text: &str| read_runs(text, "runs.csv", &study).expect_err("damaged").to_string();
        assert!(error("").contains("empty"));
        assert!(error(&runs.replacen(",contact_time_s", ",contact_time", 1)).contains("no column `contact_time_s`"));
        let last = runs.trim_end().rfind('\n').expect("rows");
        assert!(error(&runs[..=last]).contains("15 rows"));
        assert!(
            error(&runs.replacen("\n10.2,", "\n10.25,", 1)).starts_with("runs.csv:3, column brushing_velocity_m_s")
        );
        let broken = error(&runs.replacen(",ok\n", ",0,ok\n", 1));
        assert!(broken.starts_with("runs.csv:10"), "{broken}");
        let cells: Vec<&str> = runs.lines().nth(9).expect("a good row").split(',').collect();
        let not_finite = runs.replacen(cells[6], "NaN", 1);
        assert!(error(&not_finite).contains("column contact_angle_rad") || error(&not_finite).contains("`NaN`"));
    }
}
