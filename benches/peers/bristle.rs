//! Bristle's side of `benches/peers/run.py`: reads one request per line and writes one answer per
//! line, as JSON objects.
//!
//! The process stays alive, so the caller can alternate between Bristle and the other codes. Times
//! are wall-clock times in s.

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write, stdin, stdout};
use std::time::Instant;

use bristle::brush::simulate_brush;
use bristle::equations::{Chain, ChainDynamics, Clamp, Dynamics, NoLoads};
use bristle::model::filament;
use bristle::model::settings::{BrushSettings, Settings};
use bristle::simulation::simulate;
use bristle::tool::radial_clamp;
use bristle_equations::batch::{Batch, Member};
use bristle_study::grid::{Study, run_study};
use bristle_study::input::document::Document;
use serde::Deserialize;
use serde_json::{Value, json};

const FILE: &str = include_str!("../../examples/zirconia.toml");

#[derive(Deserialize)]
#[serde(tag = "measure", rename_all = "snake_case")]
enum Request {
    /// Accelerations at one state, `calls` times.
    Accelerations { state: PaperChain, calls: u32 },
    /// Accelerations of all states side by side, `calls` times; the time is per state.
    Batch { states: Vec<PaperChain>, calls: u32 },
    /// One contact on one thread.
    Contact {
        brushing_velocity_m_s: f64,
        penetration_depth_m: f64,
        relative_tolerance: f64,
    },
    /// A planar row of filaments that touch each other.
    Row {
        brushing_velocity_m_s: f64,
        penetration_depth_m: f64,
        segments: usize,
        columns: usize,
        tolerance: f64,
    },
    /// The 120 contacts on all cores.
    Study { relative_tolerance: f64 },
}

/// The paper's filament, with one segment per pair of coordinates.
#[derive(Deserialize)]
struct PaperChain {
    base_angle: f64,
    base_rate: f64,
    base_acceleration: f64,
    gravity: [f64; 3],
    q: Vec<[f64; 2]>,
    v: Vec<[f64; 2]>,
}

impl PaperChain {
    fn problem(&self, mut settings: Settings) -> (Chain<f64>, Clamp<f64>) {
        settings.filament.segments = self.q.len();
        let radius = settings.tool.body_radius_m;
        let clamp = radial_clamp(
            radius,
            self.base_angle,
            self.base_rate,
            self.base_acceleration,
        );
        (filament::chain(&settings.filament, self.gravity), clamp)
    }
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
        Request::Accelerations { state, calls } => accelerations(&state, settings, calls),
        Request::Batch { states, calls } => batch(&states, &settings, calls)?,
        Request::Contact {
            brushing_velocity_m_s,
            penetration_depth_m,
            relative_tolerance,
        } => {
            settings.process.brushing_velocity_m_s = brushing_velocity_m_s;
            settings.process.penetration_depth_m = penetration_depth_m;
            settings.solver.relative_tolerance = relative_tolerance;
            let start = Instant::now();
            let contact = simulate(black_box(&settings))?;
            let seconds = start.elapsed().as_secs_f64();
            json!({ "seconds": seconds, "impulse": contact.metrics.contact_normal_impulse_n_s, "steps": contact.statistics.steps })
        }
        Request::Row {
            brushing_velocity_m_s,
            penetration_depth_m,
            segments,
            columns,
            tolerance,
        } => {
            settings.process.brushing_velocity_m_s = brushing_velocity_m_s;
            settings.process.penetration_depth_m = penetration_depth_m;
            settings.filament.segments = segments;
            row(&settings, columns, tolerance)?
        }
        Request::Study { relative_tolerance } => {
            settings.solver.relative_tolerance = relative_tolerance;
            study(Study::new(settings, document.study()?.sweeps().to_vec())?)?
        }
    })
}

fn accelerations(state: &PaperChain, settings: Settings, calls: u32) -> Value {
    let (chain, clamp) = state.problem(settings);
    let mut dynamics = Dynamics::new(chain);
    let mut accelerations = vec![[0.0; 2]; state.q.len()];
    let start = Instant::now();
    for _ in 0..calls {
        let (clamp, q, v) = black_box((&clamp, &state.q, &state.v));
        dynamics.accelerations(clamp.holding(q, v), &NoLoads, black_box(&mut accelerations));
    }
    json!({ "seconds": start.elapsed().as_secs_f64() / f64::from(calls), "accelerations": accelerations })
}

fn batch(states: &[PaperChain], settings: &Settings, calls: u32) -> Result<Value, Box<dyn Error>> {
    let problems: Vec<_> = states
        .iter()
        .map(|state| state.problem(settings.clone()))
        .collect();
    let members: Vec<_> = (states.iter().zip(&problems))
        .map(|(PaperChain { q, v, .. }, (chain, clamp))| Member { chain, clamp, q, v })
        .collect();
    let segments = states[0].q.len();
    let mut batch = Batch::new(segments);
    let mut accelerations = vec![[0.0; 2]; segments * states.len()];
    let start = Instant::now();
    for _ in 0..calls {
        batch.accelerations(black_box(&members), black_box(&mut accelerations))?;
    }
    let seconds = start.elapsed().as_secs_f64() / f64::from(calls) / states.len() as f64;
    Ok(json!({ "seconds": seconds, "accelerations": accelerations }))
}

/// Filaments around in a row of the paper's brush at equal pitch both ways.
const FILAMENTS_AROUND: f64 = 682.0;

/// Times a row of `columns` columns.
fn row(settings: &Settings, columns: usize, tolerance: f64) -> Result<Value, Box<dyn Error>> {
    let brush = BrushSettings {
        columns: Some(columns),
        rows: Some(1),
        steady: false,
        tolerance,
        ..BrushSettings::default()
    };
    let mut settings = Settings {
        brush: Some(brush),
        ..settings.clone()
    };
    settings.tool.filament_count = FILAMENTS_AROUND;
    let start = Instant::now();
    let result = simulate_brush(black_box(&settings), 1)?;
    let seconds = start.elapsed().as_secs_f64();
    let impulses: Vec<_> = result
        .filaments
        .iter()
        .map(|filament| filament.metrics.contact_normal_impulse_n_s)
        .collect();
    Ok(json!({ "seconds": seconds, "impulses": impulses, "steps": result.statistics.steps }))
}

fn study(study: Study) -> Result<Value, Box<dyn Error>> {
    let start = Instant::now();
    let results = run_study(&study, None, || ())?;
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
    Ok(json!({ "seconds": seconds, "cases": cases }))
}
