//! Explanation of a key of the input file, from the table of settings and the JSON schema.

use crate::text::shown;
use bristle::model::parameters::{Parameter, Usual};
use serde_json::Value;
use thiserror::Error;

use crate::input::document::setting_meant;
use crate::input::friction::{FRICTION, REMEDY, TOPIC, friction_advice, pairing_list};
use crate::input::input_error::LONGEST_KEY;
use crate::input::keys::SECTIONS;
use crate::input::materials::material_list;
use crate::input::schema::{file_schema, is_stated_elsewhere};
use crate::input::units::other_paths;
use crate::text::layout::{left, wrap};
use crate::text::number::short;

/// Room for the paths of all keys, in columns.
const LONGEST_PATH: usize = 40;
const MATERIAL: &str = "filament.material";

/// A key that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no key `{key}`{}", help(.hint))]
pub struct UnknownKey {
    key: String,
    hint: String,
}

fn help(hint: &str) -> String {
    let hint = if hint.is_empty() {
        "`bristle explain` lists all keys"
    } else {
        hint
    };
    format!("\n   = help: {hint}")
}

/// Lists the keys of all sections with their names, in lines of at most `width` columns.
#[must_use]
pub fn all_keys(width: usize) -> String {
    let schema = file_schema();
    sections(&schema)
        .iter()
        .map(|section| keys_of(&schema, section, width))
        .collect()
}

/// Explains a key: its description, unit, range, default and the source of the default. `key` is a
/// path, the last part of one, either of them in another unit, or a section, whose keys are then
/// listed; [`TOPIC`] gives advice. Lines have at most `width` columns.
///
/// # Errors
/// If there is no such key.
pub fn explain(key: &str, width: usize) -> Result<String, UnknownKey> {
    let key = key.trim();
    if key == TOPIC {
        return Ok(friction_advice(width));
    }
    let schema = file_schema();
    if let Some(section) = sections(&schema).iter().find(|section| *section == key) {
        let meaning = schema["properties"][section]["description"]
            .as_str()
            .unwrap_or_default();
        let mut text = String::new();
        wrap(
            width,
            &mut text,
            "",
            &format!("[{section}]: {}", one_line(meaning)),
        );
        return Ok(text + &keys_of(&schema, section, width));
    }
    let is_named =
        |path: &str| path == key || path.split_once('.').is_some_and(|(_, last)| last == key);
    let in_unit = |path: &String| {
        let (other, unit) = other_paths(path).find(|(other, _)| is_named(other))?;
        Some(format!(
            "{other}: {path} in {}\n\n{}",
            unit.name(),
            entry(&schema, path, width)
        ))
    };
    let explained = |path: &String| {
        is_named(path)
            .then(|| entry(&schema, path, width))
            .or_else(|| in_unit(path))
    };
    let found: Vec<String> = paths(&schema).iter().filter_map(explained).collect();
    if found.is_empty() {
        return Err(UnknownKey {
            key: shown(key, LONGEST_KEY),
            hint: setting_meant(key),
        });
    }
    Ok(found.join("\n"))
}

fn sections(schema: &Value) -> Vec<String> {
    schema["properties"]
        .as_object()
        .into_iter()
        .flat_map(|sections| sections.keys().cloned())
        .collect()
}

/// Returns the paths of all keys, except those of the sweeps, which are paths themselves.
fn paths(schema: &Value) -> Vec<String> {
    let keys = |section: &String| {
        let keys = schema["properties"][section]["properties"].as_object();
        let keys = keys
            .into_iter()
            .flat_map(|keys| keys.keys())
            .filter(|key| !is_stated_elsewhere(section, key));
        keys.map(|key| format!("{section}.{key}"))
            .collect::<Vec<_>>()
    };
    sections(schema).iter().flat_map(keys).collect()
}

