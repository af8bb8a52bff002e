//! Two derivations of the same kernels, compared at random states.
//!
//! Enter the kernels of two engines; leaves, for each output, the largest difference between their values. A state
//! gives values to the symbols, which both sides name alike; neither side sees the expressions of the other.

use std::f64::consts::PI;

use fastrand::Rng;

use crate::graph::Symbol;
use crate::kernels::{Kernel, Output};
use crate::unit::Unit;

/// How well one output agrees.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// Name of the kernel.
    pub kernel: String,
    /// Name of the output.
    pub output: String,
    /// Number of elements of the output.
    pub elements: usize,
    /// Over all states, the largest difference of an element, relative to the largest element of the output at that
    /// state; infinite where only one side is finite.
    pub largest: f64,
}

/// Why two lists of kernels cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CompareError {
    /// A kernel is missing, or comes at another place.
    #[error("the kernels are {found}, but should be {expected}")]
    Kernels {
        /// Names in the expected list.
        expected: String,
        /// Names in the other one.
        found: String,
    },
    /// A kernel has other arguments or results.
    #[error("kernel `{kernel}` {part} {found}, but should {part} {expected}")]
    Signature {
        /// Name of the kernel.
        kernel: String,
        /// What differs.
        part: &'static str,
        /// What is expected.
        expected: String,
        /// What there is.
        found: String,
    },
    /// A kernel uses a symbol that the expected one does not have.
    #[error("kernel `{kernel}` uses the symbol `{symbol}`, which is none of the model")]
    Symbol {
        /// Name of the kernel.
        kernel: String,
        /// The symbol.
        symbol: String,
    },
}

/// Two derivations agree where no output deviates by more: some thousand roundings, for sums of hundreds of terms at
/// states whose joints are no closer than 0.1 rad to being folded back.
pub const TOLERANCE: f64 = 1e-12;

/// Which states are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum States {
    /// Straight, slightly bent, and strongly bent ones in turn.
    All,
    /// Without straight ones, where some forms of the spring are singular.
    Bent,
}

/// Least and largest change of a coordinate from one side of a joint to the other, in rad, of the states drawn in turn.
///
/// The series of `S` serves most of the second and third, the closed form most of the last. Smaller bends than these make
/// the energy of a spring ill-conditioned in the angles; none at all is exact.
const BENDS: [[f64; 2]; 4] = [[0.0, 0.0], [0.0, 0.05], [0.0, 0.3], [0.0, 1.2]];

/// The same for [`States::Bent`]: `½ arccos²(c)` loses `1/α²` roundings.
const STRONG_BENDS: [[f64; 2]; 2] = [[0.2, 0.4], [0.4, 1.2]];

/// Evaluates `found` and `expected` at `states` random states and returns the deviations in the order of the outputs.
///
/// Lengths, masses and all other quantities are of order one, so that every term weighs. The same seed gives the same
/// states.
///
/// # Errors
/// If the two do not compute the same things.
pub fn compare(
    expected: &[Kernel],
    found: &[Kernel],
    states: usize,
    which: States,
    seed: u64,
) -> Result<Vec<Deviation>, CompareError> {
    check_signatures(expected, found)?;
    let mut rng = Rng::with_seed(seed);
    let mut deviations = Vec::new();
    for (expected, found) in expected.iter().zip(found) {
        let order = symbol_order(expected, found)?;
        let start = deviations.len();
        deviations.extend(expected.outputs.iter().map(|output| Deviation {
            kernel: expected.name.clone(),
            output: output.name.clone(),
            elements: output.nodes.len(),
            largest: 0.0,
        }));
        let bends = if which == States::Bent { &STRONG_BENDS[..] } else { &BENDS };
        for state in 0..states {
            let point = random_point(expected.graph.symbols(), bends[state % bends.len()], &mut rng);
            let other: Vec<f64> = order.iter().map(|&symbol| point[symbol]).collect();
            let values = [expected.graph.evaluate(&point), found.graph.evaluate(&other)];
            for (i, deviation) in deviations[start..].iter_mut().enumerate() {
                let difference = difference(&expected.outputs[i], &values[0], &found.outputs[i], &values[1]);
                deviation.largest = deviation.largest.max(difference);
            }
        }
    }
    Ok(deviations)
}

