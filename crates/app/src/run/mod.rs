//! A study from its settings to the files of its results, once for the program and for Python.
//!
//! [`StudyRun`] simulates the cases and journals them; [`StudyRun::finish`] draws the page and
//! writes all files. A [`ProgressObserver`] receives its progress. [`publish`] writes the files of
//! results that are there already.

pub mod brush;
pub mod calibration;
mod checkpoint_file;
pub mod contact;
pub mod convergence;
pub mod forces;
pub mod removal;

use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::insight::advice::Answer;
use crate::insight::assumptions::Assumptions;
use crate::insight::findings::{Finding, judge_study};
use crate::insight::measured::{ForceComparison, compare};
use crate::report::page::{CourseRecorder, ReportContext, course_recorder, page};
#[cfg(feature = "parquet")]
use crate::report::parquet::write_runs_parquet;
use crate::store::journal::{Key, StudyKeys};
use crate::store::journal_file::{JournalFile, JournalFileError, JournalState};
use crate::store::previous::Previous;
use crate::store::results::BuildOrigin;
use crate::store::staged::{FileError, Occupied, StagedFile, WrittenFiles, remove};
use crate::store::study_files::{
    COMPARISON, MEASURED, RUNS_PARQUET, keep_others, occupy_results, write_study,
};
use bristle::simulation::{Sampling, Simulation, Stop};
use bristle_study::grid::{CaseResult, Resources, Study, simulate_cases, without_result};
use bristle_study::input::measured::{Measurement, measured_text};
use bristle_study::input::statement::Statement;
use parking_lot::Mutex;
use serde_json::Value;
use thiserror::Error;

/// Observer of a study, called from any thread.
pub trait ProgressObserver: Sync {
    /// A case, counted from 0, has a result, which is in the journal if there is one.
    fn case_done(&self, case: usize, failed: bool);

    /// No further case is simulated; page and files may follow.
    fn ended(&self) {}

    /// The recommendation for the goal of the file is simulated.
    fn answering(&self) {}

    /// The answer is complete, or there is no goal.
    fn answered(&self) {}
}

/// Reasons why a study has no results.
#[derive(Debug, Error)]
pub enum RunError {
    /// Threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] io::Error),
    /// A file cannot be written.
    #[error(
        "{error}\n{done} of {total} cases are in the journal; once there is room, run the same command again to resume"
    )]
    Unfinished {
        /// Cause.
        error: FileError,
        /// Number of cases in the journal.
        done: usize,
        /// Number of all cases.
        total: usize,
    },
    /// It was asked to stop.
    #[error("the study was stopped before all cases had results")]
    Stopped,
}

/// Resources, cancellation and progress reporting of a study.
pub struct RunContext<'a> {
    /// Threads and memory.
    pub resources: Resources,
    /// Ends the study at the next step of each of its passes.
    pub stop: &'a Stop,
    /// Observer of the study.
    pub observer: &'a dyn ProgressObserver,
}

/// The directory where results go.
struct Output {
    directory: PathBuf,
    journal: JournalFile,
    /// The number of cases that were in the journal when it was opened.
    earlier: usize,
    _occupied: Occupied,
}

/// A study and the results that it has so far, also in the journal of its directory if it has one.
pub struct StudyRun {
    study: Study,
    keys: StudyKeys,
    results: Vec<Option<CaseResult>>,
    output: Option<Output>,
}

/// A study with all its results.
pub struct StudyOutcome {
    /// The study.
    pub study: Study,
    /// One result per case.
    pub results: Vec<CaseResult>,
    /// Settings that were not stated.
    pub assumptions: Assumptions,
    /// The answer to what the file asks for.
    pub answer: Option<Answer>,
    /// Comparisons with measured forces.
    pub comparisons: Vec<ForceComparison>,
    /// Findings about the results.
    pub findings: Vec<Finding>,
    /// The files that were written.
    pub files: Vec<PathBuf>,
}

impl StudyRun {
    /// Creates a study without results and without a directory for them.
    #[must_use]
    pub fn new(study: Study) -> Self {
        Self {
            results: vec![None; study.case_count()],
            keys: StudyKeys::new(&study),
            study,
            output: None,
        }
    }

    /// Opens a study with the results that the journal of `directory` has of its cases, or without
    /// any after a `restart`. Results of another study there are moved aside. `subdirectories`
    /// announces files that others write there.
    ///
    /// # Errors
    /// If the directory cannot be used, or its journal cannot be read.
    pub fn open(
        study: Study,
        directory: &Path,
        subdirectories: &[WrittenFiles<'_>],
        restart: bool,
    ) -> Result<(Self, DirectoryState), JournalFileError> {
        let occupied = occupy_results(directory, subdirectories)?;
        let mut run = Self::new(study);
        let mut previous = Previous::of(directory);
        let (file, journal) = JournalFile::open(directory, restart, &mut previous, |key, line| {
            run.keys.take(key, line, &mut run.results);
        })?;
        if !restart {
            keep_others(directory, &run.study, subdirectories, &mut previous)?;
        }
        let (earlier, _) = run.counts();
        run.output = Some(Output {
            earlier,
            directory: directory.to_owned(),
            journal: file,
            _occupied: occupied,
        });
        let kept = previous.path().map(Path::to_owned);
        Ok((run, DirectoryState { journal, kept }))
    }

    /// The study.
    #[must_use]
    pub fn study(&self) -> &Study {
        &self.study
    }

    /// Returns the results so far.
    #[must_use]
    pub fn results(&self) -> &[Option<CaseResult>] {
        &self.results
    }

    /// Returns the numbers of cases with a result, and of failed cases.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let done = self.results.iter().flatten();
        (
            done.clone().count(),
            done.filter(|result| result.is_err()).count(),
        )
    }

