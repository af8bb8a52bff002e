//! The lateral amplification of planar passes, compared with spatial passes of slightly tilted
//! clamps.

use std::f64::consts::PI;

use bristle::model::metrics::{Metrics, UNSTABLE_AMPLIFICATION};
use bristle::model::settings::{Settings, WorkpieceKind};

use crate::common::{case, metrics};

/// Tolerance of the comparisons with exact derivatives: its error is far below their limits.
const TIGHT: f64 = 1e-9;
/// Largest `|z_tip|/l_f` of the tilted passes. The motion is odd in the tilt, so that the ratio
/// deviates by the square of this.
const MAX_EXCURSION: f64 = 1e-3;

/// Cases of the paper's brush, each with its change.
fn cases() -> [(&'static str, Settings); 14] {
    let plain = |velocity, depth| case(25, velocity, depth);
    let with = |velocity, depth, change: fn(&mut Settings)| {
        let mut settings = plain(velocity, depth);
        change(&mut settings);
        settings
    };
    [
        ("sweeping", plain(10.0, 1e-3)),
        ("striking", case(10, 25.0, 2e-3)),
        ("slow", plain(5.0, 5e-3)),
        ("slower", plain(2.5, 1.5e-3)),
        ("slower and deeper", plain(2.5, 2.5e-3)),
        (
            "friction",
            with(2.5, 5e-3, |settings| {
                settings.contact.friction_coefficient = 0.1
            }),
        ),
        (
            "slight friction",
            with(5.0, 4e-3, |settings| {
                settings.contact.friction_coefficient = 0.02
            }),
        ),
        (
            "damping",
            with(5.0, 3e-3, |settings| settings.filament.damping_ratio = 0.4),
        ),
        (
            "gravity",
            with(5.0, 3e-3, |settings| {
                settings.process.gravity_m_s2 = [30.0, -98.1, 0.0]
            }),
        ),
        (
            "contact radius",
            with(5.0, 3e-3, |settings| settings.contact.radius_m = 0.5e-3),
        ),
        (
            "wavy and tapered",
            with(10.0, 1e-3, |settings| {
                settings.filament.waviness_amplitude_m = 0.5e-3;
                settings.filament.tip_diameter_m = Some(1e-3);
            }),
        ),
        (
            "feed",
            with(5.0, 3e-3, |settings| {
                settings.workpiece.feed_velocity_m_s = 2.0
            }),
        ),
        (
            "exponent",
            with(5.0, 3e-3, |settings| {
                (settings.contact.exponent, settings.contact.stiffness_n_m) = (1.5, 1e7)
            }),
        ),
        (
            "another normal and contact damping",
            with(4.0, 2e-3, |settings| {
                settings.workpiece.kind = WorkpieceKind::plane([1.0, 2.0, 0.0]);
                settings.contact.damping_s_m = 0.5;
            }),
        ),
    ]
}

/// The metrics of a pass with a tilt of the clamp in rad, at a tolerance.
fn pass(settings: &Settings, tilt: f64, tolerance: f64) -> Metrics {
    let mut settings = settings.clone();
    settings.filament.lateral_tilt_rad = tilt;
    settings.solver.relative_tolerance = tolerance;
    metrics(&settings)
}

fn amplification(settings: &Settings, tilt: f64, tolerance: f64) -> f64 {
    pass(settings, tilt, tolerance).lateral_amplification
}

#[test]
fn the_amplification_is_that_of_a_small_tilt() {
    let mut unstable = 0;
    for (name, settings) in cases() {
        let expected = amplification(&settings, 0.0, TIGHT);
        let measured = amplification(&settings, MAX_EXCURSION / expected, TIGHT);
        assert!(
            (measured / expected - 1.0).abs() < 0.01,
            "{name}: {measured} for {expected}"
        );
        unstable += usize::from(expected > UNSTABLE_AMPLIFICATION);
    }
    assert!((4..=9).contains(&unstable), "{unstable} are unstable");
}

#[test]
fn at_the_default_tolerance_the_amplification_is_accurate() {
    for (name, settings) in cases() {
        let [default, exact] =
            [1e-6, TIGHT].map(|tolerance| amplification(&settings, 0.0, tolerance));
        assert!(
            (default / exact - 1.0).abs() < 0.005,
            "{name}: {default} instead of {exact}"
        );
    }
}

#[test]
fn a_spatial_pass_without_a_tilt_has_no_amplification() {
    let mut settings = case(10, 20.0, 1e-3);
    settings.process.gravity_m_s2 = [0.0, 0.0, 9.81];
    let metrics = pass(&settings, 0.0, 1e-6);
    assert_eq!(
        (metrics.lateral_amplification, metrics.laterally_unstable),
        (0.0, false)
    );
}

/// A half turn about `x` or `y` turns the tool over; a plane sees the same filaments.
#[test]
fn a_tool_turned_over_has_the_same_amplification() {
    let upright = metrics(&case(12, 2.5, 1e-3));
    assert!(upright.lateral_amplification > UNSTABLE_AMPLIFICATION);
    for (tilt, skew) in [(PI, 0.0), (0.0, PI)] {
        let mut settings = case(12, 2.5, 1e-3);
        (settings.tool.tilt_rad, settings.tool.skew_rad) = (Some(tilt), skew);
        let over = metrics(&settings);
        let ratio = over.lateral_amplification / upright.lateral_amplification;
        assert!((ratio - 1.0).abs() < 1e-6, "{tilt} {skew}: {ratio}");
    }
}
