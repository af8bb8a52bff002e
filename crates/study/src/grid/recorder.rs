//! Records of single passes, such as their courses over time, collected while a study is simulated.
//!
//! Results that come from a journal have no pass: the cases to record are simulated again.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use bristle::model::metrics::Metrics;
use bristle::model::settings::{Settings, UncertaintySettings};
use bristle::simulation::{Sampling, Simulation, Stop};
use parking_lot::Mutex;

use super::{CaseResult, Study, simulate_cases};

/// Records some cases of a study, whose filaments must not touch each other.
#[derive(Debug)]
pub struct PassRecorder<'a, R> {
    study: &'a Study,
    /// The cases to record, in order.
    cases: Vec<usize>,
    sampling: Sampling,
    record: fn(usize, &Settings, &Simulation) -> R,
    records: Mutex<BTreeMap<usize, R>>,
    stop: Stop,
}

impl<'a, R: Send> PassRecorder<'a, R> {
    /// Returns a recorder of these `cases`, counted from 0. `record` makes the record of a case
    /// from its settings and its pass, sampled by `sampling`.
    #[must_use]
    pub fn new(
        study: &'a Study,
        cases: Vec<usize>,
        sampling: Sampling,
        record: fn(usize, &Settings, &Simulation) -> R,
    ) -> Self {
        Self {
            study,
            cases,
            sampling,
            record,
            records: Mutex::default(),
            stop: Stop::default(),
        }
    }

    /// Returns the recorder, which simulates no further case once `stop` is requested.
    #[must_use]
    pub fn until(self, stop: &Stop) -> Self {
        Self {
            stop: stop.clone(),
            ..self
        }
    }

    /// Sampling of the study's passes for [`PassRecorder::take`]. There is none unless all cases
    /// are recorded: simulating a few again is cheaper than sampling all.
    #[must_use]
    pub fn sampling(&self) -> Sampling {
        if self.cases.len() == self.study.case_count() && !self.study.scatters() {
            self.sampling
        } else {
            Sampling::default()
        }
    }

    /// Records a case, counted from 0, if its pass was sampled.
    ///
    /// # Panics
    /// If the study has no such case.
    pub fn take(&self, case: usize, pass: &Simulation) {
        // The history is empty too if some of its samples were not finite.
        if !pass.history.is_empty() {
            let record = (self.record)(case, &self.at_depth(case, &pass.metrics), pass);
            self.records.lock().insert(case, record);
        }
    }

    /// The settings of a case, at the depth that was found for its force if it states one.
    fn at_depth(&self, case: usize, found: &Metrics) -> Settings {
        let settings = self.study.settings(case);
        if settings.process.tool_force_n.is_some() {
            settings.at_depth(found.penetration_depth_m)
        } else {
            settings
        }
    }

    /// Simulates the cases that were not recorded, and returns all records in order.
    ///
    /// A case that failed, in `results` or now, has no record, nor do those that were under way or
    /// waiting when it was asked to stop. The default number of threads is the number of cores.
    /// Neither the number of threads nor the time of recording changes a record.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn finish(
        self,
        results: &[CaseResult],
        threads: Option<NonZeroUsize>,
    ) -> io::Result<Vec<R>> {
        // Sampled tools have no record.
        let alone = |case: usize| {
            let settings = self.at_depth(case, &results[case].as_ref().ok()?.metrics);
            let uncertainty = UncertaintySettings::default();
            Some((
                case,
                Settings {
                    uncertainty,
                    ..settings
                },
            ))
        };
        let is_recorded = |case: &usize| self.records.lock().contains_key(case);
        let waiting = self.cases.iter().copied();
        let waiting = waiting.filter(|case| !is_recorded(case));
        let (cases, settings): (Vec<usize>, Vec<Settings>) = waiting.filter_map(alone).unzip();
        if !cases.is_empty() {
            simulate_cases(
                &Study::of_cases(settings),
                &(0..cases.len()).collect::<Vec<_>>(),
                threads,
                &self.stop,
                self.sampling,
                |number, pass| self.take(cases[number], pass),
                |_, _| ControlFlow::Continue(()),
            )?;
        }
        Ok(self.records.into_inner().into_values().collect())
    }
}
