//! The outcomes as text for a terminal, for programs and as a page. The text depends on nothing
//! else, so the same numbers give the same bytes.

use std::io::{self, Write};

use bristle_report::drawing::power_of_ten;
use bristle_text::columns;
use bristle_text::layout::{left, wrap};

use super::group::{Extent, Failure, Outcome};
use super::sources;
use super::tolerances::{self, Measure};
use super::trial::{Check, Expected, Trial};

/// Significant digits of numbers and of errors.
const DIGITS: usize = 8;
const ERROR_DIGITS: usize = 2;
/// The smallest width of the table's first column, if all columns stand side by side.
const MIN_SUBJECT: usize = 24;

/// True if every trial has checks, and all checks pass.
pub fn agrees(outcomes: &[Outcome]) -> bool {
    outcomes
        .iter()
        .flat_map(|outcome| &outcome.trials)
        .all(trial_agrees)
}

fn trial_agrees(trial: &Result<Trial, Failure>) -> bool {
    problem(trial).is_none()
        && trial
            .iter()
            .flat_map(|trial| &trial.checks)
            .all(Check::passes)
}

/// Why a trial has no numbers, if it has none.
fn problem(trial: &Result<Trial, Failure>) -> Option<String> {
    match trial {
        Err(failure) => Some(format!("could not be computed: {failure}")),
        Ok(trial) if trial.checks.is_empty() => Some("compares nothing".to_owned()),
        Ok(_) => None,
    }
}

/// The trials of a group with their names. A trial that could not be computed has no title, so it
/// gets a number.
fn named(outcome: &Outcome) -> impl Iterator<Item = (String, &Result<Trial, Failure>)> {
    (1..).zip(&outcome.trials).map(|(place, trial)| {
        let name = trial
            .as_ref()
            .map_or_else(|_| format!("Case {place}"), |trial| trial.title.to_owned());
        (name, trial)
    })
}

/// A number with at most `digits` significant digits and without trailing zeros.
fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{value:.*e}", digits - 1);
    let Some((mantissa, exponent)) = scientific.split_once('e') else {
        // It is not finite.
        return scientific;
    };
    let short = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    match exponent.parse::<i32>() {
        Ok(exponent @ -4..=7) => short(&format!(
            "{value:.*}",
            (digits as i32 - 1 - exponent).max(0) as usize
        )),
        _ => format!("{}e{exponent}", short(mantissa)),
    }
}

/// The same, typeset as in a formula.
fn typeset(value: f64, digits: usize) -> String {
    let text = number(value, digits);
    let text = match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let power = exponent
                .parse()
                .map_or_else(|_| format!("10^{exponent}"), power_of_ten);
            match mantissa {
                "1" | "-1" => mantissa.replace('1', &power),
                _ => format!("{mantissa}·{power}"),
            }
        }
        None => text,
    };
    text.replace('-', "−").replace("inf", "∞")
}

/// A comparison as text for people.
struct Row {
    reference: String,
    computed: String,
    error: String,
    tolerance: String,
}

impl Row {
    fn new(check: &Check, number: fn(f64, usize) -> String) -> Self {
        let exact = |value| number(value, DIGITS);
        let reference = match check.expected {
            Expected::Value(value) => exact(value),
            Expected::Between(low, high) => bounds([low, high], exact),
        };
        let tolerance = match check.tolerance.measure {
            _ if check.tolerance.value == 0.0 => "none".to_owned(),
            Measure::Relative => format!("{} rel", number(check.tolerance.value, ERROR_DIGITS)),
            Measure::Absolute | Measure::Between(..) => {
                format!("{} abs", number(check.tolerance.value, ERROR_DIGITS))
            }
        };
        Self {
            reference,
            computed: exact(check.computed),
            error: number(check.error(), ERROR_DIGITS),
            tolerance,
        }
    }
}

/// Bounds as text.
fn bounds([low, high]: [f64; 2], number: impl Fn(f64) -> String) -> String {
    match (low, high) {
        (f64::NEG_INFINITY, high) => format!("≤ {}", number(high)),
        (low, f64::INFINITY) => format!("≥ {}", number(low)),
        (low, high) => format!("{} … {}", number(low), number(high)),
    }
}

