//! `bristle validate`: compares the simulator with exact solutions, other codes and the paper.
//!
//! A reference is a formula (`exact`), a number from the literature (`sources`), an exact property
//! such as symmetry, or a trajectory of another code that is committed with the script that made
//! it. It is never a result of the solver under test. `tolerances` has all tolerances with their
//! reasons. The trials use the public interface of the libraries only.

mod chains;
mod contact;
mod edges;
mod equilibrium;
mod exact;
mod group;
mod impact;
mod invariants;
mod paper;
mod peers;
mod poses;
mod report;
mod rotation;
mod shape;
mod small_motion;
mod sources;
mod statics;
mod tolerances;
mod touching;
mod trial;
mod vibration;

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::thread;

pub use group::{Compute, Extent, Failure, Group, Outcome};
pub use report::{agrees, page, table, write_rows};
pub use trial::{Check, Figure, Trial};

/// The suite, in the order of the page.
pub static GROUPS: [Group; 12] = [
    statics::GROUP,
    vibration::GROUP,
    shape::GROUP,
    rotation::GROUP,
    invariants::GROUP,
    impact::GROUP,
    contact::GROUP,
    edges::GROUP,
    poses::GROUP,
    touching::GROUP,
    peers::GROUP,
    paper::GROUP,
];

/// Number of trials.
pub fn trial_count() -> usize {
    GROUPS.iter().map(|group| group.trials.len()).sum()
}

/// Computes all trials, on all cores, and calls `done` after each. If it breaks, no further trial
/// is started.
pub fn run(extent: Extent, done: impl Fn() -> ControlFlow<()> + Sync) -> Vec<Outcome> {
    let all: Vec<(usize, usize)> = GROUPS
        .iter()
        .enumerate()
        .flat_map(|(group, Group { trials, .. })| {
            (0..trials.len()).map(move |trial| (group, trial))
        })
        .collect();
    let waiting = Mutex::new(all.iter());
    let finished = Mutex::new(Vec::new());
    let work = || {
        loop {
            let next = waiting
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
                .next();
            let Some(&(group, trial)) = next else { return };
            let result = compute(GROUPS[group].trials[trial], extent);
            finished
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
                .push(((group, trial), result));
            if done().is_break() {
                return;
            }
        }
    };
    let threads = bristle_grid::thread_count(None);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    let mut finished = finished
        .into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    finished.sort_by_key(|(place, _)| *place);
    let mut outcomes: Vec<Outcome> = GROUPS
        .iter()
        .map(|group| Outcome {
            group,
            trials: Vec::new(),
        })
        .collect();
    for ((group, _), result) in finished {
        outcomes[group].trials.push(result);
    }
    outcomes
}

/// Computes a trial. If it panics, which a defective solver can cause, only this trial fails.
fn compute(trial: Compute, extent: Extent) -> Result<Trial, Failure> {
    std::panic::catch_unwind(|| trial(extent)).unwrap_or_else(|cause| {
        let message = cause.downcast_ref::<String>().cloned();
        let message =
            message.or_else(|| cause.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        Err(Failure::Panic(
            message.unwrap_or_else(|| "an unknown cause".to_owned()),
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_fails_its_trial() {
        let result = compute(|_| panic!("no mass"), Extent::Quick);
        assert_eq!(
            result.expect_err("it panics").to_string(),
            "the case ended with: no mass"
        );
    }
}
