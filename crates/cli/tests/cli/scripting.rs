//! Calls by scripts: options that state settings, stdin, figures on demand, and shards of a study.

use crate::program::{Workspace, brush};

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

const STATE: &str = r#"{"base_angle": -1.5, "base_rate": 50.0, "base_acceleration": 0.0, "gravity": [0, 0, 0],
 "q": [1.5, -1.5], "v": [0.1, 50.0]}"#;

#[test]
fn options_state_settings_as_the_file_would() {
    let directory = Workspace::with(FILE);
    let options = "--set process.rotational_speed_rpm=1200 --set filament.segments=5 --set workpiece.kind=plane \
                   --set workpiece.normal=[0,2,0]";
    directory.run(&format!("simulate case.toml --out by-options {options}"));
    let settings = &directory.json("by-options/case.json")["settings"];
    assert_eq!(settings["filament"]["segments"], 5);
    assert_eq!(settings["workpiece"]["normal"][1], 2.0);
    let speed = directory.number("by-options/metrics.json", "rotational_speed_rpm");
    assert!(
        (speed - 1200.0).abs() < 1e-9,
        "the option replaces the velocity in the file: {speed}"
    );

    directory.write("state.json", STATE);
    directory.run("evaluate case.toml --state state.json --set filament.density_kg_m3=900");
    directory.run(
        "study case.toml --out swept --set study.rotational_speed_rpm=[600,1200] --no-figures",
    );
    let runs = directory.read("swept/runs.csv");
    assert_eq!(runs.lines().count(), 3);
    // A file that is incomplete alone.
    let directory = Workspace::with(&FILE.replace("length_m = 0.040\n", ""));
    directory.run("simulate case.toml --out whole --set filament.length_m=0.04 --no-figures");
}

#[test]
fn stdin_is_a_file_too() {
    let directory = Workspace::new();
    let run = |text: &str, command: &str| {
        let output = directory
            .bristle(command)
            .write_stdin(text)
            .output()
            .expect("the program starts");
        (
            output.status.code(),
            String::from_utf8(output.stderr).expect("UTF-8"),
        )
    };
    let (status, message) = run(FILE, "simulate - --out one --no-figures");
    assert_eq!(status, Some(0), "{message}");
    assert!(directory.path("one/metrics.json").is_file());
    let (status, message) = run(
        &format!("{FILE}{SWEEPS}"),
        "study - --out results --no-figures",
    );
    assert_eq!(status, Some(0), "{message}");
    assert!(
        directory
            .read("results/report.html")
            .contains("stdin: brushing study")
    );
    let (status, message) = run(&FILE.replace("0.040", "0,04"), "simulate - --out two");
    assert!(
        status == Some(2) && message.contains("--> stdin:8:"),
        "{message}"
    );
}

/// The endings of the files in a directory.
fn endings(directory: &Workspace, of: &str) -> Vec<String> {
    let names = directory.names(of);
    let mut endings: Vec<String> = names
        .iter()
        .filter_map(|name| Some(name.rsplit_once('.')?.1.to_owned()))
        .collect();
    endings.sort();
    endings.dedup();
    endings
}

