//! A grid of contacts or brushes.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use bristle::model::metrics::Metrics;
use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::record::Record;
use bristle::model::settings::Settings;
use bristle::simulation::{Statistics, Stop};
use bristle_app::insight::advice::{Limits, advise};
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::judge_study;
use bristle_app::report::page::{ReportContext, course_recorder};
use bristle_app::run::{ProgressObserver, RunContext, RunError, StudyRun, TakeError, page_of};
use bristle_app::store::journal;
use bristle_app::store::results::{
    BuildOrigin, FIXED_COLUMNS, TableCell, read_runs, read_study, run_columns, run_rows,
    study_text, write_runs,
};
use bristle_app::store::staged::StagedFile;
use bristle_app::store::study_files::{RUNS, STUDY};
use bristle_study::grid::brush::check_brushes;
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{
    CaseResult, Interaction, SPEED, Setting, Study, VELOCITY, by_work, simulate_cases_with,
    without_result,
};
use bristle_study::text::layout::WIDTH;
use numpy::PyArray1;
use parking_lot::{Mutex, MutexGuard};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::frozen;
use crate::error::{of_file, of_journal, of_settings, of_value};
use crate::input::InputFile;
use crate::interrupt::{on_a_thread, on_a_thread_telling};
use crate::tool::PythonTool;

/// A simulated study.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct SimulatedStudy {
    study: Study,
    results: Vec<CaseResult>,
}

/// Numbers of finished cases, and of failed ones among them.
struct CaseCounts {
    done: AtomicUsize,
    failed: AtomicUsize,
}

impl ProgressObserver for CaseCounts {
    fn case_done(&self, _: usize, failed: bool) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.failed
            .fetch_add(usize::from(failed), Ordering::Relaxed);
    }
}

/// Returns the exception for a study without results.
pub fn of_run(error: RunError) -> PyErr {
    match error {
        RunError::Unfinished { error, .. } => of_file(error),
        RunError::Threads(_) | RunError::Stopped => PyRuntimeError::new_err(error.to_string()),
    }
}

/// A study without all results, which are simulated here or gathered from elsewhere.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct PendingStudy {
    input: Py<InputFile>,
    study: Study,
    /// Tool that replaces the tool of the settings.
    tool: Option<Py<PythonTool>>,
    /// Run of the study; `None` during the simulation, and once it is closed.
    run: Mutex<Option<StudyRun>>,
}

#[pymethods]
impl PendingStudy {
    /// Creates the study that `input` states, after a check that `threads`, `memory` and `tool`
    /// suit it. Results go to the directory `out`; an earlier study resumes from its journal. Each
    /// case is simulated again with more precision if it is to `check`.
    #[new]
    fn new(
        input: Py<InputFile>,
        means: (Option<PathBuf>, bool, bool),
        threads: Option<NonZeroUsize>,
        memory: Option<u64>,
        tool: Option<Py<PythonTool>>,
    ) -> PyResult<Self> {
        let (out, restart, check) = means;
        let study = input.get().study(check)?;
        if tool.is_some() {
            check_tool(&study).map_err(of_settings)?;
        }
        if study.has_brush() {
            check_brushes(&study, threads, memory).map_err(of_settings)?;
        }
        let run = match out {
            Some(out) => {
                StudyRun::open(study.clone(), &out, &[], restart)
                    .map_err(of_journal)?
                    .0
            }
            None => StudyRun::new(study.clone()),
        };
        Ok(Self {
            input,
            study,
            tool,
            run: Mutex::new(Some(run)),
        })
    }

    /// Returns the numbers of finished cases, of all cases, and of failed ones.
    fn counts(&self) -> PyResult<(usize, usize, usize)> {
        let (done, failed) = open(&mut self.run())?.counts();
        Ok((done, self.study.case_count(), failed))
    }

    /// Returns `true` if the cases are brushes.
    fn has_brush(&self) -> bool {
        self.study.has_brush()
    }

