//! Tables of measured forces, and of edge radii over time, as laboratories export them, and in the
//! form in which results keep them.
//!
//! Separator and decimal comma are recognised from the text unless the input file states them.
//! Columns are found by the names that the input file gives, in units that their headings or the
//! input file state.

mod columns;
mod places;
mod points;
#[cfg(test)]
mod tests;

use crate::grid::TOOL;
use crate::input::cells::number;
use crate::input::table::{DataError, Source};
use crate::text::shortened;

pub use crate::input::columns::{ColumnName, LARGEST, Quantity, TableFormat};
pub use points::{Brushed, MeasuredPoint, MeasuredRadius, Measurement, Reading, Speed, same};

use columns::{TableColumn, Wanted, column, opened};
use places::Places;

/// Advice about a table that cannot be used.
const ADVICE: &str = "the table has one row of headings, then one row per point, with columns for\n     velocity or rotational speed, depth \
    and force. Unless the headings are keys such as\n     force_n, the input file names them with their units, by lines like these under\n     \
    [measured], where separator = \";\" and decimal = \",\" can be stated, too:\n\n     columns.rotational_speed_rpm = \"n [1/min]\"\n     \
    columns.penetration_depth_m = \"ae [mm]\"\n     columns.force_n = { column = \"Fz\", unit = \"kN\" }";

/// Advice about a table of radii that cannot be used.
const ADVICE_ON_RADII: &str = "the table has one row of headings, then one row per radius in the order of their times, with columns for time or turns, \
    radius and\n     its standard deviation. Unless the headings are keys such as edge_radius_m, the input file names them with their units, by lines \
    like these\n     under [measured], where separator = \";\" and decimal = \",\" can be stated, too:\n\n     columns.time_s = \"t [min]\"\n     \
    columns.edge_radius_m = \"R [µm]\"\n     columns.edge_radius_std_m = { column = \"s\", unit = \"µm\" }";

/// Reads the normal forces of a table, written in a `format`. Errors use `name` for the table.
///
/// # Errors
/// If a column is missing, or has a unit that is not known; a cell is not an allowed number; a
/// point occurs twice; or there is no point.
pub fn read_measured(
    text: &str,
    name: &str,
    format: &TableFormat,
) -> Result<Vec<Measurement>, DataError> {
    let points = read(text, name, format, Wanted::NormalForce)?;
    Ok(points
        .iter()
        .filter_map(MeasuredPoint::measurement)
        .collect())
}

/// Reads all that a table has of [`Quantity::FORCES`]. A cell may be empty if another one of the
/// row is not.
///
/// # Errors
/// As [`read_measured`].
pub fn read_points(
    text: &str,
    name: &str,
    format: &TableFormat,
) -> Result<Vec<MeasuredPoint>, DataError> {
    read(text, name, format, Wanted::Anything)
}

/// Reads the radii of an edge over time.
///
/// # Errors
/// As [`read_measured`], and if a time is not later than the one before.
pub fn read_radii(
    text: &str,
    name: &str,
    format: &TableFormat,
) -> Result<Vec<MeasuredRadius>, DataError> {
    let source = Source {
        name,
        text: text.trim_start_matches('\u{feff}'),
    };
    let (table, columns, has_comma) = opened(&source, format, Wanted::Radii)?;
    let mut radii = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for row in table.rows() {
        let mut numbers = [None; 3];
        for (number, column) in numbers.iter_mut().zip(&columns) {
            *number = column.number(&table, row, has_comma, column.quantity.is_std())?;
        }
        let [Some(brushed), Some(value), std] = numbers else {
            continue;
        };
        if brushed <= last {
            let problem = "this is not after the row above: state the rows in the order of their times, and the mean of repeated measurements";
            return Err(table.wrong(row, columns[0].position, problem.to_owned()));
        }
        last = brushed;
        let is_time = columns[0].quantity == Quantity::Time;
        radii.push(MeasuredRadius {
            brushed: if is_time {
                Brushed::Time(brushed)
            } else {
                Brushed::Turns(brushed)
            },
            radius: Reading {
                value,
                std: std.or(format.relative_std.map(|relative| relative * value)),
            },
            line: table.line(row),
        });
    }
    if radii.is_empty() {
        return Err(source.error(
            1,
            None,
            "there is no radius below the heading",
            ADVICE_ON_RADII,
        ));
    }
    Ok(radii)
}

