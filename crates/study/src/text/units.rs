//! Units as people write them: at the ends of keys, behind numbers, and in headings.
//!
//! One table has them all. Each unit converts to the unit that settings of its quantity have.
//! Powers of ten shift decimal digits: 40 mm are the same double as 0.04 m.

use std::f64::consts::PI;

/// A unit of a quantity.
#[derive(Debug, PartialEq)]
pub struct NamedUnit {
    /// End of a key in this unit.
    pub suffix: &'static str,
    /// Spellings behind a number or in a heading; messages use the first.
    pub names: &'static [&'static str],
    /// End of the keys of settings that have this quantity.
    pub own: &'static str,
    conversion: Conversion,
}

/// Conversion of a number in a unit to one in the unit of the settings.
#[derive(Debug, PartialEq)]
enum Conversion {
    /// Power of ten.
    Ten(i32),
    /// Factor and divisor.
    Ratio(f64, f64),
}

use Conversion::{Ratio, Ten};

/// All units. The first unit of each quantity is that of the settings.
pub static UNITS: [NamedUnit; 37] = [
    unit("_m", &["m"], "_m", Ten(0)),
    unit("_mm", &["mm"], "_m", Ten(-3)),
    unit("_cm", &["cm"], "_m", Ten(-2)),
    // Two letters look like µ.
    unit("_um", &["\u{b5}m", "\u{3bc}m", "um"], "_m", Ten(-6)),
    unit("_rad", &["rad"], "_rad", Ten(0)),
    unit("_deg", &["°", "deg"], "_rad", Ratio(PI / 180.0, 1.0)),
    unit("_mrad", &["mrad"], "_rad", Ten(-3)),
    unit("_pa", &["Pa"], "_pa", Ten(0)),
    unit("_gpa", &["GPa"], "_pa", Ten(9)),
    unit("_mpa", &["MPa"], "_pa", Ten(6)),
    unit("_n_mm2", &["N/mm²", "N/mm2"], "_pa", Ten(6)),
    unit("_m_s", &["m/s"], "_m_s", Ten(0)),
    unit("_mm_s", &["mm/s"], "_m_s", Ten(-3)),
    unit("_m_min", &["m/min"], "_m_s", Ratio(1.0, 60.0)),
    unit("_mm_min", &["mm/min"], "_m_s", Ratio(1.0, 60e3)),
    unit("_km_h", &["km/h"], "_m_s", Ratio(1.0, 3.6)),
    unit(
        "_rpm",
        &["rpm", "1/min", "min-1", "min^-1", "min⁻¹", "r/min", "U/min"],
        "_rpm",
        Ten(0),
    ),
    unit("_hz", &["Hz", "1/s"], "_rpm", Ratio(60.0, 1.0)),
    unit("_rad_s", &["rad/s"], "_rpm", Ratio(30.0, PI)),
    unit("_kg_m3", &["kg/m³", "kg/m3"], "_kg_m3", Ten(0)),
    unit("_g_cm3", &["g/cm³", "g/cm3"], "_kg_m3", Ten(3)),
    unit("_per_m2", &["1/m²", "1/m2"], "_per_m2", Ten(0)),
    unit("_per_cm2", &["1/cm²", "1/cm2"], "_per_m2", Ten(4)),
    unit("_per_mm2", &["1/mm²", "1/mm2"], "_per_m2", Ten(6)),
    unit("_n_m", &["N/m"], "_n_m", Ten(0)),
    unit("_n_mm", &["N/mm"], "_n_m", Ten(3)),
    unit("_n_m2", &["N/m²", "N/m2"], "_n_m2", Ten(0)),
    unit("_n_mm2", &["N/mm²", "N/mm2"], "_n_m2", Ten(6)),
    unit("_s_m", &["s/m"], "_s_m", Ten(0)),
    unit("_m2_n", &["m²/N", "m2/N"], "_m2_n", Ten(0)),
    unit(
        "_mm3_n_m",
        &["mm³/(N m)", "mm3/(N m)", "mm³/Nm", "mm3/Nm"],
        "_m2_n",
        Ten(-9),
    ),
    unit("_n", &["N"], "_n", Ten(0)),
    unit("_kn", &["kN"], "_n", Ten(3)),
    unit("_mn", &["mN"], "_n", Ten(-3)),
    unit("_w", &["W"], "_w", Ten(0)),
    unit("_kw", &["kW"], "_w", Ten(3)),
    // For keys without a unit.
    unit("", &["%"], "", Ten(-2)),
];

/// Units of a torque, whose keys end like those of a stiffness. The first is that of the key.
pub static TORQUES: [NamedUnit; 3] = [
    unit("_n_m", &["N m", "Nm", "N·m"], "_n_m", Ten(0)),
    unit("_n_cm", &["N cm", "Ncm", "N·cm"], "_n_m", Ten(-2)),
    unit("_n_mm", &["N mm", "Nmm", "N·mm"], "_n_m", Ten(-3)),
];

