//! Columns of a table of measured forces, guessed from their headings: the lines of the input file
//! that name the columns.

use std::borrow::Cow;

use crate::grid::TOOL;
use crate::text::is_invisible;
use crate::text::units::NamedUnit;
use bristle::model::parameters::{Parameter, Usual};

use crate::input::cells::number;
use crate::input::columns::{Quantity, TableFormat, unit_in};
use crate::input::table::{Table, tidy_heading};

/// Longest heading that is guessed from, in bytes. Longer headings are not names.
const LONGEST_HEADING: usize = 100;

/// Names of the quantities, besides the other names of settings, in small letters and without
/// separators. Words of five letters and more may also end a compound.
const WORDS: [(Quantity, &[&str]); 8] = [
    (
        Quantity::Std,
        &[
            "std",
            "stdev",
            "s",
            "sd",
            "sigma",
            "σ",
            "deviation",
            "standardabweichung",
            "streuung",
        ],
    ),
    (Quantity::Velocity, &["v", "vc", "geschwindigkeit"]),
    (Quantity::RotationalSpeed, &["nw", "drehzahl"]),
    (Quantity::Depth, &["zustellung", "eingriff", "tiefe"]),
    (Quantity::Force, &["f", "fn", "fz", "fnw", "force", "kraft"]),
    (
        Quantity::Tangential,
        &["ft", "ftw", "tangentialforce", "tangentialkraft"],
    ),
    (Quantity::Torque, &["mw", "torque", "moment", "drehmoment"]),
    (Quantity::Power, &["pw", "power", "leistung"]),
];
/// Length of the shortest word that may end a compound, in bytes.
const MIN_COMPOUND_LENGTH: usize = 5;

/// A column as its heading describes it.
struct Described {
    heading: String,
    /// Words of the heading, and all of them as one.
    words: Vec<String>,
    /// Unit, if it is one of a measured quantity.
    unit: Option<String>,
    /// Largest magnitude of the numbers.
    largest: f64,
}

/// Returns advice with the lines that name the columns of a table: those that the input file names
/// rightly, and those that headings tell. If no heading tells anything, it is `otherwise`.
pub(crate) fn lines_to_paste(
    table: &Table<'_>,
    format: &TableFormat,
    otherwise: &'static str,
) -> Cow<'static, str> {
    let columns: Vec<Described> = described(table);
    let mut lines: Vec<(Quantity, String)> = Vec::new();
    let mut taken: Vec<usize> = Vec::new();
    for (quantity, named) in &format.columns {
        let Some(position) = columns
            .iter()
            .position(|column| column.heading == tidy_heading(&named.heading))
        else {
            continue;
        };
        let in_heading = || unit_in(&named.heading).map(|name| quantity.unit(name));
        if let Some(unit) = named
            .unit
            .map(Some)
            .or_else(in_heading)
            .unwrap_or_else(|| quantity.units().next())
        {
            taken.push(position);
            lines.push((*quantity, columns[position].line(*quantity, Some(unit))));
        }
    }
    // The most certain guesses first.
    let mut guesses: Vec<(u8, Quantity, usize)> = Vec::new();
    for quantity in WORDS.map(|(quantity, _)| quantity) {
        let certain = columns
            .iter()
            .enumerate()
            .map(|(position, column)| (column.tells(quantity), quantity, position));
        guesses.extend(certain.filter(|(certainty, ..)| *certainty > 0));
    }
    guesses.sort_by_key(|(certainty, ..)| std::cmp::Reverse(*certainty));
    for (_, quantity, position) in guesses {
        let is_same =
            |other: Quantity| other == quantity || (other.is_speed() && quantity.is_speed());
        if !taken.contains(&position) && !lines.iter().any(|(other, _)| is_same(*other)) {
            taken.push(position);
            lines.push((quantity, columns[position].line(quantity, None)));
        }
    }
    if lines.is_empty() {
        return Cow::Borrowed(otherwise);
    }
    lines.sort_by_key(|(quantity, _)| *quantity);
    let is_missing =
        |quantities: &[Quantity]| !lines.iter().any(|(named, _)| quantities.contains(named));
    let needed: [(&[Quantity], &str); 3] = [
        (
            &[Quantity::Velocity, Quantity::RotationalSpeed],
            "velocity or rotational speed",
        ),
        (&[Quantity::Depth], "penetration depth"),
        (&Quantity::FORCES, "force"),
    ];
    let missing = needed
        .iter()
        .filter(|(quantities, _)| is_missing(quantities))
        .map(|(quantities, name)| {
            let key = quantities[0].key();
            format!(
                "\n\n     No heading tells the {name}: name its column, as in columns.{key} = \"…\""
            )
        });
    let place = if format.columns.is_empty() && format.tool.is_none() {
        ""
    } else {
        ", in the place of its columns"
    };
    let tool = format
        .tool
        .as_ref()
        .map(|heading| format!("\n     columns.{TOOL} = {}", toml_text(heading)));
    let named = lines
        .iter()
        .map(|(_, line)| format!("\n     {line}"))
        .chain(tool);
    let text: String = named.chain(missing).collect();
    Cow::Owned(format!(
        "write under [measured] of the input file{place}:\n{text}"
    ))
}

