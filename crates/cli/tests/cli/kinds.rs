//! Tools of any kind and pose, and forces in place of depths: in files, studies, tables, warnings
//! and advice.

use crate::program::{Workspace, brush, has, is_near, lacks, page_data, words};

/// Returns a cup with too few filaments to touch each other, with further lines of `[process]`.
fn cup(process: &str) -> String {
    format!(
        "[tool]\nkind = \"cup\"\nbody_radius_m = 0.030\nwidth_m = 0.010\nfilament_count = 300\npositions = 1\n\
         [filament]\nsegments = 5\nlength_m = 0.025\ndiameter_m = 0.5e-3\n[contact]\nfriction_coefficient = 0.3\n\
         [solver]\nrelative_tolerance = 1e-4\n[process]\nrotational_speed_rpm = 1000\n{process}\n"
    )
}

/// The paper's brush with few segments, without a depth.
const ROUND: &str = concat!(
    brush!("4"),
    "[solver]\nrelative_tolerance = 1e-4\n[process]\nbrushing_velocity_m_s = 10.0\n"
);

#[test]
fn a_cup_is_pressed_on_with_a_force() {
    let workspace = Workspace::with(&cup("tool_force_n = 6.0"));
    let [printed, said] = workspace.run("simulate case.toml --out one --no-figures --strict");
    lacks(&said, &["warning"]);
    let number = |key: &str| workspace.number("one/metrics.json", key);
    let force = number("tool_contact_normal_force_n");
    is_near(force, 6.0, 1.1e-3);
    let (depth, stiffness) = (number("penetration_depth_m"), number("force_stiffness_n_m"));
    assert!((0.8e-3..1.6e-3).contains(&depth) && stiffness > 0.0);
    has(
        &words(&printed),
        &[&format!("a_e in mm {:.3} ", 1e3 * depth)],
    );
    // Steady turns are the default, and filaments that touch all round have no force along x.
    assert!(number("turns") >= 2.0);
    lacks(&printed, &["F_t,w"]);
    // The tool presses with the stated force at the depth that was found.
    workspace.write(
        "depth.toml",
        cup(&format!("penetration_depth_m = {depth:?}")),
    );
    workspace.run("simulate depth.toml --out depth --no-figures");
    let again = |key: &str| workspace.number("depth/metrics.json", key);
    assert_eq!(again("tool_contact_normal_force_n"), force);
    assert_eq!(again("force_stiffness_n_m"), 0.0);
}

#[test]
fn a_study_by_force_shows_the_depths_that_it_finds() {
    let workspace = Workspace::with(
        &(ROUND.to_owned()
            + "tool_force_n = 200.0\n[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"),
    );
    let [printed, said] = workspace.run("study case.toml --out results --figures all,svg");
    let numbers = |key: &str| workspace.column("results/runs.csv", key);
    for force in numbers("tool_contact_normal_force_n") {
        is_near(force, 200.0, 1.1e-3);
    }
    assert_eq!(numbers("process.tool_force_n"), [200.0, 200.0]);
    let depths = numbers("penetration_depth_m");
    assert!(depths.iter().all(|depth| (1e-4..5e-3).contains(depth)));
    has(&printed, &["v_b    a_e", "a_e: penetration depth;"]);
    // Assumptions are changed at the depth that was found.
    lacks(&printed, &["a_e = 0 mm"]);
    has(&words(&printed), &["m/s, a_e = "]);
    lacks(&words(&said), &["penetration_depth_m` is 0"]);

    // The force is stated by the file; the depth is the result.
    let names = workspace.names("results/figures").join("\n");
    has(&names, &["penetration_depth_over_velocity.svg"]);
    lacks(&names, &["\ntool_force_"]);
    let data = page_data(&workspace.read("results/report.html"));
    assert_eq!(data["quantities"][0]["key"], "penetration_depth_m");
    lacks(&data["headline"].to_string(), &["a_e = 0"]);
    // The course belongs to the depth that was found.
    let impulse = data["courses"][0][1]["turn_impulses"][0].as_f64();
    let impulses = numbers("contact_normal_impulse_n_s");
    is_near(impulse.expect("an impulse"), impulses[0], 1e-3);

    let advice = workspace.printed("advise results");
    has(&advice, &["Least power for each force"]);
    lacks(&advice, &["Highest"]);
    let advice = workspace.printed("advise results --target-force 200 --no-verify");
    let depth = format!("{:.3}", 1e3 * depths[0]);
    let nothing = "Nothing is interpolated, as";
    has(&words(&advice), &[depth.trim_end_matches('0'), nothing]);
}

