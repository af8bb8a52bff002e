//! `report.html`: a study as one self-contained page for a browser; `brush.html`: a brush.
//!
//! A study, its results and the courses of some cases ([`course_recorder`]) go in; the text of the
//! page comes out. It contains the data as JSON, the scripts that draw them, and their style. The
//! same study gives the same bytes: the page contains neither dates nor durations.

use serde_json::{Value, json};

use crate::insight::advice::{Answer, headline};
use crate::insight::assumptions::Assumptions;
use crate::insight::findings::Finding;
use crate::insight::measured::ForceComparison;
use crate::insight::quantity::{TOOL_FORCE, main_metric};
use crate::store::method::method_of_study;
use crate::store::results::BuildOrigin;
use bristle::equations;
use bristle::model::metrics::{Metrics, SWEEPING_RATIO, UNSTABLE_AMPLIFICATION, tool_force};
use bristle::model::parameters::Parameter;
use bristle::model::record::{Column, Prominence, Record, Scale, Scope};
use bristle::model::settings::Settings;
use bristle::simulation::Statistics;
use bristle_study::grid::brush::{Having, metric_columns};
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{CaseResult, CaseSummary, ForceSensitivity, Interaction, Study, Sweep};
use bristle_study::input::measured::Measurement;
use bristle_study::input::plausibility::{Unusual, unusual_in_study};
use bristle_study::input::statement::Statement;
use bristle_study::text::shown;

mod brush;
mod calibration;
mod course;
mod measured;
mod packed;
mod removal;
mod selection;
mod settings;

pub use brush::brush_page;
pub use calibration::calibration_page;
pub use course::{CaseCourse, CourseRecorder, course_recorder};
pub use removal::removal_page;
pub use selection::{MAX_CASES_SHOWN, MAX_COURSES};

use packed::rounded;
use selection::Selection;
use settings::{settings, study_settings};

/// Templates: a document, and the body of most pages.
const DOCUMENT: &str = include_str!("document.html");
const FRAME: &str = include_str!("frame.html");
const SECTIONS: &str = include_str!("study.html");
const STYLE: &str = include_str!("style.css");
/// The scripts of the page; each builds on those before it.
const SCRIPT: &str = concat!(
    include_str!("format.js"),
    include_str!("settings.js"),
    include_str!("measured.js"),
    include_str!("grid.js"),
    include_str!("overview.js"),
    include_str!("player.js"),
    include_str!("course.js"),
    include_str!("script.js"),
);

/// Longest name of a study in its page, in characters.
const LONGEST_NAME: usize = 100;

/// Contents of the report of a study besides its results.
pub struct ReportContext<'a> {
    /// Statement of the input file besides settings.
    pub statement: &'a Statement,
    /// The build that simulated the study.
    pub origin: &'a BuildOrigin,
    /// Settings that the file leaves to their defaults.
    pub assumptions: &'a Assumptions,
    /// The answer to the goal of the file.
    pub answer: Option<&'a Answer>,
    /// The forces with which the study is compared.
    pub measured: &'a [Measurement],
    /// Findings about the results.
    pub findings: &'a [Finding],
}

/// Returns the page of a study. `results` has one result per case, in order; `comparisons` are
/// those with measured forces.
#[must_use]
pub fn page(
    study: &Study,
    results: &[CaseResult],
    courses: &[CaseCourse],
    comparisons: &[ForceComparison],
    context: &ReportContext<'_>,
) -> String {
    let name = &shown(&context.statement.title, LONGEST_NAME);
    let notes = Notes {
        unusual: &unusual_in_study(study),
        findings: context.findings,
        assumptions: context.assumptions,
    };
    let page = Page {
        title: &format!("{name}: brushing study"),
        subject: "contact of a brush filament with a workpiece",
        without_scripts: "This page draws its figures with JavaScript, which is switched off. The same numbers are in \
                          <code>runs.csv</code> in the same directory.",
        sections: SECTIONS,
        notes,
        method: &method_of_study(study, &context.origin.version),
        data: data(name, study, results, courses, comparisons, context),
        script: SCRIPT,
    };
    page.framed()
}

/// Notes on the settings of a page.
#[derive(Clone, Copy)]
pub struct Notes<'a> {
    /// Unusual settings.
    pub unusual: &'a [Unusual],
    /// Findings about the results.
    pub findings: &'a [Finding],
    /// Settings that the input file leaves to their defaults.
    pub assumptions: &'a Assumptions,
}

impl Notes<'_> {
    /// Returns the notes for the script.
    fn data(&self) -> Value {
        json!({
            "warnings": self.unusual.iter().map(|unusual| &unusual.statement).collect::<Vec<_>>(),
            "findings": self.findings,
            "assumptions": assumptions_data(self.assumptions),
        })
    }
}

/// Content of one page.
struct Page<'a> {
    /// Plain text.
    title: &'a str,
    /// Description of the subject. This and the next two are HTML.
    subject: &'static str,
    /// A note for browsers that run no scripts.
    without_scripts: &'static str,
    /// The sections before the last ones, which all pages share.
    sections: &'a str,
    notes: Notes<'a>,
    /// The method of the results, as plain text.
    method: &'a str,
    /// Data for the script besides the notes.
    data: Value,
    script: &'static str,
}

