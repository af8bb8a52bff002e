//! Turns as users see them: the files, the warnings, and a study.

use serde_json::Value;

use crate::program::{VTK, Workspace, brush, has, lacks, sparse, words};

/// A fast brush with few segments, whose filaments return still vibrating.
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
fn the_turns_of_a_contact_are_in_its_files() {
    let directory = Workspace::with(&sparse(HEAD));
    let text = directory.told("simulate case.toml --out one");
    has(&text, &["14 % of its vibration", "turns = \"steady\""]);
    let metrics = directory.json("one/metrics.json");
    let last_of_turns = |metrics: &Value| {
        let impulses = metrics["turn_contact_normal_impulses_n_s"].as_array();
        let impulses = impulses.expect("a list");
        assert_eq!(metrics["turns"], impulses.len());
        assert_eq!(
            impulses.last(),
            Some(&metrics["contact_normal_impulse_n_s"])
        );
        impulses.len()
    };
    assert_eq!(last_of_turns(&metrics), 1);
    assert_eq!(metrics["unsteady_turns"], false);
    directory.has_no("one/figures/turns.svg");

    // The line of the help works.
    let (_, line) = text.trim().rsplit_once("]: ").expect("a line");
    directory.write("case.toml", sparse(&format!("{HEAD}{line}\n")));
    let text = directory.told(&format!("simulate case.toml --out one {VTK}"));
    lacks(&text, &["% of its vibration"]);
    assert!(last_of_turns(&directory.json("one/metrics.json")) > 2);
    assert_eq!(
        directory.json("one/case.json")["settings"]["process"]["turns"],
        "steady"
    );

    // Figures are redrawn with the same bytes, from the saved files only.
    directory.run("report one --out again");
    let [one, again] = ["one", "again"].map(|out| directory.files(&format!("{out}/figures")));
    assert!(one == again && one.contains_key("turns.svg"));

    // A single turn removes the figure of several.
    directory.write("case.toml", sparse(HEAD));
    directory.run("simulate case.toml --out one");
    directory.has_no("one/figures/turns.svg");
}

const SWEEPS: &str =
    "[study]\nbrushing_velocity_m_s = [10.0, 30.0]\npenetration_depth_m = [1.0e-3, 2.0e-3]\n";

#[test]
fn a_study_lists_the_impulses_of_all_turns() {
    let directory = Workspace::with(&sparse(&format!(
        "{HEAD}{SWEEPS}\"process.turns\" = [1, 3]\n"
    )));
    let text = directory.told("study case.toml --out many");
    let vibrating = "which one pass leaves out; 2 of 8 cases, most in row";
    has(&words(&text), &[vibrating]);
    let runs = directory.rows("many/runs.csv");
    for row in &runs {
        let impulses: Vec<&str> = row["turn_contact_normal_impulses_n_s"].split(' ').collect();
        assert_eq!(row["turns"], row["process.turns"]);
        assert_eq!(row["turns"].parse(), Ok(impulses.len()));
        assert_eq!(impulses.last(), Some(&&*row["contact_normal_impulse_n_s"]));
    }
    assert_eq!(runs.len(), 8);

    // Advice reads it back.
    directory.run("report many");
    let advice = directory.printed("advise many");
    let vibrating = advice.matches("comes back still vibrating");
    assert_eq!(vibrating.count(), 1, "{advice}");
}
