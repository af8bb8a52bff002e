//! The contract of the command line: files, exit statuses and messages.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command as Process;

use bristle::model::settings::Settings;
use bristle::simulation::Statistics;
use bristle_grid::brush::{Having, metric_columns};
use bristle_store::results::keys;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::{Value, json};

use crate::program::{Workspace, brush, has, number, place, settings, study};

/// A small and quick case.
pub const FILE: &str = concat!(
    brush!(4, "filament_count_uncertainty = 600\n"),
    "
[contact]

[workpiece]

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[solver]
relative_tolerance = 1e-4

[study]
brushing_velocity_m_s = [10.0, 20.0]
penetration_depth_m = { start = 0.5e-3, stop = 1.5e-3, step = 0.5e-3 }
"
);

/// A state of two segments.
const STATE: &str = r#"{"base_angle": -1.5, "base_rate": 50.0, "base_acceleration": 0.0, "gravity": [0, 0, 0],
 "q": [1.5, -1.5, 1.6, -1.4], "v": [0.1, 50.0, 0.2, 51.0]}"#;

/// Columns of `runs.csv` between the settings and the status; also the keys of `metrics.json`.
fn results() -> Vec<&'static str> {
    // Without coefficients nothing is known of removal.
    let metrics = metric_columns(Having {
        force: true,
        edge: true,
        ..Having::default()
    });
    metrics
        .map(|column| column.key)
        .chain(keys::<Statistics>())
        .collect()
}

/// Those of a study of a plane, whose depths are given.
fn results_at_depths() -> impl Iterator<Item = &'static str> {
    let absent = |key: &str| {
        key.contains("edge_") || ["penetration_depth_m", "force_stiffness_n_m"].contains(&key)
    };
    results().into_iter().filter(move |key| !absent(key))
}

#[test]
fn simulate_writes_metrics_and_history() {
    let workspace = Workspace::with(FILE);
    workspace
        .bristle("simulate case.toml --out one --samples 11")
        .assert()
        .success()
        .stdout(contains("F_n,w"));

    let text = workspace.read("one/metrics.json");
    let metrics = workspace.json("one/metrics.json");
    let metrics = metrics.as_object().expect("an object");
    // The two speeds come first.
    assert_eq!(metrics.len(), results().len() + 3);
    assert_eq!(
        metrics["turn_contact_normal_impulses_n_s"],
        json!([metrics["contact_normal_impulse_n_s"]])
    );
    let mut last = 0;
    for key in results() {
        let is_flag = key == "laterally_unstable" || key == "unsteady_turns";
        assert!(
            if is_flag {
                metrics[key].is_boolean()
            } else {
                metrics[key].is_number()
            },
            "{key}"
        );
        let position = text.find(&format!("\"{key}\"")).expect(key);
        assert!(position > last, "{key} is out of order");
        last = position;
    }
    let ratio = metrics["contact_time_ratio"].as_f64().expect("a number");
    assert!((0.0..=1.0).contains(&ratio));

    let heading = "time_s,base_angle_rad,contact_normal_force_n,contact_tangential_force_n,tip_deflection_m,\
                   tip_x_m,tip_y_m,tip_z_m,kinetic_energy_j,potential_energy_j,dissipated_energy_j,\
                   contact_normal_impulse_n_s,peak_contact_normal_force_n";
    assert_eq!(
        workspace.read("one/history.csv").lines().next(),
        Some(heading)
    );
    let rows = workspace.rows("one/history.csv");
    assert_eq!(rows.len(), 11);
    assert!(
        rows.iter()
            .flat_map(|row| row.values())
            .all(|cell| cell.parse::<f64>().is_ok_and(f64::is_finite))
    );

    // The number of samples changes no metric.
    for samples in ["2", "500"] {
        workspace.run(&format!(
            "simulate case.toml --out {samples} --samples {samples}"
        ));
        assert_eq!(workspace.read(&format!("{samples}/metrics.json")), text);
    }
}

#[test]
fn study_writes_one_row_per_case_in_grid_order() {
    let workspace = Workspace::with(FILE);
    workspace
        .bristle("study case.toml --out results")
        .assert()
        .success()
        .stdout(
            contains("ε_tc")
                .and(contains("p_n in"))
                .and(contains("F_n,w in"))
                .and(contains("wrote").not()),
        )
        .stderr(
            contains("6 cases in")
                .and(contains("runs.csv"))
                .and(contains("p_n in").not()),
        );

    let runs = workspace.read("results/runs.csv");
    let settings = [
        "brushing_velocity_m_s",
        "penetration_depth_m",
        "segments",
        "rotational_speed_rpm",
    ];
    let columns: Vec<&str> = settings
        .into_iter()
        .chain(results_at_depths())
        .chain(["status"])
        .collect();
    assert_eq!(runs.lines().next(), Some(&*columns.join(",")));
    let cases = runs
        .lines()
        .skip(1)
        .map(|row| row.split(',').take(3).collect::<Vec<_>>().join(","));
    let expected = [
        "10.0,0.0005",
        "20.0,0.0005",
        "10.0,0.001",
        "20.0,0.001",
        "10.0,0.0015",
        "20.0,0.0015",
    ];
    assert!(
        cases.eq(expected.map(|case| format!("{case},4"))) && runs.matches(",ok\n").count() == 6,
        "{runs}"
    );
    // formats.rs tests the tables as Parquet.
    let files = workspace
        .names("results")
        .into_iter()
        .filter(|name| name != "runs.parquet");
    let expected = [
        "figures",
        "journal.jsonl",
        "report.html",
        "runs.csv",
        "study.json",
    ];
    assert!(files.eq(expected), "{:?}", workspace.names("results"));
}

