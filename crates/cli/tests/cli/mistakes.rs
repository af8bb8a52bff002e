//! Mistakes in input files, options and tables: snapshots of the messages, with place and remedy.

use bristle_study::input::document::Document;
use bristle_study::input::input_error::InputError;
use bristle_study::text::columns;
use insta::assert_snapshot;

use crate::commands::{FILE as STUDY, FORCES};
use crate::program::{Workspace, brush, has, words};
use crate::tools;

const FILE: &str = concat!(
    brush!(4),
    "
[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3
"
);

/// Lines of the file that users write differently.
const VELOCITY: &str = "brushing_velocity_m_s = 10.0";
const DEPTH: &str = "penetration_depth_m = 1.0e-3";
const LENGTH: &str = "length_m = 0.040";
const SEGMENTS: &str = "segments = 4";
const COUNT: &str = "filament_count = 10500";

/// A line of [`FILE`], and its wrong replacement.
const MISTAKES: &[(&str, &str)] = &[
    // Other names.
    (VELOCITY, "rpm = 530"),
    (VELOCITY, "speed = 530"),
    (VELOCITY, "velocity = 10"),
    (VELOCITY, "v_b = 10"),
    (VELOCITY, "rotational_speed = 530"),
    (DEPTH, "depth = 1e-3"),
    (DEPTH, "infeed = 1e-3"),
    (LENGTH, "length = 0.04"),
    ("diameter_m = 1.18e-3", "diameter = 1.18e-3"),
    (SEGMENTS, "E = 3e9"),
    (SEGMENTS, "modulus = 3e9"),
    (SEGMENTS, "mu = 0.3"),
    (SEGMENTS, "density = 1110"),
    (COUNT, "filaments = 10500"),
    ("body_radius_m = 0.140", "radius_m = 0.14"),
    // Other units in the key.
    (LENGTH, "length_m = 0.040\nlength_mm = 40"),
    (LENGTH, "length_furlong = 40"),
    // Numbers as people write them.
    (LENGTH, "length_m = 0,03"),
    (LENGTH, "length_m = 30 mm"),
    (LENGTH, "length_m = \"0.03\""),
    (LENGTH, "length_m = \"30 mm\""),
    (LENGTH, "length_m = \"0,03\""),
    (SEGMENTS, "segments = 4.5"),
    // Both, neither, or impossible values.
    (COUNT, ""),
    (COUNT, "fill_factor = 65"),
    (COUNT, "filament_count = 10500\nfill_factor = 0.5"),
    (COUNT, "filament_density = 5e5"),
    (
        VELOCITY,
        "brushing_velocity_m_s = 10.0\nrotational_speed_rpm = 530",
    ),
    (VELOCITY, ""),
    (VELOCITY, "rotational_speed_rpm = \"1200 rpm\""),
    (VELOCITY, "rotational_speed_rpm = 0"),
    (VELOCITY, "rotational_speed_rpm = 5e6"),
    ("[tool]", "measured = 3\n[tool]"),
];

/// A line of [`FILE`], and an unusual value. More are in the unit tests of
/// `bristle_study::input::plausibility`.
const UNUSUAL: &[(&str, &str)] = &[
    (LENGTH, "length_m = 30.0"),
    (COUNT, "filament_count = 16000"),
    (
        "[process]",
        "[workpiece]\nkind = \"edge\"\nedge_radius_m = 1e-3\noffset_m = -0.5\n[process]",
    ),
];

/// A line of the study's file, and a forbidden setting. Random values outside of all ranges are in
/// `random_input.rs`.
const SETTINGS: &[(&str, &str)] = &[
    ("width_m = 0.020", "width_m = -0.02"),
    (COUNT, "filament_cuont = 3"),
    ("width_m = 0.020", "width_m = 1\nkind = \"wheel\""),
    ("width_m = 0.020", "width_m = 1\ntilt_deg = 200"),
    (
        "width_m = 0.020",
        "width_m = 0.02\nkind = \"cup\"\ntilt_rad = -1.2",
    ),
    (
        "width_m = 0.020",
        "width_m = 0.02\nkind = \"cup\"\nfilament_angle_deg = 100",
    ),
    (
        "body_radius_m = 0.140",
        "kind = \"cup\"\nbody_radius_m = 0.009",
    ),
    (SEGMENTS, "segments = \"4\""),
    (SEGMENTS, "segments = 99999999999999999999"),
    (SEGMENTS, "segmnets = 4"),
    (LENGTH, "length_m = inf"),
    (LENGTH, "length_m = 1979-05-27"),
    (LENGTH, "length_m = { m = 1 }"),
    (LENGTH, "length_m = 0.04\nlength_m = 0.05"),
    ("diameter_m = 1.18e-3", "diameter_m = 0.04"),
    ("[contact]", "[contcat]"),
    ("[contact]", "[contact]\nradius_m = 0.04"),
    ("[workpiece]", "[[workpiece]]"),
    ("[workpiece]", "[workpiece]\nkind = \"ball\""),
    ("[workpiece]", "[workpiece]\nnormal = [0, 0, 1]"),
    ("[workpiece]", "[workpiece]\nnormal = [0, 0, 0]"),
    ("[workpiece]", "[workpiece]\nnormal = [0, nan, 0]"),
    ("[workpiece]", "[workpiece]\nnormal = [0, 1]"),
    (DEPTH, "penetration_depth_m = 0.04"),
    (DEPTH, "penetration_depth_m = "),
    (DEPTH, "tool_force_n = nan"),
    (DEPTH, "penetration_depth_m = 1.0e-3\ntool_force_kn = 0.02"),
    (
        DEPTH,
        "penetration_depth_m = 1.0e-3\ngravity_m_s2 = [0, nan, 0]",
    ),
    (DEPTH, "penetration_depth_m = 1.0e-3\ngravity_m_s2 = 9.81"),
    (VELOCITY, "brushing_velocity_m_s = 10.0\nturns = 51"),
    (VELOCITY, "brushing_velocity_m_s = 10.0\nturns = 2.5"),
    (VELOCITY, "brushing_velocity_m_s = 10.0\nturns = \"Steady\""),
    ("[study]", "[study]\n\"process.turns\" = [1, 51]"),
    ("[study]", "[study]\n\"process.turns\" = [1.5]"),
    ("[study]", "[study]\n\"process.turns\" = [\"steady\"]"),
    ("[solver]", "[solver"),
];

/// Files without some sections or keys.
const INCOMPLETE: &[&str] = &[
    "",
    "[tool]\n[filament]\n",
    "[process]\nbrushing_velocity_m_s = 10.0\n",
    "[tool]\nwidth_m = 0.02\n[filament]\n[process]\n",
    "[tool]\nbody_radius_m = 0.14\nwidth_m = 0.02\nfilament_count = 9\n[filament]\nlength_m = 0.04\n[process]\n",
];

/// Invalid sections `[workpiece]`. EDGE stands for an edge with a radius.
const WORKPIECES: &[&str] = &[
    // Keys that the kind needs: the message points at the heading of the section.
    "kind = 'edge'",
    "kind = 'chamfer'\nedge_radius_m = 2e-4",
    "kind = 'cylinder'",
    "kind = 'bore'",
    // Keys that the kind lacks.
    "edge_radius_m = 2e-4",
    "offset_m = 1e-3",
    "side = 'entering'",
    "radius_m = 0.1",
    "EDGE\nchamfer_width_m = 1e-3",
    "EDGE\nchamfer_angle_rad = 0.5",
    "EDGE\nradius_m = 0.1",
    "EDGE\nnormal = [1, 1, 0]",
    "kind = 'cylinder'\nradius_m = 0.1\nincluded_angle_rad = 1.5",
    // Values outside their ranges.
    "EDGE\nside = 'middle'",
    // Numbers that contradict each other.
    "kind = 'chamfer'\nchamfer_width_m = 1e-3\nedge_radius_m = 2e-3",
    "kind = 'chamfer'\nedge_radius_m = 2e-4\nchamfer_width_m = 1e-3\nchamfer_angle_rad = 1.6",
    "kind = 'bore'\nradius_m = 0.1404",
];

/// Invalid sections `[study]`.
const WRONG_SWEEPS: &[&str] = &[
    "brushing_velocity_m_s = []",
    "brushing_velocity_m_s = 10.0",
    "brushing_velocity_m_s = \"fast\"",
    "brushing_velocity_m_s = [10.0, \"fast\"]",
    "brushing_velocity_m_s = [10.0, nan]",
    "brushing_velocity_m_s = [\n  10.0,\n  0.0]",
    "brushing_velocity_m_s = { start = 1, stop = 2 }",
    "brushing_velocity_m_s = { start = 1, stop = 2, stepp = 1 }",
    "brushing_velocity_m_s = { start = 1, stop = 2, step = 0 }",
    "brushing_velocity_m_s = { start = 1, stop = 2, step = 1e-7 }",
    "\"filament.segments\" = [1.5]",
    "\"filament.segments\" = [0]",
    "\"filament.segmnets\" = [1]",
    "\"tool.kind\" = [1]",
    "filament.segments = [1]",
    "\"process.penetration_depth_m\" = [0.01, 0.05]",
    // The error of a relation points at one of its settings, here at the one that is not swept.
    "\"filament.length_m\" = [0.04, 1e-3]",
    "brushing_velocity_m_s = [10.0]\n\"process.brushing_velocity_m_s\" = [1.0]",
    "brushing_velocity_m_s = { start = 1, stop = 1001, step = 1e-3 }",
];

/// A command, and the value of an option `--set` or another option.
const OPTIONS: &[(&str, &str)] = &[
    ("simulate", "process.rpm=1200"),
    ("simulate", "rpm=1200"),
    ("simulate", "filament.length_m"),
    ("simulate", "filament.length_m=0,03"),
    ("simulate", "filament.length_m=30mm"),
    ("simulate", "filament.length_m=-1"),
    ("simulate", "workpiece.kind=ball"),
    ("simulate", "workpiece.normal=[0,0,1]"),
    ("simulate", "proces.turns=2"),
    (
        "simulate",
        "process.rotational_speed_rpm=9 --set process.brushing_velocity_m_s=9",
    ),
    ("study", "process.rotational_speed_rpm=9"),
    ("study", "study.brushing_velocity_m_s=[5,-1]"),
    ("simulate", "brush={}"),
    ("simulate", "=1"),
    ("simulate", "filament.length_m="),
    ("simulate", "filament.=1"),
    ("simulate", "process.gravity_m_s2=[0,0,0,-9.8]"),
    ("simulate", "process.gravity_m_s2=[0,-9.8,0,'x']"),
    ("simulate", "workpiece.normal=[0,1,0,0]"),
    ("simulate", "--figure-width 30mm"),
];

/// A part of the file of tools, and its replacement.
const TOOLS: &[(&str, &str)] = &[
    (FINE, "filament.diametr_m = 0.6e-3"),
    (FINE, "diameter_m = 0.6e-3"),
    (FINE, "filament.diameter_m = -1"),
    (FINE, "filament.diameter_m = 0,6"),
    (FINE, "process.penetration_depth_m = 1e-3"),
    (FINE, "contact = 3"),
    (FINE, "brush = {}"),
    (FINE, "tool.fill_factor = 0.3"),
    (FINE, "filament.material = \"stel\""),
    (NAME, "[study.tools.PLAIN]"),
    (NAME, "[study.tools.plain]"),
    (NAME, "[study.tools.\"=1+1\"]"),
    (NAME, "[study.tools.\"\"]"),
    (
        "penetration_depth_m = [1e-3, 2e-3]",
        "penetration_depth_m = [1e-3]\n\"filament.diameter_m\" = [1e-3]",
    ),
    ("length_m = 0.030", "length_m = 0.0015"),
    (tools::TOOLS, "tools = []"),
    (tools::TOOLS, "tools = {}"),
    (tools::TOOLS, "tools = { a = 1 }"),
];

/// Setting and name of a tool.
const FINE: &str = "filament.diameter_m = 0.6e-3";
const NAME: &str = "[study.tools.fine_2]";

/// Invalid sections `[measured]`.
const MEASURED: &[&str] = &[
    "[measured]\n",
    "[measured]\nfile = 3\n",
    "[measured]\nfile = \"\"\n",
    "[measured]\nfiles = \"a.csv\"\n",
    "[measured]\nfile = \"absent.csv\"\n",
    "[measured]\nfile = \"f.csv\"\nseparator = \"|\"\n",
    "[measured]\nfile = \"f.csv\"\ndecimal = 1\n",
    "[measured]\nfile = \"f.csv\"\ncolumns = \"Fz\"\n",
    "[measured]\nfile = \"f.csv\"\ncolumns = { force = \"Fz\" }\n",
    "[measured]\nfile = \"f.csv\"\ncolumns = { force_n = 3 }\n",
    "[measured]\nfile = \"f.csv\"\ncolumns = { force_n = { column = \"Fz\", unit = \"lbf\" } }\n",
    "[measured]\nfile = \"f.csv\"\ncolumns = { rotational_speed_rpm = \"n\", brushing_velocity_m_s = \"v\" }\n",
];

/// A part of [`FORCES`], and its replacement.
const FORCE_CHANGES: &[(&str, &str)] = &[
    ("force_n", "force"),
    ("150.0", "many"),
    ("150.0", "inf"),
    ("0.00075", "0"),
    (", 0.0\n", ", -1.0\n"),
    ("20, 1.0e-3", "10, 1.0e-3"),
    (", 10.0\n", "\n"),
    (", ", ";"),
];

/// Returns the message of `bristle simulate` about a file, and its exit status.
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

/// Returns the messages with which changes of a file are refused, one below the other.
fn messages<'c>(
    changes: impl IntoIterator<Item = &'c (&'c str, &'c str)>,
    refused: impl Fn(&str, &str) -> String,
) -> String {
    let message = |(old, new): &(&str, &str)| format!("-- {new}\n{}\n\n", refused(old, new));
    changes.into_iter().map(message).collect()
}

