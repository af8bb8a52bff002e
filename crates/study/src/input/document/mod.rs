//! Reads an input file: TOML text in, checked [`Settings`] and [`Study`](crate::grid::Study) out.
//!
//! The TOML tree keeps the place of every key and value, so that each error can point at its cause.

mod assignments;
mod errors;
mod goal;
mod located;
mod meant;
mod measured;
mod settings;
mod study;
mod sweeps;
#[cfg(test)]
mod tests;
mod tools;
mod tree;
mod units;
mod workpiece;

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::grid::{BRUSH, DEPTH, SPEED, VELOCITY};
use crate::input::goal::GOAL;
use crate::input::input_error::{InputError, InputSource};
use crate::input::keys::{CONTROL_POINTS, FILAMENT, MATERIAL_KEY, STUDY, TOOLS, WORKPIECE};
use crate::input::materials::Material;
use crate::input::measured::TableFormat;
use crate::input::options;
use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::settings::Settings;
use serde_json::{Map, Value};

pub use meant::setting_meant;
pub use tree::Document;

use errors::not_toml;
use located::{LocatedMaterial, LocatedSweep, LocatedTool};
use settings::{Built, Override};
use tree::number_of;

/// Section that names measured forces. All other sections belong to [`Settings`].
const MEASURED: &str = "measured";
/// Values allowed for the path of a table.
const MEASURED_FILE: &str =
    "the path of a CSV file in quotes, relative to the directory of the input file";

/// Advice about two keys that follow from each other.
const FOLLOWS: &str = "give one of them: each follows from the other";

const FILAMENT_COUNT: &str = "tool.filament_count";

/// Key of a workpiece for a file of control points.
const CONTROL_POINTS_FILE: &str = "control_points_csv";

/// A brush as a file states it, without its process.
#[derive(Clone, Debug)]
pub struct StatedBrush {
    /// Name among the tools; empty if it is the only one.
    pub name: String,
    /// Settings with any velocity and depth.
    pub settings: Settings,
    /// Settings that state others in their own way, and their values.
    pub followed: Vec<(&'static Parameter, f64)>,
}

impl<'t> Document<'t> {
    /// Reads a file's text. Errors use `name` for the file.
    pub fn parse(text: &'t str, name: &'t str) -> Result<Self, InputError> {
        Self::parse_with(text, name, &[])
    }

    /// Reads a text like [`Document::parse`], with `options`, each `KEY=VALUE`, that state settings
    /// or sweeps as if the file did. Errors about these name the option `--set` as their place.
    pub fn parse_with(
        text: &'t str,
        name: &'t str,
        options: &'t [String],
    ) -> Result<Self, InputError> {
        let mut document = Self {
            source: InputSource {
                name,
                text,
                options,
            },
            ..Self::default()
        };
        document.study_span = document.end();
        let root = DeTable::parse(text).map_err(|error| {
            let span = error.span().unwrap_or(document.end());
            let unreadable = format!("not valid TOML: {}", error.message());
            let usual = match error.message() {
                "duplicate key" => "each section, key and name of a tool stands in the file once",
                _ => "an input file has sections like [filament] and lines like length_m = 0.040",
            };
            let (problem, advice) = not_toml(document.source.line(span.start), &unreadable, usual);
            document.error(None, problem, span, &advice)
        })?;
        document.table = root.into_inner();
        document.take_units()?;
        document.take_options()?;
        for (name, section) in &document.table {
            if !section.get_ref().is_table() {
                return Err(document.not_a_section(name, section));
            }
        }
        if let Some(study) = document.table.remove(STUDY) {
            document.study_span = study.span();
            if let DeValue::Table(mut entries) = study.into_inner() {
                let tools = entries.remove(TOOLS);
                document.sweeps = document.read_sweeps(&entries)?;
                document.tools =
                    tools.map_or(Ok(Vec::new()), |tools| document.read_tools(&tools))?;
            }
        }
        if let Some(measured) = document.table.remove(MEASURED)
            && let DeValue::Table(entries) = measured.get_ref()
        {
            let (file, format) = document.read_measured(entries, measured.span())?;
            let tools = document
                .tools
                .iter()
                .map(|tool| tool.name.clone())
                .collect();
            document.measured = Some((file, TableFormat { tools, ..format }));
        }
        if let Some(goal) = document.table.remove(GOAL)
            && let DeValue::Table(entries) = goal.get_ref()
        {
            document.goal = Some(document.read_goal(entries, goal.span())?);
        }
        document.control_points_file = document.take_control_points_file()?;
        document.material = document.take_material()?;
        Ok(document)
    }

    /// Returns the path of a table of control points as the file states it, relative to the file's
    /// directory.
    #[must_use]
    pub fn control_points_file(&self) -> Option<&str> {
        self.control_points_file
            .as_ref()
            .map(|(path, _)| path.as_str())
    }