#[test]
fn a_force_out_of_reach_is_refused() {
    let workspace = Workspace::with(&(ROUND.to_owned() + "tool_force_n = 1e6\n"));
    let failed = workspace.failed("simulate case.toml --out one", 3);
    has(
        &failed,
        &[
            "no depth up to 20.000 mm reaches process.tool_force_n = 1000000 N: the largest force is",
        ],
    );
    assert!(workspace.names("one").is_empty(), "nothing is written");
}

#[test]
fn a_first_file_of_a_cup_runs_and_says_why_it_has_no_brush() {
    let directory = Workspace::new();
    let sizes = "--tool-diameter-mm 70 --width-mm 10 --length-mm 25 --diameter-mm 0.5 --max-rpm 3000 --max-depth-mm 1";
    let said = directory.said(&format!(
        "new cup.toml --kind cup --filaments 1500 --friction 0.3 {sizes}"
    ));
    let alone = "Those of axial and conical trims are simulated alone all the same";
    has(&words(&said), &[alone]);
    let quick = "--strict --no-figures --set filament.segments=4 --set tool.positions=1";
    directory.run(&format!("simulate cup.toml --out one {quick}"));
    let cone = format!("new cone.toml --kind cone --filaments 300 {sizes}");
    directory.refuses(&cone, &["--filament-angle-deg"]);
    let said = directory.said(&format!("{cone} --filament-angle-deg 30"));
    lacks(&said, &["note:"]);
    let angle = "filament_angle_deg = 30.0";
    has(&directory.read("cone.toml"), &[angle]);
    directory.run(&format!("simulate cone.toml --out two {quick}"));
}

#[test]
fn a_first_file_of_a_tube_needs_no_depth() {
    let directory = Workspace::new();
    let sizes = "--tool-diameter-mm 32 --width-mm 30 --length-mm 12 --diameter-mm 0.2 --max-rpm 3000 --filaments 9000";
    let said = directory.said(&format!(
        "new tube.toml --bore-diameter-mm 29 --friction 0 {sizes}"
    ));
    has(
        &words(&said),
        &["Those in a bore narrower than the brush are simulated alone"],
    );
    let quick = "--no-figures --set filament.segments=4";
    let said = directory.told(&format!("simulate tube.toml --out one {quick}"));
    has(
        &said,
        &["B014", "under [contact]: friction_coefficient = 0.3"],
    );
    let ratio = directory.number("one/metrics.json", "contact_time_ratio");
    is_near(ratio, 1.0, 1e-12);
    directory.refuses(
        &format!("new wide.toml --bore-diameter-mm 40 {sizes}"),
        &["--max-depth-mm"],
    );
}

#[test]
fn the_filaments_along_a_trim_are_in_a_file() {
    let upright = ROUND.to_owned() + "penetration_depth_m = 1e-3\n";
    let tilted = upright.replacen("[tool]\n", "[tool]\ntilt_rad = 0.02\npositions = 3\n", 1);
    let directory = Workspace::with(&tilted);
    let said = directory.told("simulate case.toml --out one --figures svg");
    has(&said, &["positions.csv"]);
    let positions = directory.column("one/positions.csv", "position_m");
    assert_eq!(positions, [positions[0], 0.0, -positions[0]]);
    assert!(directory.json("one/case.json")["sha256"]["positions.csv"].is_string());

    // Both views, the trim, and the heights.
    let drawn = directory.read("one/figures/profile_drawn.svg");
    has(
        &drawn,
        &["along the axis", "from the side", "undeformed trim"],
    );
    let history = directory.read("one/figures/history.svg");
    has(
        &history,
        &["tip in mm", "root in mm", "tip and root: their heights"],
    );
    directory.run("report one --out again --figures svg");
    let [one, again] = ["one", "again"].map(|out| directory.files(&format!("{out}/figures")));
    assert!(one == again, "figures differ");

    // A tool with equal filaments has none, nor these views.
    directory.write("case.toml", &upright);
    directory.run("simulate case.toml --out one --figures svg");
    directory.has_no("one/positions.csv");
    lacks(&directory.read("one/figures/history.svg"), &["root in mm"]);
}