/// Returns the message of a file in which `new` replaces `old`.
fn refused<T>(
    file: &str,
    [old, new]: [&str; 2],
    read: impl Fn(&Document) -> Result<T, InputError>,
) -> String {
    assert!(file.contains(old), "{old}");
    let text = file.replacen(old, new, 1);
    let read = Document::parse(&text, "case.toml").and_then(|document| read(&document).map(drop));
    read.expect_err(new).to_string()
}

#[test]
fn mistakes_are_named_with_their_place() {
    let refused = |old: &str, new: &str| refused(FILE, [old, new], |own| own.settings());
    assert_snapshot!("mistakes", messages(MISTAKES, refused));
    let (message, status) = told(&FILE.replacen(LENGTH, "length_m = 0,03", 1), "");
    assert_eq!(status, Some(2));
    has(&message, &["error: 0,03"]);
}

#[test]
fn settings_that_are_not_allowed_are_named_with_their_place() {
    let refused =
        |old: &str, new: &str| refused(STUDY, [old, new], |own| own.settings().and(own.study()));
    assert_snapshot!("settings", messages(SETTINGS, refused));
    let edge = "kind = 'edge'\nedge_radius_m = 2e-4";
    let section = |lines: &str| format!("[workpiece]\n{}\n", lines.replace("EDGE", edge));
    let workpieces: String = WORKPIECES
        .iter()
        .map(|lines| format!("{}\n\n", refused("[workpiece]\n", &section(lines))))
        .collect();
    assert_snapshot!("workpieces", workpieces);
}

