//! The steady stretch of a sector: the columns whose impulse no longer depends on where the sector ends.
//!
//! The first filaments meet an empty gap. What they do differs from what later ones do for as many columns as pass in about half a
//! period of a filament and most of a contact. The last filaments have none behind them, which matters for as many columns as pass
//! during a contact. Both were found from rows at 2 to 30 m/s and depths of 0.5 to 3 mm (docs/design.md).

use std::f64::consts::TAU;

use super::arrangement::Arrangement;
use super::error::BrushError;
use super::result::{FilamentResult, Stretch};
use crate::model::filament::first_natural_frequency;
use crate::model::settings::Settings;
use crate::simulation::Pass;

/// A stretch is steady if the means of its parts differ from its own by less than this share of it.
const STEADY: f64 = 3e-3;
/// Number of columns of a part.
const PART: usize = 5;
/// Where filaments differ, the parts are quarters, and may also differ by so many times the standard error of their means.
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
        let half_period = 0.5 * TAU / first_natural_frequency(&settings.filament) * pass.tool().rate / pitch;
        Self {
            entry: (1.2 * (half_period + 0.6 * contact)).ceil() as usize,
            exit: (0.8 * contact).ceil() as usize + 3,
            length: ((0.5 * contact).ceil() as usize).max(SHORTEST),
        }
    }
}

/// Number of columns of a sector whose settings do not state it.
pub fn default_columns(settings: &Settings, pass: &Pass, rows: usize) -> usize {
    let around = settings.tool.filament_count / rows as f64;
    let brush = settings.brush_or_default();
    let Expectation { entry, exit, length } = Expectation::new(settings, pass, around);
    let needed = if brush.steady { entry + length + exit } else { SHORTEST };
    needed.min(around.floor() as usize)
}

/// The number of columns that may count, from the first one. Those behind them are there only so that these are not the last ones.
pub fn columns_that_may_count(settings: &Settings, pass: &Pass, arrangement: &Arrangement) -> usize {
    if !settings.brush_or_default().steady || arrangement.is_closed() {
        return arrangement.columns;
    }
    let Expectation { exit, .. } = Expectation::new(settings, pass, arrangement.around);
    arrangement.columns.saturating_sub(exit)
}

/// The longest steady stretch, or all columns if none is requested.
///
/// # Errors
/// If there is none.
pub fn find(
    filaments: &[FilamentResult],
    settings: &Settings,
    pass: &Pass,
    arrangement: &Arrangement,
) -> Result<Stretch, BrushError> {
    let brush = settings.brush_or_default();
    let (columns, rows) = (arrangement.columns, arrangement.rows);
    let impulse = |filament: &FilamentResult| filament.metrics.contact_normal_impulse_n_s;
    let means: Vec<f64> =
        filaments.chunks(rows).map(|column| column.iter().map(impulse).sum::<f64>() / column.len() as f64).collect();
    let describe = |first: usize, last: usize| {
        let counted: Vec<f64> = filaments[first * rows..(last + 1) * rows].iter().map(impulse).collect();
        let [mean, deviation] = mean_and_deviation(&counted);
        let part = |values: &[f64]| mean_and_deviation(values)[0];
        let half = (last + 1 - first) / 2;
        let drift = part(&means[last + 1 - half..=last]) - part(&means[first..first + half]);
        // Where the trend goes on along a quarter more columns, these have this mean.
        let more = columns.div_ceil(4) as f64;
        let length = (last + 1 - first) as f64;
        let later = mean + drift / (0.5 * length) * 0.5 * (length + more);
        let change = (later - mean) * more / (length + more);
        let relative = |value: f64| if mean > 0.0 { value / mean } else { 0.0 };
        Stretch {
            first,
            last,
            scatter: relative(deviation),
            drift: relative(drift),
            change_with_more_columns: relative(change),
        }
    };
    let whole =
        || if columns > 1 { describe(0, columns - 1) } else { Stretch { first: 0, last: 0, ..Stretch::default() } };
    if !brush.steady {
        return Ok(whole());
    }
    let end = columns_that_may_count(settings, pass, arrangement);
    let Expectation { entry, exit, length } = Expectation::new(settings, pass, arrangement.around);
    let differ = super::filaments::differ(settings) || brush.pattern == crate::model::settings::Pattern::Random;
    let is_steady = |first: usize| {
        let counted = &means[first..end];
        let [mean, deviation] = mean_and_deviation(counted);
        let part = if differ { counted.len() / 4 } else { PART };
        let allowed = if differ { STANDARD_ERRORS * deviation / (part as f64).sqrt() } else { 0.0 };
        let allowed = allowed.max(STEADY * mean);
        counted.chunks_exact(part).all(|part| (mean_and_deviation(part)[0] - mean).abs() <= allowed)
    };
    // Where filaments differ, chance hides what the entry does.
    let earliest = if differ { 2 * entry / 3 } else { 1 };
    let first = (earliest..(end + 1).saturating_sub(length)).find(|first| is_steady(*first));
    first.map(|first| describe(first, end - 1)).ok_or_else(|| {
        let drift = if end > 2 { describe(end / 2, end - 1).drift } else { 1.0 };
        let needed = (entry + length + exit).max(columns + columns.div_ceil(3));
        BrushError::TooFewColumns { columns, needed, around: arrangement.around.floor() as usize, drift: drift.abs() }
    })
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    [mean, variance.sqrt()]
}
