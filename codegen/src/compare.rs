//! Two derivations of the same kernels, compared at random states.
//!
//! The result is the largest difference between the two values of each output. A state gives values
//! to the symbols, which both sides name alike. Neither side sees the expressions of the other.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::text::shown;
use fastrand::Rng;

use crate::ir::graph::{NodeId, Symbol};
use crate::ir::kernel::{Kernel, KernelInput, Output, OutputShape};
use crate::ir::unit::Unit;
use crate::model::chain::Motion;
use crate::model::whole::NAMES;

/// Deviation of an output.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// Name of the kernel.
    pub kernel: String,
    /// Name of the output.
    pub output: String,
    /// Number of elements of the output.
    pub elements: usize,
    /// Largest difference of an element over all states, relative to the size of the output;
    /// infinite where one side is not finite.
    ///
    /// The size is the largest element at the state, but at least [`MIN_SHARE`] of the largest at
    /// any state. Where an output almost vanishes, the terms that cancel in it carry its rounding.
    /// The size of an output that vanishes at every state is 1, because all quantities are of order
    /// one.
    pub largest: f64,
}

/// Largest deviation of derivations that agree: some thousand roundings, for sums of hundreds of
/// terms and joints bent by at most 1.8 rad. Over 200 seeds of 1000 states the committed graphs
/// deviate by up to 2.5e-13.
pub const TOLERANCE: f64 = 1e-12;

/// Least size that differences are relative to, over the output's size over all states.
pub const MIN_SHARE: f64 = 1e-3;

/// Largest deviation of an argument from its expected value: some roundings of a sine.
const MAX_DEVIATION: f64 = 8.0 * f64::EPSILON;

/// Selection of random states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum States {
    /// Straight, slightly bent, and strongly bent states in turn.
    All,
    /// No straight states, where some forms of the spring are singular.
    Bent,
}

/// Least and largest change of a coordinate across a joint, in rad, of the states drawn in turn.
///
/// The series of `S` serves most of the second and third, the closed form most of the last. Smaller
/// bends than these make the energy of a spring ill-conditioned in the angles; none at all is
/// exact.
const BENDS: [[f64; 2]; 4] = [[0.0, 0.0], [0.0, 0.05], [0.0, 0.3], [0.0, 1.2]];

/// Bends of [`States::Bent`], in rad: `½ arccos²(c)` loses `1/α²` roundings.
const STRONG_BENDS: [[f64; 2]; 2] = [[0.2, 0.4], [0.4, 1.2]];

/// Evaluates `found` and `expected` at `states` random states and returns the deviations in the
/// order of the outputs.
///
/// Lengths, masses and all other quantities are of order one, so that every term counts. The same
/// seed gives the same states.
///
/// # Errors
/// If the two do not compute the same things.
pub fn compare(
    expected: &[Kernel],
    found: &[Kernel],
    states: usize,
    which: States,
    seed: u64,
) -> Result<Vec<Deviation>, String> {
    check_signatures(expected, found)?;
    let mut rng = Rng::with_seed(seed);
    let mut deviations = Vec::new();
    for (expected, found) in expected.iter().zip(found) {
        let order = symbol_order(expected, found)?;
        let bends = if which == States::Bent {
            &STRONG_BENDS[..]
        } else {
            &BENDS
        };
        let mut sizes: Vec<Vec<OutputSize>> =
            vec![Vec::with_capacity(states); expected.outputs.len()];
        for state in 0..states {
            let point = random_point(expected, bends[state % bends.len()], &mut rng);
            let other: Vec<f64> = order.iter().map(|&symbol| point[symbol]).collect();
            let values = [
                expected.graph.evaluate(&point),
                found.graph.evaluate(&other),
            ];
            check_arguments(expected, &values[0], found, &values[1])?;
            for (i, sizes) in sizes.iter_mut().enumerate() {
                sizes.push(size(
                    &expected.outputs[i],
                    &values[0],
                    &found.outputs[i],
                    &values[1],
                ));
            }
        }
        for (output, sizes) in expected.outputs.iter().zip(sizes) {
            let least = match sizes.iter().map(|size| size.largest).fold(0.0, f64::max) {
                0.0 => 1.0,
                largest => MIN_SHARE * largest,
            };
            let relative = |size: &OutputSize| size.difference / size.largest.max(least);
            deviations.push(Deviation {
                kernel: expected.name.clone(),
                output: output.name.clone(),
                elements: output.nodes.len(),
                largest: sizes.iter().map(relative).fold(0.0, f64::max),
            });
        }
    }
    Ok(deviations)
}

