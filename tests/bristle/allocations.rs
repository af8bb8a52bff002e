//! Is the stepping path free of allocations? Passes with many steps and with few steps allocate the same.

use crate::common::case;
use bristle::model::settings::{Settings, Side, WorkpieceKind};
use bristle::simulation::{Job, simulate, simulate_side_by_side};

fn allocations(f: impl FnOnce()) -> u64 {
    allocation_counter::measure(f).count_total
}

fn at(relative_tolerance: f64) -> Settings {
    let mut settings = case(10, 10.0, 1e-3);
    settings.solver.relative_tolerance = relative_tolerance;
    settings
}

/// The same on an edge, which the filament meets inside segments, with friction.
fn on_edge(relative_tolerance: f64) -> Settings {
    let mut settings = at(relative_tolerance);
    settings.workpiece.kind = WorkpieceKind::Edge;
    settings.workpiece.side = Side::Entering;
    settings.workpiece.edge_radius_m = 0.2e-3;
    settings.workpiece.offset_m = -3e-3;
    settings.contact.friction_coefficient = 0.3;
    settings
}

#[test]
fn steps_of_a_pass_do_not_allocate() {
    for settings in [at, on_edge] {
        let steps = |tolerance| simulate(&settings(tolerance)).expect("the pass ends").statistics.steps;
        assert!(2 * steps(1e-6) > 5 * steps(1e-3), "the test could not detect allocations in a step");
        let [few, many] = [1e-3, 1e-6].map(|tolerance| {
            allocations(|| {
                simulate(&settings(tolerance)).expect("the pass ends");
            })
        });
        assert!(few > 0);
        assert_eq!(few, many);
    }
}

#[test]
fn steps_of_passes_side_by_side_do_not_allocate() {
    for settings in [at, on_edge] {
        let [few, many] = [1e-3, 1e-6].map(|tolerance| {
            let mut jobs: Vec<Job> = (0..12).map(|number| Job::new(number, &settings(tolerance))).collect();
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
}
