//! Edges that grow round, and filaments that wear.

use std::f64::consts::TAU;

use crate::program::{Workspace, has, number, words};

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
    let said = directory.printed("remove case.toml --out grown --threads 1");
    assert!(
        said.starts_with("edge of 90°: R = 0.200 mm after ") && said.lines().count() <= 10,
        "{said}"
    );
    let [turns, radii, areas, works] = [
        "turns",
        "edge_radius_m",
        "removed_area_m2",
        "edge_sliding_work_j",
    ]
    .map(|key| directory.column("grown/removal.csv", key));
    assert!(radii[0] == 0.1e-3 && (radii[200] / 0.2e-3 - 1.0).abs() < 1e-9 && turns[0] == 0.0);
    assert!(
        radii
            .windows(2)
            .chain(turns.windows(2))
            .all(|pair| pair[0] < pair[1])
    );
    // The area of a right angle, and the work by which it was removed: k_P N_f/b times the mean of
    // W_e over the turns.
    let factor = 1.0 - std::f64::consts::PI / 4.0;
    assert!((areas[200] / (factor * (4.0 - 1.0) * 1e-8) - 1.0).abs() < 1e-9);
    let dose: f64 = (0..200)
        .map(|i| (turns[i + 1] - turns[i]) * (works[i + 1] + works[i]) / 2.0)
        .sum();
    let removed = 2e-14 * 10_500.0 / 0.020 * dose;
    assert!(
        (removed / areas[200] - 1.0).abs() < 2e-3,
        "{removed} {}",
        areas[200]
    );
    for file in [
        "edge_work.csv",
        "removal.html",
        "figures/edge_radius.svg",
        "figures/edge_shape.png",
        "figures/edge_work.svg",
    ] {
        assert!(directory.path(&format!("grown/{file}")).is_file(), "{file}");
    }
    // What was simulated is what `simulate` says, and any number of threads gives the same.
    directory.run("simulate case.toml --out one --no-figures");
    let one = |key: &str| directory.number("one/metrics.json", key);
    let first = &directory.rows("grown/edge_work.csv")[0];
    for key in [
        "edge_sliding_work_j",
        "sliding_work_j",
        "tool_contact_normal_force_n",
    ] {
        let (there, here) = (number(first, key), one(key));
        assert!((there / here - 1.0).abs() < 1e-6, "{key}: {there} {here}");
    }
    let expected = 2e-14 * one("sliding_work_j") * 10_500.0 * 10.0 / 0.18 / TAU;
    assert!((one("removal_rate_m3_s") / expected - 1.0).abs() < 1e-12);
    assert!(
        directory
            .json("one/metrics.json")
            .get("wear_ratio")
            .is_none()
    );
    directory.run("remove case.toml --out again --threads 3");
    assert_eq!(
        directory.read("grown/removal.csv"),
        directory.read("again/removal.csv")
    );
}

#[test]
fn one_trial_takes_the_place_of_the_coefficient() {
    let directory = Workspace::with(FILE);
    directory.run("remove case.toml --out grown --no-figures");
    let rows = directory.rows("grown/removal.csv");
    let (time, radius) = (&rows[150]["time_s"], &rows[150]["edge_radius_m"]);
    let observed = format!("observed = {{ edge_radius_m = {radius}, time_s = {time} }}");
    directory.write(
        "trial.toml",
        FILE.replace("preston_m2_n = 2e-14", &observed),
    );
    let said = directory.printed("remove trial.toml --out trial --no-figures");
    assert!(
        said.contains("k_P = 2.00e-14 m²/N, from the edge that was observed"),
        "{said}"
    );
    let times = directory.column("trial/removal.csv", "time_s");
    let expected = directory.column("grown/removal.csv", "time_s");
    assert!(
        (times[200] / expected[200] - 1.0).abs() < 2e-3,
        "{} {}",
        times[200],
        expected[200]
    );
}

#[test]
fn worn_filaments_press_less_unless_the_tool_follows() {
    let directory = Workspace::with(&(FILE.to_owned() + "filament_wear_m2_n = 1e-11\n"));
    let said = words(&directory.printed("remove case.toml --out worn --no-figures"));
    has(&said, &["filaments lose ", "wear ratio 0.00200"]);
    let [forces, lengths] = ["tool_contact_normal_force_n", "filament_length_m"]
        .map(|key| directory.column("worn/removal.csv", key));
    assert!(
        lengths.windows(2).all(|pair| pair[0] > pair[1]) && lengths[200] < 0.0399,
        "{}",
        lengths[200]
    );
    assert!(forces[200] < forces[0]);
    let said =
        directory.printed("remove case.toml --out held --no-figures --set removal.compensate=true");
    assert!(said.contains("filaments lose "), "{said}");
    let held = directory.column("held/removal.csv", "tool_contact_normal_force_n");
    assert!((held[200] / held[0] - 1.0).abs() < (forces[200] / forces[0] - 1.0).abs());
}

