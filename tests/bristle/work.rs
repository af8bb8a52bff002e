//! Did the work change? Counts of steps, Newton iterations and events of a few passes.

use bristle::simulation::Statistics;
use bristle::simulation::simulate;

/// Largest relative difference of counts between processors, whose sines differ in the last digit.
const MARGIN: f64 = 0.02;

#[test]
fn work_of_typical_passes() {
    // Steps, rejected steps, Newton iterations, Newton failures, factorisations, events. After an
    // intended change, the message of the failed assertion shows the new counts.
    let expected = [
        ((25, 10.0, 1e-3), [443, 33, 3107, 5, 490, 8]),
        ((25, 30.0, 5e-3), [491, 42, 3501, 5, 550, 10]),
        ((25, 2.5, 5e-3), [1640, 26, 10232, 4, 1676, 6]),
        ((5, 20.0, 2e-3), [278, 10, 2021, 4, 304, 10]),
    ];
    for ((segments, velocity, depth), expected) in expected {
        let statistics = simulate(&crate::common::case(segments, velocity, depth))
            .expect("the pass ends")
            .statistics;
        let Statistics {
            steps,
            unresolved_steps,
            rejected_steps,
            newton_iterations,
            newton_failures,
            factorisations,
            contact_events,
            chart_changes,
        } = statistics;
        assert_eq!(unresolved_steps, 0, "an ordinary pass keeps its tolerance");
        assert_eq!(
            chart_changes, 0,
            "a round tool's filament stays away from the poles of z"
        );
        let counts = [
            steps,
            rejected_steps,
            newton_iterations,
            newton_failures,
            factorisations,
            contact_events,
        ];
        for (count, expected) in counts.into_iter().zip(expected) {
            let difference = count.abs_diff(expected) as f64;
            // Small counts may differ by one or two.
            assert!(
                difference <= (MARGIN * expected as f64).max(2.0),
                "v_b = {velocity}: {counts:?}"
            );
        }
    }
}

#[test]
fn friction_costs_little_more() {
    // Largest ratio of a single pass, as the number of contacts can differ; over the paper's 120 it
    // is 1.21.
    const MAX_RATIO: f64 = 1.5;
    let iterations = |friction: f64, (velocity, depth): (f64, f64)| {
        let mut settings = crate::common::case(25, velocity, depth);
        settings.contact.friction_coefficient = friction;
        simulate(&settings)
            .expect("the pass ends")
            .statistics
            .newton_iterations as f64
    };
    for case in [(10.0, 1e-3), (30.0, 5e-3), (15.0, 3e-3)] {
        let ratio = iterations(0.3, case) / iterations(0.0, case);
        assert!(ratio <= MAX_RATIO, "{case:?}: {ratio}");
    }
}
