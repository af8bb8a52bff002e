//! Turns as users see them: what the input file takes, the files, the warnings, and a study that resumes.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{bristle, brush, sparse};

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

/// Writes the file, with so few filaments that they do not touch each other.
fn write(directory: &Path, text: &str) {
    fs::write(directory.join("case.toml"), sparse(text)).expect("the file can be written");
}

/// What a command writes to stdout, and then to stderr. It succeeds.
fn told(directory: &Path, arguments: &str) -> String {
    let output = bristle(directory, arguments).assert().success().get_output().clone();
    String::from_utf8([output.stdout, output.stderr].concat()).expect("UTF-8")
}

fn json(directory: &Path, file: &str) -> Value {
    let text = fs::read_to_string(directory.join(file)).expect("the file is there");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn turns_are_a_number_from_1_to_50_or_steady() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for wrong in ["0", "51", "-1", "2.5", "1e2", "\"Steady\"", "\"2\"", "true", "[1, 2]", "nan", "9223372036854775807"]
    {
        write(directory.path(), &format!("{HEAD}turns = {wrong}\n"));
        let output = bristle(directory.path(), "simulate case.toml --out one").assert().failure().get_output().clone();
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        for part in ["case.toml:18:", "process.turns", "a whole number from 1 to 50 or \"steady\""] {
            assert!(text.contains(part), "{wrong}: {text}");
        }
        assert!(!directory.path().join("one").exists());
    }
    for (wrong, part) in
        [("[1, 51]", "a whole number from 1 to 50"), ("[1.5]", "whole"), ("[\"steady\"]", "list of numbers")]
    {
        write(directory.path(), &format!("{HEAD}[study]\n\"process.turns\" = {wrong}\n"));
        let output = bristle(directory.path(), "study case.toml --out many").assert().failure().get_output().clone();
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(text.contains("case.toml:19:") && text.contains("process.turns") && text.contains(part), "{text}");
    }
}

#[test]
fn the_turns_of_a_contact_are_in_its_files() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    write(directory.path(), HEAD);
    let text = told(directory.path(), "simulate case.toml --out one");
    assert!(text.contains("14 % of its vibration") && text.contains("turns = \"steady\""), "{text}");
    let metrics = json(directory.path(), "one/metrics.json");
    let impulses = |metrics: &Value| metrics["turn_contact_normal_impulses_n_s"].as_array().expect("a list").clone();
    assert_eq!(impulses(&metrics), [metrics["contact_normal_impulse_n_s"].clone()]);
    assert_eq!((&metrics["turns"], &metrics["unsteady_turns"]), (&Value::from(1), &Value::from(false)));
    assert!(!directory.path().join("one/figures/turns.svg").exists());

    // The line of the help works.
    let line = text.lines().last().expect("a line").trim();
    write(directory.path(), &format!("{HEAD}{line}\n"));
    let text = told(directory.path(), "simulate case.toml --out one --vtk=5");
    assert!(!text.contains("warning"), "{text}");
    let metrics = json(directory.path(), "one/metrics.json");
    let turns = impulses(&metrics);
    assert!(turns.len() > 2 && metrics["turns"] == turns.len(), "{metrics}");
    assert_eq!(turns.last(), Some(&metrics["contact_normal_impulse_n_s"]));
    assert_eq!(json(directory.path(), "one/case.json")["settings"]["process"]["turns"], "steady");

    // The figures are drawn again with the same bytes, from the saved files only.
    let figures = ["history.svg", "turns.svg", "turns.png"];
    let drawn = || figures.map(|name| fs::read(directory.path().join("one/figures").join(name)).expect("a figure"));
    let first = drawn();
    fs::remove_dir_all(directory.path().join("one/figures")).expect("they can be removed");
    told(directory.path(), "plot one");
    assert!(drawn() == first);
    let changed = fs::read_to_string(directory.path().join("one/metrics.json"))
        .expect("a file")
        .replace("\"turns\": ", "\"turns\": 1");
    fs::write(directory.path().join("one/metrics.json"), changed).expect("it can be written");
    bristle(directory.path(), "plot one").assert().failure();

    // A single turn removes the figure of several.
    write(directory.path(), HEAD);
    told(directory.path(), "simulate case.toml --out one");
    assert!(!directory.path().join("one/figures/turns.svg").exists());
    assert!(directory.path().join("one/figures/history.svg").exists());
}

const SWEEPS: &str = "[study]\nbrushing_velocity_m_s = [10.0, 30.0]\npenetration_depth_m = [1.0e-3, 2.0e-3]\n";

