//! Numbers in tables as laboratories and spreadsheets write them: separators of cells and of
//! decimals.
//!
//! Measured forces and control points are read by the same rules.

use crate::text::shortened;

use crate::input::table::{DataError, Source, Table};

/// Separators of cells, in the order in which they are tried.
pub const SEPARATORS: [char; 3] = [',', ';', '\t'];
/// Separators of decimals.
pub const DECIMALS: [char; 2] = ['.', ','];

/// Returns the separator of a table: that of its first line, or the first that gives all needed
/// headings (`has_all`), or else the most frequent in the heading.
pub(crate) fn separator_of(source: &Source<'_>, has_all: impl Fn(&[String]) -> bool) -> char {
    if let Some(stated) = source.stated_separator() {
        return stated;
    }
    let heading = source.heading_text();
    let count = |separator: &char| heading.matches(*separator).count();
    let most = SEPARATORS.into_iter().rev().max_by_key(count);
    let separates = |separator: &char| has_all(&source.headings(*separator));
    SEPARATORS
        .into_iter()
        .find(separates)
        .or(most)
        .unwrap_or(SEPARATORS[0])
}

/// Returns `true` if the numbers in `columns` have a decimal comma: some have a comma, and none has
/// a point.
///
/// # Errors
/// If the commas or points may separate thousands instead.
pub(crate) fn has_decimal_comma(
    table: &Table<'_>,
    columns: &[usize],
    separator: char,
) -> Result<bool, DataError> {
    let cells = || {
        let cells = table
            .rows()
            .iter()
            .flat_map(|row| columns.iter().map(move |&column| (row, column)));
        cells.map(|(row, column)| (row, column, row.get(column).unwrap_or_default().trim()))
    };
    for (mark, name) in [('.', "point"), (',', "comma")] {
        let mut marked = cells().filter(|(.., cell)| cell.contains(mark));
        let Some((row, column, first)) = marked.next() else {
            continue;
        };
        // Where commas separate cells, they do not separate decimals. Elsewhere they usually do,
        // and points separate thousands.
        let is_usual = (mark == '.') == (separator == ',');
        if !is_usual
            && has_thousands(first, mark)
            && marked.all(|(.., cell)| has_thousands(cell, mark))
        {
            let problem = format!(
                "the {name} of `{}` may separate decimals or thousands",
                shortened(first)
            );
            return Err(table.wrong(row, column, problem));
        }
        return Ok(mark == ',');
    }
    Ok(false)
}

/// Returns `true` if the marks of a number may separate thousands.
pub(crate) fn has_thousands(cell: &str, mark: char) -> bool {
    let mut groups = cell.split(mark);
    let first = groups
        .next()
        .unwrap_or_default()
        .trim_start_matches(['+', '-']);
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    (1..=3).contains(&first.len())
        && is_number(first)
        && !first.starts_with('0')
        && groups.all(|group| group.len() == 3 && is_number(group))
}

/// Returns the error about a number whose point or comma may separate thousands; `None` if it
/// cannot.
#[must_use]
pub fn ambiguous(number: &str) -> Option<String> {
    let (mark, name) = [('.', "point"), (',', "comma")]
        .into_iter()
        .find(|(mark, _)| number.contains(*mark))?;
    has_thousands(number, mark).then(|| {
        let [all, decimals] = ["", "."].map(|instead| number.replace(mark, instead));
        let decimals = decimals.trim_end_matches('0');
        let point = if decimals.ends_with('.') { "0" } else { "" };
        format!(
            "the {name} of {number} may separate decimals or thousands: write {all} or {decimals}{point}"
        )
    })
}

/// Reads a finite number as it stands in a cell.
pub(crate) fn number(cell: &str, has_comma: bool) -> Option<f64> {
    let cell = cell.trim();
    let number = match has_comma {
        true if cell.contains('.') => return None,
        true => cell.replacen(',', ".", 1).parse(),
        false => cell.parse(),
    };
    number.ok().filter(|number: &f64| number.is_finite())
}

/// Returns the problem with a cell that is not a [`number`].
pub(crate) fn not_a_number(cell: &str, has_comma: bool) -> String {
    let decimal = if has_comma {
        " with a decimal comma"
    } else {
        ""
    };
    format!("`{}` is not a finite number{decimal}", shortened(cell))
}
