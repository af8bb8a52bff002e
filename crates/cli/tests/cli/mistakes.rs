//! Natural mistakes in an input file: each message names the mistake, and says what to write.

use crate::program::{Workspace, brush, place};

const FILE: &str = concat!(
    brush!(4),
    "
[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3
"
);

/// Lines of the file that users write otherwise.
const VELOCITY: &str = "brushing_velocity_m_s = 10.0";
const DEPTH: &str = "penetration_depth_m = 1.0e-3";
const LENGTH: &str = "length_m = 0.040";
const SEGMENTS: &str = "segments = 4";
const COUNT: &str = "filament_count = 10500";

/// A line of the file, what a user writes instead, and what the message says.
const REFUSED: &[(&str, &str, &[&str])] = &[
    // Other names.
    (
        VELOCITY,
        "rpm = 530",
        &["did you mean `process.rotational_speed_rpm`?"],
    ),
    (
        VELOCITY,
        "speed = 530",
        &["did you mean `process.rotational_speed_rpm`?"],
    ),
    (
        VELOCITY,
        "velocity = 10",
        &["did you mean `process.brushing_velocity_m_s`?"],
    ),
    (
        VELOCITY,
        "v_b = 10",
        &["did you mean `process.brushing_velocity_m_s`?"],
    ),
    (
        VELOCITY,
        "rotational_speed = 530",
        &["did you mean `process.rotational_speed_rpm`?"],
    ),
    (
        DEPTH,
        "depth = 1e-3",
        &["did you mean `process.penetration_depth_m`?"],
    ),
    (
        DEPTH,
        "infeed = 1e-3",
        &["did you mean `process.penetration_depth_m`?"],
    ),
    (
        LENGTH,
        "length = 0.04",
        &["did you mean `filament.length_m`?"],
    ),
    (
        "diameter_m = 1.18e-3",
        "diameter = 1.18e-3",
        &["did you mean `filament.diameter_m`?"],
    ),
    (
        SEGMENTS,
        "E = 3e9",
        &["did you mean `filament.youngs_modulus_pa`?"],
    ),
    (
        SEGMENTS,
        "modulus = 3e9",
        &["did you mean `filament.youngs_modulus_pa`?"],
    ),
    (
        SEGMENTS,
        "mu = 0.3",
        &["did you mean `contact.friction_coefficient`?"],
    ),
    (
        SEGMENTS,
        "density = 1110",
        &["did you mean `filament.density_kg_m3`?"],
    ),
    (
        COUNT,
        "filaments = 10500",
        &["did you mean `tool.filament_count`?"],
    ),
    (
        "body_radius_m = 0.140",
        "radius_m = 0.14",
        &["did you mean `tool.body_radius_m`?"],
    ),
    // Other units in the key.
    (
        LENGTH,
        "length_m = 0.040\nlength_mm = 40",
        &["length_mm", "length_m"],
    ),
    (LENGTH, "length_furlong = 40", &["length_furlong"]),
    // Numbers as people write them.
    (
        LENGTH,
        "length_m = 0,03",
        &[
            "error: 0,03 has a decimal comma",
            "write a decimal point instead of the comma: 0.03",
        ],
    ),
    (
        LENGTH,
        "length_m = 30 mm",
        &[
            "error: 30 mm has a unit",
            "without a unit, in that of the key: 0.03",
        ],
    ),
    (
        DEPTH,
        "penetration_depth_m = 1 mm",
        &[
            "error: 1 mm has a unit",
            "without a unit, in that of the key: 0.001",
        ],
    ),
    (
        SEGMENTS,
        "youngs_modulus_pa = 3.3 GPa",
        &["error: 3.3 GPa has a unit", "in that of the key: 3.3e9"],
    ),
    (
        LENGTH,
        "length_m = 30mm",
        &[
            "error: 30mm has a unit",
            "without a unit, in that of the key: 0.03",
        ],
    ),
    (
        LENGTH,
        "length_m = \"0.03\"",
        &["`filament.length_m` is \"0.03\"", "without quotes: 0.03"],
    ),
    (
        LENGTH,
        "length_m = \"30 mm\"",
        &[
            "`filament.length_m`",
            "without a unit, in that of the key: 0.03",
        ],
    ),
    (
        LENGTH,
        "length_m = \"0,03\"",
        &["`filament.length_m`", "decimal point"],
    ),
    (
        LENGTH,
        "length_m = .04",
        &["write a digit before the decimal point: 0.04"],
    ),
    (
        COUNT,
        "filament_count = 10 500",
        &["write the number without gaps: 10500"],
    ),
    (
        SEGMENTS,
        "segments = 4.5",
        &["`filament.segments` is 4.5", "a whole number"],
    ),
    // Both, neither, or impossible.
    (
        COUNT,
        "",
        &[
            "`tool.filament_count` is missing",
            "filament_count = 10500.0        # number of filaments",
            "Instead of `filament_count`: `filaments_per_m2` or `fill_factor`.",
        ],
    ),
    (
        COUNT,
        "fill_factor = 65",
        &[
            "`tool.fill_factor` is 65.0",
            "greater than 0 and of at most 1",
        ],
    ),
    (
        COUNT,
        "filament_count = 10500\nfill_factor = 0.5",
        &["are both given", "give one of them"],
    ),
    (
        COUNT,
        "filament_density = 5e5",
        &["did you mean `tool.filaments_per_m2`?"],
    ),
    (
        VELOCITY,
        "brushing_velocity_m_s = 10.0\nrotational_speed_rpm = 530",
        &[
            "`process.rotational_speed_rpm` and `process.brushing_velocity_m_s` are both given",
            "give one of them",
        ],
    ),
    (
        VELOCITY,
        "",
        &[
            "`process.brushing_velocity_m_s` is missing",
            "Instead of `brushing_velocity_m_s`: `rotational_speed_rpm`.",
        ],
    ),
    (
        VELOCITY,
        "rotational_speed_rpm = \"1200 rpm\"",
        &[
            "rotational_speed_rpm",
            "without a unit, in that of the key: 1200",
        ],
    ),
    (
        VELOCITY,
        "rotational_speed_rpm = 0",
        &["from 0.001 to 1e7, in rpm"],
    ),
    (
        VELOCITY,
        "rotational_speed_rpm = 5e6",
        &[
            "`process.rotational_speed_rpm` is 5000000.0",
            "`process.brushing_velocity_m_s`, which follows from it",
        ],
    ),
];

/// A line of the file, what a user types instead, and what the warning says: the key, its value,
/// what is usual, the likely slip.
const UNUSUAL: &[(&str, &str, &[&str])] = &[
    (
        LENGTH,
        "length_m = 30.0",
        &[
            "`filament.length_m` is 30 m",
            "from 0.002 to 0.5 m",
            "millimetres typed as metres",
        ],
    ),
    (
        "body_radius_m = 0.140",
        "body_radius_m = 140",
        &[
            "`tool.body_radius_m` is 140 m",
            "millimetres typed as metres",
        ],
    ),
    (
        SEGMENTS,
        "segments = 1",
        &["`filament.segments` is 1;", "from 4 to 200"],
    ),
    (
        SEGMENTS,
        "segments = 4\nyoungs_modulus_pa = 1e6",
        &["`filament.youngs_modulus_pa` is 1e6 Pa", "MPa typed as Pa"],
    ),
    (
        SEGMENTS,
        "segments = 4\ndamping_ratio = 5",
        &[
            "`filament.damping_ratio` is 5;",
            "per cent typed as a ratio",
        ],
    ),
    (
        COUNT,
        "filament_count = 0",
        &["`tool.filament_count` is 0;", "from 1 to 1e6"],
    ),
    (
        COUNT,
        "filament_count = 1e7",
        &["`tool.filament_count` is 1e7;", "from 1 to 1e6"],
    ),
    (
        COUNT,
        "filament_count = 16000",
        &["`tool.filament_count` is 16000;", "fit on the body"],
    ),
    (
        "diameter_m = 1.18e-3",
        "diameter_m = 8e-3",
        &["`filament.diameter_m` is 0.008 m", "from 2e-5 to 0.005 m"],
    ),
    (
        DEPTH,
        "penetration_depth_m = 0.03",
        &[
            "`process.penetration_depth_m` is 0.03 m",
            "far below filament.length_m = 0.04",
        ],
    ),
    (
        "[process]",
        "[contact]\nfriction_coefficient = 30\n[process]",
        &[
            "`contact.friction_coefficient` is 30;",
            "per cent typed as a ratio",
        ],
    ),
    (
        "[process]",
        "[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-3\noffset_m = -0.5\n[process]",
        &[
            "`workpiece.offset_m` is -0.5 m",
            "they never touch the workpiece",
        ],
    ),
];

/// An option of the call, and what the message says.
const OPTIONS: &[(&str, &[&str])] = &[
    (
        "--set brush={}",
        &[
            "unknown key `brush`",
            "as in --set brush.",
            "or the section in the file",
        ],
    ),
    (
        "--set =1",
        &[
            "an option needs a key and a value",
            "as in --set process.rotational_speed_rpm=1200",
        ],
    ),
    (
        "--set filament.length_m=",
        &["an option needs a key and a value"],
    ),
    ("--set filament.=1", &["an option needs a key and a value"]),
    (
        "--set process.gravity_m_s2=[0,0,0,-9.8]",
        &[
            "`process.gravity_m_s2` is [0,0,0,-9.8]",
            "a list of 3 numbers",
        ],
    ),
    (
        "--set process.gravity_m_s2=[0,-9.8,0,'x']",
        &[
            "`process.gravity_m_s2` is [0,-9.8,0,'x']",
            "a list of 3 numbers",
        ],
    ),
    (
        "--set workpiece.normal=[0,1,0,0]",
        &["`workpiece.normal` is [0,1,0,0]", "a list of 3 numbers"],
    ),
    (
        "--figure-width 30mm",
        &[
            "have no room for text of 9.0 pt",
            "help: state at least --figure-width 75mm",
        ],
    ),
    ("--samples -1", &["must be a whole number"]),
];

/// What `bristle simulate` says about a file, and its exit status.
fn told(text: &str, options: &str) -> (String, Option<i32>) {
    let directory = Workspace::with(text);
    let output = directory
        .bristle(&format!("simulate case.toml --out results{options}"))
        .output()
        .expect("an end");
    (
        String::from_utf8(output.stderr).expect("UTF-8"),
        output.status.code(),
    )
}

#[test]
fn the_message_names_the_mistake() {
    for (right, wrong, parts) in REFUSED {
        assert!(FILE.contains(right), "{right}");
        let file = FILE.replacen(right, wrong, 1);
        let (message, status) = told(&file, "");
        assert_eq!(status, Some(2), "{wrong}\n{message}");
        assert!(
            message.starts_with("error: ") && !message.contains("panicked"),
            "{wrong}\n{message}"
        );
        for part in *parts {
            assert!(message.contains(part), "{wrong}: no `{part}` in\n{message}");
        }
        let section = if right.starts_with("filament_count") {
            "[tool]"
        } else {
            "[process]"
        };
        let at = if wrong.is_empty() {
            section
        } else {
            wrong.lines().last().expect("a line")
        };
        assert!(
            message.contains(&place(&file, at)),
            "{wrong}: no place in\n{message}"
        );
    }
}

#[test]
fn the_message_names_the_mistake_in_an_option() {
    for (option, parts) in OPTIONS {
        let (message, status) = told(FILE, &format!(" {option}"));
        assert_eq!(status, Some(2), "{option}\n{message}");
        assert!(
            message.starts_with("error: ") && !message.contains("did you mean"),
            "{option}\n{message}"
        );
        for part in *parts {
            assert!(
                message.contains(part),
                "{option}: no `{part}` in\n{message}"
            );
        }
    }
}

#[test]
fn keys_that_are_nearly_right_are_explained() {
    let explained = |key: &str| {
        let output = Workspace::new()
            .bristle("explain")
            .arg(key)
            .output()
            .expect("the program starts");
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("UTF-8"))
    };
    for key in ["", " "] {
        let [_, message] = explained(key);
        assert!(
            message.contains("help: `bristle explain` lists all keys"),
            "{message}"
        );
    }
    // A space that nobody sees is no other key.
    assert_eq!(
        explained("filament.length_m "),
        explained("filament.length_m")
    );
    // A comma within brackets ended the meaning.
    let all = Workspace::new().printed("explain");
    assert!(all.contains("its control points [x, y]"), "{all}");
    let count = |bracket: char| all.matches(bracket).count();
    assert!(
        count('[') == count(']') && count('(') == count(')'),
        "{all}"
    );
}

