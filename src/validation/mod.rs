//! `bristle validate`: the simulator beside exact solutions, other codes and the paper, case by case.
//!
//! Every reference is a formula ([`exact`]), a number of the literature ([`sources`]), an exact property such as symmetry, or
//! a trajectory of another code that is committed with the script that made it; none is a result of the solver that is checked. [`tolerances`] says how far a
//! number may be off, and why. Only the public interface of the library is used.

mod case;
mod chains;
mod contact;
mod equilibrium;
mod exact;
mod impact;
mod invariants;
mod paper;
mod peers;
mod report;
mod rotation;
mod small_motion;
mod sources;
mod statics;
mod tolerances;
mod vibration;

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::thread;

use bristle::simulation::{IntegrationError, SimulationError};
use thiserror::Error;

pub use case::{Case, Check, Figure};
pub use report::{agrees, page, table, write_rows};

/// How much is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// What takes seconds.
    Quick,
    /// Studies of convergence too.
    Full,
}

/// Why a case could not be computed: that fails it.
#[derive(Clone, Debug, Error)]
pub enum Failure {
    /// A trajectory ended early.
    #[error(transparent)]
    Integration(#[from] IntegrationError),
    /// A pass ended early.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// Newton's method found no equilibrium.
    #[error("no equilibrium is found")]
    NoEquilibrium,
    /// Something that the case relies on does not hold.
    #[error("the case ended with: {0}")]
    Panic(String),
    /// A reference cannot be read.
    #[error("{0}")]
    Reference(String),
}

/// What computes a case.
pub type Compute = fn(Extent) -> Result<Case, Failure>;

/// Cases of one kind.
pub struct Group {
    /// Heading.
    pub title: &'static str,
    /// What they are for; Markdown.
    pub purpose: &'static str,
    cases: &'static [Compute],
}

/// The suite, in the order of the page.
pub static GROUPS: [Group; 8] = [
    statics::GROUP,
    vibration::GROUP,
    rotation::GROUP,
    invariants::GROUP,
    impact::GROUP,
    contact::GROUP,
    peers::GROUP,
    paper::GROUP,
];

/// What became of a group, case by case.
pub struct Outcome {
    /// The group.
    pub group: &'static Group,
    /// Its cases, or why they could not be computed.
    pub cases: Vec<Result<Case, Failure>>,
}

impl Outcome {
    /// All comparisons of the group.
    pub fn checks(&self) -> impl Iterator<Item = &Check> {
        self.cases.iter().flatten().flat_map(|case| &case.checks)
    }

    /// All diagrams of the group.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.cases.iter().flatten().flat_map(|case| &case.figures)
    }
}

/// Number of cases.
pub fn case_count() -> usize {
    GROUPS.iter().map(|group| group.cases.len()).sum()
}

/// Computes all cases, on all cores, and calls `done` after each.
pub fn run(extent: Extent, done: impl Fn() + Sync) -> Vec<Outcome> {
    let all: Vec<(usize, usize)> = GROUPS
        .iter()
        .enumerate()
        .flat_map(|(group, Group { cases, .. })| (0..cases.len()).map(move |case| (group, case)))
        .collect();
    let waiting = Mutex::new(all.iter());
    let finished = Mutex::new(Vec::new());
    let work = || {
        loop {
            let next = waiting.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).next();
            let Some(&(group, case)) = next else { return };
            let result = compute(GROUPS[group].cases[case], extent);
            finished.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(((group, case), result));
            done();
        }
    };
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    let mut finished = finished.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    finished.sort_by_key(|(place, _)| *place);
    let mut outcomes: Vec<Outcome> = GROUPS.iter().map(|group| Outcome { group, cases: Vec::new() }).collect();
    for ((group, _), result) in finished {
        outcomes[group].cases.push(result);
    }
    outcomes
}

/// Computes a case. That it panics, as a solver that is wrong can make it, fails this case and no other.
fn compute(case: Compute, extent: Extent) -> Result<Case, Failure> {
    std::panic::catch_unwind(|| case(extent)).unwrap_or_else(|cause| {
        let message = cause.downcast_ref::<String>().cloned();
        let message = message.or_else(|| cause.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        Err(Failure::Panic(message.unwrap_or_else(|| "an unknown cause".to_owned())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_fails_its_case() {
        let result = compute(|_| panic!("no mass"), Extent::Quick);
        assert_eq!(result.expect_err("it panics").to_string(), "the case ended with: no mass");
    }
}
