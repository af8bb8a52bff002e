//! Records as NumPy arrays, one per column, and back.
//!
//! A column is gathered once and then belongs to NumPy; it is not copied again. Arrays cannot be
//! written to.

use bristle::model::record::{Column, Record};
use numpy::ndarray::Dimension;
use numpy::{Element, PyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::of_value;

/// An array that cannot be written to.
pub fn frozen<'py, T: Element, D: Dimension>(
    array: Bound<'py, PyArray<T, D>>,
) -> Bound<'py, PyAny> {
    let array = array.readwrite().make_nonwriteable();
    array.as_any().clone()
}

/// The columns of `records` by their keys, added to `table`: whole numbers as integers, all others
/// as floats.
pub fn add_columns<R: Record>(
    table: &Bound<'_, PyDict>,
    columns: impl Iterator<Item = &'static Column<R>>,
    records: &[R],
) -> PyResult<()> {
    let py = table.py();
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
        table.set_item(column.key, array)?;
    }
    Ok(())
}

/// The columns of `records` by their keys.
pub fn columns<'py, R: Record>(py: Python<'py>, records: &[R]) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    add_columns(&table, R::COLUMNS.iter(), records)?;
    Ok(table)
}

/// The records of which `table` has the [`columns`].
pub fn records<R: Record + Clone>(table: &Bound<'_, PyDict>) -> PyResult<Vec<R>> {
    let mut records: Vec<R> = Vec::new();
    for column in R::COLUMNS {
        let array = table
            .get_item(column.key)?
            .ok_or_else(|| of_value(format!("no column `{}`", column.key)))?;
        let values: Vec<f64> = if column.whole {
            array
                .extract::<PyReadonlyArray1<'_, i64>>()?
                .as_array()
                .iter()
                .map(|&value| value as f64)
                .collect()
        } else {
            array
                .extract::<PyReadonlyArray1<'_, f64>>()?
                .as_array()
                .to_vec()
        };
        records.resize_with(values.len().max(records.len()), R::default);
        for (record, value) in records.iter_mut().zip(values) {
            column.set(record, value);
        }
    }
    Ok(records)
}

/// The columns of records by their keys, and their units.
pub type Columns<'py> = (Bound<'py, PyDict>, Bound<'py, PyDict>);

/// The [`columns`] of `records`, and their units.
pub fn table<'py, R: Record>(py: Python<'py>, records: &[R]) -> PyResult<Columns<'py>> {
    let units = PyDict::new(py);
    for Column { key, unit, .. } in R::COLUMNS {
        units.set_item(key, unit)?;
    }
    Ok((columns(py, records)?, units))
}
