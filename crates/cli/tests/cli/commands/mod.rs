//! The contract of the command line: files, exit statuses and messages.

mod equations;

use bristle_app::store::results::run_columns;
use predicates::str::contains;
use serde_json::json;

use crate::program::{Workspace, brush, has, lacks, settings, study, words};

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
pub const STATE: &str = r#"{"base_angle": -1.5, "base_rate": 50.0, "base_acceleration": 0.0, "gravity": [0, 0, 0],
 "q": [1.5, -1.5, 1.6, -1.4], "v": [0.1, 50.0, 0.2, 51.0]}"#;

#[test]
fn simulate_writes_metrics_and_history() {
    let workspace = Workspace::with(FILE);
    let table = workspace.printed("simulate case.toml --out one --samples 11");
    has(&table, &["F_n,w"]);
    // metrics.rs tests which metrics these are.
    let metrics = workspace.json("one/metrics.json");
    assert_eq!(
        metrics["turn_contact_normal_impulses_n_s"],
        json!([metrics["contact_normal_impulse_n_s"]])
    );
    let heading = "time_s,base_angle_rad,contact_normal_force_n,contact_tangential_force_n,tip_deflection_m,\
                   tip_x_m,tip_y_m,tip_z_m,kinetic_energy_j,potential_energy_j,dissipated_energy_j,\
                   contact_normal_impulse_n_s,peak_contact_normal_force_n\n";
    assert!(workspace.read("one/history.csv").starts_with(heading));
    let rows = workspace.rows("one/history.csv");
    assert_eq!(rows.len(), 11);
    let mut cells = rows.iter().flat_map(|row| row.values());
    assert!(cells.all(|cell| cell.parse::<f64>().is_ok_and(f64::is_finite)));

    // The number of samples changes no metric.
    workspace.run("simulate case.toml --out more --samples 500");
    assert_eq!(workspace.json("more/metrics.json"), metrics);
}

#[test]
fn study_writes_one_row_per_case_in_grid_order() {
    let workspace = Workspace::with(FILE);
    let [tables, said] = workspace.run("study case.toml --out results --tables all");
    has(&tables, &["ε_tc", "p_n in", "F_n,w in"]);
    lacks(&tables, &["wrote"]);
    has(&said, &["6 cases in", "runs.csv"]);

    let runs = workspace.read("results/runs.csv");
    let (heading, rows) = runs.split_once('\n').expect("rows");
    assert_eq!(heading, run_columns(&study(FILE), &[]).join(","));
    let expected = [
        "10.0,0.0005,4,",
        "20.0,0.0005,4,",
        "10.0,0.001,4,",
        "20.0,0.001,4,",
        "10.0,0.0015,4,",
        "20.0,0.0015,4,",
    ];
    assert_eq!(rows.lines().count(), 6);
    for (row, start) in rows.lines().zip(expected) {
        assert!(row.starts_with(start) && row.ends_with(",ok"), "{row}");
    }
    // formats.rs tests the tables as Parquet.
    let mut files = workspace.names("results");
    files.retain(|name| name != "runs.parquet");
    let expected = [
        "figures",
        "journal.jsonl",
        "report.html",
        "runs.csv",
        "study.json",
    ];
    assert_eq!(files, expected);
}

#[test]
fn a_failed_case_is_a_gap() {
    // A contact stiffness that no step of the solver can follow.
    let sweep = "\"contact.stiffness_n_m\" = [1e300, 1e5]\n";
    let workspace = Workspace::with(&format!("{FILE}{sweep}"));
    workspace
        .bristle("study case.toml --out results --figures all,svg")
        .assert()
        .code(3)
        .stderr(contains("error: 6 cases failed"));
    let map = |value: &str| {
        workspace.read(&format!(
            "results/figures/impulse_map_stiffness_n_m_{value}.svg"
        ))
    };
    has(&map("1e300"), &["hatched: 6 simulations failed"]);
    lacks(&map("100000"), &["hatched"]);
}

