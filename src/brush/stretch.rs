//! The steady stretch of a sector: the longest suffix of columns whose impulse has no trend.
//!
//! The first filaments meet an empty gap. Their impulses differ from later ones over the columns
//! that pass in about half a period of a filament and most of a contact. The last filaments have
//! none behind them, which matters for the columns that pass during a contact. Both were found from
//! rows at 2 to 30 m/s and depths of 0.5 to 3 mm (docs/methods.md).
//!
//! Impulses of neighbouring columns are correlated, so that columns are taken in batches of `⌊√n⌋`
//! (Flegal and Jones, Annals of Statistics 38, 2010). There is no trend if the means of all batches
//! are equal: to a share of the tolerance, or by an analysis of variance. Batches also give the
//! standard error of the mean.

use std::f64::consts::TAU;

use super::arrangement::Arrangement;
use super::error::BrushError;
use super::result::{FilamentResult, Stretch};
use crate::model::filament::first_natural_frequency;
use crate::model::settings::Settings;
use crate::simulation::{Batches, Pass};

/// Least length of a stretch in columns: four batches of four.
const MIN_COLUMNS: usize = 16;

/// Expected influence of the ends of a sector, in columns.
struct Expectation {
    entry: usize,
    exit: usize,
    /// Least length of a stretch: along shorter ones impulses rise and fall.
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
            length: ((0.5 * contact).ceil() as usize).max(MIN_COLUMNS),
        }
    }

    /// Returns the error of too few columns, with the `change` of the mean impulse along the best
    /// stretch, if simulated.
    fn too_few(&self, arrangement: &Arrangement, change: Option<f64>) -> BrushError {
        let Arrangement {
            columns, around, ..
        } = *arrangement;
        let needed = (self.entry + self.length + self.exit).max(columns + columns.div_ceil(3));
        BrushError::TooFewColumns {
            columns,
            needed,
            around: around.floor() as usize,
            change,
        }
    }
}

/// Returns the number of columns of a sector whose settings do not state it.
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
        MIN_COLUMNS
    };
    needed.min(around.floor() as usize)
}

/// Returns the expected number of columns of the stretch and before it.
pub fn expected_to_count(settings: &Settings, pass: &Pass, arrangement: &Arrangement) -> usize {
    let Expectation { entry, length, .. } = Expectation::new(settings, pass, arrangement.around);
    (entry + length).min(columns_that_may_count(settings, pass, arrangement))
}

/// Returns the number of columns that may count, from the first one. Those behind them only serve
/// as neighbours.
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

/// Returns `true` if the columns of `filaments`, which have passed, end with a steady stretch to
/// which more columns would add nothing: its batch means are equal to a share of the tolerance.
pub fn has_settled(
    filaments: &[FilamentResult],
    settings: &Settings,
    pass: &Pass,
    arrangement: &Arrangement,
) -> bool {
    let expectation = Expectation::new(settings, pass, arrangement.around);
    let means = column_means(filaments, arrangement.rows);
    let tolerance = settings.brush_or_default().tolerance;
    first_column(&means, &expectation, |batches| batches.are_equal(tolerance)).is_some()
}

/// Returns the longest steady stretch before the column `end`, or all columns if none is requested.
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
    let means = column_means(filaments, arrangement.rows);
    if !brush.steady {
        // All columns are requested: only filaments that differ make them a sample.
        let standard_error = if super::filaments::differ(settings) {
            Batches::new(&means).standard_error()
        } else {
            0.0
        };
        return Ok(Stretch {
            first: 0,
            last: means.len() - 1,
            standard_error,
        });
    }
    let expectation = Expectation::new(settings, pass, arrangement.around);
    let means = &means[..end];
    let first = first_column(means, &expectation, |batches| {
        batches.are_equal(brush.tolerance)
    })
    .or_else(|| first_column(means, &expectation, Batches::have_no_trend));
    let Some(first) = first else {
        let change = (end > 2).then(|| Batches::new(&means[end / 2..]).largest_difference());
        return Err(expectation.too_few(arrangement, change));
    };
    Ok(Stretch {
        first,
        last: end - 1,
        standard_error: Batches::new(&means[first..]).standard_error(),
    })
}

/// Checks that the requested steady stretch is possible.
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

/// Returns the mean impulse of each column in N s.
fn column_means(filaments: &[FilamentResult], rows: usize) -> Vec<f64> {
    let impulse = |filament: &FilamentResult| filament.metrics.contact_normal_impulse_n_s;
    filaments
        .chunks(rows)
        .map(|column| column.iter().map(impulse).sum::<f64>() / column.len() as f64)
        .collect()
}

/// Returns the first column from which on batches of the columns' `means` are steady.
fn first_column(
    means: &[f64],
    &Expectation { entry, length, .. }: &Expectation,
    are_steady: impl Fn(&Batches) -> bool,
) -> Option<usize> {
    // Chance may hide the influence of the entry.
    let mut firsts = 2 * entry / 3..(means.len() + 1).saturating_sub(length);
    firsts.find(|first| are_steady(&Batches::new(&means[*first..])))
}
