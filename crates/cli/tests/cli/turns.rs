//! Turns as users see them: what the input file takes, the files, the warnings, and a study that
//! resumes.

use std::fs;

use serde_json::Value;

use crate::program::{Workspace, brush, has, page_data, sparse};

/// A fast brush in few segments, whose filaments come back still vibrating.
const HEAD: &str = concat!(
    brush!(4, "filament_count_uncertainty = 600\n"),
    "
[solver]
relative_tolerance = 1e-4

[process]
brushing_velocity_m_s = 30.0
penetration_depth_m = 1.0e-3
"
);

#[test]
fn turns_are_a_number_from_1_to_50_or_steady() {
    let directory = Workspace::new();
    for wrong in [
        "0",
        "51",
        "-1",
        "2.5",
        "1e2",
        "\"Steady\"",
        "\"2\"",
        "true",
        "[1, 2]",
        "nan",
        "9223372036854775807",
    ] {
        directory.write("case.toml", sparse(&format!("{HEAD}turns = {wrong}\n")));
        let parts = [
            "case.toml:18:",
            "process.turns",
            "a whole number from 1 to 50 or \"steady\"",
            wrong,
        ];
        directory.refuses("simulate case.toml --out one", &parts);
        assert!(!directory.path("one").exists());
    }
    for (wrong, part) in [
        ("[1, 51]", "a whole number from 1 to 50"),
        ("[1.5]", "whole"),
        ("[\"steady\"]", "list of numbers"),
    ] {
        directory.write(
            "case.toml",
            sparse(&format!("{HEAD}[study]\n\"process.turns\" = {wrong}\n")),
        );
        directory.refuses(
            "study case.toml --out many",
            &["case.toml:19:", "process.turns", part],
        );
    }
}

#[test]
fn the_turns_of_a_contact_are_in_its_files() {
    let directory = Workspace::with(&sparse(HEAD));
    let text = directory.told("simulate case.toml --out one");
    has(&text, &["14 % of its vibration", "turns = \"steady\""]);
    let metrics = directory.json("one/metrics.json");
    let impulses = |metrics: &Value| {
        metrics["turn_contact_normal_impulses_n_s"]
            .as_array()
            .expect("a list")
            .clone()
    };
    assert_eq!(
        impulses(&metrics),
        [metrics["contact_normal_impulse_n_s"].clone()]
    );
    assert_eq!(
        (&metrics["turns"], &metrics["unsteady_turns"]),
        (&Value::from(1), &Value::from(false))
    );
    assert!(!directory.path("one/figures/turns.svg").exists());

    // The line of the help works.
    let line = text.lines().last().expect("a line").trim();
    directory.write("case.toml", sparse(&format!("{HEAD}{line}\n")));
    let text = directory.told("simulate case.toml --out one --vtk=5");
    assert!(!text.contains("warning"), "{text}");
    let metrics = directory.json("one/metrics.json");
    let turns = impulses(&metrics);
    assert!(
        turns.len() > 2 && metrics["turns"] == turns.len(),
        "{metrics}"
    );
    assert_eq!(turns.last(), Some(&metrics["contact_normal_impulse_n_s"]));
    assert_eq!(
        directory.json("one/case.json")["settings"]["process"]["turns"],
        "steady"
    );

    // The figures are drawn again with the same bytes, from the saved files only.
    let figures = ["history.svg", "turns.svg", "turns.png"];
    let drawn = || figures.map(|name| directory.bytes(&format!("one/figures/{name}")));
    let first = drawn();
    fs::remove_dir_all(directory.path("one/figures")).expect("they can be removed");
    directory.run("plot one");
    assert!(drawn() == first);
    let changed = directory
        .read("one/metrics.json")
        .replace("\"turns\": ", "\"turns\": 1");
    directory.write("one/metrics.json", changed);
    directory.bristle("plot one").assert().failure();

    // A single turn removes the figure of several.
    directory.write("case.toml", sparse(HEAD));
    directory.run("simulate case.toml --out one");
    assert!(!directory.path("one/figures/turns.svg").exists());
    assert!(directory.path("one/figures/history.svg").exists());
}

