//! The grid of a study. Its points are the cases.
//!
//! Cases are numbered in the order of the grid and made from their numbers when needed. A large
//! study therefore needs no memory beyond its results.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::text::shown;
use bristle::brush::{BrushError, check_brush};
use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::{Hold, Settings};
use bristle::tool::Trim;
use parking_lot::Mutex;
use thiserror::Error;

use super::setting::{FORCE, SPEED, Setting, TOOL, TURNS, VELOCITY};
use super::sweep::{MAX_CASES, MAX_TOOLS, Sweep, SweepText};
use super::tool::{LONGEST_NAME, StudyTool, ToolText, are_alike, is_name};
use crate::grid::case::{CaseResult, tentative};
use crate::grid::uncertainty::{INPUTS, Input, MOVING, check};

/// Section of an input file whose sweeps make every case a brush.
pub const BRUSH: &str = "brush";

/// The reasons why sweeps do not form a study.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StudyError {
    /// Two sweeps name the same setting.
    #[error("`{0}` is swept twice")]
    SweptTwice(&'static str),
    /// Two sweeps name settings that state the same.
    #[error("`{path}` and `{other}` cannot both be given: each follows from the other")]
    BothSwept {
        /// Dotted path of the later sweep.
        path: &'static str,
        /// Dotted path of the other sweep.
        other: &'static str,
    },
    /// The grid has too many points.
    #[error("the study has more than {MAX_CASES} cases")]
    TooManyCases,
    /// The cases have too many sampled tools.
    #[error(
        "the study has more than {MAX_TOOLS} sampled tools: reduce the number of cases or uncertainty.samples"
    )]
    TooManyTools,
    /// Name that no tool can have.
    #[error(
        "a tool cannot be named `{}`: a name begins with a letter or digit, has at most {LONGEST_NAME} characters, and neither \
         control characters nor a space at its end",
        shown(.0, LONGEST_NAME)
    )]
    ToolName(String),
    /// Two tools whose names are mistaken for each other.
    #[error(
        "the tools `{name}` and `{other}` need names that differ by more than capitals and punctuation"
    )]
    ToolsAlike {
        /// Name of the later tool.
        name: String,
        /// Name of the other tool.
        other: String,
    },
    /// Only some tools have filaments that touch each other.
    #[error(
        "the filaments of the tool `{with}` touch each other, those of `{without}` do not: give both a section [brush], or none"
    )]
    SomeBrushes {
        /// Name of a tool with `[brush]`.
        with: String,
        /// Name of a tool without it.
        without: String,
    },
    /// The settings of one case contradict each other.
    #[error("case {} of the study{}: {violation}", .case + 1, of_tool(.tool.as_deref()))]
    Case {
        /// Number of the case, counted from 0.
        case: usize,
        /// Name of the tool, if tools are compared.
        tool: Option<String>,
        /// Contradiction in the settings.
        violation: Violation,
    },
}

fn of_tool(name: Option<&str>) -> String {
    name.map_or_else(String::new, |name| format!(" (tool {name})"))
}

/// A grid of settings.
#[derive(Clone, Debug)]
pub struct Study {
    /// Named tools; without names only one.
    tools: Vec<StudyTool>,
    /// Sweeps from the slowest to the fastest.
    sweeps: Vec<Sweep>,
    case_count: usize,
    checks: bool,
    /// Memory that the brushes of some cases need, by their numbers.
    needs: Arc<Mutex<BTreeMap<usize, Result<u64, BrushError>>>>,
}

impl Study {
    /// Returns the study with each case repeated more precisely ([`check`](crate::grid::check)). A
    /// case that was not repeated then has no result.
    #[must_use]
    pub fn checked(self) -> Self {
        Self {
            checks: true,
            ..self
        }
    }

    /// Returns `true` if each case is repeated more precisely.
    #[must_use]
    pub fn checks(&self) -> bool {
        self.checks
    }

    /// Makes a study of all combinations of the swept values, and checks each case.
    ///
    /// The velocity changes fastest, then the depth, then the other sweeps. The first of the other
    /// sweeps changes slowest.
    pub fn new(base: Settings, sweeps: Vec<Sweep>) -> Result<Self, StudyError> {
        Self::on(vec![StudyTool::alone(base)], sweeps)
    }

