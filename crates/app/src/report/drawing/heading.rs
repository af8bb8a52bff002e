//! Headings of figures: a title and smaller text below it, in as many lines as they need.

use super::format::Format;
use super::{Canvas, GREY, INK, fine, font, text, typeset};

/// Place of the first line, and distance between lines, in pixels.
const TOP: i32 = 14;
const LINE: i32 = 18;
/// Font sizes of title and subtitle, in pixels.
const TITLE: i32 = 14;
const SUBTITLE: i32 = 11;
/// Room that stays free at the right, in pixels.
const RIGHT: i32 = 8;
/// Share of the room that a line of Helvetica may take. A line of a wider font then fits, too.
const MAX_LINE_SHARE: f32 = 0.84;
/// Height of a heading of one line, with the room below it, in pixels.
const HEIGHT: i32 = 40;
/// Room for factors of an axis without a heading, in pixels.
const NO_HEIGHT: i32 = 24;

/// A title and a subtitle, which may be empty or have several lines.
#[derive(Clone, Debug)]
pub struct Heading {
    title: Vec<String>,
    subtitle: Vec<String>,
    left: i32,
}

impl Heading {
    /// Returns the heading of a figure of a `width` in pixels, which begins at the pixel `left`.
    pub fn new(format: &Format, title: &str, subtitle: &str, [left, width]: [i32; 2]) -> Self {
        // On paper, text must end within the figure in any font that a viewer has.
        let part = if format.is_on_paper() {
            MAX_LINE_SHARE
        } else {
            1.0
        };
        let room = part * (width - left - RIGHT) as f32;
        let [title, subtitle] = [(title, TITLE), (subtitle, SUBTITLE)].map(|(text, usual)| {
            let lines = text.lines();
            lines
                .flat_map(|line| wrapped(&typeset(line), format.font_size(usual), room))
                .collect()
        });
        let [title, subtitle] = if format.has_title() {
            [title, subtitle]
        } else {
            [Vec::new(), Vec::new()]
        };
        Self {
            title,
            subtitle,
            left,
        }
    }

    /// Returns the height of the heading with the room below it, in pixels.
    pub fn height(&self) -> i32 {
        match self.title.len() + self.subtitle.len() {
            0 => NO_HEIGHT,
            lines => HEIGHT + LINE * (lines as i32 - 1),
        }
    }

    /// Draws the heading.
    pub fn draw(&self, canvas: &mut Canvas) {
        let titles = self.title.iter().map(|line| (line, text(TITLE, INK)));
        let subtitles = self
            .subtitle
            .iter()
            .map(|line| (line, text(SUBTITLE, GREY)));
        for (row, (line, style)) in (0..).zip(titles.chain(subtitles)) {
            canvas.text(line, style, (fine(self.left), fine(TOP + LINE * row)));
        }
    }
}

/// Splits a text of a font size into lines of at most `room`, both in pixels, if its words are
/// short enough. An empty text has no lines.
fn wrapped(text: &str, size: i32, room: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words(text) {
        match lines.last_mut() {
            Some(line) if font::length(&format!("{line} {word}"), size) <= room => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

/// Returns the words of a text. Signs of a number, such as `±` and `%`, stay with the number.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let is_between = |word: &str| ["±", "="].contains(&word);
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        let belongs =
            |last: &String| is_between(word) || word.starts_with('%') || last.ends_with(['±', '=']);
        match words.last_mut().filter(|last| belongs(last)) {
            Some(last) => {
                last.push(' ');
                last.push_str(word);
            }
            None => words.push(word.to_owned()),
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_headings_have_several_lines() {
        let text = "one two three four";
        assert_eq!(wrapped(text, 10, 1e3), [text]);
        assert_eq!(wrapped(text, 10, 40.0), ["one two", "three", "four"]);
        assert_eq!(wrapped(text, 10, 1.0), ["one", "two", "three", "four"]);
        assert!(wrapped("", 10, 50.0).is_empty());
        assert_eq!(
            words("d ± 2.5 %, N_f = 10 ± 1; all"),
            ["d ± 2.5 %,", "N_f = 10 ± 1;", "all"]
        );
        let height =
            |title, subtitle| Heading::new(&Format::default(), title, subtitle, [60, 160]).height();
        assert_eq!(
            [height("a title", ""), height("a title", "short")],
            [40, 58]
        );
        assert_eq!(
            height("a title", "a subtitle that is longer than the figure"),
            94
        );
        assert_eq!(
            Heading::new(
                &Format::default().without_title(),
                "a title",
                "more",
                [60, 160]
            )
            .height(),
            NO_HEIGHT
        );
    }
}