impl Page<'_> {
    /// Returns the whole page.
    fn framed(self) -> String {
        let Self {
            title,
            subject,
            without_scripts,
            sections,
            notes,
            method,
            mut data,
            script,
        } = self;
        data["notes"] = notes.data();
        let body = [
            ("subject", subject),
            ("without_scripts", without_scripts),
            ("sections", sections),
            ("method", &escape_html(method)),
            ("data", &script_data(&data)),
            ("script", script),
        ];
        document(&escape_html(title), STYLE, SCRIPTS, &fill(FRAME, &body))
    }
}

/// Part of a document's policy that allows scripts.
const SCRIPTS: &str = " script-src 'unsafe-inline';";

/// Returns the document of a body. `title` is HTML.
fn document(title: &str, style: &str, scripts: &str, body: &str) -> String {
    fill(
        DOCUMENT,
        &[
            ("title", title),
            ("style", style),
            ("scripts", scripts),
            ("body", body),
        ],
    )
}

/// Fills the places of a template, `{{name}}`, with texts. Places within these texts are not
/// filled.
fn fill(template: &str, texts: &[(&str, &str)]) -> String {
    let mut filled = String::with_capacity(
        template.len() + texts.iter().map(|(_, text)| text.len()).sum::<usize>(),
    );
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        filled.push_str(before);
        let (place, after) = after
            .split_once("}}")
            .expect("a place of the template ends");
        let (_, text) = texts
            .iter()
            .find(|(name, _)| *name == place)
            .expect("each place has its text");
        filled.push_str(text);
        rest = after;
    }
    filled + rest
}

/// Escapes text for HTML.
fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Returns the first line, and the others as items of a list, as HTML.
fn lead_and_items(lines: &[String]) -> [String; 2] {
    let (lead, others) = lines.split_first().expect("a page has a first line");
    let item = |line: &String| format!("<li>{}</li>", escape_html(line));
    [escape_html(lead), others.iter().map(item).collect()]
}

/// Returns JSON for a `<script>`. It must neither end the script nor open a comment, so `<` is
/// escaped. JSON has this character in strings only.
fn script_data(data: &Value) -> String {
    let json = serde_json::to_string(data).expect("a value of JSON can be written");
    // A page of megabytes is not copied for nothing.
    if json.contains('<') {
        json.replace('<', "\\u003c")
    } else {
        json
    }
}

/// Returns a column in all cases, for the script; `null` where a case failed or the value is
/// unknown.
fn quantity<R: Record>(
    column: &Column<R>,
    summaries: &[Option<CaseSummary>],
    record: impl Fn(&CaseSummary) -> Option<&R>,
) -> Value {
    let &Column {
        key,
        symbol,
        unit,
        name,
        meaning,
        display,
        ..
    } = column;
    let number =
        |summary: &Option<CaseSummary>| Some(rounded(column.get(record(summary.as_ref()?)?)));
    json!({
        "key": key,
        "symbol": symbol,
        "unit": unit,
        "name": name,
        "meaning": meaning,
        // `true` for one of the few main quantities of a report.
        "headline": display.prominence == Prominence::Headline,
        "logarithmic": display.scale == Scale::Logarithmic,
        // The range of its colours, if it differs from the range of its values.
        "range": display.range.map(|range| range.map(|end| end / display.factor)),
        "values": summaries.iter().map(number).collect::<Vec<_>>(),
    })
}

/// Returns `true` if some value of a [`quantity`] is known and not zero.
fn tells(quantity: &Value) -> bool {
    let values = quantity["values"].as_array();
    values
        .into_iter()
        .flatten()
        .any(|value| value.as_f64().is_some_and(|value| value != 0.0))
}

