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

/// Text in the units of the settings, and the same in others.
const IN_OTHER_UNITS: &[(&str, &str)] = &[
    ("body_radius_m = 0.140", "body_radius_mm = 140"),
    ("width_m = 0.020", "width_cm = 2.0"),
    ("filament_count = 10500", "filaments_per_mm2 = 0.5969"),
    (
        "length_m = 0.040\ndiameter_m = 1.18e-3",
        "diameter_um = 1_180\nlength_mm = 4.0e1",
    ),
    (
        "[process]",
        "youngs_modulus_gpa = 3.31\ndensity_g_cm3 = 1.14\nlateral_tilt_mrad = 2\n[process]",
    ),
    (
        "brushing_velocity_m_s = 10.0",
        "brushing_velocity_m_min = 600",
    ),
    ("brushing_velocity_m_s = 10.0", "rotational_speed_hz = 8.5"),
    ("penetration_depth_m = 1.0e-3", "penetration_depth_mm = 1"),
    (
        "penetration_depth_m = 1.0e-3",
        "penetration_depth_um = 1e3\nlead_angle_deg = 0.5",
    ),
    (
        "[process]",
        "[uncertainty]\nlength_std_mm = 0.3\nyoungs_modulus_std_n_mm2 = 300\n[process]",
    ),
    (
        "[process]",
        "[workpiece]\nkind = \"edge\"\nincluded_angle_deg = 90\nedge_radius_mm = 0.5\nfeed_velocity_mm_min = 600\n[process]",
    ),
    (
        "[process]",
        "[workpiece]\nkind = \"profile\"\ncontrol_points_mm = [[-20.0, 0], [-5, 0.0], [5, 0], [20, -1.5]]\n[process]",
    ),
    (
        "[process]",
        "[study]\npenetration_depth_mm = [0.5, 1]\n\"filament.length_mm\" = { start = 30, stop = 40, step = 2.5 }\n\
         [study.tools.fine]\nfilament.diameter_mm = 0.6\n\"tool.filaments_per_cm2\" = 80\n[study.tools.\"a, b\"]\n[process]",
    ),
];

/// Texts in the units of the settings, where [`IN_OTHER_UNITS`] adds something.
const IN_OWN_UNITS: &[(&str, &str)] = &[
    ("filaments_per_mm2 = 0.5969", "filaments_per_m2 = 596900"),
    ("youngs_modulus_gpa = 3.31", "youngs_modulus_pa = 3.31e9"),
    ("density_g_cm3 = 1.14", "density_kg_m3 = 1140"),
    ("lateral_tilt_mrad = 2", "lateral_tilt_rad = 2e-3"),
    ("rotational_speed_hz = 8.5", "rotational_speed_rpm = 510"),
    (
        "lead_angle_deg = 0.5",
        "lead_angle_rad = 0.008726646259971648",
    ),
    ("length_std_mm = 0.3", "length_std_m = 0.0003"),
    (
        "youngs_modulus_std_n_mm2 = 300",
        "youngs_modulus_std_pa = 3e8",
    ),
    (
        "included_angle_deg = 90",
        "included_angle_rad = 1.5707963267948966",
    ),
    ("edge_radius_mm = 0.5", "edge_radius_m = 5e-4"),
    ("feed_velocity_mm_min = 600", "feed_velocity_m_s = 0.01"),
    (
        "control_points_mm = [[-20.0, 0], [-5, 0.0], [5, 0], [20, -1.5]]",
        "control_points_m = [[-0.02, 0], [-0.005, 0], [0.005, 0], [0.02, -0.0015]]",
    ),
    (
        "penetration_depth_mm = [0.5, 1]",
        "penetration_depth_m = [0.0005, 0.001]",
    ),
    (
        "\"filament.length_mm\" = { start = 30, stop = 40, step = 2.5 }",
        "\"filament.length_m\" = { start = 0.03, stop = 0.04, step = 0.0025 }",
    ),
    ("filament.diameter_mm = 0.6", "filament.diameter_m = 0.0006"),
    (
        "\"tool.filaments_per_cm2\" = 80",
        "\"tool.filaments_per_m2\" = 800000",
    ),
];