    /// Sets the control points in m of the table that [`Document::control_points_file`] names.
    pub fn set_control_points(&mut self, points: Vec<[f64; 2]>) {
        self.control_points = points;
    }

    /// Takes the path of a table of control points out of the tree.
    fn take_control_points_file(&mut self) -> Result<Option<(String, Range<usize>)>, InputError> {
        let Some(value) = taken(&mut self.table, WORKPIECE, CONTROL_POINTS_FILE) else {
            return Ok(None);
        };
        if let DeValue::String(path) = value.get_ref()
            && !path.trim().is_empty()
            && find(&self.table, CONTROL_POINTS).is_none()
        {
            return Ok(Some((path.to_string(), value.span())));
        }
        let allowed = match find(&self.table, CONTROL_POINTS) {
            Some(_) => format!("left out, as `{CONTROL_POINTS}` states the points"),
            None => MEASURED_FILE.to_owned(),
        };
        let key = format!("{WORKPIECE}.{CONTROL_POINTS_FILE}");
        Err(self.not_allowed(&key, &value, allowed))
    }

    /// Takes the name of a material out of the tree.
    fn take_material(&mut self) -> Result<Option<LocatedMaterial>, InputError> {
        taken(&mut self.table, FILAMENT, MATERIAL_KEY)
            .map(|value| self.read_material(&value))
            .transpose()
    }

    /// Returns the material of the filaments, which states what the file does not.
    #[must_use]
    pub fn material(&self) -> Option<&'static Material> {
        self.material_of(None)
    }

