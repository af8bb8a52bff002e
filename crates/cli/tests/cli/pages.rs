//! Runs the commands of pages in docs/ in order in an empty directory, as a reader would, and
//! compares their output with the page. Together they simulate for minutes, so only `--ignored`
//! runs them; `.ci/run` does.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;

use bristle::model::filament::first_natural_frequency;
use bristle::model::settings::Settings;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{bristle, has, section, words};

/// A page, and its statements besides commands, files and outputs.
struct DocumentPage {
    text: &'static str,
    /// Numbers of its commands and of the outputs that it shows.
    counts: (usize, usize),
    /// Files that the reader is told to open.
    files: &'static [&'static str],
    /// Metrics in its prose, one a line after the first: directory, key, number, and the unit of
    /// the number's last digit.
    metrics: &'static str,
}

/// Mark of omitted lines.
const LEFT_OUT: &str = "…";

/// Returns the text of a file.
fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A block of the page that is not prose.
#[derive(Debug)]
struct PageBlock<'t> {
    /// The language of the block: `sh`, `toml`, `csv` or `text`.
    language: &'t str,
    text: &'t str,
    /// The prose since the previous block.
    before: &'t str,
}

fn blocks(page: &'static str) -> Vec<PageBlock<'static>> {
    let mut blocks = Vec::new();
    let mut rest = page;
    while let Some((before, fenced)) = rest.split_once("```") {
        let (language, fenced) = fenced.split_once('\n').expect("a block has lines");
        let (text, after) = fenced.split_once("```").expect("a block ends");
        blocks.push(PageBlock {
            language,
            text,
            before,
        });
        rest = after;
    }
    blocks
}

/// Follows the sentence before a block: "Save this as `name`" or "Add this to `name`", or the same
/// within a sentence.
fn write(directory: &Path, before: &str, text: &str) {
    // Lines may break anywhere in the sentence.
    let before = words(before);
    let place = |words: &str| before.rfind(words).map(|at| &before[at + words.len()..]);
    let (earlier, name) = match (place("ave this as `"), place("dd this to `")) {
        (Some(name), None) => (String::new(), name),
        (None, Some(name)) => {
            let name = name.split_once('`').expect("a name in backticks").0;
            (read(&directory.join(name)), name)
        }
        found => panic!("the page says what to do with a file: {found:?} in {before}"),
    };
    let name = name.split_once('`').map_or(name, |(name, _)| name);
    fs::write(directory.join(name), earlier + text).expect("the file can be written");
}

/// Runs a command of the page in `directory`, and returns its stderr and stdout.
fn run(command: &str, directory: &Path) -> String {
    // No quoted word has a space.
    let mut words = command
        .split_whitespace()
        .map(|word| word.trim_matches('\''));
    assert_eq!(words.next(), Some("bristle"), "{command}");
    let output = bristle(directory, "")
        .args(words)
        .output()
        .expect("the program starts");
    let [data, text] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    assert!(output.status.success(), "{command}: {text}");
    text + &data
}

/// Expects the output to contain the lines of a block, consecutive and in order, except where the
/// block omits lines.
fn is_printed(block: &str, printed: &str) {
    let mut rest: Vec<&str> = printed.lines().collect();
    for part in block.split(&format!("{LEFT_OUT}\n")) {
        let lines: Vec<&str> = part.lines().collect();
        let found = rest.windows(lines.len()).position(|window| window == lines);
        let start = found.unwrap_or_else(|| {
            panic!("not found in the output:\n{part}\nthe output is\n{printed}")
        });
        rest.drain(..start + lines.len());
    }
}

/// Follows a page in `directory`. Returns the numbers of commands run and of outputs compared.
fn follow(page: &'static str, directory: &Path) -> (usize, usize) {
    let (mut printed, mut commands, mut compared) = (String::new(), 0, 0);
    for PageBlock {
        language,
        text,
        before,
    } in blocks(page)
    {
        match language {
            // The program under test is already installed; `.ci/run` runs this command.
            "sh" if text.starts_with("cargo install ") => assert_eq!(text.lines().count(), 1),
            "sh" => {
                for command in text.replace("\\\n", "").lines() {
                    printed = run(command, directory);
                    commands += 1;
                }
            }
            "toml" | "csv" => write(directory, before, text),
            "text" => {
                is_printed(text, &printed);
                compared += 1;
            }
            other => panic!("a block of {other}"),
        }
    }
    (commands, compared)
}

/// Follows a page, and checks its statements. Returns the directory.
fn check(page: &DocumentPage) -> TempDir {
    let directory = TempDir::new().expect("a temporary directory");
    let counts = follow(page.text, directory.path());
    assert_eq!(
        counts, page.counts,
        "the numbers of commands and outputs on the page have changed"
    );
    for name in page.files {
        assert!(directory.path().join(name).is_file(), "{name}");
    }
    for line in page.metrics.lines().skip(1) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let file = directory.path().join(words[0]).join("metrics.json");
        let metrics: Value = serde_json::from_str(&read(&file)).expect("JSON");
        let value = metrics[words[1]].as_f64().expect(line);
        let [told, unit] = [2, 3].map(|word| words[word].parse::<f64>().expect(line));
        assert!((value - told).abs() <= 0.5 * unit, "{value}, but {line}");
    }
    directory
}