/// Returns the columns of a table whose headings may be names.
fn described(table: &Table<'_>) -> Vec<Described> {
    let largest = |position: usize| {
        let cells = table.rows().iter().filter_map(|row| row.get(position));
        cells
            .filter_map(|cell| number(cell, false).or_else(|| number(cell, true)))
            .fold(0.0, |a: f64, b| a.max(b.abs()))
    };
    let headings = table.headings().iter().enumerate();
    let names =
        headings.filter(|(_, heading)| !heading.is_empty() && heading.len() <= LONGEST_HEADING);
    names
        .map(|(position, heading)| Described::of(heading.clone(), largest(position)))
        .collect()
}

impl Described {
    fn of(heading: String, largest: f64) -> Self {
        let (name, unit) = match unit_in(&heading) {
            Some(unit) => (
                heading
                    .rfind(unit)
                    .map_or(heading.as_str(), |at| &heading[..at]),
                Some(unit),
            ),
            // As in `depth_mm` and `depth mm`.
            None => heading
                .rsplit_once(['_', ' '])
                .map_or((heading.as_str(), None), |(name, unit)| (name, Some(unit))),
        };
        let is_unit = |unit: &&str| {
            Quantity::ALL
                .iter()
                .any(|quantity| quantity.unit_written(unit).is_some())
        };
        let (name, unit) = unit
            .filter(is_unit)
            .map_or((heading.as_str(), None), |unit| {
                (name, Some(unit.to_owned()))
            });
        let name = name.to_lowercase();
        let words = name
            .split(|letter: char| !letter.is_alphanumeric())
            .filter(|word| !word.is_empty());
        let mut words: Vec<String> = words.map(str::to_owned).collect();
        words.push(words.concat());
        Self {
            words,
            unit,
            largest,
            heading,
        }
    }

    /// Returns `true` if the name is one of a quantity.
    fn is_called(&self, quantity: Quantity) -> bool {
        let of_setting = quantity
            .path()
            .and_then(Parameter::find)
            .map_or(&[][..], |parameter| parameter.also);
        let of_setting = of_setting.iter().map(|name| name.replace('_', ""));
        let own = WORDS
            .iter()
            .filter(|(own, _)| *own == quantity)
            .flat_map(|(_, words)| *words);
        let names: Vec<String> = own.map(|&word| word.to_owned()).chain(of_setting).collect();
        let is_name = |word: &String| {
            names.iter().any(|name| {
                word == name || (name.len() >= MIN_COMPOUND_LENGTH && word.ends_with(name.as_str()))
            })
        };
        self.words.iter().any(is_name)
    }

    /// Returns the unit, if it is one of a quantity.
    fn unit_of(&self, quantity: Quantity) -> Option<&'static NamedUnit> {
        self.unit
            .as_deref()
            .and_then(|unit| quantity.unit_written(unit))
    }

    /// Returns the certainty that the column holds a quantity; 0 if nothing says so.
    fn tells(&self, quantity: Quantity) -> u8 {
        match (self.is_called(quantity), self.unit_of(quantity).is_some()) {
            // The unit is that of another quantity.
            (_, false) if self.unit.is_some() => 0,
            // A force with the word of a deviation is a deviation.
            _ if quantity == Quantity::Force && self.is_called(Quantity::Std) => 0,
            (false, true) if matches!(quantity, Quantity::Std | Quantity::Tangential) => 0,
            // A tangential force is called a force, too.
            _ if quantity == Quantity::Force && self.is_called(Quantity::Tangential) => 0,
            (true, true) => 3,
            (true, false) => 2,
            (false, true) => 1,
            (false, false) => 0,
        }
    }

    /// Returns the line of the input file that names the column. The unit is the stated one, or
    /// that of the heading, or the first in which the largest number is usual.
    fn line(&self, quantity: Quantity, stated: Option<&'static NamedUnit>) -> String {
        let usual = quantity
            .path()
            .and_then(Parameter::find)
            .and_then(|parameter| parameter.usual);
        let is_usual = |unit: &&NamedUnit| {
            usual.is_none_or(|Usual { least, largest, .. }| {
                (least..=largest).contains(&unit.to_own(self.largest))
            })
        };
        let known = stated.or_else(|| self.unit_of(quantity));
        let unit = known
            .or_else(|| quantity.units().find(is_usual))
            .or_else(|| quantity.units().next());
        let unit = unit.expect("what is measured has a unit");
        let heading = toml_text(&self.heading);
        let note = if known.is_some() {
            ""
        } else {
            "  # check the unit"
        };
        // The unit of a heading precedes that of a setting, but no other that the key states.
        if unit.is_own()
            && unit_in(&self.heading).is_some_and(|name| quantity.unit(name) != Some(unit))
        {
            return format!(
                "columns.{} = {{ column = {heading}, unit = \"{}\" }}{note}",
                quantity.key(),
                unit.name()
            );
        }
        format!(
            "columns.{} = {heading}{note}",
            unit.key_of(quantity.key()).unwrap_or_default()
        )
    }
}

/// Returns a text as TOML, with invisible characters escaped.
fn toml_text(text: &str) -> String {
    let mut quoted = String::from('"');
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            _ if is_invisible(letter) => quoted.push_str(&format!("\\U{:08X}", u32::from(letter))),
            _ => quoted.push(letter),
        }
    }
    quoted + "\""
}
