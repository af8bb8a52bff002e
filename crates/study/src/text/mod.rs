//! Formats of [`number`]s and lines ([`layout`]) for people, the [`units`] of keys, and text of
//! files as a message shows it ([`shown`]).

pub mod layout;
pub mod number;
pub mod units;

pub use bristle_codegen::text::{Lines, is_invisible, shortened, shown, shown_path};
use unicode_width::UnicodeWidthStr;

/// Returns the words with a capital letter at the beginning.
#[must_use]
pub fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}

/// Returns the columns that a line of text takes in a terminal: two for a character of Chinese,
/// none for a combining accent.
#[must_use]
pub fn columns(line: &str) -> usize {
    line.width()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_letter_becomes_a_capital() {
        assert_eq!(
            ["tip deflection", "ε_tc", "2 turns", ""].map(capitalised),
            ["Tip deflection", "Ε_tc", "2 turns", ""]
        );
    }

    #[test]
    fn columns_are_those_of_a_terminal() {
        assert_eq!(
            ["ε_tc", "─┼│", "刷子", "e\u{301}", ""].map(columns),
            [4, 3, 4, 1, 0]
        );
    }
}