    /// Returns the cases without a result, those with the most work first.
    fn waiting(&self) -> PyResult<Vec<usize>> {
        let cases = without_result(&self.study, open(&mut self.run())?.results());
        Ok(by_work(&self.study, &cases))
    }

    /// Takes a journal of cases that were simulated elsewhere. A case with a result keeps it.
    fn take(&self, lines: &str) -> PyResult<()> {
        let mut guard = self.run();
        let taken = open(&mut guard)?.take_all(|take| {
            let length = journal::read(lines.as_bytes(), take).map_err(of_value)?;
            if length.torn > 0 {
                return Err(of_value("they are damaged"));
            }
            Ok(())
        });
        taken.map_err(|error| match error {
            TakeError::Journal(error) => error,
            TakeError::Run(error) => of_run(error),
        })
    }

    /// Simulates the cases without a result, and writes the files if there is a directory for them.
    /// Calls `tell` now and then with the numbers of finished cases, of all, and of failed ones.
    /// After its exception, or a signal, the journal has the results so far. Without a journal this
    /// study keeps them.
    fn finish(
        &self,
        py: Python<'_>,
        threads: Option<NonZeroUsize>,
        tell: Option<Py<PyAny>>,
    ) -> PyResult<SimulatedStudy> {
        let (done, total, failed) = self.counts()?;
        let progress = CaseCounts {
            done: done.into(),
            failed: failed.into(),
        };
        let tell = |py: Python<'_>| {
            let Some(tell) = &tell else { return Ok(()) };
            let (done, failed) = (
                progress.done.load(Ordering::Relaxed),
                progress.failed.load(Ordering::Relaxed),
            );
            tell.call1(py, (done, total, failed)).map(drop)
        };
        tell(py)?;
        let stop = Stop::default();
        let context = RunContext {
            resources: threads.into(),
            stop: &stop,
            observer: &progress,
        };
        let mut run = self.run().take().ok_or_else(|| of_value(CLOSED))?;
        let results = if run.journal().is_some() {
            let input = self.input.get();
            let finish = || {
                let finished = run.finish(&input.statement()?, &input.measured()?, &context);
                Ok::<_, PyErr>(Some(finished.map_err(of_run)?.results))
            };
            on_a_thread_telling(py, &stop, tell, finish)??
        } else {
            let simulated =
                on_a_thread_telling(py, &stop, tell, || self.simulate(&mut run, &context));
            let results = run.results().iter().cloned().collect();
            *self.run() = Some(run);
            simulated??;
            results
        };
        tell(py)?;
        let results = results.ok_or_else(|| of_run(RunError::Stopped))?;
        Ok(SimulatedStudy {
            study: self.study.clone(),
            results,
        })
    }

    /// Closes the journal and releases its directory.
    fn close(&self) -> PyResult<()> {
        let run = self.run().take();
        run.map_or(Ok(()), |mut run| run.settle()).map_err(of_run)
    }
}

const CLOSED: &str = "the study is closed";

impl PendingStudy {
    fn run(&self) -> MutexGuard<'_, Option<StudyRun>> {
        self.run.lock()
    }

    /// Simulates the cases without a result, if there is no journal.
    fn simulate(&self, run: &mut StudyRun, context: &RunContext<'_>) -> PyResult<()> {
        let Some(tool) = &self.tool else {
            return run.simulate(|_| true, context).map_err(of_run);
        };
        let cases = without_result(&self.study, run.results());
        let run = Mutex::new(run);
        let done = |case, result: CaseResult| {
            context.observer.case_done(case, result.is_err());
            match run.lock().take(case, result) {
                Ok(()) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            }
        };
        let pass_of = |settings: &Settings| tool.get().pass(settings);
        let simulated = simulate_cases_with(
            &self.study,
            &cases,
            context.resources.threads,
            context.stop,
            pass_of,
            done,
        );
        simulated.map_err(|error| of_run(error.into()))
    }
}