    /// Returns the journal, if there is a directory.
    #[must_use]
    pub fn journal(&self) -> Option<&JournalFile> {
        self.output.as_ref().map(|output| &output.journal)
    }

    /// Takes the result of a case, counted from 0, that was simulated elsewhere. A case that has a
    /// result keeps it.
    ///
    /// # Errors
    /// If it cannot be written to the journal.
    pub fn take(&mut self, case: usize, result: CaseResult) -> Result<(), RunError> {
        if self.results[case].is_some() {
            return Ok(());
        }
        let written = self.journal().map_or(ControlFlow::Continue(()), |journal| {
            journal.append(&self.keys.line(case, &result))
        });
        self.results[case] = Some(result);
        if written.is_break() {
            self.settle()
        } else {
            Ok(())
        }
    }

    /// Waits until the journal is complete on the disk.
    ///
    /// # Errors
    /// If it cannot be.
    pub fn settle(&mut self) -> Result<(), RunError> {
        settle(self.output.as_mut(), &self.results)
    }

    /// Takes the results of cases that were simulated elsewhere, as [`StudyRun::take`], from the
    /// keys and texts of the lines of a journal, which `read` passes on.
    ///
    /// # Errors
    /// Passes on the error of `read`; fails if a result cannot be written to the journal here.
    pub fn take_all<R, E>(
        &mut self,
        read: impl FnOnce(&mut dyn FnMut(Key, &str)) -> Result<R, E>,
    ) -> Result<R, TakeError<E>> {
        let mut results = vec![None; self.results.len()];
        let outcome = read(&mut |key, line| self.keys.take(key, line, &mut results));
        let outcome = outcome.map_err(TakeError::Journal)?;
        for (case, result) in results.into_iter().enumerate() {
            result
                .map_or(Ok(()), |result| self.take(case, result))
                .map_err(TakeError::Run)?;
        }
        Ok(outcome)
    }

    /// Simulates the cases without a result for which `is_own` is `true`. They are counted from 0.
    ///
    /// # Errors
    /// If threads cannot be started, or a file cannot be written.
    pub fn simulate(
        &mut self,
        is_own: impl Fn(usize) -> bool,
        context: &RunContext<'_>,
    ) -> Result<(), RunError> {
        simulate(
            (&self.study, &self.keys),
            &mut self.results,
            self.output.as_mut(),
            context,
            Sampling::default(),
            |_, _| {},
            is_own,
        )
    }

    /// Simulates the cases that have no result, and answers the goal of the `statement`. With a
    /// directory, draws the page and writes the files, with a comparison with `measured` forces.
    ///
    /// # Errors
    /// If a file cannot be written, or it is asked to stop.
    pub fn finish(
        self,
        statement: &Statement,
        measured: &[Measurement],
        context: &RunContext<'_>,
    ) -> Result<StudyOutcome, RunError> {
        let Self {
            study,
            keys,
            mut results,
            mut output,
        } = self;
        let recorder = course_recorder(&study).until(context.stop);
        // Courses are for the page in the directory of the results.
        let sampling = if output.is_some() {
            recorder.sampling()
        } else {
            Sampling::default()
        };
        simulate(
            (&study, &keys),
            &mut results,
            output.as_mut(),
            context,
            sampling,
            |case, pass| recorder.take(case, pass),
            |_| true,
        )?;
        let results: Vec<CaseResult> = results
            .into_iter()
            .collect::<Option<_>>()
            .ok_or(RunError::Stopped)?;
        let assumptions = Assumptions::of_study(&study, &results, statement);
        let RunContext {
            resources,
            stop,
            observer,
        } = context;
        let answered = |goal| {
            Answer::of(goal, &study, &results, resources.threads, stop, || {
                observer.answering()
            })
        };
        let answer = statement.goal.as_ref().map(answered).transpose()?;
        observer.answered();
        let findings = judge_study(&study, &results);
        let (files, comparisons) = match &output {
            Some(Output { directory, .. }) => {
                let (origin, answer) = (&BuildOrigin::here(), answer.as_ref());
                let report = ReportContext {
                    statement,
                    origin,
                    assumptions: &assumptions,
                    answer,
                    measured,
                    findings: &findings,
                };
                publish(
                    directory,
                    recorder,
                    &study,
                    &results,
                    &report,
                    resources.threads,
                    stop,
                )?
            }
            None => Default::default(),
        };
        Ok(StudyOutcome {
            study,
            results,
            assumptions,
            answer,
            comparisons,
            findings,
            files,
        })
    }
}

