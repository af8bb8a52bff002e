//! Studies whose cases are simulated by other processes: what each of them does, and what gathers their results.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};

use bristle::simulation::{Sampling, Stop};
use bristle_grid::{CaseResult, Study, Waiting, simulate_cases, waiting_cases, without_result};
use bristle_report::page::Recorder;
use bristle_store::journal::Journal;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::error::{of_file, of_input, of_value};
use crate::input::Input;
use crate::interrupt::{on_a_thread, on_a_thread_telling};
use crate::study::{Failure, INCOMPLETE, Output, Progress, SimulatedStudy, begin, study_of};

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
        simulated.map_err(Failure::Threads)?;
        Ok(lines.into_inner().expect(UNBROKEN))
    }
}

/// A study whose cases are simulated elsewhere and gathered here.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct GatheredStudy {
    input: Py<Input>,
    study: Study,
    journal: Journal,
    gathered: Mutex<Gathered>,
}

struct Gathered {
    results: Vec<Option<CaseResult>>,
    output: Option<Output>,
    progress: Progress,
}

#[pymethods]
impl GatheredStudy {
    /// A study with its results and its journal in the directory `out`, from which it goes on.
    #[new]
    fn new(input: Py<Input>, out: Option<PathBuf>, restart: bool, memory: Option<u64>) -> PyResult<Self> {
        let study = study_of(input.get(), NonZeroUsize::new(1), memory)?;
        let (output, results, progress) = begin(&study, out, restart)?;
        let gathered = Mutex::new(Gathered { results, output, progress });
        Ok(Self { journal: Journal::new(&study), input, study, gathered })
    }

    /// The numbers of cases that are done, of all cases, and of those that failed.
    fn counts(&self) -> (usize, usize, usize) {
        let Gathered { progress, .. } = &*self.gathered();
        let (done, failed) = progress.counts();
        (done, self.study.case_count(), failed)
    }

    /// Whether its cases are brushes.
    fn has_brush(&self) -> bool {
        self.study.has_brush()
    }

    /// The cases that are still to be simulated, with the numbers of their kinds and the work that each takes.
    fn waiting(&self) -> Vec<(usize, usize, f64)> {
        let cases = without_result(&self.study, &self.gathered().results);
        waiting_cases(&self.study, &cases).into_iter().map(|Waiting { case, kind, work }| (case, kind, work)).collect()
    }

    /// Takes a journal of cases. A case that has a result keeps it.
    fn take(&self, lines: &str) -> PyResult<()> {
        let Gathered { results, output, progress } = &mut *self.gathered();
        let mut written = ControlFlow::Continue(());
        let read = self.journal.read_each(&self.study, lines.as_bytes(), |case, result| {
            if results[case].is_none() {
                progress.count(&result);
                if let Some(output) = output {
                    written = output.journal.append(case, &result);
                }
                results[case] = Some(result);
            }
        });
        if read.map_err(of_value)?.torn > 0 {
            return Err(of_value("they are damaged"));
        }
        match output {
            Some(output) if written.is_break() => output.journal.settle().map_err(|error| of_file(&error)),
            _ => Ok(()),
        }
    }

    /// Closes the journal. Its directory is free after that.
    fn close(&self) -> PyResult<()> {
        let output = self.gathered().output.take();
        output.map_or(Ok(()), |mut output| output.journal.settle()).map_err(|error| of_file(&error))
    }

    /// Writes the files of the study, all of whose cases have results.
    fn finish(&self, py: Python<'_>) -> PyResult<SimulatedStudy> {
        let stop = Stop::default();
        on_a_thread(py, &stop, || {
            let Gathered { results, output, .. } = &mut *self.gathered();
            let results: Option<Vec<_>> = results.iter().cloned().collect();
            let results = results.ok_or_else(|| PyRuntimeError::new_err(INCOMPLETE)).map_err(Failure::Input)?;
            if let Some(output) = output {
                output.journal.settle().map_err(Failure::File)?;
                let recorder = Recorder::new(&self.study).until(&stop);
                output.write(self.input.get(), &self.study, &results, recorder, None, &stop)?;
            }
            Ok(SimulatedStudy { study: self.study.clone(), results })
        })?
        .map_err(|failure: Failure| PyErr::from(failure))
    }
}

impl GatheredStudy {
    fn gathered(&self) -> MutexGuard<'_, Gathered> {
        self.gathered.lock().expect(UNBROKEN)
    }
}
