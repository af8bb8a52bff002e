//! Does the reader understand valid files of graphs and refuse invalid ones? The target `graph` of
//! `fuzz/` has damaged files.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use bristle_codegen::back::json::{self, from_json, to_json};
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::graph::{Graph, Node};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use serde_json::{Value, json};

const EXAMPLE: &str = include_str!("../../../docs/graph-format.example.json");
const PAGE: &str = include_str!("../../../docs/library.md");
const OPERATORS: &str = include_str!("../../../derivations/graphs/operators.json");
const SCHEMA: &str = include_str!("../../../docs/graph-format.schema.json");

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

#[test]
fn files_of_another_kind_are_refused() {
    for (place, value, message) in [
        (
            "/format",
            json!("gltf"),
            "the format is `gltf`, not `bristle-graph`",
        ),
        (
            "/version",
            json!(1),
            "the version is 1; this program reads version 3: derive the graph again",
        ),
        (
            "/generator",
            json!("a\rb"),
            "`generator` holds the control character \\u{d}",
        ),
    ] {
        assert_eq!(refused(&changed(&[(place, value)])), message);
    }
    assert_eq!(
        refused(&changed(&[("/kernels", json!([]))])),
        "the file holds no kernel"
    );
    let large = " ".repeat(json::MAX_BYTES + 1);
    assert_eq!(
        refused(&large),
        format!(
            "the file has {} bytes; at most {} are read",
            large.len(),
            json::MAX_BYTES
        )
    );
    for (text, start) in [
        ("", "line 1, column 0, at `file`: EOF"),
        (
            "{\"format\":\"bristle-graph\",\n\"version\":",
            "line 2, column 10, at `",
        ),
    ] {
        let error = refused(text);
        assert!(error.starts_with(start), "{error}");
    }
}

/// Faults of form: each change, and a part of its message. The schema finds them too.
fn faults_of_form() -> Vec<(&'static str, Value, &'static str)> {
    let operation = "/kernels/0/operations/6";
    vec![
        ("", json!([]), "an object"),
        ("/generator", json!(3), "`generator`"),
        ("/generator", json!("a\u{7}b"), "control character"),
        ("/kernels/0", json!(["a", "", [], [], []]), "an object"),
        ("/kernels/0/name", json!("Pendulum"), "is not a valid name"),
        ("/kernels/0/name", json!("a__b"), "is not a valid name"),
        (
            "/kernels/0/name",
            json!("a".repeat(65)),
            "is not a valid name",
        ),
        (
            "/kernels/0/name",
            json!("pendulum\n"),
            "is not a valid name",
        ),
        ("/kernels/0/name", json!("real"), "is reserved"),
        (
            "/kernels/0/summary",
            json!("a\rb"),
            "the summary of the kernel holds the control character",
        ),
        (
            "/kernels/0/summary",
            json!("ä".repeat(4001)),
            "is longer than 4000 characters",
        ),
        (
            "/kernels/0/inputs/0",
            json!(["state", "", [["phi", 0]]]),
            "kernels[0].inputs[0]",
        ),
        (
            "/kernels/0/inputs/0/name",
            json!("t12"),
            "input `t12` is reserved",
        ),
        (
            "/kernels/0/inputs/0/doc",
            json!("a\nb"),
            "the text of input `state` holds",
        ),
        (
            "/kernels/0/inputs/0/elements",
            json!([]),
            "input `state` has no element",
        ),
        (
            "/kernels/0/inputs/0/elements/0",
            json!(["phi"]),
            "kernels[0].inputs[0].elements[0]",
        ),
        (
            "/kernels/0/inputs/0/elements/0",
            json!(["phi", 0, 1]),
            "elements",
        ),
        (
            "/kernels/0/inputs/0/elements/0/1",
            json!(-1),
            "integer `-1`",
        ),
        (
            "/kernels/0/outputs",
            json!([]),
            "the list of outputs has no element",
        ),
        (
            "/kernels/0/outputs/0/unit",
            json!("ft"),
            "`ft` is not a unit; units are products like `kg m^2`",
        ),
        ("/kernels/0/outputs/0/unit", json!("m^+2"), "is not a unit"),
        ("/kernels/0/outputs/0/unit", json!("m  s"), "is not a unit"),
        (
            "/kernels/0/outputs/0/shape",
            json!([1, 1, 1]),
            "at most 2 entries",
        ),
        (
            "/kernels/0/outputs/0/shape",
            json!([0]),
            "output `acceleration` has the shape [0] but 1 elements",
        ),
        (operation, json!("div"), "an operation, a list like"),
        (operation, json!([]), "an operation has a name"),
        (
            operation,
            json!(["tan", 0]),
            "unknown operator `tan`; known are symbol, rational, float, add",
        ),
        (
            operation,
            json!(["div", 2]),
            "kernels[0].operations[6]`: `div` takes 2 operands",
        ),
        (
            operation,
            json!(["div", 2, 3, 4]),
            "`div` has more entries than it takes",
        ),
        (operation, json!(["div", 2, 3.5]), "3.5"),
        (
            operation,
            json!(["powi", 2]),
            "`powi` takes 1 operand and an integer",
        ),
        (
            operation,
            json!(["powi", 2, 65]),
            "operation 6 (`powi`) has the parameter 65; it must be -64 to 64",
        ),
        (
            operation,
            json!(["powi", 2, i64::MIN]),
            "kernels[0].operations[6]",
        ),
        (
            operation,
            json!(["half_angle_squared", 0, 4]),
            "it must be 0 to 3",
        ),
        (
            operation,
            json!(["rational", 1, 0]),
            "`rational` takes a numerator and a positive denominator",
        ),
        (
            operation,
            json!(["rational", 1, -2]),
            "positive denominator",
        ),
        (
            operation,
            json!(["rational", i64::MIN, 1]),
            "`rational` takes",
        ),
        (
            operation,
            json!(["rational", u64::MAX, 1]),
            "kernels[0].operations[6]",
        ),
        (operation, json!(["float", "1"]), "kernels[0].operations[6]"),
        (
            operation,
            json!(["symbol", "x", "x"]),
            "`symbol` takes a name, a notation and a unit",
        ),
        (
            operation,
            json!(["symbol", "fn\0", "x", "1"]),
            "operation 6: symbol `fn\\u{0}` is not a valid name",
        ),
        (
            operation,
            json!(["symbol", "x", "a\u{1b}[2J", "1"]),
            "the notation of symbol `x` holds",
        ),
    ]
}

