//! Is the stepping path free of allocations? Passes with many steps and with few steps allocate the same.

use crate::common::case;
use bristle::model::settings::Settings;
use bristle::simulation::{Job, simulate, simulate_side_by_side};

fn allocations(f: impl FnOnce()) -> u64 {
    allocation_counter::measure(f).count_total
}

fn at(relative_tolerance: f64) -> Settings {
    let mut settings = case(10, 10.0, 1e-3);
    settings.solver.relative_tolerance = relative_tolerance;
    settings
}

#[test]
fn steps_of_a_pass_do_not_allocate() {
    let steps = |tolerance| simulate(&at(tolerance)).expect("the pass ends").statistics.steps;
    assert!(steps(1e-6) > 3 * steps(1e-3), "the test could not detect allocations in a step");
    let [few, many] = [1e-3, 1e-6].map(|tolerance| {
        allocations(|| {
            simulate(&at(tolerance)).expect("the pass ends");
        })
    });
    assert!(few > 0);
    assert_eq!(few, many);
}

#[test]
fn steps_of_passes_side_by_side_do_not_allocate() {
    let [few, many] = [1e-3, 1e-6].map(|tolerance| {
        let mut jobs: Vec<Job> = (0..12).map(|number| Job::new(number, &at(tolerance))).collect();
        allocations(|| {
            simulate_side_by_side(
                |_| jobs.pop(),
                |_, result| {
                    result.expect("the pass ends");
                },
            );
        })
    });
    assert!(few > 0);
    assert_eq!(few, many);
}
