//! `bristle brush`, studies of brushes, and their documents, as users meet them.

use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use bristle::model::metrics::Metrics;
use bristle::model::record::Record;
use bristle::model::settings::BrushSettings;
use bristle_app::store::results::keys;
use bristle_study::grid::Interaction;
use bristle_study::grid::brush::{Having, metric_columns};
use insta::assert_snapshot;

use crate::program::{
    VTK, Workspace, documented, has, ignores_interrupts, interrupt, kill, lacks, number, section,
    settings, study,
};

/// A planar sector that takes a tenth of a second.
const FILE: &str = "\
[tool]
body_radius_m = 0.140
width_m = 0.020
filament_count = 682

[filament]
segments = 4
length_m = 0.040
diameter_m = 1.18e-3

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[brush]
rows = 1
columns = 8
steady = false
";

/// The section that turns it into a study.
const STUDY: &str =
    "\n[study]\nbrushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1.0e-3, 2.0e-3]\n";

#[test]
fn a_brush_is_written_and_drawn() {
    let workspace = Workspace::with(FILE);
    let vtk = if cfg!(feature = "vtk") {
        "--vtk=11"
    } else {
        ""
    };
    let said = workspace.told(&format!("simulate case.toml --out out {vtk}"));
    has(
        &said,
        &["8 columns in 1 row; 0 to 7 count", "interaction factor 0."],
    );
    assert!(
        said.lines().all(|line| line.chars().count() <= 80),
        "{said}"
    );

    let metrics = workspace.json("out/metrics.json");
    let has = |key: &&str| metrics.get(key).is_some();
    // Without coefficients, metrics of removal are unknown.
    let having = Having {
        brush: true,
        force: true,
        edge: true,
        ..Having::default()
    };
    let common: Vec<&str> = metric_columns(having).map(|column| column.key).collect();
    assert!(
        common.iter().all(has) && keys::<Interaction>().iter().all(has),
        "{metrics:?}"
    );
    // Metrics that a brush lacks are in no file.
    let of_contact = metric_columns(Having {
        brush: false,
        ..having
    })
    .map(|column| column.key);
    let lacking: Vec<&str> = of_contact
        .filter(|key| !common.contains(key) && !keys::<Interaction>().contains(key))
        .collect();
    for file in ["metrics.json", "filaments.csv", "brush.html"] {
        let text = workspace.read(&format!("out/{file}"));
        assert!(
            lacking
                .iter()
                .all(|key| !text.contains(&format!("\"{key}\""))
                    && !text.contains(&format!(",{key},"))),
            "{file}"
        );
    }
    assert!(!said.contains("amplification"), "{said}");
    assert!(
        metrics["impulse_error_estimate"]
            .as_f64()
            .is_some_and(|error| error < 3e-3),
        "{metrics:?}"
    );
    assert!(
        metrics["energy_residual"]
            .as_f64()
            .is_some_and(|residual| residual < 1e-2),
        "{metrics:?}"
    );
    let filaments = workspace.rows("out/filaments.csv");
    assert_eq!(filaments.len(), 8);
    let mean = filaments
        .iter()
        .map(|row| number(row, "contact_normal_impulse_n_s"))
        .sum::<f64>()
        / 8.0;
    let [of_tool, alone, factor] = [
        "contact_normal_impulse_n_s",
        "contact_normal_impulse_alone_n_s",
        "interaction_factor",
    ]
    .map(|key| metrics[key].as_f64().expect(key));
    // Sums in another order.
    assert!((mean / of_tool - 1.0).abs() < 1e-12 && (of_tool / alone / factor - 1.0).abs() < 1e-12);
    assert!(
        filaments
            .iter()
            .enumerate()
            .all(|(column, row)| number(row, "column") == column as f64)
    );

    let history = workspace.rows("out/history.csv");
    assert!(
        history
            .iter()
            .any(|row| number(row, "touching_pairs") > 0.0)
    );
    assert!(!workspace.rows("out/contacts.csv").is_empty());
    let page = workspace.read("out/brush.html");
    assert!(
        page.contains("The sector in motion") && page.matches("<img ").count() == 4,
        "figures"
    );

    if cfg!(feature = "vtk") {
        let frames = workspace
            .files("out")
            .into_keys()
            .filter(|name| name.starts_with("vtk/brush_"))
            .count();
        assert!((5..=11).contains(&frames), "{frames}");
        let collection = workspace.read("out/vtk/brush.pvd");
        // Each frame with the workpiece.
        assert_eq!(collection.matches("<DataSet ").count(), 2 * frames);
        workspace.has_file("out/vtk/workpiece.vtp");
    }
    assert!(!workspace.path("out/checkpoint.bin").exists());
}

