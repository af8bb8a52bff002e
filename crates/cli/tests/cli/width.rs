//! Output of commands fits a terminal: 80 columns if the width is unknown, more in a wider
//! terminal.

use bristle_study::text::columns;
use insta::assert_snapshot;

use crate::program::{Workspace, has};

/// Start of all input files: a brush with quick passes.
const HEAD: &str = "\
[tool]
body_radius_m = 0.140
width_m = 0.020
filament_count = 682
filament_count_uncertainty = 40
[filament]
segments = 4
length_m = 0.040
diameter_m = 1.18e-3
[solver]
relative_tolerance = 1e-3
";
const PROCESS: &str = "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n";
const EDGE: &str = "[contact]\nfriction_coefficient = 0.3\n[workpiece]\nkind = \"chamfer\"\nedge_radius_m = 2e-4\nchamfer_width_m = 2e-3\n";
const ONE_ROW: &str = "[brush]\nrows = 1\ncolumns = 8\nsteady = false\n";
/// Twelve velocities; a table at 80 columns has room for nine.
const GRID: &str = "[study]\nbrushing_velocity_m_s = { start = 2.5, stop = 30.0, step = 2.5 }\npenetration_depth_m = [1e-3, 3e-3]\n";
const SMALL_GRID: &str =
    "[study]\nbrushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1e-3, 3e-3]\n";
