//! A symbol may have any name: it is refused, or the function is right.

use std::collections::BTreeSet;

use bristle_codegen::ir::graph::Graph;
use bristle_codegen::ir::kernel::{Kernel, KernelInput, Output};
use bristle_codegen::ir::unit::Unit;
use bristle_equations::languages::SourceFile;
use fastrand::Rng;

use super::{FunctionSamples, TOLERANCE};

/// Random states: any shows a wrong variable.
const STATES: usize = 2;

/// The symbols besides the one under test.
const OTHERS: [&str; 2] = ["first", "second"];

/// A function with every operator, intermediates and both shapes of inputs and outputs, of a symbol
/// called `name`.
fn kernel(number: usize, name: &str) -> Kernel {
    let mut graph = Graph::raw();
    let g = &mut graph;
    let [a, b, c] = [name, OTHERS[0], OTHERS[1]].map(|name| g.symbol(name, name, Unit::ONE));
    let (product, sum) = (g.mul(a, b), g.add(a, c));
    let ratio = g.div(product, sum);
    let (sin, cos, asin) = (g.sin(ratio), g.cos(ratio), g.asin(ratio));
    let (power, less) = (g.powi(sum, -2), g.less_than(product, c));
    let root = g.sqrt(sum);
    let special = g.half_angle_squared(ratio);
    let total = g.sum([sin, cos, asin, power, less, root, special]);
    let product = g.mul(total, ratio);
    let negative = g.neg(product);
    let inputs = vec![
        KernelInput::symbols(&graph, name, "the symbol", &[name]),
        KernelInput::symbols(&graph, "others", "other symbols", &OTHERS),
    ];
    let outputs = vec![
        Output::vector("values", "values", Unit::ONE, vec![total, negative]),
        Output::scalar("value", "a value", Unit::ONE, special),
    ];
    Kernel {
        name: format!("function_{number}"),
        summary: "A function.".into(),
        graph,
        inputs,
        outputs,
    }
}

/// Functions of all accepted names: words in the code that `emit` writes, and names that
/// intermediates would have.
pub fn sample(emit: impl Fn(&[Kernel]) -> Result<Vec<SourceFile>, String>) -> FunctionSamples {
    let files = emit(&[kernel(0, "symbol")]).expect("the name is free");
    let is_of_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let is_code = |line: &&str| !["//", "# ", "%"].iter().any(|mark| line.starts_with(mark));
    let words: BTreeSet<&str> = files
        .iter()
        .flat_map(|file| file.text.lines().map(str::trim_start).filter(is_code))
        .flat_map(|line| line.split(|letter| !is_of_word(letter)))
        .collect();
    let accepted = |name: &&&str| emit(&[kernel(0, name)]).is_ok();
    let names: Vec<&str> = words.iter().filter(accepted).copied().collect();
    for name in ["t0", "t1", "t2", "values_0"] {
        assert!(names.contains(&name), "{name} is refused");
    }
    assert!(names.len() < words.len(), "no word is reserved");

    let kernels: Vec<Kernel> = (names.iter().enumerate())
        .map(|(number, name)| kernel(number, name))
        .collect();
    let mut rng = Rng::with_seed(23);
    let (mut states, mut values) = (Vec::new(), Vec::new());
    for _ in 0..STATES {
        let point = [0; 3].map(|_| 0.2 + 0.6 * rng.f64());
        // Each name has its column; the functions of other languages take the first.
        let repeated = vec![point[0]; names.len() - 1];
        states.push([&point[..], &repeated].concat());
        let at_point = kernels.iter().flat_map(|kernel| {
            let nodes = kernel.graph.evaluate(&point);
            kernel
                .output_nodes()
                .into_iter()
                .map(move |node| nodes[node.index()])
        });
        values.push(at_point.collect());
    }
    let symbols = [&names[..1], &OTHERS, &names[1..]].concat();
    FunctionSamples {
        name: "names".into(),
        symbols: symbols.into_iter().map(str::to_owned).collect(),
        kernels,
        tolerance: TOLERANCE,
        states,
        values,
    }
}
