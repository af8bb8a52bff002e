//! How well measured forces determine Young's modulus, friction and damping: the tables of
//! docs/calibration.md, and how often 95 % intervals hold the truth.
//!
//! ```text
//! cargo run --release -p bristle-benches --example calibration            # the tables
//! cargo run --release -p bristle-benches --example calibration -- 200     # the coverage of so many data sets
//! ```

use std::error::Error;

use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_calibrate::{Calibration, Fitted, Means, Problem, Reach, Unwatched, calibrate};
use bristle_grid::{Resources, Study, run_study};
use bristle_input::document::StatedBrush;
use bristle_input::measured::{MeasuredPoint, Reading, Speed};
use fastrand::Rng;

/// The settings that are fitted, and their true values.
const TRUTH: [(&str, f64); 3] = [
    ("filament.youngs_modulus_pa", 2.8e9),
    ("contact.friction_coefficient", 0.15),
    ("filament.damping_ratio", 0.03),
];
/// Speeds in m/s and depths in m of the points.
const POINTS: [(&[f64], &[f64]); 4] = [
    (&[10.0, 30.0], &[1e-3, 3e-3]),
    (&[5.0, 10.0, 20.0, 30.0], &[1e-3, 3e-3]),
    (&[5.0, 10.0, 20.0, 30.0], &[0.5e-3, 1e-3, 2e-3, 3e-3]),
    (
        &[5.0, 7.5, 10.0, 12.5, 15.0, 20.0, 25.0, 30.0],
        &[0.5e-3, 1e-3, 2e-3, 3e-3],
    ),
];
/// Relative standard deviations.
const NOISE: [f64; 3] = [0.01, 0.03, 0.1];

/// The settings of a point, and its normal and tangential force.
type Point = (Settings, [f64; 2]);

/// Forces at the points of a grid without noise.
fn forces(speeds: &[f64], depths: &[f64]) -> Result<Vec<Point>, Box<dyn Error>> {
    let mut settings = Settings::paper(10.0, 1e-3);
    for (path, value) in TRUTH {
        Fitted::parse(path)?.parameter.set(&mut settings, value);
    }
    settings.solver.relative_tolerance = 1e-9;
    let place = |&speed: &f64| depths.iter().map(move |&depth| (speed, depth));
    let cases: Vec<Settings> = speeds
        .iter()
        .flat_map(place)
        .map(|(speed, depth)| {
            let mut case = settings.clone();
            (
                case.process.brushing_velocity_m_s,
                case.process.penetration_depth_m,
            ) = (speed, depth);
            case
        })
        .collect();
    let results = run_study(&Study::of_cases(cases.clone()), None, || ())?;
    let force = |(case, result): (Settings, Result<bristle_grid::CaseSummary, String>)| {
        let metrics = result?.metrics;
        Ok((
            case,
            [
                metrics.tool_contact_normal_force_n,
                metrics.tool_tangential_force_n,
            ],
        ))
    };
    cases.into_iter().zip(results).map(force).collect()
}

/// A calibration of normal forces, and of tangential ones too if they are measured, from the true
/// values on.
fn fit(
    forces: &[Point],
    noise: f64,
    tangential: bool,
    mut number: impl FnMut() -> f64,
) -> Result<Calibration, Box<dyn Error>> {
    let mut reading = |force: f64| {
        Some(Reading {
            value: force * (1.0 + noise * number()),
            std: Some(noise * force),
        })
    };
    let point = |(settings, [normal, along]): &Point| MeasuredPoint {
        speed: Speed::Velocity(settings.process.brushing_velocity_m_s),
        second_speed_rpm: None,
        penetration_depth_m: settings.process.penetration_depth_m,
        readings: [
            reading(*normal),
            tangential.then(|| reading(*along)).flatten(),
            None,
            None,
        ],
        tool: None,
        line: 0,
    };
    let points = forces.iter().map(point).collect();
    let settings = Settings {
        solver: Settings::paper(10.0, 1e-3).solver,
        ..forces[0].0.clone()
    };
    let brush = StatedBrush {
        name: String::new(),
        settings,
        followed: Vec::new(),
    };
    let fitted = TRUTH
        .iter()
        .map(|(path, _)| Fitted::parse(path))
        .collect::<Result<_, _>>()?;
    let problem = Problem::new(vec![brush], fitted, points)?;
    let stop = Stop::default();
    let means = Means {
        resources: Resources::default(),
        stop: &stop,
        observer: &Unwatched,
        starts: 0,
    };
    calibrate(problem, Reach::default(), means)?.ok_or_else(|| "nothing could be simulated".into())
}

/// A standard normal number (Box and Muller).
fn normal(random: &mut Rng) -> f64 {
    (-2.0 * (1.0 - random.f64()).ln()).sqrt() * (std::f64::consts::TAU * random.f64()).cos()
}

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1) {
        Some(sets) => coverage(sets.parse()?),
        None => tables(),
    }
}

/// The standard errors of exact forces.
fn tables() -> Result<(), Box<dyn Error>> {
    println!("| points | measured | noise | error of E | of µ | of ζ |\n|---|---|---|---|---|---|");
    for (speeds, depths) in POINTS {
        let exact = forces(speeds, depths)?;
        for tangential in [false, true] {
            for noise in NOISE {
                let found = fit(&exact, noise, tangential, || 0.0)?;
                let relative =
                    |setting: usize| 100.0 * found.standard_error(setting) / TRUTH[setting].1;
                println!(
                    "| {} | {} | {:.0} % | {:.1} % | {:.4} | {:.0} % |",
                    exact.len(),
                    if tangential {
                        "F_n,w and F_t,w"
                    } else {
                        "F_n,w"
                    },
                    100.0 * noise,
                    relative(0),
                    found.standard_error(1),
                    relative(2)
                );
                if noise == NOISE[0] {
                    eprintln!(
                        "{} points: derivatives to {:.1e}",
                        exact.len(),
                        found.derivative_error
                    );
                }
            }
        }
    }
    Ok(())
}

/// How often the intervals hold the truth, in so many sets of 16 normal forces.
fn coverage(sets: u64) -> Result<(), Box<dyn Error>> {
    let (speeds, depths) = POINTS[2];
    let exact = forces(speeds, depths)?;
    let mut held = [0; TRUTH.len()];
    for seed in 0..sets {
        let mut random = Rng::with_seed(seed);
        let found = fit(&exact, NOISE[1], false, || normal(&mut random))?;
        for ((held, interval), (_, truth)) in held.iter_mut().zip(&found.intervals).zip(TRUTH) {
            *held += u64::from(interval.is_some_and(|[low, high]| (low..=high).contains(&truth)));
        }
        eprintln!("{} sets: {held:?}", seed + 1);
    }
    for ((path, _), held) in TRUTH.iter().zip(held) {
        println!(
            "{path}: the 95 % interval holds the truth in {held} of {sets} data sets with noise of {:.0} %",
            100.0 * NOISE[1]
        );
    }
    Ok(())
}
