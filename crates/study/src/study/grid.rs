//! The grid of a study. Its points are the cases.
//!
//! Cases are numbered in the order of the grid and made from their numbers when needed. A large study therefore needs no
//! memory beyond its results.

use bristle::model::parameters::Violation;
use bristle::model::settings::Settings;
use thiserror::Error;

use super::sweep::{MAX_CASES, MAX_TOOLS, Sweep, SweepText, TURNS};
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
            case_count = case_count
                .checked_mul(sweep.values().len())
                .filter(|&count| count <= MAX_CASES)
                .ok_or(StudyError::TooManyCases)?;
        }
        let study = Self { base, sweeps, case_count };
        if study.scatters() {
            let samples = |case| study.settings(case).uncertainty.samples;
            if (0..case_count).map(samples).sum::<usize>() > MAX_TOOLS {
                return Err(StudyError::TooManyTools);
            }
        }
        for case in 0..case_count {
            check(&study.settings(case)).map_err(|violation| StudyError::Case { case, violation })?;
        }
        Ok(study)
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
        for (sweep, value) in self.sweeps.iter().zip(self.values(case)) {
            sweep.parameter().set(&mut settings, value);
        }
        settings
    }
}