#[test]
fn one_case_is_one_case() {
    let workspace = Workspace::with(FILE);
    let one = "--set study.brushing_velocity_m_s=[10.0] --set study.penetration_depth_m=[1e-3]";
    let command = format!("study case.toml --out results --no-figures {one}");
    workspace
        .bristle(&command)
        .assert()
        .success()
        .stderr(contains("one case in "));
}

#[test]
fn any_setting_can_be_swept_and_may_be_missing_elsewhere() {
    let workspace = Workspace::new();
    let file = FILE
        .replace("brushing_velocity_m_s = 10.0\n", "")
        .replace("penetration_depth_m = 1.0e-3\n", "")
        + "\"filament.segments\" = { start = 3, stop = 5, step = 2 }\n\"contact.friction_coefficient\" = [0.1]\n";
    workspace.write("case.toml", file);
    workspace
        .bristle("study case.toml --out results")
        .assert()
        .success()
        .stdout(contains("segments").and(contains("µ")));
    let runs = workspace.read("results/runs.csv");
    let columns: Vec<&str> = runs
        .lines()
        .next()
        .expect("a heading")
        .split(',')
        .skip(2)
        .take(3)
        .collect();
    assert_eq!(
        columns,
        [
            "segments",
            "rotational_speed_rpm",
            "contact.friction_coefficient"
        ]
    );
    let rows = workspace.rows("results/runs.csv");
    let segments: Vec<&str> = rows.iter().map(|row| row["segments"].as_str()).collect();
    assert_eq!(
        segments,
        ["3", "3", "3", "3", "3", "3", "5", "5", "5", "5", "5", "5"]
    );
    assert!(
        rows.iter()
            .all(|row| row["contact.friction_coefficient"] == "0.1")
    );
}

#[test]
fn the_number_of_threads_does_not_change_a_byte() {
    let workspace = Workspace::with(FILE);
    for threads in ["1", "3"] {
        workspace.run(&format!(
            "study case.toml --out {threads} --threads {threads}"
        ));
    }
    assert_eq!(workspace.read("1/runs.csv"), workspace.read("3/runs.csv"));
    assert!(
        workspace.read("1/report.html") == workspace.read("3/report.html"),
        "the pages differ"
    );
}

/// A contact stiffness that no step of the solver can follow.
const UNSOLVABLE: &str = "1e300";

#[test]
fn a_failed_case_has_empty_results_and_does_not_stop_the_others() {
    let workspace = Workspace::with(&format!(
        "{FILE}\"contact.stiffness_n_m\" = [{UNSOLVABLE}, 1e5]\n"
    ));
    workspace
        .bristle("study case.toml --out results --figures all,svg")
        .assert()
        .code(3)
        .stderr(contains("error: 6 cases failed").and(contains("panicked").not()));
    assert!(
        workspace
            .read("results/report.html")
            .contains("\"failed\":6"),
        "the page counts them"
    );
    let rows = workspace.rows("results/runs.csv");
    assert_eq!(rows.len(), 12);
    for (case, row) in rows.iter().enumerate() {
        assert_eq!(row["status"] != "ok", case < 6);
        assert!(
            results_at_depths().all(|key| row[key].is_empty() == (case < 6)),
            "{row:?}"
        );
    }
    assert!(
        workspace.names("results/figures").len() == 30,
        "figures of both stiffnesses"
    );
    let failed = workspace.read("results/figures/impulse_map_stiffness_n_m_1e300.svg");
    assert!(
        failed.contains("hatched: 6 simulations failed") && !failed.contains("NaN"),
        "a failed case is a gap"
    );
    assert!(
        !workspace
            .read("results/figures/impulse_map_stiffness_n_m_100000.svg")
            .contains("hatched")
    );
}

#[test]
fn a_failed_simulation_writes_nothing() {
    let workspace = Workspace::new();
    let contact = format!("[contact]\nstiffness_n_m = {UNSOLVABLE}");
    workspace.write("case.toml", FILE.replace("[contact]", &contact));
    workspace
        .bristle("simulate case.toml --out one")
        .assert()
        .code(3)
        .stderr(contains("the simulation failed").and(contains("panicked").not()));
    assert!(workspace.path("one").exists() && workspace.names("one").is_empty());
}

