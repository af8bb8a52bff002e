//! Units at the ends of keys.

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

/// Units at the ends of keys. Those that end another come after it.
const OWN_UNITS: [&str; 9] = ["_kg_m3", "_n_m2", "_m_s", "_s_m", "_n_m", "_rpm", "_rad", "_pa", "_m"];

/// The conversion of a key's unit to that of the key that was meant, with a space before it; empty if it is the same.
#[must_use]
pub fn other_unit(written: &str, meant: &str) -> String {
    let unit = |(other, own, _): &&(&str, &str, &str)| written.ends_with(other) && meant.ends_with(own);
    OTHER_UNITS
        .iter()
        .find(unit)
        .filter(|(_, own, _)| !written.ends_with(own))
        .map_or_else(String::new, |(_, _, conversion)| format!(" {conversion}"))
}

/// The unit at the end of a key of an input file; empty if it has none.
#[must_use]
pub fn own_unit(key: &str) -> &'static str {
    OWN_UNITS.into_iter().find(|own| key.ends_with(own)).unwrap_or_default()
}

/// A key without the unit at its end, if it has one.
#[must_use]
pub fn without_unit(key: &str) -> Option<&str> {
    let units = OTHER_UNITS.iter().map(|(other, ..)| *other).chain(OWN_UNITS);
    units.filter_map(|unit| key.strip_suffix(unit)).min_by_key(|bare| bare.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_unit_has_its_conversion() {
        assert_eq!(other_unit("length_mm", "length_m"), " 1 mm is 0.001 m");
        assert_eq!(other_unit("length", "length_m"), "");
        assert_eq!(other_unit("lenght_m", "length_m"), "");
        assert_eq!(other_unit("brushing_velocity_m_min", "brushing_velocity_m_s"), " 1 m/min is 0.01667 m/s");
    }
}
