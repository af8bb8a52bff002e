//! Lateral stability as users see it: warnings, marks and advice, and the numbers of docs/notes.md.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle_app::report::tables::study_tables;
use bristle_study::grid::{CaseResult, Study, run_study};
use bristle_study::text::layout::WIDTH;
use serde_json::Value;

use crate::program::{self, Workspace, brush, has, lacks, section, sparse};

/// The paper's brush with fewer segments: slow passes are unstable without friction.
const HEAD: &str = concat!(
    brush!(10, "filament_count_uncertainty = 600\n"),
    "
[process]
brushing_velocity_m_s = 2.5
penetration_depth_m = 1.0e-3
"
);

/// Returns the warning at the end of a text.
fn warning(text: &str) -> &str {
    text.find("warning[").map_or("", |start| &text[start..])
}

#[test]
fn an_unstable_contact_has_a_warning_that_helps() {
    let directory = Workspace::with(&sparse(HEAD));
    let text = directory.said("simulate case.toml --out one");
    let told = warning(&text);
    insta::assert_snapshot!("warning_of_a_contact", told);

    // The help works: the line goes under [filament].
    let (_, line) = told.trim().rsplit_once("]: ").expect("a line");
    let tilted = HEAD.replace("[filament]\n", &format!("[filament]\n{line}\n"));
    directory.write("case.toml", sparse(&tilted));
    directory.run("simulate case.toml --out one");
    let amplification = directory.number("one/metrics.json", "lateral_amplification");
    assert!(amplification > 1.0, "{amplification}");

    // A stable contact has no warning.
    directory.write("case.toml", sparse(&HEAD.replace("2.5", "15.0")));
    let text = directory.said("simulate case.toml --out one");
    assert!(!text.contains("laterally unstable"), "{text}");
}

const SWEEPS: &str =
    "[study]\nbrushing_velocity_m_s = [2.5, 15.0]\npenetration_depth_m = [1.0e-3, 2.0e-3]\n";

#[test]
fn a_study_counts_its_unstable_cases_and_marks_them() {
    let directory = Workspace::with(&sparse(&format!("{HEAD}{SWEEPS}")));
    let text = directory.said("study case.toml --out results");
    insta::assert_snapshot!("warning_of_a_study", warning(&text));
    let [objects, json] = directory.run("study case.toml --out results --restart --json");
    assert_eq!(warning(&json), warning(&text));
    let is_json = |line: &str| serde_json::from_str::<Value>(line).is_ok();
    assert!(objects.lines().all(is_json), "{objects}");

    // The line of the help belongs to [study]. A study that sweeps the tilt needs no help.
    let study_with = |line: &str| {
        directory.write("case.toml", sparse(&format!("{HEAD}{SWEEPS}{line}\n")));
        directory
            .run("study case.toml --out other --restart")
            .concat()
    };
    let (_, line) = warning(&text).trim().rsplit_once("]: ").expect("a line");
    let text = study_with(line);
    has(&text, &["warning[B006]: "]);
    lacks(&text, &["help: under [study]"]);

    // Friction makes all of them stable.
    let text = study_with("\"contact.friction_coefficient\" = [0.5]");
    lacks(&text, &["unstable"]);

    let study = program::study(&format!("{HEAD}{SWEEPS}"));
    let tables = study_tables(&study, &results(&study), None, WIDTH);
    insta::assert_snapshot!("tables_with_marks", tables);
    let list = format!("{HEAD}{SWEEPS}\"contact.friction_coefficient\" = [0.0, 0.5]\n");
    let study = program::study(&list);
    insta::assert_snapshot!(
        "list_with_marks",
        study_tables(&study, &results(&study), None, WIDTH)
    );
}

#[test]
fn advice_tells_of_unstable_cases_and_names_a_stable_one() {
    let directory = Workspace::with(&format!("{HEAD}{SWEEPS}"));
    directory.run("study case.toml --out results");
    let text = directory.printed("advise results");
    insta::assert_snapshot!("advice_on_unstable_cases", text);
    let json = directory.printed_json("advise results --max-velocity 3 --no-verify --json");
    let advice = json["sections"][0]["advice"].as_array().expect("advice");
    let mut within = advice.iter();
    let within = within.find(|about| about["topic"] == "within_limits");
    let within = within.expect("within the limits");
    assert_eq!(within["laterally_unstable"], true);
    has(&within["sentence"].to_string(), &["Laterally unstable: "]);
    has(
        &json.to_string(),
        &["None of these cases is laterally stable."],
    );
}

