//! Runs the commands of docs/tutorial.md, docs/deburring.md and docs/brushes.md one after the other in an empty directory, as a reader would, and
//! compares their output with the page.

use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

const TUTORIAL: &str = include_str!("../../../../docs/tutorial.md");
const DEBURRING: &str = include_str!("../../../../docs/deburring.md");
const BRUSHES: &str = include_str!("../../../../docs/brushes.md");

/// Marks lines that the page leaves out.
const LEFT_OUT: &str = "…";

/// A block of the page that is not prose.
#[derive(Debug)]
struct Block<'t> {
    /// The language of the block: `sh`, `toml` or `text`.
    language: &'t str,
    text: &'t str,
    /// The prose since the previous block.
    before: &'t str,
}

fn blocks(page: &'static str) -> Vec<Block<'static>> {
    let mut blocks = Vec::new();
    let mut rest = page;
    while let Some((before, fenced)) = rest.split_once("```") {
        let (language, fenced) = fenced.split_once('\n').expect("a block has lines");
        let (text, after) = fenced.split_once("```").expect("a block ends");
        blocks.push(Block { language, text, before });
        rest = after;
    }
    blocks
}

/// The name in the sentence "Save this as `name`" before a block.
fn file_name(before: &str) -> &str {
    // Lines may break anywhere in the sentence.
    let (_, name) = before.rsplit_once("this as `").expect("the page says what to save a file as");
    name.split_once('`').expect("a name in backticks").0
}

/// Runs a command of the page in `directory`, and returns what it prints to stderr and stdout.
fn run(command: &str, directory: &Path) -> String {
    let mut words = command.split(' ');
    assert_eq!(words.next(), Some("bristle"), "{command}");
    let output = Command::new(env!("CARGO_BIN_EXE_bristle")).current_dir(directory).args(words).output();
    let output = output.expect("the program starts");
    let [data, text] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    assert!(output.status.success(), "{command}: {text}");
    text + &data
}

/// Expects the output to contain the lines of a block, consecutive and in order, except where the block leaves lines out.
fn is_printed(block: &str, printed: &str) {
    let mut rest: Vec<&str> = printed.lines().collect();
    for part in block.split(&format!("{LEFT_OUT}\n")) {
        let lines: Vec<&str> = part.lines().collect();
        let found = rest.windows(lines.len()).position(|window| window == lines);
        let start = found.unwrap_or_else(|| panic!("not found in the output:\n{part}\nthe output is\n{printed}"));
        rest.drain(..start + lines.len());
    }
}

/// Does in `directory` what a page says. Returns the numbers of commands run and of outputs compared.
fn follow(page: &'static str, directory: &Path) -> (usize, usize) {
    let (mut printed, mut commands, mut compared) = (String::new(), 0, 0);
    for Block { language, text, before } in blocks(page) {
        match language {
            // The program under test is already installed; `.ci/run` runs this command.
            "sh" if text.starts_with("cargo install ") => assert_eq!(text.lines().count(), 1),
            "sh" => {
                for command in text.lines() {
                    printed = run(command, directory);
                    commands += 1;
                }
            }
            "toml" => fs::write(directory.join(file_name(before)), text).expect("the file can be written"),
            "text" => {
                is_printed(text, &printed);
                compared += 1;
            }
            other => panic!("a block of {other}"),
        }
    }
    (commands, compared)
}

/// Expects metrics of a contact to be what a page says, within half of its last digit.
fn has_metrics(file: &Path, told: &[(&str, f64, f64)]) {
    let metrics = fs::read_to_string(file).expect("metrics");
    let metrics: serde_json::Value = serde_json::from_str(&metrics).expect("JSON");
    for &(name, told, unit) in told {
        let value = metrics[name].as_f64().expect(name);
        assert!((value - told).abs() <= 0.5 * unit, "{name} is {value}, and the page says {told}");
    }
}

#[test]
fn the_tutorial_does_what_it_says() {
    let directory = TempDir::new().expect("a temporary directory");
    let (commands, compared) = follow(TUTORIAL, directory.path());
    assert_eq!((commands, compared), (10, 7), "the numbers of commands and outputs on the page have changed");

    // Files that the page tells the reader to open.
    for name in [
        "contact/figures/history.png",
        "contact/metrics.json",
        "results/report.html",
        "results/runs.csv",
        "sure/figures/scatter_over_velocity.png",
        "sure/figures/sobol_over_velocity.png",
        "packed/runs.csv",
        "sector/brush.html",
        "for-the-report/figures/tool_force_map.svg",
    ] {
        assert!(directory.path().join(name).is_file(), "{name}");
    }
    let told = [
        ("contact_time_ratio", 0.80, 0.01),
        ("contact_normal_impulse_n_s", 2.5e-3, 0.1e-3),
        ("tool_contact_normal_force_n", 234.0, 1.0),
    ];
    has_metrics(&directory.path().join("contact/metrics.json"), &told);
}

#[test]
fn deburring_does_what_it_says() {
    let directory = TempDir::new().expect("a temporary directory");
    let (commands, compared) = follow(DEBURRING, directory.path());
    assert_eq!((commands, compared), (9, 1), "the numbers of commands and outputs on the page have changed");
    for name in [
        "leaving/figures/profile_drawn.png",
        "entering/figures/profile_unrolled.png",
        "entering/profile.csv",
        "results/report.html",
        "results/runs.csv",
        "results/figures/edge_share_over_offset_and_depth_brushing_velocity_m_s_10.png",
        "results/figures/edge_evenness_over_offset_and_depth_brushing_velocity_m_s_10.png",
    ] {
        assert!(directory.path().join(name).is_file(), "{name}");
    }
    let drawn = fs::read_to_string(directory.path().join("entering/figures/profile_drawn.svg")).expect("a figure");
    assert!(drawn == include_str!("../../../../docs/deburring.svg"), "docs/deburring.svg is another figure");
    for (name, impulse, share, torque) in
        [("leaving", 1.07e-3, 0.001, 6.08), ("entering", 0.61e-3, 0.336, 5.28), ("chamfer", 0.60e-3, 0.303, 5.21)]
    {
        let told = [
            ("contact_normal_impulse_n_s", impulse, 0.01e-3),
            ("edge_share", share, 0.001),
            ("tool_torque_n_m", torque, 0.01),
        ];
        has_metrics(&directory.path().join(name).join("metrics.json"), &told);
    }
    has_metrics(&directory.path().join("entering/metrics.json"), &[("edge_evenness", 0.14, 0.01)]);
    for (name, angle, impulse, force, work) in [
        ("shaft", 0.111, 0.59e-3, 55.0, 0.59e-3),
        ("plane", 0.298, 1.26e-3, 117.0, 2.79e-3),
        ("ridge", 0.302, 1.29e-3, 119.0, 2.74e-3),
        ("pipe", 0.558, 2.40e-3, 223.0, 6.50e-3),
    ] {
        let told = [
            ("contact_angle_rad", angle, 0.001),
            ("contact_normal_impulse_n_s", impulse, 0.01e-3),
            ("tool_contact_normal_force_n", force, 1.0),
            ("friction_work_j", work, 0.01e-3),
        ];
        has_metrics(&directory.path().join(name).join("metrics.json"), &told);
    }
}

#[test]
fn brushes_are_compared_as_the_page_says() {
    let directory = TempDir::new().expect("a temporary directory");
    let (commands, compared) = follow(BRUSHES, directory.path());
    assert_eq!((commands, compared), (5, 3), "the numbers of commands and outputs on the page have changed");
    for name in ["brushes/report.html", "wear/report.html", "wear/runs.csv"] {
        assert!(directory.path().join(name).is_file(), "{name}");
    }
    let figure = "brushes/figures/tool_force_over_speed_by_tool_penetration_depth_m_0.001.png";
    assert!(directory.path().join(figure).is_file());
}
