//! Is it right? Each rule keeps the value, and the derivation has its known form. `tests/emitted`
//! compares random expressions.

use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::constant::Constant;
use bristle_codegen::ir::graph::{Graph, Node, NodeId};
use bristle_codegen::ir::kernel::{InputGroup, Kernel, KernelInput, Output, OutputShape};
use bristle_codegen::ir::simplify::RULES;
use bristle_codegen::ir::unit::Unit;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::lagrange::whole_equations;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::normal_form::{Style, normalise};

/// Applies each rule to operations in its domain, at random values.
#[test]
fn every_rule_fires_and_keeps_the_value() {
    let mut rng = fastrand::Rng::with_seed(3);
    // Both signs occur; negative powers are undefined at zero.
    let mut coordinate = || (0.2 + 2.0 * rng.f64()) * if rng.bool() { 1.0 } else { -1.0 };
    let points: Vec<[f64; 2]> = (0..100).map(|_| [coordinate(), coordinate()]).collect();
    for rule in RULES {
        let mut fired = 0;
        let mut graph = Graph::raw();
        let (x, y) = (
            graph.symbol("x", "x", Unit::ONE),
            graph.symbol("y", "y", Unit::ONE),
        );
        let (two, three, zero, one) = (
            graph.integer(2),
            graph.integer(3),
            graph.integer(0),
            graph.integer(1),
        );
        let (minus_x, minus_two) = (graph.neg(x), graph.integer(-2));
        let difference = graph.sub(x, y);
        let (two_x, three_x) = (graph.mul(two, x), graph.mul(three, x));
        let (square, inverse) = (graph.powi(x, 2), graph.powi(x, -1));
        let (exp, ln, tanh) = (graph.exp(x), graph.ln(square), graph.tanh(x));
        let (abs, minus_two_x) = (graph.abs(x), graph.neg(two_x));
        let (half, third) = (graph.ratio(1, 2), graph.ratio(1, 3));
        let root = graph.pow(square, third);
        let candidates = [
            Node::Add(two, three),
            Node::Add(x, zero),
            Node::Sub(zero, x),
            Node::Sub(x, x),
            Node::Mul(one, x),
            Node::Mul(x, zero),
            Node::Div(x, two),
            Node::Powi(x, 1),
            Node::Powi(square, 3),
            Node::Neg(minus_x),
            Node::Neg(difference),
            Node::Mul(minus_x, y),
            Node::Add(y, minus_x),
            Node::Powi(minus_x, 3),
            Node::Mul(x, two),
            Node::Mul(two_x, y),
            Node::Neg(two_x),
            Node::Add(two_x, three_x),
            Node::Sub(x, three_x),
            Node::Mul(square, x),
            Node::Sin(minus_x),
            Node::Cos(minus_x),
            Node::Add(y, x),
            Node::Mul(y, x),
            Node::Asin(minus_x),
            Node::LessThan(two, three),
            Node::Sub(x, minus_x),
            Node::Div(minus_x, y),
            Node::Div(zero, x),
            Node::Powi(x, 0),
            Node::Mul(two_x, three_x),
            Node::Mul(square, inverse),
            Node::Sin(zero),
            Node::Cos(zero),
            Node::Asin(zero),
            Node::Exp(zero),
            Node::Ln(one),
            Node::Tanh(zero),
            Node::Abs(minus_two),
            Node::Pow(one, x),
            Node::Atan2(zero, two),
            Node::Atan2(zero, minus_two),
            Node::Tanh(minus_x),
            Node::Abs(minus_x),
            Node::Atan2(minus_x, y),
            Node::Abs(abs),
            Node::Abs(two_x),
            Node::Abs(minus_two_x),
            Node::Powi(abs, 4),
            Node::Powi(abs, 3),
            Node::Ln(exp),
            Node::Exp(ln),
            Node::Exp(tanh),
            Node::Pow(square, three),
            Node::Pow(square, half),
            Node::Pow(square, x),
            Node::Pow(root, x),
            Node::Pow(root, three),
            Node::Powi(root, 2),
        ];
        for candidate in candidates {
            let expected = graph.intern(candidate);
            if let Some(result) = (rule.apply)(&mut graph, candidate) {
                fired += 1;
                for point in &points {
                    let values = graph.evaluate(point);
                    let (expected, result) = (values[expected.index()], values[result.index()]);
                    // NaN on both sides: the argument is outside the domain of the operation
                    // itself.
                    let both_nan = expected.is_nan() && result.is_nan();
                    let same = both_nan || (expected - result).abs() <= 1e-14 * expected.abs();
                    assert!(
                        same,
                        "{} on {candidate:?} at {point:?}: {expected} {result}",
                        rule.name
                    );
                }
            }
        }
        assert!(fired > 0, "{} never applies", rule.name);
    }
}

