//! Errors about keys that are unknown or missing, and about text that is not TOML.

use std::borrow::Cow;

use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::settings::Settings;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::meant::{did_you_mean, is_section, setting_meant};
use super::workpiece::{FEED, KIND};
use super::{Document, MEASURED, stated};
use crate::input::goal::GOAL;
use crate::input::input_error::{InputError, LONGEST_MESSAGE};
use crate::input::keys::{FILAMENT, MATERIAL_KEY, STUDY, WORKPIECE};
use crate::input::mistakes::{Mistake, value_mistake};
use crate::text::{shortened, shown};

/// Section of velocity and depth, which a study may sweep instead.
const PROCESS: &str = "process";

impl Document<'_> {
    /// Checks that a table of the file, which `path` names, has no other keys than these.
    pub(super) fn check_keys(
        &self,
        path: &str,
        entries: &DeTable<'_>,
        keys: &[&str],
    ) -> Result<(), InputError> {
        let unknown = entries
            .iter()
            .find(|(key, _)| !keys.contains(&key.get_ref().as_ref()));
        unknown.map_or(Ok(()), |(key, _)| Err(self.unknown_key(path, key, keys)))
    }

    /// Returns the error about a key of a table, which `path` names, that is none of `keys`.
    pub(super) fn unknown_key(
        &self,
        path: &str,
        key: &Spanned<Cow<'_, str>>,
        keys: &[&str],
    ) -> InputError {
        let name = key.get_ref();
        let expected = keys
            .iter()
            .map(|key| format!("`{key}`"))
            .collect::<Vec<_>>()
            .join(", ");
        let advice = did_you_mean(name, keys.iter().copied());
        self.unknown(&format!("{path}.{name}"), expected, key.span(), &advice)
    }

    /// Returns the error about a top-level entry that is not a section.
    pub(super) fn not_a_section(
        &self,
        name: &Spanned<Cow<'_, str>>,
        value: &Spanned<DeValue<'_>>,
    ) -> InputError {
        let key = name.get_ref().as_ref();
        if is_section(key) || key == STUDY || key == MEASURED || key == GOAL {
            let allowed = format!("a section that starts with a line [{key}]");
            self.not_allowed(key, value, allowed)
        } else {
            let advice = "put it under the heading of its section, such as [filament]";
            let expected = "a section at the top level of the file";
            self.unknown(key, expected, name.span(), advice)
        }
    }

    /// Returns the error about a tree that cannot become settings: an unknown key, a value of the
    /// wrong type, or a missing key.
    pub(super) fn unreadable(&self, table: &DeTable<'_>, error: &toml::de::Error) -> InputError {
        // An error without a place is about the file as a whole.
        let Some(span) = error.span() else {
            return self.error(None, cannot_be_read(error.message()), self.end(), "");
        };
        let unknown = |key: String, advice: String| {
            let message = error.message();
            // The key comes first, and may be anything.
            let expected = message
                .rsplit_once(", expected ")
                .map_or(message, |(_, expected)| expected);
            let section = key.split_once('.').map_or("", |(section, _)| section);
            // Keys that state others in their own way are no fields of the settings.
            let is_other = |parameter: &&Parameter| {
                !parameter.instead_of.is_empty() && parameter.section() == section
            };
            let others = PARAMETERS
                .iter()
                .filter(is_other)
                .map(|parameter| format!("`{}`", parameter.key()))
                .filter(|key| !expected.contains(key))
                .map(|key| format!(", {key}"));
            let material = if section == FILAMENT {
                format!(", `{MATERIAL_KEY}`")
            } else {
                String::new()
            };
            let expected =
                shown(expected, LONGEST_MESSAGE) + &others.collect::<String>() + &material;
            // The keys of a kind of workpiece are those of a structure of their own.
            let expected = match expected.strip_prefix("one of ").unwrap_or(&expected) {
                own if section == WORKPIECE && message.starts_with("unknown field") => {
                    format!("one of `{KIND}`, `{FEED}`, {own}")
                }
                _ => expected,
            };
            self.unknown(&key, expected, span.clone(), &advice)
        };
        for (name, section) in table {
            let name_span = name.span();
            let name = name.get_ref().as_ref();
            if !is_section(name) && name_span == span {
                let sections = PARAMETERS.iter().map(Parameter::section);
                return unknown(name.to_owned(), did_you_mean(name, sections));
            }
            for (key, value) in section.get_ref().as_table().into_iter().flatten() {
                let path = format!("{name}.{}", key.get_ref());
                if key.span() == span {
                    let advice = setting_meant(&path);
                    return unknown(path, advice);
                }
                if value.span().start <= span.start && span.end <= value.span().end {
                    let allowed = Parameter::find(&path)
                        .map_or_else(|| allowed_by(error.message()), Parameter::allowed);
                    let advice = text_mistake(&self.written(&path, &span), value.get_ref());
                    let found = self.source.quote(value.span());
                    return self.refused(&path, found, allowed, span, &advice);
                }
            }
        }
        self.error(None, cannot_be_read(error.message()), span, "")
    }

    /// Returns the error about required keys that are missing: whole sections first, otherwise the
    /// keys of one section. `None` if no key is missing.
    pub(super) fn missing(&self, table: &DeTable<'_>) -> Option<InputError> {
        let missing: Vec<&'static Parameter> = PARAMETERS
            .iter()
            .filter(|parameter| parameter.required && stated(table, parameter).next().is_none())
            .collect();
        let first = *missing.first()?;
        let mut sections: Vec<&'static str> = missing
            .iter()
            .map(|parameter| parameter.section())
            .collect();
        sections.dedup();
        sections.retain(|section| !self.table.contains_key(*section));
        let place = if sections.is_empty() {
            format!("under [{}]", first.section())
        } else {
            "at the end of the file".to_owned()
        };
        let is_named = |section: &str| {
            if sections.is_empty() {
                section == first.section()
            } else {
                sections.contains(&section)
            }
        };
        let named = || {
            missing
                .iter()
                .filter(|parameter| is_named(parameter.section()))
        };
        let mut advice = format!("add {place}, with your values:\n");
        let example = Settings::paper(10.0, 1e-3);
        let mut section = if sections.is_empty() {
            first.section()
        } else {
            ""
        };
        for parameter in named() {
            if parameter.section() != section {
                section = parameter.section();
                advice.push_str(&format!("\n     [{section}]"));
            }
            let line = format!(
                "{} = {}",
                parameter.key(),
                parameter.format(parameter.get(&example))
            );
            let unit = if parameter.unit.is_empty() {
                String::new()
            } else {
                format!(" in {}", parameter.unit)
            };
            advice.push_str(&format!("\n     {line:30}  # {}{unit}", parameter.name));
        }
        for parameter in named() {
            let others: Vec<String> = parameter
                .group()
                .skip(1)
                .map(|other| format!("`{}`", other.key()))
                .collect();
            if !others.is_empty() {
                advice.push_str(&format!(
                    "\n\n     Instead of `{}`: {}.",
                    parameter.key(),
                    others.join(" or ")
                ));
            }
        }
        if named().any(|parameter| parameter.section() == PROCESS) {
            advice.push_str("\n\n     What [study] sweeps may be left out for `bristle study`.");
        }
        let names: Vec<String> = sections
            .iter()
            .map(|section| format!("[{section}]"))
            .collect();
        let problem = match names.split_last() {
            None => {
                let span = self.table[first.section()].span();
                return Some(self.absent(first.path, first.allowed(), span, &advice));
            }
            Some((last, [])) => format!("the section {last} is missing"),
            Some((last, others)) => {
                format!("the sections {} and {last} are missing", others.join(", "))
            }
        };
        Some(self.error(sections.first().copied(), problem, self.end(), &advice))
    }
}

