//! Did the text change? Snapshots of the emitted kernels, their operation counts, and the JSON.
//!
//! Accept an intended change with `cargo insta review`, or `INSTA_UPDATE=always cargo test`.

use bristle_codegen::back::json::to_json;
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::{Origin, count_operations};
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::ir::simplify::RULES;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::kernels::kernels as derived_kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::normal_form::SUM_RULES;

/// The command that the pages and sources name.
const AGAIN: &str = "cargo test -p bristle-codegen";

fn origin(title: &str) -> Origin<'_> {
    Origin {
        title,
        maker: "a test of bristle-codegen",
        again: AGAIN,
    }
}

/// The motions, each with the prefix of the names of its snapshots.
const MOTIONS: [(Motion, &str); 2] = [(Motion::Spatial, ""), (Motion::Planar, "planar_")];

fn whole(segments: usize, motion: Motion, purpose: Purpose) -> Vec<Kernel> {
    whole_kernels(segments, motion, purpose).expect("the derivation is sound")
}

fn kernels() -> Vec<Kernel> {
    derived_kernels().expect("the derivation is sound")
}

#[test]
fn emitted_kernels() {
    let source =
        emit(&kernels(), origin("Kernels of the solver.")).expect("the kernels can be emitted");
    insta::assert_snapshot!("kernels", source);
}

#[test]
fn emitted_whole_equations() {
    for (motion, start) in MOTIONS {
        let kernels = whole(1, motion, Purpose::Computing);
        let source = emit(&kernels, origin("One segment.")).expect("the equations can be emitted");
        insta::assert_snapshot!(format!("{start}whole_1"), source);
    }
}

#[test]
fn exchanged_equations() {
    for (motion, start) in MOTIONS {
        let json = to_json(&whole(1, motion, Purpose::Computing), "one segment")
            .expect("the equations can be written");
        insta::assert_snapshot!(format!("{start}whole_1_json"), json);
    }
}

#[test]
fn operation_counts() {
    let line = |kernel: &Kernel| format!("{:23} {}\n", kernel.name, count_operations(kernel));
    let mut table: String = kernels().iter().map(line).collect();
    for (motion, _) in MOTIONS {
        for segments in [1, 2, 3, 25] {
            for kernel in whole(segments, motion, Purpose::Computing) {
                table += &format!(
                    "n = {segments:2}  {:18} {}\n",
                    kernel.name,
                    count_operations(&kernel)
                );
            }
        }
    }
    insta::assert_snapshot!("operation_counts", table);
}

#[test]
fn same_input_gives_the_same_bytes() {
    for (motion, _) in MOTIONS {
        let source = || {
            emit(
                &whole(4, motion, Purpose::Computing),
                origin("Four segments."),
            )
        };
        assert_eq!(
            source().expect("the equations can be emitted"),
            source().expect("the equations can be emitted")
        );
    }
}

#[test]
fn rules_have_unique_names() {
    let mut names: Vec<&str> = RULES
        .iter()
        .map(|rule| rule.name)
        .chain(SUM_RULES.iter().map(|rule| rule.name))
        .collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
}
