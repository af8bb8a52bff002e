//! A grid of contacts or brushes.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use bristle::model::metrics::Metrics;
use bristle::model::parameters::PARAMETERS;
use bristle::model::record::{Column, Record};
use bristle::simulation::{Statistics, Stop};
use bristle_grid::brush::{Interaction, check_brushes};
use bristle_grid::uncertainty::ForceScatter;
use bristle_grid::{CaseResult, Resources, Study, Sweep};
use bristle_insight::advice::{Limits, advise};
use bristle_insight::assumptions::Assumptions;
use bristle_insight::warnings::of_study;
use bristle_report::page::Recorder;
use bristle_run::{Means, Observer, RunError, StudyRun, Subject, page_of};
use bristle_store::results::{
    Cell, FIXED_COLUMNS, Origin, read_runs, read_study, run_columns, run_rows, study_text, write_runs,
};
use bristle_store::staged::StagedFile;
use bristle_store::study_files::{RUNS, STUDY};
use bristle_text::layout::Warning;
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

/// A study that has been simulated.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct SimulatedStudy {
    study: Study,
    results: Vec<CaseResult>,
}

/// Cases that are done, and those of them that failed.
struct Progress {
    done: AtomicUsize,
    failed: AtomicUsize,
}

impl Progress {
    fn of(run: &StudyRun) -> Self {
        let (done, failed) = run.counts();
        Self { done: done.into(), failed: failed.into() }
    }
}

impl Observer for Progress {
    fn case_done(&self, _: usize, failed: bool) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.failed.fetch_add(usize::from(failed), Ordering::Relaxed);
    }
}

/// The exception of a study without results.
pub fn of_run(error: &RunError) -> PyErr {
    match error {
        RunError::Unfinished { error, .. } => of_file(error),
        RunError::Threads(_) | RunError::Stopped => PyRuntimeError::new_err(error.to_string()),
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
    let run = begin(input, threads, memory, out, restart)?;
    let (total, progress) = (run.study().case_count(), Progress::of(&run));
    let tell = |py: Python<'_>| {
        let Some(tell) = &tell else { return Ok(()) };
        let (done, failed) = (progress.done.load(Ordering::Relaxed), progress.failed.load(Ordering::Relaxed));
        tell.call1(py, (done, total, failed)).map(drop)
    };
    tell(py)?;
    let stop = Stop::default();
    let means = Means { resources: Resources { threads, memory }, stop: &stop, observer: &progress };
    let finished = on_a_thread_telling(py, &stop, tell, || finish(run, input, &means))??;
    tell(py)?;
    Ok(finished)
}

/// The study that `input` states, once its brushes are known to fit into the memory, and the results in the journal of the directory `out`.
pub fn begin(
    input: &Input,
    threads: Option<NonZeroUsize>,
    memory: Option<u64>,
    out: Option<PathBuf>,
    restart: bool,
) -> PyResult<StudyRun> {
    let study = input.document()?.study().map_err(|error| of_input(&error))?;
    if study.has_brush() {
        check_brushes(&study, threads, memory).map_err(|error| of_settings(error.to_string()))?;
    }
    match out {
        Some(out) => StudyRun::open(study, &out, &[], restart).map(|(run, _)| run).map_err(|error| of_journal(&error)),
        None => Ok(StudyRun::new(study)),
    }
}

/// Simulates the cases without a result, and writes the files.
pub fn finish(run: StudyRun, input: &Input, means: &Means<'_>) -> PyResult<SimulatedStudy> {
    let finished = run.finish(&input.short_name(), &input.document()?, &[], means).map_err(|error| of_run(&error))?;
    Ok(SimulatedStudy { study: finished.study, results: finished.results })
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

    /// What the program warns of.
    fn warnings(&self) -> Vec<String> {
        of_study(&self.study, &self.results).iter().map(Warning::plain).collect()
    }

    /// Writes the page.
    fn report(&self, py: Python<'_>, input: &Input, path: PathBuf) -> PyResult<()> {
        let stop = Stop::default();
        on_a_thread(py, &stop, || {
            let recorder = Recorder::new(&self.study).until(&stop);
            let assumptions = Assumptions::of_study(&self.study, &self.results, &input.document()?);
            let (name, origin) = (input.short_name(), Origin::here());
            let subject = Subject { name: &name, origin: &origin, assumptions: &assumptions, measured: &[] };
            let page = page_of(recorder, &self.study, &self.results, &subject, None, &stop);
            let (page, _) = page.map_err(|error| of_run(&error))?;
            let file =
                StagedFile::write(path, |out| out.write_all(page.as_bytes())).map_err(|error| of_file(&error))?;
            file.commit().map(drop).map_err(|error| of_file(&error))
        })?
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