/// Numbers of comparisons, of those that agree, of trials, and of those without numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Counts {
    checks: usize,
    passing: usize,
    cases: usize,
    problems: usize,
}

impl Counts {
    fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        outcomes
            .into_iter()
            .fold(Self::default(), |counts, outcome| Self {
                checks: counts.checks + outcome.checks().count(),
                passing: counts.passing + outcome.checks().filter(|check| check.passes()).count(),
                cases: counts.cases + outcome.trials.len(),
                problems: counts.problems + outcome.trials.iter().filter_map(problem).count(),
            })
    }

    /// The outcome in one line.
    fn verdict(self) -> String {
        let Self {
            checks,
            passing,
            cases,
            problems,
        } = self;
        let plural = |count: usize, one: &'static str, many: &'static str| {
            if count == 1 { one } else { many }
        };
        let (comparisons, of_cases) = (
            plural(checks, "comparison", "comparisons"),
            plural(cases, "case", "cases"),
        );
        let mut text = format!("{passing} of {checks} {comparisons} in {cases} {of_cases} agree");
        if problems > 0 {
            text.push_str(&format!(
                "; {problems} {} no number",
                plural(problems, "case gives", "cases give")
            ));
        }
        text
    }
}

/// A line of the table.
enum TableLine {
    Title(String),
    Cells([String; 8]),
    Problem(String),
}

/// All comparisons as a table, in lines of at most `width` columns if the texts allow it. Failures
/// are repeated at the end, before the verdict.
pub fn table(outcomes: &[Outcome], width: usize) -> String {
    let mut text = String::new();
    for outcome in outcomes {
        text.push_str(&section(outcome, |_| true, width));
        text.push('\n');
    }
    if !agrees(outcomes) {
        text.push_str("Failed:\n\n");
        for outcome in outcomes
            .iter()
            .filter(|outcome| !outcome.trials.iter().all(trial_agrees))
        {
            text.push_str(&section(outcome, |check| !check.passes(), width));
            text.push('\n');
        }
    }
    text + &Counts::of(outcomes).verdict() + "\n"
}

/// The comparisons of a group that `shown` selects.
fn section(outcome: &Outcome, shown: fn(&Check) -> bool, width: usize) -> String {
    const HEADINGS: [&str; 8] = [
        "for",
        "quantity",
        "reference",
        "source",
        "computed",
        "error",
        "tolerance",
        "",
    ];
    let mut lines = Vec::new();
    for (name, trial) in named(outcome) {
        let checks = trial
            .iter()
            .flat_map(|trial| &trial.checks)
            .filter(|check| shown(check));
        let rows: Vec<_> = checks
            .map(cells)
            .map(TableLine::Cells)
            .chain(problem(trial).map(TableLine::Problem))
            .collect();
        if !rows.is_empty() {
            lines.push(TableLine::Title(name));
            lines.extend(rows);
        }
    }
    let headings = HEADINGS.map(str::to_owned);
    let mut widths = headings.each_ref().map(|heading| columns(heading));
    for line in &lines {
        if let TableLine::Cells(cells) = line {
            for (width, cell) in widths.iter_mut().zip(cells) {
                *width = columns(cell).max(*width);
            }
        }
    }
    // Two spaces before each column.
    let others: usize = 2 + widths[1..].iter().map(|width| width + 2).sum::<usize>();
    let is_wide = others + MIN_SUBJECT <= width;
    widths[0] = widths[0].min(width.saturating_sub(others));
    let row = |text: &mut String, cells: &[String; 8]| match is_wide {
        true => text.push_str(&side_by_side(cells, &widths)),
        false => below_each_other(text, cells, &widths, width),
    };

    let rule = "─".repeat(width.saturating_sub(columns(outcome.group.title) + 4));
    let mut text = format!("── {} {rule}\n", outcome.group.title);
    if lines.iter().any(|line| matches!(line, TableLine::Cells(_))) {
        row(&mut text, &headings);
    }
    for line in &lines {
        match line {
            TableLine::Title(name) => text.push_str(&format!("{name}\n")),
            TableLine::Cells(cells) => row(&mut text, cells),
            TableLine::Problem(problem) => text.push_str(&format!("  {problem}  FAIL\n")),
        }
    }
    text
}

