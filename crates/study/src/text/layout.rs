//! Layout of lines in a terminal. Widths count the columns that characters take.

use std::fmt::{self, Display, Formatter};

use crate::text::columns;

/// Width of a terminal, in columns, unless it is known. Warnings are wrapped to it.
pub const WIDTH: usize = 80;
/// Longest line of prose, in columns, however wide the terminal is: longer ones are hard to read.
const MAX_PROSE_WIDTH: usize = 100;
/// Least room for prose of several lines beside a row of a table, in columns.
const MIN_WIDTH_BESIDE: usize = 40;
/// Indentation of prose below a row of a table, in columns.
const INDENT_BELOW: usize = 8;

/// Formats rows with equal numbers of cells as lines. Each column is right-aligned after two
/// spaces.
pub fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let widths = widths(rows);
    let line = |row: &Vec<String>| {
        row.iter()
            .zip(&widths)
            .map(|(cell, &width)| format!("  {}", right(cell, width)))
            .collect()
    };
    rows.iter().map(line).collect()
}

/// Returns the width of each column of rows with equal numbers of cells.
fn widths(rows: &[Vec<String>]) -> Vec<usize> {
    let count = rows.first().map_or(0, Vec::len);
    (0..count)
        .map(|column| {
            rows.iter()
                .map(|row| columns(&row[column]))
                .max()
                .unwrap_or(0)
        })
        .collect()
}

/// Pads a text with spaces before it to `width` columns.
pub fn right(text: &str, width: usize) -> String {
    " ".repeat(width.saturating_sub(columns(text))) + text
}

/// Pads a text with spaces after it to `width` columns.
pub fn left(text: &str, width: usize) -> String {
    text.to_owned() + &" ".repeat(width.saturating_sub(columns(text)))
}

/// Splits rows into blocks of columns, such that the lines of [`aligned`] fit into `width` if cells
/// allow it. Each block begins with the first `repeated` columns.
pub fn blocks(rows: &[Vec<String>], repeated: usize, width: usize) -> Vec<Vec<Vec<String>>> {
    let widths: Vec<usize> = widths(rows).into_iter().map(|width| width + 2).collect();
    let first: usize = widths[..repeated].iter().sum();
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let mut taken = width;
    for column in repeated..widths.len() {
        if taken + widths[column] > width {
            blocks.push((0..repeated).collect());
            taken = first;
        }
        taken += widths[column];
        blocks
            .last_mut()
            .expect("the first column begins a block")
            .push(column);
    }
    let of = |columns: &Vec<usize>| -> Vec<Vec<String>> {
        rows.iter()
            .map(|row| columns.iter().map(|&column| row[column].clone()).collect())
            .collect()
    };
    blocks.iter().map(of).collect()
}

/// Appends `beginning` and, indented to its right, `words`, in lines no longer than `width` if the
/// words allow it.
pub fn wrap(width: usize, text: &mut String, beginning: &str, words: &str) {
    let indent = columns(beginning);
    let width = width.min(indent + MAX_PROSE_WIDTH);
    text.push_str(beginning);
    let mut column = indent;
    for word in words.split(' ') {
        let letters = columns(word);
        if column > indent && column + 1 + letters > width {
            text.push_str(&format!("\n{:indent$}", ""));
            column = indent;
        } else if column > indent {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += letters;
    }
    text.push('\n');
}

/// Appends a row of a table and prose about it. Prose that fits on the line, or has much room
/// there, stands to the right of the row, otherwise below.
pub fn wrap_beside(width: usize, text: &mut String, row: &str, words: &str) {
    let beginning = format!("{row}  ");
    let room = width.saturating_sub(columns(&beginning));
    if columns(words) <= room || room >= MIN_WIDTH_BESIDE {
        wrap(width, text, &beginning, words);
    } else {
        text.push_str(&format!("{}\n", row.trim_end()));
        wrap(width, text, &" ".repeat(INDENT_BELOW), words);
    }
}

/// Warning about results that may mislead.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Id of a finding; empty for other warnings.
    id: &'static str,
    statement: String,
    /// Remedy, and the line to add to the input file for it, which may be empty.
    help: Option<(String, String)>,
}

impl Warning {
    /// Creates a warning with a statement.
    pub fn new(statement: impl Into<String>) -> Self {
        Self {
            id: "",
            statement: statement.into(),
            help: None,
        }
    }

    /// Returns the warning with an id.
    #[must_use]
    pub fn with_id(self, id: &'static str) -> Self {
        Self { id, ..self }
    }

