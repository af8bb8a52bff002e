//! Keys of the tree in other units than those of their settings become the keys of the settings.
//! Their values follow when they are read.

use std::borrow::Cow;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::tree::{Document, OtherUnit};
use crate::input::input_error::InputError;
use crate::input::keys::{STUDY, TOOLS};
use crate::input::units::own_key;

/// Advice about two keys for one setting.
pub(super) const ONE_UNIT: &str = "give one of them: both state the same, each in its unit";

impl<'t> Document<'t> {
    /// Gives all keys of the tree the units of their settings.
    pub(super) fn take_units(&mut self) -> Result<(), InputError> {
        let mut table = std::mem::take(&mut self.table);
        for (section, entries) in table.iter_mut() {
            let section = section.get_ref().as_ref();
            let DeValue::Table(entries) = entries.get_mut() else {
                continue;
            };
            self.take_units_of(entries, section, section)?;
            if let Some(DeValue::Table(tools)) = entries.get_mut(TOOLS).map(Spanned::get_mut)
                && section == STUDY
            {
                for (name, tool) in tools.iter_mut() {
                    let DeValue::Table(tool) = tool.get_mut() else {
                        continue;
                    };
                    let path = format!("{STUDY}.{TOOLS}.{}", name.get_ref());
                    // Keys with their paths in quotes.
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

    /// Gives the keys of a table, which are those of a `section`, the units of their settings.
    /// `path` names the table.
    fn take_units_of(
        &mut self,
        entries: &mut DeTable<'t>,
        section: &str,
        path: &str,
    ) -> Result<(), InputError> {
        let other =
            |key: &Spanned<Cow<'t, str>>| Some((key.clone(), own_key(section, key.get_ref())?));
        let mut others: Vec<_> = entries.keys().filter_map(other).collect();
        others.sort_by_key(|(key, _)| key.span().start);
        for (key, (own, unit)) in others {
            let written = key.get_ref().as_ref();
            let Some(value) = entries.remove(written) else {
                continue;
            };
            if let Some((same, _)) = entries.get_key_value(own.as_str()) {
                let same_span = same.span();
                let same_path = self.written(&format!("{path}.{own}"), &same_span);
                let own_path = format!("{path}.{written}");
                let is_second = key.span().start > same_span.start;
                let (span, key, other) = if is_second {
                    (key.span(), own_path, same_path)
                } else {
                    (same_span, same_path, own_path)
                };
                return Err(self.both(&key, &other, span, ONE_UNIT));
            }
            let start = key.span().start;
            self.other_units
                .insert(start, OtherUnit::new(&own, written, unit, &value));
            entries.insert(Spanned::new(key.span(), Cow::Owned(own)), value);
        }
        Ok(())
    }

    /// Converts the values of a tree to the units of the settings.
    pub(super) fn convert<'a>(&'a self, table: &mut DeTable<'a>) {
        for (_, section) in table.iter_mut() {
            let DeValue::Table(entries) = section.get_mut() else {
                continue;
            };
            for (key, value) in entries.iter_mut() {
                if let Some(other) = self.other_units.get(&key.span().start) {
                    other.convert(value);
                }
            }
        }
    }
}
