//! Control points of a profile from a table.

use bristle_text::shortened;

use crate::results::{DataError, Source};

/// The columns of the table. Others are skipped.
const COLUMNS: [&str; 2] = ["x_m", "y_m"];

/// What a reader is told about a table that cannot be read.
const ADVICE: &str =
    "control points are a CSV file with a line of headings that has x_m and y_m, and a line for each point";

/// Reads a table of control points `[x, y]` in m as CSV. Errors use `name` for the table.
///
/// # Errors
/// If a column is missing, a cell is not a finite number, or there is no point.
pub fn read_control_points(text: &str, name: &str) -> Result<Vec<[f64; 2]>, DataError> {
    let source = Source { name, text: text.trim_start_matches('\u{feff}') };
    let table = source.table(ADVICE)?;
    let columns = table.columns(&COLUMNS)?;
    let mut points = Vec::new();
    for row in table.rows() {
        let mut point = [0.0; COLUMNS.len()];
        for (coordinate, &column) in point.iter_mut().zip(&columns) {
            let cell = row.get(column).unwrap_or_default();
            match cell.parse() {
                Ok(read) if f64::is_finite(read) => *coordinate = read,
                _ => {
                    return Err(table.wrong(row, column, format!("`{}` is not a finite number", shortened(cell))));
                }
            }
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
        for (text, message) in [
            ("x_m,y_m\n", "there is no point"),
            ("x_m,z_m\n1,2\n", "y_m"),
            ("x_m,y_m\n1,one\n", "`one` is not a finite number"),
            ("x_m,y_m\n1,inf\n", "`inf` is not a finite number"),
        ] {
            let error = read_control_points(text, "points.csv").expect_err("it is wrong").to_string();
            assert!(error.contains("points.csv") && error.contains(message), "{error}");
        }
    }
}
