//! The comparison of the simulator with exact solutions, other codes and the paper.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bristle_text::layout::WIDTH;
use bristle_validation::{self as validation, Extent};
use pyo3::prelude::*;

use crate::interrupt::unseen;

/// Ends a validation that nobody waits for.
struct Abandon(Arc<AtomicBool>);

impl Drop for Abandon {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Whether everything agrees, the table of `bristle validate`, and what `validation.csv` has.
#[pyfunction]
pub fn validate(py: Python<'_>, full: bool) -> PyResult<(bool, String, String)> {
    let extent = if full { Extent::Full } else { Extent::Quick };
    let abandoned = Arc::new(AtomicBool::new(false));
    let waiting = Abandon(Arc::clone(&abandoned));
    let outcomes = unseen(py, move || {
        validation::run(extent, || match abandoned.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
    })?;
    drop(waiting);
    let mut rows = Vec::new();
    validation::write_rows(&mut rows, &outcomes)?;
    Ok((
        validation::agrees(&outcomes),
        validation::table(&outcomes, WIDTH),
        String::from_utf8_lossy(&rows).into_owned(),
    ))
}