fn read(
    text: &str,
    name: &str,
    format: &TableFormat,
    wanted: Wanted,
) -> Result<Vec<MeasuredPoint>, DataError> {
    let source = Source {
        name,
        text: text.trim_start_matches('\u{feff}'),
    };
    let (table, columns, has_comma) = opened(&source, format, wanted)?;
    // Beside velocities, errors in a column of rotational speeds do not matter.
    let has_velocity = columns
        .iter()
        .any(|column| column.quantity == Quantity::Velocity);
    let second_speed = || column(Quantity::RotationalSpeed, &table, &source, format, wanted).ok();
    let second_speed = has_velocity.then(second_speed).flatten();
    let tool = format.tool_column(&table)?;
    let mut points: Vec<MeasuredPoint> = Vec::new();
    let mut places = Places::default();
    for row in table.rows() {
        let mut point = MeasuredPoint {
            speed: Speed::Velocity(0.0),
            second_speed_rpm: None,
            penetration_depth_m: 0.0,
            readings: [None; 4],
            tool: None,
            line: table.line(row),
        };
        if let Some(TableColumn { position, unit, .. }) = second_speed {
            let speed = number(row.get(position).unwrap_or_default(), has_comma);
            point.second_speed_rpm = speed.map(|speed| unit.to_own(speed));
        }
        if let Some(column) = tool {
            let name = row.get(column).unwrap_or_default().trim();
            point.tool = format.tools.iter().position(|own| own == name);
            if point.tool.is_none() {
                let tools = format.tools.join(", ");
                let problem = format!("`{}` is none of the tools {tools}", shortened(name));
                return Err(table.wrong(row, column, problem));
            }
        }
        for column in &columns {
            let quantity = column.quantity;
            let may_be_empty =
                quantity.is_std() || (wanted == Wanted::Anything && quantity.force().is_some());
            let Some(number) = column.number(&table, row, has_comma, may_be_empty)? else {
                continue;
            };
            match quantity {
                Quantity::Velocity => point.speed = Speed::Velocity(number),
                Quantity::RotationalSpeed => point.speed = Speed::Rotational(number),
                Quantity::Depth => point.penetration_depth_m = number,
                _ => match (
                    quantity.force().map(|force| &mut point.readings[force]),
                    quantity.is_std(),
                ) {
                    // A deviation follows its force.
                    (Some(Some(reading)), true) => reading.std = Some(number),
                    (Some(reading), false) => {
                        *reading = Some(Reading {
                            value: number,
                            std: None,
                        })
                    }
                    _ => {}
                },
            }
        }
        if point.readings == [None; 4] {
            let first = columns
                .iter()
                .find(|column| column.quantity.force().is_some());
            let position = first.map_or(0, |column| column.position);
            return Err(table.wrong(
                row,
                position,
                "nothing was measured at this point".to_owned(),
            ));
        }
        for reading in point
            .readings
            .iter_mut()
            .flatten()
            .filter(|reading| reading.std.is_none())
        {
            reading.std = format
                .relative_std
                .map(|relative| relative * reading.value.abs());
        }
        if let Some(first) = places.take(&points, point) {
            let line = table.line(&table.rows()[first]);
            let of = if matches!(point.speed, Speed::Velocity(_)) {
                "velocity"
            } else {
                "speed"
            };
            let tool = if tool.is_some() { "tool, " } else { "" };
            let problem = format!(
                "the same {tool}{of} and depth as in line {line}: state the mean of repeated measurements"
            );
            return Err(table.wrong(row, columns[0].position, problem));
        }
        points.push(point);
    }
    if points.is_empty() {
        return Err(source.error(1, None, "there is no point below the heading", ADVICE));
    }
    Ok(points)
}

/// Formats points as a table in the units of the keys, which [`read_measured`] reads to the bit,
/// with the names of the `tools` of the study. All points have the same kind of speed, and a tool
/// if the first has one.
#[must_use]
pub fn measured_text(points: &[Measurement], tools: &[String]) -> String {
    let Some(first) = points.first() else {
        return String::new();
    };
    let std = points
        .iter()
        .any(|point| point.std_n.is_some())
        .then_some(Quantity::Std);
    let numbers = [first.speed.quantity(), Quantity::Depth, Quantity::Force]
        .into_iter()
        .chain(std)
        .map(Quantity::key);
    let heading: Vec<&str> = first
        .tool
        .map(|_| TOOL)
        .into_iter()
        .chain(numbers)
        .collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let written = "memory takes what is written to it";
    writer.write_record(heading).expect(written);
    for &Measurement {
        speed,
        penetration_depth_m,
        force_n,
        std_n,
        tool,
        ..
    } in points
    {
        let number = |number: f64| format!("{number:?}");
        let std = std.map(|_| std_n.map_or_else(String::new, number));
        let numbers = [speed.value(), penetration_depth_m, force_n]
            .map(number)
            .into_iter()
            .chain(std);
        let row = tool
            .map(|tool| tools[tool].clone())
            .into_iter()
            .chain(numbers);
        writer.write_record(row).expect(written);
    }
    String::from_utf8(writer.into_inner().expect(written)).expect("numbers and names are UTF-8")
}