#[test]
fn equal_values_of_a_sweep_are_told() {
    let sweeps = "[study]\npenetration_depth_m = [1e-3, 2e-3, 1.0e-3]\n[solver]\nrelative_tolerance = 1e-3\n";
    let directory = Workspace::with(&format!("{FILE}{sweeps}"));
    let message = directory
        .said("study case.toml --out results")
        .replace("\n         ", " ");
    assert!(
        message.contains("`process.penetration_depth_m` is swept with 1 mm more than once"),
        "{message}"
    );
    directory.refused("study case.toml --out strict --strict");
}

#[test]
fn what_is_unusual_is_told_and_refused_if_asked() {
    let tables = FILE.to_owned() + "[solver]\nrelative_tolerance = 1e-3\n";
    for (usual, unusual, parts) in UNUSUAL {
        let file = tables.replacen(usual, unusual, 1);
        let (message, status) = told(&file, " --strict");
        assert_eq!(status, Some(2), "{unusual}\n{message}");
        let refused = message.replace("\n         ", " ");
        assert!(
            refused.starts_with("error: case.toml: --strict refuses"),
            "{unusual}\n{message}"
        );
        for part in *parts {
            assert!(
                refused.contains(part),
                "{unusual}: no `{part}` in\n{message}"
            );
        }
        assert!(
            message.lines().all(|line| line.chars().count() <= 80),
            "{message}"
        );
    }
    // Without the option it is a warning.
    let (message, status) = told(
        &tables.replacen("filament_count = 10500", "filament_count = 16000", 1),
        "",
    );
    assert!(
        status == Some(0) && message.starts_with("warning: `tool.filament_count` is 16000;"),
        "{message}"
    );
    let (message, status) = told(&tables, " --strict");
    assert!(
        status == Some(0) && !message.contains("usually"),
        "{message}"
    );
}

#[test]
fn a_study_tells_in_which_cases_something_is_unusual() {
    let sweeps =
        "[study]\npenetration_depth_m = [1e-3, 0.018]\n[solver]\nrelative_tolerance = 1e-3\n";
    let directory = Workspace::with(&format!("{FILE}{sweeps}"));
    let message = directory
        .said("study case.toml --out results")
        .replace("\n         ", " ");
    assert!(
        message.starts_with("warning: `process.penetration_depth_m` is 0.018 m;"),
        "{message}"
    );
    let statement = "This is so in 1 of 2 cases, first in row 2.";
    assert!(message.contains(statement), "{message}");
    for name in ["results/study.json", "results/report.html"] {
        assert!(directory.read(name).contains(statement), "{name}");
    }
    directory.run("plot results");
    let refused = directory.refused("study case.toml --out strict --strict");
    assert!(!directory.path("strict").exists(), "{refused}");
}
