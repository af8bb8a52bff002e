//! Hostile files and surroundings: their content reaches neither the terminal nor other files, and
//! no command waits for them.

use std::fs::{self, File};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;

use crate::commands::STATE;
use crate::program::{VTK, Workspace, has, lacks, sparse};

/// A small and quick case, section by section.
const SECTIONS: [&str; 4] = [
    "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\nfilament_count_uncertainty = 600\n",
    "[filament]\nsegments = 3\nlength_m = 0.040\ndiameter_m = 1.18e-3\n",
    "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1.0e-3\n",
    "[solver]\nrelative_tolerance = 1e-3\nsamples = 20\n",
];
const STUDY: &str =
    "[study]\nbrushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [0.5e-3, 1.5e-3]\n";
const MEASURED: &str = "[measured]\nfile = \"forces.csv\"\n";
const HEADING: &str = "brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n";

/// Characters that drive a terminal.
const DRIVING: [&str; 4] = ["\u{1b}", "\u{9b}", "\u{7}", "\u{202e}"];

/// Maximum duration of a command of these tests, on a busy machine.
const MAX_COMMAND_TIME: Duration = Duration::from_secs(60);

/// Returns a directory with `case.toml` and `forces.csv`.
fn surroundings() -> Workspace {
    let workspace = Workspace::with(&(SECTIONS.concat() + STUDY));
    workspace.write("measured.toml", SECTIONS.concat() + STUDY + MEASURED);
    workspace.write("forces.csv", format!("{HEADING}10.0,1e-3,100.0,10.0\n"));
    let brush = sparse(&SECTIONS.concat()) + "[brush]\ncolumns = 3\nsteady = false\n";
    workspace.write("brush.toml", brush);
    workspace
}

/// Runs the program on bad input, and expects these parts in its message.
#[track_caller]
fn refuses(workspace: &Workspace, arguments: &str, parts: &[&str]) {
    has(&message(workspace.bristle(arguments)), parts);
}

/// Returns the message of a command that refuses its input. The message cannot drive a terminal and
/// has no endless line.
fn message(mut command: Command) -> String {
    let assert = command
        .timeout(MAX_COMMAND_TIME)
        .assert()
        .code(2)
        .stdout("")
        .stderr(contains("error: ").and(contains("panicked").not()));
    let message =
        String::from_utf8(assert.get_output().stderr.clone()).expect("a message in UTF-8");
    lacks(&message, &DRIVING);
    lacks(&format!("\n{message}"), &["\nerror: forged"]);
    assert!(
        message.lines().all(|line| line.chars().count() < 1000),
        "{message}"
    );
    message
}

