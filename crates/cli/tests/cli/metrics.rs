//! One table of metrics: each of its readers shows its content, so a new metric is one entry and
//! its computation.

use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Needs, Prominence, Record, Scope};
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::quantity::TOOL_FORCE;
use bristle_app::report::drawing::format::Format;
use bristle_app::report::figures::study_figures;
use bristle_app::report::page::{ReportContext, page};
use bristle_app::report::tables::study_tables;
use bristle_app::store::results::{BuildOrigin, run_columns};
use bristle_study::grid::brush::{Having, metric_columns};
use bristle_study::grid::{CaseResult, Interaction, Study, run_study};
use bristle_study::input::statement::Statement;
use bristle_study::text::capitalised;
use bristle_study::text::layout::{WIDTH, wrap};

use crate::program::{self, Workspace, brush, documented, is_derived, page_data};

const FILE: &str = concat!(
    brush!(4, "filament_count_uncertainty = 600\n"),
    "
[solver]
relative_tolerance = 1e-3

[process]
brushing_velocity_m_s = 20.0
penetration_depth_m = 1.0e-3

[study]
brushing_velocity_m_s = [10.0, 20.0]
penetration_depth_m = [1.0e-3, 2.0e-3]
"
);

fn keys<'a>(columns: impl IntoIterator<Item = &'a Column<Metrics>>) -> Vec<&'static str> {
    columns.into_iter().map(|column| column.key).collect()
}

fn at_least(
    study: &Study,
    prominence: Prominence,
) -> impl Iterator<Item = &'static Column<Metrics>> {
    metric_columns(Having::of_study(study))
        .filter(move |column| column.display.prominence <= prominence)
}

#[test]
fn every_reader_shows_every_metric() {
    let study = program::study(FILE);
    let results = run_study(&study, None, || {}).expect("threads");
    let having = Having::of_study(&study);
    let all = keys(metric_columns(having));

    // runs.csv, and with it Parquet, results read back and the journal's JSON.
    let columns = run_columns(&study, &[]);
    assert_eq!(columns[4..4 + all.len()], all);

    // metrics.json.
    let directory = Workspace::with(FILE);
    directory.run("simulate case.toml --out one");
    let metrics = directory.json("one/metrics.json");
    let of_force = keys(metric_columns(Having {
        force: true,
        edge: true,
        ..having
    }));
    assert!(
        of_force.iter().all(|key| metrics.get(key).is_some()),
        "{metrics}"
    );
    // Metrics that need unknown coefficients are absent.
    assert!(
        metrics.get("removal_rate_m3_s").is_none() && !all.contains(&"wear_ratio"),
        "{metrics}"
    );

    // The page, the force first, then the most prominent metrics.
    let context = ReportContext {
        statement: &Statement::default(),
        origin: &BuildOrigin::here(),
        assumptions: &Assumptions::default(),
        answer: None,
        measured: &[],
        findings: &[],
    };
    let data = page_data(&page(&study, &results, &[], &[], &context));
    let quantities = data["quantities"].as_array().expect("quantities");
    let mut prominent: Vec<&Column<Metrics>> = metric_columns(having)
        .filter(|column| is_shown(column, &results))
        .collect();
    // Metrics of the tool are together.
    prominent.sort_by_key(|column| match column.display.scope {
        Scope::Tool => Prominence::Headline,
        Scope::Filament => column.display.prominence,
    });
    prominent.sort_by_key(|column| column.key != TOOL_FORCE);
    assert!(
        quantities.len() == prominent.len() && prominent.len() < all.len(),
        "{prominent:?}"
    );
    for (quantity, column) in quantities.iter().zip(prominent) {
        let said = ["key", "symbol", "unit", "name", "meaning"]
            .map(|part| quantity[part].as_str().expect(part));
        assert_eq!(
            said,
            [
                column.key,
                column.symbol,
                column.unit,
                column.name,
                column.meaning
            ]
        );
        assert!(
            !column.name.is_empty() && !column.meaning.is_empty(),
            "{}",
            column.key
        );
    }

    // A map for each metric of the figures, a table for each headline.
    let without_edge = shown(&study, &results);

    // With friction on an edge there are all figures but the force along z, which is absent for an
    // upright tool.
    let edge = "[contact]\nfriction_coefficient = 0.3\n[workpiece]\nkind = \"edge\"\nedge_radius_m = 2e-4\n[process]";
    let study = program::study(&FILE.replace("[process]", edge));
    let results = run_study(&study, None, || {}).expect("threads");
    let all = [Prominence::Figure, Prominence::Headline].map(|prominence| {
        at_least(&study, prominence)
            .filter(|column| column.key != "tool_lateral_force_n")
            .count()
    });
    let stable = results
        .iter()
        .flatten()
        .all(|summary| !summary.metrics.laterally_unstable);
    let all = all.map(|count| count - usize::from(stable));
    assert!(
        shown(&study, &results) == all && without_edge < all,
        "{without_edge:?}, {all:?}"
    );
}

