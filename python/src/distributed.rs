//! Cases of a study whose results another process gathers.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use bristle::simulation::{Sampling, Stop};
use bristle_app::store::journal::{StudyKeys, header};
use bristle_study::grid::{CaseResult, Study, simulate_cases};
use parking_lot::Mutex;
use pyo3::prelude::*;

use crate::error::of_value;
use crate::input::InputFile;
use crate::interrupt::on_a_thread_telling;
use crate::study::of_run;

/// Cases of a study that are simulated for another process.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct Cases {
    study: Study,
    keys: StudyKeys,
}

#[pymethods]
impl Cases {
    #[new]
    fn new(input: &InputFile, check: bool) -> PyResult<Self> {
        let study = input.study(check)?;
        Ok(Self {
            keys: StudyKeys::new(&study),
            study,
        })
    }

    /// Simulates some cases on one thread, and returns a journal with their results. Calls `tell`
    /// now and then; its exception stops the simulation.
    fn simulate(&self, py: Python<'_>, cases: Vec<usize>, tell: Py<PyAny>) -> PyResult<String> {
        if cases.iter().any(|&case| case >= self.study.case_count()) {
            return Err(of_value("the study has no such case"));
        }
        let stop = Stop::default();
        let tell = |py: Python<'_>| tell.call0(py).map(drop);
        let lines = Mutex::new(header().to_owned());
        let done = |case, result: CaseResult| {
            lines.lock().push_str(&self.keys.line(case, &result));
            ControlFlow::Continue(())
        };
        let one = NonZeroUsize::new(1);
        let simulated = on_a_thread_telling(py, &stop, tell, || {
            simulate_cases(
                &self.study,
                &cases,
                one,
                &stop,
                Sampling::default(),
                |_, _| {},
                done,
            )
        })?;
        simulated.map_err(|error| of_run(error.into()))?;
        Ok(lines.into_inner())
    }
}
