//! Is it right? In the plane of rotation, the planar equations are the spatial ones, and the
//! lateral variation is the derivative of the spatial ones out of the plane.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;

use bristle_codegen::ir::graph::{Graph, NodeId};
use bristle_codegen::ir::kernel::{Kernel, Output, Shape};
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::{planar_kernels, spatial_kernels};
use bristle_codegen::model::lagrange::{WholeEquations, whole_equations};
use fastrand::Rng;

/// Number of states at which each pair is compared.
const STATES: usize = 1000;

/// Of the largest element of an output: some thousand roundings.
const TOLERANCE: f64 = 1e-12;

/// The same for derivatives by differences: the error of a difference of fourth order with
/// [`STEP`], and of its roundings.
const DIFFERENCE_TOLERANCE: f64 = 1e-9;

/// Of the tilt by which the plane is left.
const STEP: f64 = 1e-3;

/// Values of symbols by name.
type State = BTreeMap<String, f64>;

/// Last words of the names of quantities that are positive.
const POSITIVE: [&str; 6] = [
    "length",
    "mass",
    "inertia",
    "stiffness",
    "damping",
    "weight",
];

/// Largest bend of a joint in rad, of the states drawn in turn: straight, in the series of `S`, and
/// beyond it.
const BENDS: [f64; 4] = [0.0, 0.05, 0.3, 1.5];

/// Largest relaxed angle of a joint in rad.
const RELAXED: f64 = 0.3;

/// A planar state for all symbols of `graphs`, with all quantities of order one.
fn planar_state<'a>(
    graphs: impl IntoIterator<Item = &'a Graph>,
    number: usize,
    rng: &mut Rng,
) -> State {
    let names = graphs
        .into_iter()
        .flat_map(|graph| graph.symbols().iter().map(|symbol| symbol.name.clone()));
    let mut symmetric = |size: f64| size * (2.0 * rng.f64() - 1.0);
    let (mut azimuth, clamp_rate) = (symmetric(3.0), symmetric(2.0));
    let (sine, cosine) = azimuth.sin_cos();
    let (relaxed_sine, relaxed_cosine) = (azimuth + symmetric(RELAXED)).sin_cos();
    let clamp = BTreeMap::from([
        ("clamp_direction_x", cosine),
        ("clamp_direction_y", sine),
        ("clamp_direction_rate_x", -clamp_rate * sine),
        ("clamp_direction_rate_y", clamp_rate * cosine),
        ("relaxed_direction_x", relaxed_cosine),
        ("relaxed_direction_y", relaxed_sine),
        ("relaxed_direction_rate_x", -clamp_rate * relaxed_sine),
        ("relaxed_direction_rate_y", clamp_rate * relaxed_cosine),
    ]);
    let mut value = |name: &str| {
        if let Some(&component) = clamp.get(name) {
            component
        } else if name.starts_with("relaxed_angle") {
            symmetric(RELAXED)
        } else if name == "angular_velocity_z" {
            symmetric(2.0)
        } else if name.starts_with("angular_velocity")
            || name.ends_with("_z")
            || name.starts_with("phi_rate")
            || name == "phi_acceleration"
        {
            0.0
        } else if name.starts_with("phi_variation") {
            symmetric(2.0)
        } else if name.starts_with("phi") {
            FRAC_PI_2
        } else if name.starts_with("theta")
            && !name.contains("rate")
            && !name.contains("acceleration")
        {
            azimuth += symmetric(BENDS[number % BENDS.len()]);
            azimuth
        } else if POSITIVE.iter().any(|word| name.ends_with(word)) {
            1.25 + symmetric(0.75)
        } else {
            symmetric(2.0)
        }
    };
    let names: BTreeSet<String> = names.collect();
    names
        .into_iter()
        .map(|name| (name.clone(), value(&name)))
        .collect()
}

/// The values of all nodes of `graph`.
fn evaluate(graph: &Graph, state: &State) -> Vec<f64> {
    let point: Vec<f64> = graph
        .symbols()
        .iter()
        .map(|symbol| state[&symbol.name])
        .collect();
    graph.evaluate(&point)
}

