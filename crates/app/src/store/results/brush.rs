//! Writes and reads `metrics.json`, `filaments.csv`, `history.csv` and `contacts.csv` of a brush.

use std::io::{self, Write};

use bristle::brush::{BrushResult, BrushStatistics, FilamentResult, PairResult, ToolSample};
use bristle::model::record::{Column, Display, Scalar};
use bristle::model::settings::Settings;
use serde::Serialize;

use super::tables::{Known, TableCell, cells_of, keys_of, read_rows, write_columns};
use bristle_study::grid::brush::{Having, filament_columns};
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::grid::{Interaction, turn_impulses};
use bristle_study::input::table::{AGAIN, DataError, Source};

/// Lists columns of a structure, each with its key, type, unit and described field.
macro_rules! columns {
    ($record:ty {
        $(
            $key:ident: $type:ty = $field:ident $([$index:literal])?
                => $unit:literal
        ),* $(,)?
    }) => {
        &[$(
            Column::new(
                [stringify!($key), "", $unit, "", ""],
                <$type as Scalar>::WHOLE,
                Display::DETAIL,
                |record: &$record| Scalar::into_f64(record.$field $([$index])?),
                |record: &mut $record, value| {
                    record.$field $([$index])? = Scalar::from_f64(value);
                },
            ),
        )*]
    };
}

/// The first columns of `filaments.csv`.
pub const PLACE: &[Column<FilamentResult>] = columns!(FilamentResult {
    column: usize = column => "",
    row: usize = row => "",
});

/// The columns of `filaments.csv` after the metrics.
pub const REST: &[Column<FilamentResult>] = columns!(FilamentResult {
    root_angle_rad: f64 = root_angle_rad => "rad",
    root_z_m: f64 = root_z_m => "m",
    is_counted: bool = is_counted => "",
    press_impulse_n_s: f64 = press_impulse_n_s => "N s",
});

/// The columns of `history.csv`: the tool at one time.
pub const MOMENT: &[Column<ToolSample>] = columns!(ToolSample {
    time_s: f64 = time_s => "s",
    contact_normal_force_n: f64 = contact_normal_force_n => "N",
    contact_force_x_n: f64 = contact_force_n[0] => "N",
    contact_force_y_n: f64 = contact_force_n[1] => "N",
    contact_force_z_n: f64 = contact_force_n[2] => "N",
    contact_moment_n_m: f64 = contact_moment_n_m => "N m",
    press_force_n: f64 = press_force_n => "N",
    touching_filaments: usize = touching_filaments => "",
    touching_pairs: usize = touching_pairs => "",
});

/// The columns of `contacts.csv`: a pair of filaments that touched.
pub const PAIR: &[Column<PairResult>] = columns!(PairResult {
    column: usize = filament[0] => "",
    row: usize = filament[1] => "",
    other_column: usize = other[0] => "",
    other_row: usize = other[1] => "",
    impulse_n_s: f64 = impulse_n_s => "N s",
    impulse_x_n_s: f64 = vector_impulse_n_s[0] => "N s",
    impulse_y_n_s: f64 = vector_impulse_n_s[1] => "N s",
    impulse_z_n_s: f64 = vector_impulse_n_s[2] => "N s",
    peak_force_n: f64 = peak_force_n => "N",
    contact_time_s: f64 = contact_time_s => "s",
    arc_length_m: f64 = arc_length_m => "m",
    dissipated_j: f64 = dissipated_j => "J",
});

/// Writes `metrics.json`, one flat object: speeds and metrics of the tool, [`Interaction`],
/// interval of the force after a calibration, solver statistics, impulses of all turns.
pub fn write_brush_metrics(
    mut out: impl Write,
    settings: &Settings,
    result: &BrushResult,
    band: Option<&ForceScatter>,
) -> io::Result<()> {
    #[derive(Serialize)]
    struct BrushFields<'a> {
        brushing_velocity_m_s: f64,
        rotational_speed_rpm: f64,
        #[serde(flatten)]
        metrics: Known<'a>,
        #[serde(flatten)]
        interaction: Interaction,
        #[serde(flatten)]
        band: Option<&'a ForceScatter>,
        steps: usize,
        rejected_steps: usize,
        newton_failures: usize,
        newton_iterations: usize,
        turn_contact_normal_impulses_n_s: Vec<f64>,
    }
    let BrushStatistics {
        steps,
        rejected_steps,
        newton_failures,
        effort,
    } = result.statistics;
    let (metrics, interaction) = (&result.tool, Interaction::of(result));
    let flat = BrushFields {
        brushing_velocity_m_s: settings.process.brushing_velocity_m_s,
        rotational_speed_rpm: settings.rotational_speed_rpm(),
        metrics: Known(
            metrics,
            Having {
                brush: true,
                force: true,
                edge: true,
                ..Having::of(settings)
            },
        ),
        interaction,
        band,
        steps,
        rejected_steps,
        newton_failures,
        newton_iterations: effort.newton_iterations,
        turn_contact_normal_impulses_n_s: turn_impulses(result),
    };
    serde_json::to_writer_pretty(&mut out, &flat)?;
    out.write_all(b"\n")
}

/// Reads the [`Interaction`] from `metrics.json`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_brush_metrics`] writes.
pub fn read_interaction(text: &str, name: &str) -> Result<Interaction, DataError> {
    serde_json::from_str(text).map_err(|error| Source { name, text }.json(&error))
}

/// Writes `filaments.csv`: a heading, then one row per filament.
pub fn write_filaments(out: impl Write, filaments: &[FilamentResult]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(
        [
            keys_of(PLACE.iter()),
            keys_of(filament_columns()),
            keys_of(REST.iter()),
        ]
        .concat(),
    )?;
    for filament in filaments {
        let row = [
            cells_of(PLACE.iter(), Some(filament)),
            cells_of(filament_columns(), Some(&filament.metrics)),
            cells_of(REST.iter(), Some(filament)),
        ]
        .concat();
        writer.write_record(row.into_iter().map(TableCell::into_text))?;
    }
    writer.flush()
}

/// Reads `filaments.csv`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_filaments`] writes.
pub fn read_filaments(text: &str, name: &str) -> Result<Vec<FilamentResult>, DataError> {
    let source = Source { name, text };
    let table = source.table(AGAIN)?;
    let of_filament = || PLACE.iter().chain(REST);
    let columns = table.columns(&keys_of(of_filament()))?;
    let metrics = table.columns(&keys_of(filament_columns()))?;
    let filament = |row| {
        Ok(FilamentResult {
            metrics: table.read_columns(row, &metrics, filament_columns())?,
            ..table.read_columns(row, &columns, of_filament())?
        })
    };
    table.rows().iter().map(filament).collect()
}

/// Writes `history.csv`: a heading, then one row per step.
pub fn write_brush_history(out: impl Write, history: &[ToolSample]) -> io::Result<()> {
    write_columns(out, MOMENT.iter(), history)
}

/// Reads `history.csv` of a brush. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_brush_history`] writes.
pub fn read_brush_history(text: &str, name: &str) -> Result<Vec<ToolSample>, DataError> {
    read_rows(text, name, MOMENT)
}

/// Writes `contacts.csv`: a heading, then one row per pair of filaments that touched.
pub fn write_contacts(out: impl Write, pairs: &[PairResult]) -> io::Result<()> {
    write_columns(out, PAIR.iter(), pairs)
}

/// Reads `contacts.csv`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_contacts`] writes.
pub fn read_contacts(text: &str, name: &str) -> Result<Vec<PairResult>, DataError> {
    read_rows(text, name, PAIR)
}
