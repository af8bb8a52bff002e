//! Did the text change? Snapshots of the readable equations, and of those in other languages.

use std::io;

use bristle_codegen::back::source::Origin;
use bristle_codegen::ir::kernel::Kernel;
use bristle_codegen::model::chain::{Motion, RelaxedShape};
use bristle_codegen::model::kernels::kernels as derived_kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_equations::languages::{SourceFile, c, matlab, numpy, sympy};
use bristle_equations::print::{self, PageForm, Walkthrough, equations};

/// The command that the pages and sources name.
const AGAIN: &str = "cargo test -p bristle-equations";

/// Equations for a paper, as wide as the text of an article.
const FRAGMENT: PageForm = PageForm::Fragment { width: 34_500 };

fn origin(title: &str) -> Origin<'_> {
    Origin {
        title,
        maker: "a test of bristle-equations",
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
fn readable_equations() {
    for (motion, start) in MOTIONS {
        for segments in [1, 2, 3] {
            insta::assert_snapshot!(
                format!("{start}equations_{segments}"),
                page(PageForm::Text, segments, motion)
            );
        }
        for segments in [1, 2] {
            let latex = page(PageForm::Latex, segments, motion);
            insta::assert_snapshot!(format!("{start}equations_{segments}_latex"), latex);
        }
    }
}

/// The whole equations of `segments` and `motion` in `form`.
fn page(form: PageForm, segments: usize, motion: Motion) -> String {
    let kernels = whole(segments, motion, Purpose::Reading);
    written(|out| {
        equations(
            out,
            form,
            segments,
            motion,
            RelaxedShape::default(),
            &kernels,
            origin(&print::title(segments, motion)),
        )
    })
}

/// Some kernels of the solver in `form`.
fn kernels_page(form: PageForm, title: &str, kernels: &[Kernel]) -> String {
    written(|out| print::kernels(out, form, kernels, origin(title)))
}

fn written(write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> String {
    let mut text = Vec::new();
    write(&mut text).expect("memory can be written to");
    String::from_utf8(text).expect("a page is text")
}

#[test]
fn the_derivation_step_by_step() {
    for (name, motion) in [
        ("walkthrough_2", Motion::Spatial),
        ("planar_walkthrough_2", Motion::Planar),
    ] {
        let walkthrough =
            Walkthrough::new(2, motion, RelaxedShape::default()).expect("the derivation is sound");
        insta::assert_snapshot!(
            name,
            written(|out| walkthrough.write(out, "a test of bristle-equations", AGAIN))
        );
    }
}

#[test]
fn readable_kernels() {
    for (name, form) in [
        ("kernels_math", PageForm::Text),
        ("kernels_latex", PageForm::Latex),
    ] {
        insta::assert_snapshot!(
            name,
            kernels_page(form, "Kernels of the solver", &kernels()[..1])
        );
    }
}

/// Checks the equations for a paper: labels, vectors and matrices, in lines that end before a sign.
#[test]
fn equations_for_a_paper() {
    insta::assert_snapshot!(
        "planar_equations_2_fragment",
        page(FRAGMENT, 2, Motion::Planar)
    );
    for (motion, _) in MOTIONS {
        for segments in [1, 2, 3] {
            let fragment = page(FRAGMENT, segments, motion);
            assert!(fragment.is_ascii() && !fragment.contains("\\documentclass"));
            let labels = fragment
                .lines()
                .filter_map(|line| Some(line.split_once("\\label{")?.1.split_once('}')?.0));
            let labels: Vec<&str> = labels.collect();
            assert!(
                labels
                    .iter()
                    .enumerate()
                    .all(|(i, label)| !labels[..i].contains(label)),
                "{labels:?}"
            );
            let matrix = if motion == Motion::Planar {
                "eq:planar-mass-matrix:M"
            } else {
                "eq:mass-matrix:M"
            };
            assert!(labels.contains(&matrix), "{labels:?}");
            let continued = fragment
                .lines()
                .filter_map(|line| line.strip_prefix("&\\quad "));
            let is_term = |line: &str| line.starts_with(['+', '-']);
            assert!(continued.clone().count() > 0 || segments == 1);
            assert!(continued.clone().all(is_term), "{fragment}");
        }
    }
}

#[test]
fn latex_is_ascii() {
    for (motion, _) in MOTIONS {
        for segments in [1, 2, 3, 5] {
            assert!(page(PageForm::Latex, segments, motion).is_ascii());
        }
    }
    assert!(kernels_page(PageForm::Latex, "Kernels – of “the” solver", &kernels()).is_ascii());
}

#[test]
fn other_languages() {
    let origin = origin("Two segments.");
    let [computing, reading] =
        [Purpose::Computing, Purpose::Reading].map(|purpose| whole(2, Motion::Planar, purpose));
    let mut files = c::emit(&computing, origin).expect("the equations can be emitted");
    files.extend(matlab::emit(&computing, origin).expect("the equations can be emitted"));
    let python = [
        ("numpy.py", numpy::emit(&computing, origin)),
        ("sympy.py", sympy::emit(&reading, origin)),
    ];
    files.extend(python.map(|(name, text)| SourceFile {
        name: name.into(),
        text: text.expect("see above"),
    }));
    // The plane does not need `S`.
    let spatial =
        matlab::emit(&whole(1, Motion::Spatial, Purpose::Computing), origin).expect("see above");
    files.extend(
        spatial
            .into_iter()
            .filter(|file| file.name == "half_angle_squared.m"),
    );
    for SourceFile { name, text } in files {
        insta::assert_snapshot!(name.replace('.', "_"), text);
    }
}

#[test]
fn same_input_gives_the_same_bytes() {
    for (motion, _) in MOTIONS {
        assert_eq!(
            page(PageForm::Text, 4, motion),
            page(PageForm::Text, 4, motion)
        );
    }
}
