//! Keys with another unit than that of their setting: `length_mm` states `length_m`.
//!
//! One rule applies to the keys of all settings that have a unit, wherever they stand: in files,
//! options and sweeps, for named tools and from Python. [`crate::text::units`] has the units.

use crate::grid::SHORT_NAMES;
use crate::text::units::{NamedUnit, own_keys, units_of};
use bristle::model::parameters::Parameter;

use crate::input::keys::{CONTROL_POINTS, STUDY};

/// Returns the setting that a dotted path states, and the unit of the path; no unit for a ratio or
/// a count.
#[must_use]
pub fn setting(path: &str) -> Option<(&'static Parameter, Option<&'static NamedUnit>)> {
    let other =
        || own_path(path).and_then(|(own, unit)| Some((Parameter::find(&own)?, Some(unit))));
    Parameter::find(path)
        .map(|parameter| (parameter, units_of(path).next()))
        .or_else(other)
}

/// Returns the key by which a section states in the unit of the setting what `key` states in
/// another unit, and this other unit. `None` if there is no such key, or no other unit. The keys of
/// `[study]` are short names and paths of settings.
#[must_use]
pub fn own_key(section: &str, key: &str) -> Option<(String, &'static NamedUnit)> {
    if section == STUDY {
        let is_short = |own: &str| SHORT_NAMES.iter().any(|(short, _)| *short == own);
        return own_path(key)
            .or_else(|| own_keys(key).find(|(own, unit)| !unit.is_own() && is_short(own)));
    }
    let (path, unit) = own_path(&format!("{section}.{key}"))?;
    Some((path[section.len() + 1..].to_owned(), unit))
}

/// Returns the path of the setting that a path states in another unit, and that unit.
pub(crate) fn own_path(path: &str) -> Option<(String, &'static NamedUnit)> {
    own_keys(path).find(|(own, unit)| !unit.is_own() && has_units(own))
}

/// Returns the other paths that state the setting at a path, each in a unit.
pub(crate) fn other_paths(own: &str) -> impl Iterator<Item = (String, &'static NamedUnit)> {
    let others = units_of(own).filter(|unit| !unit.is_own() && has_units(own));
    others.filter_map(|unit| Some((unit.key_of(own)?, unit)))
}

/// Returns `true` if the end of a path states the unit of its setting. The unit of a contact
/// stiffness depends on its exponent instead.
fn has_units(own: &str) -> bool {
    let unit = units_of(own).next().map(NamedUnit::name);
    own == CONTROL_POINTS
        || Parameter::find(own).is_some_and(|parameter| unit == Some(parameter.unit))
}

#[cfg(test)]
mod tests {
    use bristle::model::parameters::PARAMETERS;

    use super::*;

    #[test]
    fn every_setting_with_a_unit_has_its_unit_in_the_table() {
        for parameter in PARAMETERS {
            let unit = setting(parameter.path)
                .and_then(|(_, unit)| unit)
                .map_or("", NamedUnit::name);
            assert_eq!(
                unit,
                if parameter.unit == "N/m^p" {
                    "N/m"
                } else {
                    parameter.unit
                },
                "{}",
                parameter.path
            );
            for (path, unit) in other_paths(parameter.path) {
                let (found, of_path) = setting(&path).expect(&path);
                assert!(
                    std::ptr::eq(found, parameter) && of_path == Some(unit),
                    "{path}"
                );
            }
        }
        let others = |path| other_paths(path).map(|(path, _)| path).collect::<Vec<_>>();
        assert_eq!(
            others("filament.length_m"),
            [
                "filament.length_mm",
                "filament.length_cm",
                "filament.length_um"
            ]
        );
        assert!(
            others("contact.stiffness_n_m").is_empty() && others("process.gravity_m_s2").is_empty()
        );
        assert_eq!(others(CONTROL_POINTS).len(), 3);
        let own = |section, key| own_key(section, key).map(|(key, unit)| (key, unit.name()));
        assert_eq!(
            own("study", "penetration_depth_mm"),
            Some(("penetration_depth_m".to_owned(), "mm"))
        );
        assert_eq!(
            own("study", "filament.length_mm"),
            Some(("filament.length_m".to_owned(), "mm"))
        );
        for (section, key) in [
            ("filament", "length_m"),
            ("tool", "length_mm"),
            ("filament", "length_km"),
            ("study", "length_mm"),
        ] {
            assert_eq!(own(section, key), None, "{key}");
        }
    }
}
