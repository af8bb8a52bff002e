//! Named tools: brushes of which each has settings of its own, and which a study compares.

use std::collections::BTreeMap;

use crate::text::is_invisible;
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use serde::{Deserialize, Serialize};

use super::setting::file_word;

/// Longest name of a tool, in characters.
pub(crate) const LONGEST_NAME: usize = 40;

/// A tool that a study compares with others.
#[derive(Clone, Debug)]
pub struct Tool {
    /// Its name.
    pub name: String,
    /// Its settings. Those that the study sweeps have some value here.
    pub settings: Settings,
    /// The settings that state others in their own way, which do so in each case, and their values.
    pub held: Vec<(&'static Parameter, f64)>,
}

/// A tool in the form used in files.
#[derive(Clone, Serialize, Deserialize)]
pub struct ToolText<S = Settings> {
    /// Its name.
    pub name: String,
    /// Its settings.
    pub settings: S,
    /// The values of the settings that it holds, by their paths.
    pub held: BTreeMap<String, f64>,
}

impl Tool {
    /// A tool without a name, the only one of its study.
    pub(super) fn alone(settings: Settings) -> Self {
        Self {
            name: String::new(),
            settings,
            held: Vec::new(),
        }
    }

    /// The form used in files.
    pub fn text(&self) -> ToolText {
        let held = self
            .held
            .iter()
            .map(|(parameter, value)| (parameter.path.to_owned(), *value))
            .collect();
        ToolText {
            name: self.name.clone(),
            settings: self.settings.clone(),
            held,
        }
    }
}

impl ToolText {
    /// The tool.
    ///
    /// # Errors
    /// The path of a setting that it holds, if there is no such setting.
    pub fn tool(self) -> Result<Tool, String> {
        let held = self
            .held
            .into_iter()
            .map(|(path, value)| Ok((Parameter::find(&path).ok_or(path)?, value)));
        Ok(Tool {
            name: self.name,
            settings: self.settings,
            held: held.collect::<Result<_, String>>()?,
        })
    }
}

/// Whether a name can be that of a tool.
pub(super) fn is_name(name: &str) -> bool {
    let length = name.chars().count();
    name.starts_with(char::is_alphanumeric)
        && length <= LONGEST_NAME
        && name.trim_end() == name
        && !name.contains(is_invisible)
}

/// Whether two names would be mistaken for each other, and in names of files may be the same.
pub(super) fn are_alike(name: &str, other: &str) -> bool {
    file_word(name).to_lowercase() == file_word(other).to_lowercase()
}