#[test]
fn trigonometric_identities_are_found() {
    let mut graph = Graph::new();
    let (x, y) = (
        graph.symbol("x", "x", Unit::ONE),
        graph.symbol("y", "y", Unit::ONE),
    );
    let [sin_x, sin_y] = [x, y].map(|angle| graph.sin(angle));
    let [cos_x, cos_y] = [x, y].map(|angle| graph.cos(angle));
    let one = graph.dot(&[sin_x, cos_x], &[sin_x, cos_x]);
    let cosine = graph.dot(&[cos_x, sin_x], &[cos_y, sin_y]);
    let products = [graph.mul(sin_x, cos_y), graph.mul(cos_x, sin_y)];
    let sine = graph.sub(products[0], products[1]);
    let normalised = normalise(&graph, &[one, cosine, sine], Style::Cheap);
    let [one, cosine, sine] = normalised.outputs[..] else {
        panic!("three outputs")
    };
    assert_eq!(normalised.graph.as_constant(one), Some(Constant::from(1)));
    assert!(matches!(normalised.graph.node(cosine), Node::Cos(_)));
    assert!(matches!(normalised.graph.node(sine), Node::Sin(_)));
}

#[test]
fn derived_graphs_keep_their_invariants() {
    for (segments, motion) in [1, 2, 7]
        .into_iter()
        .flat_map(|segments| MOTIONS.map(|motion| (segments, motion)))
    {
        let whole = whole_equations(segments, motion);
        assert_eq!(whole.graph.validate(), Ok(()));
        for (i, row) in whole.mass_matrix.iter().enumerate() {
            for (j, &entry) in row.iter().enumerate() {
                let values = whole
                    .graph
                    .evaluate(&vec![0.6; whole.graph.symbols().len()]);
                let mirrored = whole.mass_matrix[j][i];
                assert!((values[entry.index()] - values[mirrored.index()]).abs() < 1e-14);
            }
        }
        for kernel in
            whole_kernels(segments, motion, Purpose::Reading).expect("the derivation is sound")
        {
            assert_eq!(kernel.graph.validate(), Ok(()));
        }
    }
    for kernel in kernels().expect("the derivation is sound") {
        assert_eq!(kernel.graph.validate(), Ok(()), "{}", kernel.name);
    }
}

const MOTIONS: [Motion; 2] = [Motion::Spatial, Motion::Planar];

#[test]
fn readable_form_has_the_values_of_the_compact_one() {
    let pairs = MOTIONS.into_iter().flat_map(|motion| {
        let [compact, readable] = [Purpose::Computing, Purpose::Reading]
            .map(|purpose| whole_kernels(3, motion, purpose).expect("the derivation is sound"));
        compact.into_iter().zip(readable)
    });
    for (compact, readable) in pairs {
        let symbols = compact.graph.symbols().len();
        let point: Vec<f64> = (0..symbols)
            .map(|i| 0.4 + 0.37 * (i as f64 * 1.7).sin())
            .collect();
        let values = [&compact, &readable].map(|kernel| kernel.graph.evaluate(&point));
        for (expected, result) in compact.outputs.iter().zip(&readable.outputs) {
            for (expected, result) in expected.nodes.iter().zip(&result.nodes) {
                let (expected, result) = (values[0][expected.index()], values[1][result.index()]);
                assert!(
                    (expected - result).abs() < 1e-12 * expected.abs().max(1.0),
                    "{expected} {result}"
                );
            }
        }
    }
}

