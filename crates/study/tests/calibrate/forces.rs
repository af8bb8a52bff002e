//! Calibrations of forces that were simulated with known settings.

use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_study::calibrate::{
    Calibration, CalibrationContext, Fitted, MeasurementLimits, Problem, STARTS, SilentObserver,
    ToolPlace, calibrate, summary,
};
use bristle_study::grid::{Resources, Study, run_study};
use bristle_study::input::document::StatedBrush;
use bristle_study::input::measured::{MeasuredPoint, Reading, Speed};
use serde::Deserialize;

use crate::{change_when_checked, fitted};

/// Returns the brush of the paper with few segments.
fn brush() -> Settings {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 6;
    settings
}

fn stated(settings: Settings) -> Vec<StatedBrush> {
    vec![StatedBrush {
        name: String::new(),
        settings,
        followed: Vec::new(),
    }]
}

fn point(velocity: f64, penetration_depth_m: f64, value: f64, std: Option<f64>) -> MeasuredPoint {
    MeasuredPoint {
        speed: Speed::Velocity(velocity),
        second_speed_rpm: None,
        penetration_depth_m,
        readings: [Some(Reading { value, std }), None, None, None],
        tool: None,
        line: 2,
    }
}

/// Simulates the forces of a brush at all combinations of speeds and depths, with a relative
/// standard deviation.
fn simulated(
    truth: &Settings,
    speeds: &[f64],
    depths: &[f64],
    std: Option<f64>,
) -> Vec<MeasuredPoint> {
    let mut settings = truth.clone();
    settings.solver.relative_tolerance = 1e-8;
    let pairs = speeds
        .iter()
        .flat_map(|&speed| depths.iter().map(move |&depth| (speed, depth)));
    let cases: Vec<Settings> = pairs
        .map(|(speed, depth)| {
            let mut case = settings.clone();
            (
                case.process.brushing_velocity_m_s,
                case.process.penetration_depth_m,
            ) = (speed, depth);
            case
        })
        .collect();
    let results = run_study(&Study::of_cases(cases.clone()), None, || ()).expect("threads");
    let measured =
        |(case, result): (Settings, Result<bristle_study::grid::CaseSummary, String>)| {
            let force = result.expect("a pass").metrics.tool_contact_normal_force_n;
            let process = case.process;
            point(
                process.brushing_velocity_m_s,
                process.penetration_depth_m,
                force,
                std.map(|std| std * force),
            )
        };
    cases.into_iter().zip(results).map(measured).collect()
}

fn calibrated(problem: Problem, starts: usize) -> Calibration {
    let stop = Stop::default();
    let means = CalibrationContext {
        resources: Resources::default(),
        stop: &stop,
        observer: &SilentObserver,
        starts,
    };
    calibrate(problem, MeasurementLimits::default(), means)
        .expect("nothing stops it")
        .expect("starts that can be simulated")
}

#[test]
fn exact_forces_give_the_settings_from_far_away() {
    let keys = ["filament.youngs_modulus_pa", "contact.friction_coefficient"];
    let mut truth = brush();
    (
        truth.filament.youngs_modulus_pa,
        truth.contact.friction_coefficient,
    ) = (2.1e9, 0.22);
    let mut far = brush();
    far.filament.youngs_modulus_pa = 2e10;
    let points = simulated(&truth, &[5.0, 15.0, 30.0], &[1e-3, 3e-3], Some(0.03));
    let found = calibrated(
        Problem::new(stated(far), fitted(&keys), points).expect("a problem"),
        STARTS,
    );
    for (value, truth) in found.values.iter().zip([2.1e9, 0.22]) {
        assert!((value / truth - 1.0).abs() < 1e-3, "{value}, not {truth}");
    }
    assert!(
        found.chi_squared < 1e-3 && found.undetermined.is_empty(),
        "{}",
        found.chi_squared
    );
    let change = change_when_checked(&found);
    assert!(0.0 < change && change < 1e-3, "{change}");
    for (interval, truth) in found.intervals.iter().zip([2.1e9, 0.22]) {
        let [low, high] = interval.expect("it is determined");
        assert!(low < truth && truth < high, "{low} to {high}");
    }
    // A tenth of the noise, a tenth of the errors; the linear theory and the profile agree where
    // the noise is small.
    let points = simulated(&truth, &[5.0, 15.0, 30.0], &[1e-3, 3e-3], Some(0.003));
    let sure = calibrated(
        Problem::new(stated(truth), fitted(&keys), points).expect("a problem"),
        0,
    );
    for setting in 0..2 {
        let ratio = found.standard_error(setting) / sure.standard_error(setting);
        assert!((ratio - 10.0).abs() < 0.5, "{ratio}");
        let [low, high] = sure.intervals[setting].expect("it is determined");
        let width = (high - low) / (2.0 * 1.96 * sure.standard_error(setting));
        assert!((width - 1.0).abs() < 0.1, "{width}");
    }
    assert!(sure.next.len() == 3 && sure.next[0].gain > 1.0);
}

