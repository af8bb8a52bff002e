//! The tables that a study prints, made for a terminal 100 columns wide.

use crate::parameters::Parameter;
use crate::study::{Axis, CaseResult, CaseSummary, DEPTH, Study, VELOCITY};
use crate::uncertainty::{ForceScatter, INPUTS, scatters};

/// Width of the terminal.
pub(crate) const WIDTH: usize = 100;
/// Most columns of numbers that fit beside the row's heading.
const MAX_COLUMNS: usize = 12;
/// Most rows of a table.
const MAX_ROWS: usize = 20;
/// Most rows of a list.
const MAX_LISTED: usize = 40;
/// Width of a row's heading.
const ROW_HEADING: usize = 10;
/// Width of a number's column.
const CELL: usize = 7;

/// What a table shows.
#[derive(Debug)]
struct Quantity {
    symbol: &'static str,
    name: &'static str,
    /// Unit without prefix, empty for a pure number.
    unit: &'static str,
    /// What stands beside the symbol in a list.
    beside: &'static str,
    /// What stands below each other for a case in a table, and beside each other in a list, the last first.
    parts: &'static [Part],
}

/// A number of a case; none where it is not known.
type Part = fn(&CaseSummary) -> Option<f64>;

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        symbol: "ε_tc",
        name: "contact time ratio",
        unit: "",
        beside: "",
        parts: &[|summary| Some(summary.metrics.contact_time_ratio)],
    },
    Quantity {
        symbol: "p_n",
        name: "contact normal impulse of a filament",
        unit: "N s",
        beside: "",
        parts: &[|summary| Some(summary.metrics.contact_normal_impulse_n_s)],
    },
    Quantity {
        symbol: "F_n,w",
        name: "contact normal force of the tool",
        unit: "N",
        beside: "",
        parts: &[|summary| Some(summary.metrics.tool_contact_normal_force_n)],
    },
];

/// Where filaments scatter.
const BAND: Quantity = Quantity {
    symbol: "F_n,w",
    name: "upper and lower end of the band that 95 % of the tools lie in",
    unit: "N",
    beside: " of 95 %",
    parts: &[
        |summary| Some(summary.scatter.as_ref()?.tool_force_upper_95_n),
        |summary| Some(summary.scatter.as_ref()?.tool_force_lower_95_n),
    ],
};

/// A quantity in all cases, in a unit that makes its numbers readable.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    quantity: &'static Quantity,
    /// Unit with its prefix, empty for a pure number.
    unit: String,
    /// From SI to this unit.
    factor: f64,
    /// For each part, the numbers in this unit; none where they are not known.
    parts: Vec<Vec<Option<f64>>>,
    /// What stands where a number is not known, for each case.
    unknown: Vec<&'static str>,
    decimals: usize,
}

impl Column {
    fn new(quantity: &'static Quantity, results: &[CaseResult]) -> Self {
        const PREFIXES: [(&str, f64); 6] = [("M", 1e-6), ("k", 1e-3), ("", 1.0), ("m", 1e3), ("µ", 1e6), ("n", 1e9)];
        let value = |result: &CaseResult, part: Part| result.as_ref().ok().and_then(part);
        let parts = quantity.parts.iter().map(|part| results.iter().map(|result| value(result, *part)).collect());
        let mut parts: Vec<Vec<Option<f64>>> = parts.collect();
        let largest = parts.iter().flatten().flatten().copied().fold(0.0, f64::max);
        let (prefix, factor) = PREFIXES
            .into_iter()
            .filter(|(prefix, _)| prefix.is_empty() || !quantity.unit.is_empty())
            .find(|(_, factor)| largest * factor >= 1.0)
            .unwrap_or(("", 1.0));
        parts.iter_mut().flatten().flatten().for_each(|value| *value *= factor);
        let unknown = results.iter().map(|result| if result.is_err() { "failed" } else { "–" }).collect();
        let decimals = match largest * factor {
            100.0.. => 1,
            10.0.. => 2,
            _ => 3,
        };
        Self { quantity, unit: format!("{prefix}{}", quantity.unit), factor, parts, unknown, decimals }
    }