#[test]
fn mistakes_about_tools_are_named_with_their_place() {
    let file = tools::file();
    let refused = |old: &str, new: &str| refused(&file, [old, new], |own| own.study());
    assert_snapshot!("tools", messages(TOOLS, refused));
}

#[test]
fn what_is_missing_is_named_with_its_place_and_an_example() {
    let refused = |text: &&str| {
        let message = refused(text, ["", ""], |own| own.settings());
        format!("-- {text}\n{message}\n\n")
    };
    let messages: String = INCOMPLETE.iter().map(refused).collect();
    assert_snapshot!("incomplete", messages);
}

#[test]
fn sweeps_that_cannot_be_are_named_with_their_place() {
    let sweeps = &STUDY[STUDY.find("brushing_velocity_m_s = [").expect("a sweep")..];
    let refused = |new: &str| refused(STUDY, [sweeps, new], |own| own.study());
    let messages = WRONG_SWEEPS
        .iter()
        .map(|new| format!("{}\n\n", refused(new)));
    assert_snapshot!("sweeps", messages.collect::<String>());
}

#[test]
fn options_that_cannot_be_are_named() {
    let sweeps = "[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n";
    let directory = Workspace::with(&format!("{FILE}{sweeps}"));
    let refused = |command: &str, option: &str| {
        let set = if option.starts_with("--") {
            ""
        } else {
            "--set"
        };
        let call = format!("{command} case.toml --out results {set} {option}");
        let message = directory.refused(&call);
        directory.has_no("results");
        message
    };
    assert_snapshot!("options", messages(OPTIONS, refused));
}

