//! A grid of contacts or brushes.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use bristle::model::metrics::Metrics;
use bristle::model::parameters::PARAMETERS;
use bristle::model::record::{Column, Record};
use bristle::simulation::{Sampling, Simulation, Statistics, Stop};
use bristle_grid::brush::{Interaction, check_brushes};
use bristle_grid::uncertainty::ForceScatter;
use bristle_grid::{CaseResult, Resources, Study, Sweep, complete_study_sampled};
use bristle_insight::advice::{Limits, advise};
use bristle_insight::assumptions::Assumptions;
use bristle_report::page::{Recorder, page};
use bristle_store::journal_file::{Earlier, JournalFile};
use bristle_store::results::{
    Cell, FIXED_COLUMNS, Origin, read_runs, read_study, run_columns, run_rows, study_text, write_runs,
};
use bristle_store::staged::{FileError, Occupied, StagedFile, remove};
use bristle_store::study_files::{COMPARISON, MEASURED, RUNS, RUNS_PARQUET, STUDY, occupy_results, write_study};
use numpy::PyArray1;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::WIDTH;
use crate::arrays::frozen;
use crate::error::{of_file, of_input, of_journal, of_settings, of_value};
use crate::input::Input;
use crate::interrupt::{on_a_thread, on_a_thread_telling};

/// What only a mistake in this package leads to.
pub const INCOMPLETE: &str = "the study ended without all results";

/// A study that has been simulated.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct SimulatedStudy {
    pub study: Study,
    pub results: Vec<CaseResult>,
}

/// Cases that are done, and those of them that failed.
#[derive(Default)]
pub struct Progress {
    done: AtomicUsize,
    failed: AtomicUsize,
}

impl Progress {
    pub fn count(&self, result: &CaseResult) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.failed.fetch_add(usize::from(result.is_err()), Ordering::Relaxed);
    }

    /// The numbers of cases that are done, and of those that failed.
    pub fn counts(&self) -> (usize, usize) {
        (self.done.load(Ordering::Relaxed), self.failed.load(Ordering::Relaxed))
    }
}

/// The directory of a study's results.
pub struct Output {
    directory: PathBuf,
    pub journal: JournalFile,
    _occupied: Occupied,
}

/// Why a study has no results.
pub enum Failure {
    Threads(io::Error),
    File(FileError),
    Input(PyErr),
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Threads(error) => PyRuntimeError::new_err(format!("cannot start threads: {error}")),
            Failure::File(error) => of_file(&error),
            Failure::Input(error) => error,
        }
    }
}

/// Simulates the study of `input`, with its results and its journal in the directory `out`. Calls `tell` now and then with the numbers of
/// cases that are done, of all cases, and of those that failed.
#[pyfunction]
pub fn study(
    py: Python<'_>,
    input: &Input,
    threads: Option<NonZeroUsize>,
    out: Option<PathBuf>,
    restart: bool,
    memory: Option<u64>,
    tell: Option<Py<PyAny>>,
) -> PyResult<SimulatedStudy> {
    let study = study_of(input, threads, memory)?;
    let total = study.case_count();
    let (mut output, results, progress) = begin(&study, out, restart)?;
    let tell = |py: Python<'_>| {
        let Some(tell) = &tell else { return Ok(()) };
        let (done, failed) = progress.counts();
        tell.call1(py, (done, total, failed)).map(drop)
    };
    tell(py)?;
    let stop = Stop::default();
    let results = on_a_thread_telling(py, &stop, tell, || {
        let recorder = Recorder::new(&study).until(&stop);
        let results =
            simulate(&study, Resources { threads, memory }, results, &stop, &recorder, &progress, output.as_mut())?;
        // None after a stop.
        if let (Some(output), Some(results)) = (&output, &results) {
            output.write(input, &study, results, recorder, threads, &stop)?;
        }
        Ok(results)
    })?;
    let results = results.map_err(|failure: Failure| PyErr::from(failure))?;
    let results = results.ok_or_else(|| PyRuntimeError::new_err(INCOMPLETE))?;
    tell(py)?;
    Ok(SimulatedStudy { study, results })
}

/// The study that `input` states, once its brushes are known to fit into the memory.
pub fn study_of(input: &Input, threads: Option<NonZeroUsize>, memory: Option<u64>) -> PyResult<Study> {
    let study = input.document()?.study().map_err(|error| of_input(&error))?;
    if study.has_brush() {
        check_brushes(&study, threads, memory).map_err(|error| of_settings(error.to_string()))?;
    }
    Ok(study)
}

