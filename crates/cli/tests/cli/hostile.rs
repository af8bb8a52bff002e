//! Hostile files and surroundings: what they contain reaches neither the terminal nor other files,
//! and nothing waits for them.

use std::fs::{self, File};
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;

use crate::program::{Workspace, has, kill, sparse};

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

/// Longer than any command of these tests takes, on a busy machine.
const LONG: Duration = Duration::from_secs(60);

/// A directory with `case.toml` and `forces.csv`.
fn surroundings() -> Workspace {
    let workspace = Workspace::with(&(SECTIONS.concat() + STUDY));
    workspace.write("measured.toml", SECTIONS.concat() + STUDY + MEASURED);
    workspace.write("forces.csv", format!("{HEADING}10.0,1e-3,100.0,10.0\n"));
    let brush = sparse(&SECTIONS.concat()) + "[brush]\ncolumns = 3\nsteady = false\n";
    workspace.write("brush.toml", brush);
    workspace
}

/// Runs the program on bad input, and expects its message to have some parts.
#[track_caller]
fn refuses(workspace: &Workspace, arguments: &str, parts: &[&str]) {
    has(&message(workspace.bristle(arguments)), parts);
}

/// The message of a command that refuses its input, which cannot drive a terminal and has no
/// endless line.
fn message(mut command: Command) -> String {
    let assert = command
        .timeout(LONG)
        .assert()
        .code(2)
        .stdout("")
        .stderr(contains("error: ").and(contains("panicked").not()));
    let message =
        String::from_utf8(assert.get_output().stderr.clone()).expect("a message in UTF-8");
    let invisible = |letter: char| {
        letter.is_control() && letter != '\n'
            || matches!(letter, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    assert!(!message.contains(invisible), "{message:?}");
    assert!(
        !message
            .lines()
            .any(|line| line.starts_with("error: forged")),
        "{message}"
    );
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
        &["plot", hostile],
        &["advise", hostile],
        &["simulate", "case.toml", hostile],
        &["derive", "--segments", hostile],
        &[hostile],
    ] {
        message(call(arguments));
    }
    workspace.write(&toml, "key = 1\n");
    assert!(
        message(call(&["simulate", &toml, "--out", "results"])).contains(r"\u{202e}\u{7}.toml:1:1")
    );
    workspace.write(&toml, SECTIONS.concat() + STUDY);
    let output = call(&["study", &toml, "--out", hostile, "--json"])
        .assert()
        .success();
    let events = String::from_utf8(output.get_output().stdout.clone()).expect("UTF-8");
    assert!(
        !events
            .contains(|letter: char| letter.is_control() && letter != '\n' || letter == '\u{202e}'),
        "{events}"
    );
    let page = workspace.read(&format!("{hostile}/report.html"));
    let (_, title) = page.split_once("<title>").expect("a title");
    let (title, _) = title.split_once("</title>").expect("its end");
    assert!(
        title.starts_with(r"\u{1b}[31m\u{9b}2J\u{a}error: forged\u{202e}"),
        "{title}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_stdout_is_an_error() {
    let workspace = surroundings();
    workspace.write(
        "state.json",
        r#"{"base_angle": -1.5, "base_rate": 50, "base_acceleration": 0, "gravity": [0, 0, 0], "q": [1.5, 0], "v": [0, 0]}"#,
    );
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
        "schema",
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
        assert!(
            message.contains("error: cannot write to stdout: "),
            "{arguments}: {message}"
        );
    }
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    for arguments in ["--help", "derive --segments 12", "schema"] {
        let workspace = Workspace::new();
        let mut command = workspace.process(arguments);
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("the program ends");
        assert!(
            output.status.success() && output.stderr.is_empty(),
            "{arguments}: {output:?}"
        );
    }
}

#[test]
fn a_killed_command_leaves_nothing_for_long() {
    let workspace = surroundings();
    workspace.run("simulate case.toml --out one --vtk=2");
    let names = || ["one", "one/figures", "one/vtk"].map(|directory| workspace.names(directory));
    let clean = names();
    let leftovers = [
        "one/.metrics.json.bristle-a1B2c3",
        "one/.case.json.bristle-a1B2c3",
        "one/.probe.bristle-a1B2c3",
        "one/figures/.history.svg.bristle-zzzzzz",
        "one/vtk/.filament_0001.vtp.bristle-000000",
    ];
    leftovers
        .iter()
        .for_each(|name| workspace.write(name, "half"));
    // While another process writes there, these files may be its own.
    let other = File::open(workspace.path("one")).expect("the directory");
    other.lock_shared().expect("a lock");
    workspace.run("simulate case.toml --out one --vtk=2");
    assert!(
        leftovers.iter().all(|name| workspace.path(name).exists()),
        "{:?}",
        workspace.names("one")
    );
    drop(other);
    workspace.run("simulate case.toml --out one --vtk=2");
    assert_eq!(names(), clean);

    // Files that no command of this name writes stay.
    let foreign = [
        ".metrics.json.bristle-",
        ".metrics.json.bristle-a1B2c3d",
        ".mine.txt.bristle-a1B2c3",
        "a.bristle-a1B2c3",
    ];
    foreign
        .iter()
        .for_each(|name| workspace.write(&format!("one/{name}"), "mine"));
    workspace.write("one/figures/.history.svg.bristle-zzzzzz", "half");
    workspace.write(".equations.txt.bristle-a1B2c3", "half");
    workspace.run("simulate case.toml --out one --vtk=2");
    workspace.run("derive --segments 1 --out equations.txt");
    assert!(
        foreign
            .iter()
            .all(|name| workspace.path("one").join(name).exists())
    );
    assert_eq!(workspace.names("one/figures"), clean[1]);
    assert!(!workspace.path(".equations.txt.bristle-a1B2c3").exists());
}

/// Kills `simulate` while it writes.
#[test]
fn a_case_survives_a_kill() {
    let workspace = surroundings();
    workspace.run("simulate case.toml --out one");
    let names = workspace.names("one");
    for _ in 0..5 {
        let mut command = workspace.process("simulate case.toml --out one --samples 100000");
        let mut child = command
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let temporary = |name: &String| name.starts_with('.') && !name.starts_with(".probe");
        while child.try_wait().expect("the process is ours").is_none()
            && !workspace.names("one").iter().any(temporary)
        {}
        kill(child);
    }
    workspace.run("simulate case.toml --out one");
    assert_eq!(workspace.names("one"), names);
    workspace.run("plot one");
}

#[test]
fn results_of_two_cases_are_not_drawn_as_one() {
    let workspace = surroundings();
    workspace.run("simulate case.toml --out one --vtk=2");
    workspace.write("other.toml", SECTIONS.concat().replace("10.0", "11.0"));
    workspace.run("simulate other.toml --out two --vtk=2");
    for name in [
        "history.csv",
        "profile.csv",
        "shapes.csv",
        "metrics.json",
        "vtk/contact.pvd",
        "vtk/filament_0001.vtp",
    ] {
        let [one, two] = ["one", "two"].map(|directory| format!("{directory}/{name}"));
        let own = workspace.read(&one);
        workspace.write(&one, workspace.read(&two));
        let expected = format!("{one}:1: case.json does not belong to these results");
        refuses(
            &workspace,
            "plot one --out drawn",
            &[&expected, "help: run the command"],
        );
        workspace.write(&one, own);
    }
    workspace.run("plot one --out drawn");
    // Drawing does not need the shapes.
    fs::remove_dir_all(workspace.path("one/vtk")).expect("the directory is ours");
    workspace.run("plot one --out drawn");
}

#[cfg(unix)]
#[test]
fn links_in_place_of_results_are_refused() {
    use std::os::unix::fs::symlink;

    let workspace = surroundings();
    let study = [
        "runs.csv",
        "study.json",
        "report.html",
        "journal.jsonl",
        "measured.csv",
        "measured_comparison.csv",
    ];
    let files = |command: &str| match command {
        "study measured.toml" => [&study[..], &["figures/impulse_map.svg"]].concat(),
        "brush brush.toml" => vec!["filaments.csv", "checkpoint.bin"],
        _ => {
            let tables = ["history.csv", "profile.csv", "shapes.csv"];
            [
                &tables[..],
                &[
                    "metrics.json",
                    "case.json",
                    "figures/history.png",
                    "vtk/contact.pvd",
                ],
            ]
            .concat()
        }
    };
    fs::create_dir(workspace.path("outside")).expect("a directory");
    for command in [
        "study measured.toml",
        "simulate case.toml --vtk",
        "brush brush.toml",
    ] {
        for name in files(command) {
            for target in ["kept", "absent"] {
                workspace.write("outside/kept", "kept");
                let link = workspace.path("results").join(name);
                fs::create_dir_all(link.parent().expect("a directory")).expect("a directory");
                symlink(workspace.path("outside").join(target), &link).expect("a link");
                refuses(
                    &workspace,
                    &format!("{command} --out results"),
                    &[name, "it is a symbolic link"],
                );
                assert_eq!(workspace.names("outside"), ["kept"]);
                assert_eq!(workspace.read("outside/kept"), "kept");
                fs::remove_file(&link).expect("the link is still there");
                fs::remove_dir_all(workspace.path("results")).expect("the directory is ours");
            }
        }
    }
    for (name, command) in [
        ("figures", "study case.toml"),
        ("figures", "simulate case.toml"),
        ("vtk", "simulate case.toml --vtk"),
    ] {
        fs::create_dir(workspace.path("results")).expect("a directory");
        symlink(
            workspace.path("outside"),
            workspace.path("results").join(name),
        )
        .expect("a link");
        refuses(
            &workspace,
            &format!("{command} --out results"),
            &[name, "it is a symbolic link"],
        );
        assert_eq!(workspace.names("outside"), ["kept"]);
        fs::remove_dir_all(workspace.path("results")).expect("the directory is ours");
    }
    symlink(
        workspace.path("outside/kept"),
        workspace.path("equations.txt"),
    )
    .expect("a link");
    refuses(
        &workspace,
        "derive --segments 1 --out equations.txt",
        &["it is a symbolic link"],
    );
    assert_eq!(workspace.read("outside/kept"), "kept");
    // The directory of the results is chosen by the user, who may name it by a link.
    symlink(workspace.path("outside"), workspace.path("elsewhere")).expect("a link");
    workspace.run("simulate case.toml --out elsewhere");
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_waited_for() {
    let workspace = surroundings();
    let made = Process::new("mkfifo")
        .arg(workspace.path("pipe"))
        .status()
        .expect("mkfifo starts");
    assert!(made.success());
    workspace.write(
        "piped.toml",
        SECTIONS.concat() + STUDY + "[measured]\nfile = \"pipe\"\n",
    );
    workspace.write(
        "endless.toml",
        SECTIONS.concat() + STUDY + "[measured]\nfile = \"/dev/zero\"\n",
    );
    fs::create_dir(workspace.path("saved")).expect("a directory");
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
        "plot saved",
        "advise saved",
    ] {
        refuses(&workspace, arguments, &["it is not a regular file"]);
    }
    // Neither is one in the place of a result.
    for (command, result) in [
        ("study case.toml", "journal.jsonl"),
        ("brush brush.toml", "checkpoint.bin"),
    ] {
        let path = workspace.path("results").join(result);
        let make: [&dyn Fn() -> bool; 2] = [
            &|| {
                let status = Process::new("mkfifo").arg(&path).status();
                status.expect("mkfifo starts").success()
            },
            &|| fs::create_dir(&path).is_ok(),
        ];
        for make in make {
            fs::create_dir(workspace.path("results")).expect("a directory");
            assert!(make());
            refuses(&workspace, &format!("{command} --out results"), &[result]);
            fs::remove_dir_all(workspace.path("results")).expect("the directory is ours");
        }
    }
    // What the caller has opened is read.
    let input = SECTIONS.concat();
    workspace
        .bristle("simulate /dev/stdin --out results")
        .write_stdin(input)
        .assert()
        .success();
}

#[test]
fn repeated_headings_and_huge_forces_are_refused() {
    let workspace = surroundings();
    for (text, expected) in [
        (
            format!("force_n,{HEADING}1,1,1,1,1\n"),
            "forces.csv:1: columns 1 and 4 are both named `force_n`",
        ),
        (
            format!("{HEADING}10,1e-3,1e308,1\n20,1e-3,-1e308,1\n"),
            "forces.csv:2, column force_n: `1e308`",
        ),
    ] {
        workspace.write("forces.csv", text);
        refuses(&workspace, "study measured.toml --out results", &[expected]);
    }
    workspace.write(
        "forces.csv",
        format!("{HEADING}10,1e-3,1e100,1\n20,1e-3,-1e100,1\n"),
    );
    let finite = contains("RMSE 1.00e100 N").and(contains("inf").not());
    workspace
        .bristle("study measured.toml --out results")
        .assert()
        .success()
        .stdout(finite);
}

/// Every combination of missing sections and keys.
#[test]
fn what_is_missing_is_named_with_its_place_and_an_example() {
    let workspace = surroundings();
    let lines: [(&str, &[&str]); 3] = [
        (
            "tool",
            &[
                "body_radius_m = 0.14",
                "width_m = 0.02",
                "filament_count = 10500",
            ],
        ),
        ("filament", &["length_m = 0.04", "diameter_m = 0.00118"]),
        (
            "process",
            &[
                "brushing_velocity_m_s = 10.0",
                "penetration_depth_m = 0.001",
            ],
        ),
    ];
    // For each section: absent, empty, one of two keys, the other, both.
    for state in 1..5_usize.pow(3) {
        let states = [state % 5, state / 5 % 5, state / 25];
        let present = |section: usize, key: usize| {
            states[section] == 4 || states[section] >= 2 && states[section] - 2 == key
        };
        let mut text = String::new();
        for (section, (name, all)) in lines.iter().enumerate() {
            if states[section] > 0 {
                text += &format!("[{name}]\n");
                (0..all.len())
                    .filter(|&key| present(section, key))
                    .for_each(|key| text += &format!("{}\n", all[key]));
            }
        }
        let missing = |section: usize| -> Vec<&str> {
            let all = lines[section].1;
            (0..all.len())
                .filter(|&key| !present(section, key))
                .map(|key| all[key])
                .collect()
        };
        if (0..3).all(|section| missing(section).is_empty()) {
            continue;
        }
        workspace.write("case.toml", &text);
        let message = message(workspace.bristle("simulate case.toml --out results"));
        check_missing(&message, &text, &lines, states, missing);
    }
}

/// Checks a message about missing sections, or else about the first section with missing keys.
fn check_missing<'l>(
    message: &str,
    text: &str,
    lines: &[(&str, &[&str]); 3],
    states: [usize; 3],
    missing: impl Fn(usize) -> Vec<&'l str>,
) {
    let absent: Vec<usize> = (0..3).filter(|&section| states[section] == 0).collect();
    let named = if absent.is_empty() {
        let first = (0..3)
            .find(|&section| !missing(section).is_empty())
            .expect("something is missing");
        let key = missing(first)[0].split(' ').next().expect("a key");
        assert!(
            message.starts_with(&format!("error: `{}.{key}` is missing", lines[first].0)),
            "{text}\n{message}"
        );
        let heading = format!("[{}]", lines[first].0);
        let line = text
            .lines()
            .position(|line| line == heading)
            .expect("a heading")
            + 1;
        assert!(
            message.contains(&format!("case.toml:{line}:1")),
            "{text}\n{message}"
        );
        assert!(
            message.contains(&format!("help: add under {heading}")),
            "{text}\n{message}"
        );
        vec![first]
    } else {
        let (first, _) = message.split_once('\n').expect("several lines");
        assert!(
            first.starts_with("error: the section") && first.ends_with("missing"),
            "{text}\n{message}"
        );
        for (section, (name, _)) in lines.iter().enumerate() {
            assert_eq!(
                first.contains(&format!("[{name}]")),
                absent.contains(&section),
                "{text}\n{message}"
            );
        }
        assert!(
            message.contains("help: add at the end of the file"),
            "{text}\n{message}"
        );
        absent
    };
    for line in named.iter().flat_map(|&section| missing(section)) {
        assert!(
            message
                .lines()
                .any(|shown| shown.trim_start().starts_with(line)),
            "{line}\n{text}\n{message}"
        );
    }
    assert!(!message.contains("but must be"), "{message}");
    assert!(
        message
            .lines()
            .skip(1)
            .all(|line| line.chars().count() <= 80),
        "{message}"
    );
}