/// Expects a figure to equal that of a document.
#[track_caller]
fn is_figure(directory: &TempDir, drawn: &str, committed: &str) {
    assert!(
        read(&directory.path().join(drawn)) == committed,
        "{drawn} is another figure than that of the document"
    );
}

#[test]
#[ignore = "with the other pages it takes minutes"]
fn the_readme_describes_a_brush_as_it_says() {
    let readme = include_str!("../../../../README.md");
    check(&DocumentPage {
        text: section(readme, "A brush of your own"),
        counts: (2, 1),
        files: &["new/report.html"],
        metrics: "",
    });
}

#[test]
#[ignore = "with the other pages it takes minutes"]
fn the_tutorial_does_what_it_says() {
    check(&DocumentPage {
        text: include_str!("../../../../docs/tutorial.md"),
        counts: (8, 5),
        files: &[
            "contact/figures/history.svg",
            "contact/metrics.json",
            "results/report.html",
            "results/runs.csv",
            "sure/runs.csv",
            "packed/runs.csv",
            "for-the-report/figures/tool_force_map.svg",
        ],
        metrics: "
contact contact_time_ratio 0.80 0.01
contact contact_normal_impulse_n_s 2.5e-3 0.1e-3
contact tool_contact_normal_force_n 234.0 1.0",
    });
}

#[test]
#[ignore = "with the other pages it takes minutes"]
fn choosing_speed_and_depth_does_what_it_says() {
    check(&DocumentPage {
        text: include_str!("../../../../docs/speed-and-depth.md"),
        counts: (9, 6),
        files: &[
            "results/report.html",
            "candidate/brush.html",
            "brushes/report.html",
            "brushes/figures/tool_force_over_speed_by_tool_penetration_depth_m_0.001.svg",
            "wear/report.html",
            "wear/runs.csv",
        ],
        metrics: "
candidate tool_contact_normal_force_n 57.12 0.01",
    });
}

#[test]
#[ignore = "with the other pages it takes minutes"]
fn forces_are_as_certain_as_the_page_says() {
    let directory = check(&DocumentPage {
        text: include_str!("../../../../docs/trust.md"),
        counts: (9, 8),
        files: &[
            "sure/journal.jsonl",
            "sure/report.html",
            "sure/figures/measured_over_speed.svg",
            "calibrated/calibration.json",
            "calibrated/residuals.csv",
            "calibrated/figures/calibration_force.svg",
            "calibrated/calibration.html",
        ],
        metrics: "
one tool_contact_normal_force_n 44.93 0.01
fine tool_contact_normal_force_n 44.94 0.01",
    });
    has(
        &read(&directory.path().join("calibrated/calibrated.toml")),
        &[
            "# E = 2.596 ± 0.018 GPa, fitted\n",
            "file = \"../forces.csv\"",
        ],
    );
    // The table equals that of the example.
    let example = include_str!("../../../../examples/laboratory.csv");
    assert_eq!(read(&directory.path().join("forces.csv")), example);
}

