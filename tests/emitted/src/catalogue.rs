//! The expressions whose emission is tested: random ones, and a list with every operator.
//!
//! The build script emits them, and the tests compare the emitted code with this list.

use bristle_codegen::ir::graph::{Graph, Node, NodeId};
use bristle_codegen::ir::kernel::{Kernel, KernelInput, Output, OutputShape};
use bristle_codegen::ir::unit::Unit;
use bristle_codegen::passes::calculus::gradient;
use bristle_codegen::passes::normal_form::{Style, normalise};
use fastrand::Rng;

#[path = "expressions.rs"]
pub mod expressions;
use expressions::{Instruction, VARIABLES, build};

/// Number of random expressions that are emitted.
pub const RANDOM: usize = 300;
/// Seed of the random expressions.
const SEED: u64 = 7;

/// The forms in which each random expression is emitted.
pub const FORMS: [&str; 4] = ["raw", "simplified", "cheap", "collected"];

/// The first random expressions, each as a program.
pub fn programs(count: usize) -> Vec<Vec<Instruction>> {
    let mut rng = Rng::with_seed(SEED);
    (0..count)
        .map(|_| {
            (0..rng.usize(1..16))
                .map(|_| random_instruction(&mut rng))
                .collect()
        })
        .collect()
}

fn random_instruction(rng: &mut Rng) -> Instruction {
    let (a, b) = (rng.usize(0..64), rng.usize(0..64));
    match rng.usize(0..20) {
        0 => Instruction::Constant(rng.i64(-4..5), rng.i64(1..4)),
        1 => Instruction::Add(a, b),
        2 => Instruction::Sub(a, b),
        3 => Instruction::Mul(a, b),
        4 => Instruction::Div(a, b),
        5 => Instruction::Neg(a),
        6 => Instruction::Powi(a, rng.i32(0..4)),
        7 => Instruction::InversePower(a, rng.i32(1..3)),
        8 => Instruction::Sqrt(a),
        9 => Instruction::Sin(a),
        10 => Instruction::Cos(a),
        11 => Instruction::Asin(a),
        12 => Instruction::LessThan(a, b),
        13 => Instruction::Exp(a),
        14 => Instruction::Ln(a),
        15 => Instruction::Tanh(a),
        16 => Instruction::Abs(a),
        17 => Instruction::Atan2(a, b),
        18 => Instruction::Pow(a, b),
        _ => Instruction::HalfAngleSquared(a),
    }
}

/// An operator with its known value and derivatives with respect to `a` and `b`.
pub struct Covered {
    /// Name of the expression.
    pub name: &'static str,
    /// The expression.
    pub build: fn(&mut Graph, NodeId, NodeId) -> NodeId,
    /// Its value.
    pub value: fn(f64, f64) -> f64,
    /// Its derivatives.
    pub slopes: fn(f64, f64) -> [f64; 2],
}

/// The angle whose `1 − cos` is `u`.
fn angle(u: f64) -> f64 {
    (1.0 - u).acos()
}

