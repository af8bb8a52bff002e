//! Text of a convergence.

use std::iter;

use crate::insight::convergence::{Convergence, GOAL, Series, force, judged};
use crate::insight::quantity::{CaseQuantity, Readable};
use bristle_study::grid::CaseResult;
use bristle_study::text::layout::{aligned, wrap};
use bristle_study::text::number::{rounded, short};

/// Returns a table and a sentence per setting, and at the end the values to choose. Lines have at
/// most `width` columns if cells allow it.
#[must_use]
pub fn convergence_text(convergence: &Convergence, width: usize) -> String {
    let goal = convergence.goal_of_each();
    let mut text = String::new();
    for series in &convergence.series {
        text.push_str(&table(series));
        wrap(width, &mut text, "", &sentence(series, goal));
        text.push('\n');
    }
    text.push_str(&judged_table(convergence));
    wrap(width, &mut text, "", &touching_nodes(convergence));
    text.push('\n');
    let stated = match convergence.stated_error(force()) {
        Some(error) if error <= GOAL => format!("As stated, F_n,w is good to {}.", percent(error)),
        Some(error) => format!("As stated, F_n,w may be off by {}.", percent(error)),
        None => "How good F_n,w is as stated is not known.".to_owned(),
    };
    let choices = convergence.series.iter().zip(convergence.choices());
    let options: Option<Vec<String>> = choices
        .map(|(series, choice)| {
            Some(format!(
                "--set {}={}",
                series.parameter.path,
                value_text(choice?)
            ))
        })
        .collect();
    let choice = match options {
        Some(options) => format!("For {}: {}. ", percent(GOAL), options.join(" ")),
        None => String::new(),
    };
    wrap(width, &mut text, "", &format!("{choice}{stated}"));
    text
}

/// Returns a share in per cent, with two digits.
fn percent(part: f64) -> String {
    format!("{} %", short(rounded(100.0 * part, 2)))
}

/// Returns a value as text, with powers of ten in one form.
fn value_text(value: f64) -> String {
    if value < 0.1 {
        format!("{value:e}")
    } else {
        short(value)
    }
}

/// Returns the impulse and the force of each value as a table.
fn table(series: &Series) -> String {
    let results: &[CaseResult] = &series.results;
    let impulses = CaseQuantity::headlines(results).find(|quantity| quantity.symbol == "p_n");
    let columns: Vec<Readable> = impulses
        .map(|impulse| Readable::new(impulse, results))
        .into_iter()
        .chain(iter::once(Readable::tool_forces(results)))
        .collect();
    let headings = columns.iter().map(|column| column.heading(""));
    let heading = iter::once(series.setting().heading()).chain(headings);
    let mut rows: Vec<Vec<String>> = vec![
        heading
            .chain(["change", "steps", ""].map(str::to_owned))
            .collect(),
    ];
    for (index, (&value, result)) in series.values.iter().zip(results).enumerate() {
        let change = match series.change(index) {
            None => "–".to_owned(),
            Some(_) if index == series.finest() => "finest".to_owned(),
            Some(change) => signed(100.0 * change),
        };
        let steps = result.as_ref().map_or_else(
            |_| "–".to_owned(),
            |summary| summary.statistics.steps.to_string(),
        );
        let mark = if value == series.stated {
            "as stated"
        } else {
            ""
        };
        let cells = columns.iter().map(|column| column.text(index));
        let row = iter::once(value_text(value)).chain(cells);
        rows.push(row.chain([change, steps, mark.to_owned()]).collect());
    }
    aligned(&rows)
        .iter()
        .map(|line| format!("{}\n", line.trim_end()))
        .collect()
}

/// Returns a table of the metrics that a paper reports: as stated, their limit with finer segments,
/// and the sum of their errors as stated.
fn judged_table(convergence: &Convergence) -> String {
    let heading = ["", "as stated", "limit", "error"].map(str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![heading.to_vec()];
    let Some(series) = convergence.series.first() else {
        return String::new();
    };
    for metric in judged() {
        let (unit, factor) = match metric.display.unit {
            "" => (metric.unit, 1.0),
            unit => (unit, metric.display.factor),
        };
        let heading = match unit {
            "" => metric.symbol.to_owned(),
            unit => format!("{} in {unit}", metric.symbol),
        };
        let number = |value: f64| short(factor * value);
        let unknown = || "–".to_owned();
        rows.push(vec![
            heading,
            series
                .value(metric, series.stated())
                .map_or_else(unknown, number),
            number(series.limit(metric).value),
            convergence
                .stated_error(metric)
                .map_or_else(unknown, percent),
        ]);
    }
    aligned(&rows)
        .iter()
        .map(|line| format!("{}\n", line.trim_end()))
        .collect()
}

/// Returns a sentence on the nodes that touched with the stated settings.
fn touching_nodes(convergence: &Convergence) -> String {
    let stated = convergence.series.first();
    let stated = stated.and_then(|series| series.summary(series.stated()));
    let nodes = stated.map_or(0, |summary| summary.metrics.contact_nodes);
    match (nodes, convergence.settings.filament.segments) {
        (0, _) => "As stated, no node touched a face.".to_owned(),
        (1, _) => "As stated, only the tip touched.".to_owned(),
        (nodes, segments) => format!("As stated, the outer {nodes} of {segments} nodes touched."),
    }
}

/// Returns a change in per cent, with its sign and at least two digits.
fn signed(change: f64) -> String {
    if change == 0.0 {
        return "0 %".to_owned();
    }
    let size = change.abs();
    let digits = if size >= 0.01 {
        format!("{size:.2}")
    } else {
        format!("{size:.0e}")
    };
    format!("{}{digits} %", if change < 0.0 { "−" } else { "+" })
}

/// Returns the conclusion from the values of a setting.
fn sentence(series: &Series, goal: f64) -> String {
    let equation = |value: f64| {
        let setting = series.setting();
        format!(
            "{} = {} {}",
            setting.symbol(),
            value_text(value),
            setting.unit()
        )
        .trim_end()
        .to_owned()
    };
    let limit = series.limit(force());
    let finest = series.values[series.finest()];
    let against = match limit.order {
        Some(order) => format!(
            "F_n,w tends to {} N: the finest four agree on an error that falls with the power {order:.1} of a segment’s length. ",
            force_text(limit.value)
        ),
        None => series.changing_nodes().map_or_else(String::new, |nodes| {
            let counts: Vec<String> = nodes.iter().map(usize::to_string).collect();
            format!(
                "The outer {} nodes touched with the finest values: their number changes, so that nothing is extrapolated. ",
                counts.join(", ")
            )
        }),
    };
    let enough = match series.enough(goal) {
        Some(value) => format!("{} is enough for {}", equation(value), percent(goal)),
        None => format!(
            "No value up to {} is known to be enough for {}",
            equation(finest),
            percent(goal)
        ),
    };
    let stated = match series.stated_error(force()) {
        Some(error) => format!(
            "; {}, as stated, is off by {}.",
            equation(series.stated),
            percent(error)
        ),
        None => "; the finest value is the stated one, whose error is not known.".to_owned(),
    };
    let further = match (
        series.enough(goal),
        series.parameter.check(finest * 2.0).is_ok(),
    ) {
        (None, true) => format!(
            " Ask again with --set {}={}.",
            series.parameter.path,
            value_text(finest)
        ),
        _ => String::new(),
    };
    format!("{against}{enough}{stated}{further}")
}

/// Returns a force with at least four digits, as the changes of interest are small.
fn force_text(force: f64) -> String {
    if force.abs() >= 1000.0 {
        format!("{force:.0}")
    } else {
        short(force)
    }
}