/// A row on one line. If its first cell is too long for its column, the others follow below.
fn side_by_side(cells: &[String; 8], widths: &[usize; 8]) -> String {
    let mut text = String::new();
    for (cell, &width) in cells.iter().zip(widths) {
        text.push_str("  ");
        if columns(cell) > width {
            text.push_str(&format!("{cell}\n  {:width$}", ""));
        } else {
            text.push_str(&left(cell, width));
        }
    }
    text.trim_end().to_owned() + "\n"
}

/// A row on several lines: what is compared and the source of its reference, then the numbers.
fn below_each_other(text: &mut String, cells: &[String; 8], widths: &[usize; 8], width: usize) {
    let [subject, quantity, _, source, ..] = cells;
    wrap(
        width,
        text,
        "  ",
        &format!("{subject}: {quantity} ({source})"),
    );
    let numbers: String = [2, 4, 5, 6, 7]
        .map(|column| format!("  {}", left(&cells[column], widths[column])))
        .concat();
    text.push_str(&format!("    {}\n", numbers.trim_end()));
}

fn cells(check: &Check) -> [String; 8] {
    let Row {
        reference,
        computed,
        error,
        tolerance,
    } = Row::new(check, number);
    let (quantity, source) = (check.quantity.to_owned(), check.source.key.to_owned());
    let mark = if check.passes() { "ok" } else { "FAIL" };
    [
        check.subject.clone(),
        quantity,
        reference,
        source,
        computed,
        error,
        tolerance,
        mark.to_owned(),
    ]
}

/// Writes `validation.csv`: a header, then one row per comparison.
///
/// A trial without numbers has one row, with the reason as its subject.
pub fn write_rows(out: impl Write, outcomes: &[Outcome]) -> io::Result<()> {
    const COLUMNS: [&str; 13] = [
        "group",
        "case",
        "subject",
        "quantity",
        "reference",
        "lower",
        "upper",
        "source",
        "computed",
        "error",
        "error_kind",
        "tolerance",
        "pass",
    ];
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(COLUMNS)?;
    for outcome in outcomes {
        for (name, trial) in named(outcome) {
            let place = [outcome.group.title.to_owned(), name];
            for check in trial.iter().flat_map(|trial| &trial.checks) {
                writer.write_record(place.iter().chain(&fields(check)))?;
            }
            if let Some(problem) = problem(trial) {
                let mut fields = vec![String::new(); COLUMNS.len() - place.len()];
                fields[0] = problem;
                fields[COLUMNS.len() - place.len() - 1] = "false".to_owned();
                writer.write_record(place.iter().chain(&fields))?;
            }
        }
    }
    writer.flush()
}

/// A comparison as columns of `validation.csv`, which follow group and case.
fn fields(check: &Check) -> [String; 11] {
    let digits = |value: f64| format!("{value:?}");
    let limit = |value: f64| {
        if value.is_infinite() {
            String::new()
        } else {
            digits(value)
        }
    };
    let [lower, upper] = check.limits().map(limit);
    let (reference, kind) = match (check.expected, check.tolerance.measure) {
        (Expected::Between(..), _) => (String::new(), "bounds"),
        (Expected::Value(value), Measure::Relative) => (digits(value), "relative"),
        (Expected::Value(value), Measure::Absolute | Measure::Between(..)) => {
            (digits(value), "absolute")
        }
    };
    [
        check.subject.clone(),
        check.quantity.to_owned(),
        reference,
        lower,
        upper,
        check.source.key.to_owned(),
        digits(check.computed),
        digits(check.error()),
        kind.to_owned(),
        digits(check.tolerance.value),
        check.passes().to_string(),
    ]
}

/// The page of the validation, in Markdown. Its figures are in the same directory.
pub fn page(outcomes: &[Outcome], extent: Extent) -> String {
    let made_by = match extent {
        Extent::Full => "`bristle validate --full --out docs` writes this page",
        Extent::Quick => {
            "`bristle validate` wrote this page, without the convergence studies that `--full` adds,"
        }
    };
    let mut text = format!(
        "# Validation\n\n\
         Bristle compared with exact solutions, other codes and the paper. Each case states what is computed, and the formula \
         that it is compared with. Each number has a reference, the source of the reference, and a tolerance; the \
         [reasons for the tolerances](#tolerances) are at the end. {made_by} with its figures and \
         [validation.csv](validation.csv). The command fails if a number is off by more than its tolerance. {}.\n\n",
        Counts::of(outcomes).verdict()
    );
    text.push_str(&summary(outcomes));
    for outcome in outcomes {
        text.push_str(&format!(
            "\n## {}\n\n{}\n",
            outcome.group.title, outcome.group.purpose
        ));
        for (name, trial) in named(outcome) {
            text.push_str(&paragraph(&name, trial));
        }
    }
    text + &tolerances_and_sources(outcomes)
}

