//! Natural mistakes in the lines of an input file, and what to write instead.

use crate::text::shortened;
use crate::text::units::in_unit_of;

/// A number that people write and TOML does not know.
#[derive(Debug)]
pub(crate) struct Mistake {
    /// Problem, in a clause about the number.
    pub(crate) what: String,
    /// Advice.
    pub(crate) instead: String,
}

/// Finds a usual mistake in a number, or in one of a list, in a `line` that is not TOML. `None` if
/// there is none.
pub(crate) fn value_mistake(line: &str) -> Option<Mistake> {
    let (key, value) = line.split_once('=')?;
    let value = value.split('#').next()?.trim();
    let key = key.trim().trim_matches('"');
    match value.strip_prefix('[') {
        // A comma separates the numbers of a list.
        Some(list) => list
            .trim_end_matches(']')
            .split(',')
            .find_map(|number| number_mistake(key, number.trim())),
        None => number_mistake(key, value),
    }
}

/// Finds a usual mistake in the number at a key.
fn number_mistake(key: &str, value: &str) -> Option<Mistake> {
    let mistake = |what: &str, instead: String| {
        Some(Mistake {
            what: format!("{} {what}", shortened(value)),
            instead,
        })
    };
    let digits = value.strip_prefix(['+', '-']).unwrap_or(value);
    if !digits.starts_with(|first: char| first.is_ascii_digit() || first == '.') {
        return None;
    }
    if digits.starts_with('.') {
        let instead = format!(
            "write a digit before the decimal point: {}",
            value.replacen('.', "0.", 1)
        );
        return mistake("begins with its decimal point", instead);
    }
    let end = digits
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(digits.len());
    let (number, rest) = digits.split_at(end);
    // An exponent belongs to the number.
    let exponent = rest
        .strip_prefix(['e', 'E'])
        .map(|rest| rest.trim_start_matches(['+', '-']));
    let after = exponent.map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()));
    let rest = match (exponent, after) {
        (Some(exponent), Some(after)) if after.len() < exponent.len() => after,
        _ => rest,
    };
    let sign = &value[..value.len() - digits.len()];
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if let Some(decimals) = rest.strip_prefix(',')
        && is_number(decimals.trim())
    {
        let instead = format!(
            "write a decimal point instead of the comma: {sign}{number}.{}",
            decimals.trim()
        );
        return mistake("has a decimal comma", instead);
    }
    if let Some(thousands) = rest.strip_prefix([' ', '\'', '\u{a0}', '\u{202f}'])
        && is_number(thousands)
    {
        return mistake(
            "has a gap",
            format!("write the number without gaps: {sign}{number}{thousands}"),
        );
    }
    let unit = rest.trim();
    let is_unit = unit.starts_with(|first: char| first.is_alphabetic() || "°%".contains(first));
    if is_unit {
        let alone = value[..value.len() - rest.len()].trim();
        let instead = match in_own_unit(key, alone, unit) {
            Some(number) => {
                format!("write the number without a unit, in that of the key: {number}")
            }
            None => "write the number without a unit: the key states the unit, as in length_m"
                .to_owned(),
        };
        return mistake("has a unit", instead);
    }
    if rest.is_empty() && number.ends_with('.') {
        return mistake(
            "ends with its decimal point",
            format!("write a digit after the decimal point: {value}0"),
        );
    }
    None
}

/// Converts a number with a unit to the unit of a key, if both are known.
fn in_own_unit(key: &str, number: &str, unit: &str) -> Option<String> {
    let number = in_unit_of(key, number.parse().ok()?, unit)?;
    Some(if number.abs() >= 1e7 {
        format!("{number:e}")
    } else {
        number.to_string()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_write_them_are_recognised() {
        let cases = [
            ("length_m = 0,03", Some("0.03")),
            ("length_m = -0,03 # free", Some("-0.03")),
            ("length_m = 30 mm", Some("of the key: 0.03")),
            ("length_m = 30mm", Some("of the key: 0.03")),
            ("length_m = 2 in", Some("the key states the unit")),
            ("youngs_modulus_pa = 3e9 Pa", Some("of the key: 3e9")),
            ("youngs_modulus_pa = 3.3 GPa", Some("of the key: 3.3e9")),
            ("brushing_velocity_m_s = 600 m/min", Some("of the key: 10")),
            ("lateral_tilt_rad = 5°", Some("of the key: 0.0872664625997")),
            ("damping_ratio = 5 %", Some("of the key: 0.05")),
            (
                "penetration_depth_m = [1 mm, 2 mm]",
                Some("of the key: 0.001"),
            ),
            ("penetration_depth_m = [1e-3, .5e-3]", Some(": 0.5e-3")),
            ("length_m = .03", Some(": 0.03")),
            ("length_m = 3.", Some(": 3.0")),
            ("filament_count = 10 500", Some("10500")),
            ("filament_count = 10'500", Some("10500")),
            ("length_m = ", None),
            ("length_m = long", None),
            ("length_m = [1, 2", None),
            ("nothing", None),
        ];
        for (line, expected) in cases {
            let found = value_mistake(line);
            let instead = found.as_ref().map(|mistake| mistake.instead.as_str());
            match expected {
                Some(part) => assert!(
                    instead.is_some_and(|text| text.contains(part)),
                    "{line}: {found:?}"
                ),
                None => assert_eq!(instead, None, "{line}"),
            }
        }
    }
}