#[test]
fn both_directions_and_both_edges_of_a_chamfer() {
    let directory = Workspace::with(FILE);
    // The works on the first edge, and on the second where there is one.
    let works = |options: &str, keys: &[&str]| -> Vec<f64> {
        let short = "--no-figures --set removal.until={turns=10}";
        directory.run(&format!("remove case.toml --out one {short} {options}"));
        keys.iter()
            .map(|key| directory.column("one/edge_work.csv", key)[0])
            .collect()
    };
    let leaving = "--set workpiece.side=leaving --set workpiece.offset_m=5e-3";
    let [entering, leaving, both] = ["", leaving, "--set removal.alternate=true"]
        .map(|options| works(options, &["edge_sliding_work_j"])[0]);
    assert!(
        (both / ((entering + leaving) / 2.0) - 1.0).abs() < 1e-9,
        "{both} {entering} {leaving}"
    );
    let chamfer = "--set workpiece.kind=chamfer --set workpiece.chamfer_width_m=1e-3";
    let edges = works(
        chamfer,
        &["edge_sliding_work_j", "second_edge_sliding_work_j"],
    );
    let (first, second) = (edges[0], edges[1]);
    directory.run(&format!(
        "simulate case.toml --out one --no-figures {chamfer}"
    ));
    let whole = directory.number("one/metrics.json", "edge_sliding_work_j");
    assert!(
        first > 0.0 && second > 0.0 && ((first + second) / whole - 1.0).abs() < 1e-6,
        "{first} {second} {whole}"
    );
}

#[test]
fn advice_ranks_by_removal() {
    let study = "filament_wear_m2_n = 1e-14\n[study]\nbrushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]\n";
    let file = FILE.replace("edge_radius_m = 0.1e-3", "edge_radius_m = 0.5e-3");
    let directory = Workspace::with(&(file.clone() + study));
    directory.run("study case.toml --out results --no-figures");
    let advice = words(&directory.printed("advise results"));
    let rows = directory.rows("results/runs.csv");
    let most = directory
        .column("results/runs.csv", "removal_rate_m3_s")
        .into_iter()
        .fold(0.0, f64::max);
    assert!(
        advice.contains(&format!(
            "Removes {:.3} mm³/min, the most of 4 cases",
            60e9 * most
        )),
        "{advice}"
    );
    has(
        &advice,
        &[
            " mm³/min on the edge, the most of 4 cases",
            "W per W of the drive",
        ],
    );
    assert!(
        advice.contains("The wear ratio is 2.00 in every case"),
        "{advice}"
    );
    assert!(
        rows.iter()
            .all(|row| row["wear_ratio"] == "2.0" && !row.contains_key("recession_per_pass_m"))
    );
    // Without the section nothing is said of it.
    directory.write(
        "case.toml",
        file.split_once("[removal]")
            .expect("the section")
            .0
            .to_owned()
            + &study[study.find("[study]").expect("it")..],
    );
    directory.run("study case.toml --out without --no-figures");
    assert!(!words(&directory.printed("advise without")).contains("Removes"));
}

#[test]
fn what_cannot_be_followed_says_why() {
    let directory = Workspace::with(FILE);
    let start = FILE.find("[workpiece]").expect("the section");
    let workpiece = &FILE[start..FILE.find("[solver]").expect("the next one")];
    let cases = [
        (
            "preston_m2_n = 2e-14\n",
            "",
            "state `removal.preston_m2_n`, or what one trial showed",
        ),
        (
            "until = { edge_radius_m = 0.2e-3 }\n",
            "",
            "state when to end",
        ),
        (
            "0.2e-3 }",
            "0.05e-3 }",
            "but the edge has a radius of 1e-4 m at the start",
        ),
        (workpiece, "", "has no edge that grows round"),
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
        (
            "until = { edge_radius_m = 0.2e-3 }",
            "until = { edge_radius_m = 0.2 }",
            "is never reached",
        ),
    ];
    for (old, new, expected) in cases {
        directory.write("wrong.toml", FILE.replacen(old, new, 1));
        let output = directory
            .bristle("remove wrong.toml --out nothing")
            .output()
            .expect("it runs");
        let message = String::from_utf8_lossy(&output.stderr).replace("\n         ", " ");
        assert!(
            output.status.code() == Some(2) && message.contains(expected),
            "{new}: {message}"
        );
        assert!(!directory.path("nothing/removal.csv").exists());
    }
}

