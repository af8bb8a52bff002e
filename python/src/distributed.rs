//! Studies whose cases are simulated by other processes: what each of them does, and what gathers their results.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};

use bristle::simulation::{Sampling, Stop};
use bristle_grid::{CaseResult, Resources, Study, Waiting, simulate_cases, waiting_cases, without_result};
use bristle_run::{Means, Observer, StudyRun};
use bristle_store::journal::Journal;
use pyo3::prelude::*;

use crate::error::{of_input, of_value};
use crate::input::Input;
use crate::interrupt::{on_a_thread, on_a_thread_telling};
use crate::study::{SimulatedStudy, begin, finish, of_run};

const UNBROKEN: &str = "nothing panics with the results in hand";

/// Cases of a study that are simulated for somebody else.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct Cases {
    study: Study,
    journal: Journal,
}

#[pymethods]
impl Cases {
    #[new]
    fn new(input: &Input) -> PyResult<Self> {
        let study = input.document()?.study().map_err(|error| of_input(&error))?;
        Ok(Self { journal: Journal::new(&study), study })
    }

    /// Simulates some cases on one thread, and returns a journal with their results. Calls `tell` now and then, whose exception stops it.
    fn simulate(&self, py: Python<'_>, cases: Vec<usize>, tell: Py<PyAny>) -> PyResult<String> {
        if cases.iter().any(|&case| case >= self.study.case_count()) {
            return Err(of_value("the study has no such case"));
        }
        let stop = Stop::default();
        let tell = |py: Python<'_>| tell.call0(py).map(drop);
        let lines = Mutex::new(self.journal.header().to_owned());
        let done = |case, result: CaseResult| {
            lines.lock().expect(UNBROKEN).push_str(&self.journal.entry(case, &result));
            ControlFlow::Continue(())
        };
        let one = NonZeroUsize::new(1);
        let simulated = on_a_thread_telling(py, &stop, tell, || {
            simulate_cases(&self.study, &cases, one, &stop, Sampling::default(), |_, _| {}, done)
        })?;
        simulated.map_err(|error| of_run(&error.into()))?;
        Ok(lines.into_inner().expect(UNBROKEN))
    }
}

/// A study whose cases are simulated elsewhere and gathered here.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct GatheredStudy {
    input: Py<Input>,
    study: Study,
    journal: Journal,
    /// `None` once it is finished, or closed.
    run: Mutex<Option<StudyRun>>,
}

#[pymethods]
impl GatheredStudy {
    /// A study with its results and its journal in the directory `out`, from which it goes on.
    #[new]
    fn new(input: Py<Input>, out: Option<PathBuf>, restart: bool, memory: Option<u64>) -> PyResult<Self> {
        let run = begin(input.get(), NonZeroUsize::new(1), memory, out, restart)?;
        let study = run.study().clone();
        Ok(Self { journal: Journal::new(&study), input, study, run: Mutex::new(Some(run)) })
    }

    /// The numbers of cases that are done, of all cases, and of those that failed.
    fn counts(&self) -> PyResult<(usize, usize, usize)> {
        let (done, failed) = open(&mut self.run())?.counts();
        Ok((done, self.study.case_count(), failed))
    }

    /// Whether its cases are brushes.
    fn has_brush(&self) -> bool {
        self.study.has_brush()
    }

    /// The cases that are still to be simulated, with the numbers of their kinds and the work that each takes.
    fn waiting(&self) -> PyResult<Vec<(usize, usize, f64)>> {
        let cases = without_result(&self.study, open(&mut self.run())?.results());
        let waiting = waiting_cases(&self.study, &cases).into_iter();
        Ok(waiting.map(|Waiting { case, kind, work }| (case, kind, work)).collect())
    }

    /// Takes a journal of cases. A case that has a result keeps it.
    fn take(&self, lines: &str) -> PyResult<()> {
        let mut guard = self.run();
        let run = open(&mut guard)?;
        let mut written = Ok(());
        let read = self.journal.read_each(&self.study, lines.as_bytes(), |case, result| {
            if written.is_ok() {
                written = run.take(case, result);
            }
        });
        if read.map_err(of_value)?.torn > 0 {
            return Err(of_value("they are damaged"));
        }
        written.map_err(|error| of_run(&error))
    }

    /// Closes the journal. Its directory is free after that.
    fn close(&self) -> PyResult<()> {
        let run = self.run().take();
        run.map_or(Ok(()), |mut run| run.settle()).map_err(|error| of_run(&error))
    }

    /// Writes the files of the study, all of whose cases have results.
    fn finish(&self, py: Python<'_>) -> PyResult<SimulatedStudy> {
        let run = self.run().take().ok_or_else(|| of_value(CLOSED))?;
        let stop = Stop::default();
        let means = Means { resources: Resources::default(), stop: &stop, observer: &Unseen };
        on_a_thread(py, &stop, || finish(run, self.input.get(), &means))?
    }
}

/// Nobody watches how files are written.
struct Unseen;

impl Observer for Unseen {
    fn case_done(&self, _: usize, _: bool) {}
}

const CLOSED: &str = "the study is closed";

impl GatheredStudy {
    fn run(&self) -> MutexGuard<'_, Option<StudyRun>> {
        self.run.lock().expect(UNBROKEN)
    }
}

fn open(run: &mut Option<StudyRun>) -> PyResult<&mut StudyRun> {
    run.as_mut().ok_or_else(|| of_value(CLOSED))
}
