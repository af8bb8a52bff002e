//! The number of filaments: stated as such or by the packing, never assumed; and the defaults that
//! decide the force are told.

use std::f64::consts::{PI, TAU};

use crate::program::{Workspace, has, settings, study, words};

/// A file with this line about the number of filaments.
fn file(count: &str) -> String {
    format!(
        "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\n{count}\n[filament]\nsegments = 4\nlength_m = 0.040\n\
         diameter_m = 1.18e-3\n[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n"
    )
}

/// The numbers of filaments in the two cases of a study.
fn counts(text: &str) -> [f64; 2] {
    let study = study(text);
    assert_eq!(study.case_count(), 2);
    [0, 1].map(|case| study.settings(case).tool.filament_count)
}

const SURFACE_M2: f64 = TAU * 0.140 * 0.020;
const AREA_M2: f64 = PI / 4.0 * 1.18e-3 * 1.18e-3;

#[test]
fn the_packing_gives_the_number() {
    let stated = settings(&file("filament_count = 6000"));
    assert_eq!(
        (
            stated.tool.filament_count,
            stated.tool.filament_count_uncertainty
        ),
        (6000.0, 0.0)
    );
    let by_area = settings(&file("filaments_per_m2 = 6e5"))
        .tool
        .filament_count;
    assert!((by_area / (6e5 * SURFACE_M2) - 1.0).abs() < 1e-14);
    let by_share = settings(&file("fill_factor = 0.5"));
    assert!((by_share.tool.filament_count / (0.5 * SURFACE_M2 / AREA_M2) - 1.0).abs() < 1e-14);
    assert!((by_share.fill_factor() - 0.5).abs() < 1e-15);
}

#[test]
fn a_packing_gives_each_diameter_its_number() {
    let sweeps = "[study]\n\"filament.diameter_m\" = [1e-3, 2e-3]\nrotational_speed_rpm = [600]\n";
    let [thin, thick] = counts(&(file("fill_factor = 0.5") + sweeps));
    assert!((thin / thick - 4.0).abs() < 1e-12);
    // A sweep replaces the number in the file.
    let [loose, dense] =
        counts(&(file("filament_count = 6000") + "[study]\n\"tool.fill_factor\" = [0.3, 0.6]\n"));
    assert!((dense / loose - 2.0).abs() < 1e-12);
}

#[test]
fn defaults_that_decide_the_force_are_told() {
    let directory = Workspace::new();
    let stated = file("filament_count = 6000")
        .replace("segments = 4", "segments = 4\nyoungs_modulus_pa = 3.3e9");
    let said = |text: &str, command: &str| {
        directory.write("case.toml", text);
        directory.printed(command)
    };
    // Sentences are wrapped.
    let told = said(&stated, "simulate case.toml --out one");
    let words = words(&told);
    has(
        &words,
        &[
            "n_w in rpm",
            "F_n,w in N",
            "M_w in N m",
            "P_w in W",
            "assumed F_n,w at +10 %",
            "filament.damping_ratio",
            "contact.stiffness_n_m",
            "contact.friction_coefficient 0 at 0.1: -",
            "at v_b = 10 m/s, a_e = 1 mm.",
            "on steel dry 0.2 to 0.6",
        ],
    );
    assert!(!told.contains("filament.youngs_modulus_pa"), "{told}");
    assert!(
        told.lines().all(|line| line.chars().count() <= 80),
        "{told}"
    );

    let told = said(
        &(stated + "[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"),
        "study case.toml --out results",
    );
    has(&told, &["assumed", "(row "]);
    let page = directory.read("results/report.html");
    assert!(
        page.contains(r#""path":"filament.damping_ratio""#) && page.contains(r#""force_change":"#)
    );
}
