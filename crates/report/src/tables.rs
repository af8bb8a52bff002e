//! The tables that a study prints, made for a terminal 100 columns wide.

use bristle::brush::{BrushResult, Stretch};
use bristle::model::metrics::Metrics;
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use bristle_study::assumptions::Assumptions;
use bristle_study::differences::{Difference, tool_differences};
use bristle_study::slices::spread;
use bristle_study::stability::is_unstable;
use bristle_study::study::{CaseResult, CaseSummary, DEPTH, SPEED, Setting, Study, Sweep, TOOL, VELOCITY};
use bristle_study::text::layout::{WIDTH, aligned, wrap};
use bristle_study::text::number::{labels, short};
use bristle_study::text::quantity::{Quantity, Readable};
use bristle_study::uncertainty::{ForceScatter, INPUTS, scatters};

/// Largest number of columns that fit next to the row's heading.
const MAX_COLUMNS: usize = 12;
/// Largest number of rows in a table.
const MAX_ROWS: usize = 20;
/// Largest number of rows in a list.
const MAX_LISTED: usize = 40;
/// Largest number of tools in a table.
const MAX_TOOLS: usize = 8;
/// Width of a row's heading.
const ROW_HEADING: usize = 10;
/// Width of a number's column.
const CELL: usize = 7;
/// Follows the numbers of laterally unstable cases.
const UNSTABLE: &str = "!";

/// The results of a study for people: a table for each quantity if only velocity and depth are swept, with the tools below each other if
/// there are several; otherwise a list.
///
/// Where filaments scatter, the band of the tool force is one of the quantities, and a line states the origin of the scatter.
#[must_use]
pub fn study_tables(study: &Study, results: &[CaseResult]) -> String {
    let band = study.scatters().then(Quantity::band);
    let interaction = study.has_brush().then(Quantity::interaction).into_iter().flatten();
    let columns: Vec<Readable> = Quantity::headlines(results)
        .chain(band)
        .chain(interaction)
        .map(|quantity| Readable::new(quantity, results))
        .collect();
    let marks = Marks::new(results);
    // A setting that follows from others and has one value is no column.
    let is_fixed = |sweep: &Sweep| {
        let follows = sweep.setting().parameter().is_some_and(|parameter| !parameter.instead_of.is_empty());
        follows && sweep.values().len() == 1
    };
    let is_of_grid = |sweep: &Sweep| [VELOCITY, SPEED, DEPTH, TOOL].contains(&sweep.path());
    let is_grid = study.sweeps().iter().all(|sweep| is_of_grid(sweep) || is_fixed(sweep));
    let has_one_case_each = study.case_count() == study.tools().len();
    let mut text = if is_grid && !has_one_case_each {
        columns.iter().map(|column| table(study, column, &marks)).collect::<Vec<_>>().join("\n")
    } else {
        list(study, &columns, &marks)
    };
    if marks.are_shown {
        text.push_str(&format!("{UNSTABLE} laterally unstable\n"));
    }
    if study.scatters() {
        text.push_str(&origin_of_scatter(study, results));
    }
    text
}

/// The marks of laterally unstable cases.
struct Marks {
    unstable: Vec<bool>,
    are_shown: bool,
}

impl Marks {
    fn new(results: &[CaseResult]) -> Self {
        let unstable: Vec<bool> = results.iter().map(is_unstable).collect();
        Self { are_shown: unstable.contains(&true), unstable }
    }

    /// What follows a number of a case; empty if no case has a mark.
    fn of(&self, case: usize) -> &'static str {
        match (self.are_shown, self.unstable[case]) {
            (false, _) => "",
            (true, false) => " ",
            (true, true) => UNSTABLE,
        }
    }
}

/// The origin of the tool force's scatter, and the number of tools left out.
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
        let rest = (rest >= 0.005).then_some(("not attributed to one input", rest));
        let shares: Vec<String> =
            shares.into_iter().chain(rest).map(|(name, share)| format!("{name} {:.0} %", 100.0 * share)).collect();
        let mean = if varying.len() > 1 { " (mean over the cases)" } else { "" };
        wrap(&mut text, "", &format!("The scatter of F_n,w comes from: {}{mean}", shares.join(", ")));
    }
    let failed: usize = known.iter().map(|scatter| scatter.failed_samples).sum();
    if failed > 0 {
        text.push_str(&format!("{failed} sampled tools are left out because their simulations failed\n"));
    }
    let without = |(case, result): &(usize, &CaseResult)| {
        result.as_ref().is_ok_and(|summary| summary.scatter.is_none()) && scatters(&study.settings(*case))
    };
    let without = results.iter().enumerate().filter(without).count();
    if without > 0 {
        let cases = if without == 1 { "case has" } else { "cases have" };
        text.push_str(&format!("{without} {cases} no band because the simulations of most sampled tools failed\n"));
    }
    text
}

