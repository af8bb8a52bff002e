//! The tables that commands print, for a terminal of some width in columns.

use crate::insight::assumptions::Assumptions;
use crate::insight::differences::{Difference, tool_differences};
use crate::insight::findings::is_unstable;
use crate::insight::quantity::{CaseQuantity, Readable, shown_metrics};
use crate::insight::slices::spread;
use crate::report::scatter::origin_of_scatter;
use bristle::brush::{BrushResult, Stretch};
use bristle::model::metrics::Metrics;
use bristle::model::parameters::Parameter;
use bristle::model::record::Prominence;
use bristle::model::settings::Settings;
use bristle_study::grid::check::Change;
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{
    CaseResult, CaseSummary, DEPTH, SPEED, Setting, Study, Sweep, TOOL, VELOCITY,
};
use bristle_study::text::columns;
use bristle_study::text::layout::{aligned, blocks, left, right, wrap};
use bristle_study::text::number::{labels, short, significant};

/// Number of columns that a table shows even if the terminal is too narrow, then in several parts.
const COLUMNS: usize = 12;
/// Largest number of lines of the main table.
const MAIN_LINES: usize = 24;
/// Largest number of rows in a table.
const MAX_ROWS: usize = 20;
/// Largest number of rows in a list.
const MAX_LISTED: usize = 40;
/// Largest number of tools in a table.
const MAX_TOOLS: usize = 8;
/// Width of a row's heading.
const ROW_HEADING: usize = 10;
/// Least width of a number's column.
const CELL: usize = 7;
/// Follows the numbers of laterally unstable cases.
const UNSTABLE: &str = "!";

/// Returns the results of a study for people, in lines of at most `width` columns. If only velocity
/// and depth vary, each quantity has a table, with several tools below each other. Other studies
/// have a list. Swept settings with one value in all cases stand above. Where forces are given in
/// place of depths, the resulting depths are one of the quantities.
///
/// Where filaments scatter, the band of the tool force is one of the quantities. A line states the
/// origin of the scatter.
///
/// With the key of a `main` metric, tables have this quantity only. The text is then cut to the
/// lines that fit on a screen.
#[must_use]
pub fn study_tables(
    study: &Study,
    results: &[CaseResult],
    main: Option<&str>,
    width: usize,
) -> String {
    let text = all_tables(study, results, main, width);
    let count = text.lines().count();
    if main.is_none() || count <= MAIN_LINES {
        return text;
    }
    let shown: Vec<&str> = text.lines().take(MAIN_LINES - 1).collect();
    let rest = count - shown.len();
    format!(
        "{}\n… {rest} more lines with --tables all\n",
        shown.join("\n")
    )
}

fn all_tables(study: &Study, results: &[CaseResult], main: Option<&str>, width: usize) -> String {
    let is_of_grid = |sweep: &Sweep| [study.speed().path, DEPTH].contains(&sweep.path());
    let (of_grid, others): (Vec<&Sweep>, Vec<&Sweep>) = varying(study)
        .map(|(_, sweep)| sweep)
        .partition(|sweep| is_of_grid(sweep));
    let is_grid = of_grid.len() == 2 && others.iter().all(|sweep| sweep.path() == TOOL);
    let band = study.scatters().then(CaseQuantity::band);
    let interaction = study
        .has_brush()
        .then(CaseQuantity::interaction)
        .into_iter()
        .flatten();
    let quantities: Vec<Readable> = CaseQuantity::headlines(results)
        .filter(|quantity| !is_grid || main.is_none_or(|main| quantity.is(main)))
        .chain(band)
        .chain(interaction.filter(|_| !is_grid || main.is_none()))
        .map(|quantity| Readable::new(quantity, results))
        .collect();
    let marks = Marks::new(results);
    let mut text = of_all_cases(study, width);
    if is_grid {
        let tables = quantities
            .iter()
            .map(|quantity| table(study, quantity, &marks, width));
        text.push_str(&tables.collect::<Vec<_>>().join("\n"));
    } else {
        text.push_str(&list(study, &quantities, &marks, width));
    }
    if marks.are_shown {
        text.push_str(&format!("{UNSTABLE} laterally unstable\n"));
    }
    if study.scatters() {
        text.push_str(&origin_of_scatter(study, results, width));
    }
    text
}

