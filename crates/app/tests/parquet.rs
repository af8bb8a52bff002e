//! Parquet files have the types of their columns, and the required number of row groups. pyarrow
//! compares them with the CSV files, cell by cell (`tests/formats/`).

use std::fs::File;
use std::io::Write;

use bristle::simulation::simulate_with_history;
use bristle_app::report::parquet::{ROWS_OF_GROUP, write_history_parquet, write_runs_parquet};
use bristle_study::grid::CaseResult;
use bristle_study::input::document::Document;
use parquet::basic::Type as Physical;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;

#[path = "../../study/src/input/testing.rs"]
mod testing;
use testing::brush;

const FILE: &str = concat!(
    brush!(3),
    "
    [process]
    brushing_velocity_m_s = 10.0
    penetration_depth_m = 1.0e-3
    [study]
    \"contact.stiffness_n_m\" = [1e5, 2e5]
    "
);

fn document() -> Document<'static> {
    Document::parse(FILE, "case.toml").expect("a document")
}

fn read(bytes: &[u8]) -> SerializedFileReader<File> {
    let mut file = tempfile::tempfile().expect("a file");
    file.write_all(bytes).expect("room for it");
    SerializedFileReader::new(file).expect("a Parquet file")
}

#[test]
fn a_study_that_has_failed_altogether_keeps_its_types() {
    let study = document().study().expect("a study");
    let results: Vec<CaseResult> = vec![Err("failed".to_owned()); study.case_count()];
    let mut bytes = Vec::new();
    write_runs_parquet(&mut bytes, &study, &results, "").expect("a file");
    let reader = read(&bytes);
    let columns = reader.metadata().file_metadata().schema_descr().columns();
    for (name, expected) in [
        ("segments", Physical::INT64),
        ("contact.stiffness_n_m", Physical::DOUBLE),
        ("contact_time_ratio", Physical::DOUBLE),
        ("contact_count", Physical::INT64),
        ("status", Physical::BYTE_ARRAY),
    ] {
        let own = columns.iter().find(|column| column.name() == name);
        assert_eq!(
            own.map(|column| column.physical_type()),
            Some(expected),
            "{name}"
        );
    }
}

#[test]
fn a_long_history_stands_in_several_groups() {
    let settings = document().settings().expect("settings");
    let simulation = simulate_with_history(&settings, 2 * ROWS_OF_GROUP + 1).expect("a pass");
    let mut bytes = Vec::new();
    write_history_parquet(&mut bytes, &simulation.history, "settings").expect("a file");
    let reader = read(&bytes);
    assert_eq!(reader.num_row_groups(), 3);
    let mut rows = reader.get_row_iter(None).expect("rows");
    for sample in &simulation.history {
        let row = rows.next().expect("as many rows").expect("a whole row");
        let first_and_last =
            [0, row.len() - 1].map(|column| row.get_double(column).expect("a number"));
        assert_eq!(
            first_and_last,
            [sample.time_s, sample.peak_contact_normal_force_n]
        );
    }
    assert!(rows.next().is_none());
}