/// The directory `out`, the results in its journal, and their progress.
pub fn begin(
    study: &Study,
    out: Option<PathBuf>,
    restart: bool,
) -> PyResult<(Option<Output>, Vec<Option<CaseResult>>, Progress)> {
    let opened = out.map(|directory| Output::open(directory, study, restart)).transpose()?;
    let (output, results) = match opened {
        Some((output, results)) => (Some(output), results),
        None => (None, vec![None; study.case_count()]),
    };
    let progress = Progress::default();
    results.iter().flatten().for_each(|result| progress.count(result));
    Ok((output, results, progress))
}

impl Output {
    /// Prepares a directory. Returns the results in its journal, too.
    fn open(directory: PathBuf, study: &Study, restart: bool) -> PyResult<(Self, Vec<Option<CaseResult>>)> {
        let occupied = occupy_results(&directory, &[]).map_err(|error| of_file(&error))?;
        let opened = JournalFile::open(&directory, study, restart).map_err(|error| of_journal(&error))?;
        let (journal, Earlier { results, .. }) = opened;
        Ok((Self { directory, journal, _occupied: occupied }, results))
    }

    /// Writes the results of a study and its page, unless `stop` is requested, and removes files of an earlier one that this one does not
    /// write.
    pub fn write(
        &self,
        input: &Input,
        study: &Study,
        results: &[CaseResult],
        recorder: Recorder<'_>,
        threads: Option<NonZeroUsize>,
        stop: &Stop,
    ) -> Result<(), Failure> {
        let page = page_of(input, study, results, recorder, threads)?;
        if stop.is_requested() {
            return Ok(());
        }
        write_study(&self.directory, (study, &Origin::here()), results, &page, false, |_| Ok(Vec::new()))
            .map_err(Failure::File)?;
        for name in [RUNS_PARQUET, MEASURED, COMPARISON] {
            remove(&self.directory.join(name)).map_err(Failure::File)?;
        }
        Ok(())
    }
}

/// Simulates the cases without a result. Returns all results, or `None` after a stop.
fn simulate(
    study: &Study,
    resources: Resources,
    mut results: Vec<Option<CaseResult>>,
    stop: &Stop,
    recorder: &Recorder<'_>,
    progress: &Progress,
    output: Option<&mut Output>,
) -> Result<Option<Vec<CaseResult>>, Failure> {
    // Courses are for the page in the directory of the results.
    let sampling = if output.is_some() { recorder.sampling() } else { Sampling::default() };
    let journal = output.as_ref().map(|output| &output.journal);
    let record = |case, pass: &Simulation| recorder.take(case, pass);
    let done = |case, result: &CaseResult| {
        let flow = journal.map_or(ControlFlow::Continue(()), |journal| journal.append(case, result));
        progress.count(result);
        flow
    };
    let simulated = complete_study_sampled(study, resources, &mut results, stop, sampling, record, done);
    if let Some(output) = output {
        output.journal.settle().map_err(Failure::File)?;
    }
    simulated.map_err(Failure::Threads)?;
    Ok(results.into_iter().collect())
}

/// The page of a study.
fn page_of(
    input: &Input,
    study: &Study,
    results: &[CaseResult],
    recorder: Recorder<'_>,
    threads: Option<NonZeroUsize>,
) -> Result<String, Failure> {
    let courses = recorder.finish(results, threads).map_err(Failure::Threads)?;
    let document = input.document().map_err(Failure::Input)?;
    let assumptions = Assumptions::of_study(study, results, &document);
    Ok(page(&input.short_name(), study, results, &courses, &assumptions, &[]))
}