/// No file can grow beyond a block: writing of state and results fails, but the simulation ends
/// regularly.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_does_not_end_a_brush() {
    let workspace = Workspace::with(FILE);
    let script =
        "trap '' XFSZ\nulimit -f 1\nexec \"$0\" simulate case.toml --out out --checkpoint-every 0";
    let mut command = Command::new("sh");
    command
        .args(["-c", script, env!("CARGO_BIN_EXE_bristle")])
        .current_dir(workspace.path(""));
    let output = command.output().expect("there is a shell");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        said.matches("warning: cannot write `out/checkpoint.bin`: File too large")
            .count(),
        1,
        "{said}"
    );
    has(
        &said,
        &[
            "the simulation goes on",
            "error: cannot write `out/metrics.json`",
        ],
    );
}

#[test]
fn plot_draws_a_saved_brush_to_the_same_bytes() {
    let workspace = Workspace::with(FILE);
    workspace.run("simulate case.toml --out out");
    let before = workspace.files("out");
    fs::remove_dir_all(workspace.path("out/figures")).expect("figures");
    workspace.run("report out");
    assert!(workspace.files("out") == before);
    // Files of another brush.
    let text = workspace
        .read("out/filaments.csv")
        .replacen("\n0,0,", "\n1,0,", 1);
    workspace.write("out/filaments.csv", text);
    workspace.refuses("report out", &["filaments.csv"]);
}

#[test]
fn neither_threads_nor_frames_change_a_result() {
    let workspace = Workspace::with(FILE);
    let tables = [
        "metrics.json",
        "filaments.csv",
        "history.csv",
        "contacts.csv",
    ];
    let results = |arguments: &str| {
        workspace.run(arguments);
        tables.map(|name| workspace.read(&format!("out/{name}")))
    };
    let one = results("simulate case.toml --out out --threads 1");
    let three = format!("simulate case.toml --out out --threads 3 {VTK}");
    assert!(one == results(&three));
}

#[test]
fn a_brush_and_a_contact_replace_each_other() {
    let workspace = Workspace::with(FILE);
    workspace.run("simulate case.toml --out out");
    workspace.run("simulate case.toml --out out --alone");
    let files = workspace.files("out");
    for part in ["brush", "filaments", "contacts"] {
        assert!(
            !files.keys().any(|name| name.contains(part)),
            "{:?}",
            files.keys()
        );
    }
    workspace.run("simulate case.toml --out out");
    let files = workspace.files("out");
    for name in ["case.json", "shapes.csv", "figures/history.svg"] {
        assert!(!files.contains_key(name), "{name}");
    }
    workspace.run("report out");
}

#[test]
fn a_killed_brush_ends_with_the_same_bytes() {
    let undisturbed = Workspace::with(&longer());
    undisturbed.run("simulate case.toml --out out");
    let workspace = Workspace::with(&longer());
    let checkpoint = workspace.path("out/checkpoint.bin");
    for _ in 0..3 {
        let before = fs::read(&checkpoint).ok();
        let mut command =
            workspace.process("simulate case.toml --out out --checkpoint-every 0 --threads 1");
        let mut child = command
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        // Until there is another checkpoint.
        while child.try_wait().expect("the process is ours").is_none()
            && fs::read(&checkpoint).ok() == before
        {
            sleep(Duration::from_millis(1));
        }
        kill(child);
        assert!(
            !workspace.path("out/metrics.json").exists(),
            "it has been killed before its end"
        );
    }
    let said = workspace.told("simulate case.toml --out out");
    assert!(
        said.contains(
            "% of the brush are in `out/checkpoint.bin`, the simulation resumes from there"
        ),
        "{said}"
    );
    assert!(workspace.files("out") == undisturbed.files("out"));
}

/// Returns a sector that takes long enough to be stopped.
fn longer() -> String {
    FILE.replace("columns = 8", "columns = 60")
        .replace("segments = 4", "segments = 10")
}

