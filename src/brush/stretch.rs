//! The steady stretch of a sector: the columns whose impulse no longer depends on where the sector
//! ends.
//!
//! The first filaments meet an empty gap. What they do differs from what later ones do for as many
//! columns as pass in about half a period of a filament and most of a contact. The last filaments
//! have none behind them, which matters for as many columns as pass during a contact. Both were
//! found from rows at 2 to 30 m/s and depths of 0.5 to 3 mm (docs/methods.md).

use std::f64::consts::TAU;

use super::arrangement::Arrangement;
use super::error::BrushError;
use super::result::{FilamentResult, Stretch};
use crate::model::filament::first_natural_frequency;
use crate::model::settings::{Pattern, Settings};
use crate::simulation::Pass;

/// A stretch is steady if the means of its parts differ from its own by less than this share of it.
const STEADY: f64 = 3e-3;
/// Where filaments are equal, a stretch has settled if these differ by less, if it has as many
/// columns, and if more of them would hardly change its mean. In 120 rows at 2.5 to 30 m/s and 0.5
/// to 5 mm, the mean of the first such stretch is within 6.3e-4 of that of 230 columns.
const SETTLED: f64 = 1e-3;
const SETTLED_COLUMNS: usize = 24;
const SETTLED_CHANGE: f64 = 5e-4;
/// Number of columns of a part.
const PART: usize = 5;
/// Where filaments or rows are irregular, the parts are quarters, and may also differ by so many
/// times the standard error of their means.
const STANDARD_ERRORS: f64 = 2.5;
/// The least length of a stretch in columns.
const SHORTEST: usize = 10;

/// How the ends of a sector are expected to matter, in columns.
struct Expectation {
    entry: usize,
    exit: usize,
    /// The least length of a stretch: along shorter ones impulses rise and fall.
    length: usize,
}

impl Expectation {
    fn new(settings: &Settings, pass: &Pass, around: f64) -> Self {
        let pitch = TAU / around;
        let contact = pass.nominal().contact_angle / pitch;
        let half_period =
            0.5 * TAU / first_natural_frequency(&settings.filament) * pass.tool().rate / pitch;
        Self {
            entry: (1.2 * (half_period + 0.6 * contact)).ceil() as usize,
            exit: (0.8 * contact).ceil() as usize + 3,
            length: ((0.5 * contact).ceil() as usize).max(SHORTEST),
        }
    }

    /// The error of a sector with too few columns, in which the mean impulse changes by `drift`
    /// along the best stretch, if it was simulated.
    fn too_few(&self, arrangement: &Arrangement, drift: Option<f64>) -> BrushError {
        let Arrangement {
            columns, around, ..
        } = *arrangement;
        let needed = (self.entry + self.length + self.exit).max(columns + columns.div_ceil(3));
        BrushError::TooFewColumns {
            columns,
            needed,
            around: around.floor() as usize,
            drift,
        }
    }
}

/// Number of columns of a sector whose settings do not state it.
pub fn default_columns(settings: &Settings, pass: &Pass, rows: usize) -> usize {
    let around = settings.tool.filament_count / rows as f64;
    let brush = settings.brush_or_default();
    let Expectation {
        entry,
        exit,
        length,
    } = Expectation::new(settings, pass, around);
    let needed = if brush.steady {
        entry + length + exit
    } else {
        SHORTEST
    };
    needed.min(around.floor() as usize)
}

/// The number of columns that are expected to be needed for the stretch and those before it.
pub fn expected_to_count(settings: &Settings, pass: &Pass, arrangement: &Arrangement) -> usize {
    let Expectation { entry, length, .. } = Expectation::new(settings, pass, arrangement.around);
    (entry + length).min(columns_that_may_count(settings, pass, arrangement))
}

/// The number of columns that are expected to be in the stretch.
pub fn expected_in(settings: &Settings, pass: &Pass, arrangement: &Arrangement) -> usize {
    let may_count = columns_that_may_count(settings, pass, arrangement);
    if may_count == arrangement.columns {
        return may_count;
    }
    let Expectation { entry, length, .. } = Expectation::new(settings, pass, arrangement.around);
    may_count.saturating_sub(entry).max(length)
}

/// The number of columns that may count, from the first one. Those behind them are there only so
/// that these are not the last ones.
pub fn columns_that_may_count(
    settings: &Settings,
    pass: &Pass,
    arrangement: &Arrangement,
) -> usize {
    if !settings.brush_or_default().steady || arrangement.is_closed() {
        return arrangement.columns;
    }
    let Expectation { exit, .. } = Expectation::new(settings, pass, arrangement.around);
    arrangement.columns.saturating_sub(exit)
}

/// Whether the stretch at the end of the columns of `filaments`, which have passed, has settled:
/// more columns would not change its mean.
pub fn has_settled(
    filaments: &[FilamentResult],
    settings: &Settings,
    pass: &Pass,
    arrangement: &Arrangement,
) -> bool {
    let expectation = Expectation::new(settings, pass, arrangement.around);
    Columns::new(filaments, arrangement.rows)
        .settled(&expectation)
        .is_some()
}

