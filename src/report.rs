//! The result files: `runs.csv` of a study, `metrics.json` and `history.csv` of one simulation; with the feature `parquet` the
//! tables as Parquet too.
//!
//! Numbers are written as text with the fewest digits that read back as the same `f64`.

use std::io::{self, Write};

use serde::Serialize;

use crate::metrics::Metrics;
use crate::parameters::Parameter;
use crate::simulation::Statistics;
use crate::simulation::{Sample, Simulation};
use crate::study::{Axis, CaseResult, DEPTH, Study, VELOCITY};
use crate::uncertainty::ForceScatter;

#[cfg(feature = "parquet")]
mod parquet;

#[cfg(feature = "parquet")]
pub use self::parquet::{write_history_parquet, write_runs_parquet};

/// Settings that stand in `runs.csv` whether swept or not, and the names of their columns.
pub(crate) const FIXED_COLUMNS: [(&str, &str); 3] =
    [("brushing_velocity_m_s", VELOCITY), ("penetration_depth_m", DEPTH), ("segments", "filament.segments")];

/// Status of a case that did not fail.
pub(crate) const OK: &str = "ok";

/// A cell of a table: its type, which is that of its column, and its value, if it has one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cell {
    Real(Option<f64>),
    Count(Option<usize>),
    Text(String),
}

impl Cell {
    /// The value of a setting.
    fn setting(parameter: &Parameter, value: f64) -> Self {
        if parameter.range.whole { Self::Count(Some(value as usize)) } else { Self::Real(Some(value)) }
    }

    /// The cell in a CSV file.
    fn into_text(self) -> String {
        match self {
            Self::Real(value) => value.map_or_else(String::new, |value| format!("{value:?}")),
            Self::Count(value) => value.map_or_else(String::new, |value| value.to_string()),
            Self::Text(text) => text,
        }
    }
}

/// A structure of numbers as columns of a table.
pub(crate) trait Columns: Sized {
    /// Names of the columns.
    const NAMES: &'static [&'static str];

    /// The cells of a structure, or those of a row that has none.
    fn cells(of: Option<&Self>) -> Vec<Cell>;

    /// The structure from the texts of its columns, by their positions; or the position of one that is wrong.
    fn parse<'t>(cell: impl Fn(usize) -> &'t str) -> Result<Self, usize>;
}

/// A number of a table; none that is not finite.
trait Number: Sized {
    fn read(text: &str) -> Option<Self>;

    fn cell(number: Option<Self>) -> Cell;
}

impl Number for f64 {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok().filter(|number: &Self| number.is_finite())
    }

    fn cell(number: Option<Self>) -> Cell {
        Cell::Real(number)
    }
}

impl Number for usize {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok()
    }

    fn cell(number: Option<Self>) -> Cell {
        Cell::Count(number)
    }
}

/// Makes a column of each field but those after `without`. A field that is not listed does not compile.
macro_rules! columns {
    ($type:ident { $($field:ident),* $(,)? } $(without { $($left_out:ident),* })?) => {
        impl Columns for $type {
            const NAMES: &'static [&'static str] = &[$(stringify!($field)),*];

            fn cells(of: Option<&Self>) -> Vec<Cell> {
                vec![$(Number::cell(of.map(|of| of.$field))),*]
            }

            fn parse<'t>(cell: impl Fn(usize) -> &'t str) -> Result<Self, usize> {
                let mut positions = 0..;
                let mut next = || positions.next().unwrap_or_default();
                Ok(Self {
                    $($field: {
                        let position = next();
                        Number::read(cell(position)).ok_or(position)?
                    },)*
                    $($($left_out: Default::default()),*)?
                })
            }
        }
    };
}

columns!(Metrics {
    contact_angle_rad,
    nominal_contact_length_m,
    nominal_contact_time_s,
    contact_time_s,
    contact_length_m,
    contact_time_ratio,
    contact_count,
    contact_normal_impulse_n_s,
    equivalent_contact_normal_force_n,
    peak_contact_normal_force_n,
    max_tip_deflection_m,
    tool_contact_normal_force_n,
});