#[test]
fn a_study_draws_its_figures_and_plot_draws_them_again() {
    let workspace = Workspace::with(FILE);
    let said = workspace.said("study case.toml --out results --figures all");
    let drawn = workspace.files("results/figures");
    // metrics.rs tests which these are.
    let count = drawn.len() / 3;
    assert!(
        count > 10 && said.contains(&format!("wrote {count} figures as SVG, PNG, PDF to")),
        "{said}"
    );
    for (name, bytes) in &drawn {
        let (name, start): (_, &[u8]) = match name.rsplit_once('.') {
            Some((name, "svg")) => (name, b"<svg"),
            Some((name, "png")) => (name, b"\x89PNG"),
            _ => (name.trim_end_matches(".pdf"), b"%PDF-"),
        };
        assert!(bytes.starts_with(start), "{name}");
        assert!(
            ["svg", "png", "pdf"]
                .iter()
                .all(|ending| drawn.contains_key(&format!("{name}.{ending}"))),
            "{name}"
        );
    }

    workspace
        .bristle("plot results --out again --figures all")
        .assert()
        .success()
        .stdout("")
        .stderr(contains(format!("wrote {count} figures")));
    assert_eq!(workspace.files("again/figures"), drawn);
    fs::remove_dir_all(workspace.path("results/figures")).expect("the figures can be removed");
    workspace.run("plot results --figures all");
    assert_eq!(workspace.files("results/figures"), drawn);

    // The five that matter most, in place of all.
    let said = workspace.said("plot results");
    has(
        &said,
        &[
            "wrote 5 figures as SVG, PNG, PDF to",
            "more with --figures all",
        ],
    );
    let main = workspace.files("results/figures");
    assert!(
        main.len() == 15 && main.iter().all(|(name, bytes)| drawn[name] == *bytes),
        "{:?}",
        main.keys()
    );
}

#[test]
fn simulate_draws_the_contact_over_time() {
    let workspace = Workspace::with(FILE);
    workspace
        .bristle("simulate case.toml --out one")
        .assert()
        .success()
        .stderr(contains("wrote 3 figures"));
    let drawn = workspace.files("one/figures");
    let names = ["history", "profile_drawn", "profile_unrolled"];
    let files = names.map(|name| ["pdf", "png", "svg"].map(|ending| format!("{name}.{ending}")));
    assert!(drawn.keys().eq(files.as_flattened()), "{:?}", drawn.keys());
    workspace.run("plot one --out again");
    assert_eq!(workspace.files("again/figures"), drawn);

    // A filament that touches nothing does no work, and pictures of an earlier contact that did are
    // removed.
    let far = "[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-3\noffset_m = -0.1\n";
    workspace.write("case.toml", FILE.replace("[workpiece]\n", far));
    workspace
        .bristle("simulate case.toml --out one")
        .assert()
        .success()
        .stderr(contains("wrote 1 figure"));
    assert_eq!(workspace.files("one/figures").len(), 3);
    workspace.run("plot one --out again");
    assert_eq!(
        workspace.files("again/figures"),
        workspace.files("one/figures")
    );
}

/// Where along the profile the work is done adds up to the metrics, for every kind of workpiece.
#[test]
fn profiles_add_up_to_the_metrics() {
    let workspace = Workspace::new();
    let file = FILE.replace("[contact]\n", "[contact]\nfriction_coefficient = 0.3\n");
    for piece in [
        "kind = \"plane\"",
        "kind = \"edge\"\nedge_radius_m = 1e-3",
        "kind = \"chamfer\"\nedge_radius_m = 1e-4\nchamfer_width_m = 1e-3",
        "kind = \"cylinder\"\nradius_m = 0.1",
        "kind = \"bore\"\nradius_m = 0.5",
    ] {
        workspace.write(
            "case.toml",
            file.replace("[workpiece]\n", &format!("[workpiece]\n{piece}\n")),
        );
        workspace.run("simulate case.toml --out one");
        let heading = "arc_length_m,x_m,y_m,length_m,on_edge,normal_impulse_n_s_m,friction_work_j_m,sliding_work_j_m\n";
        assert!(workspace.read("one/profile.csv").starts_with(heading));
        let rows = workspace.rows("one/profile.csv");
        let sum = |column: &str| {
            rows.iter()
                .map(|row| number(row, "length_m") * number(row, column))
                .sum::<f64>()
        };
        for (column, key) in [
            ("normal_impulse_n_s_m", "contact_normal_impulse_n_s"),
            ("friction_work_j_m", "friction_work_j"),
            ("sliding_work_j_m", "sliding_work_j"),
        ] {
            let expected = workspace.number("one/metrics.json", key);
            assert!(
                (sum(column) / expected - 1.0).abs() < 1e-12,
                "{piece}: {key}"
            );
        }
    }
}