#[test]
fn a_study_lists_the_impulses_of_all_turns_and_resumes() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    write(directory.path(), &format!("{HEAD}{SWEEPS}\"process.turns\" = [1, 3]\n"));
    let text = told(directory.path(), "study case.toml --out many");
    assert!(text.contains("in 2 of 8 cases the filament comes back still vibrating"), "{text}");
    assert!(
        text.lines().skip_while(|line| !line.starts_with("warning")).all(|line| line.chars().count() <= 80),
        "{text}"
    );
    let runs = fs::read_to_string(directory.path().join("many/runs.csv")).expect("runs.csv");
    let mut reader = csv::Reader::from_reader(runs.as_bytes());
    let headings = reader.headers().expect("a heading").clone();
    let column = |name: &str| headings.iter().position(|heading| heading == name).expect(name);
    let columns =
        ["process.turns", "turns", "contact_normal_impulse_n_s", "turn_contact_normal_impulses_n_s"].map(column);
    let mut rows = 0;
    for row in reader.records() {
        let row = row.expect("a row");
        let [asked, turns, impulse, impulses] = columns.map(|column| row[column].to_owned());
        let impulses: Vec<&str> = impulses.split(' ').collect();
        assert_eq!((asked, turns.parse().ok()), (turns.clone(), Some(impulses.len())), "{row:?}");
        assert_eq!(impulses.last(), Some(&impulse.as_str()));
        rows += 1;
    }
    assert_eq!(rows, 8);

    // Stopped after some cases, it resumes with the same bytes.
    let files = || {
        ["runs.csv", "study.json", "report.html"]
            .map(|name| fs::read(directory.path().join("many").join(name)).expect(name))
    };
    let first = files();
    let journal = directory.path().join("many/journal.jsonl");
    let lines = fs::read_to_string(&journal).expect("the journal");
    assert!(lines.contains("\"turn_contact_normal_impulses_n_s\":["));
    let begun: String = lines.lines().take(4).flat_map(|line| [line, "\n"]).collect();
    fs::write(&journal, begun).expect("it can be cut");
    let text = told(directory.path(), "study case.toml --out many");
    assert!(text.contains("3 of 8 cases are in"), "{text}");
    assert!(files() == first);

    // Advice reads it back.
    told(directory.path(), "plot many");
    let advice = bristle(directory.path(), "advise many").assert().success().get_output().clone();
    let advice = String::from_utf8(advice.stdout).expect("UTF-8");
    assert_eq!(advice.matches("comes back still vibrating").count(), 1, "{advice}");
}

#[test]
fn a_steady_study_states_so_in_its_settings_and_its_page() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    write(directory.path(), &format!("{HEAD}turns = \"steady\"\n{SWEEPS}"));
    let text = told(directory.path(), "study case.toml --out many");
    assert!(!text.contains("vibrating"), "{text}");
    assert_eq!(json(directory.path(), "many/study.json")["settings"]["process"]["turns"], "steady");
    let page = fs::read_to_string(directory.path().join("many/report.html")).expect("the page");
    let (_, data) = page.split_once("id=\"data\">").expect("the data");
    let (data, _) = data.split_once("</script>").expect("their end");
    let data: Value = serde_json::from_str(data).expect("JSON");
    let settings = data["settings"].as_array().expect("settings");
    let turns = settings.iter().find(|setting| setting["path"] == "process.turns").expect("the setting");
    assert_eq!(turns["value"], "steady");
    let courses = data["courses"].as_array().expect("courses");
    assert_eq!(courses.len(), 4);
    for course in courses {
        let course = &course[1];
        let turns = course["turn_impulses"].as_array().expect("a list").len() as f64;
        let [end, turn] = ["end", "turn"].map(|key| course[key].as_f64().expect(key));
        assert!(turns >= 2.0 && (end / turn - turns).abs() < 1e-9, "{end} {turn} {turns}");
    }
    told(directory.path(), "plot many");
}

#[test]
fn the_schema_takes_numbers_and_the_word() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let output = bristle(directory.path(), "schema").assert().success().get_output().clone();
    let schema: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let turns = &schema["properties"]["process"]["properties"]["turns"];
    let limits = serde_json::json!({ "type": "integer", "minimum": 1, "maximum": 50 });
    assert_eq!(turns["anyOf"], serde_json::json!([limits, { "const": "steady" }]), "{turns}");
    assert_eq!(turns["default"], 1);
}
