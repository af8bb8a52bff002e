//! Reads saved text back, with errors that state where it is wrong.

use std::borrow::Cow;
use std::path::Path;

use crate::text::{shortened, shown, shown_path};
use bristle::model::record::{Column, Record};
use serde::Deserialize;
use thiserror::Error;

/// Longest heading, and longest description of a problem, which may quote the file; in characters.
const LONGEST_NAME: usize = 80;
const LONGEST_PROBLEM: usize = 200;

/// Largest number of rows of a table: of cases in a study, samples in a history, and points that
/// can be compared.
pub const MAX_ROWS: usize = 1_000_000;
/// Longest line of a table. A program that writes more has not written a table.
const MAX_LINE_BYTES: usize = 1 << 16;

/// Advice about results that do not belong together.
pub const AGAIN: &str = "run the command that made the results again";

/// Saved results that cannot be read back.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{file}:{line}{}: {problem}\n   = help: {advice}", column_text(.column))]
pub struct DataError {
    /// Name of the file, as messages show it.
    pub file: String,
    /// Line, counted from 1.
    pub line: u64,
    /// Name of a table's column, or number of the character in the line.
    pub column: Option<String>,
    /// Statement of the problem.
    pub problem: String,
    /// Advice.
    pub advice: Cow<'static, str>,
}

fn column_text(column: &Option<String>) -> String {
    column
        .as_ref()
        .map_or_else(String::new, |column| format!(", column {column}"))
}

/// A file's name and text.
pub struct Source<'t> {
    /// Name used in errors.
    pub name: &'t str,
    /// Whole text.
    pub text: &'t str,
}