fn summary(outcomes: &[Outcome]) -> String {
    let heading = [
        "group",
        "cases",
        "comparisons",
        "largest error / tolerance",
        "agrees",
    ];
    let row = |name: String, outcomes: &[&Outcome]| {
        let counts = Counts::of(outcomes.iter().copied());
        let largest = largest_share(outcomes.iter().flat_map(|outcome| outcome.checks()));
        let all_agree = outcomes
            .iter()
            .flat_map(|outcome| &outcome.trials)
            .all(trial_agrees);
        let [cases, checks] = [counts.cases, counts.checks].map(|count| count.to_string());
        vec![name, cases, checks, largest, mark(all_agree)]
    };
    let groups = outcomes.iter().map(|outcome| {
        let title = outcome.group.title;
        row(format!("[{title}](#{})", anchor(title)), &[outcome])
    });
    let all = row("all".to_owned(), &outcomes.iter().collect::<Vec<_>>());
    markdown_table(&heading, "lrrrc", groups.chain([all]))
}

/// The section of a trial, with its heading.
fn paragraph(name: &str, trial: &Result<Trial, Failure>) -> String {
    let mut text = format!("\n### {name}\n");
    if let Ok(trial) = trial {
        text.push_str(&format!("\n{}\n", trial.text));
        for figure in &trial.figures {
            let description = figure.description.replace('[', "\\[").replace(']', "\\]");
            text.push_str(&format!("\n![{description}]({}.svg)\n", figure.name));
        }
        if !trial.checks.is_empty() {
            let heading = [
                "for",
                "quantity",
                "reference",
                "source",
                "computed",
                "error",
                "tolerance",
                "agrees",
            ];
            let rows = trial.checks.iter().map(|check| {
                let Row {
                    reference,
                    computed,
                    error,
                    tolerance,
                } = Row::new(check, typeset);
                let named = format!("{tolerance} ({})", check.tolerance.name);
                // Lines may break between conditions, not within them.
                let subject = check
                    .subject
                    .replace(" = ", "\u{a0}=\u{a0}")
                    .replace(" → ", "\u{a0}→\u{a0}");
                let cells = [
                    &subject,
                    check.quantity,
                    &reference,
                    check.source.key,
                    &computed,
                    &error,
                    &named,
                ];
                cells
                    .into_iter()
                    .map(escape)
                    .chain([mark(check.passes())])
                    .collect()
            });
            text.push_str(&format!("\n{}", markdown_table(&heading, "llllllll", rows)));
        }
    }
    if let Some(problem) = problem(trial) {
        text.push_str(&format!("\n**This case {}.**\n", escape(&problem)));
    }
    text
}

fn tolerances_and_sources(outcomes: &[Outcome]) -> String {
    let uses = |used: &dyn Fn(&Check) -> bool| {
        outcomes
            .iter()
            .flat_map(Outcome::checks)
            .filter(|check| used(check))
            .collect::<Vec<_>>()
    };
    let tolerances = tolerances::TABLE.iter().map(|tolerance| {
        let checks = uses(&|check| check.tolerance.name == tolerance.name);
        let (value, measure) = match tolerance.measure {
            Measure::Relative => (typeset(tolerance.value, ERROR_DIGITS), "relative"),
            Measure::Absolute => (typeset(tolerance.value, ERROR_DIGITS), "absolute"),
            Measure::Between(low, high) => (
                bounds([low, high], |value| typeset(value, DIGITS)),
                "bounds",
            ),
        };
        let (count, largest) = (checks.len().to_string(), largest_share(checks.into_iter()));
        vec![
            escape(tolerance.name),
            value,
            measure.to_owned(),
            count,
            largest,
            escape(tolerance.reason),
        ]
    });
    let sources = sources::LIST.iter().map(|source| {
        let count = uses(&|check| check.source.key == source.key).len();
        vec![
            escape(source.key),
            count.to_string(),
            escape(source.citation),
        ]
    });
    let heading = [
        "name",
        "tolerance",
        "measure",
        "comparisons",
        "largest error / tolerance",
        "reason",
    ];
    let tolerances = markdown_table(&heading, "lllrrl", tolerances);
    let sources = markdown_table(&["key", "comparisons", "source"], "lrl", sources);
    format!(
        "\n## Tolerances\n\nA relative error is divided by the reference; an absolute error has the unit of the number. For \
         bounds, the error is the distance from the nearer bound.\n\n{tolerances}\n## Sources\n\n{sources}"
    )
}