/// Checks that both sides have the same kernels with the same arguments and results.
///
/// # Errors
/// The first difference.
pub fn check_signatures(expected: &[Kernel], found: &[Kernel]) -> Result<(), String> {
    let name = |kernel: &Kernel| format!("`{}`", kernel.name);
    if let Some((number, expected, found)) =
        first_difference(expected.iter().map(name), found.iter().map(name))
    {
        return Err(format!(
            "kernel {number} is {found}, but should be {expected}"
        ));
    }
    for (expected, found) in expected.iter().zip(found) {
        let inputs = first_difference(
            expected.inputs.iter().map(input_text),
            found.inputs.iter().map(input_text),
        );
        let outputs = first_difference(
            expected.outputs.iter().map(output_text),
            found.outputs.iter().map(output_text),
        );
        for (part, difference) in [("input", inputs), ("output", outputs)] {
            if let Some((number, expected_part, found_part)) = difference {
                return Err(format!(
                    "kernel `{}`: {part} {number} is {}, but should be {}",
                    expected.name,
                    shown(&found_part, MAX_CHARS),
                    shown(&expected_part, MAX_CHARS)
                ));
            }
        }
    }
    Ok(())
}

/// Maximum characters of an input or output in an error.
const MAX_CHARS: usize = 200;

/// The first place at which two lists differ, counted from 1, with the two entries.
fn first_difference(
    mut expected: impl Iterator<Item = String>,
    mut found: impl Iterator<Item = String>,
) -> Option<(usize, String, String)> {
    let missing = || "missing".to_owned();
    (1..)
        .map_while(|number| {
            Some((number, expected.next(), found.next()))
                .filter(|(_, a, b)| a.is_some() || b.is_some())
        })
        .find_map(|(number, expected, found)| {
            (expected != found).then(|| {
                (
                    number,
                    expected.unwrap_or_else(missing),
                    found.unwrap_or_else(missing),
                )
            })
        })
}

fn input_text(input: &KernelInput) -> String {
    let elements: Vec<&str> = input
        .elements
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    format!("`{}` of {}", input.name, elements.join(", "))
}

fn output_text(output: &Output) -> String {
    format!("`{}`, {:?} in {}", output.name, output.shape, output.unit)
}

/// Checks that the arguments of both sides represent the same quantities, which are all that the
/// emitted function sees.
fn check_arguments(
    expected: &Kernel,
    values: &[f64],
    found: &Kernel,
    found_values: &[f64],
) -> Result<(), String> {
    let elements = |kernel: &Kernel| -> Vec<(String, NodeId)> {
        kernel
            .inputs
            .iter()
            .flat_map(|input| input.elements.iter().cloned())
            .collect()
    };
    for ((element, expected_node), (_, found_node)) in
        elements(expected).into_iter().zip(elements(found))
    {
        let (value, other) = (
            values[expected_node.index()],
            found_values[found_node.index()],
        );
        if (value - other).abs() > MAX_DEVIATION * value.abs().max(1.0) {
            return Err(format!(
                "kernel `{}`: the argument `{element}` stands for another quantity than in the model",
                expected.name
            ));
        }
    }
    Ok(())
}

/// The place of each symbol of `found` among those of `expected`.
fn symbol_order(expected: &Kernel, found: &Kernel) -> Result<Vec<usize>, String> {
    let position = |symbol: &Symbol| {
        let symbols = expected.graph.symbols();
        let same = |other: &Symbol| other.name == symbol.name && other.unit == symbol.unit;
        symbols.iter().position(same).ok_or_else(|| {
            format!(
                "kernel `{}` uses the symbol `{} ({})`, which the model does not have",
                found.name, symbol.name, symbol.unit
            )
        })
    };
    found.graph.symbols().iter().map(position).collect()
}

