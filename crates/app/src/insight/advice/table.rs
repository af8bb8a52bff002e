//! Tables of advice: rows of cells, each with a sentence beside or below it.

use bristle_study::text::layout::{aligned, wrap, wrap_beside};

/// A line of a table.
pub(super) struct TableLine {
    /// Heading of its topic, which stands above all lines that share it.
    pub(super) heading: String,
    pub(super) cells: Vec<String>,
    pub(super) sentence: String,
}

/// Adds lines to a text, below two rows of headings of their cells.
pub(super) fn write_table(
    text: &mut String,
    headings: [Vec<String>; 2],
    lines: &[TableLine],
    width: usize,
) {
    let cells = lines.iter().map(|line| line.cells.clone());
    let rows: Vec<Vec<String>> = headings.into_iter().chain(cells).collect();
    let rows = aligned(&rows);
    let (headings, rows) = rows.split_at(2);
    if !lines.is_empty() {
        for heading in headings {
            text.push_str(&format!("{}\n", heading.trim_end()));
        }
    }
    let mut heading = "";
    for (cells, line) in rows.iter().zip(lines) {
        if heading != line.heading {
            heading = &line.heading;
            wrap(width, text, "", heading);
        }
        wrap_beside(width, text, cells, &line.sentence);
    }
}
