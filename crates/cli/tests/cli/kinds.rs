//! Tools of any kind and pose, and forces in place of depths: in files, studies, tables, warnings
//! and advice.

use bristle::model::settings::ToolKind;
use bristle_input::document::Document;
use predicates::str::contains;

use crate::program::{Workspace, brush, has, settings, study, words};

/// A cup of so few filaments that they do not touch each other, with further lines of `[process]`.
fn cup(process: &str) -> String {
    format!(
        "[tool]\nkind = \"cup\"\nbody_radius_m = 0.030\nwidth_m = 0.010\nfilament_count = 300\npositions = 1\n\
         [filament]\nsegments = 5\nlength_m = 0.025\ndiameter_m = 0.5e-3\n[contact]\nfriction_coefficient = 0.3\n\
         [solver]\nrelative_tolerance = 1e-4\n[process]\nrotational_speed_rpm = 1000\n{process}\n"
    )
}

/// The paper's brush of few segments, without a depth.
const ROUND: &str = concat!(
    brush!("4"),
    "[solver]\nrelative_tolerance = 1e-4\n[process]\nbrushing_velocity_m_s = 10.0\n"
);

#[test]
fn kinds_and_angles_are_stated_swept_and_named_in_any_unit() {
    let stated =
        settings(&cup("penetration_depth_mm = 0.5").replace("positions = 1", "tilt_deg = 80"));
    assert_eq!(
        (stated.tool.kind, stated.tool.tilt_rad),
        (ToolKind::Cup, Some(80_f64.to_radians()))
    );
    let swept = study(
        &(cup("")
            + "[study]\n\"tool.tilt_deg\" = [80, 90]\n\"process.tool_force_kn\" = [0.002, 0.004]\n"),
    );
    assert_eq!(swept.case_count(), 4);
    let last = swept.settings(3);
    let found = [swept.settings(0), swept.settings(2), last.clone()]
        .map(|each| (each.tool.tilt_rad, each.process.tool_force_n));
    assert!(
        found.contains(&(Some(std::f64::consts::FRAC_PI_2), Some(4.0))),
        "{found:?}"
    );
    assert!(swept.is_pressed_on() && last.process.penetration_depth_m == 0.0);
    let named = study(
        &(cup("penetration_depth_m = 5e-4")
            + "[study]\n[study.tools.cup]\n[study.tools.round]\ntool.kind = \"round\"\n"),
    );
    assert_eq!(
        [0, 1].map(|case| named.settings(case).tool.kind),
        [ToolKind::Cup, ToolKind::Round]
    );
    let option = [
        "tool.kind=\"cone\"".to_owned(),
        "tool.filament_angle_deg=30".to_owned(),
    ];
    let text = cup("penetration_depth_m = 5e-4");
    let cone = Document::parse_with(&text, "case.toml", &option)
        .and_then(|document| document.settings())
        .expect("a cone");
    assert!((cone.tool.tilt_rad() - 60_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn a_cup_is_pressed_on_with_a_force() {
    let workspace = Workspace::with(&cup("tool_force_n = 6.0"));
    let [printed, said] = workspace.run("simulate case.toml --out one --no-figures --strict");
    assert!(!said.contains("warning"), "{said}");
    let number = |key: &str| workspace.number("one/metrics.json", key);
    let force = number("tool_contact_normal_force_n");
    assert!((force / 6.0 - 1.0).abs() < 1.1e-3);
    let (depth, stiffness) = (number("penetration_depth_m"), number("force_stiffness_n_m"));
    assert!(
        (0.8e-3..1.6e-3).contains(&depth) && stiffness > 0.0,
        "{depth} {stiffness}"
    );
    assert!(
        words(&printed).contains(&format!("a_e in mm {:.3} ", 1e3 * depth)),
        "{printed}"
    );
    // Its steady turns are the default, and filaments that touch all round have no force along x.
    assert!(
        number("turns") >= 2.0 && !printed.contains("F_t,w"),
        "{printed}"
    );
    // What is found is what it presses with at that depth.
    workspace.write(
        "depth.toml",
        cup(&format!("penetration_depth_m = {depth:?}")),
    );
    workspace.run("simulate depth.toml --out depth --no-figures");
    let again = |key: &str| workspace.number("depth/metrics.json", key);
    assert_eq!(
        (
            again("tool_contact_normal_force_n"),
            again("force_stiffness_n_m")
        ),
        (force, 0.0)
    );
}

#[test]
fn a_study_by_force_shows_the_depths_that_it_finds() {
    let workspace = Workspace::with(
        &(ROUND.to_owned()
            + "tool_force_n = 200.0\n[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"),
    );
    let [printed, said] = workspace.run("study case.toml --out results --no-figures");
    let numbers = |key: &str| workspace.column("results/runs.csv", key);
    assert!(
        numbers("tool_contact_normal_force_n")
            .iter()
            .all(|force| (force / 200.0 - 1.0).abs() < 1.1e-3)
    );
    assert_eq!(numbers("process.tool_force_n"), [200.0, 200.0]);
    let depths = numbers("penetration_depth_m");
    assert!(
        depths.iter().all(|depth| (1e-4..5e-3).contains(depth)),
        "{depths:?}"
    );
    has(&printed, &["v_b    a_e", "a_e: penetration depth;"]);
    // Assumptions are changed at the depth that was found.
    assert!(
        !printed.contains("a_e = 0 mm") && words(&printed).contains("m/s, a_e = "),
        "{printed}"
    );
    assert!(
        !words(&said).contains("penetration_depth_m` is 0"),
        "{said}"
    );

    let advice = workspace.printed("advise results");
    assert!(
        advice.contains("Least power for each force") && !advice.contains("Highest"),
        "{advice}"
    );
    let advice = workspace.printed("advise results --target-force 200 --no-verify");
    let depth = |row: usize| format!("{:.3}", 1e3 * depths[row]);
    has(
        &words(&advice),
        &[
            depth(0).trim_end_matches('0'),
            "Nothing is interpolated, as",
        ],
    );
}

#[test]
fn forces_out_of_reach_are_refused_and_small_depths_are_told() {
    let workspace = Workspace::with(&(ROUND.to_owned() + "tool_force_n = 1e6\n"));
    let failed = contains(
        "no depth up to 20.000 mm reaches process.tool_force_n = 1000000 N: the largest force is",
    );
    workspace
        .bristle("simulate case.toml --out one")
        .assert()
        .code(3)
        .stderr(failed);
    workspace.write(
        "case.toml",
        ROUND.to_owned() + "tool_force_n = 20.0\n[study]\n\"process.tool_force_n\" = [20.0, 1e6]\n",
    );
    let said = words(&workspace.said("simulate case.toml --out one --no-figures"));
    has(
        &said,
        &[
            "presses with this force at a depth of 0.0",
            "roundness of a brush",
        ],
    );
    let output = workspace
        .bristle("study case.toml --out results --no-figures")
        .assert()
        .code(3)
        .get_output()
        .clone();
    let said = words(&String::from_utf8(output.stderr).expect("UTF-8"));
    has(
        &said,
        &[
            "row 2: no depth up to 20.000 mm reaches",
            "in 1 of 2 cases, first in row 1",
        ],
    );
}

#[test]
fn trims_that_are_lifted_or_splayed_clear_are_told() {
    let workspace = Workspace::with(&cup("penetration_depth_m = 2e-6"));
    let said =
        words(&workspace.said(
            "simulate case.toml --out one --no-figures --set process.rotational_speed_rpm=6000",
        ));
    assert!(
        said.contains("the turning tool never touches the workpiece. Centrifugal forces splay"),
        "{said}"
    );
    let tilted =
        "--set tool.positions=5 --set tool.tilt_deg=60 --set process.penetration_depth_mm=0.1";
    let refused =
        words(&workspace.refused(&format!("simulate case.toml --out one --strict {tilted}")));
    has(
        &refused,
        &["`tool.tilt_rad` is 1.047 rad; usually it is such that more of the trim reaches"],
    );
}

#[test]
fn a_first_file_of_a_cup_runs_and_says_why_it_has_no_brush() {
    let directory = Workspace::new();
    let sizes = "--tool-diameter-mm 70 --width-mm 10 --length-mm 25 --diameter-mm 0.5 --max-rpm 3000 --max-depth-mm 1";
    let said = directory.said(&format!(
        "new cup.toml --kind cup --filaments 1500 --friction 0.3 {sizes}"
    ));
    assert!(
        words(&said).contains("Those of axial and conical trims are simulated alone all the same"),
        "{said}"
    );
    let quick = "--strict --no-figures --set filament.segments=4 --set tool.positions=1";
    directory.run(&format!("simulate cup.toml --out one {quick}"));
    directory.refuses(
        &format!("new cone.toml --kind cone --filaments 300 {sizes}"),
        &["--filament-angle-deg"],
    );
    let said = directory.said(&format!(
        "new cone.toml --kind cone --filament-angle-deg 30 --filaments 300 {sizes}"
    ));
    assert!(
        !said.contains("note:")
            && directory
                .read("cone.toml")
                .contains("filament_angle_deg = 30.0"),
        "{said}"
    );
    directory.run(&format!("simulate cone.toml --out two {quick}"));
}