fn open(run: &mut Option<StudyRun>) -> PyResult<&mut StudyRun> {
    run.as_mut().ok_or_else(|| of_value(CLOSED))
}

/// Checks that one sampled tool can replace the tools of the settings.
fn check_tool(study: &Study) -> Result<(), String> {
    if study.has_brush() {
        return Err(
            "the filaments of a section [brush] are those of a round tool: leave out `brush`, or `tool=`".to_owned()
        );
    }
    let differs = |path: &&&str| {
        let value =
            |case| Parameter::find(path).map(|parameter| parameter.get(&study.settings(case)));
        (1..study.case_count()).any(|case| value(case) != value(0))
    };
    if let Some(path) = ["tool.body_radius_m", "filament.lateral_tilt_rad"]
        .iter()
        .find(differs)
    {
        return Err(format!(
            "the cases differ in `{path}`, but `tool=` is one tool: make a study of each"
        ));
    }
    if study.sweep(SPEED).is_some() {
        return Err(format!(
            "`{SPEED}` is that of the round tool of the settings: with `tool=`, sweep `{VELOCITY}`"
        ));
    }
    Ok(())
}

#[pymethods]
impl SimulatedStudy {
    /// Returns the columns of `runs.csv`. Missing values of a failed case are NaN, in a column of
    /// floats.
    fn runs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let names = run_columns(&self.study, &self.results);
        let mut columns: Vec<Vec<TableCell>> = names
            .iter()
            .map(|_| Vec::with_capacity(self.results.len()))
            .collect();
        for row in run_rows(&self.study, &self.results) {
            columns
                .iter_mut()
                .zip(row)
                .for_each(|(column, cell)| column.push(cell));
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

    /// Describes settings and columns of `runs.csv`: units, names in words, labels, and factors to
    /// the units of figures.
    fn descriptions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for parameter in PARAMETERS {
            let setting = Setting::Number(parameter);
            let (label, factor) = (setting.label(), setting.factor());
            all.set_item(
                parameter.path,
                description(py, parameter.unit, parameter.name, label, factor)?,
            )?;
        }
        for (name, path) in FIXED_COLUMNS {
            all.set_item(name, all.get_item(path)?)?;
        }
        describe::<Metrics>(&all)?;
        describe::<ForceScatter>(&all)?;
        describe::<Interaction>(&all)?;
        describe::<Statistics>(&all)?;
        for name in run_columns(&self.study, &self.results) {
            if !all.contains(name)? {
                all.set_item(name, description(py, "", name, name.to_owned(), 1.0)?)?;
            }
        }
        Ok(all)
    }

