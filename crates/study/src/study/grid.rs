//! The grid of a study. Its points are the cases.
//!
//! Cases are numbered in the order of the grid and made from their numbers when needed. A large study therefore needs no
//! memory beyond its results.

use bristle::model::parameters::{Parameter, Violation};
use bristle::model::settings::Settings;
use thiserror::Error;

use super::sweep::{MAX_CASES, MAX_TOOLS, SPEED, Sweep, SweepText, TURNS, VELOCITY};
use crate::plausibility::{Unusual, unusual_in_study};
use crate::uncertainty::{INPUTS, MOVING, check};

/// The section of an input file whose sweeps make every case a brush.
const BRUSH: &str = "brush";

/// The reasons why sweeps do not form a study.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StudyError {
    /// Two sweeps name the same setting.
    #[error("`{path}` is swept twice")]
    SweptTwice {
        /// Dotted path of the setting.
        path: &'static str,
    },
    /// Two sweeps name settings that state the same.
    #[error("`{path}` and `{other}` cannot both be given: each follows from the other")]
    BothSwept {
        /// Dotted path of the later one.
        path: &'static str,
        /// Dotted path of the other.
        other: &'static str,
    },
    /// The grid has too many points.
    #[error("the study has more than {MAX_CASES} cases")]
    TooManyCases,
    /// The cases have too many sampled tools.
    #[error("the study has more than {MAX_TOOLS} sampled tools: reduce the number of cases or uncertainty.samples")]
    TooManyTools,
    /// The settings of one case contradict each other.
    #[error("case {} of the study: {violation}", .case + 1)]
    Case {
        /// Number of the case, counted from 0.
        case: usize,
        /// What is wrong with it.
        violation: Violation,
    },
}

/// A grid of settings.
#[derive(Clone, Debug)]
pub struct Study {
    base: Settings,
    /// The sweeps from the slowest to the fastest.
    sweeps: Vec<Sweep>,
    case_count: usize,
    unusual: Vec<Unusual>,
}

impl Study {
    /// Makes a study of all combinations of the swept values, and checks each case.
    ///
    /// The velocity changes fastest, then the depth, then the other sweeps. The first of these changes slowest.
    pub fn new(base: Settings, mut sweeps: Vec<Sweep>) -> Result<Self, StudyError> {
        sweeps.sort_by_key(Sweep::rank);
        let mut case_count = 1_usize;
        for (index, sweep) in sweeps.iter().enumerate() {
            let path = sweep.parameter().path;
            if sweeps[..index].iter().any(|other| other.parameter().path == path) {
                return Err(StudyError::SweptTwice { path });
            }
            let twin = |other: &&Sweep| sweep.parameter().group().any(|same| same.path == other.parameter().path);
            if let Some(other) = sweeps[..index].iter().find(twin) {
                return Err(StudyError::BothSwept { path, other: other.parameter().path });
            }
            case_count = case_count
                .checked_mul(sweep.values().len())
                .filter(|&count| count <= MAX_CASES)
                .ok_or(StudyError::TooManyCases)?;
        }
        let mut study = Self { base, sweeps, case_count, unusual: Vec::new() };
        if study.scatters() {
            let samples = |case| study.settings(case).uncertainty.samples;
            if (0..case_count).map(samples).sum::<usize>() > MAX_TOOLS {
                return Err(StudyError::TooManyTools);
            }
        }
        for case in 0..case_count {
            check(&study.settings(case)).map_err(|violation| StudyError::Case { case, violation })?;
        }
        study.unusual = unusual_in_study(&study);
        Ok(study)
    }

    /// The settings that are unusual in some case.
    #[must_use]
    pub fn unusual(&self) -> &[Unusual] {
        &self.unusual
    }

    /// The settings that all cases share. Swept settings have some value here, usually their first.
    #[must_use]
    pub fn base(&self) -> &Settings {
        &self.base
    }

    /// The swept settings, from the slowest to the fastest.
    #[must_use]
    pub fn sweeps(&self) -> &[Sweep] {
        &self.sweeps
    }

