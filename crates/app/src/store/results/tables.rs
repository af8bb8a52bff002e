//! Writes and reads tables, and `metrics.json`, `history.csv`, `profile.csv` and `shapes.csv` of
//! one simulation.
//!
//! Numbers are written as text with the fewest digits that read back as the same `f64`.

use std::io::{self, Write};

use bristle::model::metrics::Metrics;
use bristle::model::record::{Column, Record};
use bristle::model::settings::Settings;
use bristle::simulation::Statistics;
use bristle::simulation::{AtPlace, ProfileCell, Sample, Shape, Simulation};
use bristle::tool::Place;
use serde::ser::Error;
use serde::{Deserialize, Serialize, Serializer};

use bristle_study::grid::Setting;
use bristle_study::grid::brush::{Having, metric_columns};
use bristle_study::grid::removal::{Removal, RemovalRow, SimulatedEdge};
use bristle_study::input::table::{AGAIN, DataError, Source};

/// A cell of a table: the type of its column, and its value, if any.
#[derive(Clone, Debug, PartialEq)]
pub enum TableCell {
    /// A real number.
    Real(Option<f64>),
    /// A count.
    Count(Option<usize>),
    /// Text.
    Text(String),
}

impl TableCell {
    pub(super) fn setting(setting: &Setting, value: f64) -> Self {
        match setting {
            Setting::Number(parameter) if parameter.range.whole => {
                Self::Count(Some(value as usize))
            }
            Setting::Number(_) => Self::Real(Some(value)),
            Setting::Tool(_) => Self::Text(setting.text(value)),
        }
    }

    /// Returns the cell as text of a CSV file.
    pub(super) fn into_text(self) -> String {
        match self {
            Self::Real(value) => value.map_or_else(String::new, |value| format!("{value:?}")),
            Self::Count(value) => value.map_or_else(String::new, |value| value.to_string()),
            Self::Text(text) => text,
        }
    }
}

/// Returns the keys of a record's columns.
#[must_use]
pub fn keys<R: Record>() -> Vec<&'static str> {
    keys_of(R::COLUMNS.iter())
}

pub(super) fn keys_of<R: 'static>(
    columns: impl Iterator<Item = &'static Column<R>>,
) -> Vec<&'static str> {
    columns.map(|column| column.key).collect()
}

/// Returns the cells of a record; empty cells if there is none.
#[must_use]
pub fn cells<R: Record>(record: Option<&R>) -> Vec<TableCell> {
    cells_of(R::COLUMNS.iter(), record)
}

/// Returns the cells of some columns of a record; empty cells if there is none.
pub(super) fn cells_of<R: 'static>(
    columns: impl Iterator<Item = &'static Column<R>>,
    record: Option<&R>,
) -> Vec<TableCell> {
    let cell = |column: &Column<R>| {
        let value = record.map(|record| column.get(record));
        if column.whole {
            TableCell::Count(value.map(|count| count as usize))
        } else {
            TableCell::Real(value)
        }
    };
    columns.map(cell).collect()
}

/// Metrics of a result, with the types of their fields.
pub(super) struct Known<'a>(pub &'a Metrics, pub Having);

impl Serialize for Known<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(metrics, having) = *self;
        let all = serde_json::to_value(metrics).map_err(S::Error::custom)?;
        serializer.collect_map(metric_columns(having).map(|column| (column.key, &all[column.key])))
    }
}

