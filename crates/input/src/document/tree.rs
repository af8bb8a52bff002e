//! The parts of an input file, with their places, and errors about them as they were written.

use std::collections::BTreeMap;
use std::ops::Range;

use bristle::model::parameters::Parameter;
use bristle_text::units::Unit;
use serde_json::{Map, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::located::{LocatedMaterial, LocatedSweep, LocatedTool};
use crate::input_error::{InputError, Problem, Source};
use crate::measured::Format;

/// An input file whose TOML and sweeps have been read.
#[derive(Debug, Default)]
pub struct Document<'t> {
    pub(super) source: Source<'t>,
    /// The sections of [`Settings`](bristle::model::settings::Settings).
    pub(super) table: DeTable<'t>,
    /// Place of the heading of `[study]`.
    pub(super) study_span: Range<usize>,
    pub(super) sweeps: Vec<LocatedSweep>,
    pub(super) tools: Vec<LocatedTool<'t>>,
    /// The file of measured forces, and how it is written.
    pub(super) measured: Option<(String, Format)>,
    /// The file of a profile's control points, with the place of its path.
    pub(super) control_points_file: Option<(String, Range<usize>)>,
    /// What the study is asked for, by the keys of `[goal]`.
    pub(super) goal: Option<Map<String, Value>>,
    /// The control points in it, once they have been read.
    pub(super) control_points: Vec<[f64; 2]>,
    pub(super) material: Option<LocatedMaterial>,
    /// The keys of the tree that were written in other units than those of their settings, by their
    /// places.
    pub(super) other_units: BTreeMap<usize, OtherUnit>,
    /// Whether the section of filaments that touch each other is left out.
    pub(super) is_alone: bool,
}

/// A key with another unit than that of its setting. It is found by its place.
#[derive(Debug)]
pub(super) struct OtherUnit {
    /// The key in the unit of the setting, as its table has it, and the one that was written.
    own: String,
    written: String,
    unit: &'static Unit,
    /// The end of its value.
    end: usize,
    /// The numbers of the value in the unit of the setting, as TOML, one after the other; `None`
    /// for what is no finite number.
    numbers: Vec<Option<String>>,
}

impl OtherUnit {
    pub(super) fn new(
        own: &str,
        written: &str,
        unit: &'static Unit,
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

    /// Puts the numbers in the unit of the setting in the place of those that were written.
    pub(super) fn convert<'a>(&'a self, value: &mut Spanned<DeValue<'a>>) {
        let mut numbers = self.numbers.iter();
        each_number(value, &mut |number| {
            if let Some(text) = numbers.next().and_then(Option::as_deref) {
                *number.get_mut() = DeValue::parse(text)
                    .expect("a number is a value")
                    .into_inner();
            }
        });
    }

    /// A dotted path that ends with the key of the setting, as it was written.
    fn written(&self, path: &str) -> Option<String> {
        let before = path
            .strip_suffix(&self.own)
            .filter(|before| before.is_empty() || before.ends_with('.'))?;
        Some(format!("{before}{}", self.written))
    }

    /// A value of the setting as text, in the unit that was written.
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

    /// The error about a value that is not allowed.
    pub(super) fn not_allowed(
        &self,
        key: String,
        value: &Spanned<DeValue<'_>>,
        allowed: String,
    ) -> InputError {
        let problem = Problem::NotAllowed {
            key,
            value: self.source.quote(value.span()),
            allowed,
        };
        self.error(problem, value.span(), "")
    }

    pub(super) fn error(&self, problem: Problem, span: Range<usize>, advice: &str) -> InputError {
        InputError {
            problem: Box::new(self.as_written(problem, &span)),
            location: Box::new(self.source.location(span)),
            advice: advice.to_owned(),
        }
    }

    /// The place of something missing: the end of the text.
    pub(super) fn end(&self) -> Range<usize> {
        let end = self.source.text.trim_end().len();
        end..end
    }

    /// The key with another unit at a place.
    fn other_unit_at(&self, span: &Range<usize>) -> Option<&OtherUnit> {
        let (_, other) = self.other_units.range(..=span.start).next_back()?;
        (span.start < other.end).then_some(other)
    }

    /// The path of a setting as it was written at a place.
    pub(super) fn written(&self, path: &str, span: &Range<usize>) -> String {
        self.other_unit_at(span)
            .and_then(|other| other.written(path))
            .unwrap_or_else(|| path.to_owned())
    }

    /// A problem at a place, with the key that was written there.
    fn as_written(&self, problem: Problem, span: &Range<usize>) -> Problem {
        let other = self.other_unit_at(span);
        let written = |key: &str| other.and_then(|other| other.written(key));
        match problem {
            Problem::NotAllowed {
                key,
                value,
                allowed,
            } => match (written(&key), other) {
                (Some(key), Some(other)) => {
                    let is_quoted = value == self.source.quote(span.clone());
                    let in_unit = other.value(&value).filter(|_| !is_quoted);
                    Problem::NotAllowed {
                        key,
                        value: in_unit.unwrap_or(value),
                        allowed,
                    }
                }
                _ => Problem::NotAllowed {
                    key,
                    value,
                    allowed,
                },
            },
            Problem::UnknownKey { key, expected } => Problem::UnknownKey {
                key: written(&key).unwrap_or(key),
                expected,
            },
            Problem::Sweep { key, error } => Problem::Sweep {
                key: written(&key).unwrap_or(key),
                error,
            },
            other => other,
        }
    }
}

/// Reads a part of the tree.
pub(super) fn read<T: serde::de::DeserializeOwned>(
    value: &Spanned<DeValue<'_>>,
) -> Result<T, toml::de::Error> {
    T::deserialize(ValueDeserializer::from(value.clone()))
}
