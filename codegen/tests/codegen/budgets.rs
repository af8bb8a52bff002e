//! Did the work change? Upper limits for the cost of the derivation at run time and of the emitted
//! source at build time.
//!
//! The snapshots of `golden.rs` show every change; these limits say when it is too large.
//! `cargo bench --bench speed -- derivation` measures times, this test does not.

use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::{Origin, count_operations};
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::lagrange::whole_equations;
use bristle_codegen::model::whole::{Purpose, whole_kernels};

const ORIGIN: Origin<'_> = Origin {
    title: "A test.",
    maker: "a test",
    again: "cargo test",
};

/// Maximum operations of each kernel: the number when the limit was set, plus a tenth.
const OPERATIONS: [(&str, usize); 25] = [
    ("segment", 92),
    ("segment_tangent", 231),
    ("segment_energy", 57),
    ("joint", 65),
    ("joint_tangent", 308),
    ("joint_energy", 73),
    ("clamp", 34),
    ("clamp_tangent", 106),
    ("clamp_energy", 56),
    ("rigid_rates", 23),
    ("planar_segment", 30),
    ("planar_segment_tangent", 48),
    ("planar_segment_energy", 33),
    ("planar_joint", 7),
    ("planar_joint_tangent", 6),
    ("planar_joint_energy", 9),
    ("planar_clamp", 15),
    ("planar_clamp_tangent", 31),
    ("planar_clamp_energy", 26),
    ("lateral_segment", 33),
    ("lateral_segment_tangent", 29),
    ("lateral_joint", 27),
    ("lateral_joint_tangent", 22),
    ("lateral_clamp", 18),
    ("lateral_clamp_tangent", 17),
];

/// Maximum bytes of the emitted kernels. Compile time is proportional to them.
const KERNEL_BYTES: usize = 117_000;

/// Maximum operations of the whole equations of n segments in the form for computing: M takes
/// O(n²), f and the energies O(n).
const WHOLE_OPERATIONS: [(Motion, usize, [usize; 3]); 4] = [
    (Motion::Spatial, 5, [1_130, 1_410, 608]),
    (Motion::Spatial, 25, [24_000, 7_210, 3_090]),
    (Motion::Planar, 5, [298, 530, 300]),
    (Motion::Planar, 25, [6_230, 2_710, 1_510]),
];

/// Maximum bytes of the emitted whole equations of 25 segments.
const WHOLE_BYTES: usize = 700_000;

/// Maximum nodes in the derivation of the whole equations of 12 and of 25 segments, including those
/// that simplification drops: in the form for reading, and in that for computing. Run time is
/// proportional to them.
const MAX_NODES: [(Purpose, [usize; 2]); 2] = [
    (Purpose::Reading, [34_400, 147_000]),
    (Purpose::Computing, [21_400, 70_300]),
];

#[test]
fn the_derivation_stays_within_its_budget() {
    for (index, segments) in [12, 25].into_iter().enumerate() {
        let derived = whole_equations(segments, Motion::Spatial)
            .graph
            .nodes()
            .len();
        for (purpose, limits) in MAX_NODES {
            let limit = limits[index];
            let kernels =
                whole_kernels(segments, Motion::Spatial, purpose).expect("the derivation is sound");
            let nodes = derived
                + kernels
                    .iter()
                    .map(|kernel| kernel.graph.nodes().len())
                    .sum::<usize>();
            assert!(
                nodes <= limit,
                "n = {segments}, {purpose:?}: {nodes} nodes, the budget is {limit}"
            );
        }
    }
}

#[test]
fn kernels_stay_within_their_budgets() {
    let kernels = kernels().expect("the derivation is sound");
    assert_eq!(kernels.len(), OPERATIONS.len(), "each kernel has a budget");
    for (kernel, (name, limit)) in kernels.iter().zip(OPERATIONS) {
        let operations = count_operations(kernel).total();
        assert_eq!(kernel.name, name);
        assert!(
            operations <= limit,
            "{name}: {operations} operations, the budget is {limit}"
        );
    }
    let bytes = emit(&kernels, ORIGIN)
        .expect("the kernels can be emitted")
        .len();
    assert!(
        bytes <= KERNEL_BYTES,
        "{bytes} bytes, the budget is {KERNEL_BYTES}"
    );
}

#[test]
fn whole_equations_stay_within_their_budgets() {
    for (motion, segments, limits) in WHOLE_OPERATIONS {
        let kernels =
            whole_kernels(segments, motion, Purpose::Computing).expect("the derivation is sound");
        assert_eq!(kernels.len(), limits.len(), "each kernel has a budget");
        for (kernel, limit) in kernels.iter().zip(limits) {
            let operations = count_operations(kernel).total();
            let of = format!("{motion:?}, n = {segments}, {}", kernel.name);
            assert!(
                operations <= limit,
                "{of}: {operations} operations, the budget is {limit}"
            );
        }
        if motion == Motion::Spatial && segments == 25 {
            let bytes = emit(&kernels, ORIGIN)
                .expect("the equations can be emitted")
                .len();
            assert!(
                bytes <= WHOLE_BYTES,
                "{bytes} bytes, the budget is {WHOLE_BYTES}"
            );
        }
    }
}
