//! `report.html`: a study as one page that needs nothing else, to look through in a browser.
//!
//! Enter a study, its results, and the courses of some cases ([`Recorder`]); leaves the text of the page. The data stand in
//! it as JSON; `script.js` and its neighbours draw them, `style.css` says how they look. The same study gives the same
//! bytes: no date and no duration is in them.

use serde::Serialize;
use serde_json::{Value, json};

use bristle::equations;
use bristle::model::metrics::{NominalContact, tool_force};
use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::settings::Settings;
use bristle_study::study::{CaseResult, CaseSummary, Study};

mod course;
mod legend;

pub use course::{Course, MAX_COURSES, Recorder};

use legend::{QUANTITIES, Quantity, SCATTER, STATISTICS, SettingLegend};

/// The page around the data, with places for what is filled in.
const TEMPLATE: &str = include_str!("template.html");
const STYLE: &str = include_str!("style.css");
/// The program of the page, in the order in which its parts build on each other.
const SCRIPT: &str = concat!(
    include_str!("format.js"),
    include_str!("overview.js"),
    include_str!("course.js"),
    include_str!("script.js"),
);

/// Most cases whose figures are in a page; of a larger study it has a selection, so that it stays below 10 MB.
pub const MAX_CASES_SHOWN: usize = 20_000;

/// The page of a study. `name` says what the study is called, its input file for one; `results` are those of all cases in
/// their order.
#[must_use]
pub fn page(name: &str, study: &Study, results: &[CaseResult], courses: &[Course]) -> String {
    let data = data(name, study, results, courses).to_string();
    fill(
        TEMPLATE,
        &[
            ("title", &escape_html(&format!("{name}: brushing study"))),
            ("style", STYLE),
            ("data", &escape_script(&data)),
            ("script", SCRIPT),
        ],
    )
}

/// Puts texts into the places of a template, `{{name}}`. What is put in is not looked at again.
fn fill(template: &str, texts: &[(&str, &str)]) -> String {
    let mut filled = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        filled.push_str(before);
        let (place, after) = after.split_once("}}").expect("a place of the template ends");
        let (_, text) = texts.iter().find(|(name, _)| *name == place).expect("each place has its text");
        filled.push_str(text);
        rest = after;
    }
    filled + rest
}

/// Text as HTML shows it.
fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// JSON that neither ends a `<script>` nor opens a comment in it: `<` stands in strings only, where it may be escaped.
fn escape_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// A swept setting in the page.
#[derive(Serialize)]
struct AxisData {
    path: &'static str,
    symbol: &'static str,
    name: &'static str,
    unit: &'static str,
    /// The values that are shown.
    values: Vec<f64>,
    /// Their positions among all values, and how many there are: they tell a case's row in `runs.csv`.
    positions: Vec<usize>,
    count: usize,
}

/// A figure of all cases in the page.
#[derive(Serialize)]
struct QuantityData {
    key: &'static str,
    symbol: &'static str,
    unit: &'static str,
    name: &'static str,
    meaning: &'static str,
    /// None where a case failed, or the figure is not known.
    values: Vec<Option<f64>>,
}

fn figures<T>(
    quantity: &Quantity<T>,
    summaries: &[Option<CaseSummary>],
    part: impl Fn(&CaseSummary) -> Option<&T>,
) -> QuantityData {
    let &Quantity { key, symbol, unit, name, meaning, value } = quantity;
    let number = |summary: &Option<CaseSummary>| Some(rounded(value(part(summary.as_ref()?)?)));
    QuantityData { key, symbol, unit, name, meaning, values: summaries.iter().map(number).collect() }
}

fn data(name: &str, study: &Study, results: &[CaseResult], courses: &[Course]) -> Value {
    let shown = Selection::shown(study);
    let axes: Vec<AxisData> = study
        .sweeps()
        .iter()
        .zip(&shown.positions)
        .map(|(axis, positions)| {
            let SettingLegend { path, symbol, name } = legend::setting(axis.parameter().path);
            AxisData {
                path,
                symbol,
                name,
                unit: axis.parameter().unit,
                values: positions.iter().map(|&position| axis.values()[position]).collect(),
                positions: positions.clone(),
                count: axis.values().len(),
            }
        })
        .collect();
    let cases: Vec<&CaseResult> = shown.cases.iter().map(|&case| &results[case]).collect();
    let summary = |result: &&CaseResult| result.as_ref().ok().cloned();
    let summaries: Vec<Option<CaseSummary>> = cases.iter().map(summary).collect();
    let metrics = QUANTITIES.iter().map(|quantity| figures(quantity, &summaries, |summary| Some(&summary.metrics)));
    let scatter = SCATTER.iter().map(|quantity| figures(quantity, &summaries, |summary| summary.scatter.as_ref()));
    // Where nothing scatters there is no band, and inputs that do not scatter have no share.
    let tells = |quantity: &QuantityData| quantity.values.iter().flatten().any(|&value| value != 0.0);
    let quantities: Vec<QuantityData> = metrics.chain(scatter.filter(tells)).collect();
    let statistics: Vec<Value> = STATISTICS
        .iter()
        .map(|count| {
            let value = |summary: &Option<CaseSummary>| summary.as_ref().map(|s| (count.value)(&s.statistics));
            let values: Vec<Option<usize>> = summaries.iter().map(value).collect();
            json!({ "key": count.key, "name": count.name, "values": values })
        })
        .collect();
    let uncertainties: Vec<Option<f64>> = shown
        .cases
        .iter()
        .zip(&summaries)
        .map(|(&case, summary)| Some(uncertainty(&study.settings(case), summary.as_ref()?)))
        .collect();
    let errors: Vec<(usize, &String)> =
        cases.iter().enumerate().filter_map(|(index, result)| Some((index, result.as_ref().err()?))).collect();
    let courses: Vec<(usize, &Course)> =
        courses.iter().filter_map(|course| Some((shown.cases.binary_search(&course.case()).ok()?, course))).collect();
    json!({
        "name": name,
        "version": env!("CARGO_PKG_VERSION"),
        "equations": { "sha256": equations::FINGERPRINT, "maker": equations::MAKER },
        "cases": study.case_count(),
        "failed": results.iter().filter(|result| result.is_err()).count(),
        "axes": axes,
        "settings": settings(study),
        "quantities": quantities,
        "force_uncertainty": uncertainties,
        "statistics": statistics,
        "errors": errors,
        "courses": courses,
    })
}

