//! Instructions of the stepping path, counted by Valgrind and compared with `counts.csv`.
//!
//! ```sh
//! cargo bench -p bristle-instructions             # fails if a count is off by more than the margin
//! cargo bench -p bristle-instructions -- --accept    # writes the present counts
//! ```
//!
//! Times vary with the machine and its load, instruction counts hardly do. Valgrind does not
//! support AVX-512, so lanes are counted with AVX2. Valgrind 3.19 also lacks one form of `vmovq`,
//! which a compiler may choose or not: a subject with an instruction that Valgrind does not know is
//! reported as not counted. Each subject runs in a process of its own, twice, with different
//! numbers of repetitions. The difference excludes the start and the end of the process.

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::hint::black_box;
use std::process::{Command, ExitCode};

use bristle::equations::{
    Chain, ChainDynamics, ChainState, Clamp, Compiled, Dynamics, LANES, LaneSet, Lanes, NoLoads,
    PlanarDynamics, StepWeights,
};
use bristle::model::filament;
use bristle::model::settings::Settings;
use bristle::simulation::{Job, simulate, simulate_side_by_side};
use bristle::tool::radial_clamp;
use bristle_study::input::document::Document;

/// Largest relative deviation of a count: another compiler changes some instructions, a relevant
/// edit many.
const MARGIN: f64 = 0.05;
const COUNTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/counts.csv");

/// The subjects, with enough repetitions for an accurate count.
const SUBJECTS: [(&str, usize); 18] = [
    ("residual", 100),
    ("factorisation", 100),
    ("solve", 100),
    ("accelerations", 100),
    ("residual of eight in lanes", 100),
    ("factorisation of eight in lanes", 100),
    ("solve of eight in lanes", 100),
    ("accelerations of eight in lanes", 100),
    ("planar residual", 100),
    ("planar factorisation", 100),
    ("planar correction with variation", 100),
    ("planar accelerations", 100),
    ("planar residual of eight in lanes", 100),
    ("planar factorisation of eight in lanes", 100),
    ("planar correction with variation of eight in lanes", 100),
    ("planar accelerations of eight in lanes", 100),
    ("pass", 1),
    ("eight passes in lanes", 1),
];

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, flag, subject, repetitions] = arguments.as_slice()
        && flag == "--run"
    {
        run(subject.parse()?, repetitions.parse()?);
        return Ok(ExitCode::SUCCESS);
    }
    let mut counts = Vec::new();
    for (subject, (name, repetitions)) in SUBJECTS.iter().enumerate() {
        match [
            count(subject, *repetitions)?,
            count(subject, 3 * repetitions)?,
        ] {
            [Some(few), Some(many)] => {
                counts.push((*name, (many - few) / (2 * repetitions) as u64))
            }
            _ => println!("{name:50}  not counted: Valgrind does not know one of its instructions"),
        }
    }
    if counts.is_empty() {
        return Err("Valgrind could not count anything: install a newer one".into());
    }
    if arguments.iter().any(|argument| argument == "--accept") {
        let mut text = String::from("subject,instructions\n");
        let accepted = fs::read_to_string(COUNTS)?;
        for (name, _) in SUBJECTS {
            match counts.iter().find(|(counted, _)| *counted == name) {
                Some((_, count)) => writeln!(text, "{name},{count}")?,
                None => writeln!(text, "{name},{}", accepted_count(&accepted, name)?)?,
            }
        }
        fs::write(COUNTS, text)?;
    }
    let accepted = fs::read_to_string(COUNTS)?;
    let mut off = false;
    for (name, count) in counts {
        let expected = accepted_count(&accepted, name)?;
        let change = count as f64 / expected as f64 - 1.0;
        let mark = if change.abs() > MARGIN {
            "  <- outside the margin"
        } else {
            ""
        };
        off |= change.abs() > MARGIN;
        println!(
            "{name:50} {count:12} instructions, {:+.1} %{mark}",
            100.0 * change
        );
    }
    if off {
        eprintln!(
            "error: counts differ by more than {:.0} %; if this is intended, run again with --accept",
            100.0 * MARGIN
        );
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

/// The count of the subject `name` in `counts.csv`.
fn accepted_count(counts: &str, name: &str) -> Result<u64, Box<dyn Error>> {
    let line = counts
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(','));
    Ok(line
        .ok_or_else(|| format!("counts.csv has no line for {name}"))?
        .parse()?)
}

/// Instruction count of a process that repeats the subject; `None` if Valgrind does not know one of
/// its instructions.
fn count(subject: usize, repetitions: usize) -> Result<Option<u64>, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args(["--run", &subject.to_string(), &repetitions.to_string()])
        .output()
        .map_err(|error| {
            format!("cannot run valgrind (on Debian, install the package valgrind): {error}")
        })?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|line| line.split_once("Collected :"));
    match collected {
        Some((_, count)) if output.status.success() => Ok(Some(count.trim().parse()?)),
        _ if text.contains("valgrind: Unrecognised instruction") => Ok(None),
        _ => Err(format!("valgrind did not count {}:\n{text}", SUBJECTS[subject].0).into()),
    }
}