#[test]
fn a_study_draws_its_figures_and_plot_draws_them_again() {
    let workspace = Workspace::with(FILE);
    let said = workspace.said("study case.toml --out results --figures all,svg,png,pdf");
    let drawn = workspace.files("results/figures");
    // metrics.rs tests which figures these are.
    let count = drawn.len() / 3;
    assert!(count > 10);
    has(
        &said,
        &[&format!("wrote {count} figures as SVG, PNG, PDF to")],
    );
    for (name, bytes) in &drawn {
        let start: &[u8] = match name.rsplit_once('.') {
            Some((_, "svg")) => b"<svg",
            Some((_, "png")) => b"\x89PNG",
            _ => b"%PDF-",
        };
        assert!(bytes.starts_with(start), "{name}");
    }
    workspace.remove("results/figures");
    for out in ["again", "results"] {
        workspace.run(&format!(
            "report results --out {out} --figures all,svg,png,pdf"
        ));
        assert_eq!(workspace.files(&format!("{out}/figures")), drawn);
    }

    // The five main figures, in place of all.
    let said = workspace.said("report results");
    has(
        &said,
        &["wrote 5 figures as SVG to", "more with --figures all"],
    );
    let main = workspace.files("results/figures");
    assert!(main.len() == 5 && main.iter().all(|(name, bytes)| drawn[name] == *bytes));

    // A single case has none.
    let one = "--set study.brushing_velocity_m_s=[10.0] --set study.penetration_depth_m=[1e-3]";
    let said = workspace.said(&format!("study case.toml --out results --restart {one}"));
    has(&said, &["one case in ", "no figures\n  (one case alone"]);
    assert!(workspace.files("results/figures").is_empty());
}

#[test]
fn simulate_draws_the_contact_over_time() {
    let workspace = Workspace::with(FILE);
    let drawn_again = |count: &str| {
        let said = workspace.said("simulate case.toml --out one");
        has(&said, &[count]);
        workspace.run("report one --out again");
        let drawn = workspace.files("one/figures");
        assert_eq!(workspace.files("again/figures"), drawn);
        drawn
    };
    let drawn = drawn_again("wrote 3 figures");
    let names = ["history", "profile_drawn", "profile_unrolled"];
    let files = names.map(|name| format!("{name}.svg"));
    assert!(drawn.keys().eq(&files), "{:?}", drawn.keys());

    // A filament without contact does no work. Pictures of an earlier contact are removed.
    let far = "[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-3\noffset_m = -0.1\n";
    workspace.write("case.toml", FILE.replace("[workpiece]\n", far));
    assert_eq!(drawn_again("wrote 1 figure").len(), 1);
}

/// A crash after the rows are written and before the settings are would leave such results.
#[test]
fn results_of_two_studies_are_not_drawn_as_one() {
    let workspace = Workspace::with(FILE);
    workspace.refuses("report absent", &["absent", "bristle study"]);
    workspace.run("study case.toml --out results");
    let (settings, drawn) = (
        workspace.read("results/study.json"),
        workspace.files("results/figures"),
    );
    let other = "study case.toml --out results --restart --no-figures";
    workspace.run(&format!("{other} --set filament.diameter_m=1.2e-3"));
    workspace.write("results/study.json", settings);
    workspace.refuses(
        "report results --out again",
        &[
            "runs.csv:1: study.json does not belong to these results",
            "help: run the command that made the results again",
        ],
    );
    workspace.has_no("again");
    workspace.run("study case.toml --out results --restart");
    assert_eq!(workspace.files("results/figures"), drawn);
}

