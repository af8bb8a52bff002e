//! The precision with which a contact must be computed.

use std::collections::BTreeMap;

use bristle_study::text::columns;

use crate::program::{Workspace, brush, has, is_near, number, words};

const FILE: &str = concat!(
    brush!(10),
    "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n"
);

/// Returns values and forces of a setting in the table.
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
    let said = directory.printed("simulate case.toml --converge --out out --threads 1");
    assert!(said.lines().all(|line| columns(line) <= 80), "{said}");
    let rows = directory.rows("out/converge.csv");
    let segments = forces(&rows, "filament.segments");
    let numbers: Vec<f64> = segments.iter().map(|[number, _]| *number).collect();
    assert_eq!(numbers, [5.0, 8.0, 10.0, 12.0, 17.0, 25.0, 35.0, 50.0]);
    assert_eq!(forces(&rows, "solver.relative_tolerance").len(), 6);
    has(
        &said,
        &[
            "power 2.",
            " as stated\n",
            "max F_n in N",
            "As stated, only the tip touched.",
        ],
    );
    // Each case agrees with `simulate`.
    let simulated = |options: &str| {
        directory.run(&format!(
            "simulate case.toml --out one --no-figures {options}"
        ));
        directory.number("one/metrics.json", "tool_contact_normal_force_n")
    };
    let finest = simulated("--set filament.segments=50");
    is_near(segments[7][1], finest, 1e-9);
    // The last line is right: its options keep the force within one per cent of a finer one.
    let said = words(&said);
    let (_, last) = said.rsplit_once("For 1 %: ").expect("a choice");
    let (options, stated) = last
        .split_once(". As stated, F_n,w is good to ")
        .expect("both");
    let error: f64 = stated.trim_end_matches(" %.").parse().expect("a number");
    let finer = simulated("--set filament.segments=100 --set solver.relative_tolerance=1e-8");
    is_near(simulated(options), finer, 0.01);
    is_near(100.0 * (segments[2][1] / finer - 1.0).abs(), error, 0.1);
    assert_eq!(directory.names("out/figures"), ["converge.svg"]);
    directory.run("simulate case.toml --converge --out again --threads 3 --figures svg");
    assert_eq!(
        directory.read("out/converge.csv"),
        directory.read("again/converge.csv")
    );
    // Figures of kinds that are not drawn would belong to another result.
    directory.run("simulate case.toml --converge --out out --figures pdf");
    assert_eq!(directory.names("out/figures"), ["converge.pdf"]);
}

#[test]
fn brushes_have_other_settings() {
    let sector = "[brush]\nrows = 1\ncolumns = 4\nsteady = false\n";
    let file = FILE
        .replace("segments = 10", "segments = 4")
        .replace("10500", "682");
    let directory = Workspace::with(&(file + sector));
    let said = directory.printed("simulate case.toml --converge --out out --no-figures");
    let rows = directory.rows("out/converge.csv");
    let values = |setting: &str| {
        let forces = forces(&rows, setting).into_iter();
        forces.map(|[value, _]| value).collect::<Vec<_>>()
    };
    assert_eq!(values("filament.segments"), [4.0, 5.0, 8.0]);
    assert_eq!(values("brush.tolerance"), [3e-3, 9e-4, 3e-4]);
    assert_eq!(
        values("brush.stiffness_n_m2"),
        [6e6, 1.8e7, 6e7, 1.8e8, 6e8]
    );
    assert!(values("solver.relative_tolerance").is_empty());
    has(&said, &["k_l in N/m²"]);
    directory.refused("simulate case.toml --converge --out small --memory 1");
    directory.has_no("small/converge.csv");
}

#[test]
fn a_force_keeps_its_depth() {
    let force = FILE.replace("penetration_depth_m = 1e-3", "tool_force_n = 100.0");
    let directory = Workspace::with(&format!("{force}[uncertainty]\ndiameter_std_m = 0.03e-3\n"));
    let [_, said] = directory.run("simulate case.toml --converge --out out --no-figures");
    let depth = "the depth that reaches 100 N as stated, ";
    has(&words(&said), &[depth]);
    let segments = forces(&directory.rows("out/converge.csv"), "filament.segments");
    is_near(segments[2][1], 100.0, 2e-3);
    assert_ne!(segments[0][1], segments[2][1]);
}

#[test]
fn what_cannot_be_compared_is_an_error() {
    let far =
        format!("{FILE}[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-4\noffset_m = -0.2\n");
    let directory = Workspace::with(&far);
    let fails = |options: &str, status: i32, part: &str| {
        let call = format!("simulate case.toml --converge --out out {options}");
        has(&words(&directory.failed(&call, status)), &[part]);
        assert!(directory.names("out").is_empty());
    };
    let untouched = "case.toml: the filaments do not touch the workpiece: F_n,w is 0";
    fails("", 2, untouched);
    directory.write("case.toml", FILE);
    let unsolved = "the case that the file states cannot be simulated: ";
    fails("--set contact.stiffness_n_m=1e300", 3, unsolved);
}