/// Worked numbers of docs/trust.md, with the solver's own properties of a filament where it has
/// them.
#[test]
fn the_formulas_for_measurements_give_what_the_page_says() {
    let density = 4.0 * 1.743e-3 / (PI * 1e-6 * 0.1 * 20.0);
    let bent = 64.0 * 0.35e-3 * 9.81 * 1e-3 / (3.0 * PI * 1e-12 * 9.3e-3);
    let frequency: f64 = 10.0 * 240.0 / 114.0;
    let rung = 16.0 * density * (TAU * frequency * 0.01 / (1.8751_f64.powi(2) * 1e-3)).powi(2);
    // The frequency of such a filament agrees.
    let mut filament = Settings::paper(10.0, 1e-3).filament;
    (filament.length_m, filament.diameter_m) = (0.1, 1e-3);
    (filament.density_kg_m3, filament.youngs_modulus_pa) = (density, rung);
    let own_frequency = first_natural_frequency(&filament) / TAU;
    assert!(
        (own_frequency - frequency).abs() <= 0.005,
        "{own_frequency}"
    );
    let decrement = (8.0_f64 / 1.6).ln() / 5.0;
    let relative = |count: f64| 1.0 / (2.0 * (count - 1.0)).sqrt();
    let less = |seen: f64, other: f64| (seen.powi(2) - other.powi(2)).sqrt();
    let tilt = less(0.050, 0.015);
    let (length, roots) = (less(0.34, 0.15), less(1.90, 1.68));
    let of_roots = relative(40.0) * 1.90_f64.powi(2).hypot(1.68_f64.powi(2)) / roots;

    // Texts of the page with their numbers: value, stated number, and the unit of its last digit.
    let told: [(&str, &[[f64; 3]]); 10] = [
        (
            "20 filaments of 100 mm weigh 1.743 g, so that ρ = 1110 kg/m³",
            &[[density, 1110.0, 1.0]],
        ),
        (
            "L = 100 mm, m_w = 0.35 g (a piece of wire) and w = 9.3 mm give E = 2.5 GPa",
            &[[bent / 1e9, 2.5, 0.1]],
        ),
        (
            "10 periods in 114 frames of 240 per second, f = 21.1 Hz, ρ = 1110 kg/m³: E = 2.51 GPa",
            &[[frequency, 21.1, 0.1], [rung / 1e9, 2.51, 0.01]],
        ),
        (
            "from 8.0 mm to 1.6 mm in 5 periods: Λ = 0.322, ζ = 0.051",
            &[
                [decrement, 0.322, 0.001],
                [decrement / TAU.hypot(decrement), 0.051, 0.001],
            ],
        ),
        (
            "(r_g + l_f)/r_g, here 1.58",
            &[[(0.060 + 0.035) / 0.060, 1.58, 0.01]],
        ),
        (
            "20 N on the brush, and 5.2 N to pull: µ = 0.26",
            &[[5.2 / 20.0, 0.26, 0.01]],
        ),
        (
            "s/√(2(N − 1)): 16 % for N = 20, 11 % for 40, 7 % for 100",
            &[
                [relative(20.0), 0.16, 0.01],
                [relative(40.0), 0.11, 0.01],
                [relative(100.0), 0.07, 0.01],
            ],
        ),
        (
            "0.050 rad, and ten readings of one by 0.015 rad, so that s_τ = 0.048 ± 0.005 rad",
            &[[tilt, 0.048, 0.001], [tilt * relative(40.0), 0.005, 0.001]],
        ),
        (
            "40 lengths scatter by 0.34 mm, ten readings by 0.15 mm: s_l = 0.31 ± 0.03 mm",
            &[[length, 0.31, 0.01], [length * relative(40.0), 0.03, 0.01]],
        ),
        (
            "40 tips scatter by 1.90 mm, of which 35 mm · 0.048 = 1.68 mm come from the tilts: s_root = 0.9 ± 0.6 mm",
            &[
                [35.0 * 0.048, 1.68, 0.01],
                [roots, 0.9, 0.1],
                [of_roots, 0.6, 0.1],
            ],
        ),
    ];
    let page = words(include_str!("../../../../docs/trust.md"));
    for (text, numbers) in told {
        has(&page, &[text]);
        for [value, number, digit] in numbers {
            assert!((value - number).abs() <= 0.5 * digit, "{text}: {value}");
        }
    }
}