/// The output of this name.
fn output<'k>(kernel: &'k Kernel, name: &str) -> &'k Output {
    kernel
        .outputs
        .iter()
        .find(|output| output.name == name)
        .expect("it is an output")
}

/// The values of an output by rows: of a vector one row per element, of a number one row.
fn rows(output: &Output, values: &[f64]) -> Vec<Vec<f64>> {
    let columns = match output.shape {
        Shape::Matrix(_, columns) => columns,
        Shape::Scalar | Shape::Vector(_) => 1,
    };
    let values: Vec<f64> = output
        .nodes
        .iter()
        .map(|node| values[node.index()])
        .collect();
    values.chunks(columns).map(<[f64]>::to_vec).collect()
}

fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values
        .into_iter()
        .fold(0.0, |largest, value| value.abs().max(largest))
}

/// Asserts that `found` is `expected` within `tolerance` of `size`.
#[track_caller]
fn assert_same(found: f64, expected: f64, tolerance: f64, size: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance * size,
        "{what}: {found} instead of {expected}"
    );
}

#[test]
fn the_planar_equations_are_the_spatial_ones_in_the_plane() {
    for segments in [1, 2, 3, 5] {
        let [spatial, planar] =
            [Motion::Spatial, Motion::Planar].map(|motion| whole_equations(segments, motion));
        let mut rng = Rng::with_seed(1);
        for number in 0..STATES {
            let state = planar_state([&spatial.graph, &planar.graph], number, &mut rng);
            let values = [&spatial, &planar].map(|whole| evaluate(&whole.graph, &state));
            let in_space = |node: NodeId| values[0][node.index()];
            let in_plane = |node: NodeId| values[1][node.index()];

            let matrix: Vec<Vec<f64>> = spatial
                .mass_matrix
                .iter()
                .map(|row| row.iter().map(|&node| in_space(node)).collect())
                .collect();
            let size = largest(matrix.iter().flatten());
            for (i, row) in planar.mass_matrix.iter().enumerate() {
                for (j, &node) in row.iter().enumerate() {
                    assert_same(
                        in_plane(node),
                        matrix[2 * i + 1][2 * j + 1],
                        TOLERANCE,
                        size,
                        "M_θθ",
                    );
                    assert_same(matrix[2 * i][2 * j + 1], 0.0, TOLERANCE, size, "M_φθ");
                }
            }
            let force: Vec<f64> = spatial.force.iter().map(|&node| in_space(node)).collect();
            let size = largest(&force).max(1.0);
            for (i, &node) in planar.force.iter().enumerate() {
                assert_same(in_plane(node), force[2 * i + 1], TOLERANCE, size, "f_θ");
                assert_same(force[2 * i], 0.0, TOLERANCE, size, "f_φ");
            }
            let scalars = |whole: &WholeEquations| {
                let [x, y, z] = whole.tip;
                [
                    whole.kinetic_energy,
                    whole.spring_energy,
                    whole.gravity_energy,
                    whole.dissipation,
                    x,
                    y,
                    z,
                ]
            };
            for (expected, found) in scalars(&spatial).into_iter().zip(scalars(&planar)) {
                let expected = in_space(expected);
                assert_same(
                    in_plane(found),
                    expected,
                    TOLERANCE,
                    expected.abs().max(1.0),
                    "energies and tip",
                );
            }
        }
    }
}

/// The kernels in space and in the plane, by name.
fn kernels() -> [BTreeMap<String, Kernel>; 2] {
    [spatial_kernels(), planar_kernels()].map(|kernels| {
        let kernels = kernels.expect("the derivation is sound").into_iter();
        kernels
            .map(|kernel| (kernel.name.clone(), kernel))
            .collect()
    })
}

/// Which rows or columns of a spatial output of this size belong to the plane: `θ` of `(φ, θ)`, `x`
/// and `y` of a vector.
fn in_plane(size: usize) -> &'static [usize] {
    match size {
        2 => &[1],
        3 => &[0, 1],
        _ => &[0],
    }
}

