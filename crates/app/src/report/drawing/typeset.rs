//! Numbers as they are printed.

/// Returns a text with typeset numbers: `-5` with a minus sign, `2e-14` with a power of ten.
pub(crate) fn typeset(text: &str) -> String {
    let mut typeset = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['-', 'e']) {
        let (before, from) = rest.split_at(at);
        let last = before
            .chars()
            .next_back()
            .or_else(|| typeset.chars().next_back());
        typeset.push_str(before);
        let after = &from[1..];
        let digits = after.trim_start_matches('-');
        let length = digits
            .find(|character: char| !character.is_ascii_digit())
            .unwrap_or(digits.len());
        let is_number = length > 0
            && after.len() - digits.len() <= 1
            && !digits[length..].starts_with(char::is_alphabetic);
        let sign = if after.len() > digits.len() {
            -1.0
        } else {
            1.0
        };
        match digits[..length].parse::<f64>() {
            Ok(exponent)
                if is_number
                    && from.starts_with('e')
                    && last.is_some_and(|last| last.is_ascii_digit()) =>
            {
                // A factor of one is left out.
                let before = typeset
                    .strip_suffix('1')
                    .filter(|before| !before.ends_with(|c: char| c.is_alphanumeric() || c == '.'));
                let point = match before.map(str::len) {
                    Some(length) => {
                        typeset.truncate(length);
                        ""
                    }
                    None => "·",
                };
                typeset.push_str(&format!("{point}{}", power_of_ten(sign * exponent)));
                rest = &digits[length..];
            }
            _ => {
                let is_minus = from.starts_with('-')
                    && after.starts_with(|next: char| next.is_ascii_digit())
                    && !last.is_some_and(char::is_alphanumeric);
                typeset.push_str(if is_minus { "−" } else { &from[..1] });
                rest = after;
            }
        }
    }
    typeset + rest
}

/// Returns `10ⁿ` as a label.
pub fn power_of_ten(exponent: f64) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |character: char| {
        character
            .to_digit(10)
            .map_or('⁻', |digit| RAISED[digit as usize])
    };
    format!(
        "10{}",
        format!("{exponent:.0}")
            .chars()
            .map(raised)
            .collect::<String>()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_with_minus_signs_and_powers_of_ten() {
        let cases = [
            ("offset = -5 mm", "offset = −5 mm"),
            ("-0.005", "−0.005"),
            (
                "k_P = 2.00e-14 m²/N, 6.2e5",
                "k_P = 2.00·10⁻¹⁴ m²/N, 6.2·10⁵",
            ),
            (
                "1e-7, -1e5, k = 11e3, 1.1e-3",
                "10⁻⁷, −10⁵, k = 11·10³, 1.1·10⁻³",
            ),
            (
                "first-order, PA6-12, 1e3x, tool-5, the edge",
                "first-order, PA6-12, 1e3x, tool-5, the edge",
            ),
            ("- e -", "- e -"),
        ];
        for (text, expected) in cases {
            assert_eq!(typeset(text), expected);
        }
    }
}