    /// The sweeps in the form used in files.
    pub(crate) fn sweep_texts(&self) -> Vec<SweepText> {
        let text =
            |sweep: &Sweep| SweepText { setting: sweep.parameter().path.to_owned(), values: sweep.values().to_owned() };
        self.sweeps.iter().map(text).collect()
    }

    /// The number of cases, at least one.
    #[must_use]
    pub fn case_count(&self) -> usize {
        self.case_count
    }

    /// The value of each sweep in one case, counted from 0.
    pub fn values(&self, case: usize) -> impl Iterator<Item = f64> + '_ {
        let mut stride = self.case_count;
        self.sweeps.iter().map(move |sweep| {
            stride /= sweep.values().len();
            sweep.values()[case / stride % sweep.values().len()]
        })
    }

    /// Whether tools are sampled in some case, because their filaments scatter. Those of a brush scatter within it.
    #[must_use]
    pub fn scatters(&self) -> bool {
        if self.has_brush() {
            return false;
        }
        let swept = |path| self.sweeps.iter().find(|sweep| sweep.parameter().path == path);
        INPUTS[..MOVING].iter().any(|input| match swept(input.std) {
            Some(sweep) => sweep.values().iter().any(|&value| value > 0.0),
            None => input.scatters(&self.base),
        })
    }

    /// Whether the cases are brushes, whose filaments touch each other.
    #[must_use]
    pub fn has_brush(&self) -> bool {
        self.base.brush.is_some() || self.sweeps.iter().any(|sweep| sweep.parameter().section() == BRUSH)
    }

    /// Whether some case has more than one turn.
    #[must_use]
    pub fn takes_turns(&self) -> bool {
        match self.sweeps.iter().find(|sweep| sweep.parameter().path == TURNS) {
            Some(sweep) => sweep.values().iter().any(|&turns| turns > 1.0),
            None => self.base.process.turns.at_most() > 1,
        }
    }

    /// All settings of one case, counted from 0.
    #[must_use]
    pub fn settings(&self, case: usize) -> Settings {
        let mut settings = self.base.clone();
        let values = || self.sweeps.iter().map(Sweep::parameter).zip(self.values(case));
        let (others, own): (Vec<_>, Vec<_>) = values().partition(|(parameter, _)| !parameter.instead_of.is_empty());
        // A setting that states another in its own way does so from those of this case.
        for (parameter, value) in own.into_iter().chain(others) {
            parameter.set(&mut settings, value);
        }
        settings
    }

    /// The setting by which the study states how fast the tool turns: its rotational speed, or the velocity of the tips.
    #[must_use]
    pub fn speed(&self) -> &'static Parameter {
        let parameters = || self.sweeps.iter().map(Sweep::parameter);
        let path = if parameters().any(|parameter| parameter.path == SPEED) { SPEED } else { VELOCITY };
        Parameter::find(path).expect("the table has velocity and speed")
    }

    /// The value of a setting in a case: that of its sweep, or the one that follows from the others.
    #[must_use]
    pub fn value(&self, parameter: &Parameter, case: usize) -> f64 {
        let swept = self.sweeps.iter().position(|sweep| std::ptr::eq(sweep.parameter(), parameter));
        let stated = swept.and_then(|position| self.values(case).nth(position));
        stated.unwrap_or_else(|| parameter.get(&self.settings(case)))
    }

    /// Whether a setting has different values in different cases, because it is swept or follows from one that is.
    #[must_use]
    pub fn varies(&self, parameter: &Parameter) -> bool {
        let mut stride = self.case_count;
        self.sweeps.iter().any(|sweep| {
            let count = sweep.values().len();
            stride /= count;
            if std::ptr::eq(sweep.parameter(), parameter) {
                return true;
            }
            let follows = parameter.group().count() > 1;
            let value = |position: usize| parameter.get(&self.settings(position * stride));
            follows && (1..count).any(|position| value(position) != value(0))
        })
    }
}