    /// Returns the material of the filaments of a named tool, or without a name of those of the
    /// file.
    #[must_use]
    pub fn material_of(&self, tool: Option<&str>) -> Option<&'static Material> {
        self.located_material(self.named(tool))
            .map(|located| located.material)
    }

    fn located_material<'a>(
        &'a self,
        tool: Option<&'a LocatedTool<'_>>,
    ) -> Option<&'a LocatedMaterial> {
        tool.and_then(|tool| tool.material.as_ref())
            .or(self.material.as_ref())
    }

    fn named(&self, name: Option<&str>) -> Option<&LocatedTool<'t>> {
        self.tools
            .iter()
            .find(|tool| Some(tool.name.as_str()) == name)
    }

    /// Adds settings of the material that the tree does not state, at the place of the material's
    /// name.
    fn state_material<'a>(&'a self, table: &mut DeTable<'a>, tool: Option<&'a LocatedTool<'t>>) {
        let Some(LocatedMaterial { values, span, .. }) = self.located_material(tool) else {
            return;
        };
        for (parameter, text) in values {
            if find(table, parameter.path).is_none() {
                let spans = [span.clone(), span.clone()];
                options::state(table, [FILAMENT, parameter.key()], number_of(text), spans);
            }
        }
    }

    /// Returns the settings that the file states, regardless of its sweeps.
    pub fn settings(&self) -> Result<Settings, InputError> {
        let built = self.build(None, &[])?;
        Ok(built.settings.with_default_depth())
    }

    /// Returns `true` if the file sweeps settings, or compares tools.
    #[must_use]
    pub fn has_study(&self) -> bool {
        !self.sweeps.is_empty() || !self.tools.is_empty()
    }

    /// Returns the settings of the first case of the study, or those that the file states without
    /// one.
    pub fn first_settings(&self) -> Result<Settings, InputError> {
        if self.has_study() {
            Ok(self.study()?.settings(0))
        } else {
            self.settings()
        }
    }

    /// Returns the settings for evaluating a state without contact. The file need not state
    /// velocity, depth and number of filaments.
    pub fn settings_without_process(&self) -> Result<Settings, InputError> {
        let overrides = self.any_for(&[VELOCITY, DEPTH, FILAMENT_COUNT]);
        self.build(None, &overrides).map(|built| built.settings)
    }

    /// Returns values of settings that do not matter, where the file does not state them: any that
    /// pass the checks will do.
    fn any_for(&self, paths: &[&str]) -> Vec<Override<'static>> {
        let parameters = paths.iter().filter_map(|path| Parameter::find(path));
        let absent = parameters.filter(|parameter| stated(&self.table, parameter).next().is_none());
        let any = |parameter: &Parameter| {
            if parameter.path == DEPTH {
                "1e-300"
            } else {
                "1.0"
            }
        };
        absent
            .map(|parameter| Override {
                parameter,
                text: any(parameter),
                span: self.end(),
            })
            .collect()
    }

    /// Returns `true` if the file states the setting at a dotted path, regardless of its sweeps.
    #[must_use]
    pub fn states(&self, path: &str) -> bool {
        find(&self.table, path).is_some()
    }

    /// Returns the settings that decide the force and that the file leaves to their defaults,
    /// regardless of its sweeps.
    #[must_use]
    pub fn unstated(&self) -> Vec<&'static Parameter> {
        self.unstated_of(None)
    }

    /// Returns [`Document::unstated`] of a named tool, or without a name of the file.
    #[must_use]
    pub fn unstated_of(&self, tool: Option<&str>) -> Vec<&'static Parameter> {
        let tool = self.named(tool);
        let states = |path: &str| {
            let of_file = self.states(path) && !tool.is_some_and(|tool| tool.leaves_aside(path));
            of_file || tool.is_some_and(|tool| tool.states(path))
        };
        PARAMETERS
            .iter()
            .filter(|parameter| parameter.decides_force && !states(parameter.path))
            .collect()
    }

    /// Returns the path of the measured forces as the file states it, relative to the file's
    /// directory, and the format of their table.
    #[must_use]
    pub fn measured(&self) -> Option<(&str, &TableFormat)> {
        self.measured
            .as_ref()
            .map(|(file, format)| (file.as_str(), format))
    }

    /// Returns the goal of a study: the keys of `[goal]`, in their own units, with their values.
    #[must_use]
    pub fn goal(&self) -> Option<&Map<String, Value>> {
        self.goal.as_ref()
    }

    /// Returns the document with each filament alone. `[brush]` is checked and left out.
    ///
    /// # Errors
    /// The path of a sweep over a setting of `[brush]`.
    pub fn without_brush(mut self) -> Result<Self, &'static str> {
        self.is_alone = true;
        let of_brush = self
            .sweeps
            .iter()
            .find(|located| located.parameter.section() == BRUSH);
        of_brush
            .map(|located| located.parameter.path)
            .map_or(Ok(self), Err)
    }

    /// Returns the brushes that the file states, for a calibration: one, or each of the named
    /// tools. Velocity and depth have any value.
    ///
    /// # Errors
    /// If the study sweeps another setting, whose value is then unknown.
    pub fn brushes(&self) -> Result<Vec<StatedBrush>, InputError> {
        const MEASURED_AT: [&str; 3] = [VELOCITY, SPEED, DEPTH];
        let is_unknown = |sweep: &&LocatedSweep| !MEASURED_AT.contains(&sweep.parameter.path);
        if let Some(LocatedSweep {
            parameter,
            span,
            sweep,
        }) = self.sweeps.iter().find(is_unknown)
        {
            let value = format!("swept over {} values", sweep.values().len());
            let allowed =
                "one value in its own section: a calibration has one brush, or named tools";
            return Err(self.refused(parameter.path, value, allowed, span.clone(), ""));
        }
        let overrides = self.any_for(&[VELOCITY, DEPTH]);
        let brush = |tool: Option<&LocatedTool<'t>>| {
            let Built {
                settings, followed, ..
            } = self.build(tool, &overrides)?;
            let followed = followed
                .into_iter()
                .filter(|(parameter, _)| !MEASURED_AT.contains(&parameter.path));
            let name = tool.map_or_else(String::new, |tool| tool.name.clone());
            Ok(StatedBrush {
                name,
                settings,
                followed: followed.collect(),
            })
        };
        self.each_tool().map(brush).collect()
    }

    /// Returns the name of each named tool; `None` once if the file names none.
    pub fn tool_names(&self) -> impl Iterator<Item = Option<&str>> {
        self.each_tool()
            .map(|tool| tool.map(|tool| tool.name.as_str()))
    }

    /// Returns each named tool; `None` once if the file names none.
    fn each_tool(&self) -> impl Iterator<Item = Option<&LocatedTool<'t>>> {
        let alone = self.tools.is_empty().then_some(None);
        self.tools.iter().map(Some).chain(alone)
    }
}

/// Takes the value of a key of a section out of a tree.
fn taken<'t>(table: &mut DeTable<'t>, section: &str, key: &str) -> Option<Spanned<DeValue<'t>>> {
    let DeValue::Table(entries) = table.get_mut(section)?.get_mut() else {
        return None;
    };
    entries.remove(key)
}

/// Returns the value at a dotted path.
fn find<'a, 't>(table: &'a DeTable<'t>, path: &str) -> Option<&'a Spanned<DeValue<'t>>> {
    let (section, key) = path.split_once('.')?;
    table.get(section)?.get_ref().as_table()?.get(key)
}

/// Returns the settings of the tree that state the same as `parameter`, itself included.
fn stated(table: &DeTable<'_>, parameter: &Parameter) -> impl Iterator<Item = &'static Parameter> {
    parameter
        .group()
        .filter(|same| find(table, same.path).is_some())
}

/// Returns the place of the value at a dotted path, or otherwise of its section's heading.
fn place(table: &DeTable<'_>, path: &str) -> Option<Range<usize>> {
    let heading = || table.get(path.split_once('.')?.0);
    find(table, path).or_else(heading).map(Spanned::span)
}
