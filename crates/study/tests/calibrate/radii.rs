//! Calibrations of edge radii over time that were simulated with a known coefficient.

use bristle::model::settings::{
    EdgeSettings, ObservedEdge, RemovalGoal, RemovalSettings, Settings, Side, WorkpieceKind,
};
use bristle::simulation::Stop;
use bristle_study::calibrate::{
    Calibration, CalibrationContext, Interrupted, MeasurementLimits, Problem, STARTS,
    SilentObserver, calibrate, summary,
};
use bristle_study::grid::Resources;
use bristle_study::grid::removal::{Removal, remove};
use bristle_study::input::measured::{Brushed, MeasuredRadius, Reading};

use crate::{change_when_checked, fitted};

const PRESTON: &str = "removal.preston_m2_n";
const START: &str = "workpiece.edge_radius_m";
const TRUTH: f64 = 3e-14;
const START_M: f64 = 60e-6;
const TIMES: [f64; 8] = [20.0, 40.0, 60.0, 120.0, 180.0, 240.0, 300.0, 400.0];
/// Numbers of a standard normal distribution.
const NOISE: [f64; 8] = [0.46, -1.36, 0.65, 0.12, -0.73, 1.48, -0.31, 0.05];

fn brush() -> Settings {
    brush_at(-5e-3)
}

/// Returns a brush whose filaments enter at an edge with this offset (m).
fn brush_at(offset_m: f64) -> Settings {
    let mut settings = Settings::paper(10.0, 2e-3);
    settings.filament.segments = 6;
    settings.contact.friction_coefficient = 0.3;
    let edge = EdgeSettings {
        side: Side::Entering,
        offset_m,
        edge_radius_m: START_M,
        ..EdgeSettings::default()
    };
    settings.workpiece.kind = WorkpieceKind::Edge(edge);
    settings
}

fn point(time: f64, value: f64, std: Option<f64>) -> MeasuredRadius {
    MeasuredRadius {
        brushed: Brushed::Time(time),
        radius: Reading { value, std },
        line: 2,
    }
}

/// Simulates the edge of a brush over time, as `bristle remove` does.
fn removal(mut settings: Settings) -> Removal {
    let until = Some(RemovalGoal::TimeS(TIMES[7]));
    let old = settings.removal_or_default();
    settings.removal = Some(RemovalSettings {
        preston_m2_n: Some(TRUTH),
        until,
        ..old
    });
    remove(
        &settings,
        Resources::default(),
        &Stop::default(),
        &|_, _| {},
    )
    .expect("an edge")
}

/// Returns radii at the times, with a standard deviation and multiples of it as noise.
fn radii(settings: &Settings, std: f64, noise: f64) -> Vec<MeasuredRadius> {
    let rows = removal(settings.clone()).rows;
    let at = |time: f64| {
        let after = rows.partition_point(|row| row.time_s < time).max(1);
        let (left, right) = (&rows[after - 1], &rows[after]);
        let share = (time - left.time_s) / (right.time_s - left.time_s);
        let [a, b] = [left, right].map(|row| row.edge_radius_m.powi(2));
        (a + share * (b - a)).sqrt()
    };
    TIMES
        .iter()
        .zip(NOISE)
        .map(|(time, own)| point(*time, at(*time) + noise * own * std, Some(std)))
        .collect()
}

fn calibrated(settings: Settings, keys: &[&str], points: Vec<MeasuredRadius>) -> Calibration {
    let problem = Problem::of_radii(settings, fitted(keys), points).expect("a problem");
    fit(problem).expect("an edge that grows")
}

fn fit(problem: Problem) -> Result<Calibration, Interrupted> {
    let stop = Stop::default();
    let means = CalibrationContext {
        resources: Resources::default(),
        stop: &stop,
        observer: &SilentObserver,
        starts: STARTS,
    };
    Ok(calibrate(problem, MeasurementLimits::default(), means)?.expect("a start"))
}