columns!(Statistics { steps, rejected_steps, newton_iterations, newton_failures, factorisations, contact_events }
    without { chart_changes });

columns!(ForceScatter {
    tool_force_mean_n,
    tool_force_std_n,
    tool_force_lower_95_n,
    tool_force_upper_95_n,
    sobol_length,
    sobol_diameter,
    sobol_youngs_modulus,
    sobol_damping_ratio,
    sobol_filament_count,
    failed_samples,
});

columns!(Sample {
    time_s,
    base_angle_rad,
    contact_normal_force_n,
    contact_tangential_force_n,
    tip_deflection_m,
    tip_x_m,
    tip_y_m,
    tip_z_m,
    kinetic_energy_j,
    potential_energy_j,
    dissipated_energy_j,
    contact_normal_impulse_n_s,
    peak_contact_normal_force_n,
});

/// Writes `runs.csv`: a heading, then a row a case in the grid's order.
///
/// A case that failed has empty metrics and statistics, and the error's text as its status. Where filaments scatter in some
/// case, the distribution of the tool force stands between the metrics and the statistics.
pub fn write_runs(out: impl Write, study: &Study, results: &[CaseResult]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(run_columns(study))?;
    for row in run_rows(study, results) {
        writer.write_record(row.into_iter().map(Cell::into_text))?;
    }
    writer.flush()
}

/// The settings that are columns of a study's table: those that always are, then the others that are swept.
fn setting_columns(study: &Study) -> Vec<(&'static str, &'static Parameter)> {
    let fixed = FIXED_COLUMNS.iter().filter_map(|(name, path)| Some((*name, Parameter::find(path)?)));
    fixed.chain(further_parameters(study).map(|parameter| (parameter.path, parameter))).collect()
}

/// Names of the columns of a study's table.
fn run_columns(study: &Study) -> Vec<&'static str> {
    let names = setting_columns(study).into_iter().map(|(name, _)| name);
    let scatter = if study.scatters() { ForceScatter::NAMES } else { &[] };
    let figures = [Metrics::NAMES, scatter, Statistics::NAMES].into_iter().flatten().copied();
    names.chain(figures).chain(["status"]).collect()
}

/// The rows of a study's table, for the columns [`run_columns`].
fn run_rows(study: &Study, results: &[CaseResult]) -> impl Iterator<Item = Vec<Cell>> {
    let columns = setting_columns(study);
    let scatters = study.scatters();
    results.iter().enumerate().map(move |(case, result)| {
        let settings = study.settings(case);
        let mut row: Vec<Cell> =
            columns.iter().map(|(_, parameter)| Cell::setting(parameter, parameter.get(&settings))).collect();
        let summary = result.as_ref().ok();
        row.extend(Metrics::cells(summary.map(|summary| &summary.metrics)));
        if scatters {
            row.extend(ForceScatter::cells(summary.and_then(|summary| summary.scatter.as_ref())));
        }
        row.extend(Statistics::cells(summary.map(|summary| &summary.statistics)));
        row.push(Cell::Text(result.as_ref().err().map_or(OK, String::as_str).to_owned()));
        row
    })
}

/// The swept settings without a fixed column.
fn further_parameters(study: &Study) -> impl Iterator<Item = &'static Parameter> {
    let swept = study.axes().iter().map(Axis::parameter);
    swept.filter(|parameter| FIXED_COLUMNS.iter().all(|(_, path)| *path != parameter.path))
}

/// Writes `metrics.json`: one flat object, the metrics first, then the solver's statistics.
pub fn write_metrics(mut out: impl Write, simulation: &Simulation) -> io::Result<()> {
    #[derive(Serialize)]
    struct Flat<'a> {
        #[serde(flatten)]
        metrics: &'a Metrics,
        #[serde(flatten)]
        statistics: &'a Statistics,
    }
    let flat = Flat { metrics: &simulation.metrics, statistics: &simulation.statistics };
    serde_json::to_writer_pretty(&mut out, &flat)?;
    out.write_all(b"\n")
}

/// Writes `history.csv`: a heading, then a row a sample.
pub fn write_history(out: impl Write, history: &[Sample]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for sample in history {
        writer.serialize(sample)?;
    }
    writer.flush()
}