#[test]
fn figures_fit_what_is_swept() {
    let workspace = Workspace::new();
    let study = |sweeps: &str| {
        let (settings, _) = FILE.split_once("[study]").expect("a study");
        workspace.write("case.toml", format!("{settings}[study]\n{sweeps}\n"));
        let said = workspace.said("study case.toml --out results --restart --figures all");
        let names = workspace
            .files("results/figures")
            .into_keys()
            .filter(|name| name.ends_with(".svg"));
        (names.collect::<Vec<_>>(), said)
    };
    // Figures of the previous study are removed.
    let (names, _) = study("brushing_velocity_m_s = [10.0, 20.0]\n\"filament.segments\" = [3, 4]");
    let count = names.len();
    assert!(
        count > 0
            && names
                .iter()
                .all(|name| name.ends_with("_over_velocity.svg")),
        "{names:?}"
    );
    let (names, _) = study("\"filament.segments\" = [4, 3]");
    assert!(
        names.len() == count
            && names
                .iter()
                .all(|name| name.ends_with("_over_segments.svg")),
        "{names:?}"
    );
    let (names, message) = study("\"filament.segments\" = [4]");
    assert!(
        names.is_empty() && message.contains("no figures\n  (one case alone"),
        "{message}"
    );
    let grid = "brushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]";
    let (names, message) = study(&format!("{grid}\n\"filament.segments\" = [2, 3, 4, 5, 6]"));
    assert!(
        names.contains(&"impulse_map_segments_2.svg".to_owned()),
        "{names:?}"
    );
    let chosen: BTreeSet<&str> = names
        .iter()
        .filter_map(|name| Some(name.rsplit_once("_segments_")?.1))
        .collect();
    assert!(
        chosen.len() == 4 && message.contains("4 of 5 values"),
        "{chosen:?}\n{message}"
    );
}

#[test]
fn results_that_cannot_be_drawn_are_refused() {
    let workspace = Workspace::with(FILE);
    workspace.refuses("plot absent", &["absent", "bristle study"]);
    workspace.run("study case.toml --out results");
    let runs = workspace.read("results/runs.csv");
    let drawn = workspace.files("results/figures");
    for (old, new, place) in [
        (
            "10.0,0.0005",
            "10.5,0.0005",
            "runs.csv:2, column brushing_velocity_m_s",
        ),
        (",ok\n", ",ok\n10.0,0.1", "runs.csv:3"),
        (",contact_time_s", ",time", "no column `contact_time_s`"),
    ] {
        workspace.write("results/runs.csv", runs.replacen(old, new, 1));
        workspace.refuses("plot results", &[place, "help:"]);
    }
    workspace.write("results/runs.csv", "");
    workspace.refuses("plot results", &["empty"]);
    assert_eq!(
        workspace.files("results/figures"),
        drawn,
        "earlier figures stay"
    );
}

/// A crash after the rows are written and before the settings are would leave such results.
#[test]
fn results_of_two_studies_are_not_drawn_as_one() {
    let workspace = Workspace::with(FILE);
    workspace.run("study case.toml --out results");
    let settings = workspace.read("results/study.json");
    workspace.write(
        "case.toml",
        FILE.replace("diameter_m = 1.18e-3", "diameter_m = 1.2e-3"),
    );
    workspace.run("study case.toml --out results --restart");
    workspace.write("results/study.json", settings);
    let parts = [
        "runs.csv:1: study.json does not belong to these results",
        "help: run the command that made the results again",
    ];
    workspace.refuses("plot results", &parts);
    // That suffices, as the journal has the results.
    workspace.run("study case.toml --out results");
    workspace.run("plot results");
}

/// Made-up forces at grid points, between them, and outside.
pub const FORCES: &str = "\
brushing_velocity_m_s, penetration_depth_m, force_n, std_n
10.0, 0.001, 100.0, 1e6
20, 1.0e-3, 150.0, 0.0
15.0, 0.00075, 120.0, 10.0
30.0, 0.001, 300.0, 10.0
";

#[test]
fn measured_forces_are_compared_and_drawn() {
    let workspace = Workspace::new();
    fs::create_dir(workspace.path("inputs")).expect("a directory");
    workspace.write(
        "inputs/case.toml",
        format!("{FILE}\n[measured]\nfile = \"forces.csv\"\n"),
    );
    workspace.write("inputs/forces.csv", FORCES);
    workspace
        .bristle("study inputs/case.toml --out results")
        .assert()
        .success()
        .stderr(contains("wrote 5 figures"))
        .stdout(contains("3 of 4 points compared: bias"))
        .stdout(contains("outside the study").and(contains("within ± std 1 (33 %)")));

    let force = workspace.column("results/runs.csv", "tool_contact_normal_force_n");
    let heading = "brushing_velocity_m_s,penetration_depth_m,measured_force_n,measured_std_n,simulated_force_n,\
                   simulated_uncertainty_n,difference_n,within_std,status\n";
    assert!(
        workspace
            .read("results/measured_comparison.csv")
            .starts_with(heading)
    );
    let rows = workspace.rows("results/measured_comparison.csv");
    let simulated = |row: usize| number(&rows[row], "simulated_force_n");
    // Cases 2 and 3 are those at 1 mm; the third point lies in the middle of the first four cases.
    assert_eq!([simulated(0), simulated(1)], [force[2], force[3]]);
    let middle = force[..4].iter().sum::<f64>() / 4.0;
    assert!(
        (simulated(2) - middle).abs() < 1e-9 * middle,
        "rounding of the weights"
    );
    let uncertainty = number(&rows[0], "simulated_uncertainty_n");
    assert!((uncertainty - force[2] * 600.0 / 10_500.0).abs() < 1e-9 * force[2]);
    assert_eq!(
        [0, 1, 3].map(|row: usize| &*rows[row]["within_std"]),
        ["yes", "no", ""]
    );
    assert_eq!(
        [0, 3].map(|row: usize| &*rows[row]["status"]),
        ["ok", "outside the study"]
    );

    // The saved results need no input file.
    fs::remove_dir_all(workspace.path("inputs")).expect("the inputs can be removed");
    workspace
        .bristle("plot results --out again")
        .assert()
        .success()
        .stdout(contains("bias"));
    assert_eq!(
        workspace.files("again/figures"),
        workspace.files("results/figures")
    );
    assert_eq!(
        workspace.read("again/measured_comparison.csv"),
        workspace.read("results/measured_comparison.csv")
    );

    // Files of measured forces are removed when the results are not compared with any.
    workspace.write("case.toml", FILE);
    workspace.run("study case.toml --out results");
    for name in ["measured.csv", "measured_comparison.csv"] {
        assert!(
            !workspace.path(&format!("results/{name}")).exists(),
            "{name}"
        );
    }
}

