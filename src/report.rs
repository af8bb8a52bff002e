//! The result files: `runs.csv` of a study, `metrics.json` and `history.csv` of one simulation.
//!
//! Numbers are written with the fewest digits that read back as the same `f64`.

use std::io::{self, Write};

use serde::Serialize;

use crate::integrate::Statistics;
use crate::metrics::Metrics;
use crate::parameters::Parameter;
use crate::simulation::{Sample, Simulation};
use crate::study::{Axis, CaseResult, DEPTH, Study, VELOCITY};
use crate::uncertainty::ForceScatter;

/// Settings that stand in `runs.csv` whether swept or not, and the names of their columns.
pub(crate) const FIXED_COLUMNS: [(&str, &str); 3] =
    [("brushing_velocity_m_s", VELOCITY), ("penetration_depth_m", DEPTH), ("segments", "filament.segments")];

/// Status of a case that did not fail.
pub(crate) const OK: &str = "ok";

/// A structure of numbers as columns of a table.
pub(crate) trait Columns: Sized {
    /// Names of the columns.
    const NAMES: &'static [&'static str];

    /// Texts of the columns.
    fn cells(&self) -> Vec<String>;

    /// The structure from the texts of its columns, by their positions; or the position of one that is wrong.
    fn parse<'t>(cell: impl Fn(usize) -> &'t str) -> Result<Self, usize>;
}

/// A number of a table; none that is not finite.
trait Number: Sized {
    fn read(text: &str) -> Option<Self>;
}

impl Number for f64 {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok().filter(|number: &Self| number.is_finite())
    }
}

impl Number for usize {
    fn read(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

/// Makes a column of each field but those after `without`. A field that is not listed does not compile.
macro_rules! columns {
    ($type:ident { $($field:ident),* $(,)? } $(without { $($left_out:ident),* })?) => {
        impl Columns for $type {
            const NAMES: &'static [&'static str] = &[$(stringify!($field)),*];

            fn cells(&self) -> Vec<String> {
                let Self { $($field),* $($(, $left_out: _)*)? } = self;
                vec![$(format!("{:?}", $field)),*]
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
    let further = further_parameters(study);
    let fixed: Vec<&Parameter> = FIXED_COLUMNS.iter().filter_map(|(_, path)| Parameter::find(path)).collect();
    let scatter = if study.scatters() { ForceScatter::NAMES } else { &[] };
    let mut writer = csv::Writer::from_writer(out);
    let names = FIXED_COLUMNS.iter().map(|(name, _)| *name);
    writer.write_record(
        names
            .chain(further.iter().map(|parameter| parameter.path))
            .chain(Metrics::NAMES.iter().copied())
            .chain(scatter.iter().copied())
            .chain(Statistics::NAMES.iter().copied())
            .chain(["status"]),
    )?;
    for (case, result) in results.iter().enumerate() {
        let settings = study.settings(case);
        let mut row: Vec<String> =
            fixed.iter().chain(&further).map(|parameter| parameter.format(parameter.get(&settings))).collect();
        match result {
            Ok(summary) => {
                row.extend(summary.metrics.cells());
                match &summary.scatter {
                    Some(scatter) => row.extend(scatter.cells()),
                    None => row.extend(scatter.iter().map(|_| String::new())),
                }
                row.extend(summary.statistics.cells());
                row.push(OK.to_owned());
            }
            Err(message) => {
                let empty = Metrics::NAMES.len() + scatter.len() + Statistics::NAMES.len();
                row.extend(std::iter::repeat_n(String::new(), empty));
                row.push(message.clone());
            }
        }
        writer.write_record(&row)?;
    }
    writer.flush()
}

/// The swept settings without a fixed column.
fn further_parameters(study: &Study) -> Vec<&'static Parameter> {
    study
        .axes()
        .iter()
        .map(Axis::parameter)
        .filter(|parameter| FIXED_COLUMNS.iter().all(|(_, path)| *path != parameter.path))
        .collect()
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