fn run(subject: usize, repetitions: usize) {
    match subject {
        0..4 => run_spatial::<f64>(subject, repetitions),
        4..8 => run_spatial::<Lanes>(subject - 4, repetitions),
        8..12 => run_planar::<f64>(subject - 8, repetitions),
        12..16 => run_planar::<Lanes>(subject - 12, repetitions),
        16 => {
            let settings = settings();
            for _ in 0..repetitions {
                black_box(simulate(black_box(&settings)).expect("the pass ends"));
            }
        }
        _ => {
            let settings = settings();
            for _ in 0..repetitions {
                let mut jobs = (0..LANES).map(|number| {
                    let mut settings = settings.clone();
                    settings.process.brushing_velocity_m_s = 5.0 + 3.0 * number as f64;
                    Job::new(number, &settings)
                });
                simulate_side_by_side(
                    |_| jobs.next(),
                    |_, result| {
                        black_box(result.expect("the pass ends"));
                    },
                );
            }
        }
    }
}

/// A contact of the paper at a tolerance that gives the impulse to better than 0.1 %.
fn settings() -> Settings {
    let document = Document::parse(
        include_str!("../../examples/zirconia.toml"),
        "examples/zirconia.toml",
    );
    let mut settings = document
        .and_then(|document| document.settings())
        .expect("the example is right");
    settings.solver.relative_tolerance = 1e-3;
    settings
}

/// A bent and turning filament, the same in all lanes, and the weights of a step.
struct BentFilament<T> {
    chain: Chain<T>,
    clamp: Clamp<T>,
    q: Vec<[T; 2]>,
    v: Vec<[T; 2]>,
    weights: StepWeights<T>,
}

impl<T: Compiled> BentFilament<T> {
    fn new() -> Self {
        let settings = settings();
        let n = settings.filament.segments;
        let chain = filament::chain(&settings.filament, [0.0; 3]);
        let of = T::from_f64;
        Self {
            chain: Chain::from_lanes(|_| &chain),
            clamp: Clamp::from_lanes(|_| radial_clamp(settings.tool.body_radius_m, 0.3, 50.0, 0.0)),
            q: (0..n)
                .map(|k| [of(1.5 + 0.01 * k as f64), of(0.3 + 0.03 * k as f64)])
                .collect(),
            v: (0..n)
                .map(|k| [of(0.1 * k as f64), of(50.0 + k as f64)])
                .collect(),
            weights: StepWeights {
                coordinates: of(1e-10),
                rates: of(1e-5),
            },
        }
    }
}

fn run_spatial<T: Compiled>(subject: usize, repetitions: usize) {
    run_loop(
        subject,
        repetitions,
        Dynamics::<T>::new,
        |dynamics, _, _, _, result| dynamics.solve(result),
    );
}

/// Runs a subject of the planar equations, which take the polar angles as a variation.
fn run_planar<T: Compiled>(subject: usize, repetitions: usize) {
    run_loop(
        subject,
        repetitions,
        PlanarDynamics::<T>::new,
        |dynamics, at, a, weights, result| {
            dynamics.correction(at, a, &NoLoads, result);
            dynamics.solve_variation(at, a, &NoLoads, weights, result);
        },
    );
}

/// Solve that a loop adds to residual, factorisation and accelerations. It takes a state with its
/// accelerations and fills the last argument.
type Correction<T, D> = fn(&mut D, ChainState<'_, T>, &[[T; 2]], StepWeights<T>, &mut [[T; 2]]);

fn run_loop<T: Compiled, D: ChainDynamics<T>>(
    subject: usize,
    repetitions: usize,
    new: fn(Chain<T>) -> D,
    correct: Correction<T, D>,
) {
    let BentFilament {
        chain,
        clamp,
        q,
        v,
        weights,
    } = BentFilament::<T>::new();
    let mut dynamics = new(chain);
    let (mut a, mut result) = (q.clone(), q.clone());
    dynamics.accelerations(clamp.holding(&q, &v), &NoLoads, &mut a);
    dynamics.residual(clamp.holding(&q, &v), &a, &NoLoads, &mut result);
    let all = LaneSet::first(T::LANES);
    dynamics.factorise(clamp.holding(&q, &v), &a, &NoLoads, weights, all);
    for _ in 0..repetitions {
        let dynamics = black_box(&mut dynamics);
        match subject {
            0 => dynamics.residual(clamp.holding(&q, &v), &a, &NoLoads, &mut result),
            1 => dynamics.factorise(clamp.holding(&q, &v), &a, &NoLoads, weights, all),
            2 => correct(dynamics, clamp.holding(&q, &v), &a, weights, &mut result),
            _ => dynamics.accelerations(clamp.holding(&q, &v), &NoLoads, &mut a),
        }
    }
    black_box((a, result));
}