/// The same forces as a spreadsheet of a laboratory exports them.
#[test]
fn tables_of_laboratories_are_compared_like_those_in_si_units() {
    let workspace = Workspace::new();
    let columns = "columns = { brushing_velocity_m_s = \"vb [m/min]\", penetration_depth_m = \"ae [mm]\", \
                   force_n = { column = \"Fz\", unit = \"kN\" } }\n";
    workspace.write(
        "case.toml",
        format!("{FILE}\n[measured]\nfile = \"forces.csv\"\n{columns}"),
    );
    let table = "\u{feff}Nr;vb [m/min];ae [mm];Fz\r\n1;600;1;0,1\r\n2;1200;1;0,15\r\n";
    workspace.write("forces.csv", table);
    let compared = contains("2 of 2 points compared: bias").and(contains("within ± std").not());
    workspace
        .bristle("study case.toml --out results")
        .assert()
        .success()
        .stdout(compared);
    let kept = workspace.read("results/measured.csv");
    assert_eq!(
        kept,
        "brushing_velocity_m_s,penetration_depth_m,force_n\n10.0,0.001,100.0\n20.0,0.001,150.0\n"
    );
    assert!(
        workspace
            .read("results/report.html")
            .contains("\"comparisons\":[{\"condition\":")
    );
    let comparison = workspace.read("results/measured_comparison.csv");
    workspace.run("plot results --out again");
    assert_eq!(workspace.read("again/measured_comparison.csv"), comparison);

    // Millimetres that pass for metres.
    workspace.write("forces.csv", table.replace("ae [mm]", "ae"));
    workspace.write(
        "case.toml",
        format!(
            "{FILE}\n[measured]\nfile = \"forces.csv\"\n{}",
            columns.replace("ae [mm]", "ae")
        ),
    );
    let hint = contains("warning: 2 of 2 measured values of").and(contains("unit = \"mm\""));
    workspace
        .bristle("study case.toml --out results")
        .assert()
        .success()
        .stderr(hint);
    workspace.refuses(
        "study case.toml --out strict --strict",
        &["measured values"],
    );
}

#[test]
fn evaluate_prints_the_equations_at_a_state() {
    let workspace = Workspace::new();
    // Contact is left out: velocity and depth need not be stated.
    workspace.write(
        "case.toml",
        FILE.split("[process]")
            .next()
            .expect("the text before [process]"),
    );
    workspace.write("state.json", STATE);
    let [result, said] = workspace.run("evaluate case.toml --state state.json");
    assert_eq!(said, "");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result.as_object().map(|object| object.len()), Some(6));
    let matrix = result["mass_matrix"].as_array().expect("a matrix");
    assert!(
        matrix.len() == 4
            && matrix
                .iter()
                .all(|row| row.as_array().map(Vec::len) == Some(4))
    );
    assert_eq!(result["accelerations"].as_array().map(Vec::len), Some(4));
    assert_eq!(result["tip_position_m"].as_array().map(Vec::len), Some(3));
    for key in ["kinetic_energy_j", "potential_energy_j", "dissipation_w"] {
        assert!(result[key].is_number(), "{key}");
    }
}

/// What `derive` can derive, for 1 segment.
const EQUATIONS: [&str; 4] = [
    "--segments 1",
    "--segments 1 --planar",
    "--kernels",
    "--kernels --planar",
];

/// The values of `--format` in `derive` that are one text.
const FORMATS: [&str; 7] = [
    "math", "latex", "markdown", "rust", "json", "numpy", "sympy",
];

/// Those that are several files, each with a file that the whole equations of motion in space have.
const FORMATS_OF_FILES: [(&str, &str); 2] = [("c", "bristle_chain.c"), ("matlab", "one_pass.m")];

/// In two processes, to the same bytes.
#[test]
fn derive_prints_or_writes() {
    let workspace = Workspace::new();
    for equations in EQUATIONS.map(|equations| equations.replace('1', "3")) {
        for format in FORMATS {
            let arguments = format!("derive {equations} --format {format}");
            let printed = workspace.printed(&arguments);
            assert!(!printed.is_empty());
            assert_eq!(
                workspace.printed(&format!("{arguments} --out equations.txt")),
                ""
            );
            assert!(workspace.read("equations.txt") == printed, "{arguments}");
        }
    }
}

