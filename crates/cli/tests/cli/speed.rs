//! The rotational speed of the tool: settings, results and figures with this speed instead of the
//! velocity of the tips.

use std::f64::consts::TAU;

use crate::program::{self, Workspace, brush, has, is_near, number, page_data};

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

#[test]
fn speed_and_velocity_give_the_same_contact() {
    let metrics = |speed: &str| {
        let text = format!("{HEAD}[process]\n{speed}\npenetration_depth_m = 1e-3\n");
        let directory = Workspace::with(&text);
        directory.run("simulate case.toml --out one");
        directory.json("one/metrics.json")
    };
    let by_speed = metrics("rotational_speed_rpm = 600");
    let by_velocity = metrics(&format!("brushing_velocity_m_s = {:?}", velocity(600.0)));
    for (key, value) in by_speed.as_object().expect("an object") {
        // The derived velocity is rounded. A residual is a small difference between large sums,
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
    let number = |key: &str| by_speed[key].as_f64().expect(key);
    is_near(number("rotational_speed_rpm"), 600.0, 1e-12);
    is_near(number("brushing_velocity_m_s"), velocity(600.0), 1e-12);
}

#[test]
fn a_study_of_the_speed_has_it_in_all_results() {
    let sweeps =
        "[study]\nrotational_speed_rpm = [600, 1200]\npenetration_depth_m = [1e-3, 2e-3]\n";
    let directory = Workspace::with(&format!("{HEAD}{sweeps}"));
    let said = directory.printed("study case.toml --out results --tables all");
    has(
        &said,
        &[" a_e in mm │ n_w in rpm\n           │    600   1200\n"],
    );
    let has_machine = ["F_n,w in N: ", "M_w in N m: ", "P_w in W: "].map(|title| said.find(title));
    assert!(has_machine.is_sorted() && has_machine[0].is_some());

    let last = directory.rows("results/runs.csv").remove(1);
    assert_eq!(last["rotational_speed_rpm"], "1200.0");
    is_near(
        number(&last, "brushing_velocity_m_s"),
        velocity(1200.0),
        1e-12,
    );
    let drawn = directory.read("results/figures/tool_force_over_speed.svg");
    has(&drawn, &["rotational speed"]);

    let data = page_data(&directory.read("results/report.html"));
    assert_eq!(data["axes"][1]["path"], "process.rotational_speed_rpm");
    let mut settings = data["settings"].as_array().expect("settings").iter();
    let of_speed = settings.find(|setting| setting["path"] == "process.rotational_speed_rpm");
    assert!(of_speed.expect("the setting")["value"].is_null());

    let advice = directory.printed("advise results");
    assert!(advice.starts_with("  row   n_w   a_e"), "{advice}");
    has(&advice, &["lowest is 183.7 N at 600 rpm"]);
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
    is_near(held[0], velocity(600.0) * 0.17 / RADIUS_M, 1e-13);
    is_near(held[1], velocity(600.0), 1e-13);
    // A constant velocity gives each length its speed.
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
