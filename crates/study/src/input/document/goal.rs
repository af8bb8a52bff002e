//! Entries of `[goal]`.

use std::ops::Range;

use serde_json::{Map, Value};
use toml::de::DeTable;

use super::Document;
use super::tree::read;
use super::units::ONE_UNIT;
use crate::input::goal::{GOAL, MOST, MOST_OF, NUMBERS, allowed, largest};
use crate::input::input_error::InputError;
use crate::text::units::own_keys;

const REMOVAL: &str = "removal";

impl Document<'_> {
    /// Reads the entries of `[goal]`, whose heading is at `span`.
    pub(super) fn read_goal(
        &self,
        entries: &DeTable<'_>,
        span: Range<usize>,
    ) -> Result<Map<String, Value>, InputError> {
        let mut goal = Map::new();
        for (key, value) in entries {
            let written = key.get_ref().as_ref();
            let path = format!("{GOAL}.{written}");
            let (own, value) = if written == MOST {
                let word = value
                    .get_ref()
                    .as_str()
                    .filter(|word| MOST_OF.contains(word));
                let allowed = || format!("\"{}\"", MOST_OF.join("\", \""));
                let word = word.ok_or_else(|| self.not_allowed(&path, value, allowed()))?;
                if word != MOST_OF[0] && !self.table.contains_key(REMOVAL) {
                    let allowed = format!(
                        "\"{}\" without the section [{REMOVAL}], which may be empty",
                        MOST_OF[0]
                    );
                    return Err(self.not_allowed(&path, value, allowed));
                }
                (MOST, Value::from(word))
            } else {
                let known = |own: &str| NUMBERS.iter().map(|(key, _)| *key).find(|key| *key == own);
                let in_another =
                    || own_keys(written).find_map(|(own, unit)| Some((known(&own)?, Some(unit))));
                let found = known(written).map(|own| (own, None)).or_else(in_another);
                let Some((own, unit)) = found else {
                    let keys: Vec<&str> =
                        NUMBERS.iter().map(|(key, _)| *key).chain([MOST]).collect();
                    return Err(self.unknown_key(GOAL, key, &keys));
                };
                let number: Option<f64> = read(value)
                    .ok()
                    .map(|number| unit.map_or(number, |unit| unit.to_own(number)));
                let number = number.filter(|number| {
                    *number > 0.0 && number.is_finite() && *number <= largest(own)
                });
                let number = number.ok_or_else(|| self.not_allowed(&path, value, allowed(own)))?;
                (own, Value::from(number))
            };
            if goal.insert(own.to_owned(), value).is_some() {
                let other = format!("{GOAL}.{own}");
                return Err(self.both(&path, &other, key.span(), ONE_UNIT));
            }
        }
        if goal.is_empty() {
            let first = NUMBERS[0].0;
            let advice = "or another key of [goal]: docs/input.md lists them";
            return Err(self.absent(&format!("{GOAL}.{first}"), allowed(first), span, advice));
        }
        Ok(goal)
    }
}
