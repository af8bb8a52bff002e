//! Parts of an input file with their places, and errors about these parts as they were written.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;

use crate::text::shown;
use crate::text::units::NamedUnit;
use bristle::model::parameters::Parameter;
use serde_json::{Map, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::located::{LocatedMaterial, LocatedSweep, LocatedTool};
use crate::input::input_error::{InputError, InputSource, LONGEST_KEY};
use crate::input::measured::TableFormat;

/// An input file whose TOML and sweeps have been read.
#[derive(Debug, Default)]
pub struct Document<'t> {
    pub(super) source: InputSource<'t>,
    /// Sections of [`Settings`](bristle::model::settings::Settings).
    pub(super) table: DeTable<'t>,
    /// Place of the heading of `[study]`.
    pub(super) study_span: Range<usize>,
    pub(super) sweeps: Vec<LocatedSweep>,
    pub(super) tools: Vec<LocatedTool<'t>>,
    /// File of measured forces, and its format.
    pub(super) measured: Option<(String, TableFormat)>,
    /// File of a profile's control points, with the place of its path.
    pub(super) control_points_file: Option<(String, Range<usize>)>,
    /// Goal of the study, by the keys of `[goal]`.
    pub(super) goal: Option<Map<String, Value>>,
    /// Control points of this file, once they have been read.
    pub(super) control_points: Vec<[f64; 2]>,
    pub(super) material: Option<LocatedMaterial>,
    /// Keys of the tree that were written in other units than those of their settings, by their
    /// places.
    pub(super) other_units: BTreeMap<usize, OtherUnit>,
    /// `true` if the section of filaments that touch each other is left out.
    pub(super) is_alone: bool,
}

/// A key with another unit than that of its setting. It is found by its place.
#[derive(Debug)]
pub(super) struct OtherUnit {
    /// Key in the unit of the setting, as its table has it, and the one that was written.
    own: String,
    written: String,
    unit: &'static NamedUnit,
    /// End of the value.
    end: usize,
    /// Numbers of the value in the unit of the setting, as TOML, one after the other; `None` for an
    /// entry that is no finite number.
    numbers: Vec<Option<String>>,
}

impl OtherUnit {
    pub(super) fn new(
        own: &str,
        written: &str,
        unit: &'static NamedUnit,
        value: &Spanned<DeValue<'_>>,
    ) -> Self {
        let mut numbers = Vec::new();
        each_number(&mut value.clone(), &mut |number| {
            let finite = read(number).ok().filter(|number: &f64| number.is_finite());
            numbers.push(finite.map(|number| format!("{:?}", unit.to_own(number))));
        });
        Self {
            own: own.to_owned(),
            written: written.to_owned(),
            unit,
            end: value.span().end,
            numbers,
        }
    }

    /// Replaces the numbers that were written by those in the unit of the setting.
    pub(super) fn convert<'a>(&'a self, value: &mut Spanned<DeValue<'a>>) {
        let mut numbers = self.numbers.iter();
        each_number(value, &mut |number| {
            if let Some(text) = numbers.next().and_then(Option::as_deref) {
                *number.get_mut() = number_of(text);
            }
        });
    }

    /// Returns a dotted path that ends with the key of the setting, as it was written.
    fn written(&self, path: &str) -> Option<String> {
        let before = path
            .strip_suffix(&self.own)
            .filter(|before| before.is_empty() || before.ends_with('.'))?;
        Some(format!("{before}{}", self.written))
    }

    /// Formats a value of the setting in the unit that was written.
    fn value(&self, own: &str) -> Option<String> {
        let number = own.parse().ok().filter(|number: &f64| number.is_finite())?;
        let number = self.unit.of_own(number);
        let number = if number.abs() < 1e7 {
            format!("{number}")
        } else {
            format!("{number:e}")
        };
        Some(format!("{number}, which is {own} {}", self.unit.own_name()))
    }
}

/// Visits the numbers of a value, in the order of the text.
fn each_number<'a>(
    value: &mut Spanned<DeValue<'a>>,
    visit: &mut impl FnMut(&mut Spanned<DeValue<'a>>),
) {
    match value.get_mut() {
        DeValue::Integer(_) | DeValue::Float(_) => visit(value),
        DeValue::Array(items) => items.iter_mut().for_each(|item| each_number(item, visit)),
        DeValue::Table(entries) => entries
            .iter_mut()
            .for_each(|(_, entry)| each_number(entry, visit)),
        _ => {}
    }
}