fn kernel(graph: Graph, inputs: Vec<KernelInput>, node: NodeId) -> Kernel {
    let (name, doc, nodes) = ("value".into(), "the value".into(), vec![node]);
    let output = Output {
        name,
        doc,
        unit: Unit::ONE,
        shape: OutputShape::Scalar,
        nodes,
    };
    Kernel {
        name: "example".into(),
        summary: "An example.".into(),
        graph,
        inputs,
        outputs: vec![output],
    }
}

#[test]
fn multiples_of_a_sum_are_computed_once() {
    let mut graph = Graph::new();
    let g = &mut graph;
    let [a, b, c] = ["a", "b", "c"].map(|name| g.symbol(name, name, Unit::ONE));
    let quarter = g.ratio(1, 4);
    let product = g.mul(b, c);
    let part = g.mul(quarter, product);
    let sums = [g.add(a, b), g.add(a, part)];
    let difference = g.sub(a, part);
    // `−(a − b)` is `b − a`, which is as short.
    let cases = [
        (sums[0], [(1, 1), (-1, 1), (2, 1), (-3, 2)]),
        (sums[1], [(1, 1), (-1, 1), (2, 1), (-3, 2)]),
        (difference, [(2, 1), (-2, 1), (3, 2), (-3, 2)]),
    ];
    for (sum, factors) in cases {
        let multiples = factors.map(|(numerator, denominator)| {
            let factor = g.ratio(numerator, denominator);
            g.mul(factor, sum)
        });
        let normal = normalise(g, &multiples, Style::Cheap);
        let nodes = normal.graph.reachable(&normal.outputs).into_iter();
        let is_sum = |id: &NodeId| matches!(normal.graph.node(*id), Node::Add(..) | Node::Sub(..));
        assert_eq!(nodes.filter(is_sum).count(), 1);
    }
}

/// A kernel with these symbols as inputs.
fn kernel_of(graph: Graph, names: &[&str], node: NodeId) -> Kernel {
    let input = |name: &&str| KernelInput::symbols(&graph, name, "", &[name]);
    let inputs = names.iter().map(input).collect();
    kernel(graph, inputs, node)
}

const ORIGIN: Origin<'_> = Origin {
    title: "An example.",
    maker: "a test",
    again: "cargo test",
};

#[test]
fn emission_says_what_is_missing() {
    let mut graph = Graph::raw();
    let x = graph.symbol("x", "x", Unit::ONE);
    let unbound = kernel(graph, Vec::new(), x);
    let refused = |kernel: Kernel| emit(&[kernel], ORIGIN).expect_err("it cannot be emitted");
    assert_eq!(
        refused(unbound),
        "kernel `example` uses `x`, which is not one of its inputs"
    );

    let mut graph = Graph::raw();
    let infinite = graph.constant(Constant::Float(f64::INFINITY));
    assert_eq!(
        refused(kernel(graph, Vec::new(), infinite)),
        "kernel `example` holds the constant inf, which is not finite"
    );
}

#[test]
fn emission_keeps_precedence_and_constants() {
    let mut graph = Graph::raw();
    let [a, b, c] = ["a", "b", "c"].map(|name| graph.symbol(name, name, Unit::ONE));
    let inner = graph.sub(b, c);
    let difference = graph.sub(a, inner);
    let tiny = graph.constant(Constant::Float(-1.0 / 3.0));
    let scaled = graph.mul(tiny, difference);
    let source =
        emit(&[kernel_of(graph, &["a", "b", "c"], scaled)], ORIGIN).expect("it can be emitted");
    assert!(
        source.contains("T::from_f64(-0.3333333333333333) * (a - (b - c))"),
        "{source}"
    );
}

/// Two values that belong together.
static PAIR: InputGroup = InputGroup {
    name: "Pair",
    doc: "Two values.",
    fields: &[("first", "The first."), ("second", "The second.")],
};

