//! Settings and sweeps that the options `--set` state as if the file did.

use std::ops::Range;

use bristle::model::parameters::{PARAMETERS, Parameter};
use toml::Spanned;

use super::errors::{cannot_be_read, not_toml};
use super::meant::setting_meant;
use super::tree::OtherUnit;
use super::units::ONE_UNIT;
use super::{Document, FOLLOWS};
use crate::input::input_error::InputError;
use crate::input::keys::{STUDY, TOOLS};
use crate::input::options::{self, Assignment};

impl Document<'_> {
    /// Puts the settings of the options into the tree.
    pub(super) fn take_options(&mut self) -> Result<(), InputError> {
        for number in 0..self.source.options.len() {
            let start = self.source.start_of_option(number);
            let option = &self.source.options[number];
            let there = |span: &Range<usize>| start + span.start..start + span.end;
            let Some(assignment) =
                Assignment::of(option).filter(|assignment| assignment.is_whole())
            else {
                let problem = cannot_be_read("an option needs a key and a value");
                let advice = "as in --set process.rotational_speed_rpm=1200";
                return Err(self.error(None, problem, there(&(0..option.len())), advice));
            };
            let Assignment {
                section,
                key,
                unit,
                key_span,
                value_span,
                ..
            } = &assignment;
            if section.is_empty() {
                let expected = "a section and a key, as in process.rotational_speed_rpm";
                let advice = PARAMETERS.iter().find(|parameter| parameter.section() == *key).map_or_else(
                    || setting_meant(key),
                    |first| format!("state a key of [{key}], as in --set {}=…, or the section in the file", first.path),
                );
                return Err(self.unknown(key, expected, there(key_span), &advice));
            }
            let value = assignment.parsed().map_err(|error| {
                let (problem, advice) = not_toml(
                    option,
                    &format!("not a TOML value: {}", error.message()),
                    "",
                );
                self.error(None, problem, there(value_span), &advice)
            })?;
            // The same key again replaces the earlier one; the same setting by another key does
            // not.
            let group = Parameter::find(&assignment.path())
                .into_iter()
                .flat_map(Parameter::group);
            let paths: Vec<String> = group
                .map(|same| same.path.to_owned())
                .chain([assignment.path()])
                .collect();
            let is_other = |other: &Assignment<'_>| {
                paths.contains(&other.path()) && other.written_path() != assignment.written_path()
            };
            let mut earlier = self.source.options[..number]
                .iter()
                .filter_map(|option| Assignment::of(option));
            if let Some(other) = earlier.find(is_other) {
                let [key, other_key] = [&assignment, &other].map(Assignment::written_path);
                let advice = if other.path() == assignment.path() {
                    ONE_UNIT
                } else {
                    FOLLOWS
                };
                return Err(self.both(&key, &other_key, there(key_span), advice));
            }
            let spans = [there(key_span), there(value_span)];
            if let Some(unit) = unit {
                let value = Spanned::new(spans[1].clone(), value.clone());
                let other = OtherUnit::new(key, assignment.written, unit, &value);
                self.other_units.insert(spans[0].start, other);
            }
            match assignment.tool() {
                None => options::state(&mut self.table, [section, key], value, spans),
                Some(tool) => {
                    options::state_of_tool(&mut self.table, [STUDY, TOOLS], tool, value, spans)
                }
            }
        }
        Ok(())
    }

    /// Checks that no option states a setting that the study sweeps, or that each tool states.
    pub(super) fn check_options(&self) -> Result<(), InputError> {
        for (number, option) in self.source.options.iter().enumerate() {
            let Some(assignment) = Assignment::of(option) else {
                continue;
            };
            let Some(parameter) = Parameter::find(&assignment.path()) else {
                continue;
            };
            let start = self.source.start_of_option(number);
            let place = start + assignment.key_span.start..start + assignment.key_span.end;
            if let Some(swept) = parameter.group().find(|same| self.sweeps(same)) {
                let advice = format!(
                    "sweep other values, as in --set 'study.{}=[…]'",
                    parameter.path
                );
                return Err(self.swept(parameter.path, swept, place, &advice));
            }
            if let Some(first) = self.tools.first()
                && self
                    .tools
                    .iter()
                    .all(|tool| parameter.group().any(|same| tool.states(same.path)))
            {
                let what = "has no effect, because each tool of the study states it";
                let advice = format!(
                    "state it of a tool, as in --set study.tools.\"{}\".{}=…",
                    first.name, parameter.path
                );
                return Err(self.about(parameter.path, what, place, &advice));
            }
        }
        Ok(())
    }
}
