//! Settings in which the named tools of a study differ.

use std::collections::{BTreeMap, BTreeSet};

use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle_study::text::shortened;
use serde_json::Value;

use bristle_study::grid::{Setting, Study};
use bristle_study::text::number::short;

/// A setting that differs between tools.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Dotted path of the setting.
    pub path: String,
    /// Name, symbol and unit; the path if it is not a number.
    pub label: String,
    /// Value of each tool, in the unit of the label.
    pub values: Vec<String>,
}

/// Returns the settings in which the named tools of a study differ, in the order of the table of
/// settings; others follow. Swept settings are excluded.
#[must_use]
pub fn tool_differences(study: &Study) -> Vec<Difference> {
    let tools = study.tools().len();
    let settings = |tool: usize| study.settings(tool * (study.case_count() / tools));
    let leaves: Vec<_> = (0..tools)
        .map(|tool| {
            leaves(
                &serde_json::to_value(settings(tool))
                    .expect("checked settings have a form in JSON"),
            )
        })
        .collect();
    let paths: BTreeSet<&String> = leaves.iter().flat_map(|settings| settings.keys()).collect();
    let differs = |path: &&&String| {
        leaves
            .iter()
            .any(|settings| settings.get(**path) != leaves[0].get(**path))
    };
    let is_swept = |path: &str| {
        study.sweep(path).is_some()
            || Parameter::find(path).is_some_and(|parameter| study.varies(parameter))
    };
    let difference = |path: &String| {
        let setting = Parameter::find(path).map(Setting::Number);
        let value = |value: Option<&Value>| match (value, &setting) {
            (Some(Value::Number(number)), Some(setting)) => {
                short(number.as_f64().unwrap_or(f64::NAN) * setting.factor())
            }
            (Some(Value::String(word)), _) => shortened(word),
            (None | Some(Value::Null), _) => "–".to_owned(),
            (Some(other), _) => shortened(&other.to_string()),
        };
        let label = setting
            .as_ref()
            .map_or_else(|| path.clone(), Setting::label);
        Difference {
            path: path.clone(),
            label,
            values: leaves.iter().map(|each| value(each.get(path))).collect(),
        }
    };
    let mut differences: Vec<Difference> = paths
        .iter()
        .filter(differs)
        .filter(|path| !is_swept(path))
        .map(|path| difference(path))
        .collect();
    let place = |path: &str| {
        PARAMETERS
            .iter()
            .position(|parameter| parameter.path == path)
            .unwrap_or(PARAMETERS.len())
    };
    differences.sort_by_key(|each| place(&each.path));
    differences
}

/// Returns the values within nested objects, by dotted path.
fn leaves(value: &Value) -> BTreeMap<String, Value> {
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