/// Returns the summary in one line.
fn words(found: &Calibration) -> String {
    summary(found, 80)
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

#[test]
fn radii_give_their_coefficient_and_the_radius_at_the_start() {
    let exact = calibrated(brush(), &[PRESTON], radii(&brush(), 2e-6, 0.0));
    assert!(
        (exact.values[0] / TRUTH - 1.0).abs() < 2e-3,
        "{}",
        exact.values[0]
    );
    // The passes of the calibration end at the largest radius, those of the removal beyond it.
    assert!(exact.chi_squared < 0.05, "{}", exact.chi_squared);
    let change = change_when_checked(&exact);
    assert!(0.0 < change && change < 1e-2, "{change}");
    let noisy = calibrated(brush(), &[PRESTON], radii(&brush(), 2e-6, 1.0));
    let error = noisy.standard_error(0);
    assert!(
        (noisy.values[0] - TRUTH).abs() < 2.0 * error && error < 0.03 * TRUTH,
        "{} ± {error}",
        noisy.values[0]
    );
    let [low, high] = noisy.intervals[0].expect("it is determined");
    assert!(low < TRUTH && TRUTH < high);
    assert!((noisy.probability().expect("standard deviations") - 0.5).abs() < 0.49);
    // The radius at the start is sought from sharp on, whatever the file states.
    let mut wrong = brush();
    wrong.workpiece.kind.set_edge_radius_m(0.0);
    let keys = [PRESTON, START];
    let both = calibrated(wrong, &keys, radii(&brush(), 2e-6, 1.0));
    for (setting, truth) in [TRUTH, START_M].into_iter().enumerate() {
        let (value, error) = (both.values[setting], both.standard_error(setting));
        assert!(
            (value - truth).abs() < 2.5 * error,
            "{}: {value} ± {error}",
            keys[setting]
        );
    }
    assert!(both.errors.correlation(0, 1) < 0.0 && both.standard_error(0) > error);
}

#[test]
fn errors_follow_what_is_stated() {
    // Twice as much noise: the error follows what is stated, and the value the noise.
    let [sure, unsure] =
        [1e-6, 2e-6].map(|std| calibrated(brush(), &[PRESTON], radii(&brush(), std, 1.0)));
    let ratio = unsure.standard_error(0) / sure.standard_error(0);
    assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
    let [near, far] = [&sure, &unsure].map(|found| (found.values[0] / TRUTH).ln());
    assert!((far / near - 2.0).abs() < 0.2, "{near} {far}");
}

#[test]
fn it_is_said_whether_the_square_root_of_time_fits() {
    let curve = |exponent: f64, std: Option<f64>| -> Vec<MeasuredRadius> {
        let radius =
            |time: f64| (START_M.powi(2) + (150e-6 * (time / 240.0).powf(exponent)).powi(2)).sqrt();
        TIMES
            .iter()
            .map(|time| point(*time, radius(*time), std))
            .collect()
    };
    let verdict = |exponent: f64, std: Option<f64>| {
        let found = calibrated(brush(), &[PRESTON], curve(exponent, std));
        let root = found.square_root.clone().expect("it is fitted");
        (found.square_root_fits(&root), root, words(&found))
    };
    let (fits, root, said) = verdict(0.5, Some(2e-6));
    assert!(
        fits == Some(true) && root.chi_squared < 1e-3,
        "{}",
        root.chi_squared
    );
    let expected = 150e-6 / 240.0_f64.sqrt();
    assert!(
        (root.c_m_per_sqrt_s / expected - 1.0).abs() < 1e-4,
        "{} {expected}",
        root.c_m_per_sqrt_s
    );
    assert!(
        said.contains(
            "the square root of time fits the radii: R² = R_0² + c² t with c = 9.68 µm/√s"
        ),
        "{said}"
    );
    for std in [Some(2e-6), None] {
        let (fits, _, said) = verdict(0.25, std);
        assert_eq!(fits, Some(false), "{said}");
        assert!(
            said.contains("the square root of time does not fit the radii"),
            "{said}"
        );
        assert!(
            said.contains("early radii are larger than it says, late ones smaller"),
            "{said}"
        );
    }
    let (_, _, said) = verdict(1.0, Some(2e-6));
    assert!(
        said.contains("early radii are smaller than it says, late ones larger"),
        "{said}"
    );
    let one = calibrated(brush(), &[PRESTON], curve(0.5, Some(2e-6))[7..].to_vec());
    assert!(words(&one).contains("cannot be told"), "{}", words(&one));
    assert!(one.chi_squared < 1e-3 && one.json().contains("\"fits\": null"));
}

#[test]
fn turns_are_as_good_as_times_and_wear_is_followed() {
    let mut worn = brush();
    worn.removal = Some(RemovalSettings {
        filament_wear_m2_n: Some(2e-10),
        ..RemovalSettings::default()
    });
    let second_per_turn = std::f64::consts::TAU / worn.angular_velocity_rad_s();
    let points = radii(&worn, 2e-6, 0.0);
    let new = radii(&brush(), 2e-6, 0.0);
    assert!(
        points[7].radius.value < 0.99 * new[7].radius.value,
        "wear slows the growth"
    );
    let turns = points.into_iter().map(|own| match own.brushed {
        Brushed::Time(time) => MeasuredRadius {
            brushed: Brushed::Turns(time / second_per_turn),
            ..own
        },
        Brushed::Turns(_) => own,
    });
    let found = calibrated(worn, &[PRESTON], turns.collect());
    assert!(
        (found.values[0] / TRUTH - 1.0).abs() < 5e-3,
        "{}",
        found.values[0]
    );
    let times = found.problem.radii.as_ref().expect("radii");
    assert!((times.time_s(7) / TIMES[7] - 1.0).abs() < 1e-12);
}

#[test]
fn what_radii_cannot_tell_is_refused() {
    let std = Some(2e-6);
    let two = || vec![point(60.0, 90e-6, std), point(120.0, 0.1e-3, std)];
    let refused = |settings: Settings, keys: &[&str], points: Vec<MeasuredRadius>| {
        Problem::of_radii(settings, fitted(keys), points)
            .expect_err("refused")
            .to_string()
    };
    let friction = "contact.friction_coefficient";
    assert!(
        refused(brush(), &[PRESTON, friction], two())
            .contains("do not tell `contact.friction_coefficient`")
    );
    assert!(refused(brush(), &[], two()).starts_with("state what is to be fitted"));
    assert!(refused(brush(), &[PRESTON, PRESTON], two()).contains("twice"));
    let mut plane = brush();
    plane.workpiece = Settings::paper(10.0, 1e-3).workpiece;
    for keys in [&[PRESTON][..], &[PRESTON, START]] {
        assert!(
            refused(plane.clone(), keys, two())
                .contains("`workpiece.kind` has no edge that grows round")
        );
    }
    let mut trial = brush();
    let observed = Some(ObservedEdge {
        edge_radius_m: 1e-4,
        edge_radius_std_m: None,
        time_s: 60.0,
    });
    trial.removal = Some(RemovalSettings {
        observed,
        ..RemovalSettings::default()
    });
    assert!(refused(trial, &[PRESTON], two()).contains("make it a row of the measured table"));
    assert!(
        refused(brush(), &[START], two()).starts_with("state `removal.preston_m2_n`, or fit it")
    );
    let few = refused(brush(), &[PRESTON, START], two()[..1].to_vec());
    assert!(
        few.starts_with("1 measured radii cannot determine 2 settings"),
        "{few}"
    );
    assert!(refused(brush(), &[PRESTON], vec![point(0.0, 90e-6, std)]).contains("after some time"));
    let below = refused(
        brush(),
        &[PRESTON],
        vec![point(60.0, 50e-6, std), point(120.0, 0.1e-3, std)],
    );
    assert!(
        below.contains("a radius of 5e-5 m is below that at the start, 6e-5 m"),
        "{below}"
    );
    let zero = refused(brush(), &[PRESTON], vec![point(60.0, 90e-6, Some(0.0))]);
    assert!(
        zero.contains("the standard deviation of `edge_radius_m` is 0"),
        "{zero}"
    );
    assert!(
        refused(
            brush(),
            &[PRESTON],
            vec![two()[0], point(120.0, 0.1e-3, None)]
        )
        .contains("others have")
    );
    // Filaments that miss the edge.
    let missed = brush_at(-60e-3);
    let error = fit(Problem::of_radii(missed, fitted(&[PRESTON]), two()).expect("a problem"))
        .expect_err("no work");
    assert!(error.to_string().contains("is never reached"), "{error}");
}