/// Faults of meaning, which only the reader finds.
fn faults_of_meaning() -> Vec<(Vec<(&'static str, Value)>, &'static str)> {
    let operation = "/kernels/0/operations/6";
    let doc = "/kernels/0/outputs/0/doc";
    let kernel = example()["kernels"][0].clone();
    let mut namesake = kernel.clone();
    namesake["name"] = json!("pendulum_1");
    let mut like_it = kernel.clone();
    like_it["name"] = json!("pendulum1");
    vec![
        (
            vec![("/kernels/0/name", json!("fn"))],
            "kernel `fn`: the name `fn` is reserved",
        ),
        (
            vec![("/kernels", json!([kernel, kernel]))],
            "kernel `pendulum`: the name `pendulum` is taken",
        ),
        (
            vec![("/kernels", json!([namesake, like_it]))],
            "gives its result the same type",
        ),
        (
            vec![(operation, json!(["div", 2, 6]))],
            "operation 6 (`div`) uses operation 6, which does not come before",
        ),
        (
            vec![(operation, json!(["neg", usize::MAX]))],
            "which does not come before it",
        ),
        (
            vec![(operation, json!(["symbol", "mass", "m", "kg"]))],
            "operation 6: the symbol `mass` is listed already",
        ),
        (
            vec![(operation, json!(["add", 2, 3]))],
            "`g` is m s⁻² and `h` is m: they cannot be combined in `g + h`",
        ),
        (
            vec![(operation, json!(["sin", 3]))],
            "`h` is m, but `sin h` is defined for numbers only",
        ),
        (
            vec![(operation, json!(["sqrt", 3]))],
            "has no dimension with whole exponents",
        ),
        (
            vec![("/kernels/0/outputs/0/unit", json!("N"))],
            "output `acceleration` is stated in N but is",
        ),
        (
            vec![("/kernels/0/outputs/1/shape", json!([2, 2]))],
            "output `energies` has the shape [2, 2] but 2 elements",
        ),
        (
            vec![("/kernels/0/outputs/1/shape", json!([usize::MAX, 2]))],
            "but 2 elements",
        ),
        (
            vec![("/kernels/0/outputs/1/operations/0", json!(20))],
            "output `energies` refers to operation 20",
        ),
        (
            vec![("/kernels/0/outputs/1/name", json!("acceleration"))],
            "output `acceleration` is taken",
        ),
        (
            vec![("/kernels/0/inputs/1/name", json!("state"))],
            "input `state` is taken by another input",
        ),
        (
            vec![("/kernels/0/inputs/1/name", json!("phi"))],
            "input `phi` is taken by another input or element",
        ),
        (
            vec![("/kernels/0/inputs/1/elements/0/0", json!("state"))],
            "element `state` is taken",
        ),
        (
            vec![("/kernels/0/inputs/1/elements/0/0", json!("phi"))],
            "element `phi` is taken",
        ),
        (
            vec![("/kernels/0/inputs/1/elements/0/1", json!(0))],
            "input `gravity` gives operation 0, which another",
        ),
        (
            vec![("/kernels/0/inputs/1/elements/0/1", json!(9))],
            "gives operation 9, which is a constant",
        ),
        (
            vec![("/kernels/0/inputs/1/elements/0/1", json!(20))],
            "but there are 20",
        ),
        (
            vec![("/kernels/0/inputs/1/elements/0/1", json!(5))],
            "an output needs the symbol `gravity`",
        ),
        (
            vec![(doc, json!("a\u{202e}b"))],
            "the text of output `acceleration` holds the control character \\u{202e}",
        ),
        (
            vec![(doc, json!("- ```"))],
            "which can start a block of code",
        ),
        (
            vec![(doc, json!("-     panic!()"))],
            "which can start a block of code",
        ),
        (vec![(doc, json!("<script>"))], "put a space after `<`"),
    ]
}

#[test]
fn faults_are_named_with_their_place() {
    for (place, value, expected) in faults_of_form() {
        let message = refused(&changed(&[(place, value)]));
        assert!(message.contains(expected), "{place}: {message}");
    }
    for (changes, expected) in faults_of_meaning() {
        let message = refused_with(&changed(&changes), expected);
        assert!(message.starts_with("kernel `"), "{message}");
    }
    for (place, field) in [
        ("", "kernels"),
        ("/kernels/0", "summary"),
        ("/kernels/0/outputs/0", "unit"),
    ] {
        let mut file = example();
        file.pointer_mut(place)
            .and_then(Value::as_object_mut)
            .expect("it is an object")
            .remove(field);
        refused_with(&file.to_string(), &format!("missing field `{field}`"));
        let mut file = example();
        file.pointer_mut(place).expect("it is there")["colour"] = json!(1);
        refused_with(&file.to_string(), "unknown field `colour`");
    }
    let twice = EXAMPLE.replacen("\"summary\":", "\"summary\":\"\",\"summary\":", 1);
    refused_with(&twice, "duplicate field `summary`");
    for number in ["1e999", "NaN", "Infinity", "-", "01", "1.", "0x1"] {
        let message = refused(&EXAMPLE.replacen("1.0", number, 1));
        assert!(message.starts_with("line 21, column"), "{message}");
    }
}

#[test]
fn messages_stay_short() {
    let long = format!("{}\n\u{1b}", "a".repeat(1 << 20));
    for place in [
        "/format",
        "/version",
        "/generator",
        "/kernels",
        "/kernels/0/name",
        "/kernels/0/operations/5/0",
    ] {
        let message = refused(&changed(&[(place, json!(long))]));
        assert!(
            message.chars().count() < 700 && !message.contains(char::is_control),
            "{place}: {message}"
        );
    }
    let key = EXAMPLE.replacen("\"summary\"", &format!("\"{}\"", "a".repeat(1 << 20)), 1);
    assert!(refused(&key).chars().count() < 700);
}

#[test]
fn deep_and_long_json_is_refused_in_time() {
    let start = Instant::now();
    let nested = format!("{}{}", "[".repeat(1 << 20), "]".repeat(1 << 20));
    let objects = "{\"a\":".repeat(1 << 20);
    let digits = "9".repeat(1 << 22);
    for (place, text) in [
        ("\"pendulum\"", &nested),
        ("[\"sin\",0]", &nested),
        ("1.0", &digits),
        ("2,", &objects),
    ] {
        refused(&EXAMPLE.replacen(place, text, 1));
    }
    refused(&nested);
    refused(&objects);
    // A fraction with this many digits is still a number.
    let fraction = EXAMPLE.replacen("1.0", &format!("0.{digits}"), 1);
    from_json(&fraction).expect("it is rounded");
    assert!(
        start.elapsed() < Duration::from_secs(20),
        "{:?}",
        start.elapsed()
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

fn schema() -> &'static jsonschema::Validator {
    static VALIDATOR: OnceLock<jsonschema::Validator> = OnceLock::new();
    VALIDATOR.get_or_init(|| {
        let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
        jsonschema::draft202012::new(&schema).expect("the schema is one")
    })
}

#[test]
fn the_schema_accepts_what_is_written_and_refuses_faults_of_form() {
    for text in derived()
        .iter()
        .map(|set| written(set))
        .chain([EXAMPLE.into()])
    {
        let file: Value = serde_json::from_str(&text).expect("it is JSON");
        if let Err(error) = schema().validate(&file) {
            panic!("{} at {}", error, error.instance_path());
        }
    }
    for (place, value, _) in faults_of_form() {
        let file: Value = serde_json::from_str(&changed(&[(place, value)])).expect("it is JSON");
        assert!(
            !schema().is_valid(&file),
            "{place}: {}",
            file.pointer(place).expect("it is there")
        );
    }
}

#[test]
fn schema_and_page_have_the_operators_of_the_reader() {
    let accepted = |operation: Value| {
        let mut file = example();
        file["kernels"][0]["operations"][19] = operation;
        schema().is_valid(&file)
    };
    let rows: Vec<&str> = PAGE
        .lines()
        .filter(|line| line.starts_with("| `") && line.matches('|').count() >= 6)
        .collect();
    assert_eq!(rows.len(), json::operators().count(), "{rows:?}");
    for (name, operands, parameter) in json::operators() {
        let least = parameter.map(|(least, _)| least);
        let operation = |operands: usize, parameter: Option<i32>| {
            let mut entries = vec![json!(name)];
            entries.extend(vec![json!(0); operands]);
            entries.extend(parameter.map(|parameter| json!(parameter)));
            Value::Array(entries)
        };
        assert!(accepted(operation(operands, least)), "{name}");
        assert!(!accepted(operation(operands - 1, least)), "{name}");
        assert!(!accepted(operation(operands + 1, least)), "{name}");
        let mut range = String::new();
        if let Some((least, most)) = parameter {
            assert!(accepted(operation(operands, Some(most))), "{name}");
            assert!(!accepted(operation(operands, Some(least - 1))), "{name}");
            assert!(!accepted(operation(operands, Some(most + 1))), "{name}");
            range = format!("{least} to {most} ").replace('-', "−");
        }
        let row = format!("| `{name}` | {operands} | {range}|");
        assert!(
            rows.iter().any(|line| line.starts_with(&row)),
            "the page has no row {row}"
        );
    }
    assert!(!accepted(json!(["tan", 0])));
}

#[test]
fn the_page_states_the_limits() {
    let spaced = |number: usize| {
        let digits = number.to_string();
        let groups: Vec<&str> = digits
            .as_bytes()
            .rchunks(3)
            .rev()
            .map(|group| std::str::from_utf8(group).expect("digits"))
            .collect();
        if number < 10_000 {
            digits.clone()
        } else {
            groups.join(" ")
        }
    };
    for (what, limit) in [
        ("bytes of a file", json::MAX_BYTES),
        ("kernels of a file", json::MAX_KERNELS),
        ("operations of a kernel", json::MAX_OPERATIONS),
        (
            "operations that use each other in a chain",
            json::MAX_DEPTH as usize,
        ),
        ("inputs, and outputs, of a kernel", json::MAX_FIELDS),
        ("elements of an input or output", json::MAX_ELEMENTS),
    ] {
        let row = format!("| {what} | {} |", spaced(limit));
        assert!(PAGE.contains(&row), "{row}");
    }
}