/// The longest steady stretch before the column `end`, or all columns if none is requested.
///
/// # Errors
/// If there is none.
pub fn find(
    filaments: &[FilamentResult],
    end: usize,
    settings: &Settings,
    pass: &Pass,
    arrangement: &Arrangement,
) -> Result<Stretch, BrushError> {
    let brush = settings.brush_or_default();
    let (columns, rows) = (arrangement.columns, arrangement.rows);
    if !brush.steady {
        let all = Columns::new(filaments, rows);
        return Ok(if columns > 1 {
            all.from(0, columns)
        } else {
            Stretch::default()
        });
    }
    let expectation = Expectation::new(settings, pass, arrangement.around);
    let Expectation { entry, length, .. } = expectation;
    let counted = Columns::new(&filaments[..end * rows], rows);
    let of_irregular = || {
        let is_steady = |means: &[f64]| {
            let part = means.len() / 4;
            let [mean, deviation] = mean_and_deviation(means);
            has_parts_within(
                means,
                part,
                (STANDARD_ERRORS * deviation / (part as f64).sqrt()).max(STEADY * mean),
            )
        };
        // Chance hides what the entry does.
        counted
            .first(2 * entry / 3, length, is_steady)
            .map(|first| counted.from(first, columns))
    };
    let found = if super::filaments::differ(settings) || brush.pattern == Pattern::Random {
        of_irregular()
    } else {
        let of_equal = || {
            let first = counted.first(1, length, |means| has_equal_parts(means, STEADY));
            first.map(|first| counted.from(first, columns))
        };
        // Sparse rows of equal filaments may alternate, and never settle.
        let may_alternate = brush.columns.is_none();
        counted
            .settled(&expectation)
            .or_else(of_equal)
            .or_else(|| of_irregular().filter(|_| may_alternate))
    };
    found.ok_or_else(|| {
        let drift = (end > 2).then(|| counted.from(end / 2, columns).drift.abs());
        expectation.too_few(arrangement, drift)
    })
}

/// Whether there can be the steady stretch that is requested.
///
/// # Errors
/// If the columns that may count are fewer than any stretch has.
pub fn check_columns(
    settings: &Settings,
    pass: &Pass,
    arrangement: &Arrangement,
) -> Result<(), BrushError> {
    let expectation = Expectation::new(settings, pass, arrangement.around);
    let few = columns_that_may_count(settings, pass, arrangement) < expectation.length;
    if settings.brush_or_default().steady && few {
        Err(expectation.too_few(arrangement, None))
    } else {
        Ok(())
    }
}

/// Columns that may count, from the first one.
struct Columns<'a> {
    filaments: &'a [FilamentResult],
    rows: usize,
    /// The mean impulse of each.
    means: Vec<f64>,
}

impl<'a> Columns<'a> {
    fn new(filaments: &'a [FilamentResult], rows: usize) -> Self {
        let means = filaments
            .chunks(rows)
            .map(|column| column.iter().map(impulse).sum::<f64>() / column.len() as f64);
        Self {
            filaments,
            rows,
            means: means.collect(),
        }
    }

    /// The first column, not before `earliest`, from which at least `length` columns are steady.
    fn first(
        &self,
        earliest: usize,
        length: usize,
        is_steady: impl Fn(&[f64]) -> bool,
    ) -> Option<usize> {
        let mut firsts = earliest..(self.means.len() + 1).saturating_sub(length);
        firsts.find(|first| is_steady(&self.means[*first..]))
    }

    /// The longest stretch that has settled.
    fn settled(&self, &Expectation { exit, length, .. }: &Expectation) -> Option<Stretch> {
        let first = self.first(1, length.max(SETTLED_COLUMNS), |means| {
            has_equal_parts(means, SETTLED)
        })?;
        let stretch = self.from(first, self.means.len() + exit);
        (stretch.change_with_more_columns.abs() <= SETTLED_CHANGE).then_some(stretch)
    }

    /// The stretch from the column `first` on, in a sector of so many `columns`.
    fn from(&self, first: usize, columns: usize) -> Stretch {
        let counted: Vec<f64> = self.filaments[first * self.rows..]
            .iter()
            .map(impulse)
            .collect();
        let [mean, deviation] = mean_and_deviation(&counted);
        let means = &self.means[first..];
        let part = |values: &[f64]| mean_and_deviation(values)[0];
        let half = means.len() / 2;
        let drift = part(&means[means.len() - half..]) - part(&means[..half]);
        // Where the trend goes on along a quarter more columns, these have this mean.
        let (more, length) = (columns.div_ceil(4) as f64, means.len() as f64);
        let later = mean + drift / (0.5 * length) * 0.5 * (length + more);
        let change = (later - mean) * more / (length + more);
        let relative = |value: f64| if mean > 0.0 { value / mean } else { 0.0 };
        Stretch {
            first,
            last: self.means.len() - 1,
            scatter: relative(deviation),
            drift: relative(drift),
            change_with_more_columns: relative(change),
        }
    }
}

fn impulse(filament: &FilamentResult) -> f64 {
    filament.metrics.contact_normal_impulse_n_s
}

fn has_equal_parts(means: &[f64], share: f64) -> bool {
    has_parts_within(means, PART, share * mean_and_deviation(means)[0])
}

/// Whether the means of the parts of so many columns differ from that of all by no more than is
/// `allowed`.
fn has_parts_within(means: &[f64], part: usize, allowed: f64) -> bool {
    let mean = mean_and_deviation(means)[0];
    means
        .chunks_exact(part)
        .all(|part| (mean_and_deviation(part)[0] - mean).abs() <= allowed)
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / (count - 1.0).max(1.0);
    [mean, variance.sqrt()]
}