    /// The force of the tool.
    pub fn tool_forces(results: &[CaseResult]) -> Self {
        let [.., force] = &QUANTITIES;
        Self::new(force, results)
    }

    /// The unit of the numbers.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// From SI to the unit of the numbers.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// The symbol with what stands beside it, and the unit where there is one.
    fn heading(&self, beside: &str) -> String {
        let symbol = self.quantity.symbol;
        if self.unit.is_empty() { format!("{symbol}{beside}") } else { format!("{symbol}{beside} in {}", self.unit) }
    }

    /// The parts of a case.
    fn texts(&self, case: usize) -> impl Iterator<Item = String> {
        let text = |value: f64| format!("{value:.*}", self.decimals);
        self.parts.iter().map(move |values| values[case].map_or_else(|| self.unknown[case].to_owned(), text))
    }

    /// The parts of a case beside each other, in ascending order.
    fn in_one_line(&self, case: usize) -> String {
        if self.parts.iter().any(|values| values[case].is_none()) {
            return self.unknown[case].to_owned();
        }
        let parts: Vec<String> = self.texts(case).collect();
        parts.into_iter().rev().collect::<Vec<_>>().join(" … ")
    }

    /// The number of a case, the first where there are several.
    pub fn text(&self, case: usize) -> String {
        self.texts(case).next().unwrap_or_default()
    }

    /// The number of a case and a band about it, which comes in SI.
    pub fn text_with_band(&self, case: usize, band: [f64; 2]) -> String {
        let [lower, upper] = band.map(|end| format!("{:.*}", self.decimals.saturating_sub(1), end * self.factor));
        format!("{} [{lower} … {upper}]", self.text(case))
    }

    /// The number of a case and its uncertainty, which comes in SI, if it has one.
    pub fn text_with_uncertainty(&self, case: usize, uncertainty: f64) -> String {
        let text = self.text(case);
        if uncertainty == 0.0 { text } else { format!("{text} ± {:.*}", self.decimals, uncertainty * self.factor) }
    }
}

/// The results of a study for people: a table for each quantity where velocity and depth alone are swept, else a list.
///
/// Where filaments scatter, the band of the tool force is among them, and a line says what the scatter comes from.
#[must_use]
pub fn study_tables(study: &Study, results: &[CaseResult]) -> String {
    let band = study.scatters().then_some(&BAND);
    let columns: Vec<Column> = QUANTITIES.iter().chain(band).map(|quantity| Column::new(quantity, results)).collect();
    let is_grid = study.axes().iter().all(|axis| [VELOCITY, DEPTH].contains(&axis.parameter().path));
    let mut text = if is_grid {
        columns.iter().map(|column| table(study, column)).collect::<Vec<_>>().join("\n")
    } else {
        list(study, &columns)
    };
    if study.scatters() {
        text.push_str(&origin_of_scatter(study, results));
    }
    text
}

