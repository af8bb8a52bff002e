//! Contents of an input file besides its cases: title, goal, defaults.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::input::document::Document;

/// Contents of an input file that are stored with results, so that they can be shown and judged
/// without it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statement {
    /// Name of the input file, for titles.
    pub title: String,
    /// Keys of `[goal]`, in their own units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal: Option<Map<String, Value>>,
    /// Defaults of each named tool, or those of the file.
    pub defaults: Vec<Defaults>,
}

/// Settings of a tool that come from defaults or from its material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Defaults {
    /// Paths of the settings that decide the force and are not stated.
    pub settings: Vec<String>,
    /// Name of the material that states some of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
}

impl Statement {
    /// Creates the statement of a file that is called `title`.
    #[must_use]
    pub fn of(document: &Document<'_>, title: &str) -> Self {
        let defaults = document.tool_names().map(|tool| Defaults {
            settings: document
                .unstated_of(tool)
                .into_iter()
                .map(|parameter| parameter.path.to_owned())
                .collect(),
            material: document
                .material_of(tool)
                .map(|material| material.name.to_owned()),
        });
        Self {
            title: title.to_owned(),
            goal: document.goal().cloned(),
            defaults: defaults.collect(),
        }
    }

    /// Returns the defaults of the tool at a position; none where nothing is known of them.
    #[must_use]
    pub fn defaults_of(&self, tool: usize) -> Defaults {
        self.defaults.get(tool).cloned().unwrap_or_default()
    }
}
