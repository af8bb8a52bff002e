//! Tables of measured forces, and of edge radii over time, as laboratories export them, and in the
//! form in which results keep them.
//!
//! Separator and decimal comma are recognised from the text unless the input file states them.
//! Columns are found by the names that the input file gives, in units that their headings or the
//! input file state.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::text::shortened;
use crate::text::units::NamedUnit;
use bristle::model::settings::Settings;
use csv::StringRecord;

use crate::grid::{Study, TOOL};
use crate::input::cells::{self, SEPARATORS, has_decimal_comma, not_a_number, number};
use crate::input::columns::unit_in;
use crate::input::headings::lines_to_paste;
use crate::input::table::{DataError, Source, Table, tidy_heading};

pub use crate::input::columns::{ColumnName, LARGEST, Quantity, TableFormat};

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

/// Relative difference up to which values are the same: a file may round differently from a sweep.
const MAX_RELATIVE_DIFFERENCE: f64 = 1e-9;

/// The speed of the tool at a measured point, as its table states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// Brushing velocity `v_b` in m/s.
    Velocity(f64),
    /// Rotational speed `n_w` in rpm.
    Rotational(f64),
}

impl Speed {
    /// Returns the number, in the unit of its kind.
    #[must_use]
    pub fn value(self) -> f64 {
        match self {
            Self::Velocity(value) | Self::Rotational(value) => value,
        }
    }

    /// Returns the quantity of the speed.
    #[must_use]
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Velocity(_) => Quantity::Velocity,
            Self::Rotational(_) => Quantity::RotationalSpeed,
        }
    }

    /// Returns the speed of a tool with these `settings`, stated by the other quantity if that is
    /// asked for.
    #[must_use]
    pub fn stated_by(self, quantity: Quantity, settings: &Settings) -> Self {
        let mut settings = settings.clone();
        match (self, quantity) {
            (Self::Velocity(velocity), Quantity::RotationalSpeed) => {
                settings.process.brushing_velocity_m_s = velocity;
                Self::Rotational(settings.rotational_speed_rpm())
            }
            (Self::Rotational(speed), Quantity::Velocity) => {
                settings.set_rotational_speed_rpm(speed);
                Self::Velocity(settings.process.brushing_velocity_m_s)
            }
            _ => self,
        }
    }
}

/// A measured force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Speed of the tool.
    pub speed: Speed,
    /// Rotational speed in rpm that the table states beside the velocity. The velocity counts.
    pub second_speed_rpm: Option<f64>,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
    /// Tool contact normal force `F_n,w` in N.
    pub force_n: f64,
    /// Standard deviation in N, if it is known.
    pub std_n: Option<f64>,
    /// Position of the tool of this measurement among the named tools of the study; `None` if the
    /// table does not say.
    pub tool: Option<usize>,
}

/// Number in a cell, with its standard deviation if the table has one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Value, in the unit of its quantity's key.
    pub value: f64,
    /// Standard deviation, in the same unit.
    pub std: Option<f64>,
}

/// A measured point, with all its readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// Speed of the tool.
    pub speed: Speed,
    /// Rotational speed in rpm that the table states beside the velocity. The velocity counts.
    pub second_speed_rpm: Option<f64>,
    /// Penetration depth `a_e` in m.
    pub penetration_depth_m: f64,
    /// Readings of [`Quantity::FORCES`].
    pub readings: [Option<Reading>; 4],
    /// Position of the tool, as in [`Measurement::tool`].
    pub tool: Option<usize>,
    /// Line in the table, counted from 1; 0 without a table.
    pub line: u64,
}

impl MeasuredPoint {
    /// Returns the normal force alone, which a point has if [`read_measured`] has read it.
    fn measurement(&self) -> Option<Measurement> {
        let Self {
            speed,
            second_speed_rpm,
            penetration_depth_m,
            tool,
            ..
        } = *self;
        let [
            Some(Reading {
                value: force_n,
                std: std_n,
            }),
            ..,
        ] = self.readings
        else {
            return None;
        };
        Some(Measurement {
            speed,
            second_speed_rpm,
            penetration_depth_m,
            force_n,
            std_n,
            tool,
        })
    }
}

/// Time or turns for which an edge was brushed, as a table states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Brushed {
    /// Time in s.
    Time(f64),
    /// Turns of the tool.
    Turns(f64),
}

/// The radius of an edge that was measured after some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredRadius {
    /// Time or turns until the measurement.
    pub brushed: Brushed,
    /// Radius in m.
    pub radius: Reading,
    /// Line in the table, counted from 1; 0 without a table.
    pub line: u64,
}

/// Returns `true` if two values are the same except for rounding.
pub fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= MAX_RELATIVE_DIFFERENCE * a.abs().max(b.abs())
}

