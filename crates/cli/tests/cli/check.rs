//! `--check`: results that are computed again with more precision.

use bristle::model::metrics::Metrics;
use bristle::model::record::Record;

use crate::program::{Workspace, brush, has, words};

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

/// A tolerance with visible errors.
const COARSE: &str = "--set solver.relative_tolerance=1e-3";

/// Returns a column of `runs.csv`, if it exists.
fn column(directory: &Workspace, name: &str) -> Option<Vec<String>> {
    directory
        .rows("results/runs.csv")
        .iter()
        .map(|row| row.get(name).cloned())
        .collect()
}

#[test]
fn a_contact_is_compared_with_a_tenth_of_its_tolerance() {
    let directory = Workspace::with(FILE);
    let text = directory.printed(&format!(
        "simulate case.toml --out one --check --no-figures {COARSE}"
    ));
    has(&text, &["tenth of the tolerance", "change"]);
    let check = directory.json("one/check.json");
    let metrics = directory.json("one/metrics.json");
    directory.run(&format!(
        "simulate case.toml --out tenth --no-figures {}",
        COARSE.replace("1e-3", "1e-4")
    ));
    let finer = directory.json("tenth/metrics.json");
    let mut changed = 0;
    // A residual is an error by itself.
    for column in Metrics::COLUMNS
        .iter()
        .filter(|column| column.key != "energy_residual")
    {
        let change = &check["metrics"][column.key];
        assert_eq!(
            change["value"].as_f64(),
            metrics[column.key]
                .as_f64()
                .or(Some(column.get(&Metrics::default())))
        );
        let [value, checked] =
            ["value", "checked"].map(|key| change[key].as_f64().expect("a number"));
        let relative = change["relative_change"].as_f64().expect("a number");
        assert!(
            (relative * value.abs().max(checked.abs()) - (value - checked).abs()).abs()
                <= 1e-12 * value.abs()
        );
        // Samples change the steps, but not the results.
        let expected = finer[column.key].as_f64().unwrap_or(checked);
        assert!(
            (checked - expected).abs() <= 1e-2 * expected.abs(),
            "{}: {checked}, {expected}",
            column.key
        );
        changed += usize::from(relative > 1e-7);
    }
    assert!(changed > 5, "{changed} metrics change");
    // The check belongs to the checked result, and is removed with it.
    directory.run("simulate case.toml --out one --no-figures");
    assert!(!directory.path("one/check.json").exists());
}

#[test]
fn a_study_says_what_was_checked_and_resumes() {
    let directory = Workspace::with(FILE);
    let study = format!("study case.toml --out results --no-figures {COARSE}");
    directory.run(&study);
    assert_eq!(column(&directory, "change_when_checked"), None);
    assert!(!directory.printed("advise results").contains("checked"));
    let forces = column(&directory, "tool_contact_normal_force_n");

    // All cases of the journal are simulated again, as none was checked.
    let checked = directory.said(&format!("{study} --check"));
    assert!(
        checked.contains("4 of 4 cases checked: no metric changed by more than"),
        "{checked}"
    );
    let changes = column(&directory, "change_when_checked").expect("the column");
    let numbers: Vec<f64> = changes
        .iter()
        .map(|change| change.parse().expect("a number"))
        .collect();
    assert!(
        numbers.iter().all(|change| (1e-9..0.5).contains(change)),
        "{numbers:?}"
    );
    assert_eq!(column(&directory, "tool_contact_normal_force_n"), forces);

    // The journal has them now, with and without the option.
    for option in ["--check", ""] {
        let again = directory.said(&format!("{study} {option}"));
        assert!(
            again.contains("4 of 4 cases are in `results/journal.jsonl`, 0 remain"),
            "{again}"
        );
        assert_eq!(
            column(&directory, "change_when_checked").as_ref(),
            Some(&changes)
        );
    }
    let advice = directory.printed("advise results");
    assert!(
        words(&advice).contains("All cases were checked"),
        "{advice}"
    );
    let advice = directory.printed_json("advise results --json");
    assert_eq!(advice["checked"]["rows"].as_array().map(Vec::len), Some(4));
    let largest = numbers.iter().copied().fold(0.0, f64::max);
    assert_eq!(advice["checked"]["largest_change"].as_f64(), Some(largest));
}

#[test]
fn checked_cases_of_shards_are_merged() {
    let directory = Workspace::with(FILE);
    directory.run("study case.toml --out first --shard 1/2 --check");
    directory.run("study case.toml --out second --shard 2/2");
    directory.run("report first second --out results --no-figures");
    let changes = column(&directory, "change_when_checked").expect("the column");
    assert_eq!(
        changes.iter().filter(|change| change.is_empty()).count(),
        2,
        "{changes:?}"
    );
    let advice = directory.printed("advise results");
    assert!(
        words(&advice).contains("Of 4 cases, those of rows"),
        "{advice}"
    );
}

#[test]
fn a_brush_is_compared_with_a_quarter_of_the_tolerance() {
    let brush = "[brush]\nrows = 1\ncolumns = 3\nsteady = false\n";
    let text = format!(
        "{}\n{brush}",
        FILE.replace("filament_count = 10500", "filament_count = 682")
    );
    let directory = Workspace::with(&text);
    let text = directory.printed("simulate case.toml --out all --check --no-figures");
    assert!(text.contains("quarter of the tolerance"), "{text}");
    let change = &directory.json("all/check.json")["metrics"]["contact_normal_impulse_n_s"];
    assert_eq!(
        change["value"],
        directory.json("all/metrics.json")["contact_normal_impulse_n_s"]
    );
    let relative = change["relative_change"].as_f64().expect("a number");
    // Steps of another length give another result, within some tolerances.
    assert!(relative > 0.0 && relative < 2e-2, "{relative}");
    directory.run("simulate case.toml --out all --no-figures");
    assert!(!directory.path("all/check.json").exists());

    directory.run("study case.toml --out results --check --no-figures");
    let changes = column(&directory, "change_when_checked").expect("the column");
    assert!(
        changes
            .iter()
            .all(|change| change.parse::<f64>().is_ok_and(|change| change > 0.0)),
        "{changes:?}"
    );
}