/// Units of a time. [`UNITS`] has none, because the end of `_m_min` is not that of a time. The
/// first is that of the key.
pub static TIMES: [NamedUnit; 3] = [
    unit("_s", &["s", "sec"], "_s", Ten(0)),
    unit("_min", &["min"], "_s", Ratio(60.0, 1.0)),
    unit("_h", &["h"], "_s", Ratio(3600.0, 1.0)),
];

/// Unit of a number of turns.
pub static TURNS: [NamedUnit; 1] = [unit("", &["1"], "", Ten(0))];

const fn unit(
    suffix: &'static str,
    names: &'static [&'static str],
    own: &'static str,
    conversion: Conversion,
) -> NamedUnit {
    NamedUnit {
        suffix,
        names,
        own,
        conversion,
    }
}

impl NamedUnit {
    /// Returns the spelling in messages.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.names[0]
    }

    /// Returns the spelling of the settings' unit in messages.
    #[must_use]
    pub fn own_name(&self) -> &'static str {
        UNITS
            .iter()
            .find(|unit| unit.suffix == self.own)
            .map_or("", Self::name)
    }

    /// Returns `true` if it is the unit of the settings.
    #[must_use]
    pub fn is_own(&self) -> bool {
        self.conversion == Ten(0)
    }

    /// Converts a number in this unit to the unit of the settings.
    #[must_use]
    pub fn to_own(&self, number: f64) -> f64 {
        match self.conversion {
            Ten(power) => shifted(number, power),
            Ratio(factor, divisor) => without_last_bit(number * factor / divisor),
        }
    }

    /// Converts a number in the unit of the settings to this unit.
    #[must_use]
    pub fn of_own(&self, number: f64) -> f64 {
        match self.conversion {
            Ten(power) => shifted(number, -power),
            Ratio(factor, divisor) => without_last_bit(number * divisor / factor),
        }
    }

    /// Returns the key that states in this unit what `own` states in that of the settings, if `own`
    /// has this quantity.
    #[must_use]
    pub fn key_of(&self, own: &str) -> Option<String> {
        let is_time = self.own == TIMES[0].own && own.ends_with(self.own);
        (is_time || own_suffix(own) == self.own)
            .then(|| format!("{}{}", &own[..own.len() - self.own.len()], self.suffix))
    }
}

/// Multiplies a number by a power of ten, as if its decimal point moved.
fn shifted(number: f64, power: i32) -> f64 {
    if power == 0 || !number.is_finite() {
        return number;
    }
    let text = format!("{number:e}");
    let moved = text.split_once('e').and_then(|(digits, exponent)| {
        let exponent: i32 = exponent.parse().ok()?;
        format!("{digits}e{}", exponent + power).parse().ok()
    });
    moved.expect("a finite number has digits and an exponent")
}

/// Returns the number of 12 digits that equals a quotient except for rounding, or else the
/// quotient.
fn without_last_bit(quotient: f64) -> f64 {
    let short = format!("{quotient:.11e}").parse().unwrap_or(quotient);
    if (short - quotient).abs() <= f64::EPSILON * quotient.abs() {
        short
    } else {
        quotient
    }
}

/// Returns the end of a key that is its unit in the settings; empty if it has none.
fn own_suffix(key: &str) -> &'static str {
    longest(key, UNITS.iter().map(|unit| unit.own))
}

/// Returns the longest suffix that a text has; empty if none.
fn longest(text: &str, suffixes: impl Iterator<Item = &'static str>) -> &'static str {
    suffixes
        .filter(|suffix| text.ends_with(suffix))
        .max_by_key(|suffix| suffix.len())
        .unwrap_or_default()
}

/// Returns the units that the end of a key states: several if keys of several quantities end so.
fn units_at_end(key: &str) -> impl Iterator<Item = &'static NamedUnit> {
    let suffix = longest(key, UNITS.iter().map(|unit| unit.suffix));
    UNITS.iter().filter(move |unit| unit.suffix == suffix)
}

/// Returns the keys of settings that a key may state, itself included, each with the key's unit.
pub fn own_keys(key: &str) -> impl Iterator<Item = (String, &'static NamedUnit)> {
    let own_key =
        |unit: &NamedUnit| format!("{}{}", &key[..key.len() - unit.suffix.len()], unit.own);
    units_at_end(key)
        .map(move |unit| (own_key(unit), unit))
        .filter(|(own, unit)| own_suffix(own) == unit.own)
}

/// Returns the units in which a key of a setting can be stated, that of the setting first; none if
/// it has no unit.
pub fn units_of(own: &str) -> impl Iterator<Item = &'static NamedUnit> {
    let suffix = own_suffix(own);
    UNITS
        .iter()
        .filter(move |unit| !suffix.is_empty() && unit.own == suffix)
}