#[cfg(unix)]
#[test]
fn names_of_files_cannot_drive_the_terminal() {
    let workspace = surroundings();
    let hostile = "\u{1b}[31m\u{9b}2J\nerror: forged\u{202e}\u{7}";
    let call = |arguments: &[&str]| {
        let mut command = workspace.bristle("");
        command.args(arguments);
        command
    };
    let toml = format!("{hostile}.toml");
    for arguments in [
        &["simulate", &toml, "--out", "results"][..],
        &["study", &toml, "--out", "results"],
        &["evaluate", "case.toml", "--state", hostile],
        &["compare", hostile],
        &["report", hostile],
        &["advise", hostile],
        &["simulate", "case.toml", hostile],
        &["derive", "--segments", hostile],
        &[hostile],
    ] {
        message(call(arguments));
    }
    // Ordinary names are shown unchanged.
    for (name, shown) in [
        (&*toml, r"\u{202e}\u{7}.toml:1:1"),
        (
            "Bürste – Versuch 1 (µ = 0,3).toml",
            "--> Bürste – Versuch 1 (µ = 0,3).toml:1:1",
        ),
    ] {
        workspace.write(name, "key = 1\n");
        has(
            &message(call(&["simulate", name, "--out", "results"])),
            &[shown],
        );
    }
    workspace.write(&toml, SECTIONS.concat() + STUDY);
    let output = call(&["study", &toml, "--out", hostile, "--json"])
        .assert()
        .success();
    let events = String::from_utf8(output.get_output().stdout.clone()).expect("UTF-8");
    lacks(&events, &DRIVING);
    let page = workspace.read(&format!("{hostile}/report.html"));
    let (_, title) = page.split_once("<title>").expect("a title");
    assert!(title.starts_with(r"\u{1b}[31m\u{9b}2J\u{a}error: forged\u{202e}"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_stdout_is_an_error() {
    let workspace = surroundings();
    workspace.write("state.json", STATE);
    workspace.run("study case.toml --out results");
    let graph = format!(
        "compare {}/../../derivations/graphs/chain_1.json --states 1",
        env!("CARGO_MANIFEST_DIR")
    );
    for arguments in [
        "--help",
        "--version",
        "help study",
        "study --help",
        "explain --schema",
        "derive --segments 1",
        "derive --kernels --format json",
        "evaluate case.toml --state state.json",
        "advise results",
        "advise results --json",
        "study case.toml --out results --json",
        &graph,
    ] {
        let full = File::options()
            .write(true)
            .open("/dev/full")
            .expect("Linux has it");
        let output = workspace
            .process(arguments)
            .stdout(full)
            .output()
            .expect("the program starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {message}");
        has(&message, &["error: cannot write to stdout: "]);
    }
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let workspace = surroundings();
    for arguments in [
        "--help",
        "derive --segments 12",
        "explain --schema",
        "study case.toml --out results --json",
    ] {
        let mut command = workspace.process(arguments);
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("the program ends");
        assert!(output.status.success(), "{arguments}: {output:?}");
    }
}

#[test]
fn a_killed_command_leaves_nothing_for_long() {
    let workspace = surroundings();
    let simulate = format!("simulate case.toml --out one {VTK}");
    workspace.make("one/vtk");
    workspace.run(&simulate);
    let names = || ["one", "one/figures", "one/vtk"].map(|directory| workspace.names(directory));
    let clean = names();
    let leftovers = [
        "one/.metrics.json.bristle-a1B2c3",
        "one/.case.json.bristle-a1B2c3",
        "one/.probe.bristle-a1B2c3",
        "one/figures/.history.svg.bristle-zzzzzz",
        "one/vtk/.filament_0001.vtp.bristle-000000",
    ];
    let write = |names: &[&str]| names.iter().for_each(|name| workspace.write(name, "half"));
    let present = |names: &[&str]| {
        let present = names.iter().filter(|name| workspace.path(name).exists());
        present.count()
    };
    write(&leftovers);
    // While another process writes there, these files may belong to it.
    let other = File::open(workspace.path("one")).expect("the directory");
    other.lock_shared().expect("a lock");
    workspace.run(&simulate);
    assert_eq!(present(&leftovers), leftovers.len());
    drop(other);
    workspace.run(&simulate);
    assert_eq!(names(), clean);

    // Files that no command of this name writes stay.
    let foreign = [
        "one/.metrics.json.bristle-",
        "one/.metrics.json.bristle-a1B2c3d",
        "one/.mine.txt.bristle-a1B2c3",
        "one/a.bristle-a1B2c3",
    ];
    let own = ".equations.txt.bristle-a1B2c3";
    write(&foreign);
    write(&[own]);
    workspace.run(&simulate);
    workspace.run("derive --segments 1 --out equations.txt");
    assert_eq!(present(&foreign), foreign.len());
    assert_eq!(present(&[own]), 0);
}

#[test]
fn results_of_two_cases_are_not_drawn_as_one() {
    let workspace = surroundings();
    workspace.run(&format!("simulate case.toml --out one {VTK}"));
    workspace.write("other.toml", SECTIONS.concat().replace("10.0", "11.0"));
    workspace.run(&format!("simulate other.toml --out two {VTK}"));
    let for_vtk = ["vtk/contact.pvd", "vtk/filament_0001.vtp"];
    let for_vtk = for_vtk.into_iter().filter(|_| cfg!(feature = "vtk"));
    let tables = ["history.csv", "profile.csv", "shapes.csv", "metrics.json"];
    for name in tables.into_iter().chain(for_vtk) {
        let [one, two] = ["one", "two"].map(|directory| format!("{directory}/{name}"));
        let own = workspace.read(&one);
        workspace.write(&one, workspace.read(&two));
        let expected = format!("{one}:1: case.json does not belong to these results");
        refuses(
            &workspace,
            "report one --out drawn",
            &[&expected, "help: run the command"],
        );
        workspace.write(&one, own);
    }
    workspace.run("report one --out drawn");
    // Drawing does not need the shapes.
    workspace.make("one/vtk");
    workspace.remove("one/vtk");
    workspace.run("report one --out drawn");
}

#[cfg(unix)]
#[test]
fn links_in_place_of_results_are_refused() {
    use std::os::unix::fs::symlink;

    let workspace = surroundings();
    workspace.make("outside");
    let is_refused = |command: &str, name: &str, target: &str| {
        workspace.write("outside/kept", "kept");
        let link = workspace.path("results").join(name);
        fs::create_dir_all(link.parent().expect("a directory")).expect("a directory");
        symlink(workspace.path("outside").join(target), &link).expect("a link");
        let call = format!("{command} --out results");
        refuses(&workspace, &call, &[name, "it is a symbolic link"]);
        assert_eq!(workspace.names("outside"), ["kept"]);
        assert_eq!(workspace.read("outside/kept"), "kept");
        fs::remove_file(&link).expect("the link is still there");
        workspace.remove("results");
    };
    for (command, names) in [
        (
            "study measured.toml",
            "runs.csv study.json report.html journal.jsonl measured.csv measured_comparison.csv figures/impulse_map.svg",
        ),
        (
            "simulate case.toml",
            "history.csv profile.csv shapes.csv metrics.json case.json figures/history.png vtk/contact.pvd",
        ),
        ("simulate brush.toml", "filaments.csv checkpoint.bin"),
    ] {
        for name in names.split(' ') {
            is_refused(command, name, "kept");
            is_refused(command, name, "absent");
        }
    }
    for (command, name) in [
        ("study case.toml", "figures"),
        ("simulate case.toml", "figures"),
        ("simulate case.toml", "vtk"),
    ] {
        is_refused(command, name, "");
    }
    let link = |target: &str, name: &str| {
        symlink(workspace.path(target), workspace.path(name)).expect("a link");
    };
    link("outside/kept", "equations.txt");
    let derive = "derive --segments 1 --out equations.txt";
    refuses(&workspace, derive, &["it is a symbolic link"]);
    assert_eq!(workspace.read("outside/kept"), "kept");
    // The user chooses the directory of the results and may name it by a link.
    link("outside", "elsewhere");
    workspace.run("simulate case.toml --out elsewhere");
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_waited_for() {
    let workspace = surroundings();
    let make_pipe = |name: &str| {
        let status = Process::new("mkfifo").arg(workspace.path(name)).status();
        assert!(status.expect("mkfifo starts").success());
    };
    make_pipe("pipe");
    for (name, measured) in [("piped.toml", "pipe"), ("endless.toml", "/dev/zero")] {
        let measured = MEASURED.replace("forces.csv", measured);
        workspace.write(name, SECTIONS.concat() + STUDY + &measured);
    }
    workspace.make("saved");
    fs::rename(workspace.path("pipe"), workspace.path("saved/study.json")).expect("a name");
    std::os::unix::fs::symlink("saved/study.json", workspace.path("pipe")).expect("a link");
    for arguments in [
        "simulate pipe --out results",
        "study pipe --out results",
        "study piped.toml --out results",
        "study endless.toml --out results",
        "simulate /dev/zero --out results",
        "simulate . --out results",
        "evaluate case.toml --state pipe",
        "compare pipe",
        "report saved",
        "advise saved",
    ] {
        refuses(&workspace, arguments, &["it is not a regular file"]);
    }
    // Links in the place of a result are not followed either.
    for (command, result) in [
        ("study case.toml", "journal.jsonl"),
        ("simulate brush.toml", "checkpoint.bin"),
    ] {
        for is_pipe in [true, false] {
            workspace.make("results");
            let path = format!("results/{result}");
            if is_pipe {
                make_pipe(&path);
            } else {
                workspace.make(&path);
            }
            refuses(&workspace, &format!("{command} --out results"), &[result]);
            workspace.remove("results");
        }
    }
    // Inputs that the caller has opened are read.
    let input = SECTIONS.concat();
    workspace
        .bristle("simulate /dev/stdin --out results")
        .write_stdin(input)
        .assert()
        .success();
}

#[test]
fn missing_sections_are_named_by_all_commands() {
    let workspace = surroundings();
    workspace.write("state.json", "{}");
    let [tool, filament, process, _] = SECTIONS;
    let study = "study case.toml --out results";
    let evaluate = "evaluate case.toml --state state.json";
    let swept = "[study]\nbrushing_velocity_m_s = [1.0]\n";
    for (sections, command, missing) in [
        (&[filament, process, STUDY][..], study, "the section [tool]"),
        (&[tool, filament, swept], study, "the section [process]"),
        (&SECTIONS, study, "`study` is missing"),
        (&[], evaluate, "the sections [tool] and [filament] are"),
    ] {
        workspace.write("case.toml", sections.concat());
        refuses(&workspace, command, &[missing]);
    }
    // A study needs no [process] if it sweeps both.
    workspace.write("case.toml", [tool, filament, STUDY].concat());
    workspace.run(study);
}

/// The tree of an input file takes many times its length: 60 MB filled 4.5 GB.
#[test]
fn large_files_are_refused_or_read_within_bounds() {
    let workspace = surroundings();
    let file = File::create(workspace.path("large.toml")).expect("a file");
    file.set_len(1 << 40).expect("a file with holes");
    workspace.write("long.toml", "#".repeat(5 << 20));
    refuses(
        &workspace,
        "simulate long.toml --out results",
        &["it is longer than 4 MiB"],
    );
    for command in [
        "simulate large.toml --out results",
        "evaluate case.toml --state large.toml",
        "compare large.toml",
    ] {
        refuses(&workspace, command, &["it is longer than"]);
    }
}