const SWEEPS: &str =
    "[study]\nbrushing_velocity_m_s = [10.0, 30.0]\npenetration_depth_m = [1.0e-3, 2.0e-3]\n";

#[test]
fn a_study_lists_the_impulses_of_all_turns_and_resumes() {
    let directory = Workspace::with(&sparse(&format!(
        "{HEAD}{SWEEPS}\"process.turns\" = [1, 3]\n"
    )));
    let text = directory.told("study case.toml --out many");
    assert!(
        text.contains("in 2 of 8 cases the filament comes back still vibrating"),
        "{text}"
    );
    let mut warning = text.lines().skip_while(|line| !line.starts_with("warning"));
    assert!(warning.all(|line| line.chars().count() <= 80), "{text}");
    let runs = directory.rows("many/runs.csv");
    for row in &runs {
        let impulses: Vec<&str> = row["turn_contact_normal_impulses_n_s"].split(' ').collect();
        assert!(
            row["turns"] == row["process.turns"] && row["turns"].parse() == Ok(impulses.len()),
            "{row:?}"
        );
        assert_eq!(impulses.last(), Some(&&*row["contact_normal_impulse_n_s"]));
    }
    assert_eq!(runs.len(), 8);

    // Stopped after some cases, it resumes with the same bytes.
    let files = || {
        ["runs.csv", "study.json", "report.html"]
            .map(|name| directory.bytes(&format!("many/{name}")))
    };
    let first = files();
    let lines = directory.read("many/journal.jsonl");
    assert!(lines.contains("\"turn_contact_normal_impulses_n_s\":["));
    let begun: String = lines
        .lines()
        .take(4)
        .flat_map(|line| [line, "\n"])
        .collect();
    directory.write("many/journal.jsonl", begun);
    let text = directory.told("study case.toml --out many");
    assert!(text.contains("3 of 8 cases are in"), "{text}");
    assert!(files() == first);

    // Advice reads it back.
    directory.run("plot many");
    let advice = directory.printed("advise many");
    assert_eq!(
        advice.matches("comes back still vibrating").count(),
        1,
        "{advice}"
    );
}

#[test]
fn a_steady_study_states_so_in_its_settings_and_its_page() {
    let directory = Workspace::with(&sparse(&format!("{HEAD}turns = \"steady\"\n{SWEEPS}")));
    let text = directory.told("study case.toml --out many");
    assert!(!text.contains("vibrating"), "{text}");
    assert_eq!(
        directory.json("many/study.json")["settings"]["process"]["turns"],
        "steady"
    );
    let data = page_data(&directory.read("many/report.html"));
    let settings = data["settings"].as_array().expect("settings");
    let turns = settings
        .iter()
        .find(|setting| setting["path"] == "process.turns")
        .expect("the setting");
    assert_eq!(turns["value"], "steady");
    let courses = data["courses"].as_array().expect("courses");
    assert_eq!(courses.len(), 4);
    for course in courses {
        let course = &course[1];
        let turns = course["turn_impulses"].as_array().expect("a list").len() as f64;
        let [end, turn] = ["end", "turn"].map(|key| course[key].as_f64().expect(key));
        assert!(
            turns >= 2.0 && (end / turn - turns).abs() < 1e-9,
            "{end} {turn} {turns}"
        );
    }
    directory.run("plot many");
}

#[test]
fn the_schema_takes_numbers_and_the_word() {
    let schema = Workspace::new().printed_json("schema");
    let turns = &schema["properties"]["process"]["properties"]["turns"];
    let limits = serde_json::json!({ "type": "integer", "minimum": 1, "maximum": 50 });
    assert_eq!(
        turns["anyOf"],
        serde_json::json!([limits, { "const": "steady" }]),
        "{turns}"
    );
    // The default depends on the tool.
    let description = turns["description"].as_str().expect("a text");
    assert!(
        turns["default"].is_null() && description.contains("touch during the whole turn"),
        "{turns}"
    );
}