/// Returns `true` if pages show a metric.
fn is_shown(column: &Column<Metrics>, results: &[CaseResult]) -> bool {
    let mut values = results
        .iter()
        .flatten()
        .map(|summary| column.get(&summary.metrics));
    !column.display.optional || values.any(|value| value != 0.0)
}

/// Expects a map and a table for each metric that has one and is not zero in all cases.
/// Amplifications count only if some case is unstable. Returns the numbers of maps and tables.
fn shown(study: &Study, results: &[CaseResult]) -> [usize; 2] {
    let unstable = results
        .iter()
        .flatten()
        .any(|summary| summary.metrics.lateral_amplification > 100.0);
    let is_shown = |column: &&'static Column<Metrics>| {
        is_shown(column, results) && (unstable || column.key != "lateral_amplification")
    };
    let pictures = study_figures(study, results, &[], &Format::default()).pictures;
    let maps: Vec<&str> = pictures
        .iter()
        .filter_map(|picture| picture.name.strip_suffix("_map"))
        .collect();
    let drawn: Vec<&str> = at_least(study, Prominence::Figure)
        .filter(is_shown)
        .map(|column| column.display.file_name)
        .collect();
    assert_eq!(maps, drawn);
    let tables = study_tables(study, results, None, WIDTH);
    let titles: Vec<&str> = tables
        .lines()
        .filter(|line| line.starts_with(char::is_alphabetic))
        .map(|title| title.split_once(": ").map_or(title, |(_, name)| name))
        .collect();
    let headlines: Vec<&str> = at_least(study, Prominence::Headline)
        .filter(is_shown)
        .map(|column| column.name)
        .collect();
    assert_eq!(titles, headlines);
    [drawn.len(), headlines.len()]
}

#[test]
fn the_documents_list_every_metric() {
    let rows = Metrics::COLUMNS
        .iter()
        .map(documented)
        .collect::<Vec<_>>()
        .join("\n");
    is_derived(
        "docs/results.md",
        [
            "| column | symbol | unit | meaning |\n|---|---|---|---|\n",
            "\n\n",
        ],
        &rows,
    );
}

/// Lines of `python/bristle/_metrics.py` before and after the derived ones.
const OF_BOTH: [&str; 2] = [
    "    \"\"\"n_w, rotational speed of the tool, in rpm.\"\"\"\n",
    "\n    turn_contact_normal_impulses_n_s:",
];
const OF_ONE_FILAMENT: [&str; 2] = ["metrics that a brush does not have.\"\"\"\n", "\n\nclass "];

#[test]
fn python_has_every_metric() {
    const FILE: &str = "python/bristle/_metrics.py";
    // A brush has some residuals with the same names.
    let of_one = |column: &&Column<Metrics>| {
        column.display.needs == Needs::OneFilament
            && Interaction::COLUMNS
                .iter()
                .all(|other| other.key != column.key)
    };
    let (alone, both): (Vec<&Column<Metrics>>, Vec<&Column<Metrics>>) =
        Metrics::COLUMNS.iter().partition(of_one);
    is_derived(FILE, OF_BOTH, &typed(&both));
    is_derived(FILE, OF_ONE_FILAMENT, &typed(&alone));
}

/// Returns the fields of a Python class with these metrics.
fn typed(columns: &[&Column<Metrics>]) -> String {
    let default = serde_json::to_value(Metrics::default()).expect("metrics are JSON");
    // Files have these metrics whether or not the settings give them a value.
    let always = keys(metric_columns(Having {
        force: true,
        edge: true,
        ..Having::default()
    }));
    let mut text = String::new();
    for &&Column {
        key,
        symbol,
        unit,
        name,
        meaning,
        whole,
        ..
    } in columns
    {
        let is_flag = default[key].is_boolean();
        let kind = ["float", "int", "bool"][usize::from(whole) + usize::from(is_flag)];
        let kind = if always.contains(&key) {
            kind.to_owned()
        } else {
            format!("NotRequired[{kind}]")
        };
        let condition = meaning
            .strip_prefix("1 if ")
            .and_then(|rest| rest.strip_suffix(", else 0"));
        let meaning = if is_flag {
            format!("whether {}", condition.expect("1 if …, else 0"))
        } else {
            meaning.to_owned()
        };
        let symbol = if symbol.is_empty() {
            String::new()
        } else {
            format!(", {symbol}")
        };
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" in {unit}")
        };
        let words = format!(
            "\"\"\"{}{symbol}{unit}: {meaning}.\"\"\"",
            capitalised(name)
        );
        text.push_str(&format!("\n    {key}: {kind}\n"));
        wrap(88, &mut text, "    ", &words);
    }
    text
}
