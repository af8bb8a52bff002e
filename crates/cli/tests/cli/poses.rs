//! Tools of any kind and pose as users see them: files, figures and pages.

use serde_json::Value;

use crate::program::{Workspace, brush, has, page_data};

/// Returns the paper's brush with further lines of `[tool]`.
fn file(tool: &str, more: &str) -> String {
    let head = concat!(
        brush!(4),
        "
[solver]
relative_tolerance = 1e-3

[process]
brushing_velocity_m_s = 10.0
"
    );
    head.replace("[tool]\n", &format!("[tool]\n{tool}\n")) + more
}

const DEPTH: &str = "penetration_depth_m = 1.0e-3\n";

#[test]
fn the_page_of_a_cup_has_both_views() {
    let cup = file("kind = \"cup\"\ntilt_rad = 1.5\npositions = 3", DEPTH);
    let directory = Workspace::with(&format!(
        "{cup}[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"
    ));
    directory.run("study case.toml --out whole --no-figures");
    let page = directory.read("whole/report.html");
    let data = page_data(&page);
    let course = &data["courses"][1][1];
    let names: Vec<&Value> = course["views"]
        .as_array()
        .expect("views")
        .iter()
        .map(|view| &view["name"])
        .collect();
    assert_eq!(names, ["along the axis", "from the side"]);
    for view in course["views"].as_array().expect("views") {
        let window: Vec<f64> = serde_json::from_value(view["window"].clone()).expect("numbers");
        assert!(window[0] < window[1] && window[2] < window[3], "{window:?}");
        // Along the axis the plane is a line, as the cup is not flat.
        assert_eq!(view["outline"]["solid"], false);
    }
    for shard in ["1/2", "2/2"] {
        directory.run(&format!(
            "study case.toml --out part-{} --no-figures --shard {shard}",
            &shard[..1]
        ));
    }
    directory.run("report part-1 part-2 --out merged --no-figures");
    assert!(
        directory.read("merged/report.html") == page,
        "courses are those of all filaments"
    );

    directory.write(
        "case.toml",
        format!(
            "{}[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n",
            file("", DEPTH)
        ),
    );
    directory.run("study case.toml --out upright --no-figures");
    let data = page_data(&directory.read("upright/report.html"));
    let views = data["courses"][0][1]["views"].as_array();
    assert_eq!(views.map(Vec::len), Some(1));
}

#[test]
fn a_study_of_forces_shows_the_depths() {
    let sweeps =
        "[study]\nbrushing_velocity_m_s = [5.0, 20.0]\n\"process.tool_force_n\" = [20.0, 100.0]\n";
    let directory = Workspace::with(&file("", &format!("tool_force_n = 50.0\n{sweeps}")));
    let shown = directory.printed("study case.toml --out results --figures all,svg");
    assert!(
        shown
            .lines()
            .any(|line| line.contains("tool force") && line.contains("a_e")),
        "{shown}"
    );
    let names = directory.names("results/figures");
    for name in [
        "penetration_depth_over_velocity.svg",
        "penetration_depth_map.svg",
        "tool_torque_map.svg",
    ] {
        assert!(
            names.iter().any(|drawn| drawn == name),
            "{name} in {names:?}"
        );
    }
    // The force is stated by the file.
    assert!(
        !names.iter().any(|name| name.starts_with("tool_force_")),
        "{names:?}"
    );
    let curves = directory.read("results/figures/penetration_depth_over_velocity.svg");
    has(&curves, &["tool force = 20 N", "tool force = 100 N"]);
    assert!(
        directory
            .read("results/figures/penetration_depth_map.svg")
            .contains("tool force in N")
    );
    let data = page_data(&directory.read("results/report.html"));
    assert_eq!(data["quantities"][0]["key"], "penetration_depth_m");
    assert!(
        !data["headline"].as_str().expect("text").contains("a_e = 0"),
        "{}",
        data["headline"]
    );
    // The course belongs to the depth that was found.
    let impulse = data["courses"][0][1]["turn_impulses"][0].as_f64();
    let expected = directory.column("results/runs.csv", "contact_normal_impulse_n_s")[0];
    let ratio = impulse.expect("an impulse") / expected;
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
}
