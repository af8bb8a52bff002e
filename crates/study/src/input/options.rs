//! Options of a call, `KEY=VALUE`, that state a setting as if the input file did.

use std::borrow::Cow;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Error};

use crate::text::units::NamedUnit;
use bristle::model::parameters::Parameter;

use crate::input::keys::{STUDY, TOOLS};
use crate::input::units::{own_key, own_path};

/// The parts of an option, with their places in it.
pub(crate) struct Assignment<'t> {
    pub section: &'t str,
    /// Key as it was written.
    pub written: &'t str,
    /// Key in the unit of the setting.
    pub key: Cow<'t, str>,
    /// Unit as it was written, if it is not that of the setting.
    pub unit: Option<&'static NamedUnit>,
    /// Place of the whole key.
    pub key_span: Range<usize>,
    pub value: &'t str,
    pub value_span: Range<usize>,
}

impl<'t> Assignment<'t> {
    /// Takes an option apart. `None` without an equals sign; without a dot in the key, the section
    /// is empty.
    pub fn of(option: &'t str) -> Option<Self> {
        let (path, value) = option.split_once('=')?;
        let value_start = path.len() + 1;
        let (section, key) = path.trim().split_once('.').unwrap_or(("", path.trim()));
        // The path of a sweep may have quotes, as in a file.
        let written = if section == STUDY {
            key.trim_matches('"')
        } else {
            key
        };
        let own = match tool_in(section, written) {
            Some([_, path]) => own_path(path).map(|(own, unit)| {
                (
                    format!("{}{own}", &written[..written.len() - path.len()]),
                    unit,
                )
            }),
            None => own_key(section, written),
        };
        let (key, unit) = own.map_or((Cow::Borrowed(written), None), |(own, unit)| {
            (Cow::Owned(own), Some(unit))
        });
        Some(Self {
            section,
            written,
            key,
            unit,
            key_span: 0..path.len(),
            value,
            value_span: value_start..option.len(),
        })
    }

    /// Returns the path that the option states, in the unit of the setting.
    pub fn path(&self) -> String {
        format!("{}.{}", self.section, self.key)
    }

    /// Returns the path as it was written.
    pub fn written_path(&self) -> String {
        format!("{}.{}", self.section, self.written)
    }

    /// Returns `true` if the option has a key and a value.
    pub fn is_whole(&self) -> bool {
        !self.key.is_empty() && !self.value.trim().is_empty()
    }

    /// Returns the name of a tool and the path of its setting, if the key is
    /// `tools.NAME.SECTION.KEY` of a study.
    pub fn tool(&self) -> Option<[&str; 2]> {
        tool_in(self.section, &self.key)
    }

    /// Parses the value as TOML. A word needs no quotes.
    ///
    /// # Errors
    /// If it is not TOML.
    pub fn parsed(&self) -> Result<DeValue<'t>, Error> {
        let value = self.value.trim();
        let is_word = value
            .starts_with(|first: char| first.is_alphabetic() || "/_".contains(first))
            && value
                .chars()
                .all(|letter| letter.is_alphanumeric() || "._-/".contains(letter));
        let is_constant = ["true", "false", "inf", "nan"].contains(&value);
        match DeValue::parse(value) {
            Ok(value) => Ok(value.into_inner()),
            Err(_) if is_word && !is_constant => Ok(DeValue::String(Cow::Borrowed(value))),
            Err(error) => Err(error),
        }
    }
}

/// Returns the name of a tool and the path of its setting, if a key of a section is that of a named
/// tool.
fn tool_in<'k>(section: &str, key: &'k str) -> Option<[&'k str; 2]> {
    let rest = key
        .strip_prefix(TOOLS)?
        .strip_prefix('.')
        .filter(|_| section == STUDY)?;
    let (name, path) = match rest.strip_prefix('"') {
        Some(quoted) => quoted.split_once("\".")?,
        None => rest.split_once('.')?,
    };
    Some([name, path])
}

/// Returns the entries of a section of the tree, which is added at a place if there is none; `None`
/// if the tree has a value instead.
pub(crate) fn section_in<'a, 't>(
    table: &'a mut DeTable<'t>,
    name: &str,
    span: &Range<usize>,
) -> Option<&'a mut DeTable<'t>> {
    let entry = Spanned::new(span.clone(), Cow::Owned(name.to_owned()));
    let new = || Spanned::new(span.clone(), DeValue::Table(DeTable::new()));
    match table.entry(entry).or_insert_with(new).get_mut() {
        DeValue::Table(entries) => Some(entries),
        _ => None,
    }
}

/// States a value in the tree, at the place of the option. Other keys of the tree that state the
/// same are removed.
pub(crate) fn state<'t>(
    table: &mut DeTable<'t>,
    [section, key]: [&str; 2],
    value: DeValue<'t>,
    [key_span, value_span]: [Range<usize>; 2],
) {
    let Some(entries) = section_in(table, section, &key_span) else {
        return;
    };
    let path = format!("{section}.{key}");
    if let Some(parameter) = Parameter::find(&path) {
        parameter
            .group()
            .for_each(|same| drop(entries.remove(same.key())));
    }
    // A key of a table in the section, such as `measured.columns.force_n`.
    let (entries, key) = match key.split_once('.') {
        Some((inner, key)) if section != STUDY => {
            let Some(entries) = section_in(entries, inner, &key_span) else {
                return;
            };
            (entries, key)
        }
        _ => (entries, key),
    };
    // The entry is removed first: an insertion alone would keep the old key's place.
    entries.remove(key);
    let key = Spanned::new(key_span, Cow::Owned(key.to_owned()));
    entries.insert(
        key,
        Spanned::new(value_span.clone(), at(value, &value_span)),
    );
}

/// States a setting of a named tool as [`state`] does, below the keys `parents` of the tree.
pub(crate) fn state_of_tool<'t>(
    table: &mut DeTable<'t>,
    parents: [&str; 2],
    [name, path]: [&str; 2],
    value: DeValue<'t>,
    spans: [Range<usize>; 2],
) {
    let mut tool = table;
    for key in [parents[0], parents[1], name] {
        let Some(entries) = section_in(tool, key, &spans[0]) else {
            return;
        };
        tool = entries;
    }
    // Settings with their paths in quotes.
    let group = Parameter::find(path).into_iter().flat_map(Parameter::group);
    group.for_each(|same| drop(tool.remove(same.path)));
    match path.split_once('.') {
        Some((section, key)) => state(tool, [section, key], value, spans),
        None => {
            let [key_span, value_span] = spans;
            let value = Spanned::new(value_span.clone(), at(value, &value_span));
            tool.insert(Spanned::new(key_span, Cow::Owned(path.to_owned())), value);
        }
    }
}

/// Returns a value all of whose parts are at one place.
fn at<'t>(value: DeValue<'t>, span: &Range<usize>) -> DeValue<'t> {
    let moved =
        |part: &Spanned<DeValue<'t>>| Spanned::new(span.clone(), at(part.get_ref().clone(), span));
    match value {
        DeValue::Array(items) => {
            let mut array = DeArray::new();
            items.iter().for_each(|item| array.push(moved(item)));
            DeValue::Array(array)
        }
        DeValue::Table(entries) => {
            let entry = |(key, value): (&Spanned<Cow<'t, str>>, &Spanned<DeValue<'t>>)| {
                (
                    Spanned::new(span.clone(), key.get_ref().clone()),
                    moved(value),
                )
            };
            DeValue::Table(entries.iter().map(entry).collect())
        }
        other => other,
    }
}
