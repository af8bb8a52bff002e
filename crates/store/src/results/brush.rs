//! Writes and reads `metrics.json`, `filaments.csv`, `history.csv` and `contacts.csv` of a brush.

use std::io::{self, Write};

use bristle::brush::{BrushResult, BrushStatistics, FilamentResult, PairResult, ToolSample};
use bristle::model::settings::Settings;
use serde::Serialize;

use super::tables::{Cell, Known, cells, cells_of, keys, keys_of, read_records, write_records};
use bristle_grid::brush::{Having, filament_columns};
use bristle_grid::uncertainty::ForceScatter;
use bristle_grid::{Interaction, turn_impulses};
use bristle_input::table::{AGAIN, DataError, Source};

bristle::record! {
    /// The first columns of `filaments.csv`.
    #[derive(Clone, Debug, Default, PartialEq)]
    pub struct Position {
        column: usize = ["", "", "column", "0 meets the workpiece first"],
        row: usize = ["", "", "row", "from 0 at the least z"],
    }
}

bristle::record! {
    /// The columns of `filaments.csv` after the metrics.
    #[derive(Clone, Debug, Default, PartialEq)]
    pub struct Rest {
        root_angle_rad: f64 = ["", "rad", "angle of the root about the tool axis", "behind that of column 0"],
        root_z_m: f64 = ["", "m", "z of the root", ""],
        is_counted: bool = ["", "", "whether the metrics of the tool count it", "1 or 0"],
        press_impulse_n_s: f64 = ["", "N s", "impulse with which other filaments press on it", "without regard to direction"],
    }
}

bristle::record! {
    /// One row of `history.csv`: the tool at one time.
    #[derive(Clone, Debug, Default, PartialEq)]
    pub struct Moment {
        time_s: f64 = ["t", "s", "time", "zero at the start"],
        contact_normal_force_n: f64 = ["", "N", "contact normal force", "sum over all filaments of the sector"],
        contact_force_x_n: f64 = ["", "N", "force of the workpiece along x", ""],
        contact_force_y_n: f64 = ["", "N", "force of the workpiece along y", ""],
        contact_force_z_n: f64 = ["", "N", "force of the workpiece along z", ""],
        contact_moment_n_m: f64 = ["", "N m", "its moment about the tool axis", ""],
        press_force_n: f64 = ["", "N", "sum of the forces with which filaments press on each other", ""],
        touching_filaments: usize = ["", "", "filaments that touch the workpiece", ""],
        touching_pairs: usize = ["", "", "pairs of filaments that touch", ""],
    }
}

bristle::record! {
    /// One row of `contacts.csv`: a pair of filaments that touched.
    #[derive(Clone, Debug, Default, PartialEq)]
    pub struct Pair {
        column: usize = ["", "", "column of one filament", ""],
        row: usize = ["", "", "its row", ""],
        other_column: usize = ["", "", "column of the other", ""],
        other_row: usize = ["", "", "its row", ""],
        impulse_n_s: f64 = ["", "N s", "impulse of the normal force between them", ""],
        impulse_x_n_s: f64 = ["", "N s", "impulse of the force on the one along x", "with friction"],
        impulse_y_n_s: f64 = ["", "N s", "impulse of the force on the one along y", "with friction"],
        impulse_z_n_s: f64 = ["", "N s", "impulse of the force on the one along z", "with friction"],
        peak_force_n: f64 = ["", "N", "largest normal force", ""],
        contact_time_s: f64 = ["", "s", "time in which they touch", ""],
        arc_length_m: f64 = ["", "m", "mean distance of the contact from the roots", "weighted by the force"],
        dissipated_j: f64 = ["", "J", "work of friction and damping between them", ""],
    }
}

impl From<&FilamentResult> for Position {
    fn from(filament: &FilamentResult) -> Self {
        Self {
            column: filament.column,
            row: filament.row,
        }
    }
}

impl From<&FilamentResult> for Rest {
    fn from(filament: &FilamentResult) -> Self {
        Self {
            root_angle_rad: filament.root_angle_rad,
            root_z_m: filament.root_z_m,
            is_counted: filament.is_counted,
            press_impulse_n_s: filament.press_impulse_n_s,
        }
    }
}

impl From<&ToolSample> for Moment {
    fn from(sample: &ToolSample) -> Self {
        let [contact_force_x_n, contact_force_y_n, contact_force_z_n] = sample.contact_force_n;
        Self {
            time_s: sample.time_s,
            contact_normal_force_n: sample.contact_normal_force_n,
            contact_force_x_n,
            contact_force_y_n,
            contact_force_z_n,
            contact_moment_n_m: sample.contact_moment_n_m,
            press_force_n: sample.press_force_n,
            touching_filaments: sample.touching_filaments,
            touching_pairs: sample.touching_pairs,
        }
    }
}

