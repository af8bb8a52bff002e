//! The tables of a study and of one simulation as Parquet: the columns of the CSV files, with types.
//!
//! Numbers are 64-bit floats and integers, the status is text. Every column may be null, which the metrics of a failed case are.
//! The metadata of a file holds what the results belong to. Rows are written in groups, so that memory does not grow with them.

use std::io::{self, Write};
use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::types::Type;

use bristle::simulation::Sample;
use bristle_study::results::{Cell, cells, keys, run_columns, run_rows};
use bristle_study::study::{CaseResult, Study};

/// Rows of a group: all that is held in memory, some 4 MB.
const ROWS_OF_GROUP: usize = 4096;

/// Writes `runs.parquet`, with the columns and rows of [`write_runs`](bristle_study::results::write_runs); `settings` is the text of `study.json`.
pub fn write_runs_parquet(
    out: impl Write + Send,
    study: &Study,
    results: &[CaseResult],
    settings: &str,
) -> io::Result<()> {
    write_table(out, &run_columns(study), run_rows(study, results), ("study.json", settings))
}

/// Writes `history.parquet`, with the columns and rows of [`write_history`](bristle_study::results::write_history); `settings` is the text of
/// `case.json`.
pub fn write_history_parquet(out: impl Write + Send, history: &[Sample], settings: &str) -> io::Result<()> {
    let rows = history.iter().map(|sample| cells(Some(sample)));
    write_table(out, &keys::<Sample>(), rows, ("case.json", settings))
}

/// Writes a table of at least one row, whose cells have the types of the columns.
fn write_table(
    out: impl Write + Send,
    names: &[&str],
    rows: impl Iterator<Item = Vec<Cell>>,
    (key, settings): (&str, &str),
) -> io::Result<()> {
    let mut rows = rows.peekable();
    let first = rows.peek().ok_or_else(|| io::Error::other("a table without rows has no types"))?;
    let columns: Vec<_> =
        names.iter().zip(first).map(|(name, cell)| column(name, cell).map(Arc::new)).collect::<io::Result<_>>()?;
    let schema = Type::group_type_builder("schema").with_fields(columns).build()?;
    let pair = |key: &str, value: &str| KeyValue::new(key.to_owned(), value.to_owned());
    let metadata = vec![pair("bristle_version", env!("CARGO_PKG_VERSION")), pair(key, settings)];
    let properties = WriterProperties::builder().set_key_value_metadata(Some(metadata)).build();

    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    while rows.peek().is_some() {
        let mut group: Vec<_> = rows.by_ref().take(ROWS_OF_GROUP).map(Vec::into_iter).collect();
        let mut group_writer = writer.next_row_group()?;
        for _ in names {
            write_column(&mut group_writer, group.iter_mut().filter_map(Iterator::next).collect())?;
        }
        group_writer.close()?;
    }
    writer.close()?;
    Ok(())
}

/// The column of cells like `cell`.
fn column(name: &str, cell: &Cell) -> io::Result<Type> {
    let (physical, logical) = match cell {
        Cell::Real(_) => (Physical::DOUBLE, None),
        Cell::Count(_) => (Physical::INT64, None),
        Cell::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    Ok(builder.with_logical_type(logical).build()?)
}

/// Writes the cells of one column, which are of one type.
fn write_column<W: Write + Send>(group: &mut SerializedRowGroupWriter<'_, W>, cells: Vec<Cell>) -> io::Result<()> {
    let present: Vec<i16> =
        cells.iter().map(|cell| i16::from(!matches!(cell, Cell::Real(None) | Cell::Count(None)))).collect();
    let (mut reals, mut counts, mut texts) = (Vec::new(), Vec::new(), Vec::new());
    let kind = cells.first().cloned();
    for cell in cells {
        match cell {
            Cell::Real(value) => reals.extend(value),
            Cell::Count(value) => counts.extend(value.map(|value| value as i64)),
            Cell::Text(text) => texts.push(ByteArray::from(text.into_bytes())),
        }
    }
    match kind {
        Some(Cell::Real(_)) => write_values::<DoubleType, _>(group, &reals, &present),
        Some(Cell::Count(_)) => write_values::<Int64Type, _>(group, &counts, &present),
        Some(Cell::Text(_)) => write_values::<ByteArrayType, _>(group, &texts, &present),
        None => Ok(()),
    }
}

fn write_values<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    present: &[i16],
) -> io::Result<()> {
    let mut column = group.next_column()?.ok_or_else(|| io::Error::other("the table has more cells than columns"))?;
    column.typed::<T>().write_batch(values, Some(present), None)?;
    Ok(column.close()?)
}

#[cfg(test)]
mod tests {
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::Field;

