//! How precisely a contact must be computed.

use std::collections::BTreeMap;

use bristle_text::columns;

use crate::program::{Workspace, brush, has, number, words};

const FILE: &str = concat!(
    brush!(10),
    "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n"
);

/// Values and forces of a setting in the table.
fn forces(rows: &[BTreeMap<String, String>], setting: &str) -> Vec<[f64; 2]> {
    let of = rows
        .iter()
        .filter(|row| row["setting"] == setting && row["status"] == "ok");
    of.map(|row| ["value", "tool_contact_normal_force_n"].map(|key| number(row, key)))
        .collect()
}

#[test]
fn the_choice_is_as_good_as_it_says() {
    let directory = Workspace::with(FILE);
    let said = directory.printed("converge case.toml --out out --threads 1");
    assert!(said.lines().all(|line| columns(line) <= 80), "{said}");
    let rows = directory.rows("out/converge.csv");
    let segments = forces(&rows, "filament.segments");
    let numbers: Vec<f64> = segments.iter().map(|[number, _]| *number).collect();
    assert_eq!(numbers, [5.0, 8.0, 10.0, 12.0, 17.0, 25.0, 35.0, 50.0]);
    assert_eq!(forces(&rows, "solver.relative_tolerance").len(), 6);
    has(&said, &["power 2.", " as stated\n"]);
    // Each case is what `simulate` says.
    let simulated = |options: &str| {
        directory.run(&format!(
            "simulate case.toml --out one --no-figures {options}"
        ));
        directory.number("one/metrics.json", "tool_contact_normal_force_n")
    };
    let finest = simulated("--set filament.segments=50");
    assert!((segments[7][1] / finest - 1.0).abs() < 1e-9, "{finest}");
    // And the last line is right: the options that it names keep the force within one per cent of a
    // finer one.
    let last = words(&said)
        .rsplit("For 1 %: ")
        .next()
        .expect("a choice")
        .to_owned();
    let (options, stated) = last
        .split_once(". As stated, F_n,w is good to ")
        .expect("both");
    let error: f64 = stated.trim_end_matches(" %.").parse().expect("a number");
    let finer = simulated("--set filament.segments=100 --set solver.relative_tolerance=1e-8");
    assert!((simulated(options) / finer - 1.0).abs() < 0.01, "{options}");
    let own = 100.0 * (segments[2][1] / finer - 1.0).abs();
    assert!((own / error - 1.0).abs() < 0.1, "{own} % {error} %");
    assert_eq!(
        directory.names("out/figures"),
        ["converge.pdf", "converge.png", "converge.svg"]
    );
    directory.run("converge case.toml --out again --threads 3 --figures svg");
    assert_eq!(
        directory.read("out/converge.csv"),
        directory.read("again/converge.csv")
    );
    // Figures of kinds that are not drawn would be those of another result.
    directory.run("converge case.toml --out out --figures svg");
    assert_eq!(directory.names("out/figures"), ["converge.svg"]);
}

#[test]
fn brushes_have_other_settings() {
    let sector = "[brush]\nrows = 1\ncolumns = 4\nsteady = false\n";
    let file = FILE
        .replace("segments = 10", "segments = 4")
        .replace("10500", "682");
    let directory = Workspace::with(&(file + sector));
    let said = directory.printed("converge case.toml --out out --no-figures");
    let rows = directory.rows("out/converge.csv");
    let values = |setting: &str| {
        forces(&rows, setting)
            .into_iter()
            .map(|[value, _]| value)
            .collect::<Vec<_>>()
    };
    assert_eq!(values("filament.segments"), [4.0, 5.0, 8.0]);
    assert_eq!(values("brush.tolerance"), [1e-3, 3e-4, 1e-4]);
    assert_eq!(
        values("brush.stiffness_n_m2"),
        [6e6, 1.8e7, 6e7, 1.8e8, 6e8]
    );
    assert!(
        values("solver.relative_tolerance").is_empty() && said.contains("k_l in N/m²"),
        "{said}"
    );
    directory.run("brush case.toml --out one --no-figures --set brush.stiffness_n_m2=6e8");
    let force = directory.number("one/metrics.json", "tool_contact_normal_force_n");
    assert_eq!(force, forces(&rows, "brush.stiffness_n_m2")[4][1]);
    directory
        .bristle("converge case.toml --out small --memory-mib 1")
        .assert()
        .code(2);
    assert!(!directory.path("small/converge.csv").exists());
}

#[test]
fn a_force_keeps_its_depth() {
    let force = FILE.replace("penetration_depth_m = 1e-3", "tool_force_n = 100.0");
    let directory = Workspace::with(&format!("{force}[uncertainty]\ndiameter_std_m = 0.03e-3\n"));
    let [_, said] = directory.run("converge case.toml --out out --no-figures");
    assert!(
        words(&said).contains("the depth that reaches 100 N as stated, "),
        "{said}"
    );
    let segments = forces(&directory.rows("out/converge.csv"), "filament.segments");
    assert!(
        (segments[2][1] / 100.0 - 1.0).abs() < 2e-3 && segments[0][1] != segments[2][1],
        "{segments:?}"
    );
}

#[test]
fn what_cannot_be_compared_is_an_error() {
    let far =
        format!("{FILE}[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-4\noffset_m = -0.2\n");
    let directory = Workspace::with(&far);
    let failed = |arguments: &str, code: i32| {
        let output = directory
            .bristle(arguments)
            .assert()
            .code(code)
            .get_output()
            .clone();
        words(&String::from_utf8(output.stderr).expect("UTF-8"))
    };
    let said = failed("converge case.toml --out out", 2);
    assert!(
        said.contains("case.toml: the filaments do not touch the workpiece: F_n,w is 0"),
        "{said}"
    );
    assert!(directory.names("out").is_empty());
    directory.write("case.toml", FILE);
    let said = failed(
        "converge case.toml --out out --set contact.stiffness_n_m=1e300",
        3,
    );
    assert!(
        said.contains("the case that the file states cannot be simulated: "),
        "{said}"
    );
    assert!(!directory.path("out/converge.csv").exists());
    failed("converge missing.toml --out out", 2);
}