/// Invented forces at grid points, between them, and outside.
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
    workspace.make("inputs");
    let measured = format!("{FILE}\n[measured]\nfile = \"forces.csv\"\n");
    workspace.write("inputs/case.toml", measured);
    // Millimetres in a column of metres.
    workspace.write("inputs/forces.csv", FORCES.replace("0.001", "1"));
    let strict = "study inputs/case.toml --out results --strict";
    let refused = words(&workspace.refused(strict));
    has(&refused, &["2 of 4 measured values of", "unit = \"mm\""]);
    workspace.write("inputs/forces.csv", FORCES);
    let [tables, said] = workspace.run("study inputs/case.toml --out results");
    has(&said, &["wrote 5 figures"]);
    has(
        &tables,
        &[
            "3 of 4 points compared: bias",
            "outside the study",
            "within ± std 1 (33 %)",
        ],
    );

    // The unit tests of `bristle_app::insight::measured` compute these values.
    let heading = "brushing_velocity_m_s,penetration_depth_m,measured_force_n,measured_std_n,simulated_force_n,\
                   simulated_uncertainty_n,difference_n,within_std,status\n";
    let comparison = workspace.read("results/measured_comparison.csv");
    assert!(comparison.starts_with(heading), "{comparison}");

    // The saved results need no input file.
    workspace.remove("inputs");
    has(&workspace.printed("report results --out again"), &["bias"]);
    assert_eq!(
        workspace.files("again/figures"),
        workspace.files("results/figures")
    );
    assert_eq!(workspace.read("again/measured_comparison.csv"), comparison);

    // Files of measured forces are removed when the results are not compared with any.
    workspace.write("case.toml", FILE);
    workspace.run("study case.toml --out results");
    for name in ["measured.csv", "measured_comparison.csv"] {
        assert!(!workspace.path("results").join(name).exists(), "{name}");
    }
}

#[test]
fn the_example_is_the_papers_study() {
    let example = include_str!("../../../../../examples/zirconia.toml");
    let study = study(example);
    assert_eq!(study.case_count(), 120);
    let contact = |case: usize| {
        let process = study.settings(case).process;
        (process.brushing_velocity_m_s, process.penetration_depth_m)
    };
    assert_eq!([contact(0), contact(119)], [(2.5, 0.5e-3), (30.0, 5.0e-3)]);
    // The optional settings in the example have their default values.
    let minimal = FILE
        .replace("segments = 4\n", "")
        .replace("relative_tolerance = 1e-4\n", "");
    assert_eq!(settings(example), settings(&minimal));
}

#[test]
fn files_that_cannot_be_read_or_written_are_refused() {
    let workspace = Workspace::with(FILE);
    workspace.write("binary.toml", [0xff, 0x00, 0x80]);
    workspace.write("text.toml", "This is not TOML.\n");
    workspace.write("empty.toml", "");
    for file in ["absent.toml", "binary.toml", "text.toml", "empty.toml"] {
        for command in ["simulate", "study"] {
            workspace.refuses(&format!("{command} {file} --out results"), &[file]);
            workspace.has_no("results");
        }
    }
    workspace.write("file", "kept");
    for out in ["file", "file/results"] {
        for command in ["simulate", "study"] {
            workspace.refuses(&format!("{command} case.toml --out {out}"), &[out]);
        }
    }
    let derive = "derive --segments 1 --out absent/equations.txt";
    workspace.refuses(derive, &["absent/equations.txt"]);
    assert_eq!(workspace.read("file"), "kept");
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
        "simulate case.toml --out results --vtk=1",
        "simulate case.toml --out results --vtk=10001",
        "evaluate case.toml",
        "evaluate case.toml --state absent.json",
        "compare absent.json --states 0",
        "derive --segments 0",
        "derive --segments 401",
        "derive --segments -1",
        "derive --segments 2 --format pdf",
        "derive --segments 2 --kernels",
        "derive --format math",
        "completions ksh",
    ];
    for call in calls {
        workspace.refused(call);
        workspace.has_no("results");
    }
}

#[test]
fn shells_and_manual_pages_know_every_command() {
    let directory = Workspace::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = directory.printed(&format!("completions {shell}"));
        has(&script, &["report", "alone"]);
    }
    directory.run("completions --manual pages");
    let study = directory.read("pages/bristle-study.1");
    has(&study, &["bristle\\-study", "journal.jsonl"]);
    let overview = directory.printed("");
    let listed = overview.lines().filter(|line| line.starts_with("  "));
    let listed = listed.count();
    assert_eq!(directory.names("pages").len(), listed + 3);
}