/// Returns the problem of a text that is not TOML, or cannot be interpreted.
pub(super) fn cannot_be_read(message: &str) -> String {
    format!("cannot be read: {}", shown(message, LONGEST_MESSAGE))
}

/// Returns the problem of a `line` that is not TOML, and advice: `message` and `usual` unless the
/// mistake is a usual one.
pub(super) fn not_toml(line: &str, message: &str, usual: &str) -> (String, String) {
    match value_mistake(line) {
        Some(Mistake { what, instead }) => (what, instead),
        None => (cannot_be_read(message), usual.to_owned()),
    }
}

/// Returns advice about a text in the place of a number at a key; empty if there is none.
pub(super) fn text_mistake(key: &str, value: &DeValue<'_>) -> String {
    let text = value.as_str().filter(|text| {
        text.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first))
    });
    text.map_or_else(String::new, |text| {
        let quotes = || match text.parse::<f64>() {
            Ok(_) => format!("write the number without quotes: {}", shortened(text)),
            Err(_) => "write the number without quotes".to_owned(),
        };
        value_mistake(&format!("{key} = {text}")).map_or_else(quotes, |mistake| mistake.instead)
    })
}

/// Returns the values allowed where the parser has refused one that belongs to no scalar setting.
fn allowed_by(message: &str) -> String {
    let kinds = message
        .strip_prefix("unknown variant ")
        .and_then(|message| message.rsplit_once(", expected "));
    kinds.map_or_else(
        || format!("of another type ({})", shown(message, LONGEST_MESSAGE)),
        |(_, kinds)| kinds.to_owned(),
    )
}