impl From<Moment> for ToolSample {
    fn from(moment: Moment) -> Self {
        Self {
            time_s: moment.time_s,
            contact_normal_force_n: moment.contact_normal_force_n,
            contact_force_n: [
                moment.contact_force_x_n,
                moment.contact_force_y_n,
                moment.contact_force_z_n,
            ],
            contact_moment_n_m: moment.contact_moment_n_m,
            press_force_n: moment.press_force_n,
            touching_filaments: moment.touching_filaments,
            touching_pairs: moment.touching_pairs,
        }
    }
}

impl From<&PairResult> for Pair {
    fn from(pair: &PairResult) -> Self {
        let ([column, row], [other_column, other_row]) = (pair.filament, pair.other);
        let [impulse_x_n_s, impulse_y_n_s, impulse_z_n_s] = pair.vector_impulse_n_s;
        Self {
            column,
            row,
            other_column,
            other_row,
            impulse_n_s: pair.impulse_n_s,
            impulse_x_n_s,
            impulse_y_n_s,
            impulse_z_n_s,
            peak_force_n: pair.peak_force_n,
            contact_time_s: pair.contact_time_s,
            arc_length_m: pair.arc_length_m,
            dissipated_j: pair.dissipated_j,
        }
    }
}

impl From<Pair> for PairResult {
    fn from(pair: Pair) -> Self {
        Self {
            filament: [pair.column, pair.row],
            other: [pair.other_column, pair.other_row],
            impulse_n_s: pair.impulse_n_s,
            vector_impulse_n_s: [pair.impulse_x_n_s, pair.impulse_y_n_s, pair.impulse_z_n_s],
            peak_force_n: pair.peak_force_n,
            contact_time_s: pair.contact_time_s,
            arc_length_m: pair.arc_length_m,
            dissipated_j: pair.dissipated_j,
        }
    }
}

/// Writes `metrics.json`: one flat object, the speeds and the metrics of the tool first, then its
/// [`Interaction`] and the band that a calibration leaves its force, then the work, then the
/// impulses of all turns.
pub fn write_brush_metrics(
    mut out: impl Write,
    settings: &Settings,
    result: &BrushResult,
    band: Option<&ForceScatter>,
) -> io::Result<()> {
    #[derive(Serialize)]
    struct Flat<'a> {
        brushing_velocity_m_s: f64,
        rotational_speed_rpm: f64,
        #[serde(flatten)]
        metrics: Known<'a>,
        #[serde(flatten)]
        interaction: Interaction,
        #[serde(flatten)]
        band: Option<&'a ForceScatter>,
        steps: usize,
        halved_steps: usize,
        newton_iterations: usize,
        turn_contact_normal_impulses_n_s: Vec<f64>,
    }
    let BrushStatistics {
        steps,
        halved_steps,
        effort,
    } = result.statistics;
    let (metrics, interaction) = (&result.tool, Interaction::of(result));
    let flat = Flat {
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
        halved_steps,
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
            keys::<Position>(),
            keys_of(filament_columns()),
            keys::<Rest>(),
        ]
        .concat(),
    )?;
    for filament in filaments {
        let (place, rest) = (Position::from(filament), Rest::from(filament));
        let row = [
            cells(Some(&place)),
            cells_of(filament_columns(), Some(&filament.metrics)),
            cells(Some(&rest)),
        ]
        .concat();
        writer.write_record(row.into_iter().map(Cell::into_text))?;
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
    let places = table.columns(&keys::<Position>())?;
    let metrics = table.columns(&keys_of(filament_columns()))?;
    let rests = table.columns(&keys::<Rest>())?;
    let filament = |row| {
        let place = table.read::<Position>(row, &places)?;
        let rest = table.read::<Rest>(row, &rests)?;
        Ok(FilamentResult {
            column: place.column,
            row: place.row,
            root_angle_rad: rest.root_angle_rad,
            root_z_m: rest.root_z_m,
            is_counted: rest.is_counted,
            metrics: table.read_columns(row, &metrics, filament_columns())?,
            press_impulse_n_s: rest.press_impulse_n_s,
        })
    };
    table.rows().iter().map(filament).collect()
}

/// Writes `history.csv`: a heading, then one row per step.
pub fn write_brush_history(out: impl Write, history: &[ToolSample]) -> io::Result<()> {
    write_records(out, &history.iter().map(Moment::from).collect::<Vec<_>>())
}

/// Reads `history.csv` of a brush. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_brush_history`] writes.
pub fn read_brush_history(text: &str, name: &str) -> Result<Vec<ToolSample>, DataError> {
    Ok(read_records::<Moment>(text, name)?
        .into_iter()
        .map(ToolSample::from)
        .collect())
}

/// Writes `contacts.csv`: a heading, then one row per pair of filaments that touched.
pub fn write_contacts(out: impl Write, pairs: &[PairResult]) -> io::Result<()> {
    write_records(out, &pairs.iter().map(Pair::from).collect::<Vec<_>>())
}

/// Reads `contacts.csv`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_contacts`] writes.
pub fn read_contacts(text: &str, name: &str) -> Result<Vec<PairResult>, DataError> {
    Ok(read_records::<Pair>(text, name)?
        .into_iter()
        .map(PairResult::from)
        .collect())
}
