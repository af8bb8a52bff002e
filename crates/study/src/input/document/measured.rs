//! Entries of `[measured]`: file, format and columns of a table.

use std::borrow::Cow;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::tree::read;
use super::units::ONE_UNIT;
use super::{Document, FOLLOWS, MEASURED, MEASURED_FILE};
use crate::grid::TOOL;
use crate::input::cells::{DECIMALS, SEPARATORS};
use crate::input::input_error::InputError;
use crate::input::measured::{ColumnName, Quantity, TableFormat};

/// Keys of `[measured]`.
const FILE: &str = "file";
const SEPARATOR: &str = "separator";
const DECIMAL: &str = "decimal";
const COLUMNS: &str = "columns";
const RELATIVE_STD: &str = "relative_std";

impl Document<'_> {
    /// Reads the entries of `[measured]`, whose heading is at `span`.
    pub(super) fn read_measured(
        &self,
        entries: &DeTable<'_>,
        span: Range<usize>,
    ) -> Result<(String, TableFormat), InputError> {
        let keys = [FILE, SEPARATOR, DECIMAL, COLUMNS, RELATIVE_STD];
        self.check_keys(MEASURED, entries, &keys)?;
        let key = format!("{MEASURED}.{FILE}");
        let Some(value) = entries.get(FILE) else {
            let advice = format!("add `{FILE} = \"forces.csv\"` under [{MEASURED}]");
            return Err(self.absent(&key, MEASURED_FILE, span, &advice));
        };
        let file = value
            .get_ref()
            .as_str()
            .filter(|path| !path.trim().is_empty());
        let file = file
            .ok_or_else(|| self.not_allowed(&key, value, MEASURED_FILE))?
            .to_owned();
        let letter = |key: &str, letters: &[char]| {
            let Some(value) = entries.get(key) else {
                return Ok(None);
            };
            let found = letters
                .iter()
                .find(|letter| value.get_ref().as_str() == Some(&letter.to_string()));
            let allowed = || {
                letters
                    .iter()
                    .map(|letter| format!("{:?}", letter.to_string()))
                    .collect::<Vec<_>>()
            };
            let refused =
                || self.not_allowed(&format!("{MEASURED}.{key}"), value, allowed().join(" or "));
            found.copied().map(Some).ok_or_else(refused)
        };
        let relative_std = |value| {
            let number: Option<f64> = read(value)
                .ok()
                .filter(|number| *number > 0.0 && *number <= 1.0);
            let allowed = "a number greater than 0 and at most 1: 0.03 for 3 %";
            number.ok_or_else(|| {
                self.not_allowed(&format!("{MEASURED}.{RELATIVE_STD}"), value, allowed)
            })
        };
        let format = TableFormat {
            separator: letter(SEPARATOR, &SEPARATORS)?,
            decimal: letter(DECIMAL, &DECIMALS)?,
            columns: entries
                .get(COLUMNS)
                .map_or(Ok(Vec::new()), |columns| self.read_columns(columns))?,
            tool: entries
                .get(COLUMNS)
                .map_or(Ok(None), |columns| self.read_tool_column(columns))?,
            tools: Vec::new(),
            relative_std: entries.get(RELATIVE_STD).map(relative_std).transpose()?,
        };
        Ok((file, format))
    }

    /// Reads the names of columns of measured forces.
    fn read_columns(
        &self,
        columns: &Spanned<DeValue<'_>>,
    ) -> Result<Vec<(Quantity, ColumnName)>, InputError> {
        let path = format!("{MEASURED}.{COLUMNS}");
        let DeValue::Table(entries) = columns.get_ref() else {
            let allowed = "a table such as { force_n = \"Fz [N]\" }";
            return Err(self.not_allowed(&path, columns, allowed));
        };
        let is_named = |key: &Spanned<Cow<'_, str>>| Quantity::of_key(key.get_ref()).is_some();
        let mut named: Vec<_> = entries.iter().filter(|(key, _)| is_named(key)).collect();
        let others = named.iter().map(|(key, _)| key.get_ref().as_ref());
        let keys: Vec<&str> = Quantity::ALL
            .map(Quantity::key)
            .into_iter()
            .chain([TOOL])
            .chain(others)
            .collect();
        self.check_keys(&path, entries, &keys)?;
        named.sort_by_key(|(key, _)| key.span().start);
        let mut columns: Vec<(Quantity, ColumnName)> = Vec::new();
        for (key, value) in &named {
            let Some((quantity, unit)) = Quantity::of_key(key.get_ref()) else {
                continue;
            };
            let is_same =
                |other: Quantity| other == quantity || (other.is_speed() && quantity.is_speed());
            if let Some(first) = columns.iter().position(|(other, _)| is_same(*other)) {
                let advice = if columns[first].0 == quantity {
                    ONE_UNIT
                } else {
                    FOLLOWS
                };
                let [key_path, other] =
                    [key, named[first].0].map(|key| format!("{path}.{}", key.get_ref()));
                return Err(self.both(&key_path, &other, key.span(), advice));
            }
            let ColumnName {
                heading,
                unit: stated,
            } = self.read_column(quantity, key.get_ref(), value)?;
            let of_key = Some(unit).filter(|unit| !unit.is_own());
            if stated.is_some() && of_key.is_some() {
                let allowed = "the heading of a column alone, as the key states the unit";
                return Err(self.not_allowed(&format!("{path}.{}", key.get_ref()), value, allowed));
            }
            columns.push((
                quantity,
                ColumnName {
                    heading,
                    unit: stated.or(of_key),
                },
            ));
        }
        Ok(columns)
    }

    /// Reads the name of the column of named tools, if it is stated.
    fn read_tool_column(
        &self,
        columns: &Spanned<DeValue<'_>>,
    ) -> Result<Option<String>, InputError> {
        let Some(value) = columns
            .get_ref()
            .as_table()
            .and_then(|entries| entries.get(TOOL))
        else {
            return Ok(None);
        };
        let path = format!("{MEASURED}.{COLUMNS}.{TOOL}");
        let allowed = "the heading of a column with the names of tools";
        let refused = || self.not_allowed(&path, value, allowed);
        text_of(value).map(Some).ok_or_else(refused)
    }

    /// Reads the name of a column, with its unit if it is stated.
    fn read_column(
        &self,
        quantity: Quantity,
        key: &str,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<ColumnName, InputError> {
        const COLUMN: &str = "column";
        const UNIT: &str = "unit";
        let path = format!("{MEASURED}.{COLUMNS}.{key}");
        let units = quantity.unit_names().collect::<Vec<_>>();
        let allowed = || {
            format!(
                "the heading of a column, or {{ column = \"…\", unit = \"{}\" }}",
                units[0]
            )
        };
        let DeValue::Table(entries) = value.get_ref() else {
            let heading =
                text_of(value).ok_or_else(|| self.not_allowed(&path, value, allowed()))?;
            return Ok(ColumnName {
                heading,
                unit: None,
            });
        };
        self.check_keys(&path, entries, &[COLUMN, UNIT])?;
        let heading = entries.get(COLUMN).and_then(text_of);
        let heading = heading.ok_or_else(|| self.not_allowed(&path, value, allowed()))?;
        let unit = entries.get(UNIT).map(|unit| {
            let known = text_of(unit).and_then(|unit| quantity.unit(&unit));
            known.ok_or_else(|| {
                let allowed = format!("one of {}", units.join(", "));
                self.not_allowed(&format!("{path}.{UNIT}"), unit, allowed)
            })
        });
        Ok(ColumnName {
            heading,
            unit: unit.transpose()?,
        })
    }
}

/// Returns a text that says something, without the space around it.
fn text_of(value: &Spanned<DeValue<'_>>) -> Option<String> {
    let text = value.get_ref().as_str().map(str::trim);
    text.filter(|text| !text.is_empty()).map(str::to_owned)
}