/// What the scatter of the tool force comes from, and which tools are left out.
fn origin_of_scatter(study: &Study, results: &[CaseResult]) -> String {
    let mut text = String::new();
    let known: Vec<&ForceScatter> = results.iter().flatten().filter_map(|summary| summary.scatter.as_ref()).collect();
    let varying: Vec<[f64; INPUTS.len()]> =
        known.iter().filter(|scatter| scatter.tool_force_std_n > 0.0).map(|scatter| scatter.sobol_indices()).collect();
    if !varying.is_empty() {
        let mean = |index: usize| varying.iter().map(|indices| indices[index]).sum::<f64>() / varying.len() as f64;
        let shares = INPUTS.iter().enumerate().map(|(index, input)| (input.name, mean(index)));
        let mut shares: Vec<(&str, f64)> = shares.filter(|(_, mean)| *mean > 0.0).collect();
        shares.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        let rest = 1.0 - shares.iter().map(|(_, share)| share).sum::<f64>();
        let rest = (rest >= 0.005).then_some(("not attributed to one of them", rest));
        let shares: Vec<String> =
            shares.into_iter().chain(rest).map(|(name, share)| format!("{name} {:.0} %", 100.0 * share)).collect();
        let mean = if varying.len() > 1 { " (mean over the cases)" } else { "" };
        wrap(&mut text, "", &format!("The scatter of F_n,w comes from: {}{mean}", shares.join(", ")));
    }
    let failed: usize = known.iter().map(|scatter| scatter.failed_samples).sum();
    if failed > 0 {
        text.push_str(&format!("{failed} sampled tools are left out, as their simulations failed\n"));
    }
    let without = |(case, result): &(usize, &CaseResult)| {
        result.as_ref().is_ok_and(|summary| summary.scatter.is_none()) && scatters(&study.settings(*case))
    };
    let without = results.iter().enumerate().filter(without).count();
    if without > 0 {
        let cases = if without == 1 { "case has" } else { "cases have" };
        text.push_str(&format!(
            "{without} {cases} no band, as the simulations of most of their sampled tools failed\n"
        ));
    }
    text
}

/// A quantity over velocity (to the right) and depth (upwards, as in a diagram).
fn table(study: &Study, column: &Column) -> String {
    let velocities = values_or_fixed(study, VELOCITY);
    let depths = values_or_fixed(study, DEPTH);
    let shown_velocities = spread(velocities.len(), MAX_COLUMNS);
    let shown_depths = spread(depths.len(), MAX_ROWS);

    let row = |heading: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>CELL$}")).collect();
        format!("{heading:>ROW_HEADING$} │{cells}\n")
    };
    let mut text = format!("{}: {}", column.heading(""), column.quantity.name);
    if shown_velocities.len() * shown_depths.len() < study.case_count() {
        text.push_str(" (a selection of the cases)");
    }
    text.push('\n');
    text.push_str(&row("a_e in mm", vec![" v_b in m/s".to_owned()]));
    let shown = shown_velocities.iter().map(|&index| velocities[index]);
    text.push_str(&row("", labels(shown)));
    let rule = "─".repeat(CELL * shown_velocities.len());
    text.push_str(&format!("{}┼{rule}\n", "─".repeat(ROW_HEADING + 1)));
    let depth_labels = labels(shown_depths.iter().map(|&index| depths[index] * 1e3));
    for (depth, label) in shown_depths.iter().zip(&depth_labels).rev() {
        let cells = shown_velocities.iter().map(|velocity| column.texts(depth * velocities.len() + velocity));
        let cells: Vec<Vec<String>> = cells.map(Iterator::collect).collect();
        for part in 0..column.parts.len() {
            let heading = if part == 0 { label } else { "" };
            text.push_str(&row(heading, cells.iter().map(|parts| parts[part].clone()).collect()));
        }
    }
    text
}

/// All quantities, a row a case.
fn list(study: &Study, columns: &[Column]) -> String {
    let (axis_headings, factors): (Vec<&str>, Vec<f64>) = study.axes().iter().map(axis_heading).unzip();
    let axis_headings = axis_headings.into_iter().map(str::to_owned);
    let headings = axis_headings.chain(columns.iter().map(|column| column.heading(column.quantity.beside)));
    let mut rows: Vec<Vec<String>> = vec![headings.collect()];
    let listed = study.case_count().min(MAX_LISTED);
    for case in 0..listed {
        let values = study.values(case).zip(&factors);
        let values = values.map(|(value, factor)| short(value * factor));
        let metrics = columns.iter().map(|column| column.in_one_line(case));
        rows.push(values.chain(metrics).collect());
    }
    let mut text = aligned(&rows).join("\n") + "\n";
    if listed < study.case_count() {
        text.push_str(&format!("  … and {} more cases\n", study.case_count() - listed));
    }
    text
}

