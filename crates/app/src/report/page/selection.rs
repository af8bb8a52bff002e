//! The cases of a study that its page shows.

use crate::insight::slices::spread;
use bristle_study::grid::Study;

/// Maximum number of cases in a page, which keeps it below 10 MB. The page of a larger study has a
/// selection.
pub const MAX_CASES_SHOWN: usize = 20_000;
/// Maximum number of cases whose courses are shown.
pub const MAX_COURSES: usize = 120;

/// A selection of the cases of a study, again a grid.
#[derive(Debug)]
pub(super) struct Selection {
    /// The positions of the selected values on each axis.
    pub(super) positions: Vec<Vec<usize>>,
    /// The cases in order.
    pub(super) cases: Vec<usize>,
}

impl Selection {
    /// Selects the cases that the page shows.
    pub(super) fn shown(study: &Study) -> Self {
        let all = study
            .sweeps()
            .iter()
            .map(|axis| (0..axis.values().len()).collect())
            .collect();
        Self::on(study, thinned(all, MAX_CASES_SHOWN))
    }

    /// Selects the cases whose courses the page shows.
    pub(super) fn with_course(study: &Study) -> Self {
        Self::on(study, thinned(Self::shown(study).positions, MAX_COURSES))
    }

    fn on(study: &Study, positions: Vec<Vec<usize>>) -> Self {
        let mut cases = vec![0];
        for (positions, axis) in positions.iter().zip(study.sweeps()) {
            let count = axis.values().len();
            cases = cases
                .iter()
                .flat_map(|case| {
                    positions
                        .iter()
                        .map(move |position| case * count + position)
                })
                .collect();
        }
        Self { positions, cases }
    }
}

/// Thins lists out evenly, the longest first, until they have at most `limit` combinations.
fn thinned(lists: Vec<Vec<usize>>, limit: usize) -> Vec<Vec<usize>> {
    let mut lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
    while lengths.iter().product::<usize>() > limit.max(1) {
        *lengths
            .iter_mut()
            .max()
            .expect("a product above one has a factor") -= 1;
    }
    let thin = |(list, length): (Vec<usize>, usize)| {
        spread(list.len(), length)
            .into_iter()
            .map(|index| list[index])
            .collect()
    };
    lists.into_iter().zip(lengths).map(thin).collect()
}