/// Returns the swept settings with several values, and their positions among all swept settings.
fn varying(study: &Study) -> impl Iterator<Item = (usize, &Sweep)> {
    study
        .sweeps()
        .iter()
        .enumerate()
        .filter(|(_, sweep)| sweep.values().len() > 1)
}

/// Returns the swept settings with one value as text, without derived ones; empty if there are
/// none.
fn of_all_cases(study: &Study, width: usize) -> String {
    let fixed = study
        .sweeps()
        .iter()
        .filter(|sweep| sweep.values().len() == 1);
    let follows = |sweep: &&Sweep| {
        let of_others = sweep
            .setting()
            .parameter()
            .is_some_and(|parameter| !parameter.instead_of.is_empty());
        of_others && sweep.path() != study.speed().path
    };
    let stated = fixed.filter(|sweep| !follows(sweep));
    let values: Vec<String> = stated
        .map(|sweep| sweep.setting().equation(sweep.values()[0]))
        .collect();
    let mut text = String::new();
    if !values.is_empty() {
        let cases = if study.case_count() == 1 {
            ""
        } else {
            " in all cases"
        };
        wrap(
            width,
            &mut text,
            "",
            &format!("{}{cases}", values.join(", ")),
        );
        text.push('\n');
    }
    text
}

/// Marks of laterally unstable cases.
struct Marks {
    unstable: Vec<bool>,
    are_shown: bool,
}

impl Marks {
    fn new(results: &[CaseResult]) -> Self {
        let unstable: Vec<bool> = results.iter().map(is_unstable).collect();
        Self {
            are_shown: unstable.contains(&true),
            unstable,
        }
    }

    /// Returns the mark behind a number of a case; empty if no case has a mark.
    fn of(&self, case: usize) -> &'static str {
        match (self.are_shown, self.unstable[case]) {
            (false, _) => "",
            (true, false) => " ",
            (true, true) => UNSTABLE,
        }
    }
}

/// Returns a line with the band of a brush's force that a calibration leaves.
#[must_use]
pub fn band_line(band: &ForceScatter) -> String {
    let [lower, upper] = band.band().map(significant);
    format!("95 % band of F_n,w by the calibration: {lower} to {upper} N\n")
}

/// Returns a result of which only the metrics are known.
fn result_of(metrics: &Metrics) -> CaseResult {
    Ok(CaseSummary {
        metrics: metrics.clone(),
        ..CaseSummary::default()
    })
}

/// Returns the metrics of one contact, and below them the settings that have their defaults, in
/// lines of at most `width` columns.
#[must_use]
pub fn contact_table(
    settings: &Settings,
    metrics: &Metrics,
    assumptions: &Assumptions,
    width: usize,
) -> String {
    let results = [result_of(metrics)];
    // A depth that was found for a force is one of the metrics.
    let stated = (metrics.force_stiffness_n_m == 0.0).then_some(DEPTH);
    let speeds = [VELOCITY, SPEED]
        .into_iter()
        .chain(stated)
        .filter_map(Parameter::find);
    let speeds = speeds.map(|parameter| {
        let setting = Setting::Number(parameter);
        let number = short(setting.factor() * parameter.get(settings));
        vec![setting.heading(), number, parameter.name.to_owned()]
    });
    let headlines = CaseQuantity::headlines(&results).map(|quantity| {
        let readable = Readable::new(quantity.clone(), &results);
        vec![
            readable.heading(""),
            readable.text(0),
            quantity.name.to_owned(),
        ]
    });
    let rows: Vec<Vec<String>> = speeds.chain(headlines).collect();
    // Names begin at the left.
    let longest = rows.iter().map(|row| columns(&row[2])).max().unwrap_or(0);
    let padded: Vec<Vec<String>> = rows
        .into_iter()
        .map(|row| vec![row[0].clone(), row[1].clone(), left(&row[2], longest)])
        .collect();
    let lines: Vec<String> = aligned(&padded)
        .iter()
        .map(|line| line.trim_end().to_owned())
        .collect();
    let table = lines.join("\n");
    if assumptions.list.is_empty() {
        table
    } else {
        format!("{table}\n\n{}", assumptions.text(width))
    }
}

