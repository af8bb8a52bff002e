//! The worked part of a profile: the cells with work, and edges with work.

use bristle::simulation::ProfileCell;

/// Returns the stretch of arc lengths that figures show: the cells with work, and edges with work
/// or next to it. `None` without work.
pub(super) fn stretch(profile: &[ProfileCell]) -> Option<[f64; 2]> {
    let worked = hull(
        profile
            .iter()
            .filter(|cell| cell.normal_impulse_n_s_m > 0.0),
    )?;
    let near = (worked[1] - worked[0]) / 4.0;
    let edges = profile.iter().filter(|cell| {
        cell.on_edge && cell.arc_length_m > worked[0] - near && cell.arc_length_m < worked[1] + near
    });
    Some(hull(edges).map_or(worked, |edges| {
        [worked[0].min(edges[0]), worked[1].max(edges[1])]
    }))
}

/// Returns the arc lengths from the start of the first cell to the end of the last.
fn hull<'a>(cells: impl Iterator<Item = &'a ProfileCell>) -> Option<[f64; 2]> {
    cells
        .map(ends)
        .reduce(|[start, end], [from, to]| [start.min(from), end.max(to)])
}

/// Returns the arc lengths at the ends of a cell.
pub(super) fn ends(cell: &ProfileCell) -> [f64; 2] {
    [-0.5, 0.5].map(|part| cell.arc_length_m + part * cell.length_m)
}

/// Returns the edges within a stretch that have work.
pub(super) fn worked_edges(profile: &[ProfileCell], [start, end]: [f64; 2]) -> Option<[f64; 2]> {
    let within = |cell: &&ProfileCell| {
        cell.on_edge && cell.arc_length_m >= start && cell.arc_length_m <= end
    };
    let edges = || profile.iter().filter(within);
    edges()
        .any(|cell| cell.normal_impulse_n_s_m > 0.0)
        .then(|| hull(edges()))
        .flatten()
}

/// The arc lengths of the worked part of a profile, and of its worked edges.
pub(super) struct Worked {
    whole: [f64; 2],
    edges: Option<[f64; 2]>,
}

impl Worked {
    pub fn of(profile: &[ProfileCell]) -> Option<Self> {
        let whole = stretch(profile)?;
        Some(Self {
            whole,
            edges: worked_edges(profile, whole),
        })
    }

    /// Returns the places of the cells in the worked part.
    pub fn places<'a>(&self, profile: &'a [ProfileCell]) -> impl Iterator<Item = [f64; 2]> + 'a {
        let [from, to] = self.whole;
        let worked = profile
            .iter()
            .filter(move |cell| cell.arc_length_m > from && cell.arc_length_m < to);
        worked.map(|cell| [cell.x_m, cell.y_m])
    }

    /// Returns the places of the cells on the worked edges, if there are any.
    pub fn places_of_edges<'a>(
        &self,
        profile: &'a [ProfileCell],
    ) -> Option<impl Iterator<Item = [f64; 2]> + 'a> {
        let [from, to] = self.edges?;
        let on_edges = profile
            .iter()
            .filter(move |cell| cell.on_edge && cell.arc_length_m > from && cell.arc_length_m < to);
        Some(on_edges.map(|cell| [cell.x_m, cell.y_m]))
    }
}