#[test]
fn several_files_go_to_a_directory() {
    let workspace = Workspace::new();
    for (format, file) in FORMATS_OF_FILES {
        workspace.refuses(
            &format!("derive --segments 1 --format {format}"),
            &["--out DIR"],
        );
        let command = format!("derive --segments 1 --format {format} --out");
        for directory in ["one", "two"] {
            assert_eq!(
                workspace.printed(&format!("{command} {format}/{directory}")),
                ""
            );
        }
        let [one, two] =
            ["one", "two"].map(|directory| workspace.files(&format!("{format}/{directory}")));
        assert_eq!(one, two);
        assert!(one.iter().any(|(name, _)| name == file));
    }
}

/// The variable names Octave's program, which not every machine has.
#[test]
fn a_pass_in_octave_has_the_impulse_of_the_program() {
    let Ok(octave) = std::env::var("BRISTLE_TEST_OCTAVE") else {
        println!("skipped: BRISTLE_TEST_OCTAVE does not name a program");
        return;
    };
    let workspace = Workspace::with(FILE);
    for (motion, segments) in [("--planar", 3), ("", 2)] {
        workspace.run(&format!(
            "derive --segments {segments} {motion} --format matlab --out m"
        ));
        let simulate =
            "simulate case.toml --out one --no-figures --set process.brushing_velocity_m_s=20.0";
        workspace.run(&format!("{simulate} --set filament.segments={segments}"));
        let run = |call: &str| {
            let script = format!("m = {call}; printf('%.17g\\n', m.contact_normal_impulse_n_s)");
            Process::new(&octave)
                .args(["--no-gui", "--quiet", "--norc", "--eval", &script])
                .current_dir(workspace.path("m"))
                .output()
                .expect("Octave starts")
        };
        let agrees = |call: &str, metrics: &str| {
            let output = run(call);
            let printed = String::from_utf8_lossy(&output.stdout).into_owned();
            let impulse: f64 = printed
                .trim()
                .parse()
                .unwrap_or_else(|_| panic!("{output:?}"));
            let expected = workspace.number(metrics, "contact_normal_impulse_n_s");
            assert!(
                (impulse / expected - 1.0).abs() < 1e-4,
                "{motion}, {call}: {impulse:e} {expected:e}"
            );
        };
        agrees("one_pass(20, 1e-3)", "one/metrics.json");
        let simulate =
            format!("simulate case.toml --out two --no-figures --set filament.segments={segments}");
        let other = "--set filament.diameter_m=1e-3 --set tool.body_radius_m=0.1 --set process.gravity_m_s2=[0,-9.81,0]";
        workspace.run(&format!("{simulate} {other}"));
        agrees("one_pass('../two/case.json')", "two/metrics.json");
        workspace.run(&format!(
            "{simulate} --set contact.friction_coefficient=0.3"
        ));
        let refused = run("one_pass('../two/case.json')").stderr;
        has(
            &String::from_utf8_lossy(&refused),
            &["does not know contact.friction_coefficient other than 0"],
        );
    }
}

#[test]
fn derived_source_states_its_origin() {
    let workspace = Workspace::new();
    for equations in EQUATIONS.map(|equations| equations.replace('1', "2")) {
        let command = format!("derive {equations} --format rust");
        let source = workspace.printed(&command);
        let header: Vec<&str> = source
            .lines()
            .take_while(|line| line.starts_with("//"))
            .collect();
        assert_eq!(header.len(), 5, "{header:?}");
        assert!(header[1].contains("bristle-codegen"));
        let fingerprint = header[2].rsplit(' ').next().expect("a word");
        assert!(
            fingerprint.len() == 64 && fingerprint.chars().all(|digit| digit.is_ascii_hexdigit())
        );
        assert!(header[3].ends_with(&format!("bristle {command}")));
        assert!(source.contains("\nuse bristle::equations::Real;\n"));
    }
}

#[test]
fn exactly_one_kind_of_equations_is_derived() {
    let workspace = Workspace::new();
    workspace.refuses("derive --format math", &["--segments", "--kernels"]);
    workspace.refuses("derive --segments 2 --kernels", &["cannot be used with"]);
}

#[test]
fn derived_graphs_agree_with_themselves() {
    let workspace = Workspace::new();
    for equations in EQUATIONS {
        workspace.run(&format!(
            "derive {equations} --format json --out graph.json"
        ));
        workspace
            .bristle("compare graph.json --states 4")
            .assert()
            .success()
            .stdout(contains("all agree"));
    }
}

#[test]
fn compare_tells_agreement_and_deviation() {
    let workspace = Workspace::new();
    let graph = |name: &str| {
        format!(
            "{}/../../derivations/graphs/{name}",
            env!("CARGO_MANIFEST_DIR")
        )
    };
    for (name, outputs) in [
        (
            "chain_2.json",
            ["whole equations of 2 segments", "energies.dissipation"],
        ),
        (
            "chain_2_planar.json",
            [
                "whole planar equations of 2 segments",
                "planar_energies.dissipation",
            ],
        ),
        ("kernels.json", ["joint.next", "lateral_clamp.next"]),
    ] {
        let table = workspace.printed(&format!("compare {} --states 50", graph(name)));
        has(&table, &["all agree to 1e-12", "CasADi"]);
        assert!(
            outputs.iter().all(|output| table.contains(output)),
            "{table}"
        );
    }

    // Another sign in the energies. (The sign of a velocity would not affect the force, as the node
    // velocities cancel.)
    let text = fs::read_to_string(graph("chain_2.json")).expect("the graph is there");
    let energies = text.find("\"energies\"").expect("it has energies");
    let (before, after) = text.split_at(energies);
    workspace.write(
        "wrong.json",
        format!("{before}{}", after.replacen("[\"sub\",", "[\"add\",", 1)),
    );
    workspace
        .bristle("compare wrong.json --states 50")
        .assert()
        .code(1)
        .stdout(contains("DEVIATES").and(contains("NOT all agree")));
}