impl Document<'_> {
    pub(super) fn sweeps(&self, parameter: &Parameter) -> bool {
        self.sweeps
            .iter()
            .any(|located| std::ptr::eq(located.parameter, parameter))
    }

    /// Returns the error about a value that is not allowed.
    pub(super) fn not_allowed(
        &self,
        key: &str,
        value: &Spanned<DeValue<'_>>,
        allowed: impl Display,
    ) -> InputError {
        let span = value.span();
        self.refused(key, self.source.quote(span.clone()), allowed, span, "")
    }

    /// Returns the error about a `value` at a place that is not allowed for its key, both as they
    /// were written.
    pub(super) fn refused(
        &self,
        key: &str,
        value: String,
        allowed: impl Display,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        let is_quoted = value == self.source.quote(span.clone());
        let other = self.other_unit_at(&span);
        let in_unit = other.filter(|other| !is_quoted && other.written(key).is_some());
        let value = in_unit
            .and_then(|other| other.value(&value))
            .unwrap_or(value);
        let key = self.written(key, &span);
        self.about(
            &key,
            format_args!("is {value}, but must be {allowed}"),
            span,
            advice,
        )
    }

    /// Returns the error about a key that does not name a setting.
    pub(super) fn unknown(
        &self,
        key: &str,
        expected: impl Display,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        let key = self.written(key, &span);
        let shown = shown(&key, LONGEST_KEY);
        let problem = format!("unknown key `{shown}`: expected {expected}");
        self.error(Some(&key), problem, span, advice)
    }

    /// Returns the error about a required key that is missing.
    pub(super) fn absent(
        &self,
        key: &str,
        allowed: impl Display,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        self.about(
            key,
            format_args!("is missing: it must be {allowed}"),
            span,
            advice,
        )
    }

    /// Returns the error about two keys that state the same.
    pub(super) fn both(
        &self,
        key: &str,
        other: &str,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        let what = format!("and `{}` are both given", shown(other, LONGEST_KEY));
        self.about(key, what, span, advice)
    }

    /// Returns the error about a key without effect, because the study sweeps the setting, or one
    /// that states the same.
    pub(super) fn swept(
        &self,
        key: &str,
        swept: &Parameter,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        let what = format!("has no effect, because the study sweeps `{}`", swept.path);
        self.about(key, what, span, advice)
    }

    /// Returns the error about a key, whose problem follows its name.
    pub(super) fn about(
        &self,
        key: &str,
        what: impl Display,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        let problem = format!("`{}` {what}", shown(key, LONGEST_KEY));
        self.error(Some(key), problem, span, advice)
    }

    pub(super) fn error(
        &self,
        key: Option<&str>,
        problem: String,
        span: Range<usize>,
        advice: &str,
    ) -> InputError {
        InputError {
            key: key.map(str::to_owned),
            problem,
            location: Box::new(self.source.location(span)),
            advice: advice.to_owned(),
        }
    }

    /// Returns the place of something missing: the end of the text.
    pub(super) fn end(&self) -> Range<usize> {
        let end = self.source.text.trim_end().len();
        end..end
    }

    /// Returns the key with another unit at a place.
    fn other_unit_at(&self, span: &Range<usize>) -> Option<&OtherUnit> {
        let (_, other) = self.other_units.range(..=span.start).next_back()?;
        (span.start < other.end).then_some(other)
    }

    /// Returns the path of a setting as it was written at a place.
    pub(super) fn written(&self, path: &str, span: &Range<usize>) -> String {
        self.other_unit_at(span)
            .and_then(|other| other.written(path))
            .unwrap_or_else(|| path.to_owned())
    }
}

/// Returns the value of a number that this program wrote.
pub(super) fn number_of(text: &str) -> DeValue<'_> {
    DeValue::parse(text)
        .expect("a number is a value")
        .into_inner()
}

/// Reads a part of the tree.
pub(super) fn read<T: serde::de::DeserializeOwned>(
    value: &Spanned<DeValue<'_>>,
) -> Result<T, toml::de::Error> {
    T::deserialize(ValueDeserializer::from(value.clone()))
}
