//! A tool of a joined study, with its values of settings and its measured forces.

use bristle::model::parameters::Parameter;
use bristle_study::text::shown;

use crate::insight::joined::{MAX_NAME_CHARS, NamedStudy};
use bristle_study::grid::{CaseResult, Setting, Study, StudyTool, Sweep, TOOL};
use bristle_study::input::measured::{Measurement, Quantity, Speed, same};

/// A tool of one of the studies.
pub(super) struct JoinedTool<'a> {
    /// Name of the tool in the joined study.
    pub name: String,
    pub study: &'a Study,
    pub results: &'a [CaseResult],
    pub measured: &'a [Measurement],
    /// Position among the tools of its study.
    position: usize,
    /// Number of its first case, and of its cases.
    pub first: usize,
    count: usize,
}

/// Values of a setting along an axis of a part.
pub(super) struct Values {
    /// Values in SI units.
    pub values: Vec<f64>,
    /// Increment of the case number per step along the axis; zero for a single value.
    pub stride: usize,
}

impl Values {
    pub fn position(&self, value: f64) -> Option<usize> {
        self.values.iter().position(|own| same(*own, value))
    }
}

/// An axis that all parts have.
pub(super) struct SharedAxis {
    pub parameter: &'static Parameter,
    /// The common values, in the order of the first part.
    pub values: Vec<f64>,
    /// Values of each part.
    pub of_parts: Vec<Values>,
}

impl<'a> JoinedTool<'a> {
    /// Returns the tools of a study.
    pub fn all(
        NamedStudy {
            name,
            saved,
            results,
            measured,
        }: &'a NamedStudy,
    ) -> Vec<Self> {
        let study = &saved.study;
        let tools = study.tools();
        let count = study.case_count() / tools.len().max(1);
        let part = |name: String, position: usize| {
            let first = position * count;
            Self {
                name,
                study,
                results,
                measured,
                position,
                first,
                count,
            }
        };
        match tools {
            [] => vec![part(name.clone(), 0)],
            _ => tools
                .iter()
                .enumerate()
                .map(|(at, tool)| part(format!("{name}: {}", tool.name), at))
                .collect(),
        }
    }

    /// Returns the swept numbers, each with the increment of the case number per step.
    pub fn axes(&self) -> impl Iterator<Item = (&'a Sweep, usize)> {
        let mut stride = self.count;
        self.study
            .sweeps()
            .iter()
            .filter(|sweep| sweep.path() != TOOL)
            .map(move |sweep| {
                stride /= sweep.values().len();
                (sweep, stride)
            })
    }

    /// Returns the values of a setting: those of its axis, those derived from another axis alone,
    /// or the only one. `None` if it depends on several axes.
    pub fn values(&self, parameter: &'static Parameter) -> Option<Values> {
        let own = self
            .axes()
            .find(|(sweep, _)| sweep.path() == parameter.path);
        if let Some((sweep, stride)) = own {
            return Some(Values {
                values: sweep.values().to_vec(),
                stride,
            });
        }
        let value = |case: usize| parameter.get(&self.study.settings(self.first + case));
        let twin = self
            .axes()
            .find(|(sweep, _)| parameter.group().any(|same| same.path == sweep.path()));
        let (count, stride) = twin.map_or((1, 0), |(sweep, stride)| (sweep.values().len(), stride));
        let values: Vec<f64> = (0..count)
            .map(|position| value(position * stride))
            .collect();
        let position = |case: usize| case.checked_div(stride).map_or(0, |steps| steps % count);
        let follows_alone = (0..self.count).all(|case| same(value(case), values[position(case)]));
        follows_alone.then_some(Values { values, stride })
    }

    /// Returns the tool in the joined study. It holds derived settings with a single value, unless
    /// `shared` axes state them.
    pub fn tool(&self, shared: &[SharedAxis]) -> StudyTool {
        let is_shared = |parameter: &Parameter| {
            shared.iter().any(|axis| {
                axis.parameter
                    .group()
                    .any(|same| same.path == parameter.path)
            })
        };
        let follows = |parameter: &&'static Parameter| !parameter.instead_of.is_empty();
        let swept = self.axes().filter(|(sweep, _)| sweep.values().len() == 1);
        let swept = swept.filter_map(|(sweep, _)| {
            Some((
                sweep.setting().parameter().filter(follows)?,
                sweep.values()[0],
            ))
        });
        let held = self
            .study
            .tool(self.first)
            .into_iter()
            .flat_map(|tool| tool.held.iter().copied());
        let held = held
            .chain(swept)
            .filter(|(parameter, _)| !is_shared(parameter))
            .collect();
        StudyTool {
            name: self.name.clone(),
            settings: self.study.settings(self.first),
            held,
        }
    }

    /// Returns the forces measured with this tool as forces of the tool `number`. Their speeds are
    /// stated by the quantity `kind`.
    pub fn measured(&self, number: usize, kind: Quantity) -> impl Iterator<Item = Measurement> {
        let settings = self.study.settings(self.first);
        let of_kind = move |speed: Speed| speed.stated_by(kind, &settings);
        let own = self
            .measured
            .iter()
            .filter(|point| point.tool.is_none_or(|tool| tool == self.position));
        own.map(move |point| Measurement {
            speed: of_kind(point.speed),
            tool: Some(number),
            ..*point
        })
    }

    /// Returns values of a setting in words.
    pub fn range(&self, parameter: &'static Parameter, values: &[f64]) -> String {
        let setting = Setting::Number(parameter);
        let ends =
            [f64::min, f64::max].map(|of| values.iter().copied().reduce(of).unwrap_or(f64::NAN));
        let [least, largest] = ends.map(|value| setting.text(value));
        let name = shown(&self.name, MAX_NAME_CHARS);
        match values.len() {
            1 => format!("{name} has {least}"),
            count => format!("{name} has {count} values from {least} to {largest}"),
        }
    }
}