/// Every operator, for `a` and `b` between 0.1 and 0.9.
pub const COVERAGE: &[Covered] = &[
    Covered {
        name: "rational",
        build: |g, _, _| g.ratio(-2, 3),
        value: |_, _| -2.0 / 3.0,
        slopes: |_, _| [0.0, 0.0],
    },
    Covered {
        name: "float",
        build: |g, _, _| g.constant(bristle_codegen::ir::constant::Constant::Float(-0.1)),
        value: |_, _| -0.1,
        slopes: |_, _| [0.0, 0.0],
    },
    Covered {
        name: "symbol",
        build: |_, a, _| a,
        value: |a, _| a,
        slopes: |_, _| [1.0, 0.0],
    },
    Covered {
        name: "add",
        build: Graph::add,
        value: |a, b| a + b,
        slopes: |_, _| [1.0, 1.0],
    },
    Covered {
        name: "sub",
        build: Graph::sub,
        value: |a, b| a - b,
        slopes: |_, _| [1.0, -1.0],
    },
    Covered {
        name: "mul",
        build: Graph::mul,
        value: |a, b| a * b,
        slopes: |a, b| [b, a],
    },
    Covered {
        name: "div",
        build: Graph::div,
        value: |a, b| a / b,
        slopes: |a, b| [1.0 / b, -a / (b * b)],
    },
    Covered {
        name: "neg",
        build: |g, a, _| g.neg(a),
        value: |a, _| -a,
        slopes: |_, _| [-1.0, 0.0],
    },
    Covered {
        name: "square",
        build: |g, a, _| g.powi(a, 2),
        value: |a, _| a * a,
        slopes: |a, _| [2.0 * a, 0.0],
    },
    Covered {
        name: "inverse_cube",
        build: |g, _, b| g.powi(b, -3),
        value: |_, b| 1.0 / (b * b * b),
        slopes: |_, b| [0.0, -3.0 / b.powi(4)],
    },
    Covered {
        name: "sqrt",
        build: |g, a, _| g.sqrt(a),
        value: |a, _| a.sqrt(),
        slopes: |a, _| [0.5 / a.sqrt(), 0.0],
    },
    Covered {
        name: "sin",
        build: |g, a, _| g.sin(a),
        value: |a, _| a.sin(),
        slopes: |a, _| [a.cos(), 0.0],
    },
    Covered {
        name: "cos",
        build: |g, _, b| g.cos(b),
        value: |_, b| b.cos(),
        slopes: |_, b| [0.0, -b.sin()],
    },
    Covered {
        name: "asin",
        build: |g, a, _| g.asin(a),
        value: |a, _| a.asin(),
        slopes: |a, _| [1.0 / (1.0 - a * a).sqrt(), 0.0],
    },
    Covered {
        name: "exp",
        build: |g, a, _| g.exp(a),
        value: |a, _| a.exp(),
        slopes: |a, _| [a.exp(), 0.0],
    },
    Covered {
        name: "ln",
        build: |g, _, b| g.ln(b),
        value: |_, b| b.ln(),
        slopes: |_, b| [0.0, 1.0 / b],
    },
    Covered {
        name: "tanh",
        build: |g, a, _| g.tanh(a),
        value: |a, _| a.tanh(),
        slopes: |a, _| [1.0 / a.cosh().powi(2), 0.0],
    },
    Covered {
        name: "abs",
        build: |g, a, b| {
            let difference = g.sub(a, b);
            g.abs(difference)
        },
        value: |a, b| (a - b).abs(),
        slopes: |a, b| [(a - b).signum(), (b - a).signum()],
    },
    Covered {
        name: "atan2",
        build: |g, a, b| {
            let negative = g.neg(b);
            g.atan2(a, negative)
        },
        value: |a, b| std::f64::consts::PI - (a / b).atan(),
        slopes: |a, b| [-b / (a * a + b * b), a / (a * a + b * b)],
    },
    Covered {
        name: "pow",
        build: Graph::pow,
        value: |a, b| (b * a.ln()).exp(),
        slopes: |a, b| {
            let power = (b * a.ln()).exp();
            [b * power / a, power * a.ln()]
        },
    },
    Covered {
        name: "less_than",
        build: Graph::less_than,
        value: |a, b| if a < b { 1.0 } else { 0.0 },
        slopes: |_, _| [0.0, 0.0],
    },
    Covered {
        name: "half_angle_squared",
        build: |g, a, _| g.half_angle_squared(a),
        value: |a, _| 0.5 * angle(a).powi(2),
        slopes: |a, _| [angle(a) / angle(a).sin(), 0.0],
    },
    Covered {
        name: "its_slope",
        build: |g, a, _| g.make(Node::HalfAngleSquared(1, a)),
        value: |a, _| angle(a) / angle(a).sin(),
        slopes: |a, _| {
            let angle = angle(a);
            [
                (angle.sin() - angle * angle.cos()) / angle.sin().powi(3),
                0.0,
            ]
        },
    },
    Covered {
        name: "its_curvature",
        build: |g, a, _| g.make(Node::HalfAngleSquared(2, a)),
        value: |a, _| (angle(a).sin() - angle(a) * angle(a).cos()) / angle(a).sin().powi(3),
        slopes: |a, _| {
            let (angle, sin, cos) = (angle(a), angle(a).sin(), angle(a).cos());
            [
                (angle * sin * sin - 3.0 * cos * (sin - angle * cos)) / sin.powi(5),
                0.0,
            ]
        },
    },
    // Operands that need brackets: a − (b − a), a / (b / a), −(a b)², (a − b)³.
    Covered {
        name: "nested_difference",
        build: |g, a, b| {
            let inner = g.sub(b, a);
            g.sub(a, inner)
        },
        value: |a, b| 2.0 * a - b,
        slopes: |_, _| [2.0, -1.0],
    },
    Covered {
        name: "nested_quotient",
        build: |g, a, b| {
            let inner = g.div(b, a);
            g.div(a, inner)
        },
        value: |a, b| a * a / b,
        slopes: |a, b| [2.0 * a / b, -a * a / (b * b)],
    },
    Covered {
        name: "negative_square",
        build: |g, a, b| {
            let product = g.mul(a, b);
            let square = g.powi(product, 2);
            g.neg(square)
        },
        value: |a, b| -(a * b).powi(2),
        slopes: |a, b| [-2.0 * a * b * b, -2.0 * a * a * b],
    },
    Covered {
        name: "cube_of_difference",
        build: |g, a, b| {
            let difference = g.sub(a, b);
            g.powi(difference, 3)
        },
        value: |a, b| (a - b).powi(3),
        slopes: |a, b| [3.0 * (a - b).powi(2), -3.0 * (a - b).powi(2)],
    },
];