#[test]
fn graphs_that_cannot_be_compared_are_refused() {
    let workspace = Workspace::new();
    let chain = include_str!("../../../../derivations/graphs/chain_1.json");
    for (text, expected) in [
        (String::new(), "line 1"),
        ("{}".into(), "missing field `format`"),
        (chain.replace("\"version\":2", "\"version\":1"), "version"),
        (
            chain.replace("[\"sin\",0]", "[\"sinh\",0]"),
            "unknown operator `sinh`",
        ),
        (
            chain.replace("[\"sin\",0]", "[\"sin\",4000]"),
            "uses operation 4000",
        ),
        (
            chain.replace("\"q\"", "\"coordinates\""),
            "input 1 is `coordinates`",
        ),
        (
            chain.replace("\"energies\"", "\"energy\""),
            "kernel 1 is `mass_matrix`",
        ),
        (
            chain
                .replace("\"phi_1\",0", "\"phi_1\",1")
                .replace("\"theta_1\",1", "\"theta_1\",0"),
            "stands for another quantity",
        ),
    ] {
        workspace.write("graph.json", &text);
        let message = workspace.refused("compare graph.json");
        assert!(
            message.contains("graph.json") && message.contains(expected),
            "{expected}: {message}"
        );
    }
    workspace.refuses("compare absent.json", &["absent.json"]);
    workspace.refused("compare graph.json --states 0");
}

#[test]
fn schema_prints_a_schema() {
    let schema = Workspace::new().printed_json("schema");
    assert_eq!(schema["type"], "object");
    assert!(schema["properties"]["study"].is_object());
}

#[test]
fn the_example_is_the_papers_study() {
    let example = include_str!("../../../../examples/zirconia.toml");
    let study = study(example);
    assert_eq!(study.case_count(), 120);
    let [first, last] = [0, 119].map(|case| study.settings(case));
    assert_eq!(first.filament.segments, 25);
    let contact = |case: &Settings| {
        (
            case.process.brushing_velocity_m_s,
            case.process.penetration_depth_m,
        )
    };
    assert_eq!(
        [contact(&first), contact(&last)],
        [(2.5, 0.5e-3), (30.0, 5.0e-3)]
    );

    // The optional settings in the example have their default values.
    let minimal = FILE
        .replace("segments = 4\n", "")
        .replace("relative_tolerance = 1e-4\n", "");
    assert_eq!(settings(example), settings(&minimal));
}

#[test]
fn a_grid_of_too_many_points_is_refused_at_once() {
    let workspace = Workspace::new();
    let thousands = "{ start = 1, stop = 9999, step = 1 }";
    let keys = [
        "contact.damping_s_m",
        "contact.stiffness_n_m",
        "filament.density_kg_m3",
        "tool.filament_count",
        "tool.width_m",
    ];
    let sweeps: String = keys
        .iter()
        .map(|key| format!("\"{key}\" = {thousands}\n"))
        .collect();
    workspace.write("case.toml", format!("{FILE}{sweeps}"));
    workspace.refuses(
        "study case.toml --out results",
        &["more than 1000000 cases", &place(FILE, "[study]")],
    );
}

#[test]
fn unreadable_files_are_refused() {
    let workspace = Workspace::new();
    workspace.write("binary.toml", [0xff, 0x00, 0x80]);
    workspace.write("text.toml", "This is not TOML.\n");
    workspace.write("empty.toml", "");
    for file in ["absent.toml", "binary.toml", "text.toml", "empty.toml", "."] {
        for command in ["simulate", "study"] {
            workspace.refused(&format!("{command} {file} --out results"));
            assert!(!workspace.path("results").exists());
        }
    }
    workspace.refuses("study absent.toml --out results", &["absent.toml"]);
}

#[test]
fn an_unwritable_directory_is_refused() {
    let workspace = Workspace::with(FILE);
    workspace.write("file", "kept");
    for out in ["file", "file/results"] {
        for command in ["simulate", "study"] {
            workspace.refuses(&format!("{command} case.toml --out {out}"), &[out]);
        }
    }
    workspace.refuses(
        "derive --segments 1 --out absent/equations.txt",
        &["absent/equations.txt"],
    );
    assert_eq!(workspace.read("file"), "kept");
}

#[test]
fn earlier_results_survive_bad_input() {
    let workspace = Workspace::new();
    fs::create_dir(workspace.path("results")).expect("the directory can be made");
    workspace.write("results/metrics.json", "earlier");
    workspace.write("case.toml", FILE.replace("segments = 4", "segments = 0"));
    workspace.refused("simulate case.toml --out results");
    assert_eq!(workspace.read("results/metrics.json"), "earlier");
}