#[test]
fn the_planar_kernels_are_the_spatial_ones_in_the_plane() {
    let [spatial, planar] = kernels();
    let mut compared = 0;
    for (name, kernel) in planar
        .iter()
        .filter_map(|(name, kernel)| Some((name.strip_prefix("planar_")?, kernel)))
    {
        compared += 1;
        let full = &spatial[name];
        let mut rng = Rng::with_seed(2);
        for number in 0..STATES {
            let state = planar_state([&full.graph, &kernel.graph], number, &mut rng);
            let (full_values, values) = (
                evaluate(&full.graph, &state),
                evaluate(&kernel.graph, &state),
            );
            assert_eq!(full.outputs.len(), kernel.outputs.len());
            for (expected, found) in full.outputs.iter().zip(&kernel.outputs) {
                let what = format!("{name}.{}", found.name);
                assert_eq!(expected.name, found.name);
                let (expected, found) = (rows(expected, &full_values), rows(found, &values));
                let size = largest(expected.iter().flatten()).max(1.0);
                let (own_rows, own_columns) =
                    (in_plane(expected.len()), in_plane(expected[0].len()));
                assert_eq!(
                    (found.len(), found[0].len()),
                    (own_rows.len(), own_columns.len()),
                    "{what}"
                );
                for (row, values) in expected.iter().enumerate() {
                    for (column, &value) in values.iter().enumerate() {
                        let own = |own: &[usize], index| own.iter().position(|&own| own == index);
                        match (own(own_rows, row), own(own_columns, column)) {
                            (Some(row), Some(column)) => {
                                assert_same(found[row][column], value, TOLERANCE, size, &what);
                            }
                            // Both out of the plane: not part of the planar motion.
                            (None, None) => {}
                            // Nothing in the plane moves out of it, nor the other way.
                            _ => assert_same(value, 0.0, TOLERANCE, size, &what),
                        }
                    }
                }
            }
        }
    }
    assert_eq!(compared, 9);
}

/// The derivative of `f` at zero, by differences of fourth order.
fn slopes(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let [far_below, below, above, far_above] = [-2.0, -1.0, 1.0, 2.0].map(|steps| f(steps * STEP));
    let slope =
        |i: usize| (8.0 * (above[i] - below[i]) - (far_above[i] - far_below[i])) / (12.0 * STEP);
    (0..above.len()).map(slope).collect()
}

/// The state moved out of the plane by the tilt `size`: each polar angle and its rate by their
/// variations.
fn tilted(state: &State, size: f64) -> State {
    let mut state = state.clone();
    let variations: Vec<(String, f64)> = state
        .iter()
        .filter_map(|(name, &value)| Some((name.strip_prefix("phi_variation")?.to_owned(), value)))
        .collect();
    for (end, value) in variations {
        *state
            .get_mut(&format!("phi{end}"))
            .expect("the variation is that of a polar angle") += size * value;
    }
    state
}

#[test]
fn the_lateral_torques_are_the_slopes_of_the_spatial_ones() {
    let [spatial, planar] = kernels();
    for (name, tilt) in [("joint", 0.0), ("clamp", 1.0)] {
        let (full, kernel) = (&spatial[name], &planar[&format!("lateral_{name}")]);
        let mut rng = Rng::with_seed(3);
        for number in 0..STATES {
            let state = planar_state([&full.graph, &kernel.graph], number, &mut rng);
            let expected = slopes(|size| {
                let mut state = tilted(&state, size);
                for name in ["clamp_direction_z", "relaxed_direction_z"] {
                    state
                        .entry(name.into())
                        .and_modify(|height| *height = size * tilt);
                }
                let values = evaluate(&full.graph, &state);
                // Of the polar angles, which come first.
                full.outputs
                    .iter()
                    .map(|output| values[output.nodes[0].index()])
                    .collect()
            });
            let values = evaluate(&kernel.graph, &state);
            let size = largest(&expected).max(1.0);
            for (output, expected) in kernel.outputs.iter().zip(expected) {
                let found = values[output.nodes[0].index()];
                assert_same(
                    found,
                    expected,
                    DIFFERENCE_TOLERANCE,
                    size,
                    &format!("{name}.{}", output.name),
                );
            }
        }
    }
}

