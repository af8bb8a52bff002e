//! Cases that were repeated more precisely, and how much their results changed.

use bristle_study::grid::CaseResult;
use serde::Serialize;

/// The cases that were repeated more precisely: passes at a tenth of the tolerance, brushes in
/// steps of half the length.
#[derive(Clone, Debug, Serialize)]
pub struct Checked {
    /// Their rows in `runs.csv`, counted below the heading.
    pub rows: Vec<usize>,
    /// The largest relative change of a headline metric.
    pub largest_change: f64,
    /// The row of the case in which that was.
    pub row: usize,
    /// The number of all cases.
    #[serde(skip)]
    total: usize,
}

impl Checked {
    pub(super) fn of(results: &[CaseResult]) -> Option<Self> {
        let change = |(case, result): (usize, &CaseResult)| {
            Some((case + 1, result.as_ref().ok()?.change_when_checked?))
        };
        let changes: Vec<(usize, f64)> = results.iter().enumerate().filter_map(change).collect();
        let &(row, largest_change) = changes.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let rows = changes.iter().map(|(row, _)| *row).collect();
        Some(Self {
            rows,
            largest_change,
            row,
            total: results.len(),
        })
    }

    /// In a sentence.
    pub(super) fn text(&self) -> String {
        let spans = self
            .rows
            .chunk_by(|a, b| a + 1 == *b)
            .map(|span| match span {
                [row] => row.to_string(),
                [first, .., last] => format!("{first} to {last}"),
                [] => String::new(),
            });
        let which = match self.rows.len() {
            count if count == self.total => "All cases were".to_owned(),
            1 => format!("Of {} cases, that of row {} was", self.total, self.row),
            _ => format!(
                "Of {} cases, those of rows {} were",
                self.total,
                spans.collect::<Vec<_>>().join(", ")
            ),
        };
        let (change, row) = (100.0 * self.largest_change, self.row);
        format!(
            "{which} checked (`study --check`); no metric changed by more than {change:.2} % (row {row})."
        )
    }
}
