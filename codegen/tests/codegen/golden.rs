//! Did the text change? Snapshots of the readable equations, the emitted kernels and their operation counts.
//!
//! Accept an intended change with `cargo insta review`, or `INSTA_UPDATE=always cargo test`.

use std::fmt::Write;

use bristle_codegen::back::json::to_json;
use bristle_codegen::back::print::{self, Form, equations};
use bristle_codegen::back::rust::{Origin, count_operations, emit};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::ir::simplify::RULES;
use bristle_codegen::model::kernels::kernels as derived_kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::normal_form::SUM_RULES;

/// The command that the pages and sources name.
const AGAIN: &str = "cargo test -p bristle-codegen";

fn origin(title: &str) -> Origin<'_> {
    Origin { title, maker: "a test of bristle-codegen", again: AGAIN }
}

fn whole(segments: usize, purpose: Purpose) -> Vec<Kernel> {
    whole_kernels(segments, purpose).expect("the derivation is sound")
}

fn kernels() -> Vec<Kernel> {
    derived_kernels().expect("the derivation is sound")
}

#[test]
fn readable_equations() {
    for segments in [1, 2, 3] {
        let text = equations(Form::Text, segments, &whole(segments, Purpose::Reading), AGAIN);
        insta::assert_snapshot!(format!("equations_{segments}"), text);
    }
    for segments in [1, 2] {
        let text = equations(Form::Latex, segments, &whole(segments, Purpose::Reading), AGAIN);
        insta::assert_snapshot!(format!("equations_{segments}_latex"), text);
    }
}

#[test]
fn readable_kernels() {
    for (name, form) in [("kernels_math", Form::Text), ("kernels_latex", Form::Latex)] {
        insta::assert_snapshot!(name, print::kernels(form, "Kernels of the solver", &kernels(), AGAIN));
    }
}

#[test]
fn latex_is_ascii() {
    for segments in [1, 2, 3, 5] {
        assert!(equations(Form::Latex, segments, &whole(segments, Purpose::Reading), AGAIN).is_ascii());
    }
    assert!(print::kernels(Form::Latex, "Kernels – of “the” solver", &kernels(), AGAIN).is_ascii());
}

#[test]
fn emitted_kernels() {
    let source = emit(&kernels(), origin("Kernels of the solver.")).expect("the kernels can be emitted");
    insta::assert_snapshot!("kernels", source);
}

#[test]
fn emitted_whole_equations() {
    let source = emit(&whole(1, Purpose::Computing), origin("One segment.")).expect("the equations can be emitted");
    insta::assert_snapshot!("whole_1", source);
}

#[test]
fn exchanged_equations() {
    let json = to_json(&whole(1, Purpose::Computing), "one segment").expect("the equations can be written");
    insta::assert_snapshot!("whole_1_json", json);
}

#[test]
fn operation_counts() {
    let mut table = String::new();
    for kernel in kernels() {
        writeln!(table, "{:16} {}", kernel.name, count_operations(&kernel)).expect("a string takes everything");
    }
    for segments in [1, 2, 3, 25] {
        for kernel in whole(segments, Purpose::Computing) {
            writeln!(table, "n = {segments:2}  {:12} {}", kernel.name, count_operations(&kernel)).expect("see above");
        }
    }
    insta::assert_snapshot!("operation_counts", table);
}

#[test]
fn same_input_gives_the_same_bytes() {
    let text = || emit(&whole(4, Purpose::Computing), origin("Four segments.")).expect("the equations can be emitted");
    assert_eq!(text(), text());
    let text = || equations(Form::Text, 4, &whole(4, Purpose::Reading), AGAIN);
    assert_eq!(text(), text());
}

#[test]
fn rules_have_unique_names() {
    let mut names: Vec<&str> =
        RULES.iter().map(|rule| rule.name).chain(SUM_RULES.iter().map(|rule| rule.name)).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
}
