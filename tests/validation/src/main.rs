//! Comparisons of the simulator with exact solutions, other codes and the paper.
//!
//! A reference is a formula ([`exact`]), a number from the literature ([`sources`]), an exact
//! property such as symmetry, or a trajectory of another code that is committed with its script.
//! It is never a result of the solver. [`tolerances`] has all tolerances with their reasons. The
//! trials use the public interface of the libraries only.
//!
//! ```sh
//! cargo test -p bristle-validation                                # the quick trials
//! cargo test --release -p bristle-validation -- --full            # all, with docs/trust.md
//! cargo test --release -p bristle-validation -- --full --update   # rewrites its table
//! cargo test --release -p bristle-validation -- --full impact     # those with this word
//! ```

mod chains;
mod contact;
mod edges;
mod equilibrium;
mod evidence;
mod exact;
mod impact;
mod invariants;
mod paper;
mod peers;
mod poses;
mod record;
mod rotation;
mod shape;
mod small_motion;
mod sources;
mod statics;
mod tolerances;
mod touching;
mod trial;
mod vibration;

use std::panic::catch_unwind;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use record::Report;
use trial::{Trial, TrialResult};

/// Name and function of a trial.
type NamedTrial = (&'static str, fn(&mut Trial) -> TrialResult);

/// Trials that run with all tests, in seconds of processor time.
const QUICK: &[NamedTrial] = &[
    ("elastica under a tip load", statics::tip_load),
    ("circle under an end moment", statics::end_moment),
    ("filament under its weight", statics::hanging),
    ("spherical pendulum", invariants::spherical_pendulum),
    ("restitution of impacts", impact::restitutions),
    ("impacts without damping", impact::elastic),
    ("sliding to rest", impact::sliding),
    ("energy of passes", contact::energy),
    ("momentum of passes", contact::impulse),
    ("splay of cups", poses::splayed),
    ("straight filaments that touch", touching::pairs::straight),
    ("pass by CVODES", peers::cvodes),
    ("paper: tip deflection", paper::deflection),
    ("paper: contact time", paper::contact_time),
    ("paper: contact time ratio", paper::tier),
    ("paper: impulse", paper::impulse),
    ("paper: tool force", paper::tool_force),
    ("paper: magnitude", paper::magnitude),
];

/// Further trials, which run with `--full` only. The last ones take longest.
const FULL: &[NamedTrial] = &[
    ("frequencies of a cantilever", vibration::cantilever),
    ("damping ratio of the first mode", vibration::damping),
    ("hanging chain", vibration::hanging_chain),
    ("frequency of a cone", shape::cone),
    ("wavy, tapered filament", shape::curved),
    (
        "frequencies of a rotating cantilever",
        rotation::frequencies,
    ),
    ("convergence in the tolerance", contact::tolerance),
    ("contact stiffness", contact::stiffness),
    ("filament that slips off an edge", edges::release),
    ("crossed cantilevers", touching::pairs::cantilevers),
    ("elastica over a filament", touching::pairs::over_filament),
    ("angular momentum of a row", touching::rows::momentum),
    ("pass by Exudyn", peers::ancf),
    ("paper: number of segments", paper::segments),
    ("convergence in n", contact::segments),
    ("free motion in space", invariants::conservation),
    ("cups pressed flat", poses::flat),
    ("row of six by MuJoCo", touching::rows::mujoco),
    ("elastica over an edge", edges::over_edge),
    ("buckled elastica in a slow pass", statics::buckled),
    ("elastica on curved faces", edges::curves),
    ("steady stretch of a row", touching::convergence::steady),
];

/// Arguments of the command line. Those that `cargo test` passes to all test programs are ignored.
struct Arguments {
    is_full: bool,
    updates: bool,
    /// Words, one of which the name of a trial contains.
    words: Vec<String>,
}

impl Arguments {
    fn read() -> Self {
        let mut found = Self {
            is_full: false,
            updates: false,
            words: Vec::new(),
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--full" => found.is_full = true,
                "--update" => found.updates = true,
                "--test-threads" | "--skip" => drop(arguments.next()),
                word if !word.starts_with('-') => found.words.push(argument),
                _ => {}
            }
        }
        found
    }

    /// The trials to run.
    fn trials(&self) -> Vec<NamedTrial> {
        let more = if self.is_full { FULL } else { &[] };
        let is_chosen = |(name, _): &&NamedTrial| {
            self.words.is_empty() || self.words.iter().any(|word| name.contains(word))
        };
        QUICK
            .iter()
            .chain(more)
            .filter(is_chosen)
            .copied()
            .collect()
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::read();
    let is_whole = arguments.words.is_empty();
    let mut passing = Vec::new();
    let checks = exact::CHECKS.iter().chain(&[trial::CHECK, evidence::CHECK]);
    for (name, check) in checks.filter(|_| is_whole) {
        let passes = catch_unwind(check).is_ok();
        println!("{:6} {name}", if passes { "ok" } else { "FAILED" });
        passing.push(passes);
    }
    let reports = run(&arguments.trials());
    passing.extend(reports.iter().map(Report::passes));
    if arguments.is_full && is_whole {
        record::write(&reports);
        let evidence = evidence::compare(&reports, arguments.updates);
        if let Err(message) = &evidence {
            println!("FAILED {message}");
        }
        passing.push(evidence.is_ok());
    }
    let passed = passing.iter().filter(|passes| **passes).count();
    let failed = passing.len() - passed;
    println!("{passed} passed, {failed} failed");
    if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs trials on all cores, the last ones first, and prints a line for each.
fn run(entries: &[NamedTrial]) -> Vec<Report> {
    let (left, reports) = (AtomicUsize::new(entries.len()), Mutex::new(Vec::new()));
    let work = || {
        while let Ok(place) = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| {
            left.checked_sub(1)
        }) {
            let (name, compute) = entries[place - 1];
            let start = Instant::now();
            let report = Report::new(name, compute);
            println!("{report} {:.1} s", start.elapsed().as_secs_f64());
            reports
                .lock()
                .expect("no thread panics")
                .push((place, report));
        }
    };
    thread::scope(|scope| {
        for _ in 0..bristle_study::grid::thread_count(None) {
            scope.spawn(work);
        }
    });
    let mut reports = reports.into_inner().expect("no thread panics");
    reports.sort_by_key(|(place, _)| *place);
    reports.into_iter().map(|(_, report)| report).collect()
}
