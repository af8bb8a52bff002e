//! Settings from the tree: replaced values, defaults, and checks.

use std::borrow::Cow;
use std::ops::Range;

use bristle::model::parameters::{PARAMETERS, Parameter, Violation};
use bristle::model::settings::Settings;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::errors::text_mistake;
use super::located::LocatedTool;
use super::tree::{number_of, read};
use super::{Document, FOLLOWS, find, place, stated};
use crate::grid::uncertainty::check;
use crate::grid::{BRUSH, DEPTH};
use crate::input::input_error::InputError;
use crate::input::keys::{CONTROL_POINTS, WORKPIECE};
use crate::input::materials::{CONTACT_STIFFNESS, default_contact_stiffness};
use crate::input::options;

/// Beginning of serde's message about a key without a default.
const MISSING: &str = "missing field ";

/// A value that replaces the one in the file.
pub(super) struct Override<'a> {
    pub(super) parameter: &'static Parameter,
    /// Value as TOML.
    pub(super) text: &'a str,
    /// Place to which an error about the value points.
    pub(super) span: Range<usize>,
}

/// Settings that have been read and checked.
pub(super) struct Built<'a> {
    pub(super) settings: Settings,
    /// Tree, with the place of each setting.
    pub(super) table: DeTable<'a>,
    /// Settings that the file states in another way, and their values.
    pub(super) followed: Vec<(&'static Parameter, f64)>,
}

