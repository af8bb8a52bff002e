//! Parquet files hold what the CSV files hold, with types.

use std::io::Write;

use bristle::model::record::Record;
use bristle::simulation::{Statistics, simulate_with_history};
use bristle_grid::brush::{Having, metric_columns};
use bristle_grid::run_study;
use bristle_input::document::Document;
use bristle_report::parquet::{ROWS_OF_GROUP, write_history_parquet, write_runs_parquet};
use bristle_store::results::{write_history, write_runs};
use parquet::basic::Type as Physical;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

#[path = "../../input/src/testing.rs"]
mod testing;
use testing::brush;

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

/// Holds a Parquet file against the CSV file, cell by cell; the number of empty cells, and of
/// groups of rows.
fn compare(bytes: &[u8], table: &[u8], metadata: (&str, &str)) -> (usize, usize) {
    let mut file = tempfile::tempfile().expect("a file");
    file.write_all(bytes).expect("room for it");
    let reader = SerializedFileReader::new(file).expect("a Parquet file");
    let pairs = reader
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .expect("metadata");
    let value = |key: &str| {
        pairs
            .iter()
            .find(|pair| pair.key == key)
            .and_then(|pair| pair.value.as_deref())
    };
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
        for ((name, value), (expected, cell)) in
            row.get_column_iter().zip(heading.iter().zip(&record))
        {
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
    assert!(
        rows.next().is_none(),
        "there are more rows than in the CSV file"
    );
    (empty, reader.num_row_groups())
}

#[test]
fn a_study_is_that_of_the_csv_file() {
    let study = Document::parse(FILE, "case.toml")
        .and_then(|document| document.study())
        .expect("a study");
    let results = run_study(&study, None, || {}).expect("threads");
    assert!(results[..4].iter().all(Result::is_err) && results[4..].iter().all(Result::is_ok));
    let (mut bytes, mut table) = (Vec::new(), Vec::new());
    write_runs_parquet(&mut bytes, &study, &results, "settings").expect("a file");
    write_runs(&mut table, &study, &results).expect("a table");
    // The metrics and the numbers of the solver’s work of each case that failed.
    let of_a_case = metric_columns(Having::of_study(&study)).count() + Statistics::COLUMNS.len();
    assert_eq!(
        compare(&bytes, &table, ("study.json", "settings")),
        (4 * of_a_case, 1)
    );
}

#[test]
fn a_study_that_has_failed_altogether_keeps_its_types() {
    let study = Document::parse(FILE, "case.toml")
        .and_then(|document| document.study())
        .expect("a study");
    let results = vec![Err("failed".to_owned()); study.case_count()];
    let mut bytes = Vec::new();
    write_runs_parquet(&mut bytes, &study, &results, "").expect("a file");
    let mut file = tempfile::tempfile().expect("a file");
    file.write_all(&bytes).expect("room for it");
    let reader = SerializedFileReader::new(file).expect("a Parquet file");
    let columns = reader.metadata().file_metadata().schema_descr().columns();
    let physical = |name: &str| {
        columns
            .iter()
            .find(|column| column.name() == name)
            .map(|column| column.physical_type())
    };
    assert_eq!(physical("segments"), Some(Physical::INT64));
    assert_eq!(physical("contact.stiffness_n_m"), Some(Physical::DOUBLE));
    assert_eq!(physical("contact_time_ratio"), Some(Physical::DOUBLE));
    assert_eq!(physical("contact_count"), Some(Physical::INT64));
    assert_eq!(physical("status"), Some(Physical::BYTE_ARRAY));
}

#[test]
fn a_long_history_stands_in_several_groups() {
    let settings = Document::parse(FILE, "case.toml")
        .and_then(|document| document.settings())
        .expect("settings");
    let history = simulate_with_history(&settings, 2 * ROWS_OF_GROUP + 1)
        .expect("a pass")
        .history;
    let (mut bytes, mut table) = (Vec::new(), Vec::new());
    write_history_parquet(&mut bytes, &history, "settings").expect("a file");
    write_history(&mut table, &history).expect("a table");
    assert_eq!(compare(&bytes, &table, ("case.json", "settings")), (0, 3));
}
