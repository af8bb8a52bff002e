//! Line breaks of formulas.

use crate::print::printer::PageLayout;

/// Depth that a break between factors has in addition.
const FACTORS: usize = 6;
/// The depths of brackets at which lines are broken: wherever it helps, and only if a piece is too
/// wide.
pub(super) type Breaks = [usize; 2];
pub(super) const ANYWHERE: Breaks = [1, 12];
/// Breaks before signs outside all brackets, and elsewhere only if a piece is too wide.
pub(super) const BETWEEN_TERMS: Breaks = [0, 12];
/// Depth that braces add: LaTeX cannot break inside them.
const BRACES: usize = 100;

/// A part of a formula that stays on one line, with the number of brackets around the break before
/// it.
struct FormulaPiece<'a> {
    text: &'a str,
    width: usize,
    depth: usize,
}

/// Breaks `body` into lines of at most `width`. With [`ANYWHERE`] lines end before signs outside
/// all brackets or in the outermost pair; deeper, or between factors, only where a piece is too
/// wide otherwise.
pub(super) fn lines(
    notation: &dyn PageLayout,
    body: &str,
    width: usize,
    breaks: Breaks,
) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut filled = 0;
    for group in groups(&pieces(notation, body), breaks, width) {
        let size: usize = group.iter().map(|piece| piece.width).sum();
        if filled > 0 && filled + size > width {
            lines.push(String::new());
            filled = 0;
        }
        let line = lines.last_mut().expect("there is a first line");
        let text: String = group.iter().map(|piece| piece.text).collect();
        let start = if filled == 0 {
            text.trim_start()
        } else {
            &text
        };
        line.push_str(start);
        filled += if start.len() < text.len() {
            notation.width(start)
        } else {
            size
        };
    }
    lines
}

/// Groups pieces between breaks of at most `depth`, or of a larger depth, up to the `deepest`,
/// where a group is too wide.
fn groups<'a, 'b>(
    pieces: &'b [FormulaPiece<'a>],
    [depth, deepest]: Breaks,
    width: usize,
) -> Vec<&'b [FormulaPiece<'a>]> {
    let mut result = Vec::new();
    let mut start = 0;
    for end in 1..=pieces.len() {
        if end < pieces.len() && pieces[end].depth > depth {
            continue;
        }
        let group = &pieces[start..end];
        let size: usize = group.iter().map(|piece| piece.width).sum();
        if size > width && depth < deepest && group.len() > 1 {
            result.extend(groups(group, [depth + 1, deepest], width));
        } else {
            result.push(group);
        }
        start = end;
    }
    result
}

/// Cuts `body` before each space at which it may be broken.
fn pieces<'a>(notation: &dyn PageLayout, body: &'a str) -> Vec<FormulaPiece<'a>> {
    let mut pieces = Vec::new();
    let (mut start, mut start_depth, mut depth) = (0, 0, 0_usize);
    // Start of the current word, whose backslash marks a command.
    let mut word = 0;
    for (index, character) in body.char_indices() {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            '{' => depth += BRACES,
            '}' => depth = depth.saturating_sub(BRACES),
            ' ' => {
                let sign = |text: &str| matches!(text, "+" | "-" | "−");
                let next = body[index + 1..]
                    .chars()
                    .next()
                    .map_or("", |next| &body[index + 1..index + 1 + next.len_utf8()]);
                let last = &body[word..index];
                let bound = sign(last)
                    || last == "<"
                    || next == "<"
                    || is_command(last)
                    || is_function(last);
                word = index + 1;
                if !bound {
                    let text = &body[start..index];
                    pieces.push(FormulaPiece {
                        text,
                        width: notation.width(text),
                        depth: start_depth,
                    });
                    start = index;
                    start_depth = if sign(next) { depth } else { depth + FACTORS };
                }
            }
            _ => {}
        }
    }
    let text = &body[start..];
    pieces.push(FormulaPiece {
        text,
        width: notation.width(text),
        depth: start_depth,
    });
    pieces
}

/// `true` for a word that ends in a LaTeX command, whose argument may follow.
fn is_command(word: &str) -> bool {
    word.rfind('\\').is_some_and(|start| {
        let name = word[start + 1..].trim_end_matches(|last: char| last.is_ascii_digit());
        let name = name.split(['^', '{']).next().unwrap_or_default();
        matches!(
            name,
            "sin"
                | "cos"
                | "arcsin"
                | "cdot"
                | "dot"
                | "ddot"
                | "dddot"
                | "hat"
                | "tilde"
                | "bar"
                | "vec"
        )
    })
}

/// `true` for a word that ends in the name of a function of a text, whose argument follows.
fn is_function(word: &str) -> bool {
    let name = word
        .trim_start_matches(['(', '[', '−'])
        .trim_end_matches(|last| "⁰¹²³⁴⁵⁶⁷⁸⁹".contains(last));
    matches!(name, "sin" | "cos" | "asin" | "exp" | "ln" | "tanh")
}
