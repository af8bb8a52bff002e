//! The tables of a study and of one simulation as Parquet: the columns of the CSV files, with
//! types.
//!
//! Numbers are 64-bit floats and integers, the status is text. Every column may be null, as the
//! metrics of a failed case are. The metadata of a file holds the settings of the results. Rows are
//! written in groups, so that memory does not grow with them.

use std::io::{self, Write};
use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::types::Type;

use crate::store::results::{TableCell, cells, keys, run_columns, run_rows};
use bristle::simulation::Sample;
use bristle_study::grid::{CaseResult, Study};

/// Rows of a group, the only ones in memory: some 4 MB.
pub const ROWS_OF_GROUP: usize = 4096;

/// Writes `runs.parquet`, with the columns and rows of
/// [`write_runs`](crate::store::results::write_runs); `settings` is the text of `study.json`.
pub fn write_runs_parquet(
    out: impl Write + Send,
    study: &Study,
    results: &[CaseResult],
    settings: &str,
) -> io::Result<()> {
    write_table(
        out,
        &run_columns(study, results),
        run_rows(study, results),
        ("study.json", settings),
    )
}

/// Writes `history.parquet`, with the columns and rows of
/// [`write_history`](crate::store::results::write_history); `settings` is the text of `case.json`.
pub fn write_history_parquet(
    out: impl Write + Send,
    history: &[Sample],
    settings: &str,
) -> io::Result<()> {
    let rows = history.iter().map(|sample| cells(Some(sample)));
    write_table(out, &keys::<Sample>(), rows, ("case.json", settings))
}

/// Writes a table of at least one row, whose cells have the types of the columns.
fn write_table(
    out: impl Write + Send,
    names: &[&str],
    rows: impl Iterator<Item = Vec<TableCell>>,
    (key, settings): (&str, &str),
) -> io::Result<()> {
    let mut rows = rows.peekable();
    let first = rows
        .peek()
        .ok_or_else(|| io::Error::other("a table without rows has no types"))?;
    let columns: Vec<_> = names
        .iter()
        .zip(first)
        .map(|(name, cell)| column(name, cell).map(Arc::new))
        .collect::<io::Result<_>>()?;
    let schema = Type::group_type_builder("schema")
        .with_fields(columns)
        .build()?;
    let pair = |key: &str, value: &str| KeyValue::new(key.to_owned(), value.to_owned());
    let metadata = vec![
        pair("bristle_version", env!("CARGO_PKG_VERSION")),
        pair(key, settings),
    ];
    let properties = WriterProperties::builder()
        .set_key_value_metadata(Some(metadata))
        .build();

    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    while rows.peek().is_some() {
        let mut group: Vec<_> = rows
            .by_ref()
            .take(ROWS_OF_GROUP)
            .map(Vec::into_iter)
            .collect();
        let mut group_writer = writer.next_row_group()?;
        for _ in names {
            write_column(
                &mut group_writer,
                group.iter_mut().filter_map(Iterator::next).collect(),
            )?;
        }
        group_writer.close()?;
    }
    writer.close()?;
    Ok(())
}

/// Returns the column of cells like `cell`.
fn column(name: &str, cell: &TableCell) -> io::Result<Type> {
    let (physical, logical) = match cell {
        TableCell::Real(_) => (Physical::DOUBLE, None),
        TableCell::Count(_) => (Physical::INT64, None),
        TableCell::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder =
        Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    Ok(builder.with_logical_type(logical).build()?)
}

/// Writes the cells of one column, which are of one type.
fn write_column<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    cells: Vec<TableCell>,
) -> io::Result<()> {
    let present: Vec<i16> = cells
        .iter()
        .map(|cell| {
            i16::from(!matches!(
                cell,
                TableCell::Real(None) | TableCell::Count(None)
            ))
        })
        .collect();
    let (mut reals, mut counts, mut texts) = (Vec::new(), Vec::new(), Vec::new());
    let kind = cells.first().cloned();
    for cell in cells {
        match cell {
            TableCell::Real(value) => reals.extend(value),
            TableCell::Count(value) => counts.extend(value.map(|value| value as i64)),
            TableCell::Text(text) => texts.push(ByteArray::from(text.into_bytes())),
        }
    }
    match kind {
        Some(TableCell::Real(_)) => write_values::<DoubleType, _>(group, &reals, &present),
        Some(TableCell::Count(_)) => write_values::<Int64Type, _>(group, &counts, &present),
        Some(TableCell::Text(_)) => write_values::<ByteArrayType, _>(group, &texts, &present),
        None => Ok(()),
    }
}

fn write_values<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    present: &[i16],
) -> io::Result<()> {
    let mut column = group
        .next_column()?
        .ok_or_else(|| io::Error::other("the table has more cells than columns"))?;
    column
        .typed::<T>()
        .write_batch(values, Some(present), None)?;
    Ok(column.close()?)
}
