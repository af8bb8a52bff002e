//! Edges that grow round, and filaments that wear.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use bristle::model::record::Record;
use bristle::simulation::Stop;
use bristle_grid::Resources;
use bristle_grid::removal::{Removal, RemovalError, RemovalRow, SimulatedEdge, remove as followed};
use bristle_grid::uncertainty::check;
use bristle_report::removal::{removal_text, warnings};
use bristle_run::removal::{OF_REMOVAL, write_removal};
use bristle_store::results::absent_from;
use bristle_store::staged::{occupy, prepare_directory};
use bristle_text::layout::{WIDTH, Warning};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{columns, units};
use crate::error::{of_file, of_settings};
use crate::input::Input;
use crate::interrupt::{on_a_thread_telling, tell_share};

/// Columns by their keys, and their units.
type Columns<'py> = (Bound<'py, PyDict>, Bound<'py, PyDict>);
/// Both tables, numbers of the whole, its text, and its warnings.
type Followed<'py> = (Columns<'py>, Columns<'py>, Bound<'py, PyDict>, String, Vec<String>);

/// Follows the edge of the workpiece of `input` on some threads: the columns of `removal.csv` and of `edge_work.csv`, numbers of the whole, its
/// text, and its warnings. Its files are written to the directory `out`, if there is one.
#[pyfunction]
pub fn remove<'py>(
    py: Python<'py>,
    input: &Input,
    means: (Option<NonZeroUsize>, Option<PathBuf>),
    tell: Option<Py<PyAny>>,
) -> PyResult<Followed<'py>> {
    let (threads, out) = means;
    let settings = input.settings()?.clone();
    check(&settings).map_err(|violation| of_settings(violation.to_string()))?;
    let occupied = match &out {
        Some(out) => {
            prepare_directory(out).map_err(|error| of_file(&error))?;
            let is_ours = |name: &str| OF_REMOVAL.contains(&name);
            Some(occupy(out, &[("", &is_ours)]).map_err(|error| of_file(&error))?)
        }
        None => None,
    };
    let (stop, done) = (Stop::default(), AtomicU64::default());
    let tell = |py: Python<'_>| tell_share(py, tell.as_ref(), f64::from_bits(done.load(Ordering::Relaxed)));
    let resources = Resources { threads, memory: None };
    let removal = on_a_thread_telling(py, &stop, tell, || {
        let tell = |passes: usize, of: usize| done.store((passes as f64 / of as f64).to_bits(), Ordering::Relaxed);
        followed(&settings, resources, &stop, &tell)
    })?;
    let removal = removal.map_err(|error: RemovalError| of_settings(error.to_string()))?;
    if let (Some(out), Some(_occupied)) = (&out, occupied) {
        write_removal(out, &input.short_name(), &settings, &removal).map_err(|error| of_file(&error))?;
    }
    let numbers = PyDict::new(py);
    numbers.set_item("preston_m2_n", removal.preston_m2_n)?;
    numbers.set_item("included_angles_rad", removal.angles_rad.clone())?;
    numbers.set_item("change_when_refined", removal.change_when_refined)?;
    numbers.set_item("life_s", removal.life_s)?;
    let history = table::<RemovalRow>(py, &removal, &removal.rows)?;
    let edge_work = table::<SimulatedEdge>(py, &removal, &removal.simulated)?;
    let warnings = warnings(&removal).iter().map(Warning::plain).collect();
    Ok((history, edge_work, numbers, removal_text(&settings, &removal, WIDTH), warnings))
}

/// The columns of records that a removal has.
fn table<'py, R: Record>(py: Python<'py>, removal: &Removal, records: &[R]) -> PyResult<Columns<'py>> {
    let (table, units) = (columns(py, records)?, units::<R>(py)?);
    for key in absent_from(removal).filter(|key| R::COLUMNS.iter().any(|column| column.key == *key)) {
        table.del_item(key)?;
        units.del_item(key)?;
    }
    Ok((table, units))
}