/// Rows of equally many cells as lines, with each column flush right.
pub(crate) fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| row.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}")).collect();
    rows.iter().map(line).collect()
}

/// A swept setting's heading, and the factor that turns its values into the unit of the heading.
///
/// Velocity and depth go by their symbols, other settings by their keys, which contain the unit.
fn axis_heading(axis: &Axis) -> (&'static str, f64) {
    match axis.parameter().path {
        VELOCITY => ("v_b in m/s", 1.0),
        DEPTH => ("a_e in mm", 1e3),
        _ => (axis.parameter().key(), 1.0),
    }
}

/// The values of a swept setting, or the only value of one that is not swept.
fn values_or_fixed(study: &Study, path: &str) -> Vec<f64> {
    let axis = study.axes().iter().find(|axis| axis.parameter().path == path);
    match axis {
        Some(axis) => axis.values().to_vec(),
        None => Parameter::find(path).map(|parameter| parameter.get(&study.settings(0))).into_iter().collect(),
    }
}

/// At most `limit` positions of `count`, evenly spread from the first to the last.
pub(crate) fn spread(count: usize, limit: usize) -> Vec<usize> {
    if count <= limit {
        (0..count).collect()
    } else {
        (0..limit).map(|index| index * (count - 1) / (limit - 1)).collect()
    }
}

/// Swept values with equally many decimals.
pub(crate) fn labels(values: impl Iterator<Item = f64>) -> Vec<String> {
    let labels: Vec<String> = values.map(short).collect();
    let decimals = |label: &String| match label.split_once('.') {
        Some((_, decimals)) if !label.contains('e') => decimals.len(),
        _ => 0,
    };
    let most = labels.iter().map(decimals).max().unwrap_or(0);
    let with_decimals = |label: String| match label.parse::<f64>() {
        Ok(value) if !label.contains('e') => format!("{value:.most$}"),
        _ => label,
    };
    labels.into_iter().map(with_decimals).collect()
}

/// A swept value with at most four significant digits.
pub(crate) fn short(value: f64) -> String {
    let scientific = format!("{value:.3e}");
    match scientific.parse::<f64>() {
        Ok(rounded) if (1e-3..1e5).contains(&rounded.abs()) || rounded == 0.0 => rounded.to_string(),
        Ok(rounded) => format!("{rounded:e}"),
        Err(_) => scientific,
    }
}

/// Adds a text beside what begins its first line, in lines that are no longer than [`WIDTH`] if words allow.
pub(crate) fn wrap(text: &mut String, beginning: &str, words: &str) {
    let indent = beginning.chars().count();
    text.push_str(beginning);
    let mut column = indent;
    for word in words.split(' ') {
        let width = word.chars().count();
        if column > indent && column + 1 + width > WIDTH {
            text.push_str(&format!("\n{:indent$}", ""));
            column = indent;
        } else if column > indent {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += width;
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_equally_many_decimals() {
        let values = [2.5, 5.0, 0.5e-3 * 1e3, 1.0 / 3.0];
        assert_eq!(labels(values.into_iter()), ["2.5000", "5.0000", "0.5000", "0.3333"]);
        assert_eq!(labels([10.0, 1e300].into_iter()), ["10", "1e300"]);
    }

    #[test]
    fn a_selection_keeps_first_and_last() {
        assert_eq!(spread(3, 12), [0, 1, 2]);
        assert_eq!(spread(101, 5), [0, 25, 50, 75, 100]);
    }

    #[test]
    fn lines_are_wrapped_between_words() {
        let mut text = String::new();
        wrap(&mut text, "ε_tc  ", &"word ".repeat(40).trim_end().replace("word word", "word µ"));
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.iter().all(|line| line.chars().count() <= WIDTH && line.trim_end() == *line), "{text}");
        assert!(lines[0].starts_with("ε_tc  word") && lines[1].starts_with("      "), "{text}");
        assert_eq!(text.split_whitespace().count(), 41);
    }
}