/// An output at one state.
#[derive(Clone, Copy, Debug)]
struct OutputSize {
    /// The largest element.
    largest: f64,
    /// The largest difference of an element between the two sides.
    difference: f64,
}

fn size(
    expected: &Output,
    expected_values: &[f64],
    found: &Output,
    found_values: &[f64],
) -> OutputSize {
    let mut size = OutputSize {
        largest: 0.0,
        difference: 0.0,
    };
    for (expected, found) in expected.nodes.iter().zip(&found.nodes) {
        let (expected, found) = (
            expected_values[expected.index()],
            found_values[found.index()],
        );
        if !expected.is_finite() || !found.is_finite() {
            return OutputSize {
                largest: 0.0,
                difference: f64::INFINITY,
            };
        }
        size.largest = size.largest.max(expected.abs());
        size.difference = size.difference.max((expected - found).abs());
    }
    size
}

/// `true` if the arguments of `kernel` have no polar angle: the motion is planar.
fn is_planar(kernel: &Kernel) -> bool {
    let mut names = kernel
        .inputs
        .iter()
        .flat_map(|input| &input.elements)
        .map(|(name, _)| name);
    names.all(|name| !name.contains("phi") || name.starts_with(VARIATION))
}

/// Prefix of the names of lateral variations of a planar motion.
const VARIATION: &str = "phi_variation";

/// Draws a state of `kernel`: directions that follow each other with bends of the sizes `bend`,
/// unit clamp vectors, positive constants.
fn random_point(kernel: &Kernel, bend: [f64; 2], rng: &mut Rng) -> Vec<f64> {
    let symbols = kernel.graph.symbols();
    let azimuth = symmetric(PI, rng);
    let polar = if is_planar(kernel) {
        0.5 * PI
    } else {
        0.9 + 1.3 * rng.f64()
    };
    let mut angles = [polar, azimuth];
    // A straight state has no relaxed angles, so that it is straight to the last bit.
    let relaxed = if bend[1] > 0.0 { MAX_RELAXED } else { 0.0 };
    let clamp = clamp_vectors(angles, symmetric(relaxed, rng), rng);
    let mut relaxed_angles = BTreeMap::new();
    let mut values = Vec::with_capacity(symbols.len());
    for symbol in symbols {
        let name = symbol.name.as_str();
        let component = |(vector, components): &(&str, [f64; 3])| {
            let axis = ["_x", "_y", "_z"]
                .iter()
                .position(|axis| name.strip_prefix(vector) == Some(*axis))?;
            Some(components[axis])
        };
        let value = if let Some(component) = clamp.iter().find_map(component) {
            component
        } else if let Some(joint) = name.strip_prefix("relaxed_angle") {
            let angle = symmetric(relaxed, rng);
            relaxed_angles.insert(joint.to_owned(), angle);
            angle
        } else if symbol.unit == Unit::RADIAN && !name.starts_with(VARIATION) {
            if let Some(label) = name.strip_prefix("theta") {
                let joint = if label == "_next" { "" } else { label };
                angles[1] += relaxed_angles.get(joint).copied().unwrap_or(0.0);
            }
            let coordinate = usize::from(!name.starts_with("phi"));
            angles[coordinate] = bent(angles, coordinate, bend, rng);
            angles[coordinate]
        } else if POSITIVE.iter().any(|word| name.ends_with(word)) {
            0.5 + 1.5 * rng.f64()
        } else {
            symmetric(2.0, rng)
        };
        values.push(value);
    }
    values
}

fn symmetric(size: f64, rng: &mut Rng) -> f64 {
    size * (2.0 * rng.f64() - 1.0)
}

/// Smaller sines are close to that of a pole.
const MIN_SINE: f64 = 0.4;

/// Bends a coordinate of `angles`, the other way where it would come close to a pole.
fn bent(angles: [f64; 2], coordinate: usize, [least, most]: [f64; 2], rng: &mut Rng) -> f64 {
    let bend = symmetric(most - least, rng);
    let (angle, step) = (angles[coordinate], bend + least.copysign(bend));
    if coordinate == 0 && (angle + step).sin() < MIN_SINE {
        angle - step
    } else {
        angle + step
    }
}

