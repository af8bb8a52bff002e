//! The table of evidence in `docs/trust.md`, from the results of the trials.

use std::fs;
use std::path::Path;

use crate::record::{Report, directory};
use crate::tolerances::{self, Tolerance};
use crate::trial::Check;

/// The largest difference of a row.
enum LargestDifference {
    /// Largest error of trials, by their names, among comparisons with these tolerances, or all.
    Of(&'static [&'static str], &'static [&'static Tolerance]),
    /// All comparisons hold in trials with this prefix of their names.
    AllHold(&'static str),
    /// Tolerance of another test, with its command.
    Within(f64, &'static str),
}

/// Rows: subject, reference, and largest difference.
const ROWS: &[(&str, &str, LargestDifference)] = &[
    (
        "equations of motion, kernels and tangents, at 1000 states",
        "CasADi, from its own statement of the energies",
        LargestDifference::Within(1e-12, "-p bristle-codegen --test codegen -- agreement::"),
    ),
    (
        "accelerations, n up to 25",
        "Pinocchio's articulated-body algorithm",
        LargestDifference::Within(1e-11, "--test bristle -- reference::"),
    ),
    (
        "elastica under a tip load",
        "elliptic integrals (Bisshopp and Drucker 1945)",
        LargestDifference::Of(&["elastica under a tip load"], &[tolerances::STATICS]),
    ),
    (
        "force in the middle of a slow pass",
        "buckled elastica",
        LargestDifference::Of(&["buckled elastica in a slow pass"], &[]),
    ),
    (
        "first five natural frequencies",
        "Euler and Bernoulli's beam",
        LargestDifference::Of(&["frequencies of a cantilever"], &[tolerances::FREQUENCY]),
    ),
    (
        "damping ratio of the first mode",
        "the stated ratio",
        LargestDifference::Of(&["damping ratio of the first mode"], &[tolerances::DAMPING]),
    ),
    (
        "flap and lag frequencies of a rotating filament",
        "Wright et al. 1982",
        LargestDifference::Of(
            &["frequencies of a rotating cantilever"],
            &[tolerances::FREQUENCY],
        ),
    ),
    (
        "restitution of impacts",
        "Hunt and Crossley's law",
        LargestDifference::Of(&["restitution of impacts"], &[tolerances::IMPACT]),
    ),
    (
        "energy over whole passes",
        "balance",
        LargestDifference::Of(&["energy of passes"], &[tolerances::ENERGY]),
    ),
    (
        "one pass in the plane: force, tip, impulse",
        "CasADi and CVODES",
        LargestDifference::Of(&["pass by CVODES"], &[]),
    ),
    (
        "impulse, deflection and contact time of a pass, n → ∞",
        "Exudyn's continuous beam",
        LargestDifference::Of(&["pass by Exudyn"], &[tolerances::ANCF_METRICS]),
    ),
    (
        "passes with friction over chamfers, circles and splines: impulses and friction work",
        "CasADi and CVODES",
        LargestDifference::Within(5e-6, "--test bristle -- edges::"),
    ),
    (
        "tilted tools, cones and cups: impulses",
        "CasADi and CVODES",
        LargestDifference::Within(1e-6, "--test bristle -- posed::"),
    ),
    (
        "wavy, tapered filament under an end moment",
        "integral of the curved beam",
        LargestDifference::Of(&["wavy, tapered filament"], &[tolerances::SHAPE]),
    ),
    (
        "rows of up to three filaments that touch: impulse of each",
        "CasADi and CVODES",
        LargestDifference::Within(1e-3, "--test bristle -- brush::rows_are"),
    ),
    (
        "row of six filaments that touch: impulse of each",
        "MuJoCo, with the same contact points",
        LargestDifference::Of(&["row of six by MuJoCo"], &[tolerances::ROW]),
    ),
    (
        "the paper's seven findings on the grid of 120",
        "a numeric criterion each",
        LargestDifference::AllHold("paper: "),
    ),
];

const BEGIN: &str = "<!-- evidence: begin -->\n";
const END: &str = "<!-- evidence: end -->";

/// Writes the table to `evidence.md` beside the record and compares it with `docs/trust.md`, or
/// replaces the table there.
pub fn compare(reports: &[Report], updates: bool) -> Result<(), String> {
    let table = table(reports);
    fs::write(directory().join("evidence.md"), &table).expect("the table can be written");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/trust.md");
    let text = fs::read_to_string(&page).expect("docs/trust.md can be read");
    let (before, rest) = text
        .split_once(BEGIN)
        .expect("docs/trust.md has a table of evidence");
    let (committed, after) = rest.split_once(END).expect("the table of evidence ends");
    if committed == table {
        return Ok(());
    }
    if updates {
        let text = format!("{before}{BEGIN}{table}{END}{after}");
        fs::write(&page, text).expect("docs/trust.md can be written");
        return Ok(());
    }
    let missing = table
        .lines()
        .filter(|row| committed.lines().all(|other| other != *row));
    Err(format!(
        "the table of evidence in docs/trust.md is stale; update it with --full --update:\n{}",
        missing.collect::<Vec<_>>().join("\n")
    ))
}

fn table(reports: &[Report]) -> String {
    let mut text = "| what is compared | with what | largest difference | command |\n\
        |---|---|---:|---|\n"
        .to_owned();
    for (what, with, largest) in ROWS {
        let (largest, command) = match largest {
            LargestDifference::Of(names, tolerances) => {
                (rounded_up(largest_error(reports, names, tolerances)), None)
            }
            LargestDifference::AllHold(prefix) => (all_hold(reports, prefix), None),
            LargestDifference::Within(tolerance, command) => {
                (rounded_up(*tolerance), Some(command))
            }
        };
        let command = command.map_or("full".to_owned(), |command| {
            format!("`cargo test {command}`")
        });
        text.push_str(&format!("| {what} | {with} | {largest} | {command} |\n"));
    }
    text
}

fn largest_error(reports: &[Report], names: &[&str], tolerances: &[&Tolerance]) -> f64 {
    let chosen = |check: &&Check| {
        tolerances.is_empty()
            || tolerances
                .iter()
                .any(|tolerance| tolerance.name == check.tolerance.name)
    };
    let errors: Vec<f64> = reports
        .iter()
        .filter(|report| names.contains(&report.name))
        .flat_map(|report| report.checks.iter().flatten())
        .filter(chosen)
        .map(Check::error)
        .collect();
    assert!(!errors.is_empty(), "no comparison of {names:?}");
    errors.into_iter().fold(0.0, crate::chains::worse)
}

fn all_hold(reports: &[Report], prefix: &str) -> String {
    let mut findings = reports
        .iter()
        .filter(|report| report.name.starts_with(prefix));
    if findings.all(Report::passes) {
        "all hold"
    } else {
        "not all hold"
    }
    .to_owned()
}

/// A positive number, rounded up to one digit.
fn rounded_up(value: f64) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    // The value of a constant such as 1e-12 is above the decimal number by rounding.
    let text = format!("{:.12e}", value);
    let (mantissa, exponent) = text.split_once('e').expect("scientific notation");
    let number = |text: &str| text.parse::<f64>().expect("a number");
    let (mut digit, mut exponent) = (number(mantissa).ceil(), number(exponent) as i32);
    if digit == 10.0 {
        (digit, exponent) = (1.0, exponent + 1);
    }
    let sign = if exponent < 0 { "⁻" } else { "" };
    let places = exponent.unsigned_abs().to_string();
    let power: String = places
        .bytes()
        .map(|place| DIGITS[usize::from(place - b'0')])
        .collect();
    format!("{digit}·10{sign}{power}")
}

/// Check of the rounding in the table.
pub const CHECK: (&str, fn()) = ("evidence is rounded up", || {
    let cases = [
        (1e-12, "1·10⁻¹²"),
        (8.4e-8, "9·10⁻⁸"),
        (9.3e-4, "1·10⁻³"),
        (25.0, "3·10¹"),
    ];
    for (value, text) in cases {
        assert_eq!(rounded_up(value), text);
    }
});
