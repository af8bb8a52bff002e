//! Permanent test of the results: pairs of simulations of random brushes, whose metrics must be
//! equal.
//!
//! [`kinds`] lists variations that keep the metrics: a tighter tolerance, an earlier start, another
//! frame, another name for the same workpiece, a brush of one filament. [`draw`] draws the
//! settings. [`judge`] states the allowed differences, with reasons.
//!
//! Pairs follow from the seed, the kind and a number alone. Without arguments this is a short run
//! for CI. `--times` makes it longer:
//!
//! ```sh
//! cargo test --release -p bristle --test agreement -- --times 100 --seed 7
//! cargo test --release -p bristle --test agreement -- brush-of-one --seed 7 --pair 1234    # one pair again
//! ```
//!
//! A failure prints both numbers and an input file, reduced to the settings that the failure needs.

mod draw;
mod judge;
mod kinds;
mod pairs;
mod simulate;

use std::process::ExitCode;

use bristle::model::settings::Settings;
use fastrand::Rng;
use rayon::prelude::*;

use judge::{Verdict, judge};
use kinds::{KINDS, PairKind};
use pairs::{Pair, Run};
use simulate::outcomes;

/// Maximum number of pairs whose passes share vector units. Brushes are simulated one by one.
const CHUNK: usize = 64;
/// Maximum pairs of a kind that are shown whole, and simplified if they differ.
const MAX_SHOWN_PAIRS: usize = 3;
/// Maximum share of pairs, beyond one pair, that may say nothing: because they are too sensitive,
/// or cannot be simulated.
const MAX_SILENT_SHARE: f64 = 0.05;

/// Pairs to try.
struct TrialPlan {
    kinds: Vec<String>,
    seed: u64,
    /// Multiple of the short run.
    times: usize,
    /// The only pair to try.
    only: Option<usize>,
}

impl TrialPlan {
    /// Reads the plan from the command line. Other arguments are those that `cargo test` passes to
    /// all test programs.
    fn of_arguments() -> Self {
        let mut plan = Self {
            kinds: Vec::new(),
            seed: 1,
            times: 1,
            only: None,
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            let mut number = || {
                let value = arguments.next().and_then(|value| value.parse().ok());
                value.unwrap_or_else(|| panic!("{argument} needs a whole number"))
            };
            match argument.as_str() {
                "--seed" => plan.seed = number(),
                "--times" => plan.times = number() as usize,
                "--pair" => plan.only = Some(number() as usize),
                "--test-threads" => drop(number()),
                kind if !kind.starts_with('-') => plan.kinds.push(kind.to_owned()),
                _ => {}
            }
        }
        plan
    }
}

/// One pair of a kind, and its settings.
struct PairTrial {
    number: usize,
    settings: Settings,
    /// Random numbers for the rest of the pair.
    random: Rng,
    pair: Pair,
}

impl PairTrial {
    fn new(kind: &PairKind, seed: u64, number: usize) -> Self {
        let name = kind.name.bytes().fold(seed, |hash, byte| {
            hash.wrapping_mul(0x0100_0000_01b3) ^ u64::from(byte)
        });
        let mut random = Rng::with_seed(Rng::with_seed(name).u64(..) ^ number as u64);
        loop {
            let mut settings = draw::settings(&mut random);
            (kind.adapt)(&mut settings, &mut random);
            if let Some(pair) = possible(kind, &settings, &random) {
                return Self {
                    number,
                    settings,
                    random,
                    pair,
                };
            }
        }
    }

    /// Drops settings while the pair still fails.
    fn simplified(mut self, kind: &PairKind) -> Self {
        for simplify in draw::SIMPLIFICATIONS {
            let mut settings = self.settings.clone();
            simplify(&mut settings);
            if settings == self.settings {
                continue;
            }
            let Some(pair) = possible(kind, &settings, &self.random) else {
                continue;
            };
            let results = outcomes(&pair.runs.each_ref());
            if let Verdict::Differs(_) = judge(&pair, &results) {
                (self.settings, self.pair) = (settings, pair);
            }
        }
        self
    }
}

