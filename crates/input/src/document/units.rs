//! Keys of the tree in other units than those of their settings become the keys of the settings. Their values follow when they are read.

use std::borrow::Cow;
use std::ops::Range;

use bristle_text::units::Unit;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Document, STUDY, TOOLS, read};
use crate::input_error::{InputError, Problem};
use crate::units::own_key;

/// What to do about two keys for one setting.
pub(super) const ONE_UNIT: &str = "give one of them: both state the same, each in its unit";

/// A key with another unit than that of its setting. It is found by its place.
#[derive(Debug)]
pub(super) struct OtherUnit {
    /// The key in the unit of the setting, as its table has it, and the one that was written.
    own: String,
    written: String,
    unit: &'static Unit,
    /// The end of its value.
    end: usize,
    /// The numbers of the value in the unit of the setting, as TOML, one after the other; `None` for what is no finite number.
    numbers: Vec<Option<String>>,
}

impl OtherUnit {
    pub fn new(own: &str, written: &str, unit: &'static Unit, value: &Spanned<DeValue<'_>>) -> Self {
        let mut numbers = Vec::new();
        each_number(&mut value.clone(), &mut |number| {
            let finite = read(number).ok().filter(|number: &f64| number.is_finite());
            numbers.push(finite.map(|number| format!("{:?}", unit.to_own(number))));
        });
        Self { own: own.to_owned(), written: written.to_owned(), unit, end: value.span().end, numbers }
    }

    /// Puts the numbers in the unit of the setting in the place of those that were written.
    pub fn convert<'a>(&'a self, value: &mut Spanned<DeValue<'a>>) {
        let mut numbers = self.numbers.iter();
        each_number(value, &mut |number| {
            if let Some(text) = numbers.next().and_then(Option::as_deref) {
                *number.get_mut() = DeValue::parse(text).expect("a number is a value").into_inner();
            }
        });
    }

    /// A dotted path that ends with the key of the setting, as it was written.
    fn written(&self, path: &str) -> Option<String> {
        let before = path.strip_suffix(&self.own).filter(|before| before.is_empty() || before.ends_with('.'))?;
        Some(format!("{before}{}", self.written))
    }

    /// A value of the setting as text, in the unit that was written.
    fn value(&self, own: &str) -> Option<String> {
        let number = own.parse().ok().filter(|number: &f64| number.is_finite())?;
        let number = self.unit.of_own(number);
        let number = if number.abs() < 1e7 { format!("{number}") } else { format!("{number:e}") };
        Some(format!("{number}, which is {own} {}", self.unit.own_name()))
    }
}

/// Visits the numbers of a value, in the order of the text.
fn each_number<'a>(value: &mut Spanned<DeValue<'a>>, visit: &mut impl FnMut(&mut Spanned<DeValue<'a>>)) {
    match value.get_mut() {
        DeValue::Integer(_) | DeValue::Float(_) => visit(value),
        DeValue::Array(items) => items.iter_mut().for_each(|item| each_number(item, visit)),
        DeValue::Table(entries) => entries.iter_mut().for_each(|(_, entry)| each_number(entry, visit)),
        _ => {}
    }
}

impl<'t> Document<'t> {
    /// Gives all keys of the tree the units of their settings.
    pub(super) fn take_units(&mut self) -> Result<(), InputError> {
        let mut table = std::mem::take(&mut self.table);
        for (section, entries) in table.iter_mut() {
            let section = section.get_ref().as_ref();
            let DeValue::Table(entries) = entries.get_mut() else { continue };
            self.take_units_of(entries, section, section)?;
            if let Some(DeValue::Table(tools)) = entries.get_mut(TOOLS).map(Spanned::get_mut)
                && section == STUDY
            {
                for (name, tool) in tools.iter_mut() {
                    let DeValue::Table(tool) = tool.get_mut() else { continue };
                    let path = format!("{STUDY}.{TOOLS}.{}", name.get_ref());
                    // Those with their paths in quotes.
                    self.take_units_of(tool, STUDY, &path)?;
                    for (section, entries) in tool.iter_mut() {
                        let section = section.get_ref().as_ref();
                        if let DeValue::Table(entries) = entries.get_mut() {
                            self.take_units_of(entries, section, &format!("{path}.{section}"))?;
                        }
                    }
                }
            }
        }
        self.table = table;
        Ok(())
    }

    /// Gives the keys of a table with those of a `section` the units of their settings. `path` names the table.
    fn take_units_of(&mut self, entries: &mut DeTable<'t>, section: &str, path: &str) -> Result<(), InputError> {
        let other = |key: &Spanned<Cow<'t, str>>| Some((key.clone(), own_key(section, key.get_ref())?));
        let mut others: Vec<_> = entries.keys().filter_map(other).collect();
        others.sort_by_key(|(key, _)| key.span().start);
        for (key, (own, unit)) in others {
            let written = key.get_ref().as_ref();
            let Some(value) = entries.remove(written) else { continue };
            if let Some((same, _)) = entries.get_key_value(own.as_str()) {
                let same_span = same.span();
                let same_path = self.written(&format!("{path}.{own}"), &same_span);
                let own_path = format!("{path}.{written}");
                let is_second = key.span().start > same_span.start;
                let (span, key, other) =
                    if is_second { (key.span(), own_path, same_path) } else { (same_span, same_path, own_path) };
                return Err(self.error(Problem::Both { key, other }, span, ONE_UNIT));
            }
            let start = key.span().start;
            self.other_units.insert(start, OtherUnit::new(&own, written, unit, &value));
            entries.insert(Spanned::new(key.span(), Cow::Owned(own)), value);
        }
        Ok(())
    }

    /// The values of a tree in the units of the settings.
    pub(super) fn convert<'a>(&'a self, table: &mut DeTable<'a>) {
        for (_, section) in table.iter_mut() {
            let DeValue::Table(entries) = section.get_mut() else { continue };
            for (key, value) in entries.iter_mut() {
                if let Some(other) = self.other_units.get(&key.span().start) {
                    other.convert(value);
                }
            }
        }
    }

    /// The key with another unit at a place.
    fn other_unit_at(&self, span: &Range<usize>) -> Option<&OtherUnit> {
        let (_, other) = self.other_units.range(..=span.start).next_back()?;
        (span.start < other.end).then_some(other)
    }

    /// The path of a setting as it was written at a place.
    pub(super) fn written(&self, path: &str, span: &Range<usize>) -> String {
        self.other_unit_at(span).and_then(|other| other.written(path)).unwrap_or_else(|| path.to_owned())
    }

    /// A problem at a place, with the key that was written there.
    pub(super) fn as_written(&self, problem: Problem, span: &Range<usize>) -> Problem {
        let other = self.other_unit_at(span);
        let written = |key: &str| other.and_then(|other| other.written(key));
        match problem {
            Problem::NotAllowed { key, value, allowed } => match (written(&key), other) {
                (Some(key), Some(other)) => {
                    let is_quoted = value == self.source.quote(span.clone());
                    let in_unit = other.value(&value).filter(|_| !is_quoted);
                    Problem::NotAllowed { key, value: in_unit.unwrap_or(value), allowed }
                }
                _ => Problem::NotAllowed { key, value, allowed },
            },
            Problem::UnknownKey { key, expected } => {
                Problem::UnknownKey { key: written(&key).unwrap_or(key), expected }
            }
            Problem::Sweep { key, error } => Problem::Sweep { key: written(&key).unwrap_or(key), error },
            other => other,
        }
    }
}