    /// Returns the axes of the grid, from the slowest to the fastest: their columns in `runs.csv`,
    /// and the numbers of their values.
    fn axes(&self) -> Vec<(&'static str, usize)> {
        let name = |path: &'static str| {
            let fixed = FIXED_COLUMNS.iter().find(|(_, of)| *of == path);
            fixed.map_or(path, |(name, _)| *name)
        };
        self.study
            .sweeps()
            .iter()
            .map(|sweep| (name(sweep.path()), sweep.values().len()))
            .collect()
    }

    /// Returns the number of failed cases.
    fn failures(&self) -> usize {
        self.results.iter().filter(|result| result.is_err()).count()
    }

    /// Returns the warnings of the program.
    fn warnings(&self) -> Vec<String> {
        judge_study(&self.study, &self.results)
            .iter()
            .map(|finding| finding.warning().plain())
            .collect()
    }

    /// Returns the findings about the results, as JSON.
    fn findings(&self) -> PyResult<String> {
        serde_json::to_string(&judge_study(&self.study, &self.results)).map_err(of_settings)
    }

    /// Writes the page.
    fn report(&self, py: Python<'_>, input: &InputFile, path: PathBuf) -> PyResult<()> {
        let stop = Stop::default();
        on_a_thread(py, &stop, || {
            let recorder = course_recorder(&self.study).until(&stop);
            let statement = input.statement()?;
            let assumptions = Assumptions::of_study(&self.study, &self.results, &statement);
            let origin = BuildOrigin::here();
            let findings = judge_study(&self.study, &self.results);
            let context = ReportContext {
                statement: &statement,
                origin: &origin,
                assumptions: &assumptions,
                answer: None,
                measured: &[],
                findings: &findings,
            };
            let page = page_of(recorder, &self.study, &self.results, &context, None, &stop);
            let (page, _) = page.map_err(of_run)?;
            let file =
                StagedFile::write(path, |out| out.write_all(page.as_bytes())).map_err(of_file)?;
            file.commit().map(drop).map_err(of_file)
        })?
    }

    /// Returns the output of `bristle advise`, as text and as JSON. Simulates the recommendation
    /// first if `verify` is set.
    fn advise(
        &self,
        py: Python<'_>,
        limits: BTreeMap<String, f64>,
        verify: bool,
    ) -> PyResult<(String, String)> {
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
            most: None,
        };
        let mut advice = advise(&self.study, &self.results, limits).map_err(of_value)?;
        if verify {
            let stop = Stop::default();
            on_a_thread(py, &stop, || advice.verify(None, &stop))??;
        }
        Ok((
            advice.text(WIDTH),
            serde_json::to_string(&advice).map_err(of_value)?,
        ))
    }

    /// Returns `study.json` and `runs.csv`, for [`SimulatedStudy::of_state`].
    fn state(&self) -> PyResult<(String, String)> {
        let mut runs = Vec::new();
        write_runs(&mut runs, &self.study, &self.results)?;
        let study = study_text(&self.study, &runs, false);
        Ok((study, String::from_utf8(runs).map_err(of_value)?))
    }

    /// Restores the study from the result of [`SimulatedStudy::state`].
    #[staticmethod]
    fn of_state(state: (String, String)) -> PyResult<Self> {
        let (study, runs) = state;
        let saved = read_study(&study, STUDY).map_err(of_value)?;
        let results = read_runs(&runs, RUNS, &saved).map_err(of_value)?;
        Ok(Self {
            study: saved.study,
            results,
        })
    }
}

/// Returns the count of a cell, if it has one.
fn count(cell: &TableCell) -> Option<i64> {
    match cell {
        TableCell::Count(count) => count.map(|count| count as i64),
        _ => None,
    }
}

/// Returns the number of a cell; NaN if it has none.
fn number(cell: &TableCell) -> f64 {
    match cell {
        TableCell::Real(value) => value.unwrap_or(f64::NAN),
        TableCell::Count(count) => count.map_or(f64::NAN, |count| count as f64),
        TableCell::Text(_) => f64::NAN,
    }
}

/// Returns the text of a cell of text.
fn text(cell: &TableCell) -> Option<&str> {
    match cell {
        TableCell::Text(text) => Some(text),
        _ => None,
    }
}

/// Adds descriptions of the columns of a record.
fn describe<R: Record>(all: &Bound<'_, PyDict>) -> PyResult<()> {
    R::COLUMNS.iter().try_for_each(|column| {
        let (shown, factor) = match column.display.unit {
            "" => (column.unit, 1.0),
            unit => (unit, column.display.factor),
        };
        let unit = if shown.is_empty() {
            String::new()
        } else {
            format!("in {shown}")
        };
        let label = [column.name, column.symbol, &unit]
            .into_iter()
            .filter(|part| !part.is_empty());
        let label = label.collect::<Vec<_>>().join(" ");
        all.set_item(
            column.key,
            description(all.py(), column.unit, column.name, label, factor)?,
        )
    })
}

fn description<'py>(
    py: Python<'py>,
    unit: &str,
    name: &str,
    label: String,
    factor: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let description = PyDict::new(py);
    description.set_item("unit", unit)?;
    description.set_item("name", name)?;
    description.set_item("label", label)?;
    description.set_item("factor", factor)?;
    Ok(description)
}
