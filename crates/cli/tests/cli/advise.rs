//! `bristle advise`: its table, its JSON, and what it refuses.

use std::fs;

use predicates::prelude::*;
use serde_json::Value;

use crate::program::{Workspace, brush, has, number, sparse, words};

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

/// A directory with a study, simulated to `results`; cases may fail.
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
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
    insta::assert_snapshot!(text);
}

#[test]
fn json_has_the_numbers_of_the_rows_it_cites() {
    let directory = simulated(SWEEPS);
    let json = |arguments: &str| {
        let text = directory.printed(arguments);
        assert_eq!(text.lines().count(), 1);
        serde_json::from_str::<Value>(&text).expect("JSON")
    };
    let topics = |advice: &Value| {
        let cited = advice["sections"][0]["advice"]
            .as_array()
            .expect("advice")
            .clone();
        let mut topics: Vec<String> = cited
            .iter()
            .map(|about| about["topic"].to_string())
            .collect();
        topics.dedup();
        (topics.join(" ").replace('"', ""), cited)
    };
    let limited = json("advise results --max-velocity 15 --no-verify --json");
    assert_eq!(limited["limits"]["max_velocity_m_s"], 15.0);
    let (words, ranked) = topics(&limited);
    assert_eq!((words.as_str(), ranked.len()), ("within_limits", 5));
    assert_eq!(limited["recommendation"]["rows"][0], ranked[0]["row"]);
    let (words, cited) = topics(&json("advise results --json"));
    assert_eq!(
        words,
        "highest at_velocity at_depth per_velocity per_depth tier"
    );
    let runs = directory.rows("results/runs.csv");
    for about in cited.iter().chain(&ranked) {
        // Counted from 1.
        let row = about["row"].as_u64().expect("a row") as usize;
        for column in [
            "brushing_velocity_m_s",
            "penetration_depth_m",
            "tool_contact_normal_force_n",
            "contact_time_ratio",
        ] {
            assert_eq!(
                about[column],
                number(&runs[row - 1], column),
                "{column} of row {row}"
            );
        }
    }
    let forces = runs
        .iter()
        .map(|row| number(row, "tool_contact_normal_force_n"));
    assert_eq!(
        (runs.len(), &cited[0]["tool_contact_normal_force_n"]),
        (12, &forces.fold(0.0, f64::max).into())
    );
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
    assert!(words(&text).contains(with), "{text}");
    has(&text, &["≈", "Not simulated; it sweeps."]);
    assert!(
        text.starts_with("Recommended: ") && text.contains("  not simulated: taken from row"),
        "{text}"
    );

    let advice = directory.printed_json("advise results --target-force 220 --json");
    let recommendation = &advice["recommendation"];
    let number = |key: &str| recommendation[key].as_f64().expect("a number");
    let force = number("tool_contact_normal_force_n");
    assert!((force / 220.0 - 1.0).abs() < 0.05, "{recommendation}");
    let verified = &recommendation["verified"];
    assert!(
        verified["error"].is_null() && verified["with_interaction"] == true,
        "{recommendation}"
    );
    let in_space = &verified["in_space"];
    let [space, error] =
        ["tool_contact_normal_force_n", "standard_error_n"].map(|key| in_space[key].as_f64());
    assert!(
        space.is_some_and(|space| (0.5..2.0).contains(&(space / force))),
        "{in_space}"
    );
    assert!(
        error.is_some_and(|error| error > 0.0 && error < 0.2 * force),
        "{in_space}"
    );
    assert_eq!(in_space["is_assumed"], true);
    // The band is that of the study.
    let [lower, upper] = ["tool_force_lower_95_n", "tool_force_upper_95_n"].map(number);
    assert!(
        lower < 0.9 * force && upper > 1.1 * force,
        "{recommendation}"
    );
    let set = format!(
        "--set process.brushing_velocity_m_s={:?} --set process.penetration_depth_m={:?} --set brush.steady=true \
         --set uncertainty.youngs_modulus_std_pa=0",
        number("brushing_velocity_m_s"),
        number("penetration_depth_m")
    );
    directory
        .bristle(&format!("brush case.toml --out one --no-figures {set}"))
        .assert()
        .success();
    let together = directory.number("one/metrics.json", "tool_contact_normal_force_n");
    assert!(
        (force / together - 1.0).abs() < 1e-9,
        "{together} N, {recommendation}"
    );
}

