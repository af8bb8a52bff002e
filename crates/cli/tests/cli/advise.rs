//! `bristle advise`: its table, its JSON, and its refusals.

use std::fs;

use predicates::prelude::*;
use serde_json::Value;

use crate::program::{Workspace, brush, has, is_near, lacks, number, sparse, words};

/// Quick cases, with a local maximum along the tier at each depth.
const FILE: &str = concat!(
    brush!(5, "filament_count_uncertainty = 600\n"),
    "
[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[study]
"
);
const SWEEPS: &str = "\
brushing_velocity_m_s = { start = 10.0, stop = 22.5, step = 2.5 }
penetration_depth_m = [1.0e-3, 2.0e-3]
";

/// Returns a directory with a study, simulated to `results`; cases may fail.
fn simulated(sweeps: &str) -> Workspace {
    let directory = Workspace::with(&format!("{FILE}{sweeps}"));
    directory
        .bristle("study case.toml --out results")
        .assert()
        .code(predicate::in_iter([0, 3]));
    directory
}

#[test]
fn the_table_has_sentences_and_fits_a_terminal() {
    let directory = simulated(SWEEPS);
    let text = directory.printed("advise results --max-velocity 15 --min-ratio 0.5 --no-verify");
    insta::assert_snapshot!(text);
}

#[test]
fn json_has_the_numbers_of_the_rows_it_cites() {
    let directory = simulated(SWEEPS);
    let cited = |arguments: &str| {
        let text = directory.printed(&format!("advise results --json {arguments}"));
        assert_eq!(text.lines().count(), 1);
        let json: Value = serde_json::from_str(&text).expect("JSON");
        let advice = json["sections"][0]["advice"].as_array();
        let advice = advice.expect("advice").clone();
        let mut topics: Vec<String> = advice
            .iter()
            .map(|about| about["topic"].to_string().replace('"', ""))
            .collect();
        topics.dedup();
        (json, advice, topics.join(" "))
    };
    let (limited, ranked, topics) = cited("--max-velocity 15 --no-verify");
    assert_eq!(limited["limits"]["max_velocity_m_s"], 15.0);
    assert_eq!((&*topics, ranked.len()), ("within_limits", 5));
    assert_eq!(limited["recommendation"]["rows"][0], ranked[0]["row"]);
    let (_, all, topics) = cited("");
    assert_eq!(
        topics,
        "highest at_velocity at_depth per_velocity per_depth tier"
    );
    let runs = directory.rows("results/runs.csv");
    for about in all.iter().chain(&ranked) {
        // Counted from 1.
        let row = about["row"].as_u64().expect("a row") as usize;
        for column in ["brushing_velocity_m_s", "tool_contact_normal_force_n"] {
            let expected = number(&runs[row - 1], column);
            assert_eq!(about[column], expected, "{column} of row {row}");
        }
    }
}

#[test]
fn the_recommendation_is_what_a_brush_of_filaments_that_touch_does() {
    let directory = simulated(&format!(
        "{SWEEPS}[uncertainty]\nsamples = 64\nyoungs_modulus_std_pa = 0.3e9\n"
    ));
    let text = directory.printed(
        "advise results --max-force 220 --max-rpm 1000 --max-depth 2 --max-power 400 --no-verify",
    );
    let with = "with n_w ≤ 1000 rpm and a_e ≤ 2 mm and F_n,w ≤ 220 N and P_w ≤ 400 W";
    has(
        &words(&text),
        &["Recommended: ", with, "not simulated: taken from row"],
    );
    has(&text, &["≈", "Not simulated; it sweeps."]);

    let advice = directory.printed_json("advise results --target-force 220 --json");
    let recommendation = &advice["recommendation"];
    let number = |key: &str| recommendation[key].as_f64().expect("a number");
    let force = number("tool_contact_normal_force_n");
    is_near(force, 220.0, 0.05);
    let verified = &recommendation["verified"];
    assert!(verified["error"].is_null() && verified["with_interaction"] == true);
    let in_space = &verified["in_space"];
    assert_eq!(in_space["is_assumed"], true);
    let in_space = |key: &str| in_space[key].as_f64().expect("a number");
    let share = in_space("tool_contact_normal_force_n") / force;
    assert!((0.5..2.0).contains(&share), "{share}");
    assert!((1e-9..0.2 * force).contains(&in_space("standard_error_n")));
    // The interval is that of the study.
    let [lower, upper] = ["tool_force_lower_95_n", "tool_force_upper_95_n"].map(number);
    assert!(lower < 0.9 * force && upper > 1.1 * force);
    let set = format!(
        "--set process.brushing_velocity_m_s={:?} --set process.penetration_depth_m={:?} --set brush.steady=true \
         --set uncertainty.youngs_modulus_std_pa=0",
        number("brushing_velocity_m_s"),
        number("penetration_depth_m")
    );
    directory.run(&format!("simulate case.toml --out one --no-figures {set}"));
    let together = directory.number("one/metrics.json", "tool_contact_normal_force_n");
    is_near(force, together, 1e-9);
}

#[test]
fn a_study_answers_what_its_file_asks_for() {
    let asking = |goal: &str| {
        let file = sparse(FILE).replace("[study]", &format!("[goal]\n{goal}\n[study]"));
        Workspace::with(&format!("{file}{SWEEPS}"))
    };
    let directory = asking("target_force_n = 20\nmax_depth_mm = 1.5");
    let printed = directory.printed("study case.toml --out results");
    let (_, answer) = printed.split_once("Which speed").expect("the question");
    let begin = " and depth give F_n,w = 20 N with a_e ≤ 1.5 mm?\nRecommended for 20 N: ";
    assert!(answer.starts_with(begin), "{answer}");
    // Later advice has the same lines.
    let advised = directory.printed("advise results --target-force 20 --max-depth 1.5");
    let (_, lines) = answer.split_once('\n').expect("lines");
    assert!(advised.starts_with(lines.trim_end()), "{lines}\n{advised}");
    let question = "\"question\":\"Which speed and depth give F_n,w = 20 N with a_e ≤ 1.5 mm?\"";
    has(&directory.read("results/report.html"), &[question]);

    // A question without an answer is reported, and the results are there.
    let directory = asking("max_force_n = 1");
    let printed = directory.printed("study case.toml --out results");
    has(
        &printed,
        &["F_n,w ≤ 1 N?\nNo case of the study is within these limits."],
    );
}

#[test]
fn failed_cases_are_left_out() {
    let directory = simulated(&format!(
        "{SWEEPS}\"contact.stiffness_n_m\" = [1e300, 1e5]\n"
    ));
    let text = directory.printed("advise results");
    let (advice, failed) = text
        .split_once("With k_c = 1e300 N/m^p\n")
        .expect("two sections");
    assert!(advice.starts_with("With k_c = 1e5 N/m^p\n"), "{text}");
    lacks(advice, &["failed"]);
    assert!(failed.starts_with("All 12 cases failed.\n\n"), "{text}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let directory = simulated("\"filament.segments\" = [3, 4]\n");
    directory.refuses("advise results", &["error: results: ", "sweep one of them"]);
    directory.run("simulate case.toml --out one");
    for name in ["one", "absent"] {
        let problem = format!("`{name}` has no study.json");
        directory.refuses(&format!("advise {name}"), &[&problem, "help:"]);
    }
    fs::remove_file(directory.path("results/runs.csv")).expect("the file can be removed");
    directory.refuses("advise results", &["cannot read `results/runs.csv`"]);
}

#[test]
fn bad_limits_are_refused() {
    let directory = simulated(SWEEPS);
    for (limits, problem) in [
        ("--max-velocity -5", "in m/s"),
        ("--max-ratio NaN", "from 0 to 1"),
        ("--target-force=-1", "positive number"),
        ("--max-power inf", "positive number"),
        (
            "--max-force 200 --target-force 250",
            "the target of 250 N is above the highest force of 200 N",
        ),
        (
            "--min-ratio 0.6 --max-ratio 0.5",
            "at least 0.6 and at most 0.5",
        ),
    ] {
        directory.refuses(&format!("advise results {limits}"), &[problem]);
    }
    let far = directory.printed("advise results --target-force 5000 --no-verify");
    has(&words(&far), &["% off the target"]);
    let unmet = directory.printed("advise results --max-velocity 1 --no-verify");
    has(&unmet, &["No case has v_b ≤ 1 m/s."]);
}
