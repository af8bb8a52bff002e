//! What a file of a stopped run belongs to: a program and its settings. Lines of text that carry a
//! check, and differences in words.

use std::collections::{BTreeMap, BTreeSet};

use bristle::equations::FINGERPRINT;
use bristle::model::settings::Settings;
use bristle_study::text::{shortened, shown};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::store::digest::digest;

/// Digits of a check: 64 bits let one damaged line in 10¹⁹ pass.
pub(crate) const CHECK_DIGITS: usize = 16;
/// The largest number of differences that an error lists.
const MAX_DIFFERENCES: usize = 6;
/// Longest path of a setting in such a list, in characters.
pub(crate) const LONGEST_PATH: usize = 80;

/// Differences as lines of an error.
pub(crate) fn listed(differences: &[String]) -> String {
    let mut text: String = differences
        .iter()
        .take(MAX_DIFFERENCES)
        .map(|line| format!("\n  {line}"))
        .collect();
    if differences.len() > MAX_DIFFERENCES {
        text += &format!("\n  and {} more", differences.len() - MAX_DIFFERENCES);
    }
    text
}

/// An object as a line that ends with its check.
pub(crate) fn sealed(seed: &str, object: &impl Serialize) -> String {
    let mut line = serde_json::to_string(object).expect("all keys are texts");
    // The check becomes the last key.
    line.pop();
    let check = check(seed, &line);
    line + r#","check":""# + &check + "\"}\n"
}

/// The object of a line; `None` if its check is wrong.
pub(crate) fn unsealed<'l, T: Deserialize<'l>>(seed: &str, line: &'l str) -> Option<T> {
    let (object, check_here) = line.strip_suffix("\"}\n")?.rsplit_once(r#","check":""#)?;
    if check_here != check(seed, object) {
        return None;
    }
    serde_json::from_str(line).ok()
}

fn check(seed: &str, object: &str) -> String {
    let mut digits = digest(format!("{seed}{object}").as_bytes());
    digits.truncate(CHECK_DIGITS);
    digits
}

/// The program that has written a file.
#[derive(Serialize, Deserialize)]
pub(crate) struct Program {
    /// Version of Bristle.
    version: String,
    /// SHA-256 of the kernels' expressions.
    equations: String,
    /// SHA-256 of the code that solves them.
    solver: String,
}

impl Program {
    /// This one, by the hash of its solver.
    pub(crate) fn here(solver: &str) -> Self {
        let [version, equations, solver] =
            [env!("CARGO_PKG_VERSION"), FINGERPRINT, solver].map(str::to_owned);
        Self {
            version,
            equations,
            solver,
        }
    }

    /// Its differences from the one `here`, in words.
    pub(crate) fn differences(&self, here: &Self) -> Vec<String> {
        let programs = [
            ("version", &self.version, &here.version),
            ("equations (SHA-256)", &self.equations, &here.equations),
            ("solver (SHA-256)", &self.solver, &here.solver),
        ];
        let difference = |(what, there, here): (&str, &String, &String)| {
            let [there, here] =
                [there, here].map(|text| shortened(&text.chars().take(12).collect::<String>()));
            format!("{what}: {there} there, {here} here")
        };
        programs
            .into_iter()
            .filter(|(_, there, here)| there != here)
            .map(difference)
            .collect()
    }
}

/// The differences of settings from those here, except those that `is_left_out` names by their
/// paths.
pub(crate) fn settings(
    there: &Value,
    here: &Settings,
    is_left_out: impl Fn(&str) -> bool,
) -> Vec<String> {
    let mut differences = Vec::new();
    let here = leaves(&serde_json::to_value(here).unwrap_or_default());
    each_difference(&leaves(there), &here, |path, there, here| {
        if !is_left_out(path) {
            let text = |value: Option<&Value>| {
                value.map_or("not stated".to_owned(), |value| {
                    shortened(&value.to_string())
                })
            };
            let path = shown(path, LONGEST_PATH);
            differences.push(format!(
                "{path}: {} there, {} here",
                text(there),
                text(here)
            ));
        }
    });
    differences
}

/// Calls `different` for each key whose values differ.
pub(crate) fn each_difference<V: PartialEq>(
    there: &BTreeMap<String, V>,
    here: &BTreeMap<String, V>,
    mut different: impl FnMut(&str, Option<&V>, Option<&V>),
) {
    let keys: BTreeSet<&String> = there.keys().chain(here.keys()).collect();
    for key in keys {
        let (there, here) = (there.get(key), here.get(key));
        if there != here {
            different(key, there, here);
        }
    }
}

/// The values within an object of objects, by dotted path.
pub fn leaves(value: &Value) -> BTreeMap<String, Value> {
    let mut found = BTreeMap::new();
    let mut open = vec![(String::new(), value)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Object(fields) => open.extend(fields.iter().map(|(key, value)| {
                let path = if path.is_empty() {
                    key.clone()
                } else {
                    format!("{path}.{key}")
                };
                (path, value)
            })),
            value => {
                found.insert(path, value.clone());
            }
        }
    }
    found
}