/// The kind of an operation, counted from zero.
///
/// The match has no wildcard, so that a new operator must be entered here, and in [`KINDS`].
pub fn kind(node: Node) -> usize {
    match node {
        Node::Constant(_) => 0,
        Node::Symbol(_) => 1,
        Node::Add(..) => 2,
        Node::Sub(..) => 3,
        Node::Mul(..) => 4,
        Node::Div(..) => 5,
        Node::Neg(_) => 6,
        Node::Powi(..) => 7,
        Node::Sqrt(_) => 8,
        Node::Sin(_) => 9,
        Node::Cos(_) => 10,
        Node::Asin(_) => 11,
        Node::LessThan(..) => 12,
        Node::HalfAngleSquared(..) => 13,
        Node::Exp(_) => 14,
        Node::Ln(_) => 15,
        Node::Tanh(_) => 16,
        Node::Abs(_) => 17,
        Node::Atan2(..) => 18,
        Node::Pow(..) => 19,
    }
}

/// The number of kinds of operations.
pub const KINDS: usize = 20;

/// All emitted kernels: each random expression in all forms, then the list of operators.
pub fn kernels() -> Vec<Kernel> {
    let mut kernels = Vec::new();
    for (i, program) in programs(RANDOM).iter().enumerate() {
        for (form, (graph, node)) in FORMS.into_iter().zip(forms(program)) {
            kernels.push(kernel(
                format!("random_{i}_{form}"),
                graph,
                &VARIABLES.map(|(name, _)| name),
                vec![node],
            ));
        }
    }
    for covered in COVERAGE {
        let mut graph = Graph::raw();
        let (nodes, _) = covered_nodes(&mut graph, covered);
        kernels.push(kernel(
            format!("covered_{}", covered.name),
            graph,
            &["a", "b"],
            nodes,
        ));
    }
    kernels
}

/// Builds a random expression in each of [`FORMS`].
pub fn forms(program: &[Instruction]) -> [(Graph, NodeId); 4] {
    let mut raw = Graph::raw();
    let raw_result = build(&mut raw, program);
    let mut simplified = Graph::new();
    let result = build(&mut simplified, program);
    let symbols: Vec<NodeId> = ["x", "y"]
        .iter()
        .filter_map(|name| simplified.find_symbol(name))
        .collect();
    let [cheap, collected] = [Style::Cheap, Style::Collected(&symbols)].map(|style| {
        let normalised = normalise(&simplified, &[result], style);
        (normalised.graph, normalised.outputs[0])
    });
    [(raw, raw_result), (simplified, result), cheap, collected]
}

/// The value and the derivatives of an entry of [`COVERAGE`] in `graph`, and its variables.
pub fn covered_nodes(graph: &mut Graph, covered: &Covered) -> (Vec<NodeId>, [NodeId; 2]) {
    let variables = ["a", "b"].map(|name| graph.symbol(name, name, Unit::ONE));
    let value = (covered.build)(graph, variables[0], variables[1]);
    let slopes = gradient(graph, value, &variables);
    (vec![value, slopes[0], slopes[1]], variables)
}

fn kernel(name: String, graph: Graph, variables: &[&str], nodes: Vec<NodeId>) -> Kernel {
    let inputs = variables.iter().map(|&name| {
        let node = graph
            .find_symbol(name)
            .expect("it is a symbol of the graph");
        KernelInput::new(name, "a variable", vec![(name.into(), node)])
    });
    let shape = if nodes.len() == 1 {
        OutputShape::Scalar
    } else {
        OutputShape::Vector(nodes.len())
    };
    let output = Output {
        name: "value".into(),
        doc: "the value".into(),
        unit: Unit::ONE,
        shape,
        nodes,
    };
    let inputs = inputs.collect();
    Kernel {
        name,
        summary: "An expression.".into(),
        graph,
        inputs,
        outputs: vec![output],
    }
}
