//! Keys in other units than those of the settings.

use crate::grid::Sweep;
use crate::input::document::Document;

use super::FILE;

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