fn results(study: &Study) -> Vec<CaseResult> {
    run_study(study, None, || {}).expect("threads")
}

/// Returns the results of a study in examples/ whose table is in the document.
fn example(text: &str) -> (Study, Vec<CaseResult>) {
    let study = program::study(text);
    let results = results(&study);
    (study, results)
}

/// Returns the rows of the table below a heading of docs/notes.md, as numbers and without its own
/// heading.
fn documented(heading: &str) -> Vec<Vec<f64>> {
    let section = section(include_str!("../../../../docs/notes.md"), heading);
    let number = |cell: &str| {
        cell.replace('−', "-")
            .trim_end_matches('%')
            .trim()
            .parse::<f64>()
            .ok()
    };
    let cells = |line: &str| {
        line.trim_matches('|')
            .split('|')
            .map(|cell| number(cell.trim()))
            .collect()
    };
    section
        .lines()
        .filter(|line| line.starts_with('|'))
        .filter_map(cells)
        .collect()
}

/// Returns the metrics of a case of the study.
fn metrics(study: &Study, results: &[CaseResult], wanted: [f64; 3]) -> Metrics {
    let case = (0..study.case_count()).find(|&case| {
        let Settings {
            process,
            filament,
            contact,
            ..
        } = study.settings(case);
        let third = filament.lateral_tilt_rad + contact.friction_coefficient;
        [
            process.brushing_velocity_m_s,
            process.penetration_depth_m,
            third,
        ] == wanted
    });
    results[case.expect("the study has the case")]
        .as_ref()
        .expect("the case is simulated")
        .metrics
        .clone()
}

fn assert_near(found: f64, documented: f64, tolerance: f64, what: &str) {
    assert!(
        (found - documented).abs() <= tolerance,
        "{what}: {found}, but docs/notes.md has {documented}"
    );
}

#[test]
fn the_table_of_friction_is_that_of_the_example() {
    let (study, results) = example(include_str!("../../../../examples/lateral_friction.toml"));
    let rows = documented("Stability by friction");
    assert_eq!(rows.len(), 9);
    for row in rows {
        let [velocity, depth_mm, ref amplifications @ ..] = row[..] else {
            panic!("a row has cells")
        };
        for (friction, expected) in [0.0, 0.1, 0.2, 0.3, 0.5].into_iter().zip(amplifications) {
            let found = metrics(&study, &results, [velocity, 1e-3 * depth_mm, friction])
                .lateral_amplification;
            assert_near(
                found,
                *expected,
                0.05 * expected,
                &format!("{velocity} m/s, {depth_mm} mm, µ = {friction}"),
            );
        }
    }
}

#[test]
fn the_table_of_tilts_is_that_of_the_example() {
    let (study, results) = example(include_str!("../../../../examples/lateral_tilt.toml"));
    let rows = documented("Effect of a tilted clamp");
    assert_eq!(rows.len(), 9);
    for row in rows {
        let [velocity, depth_mm, amplification, impulse, ref changes @ ..] = row[..] else {
            panic!("a row has cells")
        };
        let pass = |tilt| metrics(&study, &results, [velocity, 1e-3 * depth_mm, tilt]);
        let planar = pass(0.0);
        let case = format!("{velocity} m/s, {depth_mm} mm");
        assert_near(
            planar.lateral_amplification,
            amplification,
            0.05 * amplification,
            &case,
        );
        assert_near(
            1e3 * planar.contact_normal_impulse_n_s,
            impulse,
            0.01,
            &case,
        );
        for (tilt, change) in [1e-4, 1e-3, 1e-2].into_iter().zip(changes) {
            let found = 100.0
                * (pass(tilt).contact_normal_impulse_n_s / planar.contact_normal_impulse_n_s - 1.0);
            assert_near(found, *change, 0.3, &format!("{case}, tilt {tilt}"));
        }
    }
}

#[test]
fn the_readme_counts_the_unstable_cases() {
    let (_, results) = example(include_str!("../../../../examples/zirconia.toml"));
    let unstable = results
        .iter()
        .flatten()
        .filter(|summary| summary.metrics.laterally_unstable)
        .count();
    for page in [
        include_str!("../../../../README.md"),
        include_str!("../../../../docs/notes.md"),
    ] {
        has(page, &[&format!("{unstable} of the 120 cases")]);
    }
}