/// Converts a number with a unit as written behind it to the unit that the end of a key states.
/// `None` if the unit does not suit the key.
#[must_use]
pub fn in_unit_of(key: &str, number: f64, written: &str) -> Option<f64> {
    units_at_end(key).find_map(|of_key| {
        let unit = UNITS
            .iter()
            .find(|unit| unit.own == of_key.own && unit.names.contains(&written))?;
        // A ratio has no unit of its own.
        Some(if of_key.own.is_empty() {
            unit.to_own(number)
        } else {
            of_key.of_own(unit.to_own(number))
        })
    })
}

/// Returns a key without the unit at its end, if it has one.
#[must_use]
pub fn without_unit(key: &str) -> Option<&str> {
    let suffix = longest(key, UNITS.iter().map(|unit| unit.suffix));
    key.strip_suffix(suffix).filter(|_| !suffix.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the unit at the end of a key of a setting with this end.
    fn at_end(key: &str, own: &str) -> &'static NamedUnit {
        units_at_end(key).find(|unit| unit.own == own).expect(key)
    }

    #[test]
    fn numbers_are_those_that_people_write_in_si() {
        let cases = [
            ("length_mm", "length_m", 40.0, 0.04),
            ("diameter_um", "diameter_m", 600.0, 0.6e-3),
            ("diameter_mm", "diameter_m", 1.18, 1.18e-3),
            ("youngs_modulus_gpa", "youngs_modulus_pa", 3.31, 3.31e9),
            ("youngs_modulus_n_mm2", "youngs_modulus_pa", 3310.0, 3.31e9),
            ("stiffness_n_mm2", "stiffness_n_m2", 60.0, 6e7),
            ("density_g_cm3", "density_kg_m3", 1.11, 1110.0),
            ("filaments_per_cm2", "filaments_per_m2", 59.7, 597_000.0),
            (
                "brushing_velocity_m_min",
                "brushing_velocity_m_s",
                600.0,
                10.0,
            ),
            ("feed_velocity_mm_min", "feed_velocity_m_s", 0.6, 1e-5),
            (
                "brushing_velocity_km_h",
                "brushing_velocity_m_s",
                36.0,
                10.0,
            ),
            ("rotational_speed_hz", "rotational_speed_rpm", 20.0, 1200.0),
            (
                "included_angle_deg",
                "included_angle_rad",
                90.0,
                std::f64::consts::FRAC_PI_2,
            ),
            (
                "lateral_tilt_deg",
                "lateral_tilt_rad",
                5.0,
                5.0_f64.to_radians(),
            ),
            ("damping_s_m", "damping_s_m", 0.1, 0.1),
        ];
        for (key, own, number, expected) in cases {
            let (_, unit) = own_keys(key)
                .find(|(of_setting, _)| of_setting == own)
                .expect(key);
            assert_eq!(unit.to_own(number), expected, "{key}");
            assert_eq!(unit.of_own(expected), number, "{key}");
            assert_eq!(unit.key_of(own).as_deref(), Some(key));
        }
        // Every number of four digits, at any place of the decimal point.
        let millimetres = at_end("length_mm", "_m");
        for digits in 1..10_000 {
            for power in -4..=2 {
                let number = |power: i32| {
                    format!("{digits}e{power}")
                        .parse::<f64>()
                        .expect("a number")
                };
                assert_eq!(millimetres.to_own(number(power)), number(power - 3));
            }
        }
        assert!(
            millimetres.to_own(f64::NAN).is_nan()
                && at_end("e_gpa", "_pa").to_own(1e308).is_infinite()
        );
    }

    #[test]
    fn a_key_has_the_unit_of_its_longest_end() {
        assert_eq!(
            own_keys("damping_s_mm").count(),
            0,
            "1 s/mm is not 0.001 s/m"
        );
        assert_eq!(at_end("length_mm", "_m").key_of("damping_s_m"), None);
        assert_eq!(
            units_of("damping_s_m")
                .map(NamedUnit::name)
                .collect::<Vec<_>>(),
            ["s/m"]
        );
        assert_eq!(
            units_of("lateral_tilt_rad")
                .map(|unit| unit.suffix)
                .collect::<Vec<_>>(),
            ["_rad", "_deg", "_mrad"]
        );
        assert_eq!(units_of("segments").count(), 0);
        assert_eq!(
            (without_unit("feed_mm_min"), without_unit("segments")),
            (Some("feed"), None)
        );
        assert_eq!(
            (
                in_unit_of("length_mm", 3.0, "cm"),
                in_unit_of("length_mm", 3.0, "s")
            ),
            (Some(30.0), None)
        );
        assert_eq!(in_unit_of("damping_ratio", 5.0, "%"), Some(0.05));
        assert!(
            UNITS
                .iter()
                .all(|unit| unit.suffix.is_empty() || unit.is_own() == (unit.suffix == unit.own))
        );
    }
}