/// The pair of these settings, if all its settings are possible.
fn possible(kind: &PairKind, settings: &Settings, random: &Rng) -> Option<Pair> {
    settings.check().ok()?;
    let pair = (kind.pair)(settings, &mut random.clone());
    let are_possible = pair
        .runs
        .iter()
        .filter_map(Run::settings)
        .all(|settings| settings.check().is_ok());
    are_possible.then_some(pair)
}

fn main() -> ExitCode {
    let plan = TrialPlan::of_arguments();
    let wanted =
        |kind: &&PairKind| plan.kinds.is_empty() || plan.kinds.iter().any(|name| name == kind.name);
    // Alone, a kind with few long pairs would keep only one core busy.
    let failures: usize = KINDS
        .par_iter()
        .filter(wanted)
        .map(|kind| attack(kind, &plan))
        .sum();
    if failures == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Tries the pairs of a kind, prints the findings in one piece, and returns the number of failures.
fn attack(kind: &PairKind, plan: &TrialPlan) -> usize {
    let numbers: Vec<usize> = plan
        .only
        .map_or_else(|| (0..kind.count * plan.times).collect(), |only| vec![only]);
    let first = PairTrial::new(kind, plan.seed, numbers[0]).pair;
    let share = numbers.len().div_ceil(rayon::current_num_threads());
    let chunk = if first.is_of_brush() {
        1
    } else {
        share.min(CHUNK)
    };
    let mut text = String::new();
    if plan.only.is_some() {
        text += &first.to_string();
    }
    let verdicts: Vec<(usize, Verdict)> = numbers
        .par_chunks(chunk)
        .flat_map(|chunk| judged(kind, plan, chunk))
        .collect();
    let count = |wanted: fn(&Verdict) -> bool| {
        verdicts
            .iter()
            .filter(|(_, verdict)| wanted(verdict))
            .count()
    };
    let [refused, sensitive, failed] = [
        count(|verdict| matches!(verdict, Verdict::Refused(_))),
        count(|verdict| matches!(verdict, Verdict::Sensitive(_))),
        count(|verdict| matches!(verdict, Verdict::Differs(_))),
    ];
    let (name, all) = (kind.name, verdicts.len());
    text += &format!(
        "{name:24} {all:6} pairs, {failed} differ, {sensitive} too sensitive, {refused} refused\n"
    );
    let wrong = verdicts
        .iter()
        .filter(|(_, verdict)| !matches!(verdict, Verdict::Same));
    for (position, (number, verdict)) in wrong.enumerate() {
        text += &format!("  {number}: {verdict}\n");
        if position < MAX_SHOWN_PAIRS {
            text += &shown(kind, plan, *number, verdict);
        }
    }
    let too_many = plan.only.is_none()
        && (refused + sensitive) as f64 > 1.0 + MAX_SILENT_SHARE * verdicts.len() as f64;
    if too_many {
        text += &format!("  {name}: too many pairs say nothing\n");
    }
    print!("{text}");
    failed + usize::from(too_many)
}

/// Judges some pairs of a kind.
fn judged(kind: &PairKind, plan: &TrialPlan, numbers: &[usize]) -> Vec<(usize, Verdict)> {
    let trials: Vec<PairTrial> = numbers
        .iter()
        .map(|number| PairTrial::new(kind, plan.seed, *number))
        .collect();
    let runs: Vec<_> = trials.iter().flat_map(|trial| &trial.pair.runs).collect();
    let results = outcomes(&runs);
    let both = trials.iter().zip(results.chunks(2));
    both.map(|(trial, results)| (trial.number, judge(&trial.pair, results)))
        .collect()
}

/// The command for a pair with this verdict, and its settings.
fn shown(kind: &PairKind, plan: &TrialPlan, number: usize, verdict: &Verdict) -> String {
    let mut trial = PairTrial::new(kind, plan.seed, number);
    let command = "cargo test --release -p bristle --test agreement";
    let mut text = format!(
        "  again: {command} -- {} --seed {} --pair {number}\n",
        kind.name, plan.seed
    );
    if let Verdict::Differs(_) = verdict {
        trial = trial.simplified(kind);
        let results = outcomes(&trial.pair.runs.each_ref());
        text += &format!("  simplified: {}\n", judge(&trial.pair, &results));
    }
    text + &trial.pair.to_string()
}