#[test]
#[ignore = "with the other pages it takes minutes"]
fn cups_cones_and_tilted_brushes_do_what_the_page_says() {
    let page = include_str!("../../../../docs/cups.md");
    let directory = check(&DocumentPage {
        text: page,
        counts: (6, 6),
        files: &[
            "cup/positions.csv",
            "tilted/positions.csv",
            "pressed/report.html",
            "kinds/runs.csv",
        ],
        metrics: "
cup turns 2.0 1.0
cup tool_contact_normal_force_n 10.29 0.01
tilted tool_lateral_force_n -0.251 0.001",
    });
    is_figure(
        &directory,
        "pressed/figures/penetration_depth_over_speed.svg",
        include_str!("../../../../docs/cup-cone-tilted_depth.svg"),
    );
    // The examples are the files of the page.
    for example in [
        include_str!("../../../../examples/cup.toml"),
        include_str!("../../../../examples/cone.toml"),
        include_str!("../../../../examples/tilted.toml"),
        include_str!("../../../../examples/pressed_on.toml"),
    ] {
        let (_, file) = example.split_once("\n\n").expect("a heading");
        assert!(page.contains(file), "{file}");
    }
}

#[test]
#[ignore = "with the other pages it takes minutes"]
fn edges_are_worked_as_the_page_says() {
    let page = include_str!("../../../../docs/edges.md");
    let directory = check(&DocumentPage {
        text: page,
        counts: (15, 6),
        files: &[
            "tube/figures/profile_drawn.svg",
            "beside/metrics.json",
            "leaving/figures/profile_drawn.svg",
            "entering/figures/profile_unrolled.svg",
            "entering/profile.csv",
            "results/report.html",
            "results/runs.csv",
            "results/figures/edge_share_over_offset_and_depth_brushing_velocity_m_s_10.svg",
            "results/figures/edge_evenness_over_offset_and_depth_brushing_velocity_m_s_10.svg",
            "ridge/figures/profile_drawn.svg",
            "found/calibrated.toml",
            "found/figures/calibration_radius.svg",
            "rounding/removal.csv",
            "rounding/edge_work.csv",
            "rounding/removal.html",
            "worn/figures/worn_force.svg",
        ],
        metrics: "
tube turns 2.0 1.0
beside tool_contact_normal_force_n 5.73 0.01
leaving contact_normal_impulse_n_s 1.07e-3 0.01e-3
leaving edge_share 0.001 0.001
leaving tool_torque_n_m 6.08 0.01
entering contact_normal_impulse_n_s 0.61e-3 0.01e-3
entering edge_share 0.336 0.001
entering tool_torque_n_m 5.28 0.01
entering edge_evenness 0.14 0.01
chamfer contact_normal_impulse_n_s 0.60e-3 0.01e-3
chamfer edge_share 0.303 0.001
chamfer tool_torque_n_m 5.21 0.01
shaft contact_angle_rad 0.111 0.001
shaft contact_normal_impulse_n_s 0.59e-3 0.01e-3
shaft tool_contact_normal_force_n 55.0 1.0
shaft friction_work_j 0.59e-3 0.01e-3
plane contact_angle_rad 0.298 0.001
plane contact_normal_impulse_n_s 1.26e-3 0.01e-3
plane tool_contact_normal_force_n 117.0 1.0
plane friction_work_j 2.79e-3 0.01e-3
ridge contact_angle_rad 0.302 0.001
ridge contact_normal_impulse_n_s 1.29e-3 0.01e-3
ridge tool_contact_normal_force_n 119.0 1.0
ridge friction_work_j 2.74e-3 0.01e-3
pipe contact_angle_rad 0.558 0.001
pipe contact_normal_impulse_n_s 2.40e-3 0.01e-3
pipe tool_contact_normal_force_n 223.0 1.0
pipe friction_work_j 6.50e-3 0.01e-3",
    });
    is_figure(
        &directory,
        "entering/figures/profile_drawn.svg",
        include_str!("../../../../docs/deburring.svg"),
    );
    is_figure(
        &directory,
        "rounding/figures/edge_radius.svg",
        include_str!("../../../../docs/edge_rounding_radius.svg"),
    );
    // The example also has the coefficient.
    let (_, example) = include_str!("../../../../examples/edge_rounding.toml")
        .split_once("\n\n")
        .expect("a heading");
    let (sections, _) = example
        .split_once("\n# The coefficient")
        .expect("the coefficient");
    assert!(page.contains(sections));
    let (_, tube) = include_str!("../../../../examples/tube.toml")
        .split_once("\n\n")
        .expect("a heading");
    assert!(page.contains(tube));
}