impl Source<'_> {
    /// Creates an error about a line, counted from 1.
    #[must_use]
    pub fn error(
        &self,
        line: u64,
        column: Option<String>,
        problem: impl Into<String>,
        advice: &'static str,
    ) -> DataError {
        let column = column.map(|column| shown(&column, LONGEST_NAME));
        let problem = shown(&problem.into(), LONGEST_PROBLEM);
        DataError {
            file: shown_path(Path::new(self.name)),
            line,
            column,
            problem,
            advice: advice.into(),
        }
    }

    /// Creates the error about text that is not JSON, or is JSON of something else.
    pub fn json(&self, error: &serde_json::Error) -> DataError {
        let column = (error.column() > 0).then(|| error.column().to_string());
        self.error(error.line() as u64, column, error.to_string(), AGAIN)
    }

    /// Reads a JSON object after checking that its format has the version `expected`.
    pub fn object<T: serde::de::DeserializeOwned>(&self, expected: u32) -> Result<T, DataError> {
        #[derive(Deserialize)]
        struct Versioned {
            format: u32,
        }
        let Versioned { format } =
            serde_json::from_str(self.text).map_err(|error| self.json(&error))?;
        if format != expected {
            let problem =
                format!("the file has format {format}, but this program reads format {expected}");
            return Err(self.error(
                1,
                None,
                problem,
                "use the version of Bristle that wrote it, or simulate again",
            ));
        }
        serde_json::from_str(self.text).map_err(|error| self.json(&error))
    }

    /// Reads the text as a table with a heading. Errors have this `advice`.
    ///
    /// # Errors
    /// If the text is not CSV, is empty, or is larger than any table of ours.
    pub fn table(&self, advice: &'static str) -> Result<Table<'_>, DataError> {
        self.table_separated_by(',', advice)
    }

    /// Returns the cells of the heading of a table with an ASCII `separator`; none if there is no
    /// such heading.
    pub(crate) fn headings(&self, separator: char) -> Vec<String> {
        let first = reader(self.body(), separator).into_records().next();
        first
            .and_then(Result::ok)
            .map_or_else(Vec::new, |heading| tidy_headings(&heading))
    }

    /// Returns the separator that a first line `sep=;` states, as spreadsheets read it.
    pub(crate) fn stated_separator(&self) -> Option<char> {
        let line = self.text.lines().next()?.trim_end_matches(['"', ' ']);
        let mut letters = line.trim_start_matches('"').chars();
        let name: String = letters.by_ref().take(4).collect();
        let separator = letters.next().filter(char::is_ascii)?;
        let is_hint = name.eq_ignore_ascii_case("sep=") && letters.next().is_none();
        is_hint.then_some(separator)
    }

    /// Returns the text without a line that states the separator.
    fn body(&self) -> &str {
        match self.stated_separator() {
            Some(_) => self.text.split_once('\n').map_or("", |(_, body)| body),
            None => self.text,
        }
    }

    /// Returns the text of the heading, whose quoted cells may have line breaks.
    pub(crate) fn heading_text(&self) -> &str {
        let body = self.body();
        let mut is_quoted = false;
        let end = body.find(|letter| {
            is_quoted ^= letter == '"';
            letter == '\n' && !is_quoted
        });
        &body[..end.unwrap_or(body.len())]
    }

    /// Reads a table like [`Source::table`], with another ASCII separator than a comma. Rows
    /// without any cell are left out.
    pub(crate) fn table_separated_by(
        &self,
        separator: char,
        advice: &'static str,
    ) -> Result<Table<'_>, DataError> {
        if let Some(line) = self
            .text
            .lines()
            .position(|line| line.len() > MAX_LINE_BYTES)
        {
            let problem = format!("a line of more than {MAX_LINE_BYTES} bytes");
            return Err(self.error(line as u64 + 1, None, problem, advice));
        }
        let body = self.body();
        let mut lines = LineCounter {
            text: body,
            place: 0,
            line: 1 + u64::from(body.len() < self.text.len()),
        };
        let mut rows: Vec<csv::StringRecord> = Vec::new();
        for record in reader(body, separator).into_records() {
            let mut record = record.map_err(|error| {
                let place = error.position().map_or(0, csv::Position::byte);
                self.error(lines.at(place), None, error.to_string(), advice)
            })?;
            let mut position = record
                .position()
                .cloned()
                .unwrap_or_else(csv::Position::new);
            let line = lines.at(position.byte());
            if record.iter().all(str::is_empty) {
                continue;
            }
            if let Some(heading) = rows.first().filter(|row| row.len() != record.len()) {
                let [count, expected] = [record.len(), heading.len()];
                let problem = format!("{count} cells, but the heading has {expected}");
                return Err(self.error(line, None, problem, advice));
            }
            // The heading is one of the rows.
            if rows.len() > MAX_ROWS {
                let problem = format!("more than {MAX_ROWS} rows below the heading");
                return Err(self.error(line, None, problem, advice));
            }
            position.set_line(line);
            record.set_position(Some(position));
            rows.push(record);
        }
        if rows.is_empty() {
            return Err(self.error(1, None, "the file is empty", advice));
        }
        let heading = rows.remove(0);
        Ok(Table {
            source: self,
            line: heading.position().map_or(1, csv::Position::line),
            heading: tidy_headings(&heading),
            rows,
            advice,
        })
    }
}

/// The number of the line at a place of a text. Places must not decrease.
struct LineCounter<'t> {
    text: &'t str,
    place: usize,
    line: u64,
}

impl LineCounter<'_> {
    /// Returns the line of the first cell at `place` or behind it. A record's own position is that
    /// of the line break before it, or of empty lines.
    fn at(&mut self, place: u64) -> u64 {
        let bytes = self.text.as_bytes();
        let place = usize::try_from(place).map_or(bytes.len(), |place| place.min(bytes.len()));
        let breaks = bytes[place..]
            .iter()
            .take_while(|byte| b"\r\n".contains(byte));
        let start = place + breaks.count();
        let passed = &bytes[self.place.min(start)..start];
        self.line += passed.iter().filter(|byte| **byte == b'\n').count() as u64;
        self.place = start.max(self.place);
        self.line
    }
}

/// Creates a reader of all rows of a table, the heading included.
fn reader(text: &str, separator: char) -> csv::Reader<&[u8]> {
    let mut builder = csv::ReaderBuilder::new();
    let separator = u8::try_from(separator).expect("a separator is ASCII");
    builder
        .has_headers(false)
        .flexible(true)
        .delimiter(separator)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes())
}

/// Returns headings as they are compared: `µ` is one letter of two, and any white space is a space.
fn tidy_headings(heading: &csv::StringRecord) -> Vec<String> {
    heading.iter().map(tidy_heading).collect()
}