/// Uncertainty of the tool's force in N: that of the number of filaments, to which it is proportional,
/// `ΔF_n,w = p_n ΔN_f ω/(2π)`.
fn uncertainty(settings: &Settings, summary: &CaseSummary) -> f64 {
    let rate = NominalContact::of(settings).rate();
    let impulse = summary.metrics.contact_normal_impulse_n_s;
    rounded(tool_force(impulse, settings.tool.filament_count_uncertainty, rate))
}

/// All settings of the study, those that are swept without a value.
fn settings(study: &Study) -> Vec<Value> {
    let base = study.settings(0);
    let scalars = PARAMETERS.iter().map(|parameter: &Parameter| {
        let swept = study.sweeps().iter().any(|axis| std::ptr::eq(axis.parameter(), parameter));
        (parameter.path, parameter.unit, if swept { Value::Null } else { json!(parameter.get(&base)) })
    });
    let others = [
        ("tool.kind", "", json!(base.tool.kind)),
        ("workpiece.kind", "", json!(base.workpiece.kind)),
        ("workpiece.normal", "", json!(base.workpiece.normal)),
        ("process.gravity_m_s2", "m/s²", json!(base.process.gravity_m_s2)),
        ("uncertainty.hold", "", json!(base.uncertainty.hold)),
    ];
    let mut settings: Vec<_> = others.into_iter().chain(scalars).collect();
    settings.sort_by_key(|(path, ..)| legend::place(path));
    settings
        .into_iter()
        .map(|(path, unit, value)| {
            let SettingLegend { symbol, name, .. } = legend::setting(path);
            json!({ "path": path, "symbol": symbol, "name": name, "unit": unit, "value": value })
        })
        .collect()
}

/// Six significant digits: one more than the page shows.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Some cases of a study, on a grid of their own.
#[derive(Debug)]
struct Selection {
    /// For each axis, the positions of its values that are taken.
    positions: Vec<Vec<usize>>,
    /// The cases, in their order.
    cases: Vec<usize>,
}

impl Selection {
    /// The cases that the page shows.
    fn shown(study: &Study) -> Self {
        let all = study.sweeps().iter().map(|axis| (0..axis.values().len()).collect()).collect();
        Self::on(study, thinned(all, MAX_CASES_SHOWN))
    }

    /// Of these, the cases whose courses it shows.
    fn with_course(study: &Study) -> Self {
        Self::on(study, thinned(Self::shown(study).positions, MAX_COURSES))
    }

    fn on(study: &Study, positions: Vec<Vec<usize>>) -> Self {
        let mut cases = vec![0];
        for (positions, axis) in positions.iter().zip(study.sweeps()) {
            let count = axis.values().len();
            cases =
                cases.iter().flat_map(|case| positions.iter().map(move |position| case * count + position)).collect();
        }
        Self { positions, cases }
    }
}

/// Evenly spread entries of each list, so that there are at most `limit` combinations: the longest lists lose entries.
fn thinned(lists: Vec<Vec<usize>>, limit: usize) -> Vec<Vec<usize>> {
    let mut lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
    while lengths.iter().product::<usize>() > limit.max(1) {
        *lengths.iter_mut().max().expect("a product above one has a factor") -= 1;
    }
    let thin = |(list, length): (Vec<usize>, usize)| spread(list.len(), length).map(|index| list[index]).collect();
    lists.into_iter().zip(lengths).map(thin).collect()
}

/// `taken` of `count` indices, evenly spread from the first to the last; the middle one if it is one.
fn spread(count: usize, taken: usize) -> impl Iterator<Item = usize> {
    (0..taken).map(move |i| if taken == 1 { (count - 1) / 2 } else { i * (count - 1) / (taken - 1) })
}

#[cfg(test)]
mod tests;
