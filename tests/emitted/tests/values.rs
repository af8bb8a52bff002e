//! Is it right? Emitted functions have the same values as the expressions that they come from.

use bristle_codegen::back::json::operators;
use bristle_codegen::ir::graph::Graph;
use bristle_emitted::catalogue::expressions::{VARIABLES, value};
use bristle_emitted::catalogue::{COVERAGE, FORMS, KINDS, covered_nodes, forms, kind, programs};
use bristle_emitted::emitted;
use fastrand::Rng;

/// Number of random expressions whose forms are all compared. The first ones are emitted, too.
const COMPARED: usize = 2000;

/// Points at which each expression is evaluated.
const POINTS: usize = 20;

/// An emitted function does the same operations as the evaluation of its graph. Only integer powers
/// differ, by one rounding each.
const EMITTED_TOLERANCE: f64 = 1e-13;

/// A simplified expression rounds differently, and its derivative with respect to an intermediate
/// can be as large as the largest intermediate; hence the square.
const SIMPLIFIED_TOLERANCE: f64 = 1e-12;

/// Largest intermediate of an expression that is compared.
const MAX_SCALE: f64 = 1e3;

#[test]
fn random_expressions_have_one_value_raw_simplified_and_emitted() {
    let mut rng = Rng::with_seed(11);
    let mut compared = 0;
    for (number, program) in programs(COMPARED).iter().enumerate() {
        let (graphs, functions) = (forms(program), emitted::RANDOM.get(number).copied());
        for (graph, _) in &graphs {
            assert_eq!(graph.validate(), Ok(()));
        }
        for _ in 0..POINTS {
            let point =
                VARIABLES.map(|(_, range)| range.start + rng.f64() * (range.end - range.start));
            let (expected, scale) = value(&graphs[0].0, graphs[0].1, &point);
            if scale > MAX_SCALE {
                continue;
            }
            compared += 1;
            for (i, (form, (graph, node))) in FORMS.iter().zip(&graphs).enumerate() {
                let (evaluated, largest) = value(graph, *node, &point);
                let error = (evaluated - expected).abs();
                assert!(
                    error <= SIMPLIFIED_TOLERANCE * scale.powi(2),
                    "{form} of {program:?} at {point:?}: {evaluated} {expected}"
                );
                if let Some(functions) = functions {
                    let emitted = functions[i](point);
                    let error = (emitted - evaluated).abs();
                    assert!(
                        error <= EMITTED_TOLERANCE * largest,
                        "{form} of {program:?} at {point:?}: {emitted} {evaluated}"
                    );
                }
            }
        }
    }
    assert!(
        compared > 9 * POINTS * COMPARED / 10,
        "only {compared} points were compared"
    );
}

#[test]
fn every_operator_and_its_derivative_are_emitted_right() {
    let mut rng = Rng::with_seed(12);
    for (covered, function) in COVERAGE.iter().zip(emitted::COVERED) {
        let mut graph = Graph::raw();
        let (nodes, _) = covered_nodes(&mut graph, covered);
        for _ in 0..POINTS {
            let [a, b] = [0; 2].map(|_| 0.1 + 0.8 * rng.f64());
            let [slope_a, slope_b] = (covered.slopes)(a, b);
            let expected = [(covered.value)(a, b), slope_a, slope_b];
            let values = graph.evaluate(&[a, b]);
            for ((expected, emitted), node) in expected.into_iter().zip(function(a, b)).zip(&nodes)
            {
                // The closed forms cancel for small angles.
                let tolerance = 1e-10 * expected.abs().max(1.0);
                assert!(
                    (emitted - expected).abs() < tolerance,
                    "{}: {emitted} {expected}",
                    covered.name
                );
                let evaluated = values[node.index()];
                assert!(
                    (emitted - evaluated).abs() <= EMITTED_TOLERANCE * expected.abs().max(1.0),
                    "{}",
                    covered.name
                );
            }
        }
    }
}

#[test]
fn the_list_has_every_operator() {
    let mut seen = [false; KINDS];
    for covered in COVERAGE {
        let mut graph = Graph::raw();
        let (nodes, _) = covered_nodes(&mut graph, covered);
        seen[kind(graph.node(nodes[0]))] = true;
    }
    assert_eq!(seen, [true; KINDS]);
    // Constants and symbols are not operators of the format.
    assert_eq!(KINDS, operators().count() + 2);
}
