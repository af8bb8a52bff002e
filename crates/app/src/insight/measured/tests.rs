//! Tests of comparisons with measured forces.

use super::*;
use crate::insight::testing::{self, metrics_of, with_force};
use bristle_study::grid::{DEPTH, Sweep, VELOCITY};
use bristle_study::input::measured::Speed;
use bristle_study::text::layout::WIDTH;

/// Returns a study with two velocities and three depths at unequal distances.
pub(super) fn study() -> Study {
    let text = "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\n\
         filament_count_uncertainty = 100\n[filament]\nlength_m = 0.040\ndiameter_m = 1.18e-3\n[study]\n\
         brushing_velocity_m_s = [20.0, 10.0]\npenetration_depth_m = [1e-3, 2e-3, 4e-3]";
    testing::study(text)
}

/// Returns forces of 10 N s/m · v_b + 10⁵ N/m · a_e; the case `failed` is an error.
fn results(study: &Study, failed: Option<usize>) -> Vec<CaseResult> {
    let case = |case: usize| {
        let process = study.settings(case).process;
        let force = 10.0 * process.brushing_velocity_m_s + 1e5 * process.penetration_depth_m;
        match failed {
            Some(number) if number == case => Err("failed".to_owned()),
            _ => with_force(force, 0.0),
        }
    };
    (0..study.case_count()).map(case).collect()
}

pub(super) fn point(
    velocity: f64,
    penetration_depth_m: f64,
    force_n: f64,
    std_n: impl Into<Option<f64>>,
) -> Measurement {
    Measurement {
        speed: Speed::Velocity(velocity),
        second_speed_rpm: None,
        penetration_depth_m,
        force_n,
        std_n: std_n.into(),
        tool: None,
    }
}

#[test]
fn forces_are_interpolated_within_the_study_only() {
    let study = study();
    assert_eq!(
        study.sweeps().iter().map(Sweep::path).collect::<Vec<_>>(),
        [DEPTH, VELOCITY]
    );
    let force = |velocity, depth, failed| {
        let comparison = compare(
            &study,
            &results(&study, failed),
            &[point(velocity, depth, 0.0, 0.0)],
        );
        comparison[0].points[0]
            .simulated
            .map(|simulated| simulated.force_n)
    };
    let near = |found: Result<f64, Missing>, expected: f64| {
        assert!(
            (found.expect("a force") - expected).abs() < 1e-9,
            "{found:?}, not {expected}"
        );
    };
    near(force(10.0, 1e-3, None), 200.0);
    near(force(20.0, 4e-3, None), 600.0);
    // Bilinear interpolation reproduces a linear function.
    near(force(12.5, 3e-3, None), 425.0);
    near(force(10.0 * (1.0 + 1e-12), 1e-3, None), 200.0);
    for (velocity, depth) in [(9.9, 2e-3), (20.1, 2e-3), (15.0, 0.9e-3), (15.0, 4.1e-3)] {
        assert_eq!(force(velocity, depth, None), Err(Missing::Outside));
    }
    // Case 0 is at 20 m/s and 1 mm. It matters only where it has a weight.
    assert_eq!(force(15.0, 1e-3, Some(0)), Err(Missing::Failed));
    near(force(10.0, 1e-3, Some(0)), 200.0);
    near(force(15.0, 3e-3, Some(0)), 450.0);
}

#[test]
fn rotational_speeds_are_compared_at_their_velocity() {
    let study = study();
    let mut settings = study.settings(0);
    settings.process.brushing_velocity_m_s = 12.5;
    let speed = Speed::Rotational(settings.rotational_speed_rpm());
    let measured = [Measurement {
        speed,
        ..point(0.0, 3e-3, 400.0, 30.0)
    }];
    let comparisons = compare(&study, &results(&study, None), &measured);
    let found = comparisons[0].points[0];
    assert!(
        (found.across - 12.5).abs() < 1e-12 && found.is_within() == Some(true),
        "{found:?}"
    );
    let table = comparison_table(&comparisons, WIDTH);
    assert!(
        table.contains("\n    n_w  a_e ") && table.contains("\n    rpm   mm "),
        "{table}"
    );
    let mut written = Vec::new();
    write_comparison(&mut written, &comparisons).expect("memory takes what is written to it");
    assert!(written.starts_with(b"rotational_speed_rpm,penetration_depth_m,measured_force_n,"));
}

#[test]
fn deviations_are_those_computed_by_hand() {
    let study = study();
    // The simulated forces are 200, 300 and 400, the differences −10, +20 and +5. The last
    // point is outside.
    let measured = [
        point(10.0, 1e-3, 210.0, 10.0),
        point(20.0, 1e-3, 280.0, 19.0),
        point(20.0, 2e-3, 395.0, 6.0),
        point(30.0, 2e-3, 1.0, 1.0),
    ];
    let comparisons = compare(&study, &results(&study, None), &measured);
    assert_eq!(comparisons.len(), 1);
    let deviation = comparisons[0].deviation().expect("three points");
    assert_eq!((deviation.count, deviation.within), (3, Some(2)));
    assert!((deviation.bias_n - 5.0).abs() < 1e-9);
    assert!((deviation.rmse_n - 175.0_f64.sqrt()).abs() < 1e-9);
    let uncertainty = comparisons[0].points[0]
        .simulated
        .expect("a force")
        .uncertainty_n;
    assert!(
        (uncertainty - 20.0).abs() < 1e-9,
        "a tenth, like that of the filaments"
    );
    let table = comparison_table(&comparisons, WIDTH);
    assert!(
        table.contains("3 of 4 points compared: bias +5.0 N, RMSE 13.2 N, within ± std 2 (67 %)"),
        "{table}"
    );

    let unsure = measured.map(|point| Measurement {
        std_n: None,
        ..point
    });
    let comparisons = compare(&study, &results(&study, None), &unsure);
    assert_eq!(
        comparisons[0].deviation(),
        Some(ForceDeviation {
            within: None,
            ..deviation
        })
    );
    let table = comparison_table(&comparisons, WIDTH);
    assert!(
        table.contains("RMSE 13.2 N\n") && !table.contains("std"),
        "{table}"
    );

    let outside = compare(&study, &results(&study, None), &measured[3..]);
    assert_eq!(outside[0].deviation(), None);
    assert!(comparison_table(&outside, WIDTH).contains("no point can be compared"));
}

#[test]
fn large_forces_have_a_finite_deviation() {
    let study = study();
    let mut results = results(&study, None);
    for (index, result) in results.iter_mut().enumerate() {
        let sign = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
        metrics_of(result).tool_contact_normal_force_n = sign * 1e308;
    }
    let measured = [
        point(20.0, 1e-3, -bristle_study::input::measured::LARGEST, 0.0),
        point(10.0, 1e-3, bristle_study::input::measured::LARGEST, 0.0),
    ];
    let comparisons = compare(&study, &results, &measured);
    let deviation = comparisons[0].deviation().expect("two points");
    assert!(
        deviation.rmse_n == 1e308 && deviation.bias_n.abs() <= 1e308,
        "{deviation:?}"
    );
    let table = comparison_table(&comparisons, WIDTH);
    assert!(
        table.contains("RMSE 1.00e308 N")
            && table.lines().all(|line| line.chars().count() <= WIDTH),
        "{table}"
    );
}
