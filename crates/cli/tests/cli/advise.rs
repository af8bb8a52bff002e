//! `bristle advise`: its table, its JSON, and what it refuses.

use std::fs;
use std::path::Path;

use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::bristle;

/// Quick cases, with a local maximum along the tier at each depth.
const FILE: &str = "\
[tool]
body_radius_m = 0.140
width_m = 0.020
filament_count = 10500
filament_count_uncertainty = 600

[filament]
segments = 5
length_m = 0.040
diameter_m = 1.18e-3

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[study]
";
const SWEEPS: &str = "\
brushing_velocity_m_s = { start = 10.0, stop = 22.5, step = 2.5 }
penetration_depth_m = [1.0e-3, 2.0e-3]
";

/// A directory with a study, simulated to `results`; cases may fail.
fn simulated(sweeps: &str) -> TempDir {
    let directory = TempDir::new().expect("a temporary directory");
    fs::write(directory.path().join("case.toml"), format!("{FILE}{sweeps}")).expect("the file can be written");
    bristle(directory.path(), "study case.toml --out results").assert().code(predicate::in_iter([0, 3]));
    directory
}

/// What the program prints.
fn printed(directory: &TempDir, arguments: &str) -> String {
    let assert = bristle(directory.path(), arguments).assert().success().stderr("");
    String::from_utf8(assert.get_output().stdout.clone()).expect("UTF-8")
}

/// The program's message about bad input.
fn refusal(directory: &TempDir, arguments: &str) -> String {
    let assert = bristle(directory.path(), arguments).assert().code(2).stdout("").stderr(contains("panicked").not());
    String::from_utf8(assert.get_output().stderr.clone()).expect("UTF-8")
}

/// The number in a row (counted from 1, below the header) and a column of `runs.csv`.
fn number(runs: &Path, row: u64, column: &str) -> f64 {
    let mut reader = csv::Reader::from_path(runs).expect("runs.csv");
    let position = reader.headers().expect("a header").iter().position(|name| name == column).expect(column);
    let record = reader.records().nth(row as usize - 1).expect("the row").expect("cells");
    record[position].parse().expect("a number")
}

#[test]
fn the_table_has_sentences_and_fits_a_terminal() {
    let directory = simulated(SWEEPS);
    let text = printed(&directory, "advise results --max-velocity 15 --min-ratio 0.5");
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    insta::assert_snapshot!(text);
}

#[test]
fn json_has_the_numbers_of_the_rows_it_cites() {
    let directory = simulated(SWEEPS);
    let text = printed(&directory, "advise results --max-velocity 15 --json");
    assert_eq!(text.lines().count(), 1);
    let advice: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(advice["limits"]["max_velocity_m_s"], 15.0);
    let cited = advice["sections"][0]["advice"].as_array().expect("advice");
    let mut topics: Vec<&str> = cited.iter().map(|about| about["topic"].as_str().expect("a topic")).collect();
    topics.dedup();
    assert_eq!(
        topics,
        ["highest", "within_limits", "at_velocity", "at_depth", "per_velocity", "per_depth", "tier"],
        "{text}"
    );
    let runs = directory.path().join("results/runs.csv");
    for about in cited {
        let row = about["row"].as_u64().expect("a row");
        for column in
            ["brushing_velocity_m_s", "penetration_depth_m", "tool_contact_normal_force_n", "contact_time_ratio"]
        {
            assert_eq!(about[column], number(&runs, row, column), "{column} of row {row}");
        }
    }
    let all = (1..=12).map(|row| number(&runs, row, "tool_contact_normal_force_n"));
    assert_eq!(cited[0]["tool_contact_normal_force_n"], all.fold(0.0, f64::max));
}

#[test]
fn failed_cases_are_left_out() {
    let directory = simulated(&format!("{SWEEPS}\"contact.stiffness_n_m\" = [1e300, 1e5]\n"));
    let text = printed(&directory, "advise results");
    let (advice, failed) = text.split_once("With stiffness_n_m = 1e300 N/m^p\n").expect("two sections");
    assert!(advice.starts_with("With stiffness_n_m = 1e5 N/m^p\n") && !advice.contains("failed"), "{text}");
    assert!(failed.starts_with("All 12 cases failed.\n\n"), "{text}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let directory = simulated("\"filament.segments\" = [3, 4]\n");
    let message = refusal(&directory, "advise results");
    assert!(message.contains("error: results: ") && message.contains("sweep one of them"), "{message}");
    bristle(directory.path(), "simulate case.toml --out one").assert().success();
    for name in ["one", "absent"] {
        let message = refusal(&directory, &format!("advise {name}"));
        assert!(message.contains(&format!("`{name}` has no study.json")) && message.contains("help:"), "{message}");
    }
    let runs = directory.path().join("results/runs.csv");
    let text = fs::read_to_string(&runs).expect("runs.csv");
    fs::write(&runs, text.replacen(",ok\n", ",ok\n10.0,0.1", 1)).expect("the file can be written");
    let message = refusal(&directory, "advise results");
    assert!(message.contains("runs.csv:3") && message.contains("help:"), "{message}");
    fs::remove_file(&runs).expect("the file can be removed");
    assert!(refusal(&directory, "advise results").contains("cannot read `results/runs.csv`"));
}

#[test]
fn bad_limits_are_refused() {
    let directory = simulated(SWEEPS);
    for (limits, problem) in [
        ("--max-velocity 0", "in m/s"),
        ("--max-velocity=-5", "in m/s"),
        ("--max-velocity inf", "in m/s"),
        ("--max-velocity fast", "in m/s"),
        ("--min-ratio 1.5", "from 0 to 1"),
        ("--max-ratio NaN", "from 0 to 1"),
        ("--max-ratio=-0.1", "from 0 to 1"),
        ("--min-ratio 0.6 --max-ratio 0.5", "at least 0.6 and at most 0.5"),
    ] {
        let message = refusal(&directory, &format!("advise results {limits}"));
        assert!(message.contains(problem), "{message}");
    }
    let unmet = printed(&directory, "advise results --max-velocity 1");
    assert!(unmet.contains("No case has v_b ≤ 1 m/s."), "{unmet}");
}