/// Sums `names`, of which the last and the first are fields of one argument.
fn sum_of_pair(function: &str, names: [&str; 3], fields: [&'static str; 2]) -> Kernel {
    let mut graph = Graph::raw();
    let symbols = names.map(|name| graph.symbol(name, name, Unit::ONE));
    let sum = graph.sum(symbols);
    let mut kernel = kernel_of(graph, &names, sum);
    for (index, field) in [2, 0].into_iter().zip(fields) {
        let input = kernel.inputs[index].clone();
        kernel.inputs[index] = input.in_group(&PAIR, "pair", field);
    }
    Kernel {
        name: function.into(),
        ..kernel
    }
}

#[test]
fn inputs_of_a_group_are_one_argument() {
    let kernel = sum_of_pair("example", ["a", "b", "c"], ["first", "second"]);
    let source = emit(&[kernel], ORIGIN).expect("it can be emitted");
    for text in [
        "pub struct Pair<T>",
        "(pair: Pair<T>, b: T)",
        "let a = pair.second;",
        "let c = pair.first;",
    ] {
        assert!(source.contains(text), "{text}: {source}");
    }
    let twice = sum_of_pair("example", ["a", "b", "c"], ["first", "first"]);
    assert_eq!(
        emit(&[twice], ORIGIN).expect_err("a field is missing"),
        "argument `pair` of kernel `example` does not have each field of `Pair` once"
    );
}

#[test]
fn names_that_mean_something_else_are_refused() {
    let fields = ["first", "second"];
    let other = |name: &'static str| sum_of_pair("example", ["a", name, "c"], fields);
    let function = |name: &str| sum_of_pair(name, ["a", "b", "c"], fields);
    let mut two_outputs = function("example");
    two_outputs.outputs.push(two_outputs.outputs[0].clone());
    let mut graph = Graph::raw();
    let [a, b] = ["a", "b"].map(|name| graph.symbol(name, name, Unit::ONE));
    let sum = graph.add(a, b);
    let input =
        |name: &str, element: &str, node| KernelInput::new(name, "", vec![(element.into(), node)]);
    let crossed = kernel(graph, vec![input("b", "a", a), input("a", "b", b)], sum);
    for (kernels, message) in [
        (vec![other("a b")], "the element `a b` is no identifier"),
        (vec![other("φ")], "the element `φ` is no identifier"),
        (vec![other("fn")], "the element `fn` is reserved"),
        (vec![other("pair")], "the element `pair` is taken"),
        (vec![other("Pair")], "the element `Pair` is taken"),
        (vec![crossed], "is taken"),
        (
            vec![function("pair")],
            "the type of the result `Pair` is taken",
        ),
        (
            vec![function("real")],
            "the type of the result `Real` is reserved",
        ),
        (vec![function("f"), function("f")], "`F` is taken"),
        (vec![two_outputs], "the output `value` is taken"),
    ] {
        let error = emit(&kernels, ORIGIN).expect_err(message);
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn intermediates_have_names_of_the_model_and_hide_nothing() {
    let mut graph = Graph::raw();
    let [a, b] = ["t0", "twice"].map(|name| graph.symbol(name, name, Unit::ONE));
    let (sum, product, difference) = (graph.add(a, b), graph.mul(a, b), graph.sub(a, b));
    for (node, name) in [(sum, "total"), (product, "twice"), (difference, "let")] {
        graph.set_name(node, name);
    }
    let factors = [graph.mul(sum, sum), graph.mul(product, product)];
    let last = graph.mul(difference, difference);
    let node = graph.sum([factors[0], factors[1], last]);
    let source = emit(&[kernel_of(graph, &["t0", "twice"], node)], ORIGIN).expect("it is right");
    for line in [
        "let total = t0 + twice;",
        "let t1 = t0 * twice;",
        "let t2 = t0 - twice;",
        "value: total * total + t1 * t1 + t2 * t2",
    ] {
        assert!(source.contains(line), "{line}: {source}");
    }
}
