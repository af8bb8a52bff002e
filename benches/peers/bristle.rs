//! Bristle's side of `benches/peers/run.py`: measures what it is asked for, one JSON object a line in, one a line out.
//!
//! A process that stays alive lets the caller take turns between Bristle and the others. Times are wall clock, in s.

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write, stdin, stdout};
use std::time::Instant;

use bristle::document::Document;
use bristle::equations::{Dynamics, NoLoads};
use bristle::filament;
use bristle::settings::Settings;
use bristle::simulation::simulate;
use bristle::study::{Study, run_study};
use bristle::tool::radial_clamp;
use serde::Deserialize;
use serde_json::{Value, json};

const FILE: &str = include_str!("../../examples/zirconia.toml");

#[derive(Deserialize)]
#[serde(tag = "measure", rename_all = "snake_case")]
enum Request {
    /// The accelerations at one state, `calls` times.
    Accelerations {
        base_angle: f64,
        base_rate: f64,
        base_acceleration: f64,
        gravity: [f64; 3],
        q: Vec<[f64; 2]>,
        v: Vec<[f64; 2]>,
        calls: u32,
    },
    /// One contact on one thread.
    Contact { brushing_velocity_m_s: f64, penetration_depth_m: f64, relative_tolerance: f64 },
    /// The 120 contacts on all cores.
    Study { relative_tolerance: f64 },
}

fn main() -> Result<(), Box<dyn Error>> {
    for line in stdin().lock().lines() {
        let answer = answer(serde_json::from_str(&line?)?)?;
        println!("{answer}");
        stdout().flush()?;
    }
    Ok(())
}

fn answer(request: Request) -> Result<Value, Box<dyn Error>> {
    let document = Document::parse(FILE, "zirconia.toml")?;
    let mut settings: Settings = document.settings()?;
    Ok(match request {
        Request::Accelerations { base_angle, base_rate, base_acceleration, gravity, q, v, calls } => {
            settings.filament.segments = q.len();
            let clamp = radial_clamp(settings.tool.body_radius_m, base_angle, base_rate, base_acceleration);
            let mut dynamics = Dynamics::new(filament::chain(&settings.filament, gravity));
            let mut accelerations = vec![[0.0; 2]; q.len()];
            let start = Instant::now();
            for _ in 0..calls {
                let (clamp, q, v) = black_box((&clamp, &q, &v));
                dynamics.accelerations(clamp, q, v, &NoLoads, black_box(&mut accelerations));
            }
            json!({ "seconds": start.elapsed().as_secs_f64() / f64::from(calls), "accelerations": accelerations })
        }
        Request::Contact { brushing_velocity_m_s, penetration_depth_m, relative_tolerance } => {
            settings.process.brushing_velocity_m_s = brushing_velocity_m_s;
            settings.process.penetration_depth_m = penetration_depth_m;
            settings.solver.relative_tolerance = relative_tolerance;
            let start = Instant::now();
            let contact = simulate(black_box(&settings))?;
            let seconds = start.elapsed().as_secs_f64();
            json!({ "seconds": seconds, "impulse": contact.metrics.contact_normal_impulse_n_s, "steps": contact.statistics.steps })
        }
        Request::Study { relative_tolerance } => {
            settings.solver.relative_tolerance = relative_tolerance;
            let axes = document.study()?.axes().to_vec();
            let study = Study::new(settings, axes)?;
            let start = Instant::now();
            let results = run_study(&study, None, || (), simulate)?;
            let seconds = start.elapsed().as_secs_f64();
            let mut cases = Vec::new();
            for (case, result) in results.into_iter().enumerate() {
                let settings = study.settings(case);
                cases.push(json!({
                    "brushing_velocity_m_s": settings.process.brushing_velocity_m_s,
                    "penetration_depth_m": settings.process.penetration_depth_m,
                    "impulse": result?.metrics.contact_normal_impulse_n_s,
                }));
            }
            json!({ "seconds": seconds, "cases": cases })
        }
    })
}
