//! Commands on the equations: `evaluate`, `derive` and `compare`.

use std::fs;
use std::process::Command as Process;

use predicates::str::contains;
use serde_json::Value;

use super::{FILE, STATE};
use crate::program::{Workspace, has, is_near, lacks};

#[test]
fn evaluate_prints_the_equations_at_a_state() {
    let workspace = Workspace::new();
    // Without contact, velocity and depth need not be stated.
    let (file, _) = FILE.split_once("[process]").expect("a section");
    workspace.write("case.toml", file);
    workspace.write("state.json", STATE);
    let evaluate = "evaluate case.toml --state state.json";
    let result = workspace.printed_json(evaluate);
    let length = |value: &Value| value.as_array().map(Vec::len);
    let matrix = result["mass_matrix"].as_array().expect("a matrix");
    assert!(matrix.len() == 4 && matrix.iter().all(|row| length(row) == Some(4)));
    assert_eq!(length(&result["accelerations"]), Some(4));
    assert_eq!(length(&result["tip_position_m"]), Some(3));
    for key in ["kinetic_energy_j", "potential_energy_j", "dissipation_w"] {
        assert!(result[key].is_number(), "{key}");
    }
    workspace.write("state.json", STATE.replacen("1.6, -1.4", "null, -1.4", 1));
    workspace.refuses(evaluate, &["state.json", "`q[2]`"]);
}

/// Equations that `derive` can derive, for 1 segment.
const EQUATIONS: [&str; 4] = [
    "--segments 1",
    "--segments 1 --planar",
    "--kernels",
    "--kernels --planar",
];

/// Values of `--format` in `derive` with one text.
const FORMATS: [&str; 8] = [
    "math", "latex", "markdown", "rust", "rust-f64", "json", "numpy", "sympy",
];

/// Values of `--format` with several files, each with one file of the whole equations of motion in
/// space.
const FORMATS_OF_FILES: [(&str, &str); 2] = [("c", "bristle_chain.c"), ("matlab", "one_pass.m")];

/// Two processes print the same bytes.
#[test]
fn derive_prints_or_writes() {
    let workspace = Workspace::new();
    for equations in EQUATIONS.map(|equations| equations.replace('1', "3")) {
        for format in FORMATS {
            let command = format!("derive {equations} --format {format}");
            let printed = workspace.printed(&command);
            assert_eq!(
                workspace.printed(&format!("{command} --out equations.txt")),
                ""
            );
            assert!(workspace.read("equations.txt") == printed, "{command}");
            if format == "rust" {
                let mut header = printed.lines().take_while(|line| line.starts_with("//"));
                let is_hash = |word: &str| {
                    word.len() == 64 && word.chars().all(|digit| digit.is_ascii_hexdigit())
                };
                assert!(header.any(|line| line.rsplit(' ').next().is_some_and(is_hash)));
                has(&printed, &[&format!("bristle {command}\n")]);
            }
        }
    }
    for (format, file) in FORMATS_OF_FILES {
        let command = format!("derive --segments 1 --format {format}");
        workspace.refuses(&command, &["--out DIR"]);
        let [one, two] = ["one", "two"].map(|directory| {
            let directory = format!("{format}/{directory}");
            workspace.run(&format!("{command} --out {directory}"));
            workspace.files(&directory)
        });
        assert!(one == two && one.contains_key(file), "{format}");
    }
    let fragment = "derive --kernels --format latex --fragment";
    has(
        &workspace.printed(fragment),
        &[
            "\\label{eq:",
            &format!("% To make it again: bristle {fragment}\n"),
        ],
    );
    workspace.refuses("derive --kernels --fragment", &["add --format latex"]);
}

/// The command in the header of each form prints the same bytes.
#[test]
fn equations_name_the_command_that_makes_them() {
    let workspace = Workspace::with(FILE);
    let calls = [
        "derive case.toml --format latex",
        "derive case.toml --format latex --fragment --width elsevier",
        "derive case.toml --format markdown",
        "derive case.toml --set filament.segments=2 --format sympy",
        "derive case.toml --format numpy",
        "derive --segments 2 --planar --format rust",
        "derive --kernels --planar --format latex --fragment",
    ];
    let command = |text: &str| {
        let line = text
            .lines()
            .find_map(|line| line.split_once("To make it again: bristle "));
        line.map(|(_, command)| command.to_owned())
    };
    for call in calls {
        let printed = workspace.printed(call);
        let again = command(&printed).unwrap_or_else(|| panic!("{call}"));
        assert!(workspace.printed(&again) == printed, "{call}: {again}");
        has(&printed, &["(built-in derivation)"]);
    }
    for format in ["c", "matlab"] {
        workspace.run(&format!(
            "derive case.toml --format {format} --out {format}"
        ));
        let files = workspace.files(format);
        let again = files
            .values()
            .find_map(|text| command(&String::from_utf8_lossy(text)));
        workspace.run(&again.expect("a header"));
        for (name, text) in &files {
            assert!(workspace.bytes(name) == *text, "{name}");
        }
    }
    has(&workspace.printed("--version"), &["(built-in derivation)"]);
}