/// Quantities that are read from a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    /// Normal force, at each point.
    NormalForce,
    /// Any of [`Quantity::FORCES`], at least one at each point.
    Anything,
    /// Radii of an edge over time.
    Radii,
}

impl Wanted {
    /// Returns advice about a table as a whole.
    fn advice(self) -> &'static str {
        if self == Self::Radii {
            ADVICE_ON_RADII
        } else {
            ADVICE
        }
    }

    /// Returns advice about a column that cannot be read.
    fn advice_on_column(self, table: &Table<'_>, format: &TableFormat) -> Cow<'static, str> {
        if self == Self::Radii {
            self.advice().into()
        } else {
            lines_to_paste(table, format, ADVICE)
        }
    }
}

impl TableFormat {
    /// Returns the format in which results keep the measured forces of a study.
    #[must_use]
    pub fn of_tools(study: &Study) -> Self {
        Self {
            tools: study.tool_names(),
            ..Self::default()
        }
    }

    /// Returns the heading of a quantity's column, if it is there: the one that is named, or else
    /// the quantity's key, in any unit.
    fn heading<'h>(&self, quantity: Quantity, headings: &'h [String]) -> Option<&'h str> {
        let is_its = |heading: &&'h str| match self.named(quantity) {
            Some(column) => **heading == tidy_heading(&column.heading),
            None => Quantity::of_key(heading).is_some_and(|(of_key, _)| of_key == quantity),
        };
        headings.iter().map(String::as_str).find(is_its)
    }

    /// Returns the position of the column with the names of tools: the one that is named, or else
    /// the one under its own key. `None` if tools are not compared, or the table does not name
    /// them.
    fn tool_column(&self, table: &Table<'_>) -> Result<Option<usize>, DataError> {
        let heading = tidy_heading(self.tool.as_deref().unwrap_or(TOOL));
        let is_there = self.tool.is_some() || table.headings().contains(&heading);
        if self.tools.is_empty() || !is_there {
            Ok(None)
        } else {
            table.column(&heading).map(Some)
        }
    }

    /// Returns the quantities to read from a table with these headings: those that are named, and
    /// those under their own keys.
    fn quantities(&self, headings: &[String], wanted: Wanted) -> Vec<Quantity> {
        let is_there = |quantity| self.heading(quantity, headings).is_some();
        let is_wanted = |quantity| self.named(quantity).is_some() || is_there(quantity);
        if wanted == Wanted::Radii {
            let has_turns = !is_wanted(Quantity::Time) && is_wanted(Quantity::Turns);
            let std = Some(Quantity::EdgeRadiusStd).filter(|&std| is_wanted(std));
            let brushed = if has_turns {
                Quantity::Turns
            } else {
                Quantity::Time
            };
            return [brushed, Quantity::EdgeRadius]
                .into_iter()
                .chain(std)
                .collect();
        }
        let speed =
            if self.named(Quantity::Velocity).is_none() && is_wanted(Quantity::RotationalSpeed) {
                // A table may have both under their own keys.
                let has_both =
                    self.named(Quantity::RotationalSpeed).is_none() && is_there(Quantity::Velocity);
                if has_both {
                    Quantity::Velocity
                } else {
                    Quantity::RotationalSpeed
                }
            } else {
                Quantity::Velocity
            };
        let measured = Quantity::FORCES.into_iter().filter(|&force| match wanted {
            Wanted::NormalForce => force == Quantity::Force,
            Wanted::Anything | Wanted::Radii => is_wanted(force),
        });
        let mut measured: Vec<Quantity> = measured.collect();
        if measured.is_empty() {
            measured.push(Quantity::Force);
        }
        let with_std = measured
            .into_iter()
            .flat_map(|force| [Some(force), Some(force.std()).filter(|&std| is_wanted(std))]);
        [speed, Quantity::Depth]
            .into_iter()
            .chain(with_std.flatten())
            .collect()
    }

    /// Returns `true` if the headings have all that is needed.
    fn is_complete(&self, headings: &[String], wanted: Wanted) -> bool {
        self.quantities(headings, wanted)
            .iter()
            .all(|&quantity| self.heading(quantity, headings).is_some())
    }

    /// Returns the separator of a table: the one stated, or else by its headings.
    fn separator_of(&self, source: &Source<'_>, wanted: Wanted) -> char {
        let has_all = |headings: &[String]| self.is_complete(headings, wanted);
        self.separator
            .unwrap_or_else(|| cells::separator_of(source, has_all))
    }

    /// Returns the line with the headings, counted from 1, below a title block.
    fn heading_below_title(&self, source: &Source<'_>, wanted: Wanted) -> Option<usize> {
        /// Programs of dynamometers write a few dozen lines above the headings.
        const MAX_TITLE_LINES: usize = 200;
        let separator = self.separator_of(source, wanted);
        if self.is_complete(&source.headings(separator), wanted) {
            return None;
        }
        let has_headings = |text: &str| {
            let line = Source {
                name: source.name,
                text,
            };
            let separators = SEPARATORS.into_iter().chain(self.separator);
            let mut headings = separators.map(|separator| line.headings(separator));
            headings.any(|headings| self.is_complete(&headings, wanted))
        };
        let mut lines = source.text.lines().take(MAX_TITLE_LINES).skip(1);
        lines.position(has_headings).map(|index| index + 2)
    }
}

