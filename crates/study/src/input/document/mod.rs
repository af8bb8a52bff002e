//! Reads an input file: TOML text in, checked [`Settings`] and [`Study`] out.
//!
//! The TOML tree keeps the place of every key and value, so that each error can point at its cause.

mod located;
mod meant;
#[cfg(test)]
mod tests;
mod tools;
mod tree;
mod units;
mod workpiece;

use std::borrow::Cow;
use std::ops::Range;

use crate::text::{shortened, shown};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::grid::uncertainty::check;
use crate::grid::{
    BRUSH, DEPTH, SHORT_NAMES, SPEED, Study, StudyError, StudyTool, Sweep, TOOL, VELOCITY,
};
use crate::input::cells::{DECIMALS, SEPARATORS};
use crate::input::goal::{GOAL, MOST, MOST_OF, NUMBERS, allowed, largest};
use crate::input::input_error::{InputError, InputSource, LONGEST_KEY, LONGEST_MESSAGE};
use crate::input::keys::{CONTROL_POINTS, FILAMENT, MATERIAL_KEY, STUDY, TOOLS, WORKPIECE};
use crate::input::materials::{CONTACT_STIFFNESS, Material, default_contact_stiffness};
use crate::input::measured::{ColumnName, Quantity, TableFormat};
use crate::input::mistakes::{Mistake, value_mistake};
use crate::input::options::{self, Assignment};
use crate::text::units::own_keys;
use bristle::model::parameters::{PARAMETERS, Parameter, Violation};
use bristle::model::settings::Settings;
use serde_json::{Map, Value};

pub use meant::setting_meant;
pub use tree::Document;

use located::{LocatedMaterial, LocatedSweep, LocatedTool};
use meant::{did_you_mean, is_section};
use tree::{OtherUnit, number_of, read};
use units::ONE_UNIT;
use workpiece::{FEED, KIND};

/// Section that names measured forces. All other sections belong to [`Settings`].
const MEASURED: &str = "measured";
const REMOVAL: &str = "removal";
/// Section of velocity and depth, which a study may sweep instead.
const PROCESS: &str = "process";
/// Beginning of serde's message about a key without a default.
const MISSING: &str = "missing field ";
/// Keys of `[measured]`.
const FILE: &str = "file";
const SEPARATOR: &str = "separator";
const DECIMAL: &str = "decimal";
const COLUMNS: &str = "columns";
const RELATIVE_STD: &str = "relative_std";
/// Values allowed for the path of a table.
const MEASURED_FILE: &str =
    "the path of a CSV file in quotes, relative to the directory of the input file";

/// Advice about two keys that follow from each other.
const FOLLOWS: &str = "give one of them: each follows from the other";

const FILAMENT_COUNT: &str = "tool.filament_count";

/// Key of a workpiece for a file of control points.
const CONTROL_POINTS_FILE: &str = "control_points_csv";

/// Values allowed for an entry of `[study]`.
const SWEEP: &str = "a list of numbers, or { start = …, stop = …, step = … }";

/// A value that replaces the one in the file.
struct Override<'a> {
    parameter: &'static Parameter,
    /// Value as TOML.
    text: &'a str,
    /// Place to which an error about the value points.
    span: Range<usize>,
}

/// Settings that have been read and checked.
struct Built<'a> {
    settings: Settings,
    /// Tree, with the place of each setting.
    table: DeTable<'a>,
    /// Settings that the file states in another way, and their values.
    followed: Vec<(&'static Parameter, f64)>,
}

