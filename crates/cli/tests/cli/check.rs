//! `--check`: results that are computed again with more precision.

use std::fs;

use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{bristle, brush};

const FILE: &str = concat!(
    brush!(4),
    "
[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[study]
brushing_velocity_m_s = [10.0, 15.0]
penetration_depth_m = [1.0e-3, 2.0e-3]
"
);

/// A tolerance at which errors are seen.
const COARSE: &str = "--set solver.relative_tolerance=1e-3";

fn directory(text: &str) -> TempDir {
    let directory = TempDir::new().expect("a temporary directory");
    fs::write(directory.path().join("case.toml"), text).expect("the file can be written");
    directory
}

/// What a successful command prints.
fn printed(directory: &TempDir, arguments: &str) -> String {
    let output = bristle(directory.path(), arguments).output().expect("the program runs");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn json(directory: &TempDir, path: &str) -> Value {
    let text = fs::read_to_string(directory.path().join(path)).expect("the file is there");
    serde_json::from_str(&text).expect("JSON")
}

/// A column of `runs.csv`, if it has this one.
fn column(directory: &TempDir, name: &str) -> Option<Vec<String>> {
    let mut reader = csv::Reader::from_path(directory.path().join("results/runs.csv")).expect("runs.csv");
    let position = reader.headers().expect("a heading").iter().position(|heading| heading == name)?;
    Some(reader.records().map(|row| row.expect("a row")[position].to_owned()).collect())
}

#[test]
fn a_contact_is_compared_with_a_tenth_of_its_tolerance() {
    let directory = directory(FILE);
    let text = printed(&directory, &format!("simulate case.toml --out one --check --no-figures {COARSE}"));
    assert!(text.contains("tenth of the tolerance") && text.contains("change"), "{text}");
    let check = json(&directory, "one/check.json");
    let metrics = json(&directory, "one/metrics.json");
    let tenth = format!("simulate case.toml --out tenth --no-figures {}", COARSE.replace("1e-3", "1e-4"));
    printed(&directory, &tenth);
    let finer = json(&directory, "tenth/metrics.json");
    let mut changed = 0;
    // A residual is an error by itself.
    for column in Metrics::COLUMNS.iter().filter(|column| column.key != "energy_residual") {
        let change = &check["metrics"][column.key];
        assert_eq!(change["value"].as_f64(), metrics[column.key].as_f64().or(Some(column.get(&Metrics::default()))));
        let [value, checked] = ["value", "checked"].map(|key| change[key].as_f64().expect("a number"));
        let relative = change["relative_change"].as_f64().expect("a number");
        assert!((relative * value.abs().max(checked.abs()) - (value - checked).abs()).abs() <= 1e-12 * value.abs());
        // Samples that are taken along change the steps, but not what they lead to.
        let expected = finer[column.key].as_f64().unwrap_or(checked);
        assert!((checked - expected).abs() <= 1e-2 * expected.abs(), "{}: {checked}, {expected}", column.key);
        changed += usize::from(relative > 1e-7);
    }
    assert!(changed > 5, "{changed} metrics change");
    // It belongs to the result that was checked, and goes with it.
    printed(&directory, "simulate case.toml --out one --no-figures");
    assert!(!directory.path().join("one/check.json").exists());
}

#[test]
fn a_study_says_what_was_checked_and_resumes() {
    let directory = directory(FILE);
    let study = format!("study case.toml --out results --no-figures {COARSE}");
    printed(&directory, &study);
    assert_eq!(column(&directory, "change_when_checked"), None);
    assert!(!printed(&directory, "advise results").contains("checked"));
    let forces = column(&directory, "tool_contact_normal_force_n");

    // All cases of the journal are simulated again, as none was checked.
    let checked = bristle(directory.path(), &format!("{study} --check")).assert().success();
    checked.stderr(contains("4 of 4 cases checked: no metric changed by more than"));
    let changes = column(&directory, "change_when_checked").expect("the column");
    let numbers: Vec<f64> = changes.iter().map(|change| change.parse().expect("a number")).collect();
    assert!(numbers.iter().all(|change| (1e-9..0.5).contains(change)), "{numbers:?}");
    assert_eq!(column(&directory, "tool_contact_normal_force_n"), forces);

    // The journal has them now, with and without the option.
    for option in ["--check", ""] {
        let again = bristle(directory.path(), &format!("{study} {option}")).assert().success();
        again.stderr(contains("4 of 4 cases are in `results/journal.jsonl`, 0 remain"));
        assert_eq!(column(&directory, "change_when_checked").as_ref(), Some(&changes));
    }
    let advice = printed(&directory, "advise results");
    let words: Vec<&str> = advice.split_whitespace().collect();
    assert!(words.join(" ").contains("All cases were checked"), "{advice}");
    let advice: Value = serde_json::from_str(&printed(&directory, "advise results --json")).expect("JSON");
    assert_eq!(advice["checked"]["rows"].as_array().map(Vec::len), Some(4));
    let largest = numbers.iter().copied().fold(0.0, f64::max);
    assert_eq!(advice["checked"]["largest_change"].as_f64(), Some(largest));
}

#[test]
fn checked_cases_of_shards_are_merged() {
    let directory = directory(FILE);
    printed(&directory, "study case.toml --out first --shard 1/2 --check");
    printed(&directory, "study case.toml --out second --shard 2/2");
    printed(&directory, "merge case.toml first second --out results --no-figures");
    let changes = column(&directory, "change_when_checked").expect("the column");
    assert_eq!(changes.iter().filter(|change| change.is_empty()).count(), 2, "{changes:?}");
    let advice = printed(&directory, "advise results");
    let words: Vec<&str> = advice.split_whitespace().collect();
    assert!(words.join(" ").contains("Of 4 cases, those of rows"), "{advice}");
}

#[test]
fn a_brush_is_compared_with_half_the_step() {
    let brush = "[brush]\nrows = 1\ncolumns = 3\nsteady = false\n";
    let text = format!("{}\n{brush}", FILE.replace("filament_count = 10500", "filament_count = 682"));
    let directory = directory(&text);
    let text = printed(&directory, "brush case.toml --out all --check --no-figures");
    assert!(text.contains("steps of half the length"), "{text}");
    let change = &json(&directory, "all/check.json")["metrics"]["contact_normal_impulse_n_s"];
    let impulse = json(&directory, "all/metrics.json")["contact_normal_impulse_n_s"].as_f64();
    assert_eq!(change["value"].as_f64(), impulse);
    let relative = change["relative_change"].as_f64().expect("a number");
    // Steps of another length give another result, within some tolerances.
    assert!(relative > 0.0 && relative < 2e-2, "{relative}");
    bristle(directory.path(), "brush case.toml --out all --no-figures").assert().success();
    assert!(predicate::path::missing().eval(&directory.path().join("all/check.json")));

    printed(&directory, "study case.toml --out results --check --no-figures");
    let changes = column(&directory, "change_when_checked").expect("the column");
    assert!(changes.iter().all(|change| change.parse::<f64>().is_ok_and(|change| change > 0.0)), "{changes:?}");
}