    /// Makes a study like [`Study::new`], of named tools with settings of their own. The tool
    /// changes slowest.
    ///
    /// # Panics
    /// If there is no tool.
    pub fn of_tools(tools: Vec<StudyTool>, mut sweeps: Vec<Sweep>) -> Result<Self, StudyError> {
        for (position, StudyTool { name, .. }) in tools.iter().enumerate() {
            if !is_name(name) {
                return Err(StudyError::ToolName(name.clone()));
            }
            if let Some(other) = tools[..position]
                .iter()
                .find(|other| are_alike(name, &other.name))
            {
                return Err(StudyError::ToolsAlike {
                    name: name.clone(),
                    other: other.name.clone(),
                });
            }
        }
        sweeps.push(Sweep::tools(
            tools.iter().map(|tool| tool.name.clone()).collect(),
        ));
        Self::on(tools, sweeps)
    }

    /// Makes a study of a list of cases, which need have nothing in common and have been
    /// [checked](check).
    ///
    /// # Panics
    /// If there is no case.
    #[must_use]
    pub fn of_cases(cases: Vec<Settings>) -> Self {
        assert!(!cases.is_empty(), "a study has at least one case");
        let tools: Vec<StudyTool> = cases.into_iter().map(StudyTool::alone).collect();
        Self {
            case_count: tools.len(),
            tools,
            sweeps: Vec::new(),
            checks: false,
            needs: Arc::default(),
        }
    }

    fn on(tools: Vec<StudyTool>, mut sweeps: Vec<Sweep>) -> Result<Self, StudyError> {
        sweeps.sort_by_key(Sweep::rank);
        let mut case_count = 1_usize;
        for (index, sweep) in sweeps.iter().enumerate() {
            let path = sweep.path();
            if sweeps[..index].iter().any(|other| other.path() == path) {
                return Err(StudyError::SweptTwice(path));
            }
            let states_same = |other: &&Sweep| {
                let parameter = sweep.setting().parameter();
                parameter.is_some_and(|parameter| {
                    parameter.group().any(|same| same.path == other.path())
                })
            };
            if let Some(other) = sweeps[..index].iter().find(states_same) {
                return Err(StudyError::BothSwept {
                    path,
                    other: other.path(),
                });
            }
            case_count = case_count
                .checked_mul(sweep.values().len())
                .filter(|&count| count <= MAX_CASES)
                .ok_or(StudyError::TooManyCases)?;
        }
        let study = Self {
            tools,
            sweeps,
            case_count,
            checks: false,
            needs: Arc::default(),
        };
        if study.has_brush()
            && !study
                .sweeps
                .iter()
                .any(|sweep| sweep.setting().section() == BRUSH)
        {
            let [with, without] = [true, false].map(|is_brush| {
                study
                    .tools
                    .iter()
                    .find(|tool| tool.settings.brush.is_some() == is_brush)
            });
            if let (Some(with), Some(without)) = (with, without) {
                return Err(StudyError::SomeBrushes {
                    with: with.name.clone(),
                    without: without.name.clone(),
                });
            }
        }
        if study.scatters() {
            let samples = |case| study.settings(case).uncertainty.samples;
            if (0..case_count).map(samples).sum::<usize>() > MAX_TOOLS {
                return Err(StudyError::TooManyTools);
            }
        }
        for case in 0..case_count {
            let settings = study.settings(case);
            let checked = study
                .check_presence(case, &settings)
                .and_then(|()| check(&settings));
            let tool = || study.tool(case).map(|tool| tool.name.clone());
            checked.map_err(|violation| StudyError::Case {
                case,
                tool: tool(),
                violation,
            })?;
        }
        Ok(study)
    }

    /// Checks that the `settings` of a case have the swept settings.
    fn check_presence(&self, case: usize, settings: &Settings) -> Result<(), Violation> {
        let numbers = self.sweeps.iter().zip(self.values(case));
        let mut numbers =
            numbers.filter_map(|(sweep, value)| Some((sweep.setting().parameter()?, value)));
        numbers.try_for_each(|(parameter, value)| parameter.check_presence(settings, value))
    }

    /// Returns the settings that all cases of the first or only tool share. Swept settings have
    /// some value here, usually their first.
    #[must_use]
    pub fn base(&self) -> &Settings {
        &self.tools[0].settings
    }

    /// Returns the named tools; none if the study does not compare tools.
    #[must_use]
    pub fn tools(&self) -> &[StudyTool] {
        if self
            .sweeps
            .first()
            .is_some_and(|sweep| sweep.path() == TOOL)
        {
            &self.tools
        } else {
            &[]
        }
    }

    /// Returns the names of the tools.
    #[must_use]
    pub fn tool_names(&self) -> Vec<String> {
        self.tools().iter().map(|tool| tool.name.clone()).collect()
    }

