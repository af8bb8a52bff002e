//! `bristle validate`: all numbers of the quick suite agree, and its output is complete.

use std::collections::BTreeSet;
use std::fs;

use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

use crate::program::bristle;

const COLUMNS: &str = "group,case,subject,quantity,reference,lower,upper,source,computed,error,error_kind,tolerance,pass";

/// The number of comparisons in each row of the table below a heading, by the first cell of the
/// row.
fn comparisons<'a>(page: &'a str, heading: &str) -> Vec<(&'a str, usize)> {
    let (_, section) = page.split_once(&format!("\n{heading}\n")).expect(heading);
    let mut rows = section
        .lines()
        .skip_while(|line| !line.starts_with('|'))
        .take_while(|line| line.starts_with('|'));
    let cells = |row: &'a str| row.trim_matches('|').split('|').map(str::trim);
    let column = cells(rows.next().expect("column names"))
        .position(|name| name == "comparisons")
        .expect("the column");
    let count = |row| {
        let mut cells = cells(row);
        let name = cells.clone().next().expect("a name");
        (
            name,
            cells
                .nth(column)
                .and_then(|cell| cell.parse().ok())
                .expect("a number"),
        )
    };
    rows.skip(1).map(count).collect()
}

#[test]
#[ignore = "it takes a minute"]
fn the_suite_agrees() {
    let directory = TempDir::new().expect("a temporary directory");
    let out = directory.path().join("results");
    let assert = bristle(directory.path(), "validate --out results")
        .assert()
        .success();
    let table = String::from_utf8_lossy(&assert.get_output().stdout);
    let page = fs::read_to_string(out.join("validation.md")).expect("validation.md");

    // All cases of the page, from its headings.
    let mut cases = Vec::new();
    let mut group = "";
    for line in page.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            group = title;
        } else if let Some(title) = line.strip_prefix("### ") {
            cases.push((group.to_owned(), title.to_owned()));
        }
    }
    assert!(!cases.is_empty());

    let mut reader = csv::Reader::from_path(out.join("validation.csv")).expect("validation.csv");
    assert_eq!(
        reader
            .headers()
            .expect("column names")
            .iter()
            .collect::<Vec<_>>()
            .join(","),
        COLUMNS
    );
    let rows: Vec<_> = reader.records().map(|row| row.expect("a row")).collect();
    for row in &rows {
        let number = |column: usize| row[column].parse::<f64>().is_ok_and(f64::is_finite);
        assert!(number(8) && number(9) && number(11), "{row:?}");
        assert!(number(4) || number(5) || number(6), "{row:?}");
        assert_eq!(&row[12], "true", "{row:?}");
    }
    let mut compared: Vec<_> = rows
        .iter()
        .map(|row| (row[0].to_owned(), row[1].to_owned()))
        .collect();
    compared.dedup();
    assert_eq!(
        compared, cases,
        "each case compares something, in the order of the page"
    );
    let verdict = format!(
        "\n{} of {} comparisons in {} cases agree\n",
        rows.len(),
        rows.len(),
        cases.len()
    );
    assert!(table.ends_with(&verdict), "{verdict}");

    let figures: Vec<_> = page
        .split("](")
        .filter_map(|part| Some(part.split_once(')')?.0))
        .collect();
    let figures: Vec<_> = figures
        .into_iter()
        .filter(|name| name.ends_with(".svg"))
        .collect();
    for name in &figures {
        let svg = fs::read_to_string(out.join(name)).expect(name);
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{name}"
        );
    }
    let named: BTreeSet<_> = figures
        .iter()
        .chain(&["validation.csv", "validation.md"])
        .copied()
        .collect();
    assert_eq!(
        named.len(),
        figures.len() + 2,
        "no two figures share a name"
    );
    let written = fs::read_dir(&out)
        .expect("results")
        .map(|entry| entry.expect("an entry").file_name());
    let written: Vec<_> = written
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    assert_eq!(
        written.iter().map(String::as_str).collect::<BTreeSet<_>>(),
        named
    );

    // The committed page comes from the full suite. It has the same cases, and all agree. Numbers
    // may differ by rounding.
    let committed = include_str!("../../../../docs/validation.md");
    let headings = |page: &str| {
        page.lines()
            .filter(|line| line.starts_with('#'))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        headings(committed),
        headings(&page),
        "docs/validation.md is stale; regenerate it, see CONTRIBUTING.md"
    );
    assert!(!committed.contains("**no**"), "docs/validation.md");

    for heading in ["## Tolerances", "## Sources"] {
        for (name, count) in comparisons(&page, heading) {
            assert!(count > 0, "{heading}: no comparison uses {name}");
        }
    }
}

#[test]
fn an_unwritable_directory_is_refused_before_anything_is_computed() {
    let directory = TempDir::new().expect("a temporary directory");
    fs::write(directory.path().join("file"), "kept").expect("the file can be written");
    for out in ["file", "file/results"] {
        let mut command = bristle(directory.path(), &format!("validate --out {out}"));
        command
            .assert()
            .code(2)
            .stdout("")
            .stderr(contains("error: cannot").and(contains(out)));
    }
    assert_eq!(
        fs::read_to_string(directory.path().join("file")).expect("the file"),
        "kept"
    );
}