/// State of a directory when a study began there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DirectoryState {
    /// The journal.
    pub journal: JournalState,
    /// Directory to which the results of another study were moved.
    pub kept: Option<PathBuf>,
}

/// Reasons why results from elsewhere were not taken.
#[derive(Debug)]
pub enum TakeError<E> {
    /// Their journal cannot be read.
    Journal(E),
    /// A result cannot be written.
    Run(RunError),
}

/// Simulates those cases without a result that `is_own` names.
fn simulate(
    (study, keys): (&Study, &StudyKeys),
    results: &mut [Option<CaseResult>],
    output: Option<&mut Output>,
    RunContext {
        resources,
        stop,
        observer,
    }: &RunContext<'_>,
    sampling: Sampling,
    on_pass: impl Fn(usize, &Simulation) + Sync,
    is_own: impl Fn(usize) -> bool,
) -> Result<(), RunError> {
    let mut cases = without_result(study, results);
    cases.retain(|&case| is_own(case));
    let shared = Mutex::new(&mut *results);
    let journal = output.as_ref().map(|output| &output.journal);
    let done = |case: usize, result: CaseResult| {
        let flow = journal.map_or(ControlFlow::Continue(()), |journal| {
            journal.append(&keys.line(case, &result))
        });
        if flow.is_continue() {
            observer.case_done(case, result.is_err());
        }
        shared.lock()[case] = Some(result);
        flow
    };
    let simulated = simulate_cases(study, &cases, *resources, stop, sampling, on_pass, done);
    observer.ended();
    settle(output, results)?;
    Ok(simulated?)
}

/// Waits until the journal of a study with these results is complete on the disk, if there is one.
fn settle(output: Option<&mut Output>, results: &[Option<CaseResult>]) -> Result<(), RunError> {
    let Some(Output {
        journal, earlier, ..
    }) = output
    else {
        return Ok(());
    };
    journal.settle().map_err(|error| RunError::Unfinished {
        error,
        done: *earlier + journal.appended(),
        total: results.len(),
    })
}

/// Returns the page of results, and simulates the courses that `recorder` has not recorded.
///
/// # Errors
/// If threads cannot be started, or it is asked to stop.
pub fn page_of(
    recorder: CourseRecorder<'_>,
    study: &Study,
    results: &[CaseResult],
    context: &ReportContext<'_>,
    threads: Option<NonZeroUsize>,
    stop: &Stop,
) -> Result<(String, Vec<ForceComparison>), RunError> {
    let courses = recorder.finish(results, threads)?;
    // A page without some of its courses must not replace another.
    if stop.is_requested() {
        return Err(RunError::Stopped);
    }
    let comparisons = compare(study, results, context.measured);
    let page = page(study, results, &courses, &comparisons, context);
    Ok((page, comparisons))
}

/// Draws the page of results and writes all files of a study to its directory, which must be
/// occupied. Returns their paths, and the comparisons with measured forces.
///
/// # Errors
/// If a file cannot be written, or it is asked to stop.
pub fn publish(
    directory: &Path,
    recorder: CourseRecorder<'_>,
    study: &Study,
    results: &[CaseResult],
    context: &ReportContext<'_>,
    threads: Option<NonZeroUsize>,
    stop: &Stop,
) -> Result<(Vec<PathBuf>, Vec<ForceComparison>), RunError> {
    let (page, comparisons) = page_of(recorder, study, results, context, threads, stop)?;
    let total = study.case_count();
    let unfinished = |error| RunError::Unfinished {
        error,
        done: total,
        total,
    };
    let has_measured = !context.measured.is_empty();
    #[cfg_attr(
        not(feature = "parquet"),
        expect(unused_variables, reason = "the Parquet file alone holds the settings")
    )]
    let further = |settings: &str| {
        let mut staged = Vec::new();
        #[cfg(feature = "parquet")]
        {
            let content = |out: &mut (dyn io::Write + Send)| {
                write_runs_parquet(out, study, results, settings)
            };
            staged.push(StagedFile::write(directory.join(RUNS_PARQUET), content)?);
        }
        if has_measured {
            let text = measured_text(context.measured, &study.tool_names());
            staged.push(StagedFile::text(directory, MEASURED, &text)?);
        }
        Ok(staged)
    };
    let findings: Vec<Value> = context
        .findings
        .iter()
        .map(|finding| serde_json::to_value(finding).expect("findings have a form in JSON"))
        .collect();
    let origin = (study, context.origin, context.statement, &findings[..]);
    let files = write_study(directory, origin, results, &page, has_measured, further)
        .map_err(unfinished)?;
    // Files of an earlier study that this one does not write.
    let others = [
        (RUNS_PARQUET, cfg!(feature = "parquet")),
        (MEASURED, has_measured),
        (COMPARISON, has_measured),
    ];
    for (name, _) in others.into_iter().filter(|(_, is_written)| !is_written) {
        remove(&directory.join(name)).map_err(unfinished)?;
    }
    Ok((files, comparisons))
}