/// Writes `metrics.json`: one flat object, the speeds and the metrics first, then the solver's
/// statistics, then the impulses of all turns.
pub fn write_metrics(
    mut out: impl Write,
    settings: &Settings,
    simulation: &Simulation,
) -> io::Result<()> {
    #[derive(Serialize)]
    struct CaseFields<'a> {
        brushing_velocity_m_s: f64,
        rotational_speed_rpm: f64,
        #[serde(flatten)]
        metrics: Known<'a>,
        #[serde(flatten)]
        statistics: &'a Statistics,
        turn_contact_normal_impulses_n_s: &'a [f64],
    }
    let Simulation {
        metrics,
        statistics,
        turn_contact_normal_impulses_n_s,
        ..
    } = simulation;
    let flat = CaseFields {
        brushing_velocity_m_s: settings.process.brushing_velocity_m_s,
        rotational_speed_rpm: settings.rotational_speed_rpm(),
        metrics: Known(
            metrics,
            Having {
                brush: false,
                force: true,
                edge: true,
                ..Having::of(settings)
            },
        ),
        statistics,
        turn_contact_normal_impulses_n_s,
    };
    serde_json::to_writer_pretty(&mut out, &flat)?;
    out.write_all(b"\n")
}

/// Reads the contact normal impulses of all turns in N s from `metrics.json`. Errors use `name` for
/// the file.
///
/// # Errors
/// If the text is not what [`write_metrics`] writes.
pub fn read_turn_impulses(text: &str, name: &str) -> Result<Vec<f64>, DataError> {
    #[derive(Deserialize)]
    struct TurnImpulses {
        turn_contact_normal_impulses_n_s: Vec<f64>,
    }
    let source = Source { name, text };
    let TurnImpulses {
        turn_contact_normal_impulses_n_s,
    } = serde_json::from_str(text).map_err(|error| source.json(&error))?;
    Ok(turn_contact_normal_impulses_n_s)
}

/// Writes `history.csv`: a heading, then one row per sample.
pub fn write_history(out: impl Write, history: &[Sample]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for sample in history {
        writer.serialize(sample)?;
    }
    writer.flush()
}

bristle::record! {
    /// One row of `shapes.csv`: a node of the filament at one time.
    #[derive(Clone, Debug, Default, PartialEq)]
    struct ShapeNode {
        time_s: f64 = ["t", "s", "time", "zero at the start of the pass"],
        node: usize = ["", "", "node", "from 0 at the root to the tip"],
        x_m: f64 = ["x", "m", "position along x", ""],
        y_m: f64 = ["y", "m", "position along y", ""],
        z_m: f64 = ["z", "m", "position along z", ""],
    }
}

/// Writes `profile.csv`: a heading, then one row per cell.
pub fn write_profile(out: impl Write, profile: &[ProfileCell]) -> io::Result<()> {
    write_records(out, profile)
}

bristle::record! {
    /// The first columns of `positions.csv`.
    #[derive(Clone, Debug, Default, PartialEq)]
    struct OnTrim {
        position_m: f64 = ["s", "m", "place along the trim", "zero in its middle"],
        weight: f64 = ["", "", "weight", "the share of the tool's filaments for which this one stands"],
    }
}

/// Writes `positions.csv`: a heading, then one row per filament along the trim. Its metrics are
/// those of a tool of such filaments only.
pub fn write_positions(out: impl Write, positions: &[AtPlace]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record([keys::<OnTrim>(), keys::<Metrics>()].concat())?;
    for AtPlace {
        place: Place { s, weight },
        metrics,
    } in positions
    {
        let place = cells(Some(&OnTrim {
            position_m: *s,
            weight: *weight,
        }));
        writer.write_record(
            place
                .into_iter()
                .chain(cells(Some(metrics)))
                .map(TableCell::into_text),
        )?;
    }
    writer.flush()
}

/// Writes `shapes.csv`: a heading, then one row per node of each shape.
pub fn write_shapes(out: impl Write, shapes: &[Shape]) -> io::Result<()> {
    let rows = shapes.iter().flat_map(|shape| {
        let row = |(node, &[x_m, y_m, z_m]): (usize, &[f64; 3])| ShapeNode {
            time_s: shape.time_s,
            node,
            x_m,
            y_m,
            z_m,
        };
        shape.nodes_m.iter().enumerate().map(row)
    });
    write_records(out, &rows.collect::<Vec<_>>())
}

/// Writes a heading, then one row per record.
fn write_records<R: Record>(out: impl Write, records: &[R]) -> io::Result<()> {
    write_columns(out, R::COLUMNS.iter(), records)
}