/// The metrics of one contact, and below them the settings that have their defaults, for a terminal 80 columns wide.
#[must_use]
pub fn contact_table(settings: &Settings, metrics: &Metrics, assumptions: &Assumptions) -> String {
    let results = [Ok(CaseSummary { metrics: metrics.clone(), ..CaseSummary::default() })];
    let speeds = [VELOCITY, SPEED, DEPTH].into_iter().filter_map(Parameter::find);
    let speeds = speeds.map(|parameter| {
        let setting = Setting::Number(parameter);
        let number = short(setting.factor() * parameter.get(settings));
        vec![setting.heading(), number, parameter.name.to_owned()]
    });
    let headlines = Quantity::headlines(&results).map(|quantity| {
        let readable = Readable::new(quantity.clone(), &results);
        vec![readable.heading(""), readable.text(0), quantity.name.to_owned()]
    });
    let rows: Vec<Vec<String>> = speeds.chain(headlines).collect();
    // Names begin at the left.
    let longest = rows.iter().map(|row| row[2].chars().count()).max().unwrap_or(0);
    let padded: Vec<Vec<String>> =
        rows.into_iter().map(|row| vec![row[0].clone(), row[1].clone(), format!("{:longest$}", row[2])]).collect();
    let lines: Vec<String> = aligned(&padded).iter().map(|line| line.trim_end().to_owned()).collect();
    let table = lines.join("\n");
    if assumptions.list.is_empty() { table } else { format!("{table}\n\n{}", assumptions.text()) }
}

/// A brush compared with one filament alone, for a terminal 80 columns wide.
#[must_use]
pub fn brush_table(result: &BrushResult) -> String {
    let [brush, alone] = [&result.tool, &result.alone]
        .map(|metrics| Ok(CaseSummary { metrics: metrics.clone(), ..CaseSummary::default() }));
    let results = [brush, alone];
    let mut rows = vec![["", "brush", "alone"].map(str::to_owned).to_vec()];
    for quantity in Quantity::headlines(&results) {
        let readable = Readable::new(quantity, &results);
        rows.push(vec![readable.heading(""), readable.text(0), readable.text(1)]);
    }
    let BrushResult { columns, rows: count, stretch, interaction_factor, .. } = result;
    let Stretch { first, last, scatter, drift, change_with_more_columns } = stretch;
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let mut text = format!("{columns} columns in {count} {}; {first} to {last} count\n", plural(*count, "row"));
    text.push_str(&aligned(&rows).join("\n"));
    text.push_str(&format!(
        "\n  interaction factor {interaction_factor:.3}\n  p_n: scatter {}, drift {}, with 25 % more columns {}\n",
        percent(*scatter),
        percent(*drift),
        percent(*change_with_more_columns),
    ));
    text
}

/// A word, as a plural unless there is one.
fn plural(count: usize, word: &str) -> String {
    if count == 1 { word.to_owned() } else { format!("{word}s") }
}

/// The settings in which the named tools of a study differ, with a column for each tool.
#[must_use]
pub fn tools_table(study: &Study) -> String {
    let differences = tool_differences(study);
    if differences.is_empty() {
        return "The tools differ in nothing but their names.\n".to_owned();
    }
    let longest = differences.iter().map(|each| each.label.chars().count()).max().unwrap_or(0);
    let names = study.tools().iter().map(|tool| tool.name.clone());
    let heading = std::iter::once(format!("{:longest$}", "tool")).chain(names).collect();
    let row = |Difference { label, values, .. }: Difference| {
        std::iter::once(format!("{label:longest$}")).chain(values).collect()
    };
    let rows: Vec<Vec<String>> = std::iter::once(heading).chain(differences.into_iter().map(row)).collect();
    let blocks = blocks(&rows, 1);
    blocks.iter().map(|rows| aligned(rows).join("\n") + "\n").collect::<Vec<_>>().join("\n")
}

