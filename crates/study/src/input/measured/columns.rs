//! Columns of a table of measurements: which are read, where they are, and in which units.

use std::borrow::Cow;

use csv::StringRecord;

use super::{ADVICE, ADVICE_ON_RADII};
use crate::grid::{Study, TOOL};
use crate::input::cells::{self, SEPARATORS, has_decimal_comma, not_a_number, number};
use crate::input::columns::{LARGEST, Quantity, TableFormat, unit_in};
use crate::input::headings::lines_to_paste;
use crate::input::table::{DataError, Source, Table, tidy_heading};
use crate::text::shortened;
use crate::text::units::NamedUnit;

/// Quantities that are read from a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
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
    pub(super) fn tool_column(&self, table: &Table<'_>) -> Result<Option<usize>, DataError> {
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
pub(super) struct TableColumn {
    pub(super) quantity: Quantity,
    pub(super) position: usize,
    pub(super) unit: &'static NamedUnit,
}

impl TableColumn {
    /// Reads the number in the column's cell of a row, in the unit of the key; none if the cell may
    /// be empty, and is.
    pub(super) fn number(
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

/// Returns a table with the columns to read, and `true` if its numbers have decimal commas.
pub(super) fn opened<'s>(
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

/// Finds the column of a quantity.
pub(super) fn column(
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
