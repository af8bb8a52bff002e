//! The speed of the machine: settings, results and figures by the rotational speed instead of the
//! velocity of the tips.

use std::f64::consts::TAU;

use crate::program::{self, Workspace, brush, page_data};

const HEAD: &str = concat!(
    brush!(4),
    "
[solver]
relative_tolerance = 1e-4
"
);

/// The undeformed radius of the tool in m.
const RADIUS_M: f64 = 0.180;

fn velocity(speed_rpm: f64) -> f64 {
    TAU * speed_rpm / 60.0 * RADIUS_M
}

/// A directory in which a command with an input file has succeeded, and what it showed.
fn done(command: &str, text: &str) -> (Workspace, String) {
    let directory = Workspace::with(text);
    let said = directory.printed(command);
    (directory, said)
}

#[test]
fn speed_and_velocity_give_the_same_contact() {
    let metrics = |speed: &str| {
        let text = format!("{HEAD}[process]\n{speed}\npenetration_depth_m = 1e-3\n");
        let (directory, _) = done("simulate case.toml --out one", &text);
        directory.json("one/metrics.json")
    };
    let by_speed = metrics("rotational_speed_rpm = 600");
    let by_velocity = metrics(&format!("brushing_velocity_m_s = {:?}", velocity(600.0)));
    for (key, value) in by_speed.as_object().expect("an object") {
        // The velocity that follows is rounded. A residual is a small difference of large sums,
        // relative to them already.
        let [here, there] = [value, &by_velocity[key]].map(|value| value.as_f64().unwrap_or(0.0));
        let scale = if key.ends_with("_residual") {
            1.0
        } else {
            there.abs()
        };
        assert!(
            (here - there).abs() <= 1e-9 * scale,
            "{key}: {here} and {there}"
        );
    }
    assert!((by_speed["rotational_speed_rpm"].as_f64().expect("a number") - 600.0).abs() < 1e-9);
    assert!(
        (by_speed["brushing_velocity_m_s"]
            .as_f64()
            .expect("a number")
            - velocity(600.0))
        .abs()
            < 1e-12
    );
}

#[test]
fn a_study_of_the_speed_has_it_in_all_results() {
    let sweeps =
        "[study]\nrotational_speed_rpm = [600, 1200]\npenetration_depth_m = [1e-3, 2e-3]\n";
    let (directory, said) = done("study case.toml --out results", &format!("{HEAD}{sweeps}"));
    assert!(
        said.contains(" a_e in mm │ n_w in rpm\n           │    600   1200\n"),
        "{said}"
    );
    let has_machine = ["F_n,w in N: ", "M_w in N m: ", "P_w in W: "].map(|title| said.find(title));
    assert!(
        has_machine.is_sorted() && has_machine[0].is_some(),
        "{said}"
    );

    let runs = directory.read("results/runs.csv");
    let row = |row: usize| {
        runs.lines()
            .nth(row)
            .expect("a row")
            .split(',')
            .take(4)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        row(0),
        [
            "brushing_velocity_m_s",
            "penetration_depth_m",
            "segments",
            "rotational_speed_rpm"
        ]
    );
    assert_eq!(row(2)[1..], ["0.001", "4", "1200.0"]);
    assert!((row(2)[0].parse::<f64>().expect("a number") - velocity(1200.0)).abs() < 1e-12);

    let drawn = directory.read("results/figures/tool_force_over_speed.svg");
    assert!(drawn.contains("rotational speed"), "no label");
    let map = directory.read("results/figures/tool_force_map.svg");
    directory.run("plot results");
    assert!(
        map == directory.read("results/figures/tool_force_map.svg"),
        "another map from saved results"
    );

    let data = page_data(&directory.read("results/report.html"));
    assert_eq!(data["axes"][1]["path"], "process.rotational_speed_rpm");
    let settings = data["settings"].as_array().expect("settings");
    let of = |path: &str| {
        &settings
            .iter()
            .find(|setting| setting["path"] == path)
            .expect(path)["value"]
    };
    assert!(
        of("process.rotational_speed_rpm").is_null()
            && of("process.brushing_velocity_m_s").is_null()
    );

    let advice = directory.printed("advise results");
    assert!(
        advice.starts_with("  row   n_w   a_e") && advice.contains("lowest is 183.7 N at 600 rpm"),
        "{advice}"
    );
    let heading = advice.lines().next().expect("a heading");
    assert!(
        ["F_n,w", "M_w", "P_w"]
            .map(|symbol| heading.find(symbol))
            .is_sorted(),
        "{advice}"
    );
    let advice = directory.printed_json("advise results --json --max-velocity 15 --no-verify");
    let within = &advice["sections"][0]["advice"][1];
    assert_eq!(
        (&within["topic"], &within["rotational_speed_rpm"]),
        (&"within_limits".into(), &600.0.into())
    );
    assert!(
        within["tool_torque_n_m"]
            .as_f64()
            .is_some_and(|torque| torque > 0.0),
        "{within}"
    );
}

#[test]
fn a_speed_that_is_held_gives_each_length_its_velocity() {
    let velocities = |speed: &str| {
        let study = program::study(&format!(
            "{HEAD}[process]\n{speed}\npenetration_depth_m = 1e-3\n[study]\n\"filament.length_m\" = [0.03, 0.04]\n"
        ));
        assert_eq!(study.case_count(), 2);
        [0, 1].map(|case| study.settings(case).process.brushing_velocity_m_s)
    };
    let held = velocities("rotational_speed_rpm = 600");
    assert!((held[0] - velocity(600.0) * 0.17 / RADIUS_M).abs() < 1e-12);
    assert!((held[1] - velocity(600.0)).abs() < 1e-12);
    // A velocity that is held gives each length its speed.
    assert_eq!(velocities("brushing_velocity_m_s = 10"), [10.0, 10.0]);
}

#[test]
fn a_sweep_replaces_what_states_the_same() {
    for (process, sweep) in [
        (
            "brushing_velocity_m_s = 10",
            "rotational_speed_rpm = [600, 900]",
        ),
        (
            "rotational_speed_rpm = 600",
            "brushing_velocity_m_s = [10, 20]",
        ),
    ] {
        let text =
            format!("{HEAD}[process]\n{process}\npenetration_depth_m = 1e-3\n[study]\n{sweep}\n");
        let study = program::study(&text);
        assert_eq!((study.case_count(), study.sweeps().len()), (2, 1), "{text}");
    }
}

#[test]
fn measured_forces_are_compared_at_their_velocity() {
    let sweeps = "[study]\nrotational_speed_rpm = [600, 1200]\npenetration_depth_m = [1e-3]\n";
    let measured = "[measured]\nfile = \"forces.csv\"\n";
    let directory = Workspace::with(&format!("{HEAD}{sweeps}{measured}"));
    let heading = "brushing_velocity_m_s,penetration_depth_m,force_n,std_n";
    directory.write(
        "forces.csv",
        format!("{heading}\n{:?},0.001,150,10\n", velocity(600.0)),
    );
    directory.run("study case.toml --out results");
    let first = |name: &str| directory.rows(name).remove(0);
    let (runs, compared) = (
        first("results/runs.csv"),
        first("results/measured_comparison.csv"),
    );
    assert_eq!(
        runs["tool_contact_normal_force_n"],
        compared["simulated_force_n"]
    );
    assert!(
        directory
            .path("results/figures/measured_over_speed.svg")
            .is_file()
    );
}