/// An environment variable names Octave's program, which not every machine has.
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
        let simulate = |out: &str, options: &str| {
            let call = format!("simulate case.toml --out {out} --no-figures");
            workspace.run(&format!(
                "{call} --set filament.segments={segments} {options}"
            ));
        };
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
            let impulse = printed.trim().parse();
            let impulse = impulse.unwrap_or_else(|_| panic!("{output:?}"));
            let expected = workspace.number(metrics, "contact_normal_impulse_n_s");
            is_near(impulse, expected, 1e-4);
        };
        simulate("one", "--set process.brushing_velocity_m_s=20.0");
        agrees("one_pass(20, 1e-3)", "one/metrics.json");
        simulate(
            "two",
            "--set filament.diameter_m=1e-3 --set tool.body_radius_m=0.1 --set process.gravity_m_s2=[0,-9.81,0]",
        );
        agrees("one_pass('../two/case.json')", "two/metrics.json");
        simulate("two", "--set contact.friction_coefficient=0.3");
        let refused = run("one_pass('../two/case.json')").stderr;
        has(
            &String::from_utf8_lossy(&refused),
            &["does not know contact.friction_coefficient other than 0"],
        );
    }
}

#[test]
fn compare_tells_agreement_and_deviation() {
    let workspace = Workspace::new();
    for equations in EQUATIONS {
        workspace.run(&format!("derive {equations} --format json --out own.json"));
        let table = workspace.printed("compare own.json --states 4");
        has(&table, &["all agree"]);
    }
    let graph = |name: &str| {
        format!(
            "{}/../../derivations/graphs/{name}.json",
            env!("CARGO_MANIFEST_DIR")
        )
    };
    for (name, outputs) in [
        (
            "chain_2",
            ["whole equations of 2 segments", "energies.dissipation"],
        ),
        (
            "chain_2_planar",
            [
                "whole planar equations of 2 segments",
                "planar_energies.dissipation",
            ],
        ),
        ("kernels", ["joint.next", "lateral_clamp.next"]),
    ] {
        let table = workspace.printed(&format!("compare {} --states 50", graph(name)));
        has(&table, &["all agree to 1e-12", "CasADi"]);
        has(&table, &outputs);
    }

    // Another sign in the energies. (The sign of a velocity would not affect the force, as the node
    // velocities cancel.)
    let text = fs::read_to_string(graph("chain_2")).expect("the graph is there");
    let energies = text.find("\"energies\"").expect("it has energies");
    let (before, after) = text.split_at(energies);
    let after = after.replacen("[\"sub\",", "[\"add\",", 1);
    workspace.write("wrong.json", format!("{before}{after}"));
    workspace
        .bristle("compare wrong.json --states 50")
        .assert()
        .code(1)
        .stdout(contains("DEVIATES"))
        .stdout(contains("NOT all agree"));

    // More tests of graphs are in codegen/ and fuzz/.
    let chain = include_str!("../../../../../derivations/graphs/chain_1.json");
    let (arguments, swapped) = (
        "[\"phi_1\",0],[\"theta_1\",1]",
        "[\"phi_1\",1],[\"theta_1\",0]",
    );
    assert!(chain.contains(arguments));
    workspace.write("graph.json", chain.replace(arguments, swapped));
    let refused = "graph.json: kernel";
    workspace.refuses(
        "compare graph.json",
        &[refused, "stands for another quantity"],
    );
}

#[test]
fn a_file_says_which_equations_it_has() {
    let directory = Workspace::with(FILE);
    let of = |arguments: &str| directory.printed(&format!("derive {arguments} --format json"));
    assert!(of("case.toml") == of("--segments 4 --planar"));
    let with = |changes: &[(&str, &str)]| {
        let change = |text: String, (old, new): &(&str, &str)| {
            assert!(text.contains(old), "{old}");
            text.replace(old, new)
        };
        let text = changes.iter().fold(FILE.to_owned(), change);
        directory.write("other.toml", text);
    };
    // A tilt takes the filament out of the plane.
    with(&[("[filament]\n", "[filament]\nlateral_tilt_rad = 0.01\n")]);
    assert!(of("other.toml") == of("--segments 4"));
    // A straight cylinder has neither relaxed angles nor constants of each segment; its clamp joint
    // is twice as stiff.
    with(&[("segments = 4", "segments = 3")]);
    let straight = directory.printed("derive other.toml");
    has(&straight, &["2 c S′(u1)", "3/2 h² m cos(θ1 − θ2)"]);
    lacks(&straight, &["κ", "m1"]);
    let switches = "--segments 3 --planar --uniform --straight";
    for form in [
        "",
        "--format latex",
        "--format latex --fragment --width 84mm",
        "--format markdown",
        "--format sympy",
    ] {
        let of_file = directory.printed(&format!("derive other.toml {form}"));
        let of_switches = directory.printed(&format!("derive {switches} {form}"));
        assert!(of_file == of_switches, "{form}");
        let set = "--set filament.segments=3";
        assert!(directory.printed(&format!("derive case.toml {set} {form}")) == of_file);
    }
    with(&[("segments = 4", "segments = 2\nwaviness_amplitude_m = 1e-4")]);
    let wavy = directory.printed("derive other.toml");
    has(&wavy, &["κ2"]);
    lacks(&wavy, &["m1"]);
    assert!(directory.printed("derive --segments 2 --planar --uniform") == wavy);
    // Explicit switches hold for a file, too.
    assert!(directory.printed("derive other.toml --straight") != wavy);
    for (call, problem) in [
        ("--segments 2 --uniform --format c --out c", "any filament"),
        ("--segments 2 --straight --format json", "any filament"),
        ("--kernels --uniform", "cannot be used with"),
        (
            "--segments 2 --set filament.segments=3",
            "cannot be used with",
        ),
        ("--segments 2 --width 84mm", "--fragment"),
        (
            "--segments 2 --format latex --fragment --width 40mm",
            "65 mm to 300 mm",
        ),
    ] {
        directory.refuses(&format!("derive {call}"), &[problem]);
    }
    directory.refuses("derive case.toml --segments 2", &["cannot be used with"]);
    directory.refuses("derive missing.toml", &["missing.toml"]);
}
