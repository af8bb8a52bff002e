//! Does the reader understand valid files of graphs and refuse invalid ones? The target `graph` of
//! `fuzz/` has damaged files.

mod faults;
mod schema;

use bristle_codegen::back::json::{self, from_json, to_json};
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::graph::{Graph, Node};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use serde_json::{Value, json};

const EXAMPLE: &str = include_str!("../../../../docs/graph-format.example.json");
const PAGE: &str = include_str!("../../../../docs/library.md");
const OPERATORS: &str = include_str!("../../../../derivations/graphs/operators.json");

fn origin(maker: &str) -> Origin<'_> {
    Origin {
        title: "A test.",
        maker,
        again: "cargo test",
    }
}

fn example() -> Value {
    serde_json::from_str(EXAMPLE).expect("the example is JSON")
}

/// Returns the example with some values changed.
fn changed(changes: &[(&str, Value)]) -> String {
    let mut file = example();
    for (place, value) in changes {
        *file
            .pointer_mut(place)
            .unwrap_or_else(|| panic!("the example has {place}")) = value.clone();
    }
    file.to_string()
}

fn refused(text: &str) -> String {
    from_json(text).expect_err("the file is wrong")
}

/// The message with which a file is refused; checks that it has this part.
#[track_caller]
fn refused_with(text: &str, part: &str) -> String {
    let message = refused(text);
    assert!(message.contains(part), "no `{part}` in {message}");
    message
}

/// Kernels of the engine, and functions that only user-defined energies need.
fn derived() -> Vec<Vec<Kernel>> {
    let mut derived = vec![kernels().expect("the derivation is sound")];
    for motion in [Motion::Spatial, Motion::Planar] {
        let whole = |segments| {
            whole_kernels(segments, motion, Purpose::Computing).expect("the derivation is sound")
        };
        derived.extend([1, 2, 3, 5].map(whole));
    }
    derived.push(from_json(OPERATORS).expect("it is valid").kernels);
    derived
}

fn written(kernels: &[Kernel]) -> String {
    to_json(kernels, "a test").expect("the kernels can be written")
}

/// The values of a kernel's outputs. The value of every symbol follows from its name.
fn values(kernel: &Kernel) -> Vec<f64> {
    let value = |name: &str| {
        0.3 + 0.1
            * (name
                .bytes()
                .fold(0.0, |sum, byte| 1.7 * sum + f64::from(byte))
                % 7.0)
    };
    let point: Vec<f64> = kernel
        .graph
        .symbols()
        .iter()
        .map(|symbol| value(&symbol.name))
        .collect();
    let values = kernel.graph.evaluate(&point);
    kernel
        .outputs
        .iter()
        .flat_map(|output| &output.nodes)
        .map(|node| values[node.index()])
        .collect()
}

#[test]
fn what_is_written_is_read_with_its_values_and_written_again_with_its_bytes() {
    for set in derived() {
        let text = written(&set);
        let file = from_json(&text).expect("what is written can be read");
        assert_eq!(file.generator, "a test");
        assert_eq!(written(&file.kernels), text);
        let fingerprint =
            |kernels: &[Kernel]| json::fingerprint(kernels).expect("they were written before");
        assert_eq!(fingerprint(&file.kernels), fingerprint(&set));
        for (read, original) in file.kernels.iter().zip(&set) {
            assert_eq!(read.graph.validate(), Ok(()));
            assert_eq!(values(read), values(original), "{}", read.name);
        }
        let source = |kernels: &[Kernel]| {
            emit(kernels, origin("a test")).expect("the kernels can be emitted")
        };
        // A file has neither groups of arguments nor names of intermediates.
        let bare: Vec<Kernel> = set.into_iter().map(bare).collect();
        assert_eq!(source(&file.kernels), source(&bare));
    }
}

/// Returns a kernel without groups of arguments and names of intermediates.
fn bare(mut kernel: Kernel) -> Kernel {
    let mut graph = Graph::raw();
    let mut copies = Vec::new();
    for id in kernel.graph.ids() {
        let copy = match kernel.graph.node(id) {
            Node::Symbol(symbol) => {
                let symbol = &kernel.graph.symbols()[symbol.index()];
                graph.symbol(&symbol.name, &symbol.notation, symbol.unit)
            }
            node => graph.intern(node.map(|operand| copies[operand.index()])),
        };
        copies.push(copy);
    }
    for input in &mut kernel.inputs {
        input.place = None;
    }
    assert_eq!(copies, kernel.graph.ids().collect::<Vec<_>>());
    Kernel { graph, ..kernel }
}

#[test]
fn the_example_of_the_page_is_read() {
    assert!(
        PAGE.contains(EXAMPLE),
        "the page shows docs/graph-format.example.json"
    );
    let file = from_json(EXAMPLE).expect("the example is right");
    let [kernel] = &file.kernels[..] else {
        panic!("it has one kernel")
    };
    let point = [std::f64::consts::FRAC_PI_6, 2.0, 9.81, 0.5, 2.0];
    let values = kernel.graph.evaluate(&point);
    let at = |output: usize, element: usize| values[kernel.outputs[output].nodes[element].index()];
    let expected = 9.81 * (1.0 - std::f64::consts::FRAC_PI_6.cos());
    // A few roundings of numbers of this size.
    for (value, expected) in [(at(0, 0), -9.81), (at(1, 0), 1.0), (at(1, 1), expected)] {
        assert!((value - expected).abs() < 1e-14, "{value} {expected}");
    }
    let source = emit(&file.kernels, origin(&file.generator)).expect("it can be emitted");
    assert!(
        source.contains("pub fn pendulum<T: Real>(state: [T; 2], gravity: T, length: T, mass: T)"),
        "{source}"
    );
}

