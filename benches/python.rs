//! Rust's side of `benches/python.py`. Each line of stdin is `contact`, `shortest` or `batch`; the
//! answer is a line with the time of one run, in s.

use std::error::Error;
use std::hint::black_box;
use std::io::stdin;
use std::time::Instant;

use bristle::model::filament;
use bristle::simulation::simulate;
use bristle::tool::radial_clamp;
use bristle_equations::batch::{Batch, Member};
use bristle_study::input::document::Document;

const FILE: &str = include_str!("../examples/zirconia.toml");
const STATES: usize = 10_000;

fn main() -> Result<(), Box<dyn Error>> {
    let settings = Document::parse(FILE, "zirconia.toml")?.settings()?;
    let segments = settings.filament.segments;
    let chain = filament::chain(&settings.filament, settings.process.gravity_m_s2);
    let clamp = radial_clamp(settings.tool.body_radius_m, 0.0, 0.0, 0.0);
    let q: Vec<[f64; 2]> = (0..segments)
        .map(|k| [std::f64::consts::FRAC_PI_2, 0.01 * k as f64])
        .collect();
    let (q, v) = (q.repeat(STATES), vec![[1.0; 2]; segments * STATES]);
    let members: Vec<Member<'_>> = q
        .chunks(segments)
        .zip(v.chunks(segments))
        .map(|(q, v)| Member {
            chain: &chain,
            clamp: &clamp,
            q,
            v,
        })
        .collect();
    let mut shortest = settings.clone();
    shortest.filament.segments = 1;
    let mut batch = Batch::new(segments);
    let mut accelerations = vec![[0.0; 2]; segments * STATES];
    for line in stdin().lines() {
        let start = Instant::now();
        match line?.as_str() {
            "contact" => drop(black_box(simulate(black_box(&settings))?)),
            "shortest" => drop(black_box(simulate(black_box(&shortest))?)),
            "batch" => batch.accelerations(black_box(&members), black_box(&mut accelerations))?,
            other => {
                return Err(format!("{other} is none of `contact`, `shortest` and `batch`").into());
            }
        }
        println!("{}", start.elapsed().as_secs_f64());
    }
    Ok(())
}
