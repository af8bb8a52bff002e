//! Sweeps in `[study]`: lists and ranges.

use std::borrow::Cow;

use bristle::model::parameters::Parameter;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::Document;
use super::located::LocatedSweep;
use super::meant::setting_meant;
use super::tree::read;
use crate::grid::{SHORT_NAMES, Sweep};
use crate::input::input_error::{InputError, LONGEST_KEY, LONGEST_MESSAGE};
use crate::input::keys::STUDY;
use crate::text::shown;

/// Values allowed for an entry of `[study]`.
const SWEEP: &str = "a list of numbers, or { start = …, stop = …, step = … }";

/// The long form of a sweep.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a list or a range")]
struct SweepRange {
    start: f64,
    stop: f64,
    step: f64,
}

impl Document<'_> {
    /// Reads the entries of `[study]` in the order of the file.
    pub(super) fn read_sweeps(
        &self,
        entries: &DeTable<'_>,
    ) -> Result<Vec<LocatedSweep>, InputError> {
        let mut entries: Vec<_> = entries.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
            .into_iter()
            .map(|(key, value)| self.read_sweep(key, value))
            .collect()
    }

    fn read_sweep(
        &self,
        key: &Spanned<Cow<'_, str>>,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<LocatedSweep, InputError> {
        let mut value = value.clone();
        if let Some(other) = self.other_units.get(&key.span().start) {
            other.convert(&mut value);
        }
        let name = key.get_ref().as_ref();
        let path = SHORT_NAMES
            .into_iter()
            .find_map(|(short, path)| (short == name).then_some(path))
            .unwrap_or(name);
        let study_key = format!("{STUDY}.{name}");
        let Some(parameter) = Parameter::find(path) else {
            let expected = "the path of a scalar setting in quotes, such as \"filament.segments\"";
            return Err(self.unknown(&study_key, expected, key.span(), &setting_meant(name)));
        };
        let unreadable = |error: toml::de::Error| {
            let span = error.span().unwrap_or(value.span());
            let allowed = format!("{SWEEP} ({})", shown(error.message(), LONGEST_MESSAGE));
            let found = self.source.quote(value.span());
            self.refused(&study_key, found, allowed, span, "")
        };
        let sweep = if value.get_ref().is_array() {
            Sweep::list(parameter, read(&value).map_err(unreadable)?)
        } else {
            let SweepRange { start, stop, step } = read(&value).map_err(unreadable)?;
            Sweep::range(parameter, start, stop, step)
        };
        let located = |sweep| LocatedSweep {
            parameter,
            sweep,
            span: value.span(),
        };
        sweep.map(located).map_err(|error| {
            let span = match (error.index, value.get_ref()) {
                (Some(index), DeValue::Array(items)) => items[index].span(),
                _ => value.span(),
            };
            let key = self.written(&study_key, &span);
            let problem = format!("`{}`: {error}", shown(&key, LONGEST_KEY));
            self.error(Some(&key), problem, span, "")
        })
    }
}
