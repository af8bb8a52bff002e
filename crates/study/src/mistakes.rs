//! Natural mistakes in the lines of an input file, and what to write instead.

/// Units of keys that people write instead of that of the setting: the end of their key, that of the setting's, and the conversion.
const OTHER_UNITS: [(&str, &str, &str); 12] = [
    ("_mm_s", "_m_s", "1 mm/s is 0.001 m/s"),
    ("_m_min", "_m_s", "1 m/min is 0.01667 m/s"),
    ("_mm", "_m", "1 mm is 0.001 m"),
    ("_cm", "_m", "1 cm is 0.01 m"),
    ("_um", "_m", "1 µm is 1e-6 m"),
    ("_gpa", "_pa", "1 GPa is 1e9 Pa"),
    ("_mpa", "_pa", "1 MPa is 1e6 Pa"),
    ("_g_cm3", "_kg_m3", "1 g/cm³ is 1000 kg/m³"),
    ("_deg", "_rad", "1° is 0.017453 rad"),
    ("_hz", "_rpm", "1 revolution per second is 60 rpm"),
    ("_rad_s", "_rpm", "1 rad/s is 9.5493 rpm"),
    ("_n_mm", "_n_m", "1 N/mm is 1000 N/m"),
];

/// The conversion of a key's unit to that of the key that was meant, with a space before it; empty if it is the same.
pub(crate) fn other_unit(written: &str, meant: &str) -> String {
    let unit = |(other, own, _): &&(&str, &str, &str)| written.ends_with(other) && meant.ends_with(own);
    OTHER_UNITS
        .iter()
        .find(unit)
        .filter(|(_, own, _)| !written.ends_with(own))
        .map_or_else(String::new, |(_, _, conversion)| format!(" {conversion}"))
}

/// A key without the unit at its end, if it has one.
pub(crate) fn without_unit(key: &str) -> Option<&str> {
    const OWN_UNITS: [&str; 9] = ["_kg_m3", "_n_m2", "_m_s", "_s_m", "_n_m", "_rpm", "_rad", "_pa", "_m"];
    let units = OTHER_UNITS.iter().map(|(other, ..)| *other).chain(OWN_UNITS);
    units.filter_map(|unit| key.strip_suffix(unit)).min_by_key(|bare| bare.len())
}

/// What is wrong with the number of a `line` that is not TOML, and what to write. `None` if it is none of the usual mistakes.
pub(crate) fn value_mistake(line: &str) -> Option<String> {
    let (_, value) = line.split_once('=')?;
    let value = value.split('#').next()?.trim();
    let digits = value.strip_prefix(['+', '-']).unwrap_or(value);
    if !digits.starts_with(|first: char| first.is_ascii_digit() || first == '.') {
        return None;
    }
    if digits.starts_with('.') {
        return Some(format!("write a digit before the decimal point: {}", value.replacen('.', "0.", 1)));
    }
    let end = digits.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(digits.len());
    let (number, rest) = digits.split_at(end);
    // An exponent belongs to the number.
    let exponent = rest.strip_prefix(['e', 'E']).map(|rest| rest.trim_start_matches(['+', '-']));
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
        return Some(format!("write a decimal point instead of the comma: {sign}{number}.{}", decimals.trim()));
    }
    if let Some(thousands) = rest.strip_prefix([' ', '\'', '\u{a0}', '\u{202f}'])
        && is_number(thousands)
    {
        return Some(format!("write the number without gaps: {sign}{number}{thousands}"));
    }
    let unit = rest.trim();
    let is_unit = unit.starts_with(|first: char| first.is_alphabetic() || "°%".contains(first));
    if is_unit {
        return Some("write the number without a unit: the key states the unit, as in length_m".to_owned());
    }
    if rest.is_empty() && number.ends_with('.') {
        return Some(format!("write a digit after the decimal point: {value}0"));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_write_them_are_recognised() {
        let cases = [
            ("length_m = 0,03", Some("0.03")),
            ("length_m = -0,03 # free", Some("-0.03")),
            ("length_m = 30 mm", Some("without a unit")),
            ("length_m = 30mm", Some("without a unit")),
            ("youngs_modulus_pa = 3e9 Pa", Some("without a unit")),
            ("lateral_tilt_rad = 5°", Some("without a unit")),
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
            match expected {
                Some(part) => assert!(found.as_deref().is_some_and(|text| text.contains(part)), "{line}: {found:?}"),
                None => assert_eq!(found, None, "{line}"),
            }
        }
    }

    #[test]
    fn another_unit_has_its_conversion() {
        assert_eq!(other_unit("length_mm", "length_m"), " 1 mm is 0.001 m");
        assert_eq!(other_unit("length", "length_m"), "");
        assert_eq!(other_unit("lenght_m", "length_m"), "");
        assert_eq!(other_unit("brushing_velocity_m_min", "brushing_velocity_m_s"), " 1 m/min is 0.01667 m/s");
    }
}
