use bristle_grid::{Sweep, TOOL, VELOCITY};

use super::Document;
use crate::testing::brush;

const FILE: &str = concat!(brush!(25), "[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1.0e-3\n");

#[test]
fn named_tools_change_slowest_and_have_their_own_settings() {
    let text = "[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n\"contact.exponent\" = [1.0, 1.5]\n\
         [study.tools.file]\n[study.tools.tapered]\nfilament.tip_diameter_m = 1e-3\n\
         [study.tools.packed]\ntool.fill_factor = 0.5\nfilament.diameter_m = 1e-3\n";
    let text = format!("{FILE}{text}");
    let study = Document::parse(&text, "tools").and_then(|document| document.study()).expect("a study");
    assert_eq!((study.case_count(), study.tool_names()), (12, vec!["file".into(), "tapered".into(), "packed".into()]));
    assert_eq!(study.sweeps().iter().map(Sweep::path).collect::<Vec<_>>(), [TOOL, "contact.exponent", VELOCITY]);
    assert_eq!(study.values(7).collect::<Vec<_>>(), [1.0, 1.5, 10.0]);
    // What a tool leaves out is the file's, also where it has no number.
    let tips = [0, 4, 8].map(|case| study.settings(case).filament.tip_diameter_m);
    assert_eq!(tips, [None, Some(1e-3), None]);
    assert_eq!((study.tools()[1].held.len(), study.tools()[2].held.len()), (0, 1));
    assert!((study.settings(11).fill_factor() - 0.5).abs() < 1e-12 && study.settings(11).contact.exponent == 1.5);
}

#[test]
fn impossible_tools_are_blamed_on_their_deviation() {
    let error_at = |depth: &str, uncertainty: &str| {
        let text = format!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\nfilament_count_uncertainty = 600\n[filament]\nlength_m = 0.040\ndiameter_m = 1.0e-3\n\
             [process]\nbrushing_velocity_m_s = 18.0\npenetration_depth_m = {depth}\n[uncertainty]\n{uncertainty}"
        );
        let settings = Document::parse(&text, "case.toml").and_then(|document| document.settings());
        settings.expect_err("impossible").to_string()
    };
    let error = |uncertainty: &str| error_at("1.0e-3", uncertainty);
    let damping = error("damping_ratio_std = 0.04");
    assert!(
        damping.contains("`uncertainty.damping_ratio_std` is 0.04") && damping.contains("case.toml:13:"),
        "{damping}"
    );
    assert!(error("length_std_m = 0.02\ndiameter_std_m = 1e-9").contains("`uncertainty.length_std_m` is 0.02"));
    // Of the two inputs that scatter, only the length can be at fault.
    let deep = error_at("39e-3", "length_std_m = 1e-3\nyoungs_modulus_std_pa = 6e8");
    assert!(deep.contains("`uncertainty.length_std_m`"), "{deep}");
    assert!(error("samples = 63").contains("a whole number from 64 to 65536"));
    assert!(error("hold = \"depth\"").contains("process"));
}