/// The unit tests of `bristle_inspect::state` have more of them.
#[test]
fn bad_states_are_refused() {
    let workspace = Workspace::with(FILE);
    workspace.write("state.json", STATE.replacen("1.6, -1.4", "null, -1.4", 1));
    workspace.refuses(
        "evaluate case.toml --state state.json",
        &["state.json", "`q[2]`"],
    );
    workspace.refuses("evaluate case.toml --state absent.json", &["absent.json"]);
    workspace.write("state.json", STATE);
    workspace.write(
        "case.toml",
        FILE.replace("length_m = 0.040", "length_m = 0.0"),
    );
    workspace.refuses(
        "evaluate case.toml --state state.json",
        &["filament.length_m"],
    );
}

#[test]
fn bad_calls_are_refused() {
    let workspace = Workspace::with(FILE);
    let calls = [
        "polish",
        "study case.toml",
        "study case.toml --out results --threads 0",
        "study case.toml --out results --threads many",
        "simulate case.toml --out results --samples 1",
        "simulate case.toml --out results --samples 1000001",
        "simulate case.toml --out results --samples 2.5",
        "evaluate case.toml",
        "derive --segments 0",
        "derive --segments 401",
        "derive --segments -1",
        "derive --segments 2 --format pdf",
    ];
    for call in calls {
        workspace
            .bristle(call)
            .assert()
            .code(2)
            .stdout("")
            .stderr(contains("panicked").not());
        assert!(!workspace.path("results").exists(), "{call}");
    }
}

#[test]
fn without_arguments_one_screen_says_where_to_begin() {
    let [screen, said] = Workspace::new().run("");
    assert!(said.is_empty() && screen.lines().count() <= 24, "{screen}");
    has(&screen, &["bristle new brush.toml", "  simulate "]);
    assert!(
        Workspace::new()
            .printed("--version")
            .starts_with("bristle ")
    );
}

#[test]
fn shells_and_manual_pages_know_every_command() {
    let directory = Workspace::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = directory.printed(&format!("completions {shell}"));
        assert!(
            script.contains("compare-studies") && script.contains("without-interaction"),
            "{shell}"
        );
    }
    directory.run("man --out pages");
    let pages = directory.names("pages");
    for page in ["bristle.1", "bristle-study.1", "bristle-converge.1"] {
        assert!(pages.iter().any(|own| own == page), "{page}");
    }
    let study = directory.read("pages/bristle-study.1");
    has(&study, &["bristle\\-study", "journal.jsonl"]);
    let listed = directory
        .printed("")
        .lines()
        .filter(|line| line.starts_with("  "))
        .count();
    assert_eq!(pages.len(), listed + 3, "{pages:?}");
    directory.refuses(
        "completions ksh",
        &["[possible values: bash, elvish, fish, powershell, zsh]"],
    );
}

#[test]
fn a_file_says_which_equations_it_has() {
    let directory = Workspace::with(FILE);
    let segments = settings(FILE).filament.segments;
    let of = |arguments: &str| directory.printed(&format!("derive {arguments} --format json"));
    assert!(of("case.toml") == of(&format!("--segments {segments} --planar")));
    // A tilt takes the filament out of the plane.
    let tilted = FILE.replace("[filament]\n", "[filament]\nlateral_tilt_rad = 0.01\n");
    assert_ne!(tilted, FILE);
    directory.write("tilted.toml", tilted);
    assert!(of("tilted.toml") == of(&format!("--segments {segments}")));
    // A straight cylinder has neither relaxed angles nor constants of each segment; its clamp joint
    // is twice as stiff.
    let read = |file: &str, filament: &str| {
        let text = FILE.replace(
            &format!("segments = {segments}"),
            &format!("segments = 2\n{filament}"),
        );
        assert_ne!(text, FILE);
        directory.write(file, text);
        directory.printed(&format!("derive {file}"))
    };
    let straight = read("straight.toml", "");
    assert!(
        straight.contains("2 c S′(u1)") && !straight.contains('κ') && !straight.contains("m1"),
        "{straight}"
    );
    let wavy = read("wavy.toml", "waviness_amplitude_m = 1e-4");
    assert!(wavy.contains("κ2") && !wavy.contains("m1"), "{wavy}");
    directory.refuses("derive case.toml --segments 2", &["cannot be used with"]);
    directory.refuses("derive missing.toml", &["missing.toml"]);
}

#[test]
fn a_fragment_is_a_part_of_a_paper() {
    let workspace = Workspace::new();
    let derive = "derive --segments 2 --planar --format latex --fragment";
    let fragment = workspace.printed(derive);
    assert!(
        fragment.contains("bmatrix") && !fragment.contains("documentclass"),
        "{fragment}"
    );
    assert!(
        fragment.contains(&format!("% To make it again: bristle {}\n", derive)),
        "{fragment}"
    );
    assert!(
        workspace
            .printed("derive --kernels --format latex --fragment")
            .contains("\\label{eq:")
    );
    workspace.refuses("derive --segments 2 --fragment", &["add --format latex"]);
}