/// A direction, with operations in the order of an expression graph, so that a straight joint is
/// straight to the last bit.
fn direction([polar, azimuth]: [f64; 2]) -> [f64; 3] {
    [
        polar.sin() * azimuth.cos(),
        polar.sin() * azimuth.sin(),
        polar.cos(),
    ]
}

/// Last words of the names of quantities that are positive.
const POSITIVE: [&str; 6] = [
    "length",
    "mass",
    "inertia",
    "stiffness",
    "damping",
    "weight",
];

/// Largest relaxed angle of a joint, in rad.
const MAX_RELAXED: f64 = 0.25;

/// A turning clamp along the direction of `angles`, and that clamp turned about `z` by
/// `relaxed_angle`.
fn clamp_vectors(
    angles: [f64; 2],
    relaxed_angle: f64,
    rng: &mut Rng,
) -> [(&'static str, [f64; 3]); 4] {
    let direction = direction(angles);
    let [a, b, c] = [0; 3].map(|_| symmetric(1.0, rng));
    let rate = [
        b * direction[2] - c * direction[1],
        c * direction[0] - a * direction[2],
        a * direction[1] - b * direction[0],
    ];
    let (sin, cos) = relaxed_angle.sin_cos();
    let turned = |[x, y, z]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
    [
        ("relaxed_direction", turned(direction)),
        ("relaxed_direction_rate", turned(rate)),
        ("clamp_direction", direction),
        ("clamp_direction_rate", rate),
    ]
}

/// The number of segments and the motion of whole equations; `None` for other kernels.
pub fn whole_chain(kernels: &[Kernel]) -> Option<(usize, Motion)> {
    let names = || kernels.iter().map(|kernel| kernel.name.as_str());
    let named = |motion: &Motion| names().eq(NAMES.map(|name| motion.name_for(name)));
    let motion = [Motion::Spatial, Motion::Planar].into_iter().find(named)?;
    let [
        Output {
            shape: OutputShape::Matrix(rows, columns),
            ..
        },
    ] = kernels.first()?.outputs[..]
    else {
        return None;
    };
    let coordinates = motion.coordinates_per_segment();
    (rows == columns && rows.is_multiple_of(coordinates)).then_some((rows / coordinates, motion))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::constant::Constant;
    use crate::model::kernels::kernels;
    use crate::model::whole::{Purpose, whole_kernels};

    fn whole(segments: usize, purpose: Purpose) -> Vec<Kernel> {
        whole_kernels(segments, Motion::Spatial, purpose).expect("the derivation is sound")
    }

    #[test]
    fn a_wrong_sign_is_found_and_the_same_is_the_same() {
        let expected = whole(2, Purpose::Computing);
        let same = compare(&expected, &expected, 8, States::All, 1).expect("they are the same");
        assert!(same.iter().all(|deviation| deviation.largest == 0.0));
        let mut wrong = expected.clone();
        let force = wrong
            .iter_mut()
            .find(|kernel| kernel.name == "force")
            .expect("there is a force");
        let last = force.outputs[0].nodes.len() - 1;
        force.outputs[0].nodes[last] = force.graph.neg(force.outputs[0].nodes[last]);
        let deviations =
            compare(&expected, &wrong, 8, States::All, 1).expect("they compute the same things");
        let force = deviations
            .iter()
            .find(|deviation| deviation.kernel == "force")
            .expect("there is a force");
        assert!(force.largest > 0.01);
    }

    #[test]
    fn other_kernels_are_refused() {
        let (one, two) = (whole(1, Purpose::Computing), whole(2, Purpose::Computing));
        let kernels = kernels().expect("the derivation is sound");
        let refused = |found: &[Kernel], start: &str| {
            let error = compare(&one, found, 1, States::All, 1).expect_err("they differ");
            assert!(error.starts_with(start), "{error}");
        };
        refused(&two, "kernel `mass_matrix`: input ");
        refused(
            &kernels,
            "kernel 1 is `segment`, but should be `mass_matrix`",
        );
        assert_eq!(
            (whole_chain(&two), whole_chain(&kernels)),
            (Some((2, Motion::Spatial)), None)
        );
        let planar =
            whole_kernels(2, Motion::Planar, Purpose::Computing).expect("the derivation is sound");
        assert_eq!(whole_chain(&planar), Some((2, Motion::Planar)));
    }

    #[test]
    fn an_argument_that_stands_for_another_is_found() {
        let expected = kernels().expect("the derivation is sound");
        let mut wrong = expected.clone();
        let angles = &mut wrong[0].inputs[0].elements;
        assert_eq!(
            (angles[0].0.as_str(), angles[1].0.as_str()),
            ("sin_phi", "cos_phi")
        );
        let sine = angles[0].1;
        angles[0].1 = angles[1].1;
        angles[1].1 = sine;
        assert_eq!(check_signatures(&expected, &wrong), Ok(()));
        let error = compare(&expected, &wrong, 1, States::All, 1);
        assert_eq!(
            error,
            Err(
                "kernel `segment`: the argument `sin_phi` stands for another quantity than in the model"
                    .to_owned()
            )
        );
    }

    /// Checks the joint angles of many states.
    #[test]
    fn joints_are_straight_slightly_and_strongly_bent_and_never_near_the_fold() {
        let kernels = kernels().expect("the derivation is sound");
        let mut kernels = kernels.iter();
        let kernel = kernels.find(|kernel| kernel.name == "joint");
        let kernel = kernel.expect("it is derived");
        let symbols = kernel.graph.symbols();
        let mut rng = Rng::with_seed(4);
        let expected = [[0.0, 1e-7], [1e-6, 0.08], [1e-6, 0.5], [1e-6, 1.8]];
        for (bend, [least, most]) in BENDS.into_iter().zip(expected) {
            for _ in 0..1000 {
                let point = random_point(kernel, bend, &mut rng);
                let at = |name: &str| {
                    let symbol = symbols.iter().position(|symbol| symbol.name == name);
                    point[symbol.expect("it is a symbol of the kernel")]
                };
                let inner = direction([at("phi_previous"), at("theta_previous")]);
                let azimuth = at("theta_next") - at("relaxed_angle");
                let outer = direction([at("phi_next"), azimuth]);
                let cosine: f64 = inner.iter().zip(outer).map(|(a, b)| a * b).sum();
                let angle = cosine.min(1.0).acos();
                assert!(
                    (least..=most).contains(&angle) || angle < 1e-6 && least < 1e-5,
                    "{bend:?}: {angle}"
                );
                assert!(at("phi_next").sin() > 0.3);
            }
        }
    }

    #[test]
    fn one_without_a_value_is_infinitely_wrong() {
        let expected = whole(1, Purpose::Computing);
        let mut wrong = expected.clone();
        let graph = &mut wrong[0].graph;
        let minus_one = graph.integer(-1);
        let nothing = graph.sqrt(minus_one);
        wrong[0].outputs[0].nodes[0] = nothing;
        let deviations =
            compare(&expected, &wrong, 1, States::All, 1).expect("they compute the same things");
        assert_eq!(deviations[0].largest, f64::INFINITY);
    }

    #[test]
    fn one_that_vanishes_everywhere_is_measured_absolutely() {
        let mut kernel = whole(1, Purpose::Computing).swap_remove(2);
        kernel.outputs.truncate(1);
        let mut rounded = kernel.clone();
        for (kernel, value) in [(&mut kernel, 0.0), (&mut rounded, 1e-17)] {
            kernel.outputs[0].nodes[0] = kernel.graph.constant(Constant::Float(value));
        }
        let deviations = compare(&[kernel], &[rounded], 2, States::All, 1)
            .expect("they compute the same things");
        assert_eq!(deviations[0].largest, 1e-17);
    }

    #[test]
    fn a_straight_state_is_straight_to_the_last_bit() {
        for motion in [Motion::Spatial, Motion::Planar] {
            let kernel =
                &whole_kernels(3, motion, Purpose::Computing).expect("the derivation is sound")[2];
            let point = random_point(kernel, BENDS[0], &mut Rng::with_seed(2));
            let values = kernel.graph.evaluate(&point);
            assert_eq!(kernel.outputs[1].name, "spring");
            assert_eq!(
                values[kernel.outputs[1].nodes[0].index()],
                0.0,
                "{motion:?}"
            );
        }
    }
}