    use super::*;
    use crate::testing::brush;
    use bristle::model::metrics::Metrics;
    use bristle::model::record::Record;
    use bristle::simulation::{Statistics, simulate_with_history};
    use bristle_study::document::Document;
    use bristle_study::results::{write_history, write_runs};
    use bristle_study::study::run_study;

    const FILE: &str = concat!(
        brush!(3),
        "
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        \"contact.stiffness_n_m\" = [1e300, 1e5]
        brushing_velocity_m_s = { start = 10.1, stop = 10.4, step = 0.1 }
        "
    );

    /// Holds a Parquet file against the CSV file, cell by cell; the number of empty cells, and of groups of rows.
    fn compare(bytes: &[u8], table: &[u8], metadata: (&str, &str)) -> (usize, usize) {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(bytes).expect("room for it");
        let reader = SerializedFileReader::new(file).expect("a Parquet file");
        let pairs = reader.metadata().file_metadata().key_value_metadata().expect("metadata");
        let value = |key: &str| pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.as_deref());
        assert_eq!(value("bristle_version"), Some(env!("CARGO_PKG_VERSION")));
        assert_eq!(value(metadata.0), Some(metadata.1));

        let mut csv = csv::Reader::from_reader(table);
        let heading = csv.headers().expect("a heading").clone();
        let mut rows = reader.get_row_iter(None).expect("rows");
        let mut empty = 0;
        for record in csv.records() {
            let record = record.expect("a row");
            let row = rows.next().expect("as many rows").expect("a whole row");
            assert_eq!(row.len(), heading.len());
            for ((name, value), (expected, cell)) in row.get_column_iter().zip(heading.iter().zip(&record)) {
                assert_eq!(name, expected);
                match value {
                    Field::Double(value) => assert_eq!(cell.parse(), Ok(*value), "{name}"),
                    Field::Long(value) => assert_eq!(cell.parse(), Ok(*value), "{name}"),
                    Field::Str(value) => assert_eq!(cell, value, "{name}"),
                    Field::Null => {
                        assert_eq!(cell, "", "{name}");
                        empty += 1;
                    }
                    other => panic!("{name} is {other:?}"),
                }
            }
        }
        assert!(rows.next().is_none(), "there are more rows than in the CSV file");
        (empty, reader.num_row_groups())
    }

    #[test]
    fn a_study_is_that_of_the_csv_file() {
        let study = Document::parse(FILE, "case.toml").and_then(|document| document.study()).expect("a study");
        let results = run_study(&study, None, || {}).expect("threads");
        assert!(results[..4].iter().all(Result::is_err) && results[4..].iter().all(Result::is_ok));
        let (mut bytes, mut table) = (Vec::new(), Vec::new());
        write_runs_parquet(&mut bytes, &study, &results, "settings").expect("a file");
        write_runs(&mut table, &study, &results).expect("a table");
        // The metrics and the numbers of the solver’s work of each case that failed.
        let of_a_case = Metrics::COLUMNS.len() + Statistics::COLUMNS.len();
        assert_eq!(compare(&bytes, &table, ("study.json", "settings")), (4 * of_a_case, 1));
    }

    #[test]
    fn a_study_that_has_failed_altogether_keeps_its_types() {
        let study = Document::parse(FILE, "case.toml").and_then(|document| document.study()).expect("a study");
        let results = vec![Err("failed".to_owned()); study.case_count()];
        let mut bytes = Vec::new();
        write_runs_parquet(&mut bytes, &study, &results, "").expect("a file");
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(&bytes).expect("room for it");
        let reader = SerializedFileReader::new(file).expect("a Parquet file");
        let columns = reader.metadata().file_metadata().schema_descr().columns();
        let physical =
            |name: &str| columns.iter().find(|column| column.name() == name).map(|column| column.physical_type());
        assert_eq!(physical("segments"), Some(Physical::INT64));
        assert_eq!(physical("contact.stiffness_n_m"), Some(Physical::DOUBLE));
        assert_eq!(physical("contact_time_ratio"), Some(Physical::DOUBLE));
        assert_eq!(physical("contact_count"), Some(Physical::INT64));
        assert_eq!(physical("status"), Some(Physical::BYTE_ARRAY));
    }

    #[test]
    fn a_long_history_stands_in_several_groups() {
        let settings = Document::parse(FILE, "case.toml").and_then(|document| document.settings()).expect("settings");
        let history = simulate_with_history(&settings, 2 * ROWS_OF_GROUP + 1).expect("a pass").history;
        let (mut bytes, mut table) = (Vec::new(), Vec::new());
        write_history_parquet(&mut bytes, &history, "settings").expect("a file");
        write_history(&mut table, &history).expect("a table");
        assert_eq!(compare(&bytes, &table, ("case.json", "settings")), (0, 3));
    }
}