/// A column of a table.
struct TableColumn {
    quantity: Quantity,
    position: usize,
    unit: &'static NamedUnit,
}

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

/// Returns a table with the columns to read, and `true` if its numbers have decimal commas.
fn opened<'s>(
    source: &'s Source<'s>,
    format: &TableFormat,
    wanted: Wanted,
) -> Result<(Table<'s>, Vec<TableColumn>, bool), DataError> {
    opened_at_first_line(source, format, wanted).map_err(|error| {
        let Some(line) = format.heading_below_title(source, wanted) else {
            return error;
        };
        let problem = format!("the headings are in line {line}, below other lines");
        source.error(1, None, problem, "remove the lines above the headings")
    })
}

/// Opens a table that begins with its headings, like [`opened`].
fn opened_at_first_line<'s>(
    source: &'s Source<'s>,
    format: &TableFormat,
    wanted: Wanted,
) -> Result<(Table<'s>, Vec<TableColumn>, bool), DataError> {
    let separator = format.separator_of(source, wanted);
    let table = source.table_separated_by(separator, wanted.advice())?;
    let has = |quantity: Quantity| format.heading(quantity, table.headings()).is_some();
    if wanted != Wanted::Radii
        && has(Quantity::EdgeRadius)
        && !Quantity::FORCES.into_iter().any(has)
    {
        let advice = "`bristle calibrate --fit removal.preston_m2_n` takes radii; for other commands leave [measured] out, or name a table of forces";
        return Err(source.error(
            table.heading_line(),
            None,
            "the table has radii of an edge, not forces",
            advice,
        ));
    }
    let quantities = format.quantities(table.headings(), wanted).into_iter();
    let columns = quantities.map(|quantity| column(quantity, &table, source, format, wanted));
    let columns = columns.collect::<Result<Vec<TableColumn>, _>>()?;
    let has_comma = match format.decimal {
        Some(decimal) => decimal == ',',
        None => {
            let positions: Vec<usize> = columns.iter().map(|column| column.position).collect();
            has_decimal_comma(&table, &positions, separator)?
        }
    };
    Ok((table, columns, has_comma))
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

impl TableColumn {
    /// Reads the number in the column's cell of a row, in the unit of the key; none if the cell may
    /// be empty, and is.
    fn number(
        &self,
        table: &Table<'_>,
        row: &StringRecord,
        has_comma: bool,
        may_be_empty: bool,
    ) -> Result<Option<f64>, DataError> {
        let &Self {
            quantity,
            position,
            unit,
        } = self;
        let cell = row.get(position).unwrap_or_default();
        let is_missing =
            cell.trim().is_empty() || (quantity.is_std() && cell.eq_ignore_ascii_case("nan"));
        if may_be_empty && is_missing {
            return Ok(None);
        }
        let wrong = |problem: String| Err(table.wrong(row, position, problem));
        let Some(number) = number(cell, has_comma).map(|number| unit.to_own(number)) else {
            let is_unit = quantity
                .unit_written(cell.trim_matches(['[', ']', '(', ')']))
                .is_some();
            return wrong(match is_unit {
                true => format!(
                    "`{}` is a unit: write units into the headings, and remove their row",
                    shortened(cell)
                ),
                false => not_a_number(cell, has_comma),
            });
        };
        let (least, in_words) = quantity.least();
        if !(least..=LARGEST).contains(&number) {
            return wrong(format!("`{}` must be {in_words} to 1e100", shortened(cell)));
        }
        Ok(Some(number))
    }
}

/// Finds the column of a quantity.
fn column(
    quantity: Quantity,
    table: &Table<'_>,
    source: &Source<'_>,
    format: &TableFormat,
    wanted: Wanted,
) -> Result<TableColumn, DataError> {
    let headings = table.headings();
    let with_lines = |error: DataError| DataError {
        advice: wanted.advice_on_column(table, format),
        ..error
    };
    let named = format.named(quantity);
    let missing = named.map_or_else(
        || quantity.key().to_owned(),
        |column| tidy_heading(&column.heading),
    );
    let heading = format.heading(quantity, headings).unwrap_or(&missing);
    let position = table.column(heading).map_err(with_lines)?;
    let of_key =
        |heading: &str| Quantity::of_key(heading).filter(|(of_key, _)| *of_key == quantity);
    if let Some(other) = headings[position + 1..]
        .iter()
        .find(|other| named.is_none() && of_key(other).is_some())
    {
        let problem = format!(
            "the columns `{heading}` and `{}` state the same",
            shortened(other)
        );
        return Err(source.error(
            table.heading_line(),
            None,
            problem,
            "name the right one under [measured], or remove the other",
        ));
    }
    let stated = named.and_then(|column| column.unit);
    let in_heading = || unit_in(heading).map(|name| quantity.unit(name).ok_or(name));
    let unit = match stated.map(Ok).or_else(in_heading) {
        Some(Ok(unit)) => Some(unit),
        Some(Err(unknown)) => {
            let units = quantity.unit_names().collect::<Vec<_>>().join(", ");
            let problem = format!("the unit `{}` is none of {units}", shortened(unknown));
            return Err(with_lines(source.error(
                table.heading_line(),
                Some(heading.to_owned()),
                problem,
                ADVICE,
            )));
        }
        None => of_key(heading).map(|(_, unit)| unit),
    };
    // A heading without a unit has that of the key.
    let unit = unit
        .or_else(|| quantity.units().next())
        .expect("what is measured has a unit");
    Ok(TableColumn {
        quantity,
        position,
        unit,
    })
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

/// The points of a table by tool, speed and depth, to find equal ones in constant time.
///
/// Points are kept in cells somewhat wider than the tolerance of [`same`]. A point equals only
/// those in its own cell and the eight around it, and few different points have room in a cell.
#[derive(Default)]
struct Places(HashMap<(Option<usize>, [u64; 2]), Vec<usize>>);

impl Places {
    /// Adds the next point, whose position is the number of `points`. Returns the position of the
    /// first of these with the same tool, speed and depth, if there is one.
    fn take(&mut self, points: &[MeasuredPoint], point: MeasuredPoint) -> Option<usize> {
        let at = |point: &MeasuredPoint| [point.speed.value(), point.penetration_depth_m];
        let [speed, depth] = at(&point).map(cell);
        let same = |&position: &usize| {
            at(&points[position])
                .iter()
                .zip(at(&point))
                .all(|(a, b)| same(*a, b))
        };
        let around = (speed - 1..=speed + 1)
            .flat_map(|speed| (depth - 1..=depth + 1).map(move |depth| [speed, depth]));
        let first = around
            .filter_map(|key| self.0.get(&(point.tool, key)))
            .flatten()
            .copied()
            .filter(same)
            .min();
        self.0
            .entry((point.tool, [speed, depth]))
            .or_default()
            .push(points.len());
        first
    }
}

/// Returns the number of the cell of a positive number that is not subnormal. The bits of such
/// numbers ascend with the numbers. Leaving out the last 24 of 52 makes cells of 2⁻²⁸ of a power of
/// two.
fn cell(number: f64) -> u64 {
    number.to_bits() >> 24
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::table::MAX_ROWS;

    const HEADING: &str = "brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n";

    fn read(text: &str) -> Result<Vec<Measurement>, DataError> {
        read_measured(text, "forces.csv", &TableFormat::default())
    }

    fn refusal(text: &str, format: &TableFormat) -> String {
        read_measured(text, "forces.csv", format)
            .expect_err("refused")
            .to_string()
    }

    fn point(velocity: f64, penetration_depth_m: f64, force_n: f64, std_n: f64) -> Measurement {
        let speed = Speed::Velocity(velocity);
        Measurement {
            speed,
            second_speed_rpm: None,
            penetration_depth_m,
            force_n,
            std_n: Some(std_n),
            tool: None,
        }
    }

    /// Returns a format with columns, each by its heading and its unit if one is stated.
    fn format(columns: &[(Quantity, &str, Option<&str>)]) -> TableFormat {
        let column = |&(quantity, heading, unit): &(Quantity, &str, Option<&str>)| {
            let unit = unit.map(|name| quantity.unit(name).expect("a unit"));
            (
                quantity,
                ColumnName {
                    heading: heading.to_owned(),
                    unit,
                },
            )
        };
        TableFormat {
            columns: columns.iter().map(column).collect(),
            ..TableFormat::default()
        }
    }

    #[test]
    fn points_have_the_tools_that_they_were_measured_with() {
        let tools: Vec<String> = ["fine", "steel, short"].map(str::to_owned).into();
        let format = |tool: Option<&str>| TableFormat {
            tools: tools.clone(),
            tool: tool.map(str::to_owned),
            ..TableFormat::default()
        };
        let text = "tool,brushing_velocity_m_s,penetration_depth_m,force_n,std_n\n\
             fine,10.0,0.001,5.0,0.5\n\"steel, short\",10.0,0.001,7.0,\n";
        let points = read_measured(text, "forces.csv", &format(None)).expect("a table");
        let found: Vec<_> = points
            .iter()
            .map(|point| (point.tool, point.std_n))
            .collect();
        assert_eq!(found, [(Some(0), Some(0.5)), (Some(1), None)]);
        assert_eq!(measured_text(&points, &tools), text);
        // Where tools are not compared, the column has no effect, and points are given twice.
        assert!(
            refusal(text, &TableFormat::default())
                .contains("the same velocity and depth as in line 2")
        );
        let other = text.replace("tool,", "Bürste,");
        assert_eq!(
            read_measured(&other, "forces.csv", &format(Some("Bürste"))),
            Ok(points)
        );
        assert!(refusal(&other, &format(None)).contains("the same velocity and depth"));
        let unknown = refusal(&text.replace("fine,", "coarse,"), &format(None));
        assert!(
            unknown.starts_with(
                "forces.csv:2, column tool: `coarse` is none of the tools fine, steel, short"
            ),
            "{unknown}"
        );
        let twice = refusal(&text.replace("\"steel, short\"", "fine"), &format(None));
        assert!(
            twice.contains("the same tool, velocity and depth as in line 2"),
            "{twice}"
        );
    }

    #[test]
    fn tables_of_laboratories_are_read_in_their_units() {
        use Quantity::{Depth, Force, RotationalSpeed, Std, Velocity};
        let rotational = |speed: f64, depth, force_n, std_n| Measurement {
            speed: Speed::Rotational(speed),
            ..point(0.0, depth, force_n, std_n)
        };
        let named = format(&[
            (RotationalSpeed, "Drehzahl [1/min]", None),
            (Depth, "ae [mm]", None),
            (Force, "Fz [kN]", None),
            (Std, "s [N]", None),
        ]);
        let text = "\u{feff}Nr.;Drehzahl [1/min];ae [mm];Fz [kN];s [N]\r\n1;600;0,5;0,125;4,5\r\n2;1200;1;0,25;3\r\n";
        let expected = vec![
            rotational(600.0, 0.5e-3, 125.0, 4.5),
            rotational(1200.0, 1e-3, 250.0, 3.0),
        ];
        let tabs = text.replace(';', "\t");
        let points = tabs.replace(',', ".").replace('\t', ",");
        for text in [text, &tabs, &points] {
            assert_eq!(
                read_measured(text, "forces.csv", &named).as_ref(),
                Ok(&expected),
                "{text}"
            );
        }
        // Units in the input file, and none for what is not named; without a standard deviation.
        let stated = format(&[
            (Velocity, "v", Some("m/min")),
            (Depth, "ae", Some("µm")),
            (Force, "F", None),
        ]);
        let text = "v\tae\tF\n600\t500\t125\n";
        let expected = Measurement {
            std_n: None,
            ..point(10.0, 0.5e-3, 125.0, 0.0)
        };
        assert_eq!(
            read_measured(text, "forces.csv", &stated),
            Ok(vec![expected])
        );
        // Keys in other units.
        let text = "brushing_velocity_m_min,penetration_depth_um,force_kn\n600,500,0.125\n";
        assert_eq!(read(text), Ok(vec![expected]));
        for heading in ["Fz [N]", "Fz (N)", "Fz / N", "Fz in N"] {
            assert_eq!(unit_in(heading), Some("N"), "{heading}");
        }
        assert_eq!((unit_in("v / m/s"), unit_in("Fz")), (Some("m/s"), None));
    }

    #[test]
    fn the_text_of_points_is_read_to_the_bit() {
        let velocities = vec![
            point(10.0 / 3.0, 1e-3 / 7.0, -1.1, 0.1),
            point(20.0, 1e-3, 2.0, 0.0),
        ];
        let unsure = Measurement {
            speed: Speed::Rotational(600.1),
            std_n: None,
            ..velocities[0]
        };
        for points in [velocities, vec![unsure]] {
            assert_eq!(read(&measured_text(&points, &[])), Ok(points));
        }
    }

    #[test]
    fn lines_are_those_of_the_file() {
        let named = format(&[
            (Quantity::RotationalSpeed, "n [1/min]", None),
            (Quantity::Depth, "ae [mm]", None),
            (Quantity::Force, "Fz [N]", None),
        ]);
        let rows = "n [1/min];ae [mm];Fz [N]\n600;1,0;8,5\n\n;;\n1200;x;16,2\n";
        for (text, line) in [
            (rows.to_owned(), 5),
            (rows.replace('\n', "\r\n"), 5),
            (rows.replace("\n\n;;", ""), 3),
            (rows.replace("\n\n;;", "").replace('\n', "\r\n"), 3),
            (format!("sep=;\r\n{rows}"), 6),
        ] {
            let expected = format!("forces.csv:{line}, column ae [mm]: `x` is not a finite number");
            let message = refusal(&text, &named);
            assert!(message.starts_with(&expected), "{text:?}: {message}");
            // Rows without any cell are no points.
            let points = read_measured(&text.replace('x', "2,0"), "forces.csv", &named);
            let lines: Vec<f64> = points
                .expect("a table")
                .iter()
                .map(|point| point.force_n)
                .collect();
            assert_eq!(lines, [8.5, 16.2], "{text:?}");
        }
        let unit = refusal("sep=;\nn [1/min];ae [mm];Fz [lbf]\n600;1;8\n", &{
            let mut lbf = named.clone();
            lbf.columns[2].1.heading = "Fz [lbf]".to_owned();
            lbf
        });
        assert!(
            unit.starts_with("forces.csv:2, column Fz [lbf]: the unit"),
            "{unit}"
        );
        let short = refusal(&rows.replace("600;1,0;8,5", "600;1,0"), &named);
        assert!(
            short.starts_with("forces.csv:2: 2 cells, but the heading has 3"),
            "{short}"
        );
    }

    #[test]
    fn headings_are_found_as_spreadsheets_write_them() {
        let named = format(&[
            (Quantity::Velocity, "v [m/s]", None),
            (Quantity::Depth, "a e [µm]", None),
            (Quantity::Force, "F", None),
            (Quantity::Std, "s", None),
        ]);
        let expected = vec![Measurement {
            std_n: None,
            ..point(10.0, 5e-4, 5.0, 0.0)
        }];
        for heading in [
            "v [m/s];a e [µm];F;s",
            "v [m/s];a\u{a0}e [\u{3bc}m];F;s",
            "\"v\n[m/s]\";\"a e\r\n[µm]\";F;s",
        ] {
            let text = format!("{heading}\n10;500;5;NaN\n");
            assert_eq!(
                read_measured(&text, "forces.csv", &named).as_ref(),
                Ok(&expected),
                "{text}"
            );
        }
        let refused = |above: &str, below: &str| {
            let text = format!("{above}v [m/s];a e [µm];F;s\n{below}10;500;5;0\n");
            refusal(&text, &named)
        };
        let title = refused("Measurement;7\nOperator;Somebody\n\n", "");
        assert!(
            title.contains("the headings are in line 4, below other lines"),
            "{title}"
        );
        let units = refused("", "m/s;µm;N;N\n");
        assert!(
            units.starts_with("forces.csv:2, column v [m/s]: `m/s` is a unit"),
            "{units}"
        );
    }

    #[test]
    fn decimal_commas_are_recognised_unless_they_may_be_others() {
        let semicolons = HEADING.replace(',', ";");
        assert_eq!(
            read(&format!("{semicolons}10,5;1e-3;1,234;0\n")),
            Ok(vec![point(10.5, 1e-3, 1.234, 0.0)])
        );
        assert_eq!(
            read(&format!("{semicolons}10;1;1,234;0\n")),
            Ok(vec![point(10.0, 1.0, 1.234, 0.0)])
        );
        assert_eq!(
            read(&format!("{HEADING}\"10,5\",1,5,0\n")),
            Ok(vec![point(10.5, 1.0, 5.0, 0.0)])
        );
        let thousands = format!("{HEADING}10,1,\"1,234\",0\n");
        let message = refusal(&thousands, &TableFormat::default());
        assert!(
            message.contains(
                "column force_n: the comma of `1,234` may separate decimals or thousands"
            ),
            "{message}"
        );
        let stated = TableFormat {
            decimal: Some(','),
            ..TableFormat::default()
        };
        assert_eq!(
            read_measured(&thousands, "forces.csv", &stated),
            Ok(vec![point(10.0, 1.0, 1.234, 0.0)])
        );
        // With semicolons between cells, points may separate thousands.
        let thousands = format!("{semicolons}10;1;1.000;0\n20;1;1.250;0\n");
        let message = refusal(&thousands, &TableFormat::default());
        assert!(
            message.starts_with("forces.csv:2, column force_n: the point of `1.000` may separate"),
            "{message}"
        );
        assert!(message.contains("decimal = \",\""), "{message}");
        let point_stated = TableFormat {
            decimal: Some('.'),
            ..TableFormat::default()
        };
        let decimals = vec![point(10.0, 1.0, 1.0, 0.0), point(20.0, 1.0, 1.25, 0.0)];
        assert_eq!(
            read_measured(&thousands, "forces.csv", &point_stated),
            Ok(decimals.clone())
        );
        let message = refusal(&thousands, &stated);
        assert!(
            message.contains("`1.000` is not a finite number with a decimal comma"),
            "{message}"
        );
        // Any number that cannot have thousands settles it, and so do commas between cells.
        let settled = read(&format!("{semicolons}10;1;1.000;0\n20;1;1.25;0\n"));
        assert_eq!(settled, Ok(decimals.clone()));
        assert_eq!(
            read(&format!("{HEADING}10,1,1.000,0\n20,1,1.250,0\n")),
            Ok(decimals)
        );
        let mixed = refusal(
            &format!("{semicolons}10,5;1;1.5;0\n"),
            &TableFormat::default(),
        );
        assert!(mixed.contains("`10,5` is not a finite number\n"), "{mixed}");
        let mixed = refusal(&format!("{semicolons}10,5;1;1.5;0\n"), &stated);
        assert!(
            mixed.contains("`1.5` is not a finite number with a decimal comma\n"),
            "{mixed}"
        );
    }

    #[test]
    fn columns_that_are_missing_or_have_unknown_units_are_refused() {
        let force = |heading: &str| format(&[(Quantity::Force, heading, None)]);
        let text = HEADING.replace("force_n", "Fz [lbf]") + "10,1,1,0\n";
        let twice = HEADING.replace("std_n", "force_kn") + "10,1,1,1\n";
        for (text, format, part) in [
            (
                text.as_str(),
                force("Fz [lbf]"),
                "column Fz [lbf]: the unit `lbf` is none of N, kN, mN\n",
            ),
            (
                &text,
                force("Fz"),
                "there is no column `Fz`; there are `brushing_velocity_m_s`",
            ),
            (
                "v;F\n1;2\n",
                TableFormat::default(),
                "there is no column `brushing_velocity_m_s`; there are `v`, `F`",
            ),
            (
                "v;F\n1;2\n",
                TableFormat::default(),
                "columns.penetration_depth_m = \"…\"",
            ),
            // Headings that tell nothing.
            (
                "a;b\n1;2\n",
                TableFormat::default(),
                "columns.penetration_depth_m = \"ae [mm]\"",
            ),
            (
                &twice,
                TableFormat::default(),
                "the columns `force_n` and `force_kn` state the same",
            ),
        ] {
            let message = refusal(text, &format);
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn equal_points_are_found_wherever_they_are() {
        let table = |rows: &str| read(&format!("{HEADING}{rows}"));
        let error = |rows: &str| table(rows).expect_err("refused").to_string();
        // From cell to cell and across powers of two.
        for number in (-2000..2000).step_by(7) {
            let (velocity, depth) = (f64::from(number) * 0.1137, f64::from(number) * -0.0713);
            let [velocity, depth] = [velocity, depth].map(f64::exp);
            let rows = |relative: f64| {
                let [fast, deep] = [velocity * (1.0 + relative), depth * (1.0 - relative)];
                format!("7,3,0,0\n{velocity:?},{depth:?},1,1\n{fast:?},{deep:?},1,1\n")
            };
            let expected = "forces.csv:4, column brushing_velocity_m_s: the same velocity and depth as in line 3";
            assert!(error(&rows(0.9e-9)).starts_with(expected));
            assert!(table(&rows(1.1e-9)).is_ok());
        }
    }

    /// Reading took a minute when each point was compared with all others.
    #[test]
    fn points_are_compared_with_few_others() {
        let (mut places, mut points) = (Places::default(), Vec::new());
        for index in 0..20_000_u16 {
            let point = MeasuredPoint {
                speed: Speed::Velocity(f64::from(index % 1000) + 1.5),
                second_speed_rpm: None,
                penetration_depth_m: f64::from(index / 1000 + 1) * 1e-6,
                readings: [None; 4],
                tool: None,
                line: 0,
            };
            assert_eq!(places.take(&points, point), None);
            points.push(point);
        }
        assert!(
            places.0.values().all(|positions| positions.len() == 1),
            "different points share a cell"
        );
    }

    #[test]
    fn long_tables_are_refused() {
        let rows = |count: usize| {
            let row =
                |index: usize| format!("{}.5,{}e-6,1.0,0.1\n", index % 1000 + 1, index / 1000 + 1);
            (0..count).fold(HEADING.to_owned(), |text, index| text + &row(index))
        };
        assert_eq!(read(&rows(20_000)).expect("points").len(), 20_000);
        let error = read(&rows(MAX_ROWS + 1)).expect_err("too many").to_string();
        assert!(
            error.starts_with("forces.csv:1000002: more than 1000000 rows"),
            "{error}"
        );
        let wide = format!("{HEADING}1,1,1,1\n{}", ",".repeat(100_000));
        let error = read(&wide).expect_err("too wide").to_string();
        assert!(
            error.starts_with("forces.csv:3: a line of more than 65536 bytes"),
            "{error}"
        );
    }

    #[test]
    fn forces_beyond_the_limit_are_refused() {
        for force in ["1e101", "-1e308", "1e400", "NaN"] {
            let error = read(&format!("{HEADING}1,1,{force},0\n"))
                .expect_err("too large")
                .to_string();
            assert!(error.starts_with("forces.csv:2, column force_n"), "{error}");
        }
    }

    #[test]
    fn radii_over_time_are_read_as_laboratories_write_them() {
        let radius = |brushed: Brushed, value: f64, std: Option<f64>, line: u64| MeasuredRadius {
            brushed,
            radius: Reading { value, std },
            line,
        };
        use Quantity::{EdgeRadius, EdgeRadiusStd, Time, Turns};
        let named = format(&[
            (Time, "t [min]", None),
            (EdgeRadius, "R [µm]", None),
            (EdgeRadiusStd, "s", Some("mm")),
        ]);
        let text = "Nr.;t [min];R [µm];s\n1;0;20;0,002\n2;1,5;62,5;\n";
        let relative = TableFormat {
            relative_std: Some(0.02),
            ..named.clone()
        };
        let expected = vec![
            radius(Brushed::Time(0.0), 20e-6, Some(2e-6), 2),
            radius(Brushed::Time(90.0), 62.5e-6, Some(0.02 * 62.5e-6), 3),
        ];
        assert_eq!(read_radii(text, "radii.csv", &relative), Ok(expected));
        // Keys, in other units; turns in the place of the time.
        for (heading, brushed) in [
            ("time_s", Brushed::Time(2.0)),
            ("time_h", Brushed::Time(7200.0)),
            ("turns", Brushed::Turns(2.0)),
        ] {
            let text = format!("{heading},edge_radius_mm\n2,0.1\n");
            let expected = vec![radius(brushed, 0.1e-3, None, 2)];
            assert_eq!(
                read_radii(&text, "radii.csv", &TableFormat::default()),
                Ok(expected)
            );
        }
        let turns = format(&[(Turns, "n", None)]);
        assert!(read_radii("n,edge_radius_m\n2,0.1\n", "radii.csv", &turns).is_ok());
        let refused = |text: &str| {
            read_radii(text, "radii.csv", &TableFormat::default())
                .expect_err("refused")
                .to_string()
        };
        let rows = |rows: &str| refused(&format!("time_s,edge_radius_m\n{rows}"));
        assert!(
            rows("2,1e-4\n2,2e-4\n")
                .starts_with("radii.csv:3, column time_s: this is not after the row above")
        );
        assert!(
            rows("-1,1e-4\n").starts_with("radii.csv:2, column time_s: `-1` must be at least 0")
        );
        assert!(
            rows("1,0\n")
                .starts_with("radii.csv:2, column edge_radius_m: `0` must be greater than 0")
        );
        assert!(rows("").contains("there is no radius below the heading"));
        let missing = refused("time_s,R\n1,2\n");
        assert!(
            missing.contains("no column `edge_radius_m`")
                && missing.contains("columns.edge_radius_m"),
            "{missing}"
        );
        // A study has no use for radii.
        let other = read("time_s,edge_radius_m\n1,1e-4\n")
            .expect_err("no forces")
            .to_string();
        assert!(
            other.contains("radii of an edge, not forces")
                && other.contains("removal.preston_m2_n"),
            "{other}"
        );
    }

    #[test]
    fn columns_of_one_name_are_refused_with_their_numbers() {
        let text = "force_n,brushing_velocity_m_s,date,force_n,penetration_depth_m,std_n,date\n1,1,1,1,1,1,1\n";
        let error = read(text).expect_err("two columns of forces").to_string();
        assert!(
            error.starts_with("forces.csv:1: columns 1 and 4 are both named `force_n`\n"),
            "{error}"
        );
        assert!(
            read(&text.replacen("force_n", "old", 1)).is_ok(),
            "other columns are ignored"
        );
    }

    #[test]
    fn tables_may_have_further_columns_and_a_byte_order_mark() {
        let text = "\u{feff}force_n, std_n, date, penetration_depth_m, brushing_velocity_m_s\r\n1.5,0,now,2e-3,5\r\n";
        assert_eq!(read(text), Ok(vec![point(5.0, 2e-3, 1.5, 0.0)]));
        let both = text
            .replace("date", "rotational_speed_rpm")
            .replace("now", "300");
        let both = read(&both).expect("a table");
        assert_eq!(
            both,
            [Measurement {
                second_speed_rpm: Some(300.0),
                ..point(5.0, 2e-3, 1.5, 0.0)
            }]
        );
        // The velocity counts, and is kept.
        assert_eq!(
            read(&measured_text(&both, &[])),
            Ok(vec![point(5.0, 2e-3, 1.5, 0.0)])
        );
    }
}