/// Returns a heading as [`Table::headings`] has it.
pub(crate) fn tidy_heading(heading: &str) -> String {
    let words: Vec<&str> = heading.split_whitespace().collect();
    words.join(" ").replace('\u{3bc}', "\u{b5}")
}

/// A table as text.
pub struct Table<'t> {
    source: &'t Source<'t>,
    /// Line of the heading.
    line: u64,
    heading: Vec<String>,
    rows: Vec<csv::StringRecord>,
    advice: &'static str,
}

impl Table<'_> {
    /// Returns the rows below the heading.
    pub fn rows(&self) -> &[csv::StringRecord] {
        &self.rows
    }

    /// Returns the cells of the heading.
    pub fn headings(&self) -> &[String] {
        &self.heading
    }

    /// Returns the line of the heading.
    pub(crate) fn heading_line(&self) -> u64 {
        self.line
    }

    /// Returns the position of a column. Columns that are not read may have equal names.
    pub fn column(&self, name: &str) -> Result<usize, DataError> {
        let mut positions =
            (0..self.heading.len()).filter(|&position| self.heading[position] == name);
        let error = |problem: String| Err(self.source.error(self.line, None, problem, self.advice));
        match (positions.next(), positions.next()) {
            (Some(position), None) => Ok(position),
            (Some(first), Some(second)) => error(format!(
                "columns {} and {} are both named `{name}`",
                first + 1,
                second + 1
            )),
            (None, _) => {
                let headings: Vec<String> = self
                    .heading
                    .iter()
                    .map(|heading| format!("`{heading}`"))
                    .collect();
                error(format!(
                    "there is no column `{name}`; there are {}",
                    headings.join(", ")
                ))
            }
        }
    }

    /// Returns the positions of columns.
    ///
    /// # Errors
    /// If a column is missing, or there are two of the same name.
    pub fn columns(&self, names: &[&str]) -> Result<Vec<usize>, DataError> {
        names.iter().map(|name| self.column(name)).collect()
    }

    /// Returns the line on which a row starts.
    pub fn line(&self, row: &csv::StringRecord) -> u64 {
        row.position().map_or(1, csv::Position::line)
    }

    /// Returns the error about a cell.
    pub fn wrong(
        &self,
        row: &csv::StringRecord,
        column: usize,
        problem: impl Into<String>,
    ) -> DataError {
        self.source.error(
            self.line(row),
            self.heading.get(column).cloned(),
            problem,
            self.advice,
        )
    }

    /// Reads a structure from the cells at `columns`.
    pub fn read<T: Record>(
        &self,
        row: &csv::StringRecord,
        columns: &[usize],
    ) -> Result<T, DataError> {
        self.read_columns(row, columns, T::COLUMNS.iter())
    }

    /// Reads some columns of a structure from the cells at `columns`. The others have their
    /// defaults.
    pub fn read_columns<T: Default + 'static>(
        &self,
        row: &csv::StringRecord,
        columns: &[usize],
        of: impl Iterator<Item = &'static Column<T>>,
    ) -> Result<T, DataError> {
        parse(of, |position| {
            row.get(columns[position]).unwrap_or_default()
        })
        .map_err(|position| {
            let column = columns[position];
            let cell = row.get(column).unwrap_or_default();
            self.wrong(
                row,
                column,
                format!(
                    "`{}` is not a valid number for this column",
                    shortened(cell)
                ),
            )
        })
    }
}

/// Parses a record from the texts of its columns by position. The error is the position of a wrong
/// text.
fn parse<'t, R: Default + 'static>(
    columns: impl Iterator<Item = &'static Column<R>>,
    cell: impl Fn(usize) -> &'t str,
) -> Result<R, usize> {
    let mut record = R::default();
    for (position, column) in columns.enumerate() {
        let text = cell(position);
        let value = match column.whole {
            true => text.parse::<usize>().ok().map(|count| count as f64),
            false => text.parse().ok().filter(|number: &f64| number.is_finite()),
        };
        column.set(&mut record, value.ok_or(position)?);
    }
    Ok(record)
}
