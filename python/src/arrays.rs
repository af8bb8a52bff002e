//! Records as NumPy arrays, one per column.
//!
//! A column is gathered once and then belongs to NumPy; it is not copied again. Arrays are
//! read-only.

use bristle::model::record::Column;
use numpy::ndarray::Dimension;
use numpy::{Element, PyArray, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Makes an array read-only.
pub fn frozen<'py, T: Element, D: Dimension>(
    array: Bound<'py, PyArray<T, D>>,
) -> Bound<'py, PyAny> {
    let array = array.readwrite().make_nonwriteable();
    array.as_any().clone()
}

/// Columns of records by their keys, and the units of the columns.
pub type Columns<'py> = (Bound<'py, PyDict>, Bound<'py, PyDict>);

/// Adds some columns of `records` to others: whole numbers as integers, all others as floats.
pub fn add_columns<R: 'static>(
    (arrays, units): &Columns<'_>,
    columns: impl Iterator<Item = &'static Column<R>>,
    records: &[R],
) -> PyResult<()> {
    let py = arrays.py();
    for column in columns {
        let values = records.iter().map(|record| column.get(record));
        let array = if column.whole {
            frozen(PyArray1::from_vec(
                py,
                values.map(|value| value as i64).collect(),
            ))
        } else {
            frozen(PyArray1::from_vec(py, values.collect::<Vec<f64>>()))
        };
        arrays.set_item(column.key, array)?;
        units.set_item(column.key, column.unit)?;
    }
    Ok(())
}

/// Returns some columns of `records`.
pub fn table<'py, R>(
    py: Python<'py>,
    columns: &'static [Column<R>],
    records: &[R],
) -> PyResult<Columns<'py>> {
    let table = (PyDict::new(py), PyDict::new(py));
    add_columns(&table, columns.iter(), records)?;
    Ok(table)
}
