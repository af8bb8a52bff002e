//! What is attacked, one file per target.

pub mod contact;
pub mod graph;
pub mod input;
pub mod journal;
pub mod measured;
pub mod program;
pub mod results;
pub mod state;

use bristle_grid::{CaseResult, Study, run_study};
use bristle_input::document::Document;
use fastrand::Rng;

use crate::bytes;
use crate::runner::Mutant;
use crate::table::Table;
use crate::tree::Format;

/// A small study: six quick cases, of which the last three fail.
pub const STUDY: &str = "\
[tool]
body_radius_m = 0.140
width_m = 0.020
filament_count = 10500
filament_count_uncertainty = 600

[filament]
segments = 3
length_m = 0.040
diameter_m = 1.18e-3

[contact]
friction_coefficient = 0.1

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[solver]
relative_tolerance = 1e-3
samples = 20

[study]
brushing_velocity_m_s = [5.0, 10.0, 20.0]
penetration_depth_m = [1.0e-3]
\"contact.stiffness_n_m\" = [1e5, 1e300]
";

/// The study of a file that is right, and its results.
pub fn simulated(file: &str) -> (Study, Vec<CaseResult>) {
    let study = Document::parse(file, "case.toml")
        .and_then(|document| document.study())
        .expect("the file is right");
    let results = run_study(&study, None, || ()).expect("the threads start");
    (study, results)
}

/// Changes a text one to four times, through its tree or by its bytes. Returns the last change.
/// Pieces of `other` may enter.
fn change_text(
    text: &str,
    other: &str,
    format: &Format,
    random: &mut Rng,
) -> (&'static str, Vec<u8>) {
    let mut bytes = text.as_bytes().to_vec();
    let mut change = "";
    if random.u8(..4) > 0 {
        let mut tree = (format.read)(text);
        for _ in 0..times(random) {
            change = tree.change(random);
        }
        bytes = (format.write)(&tree).into_bytes();
    }
    if change.is_empty() || random.u8(..8) == 0 {
        change = change_bytes(&mut bytes, other.as_bytes(), random);
    }
    (change, bytes)
}

/// Changes a table one to four times, by its cells or by its bytes. Returns the last change.
fn change_table(text: &str, random: &mut Rng) -> (&'static str, Vec<u8>) {
    let mut bytes = text.as_bytes().to_vec();
    let mut change = "";
    if random.u8(..4) > 0 {
        let mut table = Table::of(text);
        for _ in 0..times(random) {
            change = table.change(random);
        }
        bytes = table.text(random).into_bytes();
    }
    if change.is_empty() || random.u8(..8) == 0 {
        change = change_bytes(&mut bytes, text.as_bytes(), random);
    }
    (change, bytes)
}

/// Changes bytes one to four times. Returns the last change.
fn change_bytes(bytes: &mut Vec<u8>, other: &[u8], random: &mut Rng) -> &'static str {
    let mut change = "";
    for _ in 0..times(random) {
        change = bytes::change(bytes, other, random);
    }
    change
}

/// One, and seldom more.
fn times(random: &mut Rng) -> usize {
    if random.bool() {
        1
    } else {
        random.usize(1..=4)
    }
}

fn one_of<'a, T: ?Sized>(things: &[&'a T], random: &mut Rng) -> &'a T {
    things[random.usize(..things.len())]
}

/// A mutant of one of several texts.
fn of_texts(name: &str, texts: &[&str], format: &Format, random: &mut Rng) -> Mutant {
    let (text, other) = (one_of(texts, random), one_of(texts, random));
    let (change, bytes) = change_text(text, other, format, random);
    Mutant::file(change, name, bytes)
}
