//! Calls by scripts: options that state settings, stdin, figures on demand, and shards of a study.

use std::collections::BTreeSet;

use predicates::str::contains;

use crate::commands::STATE;
use crate::program::{Workspace, brush, has, is_near, lacks};

const FILE: &str = concat!(
    brush!(4),
    "
[solver]
relative_tolerance = 1e-4

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3
"
);

const SWEEPS: &str = "\n[study]\nbrushing_velocity_m_s = [5.0, 10.0, 15.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]\n";

#[test]
fn options_state_settings_as_the_file_would() {
    let directory = Workspace::with(FILE);
    let options = "--set process.rotational_speed_rpm=1200 --set filament.segments=5 --set workpiece.kind=plane \
                   --set workpiece.normal=[0,2,0]";
    directory.run(&format!("simulate case.toml --out by-options {options}"));
    let settings = &directory.json("by-options/case.json")["settings"];
    assert_eq!(settings["filament"]["segments"], 5);
    assert_eq!(settings["workpiece"]["normal"][1], 2.0);
    // The option replaces the velocity in the file.
    let speed = directory.number("by-options/metrics.json", "rotational_speed_rpm");
    is_near(speed, 1200.0, 1e-9);

    directory.write("state.json", STATE);
    directory.run("evaluate case.toml --state state.json --set filament.density_kg_m3=900");
    let study = "study case.toml --out swept --no-figures";
    directory.run(&format!(
        "{study} --set study.rotational_speed_rpm=[600,1200]"
    ));
    assert_eq!(directory.rows("swept/runs.csv").len(), 2);
    // A file that is incomplete without options.
    let directory = Workspace::with(&FILE.replace("length_m = 0.040\n", ""));
    directory.run("simulate case.toml --out whole --set filament.length_m=0.04 --no-figures");
}

#[test]
fn stdin_is_a_file_too() {
    let directory = Workspace::new();
    for (text, command, status, told) in [
        (FILE, "simulate - --out one --no-figures", 0, "wrote one"),
        (
            &*format!("{FILE}{SWEEPS}"),
            "study - --out results --no-figures",
            0,
            "8 cases in",
        ),
        (
            &FILE.replace("0.040", "0,04"),
            "simulate - --out two",
            2,
            "--> stdin:8:",
        ),
    ] {
        let mut command = directory.bristle(command);
        let ended = command.write_stdin(text).assert().code(status);
        ended.stderr(contains(told));
    }
    has(
        &directory.read("results/report.html"),
        &["stdin: brushing study"],
    );
}

/// Returns the endings of the files in a directory.
fn endings(directory: &Workspace, of: &str) -> Vec<String> {
    let names = directory.names(of).into_iter();
    let endings = names.filter_map(|name| Some(name.rsplit_once('.')?.1.to_owned()));
    endings.collect::<BTreeSet<_>>().into_iter().collect()
}

#[test]
fn figures_are_drawn_as_asked() {
    let directory = Workspace::with(&format!("{FILE}{SWEEPS}"));
    for (options, expected, message) in [
        ("--figures svg", &["svg"][..], "figures as SVG to"),
        (
            "--figures pdf,svg",
            &["pdf", "svg"],
            "wrote 5 figures as SVG, PDF to",
        ),
        ("--figures all,pdf", &["pdf"], "wrote 15 figures as PDF to"),
        ("--figures none", &[], "no figures"),
        ("--figures all", &["svg"], "wrote 15 figures as SVG to"),
        ("--no-figures", &[], "no figures"),
    ] {
        let said = directory.said(&format!("study case.toml --out results {options}"));
        has(&said, &[message]);
        assert_eq!(
            endings(&directory, "results/figures"),
            expected,
            "{options}"
        );
    }
    directory.refused("study case.toml --out results --figures svg --no-figures");

    // For a paper.
    directory.run("report results --figure-width 84mm --font-size 8pt --figures svg --font STIX");
    let svg = directory.read("results/figures/tool_force_map.svg");
    assert!(svg.starts_with("<svg width=\"84mm\""), "{svg:.200}");
    has(&svg, &["'STIX', "]);
    directory.run("simulate case.toml --out one --figure-width springer --font Arial");
    let svg = directory.read("one/figures/history.svg");
    assert!(svg.starts_with("<svg width=\"84mm\""), "{svg:.200}");
    has(&svg, &[">One contact"]);
    directory.run("report one --no-title --figures svg");
    lacks(&directory.read("one/figures/history.svg"), &["One contact"]);
    // More tests are in `bristle_app::report::drawing::format`.
    for (options, told) in [
        ("--figure-width 84", "must be a length with its unit"),
        ("--font-size 72pt", "must be 4 pt to 24 pt"),
        ("--font a<b", "must be the name of a font"),
        (
            "--figure-width 40mm --font-size 8pt",
            "figures 40.0 mm wide have no room for text of 8.0 pt",
        ),
        (
            "--font STIX --figures png",
            "PNG and PDF figures have the font Liberation Sans only",
        ),
    ] {
        for command in ["study case.toml", "simulate case.toml"] {
            directory.refuses(&format!("{command} --out new {options}"), &[told]);
        }
    }
    // The call is refused before any file is written.
    directory.has_no("new");
}

#[test]
fn shards_make_the_results_of_one_call() {
    let directory = Workspace::with(&format!("{FILE}{SWEEPS}"));
    directory.run("study case.toml --out whole");
    for shard in 1..=3 {
        let said = directory.said(&format!(
            "study case.toml --out part-{shard} --shard {shard}/3"
        ));
        has(&said, &[&format!("shard {shard}/3: its ")]);
        assert!(!directory.path(&format!("part-{shard}/runs.csv")).exists());
    }
    directory.refuses(
        "report part-1 part-3 --out merged",
        &["3 of 8 cases are in none of the shards", "help:"],
    );
    directory.run("report part-1 part-2 part-3 --out merged");
    let [whole, merged] = ["whole", "merged"].map(|out| directory.results(out));
    assert!(whole == merged, "results differ");
    // A shard resumes, and files that are not a shard of the study are refused.
    let again = directory.said("study case.toml --out part-1 --shard 1/3");
    has(&again, &["3 of 8 cases are in"]);
    directory.run("study case.toml --out five --shard 2/3 --set filament.segments=5");
    for (shards, part) in [
        ("part-1 five", "`five` is a shard of another study"),
        ("part-1 whole", "some of the directories are shards"),
        ("part-1 absent", "some of the directories are shards"),
    ] {
        directory.refuses(&format!("report {shards} --out other"), &[part]);
    }
    directory.refuses("report part-1 part-2", &["by --out DIR"]);
    directory.refuses("advise part-1", &["has one shard of a study"]);
    for shard in ["0/3", "4/3", "1", "a/b"] {
        directory.refuses(
            &format!("study case.toml --out results --shard {shard}"),
            &["I/N"],
        );
    }
}
