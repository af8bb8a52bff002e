//! Edges that become round, and filaments that wear.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use bristle::model::record::Record;
use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_app::report::removal::{removal_text, warnings};
use bristle_app::run::removal::{OF_REMOVAL, write_removal};
use bristle_app::store::results::absent_from;
use bristle_study::grid::Resources;
use bristle_study::grid::check::finer_pass;
use bristle_study::grid::removal::{Removal, remove};
use bristle_study::grid::uncertainty;
use bristle_study::text::layout::{WIDTH, Warning};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Columns, table};
use crate::error::{of_file, of_settings};
use crate::input::{InputFile, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// Both tables, numbers of the whole, its text, and its warnings.
type Followed<'py> = (
    Columns<'py>,
    Columns<'py>,
    Bound<'py, PyDict>,
    String,
    Vec<String>,
);

/// Follows the edge of the workpiece of `input` on some threads: the columns of `removal.csv` and
/// of `edge_work.csv`, numbers of the whole, its text, and its warnings. Its files are written to
/// the directory `out`, if there is one. Follows the edge again with more precision if it is to
/// `check`.
#[pyfunction]
pub fn wear<'py>(
    py: Python<'py>,
    input: &InputFile,
    means: (Option<NonZeroUsize>, Option<PathBuf>, bool),
    tell: Option<Py<PyAny>>,
) -> PyResult<Followed<'py>> {
    let (threads, out, check) = means;
    let settings = input.settings()?.clone();
    uncertainty::check(&settings).map_err(of_settings)?;
    let _occupied = occupied_for(out.as_deref(), &OF_REMOVAL)?;
    let stop = Stop::default();
    let resources = Resources {
        threads,
        memory: None,
    };
    let removal = on_a_thread_sharing(py, &stop, tell, |tell| {
        let share = if check { 0.5 } else { 1.0 };
        let follow = |settings: &Settings, begin: f64| {
            let removal = remove(settings, resources, &stop, &|passes, of| {
                tell(begin + share * (passes as f64 / of as f64))
            });
            removal.map_err(of_settings)
        };
        let removal = follow(&settings, 0.0)?;
        if let Some(out) = &out {
            write_removal(out, &input.short_name(), &settings, &removal).map_err(of_file)?;
        }
        let checked = check.then(|| follow(&finer_pass(&settings), share));
        let checked = checked.transpose()?;
        let changed = checked.map(|checked| removal.largest_change(&checked));
        Ok::<_, PyErr>((removal, changed))
    })?;
    let (removal, changed) = removal?;
    let numbers = PyDict::new(py);
    numbers.set_item("preston_m2_n", removal.preston_m2_n)?;
    numbers.set_item("included_angles_rad", removal.angles_rad.clone())?;
    numbers.set_item("change_when_refined", removal.change_when_refined)?;
    numbers.set_item("change_when_checked", changed)?;
    numbers.set_item("life_s", removal.life_s)?;
    let history = present(py, &removal, &removal.rows)?;
    let edge_work = present(py, &removal, &removal.simulated)?;
    let warnings = warnings(&settings, &removal)
        .iter()
        .map(Warning::plain)
        .collect();
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
