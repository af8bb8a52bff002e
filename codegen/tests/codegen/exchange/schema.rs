//! The schema of graph files and the page that describes them, compared with the reader.

use std::sync::OnceLock;

use bristle_codegen::back::json;
use serde_json::{Value, json};

use super::faults::faults_of_form;
use super::{EXAMPLE, PAGE, changed, derived, example, written};

const SCHEMA: &str = include_str!("../../../../docs/graph-format.schema.json");

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