#[test]
fn measured_forces_that_cannot_be_are_named_with_their_place() {
    let directory = Workspace::new();
    let refused = |section: &str| {
        directory.write("case.toml", format!("{STUDY}\n{section}"));
        let message = directory.refused("study case.toml --out results");
        directory.has_no("results");
        message
    };
    let forces = |old: &str, new: &str| {
        assert!(FORCES.contains(old), "{old}");
        directory.write("forces.csv", FORCES.replacen(old, new, 1));
        refused("[measured]\nfile = \"forces.csv\"\n")
    };
    let sections = MEASURED.iter().map(|section| refused(section) + "\n");
    let sections = sections.collect::<String>() + &messages(FORCE_CHANGES, forces);
    assert_snapshot!("measured", sections);
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
        has(&message, &["help: `bristle explain` lists all keys"]);
    }
    // An invisible space makes no other key.
    assert_eq!(
        explained("filament.length_m "),
        explained("filament.length_m")
    );
    let count = Workspace::new().printed("explain tool.filament_count");
    let others = "give this one or tool.filaments_per_m2 or tool.fill_factor";
    has(&words(&count), &[others]);
    // A comma within brackets once ended the meaning.
    let all = Workspace::new().printed("explain");
    has(&all, &["its control points [x, y]"]);
    let count = |bracket: char| all.matches(bracket).count();
    assert_eq!([count('['), count('(')], [count(']'), count(')')]);
}