/// Lists the keys of a section with their names.
fn keys_of(schema: &Value, section: &str, width: usize) -> String {
    let beginning = format!("{section}.");
    let mut text = String::new();
    for path in paths(schema)
        .into_iter()
        .filter(|path| path.starts_with(&beginning))
    {
        let name = Parameter::find(&path).map_or_else(
            || {
                let meaning = one_line(description(schema, &path));
                in_a_sentence(first_clause(&meaning))
            },
            |parameter| parameter.name.to_owned(),
        );
        wrap(
            width,
            &mut text,
            &format!("  {} ", left(&path, LONGEST_PATH)),
            &name,
        );
    }
    text
}

fn property<'s>(schema: &'s Value, path: &str) -> &'s Value {
    let (section, key) = path.split_once('.').unwrap_or((path, ""));
    &schema["properties"][section]["properties"][key]
}

fn description<'s>(schema: &'s Value, path: &str) -> &'s str {
    property(schema, path)["description"]
        .as_str()
        .unwrap_or_default()
}

/// Returns a text up to its first mark outside of brackets.
fn first_clause(text: &str) -> &str {
    let mut depth = 0_usize;
    let end = text.find(|letter| {
        match letter {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth == 0 && ['.', ':', ';', ','].contains(&letter)
    });
    &text[..end.unwrap_or(text.len())]
}

/// Returns a clause as it stands within a sentence: the first letter is small, unless the word is
/// an abbreviation.
fn in_a_sentence(clause: &str) -> String {
    let mut letters = clause.chars();
    match (letters.next(), letters.next()) {
        (Some(first), Some(second)) if first.is_uppercase() && second.is_lowercase() => {
            first.to_lowercase().chain(clause.chars().skip(1)).collect()
        }
        _ => clause.to_owned(),
    }
}

/// Returns a text of a doc comment without its line breaks and marks of code.
fn one_line(text: &str) -> String {
    text.replace('`', "")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// Returns all that is known about a key.
fn entry(schema: &Value, path: &str, width: usize) -> String {
    let property = property(schema, path);
    let parameter = Parameter::find(path);
    let mut text = format!("{path}\n");
    let mut tell = |what: &str, words: &str| {
        if !words.is_empty() {
            wrap(width, &mut text, &format!("  {what:9}"), words);
        }
    };
    tell("meaning", &one_line(description(schema, path)));
    let others: Vec<String> = other_paths(path).map(|(other, _)| other).collect();
    tell("also", &others.join(", "));
    let Some(parameter) = parameter else {
        let words: Vec<String> = property["enum"]
            .as_array()
            .into_iter()
            .flatten()
            .map(Value::to_string)
            .collect();
        let kinds = property["oneOf"]
            .as_array()
            .into_iter()
            .flatten()
            .map(|kind| kind["const"].to_string());
        tell(
            "one of",
            &words
                .into_iter()
                .chain(kinds)
                .collect::<Vec<_>>()
                .join(", "),
        );
        tell("default", &default_of(property, None));
        if path == MATERIAL {
            text.push_str(&format!(
                "  materials, each with the sources of its values:\n{}",
                material_list(width)
            ));
        }
        return text;
    };
    tell("symbol", parameter.symbol);
    tell(
        "unit",
        if parameter.unit.is_empty() {
            "none"
        } else {
            parameter.unit
        },
    );
    tell("range", &parameter.allowed());
    if let Some(Usual {
        least,
        largest,
        slip,
    }) = parameter.usual
    {
        let usual = format!("from {} to {}", short(least), short(largest));
        tell(
            "usual",
            &format!("{usual}; other values draw a warning of a likely slip: {slip}"),
        );
    }
    tell("default", &default_of(property, Some(parameter)));
    tell("source", parameter.source);
    let others = |section: &str| parameter.section() == section;
    if !others("solver") && !others("uncertainty") {
        tell("sweep", &format!("\"{path}\" = [ … ] under [study]"));
    }
    if SECTIONS.iter().any(|section| others(section)) {
        tell(
            "tools",
            &format!("{path} = … under [study.tools.NAME], for one of several tools"),
        );
    }
    if path == FRICTION {
        text.push_str(&format!(
            "  abrasive filaments on:\n{}",
            pairing_list(width)
        ));
        wrap(width, &mut text, "  ", REMEDY);
    }
    text
}

/// Describes the default of a key.
fn default_of(property: &Value, parameter: Option<&Parameter>) -> String {
    if let Some(parameter) = parameter {
        let twins: Vec<&str> = parameter
            .group()
            .map(|same| same.path)
            .filter(|path| *path != parameter.path)
            .collect();
        if !twins.is_empty() {
            return format!("none; give this one or {}", twins.join(" or "));
        }
        if parameter.required {
            return "none; it must be given".to_owned();
        }
        if !parameter.default.is_empty() {
            return parameter.default.to_owned();
        }
    }
    match &property["default"] {
        Value::Null => "none".to_owned(),
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), short),
        value => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use bristle::model::parameters::PARAMETERS;

    use super::*;
    use crate::text::layout::WIDTH;

    #[test]
    fn every_setting_has_a_meaning_a_range_and_a_default() {
        for parameter in PARAMETERS {
            let text = explain(parameter.path, WIDTH).expect(parameter.path);
            for part in ["meaning", "unit", "range", "default"] {
                assert!(
                    text.contains(&format!("\n  {part}")),
                    "{}: no {part} in\n{text}",
                    parameter.path
                );
            }
            assert!(
                text.lines().all(|line| line.chars().count() <= WIDTH),
                "{text}"
            );
        }
        let all = all_keys(WIDTH);
        assert!(
            PARAMETERS
                .iter()
                .all(|parameter| all.contains(parameter.path)),
            "{all}"
        );
    }

    #[test]
    fn keys_are_found_by_their_last_part_and_by_section() {
        assert_eq!(
            explain("filament.length_m", WIDTH),
            explain("length_m", WIDTH)
        );
        // Bounds of Reuss and Voigt: 1/(0.1804/430 + 0.8196/3.31) and 0.1804·430 + 0.8196·3.31.
        let row = "PA6.12 + 40 % SiC        18.0 %        1448      4.87   4.03   80.3";
        let friction = [
            "contact.friction_coefficient\n",
            "\n  ceramic   wet  0.05 to 0.4  a guess",
        ];
        let also = "also     filament.length_mm, filament.length_cm, filament.length_um\n";
        for (key, beginning, parts) in [
            (
                "friction_coefficient",
                "brush.friction_coefficient\n",
                &friction[..],
            ),
            (
                "youngs_modulus_pa",
                "",
                &["default  3e9", "source   chosen"],
            ),
            ("workpiece.kind", "", &["\"edge\"", "default  \"plane\""]),
            (
                "filament.material",
                "",
                &["\n  PA6.12 ", "Ultramid A3K", row],
            ),
            (
                "length_mm",
                "filament.length_mm: filament.length_m in mm\n\nfilament.length_m\n",
                &[also],
            ),
            ("filament", "[filament]: ", &["  filament.diameter_m "]),
        ] {
            let text = explain(key, WIDTH).expect(key);
            assert!(
                text.starts_with(beginning) && parts.iter().all(|part| text.contains(part)),
                "{text}"
            );
            assert!(
                text.lines().all(|line| line.chars().count() <= WIDTH),
                "{text}"
            );
        }
        assert_eq!(
            explain("friction_coefficient", WIDTH)
                .expect("two keys")
                .matches("[measured]")
                .count(),
            1
        );
        let advice = explain("friction", WIDTH).expect("a topic");
        let parts = [
            "may have 0.05 to 0.7:",
            "\n  ceramic   wet  0.05 to 0.4  a guess",
            "[measured]",
        ];
        assert!(
            parts.iter().all(|part| advice.contains(part))
                && advice.lines().all(|line| line.chars().count() <= WIDTH),
            "{advice}"
        );
        let unknown = explain("rpm", WIDTH).expect_err("no key").to_string();
        assert!(
            unknown.contains("did you mean `process.rotational_speed_rpm`?"),
            "{unknown}"
        );
        assert!(
            explain("nonsense", WIDTH)
                .expect_err("no key")
                .to_string()
                .contains("lists all keys")
        );
    }
}
