//! Input files that are read or refused.

mod units;

use crate::grid::{Sweep, TOOL, VELOCITY};
use bristle::model::settings::{Settings, WorkpieceKind};
use serde_json::{Value, json};

use super::Document;
use crate::input::measured::read_measured;
use crate::input::testing::brush;

const FILE: &str = concat!(
    brush!(25),
    "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1.0e-3\n"
);

/// A wire of steel would penetrate too deep with the stiffness of the paper's filament.
#[test]
fn metal_wires_have_a_stiff_contact_by_default() {
    let stiffness = |filament: &str, contact: &str| {
        let text = FILE.replace("[process]", &format!("{filament}\n{contact}\n[process]"));
        let document = Document::parse(&text, "wire").expect("a document");
        document.settings().expect("settings").contact.stiffness_n_m
    };
    assert_eq!(stiffness("", ""), 1e5);
    assert_eq!(stiffness("youngs_modulus_pa = 9e9", ""), 1e5);
    let steel = 1e5 * 206.0 / 3.0;
    let found = stiffness("material = \"steel\"", "");
    assert!((found / steel - 1.0).abs() < 1e-12, "{found}");
    let stated = stiffness("material = \"steel\"", "[contact]\nstiffness_n_m = 3e5");
    assert_eq!(stated, 3e5);
}

/// The depth of a bore that is narrower than the brush follows from the radii of each case.
#[test]
fn a_bore_narrower_than_the_brush_is_concentric_without_a_depth() {
    let text = FILE.replace(
        "penetration_depth_m = 1.0e-3\n",
        "[workpiece]\nkind = \"bore\"\nradius_m = 0.175\n",
    );
    let settings = |text: &str| Document::parse(text, "tube").and_then(|file| file.settings());
    let depth = |settings: Settings| settings.process.penetration_depth_m;
    assert!((depth(settings(&text).expect("settings")) - 5e-3).abs() < 1e-15);
    let stated = text.replace("10.0\n", "10.0\npenetration_depth_m = 6e-3\n");
    assert_eq!(depth(settings(&stated).expect("settings")), 6e-3);
    let wide = settings(&text.replace("0.175", "0.2")).expect_err("no depth");
    assert!(wide.to_string().contains("penetration_depth_m"), "{wide}");

    let swept = format!("{text}[study]\n\"workpiece.radius_m\" = [0.172, 0.176]\n");
    let document = Document::parse(&swept, "tubes").expect("a document");
    let study = document.study().expect("a study");
    for case in 0..2 {
        let settings = study.settings(case);
        let bore = settings.tube().expect("a tube");
        assert!(bore.eccentricity() < 1e-15 && bore.radius == [0.172, 0.176][case]);
    }
    assert!(study.takes_turns());
}

#[test]
fn named_tools_change_slowest_and_have_their_own_settings() {
    let text = "[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n\"contact.exponent\" = [1.0, 1.5]\n\
         [study.tools.file]\n[study.tools.tapered]\nfilament.tip_diameter_m = 1e-3\n\
         [study.tools.packed]\ntool.fill_factor = 0.5\nfilament.diameter_m = 1e-3\n";
    let text = format!("{FILE}{text}");
    let study = Document::parse(&text, "tools")
        .and_then(|document| document.study())
        .expect("a study");
    assert_eq!(
        (study.case_count(), study.tool_names()),
        (12, vec!["file".into(), "tapered".into(), "packed".into()])
    );
    assert_eq!(
        study.sweeps().iter().map(Sweep::path).collect::<Vec<_>>(),
        [TOOL, "contact.exponent", VELOCITY]
    );
    assert_eq!(study.values(7).collect::<Vec<_>>(), [1.0, 1.5, 10.0]);
    // Settings that a tool leaves out are the file's, also where they have no number.
    let tips = [0, 4, 8].map(|case| study.settings(case).filament.tip_diameter_m);
    assert_eq!(tips, [None, Some(1e-3), None]);
    assert_eq!(
        (study.tools()[1].held.len(), study.tools()[2].held.len()),
        (0, 1)
    );
    assert!(
        (study.settings(11).fill_factor() - 0.5).abs() < 1e-12
            && study.settings(11).contact.exponent == 1.5
    );
}

/// Keys of another kind of workpiece may be stated with their defaults, as programs do that write
/// all keys.
#[test]
fn keys_of_other_workpieces_have_no_effect() {
    let kind = |keys: &str| {
        let text = format!("{FILE}[workpiece]\n{keys}");
        Document::parse(&text, "workpiece")
            .and_then(|document| document.settings())
            .map(|read| read.workpiece.kind)
    };
    assert_eq!(
        kind("radius_m = 0\nside = \"leaving\"\ncontrol_points_m = []"),
        Ok(WorkpieceKind::default())
    );
    let edge = "kind = \"edge\"\nedge_radius_m = 1e-3\n";
    assert_eq!(
        kind(&format!("{edge}normal = [0, 1.0, 0]\nclosed = false")),
        Ok(WorkpieceKind::edge(1e-3))
    );
    let refused = kind(&format!("{edge}normal = [0, 1, 1]"))
        .expect_err("an edge is not turned")
        .to_string();
    assert!(
        refused.contains(
            "`workpiece.normal` is [0, 1, 1], but must be left out: a workpiece of kind `edge` faces along y"
        )
    );
    let unknown = kind(&format!("{edge}edge_raduis_m = 1"))
        .expect_err("no such key")
        .to_string();
    assert!(unknown.contains(
        "expected one of `kind`, `feed_velocity_m_s`, `offset_m`, `included_angle_rad`,"
    ));
    assert!(
        unknown.contains("did you mean `workpiece.edge_radius_m`?"),
        "{unknown}"
    );
}