/// Writes a file of one kernel with the input `x` and these operations after its symbol; the last
/// is the output.
fn file_of(operations: impl Iterator<Item = String>) -> String {
    let mut text = String::from(
        "{\"format\":\"bristle-graph\",\"version\":3,\"generator\":\"a test\",\"kernels\":[{\"name\":\"long\",\
         \"summary\":\"\",\"inputs\":[{\"name\":\"x\",\"doc\":\"\",\"elements\":[[\"x\",0]]}],\
         \"operations\":[[\"symbol\",\"x\",\"x\",\"1\"]",
    );
    let mut last = 0;
    for operation in operations {
        text.push(',');
        text.push_str(&operation);
        last += 1;
    }
    let output = format!(
        "{{\"name\":\"y\",\"doc\":\"\",\"unit\":\"1\",\"shape\":[],\"operations\":[{last}]}}"
    );
    text + "],\"outputs\":[" + &output + "]}]}"
}

fn on_a_small_stack(work: impl FnOnce() + Send + 'static) {
    let thread = std::thread::Builder::new()
        .stack_size(256 << 10)
        .spawn(work)
        .expect("a thread can be started");
    thread.join().expect("it does not panic");
}

#[test]
fn long_chains_need_no_stack() {
    let chain = |length: u32| file_of((0..length).map(|i| format!("[\"sin\",{i}]")));
    on_a_small_stack(move || {
        let file = from_json(&chain(json::MAX_DEPTH)).expect("the chain is within the limit");
        let kernel = &file.kernels[0];
        assert_eq!(kernel.graph.evaluate(&[1.0]).len(), 1_000_001);
        to_json(&file.kernels, "").expect("it can be written");

        assert_eq!(
            refused(&chain(json::MAX_DEPTH + 1)),
            "kernel `long`: operation 1000001 is nested deeper than 1000000 operations"
        );

        let file = from_json(&chain(10_000)).expect("it is shorter");
        emit(&file.kernels, origin("a test")).expect("it can be emitted");
    });
}

#[test]
fn too_many_entries_are_refused() {
    let operations = file_of([vec!["[\"neg\",0]"; json::MAX_OPERATIONS].join(",")].into_iter());
    refused_with(&operations, "this list has at most 8000000 entries");

    let powers = json::MAX_OPERATIONS / json::MAX_EXPONENT as usize;
    let file = |count: usize| file_of((0..count).map(|i| format!("[\"powi\",{i},64]")));
    from_json(&file(powers)).expect("the powers are within the limit");
    assert_eq!(
        refused(&file(powers + 1)),
        format!(
            "kernel `long`: the powers up to operation {} take more than 8000000 multiplications",
            powers + 1
        )
    );

    for (place, most) in [
        ("/kernels", json::MAX_KERNELS),
        ("/kernels/0/inputs", json::MAX_FIELDS),
        ("/kernels/0/outputs", json::MAX_FIELDS),
        ("/kernels/0/outputs/0/operations", json::MAX_ELEMENTS),
    ] {
        let mut file = example();
        let entry = file.pointer(place).expect("it is there")[0].clone();
        *file.pointer_mut(place).expect("it is there") = Value::Array(vec![entry; most + 1]);
        refused_with(
            &file.to_string(),
            &format!("this list has at most {most} entries"),
        );
    }
}

/// Texts that could end the comments that they become, or be taken for code.
#[test]
fn texts_stay_texts() {
    let place = "    statements!();";
    for text in [
        "*/ fn evil() {}",
        "\"] fn evil() {} #[doc = \"",
        "#![allow(x)]",
        "/ fn evil() {}",
        "{{}} \\",
        "statements!();",
    ] {
        let file = changed(&[
            ("/generator", json!(text)),
            ("/kernels/0/summary", json!(format!("{text}\n{text}"))),
            ("/kernels/0/inputs/0/doc", json!(text)),
            ("/kernels/0/outputs/0/doc", json!(text)),
        ]);
        let file = from_json(&file).expect("the texts can be shown");
        let source = emit(&file.kernels, origin(&file.generator)).expect("it can be emitted");
        let items = syn::parse_file(&source).expect("it is Rust").items;
        assert_eq!(items.len(), 2, "{source}");
        let code = |line: &&str| !line.trim_start().starts_with("//");
        assert!(
            !source
                .lines()
                .filter(code)
                .any(|line| line.contains("evil")),
            "{source}"
        );
    }
    // The reader refuses this one, but a kernel need not come from a file.
    let mut kernel = from_json(EXAMPLE).expect("it is right").kernels.remove(0);
    kernel.summary = place.into();
    let source = emit(&[kernel], origin("a test")).expect("it can be emitted");
    assert!(source.contains("let t0"), "{source}");
    assert!(!source.lines().any(|line| line == place), "{source}");
}

#[test]
fn the_zeroth_power_is_one() {
    let text = file_of(["[\"powi\",0,0]".to_string()].into_iter());
    let file = from_json(&text).expect("it is right");
    assert_eq!(values(&file.kernels[0]), [1.0]);
    let source = emit(&file.kernels, origin("a test")).expect("it can be emitted");
    assert!(source.contains("y: T::from_f64(1.0)"), "{source}");
}