#[test]
fn equal_values_of_a_sweep_are_told() {
    let sweeps = "[study]\npenetration_depth_m = [1e-3, 2e-3, 1.0e-3]\n[solver]\nrelative_tolerance = 1e-3\n";
    let directory = Workspace::with(&format!("{FILE}{sweeps}"));
    let message = words(&directory.said("study case.toml --out results"));
    let told = "`process.penetration_depth_m` is swept with 1 mm more than once";
    has(&message, &[told]);
    directory.refused("study case.toml --out strict --strict");
}

#[test]
fn what_is_unusual_is_told_and_refused_if_asked() {
    let tables = FILE.to_owned() + "[solver]\nrelative_tolerance = 1e-3\n";
    let mut messages = String::new();
    for (usual, unusual) in UNUSUAL {
        let (message, status) = told(&tables.replacen(usual, unusual, 1), " --strict");
        assert_eq!(status, Some(2), "{unusual}\n{message}");
        messages += &format!("-- {unusual}\n{message}\n");
    }
    assert!(
        messages.lines().all(|line| columns(line) <= 80),
        "{messages}"
    );
    assert_snapshot!("unusual_values", messages);
    // Without the option it is a warning.
    let (message, status) = told(&tables.replacen(COUNT, "filament_count = 16000", 1), "");
    assert_eq!(status, Some(0));
    has(&message, &["warning: `tool.filament_count` is 16000;"]);
    let (message, status) = told(&tables, " --strict");
    assert_eq!(status, Some(0), "{message}");
}

#[test]
fn a_study_tells_in_which_cases_something_is_unusual() {
    let sweeps =
        "[study]\npenetration_depth_m = [1e-3, 0.018]\n[solver]\nrelative_tolerance = 1e-3\n";
    let directory = Workspace::with(&format!("{FILE}{sweeps}"));
    let message = words(&directory.said("study case.toml --out results"));
    let statement = "This is so in 1 of 2 cases, first in row 2.";
    let told = "warning: `process.penetration_depth_m` is 0.018 m;";
    has(&message, &[told, statement]);
    for name in ["results/study.json", "results/report.html"] {
        has(&directory.read(name), &[statement]);
    }
    directory.run("report results");
    directory.refused("study case.toml --out strict --strict");
    directory.has_no("strict");
}