/// Checks that both sides have the same kernels with the same arguments and results.
///
/// # Errors
/// The first difference.
pub fn check_signatures(expected: &[Kernel], found: &[Kernel]) -> Result<(), CompareError> {
    let names = |kernels: &[Kernel]| kernels.iter().map(|kernel| kernel.name.as_str()).collect::<Vec<_>>().join(", ");
    if names(expected) != names(found) {
        return Err(CompareError::Kernels { expected: names(expected), found: names(found) });
    }
    for (expected, found) in expected.iter().zip(found) {
        for (part, signature) in [("takes", inputs as fn(&Kernel) -> String), ("gives", outputs)] {
            let (expected_part, found_part) = (signature(expected), signature(found));
            if expected_part != found_part {
                let kernel = expected.name.clone();
                return Err(CompareError::Signature { kernel, part, expected: expected_part, found: found_part });
            }
        }
    }
    Ok(())
}

fn inputs(kernel: &Kernel) -> String {
    let element = |(name, _): &(String, _)| name.clone();
    let inputs = kernel.inputs.iter().map(|input| {
        let elements: Vec<String> = input.elements.iter().map(element).collect();
        format!("{}({})", input.name, elements.join(", "))
    });
    inputs.collect::<Vec<_>>().join(", ")
}

fn outputs(kernel: &Kernel) -> String {
    let output = |output: &Output| format!("{} {:?} in {}", output.name, output.shape, output.unit);
    kernel.outputs.iter().map(output).collect::<Vec<_>>().join(", ")
}

/// The place of each symbol of `found` among those of `expected`.
fn symbol_order(expected: &Kernel, found: &Kernel) -> Result<Vec<usize>, CompareError> {
    let position = |symbol: &Symbol| {
        let symbols = expected.graph.symbols();
        let same = |other: &Symbol| other.name == symbol.name && other.unit == symbol.unit;
        symbols.iter().position(same).ok_or_else(|| CompareError::Symbol {
            kernel: found.name.clone(),
            symbol: format!("{} ({})", symbol.name, symbol.unit),
        })
    };
    found.graph.symbols().iter().map(position).collect()
}

fn difference(expected: &Output, expected_values: &[f64], found: &Output, found_values: &[f64]) -> f64 {
    let pairs = expected.nodes.iter().zip(&found.nodes);
    let (mut scale, mut largest) = (0.0_f64, 0.0_f64);
    for (expected, found) in pairs {
        let (expected, found) = (expected_values[expected.index()], found_values[found.index()]);
        if !expected.is_finite() || !found.is_finite() {
            return f64::INFINITY;
        }
        scale = scale.max(expected.abs());
        largest = largest.max((expected - found).abs());
    }
    if largest == 0.0 { 0.0 } else { largest / scale }
}

/// A state: directions that follow each other with bends of the sizes `bend`, unit clamp vectors, positive constants.
fn random_point(symbols: &[Symbol], [least, most]: [f64; 2], rng: &mut Rng) -> Vec<f64> {
    let mut angles = [0.9 + 1.3 * rng.f64(), PI * (2.0 * rng.f64() - 1.0)];
    let clamp = clamp_vectors(angles, rng);
    let mut values = Vec::with_capacity(symbols.len());
    for symbol in symbols {
        let mut symmetric = |size: f64| size * (2.0 * rng.f64() - 1.0);
        let value = if let Some(component) = clamp.iter().find(|(name, _)| *name == symbol.name) {
            component.1
        } else if symbol.unit == Unit::RADIAN {
            let polar = symbol.name.starts_with("phi");
            let angle = &mut angles[usize::from(!polar)];
            let bend = symmetric(most - least);
            let step = bend + least.copysign(bend);
            // The other way where it would come close to a pole.
            *angle += if polar && (*angle + step).sin() < 0.4 { -step } else { step };
            *angle
        } else if POSITIVE.iter().any(|word| symbol.name.ends_with(word)) {
            0.5 + 1.5 * rng.f64()
        } else {
            symmetric(2.0)
        };
        values.push(value);
    }
    values
}