impl<'t> Document<'t> {
    /// Reads and checks the settings, those of a named tool if there is one, with some values
    /// replaced.
    pub(super) fn build<'a>(
        &'a self,
        tool: Option<&'a LocatedTool<'t>>,
        overrides: &[Override<'a>],
    ) -> Result<Built<'a>, InputError> {
        let mut table: DeTable<'a> = self.table.clone();
        if let Some(tool) = tool {
            tool.state(&mut table);
        }
        self.convert(&mut table);
        self.state_material(&mut table, tool);
        for Override {
            parameter,
            text,
            span,
        } in overrides
        {
            if let Some(section) = options::section_in(&mut table, parameter.section(), &self.end())
            {
                // Remove the entry first: an insertion alone would keep the old key's place. Keys
                // that state the same go, too, unless they are replaced themselves.
                let is_replaced = |same: &Parameter| {
                    overrides
                        .iter()
                        .any(|other| std::ptr::eq(other.parameter, same))
                };
                for same in parameter
                    .group()
                    .filter(|same| std::ptr::eq(*same, *parameter) || !is_replaced(same))
                {
                    section.remove(same.key());
                }
                section.insert(
                    Spanned::new(span.clone(), Cow::Borrowed(parameter.key())),
                    Spanned::new(span.clone(), number_of(text)),
                );
            }
        }
        let mut plain = table.clone();
        let followed = self.take_followed(&mut plain)?;
        let has_default_depth = self.take_default_depth(&table, &mut plain);
        let workpiece = plain.remove(WORKPIECE);
        let root = Spanned::new(self.end(), plain);
        let mut settings = Settings::deserialize(Deserializer::from(root)).map_err(|error| {
            // The place of a missing key is that of the section, or of the whole file: it would be
            // taken for that of a value.
            let missing = error
                .message()
                .starts_with(MISSING)
                .then(|| self.missing(&table))
                .flatten();
            missing.unwrap_or_else(|| self.unreadable(&table, &error))
        })?;
        if let Some(workpiece) = workpiece {
            settings.workpiece = self.read_workpiece(&table, workpiece)?;
        }
        if find(&table, CONTACT_STIFFNESS).is_none() && settings.contact.exponent == 1.0 {
            settings.contact.stiffness_n_m = default_contact_stiffness(
                settings.filament.youngs_modulus_pa,
                settings.filament.diameter_m,
            );
        }
        self.check_lengths(&table, &settings)?;
        if self.is_alone || !followed.is_empty() {
            settings
                .check_ranges()
                .map_err(|violation| self.violated(&table, violation))?;
        }
        followed
            .iter()
            .for_each(|(parameter, value)| parameter.set(&mut settings, *value));
        if self.is_alone {
            settings.brush = None;
            table.remove(BRUSH);
        }
        let mut complete = settings.clone();
        if has_default_depth {
            settings.process.penetration_depth_m = 0.0;
            complete = settings.clone().with_default_depth();
            let is_missing = complete.process.penetration_depth_m == 0.0;
            if let Some(error) = is_missing.then(|| self.missing(&table)).flatten() {
                return Err(error);
            }
        }
        check(&complete).map_err(|violation| {
            let cause = followed
                .iter()
                .find(|(parameter, _)| parameter.instead_of == violation.path);
            match cause {
                Some((parameter, value)) => {
                    self.violated(&table, followed_violation(parameter, *value, &violation))
                }
                None => self.violated(&table, violation),
            }
        })?;
        Ok(Built {
            settings,
            table,
            followed,
        })
    }

    /// Puts a value that passes the checks in the place of a depth that the file leaves to its
    /// default, which follows from the settings of each case. Returns `true` if it does so.
    fn take_default_depth<'a>(&self, table: &DeTable<'_>, plain: &mut DeTable<'a>) -> bool {
        let depth = Parameter::find(DEPTH).expect("the table has the depth");
        let is_bore = find(table, "workpiece.kind")
            .is_some_and(|kind| kind.get_ref().as_str() == Some("bore"));
        let is_left_out = is_bore && stated(table, depth).next().is_none();
        if is_left_out
            && let Some(section) = options::section_in(plain, depth.section(), &self.end())
        {
            section.insert(
                Spanned::new(self.end(), Cow::Borrowed(depth.key())),
                Spanned::new(self.end(), number_of("1.0")),
            );
        }
        is_left_out
    }

    /// Checks that no element of a vector was left out when the `settings` were read: serde takes
    /// as many as it needs.
    fn check_lengths(&self, table: &DeTable<'_>, settings: &Settings) -> Result<(), InputError> {
        let read = serde_json::to_value(settings).expect("settings are JSON");
        for (section, entries) in table {
            let Some(entries) = entries.get_ref().as_table() else {
                continue;
            };
            for (key, value) in entries {
                let path = format!("{}.{}", section.get_ref(), key.get_ref());
                self.check_length(
                    &path,
                    value,
                    &read[section.get_ref().as_ref()][key.get_ref().as_ref()],
                )?;
            }
        }
        Ok(())
    }

    /// Checks that a list of the tree, and each list in it, has as many elements as were `read`.
    fn check_length(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        read: &serde_json::Value,
    ) -> Result<(), InputError> {
        let (DeValue::Array(stated), Some(read)) = (value.get_ref(), read.as_array()) else {
            return Ok(());
        };
        if stated.len() != read.len() {
            let allowed = format!("a list of {} numbers", read.len());
            return Err(self.not_allowed(path, value, allowed));
        }
        stated
            .iter()
            .zip(read)
            .try_for_each(|(stated, read)| self.check_length(path, stated, read))
    }

    /// Takes the settings that state others in their own way out of the tree, and returns them with
    /// their values. Values that pass the checks take the place of these others.
    fn take_followed<'a>(
        &self,
        table: &mut DeTable<'a>,
    ) -> Result<Vec<(&'static Parameter, f64)>, InputError> {
        let mut followed = Vec::new();
        for parameter in PARAMETERS
            .iter()
            .filter(|parameter| !parameter.instead_of.is_empty())
        {
            let Some(value) = find(table, parameter.path) else {
                continue;
            };
            let span = value.span();
            if let Some(other) =
                stated(table, parameter).find(|other| !std::ptr::eq(*other, parameter))
            {
                let written = |parameter: &Parameter| {
                    let place = find(table, parameter.path).map(Spanned::span);
                    place.map_or_else(
                        || parameter.path.to_owned(),
                        |place| self.written(parameter.path, &place),
                    )
                };
                return Err(self.both(&written(parameter), &written(other), span, FOLLOWS));
            }
            let refused = |found: String| {
                let key = self.written(parameter.path, &span);
                let advice = text_mistake(&key, value.get_ref());
                let allowed = parameter.allowed();
                self.refused(parameter.path, found, allowed, span.clone(), &advice)
            };
            let number: f64 = read(value).map_err(|_| refused(self.source.quote(span.clone())))?;
            parameter
                .check(number)
                .map_err(|violation| refused(violation.value))?;
            followed.push((parameter, number));
            if let Some(DeValue::Table(section)) =
                table.get_mut(parameter.section()).map(Spanned::get_mut)
            {
                let of = Parameter::find(parameter.instead_of)
                    .expect("what follows does so from a setting");
                section.remove(parameter.key());
                section.insert(
                    Spanned::new(span.clone(), Cow::Borrowed(of.key())),
                    Spanned::new(span.clone(), number_of("1.0")),
                );
            }
        }
        Ok(followed)
    }

    /// Returns the error about a setting outside its range, or at odds with others.
    pub(super) fn violated(&self, table: &DeTable<'_>, violation: Violation) -> InputError {
        let of_points = self
            .control_points_file
            .as_ref()
            .filter(|_| violation.path == CONTROL_POINTS);
        let span = of_points
            .map(|(_, span)| span.clone())
            .or_else(|| place(table, violation.path));
        let span = span.unwrap_or(self.end());
        let Violation {
            path,
            value,
            allowed,
        } = violation;
        let advice = likely_slip(path, &value).unwrap_or_default();
        self.refused(path, value, allowed, span, &advice)
    }
}

/// Returns the violation of a setting's range by the value that follows from that of another.
fn followed_violation(parameter: &Parameter, value: f64, violation: &Violation) -> Violation {
    let Violation {
        path,
        value: follows,
        allowed,
    } = violation;
    let allowed =
        format!("such that `{path}`, which follows from it and is {follows}, is {allowed}");
    Violation {
        path: parameter.path,
        value: parameter.format(value),
        allowed,
    }
}

/// Advice on a setting whose `value` is not only refused but outside of what brushes usually have.
fn likely_slip(path: &str, value: &str) -> Option<String> {
    let usual = Parameter::find(path)?.usual?;
    let value: f64 = value.parse().ok()?;
    let is_usual = (usual.least..=usual.largest).contains(&value);
    (!is_usual).then(|| format!("a likely slip: {}", usual.slip))
}