#[test]
fn figures_are_drawn_as_asked() {
    let directory = Workspace::with(&format!("{FILE}{SWEEPS}"));
    for (options, expected, message) in [
        (
            "",
            &["pdf", "png", "svg"][..],
            "wrote 5 figures as SVG, PNG, PDF to",
        ),
        ("--figures svg", &["svg"], "figures as SVG to"),
        (
            "--figures pdf,svg",
            &["pdf", "svg"],
            "wrote 5 figures as SVG, PDF to",
        ),
        ("--figures all,pdf", &["pdf"], "wrote 15 figures as PDF to"),
        ("--figures png", &["png"], "figures as PNG to"),
        ("--figures none", &[], "no figures"),
        (
            "--figures all",
            &["pdf", "png", "svg"],
            "wrote 15 figures as SVG, PNG, PDF to",
        ),
        ("--no-figures", &[], "no figures"),
    ] {
        let said = directory.said(&format!("study case.toml --out results {options}"));
        assert!(said.contains(message), "{options}: {said}");
        assert_eq!(
            endings(&directory, "results/figures"),
            expected,
            "{options}"
        );
    }
    directory.run("plot results --figures svg");
    assert_eq!(endings(&directory, "results/figures"), ["svg"]);
    directory.run("simulate case.toml --out one --figures png");
    assert_eq!(endings(&directory, "one/figures"), ["png"]);
    directory.refused("study case.toml --out results --figures svg --no-figures");

    // For a paper.
    directory.run("plot results --figure-width 84mm --font-size 8pt --figures svg --font STIX");
    let svg = directory.read("results/figures/tool_force_map.svg");
    assert!(
        svg.starts_with("<svg width=\"84mm\"") && svg.contains("'STIX', "),
        "{svg:.200}"
    );
    directory.run("simulate case.toml --out one --figure-width springer --font Arial");
    let svg = directory.read("one/figures/history.svg");
    assert!(
        svg.starts_with("<svg width=\"84mm\"") && svg.contains(">One contact"),
        "{svg:.200}"
    );
    directory.run("plot one --no-title --figures svg");
    assert!(
        !directory
            .read("one/figures/history.svg")
            .contains("One contact")
    );
    for (options, told) in [
        (
            "--figure-width 84",
            "must be a length with its unit, such as 84mm or 239pt, or the column of a journal",
        ),
        ("--figure-width 2m", "must be"),
        ("--figure-width 400mm", "must be 30 mm to 300 mm"),
        ("--font-size 8", "must be a length with its unit"),
        ("--font-size 72pt", "must be 4 pt to 24 pt"),
        ("--font a<b", "must be the name of a font"),
        (
            "--figure-width 40mm --font-size 8pt",
            "figures 40.0 mm wide have no room for text of 8.0 pt",
        ),
        (
            "--font STIX",
            "PNG and PDF figures have the font Liberation Sans only",
        ),
    ] {
        for command in [
            "study case.toml --out new",
            "simulate case.toml --out new",
            "brush case.toml --out new",
            "plot results",
        ] {
            directory.refuses(&format!("{command} {options}"), &[told]);
        }
    }
    assert!(
        !directory.path("new").exists(),
        "what cannot be drawn is refused before anything is written"
    );
}

#[test]
fn shards_make_the_results_of_one_call() {
    let directory = Workspace::with(&format!("{FILE}{SWEEPS}"));
    directory.run("study case.toml --out whole");
    for shard in 1..=3 {
        let said = directory.said(&format!(
            "study case.toml --out part-{shard} --shard {shard}/3"
        ));
        assert!(said.contains(&format!("shard {shard}/3: its ")), "{said}");
        assert!(!directory.path(&format!("part-{shard}/runs.csv")).exists());
    }
    directory.refuses(
        "merge case.toml part-1 part-3 --out merged",
        &["3 of 8 cases are in none of the shards", "help:"],
    );
    directory.run("merge case.toml part-1 part-2 part-3 --out merged");
    for name in [
        "runs.csv",
        "study.json",
        "report.html",
        "figures/tool_force_map.svg",
    ] {
        let [whole, merged] =
            ["whole", "merged"].map(|results| directory.bytes(&format!("{results}/{name}")));
        assert!(whole == merged, "{name}");
    }
    // A shard resumes, and what is not a shard of the study is refused.
    let again = directory.said("study case.toml --out part-1 --shard 1/3");
    assert!(again.contains("3 of 8 cases are in"), "{again}");
    directory.refuses(
        "merge case.toml part-1 --out other --set filament.segments=5",
        &["is no shard of this study", "filament.segments"],
    );
    directory.refuses(
        "merge case.toml absent --out other",
        &["cannot open", "absent"],
    );
    for shard in ["0/3", "4/3", "1", "a/b"] {
        directory.refuses(
            &format!("study case.toml --out results --shard {shard}"),
            &["I/N"],
        );
    }
}