/// Last words of the names of quantities that are positive.
const POSITIVE: [&str; 6] = ["length", "mass", "inertia", "stiffness", "damping", "weight"];

/// A clamp along the direction of `angles`, which turns.
fn clamp_vectors([polar, azimuth]: [f64; 2], rng: &mut Rng) -> [(&'static str, f64); 6] {
    // In the order of operations of an expression graph, so that a straight joint is straight to the last bit.
    let ((sin_polar, cos_polar), (sin_azimuth, cos_azimuth)) = (polar.sin_cos(), azimuth.sin_cos());
    let direction = [sin_polar * cos_azimuth, sin_polar * sin_azimuth, cos_polar];
    let [a, b, c] = [0; 3].map(|_| 2.0 * rng.f64() - 1.0);
    let rate =
        [b * direction[2] - c * direction[1], c * direction[0] - a * direction[2], a * direction[1] - b * direction[0]];
    [
        ("clamp_direction_x", direction[0]),
        ("clamp_direction_y", direction[1]),
        ("clamp_direction_z", direction[2]),
        ("clamp_direction_rate_x", rate[0]),
        ("clamp_direction_rate_y", rate[1]),
        ("clamp_direction_rate_z", rate[2]),
    ]
}

/// The number of segments of whole equations, if `kernels` are such; none for other kernels.
pub fn whole_segments(kernels: &[Kernel]) -> Option<usize> {
    let coordinates = &kernels.first()?.inputs.iter().find(|input| input.name == "q")?.elements;
    (coordinates.len() % 2 == 0 && !coordinates.is_empty()).then_some(coordinates.len() / 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::kernels;
    use crate::whole::{Purpose, whole_kernels};

    fn whole(segments: usize, purpose: Purpose) -> Vec<Kernel> {
        whole_kernels(segments, purpose).expect("the derivation is sound")
    }

    #[test]
    fn a_wrong_sign_is_found_and_the_same_is_the_same() {
        let expected = whole(2, Purpose::Computing);
        let same = compare(&expected, &expected, 8, States::All, 1).expect("they are the same");
        assert!(same.iter().all(|deviation| deviation.largest == 0.0));
        let mut wrong = expected.clone();
        let force = wrong.iter_mut().find(|kernel| kernel.name == "force").expect("there is a force");
        let last = force.outputs[0].nodes.len() - 1;
        force.outputs[0].nodes[last] = force.graph.neg(force.outputs[0].nodes[last]);
        let deviations = compare(&expected, &wrong, 8, States::All, 1).expect("they compute the same things");
        let force = deviations.iter().find(|deviation| deviation.kernel == "force").expect("there is a force");
        assert!(force.largest > 0.01);
    }

    #[test]
    fn other_kernels_are_refused() {
        let (one, two) = (whole(1, Purpose::Computing), whole(2, Purpose::Computing));
        assert!(matches!(compare(&one, &two, 1, States::All, 1), Err(CompareError::Signature { .. })));
        let kernels = kernels().expect("the derivation is sound");
        assert!(matches!(compare(&one, &kernels, 1, States::All, 1), Err(CompareError::Kernels { .. })));
        assert_eq!((whole_segments(&two), whole_segments(&kernels)), (Some(2), None));
    }

    #[test]
    fn one_without_a_value_is_infinitely_wrong() {
        let expected = whole(1, Purpose::Computing);
        let mut wrong = expected.clone();
        let graph = &mut wrong[0].graph;
        let minus_one = graph.integer(-1);
        let nothing = graph.sqrt(minus_one);
        wrong[0].outputs[0].nodes[0] = nothing;
        let deviations = compare(&expected, &wrong, 1, States::All, 1).expect("they compute the same things");
        assert_eq!(deviations[0].largest, f64::INFINITY);
    }

    #[test]
    fn a_straight_state_is_straight_to_the_last_bit() {
        let kernel = &whole(3, Purpose::Computing)[2];
        let point = random_point(kernel.graph.symbols(), BENDS[0], &mut Rng::with_seed(2));
        let values = kernel.graph.evaluate(&point);
        assert_eq!(kernel.outputs[1].name, "spring");
        assert_eq!(values[kernel.outputs[1].nodes[0].index()], 0.0);
    }
}