const LONG_KEYS: &str = "\
\"filament.waviness_amplitude_m\" = [0.0, 1e-4]
\"filament.lateral_tilt_rad\" = [0.0, 1e-3]
\"contact.friction_regularisation_m_s\" = [1e-3, 1e-2]
\"contact.friction_coefficient\" = [0.3]
\"solver.relative_tolerance\" = [1e-3, 1e-2]
";
/// Tools with names in wide characters, too many for one table.
const TOOLS: &str = "\
[study.tools.\"a brush with a long name\"]
[study.tools.\"细刷子\"]
filament.diameter_m = 0.8e-3
[study.tools.\"short, and with fewer filaments\"]
filament.length_m = 0.030
tool.filament_count = 500
";
/// Forces as a laboratory exports them, with a point outside of the study.
const FORCES: &str =
    "v [m/min];ae [mm];Fz [N];s [N]\n600;1,0;12,5;1,1\n1000;2,0;28,25;2\n3000;2,0;28,25;2\n";
const MEASURED: &str = "\
[measured]
file = \"forces.csv\"
columns = { brushing_velocity_m_s = \"v [m/min]\", penetration_depth_m = \"ae [mm]\", force_n = \"Fz [N]\", std_n = \"s [N]\" }
";
const SCATTER: &str =
    "[uncertainty]\nsamples = 64\ndiameter_std_m = 0.05e-3\nyoungs_modulus_std_pa = 0.3e9\n";

/// Name of an input file, its sections below [`HEAD`], and commands.
const CASES: &[(&str, &[&str], &[&str])] = &[
    (
        "grid",
        &[GRID],
        &[
            "study grid.toml --out grid --no-figures",
            "report grid --figures svg",
            "advise grid",
            "advise grid --max-force 30 --max-velocity 25 --max-depth 5 --max-power 100 --min-ratio 0.3 --no-verify",
            "advise grid --target-force 20 --max-rpm 2000",
        ],
    ),
    (
        "rpm",
        &[
            "[study]\nrotational_speed_rpm = { start = 200, stop = 2400, step = 200 }\npenetration_depth_m = [1e-3]\n",
        ],
        &["study rpm.toml --out rpm --no-figures", "advise rpm"],
    ),
    (
        "long",
        &[SMALL_GRID, LONG_KEYS],
        &["study long.toml --out long --figures svg", "advise long"],
    ),
    (
        "edge",
        &[EDGE, SMALL_GRID, "\"workpiece.offset_m\" = [0.0, 1e-3]\n"],
        &["study edge.toml --out edge --no-figures", "advise edge"],
    ),
    (
        "steady",
        &[PROCESS, "turns = \"steady\"\n", SMALL_GRID],
        &[
            "study steady.toml --out steady --no-figures",
            "advise steady",
            "simulate steady.toml --out contact --no-figures",
        ],
    ),
    (
        "scatter",
        &[SCATTER, SMALL_GRID, MEASURED],
        &[
            "study scatter.toml --out scatter --no-figures",
            "advise scatter --max-force 30 --no-verify",
            "report scatter --no-figures",
        ],
    ),
    (
        "tools",
        &[SMALL_GRID, TOOLS],
        &[
            "study tools.toml --out tools --no-figures",
            "advise tools --max-force 20 --no-verify",
            "report tools other=tools --out both --no-figures",
        ],
    ),
    (
        "measured",
        &[SMALL_GRID, MEASURED],
        &["study measured.toml --out measured --no-figures"],
    ),
    (
        "brush",
        &[PROCESS, ONE_ROW, SMALL_GRID],
        &[
            "simulate brush.toml --out brush --no-figures",
            "study brush.toml --out brushes --no-figures",
            "advise brushes",
            "simulate brush.toml --out alone",
        ],
    ),
    (
        "material",
        &[PROCESS, SCATTER],
        &["simulate material.toml --out material --set filament.material=\"PA6.6\""],
    ),
    (
        "shards",
        &[SMALL_GRID],
        &[
            "study shards.toml --out shard --shard 1/1",
            "report --out merged shard --no-figures",
        ],
    ),
    (
        "",
        &[],
        &[
            "explain",
            "explain filament.material",
            "explain measured",
            "explain friction_coefficient",
            "explain friction",
            "new first.toml --body-radius-mm 140 --width-mm 20 --filaments 10500 --length-mm 40 --diameter-mm 1.18 --max-rpm 1200 --max-depth-mm 4",
        ],
    ),
];

/// Returns the output of a command on stdout and stderr, in a terminal of this many columns or one
/// of unknown width.
fn printed(directory: &Workspace, command: &str, width: Option<usize>) -> [String; 2] {
    let mut call = directory.bristle(command);
    if let Some(width) = width {
        call.env("COLUMNS", width.to_string());
    }
    let output = call.assert().success().get_output().clone();
    [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"))
}

/// Returns a directory with the input file of a case and its forces.
fn directory_of(name: &str, sections: &[&str]) -> Workspace {
    let directory = Workspace::new();
    let text = [&[HEAD], sections].concat().concat();
    directory.write(&format!("{name}.toml"), text);
    directory.write("forces.csv", FORCES);
    directory
}

#[test]
fn no_line_is_longer_than_80_columns() {
    for (name, sections, commands) in CASES {
        let directory = directory_of(name, sections);
        for command in *commands {
            for text in printed(&directory, command, None) {
                let long: Vec<&str> = text.lines().filter(|line| columns(line) > 80).collect();
                assert!(
                    long.is_empty(),
                    "{command}:\n{}\nin\n{text}",
                    long.join("\n")
                );
            }
        }
    }
}

#[test]
fn help_of_each_command_in_80_columns() {
    let directory = Workspace::new();
    directory.run("completions --manual pages");
    let pages = directory.names("pages");
    let commands = pages.iter().map(|page| {
        let name = page.trim_end_matches(".1").replacen("bristle", "", 1);
        name.replacen('-', "", 1)
    });
    let mut all = String::new();
    for command in commands {
        let [text, _] = printed(&directory, &format!("{command} --help"), Some(80));
        all += &format!("$ bristle {command} --help\n{text}\n");
    }
    assert!(all.lines().all(|line| columns(line) <= 80), "{all}");
    assert_snapshot!("help", all);
}

#[test]
fn a_wider_terminal_is_used() {
    let directory = directory_of("grid", &[GRID]);
    // Two parts of six velocities, or all side by side. A sentence stands below its row, or beside
    // it.
    for (width, velocities, sentence) in [
        (None, 6, "\n        The highest of 24 cases"),
        (Some(120), 12, "  The highest of 24 cases"),
    ] {
        let study = "study grid.toml --out grid --no-figures";
        let [tables, _] = printed(&directory, study, width);
        let heading = tables
            .lines()
            .find(|line| line.trim_start_matches([' ', '│']).starts_with("2.5"));
        let words = heading.map(|line| line.split_whitespace().count());
        assert_eq!(words, Some(velocities + 1), "{tables}");
        let [advice, _] = printed(&directory, "advise grid", width);
        has(&advice, &[sentence]);
        let is_wide = advice.lines().any(|line| columns(line) > 80);
        assert_eq!(is_wide, width.is_some(), "{advice}");
    }
}