    /// Returns the named tool of a case, counted from 0; `None` if the study does not compare
    /// tools.
    #[must_use]
    pub fn tool(&self, case: usize) -> Option<&StudyTool> {
        self.tools().get(self.tool_of(case))
    }

    /// Returns the position of the tool of a case; zero if the study does not compare tools.
    #[must_use]
    pub fn tool_of(&self, case: usize) -> usize {
        case / (self.case_count / self.tools.len())
    }

    /// Returns `true` if another study has the same cases in the same order.
    #[must_use]
    pub fn has_cases_of(&self, other: &Self) -> bool {
        self.case_count == other.case_count
            && self.sweep_texts() == other.sweep_texts()
            && (0..self.case_count).all(|case| self.settings(case) == other.settings(case))
    }

    /// Returns the axes of the grid: the named tools, if there are any, and the swept settings,
    /// from the slowest to the fastest.
    #[must_use]
    pub fn sweeps(&self) -> &[Sweep] {
        &self.sweeps
    }

    /// Returns the axis of a setting.
    #[must_use]
    pub fn sweep(&self, path: &str) -> Option<&Sweep> {
        self.sweeps.iter().find(|sweep| sweep.path() == path)
    }

    /// Returns the sweeps of numbers in the form used in files.
    pub fn sweep_texts(&self) -> Vec<SweepText> {
        let numbers = self
            .sweeps
            .iter()
            .filter(|sweep| sweep.setting().parameter().is_some());
        numbers
            .map(|sweep| SweepText {
                setting: sweep.path().to_owned(),
                values: sweep.values().to_owned(),
            })
            .collect()
    }

    /// Returns the named tools in the form used in files.
    pub fn tool_texts(&self) -> Vec<ToolText> {
        self.tools().iter().map(StudyTool::text).collect()
    }

    /// Returns the number of cases, at least one.
    #[must_use]
    pub fn case_count(&self) -> usize {
        self.case_count
    }

