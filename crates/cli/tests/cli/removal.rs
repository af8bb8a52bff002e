//! Edges that become round, and filaments that wear.

use std::f64::consts::TAU;

use crate::program::{Workspace, has, is_near, lacks, number, words};

const FILE: &str = "[tool]
body_radius_m = 0.140
width_m = 0.020
filament_count = 10500
[filament]
segments = 10
length_m = 0.040
diameter_m = 1.18e-3
[contact]
friction_coefficient = 0.3
[workpiece]
kind = \"edge\"
side = \"entering\"
edge_radius_m = 0.1e-3
offset_m = -5e-3
[solver]
relative_tolerance = 1e-5
[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 2e-3
[removal]
preston_m2_n = 2e-14
until = { edge_radius_m = 0.2e-3 }
";

#[test]
fn an_edge_grows_until_its_goal() {
    let directory = Workspace::with(FILE);
    let said = directory.printed("wear case.toml --out grown --threads 1");
    assert!(
        said.starts_with("edge of 90°: R = 0.200 mm after "),
        "{said}"
    );
    let [turns, areas, works] = ["turns", "removed_area_m2", "edge_sliding_work_j"]
        .map(|key| directory.column("grown/removal.csv", key));
    // Work that removes the area: k_P N_f/b times the mean of W_e over the turns.
    let dose: f64 = (0..200)
        .map(|i| (turns[i + 1] - turns[i]) * (works[i + 1] + works[i]) / 2.0)
        .sum();
    is_near(2e-14 * 10_500.0 / 0.020 * dose, areas[200], 2e-3);
    for figure in ["edge_radius.svg", "edge_shape.svg", "edge_work.svg"] {
        directory.has_file(&format!("grown/figures/{figure}"));
    }
    // Simulated edges agree with `simulate`, and any number of threads gives equal results.
    directory.run("simulate case.toml --out one --no-figures");
    let one = |key: &str| directory.number("one/metrics.json", key);
    let first = &directory.rows("grown/edge_work.csv")[0];
    for key in [
        "edge_sliding_work_j",
        "sliding_work_j",
        "tool_contact_normal_force_n",
    ] {
        is_near(number(first, key), one(key), 1e-6);
    }
    let expected = 2e-14 * one("sliding_work_j") * 10_500.0 * 10.0 / 0.18 / TAU;
    is_near(one("removal_rate_m3_s"), expected, 1e-12);
    lacks(&directory.read("one/metrics.json"), &["wear_ratio"]);
    let checked = directory.said("wear case.toml --out again --threads 3 --check");
    has(
        &checked,
        &["with a tenth of the tolerance, radius and time change by at most 0."],
    );
    let [grown, again] =
        ["grown", "again"].map(|out| directory.read(&format!("{out}/removal.csv")));
    assert_eq!(grown, again);
}

#[test]
fn worn_filaments_press_less_unless_the_tool_follows() {
    let directory = Workspace::with(&(FILE.to_owned() + "filament_wear_m2_n = 1e-11\n"));
    let said = words(&directory.printed("wear case.toml --out worn --no-figures"));
    has(&said, &["filaments lose ", "wear ratio 0.00200"]);
    let [forces, lengths] = ["tool_contact_normal_force_n", "filament_length_m"]
        .map(|key| directory.column("worn/removal.csv", key));
    assert!(lengths[200] < 0.0399 && forces[200] < forces[0]);
    directory.run("wear case.toml --out held --no-figures --set removal.compensate=true");
    let held = directory.column("held/removal.csv", "tool_contact_normal_force_n");
    assert!((held[200] / held[0] - 1.0).abs() < (forces[200] / forces[0] - 1.0).abs());
}

#[test]
fn both_directions_and_both_edges_of_a_chamfer() {
    let directory = Workspace::with(FILE);
    // Works on the first edge, and on the second, if any.
    let works = |options: &str, keys: &[&str]| -> Vec<f64> {
        let short = "--no-figures --set removal.until={turns=10}";
        directory.run(&format!("wear case.toml --out one {short} {options}"));
        keys.iter()
            .map(|key| directory.column("one/edge_work.csv", key)[0])
            .collect()
    };
    let leaving = "--set workpiece.side=leaving --set workpiece.offset_m=5e-3";
    let [entering, leaving, both] = ["", leaving, "--set removal.alternate=true"]
        .map(|options| works(options, &["edge_sliding_work_j"])[0]);
    is_near(both, (entering + leaving) / 2.0, 1e-9);
    let chamfer = "--set workpiece.kind=chamfer --set workpiece.chamfer_width_m=1e-3";
    let edges = works(
        chamfer,
        &["edge_sliding_work_j", "second_edge_sliding_work_j"],
    );
    assert!(edges.iter().all(|work| *work > 0.0), "{edges:?}");
    let simulate = "simulate case.toml --out one --no-figures";
    directory.run(&format!("{simulate} {chamfer}"));
    let whole = directory.number("one/metrics.json", "edge_sliding_work_j");
    is_near(edges.iter().sum(), whole, 1e-6);
}

#[test]
fn advice_ranks_by_removal() {
    let study = "filament_wear_m2_n = 1e-14\n[study]\nbrushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]\n";
    let file = FILE.replace("edge_radius_m = 0.1e-3", "edge_radius_m = 0.5e-3");
    let directory = Workspace::with(&(file.clone() + study));
    directory.run("study case.toml --out results --no-figures");
    let advice = words(&directory.printed("advise results"));
    let rates = directory.column("results/runs.csv", "removal_rate_m3_s");
    let most = 60e9 * rates.into_iter().fold(0.0, f64::max);
    has(
        &advice,
        &[
            &format!("Removes {most:.3} mm³/min, the most of 4 cases"),
            " mm³/min on the edge, the most of 4 cases",
            "W per W of the drive",
            "The wear ratio is 2.00 in every case",
        ],
    );
    let ratios = directory.column("results/runs.csv", "wear_ratio");
    assert_eq!(ratios, [2.0; 4]);
}

#[test]
fn what_cannot_be_followed_says_why() {
    let directory = Workspace::with(FILE);
    let cases = [
        (
            "preston_m2_n = 2e-14\n",
            "",
            "state `removal.preston_m2_n`, or what one trial showed",
        ),
        (
            "preston_m2_n = 2e-14",
            "preston_m2_n = 0.0",
            "`removal.preston_m2_n` is 0.0",
        ),
        (
            "preston_m2_n",
            "observed = { edge_radius_m = 1.5e-4, time_s = 10.0 }\npreston_m2_n",
            "beside removal.preston_m2_n",
        ),
        ("offset_m = -5e-3", "offset_m = 0.15", "is never reached"),
        (
            "{ edge_radius_m = 0.2e-3 }",
            "{ turns = 5, time_s = 3 }",
            "until",
        ),
        (
            "{ edge_radius_m = 0.2e-3 }",
            "{ turns = -5 }",
            "`removal.until` is -5.0, but must be",
        ),
    ];
    for (old, new, expected) in cases {
        directory.write("wrong.toml", FILE.replacen(old, new, 1));
        let message = words(&directory.refused("wear wrong.toml --out nothing"));
        has(&message, &[expected]);
        directory.has_no("nothing/removal.csv");
    }
}

#[test]
fn worn_filaments_may_never_reach_the_goal() {
    let directory = Workspace::with(FILE);
    let slow = "--set removal.preston_m2_n=1e-16 --set removal.filament_wear_m2_n=1e-10";
    let said = words(&directory.refused(&format!("wear case.toml --out out {slow}")));
    has(
        &said,
        &[
            "is never reached; the largest is ",
            "then the filaments have lost",
        ],
    );
    // A small edge that new filaments can pass over and shorter ones dip through.
    let small = "--set workpiece.edge_radius_m=20e-6 --set filament.segments=25 --set solver.relative_tolerance=1e-4";
    let said = directory.printed(&format!(
        "wear case.toml --out small --no-figures {small} --set removal.filament_wear_m2_n=1e-11"
    ));
    assert!(said.contains("filaments lose 0.2"), "{said}");
}

/// The ends of the interval are the times with radii read at the ends of theirs.
#[test]
fn the_time_has_the_interval_of_an_observed_radius() {
    let observed = |edge: &str| {
        let file = FILE.replace("preston_m2_n = 2e-14", &format!("observed = {{ {edge} }}"));
        let directory = Workspace::with(&file);
        let printed = directory.printed("wear case.toml --out out --json --no-figures");
        let result = printed
            .lines()
            .find(|line| line.contains("time_interval_95_s"))
            .expect("a result");
        serde_json::from_str::<serde_json::Value>(result).expect("JSON")
    };
    let std = 1e-5 / 1.959_963_984_540_054;
    let found = observed(&format!(
        "edge_radius_m = 0.15e-3, edge_radius_std_m = {std:e}, time_s = 72.0"
    ));
    for (end, radius) in [(1, "0.14e-3"), (0, "0.16e-3")] {
        let read = observed(&format!("edge_radius_m = {radius}, time_s = 72.0"));
        assert!(read["time_interval_95_s"].is_null());
        let [time, expected] = [&found["time_interval_95_s"][end], &read["time_s"]]
            .map(|number| number.as_f64().expect("a time"));
        // Both follow the growth over radii that were chosen anew.
        is_near(time, expected, 5e-3);
    }
}