#[test]
fn worn_filaments_may_never_reach_the_goal() {
    let directory = Workspace::with(FILE);
    let slow = "--set removal.preston_m2_n=1e-16 --set removal.filament_wear_m2_n=1e-10";
    let said = words(&directory.refused(&format!("remove case.toml --out out {slow}")));
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
        "remove case.toml --out small --no-figures {small} --set removal.filament_wear_m2_n=1e-11"
    ));
    assert!(said.contains("filaments lose 0.2"), "{said}");
}

/// Radii of the edge as it grows, by `bristle remove`, in a table of a laboratory.
fn measured(directory: &Workspace) -> String {
    directory.run("remove case.toml --out grown --no-figures");
    let rows = directory.rows("grown/removal.csv");
    let cell = |row: usize| {
        let [time, radius] = ["time_s", "edge_radius_m"].map(|key| number(&rows[row], key));
        format!("{};{};2\n", time / 60.0, 1e6 * radius).replace('.', ",")
    };
    format!(
        "t [min];R [µm];s [µm]\n{}",
        [60, 100, 140, 180, 200].map(cell).concat()
    )
}

const OF_RADII: &str = "[measured]
file = \"radii.csv\"
columns = { time_s = \"t [min]\", edge_radius_m = \"R [µm]\", edge_radius_std_m = \"s [µm]\" }
";

#[test]
fn radii_over_time_give_the_coefficient_with_its_error() {
    let directory = Workspace::with(FILE);
    directory.write("radii.csv", measured(&directory));
    directory.write(
        "trial.toml",
        FILE.replace("preston_m2_n = 2e-14\n", "") + OF_RADII,
    );
    let said =
        words(&directory.printed("calibrate trial.toml --fit removal.preston_m2_n --out found"));
    assert!(
        said.starts_with("k_P = (2.00 ± 0.0") && said.contains("5 radii within 0.0 σ"),
        "{said}"
    );
    assert!(
        said.contains("the square root of time fits the radii: R² = R_0² + c² t with c = "),
        "{said}"
    );
    for file in [
        "calibration.html",
        "residuals.csv",
        "figures/calibration_radius.svg",
    ] {
        assert!(directory.path(&format!("found/{file}")).is_file(), "{file}");
    }
    let found = directory.json("found/calibration.json");
    assert!(
        found["square_root"]["fits"].as_bool() == Some(true)
            && found["next_measurement"][0].is_null()
    );
    let [times, fitted, roots] =
        ["time_s", "fitted", "square_root"].map(|key| directory.column("found/residuals.csv", key));
    assert!(
        times.len() == 5 && (fitted[4] / roots[4] - 1.0).abs() < 0.02,
        "{fitted:?} {roots:?}"
    );
    // The file that it writes is one for the other commands, and the same brush takes as long.
    let text = directory.read("found/calibrated.toml");
    assert!(
        text.contains("# k_P = (2.00 ± 0.0") && !text.contains("measured"),
        "{text}"
    );
    directory.run("remove found/calibrated.toml --out again --no-figures");
    let [first, again] = ["grown", "again"]
        .map(|out| directory.column(&format!("{out}/removal.csv"), "time_s")[200]);
    assert!((again / first - 1.0).abs() < 2e-3, "{again} {first}");
}

#[test]
fn radii_that_tell_nothing_are_refused() {
    let directory = Workspace::with(FILE);
    directory.write("radii.csv", "t [min];R [µm];s [µm]\n1;120;2\n2;150;2\n");
    let trial = FILE.replace("preston_m2_n = 2e-14\n", "") + OF_RADII;
    directory.write("trial.toml", &trial);
    let (preston, friction) = (
        "--fit removal.preston_m2_n",
        "--fit contact.friction_coefficient",
    );
    for (fit, more, parts) in [
        (
            preston,
            friction,
            &["do not tell `contact.friction_coefficient`"][..],
        ),
        (
            preston,
            "--set removal.observed={edge_radius_m=0.2e-3,time_s=60}",
            &["make it a row of the measured table"],
        ),
        (
            preston,
            "--set workpiece.edge_radius_m=0.2e-3",
            &["is below that at the start, 2e-4 m"],
        ),
        (friction, "", &["radii of an edge, not forces"]),
        (
            preston,
            "--set workpiece.offset_m=-50e-3",
            &["is never reached", "no work on it"],
        ),
    ] {
        has(
            &words(&directory.refused(&format!("calibrate trial.toml --out out {fit} {more}"))),
            parts,
        );
    }
}
