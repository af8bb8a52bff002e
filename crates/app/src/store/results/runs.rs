//! Writes and reads `runs.csv` of a study.

use std::io::{self, Write};

use bristle::model::metrics::Metrics;
use bristle::model::parameters::Parameter;
use bristle::simulation::Statistics;
use bristle_study::text::shortened;

use super::saved::SavedStudy;
use super::tables::{TableCell, cells, cells_of, keys, keys_of};
use crate::store::digest::digest;
use bristle_study::grid::brush::{Having, metric_columns};
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{
    CaseResult, CaseSummary, DEPTH, Interaction, SPEED, Setting, Study, Sweep, VELOCITY,
};
use bristle_study::input::table::{AGAIN, DataError, Source, Table};

/// Settings that are always columns of `runs.csv`, and the names of these columns.
pub const FIXED_COLUMNS: [(&str, &str); 4] = [
    ("brushing_velocity_m_s", VELOCITY),
    ("penetration_depth_m", DEPTH),
    ("segments", "filament.segments"),
    ("rotational_speed_rpm", SPEED),
];

/// Key of the contact normal impulses of all turns. In a table they are one text, separated by
/// spaces.
const TURN_IMPULSES: &str = "turn_contact_normal_impulses_n_s";

/// Key of the largest relative change of a headline metric when a check repeats a case.
const CHANGE: &str = "change_when_checked";

/// Status of a case that did not fail.
const OK: &str = "ok";

/// Writes `runs.csv`: a heading, then one row per case in the order of the grid.
///
/// A failed case has empty metrics and statistics, and the error's text as its status. Some columns
/// depend on the study. Between metrics and statistics: the distribution of the tool force, if
/// filaments scatter in some case, and effects of interaction of brushes. Before the status:
/// impulses of all turns, if some case has several, and changes by checks, if some case was
/// checked.
pub fn write_runs(out: impl Write, study: &Study, results: &[CaseResult]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(run_columns(study, results))?;
    for row in run_rows(study, results) {
        writer.write_record(row.into_iter().map(TableCell::into_text))?;
    }
    writer.flush()
}

/// Returns the settings that are columns of a study's table: the fixed columns, then the other
/// axes.
fn setting_columns(study: &Study) -> Vec<(&'static str, Setting)> {
    // A depth that results from a force is a result.
    let is_setting = |path: &str| path != DEPTH || !study.is_pressed_on();
    let fixed = FIXED_COLUMNS.iter().filter(|(_, path)| is_setting(path));
    let fixed =
        fixed.filter_map(|(name, path)| Some((*name, Setting::Number(Parameter::find(path)?))));
    let is_further = |sweep: &&Sweep| FIXED_COLUMNS.iter().all(|(_, path)| *path != sweep.path());
    let further = study.sweeps().iter().filter(is_further);
    fixed
        .chain(further.map(|sweep| (sweep.path(), sweep.setting().clone())))
        .collect()
}

/// Returns the names of the columns of a study's table.
#[must_use]
pub fn run_columns(study: &Study, results: &[CaseResult]) -> Vec<&'static str> {
    let names = setting_columns(study).into_iter().map(|(name, _)| name);
    let scatter = study.scatters().then(keys::<ForceScatter>);
    let brush = study.has_brush().then(keys::<Interaction>);
    let figures = [
        keys_of(metric_columns(Having::of_study(study))),
        scatter.unwrap_or_default(),
        brush.unwrap_or_default(),
        keys::<Statistics>(),
    ]
    .into_iter()
    .flatten();
    let turns = study.takes_turns().then_some(TURN_IMPULSES);
    names
        .chain(figures)
        .chain(turns)
        .chain(are_checked(results).then_some(CHANGE))
        .chain(["status"])
        .collect()
}

fn are_checked(results: &[CaseResult]) -> bool {
    results
        .iter()
        .flatten()
        .any(|summary| summary.change_when_checked.is_some())
}

/// Returns the rows of a study's table, for the columns [`run_columns`].
pub fn run_rows(study: &Study, results: &[CaseResult]) -> impl Iterator<Item = Vec<TableCell>> {
    let columns = setting_columns(study);
    let (scatters, has_brush, takes_turns) =
        (study.scatters(), study.has_brush(), study.takes_turns());
    let having = Having::of_study(study);
    let are_checked = are_checked(results);
    results.iter().enumerate().map(move |(case, result)| {
        let mut row: Vec<TableCell> = columns
            .iter()
            .map(|(_, setting)| TableCell::setting(setting, study.value(setting, case)))
            .collect();
        let summary = result.as_ref().ok();
        row.extend(cells_of(
            metric_columns(having),
            summary.map(|summary| &summary.metrics),
        ));
        if scatters {
            row.extend(cells::<ForceScatter>(
                summary.and_then(|summary| summary.scatter.as_ref()),
            ));
        }
        if has_brush {
            row.extend(cells::<Interaction>(
                summary.and_then(|summary| summary.brush.as_ref()),
            ));
        }
        row.extend(cells::<Statistics>(
            summary.map(|summary| &summary.statistics),
        ));
        if takes_turns {
            let impulses =
                summary.map_or(&[][..], |summary| &summary.turn_contact_normal_impulses_n_s);
            let impulses: Vec<String> = impulses
                .iter()
                .map(|impulse| format!("{impulse:?}"))
                .collect();
            row.push(TableCell::Text(impulses.join(" ")));
        }
        if are_checked {
            row.push(TableCell::Real(
                summary.and_then(|summary| summary.change_when_checked),
            ));
        }
        row.push(TableCell::Text(
            result.as_ref().err().map_or(OK, String::as_str).to_owned(),
        ));
        row
    })
}