#[test]
fn impossible_tools_are_blamed_on_their_deviation() {
    let error_at = |depth: &str, uncertainty: &str| {
        let brush = brush!(25).replace("1.18e-3", "1.0e-3");
        let text = format!(
            "{brush}[process]\nbrushing_velocity_m_s = 18.0\npenetration_depth_m = {depth}\n[uncertainty]\n{uncertainty}"
        );
        let settings = Document::parse(&text, "case.toml").and_then(|document| document.settings());
        settings.expect_err("impossible").to_string()
    };
    let error = |uncertainty: &str| error_at("1.0e-3", uncertainty);
    let damping = error("damping_ratio_std = 0.04");
    assert!(
        damping.contains("`uncertainty.damping_ratio_std` is 0.04")
            && damping.contains("case.toml:14:"),
        "{damping}"
    );
    assert!(
        error("length_std_m = 0.02\ndiameter_std_m = 1e-9")
            .contains("`uncertainty.length_std_m` is 0.02")
    );
    // Of the two inputs that scatter, only the length can be at fault.
    let deep = error_at("39e-3", "length_std_m = 1e-3\nyoungs_modulus_std_pa = 6e8");
    assert!(deep.contains("`uncertainty.length_std_m`"), "{deep}");
    assert!(error("samples = 63").contains("a whole number from 64 to 65536"));
    assert!(error("hold = \"depth\"").contains("process"));
}

#[test]
fn a_goal_has_its_keys_in_any_unit() {
    let text = format!(
        "{FILE}[goal]\ntarget_force_n = 80\nmax_depth_mm = 2\nmax_velocity_m_min = 600\nmin_ratio = 0.5\n"
    );
    let document = Document::parse(&text, "case.toml").expect("a goal");
    let expected = json!({ "target_force_n": 80.0, "max_depth_m": 0.002, "max_velocity_m_s": 10.0, "min_ratio": 0.5 });
    assert_eq!(
        Some(&expected),
        document.goal().cloned().map(Value::Object).as_ref()
    );
    let most = format!("{FILE}[removal]\n[goal]\nmost = \"edge\"\n");
    assert_eq!(
        Document::parse(&most, "case.toml")
            .expect("a goal")
            .goal()
            .expect("a goal")["most"],
        "edge"
    );
    for (lines, parts) in [
        (
            "",
            [
                "`goal.target_force_n` is missing",
                "docs/input.md lists them",
            ],
        ),
        (
            "target_force_n = -80",
            [
                "`goal.target_force_n` is -80",
                "a finite number greater than 0",
            ],
        ),
        (
            "target_force_n = \"80 N\"",
            [
                "`goal.target_force_n` is \"80 N\"",
                "a finite number greater than 0",
            ],
        ),
        (
            "max_ratio = 1.5",
            ["`goal.max_ratio` is 1.5", "greater than 0 and at most 1"],
        ),
        (
            "max_dept_m = 1",
            [
                "unknown key `goal.max_dept_m`",
                "did you mean `max_depth_m`",
            ],
        ),
        (
            "max_depth_m = 1e-3\nmax_depth_mm = 2",
            [
                "`goal.max_depth_mm` and `goal.max_depth_m`",
                "give one of them",
            ],
        ),
        (
            "most = \"speed\"",
            [
                "`goal.most` is \"speed\"",
                "\"force\", \"edge\", \"removal\"",
            ],
        ),
        (
            "most = \"edge\"",
            ["`goal.most` is \"edge\"", "without the section [removal]"],
        ),
    ] {
        let text = format!("{FILE}[goal]\n{lines}\n");
        let error = Document::parse(&text, "case.toml")
            .expect_err(lines)
            .to_string();
        assert!(
            parts.iter().all(|part| error.contains(part)),
            "{lines}: {error}"
        );
    }
}