    /// Returns the warning with a remedy, and a line to add to the input file.
    #[must_use]
    pub fn with_help(self, how: impl Into<String>, line: impl Into<String>) -> Self {
        Self {
            help: Some((how.into(), line.into())),
            ..self
        }
    }

    /// Returns the text in as many lines as it has parts, for callers that wrap lines.
    pub fn plain(&self) -> String {
        let help = self
            .help
            .as_ref()
            .map(|(how, line)| format!("\nhelp: {how} {line}").trim_end().to_owned());
        let id = if self.id.is_empty() {
            String::new()
        } else {
            format!("{}: ", self.id)
        };
        id + &self.statement + &help.unwrap_or_default()
    }
}

/// Formats the warning for a terminal 80 columns wide, without a line end.
impl Display for Warning {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        const HELP: &str = "   = help: ";
        let beginning = if self.id.is_empty() {
            "warning: ".to_owned()
        } else {
            format!("warning[{}]: ", self.id)
        };
        formatter.write_str(&wrapped(&beginning, &self.statement))?;
        let Some((how, line)) = &self.help else {
            return Ok(());
        };
        write!(formatter, "\n{}", wrapped(HELP, how))?;
        if line.is_empty() {
            return Ok(());
        }
        write!(formatter, "\n{:indent$}{line}", "", indent = HELP.len())
    }
}

/// Formats a note for a terminal 80 columns wide, without a line end.
pub fn note(statement: &str) -> String {
    wrapped("note: ", statement)
}

fn wrapped(beginning: &str, statement: &str) -> String {
    let mut text = String::new();
    wrap(WIDTH, &mut text, beginning, statement);
    text.truncate(text.trim_end().len());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(rows: &[&[&str]]) -> Vec<Vec<String>> {
        rows.iter()
            .map(|row| row.iter().map(|cell| (*cell).to_owned()).collect())
            .collect()
    }

    #[test]
    fn lines_are_wrapped_between_words() {
        let mut text = String::new();
        wrap(
            WIDTH,
            &mut text,
            "ε_tc  ",
            &"word ".repeat(40).trim_end().replace("word word", "word µ"),
        );
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines
                .iter()
                .all(|line| columns(line) <= WIDTH && line.trim_end() == *line),
            "{text}"
        );
        assert!(
            lines[0].starts_with("ε_tc  word") && lines[1].starts_with("      "),
            "{text}"
        );
        assert_eq!(text.split_whitespace().count(), 41);
        let mut wide = String::new();
        wrap(500, &mut wide, "", &"word ".repeat(40));
        assert!(
            wide.lines().all(|line| columns(line) <= MAX_PROSE_WIDTH),
            "{wide}"
        );
    }

    #[test]
    fn wide_characters_take_two_columns() {
        let table = aligned(&rows(&[&["刷子", "1"], &["b", "23"]]));
        assert_eq!(table, ["  刷子   1", "     b  23"]);
        assert_eq!(
            (left("刷", 4), right("刷", 4)),
            ("刷  ".to_owned(), "  刷".to_owned())
        );
        let mut text = String::new();
        wrap(10, &mut text, "", "刷刷 刷刷 刷刷");
        assert_eq!(text, "刷刷 刷刷\n刷刷\n");
    }

    #[test]
    fn columns_that_do_not_fit_begin_another_block() {
        let rows = rows(&[&["key", "one", "two", "three"], &["1", "2", "3", "4"]]);
        let of = |width| {
            blocks(&rows, 1, width)
                .iter()
                .map(|block| block[0].join(" "))
                .collect::<Vec<_>>()
        };
        assert_eq!(of(80), ["key one two three"]);
        assert_eq!(of(21), ["key one two", "key three"]);
        assert_eq!(of(1), ["key one", "key two", "key three"]);
    }

    #[test]
    fn prose_stands_beside_a_row_if_there_is_room() {
        let told = |width| {
            let mut text = String::new();
            wrap_beside(width, &mut text, "  1  2", "It sweeps.");
            text
        };
        assert_eq!(
            (told(18), told(17)),
            (
                "  1  2  It sweeps.\n".to_owned(),
                "  1  2\n        It\n        sweeps.\n".to_owned()
            )
        );
        let mut text = String::new();
        wrap_beside(48, &mut text, "  1  2", &"word ".repeat(12));
        assert!(
            text.starts_with("  1  2  word word") && text.lines().count() == 2,
            "{text}"
        );
    }
}
