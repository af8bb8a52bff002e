//! The study of an input file, with the places of errors about its cases.

use bristle::model::parameters::Parameter;

use super::located::{LocatedSweep, LocatedTool};
use super::settings::{Built, Override};
use super::{Document, place};
use crate::grid::{Study, StudyError, StudyTool, Sweep};
use crate::input::input_error::InputError;
use crate::input::keys::STUDY;

impl Document<'_> {
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
}
