//! The number of filaments: stated directly or by the packing, never assumed. Defaults that decide
//! the force are reported, and documents and advice state the effect of friction.

use std::f64::consts::{PI, TAU};

use bristle::model::settings::Settings;
use bristle::simulation::simulate;

use crate::program::{Workspace, has, is_near, lacks, settings, words};

/// Returns a file with this line about the number of filaments.
fn file(count: &str) -> String {
    format!(
        "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\n{count}\n[filament]\nsegments = 4\nlength_m = 0.040\n\
         diameter_m = 1.18e-3\n[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n"
    )
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
    let by_area = settings(&file("filaments_per_m2 = 6e5")).tool;
    is_near(by_area.filament_count, 6e5 * SURFACE_M2, 1e-14);
    let by_share = settings(&file("fill_factor = 0.5"));
    is_near(
        by_share.tool.filament_count,
        0.5 * SURFACE_M2 / AREA_M2,
        1e-14,
    );
    is_near(by_share.fill_factor(), 0.5, 1e-15);
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
            "assumed F_n,w at +10 %",
            "filament.damping_ratio",
            "contact.stiffness_n_m",
            "contact.friction_coefficient 0 at 0.1: -",
            "at v_b = 10 m/s, a_e = 1 mm.",
            "bristle explain friction",
        ],
    );
    lacks(&told, &["filament.youngs_modulus_pa"]);

    let told = said(
        &(stated + "[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n"),
        "study case.toml --out results",
    );
    has(&told, &["assumed", "(row "]);
    has(
        &directory.read("results/report.html"),
        &[r#""path":"filament.damping_ratio""#, r#""force_change":"#],
    );
}

#[test]
fn documents_and_advice_say_what_friction_does() {
    let force = |friction: f64| {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.contact.friction_coefficient = friction;
        simulate(&settings)
            .expect("a pass")
            .metrics
            .tool_contact_normal_force_n
    };
    let [none, little, usual, much] =
        [0.0, 0.1, 0.3, 0.5].map(|friction| format!("{:.0}", force(friction)));
    let told = format!("{none}, {little}, {usual} and {much} N");
    for page in [
        include_str!("../../../../README.md"),
        include_str!("../../../../docs/input.md"),
    ] {
        has(page, &[&told]);
    }
    let directory = Workspace::with(&format!(
        "{}[study]\nbrushing_velocity_m_s = [5.0, 10.0]\n",
        file("filament_count = 10500")
    ));
    directory.run("study case.toml --out results");
    let text = directory.printed("advise results");
    has(&words(&text), &[&told]);
}
