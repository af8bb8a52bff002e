//! Convergence of a result with the precision of its computation.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use bristle::simulation::Stop;
use bristle_app::insight::convergence::converge as judged;
use bristle_app::report::convergence::convergence_text;
use bristle_app::run::convergence::{OF_CONVERGENCE, write_convergence};
use bristle_app::run::{ProgressObserver, RunContext, StudyRun};
use bristle_study::grid::{CaseResult, Resources, Study};
use bristle_study::text::layout::WIDTH;
use pyo3::prelude::*;

use crate::error::{of_file, of_settings};
use crate::input::{InputFile, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// Reports the share of finished cases.
struct Share<'a> {
    tell: &'a (dyn Fn(f64) + Sync),
    done: AtomicUsize,
    cases: usize,
}

impl ProgressObserver for Share<'_> {
    fn case_done(&self, _: usize, _: bool) {
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        (self.tell)(done as f64 / self.cases as f64);
    }
}

/// Returns the text of `converge.json` for the settings of `input`, and the text that the program
/// prints. Writes the files to the directory `out`, if any.
#[pyfunction]
pub fn converge(
    py: Python<'_>,
    input: &InputFile,
    means: (Option<NonZeroUsize>, Option<PathBuf>),
    tell: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let (threads, out) = means;
    let settings = input.settings()?.clone();
    let _occupied = occupied_for(out.as_deref(), &OF_CONVERGENCE)?;
    let stop = Stop::default();
    let resources = Resources {
        threads,
        memory: None,
    };
    let convergence = on_a_thread_sharing(py, &stop, tell, |tell| {
        let simulate = |study: Study| -> Result<Vec<CaseResult>, String> {
            let share = Share {
                tell,
                done: AtomicUsize::new(0),
                cases: study.case_count(),
            };
            let mut run = StudyRun::new(study);
            let context = RunContext {
                resources,
                stop: &stop,
                observer: &share,
            };
            run.simulate(|_| true, &context)
                .map_err(|error| error.to_string())?;
            let results: Option<Vec<CaseResult>> = run.results().iter().cloned().collect();
            results.ok_or_else(|| "the convergence was stopped".to_owned())
        };
        judged(settings, simulate, |_, _| (), |error| error.to_string())
    })?;
    let convergence = convergence.map_err(of_settings)?;
    if let Some(out) = &out {
        write_convergence(out, &convergence).map_err(of_file)?;
    }
    Ok((convergence.json(), convergence_text(&convergence, WIDTH)))
}
