//! Files that the reader refuses, and its messages.

use std::time::{Duration, Instant};

use bristle_codegen::back::json::{self, from_json};
use serde_json::{Value, json};

use super::{EXAMPLE, changed, example, refused, refused_with};

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
pub(super) fn faults_of_form() -> Vec<(&'static str, Value, &'static str)> {
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