#[test]
fn keys_in_other_units_state_the_same() {
    let read = |text: &str, options: &[String]| {
        let document = Document::parse_with(text, "case.toml", options)
            .unwrap_or_else(|error| panic!("{text}\n{error}"));
        let settings = document.settings().map(|settings| format!("{settings:?}"));
        let study = document.study().map(|study| {
            let cases = (0..study.case_count()).map(|case| format!("{:?}", study.settings(case)));
            (
                study.sweeps().iter().map(Sweep::path).collect::<Vec<_>>(),
                cases.collect::<Vec<_>>(),
            )
        });
        assert!(settings.is_ok() || study.is_ok(), "{text}\n{settings:?}");
        (settings.ok(), study.ok())
    };
    for (own, other) in IN_OTHER_UNITS {
        let in_own = IN_OWN_UNITS
            .iter()
            .fold((*other).to_owned(), |text, (own, other)| {
                text.replace(own, other)
            });
        let expected = FILE.replacen(own, if in_own == *other { own } else { &in_own }, 1);
        assert_eq!(
            read(&FILE.replacen(own, other, 1), &[]),
            read(&expected, &[]),
            "{other}"
        );
    }
    let depths =
        "[study]\npenetration_depth_m = [2e-3, 3e-3]\n[study.tools.fine]\n[study.tools.coarse]\n";
    let study = format!("{FILE}{depths}");
    for (own, other) in [
        ("filament.length_m=0.04", "filament.length_mm=40"),
        (
            "process.brushing_velocity_m_s=12.5",
            "process.brushing_velocity_m_min=750",
        ),
        (
            "study.penetration_depth_m=[1e-3, 1.5e-3]",
            "study.penetration_depth_mm=[1, 1.5]",
        ),
        (
            "study.\"filament.length_m\"=[0.03, 0.04]",
            "study.\"filament.length_cm\"=[3, 4]",
        ),
        (
            "study.tools.fine.filament.diameter_m=0.6e-3",
            "study.tools.fine.filament.diameter_um=600",
        ),
    ] {
        let [own, other] = [own, other].map(|option| [option.to_owned()]);
        assert_eq!(read(&study, &other), read(&study, &own), "{other:?}");
        // Options replace settings that the file states in any unit.
        let in_millimetres = study.replace("length_m = 0.040", "length_mm = 37");
        assert_eq!(
            read(&in_millimetres, &other),
            read(&study.replace("0.040", "0.037"), &own),
            "{other:?}"
        );
    }
}