/// Table of a laboratory, the lines of `[measured]` before it is read, and the lines that the
/// message suggests.
const TABLES: &[(&str, &str, &[&str])] = &[
    (
        "n [rpm];ae [mm];Fz [kN];s [N]\n600;0,5;0,125;4\n",
        "",
        &[
            "columns.rotational_speed_rpm = \"n [rpm]\"",
            "columns.penetration_depth_mm = \"ae [mm]\"",
            "columns.force_kn = \"Fz [kN]\"",
            "columns.std_n = \"s [N]\"",
        ],
    ),
    (
        "Nr,Drehzahl in U/min,Zustellung / µm,Normalkraft (N),Standardabweichung\n1,600,500,125,4\n",
        "",
        &[
            "columns.rotational_speed_rpm = \"Drehzahl in U/min\"",
            "columns.penetration_depth_um = \"Zustellung / µm\"",
            "columns.force_n = \"Normalkraft (N)\"",
            "columns.std_n = \"Standardabweichung\"  # check the unit",
        ],
    ),
    // Without units, by the sizes of the numbers; with units that people write, but not we; with a
    // heading that needs care.
    (
        "\"depth \"\"1\"\"\",tip speed [m/min],F std [N],F mean [KN],Fx [N]\n0.5,1960,4,0.125,3\n",
        "",
        &[
            "columns.brushing_velocity_m_min = \"tip speed [m/min]\"",
            "columns.penetration_depth_mm = \"depth \\\"1\\\"\"  # check the unit",
            "columns.force_kn = \"F mean [KN]\"",
            "columns.std_n = \"F std [N]\"",
        ],
    ),
    (
        "RPM,ae_mm,force (mean)\n600,0.5,125\n",
        "",
        &[
            "columns.rotational_speed_rpm = \"RPM\"  # check the unit",
            "columns.penetration_depth_mm = \"ae_mm\"",
            "columns.force_n = { column = \"force (mean)\", unit = \"N\" }  # check the unit",
        ],
    ),
    // Columns that the file names rightly stay.
    (
        "U;V;W;ae [mm]\n600;125;0,9;0,5\n",
        "columns = { rotational_speed_rpm = \"U\", force_n = { column = \"V\", unit = \"N\" }, penetration_depth_m = \"ae\", tool = \"W\" }\n",
        &[
            "columns.rotational_speed_rpm = \"U\"",
            "columns.penetration_depth_mm = \"ae [mm]\"",
            "columns.force_n = \"V\"",
            "columns.tool = \"W\"",
        ],
    ),
];

#[test]
fn the_lines_of_the_message_name_the_columns() {
    for (table, before, expected) in TABLES {
        let format_of = |lines: &str| {
            let text = format!("{FILE}[measured]\nfile = \"forces.csv\"\n{lines}");
            let document = Document::parse(&text, "case.toml")
                .unwrap_or_else(|error| panic!("{lines}\n{error}"));
            document.measured().expect("a section").1.clone()
        };
        let message = read_measured(table, "forces.csv", &format_of(before))
            .expect_err(table)
            .to_string();
        let lines: Vec<&str> = message
            .lines()
            .filter_map(|line| line.strip_prefix("     "))
            .collect();
        assert_eq!(lines, *expected, "{message}");
        assert_eq!(
            message.contains("in the place of its columns"),
            !before.is_empty(),
            "{message}"
        );
        let points =
            read_measured(table, "forces.csv", &format_of(&lines.join("\n"))).expect(table);
        assert_eq!(
            (points[0].penetration_depth_m, points[0].force_n),
            (0.5e-3, 125.0),
            "{table}"
        );
    }
}

/// Keys of a section are checked where it is left out, too.
#[test]
fn filaments_alone_have_no_unknown_keys_of_a_brush() {
    let error = |line: &str, is_alone: bool| {
        let text = format!("{FILE}[brush]\n{line}\n");
        let mut document = Document::parse(&text, "case.toml").expect("a document");
        if is_alone {
            document = document.without_brush().expect("no sweep");
        }
        document.settings().map_err(|error| error.to_string())
    };
    for line in ["colums = 3", "rows = 0", "rows = \"many\""] {
        let alone = error(line, true);
        assert!(alone.is_err() && alone == error(line, false), "{alone:?}");
    }
    assert_eq!(error("rows = 2", true).expect("settings").brush, None);
}

#[test]
fn options_state_keys_of_tables_in_a_section() {
    let text = format!("{FILE}[measured]\nfile = \"forces.csv\"\ncolumns.force_n = \"F\"\n");
    let options = [
        "measured.columns.force_n=\"Fz [N]\"",
        "measured.columns.penetration_depth_mm=ae",
        "removal.until.turns=5",
        "removal.observed.time_s=60",
        "removal.observed.edge_radius_m=8e-5",
    ]
    .map(str::to_owned);
    let document = Document::parse_with(&text, "case.toml", &options)
        .unwrap_or_else(|error| panic!("{error}"));
    let (_, format) = document.measured().expect("a section");
    let headings: Vec<&str> = format
        .columns
        .iter()
        .map(|(_, column)| column.heading.as_str())
        .collect();
    assert_eq!(headings, ["Fz [N]", "ae"]);
    let settings = document
        .settings()
        .unwrap_or_else(|error| panic!("{error}"));
    let removal = settings.removal.expect("a section");
    assert!(
        removal.until.is_some() && removal.observed.is_some(),
        "{removal:?}"
    );
    let wrong = ["removal.until.turn=5".to_owned()];
    let error = Document::parse_with(&text, "case.toml", &wrong)
        .and_then(|document| document.settings())
        .expect_err("no such key")
        .to_string();
    assert!(error.contains("--set"), "{error}");
}
