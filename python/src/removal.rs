//! Edges that become round, and filaments that wear.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use bristle::model::record::Record;
use bristle::simulation::Stop;
use bristle_app::report::removal::{removal_text, warnings};
use bristle_app::run::removal::{OF_REMOVAL, write_removal};
use bristle_app::store::results::absent_from;
use bristle_study::grid::Resources;
use bristle_study::grid::removal::{Removal, remove};
use bristle_study::grid::uncertainty::check;
use bristle_study::text::layout::{WIDTH, Warning};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Columns, table};
use crate::error::{of_file, of_settings};
use crate::input::{Input, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// Both tables, numbers of the whole, its text, and its warnings.
type Followed<'py> = (
    Columns<'py>,
    Columns<'py>,
    Bound<'py, PyDict>,
    String,
    Vec<String>,
);

/// Follows the edge of the workpiece of `input` on some threads. Returns the columns of
/// `removal.csv` and of `edge_work.csv`, numbers of the whole, its text, and its warnings. Writes
/// the files to the directory `out`, if any.
#[pyfunction]
pub fn wear<'py>(
    py: Python<'py>,
    input: &Input,
    means: (Option<NonZeroUsize>, Option<PathBuf>),
    tell: Option<Py<PyAny>>,
) -> PyResult<Followed<'py>> {
    let (threads, out) = means;
    let settings = input.settings()?.clone();
    check(&settings).map_err(of_settings)?;
    let _occupied = occupied_for(out.as_deref(), &OF_REMOVAL)?;
    let stop = Stop::default();
    let resources = Resources {
        threads,
        memory: None,
    };
    let removal = on_a_thread_sharing(py, &stop, tell, |tell| {
        remove(&settings, resources, &stop, &|passes, of| {
            tell(passes as f64 / of as f64)
        })
    })?;
    let removal = removal.map_err(of_settings)?;
    if let Some(out) = &out {
        write_removal(out, &input.short_name(), &settings, &removal).map_err(of_file)?;
    }
    let numbers = PyDict::new(py);
    numbers.set_item("preston_m2_n", removal.preston_m2_n)?;
    numbers.set_item("included_angles_rad", removal.angles_rad.clone())?;
    numbers.set_item("change_when_refined", removal.change_when_refined)?;
    numbers.set_item("life_s", removal.life_s)?;
    let history = present(py, &removal, &removal.rows)?;
    let edge_work = present(py, &removal, &removal.simulated)?;
    let warnings = warnings(&removal).iter().map(Warning::plain).collect();
    Ok((
        history,
        edge_work,
        numbers,
        removal_text(&settings, &removal, WIDTH),
        warnings,
    ))
}

/// Returns the columns of records that a removal has.
fn present<'py, R: Record>(
    py: Python<'py>,
    removal: &Removal,
    records: &[R],
) -> PyResult<Columns<'py>> {
    let (table, units) = table(py, R::COLUMNS, records)?;
    for key in absent_from(removal).filter(|key| R::COLUMNS.iter().any(|column| column.key == *key))
    {
        table.del_item(key)?;
        units.del_item(key)?;
    }
    Ok((table, units))
}
