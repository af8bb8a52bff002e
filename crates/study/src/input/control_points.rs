//! Control points of a profile from a table.

use crate::text::units::units_of;

use crate::input::cells::{has_decimal_comma, not_a_number, number, separator_of};
use crate::input::table::{DataError, Source};

/// Largest number of control points of a profile.
pub const MAX_CONTROL_POINTS: usize = 10_000;

/// Columns of the table, in m. Others are skipped.
const COLUMNS: [&str; 2] = ["x_m", "y_m"];

/// Advice about a table that cannot be read.
const ADVICE: &str = "control points are a CSV file with a line of headings that has x_m and y_m, or x_mm and y_mm, and a line for each\n     \
    point, without separators of thousands";

/// Reads a table of control points `[x, y]` in m as CSV, with the separators and decimals of tables
/// of measured forces. Its columns may have another unit of length in their names. Errors use
/// `name` for the table.
///
/// # Errors
/// If a column is missing, a cell is not a finite number, or there is no point or more than
/// [`MAX_CONTROL_POINTS`].
pub fn read_control_points(text: &str, name: &str) -> Result<Vec<[f64; 2]>, DataError> {
    let source = Source {
        name,
        text: text.trim_start_matches('\u{feff}'),
    };
    let unit_in = |headings: &[String]| {
        let is_there = |column: &str| headings.iter().any(|heading| heading == column);
        units_of(COLUMNS[0]).find(|unit| {
            COLUMNS
                .iter()
                .all(|column| unit.key_of(column).is_some_and(|key| is_there(&key)))
        })
    };
    let separator = separator_of(&source, |headings| unit_in(headings).is_some());
    let table = source.table_separated_by(separator, ADVICE)?;
    let unit = unit_in(table.headings());
    let names = COLUMNS.map(|column| {
        unit.and_then(|unit| unit.key_of(column))
            .unwrap_or_else(|| column.to_owned())
    });
    let columns = table.columns(&names.each_ref().map(String::as_str))?;
    if let Some(row) = table.rows().get(MAX_CONTROL_POINTS) {
        let problem = format!("more than {MAX_CONTROL_POINTS} control points");
        let advice = "leave some out: a spline is smooth between its points";
        return Err(source.error(table.line(row), None, problem, advice));
    }
    let has_comma = has_decimal_comma(&table, &columns, separator)?;
    let mut points = Vec::new();
    for row in table.rows() {
        let mut point = [0.0; COLUMNS.len()];
        for (coordinate, &column) in point.iter_mut().zip(&columns) {
            let cell = row.get(column).unwrap_or_default();
            let Some(read) = number(cell, has_comma) else {
                return Err(table.wrong(row, column, not_a_number(cell, has_comma)));
            };
            *coordinate = unit.map_or(read, |unit| unit.to_own(read));
        }
        points.push(point);
    }
    if points.is_empty() {
        return Err(source.error(1, None, "there is no point below the heading", ADVICE));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read_by_their_headings() {
        let points = read_control_points("n,y_m,x_m\n1,0.5,-1e-2\n2,0,3\n", "points.csv");
        assert_eq!(points, Ok(vec![[-1e-2, 0.5], [3.0, 0.0]]));
        // As spreadsheets of other countries write them.
        for text in [
            "\u{feff}x_m;y_m\r\n-0,01;0,5\r\n3;0\r\n",
            "x_m\ty_m\n-0,01\t0,5\n3\t0\n",
            "x_m,y_m\n\"-0,01\",\"0,5\"\n3,0\n",
            "x_mm;y_mm\n-10;500\n3000;0\n",
        ] {
            assert_eq!(read_control_points(text, "points.csv"), points, "{text}");
        }
        let many = |count: usize| format!("x_m,y_m\n{}", "0.5,1\n".repeat(count));
        assert!(read_control_points(&many(MAX_CONTROL_POINTS), "points.csv").is_ok());
        let error = read_control_points(&many(MAX_CONTROL_POINTS + 1), "points.csv")
            .expect_err("too many")
            .to_string();
        assert!(
            error.starts_with("points.csv:10002: more than 10000 control points"),
            "{error}"
        );
        for (text, message) in [
            ("x_m,y_m\n", "there is no point"),
            ("x_m,z_m\n1,2\n", "y_m"),
            ("x_m,y_m\n1,one\n", "`one` is not a finite number"),
            (
                "x_m;y_m\n1.000;2.000\n",
                "the point of `1.000` may separate decimals or thousands",
            ),
            ("x_m;y_m\n1,5;2.5\n", "`1,5` is not a finite number"),
            ("x_m,y_m\n1,inf\n", "`inf` is not a finite number"),
        ] {
            let error = read_control_points(text, "points.csv")
                .expect_err("it is wrong")
                .to_string();
            assert!(
                error.contains("points.csv") && error.contains(message),
                "{error}"
            );
        }
    }
}