#[test]
fn a_study_answers_what_its_file_asks_for() {
    let asking = |goal: &str| {
        let file = sparse(FILE).replace("[study]", &format!("[goal]\n{goal}\n[study]"));
        Workspace::with(&format!("{file}{SWEEPS}"))
    };
    let directory = asking("target_force_n = 20\nmax_depth_mm = 1.5");
    let printed = directory.printed("study case.toml --out results");
    let answer = printed.split_once("Which speed").expect("the question").1;
    assert!(
        answer
            .starts_with(" and depth give F_n,w = 20 N with a_e ≤ 1.5 mm?\nRecommended for 20 N: "),
        "{answer}"
    );
    // The same as of advice afterwards, whose lines it has.
    let advised = directory.printed("advise results --target-force 20 --max-depth 1.5");
    let (_, lines) = answer.split_once('\n').expect("lines");
    assert!(advised.starts_with(lines.trim_end()), "{lines}\n{advised}");
    let question = "\"question\":\"Which speed and depth give F_n,w = 20 N with a_e ≤ 1.5 mm?\"";
    assert!(directory.read("results/report.html").contains(question));

    // What cannot be answered is said, and the results are there.
    let directory = asking("max_force_n = 1");
    let printed = directory.printed("study case.toml --out results");
    assert!(
        printed.contains("F_n,w ≤ 1 N?\nNo case of the study is within these limits."),
        "{printed}"
    );
}

#[test]
fn most_from_edges_is_a_goal() {
    let text = sparse(FILE).replace(
        "[process]",
        "[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-3\n[removal]\n[goal]\nmost = \"edge\"\n[process]",
    );
    let directory = Workspace::with(&format!("{text}{SWEEPS}"));
    let printed = directory.printed("study case.toml --out results");
    let answer = printed
        .split_once("Which speed and depth remove most from edges?\n")
        .expect("the question")
        .1;
    assert!(
        answer.contains("in proportion to which it removes material on the edge"),
        "{answer}"
    );
    let [works, speeds] = ["edge_sliding_work_j", "rotational_speed_rpm"]
        .map(|key| directory.column("results/runs.csv", key));
    let power = |row: &usize| works[*row] * speeds[*row];
    let most = (0..works.len())
        .max_by(|a, b| power(a).total_cmp(&power(b)))
        .expect("cases");
    assert!(
        answer.contains(&format!("(row {}: ", most + 1)),
        "row {}: {answer}",
        most + 1
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
    assert!(
        advice.starts_with("With k_c = 1e5 N/m^p\n") && !advice.contains("failed"),
        "{text}"
    );
    assert!(failed.starts_with("All 12 cases failed.\n\n"), "{text}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let directory = simulated("\"filament.segments\" = [3, 4]\n");
    directory.refuses("advise results", &["error: results: ", "sweep one of them"]);
    directory
        .bristle("simulate case.toml --out one")
        .assert()
        .success();
    for name in ["one", "absent"] {
        directory.refuses(
            &format!("advise {name}"),
            &[&format!("`{name}` has no study.json"), "help:"],
        );
    }
    let text = directory.read("results/runs.csv");
    directory.write(
        "results/runs.csv",
        text.replacen(",ok\n", ",ok\n10.0,0.1", 1),
    );
    directory.refuses("advise results", &["runs.csv:3", "help:"]);
    fs::remove_file(directory.path("results/runs.csv")).expect("the file can be removed");
    directory.refuses("advise results", &["cannot read `results/runs.csv`"]);
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
        ("--max-force 0", "positive number"),
        ("--target-force=-200", "positive number"),
        ("--target-force -1", "positive number"),
        ("--max-velocity -5", "in m/s"),
        ("--max-rpm fast", "positive number"),
        ("--max-depth NaN", "positive number"),
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
    assert!(words(&far).contains("% off the target"), "{far}");
    let unmet = directory.printed("advise results --max-velocity 1 --no-verify");
    assert!(unmet.contains("No case has v_b ≤ 1 m/s."), "{unmet}");
}
