//! Did the work change? Upper limits for what the derivation may cost at run time and the emitted source at build time.
//!
//! The snapshots of `golden.rs` show every change; these limits say how much is too much. `cargo bench --bench speed -- derivation` measures
//! times, not this test.

use bristle_codegen::back::rust::{Origin, count_operations, emit};
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::lagrange::whole_equations;
use bristle_codegen::model::whole::{Purpose, whole_kernels};

const ORIGIN: Origin<'_> = Origin { title: "A test.", maker: "a test", again: "cargo test" };

/// Operations of each kernel: the number when the limit was set, plus a tenth.
const OPERATIONS: [(&str, usize); 11] = [
    ("segment", 92),
    ("segment_tangent", 231),
    ("segment_energy", 57),
    ("joint", 65),
    ("joint_tangent", 308),
    ("joint_energy", 72),
    ("clamp", 58),
    ("clamp_tangent", 147),
    ("clamp_energy", 85),
    ("crossed_joint", 94),
    ("crossed_joint_tangent", 567),
];

/// Bytes of the emitted kernels. Compile time is proportional to them.
const KERNEL_BYTES: usize = 56_000;

/// Operations of the whole equations of n segments in the form for computing: M takes O(n²), f and the energies O(n).
const WHOLE: [(usize, [usize; 3]); 2] = [(5, [960, 1_220, 530]), (25, [20_700, 6_200, 2_640])];

/// Bytes of the emitted whole equations for 25 segments.
const WHOLE_BYTES: usize = 590_000;

/// Nodes that the derivation of the whole equations makes for 12 and for 25 segments, including those that simplification
/// drops: in the form for reading, and in the form for computing. Run time is proportional to them.
const WORK: [(Purpose, [usize; 2]); 2] = [(Purpose::Reading, [22_600, 81_000]), (Purpose::Computing, [21_400, 70_300])];

#[test]
fn the_derivation_stays_within_its_budget() {
    for (purpose, limits) in WORK {
        for (segments, limit) in [12, 25].into_iter().zip(limits) {
            let kernels = whole_kernels(segments, purpose).expect("the derivation is sound");
            let derived = whole_equations(segments).graph.nodes().len();
            let nodes = derived + kernels.iter().map(|kernel| kernel.graph.nodes().len()).sum::<usize>();
            assert!(nodes <= limit, "n = {segments}, {purpose:?}: {nodes} nodes, the budget is {limit}");
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
        assert!(operations <= limit, "{name}: {operations} operations, the budget is {limit}");
    }
    let bytes = emit(&kernels, ORIGIN).expect("the kernels can be emitted").len();
    assert!(bytes <= KERNEL_BYTES, "{bytes} bytes, the budget is {KERNEL_BYTES}");
}

#[test]
fn whole_equations_stay_within_their_budgets() {
    for (segments, limits) in WHOLE {
        let kernels = whole_kernels(segments, Purpose::Computing).expect("the derivation is sound");
        assert_eq!(kernels.len(), limits.len(), "each kernel has a budget");
        for (kernel, limit) in kernels.iter().zip(limits) {
            let operations = count_operations(kernel).total();
            let name = &kernel.name;
            assert!(operations <= limit, "n = {segments}, {name}: {operations} operations, the budget is {limit}");
        }
        if segments == 25 {
            let bytes = emit(&kernels, ORIGIN).expect("the equations can be emitted").len();
            assert!(bytes <= WHOLE_BYTES, "{bytes} bytes, the budget is {WHOLE_BYTES}");
        }
    }
}