/// Returns the metrics of a result beside those of a more precise one. `again` names the latter.
#[must_use]
pub fn check_table(again: &str, metrics: &Metrics, checked: &Metrics) -> String {
    let results = [metrics, checked].map(result_of);
    let mut rows = vec![
        ["checked", "before", again, "change"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for (column, quantity) in
        shown_metrics(Prominence::Headline, &results).zip(CaseQuantity::headlines(&results))
    {
        let change = Change::of(column, metrics, checked).relative_change;
        let readable = Readable::new(quantity, &results);
        let change = format!("{:.4} %", 100.0 * change);
        rows.push(vec![
            readable.heading(""),
            readable.text(0),
            readable.text(1),
            change,
        ]);
    }
    aligned(&rows).join("\n") + "\n"
}

/// Returns a brush compared with one filament alone, in lines of less than 80 columns.
#[must_use]
pub fn brush_table(result: &BrushResult) -> String {
    let results = [&result.tool, &result.alone].map(result_of);
    let mut rows = vec![["", "brush", "alone"].map(str::to_owned).to_vec()];
    // Metrics that a brush does not have are zero, and left out where the first column says so.
    for quantity in CaseQuantity::headlines(&results[..1]) {
        let readable = Readable::new(quantity, &results);
        rows.push(vec![
            readable.heading(""),
            readable.text(0),
            readable.text(1),
        ]);
    }
    let BrushResult {
        columns: across,
        rows: count,
        stretch,
        interaction_factor,
        impulse_error_estimate,
        residuals,
        ..
    } = result;
    let Stretch { first, last, .. } = stretch;
    let (columns, rows_in_words) = (plural(*across, "column"), plural(*count, "row"));
    let mut text =
        format!("{across} {columns} in {count} {rows_in_words}; {first} to {last} count\n");
    text.push_str(&aligned(&rows).join("\n"));
    text.push_str(&format!(
        "\n  interaction factor {interaction_factor:.3}\n  p_n ± {:.2} %; energy to {:.1e}, momentum to {:.1e}\n",
        100.0 * impulse_error_estimate,
        residuals.energy,
        residuals.momentum,
    ));
    text
}

/// Returns a word, in the plural unless the count is one.
fn plural(count: usize, word: &str) -> String {
    if count == 1 {
        word.to_owned()
    } else {
        format!("{word}s")
    }
}

/// Returns the settings in which the named tools of a study differ, with a column for each tool, in
/// lines of at most `width` columns.
#[must_use]
pub fn tools_table(study: &Study, width: usize) -> String {
    let differences = tool_differences(study);
    if differences.is_empty() {
        return "The tools differ in nothing but their names.\n".to_owned();
    }
    let longest = differences
        .iter()
        .map(|each| columns(&each.label))
        .max()
        .unwrap_or(0);
    let names = study.tools().iter().map(|tool| tool.name.clone());
    let heading = std::iter::once(left("tool", longest))
        .chain(names)
        .collect();
    let row = |Difference { label, values, .. }: Difference| {
        std::iter::once(left(&label, longest))
            .chain(values)
            .collect()
    };
    let rows: Vec<Vec<String>> = std::iter::once(heading)
        .chain(differences.into_iter().map(row))
        .collect();
    let blocks = blocks(&rows, 1, width);
    blocks
        .iter()
        .map(|rows| aligned(rows).join("\n") + "\n")
        .collect::<Vec<_>>()
        .join("\n")
}

/// A row of a table: the name of the tool above its first one, its heading, and its cells with
/// their parts.
struct TableRow {
    tool: Option<String>,
    heading: String,
    cells: Vec<Vec<String>>,
}

/// Returns a quantity over velocity or rotational speed (to the right) and depth (upwards, as in a
/// diagram), tool by tool. If the terminal is too narrow, the table has parts with equal numbers of
/// columns.
fn table(study: &Study, column: &Readable, marks: &Marks, width: usize) -> String {
    let [velocities, depths] =
        [study.speed().path, DEPTH].map(|path| study.sweep(path).map_or(&[][..], Sweep::values));
    let tools = study.tools().len().max(1);
    let room = width.saturating_sub(ROW_HEADING + 2);
    let shown_velocities = spread(velocities.len(), COLUMNS.max(room / CELL));
    let shown_depths = spread(depths.len(), MAX_ROWS);
    let shown_tools = spread(tools, MAX_TOOLS);

    let title = match column.quantity.symbol {
        "" => column.quantity.name.to_owned(),
        _ => format!("{}: {}", column.heading(""), column.quantity.name),
    };
    let is_selection =
        shown_velocities.len() * shown_depths.len() * shown_tools.len() < study.case_count();
    let selection = if is_selection {
        " (a selection of the cases)"
    } else {
        ""
    };
    let mut text = String::new();
    wrap(width, &mut text, "", &format!("{title}{selection}"));

    let space = if marks.are_shown { " " } else { "" };
    let headings: Vec<String> = labels(shown_velocities.iter().map(|&index| velocities[index]));
    let headings: Vec<String> = headings.into_iter().map(|label| label + space).collect();
    let depth_labels = labels(shown_depths.iter().map(|&index| depths[index] * 1e3));
    let row = |(tool, (depth, label)): (&usize, (&usize, &String))| {
        let first = tool * (study.case_count() / tools);
        let cases = shown_velocities
            .iter()
            .map(|velocity| first + depth * velocities.len() + velocity);
        let cells = cases
            .map(|case| {
                column
                    .texts(case)
                    .map(|text| text + marks.of(case))
                    .collect()
            })
            .collect();
        let tool = study
            .tool(first)
            .filter(|_| Some(depth) == shown_depths.last())
            .map(|tool| tool.name.clone());
        TableRow {
            tool,
            heading: label.clone(),
            cells,
        }
    };
    // The largest depth is at the top.
    let of_tool = |tool| {
        shown_depths
            .iter()
            .zip(&depth_labels)
            .rev()
            .map(move |depth| (tool, depth))
    };
    let rows: Vec<TableRow> = shown_tools.iter().flat_map(of_tool).map(row).collect();
    let texts = rows
        .iter()
        .flat_map(|row| &row.cells)
        .flatten()
        .chain(&headings);
    let cell = texts
        .map(|text| columns(text) + 1)
        .max()
        .unwrap_or(0)
        .max(CELL);
    let parts = headings.len().div_ceil((room / cell).max(1));
    let in_part = headings.len().div_ceil(parts);
    let line = |heading: &str, cells: &mut dyn Iterator<Item = &String>| {
        let cells: String = cells.map(|text| right(text, cell)).collect();
        format!("{} │{cells}", right(heading, ROW_HEADING))
            .trim_end()
            .to_owned()
            + "\n"
    };
    for first in (0..headings.len()).step_by(in_part) {
        let shown = first..headings.len().min(first + in_part);
        let gap = if first == 0 { "" } else { "\n" };
        let speed = Setting::Number(study.speed()).heading();
        text.push_str(&format!(
            "{gap}{} │ {speed}\n",
            right("a_e in mm", ROW_HEADING)
        ));
        text.push_str(&line("", &mut headings[shown.clone()].iter()));
        text.push_str(&format!(
            "{}┼{}\n",
            "─".repeat(ROW_HEADING + 1),
            "─".repeat(cell * shown.len())
        ));
        for TableRow {
            tool,
            heading,
            cells,
        } in &rows
        {
            tool.iter()
                .for_each(|name| text.push_str(&format!(" {name}\n")));
            for part in 0..column.part_count() {
                let heading = if part == 0 { heading } else { "" };
                text.push_str(&line(
                    heading,
                    &mut cells[shown.clone()].iter().map(|parts| &parts[part]),
                ));
            }
        }
    }
    text
}

/// Returns all quantities, one row per case, below two rows with symbols and units. Columns that do
/// not fit stand in further lists, which repeat the settings that vary. If these take more than
/// half of the terminal, the lists repeat the numbers of the rows.
fn list(study: &Study, quantities: &[Readable], marks: &Marks, width: usize) -> String {
    let (positions, sweeps): (Vec<usize>, Vec<&Sweep>) = varying(study).unzip();
    let settings: Vec<&Setting> = sweeps.iter().map(|sweep| sweep.setting()).collect();
    let heading = |of_setting: fn(&Setting) -> String, of_quantity: fn(&Readable) -> String| {
        let sweeps = settings.iter().map(|setting| of_setting(setting));
        sweeps
            .chain(quantities.iter().map(of_quantity))
            .collect::<Vec<_>>()
    };
    let symbols = heading(
        |setting| setting.symbol().into_owned(),
        |quantity| quantity.symbol(quantity.quantity.qualifier),
    );
    let units = heading(
        |setting| setting.unit().to_owned(),
        |quantity| quantity.unit().to_owned(),
    );
    let listed = study.case_count().min(MAX_LISTED);
    let row = |case: usize| {
        let values: Vec<f64> = study.values(case).collect();
        let values =
            positions
                .iter()
                .zip(&settings)
                .map(|(&position, setting)| match setting.names() {
                    Some(_) => setting.text(values[position]),
                    None => short(values[position] * setting.factor()),
                });
        values
            .chain(quantities.iter().map(|column| column.in_one_line(case)))
            .collect::<Vec<_>>()
    };
    let mut rows: Vec<Vec<String>> = [symbols, units]
        .into_iter()
        .chain((0..listed).map(row))
        .collect();
    let widest = |column: usize| {
        rows.iter()
            .map(|row| columns(&row[column]) + 2)
            .max()
            .unwrap_or(0)
    };
    let of_sweeps: usize = (0..settings.len()).map(widest).sum();
    let is_narrow = (0..rows[0].len()).map(widest).sum::<usize>() <= width;
    let mut repeated = settings.len();
    let mut number = |heading: [&str; 2], of_case: &dyn Fn(usize) -> String| {
        let cells = heading
            .map(str::to_owned)
            .into_iter()
            .chain((0..listed).map(of_case));
        rows.iter_mut()
            .zip(cells)
            .for_each(|(row, cell)| row.insert(0, cell));
    };
    if !is_narrow && of_sweeps > width / 2 {
        number(["row", ""], &|case| (case + 1).to_string());
        repeated = 1;
    }
    if marks.are_shown {
        number(["", ""], &|case| marks.of(case).to_owned());
        repeated += 1;
    }
    let blocks = blocks(&rows, repeated, width);
    let lines = |rows: &Vec<Vec<String>>| -> String {
        let lines = aligned(rows)
            .into_iter()
            .map(|line| format!("{}\n", line.trim_end()));
        // Settings may have no units of their own.
        lines.filter(|line| line != "\n").collect()
    };
    let mut text = blocks.iter().map(lines).collect::<Vec<_>>().join("\n");
    if listed < study.case_count() {
        text.push_str(&format!(
            "  … and {} more cases\n",
            study.case_count() - listed
        ));
    }
    let legend = quantities.iter().map(|each| {
        format!(
            "{}: {}",
            each.symbol(each.quantity.qualifier),
            each.quantity.name
        )
    });
    wrap(
        width,
        &mut text,
        "  ",
        &legend.collect::<Vec<_>>().join("; "),
    );
    text
}
