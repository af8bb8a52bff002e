//! The whole equations that are emitted in every language, and states to evaluate them at.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use bristle_codegen::ir::kernel::{Kernel, KernelInput};
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use fastrand::Rng;

/// Number of segments and motion of the chains, each with the name of its functions.
pub const CHAINS: [(&str, usize, Motion); 4] = [
    ("spatial_1", 1, Motion::Spatial),
    ("spatial_2", 2, Motion::Spatial),
    ("planar_2", 2, Motion::Planar),
    ("planar_5", 5, Motion::Planar),
];

/// The functions of a chain.
pub fn kernels(segments: usize, motion: Motion) -> Vec<Kernel> {
    whole_kernels(segments, motion, Purpose::Computing).expect("the derivation is sound")
}

/// The range of an element of an input. All are of order one, and no joint is bent by more than a
/// radian.
fn range(input: &KernelInput, element: &str) -> Range<f64> {
    match input.name.as_str() {
        "q" if element.starts_with("phi") => FRAC_PI_2 - 0.4..FRAC_PI_2 + 0.4,
        "q" => -1.9..-1.1,
        "clamp_direction" => -1.0..-0.1,
        "segment_length" | "segment_mass" | "segment_inertia" | "joint_stiffness"
        | "joint_damping" => 0.5..1.5,
        "relaxed_angle" => -0.2..0.2,
        "a" | "b" => 0.1..0.9,
        _ => -2.0..2.0,
    }
}

/// Random values of all elements of the inputs, in order. Kernels of a chain, and those of the
/// operators, have the same inputs.
pub fn state(kernel: &Kernel, rng: &mut Rng) -> Vec<f64> {
    let mut values = Vec::new();
    for input in &kernel.inputs {
        for (element, _) in &input.elements {
            let Range { start, end } = range(input, element);
            values.push(start + rng.f64() * (end - start));
        }
    }
    values
}