#[test]
fn missing_sections_are_named_by_all_commands() {
    let workspace = surroundings();
    workspace.write("state.json", "{}");
    let [tool, filament, process, _] = SECTIONS;
    let [study, evaluate, simulate] = [
        "study case.toml --out results",
        "evaluate case.toml --state state.json",
        "simulate case.toml --out results",
    ];
    let (velocity, swept) = (
        "[process]\nbrushing_velocity_m_s = 1.0\n",
        "[study]\nbrushing_velocity_m_s = [1.0]\n",
    );
    for (sections, command, expected) in [
        (
            &[filament, process, STUDY][..],
            study,
            "the section [tool] is missing",
        ),
        (
            &[tool, process, STUDY],
            study,
            "the section [filament] is missing",
        ),
        (
            &[tool, filament, swept],
            study,
            "the section [process] is missing",
        ),
        (
            &[tool, filament, velocity, swept],
            study,
            "`process.penetration_depth_m` is missing",
        ),
        (&SECTIONS, study, "`study` is missing"),
        (
            &[],
            evaluate,
            "the sections [tool] and [filament] are missing",
        ),
        (&[tool], evaluate, "the section [filament] is missing"),
        (
            &[STUDY],
            simulate,
            "the sections [tool], [filament] and [process] are missing",
        ),
    ] {
        workspace.write("case.toml", sections.concat());
        refuses(&workspace, command, &[expected]);
    }
    // A study needs no [process] if it sweeps both.
    workspace.write("case.toml", format!("{tool}{filament}{STUDY}"));
    workspace.run(study);
}

/// The tree of an input file takes many times its length, so 60 MB filled 4.5 GB.
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

#[test]
fn ordinary_names_are_shown_as_they_are() {
    let workspace = surroundings();
    let name = "Bürste – Versuch 1 (µ = 0,3).toml";
    workspace.write(name, "key = 1\n");
    let mut command = workspace.bristle("simulate --out results");
    command.arg(name);
    assert!(message(command).contains(&format!("--> {name}:1:1")));
}