/// Reads `runs.csv` of a study, in the order of the grid. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_runs`](crate::store::results::write_runs) wrote for this study.
pub fn read_runs(text: &str, name: &str, saved: &SavedStudy) -> Result<Vec<CaseResult>, DataError> {
    let study = &saved.study;
    let source = Source { name, text };
    let table = source.table(AGAIN)?;
    let mut settings = Vec::new();
    for (position, sweep) in study.sweeps().iter().enumerate() {
        let path = sweep.path();
        let fixed = FIXED_COLUMNS.iter().find(|(_, of)| *of == path);
        settings.push((
            position,
            sweep.setting(),
            table.column(fixed.map_or(path, |(name, _)| name))?,
        ));
    }
    let having = Having::of_study(study);
    let of_metrics = || metric_columns(having);
    let metrics = table.columns(&keys_of(of_metrics()))?;
    let scatter = study
        .scatters()
        .then(|| table.columns(&keys::<ForceScatter>()))
        .transpose()?;
    let brush = study
        .has_brush()
        .then(|| table.columns(&keys::<Interaction>()))
        .transpose()?;
    let statistics = table.columns(&keys::<Statistics>())?;
    let turns = study
        .takes_turns()
        .then(|| table.column(TURN_IMPULSES))
        .transpose()?;
    let is_checked = table.headings().iter().any(|heading| heading == CHANGE);
    let change = is_checked.then(|| table.column(CHANGE)).transpose()?;
    let status = table.column("status")?;
    if table.rows().len() != study.case_count() {
        let problem = format!(
            "{} rows, but study.json has {} cases",
            table.rows().len(),
            study.case_count()
        );
        return Err(source.error(1, None, problem, AGAIN));
    }
    let mut results = Vec::with_capacity(table.rows().len());
    for (case, row) in table.rows().iter().enumerate() {
        let values: Vec<f64> = study.values(case).collect();
        for &(position, setting, column) in &settings {
            let expected = TableCell::setting(setting, values[position]).into_text();
            if row.get(column) != Some(expected.as_str()) {
                let found = row.get(column).unwrap_or_default();
                return Err(table.wrong(
                    row,
                    column,
                    format!("`{}`, but study.json has {expected}", shortened(found)),
                ));
            }
        }
        results.push(match row.get(status) {
            Some(OK) => {
                let mut metrics: Metrics = table.read_columns(row, &metrics, of_metrics())?;
                if !having.force {
                    metrics.penetration_depth_m = study.settings(case).process.penetration_depth_m;
                }
                Ok(CaseSummary {
                    turn_contact_normal_impulses_n_s: match turns {
                        Some(column) => {
                            read_turns(row.get(column).unwrap_or_default(), metrics.turns)
                                .ok_or_else(|| {
                                    table.wrong(
                                        row,
                                        column,
                                        format!("not {} numbers", metrics.turns),
                                    )
                                })?
                        }
                        None => vec![metrics.contact_normal_impulse_n_s],
                    },
                    metrics,
                    statistics: table.read::<Statistics>(row, &statistics)?,
                    scatter: match &scatter {
                        Some(columns) if row.get(columns[0]) != Some("") => {
                            Some(table.read::<ForceScatter>(row, columns)?)
                        }
                        _ => None,
                    },
                    brush: brush
                        .as_ref()
                        .map(|columns| table.read::<Interaction>(row, columns))
                        .transpose()?,
                    change_when_checked: change
                        .map_or(Ok(None), |column| read_change(&table, row, column))?,
                })
            }
            message => Err(message.unwrap_or_default().to_owned()),
        });
    }
    // The hash is checked last, because all checks above can state where the text is wrong.
    if digest(text.as_bytes()) != saved.runs {
        return Err(source.error(
            1,
            None,
            "study.json does not belong to these results",
            AGAIN,
        ));
    }
    Ok(results)
}

/// Returns the change of a case that was checked.
fn read_change(
    table: &Table<'_>,
    row: &csv::StringRecord,
    column: usize,
) -> Result<Option<f64>, DataError> {
    match row.get(column).unwrap_or_default() {
        "" => Ok(None),
        text => match text.parse() {
            Ok(change) if (0.0..=2.0).contains(&change) => Ok(Some(change)),
            _ => Err(table.wrong(
                row,
                column,
                format!("`{}` is no relative change", shortened(text)),
            )),
        },
    }
}

/// Returns the impulses of `count` turns from the text of their cell.
fn read_turns(text: &str, count: usize) -> Option<Vec<f64>> {
    let impulse = |text: &str| {
        text.parse()
            .ok()
            .filter(|impulse: &f64| impulse.is_finite())
    };
    let impulses = text.split(' ').map(impulse).collect::<Option<Vec<f64>>>()?;
    (impulses.len() == count).then_some(impulses)
}