fn data(
    name: &str,
    study: &Study,
    results: &[CaseResult],
    courses: &[CaseCourse],
    comparisons: &[ForceComparison],
    context: &ReportContext<'_>,
) -> Value {
    let shown = Selection::shown(study);
    let axis = |(axis, positions): (&Sweep, &Vec<usize>)| {
        let setting = axis.setting();
        let [symbol, unit] = setting
            .parameter()
            .map_or([""; 2], |parameter| [parameter.symbol, parameter.unit]);
        let chosen = |names: &[String]| {
            positions
                .iter()
                .map(|&at| names[at].clone())
                .collect::<Vec<_>>()
        };
        json!({
            "path": setting.path(),
            "symbol": symbol,
            "name": setting.name(),
            "unit": unit,
            // The shown values; for named tools their positions, and the names.
            "values": positions.iter().map(|&at| axis.values()[at]).collect::<Vec<_>>(),
            "names": setting.names().map(chosen),
            // Their positions among all values, and the number of all values, which give the row
            // of a case in `runs.csv`.
            "positions": positions,
            "count": axis.values().len(),
        })
    };
    let axes = study.sweeps().iter().zip(&shown.positions).map(axis);
    let cases: Vec<&CaseResult> = shown.cases.iter().map(|&case| &results[case]).collect();
    let summary = |result: &&CaseResult| result.as_ref().ok().cloned();
    let summaries: Vec<Option<CaseSummary>> = cases.iter().map(summary).collect();
    let mut metrics: Vec<&Column<Metrics>> = metric_columns(Having::of_study(study)).collect();
    metrics.sort_by_key(|column| place_on_page(column));
    let metrics = metrics.into_iter().filter_map(|column| {
        let quantity = quantity(column, &summaries, |summary| Some(&summary.metrics));
        (!column.display.optional || tells(&quantity)).then_some(quantity)
    });
    let scatter = ForceScatter::COLUMNS
        .iter()
        .map(|column| quantity(column, &summaries, |summary| summary.scatter.as_ref()));
    let interaction = |column| quantity(column, &summaries, |summary| summary.brush.as_ref());
    let (headlines, others): (Vec<&Column<Interaction>>, Vec<&Column<Interaction>>) =
        Interaction::COLUMNS
            .iter()
            .filter(|_| study.has_brush())
            .partition(|column| column.display.prominence == Prominence::Headline);
    // Effects of interaction come first.
    let metrics = headlines.into_iter().map(interaction).chain(metrics);
    // Without scatter there is no band, and inputs that do not scatter have no share.
    let mut quantities: Vec<Value> = metrics
        .chain(scatter.filter(tells))
        .chain(others.into_iter().map(interaction))
        .collect();
    // The page opens with the first one.
    let first = [main_metric(study, context.statement), TOOL_FORCE];
    quantities.sort_by_key(|quantity| {
        let place = first.iter().position(|key| quantity["key"] == *key);
        place.unwrap_or(first.len())
    });
    let statistics: Vec<Value> = Statistics::COLUMNS
        .iter()
        .map(|column| quantity(column, &summaries, |summary| Some(&summary.statistics)))
        .collect();
    let uncertainties: Vec<Option<f64>> = shown
        .cases
        .iter()
        .zip(&summaries)
        .map(|(&case, summary)| Some(uncertainty(&study.settings(case), summary.as_ref()?)))
        .collect();
    let errors: Vec<(usize, &String)> = cases
        .iter()
        .enumerate()
        .filter_map(|(index, result)| Some((index, result.as_ref().err()?)))
        .collect();
    let courses: Vec<(usize, &Value)> = courses
        .iter()
        .filter_map(|course| {
            Some((
                shown.cases.binary_search(&course.case()).ok()?,
                &course.data,
            ))
        })
        .collect();
    json!({
        "name": name,
        "headline": headline(study, results),
        "answer": context.answer,
        "version": context.origin.version,
        "equations": { "sha256": context.origin.equations, "maker": equations::MAKER },
        "cases": study.case_count(),
        "failed": results.iter().filter(|result| result.is_err()).count(),
        "axes": axes.collect::<Vec<_>>(),
        "tools": study.tools().iter().map(|tool| &tool.name).collect::<Vec<_>>(),
        "settings": study_settings(study),
        "quantities": quantities,
        "brush": study.has_brush(),
        "measured": measured::measured_data(study, comparisons),
        "unstable_above": UNSTABLE_AMPLIFICATION,
        "sweeping_above": SWEEPING_RATIO,
        "force_uncertainty": uncertainties,
        "statistics": statistics,
        "errors": errors,
        "courses": courses,
    })
}

/// Returns the assumed settings, with the effect of a change of each.
fn assumptions_data(assumptions: &Assumptions) -> Value {
    let entry = |assumption: &ForceSensitivity| {
        let &ForceSensitivity {
            parameter,
            value,
            changed,
            force_change,
        } = assumption;
        let &Parameter {
            path,
            symbol,
            name,
            unit,
            ..
        } = parameter;
        json!({
            "path": path, "symbol": symbol, "name": name, "unit": unit,
            "value": value, "changed": rounded(changed), "force_change": force_change.map(rounded),
        })
    };
    let Assumptions {
        row,
        place,
        list,
        material: _,
    } = assumptions;
    let list: Vec<Value> = list.iter().map(entry).collect();
    json!({ "row": row, "place": place, "list": list, "notes": assumptions.notes() })
}

/// Returns the place of a metric on the page: the most prominent come first, with all those of the
/// tool together. A depth is shown where it is a result.
fn place_on_page(column: &Column<Metrics>) -> Prominence {
    match column.display.scope {
        _ if column.key == "penetration_depth_m" => Prominence::Headline,
        Scope::Tool if column.display.prominence == Prominence::Detail => Prominence::Figure,
        Scope::Tool => Prominence::Headline,
        Scope::Filament => column.display.prominence,
    }
}

/// Returns the uncertainty of the tool force in N, from that of the number of filaments: `ΔF_n,w =
/// p_n ΔN_f ω/(2π)`.
fn uncertainty(settings: &Settings, summary: &CaseSummary) -> f64 {
    let rate = settings.angular_velocity_rad_s();
    let impulse = summary.metrics.contact_normal_impulse_n_s;
    rounded(tool_force(
        impulse,
        settings.tool.filament_count_uncertainty,
        rate,
    ))
}

#[cfg(test)]
mod tests;