#[cfg(unix)]
#[test]
fn an_interrupted_brush_says_how_to_resume() {
    if ignores_interrupts() {
        return;
    }
    let slow = longer()
        .replace("10.0", "2.5")
        .replace("segments = 10", "segments = 25")
        .replace("columns = 60", "columns = 240");
    let workspace = Workspace::with(&slow);
    let mut command = workspace.process("simulate case.toml --out out --checkpoint-every 0");
    let child = command
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    while !workspace.path("out/checkpoint.bin").exists() {
        sleep(Duration::from_millis(1));
    }
    interrupt(&child);
    let output = child.wait_with_output().expect("the process is ours");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(130), "{said}");
    has(
        &said,
        &["stopped: ", "run the same command again to resume"],
    );

    // A checkpoint of other settings, which is kept, and a damaged one.
    let mut bytes = fs::read(workspace.path("out/checkpoint.bin")).expect("a checkpoint");
    workspace.write("case.toml", FILE);
    let said = workspace.told("simulate case.toml --out out");
    has(&said, &["are kept in `out/previous`"]);
    let kept = fs::read(workspace.path("out/previous/checkpoint.bin"));
    assert!(kept.is_ok_and(|kept| kept == bytes));
    workspace.write("case.toml", &slow);
    *bytes.last_mut().expect("bytes") ^= 1;
    workspace.write("out/checkpoint.bin", &bytes);
    workspace.refuses(
        "simulate case.toml --out out",
        &[
            "cannot resume from `out/checkpoint.bin`: it is damaged",
            "--restart",
        ],
    );
    workspace.write("out/checkpoint.bin", "mine");
    workspace.refuses(
        "simulate case.toml --out out --restart",
        &["it is not the checkpoint of a brush"],
    );
    workspace.write("case.toml", FILE);
    workspace.write("out/checkpoint.bin", &bytes);
    workspace.run("simulate case.toml --out out --restart");
}

#[test]
fn brushes_that_cannot_be_are_refused() {
    let mut messages = String::new();
    for (old, new) in [
        ("columns = 8", "columns = 0"),
        ("columns = 8", "colums = 8"),
        ("rows = 1", "pattern = \"hexagonal\""),
        ("rows = 1", "tolerance = 1.0"),
        ("steady = false", "stiffness_n_m2 = -1.0"),
        ("columns = 8", "columns = 5000"),
        ("filament_count = 682", "filament_count = 900"),
    ] {
        assert!(FILE.contains(old), "{old}");
        let workspace = Workspace::with(&FILE.replacen(old, new, 1));
        let message = workspace.refused("simulate case.toml --out out");
        assert!(!workspace.path("out/metrics.json").exists());
        messages += &format!("-- {new}\n{message}\n");
    }
    assert_snapshot!("brushes", messages);
    let workspace = Workspace::with(FILE);
    workspace.refuses("simulate case.toml --out out --memory 1", &["MB of memory"]);
}

#[test]
fn a_study_of_brushes_has_both_forces_and_resumes() {
    let workspace = Workspace::with(&format!("{FILE}{STUDY}"));
    let said = workspace.told("study case.toml --out out --threads 2 --tables all");
    has(&said, &["F_n,w alone in N", "interaction factor"]);
    let runs = workspace.rows("out/runs.csv");
    assert_eq!(runs.len(), 4);
    for row in &runs {
        let [force, alone, factor] = [
            "tool_contact_normal_force_n",
            "tool_contact_normal_force_alone_n",
            "interaction_factor",
        ]
        .map(|key| number(row, key));
        assert!(
            (force / alone / factor - 1.0).abs() < 1e-12 && row["status"] == "ok",
            "{row:?}"
        );
    }
    let names: Vec<String> = workspace.files("out").into_keys().collect();
    for name in [
        "interaction_over_velocity",
        "interaction_factor_map",
        "tool_force_map",
    ] {
        assert!(names.contains(&format!("figures/{name}.svg")), "{names:?}");
    }
    assert!(
        workspace
            .read("out/report.html")
            .contains("\"interaction_factor\"")
    );

    // A journal without its last two cases.
    let before = workspace.files("out");
    let journal = workspace.read("out/journal.jsonl");
    let kept: String = journal.split_inclusive('\n').take(3).collect();
    workspace.write("out/journal.jsonl", kept);
    let said = workspace.told("study case.toml --out out --threads 1");
    assert!(
        said.contains("2 of 4 cases are in `out/journal.jsonl`, 2 remain"),
        "{said}"
    );
    for (name, content) in workspace.files("out") {
        assert!(
            name == "journal.jsonl" || before[&name] == content,
            "{name} differs"
        );
    }
    // The case equals that of the command.
    workspace.run("simulate case.toml --out one");
    assert_eq!(
        workspace.number("one/metrics.json", "interaction_factor"),
        number(&runs[0], "interaction_factor")
    );
    workspace.run("report out");
    workspace.run("advise out");
}