/// Forces by CasADi and CVODES, `derivations/passes.py calibration`, and the constants that they
/// were computed with.
#[derive(Deserialize)]
struct ForceReference {
    cases: Vec<OfPoint>,
    constants: TrueConstants,
}

#[derive(Deserialize)]
struct OfPoint {
    brushing_velocity_m_s: f64,
    penetration_depth_m: f64,
    tool_contact_normal_force_n: f64,
    tool_tangential_force_n: f64,
}

#[derive(Deserialize)]
struct TrueConstants {
    segments: usize,
    youngs_modulus_pa: f64,
    friction_coefficient: f64,
    damping_ratio: f64,
}

#[test]
fn forces_of_another_code_give_its_constants() {
    let text = include_str!("../../../../tests/data/reference_calibration.json");
    let ForceReference { cases, constants } = serde_json::from_str(text).expect("a reference");
    assert_eq!(cases.len(), 16);
    let points = cases.iter().map(|case| {
        let reading = |value: f64| {
            Some(Reading {
                value,
                std: Some(0.03 * value),
            })
        };
        let [normal, tangential] = [
            case.tool_contact_normal_force_n,
            case.tool_tangential_force_n,
        ]
        .map(reading);
        let point = point(
            case.brushing_velocity_m_s,
            case.penetration_depth_m,
            1.0,
            None,
        );
        MeasuredPoint {
            readings: [normal, tangential, None, None],
            ..point
        }
    });
    // The values of the paper and another friction.
    let mut wrong = Settings::paper(10.0, 1e-3);
    (wrong.filament.segments, wrong.contact.friction_coefficient) = (constants.segments, 0.3);
    let keys = [
        "filament.youngs_modulus_pa",
        "contact.friction_coefficient",
        "filament.damping_ratio",
    ];
    let found = calibrated(
        Problem::new(stated(wrong), fitted(&keys), points.collect()).expect("a problem"),
        0,
    );
    let truth = [
        constants.youngs_modulus_pa,
        constants.friction_coefficient,
        constants.damping_ratio,
    ];
    for (value, truth) in found.values.iter().zip(truth) {
        assert!((value / truth - 1.0).abs() < 1e-3, "{value}, not {truth}");
    }
    for (force, observation) in found.forces.iter().zip(&found.problem.observations) {
        assert!(
            (force / observation.value - 1.0).abs() < 1e-3,
            "{force}, not {}",
            observation.value
        );
    }
}

#[test]
fn sweeping_filaments_tell_only_a_product() {
    let points = simulated(&brush(), &[1.5, 2.0], &[2e-3, 3e-3], Some(0.03));
    let keys = [
        "filament.youngs_modulus_pa=1e9..1e10",
        "filament.diameter_m=0.8e-3..1.6e-3",
    ];
    let found = calibrated(
        Problem::new(stated(brush()), fitted(&keys), points).expect("a problem"),
        0,
    );
    let [group] = &found.undetermined[..] else {
        panic!("{:?}", found.undetermined)
    };
    let ([_, exponent], error) = group.product.expect("a product");
    assert!(
        (exponent - 4.0).abs() < 0.1 && error < 0.03,
        "{exponent}, {error}"
    );
    assert!(
        group.statement.starts_with("E and d: only E d⁴"),
        "{}",
        group.statement
    );
    assert_eq!(found.intervals, [None, None]);
    assert!(found.json().contains("\"value\": null"));
    assert!(
        summary(&found, 80).starts_with("nothing is determined"),
        "{}",
        summary(&found, 80)
    );
}