/// A quantity over velocity or rotational speed (to the right) and depth (upwards, as in a diagram).
fn table(study: &Study, column: &Readable, marks: &Marks) -> String {
    let velocities = values_or_fixed(study, study.speed().path);
    let depths = values_or_fixed(study, DEPTH);
    let shown_velocities = spread(velocities.len(), MAX_COLUMNS);
    let shown_depths = spread(depths.len(), MAX_ROWS);

    let row = |heading: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>CELL$}")).collect();
        format!("{heading:>ROW_HEADING$} │{cells}\n")
    };
    let mut text = match column.quantity.symbol {
        "" => column.quantity.name.to_owned(),
        _ => format!("{}: {}", column.heading(""), column.quantity.name),
    };
    let tools = study.tools().len().max(1);
    let shown_tools = spread(tools, MAX_TOOLS);
    if shown_velocities.len() * shown_depths.len() * shown_tools.len() < study.case_count() {
        text.push_str(" (a selection of the cases)");
    }
    text.push('\n');
    text.push_str(&row("a_e in mm", vec![format!(" {}", Setting::Number(study.speed()).heading())]));
    let shown = shown_velocities.iter().map(|&index| velocities[index]);
    let space = if marks.are_shown { " " } else { "" };
    text.push_str(row("", labels(shown).into_iter().map(|label| label + space).collect()).trim_end());
    text.push('\n');
    let rule = "─".repeat(CELL * shown_velocities.len());
    text.push_str(&format!("{}┼{rule}\n", "─".repeat(ROW_HEADING + 1)));
    let depth_labels = labels(shown_depths.iter().map(|&index| depths[index] * 1e3));
    let rows =
        shown_tools.iter().flat_map(|tool| shown_depths.iter().zip(&depth_labels).rev().map(move |row| (tool, row)));
    for (tool, (depth, label)) in rows {
        let first = tool * (study.case_count() / tools);
        if let Some(tool) = study.tool(first).filter(|_| Some(depth) == shown_depths.last()) {
            text.push_str(&format!(" {}\n", tool.name));
        }
        let cases = shown_velocities.iter().map(|velocity| first + depth * velocities.len() + velocity);
        let cells = cases.map(|case| column.texts(case).map(|text| text + marks.of(case)).collect());
        let cells: Vec<Vec<String>> = cells.collect();
        for part in 0..column.part_count() {
            let heading = if part == 0 { label } else { "" };
            text.push_str(row(heading, cells.iter().map(|parts| parts[part].clone()).collect()).trim_end());
            text.push('\n');
        }
    }
    text
}

/// All quantities, one row per case.
fn list(study: &Study, columns: &[Readable], marks: &Marks) -> String {
    let sweep_headings = study.sweeps().iter().map(|sweep| sweep.setting().heading());
    let headings = sweep_headings.chain(columns.iter().map(|column| column.heading(column.quantity.qualifier)));
    let heading_of_marks = marks.are_shown.then(String::new);
    let mut rows: Vec<Vec<String>> = vec![heading_of_marks.into_iter().chain(headings).collect()];
    let listed = study.case_count().min(MAX_LISTED);
    for case in 0..listed {
        let values = study.sweeps().iter().zip(study.values(case));
        let values = values.map(|(sweep, value)| match sweep.setting().names() {
            Some(_) => sweep.setting().text(value),
            None => short(value * sweep.setting().factor()),
        });
        let metrics = columns.iter().map(|column| column.in_one_line(case));
        let mark = marks.are_shown.then(|| marks.of(case).to_owned());
        rows.push(mark.into_iter().chain(values).chain(metrics).collect());
    }
    let repeated = rows[0].len() - columns.len();
    let blocks = blocks(&rows, repeated);
    let blocks: Vec<String> = blocks.iter().map(|rows| aligned(rows).join("\n") + "\n").collect();
    let mut text = blocks.join("\n");
    if listed < study.case_count() {
        text.push_str(&format!("  … and {} more cases\n", study.case_count() - listed));
    }
    text
}

/// The rows in blocks of columns that fit into the width of a terminal, each with the first `repeated` columns.
fn blocks(rows: &[Vec<String>], repeated: usize) -> Vec<Vec<Vec<String>>> {
    let width = |column: usize| 2 + rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let first: usize = (0..repeated).map(width).sum();
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let mut taken = WIDTH;
    for column in repeated..rows[0].len() {
        if taken + width(column) > WIDTH {
            blocks.push((0..repeated).collect());
            taken = first;
        }
        taken += width(column);
        blocks.last_mut().expect("the first column begins a block").push(column);
    }
    let of = |columns: &Vec<usize>| -> Vec<Vec<String>> {
        rows.iter().map(|row| columns.iter().map(|&column| row[column].clone()).collect()).collect()
    };
    blocks.iter().map(of).collect()
}

/// The values of a swept setting, or the only value of one that is not swept.
fn values_or_fixed(study: &Study, path: &str) -> Vec<f64> {
    match study.sweep(path) {
        Some(sweep) => sweep.values().to_vec(),
        None => Parameter::find(path).map(|parameter| parameter.get(&study.settings(0))).into_iter().collect(),
    }
}
