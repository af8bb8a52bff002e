//! Is it right? The built-in derivation agrees with those of other engines, whose graphs are
//! committed.
//!
//! `derivations/README.md` says how the graphs were made and how to make them again.

use std::path::Path;

use bristle_codegen::back::json::{GraphFile, from_json};
use bristle_codegen::compare::{States, TOLERANCE, compare, whole_chain};
use bristle_codegen::ir::graph::Graph;
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::ir::unit::Unit;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::calculus::jacobian;

/// Number of states at which each pair of derivations is compared.
const STATES: usize = 1000;

fn committed(name: &str) -> GraphFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../derivations/graphs")
        .join(name);
    let text = std::fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    from_json(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Derives the whole equations of `segments` and `motion` by the built-in derivation.
///
/// The form is that for computing: the one for reading writes the chord of a joint through cosines,
/// which cancel.
fn built_in(segments: usize, motion: Motion) -> Vec<Kernel> {
    whole_kernels(segments, motion, Purpose::Computing).expect("the derivation is sound")
}

fn assert_agreement(expected: &[Kernel], name: &str) {
    let found = committed(name);
    let deviations = compare(expected, &found.kernels, STATES, States::All, 1)
        .expect("they compute the same things");
    for deviation in deviations {
        assert!(deviation.largest <= TOLERANCE, "{name}: {deviation:?}");
    }
}

#[test]
fn casadi_derives_the_same_whole_equations() {
    for (motion, end) in [(Motion::Spatial, ""), (Motion::Planar, "_planar")] {
        for segments in [1, 2, 3, 5] {
            let name = format!("chain_{segments}{end}.json");
            assert_eq!(
                whole_chain(&committed(&name).kernels),
                Some((segments, motion))
            );
            assert_agreement(&built_in(segments, motion), &name);
        }
    }
}

#[test]
fn casadi_derives_the_same_kernels_and_tangents() {
    assert_agreement(&kernels().expect("the derivation is sound"), "kernels.json");
}

#[test]
fn casadi_has_the_same_functions_and_gradients() {
    let kernel = &committed("operators.json").kernels[0];
    let mut graph = Graph::new();
    let g = &mut graph;
    let [a, b] = ["a", "b"].map(|name| g.symbol(name, name, Unit::ONE));
    let (difference, exponent) = (g.sub(a, b), g.ratio(5, 2));
    let values = [
        g.exp(a),
        g.ln(a),
        g.tanh(a),
        g.abs(difference),
        g.atan2(a, b),
        g.pow(a, b),
        g.pow(a, exponent),
    ];
    let gradients = jacobian(g, &values, &[a, b]).concat();
    let expected = [&values[..], &gradients].concat();
    let mut rng = fastrand::Rng::with_seed(4);
    for _ in 0..STATES {
        let point = [0; 2].map(|_| 0.1 + 2.0 * rng.f64());
        let values = [graph.evaluate(&point), kernel.graph.evaluate(&point)];
        for (&expected, found) in expected.iter().zip(kernel.output_nodes()) {
            let (expected, found) = (values[0][expected.index()], values[1][found.index()]);
            let difference = (expected - found).abs();
            assert!(
                difference <= TOLERANCE * expected.abs().max(1.0),
                "{point:?}: {expected} {found}"
            );
        }
    }
}
