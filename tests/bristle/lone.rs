//! Brushes whose filaments do not touch have the results of passes. `tests/agreement` compares
//! random brushes of one filament with their passes.

use bristle::brush::simulate_brush;
use bristle::model::settings::{BrushSettings, Ends, Pattern, Settings};
use bristle::simulation::{Pass, Sampling};

use crate::common::metric;

/// Filaments of a tilted brush, whose rows meet the workpiece at different depths, pass as they do
/// alone if they are far apart.
#[test]
fn filaments_of_a_tilted_brush_are_those_along_its_trim() {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 6;
    settings.contact.friction_coefficient = 0.2;
    (
        settings.tool.tilt_rad,
        settings.tool.skew_rad,
        settings.tool.filament_count,
    ) = (Some(0.03), 0.1, 300.0);
    let brush = BrushSettings {
        columns: Some(1),
        rows: Some(3),
        steady: false,
        ends: Ends::Free,
        pattern: Pattern::Aligned,
        ..BrushSettings::default()
    };
    settings.brush = Some(brush);
    let found = simulate_brush(&settings, 1).expect("a brush");
    assert_eq!(found.filaments.len(), 3);
    let largest = found
        .filaments
        .iter()
        .map(|each| each.metrics.contact_normal_impulse_n_s)
        .fold(0.0, f64::max);
    for filament in &found.filaments {
        let alone = Pass::at(&settings, filament.root_z_m)
            .simulate(Sampling::default())
            .expect("a pass")
            .metrics;
        for key in [
            "contact_normal_impulse_n_s",
            "contact_impulse_x_n_s",
            "contact_impulse_z_n_s",
        ] {
            let [here, there] = [&filament.metrics, &alone].map(|metrics| metric(metrics, key));
            assert!(
                (here - there).abs() <= 1e-3 * largest,
                "{key} at {}: {here} {there}",
                filament.root_z_m
            );
        }
    }
    // On a tilted trim rows do not repeat.
    settings.brush = Some(BrushSettings {
        ends: Ends::Periodic,
        ..settings.brush_or_default()
    });
    assert_eq!(
        settings.check().expect_err("periodic rows").path,
        "brush.ends"
    );
}
