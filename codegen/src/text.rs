//! Text of a file or a path in the form that a message shows.
//!
//! Text of others may be hostile. Escape sequences drive a terminal, line feeds forge messages,
//! overrides of the writing direction disguise a name, and a key may be as long as its file. Text
//! that enters a message therefore passes through [`shown`].

use std::fmt::{self, Display, Formatter, Write};
use std::path::Path;

/// Maximum length of a name or short text in a message, in characters.
const MAX_NAME_CHARS: usize = 40;
/// Maximum length of a path in a message: longer than people write, shorter than a screen.
const MAX_PATH_CHARS: usize = 400;

/// Applies [`shown`] to a name or a short text.
#[must_use]
pub fn shortened(text: &str) -> String {
    shown(text, MAX_NAME_CHARS)
}

/// Applies [`shown`] to a path. Bytes that are not UTF-8 become `�`.
#[must_use]
pub fn shown_path(path: &Path) -> String {
    shown(&path.to_string_lossy(), MAX_PATH_CHARS)
}

/// Prepares a text for a message: on one line, with every character visible. Of more than `most`
/// characters, `…` replaces the middle, since messages of parsers and paths say the most at their
/// ends.
#[must_use]
pub fn shown(text: &str, most: usize) -> String {
    let mut shown = String::new();
    match text.char_indices().nth(most) {
        None => write_visible(&mut shown, text, false),
        Some(_) => {
            let head = most.div_ceil(2);
            let end = text
                .char_indices()
                .nth(head)
                .map_or(text.len(), |(at, _)| at);
            let start = text
                .char_indices()
                .rev()
                .take(most - head)
                .last()
                .map_or(text.len(), |(at, _)| at);
            write_visible(&mut shown, &text[..end], false)
                .and_then(|()| shown.write_char('…'))
                .and_then(|()| write_visible(&mut shown, &text[start..], false))
        }
    }
    .expect("memory takes what is written to it");
    shown
}

/// A message of several lines with every other character visible.
#[derive(Clone, Copy, Debug)]
pub struct Lines<T>(
    /// The message.
    pub T,
);

impl<T: Display> Display for Lines<T> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        /// Escapes what is written to it.
        struct Visible<'a, 'f>(&'a mut Formatter<'f>);

        impl Write for Visible<'_, '_> {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                write_visible(self.0, text, true)
            }
        }

        write!(Visible(formatter), "{}", self.0)
    }
}

/// Writes a text, with invisible characters escaped. Line feeds may be kept.
fn write_visible(out: &mut impl Write, text: &str, keep_lines: bool) -> fmt::Result {
    for letter in text.chars() {
        if is_invisible(letter) && !(keep_lines && letter == '\n') {
            write!(out, "{}", letter.escape_unicode())?;
        } else {
            out.write_char(letter)?;
        }
    }
    Ok(())
}

/// `true` for control characters and those that change how others are shown. A reader of emitted
/// code must see what is there, and the compiler refuses some of them in comments.
#[must_use]
pub fn is_invisible(letter: char) -> bool {
    letter.is_control()
        || matches!(letter,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_drives_a_terminal_is_escaped() {
        assert_eq!(
            shortened("\u{1b}[31mred\n\u{9b}2J\u{202e}txt\u{2066}"),
            r"\u{1b}[31mred\u{a}\u{9b}2J\u{202e}txt\u{2066}"
        );
        assert_eq!(shortened("µ ä “x” 好 e\u{301}"), "µ ä “x” 好 e\u{301}");
        assert_eq!(
            Lines("one\n\ttwo\u{1b}").to_string(),
            "one\n\\u{9}two\\u{1b}"
        );
    }

    #[test]
    fn what_is_long_is_cut_in_the_middle() {
        assert_eq!(shown("abcdef", 6), "abcdef");
        assert_eq!(shown("äbcdefö", 5), "äbc…fö");
        assert_eq!(shown("abc", 0), "…");
        assert_eq!(shown("abc", 1), "a…");
        assert!(shown(&"\u{1b}".repeat(1000), 10).len() < 100);
    }
}