#[pymethods]
impl SimulatedStudy {
    /// The columns of `runs.csv`. What a failed case lacks is NaN, in a column of floats.
    fn runs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let names = run_columns(&self.study, &self.results);
        let mut columns: Vec<Vec<Cell>> = names.iter().map(|_| Vec::with_capacity(self.results.len())).collect();
        for row in run_rows(&self.study, &self.results) {
            columns.iter_mut().zip(row).for_each(|(column, cell)| column.push(cell));
        }
        let runs = PyDict::new(py);
        for (name, column) in names.into_iter().zip(columns) {
            let counts: Option<Vec<i64>> = column.iter().map(count).collect();
            match (counts, text(&column[0])) {
                (_, Some(_)) => runs.set_item(name, column.iter().map(text).collect::<Vec<_>>())?,
                (Some(counts), _) => runs.set_item(name, frozen(PyArray1::from_vec(py, counts)))?,
                (None, _) => {
                    let numbers = column.iter().map(number).collect();
                    runs.set_item(name, frozen(PyArray1::from_vec(py, numbers)))?;
                }
            }
        }
        Ok(runs)
    }

    /// Units and names in words of the columns of `runs.csv`, where they have any.
    fn descriptions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for parameter in PARAMETERS {
            all.set_item(parameter.path, (parameter.unit, parameter.name))?;
        }
        for (name, path) in FIXED_COLUMNS {
            all.set_item(name, all.get_item(path)?)?;
        }
        describe::<Metrics>(&all)?;
        describe::<ForceScatter>(&all)?;
        describe::<Interaction>(&all)?;
        describe::<Statistics>(&all)?;
        Ok(all)
    }

    /// The axes of the grid, from the slowest to the fastest: the columns of `runs.csv` that they are, and their values, which are names for
    /// tools.
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        let name = |path: &'static str| {
            let fixed = FIXED_COLUMNS.iter().find(|(_, of)| *of == path);
            fixed.map_or(path, |(name, _)| *name)
        };
        let values = |sweep: &Sweep| match sweep.setting().names() {
            Some(names) => names.into_bound_py_any(py),
            None => sweep.values().into_bound_py_any(py),
        };
        self.study.sweeps().iter().map(|sweep| Ok((name(sweep.path()), values(sweep)?))).collect()
    }

    /// The number of cases that failed.
    fn failures(&self) -> usize {
        self.results.iter().filter(|result| result.is_err()).count()
    }

    /// Writes the page.
    fn report(&self, py: Python<'_>, input: &Input, path: PathBuf) -> PyResult<()> {
        let stop = Stop::default();
        let written = on_a_thread(py, &stop, || {
            let recorder = Recorder::new(&self.study).until(&stop);
            let page = page_of(input, &self.study, &self.results, recorder, None)?;
            if stop.is_requested() {
                // The signal raises; an incomplete page must not replace another.
                return Ok(());
            }
            let file = StagedFile::write(path, |out| out.write_all(page.as_bytes())).map_err(Failure::File)?;
            file.commit().map(drop).map_err(Failure::File)
        })?;
        written.map_err(|failure: Failure| PyErr::from(failure))
    }

    /// What `bristle advise` says, as text and as JSON.
    fn advise(&self, limits: BTreeMap<String, f64>) -> PyResult<(String, String)> {
        let limit = |name: &str| limits.get(name).copied();
        let limits = Limits {
            max_velocity_m_s: limit("max_velocity_m_s"),
            max_rotational_speed_rpm: limit("max_rotational_speed_rpm"),
            max_depth_m: limit("max_depth_m"),
            max_force_n: limit("max_force_n"),
            max_power_w: limit("max_power_w"),
            min_ratio: limit("min_ratio"),
            max_ratio: limit("max_ratio"),
            target_force_n: limit("target_force_n"),
        };
        let advice = advise(&self.study, &self.results, limits).map_err(of_value)?;
        Ok((advice.text(WIDTH), serde_json::to_string(&advice).map_err(of_value)?))
    }

    /// `study.json` and `runs.csv`, for [`SimulatedStudy::of_state`].
    fn state(&self) -> PyResult<(String, String)> {
        let mut runs = Vec::new();
        write_runs(&mut runs, &self.study, &self.results)?;
        let study = study_text(&self.study, &runs, false);
        Ok((study, String::from_utf8(runs).map_err(of_value)?))
    }

    /// The study of which [`SimulatedStudy::state`] has told.
    #[staticmethod]
    fn of_state(state: (String, String)) -> PyResult<Self> {
        let (study, runs) = state;
        let saved = read_study(&study, STUDY).map_err(of_value)?;
        let results = read_runs(&runs, RUNS, &saved).map_err(of_value)?;
        Ok(Self { study: saved.study, results })
    }
}

/// A count, if the cell has one.
fn count(cell: &Cell) -> Option<i64> {
    match cell {
        Cell::Count(count) => count.map(|count| count as i64),
        _ => None,
    }
}

/// A number; NaN if the cell has none.
fn number(cell: &Cell) -> f64 {
    match cell {
        Cell::Real(value) => value.unwrap_or(f64::NAN),
        Cell::Count(count) => count.map_or(f64::NAN, |count| count as f64),
        Cell::Text(_) => f64::NAN,
    }
}

/// The text of a cell of text.
fn text(cell: &Cell) -> Option<&str> {
    match cell {
        Cell::Text(text) => Some(text),
        _ => None,
    }
}

/// Adds unit and name of each column of a record.
fn describe<R: Record>(all: &Bound<'_, PyDict>) -> PyResult<()> {
    R::COLUMNS.iter().try_for_each(|Column { key, unit, name, .. }| all.set_item(key, (unit, name)))
}