#[test]
fn residuals_take_the_place_of_standard_deviations() {
    let truth = brush();
    let mut points = simulated(&truth, &[5.0, 10.0, 20.0], &[1e-3, 2e-3], None);
    for (point, noise) in points
        .iter_mut()
        .zip([0.02, -0.02, 0.02, -0.02, 0.02, -0.02])
    {
        let reading = point.readings[0].as_mut().expect("a force");
        reading.value *= 1.0 + noise;
    }
    let problem = Problem::new(
        stated(truth),
        fitted(&["filament.youngs_modulus_pa"]),
        points,
    )
    .expect("a problem");
    let found = calibrated(problem, 0);
    let scatter = found.errors.scale.sqrt() * 0.03;
    assert!(
        (scatter - 0.02 * (6.0_f64 / 5.0).sqrt()).abs() < 2e-3,
        "{scatter}"
    );
    assert_eq!(found.probability(), None);
}

#[test]
fn the_depth_of_a_point_takes_the_place_of_a_stated_force() {
    let mut pressed = brush();
    pressed.set_tool_force_n(20.0);
    let points = vec![
        point(10.0, 1e-3, 5.0, Some(0.1)),
        point(20.0, 2e-3, 9.0, Some(0.1)),
    ];
    let problem = Problem::new(
        stated(pressed),
        fitted(&["filament.youngs_modulus_pa"]),
        points,
    )
    .expect("a problem");
    for own in &problem.points {
        let process = problem
            .settings(&ToolPlace::of(own), &[2e9])
            .expect("it can be simulated")
            .process;
        assert_eq!(
            (process.tool_force_n, process.penetration_depth_m),
            (None, own.penetration_depth_m)
        );
    }
}

#[test]
fn what_cannot_be_calibrated_is_refused() {
    let force = |value| point(10.0, 1e-3, value, None);
    let refused = |keys: &[&str], points: Vec<MeasuredPoint>| {
        Problem::new(stated(brush()), fitted(keys), points)
            .expect_err("refused")
            .to_string()
    };
    let modulus = "filament.youngs_modulus_pa";
    let (one, friction): (&[&str], &[&str]) = (&[modulus], &["brush.friction_coefficient=0..1"]);
    let with_std = point(10.0, 1e-3, 1.0, Some(0.1));
    for (keys, points, message) in [
        (
            &[][..],
            vec![force(1.0)],
            "state what is to be fitted, as in --fit filament.youngs_modulus_pa",
        ),
        (
            &[modulus, modulus],
            vec![force(1.0)],
            "`filament.youngs_modulus_pa` is to be fitted twice",
        ),
        (
            one,
            vec![force(1.0)],
            "1 measured forces cannot determine 1 settings: measure at least 2 points",
        ),
        (
            one,
            vec![force(1.0), force(0.0)],
            "line 2 of the measured forces: `force_n` is 0: a force that is not above zero",
        ),
        (
            one,
            vec![force(1.0), with_std],
            "line 2 of the measured table: `force_n` has no standard deviation",
        ),
        (
            one,
            vec![force(1.0), point(10.0, 0.05, 1.0, None)],
            "line 2 of the measured forces cannot be simulated",
        ),
        (
            friction,
            vec![force(1.0)],
            "`brush.friction_coefficient` is a setting of filaments that touch",
        ),
    ] {
        let error = refused(keys, points);
        assert!(error.starts_with(message), "{error}");
    }
    for (text, message) in [
        ("filament.segments", "`filament.segments` is a whole number"),
        (
            "filament.modulus",
            "`filament.modulus` is no scalar setting",
        ),
        (
            "process.penetration_depth_m",
            "`process.penetration_depth_m` is no scalar setting",
        ),
        (
            "contact.damping_s_m",
            "`contact.damping_s_m` has no usual range",
        ),
        (
            "filament.damping_ratio=2..1",
            "the bounds 2 and 1 of `filament.damping_ratio` must be",
        ),
        (
            "filament.damping_ratio=low",
            "`filament.damping_ratio=low` is not a setting",
        ),
    ] {
        let error = Fitted::parse(text).expect_err(text).to_string();
        assert!(error.starts_with(message), "{error}");
    }
    let meant = Fitted::parse("filament.youngs_modul")
        .expect_err("no setting")
        .to_string();
    assert!(
        meant.ends_with("lists them; did you mean `filament.youngs_modulus_pa`?"),
        "{meant}"
    );
    assert_eq!(
        Fitted::parse("filament.youngs_modulus_gpa=2..4")
            .expect("a setting")
            .bounds,
        [2e9, 4e9]
    );
}
