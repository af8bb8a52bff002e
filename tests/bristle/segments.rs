//! Is it right? Chains of more than 25 segments in soft contact, and steel wires, compared with
//! CasADi and CVODES (`derivations/passes.py segments`). A node presses with a share of the
//! stiffness that falls with the number of nodes: refining a chain has a limit.

use bristle::model::settings::Settings;
use bristle::simulation::simulate;
use serde::Deserialize;

use crate::common::{Stated, case, cases, difference, metrics, number};

/// A case of `tests/data/reference_segments.json`.
#[derive(Deserialize)]
struct SegmentReference {
    name: String,
    input: Settings,
    filaments: [Stated; 1],
}

#[test]
fn soft_contacts_of_long_chains_are_those_of_an_independent_code() {
    let references: Vec<SegmentReference> = cases("reference_segments.json");
    assert!(references.len() >= 4);
    for SegmentReference {
        name,
        mut input,
        filaments: [expected],
    } in references
    {
        input.solver.relative_tolerance = 1e-8;
        let metrics = simulate(&input).expect("the pass ends").metrics;
        for key in [
            "contact_normal_impulse_n_s",
            "contact_impulse_x_n_s",
            "friction_work_j",
            "contact_time_s",
            "peak_contact_normal_force_n",
            "max_tip_deflection_m",
        ] {
            let scale = number(&expected, key);
            let (_, error) = difference(&metrics, &expected, key, scale);
            assert!(
                error < 1e-5,
                "{name}, n = {}: {key} is off by {error:.1e}",
                input.filament.segments
            );
        }
        let has_several_nodes = name == "soft" && input.filament.segments > 25;
        assert_eq!(metrics.contact_nodes > 1, has_several_nodes, "{name}");
    }
}

/// With the whole stiffness at every node, several of which penetrate, peaks would grow.
#[test]
fn refining_a_chain_adds_no_contact_stiffness() {
    let peak = |segments: usize| {
        let mut settings = case(segments, 30.0, 4e-3);
        settings.contact.stiffness_n_m = 1e3;
        let metrics = metrics(&settings);
        (
            metrics.peak_contact_normal_force_n,
            metrics.contact_normal_impulse_n_s,
            metrics.max_penetration_m,
        )
    };
    let [coarse, fine] = [100, 200].map(peak);
    assert!(
        (coarse.0 / fine.0 - 1.0).abs() < 0.03,
        "{coarse:?} {fine:?}"
    );
    assert!(
        (coarse.1 / fine.1 - 1.0).abs() < 0.01,
        "{coarse:?} {fine:?}"
    );
}

/// The largest penetration of a contact of the tip alone is the largest force over the stiffness.
#[test]
fn the_penetration_is_that_of_the_largest_force() {
    let metrics = metrics(&case(25, 30.0, 0.5e-3));
    assert_eq!(metrics.contact_nodes, 1);
    let expected = metrics.peak_contact_normal_force_n / 1e5;
    assert!((metrics.max_penetration_m / expected - 1.0).abs() < 1e-6);
}