/// Text in the place of a line of the file or behind it, or options, and parts of the message.
const MISTAKEN_UNITS: &[(&str, &str, &[&str])] = &[
    (
        "length_m = 0.040",
        "length_m = 0.040\nlength_mm = 40",
        &[
            "`filament.length_mm` and `filament.length_m` are both given",
            "9 | length_mm = 40\n",
            "each in its unit",
        ],
    ),
    (
        "length_m = 0.040",
        "length_mm = 40\nlength_m = 0.040",
        &[
            "`filament.length_m` and `filament.length_mm`",
            "9 | length_m",
        ],
    ),
    (
        "length_m = 0.040",
        "length_cm = 4\nlength_mm = 40",
        &[
            "`filament.length_mm` and `filament.length_cm`",
            "9 | length_mm",
        ],
    ),
    (
        "length_m = 0.040",
        "length_km = 40",
        &[
            "unknown key `filament.length_km`",
            "did you mean `filament.length_m`?",
        ],
    ),
    (
        "length_m = 0.040",
        "lenght_mm = 40",
        &[
            "unknown key `filament.lenght_mm`",
            "did you mean `filament.length_mm`?",
        ],
    ),
    (
        "[process]",
        "[contact]\nstiffness_n_mm = 100\n[process]",
        &["did you mean `contact.stiffness_n_m`?"],
    ),
    (
        "length_m = 0.040",
        "length_mm = 200000",
        &[
            "`filament.length_mm` is 200000, which is 200.0 m, but must be a finite number",
            ":8:13",
            "of at most 100, in m",
        ],
    ),
    (
        "diameter_m = 1.18e-3",
        "diameter_mm = 50",
        &[
            "`filament.diameter_mm` is 50, which is 0.05 m,",
            "filament.length_m = 0.04",
        ],
    ),
    (
        "length_m = 0.040",
        "length_mm = \"40 mm\"",
        &[
            "`filament.length_mm` is \"40 mm\"",
            "in that of the key: 40",
        ],
    ),
    (
        "length_m = 0.040",
        "length_mm = 4 cm",
        &["4 cm has a unit", "in that of the key: 40"],
    ),
    (
        "length_m = 0.040",
        "length_mm = nan",
        &["`filament.length_mm` is NaN, but"],
    ),
    (
        "length_m = 0.040",
        "length_mm = 1e308\nyoungs_modulus_gpa = 1e308",
        &["`filament.length_mm` is 1e308"],
    ),
    (
        "filament_count = 10500",
        "filaments_per_cm2 = -1",
        &["`tool.filaments_per_cm2` is -1, which is -10000.0 1/m²,"],
    ),
    (
        "brushing_velocity_m_s = 10.0",
        "rotational_speed_hz = 8\nbrushing_velocity_m_min = 600",
        &[
            "`process.rotational_speed_hz` and `process.brushing_velocity_m_min` are both given",
            "each follows from the other",
        ],
    ),
    (
        "",
        "[study]\npenetration_depth_mm = [1, -2]\n",
        &["`study.penetration_depth_mm`: `process.penetration_depth_m` is -0.002"],
    ),
    (
        "",
        "[study]\n\"process.penetration_depth_mm\" = [1]\npenetration_depth_m = [1e-3]\n",
        &["penetration_depth_m` is swept"],
    ),
    (
        "",
        "[study.tools.fine]\nfilament.diameter_mm = 1\n\"filament.diameter_m\" = 1e-3\n",
        &["`filament.diameter_m` and `filament.diameter_mm` are both given"],
    ),
    (
        "",
        "[study.tools.fine.filament]\ndiameter_mm = 1\ndiameter_um = 1000\n",
        &[
            "`study.tools.fine.filament.diameter_um` and `study.tools.fine.filament.diameter_mm` are both given",
        ],
    ),
    (
        "",
        "[study.tools.fine]\npenetration_depth_mm = 1\n",
        &["unknown key `study.tools.fine.penetration_depth_mm`"],
    ),
    (
        "",
        "--set filament.length_mm=-1",
        &[
            "`filament.length_mm` is -1, which is -0.001 m",
            "--> --set:1:20",
        ],
    ),
    (
        "",
        "--set filament.length_mm=40 filament.length_m=0.04",
        &[
            "`filament.length_m` and `filament.length_mm` are both given",
            "--> --set:1:1",
        ],
    ),
];

#[test]
fn mistakes_in_other_units_are_told_as_they_were_written() {
    for (right, wrong, parts) in MISTAKEN_UNITS {
        assert!(FILE.contains(right), "{right}");
        let (lines, options) = wrong
            .strip_prefix("--set ")
            .map_or((*wrong, ""), |options| ("", options));
        let text = if right.is_empty() {
            format!("{FILE}{lines}")
        } else {
            FILE.replacen(right, lines, 1)
        };
        let options: Vec<String> = options.split_whitespace().map(str::to_owned).collect();
        let read = || Document::parse_with(&text, "case.toml", &options);
        let error = match read().and_then(|document| {
            document
                .study()
                .map(drop)
                .and(document.settings().map(drop))
        }) {
            // Without sweeps only the settings are at fault.
            Err(error) if error.to_string().starts_with("`study` is missing") => read()
                .and_then(|document| document.settings())
                .expect_err(wrong),
            error => error.expect_err(wrong),
        };
        for part in *parts {
            assert!(
                error.to_string().contains(part),
                "{wrong}: no `{part}` in\n{error}"
            );
        }
    }
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
