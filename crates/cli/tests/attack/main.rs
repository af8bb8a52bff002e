//! A standing attack on everything that Bristle reads: input files, states, graphs, journals,
//! measured forces, saved results, and the command line.
//!
//! Each target starts from valid files and damages them, by structure ([`tree`], [`table`]) and by
//! bytes ([`bytes`]). What is refused must be refused with a readable message. What is accepted
//! must be finite, must read back the same, and must never be a wrong result. Nothing may panic,
//! hang, or take memory without bounds.
//!
//! The mutants follow from the seed, the target and a number, whatever the number of threads.
//! Without arguments this is a short run for CI, bounded by counts. `--times` makes it longer:
//!
//! ```sh
//! cargo test --release -p bristle-cli --test attack -- --times 100 --seed 7
//! cargo test -p bristle-cli --test attack -- input --seed 7 --mutant 1234     # one mutant again
//! ```
//!
//! Files of failures are saved below `target/tmp/attack/`. If the attack itself dies, as from a
//! stack that overflows, the files `running-*` there have the numbers of the mutants.

mod bytes;
mod odd;
mod runner;
mod self_test;
mod table;
mod targets;
mod tree;

use std::process::ExitCode;

use clap::Parser;

use runner::{Plan, Target};
use targets::{
    contact::Contact, graph::Graph, input::Input, journal::Journaled, measured::Measured,
    program::Program,
};
use targets::{results::Results, state::State};

/// Attack everything that Bristle reads with damaged files
#[derive(Parser)]
struct Arguments {
    /// Targets to attack, by parts of their names [default: all]
    targets: Vec<String>,
    /// Seed of the mutants
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Multiple of the number of mutants in CI
    #[arg(long, default_value_t = 1)]
    times: usize,
    /// Try only the mutant with this number
    #[arg(long)]
    mutant: Option<usize>,
    /// Print the names of the targets
    #[arg(long)]
    list: bool,
    /// Accepted, because `cargo test -- --nocapture` passes it to all test programs
    #[arg(long, hide = true)]
    nocapture: bool,
    /// As above
    #[arg(long, hide = true)]
    quiet: bool,
    /// Number of threads [default: one per core]; does not change the mutants
    #[arg(long)]
    test_threads: Option<usize>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let all: [&dyn Fn() -> Box<dyn Target>; 8] = [
        &|| Box::new(Input::new()),
        &|| Box::new(State::new()),
        &|| Box::new(Graph::new()),
        &|| Box::new(Journaled::new()),
        &|| Box::new(Measured::new()),
        &|| Box::new(Results::new()),
        &|| Box::new(Contact::new()),
        &|| Box::new(Program::new()),
    ];
    let wanted = |target: &dyn Target| {
        arguments.targets.is_empty()
            || arguments
                .targets
                .iter()
                .any(|name| target.name().contains(name.as_str()))
    };
    let targets: Vec<Box<dyn Target>> = all
        .iter()
        .map(|make| make())
        .filter(|target| wanted(&**target))
        .collect();
    if arguments.list {
        targets
            .iter()
            .for_each(|target| println!("{}: test", target.name()));
        return ExitCode::SUCCESS;
    }
    runner::silence_panics();
    self_test::run();
    let plan = Plan {
        seed: arguments.seed,
        times: arguments.times,
        only: arguments.mutant,
        threads: arguments.test_threads,
    };
    let failures: usize = targets
        .iter()
        .map(|target| runner::attack(&**target, &plan))
        .sum();
    if failures == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