/// Writes some columns as [`write_records`] does.
pub(super) fn write_columns<R: 'static>(
    out: impl Write,
    columns: impl Iterator<Item = &'static Column<R>> + Clone,
    records: &[R],
) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(keys_of(columns.clone()))?;
    for record in records {
        writer.write_record(
            cells_of(columns.clone(), Some(record))
                .into_iter()
                .map(TableCell::into_text),
        )?;
    }
    writer.flush()
}

/// Columns of a removal for the second edge of a chamfer.
const OF_SECOND_EDGE: [&str; 2] = ["second_edge_radius_m", "second_edge_sliding_work_j"];
/// Columns of the interval that sampled tools give.
const OF_BAND: [&str; 2] = ["edge_radius_lower_95_m", "edge_radius_upper_95_m"];

/// Returns the keys of columns that a removal lacks: of a second edge, or of an interval.
pub fn absent_from(removal: &Removal) -> impl Iterator<Item = &'static str> + Clone {
    let (chamfer, band) = (removal.angles_rad.len() > 1, removal.has_band);
    let second = OF_SECOND_EDGE.into_iter().filter(move |_| !chamfer);
    second.chain(OF_BAND.into_iter().filter(move |_| !band))
}

/// Returns the columns of a record that a removal has.
fn of_removal<R: Record>(removal: &Removal) -> impl Iterator<Item = &'static Column<R>> + Clone {
    let absent = absent_from(removal);
    R::COLUMNS
        .iter()
        .filter(move |column| !absent.clone().any(|key| key == column.key))
}

/// Writes `removal.csv`: a heading, then one row per time, without the columns that the removal
/// lacks.
pub fn write_removal_rows(out: impl Write, removal: &Removal) -> io::Result<()> {
    write_columns::<RemovalRow>(out, of_removal(removal), &removal.rows)
}

/// Writes `edge_work.csv`: a heading, then one row per simulated radius and length.
pub fn write_edge_work(out: impl Write, removal: &Removal) -> io::Result<()> {
    write_columns::<SimulatedEdge>(out, of_removal(removal), &removal.simulated)
}

/// Reads `history.csv`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_history`](crate::store::results::write_history) writes.
pub fn read_history(text: &str, name: &str) -> Result<Vec<Sample>, DataError> {
    read_records(text, name)
}

/// Reads `profile.csv`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_profile`](crate::store::results::write_profile) writes.
pub fn read_profile(text: &str, name: &str) -> Result<Vec<ProfileCell>, DataError> {
    read_records(text, name)
}

/// Reads `shapes.csv`, with positions only. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`write_shapes`](crate::store::results::write_shapes) writes.
pub fn read_shapes(text: &str, name: &str) -> Result<Vec<Shape>, DataError> {
    let rows: Vec<ShapeNode> = read_records(text, name)?;
    let shapes = rows.chunk_by(|_, next| next.node > 0).map(|nodes| Shape {
        time_s: nodes[0].time_s,
        nodes_m: nodes
            .iter()
            .map(|node| [node.x_m, node.y_m, node.z_m])
            .collect(),
        velocities_m_s: Vec::new(),
        forces: Vec::new(),
    });
    Ok(shapes.collect())
}

/// Reads the records that [`write_records`] wrote.
fn read_records<R: Record>(text: &str, name: &str) -> Result<Vec<R>, DataError> {
    read_rows(text, name, R::COLUMNS)
}

/// Reads some columns as [`read_records`] does.
pub(super) fn read_rows<R: Default>(
    text: &str,
    name: &str,
    columns: &'static [Column<R>],
) -> Result<Vec<R>, DataError> {
    let source = Source { name, text };
    let table = source.table(AGAIN)?;
    let positions = table.columns(&keys_of(columns.iter()))?;
    table
        .rows()
        .iter()
        .map(|row| table.read_columns(row, &positions, columns.iter()))
        .collect()
}
