//! The comparison of the simulator with exact solutions, other codes and the paper.

use std::ops::ControlFlow;

use bristle::simulation::Stop;
use bristle_text::layout::WIDTH;
use bristle_validation::{self as validation, Extent};
use pyo3::prelude::*;

use crate::interrupt::unseen;

/// Ends a validation that nobody waits for.
struct Abandon(Stop);

impl Drop for Abandon {
    fn drop(&mut self) {
        self.0.request();
    }
}

/// Whether everything agrees, the table of `bristle validate`, and what `validation.csv` has.
#[pyfunction]
pub fn validate(py: Python<'_>, full: bool) -> PyResult<(bool, String, String)> {
    let extent = if full { Extent::Full } else { Extent::Quick };
    let abandoned = Stop::default();
    let waiting = Abandon(abandoned.clone());
    let outcomes = unseen(py, move || {
        validation::run(extent, || match abandoned.is_requested() {
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
