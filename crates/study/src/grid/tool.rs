//! Named tools: brushes with settings of their own, which a study compares.

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
pub struct StudyTool {
    /// Name of the tool.
    pub name: String,
    /// Settings of the tool. Swept settings have some value here.
    pub settings: Settings,
    /// Settings that state others in their own way in each case, and their values.
    pub held: Vec<(&'static Parameter, f64)>,
}

/// A tool in the form used in files.
#[derive(Clone, Serialize, Deserialize)]
pub struct ToolText<S = Settings> {
    /// Name of the tool.
    pub name: String,
    /// Settings of the tool.
    pub settings: S,
    /// Values of the held settings, by their paths.
    pub held: BTreeMap<String, f64>,
}

impl StudyTool {
    /// Creates a tool without a name, the only one of its study.
    pub(super) fn alone(settings: Settings) -> Self {
        Self {
            name: String::new(),
            settings,
            held: Vec::new(),
        }
    }

    /// Returns the form used in files.
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
    /// Returns the tool.
    ///
    /// # Errors
    /// The path of a held setting, if there is no such setting.
    pub fn tool(self) -> Result<StudyTool, String> {
        let held = self
            .held
            .into_iter()
            .map(|(path, value)| Ok((Parameter::find(&path).ok_or(path)?, value)));
        Ok(StudyTool {
            name: self.name,
            settings: self.settings,
            held: held.collect::<Result<_, String>>()?,
        })
    }
}

/// Returns `true` if a tool can have this name.
pub(super) fn is_name(name: &str) -> bool {
    let length = name.chars().count();
    name.starts_with(char::is_alphanumeric)
        && length <= LONGEST_NAME
        && name.trim_end() == name
        && !name.contains(is_invisible)
}

/// Returns `true` if two names would be mistaken for each other: in names of files they may be the
/// same.
pub(super) fn are_alike(name: &str, other: &str) -> bool {
    file_word(name).to_lowercase() == file_word(other).to_lowercase()
}