#[test]
fn a_study_of_brushes_that_cannot_be_is_refused_before_its_first_case() {
    let refused = |study: &str, options: &str, expected: &[&str]| {
        let workspace = Workspace::with(&format!("{FILE}\n[study]\n{study}\n"));
        workspace.refuses(&format!("study case.toml --out out {options}"), expected);
        assert!(!workspace.path("out").exists(), "nothing is written");
    };
    let columns = "\"brush.columns\" = [8, 5000]";
    refused(
        columns,
        "",
        &[
            "case.toml: case 2 of the study: `brush.columns` is 5000",
            "682 filaments around",
        ],
    );
    let rows = "\"brush.rows\" = [1, 2, 100]";
    refused(
        rows,
        "",
        &[
            "case 3 of the study: ",
            "has 6 filaments around",
            "`brush.rows`",
        ],
    );
    let count = "\"tool.filament_count\" = [682, 900]";
    refused(
        count,
        "",
        &[
            "case 2 of the study: filaments overlap",
            "`tool.filament_count`",
        ],
    );
    let velocity = "brushing_velocity_m_s = [10.0, 20.0]";
    refused(
        velocity,
        "--memory 1",
        &[
            "case 1 of the study: 8 filaments of 4 segments need about",
            "MB of memory",
        ],
    );
    // There is room for one case at a time.
    let at_once = [
        "2 cases at once need up to",
        "but 17 MB may be used: choose fewer `--threads`",
    ];
    refused(velocity, "--memory 17 --threads 2", &at_once);
    let workspace = Workspace::with(&format!("{FILE}\n[study]\n{velocity}\n"));
    workspace.run("study case.toml --out out --memory 17 --threads 1");
}

/// With uncertain filaments, each filament of a brush differs, and no tools are sampled.
#[test]
fn filaments_of_a_brush_differ_instead_of_tools() {
    let uncertainty = "[uncertainty]\nhold = \"machine\"\nyoungs_modulus_std_pa = 0.3e9\n";
    let workspace = Workspace::with(&format!("{FILE}{uncertainty}{STUDY}"));
    workspace.run("study case.toml --out out");
    let runs = workspace.rows("out/runs.csv");
    assert!(runs.iter().all(
        |row| number(row, "interaction_factor") > 0.0 && !row.contains_key("tool_force_mean_n")
    ));
    workspace.run("simulate case.toml --out out");
    let differing = workspace.read("out/filaments.csv");
    workspace.write("case.toml", FILE);
    workspace.run("simulate case.toml --out out");
    assert!(workspace.read("out/filaments.csv") != differing);
}

#[test]
fn deviations_from_brush_to_brush_give_an_interval() {
    let uncertainty = "[uncertainty]\nyoungs_modulus_std_pa = 0.6e9\n";
    let workspace = Workspace::with(&format!("{FILE}{uncertainty}{STUDY}"));
    let printed = workspace.printed("study case.toml --out out");
    has(&printed, &["95 %", "The scatter of F_n,w comes from: "]);
    for row in workspace.rows("out/runs.csv") {
        let [lower, median, upper] = ["lower_95", "median", "upper_95"]
            .map(|quantile| number(&row, &format!("tool_force_{quantile}_n")));
        let force = number(&row, "tool_contact_normal_force_n");
        assert!(lower < median && median < upper);
        assert!((median / force - 1.0).abs() < 0.1, "{median}, {force}");
    }
    // One simulation is of the nominal brush, and says so.
    let told = workspace.told("simulate case.toml --out one");
    has(&told, &["one simulation ignores [uncertainty]"]);
    let uncertain = workspace.read("one/filaments.csv");
    workspace.write("case.toml", FILE);
    lacks(
        &workspace.told("simulate case.toml --out one"),
        &["[uncertainty]"],
    );
    assert_eq!(workspace.read("one/filaments.csv"), uncertain);
}

#[test]
fn the_documents_list_every_column_of_a_brush() {
    let section = section(
        include_str!("../../../../docs/results.md"),
        "Results of a brush",
    );
    for column in Interaction::COLUMNS {
        has(section, &[&documented(column)]);
    }
    let workspace = Workspace::with(FILE);
    workspace.run("simulate case.toml --out out");
    for name in ["filaments.csv", "history.csv", "contacts.csv"] {
        let text = workspace.read(&format!("out/{name}"));
        let heading = text.lines().next().expect("a heading");
        for key in heading
            .split(',')
            .filter(|key| !keys::<Metrics>().contains(key))
        {
            assert!(section.contains(&format!("`{key}`")), "{name}: {key}");
        }
    }
}

#[test]
fn the_example_is_a_brush_and_a_study() {
    let example = include_str!("../../../../examples/brush.toml");
    // The example states every key with a default value.
    assert_eq!(settings(example).brush, Some(BrushSettings::default()));
    assert_eq!(study(example).case_count(), 16);
}