    /// Returns the value of each sweep in one case, counted from 0.
    pub fn values(&self, case: usize) -> impl Iterator<Item = f64> + '_ {
        let mut stride = self.case_count;
        self.sweeps.iter().map(move |sweep| {
            stride /= sweep.values().len();
            sweep.values()[case / stride % sweep.values().len()]
        })
    }

    /// Returns `true` if tools are sampled in some case, because their filaments scatter or a
    /// calibration leaves uncertainty. Deviations from filament to filament of a brush do not count.
    #[must_use]
    pub fn scatters(&self) -> bool {
        let has_brush = self.has_brush();
        self.tools.iter().any(|StudyTool { settings, .. }| {
            let is_within = has_brush && settings.uncertainty.hold == Hold::Machine;
            let scatters = |input: &Input| match self.sweep(input.std) {
                Some(sweep) => sweep.values().iter().any(|&value| value > 0.0),
                None => input.scatters(settings),
            };
            settings.uncertainty.calibration.is_some()
                || (!is_within && INPUTS[..MOVING].iter().any(scatters))
        })
    }

    /// Returns `true` if the cases are brushes, whose filaments touch each other.
    #[must_use]
    pub fn has_brush(&self) -> bool {
        self.tools.iter().any(|tool| tool.settings.brush.is_some())
            || self
                .sweeps
                .iter()
                .any(|sweep| sweep.setting().section() == BRUSH)
    }

    /// Returns the memory in bytes that the brush of a case, counted from 0, needs at most. The
    /// first call for a case arranges the filaments.
    ///
    /// # Errors
    /// If there is no such brush.
    pub fn brush_memory(&self, case: usize) -> Result<u64, BrushError> {
        let needs = || self.needs.lock();
        let known = needs().get(&case).cloned();
        known.unwrap_or_else(|| {
            let needed = check_brush(&tentative(self.settings(case)), None);
            needs().insert(case, needed.clone());
            needed
        })
    }

    /// Returns `true` if the depth of some case follows from a force.
    #[must_use]
    pub fn is_pressed_on(&self) -> bool {
        self.sweep(FORCE).is_some()
            || self
                .tools
                .iter()
                .any(|tool| tool.settings.process.tool_force_n.is_some())
    }

    /// Returns `true` if some case has more than one turn.
    #[must_use]
    pub fn takes_turns(&self) -> bool {
        match self.sweep(TURNS) {
            Some(sweep) => sweep.values().iter().any(|&turns| turns > 1.0),
            // Filaments that touch during the whole turn take turns until they are steady.
            None => {
                self.tools
                    .iter()
                    .any(|tool| tool.settings.process.turns().at_most() > 1)
                    || self.may_touch_all_round()
            }
        }
    }

    /// Returns `true` if filaments may touch the workpiece during the whole turn: on tools that are
    /// tilted or whose filaments are not radial, or in bores narrower than the brush.
    fn may_touch_all_round(&self) -> bool {
        let swept = self
            .sweep("tool.tilt_rad")
            .or(self.sweep("tool.filament_angle_rad"))
            .is_some();
        let tilted = |settings: &Settings| {
            settings.process.turns.is_none()
                && (settings.tool.tilt_rad() != 0.0 || !Trim::of(settings).is_radial())
        };
        let narrow =
            |settings: Settings| settings.process.turns.is_none() && settings.tube().is_some();
        swept
            || self.tools.iter().any(|tool| tilted(&tool.settings))
            || self.each_tool_at_its_ends().any(narrow)
    }

    /// Returns all settings of one case, counted from 0.
    #[must_use]
    pub fn settings(&self, case: usize) -> Settings {
        let StudyTool { settings, held, .. } = &self.tools[self.tool_of(case)];
        let mut settings = settings.clone();
        let numbers = self.sweeps.iter().map(|sweep| sweep.setting().parameter());
        let values = numbers
            .zip(self.values(case))
            .filter_map(|(parameter, value)| Some((parameter?, value)));
        let (others, own): (Vec<_>, Vec<_>) =
            values.partition(|(parameter, _)| !parameter.instead_of.is_empty());
        // An alias follows from the other settings of this case.
        for (parameter, value) in own.into_iter().chain(held.iter().copied()).chain(others) {
            parameter.set(&mut settings, value);
        }
        settings.with_default_depth()
    }

    /// Returns the settings of each tool at the first and at the last values of all sweeps.
    pub(crate) fn each_tool_at_its_ends(&self) -> impl Iterator<Item = Settings> {
        self.tools.iter().flat_map(|tool| {
            [0, usize::MAX].map(|end| {
                let mut settings = tool.settings.clone();
                for sweep in &self.sweeps {
                    if let Some(parameter) = sweep.setting().parameter() {
                        parameter.set(
                            &mut settings,
                            sweep.values()[end.min(sweep.values().len() - 1)],
                        );
                    }
                }
                settings.with_default_depth()
            })
        })
    }

    /// Returns the settings of a case. If they state a force, the depth is the one that `result`
    /// has found or, where the case failed, the first one of the search.
    #[must_use]
    pub fn settings_found(&self, case: usize, result: &CaseResult) -> Settings {
        let settings = self.settings(case);
        match result {
            Ok(summary) if settings.process.tool_force_n.is_some() => {
                settings.at_depth(summary.metrics.penetration_depth_m)
            }
            _ => tentative(settings),
        }
    }

    /// Returns the setting by which the study states the speed of the tool: its rotational speed,
    /// or the velocity of the tips.
    #[must_use]
    pub fn speed(&self) -> &'static Parameter {
        let path = if self.sweep(SPEED).is_some() {
            SPEED
        } else {
            VELOCITY
        };
        Parameter::find(path).expect("the table has velocity and speed")
    }

    /// Returns the value of a setting in a case: that of its axis, or the one that follows from
    /// other settings.
    #[must_use]
    pub fn value(&self, setting: &Setting, case: usize) -> f64 {
        let swept = self
            .sweeps
            .iter()
            .position(|sweep| sweep.path() == setting.path());
        let stated = swept.and_then(|position| self.values(case).nth(position));
        let follows = || {
            setting
                .parameter()
                .map_or(0.0, |parameter| parameter.get(&self.settings(case)))
        };
        stated.unwrap_or_else(follows)
    }

    /// Returns `true` if a setting differs between cases of a tool, because it is swept or follows
    /// from a swept one.
    #[must_use]
    pub fn varies(&self, parameter: &Parameter) -> bool {
        let of_tool = self.case_count / self.tools.len();
        let mut stride = of_tool;
        self.sweeps
            .iter()
            .filter(|sweep| sweep.path() != TOOL)
            .any(|sweep| {
                let count = sweep.values().len();
                stride /= count;
                if sweep.path() == parameter.path {
                    return true;
                }
                let follows = parameter.group().count() > 1;
                let value = |first: usize, position: usize| {
                    parameter.get(&self.settings(first + position * stride))
                };
                let differs =
                    |first| (1..count).any(|position| value(first, position) != value(first, 0));
                follows && (0..self.tools.len()).any(|tool| differs(tool * of_tool))
            })
    }
}
