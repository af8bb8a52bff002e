//! Errors in an input file, each with its place in the file.

use std::fmt::{self, Display};
use std::ops::Range;
use std::path::Path;

use crate::text::{is_invisible, shortened, shown_path};
use thiserror::Error;

/// Source lines longer than this are cut, so that they fit into a terminal of 80 columns.
const LONGEST_LINE: usize = 72;
/// Longest key and longest message of the parser, in characters.
pub(crate) const LONGEST_KEY: usize = 80;
pub(crate) const LONGEST_MESSAGE: usize = 200;

/// Problem in an input file, its place, and advice.
///
/// Prints several lines: the problem, the file, line and column with the line itself, and the
/// advice.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{problem}\n{location}{}", advice_line(.advice))]
pub struct InputError {
    /// Dotted path of the key that is to blame, or the name of a section. `None` if the text as a
    /// whole is.
    pub key: Option<String>,
    /// Statement of the problem.
    pub problem: String,
    /// Place of the problem.
    pub location: Box<Location>,
    /// Advice; empty if the problem says it all.
    pub advice: String,
}

fn advice_line(advice: &str) -> String {
    if advice.is_empty() {
        String::new()
    } else {
        format!("\n   = help: {advice}")
    }
}

/// A place in an input file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// Name of the file, as messages show it.
    pub file: String,
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
    /// Line, cut if long, without control characters.
    excerpt: String,
    /// Columns of `excerpt` to underline, counted from 0.
    marked: Range<usize>,
}

impl Display for Location {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let indent = " ".repeat(self.marked.start);
        let underline = "^".repeat(self.marked.len());
        writeln!(
            formatter,
            "{margin} --> {}:{number}:{}",
            self.file, self.column
        )?;
        writeln!(formatter, "{margin} |")?;
        writeln!(formatter, "{number} | {}", self.excerpt)?;
        write!(formatter, "{margin} | {indent}{underline}")
    }
}

/// An input file's name and text, in which errors are located, and the options that add to it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InputSource<'t> {
    pub(crate) name: &'t str,
    pub(crate) text: &'t str,
    /// Options. Their places follow those in the text, as if each were a line below it.
    pub(crate) options: &'t [String],
}

impl<'t> InputSource<'t> {
    /// Returns the place at which an option starts.
    pub(crate) fn start_of_option(&self, number: usize) -> usize {
        self.options[..number]
            .iter()
            .fold(self.text.len() + 1, |start, option| {
                start + option.len() + 1
            })
    }

    /// Returns the text that contains a place, and where the text starts.
    fn part(&self, place: usize) -> (InputSource<'t>, usize) {
        let of_option = |number: usize| {
            let start = self.start_of_option(number);
            let source = InputSource {
                name: "--set",
                text: &self.options[number],
                options: &[],
            };
            (start..=start + source.text.len())
                .contains(&place)
                .then_some((source, start))
        };
        let own = || {
            (
                InputSource {
                    options: &[],
                    ..*self
                },
                0,
            )
        };
        (0..self.options.len())
            .find_map(of_option)
            .unwrap_or_else(own)
    }

    /// Returns the location of a range of bytes. A range outside the text counts as the text's end.
    pub(crate) fn location(&self, span: Range<usize>) -> Location {
        let (source, before) = self.part(span.start);
        source.location_here(span.start - before..span.end.max(span.start) - before)
    }

    /// Returns the location of a range within the text.
    fn location_here(&self, span: Range<usize>) -> Location {
        let start = self.char_boundary(span.start);
        let end = self.char_boundary(span.end).max(start);
        let line_start = self.text[..start]
            .rfind('\n')
            .map_or(0, |newline| newline + 1);
        let line_end = self.text[start..]
            .find('\n')
            .map_or(self.text.len(), |newline| start + newline);
        let columns_before = self.text[line_start..start].chars().count();
        let columns_marked = self.text[start..end.min(line_end).max(start)]
            .chars()
            .count();

        // The excerpt of a long line starts a little before the place.
        let columns = self.text[line_start..line_end].chars().count();
        let skipped = columns_before
            .saturating_sub(LONGEST_LINE / 2)
            .min(columns.saturating_sub(LONGEST_LINE));
        let excerpt: String = self.text[line_start..line_end]
            .trim_end_matches('\r')
            .chars()
            .skip(skipped)
            .take(LONGEST_LINE)
            .map(|character| {
                if is_invisible(character) {
                    ' '
                } else {
                    character
                }
            })
            .collect();
        let mark_start = columns_before - skipped;
        let mark_end = (mark_start + columns_marked)
            .min(LONGEST_LINE)
            .max(mark_start + 1);
        Location {
            file: shown_path(Path::new(self.name)),
            line: self.text[..line_start].matches('\n').count() + 1,
            column: columns_before + 1,
            excerpt,
            marked: mark_start..mark_end,
        }
    }

    /// Returns the line at a byte.
    pub(crate) fn line(&self, byte: usize) -> &str {
        let byte = self.char_boundary(byte);
        let start = self.text[..byte]
            .rfind('\n')
            .map_or(0, |newline| newline + 1);
        self.text[start..].lines().next().unwrap_or_default()
    }

    /// Returns the last character boundary at or before a byte.
    fn char_boundary(&self, byte: usize) -> usize {
        let mut byte = byte.min(self.text.len());
        while !self.text.is_char_boundary(byte) {
            byte -= 1;
        }
        byte
    }

    /// Returns the text at a range of bytes, cut if long, for quoting in a message.
    pub(crate) fn quote(&self, span: Range<usize>) -> String {
        let (source, before) = self.part(span.start);
        let text = span
            .end
            .checked_sub(before)
            .and_then(|end| source.text.get(span.start - before..end));
        let text = text.unwrap_or_default();
        shortened(&text.replace(['\n', '\r', '\t'], " "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_names_line_and_column_and_marks_the_text() {
        let source = InputSource {
            name: "a.toml",
            text: "one = 1\nzwölf = 12\n",
            options: &[],
        };
        let location = source.location(17..19);
        assert_eq!((location.line, location.column), (2, 9));
        assert_eq!(
            location.to_string(),
            "  --> a.toml:2:9\n  |\n2 | zwölf = 12\n  |         ^^"
        );
    }

    #[test]
    fn places_at_the_edges_do_not_panic() {
        for text in ["", "\n", "a", "ä\r\n", "x = \u{1b}[0m"] {
            let source = InputSource {
                name: "",
                text,
                options: &[],
            };
            for start in 0..12 {
                for end in 0..12 {
                    let _ = source.location(start..end).to_string();
                    let _ = source.quote(start..end);
                }
            }
        }
    }

    #[test]
    fn a_long_line_is_cut_around_the_place() {
        let text = format!("x = [{}nan]", "1.0, ".repeat(1000));
        let start = text.len() - 4;
        let location = InputSource {
            name: "a",
            text: &text,
            options: &[],
        }
        .location(start..start + 3);
        assert!(location.excerpt.chars().count() <= LONGEST_LINE);
        assert_eq!(&location.excerpt[location.marked.clone()], "nan");
    }
}
