//! Passes that once took minutes or failed end with a bounded amount of work.

use bristle::model::settings::{Side, WorkpieceKind};
use bristle::simulation::{Statistics, simulate};

use crate::common::{case, edge};

/// Maximum number of Newton iterations of one segment in a pass, see `EFFORT` and `EXHAUSTION` in
/// the sources.
const MAX_ITERATIONS: f64 = 3.5 * 4e7;

/// Slow passes: segments, v_b in m/s, a_e in m.
const SLOW: [(usize, f64, f64); 3] = [(53, 1.33, 1e-3), (100, 0.7, 5e-4), (18, 0.4, 2e-3)];

#[test]
fn undamped_passes_end() {
    for (segments, velocity, depth) in SLOW {
        let mut settings = case(segments, velocity, depth);
        settings.filament.damping_ratio = 0.0;
        let simulation = simulate(&settings).expect("the pass ends");
        let Statistics {
            newton_iterations, ..
        } = simulation.statistics;
        let work = (newton_iterations * (segments + 2)) as f64;
        assert!(
            work <= MAX_ITERATIONS,
            "n = {segments}: {newton_iterations} Newton iterations"
        );
    }
}

#[test]
fn slow_damped_passes_keep_their_tolerance() {
    for (segments, velocity, depth) in SLOW {
        let statistics = simulate(&case(segments, velocity, depth))
            .expect("the pass ends")
            .statistics;
        assert_eq!(
            statistics.unresolved_steps, 0,
            "n = {segments}: {statistics:?}"
        );
    }
}

/// The tip meets the side of the part where the arc begins, and presses there while it hardly moves
/// to either.
#[test]
fn tips_that_touch_where_an_arc_begins_take_no_shorter_steps() {
    for edge_radius_m in [1e-4, 5e-4, 1e-3] {
        let mut settings = case(6, 10.0, 1e-3);
        settings.workpiece.kind = edge(Side::Entering, 0.0, edge_radius_m);
        let Statistics {
            steps,
            rejected_steps,
            ..
        } = simulate(&settings).expect("the pass ends").statistics;
        assert!(
            steps + rejected_steps < 450,
            "{edge_radius_m} m: {steps} steps, {rejected_steps} rejected"
        );
    }
}

/// Contacts that damp come off at nearly the rate at which they cease to press; the remaining force
/// has long been within rounding.
#[test]
fn contacts_that_damp_take_no_shorter_steps() {
    let mut flat = case(6, 8.5, 7.3e-4);
    let contact = &mut flat.contact;
    (contact.stiffness_n_m, contact.exponent, contact.damping_s_m) = (8e6, 1.9, 1.4);
    flat.solver.relative_tolerance = 1e-9;

    let mut curved = case(3, 20.0, 2e-3);
    (curved.tool.body_radius_m, curved.filament.diameter_m) = (0.05, 5e-4);
    curved.workpiece.kind = WorkpieceKind::cylinder(0.02);
    (
        curved.contact.stiffness_n_m,
        curved.contact.damping_s_m,
        curved.contact.friction_coefficient,
    ) = (1e4, 1.0, 0.5);

    for (settings, most) in [(flat, 1500), (curved, 400)] {
        let Statistics {
            steps,
            rejected_steps,
            ..
        } = simulate(&settings).expect("the pass ends").statistics;
        assert!(
            steps + rejected_steps < most,
            "{steps} steps, {rejected_steps} rejected"
        );
    }
}