/// The long form of a sweep.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a list or a range")]
struct SweepRange {
    start: f64,
    stop: f64,
    step: f64,
}

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

    /// Puts the settings of the options into the tree.
    fn take_options(&mut self) -> Result<(), InputError> {
        for number in 0..self.source.options.len() {
            let start = self.source.start_of_option(number);
            let option = &self.source.options[number];
            let there = |span: &Range<usize>| start + span.start..start + span.end;
            let Some(assignment) =
                Assignment::of(option).filter(|assignment| assignment.is_whole())
            else {
                let problem = cannot_be_read("an option needs a key and a value");
                let advice = "as in --set process.rotational_speed_rpm=1200";
                return Err(self.error(None, problem, there(&(0..option.len())), advice));
            };
            let Assignment {
                section,
                key,
                unit,
                key_span,
                value_span,
                ..
            } = &assignment;
            if section.is_empty() {
                let expected = "a section and a key, as in process.rotational_speed_rpm";
                let advice = PARAMETERS.iter().find(|parameter| parameter.section() == *key).map_or_else(
                    || setting_meant(key),
                    |first| format!("state a key of [{key}], as in --set {}=…, or the section in the file", first.path),
                );
                return Err(self.unknown(key, expected, there(key_span), &advice));
            }
            let value = assignment.parsed().map_err(|error| {
                let (problem, advice) = not_toml(
                    option,
                    &format!("not a TOML value: {}", error.message()),
                    "",
                );
                self.error(None, problem, there(value_span), &advice)
            })?;
            // The same key again replaces the earlier one; the same setting by another key does
            // not.
            let group = Parameter::find(&assignment.path())
                .into_iter()
                .flat_map(Parameter::group);
            let paths: Vec<String> = group
                .map(|same| same.path.to_owned())
                .chain([assignment.path()])
                .collect();
            let is_other = |other: &Assignment<'_>| {
                paths.contains(&other.path()) && other.written_path() != assignment.written_path()
            };
            let mut earlier = self.source.options[..number]
                .iter()
                .filter_map(|option| Assignment::of(option));
            if let Some(other) = earlier.find(is_other) {
                let [key, other_key] = [&assignment, &other].map(Assignment::written_path);
                let advice = if other.path() == assignment.path() {
                    ONE_UNIT
                } else {
                    FOLLOWS
                };
                return Err(self.both(&key, &other_key, there(key_span), advice));
            }
            let spans = [there(key_span), there(value_span)];
            if let Some(unit) = unit {
                let value = Spanned::new(spans[1].clone(), value.clone());
                let other = OtherUnit::new(key, assignment.written, unit, &value);
                self.other_units.insert(spans[0].start, other);
            }
            match assignment.tool() {
                None => options::state(&mut self.table, [section, key], value, spans),
                Some(tool) => {
                    options::state_of_tool(&mut self.table, [STUDY, TOOLS], tool, value, spans)
                }
            }
        }
        Ok(())
    }

    /// Checks that no option states a setting that the study sweeps, or that each tool states.
    fn check_options(&self) -> Result<(), InputError> {
        for (number, option) in self.source.options.iter().enumerate() {
            let Some(assignment) = Assignment::of(option) else {
                continue;
            };
            let Some(parameter) = Parameter::find(&assignment.path()) else {
                continue;
            };
            let start = self.source.start_of_option(number);
            let place = start + assignment.key_span.start..start + assignment.key_span.end;
            if let Some(swept) = parameter.group().find(|same| self.sweeps(same)) {
                let advice = format!(
                    "sweep other values, as in --set 'study.{}=[…]'",
                    parameter.path
                );
                return Err(self.swept(parameter.path, swept, place, &advice));
            }
            if let Some(first) = self.tools.first()
                && self
                    .tools
                    .iter()
                    .all(|tool| parameter.group().any(|same| tool.states(same.path)))
            {
                let what = "has no effect, because each tool of the study states it";
                let advice = format!(
                    "state it of a tool, as in --set study.tools.\"{}\".{}=…",
                    first.name, parameter.path
                );
                return Err(self.about(parameter.path, what, place, &advice));
            }
        }
        Ok(())
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

    /// Returns the study that the file states. All its cases are checked.
    pub fn study(&self) -> Result<Study, InputError> {
        if !self.has_study() {
            let allowed = "a section that sweeps at least one setting, or names tools";
            let advice = "add, for example, `[study]` and under it `brushing_velocity_m_s = [5.0, 10.0, 20.0]`";
            return Err(self.absent(STUDY, allowed, self.study_span.clone(), advice));
        }
        self.check_options()?;
        // The first value of each sweep fills in the settings that the file leaves to the study.
        let first = |LocatedSweep {
                         parameter, sweep, ..
                     }: &LocatedSweep| parameter.format(sweep.values()[0]);
        let first_values: Vec<String> = self.sweeps.iter().map(first).collect();
        let replaced = self.sweeps.iter().zip(&first_values);
        let overrides: Vec<Override<'_>> = replaced
            .map(
                |(
                    LocatedSweep {
                        parameter, span, ..
                    },
                    text,
                )| Override {
                    parameter,
                    text,
                    span: span.clone(),
                },
            )
            .collect();
        let built = self
            .each_tool()
            .map(|tool| self.build(tool, &overrides))
            .collect::<Result<Vec<_>, _>>()?;
        let mut sweeps: Vec<Sweep> = self
            .sweeps
            .iter()
            .map(|located| located.sweep.clone())
            .collect();
        // Settings that follow from others do so in each case. Those that all tools state alike
        // become an axis of one value.
        let held = |built: &Built<'_>| -> Vec<_> {
            built
                .followed
                .iter()
                .copied()
                .filter(|(parameter, _)| !self.sweeps(parameter))
                .collect()
        };
        let is_common = |&(parameter, value): &(&'static Parameter, f64)| {
            let is_same = |(other, own): &(&'static Parameter, f64)| {
                std::ptr::eq(*other, parameter) && *own == value
            };
            built.iter().all(|built| built.followed.iter().any(is_same))
        };
        let common = held(&built[0]).into_iter().filter(is_common);
        sweeps.extend(
            common.filter_map(|(parameter, value)| Sweep::list(parameter, vec![value]).ok()),
        );
        let tool = |(located, built): (&LocatedTool<'_>, &Built<'_>)| StudyTool {
            name: located.name.clone(),
            settings: built.settings.clone(),
            held: held(built)
                .into_iter()
                .filter(|each| !is_common(each))
                .collect(),
        };
        let tools: Vec<StudyTool> = self.tools.iter().zip(&built).map(tool).collect();
        let study = if tools.is_empty() {
            Study::new(built[0].settings.clone(), sweeps)
        } else {
            Study::of_tools(tools, sweeps)
        };
        study.map_err(|error| {
            let (key, span) = match &error {
                StudyError::SweptTwice(path) | StudyError::BothSwept { path, .. } => {
                    (Some(*path), place(&built[0].table, path))
                }
                StudyError::Case {
                    tool, violation, ..
                } => {
                    let number = self
                        .tools
                        .iter()
                        .position(|located| Some(&located.name) == tool.as_ref());
                    let table = &built[number.unwrap_or(0)].table;
                    (Some(violation.path), place(table, violation.path))
                }
                StudyError::ToolName(name)
                | StudyError::ToolsAlike { name, .. }
                | StudyError::SomeBrushes { with: name, .. } => {
                    let tool = self.named(Some(name));
                    (Some("study.tools"), tool.map(|tool| tool.span.clone()))
                }
                StudyError::TooManyCases | StudyError::TooManyTools => (None, None),
            };
            let span = span.unwrap_or(self.study_span.clone());
            self.error(key, error.to_string(), span, "")
        })
    }

    /// Reads and checks the settings, those of a named tool if there is one, with some values
    /// replaced.
    fn build<'a>(
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
    fn violated(&self, table: &DeTable<'_>, violation: Violation) -> InputError {
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

    /// Reads the entries of `[study]` in the order of the file.
    fn read_sweeps(&self, entries: &DeTable<'_>) -> Result<Vec<LocatedSweep>, InputError> {
        let mut entries: Vec<_> = entries.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
            .into_iter()
            .map(|(key, value)| self.read_sweep(key, value))
            .collect()
    }

    /// Reads the entries of `[measured]`, whose heading is at `span`.
    fn read_measured(
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

    /// Reads the entries of `[goal]`, whose heading is at `span`.
    fn read_goal(
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

    /// Checks that a table of the file, which `path` names, has no other keys than these.
    fn check_keys(
        &self,
        path: &str,
        entries: &DeTable<'_>,
        keys: &[&str],
    ) -> Result<(), InputError> {
        let unknown = entries
            .iter()
            .find(|(key, _)| !keys.contains(&key.get_ref().as_ref()));
        unknown.map_or(Ok(()), |(key, _)| Err(self.unknown_key(path, key, keys)))
    }

    /// Returns the error about a key of a table, which `path` names, that is none of `keys`.
    fn unknown_key(&self, path: &str, key: &Spanned<Cow<'_, str>>, keys: &[&str]) -> InputError {
        let name = key.get_ref();
        let expected = keys
            .iter()
            .map(|key| format!("`{key}`"))
            .collect::<Vec<_>>()
            .join(", ");
        let advice = did_you_mean(name, keys.iter().copied());
        self.unknown(&format!("{path}.{name}"), expected, key.span(), &advice)
    }

    fn read_sweep(
        &self,
        key: &Spanned<Cow<'_, str>>,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<LocatedSweep, InputError> {
        let mut value = value.clone();
        if let Some(other) = self.other_units.get(&key.span().start) {
            other.convert(&mut value);
        }
        let name = key.get_ref().as_ref();
        let path = SHORT_NAMES
            .into_iter()
            .find_map(|(short, path)| (short == name).then_some(path))
            .unwrap_or(name);
        let study_key = format!("{STUDY}.{name}");
        let Some(parameter) = Parameter::find(path) else {
            let expected = "the path of a scalar setting in quotes, such as \"filament.segments\"";
            return Err(self.unknown(&study_key, expected, key.span(), &setting_meant(name)));
        };
        let unreadable = |error: toml::de::Error| {
            let span = error.span().unwrap_or(value.span());
            let allowed = format!("{SWEEP} ({})", shown(error.message(), LONGEST_MESSAGE));
            let found = self.source.quote(value.span());
            self.refused(&study_key, found, allowed, span, "")
        };
        let sweep = if value.get_ref().is_array() {
            Sweep::list(parameter, read(&value).map_err(unreadable)?)
        } else {
            let SweepRange { start, stop, step } = read(&value).map_err(unreadable)?;
            Sweep::range(parameter, start, stop, step)
        };
        let located = |sweep| LocatedSweep {
            parameter,
            sweep,
            span: value.span(),
        };
        sweep.map(located).map_err(|error| {
            let span = match (error.index, value.get_ref()) {
                (Some(index), DeValue::Array(items)) => items[index].span(),
                _ => value.span(),
            };
            let key = self.written(&study_key, &span);
            let problem = format!("`{}`: {error}", shown(&key, LONGEST_KEY));
            self.error(Some(&key), problem, span, "")
        })
    }

    /// Returns the error about a top-level entry that is not a section.
    fn not_a_section(
        &self,
        name: &Spanned<Cow<'_, str>>,
        value: &Spanned<DeValue<'_>>,
    ) -> InputError {
        let key = name.get_ref().as_ref();
        if is_section(key) || key == STUDY || key == MEASURED || key == GOAL {
            let allowed = format!("a section that starts with a line [{key}]");
            self.not_allowed(key, value, allowed)
        } else {
            let advice = "put it under the heading of its section, such as [filament]";
            let expected = "a section at the top level of the file";
            self.unknown(key, expected, name.span(), advice)
        }
    }

    /// Returns the error about a tree that cannot become settings: an unknown key, a value of the
    /// wrong type, or a missing key.
    fn unreadable(&self, table: &DeTable<'_>, error: &toml::de::Error) -> InputError {
        // An error without a place is about the file as a whole.
        let Some(span) = error.span() else {
            return self.error(None, cannot_be_read(error.message()), self.end(), "");
        };
        let unknown = |key: String, advice: String| {
            let message = error.message();
            // The key comes first, and may be anything.
            let expected = message
                .rsplit_once(", expected ")
                .map_or(message, |(_, expected)| expected);
            let section = key.split_once('.').map_or("", |(section, _)| section);
            // Keys that state others in their own way are no fields of the settings.
            let is_other = |parameter: &&Parameter| {
                !parameter.instead_of.is_empty() && parameter.section() == section
            };
            let others = PARAMETERS
                .iter()
                .filter(is_other)
                .map(|parameter| format!("`{}`", parameter.key()))
                .filter(|key| !expected.contains(key))
                .map(|key| format!(", {key}"));
            let material = if section == FILAMENT {
                format!(", `{MATERIAL_KEY}`")
            } else {
                String::new()
            };
            let expected =
                shown(expected, LONGEST_MESSAGE) + &others.collect::<String>() + &material;
            // The keys of a kind of workpiece are those of a structure of their own.
            let expected = match expected.strip_prefix("one of ").unwrap_or(&expected) {
                own if section == WORKPIECE && message.starts_with("unknown field") => {
                    format!("one of `{KIND}`, `{FEED}`, {own}")
                }
                _ => expected,
            };
            self.unknown(&key, expected, span.clone(), &advice)
        };
        for (name, section) in table {
            let name_span = name.span();
            let name = name.get_ref().as_ref();
            if !is_section(name) && name_span == span {
                let sections = PARAMETERS.iter().map(Parameter::section);
                return unknown(name.to_owned(), did_you_mean(name, sections));
            }
            for (key, value) in section.get_ref().as_table().into_iter().flatten() {
                let path = format!("{name}.{}", key.get_ref());
                if key.span() == span {
                    let advice = setting_meant(&path);
                    return unknown(path, advice);
                }
                if value.span().start <= span.start && span.end <= value.span().end {
                    let allowed = Parameter::find(&path)
                        .map_or_else(|| allowed_by(error.message()), Parameter::allowed);
                    let advice = text_mistake(&self.written(&path, &span), value.get_ref());
                    let found = self.source.quote(value.span());
                    return self.refused(&path, found, allowed, span, &advice);
                }
            }
        }
        self.error(None, cannot_be_read(error.message()), span, "")
    }

    /// Returns the error about required keys that are missing: whole sections first, otherwise the
    /// keys of one section. `None` if no key is missing.
    fn missing(&self, table: &DeTable<'_>) -> Option<InputError> {
        let missing: Vec<&'static Parameter> = PARAMETERS
            .iter()
            .filter(|parameter| parameter.required && stated(table, parameter).next().is_none())
            .collect();
        let first = *missing.first()?;
        let mut sections: Vec<&'static str> = missing
            .iter()
            .map(|parameter| parameter.section())
            .collect();
        sections.dedup();
        sections.retain(|section| !self.table.contains_key(*section));
        let place = if sections.is_empty() {
            format!("under [{}]", first.section())
        } else {
            "at the end of the file".to_owned()
        };
        let is_named = |section: &str| {
            if sections.is_empty() {
                section == first.section()
            } else {
                sections.contains(&section)
            }
        };
        let named = || {
            missing
                .iter()
                .filter(|parameter| is_named(parameter.section()))
        };
        let mut advice = format!("add {place}, with your values:\n");
        let example = Settings::paper(10.0, 1e-3);
        let mut section = if sections.is_empty() {
            first.section()
        } else {
            ""
        };
        for parameter in named() {
            if parameter.section() != section {
                section = parameter.section();
                advice.push_str(&format!("\n     [{section}]"));
            }
            let line = format!(
                "{} = {}",
                parameter.key(),
                parameter.format(parameter.get(&example))
            );
            let unit = if parameter.unit.is_empty() {
                String::new()
            } else {
                format!(" in {}", parameter.unit)
            };
            advice.push_str(&format!("\n     {line:30}  # {}{unit}", parameter.name));
        }
        for parameter in named() {
            let others: Vec<String> = parameter
                .group()
                .skip(1)
                .map(|other| format!("`{}`", other.key()))
                .collect();
            if !others.is_empty() {
                advice.push_str(&format!(
                    "\n\n     Instead of `{}`: {}.",
                    parameter.key(),
                    others.join(" or ")
                ));
            }
        }
        if named().any(|parameter| parameter.section() == PROCESS) {
            advice.push_str("\n\n     What [study] sweeps may be left out for `bristle study`.");
        }
        let names: Vec<String> = sections
            .iter()
            .map(|section| format!("[{section}]"))
            .collect();
        let problem = match names.split_last() {
            None => {
                let span = self.table[first.section()].span();
                return Some(self.absent(first.path, first.allowed(), span, &advice));
            }
            Some((last, [])) => format!("the section {last} is missing"),
            Some((last, others)) => {
                format!("the sections {} and {last} are missing", others.join(", "))
            }
        };
        Some(self.error(sections.first().copied(), problem, self.end(), &advice))
    }
}

/// Returns the problem of a text that is not TOML, or cannot be interpreted.
fn cannot_be_read(message: &str) -> String {
    format!("cannot be read: {}", shown(message, LONGEST_MESSAGE))
}

/// Returns a text that says something, without the space around it.
fn text_of(value: &Spanned<DeValue<'_>>) -> Option<String> {
    let text = value.get_ref().as_str().map(str::trim);
    text.filter(|text| !text.is_empty()).map(str::to_owned)
}

/// Returns the problem of a `line` that is not TOML, and advice: `message` and `usual` unless the
/// mistake is a usual one.
fn not_toml(line: &str, message: &str, usual: &str) -> (String, String) {
    match value_mistake(line) {
        Some(Mistake { what, instead }) => (what, instead),
        None => (cannot_be_read(message), usual.to_owned()),
    }
}

/// Returns advice about a text in the place of a number at a key; empty if there is none.
fn text_mistake(key: &str, value: &DeValue<'_>) -> String {
    let text = value.as_str().filter(|text| {
        text.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first))
    });
    text.map_or_else(String::new, |text| {
        let quotes = || match text.parse::<f64>() {
            Ok(_) => format!("write the number without quotes: {}", shortened(text)),
            Err(_) => "write the number without quotes".to_owned(),
        };
        value_mistake(&format!("{key} = {text}")).map_or_else(quotes, |mistake| mistake.instead)
    })
}

/// Returns the values allowed where the parser has refused one that belongs to no scalar setting.
fn allowed_by(message: &str) -> String {
    let kinds = message
        .strip_prefix("unknown variant ")
        .and_then(|message| message.rsplit_once(", expected "));
    kinds.map_or_else(
        || format!("of another type ({})", shown(message, LONGEST_MESSAGE)),
        |(_, kinds)| kinds.to_owned(),
    )
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

/// Returns the place of the value at a dotted path, or otherwise of its section's heading.
fn place(table: &DeTable<'_>, path: &str) -> Option<Range<usize>> {
    let heading = || table.get(path.split_once('.')?.0);
    find(table, path).or_else(heading).map(Spanned::span)
}

/// Advice on a setting whose `value` is not only refused but outside of what brushes usually have.
fn likely_slip(path: &str, value: &str) -> Option<String> {
    let usual = Parameter::find(path)?.usual?;
    let value: f64 = value.parse().ok()?;
    let is_usual = (usual.least..=usual.largest).contains(&value);
    (!is_usual).then(|| format!("a likely slip: {}", usual.slip))
}
