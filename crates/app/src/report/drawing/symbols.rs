//! Symbols in running text: `F_n,w` is an F with the subscript "n,w".

/// A part of a text in one font size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextRun<'a> {
    /// Characters of the run.
    pub text: &'a str,
    /// `true` for a subscript.
    pub is_subscript: bool,
}

/// Height of a subscript and its distance below the baseline, as percentages of the font size.
const HEIGHT: i32 = 70;
const DROP: i32 = 20;

impl TextRun<'_> {
    /// Returns the font size of the run in a text of the font size `size`.
    pub(super) fn size(&self, size: i32) -> i32 {
        if self.is_subscript {
            size * HEIGHT / 100
        } else {
            size
        }
    }

    /// Returns the distance of the run below the baseline of a text of the font size `size`.
    pub(super) fn drop(&self, size: i32) -> i32 {
        if self.is_subscript {
            size * DROP / 100
        } else {
            0
        }
    }
}

/// Splits a text into the parts on the baseline and the subscripts of symbols.
///
/// A symbol is one letter, possibly with accents or a leading `Δ`, followed by `_` and its
/// subscript. A subscript consists of lower-case letters, digits, and commas without a space
/// between them, or of one capital letter. Names such as `relative_tolerance` are not symbols and
/// stay unchanged.
pub fn runs(text: &str) -> Vec<TextRun<'_>> {
    let mut runs = Vec::new();
    let mut add = |text, is_subscript| runs.push(TextRun { text, is_subscript });
    let mut start = 0;
    for (at, _) in text.match_indices('_') {
        let length = subscript(&text[at + 1..]);
        if length > 0 && ends_with_symbol(&text[..at]) {
            add(&text[start..at], false);
            start = at + 1 + length;
            add(&text[at + 1..start], true);
        }
    }
    if start < text.len() || start == 0 {
        add(&text[start..], false);
    }
    runs
}

/// Returns `true` if `text` ends with a letter that can have a subscript.
fn ends_with_symbol(text: &str) -> bool {
    let is_accent = |character: &char| ('\u{300}'..='\u{36F}').contains(character);
    let mut backwards = text.chars().rev().skip_while(is_accent);
    let is_letter = backwards.next().is_some_and(char::is_alphabetic);
    let before = match backwards.next() {
        Some('Δ') => backwards.next(),
        other => other,
    };
    is_letter && before.is_none_or(|character| !character.is_alphanumeric() && character != '_')
}

/// Returns the length in bytes of the subscript at the start of `text`; zero without one.
fn subscript(text: &str) -> usize {
    let is_part = |byte: &u8| byte.is_ascii_lowercase() || byte.is_ascii_digit();
    let bytes = text.as_bytes();
    let joins = |at: usize| bytes[at] == b',' && at > 0 && bytes.get(at + 1).is_some_and(is_part);
    let length = match bytes.first() {
        Some(first) if first.is_ascii_uppercase() => 1,
        _ => (0..bytes.len())
            .take_while(|&at| is_part(&bytes[at]) || joins(at))
            .count(),
    };
    let goes_on = text[length..].starts_with(|next: char| next.is_alphanumeric() || next == '_');
    if goes_on { 0 } else { length }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the text with its subscripts in brackets.
    fn marked(text: &str) -> String {
        runs(text)
            .iter()
            .map(|run| {
                if run.is_subscript {
                    format!("[{}]", run.text)
                } else {
                    run.text.into()
                }
            })
            .collect()
    }

    #[test]
    fn subscripts_are_those_of_symbols() {
        let cases = [
            ("F_n,w in N", "F[n,w] in N"),
            ("ε_tc", "ε[tc]"),
            ("a_e, n = 25", "a[e], n = 25"),
            (
                "l_f ± 0.75 %, ΔN_f = 600; 3 of 10 values of a_e",
                "l[f] ± 0.75 %, ΔN[f] = 600; 3 of 10 values of a[e]",
            ),
            ("s_n,max in mm", "s[n,max] in mm"),
            ("ΔE/E_kin", "ΔE/E[kin]"),
            ("exp(−0.05 Ω_1 t)", "exp(−0.05 Ω[1] t)"),
            ("F\u{304}_n", "F\u{304}[n]"),
            ("k_P = 1", "k[P] = 1"),
            ("no symbol", "no symbol"),
            ("", ""),
        ];
        for (text, expected) in cases {
            assert_eq!(marked(text), expected);
        }
    }

    #[test]
    fn names_of_settings_stay() {
        for name in [
            "solver.relative_tolerance",
            "tool.width_m in m",
            "damping_s_m = 1",
            "a_",
            "_a",
            "a_b_c",
            "v_Max",
            "3_a",
        ] {
            assert_eq!(
                runs(name),
                [TextRun {
                    text: name,
                    is_subscript: false
                }]
            );
        }
    }
}