/// The largest ratio of error to tolerance. A passing comparison whose tolerance is zero counts as
/// zero.
fn largest_share<'a>(checks: impl Iterator<Item = &'a Check>) -> String {
    let share = |check: &Check| match check.error() / check.tolerance.value {
        _ if check.passes() && check.tolerance.value == 0.0 => 0.0,
        share if share.is_nan() => f64::INFINITY,
        share => share,
    };
    checks
        .map(share)
        .reduce(f64::max)
        .map_or_else(|| "–".to_owned(), |largest| typeset(largest, ERROR_DIGITS))
}

fn mark(agrees: bool) -> String {
    if agrees {
        "yes".to_owned()
    } else {
        "**no**".to_owned()
    }
}

/// A table in Markdown; `sides` has the alignment of each column: `l`, `r` or `c`.
fn markdown_table(
    headings: &[&str],
    sides: &str,
    rows: impl Iterator<Item = Vec<String>>,
) -> String {
    let rules = sides.chars().map(|side| match side {
        'r' => "---:",
        'c' => ":---:",
        _ => "---",
    });
    let mut text = format!(
        "| {} |\n|{}|\n",
        headings.join(" | "),
        rules.collect::<Vec<_>>().join("|")
    );
    for row in rows {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    text
}

/// Escapes plain text for the cell of a table.
fn escape(text: &str) -> String {
    text.chars()
        .flat_map(|character| match character {
            '|' | '*' | '<' | '`' | '\\' => vec!['\\', character],
            '\n' => vec![' '],
            _ => vec![character],
        })
        .collect()
}

/// The anchor of a heading.
fn anchor(heading: &str) -> String {
    let kept = heading
        .chars()
        .filter(|character| character.is_alphanumeric() || "-_ ".contains(*character));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

#[cfg(test)]
mod tests {
    use super::super::group::Group;
    use super::super::trial::{Axis, Curve, Figure, Look};
    use super::*;
    use bristle_text::layout::WIDTH;

    static GROUP: Group = Group {
        title: "Made up",
        purpose: "What is *not* computed.",
        trials: &[],
    };

    /// A group with one trial of these comparisons.
    fn outcomes(checks: Vec<Check>) -> Vec<Outcome> {
        let figure = Figure {
            name: "made_up",
            title: "A line".to_owned(),
            description: "A line [straight]",
            axes: [Axis::linear("x"), Axis::linear("y")],
            curves: vec![Curve::new(
                "y = x",
                Look::Line,
                vec![(0.0, 0.0), (1.0, 1.0)],
            )],
        };
        let trial = Trial::new("A case", "The formula:\n\n```text\n|x| = y\n```");
        vec![Outcome {
            group: &GROUP,
            trials: vec![Ok(Trial {
                checks,
                figures: vec![figure],
                ..trial
            })],
        }]
    }

    /// The comparison that `compare` makes.
    fn made(compare: impl FnOnce(&mut Trial)) -> Check {
        let mut trial = Trial::new("", "");
        compare(&mut trial);
        trial.checks.remove(0)
    }

    fn check(computed: f64) -> Check {
        let (source, tolerance) = (sources::EXACT, tolerances::STATICS);
        made(|trial| {
            trial.check(
                "|x| = 1",
                "y_a in m",
                0.1 + 0.2,
                source,
                computed,
                tolerance,
            )
        })
    }

    fn bounded(computed: f64, bounds: [f64; 2]) -> Check {
        made(|trial| {
            trial.check(
                "one",
                "z",
                bounds,
                sources::SYMMETRY,
                computed,
                tolerances::SAME,
            )
        })
    }

    fn csv_rows(outcomes: &[Outcome]) -> Vec<Vec<String>> {
        let mut bytes = Vec::new();
        write_rows(&mut bytes, outcomes).expect("memory can be written");
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .from_reader(bytes.as_slice());
        reader
            .records()
            .map(|row| row.expect("a row").iter().map(str::to_owned).collect())
            .collect()
    }

    #[test]
    fn numbers_within_their_tolerance_agree() {
        let outcomes = outcomes(vec![check(0.3), bounded(0.5, [0.5, f64::INFINITY])]);
        assert!(agrees(&outcomes));
        let table = table(&outcomes, WIDTH);
        assert!(
            !table.contains("FAIL") && !table.contains("Failed"),
            "{table}"
        );
        assert!(
            table.ends_with("\n2 of 2 comparisons in 1 case agree\n"),
            "{table}"
        );
        assert!(page(&outcomes, Extent::Quick).contains("| all | 1 | 2 | 9.3·10⁻¹⁰ | yes |"));
    }

    #[test]
    fn one_wrong_number_fails() {
        let (high, nan) = (f64::INFINITY, f64::NAN);
        let wrong = [
            check(0.3001),
            check(nan),
            check(high),
            Check {
                expected: Expected::Value(nan),
                ..check(0.3)
            },
            Check {
                expected: Expected::Value(0.0),
                ..check(1e-300)
            },
            bounded(0.4999, [0.5, high]),
            bounded(nan, [0.5, high]),
            bounded(high, [0.5, high]),
            bounded(0.5, [nan, 1.0]),
            bounded(0.5, [nan, nan]),
            bounded(0.5, [1.0, 0.0]),
        ];
        for wrong in wrong {
            assert!(
                !wrong.computed.is_nan() || wrong.error().is_nan(),
                "{wrong:?}"
            );
            let outcomes = outcomes(vec![check(0.3), wrong.clone()]);
            assert!(!agrees(&outcomes), "{wrong:?}");
            let table = table(&outcomes, WIDTH);
            assert_eq!(
                table.matches("FAIL").count(),
                2,
                "not once in its place and once at the end:\n{table}"
            );
            assert!(
                table.ends_with("\n1 of 2 comparisons in 1 case agree\n"),
                "{table}"
            );
            assert_eq!(
                csv_rows(&outcomes)[2].last().map(String::as_str),
                Some("false")
            );
            let page = page(&outcomes, Extent::Full);
            // Its own row, the row of its group, and the row of all groups.
            assert_eq!(page.matches("| **no** |").count(), 3, "{page}");
        }
    }

    #[test]
    fn a_trial_without_numbers_fails() {
        let no_equilibrium = || Err(Failure::NoEquilibrium);
        for (trial, name, said) in [
            (
                no_equilibrium(),
                "Case 2",
                "could not be computed: no equilibrium was found",
            ),
            (Ok(Trial::new("Empty", "")), "Empty", "compares nothing"),
        ] {
            let mut outcomes = outcomes(vec![check(0.3)]);
            outcomes[0].trials.push(trial);
            assert!(!agrees(&outcomes));
            let table = table(&outcomes, WIDTH);
            assert_eq!(
                table
                    .matches(&format!("\n{name}\n  {said}  FAIL\n"))
                    .count(),
                2,
                "{table}"
            );
            assert!(
                table.ends_with("\n1 of 1 comparison in 2 cases agree; 1 case gives no number\n"),
                "{table}"
            );
            let rows = csv_rows(&outcomes);
            assert_eq!(rows[2].concat(), format!("Made up{name}{said}false"));
            assert_eq!((&rows[2][2], rows[2].len()), (&said.to_owned(), 13));
            let page = page(&outcomes, Extent::Full);
            assert!(
                page.contains(&format!("\n### {name}\n")) && page.contains(said),
                "{page}"
            );
            assert!(
                page.contains("| all | 2 | 1 | 9.3·10⁻¹⁰ | **no** |"),
                "{page}"
            );
        }
    }

    #[test]
    fn rows_have_all_digits() {
        let rows = csv_rows(&outcomes(vec![
            check(0.3),
            bounded(1e-20, [f64::NEG_INFINITY, 0.1]),
        ]));
        assert_eq!(rows[0].len(), 13);
        let row = "|x| = 1,y_a in m,0.30000000000000004,0.29999994,0.30000006000000007,exact,0.3,1.850371707708594e-16,\
            relative,2e-7,true";
        assert_eq!(rows[1][2..].join(","), row);
        assert_eq!(
            rows[2][2..].join(","),
            "one,z,,,0.1,symmetry,1e-20,0.0,bounds,0.0,true"
        );
    }

    #[test]
    fn columns_are_aligned() {
        let long = Check {
            subject: "a subject that is much longer than its column can be, ".repeat(2),
            ..check(0.3)
        };
        let outcomes = outcomes(vec![check(0.3), long, bounded(-2.5e-12, [-1.0, 1.0])]);
        // Side by side, and with the numbers below.
        for (width, first) in [(120, "  y_a in m  "), (80, "|x| = 1: y_a in m (exact)\n")] {
            let table = table(&outcomes, width);
            let column = |text: &str| {
                let lines = table
                    .lines()
                    .filter_map(|line| line.find(text).map(|at| columns(&line[..at])));
                lines.collect::<Vec<_>>()
            };
            assert!(table.contains(first), "{table}");
            for texts in [
                ["reference", "-1 … 1"],
                ["computed", "-2.5e-12"],
                ["error", "1.9e-16"],
            ] {
                let places: Vec<_> = texts.into_iter().flat_map(column).collect();
                assert!(
                    places.len() > 1 && places.iter().all(|place| *place == places[0]),
                    "{texts:?}\n{table}"
                );
            }
            let others = table.lines().filter(|line| !line.contains("a subject"));
            assert!(others.map(columns).max() <= Some(width), "{table}");
        }
    }

    #[test]
    fn the_page_is_markdown() {
        let outcomes = outcomes(vec![check(0.3)]);
        let page = page(&outcomes, Extent::Full);
        for part in [
            "| [Made up](#made-up) | 1 | 1 |",
            "\n## Made up\n\nWhat is *not* computed.\n\n### A case\n\nThe formula:\n\n```text\n|x| = y\n```\n\n",
            "\n![A line \\[straight\\]](made_up.svg)\n",
            "| \\|x\\|\u{a0}=\u{a0}1 | y_a in m | 0.3 | exact | 0.3 | 1.9·10⁻¹⁶ | 2·10⁻⁷ rel (statics) | yes |",
        ] {
            assert!(page.contains(part), "no {part} in\n{page}");
        }
        assert_eq!(page, super::page(&outcomes, Extent::Full));
    }

    #[test]
    fn numbers_are_short_and_exact() {
        let numbers = [
            0.0,
            -0.0,
            2.0,
            -0.5,
            1.0 / 3.0,
            1e5,
            12345678.9,
            1e-4,
            -1.25e-12,
            6.02214076e23,
            f64::NAN,
        ];
        let texts = "0 0 2 -0.5 0.33333333 100000 12345679 0.0001 -1.25e-12 6.0221408e23 NaN";
        assert_eq!(numbers.map(|value| number(value, DIGITS)).join(" "), texts);
        let numbers = [1e-11, -1e-11, -1.25e-12, 3e8, -0.5, f64::INFINITY];
        assert_eq!(
            numbers.map(|value| typeset(value, 3)).join(" "),
            "10⁻¹¹ −10⁻¹¹ −1.25·10⁻¹² 3·10⁸ −0.5 ∞"
        );
        assert_eq!(number(0.09996, 2), "0.1");
    }

    #[test]
    fn names_of_tolerances_and_sources_are_unique() {
        for (index, tolerance) in tolerances::TABLE.iter().enumerate() {
            assert!(
                tolerances::TABLE[..index]
                    .iter()
                    .all(|other| other.name != tolerance.name),
                "{tolerance:?}"
            );
        }
        for (index, source) in sources::LIST.iter().enumerate() {
            assert!(
                sources::LIST[..index]
                    .iter()
                    .all(|other| other.key != source.key),
                "{source:?}"
            );
        }
    }
}