/// `τ_φ`, `p_z`, `z̈'`, `z' − z` and `ż' − ż` of a segment with the accelerations `φ̈` and `z̈`, by
/// the kernel `segment`.
fn segment_out_of_plane(
    kernel: &Kernel,
    state: &State,
    polar_acceleration: f64,
    height_acceleration: f64,
) -> Vec<f64> {
    let values = evaluate(&kernel.graph, state);
    let output = |name: &str| rows(output(kernel, name), &values);
    let base = [
        state["base_acceleration_x"],
        state["base_acceleration_y"],
        height_acceleration,
    ];
    let force = [
        state["outer_force_x"],
        state["outer_force_y"],
        state["outer_force_z"],
    ];
    let accelerations = [polar_acceleration, state["theta_acceleration"]];
    let [inertia, coupling, bias, base_bias] =
        ["inertia", "coupling", "bias", "base_bias"].map(output);
    let [reach, reach_rate, jacobian, reach_bias] =
        ["reach", "reach_rate", "reach_jacobian", "reach_bias"].map(output);
    let along = |row: &[f64]| row[0] * accelerations[0] + row[1] * accelerations[1];
    let torque = bias[0][0]
        + along(&inertia[0])
        + (0..3)
            .map(|i| coupling[i][0] * base[i] + jacobian[i][0] * force[i])
            .sum::<f64>();
    let base_force =
        state["segment_mass"] * base[2] + along(&coupling[2]) + base_bias[2][0] + force[2];
    let outer_acceleration = base[2] + along(&jacobian[2]) + reach_bias[2][0];
    vec![
        torque,
        base_force,
        outer_acceleration,
        reach[2][0],
        reach_rate[2][0],
    ]
}

#[test]
fn the_lateral_segment_is_the_slope_of_the_spatial_one() {
    let [spatial, planar] = kernels();
    let (full, tangent, kernel) = (
        &spatial["segment"],
        &spatial["segment_tangent"],
        &planar["lateral_segment"],
    );
    let mut rng = Rng::with_seed(4);
    for number in 0..STATES {
        let state = planar_state(
            [&full.graph, &tangent.graph, &kernel.graph],
            number,
            &mut rng,
        );
        let [polar_acceleration, height_acceleration, force_height] =
            [(); 3].map(|()| 4.0 * rng.f64() - 2.0);
        let expected = slopes(|size| {
            let mut state = tilted(&state, size);
            state.insert("outer_force_z".into(), size * force_height);
            segment_out_of_plane(
                full,
                &state,
                size * polar_acceleration,
                size * height_acceleration,
            )
        });
        let values = evaluate(&kernel.graph, &state);
        let output = |name: &str| values[output(kernel, name).nodes[0].index()];
        let found = [
            output("coupling") * height_acceleration
                + output("inertia") * polar_acceleration
                + output("bias")
                + output("reach_jacobian") * force_height,
            state["segment_mass"] * height_acceleration
                + output("coupling") * polar_acceleration
                + force_height,
            height_acceleration + output("reach_jacobian") * polar_acceleration,
            output("reach"),
            output("reach_rate"),
        ];
        let size = largest(&expected).max(1.0);
        for (found, expected) in found.into_iter().zip(expected) {
            assert_same(found, expected, DIFFERENCE_TOLERANCE, size, "segment");
        }
    }
}

#[test]
fn the_lateral_tangents_are_those_of_the_spatial_ones_out_of_the_plane() {
    let [spatial, planar] = kernels();
    for name in ["segment_tangent", "joint_tangent", "clamp_tangent"] {
        let (full, kernel) = (&spatial[name], &planar[&format!("lateral_{name}")]);
        let mut rng = Rng::with_seed(5);
        for number in 0..STATES {
            let state = planar_state([&full.graph, &kernel.graph], number, &mut rng);
            let (full_values, values) = (
                evaluate(&full.graph, &state),
                evaluate(&kernel.graph, &state),
            );
            for (expected, found) in full.outputs.iter().zip(&kernel.outputs) {
                assert_eq!(expected.name, found.name);
                let (expected, found) = (rows(expected, &full_values), rows(found, &values));
                let size = largest(expected.iter().flatten()).max(1.0);
                let out_of_plane = if expected.len() == 3 { 2 } else { 0 };
                assert_same(
                    found[0][0],
                    expected[out_of_plane][0],
                    TOLERANCE,
                    size,
                    name,
                );
            }
        }
    }
}
