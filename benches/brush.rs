//! Times of brushes whose filaments touch, as one table:
//! `cargo bench --bench brush [-- row cases space whole]`.
//!
//! Each simulation runs once, or a few times if it takes seconds; the shortest time counts. Both
//! times of a ratio are of the same run.

use std::collections::BTreeSet;
use std::env;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use bristle::brush::{BrushResult, simulate_brush};
use bristle::model::settings::{BrushSettings, ContactSettings, Hold, Settings};

fn main() {
    let wanted: BTreeSet<String> = env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with('-'))
        .collect();
    println!("{:<58} {:>8} {:>12}", "brush", "time", "p_n");
    let all: [(&str, fn()); 4] = [
        ("row", row),
        ("cases", cases),
        ("space", space),
        ("whole", whole),
    ];
    for (name, measure) in all {
        if wanted.is_empty() || wanted.contains(name) {
            measure();
        }
    }
}

/// The paper's brush with `around` filaments around the tool, in `rows` rows at equal pitch.
fn brush(around: f64, rows: usize, columns: Option<usize>) -> Settings {
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.tool.filament_count = around * rows as f64;
    if rows > 1 {
        settings.tool.width_m = 1.294e-3 * rows as f64;
    }
    let steady = columns.is_none();
    settings.brush = Some(BrushSettings {
        columns,
        rows: Some(rows),
        steady,
        ..BrushSettings::default()
    });
    settings
}

/// Adds friction between filaments, µ = 0.3.
fn rubbing(mut settings: Settings) -> Settings {
    settings
        .brush
        .as_mut()
        .expect("a brush")
        .friction_coefficient = 0.3;
    settings
}

/// Simulates a brush several times, prints the shortest time, and returns it in s.
fn time(name: &str, times: usize, settings: &Settings, threads: usize) -> (f64, BrushResult) {
    let runs = (0..times).map(|_| {
        let start = Instant::now();
        let result = simulate_brush(settings, threads).expect("a brush");
        (start.elapsed().as_secs_f64(), result)
    });
    let (seconds, result) = runs.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a run");
    let impulse = 1e3 * result.tool.contact_normal_impulse_n_s;
    let threads = if threads == 1 {
        "1 thread".to_owned()
    } else {
        format!("{threads} threads")
    };
    println!(
        "{:<58} {seconds:>6.2} s {impulse:>7.4} mN s",
        format!("{name}, {threads}")
    );
    (seconds, result)
}

fn row() {
    let mut per_filament = Vec::new();
    for columns in [60, 240, 680] {
        let settings = brush(682.0, 1, Some(columns));
        let name = format!("row of {columns} columns, n = 25, 10 m/s, 1 mm");
        let times = [1, 2].map(|threads| time(&name, 5, &settings, threads).0);
        println!("{:<58} {:>8.2}", "    two threads", times[0] / times[1]);
        per_filament.push(times[0] / columns as f64);
    }
    let contact = ContactSettings {
        friction_coefficient: 0.3,
        ..ContactSettings::default()
    };
    let rough = Settings {
        contact,
        ..brush(682.0, 1, Some(60))
    };
    time("row of 60 columns, µ = 0.3 on the workpiece", 5, &rough, 1);
    let (seconds, _) = time(
        "row of 60 columns, µ = 0.3 between filaments",
        5,
        &rubbing(brush(682.0, 1, Some(60))),
        1,
    );
    println!(
        "{:<58} {:>8.2}",
        "    friction between filaments, to none",
        seconds / per_filament[0] / 60.0
    );
    println!(
        "{:<58} {:>8.2}",
        "    time per filament, 680 columns to 60",
        per_filament[2] / per_filament[0]
    );
}

/// Times the 120 cases of the paper on all threads, each a row long enough for its steady stretch.
fn cases() {
    let cases: Vec<Settings> = (1..=12)
        .flat_map(|i| (1..=10).map(move |j| (2.5 * f64::from(i), 0.5e-3 * f64::from(j))))
        .map(|(velocity, depth)| {
            let mut settings = brush(682.0, 1, None);
            settings.process.brushing_velocity_m_s = velocity;
            settings.process.penetration_depth_m = depth;
            settings
        })
        .collect();
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (next, steady) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let start = Instant::now();
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(settings) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match simulate_brush(settings, 1) {
                        Ok(_) => _ = steady.fetch_add(1, Ordering::Relaxed),
                        Err(error) => println!(
                            "{} m/s, {} m: {error}",
                            settings.process.brushing_velocity_m_s,
                            settings.process.penetration_depth_m
                        ),
                    }
                }
            });
        }
    });
    let seconds = start.elapsed().as_secs_f64();
    let steady = steady.into_inner();
    println!(
        "{:<58} {seconds:>6.1} s",
        format!("120 steady rows ({steady} found), {threads} threads")
    );
}

/// Times 8 rows of 80 columns in space.
fn space() {
    let mut tilted = brush(680.0, 8, Some(80));
    tilted.brush.as_mut().expect("a brush").lateral_tilt_std_rad = 1e-3;
    let times = [1, 2].map(|threads| time("8 rows of 80 columns in space", 1, &tilted, threads).0);
    println!("{:<58} {:>8.2}", "    two threads", times[0] / times[1]);
    let (seconds, _) = time(
        "8 rows of 80 columns in space, µ = 0.3 between filaments",
        1,
        &rubbing(tilted),
        2,
    );
    println!(
        "{:<58} {:>8.2}",
        "    friction between filaments, to none",
        seconds / times[1]
    );
    if let Some(memory) = peak_memory() {
        println!(
            "{:<58} {memory:>5.0} MB",
            "    largest memory of this process so far"
        );
    }
}

/// Times the whole brush for one turn, each filament with a length of its own.
fn whole() {
    let mut settings = Settings::paper(10.0, 1e-3);
    let brush = BrushSettings {
        columns: Some(700),
        rows: Some(15),
        ..BrushSettings::default()
    };
    settings.brush = Some(brush);
    settings.uncertainty.length_std_m = 2e-4;
    settings.uncertainty.hold = Hold::Machine;
    time(
        "10 500 filaments of different lengths, one turn",
        1,
        &settings,
        2,
    );
}

/// Peak memory in MB, where the system reports it.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes / 1e3)
}
