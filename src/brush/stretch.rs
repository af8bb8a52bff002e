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

use spec_math::cephes64::fdtrc;

use super::arrangement::Arrangement;
use super::error::BrushError;
use super::result::{FilamentResult, Stretch};
use crate::model::filament::first_natural_frequency;
use crate::model::settings::Settings;
use crate::simulation::Pass;

/// Batch means are equal if they differ from the mean by less than this share of the tolerance.
const EQUAL_SHARE: f64 = 1.0 / 3.0;
/// Significance level above which batch means differ by chance.
const SIGNIFICANCE: f64 = 0.01;
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

/// Columns in batches of equal size. Columns left over by division, at the front, are in none.
struct Batches {
    mean: f64,
    /// Mean of each batch.
    means: Vec<f64>,
    /// Number of columns of a batch.
    size: usize,
    /// Sum of the squared deviations of columns from the means of their batches.
    within: f64,
}

impl Batches {
    fn new(columns: &[f64]) -> Self {
        let size = columns.len().isqrt().max(1);
        let batches = columns.rchunks_exact(size);
        let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let means: Vec<f64> = batches.clone().map(mean_of).collect();
        let within = batches
            .zip(&means)
            .flat_map(|(batch, mean)| batch.iter().map(move |value| (value - mean).powi(2)))
            .sum();
        Self {
            mean: mean_of(columns),
            means,
            size,
            within,
        }
    }

    /// Returns `true` if all batch means equal the mean, to a share of the `tolerance`.
    fn are_equal(&self, tolerance: f64) -> bool {
        let allowed = EQUAL_SHARE * tolerance * self.mean;
        self.means
            .iter()
            .all(|mean| (mean - self.mean).abs() <= allowed)
    }

    /// Returns the sum of the squared deviations of the batch means.
    fn between(&self) -> f64 {
        let mean = self.means.iter().sum::<f64>() / self.means.len() as f64;
        self.means.iter().map(|of| (of - mean).powi(2)).sum()
    }

    /// Returns `true` if the means differ by chance only: a one-way analysis of variance.
    fn have_no_trend(&self) -> bool {
        let count = self.means.len() as f64;
        let [between, within] = [count - 1.0, count * (self.size as f64 - 1.0)];
        let ratio = self.size as f64 * self.between() / between / (self.within / within);
        ratio.is_finite() && fdtrc(between, within, ratio) > SIGNIFICANCE
    }

    /// Returns the relative standard error of the mean.
    fn standard_error(&self) -> f64 {
        let count = self.means.len() as f64;
        if count < 2.0 || self.mean <= 0.0 {
            return 0.0;
        }
        (self.between() / (count - 1.0) / count).sqrt() / self.mean
    }

    /// Returns the largest difference of two means, over the mean.
    fn largest_difference(&self) -> f64 {
        let [least, most] = self
            .means
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], mean| {
                [mean.min(least), mean.max(most)]
            });
        if self.mean > 0.0 {
            (most - least) / self.mean
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns columns that decay to a mean of one, and alternate about it.
    fn columns(decay: f64, alternation: f64) -> Vec<f64> {
        let column =
            |k: i32| 1.0 + decay * 0.9_f64.powi(k) + alternation * f64::from(1 - 2 * (k % 2));
        (0..64).map(column).collect()
    }

    #[test]
    fn a_decay_is_a_trend_and_an_alternation_is_none() {
        let batches = |decay, alternation| Batches::new(&columns(decay, alternation));
        assert!(!batches(0.1, 0.0).have_no_trend() && !batches(0.1, 0.0).are_equal(1e-3));
        assert!(batches(0.0, 0.1).have_no_trend() && batches(0.0, 0.1).are_equal(1e-3));
        assert!(batches(1e-4, 0.0).are_equal(1e-3) && !batches(1e-4, 0.0).have_no_trend());
    }

    /// Independent columns: `σ/√n`.
    #[test]
    fn the_standard_error_of_independent_columns_follows_from_their_deviation() {
        let mut random = fastrand::Rng::with_seed(1);
        let columns: Vec<f64> = (0..10_000)
            .map(|_| 1.0 + 0.1 * (random.f64() - 0.5))
            .collect();
        let expected = 0.1 / 12.0_f64.sqrt() / 100.0;
        let error = Batches::new(&columns).standard_error();
        assert!((error / expected - 1.0).abs() < 0.2, "{error} {expected}");
    }
}
